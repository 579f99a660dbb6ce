//! A hairdo's file: magic, format, length, then its numbers by postcard, then a checksum.
//!
//! | bytes | what |
//! |---|---|
//! | 8 | `\x8bhairdo\n` |
//! | 2 | format, little endian as all numbers here |
//! | 8 | length of the numbers |
//! | … | the numbers |
//! | 4 | CRC-32 of all bytes before, as in zip files and PNGs |
//!
//! This frame is the same in all formats. In format 1 the numbers are: strands; the cuticle's
//! damage and softening as an option; then strand by strand its nodes, whether it is wet, the
//! root's frame, positions, orientations, rest lengths, joints, and if wet film and bound water.
//! Counts are varints. A joint is a byte that marks which of its shapes and rates are omitted
//! because they can be derived, then the others. Format 2 appends looks, see `looks`, format 3 what holds
//! strands, see `holds`, format 4 where they were cut, see `cuts`; a hairdo without them is written in format 1.

use super::{Hairdo, HairdoError, StyledStrand};
use crate::keratin::bond::{BondKind, Cuticle, JointBonds};
use glam::{Quat, Vec3};
use serde::{Deserialize, Serialize};

/// The newest format that can be read. Hairdos are written in the oldest format that holds all
/// their data.
pub const NEWEST_FORMAT: u16 = 4;

/// The first format that has looks.
const WITH_LOOKS: u16 = 2;

/// The first format that has ties and held nodes.
const WITH_HOLDS: u16 = 3;

/// The first format that has cut strands.
const WITH_CUTS: u16 = 4;

const MAGIC: [u8; 8] = *b"\x8bhairdo\n";
/// Magic, format and length.
const HEAD: usize = 8 + 2 + 8;
const CHECKSUM: usize = 4;
/// Minimum size of a node, and of an edge with its joint.
const NODE: usize = 12;
const EDGE: usize = 16 + 4 + 1;
/// Minimum size of a strand of two nodes.
const STRAND: usize = 1 + 1 + 16 + 2 * NODE + EDGE;

impl Hairdo {
    /// The hairdo as bytes, for a file or a save game: about 45 for each node of untreated hair, up
    /// to 120 for wet hair where every kind of bond has its own shape. The same hairdo gives the
    /// same bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut out = Writer(Vec::with_capacity(HEAD + CHECKSUM + 48 * self.nodes()));
        out.0.extend(MAGIC);
        let format = match (self.has_cuts(), self.has_holds(), self.has_looks()) {
            (true, ..) => WITH_CUTS,
            (_, true, _) => WITH_HOLDS,
            (.., true) => WITH_LOOKS,
            _ => 1,
        };
        out.0.extend(format.to_le_bytes());
        out.0.extend([0; 8]);
        out.put(&(self.strands.len() as u64));
        out.put(&self.cuticle.map(|c| (c.damage, c.softening)));
        self.strands.iter().for_each(|strand| out.strand(strand));
        if format >= WITH_LOOKS {
            self.write_looks(&mut out);
        }
        if format >= WITH_HOLDS {
            self.write_holds(&mut out);
        }
        if format >= WITH_CUTS {
            self.write_cuts(&mut out);
        }
        let length = (out.0.len() - HEAD) as u64;
        out.0[HEAD - 8..HEAD].copy_from_slice(&length.to_le_bytes());
        let checksum = crc32fast::hash(&out.0);
        out.0.extend(checksum.to_le_bytes());
        out.0
    }

    /// The hairdo of these bytes.
    ///
    /// # Errors
    /// When the bytes are no hairdo, of a newer format, truncated, damaged, or hold invalid
    /// numbers. Never needs more than a few times the memory of `bytes`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, HairdoError> {
        let seen = bytes.len().min(MAGIC.len());
        if bytes[..seen] != MAGIC[..seen] {
            return Err(HairdoError::NotAHairdo);
        }
        let found = bytes.len() as u64;
        let truncated = |expected| HairdoError::Truncated { found, expected };
        let (format, length) = head(bytes).ok_or(truncated((HEAD + CHECKSUM) as u64))?;
        let expected = length.saturating_add((HEAD + CHECKSUM) as u64);
        if found < expected {
            return Err(truncated(expected));
        }
        if found > expected {
            let expected_here = "the end of the hairdo";
            return Err(HairdoError::Malformed { offset: expected, expected: expected_here });
        }
        let (body, tail) = bytes.split_at(bytes.len() - CHECKSUM);
        let expected = tail.iter().rev().fold(0, |sum, byte| sum << 8 | u32::from(*byte));
        let found = crc32fast::hash(body);
        if found != expected {
            return Err(HairdoError::Checksum { found, expected });
        }
        if format > NEWEST_FORMAT {
            return Err(HairdoError::FutureVersion { found: format, newest: NEWEST_FORMAT });
        }
        if format == 0 {
            let offset = MAGIC.len() as u64;
            return Err(HairdoError::Malformed { offset, expected: "a format from 1 on" });
        }
        let mut reader = Reader { rest: &body[HEAD..], end: body.len() };
        let mut hairdo = reader.hairdo()?;
        if format >= WITH_LOOKS {
            hairdo.read_looks(&mut reader)?;
        }
        if format >= WITH_HOLDS {
            hairdo.read_holds(&mut reader)?;
        }
        if format >= WITH_CUTS {
            hairdo.read_cuts(&mut reader)?;
        }
        if !reader.rest.is_empty() {
            return Err(reader.wrong("the checksum"));
        }
        hairdo.checked()
    }
}

