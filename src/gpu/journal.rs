//! A record of each substep of the tick, as input of the kernel. The tick itself is unchanged.

use super::record::{BlowerRecord, MOST_BLOWERS, MOST_OBSTACLES, SubstepRecord};
use crate::{
    bond::{BondInfluence, Cuticle},
    contact::{LockContact, Obstacles},
    environment::{AirDrag, HairGravity, Winds},
    rod::{HairSolver, HairStiffness, SolverMethod, obstacle::Solid},
    schedule::{EffectiveSubsteps, HairSystems, HairTick},
    setting::{Ranged, Settings},
    strand::{Hair, StrandModel, TickPose},
    water::WaterVolume,
};
use bevy::prelude::*;

/// The substeps of a hair, in their order. Component of a [`Hair`]; filled by the tick, emptied by
/// whoever runs them.
#[derive(Component, Clone, Debug, Default)]
pub struct GpuJournal {
    /// The substeps.
    pub records: Vec<SubstepRecord>,
    /// The last effect on the hair that a record cannot express.
    pub missing: Option<&'static str>,
}

/// Writes [`GpuJournal`]s.
#[derive(Clone, Copy, Debug, Default)]
pub struct GpuJournalPlugin;

impl Plugin for GpuJournalPlugin {
    fn build(&self, app: &mut App) {
        app.add_systems(HairTick, write_journals.in_set(HairSystems::Rods));
    }
}

fn write_journals(
    substeps: EffectiveSubsteps,
    gravity: Res<HairGravity>,
    winds: Winds,
    (model, solver): (Settings<StrandModel>, Settings<HairSolver>),
    (stiffness, drag): (Settings<HairStiffness>, Settings<AirDrag>),
    (influence, cuticle): (Settings<BondInfluence>, Settings<Cuticle>),
    contact: Settings<LockContact>,
    volumes: Query<(), With<WaterVolume>>,
    mut hairs: Query<(Entity, &TickPose, Option<&Obstacles>, &mut GpuJournal), With<Hair>>,
) {
    let gravity = gravity.clamped().0;
    for (hair, frame, obstacles, mut journal) in &mut hairs {
        let Some(substep) = substeps.of(hair) else { continue };
        let (pose, contact, solver) = (frame.now(), contact.of(hair), solver.of(hair));
        let air = winds.seen_from(pose);
        let solids = obstacles.map_or(&[][..], |all| &all.solids);
        let reasons = [
            (model.of(hair) == StrandModel::MassSpring, "springs"),
            (solver.method == SolverMethod::Sweeps, "the paper's projections"),
            (contact.radius > 0.0 && contact.strength > 0.0, "contact between strands"),
            (air.steady_wind().is_none(), "gusts or wind zones"),
            (air.blowers.len() > MOST_BLOWERS, "more blowers than four"),
            (solids.len() > MOST_OBSTACLES, "more colliders than 64"),
            (!volumes.is_empty(), "water volumes"),
            (
                solids.iter().any(|o| matches!(o.solid, Solid::Placed(_))),
                "colliders other than planes, capsules and cylinders",
            ),
        ];
        let missing = reasons.iter().find(|(is_there, _)| *is_there).map(|(_, what)| *what);
        if missing.is_some() {
            journal.missing = missing;
        }
        let stiffness = stiffness.of(hair);
        journal.records.push(SubstepRecord {
            dt: substep.dt,
            gravity: pose.direction_in(gravity),
            carry: frame.frame_delta(),
            wind: air.steady_wind().unwrap_or_default(),
            keep: bevy::math::ops::exp(-drag.of(hair).rate * substep.dt),
            influence: influence.of(hair).as_array(),
            change: [0.0; 4],
            share: [0.0; 4],
            bending_length: stiffness.bending_length,
            damping: stiffness.damping,
            skin: contact.radius,
            limiter_steps: solver.limiter_steps,
            cuticle: cuticle.of(hair),
            blowers: (air.blowers.iter().take(MOST_BLOWERS))
                .map(|seen| BlowerRecord {
                    nozzle: seen.nozzle,
                    aim: seen.aim,
                    strength: seen.blower.strength,
                    drying: seen.blower.drying,
                })
                .collect(),
            obstacles: solids.iter().take(MOST_OBSTACLES).cloned().collect(),
            notes_before: substep.is_first,
            rests: false,
            shapes: true,
        });
    }
}
