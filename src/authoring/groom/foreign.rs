//! What a file is that is no groom that can be read.

const LINES: &str = "export the hair as Alembic (.abc), glTF lines, .hair or .tfx";
const OGAWA: &str = "export it again as Alembic of today (Ogawa); abcconvert -toOgawa does so too";
const UNPACK: &str = "unpack it and load what is inside";
const DOWNLOAD: &str =
    "a download left it in place of the file: fetch the file again and look at it";
const POINTER: &str =
    "the file's contents are not here: run `git lfs pull`, or download the raw file";
const SWAPPED: &str = "swap its bytes or export it again, little-endian";
const OLD: &str = "convert it to a binary .tfx of version 3 or 4 with TressFX's exporter";

const UNKNOWN: &str = "an unknown kind of file";

/// Beginnings of files, what they are, and what to do with them.
const KNOWN: [(&[u8], &str, &str); 26] = [
    (b"version https://git-lfs", "a Git LFS pointer", POINTER),
    (b"\x89HDF\r\n\x1a\n", "an HDF5 file, as Alembic archives of before 2013 are", OGAWA),
    (b"BLENDER", "a Blender file", LINES),
    (b"Kaydara FBX Binary", "an FBX file", LINES),
    (b"; FBX", "an FBX file (text)", LINES),
    (b"XPD", "an XGen file (.xpd)", LINES),
    (b"//Maya", "a Maya scene", LINES),
    (b"FOR4", "a Maya scene", LINES),
    (b"FOR8", "a Maya scene", LINES),
    (b"bgeo", "a Houdini geometry", LINES),
    (b"\x7fNSJb", "a Houdini geometry", LINES),
    (b"BINARY_HAIR", "hair of the Mitsuba renderer (binary)", LINES),
    (b"Shape \"curve\"", "curves of the pbrt renderer", LINES),
    (b"PK\x03\x04", "a ZIP archive", UNPACK),
    (b"\x1f\x8b", "a gzip archive", UNPACK),
    (b"7z\xbc\xaf\x27\x1c", "a 7z archive", UNPACK),
    (b"Rar!", "a RAR archive", UNPACK),
    (b"BZh", "a bzip2 archive", UNPACK),
    (b"\xfd7zXZ", "an xz archive", UNPACK),
    (b"\x28\xb5\x2f\xfd", "a Zstandard archive, or a compressed Blender file", UNPACK),
    (b"\x89PNG", "a PNG picture", "name the groom's own file"),
    (b"\xff\xd8\xff", "a JPEG picture", "name the groom's own file"),
    (b"DDS ", "a DDS picture", "name the groom's own file"),
    (b"404", "an error message of a web server", DOWNLOAD),
    (b"o ", "a Wavefront OBJ file", LINES),
    (b"v ", "a Wavefront OBJ file", LINES),
];

/// What the file is, as far as is known, and what to do.
pub(super) fn described(file: &[u8]) -> (String, &'static str) {
    if file.is_empty() {
        return ("an empty file".to_owned(), "fetch or export it again");
    }
    let text = file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file).trim_ascii_start();
    let known = |of: &[u8]| KNOWN.iter().find(|(start, ..)| of.starts_with(start)).copied();
    if let Some((_, what, hint)) = known(file).or_else(|| known(text)) {
        return (what.to_owned(), hint);
    }
    if let Some(found) = markup(text).or_else(|| tressfx(file, text)) {
        return found;
    }
    if text.is_empty() || file.iter().all(|byte| *byte == 0) {
        return ("nothing but blanks or zeros".to_owned(), "fetch or export it again");
    }
    let start = file[..file.len().min(8)].escape_ascii();
    if let Some(line) = numbers_of(text) {
        let found = format!("lines of numbers as text, such as {line:?}");
        return (found, LINES);
    }
    if is_dump(file) {
        let found = format!("numbers without a header (it begins with {start})");
        return (found, "write them with the header of a .hair: see yuksel::write");
    }
    (format!("{UNKNOWN} (it begins with {start})"), LINES)
}

/// Whether it is USD: binary, text, or a package, whose first entry is a layer.
pub(super) fn is_usd(file: &[u8]) -> bool {
    let first = || {
        let length = u16::from_le_bytes(*file.get(26..)?.first_chunk()?);
        let name = file.get(30..)?.get(..length.into())?;
        let extension = name.rsplit(|byte| *byte == b'.').next()?;
        Some([&b"usd"[..], b"usda", b"usdc"].contains(&extension))
    };
    let is_package = file.starts_with(b"PK\x03\x04") && first() == Some(true);
    let text = file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file);
    file.starts_with(b"PXR-USDC") || text.starts_with(b"#usda") || is_package
}

/// Whether nothing is known about it.
pub(super) fn is_unknown(file: &[u8]) -> bool {
    described(file).0.starts_with(UNKNOWN)
}