/// Format and length; `None` if the header is truncated.
fn head(bytes: &[u8]) -> Option<(u16, u64)> {
    let (format, rest) = bytes.get(MAGIC.len()..)?.split_first_chunk()?;
    let (length, _) = rest.split_first_chunk()?;
    Some((u16::from_le_bytes(*format), u64::from_le_bytes(*length)))
}

pub(super) struct Writer(Vec<u8>);

impl Writer {
    pub(super) fn put(&mut self, value: &impl Serialize) {
        // Plain numbers into a vector cannot fail.
        if let Ok(written) = postcard::to_extend(value, core::mem::take(&mut self.0)) {
            self.0 = written;
        }
    }

    fn strand(&mut self, strand: &StyledStrand) {
        let wet = !strand.film.is_empty();
        self.put(&(strand.positions.len() as u64));
        self.put(&wet);
        self.put(&strand.root_frame.to_array());
        strand.positions.iter().for_each(|p| self.put(&p.to_array()));
        strand.orientations.iter().for_each(|q| self.put(&q.to_array()));
        strand.rest_lengths.iter().for_each(|l| self.put(l));
        strand.joints.iter().for_each(|joint| self.joint(joint));
        strand.film.iter().chain(&strand.bound).for_each(|v| self.put(v));
    }

    fn joint(&mut self, joint: &JointBonds) {
        let omitted = omitted(joint);
        self.put(&omitted);
        for kind in 0..BondKind::COUNT {
            if omitted & 1 << kind == 0 {
                self.put(&joint.shapes[kind].to_array());
            }
        }
        for kind in 0..BondKind::COUNT {
            if omitted & 16 << kind == 0 {
                self.put(&joint.rates[kind]);
            }
        }
    }
}

/// Values of a joint that are omitted, one bit each: a shape equal to that of the previous kind (the
/// first: straight), a rate of 1. Compared to the bit, so that reading restores what was written.
fn omitted(joint: &JointBonds) -> u8 {
    let bits = |v: Vec3| v.to_array().map(f32::to_bits);
    let mut before = Vec3::ZERO;
    let mut omitted = 0;
    for (kind, (shape, rate)) in joint.shapes.into_iter().zip(joint.rates).enumerate() {
        omitted |= u8::from(bits(shape) == bits(before)) << kind;
        omitted |= u8::from(rate == 1.0) << (4 + kind);
        before = shape;
    }
    omitted
}

