//! A substep of [`LANES`] mass-spring strands side by side.
//!
//! The springs along a strand are stiff and the masses of its nodes may differ a hundredfold where one
//! carries a droplet. Gauss–Seidel would take as many iterations; so they are solved together, a
//! tridiagonal system like that of the rods' length limiter, with the springs' compliance on its
//! diagonal. The soft ones to the next but one node are solved one by one.
//!
//! Incomplete convergence cannot add energy: a step that would end with more than it began with is
//! shortened, and its speeds with it.

use super::{Springs, model::Xpbd};
use crate::{
    base::lanes::{
        LANES, Lane, Quaternion, Real, V3, dispatch, load, load3, load4, splat, store3, store4,
    },
    solver::rod::{
        block::{BlockLanes, NodeLanes, pulled},
        limiter::{along_support, mobility},
        obstacle::Obstacle,
        touch::{FrictionPass, contacts_with, predict_nodes},
        tridiagonal::{Elimination, back},
    },
};
use fearless_simd::{Level, Simd, f32x16, prelude::*};
use glam::Vec3;

/// How often a step that gains energy is halved before it is rejected.
const HALVINGS: u32 = 8;

/// Largest length of an edge of a touching strand after a step, as a multiple of its rest length.
const TORN: f32 = 1.5;

/// A block of strands with the tensions of their springs.
#[derive(Clone, Debug, Default)]
pub(crate) struct SpringLanes {
    pub strands: BlockLanes,
    tensions: Vec<Tensions>,
}

/// Tension of the springs that begin at a node; see [`Xpbd`].
#[derive(Clone, Copy, Debug, Default)]
struct Tensions {
    next: Lane,
    over: Lane,
}

/// Parameters of a substep.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SpringParams {
    pub dt: f32,
    pub springs: Springs,
    /// Gravity (m/s²). Velocities already contain it; used for the energy balance.
    pub gravity: Vec3,
    /// Distance that nodes keep from obstacles (m).
    pub clearance: f32,
}

/// Steps the block by one substep, with the machine's best instruction set. Node 0 of every
/// strand must be held.
pub(crate) fn step(
    level: Level,
    block: &mut SpringLanes,
    params: &SpringParams,
    obstacles: &[Obstacle],
) {
    block.tensions.clear();
    block.tensions.resize(block.strands.edges.len(), Tensions::default());
    let SpringLanes { strands, tensions } = block;
    dispatch!(level, simd => step_simd(simd, strands, tensions, params, obstacles));
}

#[inline(always)]
fn step_simd<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    tensions: &mut [Tensions],
    params: &SpringParams,
    obstacles: &[Obstacle],
) {
    let Springs { stretch, bend, damping, iterations } = params.springs;
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let next = Xpbd::new(zero, stretch, damping, params.dt);
    let over = Xpbd::new(zero, bend, damping, params.dt);
    let zero = f32x16::splat(simd, 0.0);
    b.choose_obstacles(obstacles, params.dt, params.clearance);
    predict_nodes(simd, b, f32x16::splat(simd, params.dt), None, params.clearance, obstacles);
    b.touched = [0.0; LANES];
    b.nodes.iter_mut().for_each(NodeLanes::release);
    // Strands that are moved by held nodes may gain energy from them.
    let mut moved = zero;
    for n in &b.nodes {
        let v = load3(simd, &n.v);
        let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
        let pulled = Real::select(held, v.dot(v), zero);
        moved = Real::select(Real::lt(zero, pulled), one, moved);
    }
    let mut in_touch = false;
    for _ in 0..iterations {
        if bend > 0.0 {
            solve_over(simd, b, tensions, over);
        }
        if b.touched == [0.0; LANES] {
            solve_next::<S, false>(simd, b, tensions, next);
        } else {
            solve_next::<S, true>(simd, b, tensions, next);
        }
        contacts_with(simd, b, params.clearance, obstacles, FrictionPass::Summed, one);
        moved = Real::max(moved, load(simd, &b.touched));
        in_touch |= b.touched != [0.0; LANES];
    }
    if in_touch {
        shorten_overstretched(simd, b);
    }
    keep_energy(simd, b, params, Real::lt(moved, one));
    turn_edges(simd, b);
}

