//! Pairs, lists of them, and what a substep makes of both.

use super::{
    geometry::{Edge, Row, Seen, place, see},
    kick::{Contact, Moving, Past, acts, kick},
    regions::Regions,
};
use crate::{
    base::{
        grid::UniformGrid,
        lanes::{Real, V3, dispatch, simd_level},
        parallel::{Nanos, for_each_block},
    },
    forces::contact::{
        coarse::Coarse,
        lanes::{Pieces, WIDTH, eight},
    },
};
use core::ops::Range;
use fearless_simd::{Simd, f32x8, prelude::*};
use glam::Vec3;

/// Strands per work chunk.
pub(super) const PART: usize = 16;

/// Cost per pair (ns): whether it acts, and its impulse.
const SEE: usize = 12;
const KICK: usize = 20;

/// The share of the cores' distance at which cores that overlapped from the start are firm from then on.
pub(super) const FIRM_AGAIN: f32 = 1.25;

/// A node of a strand.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct PairNode {
    /// Where it is (m).
    pub(super) place: Vec3,
    /// Its velocity, without what the forces of this substep add to it (m/s).
    pub(super) velocity: Vec3,
    /// Its mass, as metres of a dry strand; 0 where it is held.
    pub(super) mass: f32,
}

/// The strands of one hair, the pairs of edges near each other, and what they do to nodes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Pairs {
    /// The nodes' places and inverse masses, velocities and the counts of pairs that push them.
    pub(super) places: Vec<Row>,
    pub(super) velocities: Vec<Row>,
    /// How each edge has moved since lists were built, and will have at the end of a substep.
    pub(super) moved: [Vec<Row>; 2],
    /// The nodes of each strand.
    pub(super) strands: Vec<Range<u32>>,
    /// Which nodes of fine strands are sampled.
    pub(super) coarse: Coarse,
    /// Whether they have been evaluated in this substep.
    pub(super) is_found: bool,
    pub(super) lists: Lists,
    pub(super) parts: Vec<PartPairs>,
    /// What all pairs do to each node (m/s).
    pub(super) kicks: Vec<Vec3>,
    pub(super) scratch: Scratch,
}

/// The pairs whose first edge is of some strands.
#[derive(Clone, Debug, Default)]
pub(super) struct PartPairs {
    /// The first edge.
    pub(super) first: u32,
    /// For each edge, where its pairs begin, and where the last one's end.
    pub(super) starts: Vec<u32>,
    /// The second edge of each, and how far apart both were when lists were built (m).
    pub(super) seconds: Vec<u32>,
    pub(super) built: Vec<f32>,
    /// What some remember, by their numbers.
    pub(super) kept: Vec<Kept>,
    /// Those that act in this substep, by their numbers.
    pub(super) active: Vec<Active>,
    /// Those that may be near, by how their edges have moved.
    pub(super) near: Vec<Near>,
    /// Whether an edge had more pairs than it may have.
    pub(super) is_crowded: bool,
    /// Scratch space of a search.
    pub(super) before: (Vec<u32>, Vec<u32>, Vec<Kept>),
}

/// What a pair remembers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Kept {
    pub(super) number: u32,
    /// How far it has slid since it stuck (m), and the impulse that has pressed it; with a minus while its cores overlap
    /// from the start, which are not kept apart until they have once been apart.
    pub(super) past: Row,
}

/// What pairs remember, asked for in the order of their numbers.
pub(super) struct Memory<'a>(pub(super) &'a [Kept]);

impl Memory<'_> {
    pub(super) fn of(&mut self, number: u32) -> Option<Row> {
        let passed = self.0.iter().take_while(|kept| kept.number < number).count();
        self.0 = &self.0[passed..];
        self.0.first().filter(|kept| kept.number == number).map(|kept| kept.past)
    }
}

/// A pair that may be near: its number in its part, and its edges.
#[derive(Clone, Copy, Debug)]
pub(super) struct Near {
    pub(super) number: u32,
    pub(super) edges: [u32; 2],
}

/// A pair that acts, or one whose cores overlap from the start.
#[derive(Clone, Copy, Debug)]
pub(super) struct Active {
    /// Its number in its part, and its edges.
    pub(super) number: u32,
    pub(super) edges: [u32; 2],
    /// How much of one it is for others at its nodes (0…1); 0 does not act.
    pub(super) share: f32,
    pub(super) seen: Seen<f32>,
    pub(super) past: Row,
    /// The impulse on its first edge; its second has the reverse.
    pub(super) push: Vec3,
}

