//! Ellipsoids around what sticks out of balls: ears, a nose.

use super::capsules::principal_axes;
use bevy::{
    math::{DMat4, DVec3, DVec4, bounding::BoundingSphere},
    prelude::*,
};

/// Fewer points are no shape.
const LEAST: usize = 10;
/// Steps toward the least volume; a hundred come within a hundredth of it.
const STEPS: usize = 100;
/// What is cut to less than this share of its size is left out.
const SMALLEST: f32 = 0.5;

/// An ellipsoid: where it is, and its half axes (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Protrusion {
    pub place: Transform,
    pub radii: Vec3,
}

/// What may be taken for a protrusion.
#[derive(Clone, Copy, Debug)]
pub(crate) struct ProtrusionRules {
    /// How far outside of all balls its points are at least (m).
    pub apart: f32,
    /// Points that are this near to each other belong together (m).
    pub link: f32,
    /// The longest half axis (m); what is longer is skin that balls leave out, and no protrusion.
    pub longest: f32,
    /// How far the ellipsoid goes beyond the points (m).
    pub out: f32,
}

impl ProtrusionRules {
    /// For what is so many times as large.
    pub fn scaled(self, size: f32) -> Self {
        let Self { apart, link, longest, out } = self;
        Self { apart: apart * size, link: link * size, longest: longest * size, out: out * size }
    }
}

impl Protrusion {
    /// As much smaller as leaves these points outside; `None` where little is left.
    pub fn clear_of(self, points: &[Vec3]) -> Option<Self> {
        let Self { place, radii } = self;
        let turn = place.rotation.inverse();
        let share = |p: &Vec3| (turn * (*p - place.translation) / radii).length();
        let nearest = points.iter().map(share).fold(f32::MAX, f32::min);
        (nearest > SMALLEST).then(|| Self { place, radii: radii * nearest.min(1.0) })
    }
}

/// Ellipsoids of least volume around those of `points` that are outside of `balls`, one for each group of
/// neighbours.
pub(crate) fn protrusions(
    points: impl IntoIterator<Item = Vec3>,
    balls: &[BoundingSphere],
    rules: &ProtrusionRules,
) -> Vec<Protrusion> {
    let off = |p: Vec3| {
        let each = balls.iter().map(|ball| p.distance(ball.center.into()) - ball.radius());
        each.fold(f32::MAX, f32::min)
    };
    let outside: Vec<Vec3> = points.into_iter().filter(|p| off(*p) > rules.apart).collect();
    let each = groups(&outside, rules.link).into_iter();
    let each = each.filter_map(|group| around(&group, rules.out));
    each.filter(|one| one.radii.max_element() <= rules.longest).collect()
}

/// Points that hang together over distances of at most `link`.
fn groups(points: &[Vec3], link: f32) -> Vec<Vec<Vec3>> {
    let mut left: Vec<Vec3> = points.to_vec();
    let mut groups = Vec::new();
    while let Some(first) = left.pop() {
        let mut group = vec![first];
        let mut next = 0;
        while let Some(&from) = group.get(next) {
            let (near, far) = left.iter().partition(|p| p.distance(from) <= link);
            let near: Vec<Vec3> = near;
            group.extend(near);
            left = far;
            next += 1;
        }
        groups.push(group);
    }
    groups
}

