//! Cem Yuksel's HAIR files (`.hair`), read and written.
//!
//! A header of 128 bytes, then up to five arrays in a fixed order, present according to the
//! header's bits: segments per strand (u16), points (3 × f32), thickness (f32), transparency (f32),
//! colours (3 × f32). All little-endian, points root first. The format specifies neither unit nor
//! axes: see [`GroomSettings`](super::GroomSettings).

use super::{
    Groom, GroomError, GroomFileError, GroomLosses,
    bytes::{Bytes, some_strands, value},
    intake::Intake,
    losses::GroomPlace,
};
use bevy::prelude::*;

const MAGIC: &[u8; 4] = b"HAIR";
const HEADER: u64 = 128;
const SEGMENTS: u32 = 1;
const POINTS: u32 = 2;
const THICKNESS: u32 = 4;
const TRANSPARENCY: u32 = 8;
const COLOURS: u32 = 16;

/// Values of unset header fields, which say nothing about the hair.
const UNSET_THICKNESS: f32 = 1.0;
const UNSET_COLOUR: [f32; 3] = [1.0; 3];

/// A groom from the bytes of a `.hair` file, in the file's own unit and axes, and what was left out.
///
/// Thickness becomes the diameter of each node; transparency becomes one minus alpha of the colours.
/// Where an array is absent the header's default is used for every node, unless it is the unset
/// value: thickness 1 (or 0), transparency 0, white. Strands without segments or with a number that is not
/// finite or a thickness that is negative are left out and counted, and bytes after the end are counted; the
/// header's free text is not kept.
///
/// ```
/// # use bevy_keratin::authoring::groom::{Groom, yuksel}; use bevy::prelude::*;
/// let groom = Groom::from_polylines([[Vec3::ZERO, Vec3::Y * 0.1]]).unwrap();
/// let file = yuksel::write(&groom).unwrap();
/// assert_eq!(yuksel::read(&file).unwrap().0, groom);
/// println!("{}", yuksel::read(&file[..140]).unwrap_err());
/// ```
///
/// # Errors
/// When the header contradicts itself, the file is too short for it, or no strand is left.
pub fn read(file: &[u8]) -> Result<(Groom, GroomLosses), GroomFileError> {
    intake(file).map(|intake| (intake.groom, intake.losses))
}

pub(super) fn intake(file: &[u8]) -> Result<Intake, GroomFileError> {
    let bytes = Bytes(file);
    let magic = bytes.array(0, 4, 1, "the mark HAIR")?;
    if magic != MAGIC {
        let found = magic.escape_ascii();
        return value(0, "the mark", found, "HAIR", "check that this is a .hair file");
    }
    bytes.array(0, HEADER, 1, "header")?;
    let strands = u64::from(bytes.u32(4, "strand count")?);
    let nodes = u64::from(bytes.u32(8, "point count")?);
    let bits = bytes.u32(12, "array bits")?;
    if bits & POINTS == 0 || bits >= 2 * COLOURS {
        let expected = "bit 2 (points) set and none above 16";
        let hint = match bits.swap_bytes() {
            swapped if swapped & POINTS != 0 && swapped < 2 * COLOURS => {
                "the file is big-endian: swap its bytes or export it again, little-endian"
            }
            _ => EXPORT_AGAIN,
        };
        return value(12, "the array bits", format!("{bits:#x}"), expected, hint);
    }
    some_strands(4, strands)?;
    let has = |array: u32| u64::from(bits & array != 0);

    let mut at = HEADER;
    let counts = bytes.array(at, strands * has(SEGMENTS), 2, "segment counts")?;
    let (counts, _) = counts.as_chunks();
    let uniform = u64::from(bytes.u32(16, "default segment count")?);
    let total = match has(SEGMENTS) {
        0 => strands * (uniform + 1),
        _ => counts.iter().map(|c| u64::from(u16::from_le_bytes(*c)) + 1).sum(),
    };
    if total != nodes {
        let expected = format!("{total}, the points of {strands} strands with these segments");
        return value(8, "the point count", nodes, expected, EXPORT_AGAIN);
    }
    at += 2 * strands * has(SEGMENTS);

    let per_node = 12 + 4 * has(THICKNESS) + 4 * has(TRANSPARENCY) + 12 * has(COLOURS);
    // Cannot overflow: both factors are below 2³³.
    let length = at + nodes * per_node;
    bytes.array(at, nodes, per_node, "point data")?;
    let mut losses = GroomLosses::default();
    if let Some(rest @ 1..) = bytes.len().checked_sub(length) {
        losses.unread_bytes.add_many(rest as usize, GroomPlace::Byte(length));
    }

    let points = bytes.groups(at, nodes, "a point", Vec3::from_array)?;
    at += 12 * nodes;
    let thickness = bytes.groups(at, nodes * has(THICKNESS), "a thickness", |[t]| t)?;
    at += 4 * nodes * has(THICKNESS);
    let clear = bytes.groups(at, nodes * has(TRANSPARENCY), "a transparency", |[t]| t)?;
    at += 4 * nodes * has(TRANSPARENCY);
    let colours = bytes.groups(at, nodes * has(COLOURS), "a colour", |c| c)?;

    let header = |at, what| bytes.groups(at, 1, what, |[x]: [f32; 1]| x).map(|x| x[0]);
    let every = |x| vec![x; points.len()];
    let diameters = match has(THICKNESS) {
        0 => match header(20, "the default thickness")? {
            UNSET_THICKNESS | 0.0 => Vec::new(),
            thickness => every(thickness),
        },
        _ => thickness,
    };
    let default_clear = match has(TRANSPARENCY) {
        0 => header(24, "the default transparency")?,
        _ => 0.0,
    };
    let default_colour = match has(COLOURS) {
        0 => bytes.groups(28, 1, "the default colour", |c: [f32; 3]| c)?[0],
        _ => UNSET_COLOUR,
    };
    let coloured = bits & (TRANSPARENCY | COLOURS) != 0
        || default_clear != 0.0
        || default_colour != UNSET_COLOUR;
    let colour = |i: usize| {
        let [red, green, blue] = colours.get(i).copied().unwrap_or(default_colour);
        let alpha = 1.0 - clear.get(i).copied().unwrap_or(default_clear);
        LinearRgba { red, green, blue, alpha }
    };
    let colors = if coloured { (0..points.len()).map(colour).collect() } else { Vec::new() };

    let mut end = 0;
    let mut ends = Vec::with_capacity(strands.min(nodes) as usize);
    for i in 0..strands as usize {
        let segments = counts.get(i).map_or(uniform as u32, |c| u16::from_le_bytes(*c).into());
        // Below the point count, which has 32 bits.
        end += segments + 1;
        ends.push(end);
    }
    let raw = Groom::raw(points, ends, diameters, colors, Vec::new());
    Ok(Intake::cleaned(raw, losses)?)
}

