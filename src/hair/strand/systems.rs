//! Strands in the tick: poses of the scalp, and inertia of the nodes.

use super::{
    AddedMass, Hair, HeldNodes, HeldNodesState, Here, KinematicStrand, MotionOwner, PerHair,
    Regroomed, Settling, SimulatedHere, SleepCounts, SleepPose, Strand, StrandError, StrandHistory,
    StrandModel, StrandOf, StrandRank, StrandSleep, Strands, TickPose,
    frame::{ALIKE, Aim, HairInertia, Pose},
    held::report_out_of_reach,
    keep_required,
    owner_systems::{begin_settling, end_settling, update_owners},
    teleport::{ShiftWorld, shift_poses},
};
use crate::{
    base::{
        fault::{FaultKind, HairChecks, HairFault},
        motion::TickTransforms,
        parallel::{Nanos, for_each_part, tables},
        schedule::{
            EffectiveSubsteps, HairStep, HairSystems, HairTick, MergedSubsteps, OwnSchedule,
            TickPlugin, first_substep, lacks,
        },
        setting::Settings,
    },
    hair::worn,
};
use bevy::{
    ecs::{entity_disabling::Disabled, query::QueryFilter},
    math::Isometry3d,
    prelude::*,
};

/// Estimated time per strand (ns) of copying it, and of applying its hair's frame delta.
const COPY: Nanos = Nanos(100);
const FRAME_DELTA: Nanos = Nanos(600);

/// Hair and strands as entities, and their frames.
pub struct StrandPlugin;

impl Plugin for StrandPlugin {
    fn build(&self, app: &mut App) {
        if lacks::<TickPlugin, Self>(app) {
            return;
        }
        worn::plugin(app);
        worn::setting::<StrandModel>(app);
        worn::setting::<HairInertia>(app);
        keep_required::<Hair, Transform>(app);
        keep_required::<Hair, TickPose>(app);
        keep_required::<Hair, MergedSubsteps>(app);
        keep_required::<Hair, MotionOwner>(app);
        keep_required::<Hair, Regroomed>(app);
        keep_required::<Strand, StrandHistory>(app);
        keep_required::<Strand, AddedMass>(app);
        keep_required::<Strand, StrandSleep>(app);
        keep_required::<Strand, SleepPose>(app);
        keep_required::<Strand, StrandRank>(app);
        keep_required::<HeldNodes, HeldNodesState>(app);
        app.register_type::<Hair>()
            .register_type::<TickPose>()
            .register_type::<ShiftWorld>()
            .register_type::<Strand>()
            .register_type::<StrandOf>()
            .register_type::<Strands>()
            .register_type::<StrandHistory>()
            .register_type::<StrandError>()
            .register_type::<HeldNodes>()
            .register_type::<HeldNodesState>()
            .register_type::<AddedMass>()
            .register_type::<StrandSleep>()
            .register_type::<SleepCounts>()
            .register_type::<SleepPose>()
            .register_type::<MotionOwner>()
            .register_type::<Settling>()
            .add_observer(shift_poses)
            .add_observer(begin_settling)
            .add_observer(end_settling)
            .add_systems(HairChecks, report_unusable)
            .add_systems(HairChecks, report_idle.run_if(resource_exists::<OwnSchedule>))
            .add_systems(
                PostUpdate,
                draw_as_simulated.after(TransformSystems::Propagate).in_set(DrawnFrames),
            )
            .add_systems(
                HairTick,
                (
                    (
                        repair_strands::<Without<KinematicStrand>>,
                        repair_strands::<With<KinematicStrand>>.run_if(first_substep),
                        (note_regrooming, rank_strands, report_out_of_reach)
                            .chain()
                            .run_if(first_substep),
                        store_history,
                    )
                        .chain()
                        .in_set(HairSystems::StrandHistory),
                    (aim_poses.run_if(first_substep), advance_poses)
                        .chain()
                        .in_set(HairSystems::Poses),
                    update_owners.in_set(HairSystems::Owners).run_if(first_substep),
                    apply_frame_inertia.in_set(HairSystems::FrameInertia),
                ),
            );
    }
}

