//! Verlet lists of the edges around every node, and the contact forces from them.
//!
//! A list holds every edge within the reach 2r of equation 18 plus a margin (the Verlet skin). It stays
//! complete until some node has moved by half the margin, and is rebuilt then, so hair at rest needs no
//! neighbour search.
//!
//! The search has three stages, each in lanes and each finer than the previous one: the grid's
//! cells around a node, the short pieces of edges whose middles are near, the edges that are near.
//! With exact tests on all edges of the cells, scene 1 took 1.3 times as long.

use super::{
    coarse::Coarse,
    lanes::{self, Bridges, NodeRow, Penalty, PenaltySum, Pieces, Stack, Touch, WIDTH, WetRow},
    model::{Bridged, Film},
};
use crate::base::{
    grid::UniformGrid,
    lanes::{dispatch, simd_level},
    parallel::{Nanos, for_each_block},
};
use core::{
    ops::Range,
    sync::atomic::{AtomicUsize, Ordering},
};
use fearless_simd::{Level, Simd};
use glam::Vec3;

/// Margin of the lists, in units of the reach. More means longer lists, built less often.
const MARGIN: f32 = 1.6;

/// The same for fast strands, whose lists are soon rebuilt whatever their margin.
const FAST_MARGIN: f32 = 0.5;

/// For how many lookups such lists are used. Neighbours mostly move together; strands that approach
/// faster than the margin allows are found one tick later.
const FAST_LOOKUPS: u32 = 2;

/// A rebuild pays off after this many groups per node were tested in vain since the last one.
const IDLE_GROUPS: usize = 10;

/// Half the length of the pieces in which edges are put into the grid, in units of reach and margin.
/// Shorter ones take longer to sort (0.5: scene 1 takes 5 % longer), longer ones filter less.
const HALF_PIECE: f32 = 0.8;

/// The most edges that a node's list holds, the nearest: more only where strands by the thousand lie in one
/// place, and would cost the square of their number.
const MOST_EDGES: usize = 4096;

/// The most memory of a hair's lists, and more for each node (bytes). Where that is too little, each node's
/// list holds an equal share.
const MOST_BYTES: usize = 256 << 20;
const MOST_BYTES_A_NODE: usize = 1 << 10;

/// Contact is mutual where lists hold up to so many edges a node, in the mean: more only where strands by
/// the hundred lie in one place, and memory for what each pushes back would grow with the square of their number.
const MOST_MUTUAL: usize = 256;

/// The most that mutual contact may take of a pair's depth in a step, summed over what touches a node. Of 113 locks of
/// curls on a character 34 were awake after 5 s with 0.25, 17 with 0.1 and 3 with 0.04; nodes were on average in
/// the same places within 0.2 mm.
const STEEPEST: f32 = 0.04;

/// Longest bridge of water, in units of the reach: the rest of the margin is how far nodes may move
/// before lists are rebuilt.
pub(super) const LONGEST_BRIDGE: f32 = 0.6;

/// Subdivision of the grid's cells. They are twice as wide as the search radius, so that a node visits
/// few rows, and subdivided along the rows to keep these short.
const SLICED: Vec3 = Vec3::new(4.0, 1.0, 1.0);

/// Strands per work chunk.
const PART: usize = 16;

/// Cost per node (ns): measuring its displacement, its neighbour search, its contacts, its bridges
/// of water.
const MEASURE: usize = 2;
const SEARCH: usize = 250;
const PUSH: usize = 40;
const BRIDGE: usize = 60;

/// The cost of a chunk at `nanos` per node.
fn per_part(nanos: usize, rows: &[NodeRow], strands: usize) -> Nanos {
    Nanos(nanos * PART * rows.len() / strands.max(1))
}

/// The nodes of one hair, the lists of edges near them, and the forces from these.
#[derive(Clone, Debug, Default)]
pub struct Neighbours {
    rows: Vec<NodeRow>,
    /// How often each node is touched, by itself and through its edges.
    touched: Vec<f32>,
    /// What mutual contact does to each node (m/s²).
    mutual: Vec<Vec3>,
    /// Expected positions of the nodes in the middle of the period that lists are used for; empty
    /// for the present positions.
    expected: Vec<NodeRow>,
    /// The nodes of each strand.
    strands: Vec<Range<u32>>,
    /// Which nodes of fine strands are sampled as rows.
    coarse: Coarse,
    lists: Lists,
    parts: Vec<PartLists>,
    /// Extra margin for bridges of water (m).
    beyond: f32,
    /// Scratch space of snapshots.
    restored: Vec<u32>,
}

/// When lists that may miss a pair are rebuilt.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Lookup {
    /// Now.
    Now,
    /// Later: the search for strands in fast motion serves several substeps. Strands that approach
    /// faster than the lists' margin allows are found then.
    Later,
}

