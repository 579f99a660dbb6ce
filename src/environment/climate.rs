//! The air of the room.

use crate::setting::{Bound, InvalidValue, Notes};
use bevy::prelude::*;

/// The air of the room. A resource.
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct Climate {
    /// Temperature (°C). Default 22, safe −20…50.
    pub celsius: f32,
    /// Relative humidity, 0…1. Default 0.5, at which hair is dry; damper air wets it.
    pub humidity: f32,
    /// Speed of the draught (m/s). Default 0.1, safe 0…10.
    pub draught: f32,
}

impl Default for Climate {
    fn default() -> Self {
        Self { celsius: 22.0, humidity: 0.5, draught: 0.1 }
    }
}

const CELSIUS: Bound = Bound::new("Climate::celsius (°C)", -60.0, 100.0, "a room has 22");
const HUMIDITY: Bound = Bound::new("Climate::humidity", 0.0, 1.0, "a room has 0.5");
const DRAUGHT: Bound = Bound::new("Climate::draught (m/s)", 0.0, 100.0, "a room has 0.1");

impl Climate {
    /// The air of a room: temperature (°C) and relative humidity (0…1).
    ///
    /// # Errors
    /// When the temperature is outside −60…100 °C or the humidity outside 0…1.
    pub fn new(celsius: f32, humidity: f32) -> Result<Self, InvalidValue> {
        let celsius = CELSIUS.check(celsius)?;
        Ok(Self { celsius, humidity: HUMIDITY.check(humidity)?, ..default() })
    }

    pub(super) fn mended(&self, notes: &Notes) -> Self {
        let d = Self::default();
        Self {
            celsius: CELSIUS.mend(self.celsius, d.celsius, notes),
            humidity: HUMIDITY.mend(self.humidity, d.humidity, notes),
            draught: DRAUGHT.mend(self.draught, d.draught, notes),
        }
    }
}
