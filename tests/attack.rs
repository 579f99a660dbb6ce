//! What inspectors, scene files and careless game code may do to a world with hair: no panic, no
//! strand that stays non-finite.
//!
//! `cargo test --release --test attack -- --ignored` goes on for a million operations.

mod common;

use bevy::{
    ecs::reflect::{AppTypeRegistry, ReflectComponent},
    prelude::*,
    reflect::{PartialReflect, ReflectMut},
};
use bevy_keratin::{BondChanges, FaultKind, SoakHair, prelude::*};
use common::*;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus, seq::IndexedRandom};

#[test]
fn a_haircut_by_another_strand_keeps_the_bonds_of_what_is_left() {
    let mut app = test_app(60.0);
    let (hair, id) = one_strand(&mut app, 0.24, 8, Vec3::X);
    run(&mut app, 0.2);
    app.world_mut().get_mut::<Bonds>(id).unwrap().joints[2].shapes = [Vec3::X * 0.1; 4];
    app.world_mut().write_message(Treat::wet(hair));
    run(&mut app, 0.1);
    for segments in [5, 11] {
        let points: Vec<Vec3> = (0..=segments).map(|i| Vec3::X * 0.03 * i as f32).collect();
        let cut = Strand::from_polyline(&points).unwrap();
        app.world_mut().entity_mut(id).insert(cut);
        app.update();
        let bonds = app.world().get::<Bonds>(id).unwrap();
        assert_eq!(bonds.joints.len(), segments);
        assert_eq!(bonds.joints[2].shapes[3], Vec3::X * 0.1, "the kept part remembers");
        let before = strand(&app, id).positions().to_vec();
        run(&mut app, 0.2);
        assert!(
            strand(&app, id).positions()[segments].distance(before[segments]) > 1e-3,
            "it falls"
        );
        assert!(strand(&app, id).is_finite());
    }
    assert_eq!(faults(&mut app), []);
}

#[test]
fn requests_for_joints_that_no_strand_has_do_nothing() {
    let mut changes = BondChanges::default();
    changes.ask(usize::MAX, BondKind::Hydrogen, -1.0);
    changes.ask(100_000_000, BondKind::Hydrogen, -1.0);
    assert!(changes.is_empty());
    changes.ask(3, BondKind::Hydrogen, -1.0);
    assert!(!changes.is_empty());
}

#[test]
fn a_shower_that_owes_too_much_is_told_and_goes_on() {
    for owed in [f32::NAN, 1e12, -1e12] {
        let mut app = test_app(60.0);
        let shower = Shower { owed, ..Shower::new(120.0, 1.5e-3).unwrap() };
        app.world_mut().spawn((shower, Transform::from_xyz(0.0, 1.0, 0.0)));
        run(&mut app, 0.1);
        let drops = app.world_mut().query::<&Droplet>().iter(app.world()).count();
        assert!((10..16).contains(&drops), "{drops} drops from {owed}");
    }
}

#[test]
fn what_is_written_into_a_strands_private_parts_is_mended_and_told() {
    let mut app = test_app(60.0);
    let (_, id) = one_strand(&mut app, 0.24, 8, Vec3::X);
    run(&mut app, 0.1);
    for (part, value) in [("rest_lengths", f32::NAN), ("velocities", 0.0), ("tensions", 0.0)] {
        {
            let mut strand = app.world_mut().get_mut::<Strand>(id).unwrap();
            let ReflectMut::Struct(parts) = strand.reflect_mut() else { panic!() };
            let ReflectMut::List(list) = parts.field_mut(part).unwrap().reflect_mut() else {
                panic!()
            };
            if value.is_nan() {
                *list.get_mut(3).unwrap().try_downcast_mut::<f32>().unwrap() = value;
            } else {
                list.pop();
            }
        }
        run(&mut app, 0.2);
        let told = faults(&mut app);
        assert!(matches!(&told[..], [f] if f.kind == FaultKind::Strand), "{part}: {told:?}");
        assert!(strand(&app, id).is_finite() && strand(&app, id).peak_strain() < 0.01);
    }
}

const WRONG: [f32; 12] = [
    f32::NAN,
    f32::INFINITY,
    f32::NEG_INFINITY,
    0.0,
    -0.0,
    -1.0,
    1e-30,
    1e30,
    f32::MAX,
    1.0,
    0.37,
    1e6,
];

