//! Ties gather and hold their strands in `Interaction`.

use super::{
    HairTie, HairTied, TieHair, TieProgress, Tied, TiedStrands,
    model::{Gathering, ball_through, in_disc, on_the_way},
};
use crate::{
    base::{
        fault::{FaultKind, HairFault},
        schedule::{HairStep, HairSystems, HairTick},
        setting::{self, Ranged},
    },
    hair::{
        strand::{
            HeldNodes, HeldNodesState, OnGpu, Strand, StrandOf, Strands, TickPose, keep_required,
            lacks_strands,
        },
        worn::HairsOf,
    },
    hairdo::region::StrandRegion,
    keratin::treatment::WoundOn,
};
use bevy::{ecs::entity::EntityHashMap, prelude::*};

/// Hair ties.
#[derive(Clone, Copy, Debug, Default)]
pub struct TiePlugin;

impl Plugin for TiePlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        setting::component::<HairTie>(app);
        keep_required::<HairTie, TickPose>(app);
        app.register_type::<Tied>()
            .register_type::<TiedStrands>()
            .register_type::<TieProgress>()
            .register_type::<StrandRegion>()
            .register_type::<TieHair>()
            .register_type::<HairTied>()
            .add_observer(tie)
            .add_observer(release)
            .add_observer(release_all)
            .add_systems(HairTick, (begin, hold).chain().in_set(HairSystems::Ties));
    }
}

/// Marks the strands of a region as tied.
fn tie(
    request: On<TieHair>,
    (hairs, of): (Query<&Strands>, HairsOf),
    ties: Query<(), With<HairTie>>,
    strands: Query<(&Strand, Option<&Tied>)>,
    mut commands: Commands,
    mut faults: MessageWriter<HairFault>,
) {
    let TieHair { hair, tie, region } = *request;
    if !ties.contains(tie) {
        let message = format!("{tie} of TieHair has no HairTie: no strand is tied");
        faults.write(HairFault::new(FaultKind::NoTarget, message).of(hair));
        return;
    }
    if let Some(wrong) = region.wrong() {
        let message = format!("TieHair of a region above {wrong}: no strand is tied");
        faults.write(HairFault::new(FaultKind::Setting, message).of(hair));
        return;
    }
    for &hair in of.of(&hair) {
        let Ok(members) = hairs.get(hair) else {
            faults.write(of.no_target("TieHair", hair));
            continue;
        };
        let is_taken = |member: &Entity| {
            strands.get(*member).is_ok_and(|(strand, tied)| {
                strand.positions().first().is_some_and(|root| region.contains(*root))
                    && tied.is_none_or(|tied| tied.0 != tie)
            })
        };
        let mut taken = members.iter().filter(is_taken).peekable();
        if taken.peek().is_none() {
            commands.trigger(HairTied { hair, tie, strands: 0, too_short: 0 });
        }
        for member in taken {
            commands.entity(member).try_insert((Tied(tie), TieProgress::default()));
        }
    }
}

