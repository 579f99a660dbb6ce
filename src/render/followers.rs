//! Followers: the strands between the simulated ones. Their roots and guides are chosen once for a
//! groom; their shape is computed in the shader (and in [`curve`](super::curve)).

use crate::base::setting::setting;
use bevy::prelude::*;

setting! {
    /// How many strands are drawn between the simulated ones, and how they differ. Component of a
    /// [`Hair`](crate::Hair), may change at any time; where absent,
    /// [`HairDefault<HairFollowers>`](crate::HairDefault) holds.
    ///
    /// A follower grows between up to three near guides and blends their shapes. Where these guides
    /// move apart it follows only the nearest. Balls, capsules and ellipsoids that hair collides with
    /// push it out. [`FollowerRoots`](super::FollowerRoots) says where followers grow if that is known.
    #[derive(Component, Reflect, Clone, Copy, Debug, PartialEq)]
    #[reflect(Component, Default, Clone, PartialEq)]
    pub struct HairFollowers {
        /// How many strands are drawn besides the guides, at most as many as [`FollowerRoots`](super::FollowerRoots) if the
        /// hair has them; 0 draws guides only. A real head carries 100,000.
        // With more the mesh could exceed the guaranteed size of a GPU buffer (256 MiB).
        pub count: u32 = 12_000, in COUNT: 0.0..=1e5, "20000 suit a head";
        /// Straight segments drawn for each strand, along a smooth curve; for curls at least as
        /// many as the guides have edges.
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
        /// How far tips converge on their guide, as a share of the distance.
        pub clump: f32 = 0.25, in CLUMP: 0.0..=1.0, "0.25 is natural";
        /// How far tips converge in locks of three nested sizes: shares of the distance to the strand in
        /// the middle.
        pub locks: Vec3 = Vec3::new(0.2, 0.3, 0.3), in LOCKS: 0.0..=0.95,
            "0.2, 0.3, 0.3 suit most hair; curls have more";
        /// How far apart the middles of locks of each size are at the scalp.
        pub lock_spacing: Vec3 = Vec3::new(0.03, 0.011, 0.0045), "m" in LOCK_SPACING: 1e-4..=1e3,
            safe 1e-3..=0.2, "0.03, 0.011 and 0.0045 m are natural";
        /// Where along the strand locks draw together: the power of the share of the length. Below 1
        /// near the roots, above 1 at the tips.
        pub lock_shape: f32 = 1.0, in LOCK_SHAPE: 0.25..=8.0, safe 0.5..=3.0, "1 is natural";
        /// How much shorter the strands of a large lock may be than those of another, a share.
        pub lock_length_variation: f32 = 0.06, in LOCK_LENGTH_VARIATION: 0.0..=0.9, safe 0.0..=0.5,
            "0.06 is natural";
        /// By how much a lock of the middle size may be shifted along its guides, as a share of the
        /// length, so that curls turn lock by lock.
        pub lock_phase: f32 = 0.0, in LOCK_PHASE: 0.0..=0.5, safe 0.0..=0.3,
            "a turn's share of the length suits curls";
        /// Amplitude of irregular waves toward the tip, at wavelengths of 12 mm and, with a quarter
        /// of it, 3 mm.
        pub frizz: f32 = 0.1e-3, "m" in FRIZZ: 0.0..=1.0, safe 0.0..=3e-3,
            "0.0002 is straight hair, 0.0012 frizzy";
        /// Share of strands that leave their locks and stand off; a fifth of them are broken.
        pub flyaways: f32 = 0.015, in FLYAWAYS: 0.0..=1.0, safe 0.0..=0.2, "0.015 is natural";
        /// How far flyaways stand off at most.
        pub flyaway_reach: f32 = 20e-3, "m" in FLYAWAY_REACH: 0.0..=10.0, safe 0.0..=0.1,
            "0.02 is natural";
        /// How far wet strands converge on the guide of their lock, as a share of the distance.
        pub wet_clump: f32 = 0.75, in WET_CLUMP: 0.0..=1.0, safe 0.0..=0.95, "0.75 is natural";
        /// How many times farther apart than at the scalp guides may be before they stop blending.
        /// Guides whose directions differ by more than 60° to 90°, as at a parting, stop in any
        /// case.
        pub parting: f32 = 4.0, in PARTING: 1.0..=1e6, safe 1.5..=100.0, "4 suits most hair";
        /// Radius around an isolated guide within which its followers grow.
        pub lock_radius: f32 = 6e-3, "m" in LOCK_RADIUS: 0.0..=10.0, "locks have 0.006";
    }
}

impl HairFollowers {
    /// Only the simulated strands.
    pub fn none() -> Self {
        Self { count: 0, ..default() }
    }

    /// `count` followers, with other settings at their defaults.
    pub fn new(count: u32) -> Self {
        Self { count, ..default() }
    }
}
