//! The direct solver: one direct implicit step of a whole strand per substep.
//!
//! Projections that go from joint to joint make stiffness of the inverse inertia of orientations, so
//! stiff hair gets a rotary inertia that no hair has, and converge like the square of the number of
//! segments. Here nodes are the only unknowns: orientations follow the edges (their tangents are the
//! edges' directions, always, carried along without twist), and twist is in balance at every step.
//! What remains is a system of 3×3 blocks, each coupled with two nodes before and two behind, which
//! Cholesky solves in one pass down the strand and one up.
//!
//! | file | what |
//! |---|---|
//! | `kernel` | a Newton step: assembly and elimination in one pass, solution, frames, twist |
//! | `matrix` | the blocks |
//! | `frames` | edges' frames: carried, bent, turned |
//! | `width` | the same lines for lanes and for one strand of f64 |
//!
//! One substep of length h:
//! 1. What begins deep inside an obstacle is taken out of it. Predict: nodes to x + θh v, where gravity
//!    would take them out of obstacles.
//! 2. One Newton step for the positions at θh: inertia, stretching, bending, how the moment of twist
//!    turns with the edges, what obstacles bear. Strands that touch or are about to turn by more than
//!    0.03 rad take a second.
//! 3. On to the end of the substep, x + (x_θ − x)/θ. With θ = ½ nothing would be damped and nothing
//!    be calmed; with θ = 1, implicit Euler, all swings would be damped like by a Kelvin–Voigt time of
//!    h. θ = 0.65 damps like 0.3 h, which is taken off the material's damping, and stiff motion decays
//!    to 7/13 in each substep. Strands that touch take θ = 1. BDF2 was not built: it needs two more
//!    vectors a node and a new start at each contact.
//! 4. Contacts, and Newton steps on the lengths until they are right within 0.05 %.
//! 5. Frames carried to the new directions; velocities; twist by a tridiagonal solve.
//!
//! Against theory and the sweeps (default settings of both, drag 0, 6 substeps of 1/360 s; strand 20 cm,
//! L_g 13 cm unless said; the elastica, and a beam under its own weight, hanging and about the elastica):
//!
//! | | segments | theory | direct | sweeps |
//! |---|---|---|---|---|
//! | settled sag / length, root level | 8, 16, 32, 64 | 0.3963 | 0.4019, 0.3977, 0.3966, 0.3964 | |
//! | the same, 5 cm | 8, 16, 32, 64 | 0.0071 | 0.0072, 0.0071, 0.0071, 0.0071 | 0.014, 0.041, 0.149, 0.47 |
//! | period hanging (s) | 8, 16, 32, 64 | 0.403 | 0.409, 0.405, 0.404, 0.404 | 0.61, 1.00, 1.86 |
//! | period level (s) | 8, 16, 32, 64 | 0.442 | 0.448, 0.444, 0.443, 0.443 | |
//! | let go level, lowest after (s) | 8, 16, 32, 64 | | 0.225, 0.223, 0.223, 0.223 | 0.37, 0.58, 1.07, 1.35 |
//! | height of a hanging curl (cm; 24 cm of hair, radius 1, pitch 2, L_g 6) | 18 … 96 | 8.55 | 8.41 … 8.55 | |
//! | twist that buckles, M L / EI | 32 | 8.99 | 9.37 | |
//!
//! Periods below 40 substeps come out longer, by 10 % at 11 substeps; stubs that ring faster only settle.
//! Hair stiffer than L_g of six times its length is taken as of that, and segments much shorter than 1 mm as
//! softer than they are: f32 would not carry them.
//!
//! Per segment and Newton step: about 480 multiply–adds and 12 divisions or roots; 24 + 2 numbers of
//! scratch. Of a node come in and go out position, velocity, mass and what it rests on, of an edge frame,
//! rest shape, length, stiffness and tension: 30 numbers. One strand needs nothing of another, so one GPU
//! thread may take one strand.
//!
//! After Deul, Kugelstadt, Weiler, Bender, *Direct Position-Based Solver for Stiff Rods* (2018) for the
//! direct solve, Baraff & Witkin (1998) for the implicit step, Bergou et al. (2008) for frames and
//! quasi-static twist.

mod frames;
mod kernel;
mod matrix;
pub(super) mod row;
#[cfg(test)]
mod tests;
mod width;

use super::{
    block::BlockLanes,
    limiter::{clamp_lengths, limit_strained},
    obstacle::{NearObstacles, Obstacle},
    stiffness::REFERENCE_GRAVITY,
    touch::{Grip, choose_near, contacts, contacts_with, predict_nodes},
};
use crate::lanes::{
    LANES, Quaternion, Real, V3, dispatch, load, load3, load4, splat3, store3, store4,
};
use fearless_simd::{Level, Simd, f32x16, prelude::*};
use glam::Vec3;
use kernel::{HOLD, Stage};
use width::{Half, Whole, Width};

