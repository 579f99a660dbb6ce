//! Which strands of a hair a tie or a cut acts on.

use bevy::prelude::*;

/// Strands of a hair, by their roots.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Default, Clone, PartialEq)]
pub enum StrandRegion {
    /// All.
    #[default]
    All,
    /// Those whose root is on the side of a plane that its normal points to: above it for half-up hair, beside it
    /// for pigtails.
    Above {
        /// A point of the plane (m, in the hair's frame).
        point: Vec3,
        /// Its normal, of any length.
        normal: Vec3,
    },
}

impl StrandRegion {
    /// Whether a strand with its root here belongs to it.
    pub fn contains(&self, root: Vec3) -> bool {
        match self {
            Self::All => true,
            Self::Above { point, normal } => (root - *point).dot(*normal) > 0.0,
        }
    }
}
