//! The uniform grid as pure functions: neighbours without testing all pairs.
//!
//! Wet-hair paper (\[W\]) equations 4 and 5, as meant: a point's cell is ⌊p / h⌋ with the cell size h
//! at least the search radius, so that its neighbours lie in the 27 cells around. The paper's cells
//! cover a box of N³; here the cells' keys are hashed into a table, so the world has no edges and an
//! outlier costs nothing. Built by counting sort: two passes over the points, no allocation once
//! warm, the same order every time.

mod balls;
mod kd_tree;
#[cfg(any(feature = "groom", feature = "render"))]
mod order;
mod soup;

#[doc(hidden)]
pub use balls::{BallGrid, FoundBalls};
pub use kd_tree::KdTree;
pub(crate) use kd_tree::split_at_median;
#[cfg(any(feature = "groom", feature = "render"))]
pub(crate) use order::compact_groups;
pub(crate) use soup::TriangleSoup;

use core::ops::Range;
use glam::{IVec3, Vec3};

const FAR: Vec3 = Vec3::splat(1e9);

/// The fewest buckets. With few buckets, queries in empty space would collide with items.
const MIN_BUCKETS: usize = 8192;

/// The maximum number of cells in a row of [`UniformGrid::rows_in_box`].
pub(crate) const WIDEST: usize = 8;

/// Points sorted by cell: equations 4 and 5 of \[W\].
#[derive(Clone, Debug, Default)]
pub struct UniformGrid {
    inverse_cell: f32,
    /// Where each bucket's entries begin; one more than buckets, a power of two of them.
    starts: Vec<u32>,
    entries: Vec<Entry>,
    unsorted: Vec<Entry>,
}

#[derive(Clone, Copy, Debug, Default)]
struct Entry {
    cell: IVec3,
    item: u32,
}

impl UniformGrid {
    /// Equation 4 as meant: the cell that `point` lies in.
    #[inline]
    pub fn cell_of(&self, point: Vec3) -> IVec3 {
        // Beyond a billion cells all points share the outermost one; distance tests sort them out.
        let scaled = (point * self.inverse_cell).clamp(-FAR, FAR);
        // The floor, without a call per number where the target has no instruction for it.
        let toward_zero = scaled.as_ivec3();
        toward_zero
            + IVec3::select(toward_zero.as_vec3().cmpgt(scaled), IVec3::NEG_ONE, IVec3::ZERO)
    }

    /// Sorts `items`, each a point and an index of the caller's, into cells of size `cell` (> 0), in each
    /// cell in their given order. Non-finite points are left out.
    pub fn build(&mut self, cell: f32, items: impl Iterator<Item = (Vec3, u32)>) {
        self.inverse_cell = 1.0 / cell.max(1e-9);
        self.unsorted.clear();
        for (point, item) in items {
            if point.is_finite() {
                self.unsorted.push(Entry { cell: self.cell_of(point), item });
            }
        }
        self.sort();
    }

    fn sort(&mut self) {
        let buckets = self.unsorted.len().next_power_of_two().max(MIN_BUCKETS);
        self.starts.clear();
        self.starts.resize(buckets + 1, 0);
        let mask = buckets - 1;
        for e in &self.unsorted {
            self.starts[bucket(e.cell, mask) + 1] += 1;
        }
        for b in 0..buckets {
            self.starts[b + 1] += self.starts[b];
        }
        self.entries.clear();
        self.entries.resize(self.unsorted.len(), Entry::default());
        // Filling from the back turns each bucket's end into its start and keeps the items' order.
        for e in self.unsorted.iter().rev() {
            let end = &mut self.starts[bucket(e.cell, mask) + 1];
            *end -= 1;
            self.entries[*end as usize] = *e;
        }
        self.starts.rotate_left(1);
        self.starts[buckets] = self.entries.len() as u32;
    }

    #[inline]
    fn for_each_in(&self, cell: IVec3, mask: usize, found: &mut impl FnMut(u32)) {
        let b = bucket(cell, mask);
        for e in &self.entries[self.starts[b] as usize..self.starts[b + 1] as usize] {
            // Different cells may share a bucket.
            if e.cell == cell {
                found(e.item);
            }
        }
    }

