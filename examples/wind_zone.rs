//! A fan sweeps over hair in a light breeze. Space switches a shelter from the breeze on and off.
//!
//! `cargo run --release --example wind_zone`

use bevy::prelude::*;
use bevy_keratin::prelude::*;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        // Everywhere, in gusts.
        .insert_resource(HairWind { velocity: Vec3::X, gusts: 0.5, ..default() })
        .add_systems(Startup, setup)
        .add_systems(Update, (sweep, shelter))
        .run();
}

#[derive(Component)]
struct Fan;

#[derive(Component)]
struct Shelter;

fn setup(mut commands: Commands, assets: Res<AssetServer>) -> Result {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    commands.spawn((ball, skin, WearHair::new(HairPreset::Long).facing(Dir3::Z)));
    // A ball of moving air of 15 cm radius, with a soft edge.
    let blows = WindZone { falloff: 0.1, ..WindZone::new(0.15, Vec3::X * 6.0)? };
    commands.spawn((Fan, blows, Transform::from_xyz(0.0, -0.1, 0.0)));
    commands.spawn((
        DirectionalLight { illuminance: 6000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 300.0, ..default() },
        Transform::from_xyz(0.3, 0.1, 0.8).looking_at(Vec3::NEG_Y * 0.12, Vec3::Y),
    ));
    Ok(())
}

fn sweep(time: Res<Time>, mut fan: Single<&mut Transform, With<Fan>>) {
    fan.translation.y = -0.15 + 0.25 * time.elapsed_secs().sin();
}

fn shelter(
    mut commands: Commands,
    keys: Res<ButtonInput<KeyCode>>,
    shelter: Option<Single<Entity, With<Shelter>>>,
) {
    if keys.just_pressed(KeyCode::Space) {
        match shelter {
            Some(shelter) => commands.entity(*shelter).despawn(),
            None => _ = commands.spawn((Shelter, WindZone::shelter())),
        }
    }
}
