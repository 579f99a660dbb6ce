//! The wind of the place and zones, through a real app.

use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::{HairWind, WindZone, ZoneShape, prelude::*, water::WaterPlugin};

/// Angle from straight down at which hair hangs after some seconds, on the mean of the last (rad).
fn leans(app: &mut App, e: Entity) -> Vec3 {
    run(app, 4.0);
    let mut sum = Vec3::ZERO;
    for _ in 0..60 {
        app.update();
        let s = strand(app, e);
        sum += s.positions()[s.edges()] - s.positions()[0];
    }
    sum / 60.0
}

/// Soft hair that hangs.
fn hanging() -> (App, Entity, Entity) {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(HairStiffness::from_bending_length(0.02).unwrap()));
    let (hair, e) = one_strand(&mut app, 0.2, 16, Vec3::NEG_Y);
    (app, hair, e)
}

fn wind(velocity: Vec3, gusts: f32) -> HairWind {
    HairWind { velocity, gusts, ..default() }
}

#[test]
fn soft_hair_hangs_along_gravity_and_what_the_wind_pulls() {
    for speed in [2.0_f32, 4.9] {
        let (mut app, _, e) = hanging();
        app.insert_resource(wind(Vec3::X * speed, 0.0));
        let lean = leans(&mut app, e);
        // v' = g - rate (v - u): at rest hair feels g + rate u.
        let pull = Vec3::new(AirDrag::default().rate * speed, -9.8, 0.0);
        let off = lean.angle_between(pull);
        assert!(off < 0.12, "{lean} in place of along {pull}: {off}");
        assert!(strand(&app, e).peak_strain() < 1e-3);
    }
}

/// Taken for motion, the wind of a substep would bend hair that is at rest under it: soft hair swung by 4° for ever, and
/// its velocities read 0.36 m/s.
#[test]
fn hair_comes_to_rest_in_any_steady_wind() {
    for speed in [0.0, 2.0, 5.0, 7.0, 10.0, 20.0, 30.0] {
        let mut app = test_app(60.0);
        app.insert_resource(wind(Vec3::X * speed, 0.0));
        app.insert_resource(HairDefault(SleepSettings::never()));
        let mut strands = Vec::new();
        for (bending_length, segments) in
            [0.01, 0.05, 0.2].into_iter().flat_map(|length| [8, 16, 32].map(|n| (length, n)))
        {
            let (hair, e) = one_strand(&mut app, 0.3, segments, Vec3::NEG_Y);
            let stiffness = HairStiffness::from_bending_length(bending_length).unwrap();
            app.world_mut().entity_mut(hair).insert(stiffness);
            strands.push((e, bending_length, segments));
        }
        run(&mut app, 12.0);
        let places = |app: &App| -> Vec<Vec3> {
            strands.iter().map(|(e, ..)| *strand(app, *e).positions().last().unwrap()).collect()
        };
        let mut seen = vec![places(&app)];
        for _ in 0..60 {
            app.update();
            seen.push(places(&app));
        }
        for (i, (e, bending_length, segments)) in strands.iter().enumerate() {
            let tips = seen.windows(2).map(|two| two[0][i].distance(two[1][i]) * 60.0);
            let real = tips.fold(0.0, f32::max);
            let read = strand(&app, *e).velocities().iter().map(|v| v.length());
            let read = read.fold(0.0, f32::max);
            let what = format!("{speed} m/s, {segments} segments of {bending_length} m");
            println!("{what}: tip at {real} m/s, velocities of {read}");
            assert!(real < 5e-3, "{what}: the tip goes on at {real} m/s");
            assert!(read < 1e-2, "{what}: velocities of {read} m/s at rest");
        }
    }
}

#[test]
fn a_turned_and_scaled_head_feels_the_wind_of_the_world() {
    let (mut app, hair, e) = hanging();
    let turn = Quat::from_rotation_y(1.2);
    *app.world_mut().get_mut::<Transform>(hair).unwrap() =
        Transform::from_rotation(turn).with_scale(Vec3::splat(3.0));
    app.insert_resource(wind(Vec3::X * 4.9, 0.0));
    let lean = turn * leans(&mut app, e);
    assert!(lean.x > 0.1 && lean.z.abs() < 0.01, "{lean}");
}

