//! Points on drawn strands: the same mathematics as `strands.wgsl`, for tools, tests and effects
//! that need the position of a follower.

use super::{
    drawn_strand::{DrawnStrand, GuideRoot},
    follower_roots::FollowerRoots,
    followers::HairFollowers,
    locks::random_unit,
    scatter::scatter,
    solids::push_out,
};
use bevy::prelude::*;

pub use super::{
    drawn_strand::GuideEnd,
    packed_frame::packed_frame,
    solids::{DrawnSolid, arrange},
};

/// A point on a curve and the derivative by the share of the length.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CurvePoint {
    /// Where it is (m).
    pub position: Vec3,
    /// d position / d share (m).
    pub slope: Vec3,
}

/// The nodes of a guide, root first.
#[derive(Clone, Copy, Debug, Default)]
pub struct Guide<'a> {
    /// Its nodes, in the hair's frame (m).
    pub nodes: &'a [Vec3],
    /// How wet each node looks; dry where absent.
    pub moisture: &'a [f32],
    /// Where it ends if it has been cut.
    pub end: Option<GuideEnd>,
}

/// Where a share of a whole guide falls.
struct GuidePlace {
    below: usize,
    /// How far on to the next node, above 1 beyond the end of one that is cut.
    on: f32,
    /// Length between the two, in edges of the whole guide.
    edge: f32,
}

impl<'a> Guide<'a> {
    /// A dry guide that has not been cut.
    pub fn new(nodes: &'a [Vec3]) -> Self {
        Self { nodes, ..Self::default() }
    }

    fn root(&self) -> Vec3 {
        self.nodes.first().copied().unwrap_or_default()
    }

    fn end(&self) -> GuideEnd {
        self.end.unwrap_or_else(|| GuideEnd::whole(self.nodes.len() as u32))
    }

    /// What is left of it, a share of its edges.
    pub(super) fn share(&self) -> f32 {
        let GuideEnd { edges, end } = self.end();
        if edges > 0.0 { end / edges } else { 1.0 }
    }

    /// `None` with fewer than two nodes.
    fn place(&self, share: f32) -> Option<GuidePlace> {
        let last = self.nodes.len().checked_sub(2)?;
        let GuideEnd { edges, end } = self.end();
        let along = share.clamp(0.0, 1.0) * edges;
        let below = (along as usize).min(last);
        let edge = if below == last { end - below as f32 } else { 1.0 };
        Some(GuidePlace { below, on: (along - below as f32) / edge, edge })
    }

    /// Catmull–Rom through the nodes at `share` (0 root, 1 tip) of its length before it was cut, straight on from where
    /// it was. With fewer than two nodes, the node or the origin.
    pub fn point(&self, share: f32) -> CurvePoint {
        let nodes = self.nodes;
        let Some(GuidePlace { below: i, on, edge }) = self.place(share) else {
            let position = nodes.first().copied().unwrap_or_default();
            return CurvePoint { position, slope: Vec3::ZERO };
        };
        let f = on.min(1.0);
        let (p1, p2) = (nodes[i], nodes[i + 1]);
        let p0 = if i > 0 { nodes[i - 1] } else { 2.0 * p1 - p2 };
        let p3 = nodes.get(i + 2).copied().unwrap_or(2.0 * p2 - p1);
        let a = 0.5 * (p2 - p0);
        let b = p0 - 2.5 * p1 + 2.0 * p2 - 0.5 * p3;
        let c = 1.5 * (p1 - p2) + 0.5 * (p3 - p0);
        let slope = a + f * (2.0 * b + 3.0 * f * c);
        CurvePoint {
            position: p1 + f * (a + f * (b + f * c)) + (on - f) * slope,
            slope: slope * (self.end().edges / edge),
        }
    }

    /// How wet it is at a share of its length, and the derivative.
    fn moisture(&self, share: f32) -> (f32, f32) {
        let of = |i: usize| self.moisture.get(i).copied().unwrap_or(0.0);
        let Some(GuidePlace { below, on, edge }) = self.place(share) else {
            return (of(0), 0.0);
        };
        let rise = of(below + 1) - of(below);
        let rising = if on > 1.0 { 0.0 } else { rise * self.end().edges / edge };
        (of(below) + rise * on.min(1.0), rising)
    }
}

