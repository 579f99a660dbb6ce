//! Mesh and hair in one space.
//!
//! Hair is planted in a space where the face looks along −Z, the origin is the middle between the
//! ears, and the head has life size. So presets fit, a hairdo of one character fits another, and
//! hair of dolls and giants moves as at life size.

use super::{
    error::{HEAD_SIZES, WearError},
    facing::{FacingFrom, by_bones, by_shape, eyes},
    head::{HeadPlace, find_head},
    landmarks,
    part::{MeshPart, head_shares, head_triangles, positions, triangles},
    skin::{Hint, Role, Shell, roles},
    what::WearHair,
};
use crate::{
    authoring::plant::{Scalp, surface_points},
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
/// How far from its middle a head's landmarks are looked for, in its heights.
const NEAR: f32 = 2.2;

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

/// The skin of a head in the space of its hair.
pub(super) struct Fitting {
    /// Its meshes, that with most of the head first.
    pub(super) skin: Vec<FittedPart>,
    /// From the wearer to the hair.
    pub(super) from_wearer: Affine3A,
    /// All of them as one, vertices in that order; the red vertex colour is the head's skinning weight.
    pub(super) mesh: Mesh,
    pub(super) scalp: Scalp,
    /// Where the face looks, in the wearer's space, and what shows it.
    pub(super) facing: (Dir3, FacingFrom),
    /// What each part is for the head; `None` for those that do not move with it or are not shown.
    pub(super) roles: Vec<Option<Role>>,
}

/// Where a head is put.
struct Placed {
    from_wearer: Affine3A,
    skin: Vec<FittedPart>,
    mesh: Mesh,
    /// How many times it is as large, and its height then (m).
    size: f32,
    height: f32,
}

/// A mesh on which hair grows.
#[derive(Clone, Copy)]
pub(super) struct FittedPart {
    /// Which part it is.
    pub(super) part: usize,
    /// From the mesh as it is bound to the hair.
    pub(super) to_hair: Affine3A,
}

impl Fitting {
    /// Which part has most of the head's skin.
    pub(super) fn part(&self) -> usize {
        self.skin[0].part
    }
}

/// Finds the head among the parts and puts its skin into the space of the hair.
pub(super) fn fit(parts: &mut [MeshPart], wear: &WearHair) -> Result<Fitting, WearError> {
    let given = wear.scalp.map(Ranged::checked).transpose()?;
    if let Some(facing) = wear.facing {
        upright(None, facing)?;
    }
    let up = given.as_ref().map_or(Vec3::Y, |scalp| scalp.axes()[1]);
    let shares = parts.iter_mut().map(|part| head_shares(part, up));
    let shares: Vec<Vec<f32>> = shares.collect::<Result<_, _>>()?;
    let areas: Vec<f32> = parts.iter().zip(&shares).map(|(p, s)| p.head_area(s)).collect();
    let roles = part_roles(parts, &shares, &areas);
    let mut chosen: Vec<usize> =
        (0..parts.len()).filter(|i| roles[*i] == Some(Role::Skin)).collect();
    // On ties, the first.
    chosen.sort_by(|a, b| areas[*b].total_cmp(&areas[*a]));
    if chosen.is_empty() {
        chosen.extend((0..parts.len()).find(|i| parts[*i].is_named));
    }
    let main = *chosen.first().ok_or(WearError::NoMesh)?;
    let skin_points = |to: &Affine3A| -> Vec<Vec3> {
        let of = |i: usize| {
            let to = *to * parts[i].to_wearer;
            let places = positions(&parts[i].mesh).iter().zip(&shares[i]);
            let of_head = places.filter(|(_, share)| **share > 0.5);
            of_head.map(move |(p, _)| to.transform_point3(Vec3::from_array(*p)))
        };
        chosen.iter().flat_map(|i| of(*i)).collect()
    };
    let facing = match (&given, wear.facing) {
        (Some(scalp), _) => (scalp.front, FacingFrom::Given),
        (None, Some(facing)) => (facing, FacingFrom::Given),
        (None, None) => by_bones(parts)
            .or_else(|| {
                let points = skin_points(&Affine3A::IDENTITY);
                let head = find_head(&points)?;
                Some((by_shape(&points, head.center, head.height)?, FacingFrom::Nose))
            })
            .unwrap_or((Dir3::NEG_Z, FacingFrom::Assumed)),
    };
    let turn = upright(given.as_ref(), facing.0)?;
    let head = match &given {
        Some(scalp) => {
            HeadPlace { center: (turn * Vec3A::from(scalp.center)).into(), height: scalp.height }
        }
        None => {
            let there = skin_points(&Affine3A { matrix3: turn, ..default() });
            // An invalid mesh is reported by planting.
            find_head(&there).unwrap_or(HeadPlace { center: Vec3::ZERO, height: 0.11 })
        }
    };
    let has_area = areas[main] > 0.0;
    let placed = |head: HeadPlace| -> Result<Placed, WearError> {
        if has_area && !HEAD_SIZES.contains(&head.height) {
            return Err(WearError::HeadSize { found: head.height });
        }
        let life = head.height.clamp(*LIFE_SIZE.start(), *LIFE_SIZE.end());
        let size = if has_area { life / head.height } else { 1.0 };
        let from_wearer = Affine3A::from_scale(Vec3::splat(size))
            * Affine3A::from_translation(-head.center)
            * Affine3A { matrix3: turn, ..default() };
        let skin: Vec<FittedPart> = chosen
            .iter()
            .map(|&part| FittedPart { part, to_hair: from_wearer * parts[part].to_wearer })
            .collect();
        if skin.iter().any(|of| !of.to_hair.is_finite() || !of.to_hair.inverse().is_finite()) {
            return Err(WearError::Pose);
        }
        let moved = |of: &FittedPart| in_space(&parts[of.part].mesh, &of.to_hair, &shares[of.part]);
        let mesh = merged(skin.iter().map(moved).collect());
        Ok(Placed { from_wearer, skin, mesh, size, height: life })
    };
    let mut fitted = placed(head)?;
    let mut scalp = Scalp {
        center: Vec3::ZERO,
        up: Dir3::Y,
        front: Dir3::NEG_Z,
        height: fitted.height,
        ..given.unwrap_or_default()
    };
    if given.is_none() {
        // An invalid mesh is reported by planting.
        let near = |fitted: &Placed| {
            let mesh = cropped(&fitted.mesh, NEAR * fitted.height);
            surface_points(&mesh, landmarks::POINTS).unwrap_or_default()
        };
        let mut points = near(&fitted);
        if let Some((center, height)) = landmarks::by_ears(&points, fitted.height) {
            let center = head.center + center / fitted.size;
            fitted = placed(HeadPlace { center, height: height / fitted.size })?;
            points = near(&fitted);
        }
        scalp.height = fitted.height;
        if let Some([nose, chin]) = landmarks::face(&points, &scalp) {
            scalp = Scalp { nose, chin, ..scalp };
        }
    }
    let Placed { from_wearer, skin, mesh, .. } = fitted;
    Ok(Fitting { skin, from_wearer, mesh, scalp, facing, roles })
}

/// What each part is for the head.
fn part_roles(parts: &[MeshPart], shares: &[Vec<f32>], areas: &[f32]) -> Vec<Option<Role>> {
    // Of a character that is hidden as a whole, all parts count.
    let is_any_shown = (0..parts.len()).any(|i| areas[i] > 0.0 && parts[i].is_shown);
    let is_head = |i: usize| areas[i] > 0.0 && (parts[i].is_shown || !is_any_shown);
    let is_chosen = parts.iter().any(|part| !part.is_named);
    let of_head: Vec<usize> = (0..parts.len()).filter(|i| is_head(*i)).collect();
    let shells: Vec<Shell> = of_head
        .iter()
        .map(|&i| {
            let to = |p: Vec3| parts[i].to_wearer.transform_point3(p);
            let triangles = head_triangles(&parts[i].mesh, &shares[i]);
            let placed = triangles.map(|t| t.map(to)).filter(|t| t.iter().all(|p| p.is_finite()));
            Shell { triangles: placed.collect(), hint: Hint::of(&parts[i].name) }
        })
        .collect();
    let mut found = vec![None; parts.len()];
    for (i, role) in of_head.into_iter().zip(roles(&shells, &eyes(parts))) {
        found[i] = Some(role);
    }
    // A mesh that is named is skin, whatever it is like.
    if is_chosen {
        for (i, role) in found.iter_mut().enumerate() {
            match (parts[i].is_named, *role) {
                (true, _) if areas[i] > 0.0 => *role = Some(Role::Skin),
                (false, Some(Role::Skin)) => *role = Some(Role::Within),
                _ => {}
            }
        }
    }
    found
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

/// Meshes as one, their vertices one after the other. The winding of strips among several is ignored.
fn merged(mut meshes: Vec<Mesh>) -> Mesh {
    if meshes.len() == 1 {
        return meshes.remove(0);
    }
    let (mut places, mut normals, mut colors) = (Vec::new(), Vec::new(), Vec::new());
    let mut indices: Vec<u32> = Vec::new();
    for mesh in &meshes {
        let first = places.len();
        places.extend_from_slice(positions(mesh));
        if let Some(Values::Float32x3(own)) = mesh.attribute(Mesh::ATTRIBUTE_NORMAL) {
            normals.extend_from_slice(own);
        }
        // Where there are none the triangle's own is taken.
        normals.resize(places.len(), [0.0; 3]);
        if let Some(Values::Float32x4(own)) = mesh.attribute(Mesh::ATTRIBUTE_COLOR) {
            colors.extend_from_slice(own);
        }
        colors.resize(places.len(), [0.0, 0.0, 0.0, 1.0]);
        indices.extend(triangles(mesh).flatten().map(|v| (first + v) as u32));
    }
    Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
        .with_inserted_attribute(Mesh::ATTRIBUTE_POSITION, places)
        .with_inserted_attribute(Mesh::ATTRIBUTE_NORMAL, normals)
        .with_inserted_attribute(Mesh::ATTRIBUTE_COLOR, colors)
        .with_inserted_indices(Indices::U32(indices))
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
