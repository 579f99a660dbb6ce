//! Hair from a groom file: a few of its strands are simulated, the others drawn between them.
//!
//! `cargo run --release --example groom_from_file`

use bevy::prelude::*;
use bevy_keratin::{authoring::groom::UpAxis, prelude::*};

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, shake)
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) -> Result {
    // .abc, .hair, .tfx, .ply, .data, glTF and (feature `usd`) USD are known. Only the last two say their unit and where up is.
    let groom: Handle<Groom> = assets
        .load_builder()
        .with_settings(|settings: &mut GroomSettings| {
            settings.scale = Some(0.01);
            settings.up = Some(UpAxis::Y);
        })
        .load("bob.hair");
    let guides = GroomGuides { count: 200, ..default() };
    let head = commands.spawn((
        Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32))),
        MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5)))),
        HairCollider::sphere(0.1)?,
    ));
    let head = head.id();
    commands.spawn((GroomedHair { groom, guides }, ChildOf(head)));
    commands.spawn((
        DirectionalLight { illuminance: 6000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 300.0, ..default() },
        Transform::from_xyz(0.5, 0.1, 0.5).looking_at(Vec3::NEG_Y * 0.05, Vec3::Y),
    ));
    Ok(())
}

fn shake(time: Res<Time>, mut head: Single<&mut Transform, With<HairCollider>>) {
    head.rotation = Quat::from_rotation_y(0.8 * (3.0 * time.elapsed_secs()).sin());
}
