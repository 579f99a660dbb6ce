//! What surrounds hair: gravity, the wind of blowers, the drag of the air, and how fast it dries.

mod climate;
mod systems;
pub mod vapour;
pub mod wind;

pub use climate::Climate;
pub use systems::EnvironmentPlugin;
pub(crate) use systems::{LocalBlower, local_blowers};

use crate::{
    setting::{Bound, HairSetting, InvalidValue, Notes},
    strand::TickPose,
};
use bevy::prelude::*;

/// The acceleration that pulls all hair (m/s², in the world). Default (0, −9.80, 0), as in \[B\]
/// table 1. Not scaled with a character.
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq, Deref, DerefMut)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct HairGravity(pub Vec3);

impl Default for HairGravity {
    fn default() -> Self {
        Self(Vec3::NEG_Y * 9.8)
    }
}

/// Drag of still air. Component of a [`Hair`](crate::Hair); where absent,
/// [`HairDefault<AirDrag>`](crate::HairDefault) holds.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct AirDrag {
    /// Rate at which velocities die away, v′ = −rate · v (1/s). Default 2, safe 0…50.
    pub rate: f32,
}

impl Default for AirDrag {
    fn default() -> Self {
        Self { rate: 2.0 }
    }
}

const DRAG: Bound = Bound::new("AirDrag::rate (1/s)", 0.0, 1e4, "2 is air, 20 is water");

impl HairSetting for AirDrag {
    fn mended(&self, notes: &Notes) -> Self {
        Self { rate: DRAG.mend(self.rate, 2.0, notes) }
    }
}

/// A hair dryer: blows along its transform's forward direction (−Z) and dries what it blows on.
///
/// Equation 17 of \[B\]. Despawn it, or set `strength` to 0, to switch it off.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
#[require(Transform, TickPose)]
pub struct Blower {
    /// α, the acceleration of an edge across the wind, on the axis (m/s²). Default 3.33, safe 0…30.
    /// The paper gives no value.
    pub strength: f32,
    /// Rate of hydrogen bonds that form per velocity that the wind gives (s/m), equation 19.
    /// Default 0.3 (print: 0.003 s/cm); 0 blows without drying. On hair that carries water
    /// ([`Moisture`](crate::Moisture)) it takes that share of it instead, and the bonds follow.
    pub drying: f32,
    /// Temperature of the air at the nozzle (°C): it evaporates water. Falls along the axis as a
    /// jet does, [`jet`](crate::environment::vapour::jet). Default 105 (95 at 5 cm, 47 at 15 cm), safe
    /// −20…150.
    pub celsius: f32,
    /// Speed of the air at the nozzle (m/s), for evaporation and droplets; what pushes hair is
    /// `strength`. Default 15, safe 0…30.
    pub speed: f32,
}

impl Default for Blower {
    fn default() -> Self {
        Self { strength: 3.33, drying: 0.3, celsius: 105.0, speed: 15.0 }
    }
}

const STRENGTH: Bound = Bound::new("Blower::strength (m/s²)", 0.0, 1e4, "3.33 is a hair dryer");
const CELSIUS: Bound =
    Bound::new("Blower::celsius (°C)", -273.15, 1000.0, "a hair dryer's nozzle has 60 to 110");
const SPEED: Bound = Bound::new("Blower::speed (m/s)", 0.0, 300.0, "a hair dryer has 10 to 20");
const DRYING: Bound = Bound::new("Blower::drying (s/m)", 0.0, 1e4, "the paper uses 0.3");

impl Blower {
    /// A blower of `strength` (m/s²) with the paper's drying.
    ///
    /// # Errors
    /// When the strength is negative or not finite.
    pub fn new(strength: f32) -> Result<Self, InvalidValue> {
        STRENGTH.check(strength)?;
        Ok(Self { strength, ..default() })
    }

    /// The same blower with warmer or colder air (°C at the nozzle).
    ///
    /// # Errors
    /// Below absolute zero, above 1000 °C, or when not a number.
    pub fn with_celsius(mut self, celsius: f32) -> Result<Self, InvalidValue> {
        self.celsius = CELSIUS.check(celsius)?;
        Ok(self)
    }

    fn mended(&self, notes: &Notes) -> Self {
        let d = Self::default();
        Self {
            strength: STRENGTH.mend(self.strength, d.strength, notes),
            drying: DRYING.mend(self.drying, d.drying, notes),
            celsius: CELSIUS.mend(self.celsius, d.celsius, notes),
            speed: SPEED.mend(self.speed, d.speed, notes),
        }
    }
}

/// The wind a strand has received: per joint, Σ |Δv_w| over time (m/s). Add it to strands whose
/// exposure you want to know; the tick fills it.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct WindReceived {
    /// Σ |Δv_w| of the edge that starts at each joint (m/s), root first.
    pub total: Vec<f32>,
}
