//! Followers: the strands between the simulated ones. Where they grow and which guides they go with
//! is decided once for a groom; where they are is computed in the vertex shader (and in
//! [`curve`](super::curve)).

use crate::setting::setting;
use bevy::prelude::*;

setting! {
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
        /// hair has them; 0 draws guides only. A real head carries 100,000.
        // With more the mesh outgrows what a GPU buffer holds everywhere (256 MiB).
        pub count: u32 = 12_000, in COUNT: 0.0..=1e5, "20000 suit a head";
        /// Straight pieces drawn for each strand, along a smooth curve; for curls at least as many as
        /// the guides have edges.
        pub segments: u32 = 16, in SEGMENTS: 1.0..=64.0, safe 2.0..=64.0, "16 suit most hair";
        /// The same seed gives the same followers.
        pub seed: u32 = 0;
        /// How much shorter than its guides a follower may be, a share.
        pub length_variation: f32 = 0.15, in LENGTH_VARIATION: 0.0..=0.95, safe 0.0..=0.9,
            "0.15 is natural";
        /// By how much a follower's waves may be shifted against its guides', as a share of the
        /// length.
        pub phase_variation: f32 = 0.03, in PHASE_VARIATION: 0.0..=0.5, safe 0.0..=0.3,
            "0.03 is natural";
        /// How far strays leave their lock at the tip, as a share of the length.
        pub stray: f32 = 0.03, in STRAY: 0.0..=1.0, safe 0.0..=0.5, "0.03 is natural";
        /// How much tips draw together around their guide, a share.
        pub clump: f32 = 0.25, in CLUMP: 0.0..=1.0, "0.25 is natural";
        /// How far water draws the strands of a lock to their guide where it soaks them, a share of
        /// the way.
        pub wet_clump: f32 = 0.75, in WET_CLUMP: 0.0..=1.0, safe 0.0..=0.95, "0.75 is natural";
        /// How many times farther apart than at the scalp guides may be before they stop blending.
        /// Guides that go ways more than 60° to 90° apart, as at a parting, stop in any case.
        pub parting: f32 = 4.0, in PARTING: 1.0..=1e6, safe 1.5..=100.0, "4 suits most hair";
        /// How far around it followers grow where a guide stands alone.
        pub lock_radius: f32 = 6e-3, "m" in LOCK_RADIUS: 0.0..=10.0, "locks have 0.006";
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
