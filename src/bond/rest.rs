//! What the rods spring back to.

use super::{kind::BondKind, settings::Cuticle};
use crate::rod::Stiffness;
use bevy::prelude::*;

/// What the rods spring back to in this substep, written by `RestShape`, read by `Projection`.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct RestShape {
    /// Ω0 of each joint (equation 15), a full quaternion with real part ≥ 0.
    pub darboux: Vec<Quat>,
    /// k′ of each joint: equation 13's factor on the true stiffness, spread over the iterations
    /// (equation 12).
    pub stiffness: Vec<f32>,
    pub(super) key: Option<Key>,
    /// Whether all bonds are closed: then the shape is theirs alone, and stays until they change.
    pub(super) closed: bool,
    /// What the stiffness was last softened by.
    pub(super) softened: Vec<f32>,
}

/// What rest shapes depend on besides bonds and the present shape, resolved once a substep.
#[derive(Clone, Copy, Debug, Default, PartialEq, Reflect)]
pub(super) struct Key {
    pub(super) influence: [f32; BondKind::COUNT],
    pub(super) stiffness: Stiffness,
    pub(super) cuticle: Cuticle,
    pub(super) iterations: u32,
    pub(super) dt: f32,
}
