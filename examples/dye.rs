//! Bleached and dyed hair: pink tips, light streaks, blue all over, on three heads.
//!
//! `cargo run --release --example dye`

use bevy::prelude::*;
use bevy_keratin::prelude::*;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    let tips = DyeLayer::bleached(HairColor::PINK).tips(0.6);
    let streaks = DyeLayer::bleach(0.9).in_streaks(0.3).between(0.15, 1.0);
    // Dye darkens only: dark hair is bleached before it can take a bright colour.
    let blue = DyeLayer::bleached(Color::srgb(0.1, 0.3, 0.8));
    // Layers may be put over each other: `HairDye::of(streaks).with(tips)`.
    for (x, layer) in [(-0.3, tips), (0.0, streaks), (0.3, blue)] {
        commands.spawn((
            ball.clone(),
            skin.clone(),
            Transform::from_xyz(x, 0.0, 0.0),
            WearHair::new(HairPreset::Straight).facing(Dir3::Z).dyed(HairDye::of(layer)),
        ));
    }
    commands.spawn((
        DirectionalLight { illuminance: 6000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 300.0, ..default() },
        Transform::from_xyz(0.0, 0.1, 0.9).looking_at(Vec3::NEG_Y * 0.08, Vec3::Y),
    ));
}
