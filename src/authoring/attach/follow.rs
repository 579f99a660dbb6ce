//! Tied roots follow their triangles: in equal parts through a tick, and once a frame to the drawn mesh.

use super::{
    morph::Morphs,
    pose::MeshPose,
    roots::{Tied, TiedRoots, triangle},
};
use crate::{
    base::{motion::TickTransforms, schedule::HairStep},
    hair::strand::{Hair, OnGpu, Pose, SleepCounts, Strand, StrandHistory, StrandOf, StrandSleep},
    simulation::lod::PresentLod,
};
use bevy::{math::Isometry3d, prelude::*};

/// How far a root may be from where it is (m) and still counts as at rest, where that is not looked at
/// closely.
const STAYS: f32 = 5e-5;

/// How many roots of a hair of which few strands are simulated are looked at, to see whether any moves.
const PROBES: usize = 16;

/// The pose of a tied root on the posed mesh, in a hair's frame.
fn place_of(root: &Tied, mesh: &MeshPose, hair: &Pose) -> Option<Isometry3d> {
    let corners = root.corners.map(|c| hair.point_in(mesh.corner(&c)));
    triangle(corners, root.root.weights).map(|now| now * root.offset)
}

/// Whether the roots of a hair stay where they were, by a few of them. Most heads are rigid, and hair
/// that is small on the screen hides what moves between these.
fn stay(
    roots: &[Tied],
    mesh: &MeshPose,
    hair: &Pose,
    before: impl Fn(&Tied) -> Option<Vec3>,
) -> bool {
    let step = roots.len().div_ceil(PROBES).max(1);
    roots.iter().step_by(step).all(|root| {
        let now = place_of(root, mesh, hair).zip(before(root));
        now.is_some_and(|(now, before)| Vec3::from(now.translation).distance(before) < STAYS)
    })
}

/// Whether only few of a hair's strands are simulated, if any.
fn is_coarse(present: Option<&PresentLod>, sleepers: Option<&SleepCounts>) -> bool {
    present.is_some_and(|present| {
        present.followers > sleepers.map_or(0, |sleepers| sleepers.awake + sleepers.asleep)
    })
}

/// At the start of a tick: targets of the roots at its end.
pub(super) fn aim_roots(
    step: Res<HairStep>,
    mut transforms: TickTransforms,
    morphs: Morphs,
    mut hairs: Query<
        (Entity, &mut TiedRoots, Option<&PresentLod>, Option<&SleepCounts>),
        With<Hair>,
    >,
    strands: Query<(&Strand, &StrandSleep), Without<OnGpu>>,
) {
    if step.index != 0 {
        return;
    }
    // From where a strand's root is: it may have been rolled back.
    let present = |root: &Tied| {
        let (strand, _) = strands.get(root.strand).ok().filter(|of| !of.1.is_follower())?;
        let (place, frame) = (*strand.positions().first()?, strand.root_frame());
        (place.is_finite() && frame.is_finite()).then(|| Isometry3d::new(place, frame))
    };
    let mut place = |entity| transforms.end(entity);
    for (hair, mut tied, level, sleepers) in &mut hairs {
        // The pose at the end of the tick, where the mesh will be too.
        let Some(pose) = place(hair).as_ref().and_then(Pose::of) else { continue };
        let TiedRoots { roots, movers, rest, .. } = tied.bypass_change_detection();
        let Some(mesh) = movers.pose(&mut place, &morphs) else { continue };
        let aimed = |root: &Tied| Some(root.to.translation.into());
        *rest = is_coarse(level, sleepers) && stay(roots, &mesh, &pose, aimed);
        if *rest {
            continue;
        }
        for root in roots {
            root.from = present(root).unwrap_or(root.to);
            root.to = place_of(root, &mesh, &pose).unwrap_or(root.to);
        }
    }
}

/// Moves roots by one substep's part of their displacement.
pub(super) fn move_roots(
    step: Res<HairStep>,
    hairs: Query<&TiedRoots, With<Hair>>,
    mut strands: Query<(&mut Strand, &mut StrandSleep, Has<OnGpu>), With<StrandOf>>,
) {
    let t = (step.index + 1) as f32 / step.count as f32;
    for root in hairs.iter().filter(|tied| !tied.rest).flat_map(|tied| &tied.roots) {
        let Ok((mut strand, mut sleep, on_gpu)) = strands.get_mut(root.strand) else { continue };
        // Followers move once, at the end of a tick; strands on the GPU are moved there.
        if (sleep.is_follower() || on_gpu) && t < 1.0 {
            continue;
        }
        let now = root.at(t);
        let at = Vec3::from(now.translation);
        if sleep.is_follower() && sleep.is_asleep() {
            if strand.positions().first().is_some_and(|root| at.distance(*root) < STAYS) {
                continue;
            }
            sleep.bypass_change_detection().wake();
        }
        strand.bypass_change_detection().put_root(at, now.rotation);
    }
}

/// Once a frame: strands are drawn from where the scalp is drawn.
pub(super) fn draw_roots(
    globals: Query<&GlobalTransform>,
    morphs: Morphs,
    hairs: Query<
        (&GlobalTransform, &TiedRoots, Option<&PresentLod>, Option<&SleepCounts>),
        With<Hair>,
    >,
    mut strands: Query<&mut StrandHistory>,
) {
    for (hair, tied, present, sleepers) in &hairs {
        let Some(pose) = Pose::of(hair) else { continue };
        let place = |joint| globals.get(joint).ok().copied();
        let Some(mesh) = tied.movers.pose(place, &morphs) else { continue };
        let drawn = |root: &Tied| strands.get(root.strand).ok()?.root;
        if is_coarse(present, sleepers) && stay(&tied.roots, &mesh, &pose, drawn) {
            continue;
        }
        for root in &tied.roots {
            let at = place_of(root, &mesh, &pose);
            if let (Some(at), Ok(mut history)) = (at, strands.get_mut(root.strand)) {
                history.bypass_change_detection().root = Some(at.translation.into());
            }
        }
    }
}
