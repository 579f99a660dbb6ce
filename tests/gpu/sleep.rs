//! Hair that rests costs the device nothing, and wakes as on the CPU.

use crate::{
    residence::grow,
    stage::{Stage, apart, curls},
};
use bevy::{
    ecs::system::RunSystemOnce,
    prelude::*,
    render::{
        RenderApp,
        render_asset::RenderAssets,
        render_resource::{Buffer, BufferDescriptor, BufferUsages, MapMode, PollType},
        renderer::{RenderDevice, RenderQueue},
        storage::GpuShaderBuffer,
    },
};
use bevy_keratin::{
    LodLevel, SleepCounts,
    gpu::{GpuJournal, HairResidence},
    prelude::*,
    render::HairBuffers,
};

/// Curls that come to rest soon.
pub fn damped() -> (SleepSettings, AirDrag) {
    (SleepSettings::default(), AirDrag { rate: 20.0 })
}

fn resting(stage: &mut Stage, on: SimulateOn) {
    grow(stage, on, curls(40, 5));
    let hair = stage.hair;
    stage.app.world_mut().entity_mut(hair).insert(damped());
    stage.run(1);
    assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu);
}

fn sleepers(stage: &Stage) -> SleepCounts {
    *stage.app.world().get::<SleepCounts>(stage.hair).unwrap()
}

/// Ticks until all of it sleeps, so many a frame.
pub fn until_asleep(stage: &mut Stage, at_once: u32) -> usize {
    stage.at_once(at_once);
    let frames = (1..600 / at_once).find(|_| {
        stage.run(1);
        sleepers(stage).all()
    });
    let frames = frames.unwrap_or_else(|| panic!("it does not sleep: {:?}", sleepers(stage)));
    stage.at_once(1);
    (frames * at_once) as usize
}

pub fn it_sleeps_when_the_last_strand_would(stage: &mut Stage) {
    resting(stage, SimulateOn::Cpu);
    let hair = stage.hair;
    // The strands of hair on the CPU sleep one by one; the last one's time is that of the whole.
    let cpu = until_asleep(stage, 1);
    let there = stage.strands();
    resting(stage, SimulateOn::Gpu);
    assert_ne!(hair, stage.hair);
    let gpu = until_asleep(stage, 1);
    println!("asleep after {cpu} ticks on the CPU, {gpu} on the device");
    // Its report arrives some frames later.
    assert!((gpu as f32) < 1.15 * cpu as f32 + 8.0 && cpu as f32 <= 1.15 * gpu as f32);
    let slept = stage.strands();
    assert!(apart(&there, &slept) < 5e-4, "{}", apart(&there, &slept));
    let speeds = slept.iter().flat_map(|strand| strand.velocities());
    assert!(speeds.into_iter().all(|v| *v == Vec3::ZERO));
    // It stays as it is to the bit, and nothing is written down for the device.
    let bits = stage.bits();
    stage.run(30);
    assert!(sleepers(stage).all() && stage.is_on_gpu() && stage.bits() == bits);
    // The same hair that never slept has gone no farther than counts as still.
    let hair = stage.hair;
    stage.app.world_mut().entity_mut(hair).insert(SleepSettings::never());
    stage.run(1);
    assert_eq!(sleepers(stage).asleep, 0);
    stage.run(60);
    let awake = stage.strands();
    let most = 2.0 * SleepSettings::default().distance();
    assert!(apart(&slept, &awake) < most, "{} m", apart(&slept, &awake));
}

pub fn asleep_it_has_no_substeps(stage: &mut Stage) {
    resting(stage, SimulateOn::Gpu);
    until_asleep(stage, 4);
    let hair = stage.hair;
    // Without a render world nobody takes what is written down.
    let render = stage.app.remove_sub_app(bevy::render::RenderApp).unwrap();
    let written = |stage: &mut Stage| {
        stage.run(1);
        stage.app.world().get::<GpuJournal>(hair).unwrap().records.len()
    };
    assert!((0..10).all(|_| written(stage) == 0));
    stage.app.insert_resource(HairGravity(Vec3::NEG_Y * 5.0));
    assert!(written(stage) > 0, "awake in the same tick");
    stage.app.insert_sub_app(bevy::render::RenderApp, render);
    stage.run(2);
    assert!(stage.is_on_gpu());
}

/// The buffer that drawing reads, as it is on the device.
fn drawn(stage: &Stage) -> Buffer {
    let nodes = stage.app.world().get::<HairBuffers>(stage.hair).unwrap().nodes.id();
    let render = stage.app.sub_app(RenderApp).world();
    let drawn = render.resource::<RenderAssets<GpuShaderBuffer>>().get(nodes).unwrap();
    drawn.buffer.clone()
}

