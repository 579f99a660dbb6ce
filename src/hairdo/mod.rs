//! Shapes that hair has been given: [`style`] measures how much of one is left, `save` keeps one as bytes.

#[cfg(feature = "save")]
pub mod save;
pub mod style;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    #[cfg(feature = "save")]
    pub use crate::hairdo::save::{
        ApplyHairdo, CaptureHairdo, Hairdo, HairdoApplied, HairdoCaptured, HairdoError,
        HairdoRejected,
    };
    pub use crate::hairdo::style::{HairCondition, HairStyle, KeptStyle, StyleFaded};
}
