//! The first hour, 4: hair is dyed, saved, washed out, and put on again as it was saved.
//!
//! `cargo run --release --example first_4_style`, with `-- --offscreen DIR` pictures without a window.
//! D dyes, S saves the hairdo, W washes it out, L puts it on again.

#[path = "../scenes/show.rs"]
mod show;

use bevy::prelude::{KeyCode::*, *};
use bevy_keratin::prelude::*;

fn main() -> std::process::ExitCode {
    let script: [show::Step; 3] =
        [(&[KeyD, KeyS], "dyed"), (&[KeyW], "washed"), (&[KeyL], "again")];
    show::run("first_4_style", &script, |app| {
        app.add_systems(Startup, setup).add_systems(Update, ask).add_observer(
            |taken: On<HairdoCaptured>, mut commands: Commands| {
                commands.insert_resource(Saved(taken.hairdo.to_bytes()));
            },
        );
    })
}

#[derive(Resource)]
struct Saved(Vec<u8>);

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let ball = Mesh3d(assets.add(Sphere::new(0.1).mesh().uv(64, 32)));
    let skin = MeshMaterial3d(assets.add(StandardMaterial::from(Color::srgb(0.8, 0.6, 0.5))));
    let wear = WearHair::new(HairPreset::Long).long(0.6).facing(Dir3::Z);
    commands.spawn((ball, skin, Transform::from_xyz(0.0, 1.6, 0.0), wear));
}

fn ask(
    keys: Res<ButtonInput<KeyCode>>,
    hair: Option<Single<Entity, With<Hair>>>,
    saved: Option<Res<Saved>>,
    mut treat: MessageWriter<HairTreatment>,
    mut commands: Commands,
) -> Result {
    let Some(hair) = hair.map(|hair| *hair) else { return Ok(()) };
    if keys.just_pressed(KeyD) {
        let tips = DyeLayer::bleached(HairColor::PINK).tips(0.6);
        commands.entity(hair).insert(HairDye::of(DyeLayer { fade: 0.4, ..tips }));
    }
    if keys.just_pressed(KeyS) {
        commands.trigger(CaptureHairdo { entity: hair });
    }
    if keys.just_pressed(KeyW) {
        treat.write(HairTreatment::wet(hair));
        commands.entity(hair).remove::<HairDye>();
    }
    if let Some(saved) = saved.filter(|_| keys.just_pressed(KeyL)) {
        commands.trigger(ApplyHairdo { entity: hair, hairdo: Hairdo::from_bytes(&saved.0)? });
    }
    Ok(())
}
