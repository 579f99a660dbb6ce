//! Colliders for what a character wears: capes, collars, pauldrons.
//!
//! Each is a sheet that holds hair on its outside, solid for some way below it: of triangles that look at the body
//! none is needed.

use super::{
    part::{MeshPart, positions, triangles},
    space::Fitting,
};
use crate::{
    base::grid::KdTree,
    forces::contact::{Bake, DistanceGrid, HairCollider, Openings},
};
use bevy::{
    math::Affine3A,
    platform::collections::{HashMap, HashSet},
    prelude::*,
};

/// How far below its outside a garment is solid, and how far out of it (m).
const DEPTH: f32 = 0.06;
const OUT: f32 = 2e-3;
/// Spacing of the points at which distances are known (m).
const CELL: f32 = 0.012;
/// Triangles whose normals point more than this toward the body's axis are on the inside.
const INSIDE: f32 = -0.2;
/// With less than this share on the outside, it is inside out.
const LEAST_OUTSIDE: f32 = 0.25;
/// A mesh whose triangles look more than this into one direction, as a share, is a sheet.
const ONE_WAY: f32 = 0.5;

/// A triangle in the space of the hair: its corners, the joint that moves most of it.
struct Face {
    corners: [Vec3; 3],
    joint: usize,
}

impl Face {
    /// Its normal times its area.
    fn area(&self) -> Vec3 {
        let [a, b, c] = self.corners;
        0.5 * (b - a).cross(c - a)
    }
}

/// Whether a mesh is an open sheet and no solid, such as a cape.
pub(super) fn is_sheet(part: &MeshPart) -> bool {
    let all = faces(part, &Affine3A::IDENTITY);
    let (sum, total) = all
        .iter()
        .map(Face::area)
        .fold((Vec3::ZERO, 0.0), |(sum, total), area| (sum + area, total + area.length()));
    sum.length() > ONE_WAY * total
}

fn faces(part: &MeshPart, to_hair: &Affine3A) -> Vec<Face> {
    let places: Vec<Vec3> =
        positions(&part.mesh).iter().map(|p| to_hair.transform_point3(Vec3::from(*p))).collect();
    let joint_of = part.joints_of_vertices();
    let is_mirrored = to_hair.matrix3.determinant() < 0.0;
    let face = |t: [usize; 3]| {
        let t = if is_mirrored { [t[0], t[2], t[1]] } else { t };
        let corner = |v: usize| places.get(v).copied().filter(|p| p.is_finite());
        let [Some(a), Some(b), Some(c)] = t.map(corner) else { return None };
        let joint = joint_of.as_ref().map_or(0, |of| of.get(t[0]).copied().unwrap_or(0));
        Some(Face { corners: [a, b, c], joint })
    };
    triangles(&part.mesh).filter_map(face).collect()
}

/// The outside of garments that hair of this `reach` (m) gets to, for each joint that moves some: except those
/// `with_own` colliders, and what is near `roots`, since hair that grows in a solid is pushed out of it.
pub(super) fn garments<'a>(
    parts: impl Iterator<Item = &'a MeshPart>,
    with_own: &HashSet<Entity>,
    fitting: &Fitting,
    roots: &[Vec3],
    reach: f32,
) -> Vec<(Entity, (HairCollider, Transform))> {
    let mut solids = Vec::new();
    let roots = KdTree::new(roots.iter().copied().zip(0u32..));
    let clear = (0, DEPTH * DEPTH);
    for part in parts {
        let Some(skin) = &part.skin else { continue };
        let to_hair = fitting.from_wearer * part.to_wearer;
        let faces = outside(faces(part, &to_hair));
        for (j, joint) in skin.joints.iter().enumerate() {
            let Some(pose) = skin.poses.get(j).filter(|_| !with_own.contains(joint)) else {
                continue;
            };
            let is_near = |face: &&Face| {
                face.joint == j
                    && face.corners.iter().any(|p| p.length() < reach)
                    && face.corners.iter().all(|p| roots.nearer_than(*p, clear) == clear)
            };
            let near: Vec<&Face> = faces.iter().filter(is_near).collect();
            let to_joint = (to_hair * pose.inverse()).inverse();
            if let Some(grid) = sheet(&near).filter(|_| to_joint.is_finite()) {
                let place = Transform::from_matrix(Mat4::from(to_joint));
                solids.push((*joint, (HairCollider::grid(grid), place)));
            }
        }
    }
    solids
}

