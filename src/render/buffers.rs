//! The GPU buffers of a hair: nodes in every frame, guides and drawn strands once.

use super::drawn_strand::DrawnStrand;
use crate::{
    base::parallel::prefetch,
    hair::{
        strand::{Strand, StrandHistory},
        worn::ActsOn,
    },
    keratin::bond::Bonds,
};
use bevy::{prelude::*, render::storage::ShaderBuffer};
use half::{f16, slice::HalfFloatSliceExt};

/// The buffers of a drawn [`Hair`](crate::Hair), on the same entity. Bind them in a material of your
/// own to draw the hair another way; `#import bevy_keratin::strands` has the structures and the curve,
/// `bevy_keratin::rings` that of rings.
///
/// All numbers are little-endian `f32` or `u32`, all positions are in the hair's frame (m).
///
/// | buffer | stride | holds |
/// |---|---|---|
/// | `nodes` | 32 | position (3 × f32), bond rates (hydrogen, ionic, disulfide, peptide as unorm8 from the lowest byte), strain and moisture (2 × f16), length from the root at rest (m), motion since the frame before (3 × f16, in m/1024), 1 if the guide is valid (f16) |
/// | `guides` | 16 | first node and number of nodes of each guide (u32), how many edges it had before it was cut and where in these it ends (f32) |
/// | `strands` | 128 | [`DrawnStrand`]: the guides first, then the followers |
/// | `frame` | 12,848 | share of the strands that is drawn, share over which they fade, how many times wider they are (3 × f32), number of solids (u32), lowest corner of the grid in which fibres are counted and cells along its side (3 × f32, u32), size of a cell (3 × f32) and a free word, the four brightest lights (place and 1, or direction to it and 0, 4 × f32) in the world's frame and again in the hair's, 24 bounding balls of eight solids each (middle and radius, 4 × f32), then up to 192 solids of 64 bytes that strands are pushed out of |
/// | `rings` | 32 | of each strand that is drawn at the present distance, by its rank and root to tip, the places between its straight segments: position (3 × f32), tangent (octahedral, 2 × snorm16), what it is from the middle of a lock that water draws together (3 × f16, m), moisture (f16), bond rates (4 × unorm8), strain and 1 if it is drawn (2 × f16) |
///
/// `nodes` and `frame` are written once a frame into the same GPU buffers. When the groom changes the
/// handles change too.
#[derive(Component, Reflect, Clone, Debug)]
#[component(clone_behavior = Ignore)]
#[reflect(Clone)]
pub struct HairBuffers {
    /// The nodes of all guides, one guide after the other.
    pub nodes: Handle<ShaderBuffer>,
    /// Which nodes belong to which guide.
    pub guides: Handle<ShaderBuffer>,
    /// Which strands are drawn.
    pub strands: Handle<ShaderBuffer>,
    /// How many of them are drawn in this frame, and what they are pushed out of.
    pub frame: Handle<ShaderBuffer>,
    /// Computed from these on the GPU in each frame in which [`drawn`](Self::drawn) is seen; `None` where the device
    /// cannot, and each vertex computes its own.
    pub rings: Option<Handle<ShaderBuffer>>,
    /// How many guides there are.
    pub guide_count: u32,
    /// How many strands are drawn, guides included.
    pub strand_count: u32,
    /// The child that carries mesh and material. `RenderLayers`, `NoFrustumCulling`, `NotShadowCaster` and
    /// `NotShadowReceiver` of the hair or its wearer are copied to it; put others on it.
    pub drawn: Entity,
}

impl ActsOn for HairBuffers {
    fn others(&self) -> &[Entity] {
        core::slice::from_ref(&self.drawn)
    }
}

/// A node as the shader reads it: 32 bytes.
pub(super) type PackedNode = [u32; 8];

/// Nodes farther from the hair's origin than this (m) count as invalid, like NaN.
pub(crate) const FAR: f32 = 1e6;

#[inline(always)]
fn usable(p: Vec3) -> bool {
    p.is_finite() && p.abs().max_element() < FAR
}

/// What the packed nodes of a guide are made from.
pub(super) struct DrawnNodes<'a> {
    pub(super) strand: &'a Strand,
    pub(super) history: &'a StrandHistory,
    pub(super) bonds: &'a Bonds,
    /// How wet each node looks; dry where absent.
    pub(super) wet: &'a [f32],
}

