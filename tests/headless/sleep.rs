//! Strands at rest sleep, and whatever may move them wakes them.

use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::{SleepCounts, SolverMethod, StrandError, Sweeps, prelude::*};
use std::time::Instant;

/// A hair that hangs and sleeps, and its strand.
fn sleeper() -> (App, Entity, Entity) {
    let mut app = test_app(60.0);
    let (hair, e) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
    run(&mut app, 1.0);
    assert!(is_asleep(&app, e), "hangs from the start");
    (app, hair, e)
}

fn is_asleep(app: &App, strand: Entity) -> bool {
    app.world().get::<StrandSleep>(strand).unwrap().is_asleep()
}

fn bits(strand: &Strand) -> Vec<[u32; 3]> {
    strand.positions().iter().map(|p| p.to_array().map(f32::to_bits)).collect()
}

/// Hair that bends and swings before it lies still, on a head or off it.
fn lock(app: &mut App, strands: usize) -> (Entity, Vec<Entity>) {
    let hair = app.world_mut().spawn(Hair).id();
    let grow = |i: usize| {
        let root = Vec3::new((i % 10) as f32, 0.0, (i / 10) as f32) * 3e-3;
        let out = Vec3::new(1.0, 0.5 + 0.01 * (i % 7) as f32, 0.0).normalize();
        let points: Vec<Vec3> = (0..9).map(|k| root + out * (0.02 * k as f32)).collect();
        Strand::from_polyline(&points)
    };
    let ids = (0..strands).map(|i| {
        let strand: Result<Strand, StrandError> = grow(i);
        app.world_mut().spawn((StrandOf(hair), strand.unwrap())).id()
    });
    let ids = ids.collect();
    (hair, ids)
}

/// Runs until all of a hair sleeps; says how long that took.
fn until_asleep(app: &mut App, hair: Entity, limit: f64) -> f64 {
    let mut seconds = 0.0;
    while !app.world().get::<SleepCounts>(hair).unwrap().all() {
        run(app, 0.1);
        seconds += 0.1;
        assert!(seconds < limit, "{:?}", app.world().get::<SleepCounts>(hair));
    }
    seconds
}

/// A sleeper wakes by `act`.
#[track_caller]
fn wakes(act: impl FnOnce(&mut App, Entity, Entity)) {
    let _ = woken(act);
}

#[track_caller]
fn woken(act: impl FnOnce(&mut App, Entity, Entity)) -> App {
    let (mut app, hair, e) = sleeper();
    act(&mut app, hair, e);
    run(&mut app, 3.0 / 60.0);
    assert!(!is_asleep(&app, e), "slept on");
    app
}

fn go(app: &mut App, entity: Entity, change: impl FnOnce(&mut Transform)) {
    change(&mut app.world_mut().get_mut::<Transform>(entity).unwrap());
}

fn set<T: Component>(value: T) -> impl FnOnce(&mut App, Entity, Entity) {
    |app, hair, _| {
        app.world_mut().entity_mut(hair).insert(value);
    }
}

#[test]
fn hair_at_rest_falls_asleep_and_then_stays_to_the_last_bit() {
    let mut app = test_app(60.0);
    app.world_mut()
        .spawn((HairCollider::sphere(0.05).unwrap(), Transform::from_xyz(0.1, -0.06, 0.0)));
    let (hair, ids) = lock(&mut app, 60);
    run(&mut app, 0.2);
    assert_eq!(
        *app.world().get::<SleepCounts>(hair).unwrap(),
        SleepCounts { asleep: 0, awake: 60 }
    );
    let seconds = until_asleep(&mut app, hair, 30.0);
    assert!(seconds > 1.0, "it has swung before");
    let rest: Vec<_> = ids.iter().map(|e| bits(strand(&app, *e))).collect();
    for _ in 0..120 {
        app.update();
        assert!(app.world().get::<SleepCounts>(hair).unwrap().all());
    }
    for (e, rest) in ids.iter().zip(rest) {
        assert_eq!(bits(strand(&app, *e)), rest);
        assert_eq!(rms_speed(strand(&app, *e)), 0.0);
    }
}

