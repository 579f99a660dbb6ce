//! Cutting: what goes, what stays, and what it carries.

use crate::common::{fault_kinds, faults, run, strand, test_app};
use crate::lod::head::fewer;
use bevy::{prelude::*, reflect::ReflectMut};
use bevy_keratin::{
    FaultKind,
    base::schedule::{HairSystems, HairTick},
    prelude::*,
};

const HEAD: f32 = 0.09;
const NODES: usize = 13;

#[derive(Resource, Default)]
struct Answers(Vec<HairCut>);

/// An app that keeps what cutting answers.
fn barber() -> App {
    let mut app = test_app(60.0);
    app.init_resource::<Answers>();
    app.add_observer(|cut: On<HairCut>, mut all: ResMut<Answers>| all.0.push(*cut.event()));
    app
}

/// Strands of 24 cm all over the upper half of a head, with waves that bonds keep.
fn head(app: &mut App, place: Transform) -> (Entity, Vec<Entity>) {
    let ball = HairCollider::sphere(HEAD).unwrap();
    let head = app.world_mut().spawn((ball, place)).id();
    let hair = app.world_mut().spawn((Hair, ChildOf(head))).id();
    let grow = |i: usize| {
        let y = (i as f32 + 0.5) / 40.0;
        let across = (1.0 - y * y).sqrt();
        let (sine, cosine) = (2.4 * i as f32).sin_cos();
        let normal = Vec3::new(across * cosine, y, across * sine);
        let (side, _) = normal.any_orthonormal_pair();
        let node = |k: usize| {
            let wave = 0.004 * (k as f32 * 1.3).sin();
            normal * (HEAD + 0.002 + 0.02 * k as f32) + side * wave
        };
        Strand::from_polyline(&(0..NODES).map(node).collect::<Vec<_>>()).unwrap()
    };
    let strands = (0..40).map(|i| app.world_mut().spawn((StrandOf(hair), grow(i))).id()).collect();
    (hair, strands)
}

fn answer(app: &mut App) -> HairCut {
    let all = core::mem::take(&mut app.world_mut().resource_mut::<Answers>().0);
    let [answer] = all[..] else { panic!("{all:?}") };
    answer
}

fn request(app: &mut App, request: CutHair) {
    app.world_mut().trigger(request);
    app.world_mut().flush();
}

fn all(app: &App, strands: &[Entity]) -> Vec<Strand> {
    strands.iter().map(|id| strand(app, *id).clone()).collect()
}

const LEVEL: CutBy = CutBy::Plane { point: Vec3::new(0.0, -0.05, 0.0), normal: Vec3::NEG_Y };

