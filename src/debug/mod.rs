//! What is going on: numbers for Bevy's diagnostics, and lines drawn over the scene.
//!
//! Neither plugin is part of [`HairPlugins`](crate::HairPlugins); without them nothing is measured.
//!
//! ```
//! use bevy::{diagnostic::LogDiagnosticsPlugin, prelude::*};
//! use bevy_keratin::{debug::HairDiagnosticsPlugin, prelude::*};
//!
//! App::new().add_plugins((
//!     MinimalPlugins,
//!     HairPlugins::default(),
//!     HairDiagnosticsPlugin,
//!     LogDiagnosticsPlugin::default(),
//! ));
//! ```

#[cfg(feature = "debug")]
mod config;
mod diagnostics;
#[cfg(feature = "debug")]
mod gizmos;
#[cfg(feature = "debug")]
mod shapes;

pub use diagnostics::HairDiagnosticsPlugin;
#[cfg(feature = "debug")]
pub use {config::HairGizmos, gizmos::HairDebugPlugin};

use crate::{
    hair::strand::{Hair, OnGpu, StrandOf, StrandSleep},
    simulation::{lod::PresentLod, settle::Settling},
};
use bevy::{ecs::system::SystemParam, prelude::*};

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::debug::HairDiagnosticsPlugin;
    #[cfg(feature = "debug")]
    pub use crate::debug::{HairDebugPlugin, HairGizmos};
}

/// What moves a strand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Owner {
    Simulated,
    Asleep,
    Follower,
    Frozen,
    Gpu,
    Settling,
}

/// What moves each strand.
#[derive(SystemParam)]
struct Owners<'w, 's> {
    hairs: Query<'w, 's, (Has<OnGpu>, Has<Settling>, Option<&'static PresentLod>), With<Hair>>,
}

impl Owners<'_, '_> {
    fn of(&self, strand: &StrandOf, sleep: &StrandSleep) -> Owner {
        let (on_gpu, settles, lod) = self.hairs.get(strand.0).unwrap_or_default();
        let is_frozen = lod.is_some_and(|lod| lod.simulated_share() <= 0.0);
        match sleep.is_follower() {
            _ if on_gpu => Owner::Gpu,
            true if is_frozen => Owner::Frozen,
            _ if settles => Owner::Settling,
            true => Owner::Follower,
            false if sleep.is_asleep() => Owner::Asleep,
            false => Owner::Simulated,
        }
    }
}
