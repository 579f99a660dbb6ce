//! Frames along a polyline: shortest rotation at the root, then parallel transport.

use glam::{Quat, Vec3};

/// Orientations of the edges of a polyline with minimal twist.
///
/// `first` gives the frame before the first edge (the scalp's), or `None` for the shortest rotation
/// from e3. Each further frame is the one before, rotated by the shortest rotation onto the next
/// tangent, so a planar strand has no twist. Neighbours stay in one hemisphere. Edges without
/// length repeat the frame before.
pub fn parallel_transport(points: &[Vec3], first: Option<Quat>) -> Vec<Quat> {
    let mut frame = first.unwrap_or(Quat::IDENTITY);
    points
        .windows(2)
        .map(|pair| {
            if let Some(tangent) = (pair[1] - pair[0]).try_normalize() {
                let turn = Quat::from_rotation_arc(frame * Vec3::Z, tangent);
                let next = (turn * frame).normalize();
                frame = if next.dot(frame) < 0.0 { -next } else { next };
            }
            frame
        })
        .collect()
}

/// Ω = Im(q̄1 q2) as a full quaternion with real part ≥ 0.
#[inline]
pub fn darboux(q1: Quat, q2: Quat) -> Quat {
    let omega = q1.conjugate() * q2;
    if omega.w < 0.0 { -omega } else { omega }
}

/// A full unit quaternion from a Darboux vector, real part ≥ 0.
#[inline]
pub fn full(omega: Vec3) -> Quat {
    let w = (1.0 - omega.length_squared()).max(0.0).sqrt();
    Quat::from_xyzw(omega.x, omega.y, omega.z, w)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_planar_arc_has_no_twist_and_equal_bends() {
        let points: Vec<Vec3> = (0..9)
            .map(|i| Vec3::new((i as f32 * 0.4).cos(), 0.0, (i as f32 * 0.4).sin()))
            .collect();
        let frames = parallel_transport(&points, None);
        for (q, p) in frames.iter().zip(points.windows(2)) {
            assert!((*q * Vec3::Z).distance((p[1] - p[0]).normalize()) < 1e-5);
        }
        for pair in frames.windows(2) {
            let omega = darboux(pair[0], pair[1]);
            assert!(omega.z.abs() < 1e-6, "twist {}", omega.z);
            assert!((omega.xyz().length() - (0.2_f32).sin()).abs() < 1e-5);
        }
    }

    #[test]
    fn an_antiparallel_tangent_still_gives_a_frame() {
        let frames = parallel_transport(&[Vec3::ZERO, Vec3::NEG_Z, Vec3::NEG_Z * 2.0], None);
        assert!(
            frames.iter().all(|q| q.is_finite() && (*q * Vec3::Z).distance(Vec3::NEG_Z) < 1e-5)
        );
    }
}
