//! Followers: the strands between the simulated ones. Where they grow and which guides they go with
//! is decided once for a groom; where they are is computed in the vertex shader (and in
//! [`curve`](super::curve)).

use crate::setting::{Bound, HairSetting, Notes};
use bevy::prelude::*;

/// How many strands are drawn between the simulated ones, and how they differ. Component of a
/// [`Hair`](crate::Hair), may change at any time; where absent,
/// [`HairDefault<HairFollowers>`](crate::HairDefault) holds.
///
/// A follower grows between up to three near guides and takes their shape in shares. Guides that
/// move apart let go of it: it stays with its nearest. [`FollowerRoots`](super::FollowerRoots) says where followers grow if
/// that is known.
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub struct HairFollowers {
    /// How many strands are drawn besides the guides, at most as many as [`FollowerRoots`](super::FollowerRoots) if the
    /// hair has them. Default 12,000; 0 draws guides only; safe to
    /// 100,000. A real head carries 100,000.
    pub count: u32,
    /// Straight pieces drawn for each strand, along a smooth curve. Default 16, safe 2…64; for curls
    /// at least as many as the guides have edges.
    pub segments: u32,
    /// The same seed gives the same followers.
    pub seed: u32,
    /// How much shorter than its guides a follower may be, a share. Default 0.15, safe 0…0.9.
    pub length_variation: f32,
    /// By how much a follower's waves may be shifted against its guides', as a share of the length.
    /// Default 0.03, safe 0…0.3.
    pub phase_variation: f32,
    /// How far strays leave their lock at the tip, as a share of the length. Default 0.03,
    /// safe 0…0.5.
    pub stray: f32,
    /// How much tips draw together around their guide, a share. Default 0.25, safe 0…1.
    pub clump: f32,
    /// How far water draws the strands of a lock to their guide where it soaks them, a share of the
    /// way. Default 0.75, safe 0…0.95.
    pub wet_clump: f32,
    /// How many times farther apart than at the scalp guides may be before they stop blending.
    /// Guides that go ways more than 60° to 90° apart, as at a parting, stop in any case. Default 4,
    /// safe 1.5…100.
    pub parting: f32,
    /// How far around it followers grow where a guide stands alone (m). Default 6 mm.
    pub lock_radius: f32,
}

impl Default for HairFollowers {
    fn default() -> Self {
        Self {
            count: 12_000,
            segments: 16,
            seed: 0,
            length_variation: 0.15,
            phase_variation: 0.03,
            stray: 0.03,
            clump: 0.25,
            wet_clump: 0.75,
            parting: 4.0,
            lock_radius: 6e-3,
        }
    }
}

impl HairFollowers {
    /// Only the simulated strands.
    pub fn none() -> Self {
        Self { count: 0, ..default() }
    }

    /// So many followers, the rest by default.
    pub fn new(count: u32) -> Self {
        Self { count, ..default() }
    }
}

// Beyond these the mesh outgrows what a GPU buffer holds everywhere (256 MiB).
const COUNT: Bound = Bound::new("HairFollowers::count", 0.0, 1e5, "20000 suit a head");
const SEGMENTS: Bound = Bound::new("HairFollowers::segments", 1.0, 64.0, "16 suit most hair");
const SHARE: Bound = Bound::new("a share of HairFollowers", 0.0, 1.0, "shares go from 0 to 1");
const PARTING: Bound = Bound::new("HairFollowers::parting", 1.0, 1e6, "4 suits most hair");
const RADIUS: Bound = Bound::new("HairFollowers::lock_radius (m)", 0.0, 10.0, "locks have 0.006");

impl HairSetting for HairFollowers {
    fn mended(&self, notes: &Notes) -> Self {
        let d = Self::default();
        Self {
            count: COUNT.mend(self.count as f32, 0.0, notes) as u32,
            segments: SEGMENTS.mend(self.segments as f32, 16.0, notes) as u32,
            seed: self.seed,
            length_variation: SHARE
                .mend(self.length_variation, d.length_variation, notes)
                .min(0.95),
            phase_variation: SHARE.mend(self.phase_variation, d.phase_variation, notes).min(0.5),
            stray: SHARE.mend(self.stray, d.stray, notes),
            clump: SHARE.mend(self.clump, d.clump, notes),
            wet_clump: SHARE.mend(self.wet_clump, d.wet_clump, notes),
            parting: PARTING.mend(self.parting, d.parting, notes),
            lock_radius: RADIUS.mend(self.lock_radius, d.lock_radius, notes),
        }
    }
}
