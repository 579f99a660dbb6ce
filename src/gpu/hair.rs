//! Hair goes to the GPU.

use super::{
    compile::Ready,
    fingerprint::Fingerprint,
    layout::{Contents, FollowerView, Layout, Reach, SCRATCH, StrandView},
    record::GpuJournal,
    residence::{HairResidence, Unsupported, WhyCpu},
    shared::Link,
    strands::GpuStrands,
    treatments::GpuTreatments,
};
#[cfg(feature = "groom")]
use crate::authoring::attach::TiedRoots;
use crate::{
    hair::strand::{
        AddedMass, HeldNodes, MotionOwner, OnGpu, SleepCounts, Strand, StrandHistory, StrandSleep,
        Strands,
    },
    keratin::{
        bond::Bonds,
        treatment::{HairTreatment, Treatments},
    },
    render::DrawnElsewhere,
    simulation::{
        lod::{Follower, Guides, follow::GUIDES},
        sleep::Disturbance,
    },
    solver::rod::SolverMethod,
    water::{Moisture, SoakHair},
};
use bevy::{
    ecs::{change_detection::Tick, entity::EntityHashMap, entity_disabling::Disabled},
    prelude::*,
};

/// A hair on the GPU, on the hair's entity.
#[derive(Component)]
#[component(clone_behavior = Ignore)]
pub(super) struct GpuHair {
    pub(super) link: Link,
    /// Its strands in their order.
    pub(super) members: Vec<Entity>,
    /// What the strands' arrays were when they were last written to by us, if that was after the hand-over, and
    /// when that was.
    pub(super) fingerprints: Vec<Fingerprint>,
    pub(super) at: Tick,
    /// Number of the newest request for its state, and whether that is still to be passed on.
    newest: u64,
    is_new: bool,
    /// Why it is to return to the CPU, and with which answer.
    pub(super) returns: Option<(WhyCpu, u64)>,
    /// What came near in this tick that no record can hold: it rests, and returns in the next.
    pub(super) unsupported: Option<Unsupported>,
    /// The number of the answer that is waited for.
    pub(super) awaited: Option<u64>,
    /// The last state that was read back.
    pub(super) checkpoint: Option<Contents>,
    /// Time since that was asked for (s), and ticks since the hair was handed over.
    pub(super) since_checkpoint: f32,
    pub(super) ticks: u32,
    /// Whether its roots are tied to a mesh.
    pub(super) is_tied: bool,
    /// What solves its rods.
    pub(super) method: SolverMethod,
    /// Whether any of its strands follow others.
    pub(super) has_followers: bool,
    /// Whether the checkpoint is of its present sleep.
    pub(super) is_kept: bool,
    /// Which strands had held nodes, in order: those are neither guides nor followers.
    pub(super) held: Vec<Entity>,
    /// Ticks until a strand's fault is reported again.
    pub(super) quiet: u32,
    /// Strands that are asked about, by their indices; how many turns of that there have been; the indices.
    pub(super) probed: Vec<u32>,
    pub(super) probe_turn: usize,
    pub(super) numbers: EntityHashMap<u32>,
    /// Requests that came on the way back.
    pub(super) soaked: Vec<SoakHair>,
    pub(super) treated: Vec<HairTreatment>,
}

/// Keeps hair that has just returned on the CPU for this long (s).
#[derive(Component, Debug)]
#[component(clone_behavior = Ignore)]
pub(super) struct StaysOnCpu(pub(super) f32);

impl GpuHair {
    /// Asks for its state; returns the request's number.
    pub(super) fn request(&mut self) -> u64 {
        self.newest += 1;
        self.is_new = true;
        self.newest
    }

    /// The number of a request that has not been passed on.
    pub(super) fn take_request(&mut self) -> Option<u64> {
        core::mem::take(&mut self.is_new).then_some(self.newest)
    }

    /// Whether it is on its way back to the CPU.
    pub(super) fn is_returning(&self) -> bool {
        self.returns.is_some()
    }

    /// Whether an answer is waited for by anybody but the checkpoint.
    pub(super) fn is_urgent(&self) -> bool {
        self.returns.is_some() || self.awaited.is_some()
    }

    /// Asks for its state for the case that the device is lost.
    pub(super) fn note_checkpoint(&mut self) {
        self.since_checkpoint = 0.0;
        self.request();
    }

    /// Asks for its state for its strands.
    pub(super) fn await_state(&mut self) {
        let number = self.request();
        self.awaited.get_or_insert(number);
    }
}

/// What a follower follows; `None` where it has no guides. Those of the hair are given by their indices.
fn follower_view<'a>(strand: &EntityRef<'a>, guides: &[Option<u32>]) -> Option<FollowerView<'a>> {
    let offsets = strand.get::<Follower>()?.offsets();
    let edges = strand.get::<Strand>()?.edges();
    let mut own = [0; GUIDES];
    for (own, (guide, _)) in own.iter_mut().zip(&offsets.guides) {
        *own = (*guides.get(*guide as usize)?)?;
    }
    offsets.fit(edges).then_some(FollowerView { offsets, guides: own })
}

