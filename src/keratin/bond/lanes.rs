//! Equations 15 and 16 on all joints of a strand, eight side by side.
//!
//! A joint's data fill four registers of four numbers: transposed there, the numbers of four joints are
//! side by side without a detour through memory. Two such fours are computed at once.

use super::{
    kind::BondKind,
    model::{JointBonds, MIN_CLOSED_SHARE, Remembered, changed, remembered, rest_shape},
};
use crate::base::lanes::{Quaternion, Real, V3, dispatch, transposed};
use fearless_simd::{Level, Simd, f32x4, f32x8, prelude::*};
use glam::Quat;

/// The frames on both sides of a strand's joints.
#[derive(Clone, Copy)]
pub(super) struct JointFrames<'a> {
    /// The scalp's.
    pub root: Quat,
    /// The edges', root first.
    pub orientations: &'a [Quat],
}

/// Writes Ω0 of every joint: equation 15.
pub(super) fn rest_shapes(
    level: Level,
    frames: JointFrames<'_>,
    joints: &[JointBonds],
    influence: &[f32; BondKind::COUNT],
    darboux: &mut [Quat],
) {
    dispatch!(level, simd => rest_shapes_in(simd, frames, joints, influence, darboux));
}

/// Writes for every joint the shape Ω* that its closed bonds remember, and their share B. A joint with
/// almost no closed bonds gets its present shape: returns whether there is such a joint.
pub(super) fn remembered_shapes(
    level: Level,
    frames: JointFrames<'_>,
    joints: &[JointBonds],
    influence: &[f32; BondKind::COUNT],
    darboux: &mut [Quat],
    closed: &mut [f32],
) -> bool {
    dispatch!(level, simd => remembered_in(simd, frames, joints, influence, darboux, closed))
}

/// Changes every joint's bonds by Δb, its row of `changes`: equation 16.
pub(super) fn change(
    level: Level,
    frames: JointFrames<'_>,
    joints: &mut [JointBonds],
    changes: &[[f32; BondKind::COUNT]],
) {
    dispatch!(level, simd => change_in(simd, frames, joints, changes));
}

#[inline(always)]
fn rest_shapes_in<S: Simd>(
    simd: S,
    frames: JointFrames<'_>,
    joints: &[JointBonds],
    influence: &[f32; BondKind::COUNT],
    darboux: &mut [Quat],
) {
    let influence = splats(simd, influence);
    let mut before = frames.root;
    let eights = joints.chunks(8).zip(frames.orientations.chunks(8)).zip(darboux.chunks_mut(8));
    for ((joints, orientations), darboux) in eights {
        let omega = present(simd, &mut before, filled(orientations));
        let Quaternion { v: V3 { x, y, z }, w } =
            rest_shape(omega, &bonds(simd, filled(joints)), &influence);
        let [x, y, z, w] = [halves(x), halves(y), halves(z), halves(w)];
        for (half, four) in darboux.chunks_mut(4).enumerate() {
            for (to, rest) in four.iter_mut().zip(transposed([x[half], y[half], z[half], w[half]]))
            {
                *to = Quat::from_array(rest);
            }
        }
    }
}

#[inline(always)]
fn remembered_in<S: Simd>(
    simd: S,
    frames: JointFrames<'_>,
    joints: &[JointBonds],
    influence: &[f32; BondKind::COUNT],
    darboux: &mut [Quat],
    closed: &mut [f32],
) -> bool {
    let influence = splats(simd, influence);
    let mut before = frames.root;
    let mut follows = false;
    let eights = joints.chunks(8).zip(frames.orientations.chunks(8));
    let to = darboux.chunks_mut(8).zip(closed.chunks_mut(8));
    for ((joints, orientations), (darboux, closed)) in eights.zip(to) {
        let omega = present(simd, &mut before, filled(orientations));
        let (Quaternion { v: V3 { x, y, z }, w }, share) =
            remembered(omega, &bonds(simd, filled(joints)), &influence);
        let [x, y, z, w] = [halves(x), halves(y), halves(z), halves(w)];
        let share = halves(share);
        for (half, (four, closed)) in darboux.chunks_mut(4).zip(closed.chunks_mut(4)).enumerate() {
            let shapes = transposed([x[half], y[half], z[half], w[half]]);
            for (to, shape) in four.iter_mut().zip(shapes) {
                *to = Quat::from_array(shape);
            }
            closed.copy_from_slice(&share[half][..closed.len()]);
            follows |= closed.iter().any(|share| *share <= MIN_CLOSED_SHARE);
        }
    }
    follows
}

