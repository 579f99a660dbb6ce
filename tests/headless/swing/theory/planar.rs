//! The heavy elastica in a vertical plane, and its small swings.
//!
//! The rod is a chain of many inextensible edges with angles θ_i to the horizontal, so that the only
//! unknowns are angles: no stretch, no frames, no time steps. Nodes carry the mass of half their
//! cells. The energy is that of the elastica E I θ″ = μ g (L − s) cos θ with θ(0) given, θ′(L) = 0.

use super::{GRAVITY, bending_stiffness};
use core::f64::consts::{FRAC_PI_2, TAU};

/// Fine enough for four digits; the error falls with the square, see the tests.
const EDGES: usize = 400;

/// A settled rod.
pub struct Settled {
    angles: Vec<f64>,
    edge: f64,
    stiffness: f64,
}

/// Settles a straight rod of `length` (m) that is clamped level at its root.
pub fn level(length: f64, bending_length: f64) -> Settled {
    settle(length, bending_length, 0.0, EDGES)
}

/// The same, clamped straight down: it hangs.
pub fn hanging(length: f64, bending_length: f64) -> Settled {
    settle(length, bending_length, -FRAC_PI_2, EDGES)
}

fn settle(length: f64, bending_length: f64, clamp: f64, edges: usize) -> Settled {
    let mut rod = Settled {
        angles: vec![clamp; edges],
        edge: length / edges as f64,
        stiffness: bending_stiffness(bending_length),
    };
    // Newton finds the right branch if the weight comes on bit by bit.
    const STEPS: usize = 25;
    for step in 1..=STEPS {
        let load = GRAVITY * step as f64 / STEPS as f64;
        for iteration in 0.. {
            let down: Vec<f64> = rod.gradient(clamp, load).iter().map(|g| -g).collect();
            let change = rod.hessian(load).solve(&down);
            rod.angles.iter_mut().zip(&change).for_each(|(a, d)| *a += d);
            if change.iter().fold(0.0_f64, |m, d| m.max(d.abs())) < 1e-10 {
                break;
            }
            assert!(iteration < 50, "the elastica did not converge at load {load}");
        }
    }
    rod
}

impl Settled {
    /// How far the tip is below the root, as a share of the length.
    pub fn sag(&self) -> f64 {
        -self.angles.iter().map(|a| a.sin()).sum::<f64>() / self.angles.len() as f64
    }

    /// Period of the slowest small swing in the plane (s), without damping.
    ///
    /// Inverse iteration on H y = ω² M y: the Hessian H of the energy is tridiagonal in the angles,
    /// and M, the kinetic energy's, is applied through the nodes' momenta.
    pub fn period(&self) -> f64 {
        let hessian = self.hessian(GRAVITY);
        let mut mode: Vec<f64> = (1..=self.angles.len()).map(|i| i as f64).collect();
        let mut square = 0.0;
        for _ in 0..60 {
            let inertia = self.inertia(&mode);
            let next = hessian.solve(&inertia);
            let moved = self.inertia(&next);
            square = dot(&next, &inertia) / dot(&next, &moved);
            let size = dot(&next, &moved).sqrt();
            mode = next.iter().map(|a| a / size).collect();
        }
        TAU / square.sqrt()
    }

    /// Mass beyond the middle of edge `i` (kg).
    fn beyond(&self, i: usize) -> f64 {
        self.edge * (self.angles.len() as f64 - i as f64 - 0.5)
    }

    /// Bending stiffness of joint `j`; the root's cell is half as long.
    fn joint(&self, j: usize) -> f64 {
        match j {
            0 => 2.0 * self.stiffness / self.edge,
            j if j == self.angles.len() => 0.0,
            _ => self.stiffness / self.edge,
        }
    }

    fn gradient(&self, clamp: f64, gravity: f64) -> Vec<f64> {
        let moment = |j: usize| {
            let before = if j == 0 { clamp } else { self.angles[j - 1] };
            self.joint(j) * (self.angles.get(j).unwrap_or(&before) - before)
        };
        (self.angles.iter().enumerate())
            .map(|(i, a)| {
                gravity * self.edge * self.beyond(i) * a.cos() + moment(i) - moment(i + 1)
            })
            .collect()
    }

    fn hessian(&self, gravity: f64) -> Tridiagonal {
        let diagonal = (self.angles.iter().enumerate())
            .map(|(i, a)| {
                self.joint(i) + self.joint(i + 1) - gravity * self.edge * self.beyond(i) * a.sin()
            })
            .collect();
        Tridiagonal { diagonal, beside: (1..self.angles.len()).map(|j| -self.joint(j)).collect() }
    }

