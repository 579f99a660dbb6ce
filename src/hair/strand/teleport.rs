//! Teleporting a character with its hair.

use super::{Hair, Strand, StrandHistory, Strands, TickPose, is_on_gpu};
use bevy::prelude::*;

impl Hair {
    /// Call before a character is teleported: its hair moves with it in its present shape, at rest,
    /// and so do colliders, rods and blowers of the same character. Use it for spawn points and cut
    /// scenes: without it only jumps within a tick are detected that are longer than 0.5 m and than three
    /// times its longest strand, or turn the head by more than 1.6 rad
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
    ///     hero.translation.x += 0.5;
    /// }
    /// ```
    pub fn teleport(mut hair: EntityWorldMut<'_>) {
        let id = hair.id();
        // On the GPU they come to rest in the next tick.
        let members = hair.get::<Strands>().filter(|_| !is_on_gpu(hair.world(), id));
        let members: Vec<Entity> = members.into_iter().flat_map(Strands::iter).collect();
        hair.world_scope(|world| {
            for strand in members {
                // User code may have listed an entity that does not exist.
                if let Ok(mut strand) = world.get_entity_mut(strand)
                    && let Ok((mut strand, mut history)) =
                        strand.get_components_mut::<(&mut Strand, &mut StrandHistory)>()
                {
                    strand.rest();
                    history.remember(&strand);
                }
            }
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
