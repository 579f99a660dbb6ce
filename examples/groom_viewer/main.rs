//! Shows a groom from a file on a head that shakes, and prints what was left out of it and what its size and
//! axes look like.
//!
//! `cargo run --release --example groom_viewer -- hair.tfx`
//! `cargo run --release --example groom_viewer -- hair.tfx --offscreen pictures`

#[path = "../shared/dressed.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod dressed;
#[path = "../shared/failure.rs"]
mod failure;
#[path = "../shared/mannequin.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod mannequin;
#[path = "../shared/picture.rs"]
mod picture;
#[path = "../shared/renderer.rs"]
mod renderer;
#[path = "../shared/solid.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod solid;
#[path = "../shared/studio.rs"]
mod studio;

#[path = "../shared/head.rs"]
#[allow(dead_code, reason = "the presets use all of it")]
mod trained;

mod camera;
mod head;
mod stand_in;

/// What the mannequin takes from the scenes.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

use bevy::{asset::LoadState, prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{authoring::groom::*, prelude::*};
use clap::Parser;
use head::{Measure, Shown};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Shows a groom from an .abc, .hair, .tfx, .ply, .data, .gltf, .glb or (feature `usd`) USD file on a head that turns
/// to and fro.
#[derive(Parser, Resource, Clone)]
#[command(version)]
struct Arguments {
    /// The file.
    file: PathBuf,
    /// Metres per unit of the file. If left out, what it says or is usual for its kind, unless hair cannot be as
    /// large or as small as that makes it.
    #[arg(long, value_parser = scale)]
    scale: Option<f32>,
    /// The file's axis that points up; what the file says or is usual for its kind if left out.
    #[arg(long)]
    up: Option<Up>,
    /// Which end of a strand is its root.
    #[arg(long, default_value = "found")]
    roots: Roots,
    /// Refuses a file of which anything is broken, instead of leaving that out.
    #[arg(long)]
    strict: bool,
    /// Keeps strands that lie apart from all others.
    #[arg(long)]
    keep_strays: bool,
    /// How many strands are simulated.
    #[arg(long, default_value_t = GroomGuides::default().count as u32,
          value_parser = clap::value_parser!(u32).range(1..=1_000_000))]
    guides: u32,
    /// How many nodes they have at most.
    #[arg(long, default_value_t = GroomGuides::default().nodes as u32,
          value_parser = clap::value_parser!(u32).range(2..=4096))]
    nodes: u32,
    /// How long hair can be that stands by itself: the gravity-bending length (m).
    #[arg(long, value_name = "M", default_value_t = HairStiffness::default().bending_length,
          value_parser = stiffness)]
    stiffness: f32,
    /// Draws no window, but PNGs into this folder.
    #[arg(long, value_name = "DIR")]
    offscreen: Option<PathBuf>,
    /// How long the head shakes (s); a picture is drawn at the beginning, in the turns of the last
    /// second, and one second after the end.
    #[arg(long, default_value_t = 10.0, value_parser = seconds)]
    seconds: f32,
    /// Width and height of pictures or window (pixels).
    #[arg(long, default_value = "960x960", value_name = "WxH", value_parser = renderer::size)]
    size: (u32, u32),
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Up {
    X,
    Y,
    Z,
    NegX,
    NegY,
    NegZ,
}

#[derive(Clone, Copy, Debug, clap::ValueEnum)]
enum Roots {
    /// Where the head is, if that is known.
    Found,
    First,
    Last,
}

impl From<Roots> for RootEnd {
    fn from(roots: Roots) -> Self {
        match roots {
            Roots::Found => Self::Found,
            Roots::First => Self::First,
            Roots::Last => Self::Last,
        }
    }
}

impl From<Up> for UpAxis {
    fn from(up: Up) -> Self {
        match up {
            Up::X => Self::X,
            Up::Y => Self::Y,
            Up::Z => Self::Z,
            Up::NegX => Self::NegX,
            Up::NegY => Self::NegY,
            Up::NegZ => Self::NegZ,
        }
    }
}

