//! A head of hair of which some strands are simulated, beside the same head with all of them.

use super::zoom;
use crate::common::*;
use bevy::prelude::*;
use bevy_keratin::{LodLevel, PresentLod, prelude::*};
use std::time::Instant;

pub const HEAD: f32 = 0.09;

/// One level with every iteration and substep, and this share of the strands.
pub fn fewer(strands: f32) -> HairLod {
    HairLod {
        levels: vec![LodLevel::new(0.5, 1000, 1).unwrap().with_strands(strands).unwrap()],
        ..default()
    }
}

/// Hair all over the upper half of a head, which is a collider.
pub fn head(app: &mut App, strands: usize, nodes: usize, length: f32) -> (Entity, Vec<Entity>) {
    let hair = app.world_mut().spawn(Hair).id();
    app.world_mut().spawn((HairCollider::sphere(HEAD).unwrap(), ChildOf(hair)));
    let grow = |i: usize| {
        let y = 0.95 - 0.9 * (i as f32 + 0.5) / strands as f32;
        let (sin, cos) = (2.399_963 * i as f32).sin_cos();
        let across = (1.0 - y * y).sqrt();
        let out = Vec3::new(across * cos, y, across * sin);
        let points = (0..nodes)
            .map(|k| out * (HEAD + 1e-3 + length * k as f32 / (nodes - 1) as f32))
            .collect::<Vec<_>>();
        app.world_mut().spawn((StrandOf(hair), Strand::from_polyline(&points).unwrap())).id()
    };
    let ids = (0..strands).map(grow).collect();
    (hair, ids)
}

/// Shakes and nods the head.
pub fn turn(app: &mut App, hair: Entity, seconds: f32) {
    let mut place = app.world_mut().get_mut::<Transform>(hair).unwrap();
    place.rotation = Quat::from_rotation_y(0.7 * (seconds * 5.0).sin())
        * Quat::from_rotation_x(0.3 * (seconds * 3.0).sin());
}

pub fn is_follower(app: &App, strand: Entity) -> bool {
    app.world().get::<StrandSleep>(strand).unwrap().is_follower()
}

pub fn carried(app: &App, ids: &[Entity]) -> Vec<Entity> {
    ids.iter().copied().filter(|e| is_follower(app, *e)).collect()
}

fn mean_and_most(all: &[f32]) -> (f32, f32) {
    (all.iter().sum::<f32>() / all.len() as f32, all.iter().copied().fold(0.0, f32::max))
}

/// Two heads of hair, of which the second one is going to be simulated with fewer strands.
fn heads(strands: f32, bending_length: Option<f32>) -> [(App, Entity, Vec<Entity>); 2] {
    [(); 2].map(|()| {
        let mut app = test_app(60.0);
        app.insert_resource(HairDefault(SleepSettings::never()));
        if let Some(length) = bending_length {
            app.insert_resource(HairDefault(HairStiffness::from_bending_length(length).unwrap()));
        }
        let (hair, ids) = head(&mut app, 400, 9, 0.24);
        app.world_mut().entity_mut(hair).insert(fewer(strands));
        (app, hair, ids)
    })
}

fn tips_apart(full: &App, few: &App, ids: &[Entity]) -> Vec<f32> {
    let tip = |app, e| strand(app, e).positions()[8];
    carried(few, ids).into_iter().map(|e| tip(full, e).distance(tip(few, e))).collect()
}

#[test]
fn hair_that_settles_with_fewer_strands_settles_near_to_what_it_would() {
    for (strands, mean_margin, margin) in [(0.5, 0.007, 0.05), (0.25, 0.008, 0.05)] {
        let [(mut full, ..), (mut few, hair, ids)] = heads(strands, None);
        zoom(&mut few, hair, 0.1);
        run(&mut full, 6.0);
        run(&mut few, 6.0);
        let (mean, most) = mean_and_most(&tips_apart(&full, &few, &ids));
        println!("{strands}: tips {mean} m apart, at most {most} m");
        assert!(mean < mean_margin && most < margin, "{strands}: {mean} m, at most {most} m");
    }
}

