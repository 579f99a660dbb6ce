//! Equation 18 for eight edges side by side, against one node.
//!
//! The same as [`model`](super::model), which the tests compare it with. Branches (does the foot belong
//! to this edge, does it touch) are unpredictable in dense hair, and mispredictions cost more than the
//! arithmetic, so lanes are masked instead. Collecting eight edges costs little, because an edge is two
//! neighbouring [`NodeRow`]s, each one load.

use super::model::{BREAKS_AT, Bridged, Film, SAME_PLACE, THIN, penalty};
use crate::base::lanes::{Real, V3};
use core::ops::Range;
use fearless_simd::{Simd, f32x4, f32x8, f32x16, mask32x8, prelude::*, u32x8, u32x16};
use glam::Vec3;

/// How many edges are tested side by side.
pub(super) const WIDTH: usize = 8;

/// Edges that are bridged within a tick are no farther at its start than this many of the longest bridges: strands
/// that water joins move together.
const SOON: f32 = 1.5;

/// A node with the kind of the edge that starts at it: x, y, z (m), and [`INNER`] or [`LAST`], negative for
/// the strand's first edge, or 0 for the tip, which starts none.
pub(super) type NodeRow = [f32; 4];

/// An edge that is followed by another.
const INNER: f32 = 1.0;

/// The edge at the tip.
const LAST: f32 = 2.0;

/// A node's input to bridges of water: its velocity (m/s), and the cross-section of the film on it (m²).
pub type WetRow = [f32; 4];

/// The nodes of one strand as rows.
pub(super) fn rows(nodes: &[Vec3]) -> impl Iterator<Item = NodeRow> {
    nodes.iter().enumerate().map(|(i, p)| {
        let kind = match nodes.len() - i {
            1 => 0.0,
            2 => LAST,
            _ => INNER,
        };
        [p.x, p.y, p.z, if i == 0 { -kind } else { kind }]
    })
}

/// The node of a row.
#[inline(always)]
pub(super) fn place(row: &NodeRow) -> Vec3 {
    Vec3::new(row[0], row[1], row[2])
}

/// A list to which masked lanes are appended without branches.
#[derive(Clone, Debug, Default)]
pub(super) struct Stack {
    items: Vec<u32>,
    len: usize,
}

impl Stack {
    /// Empties it and reserves `most` numbers. A call that may reallocate in the loop would spill the
    /// lanes' registers each time.
    pub fn clear(&mut self, most: usize) {
        self.len = 0;
        if self.items.len() < most + 16 {
            self.items.resize(2 * most + 16, 0);
        }
    }

    pub fn items(&self) -> &[u32] {
        &self.items[..self.len]
    }

    /// The items in eights, filled up with `filler`.
    pub fn eights(&mut self, filler: u32) -> &[[u32; 8]] {
        let end = self.len.next_multiple_of(8);
        self.items[self.len..end].fill(filler);
        self.items[..end].as_chunks().0
    }

    /// Appends the lanes for which the mask holds.
    #[inline(always)]
    pub fn push<S: Simd, L: SimdInt<S, Element = u32>>(&mut self, lanes: L, mask: L::Mask) {
        lanes.compress(mask).store_slice(&mut self.items[self.len..self.len + L::LEN]);
        self.len += mask.to_bitmask().count_ones() as usize;
    }
}

/// Sixteen pieces of edges, by their middles.
#[derive(Clone, Copy, Debug)]
#[repr(align(64))]
pub(super) struct Pieces {
    middles: [[f32; 16]; 3],
    edges: [u32; 16],
}

impl Pieces {
    const NOWHERE: Self = Self { middles: [[f32::NAN; 16]; 3], edges: [0; 16] };

    /// Writes `pieces`, each a middle and an edge, to `all`, in their order.
    pub fn collect(pieces: impl Iterator<Item = (Vec3, u32)>, all: &mut Vec<Self>) {
        all.clear();
        for (k, (middle, edge)) in pieces.enumerate() {
            if k % 16 == 0 {
                all.push(Self::NOWHERE);
            }
            let Some(last) = all.last_mut() else { return };
            last.edges[k % 16] = edge;
            for axis in 0..3 {
                last.middles[axis][k % 16] = middle[axis];
            }
        }
    }

