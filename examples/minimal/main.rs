//! The least that shows hair: a ball that grows a wavy head of hair and shakes it.
//!
//! `cargo run --release --example minimal`

#[path = "../salon/failure.rs"]
mod failure;

use bevy::prelude::*;
use bevy_keratin::{authoring::plant::*, prelude::*};

fn main() {
    // One sentence instead of a panic where there is no display.
    failure::explain_known();
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, shake)
        .run();
}

fn setup(
    mut commands: Commands,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) -> Result {
    let ball = Sphere::new(0.1).mesh().uv(64, 32);
    let planted = HairPreset::Wavy.plant(&ball, &Scalp::default())?;
    let skin = materials.add(Color::srgb(0.8, 0.6, 0.5));
    let head = commands
        .spawn((Mesh3d(meshes.add(ball)), MeshMaterial3d(skin), HairCollider::sphere(0.1)?))
        .id();
    let hair = commands.spawn((Hair, HairPreset::Wavy.settings(), ChildOf(head))).id();
    for strand in planted.groom.strands() {
        commands.spawn((StrandOf(hair), Strand::from_polyline(strand.points)?));
    }
    commands.spawn((
        SpotLight { intensity: 300_000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.0, 1.5).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    let eye = Transform::from_xyz(0.25, 0.1, 0.55).looking_at(Vec3::NEG_Y * 0.05, Vec3::Y);
    commands.spawn((Camera3d::default(), eye));
    Ok(())
}

fn shake(time: Res<Time>, mut head: Single<&mut Transform, With<HairCollider>>) {
    head.rotation = Quat::from_rotation_y(0.8 * (3.0 * time.elapsed_secs()).sin());
}
