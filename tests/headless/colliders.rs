//! Boxes, ellipsoids, convex hulls and baked distances through a real app, and what cannot be baked.

use crate::common::*;
use bevy::{prelude::*, reflect::ReflectMut};
use bevy_keratin::{
    ColliderShape,
    forces::contact::{Bake, BakeError, DistanceGrid, HullError, Openings},
    prelude::*,
};

pub const FACES: [[u32; 3]; 12] = [
    [0, 2, 1],
    [1, 2, 3],
    [4, 5, 6],
    [5, 7, 6],
    [0, 1, 4],
    [1, 5, 4],
    [2, 6, 3],
    [3, 6, 7],
    [0, 4, 2],
    [2, 4, 6],
    [1, 3, 5],
    [3, 7, 5],
];

pub fn corners(half: Vec3) -> [Vec3; 8] {
    core::array::from_fn(|k| {
        let way = |bit: usize| if k & bit != 0 { 1.0 } else { -1.0 };
        half * Vec3::new(way(1), way(2), way(4))
    })
}

const CELL: f32 = 0.005;

fn baked(half: Vec3) -> HairCollider {
    HairCollider::grid(DistanceGrid::bake(&corners(half), &FACES, CELL).unwrap())
}

/// How deep a place is in a box.
fn in_box(p: Vec3, half: Vec3) -> f32 {
    (half - p.abs()).min_element()
}

const HALF: Vec3 = Vec3::new(0.1, 0.08, 0.12);

fn in_rounded(p: Vec3) -> f32 {
    let q = p.abs() - (HALF - 0.03);
    0.03 - q.max(Vec3::ZERO).length() - q.max_element().min(0.0)
}

