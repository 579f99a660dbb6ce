//! Every hair preset on the training head after two seconds, as pictures:
//! `cargo run --release --example presets -- [FOLDER] [PRESET …]`.

#[path = "../salon/dressed.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod dressed;
#[path = "../salon/environment.rs"]
mod environment;
#[path = "../salon/failure.rs"]
mod failure;
#[path = "../salon/mannequin.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod mannequin;
#[path = "../salon/picture.rs"]
mod picture;
#[path = "../salon/renderer.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod renderer;

mod bust;
mod head;

/// What the mannequin takes from the scenes.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{authoring::plant::HairPreset, prelude::*};
use clap::Parser;
use picture::Pictures;
use std::{path::PathBuf, process::ExitCode, time::Instant};

/// Where the camera is and what it looks at (m): in front to the side, at the side, behind, and near the
/// face.
const VIEWS: [(&str, Vec3, Vec3); 4] = [
    ("front", Vec3::new(0.32, 0.05, 0.70), Vec3::new(0.0, -0.05, 0.0)),
    ("side", Vec3::new(0.76, 0.04, 0.05), Vec3::new(0.0, -0.05, 0.0)),
    ("back", Vec3::new(-0.36, 0.12, -0.66), Vec3::new(0.0, -0.05, 0.0)),
    ("close", Vec3::new(0.20, 0.04, 0.36), Vec3::new(0.012, 0.022, 0.05)),
];

/// Draws hair presets into PNGs.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// The folder that the pictures go into.
    #[arg(default_value = "target/presets")]
    folder: PathBuf,
    /// straight, wavy, curly, coily, short, bob, long, fringe, undercut, pixie, locs, beard, fur; all
    /// if left out.
    #[arg(value_parser = preset)]
    presets: Vec<HairPreset>,
    /// Which views: front, side, back, close.
    #[arg(long, default_value = "front,side,back", value_delimiter = ',', value_parser = view)]
    views: Vec<usize>,
    /// Width and height of each view (pixels).
    #[arg(long, default_value = "480x560", value_name = "WxH", value_parser = renderer::size)]
    size: (u32, u32),
    /// How many times larger, along and across, pictures are drawn and averaged.
    #[arg(long, default_value = "3", value_parser = clap::value_parser!(u32).range(1..=4))]
    supersample: u32,
    /// Drawn strands of a head of 40,000, of others in proportion. Fewer are drawn wider.
    #[arg(long, default_value = "40000", value_parser = clap::value_parser!(u32).range(100..))]
    strands: u32,
}

fn name(preset: HairPreset) -> String {
    format!("{preset:?}").to_lowercase()
}

fn preset(text: &str) -> Result<HairPreset, String> {
    let found = HairPreset::ALL.into_iter().find(|p| name(*p) == text.to_lowercase());
    found.ok_or_else(|| format!("expected one of {}", HairPreset::ALL.map(name).join(", ")))
}

fn view(text: &str) -> Result<usize, String> {
    let names = VIEWS.map(|(name, ..)| name);
    let found = names.iter().position(|name| *name == text);
    found.ok_or_else(|| format!("expected one of {}", names.join(", ")))
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
    let Arguments { folder, presets, .. } = arguments;
    picture::folder(folder)?;
    for preset in HairPreset::ALL {
        if !presets.is_empty() && !presets.contains(&preset) {
            continue;
        }
        let views = draw(preset, arguments).map_err(|error| error.to_string())?;
        let path = folder.join(format!("{}.png", name(preset)));
        picture::save(picture::beside(&views), &path)?;
        println!("{}", path.display());
    }
    Ok(())
}

fn draw(preset: HairPreset, arguments: &Arguments) -> Result<Vec<Image>> {
    let start = Instant::now();
    let mut app = bust::app("presets", bust::ground(preset));
    bust::light(&mut app);
    bust::thin_out(&mut app, arguments.strands);
    let bust = bust::wear(&mut app, preset)?;
    let took = start.elapsed();
    let camera = bust::camera(&mut app);
    let pictures = Pictures::new(&mut app, arguments.size, arguments.supersample, camera);
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    let start = Instant::now();
    for _ in 0..(60.0 * bust::SETTLING) as u32 {
        app.update();
    }
    println!(
        "{preset:?}: {} guides planted with the studio in {took:.1?}, settled in {:.1?}",
        bust.guides,
        start.elapsed()
    );
    report(&mut app, bust.hair);
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
    let view = |i: &usize| {
        let (_, from, to) = VIEWS[*i];
        bust::look(&mut app, from, to);
        Ok(pictures.draw(&mut app)?)
    };
    arguments.views.iter().map(view).collect()
}

/// How well strands have kept their length and stayed off the head.
fn report(app: &mut App, hair: Entity) {
    let world = app.world_mut();
    let mut strands = world.query::<(&Strand, &StrandOf)>();
    let (mut strain, mut speed, mut inside) = (0.0f32, 0.0f32, 0.0f32);
    for (strand, _) in strands.iter(world).filter(|(_, of)| of.0 == hair) {
        strain = strain.max(strand.peak_strain());
        speed = strand.velocities().iter().map(|v| v.length()).fold(speed, f32::max);
        let depth = |p: &Vec3| -mannequin::head(*p);
        inside = strand.positions()[1..].iter().map(depth).fold(inside, f32::max);
    }
    println!("  strain {strain:.3}, speed {speed:.3} m/s, deepest {:.1} mm", inside * 1e3);
}
