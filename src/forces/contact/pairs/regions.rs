//! How much nearer to each other edges may have come since lists were built, region by region.
//!
//! Hair moves fast as a whole, and little against what is beside it. Cells of a coarse grid hold how the edges in them
//! have moved; of two edges that are less than a cell apart both are in one cell or in two that touch, so they have come
//! nearer by no more than motions differ there. Farther ones by no more than motions differ anywhere.

use super::geometry::{Row, place};
use core::ops::Range;
use glam::{Vec3, Vec3A};

/// The most cells along an axis.
const MOST_CELLS: f32 = 14.0;

/// The space that motions take: the least and the greatest along each axis (m).
#[derive(Clone, Copy, Debug)]
pub(super) struct Extent([Vec3A; 2]);

impl Default for Extent {
    fn default() -> Self {
        Self([Vec3A::INFINITY, Vec3A::NEG_INFINITY])
    }
}

impl Extent {
    /// Takes in a motion; one that is NaN or infinite changes nothing.
    pub fn add(&mut self, motion: Vec3) {
        let motion = Vec3A::from(motion);
        if motion.is_finite() {
            self.0 = [self.0[0].min(motion), self.0[1].max(motion)];
        }
    }

    fn union(self, other: Self) -> Self {
        Self([self.0[0].min(other.0[0]), self.0[1].max(other.0[1])])
    }

    /// No two differ by more (m).
    pub fn across(self) -> f32 {
        let [low, high] = self.0;
        if low.cmple(high).all() { low.distance(high) } else { 0.0 }
    }
}

/// A grid over where edges were.
#[derive(Clone, Debug, Default)]
pub(super) struct Regions {
    /// The side of a cell (m).
    size: f32,
    /// How many there are along each axis.
    cells: [usize; 3],
    /// For each node, where the cells that the edge which starts there may touch begin among `touched`.
    starts: Vec<u32>,
    touched: Vec<u32>,
    extents: Vec<[Extent; 2]>,
}

impl Regions {
    /// Cells of this `size` (m) over the strands' nodes, larger ones where they lie far apart.
    pub fn begin(&mut self, places: &[Row], strands: &[Range<u32>], size: f32) {
        let mut all = Extent::default();
        places.iter().for_each(|row| all.add(place(row)));
        let [low, high] = all.0.map(Vec3::from);
        let is_any = low.x <= high.x;
        let (low, wide) = if is_any { (low, high - low) } else { Default::default() };
        self.size = size.max(wide.max_element() / MOST_CELLS).max(1e-6);
        self.cells = (wide / self.size).to_array().map(|n| n as usize + 1);
        let [nx, ny, _] = self.cells;
        let cell = |place: Vec3| {
            let along = ((place - low) / self.size).to_array();
            // NaN is in the first.
            [0, 1, 2].map(|axis| (along[axis] as usize).min(self.cells[axis] - 1))
        };
        let Self { starts, touched, .. } = self;
        starts.clear();
        touched.clear();
        for strand in strands {
            for node in strand.start as usize..strand.end as usize {
                starts.push(touched.len() as u32);
                // The tip starts no edge.
                if node + 1 < strand.end as usize {
                    let [a, b] = [node, node + 1].map(|node| place(&places[node]));
                    let [low, high] = [a.min(b), a.max(b)].map(cell);
                    for k in low[2]..=high[2] {
                        for j in low[1]..=high[1] {
                            let row = (k * ny + j) * nx;
                            touched.extend((low[0]..=high[0]).map(|i| (row + i) as u32));
                        }
                    }
                }
            }
        }
        starts.push(touched.len() as u32);
    }

    /// The side of a cell (m).
    pub fn size(&self) -> f32 {
        self.size
    }

    /// The cells that the edge may touch which starts at this node.
    pub fn of(&self, node: usize) -> &[u32] {
        let own = self.starts.get(node..node + 2).map_or(0..0, |w| w[0] as usize..w[1] as usize);
        self.touched.get(own).unwrap_or_default()
    }

    /// For each cell, by how much motions in it and in those that touch it differ at two times (m), by how nodes have moved
    /// at both.
    pub fn differences(&mut self, moved: impl Fn(usize) -> [Vec3; 2], each: &mut Vec<[f32; 2]>) {
        let Self { cells, starts, touched, extents, .. } = self;
        extents.clear();
        extents.resize(cells.iter().product(), Default::default());
        let mut start = [Vec3::NAN; 2];
        for (node, w) in starts.windows(2).enumerate() {
            let own = &touched[w[0] as usize..w[1] as usize];
            if node == 0 {
                start = moved(node);
            }
            let end = if node + 2 < starts.len() { moved(node + 1) } else { [Vec3::NAN; 2] };
            if !own.is_empty() {
                let mut edge = [Extent::default(); 2];
                for k in 0..2 {
                    edge[k].add(start[k]);
                    edge[k].add(end[k]);
                }
                for cell in own {
                    let extents = &mut extents[*cell as usize];
                    *extents = union(*extents, edge);
                }
            }
            start = end;
        }
        let [nx, ny, _] = *cells;
        for (n, stride) in cells.iter().zip([1, nx, nx * ny]) {
            spread(extents, *n, stride);
        }
        each.clear();
        each.extend(extents.iter().map(|extents| extents.map(Extent::across)));
    }
}

