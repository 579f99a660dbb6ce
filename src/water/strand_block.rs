//! Sixteen strands side by side, for contact with droplets.
//!
//! Neighbouring strands are close together, so a droplet near one node is near its fifteen
//! neighbours: they query the grid once, and every droplet found is tested against all of them.

use super::HairWetting;
use crate::{
    base::lanes::{
        LANES, Lane, V3, dispatch, load3, put_numbers, put_vectors, put3, splat3, take_vectors,
        take3,
    },
    hair::strand::{Hair, StrandRank},
};
use bevy::prelude::*;
use fearless_simd::{Level, Simd, f32x16, prelude::*};

/// A strand among droplets.
pub(super) struct StrandLane<'a> {
    pub strand: Entity,
    pub positions: &'a [Vec3],
    pub velocities: &'a mut [Vec3],
    /// Whether it keeps the velocities that droplets give it.
    pub is_free: bool,
    pub lengths: &'a [f32],
    /// Added mass of each node over its dry mass; empty for none.
    pub load: &'a [f32],
    /// The film that lies on each node (m³); empty for none.
    pub film: &'a [f64],
}

/// The nodes with the same index of all strands.
#[derive(Clone, Copy, Debug)]
pub(super) struct NodeSlice {
    /// Positions (m); NaN where a strand is shorter.
    pub p: [Lane; 3],
    /// Velocities (m/s).
    pub v: [Lane; 3],
    /// Added mass over dry mass.
    pub load: Lane,
    /// Dry mass (kg).
    pub mass: Lane,
    /// Lengths of the edges that follow (m); zero where there are none.
    length: Lane,
    /// The box around them (m).
    pub low: Vec3,
    pub high: Vec3,
}

