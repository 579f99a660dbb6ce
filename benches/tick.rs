//! `cargo bench`: a table of what a tick costs in a whole app, then what a substep of a block costs,
//! with and without the length limiter, and how long a simulated second of the paper's first scene
//! takes.
//!
//! `KERATIN_BENCH_ONLY=10000x16,sleep` prints only these rows; others are `memory` and `hanging`.
//!
//! Read the ratios: all rows come from one run on one machine. Only instruction counts do not
//! depend on the load of the machine. The projection alone, gather and scatter left out, takes 43
//! to 46 of them per segment and iteration on AVX2 (29,318, 53,447 and 218,903 a substep of sixteen
//! strands of 9, 16 and 64 nodes), counted by
//!
//! ```text
//! valgrind --tool=callgrind --toggle-collect='*vectorize*' \
//!     target/release/deps/tick-… 'projection::16$' --bench --sample-count 1 --sample-size 1
//! ```

mod common;
#[path = "tick/scalar.rs"]
mod scalar;
#[path = "tick/table.rs"]
mod table;

use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{
    StretchProjection, Sweeps, WindReceived,
    base::lanes::{LANES, put4},
    prelude::*,
    solver::rod::{
        block::BlockLanes,
        direct::{self, DirectParams},
        step::{SweepParams, step},
    },
};
use divan::{Bencher, counter::ItemsCount};
use fearless_simd::Level;
use std::time::Duration;

fn main() {
    // A bench named on the command line runs alone: `cargo bench --bench tick -- projection`.
    let named = std::env::args().skip(1).any(|arg| !arg.starts_with('-'));
    if named || table::print() {
        divan::main();
    }
}

/// Sixteen strands of `nodes` nodes, each hanging a little differently.
fn block(nodes: usize) -> BlockLanes {
    let sweeps = Sweeps::default();
    let length = 0.48;
    let l = length / (nodes - 1) as f32;
    let mut block = BlockLanes::default();
    block.resize(nodes);
    for lane in 0..LANES {
        let lean = 0.02 * lane as f32;
        let along = Quat::from_rotation_x(core::f32::consts::FRAC_PI_2 + lean);
        for (i, node) in block.nodes.iter_mut().enumerate() {
            let p = along * Vec3::Z * (l * i as f32);
            for axis in 0..3 {
                node.p[axis][lane] = p[axis];
                node.from[axis][lane] = p[axis];
            }
            node.w[lane] = if i == 0 {
                0.0
            } else if i + 1 == nodes {
                2.0
            } else {
                1.0
            };
        }
        for edge in &mut block.edges {
            put4(&mut edge.q, lane, along);
            put4(&mut edge.rest, lane, Quat::IDENTITY);
            edge.l[lane] = l;
            edge.wq[lane] = sweeps.rotational_weight(0.13, l, l);
            edge.k[lane] = 0.01;
        }
        put4(&mut block.root, lane, along);
    }
    block
}

fn substep(bencher: Bencher<'_, '_>, nodes: usize, iterations: u32, limiter_steps: u32) {
    let params = SweepParams {
        dt: 1.0 / 360.0,
        iterations,
        projection: StretchProjection::Split,
        limiter_steps,
        internal_damping: 0.0,
        clearance: 0.0,
    };
    let level = Level::new();
    let mut block = block(nodes);
    // Items are segments times iterations, so that divan prints them per second.
    bencher.counter(ItemsCount::new(LANES * (nodes - 1) * iterations as usize)).bench_local(|| {
        step(level, &mut block, &params, &[]);
    });
}

/// Five iterations, without the limiter.
#[divan::bench(args = [9, 16, 64])]
fn projection(bencher: Bencher<'_, '_>, nodes: usize) {
    substep(bencher, nodes, 5, 0);
}

/// The same with one Newton step of the limiter.
#[divan::bench(args = [9, 16, 64])]
fn projection_limiter_1(bencher: Bencher<'_, '_>, nodes: usize) {
    substep(bencher, nodes, 5, 1);
}

/// The same with two, the default.
#[divan::bench(args = [9, 16, 64])]
fn projection_limiter_2(bencher: Bencher<'_, '_>, nodes: usize) {
    substep(bencher, nodes, 5, 2);
}

/// A substep of the direct solver, with its limiter.
#[divan::bench(args = [9, 16, 64])]
fn direct_step(bencher: Bencher<'_, '_>, nodes: usize) {
    let params = DirectParams {
        dt: 1.0 / 360.0,
        damping: HairStiffness::default().damping,
        torsion: HairStiffness::default().torsion,
        limiter_steps: 6,
        clearance: 0.0,
    };
    let level = Level::new();
    let mut block = block(nodes);
    block.root_from = block.root;
    block.nodes.iter_mut().for_each(|n| n.w = n.w.map(|w| if w == 0.0 { 0.0 } else { 1.0 }));
    block.nodes.iter_mut().for_each(|n| n.push[1] = [-9.8; LANES]);
    block.edges.iter_mut().for_each(|e| e.k = [1.0; LANES]);
    direct::weigh(level, &mut block, 0.13, 1.0 / 360.0);
    // Items are segments, so that divan prints them per second.
    bencher.counter(ItemsCount::new(LANES * (nodes - 1))).bench_local(|| {
        direct::step(level, &mut block, &params, &[]);
    });
}

/// A simulated second of 200 strands of 9 nodes over a floor, everything on, in a whole app: the
/// paper's first scene.
#[divan::bench(sample_count = 10, sample_size = 1)]
fn scene_1_second(bencher: Bencher<'_, '_>) {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default()))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(HairDefault(SleepSettings::never()))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    app.world_mut().resource_mut::<Time<Virtual>>().set_max_delta(Duration::MAX);
    app.world_mut().spawn((HairCollider::plane(Dir3::Y), Transform::from_xyz(0.0, -0.15, 0.0)));
    let hair = app.world_mut().spawn(Hair).id();
    for i in 0..200 {
        let root = Vec3::new((i % 10) as f32, 0.0, (i / 10) as f32) * 5e-3;
        let points: Vec<Vec3> = (0..9)
            .map(|k| root + Vec3::new(0.12, -1.0, 0.0).normalize() * 0.03 * k as f32)
            .collect();
        let strand = Strand::from_polyline(&points).expect("points are apart");
        app.world_mut().spawn((StrandOf(hair), strand, WindReceived::default()));
    }
    app.update();
    bencher.bench_local(|| {
        for _ in 0..60 {
            app.update();
        }
    });
}
