//! How fast hair swings, and for how long.

use super::{lab::*, settled::*, theory::*, trace::*};
use bevy::prelude::*;
use bevy_keratin::Strand;

/// Stiff stubs ring faster than any step can follow: what is said of swings holds from this many
/// substeps a period.
const SUBSTEPS_A_PERIOD: f64 = 40.0;

#[test]
fn small_swings_take_as_long_as_a_beams() {
    let mut lab = Lab::usual();
    lab.undamped();
    let mut strands = Vec::new();
    for (bending, length) in table() {
        let (l, b) = (f64::from(length), f64::from(bending));
        for (what, direction, theory) in [
            ("hanging", Vec3::NEG_Y, planar::hanging(l, b).period()),
            ("level", Vec3::X, planar::level(l, b).period()),
        ] {
            if theory >= SUBSTEPS_A_PERIOD * lab.substep {
                let all = SEGMENTS.map(|n| lab.straight(bending, length, n, direction));
                strands.push((what, bending, length, theory, all));
            }
        }
    }
    assert!(strands.len() >= 12, "most of the table can be followed");
    let all: Vec<Entity> = strands.iter().flat_map(|s| s.4).collect();
    let swings = lab.small_swings(&all, 2.2);
    let mut wrong = Vec::new();
    for ((what, bending, length, theory, _), swings) in strands.iter().zip(swings.chunks(4)) {
        let found: Vec<_> = swings.iter().map(|s| period(s, lab.substep)).collect();
        println!("{what}, L_g {bending:.2}, L {length:.2}: {theory:.4} s, found {found:.4?}");
        for (period, n) in found.iter().zip(SEGMENTS) {
            if !period.is_some_and(|p| (p / theory - 1.0).abs() <= 0.05) {
                wrong.push((*what, *bending, *length, n, *period, *theory));
            }
        }
    }
    assert!(wrong.is_empty(), "L_g, L, segments, period, beam: {wrong:#?}");
}

#[test]
fn hair_let_go_level_is_lowest_at_the_same_time_at_any_segment_count() {
    let mut lab = Lab::usual();
    lab.undamped();
    let segments = [8, 16, 32, 64, 128];
    let strands = segments.map(|n| lab.straight(0.13, 0.24, n, Vec3::X));
    let tip = |s: &Strand| f64::from(s.positions().last().unwrap().y);
    let falls = lab.record(2.0, strands.map(|s| (s, Box::new(tip) as Probe)).into());
    let times: Vec<f64> =
        falls.iter().map(|fall| first_low(fall, lab.substep).unwrap_or(f64::NAN)).collect();
    println!("lowest after {times:.4?} s");
    for (time, n) in times.iter().zip(segments) {
        let off = time / times[4] - 1.0;
        assert!(off.abs() <= 0.05, "{n} segments: {time} s, 128: {}", times[4]);
    }
}

#[test]
fn energy_never_grows() {
    let mut lab = Lab::usual();
    lab.undamped();
    let cases: Vec<(f32, f32, usize)> =
        (table()).flat_map(|(bending, length)| SEGMENTS.map(|n| (bending, length, n))).collect();
    let strands: Vec<Entity> =
        cases.iter().map(|(b, l, n)| lab.straight(*b, *l, *n, Vec3::X)).collect();
    let probes = (strands.iter().zip(&cases))
        .map(|(strand, (bending, ..))| {
            let bending = f64::from(*bending);
            (*strand, Box::new(move |s: &Strand| energy(s, bending)) as Probe)
        })
        .collect();
    // Let go level, where bends and heights hold no energy yet.
    let energies = lab.record(3.0, probes);
    lab.settle(6.0);
    let mut wrong = Vec::new();
    for ((strand, (bending, length, n)), energies) in strands.iter().zip(&cases).zip(energies) {
        let rest = energy(lab.get(*strand), f64::from(*bending));
        let swing = -rest;
        let (mut least, mut rise) = (0.0_f64, f64::NEG_INFINITY);
        for energy in energies {
            rise = rise.max(energy - least);
            least = least.min(energy);
        }
        // Rounding of single precision is what stubs of half a millimetre's swing are made of.
        if swing.is_nan() || rise > 5e-3 * swing + 1e-7 {
            wrong.push((bending, length, n, rise / swing));
        }
    }
    assert!(wrong.is_empty(), "L_g, L, segments, largest rise in swings: {wrong:#?}");
}

#[test]
fn a_swing_goes_on_with_the_least_damping() {
    let mut lab = Lab::usual();
    lab.undamped();
    let strands = SEGMENTS.map(|n| lab.straight(0.13, 0.20, n, Vec3::NEG_Y));
    for (swing, n) in lab.small_swings(&strands, 2.0).iter().zip(SEGMENTS) {
        let left = (-decay(swing, lab.substep).unwrap_or(f64::NAN)).exp();
        println!("{n} segments: {left:.3} of the energy left after 1 s");
        assert!(left >= 0.5, "{n} segments: {left} of the energy is left after 1 s");
    }
}

#[test]
fn damping_is_a_property_of_the_hair() {
    let mut rates = Vec::new();
    for substeps in [6, 12, 24] {
        let mut lab = Lab::new(60.0, substeps);
        let strands = SEGMENTS.map(|n| lab.straight(0.13, 0.20, n, Vec3::NEG_Y));
        let swings = lab.small_swings(&strands, 2.0);
        let rate = |swing: &Vec<f64>| decay(swing, lab.substep).unwrap_or(f64::NAN);
        rates.extend(swings.iter().zip(SEGMENTS).map(|(s, n)| (substeps, n, rate(s))));
    }
    println!("substeps, segments, decay of energy (1/s): {rates:.3?}");
    // Six substeps, 16 segments
    let usual = rates[1].2;
    for (substeps, n, rate) in &rates {
        let off = rate / usual - 1.0;
        assert!(off.abs() <= 0.1, "{substeps} substeps, {n} segments: {rate}, usually {usual}");
    }
}

#[test]
fn periods_are_the_same_at_any_step() {
    let mut wrong = Vec::new();
    for (hertz, substeps) in STEPS {
        let mut lab = Lab::new(hertz, substeps);
        lab.undamped();
        let cases = [(0.13, 0.20), (0.06, 0.20), (0.06, 0.30)].map(|(bending, length)| {
            (planar::hanging(length, bending).period(), bending as f32, length as f32)
        });
        let cases: Vec<_> = (cases.into_iter())
            .filter(|(period, ..)| *period >= SUBSTEPS_A_PERIOD * lab.substep)
            .collect();
        let strands: Vec<Entity> =
            cases.iter().map(|(_, b, l)| lab.straight(*b, *l, 16, Vec3::NEG_Y)).collect();
        let swings = lab.small_swings(&strands, 2.2);
        for ((theory, bending, length), swing) in cases.iter().zip(&swings) {
            let found = period(swing, lab.substep).unwrap_or(f64::NAN);
            let off = found / theory - 1.0;
            println!("{hertz} Hz, {substeps}: L_g {bending}, L {length}: {off:+.4}");
            if off.is_nan() || off.abs() > 0.03 {
                wrong.push((hertz, substeps, *bending, *length, found, *theory));
            }
        }
    }
    assert!(wrong.is_empty(), "Hz, substeps, L_g, L, period, theory: {wrong:#?}");
}