/// The state that the lists were built from.
#[derive(Clone, Debug, Default)]
struct Lists {
    grid: UniformGrid,
    pieces: Vec<Pieces>,
    unsorted: Vec<(Vec3, u32)>,
    rows: Vec<NodeRow>,
    strands: Vec<Range<u32>>,
    reach: f32,
    margin: f32,
    /// The farthest that a node has moved since (m).
    moved: f32,
    /// Groups out of reach tested since.
    idle: usize,
    /// Whether strands move so fast that the margin is the smaller one.
    is_fast: bool,
    /// For how many more lookups these lists are used, however far nodes move.
    good_for: u32,
    /// Whether the parts' lists of bridged edges are of these.
    are_joined: bool,
}

/// The lists and pushes of some strands' nodes.
#[derive(Clone, Debug, Default)]
struct PartLists {
    /// Where each node's groups begin, and where the last one's end.
    starts: Vec<u32>,
    groups: Vec<EdgeGroup>,
    /// For each node how far its nearest edge was beyond the reach (m): most nodes of loose hair are
    /// rejected by this alone.
    slacks: Vec<f32>,
    /// The square of how far a node has moved since (m²).
    moved: f32,
    /// Groups out of reach tested for the last pushes.
    idle: usize,
    pushes: Vec<Vec3>,
    touches: Vec<Touch>,
    bridged: Vec<Bridged>,
    /// The edges that water may join to each node in this tick, and where each node's end.
    joined: Vec<[u32; WIDTH]>,
    joined_ends: Vec<u32>,
    soon: Stack,
    /// Whether a node had more edges near than its list holds.
    is_crowded: bool,
}

/// Eight edges near a node, by their start node.
#[derive(Clone, Copy, Debug)]
struct EdgeGroup {
    edges: [u32; WIDTH],
    /// How far the nearest of them was beyond the reach (m); no edge of a later group was nearer.
    slack: f32,
}

/// The most memory of lists for so many nodes.
fn most_bytes(nodes: usize) -> usize {
    MOST_BYTES + MOST_BYTES_A_NODE * nodes
}

/// How long lists may become.
struct Limit<'a> {
    /// Those of a node.
    most_edges: usize,
    /// All together; what is found beyond is of no use.
    most_groups: usize,
    groups: &'a AtomicUsize,
}

impl Limit<'_> {
    fn has_room_for(&self, more: usize) -> bool {
        self.groups.fetch_add(more, Ordering::Relaxed) + more <= self.most_groups
    }
}

/// Scratch space of the search for one node.
#[derive(Default)]
struct SearchScratch {
    close_by: Stack,
    edges: Stack,
    distances: Stack,
    /// Sort keys: squared distance in the high bits, edge in the low bits.
    found: Vec<u64>,
}

impl Neighbours {
    /// Removes the nodes, not the lists.
    pub fn clear(&mut self) {
        self.rows.clear();
        self.expected.clear();
        self.strands.clear();
        self.coarse.clear();
    }

    /// Adds a strand with its present nodes. Of every `stride` nodes one is sampled, the others are
    /// interpolated.
    pub fn add(&mut self, nodes: &[Vec3], stride: usize) {
        let start = self.rows.len() as u32;
        self.rows.extend(lanes::rows(self.coarse.add(nodes, stride)));
        self.strands.push(start..self.rows.len() as u32);
    }

    /// For how many lookups the next lists will be used if motion stays the same.
    pub fn lookups(&self) -> u32 {
        if self.lists.is_fast { FAST_LOOKUPS } else { 1 }
    }

    /// Sets where the nodes of the strand that was added last are expected. Takes effect only if set for
    /// all strands. Sampled strands are expected at their present positions.
    pub fn expect(&mut self, nodes: impl ExactSizeIterator<Item = Vec3>) {
        let Some(strand) = self.strands.last() else { return };
        let own = &self.rows[strand.start as usize..strand.end as usize];
        if nodes.len() != own.len() {
            self.expected.extend_from_slice(own);
            return;
        }
        self.expected.extend(own.iter().zip(nodes).map(|(row, p)| [p.x, p.y, p.z, row[3]]));
    }

    /// Evaluates equation 18 for every node, for [`pushes`](Self::pushes) to return. The order of
    /// summation does not depend on threads.
    pub fn find_pushes(&mut self, penalty: Penalty, lookup: Lookup) {
        let Penalty { reach, mutual, .. } = penalty;
        // Lists are padded with an edge at NaN.
        let nodes = self.strands.last().map_or(0, |strand| strand.end as usize);
        self.rows.truncate(nodes);
        self.rows.extend([[f32::NAN; 4]; 2]);
        self.expected.truncate(nodes);
        let level = simd_level();
        if self.are_stale(reach, lookup) {
            self.look_up(level, reach, most_bytes(nodes));
            self.measure_displacement();
        }
        let mutual = mutual && self.pairs() <= MOST_MUTUAL * nodes;
        let Self { rows, strands, lists, parts, .. } = self;
        let mut work: Vec<_> = parts.iter_mut().zip(strands.chunks(PART)).collect();
        let penalty = Penalty { mutual, ..penalty };
        for_each_block(
            &mut work,
            per_part(PUSH, rows, strands.len()),
            || (),
            |(), (part, strands)| {
                dispatch!(level, simd => part.push(simd, rows, strands, lists.moved, penalty));
            },
        );
        lists.idle += parts.iter().map(|part| part.idle).sum::<usize>();
        if mutual {
            self.push_both(nodes, penalty);
        }
    }

