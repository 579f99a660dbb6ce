//! The convex hull of points: incremental, each point replaces the faces that it sees by new ones.

use super::error::HullError;
use crate::solver::rod::shape::ConvexHull;
use bevy::{
    math::{DVec3, Vec4},
    platform::collections::HashSet,
    prelude::*,
};

/// The most planes of a hull.
const MAX_PLANES: usize = 64;
/// With more points than this, only those that are outermost in some direction are used.
const MAX_POINTS: usize = 1024;
const DIRECTIONS: usize = 768;
/// Sizes of what can be baked (m).
pub(super) const SIZES: core::ops::RangeInclusive<f32> = 1e-4..=5e3;
/// Planes whose normals differ by less (rad) are one.
const SAME: f64 = 1e-4;

struct Face {
    corners: [usize; 3],
    normal: DVec3,
    offset: f64,
}

impl ConvexHull {
    /// The convex hull of points (m), in their frame.
    ///
    /// Hulls with more than 64 faces keep 64 evenly distributed ones: all points are inside, and
    /// corners stick out by a few percent of the size. A [`DistanceGrid`](crate::DistanceGrid) is
    /// better there. Edges are sharp: a layer on the hull, such as a lock's radius, is mitred.
    ///
    /// # Errors
    /// When points are not finite, span no volume, or less than 0.1 mm or more than 5 km.
    pub fn new(points: &[Vec3]) -> Result<Self, HullError> {
        if let Some(point) = points.iter().position(|p| !p.is_finite()) {
            return Err(HullError::NonFinite { point });
        }
        let bounds = |(low, high): (Vec3, Vec3), p: &Vec3| (low.min(*p), high.max(*p));
        let (low, high) = points.iter().fold((Vec3::INFINITY, Vec3::NEG_INFINITY), bounds);
        let found = (high - low).max_element();
        if points.is_empty() || found == 0.0 {
            return Err(HullError::Flat { found: points.len().min(1) });
        }
        if !SIZES.contains(&found) {
            return Err(HullError::Size { found });
        }
        let center = (0.5 * (low + high)).as_dvec3();
        let all = outermost(points, center);
        let size = f64::from(found);
        let faces = hull(&all, size).ok_or(HullError::Flat { found: all.len() })?;
        let mut normals = distinct(&all, &faces);
        normals.truncate(MAX_PLANES);
        // Each plane is moved out to touch the outermost of all points.
        let plane = |normal: &DVec3| {
            let normal = normal.as_vec3().normalize();
            let most = points.iter().map(|p| normal.as_dvec3().dot(p.as_dvec3()));
            normal.extend(most.fold(f64::NEG_INFINITY, f64::max) as f32)
        };
        let planes: Vec<Vec4> = normals.iter().map(plane).collect();
        let middle = all.iter().map(|p| *p + center).sum::<DVec3>() / all.len() as f64;
        Ok(Self::of_planes(planes, (low, high), middle.as_vec3()))
    }
}

/// Distinct points relative to a centre; of many only those that are outermost in some direction.
fn outermost(points: &[Vec3], center: DVec3) -> Vec<DVec3> {
    let mut known = HashSet::new();
    let is_new = |p: &&Vec3| known.insert((**p + 0.0).to_array().map(f32::to_bits));
    let all: Vec<DVec3> = points.iter().filter(is_new).map(|p| p.as_dvec3() - center).collect();
    if all.len() <= MAX_POINTS {
        return all;
    }
    let golden = core::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let mut chosen: Vec<usize> = (0..DIRECTIONS)
        .filter_map(|k| {
            let y = 1.0 - 2.0 * (k as f64 + 0.5) / DIRECTIONS as f64;
            let (sine, cosine) = (golden * k as f64).sin_cos();
            let flat = (1.0 - y * y).sqrt();
            let way = DVec3::new(cosine * flat, y, sine * flat);
            (0..all.len()).max_by(|a, b| way.dot(all[*a]).total_cmp(&way.dot(all[*b])))
        })
        .collect();
    chosen.sort_unstable();
    chosen.dedup();
    chosen.into_iter().map(|k| all[k]).collect()
}

