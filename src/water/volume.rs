//! Volumes of water in which hair can be submerged.

use super::drag::Water;
use crate::{
    base::{
        setting::{InvalidValue, Ranged, setting},
        stretch::{Stretch, Stretched},
    },
    forces::environment::ZoneShape,
    hair::strand::{Carried, TickPose},
};
use bevy::{ecs::system::SystemParam, prelude::*};

setting! {
    /// A volume of water: a lake, a pool, a floating ball. Buoyancy, drag and the water's current
    /// act on hair in it; the hair soaks, has neither film nor droplets, and locks come apart. Hair
    /// that emerges is dripping wet. Droplets that fall in are removed; the
    /// [`WaterLedger`](crate::WaterLedger) counts what goes in and comes out.
    ///
    /// Where volumes overlap, a node is in the one in which it is deepest. A volume that moves or turns takes
    /// its water along, as a bath on a ship does.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut world = World::new();
    /// // a lake whose surface is at the height of a character's chest, flowing slowly
    /// let lake = WaterVolume { current: Vec3::X * 0.1, ..WaterVolume::lake() };
    /// world.spawn((lake, Transform::from_xyz(0.0, 1.3, 0.0)));
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(Transform, TickPose, Stretch<Self>)]
    pub struct WaterVolume {
        /// Its shape.
        pub shape: ZoneShape = ZoneShape::Box;
        /// Half its size along each of its axes, scaled with its transform, unevenly too; a
        /// [`HalfSpace`](ZoneShape::HalfSpace) has none. A sheared one acts at right angles and is
        /// reported.
        pub half_size: Vec3 = Vec3::ONE, "m" in HALF_SIZE: 1e-3..=1e6, safe 0.1..=1000.0,
            "1 is a tub";
        /// Density. Hair has 1310 and floats on what is denser.
        pub density: f32 = 1000.0, "kg/m³" in DENSITY: 1.0..=2e4, safe 500.0..=2000.0,
            "fresh water has 1000, the sea 1025";
        /// Dynamic viscosity.
        pub viscosity: f32 = 1e-3, "Pa s" in VISCOSITY: 1e-6..=1e3, safe 1e-4..=10.0,
            "water has 1e-3, oil 0.1";
        /// Velocity of the water in the volume, along its axes.
        pub current: Vec3 = Vec3::ZERO, "m/s" in CURRENT: -100.0..=100.0, safe -5.0..=5.0,
            "a stream has 1 m/s";
    }
}

impl WaterVolume {
    /// A box with this half size (m).
    ///
    /// # Errors
    /// When a side is not between 1 mm and 1000 km.
    pub fn pool(half_size: Vec3) -> Result<Self, InvalidValue> {
        Self { half_size, ..default() }.checked()
    }

    /// The half-space below the entity.
    pub fn lake() -> Self {
        Self { shape: ZoneShape::HalfSpace, ..default() }
    }
}

impl Stretched for WaterVolume {
    fn suitable(&self, factors: Vec3) -> Vec3 {
        factors
    }

    fn stretched(self, by: Vec3) -> Self {
        Self { half_size: self.half_size * by, ..self }
    }
}

/// A volume as seen from a frame, with valid values.
#[derive(Clone, Copy, Debug)]
struct LocalVolume {
    shape: ZoneShape,
    half_size: Vec3,
    /// From the frame to the volume's, in metres of the volume.
    rotation: Quat,
    origin: Vec3,
    scale: f32,
    /// Its water where it rests.
    water: Water,
    /// It moves along.
    moves: Carried,
}

impl LocalVolume {
    /// Its water at a place, which moves as the volume does.
    fn water_at(&self, place: Vec3) -> Water {
        let current = self.water.current + self.moves.at(place);
        Water { current, ..self.water }
    }
}

/// All volumes as seen from a frame.
#[derive(Clone, Debug, Default)]
pub(super) struct LocalVolumes(Vec<LocalVolume>);

