//! The length limiter: a direct solve of a whole strand's length constraints.
//!
//! Root-to-tip Gauss–Seidel carries length errors one edge an iteration, so long strands stretch.
//! One Newton step on all lengths at once is a tridiagonal system J W Jᵀ λ = C with
//! C_i = |p_{i+1} − p_i| − l_i, solved by the Thomas algorithm in one pass down and one up.
//! Only node masses enter: orientations of rods are not changed.
//!
//! A node that rests on an obstacle cannot move into it, so there W = w (I − a n nᵀ): lengths are
//! corrected along the surface instead of against it, which would end in compression. A node that
//! tension pulls off the surface is released.

use super::{
    block::{BlockLanes, NodeLanes},
    touch::TOUCHING,
    tridiagonal::{Elimination, back},
};
use crate::base::lanes::{LANES, Real, V3, dispatch, load, load3};
use fearless_simd::{Level, Simd, f32x16, prelude::*};

/// a: the share of a node's mobility that an obstacle removes along its normal. Below 1, so that a
/// strand pressed straight down need not fold within one substep.
pub(crate) const FIRMNESS: f32 = 0.95;

/// Stiffness with which an obstacle holds a resting node in the direct solve, and along the surface one that sticks, as
/// a multiple of the node's inertia: so much that nothing gives way, since nodes are not moved by what the solve has
/// them give, which is read as the support's force.
pub(crate) const HOLD: f64 = 1e5;

/// Strain at which the limiter stops.
pub(crate) const TOLERANCE: f32 = 5e-4;

/// Strain up to which an edge keeps its tension when it gets its length back.
pub(crate) const MAX_TENSION: f32 = 0.02;

/// Damping of a compressed edge in a [`GUARDED`](limit_strained) step, as a multiple of its strain.
/// A straight strand that is compressed end to end has to fold; by how much is not determined by
/// its lengths in first order, and Newton's step overshoots. With an eighth it folds by about as
/// much as compensates the strain, and steps converge as the strain vanishes.
pub(crate) const FOLDING: f32 = 0.125;

/// One Newton step on the lengths of every strand in the block; with `touched_only` of those that
/// touch an obstacle. Strands of a block are independent.
#[inline(never)]
pub(super) fn limit_lengths<S: Simd>(simd: S, b: &mut BlockLanes, touched_only: bool) {
    simd.vectorize(
        #[inline(always)]
        || {
            let touched = load(simd, &b.touched);
            let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
            if b.touched == [0.0; LANES] {
                eliminate::<S, false, false>(simd, b);
                solve::<S, false, false, false>(simd, b, one);
            } else {
                eliminate::<S, true, false>(simd, b);
                if touched_only {
                    solve::<S, true, true, false>(
                        simd,
                        b,
                        Real::select(Real::lt(zero, touched), one, zero),
                    );
                } else {
                    solve::<S, true, false, false>(simd, b, one);
                }
            }
        },
    );
}

/// One damped Newton step for strands with an edge of strain above `tolerance`, in the `lanes` that
/// are not 0: compressed strands fold no farther than necessary, and taut ones do not zigzag.
/// Returns whether there were any.
#[inline(never)]
pub(super) fn limit_strained<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    tolerance: f32,
    lanes: f32x16<S>,
) -> bool {
    simd.vectorize(
        #[inline(always)]
        || {
            let touching = b.touched != [0.0; LANES];
            let worst = if touching {
                eliminate::<S, true, true>(simd, b)
            } else {
                eliminate::<S, false, true>(simd, b)
            };
            let strained = Real::lt(f32x16::splat(simd, tolerance), worst)
                & Real::lt(f32x16::splat(simd, 0.0), lanes);
            if strained.to_bitmask() == 0 {
                return false;
            }
            let moves = Real::select(strained, f32x16::splat(simd, 1.0), f32x16::splat(simd, 0.0));
            if touching {
                solve::<S, true, true, true>(simd, b, moves);
            } else {
                solve::<S, false, true, true>(simd, b, moves);
            }
            true
        },
    )
}