/// The faces of the hull; `None` for points in one plane.
fn hull(points: &[DVec3], size: f64) -> Option<Vec<Face>> {
    let farthest = |off: &dyn Fn(DVec3) -> f64| {
        let found = (0..points.len()).max_by(|a, b| off(points[*a]).total_cmp(&off(points[*b])))?;
        (off(points[found]) > 1e-5 * size).then_some(found)
    };
    let first = points.first()?;
    let a = farthest(&|p| p.distance(*first))?;
    let b = farthest(&|p| p.distance(points[a]))?;
    let along = (points[b] - points[a]).normalize();
    let c = farthest(&|p| (p - points[a]).reject_from_normalized(along).length())?;
    let normal = along.cross(points[c] - points[a]).normalize();
    let d = farthest(&|p| (p - points[a]).dot(normal).abs())?;
    let inside = (points[a] + points[b] + points[c] + points[d]) / 4.0;
    let face = |corners: [usize; 3]| {
        let [p, q, r] = corners.map(|k| points[k]);
        let normal = (q - p).cross(r - p).normalize_or_zero();
        Face { corners, normal, offset: normal.dot(p) }
    };
    let outward = |corners: [usize; 3]| {
        let [p, q, r] = corners;
        let made = face(corners);
        if made.normal.dot(inside) > made.offset { face([p, r, q]) } else { made }
    };
    let mut faces: Vec<Face> =
        [[a, b, c], [a, b, d], [a, c, d], [b, c, d]].map(outward).into_iter().collect();
    for (k, point) in points.iter().enumerate() {
        let is_seen = |face: &Face| face.normal.dot(*point) > face.offset + 1e-9 * size;
        let (seen, kept): (Vec<Face>, Vec<Face>) = faces.into_iter().partition(is_seen);
        faces = kept;
        let edges = |face: &Face| {
            let [p, q, r] = face.corners;
            [(p, q), (q, r), (r, p)]
        };
        let all: HashSet<(usize, usize)> = seen.iter().flat_map(edges).collect();
        // In the order of the faces, for determinism.
        let rim = seen.iter().flat_map(edges).filter(|(p, q)| !all.contains(&(*q, *p)));
        faces.extend(rim.map(|(p, q)| face([p, q, k])));
    }
    Some(faces)
}

