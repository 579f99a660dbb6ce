//! The direct solver: one direct implicit step of a whole strand per substep.
//!
//! Projections joint by joint express stiffness through the inverse inertia of orientations, so stiff
//! hair gets an unphysical rotary inertia, and the iterations needed grow like the square of the number
//! of segments. Here nodes are the only unknowns: orientations follow the edges (their tangents are
//! always the edges' directions, by parallel transport), and twist is in equilibrium at every step.
//! What remains is a block-pentadiagonal system of 3×3 blocks (each node is coupled with two before
//! and two behind), which a Cholesky factorisation solves in one pass down the strand and one up.
//!
//! | file | what |
//! |---|---|
//! | `kernel` | a Newton step: assembly and elimination in one pass, solution, frames, twist |
//! | `matrix` | the blocks |
//! | `frames` | edges' frames: parallel transport, moments, rotation vectors |
//! | `width` | the same lines for lanes and for one strand of f64 |
//!
//! One substep of length h:
//! 1. Strands deep inside an obstacle are moved out of it, as far as their lengths let them. Predict: nodes
//!    move to x + θh v and out of obstacles; those that begin on one rest there. The v of that is the one
//!    before the forces of the substep; taken for motion they would bend hair that is at rest under them in each step.
//!    Gravity, wind and drag act throughout the substep like elastic forces. What else changes velocities, as contact
//!    with other hair, acts as an impulse at its start: springs that are evaluated there would gain energy otherwise.
//! 2. One Newton step for the positions at θh: inertia, stretching, bending, the change of the
//!    twisting moment as edges rotate, support by obstacles, friction. Strands that are about to rotate by more than
//!    0.03 rad take a second. So do those in which the step has shown that a node sticks, slides, rests or leaves that
//!    did not: nodes that begin on an obstacle are held there at first, and the force that this takes tells which are
//!    pulled off it, and which Coulomb's friction does not hold. A third and a fourth follow if that changes what holds others.
//! 3. Extrapolate to the end of the substep, x + (x_θ − x)/θ. θ = ½ would damp nothing, stiff modes
//!    included; θ = 1, implicit Euler, would damp all swings like a Kelvin–Voigt time of h. θ =
//!    0.65 damps like 0.3 h, which is subtracted from the material's damping, and stiff motion
//!    decays to 7/13 in each substep. Strands that touch take θ = 1.
//! 4. Contacts, and Newton steps on the lengths until they are right within 0.05 % and but for what
//!    tension stretches or presses, damped so that compressed strands fold no farther than necessary and taut ones do
//!    not zigzag. Nodes that stick are not moved along the surface, nor those that the solve has found pressed off it.
//! 5. Frames are transported to the new directions; velocities; twist by a tridiagonal solve.
//!
//! Supports do not give way: what the system of equations lets them give, a hundred thousandth of a free node's way, is
//! read as their force and not moved. Edges are so stiff that the rounding of places to f32 pulls like gravity; an edge
//! keeps the tension that the last solve has found wherever its length differs from that by no more than rounding does,
//! and when the limiter takes its stretch: hair is stiffer than f32 allows edges to be, so the length is right and the
//! tension is, too.
//! Both matter: with supports a hundred times as stiff as a node's inertia, a strand that stands on its tip sank and
//! was pushed out in each step, and slipped at any friction; with the tension read from lengths, hair slid on slopes that
//! hold it.
//!
//! # Why not BDF2
//! Tried in a prototype (20 cm, L_g 13 cm, drag 0, no damping, 16 and 64 segments alike). Share of
//! the energy of a swing of 0.4 s left after 1 s at 6; 3; 2 substeps of a tick at 60 Hz: θ = 0.65
//! 80; 66; 54 %, BDF2 99.8; 99.2; 97.8 %, implicit Euler 51; 26; 14 %. But for a strand released
//! from level BDF2 adds 0.14; 1.3 % of the swing's energy at 6; 3 substeps where the other two add
//! none, and it needs the last positions and velocities, 6 numbers a node besides the 10 that a
//! substep writes, which have to be reset at teleports, contacts and changes of the substep. With
//! the default damping all three decay like the hair does, so θ = 0.65 is kept.
//!
//! # Against theory and the sweeps
//! Drag 0; strand 20 cm, L_g 13 cm unless noted; theory is the elastica, and the vibration of a
//! beam under its own weight, hanging or about the elastica. The direct solver at the papers' 1/360
//! s and at the default 1/180 s (`tests/headless/swing` prints these numbers), sweeps with their defaults at
//! 1/360 s.
//!
//! | | segments | theory | direct, 1/360 s | direct, 1/180 s | sweeps |
//! |---|---|---|---|---|---|
//! | settled sag / length, root level | 8, 16, 32, 64 | 0.3963 | 0.4019, 0.3977, 0.3966, 0.3964 | the same | not run |
//! | the same, L_g 6 cm | 8, 16, 32, 64 | 0.8894 | 0.9037, 0.8932, 0.8905, 0.8898 | 0.9037, 0.8932, 0.8904, 0.8897 | not run |
//! | the same, L_g 30 cm | 8, 16, 32, 64 | 0.0370 | 0.0376, 0.0371, 0.0370, 0.0370 | the same | not run |
//! | the same, 5 cm, L_g 13 cm | 8, 16, 32, 64 | 0.0071 | 0.0072, 0.0071, 0.0071, 0.0071 | the same | 0.014, 0.041, 0.149, 0.47 |
//! | period hanging (s) | 8, 16, 32, 64 | 0.403 | 0.408, 0.404, 0.403, 0.403 | 0.408, 0.405, 0.404, 0.403 | 0.61, 1.00, 1.86, not run |
//! | period level (s) | 8, 16, 32, 64 | 0.442 | 0.447, 0.443, 0.442, 0.442 | 0.448, 0.444, 0.443, 0.442 | not run |
//! | released from level, 24 cm, time to the lowest point (s) | 8, 16, 32, 64 | 0.285 at 128 | 0.295, 0.288, 0.286, 0.286 | 0.294, 0.288, 0.286, 0.286 | 0.37, 0.58, 1.07, 1.35 (20 cm) |
//! | height of a hanging curl (cm; 24 cm of hair, radius 1, pitch 2, L_g 6) | 18, 24, 36, 48, 64, 96 | 8.55 | 8.41, 8.47, 8.52, 8.53, 8.54, 8.55 | the same | not run |
//! | buckling by twist, M L / EI | 32 | 8.99 | 9.37 | 9.14 | not run |
//!
//! Periods below 40 substeps are too long, by 10 % at 11 substeps; faster modes are only damped.
//! L_g is limited to six times the strand's length, and segments much shorter than 1 mm are softened:
//! f32 is not precise enough for more. A strand with more twist than it can hold has an indefinite Hessian:
//! there a joint's moment counts up to EI times 8.99/L or (3 μ / (EI h²))^¼, whichever is more; the force
//! is whole.
//!
//! # For a compute port
//! Strands are independent, so one GPU thread may take one strand. Floats per segment (a node and
//! the edge before it):
//!
//! | pass | reads | writes | scratch | multiply–adds, divisions and roots |
//! |---|---|---|---|---|
//! | down: assemble and eliminate | p, from, v, mass, w, what it rests on (14); q, rest, l, k, axial, tension (12) | q (4) | 24 written | about 420, 6 |
//! | up: solve | p, from, w (7); q, l, axial (6) | p (3), tension (1) | 24 read | about 60, 0 |
//! | finish: frames, velocities, twist | p, from, v, w (10); q, rest, l, k (10) | v (3), q (4) | 2 written | about 130, 5 |
//! | untwist | q (4) | q (4) | 2 read | about 15, 1 |
//! | limiter, each Newton step | p, w (4), what it rests on (3), l (1) | p (3) | 5 written, 5 read | about 45, 4 |
//!
//! The operations of a Newton step are counted from the formulas, not measured. Of a strand's
//! state, p, v, q and tension (11) are read and written once a substep; rest, k, l and the water's
//! mass (7) are read.
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
pub(crate) mod width;