    /// Pushes each node and the edge that it touches apart, by halves: of two strands each pushes the other's
    /// nodes. Where a node has so many touches that their push in one step would throw it past where they
    /// balance, they push by as much less, both sides alike.
    fn push_both(&mut self, nodes: usize, Penalty { reach, strength, dt, .. }: Penalty) {
        let Self { touched, mutual, parts, .. } = self;
        let touches = || parts.iter().flat_map(|part| &part.touches);
        touched.clear();
        touched.resize(nodes, 0.0);
        mutual.clear();
        mutual.resize(nodes, Vec3::ZERO);
        for touch in touches() {
            let (node, edge) = (touch.node as usize, touch.edge as usize);
            touched[node] += touch.part;
            touched[edge] += touch.part * (1.0 - touch.at);
            touched[edge + 1] += touch.part * touch.at;
        }
        let of_touch = 0.5 * strength / reach * dt * dt;
        for Touch { node, edge, at, push, .. } in touches() {
            let (node, edge) = (*node as usize, *edge as usize);
            let most = touched[node].max(touched[edge] * (1.0 - at) + touched[edge + 1] * at);
            let push = *push * (0.5 * (STEEPEST / (of_touch * most)).min(1.0));
            mutual[node] += push;
            mutual[edge] -= push * (1.0 - at);
            mutual[edge + 1] -= push * *at;
        }
        let pushes = parts.iter_mut().flat_map(|part| &mut part.pushes);
        pushes.zip(mutual).for_each(|(push, mutual)| *push = *mutual);
    }

    /// What [`find_pushes`](Self::find_pushes) found for every node (m/s²), in the order they were added.
    pub fn pushes(&self) -> impl Iterator<Item = Vec3> {
        let pushes = self.parts.iter().flat_map(|part| part.pushes.iter().copied());
        self.coarse.spread(pushes, Vec3::lerp)
    }

    /// Builds the lists, of about `most_bytes` at most.
    fn look_up(&mut self, level: Level, reach: f32, most_bytes: usize) {
        let Self { rows, expected, strands, lists, parts, beyond, .. } = self;
        let (mut places, mut fast) = (&*rows, false);
        if expected.len() + 2 == rows.len() {
            let way = |(a, b)| lanes::place(a).distance_squared(lanes::place(b));
            let farthest = rows.iter().zip(&*expected).map(way).fold(0.0, f32::max).sqrt();
            fast = farthest >= 0.5 * (MARGIN * reach - *beyond);
            expected.extend([[f32::NAN; 4]; 2]);
            places = expected;
        }
        let margin = if fast { FAST_MARGIN.max(*beyond / reach) } else { MARGIN };
        lists.is_fast = fast;
        lists.good_for = if fast { FAST_LOOKUPS - 1 } else { 0 };
        lists.build(level, (places, strands), (reach, margin), parts, most_bytes);
    }

    /// Whether the lists have to be rebuilt for the present nodes.
    fn are_stale(&mut self, reach: f32, lookup: Lookup) -> bool {
        if self.lists.reach != reach || self.lists.strands != self.strands {
            return true;
        }
        self.measure_displacement();
        let Self { rows, lists, beyond, .. } = self;
        if lookup == Lookup::Now && lists.good_for > 0 {
            lists.good_for -= 1;
            return false;
        }
        let complete = lists.moved < 0.5 * (lists.margin * reach - *beyond);
        let pays = lists.idle > IDLE_GROUPS * rows.len();
        lookup == Lookup::Now && (!complete || pays)
    }

    /// Measures how far nodes are from where the lists were built.
    fn measure_displacement(&mut self) {
        let Self { rows, strands, lists, parts, .. } = self;
        let mut work: Vec<_> = parts.iter_mut().zip(strands.chunks(PART)).collect();
        let each = per_part(MEASURE, rows, strands.len());
        for_each_block(
            &mut work,
            each,
            || (),
            |(), (part, strands)| part.measure_displacement(rows, strands, lists),
        );
        // A non-finite node makes the maximum NaN, which is not below the limit.
        let squared = parts.iter().map(|part| part.moved).fold(0.0, larger);
        lists.moved = squared.sqrt();
    }

    /// How many nodes there are.
    pub fn nodes(&self) -> usize {
        self.coarse.nodes()
    }

    /// From the next rebuild on, lists are complete up to `beyond` (m) more than strands' reach.
    pub fn set_extra_margin(&mut self, beyond: f32) {
        if beyond > self.beyond {
            self.lists.good_for = 0;
        }
        self.beyond = beyond;
    }

    /// Whether lists cover bridges of water.
    pub fn has_extra_margin(&self) -> bool {
        self.beyond > 0.0
    }

