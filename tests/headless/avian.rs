//! Avian's colliders as obstacles for hair.
#![cfg(feature = "avian")]

use crate::common::{faults, one_strand, run, strand, test_app};
use avian3d::prelude::{
    Collider, ColliderDisabled, Gravity, LinearVelocity, PhysicsPlugins, RigidBody,
};
use bevy::{prelude::*, time::TimeUpdateStrategy, transform::TransformPlugin};
use bevy_keratin::{AvianHairCollider, AvianShapeError, ColliderShape, prelude::*};

/// Where the colliders of these tests are: below the middle of a strand along X.
const PLACE: Vec3 = Vec3::new(0.1, -0.14, 0.0);

fn body(app: &mut App, collider: Collider, place: Transform) -> Entity {
    app.world_mut().spawn((collider, AvianHairCollider::default(), place)).id()
}

fn hair_colliders(app: &mut App) -> Vec<HairCollider> {
    app.world_mut().query::<&HairCollider>().iter(app.world()).cloned().collect()
}

/// How deep below the surface of a capsule a point is (m).
fn in_capsule(p: Vec3, [a, b]: [Vec3; 2], radius: f32) -> f32 {
    let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
    radius - p.distance(a.lerp(b, along))
}

fn octahedron() -> Vec<Vec3> {
    [Vec3::X, Vec3::NEG_X, Vec3::Y, Vec3::NEG_Y, Vec3::Z, Vec3::NEG_Z].map(|p| p * 0.1).to_vec()
}

const OCTAHEDRON: [[u32; 3]; 8] =
    [[0, 2, 4], [2, 1, 4], [1, 3, 4], [3, 0, 4], [2, 0, 5], [1, 2, 5], [3, 1, 5], [0, 3, 5]];

/// Drops a strand on a collider for five seconds: the deepest that a node is within (m). A lock is
/// kept its radius of 1 mm outside.
fn drop_on(app: &mut App, id: Entity, inside: impl Fn(Vec3) -> f32) -> f32 {
    let mut deepest = f32::MIN;
    for _ in 0..300 {
        app.update();
        let nodes = &strand(app, id).positions()[1..];
        deepest = nodes.iter().map(|p| inside(*p)).fold(deepest, f32::max);
    }
    deepest
}

#[test]
fn hair_lies_on_every_shape_of_avian_and_never_in_it() {
    const SLANT: [Vec3; 2] = [Vec3::new(-0.06, -0.03, 0.01), Vec3::new(0.07, 0.02, -0.02)];
    const BENT: [Vec3; 2] = [Vec3::new(0.06, 0.03, 0.0), Vec3::new(0.06, -0.07, 0.0)];
    let slant = || Collider::capsule_endpoints(0.06, SLANT[0], SLANT[1]);
    // A ball on the right of an upright capsule, the whole turned about.
    let turned = Quat::from_rotation_y(core::f32::consts::PI);
    let pair = Collider::compound(vec![
        (Vec3::new(0.05, 0.0, 0.0), Quat::IDENTITY, Collider::sphere(0.07)),
        (Vec3::new(-0.06, -0.02, 0.0), turned, Collider::capsule(0.06, 0.1)),
    ]);
    let shapes: [(Collider, Quat, fn(Vec3) -> f32); 11] = [
        (Collider::sphere(0.1), Quat::IDENTITY, |p| 0.1 - p.length()),
        (Collider::capsule(0.1, 0.1), Quat::IDENTITY, |p| {
            in_capsule(p, [Vec3::Y * 0.05, Vec3::Y * -0.05], 0.1)
        }),
        (slant(), Quat::IDENTITY, |p| in_capsule(p, SLANT, 0.06)),
        (Collider::cylinder(0.1, 0.2), Quat::IDENTITY, |p| {
            (0.1 - p.xz().length()).min(0.1 - p.y.abs())
        }),
        (Collider::cylinder(0.06, 0.3), Quat::from_rotation_x(1.570_796_4), |p| {
            (0.06 - p.xy().length()).min(0.15 - p.z.abs())
        }),
        (Collider::half_space(Vec3::new(0.6, 0.8, 0.0)), Quat::IDENTITY, |p| {
            -p.dot(Vec3::new(0.6, 0.8, 0.0))
        }),
        (pair, turned, |p| (0.07 - p.distance(Vec3::X * -0.05)).max(in_capsule(p, BENT, 0.06))),
        (Collider::cuboid(0.16, 0.12, 0.2), Quat::IDENTITY, |p| {
            (Vec3::new(0.08, 0.06, 0.1) - p.abs()).min_element()
        }),
        (Collider::convex_hull(octahedron()).unwrap(), Quat::IDENTITY, |p| {
            (0.1 - p.abs().element_sum()) / 3f32.sqrt()
        }),
        (Collider::cone(0.1, 0.12), Quat::IDENTITY, |p| {
            // From its side; the tip is above.
            let out = Vec2::new(0.12, 0.1).normalize();
            (p.y + 0.06).min(-out.dot(Vec2::new(p.xz().length(), p.y - 0.06)))
        }),
        (Collider::trimesh(octahedron(), OCTAHEDRON.to_vec()), Quat::IDENTITY, |p| {
            // Edges are rounded off by a share of the cell, 0.2 / 48.
            (0.1 - p.abs().element_sum()) / 3f32.sqrt() - 5e-4
        }),
    ];
    for (i, (collider, turn, inside)) in shapes.into_iter().enumerate() {
        let mut app = test_app(60.0);
        let (_, id) = one_strand(&mut app, 0.24, 8, Vec3::X);
        body(&mut app, collider, Transform::from_translation(PLACE).with_rotation(turn));
        let deepest = drop_on(&mut app, id, |p| inside(p - PLACE));
        println!("shape {i}: {} mm within", deepest * 1e3);
        assert!(deepest < 1e-4, "shape {i}: {deepest} m inside");
        assert!(deepest > -2e-3, "shape {i} was not even touched");
        assert_eq!(faults(&mut app), []);
    }
}

