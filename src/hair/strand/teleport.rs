//! Teleporting a character with its hair, and shifting the world.

use super::{Hair, TickPose};
use crate::base::motion::WorldMotion;
use bevy::prelude::*;

impl Hair {
    /// Call before a character is teleported: its hair keeps its shape and its motion, seen from the
    /// head and turned with it, and so do colliders, rods and blowers of the same character. Use it for
    /// portals and cut scenes: without it jumps are detected that change the head's velocity by more
    /// than 25 m/s or its spin by more than 40 rad/s within a tick
    /// ([`HairInertia`](crate::HairInertia)).
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// fn step_through_the_portal(
    ///     mut commands: Commands,
    ///     hair: Single<Entity, With<Hair>>,
    ///     mut hero: Single<&mut Transform, With<Name>>,
    /// ) {
    ///     commands.entity(*hair).queue(Hair::teleport);
    ///     hero.translation.x += 0.4;
    /// }
    /// ```
    pub fn teleport(mut hair: EntityWorldMut<'_>) {
        let id = hair.id();
        hair.world_scope(|world| {
            let mut root = id;
            while let Some(parent) = world.get::<ChildOf>(root) {
                root = parent.parent();
            }
            let mut todo = vec![root];
            while let Some(entity) = todo.pop() {
                if let Some(mut pose) = world.get_mut::<TickPose>(entity) {
                    pose.jump();
                }
                todo.extend(world.get::<Children>(entity).into_iter().flatten());
            }
        });
    }
}

/// Tells all hair that the world is shifted, as games with a floating origin do: trigger it where
/// the transforms of everything in the world are moved by the same way, before or after it. Hair,
/// droplets, gusts and all that moves hair go on as if nothing had happened.
///
/// ```
/// # use bevy_keratin::prelude::*; use bevy::prelude::*;
/// fn keep_the_origin_near(
///     mut commands: Commands,
///     hero: Single<&GlobalTransform, With<Name>>,
///     mut roots: Query<&mut Transform, Without<ChildOf>>,
/// ) {
///     let far = hero.translation();
///     if far.length() > 1000.0 {
///         roots.iter_mut().for_each(|mut root| root.translation -= far);
///         commands.trigger(ShiftWorld { by: -far });
///     }
/// }
/// ```
#[derive(Event, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Event, Default, Clone, PartialEq)]
pub struct ShiftWorld {
    /// What is added to all positions (m).
    pub by: Vec3,
}

/// Where things were moves along.
pub(super) fn shift_poses(
    shift: On<ShiftWorld>,
    mut motion: ResMut<WorldMotion>,
    mut poses: Query<&mut TickPose>,
) {
    motion.shift(shift.by);
    poses.iter_mut().for_each(|mut pose| pose.bypass_change_detection().shift(shift.by));
}
