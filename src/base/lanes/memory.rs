//! Lanes in memory: reading and writing.

use super::{
    algebra::{Quaternion, V3},
    real::LANES,
};
use fearless_simd::{Simd, f32x16, prelude::*};
use glam::{Quat, Vec3};

/// One number of each lane.
pub type Lane = [f32; LANES];

/// Writes a vector into one lane.
#[inline(always)]
pub fn put3(a: &mut [Lane; 3], lane: usize, v: Vec3) {
    a[0][lane] = v.x;
    a[1][lane] = v.y;
    a[2][lane] = v.z;
}

/// Writes a quaternion into one lane.
#[inline(always)]
pub fn put4(a: &mut [Lane; 4], lane: usize, q: Quat) {
    a[0][lane] = q.x;
    a[1][lane] = q.y;
    a[2][lane] = q.z;
    a[3][lane] = q.w;
}

/// Reads a vector from one lane.
#[inline(always)]
pub fn take3(a: &[Lane; 3], lane: usize) -> Vec3 {
    Vec3::new(a[0][lane], a[1][lane], a[2][lane])
}

/// Reads a quaternion from one lane.
#[inline(always)]
pub fn take4(a: &[Lane; 4], lane: usize) -> Quat {
    Quat::from_xyzw(a[0][lane], a[1][lane], a[2][lane], a[3][lane])
}

#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, a: &Lane) -> f32x16<S> {
    f32x16::load_array_ref(simd, a)
}

#[inline(always)]
pub(crate) fn load3<S: Simd>(simd: S, a: &[Lane; 3]) -> V3<f32x16<S>> {
    V3::new(load(simd, &a[0]), load(simd, &a[1]), load(simd, &a[2]))
}

#[inline(always)]
pub(crate) fn store3<S: Simd>(a: &mut [Lane; 3], v: V3<f32x16<S>>) {
    v.x.store_array(&mut a[0]);
    v.y.store_array(&mut a[1]);
    v.z.store_array(&mut a[2]);
}

#[inline(always)]
pub(crate) fn load4<S: Simd>(simd: S, a: &[Lane; 4]) -> Quaternion<f32x16<S>> {
    let v = V3::new(load(simd, &a[0]), load(simd, &a[1]), load(simd, &a[2]));
    Quaternion::new(v, load(simd, &a[3]))
}

#[inline(always)]
pub(crate) fn store4<S: Simd>(a: &mut [Lane; 4], q: Quaternion<f32x16<S>>) {
    q.v.x.store_array(&mut a[0]);
    q.v.y.store_array(&mut a[1]);
    q.v.z.store_array(&mut a[2]);
    q.w.store_array(&mut a[3]);
}
