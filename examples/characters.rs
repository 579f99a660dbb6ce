//! Characters from glTF files side by side, each with another preset, playing their animations. H puts hats on and off.
//!
//! `cargo run --release --example characters -- [FILE.glb…] [--shot DIR]`
//!
//! With `--shot` there is no window: each preset on each character without its hat, from the
//! front, the side, behind and above.

#[path = "shared/environment.rs"]
mod environment;
#[path = "shared/failure.rs"]
mod failure;
#[path = "shared/gltf.rs"]
mod gltf;
#[path = "shared/picture.rs"]
mod picture;
#[path = "shared/renderer.rs"]
mod renderer;

use bevy::{
    asset::UnapprovedPathMode, core_pipeline::prepass::DepthPrepass, gltf::Gltf, prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::{authoring::plant::HairPreset, prelude::*, render::HairFollowers};
use clap::Parser;
use picture::Pictures;
use std::{
    path::PathBuf,
    process::ExitCode,
    thread::sleep,
    time::{Duration, Instant},
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
    /// Width and height of each view (pixels).
    #[arg(long, default_value = "400x480", value_parser = renderer::size)]
    size: (u32, u32),
    /// How many times larger, along and across, pictures are drawn and averaged.
    #[arg(long, default_value = "2", value_parser = clap::value_parser!(u32).range(1..=4))]
    supersample: u32,
    /// Drawn strands of each hair at most in pictures; fewer are wider.
    #[arg(long, default_value = "40000", value_parser = clap::value_parser!(u32).range(100..))]
    strands: u32,
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

/// How many characters stand in the window at least.
const MIN_CHARACTERS: usize = 3;
/// How long a file and its hair may take.
const PATIENCE: Duration = Duration::from_secs(120);
/// Ticks in which hair settles.
const SETTLING: u32 = 150;
/// Where the pictures are taken from: right, up and front of the head, in its own size (m).
const VIEWS: [Vec3; 4] = [
    Vec3::new(0.08, 0.02, 0.5),
    Vec3::new(0.5, 0.03, 0.08),
    Vec3::new(-0.1, 0.08, -0.52),
    Vec3::new(0.06, 0.46, 0.22),
];

/// A character that waits for its animation.
#[derive(Component)]
struct Still(Handle<Gltf>);

/// What H shows and hides.
#[derive(Component)]
struct Hat;

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
        Some(folder) => shoot(&arguments, &folder),
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
            outcome.0 = Some(Ok(worn.hair))
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
        let whole = |file: &PathBuf| {
            let path = file.canonicalize().map_err(|error| format!("{}: {error}", file.display()));
            Ok(path?.to_string_lossy().into_owned())
        };
        self.files.iter().map(whole).collect()
    }
}

