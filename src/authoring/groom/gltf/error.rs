//! Errors of glTF files.

use crate::authoring::groom::GroomFileError;

pub(super) fn wrong<T>(
    place: &str,
    found: impl Into<String>,
    expected: impl Into<String>,
    hint: &'static str,
) -> Result<T, GroomFileError> {
    let (found, expected) = (found.into(), expected.into());
    Err(GroomFileError::Gltf { place: place.to_owned(), found, expected, hint })
}

pub(super) fn missing<T>(place: &str) -> Result<T, GroomFileError> {
    wrong(place, "nothing", "what the file refers to", "export the file again")
}
