//! Runs a scene without a window and prints what it came to.
//!
//! `cargo run --release --example headless -- --scene perm --variant treated --json`
//!
//! `swing` is no scene of a paper: a single strand is let go, to be held against the theory of rods.
//! `-- --scene swing --length 0.2 --bending-length 0.13 --segments 16 --from level --json`

#[path = "../shared/characters.rs"]
mod characters;
#[path = "../shared/gltf.rs"]
mod gltf;
#[path = "../shared/rods/mod.rs"]
mod rods;
#[path = "../shared/rows.rs"]
mod rows;
#[path = "../shared/scenes/mod.rs"]
mod scenes;
#[path = "../shared/worlds/mod.rs"]
mod worlds;

#[cfg(feature = "gpu")]
mod device;
mod plots;
mod replay;
mod report;
mod swing;
mod trace;

use bevy::{
    app::{TaskPoolOptions, TaskPoolPlugin, TaskPoolThreadAssignmentPolicy},
    prelude::*,
    time::TimeUpdateStrategy,
};
use bevy_keratin::{SolverMethod, prelude::*};
use clap::{ArgMatches, CommandFactory, FromArgMatches, Parser, parser::ValueSource};
use indicatif::{ProgressBar, ProgressStyle};
use report::Report;
use scenes::{Director, Scene, SceneKind, ScenePlugin, Strewn, UnknownName, measure};
use serde::Serialize;
use std::{
    fs::File,
    io::{self, Write},
    path::{Path, PathBuf},
    process::ExitCode,
    str::FromStr,
    time::{Duration, Instant},
};

/// What can be shown: the scenes, and a single strand.
#[derive(Clone, Copy, PartialEq)]
enum Show {
    Scene(SceneKind),
    Swing,
    Worlds,
    Rods,
    Characters,
    Replay,
}

impl FromStr for Show {
    type Err = String;
    fn from_str(name: &str) -> Result<Self, String> {
        match name {
            "swing" => Ok(Self::Swing),
            "worlds" => Ok(Self::Worlds),
            "rods" => Ok(Self::Rods),
            "characters" => Ok(Self::Characters),
            "replay" => Ok(Self::Replay),
            _ => name
                .parse()
                .map(Self::Scene)
                .map_err(|e: UnknownName| format!("{e}, swing, worlds, rods, characters, replay")),
        }
    }
}

/// Runs a scene of the paper without a window.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// Which scene: bedhead, blow-dry, perm, wet, shower; swing, a single strand; or, as figures against
    /// what they should be, worlds, what games do to a world, rods, strands against closed forms, and
    /// characters, hair on glTF files; replay, a run of random inputs that is logged, or played back from its log.
    #[arg(long)]
    scene: Show,
    /// The files of `characters`; the project's own figure if left out.
    #[arg(value_name = "FILE.glb")]
    files: Vec<PathBuf>,
    /// Which variant of it; the full treatment, `treated` or `rods`, if left out. bedhead: never-wet,
    /// never-dried; blow-dry: no-drying, uniform; perm: water-set, cut-only, untreated; wet: springs;
    /// shower: never-wet, dried-free, two-hairs (side by side).
    #[arg(long)]
    variant: Option<String>,
    /// How long the story runs (s) before it is measured; the paper's length if left out.
    #[arg(long)]
    seconds: Option<f32>,
    /// How many droplets the scene `wet` strews.
    #[arg(long, default_value_t = Strewn::default().count)]
    droplets: usize,
    /// One JSON object instead of a table.
    #[arg(long)]
    json: bool,
    /// Writes a line a frame to this file.
    #[arg(long, value_name = "FILE")]
    csv: Option<PathBuf>,
    /// Threads that solve strands; Bevy's own choice if left out.
    #[arg(long, value_parser = clap::value_parser!(u16).range(1..=256))]
    threads: Option<u16>,
    /// What solves rods: `direct`, or `sweeps`, the paper's projections.
    #[arg(long, value_parser = solver)]
    solver: Option<SolverMethod>,
    /// Simulates on the graphics device, a software one too (feature gpu); without contact between
    /// strands.
    #[arg(long)]
    gpu: bool,
    /// Leaves contact between strands out, as --gpu does.
    #[arg(long)]
    no_contact: bool,
    /// Draws the figures of `rods` on theory's curves into this folder, as SVG.
    #[arg(long, value_name = "DIR")]
    plots: Option<PathBuf>,
    #[command(flatten)]
    swing: swing::Options,
    #[command(flatten)]
    replay: replay::Replay,
}

fn solver(name: &str) -> Result<SolverMethod, String> {
    match name {
        "direct" => Ok(SolverMethod::Direct),
        "sweeps" => Ok(SolverMethod::Sweeps),
        _ => Err("there are direct and sweeps".into()),
    }
}

