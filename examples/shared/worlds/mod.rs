//! What games do to a world rather than to hair, measured: frames, jumps, vehicles, scale, copies.

mod air;
#[cfg(all(feature = "groom", feature = "save"))]
mod copies;
mod frames;
mod jumps;
#[cfg(all(feature = "groom", feature = "save"))]
mod scenes;
mod shapes;
#[path = "../wearer.rs"]
pub mod wearer;

pub use air::{far_rain, gusts, scales, vehicles};
#[cfg(all(feature = "groom", feature = "save"))]
pub use copies::{copies, edits, roots};
pub use frames::{RIDES, frames, rates, reparented, riders};
pub use jumps::{hitches, portals, returns, shifts, wet_jumps};
#[cfg(all(feature = "groom", feature = "save"))]
pub use scenes::scenes;
pub use shapes::{hidden, solids, squashed};

use super::rows::Row;
#[cfg(all(feature = "groom", feature = "save"))]
use bevy::asset::io::{AssetSourceBuilder, AssetSourceId, memory::MemoryAssetReader};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::prelude::*;
use std::time::Duration;

/// Radius of a head (m).
const HEAD: f32 = 0.09;

/// One tick a frame.
fn app(hertz: f64) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()))
        .insert_resource(Time::<Fixed>::from_hz(hertz))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .add_plugins(TransformPlugin);
    ready(&mut app);
    app.update();
    app
}

/// With meshes, 60 frames and ticks a second.
#[cfg(all(feature = "groom", feature = "save"))]
fn app_with_meshes() -> App {
    let mut app = App::new();
    let frame = Duration::from_secs_f64(1.0 / 60.0);
    let files = scenes::Files::default();
    let root = files.0.clone();
    let memory =
        AssetSourceBuilder::new(move || Box::new(MemoryAssetReader { root: root.clone() }));
    app.register_asset_source(AssetSourceId::Default, memory)
        .insert_resource(files)
        .add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default()))
        .add_plugins(bevy::world_serialization::WorldSerializationPlugin)
        .init_asset::<Mesh>()
        .init_asset::<bevy::mesh::skinning::SkinnedMeshInverseBindposes>()
        .add_plugins(HairPlugins::default())
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::ManualDuration(frame));
    ready(&mut app);
    app
}

/// How many faults were reported.
#[derive(Resource, Default)]
struct Faults(usize);

fn ready(app: &mut App) {
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.init_resource::<Faults>().add_systems(
        Last,
        |mut reported: MessageReader<HairFault>, mut faults: ResMut<Faults>| {
            faults.0 += reported.read().count();
        },
    );
    app.finish();
    app.cleanup();
}

fn fault_count(app: &App) -> f32 {
    app.world().resource::<Faults>().0 as f32
}

/// Runs for some seconds.
fn run(app: &mut App, seconds: f64) {
    let tick = app.world().resource::<Time<Fixed>>().timestep().as_secs_f64();
    for _ in 0..(seconds / tick).round() as usize {
        app.update();
    }
}

/// A strand of 30 cm that hangs from its own frame.
fn one_strand(app: &mut App) -> (Entity, Entity) {
    strand_along(app, 0.3, 12, Vec3::NEG_Y)
}

/// A straight strand of some length (m) and segments, from its own frame.
fn strand_along(app: &mut App, length: f32, segments: usize, way: Vec3) -> (Entity, Entity) {
    let points: Vec<Vec3> =
        (0..=segments).map(|i| way * (length * i as f32 / segments as f32)).collect();
    let hair = app.world_mut().spawn(Hair).id();
    let strand = Strand::from_polyline(&points).unwrap_or_default();
    (hair, app.world_mut().spawn((StrandOf(hair), strand)).id())
}

/// A head with strands all over its upper half, settled.
fn head(app: &mut App, strands: usize) -> Entity {
    let place = Transform::from_xyz(0.0, 1.6, 0.0);
    let ball = HairCollider::sphere(HEAD).unwrap_or_default();
    let head = app.world_mut().spawn((ball, place)).id();
    let hair = app.world_mut().spawn((Hair, ChildOf(head))).id();
    for i in 0..strands {
        let y = (i as f32 + 0.5) / strands as f32;
        let across = (1.0 - y * y).sqrt();
        let (sine, cosine) = (2.4 * i as f32).sin_cos();
        let normal = Vec3::new(across * cosine, y, across * sine);
        let points: Vec<Vec3> =
            (0..10).map(|k| normal * (HEAD + 0.002 + 0.025 * k as f32)).collect();
        let strand = Strand::from_polyline(&points).unwrap_or_default();
        app.world_mut().spawn((StrandOf(hair), strand));
    }
    for _ in 0..240 {
        app.update();
    }
    head
}

fn strand(app: &App, id: Entity) -> Strand {
    app.world().get::<Strand>(id).cloned().unwrap_or_default()
}

fn strands_of(app: &App, hair: Entity) -> Vec<Strand> {
    let members = app.world().get::<Strands>(hair).map_or(Vec::new(), |all| all.iter().collect());
    members.into_iter().map(|id| strand(app, id)).collect()
}

fn all(app: &mut App) -> Vec<Strand> {
    app.world_mut().query::<&Strand>().iter(app.world()).cloned().collect()
}

fn place_mut(app: &mut App, id: Entity, change: impl FnOnce(&mut Transform)) {
    if let Some(mut place) = app.world_mut().get_mut::<Transform>(id) {
        change(&mut place);
    }
}

/// The angle of a strand's chord to straight down (°).
fn lean(strand: &Strand) -> f32 {
    let p = strand.positions();
    (p[p.len() - 1] - p[0]).angle_between(Vec3::NEG_Y).to_degrees()
}

/// The longest way between nodes of two equal strands (m).
fn apart(a: &[Vec3], b: &[Vec3]) -> f32 {
    if a.len() != b.len() {
        return f32::INFINITY;
    }
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

/// All rows.
pub fn rows() -> Vec<Row> {
    let mut rows = [
        // A minute of frames that lose ticks; longer rides end where f32 no longer resolves their speed.
        frames(&RIDES, 20.0),
        reparented(),
        rates(),
        riders(),
        returns(),
        portals(),
        hitches(),
        shifts(),
        wet_jumps(),
        vehicles(),
        scales(),
        hidden(),
        squashed(),
        solids(),
        gusts(),
        far_rain(),
    ]
    .concat();
    #[cfg(all(feature = "groom", feature = "save"))]
    rows.extend([roots(), copies(), scenes(), edits()].concat());
    rows
}
