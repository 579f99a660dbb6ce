//! Density of the drawn strands of a groom, which determines how far light penetrates.

use super::{
    curve::{Guide, strand_point},
    drawn_strand::DrawnStrand,
    followers::HairFollowers,
};
use bevy::{platform::collections::HashMap, prelude::*};

/// Density of strands, independent of their width.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Thickness {
    /// Length of strands per volume around a strand (m/m³), by the share of its length from the root: the
    /// mean over equal pieces. Strands that fan out are far apart at their tips.
    pub(super) densities: [f32; PIECES],
    /// Strands that a line through the hair crosses, per metre of their width.
    pub(super) layers: f32,
}

/// Pieces of the length with a density of their own; four in a vector of the shader's.
pub(super) const PIECES: usize = 8;
/// Largest number of sample points, approximately.
const POINTS: usize = 65_536;
/// Minimum distance of sample points along a strand (m): about the penetration depth of light.
const STEP: f32 = 3e-3;
/// Side of the cells for counting the hair's surface (m): large enough to hold several strands.
const BLOCK: f32 = 12e-3;
/// Mean number of points in a point's cell from which on their count estimates a density.
const ENOUGH: f64 = 8.0;
/// Mean ratio of the area of axis-aligned cell faces to the surface that they approximate.
const STAIRS: f32 = 1.5;

impl Thickness {
    /// Of `drawn` strands; `guide` gives each guide as it is at present.
    pub(super) fn of<'a>(
        drawn: &[DrawnStrand],
        guide: impl Fn(u32) -> Guide<'a> + Copy,
        followers: &HairFollowers,
    ) -> Self {
        let length = |strand: &DrawnStrand| {
            let near = guide(strand.guides[0]);
            let left: f32 = near.nodes.windows(2).map(|pair| pair[0].distance(pair[1])).sum();
            let length = left / near.share() * strand.cut * (strand.length - strand.phase).max(0.0);
            if length.is_finite() { length } else { 0.0 }
        };
        let total: f32 = drawn.iter().map(length).sum();
        // Evenly over strands and along them.
        let every = (total / (STEP * POINTS as f32)).ceil().max(1.0) as usize;
        let mut points = Vec::new();
        for (i, strand) in (0u32..).zip(drawn.iter().step_by(every)) {
            let pieces = (length(strand) / STEP).round().clamp(1.0, 256.0) as u32;
            // A random offset by strand avoids patterns.
            let offset = (strand.seed >> 8) as f32 / (1 << 24) as f32;
            let places = (0..pieces).map(|i| (i as f32 + offset) / pieces as f32).map(|t| {
                let place = match strand.is_guide {
                    true => guide(strand.guides[0]).point(t * strand.cut).position,
                    false => strand_point(strand, guide, t, followers, &[]).position,
                };
                Point { place, share: t, strand: i }
            });
            points.extend(
                places.filter(|p| p.place.is_finite() && p.place.abs().max_element() < 1e3),
            );
        }
        if points.is_empty() {
            return Self::default();
        }
        let (blocks, _) = count(&points, BLOCK);
        let faces = blocks.keys().flat_map(|cell| {
            [IVec3::X, IVec3::Y, IVec3::Z].into_iter().flat_map(|d| [*cell + d, *cell - d])
        });
        let faces = faces.filter(|beside| !blocks.contains_key(beside)).count();
        let surface = faces as f32 * BLOCK * BLOCK / STAIRS;
        // The finest cells with enough points resolve locks and layers.
        let mut cell = BLOCK;
        while cell > STEP && count(&points, 0.5 * cell).1 >= ENOUGH {
            cell *= 0.5;
        }
        let each = total / points.len() as f32 / (cell * cell * cell);
        Self {
            densities: neighbours(&points, cell).map(|near| near * each),
            layers: 2.0 * total / surface.max(BLOCK * BLOCK),
        }
    }
}

/// A point on a strand, and its share of the length from the root.
struct Point {
    place: Vec3,
    share: f32,
    strand: u32,
}

fn cell_of(place: Vec3, cell: f32) -> IVec3 {
    (place / cell).floor().as_ivec3()
}

/// Points per cell, and their mean over points.
fn count(points: &[Point], cell: f32) -> (HashMap<IVec3, u32>, f64) {
    let mut cells = HashMap::<IVec3, u32>::new();
    for point in points {
        *cells.entry(cell_of(point.place, cell)).or_default() += 1;
    }
    let squares: f64 = cells.values().map(|n| f64::from(*n).powi(2)).sum();
    (cells, squares / points.len() as f64)
}

