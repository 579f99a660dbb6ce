//! Levels are chosen at the start of a tick; the systems that move hair read them.

use super::{
    Follower, Guides, HairBudget, HairEstimate, HairLod, HairScreenShare, LodLevel, PresentLod,
    budget::{Candidate, costs, fit},
    choose::{choose_guides, note_overwritten},
    followers::{move_followers, sync_follower_sleep},
    model,
    release::{release_follower, release_without_follower},
};
use crate::{
    base::{
        fault::{FaultKind, HairFault},
        schedule::{HairStep, HairSystems, HairTick, SubstepLimits, first_substep},
        setting::{self, HairDefault, Ranged, Settings},
    },
    hair::{
        strand::{
            Hair, KinematicStrand, MotionOwner, Regroomed, Strand, StrandOf, Strands,
            keep_required, lacks_strands,
        },
        worn,
    },
    keratin::bond::{BondInfluence, Bonds},
    water::IsWet,
};
use bevy::{ecs::entity::EntityHashSet, prelude::*};

/// Levels of detail of the simulation.
pub struct LodPlugin;

impl Plugin for LodPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        // None until the game sets levels for all hair.
        if !app.world().contains_resource::<HairDefault<HairLod>>() {
            app.insert_resource(HairDefault(HairLod { levels: Vec::new(), ..default() }));
        }
        worn::setting::<HairLod>(app);
        setting::resource::<HairBudget>(app);
        keep_required::<Strand, Follower>(app);
        app.init_resource::<HairEstimate>()
            .register_type::<HairEstimate>()
            .register_type::<LodLevel>()
            .register_type::<HairScreenShare>()
            .register_type::<PresentLod>()
            .register_type::<Follower>()
            .register_type::<Guides>()
            .register_required_components::<Strand, Follower>()
            .register_required_components::<Hair, HairScreenShare>()
            .register_required_components::<Hair, PresentLod>()
            .register_required_components::<Hair, SubstepLimits>()
            .register_required_components::<Hair, Guides>()
            .add_observer(reset_level)
            .add_observer(release_follower)
            .add_observer(release_without_follower)
            .add_systems(
                HairTick,
                (
                    (rebuild_broken, choose, note_overwritten, choose_guides)
                        .chain()
                        .in_set(HairSystems::LevelOfDetail)
                        .run_if(first_substep),
                    sync_follower_sleep.in_set(HairSystems::FollowerSleep).run_if(first_substep),
                    move_followers.in_set(HairSystems::Followers),
                ),
            );
    }
}

/// What was said of the budget.
#[derive(Default)]
struct Reported {
    exceeded: bool,
    left_out: bool,
}

