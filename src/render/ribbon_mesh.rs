//! Meshes of the corner indices of ribbons, shared by all hair with as many strands.

use bevy::{
    asset::RenderAssetUsages,
    mesh::{Indices, MeshVertexAttribute, PrimitiveTopology, VertexAttributeValues, VertexFormat},
    platform::collections::HashMap,
    prelude::*,
};

/// Corner, ring and strand of a vertex. An attribute rather than the vertex index, which depends on
/// where Bevy allocates the mesh.
pub(super) const CORNER: MeshVertexAttribute =
    MeshVertexAttribute::new("Hair_Corner", 0x6b65_7261_7469_6e01, VertexFormat::Uint32);

/// The order in which strands are drawn, of which any part from the beginning is spread evenly over all:
/// strand `rank · step` modulo their number has this rank.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DrawOrder {
    count: u32,
    step: u32,
}

/// The shader multiplies strand and step in parts of 32 bits.
const MOST: u32 = 1 << 19;

impl DrawOrder {
    /// Of `count` strands.
    pub(super) fn new(count: u32) -> Self {
        if !(3..MOST).contains(&count) {
            return Self { count, step: 1 };
        }
        // Near the golden ratio, which leaves the smallest gaps (Weyl 1916): of the steps there, the one
        // whose continued fraction is the flattest.
        let golden = (f64::from(count) * 0.618_033_988_75) as u32;
        let steps = (golden.max(1)..count).take(CANDIDATES).chain([1]);
        let step = steps.min_by_key(|step| largest_quotient(count, *step)).unwrap_or(1);
        Self { count, step }
    }

    /// By which the shader finds a strand's rank.
    pub(super) fn rank_step(self) -> u32 {
        // Euclid's algorithm for the inverse.
        let (mut a, mut b) = (i64::from(self.count), i64::from(self.step));
        let (mut of_a, mut of_b) = (0i64, 1i64);
        while b > 1 {
            let times = a / b;
            (a, b) = (b, a % b);
            (of_a, of_b) = (of_b, of_a - times * of_b);
        }
        of_b.rem_euclid(i64::from(self.count.max(1))) as u32
    }

    /// By which the shader finds the strand of a rank.
    pub(super) fn step(self) -> u32 {
        self.step
    }

    fn strand(self, rank: u32) -> u32 {
        (u64::from(rank) * u64::from(self.step) % u64::from(self.count.max(1))) as u32
    }
}

/// Steps that are looked at.
const CANDIDATES: usize = 256;

/// The largest quotient of Euclid's algorithm; the largest number if they have a common divisor.
fn largest_quotient(mut a: u32, mut b: u32) -> u32 {
    let mut largest = 0;
    while b > 0 {
        largest = largest.max(a / b);
        (a, b) = (b, a % b);
    }
    if a == 1 { largest } else { u32::MAX }
}

/// A part of a hair's strands that has a mesh: each level has half as many as the one before.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct RibbonLevel {
    strands: u32,
    segments: u32,
    level: u32,
}

/// Where fewer than this share is drawn, a pixel holds several rings.
const FEW_RINGS: [(u32, u32); 2] = [(5, 4), (4, 2)];
const MOST_LEVELS: u32 = 10;
/// Share by which the next level has room, so that a camera that trembles does not change meshes.
const HYSTERESIS: f32 = 0.95;

impl RibbonLevel {
    /// All strands.
    pub(super) fn full(strands: u32, segments: u32) -> Self {
        Self { strands, segments, level: 0 }
    }

    /// The least level that holds `share` of the strands.
    pub(super) fn holding(strands: u32, segments: u32, share: f32, before: u32) -> Self {
        let holds =
            |level: u32, room: f32| share * strands as f32 <= room * (strands >> level) as f32;
        let mut level = before.min(MOST_LEVELS);
        while level < MOST_LEVELS && holds(level + 1, HYSTERESIS) {
            level += 1;
        }
        while level > 0 && !holds(level, 1.0) {
            level -= 1;
        }
        Self { strands, segments, level }
    }

    pub(super) fn level(self) -> u32 {
        self.level
    }

    /// Number of strands, those of the first ranks.
    pub(super) fn ranks(self) -> u32 {
        (self.strands >> self.level).max(1).min(self.strands)
    }

    /// Of how many rings one is drawn; the tip's is the last.
    pub(super) fn every(self) -> u32 {
        let few = FEW_RINGS.into_iter().find(|(level, _)| self.level >= *level);
        few.map_or(1, |(_, every)| every)
    }

    /// Number of rings of a strand.
    pub(super) fn rings(self) -> u32 {
        self.segments.div_ceil(self.every()) + 1
    }

