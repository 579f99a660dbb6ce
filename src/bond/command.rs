//! What a game may do to a hair's shape at once: put it back, or make the present one its own.

use super::{bonds::Bonds, kind::BondKind, settings::BondInfluence};
use crate::{
    setting::{HairDefault, Ranged},
    strand::{Hair, Strand, StrandHistory, Strands},
};
use bevy::prelude::*;

impl Hair {
    /// Puts every strand into the shape that its bonds hold it to, as without gravity, at rest: after
    /// a cut, or when a game has twisted hair beyond use. Water and bonds stay as they are.
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
            // Somebody may have written one that is not there.
            if let Ok(mut strand) = world.get_entity_mut(strand)
                && let Ok((mut strand, mut bonds, mut history)) =
                    strand.get_components_mut::<(&mut Strand, &mut Bonds, &mut StrandHistory)>()
            {
                act(&mut strand, &mut bonds, &mut history);
            }
        }
    });
}