pub(super) struct Reader<'a> {
    rest: &'a [u8],
    /// Offset of the end of the rest in the file.
    end: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn wrong(&self, expected: &'static str) -> HairdoError {
        HairdoError::Malformed { offset: (self.end - self.rest.len()) as u64, expected }
    }

    pub(super) fn take<T: Deserialize<'a>>(
        &mut self,
        expected: &'static str,
    ) -> Result<T, HairdoError> {
        let (value, rest) =
            postcard::take_from_bytes(self.rest).map_err(|_| self.wrong(expected))?;
        self.rest = rest;
        Ok(value)
    }

    /// A count of items of at least `size` bytes each, checked against the bytes that are left, so that a
    /// damaged file causes no huge allocation.
    pub(super) fn count(
        &mut self,
        size: usize,
        expected: &'static str,
    ) -> Result<usize, HairdoError> {
        let before = self.rest;
        let count: u64 = self.take(expected)?;
        match usize::try_from(count) {
            Ok(count) if count <= self.rest.len() / size => Ok(count),
            _ => {
                self.rest = before;
                Err(self.wrong(expected))
            }
        }
    }

    pub(super) fn many<T: Deserialize<'a>, U>(
        &mut self,
        count: usize,
        expected: &'static str,
        make: impl Fn(T) -> U,
    ) -> Result<Vec<U>, HairdoError> {
        (0..count).map(|_| Ok(make(self.take(expected)?))).collect()
    }

    fn hairdo(&mut self) -> Result<Hairdo, HairdoError> {
        let count = self.count(STRAND, "a number of strands that fit in the file")?;
        let cuticle: Option<(f32, f32)> = self.take("the cuticle's wear")?;
        let cuticle = cuticle.map(|(damage, softening)| Cuticle { damage, softening });
        let strands = (0..count).map(|_| self.strand()).collect::<Result<_, _>>()?;
        Ok(Hairdo { strands, cuticle, ..Hairdo::default() })
    }

    fn strand(&mut self) -> Result<StyledStrand, HairdoError> {
        let nodes = self.count(NODE, "a number of nodes that fit in the file")?;
        let edges = nodes.saturating_sub(1);
        if nodes * NODE + edges * EDGE > self.rest.len() {
            return Err(self.wrong("a number of nodes that fit in the file"));
        }
        let wet: bool = self.take("whether the strand is wet")?;
        let watered = if wet { nodes } else { 0 };
        Ok(StyledStrand {
            root_frame: Quat::from_array(self.take("the root's frame")?),
            positions: self.many(nodes, "a position", Vec3::from_array)?,
            orientations: self.many(edges, "an orientation", Quat::from_array)?,
            rest_lengths: self.many(edges, "a rest length", |length| length)?,
            joints: (0..edges).map(|_| self.joint()).collect::<Result<_, _>>()?,
            film: self.many(watered, "a film", |volume| volume)?,
            bound: self.many(watered, "bound water", |volume| volume)?,
            hold: None,
            cut: None,
        })
    }

    fn joint(&mut self) -> Result<JointBonds, HairdoError> {
        let omitted: u8 = self.take("a joint")?;
        let mut joint = JointBonds::closed(Vec3::ZERO);
        let mut before = Vec3::ZERO;
        for (kind, shape) in joint.shapes.iter_mut().enumerate() {
            let is_stored = omitted & 1 << kind == 0;
            *shape =
                if is_stored { Vec3::from_array(self.take("a bond's shape")?) } else { before };
            before = *shape;
        }
        for (kind, rate) in joint.rates.iter_mut().enumerate() {
            if omitted & 16 << kind == 0 {
                *rate = self.take("a bond's rate")?;
            }
        }
        Ok(joint)
    }
}