/// Its words, eight a node.
fn words(stage: &Stage, nodes: &Buffer) -> Vec<[u32; 8]> {
    let device = stage.app.world().resource::<RenderDevice>();
    let back = device.create_buffer(&BufferDescriptor {
        label: None,
        size: nodes.size(),
        usage: BufferUsages::MAP_READ | BufferUsages::COPY_DST,
        mapped_at_creation: false,
    });
    let mut encoder = device.create_command_encoder(&default());
    encoder.copy_buffer_to_buffer(nodes, 0, &back, 0, nodes.size());
    stage.app.world().resource::<RenderQueue>().submit([encoder.finish()]);
    device.map_buffer(&back.slice(..), MapMode::Read, |mapped| mapped.unwrap());
    device.poll(PollType::wait_indefinitely()).unwrap();
    let bytes = back.slice(..).get_mapped_range().to_vec();
    let words: Vec<u32> =
        bytes.chunks_exact(4).map(|b| u32::from_le_bytes(b.try_into().unwrap())).collect();
    words.as_chunks::<8>().0.to_vec()
}

/// What is drawn stays as it was written when it fell asleep: whatever stands there in its place is left alone
/// until it wakes.
pub fn asleep_its_nodes_are_not_drawn_anew(stage: &mut Stage) {
    resting(stage, SimulateOn::Gpu);
    until_asleep(stage, 4);
    stage.run(6);
    assert!(sleepers(stage).all());
    let nodes = drawn(stage);
    let written = words(stage, &nodes);
    let place = |node: &[u32; 8]| Vec3::from([node[0], node[1], node[2]].map(f32::from_bits));
    let strands = stage.strands();
    let places = strands.iter().flat_map(|strand| strand.positions());
    assert_eq!(places.clone().count(), written.len());
    for (node, expected) in written.iter().zip(places) {
        assert!(place(node).distance(*expected) < 1e-6, "where it sleeps");
        assert_eq!((node[6], node[7] & 0xffff), (0, 0), "it does not move");
    }
    let mark = |stage: &Stage| {
        let marks = vec![0x3f; nodes.size() as usize];
        stage.app.world().resource::<RenderQueue>().write_buffer(&nodes, 0, &marks);
    };
    mark(stage);
    stage.run(3);
    assert!(sleepers(stage).all());
    assert!(words(stage, &nodes).iter().flatten().all(|word| *word == 0x3f3f_3f3f));
    // So it is with hair that is awake.
    stage.app.insert_resource(HairGravity(Vec3::NEG_Y * 5.0));
    stage.run(2);
    let awake = words(stage, &nodes);
    for (node, before) in awake.iter().zip(&written) {
        assert!(place(node).distance(place(before)) < 0.01, "{}", place(node));
    }
    mark(stage);
    stage.run(1);
    assert!(words(stage, &nodes).iter().flatten().all(|word| *word != 0x3f3f_3f3f));
}

pub fn whatever_disturbs_it_wakes_it_in_the_same_tick(stage: &mut Stage) {
    type Disturb = fn(&mut World, Entity);
    let all: [(&str, Disturb); 9] = [
        ("head", |world, hair| {
            world.get_mut::<Transform>(hair).unwrap().translation.x += 0.01;
        }),
        ("teleport", |world, hair| {
            world.get_mut::<Transform>(hair).unwrap().translation.x += 50.0;
        }),
        ("gravity", |world, _| world.resource_mut::<HairGravity>().0.y = -5.0),
        ("wind", |world, _| {
            *world.resource_mut::<HairWind>() =
                HairWind { velocity: Vec3::X, gusts: 0.0, ..default() };
        }),
        ("treatment", |world, hair| {
            _ = world.write_message(HairTreatment::wet(hair));
        }),
        ("setting", |world, hair| {
            let stiff = HairStiffness { bending_length: 0.1, ..default() };
            world.entity_mut(hair).insert(stiff);
        }),
        ("collider", |world, _| {
            let ball = HairCollider::sphere(0.05).unwrap();
            world.spawn((ball, Transform::from_xyz(0.0, 0.1, 0.0)));
        }),
        ("held node", |world, hair| {
            let strand = world.get::<Strands>(hair).unwrap().iter().next().unwrap();
            let tip = *world.get::<Strand>(strand).unwrap().positions().last().unwrap();
            let mut held = HeldNodes::default();
            let nodes = world.get::<Strand>(strand).unwrap().nodes();
            held.targets = vec![None; nodes];
            held.targets[nodes - 1] = Some(tip + Vec3::Y * 0.01);
            world.entity_mut(strand).insert(held);
        }),
        ("its sleep", |world, hair| {
            world.entity_mut(hair).insert(SleepSettings::never());
        }),
    ];
    for (name, disturb) in all {
        resting(stage, SimulateOn::Gpu);
        until_asleep(stage, 4);
        let before = stage.strands();
        let bonds = stage.bonds();
        disturb(stage.app.world_mut(), stage.hair);
        stage.run(1);
        assert_eq!((name, sleepers(stage).asleep), (name, 0));
        assert!(stage.is_on_gpu(), "{name}: {:?}", stage.residence());
        stage.run(3);
        let went = apart(&before, &stage.strands());
        let others = stage.bonds();
        let changed =
            bonds.iter().zip(&others).any(|(a, b)| a.joints[0].rates != b.joints[0].rates);
        println!("{name}: went {went} m");
        // What sleeps on stays where it is to the bit.
        assert!(went > 0.0 || changed, "{name}: nothing happens");
        let world = stage.app.world_mut();
        world.resource_mut::<HairWind>().velocity = Vec3::ZERO;
        let tools: Vec<Entity> =
            world.query_filtered::<Entity, With<HairCollider>>().iter(world).collect();
        tools.into_iter().for_each(|tool| _ = world.despawn(tool));
    }
}

