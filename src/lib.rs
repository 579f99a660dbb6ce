// Only where it is shown or tried: an edit of it builds nothing else again.
#![cfg_attr(any(doc, doctest), doc = include_str!("../README.md"))]
#![cfg_attr(not(any(doc, doctest)), doc = "Hair for the Bevy game engine that remembers.")]
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
#[cfg(feature = "gpu")]
pub mod gpu;
pub mod grid;
#[cfg(feature = "groom")]
pub mod groom;
#[doc(hidden)]
pub mod lanes;
pub mod lod;
pub mod look;
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
pub mod settle;
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
pub use contact::{BakeError, ColliderShape, ConvexHull, DistanceGrid, HairCollider, LockContact};
pub use environment::{
    AirDrag, Blower, HairClimate, HairGravity, HairWind, WindReceived, WindZone, ZoneShape,
};
pub use fault::{FaultKind, HairFault};
#[cfg(feature = "gpu")]
pub use gpu::{HairGpu, HairProbe, HairProbed, HairResidence, SimulateOn};
#[cfg(feature = "groom")]
pub use groom::{Groom, GroomError, GroomGuides, GroomSettings, GroomedHair};
pub use lod::{HairBudget, HairEstimate, HairLod, HairScreenShare, LodLevel, PresentLod};
pub use look::{DyeLayer, HairColor, HairDye, HairLook, HairShading, Melanin, Streaks, WornPreset};
pub use mass_spring::Springs;
pub use plugins::{HairPlugins, run_ticks};
pub use rod::{HairSolver, HairStiffness, SolverMethod, StretchProjection, Sweeps};
#[cfg(feature = "save")]
pub use save::{
    Hairdo, HairdoError, HairdoPutOn, HairdoRefused, HairdoTaken, PutOnHairdo, TakeHairdo,
};
pub use schedule::{HairProcessTime, HairSettle, HairStep, HairSubsteps, HairSystems, HairTick};
pub use setting::{HairDefault, InvalidValue, ValueRange};
pub use settle::{HairSettling, Settling};
pub use sleep::HairSleep;
pub use strand::{
    AddedMass, Hair, HairInertia, HeldNodes, HeldNodesState, OnGpu, Sleepers, Strand, StrandError,
    StrandModel, StrandOf, StrandSleep, Strands,
};
pub use style::{HairCondition, HairStyle, KeptStyle, StyleFaded};
pub use treatment::{HairTreatment, PermRod, PermWinding, WoundOn, WoundStrands};
pub use water::{
    Droplet, DropletRules, HairDried, HairWetting, Moisture, Shower, SoakHair, WaterLedger,
    WaterVolume,
};
#[cfg(feature = "groom")]
pub use wear::{HairNotWorn, HairSource, HairWorn, WearError, WearHair, WornHair};

/// The types that most games need.
pub mod prelude {
    #[cfg(feature = "avian")]
    #[doc(hidden)]
    pub use crate::contact::AvianHairCollider;
    #[cfg(feature = "gpu")]
    #[doc(hidden)]
    pub use crate::gpu::{HairGpu, HairProbe, HairProbed, HairResidence, SimulateOn};
    #[cfg(feature = "groom")]
    #[doc(hidden)]
    pub use crate::groom::{Groom, GroomGuides, GroomSettings, GroomedHair};
    #[cfg(feature = "groom")]
    #[doc(hidden)]
    pub use crate::plant::HairPreset;
    #[cfg(feature = "render")]
    #[doc(hidden)]
    pub use crate::render::{HairDetail, HairFollowers, HairSmoothing, HairView};
    #[cfg(feature = "save")]
    #[doc(hidden)]
    pub use crate::save::{
        Hairdo, HairdoError, HairdoPutOn, HairdoRefused, HairdoTaken, PutOnHairdo, TakeHairdo,
    };
    #[cfg(feature = "groom")]
    #[doc(hidden)]
    pub use crate::wear::{HairNotWorn, HairWorn, WearHair, WornHair};
    #[doc(hidden)]
    pub use crate::{
        AirDrag, Blower, BondInfluence, BondKind, Bonds, Cuticle, Droplet, DyeLayer, Hair,
        HairBudget, HairClimate, HairCollider, HairColor, HairCondition, HairDefault, HairDried,
        HairDye, HairFault, HairGravity, HairInertia, HairLod, HairLook, HairPlugins,
        HairProcessTime, HairScreenShare, HairSettling, HairShading, HairSleep, HairSolver,
        HairStiffness, HairStyle, HairSubsteps, HairSystems, HairTick, HairTreatment, HairWetting,
        HairWind, HeldNodes, KeptStyle, LockContact, Melanin, Moisture, PermRod, PermWinding,
        Settling, Shower, SoakHair, Strand, StrandModel, StrandOf, StrandSleep, Strands, Streaks,
        StyleFaded, WaterLedger, WaterVolume, WindZone, WornPreset, WoundOn,
    };
}