/// All in a window.
fn show(arguments: &Arguments) -> Result {
    let files = arguments.files()?;
    let count = files.len().max(MIN_CHARACTERS);
    let mut app = app(arguments, false);
    for i in 0..count {
        let file = files[i % files.len()].clone();
        let (preset, aside) =
            (arguments.presets[i % arguments.presets.len()], i as f32 - 0.5 * (count - 1) as f32);
        spawn(&mut app, file, WearHair::new(preset), Transform::from_xyz(0.8 * aside, 0.0, 0.0));
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

/// Finds the hats that a character has, and makes one for a character without. They are off at first.
fn bring_hat(
    worn: On<HairWorn>,
    mut commands: Commands,
    children: Query<&Children>,
    names: Query<&Name>,
    hairs: Query<(&Transform, &ChildOf)>,
    mut meshes: ResMut<Assets<Mesh>>,
    mut materials: ResMut<Assets<StandardMaterial>>,
) -> Result {
    let is_hat = |e: &Entity| {
        names
            .get(*e)
            .is_ok_and(|name| ["Hat", "Helmet", "Hood"].iter().any(|hat| name.contains(hat)))
    };
    let own: Vec<Entity> = children.iter_descendants(worn.entity).filter(is_hat).collect();
    for hat in &own {
        commands.entity(*hat).insert((Hat, Visibility::Hidden));
    }
    if own.is_empty() {
        // Hair of the head's size, its middle at the origin.
        let (hair, on) = hairs.get(worn.hair)?;
        let felt = materials.add(StandardMaterial {
            perceptual_roughness: 0.9,
            ..Color::srgb(0.12, 0.16, 0.24).into()
        });
        let at = |y: f32| *hair * Transform::from_xyz(0.0, y, 0.01);
        let hat = commands
            .spawn((Hat, Transform::default(), Visibility::Hidden, ChildOf(on.parent())))
            .id();
        for (radius, height, y) in [(0.15, 0.008, 0.085), (0.1, 0.1, 0.13)] {
            let part = Mesh3d(meshes.add(Cylinder::new(radius, height)));
            commands.spawn((part, MeshMaterial3d(felt.clone()), at(y), ChildOf(hat)));
        }
    }
    Ok(())
}

fn put_on_hats(keys: Res<ButtonInput<KeyCode>>, mut hats: Query<&mut Visibility, With<Hat>>) {
    if keys.just_pressed(KeyCode::KeyH) {
        hats.iter_mut().for_each(|mut hat| hat.toggle_inherited_hidden());
    }
}

/// Pictures of all presets on all characters.
fn shoot(arguments: &Arguments, folder: &std::path::Path) -> Result {
    picture::folder(folder)?;
    for file in arguments.files()? {
        let mut app = app(arguments, true);
        let wear = WearHair::new(arguments.presets[0]);
        let character = spawn(&mut app, file.clone(), wear, Transform::default());
        app.add_observer(bring_hat);
        let mut images = app.world_mut().resource_mut::<Assets<Image>>();
        let surroundings = environment::studio(&mut images, 450.0);
        let camera = (Camera3d::default(), Msaa::Sample4, DepthPrepass, surroundings);
        let pictures = Pictures::new(&mut app, arguments.size, arguments.supersample, camera);
        app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
        let name =
            PathBuf::from(&file).file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mut is_lit = false;
        for preset in &arguments.presets {
            app.world_mut().resource_mut::<Outcome>().0 = None;
            app.world_mut().entity_mut(character).insert(WearHair::new(*preset));
            let hair = wait(&mut app)?;
            thin_out(&mut app, hair, arguments.strands);
            app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
            (0..SETTLING).for_each(|_| app.update());
            app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
            let head =
                app.world().get::<GlobalTransform>(hair).ok_or("the hair is gone")?.to_matrix();
            if !core::mem::replace(&mut is_lit, true) {
                environment::lights(app.world_mut(), head.x_axis.length());
            }
            let mut views = Vec::new();
            for from in VIEWS {
                // Long hair is seen whole.
                let away = if *preset == HairPreset::Long { 1.7 } else { 1.0 };
                let focus = Vec3::new(0.0, -0.035 - 0.13 * (away - 1.0), 0.0);
                let [from, to] = [from * Vec3::new(1.0, 1.0, -1.0) * away + focus, focus]
                    .map(|p| head.transform_point3(p));
                let place = Transform::from_translation(from).looking_at(to, Vec3::Y);
                let mut cameras = app.world_mut().query_filtered::<&mut Transform, With<Camera>>();
                cameras.iter_mut(app.world_mut()).for_each(|mut camera| *camera = place);
                views.push(pictures.draw(&mut app)?);
            }
            let path = folder.join(format!("{name}-{}.png", preset.name()));
            picture::save(picture::beside(&views), &path)?;
            println!("{}", path.display());
        }
    }
    Ok(())
}

/// Draws no more strands than this, wider ones.
fn thin_out(app: &mut App, hair: Entity, strands: u32) {
    let mut hair = app.world_mut().entity_mut(hair);
    let Some(mut followers) = hair.get_mut::<HairFollowers>() else { return };
    let before = followers.count;
    followers.count = before.min(strands);
    let wider = (before as f32 / followers.count.max(1) as f32).sqrt();
    if let Some(mut look) = hair.get_mut::<HairLook>() {
        look.width *= wider;
    }
}

/// Waits for the hair that is asked for.
fn wait(app: &mut App) -> Result<Entity> {
    let start = Instant::now();
    while start.elapsed() < PATIENCE {
        app.update();
        if let Some(outcome) = app.world_mut().resource_mut::<Outcome>().0.take() {
            return Ok(outcome?);
        }
        sleep(Duration::from_millis(2));
    }
    Err("no hair came within two minutes: is there a head?".into())
}
