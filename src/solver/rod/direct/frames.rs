//! Frames of edges: parallel transport, bending moments, rotation vectors.

use super::width::Width;
use crate::{
    base::lanes::{Quaternion, Real, V3},
    solver::rod::block::NodeLanes,
};

/// Rotates `q` by the shortest rotation so that its tangent is along `e`, of length `len`. Returns
/// twice the vector part of that rotation: the rotation vector where it is small.
#[inline(always)]
pub(super) fn parallel_transport<R: Real>(
    q: Quaternion<R>,
    e: V3<R>,
    len: R,
) -> (Quaternion<R>, V3<R>) {
    let d = q.tangent();
    let along = d.dot(e);
    let cosine = len + along;
    // Opposite directions: half a turn about the frame's first axis.
    let folded = cosine.lt(len * len.lit(1e-6));
    let one = len.lit(1.0);
    let scale = one / (len.lit(2.0) * len * cosine).max(len.lit(1e-30)).sqrt();
    let turn = Quaternion::new(d.cross(e).scale(scale), cosine * scale);
    let half = Quaternion::new(first_axis(q), len.lit(0.0));
    let turn =
        Quaternion::new(V3::select(folded, half.v, turn.v), R::select(folded, half.w, turn.w));
    let turned = turn.product(q);
    // Off by round-off only, so that one Newton step replaces the square root.
    let length = len.lit(-0.5).mul_add(turned.dot(turned), len.lit(1.5));
    let turned = Quaternion::new(turned.v.scale(length), turned.w * length);
    (turned, turn.v + turn.v)
}

/// `yes` where the mask holds, else `no`.
#[inline(always)]
pub(super) fn choose<R: Real>(
    mask: R::Mask,
    yes: Quaternion<R>,
    no: Quaternion<R>,
) -> Quaternion<R> {
    Quaternion::new(V3::select(mask, yes.v, no.v), R::select(mask, yes.w, no.w))
}

/// How joints resist twist.
#[derive(Clone, Copy)]
pub(crate) struct Torsion<R> {
    /// G J/(E I).
    pub ratio: R,
    /// The same, less 1.
    pub excess: R,
    /// Whether that is 0: twist is resisted as much as bending, by fewer operations.
    pub isotropic: bool,
}

impl<R: Real> Torsion<R> {
    #[inline(always)]
    pub(super) fn new(like: R, ratio: f32) -> Self {
        let ratio = f64::from(ratio);
        Self { ratio: like.lit(ratio), excess: like.lit(ratio - 1.0), isotropic: ratio == 1.0 }
    }

    /// The same of a joint that lacks a share of it. What is isotropic stays so.
    #[inline(always)]
    pub(super) fn less(&self, loss: R) -> Self {
        if self.isotropic {
            return *self;
        }
        let ratio = self.ratio * (loss.lit(1.0) - loss);
        Self { ratio, excess: ratio - loss.lit(1.0), isotropic: false }
    }
}

/// The moment of a joint on the edge `q` behind it, in the frame of the nodes; minus it acts on the edge before.
///
/// With Q = q̄_before q and its rest shape ±Q0, the nearer one, and g = |(Q_w, Q_z)| |(Q0_w, Q0_z)|, it is the exact
/// gradient of 4K(1 − g − Q_x Q0_x − Q_y Q0_y) + 4CK(g − Q_w Q0_w − Q_z Q0_z). (Q_x, Q_y) is the bend in
/// the frame half-way of the twist, sin(β/2) long, and (Q_w, Q_z) the twist τ, cos(β/2) (cos τ/2, sin τ/2): bends and
/// twists do not couple. At C = 1 it is 2K |Q − Q0|², whose moment is 2K Im(q (before Q0)‾).
#[inline(always)]
pub(super) fn moment<W: Width>(
    w: W,
    before: Quaternion<W::Real>,
    q: Quaternion<W::Real>,
    rest: Quaternion<W::Real>,
    k: W::Real,
    torsion: &Torsion<W::Real>,
) -> V3<W::Real> {
    let apart = q.product(before.product(rest).conjugate());
    let two = w.lit(2.0) * k;
    let two_signed = W::Real::select(apart.w.lt(w.lit(0.0)), -two, two);
    let even = apart.v.scale(two_signed);
    if torsion.isotropic {
        return even;
    }
    let joint = Twist::new(before, q, rest);
    let share = (joint.rest_square / joint.square).sqrt();
    let sign = W::Real::select(apart.w.lt(w.lit(0.0)), w.lit(-1.0), w.lit(1.0));
    let along_w = share.mul_add(joint.w, -(sign * rest.w));
    let along_z = share.mul_add(joint.z, -(sign * rest.v.z));
    let before = Quaternion::new(before.v.scale(along_w), before.w * along_w);
    let both = before.add_scaled(joint.before_e3, along_z);
    both.product(q.conjugate()).v.scale_add(two * torsion.excess, even)
}

