//! What is simulated, and when: [`solve`] steps strands, [`lod`] chooses how many, [`sleep`] skips those at
//! rest, [`settle`] simulates new hair ahead.

pub mod lod;
pub mod settle;
pub mod sleep;
pub mod solve;

/// The room's share of [the prelude](crate::prelude).
pub mod prelude {
    pub use crate::simulation::lod::{
        HairBudget, HairEstimate, HairLod, HairScreenShare, LodLevel, PresentLod,
    };
    pub use crate::simulation::settle::{SettleSettings, Settling};
    pub use crate::simulation::sleep::SleepSettings;
}