    /// M applied to rates of the angles.
    fn inertia(&self, rates: &[f64]) -> Vec<f64> {
        let across: Vec<[f64; 2]> = self.angles.iter().map(|a| [-a.sin(), a.cos()]).collect();
        let mut velocity = [0.0; 2];
        let mut momenta = Vec::with_capacity(rates.len());
        for (i, (rate, [x, y])) in rates.iter().zip(&across).enumerate() {
            velocity[0] += self.edge * rate * x;
            velocity[1] += self.edge * rate * y;
            let mass = if i + 1 == rates.len() { 0.5 * self.edge } else { self.edge };
            momenta.push([mass * velocity[0], mass * velocity[1]]);
        }
        let mut outer = [0.0; 2];
        let mut result = vec![0.0; rates.len()];
        for i in (0..rates.len()).rev() {
            outer[0] += momenta[i][0];
            outer[1] += momenta[i][1];
            result[i] = self.edge * (across[i][0] * outer[0] + across[i][1] * outer[1]);
        }
        result
    }
}

/// A symmetric tridiagonal matrix.
struct Tridiagonal {
    diagonal: Vec<f64>,
    beside: Vec<f64>,
}

impl Tridiagonal {
    fn solve(&self, right: &[f64]) -> Vec<f64> {
        let n = self.diagonal.len();
        let (mut d, mut x) = (self.diagonal.clone(), right.to_vec());
        for i in 1..n {
            let f = self.beside[i - 1] / d[i - 1];
            d[i] -= f * self.beside[i - 1];
            x[i] -= f * x[i - 1];
        }
        x[n - 1] /= d[n - 1];
        for i in (0..n - 1).rev() {
            x[i] = (x[i] - self.beside[i] * x[i + 1]) / d[i];
        }
        x
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

mod tests {
    use super::{super::near, *};

    #[test]
    fn short_rods_sag_as_cantilevers_and_long_ones_hang() {
        // δ = μ g L⁴ / (8 E I)
        near(level(0.01, 0.1).sag(), 0.1_f64.powi(3) / 8.0, 1e-3);
        // Far from the clamp a long rod hangs: what is missing is the bend, about √(E I / μ g L).
        let long = level(0.6, 0.05).sag();
        assert!((0.95..0.99).contains(&long), "{long}");
        assert!((hanging(0.2, 0.13).sag() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn sag_agrees_with_another_solver() {
        // A finite-difference boundary-value solver in another language, 2000 cells.
        for (length, bending_length, sag) in
            [(0.05, 0.13, 0.0071), (0.2, 0.13, 0.3963), (0.3, 0.06, 0.9446)]
        {
            assert!((level(length, bending_length).sag() - sag).abs() < 1e-4);
        }
    }

    #[test]
    fn stiff_rods_swing_as_beams_and_limp_ones_as_chains() {
        // Clamped and free: ω = 1.8751² √(E I / μ) / L²
        let beam = TAU * 0.01 * 0.01 / (1.875_104_f64.powi(2) * bending_stiffness(0.2).sqrt());
        near(level(0.01, 0.2).period(), beam, 1e-3);
        near(hanging(0.01, 0.2).period(), beam, 1e-3);
        // A hanging chain: ω = j₀,₁/2 √(g/L), a rod's clamp shortens it by √(E I / μ g L).
        let (length, bending_length) = (1.0_f64, 0.01_f64);
        let clamp = (bending_length.powi(3) / length).sqrt();
        let chain = TAU / (0.5 * 2.404_826 * (GRAVITY / (length - clamp)).sqrt());
        near(hanging(length, bending_length).period(), chain, 2e-3);
    }

    #[test]
    fn periods_agree_with_another_solver_and_converge() {
        // Finite differences of E I w⁗ − μ g ((L − s) w′)′ = μ ω² w
        near(hanging(0.2, 0.13).period(), 0.403, 2e-3);
        near(hanging(0.1, 0.13).period(), 0.118, 4e-3);
        // Weaker by B, it is hair of L_g B^{1/3}.
        near(hanging(0.2, 0.13 * 0.37_f64.cbrt()).period(), 0.5345, 1e-3);
        let period = |edges| settle(0.24, 0.06, 0.0, edges).period();
        let (coarse, middle, fine) = (period(50), period(100), period(200));
        let order = ((coarse - middle) / (middle - fine)).log2();
        assert!((1.8..2.2).contains(&order), "order {order}");
    }
}
