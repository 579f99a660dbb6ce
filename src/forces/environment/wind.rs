//! Air as mathematics: equation 17 of \[B\].

use glam::Vec3;

/// The distance in equation 17's d + 1, which the paper gives in cm (m).
pub const REFERENCE_DISTANCE: f32 = 0.01;

/// Wind of a blower on an edge, as an acceleration (m/s²): equation 17,
/// a = α sinθ / (d / 1 cm + 1) ŵ.
///
/// `aim` is the unit direction ŵ from the nozzle, `edge` the edge that starts at `p`, θ the angle
/// between both, d the distance of `p` from the axis. An edge along the wind gets none, and nothing
/// blows behind the nozzle.
#[inline]
pub fn wind(strength: f32, nozzle: Vec3, aim: Vec3, p: Vec3, edge: Vec3) -> Vec3 {
    let to = p - nozzle;
    let along = to.dot(aim);
    if along <= 0.0 {
        return Vec3::ZERO;
    }
    let distance = (to - aim * along).length();
    let sine = aim.cross(edge).length() / edge.length().max(1e-12);
    aim * (strength * sine / (distance / REFERENCE_DISTANCE + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn wind_falls_with_distance_from_the_axis_and_spares_edges_along_it() {
        let w = |p, e| wind(20.0, Vec3::ZERO, Vec3::X, p, e);
        assert_eq!(w(Vec3::X, Vec3::Y), Vec3::X * 20.0);
        assert!((w(Vec3::new(1.0, 0.03, 0.0), Vec3::Y).x - 5.0).abs() < 1e-4);
        assert_eq!(w(Vec3::X, Vec3::X * 0.03), Vec3::ZERO);
        assert_eq!(w(Vec3::NEG_X, Vec3::Y), Vec3::ZERO);
        let slanted = w(Vec3::X, Vec3::new(1.0, 1.0, 0.0));
        assert!((slanted.x - 20.0 * 0.5_f32.sqrt()).abs() < 1e-4);
    }
}
