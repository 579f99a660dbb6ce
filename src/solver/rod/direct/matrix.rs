//! Blocks of three by three.

use crate::base::lanes::{Real, V3};

/// A symmetric matrix by its lower triangle.
#[derive(Clone, Copy)]
pub(super) struct Symmetric<R> {
    pub xx: R,
    pub yx: R,
    pub yy: R,
    pub zx: R,
    pub zy: R,
    pub zz: R,
}

impl<R: Real> Symmetric<R> {
    #[inline(always)]
    pub fn zero(zero: R) -> Self {
        Self { xx: zero, yx: zero, yy: zero, zx: zero, zy: zero, zz: zero }
    }

    /// `along v vᵀ + all I`.
    #[inline(always)]
    pub fn uniaxial(v: V3<R>, along: R, all: R) -> Self {
        let s = v.scale(along);
        Self {
            xx: s.x.mul_add(v.x, all),
            yx: s.y * v.x,
            yy: s.y.mul_add(v.y, all),
            zx: s.z * v.x,
            zy: s.z * v.y,
            zz: s.z.mul_add(v.z, all),
        }
    }

    #[inline(always)]
    pub fn plus(self, o: Self) -> Self {
        Self {
            xx: self.xx + o.xx,
            yx: self.yx + o.yx,
            yy: self.yy + o.yy,
            zx: self.zx + o.zx,
            zy: self.zy + o.zy,
            zz: self.zz + o.zz,
        }
    }

    /// `self + along v vᵀ`.
    #[inline(always)]
    pub fn plus_outer(self, v: V3<R>, along: R) -> Self {
        self.plus(Self::uniaxial(v, along, along.lit(0.0)))
    }

    /// `self + all I`.
    #[inline(always)]
    pub fn plus_diagonal(self, all: R) -> Self {
        Self { xx: self.xx + all, yy: self.yy + all, zz: self.zz + all, ..self }
    }

    /// `self − m − mᵀ`.
    #[inline(always)]
    pub fn minus_both(self, m: &Matrix<R>) -> Self {
        let [x, y, z] = m.rows;
        Self {
            xx: self.xx - (x.x + x.x),
            yx: self.yx - (y.x + x.y),
            yy: self.yy - (y.y + y.y),
            zx: self.zx - (z.x + x.z),
            zy: self.zy - (z.y + y.z),
            zz: self.zz - (z.z + z.z),
        }
    }

    /// `self − a bᵀ`, which the caller guarantees to be symmetric.
    #[inline(always)]
    pub fn minus_product(self, a: &Matrix<R>, b: &Matrix<R>) -> Self {
        let ([ax, ay, az], [bx, by, bz]) = (a.rows, b.rows);
        Self {
            xx: dot_from(self.xx, ax, bx),
            yx: dot_from(self.yx, ay, bx),
            yy: dot_from(self.yy, ay, by),
            zx: dot_from(self.zx, az, bx),
            zy: dot_from(self.zy, az, by),
            zz: dot_from(self.zz, az, bz),
        }
    }
}

/// `from − a · b`.
#[inline(always)]
fn dot_from<R: Real>(from: R, a: V3<R>, b: V3<R>) -> R {
    (-a.x).mul_add(b.x, (-a.y).mul_add(b.y, (-a.z).mul_add(b.z, from)))
}

/// `from − (bx bᵧ b_z) a`.
#[inline(always)]
fn row_from<R: Real>(from: V3<R>, a: V3<R>, bx: V3<R>, by: V3<R>, bz: V3<R>) -> V3<R> {
    V3::new(dot_from(from.x, a, bx), dot_from(from.y, a, by), dot_from(from.z, a, bz))
}

/// A matrix by its rows.
#[derive(Clone, Copy)]
pub(super) struct Matrix<R> {
    pub rows: [V3<R>; 3],
}

impl<R: Real> Matrix<R> {
    #[inline(always)]
    pub fn zero(zero: R) -> Self {
        Self { rows: [V3::new(zero, zero, zero); 3] }
    }

    /// `scale (a bᵀ − (a·b) I)`; `dot` is a·b.
    #[inline(always)]
    pub fn coupling(a: V3<R>, b: V3<R>, dot: R, scale: R) -> Self {
        let (s, d) = (a.scale(scale), dot * scale);
        Self {
            rows: [
                V3::new(s.x.mul_add(b.x, -d), s.x * b.y, s.x * b.z),
                V3::new(s.y * b.x, s.y.mul_add(b.y, -d), s.y * b.z),
                V3::new(s.z * b.x, s.z * b.y, s.z.mul_add(b.z, -d)),
            ],
        }
    }

