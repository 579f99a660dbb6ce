//! Numbers from untrusted bytes: every read is checked, and nothing is allocated before it is known
//! that the bytes for it are there.

use super::GroomError;

/// Why a file cannot be read as a groom: where, what was expected, what was found and how to fix it.
#[derive(thiserror::Error, Clone, Debug, PartialEq)]
pub enum GroomFileError {
    /// The file ends before something that it should hold.
    #[error(
        "byte {offset}: expected {expected} bytes of {what}, found {found} up to the end: the file \
         is cut short or its counts are wrong, fetch or export it again"
    )]
    Truncated {
        /// Where it should begin.
        offset: u64,
        /// What it is.
        what: &'static str,
        /// How many bytes it takes; [`u64::MAX`] where no file could hold it.
        expected: u64,
        /// How many are left.
        found: u64,
    },
    /// A value that the format does not allow, or that contradicts the others.
    #[error("byte {offset}: {what} is {found}, expected {expected}: {hint}")]
    Value {
        /// Where it is.
        offset: u64,
        /// Its name.
        what: &'static str,
        /// What is there.
        found: String,
        /// What may be there.
        expected: String,
        /// How to fix it.
        hint: &'static str,
    },
    /// A file of another kind.
    #[error(
        "byte 0: found {found}, expected the beginning of a groom (HAIR, glTF, JSON, Ogawa, USD, ply or \
         a TressFX version of 3 or 4): {hint}"
    )]
    Foreign {
        /// What it is.
        found: String,
        /// What to do.
        hint: &'static str,
    },
    /// glTF whose JSON cannot be understood.
    #[error("byte {offset}: the JSON is wrong, expected glTF 2.0: {message}; export it again")]
    Json {
        /// Where reading stopped.
        offset: u64,
        /// What is wrong with it.
        message: String,
    },
    /// Something in a glTF file that its JSON describes wrongly.
    #[error("{place}: found {found}, expected {expected}: {hint}")]
    Gltf {
        /// Path in the JSON, with the byte in the buffer where there is one.
        place: String,
        /// What is there.
        found: String,
        /// What may be there.
        expected: String,
        /// How to fix it.
        hint: &'static str,
    },
    /// A USD file, where the crate was built without the feature `usd`.
    #[error(
        "byte 0: found a USD file, expected one that this build reads: turn on the feature `usd` of \
         bevy_keratin, or export the hair as Alembic (.abc)"
    )]
    UsdIsOff,
    /// Something in a USD file that cannot be, or that contradicts the rest.
    #[error("{place}: found {found}, expected {expected}: {hint}")]
    Usd {
        /// Path of the prim and its attribute.
        place: String,
        /// What is there.
        found: String,
        /// What may be there.
        expected: String,
        /// How to fix it.
        hint: &'static str,
    },
    /// A USD file that the library cannot read.
    #[error(
        "the USD library failed: {message}; expected a whole file: export it again, as .usdc, or flatten \
         it by usdcat --flatten"
    )]
    UsdLibrary {
        /// What the library says.
        message: String,
    },
    /// A `.tfxbone` that cannot be read; a byte is one of it.
    #[error("the .tfxbone, {0}; GroomSettings::bones can do without it")]
    Bones(Box<GroomFileError>),
    /// The data read are no valid groom.
    #[error(transparent)]
    Groom(#[from] GroomError),
}

/// A file's bytes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Bytes<'a>(pub(super) &'a [u8]);

impl<'a> Bytes<'a> {
    pub(super) fn len(&self) -> u64 {
        self.0.len() as u64
    }

    /// `count` elements of `size` bytes.
    pub(super) fn array(
        &self,
        offset: u64,
        count: u64,
        size: u64,
        what: &'static str,
    ) -> Result<&'a [u8], GroomFileError> {
        let found = self.len().saturating_sub(offset);
        let expected = count.saturating_mul(size);
        let short = GroomFileError::Truncated { offset, what, expected, found };
        let end = offset.checked_add(expected).ok_or_else(|| short.clone())?;
        let range = usize::try_from(offset).ok().zip(usize::try_from(end).ok());
        range.and_then(|(from, to)| self.0.get(from..to)).ok_or(short)
    }

    pub(super) fn u32(&self, offset: u64, what: &'static str) -> Result<u32, GroomFileError> {
        let bytes = self.array(offset, 1, 4, what)?;
        Ok(words(bytes).next().unwrap_or_default())
    }

    pub(super) fn f32(&self, offset: u64, what: &'static str) -> Result<f32, GroomFileError> {
        self.u32(offset, what).map(f32::from_bits)
    }

    /// `count` groups of N numbers, each made into a `T`; they may be anything.
    pub(super) fn groups<T, const N: usize>(
        &self,
        offset: u64,
        count: u64,
        what: &'static str,
        make: impl FnMut([f32; N]) -> T,
    ) -> Result<Vec<T>, GroomFileError> {
        let bytes = self.array(offset, count, 4 * N as u64, what)?;
        let (words, _) = bytes.as_chunks::<4>();
        let (groups, _) = words.as_chunks::<N>();
        Ok(groups.iter().map(|group| group.map(f32::from_le_bytes)).map(make).collect())
    }
}

/// An error for a count of strands, which is at `offset`, of 0.
pub(super) fn some_strands(offset: u64, count: u64) -> Result<(), GroomFileError> {
    match count {
        0 => value(offset, "the count of strands", 0, "1 or more", "export hair that has strands"),
        _ => Ok(()),
    }
}

pub(super) fn words(bytes: &[u8]) -> impl Iterator<Item = u32> {
    bytes.as_chunks().0.iter().map(|word| u32::from_le_bytes(*word))
}

pub(super) fn value<T>(
    offset: u64,
    what: &'static str,
    found: impl ToString,
    expected: impl ToString,
    hint: &'static str,
) -> Result<T, GroomFileError> {
    let (found, expected) = (found.to_string(), expected.to_string());
    Err(GroomFileError::Value { offset, what, found, expected, hint })
}
