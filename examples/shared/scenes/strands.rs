//! The hair of each scene.

use super::SceneKind;
use bevy::prelude::*;
use bevy_keratin::{WindReceived, prelude::*};
use core::f32::consts::PI;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// The scenes' spacing of strands (m): rows touch at lock radius 1 mm in the perm.
const PATCH_SPACING: f32 = 0.005;
const ROD_SPACING: f32 = 0.002;

/// How far roots are off their grid, as a share of its spacing.
const JITTER: f32 = 0.2;

/// Length between nodes (m): table 1's 0.33 nodes per cm.
const SEGMENT: f32 = 0.03;

/// The head of the scene `wet` (m).
pub const BUST: f32 = 0.09;

pub fn spawn(commands: &mut Commands, kind: SceneKind, hair: Entity) {
    match kind {
        SceneKind::Wet => head(commands, hair, 10_000, 6, 0.24),
        SceneKind::Perm => patch(commands, kind, hair, 1, 100, ROD_SPACING, 16),
        _ => patch(commands, kind, hair, 10, 20, PATCH_SPACING, 8),
    }
}

/// Rows of strands below a scalp that is flat.
fn patch(
    commands: &mut Commands,
    kind: SceneKind,
    hair: Entity,
    rows: usize,
    columns: usize,
    spacing: f32,
    segments: usize,
) {
    // Combed a little to one side, so that it folds that way on the floor.
    let lean = if kind == SceneKind::Perm { 0.0 } else { 7.0_f32.to_radians() };
    let direction = Quat::from_rotation_z(lean) * Vec3::NEG_Y;
    // No scalp is a grid: roots are a little off theirs, the same way every time.
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let mut jitter = || spacing * random.random_range(-JITTER..JITTER);
    for row in 0..rows {
        for column in 0..columns {
            let place = |i: usize, n: usize| (i as f32 - 0.5 * (n - 1) as f32) * spacing;
            let grid = Vec3::new(place(row, rows), 0.0, place(column, columns));
            // A row on a rod lies straight along it.
            let across = if rows > 1 { jitter() } else { 0.0 };
            let root = grid + Vec3::new(across, 0.0, jitter());
            let points: Vec<Vec3> =
                (0..=segments).map(|i| root + direction * (SEGMENT * i as f32)).collect();
            let strand = Strand::from_polyline(&points).expect("points are apart");
            commands.spawn((StrandOf(hair), strand, WindReceived::default()));
        }
    }
}

/// Strands all over the upper half of a ball, standing out.
fn head(commands: &mut Commands, hair: Entity, count: usize, nodes: usize, length: f32) {
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    for i in 0..count {
        let y = (i as f32 + 0.5) / count as f32;
        let across = (1.0 - y * y).sqrt();
        let (sine, cosine) = bevy::math::ops::sin_cos(golden * i as f32);
        let normal = Vec3::new(across * cosine, y, across * sine);
        let segment = length / (nodes - 1) as f32;
        let points: Vec<Vec3> =
            (0..nodes).map(|k| normal * (BUST + 0.002 + segment * k as f32)).collect();
        let strand = Strand::from_polyline(&points).expect("points are apart");
        commands.spawn((StrandOf(hair), strand));
    }
}