#[test]
fn sleep_changes_the_settled_shape_by_no_more_than_can_be_seen() {
    let settled = |sleep: SleepSettings| {
        let mut app = test_app(60.0);
        app.insert_resource(HairDefault(sleep));
        let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::X);
        run(&mut app, 20.0);
        (strand(&app, e).positions()[8], is_asleep(&app, e))
    };
    let (with, asleep) = settled(SleepSettings::default());
    let (without, awake) = settled(SleepSettings::never());
    assert!(asleep && !awake);
    assert!(with.distance(without) < 3e-4, "{} m apart", with.distance(without));
}

#[test]
fn a_swing_does_not_fall_asleep_at_its_turning_points() {
    let mut app = test_app(60.0);
    app.insert_resource(HairGravity(Vec3::NEG_Y * 0.1))
        .insert_resource(HairDefault(AirDrag { rate: 0.0 }))
        .insert_resource(HairDefault(HairStiffness::from_bending_length(0.01).unwrap()));
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::new(0.2, -1.0, 0.0).normalize());
    let (mut turns, mut before) = (0, 0.0);
    for _ in 0..60 * 20 {
        app.update();
        assert!(!is_asleep(&app, e));
        let speed = strand(&app, e).velocities()[8].x;
        turns += usize::from(speed * before < 0.0);
        before = speed;
    }
    assert!(turns >= 2, "{turns} turning points in 20 s");
}

#[test]
fn the_head_wakes_it() {
    wakes(|app, hair, _| go(app, hair, |t| t.translation.x += 5e-3));
    wakes(|app, hair, _| go(app, hair, |t| t.rotate_z(0.02)));
    wakes(|app, hair, _| go(app, hair, |t| t.scale *= 1.1));
    // and so does a long jump
    wakes(|app, hair, _| go(app, hair, |t| t.translation.x += 50.0));
}

#[test]
fn a_head_that_creeps_is_noticed_in_time() {
    let (mut app, hair, e) = sleeper();
    let mut went = 0.0;
    while is_asleep(&app, e) {
        went += 2e-6;
        go(&mut app, hair, |t| t.translation.x += 2e-6);
        app.update();
        assert!(went < 1e-4, "hair was taken along for {went} m");
    }
    assert!(went > 2e-5);
}

#[test]
fn gravity_wakes_it() {
    wakes(|app, _, _| no_gravity(app));
    // The same again is no change.
    let (mut app, _, e) = sleeper();
    app.insert_resource(HairGravity::default());
    run(&mut app, 0.1);
    assert!(is_asleep(&app, e));
}

#[test]
fn each_strand_wakes_by_what_happens_to_its_own_hair() {
    let mut app = test_app(60.0);
    let hairs = [lock(&mut app, 3), lock(&mut app, 3), lock(&mut app, 3)];
    for (i, (hair, _)) in hairs.iter().enumerate() {
        go(&mut app, *hair, |place| place.translation.x = i as f32);
    }
    hairs.iter().for_each(|(hair, _)| _ = until_asleep(&mut app, *hair, 30.0));
    for (hair, ids) in &hairs {
        let asleep = |app: &App, e: &Entity| is_asleep(app, *e);
        assert!(hairs.iter().flat_map(|(_, ids)| ids).all(|e| asleep(&app, e)));
        let stiffer = HairStiffness::from_bending_length(0.2).unwrap();
        app.world_mut().entity_mut(*hair).insert(stiffer);
        run(&mut app, 3.0 / 60.0);
        for e in hairs.iter().flat_map(|(_, ids)| ids) {
            assert_eq!(asleep(&app, e), !ids.contains(e));
        }
        until_asleep(&mut app, *hair, 30.0);
    }
}

#[test]
fn a_blower_wakes_it_and_keeps_it_awake() {
    let aim = Transform::from_xyz(-0.3, -0.2, 0.0).looking_to(Vec3::X, Vec3::Y);
    let mut app = woken(|app, _, _| {
        app.world_mut().spawn((Blower::default(), aim));
    });
    run(&mut app, 5.0);
    let e = app.world_mut().query_filtered::<Entity, With<Strand>>().single(app.world()).unwrap();
    assert!(!is_asleep(&app, e));
    // One that blows elsewhere does not.
    let (mut app, _, e) = sleeper();
    let away = Transform::from_xyz(-0.3, -0.2, 0.0).looking_to(Vec3::NEG_X, Vec3::Y);
    app.world_mut().spawn((Blower::default(), away));
    run(&mut app, 0.1);
    assert!(is_asleep(&app, e));
}

