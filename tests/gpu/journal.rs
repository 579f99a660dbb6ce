//! What the tick writes down, replayed on the GPU, does what the tick does.

use crate::{common::*, lab::Device};
use bevy::prelude::*;
use bevy_keratin::{
    SolverMethod,
    gpu::{GpuJournal, GpuStrands, HairResidence, StrandState, StrandView, Unsupported, WhyCpu},
    hair::strand::StrandHistory,
    prelude::*,
};

/// Strands on a ball, over a floor, in wind and before a blower; a second ball goes by.
fn scene() -> (App, Entity, Entity) {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(StrandContact { strength: 0.0, ..default() }))
        .insert_resource(HairDefault(SleepSettings::never()))
        .insert_resource(HairWind { velocity: Vec3::new(0.6, 0.0, 0.2), gusts: 0.0, ..default() });
    let world = app.world_mut();
    let hair = world.spawn((Hair, GpuJournal::default(), Transform::default())).id();
    let head = HairCollider::sphere(0.08).unwrap();
    world.spawn((head, Transform::default(), ChildOf(hair)));
    world.spawn((HairCollider::plane(Dir3::Y), Transform::from_xyz(0.0, -0.2, 0.0)));
    let passing = HairCollider::capsule(0.03, 0.1).unwrap();
    let passing = world.spawn((passing, Transform::from_xyz(-0.3, -0.05, 0.0))).id();
    world.spawn(Blower::blow_dry(Vec3::new(0.3, 0.0, 0.1), Vec3::new(0.0, -0.1, 0.0)));
    for i in 0..50 {
        let angle = i as f32 * 2.4;
        let out = Vec3::new(angle.cos(), 0.3 + 0.01 * i as f32, angle.sin()).normalize();
        let nodes = 8 + i % 9;
        let points: Vec<Vec3> = (0..nodes).map(|k| out * (0.082 + 0.016 * k as f32)).collect();
        let strand = Strand::from_polyline(&points).unwrap();
        world.spawn((StrandOf(hair), strand));
    }
    (app, hair, passing)
}

/// A tick in which the head turns and goes about and the other ball goes by.
fn tick(app: &mut App, hair: Entity, passing: Entity, number: usize) {
    let t = number as f32 / 60.0;
    *app.world_mut().get_mut::<Transform>(hair).unwrap() =
        Transform::from_xyz(0.05 * (4.0 * t).sin(), 0.0, 0.02 * (7.0 * t).sin())
            .with_rotation(Quat::from_rotation_y(0.6 * (5.0 * t).sin()));
    app.world_mut().get_mut::<Transform>(passing).unwrap().translation.x = 0.8 * t - 0.5;
    app.update();
}

fn members(app: &App, hair: Entity) -> Vec<Entity> {
    app.world().get::<Strands>(hair).unwrap().iter().collect()
}

fn hand_over(device: &Device, app: &App, members: &[Entity]) -> GpuStrands {
    let world = app.world();
    let view = |e: &Entity| {
        StrandView::of(
            world.get::<Strand>(*e).unwrap(),
            world.get::<Bonds>(*e).unwrap(),
            world.get::<StrandHistory>(*e).unwrap(),
        )
    };
    let views: Vec<StrandView<'_>> = members.iter().map(view).collect();
    GpuStrands::new(&device.device, &device.kernels, &views)
}

/// How far nodes and rates are from those of the app, at most, and how far nodes went.
fn apart(app: &App, members: &[Entity], states: &[StrandState]) -> (f32, f32) {
    let (mut places, mut rates) = (0.0f32, 0.0f32);
    for (e, state) in members.iter().zip(states) {
        let strand = app.world().get::<Strand>(*e).unwrap();
        let bonds = app.world().get::<Bonds>(*e).unwrap();
        for (p, q) in strand.positions().iter().zip(&state.positions) {
            places = places.max(p.distance(*q));
        }
        for (a, b) in bonds.joints.iter().zip(&state.joints) {
            for (a, b) in a.rates.iter().zip(b.rates) {
                rates = rates.max((a - b).abs());
            }
        }
    }
    (places, rates)
}