/// Whether the tick or strands are missing, without which `Own` does nothing.
pub(crate) fn lacks_strands<Own: Plugin>(app: &mut App) -> bool {
    lacks::<TickPlugin, Own>(app) || lacks::<StrandPlugin, Own>(app)
}

/// Reports strands that cannot be simulated, once, when they are spawned or assigned to a hair.
fn report_unusable(
    strands: Query<
        (Entity, Ref<Strand>, Option<Ref<StrandOf>>),
        // A strand on the GPU has a hair, and would not be there with fewer nodes.
        (Or<(Added<Strand>, Added<StrandOf>)>, Here),
    >,
    hairs: Query<(), With<Hair>>,
    mut faults: MessageWriter<HairFault>,
) {
    for (entity, strand, of) in &strands {
        if strand.is_added() && strand.nodes() < 2 {
            let error = StrandError::TooFewNodes { found: strand.nodes() };
            faults.write(HairFault::caused(FaultKind::Strand, error, "it is left out").of(entity));
        }
        let has_no_hair = match of {
            Some(of) => of.is_added() && !hairs.contains(of.0),
            None => strand.is_added(),
        };
        if has_no_hair {
            let message =
                "the strand belongs to no hair: spawn it with StrandOf(hair), hair carrying Hair";
            faults.write(HairFault::new(FaultKind::NoHair, message).of(entity));
        }
    }
}

/// Repairs private fields written by an inspector or a scene file. Our own writes bypass change
/// detection. Simulated strands are checked in every substep, because systems of game code within the
/// tick may write as well; without writes it only scans change ticks.
fn repair_strands<F: QueryFilter>(
    mut strands: Query<(Entity, &mut Strand), (Changed<Strand>, Here, Allow<Disabled>, F)>,
    mut loads: Query<(Entity, &mut AddedMass), (Changed<AddedMass>, Here, Allow<Disabled>, F)>,
    mut histories: Query<
        (Entity, &mut StrandHistory),
        (Changed<StrandHistory>, Here, Allow<Disabled>, F),
    >,
    mut faults: MessageWriter<HairFault>,
) {
    // Also of sleeping strands, whose history is not written again.
    let histories =
        histories.iter_mut().map(|(e, mut h)| (e, h.bypass_change_detection().repair()));
    let strands = strands.iter_mut().map(|(e, mut s)| (e, s.bypass_change_detection().repair()));
    let loads = loads.iter_mut().map(|(e, mut l)| (e, l.bypass_change_detection().repair()));
    for (entity, found) in strands.chain(loads).chain(histories) {
        if let Some(found) = found {
            faults.write(HairFault::new(FaultKind::Strand, found).of(entity));
        }
    }
}

/// Numbers the strands of each hair of which some have come, gone or been cut.
fn rank_strands(
    hairs: Query<&Strands, Changed<Regroomed>>,
    strands: Query<&Strand, Allow<Disabled>>,
    mut ranks: Query<&mut StrandRank, Allow<Disabled>>,
) {
    for members in &hairs {
        let nodes = |id: &Entity| strands.get(*id).map_or(0, Strand::nodes);
        let mut order: Vec<(usize, Entity)> =
            members.collection().iter().map(|id| (nodes(id), *id)).collect();
        order.sort_by_key(|(nodes, _)| *nodes);
        for (rank, (_, id)) in (0..).zip(order) {
            if let Ok(mut own) = ranks.get_mut(id) {
                own.set_if_neq(StrandRank(rank));
            }
        }
    }
}

