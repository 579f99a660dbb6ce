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
    }
}

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
        (atan2(right.abs(), front) * 180.0 / PI, atan2(up, flat) * 180.0 / PI)
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
    let piece = HAIRLINE.windows(2).find(|w| around <= w[1].0);
    piece.map_or(HAIRLINE[HAIRLINE.len() - 1].1, |w| {
        let share = (around - w[0].0) / (w[1].0 - w[0].0);
        w[0].1 + (w[1].1 - w[0].1) * share
    })
}
