//! Tied roots follow their triangles: in equal parts through a tick, and once a frame to the drawn mesh.

use super::{
    morph::Morphs,
    pose::MeshPose,
    roots::{TiedRoots, triangle},
};
use crate::{
    schedule::HairStep,
    strand::{Hair, Pose, Strand, StrandHistory, StrandOf},
};
use bevy::{math::Isometry3d, prelude::*};

/// Poses of the tied roots on the posed mesh, in a hair's frame.
fn places(
    tied: &TiedRoots,
    mesh: &MeshPose,
    hair: &Pose,
) -> impl Iterator<Item = Option<Isometry3d>> {
    tied.roots.iter().map(|root| {
        let corners = root.corners.map(|c| hair.point_in(mesh.corner(&c)));
        triangle(corners, root.weights).map(|now| now * root.offset)
    })
}

/// At the start of a tick: targets of the roots at its end.
pub(super) fn aim_roots(
    step: Res<HairStep>,
    transforms: TransformHelper,
    morphs: Morphs,
    mut hairs: Query<(Entity, &mut TiedRoots), With<Hair>>,
) {
    if step.index != 0 {
        return;
    }
    let place = |entity| transforms.compute_global_transform(entity).ok();
    for (hair, mut tied) in &mut hairs {
        // The pose at the end of the tick, where the mesh will be too.
        let Some(pose) = place(hair).as_ref().and_then(Pose::of) else { continue };
        let Some(mesh) = tied.movers.pose(place, &morphs) else { continue };
        let aims: Vec<_> = places(&tied, &mesh, &pose).collect();
        for (root, to) in tied.bypass_change_detection().roots.iter_mut().zip(aims) {
            root.from = root.to;
            root.to = to.unwrap_or(root.to);
        }
    }
}

/// Moves roots by one substep's part of their displacement.
pub(super) fn move_roots(
    step: Res<HairStep>,
    hairs: Query<&TiedRoots, With<Hair>>,
    mut strands: Query<&mut Strand, With<StrandOf>>,
) {
    let t = (step.index + 1) as f32 / step.count as f32;
    for root in hairs.iter().flat_map(|tied| &tied.roots) {
        if let Ok(mut strand) = strands.get_mut(root.strand) {
            let at = root.from.translation.lerp(root.to.translation, t);
            let turn = root.from.rotation.slerp(root.to.rotation, t);
            strand.bypass_change_detection().put_root(at.into(), turn);
        }
    }
}

/// Once a frame: strands are drawn from where the scalp is drawn.
pub(super) fn draw_roots(
    globals: Query<&GlobalTransform>,
    morphs: Morphs,
    hairs: Query<(&GlobalTransform, &TiedRoots), With<Hair>>,
    mut strands: Query<&mut StrandHistory>,
) {
    for (hair, tied) in &hairs {
        let Some(pose) = Pose::of(hair) else { continue };
        let place = |joint| globals.get(joint).ok().copied();
        let Some(mesh) = tied.movers.pose(place, &morphs) else { continue };
        for (root, at) in tied.roots.iter().zip(places(tied, &mesh, &pose)) {
            if let (Some(at), Ok(mut history)) = (at, strands.get_mut(root.strand)) {
                history.bypass_change_detection().root = Some(at.translation.into());
            }
        }
    }
}