#[test]
fn a_plane_ends_strands_and_leaves_the_rest_as_it_was() {
    for place in [
        Transform::from_xyz(0.0, 1.6, 0.0),
        Transform::from_xyz(200.0, 1.6, -30.0)
            .with_rotation(Quat::from_euler(EulerRot::YXZ, 2.0, 0.4, 0.1))
            .with_scale(Vec3::splat(2.0)),
    ] {
        let mut app = barber();
        let (hair, strands) = head(&mut app, place);
        run(&mut app, 3.0);
        let before = all(&app, &strands);
        let bonds: Vec<Bonds> =
            strands.iter().map(|id| app.world().get::<Bonds>(*id).unwrap().clone()).collect();
        request(&mut app, CutHair::all(hair, LEVEL));
        let told = answer(&mut app);
        assert_eq!((told.hair, told.refused), (hair, 0));
        let (mut cut, mut length) = (0, 0.0);
        for (id, (old, bonds)) in strands.iter().zip(before.iter().zip(&bonds)) {
            let new = strand(&app, *id);
            let (p, q) = (new.positions(), old.positions());
            let tip = p[p.len() - 1];
            if q.iter().all(|p| p.y >= -0.05) {
                assert_eq!(p, q);
                continue;
            }
            cut += 1;
            length += old.length() - new.length();
            assert!((tip.y + 0.05).abs() < 1e-6, "a tip at {tip}");
            assert!(p[..p.len() - 1].iter().all(|p| p.y > -0.05));
            assert_eq!(p[..p.len() - 1], q[..p.len() - 1]);
            // The sum of lengths is that along the old strand to the cut.
            let edge = q.windows(2).position(|ends| ends[1].y < -0.05).unwrap();
            let share = (q[edge].y + 0.05) / (q[edge].y - q[edge + 1].y);
            let along = &old.rest_lengths()[..=edge];
            let expected = along[..edge].iter().sum::<f32>() + share * along[edge];
            assert!((new.length() - expected).abs() < 1e-6, "{} for {expected}", new.length());
            let left = &app.world().get::<Bonds>(*id).unwrap().joints;
            assert_eq!(left[..], bonds.joints[..new.edges()]);
        }
        assert!(cut > 10, "{cut}");
        assert_eq!(told.strands, cut);
        assert!((told.length - length).abs() < 1e-4);
        // It hangs on as it did, and comes to rest.
        let cut = all(&app, &strands);
        let mut mean = 0.0;
        run(&mut app, 4.0);
        for (id, before) in strands.iter().zip(&cut) {
            let now = strand(&app, *id);
            assert!(now.peak_strain() < 5e-3, "{}", now.peak_strain());
            let pairs = now.positions().iter().zip(before.positions());
            let moved = pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
            mean += moved / strands.len() as f32;
        }
        println!("moved by {mean} m in the mean");
        // Relieved of what hung from them they rise a little.
        assert!(mean < 0.03, "{mean} m");
        let asleep = strands
            .iter()
            .filter(|id| app.world().get::<StrandSleep>(**id).is_some_and(StrandSleep::is_asleep));
        assert!(asleep.count() > 35);
        assert_eq!(fault_kinds(&mut app), []);
    }
}

#[test]
fn a_length_leaves_what_is_shorter_and_the_least_is_a_millimetre() {
    let mut app = barber();
    let (hair, strands) = head(&mut app, Transform::default());
    run(&mut app, 0.1);
    let mut whole = strand(&app, strands[7]).length();
    for (length, cut) in [(0.3, 0), (0.2, 40), (0.2, 0), (0.0401, 40), (0.02, 40), (1e-3, 40)] {
        request(&mut app, CutHair::all(hair, CutBy::Length(length)));
        assert_eq!(answer(&mut app).strands, cut, "to {length} m");
        let now = strand(&app, strands[7]);
        whole = whole.min(length);
        assert!((now.length() - whole).abs() < 1e-6, "{} m", now.length());
        let lengths = now.rest_lengths();
        assert!(lengths.iter().all(|l| *l > 0.99e-3), "{lengths:?}");
        run(&mut app, 0.2);
    }
    // A stub of one edge is a strand, too.
    assert_eq!(strand(&app, strands[7]).edges(), 1);
    assert_eq!(fault_kinds(&mut app), []);
    // Its root is beyond this plane.
    request(&mut app, CutHair::all(hair, CutBy::Plane { point: Vec3::ZERO, normal: Vec3::Y }));
    let told = answer(&mut app);
    assert_eq!((told.strands, told.refused), (0, 40));
    for wrong in [
        CutBy::Length(f32::NAN),
        CutBy::Length(0.0),
        CutBy::Length(-1.0),
        CutBy::Plane { point: Vec3::ZERO, normal: Vec3::ZERO },
        CutBy::Plane { point: Vec3::NAN, normal: Vec3::Y },
    ] {
        request(&mut app, CutHair::all(hair, wrong));
        app.update();
        let said = faults(&mut app);
        assert!(said.len() == 1 && said[0].message.contains("nothing is cut"), "{said:?}");
    }
    for (point, normal) in [(Vec3::NAN, Vec3::Y), (Vec3::ZERO, Vec3::ZERO), (Vec3::ZERO, Vec3::NAN)]
    {
        let region = StrandRegion::Above { point, normal };
        request(&mut app, CutHair { hair, by: CutBy::Length(0.01), region });
        app.update();
        let said = faults(&mut app);
        assert!(
            said.len() == 1 && said[0].message.contains("of a region above a plane"),
            "{said:?}"
        );
    }
    assert!(app.world().resource::<Answers>().0.is_empty());
    request(&mut app, CutHair::all(strands[0], LEVEL));
    app.update();
    assert_eq!(fault_kinds(&mut app), [FaultKind::NoTarget]);
}

