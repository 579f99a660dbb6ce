//! Settings: influence of each kind of bond, and wear of the cuticle.

use super::kind::BondKind;
use crate::base::setting::{InvalidValue, Ranged, ValueRange, Violations, setting};
use bevy::prelude::*;

setting! {
    /// How much each kind of bond contributes to the shape: the influences f_j of equation 15, as
    /// shares of their sum. Component of a [`Hair`](crate::Hair); where absent,
    /// [`HairDefault<BondInfluence>`](crate::HairDefault) holds.
    ///
    /// The default is \[B\] table 1's scenes 1 and 2, hydrogen 33 %, the other 67 % in the
    /// proportions of the perm scene's ionic, disulfide and peptide bonds.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct BondInfluence {
        /// f of the hydrogen bonds.
        pub hydrogen: f32 = 0.33, in HYDROGEN: 0.0..=1e6, safe 0.0..=1.0, "a share such as 0.33";
        /// f of the ionic bonds.
        pub ionic: f32 = 0.30, in IONIC: 0.0..=1e6, safe 0.0..=1.0, "a share such as 0.3";
        /// f of the disulfide bonds.
        pub disulfide: f32 = 0.20, in DISULFIDE: 0.0..=1e6, safe 0.0..=1.0, "a share such as 0.2";
        /// f of the peptide bonds.
        pub peptide: f32 = 0.17, in PEPTIDE: 0.0..=1e6, safe 0.0..=1.0, "a share such as 0.17";
    }
    then Self::check_sum
}

impl BondInfluence {
    /// Influences of hydrogen, ionic, disulfide and peptide bonds; only their proportions count.
    ///
    /// # Errors
    /// When one is negative or not finite, or all are zero.
    pub fn new(
        hydrogen: f32,
        ionic: f32,
        disulfide: f32,
        peptide: f32,
    ) -> Result<Self, InvalidValue> {
        Self { hydrogen, ionic, disulfide, peptide }.checked()
    }

    /// The influences by [`BondKind`] as index.
    #[doc(hidden)]
    pub fn as_array(&self) -> [f32; BondKind::COUNT] {
        [self.hydrogen, self.ionic, self.disulfide, self.peptide]
    }

    fn check_sum(&mut self, violations: &mut Violations) {
        const SUM: ValueRange = ValueRange::new(
            "the sum of BondInfluence",
            1e-6..=1e7,
            "give at least one kind a positive influence",
        );
        if let Err(wrong) = SUM.check(self.as_array().iter().sum::<f32>()) {
            violations.push(wrong);
            *self = default();
        }
    }
}

setting! {
    /// Wear of the cuticle, which softens hair toward the tip: equations 13 and 14. Component of a
    /// [`Hair`](crate::Hair); where absent, [`HairDefault<Cuticle>`](crate::HairDefault) holds.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct Cuticle {
        /// s, share of the cuticle lost per length from the root.
        pub damage: f32 = 0.33, "1/m" in DAMAGE: 0.0..=1e4, safe 0.0..=10.0, "the paper uses 0.33";
        /// k_cut / k_o, the share of stiffness lost where the cuticle is gone.
        pub softening: f32 = 0.5764, in SOFTENING: 0.0..=0.99, safe 0.0..=0.9,
            "the paper uses 0.5764";
    }
}