/// Writes something into a part of a value, however deep. Says where.
fn spoil(value: &mut dyn PartialReflect, random: &mut Xoshiro256PlusPlus) -> String {
    let wrong = *WRONG.choose(random).unwrap();
    let small = random.random_range(0..20_u64);
    macro_rules! put {
        ($($number:ty: $wrong:expr),*) => {
            $(if let Some(number) = value.try_downcast_mut::<$number>() {
                *number = $wrong;
                return format!(" = {number}");
            })*
        };
    }
    put!(f32: wrong, f64: wrong.into(), u32: small as u32, u64: small, bool: small < 10);
    let name = value.reflect_type_path().to_owned();
    let at = |len: usize, random: &mut Xoshiro256PlusPlus| {
        (len > 0).then(|| random.random_range(0..len))
    };
    let inside = match value.reflect_mut() {
        ReflectMut::Struct(parts) => at(parts.field_len(), random).map(|i| {
            let field = parts.name_at(i).unwrap_or_default().to_owned();
            format!(".{field}{}", spoil(parts.field_at_mut(i).unwrap(), random))
        }),
        ReflectMut::TupleStruct(parts) => at(parts.field_len(), random)
            .map(|i| format!(".{i}{}", spoil(parts.field_mut(i).unwrap(), random))),
        ReflectMut::Tuple(parts) => at(parts.field_len(), random)
            .map(|i| format!(".{i}{}", spoil(parts.field_mut(i).unwrap(), random))),
        ReflectMut::Array(parts) => at(parts.len(), random)
            .map(|i| format!("[{i}]{}", spoil(parts.get_mut(i).unwrap(), random))),
        ReflectMut::Enum(parts) => at(parts.field_len(), random)
            .map(|i| format!(".{i}{}", spoil(parts.field_at_mut(i).unwrap(), random))),
        ReflectMut::List(list) if small < 5 => list.pop().map(|_| ".pop()".to_owned()),
        ReflectMut::List(list) if small == 5 => {
            list.drain();
            Some(".clear()".to_owned())
        }
        ReflectMut::List(list) => at(list.len(), random)
            .map(|i| format!("[{i}]{}", spoil(list.get_mut(i).unwrap(), random))),
        _ => None,
    };
    inside.unwrap_or(name)
}