impl DrawnNodes<'_> {
    /// Prefetches the lists.
    #[inline(always)]
    pub(super) fn prefetch(&self) {
        prefetch(self.strand.positions());
        prefetch(self.strand.rest_lengths());
        prefetch(&self.history.positions);
        prefetch(&self.bonds.joints);
        prefetch(self.wet);
    }

    /// Packs the nodes into `out`, one each; `known` if `out` holds those of the previous frame. Invalid
    /// nodes take the position of the node before them; a guide without valid nodes is not drawn. Returns
    /// the box around the packed nodes.
    #[inline(always)]
    pub(super) fn pack(
        &self,
        out: &mut [PackedNode],
        known: bool,
        overstep: f32,
    ) -> Option<(Vec3, Vec3)> {
        let Self { strand, history, bonds, wet } = self;
        let place = |i| history.drawn(strand, i, overstep);
        let first = (0..strand.nodes()).map(place).find(|p| usable(*p));
        let shown = f32::from(u8::from(first.is_some()));
        let mut last = first.unwrap_or_default();
        let (mut low, mut high) = (last, last);
        let mut rest = 0.0_f32;
        let mut strain_below = None;
        let count = out.len().min(strand.nodes());
        for (block, nodes) in out[..count].chunks_mut(HALVES).enumerate() {
            let mut numbers = [[0.0; 6]; HALVES];
            for (k, (node, numbers)) in nodes.iter_mut().zip(&mut numbers).enumerate() {
                let i = HALVES * block + k;
                let p = place(i);
                if usable(p) {
                    last = p;
                }
                (low, high) = (low.min(last), high.max(last));
                // User code may have shortened a list of the strand since the last tick.
                let ends = strand.positions().get(i).zip(strand.positions().get(i + 1));
                let length = strand.rest_lengths().get(i).copied();
                let strain_above =
                    length.zip(ends).map(|(length, (a, b))| (a.distance(*b) / length - 1.0).abs());
                let strain = match (strain_below, strain_above) {
                    (Some(a), Some(b)) => 0.5 * (a + b),
                    (a, b) => a.or(b).unwrap_or(0.0),
                };
                strain_below = strain_above;
                // The tip has no joint: it shows the last one's. Before the first tick all bonds are closed.
                let joint = bonds.joints.get(i).or(bonds.joints.last());
                let rates = joint.map_or([1.0; 4], |j| j.rates);
                let moisture = wet.get(i).copied().unwrap_or(0.0).clamp(0.0, 1.0);
                let motion = match known && first.is_some() {
                    true => (last - packed_place(node)) * MOTION_UNITS,
                    false => Vec3::ZERO,
                };
                let from_root = if rest.is_finite() { rest.to_bits() } else { 0 };
                let [x, y, z] = [last.x.to_bits(), last.y.to_bits(), last.z.to_bits()];
                *node = [x, y, z, unorm8(rates), 0, from_root, 0, 0];
                *numbers = [strain, moisture, motion.x, motion.y, motion.z, shown];
                rest += length.unwrap_or(0.0);
            }
            for (node, halves) in nodes.iter_mut().zip(&halves(&numbers)) {
                [node[4], node[6], node[7]] = *halves;
            }
        }
        first.map(|_| (low, high))
    }
}

/// Units per m of packed motion, so that the motion of a frame is well within the range of f16.
pub(crate) const MOTION_UNITS: f32 = 1024.0;

/// The position of a packed node.
#[inline(always)]
pub(super) fn packed_place(node: &PackedNode) -> Vec3 {
    Vec3::new(f32::from_bits(node[0]), f32::from_bits(node[1]), f32::from_bits(node[2]))
}

/// How many nodes' numbers become f16s in one call, which costs as much as some of them.
const HALVES: usize = 8;

/// The nearest f16s, two in a word. NaN becomes 0; too large values become the largest.
#[inline(always)]
fn halves(numbers: &[[f32; 6]; HALVES]) -> [[u32; 3]; HALVES] {
    let most = f16::MAX.to_f32_const();
    let (mut all, mut halves) = ([[0.0; 6]; HALVES], [[f16::ZERO; 6]; HALVES]);
    // Closures passed to `map` are not always inlined.
    for (to, x) in all.as_flattened_mut().iter_mut().zip(numbers.as_flattened()) {
        *to = if x.is_nan() { 0.0 } else { x.clamp(-most, most) };
    }
    halves.as_flattened_mut().convert_from_f32_slice(all.as_flattened());
    let mut words = [[0; 3]; HALVES];
    for (word, [low, high]) in
        words.as_flattened_mut().iter_mut().zip(halves.as_flattened().as_chunks().0)
    {
        *word = u32::from(low.to_bits()) | u32::from(high.to_bits()) << 16;
    }
    words
}

#[inline(always)]
fn unorm8(rates: [f32; 4]) -> u32 {
    // `as` saturates and takes NaN as 0.
    let byte = |rate: f32| u32::from((rate * 255.0 + 0.5) as u8);
    byte(rates[0]) | byte(rates[1]) << 8 | byte(rates[2]) << 16 | byte(rates[3]) << 24
}

