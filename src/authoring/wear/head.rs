//! Finding the head's centre and height from its shape.

use bevy::prelude::*;

/// Height from the middle between the ears to the crown, over the skull's depth from forehead to
/// back: 0.13 and 0.20 m on men and women (tragion to vertex and glabella to occiput of ANSUR II),
/// with the middle between the ears a little above the ear's hole.
const HEIGHT_OF_DEPTH: f32 = 0.6;
/// Iterations until height and depth are consistent.
const ROUNDS: usize = 8;

/// A head's middle between the ears, and its height above that (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct HeadPlace {
    pub(super) center: Vec3,
    pub(super) height: f32,
}

/// The head whose skin these points are, with Y up and Z from front to back; neck and body below may
/// be among them. `None` without points.
///
/// The crown is the highest point. The depth is that of the part above the ears, so that neither
/// nose nor chin nor chest count; its height follows from the depth itself.
pub(super) fn find_head(points: &[Vec3]) -> Option<HeadPlace> {
    let crown = points.iter().map(|p| p.y).fold(f32::NEG_INFINITY, f32::max);
    let bounds = |height: f32| {
        let upper = points.iter().filter(|p| p.y >= crown - height);
        upper.fold((Vec3::INFINITY, Vec3::NEG_INFINITY), |(a, b), p| (a.min(*p), b.max(*p)))
    };
    let mut height = f32::INFINITY;
    let mut middle = Vec3::ZERO;
    for _ in 0..ROUNDS {
        let (low, high) = bounds(height);
        height = HEIGHT_OF_DEPTH * (high.z - low.z);
        middle = 0.5 * (low + high);
    }
    let center = Vec3::new(middle.x, crown - height, middle.z);
    (center.is_finite() && height.is_finite()).then_some(HeadPlace { center, height })
}

/// Whether a bone's name ends with the word head: `Head`, `head`, `mixamorig:Head`, `J_Bip_C_Head`,
/// but not `forehead`.
pub(super) fn is_head(name: &str) -> bool {
    let Some(start) = name.len().checked_sub(4) else { return false };
    let Some(word) = name.get(start..).filter(|word| word.eq_ignore_ascii_case("head")) else {
        return false;
    };
    let before = name[..start].chars().next_back();
    // Capitals begin words, unless the whole name has them.
    let is_new = word.starts_with('H') && before.is_some_and(char::is_lowercase);
    before.is_none_or(|c| !c.is_alphabetic() || is_new)
}

/// Whether a bone is the head by Rigify's name for it, the last of the spine: `spine.006`,
/// `DEF-spine.006`, `DEF-spine006`.
pub(super) fn is_head_of_rigify(name: &str) -> bool {
    let name = name.rsplit(['-', ':', '|']).next().unwrap_or(name);
    name.eq_ignore_ascii_case("spine.006") || name.eq_ignore_ascii_case("spine006")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_bone_is_the_head_by_the_last_word_of_its_name() {
        for name in [
            "Head",
            "head",
            "HEAD",
            "mixamorig:Head",
            "J_Bip_C_Head",
            "CC_Base_Head",
            "c.head",
            "mixamorigHead",
        ] {
            assert!(is_head(name), "{name}");
        }
        for name in [
            "",
            "forehead",
            "Head_end",
            "HeadTop_End",
            "Neck",
            "ahead",
            "FOREHEAD",
            "ead",
            "ÄHead",
            "头",
        ] {
            assert!(!is_head(name), "{name}");
        }
    }

    #[test]
    fn rigifys_head_is_the_last_of_its_spine() {
        for name in ["spine.006", "DEF-spine.006", "DEF-spine006", "ORG-Spine.006"] {
            assert!(is_head_of_rigify(name), "{name}");
        }
        for name in ["", "spine.005", "DEF-spine.0061", "tweak_spine.006x", "my spine.006"] {
            assert!(!is_head_of_rigify(name), "{name}");
        }
    }

    #[test]
    fn the_head_is_found_above_neck_and_body() {
        // An ellipsoid on a neck on a chest that is deeper than the head.
        let at = Vec3::new(0.3, 1.6, -0.2);
        let ring = |y: f32, wide: f32, deep: f32| {
            (0..64).map(move |i| {
                let (sine, cosine) = (i as f32 * 0.0982).sin_cos();
                Vec3::new(wide * cosine, y, deep * sine)
            })
        };
        let skull = (0..=64).flat_map(|i| {
            let up = 1.0 - 2.0 * i as f32 / 64.0;
            let flat = (1.0 - up * up).sqrt();
            ring(0.12 * up, 0.077 * flat, 0.098 * flat)
        });
        let neck = (0..10).flat_map(|i| ring(-0.12 - 0.01 * i as f32, 0.055, 0.055));
        let chest = (0..20).flat_map(|i| ring(-0.25 - 0.01 * i as f32, 0.18, 0.13));
        let points: Vec<Vec3> = skull.chain(neck).chain(chest).map(|p| p + at).collect();
        let head = find_head(&points).unwrap();
        assert!((head.height - 0.118).abs() < 0.006, "{head:?}");
        assert!(head.center.distance(at) < 0.008, "{head:?}");
    }

    #[test]
    fn no_points_are_no_head() {
        assert_eq!(find_head(&[]), None);
        assert_eq!(find_head(&[Vec3::NAN]), None);
        assert_eq!(find_head(&[Vec3::X; 3]).unwrap().height, 0.0);
    }
}
