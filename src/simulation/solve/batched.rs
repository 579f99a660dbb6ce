//! The trait of kernels that solve strands in batches.

use crate::{
    base::lanes::LANES,
    hair::strand::{AddedMass, Held, Strand, StrandRank},
    solver::rod::block::BlockLanes,
};
use bevy::{math::Isometry3d, prelude::*};

/// The data that a lane is filled from.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) strand: &'a Strand,
    pub(super) added: &'a AddedMass,
    pub(super) held: Option<&'a Held<'a>>,
}

/// Edge state besides orientations that a method keeps between substeps.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kept {
    Nothing,
    AngularVelocities,
    Tensions,
}

/// A strand whose step comes out non-finite is stepped once more.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Attempt {
    First,
    /// With what a kernel can leave out to be more robust.
    Second,
}

/// A strand taken from its table for one kind of kernel, with the kernel's own columns.
pub(super) struct Member<'a, K> {
    pub(super) entity: Entity,
    pub(super) hair: Entity,
    pub(super) rank: StrandRank,
    pub(super) strand: &'a mut Strand,
    pub(super) added: &'a AddedMass,
    pub(super) held: Option<Held<'a>>,
    pub(super) own: K,
}

impl<K> Member<'_, K> {
    pub(super) fn source(&self) -> Source<'_> {
        Source { strand: self.strand, added: self.added, held: self.held.as_ref() }
    }
}

/// The columns of a kernel: rods or springs.
pub(super) trait Batched: Sized + Send {
    /// Parameters of a hair's strands in a substep.
    type Params;
    /// A block with the additional state of the kernel.
    type Lanes: Default + Send;

    /// Prefetches a strand.
    fn prefetch(member: &Member<'_, Self>) {
        member.strand.prefetch();
    }
    /// The shape it is rebuilt in when its state is lost: a Darboux vector for each joint.
    fn remembered(&self, _params: &Self::Params) -> Vec<Vec3> {
        Vec::new()
    }
    /// Edge state besides orientations that is written back.
    fn kept(_params: &Self::Params) -> Kept {
        Kept::Nothing
    }
    /// How points at rest in the world moved in the hair's frame, if they did.
    fn frame_delta(_params: &Self::Params) -> Option<Isometry3d> {
        None
    }
    /// Strain of an edge by whose size a strand with held nodes does not take a substep.
    fn most_strain(_params: &Self::Params) -> f32 {
        0.5
    }
    /// Strain of an edge by whose size a strand counts as jammed, where the solver keeps lengths far better otherwise: it
    /// then comes to its lengths.
    fn most_free_strain(_params: &Self::Params) -> Option<f32> {
        None
    }
    /// Whether a second attempt differs from the first.
    fn may_repeat(_params: &Self::Params) -> bool {
        false
    }
    /// How long the substep is (s).
    fn dt(params: &Self::Params) -> f32;
    /// The block's nodes and edges.
    fn block(lanes: &mut Self::Lanes) -> &mut BlockLanes;
    /// Advances a block with gathered nodes by a substep.
    fn step(
        lanes: &mut Self::Lanes,
        sources: &[Source<'_>; LANES],
        items: &[Member<'_, Self>],
        params: &Self::Params,
        attempt: Attempt,
    );
}
