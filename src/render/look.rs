//! How hair looks: colour from melanin, sheen, thickness.

use crate::setting::{Ranged, setting};
use bevy::prelude::*;

setting! {
    /// How much of the two pigments hair holds, which gives its colour.
    ///
    /// The scale is that of Chiang et al. 2016 ("A practical and controllable hair and fur model"):
    /// absorption is the pigments' spectra times these numbers, and the colour that a full head shows is
    /// the albedo their equation gives for it.
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct Melanin {
        /// Brown-black pigment. 0 in white hair, about 2.5 in black hair.
        pub eumelanin: f32 = 1.0, in EUMELANIN: 0.0..=1e3, safe 0.0..=8.0, "2.5 is black";
        /// Yellow-red pigment. 0 in most hair, about 0.85 in red hair.
        pub pheomelanin: f32 = 0.08, in PHEOMELANIN: 0.0..=1e3, safe 0.0..=8.0, "0.85 is red";
    }
}

impl Melanin {
    /// Black hair.
    pub const BLACK: Self = Self::new(2.5, 0.0);
    /// Dark brown hair, the most frequent colour after black.
    pub const DARK_BROWN: Self = Self::new(1.0, 0.08);
    /// Mid-brown hair.
    pub const BROWN: Self = Self::new(0.5, 0.08);
    /// Reddish brown hair.
    pub const AUBURN: Self = Self::new(0.35, 0.7);
    /// Red hair.
    pub const RED: Self = Self::new(0.07, 0.85);
    /// Blond hair.
    pub const BLOND: Self = Self::new(0.1, 0.04);
    /// Very light blond hair.
    pub const PLATINUM: Self = Self::new(0.02, 0.01);
    /// Grey hair as a mixture: strands without pigment among others.
    pub const GREY: Self = Self::new(0.05, 0.0);

    /// Amounts of eumelanin and pheomelanin.
    pub const fn new(eumelanin: f32, pheomelanin: f32) -> Self {
        Self { eumelanin, pheomelanin }
    }

    /// The colour of a head of such hair.
    pub fn color(&self) -> LinearRgba {
        let absorbed = Vec3::new(0.419, 0.697, 1.37) * self.eumelanin
            + Vec3::new(0.187, 0.4, 1.05) * self.pheomelanin;
        // Chiang et al. equation 9 at azimuthal roughness 0.3.
        let [red, green, blue] = absorbed.to_array().map(|a| (-5.888 * a.max(0.0).sqrt()).exp());
        LinearRgba::rgb(red, green, blue)
    }
}

/// The reflection model.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub enum HairShading {
    /// Marschner-like fibre: reflection off the cuticle, light straight through, and the tinted
    /// second highlight from inside.
    #[default]
    Fibre,
    /// Kajiya–Kay, \[W\] equation 3, with two shifted lobes: cheaper, flatter.
    KajiyaKay,
}