/// The state that lists were built from.
#[derive(Clone, Debug, Default)]
pub(super) struct Lists {
    pub(super) grid: UniformGrid,
    pub(super) pieces: Vec<Pieces>,
    pub(super) unsorted: Vec<(Vec3, u32)>,
    pub(super) places: Vec<Row>,
    pub(super) strands: Vec<Range<u32>>,
    pub(super) reach: f32,
    pub(super) core: f32,
    /// Cells, by how much motions may differ in each before lists are built again, and do (m).
    pub(super) regions: Regions,
    pub(super) margins: Vec<f32>,
    pub(super) differences: Vec<[f32; 2]>,
    /// Half the length of the pieces in which edges are put into the grid (m).
    pub(super) half_piece: f32,
    /// Half the side of the boxes that the grid is made for (m).
    pub(super) half_box: f32,
    /// The most pairs that an edge may have, the nearest.
    pub(super) most: usize,
}

/// A pair of edges that may come too near.
#[derive(Clone, Copy, Debug)]
pub(super) struct Close {
    /// The part of its first edge, and its number there.
    pub(super) part: usize,
    pub(super) number: u32,
    pub(super) edges: [u32; 2],
    pub(super) normal: Vec3,
    /// The gap along `normal` that has to be left (m).
    pub(super) least: f32,
    /// The impulse by which its cores have been kept apart.
    pub(super) borne: f32,
    /// Whether they could not be.
    pub(super) gives_way: bool,
}

/// Scratch space.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    pub(super) close: Vec<Close>,
    /// Nodes that are too near, by how much (m), and of which pair.
    pub(super) violated: Vec<([usize; 2], f32, usize)>,
    /// How often each node is among them.
    pub(super) counts: Vec<f32>,
    /// Whether each strand has been moved.
    pub(super) touched: Vec<bool>,
}

impl Pairs {
    /// Removes the nodes, not the lists.
    pub fn clear(&mut self) {
        self.places.clear();
        self.velocities.clear();
        self.strands.clear();
        self.coarse.clear();
    }

    /// Adds a strand with its nodes at these `places`, root first, of which every `stride`th is sampled.
    pub fn add(&mut self, places: &[Vec3], stride: usize, nodes: impl Iterator<Item = PairNode>) {
        let start = self.strands.last().map_or(0, |strand| strand.end);
        let sampled = self.coarse.add(places, stride).len();
        self.strands.push(start..start + sampled as u32);
        for PairNode { place, velocity, mass } in nodes {
            let w = if mass > 0.0 { 1.0 / mass } else { 0.0 };
            self.places.push(place.extend(w).to_array());
            self.velocities.push(velocity.extend(0.0).to_array());
        }
    }

    /// Which nodes of the strand with this number are sampled, of so many.
    pub fn sampled(&self, strand: usize, nodes: usize) -> impl Iterator<Item = usize> + use<> {
        let sampled = self.strands.get(strand).map_or(0, |own| own.len());
        (0..sampled).map(move |k| k * nodes.saturating_sub(1) / sampled.saturating_sub(1).max(1))
    }

