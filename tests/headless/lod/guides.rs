//! Which strands are simulated, and how the others begin, go along and end.

use super::{
    head::{HEAD, carried, fewer, head, is_follower, turn},
    zoom,
};
use crate::common::*;
use bevy::{ecs::entity_disabling::Disabled, prelude::*};
use bevy_keratin::{
    FaultKind, LodLevel, PresentLod, SleepCounts, hair::strand::TickPose, prelude::*,
    simulation::lod::Follower,
};

fn simulated(app: &App, ids: &[Entity]) -> Vec<Entity> {
    ids.iter().copied().filter(|e| !is_follower(app, *e)).collect()
}

fn put(app: &mut App, hair: Entity, lod: HairLod, share: f32) {
    app.world_mut().entity_mut(hair).insert(lod);
    zoom(app, hair, share);
    app.update();
}

/// A head of 60 strands at a level with a group of them.
fn group() -> (App, Entity, Vec<Entity>) {
    let mut app = test_app(60.0);
    let (hair, ids) = head(&mut app, 60, 9, 0.24);
    put(&mut app, hair, fewer(0.25), 0.1);
    assert_eq!(simulated(&app, &ids).len(), 15);
    (app, hair, ids)
}

#[test]
fn the_share_that_is_simulated_is_spread_evenly_and_finer_levels_hold_coarser_ones() {
    let mut app = test_app(60.0);
    let (hair, ids) = head(&mut app, 400, 4, 0.1);
    let level = |below, share| LodLevel::new(below, 5, 1).unwrap().with_strands(share).unwrap();
    let levels = vec![level(0.5, 0.5), level(0.2, 0.1), level(0.1, 0.002)];
    put(&mut app, hair, HairLod { levels, ..default() }, 1.0);
    assert_eq!(simulated(&app, &ids).len(), 400);
    let mut before: Vec<Entity> = ids.clone();
    let mut known = Vec::new();
    for (share, count) in [(0.4, 200), (0.15, 40), (0.05, 1)] {
        zoom(&mut app, hair, share);
        app.update();
        let now = simulated(&app, &ids);
        assert_eq!(now.len(), count);
        assert_eq!(app.world().get::<PresentLod>(hair).unwrap().followers, 400 - count);
        assert!(now.iter().all(|e| before.contains(e)), "nested");
        // Each stands for an area of the half sphere; none is farther from one than a few radii.
        let area = core::f32::consts::TAU * HEAD * HEAD / count as f32;
        let radius = (area / core::f32::consts::PI).sqrt();
        let root = |e: &Entity| strand(&app, *e).positions()[0];
        let farthest = ids
            .iter()
            .map(|e| now.iter().map(|g| root(g).distance(root(e))).fold(f32::INFINITY, f32::min));
        let farthest = farthest.fold(0.0, f32::max);
        println!("{count}: {farthest} m to the nearest, radius {radius} m");
        assert!(farthest < 2.2 * radius, "{count}: {farthest} m");
        before = now.clone();
        known.push(now);
    }
    for (share, known) in [(0.15, &known[1]), (0.4, &known[0]), (1.0, &ids)] {
        zoom(&mut app, hair, share);
        app.update();
        assert_eq!(simulated(&app, &ids), *known, "the same ones again");
    }
    assert_eq!(faults(&mut app), []);
}

/// Where everyone's nodes are in the world.
fn places(app: &App, hair: Entity, ids: &[Entity]) -> Vec<Vec3> {
    let pose = *app.world().get::<TickPose>(hair).unwrap().now();
    ids.iter().flat_map(|e| strand(app, *e).positions()).map(|p| pose.point_out(*p)).collect()
}

/// The largest of all nodes' changes of displacement from frame to frame (m).
fn jolt([a, b, c]: [&[Vec3]; 3]) -> f32 {
    let all = a.iter().zip(b).zip(c).map(|((a, b), c)| (*a + *c - *b * 2.0).length());
    all.fold(0.0, f32::max)
}

