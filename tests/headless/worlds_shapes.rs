//! Any tick rate, non-uniform scale, rain far from the origin, water that moves.

use crate::{
    colliders::{FACES, corners},
    common::*,
};
use bevy::prelude::*;
use bevy_keratin::{DropletRules, FaultKind, prelude::*};

/// In how many substeps the strands have moved.
#[derive(Resource, Default)]
struct Solves {
    count: u32,
    last: Vec<Vec3>,
}

fn count_solves(strands: Query<&Strand>, mut solves: ResMut<Solves>) {
    let now: Vec<Vec3> = strands.iter().flat_map(|s| s.positions().to_vec()).collect();
    solves.count += u32::from(now != solves.last);
    solves.last = now;
}

#[test]
fn a_tick_has_as_many_solves_of_dry_hair_as_it_needs_at_any_rate() {
    let solves = |hertz: u32, wet: bool| {
        let mut app = test_app(hertz.into());
        app.init_resource::<Solves>()
            .add_systems(HairTick, count_solves.in_set(HairSystems::Last).ambiguous_with_all());
        let (hair, _) = one_strand(&mut app, 0.2, 4, Vec3::X);
        if wet {
            app.world_mut().trigger(SoakHair::dripping(hair));
        }
        run(&mut app, 0.25);
        app.world_mut().resource_mut::<Solves>().count = 0;
        (0..hertz / 4).for_each(|_| app.update());
        (4 * app.world().resource::<Solves>().count).div_ceil(hertz)
    };
    for (hertz, expected) in
        [(60, 3), (64, 3), (72, 3), (76, 3), (92, 2), (120, 2), (144, 2), (164, 2), (180, 1)]
    {
        assert_eq!(solves(hertz, false), expected, "{hertz} Hz");
    }
    // Hair that carries water takes every substep.
    assert_eq!([solves(60, true), solves(72, true)], [6, 5]);
}

/// How far from where it hangs the tip of a strand comes to rest in wind, and where it is in the middle
/// of its first swing.
#[test]
fn hair_leans_and_swings_alike_at_any_rate() {
    let lean = |hertz: f64| {
        let mut app = test_app(hertz);
        app.insert_resource(HairWind { velocity: Vec3::X * 3.0, gusts: 0.0, ..default() });
        let (_, e) = one_strand(&mut app, 0.2, 6, Vec3::NEG_Y);
        let tip = |app: &App| {
            let tip = *strand(app, e).positions().last().unwrap();
            tip.x.atan2(-tip.y).to_degrees()
        };
        run(&mut app, 0.25);
        let swings = tip(&app);
        run(&mut app, 3.75);
        [swings, tip(&app)]
    };
    let [swings, rests] = lean(60.0);
    assert!(rests > 10.0 && swings > 3.0, "{swings} {rests}");
    for hertz in [72.0, 76.0, 92.0, 120.0, 144.0, 164.0, 240.0] {
        let found = lean(hertz);
        println!("{hertz} Hz: {found:?}, {:?} at 60", [swings, rests]);
        assert!((found[1] / rests - 1.0).abs() < 0.01, "{hertz} Hz: {found:?}, not {rests}");
        assert!((found[0] / swings - 1.0).abs() < 0.05, "{hertz} Hz: {found:?}, not {swings}");
    }
}

/// Where the nodes of a strand rest that hangs out over a solid.
fn rests_on(
    solid: HairCollider,
    parent: Transform,
    place: Transform,
) -> (Vec<Vec3>, Vec<HairFault>) {
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::new(0.98, 0.2, 0.0));
    let parent = app.world_mut().spawn(parent).id();
    app.world_mut().spawn((solid, place, ChildOf(parent)));
    run(&mut app, 1.5);
    (strand(&app, e).positions().to_vec(), faults(&mut app))
}

