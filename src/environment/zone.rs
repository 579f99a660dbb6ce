//! The wind of the place, and zones whose air is another.

use crate::{
    setting::{InvalidValue, Ranged, setting},
    strand::TickPose,
};
use bevy::prelude::*;

setting! {
    /// The wind of the whole place. A resource; no wind by default.
    ///
    /// Hair goes with the air that moves: drag slows its velocity over that of the wind,
    /// v′ = −rate · (v − u) with the rate of [`AirDrag`](super::AirDrag). At the default rate a wind of
    /// 5 m/s holds light hair up at 45°. It dries wet hair faster and carries droplets along.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut app = App::new();
    /// // a fresh breeze from the west
    /// app.insert_resource(Wind { velocity: Vec3::X * 8.0, gusts: 0.5, ..default() });
    /// ```
    #[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Resource, Default, Clone, PartialEq)]
    pub struct Wind {
        /// Mean velocity, in the world.
        pub velocity: Vec3 = Vec3::ZERO, "m/s" in VELOCITY: -300.0..=300.0, safe -20.0..=20.0,
            "5 m/s is a gentle breeze, 20 m/s a gale";
        /// How much the velocity varies with place and time, as a share of its mean.
        pub gusts: f32 = 0.4, in GUSTS: 0.0..=100.0, safe 0.0..=1.0, "0.4 is open country";
        /// How long a gust is; it passes in this over the wind's speed.
        pub gust_length: f32 = 4.0, "m" in GUST_LENGTH: 1e-3..=1e5, safe 0.5..=50.0,
            "4 passes in a second of a gentle breeze";
        /// Which gusts: the same seed has the same.
        pub seed: u32 = 0;
    }
}

/// The shape of a [`WindZone`].
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub enum ZoneShape {
    /// A ball, or an ellipsoid, around the entity.
    #[default]
    Ellipsoid,
    /// A box along the entity's axes.
    Box,
}

setting! {
    /// Air of its own: a draught, a fan, a blast, a room without wind, a fire.
    ///
    /// In full inside its shape, less the farther outside, nothing beyond the falloff. Effects of
    /// zones add up; what one shelters from is the [`Wind`] of the place, not the other zones. A
    /// [`Blower`](super::Blower) is the same with a jet's shape, which equation 17 of \[B\] has.
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
    #[require(Transform, TickPose)]
    pub struct WindZone {
        /// What it looks like.
        pub shape: ZoneShape = ZoneShape::default();
        /// Half its size along each of its axes, scaled with its transform.
        pub half_size: Vec3 = Vec3::ONE, "m" in HALF_SIZE: 1e-3..=1e6, safe 0.1..=100.0,
            "1 is as large as a person";
        /// How far outside the shape it ends.
        pub falloff: f32 = 0.5, "m" in FALLOFF: 0.0..=1e6, safe 0.0..=10.0, "0.5 is soft";
        /// Velocity of its air beside the wind of the place, along its axes.
        pub velocity: Vec3 = Vec3::ZERO, "m/s" in VELOCITY: -300.0..=300.0, safe -20.0..=20.0,
            "a fan has 3 m/s";
        /// The same away from its centre; a blast has more than 20, less than 0 draws in.
        pub outward: f32 = 0.0, "m/s" in OUTWARD: -300.0..=300.0, safe -20.0..=20.0,
            "a blast has 20 m/s";
        /// Share of the wind of the place that it keeps out.
        pub shelter: f32 = 0.0, in SHELTER: 0.0..=1.0, "1 is indoors";
        /// How much warmer its air is than the room's.
        pub warmth: f32 = 0.0, "K" in WARMTH: -300.0..=1000.0, safe -50.0..=100.0,
            "80 is beside a fire";
        /// Rate at which it sets dry hair: hydrogen bonds that form a second, as equation 19 has them
        /// form in a blower's wind. Wet hair is dried by its warmth and its wind.
        pub drying: f32 = 0.0, "1/s" in DRYING: 0.0..=1e4, safe 0.0..=2.0,
            "0.3 sets hair in some seconds";
    }
}

impl WindZone {
    /// A ball of moving air (m, m/s along its axes).
    ///
    /// # Errors
    /// When the radius is not between 1 mm and 1000 km or the velocity beyond 300 m/s.
    pub fn new(radius: f32, velocity: Vec3) -> Result<Self, InvalidValue> {
        Self { half_size: Vec3::splat(radius), velocity, ..default() }.checked()
    }

    /// A box of 2 m without wind: indoors, behind a wall.
    pub fn shelter() -> Self {
        Self { shape: ZoneShape::Box, shelter: 1.0, ..default() }
    }

    /// A campfire: air that is warmer the nearer, for two metres round, and rises.
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

    /// Its share of the air at a place in its own frame (m): 1 inside, 0 beyond the falloff.
    pub(super) fn share(&self, place: Vec3) -> f32 {
        // No number is nowhere.
        if place.is_nan() {
            return 0.0;
        }
        let outside = match self.shape {
            ZoneShape::Box => (place.abs() - self.half_size).max(Vec3::ZERO).length(),
            // Exact for balls; for ellipsoids the first order of the distance (Quilez).
            ZoneShape::Ellipsoid => {
                let (k0, k1) = (
                    (place / self.half_size).length(),
                    (place / (self.half_size * self.half_size)).length(),
                );
                if k0 <= 1.0 { 0.0 } else { k0 * (k0 - 1.0) / k1 }
            }
        };
        if outside <= 0.0 {
            return 1.0;
        }
        let t = (1.0 - outside / self.falloff.max(1e-9)).max(0.0);
        t * t * (3.0 - 2.0 * t)
    }

    /// How far from its centre its air may be felt (m).
    pub(super) fn reach(&self) -> f32 {
        self.half_size.length() + self.falloff
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_zone_is_full_inside_and_ends_at_its_falloff() {
        for shape in [ZoneShape::Ellipsoid, ZoneShape::Box] {
            let zone = WindZone { shape, half_size: Vec3::splat(0.4), falloff: 0.2, ..default() };
            let share = |x| zone.share(Vec3::X * x);
            assert_eq!([share(0.0), share(0.399), share(0.601)], [1.0, 1.0, 0.0], "{shape:?}");
            assert!((share(0.5) - 0.5).abs() < 1e-5, "{shape:?}: {}", share(0.5));
            assert!(share(0.45) > share(0.55));
            assert_eq!(zone.share(Vec3::NAN), 0.0);
        }
        let hard = WindZone { falloff: 0.0, ..default() };
        assert_eq!([hard.share(Vec3::X * 0.99), hard.share(Vec3::X * 1.01)], [1.0, 0.0]);
    }
}