#[test]
fn nothing_pops_while_hair_swings_and_velocities_are_those_of_the_motion() {
    let mut apps = [(); 2].map(|()| {
        let mut app = test_app(60.0);
        let (hair, ids) = head(&mut app, 120, 9, 0.24);
        put(&mut app, hair, fewer(0.25), 1.0);
        (app, hair, ids)
    });
    let mut seen = [const { Vec::<Vec<Vec3>>::new() }; 2];
    let (mut strain, mut off) = (0.0_f32, 0.0_f32);
    for frame in 0..300 {
        for (i, (app, hair, ids)) in apps.iter_mut().enumerate() {
            turn(app, *hair, frame as f32 / 60.0);
            if i == 1 && frame % 60 == 59 {
                zoom(app, *hair, if frame % 120 == 59 { 0.1 } else { 1.0 });
            }
            app.update();
            let now = places(app, *hair, ids);
            for (k, e) in ids.iter().enumerate().filter(|(_, e)| is_follower(app, **e)) {
                let strand = strand(app, *e);
                strain = strain.max(strand.peak_strain());
                let pose = app.world().get::<TickPose>(*hair).unwrap().now();
                let before = seen[i].last().map_or(&[][..], |b| &b[9 * k..]);
                for (n, v) in strand.velocities().iter().enumerate().skip(1) {
                    let moved = pose.direction_in(now[9 * k + n] - before[n]);
                    off = off.max((*v / 60.0).distance(moved));
                }
            }
            seen[i].push(now);
        }
    }
    let jolts = |seen: &[Vec<Vec3>], frames: &dyn Fn(usize) -> bool| {
        let all = seen.windows(3).enumerate().filter(|(i, _)| frames(i + 2));
        all.map(|(_, w)| jolt([&w[0], &w[1], &w[2]])).fold(0.0, f32::max)
    };
    let plain = jolts(&seen[0], &|frame| frame > 58);
    let at = |change: usize| move |frame: usize| frame > 58 && (frame + 121 - change) % 120 < 2;
    let (begun, ended) = (jolts(&seen[1], &at(60)), jolts(&seen[1], &at(0)));
    let between = jolts(&seen[1], &|frame| frame > 58);
    let apart = seen[0][59].iter().zip(&seen[1][59]).map(|(a, b)| a.distance(*b));
    let apart = apart.fold(0.0, f32::max);
    println!(
        "jolts {begun} m as it begins, {ended} m as it ends, {between} m in all, \
             {plain} m without; {apart} m apart after the first tick; strain {strain}; velocities off by {off} m a tick"
    );
    assert!(seen[0][58] == seen[1][58] && apart > 0.0, "the same until then");
    // By its own motion alone: what swings is pulled by up to five times its weight.
    assert!(apart < 8e-3, "{apart} m apart");
    assert!(begun < 1.2 * plain + 3e-3, "{begun} m, {plain} m without");
    assert!(ended < 1.2 * plain + 1e-3, "{ended} m, {plain} m without");
    assert!(strain < 0.03, "{strain}");
    assert!(off < 1e-5, "{off} m");
    assert_eq!(faults(&mut apps[1].0), []);
}

/// Springs have no twist that others could follow.
#[test]
fn springs_are_all_simulated() {
    let (mut app, hair, ids) = group();
    let carried = |app: &App| ids.iter().filter(|e| is_follower(app, **e)).count();
    assert!(carried(&app) > ids.len() / 2);
    for (model, some) in [(StrandModel::MassSpring, false), (StrandModel::Rod, true)] {
        app.world_mut().entity_mut(hair).insert(model);
        run(&mut app, 0.1);
        assert_eq!(carried(&app) > 0, some, "{model:?}");
    }
    assert_eq!(faults(&mut app), []);
}

#[test]
fn roots_stay_and_hair_goes_along_when_it_is_put_elsewhere() {
    let (mut app, hair, ids) = group();
    let roots: Vec<Vec3> = ids.iter().map(|e| strand(&app, *e).positions()[0]).collect();
    run(&mut app, 2.0);
    let before: Vec<_> = ids.iter().map(|e| strand(&app, *e).positions().to_vec()).collect();
    app.world_mut().entity_mut(hair).get_mut::<Transform>().unwrap().translation.x += 5.0;
    app.update();
    for ((e, root), before) in ids.iter().zip(&roots).zip(&before) {
        let now = strand(&app, *e).positions();
        assert_eq!(now[0], *root);
        let apart = now.iter().zip(before).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
        assert!(apart < 5e-3, "{apart} m");
    }
    // All strands are reset, followers as well.
    app.world_mut().commands().entity(hair).queue(Hair::reset);
    app.insert_resource(HairGravity(Vec3::ZERO));
    run(&mut app, 0.5);
    assert_eq!(carried(&app, &ids).len(), 45);
    for e in &ids {
        let p = strand(&app, *e).positions();
        let out = p[0].normalize() * (HEAD + 1e-3 + 0.24);
        assert!(p[8].distance(out) < 5e-3, "{} m", p[8].distance(out));
    }
}

