//! Ogawa, the container of Alembic archives: groups and data that name each other by position, and headers
//! of objects and properties in them.
//!
//! Nothing is copied or allocated: headers are read anew for every name that is looked for.

use crate::authoring::groom::{
    GroomFileError,
    bytes::{Bytes, value},
};
use core::{cell::Cell, str};

/// Marks a position as one of data; others are of groups.
const DATA: u64 = 1 << 63;
/// An index of metadata that says that they follow.
const OWN_METADATA: u8 = u8::MAX;
/// Bytes at the end of objects' headers that are hashes.
const HASHES: u64 = 32;
/// What a property of texts holds.
const TEXT: u64 = 12;
/// Bytes before the values of a sample.
const KEY: usize = 16;
/// How many times as many bytes may be looked at as the file has, and how many in any case: parts of an
/// archive may be shared, and in a broken one contain themselves.
const LOOKS: u64 = 64;
const LOOKS_ANYWAY: u64 = 4 << 20;

pub const EXPORT_AGAIN: &str = "export the file again";

/// An archive.
pub struct Ogawa<'a> {
    bytes: Bytes<'a>,
    /// Shared by index.
    metadata: Vec<&'a str>,
    /// Position of the object at the top.
    top: u64,
    /// When samples are.
    times: u64,
    /// Which sample of what changes in time is read.
    pub sample: u64,
    looks_left: Cell<u64>,
}

/// Positions of other groups and of data.
#[derive(Clone, Copy)]
struct Group {
    at: u64,
    len: u64,
}

/// Headers that are read one after the other.
#[derive(Clone, Copy)]
struct Cursor<'a> {
    bytes: Bytes<'a>,
    at: u64,
}

impl<'a> Cursor<'a> {
    fn is_at_end(&self) -> bool {
        self.at >= self.bytes.len()
    }

    fn take(&mut self, count: u64) -> Result<&'a [u8], GroomFileError> {
        let bytes = self.bytes.array(self.at, count, 1, "a header")?;
        self.at += count;
        Ok(bytes)
    }

    /// A number of up to 8 bytes.
    fn number(&mut self, size: u64) -> Result<u64, GroomFileError> {
        Ok(self.take(size)?.iter().rev().fold(0, |number, byte| number << 8 | u64::from(*byte)))
    }

    fn text(&mut self, length_size: u64) -> Result<&'a str, GroomFileError> {
        let length = self.number(length_size)?;
        Ok(str::from_utf8(self.take(length)?).unwrap_or("?"))
    }
}

/// An object's name, metadata and position.
#[derive(Clone, Copy)]
pub struct Object<'a> {
    pub name: &'a str,
    metadata: &'a str,
    at: u64,
}

impl Object<'_> {
    pub fn is_instance(&self) -> bool {
        self.metadata.split(';').any(|entry| entry == "isInstance=1")
    }

    /// Its kind, such as `AbcGeom_Curve_v2`.
    pub fn schema(&self) -> &str {
        let mut entries = self.metadata.split(';');
        entries.find_map(|entry| entry.strip_prefix("schema=")).unwrap_or_default()
    }
}

/// The objects in an object.
pub struct Children<'a> {
    headers: Cursor<'a>,
    group: Group,
    next: u64,
}

/// A property's header.
#[derive(Clone, Copy)]
pub struct Property<'a> {
    pub name: &'a str,
    /// How many values there are in time.
    pub samples: u64,
    /// The first that differs from the one before, and the last.
    changes: [u64; 2],
    /// Which times these have.
    pub times: u64,
    info: u64,
    at: u64,
}

impl Property<'_> {
    /// How many values there are in time that may differ: others are stored once.
    pub fn moments(&self) -> u64 {
        if self.changes[1] == 0 { self.samples.min(1) } else { self.samples }
    }

    /// Where a sample is among those that are stored.
    fn stored(&self, sample: u64) -> u64 {
        let [first, last] = self.changes;
        let sample = sample.min(self.samples.saturating_sub(1));
        match sample < first || last == 0 {
            true => 0,
            false => sample.min(last).saturating_sub(first).saturating_add(1),
        }
    }

    pub fn is_compound(&self) -> bool {
        self.info & 3 == 0
    }

    /// How many numbers are one element.
    pub fn extent(&self) -> usize {
        (self.info >> 12 & 255) as usize
    }
}

/// The properties of an object or in a compound property; may be none.
#[derive(Clone, Copy)]
pub struct Compound<'a>(Option<(Group, Cursor<'a>)>);

/// Numbers of one sample.
#[derive(Clone, Copy)]
pub struct Values<'a> {
    bytes: &'a [u8],
    size: usize,
    number: fn(&[u8]) -> f64,
    /// The byte of the file where they begin.
    pub at: u64,
}

