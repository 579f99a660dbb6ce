//! Twenty-five heads share a budget of two milliseconds a tick: the farther, the more cheaply.
//!
//! `cargo run --release --example crowd`

use bevy::prelude::*;
use bevy_keratin::{HairEstimate, authoring::plant::Scalp, prelude::*};

fn main() {
    App::new()
        .add_plugins((DefaultPlugins, HairPlugins::default()))
        .insert_resource(HairBudget { milliseconds: 2.0, ..default() })
        .add_systems(Startup, setup)
        .add_systems(Update, (shake, report))
        .run();
}

#[derive(Component)]
struct Head;

fn setup(mut commands: Commands, assets: Res<AssetServer>) -> Result {
    let ball = Sphere::new(0.1).mesh().uv(32, 16);
    // Planted once, worn by all.
    let preset = HairPreset::Bob;
    let mut settings = preset.settings();
    settings.followers.count = 4000;
    let planted = preset.plant(&ball, &Scalp::default())?;
    let strands: Vec<Strand> = planted
        .groom
        .strands()
        .map(|s| Strand::from_polyline(s.points))
        .collect::<Result<_, _>>()?;
    let ball = Mesh3d(assets.add(ball));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    for i in 0..25 {
        let place = Vec3::new(0.4 * ((i % 5) as f32 - 2.0), 0.0, -0.6 * (i / 5) as f32);
        let head = (Head, ball.clone(), skin.clone(), HairCollider::sphere(0.1)?);
        let head = commands.spawn((head, Transform::from_translation(place))).id();
        // Without `HairLod` hair is always simulated in full.
        let hair = commands.spawn((Hair, settings.clone(), HairLod::default(), ChildOf(head)));
        let hair = hair.id();
        commands.spawn_batch(strands.clone().into_iter().map(move |s| (StrandOf(hair), s)));
    }
    commands.spawn((
        DirectionalLight { illuminance: 6000.0, shadow_maps_enabled: true, ..default() },
        Transform::from_xyz(1.0, 1.5, 1.0).looking_at(Vec3::ZERO, Vec3::Y),
    ));
    commands.spawn((
        Camera3d::default(),
        AmbientLight { brightness: 300.0, ..default() },
        Transform::from_xyz(0.0, 0.8, 1.4).looking_at(Vec3::new(0.0, -0.1, -0.8), Vec3::Y),
    ));
    Ok(())
}

fn shake(time: Res<Time>, mut heads: Query<&mut Transform, With<Head>>) {
    for mut head in &mut heads {
        let phase = 3.0 * time.elapsed_secs() + 7.0 * head.translation.x + head.translation.z;
        head.rotation = Quat::from_rotation_y(0.8 * phase.sin());
    }
}

fn report(time: Res<Time>, estimate: Res<HairEstimate>) {
    if time.elapsed_secs() % 2.0 < time.delta_secs() {
        info!(
            "{:.1} ms a tick, without the budget {:.1} ms",
            estimate.present, estimate.unbudgeted
        );
    }
}