/// The triangles that look away from the body's axis, which is upright through the head.
fn outside(mut faces: Vec<Face>) -> Vec<Face> {
    let looks_out = |face: &Face| {
        let off = (face.corners.iter().sum::<Vec3>() / 3.0).with_y(0.0).normalize_or_zero();
        face.area().normalize_or_zero().dot(off) > INSIDE
    };
    let all: f32 = faces.iter().map(|face| face.area().length()).sum();
    let out: f32 = faces.iter().filter(|face| looks_out(face)).map(|f| f.area().length()).sum();
    if out < LEAST_OUTSIDE * all {
        faces.iter_mut().for_each(|face| face.corners.swap(1, 2));
    }
    faces.retain(looks_out);
    faces
}

/// The space below triangles, closed around their border; `None` without any. Below the middle of it hair leaves
/// on the inside.
fn sheet(faces: &[&Face]) -> Option<DistanceGrid> {
    // Vertices at one place are one, or the sides of a fold would come apart.
    let mut known: HashMap<[u32; 3], u32> = default();
    let (mut places, mut normals): (Vec<Vec3>, Vec<Vec3>) = default();
    let mut outer: Vec<[u32; 3]> = Vec::with_capacity(faces.len());
    for face in faces {
        let area = face.area();
        outer.push(face.corners.map(|p| {
            let v = *known.entry(p.to_array().map(|x| (x + 0.0).to_bits())).or_insert_with(|| {
                places.push(p);
                normals.push(Vec3::ZERO);
                places.len() as u32 - 1
            });
            normals[v as usize] += area;
            v
        }));
    }
    let count = places.len() as u32;
    let way = |v: usize| normals[v].normalize_or_zero();
    let mut corners: Vec<Vec3> =
        places.iter().enumerate().map(|(v, p)| *p + way(v) * OUT).collect();
    corners.extend(places.iter().enumerate().map(|(v, p)| *p - way(v) * DEPTH));
    let edges = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]];
    let all: HashSet<[u32; 2]> = outer.iter().flat_map(edges).collect();
    let mut triangles = outer.clone();
    triangles.extend(outer.iter().map(|[a, b, c]| [a + count, c + count, b + count]));
    for [a, b] in outer.iter().flat_map(edges).filter(|[a, b]| !all.contains(&[*b, *a])) {
        triangles.extend([[b, a, a + count], [b, a + count, b + count]]);
    }
    let how = Bake { cell: CELL, openings: Openings::Fill };
    DistanceGrid::bake_with(&corners, &triangles, &how).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A sheet behind the body, 30 cm wide, which looks along `way` (±1) in Z.
    fn cape(way: f32) -> Vec<Face> {
        let at = |x: f32, y: f32| Vec3::new(x, y, 0.15);
        let mut faces = Vec::new();
        for i in 0..6 {
            for k in 0..6 {
                let (x, y) = (-0.15 + 0.05 * i as f32, -0.2 - 0.05 * k as f32);
                let [a, b, c, d] =
                    [at(x, y), at(x + 0.05, y), at(x, y - 0.05), at(x + 0.05, y - 0.05)];
                for corners in [[a, c, b], [b, c, d]] {
                    let [p, q, r] = corners;
                    let corners = if way > 0.0 { [p, q, r] } else { [p, r, q] };
                    faces.push(Face { corners, joint: 0 });
                }
            }
        }
        faces
    }

    #[test]
    fn a_cape_is_solid_below_its_outside_whichever_way_it_looks() {
        for way in [1.0, -1.0] {
            let out = outside(cape(way));
            assert_eq!(out.len(), 72, "{way}");
            let grid = sheet(&out.iter().collect::<Vec<_>>()).unwrap();
            let at = |off: f32| grid.distance(Vec3::new(0.01, -0.3, 0.15 + off));
            assert!((at(0.02) - 0.018).abs() < 2e-3, "{way}: {}", at(0.02));
            // Deeper by as much on the way in: hair leaves on the outside.
            assert!((at(-0.005) + 0.007).abs() < 2e-3 && (at(-0.02) + 0.022).abs() < 2e-3);
            assert!(at(-0.1) > 0.03, "{way}: {}", at(-0.1));
        }
    }

    #[test]
    fn of_two_layers_the_outer_one_is_enough() {
        let mut both = cape(1.0);
        let mut inner = cape(-1.0);
        inner.iter_mut().for_each(|f| f.corners = f.corners.map(|p| p - Vec3::Z * 0.005));
        both.extend(inner);
        let out = outside(both);
        assert_eq!(out.len(), 72);
        assert!(out.iter().all(|face| face.corners[0].z > 0.149));
        assert!(sheet(&[]).is_none());
    }
}
