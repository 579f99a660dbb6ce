//! Sleep: strands at rest are not simulated until something disturbs them.
//!
//! Once a tick each strand is checked: has it been still for a while, and is there nothing that
//! could move it or its bonds? Then it sleeps ([`StrandSleep`](crate::StrandSleep)): velocities are
//! zero, and forces, contacts, rest shapes and projection skip it. It wakes when the head moves,
//! gravity or a setting changes, a blower reaches it, a collider appears, disappears or moves near
//! it, contact with a neighbour changes, its held nodes or its root move, bonds are treated, a droplet is on it, its
//! bound water or its mass with the water on it has changed by a hundredth, or game code writes to its
//! [`Strand`](crate::Strand) or [`Bonds`](crate::Bonds).
//!
//! Hair in the wind and hair whose bonds are changing never sleeps: a style that is still forming would be frozen. The
//! equations are in [`model`].

#[doc(hidden)]
pub mod model;
#[cfg(feature = "gpu")]
mod on_gpu;
mod record;
mod systems;

#[cfg(feature = "gpu")]
pub(crate) use on_gpu::{Disturbance, watch_on_gpu};
pub use systems::SleepPlugin;
pub(crate) use systems::{Conditions, RestSettings, SleepSnapshot, is_blown};

use crate::base::setting::setting;
use bevy::prelude::*;

setting! {
    /// When strands fall asleep. Component of a [`Hair`](crate::Hair), may change at any time; where
    /// absent, [`HairDefault<SleepSettings>`](crate::HairDefault) holds.
    ///
    /// A strand sleeps once none of its nodes has moved farther than `speed` · `seconds`, and no edge
    /// has turned by more than `turning` · `seconds`, from where it was `seconds` ago. The turning point
    /// of a swing does not last that long, so it does not count as rest; trembling in place does.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut world = World::new();
    /// // hair in a close-up, which has to come to rest completely
    /// world.spawn((Hair, SleepSettings { speed: 1e-5, ..default() }));
    /// // hair that is always simulated
    /// world.spawn((Hair, SleepSettings::never()));
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct SleepSettings {
        /// Mean speed below which a node counts as still. 1e-4 is 0.05 mm in half a second; more puts
        /// slowly settling hair to sleep before it has settled.
        pub speed: f32 = 1e-4, "m/s" in SPEED: 0.0..=1.0, safe 1e-6..=1e-2,
            "1e-4 is hardly visible";
        /// Mean angular velocity below which an edge counts as still.
        pub turning: f32 = 1e-2, "rad/s" in TURNING: 0.0..=10.0, safe 1e-4..=0.1,
            "0.01 is half a degree";
        /// How long a strand has to be still; infinite never sleeps.
        pub seconds: f32 = 0.5, "s" in SECONDS: 0.0..=f32::INFINITY, safe 0.2..=10.0,
            "0.5 outlasts a turning point";
    }
}

impl SleepSettings {
    /// For hair that is always simulated.
    pub fn never() -> Self {
        Self { seconds: f32::INFINITY, ..default() }
    }

    /// How far a node may move while it counts as still (m).
    pub fn distance(&self) -> f32 {
        self.speed * self.window()
    }

    /// How far an edge may turn while it counts as still (rad).
    pub fn angle(&self) -> f32 {
        self.turning * self.window()
    }

    fn window(&self) -> f32 {
        if self.seconds.is_finite() { self.seconds } else { 0.0 }
    }
}