use super::{
    block::{BlockLanes, NodeLanes},
    limiter::{TOLERANCE, clamp_lengths, limit_strained, worst_strain},
    near::choose_near,
    obstacle::Obstacle,
    stiffness::REFERENCE_GRAVITY,
    touch::{FrictionPass, PenetrationLimits, contacts_with, predict_nodes},
};
use crate::base::lanes::{
    LANES, Quaternion, Real, V3, dispatch, load, load3, load4, store3, store4,
};
use fearless_simd::{Level, Simd, f32x16, mask32x16, prelude::*};
use frames::Torsion;
use kernel::NewtonStage;
use width::{Half, Whole, Width};

/// Parameters of a substep.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct DirectParams {
    /// Substep (s).
    pub dt: f32,
    /// Kelvin–Voigt time of the material (s).
    pub damping: f32,
    /// G J/(E I).
    pub torsion: f32,
    /// Newton steps of the length limiter, at most.
    pub limiter_steps: u32,
    /// Distance that nodes keep from obstacles (m).
    pub clearance: f32,
}

/// θ: where in the substep forces are evaluated; see the [module](self).
pub(crate) const THETA: f32 = 0.65;

/// Largest acceleration by air and gravity that acts throughout the substep (m/s²): more is an impulse at its start.
pub(crate) const MAX_PUSH: f32 = 500.0;

