//! The air of the room.

use crate::base::setting::{InvalidValue, Ranged, setting};
use bevy::prelude::*;

setting! {
    /// The air of the room. A resource.
    #[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Resource, Default, Clone, PartialEq)]
    pub struct HairClimate {
        /// Temperature.
        pub celsius: f32 = 22.0, "°C" in CELSIUS: -60.0..=100.0, safe -20.0..=50.0, "a room has 22";
        /// Relative humidity. At 0.5 hair is dry; from damper air it takes up vapour, in an hour or so, which
        /// opens hydrogen bonds.
        pub humidity: f32 = 0.5, in HUMIDITY: 0.0..=1.0, "a room has 0.5";
        /// Speed of the draught.
        pub draught: f32 = 0.1, "m/s" in DRAUGHT: 0.0..=100.0, safe 0.0..=10.0, "a room has 0.1";
    }
}

impl HairClimate {
    /// The air of a room: temperature (°C) and relative humidity (0…1).
    ///
    /// # Errors
    /// When a value is outside [`CELSIUS`](Self::CELSIUS) or [`HUMIDITY`](Self::HUMIDITY).
    pub fn new(celsius: f32, humidity: f32) -> Result<Self, InvalidValue> {
        Self { celsius, humidity, ..default() }.checked()
    }
}