#[test]
fn followers_sleep_and_wake_with_their_guides() {
    let mut app = test_app(60.0);
    let (hair, ids) = head(&mut app, 60, 9, 0.24);
    put(&mut app, hair, fewer(0.25), 0.1);
    let sleepers = |app: &App| *app.world().get::<SleepCounts>(hair).unwrap();
    let mut seconds = 0.0;
    while !sleepers(&app).all() {
        run(&mut app, 0.5);
        seconds += 0.5;
        assert!(seconds < 60.0, "{:?}", sleepers(&app));
    }
    run(&mut app, 0.1);
    let asleep = |app: &App| {
        ids.iter().filter(|e| app.world().get::<StrandSleep>(**e).unwrap().is_asleep()).count()
    };
    assert_eq!((sleepers(&app).asleep, asleep(&app)), (15, 60));
    let rest = places(&app, hair, &ids);
    run(&mut app, 0.5);
    assert_eq!(places(&app, hair, &ids), rest, "to the last bit");
    assert!(ids.iter().all(|e| rms_speed(strand(&app, *e)) == 0.0));
    turn(&mut app, hair, 0.05);
    app.update();
    assert_eq!(asleep(&app), 0);
    app.update();
    assert!(carried(&app, &ids).iter().all(|e| rms_speed(strand(&app, *e)) > 0.0));
}

#[test]
fn a_held_strand_is_simulated_and_is_no_guide() {
    let (mut app, hair, ids) = group();
    run(&mut app, 1.0);
    let (guide, other) = (simulated(&app, &ids)[3], carried(&app, &ids)[7]);
    for e in [guide, other] {
        let targets = strand(&app, e).positions().iter().map(|p| Some(*p)).collect();
        app.world_mut().entity_mut(e).insert(HeldNodes { targets, ..default() });
    }
    app.update();
    // A group of the 58 that are free, and the two.
    assert!(!is_follower(&app, guide) && !is_follower(&app, other));
    assert_eq!(simulated(&app, &ids).len(), 15 + 2);
    let held = strand(&app, guide).positions().to_vec();
    for i in 0..60 {
        turn(&mut app, hair, i as f32 / 60.0);
        app.update();
    }
    assert!(strand(&app, guide).positions()[8].distance(held[8]) < 1e-3);
    let swung = carried(&app, &ids).iter().filter(|e| rms_speed(strand(&app, **e)) > 0.01).count();
    assert_eq!(swung, 43, "all others move");
    app.world_mut().entity_mut(guide).remove::<HeldNodes>();
    app.world_mut().entity_mut(other).remove::<HeldNodes>();
    app.update();
    assert!(is_follower(&app, other) && !is_follower(&app, guide));
}