/// What goes on while it falls asleep, sleeps and wakes does not depend on when its report arrives.
pub fn sleep_is_the_same_however_many_ticks_a_frame(stage: &mut Stage) {
    let mut first = None;
    for at_once in [1, 4, 12] {
        resting(stage, SimulateOn::Gpu);
        stage.at_once(at_once);
        stage.run(360 / at_once as usize);
        assert!(sleepers(stage).all(), "{at_once}");
        stage.app.insert_resource(HairGravity(Vec3::new(1.0, -9.0, 0.0)));
        stage.run(12 / at_once as usize);
        assert_eq!(sleepers(stage).asleep, 0, "{at_once}");
        let bits = stage.bits();
        assert!(*first.get_or_insert_with(|| bits.clone()) == bits, "{at_once} ticks a frame");
    }
}

pub fn hair_with_followers_sleeps_as_well(stage: &mut Stage) {
    grow(stage, SimulateOn::Cpu, curls(48, 5));
    let hair = stage.hair;
    let level = LodLevel::new(0.5, 2, 3).unwrap().with_strands(0.5).unwrap();
    let lod = HairLod { levels: vec![level], ..default() };
    stage.app.world_mut().entity_mut(hair).insert((damped(), lod, HairScreenShare(0.4)));
    stage.run(3);
    stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Gpu);
    stage.run(1);
    assert!(stage.is_on_gpu());
    until_asleep(stage, 4);
    assert_eq!(sleepers(stage).asleep, 24, "followers are not counted");
    let bits = stage.bits();
    stage.run(20);
    assert!(sleepers(stage).all() && stage.bits() == bits);
}

/// A frame that owes more ticks than it may run leaves them to the next ones; nothing is lost.
pub fn a_pause_is_caught_up_with_in_some_frames(stage: &mut Stage) {
    #[derive(Resource, Default)]
    struct Age(u32);
    stage.app.init_resource::<Age>();
    let observer = (stage.app.world_mut())
        .add_observer(|probed: On<HairProbed>, mut age: ResMut<Age>| age.0 = probed.age)
        .id();
    let mut all = [1000, 4].map(|most| {
        grow(stage, SimulateOn::Gpu, curls(6, 5));
        stage.run(1);
        assert!(stage.is_on_gpu());
        stage.app.world_mut().resource_mut::<HairGpu>().ticks_a_frame = most;
        let strand = stage.members()[0];
        stage.app.world_mut().entity_mut(strand).insert(HairProbe);
        let mut oldest = 0;
        let age = |stage: &Stage| stage.app.world().resource::<Age>().0;
        stage.at_once(15);
        for _ in 0..12 {
            stage.run(1);
            oldest = oldest.max(age(stage));
        }
        stage.at_once(1);
        stage.run(40);
        let after = age(stage);
        println!("{most} ticks a frame: up to {oldest} ticks late, {after} afterwards");
        (stage.bits(), oldest, after)
    });
    let [(whole, ..), (parts, oldest, after)] = &mut all;
    assert!(whole == parts, "nothing is lost");
    // A frame or two until its report arrives, of 15 ticks each.
    assert!(*oldest > 40 && *oldest <= 60 + 4 + 3 * 15 && *after < 6, "{oldest}, {after}");
    stage.app.world_mut().despawn(observer);
    let residence = |at: Query<&HairResidence>| at.iter().all(|at| *at == HairResidence::Gpu);
    assert!(stage.app.world_mut().run_system_once(residence).unwrap());
}
