//! `cargo bench --bench convergence`: what accuracy a substep, an iteration and a Newton step of
//! the limiter add. Each row runs the same hair with another solver; time and error stand side by
//! side, so that settings of equal cost can be compared.
//!
//! Of the ways to solve a strand this compares: the direct solver at several substeps, Gauss–Seidel
//! sweeps from root to tip in all three projections, the same time spent on more substeps with fewer
//! sweeps, and with or without the direct tridiagonal solve of the lengths (`limiter`).
//!
//! A quiet run on a 2-core x86-64 server machine with AVX-512:
//!
//! ```text
//! substeps (× iterations, limiter) | ms a second | sag of 8; 32 segments over theory | strain of 64
//!                     direct     1 |  58         | 1.012; 0.998                      | 0.0098
//!                     direct     2 |  74         | 1.012; 0.998                      | 0.0005
//!                     direct     3 |  82         | 1.012; 0.998                      | 0.0005
//!                     direct     4 |  96         | 1.012; 0.998                      | 0.0004
//!                     direct     6 | 139         | 1.012; 0.998                      | 0.0001
//!                     direct    12 | 253         | 1.012; 0.998                      | 0.0000
//!                   split  6 × 5, 2 | 147        | 1.061; 1.485                      | 0.0008
//!                   split  6 × 5, 0 | 135        | 1.061; 1.491                      | 0.4523
//!                 coupled  6 × 5, 2 | 138        | 1.061; 1.485                      | 0.0008
//!                 printed  6 × 5, 0 | 161        | 0.544; 0.982                      | 0.5300
//!                   split 3 × 10, 2 | 104        | 1.155; 2.014                      | 1.4588
//!                   split 10 × 3, 2 | 209        | 1.036; 1.283                      | 0.0000
//!                   split 30 × 1, 1 | 457        | 1.018; 1.088                      | 0.0000
//!                   split 6 × 20, 2 | 274        | 1.043; 1.132                      | 0.0000
//!                   split 12 × 5, 2 | 267        | 1.024; 1.116                      | 0.0000
//! ```
//!
//! So the direct solver is accurate at any number of substeps: two or three serve as well as six.
//! Sweeps are less accurate at many times its cost and need six. Their length limiter removes the
//! strain at a cost below the noise; the coupled projection has the cost and error of the split
//! one, the printed one sags half as much as theory in coarse segments.

use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{Cuticle, SolverMethod, StretchProjection, Sweeps, prelude::*};
use core::f32::consts::TAU;
use std::time::{Duration, Instant};

/// Length of the cantilever (m), its gravity-bending length, and beam theory's sag.
const LENGTH: f32 = 0.24;
const BENDING_LENGTH: f32 = 0.3;

fn main() {
    use StretchProjection::*;
    println!(
        "projection | substeps × iterations | limiter | a second of 1,000 × 16, ms | \
         sag of 8; 32 segments over theory | strain of 64 segments shaken"
    );
    for substeps in [1, 2, 3, 4, 6, 12] {
        let solver = HairSolver { substep: 1e-6, ..default() };
        let app = || app(solver, Sweeps::default(), substeps);
        println!(
            "direct | {substeps} | | {:.1} | {:.3}; {:.3} | {:.4}",
            cost(app()) * 1e3,
            sag(app(), 8),
            sag(app(), 32),
            shaken(app()),
        );
    }
    for (projection, substeps, iterations, limiter_steps) in [
        (Split, 6, 5, 2),
        (Split, 6, 5, 1),
        (Split, 6, 5, 0),
        (Coupled, 6, 5, 2),
        (Coupled, 6, 5, 0),
        (Printed, 6, 5, 0),
        (Split, 3, 10, 2),
        (Split, 2, 15, 2),
        (Split, 10, 3, 2),
        (Split, 15, 2, 1),
        (Split, 15, 2, 0),
        (Split, 30, 1, 1),
        (Split, 30, 1, 0),
        (Split, 6, 10, 2),
        (Split, 6, 20, 2),
        (Split, 12, 5, 2),
    ] {
        let sweeps = Sweeps { projection, iterations, limiter_steps, ..default() };
        let solver = HairSolver { method: SolverMethod::Sweeps, ..default() };
        let app = || app(solver, sweeps, substeps);
        println!(
            "{projection:?} | {substeps} × {iterations} | {limiter_steps} | {:.1} | {:.3}; {:.3} | {:.4}",
            cost(app()) * 1e3,
            sag(app(), 8),
            sag(app(), 32),
            shaken(app()),
        );
    }
}

fn app(solver: HairSolver, sweeps: Sweeps, substeps: u32) -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        .insert_resource(HairSubsteps::Fixed(substeps))
        .insert_resource(HairDefault(solver))
        .insert_resource(HairDefault(sweeps))
        .insert_resource(HairDefault(Cuticle { damage: 0.0, ..default() }))
        .insert_resource(HairDefault(StrandContact { strength: 0.0, ..default() }));
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app
}

fn line(direction: Vec3, length: f32, segments: usize) -> Strand {
    let points: Vec<Vec3> =
        (0..=segments).map(|i| direction * (length * i as f32 / segments as f32)).collect();
    Strand::from_polyline(&points).expect("points are apart")
}

/// Wall-clock seconds per simulated second: ten times the best of ten tenths.
fn cost(mut app: App) -> f64 {
    let hair = app.world_mut().spawn(Hair).id();
    let strands = vec![(StrandOf(hair), line(Vec3::X, LENGTH, 15)); 1000];
    app.world_mut().spawn_batch(strands);
    (0..6).for_each(|_| app.update());
    let mut best = f64::INFINITY;
    for _ in 0..10 {
        let start = Instant::now();
        (0..6).for_each(|_| app.update());
        best = best.min(start.elapsed().as_secs_f64());
    }
    best * 10.0
}

/// The settled sag of a cantilever relative to beam theory's.
fn sag(mut app: App, segments: usize) -> f32 {
    app.insert_resource(HairDefault(AirDrag { rate: 8.0 })).insert_resource(HairDefault(
        HairStiffness::from_bending_length(BENDING_LENGTH).expect("a length"),
    ));
    let hair = app.world_mut().spawn(Hair).id();
    let strand = app.world_mut().spawn((StrandOf(hair), line(Vec3::X, LENGTH, segments))).id();
    (0..60 * 30).for_each(|_| app.update());
    let strand = app.world().get::<Strand>(strand).expect("a strand");
    let tip = strand.positions()[segments];
    -tip.y / (LENGTH.powi(4) / (8.0 * BENDING_LENGTH.powi(3)))
}

/// The largest strain of a 48 cm strand whose root oscillates by ±10 cm at 3 Hz.
fn shaken(mut app: App) -> f32 {
    let hair = app.world_mut().spawn(Hair).id();
    let strand = app.world_mut().spawn((StrandOf(hair), line(Vec3::NEG_Y, 0.48, 64))).id();
    let mut peak = 0.0_f32;
    for frame in 0..300 {
        let x = 0.1 * (TAU * 3.0 * frame as f32 / 60.0).sin();
        app.world_mut().get_mut::<Transform>(hair).expect("a hair").translation.x = x;
        app.update();
        peak = peak.max(app.world().get::<Strand>(strand).expect("a strand").peak_strain());
    }
    peak
}
