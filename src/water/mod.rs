//! Water: droplets that fall, land and clump hair, hair that gets wet and dries, and bonds that
//! follow.
//!
//! The wet-hair paper's droplets as entities, and the full cycle of wetting and drying, which both
//! papers leave open. A [`Droplet`] lands on a strand, rides on it, pulls other strands together,
//! spreads into a film and soaks in ([`Moisture`]). Where fibres are wet, hydrogen bonds open; the
//! air, damp or dry, still or from a [`Blower`](crate::Blower), dries it again; the bonds close in
//! the current shape. Bond rates follow from the water alone.
//!
//! Droplets find strands through the unbounded [uniform grid](crate::base::grid), without testing all
//! pairs. They never change archetype: tens of thousands move in one pass.
//!
//! Every drop of water is accounted for in [`WaterLedger`]: in = held + out.

mod adhesion;
mod bridge;
#[doc(hidden)]
pub mod drag;
mod droplet;
mod droplet_contact;
mod exchange;
mod field;
mod merge;
pub mod model;
pub mod moisture;
mod motion;
mod strand_block;
mod submerge;
mod systems;
mod volume;

pub use bridge::HairDried;
pub(crate) use bridge::{HoldsWater, IsWet};
pub use droplet::{Droplet, Shower, StrandPoint};
pub use moisture::{HairWetting, Moisture};
pub use systems::WaterPlugin;
pub use volume::WaterVolume;
pub(crate) use {droplet_contact::WaterField, exchange::FoundWater};

use crate::base::{
    setting::{Ranged, ValueRange, Violations, setting},
    tape::Tape,
};
use bevy::prelude::*;

setting! {
    /// Rules for droplets. A resource.
    #[derive(Resource, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Resource, Default, Clone, PartialEq)]
    pub struct DropletRules {
        /// Lower corner of the box in the world that droplets may be in, endless by default. A floor
        /// drains at its height.
        pub min: Vec3 = Vec3::NEG_INFINITY, "m" in MIN: f32::NEG_INFINITY..=f32::INFINITY,
            "0 drains at the ground";
        /// Upper corner.
        pub max: Vec3 = Vec3::INFINITY, "m" in MAX: f32::NEG_INFINITY..=f32::INFINITY,
            "at least the lower corner";
        /// How long a drop lies on a collider before it is removed as run off.
        pub resting_time: f32 = 2.0, "s" in RESTING_TIME: 0.0..=f32::INFINITY, safe 0.0..=60.0,
            "2 lets it run off";
        /// Whether drops that touch merge; in \[W\] they do not. Drips, which hair sheds, merge with what
        /// they touch in any case.
        pub merging: bool = true;
        /// Depth below hair at which a falling drop is removed, unless it is within
        /// [`removal_distance`](Self::removal_distance) of other hair that is lower.
        pub removal_depth: f32 = 5.0, "m" in REMOVAL_DEPTH: 0.0..=f32::INFINITY, safe 0.5..=100.0,
            "5 is below any floor that a character stands on";
        /// Distance from all hair, along the world's axes, beyond which a drop is removed; from the origin
        /// while there is no hair.
        pub removal_distance: f32 = 100.0, "m" in REMOVAL_DISTANCE: 0.0..=f32::INFINITY,
            safe 2.0..=1000.0, "100 is above any shower";
    }
    then Self::check_corners
}

impl DropletRules {
    fn check_corners(&mut self, violations: &mut Violations) {
        for (min, max) in self.min.to_array().into_iter().zip(self.max.as_mut()) {
            let ValueRange { what, valid, hint, .. } = Self::MAX;
            ValueRange::new(what, min..=*valid.end(), hint).clamp(max, || min, violations);
        }
    }
}

/// Sets the water of a hair or strand at once, like a bucket of water or a towel: an event on its entity, or a
/// message where many are sent. Acts in the next tick; the [`WaterLedger`] counts the difference.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn bath(In(character): In<Entity>, mut commands: Commands) {
///     commands.trigger(SoakHair::dripping(character));
///     // and to dry it off at once
///     commands.trigger(SoakHair { target: character, wetness: 0.0 });
/// }
/// ```
#[derive(EntityEvent, Message, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct SoakHair {
    /// The [`Hair`](crate::Hair) or strand, or who wears it.
    #[event_target]
    pub target: Entity,
    /// Share of what hair can bind: 1 soaks through, 0 dries. Up to 1 the film is removed; the
    /// excess over 1 is film, as a share of the film that stays on hair: 2 is dripping wet. Range
    /// [`WETNESS`](Self::WETNESS).
    pub wetness: f32,
}

impl SoakHair {
    /// The range of [`wetness`](Self::wetness).
    pub const WETNESS: ValueRange =
        ValueRange::new("SoakHair::wetness", 0.0..=2.0, "2 drips, 1 soaks through, 0 dries");

    /// Soaked through and with all the film that stays on hair: heavy, soft and dark, in locks.
    pub fn dripping(target: Entity) -> Self {
        Self { target, wetness: 2.0 }
    }
}

impl Ranged for SoakHair {
    fn clamp_values(&mut self, violations: &mut Violations) {
        Self::WETNESS.clamp(&mut self.wetness, || 0.0, violations);
    }
}

/// How much of a component's water the [`WaterLedger`] has counted (m³). A clone starts with 0, and it
/// is ignored in comparisons.
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

/// The balance of water: added, present and removed (m³). A resource, kept by the tick; `held` is that
/// of the tick's end.
///
/// The water of every [`Droplet`] and [`Moisture`] counts: a spawned, inserted or cloned component adds
/// its water, an overwritten, removed or despawned one removes it. The next tick counts what was added
/// and overwritten.
#[derive(Resource, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Resource, Default, Clone, PartialEq)]
pub struct WaterLedger {
    /// Spawned as droplets, soaked in, cloned, written, taken from damp air or out of a [`WaterVolume`].
    pub water_in: f64,
    /// In droplets, on and in hair.
    pub held: f64,
    /// Evaporated, run off, out of bounds, into a [`WaterVolume`], despawned.
    pub water_out: f64,
}

impl WaterLedger {
    /// Takes it down, or puts it back.
    pub(crate) fn on_tape(&mut self, tape: &mut Tape<'_>) {
        tape.values([&mut self.water_in, &mut self.held, &mut self.water_out]);
    }

    /// Counts water that was added (m³), or removed if negative.
    fn record(&mut self, change: f64) {
        *(if change > 0.0 { &mut self.water_in } else { &mut self.water_out }) += change.abs();
    }

    /// Counts water that was added to hair at once (m³), or removed if negative, also in `held`.
    pub(crate) fn replace(&mut self, change: f64) {
        self.record(change);
        self.held += change;
    }

    /// |in − held − out| / in, the relative error of the balance; 0 if no water was added.
    pub fn error(&self) -> f64 {
        if self.water_in > 0.0 {
            (self.water_in - self.held - self.water_out).abs() / self.water_in
        } else {
            0.0
        }
    }
}

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::water::{
        Droplet, DropletRules, HairDried, HairWetting, Moisture, Shower, SoakHair, StrandPoint,
        WaterLedger, WaterVolume,
    };
}
