//! Roots that go with the triangles of a skinned mesh.
//!
//! Hair on a head that only turns needs no more than a [`Hair`] on the head's bone. Where the scalp
//! itself stretches (a neck, a beard, fur) every root has to follow its own triangle.
//! [`RootsOnMesh`] skins those few triangles on the CPU: once a tick for the simulation, which takes
//! roots there in equal parts over its substeps, and once a frame from the pose that is drawn, so
//! that no root is ever seen beside its scalp.

use super::RootOnMesh;
use crate::{
    bond::Bonds,
    fault::{Fault, HairFault},
    strand::{Hair, Pose, Strand, StrandHistory, StrandOf, Strands, TickPose},
    tick::{HairStep, HairSystems, HairTick},
};
use bevy::{
    math::{Affine3A, Isometry3d, Mat3A, Vec3A},
    mesh::{
        Mesh, Mesh3d, VertexAttributeValues,
        skinning::{SkinnedMesh, SkinnedMeshInverseBindposes},
    },
    prelude::*,
};

/// Ties the strands of a [`Hair`] to triangles of a mesh, skinned or not. Component of the hair, which
/// best sits on the bone that moves most of it.
///
/// Give strands as they grow on the mesh in its own space, before any skinning, as planting gives
/// them. In the first tick in which mesh and joints are there every strand is taken to its place on
/// the mesh as it is posed; lengths are scaled as the mesh is. From then on roots go with their
/// triangles, turning with them. Morph targets are not followed.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct RootsOnMesh {
    /// The entity that carries the `Mesh3d`, and if skinned the `SkinnedMesh`.
    pub mesh: Option<Entity>,
    /// One for each strand, in the order of the hair's [`Strands`].
    pub roots: Vec<RootOnMesh>,
}

/// What was read from the mesh when the strands were tied to it, so that its asset may go.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub struct TiedRoots {
    #[reflect(ignore)]
    roots: Vec<Tied>,
    #[reflect(ignore)]
    joints: Vec<Joint>,
    failed: bool,
}

/// A joint that moves some of the triangles; the mesh itself where it is not skinned.
#[derive(Clone, Copy, Debug)]
struct Joint {
    entity: Entity,
    inverse_bind: Affine3A,
}

#[derive(Clone, Copy, Debug)]
struct Tied {
    strand: Entity,
    weights: Vec3,
    corners: [Corner; 3],
    /// Where the root's frame is in its triangle's.
    offset: Isometry3d,
    from: Isometry3d,
    to: Isometry3d,
}

/// A vertex as it is skinned.
#[derive(Clone, Copy, Debug, Default)]
struct Corner {
    at: Vec3,
    joints: [u16; 4],
    weights: [f32; 4],
}

impl Corner {
    fn skinned(&self, joints: &[Affine3A]) -> Vec3 {
        let all: f32 = self.weights.iter().sum();
        let sum: Vec3A = (self.joints.iter().zip(self.weights))
            .map(|(&j, w)| joints[j as usize].transform_point3a(self.at.into()) * (w / all))
            .sum();
        sum.into()
    }
}

/// The frame of a triangle at a point of it; `None` where it has no area.
fn triangle(corners: [Vec3; 3], weights: Vec3) -> Option<Isometry3d> {
    let [a, b, c] = corners;
    let along = (b - a).try_normalize()?;
    let normal = (b - a).cross(c - a).try_normalize()?;
    let turn = Mat3A::from_cols(along.into(), normal.cross(along).into(), normal.into());
    let at = a * weights.x + b * weights.y + c * weights.z;
    at.is_finite().then(|| Isometry3d::new(at, Quat::from_mat3a(&turn)))
}

/// Why strands cannot be tied to a mesh.
fn why_not(roots: &RootsOnMesh, mesh: &Mesh, strands: usize) -> Option<&'static str> {
    if roots.roots.len() != strands {
        return Some("RootsOnMesh has not one root for each strand of its hair");
    }
    let Ok(Some(VertexAttributeValues::Float32x3(positions))) =
        mesh.try_attribute_option(Mesh::ATTRIBUTE_POSITION)
    else {
        return Some("the mesh of RootsOnMesh has no positions in the main world");
    };
    let mut vertices = roots.roots.iter().flat_map(|r| r.vertices);
    if vertices.any(|v| v as usize >= positions.len()) {
        return Some("RootsOnMesh names a vertex that its mesh does not have");
    }
    None
}

