//! The order of a hair's strands, whatever tables they lie in.

use bevy::prelude::*;

/// A strand's number among those of its hair: by node count, and of equal ones in the order of
/// [`Strands`](super::Strands). What sums over strands or solves them side by side goes by it: the order of rows changes
/// with what else lives in the world.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct StrandRank(pub(crate) u32);
