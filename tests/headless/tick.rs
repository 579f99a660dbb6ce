//! The tick: its order, its clock, its determinism, and what it does with what is wrong.

use crate::common::*;
use bevy::{prelude::*, reflect::ReflectMut};
use bevy_keratin::{
    DropletRules, FaultKind, HairStep, InvalidValue, SolverMethod, Sweeps,
    keratin::bond::RestShape, prelude::*,
};

#[derive(Resource, Default)]
struct Trace(Vec<(HairSystems, u32)>);

fn tracer(set: HairSystems) -> impl Fn(ResMut<Trace>, Res<HairStep>) {
    move |mut trace, step| trace.0.push((set, step.index))
}

#[test]
fn sets_run_in_the_order_of_figure_1_once_a_substep() {
    let mut app = test_app(60.0);
    app.init_resource::<Trace>();
    // Added backwards, so that only the schedule can have put them in order.
    for set in HairSystems::ALL.into_iter().rev() {
        app.add_systems(HairTick, tracer(set).in_set(set).ambiguous_with_all());
    }
    app.update();
    let trace = &app.world().resource::<Trace>().0;
    let expected: Vec<_> = (0..6).flat_map(|i| HairSystems::ALL.map(|set| (set, i))).collect();
    assert_eq!(*trace, expected);
}

#[derive(Resource, Default)]
struct Seen(Vec<(f32, f32, f32)>);

/// The quantities that each set is to change, read between the sets.
#[test]
fn each_set_does_its_part_and_no_other() {
    let mut app = test_app(60.0);
    app.init_resource::<Seen>();
    let watch = |set: HairSystems| {
        move |strand: Single<(&Strand, &Bonds, &RestShape)>,
              mut seen: ResMut<Seen>,
              step: Res<HairStep>| {
            let _ = set;
            if step.index == 0 {
                let (s, bonds, rest) = *strand;
                seen.0.push((
                    s.velocities()[4].y + 1e3 * s.positions()[4].y,
                    bonds.joints.get(2).map_or(9.0, |j| j.rates[0]),
                    rest.darboux.get(2).map_or(9.0, |q| q.xyz().element_sum()),
                ));
            }
        }
    };
    // With sweeps wet hair's rest shape follows the present one, so it changes in every substep.
    app.insert_resource(HairDefault(HairSolver { method: SolverMethod::Sweeps, ..default() }));
    let (hair, _) = one_strand(&mut app, 0.24, 8, Vec3::X);
    app.world_mut().write_message(HairTreatment::wet(hair));
    app.update();
    for (before, after) in [
        (HairSystems::First, HairSystems::Roots),
        (HairSystems::ExternalForces, HairSystems::Interaction),
        (HairSystems::RestShape, HairSystems::Projection),
        (HairSystems::BondUpdate, HairSystems::Last),
    ] {
        app.add_systems(HairTick, watch(before).after(before).before(after).ambiguous_with_all());
    }
    app.world_mut().write_message(HairTreatment::dry(hair));
    app.update();
    let seen = &app.world().resource::<Seen>().0;
    assert_eq!(seen.len(), 4);
    assert_ne!(seen[0].0, seen[1].0, "ExternalForces change velocities");
    assert_eq!(seen[0].1, seen[2].1, "rates wait for BondUpdate");
    assert_ne!(seen[1].2, seen[2].2, "RestShape writes rest shapes");
    assert_eq!((seen[2].1, seen[3].1), (0.0, 1.0), "BondUpdate moves rates");
}

#[test]
fn substeps_follow_the_apps_rate() {
    for (hertz, count) in [(60.0, 6), (120.0, 3), (240.0, 2), (64.0, 6)] {
        let mut app = test_app(hertz);
        app.update();
        let step = app.world().resource::<HairStep>();
        assert_eq!(step.count, count, "{hertz} Hz");
        assert!((step.dt * count as f32 - 1.0 / hertz as f32).abs() < 1e-7);
    }
}

