//! `cargo bench --bench frame`: what a frame of drawn hair costs on this machine's graphics device.
//!
//! A head of hair that fills a picture of 1920 × 1080, four samples a pixel, under a sun and a spot with shadow
//! maps; then a hundred heads in one picture. Hair stands still: simulating it is not in these numbers. A frame is
//! submitted and waited for, so that the processor's part is in it as well; the first row has no hair. Where
//! the device measures times, those of its passes are printed for each row. On a software device only a small row is
//! run, for a look at the code.

#[path = "../tests/common/offscreen.rs"]
mod offscreen;

use bevy::{
    core_pipeline::prepass::DepthPrepass,
    diagnostic::DiagnosticsStore,
    prelude::*,
    render::{
        diagnostic::RenderDiagnosticsPlugin,
        render_resource::PollType,
        renderer::{RenderAdapterInfo, RenderDevice},
    },
};
use bevy_keratin::prelude::*;
use offscreen::{Offscreen, head_of_guides};
use std::time::Instant;

/// What is in the picture.
struct Row {
    heads: usize,
    followers: u32,
    strands: f32,
    smoothing: f32,
    prepass: bool,
}

fn main() {
    if !offscreen::has_adapter() {
        return;
    }
    let device = info(&Offscreen::new(16, 16));
    println!(
        "{} ({:?}, {:?}), {}",
        device.name, device.device_type, device.backend, device.driver_info
    );
    let is_software = format!("{:?}", device.device_type) == "Cpu";
    let near =
        |followers| Row { heads: 1, followers, strands: 1.0, smoothing: 3.0, prepass: false };
    let rows = match is_software {
        true => vec![Row { heads: 0, ..near(0) }, near(1500)],
        false => vec![
            Row { heads: 0, ..near(0) },
            near(12_000),
            near(40_000),
            Row { prepass: true, ..near(40_000) },
            Row { smoothing: 0.0, ..near(40_000) },
            Row { strands: 0.25, ..near(40_000) },
            near(100_000),
            Row { heads: 10, ..near(12_000) },
            Row { heads: 100, ..near(12_000) },
        ],
    };
    println!("heads  followers  drawn  smoothing  prepass  ms a frame");
    for row in rows {
        time(&row, if is_software { (320, 180, 2) } else { (1920, 1080, 20) });
    }
}

fn info(scene: &Offscreen) -> RenderAdapterInfo {
    scene.app.world().resource::<RenderAdapterInfo>().clone()
}

fn time(row: &Row, (width, height, frames): (u32, u32, u32)) {
    let plugins = HairPlugins::default().build().add(RenderDiagnosticsPlugin);
    let mut scene = Offscreen::with_plugins(width, height, plugins);
    let side = (row.heads as f32).sqrt().ceil().max(1.0);
    let back = if row.heads > 1 { 0.35 * side } else { 0.5 };
    scene.look(Vec3::new(0.3 * back, 0.1, back), Vec3::new(0.0, -0.05, 0.0));
    let camera = scene.camera;
    let world = scene.app.world_mut();
    world.entity_mut(camera).insert(HairSmoothing { reach: row.smoothing, ..default() });
    if row.prepass {
        world.entity_mut(camera).insert(DepthPrepass);
    }
    for head in 0..row.heads {
        let (x, z) = (head as f32 % side, (head as f32 / side).floor());
        let place = Transform::from_xyz(0.35 * (x - 0.5 * (side - 1.0)), 0.0, -0.35 * z);
        let detail = HairDetail { strands: row.strands, ..default() };
        let hair = world.spawn((Hair, HairFollowers::new(row.followers), detail, place)).id();
        for points in head_of_guides(220, 0.09, 0.26, 16) {
            let strand = Strand::from_polyline(&points).expect("points are apart");
            world.spawn((StrandOf(hair), strand));
        }
    }
    let at = Transform::from_xyz(0.5, 0.6, 0.7).looking_at(Vec3::ZERO, Vec3::Y);
    world.spawn((SpotLight { shadow_maps_enabled: true, ..default() }, at));
    let at = Transform::from_xyz(-0.5, 0.8, 0.3).looking_at(Vec3::ZERO, Vec3::Y);
    world.spawn((DirectionalLight { shadow_maps_enabled: true, ..default() }, at));
    let frame = |scene: &mut Offscreen| {
        scene.app.update();
        let device = scene.app.world().resource::<RenderDevice>();
        // A lost device has nothing to wait for.
        let _ = device.poll(PollType::wait_indefinitely());
    };
    (0..8).for_each(|_| frame(&mut scene));
    let start = Instant::now();
    (0..frames).for_each(|_| frame(&mut scene));
    let each = start.elapsed().as_secs_f64() * 1e3 / f64::from(frames);
    let Row { heads, followers, strands, smoothing, prepass } = row;
    println!("{heads:5}  {followers:9}  {strands:5}  {smoothing:9}  {prepass:7}  {each:10.2}");
    let store = scene.app.world().resource::<DiagnosticsStore>();
    let mut passes: Vec<(String, f64)> = store
        .iter()
        .filter_map(|measured| {
            let path = measured.path().as_str().strip_suffix("/elapsed_gpu")?;
            Some((path.to_string(), measured.average()?))
        })
        .filter(|(_, time)| *time > 0.005)
        .collect();
    passes.sort_by(|a, b| b.1.total_cmp(&a.1));
    for (path, time) in passes {
        println!("         {time:8.3} ms {path}");
    }
}
