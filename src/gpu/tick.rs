//! Hair on the GPU in the tick: where each is from this tick on, and what acts on it there.

use super::{
    compile::{AppDevice, Ready},
    hair::{GpuHair, StaysOnCpu, hand_over},
    hand_back::{STAYS_FOR, fetch_strands, request_return},
    record::GpuJournal,
    residence::{HairGpu, HairResidence, SimulateOn, Unsupported, WhyCpu},
    support::Support,
    treatments::GpuTreatments,
    watch::WrittenStrands,
};
use crate::{
    base::{
        schedule::{HairProcessTime, HairStep},
        setting::{Ranged, Settings},
    },
    forces::contact::HairReach,
    hair::{
        strand::{AskForStrands, Hair, MissedOnGpu, Strand, StrandOf, Strands},
        worn::HairsOf,
    },
    keratin::treatment::{HairTreatment, PermWinding, WindingProgress},
    simulation::lod::PresentLod,
    solver::rod::SolverMethod,
    water::SoakHair,
};
use bevy::{
    ecs::{change_detection::Tick, entity::EntityHashMap, system::SystemChangeTick},
    prelude::*,
};

/// What becomes of a hair in this tick.
pub(super) enum Decision {
    /// It goes to the device.
    Goes(Ready, SolverMethod),
    /// It goes as soon as it has the level of detail that it would have without a budget.
    Waits,
    /// Strands begin to be wound: where they are has to be known.
    Winds,
    /// It returns to the CPU.
    Returns(WhyCpu),
    /// It stays where it is, on the CPU.
    Stays(WhyCpu),
}

/// Ticks between looks at how far roots on a mesh have come, as on the CPU.
const ROOTS_MOVE: u32 = 16;

