//! Balls inscribed in a surface: colliders for shapes that are no capsule, such as a head.
//!
//! For each of many points of the surface the largest ball that touches it there from within, by
//! shrinking one until no other point lies in it (Ma, Bae, Choi 2012, "3D medial axis point
//! approximation using nearest neighbors and the normal field"); of these the few that together
//! cover most points.

use crate::base::grid::KdTree;
use bevy::{math::bounding::BoundingSphere, prelude::*};

/// Steps in which a ball shrinks; few need more than five.
const STEPS: usize = 24;
/// Balls smaller than this share of the largest fill only creases.
const SMALLEST: f32 = 0.2;
/// The share of the points that a further ball must add.
const LEAST_GAIN: f32 = 0.003;

/// Parameters of the fit.
#[derive(Clone, Copy, Debug)]
pub(crate) struct BallRules {
    /// The largest radius (m).
    pub widest: f32,
    /// How far they stand out of the surface where they touch it (m); negative where they stay within it.
    /// The more, the shallower are the creases between them, and the fewer are needed.
    pub out: f32,
    /// How far outside of a ball a point of the surface may be that it covers (m): the depth of creases.
    pub crease: f32,
    /// How many there may be.
    pub most: usize,
}

/// Balls that fill the surface that is given by points with outward normals. All points bound the
/// balls; those for which `is_target` holds should be covered by one.
pub(crate) fn inscribed_balls(
    points: &[(Vec3, Vec3)],
    is_target: impl Fn(usize) -> bool,
    rules: &BallRules,
) -> Vec<BoundingSphere> {
    let tree = KdTree::new(points.iter().map(|p| p.0).zip(0u32..));
    let targets: Vec<usize> = (0..points.len()).filter(|i| is_target(*i)).collect();
    let balls: Vec<BoundingSphere> =
        targets.iter().filter_map(|&i| largest_at(points, i, &tree, rules)).collect();
    let is_covered = |ball: &BoundingSphere, p: Vec3| {
        p.distance(ball.center.into()) - ball.radius() <= rules.crease
    };
    // Bit set of the points that each ball covers.
    let words = targets.len().div_ceil(64);
    let covered: Vec<Vec<u64>> = balls
        .iter()
        .map(|ball| {
            let mut bits = vec![0; words];
            let each = targets.iter().enumerate().filter(|(_, i)| is_covered(ball, points[**i].0));
            each.for_each(|(k, _)| bits[k / 64] |= 1 << (k % 64));
            bits
        })
        .collect();
    let mut left = vec![u64::MAX; words];
    let mut chosen = Vec::new();
    while chosen.len() < rules.most {
        let gain = |ball: &Vec<u64>| -> u32 {
            ball.iter().zip(&left).map(|(covered, left)| (covered & left).count_ones()).sum()
        };
        // On ties, the first.
        let best = (0..balls.len()).rev().max_by_key(|k| gain(&covered[*k]));
        let Some(best) =
            best.filter(|k| gain(&covered[*k]) as f32 > LEAST_GAIN * targets.len() as f32)
        else {
            break;
        };
        left.iter_mut().zip(&covered[best]).for_each(|(left, covered)| *left &= !covered);
        chosen.push(balls[best]);
    }
    chosen
}

/// The largest ball that touches point `i` from within and has no other point in it.
fn largest_at(
    points: &[(Vec3, Vec3)],
    i: usize,
    tree: &KdTree,
    rules: &BallRules,
) -> Option<BoundingSphere> {
    let (p, normal) = points[i];
    if !normal.is_normalized() {
        // Which side is within is not known.
        return None;
    }
    let mut radius = rules.widest;
    for _ in 0..STEPS {
        let centre = p - normal * radius;
        let (q, _) = tree.nearer_than(centre, (u32::MAX, (0.999 * radius).powi(2)));
        let Some(&(q, _)) = points.get(q as usize) else { break };
        let off = p - q;
        let next = off.length_squared() / (2.0 * off.dot(normal));
        if !(next > 0.0 && next < radius) {
            break;
        }
        radius = next;
    }
    let own = radius + rules.out;
    let usable = own > SMALLEST * rules.widest && (p - normal * radius).is_finite();
    usable.then(|| BoundingSphere::new(p - normal * radius, own))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points all over an ellipsoid of these half axes.
    fn ellipsoid(half: Vec3, count: usize) -> Vec<(Vec3, Vec3)> {
        let golden = core::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
        let around = |i: usize| {
            let y = 1.0 - 2.0 * (i as f32 + 0.5) / count as f32;
            let (sine, cosine) = (golden * i as f32).sin_cos();
            let flat = (1.0 - y * y).sqrt();
            let way = Vec3::new(cosine * flat, y, sine * flat);
            (way * half, (way / half).normalize())
        };
        (0..count).map(around).collect()
    }

    #[test]
    fn few_balls_fill_an_ellipsoid_from_within() {
        let half = Vec3::new(0.075, 0.09, 0.095);
        let points = ellipsoid(half, 1500);
        let rules = BallRules { widest: 0.1, out: -1e-3, crease: 3e-3, most: 14 };
        let balls = inscribed_balls(&points, |_| true, &rules);
        assert!((4..=14).contains(&balls.len()), "{} balls", balls.len());
        let off = |p: Vec3| {
            let each = balls.iter().map(|b| p.distance(b.center.into()) - b.radius());
            each.fold(f32::MAX, f32::min)
        };
        let mut offs: Vec<f32> = points.iter().map(|p| off(p.0)).collect();
        offs.sort_by(f32::total_cmp);
        println!("{} balls, {:?} mm off", balls.len(), [0, 750, 1350, 1499].map(|i| offs[i] * 1e3));
        assert!(offs[0] > 0.5e-3, "a ball sticks out: {} mm", offs[0] * 1e3);
        assert!(offs[1350] < 3.5e-3, "nine tenths are near a ball: {} mm", offs[1350] * 1e3);
    }

    #[test]
    fn points_without_a_solid_give_no_balls() {
        let rules = BallRules { widest: 0.1, out: -1e-3, crease: 3e-3, most: 14 };
        assert!(inscribed_balls(&[], |_| true, &rules).is_empty());
        let nowhere = [(Vec3::NAN, Vec3::NAN); 20];
        assert!(inscribed_balls(&nowhere, |_| true, &rules).is_empty());
        let inward: Vec<_> = ellipsoid(Vec3::splat(0.1), 200);
        assert!(inscribed_balls(&inward, |_| false, &rules).is_empty());
    }
}