#[test]
fn hair_follows_a_collider_that_changes_and_one_that_is_scaled() {
    let mut app = test_app(60.0);
    let (_, id) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
    // Where hair would hang, so that it lies against it.
    let center = Vec3::new(0.03, -0.14, 0.0);
    let body = body(&mut app, Collider::sphere(0.05), Transform::from_translation(center));
    let on_ball_of = |app: &mut App, radius: f32| {
        // Hair that a growing ball comes over needs a few ticks to get out.
        run(app, 0.2);
        let deepest = drop_on(app, id, |p| radius - p.distance(center));
        println!("ball of {radius} m: {} mm within", deepest * 1e3);
        assert!((-2e-3..1e-4).contains(&deepest), "{deepest} m in a ball of {radius} m");
    };
    on_ball_of(&mut app, 0.05);
    *app.world_mut().get_mut::<Collider>(body).unwrap() = Collider::sphere(0.08);
    on_ball_of(&mut app, 0.08);
    // Its body grows, by its scale.
    app.world_mut().get_mut::<Transform>(body).unwrap().scale = Vec3::splat(1.25);
    on_ball_of(&mut app, 0.1);
    app.world_mut().entity_mut(body).insert(AvianHairCollider { friction: 0.8, ..default() });
    app.update();
    let expected = HairCollider::sphere(0.08).unwrap().with_friction(0.8).unwrap();
    assert_eq!(hair_colliders(&mut app), [expected]);
    // Of more parts, and of fewer again.
    let parts =
        [Vec3::ZERO, Vec3::X, Vec3::Z].map(|at| (at, Quat::IDENTITY, Collider::sphere(0.1)));
    app.world_mut().entity_mut(body).insert(Collider::compound(parts.to_vec()));
    app.update();
    assert_eq!(hair_colliders(&mut app).len(), 3);
    app.world_mut().entity_mut(body).insert(Collider::cylinder(0.1, 0.2));
    app.update();
    let shapes = hair_colliders(&mut app).into_iter().map(|collider| collider.shape);
    let cylinder = ColliderShape::Cylinder(Cylinder::new(0.1, 0.2));
    assert_eq!(shapes.collect::<Vec<_>>(), [cylinder]);
    assert_eq!(faults(&mut app), []);
}

#[test]
fn a_collider_that_goes_lets_go_of_hair() {
    let ways: [fn(&mut World, Entity); 4] = [
        |world, body| _ = world.entity_mut(body).remove::<Collider>(),
        |world, body| _ = world.entity_mut(body).remove::<AvianHairCollider>(),
        |world, body| _ = world.entity_mut(body).insert(ColliderDisabled),
        |world, body| _ = world.despawn(body),
    ];
    for (i, way) in ways.into_iter().enumerate() {
        let mut app = test_app(60.0);
        let (_, id) = one_strand(&mut app, 0.24, 8, Vec3::X);
        let body = body(&mut app, Collider::sphere(0.1), Transform::from_translation(PLACE));
        run(&mut app, 2.0);
        assert_eq!(hair_colliders(&mut app).len(), 1);
        let lying = strand(&app, id).positions()[8];
        way(app.world_mut(), body);
        run(&mut app, 4.0);
        assert_eq!(hair_colliders(&mut app), [], "way {i}");
        let hanging = strand(&app, id).positions()[8];
        assert!(hanging.y < lying.y - 0.02, "way {i}: {hanging} after {lying}");
    }
    // And one that comes back is there again, after its children were swept away too.
    let mut app = test_app(60.0);
    let body = body(&mut app, Collider::sphere(0.1), Transform::IDENTITY);
    app.update();
    app.world_mut().entity_mut(body).insert(ColliderDisabled);
    app.update();
    app.world_mut().entity_mut(body).remove::<ColliderDisabled>();
    app.update();
    app.world_mut().entity_mut(body).despawn_children();
    app.update();
    assert_eq!(hair_colliders(&mut app).len(), 1);
}

