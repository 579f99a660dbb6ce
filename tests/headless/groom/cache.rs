//! Hair that is recorded and played back, and grooms that move in their file.

use crate::common::*;
use bevy::{asset::AssetPlugin, prelude::*, time::TimeUpdateStrategy};
use bevy_keratin::{
    HairFault, HairLod, LodLevel, MotionOwner, SleepCounts,
    authoring::groom::{GroomCacheError, alembic},
    hair::strand::StrandHistory,
    prelude::*,
};

fn app() -> App {
    let mut app = App::new();
    app.add_plugins((MinimalPlugins, AssetPlugin::default(), HairPlugins::default()))
        .insert_resource(Time::<Fixed>::from_hz(60.0))
        .insert_resource(TimeUpdateStrategy::FixedTimesteps(1));
    ready(&mut app);
    app.update();
    app
}

/// Strands of several node counts that stand up, in an order that is not that of their counts.
fn hair(app: &mut App) -> (Entity, Vec<Entity>) {
    let hair = app.world_mut().spawn(Hair).id();
    let strand = |i: usize| {
        let nodes = 6 + i * 5 % 7;
        let root = Vec3::new(0.01 * i as f32, 0.0, 0.0);
        let lean = Vec3::new(0.1, 1.0, 0.05 * i as f32).normalize();
        let points: Vec<Vec3> = (0..nodes).map(|k| root + lean * (0.015 * k as f32)).collect();
        Strand::from_polyline(&points).unwrap()
    };
    let strands = (0..8).map(|i| app.world_mut().spawn((StrandOf(hair), strand(i))).id()).collect();
    (hair, strands)
}

fn places(app: &App, strands: &[Entity]) -> Vec<Vec3> {
    strands.iter().flat_map(|id| strand(app, *id).positions().to_vec()).collect()
}

fn worst(a: &[Vec3], b: &[Vec3]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| a.distance(*b)).fold(0.0, f32::max)
}

/// A second of hair that falls over, with what it looked like in each tick.
fn recorded(app: &mut App) -> (GroomCache, Vec<Vec<Vec3>>) {
    let (id, strands) = hair(app);
    app.world_mut().entity_mut(id).insert(RecordGroomCache::default());
    let mut seen = Vec::new();
    for _ in 0..60 {
        app.update();
        seen.push(places(app, &strands));
    }
    let cache = GroomCache::of_recording(app.world_mut(), id).unwrap();
    app.world_mut().entity_mut(id).despawn();
    (cache, seen)
}

fn play(app: &mut App, cache: GroomCache, play: PlayGroomCache) -> (Entity, Vec<Entity>) {
    let cache = app.world_mut().resource_mut::<Assets<GroomCache>>().add(cache);
    let (id, strands) = hair(app);
    app.world_mut().entity_mut(id).insert(PlayGroomCache { cache, ..play });
    wait_for(app, |app| (owner(app, id) == MotionOwner::Played).then_some(()));
    (id, strands)
}

fn owner(app: &App, hair: Entity) -> MotionOwner {
    *app.world().get::<MotionOwner>(hair).unwrap()
}

#[test]
fn a_recorded_run_plays_back_through_a_file() {
    let mut app = app();
    let (cache, seen) = recorded(&mut app);
    assert_eq!((cache.len(), cache.groom().len()), (60, 8));
    assert!((cache.duration() - 59.0 / 60.0).abs() < 1e-5, "{}", cache.duration());
    let fell = worst(&seen[0], &seen[59]);
    assert!(fell > 0.01, "it has fallen by {fell}");
    let file = alembic::write_cache(&cache).unwrap();
    let (read, losses) = GroomCache::from_file(&file, &GroomSettings::default()).unwrap();
    assert!(losses.is_empty(), "{losses}");
    assert_eq!(read, cache);

    let (id, strands) = play(&mut app, read, PlayGroomCache { speed: 0.0, ..default() });
    for (frame, seen) in seen.iter().enumerate() {
        let time = frame as f32 / 60.0;
        app.world_mut().get_mut::<PlayGroomCache>(id).unwrap().time = time;
        app.update();
        let off = worst(seen, &places(&app, &strands));
        assert!(off < 1e-5, "frame {frame} is off by {off}");
    }
    // By itself, a frame a tick, and then on to the last.
    app.world_mut().get_mut::<PlayGroomCache>(id).unwrap().speed = 1.0;
    app.world_mut().get_mut::<PlayGroomCache>(id).unwrap().time = 0.0;
    for seen in &seen[1..] {
        app.update();
        let off = worst(seen, &places(&app, &strands));
        assert!(off < 1e-5, "off by {off}");
    }
    run(&mut app, 0.5);
    assert!(worst(&seen[59], &places(&app, &strands)) < 1e-5, "it stays at the last frame");
    assert!(strands.iter().all(|id| rms_speed(strand(&app, *id)) == 0.0), "and rests there");
    assert_eq!(faults(&mut app), []);
}

