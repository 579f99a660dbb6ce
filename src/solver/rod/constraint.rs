//! The two constraints of a Cosserat rod, each with its projection (\[B\] equations 1–12).
//!
//! Symbols are the paper's: `p` nodes, `q` edge orientations, `w` inverse masses, `l` rest length,
//! `Ω` Darboux vectors as full quaternions `q̄1 q2`. All functions are generic over [`Real`], so
//! the same lines run on one `f64` and on sixteen lanes.

use crate::base::lanes::{Lane, Quaternion, Real, V3};

/// Keeps the denominators away from zero where everything at a constraint is fixed. The published
/// reference implementation adds the same value, so golden vectors hold to the last digits.
pub const EPSILON: f64 = 1e-6;

/// How the stretch–shear constraint is projected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, bevy::reflect::Reflect)]
pub enum StretchProjection {
    /// Axial and transverse parts each get their own denominator: exact to first order in every
    /// direction. Stretches least for the same cost.
    #[default]
    Split,
    /// One denominator for both, and factor 2 in the rotation: what reference libraries do.
    Coupled,
    /// Equation 4 as printed, without the factor 2: leaves 2χ/(2+4χ) of the transverse error.
    Printed,
}

/// The inverse masses and the rest length of one stretch–shear constraint.
#[derive(Clone, Copy, Debug)]
pub struct EdgeWeights<R> {
    /// Inverse mass of the edge's start node.
    pub w1: R,
    /// Inverse mass of the edge's end node.
    pub w2: R,
    /// Inverse rotational mass `w_q` of the edge.
    pub wq: R,
    /// Rest length `l`.
    pub l: R,
}

/// Factors of a stretch–shear projection, computed from its [`EdgeWeights`] once a substep, so that
/// iterations need no division.
#[derive(Clone, Copy, Debug, Default)]
pub struct StretchShares<R> {
    /// 1/l.
    pub inverse_length: R,
    /// 1 over the denominator of the part along the tangent.
    pub along: R,
    /// 1 over the denominator of the part that rotation can correct.
    pub across: R,
    /// w1 l: moves the start node.
    pub start: R,
    /// w2 l: moves the end node.
    pub end: R,
    /// w_q l², with the projection's factor: turns the edge.
    pub turn: R,
}

impl<R> StretchShares<R> {
    /// Applies `of` to each number.
    #[inline(always)]
    pub(super) fn map<T>(&self, of: impl Fn(&R) -> T) -> StretchShares<T> {
        StretchShares {
            inverse_length: of(&self.inverse_length),
            along: of(&self.along),
            across: of(&self.across),
            start: of(&self.start),
            end: of(&self.end),
            turn: of(&self.turn),
        }
    }
}

impl<R: Real> StretchShares<R> {
    /// The denominators and factors of equations 3 to 5.
    #[inline(always)]
    pub fn new(projection: StretchProjection, e: EdgeWeights<R>) -> Self {
        let one = e.l.lit(1.0);
        let axial = e.l.lit(EPSILON).mul_add(e.l, e.w1 + e.w2);
        let wql2 = e.wq * e.l * e.l;
        let across = one / wql2.mul_add(e.l.lit(4.0), axial);
        let (along, factor) = match projection {
            StretchProjection::Split => (one / axial, 2.0),
            StretchProjection::Coupled => (across, 2.0),
            StretchProjection::Printed => (across, 1.0),
        };
        Self {
            inverse_length: one / e.l,
            along,
            across,
            start: e.w1 * e.l,
            end: e.w2 * e.l,
            turn: wql2 * e.l.lit(factor),
        }
    }
}

/// How much of a joint's error each of its two edges takes up in one projection.
#[derive(Clone, Copy, Debug, Default)]
pub struct BendShares<R> {
    /// The first edge's: w1 k′ / (w1 + w2).
    pub first: R,
    /// The second edge's: w2 k′ / (w1 + w2).
    pub second: R,
}

impl<R> BendShares<R> {
    /// Applies `of` to each number.
    #[inline(always)]
    pub(super) fn map<T>(&self, of: impl Fn(&R) -> T) -> BendShares<T> {
        BendShares { first: of(&self.first), second: of(&self.second) }
    }
}

impl<R: Real> BendShares<R> {
    /// From the edges' inverse rotational masses and the joint's stiffness per iteration k′
    /// (equation 12).
    #[inline(always)]
    pub fn new(w1: R, w2: R, stiffness: R) -> Self {
        let share = stiffness / (w1 + w2 + w1.lit(EPSILON));
        Self { first: w1 * share, second: w2 * share }
    }
}

/// The factors of an edge and its joint that all iterations of a substep use.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Shares {
    pub(super) stretch: StretchShares<Lane>,
    pub(super) bend: BendShares<Lane>,
}

/// Corrections of one stretch–shear projection: of both nodes and, unnormalised, of the orientation.
#[doc(hidden)]
#[derive(Clone, Copy, Debug)]
pub struct StretchCorrection<R> {
    /// Δp1.
    pub p1: V3<R>,
    /// Δp2.
    pub p2: V3<R>,
    /// Δq.
    pub q: Quaternion<R>,
}