    /// Appends to `edges` those whose piece's middle is within √`limit` of `p`.
    #[inline(always)]
    pub fn close<S: Simd>(&self, simd: S, p: Vec3, limit: f32, edges: &mut Stack) {
        let mut squared = f32x16::splat(simd, 0.0);
        for axis in 0..3 {
            let off = f32x16::load_array_ref(simd, &self.middles[axis]) - p[axis];
            squared = Real::mul_add(off, off, squared);
        }
        let close = Real::lt(squared, f32x16::splat(simd, limit));
        edges.push(u32x16::load_array_ref(simd, &self.edges), close);
    }
}

/// A strength of equation 18 with its reach 2r, whether edges that push are pushed back, and for how long the
/// pushes act (s).
#[derive(Clone, Copy, Debug)]
pub(super) struct Penalty {
    pub reach: f32,
    pub strength: f32,
    pub mutual: bool,
    pub dt: f32,
}

/// A node that an edge pushes and that pushes it back.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    pub node: u32,
    /// The edge's start node.
    pub edge: u32,
    /// Where the edge is touched (0…1).
    pub at: f32,
    /// The edge's part: less than 1 where the next edge shares in it.
    pub part: f32,
    /// The acceleration of the node (m/s²).
    pub push: Vec3,
}

/// The offset from the nearest point of each edge to one node, the parameter along the edge (0…1, and
/// as it is without an end), the edge's squared length and kind.
struct Off<S: Simd> {
    off: V3<f32x8<S>>,
    squared: f32x8<S>,
    at: f32x8<S>,
    share: f32x8<S>,
    length_squared: f32x8<S>,
    kind: f32x8<S>,
}

impl<S: Simd> Off<S> {
    /// Which edges the foot belongs to: one on a shared node belongs to the second edge.
    #[inline(always)]
    fn own(&self, simd: S) -> mask32x8<S> {
        let lit = |value: f32| f32x8::splat(simd, value);
        let kind = Real::max(self.kind, -self.kind);
        let is_last = Real::lt(lit(INNER), kind);
        is_last | (Real::lt(self.share, lit(1.0)) & Real::lt(lit(0.0), kind))
    }

    /// The part of each edge in what acts on the node: around a shared node both edges share it, so that nothing
    /// changes at once while the foot goes over from one to the other.
    #[inline(always)]
    fn parts(&self, simd: S, reach: f32) -> f32x8<S> {
        let lit = |value: f32| f32x8::splat(simd, value);
        let (zero, one) = (lit(0.0), lit(1.0));
        let per_reach = Real::sqrt(self.length_squared) * lit(0.5 / reach);
        let part = |inside: f32x8<S>| {
            let part = lit(0.5) + inside * per_reach;
            Real::min(Real::max(part, zero), one)
        };
        let rise = Real::select(Real::lt(self.kind, zero), one, part(self.share));
        let kind = Real::max(self.kind, -self.kind);
        let fall = Real::select(Real::lt(lit(INNER), kind), one, part(one - self.share));
        Real::select(Real::lt(zero, kind), rise * fall, zero)
    }
}

/// Four rows, by column.
#[inline(always)]
fn four<S: Simd>(simd: S, rows: [NodeRow; 4]) -> [f32x4<S>; 4] {
    let mut flat = [0.0; 16];
    flat.copy_from_slice(rows.as_flattened());
    simd.load_four_interleaved_f32x4(&flat)
}

/// The start nodes of eight edges (with `after` = 1 their end nodes), and the last column of these
/// rows.
#[inline(always)]
pub(super) fn eight<S: Simd>(
    simd: S,
    rows: &[NodeRow],
    edges: &[u32; WIDTH],
    after: usize,
) -> (V3<f32x8<S>>, f32x8<S>) {
    let row = |k: usize| rows[edges[k] as usize + after];
    let a = four(simd, [row(0), row(1), row(2), row(3)]);
    let b = four(simd, [row(4), row(5), row(6), row(7)]);
    let p = V3::new(
        simd.combine_f32x4(a[0], b[0]),
        simd.combine_f32x4(a[1], b[1]),
        simd.combine_f32x4(a[2], b[2]),
    );
    (p, simd.combine_f32x4(a[3], b[3]))
}

#[inline(always)]
fn off<S: Simd>(simd: S, rows: &[NodeRow], edges: &[u32; WIDTH], p: V3<f32x8<S>>) -> Off<S> {
    let (zero, one) = (f32x8::splat(simd, 0.0), f32x8::splat(simd, 1.0));
    let (start, kind) = eight(simd, rows, edges, 0);
    let (end, _) = eight(simd, rows, edges, 1);
    let along = end - start;
    let from_start = p - start;
    let length_squared = Real::max(along.dot(along), f32x8::splat(simd, 1e-20));
    let share = from_start.dot(along) / length_squared;
    let clamped = Real::min(Real::max(share, zero), one);
    let off = from_start - along.scale(clamped);
    Off { off, squared: off.dot(off), at: clamped, share, length_squared, kind }
}

