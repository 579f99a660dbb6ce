//! Reads numbers from glTF's buffers, with all references checked.

use super::super::{GroomFileError, foreign};
use super::document::{Buffer, Document, compression};
use super::error::{missing, wrong};
use base64::{Engine, engine::general_purpose::STANDARD};
use bevy::platform::collections::HashMap;
use std::borrow::Cow;

/// Prefix of the URI of embedded buffers.
pub const DATA: &str = "data:";
const EXPORT_AGAIN: &str = "export the file again";
const DECOMPRESS: &str =
    "export without compression, or decompress it (gltfpack or gltf-transform do)";

/// What a number in a buffer is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Component {
    I8,
    U8,
    I16,
    U16,
    U32,
    F32,
}

impl Component {
    fn of(code: u32) -> Option<Self> {
        let all = [Some(Self::I8), Some(Self::U8), Some(Self::I16), Some(Self::U16), None];
        let all = all.into_iter().chain([Some(Self::U32), Some(Self::F32)]);
        all.into_iter().nth(code.checked_sub(5120)? as usize)?
    }

    fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::U32 | Self::F32 => 4,
        }
    }
}

/// How many numbers an element of a type has.
fn numbers(shape: &str) -> Option<usize> {
    let shapes = [
        ("SCALAR", 1),
        ("VEC2", 2),
        ("VEC3", 3),
        ("VEC4", 4),
        ("MAT2", 4),
        ("MAT3", 9),
        ("MAT4", 16),
    ];
    shapes.into_iter().find(|(name, _)| *name == shape).map(|(_, count)| count)
}

/// The contents of a file's buffers, of those that lines need; or why one cannot be had, which matters only
/// where it is used.
pub struct Buffers<'a>(Vec<Result<Cow<'a, [u8]>, GroomFileError>>);

impl<'a> Buffers<'a> {
    pub fn new(
        document: &'a Document,
        bin: Option<&'a [u8]>,
        external: &'a HashMap<String, Vec<u8>>,
    ) -> Self {
        let needed = document.needed();
        let one = |(i, buffer): (usize, &'a Buffer)| {
            let path = format!("buffers[{i}]");
            if !needed[i] {
                return Ok(Cow::default());
            }
            let data: Cow<'a, [u8]> = match buffer.uri.as_deref() {
                None if i > 0 => {
                    let expected = "a uri, optional only for the first";
                    return match compression(&buffer.extensions) {
                        Some(name) => wrong(&path, format!("{name}, no uri"), expected, DECOMPRESS),
                        None => wrong(&path, "no uri", expected, EXPORT_AGAIN),
                    };
                }
                None => bin.unwrap_or_default().into(),
                Some(uri) => match uri.strip_prefix(DATA) {
                    Some(data) => decode(&path, data)?.into(),
                    None => match external.get(uri) {
                        Some(data) => data.as_slice().into(),
                        None => {
                            let hint = "put the file next to this one";
                            return wrong(&path, "nothing", format!("the file {uri}"), hint);
                        }
                    },
                },
            };
            if (data.len() as u64) < buffer.byte_length {
                let expected = buffer.byte_length.to_string();
                // Where a file of its own is no buffer at all.
                let (what, hint) = match (&buffer.uri, foreign::placeholder(&data)) {
                    (Some(_), Some((what, hint))) => (format!(", {what}"), hint),
                    _ => (String::new(), "the buffer is cut short, export it again"),
                };
                return wrong(&path, format!("{} bytes{what}", data.len()), expected, hint);
            }
            Ok(data)
        };
        Self(document.buffers.iter().enumerate().map(one).collect())
    }

    /// How many bytes all have.
    pub fn size(&self) -> usize {
        self.0.iter().flatten().map(|b| b.len()).sum()
    }

    /// The elements of an accessor.
    pub fn elements(
        &self,
        (document, index): (&Document, usize),
    ) -> Result<Elements<'_>, GroomFileError> {
        let path = format!("accessors[{index}]");
        let Some(accessor) = document.accessors.get(index) else {
            return missing(&path);
        };
        let types = Component::of(accessor.component_type).zip(numbers(&accessor.shape));
        let Some((component, numbers)) = types else {
            return wrong(&path, "an unknown type", "a type of glTF 2.0", EXPORT_AGAIN);
        };
        let (None, Some(view_index)) = (&accessor.sparse, accessor.buffer_view) else {
            let hint = "export without compression and sparse accessors";
            return wrong(&path, "no data of its own", "a bufferView, not sparse", hint);
        };
        let view_path = format!("bufferViews[{view_index}]");
        let Some(view) = document.buffer_views.get(view_index) else {
            return missing(&view_path);
        };
        if let Some(name) = compression(&view.extensions) {
            return wrong(&view_path, name, "numbers as they are", DECOMPRESS);
        }
        let buffer = match self.0.get(view.buffer) {
            Some(Ok(buffer)) => buffer,
            Some(Err(error)) => return Err(error.clone()),
            None => return missing(&format!("buffers[{}]", view.buffer)),
        };
        let size = component.size() * numbers;
        let from = view.byte_offset;
        let found = |data: &[u8]| format!("{} bytes from byte {from}", data.len());
        let data = slice(buffer, from, view.byte_length);
        let Some(data) = data else {
            let expected = view.byte_length.to_string();
            return wrong(&view_path, found(buffer), expected, "the buffer is too short");
        };
        let offset = accessor.byte_offset;
        let stride = view.byte_stride.unwrap_or_default();
        let stride = usize::try_from(stride).unwrap_or(usize::MAX).max(size);
        let count = accessor.count;
        let span = match count.checked_sub(1) {
            Some(last) => last.checked_mul(stride as u64).and_then(|n| n.checked_add(size as u64)),
            None => Some(0),
        };
        match span.and_then(|span| slice(data, offset, span)) {
            Some(data) => Ok(Elements {
                data,
                stride,
                size,
                count: count as usize,
                component,
                normalized: accessor.normalized,
                offset: from.saturating_add(offset),
                path,
            }),
            None => {
                let expected = format!("{count} elements of {stride} bytes from byte {offset}");
                wrong(&path, found(data), expected, "the bufferView is too short")
            }
        }
    }
}

