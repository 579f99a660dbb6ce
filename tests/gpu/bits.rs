//! What never changes a bit, and what is contained.

use crate::lab::{Device, LabStrand, Random, plain};
use bevy::{math::Isometry3d, prelude::*};
use bevy_keratin::{
    gpu::{MAX_OBSTACLES, StrandState, SubstepRecord},
    keratin::bond::model::JointBonds,
    solver::rod::obstacle::{Obstacle, Solid},
};

/// Strands of mixed lengths that fall onto a ball and a floor.
fn strands(count: usize) -> Vec<LabStrand> {
    let mut random = Random(5);
    (0..count).map(|i| LabStrand::random(&mut random, 2 + i * 7 % 31, 0.5)).collect()
}

fn records(count: usize) -> Vec<SubstepRecord> {
    let solids = [
        Solid::HalfSpace { normal: Vec3::Y, point: Vec3::NEG_Y * 0.12 },
        Solid::Capsule { a: Vec3::ZERO, b: Vec3::ZERO, radius: 0.06 },
    ];
    let obstacles = solids.map(|solid| Obstacle { solid, motion: None, friction: 0.4 });
    let turn = Isometry3d::from_rotation(Quat::from_rotation_y(0.01));
    (0..count)
        .map(|i| SubstepRecord {
            obstacles: obstacles.to_vec(),
            frame_motion: (i % 4 < 2).then_some(turn),
            change: [if i % 2 == 0 { -0.01 } else { 0.01 }, 0.0, 0.0, 0.0],
            ..plain()
        })
        .collect()
}

fn bits(strand: &StrandState) -> Vec<u32> {
    let vectors = [&strand.positions, &strand.velocities];
    let mut numbers: Vec<f32> =
        vectors.iter().flat_map(|v| v.iter().flat_map(|v| v.to_array())).collect();
    numbers.extend(strand.orientations.iter().flat_map(|q| q.to_array()));
    numbers.extend(&strand.tensions);
    numbers.extend(strand.spins.iter().flat_map(|omega| omega.to_array()));
    for JointBonds { shapes, rates } in &strand.joints {
        numbers.extend(shapes.iter().flat_map(|s| s.to_array()).chain(*rates));
    }
    numbers.iter().map(|x| x.to_bits()).collect()
}

pub fn hand_over_and_return_without_a_substep_change_no_bit() {
    let device = Device::get();
    let strands = strands(70);
    let on = device.hand_over(&strands);
    for (strand, back) in strands.iter().zip(on.read(&device.device, &device.queue).unwrap()) {
        let expected = StrandState {
            positions: strand.positions.clone(),
            velocities: strand.velocities.clone(),
            orientations: strand.orientations.clone(),
            root_frame: strand.root_frame,
            tensions: strand.tensions.clone(),
            spins: strand.spins.clone(),
            joints: strand.joints.clone(),
            before: strand.positions.clone(),
        };
        assert_eq!(bits(&back), bits(&expected));
        assert_eq!((back.root_frame, back.before), (expected.root_frame, expected.before));
    }
}

pub fn ten_runs_are_equal_to_the_bit_whatever_stands_beside_and_however_they_are_submitted() {
    let device = Device::get();
    let (strands, records) = (strands(70), records(12));
    let all = device.run(&mut device.hand_over(&strands), &records);
    for run in 1..10 {
        let mut on = device.hand_over(&strands);
        // So many substeps a submission.
        for some in records.chunks(run) {
            on.run(&device.device, &device.queue, &device.kernels, some);
        }
        let again = on.read(&device.device, &device.queue).unwrap();
        assert!(all.iter().zip(&again).all(|(a, b)| bits(a) == bits(b)), "run {run}");
    }
    let mut fewer: Vec<LabStrand> = strands.iter().step_by(3).cloned().collect();
    fewer.reverse();
    let few = device.run(&mut device.hand_over(&fewer), &records);
    for (a, b) in all.iter().step_by(3).zip(few.iter().rev()) {
        assert_eq!(bits(a), bits(b));
    }
}