/// The direction from one node to another and the distance between them; a zero direction where they
/// coincide.
#[inline(always)]
fn span<S: Simd>(from: V3<f32x16<S>>, to: V3<f32x16<S>>) -> (V3<f32x16<S>>, f32x16<S>) {
    let d = to - from;
    let length = Real::sqrt(d.dot(d));
    (d.scale(length.lit(1.0) / Real::max(length, length.lit(1e-12))), length)
}

/// A node's position, and its displacement in this step.
#[inline(always)]
fn place<S: Simd>(simd: S, n: &NodeLanes) -> (V3<f32x16<S>>, V3<f32x16<S>>) {
    let p = load3(simd, &n.p);
    (p, p - load3(simd, &n.from))
}

/// Shortens overstretched edges to [`TORN`] times their length, from the root on and without
/// changing velocities. Springs press a node on the far side of an obstacle against it, and
/// friction would hold it there for ever.
#[inline(never)]
fn shorten_overstretched<S: Simd>(simd: S, b: &mut BlockLanes) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = f32x16::splat(simd, 0.0);
            let mut a = load3(simd, &b.nodes[0].p);
            for (edge, n) in b.edges.iter().zip(&mut b.nodes[1..]) {
                let c = load3(simd, &n.p);
                let (u, distance) = span(a, c);
                let most = load(simd, &edge.l) * TORN;
                let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
                let back = Real::select(held, zero, Real::min(most - distance, zero));
                a = u.scale_add(back, c);
                store3(&mut n.p, a);
                let from = u.scale_add(back, load3(simd, &n.from));
                store3(&mut n.from, from);
            }
        },
    );
}

/// The springs to the next but one node, one after the other from the root on.
#[inline(never)]
fn solve_over<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    tensions: &mut [Tensions],
    spring: Xpbd<f32x16<S>>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            for i in 1..b.edges.len() {
                let length = load(simd, &b.edges[i - 1].l) + load(simd, &b.edges[i].l);
                let ((a, moved_a), (c, moved_c)) =
                    (place(simd, &b.nodes[i - 1]), place(simd, &b.nodes[i + 1]));
                let (wa, wc) = (load(simd, &b.nodes[i - 1].w), load(simd, &b.nodes[i + 1].w));
                let (u, distance) = span(a, c);
                let held = &mut tensions[i - 1].over;
                let tension = load(simd, held);
                let excess = spring.excess(distance - length, (moved_c - moved_a).dot(u), tension);
                let more = excess / (wa + wc + spring.compliance);
                (tension + more).store_array(held);
                store3(&mut b.nodes[i - 1].p, u.scale_add(wa * more, a));
                store3(&mut b.nodes[i + 1].p, u.scale_add(-(wc * more), c));
            }
        },
    );
}

/// One Newton step on all springs along the strand at once: (J W Jᵀ + compliance) Δλ = excess, by the
/// Thomas algorithm. `TOUCHING` respects obstacles, as the rods' limiter does: a node that rests on one
/// moves along it, or off it.
#[inline(never)]
fn solve_next<S: Simd, const TOUCHING: bool>(
    simd: S,
    b: &mut BlockLanes,
    tensions: &mut [Tensions],
    spring: Xpbd<f32x16<S>>,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let [zero, least] = [0.0, 1e-30].map(|value| f32x16::splat(simd, value));
            let none = V3::new(zero, zero, zero);
            let (mut a, mut moved_a) = place(simd, &b.nodes[0]);
            let (mut before, mut rows) = (none, Elimination::new(zero));
            for (i, tension) in tensions.iter().enumerate() {
                let (c, moved_c) = place(simd, &b.nodes[i + 1]);
                let (u, distance) = span(a, c);
                let stretch = distance - load(simd, &b.edges[i].l);
                let excess =
                    spring.excess(stretch, (moved_c - moved_a).dot(u), load(simd, &tension.next));
                // Neighbouring springs share a node: −u·W u′.
                let coupling = -mobility::<S, TOUCHING>(simd, b, i, before, u);
                let diagonal = mobility::<S, TOUCHING>(simd, b, i, u, u)
                    + mobility::<S, TOUCHING>(simd, b, i + 1, u, u)
                    + spring.compliance;
                let upper = rows.row(coupling, diagonal, excess, least);
                if i > 0 {
                    upper.store_array(&mut b.scratch[i - 1].upper);
                }
                let row = &mut b.scratch[i];
                store3(&mut row.direction, u);
                zero.store_array(&mut row.upper);
                rows.rhs.store_array(&mut row.rhs);
                (a, moved_a, before) = (c, moved_c, u);
            }
            let (mut more, mut pull) = (zero, none);
            for (i, held) in tensions.iter_mut().enumerate().rev() {
                let row = &b.scratch[i];
                more = back(load(simd, &row.rhs), load(simd, &row.upper), more);
                let tension = load3(simd, &row.direction).scale(more);
                (load(simd, &held.next) + more).store_array(&mut held.next);
                let n = &mut b.nodes[i + 1];
                let mut force = pull - tension;
                if TOUCHING {
                    force = along_support(simd, n, false, force);
                }
                let p = force.scale_add(load(simd, &n.w), load3(simd, &n.p));
                store3(&mut n.p, p);
                pull = tension;
            }
        },
    );
}

