//! Hair under water: what it weighs, how it moves, what it takes along when it comes out.

use crate::common::{fault_kinds, one_strand, rms_speed, run, settle, strand, test_app};
use bevy::prelude::*;
use bevy_keratin::{
    AddedMass, FaultKind, SleepCounts, SolverMethod, ZoneShape,
    prelude::*,
    water::drag::{Lock, Water},
};

const KERATIN: f32 = 1310.0;

/// Hair of which `fibres` make a strand, which neither soaks nor dries.
fn dry(fibres: f32) -> HairDefault<HairWetting> {
    HairDefault(HairWetting { fibres, soaking: 0.0, evaporation: 0.0, ..default() })
}

/// An app with a lake all around, and a strand in it.
fn under_water(length: f32, segments: usize, direction: Vec3, fibres: f32) -> (App, Entity) {
    let mut app = test_app(60.0);
    app.insert_resource(dry(fibres));
    app.world_mut().spawn((WaterVolume::lake(), Transform::from_xyz(0.0, 5.0, 0.0)));
    let (_, entity) = one_strand(&mut app, length, segments, direction);
    (app, entity)
}

fn tip(app: &App, entity: Entity) -> Vec3 {
    *strand(app, entity).positions().last().unwrap()
}

#[test]
fn hair_rests_by_what_buoyancy_leaves_of_its_weight() {
    let (mut wet, in_water) = under_water(0.2, 10, Vec3::X, 100.0);
    run(&mut wet, 40.0);
    let mut air = test_app(60.0);
    air.insert_resource(HairGravity(Vec3::NEG_Y * 9.8 * (1.0 - 1000.0 / KERATIN)));
    let (_, in_air) = one_strand(&mut air, 0.2, 10, Vec3::X);
    settle(&mut air, in_air, 60.0);
    let mut heavy = test_app(60.0);
    let (_, at_full_weight) = one_strand(&mut heavy, 0.2, 10, Vec3::X);
    settle(&mut heavy, at_full_weight, 60.0);
    let apart = |a: &Strand, b: &Strand| {
        let pairs = a.positions().iter().zip(b.positions());
        pairs.map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
    };
    let found = apart(strand(&wet, in_water), strand(&air, in_air));
    let full = apart(strand(&wet, in_water), strand(&heavy, at_full_weight));
    println!("{found} m from lighter hair in the air, {full} m from hair of full weight");
    assert!(found < 1e-3 && full > 0.03, "{found} {full}");
}

#[test]
fn hair_sinks_at_its_terminal_speed() {
    for fibres in [1.0_f32, 30.0] {
        let (mut app, entity) = under_water(2.0, 20, Vec3::X, fibres);
        let soft = HairStiffness::from_bending_length(0.01).unwrap();
        app.insert_resource(HairDefault(soft));
        run(&mut app, 1.0);
        let wetting = HairWetting { fibres, ..default() };
        let lock = Lock {
            diameter: 2.0 * wetting.lock_radius(),
            dry_mass: wetting.dry_mass(),
            fibres: wetting.dry_mass() / KERATIN,
        };
        let water = Water { density: 1000.0, viscosity: 1e-3, current: Vec3::ZERO };
        // Where drag bears the weight under water: ½ μ U Re c_D = (ρ_f − ρ_w) A g.
        let weight = (KERATIN - 1000.0) * lock.fibres * 9.8;
        let (mut low, mut high) = (0.0, 1.0);
        for _ in 0..50 {
            let middle: f32 = 0.5 * (low + high);
            let [across, _] = lock.drag(Vec3::NEG_Y * middle, Vec3::X, &water);
            if across * middle < weight { low = middle } else { high = middle }
        }
        for node in 10..18 {
            let speed = -strand(&app, entity).velocities()[node].y;
            assert!((speed / low - 1.0).abs() < 0.03, "{fibres}: {speed} m/s, expected {low}");
        }
    }
}

