//! Rest shapes and stiffness of rods.

use super::{kind::BondKind, settings::Cuticle};
use crate::{base::tape::Tape, solver::rod::Sweeps};
use bevy::prelude::*;

/// Rest shape and stiffness of a rod's joints in this substep, written by `RestShape`, read by
/// `Projection`.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Default, Clone)]
pub struct RestShape {
    /// Rest shape of each joint, a full quaternion with real part ≥ 0: for the direct solver the shape
    /// that closed bonds remember, Ω* = Σ f b Ω_j / Σ f b; for sweeps Ω0 of equation 15, which follows
    /// the present shape as far as bonds are open. Both have the same equilibria.
    pub darboux: Vec<Quat>,
    /// Stiffness of each joint: for the direct solver a factor on the hair's own, equation 13's times
    /// the share B of bonds that are closed; for sweeps k′, equation 13's spread over the iterations
    /// (equation 12).
    pub stiffness: Vec<f32>,
    pub(super) key: Option<Key>,
    /// Whether the shape stays until bonds change: with all bonds closed, and in the direct solver with
    /// any closed.
    pub(super) closed: bool,
    /// The softening that the stiffness was computed with, and the strand's own share.
    pub(super) softened: Vec<f32>,
    #[reflect(ignore)]
    pub(super) share: f32,
}

impl RestShape {
    /// What of it does not follow from bonds and settings; the rest is made again.
    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.list(&mut self.softened);
        if let Tape::Read(_) = tape {
            self.closed = false;
            self.stiffness.clear();
        }
    }

    pub(super) fn is_finite(&self) -> bool {
        self.darboux.iter().all(|q| q.is_finite())
            && self.stiffness.iter().chain(&self.softened).all(|k| k.is_finite())
    }
}

/// Settings that rest shapes depend on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Reflect)]
pub(super) struct Key {
    pub(super) influence: [f32; BondKind::COUNT],
    pub(super) cuticle: Cuticle,
    /// The sweeps' settings and their substep (s), where they solve the rods.
    pub(super) sweeps: Option<(Sweeps, f32)>,
}
