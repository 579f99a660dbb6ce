//! The scalp: where hair grows on a head.

use super::map::RootPlace;
use crate::base::setting::setting;
use bevy::{math::ops::atan2, prelude::*};
use core::f32::consts::PI;

setting! {
    /// A head's frame, from which a natural hairline follows: over the forehead, in front of and around
    /// the ears, down to the nape. In the space of the head's mesh.
    ///
    /// ```
    /// # use bevy_keratin::authoring::plant::*; use bevy::prelude::*;
    /// let head = Sphere::new(0.1).mesh().build();
    /// let scalp = Scalp::default().mask();
    /// let planted = Planting::default().plant_with(&head, &PlantingMaps::new().density(&scalp)).unwrap();
    /// assert!(planted.groom.strands().all(|s| s.points[0].y > -0.08));
    /// ```
    #[derive(Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Default, Clone, PartialEq)]
    pub struct Scalp {
        /// The middle between the ears.
        pub center: Vec3 = Vec3::ZERO, "m" in CENTER: -1e6..=1e6, "the middle between the ears";
        /// Toward the crown.
        pub up: Dir3 = Dir3::Y;
        /// Toward the face, as far as it is not up.
        pub front: Dir3 = Dir3::Z;
        /// From the centre to the crown.
        pub height: f32 = 0.11, "m" in HEIGHT: 1e-6..=1e6, safe 0.05..=0.5, "a head has 0.11";
        /// How much higher the hairline is, as an angle at the centre: a high forehead above 0, a low
        /// one below.
        pub recede: f32 = 0.0, "rad" in RECEDE: -3.2..=3.2, safe -0.2..=0.3, "0 is an adult's";
        /// Angle at the centre over which density fades out at the hairline.
        pub fade: f32 = 0.1, "rad" in FADE: 0.0..=3.2, safe 0.0..=0.5, "0.1 is soft";
        /// Elevation of the base of the nose, seen from the centre: a moustache begins below it.
        pub nose: f32 = NOSE, "rad" in NOSE_RANGE: -1.5..=1.5, safe -0.7..=-0.1, "-0.455 is an adult's";
        /// Elevation of the lower end of the chin. Not above the nose: the face is taken as an adult's then.
        pub chin: f32 = CHIN, "rad" in CHIN_RANGE: -1.55..=1.5, safe -1.1..=-0.6,
            "-0.92 is an adult's";
    }
}

/// The face that the hairline and a beard's edges are drawn for: elevations of the base of its nose and of its chin at
/// the centre (rad).
const NOSE: f32 = -0.455;
const CHIN: f32 = -0.92;
/// What is higher in the face than this is where it is on that face (rad), and what is as far aside (°); a face turns
/// into that face below and before.
const BROW: f32 = 0.17;
const ASIDE: (f32, f32) = (30.0, 75.0);

/// The hairline of an adult: elevation (°) over the angle from the face (°), both at the centre. In front it
/// begins 3° below where the face's thirds have it: the eye sees it where half of the density is reached. Before
/// the ear it goes down to the sideburn.
const HAIRLINE: [(f32, f32); 18] = [
    (0.0, 44.0),
    (25.0, 44.0),
    (42.0, 42.0),
    (52.0, 36.0),
    (58.0, 28.0),
    (62.0, 18.0),
    (66.0, 8.0),
    (70.0, 1.0),
    (74.0, -2.0),
    (79.0, -2.0),
    (83.0, 4.0),
    (87.0, 14.0),
    (92.0, 18.0),
    (100.0, 13.0),
    (112.0, -12.0),
    (126.0, -27.0),
    (150.0, -34.0),
    (180.0, -36.0),
];

impl Scalp {
    /// Right, up and front as unit vectors at right angles.
    pub fn axes(&self) -> [Vec3; 3] {
        let up = *self.up;
        let front = self.front.reject_from_normalized(up);
        let front = front.try_normalize().unwrap_or_else(|| up.any_orthonormal_vector());
        [up.cross(front), up, front]
    }

    /// A point of the head given in right, up and front from the centre, in heights of the head.
    pub fn place(&self, right: f32, up: f32, front: f32) -> Vec3 {
        let [x, y, z] = self.axes();
        self.center + (x * right + y * up + z * front) * self.height
    }

