//! Colliders fitted to what they stand for: capsules to the joints of a skinned mesh, a ball to the
//! head below a groom.

mod balls;
mod capsules;
mod head;
mod linear;

pub(crate) use balls::{BallRules, inscribed_balls};
pub use capsules::{FitError, JointCapsule, fit_joint_capsules};

use bevy::prelude::*;

/// Registers what fitting gives for reflection.
#[derive(Clone, Copy, Debug, Default)]
pub struct ColliderFitPlugin;

impl Plugin for ColliderFitPlugin {
    fn build(&self, app: &mut App) {
        app.register_type::<JointCapsule>().register_type::<FitError>();
    }
}