    /// `self + v×`, the matrix of the vector product with `v`.
    #[inline(always)]
    pub fn plus_cross(self, v: V3<R>) -> Self {
        let [x, y, z] = self.rows;
        Self {
            rows: [
                V3::new(x.x, x.y - v.z, x.z + v.y),
                V3::new(y.x + v.z, y.y, y.z - v.x),
                V3::new(z.x - v.y, z.y + v.x, z.z),
            ],
        }
    }

    #[inline(always)]
    pub fn plus(self, o: Self) -> Self {
        let ([a, b, c], [x, y, z]) = (self.rows, o.rows);
        Self { rows: [a + x, b + y, c + z] }
    }

    #[inline(always)]
    pub fn minus_symmetric(self, s: &Symmetric<R>) -> Self {
        let [x, y, z] = self.rows;
        Self {
            rows: [
                V3::new(x.x - s.xx, x.y - s.yx, x.z - s.zx),
                V3::new(y.x - s.yx, y.y - s.yy, y.z - s.zy),
                V3::new(z.x - s.zx, z.y - s.zy, z.z - s.zz),
            ],
        }
    }

    /// `self + a bᵀ`.
    #[inline(always)]
    pub fn plus_product(self, a: &Self, b: &Self) -> Self {
        let ([x, y, z], [ax, ay, az], [bx, by, bz]) = (self.rows, a.rows, b.rows);
        Self {
            rows: [
                row_from(x, -ax, bx, by, bz),
                row_from(y, -ay, bx, by, bz),
                row_from(z, -az, bx, by, bz),
            ],
        }
    }

    /// `from + self v`.
    #[inline(always)]
    pub fn times_to(&self, v: V3<R>, from: V3<R>) -> V3<R> {
        self.times_from(-v, from)
    }

    /// `from + selfᵀ v`.
    #[inline(always)]
    pub fn transposed_to(&self, v: V3<R>, from: V3<R>) -> V3<R> {
        self.transposed_from(-v, from)
    }

    /// `from − self v`.
    #[inline(always)]
    pub fn times_from(&self, v: V3<R>, from: V3<R>) -> V3<R> {
        let [x, y, z] = self.rows;
        V3::new(dot_from(from.x, x, v), dot_from(from.y, y, v), dot_from(from.z, z, v))
    }

    /// `from − selfᵀ v`.
    #[inline(always)]
    pub fn transposed_from(&self, v: V3<R>, from: V3<R>) -> V3<R> {
        let [x, y, z] = self.rows;
        z.scale_add(-v.z, y.scale_add(-v.y, x.scale_add(-v.x, from)))
    }
}

/// `A = L D Lᵀ`, with the inverses of D; 0 for an infinite D.
#[derive(Clone, Copy)]
pub(super) struct Pivot<R> {
    pub yx: R,
    pub zx: R,
    pub zy: R,
    pub inverse: V3<R>,
}

impl<R: Real> Pivot<R> {
    /// Factors a matrix that round-off may have made indefinite: pivots are at least `least`. Where
    /// `held`, the inverse is 0.
    #[inline(always)]
    pub fn new(a: &Symmetric<R>, least: R, held: R::Mask) -> Self {
        let (zero, one) = (least.lit(0.0), least.lit(1.0));
        let x = one / a.xx.max(least);
        let (yx, zx) = (a.yx * x, a.zx * x);
        let y = one / (-yx).mul_add(a.yx, a.yy).max(least);
        let below = (-zx).mul_add(a.yx, a.zy);
        let zy = below * y;
        let z = one / (-zy).mul_add(below, (-zx).mul_add(a.zx, a.zz)).max(least);
        let inverse = V3::select(held, V3::new(zero, zero, zero), V3::new(x, y, z));
        Self { yx, zx, zy, inverse }
    }

    /// `m L⁻ᵀ`.
    #[inline(always)]
    pub fn unscaled(&self, m: &Matrix<R>) -> Matrix<R> {
        let [x, y, z] = m.rows;
        Matrix { rows: [self.forward(x), self.forward(y), self.forward(z)] }
    }

    /// `m D⁻¹`.
    #[inline(always)]
    pub fn scaled(&self, m: &Matrix<R>) -> Matrix<R> {
        let [x, y, z] = m.rows;
        Matrix { rows: [self.divide(x), self.divide(y), self.divide(z)] }
    }

    /// `L⁻¹ v`.
    #[inline(always)]
    pub fn forward(&self, v: V3<R>) -> V3<R> {
        let y = (-self.yx).mul_add(v.x, v.y);
        V3::new(v.x, y, (-self.zy).mul_add(y, (-self.zx).mul_add(v.x, v.z)))
    }

    /// `D⁻¹ v`.
    #[inline(always)]
    pub fn divide(&self, v: V3<R>) -> V3<R> {
        V3::new(v.x * self.inverse.x, v.y * self.inverse.y, v.z * self.inverse.z)
    }
}