#[test]
fn paused_hair_stands_still_and_slow_motion_is_slow() {
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
    app.insert_resource(bevy::time::TimeUpdateStrategy::ManualDuration(
        std::time::Duration::from_secs_f64(1.0 / 60.0),
    ));
    app.update();
    app.world_mut().resource_mut::<Time<Virtual>>().pause();
    app.update();
    let before = strand(&app, e).positions().to_vec();
    for _ in 0..10 {
        app.update();
    }
    assert_eq!(before, strand(&app, e).positions());
    let mut time = app.world_mut().resource_mut::<Time<Virtual>>();
    time.unpause();
    time.set_relative_speed(0.25);
    let fixed = |app: &App| app.world().resource::<Time<Fixed>>().elapsed_secs();
    let start = fixed(&app);
    for _ in 0..40 {
        app.update();
    }
    let passed = fixed(&app) - start;
    assert!((passed - 10.0 / 60.0).abs() < 1.5 / 60.0, "{passed} s");
    assert_ne!(before, strand(&app, e).positions());
}

#[test]
fn another_schedule_can_be_chosen() {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, HairPlugins::new(Update)));
    app.insert_resource(bevy::time::TimeUpdateStrategy::ManualDuration(
        std::time::Duration::from_millis(10),
    ));
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
    for _ in 0..20 {
        app.update();
    }
    assert!(strand(&app, e).positions()[8].y < -0.01);
}

