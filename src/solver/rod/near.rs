//! Which obstacles a node may touch in a substep.

use super::{
    balls::ObstacleBalls,
    block::BlockLanes,
    obstacle::{NearObstacles, Obstacle},
};
use crate::base::lanes::{LANES, Real, V3, lanes_in, load, load3, splat3, store3};
use fearless_simd::{Simd, f32x16, prelude::*};
use glam::Vec3;

/// How far a node may move in a substep, as a multiple of the path by its velocity alone. More than 1,
/// because forces of the substep act too.
pub(crate) const FASTER: f32 = 1.5;

/// How far a node moves before more obstacles than the closest count, in edge lengths, beside its path by its
/// velocity: most nodes go less far in a substep.
const CLOSE: f32 = 0.25;

/// Length within which a strand may be inside from a root that is, as a multiple of the root's depth: it gets out up
/// to 60° aslant.
pub(crate) const ESCAPE_RATIO: f32 = 2.0;

/// Finds the obstacles that each node may touch in a substep of `dt`, so that its passes skip the
/// others: on a head of dozens of solids most nodes are near one or none. Sets `escape_length`. `from` of held
/// nodes must be set.
#[inline(never)]
pub(crate) fn choose_near<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    dt: f32,
    clearance: f32,
    obstacles: &[Obstacle],
) {
    b.escape_length = [0.0; LANES];
    let mut balls = core::mem::take(&mut b.obstacle_balls);
    if obstacles.is_empty() {
        balls.clear();
    } else {
        let whole = simd.vectorize(
            #[inline(always)]
            || ball_around(simd, b),
        );
        ObstacleBalls::collect(&mut balls, obstacles.iter().enumerate(), whole);
    }
    b.obstacle_balls = balls;
    if b.obstacle_balls.is_empty() {
        b.release();
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
                let pulled = load3(simd, &n.p) - load3(simd, &n.from);
                let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
                pull = Real::max(pull, Real::select(held, pulled.dot(pulled), zero));
            }
            let mut edge = zero;
            for e in &b.edges {
                edge = Real::max(edge, load(simd, &e.l));
            }
            let margin = Real::sqrt(pull) + edge + f32x16::splat(simd, clearance);
            let ahead = f32x16::splat(simd, FASTER * dt);
            let each = b.near_obstacles.iter_mut().zip(&mut b.close_obstacles);
            for (n, (near, close)) in b.nodes.iter_mut().zip(each) {
                n.release();
                let (p, v) = (load3(simd, &n.p), load3(simd, &n.v));
                let way = Real::sqrt(v.dot(v)) * ahead;
                let reach = way + margin;
                (*near, close.obstacles) = (NearObstacles::NONE, NearObstacles::NONE);
                let moves = Real::mul_add(edge, f32x16::splat(simd, CLOSE), way);
                let touches = moves + f32x16::splat(simd, clearance);
                // With room for rounding.
                let within = moves * f32x16::splat(simd, 0.99);
                store3(&mut close.place, p);
                (within * within).store_array(&mut close.within);
                // A ball around the node in all lanes excludes most.
                let center = middle(p);
                let off = p - splat3(simd, center);
                let radius = off.dot(off).reduce_max().sqrt() + or_endless(reach).reduce_max();
                let (center, radius) = (splat3(simd, center), f32x16::splat(simd, radius));
                for balls in &b.obstacle_balls {
                    for lane in lanes_in(balls.near(center, radius)) {
                        let index = balls.index[lane];
                        let Some(o) = obstacles.get(index) else { break };
                        let mut reach = reach;
                        if o.motion.is_some() {
                            let moved = o.moved_with(p) - p;
                            reach += Real::sqrt(moved.dot(moved));
                        }
                        if o.solid.is_beyond(p, reach).any_false() {
                            near.add(index);
                            if o.solid.is_beyond(p, touches).any_false() {
                                close.obstacles.add(index);
                            }
                        }
                    }
                }
            }
            let (root, mut deepest) = (load3(simd, &b.nodes[0].p), zero);
            for o in b.near_obstacles[0].of(obstacles) {
                if !o.solid.is_clear(root, clearance) {
                    let depth = o.solid.depth(root, clearance).1;
                    deepest = Real::select(Real::lt(deepest, depth), depth, deepest);
                }
            }
            (deepest * f32x16::splat(simd, ESCAPE_RATIO)).store_array(&mut b.escape_length);
        },
    );
}