/// Rotation of an edge in a substep (rad) above which a strand takes two Newton steps.
pub(crate) const FAST_TURN: f32 = 0.03;

/// Strain at the root of a straight hanging strand, which sets the stretching stiffness. Stiffer
/// exceeds the precision of f32; softer leaves more to the length limiter, which bends hair.
pub(crate) const STRAIN: f32 = 1e-4;

/// E A l²/(E I) of an edge, at least: short stiff hair that its root presses against the scalp would be stretched
/// rather than bent. Up to [`STRETCH_SHARE`] of [`MAX_STIFFNESS`]: more exceeds the precision of f32.
pub(crate) const STRETCH_RATIO: f32 = 10.0;

/// See [`STRETCH_RATIO`].
pub(crate) const STRETCH_SHARE: f32 = 1.0 / 16.0;

/// Strain beyond which Newton steps on the lengths have failed.
pub(crate) const TORN: f32 = 0.01;

/// Newton steps in a substep, at most.
pub(crate) const MOST_STEPS: u32 = 4;

/// The maximum number of repetitions of restoring the lengths of torn strands and the push-out that
/// follows.
pub(crate) const MAX_REPAIRS: u32 = 4;

/// Strain above which an edge gets its length back though its node ends in an obstacle. Less may remain for some
/// substeps where a strand that is hit end-on has yet to fold; not of a trapped one, which cannot.
pub(crate) const MAX_STRAIN: f32 = 0.5;

/// Depth in an obstacle, in edge lengths, above which a strand is moved out of it before the step.
pub(crate) const DEEP_SHARE: f32 = 0.25;

/// Rounds of push-out and lengths in a substep for strands that are moved out of an obstacle: longer ones take
/// several substeps.
pub(crate) const LEAVING: usize = 16;

/// The share of its penetration that may be left for a trapped strand to be moved.
pub(crate) const NEARER: f32 = 0.98;

/// Largest L_g, in lengths of the strand. Such hair sags by less than a thousandth of its length; f32
/// is not precise enough for much stiffer hair.
pub(crate) const MAX_BENDING_LENGTH: f32 = 6.0;

/// Largest twist that counts in the Hessian, as a moment over EI times the strand's length: with its ends clamped
/// it buckles here.
pub(crate) const BUCKLING_TWIST: f32 = 8.99;

/// Largest ratio of a node's elastic stiffness to its inertia in a substep, for a strand of one segment;
/// 1/n² of that for n segments. f32 is not precise enough for more. Only segments much shorter than 1 mm
/// reach it.
pub(crate) const MAX_STIFFNESS: f32 = 2.5e10;

/// The share of their stiffness that strands have in a step that is repeated.
const SOFTENING: f32 = 0.01;

