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

/// Of so many points one is in the coarse search, which finds where the fine one begins.
const COARSE: usize = 8;

/// Steps of a fine search at most; two are the rule.
const MOST_STEPS: usize = 64;

/// Points all over a surface with its normals.
pub(super) struct Shell {
    points: Vec<(Vec3, Vec3)>,
    /// How far apart they are (m).
    spacing: f32,
    /// Beyond this the surface is not felt (m).
    reach: f32,
    /// Some of the points.
    coarse: KdTree,
    /// Finds a point's neighbours.
    fine: UniformGrid,
    /// Finds the points over which a normal is a mean.
    around: UniformGrid,
    /// How far these are away at most (m).
    smooth: f32,
    /// The mean normals that were asked for: strands feel a small part of most meshes.
    means: Vec<Cell<Option<Vec3>>>,
}

/// What a strand felt last: the next step is near it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Felt {
    /// Where the whole surface was searched, and how far from there that holds (m).
    at: Vec3,
    holds: f32,
    /// The nearest point.
    nearest: Option<usize>,
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
        let smooth = smooth.min(MOST_SMOOTH * spacing);
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

    /// How far `point` is short of being `clearance` (m) off the surface, and which way is off.
    /// `felt` is of the step before.
    pub(super) fn depth(
        &self,
        point: Vec3,
        clearance: f32,
        felt: &mut Felt,
    ) -> Option<(f32, Vec3)> {
        // Whatever else comes near is as far as this by then, less the way: half of it is left.
        let most = 8.0 * self.spacing;
        if point.distance(felt.at) >= felt.holds {
            let none = (u32::MAX, (self.reach + most).powi(2));
            let (found, square) = self.coarse.nearer_than(point, none);
            felt.nearest = (found != u32::MAX).then_some(found as usize);
            felt.at = point;
            felt.holds = (0.5 * square.sqrt()).clamp(self.spacing, most);
        }
        let nearest = self.walk(point, felt.nearest?);
        felt.nearest = Some(nearest);
        let place = self.points[nearest].0;
        let square = point.distance_squared(place);
        let normal = self.normal(nearest);
        let height = (point - place).dot(normal);
        // Beside the surface, beyond its rim, nothing is in the way.
        let beside = (square - height * height).max(0.0).sqrt();
        let depth = clearance - height;
        (depth > 0.0 && beside < 3.0 * self.spacing).then_some((depth, normal))
    }

    /// From a point of the surface over its neighbours to the one that is nearest to `to`.
    fn walk(&self, to: Vec3, from: usize) -> usize {
        let square = |i: usize| to.distance_squared(self.points[i].0);
        let mut best = (square(from), from);
        for _ in 0..MOST_STEPS {
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
        // Sheets that lie back to back cancel each other.
        let mean = sum.normalize_or(normal);
        let mean = if mean.dot(normal) > 0.0 { mean } else { normal };
        self.means[i].set(Some(mean));
        mean
    }
}
