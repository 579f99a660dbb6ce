//! Solids and zones as lines.

use super::HairGizmos;
use crate::{
    forces::{
        contact::{ColliderShape, HairCollider},
        environment::ZoneShape,
    },
    hair::strand::Pose,
    solver::rod::shape::Shape,
};
use bevy::{gizmos::gizmos::GizmoBuffer, math::Isometry3d, prelude::*};

/// Cells of a contour, along and across.
const CELLS: u32 = 32;

/// Half the side of the square that stands for an infinite plane (m).
const PLANE: f32 = 1.0;

/// The lines of a frame.
pub(super) type Lines = GizmoBuffer<HairGizmos, ()>;

fn isometry(pose: &Pose) -> Isometry3d {
    Isometry3d::new(pose.translation, pose.rotation)
}

/// Draws a collider, with valid values.
pub(super) fn collider(lines: &mut Lines, pose: &Pose, collider: &HairCollider, color: Color) {
    let (at, scale) = (isometry(pose), pose.scale);
    match &collider.shape {
        ColliderShape::Sphere(s) => {
            lines.sphere(at, s.radius * scale, color);
        }
        ColliderShape::Capsule(c) => {
            let (radius, half_length) = (c.radius * scale, c.half_length * scale);
            lines.primitive_3d(&Capsule3d { radius, half_length }, at, color);
        }
        ColliderShape::Plane(p) => plane(lines, at, p.normal, color),
        ColliderShape::Cylinder(c) => {
            let (radius, half_height) = (c.radius * scale, c.half_height * scale);
            lines.primitive_3d(&Cylinder { radius, half_height }, at, color);
        }
        ColliderShape::Cuboid { cuboid, rounding } => {
            let size = 2.0 * cuboid.half_size * scale;
            lines.rounded_cuboid(at, size, color).edge_radius(rounding * scale);
        }
        ColliderShape::Ellipsoid { radii } | ColliderShape::Hat { radii, .. } => {
            ellipsoid(lines, at, *radii * scale, color);
        }
        ColliderShape::Hull(hull) => {
            let depth = |p| hull.planes().map(|(n, d)| n.dot(p) - d).fold(f32::MIN, f32::max);
            contours(lines, pose, Shape::Hull(hull.clone()).bounds(), depth, color);
        }
        ColliderShape::Grid(grid) => {
            let distance = |p| grid.distance(p);
            contours(lines, pose, Shape::Grid(grid.clone()).bounds(), distance, color);
        }
    }
}

/// Draws the shape of a zone.
pub(super) fn zone(lines: &mut Lines, pose: &Pose, shape: ZoneShape, half: Vec3, color: Color) {
    let at = isometry(pose);
    match shape {
        ZoneShape::Ellipsoid => ellipsoid(lines, at, half * pose.scale, color),
        ZoneShape::Box => {
            lines.primitive_3d(&Cuboid { half_size: half * pose.scale }, at, color);
        }
        ZoneShape::HalfSpace => plane(lines, at, Dir3::Y, color),
    }
}

/// Draws a cylinder along Y.
pub(super) fn cylinder(lines: &mut Lines, pose: &Pose, radius: f32, height: f32, color: Color) {
    let shape = Cylinder::new(radius * pose.scale, height * pose.scale);
    lines.primitive_3d(&shape, isometry(pose), color);
}

fn plane(lines: &mut Lines, at: Isometry3d, normal: Dir3, color: Color) {
    let turn = Quat::from_rotation_arc(Vec3::Z, *normal);
    let turned = Isometry3d { rotation: at.rotation * turn, ..at };
    lines.rect(turned, Vec2::splat(2.0 * PLANE), color);
}

fn ellipsoid(lines: &mut Lines, at: Isometry3d, radii: Vec3, color: Color) {
    for (turn, half) in [
        (Quat::IDENTITY, radii.xy()),
        (Quat::from_rotation_arc(Vec3::Z, Vec3::X), radii.zy()),
        (Quat::from_rotation_arc(Vec3::Z, Vec3::Y), radii.xz()),
    ] {
        let turned = Isometry3d { rotation: at.rotation * turn, ..at };
        lines.ellipse(turned, half, color);
    }
}

