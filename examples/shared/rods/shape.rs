//! Shapes under a load: how far a rod gives way.

use super::*;

/// Own weight, level clamp: Γ, and how far the tip sags and reaches.
const LEVEL: [[f32; 3]; 8] = [
    [0.1, 0.01250, 0.99991],
    [0.3, 0.03746, 0.99920],
    [1.0, 0.12347, 0.99125],
    [3.0, 0.33965, 0.93151],
    [10.0, 0.70020, 0.65635],
    [30.0, 0.87309, 0.34276],
    [100.0, 0.93752, 0.15922],
    [1000.0, 0.98114, 0.04599],
];

/// A load P at the tip, no weight: P L²/(E I), and how far the tip sags and reaches.
const LOADED: [[f32; 3]; 4] = [
    [0.5, 0.16214, 0.98408],
    [1.0, 0.30172, 0.94357],
    [3.0, 0.60325, 0.74558],
    [10.0, 0.81061, 0.44500],
];

/// A: level cantilevers under their own weight, of each Γ or of each n-th.
pub fn cantilevers(every: usize, segments: &[usize]) -> Vec<Row> {
    let mut lab = Lab::new();
    let mut rods = Vec::new();
    let shapes = LEVEL.iter().step_by(every);
    for (shape, segments) in shapes.flat_map(|s| segments.iter().map(move |n| (s, *n))) {
        rods.push((shape, segments, lab.rod(Rod { gamma: shape[0], segments, ..default() })));
    }
    lab.settle(8.0, 20.0);
    let row = |&(&[gamma, sag, reach], segments, rod): &(&[f32; 3], usize, Entity)| {
        let tip = lab.tip(rod);
        let tolerance = allowed(if gamma > 100.0 { 0.02 } else { 0.01 }, segments);
        [("A sag", sag, -tip.y), ("A reach", reach, tip.x)].map(|(test, expected, got)| {
            Row::new(test, expected, got, tolerance).of(gamma, segments)
        })
    };
    rods.iter().flat_map(row).collect()
}

/// B: level cantilevers with a heavy tip.
pub fn tip_loads() -> Vec<Row> {
    /// Weight of the load, in weights of the strand.
    const HEAVY: f32 = 20.0;
    let mut lab = Lab::new();
    let mut rods = Vec::new();
    for (shape, segments) in LOADED.iter().flat_map(|s| SEGMENTS.map(|n| (s, n))) {
        // The strand's own weight sags it like 3/8 of it at the tip.
        let gamma = shape[0] / (HEAVY + 0.375);
        let rod = lab.rod(Rod { gamma, segments, ..default() });
        lab.load_tip(rod, HEAVY, segments);
        rods.push((shape, segments, rod));
    }
    lab.settle(8.0, 20.0);
    let row = |&(&[load, sag, reach], segments, rod): &(&[f32; 3], usize, Entity)| {
        let tip = lab.tip(rod);
        [("B sag", sag, -tip.y), ("B reach", reach, tip.x)].map(|(test, expected, got)| {
            Row::new(test, expected, got, allowed(0.01, segments)).of(load, segments)
        })
    };
    rods.iter().flat_map(row).collect()
}

/// How far the tip of a rod that is clamped at its root sinks under its own small weight, in lengths, by the
/// principle of virtual work: `at` its places and tangents at rest by the share of the length.
fn small_sag(at: impl Fn(f32) -> (Vec3, Vec3), gamma: f32, torsion: f32) -> f32 {
    const STEPS: usize = 4000;
    let points: Vec<_> = (0..=STEPS).map(|i| at(i as f32 / STEPS as f32)).collect();
    let (tip, _) = points[STEPS];
    let (tip, down) = (tip.as_dvec3(), bevy::math::DVec3::NEG_Y);
    // Weight beyond a point, and its first moment.
    let (mut weight, mut first, mut sag) = (0.0, bevy::math::DVec3::ZERO, 0.0);
    let ds = 1.0 / STEPS as f64;
    for pair in points.windows(2).rev() {
        let place = (pair[0].0 + pair[1].0).as_dvec3() * 0.5;
        let tangent = (pair[0].1 + pair[1].1).as_dvec3().normalize();
        let beyond = first + place * (0.5 * ds) - place * (weight + 0.5 * ds);
        (weight, first) = (weight + ds, first + place * ds);
        let [own, unit] = [beyond.cross(down), (tip - place).cross(down)];
        let twist = own.dot(tangent) * unit.dot(tangent);
        sag += ds * (own.dot(unit) - twist + twist / f64::from(torsion));
    }
    gamma * sag as f32
}

