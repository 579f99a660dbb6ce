//! Whether a groom has a plausible size and stands upright: few files say their unit and axes.

use super::{Groom, UpAxis, strays::median};
use bevy::prelude::*;
use core::{fmt, ops::RangeInclusive};

/// Plausible sizes of a groom (m): from a lash to a horse.
const SIZES: RangeInclusive<f32> = 5e-3..=4.0;
/// Plausible median lengths of strands (m): from stubble to the floor.
const LENGTHS: RangeInclusive<f32> = 1e-3..=2.0;
/// Plausible radii of a head that roots are on (m), as far as a usual unit gives one of [`USUAL_HEADS`].
const HEADS: RangeInclusive<f32> = 0.045..=0.18;
/// Radii of people's heads, of stylised ones too (m).
const USUAL_HEADS: RangeInclusive<f32> = 0.06..=0.14;
/// Size of the hair of a head (m), its median length and the head's radius, the most likely content of a
/// file.
const SIZE: f32 = 0.4;
const LENGTH: f32 = 0.15;
const HEAD: f32 = 0.09;
/// Units that files are made in (m), and how much worse than with a metre a size has to fit for each:
/// metre, centimetre, millimetre, inch, decimetre, foot, a tenth of an inch.
const UNITS: [(f32, f32); 7] = [
    (1.0, 0.0),
    (0.01, 0.0),
    (0.001, 0.2),
    (0.0254, 0.5),
    (0.1, 0.5),
    (0.3048, 0.5),
    (0.00254, 0.8),
];
/// How much more a head's radius tells than a size or a length.
const HEAD_WEIGHT: f32 = 3.0;
/// This share of the nodes at either end of each axis does not count for the size.
const OUTSIDE: f32 = 0.005;

/// An implausible size of a groom, and a better scale: see [`Groom::odd_size`].
/// [`Display`](fmt::Display) gives the sentence.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub struct OddSize {
    /// The longest side of the box around 99 % of its nodes (m).
    pub size: f32,
    /// The median length of the strands (m).
    pub length: f32,
    /// The radius of the head that the roots are on (m), if they are on one.
    pub head: Option<f32>,
    /// Metres per unit of the file that would fit.
    pub scale: f32,
}

