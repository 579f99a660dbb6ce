//! The pictures that the README shows: loops and sheets, each from the same seed, camera and light.
//!
//! `cargo run --release --example gallery` makes all of them in `assets/`. Loops are assembled by
//! `img2webp` of libwebp (Debian's `webp`); without it their frames stay where they were drawn.

#[path = "../shared/body.rs"]
mod body;
#[path = "../shared/bust.rs"]
#[allow(dead_code, reason = "the presets use all of it")]
mod bust;
#[path = "../shared/dressed.rs"]
mod dressed;
#[path = "../shared/environment.rs"]
mod environment;
#[path = "../shared/failure.rs"]
mod failure;
#[path = "../shared/figure.rs"]
#[allow(dead_code, reason = "the character uses all of it")]
mod figure;
#[path = "../shared/head.rs"]
mod head;
#[path = "../shared/mannequin.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod mannequin;
#[path = "../shared/orbit.rs"]
mod orbit;
#[path = "../shared/picture.rs"]
mod picture;
#[path = "../shared/renderer.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod renderer;
#[path = "../shared/scenes/mod.rs"]
mod scenes;
#[path = "../shared/set.rs"]
mod set;
#[path = "../shared/skeleton.rs"]
mod skeleton;
#[path = "../shared/solid.rs"]
mod solid;
#[path = "../shared/stage.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod stage;
#[path = "../shared/studio.rs"]
mod studio;

mod counts;
mod export;
mod loops;
mod sheets;

use bevy::{light::DirectionalLightShadowMap, prelude::*};
use clap::{Parser, ValueEnum};
use std::{
    io,
    path::{Path, PathBuf},
    process::{Command, ExitCode},
};

/// What there is to be seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Piece {
    /// Three heads of hair beside each other.
    Hero,
    /// A rod is wound, lotion, the rod is taken out.
    Perm,
    /// Slept on wet, beside hair that was dry.
    Bedhead,
    /// A blower dries hair in the shape it has there, beside the same head wet.
    BlowDry,
    /// Rain on long hair.
    Rain,
    /// A head is shaken.
    Shake,
    /// A figure walks in the wind.
    Walk,
    /// Dry and wet, untreated and permed, natural and its bonds.
    Before,
    /// Pigment across, water down.
    Melanin,
    /// All presets, from in front and from behind.
    Presets,
    /// One picture with fewer and more samples.
    Quality,
    /// One curl that hangs as a hook, and as a ringlet where twist is cheap.
    Ringlet,
    /// The figure without hair, as binary glTF: `figure.glb`.
    Figure,
}

/// Draws the README's pictures.
#[derive(Parser)]
#[command(version)]
pub struct Arguments {
    /// Which; all if left out.
    #[arg(value_enum)]
    pieces: Vec<Piece>,
    /// The folder that they go into.
    #[arg(long, default_value = "assets", value_name = "DIR")]
    out: PathBuf,
    /// The folder of the loops' frames.
    #[arg(long, default_value = "target/gallery", value_name = "DIR")]
    frames: PathBuf,
    /// The most frames of a loop: it shows the same in fewer, farther apart. With 1 everything is drawn
    /// once and nothing waits for hair to settle.
    #[arg(long, default_value = "1000", value_parser = clap::value_parser!(u32).range(1..))]
    most: u32,
    /// Height of loops, of each picture of a sheet, and the width that goes with it, in pixels for a
    /// size of 1.
    #[arg(long, default_value = "1.0", value_parser = size)]
    size: f32,
    /// Drawn strands of a head of 40,000, of others in proportion. Fewer are drawn wider.
    #[arg(long, default_value = "40000", value_parser = clap::value_parser!(u32).range(100..))]
    strands: u32,
    /// Draws no picture, but counts what each pass of a frame shades and computes: for one near head, and for a hundred.
    /// `--size` and `--strands` make it less.
    #[arg(long)]
    counts: bool,
    /// Counts as JSON.
    #[arg(long, requires = "counts")]
    json: bool,
    /// How many times larger, along and across, pictures are drawn and averaged.
    #[arg(long, default_value = "2", value_parser = clap::value_parser!(u32).range(1..=4))]
    supersample: u32,
}

fn size(text: &str) -> Result<f32, String> {
    let size = text.parse().ok().filter(|size| (0.1..=4.0).contains(size));
    size.ok_or_else(|| "expected a number from 0.1 to 4".into())
}

