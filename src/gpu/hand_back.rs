//! Hair returns to the CPU from the GPU, and what else comes from there: reports, states that were asked
//! for.

use super::{
    compile::Compiled,
    fingerprint::Fingerprint,
    hair::{GpuHair, StaysOnCpu},
    layout::{Contents, StrandState},
    record::GpuJournal,
    residence::{HairResidence, Unsupported, WhyCpu},
    shared::{Link, Measured},
    sweeps::UnusedSpins,
    treatments::GpuTreatments,
};
use crate::{
    base::fault::{FaultKind, HairFault},
    hair::strand::{
        MotionOwner, OnGpu, Settling, SleepCounts, Strand, StrandHistory, StrandSleep,
        StrandsArrived,
    },
    keratin::{bond::Bonds, treatment::Treatments},
    render::DrawnElsewhere,
    simulation::{
        lod::{Follower, Guides, PresentLod},
        sleep::Disturbance,
    },
    water::Moisture,
};
use bevy::{
    ecs::{change_detection::ComponentTicks, entity_disabling::Disabled},
    prelude::*,
    render::{render_resource::PollType, renderer::RenderDevice},
};

/// Ticks for which a strand's fault is not reported again, as on the CPU.
const REPORT_COOLDOWN: u32 = 60;

/// Seconds for which hair that has returned stays.
pub(super) const STAYS_FOR: f32 = 1.0;

/// Returns a hair to the CPU as soon as its state is there.
pub(super) fn request_return(world: &mut World, hair: Entity, why: WhyCpu, is_blocking: bool) {
    if is_blocking {
        return return_now(world, hair, why);
    }
    let Some(mut gpu) = world.get_mut::<GpuHair>(hair).filter(|gpu| !gpu.is_returning()) else {
        return;
    };
    let number = gpu.request();
    gpu.returns = Some((why, number));
    let mut entity = world.entity_mut(hair);
    if let Some(mut drawn) = entity.get_mut::<DrawnElsewhere>() {
        drawn.rests = true;
    }
    entity.insert(HairResidence::Returning(why));
}

/// Waits for the device and returns a hair to the CPU.
pub(super) fn return_now(world: &mut World, hair: Entity, why: WhyCpu) {
    let Some(link) = world.get::<GpuHair>(hair).map(|gpu| gpu.link.clone()) else { return };
    let records = world.get_mut::<GpuJournal>(hair);
    let mut records = records.map_or_else(Vec::new, |mut all| core::mem::take(&mut all.records));
    let state = {
        let mut shared = link.lock();
        shared.pending.append(&mut records);
        shared.run_pending();
        shared.strands.read_contents(&shared.device, &shared.queue)
    };
    hand_back(world, hair, state, why);
}

/// Waits for the GPU and puts the present state of hair that is simulated there into its
/// [`Strand`]s and [`Bonds`], which are otherwise as they were handed over. The hair stays there. Returns
/// whether it was there.
///
/// For tests and tools: a game asks by [`CaptureHairdo`](crate::CaptureHairdo), which waits for nothing.
pub fn fetch_strands(world: &mut World, hair: Entity) -> bool {
    let records = world.get_mut::<GpuJournal>(hair);
    let mut records = records.map_or_else(Vec::new, |mut all| core::mem::take(&mut all.records));
    let Some(mut gpu) = world.get_entity_mut(hair).ok().and_then(|mut e| e.take::<GpuHair>())
    else {
        return false;
    };
    let state = {
        let mut shared = gpu.link.lock();
        shared.pending.append(&mut records);
        shared.run_pending();
        shared.strands.read_contents(&shared.device, &shared.queue)
    };
    if let Some(state) = state {
        let unused = take_unused(world, hair);
        write_back(world, &mut gpu, &state, unused);
    }
    world.entity_mut(hair).insert(gpu);
    true
}

