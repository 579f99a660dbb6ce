//! Colliders fitted to what they stand for: capsules to the joints of a skinned mesh, a ball to the
//! head below a groom.

mod capsules;
mod head;
mod linear;

pub use capsules::{FitError, JointCapsule, fit_joint_capsules};
