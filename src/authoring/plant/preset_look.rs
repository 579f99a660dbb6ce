//! How presets look: colours, and the strands drawn between their guides.

use super::preset::HairPreset;
use crate::render::{HairFollowers, HairLook, Melanin};
use bevy::prelude::*;

/// Melanin, roughness, gloss, a strand's width (m) and variation of each preset.
const LOOKS: [(Melanin, f32, f32, f32, f32); 13] = [
    (Melanin::DARK_BROWN, 0.38, 1.0, 0.18e-3, 0.2), // Straight
    (Melanin::AUBURN, 0.38, 1.0, 0.18e-3, 0.2),     // Wavy
    (Melanin::new(0.45, 0.3), 0.45, 1.0, 0.18e-3, 0.2), // Curly: chestnut
    (Melanin::BLACK, 0.55, 0.4, 0.2e-3, 0.2),       // Coily
    (Melanin::new(0.26, 0.07), 0.38, 0.7, 0.18e-3, 0.2), // Short: dark blond
    // Bob: deep black; in less pigment light from behind glows orange.
    (Melanin::new(6.0, 0.0), 0.32, 1.0, 0.18e-3, 0.2),
    (Melanin::new(0.1, 0.1), 0.38, 1.0, 0.18e-3, 0.25), // Long: honey blond
    (Melanin::RED, 0.34, 1.0, 0.18e-3, 0.2),            // Fringe
    (Melanin::BROWN, 0.38, 0.8, 0.18e-3, 0.2),          // Undercut
    (Melanin::PLATINUM, 0.38, 1.0, 0.18e-3, 0.35),      // Pixie
    (Melanin::new(1.7, 0.1), 0.6, 0.4, 0.2e-3, 0.2),    // Locs
    (Melanin::new(0.6, 0.3), 0.45, 1.0, 0.14e-3, 0.35), // Beard
    (Melanin::AUBURN, 0.45, 1.0, 0.12e-3, 0.3),         // Fur
];

/// Three sizes of locks: how much strands draw together, and the locks' spacing (m); their shape, phase and variation of
/// length.
const LOCKS: [[f32; 9]; 13] = [
    [0.25, 0.35, 0.3, 0.03, 0.011, 0.0045, 1.0, 0.0, 0.06], // Straight
    [0.3, 0.5, 0.5, 0.03, 0.011, 0.0045, 0.9, 0.04, 0.06],  // Wavy
    // Blending neighbouring curls would straighten them: each follows its nearest guide.
    [0.2, 0.85, 0.6, 0.03, 0.011, 0.0045, 0.5, 0.12, 0.15], // Curly
    [0.1, 0.7, 0.6, 0.03, 0.008, 0.004, 0.7, 0.12, 0.12],   // Coily
    [0.3, 0.35, 0.2, 0.014, 0.007, 0.0035, 1.0, 0.0, 0.06], // Short
    [0.15, 0.25, 0.2, 0.03, 0.011, 0.0045, 1.0, 0.0, 0.01], // Bob
    [0.3, 0.5, 0.4, 0.03, 0.011, 0.0045, 1.0, 0.0, 0.1],    // Long
    [0.2, 0.3, 0.3, 0.03, 0.011, 0.0045, 1.0, 0.0, 0.02],   // Fringe
    [0.3, 0.4, 0.3, 0.018, 0.008, 0.004, 1.0, 0.0, 0.06],   // Undercut
    [0.4, 0.5, 0.3, 0.016, 0.008, 0.004, 1.0, 0.0, 0.2],    // Pixie
    // Each lock of the first size is a loc, as thick along all of its way.
    [0.82, 0.0, 0.0, 0.016, 0.008, 0.004, 0.25, 0.0, 0.25], // Locs
    [0.15, 0.3, 0.3, 0.012, 0.006, 0.003, 1.0, 0.0, 0.06],  // Beard
    [0.2, 0.3, 0.2, 0.012, 0.006, 0.003, 1.0, 0.0, 0.06],   // Fur
];

/// Segments, frizz (m), flyaways and their reach (m), variation of length, parting, variation of phase, stray.
const STRANDS: [[f32; 8]; 13] = [
    [24.0, 0.2e-3, 0.015, 20e-3, 0.15, 4.0, 0.03, 0.012], // Straight
    [40.0, 0.4e-3, 0.02, 20e-3, 0.15, 2.5, 0.03, 0.012],  // Wavy
    [64.0, 0.4e-3, 0.02, 20e-3, 0.15, 1.0, 0.005, 0.008], // Curly
    [52.0, 0.6e-3, 0.03, 20e-3, 0.15, 1.0, 0.02, 0.05],   // Coily
    [12.0, 0.2e-3, 0.01, 8e-3, 0.15, 4.0, 0.03, 0.012],   // Short
    [24.0, 0.12e-3, 0.008, 20e-3, 0.02, 4.0, 0.03, 0.006], // Bob
    [24.0, 0.2e-3, 0.02, 20e-3, 0.2, 4.0, 0.03, 0.012],   // Long
    [24.0, 0.15e-3, 0.01, 20e-3, 0.03, 4.0, 0.03, 0.008], // Fringe
    [16.0, 0.2e-3, 0.01, 8e-3, 0.15, 4.0, 0.03, 0.012],   // Undercut
    [14.0, 0.2e-3, 0.02, 8e-3, 0.25, 4.0, 0.03, 0.012],   // Pixie
    [32.0, 0.7e-3, 0.008, 6e-3, 0.04, 4.0, 0.03, 0.002],  // Locs
    [10.0, 0.3e-3, 0.03, 5e-3, 0.25, 4.0, 0.03, 0.012],   // Beard
    [6.0, 0.1e-3, 0.015, 20e-3, 0.3, 4.0, 0.03, 1e-3],    // Fur
];

impl HairPreset {
    pub(super) fn look(self) -> HairLook {
        let (melanin, roughness, gloss, width, variation) = LOOKS[self as usize];
        HairLook { melanin, roughness, gloss, width, variation, ..default() }
    }

    pub(super) fn followers(self) -> HairFollowers {
        let [a, b, c, x, y, z, lock_shape, lock_phase, lock_length_variation] =
            LOCKS[self as usize];
        let [
            segments,
            frizz,
            flyaways,
            flyaway_reach,
            length_variation,
            parting,
            phase_variation,
            stray,
        ] = STRANDS[self as usize];
        HairFollowers {
            segments: segments as u32,
            locks: Vec3::new(a, b, c),
            lock_spacing: Vec3::new(x, y, z),
            lock_shape,
            lock_phase,
            lock_length_variation,
            frizz,
            flyaways,
            flyaway_reach,
            length_variation,
            parting,
            phase_variation,
            stray,
            clump: 0.0,
            ..HairFollowers::new(match self {
                Self::Beard => 14_000,
                Self::Fur => 80_000,
                _ => 40_000,
            })
        }
    }
}
