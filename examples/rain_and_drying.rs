//! Rain wets hair for eight seconds, then a hair dryer dries it. The log says how wet it is.
//!
//! `cargo run --release --example rain_and_drying`

use bevy::prelude::*;
use bevy_keratin::prelude::*;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        // Hair dries in minutes, players wait seconds: water goes sixty times as fast as in life.
        .insert_resource(HairProcessTime(60.0))
        .add_systems(Startup, setup)
        .add_systems(Update, (weather, report))
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    commands.spawn((ball, skin, WearHair::new(HairPreset::Wavy).facing(Dir3::Z)));
    commands.spawn(Shower::rain_on(Vec3::ZERO));
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

fn weather(mut commands: Commands, time: Res<Time>, rain: Option<Single<Entity, With<Shower>>>) {
    if let Some(rain) = rain.filter(|_| time.elapsed_secs() > 8.0) {
        commands.entity(*rain).despawn();
        commands.spawn(Blower::blow_dry(Vec3::new(0.3, 0.1, 0.2), Vec3::NEG_Y * 0.05));
    }
}

fn report(time: Res<Time>, hair: Option<Single<Entity, With<Hair>>>, condition: HairCondition) {
    if let Some(hair) = hair.filter(|_| time.elapsed_secs() % 1.0 < time.delta_secs()) {
        let (wetness, water) = (condition.wetness(*hair), condition.water(*hair));
        info!("{:.0} % wet, {:.1} g of water", 100.0 * wetness, 1e3 * water);
    }
}
