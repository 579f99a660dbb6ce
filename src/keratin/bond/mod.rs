//! Side-chain bonds, which let hair remember its shape.
//!
//! Every joint carries four kinds of bonds. Each has a shape it remembers and a rate, the share of
//! its bonds that are closed. Water, lotions, heat and wind move the rates; bonds that re-form
//! remember the shape of that moment ([`JointBonds::change`], equation 16); the rest shape the rod
//! springs back to is their weighted mean ([`JointBonds::rest_shape`], equation 15).
//!
//! The equations are in [`model`]. Only `BondUpdate` changes rates: other systems add requests to
//! [`BondChanges`], game code sends [`HairTreatment`](crate::keratin::treatment::HairTreatment).

mod bonds;
mod command;
mod kind;
mod lanes;
pub mod model;
mod rest;
mod settings;
mod systems;

pub use bonds::{BondChanges, Bonds};
pub use kind::BondKind;
pub use model::JointBonds;
pub use rest::RestShape;
pub use settings::{BondInfluence, Cuticle};
pub use systems::BondPlugin;
