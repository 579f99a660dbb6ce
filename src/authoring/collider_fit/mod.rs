//! Fitting of colliders: capsules to the joints of a skinned mesh, a ball to the head below a groom,
//! distance grids baked from a mesh.

mod bake;
mod balls;
mod capsules;
mod head;
mod linear_system;
mod protrusions;

pub(crate) use balls::{BallRules, inscribed_balls};
pub use capsules::{FitError, JointCapsule, fit_joint_capsules};
pub(crate) use protrusions::{ProtrusionRules, protrusions};

use bevy::prelude::*;

/// Registers the results of fitting for reflection.
#[derive(Clone, Copy, Debug, Default)]
pub struct ColliderFitPlugin;

impl Plugin for ColliderFitPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<JointCapsule>().register_type::<FitError>();
    }
}