fn slice(data: &[u8], from: u64, length: u64) -> Option<&[u8]> {
    let to = from.checked_add(length)?;
    data.get(usize::try_from(from).ok()?..usize::try_from(to).ok()?)
}

fn decode(path: &str, data: &str) -> Result<Vec<u8>, GroomFileError> {
    let hint = "embed buffers in base64";
    let Some((_, text)) = data.split_once(";base64,") else {
        return wrong(path, "a data URI of another kind", "data:…;base64,…", hint);
    };
    STANDARD.decode(text).or_else(|error| wrong(path, error.to_string(), "base64", hint))
}

/// An accessor's elements.
pub struct Elements<'a> {
    data: &'a [u8],
    stride: usize,
    size: usize,
    count: usize,
    component: Component,
    normalized: bool,
    /// Of the first element in its buffer.
    offset: u64,
    path: String,
}

impl<'a> Elements<'a> {
    pub fn count(&self) -> usize {
        self.count
    }

    fn chunks(&self) -> impl Iterator<Item = &[u8]> {
        (0..self.count).map(|i| &self.data[i * self.stride..i * self.stride + self.size])
    }

    /// Its elements as groups of N numbers; missing ones are 1.
    pub fn vectors<const N: usize>(self) -> Result<Vectors<'a, N>, GroomFileError> {
        let has = self.size / self.component.size();
        // Colours come with alpha or without.
        if has != N && (has, N) != (3, 4) {
            let (found, expected) = (format!("{has} numbers an element"), N.to_string());
            return wrong(&self.path, found, expected, EXPORT_AGAIN);
        }
        let number: fn(&[u8]) -> f32 = match (self.component, self.normalized) {
            (Component::F32, _) => |b| f32::from_le_bytes(array(b)),
            (Component::U8, true) => |b| f32::from(b[0]) / 255.0,
            (Component::U16, true) => |b| f32::from(u16::from_le_bytes(array(b))) / 65535.0,
            (other, _) => {
                let expected = "f32, or normalized u8 or u16";
                return wrong(&self.path, format!("{other:?}"), expected, "export as floats");
            }
        };
        Ok(Vectors { elements: self, number })
    }

    /// The same of whole numbers.
    pub fn integers<const N: usize>(self) -> Result<Vectors<'a, N>, GroomFileError> {
        let number: fn(&[u8]) -> f32 = match (self.component, self.size / self.component.size()) {
            (Component::U8, has) if has == N => |b| f32::from(b[0]),
            (Component::U16, has) if has == N => |b| f32::from(u16::from_le_bytes(array(b))),
            (other, has) => {
                let found = format!("{has} × {other:?}");
                return wrong(&self.path, found, format!("{N} u8 or u16"), EXPORT_AGAIN);
            }
        };
        Ok(Vectors { elements: self, number })
    }

    /// Each element as an index below `count`.
    pub fn indices(&self, count: usize) -> Result<Vec<u32>, GroomFileError> {
        let number: fn(&[u8]) -> u32 = match (self.component, self.size / self.component.size()) {
            (Component::U8, 1) => |b| b[0].into(),
            (Component::U16, 1) => |b| u16::from_le_bytes(array(b)).into(),
            (Component::U32, 1) => |b| u32::from_le_bytes(array(b)),
            (other, has) => {
                let found = format!("{has} × {other:?}");
                return wrong(&self.path, found, "one u8, u16 or u32", EXPORT_AGAIN);
            }
        };
        let mut indices = Vec::with_capacity(self.count);
        for (i, chunk) in self.chunks().enumerate() {
            let index = number(chunk);
            if index as usize >= count {
                let byte = self.offset + (i * self.stride) as u64;
                let place = format!("{}, byte {byte} of its buffer", self.path);
                let expected = format!("an index below {count}");
                return wrong(&place, index.to_string(), expected, EXPORT_AGAIN);
            }
            indices.push(index);
        }
        Ok(indices)
    }
}

/// Elements as groups of N numbers, read on demand: many primitives may share an accessor and use
/// few of its elements.
pub struct Vectors<'a, const N: usize> {
    elements: Elements<'a>,
    number: fn(&[u8]) -> f32,
}

impl<const N: usize> Vectors<'_, N> {
    /// The element `i`, which is below the count. Its numbers may be anything.
    pub fn get(&self, i: u32) -> [f32; N] {
        let Elements { data, stride, size, component, .. } = &self.elements;
        let width = component.size();
        let from = i as usize * stride;
        let mut vector = [1.0; N];
        let chunk = data.get(from..from + size).unwrap_or_default();
        for (out, bytes) in vector.iter_mut().zip(chunk.chunks_exact(width)) {
            *out = (self.number)(bytes);
        }
        vector
    }
}

/// The bytes of one number; the chunk is long enough by construction.
fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.first_chunk().copied().unwrap_or([0; N])
}
