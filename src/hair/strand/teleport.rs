//! Teleporting a character with its hair, and shifting the world.

use super::{Hair, TickPose};
use crate::{base::motion::WorldMotion, hair::worn::hairs_of};
use bevy::prelude::*;

impl Hair {
    /// Queue on a hair, or on its wearer, before a character is teleported: its hair keeps its shape and its motion, seen from the
    /// head and turned with it, and so do colliders, rods and blowers of the same character. Use it for
    /// portals and cut scenes: without it jumps are detected that change the head's velocity by more
    /// than 25 m/s or its spin by more than 40 rad/s within a tick
    /// ([`HairInertia`](crate::HairInertia)).
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// fn step_through_the_portal(
    ///     mut commands: Commands,
    ///     mut heroes: Query<(Entity, &mut Transform), With<WornHair>>,
    /// ) {
    ///     for (hero, mut place) in &mut heroes {
    ///         commands.entity(hero).queue(Hair::teleport);
    ///         place.translation.x += 0.4;
    ///     }
    /// }
    /// ```
    pub fn teleport(mut hair: EntityWorldMut<'_>) {
        let id = hair.id();
        hair.world_scope(|world| {
            let root = |of: Entity| {
                let parent = |of: &Entity| world.get::<ChildOf>(*of).map(ChildOf::parent);
                core::iter::successors(Some(of), parent).last().unwrap_or(of)
            };
            let mut todo: Vec<Entity> =
                core::iter::once(id).chain(hairs_of(world, id)).map(root).collect();
            todo.sort_unstable();
            todo.dedup();
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
///     cameras: Query<&GlobalTransform, With<Camera>>,
///     mut roots: Query<&mut Transform, Without<ChildOf>>,
/// ) {
///     let far = cameras.iter().next().map_or(Vec3::ZERO, GlobalTransform::translation);
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
