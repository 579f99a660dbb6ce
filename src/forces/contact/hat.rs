//! How hats come down on hair that they hold.

use crate::{
    base::tape::Tape,
    solver::rod::{
        obstacle::{Obstacle, Solid},
        shape::Shape,
    },
};
use bevy::{math::Affine3A, prelude::*};

/// How long a hat takes to come down on hair (s).
const COMING_DOWN: f32 = 0.4;
/// From how high it comes, in times its height.
const ABOVE: f32 = 3.0;

/// A hat that holds a hair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WornHat {
    pub(super) id: Entity,
    /// How far it has come down: from 0 to 1.
    down: f32,
}

impl WornHat {
    /// One that is yet to come down.
    pub(super) fn new(id: Entity) -> Self {
        Self { id, down: 0.0 }
    }

    pub(super) fn record(&mut self, tape: &mut Tape<'_>) {
        tape.entity(&mut self.id);
        tape.value(&mut self.down);
    }

    /// Makes the obstacle hold hair, as high up as the hat still is after so many more seconds. Until it is down it has no
    /// friction: what it sweeps along would be caught between it and the head.
    pub(super) fn come_down(&mut self, obstacle: &mut Obstacle, dt: f32) {
        let Solid::Placed(placed) = &mut obstacle.solid else { return };
        let Shape::Hat { radii, holds, .. } = &mut placed.shape else { return };
        *holds = true;
        let before = self.down;
        if before < 1.0 {
            self.down = (before + dt / COMING_DOWN).min(1.0);
            // Slower and slower.
            let left = |down: f32| (1.0 - down) * (1.0 - down);
            let up = placed.axes.y_axis * (ABOVE * radii.y * placed.scale);
            placed.center += up * left(self.down);
            let motion = obstacle.motion.unwrap_or(Affine3A::IDENTITY);
            let down = up * (left(self.down) - left(before));
            obstacle.motion = Some(Affine3A::from_translation(down) * motion);
            obstacle.friction = 0.0;
        }
    }
}