/// The drawn strands for `guides` (their nodes, root first): the guides, then the followers.
pub fn drawn_strands(
    guides: &[&[Vec3]],
    follower_roots: Option<&FollowerRoots>,
    followers: &HairFollowers,
) -> Vec<DrawnStrand> {
    let root = |nodes: &&[Vec3]| {
        let (Some(first), Some(last)) = (nodes.first(), nodes.last()) else {
            return GuideRoot::default();
        };
        GuideRoot {
            place: *first,
            normal: nodes.get(1).map_or(Vec3::Y, |next| (*next - *first).normalize_or(Vec3::Y)),
            length: nodes.windows(2).map(|pair| pair[0].distance(pair[1])).sum(),
            reach: *last - *first,
        }
    };
    let roots: Vec<_> = guides.iter().map(root).collect();
    scatter(&roots, follower_roots, followers)
}

/// How much nearer to the root the first rings are than if all were as far apart.
const NEAR_ROOT: f32 = 0.75;

/// Where ring `ring` of a drawn strand of so many segments is, 0 at the root and 1 at the tip: closer
/// together at the root, where a strand comes out of the skin and lies along it.
///
/// ```
/// # use bevy_keratin::render::curve::ring_share;
/// let rings: Vec<f32> = (0..=24).map(|ring| ring_share(ring, 24)).collect();
/// assert_eq!((rings[0], rings[24]), (0.0, 1.0));
/// assert!(rings[1] < 0.4 / 24.0 && rings.is_sorted());
/// ```
pub fn ring_share(ring: u32, segments: u32) -> f32 {
    let t = ring as f32 / segments.max(1) as f32;
    let left = 1.0 - t;
    t - NEAR_ROOT * t * left * left * left
}

/// The point at `t` (0 root, 1 tip) of what is left of a drawn strand, in the hair's frame; `guide` gives the guides
/// by their index. Pushed out of `solids`.
pub fn strand_point<'a>(
    strand: &DrawnStrand,
    guide: impl Fn(u32) -> Guide<'a>,
    t: f32,
    followers: &HairFollowers,
    solids: &[DrawnSolid],
) -> CurvePoint {
    let CurvePoint { position, slope } =
        whole_point(strand, guide, t * strand.cut, followers, solids);
    CurvePoint { position, slope: slope * strand.cut }
}

/// The point at `t` of a strand as if it were whole.
fn whole_point<'a>(
    strand: &DrawnStrand,
    guide: impl Fn(u32) -> Guide<'a>,
    t: f32,
    followers: &HairFollowers,
    solids: &[DrawnSolid],
) -> CurvePoint {
    let reach = strand.length.min(1.0) - strand.phase;
    // A strand longer than its guides has their shape, scaled.
    let larger = strand.length.max(1.0);
    let eased = eased(t);
    let share = strand.phase * eased.value + t * reach;
    let pace = reach + strand.phase * eased.rate;
    let near = guide(strand.guides[0]);
    let near_root = near.root();
    let near_point = near.point(share);

    let locks = locks_at(strand, t, followers);
    let own = (strand.weights[0] + locks.weights[0]).max(0.0);
    let mut sum = own;
    let mut root = strand.root + strand.weights[0] * near_root;
    let from = |guide: &Guide<'_>, root: Vec3, point: CurvePoint| {
        let shift = guide.point(strand.phase).position - root;
        let way = point.position - root - shift * eased.value;
        (way, point.slope * pace - shift * eased.rate)
    };
    let (near_way, near_slope) = from(&near, near_root, near_point);
    let mut way = own * near_way;
    let mut slope = own * near_slope + locks.rates[0] * near_way;
    for k in 1..3 {
        let own = (strand.weights[k] + locks.weights[k]).max(0.0);
        if strand.weights[k] <= 0.0 && own <= 0.0 {
            continue;
        }
        let guide = guide(strand.guides[k]);
        let guide_root = guide.root();
        let point = guide.point(share);
        root += strand.weights[k] * guide_root;
        let (guide_way, guide_slope) = from(&guide, guide_root, point);
        let apart =
            point.position.distance(near_point.position) / guide_root.distance(near_root).max(1e-4);
        let together =
            guide_way.dot(near_way) / (guide_way.length() * near_way.length()).max(1e-12);
        let together = if t <= 0.0 { 1.0 } else { smoothstep(0.0, 0.6, together) };
        let parting = followers.parting;
        let GuideEnd { edges, end } = guide.end();
        let blending = (1.0 - smoothstep(parting, 1.5 * parting, apart))
            * together
            * (1.0 - smoothstep(0.0, 1.0, share * edges - end));
        sum += own * blending;
        way += own * blending * guide_way;
        slope += blending * (own * guide_slope + locks.rates[k] * guide_way);
    }
    let (gather, most) = match strand.is_guide {
        true => (Vec3::ZERO, 0.0),
        false => ((near_root - root) * followers.clump, followers.wet_clump),
    };
    let frizz = match strand.is_guide {
        true => CurvePoint::default(),
        false => frizz_at(strand, root, t, followers.frizz),
    };
    let sum = sum.max(1e-6);
    let loose = root
        + way * (larger / sum)
        + locks.root
        + gather * t
        + strand.stray * t * t
        + frizz.position;
    let loose_slope =
        slope * (larger / sum) + locks.root_rate + gather + 2.0 * t * strand.stray + frizz.slope;
    let (moisture, rise) = near.moisture(share);
    let tight = most * moisture * t * (2.0 - t);
    let tighter = most * (rise * pace * t * (2.0 - t) + moisture * (2.0 - 2.0 * t));
    let inward = near_point.position - loose;
    let mut position = loose + inward * tight;
    let mut slope = loose_slope.lerp(near_point.slope * pace, tight) + inward * tighter;
    push_out(solids, t, strand.size, &mut position, &mut slope);
    CurvePoint { position, slope }
}

