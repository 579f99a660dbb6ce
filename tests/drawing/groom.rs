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
