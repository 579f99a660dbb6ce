//! The look of hair: pigments, sheen, thickness.

use super::pigment::{HairColor, Melanin};
use crate::base::setting::{Ranged, setting};
use bevy::prelude::*;

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
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut world = World::new();
    /// world.spawn((Hair, HairLook { melanin: Melanin::AUBURN, ..default() }));
    /// ```
    #[derive(Component, Reflect, Clone, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairLook {
        /// Pigments.
        pub melanin: Melanin = Melanin::DARK_BROWN => Ranged::clamp_values;
        /// A dye all over: multiplies the pigments' colour; white is none. For bleach, roots, tips and
        /// streaks see [`HairDye`](super::HairDye).
        pub dye: HairColor = HairColor::WHITE => Ranged::clamp_values;
        /// How much the amount of pigment differs from strand to strand, a share.
        pub variation: f32 = 0.2, in VARIATION: 0.0..=1.0, safe 0.0..=0.5, "0.2 is natural";
        /// Share of strands without pigment, which makes hair grey.
        pub grey: f32 = 0.0, in GREY: 0.0..=1.0, "0.5 is salt and pepper";
        /// Share of the pigment that sun has bleached at the tips.
        pub tip_bleach: f32 = 0.25, in TIP_BLEACH: 0.0..=1.0, "0.25 is a summer";
        /// Drawn width of a strand at the root. Real hair has 0.07 mm; a drawn strand stands for
        /// several.
        pub width: f32 = 0.35e-3, "m" in WIDTH: 1e-6..=1.0, safe 0.05e-3..=5e-3,
            "0.00035 suits a head";
        /// Width at the tip as a share of that at the root.
        pub taper: f32 = 0.3, in TAPER: 0.0..=1.0, "0.3 is natural";
        /// Length from the root over which strands fade in.
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
        /// Density of hair for shadows, as a multiple of the density of the drawn strands. Higher gives
        /// darker shadows between locks.
        pub shadow_density: f32 = 1.0, in SHADOW_DENSITY: 0.0..=1e3, safe 0.0..=4.0,
            "1 is as drawn";
        /// Ambient occlusion at the roots, a share.
        pub root_shade: f32 = 0.5, in ROOT_SHADE: 0.0..=1.0, "0.5 is full hair";
        /// The reflection model.
        pub shading: HairShading = HairShading::Fibre;
    }
}

impl HairLook {
    /// The fibres' absorption at root and tip, dye included.
    #[cfg(feature = "render")]
    pub(crate) fn absorptions(&self) -> (Vec3, Vec3) {
        let dye = self.dye.root_of_absorption();
        let dyed = |melanin: Melanin| {
            let root = melanin.absorption().map(f32::sqrt) + dye;
            root * root
        };
        let tip = Melanin {
            eumelanin: self.melanin.eumelanin * (1.0 - self.tip_bleach),
            pheomelanin: self.melanin.pheomelanin * (1.0 - self.tip_bleach),
        };
        (dyed(self.melanin), dyed(tip))
    }

    /// Between two: pigments by absorption, dye in linear light, the nearer one's reflection model.
    #[cfg(feature = "save")]
    pub(crate) fn blend(&self, other: &Self, t: f32) -> Self {
        match t {
            0.0 => return self.clone(),
            1.0 => return other.clone(),
            _ => {}
        }
        let mut blended = if t < 0.5 { self.clone() } else { other.clone() };
        blended.melanin = self.melanin.lerp(other.melanin, t);
        blended.dye = self.dye.lerp(other.dye, t);
        let numbers = self.numbers().into_iter().zip(other.numbers());
        for (number, (a, b)) in blended.numbers_mut().into_iter().zip(numbers) {
            *number = a.lerp(b, t);
        }
        blended
    }

    /// Its plain numbers, in the order of a hairdo's file.
    #[cfg(feature = "save")]
    pub(crate) fn numbers(&self) -> [f32; 11] {
        self.clone().numbers_mut().map(|number| *number)
    }

    /// The same, mutable.
    #[cfg(feature = "save")]
    pub(crate) fn numbers_mut(&mut self) -> [&mut f32; 11] {
        [
            &mut self.variation,
            &mut self.grey,
            &mut self.tip_bleach,
            &mut self.width,
            &mut self.taper,
            &mut self.root_fade,
            &mut self.roughness,
            &mut self.gloss,
            &mut self.backlight,
            &mut self.shadow_density,
            &mut self.root_shade,
        ]
    }
}

#[cfg(test)]
#[cfg(feature = "render")]
mod tests {
    use super::*;

    #[test]
    fn a_broken_look_is_clamped() {
        let broken = HairLook {
            width: f32::NAN,
            roughness: -1.0,
            dye: HairColor::new(f32::NAN, 1.0, 1.0),
            ..default()
        };
        let clamped = broken.clamped();
        assert_eq!(clamped.width, HairLook::default().width);
        assert_eq!(clamped.roughness, 0.05);
        let (root, tip) = clamped.absorptions();
        assert!(root.is_finite() && tip.is_finite());
        let black = HairLook { dye: HairColor::BLACK, ..default() };
        assert!(black.absorptions().0.is_finite() && black.absorptions().0.min_element() > 1.0);
    }

    #[test]
    fn dye_multiplies_the_colour_that_a_head_shows() {
        let look = HairLook {
            melanin: Melanin::BLOND,
            dye: HairColor::new(0.9, 0.2, 0.5),
            tip_bleach: 0.0,
            ..default()
        };
        let albedo = HairColor::of(look.absorptions().0);
        let expected =
            Vec3::from(Melanin::BLOND.color().to_f32_array_no_alpha()) * Vec3::new(0.9, 0.2, 0.5);
        let albedo = Vec3::new(albedo.red, albedo.green, albedo.blue);
        assert!((albedo - expected).abs().max_element() < 1e-4, "{albedo} for {expected}");
    }
}
