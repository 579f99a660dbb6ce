//! What a frame of drawn hair costs in counts: what each pass shades and computes, as the device counts it. Devices in
//! hardware count fragments by blocks of 2 × 2 pixels, llvmpipe by 4 × 4: compare those of one device.

use crate::renderer;
use bevy::{
    camera::RenderTarget,
    diagnostic::DiagnosticsStore,
    prelude::*,
    render::{
        RenderApp,
        diagnostic::RenderDiagnosticsPlugin,
        render_asset::RenderAssets,
        render_resource::{PollType, TextureFormat},
        renderer::{RenderAdapterInfo, RenderDevice},
        storage::{GpuShaderBuffer, ShaderBuffer},
    },
    time::TimeUpdateStrategy,
};
use bevy_keratin::{prelude::*, render::HairBuffers};
use core::f32::consts::PI;
use serde::Serialize;
use std::collections::BTreeMap;

/// What is in the picture: heads in a square, drawn strands of each.
#[derive(Clone, Copy)]
struct Scene {
    heads: u32,
    strands: u32,
}

/// One near head by the bench's lamps, and a hundred; in software, where these take minutes, nine.
const NEAR: Scene = Scene { heads: 1, strands: 40_000 };
const MANY: Scene = Scene { heads: 100, strands: 12_000 };
const FEW: Scene = Scene { heads: 9, strands: 12_000 };
const SIZE: (u32, u32) = (1920, 1080);

/// A pass, summed over all of its kind in a frame.
#[derive(Serialize, Clone, Debug, Default)]
struct Pass {
    name: String,
    vertices: u64,
    fragments: u64,
    invocations: u64,
    /// Of the processor, to record it (ms).
    recording_ms: f64,
    /// Of the device (ms); 0 where it measures none.
    device_ms: f64,
}

#[derive(Serialize, Debug)]
struct Counts {
    heads: u32,
    strands: u32,
    width: u32,
    height: u32,
    device: String,
    is_software: bool,
    passes: Vec<Pass>,
    /// Of the hairs' buffers: what is uploaded, and what is expanded from it.
    uploaded_bytes: u64,
    expanded_bytes: u64,
}

/// Prints them.
pub fn print(json: bool, size: f32, strands: u32) -> Result {
    let scaled = |scene: Scene| {
        let share = f64::from(strands) / f64::from(NEAR.strands);
        Scene { strands: (f64::from(scene.strands) * share) as u32, ..scene }
    };
    let near = count(scaled(NEAR), size);
    let many = if near.is_software { FEW } else { MANY };
    let rows = [near, count(scaled(many), size)];
    if !json {
        rows.iter().for_each(table);
    }
    if json {
        println!("{}", serde_json::to_string(&rows)?);
    }
    Ok(())
}

fn count(scene: Scene, size: f32) -> Counts {
    let (width, height) =
        (((SIZE.0 as f32 * size) as u32).max(16), ((SIZE.1 as f32 * size) as u32).max(16));
    let mut app = renderer::app("", (0, 0), true, default());
    app.add_plugins(RenderDiagnosticsPlugin)
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(0))
        .insert_resource(GlobalAmbientLight::NONE);
    let image = Image::new_target_texture(width, height, TextureFormat::Rgba8UnormSrgb, None);
    let target = app.world_mut().resource_mut::<Assets<Image>>().add(image);
    let camera = furnish(app.world_mut(), scene, target);
    app.finish();
    app.cleanup();
    // Meshes, textures and pipelines arrive while nothing is drawn; of what is drawn then, the first is compiled.
    for frame in 0..8 {
        if let Some(mut camera) = app.world_mut().get_mut::<Camera>(camera) {
            camera.is_active = frame > 3;
        }
        app.update();
        // A lost device has nothing to wait for.
        let _ = app.world().resource::<RenderDevice>().poll(PollType::wait_indefinitely());
    }
    let passes = passes(app.world().resource::<DiagnosticsStore>());
    let info = app.world().resource::<RenderAdapterInfo>();
    let device = format!("{} ({:?})", info.name, info.backend);
    let is_software = format!("{:?}", info.device_type) == "Cpu";
    let [uploaded_bytes, expanded_bytes] = bytes(&mut app);
    let Scene { heads, strands } = scene;
    Counts {
        heads,
        strands,
        width,
        height,
        device,
        is_software,
        passes,
        uploaded_bytes,
        expanded_bytes,
    }
}