/// Velocities from the change in the step. Where `alone` holds, only gravity added energy: a step that
/// ends with more than it began with is halved until it does not, then slowed down.
#[inline(never)]
fn keep_energy<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    params: &SpringParams,
    alone: <f32x16<S> as Real>::Mask,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
            let half = f32x16::splat(simd, 0.5);
            let gravity = splat(zero, params.gravity);
            let pull = splat(zero, params.gravity * -params.dt);
            let mut before = stored::<S, true>(simd, b, params);
            for (i, n) in b.nodes.iter().enumerate() {
                let v = load3(simd, &n.v) + pulled(simd, &b.gravity, i, pull);
                before += half * mass(simd, n) * v.dot(v);
            }
            let mut left = left_of(simd, b, params, gravity, before);
            for halved in 0..=HALVINGS {
                let shorten = Real::select(alone, left, zero);
                let gains = Real::lt(shorten, zero);
                if gains.to_bitmask() == 0 {
                    break;
                }
                let scale = Real::select(gains, if halved < HALVINGS { half } else { zero }, one);
                for n in &mut b.nodes {
                    let (p, moved) = place(simd, n);
                    let shorter = moved.scale_add(scale, load3(simd, &n.from));
                    store3(&mut n.p, V3::select(gains, shorter, p));
                }
                left = left_of(simd, b, params, gravity, before);
            }
            let rate = f32x16::splat(simd, 1.0 / params.dt);
            let mut moving = zero;
            for n in &b.nodes {
                let (_, moved) = place(simd, n);
                moving += half * mass(simd, n) * (rate * rate) * moved.dot(moved);
            }
            let slower =
                Real::sqrt(Real::max(left, zero) / Real::max(moving, f32x16::splat(simd, 1e-30)));
            let slower = Real::select(alone, Real::min(slower, one), one);
            let mut sum = zero;
            for n in &mut b.nodes {
                let (_, moved) = place(simd, n);
                let v = moved.scale(rate * slower);
                store3(&mut n.v, v);
                sum += v.dot(v);
            }
            (sum * zero).store_array(&mut b.finite);
        },
    );
}

/// The kinetic energy available: `before` and the work of gravity, less what the springs store now.
#[inline(always)]
fn left_of<S: Simd>(
    simd: S,
    b: &BlockLanes,
    params: &SpringParams,
    gravity: V3<f32x16<S>>,
    before: f32x16<S>,
) -> f32x16<S> {
    let mut left = before - stored::<S, false>(simd, b, params);
    for (i, n) in b.nodes.iter().enumerate() {
        let (_, moved) = place(simd, n);
        left += mass(simd, n) * pulled(simd, &b.gravity, i, gravity).dot(moved);
    }
    left
}

/// A node's mass; 0 where it is held, because it takes no part in the energy balance.
#[inline(always)]
fn mass<S: Simd>(simd: S, n: &NodeLanes) -> f32x16<S> {
    let w = load(simd, &n.w);
    let tiny = f32x16::splat(simd, 1e-12);
    Real::select(Real::lt(w, tiny), f32x16::splat(simd, 0.0), w.lit(1.0) / Real::max(w, tiny))
}

