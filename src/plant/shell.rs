//! How far off a mesh a point is, near it: for strands that lie on it.

use super::surface::Surface;
use crate::grid::{KdTree, UniformGrid};
use bevy::prelude::*;
use core::cell::Cell;
use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};

/// Points by which the mesh is felt.
const POINTS: usize = 40_000;

/// Over how many points in a row normals are smoothed at most.
const MOST_SMOOTH: f32 = 6.0;

/// Points all over a surface with its normals.
pub(super) struct Shell {
    tree: KdTree,
    points: Vec<(Vec3, Vec3)>,
    /// How far apart they are (m).
    spacing: f32,
    /// Beyond this the surface is not felt (m).
    reach: f32,
    /// Finds the points over which a normal is a mean.
    around: UniformGrid,
    /// How far these are away at most (m).
    smooth: f32,
    /// The mean normals that were asked for: strands feel a small part of most meshes.
    means: Vec<Cell<Option<Vec3>>>,
}

/// What a strand felt last: the next step is near it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Felt(Option<u32>);

impl Shell {
    /// A shell that is felt up to `reach` (m). Its normals are means over about `smooth` (m): hair
    /// that bends over that length slides over an ear and does not follow its rim.
    pub(super) fn of(surface: &Surface, reach: f32, smooth: f32) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
        let points: Vec<_> = (surface.draw(POINTS, &mut random))
            .map(|root| (root.place.position, root.place.normal))
            .collect();
        let spacing = (surface.area() / POINTS as f64).sqrt() as f32;
        let smooth = smooth.min(MOST_SMOOTH * spacing);
        let places = || points.iter().map(|p| p.0).zip(0u32..);
        let mut around = UniformGrid::default();
        around.build(smooth, places());
        let tree = KdTree::new(places());
        let means = vec![Cell::new(None); points.len()];
        Self { tree, spacing, reach: reach + 2.0 * spacing, around, smooth, means, points }
    }

    /// How far `point` is short of being `clearance` (m) off the surface, and which way is off.
    /// `felt` is of the step before.
    pub(super) fn depth(
        &self,
        point: Vec3,
        clearance: f32,
        felt: &mut Felt,
    ) -> Option<(f32, Vec3)> {
        let square = |i: u32| point.distance_squared(self.points[i as usize].0);
        // A near one to begin with leaves little of the tree to be searched.
        let before = felt.0.map(|i| (i, square(i)));
        let none = (u32::MAX, self.reach * self.reach);
        let known = before.filter(|before| before.1 < none.1).unwrap_or(none);
        let (nearest, square) = self.tree.nearer_than(point, known);
        felt.0 = (nearest != u32::MAX).then_some(nearest);
        let place = self.points.get(nearest as usize)?.0;
        let normal = self.normal(nearest as usize);
        let height = (point - place).dot(normal);
        // Beside the surface, beyond its rim, nothing is in the way.
        let beside = (square - height * height).max(0.0).sqrt();
        let depth = clearance - height;
        (depth > 0.0 && beside < 3.0 * self.spacing).then_some((depth, normal))
    }

    /// The mean normal around a point.
    fn normal(&self, i: usize) -> Vec3 {
        if let Some(known) = self.means[i].get() {
            return known;
        }
        let (place, normal) = self.points[i];
        let radius = self.smooth;
        let mut sum = normal;
        self.around.for_each_near(place, |i| {
            let (other, turned) = self.points[i as usize];
            let square = place.distance_squared(other) / (radius * radius).max(1e-12);
            sum += turned * (1.0 - square).max(0.0);
        });
        // Sheets that lie back to back cancel each other.
        let mean = sum.normalize_or(normal);
        let mean = if mean.dot(normal) > 0.0 { mean } else { normal };
        self.means[i].set(Some(mean));
        mean
    }
}
