//! Hair by a text file: edit `assets/curls.recipe.ron`, save it, and press R.
//!
//! `cargo run --release --example recipe`
//!
//! With Bevy's feature `file_watcher` a game needs no key: files are loaded again when they are saved.

use bevy::prelude::*;
use bevy_keratin::prelude::*;

const FILE: &str = "curls.recipe.ron";

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, (load_again, shake))
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    commands.spawn((ball, skin, WearHair::of_recipe(assets.load(FILE)).facing(Dir3::Z)));
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

/// New colours and stiffness are on the hair at once; hair of another length or curl grows again.
fn load_again(keys: Res<ButtonInput<KeyCode>>, assets: Res<AssetServer>) {
    if keys.just_pressed(KeyCode::KeyR) {
        assets.reload(FILE);
    }
}

fn shake(time: Res<Time>, mut head: Single<&mut Transform, With<WearHair>>) {
    head.rotation = Quat::from_rotation_y(0.8 * (3.0 * time.elapsed_secs()).sin());
}