/// Steps the block by one substep, with the machine's best instruction set.
#[doc(hidden)]
pub fn step(level: Level, block: &mut BlockLanes, params: &DirectParams, obstacles: &[Obstacle]) {
    dispatch!(level, simd => step_simd(simd, block, params, obstacles));
}

#[inline(always)]
fn step_simd<S: Simd>(simd: S, b: &mut BlockLanes, params: &DirectParams, obstacles: &[Obstacle]) {
    let theta = predict(simd, b, params, obstacles);
    let one = f32x16::splat(simd, 1.0);
    theta.store_array(&mut b.theta);
    let turns_fast = turns_fast(simd, b, params.dt);
    Real::max(load(simd, &b.touched), turns_fast).store_array(&mut b.twice);
    let (from, to) = (load4(simd, &b.root_from), load4(simd, &b.root));
    let backwards = Real::lt(from.dot(to), f32x16::splat(simd, 0.0));
    let share = Real::select(backwards, -theta, theta);
    let between = Quaternion::new(from.v.scale(one - theta), from.w * (one - theta));
    store4(&mut b.root_between, between.add_scaled(to, share).normalize());
    if b.twice == [0.0; LANES] {
        newton::<S, false>(simd, b, params, Turn::Only);
    } else {
        newton::<S, true>(simd, b, params, Turn::First);
        // A strand that cannot get out stays where it touches.
        let free = Real::lt(load(simd, &b.trapped), one);
        let [once, turns_fast] = [load(simd, &b.twice), turns_fast]
            .map(|lanes| Real::select(free, lanes, f32x16::splat(simd, 0.0)));
        once.store_array(&mut b.again);
        // Each step shows which nodes rest on an obstacle, and which of them stick.
        for step in 1..MOST_STEPS {
            let again = load(simd, &b.again);
            contacts_with(simd, b, params.clearance, obstacles, FrictionPass::Judged, again);
            let again = again * load(simd, &b.changed);
            let again = if step == 1 { Real::max(again, turns_fast) } else { again };
            again.store_array(&mut b.again);
            if b.again == [0.0; LANES] {
                break;
            }
            newton::<S, true>(simd, b, params, Turn::Again);
        }
    }
    let all = f32x16::splat(simd, 1.0);
    contacts_with(simd, b, params.clearance, obstacles, FrictionPass::Solved, all);
    for pass in 0..params.limiter_steps {
        if !limit_strained(simd, b, if pass == 0 { -1.0 } else { TOLERANCE }, all) {
            break;
        }
        contacts_with(simd, b, params.clearance, obstacles, FrictionPass::Between, all);
        if pass + 1 == params.limiter_steps {
            // Restored lengths may end in an obstacle, and the push-out may tear them again. Lengths have the
            // last word: what is then inside begins the next substep there, see `leave_obstacles`.
            for repair in 0..=MAX_REPAIRS {
                let is_last = repair == MAX_REPAIRS;
                let torn = if is_last { max_strain(simd, b) } else { f32x16::splat(simd, TORN) };
                if !clamp_lengths(simd, b, torn, all) || is_last {
                    break;
                }
                contacts_with(simd, b, params.clearance, obstacles, FrictionPass::Between, all);
            }
        }
    }
    finish(simd, b, params);
}

/// Strain above which lengths have the last word.
#[inline(always)]
fn max_strain<S: Simd>(simd: S, b: &BlockLanes) -> f32x16<S> {
    let [zero, torn, most] = [0.0, TORN, MAX_STRAIN].map(|value| f32x16::splat(simd, value));
    Real::select(Real::lt(zero, load(simd, &b.trapped)), torn, most)
}

/// The kernel's widths: all lanes at once where registers hold sixteen, else two halves, because
/// wider values would spill.
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

/// Which of a substep's Newton steps it is.
#[derive(Clone, Copy, PartialEq)]
enum Turn {
    Only,
    First,
    Again,
}