/// The mean number of points of other strands in the cell of a point, by pieces of the length; of all where a
/// piece has no points. One strand of a sample stands for many, but not for more around itself.
fn neighbours(points: &[Point], cell: f32) -> [f32; PIECES] {
    let (cells, _) = count(points, cell);
    let place_of = |point: &Point| (point.strand, cell_of(point.place, cell));
    let mut sums = [(0.0f64, 0.0f64); PIECES];
    for own in points.chunk_by(|a, b| place_of(a) == place_of(b)) {
        let all = cells.get(&cell_of(own[0].place, cell)).copied().unwrap_or(0);
        let others = f64::from(all.saturating_sub(own.len() as u32));
        for point in own {
            let piece = (point.share * PIECES as f32).clamp(0.0, PIECES as f32 - 1.0) as usize;
            sums[piece].0 += others;
            sums[piece].1 += 1.0;
        }
    }
    let (sum, number) = sums.iter().fold((0.0, 0.0), |all, (sum, n)| (all.0 + sum, all.1 + n));
    let mean = if number > 0.0 { sum / number } else { 0.0 };
    sums.map(|(sum, number)| if number > 0.0 { sum / number } else { mean } as f32)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Hair of `count` straight strands, 0.2 m long, spread at random over a square of `side`.
    fn of(count: u32, side: f32) -> Thickness {
        let root = |i: u32| {
            let share = |k: f32| (i as f32 * k).fract();
            Vec3::new(share(0.754_877_7), 0.0, share(0.569_840_3)) * side
        };
        let nodes: Vec<[Vec3; 2]> =
            (0..count).map(|i| [root(i), root(i) - Vec3::Y * 0.2]).collect();
        let drawn: Vec<_> = (0..count).map(DrawnStrand::guide).collect();
        Thickness::of(&drawn, |k| Guide::new(&nodes[k as usize]), &HairFollowers::default())
    }

    #[test]
    fn a_block_of_strands_has_its_density_and_its_layers() {
        for (count, side) in [(2000, 0.1), (8000, 0.1), (3000, 0.05)] {
            let thickness = of(count, side);
            let (density, layers) = (count as f32 / (side * side), count as f32 / side);
            println!("{count} strands on {side} m: {thickness:?} for {density} 1/m², {layers} 1/m");
            let mean = thickness.densities.iter().sum::<f32>() / PIECES as f32;
            assert!((mean / density - 1.0).abs() < 0.2);
            // Cells are cut by the block's ends.
            for inner in &thickness.densities[1..PIECES - 1] {
                assert!((inner / density - 1.0).abs() < 0.25, "{inner}");
            }
            // A square post is as thick as half its side twice: its four faces see two pairs.
            assert!((0.35..1.5).contains(&(thickness.layers / layers)));
        }
    }

    #[test]
    fn strands_that_fan_out_are_farther_apart_at_their_tips() {
        let golden = 2.399_963_2;
        let nodes: Vec<[Vec3; 2]> = (0..10_000)
            .map(|i| {
                let y = 1.0 - 2.0 * (i as f32 + 0.5) / 10_000.0;
                let (sin, cos) = (golden * i as f32).sin_cos();
                let flat = (1.0 - y * y).sqrt();
                let out = Vec3::new(flat * cos, y, flat * sin);
                [0.05 * out, 0.15 * out]
            })
            .collect();
        let drawn: Vec<_> = (0..10_000).map(DrawnStrand::guide).collect();
        let thickness =
            Thickness::of(&drawn, |k| Guide::new(&nodes[k as usize]), &HairFollowers::default());
        for (i, density) in thickness.densities.iter().enumerate() {
            let radius = 0.05 + 0.1 * (i as f32 + 0.5) / PIECES as f32;
            let truth = 10_000.0 / (4.0 * core::f32::consts::PI * radius * radius);
            println!("{radius:.3} m from the middle: {density:.0} 1/m² for {truth:.0}");
            assert!((density / truth - 1.0).abs() < 0.4, "{density} for {truth}");
        }
    }

    #[test]
    fn no_hair_and_broken_hair_have_no_thickness() {
        let none = Thickness::of(&[], |_| Guide::default(), &HairFollowers::default());
        assert_eq!(none, Thickness::default());
        let broken = [Vec3::NAN; 4];
        let strand = DrawnStrand::guide(0);
        let thickness =
            Thickness::of(&[strand], |_| Guide::new(&broken), &HairFollowers::default());
        assert!(thickness.densities.iter().all(|d| d.is_finite()) && thickness.layers.is_finite());
    }
}