#[test]
fn half_as_fast_between_frames_and_again_from_the_beginning() {
    let mut app = app();
    let (cache, seen) = recorded(&mut app);
    let slow = PlayGroomCache { speed: 0.5, repeat: true, ..default() };
    let (id, strands) = play(&mut app, cache, slow);
    app.world_mut().get_mut::<PlayGroomCache>(id).unwrap().time = 20.0 / 60.0;
    app.update();
    let between: Vec<Vec3> = seen[20].iter().zip(&seen[21]).map(|(a, b)| a.lerp(*b, 0.5)).collect();
    assert!(worst(&between, &places(&app, &strands)) < 1e-5);
    app.world_mut().get_mut::<PlayGroomCache>(id).unwrap().time = 58.75 / 60.0;
    app.update();
    // A quarter of a frame after the end it is a quarter after the beginning, and drawn without a way between them.
    let begun: Vec<Vec3> = seen[0].iter().zip(&seen[1]).map(|(a, b)| a.lerp(*b, 0.25)).collect();
    assert!(worst(&begun, &places(&app, &strands)) < 1e-5);
    let history = app.world().get::<StrandHistory>(strands[0]).unwrap();
    assert_eq!(history.positions, strand(&app, strands[0]).positions());
}

#[test]
fn followers_of_hair_that_is_played_are_reported() {
    let mut app = app();
    let (cache, _) = recorded(&mut app);
    let (id, _) = play(&mut app, cache, PlayGroomCache { repeat: true, ..default() });
    let level = LodLevel { below: 10.0, strands: 0.25, ..default() };
    app.world_mut()
        .entity_mut(id)
        .insert((HairLod { levels: vec![level], ..default() }, HairReport::default()));
    run(&mut app, 0.2);
    let report = app.world().get::<HairReport>(id).unwrap();
    let followers = app.world().get::<PresentLod>(id).unwrap().followers;
    assert_eq!((report.owner, report.followers), (MotionOwner::Played, followers));
    assert!(followers > 0, "{report:?}");
}

#[test]
fn hair_goes_on_from_where_it_is_and_as_fast_as_it_was() {
    let mut app = app();
    // A swing sideways by a metre a second, of a head that moves by half a metre a second.
    let line = |x: f32| (0..6).map(|k| Vec3::new(x, -0.02 * k as f32, 0.0)).collect::<Vec<_>>();
    let groom = Groom::from_polylines([line(0.0)]).unwrap();
    let frames = (0..61).map(|k| (f64::from(k) / 60.0, line(k as f32 / 60.0)));
    let cache = GroomCache::new(groom, frames).unwrap();
    let cache = app.world_mut().resource_mut::<Assets<GroomCache>>().add(cache);
    let play = PlayGroomCache::new(cache);
    let id = app.world_mut().spawn((Hair, play, Settling::default())).id();
    let own = Strand::from_polyline(&line(0.0)).unwrap();
    let own = app.world_mut().spawn((StrandOf(id), own)).id();
    for k in 0..30 {
        app.world_mut().get_mut::<Transform>(id).unwrap().translation.z = k as f32 / 120.0;
        app.update();
    }
    assert_eq!(owner(&app, id), MotionOwner::Played);
    assert!(app.world().get::<Settling>(id).is_none(), "it is drawn");
    assert_eq!(*app.world().get::<SleepCounts>(id).unwrap(), SleepCounts { asleep: 0, awake: 1 });
    let tip = strand(&app, own).velocities()[5];
    assert!(tip.distance(Vec3::new(1.0, 0.0, 0.5)) < 1e-3, "{tip}");
    let before = strand(&app, own).positions()[5];
    app.world_mut().entity_mut(id).remove::<PlayGroomCache>();
    app.world_mut().get_mut::<Transform>(id).unwrap().translation.z = 30.0 / 120.0;
    app.update();
    assert_eq!(owner(&app, id), MotionOwner::Simulated);
    let way = (strand(&app, own).positions()[5] - before) * 60.0;
    assert!((0.85..1.1).contains(&way.x), "the tip goes on, though its root stops: {way}");
    assert!(way.z.abs() < 0.1, "with its head: {way}");
    run(&mut app, 0.5);
    assert!(strand(&app, own).peak_strain() < 5e-3);
    assert_eq!(faults(&mut app), []);
}