fn main() -> ExitCode {
    let given = Arguments::command().get_matches();
    let arguments = Arguments::from_arg_matches(&given).unwrap_or_else(|error| error.exit());
    match useful(&given, arguments.scene).and_then(|()| run(&arguments)) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Whether the scene has a use for all that was given.
fn useful(given: &ArgMatches, scene: Show) -> Result<(), Box<dyn std::error::Error>> {
    let takes: &[&str] = match scene {
        Show::Scene(_) => {
            &["variant", "seconds", "droplets", "csv", "threads", "solver", "gpu", "no_contact"]
        }
        Show::Swing => &["length", "bending_length", "segments", "from", "substeps"],
        Show::Worlds => &[],
        Show::Rods => &["plots"],
        Show::Characters => &["files"],
        Show::Replay => &["seconds", "threads", "seed", "write", "read"],
    };
    let command = Arguments::command();
    let is_useless = |id: &str| {
        let is_given = given.value_source(id) == Some(ValueSource::CommandLine);
        is_given && !["scene", "json"].contains(&id) && !takes.contains(&id)
    };
    let useless = command.get_arguments().find(|argument| is_useless(argument.get_id().as_str()));
    let Some(useless) = useless else { return Ok(()) };
    let name = |of: &str| match of {
        "files" => "FILE.glb".to_owned(),
        _ => format!("--{}", of.replace('_', "-")),
    };
    let takes: Vec<String> = takes.iter().chain(&["json"]).map(|id| name(id)).collect();
    let (useless, takes) = (name(useless.get_id().as_str()), takes.join(", "));
    Err(format!("{useless} is not for this scene, which takes {takes}").into())
}

/// Prints how hair sits on characters.
fn characters(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let own = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/figure.glb");
    let files = if arguments.files.is_empty() { vec![own] } else { arguments.files.clone() };
    if let Some(missing) = files.iter().find(|file| !file.is_file()) {
        return Err(format!("{} is no file: name a .glb", missing.display()).into());
    }
    table(characters::rows(&files), arguments.json)
}

fn rods(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let rows = rods::rows();
    if let Some(folder) = &arguments.plots {
        plots::write(&rows, folder)?;
    }
    table(rows, arguments.json)
}

/// Prints rows; an error where one is outside of its tolerance.
fn table(rows: Vec<rows::Row>, json: bool) -> Result<(), Box<dyn std::error::Error>> {
    let table = rows::Rows { rows };
    if json {
        println!("{}", serde_json::to_string(&table)?);
    } else {
        for row in &table.rows {
            let rows::Row { test, expected, got, tolerance, within, .. } = row;
            let mark = if *within { "" } else { "  <- outside" };
            let of = match (row.gamma, row.segments) {
                (Some(gamma), Some(segments)) => format!(", {gamma:.4}, {segments} segments"),
                _ => String::new(),
            };
            println!("{test}{of}: {got:.4} for {expected:.4} ± {tolerance:.4}{mark}");
        }
    }
    match table.rows.iter().filter(|row| !row.within).count() {
        0 => Ok(()),
        some => Err(format!("{some} figures are outside of their tolerance").into()),
    }
}

fn run(arguments: &Arguments) -> Result<(), Box<dyn std::error::Error>> {
    let kind = match arguments.scene {
        Show::Scene(kind) => kind,
        Show::Swing => return print(&arguments.swing.run()?, arguments.json),
        Show::Worlds => return table(worlds::rows(), arguments.json),
        Show::Rods => return rods(arguments),
        Show::Characters => return characters(arguments),
        Show::Replay => {
            let pools = pools(arguments.threads);
            return arguments.replay.run(arguments.seconds, pools, arguments.json);
        }
    };
    let scene = Scene::new(kind, arguments.variant.as_deref())?;
    let seconds = arguments.seconds.unwrap_or(scene.kind.frames() as f32 / 60.0);
    let frames = (seconds * 60.0).round() as u64;
    // What is not a number has no frames.
    if frames < 1 || seconds > 1e5 {
        let expected = "expected 0.017, which is one frame, to 100000";
        return Err(format!("--seconds is {seconds}, {expected}").into());
    }
    if arguments.gpu && cfg!(not(feature = "gpu")) {
        return Err("--gpu needs --features gpu".into());
    }
    let mut csv = arguments.csv.as_deref().map(Table::create).transpose()?;
    let mut app = headless_app(scene, arguments, Strewn { count: arguments.droplets, ..default() });
    if arguments.gpu || arguments.no_contact {
        app.world_mut().resource_mut::<HairDefault<StrandContact>>().strength = 0.0;
    }
    if let Some(method) = arguments.solver {
        app.world_mut().resource_mut::<HairDefault<HairSolver>>().method = method;
    }
    let bar = ProgressBar::new(frames)
        .with_style(ProgressStyle::with_template("{msg} {bar:40} {pos}/{len} frames, {eta} left")?);
    bar.set_message(format!("{} {}", scene.kind.name(), scene.variant));
    let start = Instant::now();
    for _ in 0..frames {
        app.update();
        if let Some(table) = &mut csv {
            present(&mut app);
            table.line(&frame_line(app.world_mut()))?;
        }
        bar.inc(1);
    }
    let wall = start.elapsed();
    present(&mut app);
    let mut report = Report::new(app.world_mut(), scene, frames, wall);
    // Where nothing was held there is nothing to keep.
    if !app.world().resource::<Director>().held.is_empty() {
        bar.set_message("settling");
        app.world_mut().resource_mut::<Director>().ended = true;
        settle(&mut app);
        report.hanging(app.world_mut());
        app.insert_resource(HairGravity(Vec3::ZERO));
        settle(&mut app);
        report.weightless(app.world_mut());
    }
    bar.finish_and_clear();
    #[cfg(feature = "gpu")]
    if arguments.gpu {
        let ticks = app.world().resource::<device::Ticks>();
        ticks.check()?;
        report.on_device(ticks.on_gpu, device::adapter(app.world()));
    }
    print(&report, arguments.json)
}

/// A file with a line a frame, of which each is written whole: who interrupts keeps the frames until then.
struct Table<'a> {
    path: &'a Path,
    file: File,
}

