//! Bleach and dye.
//!
//! Both act on the fibre's absorption: bleach removes a share of it, dye adds its own. So colours
//! mix as they do in hair: dye on dark hair hardly shows, dye over dye darkens, and bleached hair
//! can become anything.

use super::{pigment::HairColor, streaks::Streaks};
use crate::base::setting::{Ranged, ValueRange, Violations, setting};
use bevy::prelude::*;

/// The most layers of dye that hair can have.
pub const MAX_LAYERS: usize = 4;

setting! {
    /// Layers of bleach and dye on a hair, applied one after the other. Component of a
    /// [`Hair`](crate::Hair), may change at any time; applied to the colour of its
    /// [`HairLook`](super::HairLook), and saved with its hairdo.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut world = World::new();
    /// // Pink hair, whatever colour it was:
    /// world.spawn((Hair, HairDye::pink()));
    /// // Turquoise tips and, over them, a third of the strands bleached from the middle on:
    /// let dye = HairDye::of(DyeLayer::bleached(HairColor::TURQUOISE).tips(0.3))
    ///     .with(DyeLayer::bleach(0.8).between(0.5, 1.0).in_streaks(0.33));
    /// world.spawn((Hair, dye));
    /// ```
    #[derive(Component, Reflect, Clone, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairDye {
        /// The layers, in the order of application. At most [`MAX_LAYERS`]; further ones are
        /// ignored.
        pub layers: Vec<DyeLayer> = Vec::new() => clamp_layers;
    }
}

fn clamp_layers(layers: &mut Vec<DyeLayer>, violations: &mut Violations) {
    const COUNT: ValueRange =
        ValueRange::new("HairDye::layers", 0.0..=MAX_LAYERS as f32, "merge layers of the same dye");
    if let Err(wrong) = COUNT.check(layers.len()) {
        violations.push(wrong);
        layers.truncate(MAX_LAYERS);
    }
    layers.clamp_values(violations);
}

setting! {
    /// One visit to the hairdresser: some of the hair is bleached, then dyed. Part of [`HairDye`].
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct DyeLayer {
        /// The share of pigment and of earlier dye that is bleached out first.
        pub bleach: f32 = 0.0, in BLEACH: 0.0..=1.0, "0.8 makes black hair blond, 1 white";
        /// The colour that white hair takes on from the dye; white is no dye.
        pub color: HairColor = HairColor::WHITE => Ranged::clamp_values;
        /// Amount of dye, as a multiple of what gives white hair the colour. Absorption is
        /// proportional to it: less is paler.
        pub strength: f32 = 1.0, in STRENGTH: 0.0..=1e3, safe 0.0..=4.0, "1 gives the colour";
        /// Where along a strand it begins, a share of the length: 0 is the root.
        pub from: f32 = 0.0, in FROM: 0.0..=1.0, "0 is the root";
        /// Where it ends: 1 is the tip.
        pub to: f32 = 1.0, in TO: 0.0..=1.0, "1 is the tip";
        /// Share of the length over which it fades at these ends; it does not fade at the root and
        /// the tip themselves.
        pub fade: f32 = 0.1, in FADE: 0.0..=1.0, "0 is a hard edge, 0.5 a balayage";
        /// Which strands; `None` is all.
        pub streaks: Option<Streaks> = None => Ranged::clamp_values;
    }
}

impl DyeLayer {
    /// Dye on hair as it is. On dark hair it hardly shows.
    pub fn of(color: impl Into<HairColor>) -> Self {
        Self { color: color.into(), ..default() }
    }

    /// Dye on hair that is bleached for it: it shows the colour, whatever was there.
    pub fn bleached(color: impl Into<HairColor>) -> Self {
        Self { bleach: 1.0, ..Self::of(color) }
    }

    /// Bleach alone: removes this share of the pigment.
    pub fn bleach(share: f32) -> Self {
        Self { bleach: share, ..default() }
    }

    /// The same between two places along strands: 0 is the root, 1 the tip.
    pub fn between(self, from: f32, to: f32) -> Self {
        Self { from, to, ..self }
    }

    /// The same on the roots only, up to this share of the length.
    pub fn roots(self, share: f32) -> Self {
        self.between(0.0, share)
    }

    /// The same on the tips only, this last share of the length.
    pub fn tips(self, share: f32) -> Self {
        self.between(1.0 - share, 1.0)
    }

    /// The same on this share of strands, in streaks.
    pub fn in_streaks(self, share: f32) -> Self {
        let streaks = self.streaks.unwrap_or_default();
        Self { streaks: Some(Streaks { share, ..streaks }), ..self }
    }

