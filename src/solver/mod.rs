//! The pure solvers of strands: functions over slices, without entities.
//!
//! [`rod`] solves Cosserat rods, the hair of \[B\]; [`mass_spring`] the strands of \[W\].

pub mod mass_spring;
pub mod rod;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::solver::mass_spring::Springs;
    pub use crate::solver::rod::{
        HairSolver, HairStiffness, SolverMethod, StrandMaterial, StretchProjection, Sweeps,
    };
}