pub(super) fn plugin(app: &mut App) {
    app.register_type::<RootsOnMesh>()
        .register_type::<TiedRoots>()
        .register_required_components::<RootsOnMesh, TiedRoots>()
        .add_systems(
            HairTick,
            (tie, aim_roots, move_roots)
                .chain()
                .in_set(HairSystems::Roots)
                .after(crate::strand::carry_strands)
                .before(crate::bond::fit_bonds),
        )
        .add_systems(PostUpdate, draw_roots.after(TransformSystems::Propagate));
}

/// Ties the strands of new [`RootsOnMesh`] to their mesh, once it is there.
fn tie(
    step: Res<HairStep>,
    meshes: Option<Res<Assets<Mesh>>>,
    bindposes: Option<Res<Assets<SkinnedMeshInverseBindposes>>>,
    transforms: TransformHelper,
    skins: Query<(&Mesh3d, Option<&SkinnedMesh>)>,
    mut hairs: Query<(Entity, Ref<RootsOnMesh>, &mut TiedRoots, &Strands, &TickPose), With<Hair>>,
    mut strands: Query<(&mut Strand, &mut Bonds, &mut StrandHistory)>,
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
        let Some((mesh3d, skin)) = roots.mesh.and_then(|mesh| skins.get(mesh).ok()) else {
            continue;
        };
        let Some(mesh) = meshes.get(&mesh3d.0) else { continue };
        if let Some(why) = why_not(&roots, mesh, members.iter().len()) {
            tied.failed = true;
            faults.write(HairFault { entity: hair, fault: Fault::Roots(why) });
            continue;
        }
        let joints = match skin {
            None => {
                vec![Joint { entity: roots.mesh.unwrap_or(hair), inverse_bind: Affine3A::IDENTITY }]
            }
            Some(skin) => {
                let Some(inverse) =
                    bindposes.as_ref().and_then(|poses| poses.get(&skin.inverse_bindposes))
                else {
                    continue;
                };
                (skin.joints.iter().zip(inverse.iter()))
                    .map(|(&entity, inverse)| Joint {
                        entity,
                        inverse_bind: Affine3A::from_mat4(*inverse),
                    })
                    .collect()
            }
        };
        let Some(matrices) =
            joint_matrices(&joints, |joint| transforms.compute_global_transform(joint).ok())
        else {
            continue;
        };
        let corners = corners(mesh, skin.is_some(), joints.len());
        let mut flat = 0;
        let made = members.iter().zip(&roots.roots).filter_map(|(member, root)| {
            let corners = root.vertices.map(|v| corners(v as usize));
            let (strand, bonds, history) = strands.get_mut(member).ok()?;
            let Some(tied) =
                tie_strand(member, root, corners, &matrices, pose.now(), (strand, bonds, history))
            else {
                flat += 1;
                return None;
            };
            Some(tied)
        });
        tied.roots = made.collect();
        tied.joints = joints;
        if flat > 0 {
            let why =
                "some roots of RootsOnMesh are on triangles without area: they stay on the hair";
            faults.write(HairFault { entity: hair, fault: Fault::Roots(why) });
        }
        tied.failed = tied.roots.is_empty();
    }
}

