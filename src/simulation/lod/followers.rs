//! Followers in the tick: they sleep while their guides do, and move once a tick.

use super::{
    PresentLod,
    follow::{Frame, StrandPose},
    guides::{Follower, Guides},
};
use crate::{
    base::{
        parallel::{AHEAD, Nanos, for_each_part, in_turn, prefetch, tables},
        schedule::{EffectiveSubsteps, HairStep},
        setting::Settings,
    },
    hair::strand::{
        FollowsHere, HairHere, PerHair, SimulatedHere, Strand, StrandHistory, StrandOf,
        StrandSleep, TickPose,
    },
    solver::rod::{HairSolver, SolverMethod},
};
use bevy::prelude::*;

/// About what a follower takes (ns).
const FOLLOW: Nanos = Nanos(700);

/// How many of a hair's guides are awake.
#[derive(Clone, Copy, PartialEq)]
enum Awake {
    None,
    Some,
    All,
}

impl Awake {
    fn of(guides: &Guides) -> Self {
        match guides.awake.iter().filter(|awake| **awake).count() {
            0 => Self::None,
            some if some < guides.awake.len() => Self::Some,
            _ => Self::All,
        }
    }
}

/// After sleep has been decided: followers sleep while all their guides do, unless something disturbs
/// them. Frozen hair has no guides.
pub(crate) fn sync_follower_sleep(
    step: Res<HairStep>,
    mut hairs: Query<(&PresentLod, &mut Guides), HairHere>,
    mut simulated: Query<(&StrandOf, &mut Strand, &StrandSleep, &mut Follower), SimulatedHere>,
    mut followers: Query<
        (&StrandOf, &mut Strand, &mut StrandSleep, &mut Follower, &mut StrandHistory),
        FollowsHere,
    >,
) {
    let (mut any, mut thaw) = (false, false);
    for (present, mut guides) in &mut hairs {
        let Guides { strands: ahead, awake, thaws, .. } = guides.bypass_change_detection();
        thaw |= core::mem::take(thaws);
        any |= present.followers > 0;
        for (guide, awake) in ahead.iter().zip(awake) {
            *awake = simulated.get(*guide).is_ok_and(|(.., sleep, _)| !sleep.is_asleep());
        }
    }
    if thaw {
        let seconds = step.dt * step.count as f32;
        for (of, mut strand, _, mut follower) in &mut simulated {
            if !core::mem::take(&mut follower.bypass_change_detection().thaws) {
                continue;
            }
            if let Ok((_, guides)) = hairs.get(of.0) {
                let (positions, velocities, _) = strand.bypass_change_detection().motion_parts();
                for (v, p) in velocities.iter_mut().zip(positions) {
                    *v = guides.frame.velocity(*p, seconds);
                }
            }
        }
    }
    if !any {
        return;
    }
    let mut per_hair = PerHair::default();
    for (of, mut strand, mut sleep, mut follower, mut history) in &mut followers {
        let index = per_hair.index(of.0, || {
            let guides = hairs.get(of.0).ok()?.1;
            Some((Awake::of(guides), guides))
        });
        let Some((awake, guides)) = index.map(|i| per_hair.values[i]) else { continue };
        let sleep = sleep.bypass_change_detection();
        // The strand itself is not looked at where this decides.
        let is_awake = |guide: &(u32, f32)| guides.awake.get(guide.0 as usize) == Some(&true);
        let is_written = strand.is_changed();
        if is_written {
            follower.bypass_change_detection().root =
                strand.positions().first().copied().unwrap_or_default();
        }
        let moves = sleep.take_disturbed()
            || is_written
            || match awake {
                Awake::None => false,
                Awake::Some => follower.offsets.guides.iter().any(is_awake),
                Awake::All => true,
            };
        if moves && sleep.is_asleep() {
            sleep.wake_up();
            follower.bypass_change_detection().synced_asleep = false;
        } else if !moves && !sleep.is_asleep() {
            sleep.fall_asleep();
            let strand = strand.bypass_change_detection();
            strand.rest();
            history.bypass_change_detection().remember(strand);
            follower.bypass_change_detection().synced_asleep = true;
        }
    }
}

/// A follower to be moved, with the index of its hair's guides.
type Moved<'a> = (usize, &'a mut Strand, &'a mut StrandHistory, &'a mut Follower);

/// At the end of a tick, after the projection: moves followers with their guides. Once a tick is enough
/// for drawing, and costs a sixth of once a substep.
pub(crate) fn move_followers(
    step: Res<HairStep>,
    substeps: EffectiveSubsteps,
    solver: Settings<HairSolver>,
    mut hairs: Query<(Entity, &TickPose, &PresentLod, &mut Guides), HairHere>,
    simulated: Query<&Strand, SimulatedHere>,
    mut followers: Query<
        (&StrandOf, &StrandSleep, &mut Strand, &mut StrandHistory, &mut Follower),
        FollowsHere,
    >,
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
                guides.update_pose(i, simulated.get(guides.strands[i]).ok());
            }
        }
    }
    if !any {
        return;
    }
    let seconds = step.dt * step.count as f32;
    let guides_of = |hair: Entity| {
        // Orientations of directly solved rods have no angular velocity of their own.
        let spins = solver.of(hair).method == SolverMethod::Sweeps;
        Some((hairs.get(hair).ok()?.3, spins))
    };
    let ahead = |(_, strand, history, follower): &Moved<'_>| {
        strand.prefetch();
        prefetch(&history.positions);
        follower.offsets.prefetch();
    };
    for_each_part(FOLLOW, tables(&mut followers), Vec::new, |items, rows| {
        let mut per_hair = PerHair::default();
        for (of, sleep, strand, history, follower) in rows {
            if !sleep.is_asleep()
                && let Some(guides) = per_hair.index(of.0, || guides_of(of.0))
            {
                items.push((guides, strand, history, follower));
            }
        }
        in_turn(items, AHEAD, ahead, |(guides, strand, history, follower)| {
            let (guides, has_spins) = per_hair.values[*guides];
            follow_guides(guides, has_spins, strand, history, follower, seconds);
        });
        items.clear();
    });
}

/// Moves one follower in a tick of so many seconds.
fn follow_guides(
    guides: &Guides,
    has_spins: bool,
    strand: &mut Strand,
    history: &mut StrandHistory,
    follower: &mut Follower,
    seconds: f32,
) {
    if history.positions.len() != strand.nodes() {
        history.remember(strand);
    }
    let root_before = follower.root;
    let (positions, velocities, orientations, spins) = strand.parts_mut();
    let spins = if has_spins { spins } else { &mut [] };
    let before = &mut history.positions[..];
    let mut pose =
        StrandPose { positions: &mut *positions, before, velocities, orientations, spins };
    follower.root = pose.positions.first().copied().unwrap_or_default();
    if !follower.offsets.follow(&mut pose, |guide| guides.turns(guide), &guides.frame, seconds) {
        history.positions.copy_from_slice(positions);
        // Without guides it translates with its root.
        let way = follower.root - root_before;
        if way.is_finite() {
            positions.iter_mut().skip(1).for_each(|p| *p += way);
        }
    }
    // It has been moved earlier in the tick.
    if let Some(root) = history.positions.first_mut() {
        *root = root_before;
    }
    strand.step_succeeded();
}
