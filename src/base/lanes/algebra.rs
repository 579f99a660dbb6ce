//! Vectors and quaternions over [`Real`], as far as glam has no lanes for them.
//!
//! Quaternions are Hamilton's, `v′ = q v q̄`, stored `x, y, z, w` like glam's.

use super::real::Real;
use core::ops::{Add, Neg, Sub};
use fearless_simd::{Simd, f32x16, prelude::*};
use glam::Vec3;

/// A vector of three [`Real`]s.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct V3<R> {
    /// First component.
    pub x: R,
    /// Second component.
    pub y: R,
    /// Third component.
    pub z: R,
}

/// A quaternion of [`Real`]s; orientations are unit, corrections are not.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quaternion<R> {
    /// Vector part.
    pub v: V3<R>,
    /// Real part.
    pub w: R,
}

impl<R: Real> V3<R> {
    /// A vector from its components.
    #[inline(always)]
    pub fn new(x: R, y: R, z: R) -> Self {
        Self { x, y, z }
    }

    /// This vector, `s` times as long.
    #[inline(always)]
    pub fn scale(self, s: R) -> Self {
        Self::new(self.x * s, self.y * s, self.z * s)
    }

    /// `self · s + other`.
    #[inline(always)]
    pub fn scale_add(self, s: R, other: Self) -> Self {
        Self::new(
            self.x.mul_add(s, other.x),
            self.y.mul_add(s, other.y),
            self.z.mul_add(s, other.z),
        )
    }

    /// The scalar product.
    #[inline(always)]
    pub fn dot(self, o: Self) -> R {
        self.x.mul_add(o.x, self.y.mul_add(o.y, self.z * o.z))
    }

    /// The vector product.
    #[inline(always)]
    pub fn cross(self, o: Self) -> Self {
        Self::new(
            self.y.mul_add(o.z, -(self.z * o.y)),
            self.z.mul_add(o.x, -(self.x * o.z)),
            self.x.mul_add(o.y, -(self.y * o.x)),
        )
    }

    /// `yes` where the mask holds, else `no`.
    #[inline(always)]
    pub fn select(mask: R::Mask, yes: Self, no: Self) -> Self {
        Self::new(
            R::select(mask, yes.x, no.x),
            R::select(mask, yes.y, no.y),
            R::select(mask, yes.z, no.z),
        )
    }
}

impl<R: Real> Add for V3<R> {
    type Output = Self;
    #[inline(always)]
    fn add(self, o: Self) -> Self {
        Self::new(self.x + o.x, self.y + o.y, self.z + o.z)
    }
}

impl<R: Real> Sub for V3<R> {
    type Output = Self;
    #[inline(always)]
    fn sub(self, o: Self) -> Self {
        Self::new(self.x - o.x, self.y - o.y, self.z - o.z)
    }
}

impl<R: Real> Neg for V3<R> {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self::new(-self.x, -self.y, -self.z)
    }
}

impl<R: Real> Quaternion<R> {
    /// A quaternion from its vector and real part.
    #[inline(always)]
    pub fn new(v: V3<R>, w: R) -> Self {
        Self { v, w }
    }

    /// The conjugate q̄, the inverse of a unit quaternion.
    #[inline(always)]
    pub fn conjugate(self) -> Self {
        Self::new(-self.v, self.w)
    }

    /// The Hamilton product `self ⊗ o`.
    #[inline(always)]
    pub fn product(self, o: Self) -> Self {
        let v = o.v.scale_add(self.w, self.v.scale_add(o.w, self.v.cross(o.v)));
        let w = self.w.mul_add(o.w, -self.v.dot(o.v));
        Self::new(v, w)
    }

    /// `self ⊗ (0, v)`.
    #[inline(always)]
    pub fn times_vector(self, v: V3<R>) -> Self {
        Self::new(v.scale_add(self.w, self.v.cross(v)), -self.v.dot(v))
    }

    /// `(0, v) ⊗ self`.
    #[inline(always)]
    pub fn after_vector(self, v: V3<R>) -> Self {
        Self::new(v.scale_add(self.w, v.cross(self.v)), -v.dot(self.v))
    }

    /// `self ⊗ ē3`, the factor of the stretch–shear correction.
    #[inline(always)]
    pub fn times_e3_conjugate(self) -> Self {
        Self::new(V3::new(-self.v.y, self.v.x, -self.w), self.v.z)
    }

    /// `self + o · s`.
    #[inline(always)]
    pub fn add_scaled(self, o: Self, s: R) -> Self {
        Self::new(o.v.scale_add(s, self.v), o.w.mul_add(s, self.w))
    }

    /// The scalar product of the four components.
    #[inline(always)]
    pub fn dot(self, o: Self) -> R {
        self.w.mul_add(o.w, self.v.dot(o.v))
    }

    /// The unit quaternion of the same direction.
    #[inline(always)]
    pub fn normalize(self) -> Self {
        let s = self.w.lit(1.0) / self.dot(self).sqrt();
        Self::new(self.v.scale(s), self.w * s)
    }

    /// A step toward the unit quaternion of the same direction, `2q/(1 + |q|²)`: a length error of e
    /// becomes e²/2, and the result is never longer than 1. Avoids the latency of a square root.
    #[inline(always)]
    pub fn renormalize(self) -> Self {
        let s = self.w.lit(2.0) / (self.w.lit(1.0) + self.dot(self));
        Self::new(self.v.scale(s), self.w * s)
    }

    /// R(q) e3, the tangent of an edge of orientation q.
    #[inline(always)]
    pub fn tangent(self) -> V3<R> {
        let Self { v: V3 { x, y, z }, w } = self;
        let two = w.lit(2.0);
        V3::new(
            two * x.mul_add(z, w * y),
            two * y.mul_add(z, -(w * x)),
            w.lit(1.0) - two * x.mul_add(x, y * y),
        )
    }
}

/// One vector in all lanes that `like` has.
#[inline(always)]
pub(crate) fn splat<R: Real>(like: R, v: Vec3) -> V3<R> {
    V3::new(like.lit(v.x.into()), like.lit(v.y.into()), like.lit(v.z.into()))
}

/// One vector in all lanes.
#[inline(always)]
pub(crate) fn splat3<S: Simd>(simd: S, v: Vec3) -> V3<f32x16<S>> {
    V3::new(f32x16::splat(simd, v.x), f32x16::splat(simd, v.y), f32x16::splat(simd, v.z))
}
