//! Spread order: prefixes that sample roots evenly.
//!
//! Roots are split recursively at the median of their widest axis. Halves hold equally many
//! strands, so that a prefix is dense where hair is.

use crate::base::grid::split_at_median;
use glam::Vec3;

/// Indices of the points in an order of which any prefix is an evenly spaced subset: it has equally
/// many points of both halves of every split, up to one. So strands chosen at a coarse level are
/// chosen at all finer ones. Points have to be finite.
pub fn spread_order(places: &[Vec3]) -> Vec<u32> {
    let mut order: Vec<u32> = (0..places.len() as u32).collect();
    let mut scratch = order.clone();
    arrange(places, &mut order, &mut scratch);
    order
}

fn arrange(places: &[Vec3], ids: &mut [u32], scratch: &mut [u32]) {
    if ids.len() < 2 {
        return;
    }
    let half = ids.len().div_ceil(2);
    split_at_median(ids, half, |id| (places[*id as usize], *id));
    let (one, other) = ids.split_at_mut(half);
    let (for_one, for_other) = scratch.split_at_mut(half);
    arrange(places, one, for_one);
    arrange(places, other, for_other);
    // Alternates between the halves, beginning with the one whose first point is nearer to the middle.
    let place = |id: &u32| places[*id as usize];
    let middle = ids.iter().map(place).sum::<Vec3>() / ids.len() as f32;
    let from_middle = |i: usize| place(&ids[i]).distance_squared(middle);
    let (a, b) = if ids.len().is_multiple_of(2) && from_middle(half) < from_middle(0) {
        (half, 0)
    } else {
        (0, half)
    };
    for (i, id) in scratch.iter_mut().enumerate() {
        *id = ids[i / 2 + if i % 2 == 0 { a } else { b }];
    }
    ids.copy_from_slice(scratch);
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

    /// Roots by chance on the upper half of a head, denser to one side.
    fn head(count: usize) -> Vec<Vec3> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut places = Vec::new();
        while places.len() < count {
            let [x, y, z] = core::array::from_fn(|_| random.random_range(-1.0_f32..1.0));
            let p = Vec3::new(x, y.abs(), z);
            let dense = random.random_range(0.0_f32..1.0) < 0.6 + 0.4 * p.x;
            if dense && (0.1..1.0).contains(&p.length_squared()) {
                places.push(p.normalize() * 0.09);
            }
        }
        places
    }

    /// Mean and largest distance to the nearest chosen one (m).
    fn cover(places: &[Vec3], chosen: &[u32]) -> (f32, f32) {
        let nearest = places.iter().map(|p| {
            let squares = chosen.iter().map(|c| places[*c as usize].distance_squared(*p));
            squares.fold(f32::INFINITY, f32::min).sqrt()
        });
        let all: Vec<f32> = nearest.collect();
        (all.iter().sum::<f32>() / all.len() as f32, all.into_iter().fold(0.0, f32::max))
    }

    #[test]
    fn every_prefix_of_the_order_is_spread_evenly() {
        let places = head(2000);
        let order = spread_order(&places);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().zip(0..).all(|(a, b)| *a == b), "everyone once");
        // Random: the order in which they were made.
        let chance: Vec<u32> = (0..2000).collect();
        for count in [20, 137, 500, 1000] {
            let (mean, most) = cover(&places, &order[..count]);
            let by_chance = cover(&places, &chance[..count]);
            println!("{count}: {mean} m, at most {most} m; by chance {by_chance:?}");
            assert!(most < 0.9 * by_chance.1, "{count}: {most} m, by chance {} m", by_chance.1);
            assert!(mean < 0.95 * by_chance.0, "{count}: {mean} m, by chance {} m", by_chance.0);
        }
        // Dense and thin halves give the same share.
        for count in [100, 500, 1000] {
            let of = |ids: &[u32]| {
                ids.iter().filter(|i| places[**i as usize].x > 0.03).count() as f32
                    / ids.len() as f32
            };
            assert!((of(&order[..count]) - of(&chance)).abs() < 0.02, "{count}");
        }
    }

    #[test]
    fn the_order_does_not_depend_on_the_input_order_except_for_coinciding_roots() {
        let places = head(300);
        let order = spread_order(&places);
        let reversed: Vec<Vec3> = places.iter().rev().copied().collect();
        let back: Vec<u32> = spread_order(&reversed).into_iter().map(|i| 299 - i).collect();
        assert_eq!(order, back);
        assert_eq!(spread_order(&[Vec3::ONE; 5]).len(), 5);
        assert!(spread_order(&[]).is_empty());
    }
}
