//! One substep against lanes and against f64.

use crate::{
    lab::{Device, LabStrand, Random, in_lanes, plain, swept},
    twin::Twin,
};
use bevy::{
    math::{Affine3A, DQuat, DVec3, Isometry3d},
    prelude::*,
};
use bevy_keratin::{
    StretchProjection::{Coupled, Printed, Split},
    gpu::{BlowerRecord, StrandState, SubstepRecord},
    keratin::bond::model::JointBonds,
    solver::rod::{
        obstacle::{Obstacle, Solid},
        shape::{Placed, Shape},
    },
};
use fearless_simd::Level;

/// Node counts, so that blocks are full, partly filled, and of one strand.
const NODES: [usize; 10] = [2, 3, 4, 7, 12, 16, 33, 48, 64, 96];

/// Strands of each: a full block and a part of one.
const COUNT: usize = 60;

/// Mesa's software device ends all loops of a thread after so many passes together, and runs eight threads as
/// one, with all loops inside of conditions whether they hold or not. Long strands that begin deep in a solid
/// need more to get out of it.
const MOST_PASSES: usize = 65_535;
const THREADS: usize = 8;

/// Passes of a thread's loops in a substep at most, about: each round moves nodes out and restores lengths, and the
/// rest of the substep looks at an obstacle so many times.
fn passes(nodes: usize, obstacles: usize, rounds: usize) -> usize {
    (rounds * (2 * obstacles + 4) + 250 * (obstacles + 1)) * nodes
}

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

/// How far remembered shapes are off those of f64, at most.
fn misremembered(joints: &[JointBonds], twin: &Twin) -> f64 {
    let kinds = |(joint, twin): (&JointBonds, &[(DVec3, f64); 4])| {
        let off = |(shape, twin): (&Vec3, &(DVec3, f64))| shape.as_dvec3().distance(twin.0);
        joint.shapes.iter().zip(twin).map(off).fold(0.0, f64::max)
    };
    joints.iter().zip(&twin.bonds).map(kinds).fold(0.0, f64::max)
}

/// Places, frames and remembered shapes: from which error on a strand counts as far off, and which is always
/// allowed.
const BOUNDS: [(f64, f64); 3] = [(1e-4, 1e-7), (1e-2, 1e-5), (1e-2, 1e-5)];

/// How far strands are off those of f64: in lanes with fused multiply–add and without, and on the device.
type Errors = [Vec<[f64; 3]>; 3];

/// The error that this share of strands do not exceed.
fn rank(errors: &[[f64; 3]], what: usize, share: f64) -> f64 {
    let mut errors: Vec<f64> = errors.iter().map(|errors| errors[what]).collect();
    errors.sort_by(f64::total_cmp);
    errors[((errors.len() as f64 * share) as usize).min(errors.len() - 1)]
}

/// Of strands of one node count: the middle one's errors, and how many are far off. Returns the errors in those of
/// the middle one in lanes.
fn check_one(scene: &str, nodes: usize, errors: &Errors) -> Errors {
    let mut scale = [0.0; 3];
    for (what, (far, floor)) in BOUNDS.into_iter().enumerate() {
        let [fused, unfused, gpu] = errors.each_ref().map(|errors| rank(errors, what, 0.5));
        let beyond = errors.each_ref().map(|all| all.iter().filter(|e| e[what] > far).count());
        let most = fused.max(unfused);
        scale[what] = most + floor;
        println!("{scene:10} {nodes:3}: {fused:.1e}, {unfused:.1e}, {gpu:.1e}; {beyond:?} far");
        assert!(
            gpu <= 2.0 * most + floor,
            "{scene}, {nodes} nodes: {gpu:e} off f64, lanes {most:e}"
        );
        let most = beyond[0].max(beyond[1]);
        // Whether a node sticks or slides, too, hangs on the last bit.
        assert!(beyond[2] <= 2 * most + 4, "{scene}, {nodes} nodes: {beyond:?} are far off");
    }
    errors.each_ref().map(|all| {
        let scaled = |errors: &[f64; 3]| core::array::from_fn(|what| errors[what] / scale[what]);
        all.iter().map(scaled).collect()
    })
}

