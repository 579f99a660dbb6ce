//! Gusts: smooth noise advected by the wind.

use bevy::math::{DVec3, Vec3};

/// Value noise: each component between −1 and 1 with mean 0, random at the points of the unit
/// lattice and interpolated by the quintic fade (Perlin 2002).
pub fn noise(seed: u32, at: DVec3) -> Vec3 {
    let cell = at.floor();
    let t = (at - cell).as_vec3();
    let fade = t * t * t * (t * (t * 6.0 - 15.0) + 10.0);
    let [i, j, k] = cell.to_array().map(|c| c as i64);
    let corner = |x: i64, y: i64, z: i64| {
        lattice(seed, [i.wrapping_add(x), j.wrapping_add(y), k.wrapping_add(z)])
    };
    let row = |y, z| corner(0, y, z).lerp(corner(1, y, z), fade.x);
    let face = |z| row(0, z).lerp(row(1, z), fade.y);
    face(0).lerp(face(1), fade.z)
}

/// Gusts of a length (m) at a place (m), after the wind has travelled by `travelled` (m):
/// components of at most 1, with eddies of a seventh of the length.
///
/// Turbulence is advected as if frozen in the mean wind (Taylor 1938).
pub fn gust(seed: u32, place: Vec3, travelled: DVec3, length: f32) -> Vec3 {
    let at = (place.as_dvec3() - travelled) / f64::from(length);
    0.75 * noise(seed, at) + 0.25 * noise(seed ^ 0x9e37_79b9, at * 7.0)
}

/// A random value for each component at a lattice point, of 21 bits each.
fn lattice(seed: u32, point: [i64; 3]) -> Vec3 {
    // The finalizer of SplitMix64 (Steele, Lea & Flood 2014) over all coordinates.
    let mut hash = u64::from(seed);
    for coordinate in point {
        hash = hash.wrapping_add(coordinate as u64).wrapping_add(0x9e37_79b9_7f4a_7c15);
        hash = (hash ^ (hash >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        hash = (hash ^ (hash >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        hash ^= hash >> 31;
    }
    let part = |shift: u32| ((hash >> shift) & 0x1f_ffff) as f32 / 0x10_0000 as f32 - 1.0;
    Vec3::new(part(0), part(21), part(42))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn gusts_are_smooth_unbiased_and_depend_on_the_seed() {
        let (mut sum, mut squares) = (Vec3::ZERO, 0.0);
        let mut before = noise(7, DVec3::ZERO);
        for i in 1..20_000 {
            let at = DVec3::new(0.02, 0.013, -0.017) * f64::from(i);
            let now = noise(7, at);
            assert!(now.abs().max_element() <= 1.0);
            assert!(now.distance(before) < 0.15, "at {at}");
            (sum, squares) = (sum + now, squares + now.length_squared());
            before = now;
        }
        assert!((sum / 20_000.0).length() < 0.1, "{}", sum / 20_000.0);
        assert!(squares / 20_000.0 > 0.2, "{}", squares / 20_000.0);
        let at = DVec3::new(0.3, 4.2, -1.7);
        assert_eq!(noise(7, at), noise(7, at));
        assert_ne!(noise(7, at), noise(8, at));
    }

    #[test]
    fn gusts_are_advected_by_the_wind() {
        let travelled = DVec3::new(3.0, 0.0, 1.0);
        let here = gust(1, Vec3::new(0.2, 1.0, 0.1), DVec3::ZERO, 4.0);
        let there = gust(1, Vec3::new(3.2, 1.0, 1.1), travelled, 4.0);
        assert!(here.distance(there) < 1e-5);
        let far = gust(1, Vec3::X * 1e6, DVec3::splat(1e12), 4.0);
        assert!(far.is_finite() && gust(1, Vec3::MAX, -travelled, 1e-3).is_finite());
    }
}
