//! Hard treatment: shaking, turning heads, and what no hair ever meets.

use super::{lab::*, settled::SEGMENTS};
use bevy::prelude::*;
use bevy_keratin::{HairStep, prelude::*};
use core::f32::consts::TAU;

#[test]
fn hair_that_is_shaken_hard_keeps_its_length() {
    for (substep, mut lab) in Lab::both() {
        let strand = lab.straight(0.13, 0.30, 64, Vec3::NEG_Y);
        let hair = lab.hair(0.13);
        lab.drag(2.0);
        lab.run(1.0);
        let mut peak = 0.0_f64;
        for frame in 1..=300 {
            let x = 0.1 * (TAU * 3.0 * frame as f32 / 60.0).sin();
            lab.app.world_mut().get_mut::<Transform>(hair).unwrap().translation.x = x;
            let strain: Probe = Box::new(|s| s.peak_strain().into());
            let strains = lab.record(1.0 / 60.0, vec![(strand, strain)]);
            peak = strains[0].iter().copied().fold(peak, f64::max);
        }
        println!("{substep}: peak strain {:.3} %", 100.0 * peak);
        assert!(peak <= 0.015, "{substep}: peak strain {peak}");
    }
}

/// A head that turns about the vertical: its hair in the head's frame, and the same hair in the
/// world's, whose first edge is turned by its targets.
#[derive(Resource)]
struct Turning {
    /// Angle at the tick's beginning and end (rad).
    from: f32,
    to: f32,
    head: Entity,
    turned: Vec<(Entity, Vec<Vec3>)>,
}

fn turn_head(turning: Res<Turning>, mut heads: Query<&mut Transform>) {
    heads.get_mut(turning.head).unwrap().rotation = Quat::from_rotation_y(turning.to);
}

fn turn_held(step: Res<HairStep>, turning: Res<Turning>, mut strands: Query<&mut HeldNodes>) {
    let share = (step.index + 1) as f32 / step.count as f32;
    let turn = Quat::from_rotation_y(turning.from + (turning.to - turning.from) * share);
    for (strand, first) in &turning.turned {
        let targets = first.iter().map(|p| Some(turn * *p)).collect();
        strands.get_mut(*strand).unwrap().targets = targets;
    }
}

#[test]
fn on_a_turning_head_hair_moves_as_in_the_worlds_frame() {
    // Whipped round, hair amplifies rounding: 2.8 mm were measured, and more than 5 with 64 segments at 1/180 s.
    for ((substep, lab), most) in Lab::both().into_iter().zip([3e-3, 1e-2]) {
        turn_by(substep, lab, most);
    }
}

fn turn_by(substep: &str, mut lab: Lab, most: f32) {
    // A root with a target does not turn about itself, as one on the head does; internal friction feels it.
    lab.undamped();
    let stiffness = HairStiffness { bending_length: 0.13, damping: 0.0, ..default() };
    let head = lab.app.world_mut().spawn((Hair, stiffness)).id();
    let mut pairs = Vec::new();
    let mut turned = Vec::new();
    for n in SEGMENTS {
        for (root, direction) in [
            (Vec3::X * 0.09, Vec3::X),
            (Vec3::X * 0.09, Vec3::NEG_Y),
            (Vec3::new(0.0, 0.02, 0.09), Vec3::new(0.6, 0.0, 0.8)),
        ] {
            let points: Vec<Vec3> =
                line(0.24, n, direction).into_iter().map(|p| root + p).collect();
            let world = lab.strand(0.13, &points);
            let strand = Strand::from_polyline(&points).unwrap();
            // Both are clamped by their first edge, as the one in the world's frame can only be.
            let first = points[..2].to_vec();
            let held =
                HeldNodes { targets: first.iter().copied().map(Some).collect(), ..default() };
            let on_head = lab.app.world_mut().spawn((StrandOf(head), strand, held.clone())).id();
            lab.app.world_mut().entity_mut(world).insert(held);
            turned.push((world, first));
            pairs.push((n, direction, on_head, world));
        }
    }
    lab.app
        .insert_resource(Turning { from: 0.0, to: 0.0, head, turned })
        .add_systems(FixedUpdate, turn_head)
        .add_systems(HairTick, turn_held.in_set(HairSystems::First));
    lab.drag(2.0);
    lab.run(2.0);
    // Two revolutions a second for a second, then stopped.
    let mut worst = 0.0_f32;
    for frame in 1..=180 {
        let mut turning = lab.app.world_mut().resource_mut::<Turning>();
        turning.from = turning.to;
        turning.to = TAU * 2.0 * (frame as f32 / 60.0).min(1.0);
        let turn = Quat::from_rotation_y(turning.to);
        lab.run(1.0 / 60.0);
        for (n, direction, on_head, world) in &pairs {
            let nodes = lab.get(*on_head).positions().iter().zip(lab.get(*world).positions());
            let off = nodes.map(|(a, b)| (turn * *a).distance(*b)).fold(0.0, f32::max);
            worst = worst.max(off);
            assert!(
                off < most,
                "{substep}, frame {frame}, {n} segments along {direction}: {off} m apart"
            );
        }
    }
    println!("{substep}: {:.4} mm apart at most", 1e3 * worst);
    let flown = lab.tip(pairs[0].2).distance(Vec3::new(0.33, 0.0, 0.0));
    assert!(flown > 0.02, "the head did turn its hair");
}

