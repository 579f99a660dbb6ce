//! A lock is wound on a rod, treated, and released with a curl that stays.
//!
//! `cargo run --release --example perm`

use bevy::prelude::*;
use bevy_keratin::prelude::*;
use core::f32::consts::FRAC_PI_2;

/// How long winding takes, and each of lotion, neutraliser and drying (s).
const WINDING: f32 = 3.0;
const STEP: f32 = 2.0;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, perm)
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) -> Result {
    // Beside the hair, so that the hair touches it.
    let rod = commands.spawn((
        PermRod::new(0.03, 0.2)?,
        Mesh3d(assets.add(Cylinder::new(0.028, 0.2).mesh().build())),
        MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.9, 0.5, 0.6)))),
        Transform::from_xyz(0.03, -0.06, 0.0).with_rotation(Quat::from_rotation_x(FRAC_PI_2)),
    ));
    let rod = rod.id();
    let hair = commands.spawn((Hair, HairFollowers { count: 2000, ..default() })).id();
    for i in 0..60 {
        let root = Vec3::Z * 0.002 * (i as f32 - 29.5);
        let points: Vec<Vec3> = (0..=16).map(|k| root + Vec3::NEG_Y * 0.03 * k as f32).collect();
        let winding = PermWinding { pitch: 0.0, seconds: WINDING, ..default() };
        commands.spawn((StrandOf(hair), Strand::from_polyline(&points)?, WoundOn(rod), winding));
    }
    commands.spawn((
        DirectionalLight { illuminance: 6000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 300.0, ..default() },
        Transform::from_xyz(0.25, -0.1, 0.95).looking_at(Vec3::NEG_Y * 0.22, Vec3::Y),
    ));
    Ok(())
}

fn perm(
    mut commands: Commands,
    time: Res<Time>,
    hair: Single<Entity, With<Hair>>,
    rod: Option<Single<Entity, With<PermRod>>>,
    mut treat: MessageWriter<HairTreatment>,
) {
    let passes = |at: f32| (at..at + time.delta_secs()).contains(&time.elapsed_secs());
    if passes(WINDING) {
        info!("lotion, neutraliser, drying");
        treat.write_batch(HairTreatment::perm_set(*hair, STEP));
    }
    if let Some(rod) = rod.filter(|_| time.elapsed_secs() > WINDING + 3.5 * STEP) {
        info!("the rod is taken out");
        commands.entity(*rod).despawn();
    }
}