setting! {
    /// How hair looks. Component of a [`Hair`](crate::Hair), may change at any time; where absent,
    /// [`HairDefault<HairLook>`](crate::HairDefault) holds.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy_keratin::render::*; use bevy::prelude::*;
    /// # let mut world = World::new();
    /// world.spawn((Hair, HairLook { melanin: Melanin::AUBURN, ..default() }));
    /// ```
    #[derive(Component, Reflect, Clone, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairLook {
        /// Pigments.
        pub melanin: Melanin = Melanin::DARK_BROWN => Ranged::clamp_values;
        /// Dye: multiplies the pigments' colour; white is no dye. Pigment cannot be dyed lighter:
        /// bleach first (little melanin), as on a real head.
        pub dye: Color = Color::WHITE;
        /// How much the amount of pigment differs from strand to strand, a share.
        pub variation: f32 = 0.2, in VARIATION: 0.0..=1.0, safe 0.0..=0.5, "0.2 is natural";
        /// Share of the pigment that sun has taken at the tips.
        pub tip_bleach: f32 = 0.25, in TIP_BLEACH: 0.0..=1.0, "0.25 is a summer";
        /// Drawn width of a strand at the root. Real hair has 0.07 mm; a drawn strand stands for
        /// several.
        pub width: f32 = 0.35e-3, "m" in WIDTH: 1e-6..=1.0, safe 0.05e-3..=5e-3,
            "0.00035 suits a head";
        /// Width at the tip as a share of that at the root.
        pub taper: f32 = 0.3, in TAPER: 0.0..=1.0, "0.3 is natural";
        /// Roughness of the fibre: width of the highlights. Lower is sleeker.
        pub roughness: f32 = 0.38, in ROUGHNESS: 0.05..=1.0, safe 0.1..=1.0,
            "0.38 suits clean hair";
        /// Strength of the highlights; 1 is a clean fibre.
        pub gloss: f32 = 1.0, in GLOSS: 0.0..=100.0, safe 0.0..=4.0, "1 is natural";
        /// Strength of the light that shines through against the light.
        pub backlight: f32 = 0.4, in BACKLIGHT: 0.0..=100.0, safe 0.0..=2.0, "0.4 is natural";
        /// How deep light goes into the hair where a light casts shadows. Lower gives harder shade
        /// between locks.
        pub self_shadow: f32 = 12e-3, "m" in SELF_SHADOW: 0.0..=10.0, safe 1e-3..=0.1,
            "0.012 suits a head";
        /// How much darker it is at the roots, a share.
        pub root_shade: f32 = 0.5, in ROOT_SHADE: 0.0..=1.0, "0.5 is full hair";
        /// The reflection model.
        pub shading: HairShading = HairShading::Fibre;
    }
}

impl HairLook {
    /// The colours at root and tip.
    pub(super) fn colors(&self) -> (Vec3, Vec3) {
        let dye = self.dye.to_linear();
        let dye = Vec3::new(dye.red, dye.green, dye.blue).clamp(Vec3::ZERO, Vec3::ONE);
        let dye = if dye.is_nan() { Vec3::ONE } else { dye };
        let tip = Melanin {
            eumelanin: self.melanin.eumelanin * (1.0 - self.tip_bleach),
            pheomelanin: self.melanin.pheomelanin * (1.0 - self.tip_bleach),
        };
        let rgb = |m: &Melanin| Vec3::from(m.color().to_f32_array_no_alpha()) * dye;
        (rgb(&self.melanin), rgb(&tip))
    }
}

/// How wet each node of a strand looks, root first: 0 dry, 1 soaked. Component of a strand for those
/// who know better than its water ([`Moisture::sheen`](crate::Moisture::sheen)), which is what shows
/// where this is absent. Wet hair is drawn darker, glossier and in tighter locks ([`HairFollowers::wet_clump`](super::HairFollowers::wet_clump)).
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct WetLook(pub Vec<f32>);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_melanin_is_darker_and_pheomelanin_redder() {
        let luminance = |m: Melanin| m.color().luminance();
        assert!(luminance(Melanin::BLACK) < luminance(Melanin::DARK_BROWN));
        assert!(luminance(Melanin::DARK_BROWN) < luminance(Melanin::BROWN));
        assert!(luminance(Melanin::BROWN) < luminance(Melanin::BLOND));
        assert!(luminance(Melanin::BLOND) < luminance(Melanin::PLATINUM));
        assert_eq!(Melanin::new(0.0, 0.0).color(), LinearRgba::WHITE);
        let redness = |m: Melanin| m.color().red / m.color().green;
        assert!(redness(Melanin::RED) > 1.5 * redness(Melanin::BLOND));
    }

    #[test]
    fn a_broken_look_is_clamped() {
        let broken = HairLook {
            width: f32::NAN,
            roughness: -1.0,
            dye: Color::linear_rgb(f32::NAN, 1.0, 1.0),
            ..default()
        };
        let clamped = broken.clamped();
        assert_eq!(clamped.width, HairLook::default().width);
        assert_eq!(clamped.roughness, 0.05);
        assert!(clamped.colors().0.is_finite());
    }
}
