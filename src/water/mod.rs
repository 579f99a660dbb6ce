//! Water: droplets that fall, land and clump hair, hair that gets wet and dries, and bonds that
//! follow.
//!
//! The wet-hair paper's droplets as entities, then what both papers leave open: an unbroken loop. A
//! [`Droplet`] lands on a strand, rides on it, pulls other strands together, spreads into a film and
//! soaks in ([`Moisture`]). Where fibres are wet, hydrogen bonds open; the air, damp or dry, still
//! or out of a [`Blower`](crate::Blower), takes the water again; the bonds close around the shape of
//! that moment. Nobody sets a rate.
//!
//! Droplets find strands through the [uniform grid](crate::grid), neither by all pairs nor in a unit
//! box. They are rows of one table and never change archetype: ten thousands move in one pass.
//!
//! Every drop of water is accounted for in [`WaterLedger`]: in = held + out.

mod adhesion;
mod bridge;
mod droplet;
mod droplet_contact;
mod exchange;
mod field;
mod merge;
pub mod model;
pub mod moisture;
mod motion;
mod strand_block;
mod systems;

pub use bridge::HairDried;
pub(crate) use bridge::IsWet;
pub use droplet::{Droplet, Ride, Shower};
pub use moisture::{Moisture, Wetting};
pub use systems::WaterPlugin;

use crate::setting::{Ranged, ValueRange, Violations, setting};
use bevy::prelude::*;

setting! {
    /// What droplets may do. A resource.
    #[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Resource, Default, Clone, PartialEq)]
    pub struct DropletRules {
        /// Lower corner of the box that droplets may be in. A floor drains at its height.
        pub min: Vec3 = Vec3::splat(-100.0), "m" in MIN: f32::NEG_INFINITY..=f32::INFINITY,
            "-100 is far below";
        /// Upper corner.
        pub max: Vec3 = Vec3::splat(100.0), "m" in MAX: f32::NEG_INFINITY..=f32::INFINITY,
            "100 is far above, and more than the lower corner";
        /// How long a drop lies on a collider before it has run off.
        pub lying: f32 = 2.0, "s" in LYING: 0.0..=f32::INFINITY, safe 0.0..=60.0,
            "2 lets it run off";
        /// Whether drops that touch become one; \[W\]'s own drops do not.
        pub merging: bool = true;
    }
}

/// Sets the bound water of a hair or strand at once and takes the film off it: a dive into a lake, a
/// towel. A message; the [`WaterLedger`] counts the difference.
#[derive(Message, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct SoakHair {
    /// The [`Hair`](crate::Hair) or strand.
    pub target: Entity,
    /// Share of what hair can bind: 1 soaks through, 0 dries.
    pub wetness: f32,
}

impl SoakHair {
    /// The range of [`wetness`](Self::wetness).
    pub const WETNESS: ValueRange =
        ValueRange::new("SoakHair::wetness", 0.0..=1.0, "1 soaks through, 0 dries");
}

impl Ranged for SoakHair {
    fn clamp_values(&mut self, violations: &mut Violations) {
        Self::WETNESS.clamp(&mut self.wetness, || 0.0, violations);
    }
}

/// How much of a component's water the [`WaterLedger`] knows (m³). The water of a clone is new to it,
/// and what is known of two equal drops does not tell them apart.
#[derive(Debug, Default)]
pub(crate) struct Counted(pub f64);

impl Clone for Counted {
    fn clone(&self) -> Self {
        Self::default()
    }
}

impl PartialEq for Counted {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

/// The water that came, is there and has gone (m³). A resource, kept by the tick; `held` is of the
/// tick's end.
///
/// Water is in the world as soon as a [`Droplet`] or a [`Moisture`] that holds it is: a clone brings its
/// water along, whether of a droplet, of moisture or of a strand with both, as does a component that
/// is inserted. What is overwritten, removed or despawned takes its water along. The next tick counts
/// what has come, and what has been written over.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct WaterLedger {
    /// Spawned as droplets, soaked in, cloned, written, taken from damp air.
    pub water_in: f64,
    /// In droplets, on and in hair.
    pub held: f64,
    /// Evaporated, run off, out of bounds, despawned.
    pub water_out: f64,
}

impl WaterLedger {
    /// Books water that came (m³), or with a negative sign went.
    fn book(&mut self, came: f64) {
        *(if came > 0.0 { &mut self.water_in } else { &mut self.water_out }) += came.abs();
    }

    /// Books water that was put on or taken off hair at once (m³), also as held.
    #[cfg(feature = "save")]
    pub(crate) fn replace(&mut self, came: f64) {
        self.book(came);
        self.held += came;
    }

    /// |in − held − out| / in, what has been lost count of; 0 where no water came.
    pub fn error(&self) -> f64 {
        if self.water_in > 0.0 {
            (self.water_in - self.held - self.water_out).abs() / self.water_in
        } else {
            0.0
        }
    }
}