    /// Evaluates all pairs, for [`kicks`](Self::kicks) to return. The order of summation does not depend on threads.
    pub fn find(&mut self, contact: Contact<f32>) {
        self.is_found = true;
        let nodes = self.strands.last().map_or(0, |strand| strand.end as usize);
        // Lanes without a pair have two edges that are not numbers.
        for rows in [&mut self.places, &mut self.velocities] {
            self.coarse.pick(rows);
            rows.truncate(nodes);
            rows.extend([[f32::NAN; 4]; 2]);
        }
        let Self { places, velocities, moved, strands, lists, parts, .. } = self;
        let ahead = |node: usize| contact.dt * place(&velocities[node]);
        lists.look_up(parts, places, strands, &contact, ahead);
        let way = |node: usize| place(&places[node]) - place(&lists.places[node]);
        measure(&mut moved[0], nodes, way);
        measure(&mut moved[1], nodes, |node| way(node) + ahead(node));
        let level = simd_level();
        let pairs: usize = parts.iter().map(|part| part.seconds.len()).sum();
        let each = |nanos: usize, count: usize| Nanos(nanos * count / parts.len().max(1));
        let (see_each, kick_each) = (each(SEE, pairs), each(KICK, pairs));
        for_each_block(
            parts,
            see_each,
            || (),
            |(), part| {
                dispatch!(level, simd => {
                    part.sift(simd, moved, [contact.reach, contact.core]);
                    part.see(simd, places, velocities, &contact);
                });
            },
        );
        for active in parts.iter().flat_map(|part| &part.active) {
            for node in nodes_of(active.edges) {
                velocities[node][3] += active.share;
            }
        }
        for_each_block(
            parts,
            kick_each,
            || (),
            |(), part| {
                dispatch!(level, simd => part.kick(simd, places, velocities, &contact));
            },
        );
        let Self { places, parts, kicks, .. } = self;
        kicks.clear();
        kicks.resize(nodes, Vec3::ZERO);
        for Active { edges, seen, push, .. } in parts.iter().flat_map(|part| &part.active) {
            let [a0, a1, b0, b1] = nodes_of(*edges);
            let [a, b] = seen.at.map(|at| *push * at);
            kicks[a0] += *push - a;
            kicks[a1] += a;
            kicks[b0] -= *push - b;
            kicks[b1] -= b;
        }
        kicks.iter_mut().zip(places).for_each(|(kick, place)| *kick *= place[3]);
    }

    /// Until [`find`](Self::find) there are no pairs.
    pub fn rest(&mut self) {
        self.is_found = false;
    }

    /// Whether they have been evaluated.
    pub fn is_found(&self) -> bool {
        self.is_found
    }

    /// What contact adds to the velocity of each node in a substep of `dt` (s), as an acceleration (m/s²), in the order
    /// they were added; to one that is held nothing.
    pub fn pushes(&self, dt: f32) -> impl Iterator<Item = Vec3> {
        self.coarse.spread(self.kicks.iter().map(move |kick| *kick / dt), Vec3::lerp)
    }

    /// Where pairs that act touch, on both edges (m).
    #[cfg(feature = "debug")]
    pub fn touching(&self) -> impl Iterator<Item = (Vec3, Vec3)> {
        let place = |node: u32| self.places.get(node as usize).map(place);
        let on = move |edge: u32, at: f32| Some(place(edge)?.lerp(place(edge + 1)?, at));
        self.parts.iter().flat_map(|part| &part.active).filter_map(move |active| {
            let ([a, b], [s, t]) = (active.edges, active.seen.at);
            Some((on(a, s)?, on(b, t)?))
        })
    }

    /// Whether an edge has more others near than it may have pairs: the farther ones are left out.
    pub fn is_crowded(&self) -> bool {
        self.parts.iter().any(|part| part.is_crowded)
    }

    /// How many pairs there are, and how many of them act.
    pub fn counts(&self) -> [usize; 2] {
        let sum = |of: fn(&PartPairs) -> usize| self.parts.iter().map(of).sum();
        [sum(|part| part.seconds.len()), sum(|part| part.active.len())]
    }
}

/// How the edges that start at so many nodes have moved: their middles, and how far their ends have moved against them
/// (m). Points of two edges have come nearer by no more than their middles and both of these together.
pub(super) fn measure(rows: &mut Vec<Row>, nodes: usize, way: impl Fn(usize) -> Vec3) {
    rows.clear();
    let mut before = Vec3::ZERO;
    for node in 0..nodes {
        let own = way(node);
        if node > 0 {
            rows.push((0.5 * (before + own)).extend(0.5 * before.distance(own)).to_array());
        }
        before = own;
    }
    // The last node starts no edge, nor do those that are not numbers.
    rows.resize(nodes + 2, [f32::NAN; 4]);
}

/// Whether a pair's cores overlap from the start, by what it remembers.
pub(super) fn overlaps(past: &Row) -> bool {
    past[3].is_sign_negative()
}

/// 1 where a pair's cores may not touch, else 0.
pub(super) fn is_firm(past: &Row, contact: &Contact<f32>) -> f32 {
    if contact.core > 0.0 && !overlaps(past) { 1.0 } else { 0.0 }
}

/// The start and end nodes of two edges.
pub(super) fn nodes_of([a, b]: [u32; 2]) -> [usize; 4] {
    [a, a + 1, b, b + 1].map(|node| node as usize)
}

/// The numbers of a [`Seen`].
const COLUMNS: usize = 8;

