//! Whether a groom has a plausible size: few files specify their unit.

use super::Groom;
use bevy::prelude::*;
use core::{fmt, ops::RangeInclusive};

/// Plausible sizes of a groom (m): from a lash to a horse.
const SIZES: RangeInclusive<f32> = 5e-3..=4.0;
/// Plausible median lengths of strands (m): from stubble to the floor.
const LENGTHS: RangeInclusive<f32> = 1e-3..=2.0;
/// Size of the hair of a head (m), the most likely content of a file.
const HEAD: f32 = 0.4;
/// Units that files are made in (m): metre, foot, decimetre, inch, centimetre, a tenth of an inch,
/// millimetre.
const UNITS: [f32; 7] = [1.0, 0.3048, 0.1, 0.0254, 0.01, 0.00254, 0.001];

/// An implausible size of a groom, and a better scale: see [`Groom::odd_size`].
/// [`Display`](fmt::Display) gives the sentence.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct OddSize {
    /// The longest side of the box around it (m).
    pub size: f32,
    /// The median length of the strands (m).
    pub length: f32,
    /// Metres per unit of the file that would fit.
    pub scale: f32,
}

impl fmt::Display for OddSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "it is {:.3e} m large with strands of {:.3e} m, expected {} to {} m with strands of {} to \
             {} m; {} m a unit would fit",
            self.size,
            self.length,
            SIZES.start(),
            SIZES.end(),
            LENGTHS.start(),
            LENGTHS.end(),
            self.scale
        )
    }
}

impl Groom {
    /// The box around all nodes, as its least and greatest corner (m); `None` without nodes.
    pub fn extents(&self) -> Option<(Vec3, Vec3)> {
        let first = *self.points.first()?;
        let grown = |(low, high): (Vec3, Vec3), p: &Vec3| (low.min(*p), high.max(*p));
        Some(self.points.iter().fold((first, first), grown))
    }

    /// Detects a size implausible for hair, because a file was read with the wrong `scale` (metres per
    /// unit; 1 for grooms not from a file). Gives a better scale: that of the usual unit which comes
    /// nearest to the hair of a head, or else one that makes it as large.
    ///
    /// `None` for a plausible size: 5 mm to 4 m large, with a median strand of 1 mm to 2 m.
    ///
    /// ```
    /// # use bevy_keratin::authoring::groom::Groom; use bevy::prelude::*;
    /// let tail = (0..9).map(|i| [Vec3::X * i as f32, Vec3::new(i as f32, -40.0, 0.0)]);
    /// let tail = Groom::from_polylines(tail).unwrap();
    /// assert_eq!(tail.odd_size(1.0).unwrap().scale, 0.01); // it is in centimetres
    /// assert_eq!(tail.scaled(0.01).unwrap().odd_size(0.01), None);
    /// ```
    pub fn odd_size(&self, scale: f32) -> Option<OddSize> {
        let (low, high) = self.extents()?;
        let size = (high - low).max_element();
        let mut lengths: Vec<f32> = self.strands().map(|s| s.length()).collect();
        let middle = lengths.len() / 2;
        let length = *lengths.select_nth_unstable_by(middle, f32::total_cmp).1;
        let fits =
            |factor: f32| SIZES.contains(&(size * factor)) && LENGTHS.contains(&(length * factor));
        let odd = !fits(1.0) && size > 0.0 && size.is_finite() && scale > 0.0 && scale.is_finite();
        let off = |unit: &f32| (size * (unit / scale) / HEAD).ln().abs();
        odd.then(|| {
            let fitting = UNITS.into_iter().filter(|unit| fits(unit / scale));
            let unit = fitting.min_by(|a, b| off(a).total_cmp(&off(b)));
            OddSize { size, length, scale: unit.unwrap_or(scale * (HEAD / size)) }
        })
    }
}