pub fn nan_stays_with_its_strand_and_is_counted_once() {
    let device = Device::get();
    let (sound, records) = (strands(70), records(6));
    let expected = device.run(&mut device.hand_over(&sound), &records);
    let mut broken = sound.clone();
    broken[9].velocities[1] = Vec3::splat(f32::NAN);
    broken[23].velocities[1].x = f32::INFINITY;
    broken[40].positions[1].y = f32::NAN;
    broken[55].orientations[0] = Quat::from_xyzw(f32::NAN, 0.0, 0.0, 1.0);
    broken[61].positions[1].x = f32::MAX;
    let mut on = device.hand_over(&broken);
    let found = device.run(&mut on, &records);
    let report = on.take_report(&device.device, &device.queue).unwrap();
    assert_eq!((report.put_back, report.rebuilt), (2, 3));
    let first = report.first.unwrap();
    assert!([9, 23, 40, 55, 61].contains(&first), "{first}");
    assert_eq!(on.take_report(&device.device, &device.queue), Some(default()));
    for (i, (a, b)) in expected.iter().zip(&found).enumerate() {
        if [9, 23, 40, 55, 61].contains(&i) {
            let numbers = bits(b).into_iter().map(f32::from_bits);
            assert!(numbers.clone().all(f32::is_finite), "strand {i}");
            assert_eq!(b.positions[0], sound[i].positions[0], "strand {i} keeps its root");
        } else {
            assert_eq!(bits(a), bits(b), "strand {i}");
        }
    }
}

pub fn obstacles_out_of_reach_change_no_bit_however_many() {
    let device = Device::get();
    // Above a floor and beside a wall, which they meet within a few substeps.
    let mut random = Random(6);
    let strand = |i: usize| {
        let root = Vec3::new(0.004, 0.004, 0.01 * i as f32);
        let way = Vec3::new(random.between(-0.2, 1.0), random.between(-0.1, 0.3), 1.0).normalize();
        let point = |k: usize| (root + way * (0.012 * k as f32)).max(Vec3::new(0.002, 0.002, 0.0));
        LabStrand::along(&(0..2 + i % 23).map(point).collect::<Vec<_>>())
    };
    let sound: Vec<LabStrand> = (0..70).map(strand).collect();
    let walls = [Vec3::Y, Vec3::X].map(|normal| Obstacle {
        solid: Solid::HalfSpace { normal, point: Vec3::ZERO },
        motion: None,
        friction: 0.4,
    });
    let far = Obstacle {
        solid: Solid::Capsule { a: Vec3::X * 50.0, b: Vec3::X * 51.0, radius: 0.1 },
        motion: None,
        friction: 0.1,
    };
    let after = |obstacles: Vec<Obstacle>| {
        let gravity = Vec3::new(-4.0, -9.8, 0.0);
        let record = SubstepRecord { obstacles, gravity, ..plain() };
        let states = device.run(&mut device.hand_over(&sound), &vec![record; 9]);
        states.iter().map(bits).collect::<Vec<_>>()
    };
    let few = after(walls.to_vec());
    for (count, at) in [(3, [0, 2]), (33, [31, 32]), (128, [0, 64]), (128, [45, 127])] {
        let mut all = vec![far.clone(); count];
        walls.iter().zip(at).for_each(|(wall, at)| all[at] = wall.clone());
        assert!(after(all) == few, "{count}, {at:?}");
    }
    assert_eq!(MAX_OBSTACLES, 128);
    // Each of the walls is met.
    let [floor, wall] = walls;
    assert!(after(vec![floor]) != few && after(vec![wall]) != few);
}

