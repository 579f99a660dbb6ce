//! The papers' scenes keep there what they keep on the CPU.

use crate::{
    scenes::{self, Director, Moment, Scene, SceneKind, ScenePlugin, Treated, measure},
    stage::{Stage, free},
};
use bevy::{ecs::system::RunSystemOnce, prelude::*};
use bevy_keratin::{WindReceived, gpu::fetch_strands, prelude::*};

/// One of so many strands is left. Without contact they do not know of each other.
const ONE_OF: usize = 8;

/// Ticks a frame.
const AT_ONCE: u32 = 6;

/// When the held shape is looked at, just before it is let go (s).
fn end(kind: SceneKind) -> f32 {
    match kind {
        SceneKind::Perm => Moment::RELEASED,
        _ => Moment::LIFTED,
    }
}

/// The scene reads strands when it lets go of them.
fn fetch_before_the_end(world: &mut World) {
    let seconds = world.resource::<Director>().seconds;
    let left = end(world.resource::<Scene>().kind) - seconds;
    if (0.0..0.05).contains(&left) {
        let mut hairs = world.query_filtered::<Entity, With<Treated>>();
        let hairs: Vec<Entity> = hairs.iter(world).collect();
        hairs.into_iter().for_each(|hair| _ = fetch_strands(world, hair));
    }
}

fn set_the_stage(stage: &mut Stage, scene: Scene, on: SimulateOn) {
    let world = stage.app.world_mut();
    world.insert_resource(scene);
    world.run_system_once(scenes::clear).unwrap();
    world.run_system_once(scenes::spawn_scene).unwrap();
    world.insert_resource(HairDefault(free()));
    let mut treated = world.query_filtered::<Entity, With<Treated>>();
    stage.hair = treated.single(world).unwrap();
    world.entity_mut(stage.hair).insert(on);
    for (i, strand) in stage.members().into_iter().enumerate() {
        let mut strand = stage.app.world_mut().entity_mut(strand);
        match i % ONE_OF {
            // Counting the wind that it receives is not supported there.
            0 => _ = strand.remove::<WindReceived>(),
            _ => strand.despawn(),
        }
    }
}

/// Lets it come to rest without gravity, in air that brakes.
fn settle(stage: &mut Stage) -> Vec<Strand> {
    stage.app.world_mut().resource_mut::<Director>().ended = true;
    stage.app.insert_resource(HairGravity(Vec3::ZERO));
    stage.app.insert_resource(HairDefault(AirDrag { rate: 6.0 }));
    for _ in 0..60 {
        stage.run(30 / AT_ONCE as usize);
        let strands = stage.strands();
        let speeds = || strands.iter().flat_map(|strand| strand.velocities());
        let square: f32 = speeds().map(|v| v.length_squared()).sum();
        if (square / speeds().count() as f32).sqrt() < 1e-4 {
            return strands;
        }
    }
    panic!("it does not come to rest");
}

/// The shares of the held shape that bonds alone rest in, and that are there without gravity.
fn kept(stage: &mut Stage, kind: SceneKind, on: SimulateOn) -> [f64; 2] {
    set_the_stage(stage, Scene::new(kind, None).unwrap(), on);
    stage.at_once(AT_ONCE);
    for _ in 0..kind.frames() / AT_ONCE {
        stage.run(1);
        assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu, "{:?}", stage.residence());
    }
    let strands = settle(stage);
    assert!(strands.iter().all(Strand::is_finite) && stage.faults().is_empty());
    assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu, "{:?}", stage.residence());
    let held = stage.app.world().resource::<Director>().held.clone();
    assert_eq!(held.len(), strands.len());
    let bonds = stage.bonds();
    let at_rest = measure::kept_at_rest(bonds.iter(), &held);
    [at_rest, measure::kept(&measure::shapes(strands.iter()), &held)]
}

/// The last on its stage, where it leaves its systems.
pub fn the_papers_scenes_keep_there_what_they_keep_on_the_processor(stage: &mut Stage) {
    stage.app.world_mut().despawn(stage.hair);
    ScenePlugin(Scene::new(SceneKind::Perm, None).unwrap()).build(&mut stage.app);
    stage.app.add_systems(FixedPreUpdate, fetch_before_the_end);
    // What the processor keeps: of the first scene run beside it, of the others as it was once, by a control of 20 s
    // each.
    let scenes = [
        (SceneKind::Perm, None),
        (SceneKind::Bedhead, Some([0.33099, 0.33098])),
        (SceneKind::BlowDry, Some([0.27738, 0.27753])),
    ];
    for (kind, known) in scenes {
        let cpu = known.unwrap_or_else(|| kept(stage, kind, SimulateOn::Cpu));
        let gpu = kept(stage, kind, SimulateOn::Gpu);
        println!("{}: kept {gpu:.5?}, on the CPU {cpu:.5?}", kind.name());
        for (cpu, gpu) in cpu.into_iter().zip(gpu) {
            assert!((cpu - gpu).abs() < 0.005, "{}: {gpu}, on the CPU {cpu}", kind.name());
        }
        assert!(kind != SceneKind::Perm || cpu[0] > 0.66, "a perm keeps {} on the CPU", cpu[0]);
    }
}
