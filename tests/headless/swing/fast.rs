//! Heads of games: they jump within a tick, dash, spin and stop dead.

use super::lab::*;
use bevy::prelude::*;
use bevy_keratin::prelude::*;
use core::f32::consts::TAU;

const HEAD: f32 = 0.1;

/// The most ticks for which any strand is longer than it should be by more than half a percent after the
/// head has moved.
const RECOVERY: u32 = 6;

/// Where the head is after so many seconds.
type Way = Box<dyn Fn(f32) -> Transform>;

#[test]
fn hair_keeps_its_length_and_stays_out_of_a_head_that_jumps_dashes_and_stops() {
    for direction in [Vec3::X, Vec3::Y, Vec3::NEG_Y] {
        let along = |way: fn(f32) -> f32| -> Way {
            Box::new(move |t| Transform::from_translation(direction * way(t)))
        };
        let ways: [(&str, Way); 7] = [
            ("jump of 0.1 m", along(|_| 0.1)),
            ("jump of 0.3 m", along(|_| 0.3)),
            ("jump of 0.6 m", along(|_| 0.6)),
            ("jump of 1 m", along(|_| 1.0)),
            ("dash of 4 m in 0.15 s", along(|t| 4.0 * (t / 0.15).clamp(0.0, 1.0))),
            ("stop from 6 m/s", along(|t| 6.0 * (t.min(0.5)))),
            ("to and fro by 0.5 m", along(|t| if (t * 30.0) as u32 % 2 == 1 { 0.5 } else { 0.0 })),
        ];
        for (name, way) in &ways {
            check(&format!("{name} along {direction}"), way, Vec3::ZERO);
        }
    }
}

#[test]
fn hair_keeps_its_length_and_stays_out_of_a_head_that_spins_about_its_neck() {
    // The skull is in front of the axis, so its surface comes at the hair as it turns.
    let skull = Vec3::new(0.03, 0.08, 0.02);
    let spin = |axis: Vec3| -> Way {
        Box::new(move |t| {
            // Two revolutions a second for a half, back again, and stopped dead.
            let turns = 2.0 * if t < 0.5 { t } else { (1.0 - t).max(0.25) };
            Transform::from_rotation(Quat::from_axis_angle(axis, TAU * turns))
        })
    };
    for axis in [Vec3::Y, Vec3::X, Vec3::new(0.6, 0.8, 0.0)] {
        check(&format!("spin about {axis}"), &spin(axis), skull);
    }
}

fn check(name: &str, way: &Way, skull: Vec3) {
    let mut lab = Lab::in_games();
    lab.drag(2.0);
    let hair = lab.hair(0.13);
    let collider = HairCollider::sphere(HEAD).unwrap();
    lab.app.world_mut().spawn((collider, Transform::from_translation(skull), ChildOf(hair)));
    let strands: Vec<Entity> = (0..30)
        .map(|i| {
            let (sin, cos) = (TAU * i as f32 / 30.0).sin_cos();
            let up = -0.2 + 0.4 * (i % 3) as f32;
            let out = Vec3::new(cos, up, sin).normalize();
            let n = [8, 16, 32][i % 3];
            let points: Vec<Vec3> =
                line(0.25, n, out).iter().map(|p| skull + out * (HEAD + 1e-3) + *p).collect();
            lab.strand(0.13, &points)
        })
        .collect();
    lab.run(1.0);
    let (mut peak, mut deepest, mut through) = (0.0_f32, f32::MIN, f32::MIN);
    let mut fastest = 0.0_f32;
    // The tick in which the head moved last, and the last one in which any hair was stretched.
    let (mut moved, mut stretched) = (0, 0);
    for tick in 0..180 {
        let place = way((tick.min(59) + 1) as f32 / 60.0);
        let mut transform = lab.app.world_mut().get_mut::<Transform>(hair).unwrap();
        if *transform != place {
            (*transform, moved) = (place, tick);
        }
        lab.run(1.0 / 60.0);
        let mut strain = 0.0_f32;
        for strand in &strands {
            let strand = lab.get(*strand);
            strain = strain.max(strand.peak_strain());
            for p in &strand.positions()[1..] {
                deepest = deepest.max(HEAD - p.distance(skull));
            }
            for edge in strand.positions().windows(2) {
                through = through.max(cut(edge[0] - skull, edge[1] - skull));
            }
            for v in strand.velocities() {
                fastest = fastest.max(v.length());
            }
        }
        peak = peak.max(strain);
        if strain > 5e-3 {
            stretched = tick;
        }
    }
    let recovered = (stretched + 1_u32).saturating_sub(moved);
    let late = strands.iter().map(|s| lab.get(*s).peak_strain()).fold(0.0, f32::max);
    println!(
        "{name}: peak strain {peak:.4}, {recovered} ticks to recover, late {late:.5}, nodes {:.2} mm in \
         the head, edges {:.2} mm, {fastest:.1} m/s",
        1e3 * deepest,
        1e3 * through
    );
    assert!(peak < 0.05, "{name}: strain {peak}");
    assert!(recovered <= RECOVERY, "{name}: stretched for {recovered} ticks");
    assert!(late < 5e-3, "{name}: strain {late} late");
    assert!(deepest < 1e-5, "{name}: {deepest} m in the head");
    assert!(through < 1e-5, "{name}: an edge is {through} m deep in the head");
}

/// How deep an edge is in the head (m), beyond what the chord of two nodes on its surface is.
fn cut(a: Vec3, b: Vec3) -> f32 {
    let along = b - a;
    let share = (-a.dot(along) / along.length_squared()).clamp(0.0, 1.0);
    let chord = (HEAD * HEAD - 0.25 * along.length_squared()).sqrt();
    chord - (a + along * share).length()
}