impl fmt::Display for OddSize {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "it is {:.3e} m large with strands of {:.3e} m", self.size, self.length)?;
        if let Some(head) = self.head {
            write!(f, " on a head of {head:.3e} m radius")?;
        }
        write!(
            f,
            ", expected {} to {} m with strands of {} to {} m on a head of {} to {} m; {} m a unit \
             would fit",
            SIZES.start(),
            SIZES.end(),
            LENGTHS.start(),
            LENGTHS.end(),
            HEADS.start(),
            HEADS.end(),
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

    /// The longest side of the box around all nodes but the outermost.
    fn usual_size(&self) -> f32 {
        let side = |k: usize| {
            let mut places: Vec<f32> = self.points.iter().map(|p| p[k]).collect();
            let out = (places.len() as f32 * OUTSIDE) as usize;
            let last = places.len().saturating_sub(1 + out);
            let mut at = |i: usize| *places.select_nth_unstable_by(i, f32::total_cmp).1;
            at(last) - at(out)
        };
        (0..3).map(side).fold(0.0, f32::max)
    }

    /// Detects a size implausible for hair, because a file was read with the wrong `scale` (metres per
    /// unit; 1 for grooms not from a file). Gives a better scale: that of the usual unit which comes
    /// nearest to the hair of a head by size, length of strands and radius of the head together, or else one
    /// that makes it as large.
    ///
    /// `None` for a plausible size: 5 mm to 4 m large without the outermost 1 % of its nodes, with a median
    /// strand of 1 mm to 2 m; and, if the roots lie on a head, one of 4.5 to 18 cm or one that no usual unit
    /// makes as large as people's.
    ///
    /// ```
    /// # use bevy_keratin::authoring::groom::Groom; use bevy::prelude::*;
    /// let tail = (0..9).map(|i| [Vec3::X * i as f32, Vec3::new(i as f32, -40.0, 0.0)]);
    /// let tail = Groom::from_polylines(tail).unwrap();
    /// assert_eq!(tail.odd_size(1.0).unwrap().scale, 0.01); // it is in centimetres
    /// assert_eq!(tail.scaled(0.01).unwrap().odd_size(0.01), None);
    /// ```
    pub fn odd_size(&self, scale: f32) -> Option<OddSize> {
        if self.is_empty() {
            return None;
        }
        let size = self.usual_size();
        let length = median(self.strands().map(|s| s.length()).collect());
        let head = self.fit_head().map(|ball| ball.radius());
        if !(size > 0.0 && size.is_finite() && scale > 0.0 && scale.is_finite()) {
            return None;
        }
        let can_be =
            |factor: f32| SIZES.contains(&(size * factor)) && LENGTHS.contains(&(length * factor));
        let is_head = |heads: RangeInclusive<f32>, factor: f32| {
            head.is_none_or(|head| heads.contains(&(head * factor)))
        };
        let off = |(unit, rare): &(f32, f32)| {
            let off = |value: f32, usual: f32| (value * (unit / scale) / usual).ln().abs();
            let head = head.map_or(0.0, |head| HEAD_WEIGHT * off(head, HEAD));
            off(size, SIZE) + off(length, LENGTH) + head + rare
        };
        let is_fine = can_be(1.0) && is_head(HEADS, 1.0);
        let fitting = UNITS.iter().filter(|(unit, _)| {
            let factor = unit / scale;
            can_be(factor) && (!can_be(1.0) || is_head(USUAL_HEADS, factor))
        });
        let unit = fitting.min_by(|a, b| off(a).total_cmp(&off(b))).map(|(unit, _)| *unit);
        if is_fine || (can_be(1.0) && unit.is_none()) {
            return None;
        }
        let scale = unit.unwrap_or(scale * (SIZE / size));
        Some(OddSize { size, length, head, scale })
    }

    /// Detects a groom that lies on its side or stands on its head, because a file was read with the wrong
    /// axis `up` ([`UpAxis::Y`] for grooms not from a file), and gives the axis that would fit.
    ///
    /// Where the roots are on a head, they tell where its crown is: hair does not grow on a face. Elsewhere
    /// only long hair that points upward as a whole is odd. `None` for all other grooms.
    ///
    /// ```
    /// # use bevy_keratin::authoring::groom::{Groom, UpAxis}; use bevy::prelude::*;
    /// let hanging = (0..9).map(|i| [Vec3::X * i as f32 * 0.01, Vec3::new(i as f32 * 0.01, -0.4, 0.0)]);
    /// let hanging = Groom::from_polylines(hanging).unwrap();
    /// assert_eq!(hanging.odd_up(UpAxis::Y), None);
    /// assert_eq!(hanging.with_up(UpAxis::NegY).odd_up(UpAxis::Y), Some(UpAxis::NegY));
    /// ```
    pub fn odd_up(&self, up: UpAxis) -> Option<UpAxis> {
        /// So much of the roots' directions has to agree to tell a crown …
        const CROWN: f32 = 0.25;
        /// … and this share of it may be upward on its side.
        const UPWARD: f32 = 0.3;
        /// Hair that hangs by this share of its reach is upright whatever its roots say …
        const HANGS: f32 = 0.3;
        /// … and hair that rises by this is not, where no head is found, …
        const RISES: f32 = 0.6;
        /// … unless it is shorter (m).
        const STANDS: f32 = 0.1;
        let mean = |of: &mut dyn Iterator<Item = Vec3>| {
            let (sum, all) =
                of.fold((Vec3::ZERO, 0.0), |(sum, all), v| (sum + v, all + v.length()));
            (sum / all).normalize_or_zero() * (sum.length() / f32::max(all, f32::MIN_POSITIVE))
        };
        let reach = mean(&mut self.strands().map(|s| s.points[s.points.len() - 1] - s.points[0]));
        let head = self.fit_head().map(|ball| Vec3::from(ball.center));
        let crown = head.map_or(Vec3::ZERO, |head| {
            mean(&mut self.roots().map(|root| (root - head).normalize_or_zero()))
        });
        let fits = match crown.length() > CROWN {
            true if crown.y < UPWARD * crown.length() && reach.y > -HANGS => {
                // What hangs says the same more clearly.
                crown - if reach.dot(crown) < 0.0 { reach } else { Vec3::ZERO }
            }
            true => return None,
            false => {
                let length = median(self.strands().map(|s| s.length()).collect());
                if reach.y < RISES || length < STANDS {
                    return None;
                }
                -reach
            }
        };
        let turned = |axis: &UpAxis| up.to_y_up(axis.direction()).dot(fits);
        let best = UpAxis::ALL.into_iter().max_by(|a, b| turned(a).total_cmp(&turned(b)));
        best.filter(|best| *best != up)
    }
}