    /// The bridges of water at every node, after [`find_pushes`](Self::find_pushes) of the same places. `wet` has
    /// a row for each node, in the order they were added. Bridges form and break at the start of a tick, where
    /// `again` says to look for them.
    pub fn bridges(
        &mut self,
        wet: &mut Vec<WetRow>,
        film: Film,
        again: bool,
    ) -> impl Iterator<Item = Bridged> {
        self.coarse.pick(wet);
        wet.resize(self.rows.len(), [f32::NAN; 4]);
        let level = simd_level();
        let Self { rows, strands, coarse, lists, parts, .. } = self;
        let mut work: Vec<_> = parts.iter_mut().zip(strands.chunks(PART)).collect();
        let reaches = film.longest + 2.0 * lists.moved;
        let known = core::mem::replace(&mut lists.are_joined, true) && !again;
        for_each_block(
            &mut work,
            per_part(BRIDGE, rows, strands.len()),
            || (),
            |(), (part, strands)| {
                dispatch!(level, simd => if known {
                    part.bridge_known(simd, rows, wet, strands, film);
                } else {
                    part.bridge(simd, rows, wet, strands, reaches, film);
                });
            },
        );
        let bridged = parts.iter().flat_map(|part| part.bridged.iter().copied());
        coarse.spread(bridged, Bridged::lerp)
    }

    /// Whether a node had more edges near than its list may hold: the farther ones are left out.
    pub fn is_crowded(&self) -> bool {
        self.parts.iter().any(|part| part.is_crowded)
    }

    /// Nodes and the nearest points of edges within reach (m), for drawing them.
    #[cfg(feature = "debug")]
    pub fn touching(&self) -> impl Iterator<Item = (Vec3, Vec3)> {
        let place = |i: u32| self.rows.get(i as usize).map(lanes::place);
        let of_node = move |node: u32, groups: &[EdgeGroup]| {
            let p = place(node)?;
            let edges = groups.iter().flat_map(|group| group.edges);
            let nearest = edges.filter_map(move |edge| {
                let (a, b) = (place(edge)?, place(edge + 1)?);
                let along = (p - a).dot(b - a) / a.distance_squared(b);
                Some(a.lerp(b, along.clamp(0.0, 1.0)))
            });
            let near = nearest.filter(|q| p.distance(*q) < self.lists.reach);
            Some(near.map(move |q| (p, q)).collect::<Vec<_>>())
        };
        self.parts.iter().zip(self.lists.strands.chunks(PART)).flat_map(move |(part, strands)| {
            let first = strands.first().map_or(0, |strand| strand.start);
            let groups = part.starts.windows(2).map(|w| &part.groups[w[0] as usize..w[1] as usize]);
            (first..).zip(groups).filter_map(move |(node, groups)| of_node(node, groups)).flatten()
        })
    }

    /// How many pairs of node and edge are kept, rounded up to groups of eight for each node.
    pub fn pairs(&self) -> usize {
        self.parts.iter().map(|part| part.groups.len() * WIDTH).sum()
    }
}

impl Lists {
    /// How far from a node the edges in its list are, at most (m).
    fn within(&self) -> f32 {
        self.reach * (1.0 + self.margin)
    }

    /// How far from a node the middles of their pieces are, at most (m).
    fn close(&self) -> f32 {
        self.within() * (1.0 + HALF_PIECE)
    }

    /// Ranges of the grid's order with all pieces whose middles are close to `p`, and some others.
    #[inline(always)]
    fn around(&self, p: Vec3) -> [Range<usize>; 4] {
        let close = self.close();
        self.grid.rows_in_box((p - close) * SLICED, (p + close) * SLICED)
    }

    /// Builds the lists of nodes at their `places`, padded with two at NaN, of about `most_bytes` at most.
    fn build(
        &mut self,
        level: Level,
        (places, strands): (&[NodeRow], &[Range<u32>]),
        (reach, margin): (f32, f32),
        parts: &mut Vec<PartLists>,
        most_bytes: usize,
    ) {
        self.begin(places, strands, reach, margin);
        parts.resize_with(strands.len().div_ceil(PART), PartLists::default);
        let most_groups = most_bytes / size_of::<EdgeGroup>();
        let each = per_part(SEARCH, places, strands.len());
        let mut search = |most_edges: usize| {
            // Whether the sum is too large does not depend on the order.
            let groups = AtomicUsize::new(0);
            let limit = Limit { most_edges, most_groups, groups: &groups };
            let mut work: Vec<_> = parts.iter_mut().zip(strands.chunks(PART)).collect();
            for_each_block(
                &mut work,
                each,
                Default::default,
                |scratch: &mut SearchScratch, (part, strands)| {
                    dispatch!(level, simd => part.search(simd, places, strands, self, &limit, scratch));
                },
            );
            groups.into_inner() <= most_groups
        };
        if !search(MOST_EDGES) {
            search(most_groups / places.len() * WIDTH);
        }
    }

