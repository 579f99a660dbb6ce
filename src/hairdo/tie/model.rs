//! Where ties hold strands, as pure functions.

use bevy::math::{DMat4, DVec3, DVec4, Quat, Vec3, ops};
use core::f32::consts::TAU;

/// Height above the scalp at which hair is led to a tie (m).
const ABOVE_SCALP: f32 = 0.004;

/// Length of hair for a way, over that of the way: taut, but not stretched.
const SLACK: f32 = 1.01;

/// The ball that fits roots best, by least squares: its middle and radius (m). `None` for roots in a plane.
pub(super) fn ball_through(roots: &[Vec3]) -> Option<(Vec3, f32)> {
    let count = roots.len() as f64;
    let mean = roots.iter().map(|p| p.as_dvec3()).sum::<DVec3>() / count;
    // |p|² = 2 p·c + d for all p, with d = r² − c².
    let (mut matrix, mut right) = (DMat4::ZERO, DVec4::ZERO);
    for root in roots {
        let p = root.as_dvec3() - mean;
        let row = p.extend(0.5);
        let outer = DMat4::from_cols(row * row.x, row * row.y, row * row.z, row * row.w);
        matrix += outer;
        right += row * p.length_squared();
    }
    let spread = matrix.col(0).x + matrix.col(1).y + matrix.col(2).z;
    let is_flat = matrix.determinant() <= 1e-6 * (spread / 3.0).powi(3) * count;
    let solution = (!is_flat).then(|| matrix.inverse() * right * 0.5)?;
    let (middle, offset) = (solution.truncate(), solution.w);
    let radius = (middle.length_squared() + offset).max(0.0).sqrt();
    let is_sane = radius.is_finite() && radius < 100.0 * spread.sqrt();
    is_sane.then(|| ((mean + middle).as_vec3(), radius as f32))
}

/// The head that hair is led round, and the ring that it is led to, in the hair's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct Gathering {
    /// Middle of the head (m), its radius, and the direction of the scalp's middle.
    pub middle: Vec3,
    pub radius: f32,
    pub crown: Vec3,
    /// Axis of the ring.
    pub axis: Vec3,
}

impl Gathering {
    /// Length of the way from a root over the head to its place in the ring (m).
    fn way(&self, root: Vec3, place: Vec3) -> f32 {
        let (from, to) = (root - self.middle, place - self.middle);
        let height = self.radius + ABOVE_SCALP;
        let along = from.angle_between(to) * height.max(from.length());
        let out = to.length() - from.length();
        (along * along + out * out).sqrt().max(root.distance(place))
    }

    /// The node of a strand that is held, and its place, for a strand that goes through the ring at `place`; `None` if
    /// it is too short.
    pub fn held(&self, root: Vec3, place: Vec3, lengths: &[f32]) -> Option<(u32, Vec3)> {
        let needed = SLACK * self.way(root, place);
        let mut arc = 0.0;
        let arcs = lengths.iter().map(|l| {
            arc += l;
            arc
        });
        let (node, arc) =
            (1..).zip(arcs).min_by(|a, b| (a.1 - needed).abs().total_cmp(&(b.1 - needed).abs()))?;
        let total: f32 = lengths.iter().sum();
        if total < needed {
            return None;
        }
        // Before the ring it comes along the head, after it goes along the axis.
        let beyond = arc - needed;
        let outward = (place - self.middle).normalize_or(self.axis);
        let coming = (place - root).reject_from(outward).normalize_or_zero();
        Some((node, place + beyond * if beyond < 0.0 { coming } else { self.axis }))
    }

    /// The direction from the middle that leads the held node round the head on the side of its root.
    pub fn side(&self, root: Vec3) -> Vec3 {
        // Opposite the ring there are ways on all sides: that over the crown is taken.
        let side = (root - self.middle).normalize_or_zero() + OVER_CROWN * self.crown;
        side.normalize_or(self.axis)
    }
}

/// How much a way prefers the crown.
const OVER_CROWN: f32 = 0.2;

/// Where the held node is on its way at `progress` (0 to 1): round the middle of the head, on one side of it.
pub(super) fn on_the_way(
    (middle, side): (Vec3, Vec3),
    start: Vec3,
    place: Vec3,
    progress: f32,
) -> Vec3 {
    let t = progress.clamp(0.0, 1.0);
    let t = t * t * (3.0 - 2.0 * t);
    let (from, to) = (start - middle, place - middle);
    let (Some(a), Some(b)) = (from.try_normalize(), to.try_normalize()) else {
        return start.lerp(place, t);
    };
    let toward = |a: Vec3, b: Vec3| {
        let turn = Quat::IDENTITY.slerp(Quat::from_rotation_arc(a, b), t);
        (turn * a).normalize()
    };
    let direction = toward(toward(a, side), toward(side, b));
    middle + direction * (from.length() + (to.length() - from.length()) * t)
}

