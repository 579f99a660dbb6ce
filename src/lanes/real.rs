//! One scalar type for every width: `f32`, `f64`, and eight or sixteen `f32` lanes.
//!
//! The constraint mathematics is written once, generic over [`Real`]. `f64` serves the golden
//! vectors, `f32` is the scalar twin that benches compare against, and [`f32x16`] is what the
//! tick runs: sixteen strands side by side, on whichever instruction set the machine has. Contact
//! between strands takes [`f32x8`], because its lists are short, and so do bonds, of which a strand's
//! own joints lie side by side.

use core::ops::{Add, Div, Mul, Neg, Sub};
use fearless_simd::{f32x8, f32x16, mask32x8, mask32x16, prelude::*};

/// How many strands one block solves side by side.
pub const LANES: usize = 16;

/// A number, or several side by side, that mathematics can be written in.
pub trait Real:
    Copy
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + Neg<Output = Self>
{
    /// The result of a comparison, lane by lane.
    type Mask: Copy;
    /// The constant `value` in as many lanes as `self` has.
    fn lit(self, value: f64) -> Self;
    /// `self · b + c`, fused where the instruction set fuses.
    fn mul_add(self, b: Self, c: Self) -> Self;
    /// The square root.
    fn sqrt(self) -> Self;
    /// The larger of two; `other` where `self` is not a number.
    fn max(self, other: Self) -> Self;
    /// The smaller of two; `other` where `self` is not a number.
    fn min(self, other: Self) -> Self;
    /// Whether `self < other`.
    fn lt(self, other: Self) -> Self::Mask;
    /// `yes` where the mask holds, else `no`.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;
}

macro_rules! scalar {
    ($t:ty) => {
        impl Real for $t {
            type Mask = bool;
            #[inline(always)]
            fn lit(self, value: f64) -> Self {
                value as $t
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                self * b + c
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                <$t>::sqrt(self)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                if self > other { self } else { other }
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                if self < other { self } else { other }
            }
            #[inline(always)]
            fn lt(self, other: Self) -> bool {
                self < other
            }
            #[inline(always)]
            fn select(mask: bool, yes: Self, no: Self) -> Self {
                if mask { yes } else { no }
            }
        }
    };
}
scalar!(f32);
scalar!(f64);

macro_rules! lanes {
    ($lanes:ident, $mask:ident) => {
        impl<S: Simd> Real for $lanes<S> {
            type Mask = $mask<S>;
            #[inline(always)]
            fn lit(self, value: f64) -> Self {
                (value as f32).simd_into(self.simd)
            }
            #[inline(always)]
            fn mul_add(self, b: Self, c: Self) -> Self {
                SimdFloat::mul_add(self, b, c)
            }
            #[inline(always)]
            fn sqrt(self) -> Self {
                SimdFloat::sqrt(self)
            }
            #[inline(always)]
            fn max(self, other: Self) -> Self {
                Self::select(self.simd_gt(other), self, other)
            }
            #[inline(always)]
            fn min(self, other: Self) -> Self {
                Self::select(self.simd_lt(other), self, other)
            }
            #[inline(always)]
            fn lt(self, other: Self) -> Self::Mask {
                self.simd_lt(other)
            }
            #[inline(always)]
            fn select(mask: Self::Mask, yes: Self, no: Self) -> Self {
                mask.select(yes, no)
            }
        }
    };
}
lanes!(f32x8, mask32x8);
lanes!(f32x16, mask32x16);

/// The lanes whose bits are set.
#[inline(always)]
pub(crate) fn lanes_in(mut bits: u64) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let lowest = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        lowest
    })
}