    /// Puts all edges into the grid.
    fn begin(&mut self, rows: &[NodeRow], strands: &[Range<u32>], reach: f32, margin: f32) {
        (self.moved, self.idle, self.are_joined) = (0.0, 0, false);
        (self.reach, self.margin) = (reach, margin);
        self.rows.clear();
        self.rows.extend_from_slice(rows);
        self.strands.clear();
        self.strands.extend_from_slice(strands);
        self.unsorted.clear();
        let piece = 2.0 * HALF_PIECE * self.within();
        for strand in strands {
            for i in strand.start..strand.end.saturating_sub(1) {
                let (a, b) = (lanes::place(&rows[i as usize]), lanes::place(&rows[i as usize + 1]));
                // An absurdly long edge is cut into at most 64 pieces.
                let n = (a.distance(b) / piece).ceil().clamp(1.0, 64.0);
                let middles = (0..n as u32).map(|k| (a.lerp(b, (k as f32 + 0.5) / n), i));
                self.unsorted.extend(middles);
            }
        }
        let numbered = self.unsorted.iter().zip(0..).map(|((middle, _), k)| (*middle * SLICED, k));
        self.grid.build(2.002 * self.close(), numbered);
        let sorted = self.grid.order().map(|k| self.unsorted[k as usize]);
        Pieces::collect(sorted, &mut self.pieces);
    }
}

/// The larger of two numbers, NaN if either is.
fn larger(a: f32, b: f32) -> f32 {
    if b <= a || a.is_nan() { a } else { b }
}

impl PartLists {
    /// Measures how far these strands' nodes have moved since the lists were built.
    fn measure_displacement(&mut self, rows: &[NodeRow], strands: &[Range<u32>], lists: &Lists) {
        let start = strands.first().map_or(0, |s| s.start) as usize;
        let nodes = start..strands.last().map_or(start, |s| s.end as usize);
        let squared = (rows[nodes.clone()].iter().zip(&lists.rows[nodes]))
            .map(|(p, q)| lanes::place(p).distance_squared(lanes::place(q)));
        self.moved = squared.fold(0.0, larger);
    }

    /// Builds the lists of these strands' nodes.
    #[inline(always)]
    fn search<S: Simd>(
        &mut self,
        simd: S,
        rows: &[NodeRow],
        strands: &[Range<u32>],
        lists: &Lists,
        limit: &Limit,
        SearchScratch { close_by, edges, distances, found }: &mut SearchScratch,
    ) {
        let (within, close) = (lists.within() * lists.within(), lists.close() * lists.close());
        let nowhere = rows.len() as u32 - 2;
        self.starts.clear();
        self.starts.push(0);
        self.slacks.clear();
        self.groups.clear();
        self.is_crowded = false;
        for own in strands {
            let before = self.groups.len();
            for i in own.clone() {
                let p = lanes::place(&rows[i as usize]);
                // The root is held: pushes have no effect.
                let rows_around = if i > own.start { lists.around(p) } else { Default::default() };
                let sixteens = rows_around.map(|r| match r.is_empty() {
                    true => &[],
                    false => &lists.pieces[r.start / 16..r.end.div_ceil(16)],
                });
                close_by.clear(sixteens.iter().map(|s| s.len() * 16).sum());
                for pieces in sixteens.into_iter().flatten() {
                    pieces.close(simd, p, close, close_by);
                }
                let eights = close_by.eights(nowhere);
                edges.clear(eights.len() * 8);
                distances.clear(eights.len() * 8);
                for eight in eights {
                    lanes::near(simd, rows, eight, (p, own), within, edges, distances);
                }
                found.clear();
                let pairs = distances.items().iter().zip(edges.items());
                found.extend(pairs.map(|(d, e)| u64::from(*d) << 32 | u64::from(*e)));
                found.sort_unstable();
                found.dedup();
                self.is_crowded |= found.len() > limit.most_edges;
                found.truncate(limit.most_edges);
                for found in found.chunks(WIDTH) {
                    let mut edges = [nowhere; WIDTH];
                    edges.iter_mut().zip(found).for_each(|(e, f)| *e = *f as u32);
                    let nearest = f32::from_bits((found[0] >> 32) as u32).sqrt();
                    self.groups.push(EdgeGroup { edges, slack: nearest - lists.reach });
                }
                let first = self.starts.last().map_or(0, |start| *start as usize);
                let nearest = self.groups[first..].first().map_or(f32::INFINITY, |g| g.slack);
                self.slacks.push(nearest);
                self.starts.push(self.groups.len() as u32);
            }
            if !limit.has_room_for(self.groups.len() - before) {
                self.groups = Vec::new();
                return;
            }
        }
    }

    /// Sums equation 18 over these strands' lists.
    #[inline(always)]
    fn push<S: Simd>(
        &mut self,
        simd: S,
        rows: &[NodeRow],
        strands: &[Range<u32>],
        moved: f32,
        penalty: Penalty,
    ) {
        // Neither a node nor an edge has moved by more, so farther ones cannot touch yet.
        let may_touch = 2.0 * moved;
        self.idle = 0;
        let nodes = strands.first().map_or(0, |s| s.start) as usize;
        self.pushes.clear();
        self.touches.clear();
        let ends = self.starts.windows(2).zip(&self.slacks);
        for (node, (ends, slack)) in (nodes..).zip(ends) {
            if *slack > may_touch {
                self.pushes.push(Vec3::ZERO);
                continue;
            }
            let mut sum = PenaltySum::new(simd, rows, node, penalty);
            for group in &self.groups[ends[0] as usize..ends[1] as usize] {
                if group.slack > may_touch {
                    break;
                }
                self.idle += usize::from(group.slack > 0.0);
                sum.add(simd, rows, &group.edges, &mut self.touches);
            }
            self.pushes.push(sum.total());
        }
    }

