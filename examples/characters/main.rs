//! Characters from glTF files side by side, each with another preset, playing their animations. H puts hats on and off.
//!
//! `cargo run --release --example characters -- [FILE.glb…] [--shot DIR]`
//!
//! With `--shot` there is no window: each preset, or recipe, on each character from the front, the side, behind and above; with
//! `--hats` a second after the hat is put on.

#[path = "../shared/environment.rs"]
mod environment;
#[path = "../shared/failure.rs"]
mod failure;
#[path = "../shared/gltf.rs"]
mod gltf;
#[path = "../shared/picture.rs"]
mod picture;
#[path = "../shared/renderer.rs"]
mod renderer;

mod hats;
mod shots;

use bevy::{asset::UnapprovedPathMode, gltf::Gltf, prelude::*};
use bevy_keratin::{authoring::plant::HairPreset, prelude::*};
use clap::Parser;
use hats::{bring_hat, put_on_hats};
use std::{
    path::{Path, PathBuf},
    process::ExitCode,
};

/// Shows hair on characters.
#[derive(Parser, Resource, Clone)]
#[command(version)]
struct Arguments {
    /// Characters; the project's own figure if left out.
    files: Vec<PathBuf>,
    /// Draw pictures into this folder, without a window.
    #[arg(long, value_name = "DIR")]
    shot: Option<PathBuf>,
    /// Presets by their names, separated by commas; all if left out.
    #[arg(long, value_delimiter = ',', value_parser = preset)]
    presets: Vec<HairPreset>,
    /// Hair of these recipes, `.recipe.ron`, in place of presets.
    #[arg(long, value_name = "FILE", num_args = 1.., conflicts_with = "presets")]
    recipe: Vec<PathBuf>,
    /// Width and height of each view (pixels).
    #[arg(long, default_value = "400x480", value_parser = renderer::size)]
    size: (u32, u32),
    /// How many times larger, along and across, pictures are drawn and averaged.
    #[arg(long, default_value = "2", value_parser = clap::value_parser!(u32).range(1..=4))]
    supersample: u32,
    /// Drawn strands of each hair at most in pictures; fewer are wider.
    #[arg(long, default_value = "40000", value_parser = clap::value_parser!(u32).range(100..))]
    strands: u32,
    /// Put hats on in pictures.
    #[arg(long)]
    hats: bool,
    /// Leave the skin under the hair as it is.
    #[arg(long)]
    bare: bool,
}

fn preset(name: &str) -> Result<HairPreset, String> {
    let found = HairPreset::ALL.into_iter().find(|preset| preset.name().eq_ignore_ascii_case(name));
    found.ok_or_else(|| {
        format!("expected one of {}", HairPreset::ALL.map(HairPreset::name).join(", "))
    })
}

/// Hair that is shown, and its name.
#[derive(Clone)]
struct Shown {
    name: String,
    wear: WearHair,
}

/// How many characters stand in the window at least.
const MIN_CHARACTERS: usize = 3;

/// A character that waits for its animation.
#[derive(Component)]
struct Still(Handle<Gltf>);

/// Worn hair, or why there is none.
#[derive(Resource, Default)]
struct Outcome(Option<Result<Entity, String>>);

