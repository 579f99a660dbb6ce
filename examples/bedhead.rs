//! Hair dries on a pillow and keeps its shape when the head gets up.
//!
//! `cargo run --release --example bedhead`

use bevy::prelude::*;
use bevy_keratin::prelude::*;
use core::f32::consts::FRAC_PI_2;

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .add_systems(Startup, setup)
        .add_systems(Update, (treat, lie))
        .run();
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) -> Result {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    commands.spawn((ball, skin, WearHair::new(HairPreset::Bob).facing(Dir3::Z)));
    let (pillow, size) = (Vec3::NEG_Y * 0.35, Vec3::new(0.7, 0.1, 0.5));
    commands.spawn((
        Mesh3d(assets.add(Cuboid::from_size(size).mesh().build())),
        MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.8, 0.85)))),
        Transform::from_translation(pillow),
        HairCollider::rounded_cuboid(size, 0.02)?,
    ));
    commands.spawn((
        DirectionalLight { illuminance: 6000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 300.0, ..default() },
        Transform::from_xyz(0.3, 0.1, 0.9).looking_at(Vec3::NEG_Y * 0.1, Vec3::Y),
    ));
    Ok(())
}

/// Wet hair has no hydrogen bonds; those that form as it dries remember the shape it has then.
fn treat(
    time: Res<Time>,
    worn: Option<Single<(Entity, Ref<WornAs>)>>,
    mut dried: Local<bool>,
    mut treat: MessageWriter<HairTreatment>,
) {
    let Some(worn) = worn else { return };
    let (hair, worn) = worn.into_inner();
    if worn.is_added() {
        treat.write(HairTreatment::wet(hair));
    }
    if time.elapsed_secs() > 7.0 && !core::mem::replace(&mut *dried, true) {
        treat.write(HairTreatment::dry(hair).over(3.0));
    }
}

/// Down in the first seconds, up again after twelve.
fn lie(time: Res<Time>, mut head: Single<&mut Transform, With<WearHair>>) {
    let t = time.elapsed_secs();
    let smooth = |t: f32| t.clamp(0.0, 1.0).powi(2) * (3.0 - 2.0 * t.clamp(0.0, 1.0));
    let down = smooth((t - 2.0) / 3.0) - smooth((t - 12.0) / 3.0);
    head.translation = Vec3::NEG_Y * 0.19 * down;
    head.rotation = Quat::from_rotation_z(FRAC_PI_2 * down);
}
