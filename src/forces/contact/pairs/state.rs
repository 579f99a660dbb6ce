//! Pairs, lists of them, and what a substep makes of both.

use super::{
    geometry::{Edge, Seen, see},
    kick::{Contact, Moving, Past, acts, kick},
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

/// Cost per node (ns): its share of all impulses.
const GATHER: usize = 20;

/// Three numbers of a node or of a pair, and one more.
pub(super) type Row = [f32; 4];

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
    /// The nodes of each strand.
    pub(super) strands: Vec<Range<u32>>,
    /// Which nodes of fine strands are sampled.
    pub(super) coarse: Coarse,
    /// Whether they have been evaluated in this substep.
    pub(super) is_found: bool,
    pub(super) lists: Lists,
    pub(super) parts: Vec<PartPairs>,
    /// For each edge, where the pairs of which it is the second begin among `by_second`, and these pairs by part and
    /// number.
    pub(super) second_starts: Vec<u32>,
    pub(super) by_second: Vec<[u32; 2]>,
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
    /// The second edge of each.
    pub(super) seconds: Vec<u32>,
    /// How far each has slid since it stuck (m), and the impulse that has pressed it; with a minus while its cores
    /// overlap from the start, which are not kept apart until they have once been apart.
    pub(super) pasts: Vec<Row>,
    /// The impulse of each on its first edge, and where both are touched.
    pub(super) impulses: Vec<Impulse>,
    /// Those that act in this substep, in their order.
    pub(super) active: Vec<Active>,
    /// How far apart each was at the start of the substep (m).
    pub(super) distances: Vec<f32>,
    /// The square of how far a node has moved since lists were built (m²).
    pub(super) moved: f32,
    /// The square of how fast its fastest node moves against the mean of all (m²/s²).
    pub(super) fastest: f32,
    /// Whether an edge had more pairs than it may have.
    pub(super) is_crowded: bool,
    /// Scratch space of a search.
    pub(super) before: (Vec<u32>, Vec<u32>, Vec<Row>),
}

/// What a pair does: an impulse on its first edge, the reverse on its second.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Impulse {
    pub(super) push: Vec3,
    /// Where on the edges (0…1).
    pub(super) at: [f32; 2],
}

/// A pair that acts.
#[derive(Clone, Copy, Debug)]
pub(super) struct Active {
    /// Its number in its part, and its edges.
    pub(super) number: u32,
    pub(super) edges: [u32; 2],
    /// How much of one it is for others at its nodes (0…1).
    pub(super) share: f32,
    pub(super) seen: Seen<f32>,
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
    pub(super) margin: f32,
    /// The most pairs that an edge may have, the nearest.
    pub(super) most: usize,
}

/// A pair of edges that may come too near.
#[derive(Clone, Copy, Debug)]
pub(super) struct Close {
    /// The part of its first edge, and its number there.
    pub(super) part: usize,
    pub(super) number: usize,
    pub(super) edges: [u32; 2],
    pub(super) normal: Vec3,
    /// The gap along `normal` that has to be left (m).
    pub(super) least: f32,
}

/// Scratch space.
#[derive(Clone, Debug, Default)]
pub(super) struct Scratch {
    /// How far each node has moved (m).
    pub(super) moved: Vec<f32>,
    pub(super) close: Vec<Close>,
    /// Nodes that are too near, by how much (m), and of which pair.
    pub(super) violated: Vec<([usize; 2], f32, usize)>,
    /// How often each node is among them.
    pub(super) counts: Vec<f32>,
    /// Whether each strand has been moved.
    pub(super) touched: Vec<bool>,
}

pub(super) fn place(row: &Row) -> Vec3 {
    Vec3::new(row[0], row[1], row[2])
}

