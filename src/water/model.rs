//! Droplets as pure functions: the wet-hair paper's equation 2, falling, sliding, hanging.

use crate::base::lanes::{Real, V3};
use glam::Vec3;

/// Surface tension of water (N/m).
pub(crate) const SURFACE_TENSION: f32 = 0.072;
/// Dynamic viscosity of water (Pa s).
pub(crate) const WATER_VISCOSITY: f32 = 1e-3;
/// 3/8 of the drag coefficient of a sphere (0.5) times the density of air over that of water.
const SPHERE_DRAG: f32 = 0.375 * 0.5 * 0.0012;

/// \[W\] equation 2: strength of a droplet's pull at a `distance` d (m) from its centre,
/// f = 1 − ((2d − r_min − r_max)/(r_min − r_max))², for d up to r_max.
///
/// It is 1 midway, 0 at both radii and negative inside r_min, where it repels. `steepness` is 2/(r_max − r_min)
/// (1/m), `middle` (r_max + r_min)/(r_max − r_min). The direction, which the paper omits, is that from the node to
/// the droplet.
#[inline(always)]
pub fn adhesion<R: Real>(distance: R, steepness: R, middle: R) -> R {
    let x = distance * steepness - middle;
    x.lit(1.0) - x * x
}

/// Radius (m) of a ball of `volume` (m³).
#[doc(hidden)]
#[inline]
pub fn ball_radius(volume: f64) -> f32 {
    bevy::math::ops::cbrt((volume.max(0.0) * (0.75 / core::f64::consts::PI)) as f32)
}

/// Volume (m³) of a ball of `radius` (m).
#[doc(hidden)]
#[inline]
pub fn ball_volume(radius: f32) -> f64 {
    let r = f64::from(radius);
    r * r * r * (4.0 / 3.0 * core::f64::consts::PI)
}

/// Velocity (m/s) of a falling ball of water after `dt` in air that moves with `wind`. Drag grows
/// with the square of the speed; the implicit step never reverses a drop.
#[inline]
pub(crate) fn fall(velocity: Vec3, gravity: Vec3, wind: Vec3, radius: f32, dt: f32) -> Vec3 {
    let relative = velocity + gravity * dt - wind;
    let rate = SPHERE_DRAG * relative.length() / radius.max(1e-5);
    relative / (1.0 + rate * dt) + wind
}

/// Speed (m/s) at which a droplet of `radius` slides along a strand that gravity pulls along by
/// `along` (m/s²). `mobility` (s) is that of a droplet of 1 mm; as with all films it grows with the
/// square of the size.
#[inline]
pub(crate) fn slide(along: f32, radius: f32, mobility: f32) -> f32 {
    const MAX_SPEED: f32 = 0.3;
    let size = radius / 1e-3;
    (along * mobility * size * size).clamp(-MAX_SPEED, MAX_SPEED)
}

/// Largest volume of water (m³) that hangs on the tip of a bundle of radius `bundle` (m) against an
/// acceleration: Tate's law with the factor 0.6 of real drops.
#[inline]
pub(crate) fn hanging(bundle: f32, acceleration: f32) -> f64 {
    let weight = WATER_DENSITY * acceleration.abs().max(0.1);
    f64::from(0.6 * core::f32::consts::TAU * bundle * SURFACE_TENSION / weight)
}

/// Largest volume of water (m³) that a bundle of radius `bundle` (m) holds as one drop somewhere
/// along it: Lorenceau, Clanet and Quéré's drop on a fibre, 4π b σ/(ρ a) k² with k = 0.5.
#[inline]
pub(crate) fn clinging(bundle: f32, acceleration: f32) -> f64 {
    let weight = WATER_DENSITY * acceleration.abs().max(0.1);
    f64::from(core::f32::consts::PI * bundle * SURFACE_TENSION / weight)
}

const WATER_DENSITY: f32 = 1000.0;

