//! A head for a groom that comes without one.

use super::linear_system::solve;
use crate::authoring::groom::Groom;
use bevy::math::{DVec3, bounding::BoundingSphere};

impl Groom {
    /// The ball (m) that best fits the roots, by least squares: a collider for a groom without a
    /// head mesh. It is shrunk until no root lies inside, because hair that grows inside a
    /// collider is pushed out of it.
    ///
    /// `None` where the fit is unreliable: fewer than four roots, nearly flat roots or roots that do not
    /// lie on a ball, or a patch such as a tail's, whose roots are all within half a radius of their
    /// middle. The ball is never wider than the groom itself.
    ///
    /// ```
    /// # use bevy_keratin::authoring::groom::Groom; use bevy::prelude::*;
    /// let directions = [Dir3::X, Dir3::Y, Dir3::Z, Dir3::NEG_X, Dir3::NEG_Z];
    /// let strand = |d: Dir3| [Vec3::Y + d * 0.09, Vec3::Y + d * 0.2];
    /// let head = Groom::from_polylines(directions.map(strand)).unwrap().fit_head().unwrap();
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
        // A small patch fits balls of almost any size.
        let reach = self.roots().map(|r| r.as_dvec3().distance(middle)).fold(0.0, f64::max);
        let is_patch = radius.is_nan() || reach < 0.5 * radius;
        let nearest = self.roots().map(|r| r.distance(centre)).fold(f32::MAX, f32::min);
        // Shrunk too much: the roots do not lie on a ball.
        let is_ball = f64::from(nearest) >= 0.5 * radius;
        let radius = nearest.min(radius as f32);
        let (low, high) = self.extents()?;
        let within = 2.0 * radius <= (high - low).max_element();
        (is_ball && !is_patch && within && centre.is_finite() && radius > 0.0)
            .then(|| BoundingSphere::new(centre, radius))
    }
}