fn scale(text: &str) -> Result<f32, String> {
    let scale = text.parse().ok().filter(|s| (1e-9..=1e9).contains(s));
    scale.ok_or_else(|| "expected metres per unit from 1e-9 to 1e9, such as 0.01".into())
}

fn stiffness(text: &str) -> Result<f32, String> {
    let metres = text.parse().map_err(|_| "expected metres, such as 0.13")?;
    HairStiffness::from_bending_length(metres).map(|_| metres).map_err(|error| error.to_string())
}

fn seconds(text: &str) -> Result<f32, String> {
    let seconds = text.parse().ok().filter(|s| (1.0..=3600.0).contains(s));
    seconds.ok_or_else(|| "expected seconds from 1 to 3600".into())
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
    let path = arguments.file.display();
    let blamed = |error: std::io::Error| format!("{path}: {error}");
    let file = arguments.file.canonicalize().map_err(blamed)?;
    let (scale, up) = GroomSettings::default()
        .scale_and_up_in(&std::fs::read(&file).map_err(blamed)?)
        .map_err(|error| format!("{path}: {error}"))?;
    // Before anything that takes long.
    arguments.offscreen.as_deref().map(picture::folder).transpose()?;
    let folder = file.parent().unwrap_or(Path::new("/")).to_string_lossy().into_owned();
    let assets = AssetPlugin { file_path: folder, ..default() };
    let offscreen = arguments.offscreen.is_some();
    let mut app = renderer::app("groom viewer", arguments.size, offscreen, assets);
    app.insert_resource(ClearColor(Color::srgb(0.2, 0.21, 0.23)))
        .insert_resource(arguments.clone())
        .insert_resource(head::Usual { scale, up })
        .add_plugins(head::HeadPlugin);
    match &arguments.offscreen {
        Some(folder) => pictures(&mut app, arguments, folder),
        None => {
            app.add_systems(Update, (camera::frame, camera::orbit).chain());
            app.add_systems(Startup, |mut commands: Commands| {
                commands.spawn(camera::bundle());
            });
            match app.run() {
                AppExit::Success => Ok(()),
                AppExit::Error(code) => Err(format!("it ended with code {code}").into()),
            }
        }
    }
}

/// Whether the groom could be shown.
fn refused(app: &App, file: &Path) -> Result<(), String> {
    let why = app.world().resource::<head::Refused>().0.first();
    why.map_or(Ok(()), |why| Err(format!("{}: {why}", file.display())))
}

/// Runs with exactly one tick an update, and writes the pictures and what was measured.
fn pictures(
    app: &mut App,
    arguments: &Arguments,
    folder: &Path,
) -> Result<(), Box<dyn std::error::Error>> {
    app.add_systems(Update, camera::frame);
    let pictures = picture::Pictures::new(app, arguments.size, 1, camera::bundle());
    while !app.world().contains_resource::<Shown>() {
        app.update();
        let (assets, shown) =
            (app.world().resource::<AssetServer>(), app.world().resource::<head::Loading>());
        if let LoadState::Failed(error) = assets.load_state(&shown.0) {
            // Without the trace that Bevy puts behind it.
            let error = error.to_string();
            let error = error.lines().next().unwrap_or_default();
            return Err(format!("{}: {error}", arguments.file.display()).into());
        }
        refused(app, &arguments.file)?;
    }
    // The strands grow in the update after.
    app.update();
    app.update();
    refused(app, &arguments.file)?;
    let end = (arguments.seconds * 60.0).round() as u32;
    let name = arguments.file.file_stem().unwrap_or_default().to_string_lossy();
    let mut ticks = 0;
    for frame in [0, end - 45, end - 30, end - 15, end, end + 60] {
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        while ticks < frame {
            app.update();
            ticks += 1;
        }
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
        let path = folder.join(format!("{name}-{frame}.png"));
        pictures.take(app, &path)?;
        let measure = app.world().resource::<Measure>();
        println!("{}: after {} s {measure}", path.display(), frame as f32 / 60.0);
    }
    Ok(())
}
