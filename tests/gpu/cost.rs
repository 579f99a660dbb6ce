//! What hair on the device costs the CPU beside recording and submission.

use crate::stage::Stage;
use bevy::prelude::*;
use bevy_keratin::{gpu::GpuJournal, prelude::*};
use std::time::Instant;

/// Straight strands, root by root a millimetre apart.
fn straight(count: usize, nodes: usize) -> Vec<Strand> {
    let strand = |i: usize| {
        let root = Vec3::new((i % 300) as f32, 0.0, (i / 300) as f32) * 1e-3;
        let points: Vec<Vec3> = (0..nodes).map(|k| root + Vec3::Y * (0.01 * k as f32)).collect();
        Strand::from_polyline(&points).unwrap()
    };
    (0..count).map(strand).collect()
}

/// An app with these strands, and nothing that runs what they are given to do on the device: software would take
/// minutes.
fn prepared(on: SimulateOn, strands: Vec<Strand>) -> Stage {
    let mut stage = Stage::new(SimulateOn::Cpu, Vec::new());
    stage.compile();
    stage.app.world_mut().resource_mut::<HairGpu>().checkpoint = 0.0;
    stage.app.remove_sub_app(bevy::render::RenderApp);
    if !strands.is_empty() {
        stage.hair = Stage::spawn(&mut stage.app, on, strands);
    }
    stage.run(2);
    stage
}

/// How long a tick takes (ms).
fn tick(stage: &mut Stage) -> f64 {
    let start = Instant::now();
    stage.run(1);
    1e3 * start.elapsed().as_secs_f64()
}

/// What a tick takes that nothing else on the machine disturbs.
fn undisturbed(times: &[f64]) -> f64 {
    times.iter().copied().fold(f64::INFINITY, f64::min)
}

pub fn a_hundred_thousand_strands_cost_a_tenth_of_a_millisecond() {
    // A device that plays one binds 128 MiB, which 100,000 strands of 16 nodes exceed.
    let mut full = prepared(SimulateOn::Gpu, straight(100_000, 9));
    let mut empty = prepared(SimulateOn::Cpu, Vec::new());
    assert!(full.is_on_gpu());
    let hair = full.hair;
    let (mut with, mut without) = (Vec::new(), Vec::new());
    // In turn, so that whatever else the machine does disturbs both.
    for _ in 0..300 {
        with.push(tick(&mut full));
        without.push(tick(&mut empty));
        full.app.world_mut().get_mut::<GpuJournal>(hair).unwrap().records.clear();
    }
    let (with, without) = (undisturbed(&with), undisturbed(&without));
    println!("a tick of 100,000 strands on the device {with:.3} ms, of none {without:.3} ms");
    let most = if cfg!(debug_assertions) { 0.3 } else { 0.1 };
    assert!(with - without < most, "{} ms", with - without);
    // And still a write to any of them is found, if not in the same tick. Nobody brings the hair back here.
    full.app.world_mut().resource_mut::<HairGpu>().blocking = false;
    let strand = full.members()[77_777];
    full.app.world_mut().get_mut::<Strand>(strand).unwrap().velocities_mut()[3] = Vec3::X;
    let found = (1..=7).find(|_| {
        full.run(1);
        !full.is_on_gpu()
    });
    assert!(found.is_some(), "100,000 strands in seven times 16,384");
}