/// Where each hair is from this tick on. Runs before anything acts on it.
pub(super) fn decide(
    step: Res<HairStep>,
    settings: Res<HairGpu>,
    device: AppDevice,
    asked: Settings<SimulateOn>,
    support: Support,
    mut hairs: Query<
        (
            Entity,
            &HairResidence,
            Option<&mut GpuHair>,
            Option<&mut StaysOnCpu>,
            Option<&Strands>,
            Option<&mut HairReach>,
            Option<&GpuJournal>,
        ),
        With<Hair>,
    >,
    mut written: WrittenStrands,
    (of, of_wearer, now): (Query<&StrandOf>, HairsOf, SystemChangeTick),
    (mut soaks, mut treats): (MessageReader<SoakHair>, MessageReader<HairTreatment>),
    (soaks_missed, treats_missed): (
        Option<ResMut<MissedOnGpu<SoakHair>>>,
        Option<ResMut<MissedOnGpu<HairTreatment>>>,
    ),
) -> Vec<(Entity, Decision)> {
    let hair_of = |target: Entity| of.get(target).map_or(target, |of| of.0);
    let each = |soak: &SoakHair| -> Vec<_> {
        let targets = of_wearer.of(&soak.target).iter();
        targets.map(|&target| (hair_of(target), SoakHair { target, ..*soak })).collect()
    };
    let mut soaked: Vec<_> = soaks.read().flat_map(each).collect();
    // Of a hair as a whole they are no reason to return to the CPU.
    let mut treated: Vec<_> = (treats.read().filter(|treat| of.contains(treat.target)))
        .map(|treat| (hair_of(treat.target), treat.clone()))
        .collect();
    // Where the tick waits for hair that returns, the others are read by the CPU's systems after it has.
    let mut soaks_missed =
        soaks_missed.map_or_else(Vec::new, |mut all| core::mem::take(&mut all.0));
    let mut treats_missed =
        treats_missed.map_or_else(Vec::new, |mut all| core::mem::take(&mut all.0));
    let mut decisions = Vec::new();
    if hairs.iter().all(|(hair, _, on, ..)| on.is_none() && asked.of(hair) == SimulateOn::Cpu) {
        let left = hairs.iter().filter(|(_, at, ..)| **at != HairResidence::default());
        decisions.extend(left.map(|(hair, ..)| (hair, Decision::Stays(WhyCpu::NotAsked))));
        return decisions;
    }
    let wetted: Vec<Entity> = soaked.iter().map(|(hair, _)| *hair).collect();
    let singly: Vec<Entity> = treated.iter().map(|(hair, _)| *hair).collect();
    let of_strands = support.of_strands();
    let present = hairs.iter().filter_map(|(hair, _, on, ..)| Some((hair, on?.at)));
    let present: EntityHashMap<Tick> = present.collect();
    let oldest = present
        .values()
        .copied()
        .reduce(|a, b| if a.is_newer_than(b, now.this_run()) { b } else { a });
    let (written, unwritten) = match oldest {
        Some(oldest) => written.find(oldest, |hair| present.get(&hair).copied()),
        None => default(),
    };
    let seconds = step.dt * step.count as f32;
    let checkpoint = settings.clamped().checkpoint;
    for (hair, residence, on, stays, members, reach, journal) in &mut hairs {
        let wants = asked.of(hair) == SimulateOn::Gpu;
        let missing = || {
            let known = of_strands.get(&hair).copied().or_else(|| support.missing(hair));
            known.map(WhyCpu::Unsupported)
        };
        let Some(mut on) = on else {
            // What is asked of it in this tick is asked of the CPU.
            let is_asked = |all: &[Entity]| all.contains(&hair);
            let why = if !wants {
                Some(WhyCpu::NotAsked)
            } else if is_asked(&wetted) {
                Some(WhyCpu::Unsupported(Unsupported::Water))
            } else if is_asked(&singly) {
                Some(WhyCpu::Unsupported(Unsupported::Treatments))
            } else if let Some(mut stays) = stays
                && stays.0 > 0.0
            {
                stays.0 -= seconds;
                Some(WhyCpu::JustBack)
            } else {
                missing()
            };
            let waits = why == Some(WhyCpu::Unsupported(Unsupported::LevelOfDetail))
                && *residence != HairResidence::Cpu(WhyCpu::TooLarge)
                && support.wants_simulation(hair);
            let decision = match why.map_or_else(|| device.ready(), Err) {
                Ok(ready) => Decision::Goes(ready, support.method(hair)),
                Err(_) if waits && device.ready().is_ok() => Decision::Waits,
                Err(why) => Decision::Stays(why),
            };
            decisions.push((hair, decision));
            continue;
        };
        let on = &mut *on;
        if let Some(unwritten) = unwritten
            && unwritten.is_newer_than(on.at, now.this_run())
            && !written.contains(&hair)
        {
            on.at = unwritten;
        }
        on.ticks += 1;
        on.quiet = on.quiet.saturating_sub(1);
        on.since_checkpoint += seconds;
        if on.is_tied
            && on.ticks.is_multiple_of(ROOTS_MOVE)
            && let Some(mut reach) = reach
        {
            reach.bypass_change_detection().look_again();
        }
        let own = |target: Entity| hair_of(target) == hair;
        if on.is_returning() || !settings.blocking {
            let soaked = soaked.extract_if(.., |(target, _)| *target == hair);
            on.soaked.extend(soaked.map(|(_, soak)| soak));
            let treated = treated.extract_if(.., |(target, _)| *target == hair);
            on.treated.extend(treated.map(|(_, treat)| treat));
        } else {
            on.soaked.extend(soaks_missed.extract_if(.., |soak| own(soak.target)));
            on.treated.extend(treats_missed.extract_if(.., |treat| own(treat.target)));
        }
        if on.is_returning() {
            continue;
        }
        let regroomed = members.is_none_or(|members| members.collection()[..] != on.members[..]);
        let reasons = [
            (!wants, WhyCpu::NotAsked),
            (regroomed, WhyCpu::Unsupported(Unsupported::Regroomed)),
            (written.contains(&hair), WhyCpu::Unsupported(Unsupported::Written)),
            (support.method(hair) != on.method, WhyCpu::Unsupported(Unsupported::OtherSolver)),
            (wetted.contains(&hair), WhyCpu::Unsupported(Unsupported::Water)),
            (singly.contains(&hair), WhyCpu::Unsupported(Unsupported::Treatments)),
            (
                support.held_strands(hair).is_some_and(|held| held != on.held),
                WhyCpu::Unsupported(Unsupported::LevelOfDetail),
            ),
        ];
        let reason = reasons.into_iter().find(|(is_there, _)| *is_there).map(|(_, why)| why);
        let reason = reason.or(on.unsupported.map(WhyCpu::Unsupported));
        if let Some(why) = reason.or_else(missing) {
            let begins = settings.blocking && why == WhyCpu::Unsupported(Unsupported::Winding);
            decisions.push((hair, if begins { Decision::Winds } else { Decision::Returns(why) }));
        } else if checkpoint > 0.0 && on.since_checkpoint >= checkpoint {
            // What sleeps stays as it is.
            let is_asleep = journal.is_some_and(|journal| journal.rest.is_asleep);
            if !(is_asleep && on.is_kept) {
                on.note_checkpoint();
            }
            on.is_kept = is_asleep;
        }
    }
    decisions
}

