//! A character from a glTF file wears a preset, by one line.
//!
//! `cargo run --release --example on_character`
//!
//! 1 to 7 swap the preset, S saves the hairdo, L wears it again; `--offscreen DIR` draws pictures.

#[path = "scenes/show.rs"]
mod show;

use bevy::prelude::{KeyCode::*, *};
use bevy_keratin::{HairSource, prelude::*};

fn main() -> std::process::ExitCode {
    let script: [show::Step; 3] = [(&[], "curly"), (&[KeyS, Digit6], "bob"), (&[KeyL], "saved")];
    show::run("on_character", &script, |app| {
        app.add_systems(Startup, setup).add_systems(Update, (turn, swap, save_and_load));
    })
}

fn setup(mut commands: Commands, assets: Res<AssetServer>) {
    let figure = assets.load(GltfAssetLabel::Scene(0).from_asset("figure.glb"));
    // glTF's characters look along +Z.
    commands.spawn((WorldAssetRoot(figure), WearHair::new(HairPreset::Curly).facing(Dir3::Z)));
}

fn turn(time: Res<Time>, mut bones: Query<(&Name, &mut Transform)>) {
    for (_, mut bone) in bones.iter_mut().filter(|(name, _)| name.as_str() == "Head") {
        bone.rotation = Quat::from_rotation_y(0.6 * (1.5 * time.elapsed_secs()).sin());
    }
}

fn swap(keys: Res<ButtonInput<KeyCode>>, mut figure: Single<&mut WearHair>) {
    let digits = [Digit1, Digit2, Digit3, Digit4, Digit5, Digit6, Digit7];
    if let Some(pressed) = digits.into_iter().position(|key| keys.just_pressed(key)) {
        **figure = WearHair::new(HairPreset::ALL[pressed]).facing(Dir3::Z);
    }
}

#[derive(Resource)]
struct Saved(HairSource, Vec<u8>);

fn save_and_load(world: &mut World) -> Result {
    let keys = world.resource::<ButtonInput<KeyCode>>();
    let (saves, loads) = (keys.just_pressed(KeyS), keys.just_pressed(KeyL));
    if saves {
        let (hair, worn) = world.query::<(Entity, &WornHair)>().single(world)?;
        let saved = Saved(worn.hair.clone(), Hairdo::of(world, hair)?.to_bytes());
        world.insert_resource(saved);
    }
    if let Some(Saved(hair, bytes)) = world.get_resource::<Saved>().filter(|_| loads) {
        let wear = WearHair::new(hair.clone()).facing(Dir3::Z).styled(Hairdo::from_bytes(bytes)?);
        *world.query::<&mut WearHair>().single_mut(world)? = wear;
    }
    Ok(())
}
