//! Why something cannot be a [`GroomCache`](super::GroomCache).

use crate::authoring::groom::{GroomError, GroomFileError};

/// Why frames cannot be a [`GroomCache`](super::GroomCache).
#[derive(thiserror::Error, Clone, Debug, PartialEq)]
pub enum GroomCacheError {
    /// No frame at all.
    #[error("the cache has no frame, expected 1 or more: record for a tick at least")]
    Empty,
    /// A frame whose strands or nodes are not those of the others.
    #[error(
        "frame {frame} has {found} {what}, expected {expected}: curves that come, go or change their points cannot be \
         played; export them with the same points in each frame"
    )]
    Differs {
        /// Its index.
        frame: usize,
        /// Strands, or nodes.
        what: &'static str,
        /// How many it has.
        found: usize,
        /// How many the groom has.
        expected: usize,
    },
    /// Times that do not ascend.
    #[error(
        "frame {frame} is at {found} s, expected a finite time after {before} s: sort the frames"
    )]
    Time {
        /// Its index.
        frame: usize,
        /// Its time.
        found: f32,
        /// That of the frame before.
        before: f32,
    },
    /// A node that is not finite, or farther than 10⁹ m away.
    #[error(
        "node {node} of frame {frame} is not finite or farther than 1e9 m away: repair the source"
    )]
    NonFinite {
        /// The frame's index.
        frame: usize,
        /// The node's index among all of the groom.
        node: usize,
    },
    /// More frames than memory should hold.
    #[error(
        "the cache has {frames} frames of {nodes} nodes, expected at most {most} MB of 12 bytes a node: record or export \
         fewer strands or frames; of hair that only moves as a whole export one frame, and move its entity"
    )]
    TooLarge {
        /// How many frames it has.
        frames: usize,
        /// How many nodes a frame has.
        nodes: usize,
        /// How many megabytes it may take.
        most: usize,
    },
    /// An entity that is not being recorded.
    #[error(
        "the hair is not being recorded, expected RecordGroomCache and a tick since: insert it first"
    )]
    NotRecorded,
    /// Its strands are no groom.
    #[error(transparent)]
    Groom(#[from] GroomError),
    /// Its file cannot be read.
    #[error(transparent)]
    File(#[from] GroomFileError),
}
