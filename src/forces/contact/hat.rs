//! How hats come down on hair that they hold.

use super::ColliderShape;
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

/// Within how many times its size a hat holds hair: that is put on, and that is worn.
const TAKEN: f32 = 1.0;
const KEPT: f32 = 1.1;

/// A hat that holds a hair.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WornHat {
    pub(super) id: Entity,
    /// How far it has come down: from 0 to 1.
    down: f32,
}

impl WornHat {
    /// One that is yet to come down.
    fn new(id: Entity) -> Self {
        Self { id, down: 0.0 }
    }

    /// Takes down, or puts back, how far hats have come down, without their names, which are others on another machine or
    /// where a hat was spawned again: [`held_by`](Self::held_by) gives them names.
    pub(super) fn record(hats: &mut Vec<Self>, tape: &mut Tape<'_>) {
        let count = tape.count(hats.len(), size_of::<f32>());
        if let Tape::Read(Some(_)) = tape {
            hats.clear();
            hats.resize(count, Self::new(Entity::PLACEHOLDER));
        }
        hats.iter_mut().for_each(|hat| tape.value(&mut hat.down));
    }

    /// Whether a place in the frame of a hat, such as a root, is under it.
    pub(super) fn covers(is_worn: bool, shape: &ColliderShape, place: Vec3) -> bool {
        let ColliderShape::Hat { radii, rim, .. } = *shape else { return false };
        let size = if is_worn { KEPT } else { TAKEN };
        (place / radii).length() < size && place.y > rim - (size - 1.0) * radii.y
    }

    /// The hats that hold a hair, in the order of `ids`: those of `before` are where they were.
    pub(super) fn held_by(ids: Vec<Entity>, mut before: Vec<Self>) -> Vec<Self> {
        let held = ids.into_iter().map(|id| {
            let own = before.iter().position(|hat| hat.is(id));
            Self { id, down: own.map_or(0.0, |own| before.remove(own).down) }
        });
        held.collect()
    }

    pub(super) fn is_down(&self) -> bool {
        self.down >= 1.0
    }

    /// Whether it is this one, or has been put back without a name.
    pub(super) fn is(&self, id: Entity) -> bool {
        [id, Entity::PLACEHOLDER].contains(&self.id)
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
