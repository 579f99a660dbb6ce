//! Even choices among roots, and who grows near whom.
//!
//! Both split roots in two at the median across their widest direction, again and again. Halves hold
//! equally many strands, so that a choice is dense where hair is.

use core::cmp::Ordering;
use glam::Vec3;

/// The places' indices in an order whose every beginning is spread evenly: of the strands in any part
/// that the splits made, it holds the same share but for one strand. So what is chosen at a coarse
/// level is chosen at all finer ones. Places have to be finite.
pub fn even_order(places: &[Vec3]) -> Vec<u32> {
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
    split(places, ids, half);
    let (one, other) = ids.split_at_mut(half);
    let (for_one, for_other) = scratch.split_at_mut(half);
    arrange(places, one, for_one);
    arrange(places, other, for_other);
    // One strand of one half, one of the other, beginning with who is nearer to the middle of both.
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

/// Parts places so that `first` of them come first, across their widest direction; says which that is.
fn split(places: &[Vec3], ids: &mut [u32], first: usize) -> usize {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for id in ids.iter() {
        (low, high) = (low.min(places[*id as usize]), high.max(places[*id as usize]));
    }
    let axis = (high - low).max_position();
    if first < ids.len() {
        // Those in one place go by their number: the same halves on every machine.
        ids.select_nth_unstable_by(first, |a, b| along(places, axis, *a, *b));
    }
    axis
}

fn along(places: &[Vec3], axis: usize, a: u32, b: u32) -> Ordering {
    places[a as usize][axis].total_cmp(&places[b as usize][axis]).then(a.cmp(&b))
}

/// Finds the places nearest to a point.
#[derive(Debug, Default)]
pub struct Nearest<'a> {
    places: &'a [Vec3],
    ids: Vec<u32>,
    /// The direction in which each place parts those around it.
    axes: Vec<u8>,
}

impl<'a> Nearest<'a> {
    /// Among these places, which have to be finite.
    pub fn among(places: &'a [Vec3]) -> Self {
        let mut ids: Vec<u32> = (0..places.len() as u32).collect();
        let mut axes = vec![0; ids.len()];
        grow(places, &mut ids, &mut axes);
        Self { places, ids, axes }
    }

    /// The `N` places nearest to `point`, nearest first, with their squared distances; fewer where
    /// there are not as many. Equally far ones by their number.
    pub fn to<const N: usize>(&self, point: Vec3) -> impl Iterator<Item = (usize, f32)> + use<N> {
        let mut found = [(f32::INFINITY, u32::MAX); N];
        self.search(point, 0, self.ids.len(), &mut found);
        found.into_iter().filter(|f| f.1 != u32::MAX).map(|(square, id)| (id as usize, square))
    }

    fn search(&self, point: Vec3, from: usize, to: usize, found: &mut [(f32, u32)]) {
        if from >= to {
            return;
        }
        let middle = from + (to - from) / 2;
        let (id, axis) = (self.ids[middle], self.axes[middle] as usize);
        let place = self.places[id as usize];
        insert(found, (place.distance_squared(point), id));
        let beyond = point[axis] - place[axis];
        let (near, far) = ((from, middle), (middle + 1, to));
        let (near, far) = if beyond < 0.0 { (near, far) } else { (far, near) };
        self.search(point, near.0, near.1, found);
        if found.last().is_some_and(|last| beyond * beyond <= last.0) {
            self.search(point, far.0, far.1, found);
        }
    }
}

fn grow(places: &[Vec3], ids: &mut [u32], axes: &mut [u8]) {
    if ids.is_empty() {
        return;
    }
    let middle = ids.len() / 2;
    axes[middle] = split(places, ids, middle) as u8;
    let (before, after) = ids.split_at_mut(middle);
    let (axes_before, axes_after) = axes.split_at_mut(middle);
    grow(places, before, axes_before);
    grow(places, &mut after[1..], &mut axes_after[1..]);
}

/// Puts one into a list that is sorted, and lets the last fall out.
fn insert(found: &mut [(f32, u32)], one: (f32, u32)) {
    let mut one = one;
    for known in found {
        if one.0.total_cmp(&known.0).then(one.1.cmp(&known.1)).is_lt() {
            core::mem::swap(known, &mut one);
        }
    }
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
    fn every_beginning_of_the_order_is_spread_evenly() {
        let places = head(2000);
        let order = even_order(&places);
        let mut sorted = order.clone();
        sorted.sort_unstable();
        assert!(sorted.iter().zip(0..).all(|(a, b)| *a == b), "everyone once");
        // By chance: the order in which they were made.
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
    fn an_order_does_not_depend_on_how_roots_came_unless_they_are_in_one_place() {
        let places = head(300);
        let order = even_order(&places);
        let reversed: Vec<Vec3> = places.iter().rev().copied().collect();
        let back: Vec<u32> = even_order(&reversed).into_iter().map(|i| 299 - i).collect();
        assert_eq!(order, back);
        assert_eq!(even_order(&[Vec3::ONE; 5]).len(), 5);
        assert!(even_order(&[]).is_empty());
    }

    #[test]
    fn the_nearest_are_found() {
        let places = head(500);
        let tree = Nearest::among(&places);
        for point in head(50).into_iter().chain([Vec3::ZERO, places[3]]) {
            let mut all: Vec<(f32, usize)> =
                places.iter().map(|p| p.distance_squared(point)).zip(0..).collect();
            all.sort_by(|a, b| a.0.total_cmp(&b.0));
            let found: Vec<usize> = tree.to::<8>(point).map(|f| f.0).collect();
            assert_eq!(found, all[..8].iter().map(|f| f.1).collect::<Vec<_>>());
        }
        assert_eq!(Nearest::among(&places[..3]).to::<8>(Vec3::ZERO).count(), 3);
        assert_eq!(Nearest::default().to::<8>(Vec3::ZERO).count(), 0);
    }
}
