//! The iterations of a substep: Gauss–Seidel sweeps from root to tip (\[B\] equations 1–12).
//!
//! Edge after edge is one long dependency chain, so several sweeps run down the strand at once
//! (pipelined), each two edges behind the previous one. An edge's projection reaches no farther, so
//! each sweep reads what it would after the previous one had ended: the result is the same to the bit.

use super::{
    block::BlockLanes,
    constraint::{
        BendShares, EdgeWeights, StretchProjection, StretchShares, bend_twist, stretch_shear,
    },
    obstacle::Obstacle,
    touch::{FrictionPass, touch},
};
use crate::base::lanes::{LANES, Quaternion, Real, V3, load, load4, store3, store4};
use fearless_simd::{Simd, f32x16, prelude::*};

/// The maximum number of sweeps in the pipeline.
const PIPELINE: usize = 8;

/// How stretch–shear is projected, by the constant that the sweeps are compiled for.
const PROJECTIONS: [StretchProjection; 3] =
    [StretchProjection::Split, StretchProjection::Coupled, StretchProjection::Printed];

/// All iterations, up to [`PIPELINE`] of them at once.
#[inline(always)]
pub(super) fn project<S: Simd, const P: usize>(
    simd: S,
    b: &mut BlockLanes,
    iterations: u32,
    clearance: f32,
    obstacles: &[Obstacle],
) {
    compute_factors::<S, P>(simd, b);
    let mut left = iterations as usize;
    while left > 0 {
        let abreast = left.div_ceil(left.div_ceil(PIPELINE));
        sweeps::<S, P>(simd, b, abreast, clearance, obstacles);
        left -= abreast;
    }
    b.touched = [0.0; LANES];
    if b.is_near_obstacles() {
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let mut touched = zero;
        for n in &b.nodes {
            let normal = n.support(simd);
            touched = Real::select(Real::lt(zero, normal.dot(normal)), one, touched);
        }
        touched.store_array(&mut b.touched);
    }
}

/// Computes the factors that stay the same in all iterations.
#[inline(always)]
fn compute_factors<S: Simd, const P: usize>(simd: S, b: &mut BlockLanes) {
    let mut w_before = f32x16::splat(simd, 0.0);
    let mut w1 = load(simd, &b.nodes[0].w);
    for ((e, node), shares) in b.edges.iter().zip(&b.nodes[1..]).zip(&mut b.shares) {
        let (wq, l, w2) = (load(simd, &e.wq), load(simd, &e.l), load(simd, &node.w));
        let stretch = StretchShares::new(PROJECTIONS[P], EdgeWeights { w1, w2, wq, l });
        let bend = BendShares::new(w_before, wq, load(simd, &e.k));
        shares.stretch = stretch.map(|lanes| (*lanes).into());
        shares.bend = bend.map(|lanes| (*lanes).into());
        (w_before, w1) = (wq, w2);
    }
}

/// State of a sweep that stays in registers from one edge to the next.
#[derive(Clone, Copy)]
struct SweepState<S: Simd> {
    /// The previous edge, which the next joint still corrects.
    before: Quaternion<f32x16<S>>,
    /// The node between them.
    p1: V3<f32x16<S>>,
}

/// `abreast` Gauss–Seidel sweeps from root to tip: at each edge its bend–twist joint, then its
/// stretch–shear, then the edge's start node against obstacles, which nothing else in this sweep
/// moves. A sweep may follow two edges behind another: there it only reads that one's final values.
#[inline(never)]
fn sweeps<S: Simd, const P: usize>(
    simd: S,
    b: &mut BlockLanes,
    abreast: usize,
    clearance: f32,
    obstacles: &[Obstacle],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let edges = b.edges.len();
            let touching = b.is_near_obstacles();
            let all = f32x16::splat(simd, 1.0);
            let (before, p1) = (load4(simd, &b.root), b.nodes[0].position(simd));
            let mut state = [SweepState { before, p1 }; PIPELINE];
            for step in 0..edges + 2 * (abreast - 1) {
                for (k, state) in state.iter_mut().take(abreast).enumerate() {
                    let i = step.wrapping_sub(2 * k);
                    if i >= edges {
                        continue;
                    }
                    if i == 0 {
                        // The sweep before has left it here.
                        state.p1 = b.nodes[0].position(simd);
                    }
                    pass_edge::<S, P>(simd, b, i, state);
                    if touching {
                        let near = b.near_obstacles[i];
                        let node = &mut b.nodes[i];
                        touch(
                            simd,
                            node,
                            near,
                            b.has_fast_nodes,
                            clearance,
                            obstacles,
                            FrictionPass::Depth,
                            all,
                            None,
                        );
                    }
                    if i + 1 == edges {
                        store4(&mut b.edges[i].q, state.before);
                        store3(&mut b.nodes[i + 1].p, state.p1);
                        if touching {
                            let near = b.near_obstacles[i + 1];
                            let tip = &mut b.nodes[i + 1];
                            touch(
                                simd,
                                tip,
                                near,
                                b.has_fast_nodes,
                                clearance,
                                obstacles,
                                FrictionPass::Depth,
                                all,
                                None,
                            );
                        }
                    }
                }
            }
        },
    );
}

