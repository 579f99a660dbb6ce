//! Mathematics without hair: SIMD lanes and uniform grids.

pub mod grid;
#[doc(hidden)]
pub mod lanes;
