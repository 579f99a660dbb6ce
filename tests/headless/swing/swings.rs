//! How fast hair swings, and for how long.

use super::{lab::*, settled::*, theory::*, trace::*};
use bevy::prelude::*;
use bevy_keratin::Strand;

/// Stiff stubs ring faster than any step can follow: what is said of swings holds from this many
/// substeps a period.
const SUBSTEPS_A_PERIOD: f64 = 40.0;

#[test]
fn small_swings_take_as_long_as_a_beams() {
    for (substep, mut lab) in Lab::both() {
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
        // Of 24, most at the papers' substep and half at that of games.
        assert!(strands.len() >= 10, "{} of the table can be followed", strands.len());
        let all: Vec<Entity> = strands.iter().flat_map(|s| s.4).collect();
        let swings = lab.small_swings(&all, 2.2);
        let mut wrong = Vec::new();
        for ((what, bending, length, theory, _), swings) in strands.iter().zip(swings.chunks(4)) {
            let found: Vec<_> = swings.iter().map(|s| period(s, lab.substep)).collect();
            println!(
                "{substep}, {what}, L_g {bending:.2}, L {length:.2}: {theory:.4} s, found {found:.4?}"
            );
            for (period, n) in found.iter().zip(SEGMENTS) {
                if !period.is_some_and(|p| (p / theory - 1.0).abs() <= 0.05) {
                    wrong.push((*what, *bending, *length, n, *period, *theory));
                }
            }
        }
        assert!(wrong.is_empty(), "{substep}: L_g, L, segments, period, beam: {wrong:#?}");
    }
}

#[test]
fn hair_let_go_level_is_lowest_at_the_same_time_at_any_segment_count() {
    let segments = [8, 16, 32, 64, 128];
    for (substep, mut lab) in Lab::both() {
        lab.undamped();
        let strands = segments.map(|n| lab.straight(0.13, 0.24, n, Vec3::X));
        let tip = |s: &Strand| f64::from(s.positions().last().unwrap().y);
        let falls = lab.record(2.0, strands.map(|s| (s, Box::new(tip) as Probe)).into());
        let times: Vec<f64> =
            falls.iter().map(|fall| first_low(fall, lab.substep).unwrap_or(f64::NAN)).collect();
        println!("{substep}: lowest after {times:.4?} s");
        for (time, n) in times.iter().zip(segments) {
            let off = time / times[4] - 1.0;
            assert!(off.abs() <= 0.05, "{n} segments: {time} s, 128: {}", times[4]);
        }
    }
}

/// Energy that single precision makes of nothing (m³/s², of a mass per length of 1).
const ROUNDING: f64 = 1e-7;

/// The largest rise of the energy over its least so far, in swings: what a strand has to lose until it
/// hangs settled. `aside`: pulled aside and let go, else let go level.
fn largest_rise(what: &str, mut lab: Lab, aside: bool) {
    lab.undamped();
    let direction = if aside { Vec3::NEG_Y } else { Vec3::X };
    // In long substeps f32 carries no segments below 1 mm of stiff hair, as the docs of `direct` say.
    let is_carried = |length: f32, n: usize| lab.substep < 0.003 || length / n as f32 > 1e-3;
    let cases: Vec<(f32, f32, usize)> = (table())
        .flat_map(|(bending, length)| SEGMENTS.map(|n| (bending, length, n)))
        .filter(|(_, length, n)| is_carried(*length, *n))
        .collect();
    let strands: Vec<Entity> =
        cases.iter().map(|(b, l, n)| lab.straight(*b, *l, *n, direction)).collect();
    if aside {
        lab.gravity(Vec3::new(9.8, -9.8, 0.0));
        lab.settle(3.0);
        lab.gravity(Vec3::NEG_Y * 9.8);
    }
    let probes = (strands.iter().zip(&cases))
        .map(|(strand, (bending, ..))| {
            let bending = f64::from(*bending);
            (*strand, Box::new(move |s: &Strand| energy(s, bending)) as Probe)
        })
        .collect();
    let energies = lab.record(3.0, probes);
    lab.settle(4.0);
    let (mut worst, mut wrong) = ((f64::NEG_INFINITY, (0.0, 0.0, 0), 0.0), Vec::new());
    for ((strand, case), energies) in strands.iter().zip(&cases).zip(energies) {
        let swing = energies[0] - energy(lab.get(*strand), f64::from(case.0));
        let (mut least, mut rise) = (energies[0], f64::NEG_INFINITY);
        for energy in &energies[1..] {
            rise = rise.max(energy - least);
            least = least.min(*energy);
        }
        if rise / swing > worst.0 {
            worst = (rise / swing, *case, rise);
        }
        // Rounding of single precision is what stubs of half a millimetre's swing are made of.
        // 64 segments in 12 substeps reach 6e-3; all others stay below 5e-3.
        if swing.is_nan() || rise > 8e-3 * swing + ROUNDING {
            wrong.push((case, rise / swing));
        }
    }
    let (share, case, rise) = worst;
    println!(
        "{what}, aside {aside}: largest rise {share:.2e} of a swing, {rise:.2e} m³/s², {case:?}"
    );
    assert!(wrong.is_empty(), "{what}: L_g, L, segments, largest rise in swings: {wrong:#?}");
}

