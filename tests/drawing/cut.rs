//! Hair that has been cut, as it is drawn.

use crate::offscreen::{Offscreen, Picture};
use bevy::prelude::*;
use bevy_keratin::{prelude::*, render::*};

const BLACK: [u8; 3] = [0; 3];
const SIZE: u32 = 256;

/// The lowest covered row of each column, where there is any.
fn ends(picture: &Picture) -> Vec<Option<u32>> {
    let covered = |x, y| picture.at(x, y) != BLACK;
    (0..SIZE).map(|x| (0..SIZE).rev().find(|y| covered(x, *y))).collect()
}

/// A curtain of waved guides, of different lengths, with followers between them, in front of a camera.
fn curtain(scene: &mut Offscreen, followers: HairFollowers) -> (Entity, Vec<Entity>) {
    scene.leave_grain();
    scene.look(Vec3::new(0.0, 0.0, 0.6), Vec3::ZERO);
    let look = HairLook { width: 4e-4, ..default() };
    let hair = scene.app.world_mut().spawn((Hair, look, followers, HairView::Moisture)).id();
    let strands = (0..80).map(|k| {
        let (x, row) = (0.005 * (k % 40) as f32 - 0.1, (k / 40) as f32);
        let length = 0.34 + 0.02 * (k as f32 * 1.7).sin();
        let node = |i: usize| {
            let s = i as f32 / 12.0;
            Vec3::new(x + 0.004 * (12.0 * s).sin(), 0.2 - length * s, 0.008 * row)
        };
        let strand = Strand::from_polyline(&(0..13).map(node).collect::<Vec<_>>()).unwrap();
        let bonds = Bonds::of(&strand);
        scene.app.world_mut().spawn((StrandOf(hair), strand, bonds)).id()
    });
    let strands = strands.collect();
    (hair, strands)
}

pub fn a_blunt_cut_ends_all_drawn_strands_and_leaves_the_rest_of_the_picture() {
    let mut scene = Offscreen::new(SIZE, SIZE);
    let followers = HairFollowers { flyaways: 0.0, ..HairFollowers::new(6000) };
    let (hair, _) = curtain(&mut scene, followers);
    let before = scene.draw();
    let plane = CutBy::Plane { point: Vec3::ZERO, normal: Vec3::NEG_Y };
    scene.app.world_mut().trigger(CutHair::all(hair, plane));
    let after = scene.draw();
    let line = scene.project(Vec3::new(0.0, 0.0, 0.004)).unwrap().y;
    let (long, short) = (ends(&before), ends(&after));
    let columns: Vec<(u32, u32)> =
        long.iter().zip(&short).filter_map(|(a, b)| Some(((*a)?, (*b)?))).collect();
    assert!(columns.len() > 80, "{} columns", columns.len());
    let off = |y: u32| (y as f32 + 0.5 - line).abs();
    let right = columns.iter().filter(|(_, y)| off(*y) < 3.0).count();
    println!("{right} of {} columns end within 3 pixels of {line}", columns.len());
    assert!(right as f32 > 0.95 * columns.len() as f32, "{right} of {}", columns.len());
    let lowest = columns.iter().map(|(_, y)| *y).max().unwrap();
    assert!((lowest as f32) < line + 4.0, "row {lowest} for {line}");
    assert!(columns.iter().filter(|(y, _)| *y as f32 > line + 20.0).count() > columns.len() / 2);
    // What is left is where it was: only light differs, through hair that is not there any more.
    let mut differ = [0, 0];
    for y in 0..(line - 12.0) as u32 {
        for x in 0..SIZE {
            let (a, b) = (before.at(x, y) != BLACK, after.at(x, y) != BLACK);
            differ[0] += u32::from(a);
            differ[1] += u32::from(a != b);
        }
    }
    println!("{} of {} covered pixels differ", differ[1], differ[0]);
    assert!(differ[0] > 3000 && differ[1] * 50 < differ[0], "{differ:?}");
    // With another number of followers all end with their guides, about there.
    scene.app.world_mut().entity_mut(hair).insert(HairFollowers { count: 5000, ..followers });
    let other = scene.draw();
    let ends = ends(&other);
    let near = ends.iter().flatten().filter(|y| off(**y) < 12.0).count();
    assert!(near as f32 > 0.9 * columns.len() as f32, "{near} of {}", columns.len());
}

pub fn a_cut_to_a_length_ends_followers_with_roots_of_their_own() {
    let mut scene = Offscreen::new(SIZE, SIZE);
    let followers = HairFollowers { flyaways: 0.0, ..HairFollowers::new(4000) };
    let (hair, strands) = curtain(&mut scene, followers);
    let roots = (0..2000).map(|i| {
        let way = Vec3::NEG_Y * (0.2 + 0.15 * (i % 7) as f32 / 6.0);
        let place = Vec3::new(1e-4 * i as f32 - 0.1, 0.2, 0.004);
        FollowerRoot { place, length: way.length(), reach: way, ..default() }
    });
    let roots = FollowerRoots(roots.collect());
    scene.app.world_mut().entity_mut(hair).insert(roots);
    let before = scene.draw();
    let line = scene.project(Vec3::new(0.0, 0.05, 0.004)).unwrap().y;
    assert!(ends(&before).iter().flatten().any(|y| *y as f32 > line + 40.0));
    scene.app.world_mut().trigger(CutHair::all(hair, CutBy::Length(0.15)));
    let after = scene.draw();
    let ends = ends(&after);
    let right = ends.iter().flatten().filter(|y| (**y as f32 + 0.5 - line).abs() < 6.0).count();
    println!("{right} of {} columns end within 6 pixels of {line}", ends.iter().flatten().count());
    assert!(right > 80 && right as f32 > 0.9 * ends.iter().flatten().count() as f32);
    assert!(ends.iter().flatten().all(|y| (*y as f32) < line + 7.0));
    let length = scene.app.world().get::<Strand>(strands[5]).unwrap().length();
    assert!((length - 0.15).abs() < 1e-6);
}