/// One edge of a sweep.
#[inline(always)]
fn pass_edge<S: Simd, const P: usize>(
    simd: S,
    b: &mut BlockLanes,
    i: usize,
    state: &mut SweepState<S>,
) {
    let one = f32x16::splat(simd, 1.0);
    let SweepState { before, p1 } = *state;
    let (e, shares) = (&b.edges[i], &b.shares[i]);
    let q = load4(simd, &e.q);
    let (d_before, d_q) =
        bend_twist(before, q, load4(simd, &e.rest), shares.bend.map(|s| load(simd, s)));
    let q = q.add_scaled(d_q, one).renormalize();
    let p2 = b.nodes[i + 1].position(simd);
    let c = stretch_shear(PROJECTIONS[P], p1, p2, q, shares.stretch.map(|s| load(simd, s)));
    if i > 0 {
        let turned = before.add_scaled(d_before, one).renormalize();
        store4(&mut b.edges[i - 1].q, turned);
    }
    store3(&mut b.nodes[i].p, p1 + c.p1);
    *state = SweepState { before: q.add_scaled(c.q, one).renormalize(), p1: p2 + c.p2 };
}

#[cfg(test)]
mod tests {
    use super::super::obstacle::Solid;
    use super::*;
    use crate::base::lanes::dispatch;
    use crate::base::lanes::{V3, put3, put4};
    use fearless_simd::Level;
    use glam::{Quat, Vec3};

    /// Strands that are far from where their constraints want them, each in its own way.
    fn bent(nodes: usize) -> BlockLanes {
        let mut block = BlockLanes::default();
        block.resize(nodes);
        for lane in 0..LANES {
            let wave = |i: usize, k: f32| ((i * LANES + lane) as f32 * k).sin();
            let place =
                |i: usize| Vec3::new(0.01 * wave(i, 1.3), -0.03 * i as f32, 0.01 * wave(i, 0.7));
            for (i, node) in block.nodes.iter_mut().enumerate() {
                put3(&mut node.p, lane, place(i));
                put3(&mut node.from, lane, place(i) + Vec3::Y * 0.002);
                node.w[lane] = if i == 0 { 0.0 } else { 1.0 };
            }
            for (i, edge) in block.edges.iter_mut().enumerate() {
                let turn = |k| Quat::from_rotation_x(1.5 + 0.3 * wave(i, k));
                put4(&mut edge.q, lane, turn(0.9));
                put4(&mut edge.rest, lane, Quat::from_rotation_y(0.2 * wave(i, 0.4)));
                (edge.l[lane], edge.wq[lane], edge.k[lane]) = (0.03, 40.0, 0.2);
            }
            put4(&mut block.root, lane, Quat::from_rotation_x(1.5));
        }
        block
    }

    #[test]
    fn pipelined_sweeps_equal_sequential_sweeps_to_the_bit() {
        let floor = Solid::HalfSpace { normal: Vec3::Y, point: Vec3::NEG_Y * 0.05 };
        let floor = Obstacle { solid: floor, motion: None, friction: 0.3 };
        for nodes in [2, 3, 4, 9, 16] {
            for count in 2..=PIPELINE {
                for obstacles in [&[][..], core::slice::from_ref(&floor)] {
                    let (mut one, mut many) = (bent(nodes), bent(nodes));
                    dispatch!(Level::new(), simd => {
                        compute_factors::<_, 0>(simd, &mut many);
                        sweeps::<_, 0>(simd, &mut many, count, 1e-3, obstacles);
                    });
                    dispatch!(Level::new(), simd => compute_factors::<_, 0>(simd, &mut one));
                    for _ in 0..count {
                        dispatch!(Level::new(), simd => {
                            sweeps::<_, 0>(simd, &mut one, 1, 1e-3, obstacles);
                        });
                    }
                    assert!(one.nodes.last().map(|n| n.p) != bent(nodes).nodes.last().map(|n| n.p));
                    for (a, b) in one.nodes.iter().zip(&many.nodes) {
                        assert!(a.p == b.p && a.rests_on == b.rests_on, "{nodes}, {count}");
                    }
                    for (a, b) in one.edges.iter().zip(&many.edges) {
                        assert!(a.q == b.q, "{nodes}, {count}");
                    }
                }
            }
        }
    }

    #[test]
    fn renormalizing_converges_to_length_one_and_is_exact_to_second_order() {
        for length in [1e-3, 0.5, 0.99, 1.0, 1.02, 3.0, 1e4] {
            let mut q = Quaternion::new(V3::new(0.48 * length, -0.64 * length, 0.0), 0.6 * length);
            let off: f64 = length - 1.0;
            let first = q.renormalize();
            let left = 1.0 - first.dot(first).sqrt();
            assert!(left >= -1e-12, "never longer than 1: {left}");
            assert!(off.abs() > 0.1 || left <= 0.51 * off * off + 1e-12, "{off}: {left}");
            for _ in 0..20 {
                q = q.renormalize();
            }
            assert!((q.dot(q) - 1.0).abs() < 1e-9, "{length}: {}", q.dot(q));
        }
    }
}
