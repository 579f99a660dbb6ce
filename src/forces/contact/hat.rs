//! Hats: which hair they hold, and how they come down on it.

use super::{ColliderShape, Obstacles, TickColliders};
use crate::{
    base::tape::Tape,
    hair::{strand::Hair, worn::WornBy},
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

impl Obstacles {
    /// Whether this collider is a hat that holds the hair.
    pub(crate) fn is_held_by(&self, collider: Entity) -> bool {
        self.hats.iter().any(|hat| hat.id == collider)
    }

    pub(crate) fn record(&mut self, tape: &mut Tape<'_>) {
        let count = tape.count(self.hats.len(), size_of::<f32>());
        self.hats.resize(count, WornHat { id: Entity::PLACEHOLDER, down: 0.0 });
        for WornHat { id, down } in &mut self.hats {
            tape.entity(id);
            tape.value(down);
        }
    }
}

/// At the start of a tick: a hat holds hair that is worn by an entity above it, that is a child of one, or that lies below
/// its parent.
pub(super) fn find_hats(
    colliders: Res<TickColliders>,
    parents: Query<&ChildOf>,
    mut hairs: Query<(Entity, Option<&WornBy>, &mut Obstacles), With<Hair>>,
    mut hats: Local<Vec<Entity>>,
) {
    hats.clear();
    let is_hat = |shape: &ColliderShape| matches!(shape, ColliderShape::Hat { .. });
    hats.extend(colliders.iter().filter(|of| is_hat(&of.collider.shape)).map(|of| of.id));
    for (hair, worn, mut obstacles) in &mut hairs {
        let worn_hats = &mut obstacles.bypass_change_detection().hats;
        if hats.is_empty() {
            worn_hats.clear();
            continue;
        }
        let parent = |of: Entity| parents.get(of).ok().map(|child| child.0);
        let on = worn.map(|worn| worn.0).or_else(|| parent(hair));
        let holds = |hat: &Entity| {
            let is_above = on.is_some_and(|on| parents.iter_ancestors(*hat).any(|id| id == on));
            is_above
                || parent(*hat).is_some_and(|head| {
                    hair == head || parents.iter_ancestors(hair).any(|id| id == head)
                })
        };
        worn_hats.retain(|hat| hats.contains(&hat.id) && holds(&hat.id));
        for hat in hats.iter().filter(|hat| holds(hat)) {
            if !worn_hats.iter().any(|worn| worn.id == *hat) {
                worn_hats.push(WornHat { id: *hat, down: 0.0 });
            }
        }
    }
}