#[test]
fn strands_may_come_go_and_change_their_hair_at_a_level() {
    let (mut app, hair, ids) = group();
    run(&mut app, 0.5);
    // Half the guides go.
    let guides = simulated(&app, &ids);
    guides.iter().step_by(2).for_each(|e| assert!(app.world_mut().despawn(*e)));
    let ids: Vec<Entity> = ids.into_iter().filter(|e| app.world().get_entity(*e).is_ok()).collect();
    let before = places(&app, hair, &ids);
    app.update();
    assert_eq!(ids.len(), 52);
    assert_eq!(simulated(&app, &ids).len(), 13);
    let after = places(&app, hair, &ids);
    let moved = before.iter().zip(&after).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!(moved < 0.02, "{moved} m in a tick");
    // Others come, one of them no strand at all, one not finite.
    let point = |i: usize| Vec3::new(0.0, HEAD + 0.02 * i as f32, 0.01);
    let strand_of = || Strand::from_polyline(&[0, 1, 2].map(point)).unwrap();
    let come = app.world_mut().spawn((StrandOf(hair), strand_of())).id();
    let none = app.world_mut().spawn((StrandOf(hair), Strand::default())).id();
    let mut broken = strand_of();
    broken.positions_mut()[2] = Vec3::NAN;
    let broken = app.world_mut().spawn((StrandOf(hair), broken)).id();
    run(&mut app, 0.2);
    assert!(!is_follower(&app, none));
    assert!([come, broken].iter().all(|e| strand(&app, *e).is_finite()));
    assert_eq!(simulated(&app, &ids).len() + simulated(&app, &[come, broken]).len(), 14);
    // A non-finite guide is reset; no strand follows it meanwhile.
    let guide = simulated(&app, &ids)[0];
    app.world_mut().get_mut::<Strand>(guide).unwrap().positions_mut()[3] = Vec3::NAN;
    run(&mut app, 0.2);
    assert!(ids.iter().all(|e| strand(&app, *e).is_finite()));
    let reported = faults(&mut app);
    assert!(
        reported
            .iter()
            .all(|f| matches!(f.kind, FaultKind::Strand | FaultKind::PutBack | FaultKind::Rebuilt))
    );
    // One goes over to other hair, which has no levels; one to none.
    let [gone, alone] = [0, 1].map(|i| carried(&app, &ids)[i]);
    let other = app.world_mut().spawn(Hair).id();
    app.world_mut().entity_mut(gone).insert(StrandOf(other));
    app.world_mut().entity_mut(alone).remove::<StrandOf>();
    run(&mut app, 0.1);
    assert!(!is_follower(&app, gone) && !is_follower(&app, alone));
    assert!(rms_speed(strand(&app, gone)) > 0.0);
    // Without levels everyone is simulated.
    app.world_mut().entity_mut(hair).remove::<HairLod>();
    app.update();
    assert_eq!(carried(&app, &ids), []);
    let present = app.world().get::<PresentLod>(hair).unwrap();
    assert_eq!((present.level, present.followers), (0, 0));
    app.world_mut().entity_mut(hair).despawn();
    run(&mut app, 0.1);
}

#[test]
fn the_same_head_gives_the_same_bits() {
    let go = || {
        let (mut app, hair, ids) = group();
        for i in 0..90 {
            turn(&mut app, hair, i as f32 / 60.0);
            zoom(&mut app, hair, if i % 40 < 20 { 0.1 } else { 1.0 });
            app.update();
        }
        places(&app, hair, &ids)
    };
    assert_eq!(go(), go());
}

#[test]
fn hair_that_sleeps_sleeps_on_when_fewer_strands_are_simulated_and_when_all_are_again() {
    let mut app = test_app(60.0);
    let (hair, ids) = head(&mut app, 60, 9, 0.24);
    put(&mut app, hair, fewer(0.25), 1.0);
    run(&mut app, 0.1);
    // Whatever it does counts as lying still.
    app.insert_resource(HairDefault(SleepSettings { speed: 1.0, turning: 10.0, seconds: 0.2 }));
    run(&mut app, 1.0);
    let asleep = |app: &App| {
        ids.iter().filter(|e| app.world().get::<StrandSleep>(**e).unwrap().is_asleep()).count()
    };
    assert_eq!(asleep(&app), 60);
    for (share, count) in [(0.1, 45), (1.0, 0)] {
        zoom(&mut app, hair, share);
        for _ in 0..3 {
            app.update();
            assert_eq!((carried(&app, &ids).len(), asleep(&app)), (count, 60));
        }
    }
}

#[test]
fn what_is_spoiled_while_disabled_is_repaired_once_enabled() {
    for share in [0.0, 0.25] {
        let mut app = test_app(60.0);
        let (hair, ids) = head(&mut app, 60, 9, 0.24);
        put(&mut app, hair, fewer(share), 0.1);
        run(&mut app, 0.5);
        let followers = carried(&app, &ids);
        app.world_mut().entity_mut(followers[3]).insert(Disabled);
        app.world_mut().get_mut::<Strand>(followers[3]).unwrap().positions_mut()[0].y =
            f32::INFINITY;
        run(&mut app, 0.5);
        app.world_mut().entity_mut(followers[3]).remove::<Disabled>();
        run(&mut app, 0.1);
        let repaired = strand(&app, followers[3]);
        assert!(repaired.is_finite(), "{share}: {:?}", repaired.positions());
    }
}

