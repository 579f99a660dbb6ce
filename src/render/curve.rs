//! Points on drawn strands: the Rust twin of `strands.wgsl`, for tools, tests and effects that
//! need to know where a follower is.

use super::{drawn_strand::DrawnStrand, followers::HairFollowers};
use bevy::prelude::*;

/// A point on a curve and the derivative by the share of the length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurvePoint {
    /// Where it is (m).
    pub position: Vec3,
    /// d position / d share (m).
    pub slope: Vec3,
}

/// Catmull–Rom through a guide's `nodes` at `share` (0 root, 1 tip) of its length. With fewer than
/// two nodes, the node or the origin.
pub fn guide_point(nodes: &[Vec3], share: f32) -> CurvePoint {
    if nodes.len() < 2 {
        return CurvePoint {
            position: nodes.first().copied().unwrap_or_default(),
            slope: Vec3::ZERO,
        };
    }
    let last = nodes.len() - 1;
    let along = share.clamp(0.0, 1.0) * last as f32;
    let i = (along as usize).min(last - 1);
    let f = along - i as f32;
    let (p1, p2) = (nodes[i], nodes[i + 1]);
    let p0 = if i > 0 { nodes[i - 1] } else { 2.0 * p1 - p2 };
    let p3 = nodes.get(i + 2).copied().unwrap_or(2.0 * p2 - p1);
    let a = 0.5 * (p2 - p0);
    let b = p0 - 2.5 * p1 + 2.0 * p2 - 0.5 * p3;
    let c = 1.5 * (p1 - p2) + 0.5 * (p3 - p0);
    CurvePoint {
        position: p1 + f * (a + f * (b + f * c)),
        slope: (a + f * (2.0 * b + 3.0 * f * c)) * last as f32,
    }
}

/// What a guide is made of, root first.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guide<'a> {
    /// Its nodes, in the hair's frame (m).
    pub nodes: &'a [Vec3],
    /// How wet each node looks; dry where absent.
    pub moisture: &'a [f32],
}

/// The point at `t` (0 root, 1 tip) of a drawn strand, in the hair's frame; `guide` gives the guides
/// by their index.
pub fn strand_point<'a>(
    strand: &DrawnStrand,
    guide: impl Fn(u32) -> Guide<'a>,
    t: f32,
    followers: &HairFollowers,
) -> CurvePoint {
    let reach = strand.length.min(1.0) - strand.phase;
    // What is longer than its guides is like them, but larger.
    let larger = strand.length.max(1.0);
    let share = strand.phase + t * reach;
    let near_guide = guide(strand.guides[0]);
    let near = near_guide.nodes;
    let near_root = near.first().copied().unwrap_or_default();
    let near_point = guide_point(near, share);

    let mut sum = strand.weights[0];
    let mut root = strand.root + sum * near_root;
    let near_way = near_point.position - guide_point(near, strand.phase).position;
    let mut way = sum * near_way;
    let mut slope = sum * near_point.slope;
    for k in 1..3 {
        if strand.weights[k] <= 0.0 {
            continue;
        }
        let nodes = guide(strand.guides[k]).nodes;
        let guide_root = nodes.first().copied().unwrap_or_default();
        let point = guide_point(nodes, share);
        root += strand.weights[k] * guide_root;
        let guide_way = point.position - guide_point(nodes, strand.phase).position;
        let apart =
            point.position.distance(near_point.position) / guide_root.distance(near_root).max(1e-4);
        let together =
            guide_way.dot(near_way) / (guide_way.length() * near_way.length()).max(1e-12);
        let together = match share <= strand.phase {
            true => 1.0,
            false => smoothstep(0.0, 0.6, together),
        };
        let parting = followers.parting;
        let weight =
            strand.weights[k] * (1.0 - smoothstep(parting, 1.5 * parting, apart)) * together;
        sum += weight;
        way += weight * guide_way;
        slope += weight * point.slope;
    }
    let (gather, most) = match strand.is_guide {
        true => (Vec3::ZERO, 0.0),
        false => ((near_root - root) * followers.clump, followers.wet_clump),
    };
    let loose = root + way * (larger / sum) + gather * t + strand.stray * t * t;
    let loose_slope = slope * (reach * larger / sum) + gather + 2.0 * t * strand.stray;
    let (moisture, rise) = moisture_at(&near_guide, share);
    let tight = most * moisture * t * (2.0 - t);
    let tighter = most * (rise * reach * t * (2.0 - t) + moisture * (2.0 - 2.0 * t));
    let inward = near_point.position - loose;
    CurvePoint {
        position: loose + inward * tight,
        slope: loose_slope.lerp(near_point.slope * reach, tight) + inward * tighter,
    }
}

