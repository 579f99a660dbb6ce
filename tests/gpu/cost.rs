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

/// How long `work` takes (ms).
fn timed(work: impl FnOnce()) -> f64 {
    let start = Instant::now();
    work();
    1e3 * start.elapsed().as_secs_f64()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// A look at each node of these strands: what the tick would cost the CPU at least, did it read them.
fn read_all(world: &mut World, strands: &mut QueryState<&Strand>) -> Vec3 {
    strands.iter(world).flat_map(Strand::positions).sum()
}

pub fn a_hundred_thousand_strands_cost_less_than_a_look_at_them() {
    // A device that plays one binds 128 MiB, which 100,000 strands of 16 nodes exceed.
    let mut full = prepared(SimulateOn::Gpu, straight(100_000, 9));
    let mut empty = prepared(SimulateOn::Cpu, Vec::new());
    assert!(full.is_on_gpu());
    let hair = full.hair;
    let mut strands = full.app.world_mut().query::<&Strand>();
    let (mut more, mut look) = (Vec::new(), Vec::new());
    // In turn: whatever else the machine does disturbs all three, and a tick of a millisecond is compared with its
    // neighbour, not with the best of all.
    for _ in 0..300 {
        let with = timed(|| full.run(1));
        more.push(with - timed(|| empty.run(1)));
        look.push(timed(|| {
            std::hint::black_box(read_all(full.app.world_mut(), &mut strands));
        }));
        full.app.world_mut().get_mut::<GpuJournal>(hair).unwrap().records.clear();
    }
    let (more, look) = (median(more), median(look));
    println!(
        "100,000 strands on the device add {more:.3} ms to a tick; a look at them takes {look:.3} ms"
    );
    assert!(more < 0.5 * look, "{more} ms for {look}");
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
