//! Light and room, of any size.

use crate::solid::{Paint, lathe};
use bevy::prelude::*;
use core::f32::consts::FRAC_PI_2;

/// What the lights are set for (m).
pub const FOCUS: Vec3 = Vec3::new(-0.03, 0.25, 0.0);

/// Key and fill from the front, two kickers at the hair's height from behind, upon `focus`, for
/// things of a head's size times `size`. What comes from behind must not shine through the head: all
/// but the fill cast shadows.
pub fn light(commands: &mut Commands, focus: Vec3, size: f32) {
    let light = |colour, lumens: f32, from: Vec3, outer_angle, shadow| {
        (
            SpotLight {
                color: colour,
                intensity: lumens * size * size,
                range: 8.0 * size,
                radius: 0.05 * size,
                shadow_maps_enabled: shadow,
                shadow_normal_bias: 0.6,
                shadow_depth_bias: 0.004,
                inner_angle: 0.6 * outer_angle,
                outer_angle,
                ..default()
            },
            Transform::from_translation(focus + size * (from - FOCUS)).looking_at(focus, Vec3::Y),
        )
    };
    let (warm, cold) = (Color::srgb(1.0, 0.95, 0.88), Color::srgb(0.82, 0.9, 1.0));
    commands.spawn(light(warm, 230_000.0, Vec3::new(1.0, 1.5, 1.5), 0.75, true));
    commands.spawn(light(cold, 60_000.0, Vec3::new(-1.6, 0.8, 1.3), 0.75, false));
    for side in [-1.0, 1.0] {
        // Off round numbers: Bevy's shadow lookup divides by nothing where a pixel is exactly in a
        // lamp's own plane, and a black dot stands on the wall.
        let from = FOCUS + Vec3::new(1.1537 * side, 0.4519, -1.6461);
        commands.spawn(light(Color::WHITE, 110_000.0, from, 0.35, true));
    }
    commands.insert_resource(GlobalAmbientLight {
        color: Color::srgb(0.9, 0.94, 1.0),
        brightness: 260.0,
        ..default()
    });
}

/// One surface from the top of the wall down to the floor, all around.
pub fn room(commands: &mut Commands, paint: &mut Paint, floor: f32, size: f32) {
    let cove = |i: i32| {
        let turn = FRAC_PI_2 * i as f32 / 16.0;
        Vec2::new(1.7 + 0.8 * turn.cos(), 0.8 - 0.8 * turn.sin())
    };
    let room: Vec<Vec2> =
        [Vec2::new(2.5, 3.0)].into_iter().chain((0..=16).map(cove)).chain([Vec2::ZERO]).collect();
    let wall = paint.matte(Color::srgb(0.60, 0.62, 0.62), 0.95);
    commands.spawn((
        Mesh3d(paint.meshes.add(lathe(&room, 96))),
        MeshMaterial3d(wall),
        Transform::from_xyz(0.0, floor, 0.0).with_scale(Vec3::splat(size)),
    ));
}
