//! The salon: a head with hair that remembers, in a window with everything to play with, or drawn
//! into pictures.
//!
//! `cargo run --release --example salon`
//! `cargo run --release --example salon -- --scene perm --offscreen pictures`

#[path = "../scenes/mod.rs"]
mod scenes;

mod camera;
#[cfg(feature = "gpu")]
mod device;
mod dials;
mod environment;
mod failure;
mod mannequin;
mod offscreen;
mod overlay;
mod panel;
mod picture;
mod plots;
mod renderer;
mod solid;
mod stage;
mod story;
mod studio;
mod tools;
mod wardrobe;

use bevy::{prelude::*, render::renderer::RenderAdapterInfo};
use bevy_keratin::{
    prelude::*,
    render::{HairFollowers, HairView, WetLook},
};
use clap::{CommandFactory, Parser, error::ErrorKind};
use scenes::{Scene, SceneKind, ScenePlugin};
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

/// What both share: the scene, the hair, the studio.
fn salon(app: &mut App, scene: Scene, arguments: &Arguments) {
    app.insert_resource(ClearColor(Color::srgb(0.2, 0.21, 0.23)))
        .add_plugins((ScenePlugin(scene), overlay::OverlayPlugin))
        .insert_resource(HairDefault(HairView::from(arguments.view)))
        .add_systems(Startup, stage::build.before(scenes::spawn_scene))
        .add_systems(PreUpdate, surround)
        .add_systems(PostUpdate, (stage::embody, stage::slide).before(TransformSystems::Propagate))
        .add_systems(Update, look_wet);
    #[cfg(feature = "gpu")]
    app.add_systems(FixedPreUpdate, device::fetch);
    let mut gizmos = app.world_mut().resource_mut::<GizmoConfigStore>();
    gizmos.config_mut::<overlay::HairGizmos>().0.enabled = arguments.gizmos;
}

/// Gives each camera the studio to be reflected, which is also what light comes from all around.
fn surround(
    mut commands: Commands,
    mut images: ResMut<Assets<Image>>,
    mut ambient: ResMut<GlobalAmbientLight>,
    cameras: Query<Entity, Added<Camera3d>>,
) {
    for camera in &cameras {
        commands.entity(camera).insert(environment::studio(&mut images, 450.0));
        ambient.brightness = 0.0;
    }
}

/// Water that only cuts bonds, as the bonds' paper has it, shows, too: hair looks as wet as its hydrogen
/// bonds are open, where it carries no water.
fn look_wet(
    mut commands: Commands,
    strands: Query<(Entity, &Bonds, &Moisture, Option<&WetLook>), With<StrandOf>>,
) {
    for (strand, bonds, moisture, look) in &strands {
        let mut open: Vec<f32> =
            bonds.rates(BondKind::Hydrogen).map(|rate| (1.0 - rate).clamp(0.0, 1.0)).collect();
        let is_wet = moisture.is_untouched() && open.iter().any(|open| *open > 0.01);
        open.extend(open.last().copied());
        match look {
            Some(_) if !is_wet => _ = commands.entity(strand).remove::<WetLook>(),
            Some(look) if look.0 == open => {}
            _ if is_wet => _ = commands.entity(strand).insert(WetLook(open)),
            _ => {}
        }
    }
}

fn windowed(scene: Scene, arguments: &Arguments) -> ExitCode {
    let mut app = renderer::app("bevy_keratin salon", arguments.size, false, default());
    app.add_plugins((panel::PanelPlugin, story::StoryPlugin, wardrobe::WardrobePlugin));
    salon(&mut app, scene, arguments);
    app.add_systems(Startup, (open_eye, spare_software).chain().after(stage::build))
        .add_systems(Update, (camera::frame_scene, camera::orbit, camera::place).chain());
    match app.run() {
        AppExit::Success => ExitCode::SUCCESS,
        AppExit::Error(code) => ExitCode::from(code.get()),
    }
}

fn open_eye(mut commands: Commands, scene: Res<Scene>) {
    commands.spawn(camera::bundle(scene.kind));
}

/// Without a graphics card a window is drawn with fewer strands and plain edges, or it would crawl.
fn spare_software(
    adapter: Option<Res<RenderAdapterInfo>>,
    mut followers: ResMut<HairDefault<HairFollowers>>,
    mut lights: Query<&mut SpotLight>,
    mut edges: Query<&mut Msaa>,
) {
    if adapter.is_some_and(|a| format!("{:?}", a.device_type) == "Cpu") {
        followers.count = followers.count.min(1500);
        lights.iter_mut().for_each(|mut light| light.shadow_maps_enabled = false);
        edges.iter_mut().for_each(|mut edges| *edges = Msaa::Off);
    }
}

fn windowless(scene: Scene, arguments: &Arguments) -> App {
    let mut app = renderer::app("", arguments.size, true, default());
    salon(&mut app, scene, arguments);
    app
}
