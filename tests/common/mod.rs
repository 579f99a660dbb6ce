//! A headless app as the tests want it: no window, exactly one fixed tick per update.
#![allow(dead_code, reason = "each test binary uses its own part")]

use bevy::{
    mesh::{Mesh, skinning::SkinnedMeshInverseBindposes},
    prelude::*,
    time::TimeUpdateStrategy,
    transform::TransformPlugin,
};
use bevy_keratin::{FaultKind, prelude::*};
use std::{
    thread::sleep,
    time::{Duration, Instant},
};

/// An app with the plugin at `hertz`, warmed up.
pub fn test_app(hertz: f64) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()))
        .insert_resource(Time::<Fixed>::from_hz(hertz))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    ready(&mut app);
    app.update();
    app
}

/// An app with meshes, 60 ticks a second and frames of their own.
pub fn app_with_meshes(fps: f64) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, TransformPlugin, AssetPlugin::default()))
        .init_asset::<Mesh>()
        .init_asset::<SkinnedMeshInverseBindposes>()
        .add_plugins(HairPlugins::default())
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(1.0 / fps)));
    ready(&mut app);
    app
}

/// An app of the test's own, whose faults are kept.
pub fn ready(app: &mut App) {
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.init_resource::<Reported>().add_systems(Last, listen);
    app.finish();
    app.cleanup();
}

/// Runs for `seconds` of simulated time.
pub fn run(app: &mut App, seconds: f64) {
    let dt = app.world().resource::<Time<Fixed>>().timestep().as_secs_f64();
    for _ in 0..(seconds / dt).round() as usize {
        app.update();
    }
}

/// Updates until there is something, which other threads work on: for as long as two minutes, since these may have to
/// wait for those of other tests.
pub fn wait_for<T>(app: &mut App, mut found: impl FnMut(&mut App) -> Option<T>) -> T {
    let start = Instant::now();
    while start.elapsed() < Duration::from_secs(120) {
        app.update();
        if let Some(found) = found(app) {
            return found;
        }
        sleep(Duration::from_millis(2));
    }
    panic!("it did not happen in two minutes");
}

/// The papers' hair, which resists twist as much as bending: what buckles in a plane stays in it.
pub fn equally_stiff() -> HairStiffness {
    HairStiffness { torsion: 1.0, ..default() }
}

/// A hair with one straight strand of `length` along `direction`, in `segments`.
pub fn one_strand(
    app: &mut App,
    length: f32,
    segments: usize,
    direction: Vec3,
) -> (Entity, Entity) {
    let hair = app.world_mut().spawn(Hair).id();
    let points: Vec<Vec3> =
        (0..=segments).map(|i| direction * (length * i as f32 / segments as f32)).collect();
    let strand = Strand::from_polyline(&points).unwrap();
    let strand = app.world_mut().spawn((StrandOf(hair), strand)).id();
    (hair, strand)
}

pub fn strand(app: &App, entity: Entity) -> &Strand {
    app.world().get::<Strand>(entity).unwrap()
}

/// Root mean square speed (m/s) of a strand's free nodes.
pub fn rms_speed(strand: &Strand) -> f32 {
    let v = &strand.velocities()[1..];
    (v.iter().map(|v| v.length_squared()).sum::<f32>() / v.len() as f32).sqrt()
}

pub fn settle(app: &mut App, entity: Entity, limit: f64) {
    let mut t = 0.0;
    loop {
        run(app, 0.5);
        t += 0.5;
        if rms_speed(strand(app, entity)) < 1e-3 {
            return;
        }
        assert!(t < limit, "still moving at {} m/s", rms_speed(strand(app, entity)));
    }
}

pub fn no_gravity(app: &mut App) {
    app.insert_resource(HairGravity(Vec3::ZERO));
}

#[derive(Resource, Default)]
struct Reported(Vec<HairFault>);

fn listen(mut messages: MessageReader<HairFault>, mut reported: ResMut<Reported>) {
    reported.0.extend(messages.read().cloned());
}

/// The faults reported since the last call.
pub fn faults(app: &mut App) -> Vec<HairFault> {
    core::mem::take(&mut app.world_mut().resource_mut::<Reported>().0)
}

/// Their kinds.
pub fn fault_kinds(app: &mut App) -> Vec<FaultKind> {
    faults(app).into_iter().map(|fault| fault.kind).collect()
}