#[test]
fn gusts_move_hair_and_are_the_seeds_own() {
    let sway = |gusts: f32, seed: u32| {
        let (mut app, _, e) = hanging();
        app.insert_resource(HairWind { seed, ..wind(Vec3::X * 3.0, gusts) });
        run(&mut app, 3.0);
        let xs: Vec<f32> = (0..240)
            .map(|_| {
                app.update();
                strand(&app, e).positions()[16].x
            })
            .collect();
        let (low, high) = xs.iter().fold((f32::MAX, f32::MIN), |(l, h), x| (l.min(*x), h.max(*x)));
        (high - low, xs)
    };
    let (still, _) = sway(0.0, 0);
    let (moved, path) = sway(0.6, 0);
    // A pendulum that was let go three seconds ago.
    assert!(still < 0.01, "{still}");
    assert!(moved > 0.04, "{moved}");
    assert_eq!(sway(0.6, 0).1, path, "the same bits");
    assert_ne!(sway(0.6, 1).1, path);
}

#[test]
fn indoors_there_is_no_wind_and_outside_there_is() {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(HairStiffness::from_bending_length(0.02).unwrap()))
        .insert_resource(wind(Vec3::X * 5.0, 0.5));
    let shelter = WindZone { half_size: Vec3::splat(1.0), falloff: 0.1, ..WindZone::shelter() };
    app.world_mut().spawn((shelter, Transform::from_rotation(Quat::from_rotation_y(0.5))));
    let (_, inside) = one_strand(&mut app, 0.2, 16, Vec3::NEG_Y);
    let (hair, outside) = one_strand(&mut app, 0.2, 16, Vec3::NEG_Y);
    app.world_mut().get_mut::<Transform>(hair).unwrap().translation.x = 3.0;
    // In a corner of the room: in the box, outside of an ellipsoid of its size.
    let (hair, corner) = one_strand(&mut app, 0.2, 16, Vec3::NEG_Y);
    let place = Quat::from_rotation_y(0.5) * Vec3::new(0.8, 0.9, 0.8);
    app.world_mut().get_mut::<Transform>(hair).unwrap().translation = place;
    assert!(leans(&mut app, outside).x > 0.1);
    assert!(leans(&mut app, corner).x.abs() < 1e-3);
    assert!(leans(&mut app, inside).x.abs() < 1e-3);
}

#[test]
fn a_fan_and_a_blast_move_hair_in_their_place() {
    let at = |zone: WindZone, place: Vec3| {
        let (mut app, _, e) = hanging();
        app.world_mut().spawn((
            zone,
            Transform::from_translation(place).with_rotation(Quat::from_rotation_y(0.5)),
        ));
        leans(&mut app, e)
    };
    let fan = WindZone::new(0.5, Vec3::X * 5.0).unwrap();
    let blown = at(fan, Vec3::ZERO);
    let expected = Quat::from_rotation_y(0.5) * Vec3::X;
    assert!(blown.with_y(0.0).normalize().distance(expected) < 0.02, "{blown}");
    assert!(at(fan, Vec3::X * 2.0).with_y(0.0).length() < 1e-3, "beyond its falloff");
    let blast = WindZone { outward: 10.0, ..default() };
    assert!(at(blast, Vec3::new(-0.3, -0.1, 0.0)).x > 0.1);
}

#[test]
fn wind_wakes_hair_that_sleeps_and_calm_lets_it_sleep_again() {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(SleepSettings::default()));
    let (_, e) = one_strand(&mut app, 0.1, 8, Vec3::NEG_Y);
    let asleep = |app: &App| app.world().get::<StrandSleep>(e).unwrap().is_asleep();
    run(&mut app, 8.0);
    assert!(asleep(&app));
    app.insert_resource(wind(Vec3::X * 2.0, 0.3));
    run(&mut app, 0.5);
    assert!(!asleep(&app));
    assert!(strand(&app, e).positions()[8].x > 1e-3);
    app.insert_resource(HairWind::default());
    run(&mut app, 12.0);
    assert!(asleep(&app));
}