/// The ellipsoid of least volume around points, by Khachiyan's algorithm with the step of Todd and Yıldırım
/// (2007).
fn around(points: &[Vec3], out: f32) -> Option<Protrusion> {
    if points.len() < LEAST {
        return None;
    }
    let raised: Vec<DVec4> = points.iter().map(|p| p.as_dvec3().extend(1.0)).collect();
    let mut shares = vec![1.0 / points.len() as f64; points.len()];
    for _ in 0..STEPS {
        let outer = |q: &DVec4| DMat4::from_cols(*q * q.x, *q * q.y, *q * q.z, *q * q.w);
        let each = raised.iter().zip(&shares).map(|(q, share)| outer(q) * *share);
        let inverse = each.fold(DMat4::ZERO, |sum, one| sum + one).inverse();
        let (farthest, far) = (raised.iter().map(|q| q.dot(inverse * *q)).enumerate())
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        if far.is_nan() || far <= 4.0 + 1e-3 {
            break;
        }
        let step = (far - 4.0) / (4.0 * (far - 1.0));
        shares.iter_mut().for_each(|share| *share *= 1.0 - step);
        shares[farthest] += step;
    }
    let weighted: Vec<(DVec3, f64)> =
        points.iter().zip(&shares).map(|(p, share)| (p.as_dvec3(), *share)).collect();
    let center = weighted.iter().map(|(p, share)| p * share).sum::<DVec3>();
    let [x, y, _] = principal_axes(&weighted, center).map(|axis| axis.as_vec3());
    let axes = Mat3::from_cols(x, y, x.cross(y));
    let center = center.as_vec3();
    // The directions are known; the size is what holds all points.
    let own = |p: &Vec3| axes.transpose() * (*p - center);
    let spread = weighted.iter().fold(DVec3::ZERO, |sum, (p, share)| {
        let own = own(&p.as_vec3()).as_dvec3();
        sum + own * own * *share
    });
    let radii = (3.0 * spread).as_vec3().map(f32::sqrt).max(Vec3::splat(1e-3));
    let size = points.iter().map(|p| (own(p) / radii).length()).fold(0.0, f32::max);
    let radii = radii * size + out;
    radii.is_finite().then(|| Protrusion {
        place: Transform::from_translation(center).with_rotation(Quat::from_mat3(&axes)),
        radii,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    const RULES: ProtrusionRules =
        ProtrusionRules { apart: 0.0, link: 0.01, longest: 0.06, out: 1e-3 };

    /// Points all over an ellipsoid of these half axes, turned and moved.
    fn ear(half: Vec3, place: &Transform, count: usize) -> Vec<Vec3> {
        let golden = core::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
        let around = |i: usize| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let (sine, cosine) = (golden * i as f32).sin_cos();
            let flat = (1.0 - y * y).sqrt();
            place.transform_point(Vec3::new(cosine * flat, y, sine * flat) * half)
        };
        (0..count).map(around).collect()
    }

    /// How far along the half axes a point is, 1 on the surface.
    fn share(of: &Protrusion, p: Vec3) -> f32 {
        (of.place.compute_affine().inverse().transform_point3(p) / of.radii).length()
    }

    #[test]
    fn ears_beside_a_ball_get_an_ellipsoid_each_that_fits() {
        let head = [BoundingSphere::new(Vec3::ZERO, 0.08)];
        let half = Vec3::new(0.008, 0.03, 0.018);
        let turned = Quat::from_rotation_y(0.4) * Quat::from_rotation_x(0.2);
        let places = [0.1, -0.1].map(|x| Transform::from_xyz(x, 0.01, 0.0).with_rotation(turned));
        let mut points: Vec<Vec3> = places.iter().flat_map(|at| ear(half, at, 300)).collect();
        points.extend(ear(Vec3::splat(0.0799), &Transform::IDENTITY, 2000));
        let found = protrusions(points.iter().copied(), &head, &RULES);
        assert_eq!(found.len(), 2);
        for (ear, place) in found.iter().rev().zip(places) {
            assert!(ear.place.translation.distance(place.translation) < 5e-4, "{ear:?}");
            let mut radii = ear.radii.to_array();
            radii.sort_by(f32::total_cmp);
            for (radius, expected) in radii.into_iter().zip([0.009, 0.019, 0.031]) {
                assert!((radius - expected).abs() < 8e-4, "{radii:?}");
            }
        }
        for p in points.iter().filter(|p| p.length() > 0.08) {
            let nearest = found.iter().map(|ear| share(ear, *p)).fold(f32::MAX, f32::min);
            assert!(nearest <= 1.0, "{p} is {nearest} out");
        }
    }

    #[test]
    fn what_is_too_long_or_no_shape_is_left_out() {
        let long = ear(Vec3::new(0.1, 0.01, 0.01), &Transform::IDENTITY, 2000);
        assert_eq!(protrusions(long, &[], &RULES), []);
        let few = [Vec3::ZERO; LEAST - 1];
        assert_eq!(protrusions(few, &[], &RULES), []);
        assert_eq!(protrusions([Vec3::NAN; 50], &[], &RULES), []);
        let flat = (0..100).map(|i| Vec3::new((i % 10) as f32, (i / 10) as f32, 0.0) * 3e-3);
        let flat = protrusions(flat, &[], &RULES);
        assert!(flat.len() == 1 && flat[0].radii.is_finite(), "{flat:?}");
        let one_place = protrusions([Vec3::ONE; 50], &[], &RULES);
        assert!(one_place.iter().all(|one| one.radii.is_finite() && one.radii.min_element() > 0.0));
    }
}