#[test]
fn a_region_of_a_wearers_hairs_is_cut() {
    let mut app = barber();
    let (hair, strands) = head(&mut app, Transform::default());
    let (beard, _) = head(&mut app, Transform::from_xyz(0.0, -0.5, 0.0));
    let wearer = app.world_mut().spawn_empty().id();
    for hair in [hair, beard] {
        app.world_mut().entity_mut(hair).insert(WornBy(wearer));
    }
    app.update();
    let right = StrandRegion::Above { point: Vec3::ZERO, normal: Vec3::X };
    request(&mut app, CutHair { hair: wearer, by: CutBy::Length(0.05), region: right });
    let told = core::mem::take(&mut app.world_mut().resource_mut::<Answers>().0);
    assert_eq!(told.len(), 2);
    for id in strands {
        let own = strand(&app, id);
        assert_eq!(own.length() < 0.06, own.positions()[0].x > 0.0);
    }
}

#[test]
fn water_that_is_cut_off_is_drained_to_the_drop() {
    let mut app = barber();
    let (hair, strands) = head(&mut app, Transform::default());
    run(&mut app, 0.5);
    app.world_mut().trigger(SoakHair { target: hair, wetness: 1.0 });
    run(&mut app, 0.5);
    let held = |app: &App| -> f64 {
        strands.iter().filter_map(|id| app.world().get::<Moisture>(*id)).map(Moisture::volume).sum()
    };
    let before = held(&app);
    assert!(before > 0.0);
    let out = app.world().resource::<WaterLedger>().water_out;
    request(&mut app, CutHair::all(hair, CutBy::Length(0.107)));
    let drained = app.world().resource::<WaterLedger>().water_out - out;
    let left = held(&app);
    assert!((before - left - drained).abs() < 1e-12 * before, "{before} {left} {drained}");
    // As much as the length, for it was wet all along.
    let share = left / before;
    let length = 0.107 / (0.02 * 12.0 + 0.003);
    assert!((share / length - 1.0).abs() < 0.12, "{share} for {length}");
    run(&mut app, 1.0);
    let error = app.world().resource::<WaterLedger>().error();
    assert!(error < 1e-9, "{error}");
    assert_eq!(fault_kinds(&mut app), []);
}

#[test]
fn water_that_an_inspector_has_spoiled_is_cut_and_still_in_balance() {
    for (wrong, node) in [(f64::NEG_INFINITY, 2), (f64::NAN, 2), (f64::INFINITY, NODES - 1)] {
        let mut app = barber();
        let (hair, strands) = head(&mut app, Transform::default());
        app.world_mut().trigger(SoakHair::dripping(hair));
        run(&mut app, 0.2);
        {
            let mut water = app.world_mut().get_mut::<Moisture>(strands[0]).unwrap();
            let ReflectMut::Struct(parts) = water.reflect_mut() else { panic!() };
            let ReflectMut::List(film) = parts.field_mut("film").unwrap().reflect_mut() else {
                panic!()
            };
            *film.get_mut(node).unwrap().try_downcast_mut::<f64>().unwrap() = wrong;
        }
        request(&mut app, CutHair::all(hair, CutBy::Length(0.1)));
        run(&mut app, 0.5);
        let ledger = *app.world().resource::<WaterLedger>();
        let is_finite =
            [ledger.water_in, ledger.held, ledger.water_out].iter().all(|n| n.is_finite());
        assert!(is_finite && ledger.error() < 1e-9, "{wrong} at {node}: {ledger:?}");
        let water = app.world().get::<Moisture>(strands[0]).unwrap();
        assert!(water.film().iter().all(|film| film.is_finite() && *film >= 0.0), "{wrong}");
        assert!(faults(&mut app).len() <= 1, "{wrong}");
    }
}

