//! What hair remembers: [`bond`]s of keratin, and the [`treatment`]s that break and re-form them.

pub mod bond;
pub mod treatment;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::keratin::bond::{
        BondChanges, BondInfluence, BondKind, Bonds, Cuticle, JointBonds,
    };
    pub use crate::keratin::treatment::{
        HairTreatment, PermRod, PermWinding, WoundOn, WoundStrands,
    };
}
