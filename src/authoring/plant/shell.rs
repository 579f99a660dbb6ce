//! Distance to a mesh near its surface, for strands that lie on it.

use super::surface::Surface;
use crate::base::grid::{KdTree, UniformGrid};
use bevy::prelude::*;
use core::cell::Cell;
use rand::{SeedableRng, rngs::Xoshiro256PlusPlus};

/// Number of sample points of the mesh.
const POINTS: usize = 40_000;

/// The maximum smoothing radius of normals, in units of the spacing of points.
const MAX_SMOOTHING: f32 = 6.0;

/// Every `COARSE`th point is in the coarse tree, which gives the start of the fine search.
const COARSE: usize = 8;

/// The maximum number of steps of a fine search; usually two.
const MAX_STEPS: usize = 64;

/// Points all over a surface with its normals.
pub(super) struct Shell {
    points: Vec<(Vec3, Vec3)>,
    /// Their mean spacing (m).
    spacing: f32,
    /// Distance beyond which the surface has no effect (m).
    reach: f32,
    /// The coarse points.
    coarse: KdTree,
    /// Finds a point's neighbours.
    fine: UniformGrid,
    /// Finds the points over which a normal is averaged.
    around: UniformGrid,
    /// The radius of that average (m).
    smooth: f32,
    /// Cache of mean normals: strands come near only a small part of most meshes.
    means: Vec<Cell<Option<Vec3>>>,
}

/// Result of a strand's last query, where the next one starts.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct SurfaceQuery {
    /// Point of the last coarse search, and the distance from there within which it stays valid (m).
    at: Vec3,
    holds: f32,
    /// The nearest point.
    nearest: Option<usize>,
}

impl Shell {
    /// A shell that acts up to `reach` (m). Its normals are means over about `smooth` (m): hair
    /// that bends over that length slides over an ear and does not follow its rim.
    pub(super) fn of(surface: &Surface, reach: f32, smooth: f32) -> Self {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(0);
        let points: Vec<_> = (surface.draw(POINTS, &mut random))
            .map(|root| (root.place.position, root.place.normal))
            .collect();
        let spacing = (surface.area() / POINTS as f64).sqrt() as f32;
        let smooth = smooth.min(MAX_SMOOTHING * spacing);
        let places = || points.iter().map(|p| p.0).zip(0u32..);
        let grid = |cell: f32| {
            let mut grid = UniformGrid::default();
            grid.build(cell, places());
            grid
        };
        Self {
            spacing,
            reach: reach + 2.0 * spacing,
            coarse: KdTree::new(places().step_by(COARSE)),
            fine: grid(2.0 * spacing),
            around: grid(smooth),
            smooth,
            means: vec![Cell::new(None); points.len()],
            points,
        }
    }

    /// How much nearer than `clearance` (m) `point` is to the surface, and the direction away from it.
    /// `query` is the result of the previous step.
    pub(super) fn depth(
        &self,
        point: Vec3,
        clearance: f32,
        query: &mut SurfaceQuery,
    ) -> Option<(f32, Vec3)> {
        // Another part of the surface cannot be nearer until the point has moved half this distance.
        let most = 8.0 * self.spacing;
        if point.distance(query.at) >= query.holds {
            let none = (u32::MAX, (self.reach + most).powi(2));
            let (found, square) = self.coarse.nearer_than(point, none);
            query.nearest = (found != u32::MAX).then_some(found as usize);
            query.at = point;
            query.holds = (0.5 * square.sqrt()).clamp(self.spacing, most);
        }
        let nearest = self.walk(point, query.nearest?);
        query.nearest = Some(nearest);
        let place = self.points[nearest].0;
        let square = point.distance_squared(place);
        let normal = self.normal(nearest);
        let height = (point - place).dot(normal);
        // Beyond the rim of an open surface there is nothing to avoid.
        let beside = (square - height * height).max(0.0).sqrt();
        let depth = clearance - height;
        (depth > 0.0 && beside < 3.0 * self.spacing).then_some((depth, normal))
    }

    /// Walks from a point of the surface over its neighbours to the one nearest to `to`. Successive
    /// queries of a strand are close together, so a few steps on the grid from the previous result are
    /// cheaper than a search in a k-d tree of all points; the coarse tree is needed only for the start.
    fn walk(&self, to: Vec3, from: usize) -> usize {
        let square = |i: usize| to.distance_squared(self.points[i].0);
        let mut best = (square(from), from);
        for _ in 0..MAX_STEPS {
            let before = best.1;
            self.fine.for_each_near(self.points[before].0, |i| {
                let square = square(i as usize);
                if square < best.0 {
                    best = (square, i as usize);
                }
            });
            if best.1 == before {
                break;
            }
        }
        best.1
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
        // Normals of opposite sheets cancel.
        let mean = sum.normalize_or(normal);
        let mean = if mean.dot(normal) > 0.0 { mean } else { normal };
        self.means[i].set(Some(mean));
        mean
    }
}
