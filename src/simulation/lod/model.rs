//! Level of detail as pure functions: which level, and how large hair is on the screen.

use super::LodLevel;
use crate::hair::strand::Strand;
use bevy::math::Vec3;

/// The level for hair that takes up `share` of the view's height and was at level `before`: 0 in full, n
/// the n-th of `levels`. Coarser at a level's limit, finer again only `hysteresis` beyond it. A NaN
/// share keeps the level.
pub fn choose(levels: &[LodLevel], hysteresis: f32, before: usize, share: f32) -> usize {
    let mut level = before.min(levels.len());
    if share.is_nan() {
        return level;
    }
    while level < levels.len() && share < levels[level].below {
        level += 1;
    }
    while level > 0 && share >= levels[level - 1].below * (1.0 + hysteresis) {
        level -= 1;
    }
    level
}

/// The share of the view's height that a ball of `radius` (m) takes up at `distance` (m) in a
/// perspective whose scale (1 / tan of half the vertical angle) is `scale`.
pub fn screen_share(radius: f32, distance: f32, scale: f32) -> f32 {
    // The outline is tangent to the lines of sight: sine, not tangent. From inside it fills the view.
    let apart = distance * distance - radius * radius;
    if apart > 0.0 { (scale * radius / apart.sqrt()).min(100.0) } else { 100.0 }
}

/// Root, middle and tip of a strand.
pub(super) fn waypoints(strand: &Strand) -> [Vec3; 3] {
    let p = strand.positions();
    let last = p.len().saturating_sub(1);
    [0, last / 2, last].map(|i| p.get(i).copied().unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn levels() -> Vec<LodLevel> {
        [0.4, 0.2].map(|below| LodLevel { below, ..LodLevel::default() }).to_vec()
    }

    #[test]
    fn levels_change_at_their_limits_and_back_beyond_them() {
        let levels = levels();
        let go = |before, share| choose(&levels, 0.25, before, share);
        assert_eq!([0.5, 0.41, 0.39, 0.21, 0.19].map(|s| go(0, s)), [0, 0, 1, 1, 2]);
        assert_eq!([0.19, 0.24, 0.26, 0.45, 0.51].map(|s| go(2, s)), [2, 2, 1, 1, 0]);
        assert_eq!([0.41, 0.49, 0.5].map(|s| go(1, s)), [1, 1, 0]);
        // The choice is stable.
        for before in 0..=5 {
            for i in 0..100 {
                let level = go(before, 0.01 * i as f32);
                assert_eq!(go(level, 0.01 * i as f32), level);
            }
        }
        assert_eq!(go(1, f32::NAN), 1);
        assert_eq!(choose(&[], 0.2, 3, 0.0), 0);
    }

    #[test]
    fn a_ball_twice_as_far_is_half_as_large() {
        let share = |distance| screen_share(0.1, distance, 2.0);
        assert!((share(10.0) / share(20.0) - 2.0).abs() < 1e-3);
        assert!((share(10.0) - 0.02).abs() < 1e-5, "2 · 0.1 / 10");
        assert_eq!(share(0.05), 100.0);
    }
}