/// The fallback where Newton steps on the lengths have failed, as when a root moves farther than
/// its strand is long: every edge of strain above `torn` is set to its length in its present
/// direction, root to tip. Edges before a held node are skipped, because both ends are fixed.
/// Only in the `lanes` that are not 0. Returns whether there were any.
#[inline(never)]
pub(super) fn clamp_lengths<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    torn: f32x16<S>,
    lanes: f32x16<S>,
) -> bool {
    simd.vectorize(
        #[inline(always)]
        || {
            let [zero, one] = [0.0, 1.0].map(|value| f32x16::splat(simd, value));
            let (least, most) = (one - torn, one + torn);
            let mut free = one;
            for (node, row) in b.nodes[1..].iter().zip(&mut b.scratch).rev() {
                let held = Real::lt(load(simd, &node.w), f32x16::splat(simd, 1e-12));
                free = Real::select(held, zero, free);
                free.store_array(&mut row.rhs);
            }
            let mut any = false;
            for i in 0..b.edges.len() {
                let l = load(simd, &b.edges[i].l);
                let start = b.nodes[i].position(simd);
                let (direction, length) = span(simd, start, b.nodes[i + 1].position(simd));
                let off = Real::lt(length, l * least) | Real::lt(l * most, length);
                let torn = off & Real::lt(zero, load(simd, &b.scratch[i].rhs) * lanes);
                if torn.to_bitmask() != 0 {
                    any = true;
                    let node = &mut b.nodes[i + 1];
                    let to = direction.scale_add(l, start);
                    node.set_position(V3::select(torn, to, node.position(simd)));
                }
            }
            any
        },
    )
}

/// The largest strain of each lane.
#[inline(always)]
pub(super) fn worst_strain<S: Simd>(simd: S, b: &BlockLanes) -> f32x16<S> {
    let mut worst = f32x16::splat(simd, 0.0);
    let ends = b.nodes.iter().zip(&b.nodes[1..]);
    for ((from, to), edge) in ends.zip(&b.edges) {
        let l = load(simd, &edge.l);
        let off = span(simd, from.position(simd), to.position(simd)).1 - l;
        worst = Real::max(worst, Real::max(off, -off) / l);
    }
    worst
}

/// A bit for each lane of which an edge is stretched or crushed by more than `most`; but a tip that a solid meets end-on
/// may be pressed for a substep or two, until it gives way sideways.
pub(crate) fn strained(level: Level, b: &BlockLanes, most: f32) -> u32 {
    dispatch!(level, simd => strained_simd(simd, b, most))
}

#[inline(always)]
fn strained_simd<S: Simd>(simd: S, b: &BlockLanes, most: f32) -> u32 {
    let [high, low] = [1.0 + most, 1.0 - most].map(|bound| f32x16::splat(simd, bound * bound));
    let mut off = 0;
    let mut from = b.nodes[0].position(simd);
    for (i, (to, edge)) in b.nodes[1..].iter().zip(&b.edges).enumerate() {
        let (to, l) = (to.position(simd), load(simd, &edge.l));
        let squared = (to - from).dot(to - from);
        off |= Real::lt(l * l * high, squared).to_bitmask();
        if i + 1 < b.edges.len() {
            off |= Real::lt(squared, l * l * low).to_bitmask();
        }
        from = to;
    }
    off as u32
}

// Closures that are not inlined would be compiled without the instruction set of their caller, so
// these are functions that are always inlined.

/// The direction from one node to the next and the distance between them.
#[inline(always)]
fn span<S: Simd>(simd: S, from: V3<f32x16<S>>, to: V3<f32x16<S>>) -> (V3<f32x16<S>>, f32x16<S>) {
    let along = to - from;
    let length = Real::sqrt(Real::max(along.dot(along), f32x16::splat(simd, 1e-20)));
    (along.scale(f32x16::splat(simd, 1.0) / length), length)
}

