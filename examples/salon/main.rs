//! The salon: a head with hair that remembers, in a window with everything to play with, or drawn
//! into pictures.
//!
//! `cargo run --release --example salon`
//! `cargo run --release --example salon -- --scene perm --offscreen pictures`

#[path = "../shared/head.rs"]
mod head;
#[path = "../shared/scenes/mod.rs"]
mod scenes;

mod camera;
#[cfg(feature = "gpu")]
mod device;
mod dials;
#[path = "../shared/dressed.rs"]
mod dressed;
#[path = "../shared/environment.rs"]
mod environment;
#[path = "../shared/failure.rs"]
mod failure;
#[path = "../shared/mannequin.rs"]
mod mannequin;
mod offscreen;
#[path = "../shared/orbit.rs"]
mod orbit;
mod overlay;
mod panel;
#[path = "../shared/picture.rs"]
mod picture;
mod plots;
#[path = "../shared/renderer.rs"]
mod renderer;
#[path = "../shared/set.rs"]
mod set;
#[path = "../shared/solid.rs"]
mod solid;
mod spare;
#[path = "../shared/stage.rs"]
mod stage;
mod story;
#[path = "../shared/studio.rs"]
mod studio;
mod tools;
mod wardrobe;
mod worn;

use bevy::prelude::*;
use bevy_keratin::{prelude::*, render::HairView};
use clap::{CommandFactory, Parser, error::ErrorKind};
use scenes::{Scene, SceneKind};
use std::{path::PathBuf, process::ExitCode};

/// A head with hair that remembers, in a window or in pictures.
#[derive(Parser)]
#[command(version)]
pub struct Arguments {
    /// Which scene: bedhead, blow-dry, perm, wet, shower.
    #[arg(long, default_value = "bedhead")]
    scene: SceneKind,
    /// Which variant of it; the full treatment if left out.
    #[arg(long)]
    variant: Option<String>,
    /// What is shown of the hair.
    #[arg(long, default_value = "natural")]
    view: View,
    /// Shows colliders, wind, showers and rods as lines.
    #[arg(long)]
    gizmos: bool,
    /// Draws no window, but PNGs into this folder.
    #[arg(long, value_name = "DIR")]
    offscreen: Option<PathBuf>,
    /// The frames to draw, 60 a second; those that the paper shows if left out.
    #[arg(long, requires = "offscreen", value_delimiter = ',', value_name = "N,N",
          value_parser = clap::value_parser!(u32).range(..=100_000))]
    frames: Option<Vec<u32>>,
    /// How many times larger, along and across, pictures are drawn and averaged.
    #[arg(long, requires = "offscreen", default_value = "3",
          value_parser = clap::value_parser!(u32).range(1..=4))]
    supersample: u32,
    /// Width and height of pictures or window (pixels).
    #[arg(long, default_value = "1280x720", value_name = "WxH", value_parser = renderer::size)]
    size: (u32, u32),
}

/// The views by name.
#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum View {
    Natural,
    Guides,
    Hydrogen,
    Ionic,
    Disulfide,
    Peptide,
    Strain,
    Moisture,
}

impl From<View> for HairView {
    fn from(view: View) -> Self {
        match view {
            View::Natural => Self::Natural,
            View::Guides => Self::Guides,
            View::Hydrogen => Self::Bond(BondKind::Hydrogen),
            View::Ionic => Self::Bond(BondKind::Ionic),
            View::Disulfide => Self::Bond(BondKind::Disulfide),
            View::Peptide => Self::Bond(BondKind::Peptide),
            View::Strain => Self::Strain,
            View::Moisture => Self::Moisture,
        }
    }
}

fn main() -> ExitCode {
    let arguments = match Arguments::try_parse() {
        Ok(arguments) => arguments,
        Err(error) => return refuse(&error),
    };
    let scene = match Scene::new(arguments.scene, arguments.variant.as_deref()) {
        Ok(scene) => scene,
        Err(error) => {
            eprintln!("error: {error}");
            return ExitCode::from(2);
        }
    };
    failure::explain_known();
    match arguments.offscreen.clone() {
        None => windowed(scene, &arguments),
        Some(folder) => {
            // The folder before anything that takes long.
            let written = picture::folder(&folder).and_then(|()| {
                let mut app = windowless(scene, &arguments);
                offscreen::run(&mut app, scene, &arguments, &folder)
            });
            match written {
                Ok(paths) => {
                    paths.iter().for_each(|path| println!("{}", path.display()));
                    ExitCode::SUCCESS
                }
                Err(error) => {
                    eprintln!("error: {error}");
                    ExitCode::FAILURE
                }
            }
        }
    }
}

/// Tells what is wrong with the command line; with a misspelt flag, which there are.
fn refuse(error: &clap::Error) -> ExitCode {
    // Nothing can be done about a closed terminal.
    let _ = error.print();
    if error.kind() == ErrorKind::UnknownArgument {
        let command = Arguments::command();
        let flags: Vec<&str> = command.get_arguments().filter_map(clap::Arg::get_long).collect();
        eprintln!("valid: --{}", flags.join(", --"));
    }
    ExitCode::from(if error.use_stderr() { 2 } else { 0 })
}

/// What both share.
fn salon(app: &mut App, scene: Scene, arguments: &Arguments) {
    set::furnish(app, scene, arguments.view.into());
    app.add_plugins(overlay::OverlayPlugin);
    #[cfg(feature = "gpu")]
    app.add_systems(FixedPreUpdate, device::fetch);
    let mut gizmos = app.world_mut().resource_mut::<GizmoConfigStore>();
    gizmos.config_mut::<overlay::HairGizmos>().0.enabled = arguments.gizmos;
}

fn windowed(scene: Scene, arguments: &Arguments) -> ExitCode {
    let mut app = renderer::app("bevy_keratin salon", arguments.size, false, default());
    app.add_plugins((
        panel::PanelPlugin,
        story::StoryPlugin,
        wardrobe::WardrobePlugin,
        worn::WornPlugin(scene),
    ));
    salon(&mut app, scene, arguments);
    app.add_systems(Startup, (open_eye, spare::software).chain().after(stage::build))
        .add_systems(PreUpdate, spare::strands)
        .add_systems(Update, (camera::frame_stage, camera::orbit, camera::place).chain());
    match app.run() {
        AppExit::Success => ExitCode::SUCCESS,
        AppExit::Error(code) => ExitCode::from(code.get()),
    }
}

fn open_eye(mut commands: Commands, scene: Res<Scene>) {
    commands.spawn(orbit::bundle(scene.kind));
}

fn windowless(scene: Scene, arguments: &Arguments) -> App {
    let mut app = renderer::app("", arguments.size, true, default());
    salon(&mut app, scene, arguments);
    app
}