pub(super) fn follow(In(decisions): In<Vec<(Entity, Decision)>>, world: &mut World) {
    let is_blocking = world.resource::<HairGpu>().blocking;
    for (hair, decision) in decisions {
        let lod = world.get_mut::<PresentLod>(hair);
        let waits = matches!(decision, Decision::Waits);
        let waited = lod.is_some_and(|mut lod| lod.bypass_change_detection().set_leaving(waits));
        let why = match decision {
            Decision::Goes(ready, method) => match hand_over(world, hair, &ready, method) {
                Ok(()) => {
                    tracing::debug!("hair, entity {hair}: simulated on the GPU");
                    continue;
                }
                Err(why) => {
                    // Else the budget would take and let go of it in turn.
                    if waited {
                        world.entity_mut(hair).insert(StaysOnCpu(STAYS_FOR));
                    }
                    why
                }
            },
            Decision::Waits => WhyCpu::Unsupported(Unsupported::LevelOfDetail),
            Decision::Winds => {
                begin_winding(world, hair);
                continue;
            }
            Decision::Returns(why) => {
                request_return(world, hair, why, is_blocking);
                report_reason(hair, why);
                continue;
            }
            Decision::Stays(why) => why,
        };
        let Some(mut residence) = world.get_mut::<HairResidence>(hair) else { continue };
        // What is said while it waits says less than why it came.
        if *residence != HairResidence::Cpu(why) && why != WhyCpu::JustBack {
            *residence = HairResidence::Cpu(why);
            report_reason(hair, why);
        }
    }
}

/// Waits for a hair's strands, and begins to wind those that are to be.
fn begin_winding(world: &mut World, hair: Entity) {
    fetch_strands(world, hair);
    let members = world.get::<Strands>(hair).map(|all| all.collection().to_vec());
    for member in members.unwrap_or_default() {
        let Ok(mut entity) = world.get_entity_mut(member) else { continue };
        let parts = entity.get_components_mut::<(&Strand, &PermWinding, &mut WindingProgress)>();
        if let Ok((strand, settings, mut wound)) = parts
            && wound.waits(strand, settings)
        {
            wound.begin(strand);
        }
    }
}

/// Says once why a hair that is to be on the device is not.
fn report_reason(hair: Entity, why: WhyCpu) {
    match why {
        WhyCpu::NotAsked | WhyCpu::Compiling => {}
        WhyCpu::Broken | WhyCpu::DeviceLost | WhyCpu::NoCompute | WhyCpu::TooLarge => {
            tracing::warn!("hair, entity {hair}, is simulated on the CPU: {why}");
        }
        _ => tracing::info!("hair, entity {hair}, is simulated on the CPU: {why}"),
    }
}

/// Treatments of hair on the device.
pub(super) fn treat(
    step: Res<HairStep>,
    process: Res<HairProcessTime>,
    mut requests: MessageReader<HairTreatment>,
    of: HairsOf,
    mut hairs: Query<(&mut GpuTreatments, &GpuHair)>,
) {
    for request in requests.read() {
        for &target in of.of(&request.target) {
            if let Ok((mut treatments, _)) = hairs.get_mut(target) {
                treatments.push(HairTreatment { target, ..request.clamped() });
            }
        }
    }
    let dt = step.dt * process.clamped().0;
    for (mut treatments, _) in hairs.iter_mut().filter(|(_, on)| !on.is_returning()) {
        treatments.step(dt);
    }
}

/// Answers [`AskForStrands`].
pub(super) fn ask(request: On<AskForStrands>, mut hairs: Query<&mut GpuHair>) {
    if let Ok(mut hair) = hairs.get_mut(request.entity) {
        hair.await_state();
    }
}
