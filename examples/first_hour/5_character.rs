//! The first hour, 5: a character from a glTF file wears again what was saved of it.
//!
//! `cargo run --release --example first_5_character`, with `-- --offscreen DIR` pictures without a window
//!
//! L lets the character wear what was saved from it, shorter and with streaks.

#[path = "../scenes/show.rs"]
mod show;

use bevy::prelude::{KeyCode::*, *};
use bevy_keratin::prelude::*;

fn main() -> std::process::ExitCode {
    show::run("first_5_character", &[(&[], "auburn"), (&[KeyL], "streaks")], |app| {
        app.insert_resource(HairWind { velocity: Vec3::X, gusts: 0.5, ..default() })
            .add_systems(Startup, setup)
            .add_systems(Update, (turn, saved));
    })
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let figure = assets.load(GltfAssetLabel::Scene(0).from_asset("figure.glb"));
    // glTF's characters look along +Z.
    commands
        .spawn((WorldAssetRoot(figure), WearHair::new(HairPreset::Wavy).facing(Dir3::Z)))
        .observe(|worn: On<HairWorn>, mut commands: Commands| {
            commands.trigger(CaptureHairdo { entity: worn.hair });
        });
    commands.add_observer(|taken: On<HairdoCaptured>, mut commands: Commands| {
        commands.insert_resource(Saved(taken.hairdo.clone()));
    });
}

#[derive(Resource)]
struct Saved(Hairdo);

/// Its own preset, seed, length and style come with the hairdo.
fn saved(
    keys: Res<ButtonInput<KeyCode>>,
    saved: Option<Res<Saved>>,
    mut figure: Single<&mut WearHair>,
) -> Result {
    if let Some(saved) = saved.filter(|_| keys.just_pressed(KeyL)) {
        let streaks = DyeLayer::bleach(0.9).in_streaks(0.3).between(0.15, 1.0);
        let again = WearHair::try_from(saved.0.clone())?;
        **figure = again.long(0.8).facing(Dir3::Z).dyed(HairDye::of(streaks));
    }
    Ok(())
}

fn turn(time: Res<Time>, mut bones: Query<(&Name, &mut Transform)>) {
    for (_, mut bone) in bones.iter_mut().filter(|(name, _)| name.as_str() == "Head") {
        bone.rotation = Quat::from_rotation_y(0.6 * (1.5 * time.elapsed_secs()).sin());
    }
}
