//! A ball wears a preset and shakes its head.
//!
//! `cargo run --release --example minimal`

use bevy::prelude::*;
use bevy_keratin::prelude::*;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, shake)
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    // Any entity with a mesh can wear hair. It is planted in the background and appears when it is ready.
    commands.spawn((ball, skin, WearHair::new(HairPreset::Wavy).facing(Dir3::Z)));
    commands.spawn((
        DirectionalLight { illuminance: 6000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 300.0, ..default() },
        Transform::from_xyz(0.25, 0.1, 0.55).looking_at(Vec3::NEG_Y * 0.05, Vec3::Y),
    ));
}

fn shake(time: Res<Time>, mut head: Single<&mut Transform, With<WearHair>>) {
    head.rotation = Quat::from_rotation_y(0.8 * (3.0 * time.elapsed_secs()).sin());
}
