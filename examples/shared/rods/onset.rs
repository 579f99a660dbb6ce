//! Onsets of buckling: below them a rod that is moved aside comes back, above them it leaves.

use super::*;

/// How far the tip is moved aside at first, and how far it is when the rod has buckled, in lengths.
pub(super) const IMPERFECTION: f32 = 1e-3;
const BUCKLED: f32 = 0.02;

/// Shares of theory's onset that are tried.
fn shares() -> impl Iterator<Item = f32> {
    (0..=20).map(|i| 0.9 + 0.01 * i as f32)
}

/// Where between `shares` the rods buckle, of which these are how far aside; `rises` where they do above the onset.
fn onset(aside: &[f32], rises: bool) -> f32 {
    onset_in(&shares().collect::<Vec<_>>(), aside, rises)
}

pub(super) fn onset_in(shares: &[f32], aside: &[f32], rises: bool) -> f32 {
    let is_out = |i: &usize| (aside[*i] > BUCKLED) == rises;
    match (0..shares.len()).find(is_out) {
        Some(0) => shares[0],
        Some(first) => 0.5 * (shares[first - 1] + shares[first]),
        None => f32::INFINITY,
    }
}

/// The largest distance of a rod's nodes from the plane across `normal` through its root, in lengths.
fn out_of_plane(places: &[Vec3], normal: Vec3) -> f32 {
    places.iter().map(|p| normal.dot(*p - places[0]).abs() / LENGTH).fold(0.0, f32::max)
}

/// C: upright hair buckles at Γ 7.8373, whichever way it is moved aside, and hangs over beyond.
pub fn greenhill() -> Vec<Row> {
    const ONSET: f32 = 7.8373;
    /// Γ, and how high and how far aside the tip is.
    const BEYOND: [[f32; 3]; 3] =
        [[9.0, 0.6669, 0.6750], [12.0, 0.1621, 0.8495], [20.0, -0.3341, 0.7050]];
    let mut lab = Lab::new();
    let upright = |gamma, segments, angle: f32| {
        let (sine, cosine) = angle.sin_cos();
        let aside = Vec3::new(cosine, 0.0, sine) * (IMPERFECTION * LENGTH);
        Rod { gamma, segments, way: Vec3::Y, aside, ..default() }
    };
    let mut tried = Vec::new();
    for (segments, roll) in SEGMENTS.into_iter().flat_map(|n| [0.0, 0.7, 1.3].map(|a| (n, a))) {
        let rods = shares().map(|share| lab.rod(upright(share * ONSET, segments, roll)));
        tried.push((segments, roll, rods.collect::<Vec<_>>()));
    }
    let mut beyond = Vec::new();
    for (shape, segments) in BEYOND.iter().flat_map(|s| SEGMENTS.map(|n| (s, n))) {
        beyond.push((shape, segments, lab.rod(upright(shape[0], segments, 0.0))));
    }
    lab.settle(1.0, 60.0);
    lab.settle(8.0, 10.0);
    let mut rows = Vec::new();
    for (segments, roll, rods) in tried {
        let aside: Vec<f32> = rods.iter().map(|rod| lab.tip(*rod).xz().length()).collect();
        let test = format!("C upright hair buckles, moved aside to {roll} rad");
        rows.push(
            Row::new(test, 1.0, onset(&aside, true), allowed(0.03, segments)).of(ONSET, segments),
        );
    }
    for (&[gamma, high, aside], segments, rod) in beyond {
        let tip = lab.tip(rod);
        // 1 % of E I moves the tip by as many lengths as this, by the shapes on either side.
        for (test, expected, got) in
            [("C height", high, tip.y), ("C aside", aside, tip.xz().length())]
        {
            rows.push(Row::new(test, expected, got, allowed(0.03, segments)).of(gamma, segments));
        }
    }
    rows
}

/// E: flat curls turn into helices.
pub fn curls() -> Vec<Row> {
    /// C, the curl's angle (rad), the onset of Γ, whether it is left or reached there.
    const DOWN: [(f32, f32, f32, bool); 8] = [
        (1.0, 8.0, 28.5, true),
        (1.0, 10.0, 43.1, true),
        (0.46, 6.0, 8.5, true),
        (0.46, 8.0, 13.4, true),
        (0.46, 10.0, 20.2, true),
        (0.46, 6.0, 81.2, false),
        (0.46, 8.0, 207.5, false),
        (1.0, 8.0, 64.6, false),
    ];
    const LEVEL: [(f32, f32, f32, bool); 8] = [
        (1.0, 4.0, 15.08, true),
        (1.0, 6.0, 38.93, true),
        (1.0, 8.0, 67.13, true),
        (1.0, 10.0, 80.32, true),
        (0.46, 4.0, 6.222, true),
        (0.46, 6.0, 12.60, true),
        (0.46, 8.0, 22.47, true),
        (0.46, 10.0, 26.38, true),
    ];
    let mut rows = Vec::new();
    for (name, way, onsets) in [("down", Vec3::NEG_Y, DOWN), ("level", Vec3::X, LEVEL)] {
        let mut lab = Lab::new();
        let mut tried = Vec::new();
        for (case, segments) in onsets.iter().flat_map(|c| SEGMENTS.map(|n| (c, n))) {
            let (torsion, angle, at, _) = *case;
            let curl = Vec3::Z * angle;
            let rods = shares().map(|share| {
                let gamma = share * at;
                lab.rod(Rod { gamma, torsion, segments, way, curl, ..default() })
            });
            let rods = rods.collect::<Vec<_>>();
            tried.push((case, segments, rods));
        }
        // First in its plane, then moved aside: there are helices beside a flat curl that is stable.
        lab.settle(8.0, 10.0);
        for rod in tried.iter().flat_map(|(.., rods)| rods) {
            if let Some(mut strand) = lab.app.world_mut().get_mut::<Strand>(*rod) {
                move_aside(&mut strand, Vec3::Z * (IMPERFECTION * LENGTH));
            }
        }
        lab.settle(2.0, 60.0);
        for (&(torsion, angle, at, rises), segments, rods) in tried {
            let aside: Vec<f32> =
                rods.iter().map(|rod| out_of_plane(lab.get(*rod), Vec3::Z)).collect();
            let test = format!("E curl of {angle} rad, root {name}, C {torsion}");
            // A polygon with edges as long as their arcs has its nodes θ²/24 too far out, which Γ has three times.
            let joint = angle / segments as f32;
            let tolerance = allowed(0.03, segments).max(joint * joint / 8.0 * 1.2);
            rows.push(Row::new(test, 1.0, onset(&aside, rises), tolerance).of(at, segments));
        }
    }
    rows
}

/// F: a round fibre never buckles sideways under its own weight.
pub fn no_lateral_buckling() -> Vec<Row> {
    let mut lab = Lab::new();
    let aside = Vec3::Z * (IMPERFECTION * LENGTH);
    let mut rods = Vec::new();
    for (gamma, segments) in [1.0, 10.0, 100.0].into_iter().flat_map(|g| SEGMENTS.map(|n| (g, n))) {
        rods.push((gamma, segments, lab.rod(Rod { gamma, segments, aside, ..default() })));
    }
    lab.settle(4.0, 20.0);
    let row = |&(gamma, segments, rod): &(f32, usize, Entity)| {
        let out = out_of_plane(lab.get(rod), Vec3::Z);
        Row::at_most("F level hair leaves its plane", out, IMPERFECTION).of(gamma, segments)
    };
    rods.iter().map(row).collect()
}
