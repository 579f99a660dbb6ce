//! The environment of hair: gravity, global wind, wind zones, blowers, drag of the air, and how fast
//! water evaporates.

mod blown;
mod climate;
mod gust;
mod local;
mod systems;
pub mod vapour;
pub mod wind;
mod zone;

pub(crate) use blown::Blown;
pub use blown::BlownAir;
pub use climate::HairClimate;
pub use local::WindTravel;
pub(crate) use local::{LocalWinds, Winds};
pub use systems::EnvironmentPlugin;
pub use zone::{HairWind, WindZone, ZoneShape};

use crate::{
    base::setting::{InvalidValue, Ranged, ValueRange, Violations, setting},
    hair::strand::TickPose,
};
use bevy::{ecs::system::SystemParam, prelude::*};

/// Gravity of all hair (m/s², in the world). Default (0, −9.80, 0), as in \[B\] table 1. Not scaled
/// with a character. Range of each component: [`RANGE`](Self::RANGE).
#[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq, Deref, DerefMut)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct HairGravity(pub Vec3);

impl Default for HairGravity {
    fn default() -> Self {
        Self(Vec3::NEG_Y * 9.8)
    }
}

impl HairGravity {
    /// The range of each of its components.
    pub const RANGE: ValueRange =
        ValueRange::new("HairGravity (m/s²)", -1e4..=1e4, "9.8 down is the Earth's");
}

/// [`HairGravity`], none without the plugin that provides it.
#[derive(SystemParam)]
pub(crate) struct Gravity<'w>(Option<Res<'w, HairGravity>>);

impl Gravity<'_> {
    pub(crate) fn clamped(&self) -> HairGravity {
        self.0.as_ref().map_or(HairGravity(Vec3::ZERO), |gravity| gravity.clamped())
    }
}

impl Ranged for HairGravity {
    fn clamp_values(&mut self, violations: &mut Violations) {
        Self::RANGE.clamp(&mut self.0, || Self::default().0, violations);
    }
}

setting! {
    /// Drag of the air: relaxes hair's velocity to that of the air around it. Component of a
    /// [`Hair`](crate::Hair); where absent, [`HairDefault<AirDrag>`](crate::HairDefault) holds.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct AirDrag {
        /// Rate at which velocities relative to the air decay, v′ = −rate · (v − u).
        pub rate: f32 = 2.0, "1/s" in RATE: 0.0..=1e4, safe 0.0..=50.0, "2 is air";
    }
}

setting! {
    /// A hair dryer: blows along its transform's forward direction (−Z) and dries what it blows on.
    ///
    /// Equation 17 of \[B\]. Despawn it, or set `strength` to 0, to switch it off.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(Transform, TickPose)]
    pub struct Blower {
        /// α, the acceleration of an edge across the wind, on the axis. The paper gives no value.
        pub strength: f32 = 3.33, "m/s²" in STRENGTH: 0.0..=1e4, safe 0.0..=30.0,
            "3.33 is a hair dryer";
        /// Rate of hydrogen bonds that form per velocity that the wind gives, equation 19 (the
        /// paper: 0.003 s/cm); 0 blows without drying. On hair that carries water
        /// ([`Moisture`](crate::Moisture)) it removes that share of it instead, and the bonds follow.
        pub drying: f32 = 0.3, "s/m" in DRYING: 0.0..=1e4, safe 0.0..=1.0, "the paper uses 0.3";
        /// Temperature of the air at the nozzle: it evaporates water. Falls along the axis as a jet
        /// does, [`jet`](crate::forces::environment::vapour::jet): 105 gives 95 at 5 cm, 47 at 15 cm.
        pub celsius: f32 = 105.0, "°C" in CELSIUS: -273.15..=1000.0, safe -20.0..=150.0,
            "a hair dryer's nozzle has 60 to 110";
        /// Speed of the air at the nozzle, for evaporation and droplets; what pushes hair is
        /// `strength`.
        pub speed: f32 = 15.0, "m/s" in SPEED: 0.0..=300.0, safe 0.0..=30.0,
            "a hair dryer has 10 to 20";
    }
}

impl Blower {
    /// A hair dryer at `from` that is aimed at `at` (m, in the world or in its parent).
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # fn setup(mut commands: Commands) {
    /// commands.spawn(Blower::blow_dry(Vec3::new(0.3, 1.7, 0.2), Vec3::new(0.0, 1.6, 0.0)));
    /// # }
    /// ```
    pub fn blow_dry(from: Vec3, at: Vec3) -> (Self, Transform) {
        let up =
            if (at - from).cross(Vec3::Y).length_squared() > 1e-12 { Vec3::Y } else { Vec3::X };
        (Self::default(), Transform::from_translation(from).looking_at(at, up))
    }

    /// A blower of `strength` (m/s²) with the paper's drying.
    ///
    /// # Errors
    /// When the strength is negative or not finite.
    pub fn new(strength: f32) -> Result<Self, InvalidValue> {
        Self { strength, ..default() }.checked()
    }

    /// The same blower with warmer or colder air (°C at the nozzle).
    ///
    /// # Errors
    /// When it is outside [`CELSIUS`](Self::CELSIUS).
    pub fn with_celsius(self, celsius: f32) -> Result<Self, InvalidValue> {
        Self { celsius, ..self }.checked()
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