/// Chooses the places of strands that wait to be tied.
fn begin(
    hairs: Query<(&TickPose, &Strands)>,
    ties: Query<(&HairTie, &TickPose)>,
    all: Query<&Strand>,
    mut strands: Query<
        (Entity, &StrandOf, &Tied, &Strand, &mut TieProgress),
        (Without<WoundOn>, Without<OnGpu>),
    >,
    mut commands: Commands,
) {
    let mut waiting: Vec<((Entity, Entity), Entity)> = strands
        .iter()
        .filter(|(.., progress)| progress.waits())
        .map(|(strand, of, tied, ..)| ((of.0, tied.0), strand))
        .collect();
    if waiting.is_empty() {
        return;
    }
    // In the order of the hair's strands, which does not depend on archetype tables.
    let mut places = EntityHashMap::<usize>::default();
    for ((hair, _), _) in &waiting {
        if let Ok((_, members)) = hairs.get(*hair) {
            places.extend(members.iter().zip(0..));
        }
    }
    waiting.sort_by_key(|(pair, strand)| (*pair, places.get(strand).copied()));
    for group in waiting.chunk_by(|a, b| a.0 == b.0) {
        let (hair, tie) = group[0].0;
        let (Ok((pose, members)), Ok((ring, at))) = (hairs.get(hair), ties.get(tie)) else {
            continue;
        };
        let (pose, at, ring) = (pose.now(), at.now(), ring.clamped());
        let root = |strand: Entity| all.get(strand).ok()?.positions().first().copied();
        let roots: Vec<Vec3> = members.iter().filter_map(root).collect();
        let center = pose.point_in(at.translation);
        let axis = pose.direction_in(at.direction_out(Vec3::Y)).normalize_or(Vec3::Y);
        let mean = roots.iter().sum::<Vec3>() / roots.len().max(1) as f32;
        let (middle, radius) = ball_through(&roots).unwrap_or((mean, 0.0));
        let crown = (mean - middle).normalize_or_zero();
        let gathering = Gathering { middle, radius, crown, axis };
        let own: Vec<Vec3> =
            group.iter().map(|(_, strand)| root(*strand).unwrap_or(center)).collect();
        let to_ring = |v: Vec3| at.direction_in(pose.direction_out(v));
        let azimuths: Vec<f32> = own
            .iter()
            .map(|root| {
                let from = to_ring(*root - center);
                bevy::math::ops::atan2(from.z, from.x)
            })
            .collect();
        let across = in_disc(&azimuths, ring.radius);
        let (mut tied, mut too_short) = (0, 0);
        for (((_, entity), root), [x, z]) in group.iter().zip(own).zip(across) {
            let Ok((.., strand, mut progress)) = strands.get_mut(*entity) else { continue };
            let through = pose.point_in(at.point_out(Vec3::new(x, 0.0, z)));
            match gathering.held(root, through, strand.rest_lengths()) {
                Some((node, place)) => {
                    let start = strand.positions()[node as usize];
                    let place = at.point_in(pose.point_out(place));
                    let side = gathering.side(root);
                    *progress = TieProgress { progress: 0.0, node, place, start, middle, side };
                    tied += 1;
                }
                None => {
                    commands.entity(*entity).remove::<Tied>();
                    too_short += 1;
                }
            }
        }
        commands.trigger(HairTied { hair, tie, strands: tied, too_short });
    }
}

/// Leads strands to their ties, and holds them there.
fn hold(
    step: Res<HairStep>,
    hairs: Query<&TickPose>,
    ties: Query<(&HairTie, &TickPose)>,
    mut strands: Query<
        (&StrandOf, &Strand, &Tied, &mut TieProgress, &mut HeldNodes, &mut HeldNodesState),
        Without<WoundOn>,
    >,
) {
    for (of, strand, tied, mut tie, mut held, mut state) in &mut strands {
        let (Ok(hair), Ok((ring, at))) = (hairs.get(of.0), ties.get(tied.0)) else { continue };
        if tie.waits() {
            continue;
        }
        let place = hair.now().point_in(at.now().point_out(tie.place));
        let place = if tie.progress < 1.0 {
            let tie = tie.bypass_change_detection();
            let seconds = ring.clamped().seconds.max(step.dt);
            tie.progress = (tie.progress + step.dt / seconds).min(1.0);
            on_the_way((tie.middle, tie.side), tie.start, place, tie.progress)
        } else {
            place
        };
        state.bypass_change_detection().is_led = true;
        let node = tie.node as usize;
        let (Some(root), true) = (strand.positions().first(), node < strand.nodes()) else {
            continue;
        };
        let reach: f32 = strand.rest_lengths()[..node].iter().sum();
        let place = *root + (place - *root).clamp_length_max(reach);
        if held.targets.len() != node + 1 || held.targets[..node].iter().any(Option::is_some) {
            held.targets = vec![None; node + 1];
        }
        // Level of detail asks whether a strand is held, not where.
        held.bypass_change_detection().targets[node] = Some(place);
    }
}

/// Releases a strand that leaves its tie for any reason.
fn release(
    left: On<Remove, Tied>,
    mut strands: Query<(&mut TieProgress, &mut HeldNodes, &mut HeldNodesState)>,
) {
    if let Ok((mut tie, mut held, mut state)) = strands.get_mut(left.entity) {
        held.targets.clear();
        state.is_led = false;
        *tie = default();
    }
}

/// Releases the strands of an entity that has lost its [`HairTie`].
fn release_all(gone: On<Remove, HairTie>, ties: Query<&TiedStrands>, mut commands: Commands) {
    for strand in ties.get(gone.entity).iter().flat_map(|tied| tied.iter()) {
        commands.entity(strand).try_remove::<Tied>();
    }
}
