//! Nodes against obstacles: prediction, and push-out with friction.

use super::{
    block::{BlockLanes, EdgeLanes, NodeLanes},
    obstacle::{NearObstacles, Obstacle, PushOut, continuous_collision, push_out},
};
use crate::lanes::{LANES, Lane, Real, V3, load, load3, store3};
use fearless_simd::{Simd, f32x16, prelude::*};

/// Which nodes can get out of obstacles that their strand's root lies in: 1, else 0. Those nearer to the root than
/// it is deep would only be torn off it.
pub(super) struct Free<S: Simd> {
    sunk: f32x16<S>,
    any: bool,
    along: f32x16<S>,
}

impl<S: Simd> Free<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, sunk: &Lane) -> Self {
        Self { sunk: load(simd, sunk), any: *sunk != [0.0; LANES], along: f32x16::splat(simd, 0.0) }
    }

    /// Of node `i`; to be asked node after node.
    #[inline(always)]
    pub(super) fn at(&mut self, edges: &[EdgeLanes], i: usize) -> f32x16<S> {
        let simd = self.sunk.simd;
        let one = f32x16::splat(simd, 1.0);
        if !self.any {
            return one;
        }
        let is_sunk = Real::lt(self.along, self.sunk);
        if let Some(edge) = edges.get(i) {
            self.along += load(simd, &edge.l);
        }
        Real::select(is_sunk, f32x16::splat(simd, 0.0), one)
    }
}

/// Predicts p* = p + v dt; v already contains the forces, apart from `gain`.
#[inline(never)]
pub(crate) fn predict_nodes<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    dt: f32x16<S>,
    gain: V3<f32x16<S>>,
    clearance: f32,
    obstacles: &[Obstacle],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = f32x16::splat(simd, 0.0);
            b.has_fast_nodes = false;
            let mut free = Free::new(simd, &b.sunk);
            for (i, (n, near)) in b.nodes.iter_mut().zip(&b.near_obstacles).enumerate() {
                let w = load(simd, &n.w);
                let held = Real::lt(w * free.at(&b.edges, i), f32x16::splat(simd, 1e-12));
                let p = load3(simd, &n.p);
                // Nodes that begin inside an obstacle are placed on its surface before the step, so
                // that the push-out adds no velocity. A moving obstacle does add its own.
                let mut from = p;
                for o in near.of(obstacles) {
                    let start = o.moved_with(from);
                    if let Some((out, _)) =
                        push_out(o, start, start, zero, clearance, PushOut::Shortest)
                    {
                        from = V3::select(held, from, from + (out - start));
                    }
                }
                let v = load3(simd, &n.v);
                // Held nodes have their start in `from` and their target in `p`.
                let led = Real::lt(w, f32x16::splat(simd, 1e-12));
                let start_position = V3::select(led, load3(simd, &n.from), from);
                store3(&mut n.from, start_position);
                let mut to = (v + gain).scale_add(dt, from);
                for o in near.of(obstacles) {
                    if let Some((before, _)) =
                        continuous_collision(o, o.moved_with(from), to, clearance)
                    {
                        (to, b.has_fast_nodes) = (V3::select(held, to, before), true);
                    }
                }
                store3(&mut n.p, V3::select(led, p, to));
            }
        },
    );
}

/// Pushes nodes out of obstacles, with friction, and records what touches.
#[inline(always)]
pub(crate) fn contacts<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    clearance: f32,
    obstacles: &[Obstacle],
) {
    contacts_with(simd, b, clearance, obstacles, Grip::WHOLE, f32x16::splat(simd, 1.0));
}

/// The share of a node's penetration depth that counts as normal force for friction: for nodes that
/// rested on an obstacle in the previous pass, and for others.
#[derive(Clone, Copy)]
pub(super) struct Grip {
    pub(super) resting: f32,
    pub(super) others: f32,
}

impl Grip {
    pub(super) const WHOLE: Self = Self { resting: 1.0, others: 1.0 };
    /// No friction.
    pub(super) const NONE: Self = Self { resting: 0.0, others: 0.0 };
}

/// [`contacts`] with another normal force for friction, in the lanes that are not 0.
#[inline(never)]
pub(super) fn contacts_with<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    clearance: f32,
    obstacles: &[Obstacle],
    grip: Grip,
    lanes: f32x16<S>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            b.touched = [0.0; LANES];
            if obstacles.is_empty() {
                return;
            }
            let mut touched = f32x16::splat(simd, 0.0);
            let near = b.near_obstacles.iter().zip(&b.close_obstacles);
            let mut free = Free::new(simd, &b.sunk);
            for (i, (n, (near, close))) in b.nodes.iter_mut().zip(near).enumerate() {
                let lanes = lanes * free.at(&b.edges, i);
                if *near == NearObstacles::NONE {
                    continue;
                }
                // What is passed on the way may be farther off.
                let near = match b.has_fast_nodes {
                    true => *near,
                    false => close.at(load3(simd, &n.p), *near),
                };
                if near == NearObstacles::NONE {
                    n.rests_on = Default::default();
                    continue;
                }
                let touches =
                    touch(simd, n, near, b.has_fast_nodes, clearance, obstacles, grip, lanes);
                touched = Real::max(touched, touches);
            }
            touched.store_array(&mut b.touched);
        },
    );
}

/// Pushes one node out of obstacles, with friction, and records the normal that it rests on. Returns 1
/// where it rests on any.
#[inline(never)]
pub(super) fn touch<S: Simd>(
    simd: S,
    n: &mut NodeLanes,
    near: NearObstacles,
    has_fast_nodes: bool,
    clearance: f32,
    obstacles: &[Obstacle],
    grip: Grip,
    lanes: f32x16<S>,
) -> f32x16<S> {
    simd.vectorize(
        #[inline(always)]
        || {
            let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
            let mut touched = zero;
            let held = Real::lt(load(simd, &n.w) * lanes, f32x16::splat(simd, 1e-12));
            let from = load3(simd, &n.from);
            let rested = n.support(simd);
            let grip = Real::select(
                Real::lt(zero, rested.dot(rested)),
                f32x16::splat(simd, grip.resting),
                f32x16::splat(simd, grip.others),
            );
            let (mut p, mut rests_on) = (load3(simd, &n.p), V3::new(zero, zero, zero));
            for o in near.of(obstacles) {
                // Tunnelling has to be stopped in every pass: the shortest way out may be on the wrong
                // side.
                if has_fast_nodes
                    && let Some((before, normal)) =
                        continuous_collision(o, o.moved_with(from), p, clearance)
                {
                    p = V3::select(held, p, before);
                    let stopped = Real::lt(zero, normal.dot(normal) * lanes);
                    rests_on = V3::select(stopped, normal, rests_on);
                    touched = Real::select(stopped, one, touched);
                }
                let friction = grip * f32x16::splat(simd, o.friction);
                if let Some((out, normal)) =
                    push_out(o, p, from, friction, clearance, PushOut::WithFriction)
                {
                    p = V3::select(held, p, out);
                    let pushed = Real::lt(zero, normal.dot(normal) * lanes);
                    rests_on = V3::select(pushed, normal, rests_on);
                    touched = Real::select(pushed, one, touched);
                }
            }
            store3(&mut n.p, p);
            store3(&mut n.rests_on, rests_on);
            touched
        },
    )
}