/// x · W y of node `i`.
#[inline(always)]
pub(crate) fn mobility<S: Simd, const TOUCHING: bool>(
    simd: S,
    b: &BlockLanes,
    i: usize,
    x: V3<f32x16<S>>,
    y: V3<f32x16<S>>,
) -> f32x16<S> {
    let node = &b.nodes[i];
    let free = x.dot(y);
    if TOUCHING {
        let n = node.support(simd);
        let stuck = load(simd, &node.sticks);
        let firm = firmness(simd, node, n, i == b.edges.len()) - stuck;
        load(simd, &node.w) * (free - stuck * free - firm * x.dot(n) * y.dot(n))
    } else {
        load(simd, &node.w) * free
    }
}

/// The share of a node's mobility that its support removes: all of what the solve has found pressed, but for a tip, on
/// which a straight strand may stand.
#[inline(always)]
fn firmness<S: Simd>(simd: S, node: &NodeLanes, normal: V3<f32x16<S>>, is_tip: bool) -> f32x16<S> {
    if is_tip {
        return f32x16::splat(simd, FIRMNESS);
    }
    let [zero, one] = [0.0, 1.0].map(|share| f32x16::splat(simd, share));
    let pressed = Real::lt(zero, load3(simd, &node.reaction).dot(normal));
    Real::select(pressed, one, f32x16::splat(simd, FIRMNESS))
}

/// The part of a force that moves a supported node; a node that is pulled off is released.
#[inline(always)]
pub(crate) fn along_support<S: Simd>(
    simd: S,
    node: &mut NodeLanes,
    is_tip: bool,
    force: V3<f32x16<S>>,
) -> V3<f32x16<S>> {
    let zero = f32x16::splat(simd, 0.0);
    let n = node.support(simd);
    let off = force.dot(n);
    // What the solve has found pressed is not released by a slight correction.
    let pressed = Real::lt(zero, load3(simd, &node.reaction).dot(n));
    let up = Real::lt(zero, off);
    let far = Real::lt(f32x16::splat(simd, TOUCHING), off * load(simd, &node.w));
    let lifts = up & (far | !pressed);
    // A tip that stands may only be pressed into it, from where it is pushed out again.
    let firmness = firmness(simd, node, n, is_tip);
    let firmness = Real::select(up, f32x16::splat(simd, 1.0), firmness);
    let stuck = load(simd, &node.sticks);
    node.set_support(V3::select(lifts, V3::new(zero, zero, zero), n));
    Real::select(lifts, zero, stuck).store_array(&mut node.sticks);
    let along = force.scale(f32x16::splat(simd, 1.0) - stuck);
    V3::select(lifts, force, n.scale_add(-((firmness - stuck) * off), along))
}

