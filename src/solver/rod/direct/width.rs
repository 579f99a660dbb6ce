//! The register and memory types of a kernel, so that one kernel serves lanes and a scalar version.

use crate::base::lanes::{Lane, Quaternion, Real, V3};
#[cfg(test)]
use core::marker::PhantomData;
use fearless_simd::{Simd, f32x8, f32x16, prelude::*};

/// How far rounding puts the distance of two places off, as a share of their size.
pub(crate) const ROUNDING: f64 = 1.5e-7;

/// A register type and the cell of memory it is loaded from.
pub trait Width: Copy {
    /// The register type.
    type Real: Real;
    /// The memory type.
    type Cell: Copy;
    /// How far rounding puts the distance of two places off, as a share of their size.
    const ROUNDING: f64;
    /// `value` in every lane.
    fn lit(self, value: f64) -> Self::Real;
    /// Reads a cell.
    fn get(self, cell: &Self::Cell) -> Self::Real;
    /// Writes a cell.
    fn put(self, value: Self::Real, cell: &mut Self::Cell);

    /// Reads a vector.
    #[inline(always)]
    fn get3(self, [x, y, z]: &[Self::Cell; 3]) -> V3<Self::Real> {
        V3::new(self.get(x), self.get(y), self.get(z))
    }

    /// Writes a vector.
    #[inline(always)]
    fn put3(self, v: V3<Self::Real>, [x, y, z]: &mut [Self::Cell; 3]) {
        self.put(v.x, x);
        self.put(v.y, y);
        self.put(v.z, z);
    }

    /// Reads a quaternion.
    #[inline(always)]
    fn get4(self, [x, y, z, w]: &[Self::Cell; 4]) -> Quaternion<Self::Real> {
        Quaternion::new(V3::new(self.get(x), self.get(y), self.get(z)), self.get(w))
    }

    /// Writes a quaternion.
    #[inline(always)]
    fn put4(self, q: Quaternion<Self::Real>, [x, y, z, w]: &mut [Self::Cell; 4]) {
        self.put(q.v.x, x);
        self.put(q.v.y, y);
        self.put(q.v.z, z);
        self.put(q.w, w);
    }

    /// Zero in every lane.
    #[inline(always)]
    fn zero3(self) -> V3<Self::Real> {
        V3::new(self.lit(0.0), self.lit(0.0), self.lit(0.0))
    }
}

/// All lanes of a block at once.
#[derive(Clone, Copy)]
pub(crate) struct Whole<S>(pub(crate) S);

impl<S: Simd> Width for Whole<S> {
    type Real = f32x16<S>;
    type Cell = Lane;
    const ROUNDING: f64 = ROUNDING;
    #[inline(always)]
    fn lit(self, value: f64) -> f32x16<S> {
        f32x16::splat(self.0, value as f32)
    }
    #[inline(always)]
    fn get(self, cell: &Lane) -> f32x16<S> {
        f32x16::load_array_ref(self.0, cell)
    }
    #[inline(always)]
    fn put(self, value: f32x16<S>, cell: &mut Lane) {
        value.store_array(cell);
    }
}

/// Half of a block's lanes, the first or the second: where registers hold eight, sixteen would not
/// stay in them.
#[derive(Clone, Copy)]
pub(crate) struct Half<S> {
    pub(crate) simd: S,
    /// 0 or 1.
    pub(crate) index: usize,
}

impl<S: Simd> Width for Half<S> {
    type Real = f32x8<S>;
    type Cell = Lane;
    const ROUNDING: f64 = ROUNDING;
    #[inline(always)]
    fn lit(self, value: f64) -> f32x8<S> {
        f32x8::splat(self.simd, value as f32)
    }
    #[inline(always)]
    fn get(self, cell: &Lane) -> f32x8<S> {
        f32x8::load_array_ref(self.simd, &cell.as_chunks().0[self.index % 2])
    }
    #[inline(always)]
    fn put(self, value: f32x8<S>, cell: &mut Lane) {
        value.store_array(&mut cell.as_chunks_mut().0[self.index % 2]);
    }
}

/// One strand alone.
#[cfg(test)]
#[derive(Clone, Copy, Default)]
pub(crate) struct Single<T>(PhantomData<T>);

#[cfg(test)]
macro_rules! single {
    ($t:ty) => {
        impl Width for Single<$t> {
            type Real = $t;
            type Cell = $t;
            const ROUNDING: f64 = 0.0;
            #[inline(always)]
            fn lit(self, value: f64) -> $t {
                value as $t
            }
            #[inline(always)]
            fn get(self, cell: &$t) -> $t {
                *cell
            }
            #[inline(always)]
            fn put(self, value: $t, cell: &mut $t) {
                *cell = value;
            }
        }
    };
}
#[cfg(test)]
single!(f64);