#[inline(always)]
fn columns<R: Real>(seen: &Seen<R>) -> [R; COLUMNS] {
    let Seen { normal: n, distance, at: [s, t], length, overlap } = *seen;
    [n.x, n.y, n.z, distance, s, t, length, overlap]
}

#[inline(always)]
fn of_columns<R: Real>([x, y, z, distance, s, t, length, overlap]: [R; COLUMNS]) -> Seen<R> {
    Seen { normal: V3::new(x, y, z), distance, at: [s, t], length, overlap }
}

#[inline(always)]
pub(super) fn stored<S: Simd>(lanes: f32x8<S>) -> [f32; WIDTH] {
    let mut all = [0.0; WIDTH];
    lanes.store_array(&mut all);
    all
}

#[inline(always)]
fn stored_columns<S: Simd, const N: usize>(columns: &[f32x8<S>; N]) -> [[f32; WIDTH]; N] {
    let mut all = [[0.0; WIDTH]; N];
    for k in 0..N {
        columns[k].store_array(&mut all[k]);
    }
    all
}

#[inline(always)]
fn loaded_columns<S: Simd, const N: usize>(simd: S, all: &[[f32; WIDTH]; N]) -> [f32x8<S>; N] {
    let mut columns = [f32x8::splat(simd, 0.0); N];
    for k in 0..N {
        columns[k] = f32x8::load_array_ref(simd, &all[k]);
    }
    columns
}

/// One lane of all columns.
#[inline(always)]
fn lane<const N: usize>(columns: &[[f32; WIDTH]; N], lane: usize) -> [f32; N] {
    let mut all = [0.0; N];
    for k in 0..N {
        all[k] = columns[k][lane];
    }
    all
}

#[inline(always)]
pub(super) fn edge<S: Simd>(
    simd: S,
    rows: &[Row],
    edges: &[u32; WIDTH],
) -> (Edge<f32x8<S>>, [f32x8<S>; 2]) {
    let (start, at_start) = eight(simd, rows, edges, 0);
    let (end, at_end) = eight(simd, rows, edges, 1);
    (Edge { start, end }, [at_start, at_end])
}

impl PartPairs {
    /// Finds the pairs that may have come within these distances (m), each by how edges have `moved`.
    #[inline(always)]
    pub(super) fn sift<S: Simd>(&mut self, simd: S, moved: &[Vec<Row>; 2], within: [f32; 2]) {
        let Self { first, starts, seconds, built, near, .. } = self;
        near.clear();
        for (a, w) in (*first..).zip(starts.windows(2)) {
            let own = w[0] as usize..w[1] as usize;
            for k in own.clone().step_by(WIDTH) {
                let end = own.end.min(k + WIDTH);
                let mut b = [a; WIDTH];
                b[..end - k].copy_from_slice(&seconds[k..end]);
                let mut apart = [f32::NAN; WIDTH];
                apart[..end - k].copy_from_slice(&built[k..end]);
                let apart = f32x8::load_array_ref(simd, &apart);
                let mut is_near = 0;
                for (rows, within) in moved.iter().zip(within) {
                    let [x, y, z, own] = rows[a as usize];
                    let (x, y) = (f32x8::splat(simd, x), f32x8::splat(simd, y));
                    let (z, own) = (f32x8::splat(simd, z), f32x8::splat(simd, own));
                    let (other, others) = eight(simd, rows, &b, 0);
                    let off = V3::new(x, y, z) - other;
                    let way = Real::sqrt(off.dot(off)) + own + others;
                    is_near |= Real::lt(apart - way, f32x8::splat(simd, within)).to_bitmask();
                }
                while is_near != 0 {
                    let l = is_near.trailing_zeros() as usize;
                    is_near &= is_near - 1;
                    near.push(Near { number: (k + l) as u32, edges: [a, b[l]] });
                }
            }
        }
    }

