//! Nodes against obstacles: prediction, and push-out with friction.

use super::{
    block::{BlockLanes, EdgeLanes, NodeLanes},
    near::ESCAPE_RATIO,
    obstacle::{NearObstacles, Obstacle, PushOut, continuous_collision, push_out},
};
use crate::base::lanes::{LANES, Real, V3, load, load3, store3};
use fearless_simd::{Simd, f32x16, prelude::*};

/// Computes for each node how deep it may be in an obstacle that its root lies in: nearer to the
/// root than that is deep, it cannot get out without being torn off.
pub(super) struct RootPenetration<S: Simd> {
    root: V3<f32x16<S>>,
    sunk: f32x16<S>,
    any: bool,
    along: f32x16<S>,
}

impl<S: Simd> RootPenetration<S> {
    #[inline(always)]
    pub(super) fn new(simd: S, b: &BlockLanes) -> Self {
        let root = b.nodes.first().map(|n| load3(simd, &n.p));
        let zero = f32x16::splat(simd, 0.0);
        Self {
            root: root.unwrap_or(V3::new(zero, zero, zero)),
            sunk: load(simd, &b.sunk),
            any: b.sunk != [0.0; LANES],
            along: zero,
        }
    }

    /// Of node `i`, to be asked node after node; `None` where it may be nowhere inside.
    #[inline(always)]
    pub(super) fn at(&mut self, edges: &[EdgeLanes], i: usize) -> Option<AllowedPenetration<S>> {
        if !self.any {
            return None;
        }
        let simd = self.sunk.simd;
        let is_sunk = Real::lt(self.along, self.sunk);
        let along = self.along;
        if let Some(edge) = edges.get(i) {
            self.along += load(simd, &edge.l);
        }
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let deepest = self.sunk * f32x16::splat(simd, 1.0 / ESCAPE_RATIO);
        let lanes = Real::select(is_sunk, one, zero);
        let sunk = AllowedPenetration { root: self.root, deepest, along, lanes };
        is_sunk.any_true().then_some(sunk)
    }
}

/// Where a root lies in several obstacles, as in balls that together are a head, it has to get out of the deepest:
/// those in which it is at least half as deep allow as much.
pub(crate) const DEPTH_RATIO: f32 = 2.0;

/// A node near a sunk root.
pub(super) struct AllowedPenetration<S: Simd> {
    root: V3<f32x16<S>>,
    /// The root's depth in what it is deepest in.
    deepest: f32x16<S>,
    along: f32x16<S>,
    lanes: f32x16<S>,
}

impl<S: Simd> AllowedPenetration<S> {
    /// How deep it may be in this obstacle.
    #[inline(always)]
    pub(super) fn allowed(&self, obstacle: &Obstacle, clearance: f32) -> f32x16<S> {
        let zero = f32x16::splat(self.along.simd, 0.0);
        if obstacle.solid.is_clear(self.root, clearance) {
            return zero;
        }
        let depth = obstacle.solid.depth(self.root, clearance).1;
        let share = depth * f32x16::splat(zero.simd, DEPTH_RATIO) / self.deepest;
        let share = Real::min(share, f32x16::splat(zero.simd, 1.0));
        // Less and less, at last by as much as it gets out straight on: so it may first go along another one.
        let along = self.along * f32x16::splat(zero.simd, 1.0 / ESCAPE_RATIO);
        let left = self.lanes * (self.deepest - along * along / self.deepest) * share;
        Real::select(Real::lt(zero, left), left, zero)
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
            let mut sinking = RootPenetration::new(simd, b);
            for (i, (n, near)) in b.nodes.iter_mut().zip(&b.near_obstacles).enumerate() {
                let sunk = sinking.at(&b.edges, i);
                let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
                let p = load3(simd, &n.p);
                // Nodes that begin inside an obstacle are placed on its surface before the step, so
                // that the push-out adds no velocity. A moving obstacle does add its own.
                let mut from = p;
                for o in near.of(obstacles) {
                    let start = o.moved_with(from);
                    let allowed = sunk.as_ref().map_or(zero, |s| s.allowed(o, clearance));
                    if let Some((out, _)) =
                        push_out(o, start, start, zero, clearance, allowed, PushOut::Shortest)
                    {
                        from = V3::select(held, from, from + (out - start));
                    }
                }
                let v = load3(simd, &n.v);
                // Held nodes have their start in `from` and their target in `p`.
                let start_position = V3::select(held, load3(simd, &n.from), from);
                store3(&mut n.from, start_position);
                let mut to = (v + gain).scale_add(dt, from);
                for o in near.of(obstacles) {
                    if let Some((before, _)) =
                        continuous_collision(o, o.moved_with(from), to, clearance)
                    {
                        let allowed = sunk.as_ref().map_or(zero, |s| s.allowed(o, clearance));
                        let stays = held | Real::lt(zero, allowed);
                        (to, b.has_fast_nodes) = (V3::select(stays, to, before), true);
                    }
                }
                store3(&mut n.p, V3::select(held, p, to));
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
    contacts_with(simd, b, clearance, obstacles, FrictionShare::WHOLE, f32x16::splat(simd, 1.0));
}

/// The share of a node's penetration depth that counts as normal force for friction: for nodes that
/// rested on an obstacle in the previous pass, and for others.
#[derive(Clone, Copy)]
pub(super) struct FrictionShare {
    pub(super) resting: f32,
    pub(super) others: f32,
}

impl FrictionShare {
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
    grip: FrictionShare,
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
            let mut sinking = RootPenetration::new(simd, b);
            for (i, (n, (near, close))) in b.nodes.iter_mut().zip(near).enumerate() {
                let sunk = sinking.at(&b.edges, i);
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
                let fast = b.has_fast_nodes;
                let touches = touch(simd, n, near, fast, clearance, obstacles, grip, lanes, sunk);
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
    grip: FrictionShare,
    lanes: f32x16<S>,
    sunk: Option<AllowedPenetration<S>>,
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
                let allowed = sunk.as_ref().map_or(zero, |s| s.allowed(o, clearance));
                // Tunnelling has to be stopped in every pass: the shortest way out may be on the wrong
                // side.
                if has_fast_nodes
                    && let Some((before, normal)) =
                        continuous_collision(o, o.moved_with(from), p, clearance)
                {
                    let may_be = Real::lt(zero, allowed);
                    p = V3::select(held | may_be, p, before);
                    let stopped = Real::lt(zero, normal.dot(normal) * lanes);
                    let stopped = stopped & !may_be;
                    rests_on = V3::select(stopped, normal, rests_on);
                    touched = Real::select(stopped, one, touched);
                }
                let friction = grip * f32x16::splat(simd, o.friction);
                if let Some((out, normal)) =
                    push_out(o, p, from, friction, clearance, allowed, PushOut::WithFriction)
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
