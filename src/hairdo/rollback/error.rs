//! Why hair cannot be taken or put back.

use crate::hair::worn::listed;
use bevy::prelude::*;

/// Why a snapshot cannot be taken, read or put back. Whatever the error, the present hair stays as it is.
#[derive(thiserror::Error, Reflect, Clone, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
#[non_exhaustive]
pub enum SnapshotError {
    /// The entity is not there or carries no [`Hair`](crate::Hair).
    #[error(
        "{entity} is not a Hair and wears none: name its wearer, or the entity that the strands point to with StrandOf"
    )]
    NoHair {
        /// What was named.
        entity: Entity,
    },
    /// The entity wears several hairs, such as a beard beside hair.
    #[error("{entity} wears {}: take a snapshot of each", listed(hairs))]
    SeveralHairs {
        /// What was named.
        entity: Entity,
        /// The hairs.
        hairs: Vec<Entity>,
    },
    /// The hair is simulated on the GPU.
    #[error(
        "{entity} is simulated on the GPU, whose state comes some frames later: hair that is rolled back stays on the \
         processor: give it SimulateOn::Cpu"
    )]
    OnGpu {
        /// The hair.
        entity: Entity,
    },
    /// The hair has just been put on.
    #[error("{entity} still settles: it can be rolled back once its Settling is removed")]
    Settles {
        /// The hair.
        entity: Entity,
    },
    /// Its level of detail simulates some strands, and others follow.
    #[error(
        "strands of {entity} follow others at its level of detail: hair that is rolled back has none, without HairLod"
    )]
    Follows {
        /// The hair.
        entity: Entity,
    },
    /// Hair ticks at the end of the frame, and ticks of this frame have yet to run.
    #[error(
        "{ticks} ticks of hair wait for the end of the frame: HairPlugins::new(FixedPostUpdate), or the schedule of the \
         rollback, runs each at once"
    )]
    TicksWait {
        /// How many.
        ticks: usize,
    },
    /// The hair has another number of strands.
    #[error(
        "the snapshot is of {found} strands, the hair has {expected}: hair that is another begins with new snapshots"
    )]
    Strands {
        /// Those of the snapshot.
        found: usize,
        /// Those of the hair.
        expected: usize,
    },
    /// A strand has another number of nodes.
    #[error(
        "strand {strand} of the snapshot has {found} nodes, that of the hair {expected}: hair that is another begins \
         with new snapshots"
    )]
    Nodes {
        /// Its index.
        strand: usize,
        /// Those of the snapshot.
        found: usize,
        /// Those of the hair.
        expected: usize,
    },
    /// A strand ends where it did not.
    #[error(
        "strand {strand} was cut, or has grown back, since the snapshot: hair that is cut begins with new snapshots"
    )]
    Cut {
        /// Its index.
        strand: usize,
    },
    /// The bytes do not begin as a snapshot of this kind and version does.
    #[error(
        "these bytes are not a snapshot of this kind, or one of another version of bevy_keratin"
    )]
    NotASnapshot,
    /// The bytes are not those that were written.
    #[error("the snapshot is damaged or its end is missing: send it again")]
    Damaged,
}
