//! Contact between strands as pure functions: equation 18 of \[B\], and bridges of water between one node and
//! one edge, the reference of `lanes.rs`.

use crate::base::lanes::Real;
use glam::Vec3;

/// Squared distance (m²) up to which points coincide: there is no direction to push.
pub(super) const SAME_PLACE: f32 = 1e-18;

/// Equation 18: the acceleration of a node at `p` away from the foot `f` of its perpendicular on another
/// strand's edge is this times p − f, and so α (2r − d)/(2r) long.
///
/// `distance` is d = |p − f| (m), `reach` 2r (m), `strength` α (m/s²); holds for 0 < d < 2r, beyond there is none.
#[inline(always)]
pub fn penalty<R: Real>(distance: R, reach: R, strength: R) -> R {
    strength * (reach - distance) / (reach * distance)
}

/// How long a bridge between two wet strands may get: (1 + θ/2) √A for a film of cross-section A, with
/// the contact angle θ of 60° that hair has.
pub(super) const BREAKS_AT: f32 = 1.5;

/// Film cross-section, as a share of the squared reach, up to which the pull is proportional to the
/// film; with more the pull is constant but reaches farther, as of capillary bridges.
pub(super) const THIN: f32 = 0.02;

/// Where water bridges two strands.
#[derive(Clone, Copy, Debug, PartialEq)]
#[doc(hidden)]
pub struct Film {
    /// 2r: the distance of axes at which strands touch (m).
    pub reach: f32,
    /// No bridge is longer than this, from surface to surface (m).
    pub longest: f32,
}

/// The sum of the bridges at a node.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[doc(hidden)]
pub struct Bridged {
    /// Sum of directions toward the bridged strands: length 1 for a full bridge, less for one about to
    /// break and for strands that are pressed together.
    pub pull: Vec3,
    /// Upper bound of the gradient of `pull` (1/m).
    pub steepness: f32,
    /// Sum of the velocities of the bridged points, each weighted by its share of `strength` (m/s).
    pub drift: Vec3,
    /// Total strength: 1 for each full bridge.
    pub strength: f32,
}

impl Bridged {
    /// Interpolates from `self` (0) to `to` (1), for a node between two sampled ones.
    pub fn lerp(self, to: Self, t: f32) -> Self {
        let mix = |a: f32, b: f32| a + (b - a) * t;
        Self {
            pull: self.pull.lerp(to.pull, t),
            steepness: mix(self.steepness, to.steepness),
            drift: self.drift.lerp(to.drift, t),
            strength: mix(self.strength, to.strength),
        }
    }
}

/// A bridge of water from a node at `p` to the foot `f` of its perpendicular on a strand that moves
/// with `velocity`, both films together of cross-section `area` (m²): what `lanes.rs` is compared with.
#[cfg(test)]
pub(super) fn bridged(p: Vec3, foot: Vec3, velocity: Vec3, area: f32, film: Film) -> Bridged {
    let off = p - foot;
    let distance = off.length();
    let touch = SAME_PLACE < distance * distance && distance < film.reach + film.longest;
    let longest = (BREAKS_AT * area.sqrt()).min(film.longest).max(1e-9);
    let amount = (area / (THIN * film.reach * film.reach)).min(1.0);
    let left = amount * (1.0 - (distance - film.reach).max(0.0) / longest).max(0.0);
    if !touch || left <= 0.0 {
        return Bridged::default();
    }
    let pressed = (distance / film.reach).min(1.0);
    Bridged {
        pull: -off / distance * (left * pressed * pressed),
        steepness: amount / longest.min(0.5 * film.reach),
        drift: velocity * left,
        strength: left,
    }
}

/// An edge of a strand, prepared for projecting points on it.
#[cfg(test)]
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Edge {
    start: Vec3,
    along: Vec3,
    inverse_squared: f32,
    is_last: bool,
}

#[cfg(test)]
impl Edge {
    /// The edge from `a` to `b`; `is_last` for the one at the tip.
    #[inline]
    pub(super) fn new(a: Vec3, b: Vec3, is_last: bool) -> Self {
        let along = b - a;
        let inverse_squared = 1.0 / along.length_squared().max(1e-20);
        Self { start: a, along, inverse_squared, is_last }
    }

    /// The foot of the perpendicular from `p`, clamped to the edge, or `None` where it belongs to
    /// another edge of the strand: a foot on a shared node belongs to the second edge.
    #[inline]
    pub(super) fn foot(&self, p: Vec3) -> Option<Vec3> {
        let t = (p - self.start).dot(self.along) * self.inverse_squared;
        if t >= 1.0 {
            return self.is_last.then_some(self.start + self.along);
        }
        Some(self.start + self.along * t.max(0.0))
    }

    /// The nearest point of the edge to `p`, where on the edge it is (0…1), and the edge's part in mutual contact
    /// of this reach: around a node that it shares with another edge of its strand, both have a part.
    pub(super) fn nearest(&self, p: Vec3, reach: f32, is_first: bool) -> (Vec3, f32, f32) {
        let t = (p - self.start).dot(self.along) * self.inverse_squared;
        let part =
            |inside: f32| (0.5 + inside * self.along.length() / (2.0 * reach)).clamp(0.0, 1.0);
        let rise = if is_first { 1.0 } else { part(t) };
        let fall = if self.is_last { 1.0 } else { part(1.0 - t) };
        let at = t.clamp(0.0, 1.0);
        (self.start + self.along * at, at, rise * fall)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bridge_of_much_water_is_as_long_as_the_lists_cover() {
        let reach = 2e-3;
        let strength = |distance: f32| {
            let film = Film::between(reach);
            bridged(Vec3::X * distance, Vec3::ZERO, Vec3::ZERO, 1e-4, film).strength
        };
        let ends = reach * 1.6;
        assert!(strength(ends - 1e-5) > 0.0 && strength(ends + 1e-5) == 0.0);
    }

    #[test]
    fn penalty_is_strongest_in_touch_and_gone_at_two_radii() {
        let a = |d: f32| penalty(d, 2e-3, 20.0) * d;
        assert!((a(1e-3) - 10.0).abs() < 1e-4);
        assert!((a(1e-6) - 20.0).abs() < 0.02);
        assert_eq!(a(2e-3), 0.0);
    }

    #[test]
    fn a_foot_on_a_shared_node_counts_once_and_tips_count() {
        let (a, b, c) = (Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y);
        let p = Vec3::new(1.2, -0.2, 0.0);
        assert_eq!(Edge::new(a, b, false).foot(p), None);
        assert_eq!(Edge::new(b, c, true).foot(p), Some(b));
        assert_eq!(Edge::new(b, c, true).foot(Vec3::new(1.0, 2.0, 0.0)), Some(c));
    }
}