/// Of each shape how deep a place is in it, and how much its edges are rounded off.
fn shapes() -> [(&'static str, HairCollider, fn(Vec3) -> f32, f32); 5] {
    [
        ("box", HairCollider::cuboid(2.0 * HALF).unwrap(), |p| in_box(p, HALF), 0.0),
        ("rounded box", HairCollider::rounded_cuboid(2.0 * HALF, 0.03).unwrap(), in_rounded, 0.0),
        (
            "ellipsoid",
            HairCollider::ellipsoid(HALF).unwrap(),
            |p| (1.0 - (p / HALF).length()) * HALF.min_element(),
            0.0,
        ),
        ("hull", HairCollider::hull(&corners(HALF)).unwrap(), |p| in_box(p, HALF), 0.0),
        ("grid", baked(HALF), |p| in_box(p, HALF), 0.3 * CELL),
    ]
}

#[test]
fn hair_rests_on_every_shape_and_never_in_it() {
    // As it is, and turned and scaled.
    let at = Vec3::new(0.1, -0.14, 0.0);
    let turn = Quat::from_euler(EulerRot::XYZ, 0.4, 0.9, -0.3);
    let places = [
        Transform::from_translation(at),
        Transform::from_translation(at).with_rotation(turn).with_scale(Vec3::splat(0.8)),
    ];
    for (name, collider, inside, rounded) in shapes() {
        for place in places {
            let mut app = test_app(60.0);
            let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
            app.world_mut().spawn((collider.clone(), place));
            let scale = place.scale.x;
            let depth =
                |p: Vec3| scale * inside(place.compute_affine().inverse().transform_point3(p));
            let mut deepest = f32::MIN;
            for _ in 0..300 {
                app.update();
                let nodes = &strand(&app, e).positions()[1..];
                deepest = nodes.iter().map(|p| depth(*p)).fold(deepest, f32::max);
            }
            println!("{name}: {} mm within", deepest * 1e3);
            assert!(deepest < 1e-5 + rounded * scale, "{name}: {deepest} m inside");
            assert!(deepest > -2e-3, "{name} was not even touched");
            assert!(strand(&app, e).peak_strain() < 0.03);
            assert_eq!(faults(&mut app), []);
        }
    }
}

#[test]
fn moving_shapes_carry_hair_along() {
    let half = Vec3::new(0.3, 0.05, 0.3);
    let flat = [
        ("box", HairCollider::cuboid(2.0 * half).unwrap()),
        ("ellipsoid", HairCollider::ellipsoid(Vec3::new(2.0, 0.05, 2.0)).unwrap()),
        ("hull", HairCollider::hull(&corners(half)).unwrap()),
        ("grid", baked(half)),
    ];
    for (name, collider) in flat {
        let carried = |friction: f32| {
            let mut app = test_app(60.0);
            app.insert_resource(HairDefault(crate::common::equally_stiff()));
            let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
            let collider = collider.clone().with_friction(friction).unwrap();
            let floor = app.world_mut().spawn((collider, Transform::from_xyz(0.0, -0.2, 0.0))).id();
            app.world_mut().get_mut::<Strand>(e).unwrap().positions_mut()[8].x = 0.01;
            run(&mut app, 3.0);
            let before = strand(&app, e).positions()[8];
            for frame in 1..=60 {
                let mut place = app.world_mut().get_mut::<Transform>(floor).unwrap();
                place.translation.z = frame as f32 * 1e-3;
                app.update();
            }
            (strand(&app, e).positions()[8] - before).z
        };
        let (rough, smooth) = (carried(1.0), carried(0.0));
        println!("{name}: carried {rough} m of 0.06, {smooth} without friction");
        assert!(rough > 0.02, "{name} carried {rough} m of 0.06");
        assert!(smooth.abs() < 5e-3, "{name} slipped along {smooth} m");
    }
}

/// A plate of 2 cm that comes at a hanging strand at 10 m/s: within a substep it goes as far as it is
/// thick.
#[test]
fn fast_shapes_do_not_pass_through() {
    let half = Vec3::new(0.2, 0.2, 0.01);
    let plates = [
        ("box", HairCollider::cuboid(2.0 * half).unwrap()),
        ("ellipsoid", HairCollider::ellipsoid(Vec3::new(0.2, 0.2, 0.01)).unwrap()),
        ("hull", HairCollider::hull(&corners(half)).unwrap()),
        ("grid", baked(half)),
    ];
    for (name, plate) in plates {
        let mut app = test_app(60.0);
        let (_, id) = one_strand(&mut app, 0.3, 30, Vec3::NEG_Y);
        settle(&mut app, id, 20.0);
        let place = |z: f32| Transform::from_xyz(0.0, -0.25, z);
        let plate = app.world_mut().spawn((plate, place(-0.205))).id();
        app.update();
        for i in 1..=2 {
            *app.world_mut().get_mut::<Transform>(plate).unwrap() = place(-0.205 + 0.15 * i as f32);
            app.update();
        }
        let z = app.world().get::<Transform>(plate).unwrap().translation.z;
        let node = strand(&app, id).positions()[24];
        println!("{name}: plate at {z}, node {node}");
        assert!(node.z > z, "{name}: plate at {z} m, node at {node}");
    }
}

#[test]
fn drops_lie_on_every_shape() {
    for (name, collider, inside, rounded) in shapes() {
        let mut app = test_app(60.0);
        app.world_mut().spawn(collider);
        let drop = Droplet::new(Vec3::new(0.01, 0.15, 0.01), 4e-9).unwrap();
        let drop = app.world_mut().spawn(drop).id();
        // On what is round it slides off.
        let (mut deepest, mut radius) = (f32::MIN, 0.0);
        for _ in 0..30 {
            app.update();
            let drop = app.world().get::<Droplet>(drop).unwrap();
            radius = drop.radius();
            deepest = deepest.max(inside(drop.position));
        }
        assert!(deepest < rounded && deepest > -2.0 * radius, "{name}: {deepest} m within");
    }
}

#[test]
fn sleeping_hair_wakes_for_a_shape_that_comes() {
    for (name, collider, ..) in shapes() {
        let mut app = test_app(60.0);
        app.insert_resource(HairDefault(SleepSettings { seconds: 0.2, ..default() }));
        let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
        let far = Transform::from_xyz(0.4, -0.2, 0.0);
        let box_ = app.world_mut().spawn((collider, far)).id();
        run(&mut app, 12.0);
        let asleep = |app: &App| app.world().get::<StrandSleep>(e).unwrap().is_asleep();
        assert!(asleep(&app), "{name}: at rest");
        app.world_mut().get_mut::<Transform>(box_).unwrap().translation.x = 0.08;
        run(&mut app, 0.1);
        assert!(!asleep(&app), "{name}: pushed");
        let tip = strand(&app, e).positions()[8];
        assert!(tip.x < -0.005, "{name}: pushed to {tip}");
    }
}

#[test]
fn a_grid_knows_its_box() {
    for (scale, middle) in
        [(1.0, Vec3::ZERO), (1e-2, Vec3::splat(0.3)), (100.0, Vec3::NEG_Y * 500.0)]
    {
        let points = corners(HALF).map(|p| p * scale + middle);
        let grid = DistanceGrid::bake(&points, &FACES, CELL * scale).unwrap();
        let mut worst = 0.0_f32;
        for k in 0..5000 {
            let share = |n: usize| (k as f32 * [0.754_877, 0.569_84, 0.346_1][n]).fract() - 0.5;
            let p = Vec3::new(share(0), share(1), share(2)) * 0.32;
            let q = p.abs() - HALF;
            let exact = q.max(Vec3::ZERO).length() + q.max_element().min(0.0);
            let off = (grid.distance(p * scale + middle) / scale - exact).abs();
            // Around the surface; what is deep is known less exactly.
            if exact.abs() < 3.0 * CELL {
                worst = worst.max(off);
            } else {
                assert!(off < 3.0 * CELL, "{off} m off at {p}, which is {exact}");
            }
        }
        println!("{} cells off around the surface", worst / CELL);
        assert!(worst < 0.3 * CELL, "{worst}");
    }
    // Turned inside out it is the same.
    let inverted = FACES.map(|[a, b, c]| [a, c, b]);
    let grid = DistanceGrid::bake(&corners(HALF), &inverted, CELL).unwrap();
    let deepest = grid.distance(Vec3::ZERO);
    assert!((deepest + HALF.y).abs() < 3.0 * CELL, "{deepest}: as above, less exact so deep");
}

#[test]
fn openings_are_refused_filled_or_made_a_sheet() {
    let open = &FACES[..11];
    let bake = |openings: Openings| {
        DistanceGrid::bake_with(&corners(HALF), open, &Bake { cell: CELL, openings })
    };
    let refused = bake(Openings::Refuse).unwrap_err();
    assert_eq!(refused, BakeError::Open { edges: 3 });
    assert!(refused.to_string().contains("Openings::Fill"), "{refused}");
    let filled = bake(Openings::Fill).unwrap();
    assert!((filled.distance(Vec3::X * -0.08) + 0.02).abs() < 0.2 * CELL);
    assert!(filled.distance(Vec3::ZERO) < -0.02);
    let sheet = bake(Openings::Shell { thickness: 0.02 }).unwrap();
    assert!((sheet.distance(Vec3::X * -0.1) + 0.01).abs() < 0.2 * CELL, "in the middle of it");
    assert!(sheet.distance(Vec3::ZERO) > 0.05, "it is hollow");
    // Two boxes, each within the other's end, are one.
    let moved = corners(HALF).map(|p| p + Vec3::X * 0.1);
    let both: Vec<Vec3> = corners(HALF).into_iter().chain(moved).collect();
    let faces: Vec<_> = FACES.into_iter().chain(FACES.map(|t| t.map(|v| v + 8))).collect();
    let how = Bake { cell: CELL, openings: Openings::Fill };
    let united = DistanceGrid::bake_with(&both, &faces, &how).unwrap();
    for x in [0.0, 0.05, 0.1] {
        let depth = -united.distance(Vec3::X * x);
        assert!((depth - 0.08).abs() < 2.0 * CELL, "{depth} m deep at {x}");
    }
}

#[test]
fn what_cannot_be_baked_says_why() {
    let bake = |points: &[Vec3], faces: &[[u32; 3]], cell: f32| {
        DistanceGrid::bake(points, faces, cell).unwrap_err()
    };
    let points = corners(HALF);
    assert_eq!(bake(&[], &[], 0.01), BakeError::NoTriangles);
    assert_eq!(bake(&points, &[], 0.01), BakeError::NoTriangles);
    assert_eq!(bake(&points, &[[0, 0, 1]], 0.01), BakeError::NoTriangles);
    let vertices = 8;
    assert_eq!(
        bake(&points, &[[0, 1, 99]], 0.01),
        BakeError::UnknownVertex { vertex: 99, vertices }
    );
    let mut broken = points;
    broken[5].y = f32::NAN;
    assert_eq!(bake(&broken, &FACES, 0.01), BakeError::NonFinite { vertex: 5 });
    for size in [1e-5, 1e4] {
        let error = bake(&points.map(|p| p * (size / 0.24)), &FACES, 0.1 * size);
        assert!(matches!(error, BakeError::Size { .. }), "{error}");
    }
    for cell in [0.0, -1.0, f32::NAN, f32::INFINITY, 1.0] {
        assert!(matches!(bake(&points, &FACES, cell), BakeError::Length { .. }), "{cell}");
    }
    let error = bake(&points, &FACES, 1e-4);
    let BakeError::TooManyPoints { enough, .. } = error else { panic!("{error}") };
    assert!((5e-4..3e-3).contains(&enough), "{error}");
    let thin = corners(Vec3::new(0.1, 1e-3, 0.1));
    let found = DistanceGrid::bake(&thin, &FACES, 0.03);
    assert!(matches!(found, Err(BakeError::Thin { .. })), "{found:?}");
    let hull = HairCollider::hull(&[Vec3::X; 5]).unwrap_err();
    assert_eq!(hull, HullError::Flat { found: 1 });
}

#[test]
fn sizes_out_of_range_are_reported_and_held() {
    assert!(HairCollider::cuboid(Vec3::new(1.0, 0.0, 1.0)).is_err());
    assert!(HairCollider::cuboid(Vec3::new(1.0, f32::NAN, 1.0)).is_err());
    assert!(HairCollider::rounded_cuboid(Vec3::ONE, -1.0).is_err());
    assert!(HairCollider::ellipsoid(Vec3::new(0.1, -0.1, 0.1)).is_err());
    let wrong = HairCollider::rounded_cuboid(Vec3::ONE, 9.0).unwrap_err();
    assert_eq!((wrong.found, wrong.high), (9.0, 0.5), "{wrong}");
    let wrong = HairCollider::ellipsoid(Vec3::new(1.0, 1e-3, 1.0)).unwrap_err();
    assert_eq!((wrong.found, wrong.low), (1e-3, 1e-2), "{wrong}");
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
    let cuboid = Cuboid { half_size: Vec3::new(f32::NAN, -1.0, 0.1) };
    let shape = ColliderShape::Cuboid { cuboid, rounding: f32::NAN };
    app.world_mut().spawn((HairCollider::from(shape), Transform::from_xyz(0.1, -0.2, 0.0)));
    run(&mut app, 0.5);
    assert!(strand(&app, e).is_finite());
    let reported = faults(&mut app);
    assert!(!reported.is_empty() && reported.len() <= 4, "{reported:?}");
}

/// `Dir3` keeps its length, but reflection writes into it.
#[test]
fn a_plane_whose_normal_was_written_into_still_holds_hair_up() {
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
    let mut floor = HairCollider::plane(Dir3::Y);
    if let ColliderShape::Plane(plane) = &mut floor.shape {
        let parts = plane.normal.reflect_mut();
        let ReflectMut::TupleStruct(parts) = parts else { panic!() };
        *parts.field_mut(0).unwrap().try_downcast_mut().unwrap() = Vec3::Y * 1e6;
    }
    app.world_mut().spawn((floor, Transform::from_xyz(0.0, -0.1, 0.0)));
    run(&mut app, 1.0);
    let lowest = strand(&app, e).positions().iter().map(|p| p.y).fold(0.0, f32::min);
    assert!((-0.1..-0.09).contains(&lowest), "{lowest} m");
    let reported = faults(&mut app);
    assert!(matches!(&reported[..], [f] if f.message.contains("normal")), "{reported:?}");
}

/// Short strands on a head of several solids: each root lies in a ball, deeper than some segments are long. They keep
/// their lengths, come out of it and lie still.
#[test]
fn strands_whose_root_lies_in_a_collider_come_out_whole() {
    const BALL: f32 = 0.08;
    let settings = HairPreset::Undercut.settings();
    for depth in [0.5e-3, 1.5e-3, 3e-3, 4e-3, 6e-3] {
        let mut app = test_app(60.0);
        let world = app.world_mut();
        let stiff = (settings.stiffness, settings.contact, AirDrag { rate: 3.0 });
        let hair = world.spawn((Hair, stiff)).id();
        world.spawn((HairCollider::sphere(BALL).unwrap(), Transform::default()));
        let strands: Vec<Entity> = (0..64)
            .map(|i| {
                let turn = Quat::from_rotation_y(0.3 * i as f32);
                let out = turn * Vec3::new((0.1 * i as f32).cos(), (0.1 * i as f32).sin(), 0.0);
                let lean =
                    Quat::from_axis_angle(out.any_orthonormal_vector(), 0.15 * (i % 8) as f32);
                let root = out * (BALL - depth);
                let points: Vec<Vec3> =
                    (0..12).map(|k| root + lean * out * (1.15e-3 * k as f32)).collect();
                world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id()
            })
            .collect();
        run(&mut app, 1.5);
        assert_eq!(faults(&mut app), []);
        let all = || strands.iter().map(|s| strand(&app, *s));
        let strain = all().map(Strand::peak_strain).fold(0.0, f32::max);
        let speed = all().map(rms_speed).fold(0.0, f32::max);
        let lowest = all().map(|s| s.positions()[11].length() - BALL).fold(f32::MAX, f32::min);
        println!("{depth} m deep: strain {strain}, {speed} m/s, tips {lowest} m off the ball");
        assert!(strain < 0.01, "{depth} m deep: strained by {strain}");
        assert!(speed < 0.01, "{depth} m deep: {speed} m/s");
        assert!(lowest > 0.0, "{depth} m deep: a tip is {lowest} m off");
    }
}

/// A pillow that is pressed over the roots lets nothing into the head, nor when it is taken away.
#[test]
fn a_collider_over_the_roots_opens_no_other() {
    const HEAD: f32 = 0.08;
    let mut app = test_app(60.0);
    let world = app.world_mut();
    let hair = world.spawn(Hair).id();
    world.spawn((HairCollider::sphere(HEAD).unwrap(), Transform::default()));
    // Its lowest point is 3 cm below the crown.
    let pillow = HairCollider::sphere(0.1).unwrap();
    let pillow = world.spawn((pillow, Transform::from_xyz(0.0, HEAD + 0.07, 0.0))).id();
    let strands: Vec<Entity> = (0..48)
        .map(|i| {
            let aside = Quat::from_axis_angle(Vec3::Z, 0.05 + 0.0115 * i as f32);
            let turn = Quat::from_rotation_y(2.4 * i as f32) * aside;
            // Combed away from the crown.
            let (root, way) = (turn * Vec3::Y, turn * Vec3::new(-0.9, 0.4, 0.0).normalize());
            let points: Vec<Vec3> =
                (0..14).map(|k| root * (HEAD + 1e-4) + way * (7e-3 * k as f32)).collect();
            world.spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id()
        })
        .collect();
    run(&mut app, 1.0);
    let look = |app: &App| {
        let all = || strands.iter().map(|s| strand(app, *s));
        let inside = |s: &Strand| {
            s.positions()[1..].iter().map(|p| HEAD - p.length()).fold(f32::MIN, f32::max)
        };
        let strain = all().map(Strand::peak_strain).fold(0.0, f32::max);
        (all().map(inside).fold(f32::MIN, f32::max), strain)
    };
    let is_whole = |app: &App| {
        let (inside, strain) = look(app);
        println!("{:.2} mm in the head, strained by {strain}", 1e3 * inside);
        assert!(inside < 1e-4 && strain < 0.01, "{inside} m in the head, strained by {strain}");
    };
    is_whole(&app);
    for _ in 0..60 {
        app.world_mut().get_mut::<Transform>(pillow).unwrap().translation.y += 0.2 / 60.0;
        app.update();
    }
    is_whole(&app);
    assert_eq!(faults(&mut app), []);
}