    /// Absorption of the dye, without bleach.
    pub fn absorption(&self) -> Vec3 {
        self.strength * self.color.absorption()
    }

    /// The layer's weight at a place along a strand, 0 root … 1 tip.
    pub fn cover(&self, along: f32) -> f32 {
        let half = 0.5 * self.fade;
        let begun =
            if self.from > 0.0 { smooth(self.from - half, self.from + half, along) } else { 1.0 };
        let ended = if self.to < 1.0 { smooth(self.to - half, self.to + half, along) } else { 0.0 };
        begun * (1.0 - ended)
    }

    /// Interpolates between this layer (0) and another (1).
    #[cfg(feature = "save")]
    fn lerp(self, other: Self, t: f32) -> Self {
        let streaks = match (self.streaks, other.streaks) {
            (Some(a), Some(b)) => Some(Streaks { share: a.share.lerp(b.share, t), ..a }),
            (streaks, _) => streaks,
        };
        // By absorption, as dyes mix.
        let mean = self.absorption().lerp(other.absorption(), t);
        Self {
            bleach: self.bleach.lerp(other.bleach, t),
            color: HairColor::of(mean),
            strength: 1.0,
            from: self.from.lerp(other.from, t),
            to: self.to.lerp(other.to, t),
            fade: self.fade.lerp(other.fade, t),
            streaks,
        }
    }

    /// Scales bleach and dye.
    #[cfg(feature = "save")]
    fn scaled(self, share: f32) -> Self {
        Self { bleach: self.bleach * share, strength: self.strength * share, ..self }
    }

    /// Whether both choose the same strands, apart from their share.
    #[cfg(feature = "save")]
    fn is_on_same_strands(&self, other: &Self) -> bool {
        let which = |streaks: Option<Streaks>| streaks.map(|s| (s.seed, s.width.to_bits()));
        which(self.streaks) == which(other.streaks)
    }
}

/// `smoothstep`, a step where the edges are one.
fn smooth(low: f32, high: f32, at: f32) -> f32 {
    let t = ((at - low) / (high - low).max(1e-6)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

impl HairDye {
    /// One layer.
    pub fn of(layer: DyeLayer) -> Self {
        Self { layers: vec![layer] }
    }

    /// Bleached and dyed all over: hair of this colour, whatever it was.
    pub fn from_color(color: impl Into<HairColor>) -> Self {
        Self::of(DyeLayer::bleached(color))
    }

    /// Pink hair.
    pub fn pink() -> Self {
        Self::from_color(HairColor::PINK)
    }

    /// The same with another layer over it.
    pub fn with(mut self, layer: DyeLayer) -> Self {
        self.layers.push(layer);
        self
    }

    /// Whether nothing was done.
    pub fn is_none(&self) -> bool {
        self.layers.is_empty()
    }

    /// Absorption of a fibre at a place along a strand (0 root … 1 tip) whose natural absorption is
    /// `natural`; `is_in_streak` says for each layer with streaks whether the strand is in one. The
    /// same as `dyed` in `shading.wgsl`.
    pub fn absorption(
        &self,
        natural: Vec3,
        along: f32,
        is_in_streak: impl Fn(usize) -> bool,
    ) -> Vec3 {
        let mut absorption = natural;
        for (i, layer) in self.layers.iter().take(MAX_LAYERS).enumerate() {
            if layer.streaks.is_none() || is_in_streak(i) {
                let cover = layer.cover(along);
                absorption = absorption * (1.0 - layer.bleach * cover) + layer.absorption() * cover;
            }
        }
        absorption
    }

    /// Interpolates between two dyes: exactly this at `t` = 0, the other at 1. Layers on the same
    /// strands mix by absorption; where the streaks differ, the first fade out before the second
    /// fade in.
    #[cfg(feature = "save")]
    pub(crate) fn blend(&self, other: &Self, t: f32) -> Self {
        let none = DyeLayer::default;
        let count = self.layers.len().max(other.layers.len());
        let layers = (0..count).map(|i| {
            let (a, b) = (self.layers.get(i), other.layers.get(i));
            match (a, b) {
                (Some(a), Some(b)) if a.is_on_same_strands(b) => a.lerp(*b, t),
                (Some(a), Some(_)) if t < 0.5 => a.scaled(1.0 - 2.0 * t),
                (Some(_), Some(b)) => b.scaled(2.0 * t - 1.0),
                (Some(a), None) => a.scaled(1.0 - t),
                (None, Some(b)) => b.scaled(t),
                (None, None) => none(),
            }
        });
        match t {
            0.0 => self.clone(),
            1.0 => other.clone(),
            _ => Self { layers: layers.collect() },
        }
    }
}
