//! Mesh and hair in one space.
//!
//! Hair is planted in a space where the face looks along −Z, the origin is the middle between the
//! ears, and the head has life size. So presets fit, a hairdo of one character fits another, and
//! hair of dolls and giants moves as at life size.

use super::{
    error::{HEAD_SIZES, WearError},
    head::{HeadPlace, find_head},
    what::WearHair,
};
use crate::{
    authoring::plant::{PlantError, Scalp},
    base::setting::Ranged,
};
use bevy::{
    asset::RenderAssetUsages,
    math::{Affine3A, Mat3A, Vec3A},
    mesh::{Indices, PrimitiveTopology, VertexAttributeValues as Values},
    prelude::*,
};

/// Heights of life-size heads (m).
const LIFE_SIZE: core::ops::RangeInclusive<f32> = 0.08..=0.16;

/// The joints of a mesh.
pub(super) struct MeshSkin {
    pub(super) joints: Vec<Entity>,
    /// Inverse bind poses.
    pub(super) poses: Vec<Affine3A>,
    /// Which joint is the head; `None` where none is known to be.
    pub(super) head: Option<usize>,
    /// Which joints are the head or below it.
    pub(super) of_head: Vec<bool>,
}

/// A mesh on which hair may grow.
pub(super) struct MeshPart {
    pub(super) entity: Entity,
    /// Its positions, normals, triangles and skin.
    pub(super) mesh: Mesh,
    pub(super) skin: Option<MeshSkin>,
    /// From the mesh, as it is bound, to the wearer.
    pub(super) to_wearer: Affine3A,
}

/// Copies the attributes of a mesh that planting, ties and fits need.
pub(super) fn skin_of(mesh: &Mesh) -> Result<Mesh, WearError> {
    let extracted = |_| PlantError::Extracted;
    let mut copy = Mesh::new(mesh.primitive_topology(), RenderAssetUsages::default());
    for which in [
        Mesh::ATTRIBUTE_POSITION,
        Mesh::ATTRIBUTE_NORMAL,
        Mesh::ATTRIBUTE_JOINT_INDEX,
        Mesh::ATTRIBUTE_JOINT_WEIGHT,
    ] {
        if let Some(values) = mesh.try_attribute_option(which).map_err(extracted)? {
            copy.insert_attribute(which, values.clone());
        }
    }
    if let Some(indices) = mesh.try_indices_option().map_err(extracted)? {
        copy.insert_indices(indices.clone());
    }
    Ok(copy)
}

/// The transform from a mesh as it is bound to the wearer, by one of its joints: where the joint is
/// now, and its inverse bind pose.
///
/// The joint may be moved by an animation already, but meshes are bound along the axes of their
/// character: the joint's rotation is rounded to quarter turns.
pub(super) fn bound_to(now: Affine3A, inverse_bind: Affine3A) -> Option<Affine3A> {
    let skinned = now * inverse_bind;
    let scale = skinned.matrix3.determinant().abs().cbrt();
    let turn = quarter_turns(skinned.matrix3) * scale;
    let joint = inverse_bind.inverse().translation;
    let moved = skinned.transform_point3a(joint) - turn * joint;
    let bound = Affine3A { matrix3: turn, translation: moved };
    (bound.is_finite() && scale > 0.0).then_some(bound)
}

/// The signed permutation of the axes that is nearest to a matrix.
fn quarter_turns(matrix: Mat3A) -> Mat3A {
    let axes = [Vec3A::X, Vec3A::Y, Vec3A::Z];
    let columns = [matrix.x_axis, matrix.y_axis, matrix.z_axis];
    const ORDERS: [[usize; 3]; 6] =
        [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]];
    let likeness = |order: &[usize; 3]| -> f32 { (0..3).map(|i| columns[i][order[i]].abs()).sum() };
    let mut best = ORDERS[0];
    for order in ORDERS {
        if likeness(&order) > likeness(&best) {
            best = order;
        }
    }
    let [x, y, z] = [0, 1, 2].map(|i| axes[best[i]] * columns[i][best[i]].signum());
    Mat3A::from_cols(x, y, z)
}

/// A mesh in the space of its hair.
pub(super) struct Fitting {
    /// Which part it is.
    pub(super) part: usize,
    /// From the mesh as it is bound to the hair.
    pub(super) to_hair: Affine3A,
    /// From the wearer to the hair.
    pub(super) from_wearer: Affine3A,
    /// The mesh in that space; the red vertex colour is the head's skinning weight.
    pub(super) mesh: Mesh,
    pub(super) scalp: Scalp,
}

