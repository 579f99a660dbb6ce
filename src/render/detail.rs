//! How many strands are drawn, by their size on the screen.

use crate::base::setting::setting;
use bevy::prelude::*;

setting! {
    /// How finely hair is drawn: what a game turns down where drawing costs too much. Component of a
    /// [`Hair`](crate::Hair), may change at any time; where absent,
    /// [`HairDefault<HairDetail>`](crate::HairDefault) holds.
    ///
    /// Where fewer strands are drawn they are as many times wider: hair covers as much and keeps its
    /// colour. A strand's place in the order in which they vanish never changes, and near that place it
    /// fades, so that nothing pops as a camera comes near or goes away. With several cameras the nearest
    /// counts.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut app = App::new();
    /// // For a slow graphics device: a quarter of the strands of all hair.
    /// app.insert_resource(HairDefault(HairDetail { strands: 0.25, ..default() }));
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairDetail {
        /// Share of the strands that is drawn at most.
        pub strands: f32 = 1.0, in STRANDS: 0.0..=1.0, safe 0.05..=1.0, "1 draws all";
        /// Strands that would be narrower than this on the screen are drawn fewer and wider; 0 draws all
        /// at any distance.
        pub least_width: f32 = 0.5, "px" in LEAST_WIDTH: 0.0..=64.0, safe 0.0..=2.0,
            "0.5 is not seen";
        /// So many strands are drawn at any distance; hair of fewer is drawn whole.
        pub least_strands: u32 = 1000;
    }
}

/// Of the share that is drawn, the part at most over which strands fade.
const FADE: f32 = 0.1;

/// What part of a hair's strands is drawn.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DrawnShare {
    /// Strands of a rank below this share of all are drawn.
    pub(super) share: f32,
    /// The part of `share`, from its end, over which they fade.
    pub(super) fade: f32,
}

impl DrawnShare {
    pub(super) const ALL: Self = Self { share: 1.0, fade: 0.0 };

    /// Of `count` strands, `width` wide where a pixel is `pixel` (m); all where that is not known.
    pub(super) fn new(detail: &HairDetail, count: u32, width: f32, pixel: Option<f32>) -> Self {
        let fits = pixel.map_or(1.0, |pixel| width / (detail.least_width * pixel));
        let fits = if fits.is_nan() { 1.0 } else { fits };
        let least = (detail.least_strands.max(1) as f32 / count.max(1) as f32).min(1.0);
        let share = fits.min(detail.strands).clamp(least, 1.0);
        // None fade where all are drawn.
        Self { share, fade: (FADE * share).min(1.0 - share) }
    }

    /// How many times wider strands are drawn, so that together they cover as much: those that fade count
    /// half.
    pub(super) fn wider(self) -> f32 {
        1.0 / (self.share - 0.5 * self.fade)
    }

    /// How much of a strand of this rank (a share of all) is drawn.
    #[cfg(test)]
    fn alpha(self, rank: f32) -> f32 {
        ((self.share - rank) / self.fade.max(1e-6)).clamp(0.0, 1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(pixel: f32) -> DrawnShare {
        DrawnShare::new(&HairDetail::default(), 40_000, 0.15e-3, Some(pixel))
    }

    #[test]
    fn strands_cover_as_much_however_many_are_drawn() {
        for pixel in [1e-4, 2.9e-4, 3.1e-4, 5e-4, 2e-3, 5e-3, 1.0] {
            let drawn = at(pixel);
            let alphas = (0..40_000).map(|i| f64::from(drawn.alpha((i as f32 + 0.5) / 40_000.0)));
            let covered = alphas.sum::<f64>() / 40_000.0 * f64::from(drawn.wider());
            assert!((covered - 1.0).abs() < 1e-3, "{covered} at {pixel} m: {drawn:?}");
        }
        assert_eq!(at(1e-4), DrawnShare::ALL);
        assert_eq!(at(1.0).share, 1000.0 / 40_000.0);
    }

    #[test]
    fn a_strand_fades_and_never_comes_back_farther_away() {
        let steps = (0..400).map(|i| at(1e-4 * 1.01f32.powi(i)));
        for rank in [0.03, 0.2, 0.55, 0.85] {
            let mut before = 1.0;
            for drawn in steps.clone() {
                let now = drawn.alpha(rank);
                assert!(now <= before && before - now < 0.35, "{before} to {now} at {rank}");
                before = now;
            }
        }
    }

    #[test]
    fn broken_numbers_draw_something() {
        for number in [f32::NAN, f32::INFINITY, -1.0, 0.0] {
            for pixel in [Some(number), None] {
                let drawn = DrawnShare::new(&HairDetail::default(), 5000, number, pixel);
                assert!((0.2..=1.0).contains(&drawn.share) && drawn.wider().is_finite());
            }
        }
        let none = HairDetail { strands: 0.0, least_strands: 0, ..default() };
        assert!(DrawnShare::new(&none, 0, 1e-3, None).wider().is_finite());
        let nothing = HairDetail { least_width: 0.0, ..default() };
        let all = DrawnShare::new(&nothing, 5000, 1e-9, Some(1.0));
        assert_eq!(all, DrawnShare::ALL);
    }
}
