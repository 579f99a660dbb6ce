//! Hair that settles before it is seen, and hair in time that stands still or goes slowly.

use crate::common::{run, strand, test_app, wait_for};
use bevy::{prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{MotionOwner, prelude::*};
use std::time::Duration;

/// Strands that stand level or up on a head, some of them bent.
fn spawn(app: &mut App, settles: bool) -> (Entity, Vec<Entity>) {
    app.world_mut().spawn(HairCollider::sphere(0.09).unwrap());
    let hair = app.world_mut().spawn(Hair).id();
    if settles {
        app.world_mut().entity_mut(hair).insert(Settling::default());
    }
    let strands = (0..12)
        .map(|i| {
            let out = Quat::from_rotation_y(0.5 * i as f32) * Vec3::new(0.8, 0.6, 0.0);
            let points: Vec<Vec3> = (0..12).map(|k| out * (0.091 + 0.015 * k as f32)).collect();
            app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id()
        })
        .collect();
    (hair, strands)
}

fn fastest(app: &App, strands: &[Entity]) -> f32 {
    let speeds = strands.iter().flat_map(|s| strand(app, *s).velocities());
    speeds.map(|v| v.length()).fold(0.0, f32::max)
}

fn nodes(app: &App, strands: &[Entity]) -> Vec<Vec3> {
    strands.iter().flat_map(|s| strand(app, *s).positions().to_vec()).collect()
}

fn farthest(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

/// Updates until the hair is drawn, and how many that took.
fn until_drawn(app: &mut App, hair: Entity) -> usize {
    for update in 1..200 {
        app.update();
        if !app.world().entity(hair).contains::<Settling>() {
            return update;
        }
    }
    panic!("it is never drawn");
}

#[test]
fn hair_hangs_as_it_will_when_it_is_first_drawn() {
    let mut app = test_app(60.0);
    let (hair, strands) = spawn(&mut app, true);
    let unseen = until_drawn(&mut app, hair);
    let first = nodes(&app, &strands);
    app.update();
    let speed = fastest(&app, &strands);
    let mut seen: f32 = 0.0;
    for _ in 0..120 {
        app.update();
        seen = seen.max(farthest(&first, &nodes(&app, &strands)));
    }
    // The same without: it falls before everybody's eyes.
    let mut falling = test_app(60.0);
    let (_, others) = spawn(&mut falling, false);
    falling.update();
    let planted = nodes(&falling, &others);
    let mut fastest_fall: f32 = 0.0;
    for _ in 0..60 {
        falling.update();
        fastest_fall = fastest_fall.max(fastest(&falling, &others));
    }
    println!(
        "unseen for {unseen} frames; then {speed} m/s and {seen} m in two seconds, else {fastest_fall} m/s; \
         {} m from where it was planted",
        farthest(&planted, &first)
    );
    assert!(unseen <= 31, "{unseen} frames");
    assert!(speed < 5e-3 && seen < 1e-3, "{speed} m/s, {seen} m");
    assert!(fastest_fall > 0.5 && farthest(&planted, &first) > 0.02);
    // Nothing has gone on meanwhile: bonds are as they were, and where it rests is where it comes to.
    let run_out = {
        run(&mut falling, 20.0);
        nodes(&falling, &others)
    };
    assert!(farthest(&first, &run_out) < 3e-3, "{}", farthest(&first, &run_out));
}

#[test]
fn what_settles_is_all_that_moves_and_no_clock_goes_on() {
    let strands_of = |neighbour: bool| {
        let mut app = test_app(60.0);
        let (seen, strands) = spawn(&mut app, false);
        app.world_mut().write_message(SoakHair { target: seen, wetness: 1.0 });
        run(&mut app, 0.2);
        if neighbour {
            let hair = app.world_mut().spawn((Hair, Settling::default())).id();
            app.world_mut().entity_mut(hair).insert(Transform::from_xyz(3.0, 0.0, 0.0));
            let level: Vec<Vec3> = (0..10).map(|i| Vec3::X * (0.02 * i as f32)).collect();
            app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&level).unwrap()));
        }
        run(&mut app, 1.0);
        let water = app.world().get::<Moisture>(strands[0]).unwrap().bound().to_vec();
        (nodes(&app, &strands), water, *app.world().resource::<WaterLedger>())
    };
    assert!(strands_of(false) == strands_of(true), "hair beside what settles has moved otherwise");

    // A dryer and a treatment do nothing to hair in the ticks ahead.
    let mut app = test_app(60.0);
    let (hair, strands) = spawn(&mut app, true);
    app.world_mut().write_message(HairTreatment::wet(hair));
    app.world_mut().spawn((Blower::default(), Transform::from_xyz(0.0, 0.1, 0.4)));
    app.update();
    app.world_mut().write_message(HairTreatment::dry(hair).over(1.0));
    app.update();
    app.update();
    let rates = |app: &App| {
        let bonds = strands.iter().map(|s| app.world().get::<Bonds>(*s).unwrap());
        bonds.flat_map(|b| b.rates(BondKind::Hydrogen)).fold(0.0_f32, f32::max)
    };
    // Two ticks of the game, not ten.
    assert!(rates(&app) < 0.1, "{}", rates(&app));
}