/// At the start of a tick: which hair has other strands than before, or strands that were written to.
fn note_regrooming(
    written: Query<&StrandOf, (Or<(Changed<Strand>, Changed<StrandOf>)>, Here)>,
    mut enabled: RemovedComponents<Disabled>,
    of: Query<&StrandOf>,
    mut hairs: Query<(Entity, Option<Ref<Strands>>, &mut Regroomed)>,
    mut faults: MessageWriter<HairFault>,
) {
    let enabled = enabled.read().filter_map(|strand| of.get(strand).ok());
    for of in written.iter().chain(enabled) {
        if let Ok((.., mut regroomed)) = hairs.get_mut(of.0) {
            regroomed.set_changed();
        }
    }
    for (hair, members, mut regroomed) in &mut hairs {
        let is_changed = members.as_ref().is_some_and(|members| members.is_changed());
        let count = members.map_or(0, |members| members.len());
        if regroomed.is_added() && regroomed.strands > 0 && count == 0 {
            let message = format!(
                "the hair is a copy without the {} strands of its original: copy it with \
                 EntityClonerBuilder::linked_cloning(true), or spawn strands with StrandOf({hair})",
                regroomed.strands
            );
            faults.write(HairFault::new(FaultKind::Strand, message).of(hair));
        }
        let noted = regroomed.bypass_change_detection();
        (noted.members, noted.strands) = (is_changed, count);
        if is_changed {
            regroomed.set_changed();
        }
    }
}

/// Says that a schedule of the game's own runs no ticks.
fn report_idle(
    mut own: ResMut<OwnSchedule>,
    time: Option<Res<Time<Virtual>>>,
    strands: Query<(), With<Strand>>,
    mut faults: MessageWriter<HairFault>,
) {
    let step = time.map_or(0.0, |time| time.delta_secs());
    if !strands.is_empty() && own.is_idle_for(step) {
        let message = format!(
            "hair has not moved for {} s: HairPlugins::new({:?}) names a schedule that runs no ticks, or ran only \
             once; name one that runs every frame or tick, such as FixedUpdate",
            OwnSchedule::LONG,
            own.label
        );
        faults.write(HairFault::new(FaultKind::Setting, message));
    }
}

/// Before the first substep of a tick: the present positions become history. Strands that are not
/// simulated store theirs where they are moved.
fn store_history(
    step: Res<HairStep>,
    mut strands: Query<(&Strand, &StrandSleep, &mut StrandHistory), SimulatedHere>,
) {
    if step.index > 0 {
        return;
    }
    for_each_part(
        COPY,
        tables(&mut strands),
        || (),
        |(), rows| {
            for (strand, sleep, history) in rows {
                // A sleeping strand's history was stored when it fell asleep; only its root may
                // have moved.
                if sleep.is_asleep() && history.positions.first() == strand.positions.first() {
                    continue;
                }
                history.positions.clone_from(&strand.positions);
            }
        },
    );
}