#[test]
fn nothing_explodes() {
    abuse("1/360 s", Lab::usual(), &[0.0, 1e-3, 0.06, 0.13]);
}

#[test]
fn nothing_explodes_in_games() {
    abuse("1/180 s", Lab::in_games(), &[0.0, 0.13, f32::INFINITY]);
}

#[test]
fn nothing_explodes_that_is_endlessly_stiff() {
    abuse("1/360 s", Lab::usual(), &[100.0, f32::INFINITY]);
}

/// Length of the hair that is abused (m).
const ABUSED: f32 = 0.24;

fn abuse(substep: &str, mut lab: Lab, bending_lengths: &[f32]) {
    lab.app.insert_resource(HairDefault(HairInertia {
        teleport_speed: f32::INFINITY,
        teleport_spin: f32::INFINITY,
        ..default()
    }));
    lab.drag(2.0);
    let mut strands = Vec::new();
    for &bending in bending_lengths {
        for n in SEGMENTS {
            strands.push((bending, n, lab.straight(bending, ABUSED, n, Vec3::X)));
        }
    }
    let hairs: Vec<Entity> = bending_lengths.iter().map(|b| lab.hair(*b)).collect();
    let mut farthest = 0.0_f32;
    let mut check = |lab: &Lab, what: &str| {
        for (bending, n, strand) in &strands {
            let strand = lab.get(*strand);
            assert!(strand.is_finite(), "{what}, L_g {bending}, {n} segments");
            let reach = strand.positions().iter().map(|p| p.length()).fold(0.0, f32::max);
            farthest = farthest.max(reach);
            assert!(
                reach < 1.01 * ABUSED,
                "{substep}, {what}, L_g {bending}, {n} segments: {reach} m from the root"
            );
        }
    };
    // Roots at 100 m/s, to and fro.
    for frame in 1..=60 {
        let there = (frame % 20) as f32 - if frame % 40 < 20 { 0.0 } else { 20.0 };
        for &hair in &hairs {
            let x = 100.0 / 60.0 * if frame % 40 < 20 { there } else { -there };
            lab.app.world_mut().get_mut::<Transform>(hair).unwrap().translation.x = x;
        }
        lab.run(1.0 / 60.0);
        check(&lab, "100 m/s");
    }
    // A thousand times the weight, from all sides.
    for direction in [Vec3::NEG_Y, Vec3::X, Vec3::Y, Vec3::NEG_X, Vec3::Z] {
        lab.gravity(direction * 1e4);
        for _ in 0..10 {
            lab.run(1.0 / 60.0);
            check(&lab, "10⁴ m/s²");
        }
    }
    lab.gravity(Vec3::NEG_Y * 9.8);
    lab.settle(4.0);
    check(&lab, "afterwards");
    println!("{substep}, L_g {bending_lengths:?}: {farthest:.4} m from the root at most");
    for (bending, n, strand) in &strands {
        let strain = lab.get(*strand).peak_strain();
        assert!(strain < 0.01, "L_g {bending}, {n} segments: strain {strain} afterwards");
        if *bending >= 100.0 {
            assert!(
                lab.sag(*strand).abs() < 0.01,
                "L_g {bending}, {n} segments: {}",
                lab.sag(*strand)
            );
        }
    }
}
