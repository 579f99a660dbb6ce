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
    use bevy::math::Vec3Swizzles;

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

    /// The published outputs of SplitMix64 from the state 0, which coordinates bring about that take the
    /// hash back to the generator's next state.
    #[test]
    fn lattice_values_are_those_of_splitmix() {
        const GAMMA: u64 = 0x9e37_79b9_7f4a_7c15;
        let outputs: [u64; 3] =
            [0xe220_a839_7b1d_cdaf, 0x6e78_9e6a_a1b9_65f4, 0x06c4_5d18_8009_454f];
        let back = |k: u64| GAMMA.wrapping_mul(k).wrapping_sub(outputs[k as usize - 1]) as i64;
        let bits = |value: f32| ((value + 1.0) * 1_048_576.0) as u64;
        let found = lattice(0, [0, back(1), back(2)]).to_array().map(bits);
        assert_eq!(found, [0, 21, 42].map(|shift| outputs[2] >> shift & 0x1f_ffff));
    }

    #[test]
    fn lattice_values_are_uniform_and_independent() {
        let side = 40;
        let at = |k: i64| [k % side - 20, k / side % side - 20, k / (side * side) - 20];
        let count = side * side * side;
        let (mut mean, mut square, mut mixed) = (Vec3::ZERO, Vec3::ZERO, Vec3::ZERO);
        let mut beside = [Vec3::ZERO; 4];
        for point in (0..count).map(at) {
            let here = lattice(7, point);
            assert!(here.abs().max_element() <= 1.0);
            mean += here;
            square += here * here;
            mixed += here * here.yzx();
            for axis in 0..3 {
                let mut next = point;
                next[axis] += 1;
                beside[axis] += here * lattice(7, next);
            }
            beside[3] += here * lattice(8, point);
        }
        // Five standard errors: of a uniform value 1/√3, of a square √(4/45), of a product 1/3.
        let (n, close) = (count as f32, 5.0 / (count as f32).sqrt());
        assert!((mean / n).abs().max_element() < 0.58 * close, "{}", mean / n);
        assert!((square / n - 1.0 / 3.0).abs().max_element() < 0.3 * close, "{}", square / n);
        for product in beside.into_iter().chain([mixed]) {
            assert!((product / n).abs().max_element() < 0.34 * close, "{}", product / n);
        }
    }

    #[test]
    fn noise_has_the_lattices_values_at_its_points_and_no_kink_between() {
        let at = DVec3::new(-3.0, 5.0, 2.0);
        assert_eq!(noise(7, at), lattice(7, [-3, 5, 2]));
        let middle = noise(7, at + DVec3::new(0.0, 0.5, 0.0));
        let mean = 0.5 * (lattice(7, [-3, 5, 2]) + lattice(7, [-3, 6, 2]));
        assert!(middle.distance(mean) < 1e-6, "{middle} {mean}");
        // Quintic fade: slope and curvature are 0 at the points, from both sides.
        for side in [-1e-2, 1e-2] {
            let off = noise(7, at + DVec3::splat(side)).distance(noise(7, at));
            assert!(off < 1e-4, "{off}");
        }
    }

    /// Also of seeds that have no bit in common with the number by which the eddies' seed differs.
    #[test]
    fn eddies_are_small_and_have_a_seed_of_their_own() {
        let place = Vec3::new(0.31, -2.2, 1.7);
        let eddies = |seed: u32| {
            4.0 * (gust(seed, place, DVec3::ZERO, 1.0) - 0.75 * noise(seed, place.as_dvec3()))
        };
        let seeds = [0, !0x9e37_79b9, 0x9e37_79b9, 1];
        for (i, a) in seeds.into_iter().enumerate() {
            assert!(eddies(a).distance(noise(a, place.as_dvec3() * 7.0)) > 0.02, "seed {a}");
            for b in &seeds[..i] {
                assert!(eddies(a).distance(eddies(*b)) > 0.02, "seeds {a} and {b}");
            }
        }
        // A seventh of the length: after a whole lattice cell of theirs they have their lattice's values.
        let at = DVec3::new(1.0, 2.0, -3.0) / 7.0;
        let found = 4.0 * (gust(5, at.as_vec3(), DVec3::ZERO, 1.0) - 0.75 * noise(5, at));
        assert!(found.distance(lattice(5 ^ 0x9e37_79b9, [1, 2, -3])) < 1e-4, "{found}");
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