/// All volumes.
#[derive(SystemParam)]
pub(super) struct Volumes<'w, 's> {
    volumes:
        Query<'w, 's, (&'static WaterVolume, &'static Stretch<WaterVolume>, &'static TickPose)>,
}

impl Volumes<'_, '_> {
    pub fn are_none(&self) -> bool {
        self.volumes.is_empty()
    }

    /// Seen in a frame.
    pub fn seen_from(&self, frame: &TickPose) -> LocalVolumes {
        let pose = frame.now();
        let seen = self.volumes.iter().map(|(volume, stretch, moved)| {
            let at = moved.now();
            let WaterVolume { shape, half_size, density, viscosity, current } = stretch.of(volume);
            let current = pose.direction_in(at.direction_out(current));
            LocalVolume {
                shape,
                half_size,
                rotation: at.rotation.inverse() * pose.rotation,
                origin: pose.point_in(at.translation),
                scale: pose.scale / at.scale,
                water: Water { density, viscosity, current: current + frame.headwind() },
                moves: frame.carried_by(moved),
            }
        });
        LocalVolumes(seen.collect())
    }
}

impl LocalVolumes {
    /// Depth of a position in the volume in which it is deepest (m), negative outside. A non-finite
    /// position is in none.
    pub fn depth(&self, place: Vec3) -> Option<f32> {
        self.deepest(place).map(|(depth, _)| depth)
    }

    /// The same with the water there.
    pub fn water(&self, place: Vec3) -> Option<(f32, Water)> {
        self.deepest(place).map(|(depth, volume)| (depth, volume.water_at(place)))
    }

    fn deepest(&self, place: Vec3) -> Option<(f32, &LocalVolume)> {
        let depths = self.0.iter().map(|volume| {
            let LocalVolume { shape, half_size, rotation, origin, scale, .. } = volume;
            let place = *rotation * (place - *origin) * *scale;
            (-shape.distance(*half_size, place) / scale.abs(), volume)
        });
        depths.filter(|(depth, _)| depth.is_finite()).max_by(|a, b| a.0.total_cmp(&b.0))
    }

    /// Whether a place is in any.
    pub fn contain(&self, place: Vec3) -> bool {
        self.depth(place).is_some_and(|depth| depth > 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f32::consts::FRAC_PI_2;

    #[test]
    fn depths_are_those_of_the_deepest_volume_in_the_hairs_own_measure() {
        let local = |shape, at: Vec3, rotation, scale, density| LocalVolume {
            shape,
            half_size: Vec3::new(1.0, 0.5, 2.0),
            rotation,
            origin: at,
            scale,
            water: Water { density, viscosity: 1e-3, current: Vec3::ZERO },
            moves: default(),
        };
        let quarter = Quat::from_rotation_z(FRAC_PI_2);
        let pool = local(ZoneShape::Box, Vec3::X, quarter, 2.0, 1.0);
        let lake = local(ZoneShape::HalfSpace, Vec3::NEG_Y, Quat::IDENTITY, 1.0, 2.0);
        let both = LocalVolumes(vec![pool, lake]);
        // The box lies on its side, and is half as large to the hair: 0.25 m along X, 0.5 along Y.
        let at = |x: f32, y: f32| both.water(Vec3::new(x, y, 0.0)).unwrap();
        assert!((at(1.1, 0.0).0 - 0.15).abs() < 1e-6 && at(1.1, 0.0).1.density == 1.0);
        assert!((at(1.0, 0.7).0 + 0.2).abs() < 1e-6);
        assert!((at(1.0, -3.0).0 - 2.0).abs() < 1e-6 && at(1.0, -3.0).1.density == 2.0);
        assert!(both.contain(Vec3::X) && !both.contain(Vec3::Y) && !both.contain(Vec3::NAN));
        assert!(LocalVolumes::default().depth(Vec3::ZERO).is_none());
    }
}