pub fn a_journal_holds_all_that_the_tick_does_to_hair_that_moves() {
    let device = Device::get();
    let (mut app, hair, passing) = scene();
    let members = members(&app, hair);
    // Bonds that wind can close again.
    app.world_mut().write_message(HairTreatment::wet(hair));
    for number in 0..20 {
        tick(&mut app, hair, passing, number);
    }
    for start in [20, 30, 40, 50] {
        let mut on = hand_over(device, &app, &members);
        let before = on.read(&device.device, &device.queue).unwrap();
        let mut journal = app.world_mut().get_mut::<GpuJournal>(hair).unwrap();
        journal.records.clear();
        tick(&mut app, hair, passing, start);
        let journal = app.world().get::<GpuJournal>(hair).unwrap();
        assert_eq!(journal.records.len(), 3);
        assert!(journal.records.iter().all(|r| r.frame_motion.is_some() && !r.blowers.is_empty()));
        let states = device.run(&mut on, &journal.records);
        let (moved, dried) = apart(&app, &members, &before);
        let (places, rates) = apart(&app, &members, &states);
        println!(
            "tick {start}: went {moved:.1e} m, dried {dried:.1e}; off by {places:.1e} m, {rates:.1e}"
        );
        assert!(moved > 5e-3 && dried > 1e-4, "{moved} {dried}");
        // The shaders do not clip friction nor guard the limiter as the CPU does yet: 0.11 mm.
        assert!(places < 2e-4 && rates < 1e-3 * dried, "{places} m, {rates}");
        // The tick's beginning is known to drawing.
        for (state, before) in states.iter().zip(&before) {
            assert_eq!(state.before, before.positions);
        }
        for number in start + 1..start + 10 {
            tick(&mut app, hair, passing, number);
        }
    }
}

/// An app without a GPU says so once nothing else keeps hair from it.
pub fn what_the_kernels_lack_keeps_hair_on_the_processor_and_is_reported() {
    let reported = |change: fn(&mut App, Entity)| {
        let (mut app, hair, passing) = scene();
        app.world_mut().entity_mut(hair).insert(SimulateOn::Gpu);
        change(&mut app, hair);
        // What is near is seen a tick later.
        (0..2).for_each(|number| tick(&mut app, hair, passing, number));
        match app.world().get::<HairResidence>(hair) {
            Some(HairResidence::Cpu(WhyCpu::Unsupported(what))) => Some(*what),
            Some(HairResidence::Cpu(WhyCpu::NoRenderer)) => None,
            other => panic!("{other:?}"),
        }
    };
    assert_eq!(reported(|_, _| ()), None);
    let contact = reported(|app, hair| {
        app.world_mut().entity_mut(hair).insert(StrandContact::default());
    });
    assert_eq!(contact, Some(Unsupported::StrandContact));
    let sweeps = reported(|app, hair| {
        let sweeps = HairSolver { method: SolverMethod::Sweeps, ..default() };
        app.world_mut().entity_mut(hair).insert(sweeps);
    });
    assert_eq!(sweeps, None);
    let springs = reported(|app, hair| {
        app.world_mut().entity_mut(hair).insert(StrandModel::MassSpring);
    });
    assert_eq!(springs, Some(Unsupported::Springs));
    let gusts = reported(|app, _| app.world_mut().resource_mut::<HairWind>().gusts = 0.5);
    assert_eq!(gusts, Some(Unsupported::UnsteadyWind));
    let blowers = reported(|app, _| {
        for _ in 0..4 {
            app.world_mut().spawn(Blower::default());
        }
    });
    assert_eq!(blowers, Some(Unsupported::Blowers));
    let boxes = reported(|app, hair| {
        let cuboid = HairCollider::cuboid(Vec3::splat(0.1)).unwrap();
        app.world_mut().spawn((cuboid, Transform::default(), ChildOf(hair)));
    });
    assert_eq!(boxes, Some(Unsupported::ColliderShape));
    let water = reported(|app, _| {
        app.world_mut().spawn(Droplet::new(Vec3::Y * 9.0, 1e-9).unwrap());
    });
    assert_eq!(water, Some(Unsupported::Water));
    let held = reported(|app, hair| {
        let strand = members(app, hair)[3];
        let targets = vec![Some(Vec3::X)];
        app.world_mut().entity_mut(strand).insert(HeldNodes { targets, ..default() });
    });
    assert_eq!(held, Some(Unsupported::HeldNodes));
    let settles = reported(|app, hair| {
        app.world_mut().entity_mut(hair).insert(Settling::default());
    });
    assert_eq!(settles, Some(Unsupported::Settling));
}