#[test]
fn colliders_wake_it_when_they_come_go_or_move_near_it() {
    let near = Transform::from_xyz(0.0505, -0.15, 0.0);
    let ball = || HairCollider::sphere(0.05).unwrap();
    let with_ball = |at: Transform| {
        let mut app = test_app(60.0);
        let ball = app.world_mut().spawn((ball(), at)).id();
        let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
        run(&mut app, 8.0);
        assert!(is_asleep(&app, e));
        (app, ball, e)
    };
    wakes(|app, _, _| {
        app.world_mut().spawn((ball(), near));
    });
    let (mut app, id, e) = with_ball(near);
    go(&mut app, id, |t| t.translation.y += 0.01);
    run(&mut app, 0.05);
    assert!(!is_asleep(&app, e), "one that moves beside it");
    let (mut app, id, e) = with_ball(near);
    go(&mut app, id, |t| t.rotate_y(0.05));
    run(&mut app, 0.05);
    assert!(!is_asleep(&app, e), "one that turns where it is");
    let (mut app, id, e) = with_ball(near);
    app.world_mut().entity_mut(id).despawn();
    run(&mut app, 0.05);
    assert!(!is_asleep(&app, e), "one that vanishes");
    let far = Transform::from_xyz(0.3, -0.15, 0.0);
    let (mut app, id, e) = with_ball(far);
    go(&mut app, id, |t| t.translation.y += 0.02);
    run(&mut app, 0.05);
    assert!(is_asleep(&app, e), "not one that moves far away");
    // One that flies at it does not pass through.
    let mut deepest = 0.0_f32;
    for _ in 0..20 {
        go(&mut app, id, |t| t.translation.x -= 0.02);
        app.update();
        let center = app.world().get::<Transform>(id).unwrap().translation;
        for p in &strand(&app, e).positions()[1..] {
            deepest = deepest.max(0.05 - p.distance(center));
        }
    }
    assert!(!is_asleep(&app, e));
    assert!(deepest < 2e-3, "{deepest} m inside");
}

#[test]
fn a_neighbour_that_touches_it_wakes_it() {
    let mut app = test_app(60.0);
    let hair = app.world_mut().spawn(Hair).id();
    let [a, b, far] = [0.0, 0.01, 0.2].map(|x| {
        let points: Vec<Vec3> = (0..9).map(|k| Vec3::new(x, -0.03 * k as f32, 0.0)).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id()
    });
    run(&mut app, 1.0);
    assert!(app.world().get::<SleepCounts>(hair).unwrap().all());
    let mut strand = app.world_mut().get_mut::<Strand>(a).unwrap();
    strand.velocities_mut()[4..].fill(Vec3::X * 0.5);
    run(&mut app, 0.3);
    assert!(!is_asleep(&app, a) && !is_asleep(&app, b) && is_asleep(&app, far));
}

#[test]
fn holding_and_letting_go_wakes_it() {
    let hold = |app: &mut App, e: Entity, x: f32| {
        let mut targets = vec![None; 9];
        targets[8] = Some(Vec3::new(x, -0.23, 0.0));
        app.world_mut().entity_mut(e).insert(HeldNodes { targets, ..default() });
    };
    let mut app = woken(|app, _, e| hold(app, e, 0.05));
    let e = app.world_mut().query_filtered::<Entity, With<Strand>>().single(app.world()).unwrap();
    let sleep_again = |app: &mut App| {
        run(app, 15.0);
        assert!(is_asleep(app, e), "held still it sleeps");
    };
    sleep_again(&mut app);
    hold(&mut app, e, 0.06);
    run(&mut app, 0.05);
    assert!(!is_asleep(&app, e), "the hand moves");
    sleep_again(&mut app);
    app.world_mut().entity_mut(e).remove::<HeldNodes>();
    run(&mut app, 0.05);
    assert!(!is_asleep(&app, e), "the hand lets go");
}