#[test]
fn hair_sways_slower_under_water_and_sags_slower() {
    // When the tip of a strand that was pushed comes through the middle, and how far it then goes.
    let sway = |app: &mut App, entity: Entity| {
        run(app, 2.0);
        let mut strand = app.world_mut().get_mut::<Strand>(entity).unwrap();
        let velocities = strand.velocities_mut();
        let count = velocities.len() as f32;
        for (i, v) in velocities.iter_mut().enumerate() {
            *v = Vec3::X * (0.5 * i as f32 / count);
        }
        let mut farthest: f32 = 0.0;
        let mut back = f32::NAN;
        for tick in 0..300 {
            app.update();
            let x = tip(app, entity).x;
            if back.is_nan() && tick > 2 && x < 0.0 {
                back = tick as f32 / 60.0;
            }
            if !back.is_nan() {
                farthest = farthest.max(-x);
            }
        }
        (back, farthest)
    };
    let (mut water, in_water) = under_water(0.2, 8, Vec3::NEG_Y, 500.0);
    let mut air = test_app(60.0);
    let (_, in_air) = one_strand(&mut air, 0.2, 8, Vec3::NEG_Y);
    let (slow, little) = sway(&mut water, in_water);
    let (fast, much) = sway(&mut air, in_air);
    println!("back after {slow} s under water and {fast} s in air, by {little} and {much} m");
    assert!(slow.is_nan() || slow > 1.5 * fast, "{slow} {fast}");
    assert!(little < 0.5 * much, "{little} {much}");

    let (mut water, in_water) = under_water(0.2, 8, Vec3::X, 500.0);
    let mut air = test_app(60.0);
    let (_, in_air) = one_strand(&mut air, 0.2, 8, Vec3::X);
    run(&mut water, 0.15);
    run(&mut air, 0.15);
    let sags = [tip(&water, in_water).y, tip(&air, in_air).y];
    assert!(sags[0] < 0.0 && sags[0] > 0.4 * sags[1], "{sags:?}");
}

#[test]
fn a_current_takes_hair_along() {
    let mut app = test_app(60.0);
    app.insert_resource(dry(100.0));
    let stream = WaterVolume { current: Vec3::X * 0.3, ..WaterVolume::lake() };
    // Turned about its own normal: the current is along the volume's axes.
    let turned = Transform::from_xyz(0.0, 5.0, 0.0)
        .with_rotation(Quat::from_rotation_y(core::f32::consts::FRAC_PI_2));
    app.world_mut().spawn((stream, turned));
    let (_, entity) = one_strand(&mut app, 0.2, 8, Vec3::NEG_Y);
    run(&mut app, 5.0);
    let tip = tip(&app, entity);
    assert!(tip.z < -0.05 && tip.x.abs() < 1e-3, "{tip}");
    assert!(strand(&app, entity).peak_strain() < 5e-3);
}

#[test]
fn what_comes_out_is_wet_and_every_drop_is_accounted_for() {
    let mut app = test_app(60.0);
    let lake =
        app.world_mut().spawn((WaterVolume::lake(), Transform::from_xyz(0.0, 1.0, 0.0))).id();
    let (_, entity) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
    let ledger = |app: &App| *app.world().resource::<WaterLedger>();
    let height = |app: &mut App, y: f32| {
        app.world_mut().get_mut::<Transform>(lake).unwrap().translation.y = y;
    };
    app.insert_resource(HairProcessTime(30.0));
    // Drops that fall in are gone, and counted.
    let drops = [Vec3::new(0.5, 1.2, 0.0), Vec3::new(0.5, 1.5, 0.0)];
    app.world_mut().spawn_batch(drops.map(|at| Droplet::new(at, 4e-9).unwrap()));
    run(&mut app, 20.0);
    assert_eq!(app.world_mut().query::<&Droplet>().iter(app.world()).count(), 0);
    let moisture = app.world().get::<Moisture>(entity).unwrap();
    assert!(moisture.wetness().iter().all(|w| *w > 0.95), "soaked: {:?}", moisture.wetness());
    assert!(moisture.film().iter().all(|film| *film == 0.0), "no film under water");
    let soaked = ledger(&app);
    assert!(soaked.error() < 1e-9 && soaked.water_out > 7e-9, "{soaked:?}");
    let bonds = app.world().get::<Bonds>(entity).unwrap();
    assert!(bonds.rates(BondKind::Hydrogen).all(|rate| rate < 0.1), "its bonds are open");

    app.insert_resource(HairProcessTime(1.0));
    height(&mut app, -0.12);
    run(&mut app, 0.1);
    let film = app.world().get::<Moisture>(entity).unwrap().film().to_vec();
    assert!(film[1] > 1e-9 && film[3] > 1e-9, "what is out of it drips: {film:?}");
    assert!(film[7] == 0.0 && film[8] == 0.0, "{film:?}");
    assert!(ledger(&app).error() < 1e-9, "{:?}", ledger(&app));
    // In and out by waves, then out for good.
    for wave in 0..60 {
        height(&mut app, -0.12 + 0.1 * (0.7 * wave as f32).sin());
        app.update();
    }
    app.world_mut().despawn(lake);
    run(&mut app, 1.0);
    let after = app.world().get::<Moisture>(entity).unwrap();
    assert!(after.film().iter().sum::<f64>() > 1e-8, "{:?}", after.film());
    assert!(after.wetness()[4] > 0.9);
    assert!(ledger(&app).error() < 1e-9, "{:?}", ledger(&app));
    assert!(app.world().get::<AddedMass>(entity).unwrap().mass[4] > 0.2, "and heavier");
}