impl Values<'_> {
    pub fn len(&self) -> usize {
        self.bytes.len() / self.size
    }

    /// One of them; NaN beyond the last.
    pub fn get(&self, i: usize) -> f64 {
        let from = i.saturating_mul(self.size);
        self.bytes.get(from..from.saturating_add(self.size)).map_or(f64::NAN, self.number)
    }

    pub fn iter(&self) -> impl Iterator<Item = f64> {
        self.bytes.chunks_exact(self.size).map(self.number)
    }
}

/// Size and meaning of numbers; `None` for text.
fn numbers(pod: u64) -> Option<(usize, fn(&[u8]) -> f64)> {
    macro_rules! number {
        ($type:ty) => {
            (size_of::<$type>(), |bytes| {
                bytes.first_chunk().map_or(f64::NAN, |bytes| <$type>::from_le_bytes(*bytes) as f64)
            })
        };
    }
    Some(match pod {
        0 | 1 => number!(u8),
        2 => number!(i8),
        3 => number!(u16),
        4 => number!(i16),
        5 => number!(u32),
        6 => number!(i32),
        7 => number!(u64),
        8 => number!(i64),
        9 => (2, |bytes| {
            let bytes = bytes.first_chunk();
            bytes.map_or(f64::NAN, |bytes| half::f16::from_le_bytes(*bytes).to_f64())
        }),
        10 => number!(f32),
        11 => number!(f64),
        _ => return None,
    })
}

impl<'a> Ogawa<'a> {
    pub fn open(file: &'a [u8]) -> Result<Self, GroomFileError> {
        let bytes = Bytes(file);
        let header = bytes.array(0, 16, 1, "header")?;
        if !header.starts_with(b"Ogawa") {
            let found = header[..5].escape_ascii();
            return value(0, "the mark", found, "Ogawa", "check that this is an Alembic file");
        }
        if header[5] != 0xff {
            let hint = "the program that wrote the file did not finish: export it again";
            return value(5, "the mark of a finished file", header[5], 0xff, hint);
        }
        let version = u16::from_be_bytes([header[6], header[7]]);
        if version != 1 {
            return value(6, "the version of Ogawa", version, 1, EXPORT_AGAIN);
        }
        let (top, times, sample) = (0, 0, 0);
        let metadata = vec![""];
        let looks_left = Cell::new(0);
        let mut archive = Self { bytes, metadata, top, times, sample, looks_left };
        archive.look_again();
        let at = Cursor { bytes, at: 8 }.number(8)?;
        let root = archive.group(at)?;
        if root.len < 6 {
            return value(at, "the count of the archive's parts", root.len, 6, EXPORT_AGAIN);
        }
        archive.top = archive.child(root, 2)?;
        archive.times = archive.child(root, 4)?;
        let (mut shared, _) = archive.data(archive.child(root, 5)?)?;
        while !shared.is_at_end() && archive.metadata.len() < usize::from(OWN_METADATA) {
            archive.metadata.push(shared.text(1)?);
        }
        Ok(archive)
    }

    /// Counts what is looked at, so that parts that contain themselves come to an end.
    fn look(&self, at: u64, count: u64) -> Result<(), GroomFileError> {
        let Some(left) = self.looks_left.get().checked_sub(count) else {
            let found = "read again and again";
            return value(at, "a part of the archive", found, "read a few times", EXPORT_AGAIN);
        };
        self.looks_left.set(left);
        Ok(())
    }

    fn group(&self, at: u64) -> Result<Group, GroomFileError> {
        if at == 0 {
            return Ok(Group { at, len: 0 });
        }
        if at & DATA != 0 {
            return value(at & !DATA, "a part of the archive", "data", "a group", EXPORT_AGAIN);
        }
        let count = self.bytes.array(at, 1, 8, "a group")?;
        let len = Cursor { bytes: Bytes(count), at: 0 }.number(8)?;
        self.bytes.array(at + 8, len, 8, "a group")?;
        self.look(at, 16)?;
        Ok(Group { at, len })
    }

    /// The position of a part of a group; an empty group beyond the last.
    fn child(&self, group: Group, i: u64) -> Result<u64, GroomFileError> {
        if i >= group.len {
            return Ok(0);
        }
        Cursor { bytes: self.bytes, at: group.at + 8 + 8 * i }.number(8)
    }

    /// Data, with how many bytes they have.
    fn data(&self, child: u64) -> Result<(Cursor<'a>, u64), GroomFileError> {
        let at = child & !DATA;
        if child & DATA == 0 {
            return value(at, "a part of the archive", "a group", "data", EXPORT_AGAIN);
        }
        if at == 0 {
            return Ok((Cursor { bytes: Bytes(&[]), at: 0 }, 0));
        }
        let len = Cursor { bytes: self.bytes, at }.number(8)?;
        self.bytes.array(at + 8, len, 1, "data")?;
        self.look(at, 8 + len)?;
        // Fits, because all of it is there.
        let bytes = Bytes(&self.bytes.0[..(at + 8 + len) as usize]);
        Ok((Cursor { bytes, at: at + 8 }, len))
    }

