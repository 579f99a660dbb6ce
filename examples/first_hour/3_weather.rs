//! The first hour, 3: wind that blows in gusts, and rain that wets.
//!
//! `cargo run --release --example first_3_weather`, with `-- --offscreen DIR` pictures without a window

#[path = "../scenes/show.rs"]
mod show;

use bevy::prelude::{KeyCode::*, *};
use bevy_keratin::prelude::*;

fn main() -> std::process::ExitCode {
    show::run("first_3_weather", &[(&[], "wind"), (&[KeyR], "rain")], |app| {
        app.insert_resource(HairWind {
            velocity: Vec3::new(3.0, 0.0, -1.0),
            gusts: 0.5,
            ..default()
        })
        .add_systems(Startup, setup)
        .add_systems(Update, (rain, tell));
    })
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    let place = Transform::from_xyz(0.0, 1.6, 0.0);
    commands.spawn((ball, skin, place, WearHair::new(HairPreset::Bob).facing(Dir3::Z)));
}

/// R: a cloud of 15 cm radius, a metre above.
fn rain(mut commands: Commands, keys: Res<ButtonInput<KeyCode>>) -> Result {
    if keys.just_pressed(KeyR) {
        let down = Transform::from_xyz(0.0, 2.6, 0.0).looking_to(Vec3::NEG_Y, Vec3::X);
        commands.spawn((Shower::rain(300.0, 0.15)?, down));
    }
    Ok(())
}

fn tell(time: Res<Time>, hair: Option<Single<Entity, With<Hair>>>, condition: HairCondition) {
    if let Some(hair) = hair.filter(|_| time.elapsed_secs() % 1.0 < time.delta_secs()) {
        info!(
            "{:.0} % wet, {:.1} g of water",
            100.0 * condition.wetness(*hair),
            1e3 * condition.water(*hair)
        );
    }
}
