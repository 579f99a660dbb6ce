//! What hair on the device costs the CPU: to be read, on a machine of one's own.

use crate::stage::Stage;
use bevy::prelude::*;
use bevy_keratin::prelude::*;
use std::time::Instant;

const TICKS: usize = 200;

/// What this process has had of the processors (ms), where the system tells.
fn processor() -> f64 {
    let stat = std::fs::read_to_string("/proc/self/stat").unwrap_or_default();
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let jiffies = after_name.split_whitespace().skip(11).take(2);
    jiffies.filter_map(|n| n.parse::<f64>().ok()).sum::<f64>() * 10.0
}

/// `cargo test --release --features gpu --test gpu -- --ignored --nocapture costs_the_processor`
#[test]
#[ignore = "a measurement, to be read"]
fn what_hair_on_the_device_costs_the_processor() {
    // A device that plays one binds 128 MiB, which 100,000 strands of 16 nodes exceed.
    for (count, nodes) in [(10_000, 16), (100_000, 9)] {
        let strand = |i: usize| {
            let root = Vec3::new((i % 300) as f32, 0.0, (i / 300) as f32) * 1e-3;
            let points: Vec<Vec3> =
                (0..nodes).map(|k| root + Vec3::Y * (0.01 * k as f32)).collect();
            Strand::from_polyline(&points).unwrap()
        };
        let strands: Vec<Strand> = (0..count).map(strand).collect();
        let Some(mut stage) = Stage::new(SimulateOn::Cpu, Vec::new()) else { return };
        stage.compile();
        stage.app.world_mut().resource_mut::<HairGpu>().checkpoint = 0.0;
        // Nothing is run on the device: software would take minutes.
        let render = stage.app.remove_sub_app(bevy::render::RenderApp);
        let tick = |stage: &mut Stage| {
            let start = Instant::now();
            stage.run(1);
            1e3 * start.elapsed().as_secs_f64()
        };
        // The middle one, and the processor's time of all of them.
        let many = |stage: &mut Stage| {
            let before = processor();
            let mut times: Vec<f64> = (0..TICKS).map(|_| tick(stage)).collect();
            times.sort_by(f64::total_cmp);
            (times[TICKS / 2], (processor() - before) / TICKS as f64)
        };
        let empty = many(&mut stage);
        stage.hair = Stage::spawn(&mut stage.app, SimulateOn::Cpu, strands);
        (0..3).for_each(|_| stage.run(1));
        let hair = stage.hair;
        let cpu = tick(&mut stage);
        stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Gpu);
        let handed = tick(&mut stage);
        assert!(stage.is_on_gpu());
        let there = many(&mut stage);
        println!(
            "{count} strands of {nodes} nodes: a tick on the CPU {cpu:.2} ms, with the hand-over {handed:.2} ms; \
             on the device {:.3} ms, {:.3} of all threads; without any hair {:.3} ms, {:.3}",
            there.0, there.1, empty.0, empty.1,
        );
        drop(render);
    }
}
