//! How much of a style is left, as pure functions.
//!
//! Peptide bonds never break, so the shape that they remember is hair's natural shape. A style is the
//! difference that the other bonds make: at each joint the rest shape Ω* of all bonds together
//! (equation 15) minus that of the peptide bonds. The share left later is the projection of the
//! present difference on the original one.

use crate::keratin::bond::{BondKind, model::JointBonds};
use glam::Vec3;

/// The rest shape of a joint's bonds relative to hair's natural shape.
pub(crate) fn styled(joint: &JointBonds, influence: &[f32; BondKind::COUNT]) -> Vec3 {
    joint.relaxed(influence) - joint.shapes[BondKind::Peptide as usize]
}

/// Sums over joints.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct KeptSum {
    left: f64,
    whole: f64,
}

/// A style with a smaller Σ over joints of squared differences of Darboux vectors counts as none.
const NO_STYLE: f64 = 1e-8;

impl KeptSum {
    /// Adds a joint that was styled to `style` and is at `now`.
    pub fn add(&mut self, style: Vec3, now: Vec3) {
        let (left, whole) = (f64::from(style.dot(now)), f64::from(style.length_squared()));
        if left.is_finite() && whole.is_finite() {
            self.left += left;
            self.whole += whole;
        }
    }

    /// The share that is left: 1 as it was made, 0 gone; `None` where there was no style.
    pub fn kept(&self) -> Option<f32> {
        (self.whole > NO_STYLE).then(|| (self.left / self.whole) as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_share_left_is_the_part_along_the_style() {
        let styles = [Vec3::X * 0.1, Vec3::Y * 0.2, Vec3::new(0.05, 0.0, -0.1)];
        let share = |of: &dyn Fn(Vec3) -> Vec3| {
            let mut sum = KeptSum::default();
            styles.iter().for_each(|style| sum.add(*style, of(*style)));
            sum.kept().unwrap()
        };
        assert!((share(&|style| style) - 1.0).abs() < 1e-6);
        assert!((share(&|style| style * 0.25) - 0.25).abs() < 1e-6);
        assert!(share(&|style| style.any_orthogonal_vector()).abs() < 1e-6, "bent another way");
        assert!((share(&|style| -style) + 1.0).abs() < 1e-6, "to the other side");
        // No style and NaN give `None`.
        let mut sum = KeptSum::default();
        sum.add(Vec3::ZERO, Vec3::X);
        sum.add(Vec3::NAN, Vec3::X);
        assert_eq!(sum.kept(), None);
    }

    #[test]
    fn a_style_is_made_by_all_but_peptide_bonds() {
        let own = Vec3::new(0.01, 0.0, 0.0);
        let mut joint = JointBonds::closed(own);
        let influence = [0.3, 0.2, 0.2, 0.3];
        assert!(styled(&joint, &influence).length() < 1e-7, "as it grew");
        joint.shapes[BondKind::Hydrogen as usize] = own + Vec3::Y;
        assert!(styled(&joint, &influence).distance(Vec3::Y * 0.3) < 1e-6);
        // Wet: no style is left.
        joint.rates[BondKind::Hydrogen as usize] = 0.0;
        assert!(styled(&joint, &influence).length() < 1e-6);
    }
}
