//! One substep against lanes and against f64.

use crate::{
    lab::{Device, LabStrand, Random, in_lanes, plain},
    twin::Twin,
};
use bevy::{
    math::{Affine3A, DQuat, DVec3, Isometry3d},
    prelude::*,
};
use bevy_keratin::{
    gpu::{BlowerRecord, StrandState, SubstepRecord},
    rod::{
        obstacle::{Obstacle, Solid},
        shape::{Placed, Shape},
    },
};
use fearless_simd::Level;

/// Node counts, so that blocks are full, partly filled, and of one strand.
const NODES: [usize; 10] = [2, 3, 4, 7, 12, 16, 33, 48, 64, 128];

/// Strands of each: a full block and a part of one.
const COUNT: usize = 60;

fn random_obstacle(random: &mut Random, kind: u32, moves: bool) -> Obstacle {
    let (a, b) = (random.vector() * 0.3, random.vector() * 0.3);
    let radius = random.between(0.01, 0.06);
    let solid = match kind % 4 {
        0 => {
            let normal = b.normalize_or(Vec3::Y);
            Solid::HalfSpace { normal, point: normal * -random.between(0.02, 0.2) }
        }
        1 => Solid::Capsule { a, b: if kind > 4 { a } else { b }, radius },
        2 => Solid::Placed(Placed {
            shape: Shape::Ellipsoid { radii: Vec3::new(1.0, 1.3, 0.8) },
            center: a,
            axes: Mat3::from_quat(Quat::from_scaled_axis(b * 5.0)),
            scale: radius,
        }),
        _ => Solid::Cylinder {
            center: a,
            axis: b.normalize_or(Vec3::Y),
            radius,
            half_height: random.between(0.02, 0.1),
        },
    };
    let motion = moves.then(|| {
        Affine3A::from_translation(random.vector() * 0.01)
            * Affine3A::from_quat(Quat::from_scaled_axis(random.vector() * 0.1))
    });
    Obstacle { solid, motion, friction: random.between(0.0, 0.8) }
}

/// How far places are off those of f64, at most (m).
fn off(places: &[Vec3], twin: &Twin) -> f64 {
    let off = |(p, t): (&Vec3, &DVec3)| p.as_dvec3().distance(*t);
    places.iter().zip(&twin.p).map(off).fold(0.0, f64::max)
}

/// How far frames are turned off those of f64, at most (rad).
fn turned(frames: &[Quat], twin: &Twin) -> f64 {
    let turned = |(q, t): (&Quat, &DQuat)| 2.0 * (q.as_dquat() * t.conjugate()).xyz().length();
    frames.iter().zip(&twin.q).map(turned).fold(0.0, f64::max)
}

/// Of strands' errors that of the middle one, of nine in ten, and how many are beyond `far`.
fn spread(mut errors: Vec<f64>, far: f64) -> ([f64; 2], usize) {
    errors.sort_by(f64::total_cmp);
    let beyond = errors.iter().filter(|error| **error > far).count();
    ([errors[errors.len() / 2], errors[errors.len() * 9 / 10]], beyond)
}

/// Random strands of all node counts through one substep in all ways: in lanes of f32 on this machine's
/// instruction set and on one without fused multiply–add, on the device, in f64.
///
/// Where a decision hangs on the last bit, as whether a node touches, a strand may go either way on each: of
/// those there may be a few, in lanes as on the device. All others hold the bound strand by strand's rank.
fn compare(
    scene: &str,
    seed: u32,
    speed: f32,
    record: impl Fn(&mut Random) -> SubstepRecord + Send,
) {
    let Some(device) = Device::get() else { return };
    // Without optimisation a substep in lanes takes more stack than a test's thread has.
    std::thread::scope(|scope| {
        let thread = std::thread::Builder::new().stack_size(1 << 26);
        let compared = || compare_on(device, scene, seed, speed, record);
        thread.spawn_scoped(scope, compared).unwrap().join().unwrap();
    });
}

