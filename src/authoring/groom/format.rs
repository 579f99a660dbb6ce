//! The file formats that grooms come in.

use super::{GroomFileError, foreign, gltf, salon};
use bevy::prelude::*;

/// The kinds of files that a groom is read from.
#[derive(Reflect, Clone, Copy, Debug, PartialEq, Eq, Hash)]
#[reflect(Clone, PartialEq)]
pub enum GroomFormat {
    /// Cem Yuksel's HAIR.
    Yuksel,
    /// TressFX, version 3.
    TressFx3,
    /// TressFX, version 4.
    TressFx4,
    /// glTF or GLB.
    Gltf,
    /// Alembic, in an Ogawa container.
    Alembic,
    /// PLY with strands.
    Ply,
    /// USC-HairSalon's strands.
    Salon,
}

impl GroomFormat {
    /// The format of a file by its first bytes, independent of its name.
    ///
    /// ```
    /// # use bevy_keratin::authoring::groom::GroomFormat;
    /// assert_eq!(GroomFormat::of(b"HAIR"), Ok(GroomFormat::Yuksel));
    /// let error = GroomFormat::of(b"version https://git-lfs.github.com/spec/v1\n").unwrap_err();
    /// assert!(error.to_string().contains("git lfs pull"));
    /// ```
    ///
    /// # Errors
    /// For other formats: with what the file is, if that is known, and what to do.
    pub fn of(file: &[u8]) -> Result<Self, GroomFileError> {
        let version = file.first_chunk().map_or(0.0, |bytes| f32::from_le_bytes(*bytes));
        match file {
            [b'H', b'A', b'I', b'R', ..] => Ok(Self::Yuksel),
            [b'g', b'l', b'T', b'F', ..] => Ok(Self::Gltf),
            [b'p', b'l', b'y', b'\n' | b'\r', ..] => Ok(Self::Ply),
            [b'O', b'g', b'a', b'w', b'a', ..] => Ok(Self::Alembic),
            _ if (3.0..4.0).contains(&version) => Ok(Self::TressFx3),
            _ if (4.0..5.0).contains(&version) => Ok(Self::TressFx4),
            text if gltf::looks_like_json(text) => Ok(Self::Gltf),
            other if foreign::is_unknown(other) && salon::looks_like(other) => Ok(Self::Salon),
            other => {
                let (found, hint) = foreign::described(other);
                Err(GroomFileError::Foreign { found, hint })
            }
        }
    }

    /// Metres per unit in the format's own samples: tenths of an inch, centimetres, metres; of Alembic
    /// that of Blender's files, metres. Only glTF specifies its unit;
    /// [`Groom::odd_size`](super::Groom::odd_size) detects implausible sizes.
    pub fn scale(self) -> f32 {
        match self {
            Self::Yuksel => 0.00254,
            Self::TressFx3 => 0.01,
            Self::TressFx4 | Self::Gltf | Self::Alembic | Self::Ply | Self::Salon => 1.0,
        }
    }

    /// The axis that is up in most files of this format; glTF specifies it.
    pub fn up(self) -> UpAxis {
        match self {
            Self::Yuksel => UpAxis::Z,
            _ => UpAxis::Y,
        }
    }
}

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