impl Default for NodeSlice {
    fn default() -> Self {
        let (low, high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let none = [0.0; LANES];
        Self {
            p: [[f32::NAN; LANES]; 3],
            v: [none; 3],
            load: none,
            mass: none,
            length: none,
            low,
            high,
        }
    }
}

impl NodeSlice {
    /// The box around the finite nodes.
    #[inline(always)]
    fn bounds<S: Simd>(&self, simd: S) -> (Vec3, Vec3) {
        let p = load3(simd, &self.p);
        // Non-finite values are left out: zero times them is not zero.
        let zero = f32x16::splat(simd, 0.0);
        let none = p.scale(zero);
        let is_finite = none.dot(none).simd_eq(zero);
        let low = V3::select(is_finite, p, splat3(simd, Vec3::INFINITY));
        let high = V3::select(is_finite, p, splat3(simd, Vec3::NEG_INFINITY));
        (
            Vec3::new(low.x.reduce_min(), low.y.reduce_min(), low.z.reduce_min()),
            Vec3::new(high.x.reduce_max(), high.y.reduce_max(), high.z.reduce_max()),
        )
    }
}

/// Up to sixteen strands in lanes.
#[derive(Clone, Debug, Default)]
pub(super) struct StrandBlock {
    /// Root first, as many as the longest strand has nodes.
    pub rows: Vec<NodeSlice>,
    /// The index of each lane's strand.
    pub strand_index: [u32; LANES],
}

impl StrandBlock {
    /// Loads positions only: most strands are near no droplet.
    pub fn place(&mut self, level: Level, strand_lanes: &[StrandLane<'_>]) {
        self.rows.clear();
        let longest = strand_lanes.iter().map(|m| m.positions.len()).max().unwrap_or(0);
        self.rows.resize(longest, NodeSlice::default());
        self.strand_index = [u32::MAX; LANES];
        for (strand_index, strand_lane) in self.strand_index.iter_mut().zip(strand_lanes) {
            *strand_index = strand_lane.strand.index_u32();
        }
        for (group, four) in strand_lanes.chunks(4).enumerate() {
            if let [a, b, c, d] = four
                && have_nodes(longest, four)
            {
                let four = [a.positions, b.positions, c.positions, d.positions];
                put_vectors(&mut self.rows, group, four, |row| &mut row.p);
                continue;
            }
            for (lane, strand_lane) in (4 * group..).zip(four) {
                for (p, row) in strand_lane.positions.iter().zip(&mut self.rows) {
                    put3(&mut row.p, lane, *p);
                }
            }
        }
        dispatch!(level, simd => {
            for row in &mut self.rows {
                (row.low, row.high) = row.bounds(simd);
            }
        });
    }

    /// The box around all its finite nodes (m).
    pub fn bounds(&self) -> (Vec3, Vec3) {
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        self.rows.iter().fold(none, |(low, high), row| (low.min(row.low), high.max(row.high)))
    }

    /// Loads velocities and masses, before droplets act.
    pub fn weigh(&mut self, strand_lanes: &[StrandLane<'_>], wetting: &HairWetting) {
        for (group, four) in strand_lanes.chunks(4).enumerate() {
            if let [a, b, c, d] = four
                && have_nodes(self.rows.len(), four)
            {
                let velocities = [&*a.velocities, b.velocities, c.velocities, d.velocities];
                put_vectors(&mut self.rows, group, velocities, |row| &mut row.v);
                let lengths = [a.lengths, b.lengths, c.lengths, d.lengths];
                let edges = self.rows.len() - 1;
                put_numbers(&mut self.rows[..edges], group, lengths, |row| &mut row.length);
                continue;
            }
            for (lane, strand_lane) in (4 * group..).zip(four) {
                for (v, row) in strand_lane.velocities.iter().zip(&mut self.rows) {
                    put3(&mut row.v, lane, *v);
                }
                for (length, row) in strand_lane.lengths.iter().zip(&mut self.rows) {
                    row.length[lane] = *length;
                }
            }
        }
        for (lane, strand_lane) in strand_lanes.iter().enumerate() {
            for (load, row) in strand_lane.load.iter().zip(&mut self.rows) {
                row.load[lane] = *load;
            }
        }
        // A node has half the mass of its adjacent edges.
        let half = 0.5 * wetting.dry_mass();
        let mut before = [0.0; LANES];
        for row in &mut self.rows {
            for ((mass, before), length) in row.mass.iter_mut().zip(&mut before).zip(row.length) {
                *mass = half * (*before + length);
                *before = length;
            }
        }
    }

    /// Writes velocities of free strands back.
    pub fn scatter(&self, strand_lanes: &mut [StrandLane<'_>]) {
        for (group, four) in strand_lanes.chunks_mut(4).enumerate() {
            let is_whole = have_nodes(self.rows.len(), four) && four.iter().all(|m| m.is_free);
            if let [a, b, c, d] = &mut *four
                && is_whole
            {
                let four = [&mut *a.velocities, b.velocities, c.velocities, d.velocities];
                take_vectors(&self.rows, group, four, |row| &row.v);
                continue;
            }
            let free = (4 * group..).zip(four).filter(|(_, strand_lane)| strand_lane.is_free);
            for (lane, strand_lane) in free {
                for (v, row) in strand_lane.velocities.iter_mut().zip(&self.rows) {
                    *v = take3(&row.v, lane);
                }
            }
        }
    }
}

/// Whether all strands have this number of nodes.
fn have_nodes(nodes: usize, strand_lanes: &[StrandLane<'_>]) -> bool {
    strand_lanes.iter().all(|strand_lane| strand_lane.positions.len() == nodes)
}

/// The order in which a hair's strands are grouped into blocks: their roots along a Morton curve.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
pub(super) struct StrandBlocks {
    order: Vec<u32>,
}

impl StrandBlocks {
    /// From now on they are sorted again.
    pub fn forget(&mut self) {
        self.order.clear();
    }

    /// The indices of `count` strands with these `roots`, in order. Kept until their number changes or they are
    /// forgotten. Those in one cell are in the order of their ranks.
    pub fn order(
        &mut self,
        count: usize,
        roots: impl Iterator<Item = (Vec3, StrandRank)>,
    ) -> &[u32] {
        if self.order.len() != count {
            let places = roots.zip(0..);
            let mut keys: Vec<(u64, StrandRank, u32)> =
                places.map(|((root, rank), i)| (place_on_curve(root), rank, i)).collect();
            keys.sort_unstable();
            self.order.clear();
            self.order.extend(keys.into_iter().map(|(.., strand)| strand));
        }
        &self.order
    }
}

/// The position of a root along a Morton curve through cells of 2 mm.
fn place_on_curve(root: Vec3) -> u64 {
    let cell =
        (root * 500.0).as_ivec3().clamp(IVec3::splat(-(1 << 20)), IVec3::splat((1 << 20) - 1));
    let [x, y, z] = (cell + (1 << 20)).as_u64vec3().to_array().map(spread);
    x | y << 1 | z << 2
}

/// The lowest 21 bits, with two zero bits after each.
fn spread(x: u64) -> u64 {
    let x = (x | x << 32) & 0x001f_0000_0000_ffff;
    let x = (x | x << 16) & 0x001f_0000_ff00_00ff;
    let x = (x | x << 8) & 0x100f_00f0_0f00_f00f;
    let x = (x | x << 4) & 0x10c3_0c30_c30c_30c3;
    (x | x << 2) & 0x1249_2492_4924_9249
}

pub(super) fn plugin(app: &mut App) {
    app.register_type::<StrandBlocks>().register_required_components::<Hair, StrandBlocks>();
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn neighbouring_strands_are_in_the_same_block() {
        // A square of 32 by 32 roots, 3 mm apart, in an order that jumps about.
        let roots = (0..1024u32).map(|i| i * 389 % 1024);
        let roots = roots.map(|i| Vec3::new((i % 32) as f32, 5.0, (i / 32) as f32) * 0.003);
        let roots: Vec<Vec3> = roots.collect();
        let mut blocks = StrandBlocks::default();
        let ranked = |root: &Vec3| (*root, StrandRank::default());
        let order = blocks.order(1024, roots.iter().map(ranked)).to_vec();
        let mut all = order.clone();
        all.sort_unstable();
        assert!(all.into_iter().eq(0..1024), "each strand once");
        let widths = order.chunks(LANES).map(|strand_block| {
            let places = || strand_block.iter().map(|i| roots[*i as usize]);
            let low = places().reduce(Vec3::min).unwrap_or_default();
            (places().reduce(Vec3::max).unwrap_or_default() - low).max_element()
        });
        let mean = widths.sum::<f32>() / 64.0;
        assert!(mean < 0.02, "sixteen strands fill 12 mm by 12 mm, here {mean} m");
        // Kept, but not for another number of strands.
        assert_eq!(blocks.order(1024, [Vec3::NAN; 1024].iter().map(ranked)), order);
        assert_eq!(blocks.order(3, roots[..3].iter().map(ranked)).len(), 3);
    }

    #[test]
    fn strands_of_any_length_survive_the_round_trip_through_lanes() {
        // All alike; a group with a shorter one among them; a group that is not full.
        for lengths in [vec![6; 16], vec![6, 6, 6, 6, 6, 5, 6, 6, 2, 3, 4, 5, 6, 6], vec![7; 3]] {
            let number = |s: usize, i: usize| (100 * s + 10 * i) as f32;
            let vectors = |s: usize, add: f32| -> Vec<Vec3> {
                let vector = |i| Vec3::new(0.1, 1.0, 2.0) * (number(s, i) + add);
                (0..lengths[s]).map(vector).collect()
            };
            let positions: Vec<_> = (0..lengths.len()).map(|s| vectors(s, 1.0)).collect();
            let edges: Vec<Vec<f32>> = (0..lengths.len())
                .map(|s| (1..lengths[s]).map(|i| number(s, i)).collect())
                .collect();
            let before: Vec<_> = (0..lengths.len()).map(|s| vectors(s, 3.0)).collect();
            let mut velocities = before.clone();
            let mut strand_lanes: Vec<_> = (0..)
                .zip(positions.iter().zip(&edges).zip(&mut velocities))
                .map(|(s, ((positions, lengths), velocities))| {
                    let load: &[f32] = if s == 2 { &[0.5, 0.25] } else { &[] };
                    let strand = Entity::from_raw_u32(s).unwrap();
                    let is_free = s != 9;
                    StrandLane { strand, positions, velocities, is_free, lengths, load, film: &[] }
                })
                .collect();
            let (mut strand_block, wetting) = (StrandBlock::default(), HairWetting::default());
            // What was in it before must not stay.
            strand_block.rows =
                vec![NodeSlice { v: [[7.0; LANES]; 3], load: [7.0; LANES], ..default() }; 9];
            strand_block.place(Level::new(), &strand_lanes);
            strand_block.weigh(&strand_lanes, &wetting);
            for (s, strand_lane) in strand_lanes.iter().enumerate() {
                let masses = super::super::moisture::node_lengths(strand_lane.lengths);
                for (i, length) in masses.enumerate() {
                    let row = &strand_block.rows[i];
                    assert_eq!(take3(&row.p, s), strand_lane.positions[i]);
                    assert_eq!(take3(&row.v, s), strand_lane.velocities[i]);
                    assert_eq!(row.load[s], strand_lane.load.get(i).copied().unwrap_or(0.0));
                    let mass = wetting.dry_mass() * length;
                    assert!((row.mass[s] - mass).abs() <= 1e-6 * mass, "{s} {i}");
                }
                assert!(
                    strand_block.rows[lengths[s]..].iter().all(|row| take3(&row.p, s).is_nan())
                );
            }
            for (i, row) in strand_block.rows.iter().enumerate() {
                let there = || positions.iter().filter_map(|p| p.get(i)).copied();
                assert_eq!(Some(row.low), there().reduce(Vec3::min));
                assert_eq!(Some(row.high), there().reduce(Vec3::max));
            }
            for row in &mut strand_block.rows {
                row.v = row.v.map(|v| v.map(|v| 2.0 * v));
            }
            strand_block.scatter(&mut strand_lanes);
            // One is not free.
            for (s, (velocities, before)) in velocities.iter().zip(&before).enumerate() {
                let times = if s == 9 { 1.0 } else { 2.0 };
                assert!(
                    velocities.iter().eq(&before.iter().map(|v| *v * times).collect::<Vec<_>>())
                );
            }
        }
    }

    #[test]
    fn non_finite_nodes_are_in_no_box() {
        let places = [Vec3::ONE, Vec3::NAN, Vec3::INFINITY, Vec3::new(2.0, f32::NEG_INFINITY, 0.0)];
        let mut velocities = [[Vec3::ZERO]; 4];
        let strand_lanes: Vec<_> = places
            .each_ref()
            .into_iter()
            .zip(&mut velocities)
            .map(|(place, velocities)| StrandLane {
                strand: Entity::PLACEHOLDER,
                positions: core::slice::from_ref(place),
                velocities,
                is_free: true,
                lengths: &[],
                load: &[],
                film: &[],
            })
            .collect();
        let mut strand_block = StrandBlock::default();
        strand_block.place(Level::new(), &strand_lanes);
        assert_eq!((strand_block.rows[0].low, strand_block.rows[0].high), (Vec3::ONE, Vec3::ONE));
    }

    #[test]
    fn non_finite_roots_have_an_order_too() {
        let mut blocks = StrandBlocks::default();
        let roots = [Vec3::NAN, Vec3::INFINITY, Vec3::NEG_INFINITY, Vec3::ZERO];
        let ranked = roots.into_iter().map(|root| (root, StrandRank::default()));
        let mut order = blocks.order(4, ranked).to_vec();
        order.sort_unstable();
        assert_eq!(order, [0, 1, 2, 3]);
    }
}
