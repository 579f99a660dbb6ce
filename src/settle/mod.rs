//! Settling: hair that has just been planted is simulated ahead, unseen, until it hangs as it will.
//!
//! Where hair is planted by rule or comes from a file it is not at rest: gravity has not acted on it, nor
//! have colliders. A [`Settling`] hair is taken through ticks of its own, some with each tick of the game,
//! while nothing else moves: in the schedule [`HairSettle`](crate::HairSettle), which has what moves strands and nothing of
//! bonds, water, treatments and time. It is not drawn meanwhile. Once it rests, or its ticks are used up, it
//! loses the component, its velocities are zero and it is drawn for the first time.
//!
//! The hair takes part in the game's own ticks, too, so what is around it has been seen when it is drawn.

mod systems;

pub use systems::SettlePlugin;

use crate::setting::setting;
use bevy::prelude::*;

setting! {
    /// How hair that is [`Settling`] settles. Component of a [`Hair`](crate::Hair); where absent,
    /// [`HairDefault<HairSettling>`](crate::HairDefault) holds.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// # let mut app = App::new();
    /// // Presets and worn hair are to be seen as they fall into place.
    /// app.insert_resource(HairDefault(HairSettling { ticks: 0, ..default() }));
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairSettling {
        /// The most ticks that are simulated ahead; 0 draws hair at once, where it was planted.
        pub ticks: u32 = 120, in TICKS: 0.0..=1e5, safe 0.0..=600.0, "120 are two seconds at 60 Hz";
        /// How many of them with each tick of the game: what that costs at most, in ticks of this hair.
        /// The hair is unseen for as many ticks of the game as `ticks` over this, at most.
        pub at_once: u32 = 4, in AT_ONCE: 1.0..=1e5, safe 1.0..=32.0,
            "4 have it unseen for half a second at most";
        /// Speed below which a node counts as at rest.
        pub speed: f32 = 3e-3, "m/s" in SPEED: 0.0..=10.0, safe 1e-4..=0.1, "0.003 is not seen";
        /// Rate at which motion dies away while it settles, beside what holds in the air. Where it
        /// comes to rest does not depend on it.
        pub damping: f32 = 6.0, "1/s" in DAMPING: 0.0..=1e3, safe 0.0..=30.0, "6 hardly swings";
    }
}

/// Makes a [`Hair`](crate::Hair) settle before it is first drawn, as [`HairSettling`] says; removed by the
/// tick once it has. Presets' settings and worn hair have it; hair that is made by hand has it if you
/// insert it.
///
/// Time that stands still settles nothing: in a paused game such hair stays unseen.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn grow(mut commands: Commands) {
///     let hair = commands.spawn((Hair, Settling::default())).id();
///     let level = Strand::from_polyline(&[Vec3::ZERO, Vec3::X * 0.05, Vec3::X * 0.1]).unwrap();
///     commands.spawn((StrandOf(hair), level));
/// }
/// ```
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct Settling {
    /// How many ticks it has been simulated ahead.
    pub done: u32,
    /// For how long it has been still (s).
    pub still: f32,
}
