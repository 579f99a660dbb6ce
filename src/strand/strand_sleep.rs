//! What a strand keeps of its sleep. Who falls asleep and who wakes is decided in
//! [`sleep`](crate::sleep); here is only what the other systems ask: is it asleep?

use super::Strand;
use bevy::prelude::*;

/// Whether a strand is simulated in this tick. One that sleeps keeps its pose and is left out of all
/// that moves hair, see [`HairSleep`](crate::HairSleep); one that is carried goes along with others,
/// see [`LodLevel::strands`](crate::LodLevel::strands). Changes only at the start of a tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct StrandSleep {
    /// How long the strand has stayed where it is (s).
    still: f32,
    asleep: bool,
    carried: bool,
    disturbed: bool,
}

impl StrandSleep {
    /// Whether forces, rest shapes and the projection act on it: it neither sleeps nor is carried.
    pub fn is_simulated(&self) -> bool {
        !self.asleep && !self.carried
    }

    /// Whether it goes along with others instead of being simulated.
    pub fn is_follower(&self) -> bool {
        self.carried
    }

    pub(crate) fn set_follower(&mut self, carried: bool) {
        self.carried = carried;
    }

    /// Whether it sleeps in this tick.
    pub fn is_asleep(&self) -> bool {
        self.asleep
    }

    /// How long it has stayed where it is (s).
    pub fn still_for(&self) -> f32 {
        self.still
    }

    /// Wakes the strand at the start of the next tick, or keeps it awake. For what the tick cannot
    /// see: all that it sees wakes strands by itself.
    pub fn wake(&mut self) {
        self.disturbed = true;
    }

    /// Whether somebody wanted it awake since the last call.
    pub(crate) fn take_disturbed(&mut self) -> bool {
        core::mem::take(&mut self.disturbed)
    }

    /// It lay still for `seconds` more.
    pub(crate) fn lie_still(&mut self, seconds: f32) {
        self.still += seconds;
    }

    pub(crate) fn fall_asleep(&mut self) {
        self.asleep = true;
    }

    pub(crate) fn wake_up(&mut self) {
        (self.asleep, self.still) = (false, 0.0);
    }
}

/// How many of the strands that are not carried by others sleep. Kept by the tick.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct Sleepers {
    /// Strands that sleep in this tick.
    pub asleep: usize,
    /// Strands that are simulated in this tick.
    pub awake: usize,
}

impl Sleepers {
    /// Whether all of the hair sleeps.
    pub fn all(&self) -> bool {
        self.asleep > 0 && self.awake == 0
    }
}

/// The pose in which a strand has stayed since it last moved, and what holds it there.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct StillPose {
    pub(crate) positions: Vec<Vec3>,
    pub(crate) orientations: Vec<Quat>,
    pub(crate) root_frame: Quat,
    /// Which nodes were held, in one number.
    pub(crate) held: u64,
    /// The corners of the box around a sleeper (m).
    pub(crate) low: Vec3,
    pub(crate) high: Vec3,
    /// How far a node may be from where it was (m).
    pub(crate) distance: f32,
    /// What other strands did to a sleeper's nodes when that was first asked (m/s²).
    pushes: Vec<Vec3>,
}

impl StillPose {
    /// The strand's present pose.
    pub(crate) fn begin(&mut self, strand: &Strand, held: u64) {
        self.positions.clone_from(&strand.positions);
        self.orientations.clone_from(&strand.orientations);
        self.root_frame = strand.root_frame;
        self.held = held;
        self.pushes.clear();
    }

    /// Whether other strands push a sleeper otherwise than they did: by as much as one does that has
    /// come nearer by twice what counts as still, `gradient` (1/s²) being what pushes grow by.
    pub(crate) fn feels(&mut self, pushes: impl Iterator<Item = Vec3>, gradient: f32) -> bool {
        let most = 2.0 * self.distance * gradient;
        if self.pushes.is_empty() {
            self.pushes.extend(pushes);
            return false;
        }
        let is_new = |(i, push): &(usize, Vec3)| match self.pushes.get(*i) {
            Some(known) => known.distance_squared(*push) > most * most,
            None => true,
        };
        // All are taken, because the next strand's come behind them.
        pushes.enumerate().filter(is_new).count() > 0
    }
}
