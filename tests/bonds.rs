//! The closed forms of the bonds through a real app, without gravity.
//!
//! A strand first straight is held bent, its bonds are moved as told, then it is released: it rests
//! at Ω* = Σ f b Ω_j / Σ f b, whatever the fixed rate, the iterations or the weights.

mod common;
use bevy::prelude::*;
use bevy_keratin::prelude::*;
use common::*;

/// A straight strand of 24 cm, then held on an arc of `turn` (rad) per joint.
fn bent(hertz: f64, iterations: u32, turn: f32) -> (App, Entity, Vec<Vec3>) {
    let mut app = test_app(hertz);
    no_gravity(&mut app);
    app.insert_resource(HairDefault(Solver { iterations, ..default() }))
        .insert_resource(HairDefault(AirDrag { rate: 6.0 }));
    let (_, entity) = one_strand(&mut app, 0.24, 8, Vec3::Y);
    run(&mut app, 0.1);
    hold_arc(&mut app, entity, turn);
    run(&mut app, 0.5);
    let held = shape(&app, entity);
    (app, entity, held)
}

/// Guides the nodes onto an arc within a second.
fn hold_arc(app: &mut App, entity: Entity, turn: f32) {
    for step in 1..=60 {
        let turn = turn * step as f32 / 60.0;
        let mut arc = strand(app, entity).clone();
        let omega = Vec3::X * (0.5 * turn).sin();
        arc.pose(core::iter::repeat_n(omega, arc.edges()));
        let targets = arc.positions().iter().map(|p| Some(*p)).collect();
        app.world_mut().entity_mut(entity).insert(HeldNodes { targets });
        run(app, 1.0 / 60.0);
    }
}

fn shape(app: &App, entity: Entity) -> Vec<Vec3> {
    let s = strand(app, entity);
    (0..s.edges()).map(|i| s.darboux(i).xyz()).collect()
}

fn kept(app: &App, entity: Entity, held: &[Vec3]) -> f32 {
    let now = shape(app, entity);
    let dot: f32 = now.iter().zip(held).map(|(a, b)| a.dot(*b)).sum();
    dot / held.iter().map(|h| h.length_squared()).sum::<f32>()
}

fn release(app: &mut App, entity: Entity) {
    app.world_mut().entity_mut(entity).remove::<HeldNodes>();
    run(app, 4.0);
}

fn treat(app: &mut App, treat: Treat) {
    app.world_mut().write_message(treat);
    run(app, 0.1);
}

fn set(app: &mut App, e: Entity, kind: BondKind, rate: f32) {
    treat(app, Treat::set(e, kind, rate).unwrap());
}

#[track_caller]
fn near(found: f32, expected: f32) {
    assert!((found - expected).abs() < 0.003, "kept {found}, expected {expected}");
}

#[test]
fn water_set_keeps_the_hydrogen_share_at_any_rate_and_iterations() {
    for (hertz, iterations) in [(60.0, 5), (120.0, 5), (240.0, 5), (60.0, 20)] {
        let (mut app, e, held) = bent(hertz, iterations, 0.4);
        treat(&mut app, Treat::wet(e));
        treat(&mut app, Treat::dry(e));
        release(&mut app, e);
        near(kept(&app, e, &held), 0.33);
    }
}
