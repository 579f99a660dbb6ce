//! A strand as it is drawn.

use crate::hair::strand::CutStrand;
use bevy::prelude::*;
use half::f16;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// The offset from a strand to the centre strand of its lock.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LockOffset {
    /// Between their roots (m), perpendicular to the strand, which keeps its length.
    pub root: Vec3,
    /// Difference of the middle's guide weights, sum 0.
    pub weights: [f32; 3],
}

/// A drawn strand: the guides it follows and how it differs from them. 128 bytes in the buffer, see
/// [`HairBuffers`](super::HairBuffers).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrawnStrand {
    /// Indices of its guides, nearest first; unused ones repeat the first with weight 0.
    pub guides: [u32; 3],
    /// Seed of its random numbers in the shader.
    pub seed: u32,
    /// Shares of the guides, sum 1.
    pub weights: [f32; 3],
    /// Where on the guides it ends, a share of their length. Above 1 it ends at their tips and is
    /// scaled by this factor.
    pub length: f32,
    /// Offset of the root from the weighted roots of the guides (m).
    pub root: Vec3,
    /// Where on the guides its curve begins, a share of their length.
    pub phase: f32,
    /// Displacement of its tip from the lock (m).
    pub stray: Vec3,
    /// Whether it is a guide itself.
    pub is_guide: bool,
    /// Length at rest (m).
    pub size: f32,
    /// Width as a share of the look's.
    pub width: f32,
    /// Where it is cut, a share of its length; 1 is whole.
    pub cut: f32,
    /// To the middles of its locks, large to small.
    pub locks: [LockOffset; 3],
}

impl Default for DrawnStrand {
    fn default() -> Self {
        Self {
            guides: [0; 3],
            seed: 0,
            weights: [0.0; 3],
            length: 0.0,
            root: Vec3::ZERO,
            phase: 0.0,
            stray: Vec3::ZERO,
            is_guide: false,
            size: 0.0,
            width: 1.0,
            cut: 1.0,
            locks: default(),
        }
    }
}

impl DrawnStrand {
    /// Guide `index` itself.
    pub fn guide(index: u32) -> Self {
        Self {
            guides: [index; 3],
            seed: Xoshiro256PlusPlus::seed_from_u64(index.into()).random(),
            weights: [1.0, 0.0, 0.0],
            length: 1.0,
            is_guide: true,
            ..default()
        }
    }

    /// Position of its root at rest between these guides (m).
    pub(super) fn place(&self, guides: &[GuideRoot]) -> Vec3 {
        let near = self.guides.iter().zip(self.weights).filter(|(_, w)| *w > 0.0);
        near.fold(self.root, |sum, (g, w)| sum + guides[*g as usize].place * w)
    }

    /// As the shader reads it.
    #[doc(hidden)]
    pub fn packed(&self) -> [u32; 32] {
        let mut words = [0; 32];
        words[..3].copy_from_slice(&self.guides);
        words[3] = self.seed;
        let mut put = |at: usize, numbers: &[f32]| {
            for (word, number) in words[at..].iter_mut().zip(numbers) {
                *word = number.to_bits();
            }
        };
        put(4, &self.weights);
        put(7, &[self.length]);
        put(8, &self.root.to_array());
        put(11, &[self.phase]);
        put(12, &self.stray.to_array());
        put(15, &[self.size]);
        for (level, lock) in self.locks.iter().enumerate() {
            put(16 + 4 * level, &lock.root.to_array());
            put(19 + 4 * level, &lock.weights[1..2]);
            put(28 + level, &lock.weights[2..]);
        }
        // Guides are marked by a sign.
        let width = f16::from_f32(if self.is_guide { -1.0 } else { self.width.max(0.0) });
        let cut = (self.cut.clamp(0.0, 1.0) * 65535.0).round() as u32;
        words[31] = u32::from(width.to_bits()) | cut << 16;
        words
    }
}

/// The root of a guide.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GuideRoot {
    pub(super) place: Vec3,
    /// Its direction at the scalp.
    pub(super) normal: Vec3,
    pub(super) length: f32,
    /// From root to tip (m).
    pub(super) reach: Vec3,
}

/// Where a guide that has been cut ends.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GuideEnd {
    /// How many edges it had before.
    pub edges: f32,
    /// Where it ends, in these edges: 6.25 is a quarter along the seventh.
    pub end: f32,
}

impl GuideEnd {
    /// Of a guide with these nodes that is whole.
    pub(super) fn whole(nodes: u32) -> Self {
        let edges = nodes.saturating_sub(1) as f32;
        Self { edges, end: edges }
    }
}

impl From<&CutStrand> for GuideEnd {
    fn from(cut: &CutStrand) -> Self {
        Self { edges: cut.edges as f32, end: cut.end }
    }
}

/// A random direction.
pub(super) fn direction(random: &mut Xoshiro256PlusPlus) -> Vec3 {
    let v: [f32; 3] = random.random();
    (Vec3::from_array(v) * 2.0 - 1.0).normalize_or(Vec3::X)
}
