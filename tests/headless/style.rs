//! Blowers, rods and held nodes through a real app.

use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::{Shower, WindReceived, keratin::treatment::WindingProgress, prelude::*};

fn wind_on(at: Vec3, aim: Vec3, direction: Vec3) -> f32 {
    let mut app = test_app(60.0);
    no_gravity(&mut app);
    let (_, e) = one_strand(&mut app, 0.03, 1, direction);
    app.world_mut().entity_mut(e).insert(WindReceived::default());
    app.world_mut().spawn((
        Blower::new(3.6).unwrap(),
        Transform::from_translation(at).looking_to(aim, Vec3::Y),
    ));
    app.update();
    app.world().get::<WindReceived>(e).unwrap().total[0]
}

#[test]
fn wind_is_that_of_equation_17() {
    // one tick of 1/60 s at 3.6 m/s² on the axis, across the edge
    assert!((wind_on(Vec3::NEG_X, Vec3::X, Vec3::Y) - 0.06).abs() < 1e-3);
    // 3 cm beside the axis: a group
    assert!((wind_on(Vec3::new(-1.0, 0.0, 0.03), Vec3::X, Vec3::Y) - 0.015).abs() < 5e-4);
    // along the edge, and behind the nozzle: nothing
    assert!(wind_on(Vec3::NEG_X, Vec3::X, Vec3::X) < 1e-6);
    assert_eq!(wind_on(Vec3::X, Vec3::X, Vec3::Y), 0.0);
}

#[test]
fn despawning_the_blower_ends_the_wind() {
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.12, 4, Vec3::NEG_Y);
    app.world_mut().entity_mut(e).insert(WindReceived::default());
    let at = Transform::from_xyz(-0.2, 0.0, 0.0).looking_to(Vec3::X, Vec3::Y);
    let blower = app.world_mut().spawn((Blower::default(), at)).id();
    app.world_mut().write_message(HairTreatment::wet(e));
    run(&mut app, 0.5);
    let total = |app: &App| app.world().get::<WindReceived>(e).unwrap().total[1];
    let rate = |app: &App| app.world().get::<Bonds>(e).unwrap().joints[1].rates[0];
    assert!(total(&app) > 0.0 && rate(&app) > 0.0, "it blows and dries");
    app.world_mut().entity_mut(blower).despawn();
    app.update();
    let before = (total(&app), rate(&app));
    run(&mut app, 0.5);
    assert_eq!(before, (total(&app), rate(&app)));
}

#[test]
fn drying_follows_equation_19_and_stops_when_dry() {
    let mut app = test_app(60.0);
    no_gravity(&mut app);
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::Y);
    app.world_mut().entity_mut(e).insert(WindReceived::default());
    app.world_mut().write_message(HairTreatment::wet(e));
    app.update();
    app.world_mut().spawn((
        Blower::default(),
        Transform::from_xyz(-0.3, 0.1, 0.0).looking_to(Vec3::X, Vec3::Y),
    ));
    run(&mut app, 4.0);
    let wind = &app.world().get::<WindReceived>(e).unwrap().total;
    let bonds = app.world().get::<Bonds>(e).unwrap();
    let mut dry = 0;
    for (w, b) in wind.iter().zip(bonds.rates(BondKind::Hydrogen)) {
        assert!((b - (0.3 * w).min(1.0)).abs() < 1e-4, "rate {b} after wind {w}");
        dry += usize::from(b == 1.0);
    }
    assert!(dry > 0 && dry < 8, "the axis is dry, its sides are not");
}

fn wound() -> (App, Entity, Entity) {
    let mut app = test_app(60.0);
    no_gravity(&mut app);
    let (_, e) = one_strand(&mut app, 0.48, 16, Vec3::NEG_Y);
    let rod = app
        .world_mut()
        .spawn((
            PermRod::new(0.03, 0.2).unwrap(),
            Transform::from_xyz(0.03, -0.06, 0.0)
                .with_rotation(Quat::from_rotation_x(core::f32::consts::FRAC_PI_2)),
        ))
        .id();
    app.world_mut().entity_mut(e).insert(WoundOn(rod));
    let mut peak = 0.0_f32;
    for _ in 0..180 {
        app.update();
        peak = peak.max(strand(&app, e).peak_strain());
    }
    assert!(peak < 0.02, "winding stretched the strand by {peak}");
    (app, e, rod)
}