/// The same of a rod in the lab: its tip with its weight, and without.
fn sags(mut lab: Lab, rods: &[Entity]) -> Vec<f32> {
    let heights = |lab: &Lab| rods.iter().map(|rod| lab.tip(*rod).y).collect::<Vec<_>>();
    lab.settle(8.0, 20.0);
    let loaded = heights(&lab);
    lab.gravity(0.0);
    lab.settle(8.0, 20.0);
    heights(&lab).iter().zip(loaded).map(|(free, loaded)| free - loaded).collect()
}

/// D: a level half circle, which sags mostly by its twist: dry, and as soft as soaked hair, which keeps 0.67 of its
/// stiffness against bending beyond open bonds, and 0.44 of its ratio.
pub fn arcs(segments: &[usize]) -> Vec<Row> {
    use std::f32::consts::PI;
    let mut lab = Lab::new();
    let mut rods = Vec::new();
    let all = segments.iter().flat_map(|n| [(1.0, *n, 0.0), (0.46, *n, 0.0), (0.46, *n, 0.33)]);
    for (torsion, segments, softening) in all {
        // δ is about .015 R.
        let gamma = if torsion < 1.0 { 0.036 } else { 0.066 };
        let rod = Rod { gamma, torsion, segments, curl: Vec3::Y * PI, ..default() };
        let id = lab.rod(rod);
        lab.soften(id, softening, segments);
        rods.push((rod, softening, id));
    }
    let got = sags(lab, &rods.iter().map(|(.., id)| *id).collect::<Vec<_>>());
    (rods.iter().zip(got))
        .map(|((rod, softening, _), got)| {
            let wet = 1.0 - 1.7 * softening;
            // ½ w R⁴ [4/(E I) + π²/(G J)], over L.
            let by_twist = PI * PI / (rod.torsion * wet);
            let expected = 0.5 * rod.gamma / (1.0 - softening) / PI.powi(4) * (4.0 + by_twist);
            let tolerance = allowed(0.01, rod.segments) * expected;
            let what = if *softening > 0.0 { "soaked, C" } else { "C" };
            Row::new(
                format!("D tip of a level arc, {what} {}", rod.torsion),
                expected,
                got,
                tolerance,
            )
            .of(rod.gamma, rod.segments)
        })
        .collect()
}

/// J: a hanging helix of four turns, pitch angle 20°.
pub fn helices() -> Vec<Row> {
    const TURNS: f32 = 4.0;
    let (sine, cosine) = 20.0_f32.to_radians().sin_cos();
    let angle = TURNS * std::f32::consts::TAU;
    let mut lab = Lab::new();
    let mut rods = Vec::new();
    for torsion in [1.0, 0.46] {
        for segments in [32, 48, 64, 96] {
            // The axis points down; the wire leaves its clamp at 20° to the plane across it.
            let way = Vec3::new(cosine, -sine, 0.0);
            // The Darboux vector of a helix is along its axis.
            let axis = Vec3::NEG_Y * angle;
            let twist = axis.dot(way);
            let curl = axis - way * twist;
            rods.push((Rod { gamma: 0.5, torsion, segments, way, curl, twist, ..default() }, axis));
        }
    }
    let ids: Vec<_> = rods.iter().map(|(rod, _)| lab.rod(*rod)).collect();
    let got = sags(lab, &ids);
    (rods.iter().zip(got))
        .map(|((rod, axis), got)| {
            let along = axis.normalize();
            let helix = |s: f32| {
                let turned = |way: Vec3| Quat::from_scaled_axis(*axis * s) * way;
                let rise = along * along.dot(rod.way);
                let across = rod.way - rise;
                // The integral of the tangent.
                let arm = along.cross(across) / angle;
                (rise * s + arm - turned(arm), rise + turned(across))
            };
            let expected = small_sag(helix, rod.gamma, rod.torsion);
            // A polygon with edges as long as their arcs has its nodes θ²/24 too far out, which the sag has twice.
            let joint = angle / rod.segments as f32;
            let tolerance = (joint * joint / 12.0 * 1.1).max(0.01) * expected;
            // And the solver's edges stretch, by 1e-4 at most at the root of a strand that hangs straight.
            let stretched = 0.5e-4 * sine * sine;
            Row::new(
                format!("J a helix' own weight, C {}", rod.torsion),
                expected,
                got,
                tolerance + stretched,
            )
            .of(rod.gamma, rod.segments)
        })
        .collect()
}