#[test]
fn bonds_that_change_wake_it_and_keep_it_awake() {
    wakes(|app, _, e| {
        app.world_mut().get_mut::<bevy_keratin::BondChanges>(e).unwrap().request(
            3,
            BondKind::Hydrogen,
            -0.5,
        );
    });
    wakes(|app, _, e| app.world_mut().get_mut::<Bonds>(e).unwrap().joints[2].rates[0] = 0.5);
    wakes(|app, hair, _| {
        app.world_mut().write_message(HairTreatment::wet(hair));
    });
    let (mut app, hair, e) = sleeper();
    app.world_mut().write_message(HairTreatment::wet(hair));
    run(&mut app, 3.0);
    assert!(is_asleep(&app, e), "open bonds alone keep nobody awake");
    app.world_mut().write_message(HairTreatment::dry(hair).over(2.0));
    app.update();
    app.update();
    for _ in 0..110 {
        app.update();
        assert!(!is_asleep(&app, e), "its style is forming");
    }
    run(&mut app, 2.0);
    assert!(is_asleep(&app, e));
}

#[test]
fn water_wakes_it_and_so_does_what_it_loses_of_it() {
    let mut app = woken(|app, hair, _| {
        app.insert_resource(HairProcessTime(100.0));
        app.world_mut().write_message(SoakHair::dripping(hair));
    });
    let e = app.world_mut().query_filtered::<Entity, With<Strand>>().single(app.world()).unwrap();
    let water = |app: &App| app.world().get::<Moisture>(e).unwrap().clone();
    let mut ticks = 0;
    // While its film runs down and dries it wakes whenever a node's mass has changed by a hundredth.
    let masses = |app: &App| -> Vec<f32> {
        app.world().get::<AddedMass>(e).unwrap().mass.iter().map(|added| 1.0 + added).collect()
    };
    let mut awake = masses(&app);
    while water(&app).has_film() {
        assert!(ticks < 18_000);
        app.update();
        ticks += 1;
        if is_asleep(&app, e) {
            let nodes = awake.iter().zip(masses(&app)).skip(1);
            let change = nodes.map(|(a, b)| (a / b - 1.0).abs()).fold(0.0, f32::max);
            assert!(change < 0.013, "{change} of its mass has changed in its sleep");
        } else {
            awake = masses(&app);
        }
    }
    assert!(ticks > 60, "{ticks}");
    // Then it dries through, and wakes whenever that has changed it.
    let (mut before, mut asleep) = (water(&app).wetness()[0], 0.0);
    while !water(&app).is_untouched() {
        assert!(ticks < 18_000);
        app.update();
        ticks += 1;
        let now = water(&app).wetness().first().copied().unwrap_or(0.0);
        asleep = if is_asleep(&app, e) { asleep + (before - now) } else { 0.0 };
        assert!(asleep < 0.013, "{asleep} of its water has gone in its sleep");
        before = now;
    }
    run(&mut app, 3.0);
    assert!(is_asleep(&app, e), "dry again");
    // A droplet that falls on it
    let (mut app, _, e) = sleeper();
    app.insert_resource(HairProcessTime(1e-6))
        .insert_resource(HairDefault(HairWetting { uptake: 0.0, ..default() }));
    app.world_mut().spawn(Droplet::new(Vec3::new(0.001, 0.02, 0.0), 4e-9).unwrap());
    let mut waited = 0;
    while is_asleep(&app, e) {
        app.update();
        waited += 1;
        assert!(waited < 60, "the drop has passed");
    }
}

