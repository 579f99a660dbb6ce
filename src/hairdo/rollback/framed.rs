//! Snapshots as bytes: what they are, a hash, the state.

use super::error::SnapshotError;
use crate::base::tape::hash;

/// What bytes of a snapshot begin with; the last one is the format.
pub(super) const HAIR: [u8; 8] = *b"\x8bhair\n\x01\0";
pub(super) const WORLD: [u8; 8] = *b"\x8bhairw\n\x01";

/// A snapshot's state as bytes that tell what they are and whether they are whole.
pub(super) fn framed(magic: [u8; 8], state: &[u8]) -> Vec<u8> {
    [&magic, &hash(state).to_le_bytes(), state].concat()
}

/// The state in such bytes.
pub(super) fn unframed(magic: [u8; 8], bytes: &[u8]) -> Result<&[u8], SnapshotError> {
    let state = bytes.strip_prefix(&magic).ok_or(SnapshotError::NotASnapshot)?;
    let (own, state) = state.split_first_chunk().ok_or(SnapshotError::Damaged)?;
    (u64::from_le_bytes(*own) == hash(state)).then_some(state).ok_or(SnapshotError::Damaged)
}