/// Energy of the springs, per mass of a node (J/kg); with `FROM` at the start of the step.
#[inline(always)]
fn stored<S: Simd, const FROM: bool>(simd: S, b: &BlockLanes, params: &SpringParams) -> f32x16<S> {
    let (mut next, mut over) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 0.0));
    let mut length_before = next;
    for i in 0..b.edges.len() {
        let length = load(simd, &b.edges[i].l);
        let c = at::<S, FROM>(simd, &b.nodes[i + 1]);
        let (_, distance) = span(at::<S, FROM>(simd, &b.nodes[i]), c);
        let x = distance - length;
        next += x * x;
        if i > 0 {
            let (_, distance) = span(at::<S, FROM>(simd, &b.nodes[i - 1]), c);
            let x = distance - length - length_before;
            over += x * x;
        }
        length_before = length;
    }
    let Springs { stretch, bend, .. } = params.springs;
    next * f32x16::splat(simd, 0.5 * stretch) + over * f32x16::splat(simd, 0.5 * bend)
}

#[inline(always)]
fn at<S: Simd, const FROM: bool>(simd: S, n: &NodeLanes) -> V3<f32x16<S>> {
    load3(simd, if FROM { &n.from } else { &n.p })
}

/// Springs have no orientations: frames follow the edges by the shortest rotation.
#[inline(always)]
fn turn_edges<S: Simd>(simd: S, b: &mut BlockLanes) {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let still = V3::new(zero, zero, zero);
    // An edge that has reversed rotates about its own first axis.
    let half_turn = Quaternion::new(V3::new(one, zero, zero), zero);
    let mut sum = zero;
    for i in 0..b.edges.len() {
        let (to, length) = span(load3(simd, &b.nodes[i].p), load3(simd, &b.nodes[i + 1].p));
        let e = &mut b.edges[i];
        let q = load4(simd, &e.q);
        let tangent = q.tangent();
        let arc = Quaternion::new(tangent.cross(to), one + tangent.dot(to));
        let turned = arc.product(q);
        let round = q.product(half_turn);
        let opposite = Real::lt(turned.dot(turned), f32x16::splat(simd, 1e-8));
        let turned = select(opposite, round, turned).normalize();
        let nowhere = Real::lt(length, f32x16::splat(simd, 1e-12));
        let turned = select(nowhere, q, turned);
        sum += turned.dot(turned);
        store4(&mut e.q, turned);
        store3(&mut e.omega, still);
    }
    (load(simd, &b.finite) + sum * zero).store_array(&mut b.finite);
}

