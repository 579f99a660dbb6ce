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
mod pairs;
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
        /// How contact acts.
        pub method: ContactMethod = ContactMethod::Printed;
        /// The share of the radius within which strands are firm, with [`ContactMethod::Pairs`]: they do not pass
        /// each other, but for crowds that fall at once. 0 lets them.
        pub core: f32 = 0.35, in CORE: 0.0..=0.9, "a third keeps locks from passing each other";
        /// μ, the friction of strands on each other, with [`ContactMethod::Pairs`]. Of dry hair 0.15 to 0.3.
        pub friction: f32 = 0.2, in FRICTION: 0.0..=10.0, safe 0.0..=1.0, "0.2 is dry hair";
        /// What holds strands that touch besides what presses them together, with [`ContactMethod::Pairs`]: dry
        /// clean hair 0.2, wax 2 to 5, hairspray 5 to 20.
        pub cohesion: f32 = 0.2, "m/s²" in COHESION: 0.0..=1e3, safe 0.0..=20.0, "0.2 is clean hair";
    }
}

/// How strands push each other apart.
#[derive(Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Default, Clone, PartialEq)]
pub enum ContactMethod {
    /// Equation 18 as printed: nodes are pushed by edges, which are not pushed back.
    #[default]
    Printed,
    /// Equation 18 with edges that are pushed back, as presets have it. Contact then keeps momentum, and hair whose
    /// locks touch comes to rest: each pair counts by halves from both sides, neighbouring edges share what is near
    /// their common node, and in a step pairs give way by a 25th of their depth at most, however many touch. Where lists
    /// hold more than 256 edges a node in the mean, as with strands by the hundred in one place, contact is as printed.
    Mutual,
    /// Edges against edges, each pair by one impulse on both: strands that cross do not pass each other, friction holds
    /// them until what presses them together is too little, and how much is pressed does not depend on how finely
    /// strands are divided. Costs many times as much so far: for few strands.
    Pairs,
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
    #[reflect(ignore)]
    pairs: pairs::Pairs,
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
        self.pairs.record(tape);
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
        self.lists.touching().chain(self.pairs.touching())
    }

    /// How many pairs of node and edge are in the lists, rounded up to groups of eight for each node; or of edges,
    /// where contact is by pairs.
    pub fn pairs(&self) -> usize {
        self.lists.pairs() + self.pairs.counts()[0]
    }

    /// How many pairs of edges have pushed in the last substep.
    pub fn active_pairs(&self) -> usize {
        self.pairs.counts()[1]
    }
}