/// One Newton step.
#[inline(never)]
fn newton<S: Simd, const TWICE: bool>(
    simd: S,
    b: &mut BlockLanes,
    params: &DirectParams,
    turn: Turn,
) {
    simd.vectorize(
        #[inline(always)]
        || {
            in_lanes!(simd, w => {
                let mut stage = stage(w, b, params);
                if turn == Turn::Again {
                    (stage.again, stage.second) = (w.get(&b.again), true);
                }
                if turn == Turn::First {
                    let is_first_of_two = w.lit(0.0).lt(stage.twice);
                    stage.beyond = <_ as Real>::select(is_first_of_two, w.lit(1.0), stage.beyond);
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
fn stage<W: Width<Cell = crate::base::lanes::Lane>>(
    w: W,
    b: &BlockLanes,
    params: &DirectParams,
) -> NewtonStage<W::Real> {
    let (theta, dt) = (w.get(&b.theta), w.lit(params.dt.into()));
    let own = (w.lit(2.0) * theta - w.lit(1.0)) * dt;
    let (from, to) = (w.get4(&b.root_from), w.get4(&b.root_between));
    let turn = to.product(from.conjugate());
    let two = w.lit(2.0);
    let two = <_ as Real>::select(turn.w.lt(w.lit(0.0)), -two, two);
    NewtonStage {
        theta,
        ahead: theta * dt,
        beyond: w.lit(1.0) / theta,
        root_turn: turn.v.scale(two),
        max_twist: w.get(&b.max_twist),
        damping: (w.lit(params.damping.into()) * w.get(&b.damping) - own).max(w.lit(0.0)),
        torsion: Torsion::new(dt, params.torsion),
        second: false,
        again: w.lit(1.0),
        twice: w.get(&b.twice),
    }
}

/// Moves nodes to the initial guess; those that would enter an obstacle are placed on its surface.
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
    let mut theta = f32x16::splat(simd, THETA);
    choose_near(simd, b, params.dt, params.clearance, obstacles);
    for n in &mut b.nodes {
        let v = load3(simd, &n.push).scale_add(-dt, load3(simd, &n.v));
        store3(&mut n.v, v);
    }
    leave_obstacles(simd, b, params, obstacles);
    advance(simd, b, theta, params, obstacles);
    if b.touched != [0.0; LANES] {
        let touched = Real::lt(zero, load(simd, &b.touched));
        theta = Real::select(touched, one, theta);
        for n in &mut b.nodes {
            let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
            let back = V3::select(held, load3(simd, &n.p), load3(simd, &n.from));
            store3(&mut n.p, back);
        }
        advance(simd, b, theta, params, obstacles);
    }
    theta
}

/// 1 in lanes where an edge is about to rotate by more than [`FAST_TURN`], else 0. One Newton step
/// does not converge there, and fast-swinging tips would gain energy.
#[inline(always)]
fn turns_fast<S: Simd>(simd: S, b: &BlockLanes, dt: f32) -> f32x16<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let moving = |n: &NodeLanes| load3(simd, &n.v) - load3(simd, &n.kick);
    let mut before = moving(&b.nodes[0]);
    let mut fastest = zero;
    for (n, e) in b.nodes[1..].iter().zip(&b.edges) {
        let v = moving(n);
        let (l, apart) = (load(simd, &e.l), v - before);
        fastest = Real::max(fastest, apart.dot(apart) / (l * l));
        before = v;
    }
    let limit = f32x16::splat(simd, (FAST_TURN / dt) * (FAST_TURN / dt));
    Real::select(Real::lt(limit, fastest), one, zero)
}

/// Moves strands that begin deep inside an obstacle, as when spawned there, out of it before the step and
/// restores their lengths, so that they gain no velocity. Shallow penetration, as from contact with
/// other hair, is left to the step.
///
/// Those that do not get out, as between two solids around their root, keep their length and are
/// [`trapped`](BlockLanes::trapped): in the step they go no deeper, and what has brought them nearer to the
/// surface stays.
#[inline(never)]
fn leave_obstacles<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    params: &DirectParams,
    obstacles: &[Obstacle],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let zero = f32x16::splat(simd, 0.0);
            let (deep, before) = penetration(simd, b, params.clearance, obstacles);
            if Real::lt(zero, deep).to_bitmask() == 0 {
                return;
            }
            b.has_fast_nodes = false;
            // Infinitely deep: no way out.
            b.choose_obstacles(obstacles, params.dt, params.clearance);
            for n in &mut b.nodes {
                n.release();
                let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
                let start = V3::select(held, load3(simd, &n.from), load3(simd, &n.p));
                store3(&mut n.from, start);
            }
            // A correction travels about one edge per round.
            for _ in 0..LEAVING.min(2 * b.edges.len()) {
                contacts_with(simd, b, params.clearance, obstacles, FrictionPass::None, deep);
                if !limit_strained(simd, b, TORN, deep) {
                    return;
                }
            }
            let torn = Real::lt(f32x16::splat(simd, TORN), worst_strain(simd, b));
            clamp_lengths(simd, b, f32x16::splat(simd, TORN), deep);
            let (left, after) = penetration(simd, b, params.clearance, obstacles);
            let trapped = Real::select(torn, deep, left * deep);
            trapped.store_array(&mut b.trapped);
            // Else it would go to and fro.
            let nearer = Real::lt(after, before * f32x16::splat(simd, NEARER));
            let back = Real::lt(zero, Real::select(nearer, zero, trapped));
            for n in &mut b.nodes {
                let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
                let p = load3(simd, &n.p);
                n.set_position(V3::select(back & !held, load3(simd, &n.from), p));
            }
        },
    );
}

/// How deep strands are inside obstacles, beyond what their roots allow: 1 in lanes with a node that is deep, else
/// 0, and the sum over all nodes and obstacles (m).
#[inline(always)]
fn penetration<S: Simd>(
    simd: S,
    b: &BlockLanes,
    clearance: f32,
    obstacles: &[Obstacle],
) -> (f32x16<S>, f32x16<S>) {
    let [zero, one] = [0.0, 1.0].map(|value| f32x16::splat(simd, value));
    let (mut deepest, mut sum) = (zero, zero);
    let mut limits = PenetrationLimits::new(simd, b);
    for (i, (n, near)) in b.nodes.iter().zip(&b.near_obstacles).enumerate() {
        let limit = limits.at(&b.edges, i);
        for o in near.of(obstacles) {
            let p = load3(simd, &n.p);
            let start = o.moved_with(p);
            // Most nodes are outside of most.
            if o.solid.is_clear(start, clearance) {
                continue;
            }
            let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
            let (_, mut depth) = o.solid.depth(start, clearance);
            if let Some(limit) = &limit {
                depth -= limit.allowed(o, clearance, p);
            }
            let depth = Real::select(held, zero, Real::max(depth, zero));
            deepest = Real::max(deepest, depth);
            sum += depth;
        }
    }
    let limit = load(simd, &b.edges[0].l) * f32x16::splat(simd, DEEP_SHARE);
    (Real::select(Real::lt(limit, deepest), one, zero), sum)
}

/// Moves nodes on by their velocities to θ of the substep, stopped by obstacles. Not by air and gravity, which elastic
/// forces balance in hair at rest: it would be rotated in each step, and pushed against what it only hangs near. What
/// they add to velocities in it only counts where nodes may pass through an obstacle.
#[inline(never)]
fn advance<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    theta: f32x16<S>,
    params: &DirectParams,
    obstacles: &[Obstacle],
) {
    simd.vectorize(
        #[inline(always)]
        || {
            let (all, dt) = (f32x16::splat(simd, 1.0), f32x16::splat(simd, params.dt));
            predict_nodes(simd, b, dt * theta, Some(dt), params.clearance, obstacles);
            contacts_with(simd, b, params.clearance, obstacles, FrictionPass::Assumed, all);
        },
    );
}

