//! What all rooms stand on: faults, settings with ranges, the schedule of a tick, work on threads, SIMD lanes, grids.

pub mod fault;
pub mod grid;
#[doc(hidden)]
pub mod lanes;
pub(crate) mod motion;
pub(crate) mod parallel;
pub mod schedule;
pub mod setting;
pub(crate) mod stretch;
pub(crate) mod tape;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::base::fault::{FaultKind, HairFault};
    pub use crate::base::schedule::{
        HairProcessTime, HairStep, HairSubsteps, HairSystems, HairTick, HairTicks, SettleTick,
    };
    pub use crate::base::setting::{HairDefault, InvalidValue, ValueRange};
}
