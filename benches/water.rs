//! `cargo bench --bench water`: the wet-hair paper's table, a frame of 10,000 strands of 6 nodes among
//! droplets, in both strand models beside the paper's own times; and what a node's search for
//! droplets in reach costs.
//!
//! The scene is `wet` of the examples. First as the paper has it, droplets that only pull; then with the
//! film that they leave, the water that soaks in and the bonds that it opens. All are run in turns, each
//! timed frame after an untimed one of the same app, and of each the best is kept.
//!
//! Then what water costs where there is none: thirty hairs with a shower over one of them, and hair at rest in
//! damp air.

#[path = "../examples/shared/scenes/mod.rs"]
mod scenes;

use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{
    SleepCounts,
    base::grid::{BallGrid, FoundBalls},
    prelude::*,
};
use fearless_simd::Level;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};
use scenes::{Moment, Scene, SceneKind, ScenePlugin, Strewn, measure::StrainPeak};
use std::{
    hint::black_box,
    time::{Duration, Instant},
};

/// Droplets, and a frame with them in the paper's table (ms).
const PAPER: [(usize, Option<f64>); 7] = [
    (0, Some(22.4)),
    (20, Some(46.9)),
    (40, Some(57.9)),
    (60, Some(71.7)),
    (80, Some(78.0)),
    (100, Some(78.9)),
    (1000, None),
];

/// How far a droplet of the scene pulls (m).
const REACH: f32 = 0.015;

fn main() {
    // `cargo bench --bench water -- hairs` runs only thirty hairs with a shower over one of them.
    if std::env::args().any(|arg| arg == "hairs") {
        shower_row();
        return;
    }
    println!(
        "droplets | paper, GT 630, ms | rods, ms | springs, ms | rods with film and bonds, ms | \
         springs with film, ms | peak strain of each"
    );
    // `cargo bench --bench water -- 1000` runs one row.
    let named: Vec<usize> = std::env::args().filter_map(|arg| arg.parse().ok()).collect();
    for (count, paper) in PAPER {
        if !named.is_empty() && !named.contains(&count) {
            continue;
        }
        let mut apps = [("rods", 0.0), ("springs", 0.0), ("rods", 20.0), ("springs", 20.0)]
            .map(|(variant, uptake)| wet(variant, count, uptake));
        let mut best = [f64::INFINITY; 4];
        // Peak strain up to here; measuring it costs as much as several systems.
        let peaks = apps.each_mut().map(|app| app.world_mut().remove_resource::<StrainPeak>());
        for _ in 0..20 {
            for (best, app) in best.iter_mut().zip(&mut apps) {
                // Warms the caches, which the other apps have used.
                app.update();
                let start = Instant::now();
                app.update();
                *best = best.min(start.elapsed().as_secs_f64() * 1e3);
            }
        }
        let paper = paper.map_or("–".into(), |ms| ms.to_string());
        let times = best.map(|ms| format!("{ms:.2}")).join(" | ");
        let peaks = peaks.map(|peak| format!("{:.4}", peak.map_or(f32::NAN, |peak| peak.0)));
        println!("{count} | {paper} | {times} | {}", peaks.join(" "));
    }
    if !named.is_empty() {
        return;
    }
    shower_row();
    println!("\n400 strands of 12 nodes at rest, in air of a humidity | ms | asleep");
    for (humidity, ms, asleep) in at_rest([0.5, 0.51, 0.9]) {
        println!("{humidity} | {ms:.2} | {asleep}");
    }
    println!("\ndroplets, ten strands each | a node's query, ns");
    for count in [1_000, 10_000, 100_000] {
        println!("{count} | {:.1}", query(count) * 1e9);
    }
}

/// The scene half a second after its droplets have fallen; they spread at the rate `uptake` (1/s).
fn wet(variant: &str, count: usize, uptake: f32) -> App {
    let scene = Scene::new(SceneKind::Wet, Some(variant)).expect("a variant of the scene");
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default(), ScenePlugin(scene)))
        .insert_resource(Strewn { count, ..default() })
        .insert_resource(HairDefault(SleepSettings::never()))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
        // After the scene has set its own.
        .add_systems(PostStartup, move |mut wetting: ResMut<HairDefault<HairWetting>>| {
            wetting.uptake = uptake;
        });
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.finish();
    app.cleanup();
    let frames = ((Moment::STREWN + 0.5) * 60.0) as usize;
    (0..frames).for_each(|_| app.update());
    app
}