#[test]
fn guides_of_a_groom_play_its_strands_by_their_roots() {
    let mut app = app();
    let line = |i: usize, turn: f32| {
        let root = Vec3::new(0.01 * i as f32, 0.0, 0.0);
        let along = Quat::from_rotation_z(turn) * Vec3::Y;
        (0..20).map(move |k| root + along * (0.01 * k as f32)).collect::<Vec<_>>()
    };
    let all = |turn: f32| (0..50).map(move |i| line(i, turn * (1.0 + 0.02 * i as f32)));
    let groom = Groom::from_polylines(all(0.0)).unwrap();
    let frames = (0..=30).map(|k| (f64::from(k) / 30.0, all(0.05 * k as f32).flatten().collect()));
    let cache = GroomCache::new(groom.clone(), frames).unwrap();
    let cache = app.world_mut().resource_mut::<Assets<GroomCache>>().add(cache);
    let groom = app.world_mut().resource_mut::<Assets<Groom>>().add(groom);
    let guides = GroomGuides { count: 10, nodes: 7, ..default() };
    let play = PlayGroomCache { speed: 0.0, time: 0.5, ..PlayGroomCache::new(cache) };
    let id = app.world_mut().spawn((GroomedHair { groom, guides }, play)).id();
    wait_for(&mut app, |app| (owner(app, id) == MotionOwner::Played).then_some(()));
    app.update();
    let members: Vec<Entity> = app.world().get::<Strands>(id).unwrap().iter().collect();
    assert_eq!(members.len(), 10);
    for member in members {
        let own = strand(&app, member).positions();
        let i = (own[0].x / 0.01).round();
        let along = Quat::from_rotation_z(0.75 * (1.0 + 0.02 * i)) * Vec3::Y;
        for (k, p) in own.iter().enumerate() {
            let expected = own[0] + along * (0.19 * k as f32 / (own.len() - 1) as f32);
            assert!(p.distance(expected) < 1e-5, "{i}, {k}: {p}, {expected}");
        }
    }
    // What is cut while it plays stays cut.
    app.world_mut().trigger(CutHair::all(id, CutBy::Length(0.1)));
    app.world_mut().flush();
    run(&mut app, 0.1);
    let members: Vec<Entity> = app.world().get::<Strands>(id).unwrap().iter().collect();
    for member in members {
        let own = strand(&app, member);
        let length: f32 = own.positions().windows(2).map(|p| p[0].distance(p[1])).sum();
        assert!((length - 0.1).abs() < 1e-4 && own.peak_strain() < 1e-3, "{length}");
    }
}

#[test]
fn what_cannot_be_a_cache_says_so() {
    let groom = Groom::from_polylines([[Vec3::ZERO, Vec3::Y]]).unwrap();
    let frame = |y: f32| vec![Vec3::ZERO, Vec3::Y * y];
    let made = |frames: Vec<(f64, Vec<Vec3>)>| GroomCache::new(groom.clone(), frames).unwrap_err();
    assert_eq!(made(vec![]), GroomCacheError::Empty);
    let error = made(vec![(0.0, frame(1.0)), (0.0, frame(1.0))]);
    assert_eq!(error, GroomCacheError::Time { frame: 1, found: 0.0, before: 0.0 });
    let error = made(vec![(0.0, frame(1.0)), (1.0, vec![Vec3::ZERO])]);
    assert!(matches!(error, GroomCacheError::Differs { frame: 1, found: 1, expected: 2, .. }));
    let error = made(vec![(0.0, frame(1.0)), (1.0, frame(f32::NAN))]);
    assert_eq!(error, GroomCacheError::NonFinite { frame: 1, node: 1 });
    // Between two of these is no number.
    let error = made(vec![(0.0, frame(3e38)), (1.0, frame(-3e38))]);
    assert_eq!(error, GroomCacheError::NonFinite { frame: 0, node: 1 });

    let mut app = app();
    let (id, strands) = hair(&mut app);
    let not = GroomCache::of_recording(app.world_mut(), id).unwrap_err();
    assert_eq!(not, GroomCacheError::NotRecorded);
    // Strands that come while it is recorded end it, and it is told once.
    app.world_mut().entity_mut(id).insert(RecordGroomCache::default());
    app.update();
    app.update();
    app.world_mut().entity_mut(strands[3]).despawn();
    run(&mut app, 0.1);
    let told = faults(&mut app);
    assert!(matches!(&told[..], [f] if f.message.contains("after 2 frames")), "{told:?}");
    assert_eq!(GroomCache::of_recording(app.world_mut(), id).unwrap().len(), 2);
    // A file that is not there: the hair is simulated, and it is told once.
    let missing = app.world().resource::<AssetServer>().load::<GroomCache>("missing.abc");
    app.world_mut().entity_mut(id).insert(PlayGroomCache::new(missing));
    run(&mut app, 0.5);
    assert_ne!(owner(&app, id), MotionOwner::Played);
    let told = faults(&mut app);
    assert!(matches!(&told[..], [f] if f.message.contains("missing.abc")), "{told:?}");
    // Numbers that are none.
    let (cache, _) = recorded(&mut app);
    faults(&mut app);
    let (id, strands) = play(&mut app, cache, PlayGroomCache { speed: f32::NAN, ..default() });
    run(&mut app, 0.1);
    assert_eq!(fault_kinds(&mut app), [FaultKind::Setting]);
    assert!(strands.iter().all(|id| strand(&app, *id).is_finite()));
    assert_eq!(app.world().get::<PlayGroomCache>(id).unwrap().time, 0.0);
}

