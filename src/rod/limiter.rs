//! The length limiter: a direct solve of a whole strand's length constraints.
//!
//! Root-to-tip Gauss–Seidel carries length errors one edge an iteration, so long strands stretch.
//! One Newton step on all lengths at once is a tridiagonal system J W Jᵀ λ = C with
//! C_i = |p_{i+1} − p_i| − l_i, solved by the Thomas algorithm in one pass down and one up.
//! Node masses alone enter: the rods' orientations are left as the iterations put them.

use super::lanes::{LANES, Real};
use super::{algebra::V3, block::BlockLanes};
use fearless_simd::{Simd, f32x16, prelude::*};

/// One Newton step on the lengths of every strand in the block.
#[inline(always)]
pub(super) fn limit_lengths<S: Simd>(simd: S, b: &mut BlockLanes) {
    let load = |a: &[f32; LANES]| f32x16::load_array_ref(simd, a);
    let edges = b.edges.len();
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    // Pivots below this belong to edges with both ends held: nothing there can move.
    let tiny = f32x16::splat(simd, 1e-6);
    let span = |from: V3<f32x16<S>>, to: V3<f32x16<S>>| {
        let along = to - from;
        let length = Real::sqrt(Real::max(along.dot(along), f32x16::splat(simd, 1e-20)));
        (along.scale(one / length), length)
    };
    let mut end = b.nodes[1].position(simd);
    let (mut d, mut length) = span(b.nodes[0].position(simd), end);
    let mut w = load(&b.nodes[0].w);
    let (mut lower, mut upper, mut rhs) = (zero, zero, zero);
    for i in 0..edges {
        // Row i: lower λ_{i−1} + (w_i + w_{i+1}) λ_i + coupling λ_{i+1} = C_i, where the coupling of
        // two rows is −w (d·d′) of the node they share, and so also the next row's `lower`.
        let w_end = load(&b.nodes[i + 1].w);
        let pivot = w + w_end - lower * upper;
        let inverse = Real::select(Real::lt(pivot, tiny), zero, one / pivot);
        rhs = (length - load(&b.edges[i].l) - lower * rhs) * inverse;
        let s = &mut b.scratch[i];
        s.direction = [d.x.to_array(), d.y.to_array(), d.z.to_array()];
        s.rhs = rhs.to_array();
        if i + 1 < edges {
            let next = b.nodes[i + 2].position(simd);
            let (ahead, ahead_length) = span(end, next);
            let coupling = -(w_end * d.dot(ahead));
            upper = coupling * inverse;
            (lower, d, length, end, w) = (coupling, ahead, ahead_length, next, w_end);
        }
        b.scratch[i].upper = upper.to_array();
    }
    // Back substitution, and Δp_{i+1} = w_{i+1} (λ_{i+1} d_{i+1} − λ_i d_i) from the tip upward.
    let mut lambda = zero;
    let mut pull = V3::new(zero, zero, zero);
    for i in (0..edges).rev() {
        let s = &b.scratch[i];
        lambda = load(&s.rhs) - load(&s.upper) * lambda;
        let d = V3::new(load(&s.direction[0]), load(&s.direction[1]), load(&s.direction[2]));
        let tension = d.scale(lambda);
        let node = &mut b.nodes[i + 1];
        let w = load(&node.w);
        let moved = (pull - tension).scale_add(w, node.position(simd));
        node.set_position(moved);
        pull = tension;
    }
}