/// The mean over all lanes: not finite if one of them is not.
#[inline(always)]
fn middle<S: Simd>(p: V3<f32x16<S>>) -> Vec3 {
    Vec3::new(p.x.reduce_sum(), p.y.reduce_sum(), p.z.reduce_sum()) / LANES as f32
}

/// A ball around all nodes of a block.
#[inline(always)]
fn ball_around<S: Simd>(simd: S, b: &BlockLanes) -> (Vec3, f32) {
    let center = b.nodes.get(b.nodes.len() / 2).map_or(Vec3::ZERO, |n| middle(load3(simd, &n.p)));
    let mut farthest = f32x16::splat(simd, 0.0);
    for n in &b.nodes {
        let off = load3(simd, &n.p) - splat3(simd, center);
        farthest = Real::max(farthest, or_endless(off.dot(off)));
    }
    (center, farthest.reduce_max().sqrt())
}

/// Without an end where it is not finite: a maximum with NaN may be any other number.
#[inline(always)]
fn or_endless<S: Simd>(x: f32x16<S>) -> f32x16<S> {
    let endless = f32x16::splat(x.simd, f32::INFINITY);
    Real::select(Real::lt(x, endless), x, endless)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::rod::{
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

    #[test]
    fn chosen_obstacles_come_in_their_order_and_those_128_apart_share_a_bit() {
        let solid = |i: usize| Solid::Capsule { a: Vec3::X * i as f32, b: Vec3::ZERO, radius: 1.0 };
        let obstacles: Vec<_> =
            (0..300).map(|i| Obstacle { solid: solid(i), motion: None, friction: 0.0 }).collect();
        let mut near = NearObstacles::NONE;
        [130, 1, 127, 299].into_iter().for_each(|i| near.add(i));
        let chosen: Vec<_> = near.of(&obstacles).map(|o| o.solid.clone()).collect();
        let expected = [1, 2, 43, 127, 129, 130, 171, 255, 257, 258, 299];
        assert_eq!(chosen, expected.map(solid));
        assert_eq!(NearObstacles::NONE.of(&obstacles).count(), 0);
        assert_eq!(NearObstacles::ALL.of(&obstacles).count(), 300);
    }

    proptest! {
        /// No node can reach an obstacle that was left out.
        #[test]
        fn no_obstacle_within_reach_is_left_out(
            obstacles in proptest::collection::vec(obstacle(), 1..80),
            nodes in proptest::collection::vec((vector(0.2), vector(3.0)), 2..6),
            ways in proptest::collection::vec(vector(1.0), 8),
            pull in vector(0.05),
            broken in 0usize..4,
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
            b.nodes[0].from = (nodes[0].0 - pull).to_array().map(|x| [x; LANES]);
            b.nodes[1].p[1][7] += 0.1;
            // A strand that is not finite hides no obstacle from others.
            match broken {
                0 => b.nodes[1].p[2][11] = f32::NAN,
                1 => b.nodes[0].v[0][11] = f32::NAN,
                2 => b.nodes[1].v[0][11] = f32::INFINITY,
                _ => {}
            }
            dispatch!(Level::new(), simd => choose_near(simd, &mut b, dt, clearance, &obstacles));
            for (n, close) in b.nodes.iter().zip(&b.close_obstacles) {
                for lane in [0, 7] {
                    let p = Vec3::from_array(close.place.map(|c| c[lane]));
                    prop_assert_eq!(p, Vec3::from_array(n.p.map(|c| c[lane])));
                    let within = close.within[lane].sqrt();
                    prop_assert!(within > 0.2 * length);
                    for o in obstacles.iter().filter(|o| close.obstacles.of(&obstacles).all(|n| !core::ptr::eq(n, *o))) {
                        for way in &ways {
                            let to = p + way.normalize_or_zero() * within;
                            let depth = o.solid.depth(V3::new(to.x, to.y, to.z), clearance).1;
                            prop_assert!(depth < 1e-6, "{o:?}: {depth} m deep at {to}, close by");
                        }
                    }
                }
            }
            for (n, near) in b.nodes.iter().zip(&b.near_obstacles) {
                for lane in [0, 7] {
                    let at = |c: &[[f32; LANES]; 3]| Vec3::from_array(c.map(|c| c[lane]));
                    let (p, v) = (at(&n.p), at(&n.v));
                    let reach = v.length() * dt + length + pull.length();
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
