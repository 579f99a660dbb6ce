//! Blowers, rods and held nodes through a real app.

mod common;
use bevy::prelude::*;
use bevy_keratin::{WindReceived, prelude::*, treatment::WindingProgress};
use common::*;

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
    app.world_mut().write_message(Treat::wet(e));
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
    app.world_mut().write_message(Treat::wet(e));
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
