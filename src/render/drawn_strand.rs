//! A strand as it is drawn.

use bevy::prelude::*;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// A strand as it is drawn: which guides it goes with and how it differs from them. 64 bytes in the
/// buffer, see [`HairBuffers`](super::HairBuffers).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct DrawnStrand {
    /// Indices of its guides, nearest first; unused ones repeat the first and weigh nothing.
    pub guides: [u32; 3],
    /// From which it takes whatever is random in the shader.
    pub seed: u32,
    /// Shares of the guides, sum 1.
    pub weights: [f32; 3],
    /// Where on the guides it ends, a share of their length. Above 1 it ends at their tips and is as
    /// many times as large.
    pub length: f32,
    /// The root's place besides the weighted roots of the guides (m).
    pub root: Vec3,
    /// Where on the guides it begins, a share of their length.
    pub phase: f32,
    /// By how much its tip leaves the lock (m).
    pub stray: Vec3,
    /// Whether it is a guide itself.
    pub is_guide: bool,
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

    /// As the shader reads it.
    pub fn packed(&self) -> [u32; 16] {
        let [a, b, c] = self.guides;
        let [u, v, w] = self.weights.map(f32::to_bits);
        let [rx, ry, rz] = self.root.to_array().map(f32::to_bits);
        let [sx, sy, sz] = self.stray.to_array().map(f32::to_bits);
        let (length, phase) = (self.length.to_bits(), self.phase.to_bits());
        let guide = f32::from(u8::from(self.is_guide)).to_bits();
        [a, b, c, self.seed, u, v, w, length, rx, ry, rz, phase, sx, sy, sz, guide]
    }
}

/// Where a guide grows.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct GuideRoot {
    pub(super) place: Vec3,
    /// Which way it leaves the scalp.
    pub(super) normal: Vec3,
    pub(super) length: f32,
    /// From root to tip (m).
    pub(super) reach: Vec3,
}

/// Any direction, for a stray.
pub(super) fn direction(random: &mut Xoshiro256PlusPlus) -> Vec3 {
    let v: [f32; 3] = random.random();
    (Vec3::from_array(v) * 2.0 - 1.0).normalize_or(Vec3::X)
}
