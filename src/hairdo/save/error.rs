//! Errors of saving, loading and applying hairdos.

use crate::{base::setting::InvalidValue, hair::worn::listed};
use bevy::prelude::*;

/// Why a [`Hairdo`](super::Hairdo) cannot be taken, read or put on. Whatever the error, the present
/// hair stays as it is.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
#[non_exhaustive]
pub enum HairdoError {
    /// The entity is not there or carries no [`Hair`](crate::Hair).
    #[error(
        "{entity} is not a Hair and wears none: name its wearer, or the entity that the strands point to with StrandOf"
    )]
    NoHair {
        /// What was named.
        entity: Entity,
    },
    /// The entity wears several hairs, such as a beard beside hair.
    #[error("{entity} wears {}: name one of them", listed(hairs))]
    SeveralHairs {
        /// What was named.
        entity: Entity,
        /// The hairs.
        hairs: Vec<Entity>,
    },
    /// The hair is simulated on the GPU.
    #[error(
        "{entity} is simulated on the GPU: request its hairdo by CaptureHairdo, answered by HairdoCaptured"
    )]
    OnGpu {
        /// The hair.
        entity: Entity,
    },
    /// The bytes do not begin with a hairdo's magic number.
    #[error("these bytes are not a hairdo: use bytes from Hairdo::to_bytes")]
    NotAHairdo,
    /// Written by a newer version of this crate.
    #[error("the hairdo has format {found}, expected {newest} at most: update bevy_keratin")]
    FutureVersion {
        /// The file's format.
        found: u16,
        /// The newest that can be read.
        newest: u16,
    },
    /// The end is missing.
    #[error("the hairdo has {found} bytes, expected {expected}: its end is missing, copy it again")]
    Truncated {
        /// How many bytes there are.
        found: u64,
        /// How many there should be, as far as known.
        expected: u64,
    },
    /// The bytes are not those that were written.
    #[error(
        "the hairdo's checksum is {found:08x}, expected {expected:08x}: it was damaged, copy it again"
    )]
    Checksum {
        /// The checksum of the bytes found.
        found: u32,
        /// The checksum in the file.
        expected: u32,
    },
    /// The checksum is right, but the content is not that of a hairdo: written by another program.
    #[error("byte {offset} of the hairdo: expected {expected}; write it with Hairdo::to_bytes")]
    Malformed {
        /// Where, from the file's beginning.
        offset: u64,
        /// What should be there.
        expected: &'static str,
    },
    /// A number that is not finite.
    #[error("{what} {at} of strand {strand} is not finite, expected a number: repair the source")]
    NonFinite {
        /// Which number.
        what: &'static str,
        /// The strand's index.
        strand: usize,
        /// The index from the root of node, edge or joint.
        at: usize,
    },
    /// A number out of its range.
    #[error("{what} {at} of strand {strand} is {found}, expected {expected}: repair the source")]
    OutOfRange {
        /// Which number, with its unit.
        what: &'static str,
        /// The strand's index.
        strand: usize,
        /// The index from the root of node, edge or joint.
        at: usize,
        /// What was found.
        found: f64,
        /// The allowed range.
        expected: &'static str,
    },
    /// A cuticle's wear that is not finite.
    #[error(
        "damage or softening of the hair's Cuticle is not finite, expected about 0.33: correct it"
    )]
    Cuticle,
    /// A strand with fewer than two nodes.
    #[error("strand {strand} has {found} nodes, expected 2 or more: despawn it")]
    TooFewNodes {
        /// The strand's index.
        strand: usize,
        /// How many nodes it has.
        found: usize,
    },
    /// The hairdo is of another groom: another number of strands.
    #[error(
        "the hairdo has {found} strands, expected {expected}: it is of another groom, \
         use Hairdo::apply_resampled"
    )]
    Strands {
        /// How many the hairdo has.
        found: usize,
        /// How many the hair has.
        expected: usize,
    },
    /// The hairdo is of another groom: another number of nodes.
    #[error(
        "strand {strand} of the hairdo has {found} nodes, expected {expected}: it is of another \
         groom, use Hairdo::apply_resampled"
    )]
    Nodes {
        /// The strand's index.
        strand: usize,
        /// How many nodes it has in the hairdo.
        found: usize,
        /// How many it has in the hair.
        expected: usize,
    },
    /// A hairdo without strands.
    #[error("the hairdo has no strands, expected one at least: take it from hair that has grown")]
    Bald,
    /// The hairdo was made on no preset, or on an unknown one.
    #[error(
        "the hairdo was made on no known preset: wear the hair that it was made on, and \
         set WearHair::hairdo"
    )]
    NoPreset,
    /// A number given to a function, or of a look or dye.
    #[error(transparent)]
    Value(#[from] InvalidValue),
}