/// Converts gathered velocities before the forces of the substep, in `kick`, and what air and gravity have added to
/// them, in `push`, to an acceleration, and the rest of the velocity to an impulse. What exceeds [`MAX_PUSH`] is
/// neither: it counts as motion, as does all that changes held nodes.
#[doc(hidden)]
pub fn split_forces(level: Level, block: &mut BlockLanes, dt: f32) {
    dispatch!(level, simd => split_forces_simd(simd, block, dt));
}

#[inline(always)]
fn split_forces_simd<S: Simd>(simd: S, b: &mut BlockLanes, dt: f32) {
    let most = f32x16::splat(simd, (MAX_PUSH * dt) * (MAX_PUSH * dt));
    let [zero, rate] = [0.0, 1.0 / dt].map(|value| f32x16::splat(simd, value));
    for n in &mut b.nodes {
        let blown = load3(simd, &n.push);
        let other = load3(simd, &n.v) - load3(simd, &n.kick) - blown;
        let is_free = Real::lt(zero, load(simd, &n.w));
        store3(&mut n.push, unless_beyond(blown, most, is_free).scale(rate));
        store3(&mut n.kick, unless_beyond(other, most, is_free));
    }
}

/// `v` where its square is at most `most` and `may_be` holds, else zero. NaN stays.
#[inline(always)]
fn unless_beyond<S: Simd>(
    v: V3<f32x16<S>>,
    most: f32x16<S>,
    may_be: mask32x16<S>,
) -> V3<f32x16<S>> {
    let zero = f32x16::splat(most.simd, 0.0);
    V3::select(may_be & !Real::lt(most, v.dot(v)), v, V3::new(zero, zero, zero))
}