/// Places in a disc of a radius (m) for strands whose roots lie at these azimuths about its axis (rad): evenly spread, in
/// the azimuths' order, so that strands do not cross.
pub(super) fn in_disc(azimuths: &[f32], radius: f32) -> Vec<[f32; 2]> {
    /// Of the circle, between two places of a sunflower.
    const GOLDEN: f32 = 0.381_966;
    let count = azimuths.len();
    let mut places: Vec<(f32, [f32; 2])> = (0..count)
        .map(|i| {
            let out = radius * ((i as f32 + 0.5) / count as f32).sqrt();
            let angle = TAU * (i as f32 * GOLDEN).fract();
            (angle, [out * ops::cos(angle), out * ops::sin(angle)])
        })
        .collect();
    places.sort_by(|a, b| a.0.total_cmp(&b.0));
    let mut order: Vec<usize> = (0..count).collect();
    order.sort_by(|a, b| azimuths[*a].rem_euclid(TAU).total_cmp(&azimuths[*b].rem_euclid(TAU)));
    let mut of = vec![[0.0; 2]; count];
    for (strand, (_, place)) in order.into_iter().zip(places) {
        of[strand] = place;
    }
    of
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ball_is_found_by_roots_on_its_cap() {
        let (middle, radius) = (Vec3::new(0.3, 1.6, -0.2), 0.09);
        let on_cap = |i: usize| {
            let (around, y) = (2.4 * i as f32, 0.5 + 0.01 * i as f32);
            let across = (1.0 - y * y).sqrt();
            middle + radius * Vec3::new(across * around.cos(), y, across * around.sin())
        };
        let roots: Vec<Vec3> = (0..40).map(on_cap).collect();
        let (found, size) = ball_through(&roots).unwrap();
        assert!(found.distance(middle) < 1e-4 && (size - radius).abs() < 1e-4, "{found} {size}");
        let flat: Vec<Vec3> = roots.iter().map(|p| p.with_y(0.0)).collect();
        assert_eq!(ball_through(&flat), None);
        assert_eq!(ball_through(&roots[..2]), None);
        assert_eq!(ball_through(&[]), None);
    }

    #[test]
    fn a_strand_is_held_where_it_lies_taut_over_the_head() {
        let gathering =
            Gathering { middle: Vec3::ZERO, radius: 0.1, crown: Vec3::Y, axis: Vec3::Z };
        // A quarter of the way round.
        let (root, place, l) = (Vec3::Y * 0.1, Vec3::Z * 0.12, 0.01);
        let arc = (0.104f32 * core::f32::consts::FRAC_PI_2).hypot(0.02) * SLACK;
        let (node, at) = gathering.held(root, place, &[l; 40]).unwrap();
        assert!((node as f32 * l - arc).abs() <= 0.5 * l, "{node}");
        assert!((at.distance(place) - (node as f32 * l - arc).abs()).abs() < 1e-5, "{at}");
        assert_eq!(gathering.held(root, place, &[l; 16]), None, "too short");
        // From the forehead it goes over the crown, though it hangs down.
        let (root, start) = (Vec3::NEG_Z * 0.1, Vec3::new(0.0, -0.2, -0.1));
        let way = (Vec3::ZERO, gathering.side(root));
        let mut highest = f32::NEG_INFINITY;
        for step in 0..=10 {
            let at = on_the_way(way, start, place, 0.1 * step as f32);
            assert!(at.length() > 0.119, "not through the head: {at}");
            highest = highest.max(at.y);
        }
        assert!(highest > 0.1, "{highest}");
        assert!(on_the_way(way, start, place, 0.0).distance(start) < 1e-6);
        assert!(on_the_way(way, start, place, 1.0).distance(place) < 1e-6);
    }

    #[test]
    fn neighbours_on_the_head_are_neighbours_in_the_ring() {
        let azimuths: Vec<f32> = (0..50).map(|i| 2.4 * i as f32).collect();
        let places = in_disc(&azimuths, 0.01);
        let mut squares = 0.0;
        for (a, place) in azimuths.iter().zip(&places) {
            let [x, y] = *place;
            squares += x * x + y * y;
            assert!(x.hypot(y) < 0.01);
            let off = (ops::atan2(y, x) - a).rem_euclid(TAU);
            assert!(off.min(TAU - off) < 0.3, "{a}: {off}");
        }
        assert!((squares / 50.0 / (0.5 * 1e-4) - 1.0).abs() < 0.05, "evenly");
    }
}
