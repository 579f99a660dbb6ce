//! Hair that compute shaders simulate. The log says where it is, and why.
//!
//! `cargo run --release --features gpu --example gpu`

use bevy::prelude::*;
use bevy_keratin::prelude::*;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, (shake, report))
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    commands.spawn((ball, skin, WearHair::new(HairPreset::Wavy).facing(Dir3::Z))).observe(
        |worn: On<HairWorn>, mut commands: Commands| {
            // Strands on the GPU do not push each other apart.
            let contact = StrandContact { strength: 0.0, ..default() };
            commands.entity(worn.hair).insert((SimulateOn::Gpu, contact));
        },
    );
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

fn report(
    hairs: Query<&HairResidence, Changed<HairResidence>>,
    mut last: Local<Option<HairResidence>>,
) {
    for residence in &hairs {
        if last.replace(*residence) != Some(*residence) {
            info!("{residence:?}");
        }
    }
}