/// What a substep does to a block.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct DirectParams {
    /// Substep (s).
    pub dt: f32,
    /// Gravity, in the frame of the positions (m/s²): what of the velocities it has given them in this
    /// substep already.
    pub gravity: Vec3,
    /// Kelvin–Voigt time of the material (s).
    pub damping: f32,
    /// Newton steps of the length limiter, at most.
    pub limiter_steps: u32,
    /// Distance that nodes keep from obstacles (m).
    pub skin: f32,
}

/// Where in the substep forces are taken; see the [module](self).
const THETA: f32 = 0.65;

/// Turn of an edge in a substep (rad) from which on a strand takes two Newton steps.
const WHIP: f32 = 0.03;

/// Strain at the root of a straight hanging strand, which says how stiff hair is against stretching.
/// Stiffer, f32 would not carry it; softer, the limiter would have to take stretching away, which bends.
const STRAIN: f32 = 1e-4;

/// Strain that the limiter leaves.
const TOLERANCE: f32 = 5e-4;

/// Strain beyond which Newton steps on the lengths have failed.
const TORN: f32 = 0.01;

/// Depth in an obstacle, in edges, from which on a strand is taken out of it before the step.
const DEEP: f32 = 0.25;

/// L_g in lengths of the strand, at most. Such hair sags by less than a thousandth of its length; f32
/// would not carry it much stiffer.
const STIFFEST: f32 = 6.0;

/// How many times firmer than by its own inertia in a substep a node is held by its neighbours, at most,
/// for a strand of one segment; of n, 1/n² of that. f32 would not carry more. Only segments much shorter
/// than 1 mm come there.
const FIRMEST: f32 = 2.5e10;

/// Takes the block through one substep, on the instruction set that the machine has.
#[doc(hidden)]
pub fn step(level: Level, block: &mut BlockLanes, params: &DirectParams, obstacles: &[Obstacle]) {
    dispatch!(level, simd => step_simd(simd, block, params, obstacles));
}

#[inline(always)]
fn step_simd<S: Simd>(simd: S, b: &mut BlockLanes, params: &DirectParams, obstacles: &[Obstacle]) {
    let theta = predict(simd, b, params, obstacles);
    let one = f32x16::splat(simd, 1.0);
    theta.store_array(&mut b.theta);
    let whips = whips(simd, b, params.dt);
    Real::max(load(simd, &b.touched), whips).store_array(&mut b.twice);
    let (from, to) = (load4(simd, &b.root_from), load4(simd, &b.root));
    let backwards = Real::lt(from.dot(to), f32x16::splat(simd, 0.0));
    let share = Real::select(backwards, -theta, theta);
    let between = Quaternion::new(from.v.scale(one - theta), from.w * (one - theta));
    store4(&mut b.root_between, between.add_scaled(to, share).normalize());
    if b.twice == [0.0; LANES] {
        newton::<S, false>(simd, b, params, 1);
    } else {
        newton::<S, true>(simd, b, params, 2);
        // Which nodes an obstacle bears is not known before: the first step shows.
        let twice = load(simd, &b.twice);
        contacts_with(simd, b, params.skin, obstacles, Grip::NONE, twice);
        newton::<S, true>(simd, b, params, 1);
    }
    // What obstacles hold has left that share of its depth.
    let grip = Grip { resting: 1.0 + HOLD as f32, others: 1.0 };
    let all = f32x16::splat(simd, 1.0);
    contacts_with(simd, b, params.skin, obstacles, grip, all);
    for pass in 0..params.limiter_steps {
        if !limit_strained(simd, b, if pass == 0 { -1.0 } else { TOLERANCE }, all) {
            break;
        }
        contacts(simd, b, params.skin, obstacles);
        if pass + 1 == params.limiter_steps && clamp_lengths(simd, b, TORN) {
            contacts(simd, b, params.skin, obstacles);
        }
    }
    finish(simd, b, params);
}

/// The kernel's widths: all lanes at once where registers hold sixteen, else two halves, because what is
/// twice as wide as registers would not stay in them.
macro_rules! in_lanes {
    ($simd:expr, $w:ident => $work:expr) => {
        if <S::f32s as SimdBase<S>>::LEN >= LANES {
            let $w = Whole($simd);
            $work;
        } else {
            for index in 0..2 {
                let $w = Half { simd: $simd, index };
                $work;
            }
        }
    };
}