#[test]
fn ties_rods_and_held_nodes_beyond_the_cut_let_go() {
    let mut app = barber();
    let (hair, strands) = head(&mut app, Transform::default());
    let world = app.world_mut();
    let behind = Transform::from_xyz(0.0, 0.04, 0.12);
    let tie = world.spawn((HairTie::default(), behind, ChildOf(hair))).id();
    let upper = StrandRegion::Above { point: Vec3::Y * 0.045, normal: Vec3::Y };
    world.trigger(TieHair { hair, tie, region: upper });
    let rod = world.spawn((PermRod::default(), Transform::from_xyz(0.2, 0.0, 0.0))).id();
    world.entity_mut(strands[3]).insert(WoundOn(rod));
    let near = 0.9 * world.get::<Strand>(strands[4]).unwrap().positions()[12];
    let targets = (0..NODES).map(|i| (i == 12).then_some(near)).collect();
    world.entity_mut(strands[4]).insert(HeldNodes { targets, ..default() });
    run(&mut app, 2.0);
    let tied = |app: &App| app.world().get::<TiedStrands>(tie).map_or(0, |all| all.iter().count());
    assert!(tied(&app) > 10);
    // Nothing that a tie asks for is out of reach.
    let said = faults(&mut app);
    assert!(said.is_empty(), "{said:#?}");
    request(&mut app, CutHair::all(hair, CutBy::Length(0.05)));
    run(&mut app, 2.0);
    // A strand that grows beside the ring reaches it still.
    assert!(tied(&app) < 3, "{}", tied(&app));
    let held = |id: Entity| &app.world().get::<HeldNodes>(id).unwrap().targets;
    assert!(held(strands[4]).iter().all(Option::is_none));
    assert!(strands.iter().all(|id| strand(&app, *id).peak_strain() < 0.05));
    assert!(app.world().get::<WoundOn>(strands[3]).is_some());
    let said = faults(&mut app);
    assert!(said.is_empty(), "{said:#?}");
}

#[test]
fn a_hairdo_keeps_the_cut_and_an_older_one_lets_hair_grow_back() {
    let mut app = barber();
    let (hair, strands) = head(&mut app, Transform::default());
    let (other, theirs) = head(&mut app, Transform::from_xyz(1.0, 0.0, 0.0));
    run(&mut app, 2.0);
    let long = Hairdo::of(app.world(), hair).unwrap();
    request(&mut app, CutHair::all(hair, LEVEL));
    run(&mut app, 1.0);
    let short = Hairdo::of(app.world(), hair).unwrap();
    let bytes = short.to_bytes();
    assert_eq!(Hairdo::from_bytes(&bytes).unwrap(), short);
    assert_eq!(Hairdo::from_bytes(&bytes).unwrap().to_bytes(), bytes);
    for end in (8..bytes.len() - 1).step_by(997) {
        assert!(Hairdo::from_bytes(&bytes[..end]).is_err());
    }
    // On another head with the same hair.
    short.apply(app.world_mut(), other).unwrap();
    for (own, their) in strands.iter().zip(&theirs) {
        assert_eq!(strand(&app, *own).rest_lengths(), strand(&app, *their).rest_lengths());
        let cut = |id: &Entity| app.world().get::<CutStrand>(*id).copied();
        assert_eq!(cut(own), cut(their));
    }
    run(&mut app, 1.0);
    assert_eq!(fault_kinds(&mut app), []);
    // A game that was saved before.
    long.apply(app.world_mut(), hair).unwrap();
    for (id, before) in strands.iter().zip(long.strands()) {
        assert_eq!(strand(&app, *id).positions(), before.positions());
        assert!(app.world().get::<CutStrand>(*id).is_none());
    }
    run(&mut app, 1.0);
    assert_eq!(fault_kinds(&mut app), []);
}