const EXPORT_AGAIN: &str = "export the file again";

/// The bytes of a `.hair` file of this groom, in metres. Values equal for all strands or nodes go
/// into the header; the format has no UVs and no marks
/// of guides.
///
/// Reading what was written gives the same groom, and writing that the same bytes.
///
/// # Errors
/// When the groom is empty, a strand has more than 65,535 segments, or there are more strands than 32
/// bits count.
pub fn write(groom: &Groom) -> Result<Vec<u8>, GroomError> {
    if groom.is_empty() {
        return Err(GroomError::Empty);
    }
    let strands = u32::try_from(groom.len());
    let strands = strands.map_err(|_| GroomError::TooMany { found: groom.len() })?;
    let segments: Vec<usize> = groom.strands().map(|s| s.points.len() - 1).collect();
    if let Some(strand) = segments.iter().position(|s| *s > usize::from(u16::MAX)) {
        return Err(GroomError::TooManyNodes { strand, found: segments[strand] + 1 });
    }
    let same_segments = same(segments.iter().copied());
    let width = same(groom.widths.iter().copied());
    let width = width.filter(|w| ![UNSET_THICKNESS, 0.0].contains(w));
    let clear = same(groom.colors.iter().map(|c| 1.0 - c.alpha));
    let colour = same(groom.colors.iter().map(|c| c.to_f32_array_no_alpha()));
    let colour = colour.filter(|c| *c != UNSET_COLOUR);

    let mut bits = POINTS;
    let mut set = |bit, present: bool, is_same: bool| {
        bits |= if present && !is_same { bit } else { 0 };
    };
    set(SEGMENTS, true, same_segments.is_some());
    set(THICKNESS, !groom.widths.is_empty(), width.is_some());
    set(TRANSPARENCY, !groom.colors.is_empty(), clear.is_some());
    set(COLOURS, !groom.colors.is_empty(), colour.is_some());

    let mut file = Vec::with_capacity(128 + 2 * segments.len() + 32 * groom.points.len());
    file.extend(MAGIC);
    let counts = [strands, groom.points.len() as u32, bits, same_segments.unwrap_or(0) as u32];
    file.extend(counts.into_iter().flat_map(u32::to_le_bytes));
    let put = |file: &mut Vec<u8>, numbers: &[f32]| {
        file.extend(numbers.iter().flat_map(|x| x.to_le_bytes()));
    };
    put(&mut file, &[width.unwrap_or(UNSET_THICKNESS), clear.unwrap_or(0.0)]);
    put(&mut file, &colour.unwrap_or(UNSET_COLOUR));
    file.resize(HEADER as usize, 0);
    if bits & SEGMENTS != 0 {
        file.extend(segments.iter().flat_map(|s| (*s as u16).to_le_bytes()));
    }
    groom.points.iter().for_each(|p| put(&mut file, &p.to_array()));
    if bits & THICKNESS != 0 {
        put(&mut file, &groom.widths);
    }
    if bits & TRANSPARENCY != 0 {
        groom.colors.iter().for_each(|c| put(&mut file, &[1.0 - c.alpha]));
    }
    if bits & COLOURS != 0 {
        groom.colors.iter().for_each(|c| put(&mut file, &c.to_f32_array_no_alpha()));
    }
    Ok(file)
}

/// The common value, if all are equal.
fn same<T: PartialEq>(mut values: impl Iterator<Item = T>) -> Option<T> {
    let first = values.next()?;
    values.all(|v| v == first).then_some(first)
}
