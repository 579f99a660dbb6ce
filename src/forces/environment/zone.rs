//! Global wind, and zones with air of their own.

use crate::{
    base::{
        setting::{InvalidValue, Ranged, setting},
        stretch::{Stretch, Stretched},
    },
    hair::strand::TickPose,
};
use bevy::prelude::*;

setting! {
    /// Global wind. A resource; no wind by default.
    ///
    /// Drag relaxes the velocity of hair to that of the wind, v′ = −rate · (v − u) with the rate of
    /// [`AirDrag`](super::AirDrag). At the default rate a wind of 5 m/s holds light hair up at 45°. Wind
    /// dries wet hair faster and makes droplets drift.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut app = App::new();
    /// // a fresh breeze from the west
    /// app.insert_resource(HairWind { velocity: Vec3::X * 8.0, gusts: 0.5, ..default() });
    /// ```
    #[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Resource, Default, Clone, PartialEq)]
    pub struct HairWind {
        /// Mean velocity, in the world.
        pub velocity: Vec3 = Vec3::ZERO, "m/s" in VELOCITY: -300.0..=300.0, safe -20.0..=20.0,
            "5 m/s is a gentle breeze, 20 m/s a gale";
        /// How much the velocity varies with place and time, as a share of its mean.
        pub gusts: f32 = 0.4, in GUSTS: 0.0..=100.0, safe 0.0..=1.0, "0.4 is open country";
        /// Length of a gust; it passes in this length over the wind's speed.
        pub gust_length: f32 = 4.0, "m" in GUST_LENGTH: 1e-3..=1e5, safe 0.5..=50.0,
            "4 passes in a second of a gentle breeze";
        /// Seed of the gusts: the same seed gives the same gusts.
        pub seed: u32 = 0;
    }
}

/// The shape of a [`WindZone`] or a [`WaterVolume`](crate::WaterVolume).
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub enum ZoneShape {
    /// A ball, or an ellipsoid, around the entity.
    #[default]
    Ellipsoid,
    /// A box along the entity's axes.
    Box,
    /// Everything below the entity's XZ plane: a lake, the sea, the air of a valley. It has no
    /// size.
    HalfSpace,
}

impl ZoneShape {
    /// Signed distance of a point from the surface, negative inside (m), in the frame of the shape.
    pub(crate) fn distance(self, half_size: Vec3, place: Vec3) -> f32 {
        match self {
            Self::Box => {
                let beyond = place.abs() - half_size;
                beyond.max(Vec3::ZERO).length() + beyond.max_element().min(0.0)
            }
            // Exact for balls; for ellipsoids the first order of the distance (Quilez).
            Self::Ellipsoid => {
                let (k0, k1) =
                    ((place / half_size).length(), (place / (half_size * half_size)).length());
                if k1 > 0.0 { k0 * (k0 - 1.0) / k1 } else { -half_size.min_element() }
            }
            Self::HalfSpace => place.y,
        }
    }

    /// Radius around its centre that encloses the shape (m).
    pub(crate) fn reach(self, half_size: Vec3) -> f32 {
        match self {
            Self::HalfSpace => f32::INFINITY,
            Self::Box | Self::Ellipsoid => half_size.length(),
        }
    }
}

setting! {
    /// A region with air of its own: a draught, a fan, a blast, a room without wind, a fire.
    ///
    /// Full inside its shape, decreasing outside, zero beyond the falloff. Effects of zones add up;
    /// `shelter` reduces the global [`HairWind`], not other zones. A [`Blower`](super::Blower) is the
    /// counterpart with a jet's shape, equation 17 of \[B\].
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut world = World::new();
    /// // indoors
    /// let indoors = WindZone { half_size: Vec3::new(3.0, 1.5, 4.0), ..WindZone::shelter() };
    /// world.spawn((indoors, Transform::from_xyz(0.0, 1.5, 0.0)));
    /// world.spawn((WindZone::fire(), Transform::from_xyz(1.0, 0.0, 0.0)));
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(Transform, TickPose, Stretch<Self>)]
    pub struct WindZone {
        /// Its shape.
        pub shape: ZoneShape = ZoneShape::default();
        /// Half its size along each of its axes, scaled with its transform, unevenly too; a sheared one
        /// acts at right angles and is reported.
        pub half_size: Vec3 = Vec3::ONE, "m" in HALF_SIZE: 1e-3..=1e6, safe 0.1..=100.0,
            "1 is as large as a person";
        /// Distance outside the shape over which it fades out, scaled with the mean of its transform.
        pub falloff: f32 = 0.5, "m" in FALLOFF: 0.0..=1e6, safe 0.0..=10.0, "0.5 is soft";
        /// Velocity of its air along its axes, added to the global wind.
        pub velocity: Vec3 = Vec3::ZERO, "m/s" in VELOCITY: -300.0..=300.0, safe -20.0..=20.0,
            "a fan has 3 m/s";
        /// Velocity away from its centre; a blast has more than 20, negative values draw air in.
        pub outward: f32 = 0.0, "m/s" in OUTWARD: -300.0..=300.0, safe -20.0..=20.0,
            "a blast has 20 m/s";
        /// Share of the global wind that it blocks.
        pub shelter: f32 = 0.0, in SHELTER: 0.0..=1.0, "1 is indoors";
        /// How much warmer its air is than the room's.
        pub warmth: f32 = 0.0, "K" in WARMTH: -300.0..=1000.0, safe -50.0..=100.0,
            "80 is beside a fire";
        /// Rate at which hydrogen bonds of dry hair form, as in equation 19 in a blower's wind. Wet hair
        /// is dried by its warmth and wind instead.
        pub drying: f32 = 0.0, "1/s" in DRYING: 0.0..=1e4, safe 0.0..=2.0,
            "0.3 sets hair in some seconds";
    }
}

