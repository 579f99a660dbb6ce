//! Reads numbers from glTF's buffers, with all references checked.

use super::super::GroomFileError;
use super::error::{missing, wrong};
use ::gltf::json::{Root, accessor::ComponentType, validation::Checked};
use base64::{Engine, engine::general_purpose::STANDARD};
use bevy::platform::collections::HashMap;
use std::borrow::Cow;

/// Prefix of the URI of embedded buffers.
pub const DATA: &str = "data:";
const EXPORT_AGAIN: &str = "export the file again";

/// The contents of a file's buffers.
pub struct Buffers<'a>(Vec<Cow<'a, [u8]>>);

impl<'a> Buffers<'a> {
    pub fn new(
        root: &'a Root,
        bin: Option<&'a [u8]>,
        external: &'a HashMap<String, Vec<u8>>,
    ) -> Result<Self, GroomFileError> {
        let one = |(i, buffer): (usize, &'a ::gltf::json::Buffer)| {
            let path = format!("buffers[{i}]");
            let data: Cow<'a, [u8]> = match buffer.uri.as_deref() {
                None if i > 0 => {
                    return wrong(
                        &path,
                        "no uri",
                        "a uri, optional only for the first",
                        EXPORT_AGAIN,
                    );
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
            if (data.len() as u64) < buffer.byte_length.0 {
                let (found, expected) = (data.len(), buffer.byte_length.0);
                let [found, expected] = [format!("{found} bytes"), expected.to_string()];
                return wrong(&path, found, expected, "the buffer is cut short, export it again");
            }
            Ok(data)
        };
        root.buffers.iter().enumerate().map(one).collect::<Result<_, _>>().map(Self)
    }

    /// How many bytes all have.
    pub fn size(&self) -> usize {
        self.0.iter().map(|b| b.len()).sum()
    }

    /// The elements of an accessor.
    pub fn elements(&self, (root, index): (&Root, usize)) -> Result<Elements<'_>, GroomFileError> {
        let path = format!("accessors[{index}]");
        let Some(accessor) = root.accessors.get(index) else {
            return missing(&path);
        };
        let (Checked::Valid(component), Checked::Valid(shape)) =
            (&accessor.component_type, &accessor.type_)
        else {
            return wrong(&path, "an unknown type", "a type of glTF 2.0", EXPORT_AGAIN);
        };
        let (None, Some(view)) = (&accessor.sparse, &accessor.buffer_view) else {
            let hint = "export without compression and sparse accessors";
            return wrong(&path, "no data of its own", "a bufferView, not sparse", hint);
        };
        let view_path = format!("bufferViews[{}]", view.value());
        let Some(view) = root.buffer_views.get(view.value()) else {
            return missing(&view_path);
        };
        let Some(buffer) = self.0.get(view.buffer.value()) else {
            return missing(&format!("buffers[{}]", view.buffer.value()));
        };
        let size = component.0.size() * shape.multiplicity();
        let from = view.byte_offset.unwrap_or_default().0;
        let found = |data: &[u8]| format!("{} bytes from byte {from}", data.len());
        let data = slice(buffer, from, view.byte_length.0);
        let Some(data) = data else {
            let expected = view.byte_length.0.to_string();
            return wrong(&view_path, found(buffer), expected, "the buffer is too short");
        };
        let offset = accessor.byte_offset.unwrap_or_default().0;
        let stride = view.byte_stride.as_ref().map_or(size, |s| s.0).max(size);
        let count = accessor.count.0;
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
                component: component.0,
                normalized: accessor.normalized,
                offset: from + offset,
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
    component: ComponentType,
    normalized: bool,
    /// Of the first element in its buffer.
    offset: u64,
    path: String,
}

impl Elements<'_> {
    pub fn count(&self) -> usize {
        self.count
    }

    fn chunks(&self) -> impl Iterator<Item = &[u8]> {
        (0..self.count).map(|i| &self.data[i * self.stride..i * self.stride + self.size])
    }

    /// Its elements as groups of N numbers; missing ones are 1.
    pub fn vectors<const N: usize>(&self) -> Result<Vectors<'_, N>, GroomFileError> {
        let has = self.size / self.component.size();
        // Colours come with alpha or without.
        if has != N && (has, N) != (3, 4) {
            let (found, expected) = (format!("{has} numbers an element"), N.to_string());
            return wrong(&self.path, found, expected, EXPORT_AGAIN);
        }
        let number: fn(&[u8]) -> f32 = match (self.component, self.normalized) {
            (ComponentType::F32, _) => |b| f32::from_le_bytes(array(b)),
            (ComponentType::U8, true) => |b| f32::from(b[0]) / 255.0,
            (ComponentType::U16, true) => |b| f32::from(u16::from_le_bytes(array(b))) / 65535.0,
            (other, _) => {
                let expected = "f32, or normalized u8 or u16";
                return wrong(&self.path, format!("{other:?}"), expected, "export as floats");
            }
        };
        Ok(Vectors { elements: self, number })
    }

    /// Each element as an index below `count`.
    pub fn indices(&self, count: usize) -> Result<Vec<u32>, GroomFileError> {
        let number: fn(&[u8]) -> u32 = match (self.component, self.size / self.component.size()) {
            (ComponentType::U8, 1) => |b| b[0].into(),
            (ComponentType::U16, 1) => |b| u16::from_le_bytes(array(b)).into(),
            (ComponentType::U32, 1) => |b| u32::from_le_bytes(array(b)),
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
    elements: &'a Elements<'a>,
    number: fn(&[u8]) -> f32,
}

impl<const N: usize> Vectors<'_, N> {
    /// The element `i`, which is below the count.
    pub fn get(&self, i: u32) -> Result<[f32; N], GroomFileError> {
        let Elements { data, stride, size, component, offset, path, .. } = self.elements;
        let width = component.size();
        let from = i as usize * stride;
        let mut vector = [1.0; N];
        let chunk = data.get(from..from + size).unwrap_or_default();
        for (out, bytes) in vector.iter_mut().zip(chunk.chunks_exact(width)) {
            *out = (self.number)(bytes);
        }
        match vector.iter().position(|x| !x.is_finite()) {
            None => Ok(vector),
            Some(k) => {
                let place =
                    format!("{path}, byte {} of its buffer", offset + (from + k * width) as u64);
                let hint = "repair or leave out that strand";
                wrong(&place, vector[k].to_string(), "a finite number", hint)
            }
        }
    }
}

/// The bytes of one number; the chunk is long enough by construction.
fn array<const N: usize>(bytes: &[u8]) -> [u8; N] {
    bytes.first_chunk().copied().unwrap_or([0; N])
}