/// The tick makes no such record. Whatever a kernel makes of it: a substep later strands are whole.
pub fn records_of_nan_leave_strands_whole() {
    type Spoil = fn(&mut SubstepRecord);
    const NAN: f32 = f32::NAN;
    let all: [(&str, Spoil); 14] = [
        ("gravity", |r| r.gravity.y = NAN),
        ("an infinite gravity", |r| r.gravity.y = f32::INFINITY),
        ("dt", |r| r.dt = NAN),
        ("wind", |r| r.wind.x = NAN),
        ("retained", |r| r.retained = NAN),
        ("frame_motion", |r| r.frame_motion = Some(Isometry3d::from_translation(Vec3::NAN))),
        ("turn", |r| {
            r.frame_motion = Some(Isometry3d::from_rotation(Quat::from_xyzw(NAN, 0.0, 0.0, 1.0)));
        }),
        ("influence", |r| r.influence[0] = NAN),
        ("change", |r| r.change = [NAN; 4]),
        ("bending length", |r| r.bending_length = NAN),
        ("damping", |r| r.damping = NAN),
        ("skin", |r| r.skin = NAN),
        ("an obstacle's place", |r| {
            r.obstacles[1].solid = Solid::Capsule { a: Vec3::NAN, b: Vec3::NAN, radius: 0.06 };
        }),
        ("friction", |r| r.obstacles[0].friction = NAN),
    ];
    let device = Device::get();
    let sound = strands(70);
    let reach = |state: &StrandState| {
        let far = state.positions.iter().map(|p| p.distance(state.positions[0]));
        far.fold(0.0, f32::max)
    };
    let expected = device.run(&mut device.hand_over(&sound), &records(6));
    for (what, spoil) in all {
        let mut records = records(6);
        spoil(&mut records[3]);
        let mut on = device.hand_over(&sound);
        let found = device.run(&mut on, &records);
        let report = on.take_report(&device.device, &device.queue).unwrap();
        println!("{what}: {} put back, {} rebuilt", report.put_back, report.rebuilt);
        // Each once at most; to where the substep began, unless not even that is known.
        assert!(report.put_back + report.rebuilt <= 70, "{what}: {report:?}");
        let is_kept = report.rebuilt == 0;
        assert!(is_kept || ["frame_motion", "turn"].contains(&what), "{what}: {report:?}");
        for (i, state) in found.iter().enumerate() {
            let mut numbers = bits(state).into_iter().map(f32::from_bits);
            assert!(numbers.all(f32::is_finite), "{what}: strand {i}");
            let rates = state.joints.iter().flat_map(|joint| joint.rates);
            assert!(rates.into_iter().all(|rate| (0.0..=1.0).contains(&rate)), "{what}");
            assert_eq!(state.positions[0], sound[i].positions[0], "{what}: strand {i}");
            // A root in a solid tears its strand, and so it does there.
            let most = reach(&expected[i]).max(sound[i].lengths.iter().sum());
            let reach = reach(state);
            assert!(reach < 1.05 * most + 0.01, "{what}: strand {i} reaches {reach} m of {most}");
        }
    }
}

pub fn a_shaken_strand_of_64_segments_holds_its_length() {
    let device = Device::get();
    let points: Vec<Vec3> = (0..65).map(|i| Vec3::NEG_Y * (0.24 / 64.0 * i as f32)).collect();
    let mut strand = LabStrand::along(&points);
    let dt: f32 = 1.0 / 360.0;
    let place = |i: usize| 0.1 * (core::f32::consts::TAU * 3.0 * dt * i as f32).sin();
    let substep = |i: usize| SubstepRecord {
        dt,
        retained: (-2.0 * dt).exp(),
        // In the frame of the root, which is shaken.
        frame_motion: Some(Isometry3d::from_translation(Vec3::X * (place(i) - place(i + 1)))),
        ..plain()
    };
    let records: Vec<SubstepRecord> = (0..720).map(substep).collect();
    let mut on = device.hand_over(std::slice::from_ref(&strand));
    let (mut peak, mut widest) = (0.0f32, 0.0f32);
    for some in records.chunks(2) {
        let state = device.run(&mut on, some).remove(0);
        strand.take(&state);
        peak = peak.max(strand.peak_strain());
        widest = widest.max(strand.positions[64].x.abs());
    }
    println!("peak strain {peak:.2e}, the tip goes {widest:.3} m aside");
    assert!(peak < 0.015, "strain {peak}");
    assert!(widest > 0.05, "it is shaken: {widest}");
}
