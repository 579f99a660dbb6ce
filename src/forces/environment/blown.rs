//! The effect of the air at a node: computed once, for velocities, bonds and water.

use super::{Blower, vapour::jet, wind::wind};
use crate::keratin::bond::model::drying;
use bevy::prelude::*;

/// A blower in a hair's frame, with valid values.
pub(crate) struct LocalBlower {
    pub nozzle: Vec3,
    /// Unit direction of its wind.
    pub aim: Vec3,
    pub blower: Blower,
}

/// Wind up to which hair may sleep (m/s): at any usual drag it bends hair by a thousandth of what
/// gravity does.
const CALM: f32 = 5e-3;

/// The air flow at a node.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Blown {
    /// Acceleration of the edge that begins here, equation 17 (m/s²).
    pub(crate) acceleration: Vec3,
    /// Velocity of the wind and of zones, used by drag (m/s).
    pub(crate) flow: Vec3,
    /// Rate at which it dries, equation 19 (1/s).
    pub(crate) drying: f32,
    /// Velocity of the air beyond the room's draught (m/s).
    pub(crate) velocity: Vec3,
    /// The air's share of the jets, and their temperature weighted by it (°C).
    share: f32,
    celsius: f32,
    /// How much warmer zones make it (K).
    warmth: f32,
}

impl Blown {
    /// At a point of an `edge`, in a frame with `scale` world units per unit. Off its axis a jet falls
    /// off like equation 17's wind.
    pub(super) fn at(blowers: &[LocalBlower], scale: f32, p: Vec3, edge: Vec3) -> Self {
        let mut all = Self::default();
        for LocalBlower { nozzle, aim, blower } in blowers {
            let acceleration = wind(blower.strength, *nozzle, *aim, p, edge);
            all.acceleration += acceleration;
            all.drying += drying(acceleration.length(), blower.drying);
            let across = aim.any_orthonormal_vector();
            let share =
                wind(1.0, *nozzle, *aim, p, across).length() * jet((p - *nozzle).dot(*aim) * scale);
            all.velocity += *aim * (blower.speed * share);
            all.share += share;
            all.celsius += blower.celsius * share;
        }
        all
    }

    /// Whether hair may sleep in it: it neither moves hair nor sets bonds.
    pub(crate) fn is_calm(&self) -> bool {
        self.flow.length_squared() < CALM * CALM && self.drying < 1e-6
    }

    /// How much warmer it is than a `room` (K).
    pub(crate) fn warmth(&self, room: f32) -> f32 {
        self.celsius - room * self.share + self.warmth
    }

    pub(super) fn add_warmth(&mut self, warmth: f32) {
        self.warmth += warmth;
    }
}

/// The effect of the air on each node of a wet strand, root first. Kept by the tick while any air moves.
#[doc(hidden)]
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct BlownAir {
    #[reflect(ignore)]
    pub(crate) nodes: Vec<Blown>,
}
