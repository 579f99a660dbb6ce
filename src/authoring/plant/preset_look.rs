//! How presets look: colours, and the strands drawn between their guides.

use super::preset::HairPreset;
use crate::render::{HairFollowers, HairLook, Melanin};
use bevy::prelude::*;

impl HairPreset {
    pub(super) fn look(self) -> HairLook {
        let base = HairLook { width: 0.18e-3, ..default() };
        match self {
            Self::Straight => HairLook { melanin: Melanin::DARK_BROWN, ..base },
            Self::Wavy => HairLook { melanin: Melanin::AUBURN, ..base },
            // Chestnut.
            Self::Curly => HairLook { melanin: Melanin::new(0.45, 0.3), roughness: 0.45, ..base },
            Self::Coily => HairLook {
                melanin: Melanin::BLACK,
                roughness: 0.55,
                gloss: 0.4,
                width: 0.2e-3,
                ..base
            },
            // Dark blond.
            Self::Short => HairLook { melanin: Melanin::new(0.26, 0.07), gloss: 0.7, ..base },
            // Deep black: in less pigment light from behind glows orange.
            Self::Bob => HairLook { melanin: Melanin::new(6.0, 0.0), roughness: 0.32, ..base },
            // Honey blond.
            Self::Long => HairLook { melanin: Melanin::new(0.1, 0.1), variation: 0.25, ..base },
            Self::Fringe => HairLook { melanin: Melanin::RED, roughness: 0.34, ..base },
            Self::Undercut => HairLook { melanin: Melanin::BROWN, gloss: 0.8, ..base },
            Self::Pixie => HairLook { melanin: Melanin::PLATINUM, variation: 0.35, ..base },
            Self::Locs => HairLook {
                melanin: Melanin::new(1.7, 0.1),
                roughness: 0.6,
                gloss: 0.4,
                width: 0.2e-3,
                ..base
            },
            Self::Beard => HairLook {
                melanin: Melanin::new(0.6, 0.3),
                variation: 0.35,
                roughness: 0.45,
                width: 0.14e-3,
                ..base
            },
            Self::Fur => HairLook {
                melanin: Melanin::AUBURN,
                variation: 0.3,
                roughness: 0.45,
                width: 0.12e-3,
                ..base
            },
        }
    }

    pub(super) fn followers(self) -> HairFollowers {
        let base = HairFollowers {
            segments: 24,
            stray: 0.012,
            clump: 0.0,
            frizz: 0.2e-3,
            ..HairFollowers::new(40_000)
        };
        match self {
            Self::Straight => HairFollowers { locks: Vec3::new(0.25, 0.35, 0.3), ..base },
            Self::Wavy => HairFollowers {
                segments: 40,
                locks: Vec3::new(0.3, 0.5, 0.5),
                lock_shape: 0.9,
                lock_phase: 0.04,
                frizz: 0.4e-3,
                flyaways: 0.02,
                parting: 2.5,
                ..base
            },
            // Blending neighbouring curls would straighten them: each follows its nearest guide.
            Self::Curly => HairFollowers {
                segments: 64,
                locks: Vec3::new(0.2, 0.85, 0.6),
                lock_shape: 0.5,
                lock_phase: 0.12,
                frizz: 0.4e-3,
                flyaways: 0.02,
                parting: 1.0,
                phase_variation: 0.005,
                stray: 0.008,
                ..base
            },
            Self::Coily => HairFollowers {
                segments: 52,
                locks: Vec3::new(0.1, 0.7, 0.6),
                lock_spacing: Vec3::new(0.03, 0.008, 0.004),
                lock_shape: 0.7,
                lock_phase: 0.12,
                lock_length_variation: 0.12,
                frizz: 0.6e-3,
                flyaways: 0.03,
                parting: 1.0,
                phase_variation: 0.02,
                stray: 0.05,
                ..base
            },
            Self::Short => HairFollowers {
                segments: 12,
                locks: Vec3::new(0.3, 0.35, 0.2),
                lock_spacing: Vec3::new(0.014, 0.007, 0.0035),
                flyaways: 0.01,
                flyaway_reach: 8e-3,
                ..base
            },
            Self::Bob => HairFollowers {
                locks: Vec3::new(0.15, 0.25, 0.2),
                lock_length_variation: 0.01,
                stray: 0.006,
                frizz: 0.12e-3,
                flyaways: 0.008,
                length_variation: 0.02,
                ..base
            },
            Self::Long => HairFollowers {
                locks: Vec3::new(0.3, 0.5, 0.4),
                lock_length_variation: 0.1,
                flyaways: 0.02,
                length_variation: 0.2,
                ..base
            },
            Self::Fringe => HairFollowers {
                locks: Vec3::new(0.2, 0.3, 0.3),
                lock_length_variation: 0.02,
                stray: 0.008,
                frizz: 0.15e-3,
                flyaways: 0.01,
                length_variation: 0.03,
                ..base
            },
            Self::Undercut => HairFollowers {
                segments: 16,
                locks: Vec3::new(0.3, 0.4, 0.3),
                lock_spacing: Vec3::new(0.018, 0.008, 0.004),
                flyaways: 0.01,
                flyaway_reach: 8e-3,
                ..base
            },
            Self::Pixie => HairFollowers {
                segments: 14,
                locks: Vec3::new(0.4, 0.5, 0.3),
                lock_spacing: Vec3::new(0.016, 0.008, 0.004),
                lock_length_variation: 0.2,
                flyaways: 0.02,
                flyaway_reach: 8e-3,
                length_variation: 0.25,
                ..base
            },
            // Each lock of the first size is a loc, as thick along all of its way.
            Self::Locs => HairFollowers {
                segments: 32,
                locks: Vec3::new(0.82, 0.0, 0.0),
                lock_spacing: Vec3::new(0.016, 0.008, 0.004),
                lock_shape: 0.25,
                lock_length_variation: 0.25,
                frizz: 0.7e-3,
                flyaways: 0.008,
                flyaway_reach: 6e-3,
                length_variation: 0.04,
                stray: 0.002,
                ..base
            },
            Self::Beard => HairFollowers {
                count: 14_000,
                segments: 10,
                locks: Vec3::new(0.15, 0.3, 0.3),
                lock_spacing: Vec3::new(0.012, 0.006, 0.003),
                frizz: 0.3e-3,
                flyaways: 0.03,
                flyaway_reach: 5e-3,
                length_variation: 0.25,
                ..base
            },
            Self::Fur => HairFollowers {
                count: 80_000,
                segments: 6,
                locks: Vec3::new(0.2, 0.3, 0.2),
                lock_spacing: Vec3::new(0.012, 0.006, 0.003),
                frizz: 0.1e-3,
                stray: 1e-3,
                length_variation: 0.3,
                ..base
            },
        }
    }
}
