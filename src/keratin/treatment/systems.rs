//! Treatments request bond changes in `ExternalForces`; rods guide their strands in `Interaction`.

use super::{
    HairTreatment, PermRod, PermWinding, Treatments, WindingProgress, WoundOn, WoundStrands,
    winding::{LocalRod, winding},
};
use crate::{
    base::{
        fault::HairFault,
        parallel::{Nanos, for_each},
        schedule::{HairProcessTime, HairStep, HairSystems, HairTick, lacks},
        setting::{self, Ranged, report},
        stretch::{self, Stretch},
    },
    hair::{
        strand::{
            HeldNodes, Here, MissedOnGpu, OnGpu, Strand, StrandOf, Strands, TickPose,
            keep_required, lacks_strands,
        },
        worn::HairsOf,
    },
    keratin::bond::{BondChanges, BondKind, BondPlugin, Bonds},
};
use bevy::prelude::*;

/// Treatments and perm rods.
pub struct TreatmentPlugin;

impl Plugin for TreatmentPlugin {
    fn build(&self, app: &mut App) {
        if lacks_strands::<Self>(app) {
            return;
        }
        lacks::<BondPlugin, Self>(app);
        setting::component::<PermRod>(app);
        setting::component::<PermWinding>(app);
        keep_required::<Strand, Treatments>(app);
        keep_required::<PermRod, TickPose>(app);
        keep_required::<PermRod, Stretch<PermRod>>(app);
        stretch::plugin::<PermRod>(app);
        app.add_message::<HairTreatment>()
            .init_resource::<MissedOnGpu<HairTreatment>>()
            .register_type::<HairTreatment>()
            .register_type::<Treatments>()
            .register_type::<WoundOn>()
            .register_type::<WoundStrands>()
            .register_type::<WindingProgress>()
            .register_required_components::<Strand, Treatments>()
            .add_observer(|treat: On<HairTreatment>, mut messages: MessageWriter<HairTreatment>| {
                messages.write(treat.event().clone());
            })
            .add_observer(release)
            .add_observer(release_all)
            .add_systems(
                HairTick,
                (begin_treatments, apply_treatments).chain().in_set(HairSystems::Treatments),
            )
            .add_systems(HairTick, wind_strands.in_set(HairSystems::RodWinding));
    }
}

fn begin_treatments(
    mut requests: MessageReader<HairTreatment>,
    (hairs, of): (Query<&Strands>, HairsOf),
    mut strands: Query<&mut Treatments, (With<StrandOf>, Here)>,
    on_gpu: Query<(), (With<OnGpu>, With<StrandOf>)>,
    mut missed: ResMut<MissedOnGpu<HairTreatment>>,
    mut faults: MessageWriter<HairFault>,
) {
    for request in requests.read() {
        // Of one strand: it is treated when it is back.
        if on_gpu.contains(request.target) {
            missed.0.push(request.clone());
            continue;
        }
        report(Some(request.target), request.violations(), &mut faults);
        for &target in of.of(&request.target) {
            let treat = HairTreatment { target, ..request.clamped() };
            if let Ok(members) = hairs.get(target) {
                let mut members = strands.iter_many_mut(members.collection());
                while let Some(mut treatments) = members.fetch_next() {
                    treatments.acting.push(treat.clone());
                }
            } else if let Ok(mut treatments) = strands.get_mut(target) {
                treatments.acting.push(treat);
            } else {
                faults.write(of.no_target("HairTreatment", target));
            }
        }
    }
}