/// Eliminates from the root to the tip. `TOUCHING` respects obstacles; where there are none it changes
/// no bit. Returns the largest strain of each lane.
#[inline(always)]
fn eliminate<S: Simd, const TOUCHING: bool, const GUARDED: bool>(
    simd: S,
    b: &mut BlockLanes,
) -> f32x16<S> {
    let edges = b.edges.len();
    let zero = f32x16::splat(simd, 0.0);
    // Pivots below this belong to edges with both ends held: nothing there can move.
    let tiny = f32x16::splat(simd, 1e-6);
    let mut worst = zero;
    let mut end = b.nodes[1].position(simd);
    let (mut d, mut length) = span(simd, b.nodes[0].position(simd), end);
    let mut coupling = zero;
    let mut rows = Elimination::new(zero);
    for i in 0..edges {
        // Row i: coupling λ_{i−1} + d_i·(W_i + W_{i+1})d_i λ_i + … = C_i, where the coupling of two rows
        // is −d·W d′ of the node they share.
        let mut diagonal = mobility::<S, TOUCHING>(simd, b, i, d, d)
            + mobility::<S, TOUCHING>(simd, b, i + 1, d, d);
        let l = load(simd, &b.edges[i].l);
        let mut off = length - l;
        let strain = Real::max(off, -off) / l;
        worst = Real::max(worst, strain);
        if GUARDED {
            // What its tension stretches or presses it by stays: else the solve would do it again in each substep, and
            // what hangs would slip over what it lies on.
            let stretch = load(simd, &b.edges[i].tension) / load(simd, &b.edges[i].axial);
            let most = l * f32x16::splat(simd, TOLERANCE);
            off -= Real::min(Real::max(stretch, -most), most);
            // Levenberg–Marquardt, only for strain above the tolerance: hair within it is at rest.
            let beyond = Real::max(zero, strain - f32x16::splat(simd, TOLERANCE));
            let pressed = Real::select(Real::lt(off, zero), beyond, zero);
            diagonal += f32x16::splat(simd, FOLDING) * pressed * diagonal;
        }
        let upper = rows.row(coupling, diagonal, off, tiny);
        if i > 0 {
            b.scratch[i - 1].upper = upper.to_array();
        }
        let s = &mut b.scratch[i];
        s.direction = [d.x.to_array(), d.y.to_array(), d.z.to_array()];
        s.rhs = rows.rhs.to_array();
        s.upper = zero.to_array();
        if i + 1 < edges {
            let next = b.nodes[i + 2].position(simd);
            let (ahead, ahead_length) = span(simd, end, next);
            coupling = -mobility::<S, TOUCHING>(simd, b, i + 1, d, ahead);
            (d, length, end) = (ahead, ahead_length, next);
        }
    }
    worst
}

/// Solves from the tip to the root and moves the nodes of all lanes, or with `SOME` of the lanes
/// where `moves` is not 0.
///
/// The force across the strand on a node is the bend there times the tension λ. On fine strands it
/// overshoots to the other side, farther in each step; with `GUARDED` it is evaluated implicitly, a
/// factor 1/(1 + wλ/l) of the displacement.
#[inline(always)]
fn solve<S: Simd, const TOUCHING: bool, const SOME: bool, const GUARDED: bool>(
    simd: S,
    b: &mut BlockLanes,
    moves: f32x16<S>,
) {
    let (edges, zero) = (b.edges.len(), f32x16::splat(simd, 0.0));
    let moves = Real::lt(zero, moves);
    // Back substitution, and Δp_{i+1} = W_{i+1} (λ_{i+1} d_{i+1} − λ_i d_i) from the tip upward.
    let one = f32x16::splat(simd, 1.0);
    let half = f32x16::splat(simd, 0.5);
    let mut lambda = zero;
    let mut pull = V3::new(zero, zero, zero);
    // The edge after this one: its λ and direction.
    let (mut after, mut ahead) = (zero, pull);
    for i in (0..edges).rev() {
        let s = &b.scratch[i];
        lambda = back(load(simd, &s.rhs), load(simd, &s.upper), lambda);
        let d = V3::new(
            load(simd, &s.direction[0]),
            load(simd, &s.direction[1]),
            load(simd, &s.direction[2]),
        );
        let tension = d.scale(lambda);
        let node = &mut b.nodes[i + 1];
        let w = load(simd, &node.w);
        let p = node.position(simd);
        let mut force = pull - tension;
        if GUARDED && i + 1 < edges {
            let taut = Real::max(zero, half * (lambda + after));
            let stiff = taut * w / load(simd, &b.edges[i].l);
            force = force - (ahead - d).scale(taut * stiff / (one + stiff));
        }
        (after, ahead) = (lambda, d);
        if TOUCHING {
            force = along_support(simd, node, i + 1 == edges, force);
        }
        let moved = force.scale_add(w, p);
        node.set_position(if SOME { V3::select(moves, moved, p) } else { moved });
        pull = tension;
    }
}