fn apart(a: &[Vec3], b: &[Vec3]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

/// Each scaled shape acts as one of that size does.
#[test]
fn solids_act_as_their_transform_scales_them() {
    let s = Vec3::new(2.0, 0.5, 1.25);
    let round = Vec3::new(1.5, 0.4, 1.5);
    let half = Vec3::new(0.06, 0.1, 0.1);
    let baked = |half: Vec3, cell| {
        HairCollider::grid(DistanceGrid::bake(&corners(half), &FACES, cell).unwrap())
    };
    let hull = |half| HairCollider::hull(&corners(half)).unwrap();
    let tilted = |normal: Vec3| HairCollider::plane(Dir3::new(normal).unwrap());
    let cases: [(&str, HairCollider, Vec3, HairCollider, f32); 9] = [
        (
            "ball",
            HairCollider::sphere(0.1).unwrap(),
            s,
            HairCollider::ellipsoid(0.1 * s).unwrap(),
            2e-3,
        ),
        (
            "ellipsoid",
            HairCollider::ellipsoid(half).unwrap(),
            s,
            HairCollider::ellipsoid(half * s).unwrap(),
            2e-3,
        ),
        (
            "box",
            HairCollider::rounded_cuboid(2.0 * half, 0.01).unwrap(),
            s,
            HairCollider::rounded_cuboid(2.0 * half * s, 0.005).unwrap(),
            2e-3,
        ),
        (
            "floor",
            HairCollider::cuboid(Vec3::ONE).unwrap(),
            Vec3::new(10.0, 0.2, 10.0),
            HairCollider::cuboid(Vec3::new(10.0, 0.2, 10.0)).unwrap(),
            2e-3,
        ),
        (
            "cylinder",
            HairCollider::cylinder(0.08, 0.2).unwrap(),
            round,
            HairCollider::cylinder(0.12, 0.08).unwrap(),
            2e-3,
        ),
        (
            "capsule",
            HairCollider::capsule(0.05, 0.1).unwrap(),
            Vec3::new(1.0, 2.0, 1.0),
            HairCollider::capsule(0.05, 0.3).unwrap(),
            2e-3,
        ),
        (
            "plane",
            tilted(Vec3::new(-1.0, 1.0, 0.3)),
            s,
            tilted(Vec3::new(-1.0, 1.0, 0.3) / s),
            2e-3,
        ),
        ("hull", hull(half), s, hull(half * s), 2e-3),
        ("grid", baked(half, 0.01), s, baked(half * s, 0.0025), 6e-3),
    ];
    let far = Transform::from_xyz(9.0, 0.0, 0.0);
    let (free, _) = rests_on(HairCollider::sphere(0.01).unwrap(), default(), far);
    for (k, (name, solid, scale, alike, off)) in cases.into_iter().enumerate() {
        let top = if name == "floor" { -0.2 } else { -0.12 };
        let turn = Quat::from_rotation_y(0.3);
        let at = Transform::from_xyz(0.1, top, 0.01).with_rotation(turn);
        let (expected, reported) = rests_on(alike, default(), at);
        assert_eq!(reported, []);
        assert!(apart(&expected, &free) > 5e-3, "{name} is touched");
        let (mean, _) = rests_on(
            solid.clone(),
            default(),
            at.with_scale(Vec3::splat(scale.element_product().cbrt())),
        );
        let by_mean = apart(&mean, &expected);
        // Its own scale, and by turns that of its parent, both, and a mirrored one.
        let ways = [
            (at.with_scale(scale), Transform::IDENTITY),
            (at.with_scale(Vec3::splat(2.0)), Transform::from_scale(0.5 * scale)),
            (Transform::IDENTITY, at.with_scale(scale * Vec3::new(1.0, 1.0, -1.0))),
        ];
        for (parent, own) in [(Transform::IDENTITY, at.with_scale(scale)), ways[k % 3]] {
            let (found, reported) = rests_on(solid.clone(), parent, own);
            let found = apart(&found, &expected);
            println!("{name}: {found} m off, {by_mean} by the mean");
            assert!(
                found < off && by_mean > 4.0 * off,
                "{name}: {found} m off, {by_mean} by the mean"
            );
            assert_eq!(reported, [], "{name}");
        }
    }
}

#[test]
fn what_cannot_be_scaled_so_is_told_once_with_the_scale_that_it_has() {
    let reported = |bundle: fn(&mut App) -> Entity| {
        let mut app = test_app(60.0);
        let entity = bundle(&mut app);
        run(&mut app, 0.2);
        let all = faults(&mut app);
        assert!(
            all.iter()
                .all(|fault| fault.entity == Some(entity) && fault.kind == FaultKind::Transform)
        );
        all.into_iter().map(|fault| fault.message).collect::<Vec<_>>()
    };
    let told = reported(|app| {
        let flat = Transform::from_scale(Vec3::new(4.0, 1.0, 1.0));
        app.world_mut().spawn((HairCollider::capsule(0.1, 0.2).unwrap(), flat)).id()
    });
    assert_eq!(told.len(), 1);
    assert!(
        told[0].contains("4.000, 1.000, 1.000") && told[0].contains("2.000, 1.000, 2.000"),
        "{told:?}"
    );
    let told = reported(|app| {
        let long = app.world_mut().spawn(Transform::from_scale(Vec3::new(3.0, 1.0, 1.0))).id();
        let turned = Transform::from_rotation(Quat::from_rotation_z(0.8));
        app.world_mut().spawn((HairCollider::sphere(0.1).unwrap(), turned, ChildOf(long))).id()
    });
    assert!(told.len() == 1 && told[0].contains("shears"), "{told:?}");
    for spawn in [
        |app: &mut App| {
            app.world_mut()
                .spawn((PermRod::default(), Transform::from_scale(Vec3::new(1.0, 2.0, 1.0))))
                .id()
        },
        |app: &mut App| {
            let turned = Transform::from_rotation(Quat::from_rotation_z(0.8));
            let long = app.world_mut().spawn(Transform::from_scale(Vec3::new(3.0, 1.0, 1.0))).id();
            app.world_mut().spawn((WindZone::default(), turned, ChildOf(long))).id()
        },
        |app: &mut App| {
            let turned = Transform::from_rotation(Quat::from_rotation_z(0.8));
            let long = app.world_mut().spawn(Transform::from_scale(Vec3::new(3.0, 1.0, 1.0))).id();
            app.world_mut().spawn((WaterVolume::default(), turned, ChildOf(long))).id()
        },
    ] {
        assert_eq!(reported(spawn).len(), 1);
    }
    // What is scaled evenly, mirrored or turned, or can be as it is drawn, is not.
    let told = reported(|app| {
        let parent = app.world_mut().spawn(Transform::from_scale(Vec3::new(-2.0, 2.0, 2.0))).id();
        let turned = Transform::from_rotation(Quat::from_rotation_z(0.8));
        app.world_mut().spawn((HairCollider::capsule(0.1, 0.2).unwrap(), turned, ChildOf(parent)));
        app.world_mut()
            .spawn((WindZone::shelter(), Transform::from_scale(Vec3::new(1.0, 3.0, 2.0))))
            .id()
    });
    assert_eq!(told, [""; 0]);
}

/// How far the tip of a strand of 20 cm is aside from under its root (m).
fn aside(app: &App, e: Entity) -> f32 {
    let p = strand(app, e).positions();
    let off = p[p.len() - 1] - p[0];
    off.x.hypot(off.z)
}

#[test]
fn zones_and_water_are_as_large_as_their_transform_scales_them() {
    let scale = Vec3::new(4.0, 0.25, 4.0);
    let zone = |half_size| WindZone {
        shape: ZoneShape::Box,
        half_size,
        falloff: 0.05,
        velocity: Vec3::X * 5.0,
        ..default()
    };
    let stream = |half_size| WaterVolume {
        shape: ZoneShape::Ellipsoid,
        half_size,
        current: Vec3::X * 0.3,
        ..default()
    };
    // A strand far aside in what is flat and wide, and one above it.
    let found = |spawn: &dyn Fn(&mut App)| {
        let mut app = test_app(60.0);
        app.insert_resource(HairDefault(HairWetting { soaking: 0.0, ..default() }));
        spawn(&mut app);
        let places = [Vec3::new(2.5, 0.1, 0.5), Vec3::new(0.0, 0.7, 0.0)];
        let strands = places.map(|place| {
            let (hair, e) = one_strand(&mut app, 0.2, 6, Vec3::NEG_Y);
            app.world_mut().get_mut::<Transform>(hair).unwrap().translation = place;
            e
        });
        run(&mut app, 2.0);
        assert_eq!(faults(&mut app), []);
        strands.map(|e| aside(&app, e))
    };
    let scaled = Transform::from_scale(scale);
    for (name, stretched, alike, mean) in [
        (
            "wind",
            found(&|app| _ = app.world_mut().spawn((zone(Vec3::ONE), scaled))),
            found(&|app| _ = app.world_mut().spawn(zone(scale))),
            found(&|app| _ = app.world_mut().spawn(zone(Vec3::splat(1.587)))),
        ),
        (
            "water",
            found(&|app| _ = app.world_mut().spawn((stream(Vec3::ONE), scaled))),
            found(&|app| _ = app.world_mut().spawn(stream(scale))),
            found(&|app| _ = app.world_mut().spawn(stream(Vec3::splat(1.587)))),
        ),
    ] {
        println!("{name}: {stretched:?}, {alike:?} without a scale, {mean:?} of a cube");
        assert!(
            (stretched[0] - alike[0]).abs() < 1e-3 && stretched[1] < 1e-3,
            "{name} {stretched:?}"
        );
        assert!(alike[0] > 0.03 && alike[1] < 1e-3, "{name} {alike:?}");
        assert!(mean[0] < 1e-3 && mean[1] > 0.03, "{name} {mean:?}");
    }
}

/// Water in and on hair after two seconds of rain (m³), and how many drops there are.
fn rained_on(place: Vec3, rules: DropletRules) -> (f64, usize) {
    let mut app = test_app(60.0);
    app.insert_resource(rules);
    let hair = app.world_mut().spawn((Hair, Transform::from_translation(place))).id();
    for i in 0..36 {
        let root = Vec3::new(0.01 * (i % 6) as f32 - 0.025, 0.0, 0.01 * (i / 6) as f32 - 0.025);
        let points: Vec<Vec3> =
            (0..6).map(|k| root + Vec3::new(0.02, -0.01, 0.0) * k as f32).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    let above = Transform::from_translation(place + Vec3::Y).looking_to(Dir3::NEG_Y, Dir3::X);
    app.world_mut().spawn((Shower::rain(400.0, 0.08).unwrap(), above));
    run(&mut app, 2.0);
    assert_eq!(faults(&mut app), []);
    assert!(app.world().resource::<WaterLedger>().error() < 1e-9);
    let held = app.world_mut().query::<&Moisture>().iter(app.world()).map(Moisture::volume).sum();
    (held, app.world_mut().query::<&Droplet>().iter(app.world()).count())
}

#[test]
fn rain_wets_as_much_far_from_the_origin() {
    let (near, drops) = rained_on(Vec3::ZERO, default());
    assert!(near > 1e-8, "{near}");
    for (place, off) in [
        (Vec3::new(150.0, 0.0, 0.0), 0.03),
        (Vec3::new(0.0, -150.0, 120.0), 0.03),
        (Vec3::new(3000.0, 100.0, -4000.0), 0.15),
    ] {
        let (far, there) = rained_on(place, default());
        println!("{place}: {far} m³ and {there} drops, {near} m³ and {drops} at the origin");
        assert!((far / near - 1.0).abs() < off, "{place}: {far} of {near}");
        assert!(
            (there as f64 / drops as f64 - 1.0).abs() < 0.1,
            "{place}: {there} of {drops} drops"
        );
    }
    // Bounds of one's own in the world still hold.
    let rules = DropletRules { max: Vec3::splat(100.0), ..default() };
    assert_eq!(rained_on(Vec3::X * 150.0, rules), (0.0, 0));
    let rules = DropletRules { removal_distance: 0.5, ..default() };
    assert_eq!(rained_on(Vec3::ZERO, rules), (0.0, 0), "the cloud is too high");
}

/// A head in a bath of 2 m that move together, and how far its hair leans there (degrees).
fn in_bath(
    velocity: Vec3,
    turning: f32,
    offset: Vec3,
    bath: WaterVolume,
    inertia: HairInertia,
) -> f32 {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(HairWetting { fibres: 100.0, soaking: 0.0, ..default() }));
    let ship = app.world_mut().spawn(Transform::default()).id();
    app.world_mut().spawn((bath, Transform::default(), ChildOf(ship)));
    let (hair, e) = one_strand(&mut app, 0.2, 8, Vec3::NEG_Y);
    app.world_mut().entity_mut(hair).insert((
        Transform::from_translation(offset),
        ChildOf(ship),
        inertia,
    ));
    for tick in 1..=300 {
        let seconds = tick as f32 / 60.0;
        let mut place = app.world_mut().get_mut::<Transform>(ship).unwrap();
        place.translation = velocity * seconds;
        place.rotation = Quat::from_rotation_y(turning * seconds);
        app.update();
    }
    let p = strand(&app, e).positions();
    aside(&app, e).atan2(-(p[p.len() - 1] - p[0]).y).to_degrees()
}

#[test]
fn water_goes_with_what_carries_it() {
    let pool = WaterVolume::pool(Vec3::ONE).unwrap();
    let stream = WaterVolume { current: Vec3::Z * 0.1, ..pool };
    let (fast, half) = (Vec3::X * 2.0, HairInertia { moving: 0.4, turning: 0.4, ..default() });
    for bath in [pool, stream] {
        let rests = in_bath(Vec3::ZERO, 0.0, Vec3::ZERO, bath, default());
        for inertia in [HairInertia::default(), half] {
            let moves = in_bath(fast, 0.0, Vec3::ZERO, bath, inertia);
            println!("{moves}° at 2 m/s, {rests}° at rest, current {}", bath.current);
            assert!((moves - rests).abs() < 1.0, "{moves}° at 2 m/s, {rests}° at rest");
        }
    }
    let turns = in_bath(Vec3::ZERO, 0.5, Vec3::X * 0.5, pool, default());
    println!("{turns}° where it turns");
    assert!(turns < 8.0, "{turns}");
    // Through water that rests it is dragged.
    let lake = WaterVolume { half_size: Vec3::splat(1e3), ..pool };
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(HairWetting { fibres: 100.0, soaking: 0.0, ..default() }));
    app.world_mut().spawn(lake);
    let (hair, e) = one_strand(&mut app, 0.2, 8, Vec3::NEG_Y);
    for tick in 1..=300 {
        app.world_mut().get_mut::<Transform>(hair).unwrap().translation =
            fast * (tick as f32 / 60.0);
        app.update();
    }
    let p = strand(&app, e).positions();
    let dragged = aside(&app, e).atan2(-(p[8] - p[0]).y).to_degrees();
    assert!(dragged > 60.0, "{dragged}");
}
