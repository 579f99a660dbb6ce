//! Who is nearest: a k-d tree.
//!
//! In place of a crate, because equally far ones have to come by their number, the same on every
//! machine and in every version, and callers leave some out while searching.

use glam::Vec3;

/// Places of which the nearest to a point are found, each with a number of the caller's.
///
/// ```
/// # use bevy_keratin::grid::KdTree; use bevy::math::Vec3;
/// let tree = KdTree::new((0..5).map(|i| (Vec3::X * i as f32, i)));
/// let two: Vec<_> = tree.nearest::<2>(Vec3::X * 2.9).map(|(i, _)| i).collect();
/// assert_eq!(two, [3, 2]);
/// ```
#[derive(Clone, Debug, Default)]
pub struct KdTree {
    /// A part's root in its middle, those before and after it on either side.
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    place: Vec3,
    item: u32,
    /// The direction in which it parts those around it.
    axis: usize,
}

impl KdTree {
    /// A tree of these places. Non-finite ones are left out.
    pub fn new(places: impl IntoIterator<Item = (Vec3, u32)>) -> Self {
        let usable = places.into_iter().filter(|(place, _)| place.is_finite());
        let mut nodes: Vec<_> = usable.map(|(place, item)| Node { place, item, axis: 0 }).collect();
        build(&mut nodes);
        Self { nodes }
    }

    /// The `N` nearest to `point`, nearest first, with their squared distances; fewer where there are
    /// not as many, none for a non-finite point. Equally far ones by their number.
    pub fn nearest<const N: usize>(
        &self,
        point: Vec3,
    ) -> impl Iterator<Item = (u32, f32)> + use<N> {
        self.nearest_of::<N, _>(point, |_, _| true)
    }

    /// The nearest to `point` if it is nearer than `known`, a number with its squared distance; else
    /// that. A search that begins near its end is short.
    #[cfg(feature = "groom")]
    pub(crate) fn nearer_than(&self, point: Vec3, known: (u32, f32)) -> (u32, f32) {
        let mut found = [(known.1, known.0)];
        if point.is_finite() {
            search(&self.nodes, point, &|_, _| true, &mut found);
        }
        (found[0].1, found[0].0)
    }

    /// The same among those that `is_meant` takes by their number and squared distance.
    pub fn nearest_of<const N: usize, F: Fn(u32, f32) -> bool>(
        &self,
        point: Vec3,
        is_meant: F,
    ) -> impl Iterator<Item = (u32, f32)> + use<N, F> {
        let mut found = [(f32::INFINITY, u32::MAX); N];
        if point.is_finite() {
            search(&self.nodes, point, &is_meant, &mut found);
        }
        found.into_iter().filter(|f| f.1 != u32::MAX).map(|(square, item)| (item, square))
    }
}

fn search(
    nodes: &[Node],
    point: Vec3,
    is_meant: &impl Fn(u32, f32) -> bool,
    found: &mut [(f32, u32)],
) {
    search_box(nodes, point, Vec3::ZERO, is_meant, found);
}

/// Searches the places in a box of which `point` is outside by `off` in each direction.
fn search_box(
    nodes: &[Node],
    point: Vec3,
    off: Vec3,
    is_meant: &impl Fn(u32, f32) -> bool,
    found: &mut [(f32, u32)],
) {
    let middle = nodes.len() / 2;
    let Some(node) = nodes.get(middle) else { return };
    let square = node.place.distance_squared(point);
    if is_meant(node.item, square) {
        insert(found, (square, node.item));
    }
    let beyond = point[node.axis] - node.place[node.axis];
    let (near, far) = (&nodes[..middle], &nodes[middle + 1..]);
    let (near, far) = if beyond < 0.0 { (near, far) } else { (far, near) };
    search_box(near, point, off, is_meant, found);
    let mut off = off;
    off[node.axis] = beyond;
    // Rounding must not cut off one that is as far as the last.
    const SLACK: f32 = 1.0 - 1e-5;
    if found.last().is_some_and(|last| off.length_squared() * SLACK <= last.0) {
        search_box(far, point, off, is_meant, found);
    }
}

fn build(nodes: &mut [Node]) {
    if nodes.is_empty() {
        return;
    }
    let middle = nodes.len() / 2;
    nodes[middle].axis = split_at_median(nodes, middle, |node| (node.place, node.item));
    let (before, after) = nodes.split_at_mut(middle);
    build(before);
    build(&mut after[1..]);
}

/// Puts one into a list that is sorted, and lets the last fall out.
fn insert(found: &mut [(f32, u32)], mut one: (f32, u32)) {
    for known in found {
        if one.0.total_cmp(&known.0).then(one.1.cmp(&known.1)).is_lt() {
            core::mem::swap(known, &mut one);
        }
    }
}

/// Parts items so that `first` of them come first, across the widest direction of their places; says
/// which that is. Those in one place go by their number: the same halves on every machine.
pub(crate) fn split_at_median<T>(
    items: &mut [T],
    first: usize,
    key: impl Fn(&T) -> (Vec3, u32),
) -> usize {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    for item in items.iter() {
        let (place, _) = key(item);
        (low, high) = (low.min(place), high.max(place));
    }
    let axis = (high - low).max_position();
    if first < items.len() {
        items.select_nth_unstable_by(first, |a, b| {
            let ((a, i), (b, j)) = (key(a), key(b));
            a[axis].total_cmp(&b[axis]).then(i.cmp(&j))
        });
    }
    axis
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

    /// Places on a lattice: many of them equally far from any of them, some in one place.
    fn places(count: usize, seed: u64) -> Vec<Vec3> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
        let mut place = || Vec3::from_array([(); 3].map(|()| random.random_range(-6_i8..6).into()));
        (0..count).map(|_| place()).collect()
    }

    fn tree(places: &[Vec3]) -> KdTree {
        KdTree::new(places.iter().copied().zip(0..))
    }

    fn by_looking_at_all(places: &[Vec3], point: Vec3) -> Vec<(u32, f32)> {
        let mut all: Vec<_> =
            (0..).zip(places).map(|(i, p)| (i, p.distance_squared(point))).collect();
        all.sort_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)));
        all
    }

    #[test]
    fn the_nearest_are_found_and_equally_far_ones_by_number() {
        let places = places(500, 7);
        let tree = tree(&places);
        for point in self::places(50, 8).into_iter().chain([Vec3::ZERO, Vec3::splat(0.3)]) {
            let all = by_looking_at_all(&places, point);
            assert_eq!(tree.nearest::<8>(point).collect::<Vec<_>>(), all[..8]);
            let even = |i: u32, square: f32| i.is_multiple_of(2) && square > 0.5;
            let some: Vec<_> = all.into_iter().filter(|f| even(f.0, f.1)).take(8).collect();
            assert_eq!(tree.nearest_of::<8, _>(point, even).collect::<Vec<_>>(), some);
        }
    }

    #[test]
    fn what_is_not_there_is_not_found() {
        let some = tree(&[Vec3::ZERO, Vec3::NAN, Vec3::X, Vec3::INFINITY]);
        assert_eq!(some.nearest::<8>(Vec3::Z).collect::<Vec<_>>(), [(0, 1.0), (2, 2.0)]);
        assert_eq!(some.nearest::<8>(Vec3::NAN).count(), 0);
        assert_eq!(some.nearest::<0>(Vec3::Z).count(), 0);
        assert_eq!(KdTree::default().nearest::<8>(Vec3::ZERO).count(), 0);
    }
}