#[test]
fn settings_wake_it() {
    wakes(set(HairStiffness::from_bending_length(0.2).unwrap()));
    wakes(set(HairSolver { method: SolverMethod::Sweeps, ..default() }));
    wakes(set(Sweeps { iterations: 7, ..default() }));
    wakes(set(BondInfluence { hydrogen: 0.4, ..default() }));
    wakes(set(Cuticle { damage: 0.5, ..default() }));
    wakes(set(StrandContact { radius: 2e-3, ..default() }));
    wakes(set(AirDrag { rate: 5.0 }));
    wakes(set(StrandModel::MassSpring));
    wakes(set(SleepSettings::never()));
    wakes(|app, _, _| {
        app.insert_resource(HairDefault(AirDrag { rate: 1.0 }));
    });
    let (mut app, hair, e) = sleeper();
    app.world_mut().entity_mut(hair).insert(AirDrag::default());
    run(&mut app, 0.1);
    assert!(is_asleep(&app, e), "the value that held anyway is no change");
}

#[test]
fn game_code_wakes_it() {
    wakes(|app, _, e| app.world_mut().get_mut::<Strand>(e).unwrap().velocities_mut()[5].x = 0.1);
    wakes(|app, _, e| app.world_mut().get_mut::<Strand>(e).unwrap().positions_mut()[8].x = 0.01);
    wakes(|app, _, e| app.world_mut().get_mut::<StrandSleep>(e).unwrap().wake());
    for act in [Hair::reset, Hair::restyle] {
        wakes(|app, hair, _| act(app.world_mut().entity_mut(hair)));
    }
    wakes(|app, hair, _| {
        let points = [Vec3::Z, Vec3::Z + Vec3::X * 0.1];
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    });
}

#[test]
fn a_teleport_wakes_it_only_if_it_goes_somewhere() {
    for moves in [false, true] {
        let (mut app, hair, e) = sleeper();
        Hair::teleport(app.world_mut().entity_mut(hair));
        app.world_mut().get_mut::<Transform>(hair).unwrap().translation.x +=
            if moves { 0.4 } else { 0.0 };
        run(&mut app, 0.1);
        assert_eq!(is_asleep(&app, e), !moves);
    }
}

#[cfg(feature = "save")]
#[test]
fn a_hairdo_wakes_it() {
    wakes(|app, hair, _| {
        let hairdo = Hairdo::of(app.world(), hair).unwrap();
        hairdo.apply(app.world_mut(), hair).unwrap();
    });
}

#[test]
fn masses_and_springs_sleep_too() {
    let mut app = test_app(60.0);
    let (hair, e) = one_strand(&mut app, 0.24, 8, Vec3::NEG_Y);
    app.world_mut().entity_mut(hair).insert(StrandModel::MassSpring);
    run(&mut app, 3.0);
    assert!(is_asleep(&app, e));
    go(&mut app, hair, |t| t.translation.x += 0.01);
    run(&mut app, 0.05);
    assert!(!is_asleep(&app, e));
}

#[test]
fn a_sleeper_is_drawn_where_it_lies_and_does_not_jump_there() {
    let mut app = test_app(60.0);
    let (_, e) = one_strand(&mut app, 0.24, 8, Vec3::new(1.0, -1.0, 0.0).normalize());
    let drawn = |app: &App, overstep: f32| {
        let world = app.world();
        let history = world.get::<bevy_keratin::hair::strand::StrandHistory>(e).unwrap();
        history.drawn(strand(app, e), 8, overstep)
    };
    let (mut last, mut asleep) = (drawn(&app, 0.5), 0);
    for _ in 0..60 * 20 {
        app.update();
        let now = drawn(&app, 0.5);
        if is_asleep(&app, e) {
            asleep += 1;
            let step = now.distance(last);
            assert!(step <= if asleep == 1 { SleepSettings::default().distance() } else { 0.0 });
            assert_eq!(drawn(&app, 0.0), strand(&app, e).positions()[8]);
        }
        last = now;
    }
    assert!(asleep > 60);
}

