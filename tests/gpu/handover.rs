//! Whatever happens to hair on its way to the device or back: no panic, nothing lost.

use crate::{
    residence::{grow, on_gpu},
    stage::{Stage, apart, curls},
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

/// Hair of a head that runs, turns and has a blower before it, in wind: each tick after it is asked home.
fn run_home(stage: &mut Stage, on: SimulateOn, blocking: bool, moves: bool) -> Vec<Vec<Strand>> {
    grow(stage, SimulateOn::Cpu, curls(12, 7));
    let world = stage.app.world_mut();
    world.insert_resource(HairWind { velocity: Vec3::Z * 2.0, gusts: 0.0, ..default() });
    world.resource_mut::<HairGpu>().blocking = blocking;
    let aimed = Blower::blow_dry(Vec3::new(0.3, 0.1, 0.0), Vec3::ZERO);
    let blower = world.spawn((aimed, ChildOf(stage.hair))).id();
    stage.app.world_mut().entity_mut(stage.hair).insert(on);
    let mut seen = Vec::new();
    for tick in 0..60 {
        let share = if moves { tick as f32 / 60.0 } else { 0.0 };
        let place = Transform::from_xyz(6.0 * share * share, 0.0, 0.0);
        let place = place.with_rotation(Quat::from_rotation_y(2.0 * share));
        stage.app.world_mut().entity_mut(stage.hair).insert(place);
        if tick == 30 {
            assert_eq!(stage.is_on_gpu(), on == SimulateOn::Gpu);
            stage.app.world_mut().entity_mut(stage.hair).insert(SimulateOn::Cpu);
        }
        stage.run(1);
        let is_home = matches!(stage.residence(), HairResidence::Cpu(_));
        if tick >= 30 && is_home {
            seen.push(stage.strands());
        }
    }
    stage.app.world_mut().despawn(blower);
    stage.app.insert_resource(HairWind::default());
    assert!(stage.faults().is_empty());
    seen
}

/// It comes home where it would be, and from then on goes on as that.
pub fn it_comes_home_from_a_head_that_moves_as_if_it_had_stayed(stage: &mut Stage) {
    let rests = run_home(stage, SimulateOn::Cpu, true, false);
    let stayed = run_home(stage, SimulateOn::Cpu, true, true);
    let felt = apart(rests.last().unwrap(), stayed.last().unwrap());
    assert!(felt > 0.02, "the motion is felt: {felt} m");
    for blocking in [true, false] {
        let returned = run_home(stage, SimulateOn::Gpu, blocking, true);
        assert!(returned.len() > 20, "home for {} ticks", returned.len());
        let off = stayed.iter().rev().zip(returned.iter().rev()).map(|(a, b)| apart(a, b));
        let off: Vec<f32> = off.collect();
        let worst = off.iter().copied().fold(0.0, f32::max);
        println!("blocking {blocking}: felt {felt} m, off by {worst} m, at last {} m", off[0]);
        // Without waiting it is not moved in the frames in which it returns, and catches up.
        let [most, in_the_end] = if blocking { [1e-4; 2] } else { [2e-2, 2e-3] };
        assert!(worst < most && off[0] < in_the_end, "blocking {blocking}: {worst}, {} m", off[0]);
    }
}
