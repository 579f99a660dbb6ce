//! What a game asks of worn hair on its second day.
#![cfg(feature = "groom")]

use crate::{
    common::run,
    wear::{app, worn},
    worlds_measured::wearer::character,
};
use bevy::prelude::*;
use bevy_keratin::{AddedMass, authoring::plant::HairPreset, prelude::*};

/// A character with worn hair: the wearer and the hair.
fn wearing(preset: HairPreset, scale: Vec3) -> (App, Entity, Entity) {
    let mut app = app();
    let place = Transform::from_scale(scale);
    let root = app.world_mut().spawn((place, WearHair::new(preset))).id();
    character(&mut app, root, 1.0);
    let hair = worn(&mut app);
    (app, root, hair)
}

fn strands(app: &App, hair: Entity) -> Vec<Entity> {
    app.world().get::<Strands>(hair).unwrap().iter().collect()
}

/// The largest step of a node in the next second, as a speed (m/s).
fn fastest(app: &mut App, hair: Entity) -> f32 {
    let ids = strands(app, hair);
    let positions = |app: &App| -> Vec<Vec3> {
        let of = |id: &Entity| app.world().get::<Strand>(*id).unwrap().positions().to_vec();
        ids.iter().flat_map(of).collect()
    };
    let (mut before, mut most) = (positions(app), 0.0_f32);
    for _ in 0..60 {
        app.update();
        let now = positions(app);
        most = before.iter().zip(&now).map(|(a, b)| 60.0 * a.distance(*b)).fold(most, f32::max);
        before = now;
    }
    most
}

#[test]
fn long_hair_of_a_character_that_is_stretched_comes_to_rest() {
    for scale in [Vec3::ONE, Vec3::new(1.0, 1.25, 1.0), Vec3::new(1.3, 0.9, 1.1)] {
        let (mut app, _, hair) = wearing(HairPreset::Long, scale);
        run(&mut app, 8.0);
        let speed = fastest(&mut app, hair);
        println!("scaled by {scale}: {speed} m/s");
        assert!(speed < 0.05, "scaled by {scale}: {speed} m/s");
    }
}

/// The share of nodes that look wet by more than a half, and the mean mass of water (in dry masses).
fn wetness(app: &App, ids: &[Entity]) -> (f32, f32) {
    let (mut wet, mut count, mut mass) = (0, 0, 0.0);
    for id in ids {
        let moisture = app.world().get::<Moisture>(*id).unwrap();
        wet += moisture.sheen().iter().filter(|sheen| **sheen > 0.5).count();
        count += moisture.sheen().len();
        mass += app.world().get::<AddedMass>(*id).unwrap().mass.iter().sum::<f32>();
    }
    (wet as f32 / count as f32, mass / count as f32)
}

#[test]
fn rain_and_a_dive_are_seen_at_once() {
    let (mut app, _, hair) = wearing(HairPreset::Wavy, Vec3::ONE);
    let ids = strands(&app, hair);
    let place = *app.world().get::<GlobalTransform>(hair).unwrap();
    let rain = app.world_mut().spawn(Shower::rain_on(place.translation())).id();
    run(&mut app, 1.0);
    // 4 ml a second within a circle of 60 cm: the head gets a hundredth of a full film.
    let (wet, mass) = wetness(&app, &ids);
    println!("a second of rain: {wet}, {mass}");
    assert!(wet > 0.03 && mass > 0.003, "{wet}, {mass}");
    app.world_mut().despawn(rain);
    let lake = Transform::from_translation(place.translation() + Vec3::Y);
    let lake = app.world_mut().spawn((WaterVolume::lake(), lake)).id();
    run(&mut app, 1.0);
    app.world_mut().despawn(lake);
    run(&mut app, 0.5);
    let (wet, mass) = wetness(&app, &ids);
    println!("0.5 s after: {wet}, {mass}");
    assert!(wet > 0.95 && mass > 0.3, "{wet}, {mass}");
}
