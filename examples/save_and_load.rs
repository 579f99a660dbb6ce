//! A hairdo is kept as bytes and put on again. W wets and ruins it, S saves it, L loads it.
//!
//! `cargo run --release --example save_and_load`

use bevy::{prelude::KeyCode::*, prelude::*};
use bevy_keratin::prelude::*;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, (keys, shake))
        .add_observer(save)
        .run();
}

/// As they would be in a saved game.
#[derive(Resource)]
struct Saved(Vec<u8>);

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    commands.spawn((ball, skin, WearHair::new(HairPreset::Curly).facing(Dir3::Z)));
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

fn keys(
    keys: Res<ButtonInput<KeyCode>>,
    hair: Option<Single<Entity, With<Hair>>>,
    saved: Option<Res<Saved>>,
    mut treat: MessageWriter<HairTreatment>,
    mut commands: Commands,
) -> Result {
    let Some(hair) = hair.map(|hair| *hair) else { return Ok(()) };
    if keys.just_pressed(KeyW) {
        treat.write(HairTreatment::wet(hair));
    }
    if keys.just_pressed(KeyS) {
        commands.trigger(CaptureHairdo { entity: hair });
    }
    if let Some(saved) = saved.filter(|_| keys.just_pressed(KeyL)) {
        // Strands, bonds, water, colours: all that the hair remembers.
        commands.trigger(ApplyHairdo { entity: hair, hairdo: Hairdo::from_bytes(&saved.0)? });
    }
    Ok(())
}

fn save(taken: On<HairdoCaptured>, mut commands: Commands) {
    let bytes = taken.hairdo.to_bytes();
    info!("{} strands in {} KiB", taken.hairdo.strands().len(), bytes.len() / 1024);
    commands.insert_resource(Saved(bytes));
}

/// While M is held.
fn shake(
    time: Res<Time>,
    keys: Res<ButtonInput<KeyCode>>,
    mut head: Single<&mut Transform, With<WearHair>>,
) {
    if keys.pressed(KeyM) {
        head.rotation = Quat::from_rotation_y(0.8 * (6.0 * time.elapsed_secs()).sin());
    }
}