#[test]
fn hair_that_sleeps_wakes_when_water_comes() {
    let mut app = test_app(60.0);
    let (hair, entity) = one_strand(&mut app, 0.2, 8, Vec3::NEG_Y);
    run(&mut app, 20.0);
    assert!(app.world().get::<SleepCounts>(hair).unwrap().all());
    let stream = WaterVolume { current: Vec3::X * 0.3, ..WaterVolume::lake() };
    app.world_mut().spawn((stream, Transform::from_xyz(0.0, 5.0, 0.0)));
    run(&mut app, 2.0);
    assert!(!app.world().get::<SleepCounts>(hair).unwrap().all());
    assert!(tip(&app, entity).x > 0.01, "{}", tip(&app, entity));
}

#[test]
fn water_elsewhere_changes_no_bit() {
    let positions = |volume: bool| {
        let mut app = test_app(60.0);
        if volume {
            app.world_mut().spawn((WaterVolume::lake(), Transform::from_xyz(0.0, -3.0, 0.0)));
            let pool = WaterVolume::pool(Vec3::splat(0.5)).unwrap();
            app.world_mut().spawn((pool, Transform::from_xyz(2.0, 0.0, 0.0)));
        }
        let (_, entity) = one_strand(&mut app, 0.24, 8, Vec3::X);
        run(&mut app, 1.0);
        strand(&app, entity).positions().to_vec()
    };
    assert_eq!(positions(false), positions(true));
}

#[test]
fn every_kind_of_strand_can_be_under_water() {
    for (model, method) in [
        (StrandModel::Rod, SolverMethod::Direct),
        (StrandModel::Rod, SolverMethod::Sweeps),
        (StrandModel::MassSpring, SolverMethod::Direct),
    ] {
        let (mut app, entity) = under_water(0.2, 8, Vec3::X, 500.0);
        app.insert_resource(HairDefault(model));
        app.insert_resource(HairDefault(HairSolver { method, ..default() }));
        run(&mut app, 0.2);
        let early = tip(&app, entity).y;
        run(&mut app, 12.0);
        let strand = strand(&app, entity);
        let late = strand.positions()[8].y;
        assert!(early > -0.06 && late < early - 5e-3, "{model:?} {method:?}: {early}, {late}");
        assert!(strand.peak_strain() < 0.02 && rms_speed(strand) < 5e-3, "{}", rms_speed(strand));
    }
}

#[test]
fn impossible_water_is_reported_and_contained() {
    let mut app = test_app(60.0);
    let (_, entity) = one_strand(&mut app, 0.2, 8, Vec3::X);
    let volumes = [
        WaterVolume { density: f32::NAN, ..WaterVolume::lake() },
        WaterVolume { viscosity: 0.0, half_size: Vec3::NAN, ..default() },
        WaterVolume {
            current: Vec3::splat(f32::INFINITY),
            shape: ZoneShape::Ellipsoid,
            ..default()
        },
    ];
    app.world_mut().spawn_batch(volumes.map(|volume| (volume, Transform::default())));
    // Heavier than hair: it floats. Through which it is drawn in one tick.
    app.world_mut().spawn((WaterVolume { density: 2e4, ..default() }, Transform::default()));
    run(&mut app, 1.0);
    assert!(strand(&app, entity).is_finite() && strand(&app, entity).peak_strain() < 0.05);
    let reported = fault_kinds(&mut app);
    assert_eq!(reported, [FaultKind::Setting; 4]);
    assert!(WaterVolume::pool(Vec3::ZERO).is_err());
}