#[test]
fn a_fire_and_wind_dry_wet_hair() {
    let left = |zone: Option<WindZone>, velocity: Vec3| {
        let (mut app, hair, e) = hanging();
        app.insert_resource(wind(velocity, 0.3)).insert_resource(HairProcessTime(60.0));
        if let Some(zone) = zone {
            app.world_mut().spawn((zone, Transform::from_xyz(0.5, -0.1, 0.0)));
        }
        app.world_mut().write_message(SoakHair { target: hair, wetness: 1.0 });
        run(&mut app, 4.0);
        app.world().get::<Moisture>(e).unwrap().volume()
    };
    let still = left(None, Vec3::ZERO);
    let windy = left(None, Vec3::X * 4.0);
    let warm = left(Some(WindZone::fire()), Vec3::ZERO);
    println!("left of the water: {still:.3e}, in wind {windy:.3e}, by a fire {warm:.3e} m³");
    assert!(windy < 0.8 * still && warm < 0.8 * still);
}

#[test]
fn a_fire_sets_dry_hair() {
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.2, 8, Vec3::NEG_Y);
    run(&mut app, 0.1);
    let rates =
        |app: &App| app.world().get::<Bonds>(e).unwrap().rates(BondKind::Hydrogen).sum::<f32>();
    app.world_mut().write_message(HairTreatment::set(e, BondKind::Hydrogen, 0.0).unwrap());
    run(&mut app, 0.1);
    assert!(rates(&app) < 0.1);
    run(&mut app, 1.0);
    let alone = rates(&app);
    app.world_mut().spawn((WindZone::fire(), Transform::from_xyz(0.3, -0.1, 0.0)));
    run(&mut app, 1.0);
    assert!(rates(&app) > alone + 0.5, "{} after {alone}", rates(&app));
}

#[test]
fn droplets_drift_with_the_wind() {
    let mut app = test_app(60.0);
    app.insert_resource(wind(Vec3::X * 5.0, 0.0));
    let drop = app.world_mut().spawn(Droplet::new(Vec3::Y, 1e-9).unwrap()).id();
    run(&mut app, 0.3);
    let drop = app.world().get::<Droplet>(drop).unwrap();
    assert!(drop.position.x > 0.1, "{}", drop.position);
}

#[test]
fn nonsense_is_reported_and_breaks_nothing_and_the_water_is_not_needed() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::default().build().disable::<WaterPlugin>()));
    let mut app2 = test_app(60.0);
    for app in [&mut app, &mut app2] {
        app.insert_resource(HairWind {
            velocity: Vec3::new(f32::NAN, 1e9, 0.0),
            gusts: -1.0,
            gust_length: 0.0,
            seed: u32::MAX,
        });
        let (_, e) = one_strand(app, 0.2, 8, Vec3::NEG_Y);
        let zone = WindZone {
            shape: ZoneShape::Ellipsoid,
            half_size: Vec3::new(0.0, f32::INFINITY, -1.0),
            falloff: f32::NAN,
            outward: 1e30,
            warmth: f32::INFINITY,
            drying: f32::NAN,
            ..default()
        };
        app.world_mut().spawn((zone, Transform::from_scale(Vec3::splat(1e-3))));
        for _ in 0..60 {
            app.update();
        }
        assert!(strand(app, e).is_finite());
        assert!(strand(app, e).peak_strain() < 0.05);
    }
    assert!(faults(&mut app2).len() >= 3);
    assert!(WindZone::new(f32::NAN, Vec3::ZERO).is_err());
}

#[test]
fn a_blower_out_of_the_worlds_measure_breaks_nothing() {
    let mut app = test_app(60.0);
    let (hair, e) = one_strand(&mut app, 0.2, 8, Vec3::NEG_Y);
    app.world_mut().write_message(SoakHair { target: hair, wetness: 1.2 });
    // In the measure of the hair its place is infinite, and its wind would be NaN.
    app.world_mut().get_mut::<Transform>(hair).unwrap().scale = Vec3::splat(0.1);
    app.world_mut().spawn((Blower::default(), Transform::from_xyz(1e38, 1e38, 3e38)));
    for _ in 0..60 {
        app.update();
        let ledger = app.world().resource::<WaterLedger>();
        assert!(ledger.held.is_finite() && ledger.error() < 1e-9, "{ledger:?}");
    }
    assert!(strand(&app, e).is_finite());
    assert!(faults(&mut app).is_empty());
}
