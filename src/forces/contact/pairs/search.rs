//! Which edges are near each other: Verlet lists over a uniform grid.

use super::{
    geometry::see,
    kick::Contact,
    state::{Lists, PART, Pairs, PartPairs, Row, edge, mean, place, stored},
};
use crate::{
    base::{
        lanes::{dispatch, simd_level},
        parallel::{Nanos, for_each_block},
        tape::Tape,
    },
    forces::contact::lanes::{Pieces, Stack, WIDTH},
};
use core::ops::Range;
use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;

/// Margin of the lists, in units of the reach.
const MARGIN: f32 = 1.0;

/// The most that they may have, for hair whose strands meet fast.
const MOST_MARGIN: f32 = 24.0;

/// A margin beyond [`MARGIN`] is taken where lists hold about so many pairs an edge by it, at most.
const MOST_PAIRS: f32 = 32.0;

/// The most pairs that lists hold, of some sixty bytes each, unless so many nodes have the fewest of them; and the fewest
/// and most that an edge may have: more only where strands lie in one place by the hundred.
const MOST_PAIRS_OF_ALL: usize = 8 << 20;
const MOST_PAIRS_OF_AN_EDGE: [usize; 2] = [32, 1024];

/// How far strands that meet may come in a substep before lists have to be built again, over what is asked for.
const SPARE: f32 = 1.5;

/// Half the length of the pieces in which edges are put into the grid, in units of reach and margin.
const HALF_PIECE: f32 = 0.5;

/// Subdivision of the grid's cells: see `neighbours.rs`.
const SLICED: Vec3 = Vec3::new(4.0, 1.0, 1.0);

/// Cost per node (ns).
const MEASURE: usize = 3;
const SEARCH: usize = 400;

/// Scratch space of a search.
#[derive(Default)]
struct Scratch {
    close_by: Stack,
    edges: Vec<u32>,
    /// Edges that are near, by their distance (m).
    near: Vec<(f32, u32)>,
}

impl Lists {
    fn within(&self) -> f32 {
        self.reach * (1.0 + self.margin)
    }

    /// How far apart the middles of pieces are that are near each other, at most.
    fn close(&self) -> f32 {
        self.within() * (1.0 + 2.0 * HALF_PIECE)
    }

    /// The number of pieces of an edge, and their middles.
    fn pieces_of(&self, places: &[Row], edge: u32) -> impl Iterator<Item = Vec3> + use<> {
        let (a, b) = (place(&places[edge as usize]), place(&places[edge as usize + 1]));
        // An absurdly long edge is cut into at most 64 pieces.
        let n = (a.distance(b) / (2.0 * HALF_PIECE * self.within())).ceil().clamp(1.0, 64.0);
        (0..n as u32).map(move |k| a.lerp(b, (k as f32 + 0.5) / n))
    }

    fn begin(&mut self, places: &[Row], strands: &[Range<u32>], margin: f32) {
        self.margin = margin;
        self.most = (MOST_PAIRS_OF_ALL / places.len())
            .clamp(MOST_PAIRS_OF_AN_EDGE[0], MOST_PAIRS_OF_AN_EDGE[1]);
        self.places.clear();
        self.places.extend_from_slice(places);
        self.strands.clear();
        self.strands.extend_from_slice(strands);
        let mut unsorted = core::mem::take(&mut self.unsorted);
        unsorted.clear();
        for edge in strands.iter().flat_map(|s| s.start..s.end.saturating_sub(1)) {
            unsorted.extend(self.pieces_of(places, edge).map(|middle| (middle, edge)));
        }
        self.unsorted = unsorted;
        let numbered = self.unsorted.iter().zip(0..).map(|((middle, _), k)| (*middle * SLICED, k));
        self.grid.build(2.002 * self.close(), numbered);
        let sorted = self.grid.order().map(|k| self.unsorted[k as usize]);
        Pieces::collect(sorted, &mut self.pieces);
    }
}

