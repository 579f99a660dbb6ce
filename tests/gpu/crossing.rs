//! Whatever happens to hair on its way to the device or back: no panic, nothing lost.

use crate::{
    residence::{grow, on_gpu},
    stage::{Stage, curls},
};
use bevy::prelude::*;
use bevy_keratin::{LodLevel, gpu::HairResidence, prelude::*};

#[derive(Resource, Default)]
struct Taken(Option<Hairdo>);

type Event = (&'static str, fn(&mut World, Entity), fn(&Stage));

fn members(world: &World, hair: Entity) -> Vec<Entity> {
    world.get::<Strands>(hair).unwrap().iter().collect()
}

/// What may happen, and what of it has to be seen afterwards.
fn events() -> [Event; 8] {
    [
        (
            "a treatment",
            |world, hair| _ = world.write_message(HairTreatment::wet(hair)),
            |stage| {
                let bonds = stage.app.world().get::<Bonds>(stage.members()[1]).unwrap();
                assert!(bonds.joints.iter().all(|j| j.rates[BondKind::Hydrogen as usize] < 0.01));
            },
        ),
        (
            "a hairdo is asked for",
            |world, hair| {
                world.init_resource::<Taken>();
                world.entity_mut(hair).observe(
                    |taken: On<HairdoCaptured>, mut all: ResMut<Taken>| {
                        all.0 = Some(taken.hairdo.clone());
                    },
                );
                world.trigger(CaptureHairdo { entity: hair });
                world.flush();
            },
            |stage| {
                let taken = stage.app.world().resource::<Taken>().0.as_ref().expect("it arrived");
                assert_eq!(taken.strands().len(), 6);
            },
        ),
        (
            "a hairdo is put on",
            |world, hair| {
                // That of other hair, as it grew.
                let other = Stage::spawn_in(world, SimulateOn::Cpu, curls(6, 7));
                let hairdo = Hairdo::of(world, other).unwrap();
                world.despawn(other);
                hairdo.apply(world, hair).unwrap();
            },
            |_| {},
        ),
        (
            "a teleport",
            |world, hair| {
                Hair::teleport(world.entity_mut(hair));
                world.get_mut::<Transform>(hair).unwrap().translation = Vec3::X * 30.0;
            },
            |_| {},
        ),
        (
            "a strand less",
            |world, hair| _ = world.despawn(members(world, hair)[2]),
            |stage| assert_eq!(stage.members().len(), 5),
        ),
        (
            "a strand more",
            |world, hair| _ = world.spawn((StrandOf(hair), curls(1, 9).remove(0))),
            |stage| assert_eq!(stage.members().len(), 7),
        ),
        (
            "another level of detail",
            |world, hair| {
                let level = LodLevel::new(0.5, 2, 3).unwrap().with_strands(0.5).unwrap();
                let lod = HairLod { levels: vec![level], ..default() };
                world.entity_mut(hair).insert((lod, HairScreenShare(0.4)));
            },
            |_| {},
        ),
        ("its end", |world, hair| _ = world.despawn(hair), |_| {}),
    ]
}

/// After some time it is where it is asked to be, whole.
fn is_whole(stage: &mut Stage, name: &str, way: &str, seen: fn(&Stage)) {
    if stage.app.world().get_entity(stage.hair).is_err() {
        grow_anew(stage);
        return;
    }
    let at = stage.residence();
    assert!(!matches!(at, HairResidence::Returning(_)), "{name} {way}: {at:?}");
    let strands = stage.strands();
    assert!(strands.iter().all(Strand::is_finite), "{name} {way}");
    for strand in &strands {
        let (root, length) = (strand.positions()[0], strand.length());
        let reach = strand.positions().iter().map(|p| p.distance(root)).fold(0.0, f32::max);
        assert!(reach < 1.02 * length, "{name} {way}: {reach} m from its root");
        let fastest = strand.velocities().iter().map(|v| v.length()).fold(0.0, f32::max);
        assert!(fastest < 5.0, "{name} {way}: {fastest} m/s");
    }
    stage.bonds();
    seen(stage);
}

fn grow_anew(stage: &mut Stage) {
    stage.hair = stage.app.world_mut().spawn((Hair, Transform::default())).id();
}

pub fn whatever_happens_on_the_way_is_done(stage: &mut Stage) {
    for (name, happens, seen) in events() {
        on_gpu(stage, 6, 5);
        stage.app.world_mut().resource_mut::<HairGpu>().blocking = false;
        let hair = stage.hair;
        stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Cpu);
        stage.run(1);
        assert!(matches!(stage.residence(), HairResidence::Returning(_)), "{name}");
        happens(stage.app.world_mut(), hair);
        stage.run(12);
        is_whole(stage, name, "on the way home", seen);

        grow(stage, SimulateOn::Cpu, curls(6, 7));
        stage.app.world_mut().resource_mut::<HairGpu>().blocking = false;
        stage.run(5);
        let hair = stage.hair;
        // In the tick in which it goes.
        stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Gpu);
        happens(stage.app.world_mut(), hair);
        stage.run(1);
        if stage.app.world().get_entity(hair).is_ok() {
            // Back, whether it has gone or not.
            stage.run(8);
            stage.app.world_mut().entity_mut(hair).insert(SimulateOn::Cpu);
            stage.run(12);
        }
        is_whole(stage, name, "on the way there", seen);
    }
}