/// Requests this substep's part of each acting treatment.
fn apply_treatments(
    step: Res<HairStep>,
    process: Res<HairProcessTime>,
    mut strands: Query<(&Bonds, &mut BondChanges, &mut Treatments), Here>,
) {
    let dt = step.dt * process.clamped().0;
    let mut items: Vec<_> = strands.iter_mut().filter(|(.., t)| !t.acting.is_empty()).collect();
    for_each(&mut items, Nanos(1_000), |(bonds, changes, treatments)| {
        let changes = changes.bypass_change_detection();
        for treat in &mut treatments.acting {
            // Half a substep of tolerance: sums of substeps are rounded.
            if treat.delay > 0.5 * dt {
                treat.delay -= dt;
                continue;
            }
            let share = if treat.seconds > dt { dt / treat.seconds } else { 1.0 };
            let range = treat.joints.clone().unwrap_or(0..bonds.joints.len());
            for (i, joint) in bonds.joints.iter().enumerate().filter(|(i, _)| range.contains(i)) {
                for kind in BondKind::ALL {
                    if let Some(to) = treat.rates[kind as usize] {
                        changes.request(i, kind, (to - joint.rates[kind as usize]) * share);
                    }
                }
            }
            treat.seconds -= dt;
            treat.delay = 0.0;
        }
        treatments.acting.retain(|t| t.delay > 0.0 || t.seconds > 0.0);
    });
}

fn wind_strands(
    step: Res<HairStep>,
    hairs: Query<&TickPose>,
    rods: Query<(&PermRod, &TickPose)>,
    mut strands: Query<(
        &StrandOf,
        &WoundOn,
        &Strand,
        &PermWinding,
        &mut WindingProgress,
        &mut HeldNodes,
        Has<OnGpu>,
    )>,
) {
    let mut items: Vec<_> = strands
        .iter_mut()
        .filter_map(|(of, on, strand, settings, wound, held, on_gpu)| {
            // Where a strand on the GPU is has to be known first.
            if on_gpu && wound.waits(strand, settings) {
                return None;
            }
            let hair = hairs.get(of.0).ok()?.now();
            let (rod, pose) = rods.get(on.0).ok()?;
            let (rod, pose) = (rod.clamped(), pose.now());
            let scale = pose.size() / hair.size();
            let rod = LocalRod {
                center: hair.point_in(pose.translation),
                axis: hair.direction_in(pose.direction_out(Vec3::Y)),
                radius: rod.radius * scale,
                half_length: 0.5 * rod.length * scale,
            };
            Some((rod, (*hair, *pose), strand, settings.clamped(), wound, held))
        })
        .collect();
    for_each(&mut items, Nanos(2_000), |(rod, (hair, pose), strand, settings, wound, held)| {
        let from = settings.from_node;
        if from >= strand.edges() {
            return;
        }
        if wound.waits(strand, settings) {
            wound.begin(strand);
        }
        // Once wound, hair is fixed to its rod and moves and rotates with it.
        if wound.on_rod.is_empty() {
            wound.progress = (wound.progress + step.dt / settings.seconds.max(step.dt)).min(1.0);
            let (lengths, progress) = (strand.rest_lengths(), wound.progress);
            let path = winding(rod, &wound.start, lengths, from, settings.pitch, progress);
            if wound.progress >= 1.0 {
                wound.on_rod = path.iter().map(|p| pose.point_in(hair.point_out(*p))).collect();
            }
            hold(held, from, path.into_iter());
        } else {
            let on_rod = wound.on_rod.iter();
            hold(held, from, on_rod.map(|p| hair.point_in(pose.point_out(*p))));
        }
    });
}

/// Holds the nodes from `from` on.
fn hold(held: &mut HeldNodes, from: usize, nodes: impl Iterator<Item = Vec3>) {
    held.targets.clear();
    held.targets.resize(from, None);
    held.targets.extend(nodes.map(Some));
}

/// Releases the nodes of a strand that leaves its rod for any reason.
fn release(left: On<Remove, WoundOn>, mut strands: Query<(&mut WindingProgress, &mut HeldNodes)>) {
    if let Ok((mut wound, mut held)) = strands.get_mut(left.entity) {
        held.targets.clear();
        *wound = default();
    }
}

/// Releases the strands of an entity that has lost its [`PermRod`].
fn release_all(gone: On<Remove, PermRod>, rods: Query<&WoundStrands>, mut commands: Commands) {
    for strand in rods.get(gone.entity).iter().flat_map(|wound| wound.iter()) {
        commands.entity(strand).try_remove::<WoundOn>();
    }
}