/// Draws where three planes through the middle of a box, given with half its size, cut a surface, which a
/// signed distance gives.
fn contours(
    lines: &mut Lines,
    pose: &Pose,
    (middle, half): (Vec3, Vec3),
    distance: impl Fn(Vec3) -> f32,
    color: Color,
) {
    let half = 1.05 * half;
    for (across, up) in [(Vec3::X, Vec3::Y), (Vec3::Z, Vec3::Y), (Vec3::X, Vec3::Z)] {
        let at = |i: u32, j: u32| {
            let share = |n: u32| 2.0 * n as f32 / CELLS as f32 - 1.0;
            let place = middle + half * (across * share(i) + up * share(j));
            (place, distance(place))
        };
        let row = |j: u32| (0..=CELLS).map(|i| at(i, j)).collect::<Vec<_>>();
        let mut below = row(0);
        for j in 1..=CELLS {
            let above = row(j);
            for (b, a) in below.windows(2).zip(above.windows(2)) {
                let corners = [b[0], b[1], a[1], a[0]];
                let crossing = |k: usize| {
                    let ((p, d), (q, e)) = (corners[k], corners[(k + 1) % 4]);
                    ((d < 0.0) != (e < 0.0)).then(|| pose.point_out(p.lerp(q, d / (d - e))))
                };
                let mut crossings = (0..4).filter_map(crossing);
                while let (Some(a), Some(b)) = (crossings.next(), crossings.next()) {
                    lines.line(a, b, color);
                }
            }
            below = above;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::forces::contact::DistanceGrid;

    fn drawn(collider: &HairCollider, pose: &Pose) -> Vec<Vec3> {
        let mut lines = Lines::new();
        super::collider(&mut lines, pose, collider, Color::WHITE);
        let all = lines.strip_positions.into_iter().chain(lines.list_positions);
        all.filter(|p| !p.is_nan()).collect()
    }

    #[test]
    fn lines_of_each_shape_lie_on_its_surface() {
        let pose = Pose {
            translation: Vec3::new(1.0, 2.0, 3.0),
            rotation: Quat::from_rotation_z(0.7),
            scale: 2.0,
        };
        let cube = Cuboid::new(0.2, 0.3, 0.4).mesh().build();
        let corners = cube.attribute(Mesh::ATTRIBUTE_POSITION).unwrap().as_float3().unwrap();
        let corners: Vec<Vec3> = corners.iter().map(|p| Vec3::from_array(*p)).collect();
        let all: Vec<u32> = cube.indices().unwrap().iter().map(|i| i as u32).collect();
        let triangles: Vec<[u32; 3]> = all.chunks(3).map(|t| [t[0], t[1], t[2]]).collect();
        let baked = DistanceGrid::bake(&corners, &triangles, 0.01).unwrap();
        let (half, flat) = (Vec3::new(0.1, 0.15, 0.2), |p: Vec3| p.y.abs());
        let outside = move |p: Vec3| {
            let beyond = p.abs() - half;
            (beyond.max(Vec3::ZERO).length() + beyond.max_element().min(0.0)).abs()
        };
        let ball = |r: f32| move |p: Vec3| (p.length() - r).abs();
        let radii = Vec3::new(0.1, 0.2, 0.3);
        let bolt = |p: Vec3| {
            let beyond = Vec2::new(p.xz().length() - 0.1, p.y.abs() - 0.2);
            beyond.max_element().abs()
        };
        let pill = |p: Vec3| (p.distance(Vec3::Y * p.y.clamp(-0.1, 0.1)) - 0.1).abs();
        let cases: [(HairCollider, &dyn Fn(Vec3) -> f32, f32); 8] = [
            (HairCollider::sphere(0.1).unwrap(), &ball(0.1), 1e-4),
            (HairCollider::capsule(0.1, 0.2).unwrap(), &pill, 1e-3),
            (HairCollider::plane(Dir3::Y), &flat, 1e-4),
            (HairCollider::cylinder(0.1, 0.4).unwrap(), &bolt, 1e-3),
            (HairCollider::cuboid(2.0 * half).unwrap(), &outside, 1e-4),
            (
                HairCollider::ellipsoid(radii).unwrap(),
                &|p| ((p / radii).length() - 1.0).abs(),
                1e-3,
            ),
            (HairCollider::hull(&corners).unwrap(), &outside, 6e-3),
            (HairCollider::grid(baked), &outside, 8e-3),
        ];
        for (collider, distance, within) in cases {
            let places = drawn(&collider, &pose);
            assert!(places.len() >= 5, "{:?}", collider.shape);
            for place in places {
                let off = distance(pose.point_in(place));
                assert!(off < within, "{:?} at {place}: {off}", collider.shape);
            }
        }
    }

    #[test]
    fn each_zone_has_lines_about_its_middle() {
        let pose = Pose { translation: Vec3::X * 5.0, scale: 2.0, ..default() };
        for shape in [ZoneShape::Ellipsoid, ZoneShape::Box, ZoneShape::HalfSpace] {
            let mut lines = Lines::new();
            zone(&mut lines, &pose, shape, Vec3::new(0.5, 0.25, 0.5), Color::WHITE);
            let places = lines.strip_positions.iter().chain(&lines.list_positions);
            let places: Vec<_> = places.filter(|p| !p.is_nan()).collect();
            assert!(places.len() >= 5);
            let farthest = places.iter().map(|p| (p.x - 5.0).abs()).fold(0.0, f32::max);
            assert!((farthest - 1.0).abs() < 0.01, "{shape:?}: {farthest}");
        }
    }
}