/// At the start of a tick: sets the target of each pose. Hair that has come back rests on its head.
fn aim_poses(
    mut transforms: TickTransforms,
    inertia: Settings<HairInertia>,
    mut poses: Query<(Entity, &mut TickPose, Option<&Strands>)>,
    mut strands: Query<&mut Strand, Here>,
    mut faults: MessageWriter<HairFault>,
) {
    let tick = transforms.tick();
    let pose_of = |place: Option<GlobalTransform>| place.as_ref().and_then(Pose::of);
    // Displacement of each hair that moves, and whether it jumps. Colliders and tools that move
    // the same displacement jump with it.
    let mut displacements: Vec<(Vec3, bool)> = Vec::new();
    for others in [false, true] {
        for (entity, mut frame, members) in &mut poses {
            if members.is_none() != others {
                continue;
            }
            let place = transforms.end(entity);
            // One without any size is hidden there.
            let end = pose_of(place).or_else(|| frame.vanished(place.as_ref()?));
            let displacement = end.map_or(Vec3::ZERO, |end| frame.displacement_to(&end));
            let alike = |with: Vec3| displacement.distance(with) < 0.1 * displacement.length();
            let mut like = displacements.iter().filter(|(with, _)| others && alike(*with));
            let along = like.next().map(|first| first.1 && like.all(|(_, jumps)| *jumps));
            let was_put = transforms.was_put(entity);
            let transforms = core::cell::RefCell::new(&mut transforms);
            let aimed = frame.aim(Aim {
                tick,
                end,
                was_put,
                limits: inertia.of(entity),
                along,
                begin: &mut || pose_of(transforms.borrow_mut().begin(entity)),
                jump: &mut || {
                    let mut transforms = transforms.borrow_mut();
                    transforms.jump(entity);
                    let begin = pose_of(transforms.begin(entity))?;
                    Some([begin, pose_of(transforms.end(entity))?])
                },
            });
            if aimed.report {
                let message =
                    "the transform is not finite or has no inverse: the last valid pose is used";
                faults.write(HairFault::new(FaultKind::Transform, message).of(entity));
            }
            let Some(members) = members else { continue };
            if displacement != Vec3::ZERO {
                displacements.push((displacement, aimed.jumps));
            }
            let stretch = place.zip(end).and_then(|(place, end)| frame.stretch_to(&place, &end));
            if let Some(change) = stretch {
                let mut theirs = strands.iter_many_mut(members.collection());
                while let Some(mut strand) = theirs.fetch_next() {
                    if let Some(root) = strand.positions().first().copied() {
                        let frame = strand.root_frame();
                        strand.bypass_change_detection().put_root(change * root, frame);
                    }
                }
            }
            if aimed.settles || aimed.change.is_some() {
                let mut theirs = strands.iter_many_mut(members.collection());
                while let Some(mut strand) = theirs.fetch_next() {
                    let strand = strand.bypass_change_detection();
                    if aimed.settles {
                        strand.rest();
                    }
                    if let Some([velocity, spin]) = aimed.change {
                        strand.add_motion(velocity, spin);
                    }
                }
            }
        }
    }
}

/// When the frames are known in which hair is drawn.
#[derive(SystemSet, Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct DrawnFrames;

/// After transforms have been propagated: hair on a head that is squashed or sheared is drawn in the frame
/// that it is simulated in.
fn draw_as_simulated(
    mut places: ParamSet<(
        Query<(Entity, &GlobalTransform), (With<Hair>, Changed<GlobalTransform>)>,
        Query<(&mut GlobalTransform, &Transform)>,
    )>,
    children: Query<&Children>,
    mut todo: Local<Vec<(Entity, GlobalTransform)>>,
) {
    for (hair, place) in &places.p0() {
        let Some(pose) = Pose::of(place) else { continue };
        let even = pose.affine();
        if !place.affine().matrix3.abs_diff_eq(even.matrix3, ALIKE * pose.size()) {
            todo.push((hair, even.into()));
        }
    }
    let mut places = places.p1();
    while let Some((entity, place)) = todo.pop() {
        let Ok((mut own, _)) = places.get_mut(entity) else { continue };
        *own = place;
        for child in children.get(entity).into_iter().flatten() {
            if let Ok((_, local)) = places.get(*child) {
                todo.push((*child, place.mul_transform(*local)));
            }
        }
    }
}

/// Advances poses by a substep.
fn advance_poses(
    step: Res<HairStep>,
    substeps: EffectiveSubsteps,
    mut poses: Query<(Entity, &mut TickPose, Has<Strands>)>,
) {
    for (entity, mut frame, is_hair) in &mut poses {
        let waits = is_hair && substeps.began_before(entity);
        frame.advance((step.index + 1) as f32 / step.count as f32, waits);
    }
}

/// Inertia: free nodes are moved by the inverse of the frame's motion; the root stays.
fn apply_frame_inertia(
    substeps: EffectiveSubsteps,
    hairs: Query<&TickPose, With<Hair>>,
    mut strands: Query<(&StrandOf, &StrandSleep, &mut Strand), SimulatedHere>,
) {
    if !substeps.any() || hairs.iter().all(|hair| hair.frame_delta().is_none()) {
        return;
    }
    for_each_part(
        FRAME_DELTA,
        tables(&mut strands),
        || (),
        |(), rows| {
            let mut frame_deltas = PerHair::default();
            for (of, sleep, strand) in rows {
                let frame_delta = || {
                    substeps.of(of.0)?;
                    hairs.get(of.0).ok()?.frame_delta()
                };
                if sleep.is_simulated()
                    && let Some(index) = frame_deltas.index(of.0, frame_delta)
                {
                    shift_by(strand, &frame_deltas.values[index]);
                }
            }
        },
    );
}