    /// The share of full density at a place, 0…1.
    pub fn density(&self, place: Vec3) -> f32 {
        let (_, above) = self.beyond_hairline(place);
        // Without fade the line is sharp.
        let share = (above / self.fade.max(1e-6)).clamp(0.0, 1.0);
        if share.is_nan() { 0.0 } else { share * share * (3.0 - 2.0 * share) }
    }

    /// Angles at the centre: from the face around (°), alike on both sides, and up (°).
    pub(super) fn angles(&self, place: Vec3) -> (f32, f32) {
        let axes = self.axes();
        let [right, up, front] = axes.map(|axis| (place - self.center).dot(axis));
        let flat = right.hypot(front);
        let around = atan2(right.abs(), front) * 180.0 / PI;
        (around, self.drawn_elevation(around, atan2(up, flat)) * 180.0 / PI)
    }

    /// The elevation (rad) at which a place of this face is on the face that lines are drawn for.
    fn drawn_elevation(&self, around: f32, elevation: f32) -> f32 {
        let is_that = (self.nose, self.chin) == (NOSE, CHIN);
        let is_face = BROW > self.nose && self.nose > self.chin && self.chin > -0.5 * PI;
        if is_that || !is_face || !(-0.5 * PI..BROW).contains(&elevation) || around > ASIDE.1 {
            return elevation;
        }
        let lines = [(-0.5 * PI, -0.5 * PI), (self.chin, CHIN), (self.nose, NOSE), (BROW, BROW)];
        let drawn = piecewise(&lines, elevation);
        let aside = ((around - ASIDE.0) / (ASIDE.1 - ASIDE.0)).clamp(0.0, 1.0);
        drawn + (elevation - drawn) * aside * aside * (3.0 - 2.0 * aside)
    }

    /// Angles at the centre: from the face around (°), and above the hairline there (rad).
    pub(super) fn beyond_hairline(&self, place: Vec3) -> (f32, f32) {
        let (around, elevation) = self.angles(place);
        (around, (elevation - hairline(around)) * PI / 180.0 - self.recede)
    }

    /// Slope of the hairline: elevation over the angle around the head.
    pub(super) fn hairline_slope(&self, around: f32) -> f32 {
        (hairline((around + 2.0).min(180.0)) - hairline((around - 2.0).max(0.0))) / 4.0
    }

    /// The scalp as a density map.
    pub fn mask(&self) -> impl Fn(&RootPlace) -> f32 + use<> {
        let scalp = *self;
        move |place| scalp.density(place.position)
    }
}

fn hairline(around: f32) -> f32 {
    piecewise(&HAIRLINE, around)
}

/// A line of such points at a place; level beyond its last.
pub(super) fn piecewise(line: &[(f32, f32)], at: f32) -> f32 {
    let piece = line.windows(2).find(|w| at <= w[1].0);
    piece.map_or(line[line.len() - 1].1, |w| {
        let share = (at - w[0].0) / (w[1].0 - w[0].0);
        w[0].1 + (w[1].1 - w[0].1) * share
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(around: f32, elevation: f32) -> Vec3 {
        let [a, e] = [around.to_radians(), elevation];
        Vec3::new(a.sin() * e.cos(), e.sin(), a.cos() * e.cos()) * 0.1
    }

    #[test]
    fn a_nose_and_a_chin_are_where_lines_are_drawn_for_them() {
        let scalp = Scalp { nose: -0.3, chin: -0.7, ..default() };
        let drawn =
            |around: f32, elevation: f32| scalp.angles(at(around, elevation)).1.to_radians();
        assert!((drawn(0.0, -0.3) - NOSE).abs() < 1e-5 && (drawn(20.0, -0.7) - CHIN).abs() < 1e-5);
        // Neither the forehead nor the ears.
        assert!((drawn(0.0, 0.5) - 0.5).abs() < 1e-5 && (drawn(80.0, -0.3) + 0.3).abs() < 1e-5);
        // Nothing is folded.
        for around in [0.0, 30.0, 45.0, 60.0, 75.0, 90.0] {
            let all: Vec<f32> = (-150..150).map(|e| drawn(around, 0.01 * e as f32)).collect();
            assert!(all.windows(2).all(|w| w[0] < w[1]), "{around}");
        }
        // A chin above the nose is none.
        let upside_down = Scalp { nose: -0.7, chin: -0.3, ..default() };
        assert!((upside_down.angles(at(0.0, -0.5)).1.to_radians() + 0.5).abs() < 1e-5);
    }
}