#[test]
fn what_was_disabled_while_the_level_ended_is_simulated_once_enabled() {
    let (mut app, hair, ids) = group();
    let away = carried(&app, &ids)[7];
    app.world_mut().entity_mut(away).insert(Disabled);
    zoom(&mut app, hair, 1.0);
    run(&mut app, 0.1);
    let present: Vec<Entity> = ids.iter().copied().filter(|e| *e != away).collect();
    assert_eq!(carried(&app, &present), []);
    app.world_mut().entity_mut(away).remove::<Disabled>();
    app.update();
    assert!(!is_follower(&app, away));
    let before = strand(&app, away).positions()[8];
    turn(&mut app, hair, 0.5);
    run(&mut app, 0.2);
    assert!(strand(&app, away).positions()[8].distance(before) > 1e-3);
    // A clone of a follower in hair that has none is simulated, too.
    put(&mut app, hair, fewer(0.25), 0.1);
    let follower = carried(&app, &ids)[3];
    let clone = app.world_mut().entity_mut(follower).clone_and_spawn();
    zoom(&mut app, hair, 1.0);
    run(&mut app, 0.1);
    assert!(!is_follower(&app, clone));
    assert_eq!(faults(&mut app), []);
}

#[test]
fn a_follower_that_forgets_its_guides_gets_some_again() {
    let mut app = test_app(60.0);
    let (hair, ids) = head(&mut app, 60, 9, 0.24);
    put(&mut app, hair, fewer(0.25), 0.1);
    run(&mut app, 0.2);
    let lost = carried(&app, &ids)[3];
    app.world_mut().entity_mut(lost).remove::<Follower>();
    assert!(!is_follower(&app, lost));
    run(&mut app, 0.1);
    assert!(is_follower(&app, lost));
    // Where no levels are any more, it is simulated.
    app.world_mut().entity_mut(lost).remove::<Follower>();
    app.world_mut().entity_mut(hair).remove::<HairLod>();
    let before = strand(&app, lost).positions()[8];
    turn(&mut app, hair, 0.5);
    run(&mut app, 0.2);
    assert!(strand(&app, lost).positions()[8].distance(before) > 1e-3);
}

#[test]
fn frozen_hair_keeps_its_shape_on_the_head_and_goes_on_from_it() {
    let mut app = test_app(60.0);
    let (hair, ids) = head(&mut app, 60, 9, 0.24);
    put(&mut app, hair, fewer(0.0), 1.0);
    for tick in 0..60 {
        turn(&mut app, hair, tick as f32 / 60.0);
        app.update();
    }
    put(&mut app, hair, fewer(0.0), 0.1);
    app.update();
    let frozen = places(&app, hair, &ids);
    let shape = |app: &App| -> Vec<Vec3> {
        ids.iter().flat_map(|e| strand(app, *e).positions().to_vec()).collect()
    };
    let before = shape(&app);
    assert_eq!(carried(&app, &ids).len(), 60);
    assert!(!frozen.is_empty());
    for tick in 60..120 {
        turn(&mut app, hair, tick as f32 / 60.0);
        app.update();
    }
    assert_eq!(shape(&app), before, "to the bit");
    // A hand that takes a strand moves it.
    let targets: Vec<_> = strand(&app, ids[5]).positions().iter().map(|p| Some(*p)).collect();
    let lifted = targets.iter().map(|p| p.map(|p| p + Vec3::Y * 1e-3)).collect();
    app.world_mut().entity_mut(ids[5]).insert(HeldNodes { targets: lifted, ..default() });
    run(&mut app, 0.1);
    assert!(!is_follower(&app, ids[5]));
    let tip = strand(&app, ids[5]).positions()[8];
    assert!((tip.y - targets[8].unwrap().y - 1e-3).abs() < 1e-5, "{tip}");
    app.world_mut().entity_mut(ids[5]).remove::<HeldNodes>();
    run(&mut app, 0.1);
    assert!(is_follower(&app, ids[5]));
    // Near again it goes on from there; the head rests, so it does not stay behind.
    run(&mut app, 0.2);
    put(&mut app, hair, fewer(0.0), 1.0);
    app.update();
    assert_eq!(carried(&app, &ids), []);
    let jump = shape(&app).iter().zip(&before).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max);
    assert!((1e-6..0.02).contains(&jump), "{jump} m in one tick");
    run(&mut app, 6.0);
    assert!(ids.iter().all(|e| strand(&app, *e).peak_strain() < 0.01));
    assert_eq!(faults(&mut app), []);
}