#[test]
fn despawning_hair_takes_its_strands_and_nothing_else() {
    let mut app = test_app(60.0);
    let (hair, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
    let (other, kept) = one_strand(&mut app, 0.24, 8, Vec3::X);
    app.update();
    app.world_mut().entity_mut(hair).despawn();
    app.update();
    assert!(app.world().get_entity(e).is_err());
    assert!(app.world().get_entity(kept).is_ok() && app.world().get_entity(other).is_ok());
}

#[test]
fn a_strand_that_goes_wrong_is_put_back_and_its_neighbours_do_not_notice() {
    let build = || {
        let mut app = test_app(60.0);
        let hair = app.world_mut().spawn(Hair).id();
        let ids: Vec<Entity> = (0..5)
            .map(|i| {
                let root = Vec3::Z * (0.1 * i as f32);
                let points: Vec<Vec3> =
                    (0..9).map(|k| root + Vec3::X * (0.03 * k as f32)).collect();
                let strand = Strand::from_polyline(&points).unwrap();
                app.world_mut().spawn((StrandOf(hair), strand)).id()
            })
            .collect();
        run(&mut app, 0.2);
        (app, ids)
    };
    let (mut healthy, ids) = build();
    run(&mut healthy, 0.2);

    // a velocity that is NaN, or one that the step cannot carry
    for (velocity, kind) in
        [(Vec3::NAN, FaultKind::Strand), (Vec3::splat(1e30), FaultKind::PutBack)]
    {
        let (mut app, ids_b) = build();
        app.world_mut().get_mut::<Strand>(ids_b[2]).unwrap().velocities_mut()[3] = velocity;
        run(&mut app, 0.2);
        assert_eq!(fault_kinds(&mut app), [kind], "reported once");
        assert!(strand(&app, ids_b[2]).is_finite());
        for i in [0, 1, 3, 4] {
            assert_eq!(strand(&app, ids_b[i]).positions(), strand(&healthy, ids[i]).positions());
        }
    }

    // the pose itself: infinite, or too large for a step
    for far in [f32::INFINITY, f32::MAX, 1e30] {
        let (mut app, ids_c) = build();
        app.world_mut().get_mut::<Strand>(ids_c[2]).unwrap().positions_mut()[5] = Vec3::splat(far);
        run(&mut app, 0.2);
        assert_eq!(fault_kinds(&mut app), [FaultKind::Rebuilt]);
        let s = strand(&app, ids_c[2]);
        assert!(s.is_finite() && s.peak_strain() < 0.01, "{}", s.peak_strain());
        for i in [0, 1, 3, 4] {
            assert_eq!(strand(&app, ids_c[i]).positions(), strand(&healthy, ids[i]).positions());
        }
    }
}

#[test]
fn springs_whose_frames_were_spoiled_are_rebuilt() {
    let mut app = test_app(60.0);
    let (hair, id) = one_strand(&mut app, 0.24, 8, Vec3::X);
    app.world_mut().entity_mut(hair).insert(StrandModel::MassSpring);
    run(&mut app, 0.1);
    {
        let mut strand = app.world_mut().get_mut::<Strand>(id).unwrap();
        let ReflectMut::Struct(parts) = strand.bypass_change_detection().reflect_mut() else {
            panic!()
        };
        let turns = parts.field_mut("orientations").unwrap();
        let turns = turns.try_downcast_mut::<Vec<Quat>>().unwrap();
        turns[0] = Quat::from_array([f32::NAN; 4]);
    }
    run(&mut app, 0.1);
    assert!(strand(&app, id).is_finite(), "{:?}", strand(&app, id).orientations());
    assert_eq!(fault_kinds(&mut app), [FaultKind::Rebuilt]);
}

#[test]
fn invalid_edits_are_reported_once_and_the_nearest_valid_value_is_used() {
    let mut app = test_app(60.0);
    let (hair, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
    app.update();
    app.world_mut().entity_mut(hair).insert((
        HairStiffness { bending_length: -1.0, damping: -7.0, torsion: 3.0 },
        AirDrag { rate: f32::NAN },
        BondInfluence { hydrogen: 0.0, ionic: 0.0, disulfide: 0.0, peptide: 0.0 },
        HairSolver { limiter_steps: 99, ..default() },
        Sweeps { iterations: 0, bend: 7.0, ..default() },
        StrandContact { radius: f32::INFINITY, strength: -3.0, ..default() },
    ));
    app.world_mut().spawn((HairCollider::default(), Transform::from_xyz(0.0, -2.0, 0.0)));
    app.world_mut().spawn(HairCollider {
        shape: bevy_keratin::ColliderShape::Sphere(Sphere::new(-0.05)),
        friction: f32::NAN,
    });
    app.world_mut().spawn(Blower { strength: -5.0, ..default() });
    app.world_mut().spawn(PermRod { radius: 0.0, length: 0.1 });
    app.world_mut().spawn(PermWinding { from_node: 0, pitch: f32::NAN, seconds: -1.0 });
    app.insert_resource(HairSubsteps::Fixed(0)).insert_resource(HairGravity(Vec3::NAN));
    app.insert_resource(DropletRules { min: Vec3::NAN, resting_time: -2.0, ..default() });
    app.update();
    let reported = faults(&mut app);
    let mut names: Vec<_> =
        reported.iter().map(|f| f.cause::<InvalidValue>().unwrap().what).collect();
    names.sort_unstable();
    assert_eq!(
        names,
        [
            "AirDrag::rate (1/s)",
            "Blower::strength (m/s²)",
            "ColliderShape::radius (m)",
            "DropletRules::min (m)",
            "DropletRules::resting_time (s)",
            "HairCollider::friction",
            "HairGravity (m/s²)",
            "HairSolver::limiter_steps",
            "HairStiffness::bending_length (m)",
            "HairStiffness::damping (s)",
            "HairStiffness::torsion",
            "HairSubsteps",
            "PermRod::radius (m)",
            "PermWinding::from_node",
            "PermWinding::pitch (m)",
            "PermWinding::seconds (s)",
            "StrandContact::radius (m)",
            "StrandContact::strength (m/s²)",
            "Sweeps::bend",
            "Sweeps::iterations",
            "the sum of BondInfluence",
        ]
    );
    assert!(reported.iter().all(|f| f.kind == FaultKind::Setting));
    // What is edited and what a constructor takes are checked by the same rule.
    let reported_of =
        |what| reported.iter().filter_map(|f| f.cause::<InvalidValue>()).find(|v| v.what == what);
    assert_eq!(reported_of("Blower::strength (m/s²)"), Blower::new(-5.0).err().as_ref());
    assert_eq!(reported_of("PermRod::radius (m)"), PermRod::new(0.0, 0.1).err().as_ref());
    assert_eq!(
        reported_of("ColliderShape::radius (m)"),
        HairCollider::sphere(-0.05).err().as_ref()
    );
    assert!(HairCollider::default().with_friction(f32::NAN).is_err());
    run(&mut app, 0.5);
    assert_eq!(faults(&mut app), []);
    assert!(strand(&app, e).is_finite());
    let text =
        reported.iter().map(|f| f.to_string()).find(|t| t.contains("bending_length")).unwrap();
    assert!(text.contains("is -1, expected 0.001 to 100"), "{text}");
}

#[test]
fn edited_bond_rates_are_brought_into_range() {
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
    app.update();
    let mut bonds = app.world_mut().get_mut::<Bonds>(e).unwrap();
    bonds.joints[1].rates = [4.0, -1.0, f32::NAN, 0.5];
    bonds.joints[2].shapes[0] = Vec3::NAN;
    app.update();
    assert_eq!(faults(&mut app).len(), 1);
    let bonds = app.world().get::<Bonds>(e).unwrap();
    assert_eq!(bonds.joints[1].rates, [1.0, 0.0, 1.0, 0.5]);
    assert_eq!(bonds.joints[2].shapes[0], Vec3::ZERO);
    app.world_mut().get_mut::<Bonds>(e).unwrap().joints[3].shapes[1] = Vec3::NAN;
    app.update();
    let found = faults(&mut app);
    let names_the_shape = found[0].to_string().contains("JointBonds::shapes");
    assert!(names_the_shape && found.len() == 1, "{found:?}");
    run(&mut app, 0.5);
    assert_eq!(faults(&mut app), []);
}

#[test]
fn reset_with_an_invalid_influence_keeps_the_shape_that_bonds_remember() {
    let mut app = test_app(60.0);
    let hair = app.world_mut().spawn(Hair).id();
    let angle = |i: usize| 0.3 * i as f32;
    let bent: Vec<Vec3> = (0..9)
        .scan(Vec3::ZERO, |p, i| {
            let here = *p;
            *p += 0.03 * Vec3::new(angle(i).cos(), angle(i).sin(), 0.0);
            Some(here)
        })
        .collect();
    let strand = Strand::from_polyline(&bent).unwrap();
    let strand = app.world_mut().spawn((StrandOf(hair), strand)).id();
    app.update();
    app.world_mut().get_mut::<Strand>(strand).unwrap().pose([]);
    let tip = |app: &App| app.world().get::<Strand>(strand).unwrap().positions()[8];
    assert!(tip(&app).distance(bent[8]) > 0.05, "straightened");
    let invalid = BondInfluence { hydrogen: f32::NAN, ..default() };
    app.world_mut().entity_mut(hair).insert(invalid);
    Hair::reset(app.world_mut().entity_mut(hair));
    assert!(tip(&app).distance(bent[8]) < 1e-3, "{} is not {}", tip(&app), bent[8]);
}

#[test]
fn strands_without_hair_or_nodes_are_reported_and_left_out() {
    let mut app = test_app(60.0);
    let not_hair = app.world_mut().spawn_empty().id();
    let points = [Vec3::ZERO, Vec3::X * 0.1];
    let homeless =
        app.world_mut().spawn((StrandOf(not_hair), Strand::from_polyline(&points).unwrap())).id();
    let hair = app.world_mut().spawn(Hair).id();
    app.world_mut().spawn((StrandOf(hair), Strand::default()));
    app.world_mut().write_message(HairTreatment::wet(not_hair));
    run(&mut app, 0.1);
    let reported = faults(&mut app);
    assert_eq!(reported.iter().filter(|f| f.kind == FaultKind::NoHair).count(), 1);
    assert_eq!(reported.iter().filter(|f| f.kind == FaultKind::Strand).count(), 1);
    assert_eq!(strand(&app, homeless).positions(), points);
}

#[test]
fn a_broken_transform_keeps_the_last_good_pose() {
    let mut app = test_app(60.0);
    let (hair, e) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
    run(&mut app, 0.1);
    app.world_mut().get_mut::<Transform>(hair).unwrap().translation = Vec3::NAN;
    run(&mut app, 0.1);
    app.world_mut().get_mut::<Transform>(hair).unwrap().translation = Vec3::ZERO;
    app.world_mut().get_mut::<Transform>(hair).unwrap().scale = Vec3::ZERO;
    run(&mut app, 0.1);
    assert_eq!(fault_kinds(&mut app), [FaultKind::Transform]);
    assert!(strand(&app, e).is_finite());
}

#[test]
fn settings_and_colliders_changed_at_run_time_act_in_the_next_tick() {
    let mut app = test_app(60.0);
    let (hair, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
    no_gravity(&mut app);
    run(&mut app, 0.2);
    assert!(rms_speed(strand(&app, e)) < 1e-5);
    app.insert_resource(HairGravity(Vec3::Y * 9.8));
    app.update();
    assert!(strand(&app, e).velocities()[8].y > 0.1);
    app.world_mut().entity_mut(hair).insert(AirDrag { rate: 1e4 });
    app.update();
    app.update();
    // What gravity gives in one substep is left.
    assert!(rms_speed(strand(&app, e)) < 9.8 / 170.0, "its own drag overrides the default");
    app.world_mut().entity_mut(hair).remove::<AirDrag>();
    run(&mut app, 0.1);
    assert!(rms_speed(strand(&app, e)) > 9.8 / 100.0);
}

#[test]
fn the_same_input_gives_the_same_bits() {
    let run_once = || {
        let mut app = test_app(60.0);
        let hair = app.world_mut().spawn(Hair).id();
        app.world_mut()
            .spawn((HairCollider::sphere(0.1).unwrap(), Transform::from_xyz(0.1, -0.15, 0.0)));
        let ids: Vec<Entity> = (0..70)
            .map(|i| {
                let root = Vec3::Z * (0.001 * i as f32);
                let nodes = 5 + i % 4;
                let points: Vec<Vec3> =
                    (0..nodes).map(|k| root + Vec3::X * (0.03 * k as f32)).collect();
                app.world_mut()
                    .spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()))
                    .id()
            })
            .collect();
        run(&mut app, 1.0);
        ids.iter().flat_map(|e| strand(&app, *e).positions().to_vec()).collect::<Vec<_>>()
    };
    assert_eq!(run_once(), run_once());
}

/// A game that runs fixed ticks by hand, and no `PostUpdate`: they do not wait for ever.
#[test]
fn ticks_that_are_run_by_hand_do_not_pile_up() {
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.2, 4, Vec3::X);
    app.update();
    let before = strand(&app, e).positions().to_vec();
    let by_hand = |app: &mut App, ticks: usize| {
        for _ in 0..ticks {
            let mut time = app.world_mut().resource_mut::<Time>();
            time.advance_by(std::time::Duration::from_secs_f64(1.0 / 60.0));
            app.world_mut().run_schedule(FixedPostUpdate);
        }
    };
    by_hand(&mut app, 500);
    assert_eq!(strand(&app, e).positions(), before, "the control: they wait for the frame's end");
    by_hand(&mut app, 600);
    let tip = *strand(&app, e).positions().last().unwrap();
    assert!(tip.y < -0.06, "{tip}");
    app.update();
    assert_eq!(fault_kinds(&mut app), [FaultKind::Setting]);
}
