//! Colliders and contact between strands through a real app.

use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::prelude::*;
use proptest::prelude::*;

/// The deepest that any node is inside the ball of `radius` at `center`.
fn depth(strand: &Strand, center: Vec3, radius: f32) -> f32 {
    strand.positions()[1..].iter().map(|p| radius - p.distance(center)).fold(0.0, f32::max)
}

#[test]
fn hair_lies_on_every_shape_and_never_in_it() {
    let down = Vec3::new(0.1, -0.14, 0.0);
    let shapes: [(HairCollider, fn(Vec3) -> f32); 4] = [
        (HairCollider::sphere(0.1).unwrap(), |p| 0.1 - p.length()),
        (HairCollider::capsule(0.1, 0.1).unwrap(), |p| {
            0.1 - (p - Vec3::Y * p.y.clamp(-0.05, 0.05)).length()
        }),
        (HairCollider::plane(Dir3::Y), |p| -p.y),
        (HairCollider::cylinder(0.1, 0.2).unwrap(), |p| {
            (0.1 - p.xz().length()).min(0.1 - p.y.abs())
        }),
    ];
    for (collider, inside) in shapes {
        let mut app = test_app(60.0);
        let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
        app.world_mut().spawn((collider.clone(), Transform::from_translation(down)));
        let mut deepest = 0.0_f32;
        for _ in 0..300 {
            app.update();
            for p in &strand(&app, e).positions()[1..] {
                deepest = deepest.max(inside(*p - down));
            }
        }
        assert!(deepest < 1e-4, "{collider:?}: {deepest} m inside");
        let touched = strand(&app, e).positions().iter().any(|p| inside(*p - down) > -2e-3);
        assert!(touched, "{collider:?} was not even touched");
    }
}

#[test]
fn friction_decides_whether_hair_slides_off() {
    // Hair across a moving floor is taken along by friction and left behind without.
    let dragged = |friction: f32| {
        let mut app = test_app(60.0);
        app.insert_resource(HairDefault(crate::common::equally_stiff()));
        let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
        let floor = HairCollider::plane(Dir3::Y).with_friction(friction).unwrap();
        let floor = app.world_mut().spawn((floor, Transform::from_xyz(0.0, -0.15, 0.0))).id();
        app.world_mut().get_mut::<Strand>(e).unwrap().positions_mut()[8].x = 0.01;
        run(&mut app, 3.0);
        let before = strand(&app, e).positions()[8];
        for frame in 1..=60 {
            app.world_mut().get_mut::<Transform>(floor).unwrap().translation.z =
                frame as f32 * 1e-3;
            app.update();
        }
        (strand(&app, e).positions()[8] - before).z
    };
    let (rough, smooth) = (dragged(1.0), dragged(0.0));
    assert!(rough > 0.02, "carried {rough} m of 0.06");
    assert!(smooth.abs() < 5e-3, "slipped along {smooth} m");
}

#[test]
fn hair_spawned_inside_a_collider_is_not_shot_out() {
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
    let center = Vec3::new(0.12, -0.02, 0.0);
    app.world_mut()
        .spawn((HairCollider::sphere(0.08).unwrap(), Transform::from_translation(center)));
    let mut fastest = 0.0_f32;
    for _ in 0..60 {
        app.update();
        fastest = strand(&app, e).velocities().iter().map(|v| v.length()).fold(fastest, f32::max);
    }
    assert!(depth(strand(&app, e), center, 0.08) < 1e-4);
    // 8 cm in one substep would be 29 m/s.
    assert!(fastest < 15.0, "shot out at {fastest} m/s");
}

#[test]
fn a_node_on_a_colliders_own_centre_gets_out() {
    for collider in [
        HairCollider::sphere(0.05).unwrap(),
        HairCollider::capsule(0.05, 0.1).unwrap(),
        HairCollider::cylinder(0.05, 0.1).unwrap(),
    ] {
        let mut app = test_app(60.0);
        let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
        app.world_mut().spawn((collider, Transform::from_xyz(0.12, 0.0, 0.0)));
        run(&mut app, 0.5);
        assert!(strand(&app, e).is_finite());
    }
}

