//! Guides and followers for those who simulate the hair elsewhere.

use super::{Follower, Guides, PresentLod, follow::GuideOffsets};
use bevy::prelude::*;

impl Follower {
    /// How it follows its guides; they are indices of [`Guides::entities`].
    pub(crate) fn offsets(&self) -> &GuideOffsets {
        &self.offsets
    }

    /// It has followed elsewhere for so long (s), and its root is here.
    pub(crate) fn pass(&mut self, seconds: f32, root: Vec3) {
        self.offsets.pass(seconds);
        self.root = root;
        self.synced_asleep = false;
    }
}

impl PresentLod {
    /// Sets whether the budget leaves it alone because it is about to be simulated elsewhere; returns
    /// whether that was so.
    pub(crate) fn set_leaving(&mut self, is_leaving: bool) -> bool {
        core::mem::replace(&mut self.is_leaving, is_leaving)
    }
}

impl Guides {
    /// The strands that others follow.
    pub(crate) fn entities(&self) -> &[Entity] {
        &self.strands
    }

    /// Whether strands are guides and followers as the present level of so many strands wants it.
    pub(crate) fn suit(&self, present: &PresentLod, strands: usize) -> bool {
        let share = present.simulated_share();
        let is_whole = share >= 1.0 && present.followers == 0 && self.strands.is_empty();
        is_whole || self.partition_key == Some((share, present.level, strands))
    }

    /// Has strands looked at again in the next tick.
    pub(crate) fn look_again(&mut self) {
        self.partition_key = None;
    }
}
