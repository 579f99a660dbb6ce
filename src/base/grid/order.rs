//! A spatially coherent order of points.

use super::split_at_median;
use glam::Vec3;

/// Indices of `points` in an order in which each consecutive `group` of them fills a small box: boxes
/// are halved across their longest side, in whole groups, until they hold one group.
pub(crate) fn compact_groups(points: &[Vec3], group: usize) -> Vec<u32> {
    let mut order: Vec<u32> = (0..points.len() as u32).collect();
    halve(&mut order, points, group.max(1));
    order
}

fn halve(order: &mut [u32], points: &[Vec3], group: usize) {
    if order.len() <= group {
        return;
    }
    let middle = (order.len() / 2).next_multiple_of(group).min(order.len() - 1);
    split_at_median(order, middle, |i| (points[*i as usize], *i));
    let (before, after) = order.split_at_mut(middle);
    halve(before, points, group);
    halve(after, points, group);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn groups_fill_small_boxes_and_hold_every_point_once() {
        let scattered = |i: u32| {
            Vec3::new(i as f32 * 0.618_034, i as f32 * 0.754_877, i as f32 * 0.569_84).fract()
        };
        let points: Vec<Vec3> = (0..1000).map(scattered).collect();
        let order = compact_groups(&points, 16);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().copied().eq(0..1000));
        for group in order.chunks(16) {
            let place = |i: &u32| points[*i as usize];
            let low = group.iter().map(place).fold(Vec3::INFINITY, Vec3::min);
            let high = group.iter().map(place).fold(Vec3::NEG_INFINITY, Vec3::max);
            // Sixteen of a thousand fill a sixty-third: a box of a quarter's edges.
            assert!((high - low).max_element() < 0.5, "{low} {high}");
        }
        assert!(compact_groups(&[], 16).is_empty());
        assert_eq!(compact_groups(&[Vec3::NAN; 40], 16).len(), 40);
    }
}