    /// Sums the bridges of water over the edges that water joins in this tick.
    #[inline(always)]
    fn bridge_known<S: Simd>(
        &mut self,
        simd: S,
        rows: &[NodeRow],
        wet: &[WetRow],
        strands: &[Range<u32>],
        film: Film,
    ) {
        let nodes = strands.first().map_or(0, |s| s.start) as usize;
        self.bridged.clear();
        let mut first = 0;
        for (node, end) in (nodes..).zip(&self.joined_ends) {
            let edges = &self.joined[first..*end as usize];
            first = *end as usize;
            if edges.is_empty() {
                self.bridged.push(Bridged::default());
                continue;
            }
            let mut sum = Bridges::new(simd, lanes::place(&rows[node]), wet[node][3], film);
            edges.iter().for_each(|edges| sum.add(simd, rows, wet, edges));
            self.bridged.push(sum.total());
        }
    }

    /// Sums the bridges of water over these strands' lists, and notes which edges are joined.
    #[inline(always)]
    fn bridge<S: Simd>(
        &mut self,
        simd: S,
        rows: &[NodeRow],
        wet: &[WetRow],
        strands: &[Range<u32>],
        reaches: f32,
        film: Film,
    ) {
        let nodes = strands.first().map_or(0, |s| s.start) as usize;
        let nowhere = rows.len() as u32 - 2;
        self.bridged.clear();
        self.joined.clear();
        self.joined_ends.clear();
        for (k, (ends, slack)) in self.starts.windows(2).zip(&self.slacks).enumerate() {
            let node = nodes + k;
            if *slack > reaches {
                self.bridged.push(Bridged::default());
                self.joined_ends.push(self.joined.len() as u32);
                continue;
            }
            let groups = &self.groups[ends[0] as usize..ends[1] as usize];
            self.soon.clear(groups.len() * WIDTH);
            let mut sum = Bridges::new(simd, lanes::place(&rows[node]), wet[node][3], film);
            for group in groups {
                if group.slack > reaches {
                    break;
                }
                sum.find(simd, rows, wet, &group.edges, &mut self.soon);
            }
            self.joined.extend_from_slice(self.soon.eights(nowhere));
            self.joined_ends.push(self.joined.len() as u32);
            self.bridged.push(sum.total());
        }
    }
}

mod record;

#[cfg(test)]
mod limits;
#[cfg(test)]
mod mutual;

#[cfg(test)]
mod tests {
    use super::{super::model::*, *};
    use proptest::prelude::*;

    pub fn printed(radius: f32) -> Penalty {
        Penalty { reach: 2.0 * radius, strength: 20.0, mutual: false, dt: 1e-3 }
    }

    /// Equation 18 of all edges but those of the strand `own` at a place `p`.
    fn brute(strands: &[Vec<Vec3>], own: usize, p: Vec3, radius: f32) -> Vec3 {
        let others = strands.iter().enumerate().filter(|(s, _)| *s != own);
        let edges = others.flat_map(|(_, strand)| {
            let last = strand.len() - 2;
            (0..=last).map(move |j| Edge::new(strand[j], strand[j + 1], j == last))
        });
        let push = |foot: Vec3| {
            let (distance, reach) = (p.distance(foot), 2.0 * radius);
            let touching = distance > SAME_PLACE.sqrt() && distance < reach;
            touching.then(|| (p - foot) * penalty(distance, reach, 20.0))
        };
        edges.filter_map(|e| push(e.foot(p)?)).sum()
    }

    fn pushes(list: &mut Neighbours, strands: &[Vec<Vec3>], radius: f32) -> Vec<Vec3> {
        list.clear();
        strands.iter().for_each(|s| list.add(s, 1));
        list.find_pushes(printed(radius), Lookup::Now);
        list.pushes().collect()
    }

