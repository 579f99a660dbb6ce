//! The default solver: one direct implicit step of a whole strand per substep.

mod kernel;
mod matrix;
pub(crate) mod width;

use super::{
    algebra::V3,
    block::{BlockLanes, Lane, load, load3, store3},
    lanes::{LANES, Real, splat3},
    limiter::limit_strained,
    obstacle::Obstacle,
    step::{Grip, contacts, contacts_with, predict_nodes},
};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};
use glam::Vec3;
pub(crate) use kernel::Row;
use kernel::{HOLD, Stage, down, finish, untwist, up};
use width::Whole;

/// What a substep does to a block.
#[derive(Clone, Copy, Debug)]
pub struct DirectParams {
    /// Substep (s).
    pub dt: f32,
    /// Gravity, in the frame of the positions (m/s²).
    pub gravity: Vec3,
    /// θ
    pub theta: f32,
    /// Kelvin–Voigt time (s).
    pub damping: f32,
    /// Newton steps of the length limiter.
    pub limiter_steps: u32,
    /// Distance that nodes keep from obstacles (m).
    pub skin: f32,
}

/// Takes the block through one substep, on the instruction set that the machine has.
pub fn step(level: Level, block: &mut BlockLanes, params: &DirectParams, obstacles: &[Obstacle]) {
    dispatch!(level, simd => step_simd(simd, block, params, obstacles));
}

#[inline(always)]
fn step_simd<S: Simd>(simd: S, b: &mut BlockLanes, params: &DirectParams, obstacles: &[Obstacle]) {
    let w = Whole(simd);
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let dt = f32x16::splat(simd, params.dt);
    let mut theta = f32x16::splat(simd, params.theta);
    predict(simd, b, dt * theta, params, obstacles);
    if b.touched != [0.0; LANES] {
        let touched = Real::lt(zero, load(simd, &b.touched));
        theta = Real::select(touched, one, theta);
        for n in &mut b.nodes {
            let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
            let back = V3::select(held, load3(simd, &n.p), load3(simd, &n.from));
            store3(&mut n.p, back);
        }
        predict(simd, b, dt * theta, params, obstacles);
    }
    let fall = splat3(simd, params.gravity).scale(dt * dt * theta * theta);
    for n in &mut b.nodes {
        let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
        let (from, p, support) = (load3(simd, &n.from), load3(simd, &n.p), load3(simd, &n.rests_on));
        let on_the_way = (p - from).scale_add(theta, from);
        let rests = Real::lt(zero, support.dot(support));
        // The first guess is without gravity: settled strands start where they end.
        let free = V3::select(rests, p, p - fall);
        store3(&mut n.p, V3::select(held, on_the_way, free));
    }
    let own = theta.lit(2.0) * theta - one;
    let damping = f32x16::splat(simd, params.damping) - own * dt;
    let again = load(simd, &b.touched);
    let stage = Stage {
        ahead: theta * dt,
        beyond: one / theta,
        gravity: splat3(simd, params.gravity),
        damping: Real::max(damping, zero),
        again,
    };
    if b.touched == [0.0; LANES] {
        down::<_, false, false>(w, &b.nodes, &mut b.edges, &mut b.rows, &b.root, &stage);
        up::<_, true, false>(w, &mut b.nodes, &mut b.edges, &b.rows, &stage);
    } else {
        // Which nodes an obstacle bears is not known before.
        down::<_, true, false>(w, &b.nodes, &mut b.edges, &mut b.rows, &b.root, &stage);
        up::<_, false, false>(w, &mut b.nodes, &mut b.edges, &b.rows, &stage);
        contacts_with(simd, b, params.skin, obstacles, Grip { resting: 0.0, others: 0.0 });
        down::<_, true, true>(w, &b.nodes, &mut b.edges, &mut b.rows, &b.root, &stage);
        up::<_, true, true>(w, &mut b.nodes, &mut b.edges, &b.rows, &stage);
    }
    contacts_with(simd, b, params.skin, obstacles, Grip { resting: 1.0 + HOLD as f32, others: 1.0 });
    for pass in 0..params.limiter_steps {
        if !limit_strained(simd, b, if pass == 0 { -1.0 } else { TOLERANCE }) {
            break;
        }
        contacts(simd, b, params.skin, obstacles);
    }
    finish(w, &mut b.nodes, &mut b.edges, &mut b.rows, &b.root, params.dt, &stage)
        .store_array(&mut b.finite);
    untwist(w, &mut b.edges, &b.rows);
}

/// Nodes to where they would fall to by themselves after `ahead`, or onto what is in the way.
#[inline(always)]
fn predict<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    ahead: f32x16<S>,
    params: &DirectParams,
    obstacles: &[Obstacle],
) {
    let gain = splat3(simd, params.gravity).scale(ahead);
    predict_nodes(simd, b, ahead, gain, params.skin, obstacles);
    contacts_with(simd, b, params.skin, obstacles, Grip { resting: 0.0, others: 0.0 });
}

/// Strain that the limiter leaves.
const TOLERANCE: f32 = 5e-4;

/// Makes masses and stiffnesses of what was gathered: of a node `w` in those of dry nodes, of a joint
/// `k` as its share of the hair's own.
pub fn weigh(level: Level, block: &mut BlockLanes, bending_length: f32) {
    dispatch!(level, simd => weigh_simd(simd, block, bending_length));
}

/// Strain of a hanging strand at its root, which says how stiff it is against stretching.
const STRAIN: f32 = 1e-4;

#[inline(always)]
fn weigh_simd<S: Simd>(simd: S, b: &mut BlockLanes, bending_length: f32) {
    let (zero, two) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 2.0));
    let one = f32x16::splat(simd, 1.0);
    let mut sum = zero;
    for e in &b.edges {
        sum += load(simd, &e.l);
    }
    let density = f32x16::splat(simd, b.edges.len() as f32) / sum;
    let g = 9.8;
    let bending = density * f32x16::splat(simd, 2.0 * g * bending_length.powi(3));
    let axial = f32x16::splat(simd, g * b.edges.len() as f32 / STRAIN);
    let mut before = zero;
    for (i, n) in b.nodes.iter_mut().enumerate() {
        let mut after = zero;
        if let Some(e) = b.edges.get_mut(i) {
            after = load(simd, &e.l);
            (load(simd, &e.k) * bending / (before + after)).store_array(&mut e.k);
            (axial / after).store_array(&mut e.axial);
        }
        let load_ = load(simd, &n.w);
        let held = Real::lt(load_, f32x16::splat(simd, 1e-12));
        let mass = (before + after) * load_ * density / two;
        mass.store_array(&mut n.mass);
        Real::select(held, zero, one / mass).store_array(&mut n.w);
        before = after;
    }
}