/// The part of a joint that is twist.
struct Twist<R> {
    /// Of the joint's rotation.
    w: R,
    z: R,
    /// w² + z², and the same of the rest shape.
    square: R,
    rest_square: R,
    /// The frame before times e3.
    before_e3: Quaternion<R>,
}

impl<R: Real> Twist<R> {
    #[inline(always)]
    fn new(before: Quaternion<R>, q: Quaternion<R>, rest: Quaternion<R>) -> Self {
        let before_e3 = turned_by_e3(before);
        let (w, z) = (before.dot(q), before_e3.dot(q));
        let least = w.lit(1e-12);
        Self {
            w,
            z,
            square: w.mul_add(w, z * z).max(least),
            rest_square: rest.w.mul_add(rest.w, rest.v.z * rest.v.z).max(least),
            before_e3,
        }
    }
}

/// Second derivatives of a joint's energy, over K, with respect to the rotations of its edges about their tangents: on
/// the diagonal and off it. At rest exact, elsewhere an upper bound, so that Newton steps do not overshoot: −K t·t′ in
/// its place is too little for curls that are pulled straight, which bend less than they do at rest.
#[inline(always)]
pub(super) fn twist_stiffness<R: Real>(
    before: Quaternion<R>,
    q: Quaternion<R>,
    rest: Quaternion<R>,
    torsion: &Torsion<R>,
) -> (R, R) {
    let joint = Twist::new(before, q, rest);
    let (one, zero) = (joint.w.lit(1.0), joint.w.lit(0.0));
    let twist = (joint.square * joint.rest_square).sqrt() * torsion.ratio;
    let bend = (one - joint.square).max(zero) * (one - joint.rest_square).max(zero);
    let bend = bend.sqrt();
    (bend + twist, bend - twist)
}

/// q e3.
#[inline(always)]
pub(super) fn turned_by_e3<R: Real>(q: Quaternion<R>) -> Quaternion<R> {
    Quaternion::new(V3::new(q.v.y, -q.v.x, q.w), -q.v.z)
}

/// R(q) e1.
#[inline(always)]
pub(super) fn first_axis<R: Real>(q: Quaternion<R>) -> V3<R> {
    let Quaternion { v: V3 { x, y, z }, w } = q;
    let two = w.lit(2.0);
    V3::new(
        w.lit(1.0) - two * y.mul_add(y, z * z),
        two * x.mul_add(y, w * z),
        two * x.mul_add(z, -(w * y)),
    )
}

/// Rotation of the edge between two nodes from the start of the substep until it points along `t`,
/// in the form that [`parallel_transport`] returns.
#[inline(always)]
pub(super) fn turned_since<W: Width>(
    w: W,
    start: &NodeLanes<W::Cell>,
    end: &NodeLanes<W::Cell>,
    t: V3<W::Real>,
) -> V3<W::Real> {
    let e = w.get3(&end.from) - w.get3(&start.from);
    let length = e.dot(e).max(w.lit(1e-30)).sqrt();
    let cosine = length + e.dot(t);
    let scale = w.lit(2.0) / (w.lit(2.0) * length * cosine).max(w.lit(1e-30)).sqrt();
    let folded = cosine.lt(length * w.lit(1e-6));
    V3::select(folded, w.zero3(), e.cross(t).scale(scale))
}
