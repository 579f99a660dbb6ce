//! NaN: in a setting, an obstacle, a treatment, a pose, a strand. It counts as on the CPU, is
//! reported once, and other hair does not notice.

use crate::{
    residence::{grow, on_gpu},
    stage::{Stage, curls},
};
use bevy::prelude::*;
use bevy_keratin::{
    ColliderShape, FaultKind,
    gpu::{HairResidence, Unsupported, WhyCpu},
    prelude::*,
};

type Act = fn(&mut World, Entity);

/// What is spoilt, and what counts in its place.
struct Spoilt {
    what: &'static str,
    kind: FaultKind,
    spoil: Act,
    instead: Act,
}

fn nothing(_: &mut World, _: Entity) {}

fn ball(world: &mut World, at: Vec3) -> Entity {
    world.spawn((HairCollider::sphere(0.05).unwrap(), Transform::from_translation(at))).id()
}

fn the_ball(world: &mut World) -> Entity {
    let mut balls = world.query_filtered::<Entity, With<HairCollider>>();
    balls.iter(world).next().unwrap()
}

fn blower(world: &mut World, blower: Blower) {
    let place = Transform::from_xyz(0.4, 0.1, 0.0).looking_at(Vec3::ZERO, Vec3::Y);
    world.spawn((blower, place));
}

fn treat(world: &mut World, hair: Entity, seconds: f32, rate: f32) {
    let mut treatment = HairTreatment::wet(hair).over(seconds);
    treatment.rates[BondKind::Disulfide as usize] = Some(rate);
    world.write_message(treatment);
}

fn of_the_hair<S: Component>(world: &mut World, hair: Entity, setting: S) {
    world.entity_mut(hair).insert(setting);
}

fn all() -> [Spoilt; 14] {
    use FaultKind::{Setting, Transform as Pose};
    const NAN: f32 = f32::NAN;
    let spoilt = |what, kind, spoil: Act, instead: Act| Spoilt { what, kind, spoil, instead };
    [
        spoilt(
            "stiffness",
            Setting,
            |w, h| of_the_hair(w, h, HairStiffness { bending_length: NAN, ..default() }),
            nothing,
        ),
        spoilt("drag", Setting, |w, h| of_the_hair(w, h, AirDrag { rate: NAN }), nothing),
        spoilt(
            "cuticle",
            Setting,
            |w, h| of_the_hair(w, h, Cuticle { damage: NAN, ..default() }),
            nothing,
        ),
        spoilt(
            "influence",
            Setting,
            |w, h| of_the_hair(w, h, BondInfluence { hydrogen: NAN, ..default() }),
            nothing,
        ),
        spoilt(
            "solver",
            Setting,
            |w, h| of_the_hair(w, h, HairSolver { substep: NAN, ..default() }),
            nothing,
        ),
        spoilt("gravity", Setting, |w, _| w.resource_mut::<HairGravity>().0 = Vec3::NAN, nothing),
        spoilt(
            "wind",
            Setting,
            |w, _| w.resource_mut::<HairWind>().velocity = Vec3::new(NAN, 1.0, 0.0),
            nothing,
        ),
        spoilt(
            "a blower",
            Setting,
            |w, _| blower(w, Blower { strength: NAN, ..default() }),
            |w, _| blower(w, default()),
        ),
        spoilt(
            "friction",
            Setting,
            |w, _| {
                let ball = the_ball(w);
                w.get_mut::<HairCollider>(ball).unwrap().friction = f32::NAN;
            },
            nothing,
        ),
        spoilt(
            "a radius",
            Setting,
            |w, _| {
                let ball = the_ball(w);
                w.get_mut::<HairCollider>(ball).unwrap().shape =
                    ColliderShape::Sphere(Sphere::new(f32::NAN));
            },
            |w, _| {
                let ball = the_ball(w);
                w.get_mut::<HairCollider>(ball).unwrap().shape =
                    ColliderShape::Sphere(Sphere::new(0.09));
            },
        ),
        spoilt(
            "where an obstacle is",
            Pose,
            |w, _| {
                let ball = the_ball(w);
                w.get_mut::<Transform>(ball).unwrap().translation.y = f32::NAN;
            },
            nothing,
        ),
        spoilt(
            "where the head is",
            Pose,
            |w, h| w.get_mut::<Transform>(h).unwrap().translation = Vec3::NAN,
            nothing,
        ),
        spoilt(
            "how long a treatment takes",
            Setting,
            |w, h| treat(w, h, NAN, 0.5),
            |w, h| {
                treat(w, h, 0.0, 0.5);
            },
        ),
        spoilt(
            "where a treatment leads",
            Setting,
            |w, h| treat(w, h, 0.05, NAN),
            |w, h| {
                treat(w, h, 0.05, 1.0);
            },
        ),
    ]
}

