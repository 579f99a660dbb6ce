//! Sleep: strands that lie still are left alone until something happens to them.
//!
//! Once a tick each strand is asked: has it stayed in its place for a while, and is nothing going on
//! that could move it or its bonds? Then it sleeps ([`Sleep`](crate::Sleep)): velocities are zero,
//! and forces, contacts, rest shapes and projection pass it by. It wakes when the head moves,
//! gravity or a setting changes, a blower reaches it, a collider comes, goes or moves near it, a
//! neighbour pushes it otherwise than before, its held nodes or its root move, bonds are treated,
//! water or a droplet is on it, or somebody writes to its [`Strand`](crate::Strand) or
//! [`Bonds`](crate::Bonds).
//!
//! Wet hair, hair in the wind and hair whose bonds are moving never sleeps: a style that is still
//! forming would freeze. The mathematics is in [`model`].

pub mod model;
mod systems;

pub use systems::SleepPlugin;

use crate::setting::{Bound, HairSetting, Notes};
use bevy::prelude::*;

/// When strands fall asleep. Component of a [`Hair`](crate::Hair), may change at any time; where
/// absent, [`HairDefault<HairSleep>`](crate::HairDefault) holds.
///
/// A strand sleeps once none of its nodes has been farther than `speed` · `seconds`, and no edge
/// turned by more than `turning` · `seconds`, from where it was `seconds` ago. A swing's turning
/// point does not last that long; trembling in one place does.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// # let mut world = World::new();
/// // hair that a story's camera looks at closely: it is to come to rest completely
/// world.spawn((Hair, HairSleep { speed: 1e-5, ..default() }));
/// // hair that is never left alone
/// world.spawn((Hair, HairSleep::never()));
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct HairSleep {
    /// Mean speed below which a node counts as still (m/s). Default 1e-4, which is 0.05 mm in half a
    /// second; safe 1e-6…1e-2. More puts slowly settling hair to sleep before it has settled.
    pub speed: f32,
    /// Mean angular velocity below which an edge counts as still (rad/s). Default 0.01, safe
    /// 1e-4…0.1.
    pub turning: f32,
    /// How long a strand has to be still (s). Default 0.5, safe 0.2…10; infinite never sleeps.
    pub seconds: f32,
}

impl HairSleep {
    /// For hair that is always simulated.
    pub fn never() -> Self {
        Self { seconds: f32::INFINITY, ..default() }
    }

    /// How far a node may stray while it counts as still (m).
    pub fn distance(&self) -> f32 {
        self.speed * self.window()
    }

    /// How far an edge may turn meanwhile (rad).
    pub fn angle(&self) -> f32 {
        self.turning * self.window()
    }

    fn window(&self) -> f32 {
        if self.seconds.is_finite() { self.seconds } else { 0.0 }
    }
}

impl Default for HairSleep {
    fn default() -> Self {
        Self { speed: 1e-4, turning: 1e-2, seconds: 0.5 }
    }
}

const SPEED: Bound = Bound::new("HairSleep::speed (m/s)", 0.0, 1.0, "1e-4 is hardly to be seen");
const TURNING: Bound = Bound::new("HairSleep::turning (rad/s)", 0.0, 10.0, "0.01 is half a degree");
const SECONDS: Bound =
    Bound::new("HairSleep::seconds (s)", 0.0, f32::INFINITY, "0.5 outlasts a turning point");

impl HairSetting for HairSleep {
    fn mended(&self, notes: &Notes) -> Self {
        let d = Self::default();
        Self {
            speed: SPEED.mend(self.speed, d.speed, notes),
            turning: TURNING.mend(self.turning, d.turning, notes),
            seconds: SECONDS.mend(self.seconds, d.seconds, notes),
        }
    }
}