#[test]
fn energy_never_grows() {
    for substeps in [2, 3, 6, 12] {
        for aside in [false, true] {
            largest_rise(&format!("{substeps} substeps"), Lab::new(60.0, substeps), aside);
        }
    }
    largest_rise("the default", Lab::in_games(), false);
    largest_rise("the default", Lab::in_games(), true);
}

#[test]
fn a_swing_goes_on_with_the_least_damping() {
    for (substep, mut lab) in Lab::both() {
        lab.undamped();
        let strands = SEGMENTS.map(|n| lab.straight(0.13, 0.20, n, Vec3::NEG_Y));
        for (swing, n) in lab.small_swings(&strands, 2.0).iter().zip(SEGMENTS) {
            let left = (-decay(swing, lab.substep).unwrap_or(f64::NAN)).exp();
            println!("{substep}, {n} segments: {left:.3} of the energy left after 1 s");
            assert!(left >= 0.5, "{n} segments: {left} of the energy is left after 1 s");
        }
    }
}

#[test]
fn damping_is_a_property_of_the_hair() {
    let labs = [6, 12, 24].map(|n| (format!("{n} substeps"), Lab::new(60.0, n)));
    let mut rates = Vec::new();
    for (step, mut lab) in labs.into_iter().chain([("the default".into(), Lab::in_games())]) {
        let strands = SEGMENTS.map(|n| lab.straight(0.13, 0.20, n, Vec3::NEG_Y));
        let swings = lab.small_swings(&strands, 2.0);
        let rate = |swing: &Vec<f64>| decay(swing, lab.substep).unwrap_or(f64::NAN);
        rates.extend(swings.iter().zip(SEGMENTS).map(|(s, n)| (step.clone(), n, rate(s))));
    }
    println!("segments, decay of energy (1/s): {rates:.3?}");
    // Six substeps, 16 segments
    let usual = rates[1].2;
    for (step, n, rate) in &rates {
        let off = rate / usual - 1.0;
        assert!(off.abs() <= 0.1, "{step}, {n} segments: {rate}, usually {usual}");
    }
}

#[test]
fn periods_are_the_same_at_any_step() {
    // L_g, L and segments, hanging and level.
    let cases: Vec<(f64, f64, usize, Vec3, f64)> = [(0.13, 0.20), (0.06, 0.20), (0.06, 0.30)]
        .into_iter()
        .flat_map(|(bending, length)| {
            let hanging = planar::hanging(length, bending).period();
            let level = planar::level(length, bending).period();
            [(Vec3::NEG_Y, hanging), (Vec3::X, level)].into_iter().flat_map(
                move |(direction, theory)| [8, 64].map(|n| (bending, length, n, direction, theory)),
            )
        })
        .collect();
    // What the step can follow, and how much longer than the theory's periods are.
    let periods = |mut lab: Lab| -> Vec<Option<f64>> {
        lab.undamped();
        let followed = cases.iter().map(|(.., theory)| *theory >= SUBSTEPS_A_PERIOD * lab.substep);
        let followed: Vec<bool> = followed.collect();
        let strands: Vec<Entity> = (cases.iter().zip(&followed))
            .filter(|(_, followed)| **followed)
            .map(|((b, l, n, direction, _), _)| lab.straight(*b as f32, *l as f32, *n, *direction))
            .collect();
        let mut swings = lab.small_swings(&strands, 2.2).into_iter();
        (cases.iter().zip(followed))
            .map(|((.., theory), followed)| {
                let swing = followed.then(|| swings.next().unwrap())?;
                Some(period(&swing, lab.substep).unwrap_or(f64::NAN) / theory)
            })
            .collect()
    };
    let reference = periods(Lab::usual());
    let mut worst = 0.0_f64;
    let mut check = |step: &str, found: Vec<Option<f64>>| {
        let mut followed = 0;
        for ((case, found), reference) in cases.iter().zip(found).zip(&reference) {
            let Some(found) = found else { continue };
            followed += 1;
            let off = found / reference.unwrap() - 1.0;
            assert!(off.abs() <= 0.03, "{step}: {case:?} is {off:+.4} off");
            assert!((found - 1.0).abs() <= 0.05, "{step}: {case:?} is {found} of the beam's");
            worst = worst.max(off.abs());
        }
        println!("{step}: {followed} of {} can be followed", cases.len());
        assert!(followed >= 2, "{step} follows nothing");
    };
    check("the default", periods(Lab::in_games()));
    for (hertz, substeps) in steps() {
        check(&format!("{hertz} Hz, {substeps}"), periods(Lab::new(hertz, substeps)));
    }
    println!("off by {worst:.4} at most");
}