type Rebuilt =
    (Entity, &'static StrandOf, &'static mut Strand, Option<&'static Bonds>, Has<KinematicStrand>);

/// A strand that is written into until it is not finite is put back by its next step. Those of which there is none, or none
/// before their hair freezes, get the pose that their bonds remember.
fn rebuild_broken(
    influence: Settings<BondInfluence>,
    hairs: Query<(Entity, Ref<MotionOwner>), With<Hair>>,
    mut strands: Query<Rebuilt>,
    mut faults: MessageWriter<HairFault>,
) {
    let frozen = hairs.iter().filter(|(_, owner)| **owner == MotionOwner::Frozen);
    let newly: EntityHashSet =
        frozen.filter(|(_, owner)| owner.is_changed()).map(|(hair, _)| hair).collect();
    for (entity, of, mut strand, bonds, is_kinematic) in &mut strands {
        if !strand.is_changed() && !newly.contains(&of.0) {
            continue;
        }
        let is_frozen = || hairs.get(of.0).is_ok_and(|(_, owner)| *owner == MotionOwner::Frozen);
        if strand.is_finite() || !(is_kinematic || is_frozen()) {
            continue;
        }
        let influence = influence.of(of.0).as_array();
        let joints = bonds.map_or(&[][..], |bonds| &bonds.joints);
        let shape = joints.iter().map(|joint| joint.relaxed(&influence));
        let fault = strand.bypass_change_detection().put_back(shape);
        faults.write_batch(fault.map(|fault| fault.of(entity)));
    }
}

/// Hair without levels is simulated in full.
fn reset_level(left: On<Remove, HairLod>, mut hairs: Query<(&mut PresentLod, &mut SubstepLimits)>) {
    if let Ok((mut present, mut limits)) = hairs.get_mut(left.entity) {
        (*present, *limits) = (present.in_full(), default());
    }
}

fn choose(
    step: Res<HairStep>,
    budget: Res<HairBudget>,
    mut estimate: ResMut<HairEstimate>,
    lods: Settings<HairLod>,
    mut hairs: Query<
        (
            (Entity, Has<HairLod>),
            &HairScreenShare,
            (&Strands, Ref<Regroomed>),
            &mut PresentLod,
            &mut SubstepLimits,
            (&MotionOwner, Option<&IsWet>),
        ),
        With<Hair>,
    >,
    strands: Query<&Strand>,
    mut reported: Local<Reported>,
    mut faults: MessageWriter<HairFault>,
) {
    let budget = budget.clamped();
    // Of hair without levels (ms), and the dearest of it that the game has said nothing about.
    let mut fixed = 0.0;
    let mut left_out: Option<(f32, Entity)> = None;
    let mut chosen: Vec<_> = hairs
        .iter_mut()
        .filter_map(|((hair, is_own), share, (members, regroomed), mut present, mut limits, of)| {
            let (owner, is_wet) = (of.0, of.1.is_some_and(|wet| wet.0));
            let mut lod = lods.of(hair);
            if present.segments == 0 || regroomed.is_changed() {
                present.bypass_change_detection().segments =
                    strands.iter_many(members.collection()).map(Strand::edges).sum();
            }
            let segments = present.segments;
            // On the GPU it costs this processor nothing, so nothing is won by making it coarser.
            let is_elsewhere = owner.is_on_gpu() || present.is_leaving;
            if lod.levels.is_empty() {
                let cost = costs(&[], segments, step.count, is_wet).next().unwrap_or(0.0);
                let cost = if is_elsewhere { 0.0 } else { cost };
                fixed += cost;
                if !is_own && left_out.is_none_or(|(most, _)| cost > most) {
                    left_out = Some((cost, hair));
                }
                if present.level > 0 {
                    (*present, *limits) = (present.in_full(), default());
                }
                return None;
            }
            if *owner == MotionOwner::Settling {
                // Frozen strands and followers would not come to rest, but hang as they were planted.
                lod.levels.iter_mut().for_each(|level| level.strands = 1.0);
            }
            let before = present.level.saturating_sub(present.budget_levels);
            let wanted = model::choose(&lod.levels, lod.hysteresis, before, share.0);
            // Hair already made coarser stays so until other hair is clearly less important.
            let held = if present.budget_levels > 0 { 1.0 + lod.hysteresis } else { 1.0 };
            let importance = share.0.max(0.0) * lod.importance / held;
            let costs = match is_elsewhere {
                true => vec![0.0; wanted + 1],
                false => costs(&lod.levels, segments, step.count, is_wet).collect(),
            };
            Some((Candidate { importance, wanted, costs }, lod.levels, present, limits))
        })
        .collect();
    let candidates: Vec<Candidate> = chosen.iter().map(|c| c.0.clone()).collect();
    let levels = fit(&candidates, budget.milliseconds / budget.slowness - fixed);
    let cost_of = |level: &dyn Fn(usize) -> usize| -> f32 {
        let costs = candidates.iter().enumerate().map(|(i, c)| c.costs[level(i)]);
        (fixed + costs.sum::<f32>()) * budget.slowness
    };
    let present = cost_of(&|i| levels[i]);
    estimate.set_if_neq(HairEstimate { unbudgeted: cost_of(&|i| candidates[i].wanted), present });
    let exceeds = present > budget.milliseconds;
    let is_coarser = levels.iter().zip(&candidates).any(|(level, hair)| *level > hair.wanted);
    if let Some((cost, hair)) = left_out.filter(|(cost, _)| *cost > 0.0)
        && (is_coarser || exceeds)
        && !core::mem::replace(&mut reported.left_out, true)
    {
        let message = format!(
            "the budget of {} ms leaves out hair without HairLod, which is simulated in full, for {} ms, while other \
             hair is made coarser: give it HairLod, of no levels if that is meant",
            budget.milliseconds,
            cost * budget.slowness
        );
        faults.write(HairFault::new(FaultKind::Setting, message).of(hair));
    }
    if exceeds && !reported.exceeded {
        let message = format!(
            "the budget of {} ms is too small: at their coarsest levels all hairs take about {present} ms, \
             and are simulated at those all the same",
            budget.milliseconds
        );
        faults.write(HairFault::new(FaultKind::Setting, message));
    }
    reported.exceeded = exceeds;
    for ((candidate, settings, present, limits), level) in chosen.iter_mut().zip(levels) {
        let settings_of = |level: usize| level.checked_sub(1).and_then(|i| settings.get(i));
        let wanted_strands = settings_of(candidate.wanted).map(|l| l.strands);
        let settings = settings_of(level);
        present.set_if_neq(PresentLod {
            level,
            budget_levels: level - candidate.wanted,
            strands: settings.map(|l| l.strands),
            wanted_strands,
            ..**present
        });
        let limits_of =
            |l: &LodLevel| SubstepLimits { substeps: l.substeps, iterations: l.iterations };
        limits.set_if_neq(settings.map_or_else(SubstepLimits::default, limits_of));
    }
}