    /// The headers at the end of a group, if it has any.
    fn headers(&self, group: Group) -> Result<Option<Cursor<'a>>, GroomFileError> {
        match self.child(group, group.len.wrapping_sub(1))? {
            last if last & DATA != 0 => Ok(Some(self.data(last)?.0)),
            _ => Ok(None),
        }
    }

    fn metadata(
        &self,
        headers: &mut Cursor<'a>,
        index: u8,
        size: u64,
    ) -> Result<&'a str, GroomFileError> {
        match index {
            OWN_METADATA => headers.text(size),
            shared => Ok(self.metadata.get(usize::from(shared)).copied().unwrap_or_default()),
        }
    }

    /// How many bytes the file has.
    pub fn len(&self) -> usize {
        self.bytes.0.len()
    }

    /// As much may be looked at again: for another sample.
    pub fn look_again(&self) {
        self.looks_left.set(self.most_looks());
    }

    fn most_looks(&self) -> u64 {
        self.bytes.len().saturating_mul(LOOKS).saturating_add(LOOKS_ANYWAY)
    }

    pub fn top(&self) -> Object<'a> {
        Object { name: "", metadata: "", at: self.top }
    }

    pub fn children(&self, of: Object<'a>) -> Result<Children<'a>, GroomFileError> {
        let group = self.group(of.at)?;
        let mut headers = self.headers(group)?.unwrap_or(Cursor { bytes: Bytes(&[]), at: 0 });
        let end = headers.bytes.len().saturating_sub(HASHES) as usize;
        headers.bytes = Bytes(&headers.bytes.0[..end]);
        Ok(Children { headers, group, next: 1 })
    }

    pub fn next(&self, children: &mut Children<'a>) -> Result<Option<Object<'a>>, GroomFileError> {
        let headers = &mut children.headers;
        if headers.is_at_end() {
            return Ok(None);
        }
        self.look(headers.at, 64)?;
        let name = headers.text(4)?;
        let index = headers.number(1)? as u8;
        let metadata = self.metadata(headers, index, 4)?;
        let at = self.child(children.group, children.next)?;
        children.next += 1;
        Ok(Some(Object { name, metadata, at }))
    }

    pub fn properties_of(&self, object: Object<'a>) -> Result<Compound<'a>, GroomFileError> {
        let group = self.group(object.at)?;
        self.compound(self.child(group, 0)?)
    }

    fn compound(&self, at: u64) -> Result<Compound<'a>, GroomFileError> {
        let group = self.group(at)?;
        Ok(Compound(self.headers(group)?.map(|headers| (group, headers))))
    }

    /// Calls `visit` with each property until it returns true.
    pub fn visit(
        &self,
        compound: Compound<'a>,
        mut visit: impl FnMut(Property<'a>) -> bool,
    ) -> Result<(), GroomFileError> {
        let Compound(Some((group, mut headers))) = compound else {
            return Ok(());
        };
        for k in 0.. {
            if headers.is_at_end() {
                break;
            }
            let start = headers.at;
            let info = headers.number(4)?;
            let size = [1, 2, 4, 4][(info >> 2 & 3) as usize];
            let (mut samples, mut changes, mut times) = (0, [0; 2], 0);
            if info & 3 != 0 {
                samples = headers.number(size)?;
                if info >> 9 & 1 == 1 {
                    changes = [headers.number(size)?, headers.number(size)?];
                } else if info >> 11 & 1 == 0 {
                    changes = [1, samples.saturating_sub(1)];
                }
                if info >> 8 & 1 == 1 {
                    times = headers.number(size)?;
                }
            }
            let name = headers.text(size)?;
            self.metadata(&mut headers, (info >> 20) as u8, size)?;
            self.look(start, headers.at - start)?;
            let at = self.child(group, k)?;
            if visit(Property { name, samples, changes, times, info, at }) {
                break;
            }
        }
        Ok(())
    }

    /// The property of this name.
    pub fn find(
        &self,
        compound: Compound<'a>,
        name: &str,
    ) -> Result<Option<Property<'a>>, GroomFileError> {
        let mut found = None;
        self.visit(compound, |property| {
            found = Some(property).filter(|property| property.name == name);
            found.is_some()
        })?;
        Ok(found)
    }

    /// The compound property of this name, empty if there is none.
    pub fn find_compound(
        &self,
        compound: Compound<'a>,
        name: &str,
    ) -> Result<Compound<'a>, GroomFileError> {
        match self.find(compound, name)?.filter(Property::is_compound) {
            Some(property) => self.inside(property),
            None => Ok(Compound(None)),
        }
    }

    pub fn inside(&self, property: Property<'a>) -> Result<Compound<'a>, GroomFileError> {
        self.compound(property.at)
    }

    /// The numbers of a property's [`sample`](Self::sample), or of its last; `None` where there are none.
    pub fn values(&self, property: Property<'a>) -> Result<Option<Values<'a>>, GroomFileError> {
        let group = match property.is_compound() || property.samples == 0 {
            true => return Ok(None),
            false => self.group(property.at)?,
        };
        let Some((size, number)) = numbers(property.info >> 4 & 15).filter(|_| group.len > 0)
        else {
            return Ok(None);
        };
        // Dimensions follow each array.
        let parts = if property.info & 3 == 1 { 1 } else { 2 };
        let stored = property.stored(self.sample).saturating_mul(parts);
        let (data, len) = self.data(self.child(group, stored.min(group.len - 1))?)?;
        let from = data.at as usize + KEY;
        let bytes = data.bytes.0.get(from..).filter(|bytes| len > 0 && bytes.len() >= size);
        Ok(bytes.map(|bytes| Values { bytes, size, number, at: from as u64 }))
    }

    /// When a sample is (s), by its [kind of times](Property::times).
    pub fn time(&self, kind: u64, sample: u64) -> Result<f64, GroomFileError> {
        let (mut cursor, len) = self.data(self.times)?;
        let end = cursor.at + len;
        // Of each kind of times the most samples, the length of a cycle, and when in it samples are.
        for found in 0.. {
            cursor.number(4)?;
            let cycle = f64::from_bits(cursor.number(8)?);
            let count = cursor.number(4)?;
            let at = cursor.at;
            let times = cursor.take(count.saturating_mul(8))?;
            self.look(at, 16)?;
            if found == kind {
                let (cycles, within) = match count {
                    0 => return Ok(sample as f64),
                    // Without a cycle.
                    _ if cycle > 1e30 => (0.0, sample.min(count - 1)),
                    _ => ((sample / count) as f64, sample % count),
                };
                let time = times.get(8 * within as usize..).and_then(|bytes| bytes.first_chunk());
                let time = time.map_or(f64::NAN, |bytes| f64::from_le_bytes(*bytes));
                return Ok(if cycles == 0.0 { time } else { cycles.mul_add(cycle, time) });
            }
            if cursor.at >= end {
                break;
            }
        }
        let expected = "one of those at the archive's beginning";
        value(self.times & !DATA, "which times samples have", kind, expected, EXPORT_AGAIN)
    }

    /// The texts of a property's first sample, each ended by a zero, up to `most`; none where it has numbers.
    pub fn texts(
        &self,
        property: Property<'a>,
        most: usize,
    ) -> Result<Vec<&'a str>, GroomFileError> {
        let is_text = !property.is_compound() && property.info >> 4 & 15 == TEXT;
        if !is_text || property.samples == 0 {
            return Ok(Vec::new());
        }
        let group = self.group(property.at)?;
        if group.len == 0 {
            return Ok(Vec::new());
        }
        let (data, _) = self.data(self.child(group, 0)?)?;
        let bytes = data.bytes.0.get(data.at as usize + KEY..).unwrap_or_default();
        let texts = bytes.strip_suffix(&[0]).unwrap_or(bytes).split(|byte| *byte == 0);
        Ok(texts.take(most).map(|text| str::from_utf8(text).unwrap_or("?")).collect())
    }

    /// The same by name.
    pub fn find_values(
        &self,
        compound: Compound<'a>,
        name: &str,
    ) -> Result<Option<Values<'a>>, GroomFileError> {
        self.find(compound, name)?.map_or(Ok(None), |property| self.values(property))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_that_do_not_differ_are_stored_once() {
        let property = |samples, changes| {
            let (name, times, info, at) = ("P", 0, 2, 0);
            Property { name, samples, changes, times, info, at }
        };
        let stored =
            |of: Property<'_>| (0..of.samples + 2).map(|k| of.stored(k)).collect::<Vec<_>>();
        let still = property(4, [0, 0]);
        assert_eq!((still.moments(), stored(still)), (1, vec![0; 6]));
        let moving = property(4, [1, 3]);
        assert_eq!((moving.moments(), stored(moving)), (4, vec![0, 1, 2, 3, 3, 3]));
        let for_a_while = property(6, [2, 4]);
        assert_eq!((for_a_while.moments(), stored(for_a_while)), (6, vec![0, 0, 1, 2, 3, 3, 3, 3]));
        let broken = property(6, [5, 2]);
        assert_eq!(stored(broken), [0, 0, 0, 0, 0, 1, 1, 1]);
        assert_eq!(stored(property(0, [1, 0])), [0, 0]);
    }
}
