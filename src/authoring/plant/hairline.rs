//! The hairline: how hair begins.

#![cfg_attr(not(feature = "render"), allow(dead_code, reason = "used by drawn strands only"))]

use super::{preset::HairPreset, scalp::Scalp};
use crate::base::setting::{Ranged, setting};
use bevy::{math::ops::sin, prelude::*};
use core::f32::consts::TAU;

setting! {
    /// Density, length and width of hair at the edge of the [`Scalp`]: sparse, short and fine at
    /// first, along a ragged line. Applies to drawn strands; guides use [`Scalp::fade`].
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct Hairline {
        /// Distance behind the line over which density rises to its full value.
        pub density_over: f32 = 16e-3, "m" in DENSITY_OVER: 0.0..=10.0, safe 0.0..=0.05,
            "0.012 to 0.02 are natural";
        /// Density at the line, a share.
        pub least_density: f32 = 0.25, in LEAST_DENSITY: 0.0..=1.0, "0.25 is natural";
        /// Distance behind the line over which length rises to its full value.
        pub length_over: f32 = 15e-3, "m" in LENGTH_OVER: 0.0..=10.0, safe 0.0..=0.05,
            "0.015 is natural";
        /// Length at the line, as a share of the full length.
        pub least_length: f32 = 0.4, in LEAST_LENGTH: 0.01..=1.0, safe 0.05..=1.0,
            "0.4 is long hair, 0.1 a fade";
        /// Width at the line, as a share of the full width; it rises with length.
        pub least_width: f32 = 0.6, in LEAST_WIDTH: 0.05..=1.0, safe 0.3..=1.0, "0.6 is natural";
        /// Amplitude of the line's irregularity.
        pub ragged: f32 = 3e-3, "m" in RAGGED: 0.0..=1.0, safe 0.0..=0.01, "0.003 is natural";
        /// Density of baby hairs around the line, as a share of the full density.
        pub baby_hair: f32 = 0.35, in BABY_HAIR: 0.0..=1.0, "0.35 is natural";
        /// The longest baby hairs; the shortest have a fifth of that.
        pub baby_length: f32 = 22e-3, "m" in BABY_LENGTH: 1e-4..=1.0, safe 2e-3..=0.05,
            "0.02 is natural";
    }
}

/// Growth at a place, relative to that far behind the hairline.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Growth {
    pub(super) density: f32,
    pub(super) length: f32,
    pub(super) width: f32,
    /// Of baby hairs.
    pub(super) baby: f32,
}

/// Baby hairs grow between these distances behind the line (m).
const BABY_BAND: (f32, f32) = (-3e-3, 9e-3);
/// Width of baby hairs: 0.04 mm of 0.07 mm.
pub(super) const BABY_WIDTH: f32 = 0.57;

impl Hairline {
    /// Growth at a distance `behind` the line (m), negative in front of it.
    pub(super) fn growth(&self, behind: f32) -> Growth {
        let rise = |over: f32, least: f32| least + (1.0 - least) * smooth(behind / over.max(1e-9));
        let is_in = behind >= 0.0;
        let length = rise(self.length_over, self.least_length);
        let baby = (BABY_BAND.0..BABY_BAND.1).contains(&behind);
        Growth {
            density: if is_in { rise(self.density_over, self.least_density) } else { 0.0 },
            length,
            width: rise(self.length_over, self.least_width),
            baby: if baby { self.baby_hair } else { 0.0 },
        }
    }

    /// Whether [`break_at`](Self::break_at) may change the growth at a distance `behind` the even line (m):
    /// it does not far before and far behind it.
    pub(super) fn is_ragged_at(&self, behind: f32) -> bool {
        // The waves' sum is at most four halves of the amplitude.
        let most = 2.0 * self.ragged;
        let whole = self.density_over.max(self.length_over).max(BABY_BAND.1);
        behind > BABY_BAND.0.min(0.0) - most && behind < whole + most
    }

    /// Offset of the ragged line at a place (m).
    pub(super) fn break_at(&self, place: Vec3) -> f32 {
        // Several incommensurable waves of some millimetres.
        let waves = [
            (Vec3::new(0.62, 0.31, 0.72), 6.1e-3),
            (Vec3::new(-0.71, 0.55, 0.44), 8.3e-3),
            (Vec3::new(0.28, -0.83, 0.48), 13.7e-3),
            (Vec3::new(0.48, 0.64, -0.6), 23.0e-3),
        ];
        let sum: f32 = waves.iter().map(|(way, length)| sin(TAU * place.dot(*way) / length)).sum();
        self.ragged * 0.5 * sum
    }
}

impl Scalp {
    /// Distance of a place on the head from the hairline along the surface (m, approximately),
    /// positive behind the line, negative in front of it.
    pub fn behind_hairline(&self, place: Vec3) -> f32 {
        let (around, above) = self.beyond_hairline(place);
        // Where the line is steep its distance is less than the vertical one.
        let slope = self.hairline_slope(around);
        above * place.distance(self.center) / (1.0 + slope * slope).sqrt()
    }