#[test]
fn sleep_loses_nothing_that_bonds_remember() {
    // Wet hair dried as gravity bends it, and let go by gravity.
    let bedhead = |sleep: SleepSettings| {
        let mut app = test_app(60.0);
        app.insert_resource(HairDefault(sleep));
        let (hair, ids) = lock(&mut app, 20);
        app.world_mut().write_message(HairTreatment::wet(hair));
        run(&mut app, 8.0);
        app.world_mut().write_message(HairTreatment::dry(hair).over(1.0));
        run(&mut app, 6.0);
        let slept = app.world().get::<SleepCounts>(hair).unwrap().asleep;
        no_gravity(&mut app);
        run(&mut app, 10.0);
        let tips: Vec<Vec3> = ids.iter().map(|e| strand(&app, *e).positions()[8]).collect();
        (tips, slept)
    };
    let (with, slept) = bedhead(SleepSettings::default());
    let (without, none) = bedhead(SleepSettings::never());
    assert!(slept > 10 && none == 0, "{slept} of 20 slept");
    let apart = with.iter().zip(&without).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(apart < 2e-3, "{apart} m apart");
}

/// What is left of hair that falls asleep on a head and is woken in part, as one number.
fn digest() -> u64 {
    let mut app = test_app(60.0);
    app.world_mut()
        .spawn((HairCollider::sphere(0.05).unwrap(), Transform::from_xyz(0.1, -0.06, 0.0)));
    let (_, ids) = lock(&mut app, 150);
    run(&mut app, 6.0);
    for e in ids.iter().step_by(7) {
        app.world_mut().get_mut::<Strand>(*e).unwrap().velocities_mut()[5] = Vec3::X * 0.3;
    }
    run(&mut app, 2.0);
    let asleep = ids.iter().filter(|e| is_asleep(&app, **e)).count() as u64;
    let all = ids.iter().flat_map(|e| bits(strand(&app, *e))).flatten();
    all.fold(asleep, |sum, b| (sum ^ u64::from(b)).wrapping_mul(0x100_0000_01b3))
}

/// Pools of threads are made once a process, so each number of threads gets one of its own.
#[test]
fn sleep_does_not_depend_on_threads() {
    use bevy::tasks::{ComputeTaskPool, TaskPoolBuilder};
    const THREADS: &str = "KERATIN_SLEEP_THREADS";
    if let Ok(threads) = std::env::var(THREADS) {
        let threads = threads.parse().unwrap();
        ComputeTaskPool::get_or_init(|| TaskPoolBuilder::new().num_threads(threads).build());
        println!("digest {}", digest());
        return;
    }
    let digests = ["1", "3"].map(|threads| {
        let out = std::process::Command::new(std::env::current_exe().unwrap())
            .args(["--exact", "sleep::sleep_does_not_depend_on_threads", "--nocapture"])
            .env(THREADS, threads)
            .output()
            .unwrap();
        let text = String::from_utf8(out.stdout).unwrap();
        let line = text.lines().find_map(|l| l.split_once("digest ")).map(|l| l.1.to_owned());
        line.unwrap_or_else(|| panic!("{text}"))
    });
    assert_eq!(digests[0], digests[1]);
}

#[test]
#[ignore = "measures time: run it alone on an idle machine"]
fn hair_that_sleeps_costs_next_to_nothing() {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(SleepSettings::never()));
    let hair = app.world_mut().spawn(Hair).id();
    for i in 0..4000 {
        let root = Vec3::new((i % 50) as f32, 0.0, (i / 50) as f32) * 2.5e-3;
        let points: Vec<Vec3> = (0..16).map(|k| root + Vec3::NEG_Y * (0.016 * k as f32)).collect();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap()));
    }
    run(&mut app, 0.3);
    // The best of some: others on the machine slow single ticks down.
    let tick = |app: &mut App| {
        let one = |_| {
            let start = Instant::now();
            app.update();
            start.elapsed().as_secs_f64()
        };
        (0..10).map(one).fold(f64::INFINITY, f64::min)
    };
    let awake = tick(&mut app);
    app.insert_resource(HairDefault(SleepSettings { speed: 1.0, turning: 10.0, seconds: 0.2 }));
    run(&mut app, 0.4);
    assert!(app.world().get::<SleepCounts>(hair).unwrap().all());
    let asleep = tick(&mut app);
    println!("awake {} ms, asleep {} ms: 1 in {}", awake * 1e3, asleep * 1e3, awake / asleep);
    // Much less where the engine is built with optimisation.
    assert!(awake > 4.0 * asleep, "awake {awake} s, asleep {asleep} s");
}
