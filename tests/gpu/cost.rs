//! What hair on the device costs the CPU: to be read, on a machine of one's own.

use crate::stage::Stage;
use bevy::prelude::*;
use bevy_keratin::prelude::*;
use std::time::Instant;

/// `cargo test --release --features gpu --test gpu -- --ignored --nocapture costs_the_processor`
#[test]
#[ignore = "a measurement, to be read"]
fn what_hair_on_the_device_costs_the_processor() {
    for count in [10_000, 100_000] {
        let strand = |i: usize| {
            let root = Vec3::new((i % 300) as f32, 0.0, (i / 300) as f32) * 1e-3;
            let points: Vec<Vec3> = (0..16).map(|k| root + Vec3::Y * (0.01 * k as f32)).collect();
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
        let many = |stage: &mut Stage| {
            let mut times: Vec<f64> = (0..30).map(|_| tick(stage)).collect();
            times.sort_by(f64::total_cmp);
            times[15]
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
            "{count} strands: a tick on the CPU {cpu:.2} ms, with the hand-over {handed:.2} ms, on the device \
             {there:.3} ms, without any hair {empty:.3} ms"
        );
        drop(render);
    }
}
