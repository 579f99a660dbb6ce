//! Signed distances to a surface at the points of a grid, interpolated between them.

use crate::base::lanes::{Real, V3, splat};
use bevy::reflect::Reflect;
use glam::{UVec3, Vec3};
use std::sync::Arc;

/// Signed distances to a surface at the points of a grid: a collider of any shape. Cheap to clone:
/// clones share the samples.
///
/// Made by [`DistanceGrid::bake`], used by [`HairCollider::grid`](crate::HairCollider::grid).
/// Distances are interpolated: flat parts of a surface are exact, edges are rounded off by up to a
/// third of a cell, and farther from the surface than a cell or two distances are accurate to three
/// cells. Beyond the grid they are extrapolated from its border.
#[derive(Reflect, Clone, Debug)]
#[reflect(opaque)]
#[reflect(Clone, PartialEq, Debug)]
pub struct DistanceGrid {
    samples: Arc<Samples>,
    /// How much larger the surface is than the samples' along the axes.
    stretch: Vec3,
}

#[derive(PartialEq)]
struct Samples {
    origin: Vec3,
    cell: f32,
    points: UVec3,
    /// Along X first, then Y, then Z; negative inside.
    distances: Vec<f32>,
    /// The box around what is inside.
    low: Vec3,
    high: Vec3,
    thickness: f32,
}

impl core::fmt::Debug for Samples {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_struct("Samples")
            .field("origin", &self.origin)
            .field("cell", &self.cell)
            .field("points", &self.points)
            .finish_non_exhaustive()
    }
}

impl PartialEq for DistanceGrid {
    fn eq(&self, other: &Self) -> bool {
        self.stretch == other.stretch
            && (Arc::ptr_eq(&self.samples, &other.samples) || self.samples == other.samples)
    }
}

impl DistanceGrid {
    /// A grid of `points` distances, at least two along each axis; the solid is within `low…high`.
    pub(crate) fn of_samples(
        origin: Vec3,
        cell: f32,
        points: UVec3,
        distances: Vec<f32>,
        (low, high): (Vec3, Vec3),
    ) -> Self {
        assert_eq!(distances.len(), points.element_product() as usize);
        let thickness = -distances.iter().copied().fold(-cell, f32::min);
        let samples = Samples { origin, cell, points, distances, low, high, thickness };
        Self { samples: Arc::new(samples), stretch: Vec3::ONE }
    }

    /// Larger by these factors along the axes. Distances are then of first order: those of the samples
    /// over the length of their gradient.
    pub(crate) fn stretched(&self, by: Vec3) -> Self {
        Self { stretch: self.stretch * by, ..self.clone() }
    }

    /// Spacing of its points (m).
    pub fn cell(&self) -> f32 {
        self.samples.cell * self.stretch.min_element()
    }

    /// Number of points along each axis.
    pub fn points(&self) -> UVec3 {
        self.samples.points
    }

    /// The signed distance of a point to the surface (m), negative inside.
    pub fn distance(&self, place: Vec3) -> f32 {
        self.sample(V3::new(place.x, place.y, place.z)).1
    }

    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        let Samples { low, high, .. } = *self.samples;
        (0.5 * (low + high) * self.stretch, 0.5 * (high - low) * self.stretch)
    }

    /// An upper bound of its extent from the origin.
    pub(crate) fn reach(&self) -> f32 {
        (self.samples.low.abs().max(self.samples.high.abs()) * self.stretch).length()
    }

    /// Half of the thickest part, at most of four cells, so that continuous collision also covers
    /// thinner parts.
    pub(super) fn thickness(&self) -> f32 {
        self.samples.thickness.min(4.0 * self.samples.cell) * self.stretch.min_element()
    }

    /// The normalised gradient of the distance, and the distance.
    #[inline(always)]
    pub(super) fn sample<R: Real>(&self, p: V3<R>) -> (V3<R>, R) {
        if self.stretch == Vec3::ONE {
            return self.samples.at(p);
        }
        let (normal, distance) = self.samples.at(self.squeezed(p));
        let slope = self.squeezed(normal);
        let shorter = p.x.lit(1.0) / slope.dot(slope).sqrt();
        (slope.scale(shorter), distance * shorter)
    }

    /// A distance within which the surface is not, but for the interpolation: negative inside.
    #[inline(always)]
    pub(super) fn free<R: Real>(&self, p: V3<R>) -> R {
        if self.stretch == Vec3::ONE {
            return self.samples.at(p).1;
        }
        self.samples.at(self.squeezed(p)).1 * p.x.lit(self.stretch.min_element().into())
    }

    #[inline(always)]
    fn squeezed<R: Real>(&self, v: V3<R>) -> V3<R> {
        let by = splat(v.x, self.stretch.recip());
        V3::new(v.x * by.x, v.y * by.y, v.z * by.z)
    }
}

impl Samples {
    /// As [`DistanceGrid::sample`], without a stretch.
    #[inline(always)]
    fn at<R: Real>(&self, p: V3<R>) -> (V3<R>, R) {
        let Self { origin, cell, points, distances, .. } = self;
        let lit = |value: f32| p.x.lit(value.into());
        let (zero, one) = (lit(0.0), lit(1.0));
        let at = (p - splat(p.x, *origin)).scale(lit(1.0 / cell));
        let last = splat(p.x, (*points - 1).as_vec3());
        let held = V3::new(
            at.x.max(zero).min(last.x),
            at.y.max(zero).min(last.y),
            at.z.max(zero).min(last.z),
        );
        let corner = V3::new(
            held.x.min(last.x - one).floor(),
            held.y.min(last.y - one).floor(),
            held.z.min(last.z - one).floor(),
        );
        let f = held - corner;
        let row = points.x as usize;
        let layer = row * points.y as usize;
        // Integers below 2²⁴ are exact.
        let index = corner.z.mul_add(lit(points.y as f32), corner.y);
        let index = index.mul_add(lit(points.x as f32), corner.x);
        let after = [0, 1, row, row + 1, layer, layer + 1, layer + row, layer + row + 1];
        let v = index.gather(distances, after);
        let blend = |a: R, b: R, t: R| (b - a).mul_add(t, a);
        // Along X, at the four edges.
        let steps = [v[1] - v[0], v[3] - v[2], v[5] - v[4], v[7] - v[6]];
        let [a, b, c, d] = [0, 1, 2, 3].map(|k| steps[k].mul_add(f.x, v[2 * k]));
        let (near, far) = (blend(a, b, f.y), blend(c, d, f.y));
        let slope = V3::new(
            blend(blend(steps[0], steps[1], f.y), blend(steps[2], steps[3], f.y), f.z),
            blend(b - a, d - c, f.z),
            far - near,
        );
        // Beyond the grid the distance to it is added.
        let beyond = at - held;
        let apart = beyond.dot(beyond).sqrt();
        let slope = slope.scale(lit(1.0 / cell));
        let slope = beyond.scale_add(one / apart.max(lit(1e-6)), slope);
        let length = slope.dot(slope).sqrt();
        let tiny = lit(1e-6);
        let up = V3::new(zero, one, zero);
        let normal = V3::select(length.lt(tiny), up, slope.scale(one / length.max(tiny)));
        (normal, apart.mul_add(lit(*cell), blend(near, far, f.z)))
    }
}