#[test]
fn a_strand_winds_onto_its_rod_without_being_stretched() {
    let (app, e, _) = wound();
    assert_eq!(app.world().get::<WindingProgress>(e).unwrap().progress(), 1.0);
    for p in &strand(&app, e).positions()[2..] {
        let off = (p.xy() - Vec2::new(0.03, -0.06)).length();
        assert!((off - 0.03).abs() < 1e-3, "{off} m from the axis");
    }
    let mean = (3..16).map(|i| strand(&app, e).darboux(i).xyz().length()).sum::<f32>() / 13.0;
    assert!((0.03 / (2.0 * mean) - 0.03).abs() < 1e-3, "the frames follow the curve");
}

#[test]
fn despawning_the_rod_releases_the_strand() {
    let (mut app, e, rod) = wound();
    app.world_mut().entity_mut(rod).despawn();
    run(&mut app, 5.0);
    assert!(app.world().get::<WoundOn>(e).is_none());
    let tip = strand(&app, e).positions()[16];
    assert!(tip.distance(Vec3::NEG_Y * 0.48) < 0.02, "untreated hair springs back: {tip}");
}

#[test]
fn a_rod_that_moves_takes_the_hair_along() {
    let (mut app, e, rod) = wound();
    let before = strand(&app, e).positions()[10];
    for _ in 0..30 {
        app.world_mut().get_mut::<Transform>(rod).unwrap().translation.y += 5e-4;
        app.update();
    }
    let moved = strand(&app, e).positions()[10] - before;
    assert!(moved.distance(Vec3::Y * 0.015) < 1e-4, "moved {moved}");
    app.world_mut().get_mut::<Transform>(rod).unwrap().rotate_z(0.1);
    app.update();
    let turned = strand(&app, e).positions()[10] - before - Vec3::Y * 0.015;
    assert!((turned.length() - 0.003).abs() < 2e-4, "turned {turned}");
}

/// How often each event came.
#[derive(Resource, Default)]
struct Reported {
    faded: Vec<f32>,
    dried: u32,
}

fn watched(app: &mut App, hair: Entity) {
    app.init_resource::<Reported>();
    app.world_mut()
        .entity_mut(hair)
        .observe(|faded: On<StyleFaded>, mut reported: ResMut<Reported>| {
            reported.faded.push(faded.kept);
        })
        .observe(|_: On<HairDried>, mut reported: ResMut<Reported>| reported.dried += 1);
}

fn kept(app: &mut App, hair: Entity) -> Option<f32> {
    app.world().get::<KeptStyle>(hair).and_then(KeptStyle::kept)
}

/// Bent by gravity while wet and dried so: washing takes that style away.
#[test]
fn a_style_is_kept_until_it_is_washed_out_and_that_is_reported_once() {
    let mut app = test_app(60.0);
    let (hair, e) = one_strand(&mut app, 0.12, 8, Vec3::X);
    watched(&mut app, hair);
    app.world_mut().entity_mut(hair).insert(HairStyle::default());
    run(&mut app, 0.2);
    assert_eq!(kept(&mut app, hair), None, "hair as it grew has no style");
    app.world_mut().write_message(HairTreatment::wet(hair));
    run(&mut app, 1.0);
    app.world_mut().write_message(HairTreatment::dry(hair));
    run(&mut app, 0.2);
    app.world_mut().entity_mut(hair).insert(HairStyle { fades_below: 0.4 });
    run(&mut app, 0.5);
    let share = kept(&mut app, hair).expect("gravity has bent it");
    assert!((share - 1.0).abs() < 0.05, "{share}");
    assert!(app.world().resource::<Reported>().faded.is_empty());
    // Half of the hydrogen bonds hold half of it, and remember none of the shape that it takes meanwhile.
    app.world_mut().write_message(HairTreatment::set(hair, BondKind::Hydrogen, 0.5).unwrap());
    run(&mut app, 0.1);
    let half = kept(&mut app, hair).unwrap();
    assert!((0.45..0.8).contains(&half), "{half}");
    app.world_mut().write_message(HairTreatment::wet(e));
    run(&mut app, 0.5);
    assert!(kept(&mut app, hair).unwrap().abs() < 0.05);
    let reported = app.world().resource::<Reported>();
    assert!(reported.faded.len() == 1 && reported.faded[0] < 0.4, "{:?}", reported.faded);
}

