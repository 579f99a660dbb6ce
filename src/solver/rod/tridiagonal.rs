//! Symmetric tridiagonal systems over a strand's edges, by the Thomas algorithm: for the length
//! limiter, springs and twist.

use crate::base::lanes::Real;

/// State of the elimination, row after row from the root on.
#[derive(Clone, Copy)]
pub(crate) struct Elimination<R> {
    inverse: R,
    /// Right-hand side of the last row, over its pivot.
    pub(crate) rhs: R,
}

impl<R: Real> Elimination<R> {
    /// The state before the first row.
    #[inline(always)]
    pub(crate) fn new(zero: R) -> Self {
        Self { inverse: zero, rhs: zero }
    }

    /// Eliminates the row `coupling x_{i−1} + diagonal x_i + … = rhs`. Where its pivot is below `least`,
    /// x_i will be 0: nothing there can move. Returns the share of x_i that [`back`] subtracts from
    /// x_{i−1}.
    #[inline(always)]
    pub(crate) fn row(&mut self, coupling: R, diagonal: R, rhs: R, least: R) -> R {
        let upper = coupling * self.inverse;
        let pivot = diagonal - coupling * upper;
        let (zero, one) = (rhs.lit(0.0), rhs.lit(1.0));
        self.inverse = R::select(pivot.lt(least), zero, one / pivot);
        self.rhs = (rhs - coupling * self.rhs) * self.inverse;
        upper
    }
}

/// x_i of an eliminated row from x_{i+1}.
#[inline(always)]
pub(crate) fn back<R: Real>(rhs: R, upper: R, next: R) -> R {
    rhs - upper * next
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn solves_what_is_diagonally_dominant(
            rows in prop::collection::vec((-1.0..1.0_f64, 2.0..5.0_f64, -9.0..9.0_f64), 1..40),
        ) {
            let mut elimination = Elimination::new(0.0);
            let mut eliminated: Vec<(f64, f64)> = Vec::new();
            for (i, (coupling, diagonal, rhs)) in rows.iter().enumerate() {
                let coupling = if i == 0 { 0.0 } else { *coupling };
                let upper = elimination.row(coupling, *diagonal, *rhs, 1e-9);
                if let Some(before) = eliminated.last_mut() {
                    before.1 = upper;
                }
                eliminated.push((elimination.rhs, 0.0));
            }
            let mut x = vec![0.0; rows.len() + 1];
            for (i, (rhs, upper)) in eliminated.iter().enumerate().rev() {
                x[i] = back(*rhs, *upper, x[i + 1]);
            }
            for (i, (coupling, diagonal, rhs)) in rows.iter().enumerate() {
                let before = if i == 0 { 0.0 } else { coupling * x[i - 1] };
                let after = rows.get(i + 1).map_or(0.0, |row| row.0 * x[i + 1]);
                prop_assert!((before + diagonal * x[i] + after - rhs).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn a_row_that_cannot_move_stays() {
        let mut elimination = Elimination::new(0.0);
        let upper = elimination.row(0.0, 0.0, 3.0, 1e-6);
        assert_eq!((upper, elimination.rhs), (0.0, 0.0));
    }
}
