//! Nearest neighbours: a k-d tree.
//!
//! Not a crate, because ties have to be ordered by index, the same on every machine and in every
//! version, and callers filter while searching.

use glam::Vec3;

/// A k-d tree of points, each with an index of the caller's.
///
/// ```
/// # use bevy_keratin::base::grid::KdTree; use bevy::math::Vec3;
/// let tree = KdTree::new((0..5).map(|i| (Vec3::X * i as f32, i)));
/// let two: Vec<_> = tree.nearest::<2>(Vec3::X * 2.9).map(|(i, _)| i).collect();
/// assert_eq!(two, [3, 2]);
/// ```
#[doc(hidden)]
#[derive(Clone, Debug, Default)]
pub struct KdTree {
    /// A subtree's root in its middle, the two halves on either side.
    nodes: Vec<Node>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    place: Vec3,
    item: u32,
    /// The axis along which it splits.
    axis: usize,
}

impl KdTree {
    /// Builds a tree of these points. Non-finite ones are left out.
    pub fn new(places: impl IntoIterator<Item = (Vec3, u32)>) -> Self {
        let usable = places.into_iter().filter(|(place, _)| place.is_finite());
        let mut nodes: Vec<_> = usable.map(|(place, item)| Node { place, item, axis: 0 }).collect();
        build(&mut nodes);
        Self { nodes }
    }

    /// The `N` nearest to `point`, nearest first, with their squared distances; fewer where there are
    /// not as many, none for a non-finite point. Ties are ordered by index.
    pub fn nearest<const N: usize>(
        &self,
        point: Vec3,
    ) -> impl Iterator<Item = (u32, f32)> + use<N> {
        self.nearest_of::<N, _>(point, |_, _| true)
    }

    /// The nearest to `point` if it is nearer than `known` (index and squared distance), else `known`. A
    /// good start makes the search short.
    #[cfg(feature = "groom")]
    pub(crate) fn nearer_than(&self, point: Vec3, known: (u32, f32)) -> (u32, f32) {
        let mut found = [(known.1, known.0)];
        if point.is_finite() {
            search(&self.nodes, point, &|_, _| true, &mut found);
        }
        (found[0].1, found[0].0)
    }

    /// Visits the points within `reach` of `point`, nearer halves first, with their indices and squared distances; each
    /// visit returns the reach from then on.
    #[cfg(feature = "groom")]
    pub(crate) fn visit(&self, point: Vec3, reach: f32, mut each: impl FnMut(u32, f32) -> f32) {
        if point.is_finite() {
            visit_box(&self.nodes, point, Vec3::ZERO, &mut { reach }, &mut each);
        }
    }

    /// The same among those that `accepts` allows by index and squared distance.
    pub fn nearest_of<const N: usize, F: Fn(u32, f32) -> bool>(
        &self,
        point: Vec3,
        accepts: F,
    ) -> impl Iterator<Item = (u32, f32)> + use<N, F> {
        let mut found = [(f32::INFINITY, u32::MAX); N];
        if point.is_finite() {
            search(&self.nodes, point, &accepts, &mut found);
        }
        found.into_iter().filter(|f| f.1 != u32::MAX).map(|(square, item)| (item, square))
    }
}

fn search(
    nodes: &[Node],
    point: Vec3,
    accepts: &impl Fn(u32, f32) -> bool,
    found: &mut [(f32, u32)],
) {
    search_box(nodes, point, Vec3::ZERO, accepts, found);
}

/// Searches the points in a box that `point` is outside of by `off` along each axis.
fn search_box(
    nodes: &[Node],
    point: Vec3,
    off: Vec3,
    accepts: &impl Fn(u32, f32) -> bool,
    found: &mut [(f32, u32)],
) {
    let middle = nodes.len() / 2;
    let Some(node) = nodes.get(middle) else { return };
    let square = node.place.distance_squared(point);
    if accepts(node.item, square) {
        insert(found, (square, node.item));
    }
    let beyond = point[node.axis] - node.place[node.axis];
    let (near, far) = (&nodes[..middle], &nodes[middle + 1..]);
    let (near, far) = if beyond < 0.0 { (near, far) } else { (far, near) };
    search_box(near, point, off, accepts, found);
    let mut off = off;
    off[node.axis] = beyond;
    // Rounding must not prune a point as far as the last one found.
    const SLACK: f32 = 1.0 - 1e-5;
    if found.last().is_some_and(|last| off.length_squared() * SLACK <= last.0) {
        search_box(far, point, off, accepts, found);
    }
}

#[cfg(feature = "groom")]
fn visit_box(
    nodes: &[Node],
    point: Vec3,
    off: Vec3,
    reach: &mut f32,
    each: &mut impl FnMut(u32, f32) -> f32,
) {
    let middle = nodes.len() / 2;
    let Some(node) = nodes.get(middle) else { return };
    let square = node.place.distance_squared(point);
    if square <= *reach * *reach {
        *reach = each(node.item, square);
    }
    let beyond = point[node.axis] - node.place[node.axis];
    let (near, far) = (&nodes[..middle], &nodes[middle + 1..]);
    let (near, far) = if beyond < 0.0 { (near, far) } else { (far, near) };
    visit_box(near, point, off, reach, each);
    let mut off = off;
    off[node.axis] = beyond;
    if off.length() <= *reach {
        visit_box(far, point, off, reach, each);
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

/// Inserts an item into a sorted list of fixed length; the last one is dropped.
fn insert(found: &mut [(f32, u32)], one: (f32, u32)) {
    let is_before =
        |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)).is_lt();
    // Most are farther than all found so far.
    if found.last().is_some_and(|last| is_before(&one, last)) {
        let at = found.partition_point(|known| is_before(known, &one));
        found[at..].rotate_right(1);
        found[at] = one;
    }
}

/// Partitions items so that `first` of them come first along the widest axis of their points; returns
/// that axis. Ties are ordered by index: the same halves on every machine.
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
    fn the_nearest_are_found_and_ties_ordered_by_index() {
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
    fn empty_trees_and_non_finite_points_find_nothing() {
        let some = tree(&[Vec3::ZERO, Vec3::NAN, Vec3::X, Vec3::INFINITY]);
        assert_eq!(some.nearest::<8>(Vec3::Z).collect::<Vec<_>>(), [(0, 1.0), (2, 2.0)]);
        assert_eq!(some.nearest::<8>(Vec3::NAN).count(), 0);
        assert_eq!(some.nearest::<0>(Vec3::Z).count(), 0);
        assert_eq!(KdTree::default().nearest::<8>(Vec3::ZERO).count(), 0);
    }
}