/// One Newton step; `left` counts this one and those that follow.
#[inline(never)]
fn newton<S: Simd, const TWICE: bool>(
    simd: S,
    b: &mut BlockLanes,
    params: &DirectParams,
    left: u32,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            in_lanes!(simd, w => {
                let mut stage = stage(w, b, params);
                if TWICE && left == 1 {
                    (stage.again, stage.second) = (stage.twice, true);
                }
                if TWICE && left == 2 {
                    let on_the_way = w.lit(0.0).lt(stage.twice);
                    stage.beyond = <_ as Real>::select(on_the_way, w.lit(1.0), stage.beyond);
                }
                let BlockLanes { nodes, edges, rows, root_between, .. } = &mut *b;
                kernel::down::<_, TWICE>(w, nodes, edges, rows, root_between, &stage);
                kernel::up::<_, TWICE>(w, nodes, edges, rows, &stage);
            });
        },
    );
}

/// Frames, velocities, twist.
#[inline(never)]
fn finish<S: Simd>(simd: S, b: &mut BlockLanes, params: &DirectParams) {
    simd.vectorize(
        #[inline(always)]
        || {
            in_lanes!(simd, w => {
                let stage = stage(w, b, params);
                let BlockLanes { nodes, edges, rows, root, finite, .. } = &mut *b;
                let sum = kernel::finish(w, nodes, edges, rows, root, params.dt, &stage);
                kernel::untwist(w, edges, rows);
                w.put(sum, finite);
            });
        },
    );
}

#[inline(always)]
fn stage<W: Width<Cell = crate::lanes::Lane>>(
    w: W,
    b: &BlockLanes,
    params: &DirectParams,
) -> Stage<W::Real> {
    let (theta, dt) = (w.get(&b.theta), w.lit(params.dt.into()));
    let own = (w.lit(2.0) * theta - w.lit(1.0)) * dt;
    let (from, to) = (w.get4(&b.root_from), w.get4(&b.root_between));
    let turn = to.product(from.conjugate());
    let two = w.lit(2.0);
    let two = <_ as Real>::select(turn.w.lt(w.lit(0.0)), -two, two);
    Stage {
        theta,
        ahead: theta * dt,
        beyond: w.lit(1.0) / theta,
        root_turn: turn.v.scale(two),
        gravity: V3::new(
            w.lit(params.gravity.x.into()),
            w.lit(params.gravity.y.into()),
            w.lit(params.gravity.z.into()),
        ),
        damping: (w.lit(params.damping.into()) - own).max(w.lit(0.0)),
        second: false,
        again: w.lit(1.0),
        twice: w.get(&b.twice),
    }
}

/// Nodes to the first guess, and what touches: those that would fall into an obstacle are set on it.
/// Returns θ of each lane.
#[inline(always)]
fn predict<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    params: &DirectParams,
    obstacles: &[Obstacle],
) -> f32x16<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let dt = f32x16::splat(simd, params.dt);
    let gravity = splat3(simd, params.gravity);
    let mut theta = f32x16::splat(simd, THETA);
    // Gravity has given its share of the whole substep already.
    let gain = gravity.scale(dt);
    for n in &mut b.nodes {
        let v = load3(simd, &n.v) - gain;
        store3(&mut n.v, v);
    }
    choose_near(simd, b, params.dt, params.skin, obstacles);
    surface(simd, b, params, obstacles);
    fall(simd, b, dt * theta, gravity, params.skin, obstacles);
    if b.touched != [0.0; LANES] {
        let touched = Real::lt(zero, load(simd, &b.touched));
        theta = Real::select(touched, one, theta);
        for n in &mut b.nodes {
            let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
            let back = V3::select(held, load3(simd, &n.p), load3(simd, &n.from));
            store3(&mut n.p, back);
        }
        fall(simd, b, dt * theta, gravity, params.skin, obstacles);
    }
    let ahead = dt * theta;
    let fallen = gravity.scale(ahead * ahead);
    for n in &mut b.nodes {
        let (held, p) = (Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12)), load3(simd, &n.p));
        let support = load3(simd, &n.rests_on);
        let rests = Real::lt(zero, support.dot(support));
        // The first guess is without gravity: else settled hair would be turned by it in each step.
        store3(&mut n.p, V3::select(held | rests, p, p - fallen));
    }
    theta
}

/// 1 in lanes of which an edge is about to turn far, else 0. One Newton step does not end near the solution
/// there, and a whip that cracks would gain energy.
#[inline(always)]
fn whips<S: Simd>(simd: S, b: &BlockLanes, dt: f32) -> f32x16<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let mut before = load3(simd, &b.nodes[0].v);
    let mut fastest = zero;
    for (n, e) in b.nodes[1..].iter().zip(&b.edges) {
        let v = load3(simd, &n.v);
        let (l, apart) = (load(simd, &e.l), v - before);
        fastest = Real::max(fastest, apart.dot(apart) / (l * l));
        before = v;
    }
    let limit = f32x16::splat(simd, (WHIP / dt) * (WHIP / dt));
    Real::select(Real::lt(limit, fastest), one, zero)
}

