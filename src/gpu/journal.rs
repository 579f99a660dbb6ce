//! A record of each substep of the tick, as input of the kernel. The tick itself is unchanged.

use super::{
    followers::FollowRecord,
    hair::GpuHair,
    led::Leading,
    record::{BlowerRecord, GpuJournal, MAX_BLOWERS, MAX_OBSTACLES, SubstepRecord},
    treatments::GpuTreatments,
};
use crate::{
    bond::{BondInfluence, Cuticle},
    contact::{LockContact, Obstacles},
    environment::{AirDrag, HairGravity, Winds},
    lod::follow::Frame,
    rod::{HairSolver, HairStiffness},
    schedule::{EffectiveSubstep, EffectiveSubsteps, HairStep},
    setting::{Ranged, Settings},
    strand::{Hair, TickPose},
};
use bevy::prelude::*;

/// How followers move, in the tick's last substep.
fn follow_record(
    journal: &mut GpuJournal,
    pose: &TickPose,
    substep: &EffectiveSubstep,
    is_last: bool,
) -> Option<FollowRecord> {
    if substep.is_first {
        journal.frame = Frame::default();
    }
    if let Some(delta) = pose.frame_delta() {
        journal.frame.then(delta.rotation, delta.translation.into());
    }
    is_last.then(|| {
        journal.followed += substep.tick;
        let (seconds, since) = (substep.tick, journal.followed);
        FollowRecord { seconds, frame: journal.frame.motion(), since }
    })
}

/// Writes [`GpuJournal`]s.
pub(super) fn write_journals(
    (step, substeps): (Res<HairStep>, EffectiveSubsteps),
    gravity: Res<HairGravity>,
    winds: Winds,
    (solver, stiffness): (Settings<HairSolver>, Settings<HairStiffness>),
    (drag, contact): (Settings<AirDrag>, Settings<LockContact>),
    (influence, cuticle): (Settings<BondInfluence>, Settings<Cuticle>),
    leading: Leading,
    mut hairs: Query<
        (
            Entity,
            &TickPose,
            Option<&Obstacles>,
            &mut GpuJournal,
            Option<&mut GpuTreatments>,
            Option<&GpuHair>,
        ),
        With<Hair>,
    >,
) {
    let gravity = gravity.clamped().0;
    let mut held = leading.held();
    for (hair, frame, obstacles, mut journal, treatments, on) in &mut hairs {
        // On its way back to the CPU it rests.
        if on.is_some_and(GpuHair::is_returning) {
            continue;
        }
        let Some(substep) = substeps.of(hair) else { continue };
        let pose = frame.now();
        let air = winds.seen_from(pose);
        let solids = obstacles.map_or(&[][..], |all| &all.solids);
        let stiffness = stiffness.of(hair);
        let mut record = SubstepRecord {
            dt: substep.dt,
            gravity: pose.direction_in(gravity),
            carry: frame.frame_delta(),
            wind: air.steady_wind().unwrap_or_default(),
            keep: bevy::math::ops::exp(-drag.of(hair).rate * substep.dt),
            influence: influence.of(hair).as_array(),
            bending_length: stiffness.bending_length,
            damping: stiffness.damping,
            skin: contact.of(hair).radius,
            limiter_steps: solver.of(hair).limiter_steps,
            cuticle: cuticle.of(hair),
            blowers: (air.blowers.iter().take(MAX_BLOWERS))
                .map(|seen| BlowerRecord {
                    nozzle: seen.nozzle,
                    aim: seen.aim,
                    strength: seen.blower.strength,
                    drying: seen.blower.drying,
                })
                .collect(),
            obstacles: solids.iter().take(MAX_OBSTACLES).cloned().collect(),
            notes_before: substep.is_first,
            rests: substep.is_first && frame.has_jumped(),
            shapes: true,
            led: leading.of(hair, &mut held, &mut journal),
            follows: follow_record(&mut journal, frame, &substep, step.index + 1 == step.count),
            ..default()
        };
        if let Some(mut treatments) = treatments {
            treatments.write(&mut record);
        }
        journal.records.push(record);
    }
}