/// Hands a hair back in this state; without one in that of its last checkpoint.
fn hand_back(world: &mut World, hair: Entity, state: Option<Contents>, why: WhyCpu) {
    let Ok(mut entity) = world.get_entity_mut(hair) else { return };
    let Some(mut gpu) = entity.take::<GpuHair>() else { return };
    let acting = entity.take::<GpuTreatments>().map(GpuTreatments::into_acting);
    let (followed, unused) = entity
        .get::<GpuJournal>()
        .map_or_else(Default::default, |journal| (journal.followed, journal.unused_spins));
    entity.remove::<(GpuJournal, OnGpu, Disturbance, DrawnElsewhere)>();
    // Where its level has changed it goes back as soon as strands are guides and followers anew.
    let goes_back = why == WhyCpu::Unsupported(Unsupported::LevelOfDetail);
    let stays_not = goes_back || why == WhyCpu::Unsupported(Unsupported::OtherSolver);
    let stays = if stays_not { 0.0 } else { STAYS_FOR };
    let owner = match entity.contains::<Settling>() {
        true => MotionOwner::Settling,
        false => MotionOwner::Simulated,
    };
    entity.insert((HairResidence::Cpu(why), StaysOnCpu(stays), owner));
    if let Some(mut lod) = entity.get_mut::<PresentLod>() {
        lod.bypass_change_detection().set_leaving(goes_back);
    }
    if let Some(mut guides) = entity.get_mut::<Guides>() {
        guides.bypass_change_detection().look_again();
    }
    if let Some(state) = state.or_else(|| gpu.checkpoint.take()) {
        write_back(world, &mut gpu, &state, unused);
    }
    for member in &gpu.members {
        let Ok(mut strand) = world.get_entity_mut(*member) else { continue };
        strand.remove::<OnGpu>();
        if gpu.ticks > 0
            && let Some(mut sleep) = strand.get_mut::<StrandSleep>()
        {
            sleep.bypass_change_detection().wake_up();
        }
        let root = strand.get::<Strand>().and_then(|strand| strand.positions().first().copied());
        if strand.get::<StrandSleep>().is_some_and(StrandSleep::is_follower)
            && let (Some(root), Some(mut follower)) = (root, strand.get_mut::<Follower>())
        {
            follower.bypass_change_detection().pass(followed, root);
        }
        if let Some(mut treatments) = strand.get_mut::<Treatments>()
            && let Some(acting) = &acting
        {
            treatments.bypass_change_detection().acting_mut().extend_from_slice(acting);
        }
    }
    // It has not been tied on the GPU.
    #[cfg(feature = "groom")]
    if why == WhyCpu::Unsupported(Unsupported::MovingRoots) {
        use crate::authoring::attach::{RootsOnBones, RootsOnMesh};
        world.get_mut::<RootsOnMesh>(hair).into_iter().for_each(|mut roots| roots.set_changed());
        world.get_mut::<RootsOnBones>(hair).into_iter().for_each(|mut roots| roots.set_changed());
    }
    world.write_message_batch(gpu.soaked);
    world.write_message_batch(gpu.treated);
    if gpu.awaited.is_some() {
        world.trigger(StrandsArrived { entity: hair });
        world.flush();
    }
}

/// What has become of angular velocities since the strands last had a state.
fn take_unused(world: &mut World, hair: Entity) -> UnusedSpins {
    let journal = world.get_mut::<GpuJournal>(hair);
    journal.map_or_else(default, |mut journal| core::mem::take(&mut journal.unused_spins))
}

/// Puts a state into the strands. What the game has written stays: a pose whole, with its velocities;
/// velocities alone; bonds.
fn write_back(world: &mut World, gpu: &mut GpuHair, state: &Contents, unused: UnusedSpins) {
    let link = gpu.link.clone();
    let layout = &*link.layout;
    let now = world.change_tick();
    let is_tied = gpu.is_tied;
    if gpu.fingerprints.is_empty() {
        gpu.fingerprints = link.lock().strands.take_fingerprints();
    }
    for (index, member) in gpu.members.iter().enumerate() {
        let Ok(mut entity) = world.get_entity_mut(*member) else { continue };
        let ticks = |ticks: Option<ComponentTicks>| {
            ticks.is_some_and(|ticks| ticks.is_changed(gpu.at, now))
        };
        let written = ticks(entity.get_change_ticks::<Strand>());
        let (bonds_written, water_written) = (
            ticks(entity.get_change_ticks::<Bonds>()),
            ticks(entity.get_change_ticks::<Moisture>()),
        );
        let Ok((mut strand, mut bonds, mut history)) =
            entity.get_components_mut::<(&mut Strand, &mut Bonds, &mut StrandHistory)>()
        else {
            continue;
        };
        if strand.nodes() != layout.nodes(index) {
            continue;
        }
        let own = state.get(layout, index);
        let fingerprint = |strand: &Strand| {
            let places = strand.positions().iter().copied();
            Fingerprint::of(places, strand.velocities().iter().copied())
        };
        let known = gpu.fingerprints.get(index).copied().unwrap_or_default();
        let (poses, moves) =
            if written { fingerprint(&strand).differs(&known, is_tied) } else { (false, false) };
        let StrandState {
            positions,
            velocities,
            orientations,
            root_frame,
            tensions,
            spins,
            joints,
            before,
        } = own;
        let to = strand.bypass_change_detection();
        if !poses {
            let (places, speeds, frames, turns) = to.parts_mut();
            places.copy_from_slice(&positions);
            frames.copy_from_slice(&orientations);
            match spins.len() == turns.len() {
                true => turns.copy_from_slice(&spins),
                false => unused.apply(turns),
            }
            if !moves {
                speeds.copy_from_slice(&velocities);
            }
            to.tensions_mut().copy_from_slice(&tensions);
            to.settle_root(root_frame);
            history.bypass_change_detection().positions = before;
        }
        if !bonds_written && bonds.joints.len() == joints.len() {
            bonds.bypass_change_detection().joints.copy_from_slice(&joints);
        }
        if let Some(known) = gpu.fingerprints.get_mut(index) {
            *known = fingerprint(to);
        }
        // The tick has not seen yet what was written meanwhile.
        if written {
            strand.set_changed();
        }
        if bonds_written {
            bonds.set_changed();
        }
        if water_written && let Some(mut moisture) = entity.get_mut::<Moisture>() {
            moisture.set_changed();
        }
    }
}

