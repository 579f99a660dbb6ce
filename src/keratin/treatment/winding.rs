//! Winding as a pure function: the path of a strand onto a rod.

use crate::hair::strand::drawn_out;
use bevy::math::{FloatPow, Quat, Vec3, ops};

/// A rod in the strand's frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LocalRod {
    /// Its centre (m).
    pub center: Vec3,
    /// Unit direction of its axis.
    pub axis: Vec3,
    /// Its radius (m).
    pub radius: f32,
    /// Half its length (m).
    pub half_length: f32,
}

/// Positions of the nodes from `from` on at `progress` (0 to 1) of winding.
///
/// The strand leaves its `start` for the rod's nearest point and curls along circles that touch it
/// there, their radius falling from infinity to the rod's. Nodes are laid out from edge directions,
/// so at every moment each edge has its rest length, on the rod as chords of a helix of the given
/// `pitch` (m per turn). `start` is the whole strand, root first; if the rod is out of the root's
/// reach, the strand is wound as near to it as it reaches.
pub(crate) fn winding(
    rod: &LocalRod,
    start: &[Vec3],
    lengths: &[f32],
    from: usize,
    pitch: f32,
    progress: f32,
) -> Vec<Vec3> {
    let origin = start[from];
    let rel = origin - rod.center;
    let along = rel.dot(rod.axis).clamp(-rod.half_length, rod.half_length);
    let off = rel - rod.axis * rel.dot(rod.axis);
    let outward = off.try_normalize().unwrap_or_else(|| rod.axis.any_orthonormal_vector());
    let mut touch = rod.center + rod.axis * along + outward * rod.radius;
    let slack: f32 = lengths[..from].iter().sum();
    let away = touch.distance(start[0]);
    if away > slack {
        touch = start[0] + (touch - start[0]) * (drawn_out(away, slack) / away);
    }
    // Around the rod in the direction the strand already has.
    let mut tangent = rod.axis.cross(outward);
    let heading = start.get(from + 1).map_or(tangent, |next| *next - origin);
    let sense = if heading.dot(tangent) < 0.0 { -1.0 } else { 1.0 };
    tangent *= sense;

    let u = progress.clamp(0.0, 1.0);
    let u = u.squared() * (3.0 - 2.0 * u);
    let radius = rod.radius / u.max(1e-4);
    // In the first third the edges also rotate from their initial directions.
    let joined = (3.0 * u).min(1.0);
    let mut p = origin.lerp(touch, joined);
    let mut angle = 0.0;
    let mut nodes = vec![p];
    for j in from..lengths.len() {
        let l = lengths[j];
        let on_rod = 2.0 * ops::asin((0.5 * l / rod.radius).min(1.0));
        let rise = (pitch * on_rod / core::f32::consts::TAU * u).clamp(-0.5 * l, 0.5 * l);
        let flat = (l * l - rise * rise).sqrt();
        let turn = 2.0 * ops::asin((0.5 * flat / radius).min(1.0));
        let (sin, cos) = ops::sin_cos(angle + 0.5 * turn);
        let helix = (tangent * cos - outward * sin) * (flat / l) + rod.axis * (rise / l);
        let pointed = (start[j + 1] - start[j]).normalize_or(helix);
        let direction =
            Quat::IDENTITY.slerp(Quat::from_rotation_arc(pointed, helix), joined) * pointed;
        p += direction * l;
        nodes.push(p);
        angle += turn;
    }
    nodes
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn straight(n: usize) -> (Vec<Vec3>, Vec<f32>) {
        let points = (0..=n).map(|i| Vec3::NEG_Y * (0.03 * i as f32)).collect();
        (points, vec![0.03; n])
    }

    const ROD: LocalRod = LocalRod {
        center: Vec3::new(0.03, -0.06, 0.0),
        axis: Vec3::Z,
        radius: 0.03,
        half_length: 0.1,
    };

    #[test]
    fn a_wound_strand_lies_on_the_rod() {
        let (start, lengths) = straight(16);
        for p in winding(&ROD, &start, &lengths, 2, 0.004, 1.0) {
            let rel = p - ROD.center;
            assert!(((rel - ROD.axis * rel.z).length() - 0.03).abs() < 3e-5, "{p}");
        }
    }

    proptest! {
        /// Once the edges have turned to a rod in reach, at every moment the coil is around it, not in it.
        #[test]
        fn a_coil_that_closes_is_never_in_its_rod(u in 0.34f32..=1.0, from in 2usize..5) {
            let (start, lengths) = straight(16);
            // Inverse of the smoothstep.
            let progress = 0.5 - ops::sin(ops::asin(1.0 - 2.0 * u) / 3.0);
            for p in winding(&ROD, &start, &lengths, from, 0.004, progress) {
                let rel = p - ROD.center;
                let depth = ROD.radius - rel.reject_from_normalized(ROD.axis).length();
                prop_assert!(depth < 3e-5, "{depth} m inside at {progress}");
            }
        }

        #[test]
        fn no_edge_is_stretched_on_the_way(progress in 0f32..=1.0, from in 0usize..10) {
            let (start, lengths) = straight(16);
            let nodes = winding(&ROD, &start, &lengths, from, 0.004, progress);
            prop_assert_eq!(nodes.len(), start.len() - from);
            for pair in nodes.windows(2) {
                prop_assert!((pair[0].distance(pair[1]) / 0.03 - 1.0).abs() < 1e-5);
            }
        }
    }

    #[test]
    fn a_coil_rises_by_its_pitch_each_turn() {
        let (start, lengths) = straight(30);
        // An edge as long as the radius goes a sixth of the way around.
        let nodes = winding(&ROD, &start, &lengths, 2, 0.004, 1.0);
        for (k, pair) in nodes.iter().zip(&nodes[6..]).enumerate() {
            let rise = (*pair.1 - *pair.0).dot(ROD.axis);
            assert!((rise - 0.004).abs() < 1e-5, "{rise} m in the turn from {k}");
        }
    }

    #[test]
    fn a_rod_out_of_reach_draws_hair_out_and_no_farther() {
        let (start, lengths) = straight(16);
        for x in [0.03, 0.1, 0.3] {
            let rod = LocalRod { center: ROD.center.with_x(x), ..ROD };
            let nodes = winding(&rod, &start, &lengths, 3, 0.004, 1.0);
            let away = nodes[0].distance(start[0]);
            assert!(away <= 0.09 + 1e-6, "{away} m from the root, with 0.09 m of hair");
            // Within reach it is wound on the rod's surface.
            let off = (nodes[0] - rod.center).reject_from_normalized(rod.axis).length();
            assert!(x > 0.05 || (off - rod.radius).abs() < 1e-5, "{off}");
        }
    }

    #[test]
    fn winding_begins_where_the_strand_is() {
        let (start, lengths) = straight(16);
        let nodes = winding(&ROD, &start, &lengths, 2, 0.004, 0.0);
        assert!(nodes.iter().zip(&start[2..]).all(|(a, b)| a.distance(*b) < 1e-4));
    }
}
