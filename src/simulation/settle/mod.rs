//! Settling: hair that has just been planted is simulated ahead, hidden, until it is at rest.
//!
//! Hair that was planted or loaded from a file is not at rest: gravity and colliders have not acted
//! on it yet. A [`Settling`] hair runs additional ticks with each tick of the game, while nothing
//! else moves: in the schedule [`SettleTick`](crate::SettleTick), which moves strands without
//! bonds, water, treatments and time. It is not drawn meanwhile. Once it is at rest, or its ticks
//! are used up, the component is removed, its velocities are zeroed and it is drawn for the first
//! time.
//!
//! The hair also takes part in the game's own ticks, so its surroundings are up to date when it is
//! drawn.
//!
//! Hair that [`WearHair`](crate::WearHair) puts on has settled by then: `ahead` does the same in a world of its
//! own, on another thread. So does, where ticks are rare because time stands still or goes slowly, `elsewhere` for all
//! other hair.

mod ahead;
mod elsewhere;
mod plugin;
mod systems;

pub use crate::hair::strand::Settling;
#[cfg(feature = "groom")]
pub(crate) use ahead::{SettleAhead, SettleConditions, Settled};
pub use plugin::SettlePlugin;

use crate::base::setting::setting;
use bevy::prelude::*;

setting! {
    /// How hair that is [`Settling`] settles. Component of a [`Hair`](crate::Hair); where absent,
    /// [`HairDefault<SettleSettings>`](crate::HairDefault) holds.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut app = App::new();
    /// // Show presets and worn hair while they fall into place.
    /// app.insert_resource(HairDefault(SettleSettings { ticks: 0, ..default() }));
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct SettleSettings {
        /// Maximum number of ticks that are simulated ahead; 0 draws hair at once, as planted.
        pub ticks: u32 = 120, in TICKS: 0.0..=1e5, safe 0.0..=600.0, "120 are two seconds at 60 Hz";
        /// How many of them run with each tick of the game, which is also their cost in ticks of
        /// this hair. The hair is hidden for at most `ticks` / `at_once` ticks of the game. Worn hair settles
        /// elsewhere and does not need it.
        pub at_once: u32 = 4, in AT_ONCE: 1.0..=1e5, safe 1.0..=32.0,
            "4 hide it for half a second at most";
        /// Speed below which a node counts as at rest.
        pub speed: f32 = 3e-3, "m/s" in SPEED: 0.0..=10.0, safe 1e-4..=0.1, "0.003 is not visible";
        /// Damping of motion while it settles, in addition to the drag of the air. The shape at
        /// rest does not depend on it.
        pub damping: f32 = 6.0, "1/s" in DAMPING: 0.0..=1e3, safe 0.0..=30.0, "6 hardly swings";
    }
}