fn compare_on(
    device: &Device,
    scene: &str,
    seed: u32,
    speed: f32,
    record: impl Fn(&mut Random) -> SubstepRecord,
) {
    let mut random = Random(seed);
    for nodes in NODES {
        let record = record(&mut random);
        // Along so many nodes what hangs on the last bit of a contact adds up: lanes themselves are off by
        // millimetres.
        if nodes > 64 && !record.obstacles.is_empty() {
            continue;
        }
        let strands: Vec<LabStrand> =
            (0..COUNT).map(|_| LabStrand::random(&mut random, nodes, speed)).collect();
        let twins: Vec<Twin> = strands
            .iter()
            .map(|strand| {
                let mut twin = Twin::of(strand);
                twin.substep(&record);
                twin
            })
            .collect();
        let moved = strands.iter().zip(&twins).map(|(s, t)| off(&s.positions, t));
        let moved = moved.fold(0.0, f64::max);
        let [fused, unfused] = [Level::new(), Level::baseline()].map(|level| {
            let mut lanes = strands.clone();
            lanes.chunks_mut(16).for_each(|block| in_lanes(level, block, &record));
            lanes
        });
        let mut on = device.hand_over(&strands);
        let gpu: Vec<StrandState> = device.run(&mut on, std::slice::from_ref(&record));
        let errors = |of: &dyn Fn(usize) -> (f64, f64), far: [f64; 2]| {
            let (places, frames) = (0..COUNT).map(of).unzip();
            [spread(places, far[0]), spread(frames, far[1])]
        };
        let far = [1e-4, 1e-2];
        let lanes = [&fused, &unfused].map(|lanes| {
            let of = |i: usize| {
                let (s, twin) = (&lanes[i], &twins[i]);
                (off(&s.positions, twin), turned(&s.orientations, twin))
            };
            errors(&of, far)
        });
        let of = |i: usize| {
            let (s, twin) = (&gpu[i], &twins[i]);
            (off(&s.positions, twin), turned(&s.orientations, twin))
        };
        let found = errors(&of, far);
        println!("{scene:10} {nodes:2} moved {moved:.0e}: {lanes:.9?}, gpu {found:.9?}");
        for (what, floor) in [(0, 1e-7), (1, 1e-5)] {
            let (ranks, beyond) = found[what];
            for (rank, error) in ranks.iter().enumerate() {
                let most = lanes.iter().map(|lanes| lanes[what].0[rank]).fold(0.0, f64::max);
                assert!(
                    *error <= 2.0 * most + floor,
                    "{scene}, {nodes} nodes: {error:e} off f64, lanes {most:e}"
                );
            }
            let most = lanes.iter().map(|lanes| lanes[what].1).max().unwrap_or(0);
            assert!(beyond <= 2 * most + 2, "{scene}, {nodes} nodes: {beyond} far, lanes {most}");
        }
        for (state, twin) in gpu.iter().zip(&twins) {
            for (a, b) in state.joints.iter().zip(&twin.bonds) {
                for (rate, (_, expected)) in a.rates.iter().zip(b) {
                    let rate = (f64::from(*rate) - expected).abs();
                    assert!(rate < 1e-5, "{scene}, {nodes} nodes: rate off by {rate}");
                }
            }
        }
    }
}

#[test]
fn free_strands() {
    compare("free", 1, 0.2, |_| plain());
    compare("whips", 2, 6.0, |_| plain());
}

#[test]
fn strands_in_a_frame_that_moves() {
    compare("carried", 3, 0.2, |random| SubstepRecord {
        carry: Some(Isometry3d::new(
            random.vector() * 0.01,
            Quat::from_scaled_axis(random.vector() * 0.1),
        )),
        ..plain()
    });
}

#[test]
fn strands_among_obstacles() {
    for (scene, kind) in [("half-space", 0), ("capsule", 1), ("cylinder", 2), ("ball", 7)] {
        for moves in [false, true] {
            compare(scene, 4 + kind, 0.5, |random| SubstepRecord {
                obstacles: vec![random_obstacle(random, kind, moves)],
                ..plain()
            });
        }
    }
}

#[test]
fn strands_in_wind_that_dries() {
    compare("wind", 11, 0.2, |random| SubstepRecord {
        wind: random.vector() * 3.0,
        change: [0.0, -0.01, 0.02, 0.0],
        blowers: (0..2)
            .map(|_| BlowerRecord {
                nozzle: random.vector() * 0.4,
                aim: random.vector().normalize_or(Vec3::X),
                strength: 8.0,
                drying: 0.3,
            })
            .collect(),
        ..plain()
    });
}
