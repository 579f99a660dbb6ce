//! The render world in a thread of its own, one frame behind, as games have it.

use crate::{
    offscreen::{Offscreen, pipelined, windowless},
    residence::on_gpu,
    stage::{Stage, curls},
};
use bevy::prelude::*;
use bevy_keratin::{gpu::HairResidence, prelude::*};

pub fn hair_on_the_device_has_the_same_bits_with_pipelined_rendering() {
    let mut bits = Vec::new();
    for plugins in [windowless, pipelined] {
        let mut stage = Stage::with_plugins(plugins, SimulateOn::Cpu, Vec::new());
        stage.compile();
        on_gpu(&mut stage, 40, 20);
        // Requests are answered while frames are encoded.
        stage.app.insert_resource(HairGpu { software: true, ..default() });
        let entity = stage.hair;
        stage.app.world_mut().trigger(CaptureHairdo { entity });
        stage.run(20);
        assert_eq!(stage.residence(), HairResidence::Gpu);
        bits.push(stage.bits());
    }
    assert!(bits[0] == bits[1], "the two differ");
}

pub fn hair_is_drawn_alike_with_pipelined_rendering() {
    let draw = |mut scene: Offscreen| {
        scene.look(Vec3::new(0.0, 0.05, 0.4), Vec3::ZERO);
        let world = scene.app.world_mut();
        let hair = Stage::spawn_in(world, SimulateOn::Cpu, curls(60, 7));
        world.entity_mut(hair).insert(HairFollowers::new(300));
        world.spawn((DirectionalLight::default(), Transform::default()));
        scene.ticking(1);
        (0..20).for_each(|_| scene.app.update());
        scene.ticking(0);
        scene.draw()
    };
    let plain = draw(Offscreen::new(96, 96));
    let threaded = draw(Offscreen::pipelined(96, 96));
    assert!(plain.covered([0; 3]) > 500, "{} pixels", plain.covered([0; 3]));
    assert!(plain == threaded, "the two differ");
}