/// Heads under a sun and a spot, both with shadow maps.
fn furnish(world: &mut World, scene: Scene, target: Handle<Image>) -> Entity {
    let side = (scene.heads as f32).sqrt().ceil();
    let back = if scene.heads > 1 { 0.35 * side } else { 0.5 };
    let from = Vec3::new(0.3 * back, 0.1, back);
    let place = Transform::from_translation(from).looking_at(Vec3::new(0.0, -0.05, 0.0), Vec3::Y);
    let target = RenderTarget::Image(target.into());
    let camera = world.spawn((Camera3d::default(), Msaa::Sample4, target, place)).id();
    let at = Transform::from_xyz(0.5, 0.6, 0.7).looking_at(Vec3::ZERO, Vec3::Y);
    world.spawn((SpotLight { shadow_maps_enabled: true, ..default() }, at));
    let at = Transform::from_xyz(-0.5, 0.8, 0.3).looking_at(Vec3::ZERO, Vec3::Y);
    world.spawn((DirectionalLight { shadow_maps_enabled: true, ..default() }, at));
    for head in 0..scene.heads {
        let (x, z) = (head as f32 % side, (head as f32 / side).floor());
        let place = Transform::from_xyz(0.35 * (x - 0.5 * (side - 1.0)), 0.0, -0.35 * z);
        let hair = world.spawn((Hair, HairFollowers::new(scene.strands), place)).id();
        for line in guides() {
            if let Ok(strand) = Strand::from_polyline(&line) {
                world.spawn((StrandOf(hair), strand));
            }
        }
    }
    camera
}

/// 180 guides of 26 cm on a ball, which hang from it.
fn guides() -> impl Iterator<Item = Vec<Vec3>> {
    let golden = PI * (3.0 - 5.0_f32.sqrt());
    (0..180).map(move |i| {
        let y = 1.0 - 1.05 * (i as f32 + 0.5) / 180.0;
        let (sin, cos) = (golden * i as f32).sin_cos();
        let flat = (1.0 - y * y).max(0.0).sqrt();
        let out = Vec3::new(cos * flat, y, sin * flat);
        let aside = Vec3::new(out.x, 0.0, out.z).normalize_or(Vec3::X);
        let node = |k: usize| {
            let along = 0.26 * k as f32 / 15.0;
            // Over the ball by a quarter of its circle at most, then down.
            let turn = (along / 0.095).min(y.clamp(0.0, 1.0).acos().mul_add(-1.0, 0.5 * PI));
            let angle = y.clamp(-1.0, 1.0).acos() + turn;
            let down = along - 0.095 * turn;
            aside * (0.095 * angle.sin()) + Vec3::Y * (0.095 * angle.cos() - down)
        };
        (0..16).map(node).collect()
    })
}

/// Those of the last frame that was measured, which shade or compute something.
fn passes(store: &DiagnosticsStore) -> Vec<Pass> {
    let mut passes = BTreeMap::<String, Pass>::new();
    for measured in store.iter() {
        let path = measured.path().as_str().strip_prefix("render/");
        let Some((name, what)) = path.and_then(|path| path.rsplit_once('/')) else { continue };
        let Some(value) = measured.value() else { continue };
        let pass = passes.entry(name.to_owned()).or_default();
        pass.name = name.to_owned();
        match what {
            "vertex_shader_invocations" => pass.vertices += value as u64,
            "fragment_shader_invocations" => pass.fragments += value as u64,
            "compute_shader_invocations" => pass.invocations += value as u64,
            "elapsed_cpu" => pass.recording_ms += value,
            "elapsed_gpu" => pass.device_ms += value,
            _ => {}
        }
    }
    let works = |pass: &Pass| pass.vertices + pass.fragments + pass.invocations > 0;
    passes.into_values().filter(works).collect()
}

/// Of all hairs: what the processor uploads, and what the device expands.
fn bytes(app: &mut App) -> [u64; 2] {
    let mut hairs = app.world_mut().query::<&HairBuffers>();
    let all: Vec<HairBuffers> = hairs.iter(app.world()).cloned().collect();
    let Some(render) = app.get_sub_app(RenderApp) else { return [0; 2] };
    let Some(buffers) = render.world().get_resource::<RenderAssets<GpuShaderBuffer>>() else {
        return [0; 2];
    };
    let size = |handle: &Handle<ShaderBuffer>| {
        buffers.get(handle.id()).map_or(0, |buffer| buffer.buffer.size())
    };
    let uploaded = |of: &HairBuffers| {
        [&of.nodes, &of.guides, &of.strands, &of.frame].map(size).into_iter().sum::<u64>()
    };
    let expanded = |of: &HairBuffers| of.rings.as_ref().map_or(0, size);
    [all.iter().map(uploaded).sum(), all.iter().map(expanded).sum()]
}

fn table(row: &Counts) {
    let Counts { heads, strands, width, height, device, .. } = row;
    println!("{heads} heads of {strands} strands, {width} x {height}, four samples, {device}");
    println!(
        "{:>28} {:>12} {:>12} {:>12} {:>10} {:>10}",
        "pass", "vertices", "fragments", "invocations", "record ms", "device ms"
    );
    for pass in &row.passes {
        println!(
            "{:>28} {:>12} {:>12} {:>12} {:>10.3} {:>10.3}",
            pass.name,
            pass.vertices,
            pass.fragments,
            pass.invocations,
            pass.recording_ms,
            pass.device_ms
        );
    }
    println!(
        "uploaded {:.1} MB, expanded {:.1} MB\n",
        row.uploaded_bytes as f64 / 1e6,
        row.expanded_bytes as f64 / 1e6
    );
}
