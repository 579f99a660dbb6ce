//! What is drawn of the hair: its look, or a quantity as a heat map.

use crate::{base::setting::Ranged, keratin::bond::BondKind};
use bevy::prelude::*;

/// What is shown of a hair. Component of a [`Hair`](crate::Hair), may change at any time; where
/// absent, [`HairDefault<HairView>`](crate::HairDefault) holds.
///
/// Heat maps are neither lit nor tone-mapped by the material, so that values can be read from
/// colours: blue is 0, red is 1, see [`heat`].
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub enum HairView {
    /// Lit hair.
    #[default]
    Natural,
    /// The rate of one kind of bond: blue all cut, red all closed.
    Bond(BondKind),
    /// Stretch of the edges: blue none, red [`STRAIN_FULL`] or more.
    Strain,
    /// Water on and in the hair, [`Moisture::sheen`](crate::Moisture::sheen): blue dry, red soaked.
    Moisture,
    /// Lit, but only the strands that are simulated.
    Guides,
}

/// The strain that [`HairView::Strain`] shows red.
pub const STRAIN_FULL: f32 = 0.05;

/// The colour of `value` (0…1) in a heat map, for legends.
///
/// ```
/// # use bevy_keratin::render::heat; use bevy::prelude::*;
/// assert_eq!(heat(0.0), Color::srgb(0.0, 0.0, 1.0));
/// assert_eq!(heat(1.0), Color::srgb(1.0, 0.0, 0.0));
/// ```
pub fn heat(value: f32) -> Color {
    let v = if value.is_nan() { 0.0 } else { value.clamp(0.0, 1.0) };
    Color::srgb(v, 1.6 * v * (1.0 - v), 1.0 - v)
}

impl HairView {
    /// The view's number in the shader.
    pub(super) fn number(self) -> u32 {
        match self {
            Self::Natural => 0,
            Self::Bond(kind) => 1 + kind as u32,
            Self::Strain => 5,
            Self::Guides => 6,
            Self::Moisture => 7,
        }
    }
}

impl Ranged for HairView {}
