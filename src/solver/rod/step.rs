//! One substep of a block.
//!
//! Order (\[B\] §2 with model notes): predict positions and orientations, project stretch–shear,
//! bend–twist and contacts `iterations` times from root to tip, limit lengths, a last contact pass,
//! then velocities from the change.

use super::{
    block::BlockLanes,
    constraint::StretchProjection,
    limiter::limit_lengths,
    obstacle::Obstacle,
    stiffness::Sweeps,
    sweep::project,
    touch::{contacts, predict_nodes},
};
use crate::base::lanes::{LANES, Real, dispatch, load, load3, load4, store3, store4};
use fearless_simd::{Level, Simd, f32x16, prelude::*};

/// Passes that a limiter step takes for strands that touch something.
pub(crate) const PASSES_IN_TOUCH: u32 = 3;

/// Parameters of a substep.
#[derive(Clone, Copy, Debug)]
pub struct SweepParams {
    /// Substep (s).
    pub dt: f32,
    /// Iterations of the projection.
    pub iterations: u32,
    /// How stretch–shear is projected.
    pub projection: StretchProjection,
    /// Newton steps of the length limiter; 0 turns it off.
    pub limiter_steps: u32,
    /// Damping of neighbouring edges' relative angular velocity (1/s).
    pub internal_damping: f32,
    /// Distance that nodes keep from obstacles (m).
    pub clearance: f32,
}

/// Steps the block by one substep, with the machine's best instruction set.
pub fn step(level: Level, block: &mut BlockLanes, params: &SweepParams, obstacles: &[Obstacle]) {
    dispatch!(level, simd => step_simd(simd, block, params, obstacles));
}

#[inline(always)]
fn step_simd<S: Simd>(simd: S, b: &mut BlockLanes, params: &SweepParams, obstacles: &[Obstacle]) {
    b.choose_obstacles(obstacles, params.dt, params.clearance);
    predict_nodes(simd, b, f32x16::splat(simd, params.dt), None, params.clearance, obstacles);
    predict_edges(simd, b, params.dt);
    // The projection is chosen outside the loops, so that these have no branches.
    match params.projection {
        StretchProjection::Split => {
            project::<S, 0>(simd, b, params.iterations, params.clearance, obstacles);
        }
        StretchProjection::Coupled => {
            project::<S, 1>(simd, b, params.iterations, params.clearance, obstacles);
        }
        StretchProjection::Printed => {
            project::<S, 2>(simd, b, params.iterations, params.clearance, obstacles);
        }
    }
    for _ in 0..params.limiter_steps {
        limit_lengths(simd, b, false);
        contacts(simd, b, params.clearance, obstacles);
        // Hair pressed on a surface has to fold; each pass can fold it further.
        for _ in 1..PASSES_IN_TOUCH {
            if b.touched != [0.0; LANES] {
                limit_lengths(simd, b, true);
                contacts(simd, b, params.clearance, obstacles);
            }
        }
    }
    velocities(simd, b, params);
}

/// Converts gathered masses (in dry nodes) to inverse masses and, with the sweeps' settings and the
/// gravity-bending length, computes the inverse rotational masses of the edges.
pub fn weigh(level: Level, block: &mut BlockLanes, stiffness: Option<(&Sweeps, f32)>) {
    dispatch!(level, simd => weigh_simd(simd, block, stiffness));
}

#[inline(always)]
fn weigh_simd<S: Simd>(simd: S, b: &mut BlockLanes, stiffness: Option<(&Sweeps, f32)>) {
    let (zero, two) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 2.0));
    let mut sum = zero;
    for e in &b.edges {
        sum += load(simd, &e.l);
    }
    let mean = sum / f32x16::splat(simd, b.edges.len() as f32);
    let mut before = zero;
    for (i, n) in b.nodes.iter_mut().enumerate() {
        let mut after = zero;
        if let Some(e) = b.edges.get_mut(i) {
            after = load(simd, &e.l);
            if let Some((sweeps, bending_length)) = stiffness {
                sweeps.rotational_weight(bending_length, after, mean).store_array(&mut e.wq);
            }
        }
        // Half a cell on either side, so the tip carries half a mass.
        let mass = load(simd, &n.w);
        let held = Real::lt(mass, f32x16::splat(simd, 1e-12));
        let w = two * mean / ((before + after) * mass);
        Real::select(held, zero, w).store_array(&mut n.w);
        before = after;
    }
}