/// One operation on the world. Says which.
fn operation(app: &mut App, random: &mut Xoshiro256PlusPlus) -> String {
    let hairs: Vec<Entity> =
        app.world_mut().query_filtered::<Entity, With<Hair>>().iter(app.world()).collect();
    let strands: Vec<Entity> =
        app.world_mut().query_filtered::<Entity, With<Strand>>().iter(app.world()).collect();
    let others: Vec<Entity> = app
        .world_mut()
        .query_filtered::<Entity, Or<(With<HairCollider>, With<Droplet>, With<Blower>, With<PermRod>, With<Shower>)>>()
        .iter(app.world())
        .collect();
    let all: Vec<Entity> = [&hairs[..], &strands, &others].concat();
    let (hair, one) = (hairs.choose(random).copied(), strands.choose(random).copied());
    let any = all.choose(random).copied();
    let place = Vec3::from_array([(); 3].map(|()| random.random_range(-0.3..0.3)));
    let world = app.world_mut();
    match (random.random_range(0..20), hair, one, any) {
        (0, Some(hair), ..) if strands.len() < 40 => {
            let segments = random.random_range(1..20);
            let points: Vec<Vec3> =
                (0..=segments).map(|i| place * 0.1 + Vec3::X * 0.02 * i as f32).collect();
            world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
            format!("a strand of {segments} segments")
        }
        (1, _, Some(strand), _) if strands.len() > 8 => {
            world.despawn(strand);
            "a strand gone".into()
        }
        (2, _, Some(strand), _) if strands.len() < 40 => {
            world.entity_mut(strand).clone_and_spawn();
            "a strand cloned".into()
        }
        (3, Some(hair), Some(strand), _) => {
            world.entity_mut(strand).insert(StrandOf(hair));
            "a strand on another head".into()
        }
        (4, _, Some(strand), _) => {
            let segments = random.random_range(1..12);
            let points: Vec<Vec3> = (0..=segments).map(|i| Vec3::X * 0.02 * i as f32).collect();
            world.entity_mut(strand).insert(Strand::from_polyline(&points).unwrap());
            "a haircut".into()
        }
        (5, Some(hair), ..) => {
            world.write_message(Treat::wet(hair));
            "wet".into()
        }
        (6, Some(hair), ..) => {
            world.write_message(Treat::dry(hair).over(0.1));
            "dry".into()
        }
        (7, _, Some(strand), _) => {
            world
                .write_message(SoakHair { target: strand, wetness: random.random_range(0.0..1.0) });
            "soaked".into()
        }
        (8, Some(hair), ..) => {
            world.commands().entity(hair).queue(Hair::teleport);
            world.get_mut::<Transform>(hair).unwrap().translation = place * 100.0;
            "a teleport".into()
        }
        (9, Some(hair), ..) => {
            world.get_mut::<Transform>(hair).unwrap().translation += place;
            "a jump".into()
        }
        (10, ..) if others.len() < 30 => {
            let at = Transform::from_translation(place);
            match random.random_range(0..4) {
                0 => world.spawn((HairCollider::sphere(0.05).unwrap(), at)),
                1 => world.spawn(Droplet::new(place, 3e-8).unwrap()),
                2 => world.spawn((Shower::new(100.0, 1e-3).unwrap(), at)),
                _ => world.spawn((Blower::default(), at)),
            };
            "a tool".into()
        }
        (11, ..) if others.len() > 4 => {
            world.despawn(*others.choose(random).unwrap());
            "a tool gone".into()
        }
        (12, Some(hair), ..) => {
            let model = [StrandModel::Rod, StrandModel::MassSpring][random.random_range(0..2)];
            world.entity_mut(hair).insert(model);
            "another model".into()
        }
        (13, Some(hair), ..) => {
            let method = [SolverMethod::Direct, SolverMethod::Sweeps][random.random_range(0..2)];
            world.entity_mut(hair).insert(HairSolver { method, ..default() });
            "another solver".into()
        }
        (_, _, _, Some(entity)) => {
            let registry = world.resource::<AppTypeRegistry>().clone();
            let registry = registry.read();
            let components: Vec<_> = (registry.iter())
                .filter(|t| t.type_info().type_path().starts_with("bevy_keratin"))
                // Relationships are immutable.
                .filter(|t| {
                    !["StrandOf", "WoundOn"]
                        .contains(&t.type_info().type_path_table().ident().unwrap_or_default())
                })
                .filter_map(|t| Some((t.type_info().type_path(), t.data::<ReflectComponent>()?)))
                .filter(|(_, component)| component.contains(world.entity(entity)))
                .collect();
            let Some((name, component)) = components.choose(random) else {
                return "nothing".into();
            };
            let mut entity = world.entity_mut(entity);
            if random.random_range(0..12) == 0 && !name.ends_with("StrandOf") {
                component.remove(&mut entity);
                return format!("without {name}");
            }
            match component.reflect_mut(&mut entity) {
                Some(mut value) => {
                    format!("{name}{}", spoil(value.as_partial_reflect_mut(), random))
                }
                None => "nothing".into(),
            }
        }
        _ => "nothing".into(),
    }
}

fn attack(seed: u64, operations: usize) {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut done = Vec::new();
    let mut app = test_app(60.0);
    for x in [0.0, 1.0] {
        let hair = app.world_mut().spawn((Hair, Transform::from_xyz(x, 0.0, 0.0))).id();
        for i in 0..8 {
            let points: Vec<Vec3> =
                (0..9).map(|k| Vec3::new(0.02 * k as f32, 0.0, 0.01 * i as f32)).collect();
            app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
        }
    }
    for i in 0..operations {
        done.push(operation(&mut app, &mut random));
        if random.random_range(0..3) == 0 {
            let ticked = std::panic::catch_unwind(std::panic::AssertUnwindSafe(|| app.update()));
            let last = &done[done.len().saturating_sub(6)..];
            assert!(ticked.is_ok(), "seed {seed}, operation {i}, after {last:#?}");
            let _ = faults(&mut app);
        }
        if i % 500 == 499 {
            // What has been spoilt by settings may still be on its way back.
            (0..3).for_each(|_| app.update());
            for s in app.world_mut().query::<&Strand>().iter(app.world()) {
                assert!(s.is_finite(), "seed {seed}, operation {i}: {s:?}");
            }
        }
    }
}

#[test]
fn a_world_that_anything_is_done_to_goes_on() {
    for seed in 0..4 {
        attack(seed, 2000);
    }
}

#[test]
#[ignore = "takes minutes: a million operations"]
fn a_world_that_anything_is_done_to_goes_on_for_long() {
    for seed in 100..120 {
        attack(seed, 50_000);
    }
}
