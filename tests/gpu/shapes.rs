//! Shapes that hair takes under its weight, there and on the CPU.

use crate::{residence::grow, stage::Stage};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

pub fn a_cantilever_sags_as_on_the_processor(stage: &mut Stage) {
    // Level strands of several numbers of nodes, held at the root, of hair that bends little.
    let nodes = [5, 9, 17, 33];
    let strands = || {
        let strand = |nodes: &usize| {
            let point = |i: usize| Vec3::X * (0.12 / (nodes - 1) as f32 * i as f32);
            Strand::from_polyline(&(0..*nodes).map(point).collect::<Vec<_>>()).unwrap()
        };
        nodes.iter().map(strand).collect()
    };
    let [cpu, gpu] = [SimulateOn::Cpu, SimulateOn::Gpu].map(|on| {
        grow(stage, on, strands());
        let hair = stage.hair;
        let stiff = HairStiffness { bending_length: 0.1, ..default() };
        stage.app.world_mut().entity_mut(hair).insert((stiff, AirDrag { rate: 10.0 }));
        stage.at_once(10);
        stage.run(24);
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu);
        stage.strands()
    });
    for ((cpu, gpu), nodes) in cpu.iter().zip(&gpu).zip(nodes) {
        let sag = |strand: &Strand| -strand.positions().last().unwrap().y;
        let (cpu, gpu) = (sag(cpu), sag(gpu));
        println!("{nodes} nodes: the tip sags {cpu} m on the CPU, {gpu} m on the device");
        assert!((0.02..0.11).contains(&cpu), "{cpu}");
        assert!((gpu / cpu - 1.0).abs() < 0.01, "{gpu} m, on the CPU {cpu} m");
    }
}
