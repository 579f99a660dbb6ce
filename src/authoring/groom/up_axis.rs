//! Which way is up in a file.

use bevy::prelude::*;

/// The axis of a file that points up.
#[derive(
    Reflect, Clone, Copy, Debug, Default, PartialEq, Eq, Hash, serde::Serialize, serde::Deserialize,
)]
#[reflect(Default, Clone, PartialEq)]
pub enum UpAxis {
    /// +X, which becomes +Y; Z stays.
    X,
    /// +Y, as Bevy has it.
    #[default]
    Y,
    /// +Z, which becomes +Y; X stays, and −Y becomes +Z. Blender's axes.
    Z,
    /// −X.
    NegX,
    /// −Y: turned around Z.
    NegY,
    /// −Z, which becomes +Y; X stays.
    NegZ,
}

impl UpAxis {
    /// All six.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::NegX, Self::NegY, Self::NegZ];

    /// The axis in the file.
    pub fn direction(self) -> Vec3 {
        match self {
            Self::X => Vec3::X,
            Self::Y => Vec3::Y,
            Self::Z => Vec3::Z,
            Self::NegX => Vec3::NEG_X,
            Self::NegY => Vec3::NEG_Y,
            Self::NegZ => Vec3::NEG_Z,
        }
    }

    /// A vector of a space with this axis up, in Bevy's.
    pub fn to_y_up(self, v: Vec3) -> Vec3 {
        match self {
            Self::X => Vec3::new(-v.y, v.x, v.z),
            Self::Y => v,
            Self::Z => Vec3::new(v.x, v.z, -v.y),
            Self::NegX => Vec3::new(v.y, -v.x, v.z),
            Self::NegY => Vec3::new(-v.x, -v.y, v.z),
            Self::NegZ => Vec3::new(v.x, -v.z, v.y),
        }
    }
}