/// The distinct normals of faces, largest faces first. If there are too many, farthest-point
/// sampling: each next normal is the farthest from those chosen.
fn distinct(points: &[DVec3], faces: &[Face]) -> Vec<DVec3> {
    let area = |face: &Face| {
        let [p, q, r] = face.corners.map(|k| points[k]);
        (q - p).cross(r - p).length()
    };
    let mut sorted: Vec<(f64, DVec3)> =
        faces.iter().map(|f| (area(f), f.normal)).filter(|f| f.1 != DVec3::ZERO).collect();
    sorted.sort_by(|a, b| b.0.total_cmp(&a.0));
    let mut normals: Vec<DVec3> = Vec::new();
    for (_, normal) in sorted {
        if normals.iter().all(|known| known.distance(normal) > SAME) {
            normals.push(normal);
        }
    }
    if normals.len() <= MAX_PLANES {
        return normals;
    }
    let mut apart: Vec<f64> = vec![f64::INFINITY; normals.len()];
    let mut chosen = Vec::with_capacity(MAX_PLANES);
    let mut next = 0;
    while chosen.len() < MAX_PLANES {
        chosen.push(normals[next]);
        for (apart, normal) in apart.iter_mut().zip(&normals) {
            *apart = apart.min(normal.distance(normals[next]));
        }
        next = (0..normals.len()).max_by(|a, b| apart[*a].total_cmp(&apart[*b])).unwrap_or(0);
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn depth(hull: &ConvexHull, p: Vec3) -> f32 {
        hull.planes().map(|(n, offset)| offset - n.dot(p)).fold(f32::INFINITY, f32::min)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(128))]

        /// All points are inside, some on every plane; what is between them is inside too.
        #[test]
        fn a_hull_holds_its_points_tightly(
            points in proptest::collection::vec([-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0], 8..200),
            size in 1e-3f32..1e3,
        ) {
            let points: Vec<Vec3> = points.into_iter().map(|p| Vec3::from(p) * size).collect();
            let hull = ConvexHull::new(&points).unwrap();
            for p in &points {
                prop_assert!(depth(&hull, *p) > -1e-6 * size, "{} outside", depth(&hull, *p));
            }
            for pair in points.windows(2) {
                prop_assert!(depth(&hull, pair[0].midpoint(pair[1])) > -1e-6 * size);
            }
            for (normal, offset) in hull.planes() {
                prop_assert!((normal.length() - 1.0).abs() < 1e-6);
                let touches = points.iter().filter(|p| (normal.dot(**p) - offset).abs() < 1e-5 * size);
                prop_assert!(touches.count() >= 1);
            }
        }
    }

    #[test]
    fn a_box_has_six_planes_and_a_ball_64() {
        let corners = |half: Vec3| {
            (0..8).map(move |k| {
                let way = |bit: usize| if k & bit != 0 { 1.0 } else { -1.0 };
                half * Vec3::new(way(1), way(2), way(4)) + Vec3::new(3.0, 1.0, -2.0)
            })
        };
        let half = Vec3::new(0.1, 0.2, 0.3);
        // With points within and on its faces.
        let inner = (1..10).flat_map(|k| corners(half * (k as f32 / 10.0)));
        let faces = (1..10).map(|k| Vec3::new(3.1, 1.0 + 0.02 * k as f32, -2.0));
        let all: Vec<Vec3> = corners(half).chain(inner).chain(faces).collect();
        let hull = ConvexHull::new(&all).unwrap();
        assert_eq!(hull.planes().len(), 6);
        for (normal, offset) in hull.planes() {
            let most = normal.abs().max_element();
            assert!((most - 1.0).abs() < 1e-6, "{normal}");
            let expected = normal.dot(Vec3::new(3.0, 1.0, -2.0)) + normal.abs().dot(half);
            assert!((offset - expected).abs() < 1e-6, "{normal} {offset}");
        }
        let golden = core::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
        let around = |k: usize| {
            let y = 1.0 - 2.0 * (k as f32 + 0.5) / 5000.0;
            let (sine, cosine) = (golden * k as f32).sin_cos();
            Vec3::new(cosine * (1.0 - y * y).sqrt(), y, sine * (1.0 - y * y).sqrt())
        };
        let points: Vec<Vec3> = (0..5000).map(around).collect();
        let ball = ConvexHull::new(&points).unwrap();
        assert_eq!(ball.planes().len(), MAX_PLANES);
        let mut farthest = 0.0_f32;
        for p in &points {
            let reach = ball.planes().map(|(n, offset)| offset / n.dot(*p).max(1e-6));
            farthest = farthest.max(reach.fold(f32::INFINITY, f32::min));
            assert!(depth(&ball, *p) > -1e-6);
        }
        println!("corners stick out by {} of the radius", farthest - 1.0);
        assert!(farthest < 1.12, "{farthest}");
    }

    #[test]
    fn what_is_no_solid_says_why() {
        let new = |points: &[Vec3]| ConvexHull::new(points).unwrap_err();
        assert_eq!(new(&[]), HullError::Flat { found: 0 });
        assert_eq!(new(&[Vec3::X; 9]), HullError::Flat { found: 1 });
        assert_eq!(new(&[Vec3::X, Vec3::Y, Vec3::Z]), HullError::Flat { found: 3 });
        let flat: Vec<Vec3> = (0..50).map(|k| Vec3::new(k as f32, (k * k) as f32, 0.0)).collect();
        assert_eq!(new(&flat), HullError::Flat { found: 50 });
        assert_eq!(new(&[Vec3::X, Vec3::NAN]), HullError::NonFinite { point: 1 });
        let corner = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::Z];
        for size in [1e-5, 1e4] {
            assert_eq!(new(&corner.map(|p| p * size)), HullError::Size { found: size });
        }
        assert_eq!(ConvexHull::new(&corner).unwrap().planes().len(), 4);
    }
}
