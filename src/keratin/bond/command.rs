//! Commands on the shape of a hair: reset it, or keep the present one.

use super::{bonds::Bonds, kind::BondKind, settings::BondInfluence};
use crate::{
    base::{
        fault::{FaultKind, HairFault},
        setting::{HairDefault, Ranged},
    },
    hair::{
        strand::{Hair, Strand, StrandHistory, Strands, return_to_cpu},
        worn::{hairs_of, report_no_hair},
    },
};
use bevy::prelude::*;

impl Hair {
    /// Resets every strand to the rest shape of its bonds (its shape without gravity), at rest: after a
    /// camera cut, or when hair is badly tangled. Water and bonds stay as they are.
    ///
    /// `commands.entity(hair).queue(Hair::reset)`, where `hair` may be its wearer too
    pub fn reset(hair: EntityWorldMut<'_>) {
        for_each_strand(hair, "Hair::reset", |strand, bonds, history, influence| {
            strand.pose(bonds.joints.iter().map(|joint| joint.relaxed(influence)));
            history.remember(strand);
        });
    }

    /// Makes the present shape the hair's natural shape: all bonds remember it, closed or not.
    ///
    /// `commands.entity(hair).queue(Hair::restyle)`, where `hair` may be its wearer too
    pub fn restyle(hair: EntityWorldMut<'_>) {
        for_each_strand(hair, "Hair::restyle", |strand, bonds, _, _| {
            bonds.fit(strand);
            for (i, joint) in bonds.joints.iter_mut().enumerate() {
                joint.shapes = [strand.darboux(i).xyz(); BondKind::COUNT];
            }
        });
    }
}

/// The last argument is the influence of each kind of bonds.
fn for_each_strand(
    hair: EntityWorldMut<'_>,
    request: &str,
    mut act: impl FnMut(&mut Strand, &mut Bonds, &mut StrandHistory, &[f32; BondKind::COUNT]),
) {
    let id = hair.id();
    let world = hair.into_world_mut();
    let hairs = hairs_of(world, id);
    if hairs.is_empty() {
        report_no_hair(world, request, id);
    }
    for hair in hairs {
        return_to_cpu(world, hair);
        let default = world.get_resource::<HairDefault<BondInfluence>>().map(|default| default.0);
        let influence = world.get(hair).copied().or(default).unwrap_or_default();
        let influence = influence.clamped().as_array();
        let members: Vec<Entity> =
            world.get::<Strands>(hair).into_iter().flat_map(Strands::iter).collect();
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
            act(&mut data, &mut bonds, &mut history, &influence);
            if let Some(repaired) = repaired {
                world.write_message(HairFault::new(FaultKind::Strand, repaired).of(strand));
            }
        }
    }
}
