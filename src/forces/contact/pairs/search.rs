//! Which edges are near each other: Verlet lists over a uniform grid.

use super::{
    geometry::{Row, place, see},
    kick::Contact,
    regions::Extent,
    state::{Kept, Lists, Memory, PART, Pairs, PartPairs, edge, stored},
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

/// The least and the most that lists hold beyond the reach, in units of it.
const MARGINS: [f32; 2] = [1.0, 24.0];

/// How many substeps lists are to last, where they hold no more pairs an edge by that.
const LASTS: f32 = 6.0;
const MOST_PAIRS: f32 = 16.0;

/// The side of a region, in units of the reach at least, and for so many substeps by what motions anywhere differ by.
const REGION: f32 = 12.0;
const REGION_LASTS: f32 = 3.0;

/// The most pairs that lists hold, of eight bytes each, unless so many nodes have the fewest of them; and the fewest
/// and most that an edge may have: more only where strands lie in one place by the hundred.
const MOST_PAIRS_OF_ALL: usize = 8 << 20;
const MOST_PAIRS_OF_AN_EDGE: [usize; 2] = [32, 1024];

/// Half the length of the pieces in which edges are put into the grid, in units of reach and mean margin.
const HALF_PIECE: f32 = 0.7;

/// Edges whose pairs may be farther than this, in units of the mean, search in several boxes.
const MOST_IN_A_BOX: f32 = 2.0;

/// Subdivision of the grid's cells: see `neighbours.rs`.
const SLICED: Vec3 = Vec3::new(4.0, 1.0, 1.0);

/// Cost per node (ns).
const SEARCH: usize = 400;

/// Scratch space of a search.
#[derive(Default)]
struct Scratch {
    close_by: Stack,
    /// For each node, the last edge that has met the one which starts there.
    met_by: Vec<u32>,
    edges: Vec<u32>,
    /// Edges that are near, by their distance (m).
    near: Vec<(f32, u32)>,
}

impl Lists {
    /// How far from the edge that starts at a node others are that are its pairs (m), at most.
    fn within(&self, node: usize) -> f32 {
        let margins = self.regions.of(node).iter().map(|cell| self.margins[*cell as usize]);
        self.reach + margins.fold(0.0, f32::max)
    }

    /// The number of pieces of an edge, and their middles.
    fn pieces_of(&self, places: &[Row], edge: u32) -> impl Iterator<Item = Vec3> + use<> {
        let (a, b) = (place(&places[edge as usize]), place(&places[edge as usize + 1]));
        // An absurdly long edge is cut into at most 64 pieces.
        let n = (a.distance(b) / (2.0 * self.half_piece)).ceil().clamp(1.0, 64.0);
        (0..n as u32).map(move |k| a.lerp(b, (k as f32 + 0.5) / n))
    }

    /// Boxes around a place that reach as far.
    fn boxes(&self, middle: Vec3, reach: f32) -> impl Iterator<Item = [Vec3; 2]> + use<> {
        let n = (reach / self.half_box).ceil().clamp(1.0, 16.0) as u32;
        let side = 2.0 * reach / n as f32;
        (0..n * n * n).map(move |k| {
            let at = Vec3::new((k % n) as f32, (k / n % n) as f32, (k / (n * n)) as f32);
            let low = middle - reach + at * side;
            [low, low + side]
        })
    }

    /// Whether no pair is missing that may be near now, or whose cores may be at the end of the substep, by the `way` that
    /// each node goes in it.
    fn is_complete(&mut self, places: &[Row], core: f32, way: impl Fn(usize) -> Vec3) -> bool {
        let Self { regions, margins, differences, places: before, reach, .. } = self;
        let moved = |node: usize| {
            let now = place(&places[node]) - place(&before[node]);
            [now, now + way(node)]
        };
        let mut all = [Extent::default(); 2];
        for node in 0..places.len() - 2 {
            let moved = moved(node);
            all.iter_mut().zip(moved).for_each(|(all, motion)| all.add(motion));
        }
        // Cores are thinner than what reaches.
        let spare = *reach - core.min(*reach);
        let fits = |[now, then]: [f32; 2], margin: f32| now <= margin && then <= margin + spare;
        let all = all.map(Extent::across);
        let least = margins.iter().copied().fold(f32::INFINITY, f32::min);
        if fits(all, least) {
            return true;
        }
        if !fits(all, regions.size() - *reach) {
            return false;
        }
        regions.differences(moved, differences);
        differences.iter().zip(&*margins).all(|(differ, margin)| fits(*differ, *margin))
    }

    /// Chooses regions and their margins for nodes that go such a `way` in a substep, where lists hold so many pairs a node.
    fn choose_margins(&mut self, places: &[Row], pairs: f32, way: impl Fn(usize) -> Vec3) {
        let Self { regions, margins, differences, strands, reach, .. } = self;
        let nodes = places.len() - 2;
        let mut all = Extent::default();
        (0..nodes).for_each(|node| all.add(way(node)));
        let size = f32::max(REGION * *reach, REGION_LASTS * all.across() + *reach);
        regions.begin(&places[..nodes], strands, size);
        regions.differences(|node| [way(node); 2], differences);
        // Pairs grow with the square of the distance.
        let mean = self.half_piece / HALF_PIECE;
        let most = (MOST_PAIRS / pairs.max(1e-3)).sqrt() * mean - *reach;
        let [least, last] = MARGINS.map(|margin| margin * *reach);
        let margin = |[differ, _]: &[f32; 2]| (LASTS * differ).min(most.max(*differ));
        margins.clear();
        margins.extend(differences.iter().map(|differ| margin(differ).clamp(least, last)));
    }

    fn begin(&mut self, places: &[Row]) {
        let (mut sum, mut count, mut most) = (0.0, 0.0, self.reach);
        for within in edges(&self.strands).map(|edge| self.within(edge)) {
            (sum, count, most) = (sum + within, count + 1.0, most.max(within));
        }
        let mean = f32::max(sum / f32::max(count, 1.0), self.reach);
        self.half_piece = HALF_PIECE * mean;
        self.half_box = most.min(MOST_IN_A_BOX * mean) + 2.0 * self.half_piece;
        self.most = (MOST_PAIRS_OF_ALL / places.len())
            .clamp(MOST_PAIRS_OF_AN_EDGE[0], MOST_PAIRS_OF_AN_EDGE[1]);
        self.places.clear();
        self.places.extend_from_slice(places);
        let mut unsorted = core::mem::take(&mut self.unsorted);
        unsorted.clear();
        for edge in edges(&self.strands).map(|edge| edge as u32) {
            unsorted.extend(self.pieces_of(places, edge).map(|middle| (middle, edge)));
        }
        self.unsorted = unsorted;
        let numbered = self.unsorted.iter().zip(0..).map(|((middle, _), k)| (*middle * SLICED, k));
        self.grid.build(2.002 * self.half_box, numbered);
        let sorted = self.grid.order().map(|k| self.unsorted[k as usize]);
        Pieces::collect(sorted, &mut self.pieces);
    }
}

/// The edges of all strands, by their first nodes.
fn edges(strands: &[Range<u32>]) -> impl Iterator<Item = usize> {
    strands.iter().flat_map(|s| s.start as usize..s.end.saturating_sub(1) as usize)
}

impl Lists {
    /// Builds the lists again where they may miss a pair of which each node goes such a `way` in the substep (m).
    pub(super) fn look_up(
        &mut self,
        parts: &mut Vec<PartPairs>,
        places: &[Row],
        strands: &[Range<u32>],
        contact: &Contact<f32>,
        way: impl Fn(usize) -> Vec3,
    ) {
        let is_other = self.reach != contact.reach || self.strands != *strands;
        // Only cores need pairs before they are near.
        let ahead = |node: usize| if contact.core > 0.0 { way(node) } else { Vec3::ZERO };
        if !is_other && self.is_complete(places, contact.core, ahead) {
            return;
        }
        if is_other {
            parts.iter_mut().for_each(PartPairs::forget);
        }
        let pairs: usize = parts.iter().map(|part| part.seconds.len()).sum();
        (self.reach, self.core) = (contact.reach, contact.core);
        self.strands.clear();
        self.strands.extend_from_slice(strands);
        self.choose_margins(places, pairs as f32 / places.len() as f32, way);
        self.build(parts, places);
    }

    /// Builds the lists of nodes at these places, padded with two that are not numbers.
    fn build(&mut self, parts: &mut Vec<PartPairs>, places: &[Row]) {
        self.begin(places);
        let lists = &*self;
        parts.resize_with(lists.strands.len().div_ceil(PART), PartPairs::default);
        let level = simd_level();
        let each = Nanos(SEARCH * places.len() / parts.len().max(1));
        let mut work: Vec<_> = parts.iter_mut().zip(lists.strands.chunks(PART)).collect();
        for_each_block(
            &mut work,
            each,
            Default::default,
            |scratch: &mut Scratch, (part, strands)| {
                dispatch!(level, simd => part.search(simd, places, strands, lists, scratch));
            },
        );
    }
}

impl Pairs {
    /// What a substep finds of the one before: lists, as the places that they were built from, and what pairs remember.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let mut places = core::mem::take(&mut self.lists.places);
        let mut ends: Vec<u32> = self.lists.strands.iter().map(|strand| strand.end).collect();
        let kept = || self.parts.iter().flat_map(|part| &part.kept);
        let mut counts: Vec<u32> = self.parts.iter().map(|part| part.kept.len() as u32).collect();
        let mut numbers: Vec<u32> = kept().map(|kept| kept.number).collect();
        let mut pasts: Vec<Row> = kept().map(|kept| kept.past).collect();
        tape.list(&mut places);
        tape.list(&mut ends);
        let Lists { reach, core, regions, margins, .. } = &mut self.lists;
        let mut size = regions.size();
        tape.values([reach, core, &mut size]);
        tape.list(margins);
        tape.list(&mut counts);
        tape.list(&mut numbers);
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
        self.lists.strands = starts.zip(&ends).map(|(start, end)| start..*end).collect();
        self.lists.regions.begin(&places[..nodes], &self.lists.strands, size);
        self.lists.build(&mut self.parts, &places);
        let mut kept = numbers.into_iter().zip(pasts).map(|(number, past)| Kept { number, past });
        for (part, count) in self.parts.iter_mut().zip(counts) {
            part.kept.clear();
            part.kept.extend(kept.by_ref().take(count as usize));
        }
    }
}