    /// Two corners for each ring of each strand.
    fn mesh(self) -> Mesh {
        let order = DrawOrder::new(self.strands);
        let mut rings: Vec<u32> = (0..self.segments).step_by(self.every() as usize).collect();
        rings.push(self.segments);
        let per_strand = 2 * (self.segments + 1);
        let strands = self.ranks();
        let drawn = 2 * rings.len() as u32;
        let mut corners = Vec::with_capacity((strands * drawn) as usize);
        let mut indices = Vec::with_capacity((strands * 3 * (drawn - 2)) as usize);
        for rank in 0..strands {
            let first = order.strand(rank) * per_strand;
            corners.extend(rings.iter().flat_map(|ring| [first + 2 * ring, first + 2 * ring + 1]));
            for ring in 0..rings.len() as u32 - 1 {
                let a = rank * drawn + 2 * ring;
                indices.extend([a, a + 1, a + 2, a + 2, a + 1, a + 3]);
            }
        }
        Mesh::new(PrimitiveTopology::TriangleList, RenderAssetUsages::default())
            .with_inserted_attribute(CORNER, VertexAttributeValues::Uint32(corners))
            .with_inserted_indices(Indices::U32(indices))
    }
}

/// The meshes that are in use.
#[derive(Resource, Debug, Default)]
pub(super) struct RibbonMeshes(HashMap<RibbonLevel, Handle<Mesh>>);

impl RibbonMeshes {
    /// The mesh of a level; made if no hair has it.
    pub(super) fn get(&mut self, level: RibbonLevel, meshes: &mut Assets<Mesh>) -> Handle<Mesh> {
        if let Some(known) = self.0.get(&level) {
            return known.clone();
        }
        // What only this map holds is not in use any more.
        self.0.retain(|_, mesh| match mesh {
            Handle::Strong(handle) => std::sync::Arc::strong_count(handle) > 1,
            Handle::Uuid(..) => true,
        });
        let made = meshes.add(level.mesh());
        self.0.insert(level, made.clone());
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// As the shader does.
    fn rank(strand: u32, order: DrawOrder) -> u32 {
        let (step, count) = (order.rank_step(), order.count);
        let high = strand * (step >> 8) % count;
        (high * 256 + strand * (step & 255)) % count
    }

    #[test]
    fn every_strand_has_a_rank_and_any_part_is_spread_evenly() {
        for count in [1, 2, 3, 7, 100, 1024, 41_237, 100_600, MOST - 1] {
            let order = DrawOrder::new(count);
            let mut seen = vec![false; count as usize];
            for i in 0..count {
                assert_eq!(rank(order.strand(i), order), i, "{count}");
                seen[order.strand(i) as usize] = true;
            }
            assert!(seen.iter().all(|seen| *seen));
        }
        let order = DrawOrder::new(41_237);
        for part in [300, 1000, 5000, 20_000] {
            let mut strands: Vec<u32> = (0..part).map(|i| order.strand(i)).collect();
            strands.sort_unstable();
            let gap = strands.windows(2).map(|w| w[1] - w[0]).max().unwrap();
            assert!(gap as f32 <= 3.0 * 41_237.0 / part as f32, "{gap} of {part}");
        }
    }

    #[test]
    fn meshes_hold_what_is_drawn_and_are_shared() {
        let mut before = 0;
        for i in 0..200 {
            let share = 0.97f32.powi(i).max(0.02);
            let level = RibbonLevel::holding(40_000, 16, share, before);
            before = level.level;
            assert!((40_000 >> level.level) as f32 >= share * 40_000.0, "{share} {level:?}");
            assert!((40_000 >> level.level) as f32 <= 2.2 * share * 40_000.0, "{share} {level:?}");
            let again = RibbonLevel::holding(40_000, 16, share * 1.001, before);
            assert_eq!(RibbonLevel::holding(40_000, 16, share, again.level), level);
        }
        let mut meshes = Assets::<Mesh>::default();
        let mut known = RibbonMeshes::default();
        let all = RibbonLevel::full(100, 8);
        let first = known.get(all, &mut meshes);
        assert_eq!(known.get(all, &mut meshes), first);
        let indices = meshes.get(&first).unwrap().indices().unwrap().len();
        assert_eq!(indices, 100 * 8 * 6);
        let few = RibbonLevel::holding(4096, 16, 0.02, 0);
        let few = known.get(few, &mut meshes);
        let indices = meshes.get(&few).unwrap().indices().unwrap().len();
        assert_eq!(indices, 128 * 4 * 6);
        drop(few);
        let none = RibbonLevel::full(0, 1).mesh();
        assert_eq!(none.indices().unwrap().len(), 0);
        drop(first);
        assert_eq!(known.0.len(), 2);
        known.get(RibbonLevel::full(7, 1), &mut meshes);
        assert_eq!(known.0.len(), 1, "a mesh that is not drawn is dropped");
    }
}
