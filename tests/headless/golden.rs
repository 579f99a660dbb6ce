//! Golden vectors: of a published reference implementation against the coupled projection, and of a dense
//! solve in another language against the direct solver.

use bevy::math::{Quat, Vec3};
use bevy_keratin::{
    base::lanes::{LANES, Lane, Quaternion, Real, V3, put3, put4, take3, take4},
    solver::rod::{
        block::BlockLanes,
        constraint::{
            BendShares, EPSILON, EdgeWeights, StretchProjection, StretchShares, bend_twist,
            stretch_shear,
        },
        direct::{DirectParams, step, weigh},
    },
};
use fearless_simd::Level;

/// Unit roundoff of f32.
const EPS32: f64 = 1.0 / 16_777_216.0;

trait Number: Real {
    fn of(x: f64) -> Self;
    fn get(self) -> f64;
}
impl Number for f64 {
    fn of(x: f64) -> Self {
        x
    }
    fn get(self) -> f64 {
        self
    }
}
impl Number for f32 {
    fn of(x: f64) -> Self {
        x as f32
    }
    fn get(self) -> f64 {
        f64::from(self)
    }
}

fn v<R: Number>(a: [f64; 3]) -> V3<R> {
    V3::new(R::of(a[0]), R::of(a[1]), R::of(a[2]))
}
fn q<R: Number>(a: [f64; 4]) -> Quaternion<R> {
    Quaternion::new(v([a[0], a[1], a[2]]), R::of(a[3]))
}
fn v_get<R: Number>(a: V3<R>) -> [f64; 3] {
    [a.x.get(), a.y.get(), a.z.get()]
}
fn q_get<R: Number>(a: Quaternion<R>) -> [f64; 4] {
    let [x, y, z] = v_get(a.v);
    [x, y, z, a.w.get()]
}
fn length(a: &[f64]) -> f64 {
    a.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// The reference sums in another order and rounds its file, so that not even f64 is the same to the bit.
/// Compares within `absolute` plus 1e-5 of the largest component expected (f32), or `absolute`.
fn same(what: &str, case: usize, found: &[f64], expected: &[f64], relative: f64, absolute: f64) {
    let most = expected.iter().fold(0.0_f64, |m, x| m.max(x.abs()));
    for (f, e) in found.iter().zip(expected) {
        let (off, allowed) = ((f - e).abs(), relative * most + absolute);
        assert!(
            off <= allowed,
            "{what} of case {case}: {found:?} for {expected:?}, off {off:e} > {allowed:e}"
        );
    }
}

fn check<R: Number>(relative: f64, rounding: f64) {
    let golden = crate::vectors::projections();
    for (i, c) in golden.stretch_shear.iter().enumerate() {
        let quat = q::<R>(c.q);
        let e = EdgeWeights { w1: R::of(c.w0), w2: R::of(c.w1), wq: R::of(c.wq), l: R::of(c.l) };
        let shares = StretchShares::new(StretchProjection::Coupled, e);
        let d = stretch_shear(StretchProjection::Coupled, v(c.p0), v(c.p1), quat, shares);
        // Rounded inputs move C = (p1 − p0)/l − R(q)e3 by up to ε (|p0| + |p1|)/l through the
        // cancelling difference, and by a few ε in the rest; both pass on through γ.
        let span = [c.p1[0] - c.p0[0], c.p1[1] - c.p0[1], c.p1[2] - c.p0[2]];
        let moved = rounding
            * (2.0 * (length(&c.p0) + length(&c.p1)) / c.l + 8.0 * (1.0 + length(&span) / c.l));
        let gamma = moved / ((c.w0 + c.w1) / c.l + 4.0 * c.wq * c.l + EPSILON);
        let floor = if rounding == 0.0 { 1e-10 } else { 0.0 };
        same("corr0", i, &v_get(d.p1), &c.corr0, relative, c.w0 * gamma + floor);
        same("corr1", i, &v_get(d.p2), &c.corr1, relative, c.w1 * gamma + floor);
        let turn = 2.0 * c.wq * c.l * gamma + floor;
        same("corrq", i, &q_get(d.q), &c.corrq, relative, turn);
        let after = quat.add_scaled(d.q, R::of(1.0)).normalize();
        same("q_after", i, &q_get(after), &c.q_after, relative, turn + 4.0 * rounding);
    }
    for (i, c) in golden.bend_twist.iter().enumerate() {
        let (q0, q1) = (q::<R>(c.q0), q::<R>(c.q1));
        let (w0, w1) = (R::of(c.w0), R::of(c.w1));
        let (d0, d1) = bend_twist(q0, q1, q(c.rest_darboux), BendShares::new(w0, w1, R::of(1.0)));
        // Ω of rounded unit quaternions is off by a few ε whatever its size.
        let moved = 8.0 * rounding / (c.w0 + c.w1 + EPSILON);
        let floor = if rounding == 0.0 { 1e-10 } else { 0.0 };
        same("corrq0", i, &q_get(d0), &c.corrq0, relative, c.w0 * moved + floor);
        same("corrq1", i, &q_get(d1), &c.corrq1, relative, c.w1 * moved + floor);
        let one = R::of(1.0);
        let after = q0.add_scaled(d0, one).normalize();
        same(
            "q0_after",
            i,
            &q_get(after),
            &c.q0_after,
            relative,
            c.w0 * moved + 4.0 * rounding + floor,
        );
        let after = q1.add_scaled(d1, one).normalize();
        same(
            "q1_after",
            i,
            &q_get(after),
            &c.q1_after,
            relative,
            c.w1 * moved + 4.0 * rounding + floor,
        );
    }
}

#[test]
fn coupled_projection_in_f64() {
    check::<f64>(0.0, 0.0);
}

#[test]
fn coupled_projection_in_f32() {
    check::<f32>(1e-5, EPS32);
}

#[test]
fn a_substep_of_the_direct_solver_in_f32() {
    let all = |value: f32| -> Lane { [value; LANES] };
    for c in crate::vectors::substeps() {
        let mut block = BlockLanes::default();
        block.resize(c.p.len());
        // As for hair that holds any twist: the dense solve has no limit to it.
        block.edges.iter_mut().zip(&c.l).for_each(|(edge, length)| edge.l = all(*length));
        weigh(Level::new(), &mut block, 1e-3, c.dt);
        let gravity = Vec3::from(c.gravity);
        for (i, node) in block.nodes.iter_mut().enumerate() {
            // The tick's forces have been given before the solver begins.
            let (p, v) = if c.held[i] {
                (c.p[i], Vec3::from(c.v[i]))
            } else {
                (c.from[i], Vec3::from(c.v[i]) + gravity * c.dt)
            };
            for lane in 0..LANES {
                put3(&mut node.p, lane, p.into());
                put3(&mut node.from, lane, c.from[i].into());
                put3(&mut node.v, lane, v);
                put3(&mut node.push, lane, if c.held[i] { Vec3::ZERO } else { gravity });
            }
            node.mass = all(c.mass[i]);
            node.w = all(if c.held[i] { 0.0 } else { 1.0 / c.mass[i] });
        }
        for (i, edge) in block.edges.iter_mut().enumerate() {
            for lane in 0..LANES {
                put4(&mut edge.q, lane, Quat::from_array(c.q[i]));
                put4(&mut edge.rest, lane, Quat::from_array(c.rest[i]));
                put4(&mut block.root, lane, Quat::from_array(c.root));
                put4(&mut block.root_from, lane, Quat::from_array(c.root_from));
            }
            (edge.l, edge.k) = (all(c.l[i]), all(c.k[i]));
            (edge.axial, edge.tension) = (all(c.axial[i]), all(c.tension[i]));
        }
        let params = DirectParams {
            dt: c.dt,
            damping: c.damping,
            torsion: c.torsion,
            limiter_steps: 0,
            clearance: 0.0,
        };
        step(Level::new(), &mut block, &params, &[]);
        let mut off = [0.0_f32; 3];
        let mut moved = 0.0_f32;
        for lane in [0, LANES - 1] {
            for (i, node) in block.nodes.iter().enumerate() {
                let [p, v] = [c.after.p[i], c.after.v[i]].map(Vec3::from);
                moved = moved.max(p.distance(c.from[i].into()));
                off[0] = off[0].max(take3(&node.p, lane).distance(p));
                off[1] = off[1].max(take3(&node.v, lane).distance(v));
            }
            for (edge, q) in block.edges.iter().zip(&c.after.q) {
                let turn = take4(&edge.q, lane).angle_between(Quat::from_array(*q).normalize());
                off[2] = off[2].max(turn);
            }
        }
        println!("{}: off by {off:?}; moved {moved} m", c.name);
        // What velocities are off by is what positions are, over the substep.
        assert!(off[0] < 1e-6 + 1e-4 * moved, "{}: {} m of {moved}", c.name, off[0]);
        assert!(off[1] * c.dt < 2e-6 + 2e-4 * moved, "{}: {} m/s", c.name, off[1]);
        assert!(off[2] < 2e-3, "{}: {} rad", c.name, off[2]);
    }
}