#[test]
fn strands_in_one_place_part_by_two_radii_only_with_contact() {
    let apart = |strength: f32| {
        let mut app = test_app(60.0);
        no_gravity(&mut app);
        app.insert_resource(HairDefault(StrandContact { radius: 2e-3, strength, ..default() }))
            .insert_resource(HairDefault(HairStiffness::from_bending_length(0.02).unwrap()));
        let hair = app.world_mut().spawn(Hair).id();
        let ids = [-1e-4_f32, 1e-4].map(|z| {
            let points: Vec<Vec3> = (0..9).map(|k| Vec3::new(0.03 * k as f32, 0.0, z)).collect();
            app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id()
        });
        run(&mut app, 1.0);
        let tip = |e: Entity| strand(&app, e).positions()[8];
        tip(ids[0]).distance(tip(ids[1]))
    };
    assert!(apart(20.0) > 3.9e-3, "{}", apart(20.0));
    assert!(apart(0.0) < 1e-3, "{}", apart(0.0));
}

#[test]
fn strands_that_meet_do_not_pass_through_each_other() {
    // Hanging strands that come towards each other, with all nodes at 10 cm/s.
    let crossed = |strength: f32| {
        let mut app = test_app(60.0);
        no_gravity(&mut app);
        app.insert_resource(HairDefault(StrandContact { radius: 2e-3, strength, ..default() }))
            .insert_resource(HairDefault(AirDrag { rate: 0.0 }))
            .insert_resource(HairDefault(HairStiffness::from_bending_length(0.02).unwrap()));
        let hair = app.world_mut().spawn(Hair).id();
        let ids = [-1.0_f32, 1.0].map(|side| {
            let points: Vec<Vec3> =
                (0..9).map(|k| Vec3::new(0.03 * k as f32, 0.0, side * 4e-3)).collect();
            let mut strand = Strand::from_polyline(&points).unwrap();
            strand.velocities_mut()[1..].fill(Vec3::NEG_Z * side * 0.1);
            app.world_mut().spawn((StrandOf(hair), strand)).id()
        });
        let mut least = f32::INFINITY;
        for _ in 0..30 {
            app.update();
            let tip = |e: Entity| strand(&app, e).positions()[8].z;
            least = least.min(tip(ids[1]) - tip(ids[0]));
        }
        least
    };
    println!("{} {}", crossed(20.0), crossed(0.0));
    assert!(crossed(20.0) > 0.0 && crossed(0.0) < -2e-3);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(24))]
    #[test]
    fn nothing_breaks_the_tick(
        scale in 1e-3f32..1e3,
        at in proptest::array::uniform3(-0.3f32..0.3),
        velocity in proptest::array::uniform3(-1e4f32..1e4),
        radius in 1e-4f32..0.5,
    ) {
        let mut app = test_app(60.0);
        let (hair, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
        app.world_mut().get_mut::<Transform>(hair).unwrap().scale = Vec3::splat(scale);
        app.world_mut().spawn((
            HairCollider::sphere(radius).unwrap(),
            Transform::from_translation(Vec3::from(at)).with_scale(Vec3::splat(scale)),
        ));
        app.world_mut().get_mut::<Strand>(e).unwrap().velocities_mut()[4] = Vec3::from(velocity);
        for _ in 0..20 {
            app.update();
            prop_assert!(strand(&app, e).is_finite());
        }
    }
}

#[test]
fn strands_by_the_thousand_in_one_place_are_bounded_and_reported_once() {
    let mut app = test_app(60.0);
    let contact = StrandContact { radius: 1e-3, ..default() };
    let hair = app.world_mut().spawn((Hair, contact, SleepSettings::never())).id();
    for i in 0..2200 {
        let aside = Vec3::new((i % 47) as f32, 0.0, (i / 47) as f32) * 2e-5;
        let points = [aside, aside - Vec3::Y * 0.02, aside - Vec3::Y * 0.04];
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    (0..3).for_each(|_| app.update());
    let reported = faults(&mut app);
    let is_crowding = |f: &HairFault| f.message.contains("too many segments");
    assert!(matches!(&reported[..], [f] if is_crowding(f)), "{reported:?}");
}
