//! Baking: convex hulls of points, and grids of signed distances of triangles.

mod error;
mod grid;
mod hull;

pub use error::{BakeError, HullError};
pub use grid::{Bake, Openings};
