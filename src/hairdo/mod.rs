//! Shapes that hair has been given: [`style`] measures how much of one is left, [`tie`] holds strands together, `save`
//! keeps a hairdo as bytes, [`rollback`] the state of a tick.

pub mod rollback;
#[cfg(feature = "save")]
pub mod save;
pub mod style;
pub mod tie;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::hairdo::rollback::{
        HairSnapshot, HairSnapshots, HairWorldSnapshot, SnapshotError,
    };
    #[cfg(feature = "save")]
    pub use crate::hairdo::save::{
        ApplyHairdo, CaptureHairdo, Hairdo, HairdoApplied, HairdoCaptured, HairdoError,
        HairdoRejected,
    };
    pub use crate::hairdo::style::{HairCondition, HairStyle, KeptStyle, StyleFaded};
    pub use crate::hairdo::tie::{
        HairTie, HairTied, StrandRegion, TieHair, TieProgress, Tied, TiedStrands,
    };
}