impl<'a> Table<'a> {
    fn create(path: &'a Path) -> Result<Self, String> {
        let file = File::create(path).map_err(|error| Self::unwritable(path, &error))?;
        let mut table = Self { path, file };
        table.line("seconds,kept,b_hydrogen_mean,strain_peak,tip_x,tip_y,tip_z")?;
        Ok(table)
    }

    fn line(&mut self, line: &str) -> Result<(), String> {
        let line = format!("{line}\n");
        self.file.write_all(line.as_bytes()).map_err(|error| Self::unwritable(self.path, &error))
    }

    fn unwritable(path: &Path, error: &io::Error) -> String {
        let path = path.display();
        format!("--csv {path} cannot be written: {error}; name a file that can be")
    }
}

/// One JSON object, or lines of name and value.
fn print(report: &impl Serialize, json: bool) -> Result<(), Box<dyn std::error::Error>> {
    let value = serde_json::to_value(report)?;
    if json {
        println!("{}", serde_json::to_string(report)?);
    } else {
        for (name, value) in value.as_object().into_iter().flatten() {
            println!("{name:26} {value}");
        }
    }
    Ok(())
}

/// The present state into the strands, wherever hair is simulated.
fn present(app: &mut App) {
    #[cfg(feature = "gpu")]
    device::fetch(app.world_mut());
    let _ = app;
}

/// So many threads that solve strands. That which runs the app does, too, next to those of the pool.
fn pools(threads: Option<u16>) -> TaskPoolOptions {
    let mut pools = TaskPoolOptions::default();
    if let Some(threads) = threads {
        let count = usize::from(threads - 1);
        pools.compute = TaskPoolThreadAssignmentPolicy {
            min_threads: count,
            max_threads: count,
            percent: 1.0,
            on_thread_spawn: None,
            on_thread_destroy: None,
        };
    }
    pools
}

/// Exactly one tick an update, on as many threads as asked for.
fn headless_app(scene: Scene, arguments: &Arguments, droplets: Strewn) -> App {
    let pools = pools(arguments.threads);
    let mut app = App::new();
    if arguments.gpu {
        #[cfg(feature = "gpu")]
        device::plugins(&mut app, pools);
    } else {
        let bevy = MinimalPlugins.set(TaskPoolPlugin { task_pool_options: pools });
        app.add_plugins((bevy, HairPlugins::default()));
    }
    app.add_plugins(ScenePlugin(scene))
        .insert_resource(droplets)
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.finish();
    app.cleanup();
    app.update();
    app
}

/// Lets the hair come to rest, with more drag than air has, for at most half a minute.
fn settle(app: &mut App) {
    let drag = **app.world().resource::<HairDefault<AirDrag>>();
    app.insert_resource(HairDefault(AirDrag { rate: 6.0 }));
    for _ in 0..60 {
        for _ in 0..30 {
            app.update();
        }
        present(app);
        let mut strands = app.world_mut().query::<&Strand>();
        let (sum, n) = strands
            .iter(app.world())
            .flat_map(Strand::velocities)
            .fold((0.0, 0), |(s, n), v| (s + v.length_squared() as f64, n + 1));
        if (sum / n as f64).sqrt() < 1e-4 {
            break;
        }
    }
    app.insert_resource(HairDefault(drag));
}

fn frame_line(world: &mut World) -> String {
    let director = world.resource::<Director>().clone();
    let kept = measure::kept_now(&director, world.query::<&Strand>().iter(world));
    let (_, hydrogen, _) = measure::hydrogen(world.query::<&Bonds>().iter(world));
    let tip = report::tip_mean(world);
    let strain = world.resource::<measure::StrainPeak>().0;
    let seconds = world.resource::<Director>().seconds;
    format!("{seconds},{kept},{hydrogen},{strain},{},{},{}", tip[0], tip[1], tip[2])
}
