#![doc = include_str!("../README.md")]
#![cfg_attr(docsrs, feature(doc_cfg))]
#![forbid(unsafe_code)]

pub mod air;
pub mod bond;
pub mod contact;
pub mod fault;
pub mod grid;
mod parallel;
#[cfg(feature = "render")]
pub mod render;
pub mod rod;
pub mod setting;
pub mod strand;
pub mod style;
pub mod tick;

pub use air::{AirDrag, Blower, HairGravity, WindReceived};
pub use bond::{BondChanges, BondInfluence, BondKind, Bonds, Cuticle};
pub use contact::{ColliderShape, HairCollider, LockContact};
pub use fault::{Fault, HairFault};
pub use rod::{Solver, Stiffness, StretchProjection};
pub use setting::{HairDefault, InvalidValue};
pub use strand::{Hair, HeldNodes, Strand, StrandError, StrandOf, Strands};
pub use style::{PermRod, Treat, Winding, WoundOn, WoundStrands};
pub use tick::{HairPlugins, HairStep, HairSubsteps, HairSystems, HairTick};

/// What most games need.
pub mod prelude {
    #[cfg(feature = "render")]
    #[doc(hidden)]
    pub use crate::render::{HairFollowers, HairLook, HairShading, HairView, Melanin};
    #[doc(hidden)]
    pub use crate::{
        AirDrag, Blower, BondInfluence, BondKind, Bonds, Cuticle, Hair, HairCollider, HairDefault,
        HairFault, HairGravity, HairPlugins, HairSubsteps, HairSystems, HairTick, HeldNodes,
        LockContact, PermRod, Solver, Stiffness, Strand, StrandOf, Strands, StretchProjection,
        Treat, Winding, WoundOn,
    };
}
