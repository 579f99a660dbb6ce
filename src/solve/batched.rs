//! What a kernel offers so that strands can be solved in batches.

use crate::{
    lanes::LANES,
    rod::block::BlockLanes,
    strand::{AddedMass, HeldNodes, Strand},
};
use bevy::prelude::*;

/// What a lane is filled from.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) strand: &'a Strand,
    pub(super) added: &'a AddedMass,
    pub(super) held: Option<&'a HeldNodes>,
}

/// What a method keeps of edges from substep to substep, beside orientations.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(super) enum Kept {
    Nothing,
    AngularVelocities,
    Tensions,
}

/// A strand as it is taken from its table, of one kind of kernel: rods or springs.
pub(super) trait Batched: Sized + Send {
    /// What holds for a hair's strands in a substep.
    type Params;
    /// A block with what else the kernel needs.
    type Lanes: Default;

    /// The strand.
    fn entity(&self) -> Entity;
    /// Its hair.
    fn hair(&self) -> Entity;
    /// What its lane is filled from.
    fn source(&self) -> Source<'_>;
    /// Its state, to be written.
    fn strand_mut(&mut self) -> &mut Strand;
    /// Asks for its memory.
    fn prefetch(&self) {
        self.source().strand.prefetch();
    }
    /// The shape it is rebuilt in when its state is lost: a Darboux vector for each joint.
    fn remembered(&self, _params: &Self::Params) -> Vec<Vec3> {
        Vec::new()
    }
    /// What of edges goes back into strands, beside orientations.
    fn kept(_params: &Self::Params) -> Kept {
        Kept::Nothing
    }
    /// How long the substep is (s).
    fn dt(params: &Self::Params) -> f32;
    /// The block's nodes and edges.
    fn block(lanes: &mut Self::Lanes) -> &mut BlockLanes;
    /// Takes a block, whose nodes are gathered, through a substep.
    fn step(
        lanes: &mut Self::Lanes,
        sources: &[Source<'_>; LANES],
        items: &[Self],
        params: &Self::Params,
    );
}