impl Arguments {
    /// A picture's width and height (pixels).
    fn scaled(&self, width: u32, height: u32) -> (u32, u32) {
        let scaled = |side: u32| ((side as f32 * self.size).round() as u32).max(16);
        (scaled(width), scaled(height))
    }

    /// Draws no more strands than asked for, and shadows no finer than the picture.
    fn thin_out(&self, app: &mut App) {
        let fine = (1024.0 * self.size * self.supersample as f32) as usize;
        let size = fine.next_power_of_two().clamp(1024, 4096);
        app.insert_resource(DirectionalLightShadowMap { size });
        bust::thin_out(app, self.strands);
    }

    /// Writes a still.
    fn save(&self, picture: Image, name: &str) -> io::Result<()> {
        let path = self.out.join(format!("{name}.png"));
        picture::save(picture, &path)?;
        println!("{}", path.display());
        Ok(())
    }
}

fn main() -> ExitCode {
    let arguments = Arguments::parse();
    failure::explain_known();
    if arguments.counts {
        return match counts::print(arguments.json, arguments.size, arguments.strands) {
            Ok(()) => ExitCode::SUCCESS,
            Err(error) => {
                eprintln!("error: {error}");
                ExitCode::FAILURE
            }
        };
    }
    let all = Piece::value_variants().to_vec();
    let pieces = if arguments.pieces.is_empty() { all } else { arguments.pieces.clone() };
    for piece in pieces {
        if let Err(error) = make(piece, &arguments) {
            eprintln!("error: {error}");
            return ExitCode::FAILURE;
        }
    }
    ExitCode::SUCCESS
}

fn make(piece: Piece, arguments: &Arguments) -> Result {
    picture::folder(&arguments.out)?;
    let name = match piece.to_possible_value() {
        Some(value) => value.get_name().to_owned(),
        None => return Ok(()),
    };
    let film: fn(&Arguments, loops::Shown) -> Result<loops::Reel> = match piece {
        Piece::Perm => loops::perm,
        Piece::Bedhead => loops::bedhead,
        Piece::BlowDry => loops::blow_dry,
        Piece::Rain => loops::rain,
        Piece::Shake => loops::shake,
        Piece::Walk => loops::walk,
        Piece::Hero => return sheets::hero(arguments),
        Piece::Before => return sheets::before(arguments),
        Piece::Melanin => return sheets::melanin(arguments),
        Piece::Presets => return sheets::presets(arguments),
        Piece::Quality => return sheets::quality(arguments),
        Piece::Ringlet => return sheets::ringlet(arguments),
        Piece::Figure => {
            let mesh = head::with_scalp(body::mesh_of(0.0036, 0.0105), &figure::scalp(), default());
            return export::write(&mesh, &arguments.out.join("figure.glb"));
        }
    };
    let folder = arguments.frames.join(&name);
    picture::folder(&folder)?;
    let mut paths = Vec::new();
    // Each as it is drawn: whoever stops it keeps what there is.
    let reel = film(arguments, &mut |picture| {
        let path = folder.join(format!("{:04}.png", paths.len()));
        picture::save(picture, &path)?;
        paths.push(path);
        Ok(())
    })?;
    assemble(&paths, reel, &arguments.out.join(format!("{name}.webp")))?;
    Ok(())
}

/// One animated WebP of the frames, if there is a program for it.
fn assemble(frames: &[PathBuf], reel: loops::Reel, to: &Path) -> io::Result<()> {
    let (each, rest) = (reel.milliseconds.to_string(), reel.last.to_string());
    let mut command = Command::new("img2webp");
    command.args(["-loop", "0", "-min_size"]);
    for (i, frame) in frames.iter().enumerate() {
        let shown = if i + 1 == frames.len() { &rest } else { &each };
        command.args(["-lossy", "-q", "88", "-m", "6", "-d", shown]).arg(frame);
    }
    match command.arg("-o").arg(to).output() {
        Ok(output) if output.status.success() => println!("{}", to.display()),
        Ok(output) => return Err(io::Error::other(String::from_utf8_lossy(&output.stderr))),
        Err(_) => {
            let place = frames.first().and_then(|frame| frame.parent()).unwrap_or(to);
            println!("{}: no img2webp to assemble them", place.display());
        }
    }
    Ok(())
}
