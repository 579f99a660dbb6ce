//! Nodes against obstacles: prediction, and push-out with friction.

use super::{
    block::{BlockLanes, NodeLanes},
    obstacle::{NearObstacles, Obstacle, PushOut, continuous_collision, push_out},
};
use crate::lanes::{LANES, Real, V3, load, load3, store3};
use fearless_simd::{Simd, f32x16, prelude::*};

/// How far a node may move in a substep, as a multiple of the path by its velocity alone. More than 1,
/// because forces of the substep act too.
const FASTER: f32 = 1.5;

/// Finds the obstacles that each node may touch in a substep of `dt`, so that its passes skip the
/// others: on a head of a dozen solids most nodes are near one or none. `from` of held nodes must
/// be set.
#[inline(never)]
pub(crate) fn choose_near<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    dt: f32,
    clearance: f32,
    obstacles: &[Obstacle],
) {
    if obstacles.is_empty() {
        // The block may have held other strands before, which rested on something.
        b.nodes.iter_mut().for_each(|n| n.rests_on = Default::default());
        return;
    }
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = f32x16::splat(simd, 0.0);
            // Held nodes drag others beyond their ballistic path; forces move nodes by at most about
            // an edge.
            let mut pull = zero;
            for n in &b.nodes {
                let led = load3(simd, &n.p) - load3(simd, &n.from);
                let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
                pull = Real::max(pull, Real::select(held, led.dot(led), zero));
            }
            let mut edge = zero;
            for e in &b.edges {
                edge = Real::max(edge, load(simd, &e.l));
            }
            let margin = Real::sqrt(pull) + edge + f32x16::splat(simd, clearance);
            let ahead = f32x16::splat(simd, FASTER * dt);
            for (n, near) in b.nodes.iter_mut().zip(&mut b.near_obstacles) {
                n.rests_on = Default::default();
                let (p, v) = (load3(simd, &n.p), load3(simd, &n.v));
                let reach = Real::mul_add(Real::sqrt(v.dot(v)), ahead, margin);
                *near = NearObstacles::NONE;
                for (i, o) in obstacles.iter().enumerate() {
                    let mut reach = reach;
                    if o.motion.is_some() {
                        let moved = o.moved_with(p) - p;
                        reach += Real::sqrt(moved.dot(moved));
                    }
                    if o.solid.is_beyond(p, reach).any_false() {
                        near.add(i);
                    }
                }
            }
        },
    );
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
            for (n, near) in b.nodes.iter_mut().zip(&b.near_obstacles) {
                let w = load(simd, &n.w);
                let held = Real::lt(w, f32x16::splat(simd, 1e-12));
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
                let start_position = V3::select(held, load3(simd, &n.from), from);
                store3(&mut n.from, start_position);
                let mut to = (v + gain).scale_add(dt, from);
                for o in near.of(obstacles) {
                    if let Some((before, _)) =
                        continuous_collision(o, o.moved_with(from), to, clearance)
                    {
                        (to, b.has_fast_nodes) = (before, true);
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
            for (n, near) in b.nodes.iter_mut().zip(&b.near_obstacles) {
                if *near != NearObstacles::NONE {
                    let touches =
                        touch(simd, n, *near, b.has_fast_nodes, clearance, obstacles, grip, lanes);
                    touched = Real::max(touched, touches);
                }
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::rod::{
        obstacle::Solid,
        shape::{Placed, fixture::all_shapes},
    };
    use fearless_simd::{Level, dispatch};
    use glam::{Affine3A, Mat3, Quat, Vec3};
    use proptest::prelude::*;

    fn vector(size: f32) -> impl Strategy<Value = Vec3> {
        [-size..size, -size..size, -size..size].prop_map(Vec3::from)
    }

    fn obstacle() -> impl Strategy<Value = Obstacle> {
        let shape = (0usize..7, vector(0.2), vector(0.2), 0.002f32..0.1);
        let motion = proptest::option::of((vector(0.02), vector(0.1)));
        (shape, motion).prop_map(|((which, a, b, radius), motion)| {
            let solid = match which {
                0 => Solid::HalfSpace { normal: b.normalize_or(Vec3::Y), point: a },
                1 => Solid::Capsule { a, b, radius },
                2 => Solid::Cylinder {
                    center: a,
                    axis: b.normalize_or(Vec3::Y),
                    radius,
                    half_height: 2.0 * radius,
                },
                other => Solid::Placed(Placed {
                    shape: all_shapes()[other - 3].clone(),
                    center: a,
                    axes: Mat3::from_quat(Quat::from_scaled_axis(20.0 * b)),
                    scale: 10.0 * radius,
                }),
            };
            let turned = |v: Vec3| Affine3A::from_quat(Quat::from_scaled_axis(v));
            let motion = motion.map(|(way, turn)| Affine3A::from_translation(way) * turned(turn));
            Obstacle { solid, motion, friction: 0.3 }
        })
    }

    proptest! {
        /// No node can reach an obstacle that was left out.
        #[test]
        fn no_obstacle_within_reach_is_left_out(
            obstacles in proptest::collection::vec(obstacle(), 1..80),
            nodes in proptest::collection::vec((vector(0.2), vector(3.0)), 2..6),
            ways in proptest::collection::vec(vector(1.0), 8),
            led in vector(0.05),
        ) {
            let (dt, clearance, length) = (1.0 / 180.0, 1e-3, 0.01);
            let mut b = BlockLanes::default();
            b.resize(nodes.len());
            for (n, (p, v)) in b.nodes.iter_mut().zip(&nodes) {
                n.p = p.to_array().map(|x| [x; LANES]);
                n.v = v.to_array().map(|x| [x; LANES]);
                n.w = [1.0; LANES];
            }
            b.edges.iter_mut().for_each(|e| e.l = [length; LANES]);
            // The root is held; one lane lies elsewhere.
            b.nodes[0].w = [0.0; LANES];
            b.nodes[0].from = (nodes[0].0 - led).to_array().map(|x| [x; LANES]);
            b.nodes[1].p[1][7] += 0.1;
            dispatch!(Level::new(), simd => choose_near(simd, &mut b, dt, clearance, &obstacles));
            for (n, near) in b.nodes.iter().zip(&b.near_obstacles) {
                for lane in [0, 7] {
                    let at = |c: &[[f32; LANES]; 3]| Vec3::from_array(c.map(|c| c[lane]));
                    let (p, v) = (at(&n.p), at(&n.v));
                    let reach = v.length() * dt + length + led.length();
                    for o in obstacles.iter().filter(|o| near.of(&obstacles).all(|n| !core::ptr::eq(n, *o))) {
                        // Also when the node moves with the obstacle.
                        let starts = [p, o.motion.map_or(p, |m| m.transform_point3(p))];
                        for start in starts {
                            for way in &ways {
                                let to = start + way.normalize_or_zero() * reach;
                                let depth = o.solid.depth(V3::new(to.x, to.y, to.z), clearance).1;
                                prop_assert!(depth < 1e-6, "{o:?}: {depth} m deep at {to}");
                            }
                        }
                    }
                }
            }
        }
    }
}