/// Puts a strand that was given in the mesh's own space to its place in the hair's frame.
fn tie_strand(
    member: Entity,
    root: &RootOnMesh,
    corners: [Corner; 3],
    matrices: &[Affine3A],
    hair: &Pose,
    (mut strand, mut bonds, mut history): (Mut<'_, Strand>, Mut<'_, Bonds>, Mut<'_, StrandHistory>),
) -> Option<Tied> {
    let bind = triangle(corners.map(|c| c.at), root.weights)?;
    let posed = corners.map(|c| hair.point_in(c.skinned(matrices)));
    let now = triangle(posed, root.weights)?;
    let size = |[a, b, c]: [Vec3; 3]| (b - a).cross(c - a).length().sqrt();
    let scale = size(posed) / size(corners.map(|c| c.at));
    let points: Vec<Vec3> =
        strand.positions().iter().map(|p| now * ((bind.inverse() * *p) * scale)).collect();
    let turn = now.rotation * bind.rotation.inverse();
    let frame = turn * strand.root_frame();
    let leaves = Dir3::new(frame * Vec3::Z).ok()?;
    *strand = Strand::from_polyline(&points).ok()?.leaving_along(leaves);
    *bonds = Bonds::of(&strand);
    history.positions.clear();
    let at = Isometry3d::new(points[0], strand.root_frame());
    Some(Tied {
        strand: member,
        weights: root.weights,
        corners,
        offset: now.inverse() * at,
        from: at,
        to: at,
    })
}

/// Reads a vertex as it is skinned; `why_not` has looked at the mesh before.
fn corners(mesh: &Mesh, skinned: bool, joints: usize) -> impl Fn(usize) -> Corner {
    let attribute = |id| mesh.try_attribute_option(id).ok().flatten();
    let positions = attribute(Mesh::ATTRIBUTE_POSITION);
    let (indices, weights) = match skinned {
        true => (attribute(Mesh::ATTRIBUTE_JOINT_INDEX), attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT)),
        false => (None, None),
    };
    move |v| {
        let at = match positions {
            Some(VertexAttributeValues::Float32x3(all)) => Vec3::from_array(all[v]),
            _ => Vec3::ZERO,
        };
        let mut corner = Corner { at, joints: [0; 4], weights: [1.0, 0.0, 0.0, 0.0] };
        if let (
            Some(VertexAttributeValues::Uint16x4(indices)),
            Some(VertexAttributeValues::Float32x4(weights)),
        ) = (indices, weights)
            && let (Some(&indices), Some(&weights)) = (indices.get(v), weights.get(v))
            && indices.iter().all(|&j| usize::from(j) < joints)
            && weights.iter().sum::<f32>() > 1e-6
        {
            (corner.joints, corner.weights) = (indices, weights);
        }
        corner
    }
}

fn joint_matrices(
    joints: &[Joint],
    place: impl Fn(Entity) -> Option<GlobalTransform>,
) -> Option<Vec<Affine3A>> {
    joints.iter().map(|j| Some(place(j.entity)?.affine() * j.inverse_bind)).collect()
}

/// Where the tied roots are with these joints, seen from a hair.
fn places(
    tied: &TiedRoots,
    matrices: &[Affine3A],
    hair: &Pose,
) -> impl Iterator<Item = Option<Isometry3d>> {
    tied.roots.iter().map(|root| {
        let corners = root.corners.map(|c| hair.point_in(c.skinned(matrices)));
        triangle(corners, root.weights).map(|now| now * root.offset)
    })
}

/// At the start of a tick: where roots are to be at its end.
fn aim_roots(
    step: Res<HairStep>,
    transforms: TransformHelper,
    mut hairs: Query<(Entity, &mut TiedRoots), With<Hair>>,
) {
    if step.index != 0 {
        return;
    }
    let place = |entity| transforms.compute_global_transform(entity).ok();
    for (hair, mut tied) in &mut hairs {
        // The pose at the end of the tick, where the mesh will be too.
        let Some(pose) = place(hair).as_ref().and_then(Pose::of) else { continue };
        let Some(matrices) = joint_matrices(&tied.joints, place) else { continue };
        let aims: Vec<_> = places(&tied, &matrices, &pose).collect();
        for (root, to) in tied.bypass_change_detection().roots.iter_mut().zip(aims) {
            root.from = root.to;
            root.to = to.unwrap_or(root.to);
        }
    }
}

/// Roots in equal parts on their way.
fn move_roots(
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
fn draw_roots(
    globals: Query<&GlobalTransform>,
    hairs: Query<(&GlobalTransform, &TiedRoots), With<Hair>>,
    mut strands: Query<&mut StrandHistory>,
) {
    for (hair, tied) in &hairs {
        let Some(pose) = Pose::of(hair) else { continue };
        let place = |joint| globals.get(joint).ok().copied();
        let Some(matrices) = joint_matrices(&tied.joints, place) else { continue };
        for (root, at) in tied.roots.iter().zip(places(tied, &matrices, &pose)) {
            if let (Some(at), Ok(mut history)) = (at, strands.get_mut(root.strand)) {
                history.bypass_change_detection().root = Some(at.translation.into());
            }
        }
    }
}
