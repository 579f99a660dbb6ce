//! A head for a groom that comes without one.

use super::linear::solve;
use crate::groom::Groom;
use bevy::math::{DVec3, bounding::BoundingSphere};

impl Groom {
    /// The ball (m) whose surface the roots lie on best, by least squares: a collider for a groom
    /// whose head is not at hand, and its place. It is shrunk until no root lies within, because what
    /// grows inside a collider is stretched out of it. `None` where roots do not curve, as on a flat patch, or are fewer than four.
    ///
    /// ```
    /// # use bevy_keratin::groom::Groom; use bevy::prelude::*;
    /// let ways = [Dir3::X, Dir3::Y, Dir3::Z, Dir3::NEG_X, Dir3::NEG_Z];
    /// let strand = |way: Dir3| [Vec3::Y + way * 0.09, Vec3::Y + way * 0.2];
    /// let head = Groom::from_polylines(ways.map(strand)).unwrap().fit_head().unwrap();
    /// assert!(head.center.distance(Vec3A::Y) < 1e-4 && (head.radius() - 0.09).abs() < 1e-4);
    /// # use bevy::math::Vec3A;
    /// ```
    pub fn fit_head(&self) -> Option<BoundingSphere> {
        let count = self.len();
        if count < 4 {
            return None;
        }
        let middle = self.roots().map(|r| r.as_dvec3()).sum::<DVec3>() / count as f64;
        let spread = self.roots().map(|r| r.as_dvec3().distance_squared(middle)).sum::<f64>();
        let spread = (spread / count as f64).sqrt();
        // |p|² = 2 c·p + d is linear in the centre c and d = r² − |c|²; about the middle, in units of
        // the spread, the sums are well scaled.
        let (mut sums, mut rights) = ([[0.0_f64; 4]; 4], [0.0_f64; 4]);
        for root in self.roots() {
            let p = (root.as_dvec3() - middle) / spread;
            let row = [p.x, p.y, p.z, 1.0];
            let right = p.length_squared();
            for (k, a) in row.iter().enumerate() {
                row.iter().zip(&mut sums[k]).for_each(|(b, sum)| *sum += a * b);
                rights[k] += a * right;
            }
        }
        let [x, y, z, d] = solve(sums, rights, 1e-5 * count as f64)?;
        let centre = DVec3::new(x, y, z) * 0.5;
        let radius = (d + centre.length_squared()).max(0.0).sqrt() * spread;
        let centre = (middle + centre * spread).as_vec3();
        let nearest = self.roots().map(|r| r.distance(centre)).fold(f32::MAX, f32::min);
        let radius = nearest.min(radius as f32);
        (centre.is_finite() && radius > 0.0 && radius < 1e3 * spread as f32)
            .then(|| BoundingSphere::new(centre, radius))
    }
}