/// Finds the head among the parts and puts its mesh into the space of the hair.
pub(super) fn fit(parts: &mut [MeshPart], wear: &WearHair) -> Result<Fitting, WearError> {
    let given = wear.scalp.map(Ranged::checked).transpose()?;
    let turn = upright(given.as_ref(), wear.facing)?;
    let mut best: Option<(f32, usize, Vec<f32>)> = None;
    for (i, part) in parts.iter_mut().enumerate() {
        let shares = head_shares(part, turn)?;
        let area = head_area(&part.mesh, &shares);
        if best.as_ref().is_none_or(|best| area > best.0) {
            best = Some((area, i, shares));
        }
    }
    let (_, chosen, shares) = best.ok_or(WearError::NoMesh)?;
    let part = &parts[chosen];
    let canonical = Affine3A { matrix3: turn, ..default() } * part.to_wearer;
    let head = match &given {
        Some(scalp) => {
            HeadPlace { center: (turn * Vec3A::from(scalp.center)).into(), height: scalp.height }
        }
        None => {
            let places = positions(&part.mesh).iter().zip(&shares);
            let of_head = places.filter(|(_, share)| **share > 0.5).map(|(p, _)| p);
            let there: Vec<Vec3> =
                of_head.map(|p| canonical.transform_point3(Vec3::from_array(*p))).collect();
            // An invalid mesh is reported by planting.
            find_head(&there).unwrap_or(HeadPlace { center: Vec3::ZERO, height: 0.11 })
        }
    };
    let has_area = head_area(&part.mesh, &shares) > 0.0;
    if has_area && !HEAD_SIZES.contains(&head.height) {
        return Err(WearError::HeadSize { found: head.height });
    }
    let life = head.height.clamp(*LIFE_SIZE.start(), *LIFE_SIZE.end());
    let size = if has_area { life / head.height } else { 1.0 };
    let size = Affine3A::from_scale(Vec3::splat(size));
    let from_wearer =
        size * Affine3A::from_translation(-head.center) * Affine3A { matrix3: turn, ..default() };
    let to_hair = from_wearer * part.to_wearer;
    if !to_hair.is_finite() || !to_hair.inverse().is_finite() {
        return Err(WearError::Pose);
    }
    let scalp = Scalp {
        center: Vec3::ZERO,
        up: Dir3::Y,
        front: Dir3::NEG_Z,
        height: life,
        ..given.unwrap_or_default()
    };
    let mesh = in_space(&part.mesh, &to_hair, &shares);
    Ok(Fitting { part: chosen, to_hair, from_wearer, mesh, scalp })
}

/// The rotation of the wearer's right, up and front to X, Y and −Z.
fn upright(scalp: Option<&Scalp>, facing: Dir3) -> Result<Mat3A, WearError> {
    let [right, up, front] = match scalp {
        Some(scalp) => scalp.axes(),
        None => {
            let wrong = WearError::Facing { found: *facing };
            let flat =
                facing.with_y(0.0).try_normalize().filter(|_| facing.with_y(0.0).length() > 1e-3);
            let front = flat.ok_or(wrong)?;
            [front.cross(Vec3::Y), Vec3::Y, front]
        }
    };
    Ok(Mat3A::from_cols(right.into(), up.into(), (-front).into()).transpose())
}

fn positions(mesh: &Mesh) -> &[[f32; 3]] {
    match mesh.attribute(Mesh::ATTRIBUTE_POSITION) {
        Some(Values::Float32x3(positions)) => positions,
        _ => &[],
    }
}

/// The head's skinning weight at each vertex; 1 for a mesh without a skin. Where no joint is known
/// to be the head, it is the one with the largest weight at the highest vertex.
fn head_shares(part: &mut MeshPart, turn: Mat3A) -> Result<Vec<f32>, WearError> {
    let places = positions(&part.mesh);
    let Some(skin) = &mut part.skin else { return Ok(vec![1.0; places.len()]) };
    let (Some(Values::Uint16x4(joints)), Some(Values::Float32x4(weights))) = (
        part.mesh.attribute(Mesh::ATTRIBUTE_JOINT_INDEX),
        part.mesh.attribute(Mesh::ATTRIBUTE_JOINT_WEIGHT),
    ) else {
        return Ok(vec![1.0; places.len()]);
    };
    let known = skin.joints.len().min(skin.poses.len());
    let found = joints.iter().flatten().copied().max().map_or(0, usize::from);
    if found >= known {
        let (joints, poses) = (skin.joints.len(), skin.poses.len());
        return Err(WearError::Joints { joints, poses, found });
    }
    if skin.head.is_none() {
        let height =
            |p: &[f32; 3]| (turn * part.to_wearer.transform_point3a(Vec3A::from_array(*p))).y;
        let highest = (0..places.len().min(joints.len()).min(weights.len()))
            .max_by(|a, b| height(&places[*a]).total_cmp(&height(&places[*b])));
        if let Some(v) = highest {
            let most = (0..4).max_by(|a, b| weights[v][*a].total_cmp(&weights[v][*b]));
            let head = usize::from(joints[v][most.unwrap_or(0)]);
            skin.head = Some(head);
            skin.of_head[head] = true;
        }
    }
    let share = |(joints, weights): (&[u16; 4], &[f32; 4])| {
        let all: f32 = weights.iter().sum();
        let own = joints.iter().zip(weights).filter(|(j, _)| skin.of_head[usize::from(**j)]);
        own.map(|(_, weight)| weight).sum::<f32>() / all.max(1e-6)
    };
    let mut shares: Vec<f32> = joints.iter().zip(weights).map(share).collect();
    shares.resize(places.len(), 0.0);
    Ok(shares)
}

