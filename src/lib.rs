#![doc = include_str!("../README.md")]
#![doc = include_str!("guide/substep.md")]
#![doc = include_str!("guide/glossary.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![deny(unsafe_code)]

#[cfg(feature = "groom")]
pub mod attach;
pub mod bond;
#[cfg(feature = "groom")]
pub mod collider_fit;
pub mod contact;
pub mod environment;
pub mod fault;
pub mod grid;
#[cfg(feature = "groom")]
pub mod groom;
#[doc(hidden)]
pub mod lanes;
pub mod lod;
pub mod mass_spring;
mod parallel;
#[cfg(feature = "groom")]
pub mod plant;
pub mod plugins;
#[cfg(feature = "render")]
pub mod render;
pub mod rod;
#[cfg(feature = "save")]
pub mod save;
pub mod schedule;
pub mod setting;
pub mod sleep;
pub mod solve;
pub mod strand;
pub mod style;
pub mod treatment;
pub mod water;
#[cfg(feature = "groom")]
pub mod wear;

pub use bond::{BondChanges, BondInfluence, BondKind, Bonds, Cuticle};
#[cfg(feature = "avian")]
pub use contact::{AvianHairCollider, AvianShapeError};
pub use contact::{ColliderShape, HairCollider, LockContact};
pub use environment::{
    AirDrag, Blower, Climate, HairGravity, Wind, WindReceived, WindZone, ZoneShape,
};
pub use fault::{FaultKind, HairFault};
#[cfg(feature = "groom")]
pub use groom::{Groom, GroomError, GroomGuides, GroomSettings, GroomedHair};
pub use lod::{HairBudget, HairEstimate, HairLod, LodLevel, PresentLod, ScreenShare};
pub use mass_spring::Springs;
pub use plugins::{HairPlugins, run_ticks};
pub use rod::{HairSolver, SolverMethod, Stiffness, StretchProjection, Sweeps};
#[cfg(feature = "save")]
pub use save::{Hairdo, HairdoError};
pub use schedule::{HairStep, HairSubsteps, HairSystems, HairTick, ProcessTime};
pub use setting::{HairDefault, InvalidValue, ValueRange};
pub use sleep::HairSleep;
pub use strand::{
    AddedMass, Hair, HairInertia, HeldNodes, HeldReach, Sleepers, Strand, StrandError, StrandModel,
    StrandOf, StrandSleep, Strands,
};
pub use style::{HairCondition, HairStyle, KeptStyle, StyleFaded};
pub use treatment::{PermRod, Treat, Winding, WoundOn, WoundStrands};
pub use water::{
    Droplet, DropletRules, HairDried, Moisture, Shower, SoakHair, WaterLedger, Wetting,
};
#[cfg(feature = "groom")]
pub use wear::{HairNotWorn, HairSource, HairWorn, WearError, WearHair, WornHair};

/// What most games need.
pub mod prelude {
    #[cfg(feature = "avian")]
    #[doc(hidden)]
    pub use crate::contact::AvianHairCollider;
    #[cfg(feature = "groom")]
    #[doc(hidden)]
    pub use crate::groom::{Groom, GroomGuides, GroomSettings, GroomedHair};
    #[cfg(feature = "render")]
    #[doc(hidden)]
    pub use crate::render::{HairFollowers, HairLook, HairShading, HairView, Melanin};
    #[cfg(feature = "save")]
    #[doc(hidden)]
    pub use crate::save::{Hairdo, HairdoError};
    #[cfg(feature = "groom")]
    #[doc(hidden)]
    pub use crate::wear::{HairNotWorn, HairWorn, WearHair, WornHair};
    #[doc(hidden)]
    pub use crate::{
        AirDrag, Blower, BondInfluence, BondKind, Bonds, Climate, Cuticle, Droplet, Hair,
        HairBudget, HairCollider, HairCondition, HairDefault, HairDried, HairFault, HairGravity,
        HairInertia, HairLod, HairPlugins, HairSleep, HairSolver, HairStyle, HairSubsteps,
        HairSystems, HairTick, HeldNodes, KeptStyle, LockContact, Moisture, PermRod, ProcessTime,
        ScreenShare, Shower, SoakHair, SolverMethod, Stiffness, Strand, StrandModel, StrandOf,
        StrandSleep, Strands, StretchProjection, StyleFaded, Sweeps, Treat, WaterLedger, Wetting,
        Wind, WindZone, Winding, WoundOn,
    };
}
