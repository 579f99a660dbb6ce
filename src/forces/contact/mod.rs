//! Contact of hair with colliders and between strands.

#[cfg(feature = "avian")]
mod avian;
mod bake;
mod coarse;
mod collider;
mod hat;
mod lanes;
pub mod model;
mod neighbours;
mod reach;
mod systems;

pub use crate::solver::rod::shape::{ConvexHull, DistanceGrid};
#[cfg(feature = "avian")]
pub use avian::{AvianHairCollider, AvianShapeError};
pub use bake::{Bake, BakeError, HullError, Openings};
pub use collider::{ColliderShape, HairCollider};
pub use systems::ContactPlugin;
pub(crate) use {
    lanes::WetRow,
    model::{Bridged, Film},
    reach::{Ball, Colliders, HairReach},
    systems::{TickCollider, TickColliders, seen_from},
};

use crate::{
    base::{setting::setting, tape::Tape},
    solver::rod::obstacle::Obstacle,
};
use bevy::prelude::*;

setting! {
    /// How strands keep apart: equation 18 of \[B\]. Component of a [`Hair`](crate::Hair); where absent,
    /// [`HairDefault<StrandContact>`](crate::HairDefault) holds.
    ///
    /// A simulated strand stands for a lock of hair, so the radius is the lock's.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct StrandContact {
        /// r, the radius of a strand; also the distance kept from colliders. 0 turns contact between
        /// strands off.
        pub radius: f32 = 1e-3, "m" in RADIUS: 0.0..=1.0, safe 0.0..=0.01, "1e-3 is a thin lock";
        /// α, the acceleration of strands whose axes coincide. Stable up to about 8 r/Δt²; 0 turns
        /// contact between strands off.
        pub strength: f32 = 20.0, "m/s²" in STRENGTH: 0.0..=1e6, safe 0.0..=1e3,
            "20 parts locks gently";
        /// Whether an edge that pushes a node is pushed back, as presets have it. Contact then keeps momentum, and
        /// hair whose locks touch comes to rest: each pair counts by halves from both sides, neighbouring edges
        /// share what is near their common node, and in a step pairs give way by a 25th of their depth at
        /// most, however many touch. Default `false`, equation 18 as printed, which has none of these. Where lists
        /// hold more than 256 edges a node in the mean, as with strands by the hundred in one place, contact
        /// is as printed.
        pub mutual: bool = false;
    }
}

/// The colliders near one hair in this substep, in its frame. Written by `Interaction`, read by
/// `Projection`.
#[doc(hidden)]
#[derive(Component, Reflect, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[reflect(Default, Clone)]
pub struct Obstacles {
    /// The solids.
    #[reflect(ignore)]
    pub solids: Vec<Obstacle>,
    /// The colliders that it may touch in this tick, by their indices.
    #[reflect(ignore)]
    near: Vec<u32>,
    /// The hats that hold it.
    #[reflect(ignore)]
    hats: Vec<hat::WornHat>,
}

impl Obstacles {
    /// Whether this collider is a hat that holds the hair.
    pub(crate) fn is_held_by(&self, collider: Entity) -> bool {
        self.hats.iter().any(|hat| hat.id == collider)
    }

    /// Whether this collider is a hat that holds the hair and has come down on it.
    pub(crate) fn are_under(&self, collider: Entity) -> bool {
        self.hats.iter().any(|hat| hat.id == collider && hat.is_down())
    }

    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        hat::WornHat::record(&mut self.hats, tape);
    }
}

/// The pairs of strands of one hair that may touch.
#[doc(hidden)]
#[derive(Component, Reflect, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[reflect(Default, Clone)]
pub struct LockNeighbours {
    #[reflect(ignore)]
    lists: neighbours::Neighbours,
    /// The strands that take part in this tick, and whether followers are among them.
    #[reflect(ignore)]
    members: (Vec<Entity>, bool),
    /// Whether strands with too many nodes, and too many of them in one place, have been reported.
    #[reflect(ignore)]
    reported: (bool, bool),
}

impl Film {
    /// Parameters of the bridges between strands that touch at a distance of axes of `reach` (m),
    /// limited to the length that the neighbour lists cover.
    pub(crate) fn between(reach: f32) -> Self {
        Self { reach, longest: neighbours::LONGEST_BRIDGE * reach }
    }
}

impl LockNeighbours {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        self.lists.record(tape);
    }

    /// The number of nodes of the lists.
    pub(crate) fn nodes(&self) -> usize {
        self.lists.nodes()
    }

    /// From their next rebuild on, lists cover bridges of water this long (m).
    pub(crate) fn set_extra_margin(&mut self, longest: f32) {
        self.lists.set_extra_margin(longest);
    }

    /// The bridges of water at every node, at the positions of the last contact search. `wet` has a row
    /// for each node, in the order of the hair's strands. Which edges are joined is looked for `again` once a
    /// tick.
    pub(crate) fn bridges(
        &mut self,
        wet: &mut Vec<WetRow>,
        film: Film,
        again: bool,
    ) -> impl Iterator<Item = Bridged> {
        self.lists.bridges(wet, film, again)
    }

    /// Nodes and the nearest points of edges of other strands that they touch (m), at the last contact
    /// search.
    #[cfg(feature = "debug")]
    pub(crate) fn touching(&self) -> impl Iterator<Item = (Vec3, Vec3)> {
        self.lists.touching()
    }

    /// How many pairs of node and edge are in the lists, rounded up to groups of eight for each node.
    pub fn pairs(&self) -> usize {
        self.lists.pairs()
    }
}