fn union(a: [Extent; 2], b: [Extent; 2]) -> [Extent; 2] {
    [a[0].union(b[0]), a[1].union(b[1])]
}

/// Each cell takes in those beside it along an axis with `n` cells, `stride` apart.
fn spread(extents: &mut [[Extent; 2]], n: usize, stride: usize) {
    for block in extents.chunks_mut(n * stride) {
        for start in 0..stride {
            let mut before = Default::default();
            for k in 0..n {
                let at = start + k * stride;
                let own = block[at];
                let after = if k + 1 < n { block[at + stride] } else { Default::default() };
                block[at] = union(union(before, own), after);
                before = own;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

    /// An edge's nodes, and how they move at two times.
    type Moved = [(Vec3, [Vec3; 2]); 2];

    fn differences(edges: &[Moved], size: f32) -> (Regions, Vec<[f32; 2]>) {
        let nodes = edges.concat();
        let places: Vec<Row> = nodes.iter().map(|(p, _)| p.extend(1.0).to_array()).collect();
        let strands: Vec<_> = (0..edges.len() as u32).map(|k| 2 * k..2 * k + 2).collect();
        let (mut regions, mut each) = (Regions::default(), Vec::new());
        regions.begin(&places, &strands, size);
        regions.differences(|node| nodes[node].1, &mut each);
        (regions, each)
    }

    #[test]
    fn no_two_edges_in_cells_that_touch_differ_by_more() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(8);
        let mut vector =
            |size: f32| Vec3::from_array([(); 3].map(|()| random.random_range(-size..size)));
        let edges: Vec<Moved> = (0..300)
            .map(|_| {
                let (a, ways) = (vector(0.1), [vector(0.01), vector(0.02)]);
                [(a, ways), (a + vector(0.008), ways.map(|way| way + vector(0.002)))]
            })
            .collect();
        let (regions, each) = differences(&edges, 0.03);
        assert_eq!(regions.size(), 0.03);
        let (mut checked, mut reached) = (0, 0.0f32);
        let all = || edges.iter().enumerate();
        for ((k, a), (_, b)) in all().flat_map(|a| all().map(move |b| (a, b))) {
            if a.iter().all(|(p, _)| b.iter().all(|(q, _)| p.distance(*q) > 0.03)) {
                continue;
            }
            checked += 1;
            for time in 0..2 {
                let ways = |e: &Moved| e.map(|(_, ways)| ways[time]);
                let differ = ways(a).into_iter().flat_map(|v| ways(b).map(|w| v.distance(w)));
                let differ = differ.fold(0.0, f32::max);
                let cells = regions.of(2 * k).iter();
                let most = cells.map(|cell| each[*cell as usize][time]).fold(0.0, f32::max);
                assert!(differ <= most * 1.0001, "{differ} m, {most} allowed");
                reached = reached.max(differ / most);
            }
        }
        assert!(checked > 600 && reached > 0.8, "{checked} {reached}");
    }

    #[test]
    fn what_moves_alike_differs_by_nothing_and_what_is_far_does_not_count() {
        let edge = |x: f32, way: Vec3| -> Moved {
            [(Vec3::X * x, [way; 2]), (Vec3::new(x, 0.005, 0.0), [way; 2])]
        };
        let (_, each) =
            differences(&[edge(0.0, Vec3::Y), edge(0.01, Vec3::Y), edge(0.2, Vec3::ZERO)], 0.02);
        assert!(each.iter().all(|differ| *differ == [0.0; 2]), "{each:?}");
        let wrong = [edge(0.0, Vec3::Y), edge(0.005, Vec3::NAN), edge(f32::NAN, Vec3::Y)];
        let (_, each) = differences(&wrong, 0.02);
        assert!(each.iter().all(|differ| *differ == [0.0; 2]), "{each:?}");
        let (_, each) = differences(&[edge(0.0, Vec3::Y), edge(0.01, Vec3::ZERO)], 0.02);
        assert_eq!(each, [[1.0; 2]]);
    }
}
