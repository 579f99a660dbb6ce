//! Hair whose nodes are written where they are drawn.

use bevy::prelude::*;

/// Marks a hair whose nodes another system writes into
/// [`HairBuffers::nodes`](super::HairBuffers::nodes), on the GPU.
#[derive(Component, Clone, Copy, Debug, Default)]
#[component(clone_behavior = Ignore)]
#[cfg_attr(not(feature = "gpu"), allow(dead_code, reason = "only the GPU does"))]
pub(crate) struct DrawnElsewhere {
    /// The corners of the box around them, in the hair's frame (m).
    pub(crate) low: Vec3,
    pub(crate) high: Vec3,
    /// How far drawing is from the tick before to the present one. Written by drawing.
    pub(crate) overstep: f32,
    /// It rests at the end of the last tick.
    pub(crate) rests: bool,
}
