//! The first hour, 2: a ball wears a preset, by one component.
//!
//! `cargo run --release --example first_2_preset`, with `-- --offscreen DIR` pictures without a window

#[path = "../scenes/show.rs"]
mod show;

use bevy::prelude::*;
use bevy_keratin::prelude::*;

fn main() -> std::process::ExitCode {
    // Adds Bevy's plugins and the hair's, a camera before a head at 1.6 m, and light.
    show::run("first_2_preset", &[(&[], "wavy")], |app| {
        app.add_systems(Startup, setup).add_systems(Update, shake);
    })
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    let place = Transform::from_xyz(0.0, 1.6, 0.0);
    // It is planted beside the game, and there a moment later.
    commands.spawn((ball, skin, place, WearHair::new(HairPreset::Wavy).facing(Dir3::Z)));
}

fn shake(time: Res<Time>, mut head: Single<&mut Transform, With<WearHair>>) {
    head.rotation = Quat::from_rotation_y(0.8 * (3.0 * time.elapsed_secs()).sin());
}
