//! A record of each substep of the tick, as input of the kernel. The tick itself is unchanged.

use super::{
    followers::FollowRecord,
    hair::GpuHair,
    record::{
        BlowerRecord, GpuJournal, MAX_BLOWERS, MAX_OBSTACLES, SleepRecord, SubstepRecord,
        unsupported,
    },
    sweeps::SweepRecord,
    targets::TargetQueries,
    treatments::GpuTreatments,
};
use crate::{
    base::{
        schedule::{EffectiveSubstep, EffectiveSubsteps, HairStep},
        setting::Settings,
    },
    forces::{
        contact::{Obstacles, StrandContact},
        environment::{AirDrag, Gravity, Winds, vapour::JET_CORE},
    },
    hair::strand::{Hair, SleepCounts, TickPose},
    keratin::bond::{BondInfluence, Cuticle},
    render::DrawnElsewhere,
    simulation::{
        lod::follow::{Frame, GuideOffsets},
        sleep::{Disturbance, SleepSettings},
    },
    solver::rod::{HairSolver, HairStiffness, SolverMethod, Sweeps},
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
    gravity: Gravity,
    winds: Winds,
    (solver, sweeps, stiffness): (Settings<HairSolver>, Settings<Sweeps>, Settings<HairStiffness>),
    (drag, contact): (Settings<AirDrag>, Settings<StrandContact>),
    (influence, cuticle): (Settings<BondInfluence>, Settings<Cuticle>),
    target_queries: TargetQueries,
    mut hairs: Query<
        (
            Entity,
            &TickPose,
            Option<&Obstacles>,
            &mut GpuJournal,
            Option<&mut GpuTreatments>,
            Option<&mut GpuHair>,
            (Option<&Disturbance>, Option<&DrawnElsewhere>, Option<&mut SleepCounts>),
        ),
        With<Hair>,
    >,
) {
    let gravity = gravity.clamped().0;
    let mut held = target_queries.held();
    for (hair, frame, obstacles, mut journal, treatments, on, rest) in &mut hairs {
        let Some(substep) = substeps.of(hair) else { continue };
        let solids = obstacles.map_or(&[][..], |all| &all.solids);
        let on = on.map(|on| {
            let on = on.into_inner();
            on.unsupported = on.unsupported.or_else(|| unsupported(solids));
            &*on
        });
        // On its way back to the CPU it rests.
        if on.is_some_and(|on| on.is_returning() || on.unsupported.is_some()) {
            continue;
        }
        let is_last = step.index + 1 == step.count;
        let follows = follow_record(&mut journal, frame, &substep, is_last);
        let targets = target_queries.of(hair, &mut held, &mut journal);
        let (disturbance, drawn, sleepers) = rest;
        let sleep = disturbance.map(|disturbance| disturbance.sleep);
        let sleep =
            sleep.filter(|sleep| sleep.seconds.is_finite()).unwrap_or(SleepSettings::never());
        let followed = journal.followed;
        let rest = &mut journal.rest;
        if substep.is_first {
            (rest.wakes, rest.has_begun) = (false, false);
            let (low, high) = drawn.map_or((-Vec3::INFINITY, Vec3::INFINITY), |d| (d.low, d.high));
            // Followers move on their own for a while.
            let follow =
                on.is_some_and(|on| on.has_followers) && !GuideOffsets::are_settled(followed);
            if follow
                || frame.settles()
                || disturbance.is_none_or(|disturbance| disturbance.acts_within(low, high))
            {
                rest.wake();
            }
        }
        if rest.note_targets(&targets, sleep.distance(), sleep.angle())
            || treatments.as_ref().is_some_and(|treatments| treatments.act())
        {
            rest.wake();
        }
        if rest.is_asleep {
            continue;
        }
        if let Some(mut sleepers) = sleepers
            && sleepers.asleep > 0
        {
            *sleepers = SleepCounts { asleep: 0, awake: sleepers.asleep + sleepers.awake };
        }
        let is_first = !core::mem::replace(&mut rest.has_begun, true);
        rest.ticks += u32::from(is_first);
        if rest.wakes {
            rest.disturbed = rest.ticks;
        }
        let sleep = sleep.seconds.is_finite().then_some(SleepRecord {
            tick: rest.ticks,
            wakes: rest.wakes,
            ends: is_last,
            distance: sleep.distance(),
            angle: sleep.angle(),
            seconds: sleep.seconds,
            dt: substep.tick,
        });
        let pose = frame.now();
        let air = winds.seen_from(frame);
        let (solver, stiffness) = (solver.of(hair), stiffness.of(hair));
        // A method that is set in the middle of a tick counts from the next one on.
        let method = on.map_or(solver.method, |on| on.method);
        let sweeps = (method == SolverMethod::Sweeps).then(|| {
            let full = sweeps.of(hair);
            let iterations = substep.iterations(full.iterations);
            SweepRecord { settings: Sweeps { iterations, ..full } }
        });
        let mut record = SubstepRecord {
            dt: substep.dt,
            gravity: pose.direction_in(gravity),
            frame_motion: frame.frame_delta(),
            wind: air.steady_wind().unwrap_or_default() + air.headwind,
            headwind: air.headwind,
            retained: bevy::math::ops::exp(-drag.of(hair).rate * substep.dt),
            influence: influence.of(hair).as_array(),
            bending_length: stiffness.bending_length,
            damping: stiffness.damping,
            torsion: stiffness.torsion,
            skin: contact.of(hair).radius,
            limiter_steps: sweeps.map_or(solver.limiter_steps, |s| s.settings.limiter_steps),
            sweeps,
            cuticle: cuticle.of(hair),
            blowers: (air.blowers.iter().take(MAX_BLOWERS))
                .map(|seen| {
                    let [velocity, spin, center] = seen.moves.parts();
                    BlowerRecord {
                        nozzle: seen.nozzle,
                        aim: seen.aim,
                        strength: seen.blower.strength,
                        drying: seen.blower.drying,
                        velocity,
                        spin,
                        center,
                        core: JET_CORE / pose.size(),
                    }
                })
                .collect(),
            obstacles: solids.iter().take(MAX_OBSTACLES).cloned().collect(),
            notes_before: is_first,
            rests: is_first && frame.settles(),
            shapes: true,
            targets,
            follows,
            sleep,
            ..default()
        };
        if let Some(mut treatments) = treatments {
            treatments.write(&mut record);
        }
        if record.rests {
            journal.unused_spins.rest();
        }
        journal
            .unused_spins
            .pass(record.retained, record.frame_motion.map(|frame_motion| frame_motion.rotation));
        journal.records.push(record);
    }
}
