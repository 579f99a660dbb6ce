//! The closed forms of the bonds: a strand first straight, bent, its bonds moved as given, then let go
//! without gravity, rests at Ω* = Σ f b Ω_j / Σ f b.

use crate::lab::{Device, LabStrand, plain};
use bevy::prelude::*;
use bevy_keratin::{gpu::SubstepRecord, keratin::bond::model::JointBonds};

const EDGES: usize = 8;

/// What is asked of hydrogen, ionic, disulfide and peptide bonds.
type Change = [f32; 4];

const WET: Change = [-1.0, 0.0, 0.0, 0.0];
const DRY: Change = [1.0, 0.0, 0.0, 0.0];
const SHAMPOO: Change = [-1.0, -1.0, 0.0, 0.0];
const NEUTRALISE: Change = [0.0, 1.0, 0.0, 0.0];
const LOTION: Change = [-1.0, -1.0, -0.2, 0.0];
const FIX: Change = [0.0, 1.0, 0.2, 0.0];

/// A strand of 24 cm that turns by so much (rad) at each joint, with these bonds.
fn arc(turn: f32, joints: Option<&[JointBonds]>) -> LabStrand {
    let frame = |i: usize| Quat::from_rotation_x(turn * i as f32);
    let mut points = vec![Vec3::ZERO];
    for i in 0..EDGES {
        // The first joint turns against the scalp.
        points.push(points[i] + frame(i + 1) * Vec3::Z * 0.03);
    }
    let mut strand = LabStrand::along(&points);
    strand.root_frame = Quat::IDENTITY;
    for (i, q) in strand.orientations.iter_mut().enumerate() {
        *q = frame(i + 1);
    }
    match joints {
        Some(joints) => strand.joints = joints.to_vec(),
        None => strand.joints.fill(JointBonds::closed(Vec3::ZERO)),
    }
    strand
}

/// Moves bonds while the strand does not: in no time.
fn held(device: &Device, strand: &mut LabStrand, changes: &[Change]) {
    let substep = |change: &Change| SubstepRecord {
        dt: 1e-6,
        gravity: Vec3::ZERO,
        change: *change,
        ..plain()
    };
    let records: Vec<SubstepRecord> = changes.iter().map(substep).collect();
    let mut on = device.hand_over(std::slice::from_ref(strand));
    let state = device.run(&mut on, &records).remove(0);
    strand.joints = state.joints;
}

/// Lets it go for four seconds, and moves bonds meanwhile.
fn free(device: &Device, strand: &mut LabStrand, changes: &[Change]) {
    let dt: f32 = 1.0 / 180.0;
    let mut records =
        vec![
            SubstepRecord { gravity: Vec3::ZERO, retained: (-6.0 * dt).exp(), dt, ..plain() };
            720
        ];
    for (record, change) in records.iter_mut().zip(changes) {
        record.change = *change;
    }
    let mut on = device.hand_over(std::slice::from_ref(strand));
    let state = device.run(&mut on, &records).remove(0);
    strand.take(&state);
    assert_eq!(on.take_report(&device.device, &device.queue), Some(default()));
}

fn kept(strand: &LabStrand, turn: f32) -> f32 {
    let held = Vec3::X * (0.5 * turn).sin();
    let shares = (0..EDGES).map(|i| strand.omega(i).xyz().dot(held) / held.length_squared());
    shares.sum::<f32>() / EDGES as f32
}

#[track_caller]
fn near(found: f32, expected: f32) {
    println!("kept {found:.5}, expected {expected:.5}");
    assert!((found - expected).abs() < 0.002, "kept {found}, expected {expected}");
}

pub fn sets_keep_the_share_of_the_bonds_that_formed() {
    let device = Device::get();
    let half: Change = [0.5, 0.0, 0.0, 0.0];
    let sets: [(&[Change], f32); 5] = [
        (&[WET, DRY], 0.33),
        (&[WET, half], 0.19760),
        (&[], 0.0),
        (&[WET], 0.0),
        (&[SHAMPOO, NEUTRALISE, DRY], 0.63),
    ];
    for (changes, expected) in sets {
        let mut strand = arc(0.5, None);
        held(device, &mut strand, changes);
        free(device, &mut strand, &[]);
        near(kept(&strand, 0.5), expected);
    }
}

pub fn a_perm_keeps_two_thirds_and_survives_washing_in_part() {
    let device = Device::get();
    let mut strand = arc(0.6, None);
    held(device, &mut strand, &[LOTION, FIX, DRY]);
    free(device, &mut strand, &[]);
    near(kept(&strand, 0.6), 0.67);
    let permed = strand.joints.clone();
    free(device, &mut strand, &[SHAMPOO]);
    near(kept(&strand, 0.6), 0.10811);
    // Dried free, it stays where it is.
    free(device, &mut strand, &[NEUTRALISE, DRY]);
    near(kept(&strand, 0.6), 0.10811);
    // Washed and dried while held straight.
    let mut straight = arc(0.0, Some(&permed));
    held(device, &mut straight, &[SHAMPOO, NEUTRALISE, DRY]);
    free(device, &mut straight, &[]);
    near(kept(&straight, 0.6), 0.04);
}

pub fn a_treatment_takes_rates_the_asked_share_of_the_way_and_never_cuts_the_backbone() {
    let device = Device::get();
    let strand = arc(0.3, None);
    // A tenth of the way to 0.4 in each substep.
    let record = SubstepRecord {
        gravity: Vec3::ZERO,
        change: [0.04, 0.0, 0.0, 0.04],
        share: [0.1, 0.0, 0.0, 0.1],
        ..plain()
    };
    let mut on = device.hand_over(std::slice::from_ref(&strand));
    let state = device.run(&mut on, &vec![record; 10]).remove(0);
    let expected = 0.4 + 0.6 * 0.9f32.powi(10);
    for joint in &state.joints {
        assert!((joint.rates[0] - expected).abs() < 1e-5, "{} not {expected}", joint.rates[0]);
        assert_eq!(joint.rates[1..], [1.0; 3]);
    }
}