    proptest! {
        #[test]
        fn lists_and_lanes_find_what_all_pairs_find_even_after_small_moves(
            raw in proptest::collection::vec((0f32..1.0, 0f32..1.0, 0f32..1.0), 8..120),
            radius in 0.002f32..0.1,
            nodes in 2usize..8,
            drift in -0.9f32..0.9,
        ) {
            let points: Vec<Vec3> = raw.iter().map(|&(x, y, z)| Vec3::new(x, y, z)).collect();
            let mut strands: Vec<Vec<Vec3>> =
                points.chunks_exact(nodes).map(<[Vec3]>::to_vec).collect();
            let mut list = Neighbours::default();
            pushes(&mut list, &strands, radius);
            let built_with = list.lists.rows.clone();
            // less than half the margin: the old lists must still be complete
            for strand in &mut strands {
                for (k, p) in strand.iter_mut().enumerate() {
                    let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                    *p += Vec3::new(0.0, sign * drift * radius, 0.0);
                }
            }
            let found = pushes(&mut list, &strands, radius);
            prop_assert_eq!(&list.lists.rows[0][..], &built_with[0][..]);
            for (k, a) in found.into_iter().enumerate() {
                let (s, i) = (k / nodes, k % nodes);
                if i == 0 {
                    prop_assert_eq!(a, Vec3::ZERO, "roots are held");
                    continue;
                }
                let p = strands[s][i];
                let b = brute(&strands, s, p, radius);
                // Lanes round differently: as if the node were some rounding errors away, which matters
                // next to an edge or where a foot changes to the next edge.
                let rounding: f32 = Vec3::AXES
                    .into_iter()
                    .flat_map(|d| [p + d * 2e-6, p - d * 2e-6])
                    .map(|p| brute(&strands, s, p, radius).distance(b))
                    .sum();
                prop_assert!(
                    a.distance(b) < 1e-3 + rounding,
                    "strand {} node {}: {} against {}", s, i, a, b
                );
            }
        }
    }

    proptest! {
        #[test]
        fn lanes_bridge_as_the_model_does_even_after_small_moves(
            raw in proptest::collection::vec((0f32..1.0, 0f32..1.0, 0f32..1.0), 8..90),
            films in proptest::collection::vec(0f32..1.0, 90),
            radius in 0.02f32..0.1,
            nodes in 2usize..8,
            drift in -0.45f32..0.45,
        ) {
            let points: Vec<Vec3> = raw.iter().map(|&(x, y, z)| Vec3::new(x, y, z)).collect();
            let mut strands: Vec<Vec<Vec3>> =
                points.chunks_exact(nodes).map(<[Vec3]>::to_vec).collect();
            let film = Film { reach: 2.0 * radius, longest: LONGEST_BRIDGE * 2.0 * radius };
            let mut list = Neighbours::default();
            list.set_extra_margin(film.longest);
            pushes(&mut list, &strands, radius);
            for strand in &mut strands {
                for (k, p) in strand.iter_mut().enumerate() {
                    *p += Vec3::Y * (drift * radius * if k % 2 == 0 { 1.0 } else { -1.0 });
                }
            }
            pushes(&mut list, &strands, radius);
            // Every third strand is dry, velocities are anything.
            let area = |s: usize, i: usize| {
                let film = films[(s * nodes + i) % films.len()];
                if s.is_multiple_of(3) { 0.0 } else { film * radius * radius }
            };
            let speed = |s: usize, i: usize| Vec3::new(s as f32, i as f32, 0.5);
            let mut wet: Vec<WetRow> = (0..strands.len() * nodes)
                .map(|k| (k / nodes, k % nodes))
                .map(|(s, i)| speed(s, i).extend(area(s, i)).to_array())
                .collect();
            let found: Vec<Bridged> = list.bridges(&mut wet, film, true).collect();
            for (k, found) in found.iter().enumerate() {
                let (own, n) = (k / nodes, k % nodes);
                if n == 0 {
                    prop_assert_eq!(*found, Bridged::default());
                    continue;
                }
                let brute = |p: Vec3| {
                    let mut all = Bridged::default();
                    for s in (0..strands.len()).filter(|&s| s != own) {
                        for j in 0..nodes - 1 {
                            let (a, b) = (strands[s][j], strands[s][j + 1]);
                            let Some(foot) = Edge::new(a, b, j + 2 == nodes).foot(p) else {
                                continue;
                            };
                            let t = (foot - a).dot(b - a) / (b - a).length_squared().max(1e-20);
                            let both = area(own, n) + area(s, j) * (1.0 - t) + area(s, j + 1) * t;
                            let velocity = speed(s, j).lerp(speed(s, j + 1), t);
                            let one = bridged(p, foot, velocity, both, film);
                            all.pull += one.pull;
                            all.drift += one.drift;
                            all.steepness += one.steepness;
                            all.strength += one.strength;
                        }
                    }
                    all
                };
                let expected = brute(strands[own][n]);
                let rounding: f32 = Vec3::AXES
                    .into_iter()
                    .flat_map(|d| [d * 2e-6, d * -2e-6])
                    .map(|d| brute(strands[own][n] + d))
                    .map(|b| b.pull.distance(expected.pull) + (b.strength - expected.strength).abs())
                    .sum();
                // It has a step where a bridge breaks.
                let breaks = Vec3::AXES
                    .into_iter()
                    .flat_map(|d| [d * 1e-5, d * -1e-5])
                    .map(|d| (brute(strands[own][n] + d).steepness - expected.steepness).abs());
                let most = 1e-3 * (1.0 + expected.steepness) + breaks.sum::<f32>();
                let off = (found.steepness - expected.steepness).abs();
                prop_assert!(off < most, "steepness {} of {}, not {}", k, found.steepness, expected.steepness);
                prop_assert!(found.pull.distance(expected.pull) < 1e-3 + rounding, "pull {}", k);
                prop_assert!((found.strength - expected.strength).abs() < 1e-3 + rounding, "strength {}", k);
                let most = 1e-2 + 50.0 * rounding;
                prop_assert!(found.drift.distance(expected.drift) < most, "drift {}", k);
            }
        }
    }

