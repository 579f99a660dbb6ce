//! Sleep as pure functions: what counts as unchanged.

use crate::solver::rod::obstacle::Solid;
use glam::{Quat, Vec3};

/// Whether a change is at most `most`; false for NaN.
pub fn within(change: f32, most: f32) -> bool {
    change <= most
}

/// Whether all points are within `distance` (m) of where they were; false for non-finite points and
/// lists of different lengths.
pub fn stays(before: &[Vec3], now: &[Vec3], distance: f32) -> bool {
    let square = distance * distance;
    // From the tip, which moves most, for an early exit.
    before.len() == now.len()
        && before.iter().rev().zip(now.iter().rev()).all(|(a, b)| a.distance_squared(*b) <= square)
}

/// Whether all orientations are within `angle` (rad, small) of what they were.
pub fn keeps_turn(before: &[Quat], now: &[Quat], angle: f32) -> bool {
    before.len() == now.len()
        && before.iter().rev().zip(now.iter().rev()).all(|(a, b)| turn(*a, *b) <= angle)
}

/// The angle between two orientations (rad), exact where it is small: the arc cosine is not.
pub fn turn(a: Quat, b: Quat) -> f32 {
    // |a − b| = 2 sin(θ/4); a and −a are the same orientation.
    let apart = (a - b).length_squared().min((a + b).length_squared());
    2.0 * apart.sqrt()
}

/// Distance from its centre to the farthest point of a solid's surface (m); 1 for a half-space.
pub fn lever(solid: &Solid) -> f32 {
    match *solid {
        Solid::Placed(ref placed) => placed.shape.reach() * placed.scale,
        Solid::HalfSpace { .. } => 1.0,
        Solid::Capsule { a, b, radius } => 0.5 * a.distance(b) + radius,
        Solid::Cylinder { radius, half_height, .. } => radius + half_height,
    }
}

/// How far a solid has moved from one pose to another, without rotation about its own centre (m).
/// Infinite between solids of different kinds.
pub fn displacement(before: &Solid, now: &Solid) -> f32 {
    match (before.clone(), now.clone()) {
        (Solid::HalfSpace { normal: n, point: p }, Solid::HalfSpace { normal: m, point: q }) => {
            p.distance(q) + n.distance(m) * lever(now)
        }
        (Solid::Capsule { a, b, radius }, Solid::Capsule { a: c, b: d, radius: other }) => {
            a.distance(c).max(b.distance(d)) + (radius - other).abs()
        }
        (
            Solid::Cylinder { center, axis, radius, half_height },
            Solid::Cylinder { center: c, axis: d, radius: r, half_height: h },
        ) => {
            center.distance(c)
                + axis.distance(d) * lever(now)
                + (radius - r).abs()
                + (half_height - h).abs()
        }
        (Solid::Placed(one), Solid::Placed(other)) => {
            let change = one.shape.change(&other.shape) * other.scale;
            let grown = (one.scale - other.scale).abs() * other.shape.reach();
            one.center.distance(other.center) + grown + change
        }
        _ => f32::INFINITY,
    }
}

/// Hash of which nodes are held.
pub fn held_nodes(targets: &[Option<Vec3>]) -> u64 {
    let held = targets.iter().zip(1u64..).filter(|(target, _)| target.is_some());
    held.fold(0, |sum, (_, i)| sum.wrapping_mul(0x9e37_79b9_7f4a_7c15).wrapping_add(i))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn trembling_counts_as_still_and_creeping_does_not() {
        let at = |x: f32| [Vec3::ZERO, Vec3::X * x];
        assert!(stays(&at(1.0), &at(1.00004), 5e-5));
        assert!(!stays(&at(1.0), &at(1.00006), 5e-5));
        assert!(!stays(&at(1.0), &at(f32::NAN), 1.0));
        assert!(!stays(&at(1.0), &[Vec3::ZERO], 1.0));
    }

    #[test]
    fn small_turns_are_measured_exactly_and_signs_do_not_count() {
        let q = Quat::from_rotation_y(0.7);
        for angle in [1e-4_f32, 1e-3, 0.1] {
            let turned = q * Quat::from_rotation_x(angle);
            assert!((turn(q, turned) / angle - 1.0).abs() < 1e-2, "{angle}");
            assert_eq!(turn(q, turned), turn(-q, turned));
        }
        assert!(keeps_turn(&[q], &[-q], 1e-6));
        assert!(!keeps_turn(&[q], &[q * Quat::from_rotation_z(1e-3)], 9e-4), "twist counts");
    }

    #[test]
    fn solids_move_as_far_as_their_farthest_point() {
        let ball = |x: f32, radius: f32| Solid::Capsule { a: Vec3::X * x, b: Vec3::X * x, radius };
        assert!((displacement(&ball(0.0, 0.1), &ball(0.02, 0.1)) - 0.02).abs() < 1e-7);
        assert!((displacement(&ball(0.0, 0.1), &ball(0.0, 0.13)) - 0.03).abs() < 1e-7);
        let floor = |x: f32| Solid::HalfSpace { normal: Vec3::Y, point: Vec3::X * x };
        assert_eq!(displacement(&floor(0.0), &floor(-0.5)), 0.5, "a belt takes hair along");
        assert_eq!(displacement(&floor(0.0), &ball(0.0, 0.1)), f32::INFINITY);
        let capsule = Solid::Capsule { a: Vec3::ZERO, b: Vec3::X * 0.4, radius: 0.03 };
        assert!((lever(&capsule) - 0.23).abs() < 1e-7, "the end of a capsule of 0.46 m");
        let (center, axis) = (Vec3::ZERO, Vec3::Y);
        let drum = Solid::Cylinder { center, axis, radius: 0.3, half_height: 0.4 };
        assert!(lever(&drum) >= 0.5, "to its edge");
    }

    #[test]
    fn other_held_nodes_have_another_hash() {
        let held = |at: &[usize]| {
            let mut targets = [None; 8];
            at.iter().for_each(|i| targets[*i] = Some(Vec3::ONE));
            held_nodes(&targets)
        };
        let all = [held(&[]), held(&[0]), held(&[7]), held(&[2, 3]), held(&[3, 4]), held(&[3, 5])];
        for (i, a) in all.iter().enumerate() {
            assert!(all[..i].iter().all(|b| a != b), "{i}");
        }
        assert_eq!(held_nodes(&[]), held(&[]));
    }
}