#[test]
fn hair_that_is_to_fall_does() {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(SettleSettings { ticks: 0, ..default() }));
    let (hair, strands) = spawn(&mut app, true);
    assert_eq!(until_drawn(&mut app, hair), 1);
    run(&mut app, 0.1);
    assert!(fastest(&app, &strands) > 0.3);
    // And one tick at once is never more than that.
    let mut app = test_app(60.0);
    let few = SettleSettings { ticks: 30, at_once: 1, speed: 0.0, ..default() };
    app.insert_resource(HairDefault(few));
    let (hair, _) = spawn(&mut app, true);
    assert_eq!(until_drawn(&mut app, hair), 30);
}

#[test]
fn settling_is_the_same_to_the_last_bit() {
    let settled = |at_once: u32| {
        let mut app = test_app(60.0);
        let few = SettleSettings { at_once, ..default() };
        app.insert_resource(HairDefault(few));
        let (hair, strands) = spawn(&mut app, true);
        until_drawn(&mut app, hair);
        nodes(&app, &strands)
    };
    assert_eq!(settled(4), settled(4));
    assert!(farthest(&settled(4), &settled(30)) < 2e-3, "{}", farthest(&settled(4), &settled(30)));
}

fn frames(seconds: f64) -> TimeUpdateStrategy {
    TimeUpdateStrategy::ManualDuration(Duration::from_secs_f64(seconds))
}

/// A straight strand that hangs and one that was bent, at rest.
fn at_rest() -> (App, [Entity; 2]) {
    let mut app = test_app(60.0);
    app.insert_resource(frames(1.0 / 60.0));
    let hair = app.world_mut().spawn((Hair, SleepSettings::never())).id();
    let bent = |t: f32| Vec3::new((9.0 * t).sin(), -(9.0 * t).cos(), 4.0 * t) * 0.02;
    let strands = [|t: f32| Vec3::NEG_Y * t, bent].map(|path| {
        let points: Vec<Vec3> = (0..12).map(|i| path(0.02 * i as f32)).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id()
    });
    (app, strands)
}

#[test]
fn a_pause_changes_no_bit() {
    let (mut app, strands) = at_rest();
    run(&mut app, 0.5);
    // In the middle of a swing, and at rest.
    for _ in 0..2 {
        let before: Vec<Strand> = strands.iter().map(|s| strand(&app, *s).clone()).collect();
        app.world_mut().resource_mut::<Time<Virtual>>().pause();
        // A minute, in frames of a quarter of a second.
        app.insert_resource(TimeUpdateStrategy::ManualDuration(Duration::from_millis(250)));
        (0..240).for_each(|_| app.update());
        app.insert_resource(frames(1.0 / 60.0));
        app.world_mut().resource_mut::<Time<Virtual>>().unpause();
        for (before, now) in before.iter().zip(&strands) {
            let now = strand(&app, *now);
            assert_eq!(before.positions(), now.positions());
            assert_eq!(before.velocities(), now.velocities());
            assert_eq!(before.orientations(), now.orientations());
        }
        run(&mut app, 20.0);
    }
}

