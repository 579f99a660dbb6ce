//! Every hair preset on the training head after two seconds, as pictures:
//! `cargo run --release --example presets -- [FOLDER] [PRESET …]`.

#[path = "../salon/environment.rs"]
mod environment;
#[path = "../salon/failure.rs"]
mod failure;
#[path = "../salon/mannequin.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod mannequin;
#[path = "../salon/picture.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod picture;
#[path = "../salon/renderer.rs"]
#[allow(dead_code, reason = "the salon uses all of it")]
mod renderer;

mod head;

/// What the mannequin takes from the scenes.
mod scenes {
    pub const HEAD_RADIUS: f32 = 0.1;
}

use bevy::{
    asset::RenderAssetUsages,
    core_pipeline::prepass::DepthPrepass,
    light::{CascadeShadowConfigBuilder, DirectionalLightShadowMap},
    prelude::*,
    render::render_resource::{Extent3d, TextureDimension, TextureFormat},
    time::TimeUpdateStrategy,
};
use bevy_keratin::{
    plant::{HairPreset, Planted, Scalp},
    prelude::*,
};
use clap::Parser;
use picture::Pictures;
use std::{path::PathBuf, process::ExitCode, time::Instant};

/// Seconds until hair has settled.
const SETTLING: f32 = 2.0;
/// Where the camera is (m): in front to the side, at the side, behind.
const VIEWS: [Vec3; 3] =
    [Vec3::new(0.30, 0.06, 0.62), Vec3::new(0.68, 0.05, 0.02), Vec3::new(-0.35, 0.12, -0.58)];

/// The mannequin lies; its crown is at +X and its face at +Y. This puts it upright.
fn upright() -> Transform {
    Transform::from_matrix(Mat4::from_mat3(Mat3::from_cols(Vec3::Y, Vec3::Z, Vec3::X)))
}

fn scalp() -> Scalp {
    Scalp { up: Dir3::X, front: Dir3::Y, height: 0.118, ..default() }
}

/// Draws hair presets into PNGs.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    /// The folder that the pictures go into.
    #[arg(default_value = "target/presets")]
    folder: PathBuf,
    /// straight, wavy, curly, coily, short, bob, long, fur; all if left out.
    #[arg(value_parser = preset)]
    presets: Vec<HairPreset>,
    /// Width and height of each view (pixels).
    #[arg(long, default_value = "560x640", value_name = "WxH", value_parser = renderer::size)]
    size: (u32, u32),
    /// How many times larger, along and across, pictures are drawn and averaged.
    #[arg(long, default_value = "3", value_parser = clap::value_parser!(u32).range(1..=4))]
    supersample: u32,
}

fn name(preset: HairPreset) -> String {
    format!("{preset:?}").to_lowercase()
}

fn preset(text: &str) -> Result<HairPreset, String> {
    let found = HairPreset::ALL.into_iter().find(|p| name(*p) == text.to_lowercase());
    found.ok_or_else(|| format!("expected one of {}", HairPreset::ALL.map(name).join(", ")))
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
    let Arguments { folder, presets, size, .. } = arguments;
    picture::folder(folder)?;
    for preset in HairPreset::ALL {
        if !presets.is_empty() && !presets.contains(&preset) {
            continue;
        }
        let views = draw(preset, arguments).map_err(|error| error.to_string())?;
        let path = folder.join(format!("{}.png", name(preset)));
        picture::save(beside(&views, *size), &path)?;
        println!("{}", path.display());
    }
    Ok(())
}

/// The views as one picture, from left to right.
fn beside(views: &[Image], (width, height): (u32, u32)) -> Image {
    let row = |image: &Image, y: u32| {
        let bytes = image.data.as_deref().unwrap_or_default();
        let start = (4 * y * width) as usize;
        bytes.get(start..start + 4 * width as usize).unwrap_or_default().to_vec()
    };
    let rows = (0..height).flat_map(|y| views.iter().flat_map(move |view| row(view, y)));
    let size = Extent3d { width: width * views.len() as u32, height, depth_or_array_layers: 1 };
    Image::new(
        size,
        TextureDimension::D2,
        rows.collect(),
        TextureFormat::Rgba8UnormSrgb,
        RenderAssetUsages::default(),
    )
}

