//! What a record holds of hair that the paper's projections solve.

use crate::solver::rod::{StretchProjection, Sweeps, step::spin_exchange};
use bevy::math::{Quat, Vec3};

/// The projections in a substep.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SweepRecord {
    /// The settings, with as many iterations as this substep takes.
    pub settings: Sweeps,
}

// Projections in a record.
pub(super) const SPLIT: u32 = StretchProjection::Split as u32;
pub(super) const PRINTED: u32 = StretchProjection::Printed as u32;

/// Words of it in a record.
pub(super) const WORDS: usize = 8;

impl SweepRecord {
    /// Of a substep of `dt` (s) and hair of this gravity-bending length (m).
    pub(super) fn words(record: Option<&Self>, dt: f32, bending_length: f32) -> [u32; WORDS] {
        let Some(Self { settings }) = record else { return [0; WORDS] };
        let numbers = [
            settings.ratio(dt),
            settings.spin_weight(bending_length),
            settings.orientation_weight.unwrap_or(0.0),
            spin_exchange(settings.internal_damping, dt),
        ];
        let [bend, weight, chi, exchange] = numbers.map(f32::to_bits);
        [bend, weight, chi, exchange, settings.iterations, settings.projection as u32, 0, 0]
    }
}

/// What has become since the hand-over of angular velocities that only the projections have, of hair that the direct
/// method solves: on the CPU air and the hair's frame act on them all the same.
#[derive(Clone, Copy, Debug)]
pub(super) struct UnusedSpins {
    retained: f32,
    turn: Quat,
}

impl Default for UnusedSpins {
    fn default() -> Self {
        Self { retained: 1.0, turn: Quat::IDENTITY }
    }
}

impl UnusedSpins {
    /// A substep in which air leaves this share of them and points at rest in the world turn like this.
    pub(super) fn pass(&mut self, retained: f32, turn: Option<Quat>) {
        self.retained *= retained;
        if let Some(turn) = turn {
            self.turn = (turn * self.turn).normalize();
        }
    }

    /// The hair is at rest: it sleeps, or has come back to the world.
    pub(super) fn rest(&mut self) {
        self.retained = 0.0;
    }

    pub(super) fn apply(&self, spins: &mut [Vec3]) {
        if self.retained != 1.0 || self.turn != Quat::IDENTITY {
            spins.iter_mut().for_each(|omega| *omega = self.turn * *omega * self.retained);
        }
    }
}
