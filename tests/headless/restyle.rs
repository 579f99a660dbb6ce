//! A style on hair of another length, on a head with shoulders.
#![cfg(feature = "save")]

use crate::common::{run, strand, test_app};
use bevy::prelude::*;
use bevy_keratin::prelude::*;

const HEAD: f32 = 0.09;

/// Strands of a length all over the upper half of a head, with shoulders below it.
fn head(app: &mut App, place: Vec3, length: f32, nodes: usize) -> (Entity, Vec<Entity>) {
    let ball = HairCollider::sphere(HEAD).unwrap();
    let head = app.world_mut().spawn((ball, Transform::from_translation(place))).id();
    let hair = app.world_mut().spawn((Hair, ChildOf(head))).id();
    for side in [-0.1, 0.1] {
        let shoulder = HairCollider::sphere(0.11).unwrap();
        let place = Transform::from_xyz(side, -0.25, 0.0);
        app.world_mut().spawn((shoulder, place, ChildOf(head)));
    }
    let grow = |i: usize| {
        let y = (i as f32 + 0.5) / 60.0;
        let across = (1.0 - y * y).sqrt();
        let (sine, cosine) = (2.4 * i as f32).sin_cos();
        let normal = Vec3::new(across * cosine, y, across * sine);
        let (side, other) = normal.any_orthonormal_pair();
        let node = |k: usize| {
            let along = length * k as f32 / (nodes - 1) as f32;
            let (sine, cosine) = (along / 0.012).sin_cos();
            normal * (HEAD + 0.002 + 0.8 * along) + 0.006 * ((cosine - 1.0) * side + sine * other)
        };
        Strand::from_polyline(&(0..nodes).map(node).collect::<Vec<_>>()).unwrap()
    };
    let strands = (0..60).map(|i| app.world_mut().spawn((StrandOf(hair), grow(i))).id()).collect();
    (hair, strands)
}

#[test]
fn a_style_put_on_longer_hair_neither_stretches_it_nor_leaves_it_in_the_head() {
    for (times, nodes) in [(1.25, 20), (2.0, 31), (0.6, 11)] {
        let mut app = test_app(60.0);
        let (short, _) = head(&mut app, Vec3::ZERO, 0.25, 16);
        let (long, strands) = head(&mut app, Vec3::X * 3.0, 0.25 * times, nodes);
        run(&mut app, 4.0);
        let style = Hairdo::of(app.world(), short).unwrap();
        style.apply_resampled(app.world_mut(), long).unwrap();
        run(&mut app, 8.0);
        let (mut strain, mut depth) = (0.0_f32, 0.0_f32);
        for id in &strands {
            let own = strand(&app, *id);
            strain = strain.max(own.peak_strain());
            let deepest = own.positions().iter().map(|p| HEAD - p.length()).fold(0.0, f32::max);
            depth = depth.max(deepest);
        }
        println!("{times} times as long: strain {strain}, {depth} m deep");
        assert!(strain < 0.05, "{times} times as long: strain {strain}");
        assert!(depth < 0.003, "{times} times as long: {depth} m deep");
    }
}

#[cfg(feature = "groom")]
#[test]
fn a_style_grown_out_on_a_character_lies_on_its_body() {
    use crate::{
        wear::{app, strands, worn},
        worlds_measured::wearer::character,
    };
    use bevy_keratin::authoring::plant::HairPreset;
    for (preset, times) in [(HairPreset::Wavy, 1.25), (HairPreset::Long, 2.0)] {
        let mut app = app();
        let root = app.world_mut().spawn((Transform::default(), WearHair::new(preset))).id();
        character(&mut app, root, 1.0);
        let hair = worn(&mut app);
        run(&mut app, 0.5);
        let style = Hairdo::of(app.world(), hair).unwrap();
        app.world_mut().entity_mut(root).insert(WearHair::new(preset).long(times));
        let hair = worn(&mut app);
        style.apply_resampled(app.world_mut(), hair).unwrap();
        let mut strain = [0.0_f32; 6];
        for strain in &mut strain {
            run(&mut app, 1.0);
            let all = strands(&mut app, hair);
            *strain = all.iter().map(Strand::peak_strain).fold(0.0, f32::max);
        }
        println!("{preset:?} {times} times as long: strain {strain:?}");
        assert!(strain[5] < 0.05, "{preset:?}: {strain:?}");
    }
}
