//! What a game may do to a hair at once: put it elsewhere, put it back in shape, make its shape its
//! own. Each is an entity command and a function on the entity.

use super::{Hair, Strand, StrandHistory, Strands, TickPose};
use crate::bond::{BondKind, Bonds};
use bevy::prelude::*;

impl Hair {
    /// Before the character is put elsewhere: its hair goes along in its present shape, at rest,
    /// and so do colliders, rods and blowers of the same character. Long jumps are noticed without
    /// this, see [`HairInertia`](crate::HairInertia).
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
        for_each_strand(&mut hair, |strand, _, history| {
            strand.rest();
            history.positions.clone_from(&strand.positions);
        });
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

    /// Puts every strand into the shape that its bonds hold it to, as without gravity, at rest: after
    /// a cut, or when a game has twisted hair beyond use. Water and bonds stay as they are.
    ///
    /// `commands.entity(hair).queue(Hair::reset)`
    pub fn reset(mut hair: EntityWorldMut<'_>) {
        let influence = hair.world_scope(|world| {
            world.get_resource::<crate::HairDefault<crate::BondInfluence>>().map(|d| d.0)
        });
        let own = hair.get::<crate::BondInfluence>().copied();
        let influence = own.or(influence).unwrap_or_default().as_array();
        for_each_strand(&mut hair, |strand, bonds, history| {
            strand.pose(bonds.joints.iter().map(|joint| joint.relaxed(&influence)));
            history.positions.clone_from(&strand.positions);
        });
    }

    /// Makes the present shape the hair's own: all bonds remember it, closed or not.
    ///
    /// `commands.entity(hair).queue(Hair::restyle)`
    pub fn restyle(mut hair: EntityWorldMut<'_>) {
        for_each_strand(&mut hair, |strand, bonds, _| {
            for (i, joint) in bonds.joints.iter_mut().enumerate() {
                joint.shapes = [strand.darboux(i).xyz(); BondKind::COUNT];
            }
        });
    }
}

fn for_each_strand(
    hair: &mut EntityWorldMut<'_>,
    mut act: impl FnMut(&mut Strand, &mut Bonds, &mut StrandHistory),
) {
    let members: Vec<Entity> = hair.get::<Strands>().into_iter().flat_map(Strands::iter).collect();
    hair.world_scope(|world| {
        for strand in members {
            if let Ok((mut strand, mut bonds, mut history)) = world
                .entity_mut(strand)
                .get_components_mut::<(&mut Strand, &mut Bonds, &mut StrandHistory)>()
            {
                act(&mut strand, &mut bonds, &mut history);
            }
        }
    });
}
