//! A strand's sleep state, which other systems read. [`sleep`](crate::simulation::sleep) decides which strands
//! fall asleep and wake.

use crate::base::tape::Tape;
use bevy::prelude::*;

/// Whether a strand is simulated in this tick. One that sleeps keeps its pose and is skipped by all
/// systems that move hair, see [`SleepSettings`](crate::SleepSettings); a follower moves with its guides, see
/// [`LodLevel::strands`](crate::LodLevel::strands). Changes only at the start of a tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[component(clone_behavior = Ignore)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct StrandSleep {
    /// How long the strand has been still (s).
    still: f32,
    asleep: bool,
    /// Derived from its guides: not for inspectors to write.
    #[reflect(ignore)]
    follower: bool,
    disturbed: bool,
}

impl StrandSleep {
    /// Whether forces, rest shapes and the projection act on it: it neither sleeps nor is a follower.
    pub fn is_simulated(&self) -> bool {
        !self.asleep && !self.follower
    }

    /// Whether it follows guides instead of being simulated.
    pub fn is_follower(&self) -> bool {
        self.follower
    }

    pub(crate) fn set_follower(&mut self, follower: bool) {
        self.follower = follower;
    }

    /// Whether it sleeps in this tick.
    pub fn is_asleep(&self) -> bool {
        self.asleep
    }

    /// How long it has been still (s).
    pub fn still_for(&self) -> f32 {
        self.still
    }

    /// Wakes the strand at the start of the next tick, or keeps it awake. For causes that the tick
    /// cannot detect; changes of components and settings wake strands anyway.
    pub fn wake(&mut self) {
        self.disturbed = true;
    }

    /// Whether [`wake`](Self::wake) was called since the last call of this.
    pub(crate) fn take_disturbed(&mut self) -> bool {
        core::mem::take(&mut self.disturbed)
    }

    /// Its state but for whether it follows.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.value(&mut self.still);
        tape.flags([&mut self.asleep, &mut self.disturbed]);
    }

    /// Adds `seconds` to the time it has been still.
    pub(crate) fn add_still_time(&mut self, seconds: f32) {
        self.still += seconds;
    }

    pub(crate) fn fall_asleep(&mut self) {
        self.asleep = true;
    }

    pub(crate) fn wake_up(&mut self) {
        (self.asleep, self.still) = (false, 0.0);
    }
}

/// Marks a strand that follows guides or is frozen at its hair's level of detail. It puts such strands
/// into tables of their own, which systems that act on simulated strands do not visit. Set and removed
/// where [`StrandSleep::is_follower`] changes.
#[derive(Component, Clone, Copy, Debug, Default, PartialEq)]
#[component(clone_behavior = Ignore)]
pub(crate) struct KinematicStrand;

/// Numbers of a hair's sleeping and awake strands; followers are not counted. Kept by the tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[component(clone_behavior = Ignore)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct SleepCounts {
    /// Strands that sleep in this tick.
    pub asleep: usize,
    /// Strands that are simulated in this tick.
    pub awake: usize,
}

impl SleepCounts {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        for count in [&mut self.asleep, &mut self.awake] {
            let mut number = *count as u32;
            tape.value(&mut number);
            *count = number as usize;
        }
    }

    /// Whether all of the hair sleeps.
    pub fn all(&self) -> bool {
        self.asleep > 0 && self.awake == 0
    }
}

/// The pose in which a strand has been still, and the contact forces on it.
#[doc(hidden)]
#[derive(Component, Reflect, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[reflect(Default, Clone)]
pub struct SleepPose {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) orientations: Vec<Quat>,
    pub(crate) root_frame: Quat,
    /// Hash of which nodes were held.
    pub(crate) held: u64,
    /// The bounding box of a sleeping strand (m).
    pub(crate) low: Vec3,
    pub(crate) high: Vec3,
    /// How far a node may move while it counts as still (m).
    pub(crate) distance: f32,
    /// Contact accelerations on a sleeping strand's nodes when first measured (m/s²).
    pushes: Vec<Vec3>,
}

impl SleepPose {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.list(&mut self.positions);
        tape.list(&mut self.orientations);
        tape.list(&mut self.pushes);
        tape.value(&mut self.root_frame);
        tape.values([&mut self.low, &mut self.high]);
        tape.value(&mut self.held);
        tape.value(&mut self.distance);
    }

    /// Stores a strand's present pose: node positions, edge orientations and the scalp's frame.
    pub(crate) fn begin(
        &mut self,
        positions: &[Vec3],
        orientations: &[Quat],
        root_frame: Quat,
        held: u64,
    ) {
        positions.clone_into(&mut self.positions);
        orientations.clone_into(&mut self.orientations);
        (self.root_frame, self.held) = (root_frame, held);
        self.pushes.clear();
    }

    /// Whether contact with other strands has changed by more than an approach by twice the still
    /// distance would change it; `gradient` (1/s²) is that of the contact acceleration.
    pub(crate) fn has_new_contact(
        &mut self,
        pushes: impl Iterator<Item = Vec3>,
        gradient: f32,
    ) -> bool {
        let most = 2.0 * self.distance * gradient;
        if self.pushes.is_empty() {
            self.pushes.extend(pushes);
            return false;
        }
        let is_new = |(i, push): &(usize, Vec3)| match self.pushes.get(*i) {
            Some(known) => known.distance_squared(*push) > most * most,
            None => true,
        };
        // Consumes all items: those of the next strand follow in the same iterator.
        pushes.enumerate().filter(is_new).count() > 0
    }
}
