//! Followers in the tick: they sleep while their guides do, and move once a tick.

use super::{
    PresentLod,
    choose::{Follower, Guides},
    follow::{Frame, StrandPose},
};
use crate::{
    parallel::{Nanos, for_each},
    rod::{HairSolver, SolverMethod},
    schedule::{EffectiveSubsteps, HairStep},
    setting::Settings,
    strand::{Hair, PerHair, Strand, StrandOf, StrandSleep, TickPose},
};
use bevy::prelude::*;

/// After sleep has been decided: followers sleep while all their guides do.
pub(crate) fn sync_follower_sleep(
    step: Res<HairStep>,
    mut hairs: Query<(&PresentLod, &mut Guides), With<Hair>>,
    mut strands: Query<(&StrandOf, &mut Strand, &mut StrandSleep, &mut Follower)>,
) {
    let mut any = false;
    for (present, mut guides) in &mut hairs {
        let Guides { strands: ahead, awake, thaws, .. } = guides.bypass_change_detection();
        any |= core::mem::take(thaws) || present.followers > 0;
        for (guide, awake) in ahead.iter().zip(awake) {
            *awake = strands.get(*guide).is_ok_and(|(.., sleep, _)| !sleep.is_asleep());
        }
    }
    if !any {
        return;
    }
    let mut per_hair = PerHair::default();
    for (of, mut strand, mut sleep, mut follower) in &mut strands {
        if follower.thaws && !sleep.is_follower() {
            follower.bypass_change_detection().thaws = false;
            if let Ok((_, guides)) = hairs.get(of.0) {
                let seconds = step.dt * step.count as f32;
                let (positions, velocities, _) = strand.bypass_change_detection().motion_parts();
                for (v, p) in velocities.iter_mut().zip(positions) {
                    *v = guides.frame.velocity(*p, seconds);
                }
            }
        }
        if !sleep.is_follower() {
            continue;
        }
        let index = per_hair.index(of.0, || Some(hairs.get(of.0).ok()?.1));
        let Some(guides) = index.map(|i| per_hair.values[i]) else { continue };
        let is_awake = |guide: &(u32, f32)| guides.awake.get(guide.0 as usize) == Some(&true);
        let sleep = sleep.bypass_change_detection();
        let root = strand.positions().first().copied().unwrap_or_default();
        let follower = follower.bypass_change_detection();
        let moves = follower.ties.guides.iter().any(is_awake) || follower.root != root;
        if moves && sleep.is_asleep() {
            sleep.wake_up();
            follower.synced_asleep = false;
        } else if !moves && !sleep.is_asleep() {
            sleep.fall_asleep();
            strand.bypass_change_detection().rest();
            follower.synced_asleep = true;
        }
        follower.root = root;
    }
}

/// At the end of a tick, after the projection: moves followers with their guides. Once a tick is enough
/// for drawing, and costs a sixth of once a substep.
pub(crate) fn move_followers(
    step: Res<HairStep>,
    substeps: EffectiveSubsteps,
    solver: Settings<HairSolver>,
    mut hairs: Query<(Entity, &TickPose, &PresentLod, &mut Guides), With<Hair>>,
    mut strands: Query<(&StrandOf, &mut Strand, &StrandSleep, &mut Follower)>,
) {
    let is_last = step.index + 1 == step.count;
    let mut any = false;
    for (hair, pose, present, mut guides) in &mut hairs {
        let guides = guides.bypass_change_detection();
        if step.index == 0 {
            guides.frame = Frame::default();
        }
        if present.followers == 0 {
            continue;
        }
        any |= is_last;
        if let Some(delta) = pose.frame_delta().filter(|_| substeps.of(hair).is_some()) {
            guides.frame.then(delta.rotation, delta.translation.into());
        }
        for i in 0..if is_last { guides.strands.len() } else { 0 } {
            if guides.awake[i] {
                let strand = strands.get(guides.strands[i]).ok().map(|(_, strand, ..)| strand);
                guides.update_pose(i, strand);
            }
        }
    }
    if !any {
        return;
    }
    let mut per_hair = PerHair::default();
    let mut items = Vec::new();
    for (of, strand, sleep, follower) in &mut strands {
        if sleep.is_follower()
            && !sleep.is_asleep()
            && let Some(index) = per_hair.index(of.0, || {
                // Orientations of directly solved rods have no angular velocity of their own.
                let spins = solver.of(of.0).method == SolverMethod::Sweeps;
                Some((hairs.get(of.0).ok()?.3, spins))
            })
        {
            items.push((index, strand, follower));
        }
    }
    let seconds = step.dt * step.count as f32;
    for_each(&mut items, Nanos(1_000), |(index, strand, follower)| {
        let (guides, has_spins) = per_hair.values[*index];
        let (positions, velocities, orientations, spins) =
            strand.bypass_change_detection().parts_mut();
        let spins = if has_spins { spins } else { &mut [] };
        let mut pose = StrandPose { positions: &mut *positions, velocities, orientations, spins };
        let follower = follower.bypass_change_detection();
        let ties = &mut follower.ties;
        if !ties.follow(&mut pose, |guide| guides.turns(guide), &guides.frame, seconds) {
            // Without guides it translates with its root.
            let translation = positions.first().map_or(Vec3::ZERO, |root| *root - follower.root);
            if translation.is_finite() {
                positions.iter_mut().skip(1).for_each(|p| *p += translation);
            }
        }
    });
}
