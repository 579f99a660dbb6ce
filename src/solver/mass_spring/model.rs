//! Mass-spring strands as pure functions: \[W\] equation 1, stable at any step.
//!
//! The damper in the paper, c |v_b − v_a|, has no sign and adds energy; a correct one acts on the
//! rate of extension. An explicit step of stiff springs blows up beyond √(2m/k), here 1 ms. So each spring
//! is solved implicitly, for the end of the step, on positions (extended position based dynamics,
//! `Xpbd`): the stiffer the spring, the nearer to its rest length.

use crate::base::lanes::Real;

/// Springs of one stiffness during one step: equation 1, f = −k(|d| − l) u − c (ḋ·u) u on node b and the
/// opposite on a, with d = u |d| from a to b, at the end of the step.
///
/// Tensions here are forces times dt², per mass of a node (m): the displacement of a free node.
#[derive(Clone, Copy, Debug)]
pub struct Xpbd<R> {
    inverse_stiffness: R,
    friction: R,
    share: R,
    /// Compliance of the spring: its extension per tension, added to its ends' inverse masses.
    pub compliance: R,
}

impl<R: Real> Xpbd<R> {
    /// Springs of `stiffness` k/m > 0 (1/s²) and `damping` c/m (1/s) in a step of `dt` (s), in as
    /// many lanes as `like` has.
    #[inline(always)]
    pub fn new(like: R, stiffness: f32, damping: f32, dt: f32) -> Self {
        let (k, c, dt) = (f64::from(stiffness), f64::from(damping), f64::from(dt));
        let (inverse_stiffness, friction) = (1.0 / (k * dt * dt), c / (k * dt));
        let share = 1.0 / (1.0 + friction);
        Self {
            inverse_stiffness: like.lit(inverse_stiffness),
            friction: like.lit(friction),
            share: like.lit(share),
            compliance: like.lit(inverse_stiffness * share),
        }
    }

    /// Residual of a spring with the present `tension`: `stretch` is its extension over the rest length,
    /// `moved` its extension since the step began (m). Divided by compliance plus the ends' inverse
    /// masses it gives the missing tension.
    #[inline(always)]
    pub fn excess(&self, stretch: R, moved: R, tension: R) -> R {
        self.friction.mul_add(moved, stretch - self.inverse_stiffness * tension) * self.share
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    /// Equation 1 on node b, the opposite on a: f = −k(|d| − l) u − c (ḋ·u) u, with d from a to b.
    fn force(d: Vec3, rate: Vec3, length: f32, stiffness: f32, damping: f32) -> Vec3 {
        let distance = d.length();
        if distance < 1e-12 {
            return Vec3::ZERO;
        }
        let u = d / distance;
        u * (-stiffness * (distance - length) - damping * rate.dot(u))
    }

    #[test]
    fn the_printed_damper_feeds_energy_and_the_true_one_takes_it() {
        // A pair that closes in: the damper's power is f·ḋ.
        let (d, rate) = (Vec3::X, Vec3::X * -2.0);
        assert!(force(d, rate, 1.0, 10.0, 3.0).dot(rate) < 0.0);
        let printed = -d * (3.0 * rate.length());
        assert!(printed.dot(rate) > 0.0, "print pulls a closing pair together");
    }

    #[test]
    fn a_pair_ends_its_step_with_the_force_of_equation_1() {
        let (k, c, dt, length) = (3e3_f32, 20.0, 1.0 / 60.0, 1.0);
        let (from, predicted, wa, wb) = (1.1_f32, 1.25, 1.0, 0.25);
        let spring = Xpbd::new(0.0, k, c, dt);
        let excess = spring.excess(predicted - length, predicted - from, 0.0);
        let tension = excess / (wa + wb + spring.compliance);
        let end = predicted - (wa + wb) * tension;
        let f = force(Vec3::X * end, Vec3::X * ((end - from) / dt), length, k, c);
        assert!((f.x * dt * dt + tension).abs() < 1e-5 * tension, "{} {tension}", f.x * dt * dt);
        assert!(
            spring.excess(end - length, end - from, tension).abs() < 1e-6,
            "nothing is missing"
        );
    }
}