/// Stretch–shear, equations 1–5: C = (p2 − p1)/l − R(q) e3.
#[inline(always)]
pub fn stretch_shear<R: Real>(
    projection: StretchProjection,
    p1: V3<R>,
    p2: V3<R>,
    q: Quaternion<R>,
    e: StretchShares<R>,
) -> StretchCorrection<R> {
    let tangent = q.tangent();
    let c = (p2 - p1).scale(e.inverse_length) - tangent;
    // Rotation cannot correct an error along the tangent, so that part need not share its
    // denominator.
    let (gamma_over_d, rotating) = match projection {
        StretchProjection::Split => {
            let axial = c.dot(tangent);
            let transverse = tangent.scale_add(-axial, c).scale(e.across);
            (tangent.scale_add(axial * e.along, transverse), transverse)
        }
        StretchProjection::Coupled | StretchProjection::Printed => {
            let gamma = c.scale(e.across);
            (gamma, gamma)
        }
    };
    let dq = q.times_e3_conjugate().after_vector(rotating);
    StretchCorrection {
        p1: gamma_over_d.scale(e.start),
        p2: gamma_over_d.scale(-e.end),
        q: Quaternion::new(dq.v.scale(e.turn), dq.w * e.turn),
    }
}

/// Bend–twist, equations 6–11: Im(q̄1 q2) is brought toward ±Ω0, whichever is nearer as a full
/// quaternion. The printed three-component test (7) mirrors a remembered curve. Returns Δq1 and Δq2,
/// unnormalised.
#[inline(always)]
pub fn bend_twist<R: Real>(
    q1: Quaternion<R>,
    q2: Quaternion<R>,
    rest: Quaternion<R>,
    shares: BendShares<R>,
) -> (Quaternion<R>, Quaternion<R>) {
    let omega = q1.conjugate().product(q2);
    let opposite = omega.dot(rest).lt(omega.w.lit(0.0));
    let nearest = V3::select(opposite, -rest.v, rest.v);
    let difference = omega.v - nearest;
    let d1 = q2.times_vector(difference.scale(shares.first));
    let d2 = q1.times_vector(difference.scale(-shares.second));
    (d1, d2)
}

/// Stiffness per iteration, equation 12: k′ = 1 − (1−k)^(1/n), n the **total** iterations of the
/// solve. With the running count instead, a cantilever's sag falls fourfold from 1 to 50 iterations.
pub fn stiffness_per_iteration(k: f32, iterations: u32) -> f32 {
    1.0 - bevy::math::ops::powf(1.0 - k, 1.0 / iterations.max(1) as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn split_projection_removes_axial_error_at_once() {
        // χ = 9: the coupled denominator leaves 90 % of a pure stretch, the split one none.
        let q = Quaternion::new(V3::new(0.0, 0.0, 0.0), 1.0_f64);
        let (p1, p2) = (V3::new(0.0, 0.0, 0.0), V3::new(0.0, 0.0, 0.036));
        let e = EdgeWeights { w1: 1.0, w2: 1.0, wq: 9.0 / (0.03 * 0.03), l: 0.03 };
        let left = |kind| {
            let d = stretch_shear(kind, p1, p2, q, StretchShares::new(kind, e));
            ((p2 + d.p2) - (p1 + d.p1)).z / e.l - 1.0
        };
        assert!(left(StretchProjection::Split).abs() < 1e-6);
        assert!((left(StretchProjection::Coupled) / 0.2 - 36.0 / 38.0).abs() < 1e-6);
    }

    #[test]
    fn factor_two_makes_shear_vanish_to_first_order() {
        let q = Quaternion::new(V3::new(0.0, 0.0, 0.0), 1.0_f64);
        let p1 = V3::new(0.0, 0.0, 0.0);
        let p2 = V3::new(1e-4, 0.0, 0.03);
        let chi = 1.0;
        let e = EdgeWeights { w1: 1.0, w2: 1.0, wq: chi / (0.03 * 0.03), l: 0.03 };
        let left = |kind| {
            let d = stretch_shear(kind, p1, p2, q, StretchShares::new(kind, e));
            let turned = q.add_scaled(d.q, 1.0).normalize();
            let c = ((p2 + d.p2) - (p1 + d.p1)).scale(1.0 / e.l) - turned.tangent();
            c.x / (1e-4 / 0.03)
        };
        assert!(left(StretchProjection::Split).abs() < 1e-4);
        assert!(left(StretchProjection::Coupled).abs() < 1e-4);
        // print (4): 2χ/(2+4χ) of it stays
        assert!((left(StretchProjection::Printed) - 2.0 * chi / (2.0 + 4.0 * chi)).abs() < 1e-4);
    }

    #[test]
    fn total_iteration_count_gives_the_same_stiffness() {
        for n in [1, 5, 20, 50] {
            let k = stiffness_per_iteration(0.3, n);
            let kept = (1.0 - k).powi(n as i32);
            assert!((kept - 0.7).abs() < 1e-5, "n = {n}: {kept}");
        }
    }
}
