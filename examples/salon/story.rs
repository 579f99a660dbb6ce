//! Playing a scene: what happens when, in words, and choosing, restarting, pausing, stepping it.

use crate::{
    scenes::{self, Director, Moment, Scene, SceneKind},
    worn::{self, Shown},
};
use bevy::prelude::*;
use bevy_egui::input::egui_wants_any_keyboard_input;
use bevy_keratin::prelude::*;

/// Sets the stage anew, for this.
#[derive(Message, Clone, Copy, Debug)]
pub struct Restart(pub Shown);

/// Lets exactly one tick pass while paused.
#[derive(Message, Clone, Copy, Debug)]
pub struct Step;

pub struct StoryPlugin;

impl Plugin for StoryPlugin {
    fn build(&self, app: &mut App) {
        app.add_message::<Restart>().add_message::<Step>().add_systems(
            PreUpdate,
            (keys.run_if(not(egui_wants_any_keyboard_input)), restart, step).chain(),
        );
    }
}

fn keys(
    keys: Res<ButtonInput<KeyCode>>,
    shown: Res<Shown>,
    mut time: ResMut<Time<Virtual>>,
    mut restarts: MessageWriter<Restart>,
    mut steps: MessageWriter<Step>,
) {
    if keys.just_pressed(KeyCode::Space) {
        toggle(&mut time);
    }
    if keys.just_pressed(KeyCode::KeyR) {
        restarts.write(Restart(*shown));
    }
    if keys.just_pressed(KeyCode::ArrowRight) {
        steps.write(Step);
    }
}

/// Pauses or plays on.
pub fn toggle(time: &mut Time<Virtual>) {
    if time.is_paused() {
        time.unpause();
    } else {
        time.pause();
    }
}

fn restart(
    mut commands: Commands,
    mut restarts: MessageReader<Restart>,
    gravity: Res<HairGravity>,
    drag: Res<HairDefault<AirDrag>>,
) {
    let Some(&Restart(wanted)) = restarts.read().last() else { return };
    // The stage is set with the paper's air; the sliders' stays.
    let (gravity, drag) = (*gravity, drag.clone());
    commands.queue(move |world: &mut World| -> Result {
        let before = *world.resource::<Shown>();
        world.insert_resource(wanted);
        world.run_system_cached(scenes::clear)?;
        match wanted {
            Shown::Scene(scene) => {
                worn::take_off(world);
                world.insert_resource(scene);
                world.run_system_cached(scenes::spawn_scene)?;
                if matches!(before, Shown::Scene(_)) {
                    world.insert_resource(drag);
                }
            }
            Shown::Preset(preset) => {
                // Nothing is directed any more.
                world.resource_mut::<Director>().ended = true;
                worn::put_on(world, preset)?;
            }
        }
        world.insert_resource(gravity);
        Ok(())
    });
}

fn step(
    mut steps: MessageReader<Step>,
    mut time: ResMut<Time<Virtual>>,
    mut fixed: ResMut<Time<Fixed>>,
) {
    if steps.read().count() > 0 {
        time.pause();
        let tick = fixed.timestep();
        fixed.accumulate_overstep(tick);
    }
}

/// What happens from which time (s) on.
pub fn moments(scene: Scene) -> Vec<(f32, &'static str)> {
    let variant = scene.variant;
    match scene.kind {
        SceneKind::Bedhead => {
            let (wet, drying) = match variant {
                "never-wet" => ("dry, comes down", "still pressed, as dry as before"),
                "never-dried" => ("wet, comes down", "still pressed, still wet"),
                _ => ("wet, comes down", "drying: hydrogen bonds close in the pressed shape"),
            };
            vec![
                (0.0, wet),
                (Moment::PRESSED, "pressed on the floor"),
                (Moment::TREATED, drying),
                (Moment::LIFTED, "lifted"),
            ]
        }
        SceneKind::BlowDry => {
            let drying = match variant {
                "no-drying" => "cold wind that does not dry",
                "uniform" => "wind, and drying alike everywhere",
                _ => "drying where the wind goes",
            };
            vec![
                (0.0, "wet, comes down"),
                (Moment::PRESSED, "pressed on the floor"),
                (Moment::TREATED, drying),
                (Moment::LIFTED, "lifted"),
            ]
        }
        SceneKind::Perm => {
            let (lotion, rinse) = match variant {
                "water-set" => ("wet: hydrogen and ionic bonds cut", "drying"),
                "cut-only" => ("lotion cuts bonds", "nothing closes them"),
                "untreated" => ("wound, nothing done", "wound, nothing done"),
                _ => ("lotion cuts bonds", "neutraliser and drying close them"),
            };
            vec![
                (0.0, "hangs"),
                (Moment::WOUND, "winding"),
                (Moment::TREATED, lotion),
                (Moment::RINSED, rinse),
                (Moment::RELEASED, "released"),
            ]
        }
        SceneKind::Wet => vec![
            (0.0, "dry, settles"),
            (Moment::STREWN, "droplets stick and pull strands together"),
        ],
        SceneKind::Shower => {
            let (wet, lies) = match variant {
                "never-wet" => ("no water", "dry, comes down"),
                "dried-free" => ("soaked through, dries hanging", "dry again, comes down"),
                _ => ("shower: water soaks in, hydrogen bonds open", "wet, comes down"),
            };
            vec![
                (0.0, "dry"),
                (Moment::SHOWER[0], wet),
                (Moment::SHOWER[1], "water runs down and drips"),
                (Moment::LYING, lies),
                (Moment::NIGHT[0], "a night: what is wet dries in the pressed shape"),
                (Moment::NIGHT[1], "lifted"),
                (Moment::REWET[0], "shower again: the shape is let go"),
                (Moment::DRYING, "dries hanging"),
            ]
        }
    }
}