/// Where air and water find a node: as the head has carried it into this substep. By inertia a free node is
/// where the substep before left it in the world, [`back`](TickPose::back) undoes that.
pub(crate) fn carried_along(positions: &[Vec3], node: usize, back: Option<&Isometry3d>) -> Vec3 {
    let place = positions[node];
    back.filter(|_| node > 0).map_or(place, |back| *back * place)
}

fn shift_by(strand: &mut Strand, frame_delta: &Isometry3d) {
    let (turn, way) = (frame_delta.rotation, Vec3::from(frame_delta.translation));
    // For many points a matrix is cheaper than a quaternion.
    let matrix = Mat3::from_quat(turn);
    strand.positions.iter_mut().skip(1).for_each(|p| *p = matrix * *p + way);
    strand.velocities.iter_mut().for_each(|v| *v = matrix * *v);
    strand.orientations.iter_mut().for_each(|q| *q = (turn * *q).normalize());
    strand.angular_velocities.iter_mut().for_each(|v| *v = matrix * *v);
}

#[cfg(test)]
mod tests {
    use super::*;
    use bevy::ecs::system::RunSystemOnce;
    use core::f32::consts::FRAC_PI_2;

    #[test]
    fn all_moving_state_is_shifted_and_the_root_stays() {
        let points: Vec<Vec3> = (0..4).map(|i| Vec3::X * (0.03 * i as f32)).collect();
        let mut strand = Strand::from_polyline(&points).unwrap();
        strand.velocities_mut().copy_from_slice(&[Vec3::X, Vec3::X, Vec3::Y, Vec3::Z]);
        strand.angular_velocities.copy_from_slice(&[Vec3::X, Vec3::Y, Vec3::Z]);
        let turn = Quat::from_rotation_z(FRAC_PI_2);
        let frame_delta = Isometry3d::new(Vec3::new(0.1, 0.2, 0.3), turn);
        shift_by(&mut strand, &frame_delta);
        assert_eq!(strand.positions()[0], Vec3::ZERO);
        for (p, q) in strand.positions()[1..].iter().zip(&points[1..]) {
            assert!(p.distance(turn * *q + Vec3::new(0.1, 0.2, 0.3)) < 1e-6);
        }
        let near = |found: &[Vec3], expected: &[Vec3]| {
            found.iter().zip(expected).all(|(a, b)| a.distance(*b) < 1e-6)
        };
        assert!(near(strand.velocities(), &[Vec3::Y, Vec3::Y, Vec3::NEG_X, Vec3::Z]));
        assert!(near(strand.angular_velocities(), &[Vec3::Y, Vec3::NEG_X, Vec3::Z]));
        assert!(strand.orientations().iter().all(|q| (*q * Vec3::Z).distance(Vec3::Y) < 1e-6));
    }

    #[test]
    fn strands_are_ranked_by_node_count_and_then_as_they_were_spawned() {
        let mut world = World::new();
        let hair = world.spawn(Regroomed::default()).id();
        let strand = |nodes: usize| {
            let points: Vec<Vec3> = (0..nodes).map(|k| Vec3::Y * k as f32).collect();
            Strand::from_polyline(&points).unwrap()
        };
        let ids = [5, 3, 4, 3].map(|nodes| world.spawn((StrandOf(hair), strand(nodes))).id());
        let ranks = |world: &mut World| {
            world.run_system_once(rank_strands).unwrap();
            ids.map(|id| world.get::<StrandRank>(id).map(|rank| rank.0))
        };
        assert_eq!(ranks(&mut world), [3, 0, 2, 1].map(Some));
        world.despawn(ids[1]);
        assert_eq!(ranks(&mut world), [Some(2), None, Some(1), Some(0)]);
    }
}
