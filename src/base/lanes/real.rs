//! One scalar type for every width: `f32`, `f64`, and eight or sixteen `f32` lanes.
//!
//! The constraint mathematics is written once, generic over [`Real`]. `f64` serves the golden
//! vectors, `f32` is the scalar version that benches compare against, and [`f32x16`] is what the
//! tick runs: sixteen strands side by side, on whichever instruction set the machine has. Contact
//! between strands takes [`f32x8`], because its lists are short, and so do bonds, of which a strand's
//! own joints lie side by side.

use core::ops::{Add, Div, Mul, Neg, Sub};
use fearless_simd::{Simd, f32x8, f32x16, mask32x8, mask32x16, prelude::*};

/// How many strands one block solves side by side.
pub const LANES: usize = 16;

/// A number, or several lanes of numbers.
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
    /// The largest integer that is not above.
    fn floor(self) -> Self;
    /// Per lane, the values of a table at index `self` plus each offset in `after`. Zero out of
    /// range.
    fn gather<const N: usize>(self, table: &[f32], after: [usize; N]) -> [Self; N];
    /// Runs `work` out of line, compiled for the instruction set of these lanes: rarely needed work
    /// does not add register pressure to its caller.
    fn apart<T>(self, work: impl FnOnce() -> T) -> T;
}

#[inline(never)]
fn vectorized<S: Simd, T>(simd: S, work: impl FnOnce() -> T) -> T {
    simd.vectorize(work)
}

#[inline(always)]
fn look_up(table: &[f32], at: f32, after: usize) -> f32 {
    table.get(at as usize + after).copied().unwrap_or(0.0)
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
            #[inline(always)]
            fn floor(self) -> Self {
                <$t>::floor(self)
            }
            #[inline(always)]
            fn gather<const N: usize>(self, table: &[f32], after: [usize; N]) -> [Self; N] {
                after.map(|after| look_up(table, self as f32, after) as $t)
            }
            #[inline(always)]
            fn apart<T>(self, work: impl FnOnce() -> T) -> T {
                work()
            }
        }
    };
}
scalar!(f32);
scalar!(f64);

macro_rules! lanes {
    ($lanes:ident, $mask:ident, $count:literal) => {
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
            #[inline(always)]
            fn floor(self) -> Self {
                SimdFloat::floor(self)
            }
            #[inline(always)]
            fn gather<const N: usize>(self, table: &[f32], after: [usize; N]) -> [Self; N] {
                let mut at = [0.0; $count];
                self.store_array(&mut at);
                after.map(|after| {
                    let found = at.map(|at| look_up(table, at, after));
                    Self::load_array_ref(self.simd, &found)
                })
            }
            #[inline(always)]
            fn apart<T>(self, work: impl FnOnce() -> T) -> T {
                vectorized(self.simd, work)
            }
        }
    };
}
lanes!(f32x8, mask32x8, 8);
lanes!(f32x16, mask32x16, 16);

/// The lanes whose bits are set.
#[inline(always)]
pub(crate) fn lanes_in(mut bits: u64) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let lowest = (bits != 0).then(|| bits.trailing_zeros() as usize);
        bits &= bits.wrapping_sub(1);
        lowest
    })
}
