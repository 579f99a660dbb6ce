//! Where hair comes to rest.

use super::{TORSION, lab::*, theory::*};
use bevy::prelude::*;

const BENDING_LENGTHS: [f32; 3] = [0.06, 0.13, 0.30];
const LENGTHS: [f32; 4] = [0.05, 0.10, 0.20, 0.30];
pub const SEGMENTS: [usize; 4] = [8, 16, 32, 64];

/// Every length in every stiffness: bending length and length (m).
pub fn table() -> impl Iterator<Item = (f32, f32)> {
    BENDING_LENGTHS.into_iter().flat_map(|b| LENGTHS.map(|l| (b, l)))
}

#[test]
fn hair_that_stands_off_level_sags_as_the_elastica() {
    for (substep, mut lab) in Lab::both() {
        let mut strands = Vec::new();
        for (bending, length) in table() {
            let theory = planar::level(length.into(), bending.into()).sag();
            let all = SEGMENTS.map(|n| lab.straight(bending, length, n, Vec3::X));
            strands.push((bending, length, theory, all));
        }
        lab.settle(8.0);
        let mut wrong = Vec::new();
        for (bending, length, theory, all) in strands {
            let found = all.map(|strand| lab.sag(strand));
            println!("{substep}, L_g {bending:.2}, L {length:.2}: {theory:.4}, found {found:.4?}");
            for (sag, n) in found.into_iter().zip(SEGMENTS) {
                let most = if n < 16 { 0.025 } else { 0.01 };
                if sag.is_nan() || (sag - theory).abs() > most {
                    wrong.push((bending, length, n, sag, theory));
                }
            }
        }
        assert!(wrong.is_empty(), "{substep}: L_g, L, segments, sag, elastica: {wrong:#?}");
    }
}

/// The curl of a curling iron: radius 1 cm, pitch 2 cm, 24 cm of hair.
fn curl(segments: usize) -> Vec<Vec3> {
    let helix = spatial::Helix { radius: 0.01, pitch: 0.02, length: 0.24 };
    (0..=segments)
        .map(|i| helix.point(helix.length * i as f64 / segments as f64).as_vec3())
        .collect()
}

#[test]
fn a_hanging_curl_is_as_high_as_a_rod_of_that_shape() {
    let helix = spatial::Helix { radius: 0.01, pitch: 0.02, length: 0.24 };
    let theory = helix.hanging_height(0.06, TORSION);
    let segments = [18, 24, 36, 48, 64, 96];
    for (substep, mut lab) in Lab::both() {
        lab.torsion(TORSION);
        let curls = segments.map(|n| lab.strand(0.06, &curl(n)));
        lab.settle(10.0);
        let heights = curls.map(|c| f64::from(lab.get(c).positions()[0].y - lab.tip(c).y));
        println!("{substep}: theory {theory:.4} m, found {heights:.4?}");
        for (height, n) in heights.into_iter().zip(segments) {
            let off = height / theory - 1.0;
            assert!(off.abs() < 0.05, "{n} segments: {height} m, theory {theory}");
            assert!((height / heights[5] - 1.0).abs() < 0.05, "{n} segments: {height} m");
        }
    }
}

/// Rates and substeps, and the step that comes of it: all that games may ask for.
pub fn steps() -> impl Iterator<Item = (f64, u32)> {
    [30.0, 60.0, 120.0, 240.0].into_iter().flat_map(|hertz| [2, 3, 4, 6, 12].map(|n| (hertz, n)))
}

#[test]
fn hair_comes_to_rest_in_the_same_place_at_any_step() {
    let settled = |mut lab: Lab| {
        let mut strands = vec![];
        for (bending, length) in [(0.13, 0.24), (0.06, 0.30), (0.30, 0.20)] {
            strands.extend([8, 64].map(|n| lab.straight(bending, length, n, Vec3::X)));
        }
        strands.extend([18, 64].map(|n| lab.strand(0.06, &curl(n))));
        lab.settle(5.0);
        strands.iter().map(|s| lab.tip(*s)).collect::<Vec<_>>()
    };
    let reference = settled(Lab::usual());
    let mut worst = 0.0_f32;
    let mut check = |what: &str, tips: Vec<Vec3>| {
        for (strand, (tip, reference)) in tips.iter().zip(&reference).enumerate() {
            let off = tip.distance(*reference);
            assert!(off < 1e-3, "strand {strand} at {what} is {off} m off");
            worst = worst.max(off);
        }
    };
    check("the default", settled(Lab::in_games()));
    for (hertz, substeps) in steps() {
        check(&format!("{hertz} Hz, {substeps}"), settled(Lab::new(hertz, substeps)));
    }
    println!("off by {:.3} mm at most", 1e3 * worst);
}