/// Hands a hair over, if all its strands can be.
pub(super) fn hand_over(
    world: &mut World,
    hair: Entity,
    ready: &Ready,
    method: SolverMethod,
) -> Result<(), WhyCpu> {
    let refused = |what| Err(WhyCpu::Unsupported(what));
    let Some(members) = world.get::<Strands>(hair).map(|all| all.collection().to_vec()) else {
        return refused(Unsupported::Strands);
    };
    #[cfg(feature = "groom")]
    let is_tied = world.get::<TiedRoots>(hair).is_some_and(TiedRoots::are_tied);
    #[cfg(not(feature = "groom"))]
    let is_tied = false;
    let mut views = Vec::with_capacity(members.len());
    let mut acting: Option<&[HairTreatment]> = None;
    let mut held = Vec::new();
    let index: EntityHashMap<u32> = match world.get::<Guides>(hair) {
        Some(guides) if !guides.entities().is_empty() => members.iter().copied().zip(0..).collect(),
        _ => default(),
    };
    let guides = world.get::<Guides>(hair).map_or(&[][..], Guides::entities);
    let guides: Vec<Option<u32>> = guides.iter().map(|guide| index.get(guide).copied()).collect();
    for member in &members {
        let Ok(entity) = world.get_entity(*member) else { return refused(Unsupported::Strands) };
        let parts = entity.get_components::<(
            &Strand,
            &Bonds,
            &StrandHistory,
            &AddedMass,
            &StrandSleep,
            &Moisture,
            &Treatments,
        )>();
        let Ok((strand, bonds, history, added, sleep, moisture, treatments)) = parts else {
            return refused(Unsupported::Strands);
        };
        let Some(root) = strand.positions().first().copied() else {
            return refused(Unsupported::Strands);
        };
        let follows = sleep.is_follower().then(|| follower_view(&entity, &guides)).flatten();
        if entity.get::<HeldNodes>().is_some_and(|held| held.targets.iter().any(Option::is_some)) {
            held.push(*member);
        }
        let reasons = [
            (strand.nodes() < 2 || bonds.joints.len() != strand.edges(), Unsupported::Strands),
            (entity.contains::<Disabled>(), Unsupported::Strands),
            (
                !is_tied
                    && (history.root.is_some()
                        || strand.root_before() != (root, strand.root_frame())),
                Unsupported::MovingRoots,
            ),
            (
                !added.mass.is_empty() || !added.in_water.is_empty() || !moisture.is_untouched(),
                Unsupported::Water,
            ),
            (!added.softening.is_empty(), Unsupported::Water),
            (sleep.is_follower() && follows.is_none(), Unsupported::LevelOfDetail),
            (
                *acting.get_or_insert(treatments.acting()) != treatments.acting(),
                Unsupported::Treatments,
            ),
        ];
        if let Some((_, what)) = reasons.into_iter().find(|(is_there, _)| *is_there) {
            return refused(what);
        }
        let spins = (method == SolverMethod::Sweeps).then(|| strand.angular_velocities());
        views.push(StrandView { follows, spins, ..StrandView::of(strand, bonds, history) });
    }
    held.sort_unstable();
    if views.is_empty() {
        return refused(Unsupported::Strands);
    }
    let nodes: Vec<usize> = views.iter().map(|view| view.positions.len()).collect();
    let followers = views.iter().filter(|view| view.follows.is_some()).count();
    let layout = Layout::with_followers(&nodes, |strand| views[strand].follows.is_some());
    let limits = ready.device.limits();
    let largest = 16 * layout.vectors(SCRATCH) as u64;
    if largest > limits.max_storage_buffer_binding_size
        || largest > limits.max_buffer_size
        || layout.blocks().len() > limits.max_compute_workgroups_per_dimension as usize
    {
        return Err(WhyCpu::TooLarge);
    }
    let on = GpuStrands::new(&ready.device, &ready.kernels, &views);
    let Reach { low, high, longest } = on.reach();
    let is_treated = acting.is_some_and(|acting| !acting.is_empty());
    let treatments = GpuTreatments::new(acting.unwrap_or_default().to_vec());
    let gpu = GpuHair {
        link: Link::new((ready.number, &ready.device, &ready.queue), ready.kernels.clone(), on),
        fingerprints: Vec::new(),
        at: world.read_change_tick(),
        newest: 0,
        is_new: false,
        returns: None,
        unsupported: None,
        awaited: None,
        checkpoint: None,
        since_checkpoint: 0.0,
        ticks: 0,
        quiet: 0,
        is_tied,
        method,
        has_followers: followers > 0,
        is_kept: false,
        held,
        probed: Vec::new(),
        probe_turn: 0,
        numbers: default(),
        soaked: Vec::new(),
        treated: Vec::new(),
        members: members.clone(),
    };
    let drawn =
        DrawnElsewhere { low: low - longest, high: high + longest, overstep: 1.0, rests: false };
    let sleepers = SleepCounts { asleep: 0, awake: members.len() - followers };
    let marks = (OnGpu::HANDED_OVER, MotionOwner::Gpu, Disturbance::default());
    let parts = (gpu, treatments, GpuJournal::default(), drawn, marks, sleepers);
    world.entity_mut(hair).insert((parts, HairResidence::Gpu));
    let treated = if is_treated { &members[..] } else { &[] };
    for member in treated {
        if let Some(mut treatments) = world.get_mut::<Treatments>(*member) {
            treatments.bypass_change_detection().acting_mut().clear();
        }
    }
    // From the last one on: rows of a table are taken out at its end, so that no other row moves.
    world.insert_batch(members.into_iter().rev().map(|member| (member, OnGpu::HANDED_OVER)));
    Ok(())
}
