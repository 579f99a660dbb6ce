#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![deny(unsafe_code)]

pub mod air;
pub mod bond;
pub mod contact;
pub mod fault;
pub mod grid;
#[cfg(feature = "groom")]
pub mod groom;
#[cfg(feature = "save")]
pub mod hairdo;
pub mod lod;
mod parallel;
mod prefetch;
#[cfg(feature = "render")]
pub mod render;
pub mod rod;
pub mod setting;
pub mod sleep;
pub mod spring;
pub mod strand;
pub mod style;
pub mod tick;
pub mod water;

pub use air::{AirDrag, Blower, HairGravity, WindReceived};
pub use bond::{BondChanges, BondInfluence, BondKind, Bonds, Cuticle};
#[cfg(feature = "avian")]
pub use contact::{AvianHairCollider, AvianShapeError};
pub use contact::{ColliderShape, HairCollider, LockContact};
pub use fault::{Fault, HairFault};
#[cfg(feature = "groom")]
pub use groom::{Groom, GroomError, GroomGuides, GroomSettings, GroomedHair};
#[cfg(feature = "save")]
pub use hairdo::{Hairdo, HairdoError};
pub use lod::{HairLod, LodLevel, PresentLod, ScreenShare};
pub use rod::{Solver, Stiffness, StretchProjection};
pub use setting::{HairDefault, InvalidValue};
pub use sleep::HairSleep;
pub use spring::Springs;
pub use strand::{
    Burden, Hair, HairInertia, HeldNodes, Sleep, Sleepers, Strand, StrandError, StrandModel,
    StrandOf, Strands,
};
pub use style::{PermRod, Treat, Winding, WoundOn, WoundStrands};
pub use tick::{HairPlugins, HairStep, HairSubsteps, HairSystems, HairTick};
pub use water::{
    Climate, Droplet, DropletRules, Moisture, ProcessTime, Shower, Soak, WaterLedger, Wetting,
};

/// What most games need.
pub mod prelude {
    #[cfg(feature = "avian")]
    #[doc(hidden)]
    pub use crate::contact::AvianHairCollider;
    #[cfg(feature = "groom")]
    #[doc(hidden)]
    pub use crate::groom::{Groom, GroomGuides, GroomSettings, GroomedHair};
    #[cfg(feature = "save")]
    #[doc(hidden)]
    pub use crate::hairdo::{Hairdo, HairdoError};
    #[cfg(feature = "render")]
    #[doc(hidden)]
    pub use crate::render::{HairFollowers, HairLook, HairShading, HairView, Melanin};
    #[doc(hidden)]
    pub use crate::{
        AirDrag, Blower, BondInfluence, BondKind, Bonds, Climate, Cuticle, Droplet, Hair,
        HairCollider, HairDefault, HairFault, HairGravity, HairInertia, HairLod, HairPlugins,
        HairSleep, HairSubsteps, HairSystems, HairTick, HeldNodes, LockContact, Moisture, PermRod,
        ProcessTime, ScreenShare, Shower, Sleep, Soak, Solver, Stiffness, Strand, StrandModel,
        StrandOf, Strands, StretchProjection, Treat, WaterLedger, Wetting, Winding, WoundOn,
    };
}