/// The share of their relative angular velocity that neighbouring edges exchange in a substep of `dt` (s),
/// by the damping (1/s).
pub(crate) fn spin_exchange(internal_damping: f32, dt: f32) -> f32 {
    0.5 * (1.0 - bevy::math::ops::exp(-internal_damping * dt))
}

/// Predicts orientations from angular velocities: without, a strand is overdamped and never settles.
#[inline(always)]
fn predict_edges<S: Simd>(simd: S, b: &mut BlockLanes, dt: f32) {
    let half = f32x16::splat(simd, 0.5 * dt);
    for e in &mut b.edges {
        let q = load4(simd, &e.q);
        let turn = q.after_vector(load3(simd, &e.omega));
        store4(&mut e.from, q);
        store4(&mut e.q, q.add_scaled(turn, half).normalize());
    }
}

/// Velocities from the change in the step, the joints' damping, and the finiteness check.
#[inline(always)]
fn velocities<S: Simd>(simd: S, b: &mut BlockLanes, params: &SweepParams) {
    let rate = f32x16::splat(simd, 1.0 / params.dt);
    let zero = f32x16::splat(simd, 0.0);
    let mut sum = zero;
    for n in &mut b.nodes {
        let v = (load3(simd, &n.p) - load3(simd, &n.from)).scale(rate);
        store3(&mut n.v, v);
        sum += v.dot(v);
    }
    let double = rate + rate;
    for e in &mut b.edges {
        let q = load4(simd, &e.q).normalize();
        store4(&mut e.q, q);
        let change = q.product(load4(simd, &e.from).conjugate());
        let sign = Real::select(Real::lt(change.w, zero), -double, double);
        let omega = change.v.scale(sign);
        store3(&mut e.omega, omega);
        sum += omega.dot(omega);
    }
    if params.internal_damping > 0.0 {
        let exchange = f32x16::splat(simd, spin_exchange(params.internal_damping, params.dt));
        for i in 1..b.edges.len() {
            let (a, c) = (load3(simd, &b.edges[i - 1].omega), load3(simd, &b.edges[i].omega));
            let d = (c - a).scale(exchange);
            store3(&mut b.edges[i - 1].omega, a + d);
            store3(&mut b.edges[i].omega, c - d);
        }
    }
    (sum * zero).store_array(&mut b.finite);
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::base::lanes::{LANES, put4, take3};
    use glam::{Quat, Vec3};

    #[test]
    fn neighbours_lose_their_relative_spin_at_the_given_rate() {
        let (dt, damping) = (1.0 / 360.0, 20.0);
        let spins = |internal_damping: f32| -> [Vec3; 2] {
            let mut b = BlockLanes::default();
            b.resize(3);
            for (e, angle) in b.edges.iter_mut().zip([0.01, -0.03]) {
                for lane in 0..LANES {
                    put4(&mut e.from, lane, Quat::IDENTITY);
                    put4(&mut e.q, lane, Quat::from_rotation_x(angle));
                }
            }
            let params = SweepParams {
                dt,
                iterations: 0,
                projection: StretchProjection::Split,
                limiter_steps: 0,
                internal_damping,
                clearance: 0.0,
            };
            dispatch!(Level::new(), simd => velocities(simd, &mut b, &params));
            [take3(&b.edges[0].omega, 3), take3(&b.edges[1].omega, 3)]
        };
        let ([a, b], [c, d]) = (spins(0.0), spins(damping));
        assert!((a.x * dt - 0.01).abs() < 1e-4 && (b.x * dt + 0.03).abs() < 1e-4);
        let left = (-damping * dt).exp();
        assert!(((d - c).x / (b - a).x / left - 1.0).abs() < 1e-4, "{} {}", c.x, d.x);
        assert!((c + d - a - b).length() < 1e-3, "what they have in common stays");
    }
}
