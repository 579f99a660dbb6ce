//! The file formats that grooms come in.

use super::{GroomFileError, UpAxis, foreign, gltf, salon};
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
    /// USD: text, binary, or a package. Read with the feature `usd`.
    Usd,
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
            _ if foreign::is_usd(file) => Ok(Self::Usd),
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
    /// that of Blender's files, metres. Only glTF specifies its unit, and USD, which takes centimetres where the file
    /// does not say one; [`Groom::odd_size`](super::Groom::odd_size) detects implausible sizes.
    pub fn scale(self) -> f32 {
        match self {
            Self::Yuksel => 0.00254,
            Self::TressFx3 | Self::Usd => 0.01,
            Self::TressFx4 | Self::Gltf | Self::Alembic | Self::Ply | Self::Salon => 1.0,
        }
    }

    /// The axis that is up in most files of this format; glTF specifies it, and a USD file may say another.
    pub fn up(self) -> UpAxis {
        match self {
            Self::Yuksel => UpAxis::Z,
            _ => UpAxis::Y,
        }
    }
}