#[inline(always)]
fn change_in<S: Simd>(
    simd: S,
    frames: JointFrames<'_>,
    joints: &mut [JointBonds],
    changes: &[[f32; BondKind::COUNT]],
) {
    let mut before = frames.root;
    let eights = joints.chunks_mut(8).zip(frames.orientations.chunks(8)).zip(changes.chunks(8));
    for ((joints, orientations), changes) in eights {
        let omega = present(simd, &mut before, filled(orientations));
        let mut bonds = bonds(simd, filled(joints));
        let requested = |k: usize| changes.get(k).copied().unwrap_or_default();
        let low = transposed([requested(0), requested(1), requested(2), requested(3)]);
        let high = transposed([requested(4), requested(5), requested(6), requested(7)]);
        for (j, bond) in bonds.iter_mut().enumerate() {
            *bond = changed(*bond, lanes(simd, low[j], high[j]), omega);
        }
        let [a, b, c, d] = bonds;
        let rows = |half: usize| {
            let row = |lanes| halves(lanes)[half];
            [
                transposed([row(a.shape.x), row(a.shape.y), row(a.shape.z), row(b.shape.x)]),
                transposed([row(b.shape.y), row(b.shape.z), row(c.shape.x), row(c.shape.y)]),
                transposed([row(c.shape.z), row(d.shape.x), row(d.shape.y), row(d.shape.z)]),
                transposed([row(a.rate), row(b.rate), row(c.rate), row(d.rate)]),
            ]
        };
        for (half, four) in joints.chunks_mut(4).enumerate() {
            let [first, second, third, rates] = rows(half);
            for (i, joint) in four.iter_mut().enumerate() {
                joint.shapes = bytemuck::cast([first[i], second[i], third[i]]);
                joint.rates = rates[i];
            }
        }
    }
}

/// Pads to eight items by repeating the last.
#[inline(always)]
fn filled<T>(some: &[T]) -> [&T; 8] {
    let last = some.len() - 1;
    let at = |i: usize| &some[last.min(i)];
    [at(0), at(1), at(2), at(3), at(4), at(5), at(6), at(7)]
}

#[inline(always)]
fn splats<S: Simd>(simd: S, [a, b, c, d]: &[f32; 4]) -> [f32x8<S>; 4] {
    let splat = |x: &f32| f32x8::splat(simd, *x);
    [splat(a), splat(b), splat(c), splat(d)]
}

#[inline(always)]
fn lanes<S: Simd>(simd: S, low: [f32; 4], high: [f32; 4]) -> f32x8<S> {
    f32x4::load_array(simd, low).combine(f32x4::load_array(simd, high))
}

#[inline(always)]
fn halves<S: Simd>(lanes: f32x8<S>) -> [[f32; 4]; 2] {
    let mut four = [[0.0; 4]; 2];
    let (low, high) = lanes.split();
    low.store_array(&mut four[0]);
    high.store_array(&mut four[1]);
    four
}

/// Ω of eight joints, with real part ≥ 0. `before` is the frame before the first edge; it is set to the
/// last edge's.
#[inline(always)]
fn present<S: Simd>(
    simd: S,
    before: &mut Quat,
    [a, b, c, d, e, f, g, h]: [&Quat; 8],
) -> Quaternion<f32x8<S>> {
    let ahead = quaternions(simd, [a, b, c, d], [e, f, g, h]);
    let behind = quaternions(simd, [before, a, b, c], [d, e, f, g]);
    *before = *h;
    let omega = behind.conjugate().product(ahead);
    let zero = omega.w.lit(0.0);
    let sign = Real::select(omega.w.lt(zero), zero.lit(-1.0), zero.lit(1.0));
    Quaternion::new(omega.v.scale(sign), omega.w * sign)
}

#[inline(always)]
fn quaternions<S: Simd>(simd: S, low: [&Quat; 4], high: [&Quat; 4]) -> Quaternion<f32x8<S>> {
    let rows = |[a, b, c, d]: [&Quat; 4]| {
        transposed([a.to_array(), b.to_array(), c.to_array(), d.to_array()])
    };
    let (low, high) = (rows(low), rows(high));
    let at = |i: usize| lanes(simd, low[i], high[i]);
    Quaternion::new(V3::new(at(0), at(1), at(2)), at(3))
}

