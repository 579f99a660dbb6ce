//! `Projection`: gathers strands from their tables into lanes, runs their kernel, and scatters back.
//!
//! The only module that handles both entities and lanes. Strands keep their own vectors, so that
//! game code reads and writes them; those of a hair with equal node count are gathered into a block
//! of [`LANES`](crate::base::lanes::LANES), stepped side by side and scattered back in each substep.
//!
//! | file | what |
//! |---|---|
//! | `batched` | the trait of kernels |
//! | `batch` | which strands are solved side by side, on all threads |
//! | `gather` | strands' arrays into lanes and back; strands that became non-finite |
//! | `rods` | Cosserat rods ([`rod`](crate::solver::rod)) |
//! | `substeps` | how many of the tick's substeps a hair takes as one |
//! | `springs` | masses and springs ([`mass_spring`](crate::solver::mass_spring)) |

mod batch;
mod batched;
mod gather;
mod rods;
mod springs;
mod substeps;

pub use rods::RodPlugin;
#[cfg(feature = "gpu")]
pub(crate) use rods::{MOST_STRAIN, MOST_SWEPT_STRAIN};
pub use springs::SpringPlugin;
