//! When a twisted rod buckles: Michell 1889, Greenhill 1883.

/// M L / (E I) at which a straight rod with both ends clamped, free to come closer, buckles under
/// twist alone: the least root of tan(x/2) = x/2, 8.987.
///
/// From E I u‴ − i M u″ = const. of the deflection u = y + i z, with u and u′ zero at both ends.
pub fn buckling() -> f64 {
    // sin(x/2) − (x/2) cos(x/2) changes its sign between π and 3π/2.
    let off = |half: f64| half.sin() - half * half.cos();
    let (mut low, mut high) = (core::f64::consts::PI, 1.5 * core::f64::consts::PI);
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if off(middle) * off(low) > 0.0 { low = middle } else { high = middle }
    }
    low + high
}

mod tests {
    use super::*;

    #[test]
    fn both_ends_clamped_is_nine() {
        assert!((buckling() - 8.9868).abs() < 1e-4);
    }

    /// The second variation of the energy, ½ ∫ E I |u″|² − M (y′ z″ − z′ y″), over slopes of edges;
    /// the ends do not move sideways. Whether it is positive for every bend.
    fn is_stable(moment: f64) -> bool {
        const EDGES: usize = 60;
        let n = 2 * EDGES;
        let edge = 1.0 / EDGES as f64;
        let mut form = vec![vec![0.0; n]; n];
        for j in 0..=EDGES {
            let half_cell = if j == 0 || j == EDGES { 2.0 } else { 1.0 };
            for axis in 0..2 {
                let at = |i: usize| 2 * i + axis;
                if j < EDGES {
                    form[at(j)][at(j)] += half_cell / edge;
                }
                if j > 0 {
                    form[at(j - 1)][at(j - 1)] += half_cell / edge;
                }
                if j > 0 && j < EDGES {
                    form[at(j)][at(j - 1)] -= 1.0 / edge;
                    form[at(j - 1)][at(j)] -= 1.0 / edge;
                    // y′ of one edge with z′ of the next, and the other way round.
                    let sign = if axis == 0 { -0.5 } else { 0.5 };
                    let (a, b) = (2 * (j - 1) + axis, 2 * j + 1 - axis);
                    form[a][b] += sign * moment;
                    form[b][a] += sign * moment;
                }
            }
        }
        for (a, row) in form.iter_mut().enumerate() {
            row.iter_mut().skip(a % 2).step_by(2).for_each(|x| *x += 1e4);
        }
        // Cholesky
        for j in 0..n {
            for i in j..n {
                let s = form[i][j] - (0..j).map(|k| form[i][k] * form[j][k]).sum::<f64>();
                if i == j && s <= 0.0 {
                    return false;
                }
                form[i][j] = if i == j { s.sqrt() } else { s / form[j][j] };
            }
        }
        true
    }

    #[test]
    fn the_energy_says_the_same() {
        assert!(is_stable(0.98 * buckling()));
        assert!(!is_stable(1.02 * buckling()));
    }
}
