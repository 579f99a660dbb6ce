//! How hair looks: colour from melanin, sheen, thickness.

use crate::setting::{Ranged, setting};
use bevy::prelude::*;

/// Of the albedo with the root of absorption: Chiang et al. equation 9 at azimuthal roughness 0.3.
const ALBEDO_FALL: f32 = 5.888;

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

    /// How much of red, green and blue light a fibre takes, by its radius: light straight through
    /// loses e^(−2 times this).
    pub fn absorption(&self) -> Vec3 {
        let absorption = Vec3::new(0.419, 0.697, 1.37) * self.eumelanin
            + Vec3::new(0.187, 0.4, 1.05) * self.pheomelanin;
        absorption.max(Vec3::ZERO)
    }

    /// The colour of a head of such hair.
    pub fn color(&self) -> LinearRgba {
        let [red, green, blue] =
            self.absorption().to_array().map(|a| (-ALBEDO_FALL * a.sqrt()).exp());
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
        /// Share of strands without pigment: what makes hair grey.
        pub grey: f32 = 0.0, in GREY: 0.0..=1.0, "0.5 is salt and pepper";
        /// Share of the pigment that sun has taken at the tips.
        pub tip_bleach: f32 = 0.25, in TIP_BLEACH: 0.0..=1.0, "0.25 is a summer";
        /// Drawn width of a strand at the root. Real hair has 0.07 mm; a drawn strand stands for
        /// several.
        pub width: f32 = 0.35e-3, "m" in WIDTH: 1e-6..=1.0, safe 0.05e-3..=5e-3,
            "0.00035 suits a head";
        /// Width at the tip as a share of that at the root.
        pub taper: f32 = 0.3, in TAPER: 0.0..=1.0, "0.3 is natural";
        /// Over what length strands grow visible out of the scalp.
        pub root_fade: f32 = 1.5e-3, "m" in ROOT_FADE: 0.0..=1.0, safe 0.0..=0.01,
            "0.0015 is natural";
        /// Roughness of the fibre: its square is the standard deviation of the first highlight along
        /// the fibre in radians (Karis 2016; 0.38 makes 8°, Marschner et al. 2003 measured 5° to 10°).
        /// Lower is sleeker.
        pub roughness: f32 = 0.38, in ROUGHNESS: 0.05..=1.0, safe 0.1..=1.0,
            "0.38 suits clean hair";
        /// Strength of the highlights off and from inside the fibre; 1 is a clean fibre, above that
        /// hair returns more light than it receives.
        pub gloss: f32 = 1.0, in GLOSS: 0.0..=100.0, safe 0.0..=4.0, "1 is natural";
        /// Strength of the light straight through the fibre, seen against the light; 1 is a whole
        /// fibre.
        pub backlight: f32 = 1.0, in BACKLIGHT: 0.0..=100.0, safe 0.0..=2.0, "1 is natural";
        /// How dense hair is to light that casts shadows, as a multiple of what the drawn strands
        /// come to. Higher gives darker shade between locks.
        pub shadow_density: f32 = 1.0, in SHADOW_DENSITY: 0.0..=1e3, safe 0.0..=4.0,
            "1 is as drawn";
        /// How much less light from all around comes to the roots, a share.
        pub root_shade: f32 = 0.5, in ROOT_SHADE: 0.0..=1.0, "0.5 is full hair";
        /// The reflection model.
        pub shading: HairShading = HairShading::Fibre;
    }
}

impl HairLook {
    /// The fibres' absorption at root and tip, dye included.
    pub(super) fn absorptions(&self) -> (Vec3, Vec3) {
        let dye = self.dye.to_linear();
        let dye = Vec3::new(dye.red, dye.green, dye.blue);
        // NaN is no dye; black takes all that black hair takes, and more.
        let dye = dye.map(|c| if c.is_nan() { 1.0 } else { c.clamp(1e-4, 1.0) });
        let dyed = |melanin: Melanin| {
            let root = melanin.absorption().map(f32::sqrt) - dye.map(f32::ln) / ALBEDO_FALL;
            root * root
        };
        let tip = Melanin {
            eumelanin: self.melanin.eumelanin * (1.0 - self.tip_bleach),
            pheomelanin: self.melanin.pheomelanin * (1.0 - self.tip_bleach),
        };
        (dyed(self.melanin), dyed(tip))
    }
}

/// How wet each node of a strand looks, root first: 0 dry, 1 soaked. Component of a strand for those
/// who know better than its water ([`Moisture::sheen`](crate::Moisture::sheen)), which is what shows
/// where this is absent. Wet hair is drawn darker, with a film's sheen and in tighter locks ([`HairFollowers::wet_clump`](super::HairFollowers::wet_clump)).
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
        let (root, tip) = clamped.absorptions();
        assert!(root.is_finite() && tip.is_finite());
        let black = HairLook { dye: Color::BLACK, ..default() };
        assert!(black.absorptions().0.is_finite() && black.absorptions().0.min_element() > 1.0);
    }

    #[test]
    fn dye_multiplies_the_colour_that_a_head_shows() {
        let look = HairLook {
            melanin: Melanin::BLOND,
            dye: Color::linear_rgb(0.9, 0.2, 0.5),
            tip_bleach: 0.0,
            ..default()
        };
        let albedo = look.absorptions().0.map(|a| (-ALBEDO_FALL * a.sqrt()).exp());
        let expected =
            Vec3::from(Melanin::BLOND.color().to_f32_array_no_alpha()) * Vec3::new(0.9, 0.2, 0.5);
        assert!((albedo - expected).abs().max_element() < 1e-4, "{albedo} for {expected}");
    }
}