#[test]
fn a_strand_in_the_place_of_a_cut_one_is_whole() {
    let mut app = barber();
    let (hair, strands) = head(&mut app, Transform::default());
    run(&mut app, 0.1);
    request(&mut app, CutHair::all(hair, CutBy::Length(0.05)));
    // A game grows a new one on the same entity.
    let points: Vec<Vec3> = (0..21).map(|i| Vec3::Y * (0.09 + 0.01 * i as f32)).collect();
    let grown = Strand::from_polyline(&points).unwrap();
    app.world_mut().entity_mut(strands[0]).insert(grown);
    run(&mut app, 0.1);
    let hairdo = Hairdo::of(app.world(), hair).unwrap();
    assert_eq!(Hairdo::from_bytes(&hairdo.to_bytes()).unwrap(), hairdo);
    request(&mut app, CutHair::all(hair, CutBy::Length(0.1)));
    assert!((strand(&app, strands[0]).length() - 0.1).abs() < 1e-6);
    let cut = app.world().get::<CutStrand>(strands[0]).unwrap();
    assert!((cut.whole_length() - 0.2).abs() < 1e-6 && (cut.share() - 0.5).abs() < 1e-5, "{cut:?}");
}

#[test]
fn hair_is_cut_whoever_moves_it_and_a_thousand_times() {
    for kind in 0..4 {
        let mut app = barber();
        let (hair, strands) = head(&mut app, Transform::default());
        let mut own = app.world_mut().entity_mut(hair);
        match kind {
            0 => own.insert(StrandModel::MassSpring),
            1 => own.insert((fewer(0.3), HairScreenShare(0.3))),
            2 => own.insert(HairSolver { method: SolverMethod::Sweeps, ..default() }),
            _ => &mut own,
        };
        run(&mut app, 3.0);
        // As a game that is paused does.
        app.world_mut().resource_mut::<Time<Virtual>>().pause();
        request(&mut app, CutHair::all(hair, LEVEL));
        app.update();
        assert!(answer(&mut app).strands > 10, "kind {kind}");
        app.world_mut().resource_mut::<Time<Virtual>>().unpause();
        let entities = app.world().entities().len();
        for i in 0..250 {
            let by = match i % 2 {
                0 => CutBy::Length(0.2 - 0.19 * i as f32 / 250.0),
                _ => CutBy::Plane {
                    point: Vec3::new(0.05, -0.05, 0.0),
                    normal: Vec3::new(1.0, -1.0 - i as f32 * 0.01, 0.3 * (i as f32).sin()),
                },
            };
            request(&mut app, CutHair::all(hair, by));
            app.update();
        }
        run(&mut app, 1.0);
        assert_eq!(app.world().entities().len(), entities);
        assert_eq!(fault_kinds(&mut app), [], "kind {kind}");
        for id in &strands {
            let own = strand(&app, *id);
            assert!(own.is_finite() && own.peak_strain() < 0.05, "kind {kind}: {own:?}");
            assert!(own.length() < 0.25);
        }
    }
}

#[test]
fn a_cut_within_a_tick_is_made_whole() {
    for set in HairSystems::ALL {
        let mut app = barber();
        let (hair, strands) = head(&mut app, Transform::default());
        app.world_mut().trigger(SoakHair { target: hair, wetness: 0.7 });
        let mut length = 0.24;
        app.add_systems(
            HairTick,
            (move |mut commands: Commands| {
                length *= 0.99;
                commands.trigger(CutHair::all(hair, CutBy::Length(f32::max(length, 0.01))));
            })
            .in_set(set),
        );
        run(&mut app, 1.0);
        assert_eq!(fault_kinds(&mut app), [], "{set:?}");
        assert!(strands.iter().all(|id| strand(&app, *id).is_finite()));
    }
}