#[test]
fn a_perm_is_set_by_one_call() {
    let mut app = test_app(60.0);
    no_gravity(&mut app);
    let (hair, e) = one_strand(&mut app, 0.12, 8, Vec3::X);
    run(&mut app, 0.1);
    app.world_mut().write_message_batch(HairTreatment::perm_set(hair, 0.5));
    let rates = |app: &App| app.world().get::<Bonds>(e).unwrap().joints[4].rates;
    run(&mut app, 0.48);
    assert!(rates(&app)[0] < 0.05 && rates(&app)[1] < 0.05, "lotion: {:?}", rates(&app));
    run(&mut app, 0.5);
    assert!(rates(&app)[0] < 0.05 && rates(&app)[1] > 0.9, "neutraliser: {:?}", rates(&app));
    run(&mut app, 0.6);
    assert!(rates(&app).iter().all(|rate| *rate > 0.99), "dry: {:?}", rates(&app));
    assert!(
        app.world()
            .get::<bevy_keratin::keratin::treatment::Treatments>(e)
            .unwrap()
            .acting()
            .is_empty()
    );
}

#[test]
fn wet_hair_triggers_an_event_when_it_is_dry() {
    let mut app = test_app(60.0);
    let (hair, _) = one_strand(&mut app, 0.12, 8, Vec3::NEG_Y);
    watched(&mut app, hair);
    app.insert_resource(HairProcessTime(1000.0));
    let wetness = |app: &mut App| {
        app.world_mut()
            .run_system_cached_with(
                |In(hair): In<Entity>, c: HairCondition| (c.wetness(hair), c.water(hair)),
                hair,
            )
            .unwrap()
    };
    run(&mut app, 0.1);
    assert_eq!(wetness(&mut app), (0.0, 0.0));
    assert!(wetness(&mut app).1.is_sign_positive(), "−0 is printed with its sign");
    app.world_mut().write_message(SoakHair { target: hair, wetness: 1.0 });
    run(&mut app, 0.05);
    let (wet, water) = wetness(&mut app);
    assert!(wet > 0.9 && water > 0.0, "{wet}, {water} kg");
    assert_eq!(app.world().resource::<Reported>().dried, 0);
    for _ in 0..200 {
        run(&mut app, 1.0);
        if app.world().resource::<Reported>().dried > 0 {
            break;
        }
    }
    let left = wetness(&mut app);
    assert_eq!(app.world().resource::<Reported>().dried, 1, "{left:?}");
    run(&mut app, 1.0);
    assert_eq!(app.world().resource::<Reported>().dried, 1, "reported once");
}

#[test]
fn tools_are_aimed_by_one_call() {
    let (_, dryer) = Blower::blow_dry(Vec3::new(0.3, 1.7, 0.0), Vec3::new(0.0, 1.7, 0.0));
    assert!(dryer.forward().distance(Vec3::NEG_X) < 1e-6);
    let (_, above) = Blower::blow_dry(Vec3::Y, Vec3::ZERO);
    assert!(above.forward().distance(Vec3::NEG_Y) < 1e-6);
    let (rain, cloud) = Shower::rain_on(Vec3::new(0.0, 1.6, 0.5));
    assert!(cloud.forward().distance(Vec3::NEG_Y) < 1e-6 && rain.rate > 0.0);
    assert!(cloud.translation.distance(Vec3::new(0.0, 2.6, 0.5)) < 1e-6);
}
