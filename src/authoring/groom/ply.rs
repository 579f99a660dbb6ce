//! PLY files (`.ply`) with strands, as reconstructions from photographs write them, read: ascii and binary.
//!
//! | strands are recognised by | as written by |
//! |---|---|
//! | an element `strand` with `nsegs`, segments of each | hairutil, for CT2Hair |
//! | an element `edge` with `vertex1` and `vertex2` | MeshLab, Open3D, Blender |
//! | a list of vertex indices in any element but `face` | |
//! | a number of each vertex, `strand`, `strand_id` or `strand_index` | |
//! | runs of vertices of the same colour | NeuralHaircut, HAAR, GaussianHaircut |
//! | gaps between runs of as many vertices each | the same, without colours |
//!
//! The format specifies neither unit nor axes; reconstructions have Y up, and the size of a head that they
//! were fitted to: see [`Groom::odd_size`]. G. Turk, The PLY Polygon File Format, 1994.

use super::{
    Groom, GroomError, GroomFileError, GroomLosses,
    bytes::{Bytes, value},
    gltf::Chains,
    intake::Intake,
    losses::GroomPlace,
};
use bevy::prelude::*;
use core::str;

const EXPORT_AGAIN: &str = "export the file again";
/// Longer lines are no header's, and more properties no vertex's.
const LONGEST_LINE: usize = 1000;
const MOST_PROPERTIES: usize = 1000;
/// A gap between strands is so many times as long as the segment before.
const GAP: f32 = 4.0;

#[derive(Clone, Copy, PartialEq)]
enum Encoding {
    Ascii,
    Little,
    Big,
}

#[derive(Clone, Copy, PartialEq)]
enum Type {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    F32,
    F64,
}

impl Type {
    fn of(name: &str) -> Option<Self> {
        Some(match name {
            "char" | "int8" => Self::I8,
            "uchar" | "uint8" => Self::U8,
            "short" | "int16" => Self::I16,
            "ushort" | "uint16" => Self::U16,
            "int" | "int32" => Self::I32,
            "uint" | "uint32" => Self::U32,
            "float" | "float32" => Self::F32,
            "double" | "float64" => Self::F64,
            _ => return None,
        })
    }
}

struct Property<'a> {
    name: &'a str,
    /// The type of a list's length.
    list: Option<Type>,
    of: Type,
}

struct Element<'a> {
    name: &'a str,
    count: u64,
    properties: Vec<Property<'a>>,
}

impl Element<'_> {
    /// Where a property is among those that are no lists.
    fn find(&self, names: &[&str]) -> Option<usize> {
        let mut numbers = self.properties.iter().filter(|property| property.list.is_none());
        numbers.position(|property| names.contains(&property.name))
    }
}

/// The numbers behind the header.
struct Body<'a> {
    bytes: Bytes<'a>,
    at: u64,
    encoding: Encoding,
}

impl<'a> Body<'a> {
    fn word(&mut self) -> Result<&'a str, GroomFileError> {
        let rest = self.bytes.0.get(self.at as usize..).unwrap_or_default();
        let start = rest.iter().position(|b| !b.is_ascii_whitespace()).unwrap_or(rest.len());
        let rest = &rest[start..];
        let end = rest.iter().position(u8::is_ascii_whitespace).unwrap_or(rest.len());
        self.at += start as u64;
        self.bytes.array(self.at, 1, 1, "a number")?;
        let word = str::from_utf8(&rest[..end]).unwrap_or("?");
        self.at += end as u64;
        Ok(word)
    }

    fn number(&mut self, of: Type) -> Result<f64, GroomFileError> {
        if self.encoding == Encoding::Ascii {
            let word = self.word()?;
            return word.parse().or_else(|_| {
                let found = format!("{:?}", word.chars().take(20).collect::<String>());
                let at = self.at - word.len() as u64;
                value(at, "a number", found, "digits and a decimal point", EXPORT_AGAIN)
            });
        }
        macro_rules! number {
            ($type:ty) => {{
                let size = size_of::<$type>();
                let bytes = self.bytes.array(self.at, 1, size as u64, "a number")?;
                self.at += size as u64;
                let bytes = *bytes.first_chunk().unwrap_or(&[0; size_of::<$type>()]);
                match self.encoding {
                    Encoding::Big => <$type>::from_be_bytes(bytes).into(),
                    _ => <$type>::from_le_bytes(bytes).into(),
                }
            }};
        }
        Ok(match of {
            Type::I8 => number!(i8),
            Type::U8 => number!(u8),
            Type::I16 => number!(i16),
            Type::U16 => number!(u16),
            Type::I32 => number!(i32),
            Type::U32 => number!(u32),
            Type::F32 => number!(f32),
            Type::F64 => number!(f64),
        })
    }

    /// Calls `row` with the numbers of each row and those of its last list.
    fn rows(
        &mut self,
        element: &Element<'_>,
        mut row: impl FnMut(&[f64], &[f64]) -> Result<(), GroomFileError>,
    ) -> Result<(), GroomFileError> {
        if element.properties.is_empty() {
            return Ok(());
        }
        let (mut numbers, mut list) = (Vec::new(), Vec::new());
        for _ in 0..element.count {
            numbers.clear();
            list.clear();
            for property in &element.properties {
                match property.list {
                    None => numbers.push(self.number(property.of)?),
                    Some(length) => {
                        let length = self.number(length)?;
                        list.clear();
                        // `as` saturates; what is not there is an error.
                        for _ in 0..length as u64 {
                            list.push(self.number(property.of)?);
                        }
                    }
                }
            }
            row(&numbers, &list)?;
        }
        Ok(())
    }
}