#[inline(always)]
fn select<R: Real>(mask: R::Mask, yes: Quaternion<R>, no: Quaternion<R>) -> Quaternion<R> {
    Quaternion::new(V3::select(mask, yes.v, no.v), R::select(mask, yes.w, no.w))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        base::lanes::{put3, put4, take3},
        solver::rod::obstacle::Solid,
    };
    use glam::Quat;
    use proptest::prelude::*;

    const G: Vec3 = Vec3::new(0.0, -9.8, 0.0);

    fn params(springs: Springs, gravity: Vec3, rate: f32) -> SpringParams {
        SpringParams { dt: 1.0 / rate, springs, gravity, clearance: 0.0 }
    }

    /// Sixteen strands with edges of 3 cm, held at the root.
    fn block(nodes: usize, place: impl Fn(usize, usize) -> (Vec3, Vec3)) -> SpringLanes {
        let mut block = SpringLanes::default();
        block.strands.resize(nodes);
        for lane in 0..LANES {
            for (i, n) in block.strands.nodes.iter_mut().enumerate() {
                let (p, v) = place(lane, i);
                put3(&mut n.p, lane, p);
                put3(&mut n.from, lane, p);
                put3(&mut n.v, lane, if i == 0 { Vec3::ZERO } else { v });
                n.w[lane] = if i == 0 { 0.0 } else { 1.0 };
            }
            for e in &mut block.strands.edges {
                put4(&mut e.q, lane, Quat::IDENTITY);
                e.l[lane] = 0.03;
            }
        }
        block
    }

    /// A step on C with compliance α̃ and inverse masses w leaves α̃/(Σ w + α̃) of C, and moves the ends by
    /// their shares of the rest (Macklin, Müller, Chentanez 2016, equation 18).
    #[test]
    fn a_bending_spring_moves_its_ends_by_their_inverse_masses() {
        let mut block = block(3, |_, i| (Vec3::X * (0.033 * i as f32), Vec3::ZERO));
        let (masses, dt) = ([0.7, 1.0, 2.0], 1.0 / 360.0);
        for (n, w) in block.strands.nodes.iter_mut().zip(masses) {
            n.w = [w; LANES];
        }
        let spring = Xpbd::new(0.0_f64, 1e5, 0.0, dt);
        dispatch!(Level::new(), simd => {
            let spring = Xpbd::new(f32x16::splat(simd, 0.0), 1e5, 0.0, dt);
            let SpringLanes { strands, tensions } = &mut block;
            tensions.clear();
            tensions.resize_with(2, Default::default);
            solve_over(simd, strands, tensions, spring);
        });
        let at = |i: usize| f64::from(take3(&block.strands.nodes[i].p, 5).x);
        let sum = f64::from(masses[0] + masses[2]) + spring.compliance;
        let more = 0.006 / sum;
        assert!((at(0) - 0.7 * more).abs() < 1e-7, "{}", at(0));
        assert!((0.066 - at(2) - 2.0 * more).abs() < 1e-7, "{}", at(2));
        assert_eq!(take3(&block.strands.nodes[1].p, 5).x, 0.033);
        assert!((f64::from(block.tensions[0].over[5]) - more).abs() < 1e-7);
    }

    fn advance(block: &mut SpringLanes, params: &SpringParams, drag: f32) {
        advance_on(block, params, drag, &[]);
    }

    fn advance_on(
        block: &mut SpringLanes,
        params: &SpringParams,
        drag: f32,
        obstacles: &[Obstacle],
    ) {
        for n in &mut block.strands.nodes[1..] {
            for lane in 0..LANES {
                let v = take3(&n.v, lane) * drag + params.gravity * params.dt;
                put3(&mut n.v, lane, v);
            }
        }
        step(Level::new(), block, params, obstacles);
        assert_eq!(block.strands.finite, [0.0; LANES]);
    }

    fn energy(block: &SpringLanes, lane: usize, springs: &Springs, gravity: Vec3) -> f64 {
        let b = &block.strands;
        let p: Vec<Vec3> = b.nodes.iter().map(|n| take3(&n.p, lane)).collect();
        let moving: f64 = (b.nodes[1..].iter())
            .map(|n| 0.5 * take3(&n.v, lane).length_squared() - gravity.dot(take3(&n.p, lane)))
            .map(f64::from)
            .sum();
        let spring = |a: Vec3, b: Vec3, l: f32, k: f32| {
            let x = f64::from(a.distance(b) - l);
            0.5 * f64::from(k) * x * x
        };
        let next: f64 = p.windows(2).map(|w| spring(w[0], w[1], 0.03, springs.stretch)).sum();
        let over: f64 = p.windows(3).map(|w| spring(w[0], w[2], 0.06, springs.bend)).sum();
        moving + next + over
    }

    #[test]
    fn a_hanging_spring_stretches_by_its_load() {
        let springs = Springs { stretch: 1e5, ..Springs::default() };
        let mut block = block(9, |_, i| (Vec3::NEG_Y * (0.03 * i as f32), Vec3::ZERO));
        for _ in 0..3000 {
            advance(&mut block, &params(springs, G, 360.0), 0.99);
        }
        // Eight masses hang on the first spring; the long ones beside it carry a tenth of it.
        let p = |i: usize| take3(&block.strands.nodes[i].p, 3);
        let stretch = p(0).distance(p(1)) - 0.03;
        let expected = 8.0 * 9.8 / 1e5;
        assert!(stretch > 0.7 * expected && stretch < expected, "{stretch} {expected}");
        assert!(block.strands.nodes.iter().all(|n| take3(&n.v, 3).length() < 1e-2));
    }

    #[test]
    fn a_swing_at_sixty_hertz_never_rises_above_its_start() {
        for stretch in [1e4, 1e6, 1e9] {
            let springs = Springs { stretch, damping: 0.0, ..Springs::default() };
            let mut block = block(9, |_, i| (Vec3::X * (0.03 * i as f32), Vec3::ZERO));
            let mut lowest = 0.0_f32;
            for i in 0..1200 {
                advance(&mut block, &params(springs, G, 60.0), 1.0);
                let now = energy(&block, 0, &springs, G);
                // It falls by 10.6 J/kg.
                assert!(now < 0.01, "{stretch} {i}: {now}");
                lowest = lowest.min(take3(&block.strands.nodes[8].p, 0).y);
            }
            assert!(lowest < -0.2, "it swings: {lowest}");
        }
    }

    #[test]
    fn a_drop_a_hundred_times_as_heavy_stretches_no_more_than_its_weight() {
        let springs = Springs { stretch: 1e6, ..Springs::default() };
        let mut block = block(6, |_, i| (Vec3::X * (0.03 * i as f32), Vec3::ZERO));
        block.strands.nodes[4].w = [0.01; LANES];
        let peak = peak_strain(&mut block, springs, &[]);
        // At the bottom of its swing it weighs three times as much.
        let expected = 3.0 * 104.0 * 9.8 / springs.stretch / 0.03;
        assert!(peak < 1.2 * expected, "{peak} {expected}");
    }

    #[test]
    fn a_heavy_drop_on_a_strand_over_a_head_does_not_tear_it() {
        let mut block = block(6, |_, i| (Vec3::new(0.03 * i as f32, 0.091, 0.0), Vec3::ZERO));
        block.strands.nodes[5].w = [0.01; LANES];
        let head = Solid::Capsule { a: Vec3::ZERO, b: Vec3::ZERO, radius: 0.09 };
        let head = Obstacle { solid: head, motion: None, friction: 0.2 };
        let peak = peak_strain(&mut block, Springs::default(), &[head]);
        assert!(peak < 0.05, "{peak}");
    }

    #[test]
    fn a_strand_overstretched_across_a_head_comes_back() {
        // All but the root are on the far side, where the springs press them on the head.
        let far = |i: usize| Vec3::new(0.0, -0.091 - 0.03 * i as f32, 0.0);
        let at = |i| if i == 0 { Vec3::Y * 0.091 } else { far(i) };
        let mut block = block(9, |_, i| (at(i), Vec3::ZERO));
        let head = Solid::Capsule { a: Vec3::ZERO, b: Vec3::ZERO, radius: 0.09 };
        let head = Obstacle { solid: head, motion: None, friction: 0.3 };
        peak_strain(&mut block, Springs::default(), &[head]);
        let strain =
            |pair: &[NodeLanes]| take3(&pair[0].p, 0).distance(take3(&pair[1].p, 0)) / 0.03 - 1.0;
        let most = block.strands.nodes.windows(2).map(strain).fold(0.0, f32::max);
        assert!(most < 0.05, "{most}");
    }

    #[test]
    fn what_lies_on_a_head_is_held_by_friction_and_creeps_no_further() {
        // Each leans away from the vertical plane in which it would lie without friction.
        let direction = |lane: usize| {
            let (y, turn) = (0.3 + 0.04 * lane as f32, 2.4 * lane as f32);
            let across = (1.0_f32 - y * y).sqrt();
            Vec3::new(across * turn.cos(), y, across * turn.sin())
        };
        let lean = Vec3::new(0.4, 0.0, 0.2);
        let edge = |lane: usize| (direction(lane) + lean).normalize() * 0.03;
        let at = |lane, i| (direction(lane) * 0.2 + edge(lane) * i as f32, Vec3::ZERO);
        let mut block = block(8, at);
        let head = Solid::Capsule { a: Vec3::ZERO, b: Vec3::ZERO, radius: 0.2 };
        let head = Obstacle { solid: head, motion: None, friction: 0.3 };
        let places = |block: &SpringLanes| -> Vec<Vec3> {
            let nodes = block.strands.nodes.iter();
            nodes.flat_map(|n| (0..LANES).map(|lane| take3(&n.p, lane))).collect()
        };
        let params = params(Springs::default(), G, 360.0);
        let mut run = |substeps: usize| {
            (0..substeps)
                .for_each(|_| advance_on(&mut block, &params, 0.995, std::slice::from_ref(&head)));
            places(&block)
        };
        let (before, after) = (run(4 * 360), run(180));
        // The last one that lies on it moves with what swings below.
        let lies = |k: &usize| (0..2).all(|next| before[k + next * LANES].length() < 0.2 + 1e-5);
        let lying: Vec<usize> = (0..7 * LANES).filter(lies).collect();
        assert!(lying.len() > 4 * LANES, "{} nodes lie on it", lying.len());
        let most = lying.iter().map(|k| before[*k].distance(after[*k])).fold(0.0, f32::max);
        assert!(most < 1e-6, "{most} m in half a second");
    }

    #[test]
    fn a_strand_across_a_slope_slips_where_friction_is_less_than_its_tangent() {
        let normal = Vec3::new(0.0, 1.0, 0.2).normalize();
        let slips = |friction: f32| {
            let mut block = block(8, |_, i| (Vec3::X * (0.03 * i as f32), Vec3::ZERO));
            let solid = Solid::HalfSpace { normal, point: Vec3::ZERO };
            let slope = Obstacle { solid, motion: None, friction };
            let params = params(Springs::default(), G, 360.0);
            (0..360)
                .for_each(|_| advance_on(&mut block, &params, 1.0, std::slice::from_ref(&slope)));
            take3(&block.strands.nodes[7].p, 3).distance(Vec3::X * 0.21)
        };
        let (holds, slides) = (slips(0.205), slips(0.19));
        assert!(holds < 1e-6 && slides > 0.02, "{holds} {slides}");
    }

    fn peak_strain(block: &mut SpringLanes, springs: Springs, obstacles: &[Obstacle]) -> f32 {
        let mut peak = 0.0_f32;
        for _ in 0..480 {
            advance_on(block, &params(springs, G, 240.0), 0.99, obstacles);
            for pair in block.strands.nodes.windows(2) {
                let length = take3(&pair[0].p, 0).distance(take3(&pair[1].p, 0));
                peak = peak.max((length / 0.03 - 1.0).abs());
            }
        }
        peak
    }

    #[test]
    fn frames_follow_their_edges_even_when_these_reverse() {
        let mut block = block(3, |lane, i| {
            let tip = [Vec3::X, Vec3::Z, Vec3::NEG_Z][lane % 3];
            (tip * (0.03 * i as f32), Vec3::ZERO)
        });
        step(Level::new(), &mut block, &params(Springs::default(), Vec3::ZERO, 240.0), &[]);
        for lane in 0..LANES {
            let q = crate::base::lanes::take4(&block.strands.edges[1].q, lane);
            let to = [Vec3::X, Vec3::Z, Vec3::NEG_Z][lane % 3];
            assert!((q * Vec3::Z).distance(to) < 1e-5 && q.is_normalized(), "{lane}: {q}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(100))]
        #[test]
        fn energy_never_grows_without_input(
            shape in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), 12 * LANES),
            speeds in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), 12 * LANES),
            rate in prop_oneof![Just(60.0f32), Just(120.0), Just(360.0)],
            stretch in 3.0f32..8.0,
            bend in 0.0f32..7.0,
            damping in 0.0f32..100.0,
        ) {
            let springs = Springs {
                stretch: 10f32.powf(stretch), bend: 10f32.powf(bend), damping, ..Springs::default()
            };
            let vector = |&(x, y, z): &(f32, f32, f32)| Vec3::new(x, y, z);
            let mut block = block(12, |lane, i| {
                let strand = &shape[12 * lane..][..i];
                let edge = |s| (vector(s) + Vec3::NEG_Y * 1.1).normalize() * 0.031;
                (strand.iter().map(edge).sum(), vector(&speeds[12 * lane + i]))
            });
            let mut before: [f64; LANES] =
                core::array::from_fn(|lane| energy(&block, lane, &springs, Vec3::ZERO));
            let scale = before.map(|e| e.max(1.0));
            for i in 0..240 {
                advance(&mut block, &params(springs, Vec3::ZERO, rate), 1.0);
                for lane in 0..LANES {
                    let now = energy(&block, lane, &springs, Vec3::ZERO);
                    prop_assert!(
                        now <= before[lane] + 1e-3 * scale[lane], "step {i}: {} to {now}", before[lane]
                    );
                    before[lane] = now;
                }
            }
        }
    }
}
