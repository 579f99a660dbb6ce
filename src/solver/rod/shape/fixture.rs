//! Shapes for tests.

use super::{ConvexHull, DistanceGrid, Shape};
use glam::{UVec3, Vec2, Vec3, Vec4};

/// A box and an ellipsoid, half a slanting box as a hull, a pear as a grid, each about 0.1 in size.
pub(crate) fn all_shapes() -> [Shape; 4] {
    [
        Shape::Cuboid { half: Vec3::new(0.05, 0.1, 0.02), rounding: 0.01 },
        Shape::Ellipsoid { radii: Vec3::new(0.1, 0.03, 0.06) },
        Shape::Hull(hull()),
        Shape::Grid(pear()),
    ]
}

fn hull() -> ConvexHull {
    let plane = |x: f32, y: f32, z: f32, w: f32| Vec3::new(x, y, z).normalize().extend(w);
    let planes: Vec<Vec4> = vec![
        plane(1.0, 0.0, 0.0, 0.05),
        plane(-1.0, 0.0, 0.0, 0.05),
        plane(0.0, 1.0, 0.0, 0.04),
        plane(0.0, -1.0, 0.0, 0.04),
        plane(0.0, 0.0, 1.0, 0.06),
        plane(0.0, 0.0, -1.0, 0.06),
        plane(1.0, 1.0, 1.0, 0.03),
    ];
    let size = Vec3::new(0.05, 0.04, 0.06);
    ConvexHull::of_planes(planes, (-size, size), Vec3::ZERO)
}

pub(crate) const CELL: f32 = 0.01;

/// The union of two balls, with exact distances.
pub(crate) fn pear() -> DistanceGrid {
    let points = UVec3::new(22, 26, 22);
    let origin = Vec3::new(-0.105, -0.105, -0.105);
    let at = |k: u32| {
        let [nx, ny] = [points.x, points.y];
        origin + CELL * UVec3::new(k % nx, k / nx % ny, k / (nx * ny)).as_vec3()
    };
    let distances = (0..points.element_product()).map(|k| pear_distance(at(k))).collect();
    let half = Vec3::new(0.07, 0.0, 0.07);
    let bounds = (Vec3::NEG_Y * 0.07 - half, Vec3::Y * 0.12 + half);
    DistanceGrid::of_samples(origin, CELL, points, distances, bounds)
}

/// The distances to the surfaces of its two balls.
pub(crate) fn pear_balls(p: Vec3) -> (f32, f32) {
    (p.length() - 0.07, (p - Vec3::Y * 0.08).length() - 0.04)
}

pub(crate) fn pear_distance(p: Vec3) -> f32 {
    // Where the two balls meet: height and radius of the ring.
    const RING: Vec2 = Vec2::new(0.035_002, 0.060_625);
    let (low, high) = pear_balls(p);
    if low.min(high) >= 0.0 {
        return low.min(high);
    }
    // Inside, the nearest point of a ball's surface counts only where the other does not cover it.
    let at = Vec2::new(p.x.hypot(p.z), p.y);
    let over = at - Vec2::Y * 0.08;
    let mut nearest = at.distance(RING);
    if 0.07 * at.y <= RING.y * at.length() {
        nearest = nearest.min(low.abs());
    }
    if 0.04 * over.y >= (RING.y - 0.08) * over.length() {
        nearest = nearest.min(high.abs());
    }
    -nearest
}