/// The elements of a header, and what follows it.
fn header(file: &[u8]) -> Result<(Vec<Element<'_>>, Body<'_>), GroomFileError> {
    let bytes = Bytes(file);
    let (mut elements, mut encoding) = (Vec::<Element<'_>>::new(), None);
    let mut at = 0;
    loop {
        let rest = &file[at..];
        let ahead = &rest[..rest.len().min(LONGEST_LINE)];
        let Some(end) = ahead.iter().position(|b| *b == b'\n' || *b == b'\r') else {
            bytes.array(at as u64, 1 + ahead.len() as u64, 1, "the header")?;
            return value(at as u64, "a line", "too long", "the header's end", EXPORT_AGAIN);
        };
        let line = str::from_utf8(&rest[..end]).unwrap_or("?").trim();
        let offset = at as u64;
        at += end + if rest[end..].starts_with(b"\r\n") { 2 } else { 1 };
        let wrong = |expected: &str| value(offset, "a line", line, expected, EXPORT_AGAIN);
        let words: Vec<&str> = line.split_ascii_whitespace().collect();
        match words[..] {
            [] | ["ply"] | ["comment" | "obj_info", ..] => {}
            ["format", "ascii", ..] => encoding = Some(Encoding::Ascii),
            ["format", "binary_little_endian", ..] => encoding = Some(Encoding::Little),
            ["format", "binary_big_endian", ..] => encoding = Some(Encoding::Big),
            ["element", name, count] => match count.parse() {
                Ok(count) => elements.push(Element { name, count, properties: Vec::new() }),
                Err(_) => return wrong("element, its name and count"),
            },
            ["property", ref of @ .., name] => {
                let types = match *of {
                    ["list", length, of] => Type::of(length).map(Some).zip(Type::of(of)),
                    [of] => Type::of(of).map(|of| (None, of)),
                    _ => None,
                };
                let element = elements.last_mut().filter(|e| e.properties.len() < MOST_PROPERTIES);
                let Some(((list, of), element)) = types.zip(element) else {
                    return wrong("a property of an element, its type and name");
                };
                element.properties.push(Property { name, list, of });
            }
            ["end_header"] => break,
            _ => return wrong("format, element, property or end_header"),
        }
    }
    let Some(encoding) = encoding else {
        return value(0, "the header", "without a format", "a line of it", EXPORT_AGAIN);
    };
    Ok((elements, Body { bytes, at: at as u64, encoding }))
}

/// What tells strands apart, beside places.
#[derive(Default)]
struct Found {
    points: Vec<Vec3>,
    colors: Vec<LinearRgba>,
    widths: Vec<f32>,
    /// A number of each vertex.
    numbers: Vec<f64>,
    segments: Vec<u32>,
    edges: Vec<u32>,
    /// Vertices of all lines, and where each line ends.
    lines: Vec<u32>,
    line_ends: Vec<usize>,
}

/// A groom from the bytes of a `.ply` file, in the file's own unit and axes, and what was left out.
///
/// A vertex's `thickness` or `width` is its diameter, `radius` half of it; colours are sRGB where they are
/// bytes. Colours that only tell strands apart are not read. Faces are skipped and counted.
///
/// # Errors
/// When the header or the numbers are broken, it is not known which vertices are a strand, or no strand is
/// left.
pub fn read(file: &[u8]) -> Result<(Groom, GroomLosses), GroomFileError> {
    intake(file).map(|intake| (intake.groom, intake.losses))
}

pub(super) fn intake(file: &[u8]) -> Result<Intake, GroomFileError> {
    let (elements, mut body) = header(file)?;
    let (mut found, mut losses) = (Found::default(), GroomLosses::default());
    for element in &elements {
        read_element(element, &mut body, (&mut found, &mut losses))?;
    }
    // Lines of text may end after the last number.
    let rest = body.bytes.0.get(body.at as usize..).unwrap_or_default();
    if !rest.trim_ascii().is_empty() {
        losses.unread_bytes.add_many(rest.len(), GroomPlace::Byte(body.at));
    }
    if found.points.is_empty() {
        let hint = "export strands as vertices with edges";
        return value(0, "the file", "without vertices", "x, y, z of an element vertex", hint);
    }
    Ok(Intake::cleaned(strands(found, &mut losses)?, losses)?)
}

fn read_element(
    element: &Element<'_>,
    body: &mut Body<'_>,
    (found, losses): (&mut Found, &mut GroomLosses),
) -> Result<(), GroomFileError> {
    let all = |names: [&str; 3]| {
        let [a, b, c] = names.map(|name| element.find(&[name]));
        Some([a?, b?, c?])
    };
    let is_list = |property: &&Property<'_>| property.list.is_some();
    match element.name {
        "vertex" if all(["x", "y", "z"]).is_some() => {
            let places = all(["x", "y", "z"]).unwrap_or_default();
            let colors = all(["red", "green", "blue"]);
            let alpha = element.find(&["alpha"]);
            let is_byte = |p: &Property<'_>| p.name == "red" && p.of == Type::U8;
            let is_bytes = element.properties.iter().any(is_byte);
            let width = element.find(&["thickness", "width", "radius"]);
            let of_width = if element.find(&["thickness", "width"]).is_some() { 1.0 } else { 2.0 };
            let number = element.find(&["strand", "strand_id", "strand_index"]);
            body.rows(element, |row, _| {
                found.points.push(Vec3::from_array(places.map(|k| row[k] as f32)));
                found.widths.extend(width.map(|k| row[k] as f32 * of_width));
                found.numbers.extend(number.map(|k| row[k]));
                found.colors.extend(colors.map(|colors| {
                    let share = if is_bytes { 1.0 / 255.0 } else { 1.0 };
                    let [red, green, blue] = colors.map(|k| row[k] as f32 * share);
                    let alpha = alpha.map_or(1.0, |k| row[k] as f32 * share);
                    match is_bytes {
                        true => Srgba { red, green, blue, alpha }.into(),
                        false => LinearRgba { red, green, blue, alpha },
                    }
                }));
                Ok(())
            })
        }
        "strand" if element.find(&["nsegs"]).is_some() => {
            let segments = element.find(&["nsegs"]).unwrap_or_default();
            body.rows(element, |row, _| {
                found.segments.push(row[segments] as u32);
                Ok(())
            })
        }
        "edge" => {
            let ends = element.find(&["vertex1"]).zip(element.find(&["vertex2"]));
            body.rows(element, |row, _| {
                found.edges.extend(ends.iter().flat_map(|(a, b)| [row[*a] as u32, row[*b] as u32]));
                Ok(())
            })
        }
        "face" | "tristrips" => {
            losses.skipped_primitives.add_many(
                usize::try_from(element.count).unwrap_or(usize::MAX),
                GroomPlace::Part(element.name.to_owned()),
            );
            body.rows(element, |_, _| Ok(()))
        }
        _ => {
            let list = element.properties.iter().rfind(is_list);
            let is_lines = list.is_some_and(|list| list.name.starts_with("vertex_ind"));
            body.rows(element, |_, list| {
                if is_lines {
                    found.lines.extend(list.iter().map(|i| *i as u32));
                    found.line_ends.push(found.lines.len());
                }
                Ok(())
            })
        }
    }
}

/// Makes strands of vertices by what the file has to tell them apart.
fn strands(mut found: Found, losses: &mut GroomLosses) -> Result<Groom, GroomFileError> {
    let count = found.points.len();
    u32::try_from(count).map_err(|_| GroomError::TooMany { found: count })?;
    let beyond = |i: u32| i as usize >= count;
    if let Some(i) = found.edges.iter().chain(&found.lines).find(|i| beyond(**i)) {
        let expected = format!("below {count}, the count of vertices");
        return value(0, "an index of a vertex", *i, expected, EXPORT_AGAIN);
    }
    if !found.lines.is_empty() {
        let starts = [0].into_iter().chain(found.line_ends.iter().copied());
        let lines = starts.zip(&found.line_ends).map(|(from, to)| &found.lines[from..*to]);
        return picked(&found, lines, count);
    }
    if found.segments.is_empty() && !found.edges.is_empty() {
        return picked(&found, Chains::of_edges(&found.edges).iter(), count);
    }
    let ends: Vec<u32> = if !found.segments.is_empty() {
        let mut end = 0u32;
        let next = |segments: &u32| {
            end = end.saturating_add(*segments).saturating_add(1);
            end
        };
        found.segments.iter().map(next).collect()
    } else if !found.numbers.is_empty() {
        runs(count, |i| found.numbers[i] != found.numbers[i - 1])
    } else {
        let by_color = match found.colors.is_empty() {
            true => Vec::new(),
            false => runs(count, |i| found.colors[i] != found.colors[i - 1]),
        };
        // Single vertices of a colour are no strands, and one colour tells nothing.
        if by_color.len() > 1 && 2 * by_color.len() <= count {
            found.colors.clear();
            let part = "colours, which tell strands apart".to_owned();
            losses.unread_arrays.add(GroomPlace::Part(part));
            by_color
        } else {
            even_runs(&found.points).unwrap_or_default()
        }
    };
    if ends.last() != Some(&(count as u32)) {
        let found = match ends.last() {
            None => format!("{count} without edges, strands or colours that tell strands apart"),
            Some(_) => format!("{count}, unlike those of its strands"),
        };
        let hint = "write edges (vertex1, vertex2), or an element strand with nsegs";
        return value(0, "the count of vertices", found, "vertices of whole strands", hint);
    }
    let Found { points, colors, widths, .. } = found;
    Ok(Groom::raw(points, ends, widths, colors, Vec::new()))
}

/// Ends of runs, where a vertex begins another one.
fn runs(count: usize, begins: impl Fn(usize) -> bool) -> Vec<u32> {
    (1..=count).filter(|i| *i == count || begins(*i)).map(|i| i as u32).collect()
}

/// Ends of runs of as many vertices each, if there are gaps between them.
fn even_runs(points: &[Vec3]) -> Option<Vec<u32>> {
    let apart = |i: usize| points[i].distance(points[i - 1]);
    let is_gap = |i: usize| apart(i) > GAP * apart(i - 1);
    let each = (2..points.len()).find(|i| is_gap(*i))?;
    let is_even = points.len().is_multiple_of(each);
    // Strands may be beside each other, but few are.
    let gaps = (each..points.len()).step_by(each).filter(|i| is_gap(*i)).count();
    let ends = || (1..=points.len() / each).map(|i| (i * each) as u32).collect();
    (is_even && 10 * (gaps + 1) >= 9 * (points.len() / each)).then(ends)
}

/// Strands through these vertices.
fn picked<'a>(
    found: &Found,
    lines: impl Iterator<Item = &'a [u32]>,
    count: usize,
) -> Result<Groom, GroomFileError> {
    let mut groom = Groom::default();
    for line in lines {
        for i in line.iter().map(|i| *i as usize) {
            groom.points.push(found.points[i]);
            groom.widths.extend(found.widths.get(i));
            groom.colors.extend(found.colors.get(i));
        }
        if groom.points.len() > 4 * count {
            let expected = format!("at most {}", 4 * count);
            let hint = "export each strand once";
            return value(0, "the count of nodes", groom.points.len(), expected, hint);
        }
        groom.ends.push(groom.points.len() as u32);
    }
    Ok(groom)
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "element vertex 6\nproperty float x\nproperty float y\nproperty float z\n";
    const PLACES: [[f32; 3]; 6] = [
        [0.0, 0.0, 0.0],
        [0.0, 0.1, 0.0],
        [0.0, 0.2, 0.0],
        [1.0, 0.0, 0.0],
        [1.0, 0.1, 0.0],
        [1.0, 0.2, 0.0],
    ];

    /// An ascii file of two strands, with more of the header, of each vertex, and after them.
    fn ascii(properties: &str, of: impl Fn(usize) -> String, elements: &str, rows: &str) -> String {
        let vertex = |(i, [x, y, z]): (usize, &[f32; 3])| format!("{x} {y} {z} {}\n", of(i));
        let vertices: String = PLACES.iter().enumerate().map(vertex).collect();
        format!(
            "ply\nformat ascii 1.0\ncomment made here\n{HEAD}{properties}{elements}end_header\n{vertices}{rows}"
        )
    }

    fn lengths(file: &[u8]) -> Vec<usize> {
        let (groom, _) = read(file).unwrap_or_else(|error| panic!("{error}"));
        groom.strands().map(|s| s.points.len()).collect()
    }

    #[test]
    fn strands_are_kept_apart_by_whatever_there_is() {
        let none = |_| String::new();
        let segments = "element strand 2\nproperty ushort nsegs\n";
        assert_eq!(lengths(ascii("", none, segments, "3\n1\n").as_bytes()), [4, 2]);
        let edges = "element edge 4\nproperty int vertex1\nproperty int vertex2\n";
        assert_eq!(lengths(ascii("", none, edges, "0 1\n1 2\n3 4\n4 5\n").as_bytes()), [3, 3]);
        let lines = "element line 2\nproperty list uchar int vertex_indices\n";
        assert_eq!(lengths(ascii("", none, lines, "2 0 1\n4 2 3 4 5\n").as_bytes()), [2, 4]);
        let number = "property int strand_id\n";
        assert_eq!(lengths(ascii(number, |i| (i / 2).to_string(), "", "").as_bytes()), [2, 2, 2]);
        let colors = "property uchar red\nproperty uchar green\nproperty uchar blue\n";
        let runs = ascii(colors, |i| format!("{} 7 7", 50 * (i / 3)), "", "");
        let (groom, losses) = read(runs.as_bytes()).unwrap();
        assert!(groom.len() == 2 && groom.colors.is_empty() && losses.unread_arrays.count == 1);
        // By gaps, if colours say nothing.
        let (groom, _) = read(ascii(colors, |_| "255 0 0".to_owned(), "", "").as_bytes()).unwrap();
        assert_eq!((groom.len(), groom.colors[5]), (2, LinearRgba::RED));
        assert_eq!(lengths(ascii("", none, "", "").replace('\n', "\r\n").as_bytes()), [3, 3]);
        let widths = ascii("property float radius\n", |_| "0.25".to_owned(), "", "");
        assert_eq!(read(widths.as_bytes()).unwrap().0.widths[..], [0.5; 6]);
        let faces = "element face 1\nproperty list uchar int vertex_indices\n";
        assert_eq!(
            read(ascii("", none, faces, "3 0 1 2\n").as_bytes())
                .unwrap()
                .1
                .skipped_primitives
                .count,
            1
        );
        for (file, says) in [
            (ascii("", none, segments, "3\n3\n"), "unlike those of its strands"),
            (ascii("", none, edges, "0 1\n1 2\n3 4\n4 6\n"), "an index of a vertex is 6"),
            (ascii("", |_| "1,5".to_owned(), "", ""), "a decimal point"),
            (ascii("property what s\n", none, "", ""), "its type and name"),
        ] {
            let error = read(file.as_bytes()).unwrap_err().to_string();
            assert!(error.starts_with("byte ") && error.contains(says), "{error}");
        }
    }

    #[test]
    fn both_binary_orders_are_read_and_cut_short_are_errors() {
        for (format, big) in [("binary_little_endian", false), ("binary_big_endian", true)] {
            let bytes = |x: &f32| if big { x.to_be_bytes() } else { x.to_le_bytes() };
            let mut file = format!("ply\nformat {format} 1.0\n{HEAD}end_header\n").into_bytes();
            file.extend(PLACES.iter().flatten().flat_map(bytes));
            let (groom, losses) = read(&file).unwrap();
            assert!(losses.is_empty() && groom.points() == PLACES.map(Vec3::from_array));
            assert_eq!(groom.len(), 2);
            for end in 0..file.len() {
                let error = read(&file[..end]).unwrap_err().to_string();
                assert!(error.starts_with("byte ") && error.contains("expected"), "{error}");
            }
            file.push(1);
            assert_eq!(read(&file).unwrap().1.unread_bytes.count, 1);
        }
    }
}