    /// Tints the skin under the hair: the mesh's vertex colours are mixed with half of `hair`, the hair's
    /// colour ([`Melanin::color`](crate::render::Melanin::color)), by `cover`, the share of the skin that
    /// dense hair hides, 0…1. A mesh without colours gets white ones first. Values of `hairline` and
    /// `cover` out of their ranges are clamped; a mesh without positions stays as it is.
    ///
    /// ```
    /// # use bevy_keratin::authoring::plant::*; use bevy::prelude::*;
    /// let mut head = Sphere::new(0.1).mesh().build();
    /// Scalp::default().tint(&mut head, &Hairline::default(), LinearRgba::rgb(0.02, 0.01, 0.01), 0.7);
    /// assert!(head.contains_attribute(Mesh::ATTRIBUTE_COLOR));
    /// ```
    pub fn tint(&self, mesh: &mut Mesh, hairline: &Hairline, hair: LinearRgba, cover: f32) {
        tint(mesh, |place| self.behind_hairline(place), hairline, hair, cover);
    }
}

impl HairPreset {
    /// Tints the skin under the hair as [`Scalp::tint`] does, wherever this preset grows: the lower face
    /// under a beard.
    ///
    /// ```
    /// # use bevy_keratin::authoring::plant::*; use bevy::prelude::*;
    /// let (mut head, scalp) = (Sphere::new(0.1).mesh().build(), Scalp::default());
    /// HairPreset::Beard.tint(&mut head, &scalp, LinearRgba::rgb(0.02, 0.01, 0.01), 0.5);
    /// ```
    pub fn tint(self, mesh: &mut Mesh, scalp: &Scalp, hair: LinearRgba, cover: f32) {
        tint(mesh, |place| self.behind_line(scalp, place), &self.hairline(), hair, cover);
    }
}

/// Mixes vertex colours with half of `hair` where a place is `behind` a line.
fn tint(
    mesh: &mut Mesh,
    behind: impl Fn(Vec3) -> f32,
    hairline: &Hairline,
    hair: LinearRgba,
    cover: f32,
) {
    use bevy::mesh::VertexAttributeValues::{Float32x3, Float32x4};
    let Ok(Some(Float32x3(places))) = mesh.try_attribute_option(Mesh::ATTRIBUTE_POSITION) else {
        return;
    };
    let places: Vec<Vec3> = places.iter().copied().map(Vec3::from).collect();
    if !mesh.contains_attribute(Mesh::ATTRIBUTE_COLOR) {
        mesh.insert_attribute(Mesh::ATTRIBUTE_COLOR, vec![[1.0f32; 4]; places.len()]);
    }
    let Some(Float32x4(colors)) = mesh.attribute_mut(Mesh::ATTRIBUTE_COLOR) else {
        return;
    };
    let half = Vec3::new(hair.red, hair.green, hair.blue) * 0.5;
    let (hairline, cover) = (hairline.clamped(), cover.clamp(0.0, 1.0));
    for (color, place) in colors.iter_mut().zip(places) {
        // More than the roots there alone: hair that lies over the place shades the skin, too.
        let share = smooth(behind(place) / hairline.density_over.max(1e-9)) * cover;
        let skin = Vec4::from(*color);
        *color = skin.truncate().lerp(half, share).extend(skin.w).to_array();
    }
}

pub(super) fn smooth(x: f32) -> f32 {
    let x = if x.is_nan() { 0.0 } else { x.clamp(0.0, 1.0) };
    x * x * (3.0 - 2.0 * x)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ragged_line_changes_growth_only_near_itself() {
        let line = Hairline { ragged: 5e-3, ..default() };
        let (mut near, mut changed) = (0, 0);
        for step in 0..4000 {
            let behind = -0.05 + 25e-6 * step as f32;
            let place = Vec3::new(0.013, -0.007, 0.011) * step as f32;
            let ragged = line.growth(behind + line.break_at(place));
            near += u32::from(line.is_ragged_at(behind));
            if ragged != line.growth(behind) {
                changed += 1;
                assert!(line.is_ragged_at(behind), "{behind}");
            }
        }
        assert!(changed > 800 && near < 2000, "{changed} changed, {near} near");
    }

    #[test]
    fn hair_grows_denser_longer_and_wider_behind_the_line() {
        let line = Hairline::default();
        let at = |mm: f32| line.growth(mm * 1e-3);
        assert_eq!(at(-1.0).density, 0.0);
        assert!((at(0.0).density - 0.25).abs() < 1e-6 && (at(0.0).width - 0.6).abs() < 1e-6);
        assert_eq!((at(20.0).density, at(20.0).length, at(20.0).width), (1.0, 1.0, 1.0));
        for mm in 0..20 {
            let (a, b) = (at(mm as f32), at(mm as f32 + 1.0));
            assert!(a.density <= b.density && a.length <= b.length && a.width <= b.width);
        }
        assert!(at(-2.0).baby > 0.0 && at(5.0).baby > 0.0 && at(15.0).baby == 0.0);
        let sharp = Hairline { density_over: 0.0, length_over: 0.0, ..line }.growth(1e-4);
        assert_eq!((sharp.density, sharp.length), (1.0, 1.0));
    }

    #[test]
    fn the_distance_behind_the_line_is_that_along_the_head() {
        let scalp = Scalp::default();
        let from = |elevation: f32| {
            let angle = elevation.to_radians();
            scalp.behind_hairline(Vec3::new(0.0, angle.sin(), angle.cos()) * 0.1)
        };
        // The line is 44° up in front.
        assert!(from(44.0).abs() < 1e-4 && from(37.0) < -0.01);
        let ten_degrees = 0.1 * 10.0_f32.to_radians();
        assert!((from(54.0) - ten_degrees).abs() < 1e-4, "{}", from(54.0));
        assert!(!scalp.behind_hairline(Vec3::NAN).is_infinite());
    }
}