/// Eight joints' bonds, kind by kind.
#[inline(always)]
fn bonds<S: Simd>(
    simd: S,
    [a, b, c, d, e, f, g, h]: [&JointBonds; 8],
) -> [Remembered<f32x8<S>>; BondKind::COUNT] {
    let (low, high) = (numbers([a, b, c, d]), numbers([e, f, g, h]));
    let at = |i: usize| lanes(simd, low[i / 4][i % 4], high[i / 4][i % 4]);
    let kind = |j: usize| {
        let shape = V3::new(at(3 * j), at(3 * j + 1), at(3 * j + 2));
        Remembered { shape, rate: at(12 + j) }
    };
    [kind(0), kind(1), kind(2), kind(3)]
}

/// The sixteen numbers of four joints, transposed in groups of four.
#[inline(always)]
fn numbers([a, b, c, d]: [&JointBonds; 4]) -> [[[f32; 4]; 4]; 4] {
    // Four vectors are three groups of four contiguous numbers.
    let shapes: [[[f32; 4]; 3]; 4] = [
        bytemuck::cast(a.shapes),
        bytemuck::cast(b.shapes),
        bytemuck::cast(c.shapes),
        bytemuck::cast(d.shapes),
    ];
    let third = |t: usize| transposed([shapes[0][t], shapes[1][t], shapes[2][t], shapes[3][t]]);
    [third(0), third(1), third(2), transposed([a.rates, b.rates, c.rates, d.rates])]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::solver::rod::frame::{darboux, full};
    use glam::Vec3;
    use proptest::prelude::*;

    /// A strand whose edges turn by up to a full turn from one to the next, with bonds of every rate.
    fn strand(seeds: &[[f32; 4]]) -> (Vec<Quat>, Vec<JointBonds>, Vec<[f32; 4]>) {
        let orientations = seeds.iter().map(|s| Quat::from_array(*s).normalize()).collect();
        let joints = seeds.iter().map(|&[x, y, z, w]| JointBonds {
            shapes: [[x, y, z], [z, -w, x], [w, z, y], [-y, x, w]].map(|s| Vec3::from(s) * 0.5),
            rates: [x, y, z, w].map(|r| ((r + 1.0) * 0.8 - 0.3).clamp(0.0, 1.0)),
        });
        (orientations, joints.collect(), seeds.iter().map(|s| [s[3], 0.0, s[1], s[2]]).collect())
    }

    proptest! {
        #[test]
        fn joints_side_by_side_are_joints_one_by_one(
            seeds in proptest::collection::vec(proptest::array::uniform4(-1.0f32..1.0), 1..40),
            fewer in 0usize..3,
        ) {
            let length = |s: &[f32; 4]| glam::Vec4::from_array(*s).length();
            prop_assume!(seeds.iter().all(|s| length(s) > 0.1));
            let (orientations, joints, mut changes) = strand(&seeds);
            // There may be fewer requests than joints.
            changes.truncate(changes.len() - fewer.min(changes.len()));
            let (influence, root) = ([0.33, 0.3, 0.2, 0.17], Quat::from_rotation_x(0.4));
            let frames = JointFrames { root, orientations: &orientations };
            let omega = |i: usize| {
                darboux(if i == 0 { root } else { orientations[i - 1] }, orientations[i])
            };
            // Near a half turn either hemisphere is right, and rounding is amplified.
            prop_assume!((0..joints.len()).all(|i| {
                let omega = omega(i);
                let near = |s: &Vec3| omega.dot(full(*s)).abs() > 1e-2;
                omega.w > 1e-2 && joints[i].shapes.iter().all(near)
            }));
            let mut rest = vec![Quat::NAN; joints.len()];
            rest_shapes(Level::new(), frames, &joints, &influence, &mut rest);
            for (i, rest) in rest.iter().enumerate() {
                let expected = joints[i].rest_shape(omega(i), &influence);
                prop_assert!((*rest - expected).length() < 1e-5, "{i}: {rest}, not {expected}");
            }
            let mut together = joints.clone();
            change(Level::new(), frames, &mut together, &changes);
            for (i, (mut joint, now)) in joints.into_iter().zip(together).enumerate() {
                for (kind, by) in changes.get(i).into_iter().flatten().enumerate() {
                    joint.change(kind, *by, omega(i));
                }
                for kind in 0..BondKind::COUNT {
                    prop_assert!((joint.rates[kind] - now.rates[kind]).abs() < 1e-6, "{i}");
                    prop_assert!(joint.shapes[kind].distance(now.shapes[kind]) < 1e-5, "{i}");
                }
            }
        }
    }
}