    /// Calls `near` with every item in the 27 cells around `point`: all that lie within one cell
    /// size of it, and some that do not.
    #[inline]
    pub fn for_each_near(&self, point: Vec3, mut near: impl FnMut(u32)) {
        if self.entries.is_empty() || !point.is_finite() {
            return;
        }
        let center = self.cell_of(point);
        let mask = self.starts.len() - 2;
        for z in -1..=1 {
            for y in -1..=1 {
                for x in -1..=1 {
                    let cell = center + IVec3::new(x, y, z);
                    self.for_each_in(cell, mask, &mut near);
                }
            }
        }
    }

    /// The items in the grid's own order, in which neighbouring cells are contiguous: callers keep their
    /// data in this order to read it sequentially. The first few are repeated at the end, so that no row
    /// of up to [`WIDEST`] cells is split.
    pub(crate) fn order(&self) -> impl Iterator<Item = u32> {
        let first = self.starts.get(WIDEST).map_or(0, |end| *end as usize);
        self.entries.iter().chain(&self.entries[..first]).map(|e| e.item)
    }

    /// The ranges in [`order`](Self::order) of all cells that a box from `low` to `high` overlaps, row by
    /// row. A run may hold items of other rows too: filtered by [`Run::row`] each item occurs once.
    pub(crate) fn runs_in_box(&self, low: Vec3, high: Vec3, runs: &mut Vec<Run>) {
        runs.clear();
        if self.entries.is_empty() || !(low.is_finite() && high.is_finite()) {
            return;
        }
        let (low, high) = (self.cell_of(low), self.cell_of(high));
        let buckets = self.starts.len() - 1;
        let [width, deep, tall] = (high.as_i64vec3() - low.as_i64vec3() + 1).to_array();
        // More rows than items: testing all items is cheaper.
        if width >= buckets as i64 || deep * tall > self.entries.len() as i64 {
            runs.push(Run { row: None, places: [0, self.entries.len() as u32] });
            return;
        }
        for z in low.z..=high.z {
            for y in low.y..=high.y {
                let first = bucket(IVec3::new(low.x, y, z), buckets - 1);
                let end = first + width as usize;
                // Behind the last bucket comes the first one.
                for (first, end) in [(first, end.min(buckets)), (0, end.saturating_sub(buckets))] {
                    let places = [self.starts[first], self.starts[end]];
                    if places[0] < places[1] {
                        runs.push(Run { row: Some([y, z]), places });
                    }
                }
            }
        }
    }

    /// The ranges in [`order`](Self::order) of all cells that a box from `low` to `high` overlaps, one
    /// row of cells along x each, for boxes no larger than a cell along y and z: at most four rows of at
    /// most [`WIDEST`] cells. Hash collisions may add items of other cells, and items twice.
    #[inline]
    pub(crate) fn rows_in_box(&self, low: Vec3, high: Vec3) -> [Range<usize>; 4] {
        if self.entries.is_empty() || !(low.is_finite() && high.is_finite()) {
            return [const { 0..0 }; 4];
        }
        let (low, high) = (self.cell_of(low), self.cell_of(high));
        let buckets = self.starts.len() - 1;
        let width = (high.x.abs_diff(low.x) as usize + 1).min(WIDEST);
        core::array::from_fn(|k| {
            let row = IVec3::new(low.x, low.y + (k as i32 & 1), low.z + (k as i32 >> 1));
            if row.y > high.y || row.z > high.z {
                return 0..0;
            }
            let row = bucket(row, buckets - 1);
            let end = row + width;
            let end = match end.checked_sub(buckets) {
                None | Some(0) => self.starts[end],
                // Behind the last bucket the first ones come again.
                Some(again) => self.starts[buckets] + self.starts[again],
            };
            self.starts[row] as usize..end as usize
        })
    }
}

/// A contiguous range of items in a grid's order.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Run {
    /// The row of cells that items have to be in; `None` for all.
    pub row: Option<[i32; 2]>,
    /// The first place, and one past the last.
    pub places: [u32; 2],
}