/// The same for files that stand in place of another one.
pub(super) fn placeholder(file: &[u8]) -> Option<(String, &'static str)> {
    let (found, hint) = described(file);
    [POINTER, DOWNLOAD].contains(&hint).then_some((found, hint))
}

/// Web pages and XML.
fn markup(text: &[u8]) -> Option<(String, &'static str)> {
    let start = text[..text.len().min(1024)].to_ascii_lowercase();
    let has = |what: &[u8]| start.windows(what.len()).any(|part| part == what);
    if !start.starts_with(b"<") {
        return None;
    }
    if has(b"<!doctype html") || has(b"<html") || has(b"<head") {
        return Some(("a web page (HTML)".to_owned(), DOWNLOAD));
    }
    Some(("XML".to_owned(), LINES))
}

/// TressFX in versions or byte orders that are not read.
fn tressfx(file: &[u8], text: &[u8]) -> Option<(String, &'static str)> {
    if let Some(version) = text.strip_prefix(b"version ") {
        let end = version.iter().position(u8::is_ascii_whitespace).unwrap_or(version.len());
        let version = version[..end].escape_ascii();
        return Some((format!("a text file of TressFX version {version}"), OLD));
    }
    if text.starts_with(b"numHairStrands") || text.starts_with(b"numStrands") {
        return Some(("a text file of TressFX version 1 or 2".to_owned(), OLD));
    }
    let word = |at: usize| file.get(at..at + 4)?.first_chunk().copied();
    let header = [word(0)?, word(4)?, word(8)?];
    let plausible = |of: fn([u8; 4]) -> u32| {
        let [version, strands, nodes] = header.map(of);
        let version = f32::from_bits(version);
        let is_header = (1..100_000_000).contains(&strands) && (1..=65_536).contains(&nodes);
        (is_header && (1.0..10.0).contains(&version)).then_some(version)
    };
    if let Some(version) = plausible(u32::from_be_bytes) {
        return Some((format!("a big-endian .tfx of TressFX version {version}"), SWAPPED));
    }
    let version = plausible(u32::from_le_bytes)?;
    Some((format!("a .tfx of TressFX version {version}"), OLD))
}

/// The first line, if it is of numbers.
fn numbers_of(text: &[u8]) -> Option<&str> {
    let end = text.iter().position(|byte| *byte == b'\n').unwrap_or(text.len()).min(200);
    let line = core::str::from_utf8(&text[..end]).ok()?.trim();
    let mut words = line.split([' ', ',', '\t', ';']).filter(|word| !word.is_empty()).peekable();
    words.peek()?;
    words.all(|word| word.parse::<f32>().is_ok()).then_some(line)
}

/// Whether the first bytes are numbers of a size that places have.
fn is_dump(file: &[u8]) -> bool {
    let (words, rest) = file.as_chunks::<4>();
    let number = |word: &[u8; 4]| f32::from_le_bytes(*word);
    let fits = |x: f32| x == 0.0 || (1e-9..1e7).contains(&x.abs());
    rest.is_empty() && words.len() > 2 && words.iter().take(300).all(|word| fits(number(word)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn foreign_files_are_named() {
        let dump: Vec<u8> = (0..30).flat_map(|i| (0.01 * i as f32 - 0.1).to_le_bytes()).collect();
        let tfx = |version: f32, swap: bool| -> Vec<u8> {
            let words = [version.to_bits(), 100, 16];
            let bytes = |w: &u32| if swap { w.to_be_bytes() } else { w.to_le_bytes() };
            words.iter().flat_map(bytes).collect()
        };
        for (file, says, remedy) in [
            (&b""[..], "an empty file", "again"),
            (
                b"version https://git-lfs.github.com/spec/v1\noid sha256:0",
                "LFS pointer",
                "lfs pull",
            ),
            (b"\r\n<!DOCTYPE html>\n<html>", "web page", "download"),
            (b"<HTML><body>not found", "web page", "download"),
            (b"<?xml version='1.0'?><COLLADA>", "XML", "glTF lines"),
            (b"\x89HDF\r\n\x1a\n....", "Alembic archives of before 2013", "Ogawa"),
            (b"PK\x03\x04....", "ZIP", "unpack"),
            (b"version 2.0\nscale 1.0\n", "text file of TressFX version 2.0", "version 3 or 4"),
            (&tfx(5.0, false), "TressFX version 5", "version 3 or 4"),
            (&tfx(4.0, true), "big-endian .tfx of TressFX version 4", "little-endian"),
            (b"0.1 0.2 0.3\n0.1 0.3 0.3\n", "lines of numbers", "glTF lines"),
            (&dump, "numbers without a header", "yuksel::write"),
            (b"\x00\x00\x00\x00", "zeros", "again"),
            (b"what ever", "unknown kind of file (it begins with what eve", "glTF lines"),
        ] {
            let (found, hint) = described(file);
            assert!(found.contains(says) && hint.contains(remedy), "{found}: {hint}");
        }
    }
}