/// Closest approach of two segments, or of two points in uniform motion: parameters along both, 0…1.
#[inline(always)]
pub(crate) fn closest<R: Real>(a: V3<R>, along_a: V3<R>, b: V3<R>, along_b: V3<R>) -> (R, R) {
    let (zero, one) = (a.x.lit(0.0), a.x.lit(1.0));
    let between = b - a;
    let (aa, bb, ab) = (along_a.dot(along_a), along_b.dot(along_b), along_a.dot(along_b));
    let (da, db) = (along_a.dot(between), along_b.dot(between));
    let flat = aa * bb - ab * ab;
    let crosses = (aa * bb * a.x.lit(1e-7)).lt(flat);
    let s = R::select(crosses, (da * bb - db * ab) / flat, zero).max(zero).min(one);
    let t = R::select(zero.lt(bb), (s * ab - db) / bb, zero).max(zero).min(one);
    let s = R::select(zero.lt(aa), (t * ab + da) / aa, zero).max(zero).min(one);
    (s, t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn adhesion_is_equation_2() {
        let f = |d: f32| adhesion(d, 2.0 / 0.012, 0.018 / 0.012);
        assert!((f(0.009) - 1.0).abs() < 1e-6);
        assert!(f(0.003).abs() < 1e-6 && f(0.015).abs() < 1e-5);
        assert!(f(0.001) < 0.0);
    }

    #[test]
    fn drops_fall_at_their_terminal_speed() {
        let mut v = Vec3::ZERO;
        for _ in 0..3600 {
            v = fall(v, Vec3::NEG_Y * 9.8, Vec3::ZERO, 1e-3, 1.0 / 360.0);
        }
        // Rain of 2 mm falls at 6.5 m/s.
        assert!((v.y + 6.6).abs() < 0.2, "{v}");
        let stopped = fall(Vec3::X * 1e6, Vec3::ZERO, Vec3::ZERO, 1e-4, 1.0);
        assert!(stopped.x >= 0.0 && stopped.x < 10.0);
    }

    proptest! {
        /// Drag acts on the motion relative to the air, and takes the share of it that is documented.
        #[test]
        fn drops_drift_with_the_air(
            v in [-5.0f32..5.0, -5.0f32..5.0, -5.0f32..5.0],
            wind in [-9.0f32..9.0, -9.0f32..9.0, -9.0f32..9.0],
            radius in 1e-4f32..3e-3,
            dt in 1e-3f32..0.02,
        ) {
            let (v, wind, gravity) = (Vec3::from(v), Vec3::from(wind), Vec3::NEG_Y * 9.8);
            let still = fall(v, gravity, Vec3::ZERO, radius, dt);
            let drifting = fall(v + wind, gravity, wind, radius, dt) - wind;
            prop_assert!(still.distance(drifting) < 1e-4, "{still} {drifting}");
            let with_the_air = fall(wind, Vec3::ZERO, wind, radius, dt);
            prop_assert!(with_the_air.distance(wind) < 1e-5, "{with_the_air} in {wind}");
            // Implicit: v (1 + k |v*| dt) = v* with 3/8 C_D ρ_air/ρ_water / r of a sphere.
            let free = v + gravity * dt;
            let slowed = 1.0 + 0.375 * 0.5 * 1.2e-3 / radius * free.length() * dt;
            prop_assert!((still * slowed).distance(free) < 1e-4, "{still} of {free}");
        }
    }

    #[test]
    fn a_single_hair_holds_a_microlitre_at_its_tip() {
        // 35 µm: 0.97 µL; a lock of a hundred ten times as much; at 5 g a fifth.
        assert!((hanging(35e-6, 9.8) * 1e9 - 0.97).abs() < 0.02);
        assert!((hanging(350e-6, 9.8) / hanging(35e-6, 9.8) - 10.0).abs() < 1e-4);
        assert!((clinging(35e-6, 9.8) * 1e9 - 0.81).abs() < 0.02);
        assert!((ball_radius(ball_volume(0.003)) - 0.003).abs() < 1e-8);
    }

    proptest! {
        #[test]
        fn closest_is_no_farther_than_any_other_pair(
            v in proptest::array::uniform12(-1.0f32..1.0),
            s in 0.0f32..1.0, t in 0.0f32..1.0,
        ) {
            let [a, u, b, w] = [0, 3, 6, 9].map(|i| Vec3::new(v[i], v[i + 1], v[i + 2]));
            let lane = |v: Vec3| V3::new(v.x, v.y, v.z);
            let (x, y) = closest(lane(a), lane(u), lane(b), lane(w));
            let best = (a + u * x).distance(b + w * y);
            prop_assert!(best <= (a + u * s).distance(b + w * t) + 1e-3);
        }
    }
}