/// Two hairs, of which one is treated so; their states after it, and what was reported.
fn after(stage: &mut Stage, act: Act) -> ([Vec<u32>; 2], Vec<HairFault>) {
    on_gpu(stage, 12, 2);
    let hair = stage.hair;
    let other = Stage::spawn(&mut stage.app, SimulateOn::Gpu, curls(9, 6));
    let aside = ball(stage.app.world_mut(), Vec3::new(0.1, 0.0, 0.0));
    stage.run(4);
    act(stage.app.world_mut(), hair);
    let mut faults = Vec::new();
    for _ in 0..12 {
        stage.run(1);
        faults.extend(stage.faults());
        assert!(stage.is_on_gpu(), "{:?}", stage.residence());
    }
    let states = [hair, other].map(|hair| {
        stage.hair = hair;
        let whole = stage.strands().iter().all(Strand::is_finite);
        assert!(whole && stage.is_on_gpu(), "{:?}", stage.residence());
        stage.bits()
    });
    stage.hair = hair;
    let world = stage.app.world_mut();
    world.insert_resource(HairWind::default());
    let mut blowers = world.query_filtered::<Entity, With<Blower>>();
    let tools: Vec<Entity> = blowers.iter(world).chain([other, aside]).collect();
    tools.into_iter().for_each(|entity| _ = world.despawn(entity));
    (states, faults)
}

pub fn nan_counts_as_on_the_processor_and_is_reported_once(stage: &mut Stage) {
    let (untouched, faults) = after(stage, nothing);
    assert!(faults.is_empty(), "{faults:?}");
    for Spoilt { what, kind, spoil, instead } in all() {
        let (sound, reported) = after(stage, instead);
        assert!(reported.is_empty(), "{what}: {reported:?}");
        let (found, reported) = after(stage, spoil);
        let kinds: Vec<FaultKind> = reported.iter().map(|fault| fault.kind).collect();
        assert_eq!(kinds, [kind], "{what}: {reported:?}");
        assert!(found == sound, "{what}: it is not what counts in its place");
        let global = ["a blower", "a radius"].contains(&what);
        assert!(global || found[1] == untouched[1], "{what}: other hair notices");
    }
}

/// The game spoils strands that are there: the hair comes back, is mended, and goes again.
pub fn what_a_game_spoils_is_mended_and_goes_back(stage: &mut Stage) {
    type Write = fn(&mut World, Entity, f32);
    let all: [(&str, FaultKind, Write); 4] = [
        ("a velocity", FaultKind::Strand, |world, strand, to| {
            world.get_mut::<Strand>(strand).unwrap().velocities_mut()[3].y = to;
        }),
        ("a place", FaultKind::Rebuilt, |world, strand, to| {
            world.get_mut::<Strand>(strand).unwrap().positions_mut()[3].y = to;
        }),
        ("a remembered shape", FaultKind::Setting, |world, strand, to| {
            world.get_mut::<Bonds>(strand).unwrap().joints[2].shapes[1].x = to;
        }),
        ("a rate", FaultKind::Setting, |world, strand, to| {
            world.get_mut::<Bonds>(strand).unwrap().joints[2].rates[1] = to;
        }),
    ];
    for (what, kind, write) in all {
        let mut after = [0.2, f32::NAN].map(|to| {
            on_gpu(stage, 12, 4);
            let broken = stage.members()[7];
            write(stage.app.world_mut(), broken, to);
            let mut faults = Vec::new();
            let written = HairResidence::Cpu(WhyCpu::Unsupported(Unsupported::Written));
            for tick in 0..70 {
                stage.run(1);
                faults.extend(stage.faults());
                if tick == 0 {
                    assert_eq!(stage.residence(), written, "{what}");
                }
            }
            assert!(stage.is_on_gpu(), "{what}: {:?}", stage.residence());
            assert!(stage.strands().iter().all(Strand::is_finite), "{what}");
            (stage.strands(), faults)
        });
        let [(sound, reported), (found, faults)] = &mut after;
        assert!(reported.is_empty(), "{what}: {reported:?}");
        assert_eq!(faults.len(), 1, "{what}: {faults:?}");
        assert_eq!(faults[0].kind, kind, "{what}: {faults:?}");
        for (i, (a, b)) in sound.iter().zip(found).enumerate().filter(|(i, _)| *i != 7) {
            assert_eq!(a.positions(), b.positions(), "{what}: strand {i} notices");
        }
    }
}

/// A held node without a target is free, as on the CPU.
pub fn a_target_that_is_nan_holds_nothing(stage: &mut Stage) {
    let held =
        |target: Option<Vec3>| HeldNodes { targets: vec![None, None, None, target], ..default() };
    let [free, broken] = [None, Some(Vec3::NAN)].map(|target| {
        grow(stage, SimulateOn::Gpu, curls(12, 7));
        stage.run(4);
        let strand = stage.members()[7];
        stage.app.world_mut().entity_mut(strand).insert(held(target));
        stage.run(12);
        assert!(stage.is_on_gpu() && stage.faults().is_empty(), "{:?}", stage.residence());
        stage.bits()
    });
    assert!(free == broken);
}