/// The static buffers' contents.
pub(super) fn pack_strands(drawn: &[DrawnStrand]) -> Vec<u8> {
    let words: Vec<[u32; 32]> = drawn.iter().map(DrawnStrand::packed).collect();
    bytemuck::cast_slice(&words).to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn packed(strand: &Strand, history: &[Vec3], overstep: f32) -> Vec<PackedNode> {
        let mut out = vec![[0; 8]; strand.nodes()];
        let history = StrandHistory { positions: history.to_vec(), ..default() };
        let bonds = Bonds::default();
        DrawnNodes { strand, history: &history, bonds: &bonds, wet: &[] }
            .pack(&mut out, false, overstep);
        out
    }

    #[test]
    fn nodes_are_drawn_between_the_last_two_ticks() {
        let strand = Strand::from_polyline(&[Vec3::ZERO, Vec3::X, Vec3::X * 2.0]).unwrap();
        let before = [Vec3::ZERO, Vec3::Y, Vec3::Y * 2.0];
        let nodes = packed(&strand, &before, 0.25);
        assert_eq!(packed_place(&nodes[1]), Vec3::new(0.25, 0.75, 0.0));
        assert_eq!(packed_place(&packed(&strand, &[], 0.25)[2]), Vec3::X * 2.0);
        assert_eq!(packed_place(&packed(&strand, &before[..2], 0.25)[2]), Vec3::X * 2.0);
    }

    #[test]
    fn broken_nodes_take_the_place_of_the_one_before() {
        let mut strand = Strand::from_polyline(&[Vec3::ZERO, Vec3::X, Vec3::X * 2.0]).unwrap();
        strand.positions_mut()[1] = Vec3::NAN;
        let nodes = packed(&strand, &[], 1.0);
        assert_eq!(packed_place(&nodes[1]), Vec3::ZERO);
        assert!(nodes.iter().all(|n| n[7] >> 16 == half(1.0)));
        strand.positions_mut().fill(Vec3::INFINITY);
        assert!(packed(&strand, &[], 1.0).iter().all(|n| n[7] == 0));
    }

    #[test]
    fn motion_is_that_since_the_frame_before() {
        let mut strand = Strand::from_polyline(&[Vec3::ZERO, Vec3::X]).unwrap();
        let mut nodes = packed(&strand, &[], 1.0);
        assert_eq!(nodes[1][6], 0, "hair that appears has not moved");
        strand.positions_mut()[1] = Vec3::new(1.5, -0.25, 0.0);
        let (history, bonds) = (StrandHistory::default(), Bonds::default());
        DrawnNodes { strand: &strand, history: &history, bonds: &bonds, wet: &[] }
            .pack(&mut nodes, true, 1.0);
        assert_eq!(nodes[1][6], half(512.0) | half(-256.0) << 16);
        assert_eq!((nodes[0][6], nodes[1][7]), (0, half(1.0) << 16));
    }

    fn half(x: f32) -> u32 {
        u32::from(f16::from_f32(x).to_bits())
    }

    #[test]
    fn halves_are_the_nearest_and_always_finite() {
        let mut numbers = [[0.0; 6]; HALVES];
        numbers[0] = [1.0, -2.0, 65504.0, 1e9, f32::NAN, 0.1];
        numbers[HALVES - 1] = [f32::INFINITY, f32::MIN, 1e-9, 1e-7, 0.0, f32::MAX];
        let halves = halves(&numbers);
        assert_eq!(halves[0], [0xc000_3c00, 0x7bff_7bff, 0x2e66_0000]);
        assert_eq!(halves[1..HALVES - 1], [[0; 3]; HALVES - 2]);
        assert_eq!(halves[HALVES - 1], [0xfbff_7bff, 0x0002_0000, 0x7bff_0000]);
    }

    #[test]
    fn rates_are_bytes() {
        assert_eq!(unorm8([0.0, 1.0, 0.5, f32::NAN]), 0x0080_ff00);
    }

    #[test]
    fn every_node_shows_the_bonds_of_its_own_joint_and_the_tip_those_of_the_last() {
        let points: Vec<Vec3> = (0..4).map(|i| Vec3::X * i as f32).collect();
        let strand = Strand::from_polyline(&points).unwrap();
        let mut bonds = Bonds::of(&strand);
        for (i, joint) in bonds.joints.iter_mut().enumerate() {
            joint.rates = [0.1 * i as f32, 0.5, 0.2 * i as f32, 1.0];
        }
        let mut out = vec![[0; 8]; 4];
        let history = StrandHistory::default();
        DrawnNodes {
            strand: &strand,
            history: &history,
            bonds: &bonds,
            wet: &[0.0, 0.25, 0.5, 1.0],
        }
        .pack(&mut out, false, 1.0);
        for (i, node) in out.iter().enumerate() {
            let joint = i.min(2) as f32;
            assert_eq!(node[3], unorm8([0.1 * joint, 0.5, 0.2 * joint, 1.0]), "node {i}");
            assert_eq!(node[4] >> 16, half([0.0, 0.25, 0.5, 1.0][i]), "node {i}");
            assert_eq!(f32::from_bits(node[5]), i as f32, "length from the root");
        }
    }
}