/// Guides of a groom are as many as its strands, but in an order of their own.
#[test]
fn caches_and_materials_where_they_do_nothing_are_reported_with_what_is_there() {
    let mut app = app();
    let (hair, strands) = hair(&mut app);
    let character = app.world_mut().spawn_empty().id();
    app.world_mut().entity_mut(hair).insert((WornBy(character), StrandMaterial::default()));
    let (play, record) = (PlayGroomCache::default(), RecordGroomCache::default());
    app.world_mut().entity_mut(character).insert((play.clone(), record));
    app.world_mut().entity_mut(strands[0]).insert(StrandMaterial::default());
    run(&mut app, 3.0);
    app.world_mut().entity_mut(hair).insert((play, record));
    run(&mut app, 3.0);
    let reported = faults(&mut app);
    let is = |what: &str, of: Entity, there: String| {
        let is_it = |f: &HairFault| f.message.contains(what) && f.entity == Some(of);
        reported.iter().filter(|f| is_it(f) && f.message.contains(&there)).count() == 1
    };
    assert!(is("PlayGroomCache", character, format!("wears {hair}")), "{reported:?}");
    assert!(is("RecordGroomCache", character, format!("wears {hair}")), "{reported:?}");
    assert!(is("StrandMaterial", hair, format!("{hair} is a Hair")), "{reported:?}");
    assert_eq!(reported.len(), 3, "{reported:?}");
}

#[test]
fn each_strand_of_a_groom_plays_its_own() {
    let mut app = app();
    let line = |i: usize, lean: f32| -> Vec<Vec3> {
        let root = Vec3::X * 0.01 * i as f32;
        (0..16).map(|k| root + (Vec3::Y + Vec3::Z * lean * i as f32) * (0.01 * k as f32)).collect()
    };
    let groom = Groom::from_polylines((0..8).map(|i| line(i, 0.0))).unwrap();
    let leans = (0..8).flat_map(|i| line(i, 0.05)).collect();
    let cache =
        GroomCache::new(groom.clone(), [(0.0, groom.points().to_vec()), (1.0, leans)]).unwrap();
    let hair = app.world_mut().spawn(Hair).id();
    let guides = GroomGuides { count: 8, nodes: 16, ..default() };
    let strands = groom.spawn(&mut app.world_mut().commands(), hair, &guides).unwrap();
    app.world_mut().flush();
    let roots = |app: &App| -> Vec<Vec3> {
        strands.iter().map(|id| strand(app, *id).positions()[0]).collect()
    };
    let before = roots(&app);
    assert!(!before.is_sorted_by_key(|root| root.x), "in another order: {before:?}");
    let cache = app.world_mut().resource_mut::<Assets<GroomCache>>().add(cache);
    let play = PlayGroomCache { time: 1.0, speed: 0.0, ..PlayGroomCache::new(cache) };
    app.world_mut().entity_mut(hair).insert(play);
    run(&mut app, 0.1);
    assert!(worst(&roots(&app), &before) < 1e-5, "each stays at its root");
    for id in &strands {
        let own = strand(&app, *id).positions();
        let i = (own[0].x / 0.01).round() as usize;
        assert!(own[15].distance(line(i, 0.05)[15]) < 1e-4, "strand {i}");
    }
    // A cache that is not there yet: it is simulated.
    let nowhere = app.world_mut().resource_mut::<Assets<GroomCache>>().reserve_handle();
    app.world_mut().get_mut::<PlayGroomCache>(hair).unwrap().cache = nowhere;
    run(&mut app, 0.1);
    assert_ne!(app.world().get::<MotionOwner>(hair), Some(&MotionOwner::Played));
    assert_eq!(faults(&mut app), []);
}
