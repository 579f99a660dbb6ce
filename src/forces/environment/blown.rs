//! The effect of the air at a node: computed once, for velocities, bonds and water.

use super::{Blower, vapour::jet, wind::wind};
use crate::{base::tape::Tape, hair::strand::Carried, keratin::bond::model::drying};
use bevy::prelude::*;

/// A blower in a hair's frame, with valid values.
pub(crate) struct LocalBlower {
    pub nozzle: Vec3,
    /// Unit direction of its wind.
    pub aim: Vec3,
    pub blower: Blower,
    /// How the nozzle moves, and its air with it.
    pub moves: Carried,
}

/// Wind up to which hair may sleep (m/s): at any usual drag it bends hair by a thousandth of what
/// gravity does.
const CALM: f32 = 5e-3;

/// The air flow at a node.
#[repr(C)]
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct Blown {
    /// Acceleration of the edge that begins here, equation 17 (m/s²).
    pub(crate) acceleration: Vec3,
    /// Velocity of the wind and of zones, used by drag (m/s).
    pub(crate) flow: Vec3,
    /// Rate at which it dries, equation 19 (1/s).
    pub(crate) drying: f32,
    /// Velocity of the air beyond the room's draught (m/s).
    pub(crate) velocity: Vec3,
    /// The air's share of the jets, and their velocity (m/s) and temperature (°C) weighted by it.
    share: f32,
    carried: Vec3,
    celsius: f32,
    /// How much warmer zones make it (K).
    warmth: f32,
}

impl Blown {
    /// The room's own air, which passes at a velocity (m/s).
    pub(crate) fn passing(velocity: Vec3) -> Self {
        Self { velocity, ..default() }
    }

    /// At a point of an `edge`, in a frame with `scale` world units per unit. Off its axis a jet falls
    /// off like equation 17's wind.
    pub(super) fn at(blowers: &[LocalBlower], scale: f32, p: Vec3, edge: Vec3) -> Self {
        let mut all = Self::default();
        for LocalBlower { nozzle, aim, blower, moves } in blowers {
            let acceleration = wind(blower.strength, *nozzle, *aim, p, edge);
            all.acceleration += acceleration;
            all.drying += drying(acceleration.length(), blower.drying);
            let across = aim.any_orthonormal_vector();
            let share =
                wind(1.0, *nozzle, *aim, p, across).length() * jet((p - *nozzle).dot(*aim) * scale);
            all.velocity += *aim * (blower.speed * share);
            all.share += share;
            all.carried += moves.at(p) * share;
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

    /// Puts the jets into air that flows: their share of it moves as their nozzles do.
    pub(super) fn flow_by(&mut self, flow: Vec3) {
        self.flow = flow + (self.carried - flow * self.share) / self.share.max(1.0);
        self.velocity += self.flow;
    }

    pub(super) fn add_warmth(&mut self, warmth: f32) {
        self.warmth += warmth;
    }
}

/// The effect of the air on each node of a wet strand, root first. Kept by the tick while any air moves.
#[doc(hidden)]
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Default, Clone)]
pub struct BlownAir {
    #[reflect(ignore)]
    pub(crate) nodes: Vec<Blown>,
}

impl BlownAir {
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.list(&mut self.nodes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn air_of_a_jet_moves_with_its_nozzle_as_far_as_it_is_the_jets() {
        let jet = |speed: f32| LocalBlower {
            nozzle: Vec3::ZERO,
            aim: Vec3::X,
            blower: Blower { speed: 15.0, ..Blower::default() },
            moves: Carried::along(Vec3::Z * speed),
        };
        let flow = |jets: &[LocalBlower], place: Vec3, flow: Vec3| {
            let mut air = Blown::at(jets, 1.0, place, Vec3::Y);
            air.flow_by(flow);
            air
        };
        let (core, aside) = (Vec3::X * 0.03, Vec3::new(0.03, 0.01, 0.0));
        // Moved through still air, and at rest: whole in the core, half of it a centimetre from its axis.
        assert!(flow(&[jet(10.0)], core, Vec3::ZERO).flow.distance(Vec3::Z * 10.0) < 1e-5);
        assert!(flow(&[jet(10.0)], aside, Vec3::ZERO).flow.distance(Vec3::Z * 5.0) < 1e-5);
        assert_eq!(flow(&[jet(0.0)], core, Vec3::ZERO).flow, Vec3::ZERO);
        assert_eq!(flow(&[jet(10.0)], Vec3::NEG_X, Vec3::Y).flow, Vec3::Y);
        // With the wind, as in a closed cabin, it rests in its air.
        let along = flow(&[jet(10.0)], aside, Vec3::Z * 10.0);
        assert!(along.flow.distance(Vec3::Z * 10.0) < 1e-5);
        assert!(along.velocity.distance(Vec3::new(7.5, 0.0, 10.0)) < 1e-5);
        // Two jets are no more than all of the air.
        let both = flow(&[jet(10.0), jet(20.0)], core, Vec3::X);
        assert!(both.flow.distance(Vec3::Z * 15.0) < 1e-5, "{}", both.flow);
    }
}