    #[test]
    fn lists_for_expected_positions_cover_the_whole_path() {
        // Two bundles fly 4 cm past each other, 4 mm a substep; lists are good for 1.6 mm to each side.
        let bundle = |at: Vec3| -> Vec<Vec<Vec3>> {
            let strand =
                |k: usize| (0..6).map(move |i| Vec3::new(1.5e-3 * k as f32, 5e-3 * i as f32, 0.0));
            (0..8).map(|k| strand(k).map(|p| p + at).collect()).collect()
        };
        let (way, steps) = (Vec3::X * 4e-3, 10);
        let mut list = Neighbours::default();
        let mut looked_up = 0;
        for step in 0..steps {
            let strands = bundle(way * step as f32);
            list.clear();
            let middle = way * ((steps - 1) as f32 / 2.0 - step as f32);
            for strand in &strands {
                list.add(strand, 1);
                list.expect(strand.iter().map(|p| *p + middle));
            }
            let lookup = if step == 0 { Lookup::Now } else { Lookup::Later };
            let before = list.lists.rows.clone();
            list.find_pushes(printed(1e-3), lookup);
            let found: Vec<Vec3> = list.pushes().collect();
            looked_up += usize::from(list.lists.rows[..1] != before[..before.len().min(1)]);
            for (k, a) in found.into_iter().enumerate().filter(|(k, _)| k % 6 > 0) {
                let b = brute(&strands, k / 6, strands[k / 6][k % 6], 1e-3);
                assert!(a.distance(b) < 1e-2, "step {step}, node {k}: {a} against {b}");
            }
        }
        assert_eq!(looked_up, 1);
    }

    #[test]
    fn non_finite_nodes_push_nothing() {
        let strand =
            |z: f32| -> Vec<Vec3> { (0..5).map(|i| Vec3::new(0.01 * i as f32, 0.0, z)).collect() };
        let mut strands = vec![strand(0.0), strand(1e-3), strand(5e-4)];
        let mut list = Neighbours::default();
        pushes(&mut list, &strands, 1e-3);
        for wrong in [f32::NAN, f32::INFINITY] {
            strands[2][2].y = wrong;
            let found = pushes(&mut list, &strands, 1e-3);
            assert!(found[..10].iter().all(|p| p.is_finite()), "{found:?}");
            // its finite nodes and edges still count
            assert!(found[1].z < 0.0 && found[6].z > 0.0);
        }
    }

    #[test]
    fn lists_are_complete_whatever_has_moved_since() {
        // Two strands beyond the margin come together by little more than half of it each.
        let (radius, reach) = (1e-3_f32, 2e-3_f32);
        let strand =
            |z: f32| -> Vec<Vec3> { (0..4).map(|i| Vec3::new(0.02 * i as f32, 0.0, z)).collect() };
        let apart = (1.0 + MARGIN + 0.05) * reach;
        for share in [0.45, 0.52, 0.6, 0.9] {
            let mut list = Neighbours::default();
            let pushed = pushes(&mut list, &[strand(0.0), strand(apart)], radius);
            assert!(pushed.iter().all(|push| *push == Vec3::ZERO));
            let way = share * MARGIN * reach;
            let moved = [strand(way), strand(apart - way)];
            let expected = brute(&moved, 0, moved[0][1], radius);
            let found = pushes(&mut list, &moved, radius)[1];
            assert!(found.distance(expected) < 1e-3, "{share}: {found}, not {expected}");
            assert_eq!(expected == Vec3::ZERO, apart - 2.0 * way >= reach, "{share}");
        }
    }

    #[test]
    fn a_fine_strand_is_pushed_like_a_coarse_one_and_costs_little_more() {
        let strand = |nodes: usize, z: f32| -> Vec<Vec3> {
            (0..nodes).map(|i| Vec3::new(0.15 * i as f32 / (nodes - 1) as f32, 0.0, z)).collect()
        };
        let (mut coarse, mut fine) = (Neighbours::default(), Neighbours::default());
        for k in 0..8 {
            coarse.add(&strand(151, 7e-4 * k as f32), 1);
            fine.add(&strand(1501, 7e-4 * k as f32), 10);
        }
        let [expected, found] = [&mut coarse, &mut fine].map(|list| {
            list.find_pushes(printed(1e-3), Lookup::Now);
            list.pushes().collect::<Vec<Vec3>>()
        });
        assert_eq!((fine.nodes(), found.len()), (8 * 1501, 8 * 1501));
        for (k, push) in expected.iter().enumerate() {
            let (s, i) = (k / 151, k % 151);
            assert!(push.distance(found[1501 * s + 10 * i]) < 0.1, "strand {s} node {i}");
        }
        assert!(fine.pairs() <= coarse.pairs() + 8, "{} {}", fine.pairs(), coarse.pairs());
    }
}
