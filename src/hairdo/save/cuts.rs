//! Where strands of a hairdo have been cut. In a file from format 4 on.
//!
//! Behind what holds strands: strand by strand whether it has been cut, and if so its edges before, where in these it
//! ends, and its length and way from root to tip before; then the number of followers and where each ends, in 65535ths of
//! its length.

use super::{
    Hairdo, HairdoError, StyledStrand,
    bytes::{Reader, Writer},
};
use crate::hair::strand::{CutStrand, Strand};
use bevy::prelude::*;

impl Hairdo {
    /// Whether there is more than format 3 can hold.
    pub(super) fn has_cuts(&self) -> bool {
        !self.followers.0.is_empty() || self.strands.iter().any(|strand| strand.cut.is_some())
    }

    pub(super) fn write_cuts(&self, out: &mut Writer) {
        for strand in &self.strands {
            let numbers = |cut: CutStrand| (cut.edges, cut.end, cut.length, cut.reach.to_array());
            out.put(&strand.cut.map(numbers));
        }
        out.put(&(self.followers.0.len() as u64));
        self.followers.0.iter().for_each(|end| out.put(end));
    }

    pub(super) fn read_cuts(&mut self, from: &mut Reader<'_>) -> Result<(), HairdoError> {
        for strand in &mut self.strands {
            let cut: Option<(u32, f32, f32, [f32; 3])> = from.take("where a strand is cut")?;
            strand.cut = cut.map(|(edges, end, length, reach)| CutStrand {
                edges,
                end,
                length,
                reach: Vec3::from_array(reach),
            });
        }
        let count = from.count(1, "a number of followers that fit in the file")?;
        self.followers.0 = from.many(count, "where a follower is cut", |end| end)?;
        Ok(())
    }
}

impl StyledStrand {
    /// Whether its end is one of a strand that was longer.
    pub(super) fn check_cut(&self, strand: usize) -> Result<(), HairdoError> {
        let Some(cut) = self.cut else { return Ok(()) };
        let last = self.rest_lengths.len().saturating_sub(1);
        if cut.fits(self.positions.len()) {
            return Ok(());
        }
        let (what, at, found) = ("cut", last, f64::from(cut.end));
        Err(HairdoError::OutOfRange {
            what,
            strand,
            at,
            found,
            expected: "an edge of the whole strand",
        })
    }

    /// Whether a strand has grown as this one had, both before they were cut.
    pub(super) fn is_of(&self, strand: &Strand, cut: Option<&CutStrand>) -> bool {
        let own = self.cut.map_or_else(
            || (self.rest_lengths.len() as u32, self.rest_lengths.iter().sum()),
            |cut| (cut.edges, cut.length),
        );
        let other = cut.filter(|cut| cut.fits(strand.nodes())).map_or_else(
            || (strand.edges() as u32, strand.length()),
            |cut| (cut.edges, cut.length),
        );
        own.0 == other.0 && (own.1 - other.1).abs() < 1e-3 * own.1
    }
}