impl PartPairs {
    fn forget(&mut self) {
        self.starts.clear();
        self.seconds.clear();
        self.built.clear();
        self.kept.clear();
    }

    /// Builds the lists of these strands' edges. Pairs that were there before keep their past.
    #[inline(always)]
    fn search<S: Simd>(
        &mut self,
        simd: S,
        places: &[Row],
        strands: &[Range<u32>],
        lists: &Lists,
        Scratch { close_by, met_by, edges, near }: &mut Scratch,
    ) {
        let Self { first: own_first, starts, seconds, built, kept, before, is_crowded, .. } = self;
        *is_crowded = false;
        core::mem::swap(&mut before.0, starts);
        core::mem::swap(&mut before.1, seconds);
        core::mem::swap(&mut before.2, kept);
        let nowhere = places.len() as u32 - 2;
        met_by.clear();
        met_by.resize(places.len(), nowhere);
        starts.clear();
        seconds.clear();
        built.clear();
        kept.clear();
        let mut memory = Memory(&before.2);
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
                let within = lists.within(a as usize);
                // How far apart the middles of pieces are that are near each other, at most.
                let close = within + 2.0 * lists.half_piece;
                for middle in lists.pieces_of(places, a) {
                    for around in lists.boxes(middle, close) {
                        let rows = lists.grid.rows_in_box(around[0] * SLICED, around[1] * SLICED);
                        let sixteens = rows.map(|r| match r.is_empty() {
                            true => &[],
                            false => &lists.pieces[r.start / 16..r.end.div_ceil(16)],
                        });
                        close_by.clear(sixteens.iter().map(|s| s.len() * 16).sum());
                        for pieces in sixteens.into_iter().flatten() {
                            pieces.close(simd, middle, close * close, close_by);
                        }
                        // Of two edges the first has the pair, once.
                        for b in close_by.items().iter().filter(|b| **b >= own.end) {
                            if core::mem::replace(&mut met_by[*b as usize], a) != a {
                                edges.push(*b);
                            }
                        }
                    }
                }
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
                }
                near.sort_unstable_by_key(|(_, second)| *second);
                let mut old = Old::of_edge(before, (a - first) as usize);
                for (distance, second) in &*near {
                    let number = seconds.len() as u32;
                    let past = match old.number(*second) {
                        Some(known) => memory.of(known),
                        None => (*distance < lists.core).then_some([0.0, 0.0, 0.0, -0.0]),
                    };
                    kept.extend(past.map(|past| Kept { number, past }));
                    seconds.push(*second);
                    built.push(*distance);
                }
            }
        }
        starts.push(seconds.len() as u32);
    }
}

/// The pairs that an edge had: the number of the first, and their second edges.
struct Old<'a> {
    first: u32,
    seconds: &'a [u32],
}

impl<'a> Old<'a> {
    fn of_edge((starts, seconds, _): &'a (Vec<u32>, Vec<u32>, Vec<Kept>), edge: usize) -> Self {
        let [first, end] = starts.get(edge..edge + 2).map_or([0; 2], |w| [w[0], w[1]]);
        let seconds = seconds.get(first as usize..end as usize).unwrap_or_default();
        Self { first, seconds }
    }

    /// The number that a pair had; asked for in ascending order.
    fn number(&mut self, second: u32) -> Option<u32> {
        let passed = self.seconds.iter().take_while(|known| **known < second).count();
        (self.first, self.seconds) = (self.first + passed as u32, &self.seconds[passed..]);
        self.seconds.first().filter(|known| **known == second).map(|_| self.first)
    }
}
