//! The length limiter: a direct solve of a whole strand's length constraints.
//!
//! Root-to-tip Gauss–Seidel carries length errors one edge an iteration, so long strands stretch.
//! One Newton step on all lengths at once is a tridiagonal system J W Jᵀ λ = C with
//! C_i = |p_{i+1} − p_i| − l_i, solved by the Thomas algorithm in one pass down and one up.
//! Node masses alone enter: the rods' orientations are left as the iterations put them.
//!
//! A node that rests on an obstacle cannot go into it, so there W = w (I − a n nᵀ): lengths are
//! mended along the surface instead of against it, which would end in compression. A node that the
//! strand pulls off the surface is let go.

use super::{
    block::{BlockLanes, NodeLanes},
    tridiagonal::{Elimination, back},
};
use crate::lanes::{LANES, Real, V3, load};
use fearless_simd::{Simd, f32x16, prelude::*};

/// a: how firmly an obstacle holds against being pushed into. Below 1, so that a strand pressed
/// straight down is not asked to fold within one substep.
const FIRMNESS: f32 = 0.95;

/// One Newton step on the lengths of every strand in the block; with `touched_only` of those that
/// touch an obstacle. What a strand does never depends on the others in its block.
#[inline(never)]
pub(super) fn limit_lengths<S: Simd>(simd: S, b: &mut BlockLanes, touched_only: bool) {
    simd.vectorize(
        #[inline(always)]
        || {
            let touched = load(simd, &b.touched);
            let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
            if b.touched == [0.0; LANES] {
                eliminate::<S, false>(simd, b);
                solve::<S, false, false>(simd, b, one);
            } else {
                eliminate::<S, true>(simd, b);
                if touched_only {
                    solve::<S, true, true>(
                        simd,
                        b,
                        Real::select(Real::lt(zero, touched), one, zero),
                    );
                } else {
                    solve::<S, true, false>(simd, b, one);
                }
            }
        },
    );
}

/// One Newton step for strands of which an edge is off its length by more than the share `tolerance`,
/// among the `lanes` that are not 0. Returns whether there were any.
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
                eliminate::<S, true>(simd, b)
            } else {
                eliminate::<S, false>(simd, b)
            };
            let strained = Real::lt(f32x16::splat(simd, tolerance), worst)
                & Real::lt(f32x16::splat(simd, 0.0), lanes);
            if strained.to_bitmask() == 0 {
                return false;
            }
            let moves = Real::select(strained, f32x16::splat(simd, 1.0), f32x16::splat(simd, 0.0));
            if touching {
                solve::<S, true, true>(simd, b, moves);
            } else {
                solve::<S, false, true>(simd, b, moves);
            }
            true
        },
    )
}

/// The last resort where Newton steps on the lengths have failed, as when a root leaps farther than its
/// strand is long: every edge off by more than the share `torn` gets its length back, root to tip, in the
/// direction that it has. Edges before a held node are left: there is nowhere to go. Returns whether
/// there were any.
#[inline(never)]
pub(super) fn clamp_lengths<S: Simd>(simd: S, b: &mut BlockLanes, torn: f32) -> bool {
    simd.vectorize(
        #[inline(always)]
        || {
            let [zero, one] = [0.0, 1.0].map(|value| f32x16::splat(simd, value));
            let [least, most] = [1.0 - torn, 1.0 + torn].map(|share| f32x16::splat(simd, share));
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
                let torn = off & Real::lt(zero, load(simd, &b.scratch[i].rhs));
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

// Closures would be compiled without the instruction set of their caller where the compiler does not
// inline them, so the small parts are functions that it has to.

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
        load(simd, &node.w) * (free - f32x16::splat(simd, FIRMNESS) * x.dot(n) * y.dot(n))
    } else {
        load(simd, &node.w) * free
    }
}

/// What a force on a node comes to where an obstacle bears it; a node that is pulled off is let go.
#[inline(always)]
pub(crate) fn along_support<S: Simd>(
    simd: S,
    node: &mut NodeLanes,
    force: V3<f32x16<S>>,
) -> V3<f32x16<S>> {
    let (zero, firmness) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, FIRMNESS));
    let n = node.support(simd);
    let off = force.dot(n);
    let lifts = Real::lt(zero, off);
    node.set_support(V3::select(lifts, V3::new(zero, zero, zero), n));
    V3::select(lifts, force, n.scale_add(-(firmness * off), force))
}

/// Eliminates from the root to the tip. `TOUCHING` heeds obstacles; where there are none it changes no
/// bit. Returns the largest strain of each lane.
#[inline(always)]
fn eliminate<S: Simd, const TOUCHING: bool>(simd: S, b: &mut BlockLanes) -> f32x16<S> {
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
        let diagonal = mobility::<S, TOUCHING>(simd, b, i, d, d)
            + mobility::<S, TOUCHING>(simd, b, i + 1, d, d);
        let off = length - load(simd, &b.edges[i].l);
        worst = Real::max(worst, Real::max(off, -off) / load(simd, &b.edges[i].l));
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

/// Solves from the tip to the root and moves the nodes of all lanes, or with `SOME` of those that are
/// not 0 in `moves`.
#[inline(always)]
fn solve<S: Simd, const TOUCHING: bool, const SOME: bool>(
    simd: S,
    b: &mut BlockLanes,
    moves: f32x16<S>,
) {
    let (edges, zero) = (b.edges.len(), f32x16::splat(simd, 0.0));
    let moves = Real::lt(zero, moves);
    // Back substitution, and Δp_{i+1} = W_{i+1} (λ_{i+1} d_{i+1} − λ_i d_i) from the tip upward.
    let mut lambda = zero;
    let mut pull = V3::new(zero, zero, zero);
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
        if TOUCHING {
            force = along_support(simd, node, force);
        }
        let moved = force.scale_add(w, p);
        node.set_position(if SOME { V3::select(moves, moved, p) } else { moved });
        pull = tension;
    }
}