/// Strands that begin deep inside an obstacle, as where they are spawned in one, get out of it with
/// their lengths before the step, so that it gives them no velocity. What is only pushed in by other
/// hair is left to the step.
#[inline(never)]
fn surface<S: Simd>(simd: S, b: &mut BlockLanes, params: &DirectParams, obstacles: &[Obstacle]) {
    simd.vectorize(
        #[inline(always)]
        || {
            let mut deepest = f32x16::splat(simd, f32::NEG_INFINITY);
            for (n, near) in b.nodes.iter().zip(&b.near_obstacles).skip(1) {
                for o in near.of(obstacles) {
                    let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
                    let (_, depth) = o.solid.depth(o.taken_along(load3(simd, &n.p)), params.skin);
                    deepest = Real::select(held, deepest, Real::max(deepest, depth));
                }
            }
            let deep = Real::lt(load(simd, &b.edges[0].l) * f32x16::splat(simd, DEEP), deepest);
            if deep.to_bitmask() == 0 {
                return;
            }
            let deep = Real::select(deep, f32x16::splat(simd, 1.0), f32x16::splat(simd, 0.0));
            b.sweeps = false;
            // Nobody knows where it gets out.
            b.near_obstacles.fill(NearObstacles::ALL);
            for n in &mut b.nodes {
                n.rests_on = Default::default();
            }
            // Each round carries what was mended by about an edge.
            for _ in 0..2 * b.edges.len() {
                contacts_with(simd, b, params.skin, obstacles, Grip::NONE, deep);
                if !limit_strained(simd, b, TORN, deep) {
                    return;
                }
            }
        },
    );
}

/// Nodes to where they would be after `ahead` by themselves, or on what is in the way.
#[inline(never)]
fn fall<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    ahead: f32x16<S>,
    gravity: V3<f32x16<S>>,
    skin: f32,
    obstacles: &[Obstacle],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            predict_nodes(simd, b, ahead, gravity.scale(ahead), skin, obstacles);
            contacts_with(simd, b, skin, obstacles, Grip::NONE, f32x16::splat(simd, 1.0));
        },
    );
}

/// Makes masses and stiffnesses of what was gathered: of a node `w` in those of dry nodes, of a joint
/// `k` as its share of what hair of this gravity-bending length (m) has, as far as a substep of `dt` (s)
/// carries it.
#[doc(hidden)]
pub fn weigh(level: Level, block: &mut BlockLanes, bending_length: f32, dt: f32) {
    dispatch!(level, simd => weigh_simd(simd, block, bending_length, dt));
}

#[inline(always)]
fn weigh_simd<S: Simd>(simd: S, b: &mut BlockLanes, bending_length: f32, dt: f32) {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let half = f32x16::splat(simd, 0.5);
    let mut sum = zero;
    for e in &b.edges {
        sum += load(simd, &e.l);
    }
    let edges = b.edges.len() as f32;
    // A whole node weighs 1: what is per mass is to be multiplied by that.
    let density = f32x16::splat(simd, edges) / sum;
    let stiff = Real::min(f32x16::splat(simd, bending_length), sum * f32x16::splat(simd, STIFFEST));
    let bending = density * f32x16::splat(simd, 2.0 * REFERENCE_GRAVITY) * stiff * stiff * stiff;
    let axial = f32x16::splat(simd, REFERENCE_GRAVITY * edges / STRAIN);
    let firmest = f32x16::splat(simd, FIRMEST / (edges * edges * dt * dt));
    let mut before = zero;
    for (i, n) in b.nodes.iter_mut().enumerate() {
        let mut after = zero;
        if let Some(e) = b.edges.get_mut(i) {
            after = load(simd, &e.l);
            let joint = load(simd, &e.k) * bending / (before + after);
            Real::min(joint, firmest * after * after).store_array(&mut e.k);
            Real::min(axial / after, firmest).store_array(&mut e.axial);
        }
        // Half a cell on either side, so the tip carries half a mass.
        let dry_nodes = load(simd, &n.w);
        let held = Real::lt(dry_nodes, f32x16::splat(simd, 1e-12));
        let mass = (before + after) * dry_nodes * density * half;
        mass.store_array(&mut n.mass);
        Real::select(held, zero, one / mass).store_array(&mut n.w);
        before = after;
    }
}
