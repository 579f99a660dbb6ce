//! What is going on: numbers for Bevy's diagnostics, lines drawn over the scene, and [`HairReport`]s of single hairs.
//!
//! Neither [`HairDiagnosticsPlugin`] nor `HairDebugPlugin` is part of [`HairPlugins`](crate::HairPlugins); without them
//! nothing is measured.
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
mod report;
#[cfg(feature = "debug")]
mod shapes;

pub use diagnostics::HairDiagnosticsPlugin;
pub use report::{HairReport, HairReports, ReportPlugin, WhyMoved};
#[cfg(feature = "debug")]
pub use {config::HairGizmos, gizmos::HairDebugPlugin};

use crate::hair::strand::{Hair, MotionOwner, StrandOf, StrandSleep};
use bevy::{ecs::system::SystemParam, prelude::*};

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    #[cfg(feature = "debug")]
    pub use crate::debug::{HairDebugPlugin, HairGizmos};
    pub use crate::debug::{HairDiagnosticsPlugin, HairReport, HairReports, WhyMoved};
}

/// What moves a strand: its hair's [`MotionOwner`], and within that its own sleep.
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
    hairs: Query<'w, 's, &'static MotionOwner, With<Hair>>,
}

impl Owners<'_, '_> {
    fn of(&self, strand: &StrandOf, sleep: &StrandSleep) -> Owner {
        match self.hairs.get(strand.0).copied().unwrap_or_default() {
            MotionOwner::Gpu | MotionOwner::AsleepOnGpu => Owner::Gpu,
            MotionOwner::Frozen => Owner::Frozen,
            MotionOwner::Settling => Owner::Settling,
            MotionOwner::Played if !sleep.is_follower() => Owner::Frozen,
            _ if sleep.is_follower() => Owner::Follower,
            _ if sleep.is_asleep() => Owner::Asleep,
            _ => Owner::Simulated,
        }
    }
}
