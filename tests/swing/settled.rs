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
    let mut lab = Lab::usual();
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
        println!("L_g {bending:.2}, L {length:.2}: {theory:.4}, found {found:.4?}");
        for (sag, n) in found.into_iter().zip(SEGMENTS) {
            let most = if n < 16 { 0.025 } else { 0.01 };
            if sag.is_nan() || (sag - theory).abs() > most {
                wrong.push((bending, length, n, sag, theory));
            }
        }
    }
    assert!(wrong.is_empty(), "L_g, L, segments, sag, elastica: {wrong:#?}");
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
    let mut lab = Lab::usual();
    let segments = [18, 24, 36, 48, 64, 96];
    let curls = segments.map(|n| lab.strand(0.06, &curl(n)));
    lab.settle(10.0);
    let heights = curls.map(|c| f64::from(lab.get(c).positions()[0].y - lab.tip(c).y));
    println!("theory {theory:.4} m, found {heights:.4?}");
    for (height, n) in heights.into_iter().zip(segments) {
        assert!((height / theory - 1.0).abs() < 0.05, "{n} segments: {height} m, theory {theory}");
        assert!((height / heights[5] - 1.0).abs() < 0.05, "{n} segments: {height} m");
    }
}

/// Rate and substeps, and the step that comes of it.
pub const STEPS: [(f64, u32); 9] = [
    (30.0, 2),
    (30.0, 6),
    (30.0, 12),
    (60.0, 2),
    (60.0, 6),
    (60.0, 12),
    (120.0, 3),
    (240.0, 2),
    (240.0, 12),
];

#[test]
fn hair_comes_to_rest_in_the_same_place_at_any_step() {
    let tips = STEPS.map(|(hertz, substeps)| {
        let mut lab = Lab::new(hertz, substeps);
        let mut strands = vec![];
        for (bending, length, n) in [(0.13, 0.24, 16), (0.06, 0.30, 32), (0.30, 0.20, 8)] {
            strands.push(lab.straight(bending, length, n, Vec3::X));
        }
        strands.push(lab.strand(0.06, &curl(36)));
        lab.settle(6.0);
        strands.iter().map(|s| lab.tip(*s)).collect::<Vec<_>>()
    });
    for (tips_of, step) in tips.iter().zip(STEPS) {
        for (strand, (tip, reference)) in tips_of.iter().zip(&tips[4]).enumerate() {
            let off = tip.distance(*reference);
            assert!(off < 1e-3, "strand {strand} at {step:?} is {off} m off");
        }
    }
}
