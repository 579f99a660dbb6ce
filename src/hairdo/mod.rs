//! Shapes that hair has been given: [`style`] measures how much of one is left, [`tie`] holds strands together, [`cut`]
//! shortens them, `save` keeps a hairdo as bytes, [`rollback`] the state of a tick.

pub mod cut;
mod region;
pub mod rollback;
#[cfg(feature = "save")]
pub mod save;
pub mod style;
pub mod tie;

pub use region::StrandRegion;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::hairdo::StrandRegion;
    pub use crate::hairdo::cut::{CutBy, CutHair, HairCut};
    pub use crate::hairdo::rollback::{
        HairSnapshot, HairSnapshots, HairWorldSnapshot, SnapshotError,
    };
    #[cfg(feature = "save")]
    pub use crate::hairdo::save::{
        ApplyHairdo, CaptureHairdo, Hairdo, HairdoApplied, HairdoCaptured, HairdoError,
        HairdoRejected,
    };
    pub use crate::hairdo::style::{HairCondition, HairStyle, KeptStyle, StyleFaded};
    pub use crate::hairdo::tie::{HairTie, HairTied, TieHair, TieProgress, Tied, TiedStrands};
}
