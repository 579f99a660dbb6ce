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

/// The moment of a joint on the edge `q` behind it, in the frame of the nodes: 2K s Im(q (before Q0)‾).
#[inline(always)]
pub(super) fn moment<W: Width>(
    w: W,
    before: Quaternion<W::Real>,
    q: Quaternion<W::Real>,
    rest: Quaternion<W::Real>,
    k: W::Real,
) -> V3<W::Real> {
    let apart = q.product(before.product(rest).conjugate());
    let two = w.lit(2.0) * k;
    apart.v.scale(W::Real::select(apart.w.lt(w.lit(0.0)), -two, two))
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