/// The mean place of those that are finite.
pub(super) fn mean(rows: &[Row]) -> Vec3 {
    let finite = rows.iter().map(place).filter(|p| p.is_finite());
    let (sum, count) = finite.fold((Vec3::ZERO, 0.0), |(sum, n), p| (sum + p, n + 1.0));
    sum / f32::max(count, 1.0)
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
        self.look_up(&contact);
        let level = simd_level();
        let Self { places, velocities, parts, .. } = self;
        let pairs: usize = parts.iter().map(|part| part.seconds.len()).sum();
        let each = |nanos: usize, count: usize| Nanos(nanos * count / parts.len().max(1));
        let (see_each, kick_each) = (each(SEE, pairs), each(KICK, pairs));
        let gather_each = each(GATHER, nodes);
        for_each_block(
            parts,
            see_each,
            || (),
            |(), part| {
                dispatch!(level, simd => part.see(simd, places, velocities, &contact));
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
        let Self { places, strands, parts, second_starts, by_second, kicks, .. } = self;
        kicks.resize(nodes, Vec3::ZERO);
        let mut rest = &mut kicks[..];
        let mut work = Vec::new();
        for (k, strands) in strands.chunks(PART).enumerate() {
            let first = strands.first().map_or(0, |s| s.start);
            let end = strands.last().map_or(first, |s| s.end);
            let (own, after) = rest.split_at_mut((end - first) as usize);
            rest = after;
            work.push((k, strands, own));
        }
        let parts = &parts[..];
        for_each_block(
            &mut work,
            gather_each,
            || (),
            |(), (k, strands, kicks)| {
                parts[*k].gather(parts, strands, (second_starts, by_second), places, kicks);
            },
        );
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
        self.active.clear();
        self.distances.clear();
        let lanes = contact.splat(f32x8::splat(simd, 0.0));
        let edges = (self.first..).zip(self.starts.windows(2));
        let mut firsts = edges.flat_map(|(edge, w)| (w[0]..w[1]).map(move |_| edge));
        for (k, seconds) in self.seconds.chunks(WIDTH).enumerate() {
            let (mut a, mut b) = ([nowhere; WIDTH], [nowhere; WIDTH]);
            b[..seconds.len()].copy_from_slice(seconds);
            a[..seconds.len()].iter_mut().zip(&mut firsts).for_each(|(a, first)| *a = first);
            let ((edge_a, _), (edge_b, _)) = (edge(simd, places, &a), edge(simd, places, &b));
            let seen = see(edge_a, edge_b, lanes.reach);
            let ((va, _), (vb, _)) = (edge(simd, velocities, &a), edge(simd, velocities, &b));
            self.distances.extend_from_slice(&stored(seen.distance)[..seconds.len()]);
            let mut firm = [0.0; WIDTH];
            let pasts = &mut self.pasts[k * WIDTH..][..seconds.len()];
            let apart = stored(seen.distance).map(|distance| distance >= contact.core);
            for ((past, apart), firm) in pasts.iter_mut().zip(apart).zip(&mut firm) {
                if apart {
                    past[3] = past[3].abs();
                }
                *firm = is_firm(past, contact);
            }
            let firm = f32x8::load_array_ref(simd, &firm);
            let acts = acts(&seen, [va.start, va.end, vb.start, vb.end], firm, &lanes);
            let mut bits = Real::lt(f32x8::splat(simd, 0.0), acts).to_bitmask();
            if bits == 0 {
                continue;
            }
            let columns = columns(&seen).map(stored);
            let shares = stored(acts);
            while bits != 0 {
                let l = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                self.active.push(Active {
                    number: (k * WIDTH + l) as u32,
                    edges: [a[l], b[l]],
                    share: shares[l],
                    seen: of_columns(columns.map(|lanes| lanes[l])),
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
        self.impulses.clear();
        self.impulses.resize(self.seconds.len(), Impulse::default());
        // What does not act any more has no past.
        let mut pasts = core::mem::take(&mut self.before.2);
        pasts.clear();
        pasts.resize(self.seconds.len(), [0.0; 4]);
        let nowhere = places.len() as u32 - 2;
        for some in self.active.chunks(WIDTH) {
            let (mut a, mut b) = ([nowhere; WIDTH], [nowhere; WIDTH]);
            let mut seen = [[0.0; WIDTH]; COLUMNS];
            let mut past = [[0.0; WIDTH]; 5];
            for (l, active) in some.iter().enumerate() {
                [a[l], b[l]] = active.edges;
                let all = columns(&active.seen);
                seen.iter_mut().zip(all).for_each(|(lanes, value)| lanes[l] = value);
                let own = &self.pasts[active.number as usize];
                (0..3).for_each(|k| past[k][l] = own[k]);
                (past[3][l], past[4][l]) = (own[3].abs(), is_firm(own, contact));
            }
            let seen = of_columns(seen.map(|all| f32x8::load_array_ref(simd, &all)));
            let [x, y, z, bearing, firm] = past.map(|all| f32x8::load_array_ref(simd, &all));
            let mut past = Past { slip: V3::new(x, y, z), bearing, firm };
            let (va, ca) = edge(simd, velocities, &a);
            let (vb, cb) = edge(simd, velocities, &b);
            let ((_, wa), (_, wb)) = (edge(simd, places, &a), edge(simd, places, &b));
            let moving = Moving {
                velocities: [va.start, va.end, vb.start, vb.end],
                w: [wa[0], wa[1], wb[0], wb[1]],
                counts: [ca[0], ca[1], cb[0], cb[1]].map(|count| Real::max(count, one)),
            };
            let push = kick(&seen, &moving, &mut past, &lanes);
            let [x, y, z] = [push.x, push.y, push.z].map(stored);
            let Past { slip, bearing, .. } = past;
            let past = [slip.x, slip.y, slip.z, bearing].map(stored);
            for (l, active) in some.iter().enumerate() {
                let number = active.number as usize;
                let push = Vec3::new(x[l], y[l], z[l]);
                // What is not finite stays with its strand.
                if push.is_finite() {
                    self.impulses[number] = Impulse { push, at: active.seen.at };
                    pasts[number] = past.map(|lanes| lanes[l]);
                }
            }
        }
        for (past, _) in pasts.iter_mut().zip(&self.pasts).filter(|(_, old)| overlaps(old)) {
            past[3] = -past[3];
        }
        self.before.2 = core::mem::replace(&mut self.pasts, pasts);
    }

    /// What all pairs do to these strands' nodes.
    fn gather(
        &self,
        parts: &[Self],
        strands: &[Range<u32>],
        (second_starts, by_second): (&[u32], &[[u32; 2]]),
        places: &[Row],
        kicks: &mut [Vec3],
    ) {
        let first = strands.first().map_or(0, |s| s.start);
        kicks.fill(Vec3::ZERO);
        for strand in strands {
            for edge in strand.start..strand.end.saturating_sub(1) {
                let (mut sum, mut turn) = (Vec3::ZERO, Vec3::ZERO);
                let own = (edge - first) as usize;
                for pair in self.starts[own]..self.starts[own + 1] {
                    let Impulse { push, at } = self.impulses[pair as usize];
                    sum += push;
                    turn += push * at[0];
                }
                let seconds = second_starts[edge as usize]..second_starts[edge as usize + 1];
                for [part, pair] in &by_second[seconds.start as usize..seconds.end as usize] {
                    let Impulse { push, at } = parts[*part as usize].impulses[*pair as usize];
                    sum -= push;
                    turn -= push * at[1];
                }
                kicks[own] += sum - turn;
                kicks[own + 1] += turn;
            }
        }
        for (kick, place) in kicks.iter_mut().zip(&places[first as usize..]) {
            *kick *= place[3];
        }
    }
}
