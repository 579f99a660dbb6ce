//! SIMD lanes: the scalar type of all kernels, vectors and quaternions over it, and transposing
//! strands' arrays into lanes and back.
//!
//! Mathematics is written once, generic over [`Real`], and runs on one `f64` as on sixteen lanes.

mod algebra;
mod dispatch;
mod memory;
mod real;
mod transpose;

pub use algebra::{Quaternion, V3};
pub(crate) use algebra::{splat, splat3};
#[cfg(test)]
pub(crate) use dispatch::simd_levels;
#[cfg(target_arch = "x86_64")]
pub(crate) use dispatch::with_token;
pub(crate) use dispatch::{dispatch, inlined, simd_level};
pub use memory::{Lane, put3, put4, take3, take4};
pub(crate) use memory::{load, load3, load4, store3, store4};
pub(crate) use real::lanes_in;
pub use real::{LANES, Real};
pub(crate) use transpose::*;
