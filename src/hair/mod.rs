//! What hair is: [`strand`], its entities and their state, [`look`], its colour and gloss, and [`worn`], who wears it.

pub mod look;
pub mod strand;
pub mod worn;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::hair::look::{
        DyeLayer, HairColor, HairDye, HairLook, HairShading, Melanin, Streaks, WornPreset,
    };
    pub use crate::hair::strand::{
        AddedMass, CutStrand, FollowerCuts, Hair, HairInertia, HeldNodes, HeldNodesState,
        MotionOwner, OnGpu, ShiftWorld, SleepCounts, Strand, StrandError, StrandModel, StrandOf,
        StrandSleep, Strands,
    };
    pub use crate::hair::worn::{WornBy, WornHair};
}