/// An app of `hairs` heads 1 m apart, each with `strands` strands of twelve nodes.
fn heads(hairs: usize, strands: usize) -> App {
    const RADIUS: f32 = 0.09;
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.finish();
    app.cleanup();
    let golden = core::f32::consts::PI * (3.0 - 5.0_f32.sqrt());
    for head in 0..hairs {
        let at = Transform::from_xyz(head as f32, 0.0, 0.0);
        let hair = app.world_mut().spawn((Hair, at)).id();
        app.world_mut().spawn((HairCollider::sphere(RADIUS).expect("a radius"), at));
        for i in 0..strands {
            let y = (i as f32 + 0.5) / strands as f32;
            let (sine, cosine) = (golden * i as f32).sin_cos();
            let across = (1.0 - y * y).sqrt();
            let normal = Vec3::new(across * cosine, y, across * sine);
            let points: Vec<Vec3> =
                (0..12).map(|k| normal * (RADIUS + 0.002 + 0.015 * k as f32)).collect();
            let strand = Strand::from_polyline(&points).expect("a strand");
            app.world_mut().spawn((StrandOf(hair), strand));
        }
    }
    app
}

/// Ticks of apps in turns: the medians (ms).
fn medians<const N: usize>(apps: &mut [App; N], ticks: usize) -> [f64; N] {
    let mut times = [const { Vec::new() }; N];
    for _ in 0..ticks {
        for (app, times) in apps.iter_mut().zip(&mut times) {
            let start = Instant::now();
            app.update();
            times.push(start.elapsed().as_secs_f64() * 1e3);
        }
    }
    times.map(|mut times| {
        times.sort_unstable_by(f64::total_cmp);
        times[times.len() / 2]
    })
}

fn shower_row() {
    println!("\n30 hairs of 100 strands, ms | with a shower over one of them, ms | ratio");
    let [dry, rain] = shower_over_one();
    println!("{dry:.2} | {rain:.2} | {:.2}", rain / dry);
}

/// A tick of thirty hairs without and with a shower over one of them (ms).
fn shower_over_one() -> [f64; 2] {
    let mut apps = [false, true].map(|rains| {
        let mut app = heads(30, 100);
        app.insert_resource(HairDefault(SleepSettings::never()));
        if rains {
            app.world_mut().spawn(Shower::rain_on(Vec3::ZERO));
        }
        (0..120).for_each(|_| app.update());
        app
    });
    medians(&mut apps, 120)
}

/// A tick of hair at rest in air of these humidities (ms), and how many strands sleep.
fn at_rest<const N: usize>(humidities: [f32; N]) -> [(f32, f64, usize); N] {
    let mut apps = humidities.map(|humidity| {
        let mut app = heads(1, 400);
        app.insert_resource(HairClimate { humidity, ..default() });
        (0..900).for_each(|_| app.update());
        app
    });
    let ms = medians(&mut apps, 120);
    core::array::from_fn(|i| {
        let mut sleepers = apps[i].world_mut().query::<&SleepCounts>();
        let asleep = sleepers.iter(apps[i].world()).map(|sleepers| sleepers.asleep).sum();
        (humidities[i], ms[i], asleep)
    })
}

/// Time per node to find the droplets in reach (s), as in the tick: sixteen neighbours share a
/// query. Strands stand 2.5 mm apart, as on a head; strands and droplets have the same density for
/// any count.
fn query(count: usize) -> f64 {
    const LENGTH: f32 = 0.24;
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let rows = ((10 * count) as f32).sqrt().ceil();
    let side = rows * 0.0025;
    let drops: Vec<Vec3> = (0..count)
        .map(|_| Vec3::from_array([side, LENGTH, side].map(|side| random.random_range(0.0..side))))
        .collect();
    // Four by four strands, level by level.
    let locks = rows as usize / 4;
    let nodes: Vec<[Vec3; 16]> = (0..locks * locks)
        .flat_map(|lock| (0..6).map(move |level| (lock / locks, level, lock % locks)))
        .map(|(x, level, z)| {
            core::array::from_fn(|k| {
                let [x, z] = [4 * x + k % 4, 4 * z + k / 4].map(|i| 0.0025 * i as f32);
                Vec3::new(x, LENGTH * level as f32 / 5.0, z)
            })
        })
        .collect();
    let mut grid = BallGrid::default();
    grid.build(drops.iter().map(|drop| (*drop, REACH)));
    let (level, mut found) = (Level::new(), FoundBalls::default());
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        let mut all = 0;
        for nodes in &nodes {
            let low = nodes.iter().copied().fold(Vec3::INFINITY, Vec3::min);
            let high = nodes.iter().copied().fold(Vec3::NEG_INFINITY, Vec3::max);
            grid.reaching(level, low, high, &mut found);
            all += found.balls.len();
        }
        black_box(all);
        best = best.min(start.elapsed().as_secs_f64());
    }
    best / (16 * nodes.len()) as f64
}
