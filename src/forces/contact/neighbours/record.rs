//! Lists, taken down as the places that they were built from, and built again.

use super::{Lists, Neighbours, NodeRow, most_bytes};
use crate::base::{lanes::simd_level, tape::Tape};
use bytemuck::cast_slice;

impl Neighbours {
    /// What a substep finds of the one before.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let Self { lists, parts, beyond, restored, .. } = self;
        let (mut places, mut ends) = match tape {
            Tape::Write(_) => (core::mem::take(&mut lists.rows), core::mem::take(restored)),
            Tape::Read(_) => (Vec::new(), core::mem::take(restored)),
        };
        ends.clear();
        if let Tape::Write(_) = tape {
            ends.extend(lists.strands.iter().map(|strand| strand.end));
        }
        tape.list::<NodeRow>(&mut places);
        tape.list(&mut ends);
        let (mut reach, mut margin, mut idle) = (lists.reach, lists.margin, lists.idle as u64);
        tape.values([&mut reach, &mut margin, beyond]);
        tape.value(&mut idle);
        let (mut good_for, mut is_fast) = (lists.good_for, lists.is_fast);
        tape.value(&mut good_for);
        tape.flags([&mut is_fast]);
        if let Tape::Write(_) = tape {
            lists.rows = places;
        } else {
            let strands: Vec<_> = (core::iter::once(0).chain(ends.iter().copied()))
                .zip(&ends)
                .map(|(start, end)| start..*end)
                .collect();
            let is_built = (lists.reach, lists.margin) == (reach, margin)
                && lists.strands == strands
                && cast_slice::<_, u8>(&lists.rows) == cast_slice::<_, u8>(&places);
            let nodes = strands.last().map_or(0, |strand| strand.end as usize);
            if places.len() != nodes + 2 || !ends.is_sorted() {
                // There were none.
                *lists = Lists::default();
                parts.clear();
            } else if !is_built {
                let (level, most) = (simd_level(), most_bytes(nodes));
                lists.build(level, (&places, &strands), (reach, margin), parts, most);
            }
            (lists.idle, lists.good_for, lists.is_fast) = (idle as usize, good_for, is_fast);
        }
        *restored = ends;
    }
}
