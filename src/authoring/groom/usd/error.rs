//! Errors of USD files.

use crate::authoring::groom::GroomFileError;

pub fn wrong(
    place: impl Into<String>,
    found: impl ToString,
    expected: impl ToString,
    hint: &'static str,
) -> GroomFileError {
    let (found, expected) = (found.to_string(), expected.to_string());
    GroomFileError::Usd { place: place.into(), found, expected, hint }
}

pub fn failed(message: String) -> GroomFileError {
    GroomFileError::UsdLibrary { message: message.chars().take(300).collect() }
}