impl WindZone {
    /// A ball of moving air (m, m/s along its axes).
    ///
    /// # Errors
    /// When the radius is outside [`HALF_SIZE`](Self::HALF_SIZE) or the velocity outside
    /// [`VELOCITY`](Self::VELOCITY).
    pub fn new(radius: f32, velocity: Vec3) -> Result<Self, InvalidValue> {
        Self { half_size: Vec3::splat(radius), velocity, ..default() }.checked()
    }

    /// A box of 2 m without wind: indoors, behind a wall.
    pub fn shelter() -> Self {
        Self { shape: ZoneShape::Box, shelter: 1.0, ..default() }
    }

    /// A campfire: within two metres air rises and is the warmer the nearer.
    pub fn fire() -> Self {
        Self {
            half_size: Vec3::splat(0.15),
            falloff: 2.0,
            velocity: Vec3::Y * 0.5,
            warmth: 80.0,
            drying: 0.3,
            ..default()
        }
    }

    /// Its weight at a point in its own frame (m): 1 inside, 0 beyond the falloff.
    pub(super) fn weight(&self, place: Vec3) -> f32 {
        // NaN is outside.
        if place.is_nan() {
            return 0.0;
        }
        let outside = self.shape.distance(self.half_size, place);
        if outside <= 0.0 {
            return 1.0;
        }
        let t = (1.0 - outside / self.falloff.max(1e-9)).max(0.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// Radius around its centre within which it acts (m).
    pub(super) fn reach(&self) -> f32 {
        self.shape.reach(self.half_size) + self.falloff
    }
}

impl Stretched for WindZone {
    fn suitable(&self, factors: Vec3) -> Vec3 {
        factors
    }

    fn stretched(self, by: Vec3) -> Self {
        Self { half_size: self.half_size * by, ..self }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zone_is_full_inside_and_ends_at_its_falloff() {
        let below = WindZone { shape: ZoneShape::HalfSpace, falloff: 0.2, ..default() };
        let share = |y: f32| below.weight(Vec3::new(5.0, y, -7.0));
        assert_eq!([share(-100.0), share(0.0), share(0.2)], [1.0, 1.0, 0.0]);
        assert!((share(0.1) - 0.5).abs() < 1e-5 && below.reach() == f32::INFINITY);
        for shape in [ZoneShape::Ellipsoid, ZoneShape::Box] {
            let zone = WindZone { shape, half_size: Vec3::splat(0.4), falloff: 0.2, ..default() };
            let share = |x| zone.weight(Vec3::X * x);
            assert_eq!([share(0.0), share(0.399), share(0.601)], [1.0, 1.0, 0.0], "{shape:?}");
            assert!((share(0.5) - 0.5).abs() < 1e-5, "{shape:?}: {}", share(0.5));
            assert!(share(0.45) > share(0.55));
            assert_eq!(zone.weight(Vec3::NAN), 0.0);
        }
        let size = Vec3::new(0.4, 0.2, 0.3);
        for (shape, y, expected) in [
            (ZoneShape::Box, 0.15, -0.05),
            (ZoneShape::Box, 0.25, 0.05),
            (ZoneShape::Ellipsoid, 0.0, -0.2),
            (ZoneShape::HalfSpace, -3.0, -3.0),
        ] {
            let found = shape.distance(size, Vec3::Y * y);
            assert!((found - expected).abs() < 1e-6, "{shape:?} at {y}: {found}");
        }
        let ball = ZoneShape::Ellipsoid.distance(Vec3::splat(0.4), Vec3::new(0.0, 0.3, 0.0));
        assert!((ball + 0.1).abs() < 1e-6, "{ball}");
        let hard = WindZone { falloff: 0.0, ..default() };
        assert_eq!([hard.weight(Vec3::X * 0.99), hard.weight(Vec3::X * 1.01)], [1.0, 0.0]);
    }
}
