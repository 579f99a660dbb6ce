//! Tying strands to their mesh, once it is loaded.

use super::{
    corner::{Corner, Corners},
    error::RootsError,
    morph::Morphs,
    pose::Movers,
    roots::{RootsOnMesh, Tied, TiedRoots, triangle},
};
use crate::{
    authoring::plant::RootOnMesh,
    base::{
        fault::{FaultKind, HairFault},
        schedule::HairStep,
    },
    hair::strand::{HairHere, MIN_SEGMENT, Strand, StrandHistory, Strands, TickPose},
};
use bevy::{
    math::Isometry3d,
    mesh::{
        Mesh, Mesh3d,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};

/// GuideOffsets the strands of new [`RootsOnMesh`].
pub(super) fn tie(
    step: Res<HairStep>,
    meshes: Option<Res<Assets<Mesh>>>,
    bindposes: Option<Res<Assets<SkinnedMeshInverseBindposes>>>,
    transforms: TransformHelper,
    skins: Query<(&Mesh3d, Option<&SkinnedMesh>)>,
    morphs: Morphs,
    mut hairs: Query<(Entity, Ref<RootsOnMesh>, &mut TiedRoots, &Strands, &TickPose), HairHere>,
    mut strands: Query<(&mut Strand, &mut StrandHistory)>,
    mut faults: MessageWriter<HairFault>,
) {
    let Some(meshes) = meshes.filter(|_| step.index == 0) else { return };
    for (hair, roots, mut tied, members, pose) in &mut hairs {
        if roots.is_changed() {
            *tied = default();
        }
        if tied.failed || !tied.roots.is_empty() {
            continue;
        }
        let Some(entity) = roots.mesh else { continue };
        let Ok((mesh, skin)) = skins.get(entity) else { continue };
        let Some(mesh) = meshes.get(&mesh.0) else { continue };
        let poses = skin.and_then(|s| bindposes.as_ref()?.get(&s.inverse_bindposes));
        if skin.is_some() && poses.is_none() {
            continue;
        }
        let mut report = |why| {
            faults.write(
                HairFault::caused(FaultKind::Roots, why, "those strands do not follow the mesh")
                    .of(hair),
            )
        };
        let read = Movers::of(entity, skin.zip(poses))
            .and_then(|movers| read(&roots, mesh, skin.is_some(), movers, members.iter().len()));
        let (movers, corners) = match read {
            Ok(read) => read,
            Err(why) => {
                tied.failed = true;
                report(why);
                continue;
            }
        };
        let place = |entity| transforms.compute_global_transform(entity).ok();
        let Some(posed) = movers.pose(place, &morphs) else { continue };
        let mut flat = 0;
        let made = members.iter().zip(&roots.roots).zip(corners).filter_map(
            |((member, root), corners)| {
                let seen = |at| pose.now().point_in(at);
                let now = corners.map(|c| seen(posed.corner(&c)));
                let unmorphed = corners.map(|c| seen(posed.unmorphed(&c)));
                let strand = strands.get_mut(member).ok()?;
                let bind = corners.map(|c| roots.strands_from_mesh.transform_point3(c.at));
                let tied = tie_strand(member, root, corners, bind, now, unmorphed, strand);
                flat += usize::from(tied.is_none());
                tied
            },
        );
        tied.roots = made.collect();
        tied.failed = tied.roots.is_empty();
        tied.movers = movers;
        if flat > 0 {
            report(RootsError::Flat { found: flat });
        }
    }
}

/// Reads the corners of every root, before any strand is touched.
fn read(
    roots: &RootsOnMesh,
    mesh: &Mesh,
    skinned: bool,
    mut movers: Movers,
    strands: usize,
) -> Result<(Movers, Vec<[Corner; 3]>), RootsError> {
    let found = roots.roots.len();
    if found != strands {
        return Err(RootsError::Count { found, expected: strands });
    }
    let corners = Corners::of(mesh, skinned, movers.joints())?;
    let read = roots.roots.iter().map(|root| corners.around(root, &mut movers.shifts));
    let read = read.collect::<Result<_, _>>()?;
    Ok((movers, read))
}

/// Moves a strand from its triangle in the `bind` pose to the triangle as `posed`, in the hair's frame.
/// Morph targets move and rotate it, but do not scale it: lengths are those of the `unmorphed` mesh,
/// whatever the face's expression when the strand is tied.
///
/// It is moved, rotated and scaled as a whole: its shape and the shapes that its bonds remember stay
/// the same.
fn tie_strand(
    member: Entity,
    root: &RootOnMesh,
    corners: [Corner; 3],
    bind: [Vec3; 3],
    posed: [Vec3; 3],
    unmorphed: [Vec3; 3],
    (mut strand, mut history): (Mut<'_, Strand>, Mut<'_, StrandHistory>),
) -> Option<Tied> {
    let size = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length().sqrt();
    let scale = size(unmorphed) / size(bind);
    let bind = triangle(bind, root.weights)?;
    let now = triangle(posed, root.weights)?;
    let turn = now.rotation * bind.rotation.inverse();
    let place = |p: &Vec3| now * ((bind.inverse() * *p) * scale);
    let turned = |q: &Quat| (turn * *q).normalize();
    let points: Vec<Vec3> = strand.positions().iter().map(place).collect();
    let lengths: Vec<f32> = strand.rest_lengths().iter().map(|l| l * scale).collect();
    let usable = points.len() >= 2
        && points.iter().all(|p| p.is_finite())
        && lengths.iter().all(|l| *l >= MIN_SEGMENT);
    if !usable {
        return None;
    }
    let at = Isometry3d::new(points[0], turned(&strand.root_frame()));
    let orientations = strand.orientations().iter().map(turned).collect();
    strand.replace(points, orientations, lengths, at.rotation);
    history.positions.clear();
    Some(Tied {
        strand: member,
        weights: root.weights,
        corners,
        offset: now.inverse() * at,
        from: at,
        to: at,
    })
}
