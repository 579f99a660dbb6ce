//! Nodes against obstacles: where they fall to, and out of what they have fallen into.

use super::{
    block::{BlockLanes, NodeLanes},
    obstacle::{Obstacle, Way, continuous_collision, push_out},
};
use crate::lanes::{LANES, Real, V3, load, load3, store3};
use fearless_simd::{Simd, f32x16, prelude::*};

/// v is already that of the forces, but for what `gain` adds to it; p* = p + v dt.
#[inline(never)]
pub(crate) fn predict_nodes<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    dt: f32x16<S>,
    gain: V3<f32x16<S>>,
    skin: f32,
    obstacles: &[Obstacle],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = f32x16::splat(simd, 0.0);
            b.sweeps = false;
            for n in &mut b.nodes {
                let w = load(simd, &n.w);
                let held = Real::lt(w, f32x16::splat(simd, 1e-12));
                let p = load3(simd, &n.p);
                // Nodes that begin inside an obstacle are set on its surface before the step, so that
                // getting them out gives them no velocity. What comes at them gives them some.
                let mut from = p;
                for o in obstacles {
                    let start = o.taken_along(from);
                    if let Some((out, _)) = push_out(o, start, start, zero, skin, Way::Shortest) {
                        from = V3::select(held, from, from + (out - start));
                    }
                }
                let v = load3(simd, &n.v);
                // Held nodes carry where they come from in `from` and where they are to be in `p`.
                let came_from = V3::select(held, load3(simd, &n.from), from);
                store3(&mut n.from, came_from);
                let mut to = (v + gain).scale_add(dt, from);
                for o in obstacles {
                    if let Some((before, _)) =
                        continuous_collision(o, o.taken_along(from), to, skin)
                    {
                        (to, b.sweeps) = (before, true);
                    }
                }
                store3(&mut n.p, V3::select(held, p, to));
            }
        },
    );
}

/// Takes nodes out of obstacles, with friction, and notes what touches.
#[inline(always)]
pub(crate) fn contacts<S: Simd>(simd: S, b: &mut BlockLanes, skin: f32, obstacles: &[Obstacle]) {
    contacts_with(simd, b, skin, obstacles, Grip::WHOLE, f32x16::splat(simd, 1.0));
}

/// How much of the depth that a node is found at says how hard it is pressed on an obstacle: of nodes
/// that rested on one in the pass before, and of others.
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

/// [`contacts`], where depths are not what a whole step's forces came to, and of lanes that are not 0.
#[inline(never)]
pub(super) fn contacts_with<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    skin: f32,
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
            for n in &mut b.nodes {
                touched =
                    Real::max(touched, touch(simd, n, b.sweeps, skin, obstacles, grip, lanes));
            }
            touched.store_array(&mut b.touched);
        },
    );
}

/// Takes one node out of obstacles, with friction, and notes what it rests on. Returns 1 where it
/// rests on any.
#[inline(never)]
pub(super) fn touch<S: Simd>(
    simd: S,
    n: &mut NodeLanes,
    sweeps: bool,
    skin: f32,
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
            for o in obstacles {
                // What would take a node through has to be stopped in every pass: the shortest way out
                // may be the wrong one.
                if sweeps
                    && let Some((before, normal)) =
                        continuous_collision(o, o.taken_along(from), p, skin)
                {
                    p = V3::select(held, p, before);
                    let stopped = Real::lt(zero, normal.dot(normal) * lanes);
                    rests_on = V3::select(stopped, normal, rests_on);
                    touched = Real::select(stopped, one, touched);
                }
                let friction = grip * f32x16::splat(simd, o.friction);
                if let Some((out, normal)) = push_out(o, p, from, friction, skin, Way::WithFriction)
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