fn draw(preset: HairPreset, arguments: &Arguments) -> Result<Vec<Image>> {
    let start = Instant::now();
    let mut app = app(preset);
    studio(&mut app);
    let mesh = mannequin::plain();
    let planted = preset.plant(&mesh, &scalp())?;
    let took = start.elapsed();
    let count = preset.settings().followers.count;
    let line = preset.hairline();
    let roots = preset.follower_roots(&planted, &mesh, &scalp(), &line, count, 0)?;
    let hair = wear(&mut app, preset, &planted, head::with_scalp(mesh, &scalp(), preset))?;
    app.world_mut().entity_mut(hair).insert(roots);
    let surroundings =
        environment::studio(&mut app.world_mut().resource_mut::<Assets<Image>>(), 450.0);
    let camera = (Camera3d::default(), Msaa::Sample4, DepthPrepass, surroundings);
    let pictures = Pictures::new(&mut app, arguments.size, arguments.supersample, camera);
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    let start = Instant::now();
    for _ in 0..(60.0 * SETTLING) as u32 {
        app.update();
    }
    println!(
        "{preset:?}: {} guides planted with the studio in {took:.1?}, settled in {:.1?}",
        planted.groom.len(),
        start.elapsed()
    );
    report(&mut app, hair);
    app.insert_resource(TimeUpdateStrategy::FixedTimesteps(0));
    let middle = Vec3::new(0.0, -0.05, 0.0);
    let view = |from| {
        let place = Transform::from_translation(from).looking_at(middle, Vec3::Y);
        let mut cameras = app.world_mut().query_filtered::<&mut Transform, With<Camera>>();
        cameras.iter_mut(app.world_mut()).for_each(|mut camera| *camera = place);
        Ok(pictures.draw(&mut app)?)
    };
    VIEWS.into_iter().map(view).collect()
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

/// What stands out from the hair: dark behind pale hair, pale behind dark.
fn ground(preset: HairPreset) -> Color {
    match preset.settings().look.melanin.color().luminance() {
        pale if pale > 0.1 => Color::srgb(0.13, 0.14, 0.16),
        dark if dark < 0.005 => Color::srgb(0.62, 0.63, 0.64),
        _ => Color::srgb(0.44, 0.46, 0.48),
    }
}

fn app(preset: HairPreset) -> App {
    let mut app = renderer::app("presets", (0, 0), true, default());
    app.insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(DirectionalLightShadowMap { size: 4096 })
        .insert_resource(GlobalAmbientLight::NONE)
        .insert_resource(ClearColor(ground(preset)));
    app
}

/// Key and fill from the front, two kickers at the hair's height from behind. All cast shadows, or
/// light from one side would shine through the head.
fn studio(app: &mut App) {
    let light = |at: Vec3, lux: f32, color: Color| {
        let light = DirectionalLight {
            illuminance: lux,
            color,
            shadow_maps_enabled: true,
            shadow_normal_bias: 0.6,
            shadow_depth_bias: 0.002,
            ..default()
        };
        let cascades = CascadeShadowConfigBuilder {
            num_cascades: 1,
            minimum_distance: 0.3,
            maximum_distance: 1.1,
            ..default()
        };
        let at = Transform::from_translation(at).looking_at(Vec3::ZERO, Vec3::Y);
        (light, cascades.build(), at)
    };
    let world = app.world_mut();
    world.spawn(light(Vec3::new(1.0, 1.1, 1.2), 8000.0, Color::srgb(1.0, 0.95, 0.88)));
    world.spawn(light(Vec3::new(-1.5, 0.3, 0.9), 2000.0, Color::srgb(0.8, 0.88, 1.0)));
    world.spawn(light(Vec3::new(1.0, 0.35, -1.4), 6000.0, Color::WHITE));
    world.spawn(light(Vec3::new(-1.0, 0.35, -1.4), 6000.0, Color::WHITE));
}

/// The head with the preset's hair.
fn wear(app: &mut App, preset: HairPreset, planted: &Planted, head: Mesh) -> Result<Entity> {
    let world = app.world_mut();
    let head = world.resource_mut::<Assets<Mesh>>().add(head);
    let skin = StandardMaterial { perceptual_roughness: 0.55, ..default() };
    let skin = world.resource_mut::<Assets<StandardMaterial>>().add(skin);
    world.spawn((Mesh3d(head), MeshMaterial3d(skin), upright()));
    let hair = world.spawn((Hair, upright(), preset.settings())).id();
    for strand in planted.groom.strands() {
        world.spawn((StrandOf(hair), Strand::from_polyline(strand.points)?));
    }
    for (collider, place) in head::body()? {
        world.spawn((collider, place));
    }
    Ok(hair)
}
