//! Commands on the shape of a hair: reset it, or keep the present one.

use super::{bonds::Bonds, kind::BondKind, settings::BondInfluence};
use crate::{
    base::{
        fault::{FaultKind, HairFault},
        setting::{HairDefault, Ranged},
    },
    hair::strand::{Hair, Strand, StrandHistory, Strands, return_to_cpu},
};
use bevy::prelude::*;

impl Hair {
    /// Resets every strand to the rest shape of its bonds (its shape without gravity), at rest: after a
    /// camera cut, or when hair is badly tangled. Water and bonds stay as they are.
    ///
    /// `commands.entity(hair).queue(Hair::reset)`
    pub fn reset(mut hair: EntityWorldMut<'_>) {
        let default = hair.world_scope(|world| {
            world.get_resource::<HairDefault<BondInfluence>>().map(|default| default.0)
        });
        let influence = hair.get().copied().or(default).unwrap_or_default();
        let influence = influence.clamped().as_array();
        for_each_strand(&mut hair, |strand, bonds, history| {
            strand.pose(bonds.joints.iter().map(|joint| joint.relaxed(&influence)));
            history.remember(strand);
        });
    }

    /// Makes the present shape the hair's natural shape: all bonds remember it, closed or not.
    ///
    /// `commands.entity(hair).queue(Hair::restyle)`
    pub fn restyle(mut hair: EntityWorldMut<'_>) {
        for_each_strand(&mut hair, |strand, bonds, _| {
            bonds.fit(strand);
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
    let id = hair.id();
    hair.world_scope(|world| return_to_cpu(world, id));
    let members: Vec<Entity> = hair.get::<Strands>().into_iter().flat_map(Strands::iter).collect();
    hair.world_scope(|world| {
        for strand in members {
            // User code may have listed one that does not exist.
            let Ok(mut entity) = world.get_entity_mut(strand) else { continue };
            let Ok((mut data, mut bonds, mut history)) =
                entity.get_components_mut::<(&mut Strand, &mut Bonds, &mut StrandHistory)>()
            else {
                continue;
            };
            // User code may have written to it since the last tick.
            let repaired = data.repair();
            act(&mut data, &mut bonds, &mut history);
            if let Some(repaired) = repaired {
                world.write_message(HairFault::new(FaultKind::Strand, repaired).of(strand));
            }
        }
    });
}
