//! How hair looks: colour from melanin, sheen, thickness.

use crate::setting::{Bound, HairSetting, Notes};
use bevy::prelude::*;

/// How much of the two pigments hair holds, which gives its colour.
///
/// The scale is that of Chiang et al. 2016 ("A practical and controllable hair and fur model"):
/// absorption is the pigments' spectra times these numbers, and the colour that a full head shows is
/// the albedo their equation gives for it.
#[derive(Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct Melanin {
    /// Brown-black pigment. 0 in white hair, about 2.5 in black hair; safe 0…8.
    pub eumelanin: f32,
    /// Yellow-red pigment. 0 in most hair, about 0.85 in red hair; safe 0…8.
    pub pheomelanin: f32,
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

impl Default for Melanin {
    fn default() -> Self {
        Self::DARK_BROWN
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
    /// Pigments. Default [`Melanin::DARK_BROWN`].
    pub melanin: Melanin,
    /// Dye: multiplies the pigments' colour. White, no dye, by default. Pigment cannot be dyed
    /// lighter: bleach first (little melanin), as on a real head.
    pub dye: Color,
    /// How much the amount of pigment differs from strand to strand, a share. Default 0.2,
    /// safe 0…0.5.
    pub variation: f32,
    /// Share of the pigment that sun has taken at the tips. Default 0.25, safe 0…1.
    pub tip_bleach: f32,
    /// Drawn width of a strand at the root (m). Default 0.35 mm, safe 0.05…5 mm. Real hair has
    /// 0.07 mm; a drawn strand stands for several.
    pub width: f32,
    /// Width at the tip as a share of that at the root. Default 0.3, safe 0…1.
    pub taper: f32,
    /// Roughness of the fibre: width of the highlights. Default 0.38, safe 0.1…1. Lower is sleeker.
    pub roughness: f32,
    /// Strength of the highlights; 1 is a clean fibre. Default 1, safe 0…4.
    pub gloss: f32,
    /// Strength of the light that shines through against the light. Default 0.4, safe 0…2.
    pub backlight: f32,
    /// How deep light goes into the hair where a light casts shadows (m). Default 12 mm,
    /// safe 1…100 mm. Lower gives harder shade between locks.
    pub self_shadow: f32,
    /// How much darker it is at the roots, a share. Default 0.5, safe 0…1.
    pub root_shade: f32,
    /// The reflection model. Default [`HairShading::Fibre`].
    pub shading: HairShading,
}

impl Default for HairLook {
    fn default() -> Self {
        Self {
            melanin: Melanin::default(),
            dye: Color::WHITE,
            variation: 0.2,
            tip_bleach: 0.25,
            width: 0.35e-3,
            taper: 0.3,
            roughness: 0.38,
            gloss: 1.0,
            backlight: 0.4,
            self_shadow: 12e-3,
            root_shade: 0.5,
            shading: HairShading::default(),
        }
    }
}

const MELANIN: Bound = Bound::new("Melanin", 0.0, 1e3, "2.5 of eumelanin is black");
const SHARE: Bound = Bound::new("a share of HairLook", 0.0, 1.0, "shares go from 0 to 1");
const WIDTH: Bound = Bound::new("HairLook::width (m)", 1e-6, 1.0, "0.00035 suits a head");
const ROUGHNESS: Bound = Bound::new("HairLook::roughness", 0.05, 1.0, "0.38 suits clean hair");
const STRENGTH: Bound = Bound::new("a strength of HairLook", 0.0, 100.0, "1 is natural");
const DEPTH: Bound = Bound::new("HairLook::self_shadow (m)", 0.0, 10.0, "0.012 suits a head");

impl HairSetting for HairLook {
    fn mended(&self, notes: &Notes) -> Self {
        let d = Self::default();
        Self {
            melanin: Melanin {
                eumelanin: MELANIN.mend(self.melanin.eumelanin, d.melanin.eumelanin, notes),
                pheomelanin: MELANIN.mend(self.melanin.pheomelanin, d.melanin.pheomelanin, notes),
            },
            dye: self.dye,
            variation: SHARE.mend(self.variation, d.variation, notes),
            tip_bleach: SHARE.mend(self.tip_bleach, d.tip_bleach, notes),
            width: WIDTH.mend(self.width, d.width, notes),
            taper: SHARE.mend(self.taper, d.taper, notes),
            roughness: ROUGHNESS.mend(self.roughness, d.roughness, notes),
            gloss: STRENGTH.mend(self.gloss, d.gloss, notes),
            backlight: STRENGTH.mend(self.backlight, d.backlight, notes),
            self_shadow: DEPTH.mend(self.self_shadow, d.self_shadow, notes),
            root_shade: SHARE.mend(self.root_shade, d.root_shade, notes),
            shading: self.shading,
        }
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
    fn a_broken_look_is_mended() {
        let broken = HairLook {
            width: f32::NAN,
            roughness: -1.0,
            dye: Color::linear_rgb(f32::NAN, 1.0, 1.0),
            ..default()
        };
        let mended = broken.mended(&Notes::default());
        assert_eq!(mended.width, HairLook::default().width);
        assert_eq!(mended.roughness, 0.05);
        assert!(mended.colors().0.is_finite());
    }
}