#[inline(always)]
fn splat<S: Simd>(simd: S, p: Vec3) -> V3<f32x8<S>> {
    V3::new(f32x8::splat(simd, p.x), f32x8::splat(simd, p.y), f32x8::splat(simd, p.z))
}

/// Appends those of eight edges that are within √`limit` of `p` and not of its `own` strand, and
/// their squared distances as bits, which are in the order of the distances.
#[inline(always)]
pub(super) fn near<S: Simd>(
    simd: S,
    rows: &[NodeRow],
    eight: &[u32; WIDTH],
    (p, own): (Vec3, &Range<u32>),
    limit: f32,
    edges: &mut Stack,
    distances: &mut Stack,
) {
    let squared = off(simd, rows, eight, splat(simd, p)).squared;
    let numbers = u32x8::load_array_ref(simd, eight);
    let others = numbers.simd_lt(own.start) | numbers.simd_ge(own.end);
    let near = Real::lt(squared, f32x8::splat(simd, limit)) & others;
    edges.push(numbers, near);
    distances.push(squared.bitcast::<u32x8<S>>(), near);
}

/// Equation 18 of groups of eight edges on a node, lane by lane: see [`total`](Self::total).
pub(super) struct PenaltySum<S: Simd> {
    node: u32,
    p: V3<f32x8<S>>,
    sum: V3<f32x8<S>>,
    penalty: Penalty,
}

impl<S: Simd> PenaltySum<S> {
    /// A zero sum for a node.
    #[inline(always)]
    pub fn new(simd: S, rows: &[NodeRow], node: usize, penalty: Penalty) -> Self {
        let p = splat(simd, place(&rows[node]));
        Self { node: node as u32, p, sum: splat(simd, Vec3::ZERO), penalty }
    }

    /// Adds the contributions of eight edges. NaN fails every comparison and adds nothing. Where contact is
    /// mutual, they are appended to `touches` instead.
    #[inline(always)]
    pub fn add(
        &mut self,
        simd: S,
        rows: &[NodeRow],
        edges: &[u32; WIDTH],
        touches: &mut Vec<Touch>,
    ) {
        let seen = off(simd, rows, edges, self.p);
        let Off { off, squared, at, .. } = seen;
        let reach = f32x8::splat(simd, self.penalty.reach);
        let touching =
            Real::lt(squared, reach * reach) & Real::lt(f32x8::splat(simd, SAME_PLACE), squared);
        let distance = Real::sqrt(squared);
        let strength = f32x8::splat(simd, self.penalty.strength);
        let push = penalty(distance, reach, strength);
        if !self.penalty.mutual {
            let pushed = off.scale_add(push, self.sum);
            self.sum = V3::select(touching & seen.own(simd), pushed, self.sum);
            return;
        }
        let mut lanes = touching.to_bitmask();
        if lanes == 0 {
            return;
        }
        let parts = seen.parts(simd, self.penalty.reach);
        let push = off.scale(push * parts);
        let mut seen = [[0.0; WIDTH]; 5];
        for (seen, lanes) in seen.iter_mut().zip([push.x, push.y, push.z, at, parts]) {
            lanes.store_array(seen);
        }
        while lanes != 0 {
            let k = lanes.trailing_zeros() as usize;
            lanes &= lanes - 1;
            let [x, y, z, at, part] = seen.map(|lanes| lanes[k]);
            if part > 0.0 {
                let push = Vec3::new(x, y, z);
                touches.push(Touch { node: self.node, edge: edges[k], at, part, push });
            }
        }
    }

    /// The sum over all lanes (m/s²).
    #[inline(always)]
    pub fn total(self) -> Vec3 {
        Vec3::new(self.sum.x.reduce_sum(), self.sum.y.reduce_sum(), self.sum.z.reduce_sum())
    }
}

/// Bridges of water from groups of eight edges to one node, lane by lane.
///
/// Between two fibres the pull of a capillary bridge hardly depends on its volume, but its reach does: it breaks at
/// (1 + θ/2) √A (Fei et al. 2017). Taken to fall linearly to there, and to fade where strands are pressed together,
/// since the film gains no surface there.
pub(super) struct Bridges<S: Simd> {
    p: V3<f32x8<S>>,
    area: f32x8<S>,
    film: Film,
    pull: V3<f32x8<S>>,
    steepness: f32x8<S>,
    drift: V3<f32x8<S>>,
    strength: f32x8<S>,
}

