//! Box queries on balls.

use super::{Run, UniformGrid};
use crate::base::lanes::{Real, V3, dispatch, lanes_in, splat3};
use fearless_simd::{Level, Simd, f32x16, prelude::*, u32x16};
use glam::Vec3;

const WIDTH: usize = 16;

const NUMBERS: [u32; WIDTH] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Balls of different sizes in a [`UniformGrid`]. A box query finds those that overlap it, sixteen at a
/// time: cells of a row are contiguous, so there are few rows to look up and many balls in each.
#[derive(Clone, Debug, Default)]
pub struct BallGrid {
    grid: UniformGrid,
    /// In the order given, each a centre and a radius.
    balls: Vec<(Vec3, f32)>,
    widest: f32,
    /// In the grid's order, padded with balls at NaN.
    center: [Vec<f32>; 3],
    squared_radius: Vec<f32>,
    row: [Vec<u32>; 2],
    ball: Vec<u32>,
}

/// Result and scratch space of a search.
#[derive(Clone, Debug, Default)]
pub struct FoundBalls {
    /// The numbers of the balls, in the grid's order.
    pub balls: Vec<u32>,
    runs: Vec<Run>,
}

impl BallGrid {
    /// Sorts balls, each a centre and a radius; the n-th is number n from here on. Those whose centre
    /// is not finite are not found.
    pub fn build(&mut self, balls: impl Iterator<Item = (Vec3, f32)>) {
        let Self { grid, balls: unsorted, widest, center, squared_radius, row, ball } = self;
        unsorted.clear();
        unsorted.extend(balls);
        *widest = unsorted.iter().map(|(_, radius)| *radius).fold(0.0, f32::max);
        // Smaller cells mean more lookups, larger ones more balls to test.
        let numbered = unsorted.iter().zip(0..).map(|((center, _), k)| (*center, k));
        grid.build(2.0 * widest.max(1e-4), numbered);
        let sorted = || grid.entries.iter().map(|e| unsorted[e.item as usize]);
        let nowhere = core::iter::repeat_n(f32::NAN, WIDTH);
        for (axis, column) in center.iter_mut().enumerate() {
            column.clear();
            column.extend(sorted().map(|(center, _)| center[axis]).chain(nowhere.clone()));
        }
        squared_radius.clear();
        squared_radius.extend(sorted().map(|(_, radius)| radius * radius).chain(nowhere));
        for (axis, column) in row.iter_mut().enumerate() {
            column.clear();
            column.extend(grid.entries.iter().map(|e| [e.cell.y, e.cell.z][axis] as u32));
            column.resize(grid.entries.len() + WIDTH, 0);
        }
        ball.clear();
        ball.extend(grid.entries.iter().map(|e| e.item));
    }

    /// Finds the balls that overlap the box from `low` to `high`, each once; none for a box that is not
    /// finite.
    pub fn reaching(&self, level: Level, low: Vec3, high: Vec3, found: &mut FoundBalls) {
        found.balls.clear();
        let FoundBalls { balls, runs } = found;
        self.grid.runs_in_box(low - self.widest, high + self.widest, runs);
        if !runs.is_empty() {
            dispatch!(level, simd => self.sift(simd, low, high, runs, balls));
        }
    }

    #[inline(always)]
    fn sift<S: Simd>(&self, simd: S, low: Vec3, high: Vec3, runs: &[Run], found: &mut Vec<u32>) {
        let (low, high) = (splat3(simd, low), splat3(simd, high));
        for run in runs {
            let [start, end] = run.places.map(|place| place as usize);
            for first in (start..end).step_by(WIDTH) {
                let c = V3::new(
                    f32x16::from_slice(simd, &self.center[0][first..first + WIDTH]),
                    f32x16::from_slice(simd, &self.center[1][first..first + WIDTH]),
                    f32x16::from_slice(simd, &self.center[2][first..first + WIDTH]),
                );
                let off = c - V3::new(
                    Real::min(Real::max(c.x, low.x), high.x),
                    Real::min(Real::max(c.y, low.y), high.y),
                    Real::min(Real::max(c.z, low.z), high.z),
                );
                let squared = f32x16::from_slice(simd, &self.squared_radius[first..first + WIDTH]);
                let numbers = u32x16::load_array_ref(simd, &NUMBERS);
                let mut near = off.dot(off).simd_lt(squared)
                    & numbers.simd_lt(u32x16::splat(simd, (end - first).min(WIDTH) as u32));
                if let Some([y, z]) = run.row {
                    let rows_y = u32x16::from_slice(simd, &self.row[0][first..first + WIDTH]);
                    let rows_z = u32x16::from_slice(simd, &self.row[1][first..first + WIDTH]);
                    near = near
                        & rows_y.simd_eq(u32x16::splat(simd, y as u32))
                        & rows_z.simd_eq(u32x16::splat(simd, z as u32));
                }
                let lanes = lanes_in(near.to_bitmask());
                found.extend(lanes.map(|lane| self.ball[first + lane]));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn a_box_finds_what_brute_force_finds(
            raw in proptest::collection::vec((-1.0f32..1.0, -1.0f32..1.0, -1.0f32..1.0, 0.0f32..1.0), 1..300),
            radius in 0.01f32..0.5,
            stretch in 0.1f32..50.0,
            size in (0.0f32..3.0, 0.0f32..60.0, 0.0f32..0.1),
        ) {
            let balls: Vec<(Vec3, f32)> =
                raw.iter().map(|&(x, y, z, r)| (Vec3::new(x, y, z) * stretch, r * radius)).collect();
            let mut grid = BallGrid::default();
            grid.build(balls.iter().copied());
            let mut found = FoundBalls::default();
            for &(low, _) in &balls {
                let high = low + Vec3::from(size);
                let brute: Vec<u32> = (0..)
                    .zip(&balls)
                    .filter(|(_, (c, r))| c.clamp(low, high).distance_squared(*c) < r * r)
                    .map(|(k, _)| k)
                    .collect();
                for level in [Level::new(), Level::baseline()] {
                    grid.reaching(level, low, high, &mut found);
                    found.balls.sort_unstable();
                    prop_assert_eq!(&found.balls, &brute);
                }
            }
        }
    }

    #[test]
    fn non_finite_balls_and_boxes_find_nothing() {
        let mut grid = BallGrid::default();
        let mut found = FoundBalls::default();
        grid.build([(Vec3::NAN, 1.0), (Vec3::splat(1e30), 1.0), (Vec3::ZERO, 1.0)].into_iter());
        let mut balls = |low, high| {
            grid.reaching(Level::new(), low, high, &mut found);
            found.balls.clone()
        };
        assert_eq!(balls(Vec3::ZERO, Vec3::ONE), [2]);
        assert!(balls(Vec3::NAN, Vec3::ONE).is_empty());
        assert!(balls(Vec3::NEG_INFINITY, Vec3::INFINITY).is_empty());
        assert_eq!(balls(Vec3::splat(-1e9), Vec3::splat(1e9)), [2]);
        grid.build(core::iter::empty());
        grid.reaching(Level::new(), Vec3::ZERO, Vec3::ONE, &mut found);
        assert!(found.balls.is_empty());
    }
}