impl Pairs {
    /// Builds the lists again where they may miss a pair.
    pub(super) fn look_up(&mut self, contact: &Contact<f32>) {
        let Self { places, velocities, strands, lists, parts, .. } = self;
        let nodes = places.len() - 2;
        let is_other = lists.reach != contact.reach || lists.strands != *strands;
        parts.resize_with(strands.len().div_ceil(PART), PartPairs::default);
        // What all move alike brings none nearer to another.
        let drift = if is_other {
            Vec3::ZERO
        } else {
            mean(&places[..nodes]) - mean(&lists.places[..nodes])
        };
        let speed = mean(&velocities[..nodes]);
        let each = Nanos(MEASURE * nodes / parts.len().max(1));
        let mut work: Vec<_> = parts.iter_mut().zip(strands.chunks(PART)).collect();
        for_each_block(
            &mut work,
            each,
            || (),
            |(), (part, strands)| {
                let start = strands.first().map_or(0, |s| s.start) as usize;
                let own = start..strands.last().map_or(start, |s| s.end as usize);
                let fastest =
                    velocities[own.clone()].iter().map(|v| place(v).distance_squared(speed));
                part.fastest = fastest.fold(0.0, larger);
                part.moved = 0.0;
                if !is_other {
                    let moved = places[own.clone()].iter().zip(&lists.places[own]);
                    let moved = moved.map(|(p, q)| (place(p) - drift).distance_squared(place(q)));
                    part.moved = moved.fold(0.0, larger);
                }
            },
        );
        let largest = |of: fn(&PartPairs) -> f32| parts.iter().map(of).fold(0.0, larger).sqrt();
        let (moved, fastest) = (largest(|part| part.moved), largest(|part| part.fastest));
        // Both of a pair may move by so much since, and in this substep.
        let meet = 2.0 * contact.dt * fastest;
        let is_complete = 2.0 * moved + meet <= lists.margin * contact.reach;
        if !is_other && is_complete {
            return;
        }
        let wanted = (SPARE * meet / contact.reach).clamp(MARGIN, MOST_MARGIN);
        let pairs: usize = parts.iter().map(|part| part.seconds.len()).sum();
        let margin = if wanted.is_nan() { MARGIN } else { wanted };
        (self.lists.reach, self.lists.core) = (contact.reach, contact.core);
        self.build(margin, is_other, pairs);
    }

    fn build(&mut self, wanted: f32, is_other: bool, pairs: usize) {
        let nodes = self.places.len() - 2;
        // Pairs grow with the square of the distance.
        let known = if is_other { 0.0 } else { pairs as f32 / nodes.max(1) as f32 };
        let most = (MOST_PAIRS / known.max(1e-3)).sqrt() * (1.0 + self.lists.margin) - 1.0;
        let margin = wanted.min(most.max(MARGIN));
        if is_other {
            self.parts.iter_mut().for_each(PartPairs::forget);
        }
        let (places, strands) =
            (core::mem::take(&mut self.places), core::mem::take(&mut self.strands));
        self.build_of(&places, &strands, margin);
        (self.places, self.strands) = (places, strands);
    }

    /// Builds the lists of nodes at these places, padded with two that are not numbers.
    fn build_of(&mut self, places: &[Row], strands: &[Range<u32>], margin: f32) {
        let Self { lists, parts, .. } = self;
        let nodes = places.len() - 2;
        parts.resize_with(strands.len().div_ceil(PART), PartPairs::default);
        lists.begin(places, strands, margin);
        let level = simd_level();
        let each = Nanos(SEARCH * nodes / parts.len().max(1));
        let lists = &*lists;
        let mut work: Vec<_> = parts.iter_mut().zip(strands.chunks(PART)).collect();
        for_each_block(
            &mut work,
            each,
            Default::default,
            |scratch: &mut Scratch, (part, strands)| {
                dispatch!(level, simd => part.search(simd, places, strands, lists, scratch));
            },
        );
        // The other way round, by counting.
        let Self { parts, second_starts, by_second, .. } = self;
        second_starts.clear();
        second_starts.resize(nodes + 2, 0);
        for second in parts.iter().flat_map(|part| &part.seconds) {
            second_starts[*second as usize + 2] += 1;
        }
        for k in 1..second_starts.len() {
            second_starts[k] += second_starts[k - 1];
        }
        by_second.resize(second_starts.last().map_or(0, |end| *end as usize), [0; 2]);
        for (k, part) in parts.iter().enumerate() {
            for (number, second) in part.seconds.iter().enumerate() {
                let next = &mut second_starts[*second as usize + 1];
                by_second[*next as usize] = [k as u32, number as u32];
                *next += 1;
            }
        }
    }
}

impl Pairs {
    /// What a substep finds of the one before: lists, as the places that they were built from, and what pairs remember.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let mut places = core::mem::take(&mut self.lists.places);
        let mut ends: Vec<u32> = self.lists.strands.iter().map(|strand| strand.end).collect();
        let mut pasts: Vec<Row> = self.parts.iter().flat_map(|part| &part.pasts).copied().collect();
        tape.list(&mut places);
        tape.list(&mut ends);
        let Lists { reach, core, margin, .. } = &mut self.lists;
        tape.values([reach, core, margin]);
        let margin = *margin;
        tape.list(&mut pasts);
        if let Tape::Write(_) = tape {
            self.lists.places = places;
            return;
        }
        let nodes = ends.last().map_or(0, |end| *end as usize);
        self.parts.iter_mut().for_each(PartPairs::forget);
        if places.len() != nodes + 2 || !ends.is_sorted() {
            // There were none.
            (self.lists, self.parts) = (Lists::default(), Vec::new());
            return;
        }
        let starts = core::iter::once(0).chain(ends.iter().copied());
        let strands: Vec<Range<u32>> = starts.zip(&ends).map(|(start, end)| start..*end).collect();
        self.build_of(&places, &strands, margin);
        let own = self.parts.iter_mut().flat_map(|part| &mut part.pasts);
        own.zip(pasts).for_each(|(own, past)| *own = past);
    }
}

