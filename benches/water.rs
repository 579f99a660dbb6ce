//! `cargo bench --bench water`: the wet-hair paper's table, a frame of 10,000 strands of 6 nodes among
//! droplets, in both strand models beside the paper's own times; and what it costs a node to ask who
//! pulls at it.
//!
//! The scene is `wet` of the examples, which looks for the largest strain after every substep; that is
//! counted. Both models are run in turns and of each the best is kept.

#[path = "../examples/scenes/mod.rs"]
mod scenes;

use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{grid::UniformGrid, prelude::*};
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
    println!("droplets | paper, GT 630, ms | rods, ms | springs, ms | peak strain of each");
    // `cargo bench --bench water -- 1000` runs one row.
    let named: Vec<usize> = std::env::args().filter_map(|arg| arg.parse().ok()).collect();
    for (count, paper) in PAPER {
        if !named.is_empty() && !named.contains(&count) {
            continue;
        }
        let mut apps = ["rods", "springs"].map(|variant| wet(variant, count));
        let mut best = [f64::INFINITY; 2];
        for _ in 0..20 {
            for (best, app) in best.iter_mut().zip(&mut apps) {
                let start = Instant::now();
                app.update();
                *best = best.min(start.elapsed().as_secs_f64() * 1e3);
            }
        }
        let paper = paper.map_or("–".into(), |ms| ms.to_string());
        let [a, b] = apps.map(|app| app.world().resource::<StrainPeak>().0);
        println!("{count} | {paper} | {:.2} | {:.2} | {a:.4} {b:.4}", best[0], best[1]);
    }
    if !named.is_empty() {
        return;
    }
    println!("\ndroplets, ten strands each | a query, strands side by side, ns | in any order, ns");
    for count in [1_000, 10_000, 100_000] {
        let [beside, anywhere] = [true, false].map(|beside| query(count, beside) * 1e9);
        println!("{count} | {beside:.1} | {anywhere:.1}");
    }
}

/// The scene half a second after its droplets have fallen.
fn wet(variant: &str, count: usize) -> App {
    let scene = Scene::new(SceneKind::Wet, Some(variant)).expect("a variant of the scene");
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default(), ScenePlugin(scene)))
        .insert_resource(Strewn { count, ..default() })
        .insert_resource(HairDefault(HairSleep::never()))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.finish();
    app.cleanup();
    let frames = ((Moment::STREWN + 0.5) * 60.0) as usize;
    (0..frames).for_each(|_| app.update());
    app
}

/// Seconds that a node takes to visit the droplets that pull at it, as strands do. The strands' order tells what the processor's
/// caches do to it: a groom's neighbours are mostly spawned one after the other. Both droplets and
/// strands are equally dense, however many there are.
fn query(count: usize, beside: bool) -> f64 {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
    let side = 0.4 * (count as f32 / 1000.0).cbrt();
    let mut place = || Vec3::from_array([0.0; 3].map(|_: f32| random.random_range(0.0..side)));
    let drops: Vec<Vec3> = (0..count).map(|_| place()).collect();
    let mut roots: Vec<Vec3> = (0..10 * count).map(|_| place()).collect();
    if beside {
        // Tuft by tuft, and within it strand by strand.
        roots.sort_by_key(|p| [0.12, 2.0 * REACH].map(|side| (*p / side).as_ivec3().to_array()));
    }
    let nodes: Vec<Vec3> = (roots.iter())
        .flat_map(|root| (0..6).map(move |i| root + Vec3::NEG_Y * (0.048 * i as f32)))
        .collect();
    let mut grid = UniformGrid::default();
    grid.build_sparse(2.002 * REACH, drops.iter().zip(0..).map(|(drop, i)| (*drop, i)));
    let sorted: Vec<Vec3> = grid.order().map(|i| drops[i as usize]).collect();
    let mut best = f64::INFINITY;
    for _ in 0..5 {
        let start = Instant::now();
        let mut pull = Vec3::ZERO;
        for node in &nodes {
            for run in grid.runs_near(*node, REACH).each() {
                for drop in &sorted[run] {
                    let offset = drop - *node;
                    if offset.length_squared() < REACH * REACH {
                        pull += offset;
                    }
                }
            }
        }
        black_box(pull);
        best = best.min(start.elapsed().as_secs_f64());
    }
    best / nodes.len() as f64
}