/// Substeps that wait at most for a frame: after ten seconds without one they are run all the same.
const MOST_WAITING: usize = 3600;

/// As a frame begins: what has come from the device, and what has become of it.
pub(super) fn collect(world: &mut World) {
    let device = world.get_resource::<RenderDevice>().cloned();
    let present = world.get_resource::<Compiled>().map_or(0, Compiled::device);
    let mut hairs = world.query_filtered::<(Entity, &GpuHair), Allow<Disabled>>();
    let all: Vec<(Entity, Link, bool)> =
        hairs.iter(world).map(|(hair, gpu)| (hair, gpu.link.clone(), gpu.is_urgent())).collect();
    if let Some(device) = &device
        && all.iter().any(|(.., is_urgent)| *is_urgent)
    {
        // Callbacks come with the next submission otherwise.
        let _ = device.poll(PollType::Poll);
    }
    for (hair, link, _) in all {
        let waiting = world.get_mut::<GpuJournal>(hair);
        let waiting = waiting.filter(|journal| journal.is_long(MOST_WAITING));
        let waiting = waiting.map(|mut journal| core::mem::take(&mut journal.records));
        if let Some(mut waiting) = waiting {
            let mut shared = link.lock();
            shared.pending.append(&mut waiting);
            shared.run_pending();
        }
        let is_lost = !link.is_on(present);
        let state = link.take_state();
        let reports: Vec<Measured> = core::iter::from_fn(|| link.take_report()).collect();
        let named = |report: &Measured| link.layout.strand_of(report.first?);
        let reports: Vec<_> = reports.iter().map(|report| (*report, named(report))).collect();
        for (report, strand) in reports {
            apply_report(world, hair, &report, strand);
        }
        if is_lost {
            hand_back(world, hair, None, WhyCpu::DeviceLost);
            continue;
        }
        let Some((number, state)) = state else { continue };
        let Some(mut gpu) = world.get_mut::<GpuHair>(hair) else { continue };
        match (gpu.returns, state) {
            (Some((why, least)), Ok(state)) if least <= number => {
                hand_back(world, hair, Some(state), why);
            }
            (Some((why, _)), Err(())) => hand_back(world, hair, None, why),
            (_, Err(())) => {}
            (_, Ok(state)) => {
                let answers = gpu.awaited.is_some_and(|least| least <= number);
                if answers {
                    gpu.awaited = None;
                    let Some(mut gpu) = world.entity_mut(hair).take::<GpuHair>() else { continue };
                    let unused = take_unused(world, hair);
                    write_back(world, &mut gpu, &state, unused);
                    gpu.checkpoint = Some(state);
                    world.entity_mut(hair).insert(gpu);
                    world.trigger(StrandsArrived { entity: hair });
                    world.flush();
                } else {
                    gpu.checkpoint = Some(state);
                }
            }
        }
    }
}

/// Box and faults of a report.
fn apply_report(world: &mut World, hair: Entity, report: &Measured, strand: Option<usize>) {
    let Ok(mut entity) = world.get_entity_mut(hair) else { return };
    if let Some(mut drawn) = entity.get_mut::<DrawnElsewhere>() {
        let (low, high) = (Vec3::from(report.low), Vec3::from(report.high));
        // Some ticks will have passed before the next report is there.
        let margin = Vec3::splat(0.01 + 0.1 * report.speed.min(100.0));
        if low.is_finite() && high.is_finite() && low.cmple(high).all() {
            (drawn.low, drawn.high) = (low - margin, high + margin);
        }
    }
    if let Some(mut journal) = entity.get_mut::<GpuJournal>()
        && journal.bypass_change_detection().slept_in(report.slept)
        && let Some(mut sleepers) = entity.get_mut::<SleepCounts>()
    {
        *sleepers = SleepCounts { asleep: sleepers.asleep + sleepers.awake, awake: 0 };
    }
    if report.gives_way
        && let Some(mut gpu) = entity.get_mut::<GpuHair>()
    {
        gpu.unsupported.get_or_insert(Unsupported::HeldNodes);
    }
    let count = report.put_back + report.rebuilt;
    let Some(mut gpu) = entity.get_mut::<GpuHair>().filter(|_| count > 0) else { return };
    let is_known = core::mem::replace(&mut gpu.quiet, REPORT_COOLDOWN) > 0;
    if is_known {
        return;
    }
    let named = strand.and_then(|strand| gpu.members.get(strand).copied()).unwrap_or(hair);
    let (kind, what) = if report.put_back > 0 {
        (FaultKind::PutBack, "became non-finite and was put back to its last finite state, at rest")
    } else {
        (
            FaultKind::Rebuilt,
            "could not be stepped on; its rest pose was rebuilt from root and bonds",
        )
    };
    let others = count.saturating_sub(1);
    let message = format!(
        "a strand on the GPU {what} (and {others} times more): check forces, and roots and colliders that jump"
    );
    world.write_message(HairFault::new(kind, message).of(named));
}