/// The area of the triangles that are of the head, in the mesh's own unit squared.
fn head_area(mesh: &Mesh, shares: &[f32]) -> f32 {
    let places = positions(mesh);
    let corner = |v: usize| places.get(v).map(|p| Vec3::from_array(*p));
    let area = |triangle: [usize; 3]| {
        let of_head = triangle.iter().all(|v| shares.get(*v).is_some_and(|s| *s > 0.5));
        let [Some(a), Some(b), Some(c)] = triangle.map(corner) else { return 0.0 };
        if of_head { 0.5 * (b - a).cross(c - a).length() } else { 0.0 }
    };
    triangles(mesh).map(area).filter(|area| area.is_finite()).sum()
}

/// The vertices of each triangle; the winding of strips is ignored.
fn triangles(mesh: &Mesh) -> impl Iterator<Item = [usize; 3]> {
    let step = if mesh.primitive_topology() == PrimitiveTopology::TriangleStrip { 1 } else { 3 };
    let indices: Vec<usize> = match mesh.indices() {
        Some(indices) => indices.iter().collect(),
        None => (0..mesh.count_vertices()).collect(),
    };
    let starts = (0..indices.len().saturating_sub(2)).step_by(step);
    starts.map(move |i| [indices[i], indices[i + 1], indices[i + 2]])
}

/// A mesh in another space, with shares as red vertex colour.
fn in_space(mesh: &Mesh, space: &Affine3A, shares: &[f32]) -> Mesh {
    let mut moved = mesh.clone();
    if let Some(Values::Float32x3(places)) = moved.attribute_mut(Mesh::ATTRIBUTE_POSITION) {
        places.iter_mut().for_each(|p| *p = space.transform_point3((*p).into()).to_array());
    }
    let normals = space.matrix3.inverse().transpose();
    if let Some(Values::Float32x3(values)) = moved.attribute_mut(Mesh::ATTRIBUTE_NORMAL) {
        let turned = |n: Vec3A| (normals * n).normalize_or_zero().to_array();
        values.iter_mut().for_each(|n| *n = turned((*n).into()));
    }
    let colors: Vec<[f32; 4]> = shares.iter().map(|share| [*share, 0.0, 0.0, 1.0]).collect();
    moved.insert_attribute(Mesh::ATTRIBUTE_COLOR, colors);
    let is_mirrored = space.matrix3.determinant() < 0.0;
    if is_mirrored && moved.primitive_topology() == PrimitiveTopology::TriangleList {
        let turned = triangles(mesh).flat_map(|[a, b, c]| [a as u32, c as u32, b as u32]);
        moved.insert_indices(Indices::U32(turned.collect()));
    }
    moved
}

/// The part of a mesh within `reach` (m) of the origin: the same vertices, fewer triangles.
pub(super) fn cropped(mesh: &Mesh, reach: f32) -> Mesh {
    let mut part = mesh.clone();
    let places = positions(mesh);
    let is_list = mesh.primitive_topology() == PrimitiveTopology::TriangleList;
    // Invalid triangles are kept, for planting to report.
    let is_near = |v: &usize| {
        places.get(*v).is_none_or(|p| {
            let squared = Vec3::from_array(*p).length_squared();
            squared <= reach * reach || squared.is_nan()
        })
    };
    let kept: Vec<u32> = triangles(mesh)
        .filter(|triangle| triangle.iter().any(is_near))
        .flat_map(|triangle| triangle.map(|v| v as u32))
        .collect();
    if is_list && !kept.is_empty() {
        part.insert_indices(Indices::U32(kept));
    }
    part
}
