//! Small systems of linear equations: four unknowns for a head, seven for a capsule.
//!
//! glam has matrices up to four by four, and its inverse does not detect nearly singular matrices;
//! pivots do.

/// Gaussian elimination with pivoting: the solution of `rows` · x = `right`; `None` where a pivot is
/// not above `least`.
pub(super) fn solve<const N: usize>(
    mut rows: [[f64; N]; N],
    mut right: [f64; N],
    least: f64,
) -> Option<[f64; N]> {
    for k in 0..N {
        let pivot = (k..N).max_by(|a, b| rows[*a][k].abs().total_cmp(&rows[*b][k].abs()))?;
        rows.swap(k, pivot);
        right.swap(k, pivot);
        if rows[k][k].is_nan() || rows[k][k].abs() <= least {
            return None;
        }
        let (row, value) = (rows[k], right[k]);
        for i in (0..N).filter(|i| *i != k) {
            let share = rows[i][k] / row[k];
            rows[i].iter_mut().zip(row).for_each(|(other, r)| *other -= share * r);
            right[i] -= share * value;
        }
    }
    Some(core::array::from_fn(|k| right[k] / rows[k][k]))
}