impl<S: Simd> Bridges<S> {
    /// A zero sum for a node at `p` with a film of `area` (m²).
    #[inline(always)]
    pub fn new(simd: S, p: Vec3, area: f32, film: Film) -> Self {
        let zero = f32x8::splat(simd, 0.0);
        Self {
            p: splat(simd, p),
            area: f32x8::splat(simd, area),
            film,
            pull: splat(simd, Vec3::ZERO),
            steepness: zero,
            drift: splat(simd, Vec3::ZERO),
            strength: zero,
        }
    }

    /// Adds the bridges to eight edges. NaN fails every comparison and adds nothing. Those that may be bridged
    /// within the tick are appended to `soon`.
    #[inline(always)]
    pub fn find(
        &mut self,
        simd: S,
        rows: &[NodeRow],
        wet: &[WetRow],
        edges: &[u32; WIDTH],
        soon: &mut Stack,
    ) {
        let seen = off(simd, rows, edges, self.p);
        let Film { reach, longest } = self.film;
        let within = reach + SOON * longest;
        let near = Real::lt(seen.squared, f32x8::splat(simd, within * within));
        if near.to_bitmask() == 0 {
            return;
        }
        let (start, start_area) = eight(simd, wet, edges, 0);
        let (end, end_area) = eight(simd, wet, edges, 1);
        let film = self.area + start_area + end_area;
        let near = near & Real::lt(f32x8::splat(simd, 0.0), film);
        soon.push(u32x8::load_array_ref(simd, edges), near);
        self.join(simd, seen, (start, start_area), (end, end_area));
    }

    /// The same for edges that were found at the start of the tick.
    #[inline(always)]
    pub fn add(&mut self, simd: S, rows: &[NodeRow], wet: &[WetRow], edges: &[u32; WIDTH]) {
        let seen = off(simd, rows, edges, self.p);
        self.join(simd, seen, eight(simd, wet, edges, 0), eight(simd, wet, edges, 1));
    }

    /// Adds the bridges to eight edges with films of these cross-sections, whose ends move so.
    #[inline(always)]
    fn join(
        &mut self,
        simd: S,
        seen: Off<S>,
        (start, start_area): (V3<f32x8<S>>, f32x8<S>),
        (end, end_area): (V3<f32x8<S>>, f32x8<S>),
    ) {
        let lit = |value: f32| f32x8::splat(simd, value);
        let (zero, one) = (lit(0.0), lit(1.0));
        let Film { reach, longest } = self.film;
        let Off { off, squared, at, .. } = seen;
        let near = seen.own(simd)
            & Real::lt(squared, lit((reach + longest) * (reach + longest)))
            & Real::lt(lit(SAME_PLACE), squared);
        let area = self.area + start_area + (end_area - start_area) * at;
        let velocity = start + (end - start).scale(at);

        let distance = Real::sqrt(squared);
        let longest = Real::min(Real::sqrt(area) * lit(BREAKS_AT), lit(longest));
        let amount = Real::min(area * lit(1.0 / (THIN * reach * reach)), one);
        let apart = Real::max(lit(reach), distance) - lit(reach);
        let left = Real::max(one - apart / Real::max(longest, lit(1e-9)), zero) * amount;
        let pressed = Real::min(distance * lit(1.0 / reach), one);
        let joined = near & Real::lt(zero, left);

        let pull = left * pressed * pressed;
        let pulled = off.scale_add(-(pull / distance), self.pull);
        self.pull = V3::select(joined, pulled, self.pull);
        let steep = amount / Real::min(Real::max(longest, lit(1e-9)), lit(0.5 * reach));
        self.steepness += Real::select(joined, steep, zero);
        self.drift = V3::select(joined, velocity.scale_add(left, self.drift), self.drift);
        self.strength += Real::select(joined, left, zero);
    }

    /// The sums over all lanes.
    #[inline(always)]
    pub fn total(self) -> Bridged {
        let sum = |v: V3<f32x8<S>>| Vec3::new(v.x.reduce_sum(), v.y.reduce_sum(), v.z.reduce_sum());
        Bridged {
            pull: sum(self.pull),
            steepness: self.steepness.reduce_sum(),
            drift: sum(self.drift),
            strength: self.strength.reduce_sum(),
        }
    }
}
