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

/// Why a plane through a point with a normal is none.
pub(super) fn wrong_plane(point: Vec3, normal: Vec3) -> Option<String> {
    let is_plane = point.is_finite() && normal.is_finite() && normal != Vec3::ZERO;
    let expected = "expected finite numbers and a normal that is not zero";
    (!is_plane).then(|| format!("a plane through {point} with the normal {normal}, {expected}"))
}

impl StrandRegion {
    /// Why there is no such region.
    pub(super) fn wrong(&self) -> Option<String> {
        match *self {
            Self::All => None,
            Self::Above { point, normal } => wrong_plane(point, normal),
        }
    }

    /// Whether a strand with its root here belongs to it.
    pub fn contains(&self, root: Vec3) -> bool {
        match self {
            Self::All => true,
            Self::Above { point, normal } => (root - *point).dot(*normal) > 0.0,
        }
    }
}