/// The role of equation 5: a table index for a cell. Neighbouring cells along x have neighbouring ones.
#[inline]
fn bucket(cell: IVec3, mask: usize) -> usize {
    let h = (cell.y as u32).wrapping_mul(0x85EB_CA77) ^ (cell.z as u32).wrapping_mul(0xC2B2_AE3D);
    (h ^ (h >> 15)).wrapping_add(cell.x as u32) as usize & mask
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn near(grid: &UniformGrid, points: &[Vec3], p: Vec3, radius: f32) -> Vec<u32> {
        let mut found = Vec::new();
        grid.for_each_near(p, |i| {
            if points[i as usize].distance(p) <= radius {
                found.push(i);
            }
        });
        found.sort_unstable();
        found
    }

    #[test]
    fn cells_are_as_wide_as_asked_for() {
        let mut grid = UniformGrid::default();
        for cell in [0.004_f32, 0.25, 8.0] {
            grid.build(cell, [(Vec3::ZERO, 0)].into_iter());
            for place in [IVec3::ZERO, IVec3::new(3, -5, 17), IVec3::splat(-1)] {
                let low = place.as_vec3();
                for share in [0.01, 0.5, 0.99] {
                    assert_eq!(grid.cell_of((low + share) * cell), place, "{share} of {cell}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn neighbour_sets_equal_brute_force(
            raw in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), 1..200),
            radius in 0.01f32..0.5,
            stretch in 0.1f32..50.0,
        ) {
            let points: Vec<Vec3> =
                raw.iter().map(|&(x, y, z)| Vec3::new(x, y, z) * stretch).collect();
            let mut grid = UniformGrid::default();
            grid.build(radius, points.iter().zip(0..).map(|(p, i)| (*p, i)));
            for &p in &points {
                let brute: Vec<u32> = (0..points.len() as u32)
                    .filter(|&i| points[i as usize].distance(p) <= radius)
                    .collect();
                prop_assert_eq!(&near(&grid, &points, p, radius), &brute);
            }
        }
    }

    proptest! {
        #[test]
        fn rows_hold_all_that_a_box_holds(
            raw in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0), 1..200),
            cell in 0.01f32..0.5,
            (long, wide) in (0.0f32..6.9, 0.0f32..0.99),
        ) {
            let points: Vec<Vec3> = raw.iter().map(|&(x, y, z)| Vec3::new(x, y, z)).collect();
            let mut grid = UniformGrid::default();
            grid.build(cell, points.iter().zip(0..).map(|(p, i)| (*p, i)));
            let order: Vec<u32> = grid.order().collect();
            let half = 0.5 * cell * Vec3::new(long, wide, wide);
            for &p in &points {
                let rows = grid.rows_in_box(p - half, p + half);
                let found: Vec<u32> = rows.into_iter().flat_map(|r| order[r].to_vec()).collect();
                for (q, i) in points.iter().zip(0..) {
                    let inside = (*q - p).abs().cmple(half).all();
                    prop_assert!(!inside || found.contains(&i), "{q} beside {p}");
                }
            }
        }
    }

    #[test]
    fn outliers_and_non_finite_points_do_no_harm() {
        let points = [Vec3::ZERO, Vec3::splat(1e30), Vec3::NAN, Vec3::X * 0.05, Vec3::NEG_X * 1e9];
        let mut grid = UniformGrid::default();
        grid.build(0.1, points.iter().zip(0..).map(|(p, i)| (*p, i)));
        assert_eq!(near(&grid, &points, Vec3::ZERO, 0.1), vec![0, 3]);
        grid.for_each_near(Vec3::NAN, |_| panic!("nothing is near nowhere"));
        grid.build(0.1, core::iter::empty());
        grid.for_each_near(Vec3::ZERO, |_| panic!("an empty grid is empty"));
        assert_eq!(grid.rows_in_box(Vec3::ZERO, Vec3::ZERO), [const { 0..0 }; 4]);
    }
}