fn main() -> ExitCode {
    let mut arguments = Arguments::parse();
    failure::explain_known();
    if arguments.presets.is_empty() {
        arguments.presets = HairPreset::ALL.to_vec();
    }
    let made = match arguments.shot.clone() {
        Some(folder) => shots::shoot(&arguments, &folder),
        None => show(&arguments),
    };
    match made {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn app(arguments: &Arguments, offscreen: bool) -> App {
    // Files of the command line may be anywhere.
    let assets = AssetPlugin { unapproved_path_mode: UnapprovedPathMode::Allow, ..default() };
    let mut app = renderer::app("characters", (1280, 720), offscreen, assets);
    gltf::register(&mut app);
    if arguments.bare {
        app.insert_resource(HairDefault(ScalpShade { strength: 0.0 }));
    }
    app.insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(GlobalAmbientLight::NONE)
        .insert_resource(ClearColor(Color::srgb(0.44, 0.46, 0.48)))
        .init_resource::<Outcome>()
        .add_observer(|worn: On<HairWorn>, mut outcome: ResMut<Outcome>| {
            outcome.0 = Some(Ok(worn.hair));
        })
        .add_observer(|not: On<HairNotWorn>, mut outcome: ResMut<Outcome>| {
            outcome.0 = Some(Err(not.error.to_string()));
        });
    app
}

impl Arguments {
    fn files(&self) -> Result<Vec<String>> {
        if self.files.is_empty() {
            // Found from any folder, and where the program was not started by Cargo.
            return Ok(vec![concat!(env!("CARGO_MANIFEST_DIR"), "/assets/figure.glb").into()]);
        }
        self.files.iter().map(|file| whole(file)).collect()
    }

    /// The hair that is asked for.
    fn hairs(&self, assets: &AssetServer) -> Result<Vec<Shown>> {
        let of_preset = |preset: &HairPreset| {
            Ok(Shown { name: preset.name().to_owned(), wear: WearHair::new(*preset) })
        };
        let of_recipe = |file: &PathBuf| {
            let name = file.file_name().unwrap_or_default().to_string_lossy();
            let name = name.trim_end_matches(".recipe.ron").to_owned();
            Ok(Shown { name, wear: WearHair::of_recipe(assets.load(whole(file)?)) })
        };
        match self.recipe.is_empty() {
            true => self.presets.iter().map(of_preset).collect(),
            false => self.recipe.iter().map(of_recipe).collect(),
        }
    }
}

/// The whole path of a file.
fn whole(file: &Path) -> Result<String> {
    let path = file.canonicalize().map_err(|error| format!("{}: {error}", file.display()));
    Ok(path?.to_string_lossy().into_owned())
}

/// All in a window.
fn show(arguments: &Arguments) -> Result {
    let files = arguments.files()?;
    let count = files.len().max(MIN_CHARACTERS);
    let mut app = app(arguments, false);
    let hairs = arguments.hairs(app.world().resource::<AssetServer>())?;
    for i in 0..count {
        let file = files[i % files.len()].clone();
        let (shown, aside) = (&hairs[i % hairs.len()], i as f32 - 0.5 * (count - 1) as f32);
        let at = Transform::from_xyz(0.8 * aside, 0.0, 0.0);
        spawn(&mut app, file, shown.wear.clone(), at);
    }
    environment::lights(app.world_mut(), 4.0);
    let mut images = app.world_mut().resource_mut::<Assets<Image>>();
    let surroundings = environment::studio(&mut images, 450.0);
    let at =
        Transform::from_xyz(0.0, 1.6, 0.9 + 0.5 * count as f32).looking_at(Vec3::Y * 1.35, Vec3::Y);
    app.world_mut().spawn((Camera3d::default(), surroundings, at));
    app.add_systems(Update, (play, put_on_hats));
    app.add_observer(bring_hat);
    app.run();
    Ok(())
}

fn spawn(app: &mut App, file: String, wear: WearHair, at: Transform) -> Entity {
    let server = app.world().resource::<AssetServer>();
    let scene = server.load(GltfAssetLabel::Scene(0).from_asset(file.clone()));
    let whole = Still(server.load(file));
    app.world_mut().spawn((WorldAssetRoot(scene), at, wear, whole)).id()
}

/// Plays the first animation of each character, if it has any.
fn play(
    mut commands: Commands,
    still: Query<(Entity, &Still)>,
    children: Query<&Children>,
    mut players: Query<&mut AnimationPlayer>,
    files: Res<Assets<Gltf>>,
    mut graphs: ResMut<Assets<AnimationGraph>>,
) {
    for (character, Still(file)) in &still {
        let Some(clip) = files.get(file).and_then(|file| file.animations.first()) else { continue };
        for below in children.iter_descendants(character) {
            let Ok(mut player) = players.get_mut(below) else { continue };
            let (graph, first) = AnimationGraph::from_clip(clip.clone());
            commands.entity(below).insert(AnimationGraphHandle(graphs.add(graph)));
            player.play(first).repeat();
            commands.entity(character).remove::<Still>();
        }
    }
}
