//! Hair lies on a mesh: its signed distances are baked into a grid.
//!
//! `cargo run --release --example collider_from_mesh`

use bevy::prelude::*;
use bevy_keratin::{DistanceGrid, forces::contact::Bake, prelude::*};

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, turn)
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) -> Result {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    commands.spawn((ball, skin, WearHair::new(HairPreset::Long).facing(Dir3::Z)));
    // A ring below the head. Any closed mesh will do, as it was loaded or made.
    let ring = Torus { minor_radius: 0.04, major_radius: 0.13 }.mesh().build();
    // Cells of 8 mm: what is thinner than one is lost.
    let grid = DistanceGrid::of_mesh(&ring, &Bake { cell: 0.008, ..default() })?;
    commands.spawn((
        Mesh3d(assets.add(ring)),
        MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.3, 0.35, 0.4)))),
        Transform::from_xyz(0.0, -0.18, 0.0),
        HairCollider::grid(grid).with_friction(0.3)?,
    ));
    commands.spawn((
        DirectionalLight { illuminance: 6000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 300.0, ..default() },
        Transform::from_xyz(0.4, 0.25, 0.7).looking_at(Vec3::NEG_Y * 0.12, Vec3::Y),
    ));
    Ok(())
}

fn turn(time: Res<Time>, mut head: Single<&mut Transform, With<WearHair>>) {
    head.rotation = Quat::from_rotation_y(0.5 * time.elapsed_secs().sin());
}
