//! Pigments and colours, and what light they absorb: equations of Chiang et al. 2016 ("A practical and
//! controllable hair and fur model").

use crate::base::setting::setting;
use bevy::prelude::*;

/// Rate at which the albedo falls with the square root of absorption: Chiang et al. equation 9 at
/// azimuthal roughness 0.3.
const ALBEDO_FALL: f32 = 5.888;
/// The darkest component of a dye's colour; it absorbs more than black hair does.
const DARKEST: f32 = 1e-4;

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

    /// Absorption of red, green and blue light per radius of a fibre: light straight through is
    /// reduced to e^(−2 times this).
    pub fn absorption(&self) -> Vec3 {
        let absorption = Vec3::new(0.419, 0.697, 1.37) * self.eumelanin
            + Vec3::new(0.187, 0.4, 1.05) * self.pheomelanin;
        absorption.max(Vec3::ZERO)
    }

    /// The colour of a head of such hair.
    #[cfg(any(feature = "render", feature = "groom"))]
    pub fn color(&self) -> LinearRgba {
        HairColor::of(self.absorption()).into()
    }

    /// Between two, by absorption, which is proportional to the amount.
    #[cfg(feature = "save")]
    pub(crate) fn lerp(self, other: Self, t: f32) -> Self {
        Self {
            eumelanin: self.eumelanin.lerp(other.eumelanin, t),
            pheomelanin: self.pheomelanin.lerp(other.pheomelanin, t),
        }
    }
}

setting! {
    /// The colour that a head of hair shows in white light: linear red, green and blue. Made of any
    /// [`Color`](https://docs.rs/bevy/latest/bevy/color/enum.Color.html) by `From`.
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct HairColor {
        /// Red.
        pub red: f32 = 1.0, in RED_LIGHT: 0.0..=1.0, "linear, 0 to 1";
        /// Green.
        pub green: f32 = 1.0, in GREEN_LIGHT: 0.0..=1.0, "linear, 0 to 1";
        /// Blue.
        pub blue: f32 = 1.0, in BLUE_LIGHT: 0.0..=1.0, "linear, 0 to 1";
    }
}

impl HairColor {
    /// No colour.
    pub const WHITE: Self = Self::new(1.0, 1.0, 1.0);
    /// Black: absorbs all light.
    pub const BLACK: Self = Self::new(0.0, 0.0, 0.0);
    /// Candy pink.
    pub const PINK: Self = Self::new(0.85, 0.14, 0.36);
    /// A red that natural hair does not have.
    pub const CRIMSON: Self = Self::new(0.5, 0.015, 0.03);
    /// Copper.
    pub const COPPER: Self = Self::new(0.5, 0.13, 0.035);
    /// Turquoise.
    pub const TURQUOISE: Self = Self::new(0.05, 0.5, 0.5);
    /// Deep blue.
    pub const COBALT: Self = Self::new(0.03, 0.08, 0.5);
    /// Violet.
    pub const VIOLET: Self = Self::new(0.2, 0.06, 0.5);

    /// Linear red, green and blue, 0 to 1.
    pub const fn new(red: f32, green: f32, blue: f32) -> Self {
        Self { red, green, blue }
    }

    /// The colour of a head of hair with fibres of this absorption.
    pub fn of(absorption: Vec3) -> Self {
        let [red, green, blue] = absorption.to_array().map(|a| (-ALBEDO_FALL * a.sqrt()).exp());
        Self { red, green, blue }
    }

    /// Absorption of the fibres of a head of hair that shows this colour, as
    /// [`Melanin::absorption`]: (ln C / 5.888)², Chiang et al. equation 9.
    pub fn absorption(&self) -> Vec3 {
        let root = self.root_of_absorption();
        root * root
    }

    /// Its square root. NaN counts as white.
    pub(super) fn root_of_absorption(&self) -> Vec3 {
        let color = Vec3::new(self.red, self.green, self.blue);
        let color = color.map(|c| if c.is_nan() { 1.0 } else { c.clamp(DARKEST, 1.0) });
        -(color.map(f32::ln) / ALBEDO_FALL)
    }

    /// Between two, in linear light.
    #[cfg(feature = "save")]
    pub(crate) fn lerp(self, other: Self, t: f32) -> Self {
        Self {
            red: self.red.lerp(other.red, t),
            green: self.green.lerp(other.green, t),
            blue: self.blue.lerp(other.blue, t),
        }
    }
}

#[cfg(any(feature = "render", feature = "groom"))]
impl From<LinearRgba> for HairColor {
    /// Components are clamped to 0…1.
    fn from(LinearRgba { red, green, blue, .. }: LinearRgba) -> Self {
        let [red, green, blue] = [red, green, blue].map(|c| c.clamp(0.0, 1.0));
        Self { red, green, blue }
    }
}

#[cfg(any(feature = "render", feature = "groom"))]
impl From<Color> for HairColor {
    fn from(color: Color) -> Self {
        color.to_linear().into()
    }
}

#[cfg(any(feature = "render", feature = "groom"))]
impl From<HairColor> for LinearRgba {
    fn from(color: HairColor) -> Self {
        Self::rgb(color.red, color.green, color.blue)
    }
}
