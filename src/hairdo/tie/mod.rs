//! Hair ties: rings that hold strands together, as a ponytail's.
//!
//! A [`HairTie`] is an entity with a transform, as a child of the head's bone. [`TieHair`] on a hair gathers its
//! strands, or some of them: each is led round the head to its place in the ring within
//! [`HairTie::seconds`], so that it lies taut between its root and the ring, and is held there. [`HairTied`] on the
//! hair tells how many are, and how many were too short. What leaves the ring is free. A
//! [`Hairdo`](crate::Hairdo) keeps ties. Removing [`Tied`] from a strand, despawning the tie or removing its
//! [`HairTie`] lets go.

mod model;
mod systems;

pub use systems::TiePlugin;

use super::region::StrandRegion;
use crate::{
    base::{
        setting::{InvalidValue, Ranged, setting},
        tape::Tape,
    },
    hair::strand::{HeldNodes, TickPose},
};
use bevy::prelude::*;

setting! {
    /// A ring that holds strands: an elastic, a scrunchie, a ribbon. Its axis is Y of its transform, along which hair
    /// leaves it.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// /// A ponytail behind the head, which looks along −Z.
    /// fn ponytail(mut commands: Commands, hair: Entity) {
    ///     let behind = Transform::from_xyz(0.0, 0.05, 0.12)
    ///         .with_rotation(Quat::from_rotation_arc(Vec3::Y, Vec3::new(0.0, 0.4, 0.9).normalize()));
    ///     let tie = commands.spawn((HairTie::default(), behind, ChildOf(hair))).id();
    ///     commands.trigger(TieHair::all(hair, tie));
    /// }
    /// ```
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    #[require(Transform, TickPose)]
    pub struct HairTie {
        /// Radius of what it holds. A hundred thousand hairs of 70 µm, packed to 0.75, take 12.8 mm.
        pub radius: f32 = 0.0128, "m" in RADIUS: 1e-4..=10.0, safe 0.003..=0.03, "0.0128 holds a full head";
        /// Time that gathering takes; 0 gathers at once.
        pub seconds: f32 = 0.6, "s" in SECONDS: 0.0..=1e6, safe 0.2..=10.0, "0.6 is a quick hand";
    }
}

impl HairTie {
    /// A tie of this radius (m).
    ///
    /// # Errors
    /// When it is outside [`RADIUS`](Self::RADIUS).
    pub fn new(radius: f32) -> Result<Self, InvalidValue> {
        Self { radius, ..default() }.checked()
    }
}

/// The tie that holds a strand. Removing it, despawning the tie or removing its [`HairTie`] releases the strand.
/// A strand that is [`WoundOn`](crate::WoundOn) a rod is tied when it comes off.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Component, Clone, PartialEq)]
#[relationship(relationship_target = TiedStrands)]
#[require(TieProgress, HeldNodes)]
pub struct Tied(pub Entity);

/// The strands in a [`HairTie`]. Kept by Bevy.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone)]
#[relationship_target(relationship = Tied)]
pub struct TiedStrands(Vec<Entity>);

/// How far a strand has been gathered into its tie, and where it is held. Kept by the tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct TieProgress {
    /// How far it has been gathered: 0 has just begun, 1 is tied.
    pub(crate) progress: f32,
    /// The node that is held; 0 before gathering begins.
    pub(crate) node: u32,
    /// Its place in the tie's frame (m).
    pub(crate) place: Vec3,
    /// Where it was when gathering began, and the middle of the head that it is led round, in the hair's frame (m), with
    /// the direction of the side on which it is.
    start: Vec3,
    middle: Vec3,
    side: Vec3,
}

impl TieProgress {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let Self { progress, node, place, start, middle, side } = self;
        tape.value(progress);
        tape.value(node);
        tape.values([place, start, middle, side]);
    }

    /// 0 has just begun, 1 is tied.
    pub fn progress(&self) -> f32 {
        self.progress
    }

    /// A node that is tied at a place in the tie's frame.
    #[cfg(feature = "save")]
    pub(crate) fn tied(node: u32, place: Vec3) -> Self {
        Self { progress: 1.0, node, place, ..default() }
    }

    /// Whether gathering has not begun.
    pub(crate) fn waits(&self) -> bool {
        self.node == 0
    }
}

/// A request to tie strands of a hair: an event on its entity. Strands that are tied elsewhere change over. The answer
/// is [`HairTied`] on each hair: with 0 strands where none of the region is left that is not in this tie already.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Clone, PartialEq)]
pub struct TieHair {
    /// The [`Hair`](crate::Hair), or who wears it.
    #[event_target]
    pub hair: Entity,
    /// The [`HairTie`].
    pub tie: Entity,
    /// Which of its strands.
    pub region: StrandRegion,
}

impl TieHair {
    /// All strands.
    pub fn all(hair: Entity, tie: Entity) -> Self {
        Self { hair, tie, region: StrandRegion::All }
    }
}

/// Strands of a hair begin to be tied: an event on the hair.
#[derive(EntityEvent, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Clone, PartialEq)]
pub struct HairTied {
    /// The [`Hair`](crate::Hair).
    #[event_target]
    pub hair: Entity,
    /// The [`HairTie`].
    pub tie: Entity,
    /// How many strands reach the tie.
    pub strands: usize,
    /// How many are too short, and stay free.
    pub too_short: usize,
}