/// The larger of two numbers, NaN if either is.
fn larger(a: f32, b: f32) -> f32 {
    if b <= a || a.is_nan() { a } else { b }
}

impl PartPairs {
    fn forget(&mut self) {
        self.starts.clear();
        self.seconds.clear();
        self.pasts.clear();
    }

    /// Builds the lists of these strands' edges. Pairs that were there before keep their past.
    #[inline(always)]
    fn search<S: Simd>(
        &mut self,
        simd: S,
        places: &[Row],
        strands: &[Range<u32>],
        lists: &Lists,
        Scratch { close_by, edges, near }: &mut Scratch,
    ) {
        let Self { first: own_first, starts, seconds, pasts, before, is_crowded, .. } = self;
        *is_crowded = false;
        core::mem::swap(&mut before.0, starts);
        core::mem::swap(&mut before.1, seconds);
        core::mem::swap(&mut before.2, pasts);
        let (close, within) = (lists.close() * lists.close(), lists.within());
        let nowhere = places.len() as u32 - 2;
        starts.clear();
        seconds.clear();
        pasts.clear();
        let reach = f32x8::splat(simd, lists.reach);
        let first = strands.first().map_or(0, |s| s.start);
        *own_first = first;
        for own in strands {
            for a in own.clone() {
                starts.push(seconds.len() as u32);
                // The tip starts no edge.
                if a + 1 >= own.end {
                    continue;
                }
                edges.clear();
                for middle in lists.pieces_of(places, a) {
                    let around = [middle - lists.close(), middle + lists.close()];
                    let rows = lists.grid.rows_in_box(around[0] * SLICED, around[1] * SLICED);
                    let sixteens = rows.map(|r| match r.is_empty() {
                        true => &[],
                        false => &lists.pieces[r.start / 16..r.end.div_ceil(16)],
                    });
                    close_by.clear(sixteens.iter().map(|s| s.len() * 16).sum());
                    for pieces in sixteens.into_iter().flatten() {
                        pieces.close(simd, middle, close, close_by);
                    }
                    // Of two edges the first has the pair.
                    edges.extend(close_by.items().iter().filter(|b| **b >= own.end));
                }
                edges.sort_unstable();
                edges.dedup();
                near.clear();
                for some in edges.chunks(WIDTH) {
                    let mut b = [nowhere; WIDTH];
                    b[..some.len()].copy_from_slice(some);
                    let ((edge_a, _), (edge_b, _)) =
                        (edge(simd, places, &[a; WIDTH]), edge(simd, places, &b));
                    let distances = stored(see(edge_a, edge_b, reach).distance);
                    let found = distances.into_iter().zip(some.iter().copied());
                    near.extend(found.filter(|(distance, _)| *distance < within));
                }
                if near.len() > lists.most {
                    *is_crowded = true;
                    near.select_nth_unstable_by(lists.most, |(d, b), (e, c)| {
                        d.total_cmp(e).then(b.cmp(c))
                    });
                    near.truncate(lists.most);
                    near.sort_unstable_by_key(|(_, second)| *second);
                }
                let mut old = before_of(before, (a - first) as usize);
                for (distance, second) in &*near {
                    let new = [0.0, 0.0, 0.0, if *distance < lists.core { -0.0 } else { 0.0 }];
                    seconds.push(*second);
                    pasts.push(old.of(*second).unwrap_or(new));
                }
            }
        }
        starts.push(seconds.len() as u32);
    }
}

/// The pairs that an edge had.
struct Old<'a> {
    seconds: &'a [u32],
    pasts: &'a [Row],
}

fn before_of((starts, seconds, pasts): &(Vec<u32>, Vec<u32>, Vec<Row>), edge: usize) -> Old<'_> {
    let own = starts.get(edge..edge + 2).map_or(0..0, |w| w[0] as usize..w[1] as usize);
    let (seconds, pasts) = (seconds.get(own.clone()), pasts.get(own));
    let (Some(seconds), Some(pasts)) = (seconds, pasts) else {
        return Old { seconds: &[], pasts: &[] };
    };
    Old { seconds, pasts }
}

impl Old<'_> {
    /// What a pair had; asked for in ascending order.
    fn of(&mut self, second: u32) -> Option<Row> {
        let next = self.seconds.iter().take_while(|known| **known < second).count();
        (self.seconds, self.pasts) = (&self.seconds[next..], &self.pasts[next..]);
        match self.seconds.first() {
            Some(known) if *known == second => self.pasts.first().copied(),
            _ => None,
        }
    }
}