#[test]
fn hair_swings_with_fewer_strands_much_as_it_would() {
    for (strands, margin) in [(0.5, 0.025), (0.25, 0.035)] {
        let [(mut full, one, ids), (mut few, other, _)] = heads(strands, None);
        run(&mut full, 3.0);
        run(&mut few, 3.0);
        zoom(&mut few, other, 0.1);
        let (mut apart, mut swung) = (Vec::new(), Vec::new());
        let rest: Vec<Vec3> = ids.iter().map(|e| strand(&full, *e).positions()[8]).collect();
        for frame in 0..180 {
            for (app, hair) in [(&mut full, one), (&mut few, other)] {
                turn(app, hair, frame as f32 / 60.0);
                app.update();
            }
            apart.extend(tips_apart(&full, &few, &ids));
            swung.extend(
                ids.iter().zip(&rest).map(|(e, p)| strand(&full, *e).positions()[8].distance(*p)),
            );
        }
        let ((mean, most), swung) = (mean_and_most(&apart), mean_and_most(&swung));
        println!("{strands}: tips {mean} m apart, at most {most} m; they swing by {swung:?} m");
        assert!(mean < margin && mean < 0.35 * swung.0, "{strands}: {mean} m of {} m", swung.0);
        // It comes to rest where it would.
        run(&mut full, 5.0);
        run(&mut few, 5.0);
        let (mean, most) = mean_and_most(&tips_apart(&full, &few, &ids));
        println!("  {mean} m apart after that, at most {most} m");
        assert!(mean < 0.006, "{strands}: {mean} m after");
    }
}

/// Nothing pushes carried strands out of the head; they stay out as their guides do.
#[test]
fn soft_hair_that_lies_on_the_head_hardly_enters_it() {
    for strands in [0.5, 0.25] {
        let [_, (mut app, hair, ids)] = heads(strands, Some(0.01));
        run(&mut app, 3.0);
        zoom(&mut app, hair, 0.1);
        let (mut all, mut deepest) = (Vec::new(), 0.0_f32);
        for frame in 0..180 {
            turn(&mut app, hair, frame as f32 / 60.0);
            app.update();
            for e in carried(&app, &ids) {
                let depths = strand(&app, e).positions()[1..].iter().map(|p| HEAD - p.length());
                let depth = depths.fold(0.0, f32::max);
                all.push(depth);
                deepest = deepest.max(depth);
            }
        }
        let inside = all.iter().filter(|d| **d > 1e-3).count() as f32 / all.len() as f32;
        println!("{strands}: {inside} of strands below 1 mm, at most {deepest} m");
        assert!(inside < 0.1 && deepest < 0.02, "{strands}: {inside}, {deepest} m");
    }
}

#[test]
#[ignore = "measures time: run it alone on an idle machine"]
fn strands_that_are_carried_cost_little() {
    let mut app = test_app(60.0);
    app.insert_resource(HairDefault(SleepSettings::never()));
    let (hair, _) = head(&mut app, 2000, 16, 0.24);
    app.world_mut().entity_mut(hair).insert(fewer(0.25));
    run(&mut app, 0.5);
    for strength in [0.0, 20.0] {
        app.insert_resource(HairDefault(StrandContact { strength, ..default() }));
        // In turns, the best of each: others on the machine slow single turns down.
        let (mut best, mut first) = ([f64::INFINITY; 2], [f64::INFINITY; 2]);
        for _ in 0..5 {
            for ((best, first), share) in best.iter_mut().zip(&mut first).zip([1.0, 0.1]) {
                zoom(&mut app, hair, share);
                for tick in 0..6 {
                    let start = Instant::now();
                    app.update();
                    let taken = if tick == 0 { &mut *first } else { &mut *best };
                    *taken = taken.min(start.elapsed().as_secs_f64());
                }
            }
        }
        let ms = |seconds: [f64; 2]| seconds.map(|s| s * 1e3);
        println!(
            "contact {strength}: ms a tick with all strands and with a group {:?}, {:.2}; in which the \
             level begins {:?}",
            ms(best),
            best[1] / best[0],
            ms(first)
        );
        assert!(best[1] < if strength > 0.0 { 0.75 } else { 0.9 } * best[0], "{best:?}");
    }
    assert_eq!(app.world().get::<PresentLod>(hair).unwrap().followers, 1500);
}