/// How wet a guide is at `share` of its length, and the derivative.
fn moisture_at(guide: &Guide<'_>, share: f32) -> (f32, f32) {
    if guide.nodes.len() < 2 {
        return (guide.moisture.first().copied().unwrap_or(0.0), 0.0);
    }
    let last = guide.nodes.len() - 1;
    let along = share.clamp(0.0, 1.0) * last as f32;
    let i = (along as usize).min(last - 1);
    let of = |i: usize| guide.moisture.get(i).copied().unwrap_or(0.0);
    let rise = of(i + 1) - of(i);
    (of(i) + rise * (along - i as f32), rise * last as f32)
}

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;

    const BENT: [Vec3; 4] = [
        Vec3::ZERO,
        Vec3::new(0.0, -0.1, 0.02),
        Vec3::new(0.03, -0.2, 0.0),
        Vec3::new(0.0, -0.3, 0.1),
    ];

    #[test]
    fn the_curve_goes_through_the_nodes_and_its_slope_is_its_derivative() {
        for (i, node) in BENT.iter().enumerate() {
            let at = guide_point(&BENT, i as f32 / 3.0);
            assert!(at.position.distance(*node) < 1e-6);
        }
        for k in 1..50 {
            let (t, h) = (k as f32 / 50.0, 1e-3);
            let rise = guide_point(&BENT, t + h).position - guide_point(&BENT, t - h).position;
            assert!((rise / (2.0 * h)).distance(guide_point(&BENT, t).slope) < 1e-2);
        }
    }

    #[test]
    fn a_follower_stays_between_its_guides_until_they_part() {
        let left: Vec<Vec3> = BENT.iter().map(|p| *p - Vec3::X * 0.01).collect();
        let mut right: Vec<Vec3> = BENT.iter().map(|p| *p + Vec3::X * 0.01).collect();
        let strand =
            DrawnStrand { guides: [0, 1, 0], weights: [0.6, 0.4, 0.0], length: 1.0, ..default() };
        let followers = HairFollowers { clump: 0.0, parting: 5.0, ..default() };
        let tip = |right: &[Vec3]| {
            let guide = |i| Guide { nodes: if i == 0 { &left } else { right }, moisture: &[] };
            strand_point(&strand, guide, 1.0, &followers).position
        };
        let root = Vec3::X * -0.002;
        assert!(tip(&right).distance(BENT[3] + root) < 1e-6);
        right[3] += Vec3::X * 0.2;
        assert!(tip(&right).distance(BENT[3] + root) < 1e-6, "goes with the nearest");
    }

    #[test]
    fn wet_followers_draw_near_their_guide_and_their_slope_stays_the_derivative() {
        let strand = DrawnStrand {
            weights: [1.0, 0.0, 0.0],
            length: 1.0,
            root: Vec3::X * 0.01,
            stray: Vec3::Z * 0.02,
            ..default()
        };
        let followers = HairFollowers { wet_clump: 0.8, clump: 0.0, ..default() };
        let point = |t: f32, moisture: &[f32]| {
            strand_point(&strand, |_| Guide { nodes: &BENT, moisture }, t, &followers)
        };
        let apart = |t, moisture: &[f32]| {
            point(t, moisture).position.distance(guide_point(&BENT, t).position)
        };
        let (dry, wet) = ([0.0; 4], [1.0; 4]);
        assert_eq!(apart(0.0, &wet), apart(0.0, &dry), "roots stay in the scalp");
        assert!((apart(1.0, &wet) / apart(1.0, &dry) - 0.2).abs() < 1e-4);
        let uneven = [0.0, 0.3, 1.0, 0.2];
        for k in 1..30 {
            let (t, h) = (k as f32 / 31.0, 1e-3);
            let rise = point(t + h, &uneven).position - point(t - h, &uneven).position;
            assert!((rise / (2.0 * h)).distance(point(t, &uneven).slope) < 2e-2, "{t}");
        }
    }
}