#[test]
fn an_unsupported_shape_is_reported_once_with_a_hint() {
    let mut app = test_app(60.0);
    let line = || Collider::segment(Vec3::ZERO, Vec3::X);
    let entity = body(&mut app, line(), Transform::IDENTITY);
    let reported = |app: &mut App| {
        run(app, 0.5);
        let reported = faults(app);
        assert_eq!(hair_colliders(app), []);
        assert_eq!(reported.len(), 1, "{reported:?}");
        reported[0].to_string()
    };
    let text = reported(&mut app);
    assert!(text.contains("line") && text.contains("half space"), "{text}");
    // A sheet has no inside.
    let sheet = vec![Vec3::ZERO, Vec3::X, Vec3::Z, Vec3::X + Vec3::Z];
    let sheet = Collider::trimesh(sheet, vec![[0, 2, 1], [1, 2, 3]]);
    app.world_mut().entity_mut(entity).insert(sheet);
    let text = reported(&mut app);
    assert!(text.contains("triangle mesh") && text.contains("Openings::Shell"), "{text}");
    app.world_mut().entity_mut(entity).insert(Collider::half_space(Vec3::ZERO));
    assert!(reported(&mut app).contains("normal"));
    // Of a compound the rest holds.
    let mixed = vec![
        (Vec3::ZERO, Quat::IDENTITY, line()),
        (Vec3::X, Quat::IDENTITY, Collider::sphere(0.1)),
    ];
    app.world_mut().entity_mut(entity).insert(Collider::compound(mixed));
    run(&mut app, 0.5);
    let reported = faults(&mut app);
    assert!(
        matches!(
            &reported[..],
            [f] if f.cause::<AvianShapeError>().is_some_and(|why| why.found == "line or triangle")
        ),
        "{reported:?}"
    );
    assert_eq!(hair_colliders(&mut app).len(), 1);
    // Repaired it is not reported; invalid again it is.
    app.world_mut().entity_mut(entity).insert(Collider::sphere(0.1));
    run(&mut app, 0.5);
    assert_eq!(faults(&mut app), []);
    app.world_mut().entity_mut(entity).insert(line());
    run(&mut app, 0.5);
    assert_eq!(faults(&mut app).len(), 1);
}

/// Avian's own physics moves the body through hanging hair.
#[test]
fn invalid_values_are_reported_once_and_clamped() {
    let mut app = test_app(60.0);
    let body = body(&mut app, Collider::sphere(0.1), Transform::default());
    let wrong = AvianHairCollider { friction: -1.0, cells: 9_999 };
    app.world_mut().entity_mut(body).insert(wrong);
    run(&mut app, 0.1);
    let reported = faults(&mut app);
    assert!(
        matches!(&reported[..], [f, c] if f.message.contains("friction is -1")
            && c.message.contains("cells is 9999")),
        "{reported:?}"
    );
    assert_eq!(hair_colliders(&mut app)[0].friction, 0.0);
}

#[test]
fn a_body_that_avian_moves_pushes_hair_along() {
    let mut app = App::new();
    app.add_plugins((
        MinimalPlugins,
        TransformPlugin,
        PhysicsPlugins::default(),
        HairPlugins::default(),
    ))
    .insert_resource(Time::<Fixed>::from_hz(60.0))
    .insert_resource(TimeUpdateStrategy::FixedTimesteps(1))
    .insert_resource(Gravity(Vec3::ZERO));
    app.finish();
    app.cleanup();
    app.update();
    let (_, id) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
    let start = Vec3::new(0.0, -0.2, -0.3);
    let body = body(&mut app, Collider::sphere(0.06), Transform::from_translation(start));
    app.world_mut().entity_mut(body).insert((RigidBody::Kinematic, LinearVelocity(Vec3::Z * 0.5)));
    let (mut deepest, mut pushed) = (f32::MIN, 0.0_f32);
    for _ in 0..90 {
        app.update();
        let center = app.world().get::<Transform>(body).unwrap().translation;
        for p in &strand(&app, id).positions()[1..] {
            deepest = deepest.max(0.06 - p.distance(center));
            pushed = pushed.max(p.z);
        }
    }
    let travelled = app.world().get::<Transform>(body).unwrap().translation.z - start.z;
    println!("{} mm within, pushed {} mm", deepest * 1e3, pushed * 1e3);
    assert!((travelled - 0.75).abs() < 0.02, "the body went {travelled} m");
    assert!(deepest < 1e-4, "{deepest} m inside the body");
    assert!(pushed > 0.05, "pushed by {pushed} m");
}