/// A value and its derivative.
#[derive(Clone, Copy, Debug)]
struct Rising {
    value: f32,
    rate: f32,
}

/// The share of the length over which a strand blends from its root to its phase-shifted curve.
const EASE: f32 = 0.2;

/// The blend weight at `t`.
fn eased(t: f32) -> Rising {
    let u = (t / EASE).clamp(0.0, 1.0);
    Rising { value: u * (2.0 - u), rate: 2.0 * (1.0 - u) / EASE }
}

/// The offset of a strand by its locks, with the derivatives.
#[derive(Clone, Copy, Debug)]
struct Locks {
    root: Vec3,
    root_rate: Vec3,
    weights: [f32; 3],
    rates: [f32; 3],
}

/// Every level acts on the distance that the previous levels have left.
fn locks_at(strand: &DrawnStrand, t: f32, followers: &HairFollowers) -> Locks {
    let eased_distance = t.max(1e-4).powf(followers.lock_shape);
    let rising = followers.lock_shape * eased_distance / t.max(1e-4);
    let mut locks =
        Locks { root: Vec3::ZERO, root_rate: Vec3::ZERO, weights: [0.0; 3], rates: [0.0; 3] };
    let mut left = Rising { value: 1.0, rate: 0.0 };
    for (level, to) in strand.locks.iter().enumerate() {
        let pull = followers.locks[level] * eased_distance;
        let pulling = followers.locks[level] * rising;
        let share = pull * left.value;
        let rate = pulling * left.value + pull * left.rate;
        left.rate = left.rate * (1.0 - pull) - left.value * pulling;
        left.value *= 1.0 - pull;
        locks.root += to.root * share;
        locks.root_rate += to.root * rate;
        for k in 0..3 {
            locks.weights[k] += to.weights[k] * share;
            locks.rates[k] += to.weights[k] * rate;
        }
    }
    locks
}

/// Waves whose sum is free of divergence, as curl noise is: direction, polarisation (perpendicular to
/// it), waves per length, and phase.
const WAVES: [(Vec3, Vec3, f32, f32); 4] = [
    (Vec3::new(0.8, 0.6, 0.0), Vec3::new(0.0, 0.0, 1.0), 1.0, 0.0),
    (Vec3::new(0.0, 0.8, 0.6), Vec3::new(1.0, 0.0, 0.0), 1.31, 0.37),
    (Vec3::new(0.6, 0.0, 0.8), Vec3::new(0.0, 1.0, 0.0), 0.77, 0.71),
    (Vec3::new(0.48, -0.64, 0.6), Vec3::new(0.8, 0.6, 0.0), 1.13, 0.13),
];
/// The path of a strand through the noise, per metre of its length.
const THROUGH: Vec3 = Vec3::new(0.6, 0.8, -1.4);
/// Wavelengths (m), and relative amplitudes.
const OCTAVES: [(f32, f32); 2] = [(12e-3, 0.7), (3e-3, 0.18)];