/// Of strands of all node counts: those that are farther off than most.
fn check_all(scene: &str, errors: &Errors) {
    for (what, share) in (0..3).flat_map(|what| [(what, 0.9), (what, 0.95)]) {
        let [fused, unfused, gpu] = errors.each_ref().map(|errors| rank(errors, what, share));
        println!("{scene:10} {share}: {fused:.2}, {unfused:.2}, {gpu:.2}");
        assert!(
            gpu <= 2.0 * fused.max(unfused),
            "{scene}: {gpu} times as far off f64 as the middle strand, lanes {fused} and {unfused}"
        );
    }
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
    let device = Device::get();
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
    let mut all = Errors::default();
    for nodes in NODES {
        let record = record(&mut random);
        let strands: Vec<LabStrand> = (0..COUNT)
            .map(|_| {
                let strand = LabStrand::random(&mut random, nodes, speed);
                match record.sweeps {
                    Some(_) => strand.spinning(&mut random, 4.0),
                    None => strand,
                }
            })
            .collect();
        let twins: Vec<Twin> = strands
            .iter()
            .map(|strand| {
                let mut twin = Twin::of(strand);
                twin.substep(&record);
                twin
            })
            .collect();
        let rounds = |some: &[Twin]| some.iter().map(|twin| twin.rounds).max().unwrap_or(0);
        let ends =
            |some: &[Twin]| passes(nodes, record.obstacles.len(), rounds(some)) < MOST_PASSES;
        let ends: Vec<bool> = twins.chunks(THREADS).map(ends).collect();
        let compared: Vec<usize> =
            (0..COUNT).filter(|i| !device.is_software || ends[i / THREADS]).collect();
        assert!(compared.len() >= THREADS, "{scene}, {nodes} nodes: {} compared", compared.len());
        let moved = strands.iter().zip(&twins).map(|(s, t)| off(&s.positions, t));
        let moved = moved.fold(0.0, f64::max);
        let [fused, unfused] = [Level::new(), Level::baseline()].map(|level| {
            let mut lanes = strands.clone();
            lanes.chunks_mut(16).for_each(|block| in_lanes(level, block, &record));
            lanes
        });
        let mut on = device.hand_over(&strands);
        let gpu: Vec<StrandState> = device.run(&mut on, std::slice::from_ref(&record));
        let of_lanes = |lanes: &[LabStrand]| -> Vec<[f64; 3]> {
            let of = |i: &usize| {
                let (s, twin) = (&lanes[*i], &twins[*i]);
                let places = off(&s.positions, twin);
                [places, turned(&s.orientations, twin), misremembered(&s.joints, twin)]
            };
            compared.iter().map(of).collect()
        };
        let on_device = compared.iter().map(|i| {
            let (s, twin) = (&gpu[*i], &twins[*i]);
            let places = off(&s.positions, twin);
            [places, turned(&s.orientations, twin), misremembered(&s.joints, twin)]
        });
        println!(
            "{scene:10} {nodes:3}: moved {moved:.0e} m, {} of {COUNT} compared",
            compared.len()
        );
        let errors = [of_lanes(&fused), of_lanes(&unfused), on_device.collect()];
        let scaled = check_one(scene, nodes, &errors);
        all.iter_mut().zip(scaled).for_each(|(all, scaled)| all.extend(scaled));
        for (state, twin) in compared.iter().map(|i| (&gpu[*i], &twins[*i])) {
            for (a, b) in state.joints.iter().zip(&twin.bonds) {
                for (rate, (_, expected)) in a.rates.iter().zip(b) {
                    let rate = (f64::from(*rate) - expected).abs();
                    assert!(rate < 1e-5, "{scene}, {nodes} nodes: rate off by {rate}");
                }
            }
        }
    }
    check_all(scene, &all);
}

pub fn free_strands() {
    compare("free", 1, 0.2, |_| plain());
    compare("whips", 2, 6.0, |_| plain());
}

pub fn strands_in_a_frame_that_moves() {
    compare("carried", 3, 0.2, |random| SubstepRecord {
        frame_motion: Some(Isometry3d::new(
            random.vector() * 0.01,
            Quat::from_scaled_axis(random.vector() * 0.1),
        )),
        ..plain()
    });
}

pub fn strands_among_obstacles() {
    for (scene, kind) in [("half-space", 0), ("capsule", 1), ("cylinder", 2), ("ball", 7)] {
        for moves in [false, true] {
            compare(scene, 4 + kind, 0.5, |random| SubstepRecord {
                obstacles: vec![random_obstacle(random, kind, moves)],
                ..plain()
            });
        }
    }
}

/// Half of the roots and more lie in the ground, by up to as much as strands are long: what cannot get out is left
/// there.
pub fn strands_whose_roots_lie_in_an_obstacle() {
    for moves in [false, true] {
        compare("root inside", 41, 0.3, |random| {
            let ground = random_obstacle(random, 0, moves);
            let normal = random.vector().normalize_or(Vec3::Y);
            let point = normal * random.between(0.0, 0.08);
            let solid = Solid::HalfSpace { normal, point };
            SubstepRecord { obstacles: vec![Obstacle { solid, ..ground }], ..plain() }
        });
    }
}

pub fn strands_in_wind_that_dries() {
    compare("wind", 11, 0.2, |random| SubstepRecord {
        wind: random.vector() * 3.0,
        headwind: random.vector(),
        change: [0.0, -0.01, 0.02, 0.0],
        blowers: (0..2)
            .map(|_| BlowerRecord {
                nozzle: random.vector() * 0.4,
                aim: random.vector().normalize_or(Vec3::X),
                strength: 8.0,
                drying: 0.3,
                velocity: random.vector() * 5.0,
                spin: random.vector(),
                center: random.vector() * 0.4,
                core: 0.045,
            })
            .collect(),
        ..plain()
    });
}

pub fn strands_by_the_papers_projections() {
    for projection in [Split, Coupled, Printed] {
        compare(&format!("{projection:?}"), 21, 0.2, |_| swept(projection));
    }
    compare("swept", 24, 0.2, |random| SubstepRecord {
        frame_motion: Some(Isometry3d::new(
            random.vector() * 0.01,
            Quat::from_scaled_axis(random.vector() * 0.1),
        )),
        change: [0.01, -0.01, 0.0, 0.0],
        ..swept(Split)
    });
}

pub fn strands_among_obstacles_by_the_papers_projections() {
    for (scene, kind) in [("half-space", 0), ("capsule", 1), ("cylinder", 2), ("ball", 7)] {
        for moves in [false, true] {
            compare(scene, 31 + kind, 0.5, |random| SubstepRecord {
                obstacles: vec![random_obstacle(random, kind, moves)],
                ..swept(Split)
            });
        }
    }
}
