//! The preset that hair was grown from.

use crate::base::setting::setting;
use bevy::prelude::*;

setting! {
    /// The preset that a [`Hair`](crate::Hair) has grown from, so that the same hair can be grown again.
    /// Component of the hair, which `WearHair` writes; insert it where a preset is planted by hand.
    /// It is saved with the hairdo.
    #[derive(Component, Reflect, Clone, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct WornPreset {
        /// The preset's name, such as `Curly`; empty is none.
        pub name: String = String::new();
        /// The seed by which it was planted.
        pub seed: u64 = 0;
        /// Its length, as a multiple of the preset's own.
        pub length: f32 = 1.0, in LENGTH: 0.05..=20.0, safe 0.3..=2.0, "1 is the preset's own";
    }
}
