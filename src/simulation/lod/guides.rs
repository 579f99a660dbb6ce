//! What is kept of guides and of the strands that follow them.

use super::follow::{Frame, GuideOffsets};
use crate::hair::strand::{Strand, StrandHistory, StrandSleep};
use bevy::prelude::*;

/// How a strand that is not simulated at its hair's level follows its guides, see
/// [`LodLevel::strands`](crate::LodLevel::strands). Kept by the tick.
#[doc(hidden)]
#[derive(Component, Reflect, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[reflect(Component, Default, Clone)]
pub struct Follower {
    /// Its place in the hair's spread order, once computed.
    pub(super) rank: Option<u32>,
    /// Its index among the hair's guides.
    #[reflect(ignore)]
    pub(super) guide: Option<u32>,
    #[reflect(ignore)]
    pub(super) offsets: GuideOffsets,
    /// Position of its root when it last moved (m).
    pub(super) root: Vec3,
    /// Whether it was frozen and is simulated again from this tick on.
    #[reflect(ignore)]
    pub(super) thaws: bool,
    /// Whether it sleeps because its guides do.
    pub(super) synced_asleep: bool,
}

/// The strands of a [`Hair`] that others follow. Kept by the tick.
#[doc(hidden)]
#[derive(Component, Reflect, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[reflect(Default, Clone)]
pub struct Guides {
    /// In spread order.
    #[reflect(ignore)]
    pub(super) strands: Vec<Entity>,
    /// Where each one's frames begin in the list, and where the last one's end.
    #[reflect(ignore)]
    starts: Vec<u32>,
    /// Orientations of their edges in this tick.
    #[reflect(ignore)]
    turns: Vec<Quat>,
    /// Which are valid to follow, and which of them are awake.
    #[reflect(ignore)]
    usable: Vec<bool>,
    #[reflect(ignore)]
    pub(super) awake: Vec<bool>,
    pub(super) level: usize,
    /// Whether any strand was frozen and is simulated again from this tick on.
    #[reflect(ignore)]
    pub(super) thaws: bool,
    /// Key of the present partition: simulated share, level, number of strands.
    #[reflect(ignore)]
    pub(super) partition_key: Option<(f32, usize, usize)>,
    /// How the hair's own frame has moved in this tick.
    #[reflect(ignore)]
    pub(super) frame: Frame,
}

impl Guides {
    /// The guides of a follower.
    #[cfg(feature = "debug")]
    pub(crate) fn of(&self, follower: &Follower) -> impl Iterator<Item = Entity> {
        follower.offsets.guides().filter_map(|i| self.strands.get(i as usize).copied())
    }

    pub(super) fn turns(&self, guide: u32) -> Option<&[Quat]> {
        let i = guide as usize;
        let (from, to) = (*self.starts.get(i)?, *self.starts.get(i + 1)?);
        self.turns.get(from as usize..to as usize).filter(|_| self.usable[i])
    }

    pub(super) fn begin(&mut self) {
        self.strands.clear();
        self.turns.clear();
        self.usable.clear();
        self.awake.clear();
        self.starts.clear();
        self.starts.push(0);
    }

    pub(super) fn add(&mut self, entity: Entity, strand: &Strand) {
        let seen = strand.orientations();
        self.strands.push(entity);
        self.turns.extend_from_slice(seen);
        self.starts.push(self.turns.len() as u32);
        self.usable.push(is_usable(seen));
        self.awake.push(true);
    }

    /// Updates a guide's pose.
    pub(super) fn update_pose(&mut self, i: usize, strand: Option<&Strand>) {
        let (from, to) = (self.starts[i] as usize, self.starts[i + 1] as usize);
        let seen = strand.map_or(&[][..], Strand::orientations);
        self.usable[i] = seen.len() == to - from && is_usable(seen);
        if self.usable[i] {
            self.turns[from..to].copy_from_slice(seen);
        }
    }
}

fn is_usable(turns: &[Quat]) -> bool {
    turns.iter().all(|q| (0.5..2.0).contains(&q.length_squared()))
}

/// A strand of a hair that is being partitioned.
pub(super) struct GroupStrand<'a> {
    pub(super) entity: Entity,
    pub(super) sleep: Mut<'a, StrandSleep>,
    pub(super) follower: Mut<'a, Follower>,
    pub(super) history: Mut<'a, StrandHistory>,
    /// Whether it is among the strands that are not simulated.
    pub(super) is_kinematic: bool,
    /// Whether it may be a guide or a follower: a valid strand that nothing holds.
    pub(super) free: bool,
}