/// The offset of a strand by frizz.
fn frizz_at(strand: &DrawnStrand, root: Vec3, t: f32, most: f32) -> CurvePoint {
    use core::f32::consts::TAU;
    let height = most * t.max(1e-4).powf(1.3);
    let rising = 1.3 * height / t.max(1e-4);
    let place = root + THROUGH * (strand.size * t);
    // Neighbours have nearly equal frizz.
    let own = 0.2 * random_unit(strand.seed.wrapping_add(31));
    let mut sum = CurvePoint::default();
    for (length, share) in OCTAVES {
        for (along, lean, waves, begin) in WAVES {
            let count = waves / length;
            let turn = (count * along.dot(place) + begin + own).rem_euclid(1.0) * TAU;
            let pace = TAU * count * along.dot(THROUGH) * strand.size;
            sum.position += lean * (share * turn.sin());
            sum.slope += lean * (share * pace * turn.cos());
        }
    }
    CurvePoint {
        position: sum.position * height,
        slope: sum.slope * height + sum.position * rising,
    }
}

fn smoothstep(low: f32, high: f32, x: f32) -> f32 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::super::drawn_strand::LockOffset;
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
            let at = Guide::new(&BENT).point(i as f32 / 3.0);
            assert!(at.position.distance(*node) < 1e-6);
        }
        for k in 1..50 {
            let (t, h) = (k as f32 / 50.0, 1e-3);
            let rise =
                Guide::new(&BENT).point(t + h).position - Guide::new(&BENT).point(t - h).position;
            assert!((rise / (2.0 * h)).distance(Guide::new(&BENT).point(t).slope) < 1e-2);
        }
    }

    #[test]
    fn a_follower_stays_between_its_guides_until_they_part() {
        let left: Vec<Vec3> = BENT.iter().map(|p| *p - Vec3::X * 0.01).collect();
        let mut right: Vec<Vec3> = BENT.iter().map(|p| *p + Vec3::X * 0.01).collect();
        let strand =
            DrawnStrand { guides: [0, 1, 0], weights: [0.6, 0.4, 0.0], length: 1.0, ..default() };
        let followers = HairFollowers { clump: 0.0, parting: 5.0, frizz: 0.0, ..default() };
        let tip = |right: &[Vec3]| {
            let guide = |i| Guide::new(if i == 0 { &left } else { right });
            strand_point(&strand, guide, 1.0, &followers, &[]).position
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
        let followers = HairFollowers { wet_clump: 0.8, clump: 0.0, frizz: 0.0, ..default() };
        let point = |t: f32, moisture: &[f32]| {
            strand_point(&strand, |_| Guide { moisture, ..Guide::new(&BENT) }, t, &followers, &[])
        };
        let apart = |t, moisture: &[f32]| {
            point(t, moisture).position.distance(Guide::new(&BENT).point(t).position)
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

    #[test]
    fn the_slope_of_locks_frizz_and_phase_is_the_derivative() {
        let other: Vec<Vec3> = BENT.iter().map(|p| *p * 1.2 + Vec3::Z * 0.01).collect();
        let lock = |x: f32| LockOffset {
            root: Vec3::new(x, 0.002, -x) * 0.01,
            weights: [-0.2 * x, 0.3 * x, -0.1 * x],
        };
        let strand = DrawnStrand {
            guides: [0, 1, 0],
            weights: [0.6, 0.4, 0.0],
            length: 0.9,
            phase: 0.1,
            size: 0.3,
            locks: [lock(1.0), lock(-0.5), lock(0.7)],
            ..default()
        };
        let followers = HairFollowers { parting: 1e6, frizz: 0.5e-3, ..default() };
        let nodes = [&BENT[..], &other];
        let at = |t: f32| {
            let of = |i: u32| Guide { nodes: nodes[i as usize], ..default() };
            strand_point(&strand, of, t, &followers, &[])
        };
        assert!(at(0.0).position.distance(Vec3::Z * 0.004) < 1e-5, "{}", at(0.0).position);
        for k in 1..60 {
            let (t, h) = (k as f32 / 61.0, 2e-4);
            let rise = (at(t + h).position - at(t - h).position) / (2.0 * h);
            assert!(rise.distance(at(t).slope) < 0.06 * rise.length() + 0.01, "{t} {rise}");
        }
    }
}