    /// Finds the pairs that act.
    #[inline(always)]
    fn see<S: Simd>(
        &mut self,
        simd: S,
        places: &[Row],
        velocities: &[Row],
        contact: &Contact<f32>,
    ) {
        let nowhere = places.len() as u32 - 2;
        let Self { near, kept, active, .. } = self;
        active.clear();
        let mut memory = Memory(kept);
        let lanes = contact.splat(f32x8::splat(simd, 0.0));
        for near in near.chunks(WIDTH) {
            let (mut a, mut b) = ([nowhere; WIDTH], [nowhere; WIDTH]);
            for (l, near) in near.iter().enumerate() {
                [a[l], b[l]] = near.edges;
            }
            let ((edge_a, _), (edge_b, _)) = (edge(simd, places, &a), edge(simd, places, &b));
            let seen = see(edge_a, edge_b, lanes.reach);
            let ((va, _), (vb, _)) = (edge(simd, velocities, &a), edge(simd, velocities, &b));
            let distances = stored(seen.distance);
            let (mut pasts, mut firm) = ([[0.0; 4]; WIDTH], [0.0; WIDTH]);
            let mut bits = 0;
            for (l, near) in near.iter().enumerate() {
                let past = &mut pasts[l];
                *past = memory.of(near.number).unwrap_or_default();
                if distances[l] >= FIRM_AGAIN * contact.core {
                    past[3] = past[3].abs();
                }
                firm[l] = is_firm(past, contact);
                bits |= u64::from(overlaps(past)) << l;
            }
            let firm = f32x8::load_array_ref(simd, &firm);
            let acts = acts(&seen, [va.start, va.end, vb.start, vb.end], firm, &lanes);
            bits |= Real::lt(f32x8::splat(simd, 0.0), acts).to_bitmask();
            if bits == 0 {
                continue;
            }
            let columns = stored_columns(&columns(&seen));
            let shares = stored(acts);
            while bits != 0 {
                let l = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                active.push(Active {
                    number: near[l].number,
                    edges: [a[l], b[l]],
                    share: shares[l],
                    seen: of_columns(lane(&columns, l)),
                    past: pasts[l],
                    push: Vec3::ZERO,
                });
            }
        }
    }

    /// The impulses of the pairs that act.
    #[inline(always)]
    fn kick<S: Simd>(
        &mut self,
        simd: S,
        places: &[Row],
        velocities: &[Row],
        contact: &Contact<f32>,
    ) {
        let one = f32x8::splat(simd, 1.0);
        let lanes = contact.splat(one);
        let nowhere = places.len() as u32 - 2;
        for some in self.active.chunks_mut(WIDTH) {
            let (mut a, mut b) = ([nowhere; WIDTH], [nowhere; WIDTH]);
            let mut seen = [[0.0; WIDTH]; COLUMNS];
            let mut past = [[0.0; WIDTH]; 5];
            for (l, active) in some.iter().enumerate() {
                [a[l], b[l]] = active.edges;
                let all = columns(&active.seen);
                (0..COLUMNS).for_each(|k| seen[k][l] = all[k]);
                let own = &active.past;
                (0..3).for_each(|k| past[k][l] = own[k]);
                (past[3][l], past[4][l]) = (own[3].abs(), is_firm(own, contact));
            }
            let seen = of_columns(loaded_columns(simd, &seen));
            let [x, y, z, bearing, firm] = loaded_columns(simd, &past);
            let mut past = Past { slip: V3::new(x, y, z), bearing, firm };
            let (va, ca) = edge(simd, velocities, &a);
            let (vb, cb) = edge(simd, velocities, &b);
            let ((_, wa), (_, wb)) = (edge(simd, places, &a), edge(simd, places, &b));
            let moving = Moving {
                velocities: [va.start, va.end, vb.start, vb.end],
                w: [wa[0], wa[1], wb[0], wb[1]],
                counts: [
                    Real::max(ca[0], one),
                    Real::max(ca[1], one),
                    Real::max(cb[0], one),
                    Real::max(cb[1], one),
                ],
            };
            let push = kick(&seen, &moving, &mut past, &lanes);
            let pushes = stored_columns(&[push.x, push.y, push.z]);
            let Past { slip, bearing, .. } = past;
            let past = stored_columns(&[slip.x, slip.y, slip.z, bearing]);
            for (l, active) in some.iter_mut().enumerate().filter(|(_, active)| active.share > 0.0)
            {
                let push = Vec3::from_array(lane(&pushes, l));
                let mut new = [0.0; 4];
                // What is not finite stays with its strand.
                if push.is_finite() {
                    (active.push, new) = (push, lane(&past, l));
                }
                if overlaps(&active.past) {
                    new[3] = -new[3];
                }
                active.past = new;
            }
        }
        // What does not act any more has no past.
        self.kept.clear();
        let kept = |active: &Active| Kept { number: active.number, past: active.past };
        self.kept.extend(self.active.iter().map(kept));
    }
}
