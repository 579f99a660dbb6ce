//! A figure that walks in a circle, looks about and wears a preset's hair: what it takes to put hair
//! on an animated character, from its skinned mesh and bones alone.
//!
//! `cargo run --release --example character -- --preset long --wind`
//!
//! W wind, R rain, T a jump of 3 m, Space pause; drag to look around, wheel to come near.

#[path = "../salon/dressed.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod dressed;
#[path = "../salon/failure.rs"]
mod failure;
#[path = "../presets/head.rs"]
#[allow(dead_code, reason = "the presets use all of it")]
mod head;
#[path = "../salon/mannequin.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod mannequin;
#[path = "../salon/picture.rs"]
mod picture;
#[path = "../salon/renderer.rs"]
mod renderer;
#[path = "../salon/solid.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod solid;
#[path = "../salon/studio.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod studio;

mod body;
mod export;
mod figure;
mod measure;
mod skeleton;
mod stage;
mod weather;

/// What the mannequin takes from the scenes.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::authoring::plant::HairPreset;
use clap::Parser;
use stage::Follow;
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// A walking figure with hair.
#[derive(Parser, Resource, Clone)]
#[command(version)]
struct Arguments {
    /// straight, wavy, curly, coily, short, bob, long, fringe, undercut, pixie, locs, beard or fur.
    #[arg(long, default_value = "wavy", value_parser = preset)]
    preset: Preset,
    /// It is windy.
    #[arg(long)]
    wind: bool,
    /// It rains.
    #[arg(long)]
    rain: bool,
    /// Draws no window, but PNGs into this folder.
    #[arg(long, value_name = "DIR")]
    offscreen: Option<PathBuf>,
    /// Draws nothing, but writes the figure without hair into this file, as binary glTF.
    #[arg(long, value_name = "FILE")]
    export: Option<PathBuf>,
    /// How long it walks for the pictures (s).
    #[arg(long, default_value_t = 6.0, value_parser = seconds)]
    seconds: f32,
    /// Width and height of pictures or window (pixels).
    #[arg(long, default_value = "960x960", value_name = "WxH", value_parser = renderer::size)]
    size: (u32, u32),
}

#[derive(Clone, Copy, Debug)]
struct Preset(HairPreset);

fn preset(text: &str) -> Result<Preset, String> {
    let names = HairPreset::ALL.map(|preset| format!("{preset:?}").to_lowercase());
    let found = names.iter().position(|name| *name == text.to_lowercase());
    let expected = || format!("expected one of {}", names.join(", "));
    found.map(|i| Preset(HairPreset::ALL[i])).ok_or_else(expected)
}

fn seconds(text: &str) -> Result<f32, String> {
    let seconds = text.parse().ok().filter(|s| (0.5..=3600.0).contains(s));
    seconds.ok_or_else(|| "expected seconds from 0.5 to 3600".into())
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    failure::explain_known();
    match run(&arguments) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    if let Some(file) = &arguments.export {
        let body = body::mesh_of(0.0036, 0.0105);
        return export::write(&head::with_scalp(body, &figure::scalp(), default()), file);
    }
    // Before anything that takes long.
    arguments.offscreen.as_deref().map(picture::folder).transpose()?;
    let offscreen = arguments.offscreen.is_some();
    let mut app = renderer::app("character", arguments.size, offscreen, default());
    app.insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(ClearColor(Color::srgb(0.2, 0.21, 0.23)))
        .insert_resource(arguments.clone())
        .insert_resource(figure::Wears(arguments.preset.0))
        .add_plugins((figure::FigurePlugin, weather::WeatherPlugin, stage::StagePlugin));
    match &arguments.offscreen {
        Some(folder) => pictures(&mut app, arguments, folder),
        None => {
            app.add_systems(Startup, |mut commands: Commands| {
                commands.spawn(stage::camera());
            });
            match app.run() {
                AppExit::Success => Ok(()),
                AppExit::Error(code) => Err(format!("it ended with code {code}").into()),
            }
        }
    }
}

/// From where pictures are drawn: all of it, and the head from in front, beside and behind.
fn views() -> [(&'static str, Follow); 4] {
    let near = |yaw| Follow { height: 1.48, yaw, pitch: 0.08, distance: 1.75 };
    [("all", Follow::default()), ("front", near(0.5)), ("side", near(1.65)), ("back", near(2.7))]
}

/// Runs with exactly one tick an update; draws a picture each second, in turn of all, of the head from
/// each side, and all of them at the end.
fn pictures(
    app: &mut App,
    arguments: &Arguments,
    folder: &Path,
) -> Result<(), Box<dyn std::error::Error>> {
    app.add_plugins(measure::MeasurePlugin);
    let pictures = picture::Pictures::new(app, arguments.size, 1, stage::camera());
    let name = format!("{:?}", arguments.preset.0).to_lowercase();
    let end = (arguments.seconds * 60.0).round() as u32;
    let take = |app: &mut App, tick: u32, (view, follow): (&str, Follow)| {
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
        let mut cameras = app.world_mut().query::<&mut Follow>();
        cameras.iter_mut(app.world_mut()).for_each(|mut f| *f = follow);
        let path = folder.join(format!("{name}-{tick:04}-{view}.png"));
        let taken = pictures.take(app, &path);
        let measure = app.world().resource::<measure::Measure>();
        println!("{}: after {:.2} s {measure}", path.display(), tick as f32 / 60.0);
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        taken
    };
    for tick in 1..=end {
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        app.update();
        if tick == end {
            views().into_iter().try_for_each(|view| take(app, tick, view))?;
        } else if tick % 60 == 0 {
            take(app, tick, views()[(tick / 60) as usize % 4])?;
        }
    }
    Ok(())
}
