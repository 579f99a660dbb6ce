//! How far off a mesh a point is, near it: for strands that lie on it.

use super::surface::Surface;
use crate::grid::UniformGrid;
use bevy::prelude::*;
use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};

/// Points by which the mesh is felt.
const POINTS: usize = 40_000;

/// Over how many points in a row normals are smoothed at most.
const MOST_SMOOTH: f32 = 6.0;

/// Points all over a surface with its normals.
pub(super) struct Shell {
    grid: UniformGrid,
    points: Vec<(Vec3, Vec3)>,
    /// How far apart they are (m).
    spacing: f32,
}

impl Shell {
    /// A shell that is felt up to `reach` (m). Its normals are means over about `smooth` (m): hair
    /// that bends over that length slides over an ear and does not follow its rim.
    pub(super) fn of(surface: &Surface, reach: f32, smooth: f32) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
        let points: Vec<_> = (surface.draw(POINTS, &mut random))
            .map(|root| (root.place.position, root.place.normal))
            .collect();
        let spacing = (surface.area() / POINTS as f64).sqrt() as f32;
        let points = smoothed(points, smooth.min(MOST_SMOOTH * spacing));
        let mut grid = UniformGrid::default();
        grid.build(reach + 2.0 * spacing, points.iter().map(|p| p.0).zip(0u32..));
        Self { grid, points, spacing }
    }

    /// How far `point` is short of being `clearance` (m) off the surface, and which way is off.
    pub(super) fn depth(&self, point: Vec3, clearance: f32) -> Option<(f32, Vec3)> {
        let mut nearest = (f32::MAX, 0);
        self.grid.for_each_near(point, |i| {
            let square = point.distance_squared(self.points[i as usize].0);
            if square < nearest.0 {
                nearest = (square, i);
            }
        });
        let (place, normal) = *self.points.get(nearest.1 as usize)?;
        let height = (point - place).dot(normal);
        // Beside the surface, beyond its rim, nothing is in the way.
        let beside = (nearest.0 - height * height).max(0.0).sqrt();
        let depth = clearance - height;
        (nearest.0 < f32::MAX && depth > 0.0 && beside < 3.0 * self.spacing)
            .then_some((depth, normal))
    }
}

fn smoothed(points: Vec<(Vec3, Vec3)>, radius: f32) -> Vec<(Vec3, Vec3)> {
    let mut grid = UniformGrid::default();
    grid.build(radius, points.iter().map(|p| p.0).zip(0u32..));
    let mean = |&(place, normal): &(Vec3, Vec3)| {
        let mut sum = normal;
        grid.for_each_near(place, |i| {
            let (other, turned) = points[i as usize];
            let square = place.distance_squared(other) / (radius * radius).max(1e-12);
            sum += turned * (1.0 - square).max(0.0);
        });
        // Sheets that lie back to back cancel each other.
        let mean = sum.normalize_or(normal);
        (place, if mean.dot(normal) > 0.0 { mean } else { normal })
    };
    points.iter().map(mean).collect()
}