/// Converts gathered values to masses and stiffnesses: a node's `w` is its mass in dry nodes, a joint's
/// `k` the share of the stiffness of hair with this gravity-bending length (m), limited by what a
/// substep of `dt` (s) can resolve.
#[doc(hidden)]
pub fn weigh(level: Level, block: &mut BlockLanes, bending_length: f32, dt: f32) {
    dispatch!(level, simd => weigh_simd(simd, block, bending_length, dt));
}

/// For strands of which a step came out non-finite, as of some that are folded between solids: makes them softer by
/// [`SOFTENING`] and leaves out what lets pivots vanish or exceed f32, their twisting moments in the Hessian, and the
/// tension of the last step, which may have blown up.
pub(crate) fn soften(block: &mut BlockLanes) {
    block.max_twist = [0.0; LANES];
    for edge in &mut block.edges {
        edge.tension = [0.0; LANES];
        edge.k = edge.k.map(|k| k * SOFTENING);
        edge.axial = edge.axial.map(|axial| axial * SOFTENING);
    }
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
    // Stiffness per mass, for a whole node's mass of 1.
    let density = f32x16::splat(simd, edges) / sum;
    let stiff = Real::min(
        f32x16::splat(simd, bending_length),
        sum * f32x16::splat(simd, MAX_BENDING_LENGTH),
    );
    let bending = density * f32x16::splat(simd, 2.0 * REFERENCE_GRAVITY) * stiff * stiff * stiff;
    let axial = f32x16::splat(simd, REFERENCE_GRAVITY * edges / STRAIN);
    let stiffest = f32x16::splat(simd, MAX_STIFFNESS / (edges * edges * dt * dt));
    // In a substep inertia alone resists all waves up to about this twist, (3 μ / (EI h²))^¼.
    let edge = one / density;
    let rigidity = Real::min(bending * half, stiffest * edge * edge * edge);
    let inertia = density * f32x16::splat(simd, 3.0 / (dt * dt));
    let rigidity = Real::max(rigidity, f32x16::splat(simd, 1e-30));
    let resisted = Real::sqrt(Real::sqrt(inertia / rigidity));
    Real::max(f32x16::splat(simd, BUCKLING_TWIST) / sum, resisted).store_array(&mut b.max_twist);
    let mut before = zero;
    for (i, n) in b.nodes.iter_mut().enumerate() {
        let mut after = zero;
        if let Some(e) = b.edges.get_mut(i) {
            after = load(simd, &e.l);
            let joint = load(simd, &e.k) * bending / (before + after);
            Real::min(joint, stiffest * after * after).store_array(&mut e.k);
            let least =
                bending * f32x16::splat(simd, 0.5 * STRETCH_RATIO) / (after * after * after);
            let least = Real::min(least, stiffest * f32x16::splat(simd, STRETCH_SHARE));
            let axial = Real::min(axial / after, stiffest);
            Real::max(axial, least).store_array(&mut e.axial);
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
