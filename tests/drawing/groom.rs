//! Followers drawn where a groom has them. Skipped, with the reason printed, where nothing can draw.

use crate::offscreen::{Offscreen, Picture};
use bevy::prelude::*;
use bevy_keratin::{
    prelude::*,
    render::{FollowerRoot, FollowerRoots, HairBuffers},
};

const BLACK: [u8; 3] = [0; 3];

/// How many pixels around a point of the hair show some.
fn seen(scene: &mut Offscreen, picture: &Picture, point: Vec3) -> usize {
    let middle = scene.project(point).unwrap();
    let near = |k: u32| (middle + Vec2::new((k % 9) as f32, (k / 9) as f32) - 4.0).as_uvec2();
    (0..81).map(near).filter(|p| picture.at(p.x, p.y) != BLACK).count()
}

pub fn followers_are_drawn_where_they_are_given_and_no_more_than_asked_for() {
    let mut scene = Offscreen::new(200, 160);
    scene.look(Vec3::new(0.0, 0.0, 0.6), Vec3::ZERO);
    let down: Vec<Vec3> = (0..9).map(|i| Vec3::new(-0.1, 0.1 - 0.025 * i as f32, 0.0)).collect();
    let root = |x: f32| FollowerRoot {
        place: Vec3::new(x, 0.1, 0.0),
        // Longer than the guide, which then is followed larger.
        length: 0.22,
        reach: Vec3::NEG_Y * 0.22,
        ..default()
    };
    let followers = HairFollowers { stray: 0.0, clump: 0.0, ..HairFollowers::new(2) };
    let look = HairLook { width: 5e-3, taper: 1.0, ..default() };
    let given = FollowerRoots(vec![root(0.0), root(0.1)]);
    let world = scene.app.world_mut();
    let hair = world.spawn((Hair, look, followers, HairView::Moisture, given)).id();
    world.spawn((StrandOf(hair), Strand::from_polyline(&down).unwrap()));

    let at = |x: f32, y: f32| Vec3::new(x, y, 0.0);
    let counts = |scene: &mut Offscreen| {
        let picture = scene.draw();
        [-0.1, 0.0, 0.1].map(|x| seen(scene, &picture, at(x, 0.0)))
    };
    let [guide, first, second] = counts(&mut scene);
    assert!(guide > 5 && first > 5 && second > 5, "{guide} {first} {second}");
    let picture = scene.draw();
    assert!(seen(&mut scene, &picture, at(0.1, -0.11)) > 5, "longer than the guide");
    assert_eq!(seen(&mut scene, &picture, at(-0.1, -0.115)), 0, "the guide is shorter");

    let set = |scene: &mut Offscreen, count| {
        let followers = HairFollowers { count, ..followers };
        scene.app.world_mut().entity_mut(hair).insert(followers);
    };
    set(&mut scene, 1);
    let [_, first, second] = counts(&mut scene);
    assert!(first > 5 && second == 0, "one of two: {first} {second}");
    assert_eq!(scene.app.world().get::<HairBuffers>(hair).unwrap().strand_count, 2);

    set(&mut scene, 9);
    scene.app.world_mut().get_mut::<FollowerRoots>(hair).unwrap().0.remove(0);
    let [_, first, second] = counts(&mut scene);
    assert!(first == 0 && second > 5, "the other one alone: {first} {second}");

    scene.app.world_mut().entity_mut(hair).remove::<FollowerRoots>();
    let [guide, first, second] = counts(&mut scene);
    assert!(guide > 5 && first + second == 0, "around the guide again: {guide} {first} {second}");
    assert_eq!(scene.app.world().get::<HairBuffers>(hair).unwrap().strand_count, 10);
}

/// A picture of hair that falls over, and one of the same hair as a file of that run has it.
pub fn hair_that_is_played_is_drawn_as_it_was_when_it_was_recorded() {
    let spawn = |scene: &mut Offscreen, is_kept: bool| {
        scene.look(Vec3::new(0.0, 0.0, 0.5), Vec3::ZERO);
        let world = scene.app.world_mut();
        let look = HairLook { width: 2e-3, taper: 1.0, ..default() };
        let hair = world.spawn((Hair, look, HairFollowers::new(60), HairView::Moisture)).id();
        if is_kept {
            world.entity_mut(hair).insert(RecordGroomCache::default());
        }
        for i in 0..9 {
            let root = Vec3::new(0.03 * (i % 3) as f32 - 0.03, 0.0, 0.02 * (i / 3) as f32);
            let lean = Vec3::new(0.3, 1.0, 0.1 * i as f32).normalize();
            let line: Vec<Vec3> = (0..12).map(|k| root + lean * (0.012 * k as f32)).collect();
            world.spawn((StrandOf(hair), Strand::from_polyline(&line).unwrap()));
        }
        hair
    };
    let tick = |scene: &mut Offscreen, ticks: u32| {
        scene.ticking(1);
        (0..ticks).for_each(|_| scene.app.update());
        scene.ticking(0);
    };
    let mut scene = Offscreen::new(240, 180);
    let hair = spawn(&mut scene, true);
    let first = scene.draw();
    tick(&mut scene, 20);
    let fallen = scene.draw();
    let cache = GroomCache::of_recording(scene.app.world_mut(), hair).unwrap();
    let (cache, losses) = GroomCache::from_file(
        &bevy_keratin::authoring::groom::alembic::write_cache(&cache).unwrap(),
        &GroomSettings { keep_strays: true, ..default() },
    )
    .unwrap();
    assert!(losses.is_empty(), "{losses}");
    let end = cache.duration();

    let mut scene = Offscreen::new(240, 180);
    let hair = spawn(&mut scene, false);
    let cache = scene.app.world_mut().resource_mut::<Assets<GroomCache>>().add(cache);
    // What stands still is drawn where it is, what moves between its last two ticks: at the earlier, just after the later.
    let time = end - scene.app.world().resource::<Time<Fixed>>().timestep().as_secs_f32();
    let play = PlayGroomCache { time, speed: 0.0, ..PlayGroomCache::new(cache) };
    scene.app.world_mut().entity_mut(hair).insert(play);
    tick(&mut scene, 3);
    let played = scene.draw();
    let other = |a: &Picture, b: &Picture| {
        let pairs = a.pixels().zip(b.pixels());
        pairs.filter(|(a, b)| a.iter().zip(b).any(|(a, b)| a.abs_diff(*b) > 8)).count()
    };
    let hairy = fallen.covered(BLACK);
    let (moved, off) = (other(&first, &fallen), other(&played, &fallen));
    println!("{hairy} pixels of hair, {moved} changed as it fell, {off} as it was played");
    if let Ok(folder) = std::env::var("PLAYED") {
        fallen.save(&format!("{folder}/recorded.png"));
        played.save(&format!("{folder}/played.png"));
    }
    assert!(hairy > 1000 && moved > hairy / 2, "{hairy} {moved}");
    assert!(off < hairy / 50, "{off} of {hairy}");
}
