//! The container: GLB's chunks, or JSON alone.

use super::super::{
    GroomFileError,
    bytes::{Bytes, value},
};
use super::document::Document;
use ::gltf::json::deserialize::from_slice;

const JSON: u32 = u32::from_le_bytes(*b"JSON");
const BIN: u32 = u32::from_le_bytes(*b"BIN\0");
const HEADER: u64 = 12;
const CHUNK: u64 = 8;
const EXPORT_AGAIN: &str = "export the file again as glTF 2.0";

/// Whether a file begins like a JSON object.
pub fn looks_like_json(file: &[u8]) -> bool {
    let text = file.strip_prefix(b"\xef\xbb\xbf").unwrap_or(file);
    text.trim_ascii_start().starts_with(b"{")
}

/// The JSON, and GLB's binary chunk if there is one.
pub fn split(file: &[u8]) -> Result<(Document, Option<&[u8]>), GroomFileError> {
    if !file.starts_with(b"glTF") {
        let start = if file.starts_with(b"\xef\xbb\xbf") { 3 } else { 0 };
        return Ok((parse(&file[start..], start as u64)?, None));
    }
    let bytes = Bytes(file);
    let version = bytes.u32(4, "GLB version")?;
    if version != 2 {
        return value(4, "the GLB version", version, 2, EXPORT_AGAIN);
    }
    let length = u64::from(bytes.u32(8, "GLB length")?);
    if length < HEADER + CHUNK {
        return value(8, "the GLB's length", length, bytes.len(), EXPORT_AGAIN);
    }
    let whole = Bytes(bytes.array(0, length, 1, "GLB")?);
    let (kind, text) = chunk(whole, HEADER)?;
    if kind != JSON {
        return value(HEADER + 4, "the first chunk", format!("{kind:#x}"), "JSON", EXPORT_AGAIN);
    }
    let root = parse(text, HEADER + CHUNK)?;
    let mut at = HEADER + CHUNK + text.len() as u64;
    // The specification says to skip chunks of unknown kinds.
    while at < whole.len() {
        let (kind, data) = chunk(whole, at)?;
        if kind == BIN {
            return Ok((root, Some(data)));
        }
        at += CHUNK + data.len() as u64;
    }
    Ok((root, None))
}

fn chunk(whole: Bytes<'_>, at: u64) -> Result<(u32, &[u8]), GroomFileError> {
    let length = u64::from(whole.u32(at, "chunk length")?);
    let kind = whole.u32(at + 4, "chunk kind")?;
    Ok((kind, whole.array(at + CHUNK, length, 1, "chunk")?))
}

fn parse(text: &[u8], start: u64) -> Result<Document, GroomFileError> {
    // Padding should be blanks, but often is not.
    let is_padding = |byte: &u8| *byte == 0 || byte.is_ascii_whitespace();
    let end = text.iter().rposition(|byte| !is_padding(byte)).map_or(0, |last| last + 1);
    let text = &text[..end];
    let document: Document = from_slice(text).map_err(|error| {
        let offset = start + offset_of(text, error.line(), error.column());
        GroomFileError::Json { offset, message: error.to_string() }
    })?;
    if !document.asset.version.starts_with("2.") {
        let found = format!("asset.version {:?}", document.asset.version);
        return super::error::wrong("asset.version", found, "2.0", EXPORT_AGAIN);
    }
    Ok(document)
}

/// The byte offset of a line and column, both from 1.
fn offset_of(text: &[u8], line: usize, column: usize) -> u64 {
    let before = text.split_inclusive(|b| *b == b'\n').take(line.saturating_sub(1));
    (before.map(<[u8]>::len).sum::<usize>() + column.saturating_sub(1)).min(text.len()) as u64
}