#[test]
fn in_slow_motion_hair_comes_to_rest_in_the_same_shape() {
    let settled = |speed: f64, seconds: f64| {
        let (mut app, strands) = at_rest();
        app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed_f64(speed);
        // Three frames for each tick in slow motion.
        app.insert_resource(frames(1.0 / 60.0 / speed / if speed < 1.0 { 3.0 } else { 1.0 }));
        let updates = seconds * 60.0 * if speed < 1.0 { 3.0 } else { 1.0 };
        (0..updates as u32).for_each(|_| app.update());
        nodes(&app, &strands)
    };
    let (fast, slow) = (settled(1.0, 20.0), settled(0.1, 20.0));
    assert!(farthest(&fast, &slow) < 1e-4, "{} m", farthest(&fast, &slow));
}

#[test]
fn hair_that_is_out_of_sight_settles_all_the_same() {
    let mut app = test_app(60.0);
    let (hair, strands) = spawn(&mut app, true);
    app.world_mut().entity_mut(hair).insert((HairLod::default(), HairScreenShare(0.0)));
    // A budget freezes it as little.
    app.insert_resource(HairBudget { milliseconds: 0.0, ..default() });
    until_drawn(&mut app, hair);
    app.insert_resource(HairBudget::default());
    run(&mut app, 0.1);
    let owner = |app: &App| *app.world().get::<MotionOwner>(hair).unwrap();
    assert_eq!(owner(&app), MotionOwner::Frozen, "it has settled");
    app.world_mut().entity_mut(hair).insert(HairScreenShare(1.0));
    app.update();
    assert_eq!(owner(&app), MotionOwner::Simulated);
    let first = nodes(&app, &strands);
    run(&mut app, 2.0);
    let seen = farthest(&first, &nodes(&app, &strands));
    assert!(seen < 3e-3, "it falls by {seen} m in view");
}

#[test]
fn hair_settles_while_time_stands_still_or_goes_slowly() {
    let settled = {
        let mut app = test_app(60.0);
        let (hair, strands) = spawn(&mut app, true);
        until_drawn(&mut app, hair);
        nodes(&app, &strands)
    };
    for speed in [0.0, 0.1] {
        let mut app = test_app(60.0);
        app.insert_resource(frames(1.0 / 60.0));
        let mut time = app.world_mut().resource_mut::<Time<Virtual>>();
        match speed {
            0.0 => time.pause(),
            speed => time.set_relative_speed(speed),
        }
        let (hair, strands) = spawn(&mut app, true);
        let place = Transform::from_xyz(3.0, 1.0, 0.0).with_rotation(Quat::from_rotation_y(1.0));
        let colliders: Vec<Entity> = {
            let mut all = app.world_mut().query_filtered::<Entity, With<HairCollider>>();
            all.iter(app.world()).collect()
        };
        for entity in [hair].into_iter().chain(colliders) {
            app.world_mut().entity_mut(entity).insert(place);
        }
        wait_for(&mut app, |app| (!app.world().entity(hair).contains::<Settling>()).then_some(()));
        let ticks = app.world().resource::<Time<Fixed>>().elapsed_secs() * 60.0;
        let apart = farthest(&settled, &nodes(&app, &strands));
        println!(
            "at a speed of {speed}: {apart} m from where it settles else, after {ticks} ticks"
        );
        assert!(apart < 3e-3 && ticks < 29.0, "{apart} m after {ticks} ticks");
        app.world_mut().resource_mut::<Time<Virtual>>().unpause();
        app.world_mut().resource_mut::<Time<Virtual>>().set_relative_speed(1.0);
        run(&mut app, 1.0);
        assert!(farthest(&settled, &nodes(&app, &strands)) < 3e-3);
    }
}
