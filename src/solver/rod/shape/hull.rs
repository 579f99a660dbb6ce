//! A convex hull as an intersection of half-spaces.

use crate::base::lanes::{Real, V3, splat};
use bevy::reflect::Reflect;
use glam::{Vec3, Vec4};
use std::sync::Arc;

/// The convex hull of points: an intersection of half-spaces. Cheap to clone: clones share the
/// planes.
///
/// Made by [`ConvexHull::new`], used by [`HairCollider::hull`](crate::HairCollider::hull).
#[derive(Reflect, Clone, Debug)]
#[reflect(opaque)]
#[reflect(Clone, PartialEq, Debug)]
pub struct ConvexHull(Arc<Planes>);

#[derive(Debug, PartialEq)]
struct Planes {
    /// Outward unit normals and their distances from the origin.
    planes: Vec<Vec4>,
    low: Vec3,
    high: Vec3,
    thickness: f32,
}

impl PartialEq for ConvexHull {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0) || self.0 == other.0
    }
}

impl ConvexHull {
    /// The intersection of the half-spaces behind these planes, with its bounding box and a point
    /// inside.
    pub(crate) fn of_planes(planes: Vec<Vec4>, (low, high): (Vec3, Vec3), middle: Vec3) -> Self {
        let inside = |plane: &Vec4| plane.w - plane.truncate().dot(middle);
        let thickness = planes.iter().map(inside).fold(f32::INFINITY, f32::min);
        Self(Arc::new(Planes { planes, low, high, thickness }))
    }

    /// Its planes: outward unit normals and distances from the origin (m).
    pub fn planes(&self) -> impl ExactSizeIterator<Item = (Vec3, f32)> {
        self.0.planes.iter().map(|plane| (plane.truncate(), plane.w))
    }

    /// Larger by these factors along the axes.
    pub(crate) fn stretched(&self, by: Vec3) -> Self {
        let Planes { planes, low, high, thickness } = &*self.0;
        let stretched = |plane: &Vec4| {
            let normal = plane.truncate() / by;
            normal.extend(plane.w) / normal.length()
        };
        Self(Arc::new(Planes {
            planes: planes.iter().map(stretched).collect(),
            low: *low * by,
            high: *high * by,
            thickness: thickness * by.min_element(),
        }))
    }

    pub(super) fn bounds(&self) -> (Vec3, Vec3) {
        (0.5 * (self.0.low + self.0.high), 0.5 * (self.0.high - self.0.low))
    }

    /// An upper bound of its extent from the origin.
    pub(crate) fn reach(&self) -> f32 {
        self.0.low.abs().max(self.0.high.abs()).length()
    }

    pub(super) fn thickness(&self) -> f32 {
        self.0.thickness
    }

    /// Exact inside; too small outside near edges and corners.
    #[inline(always)]
    pub(super) fn distance<R: Real>(&self, p: V3<R>) -> (V3<R>, R) {
        let mut most = p.x.lit(f64::from(f32::MIN));
        let mut normal = V3::new(p.x.lit(0.0), p.x.lit(1.0), p.x.lit(0.0));
        for plane in &self.0.planes {
            let n = splat(p.x, plane.truncate());
            let above = p.dot(n) - p.x.lit(plane.w.into());
            normal = V3::select(most.lt(above), n, normal);
            most = most.max(above);
        }
        (normal, most)
    }
}
