//! Blowers as seen from a hair.

use super::Blower;
use crate::{
    setting::Ranged,
    strand::{Pose, TickPose},
};
use bevy::prelude::*;

/// A blower as seen in a frame, its values valid.
pub(crate) struct LocalBlower {
    pub nozzle: Vec3,
    /// Unit direction of its wind.
    pub aim: Vec3,
    pub blower: Blower,
}

/// The blowers that blow, seen in the frame of `pose`.
pub(crate) fn local_blowers(
    frame: &Pose,
    blowers: &Query<(&Blower, &TickPose)>,
) -> Vec<LocalBlower> {
    blowers
        .iter()
        .map(|(b, pose)| (b.clamped(), pose.now()))
        .filter(|(blower, _)| blower.strength > 0.0)
        .map(|(blower, pose)| LocalBlower {
            nozzle: frame.point_in(pose.translation),
            aim: frame.direction_in(pose.rotation * Vec3::NEG_Z),
            blower,
        })
        .collect()
}
