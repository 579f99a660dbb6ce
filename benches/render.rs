//! `cargo bench --bench render`: what drawing adds on the CPU to simulating 10,000 strands of 16 nodes.
//!
//! All rows come from one run on one machine: read the share. The rows of drawing are our own
//! systems, packing in the app and the one write in the render world; Bevy's own rendering, the
//! graphics device with all shaders, and what hands them their work, are not in it.

use bevy::{
    prelude::*,
    render::{ExtractSchedule, RenderApp, RenderPlugin},
    time::TimeUpdateStrategy,
    window::ExitCondition,
    winit::WinitPlugin,
};
use bevy_keratin::{prelude::*, render::HairRenderSystems};
use std::{
    path::Path,
    time::{Duration, Instant},
};

const STRANDS: usize = 10_000;
const NODES: usize = 16;
const FRAMES: usize = 10;

/// Start of the present measurement, and the total time measured.
#[derive(Resource, Default)]
struct Clock(Option<Instant>, Duration);

fn begin(mut clock: ResMut<Clock>) {
    clock.0 = Some(Instant::now());
}

fn end(mut clock: ResMut<Clock>) {
    if let Some(start) = clock.0.take() {
        clock.1 += start.elapsed();
    }
}

/// The tick's clock, beside that of packing.
#[derive(Resource, Default)]
struct TickClock(Option<Instant>, Duration);

fn begin_tick(mut clock: ResMut<TickClock>) {
    clock.0 = Some(Instant::now());
}

fn end_tick(mut clock: ResMut<TickClock>) {
    if let Some(start) = clock.0.take() {
        clock.1 += start.elapsed();
    }
}

fn app() -> App {
    let window =
        WindowPlugin { primary_window: None, exit_condition: ExitCondition::DontExit, ..default() };
    let mut app = App::new();
    app.add_plugins((
        DefaultPlugins
            .set(window)
            .set(RenderPlugin { synchronous_pipeline_compilation: true, ..default() })
            .set(bevy::log::LogPlugin { filter: "error".into(), ..default() })
            .disable::<WinitPlugin>()
            .disable::<bevy::render::pipelined_rendering::PipelinedRenderingPlugin>(),
        HairPlugins::default(),
    ))
    .insert_resource(Time::<Fixed>::from_hz(60.0))
    .insert_resource(HairDefault(SleepSettings::never()))
    .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
    .init_resource::<Clock>()
    .init_resource::<TickClock>()
    .add_systems(
        PostUpdate,
        (begin.after(HairTicks).before(HairRenderSystems), end.after(HairRenderSystems)),
    )
    .add_systems(PostUpdate, begin_tick.before(HairTicks))
    .add_systems(PostUpdate, end_tick.after(HairTicks));
    if let Some(render) = app.get_sub_app_mut(RenderApp) {
        render.init_resource::<Clock>().add_systems(
            ExtractSchedule,
            (begin.before(HairRenderSystems), end.after(HairRenderSystems)),
        );
    }
    let world = app.world_mut();
    let hair = world.spawn((Hair, HairFollowers::none())).id();
    for i in 0..STRANDS {
        let root = Vec3::new((i % 100) as f32, 0.0, (i / 100) as f32) * 2e-3;
        let direction = Vec3::new(0.12, -1.0, 0.0).normalize() * 0.02;
        let points: Vec<Vec3> = (0..NODES).map(|k| root + direction * k as f32).collect();
        let strand = Strand::from_polyline(&points).expect("points are apart");
        world.spawn((StrandOf(hair), strand));
    }
    // It ticks and is packed and written; no camera draws it.
    app.finish();
    app.cleanup();
    app
}

fn main() {
    let drivers = Path::new("/usr/share/vulkan/icd.d");
    let named = std::env::var_os("VK_ICD_FILENAMES").or(std::env::var_os("VK_DRIVER_FILES"));
    if cfg!(target_os = "linux") && named.is_none() && !drivers.exists() {
        println!("skipped: no graphics driver; mesa-vulkan-drivers draws in software");
        return;
    }
    println!(
        "{STRANDS} strands of {NODES} nodes, {FRAMES} frames of one tick at 60 Hz, ms a frame"
    );
    for (contact, what) in [(StrandContact::default(), "with"), (no_contact(), "without")] {
        row(contact, what);
    }
}

/// Without strand contact, where the tick is cheapest.
fn no_contact() -> StrandContact {
    StrandContact { radius: 0.0, ..default() }
}

fn row(contact: StrandContact, what: &str) {
    let mut app = app();
    app.insert_resource(HairDefault(contact));
    for _ in 0..5 {
        app.update();
    }
    app.world_mut().insert_resource(Clock::default());
    app.world_mut().insert_resource(TickClock::default());
    app.sub_app_mut(RenderApp).world_mut().insert_resource(Clock::default());
    for _ in 0..FRAMES {
        app.update();
    }
    let ms = |total: Duration| total.as_secs_f64() * 1e3 / FRAMES as f64;
    let tick = ms(app.world().resource::<TickClock>().1);
    let pack = ms(app.world().resource::<Clock>().1);
    let upload = ms(app.sub_app(RenderApp).world().resource::<Clock>().1);
    let share = 100.0 * (pack + upload) / tick;
    println!(
        "  {what} contact: tick {tick:.1}, packing {pack:.2}, upload {upload:.2}: {share:.1} %"
    );
}
