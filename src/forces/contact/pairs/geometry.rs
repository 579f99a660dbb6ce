//! Two edges as seen by each other: nearest points, and where and along how much of them they touch.

use crate::base::lanes::{Real, V3, inlined};
use glam::Vec3;

/// Squared lengths below this (m²) are those of points.
const POINT: f64 = 1e-20;

/// How strongly where nearly parallel edges touch is drawn to the middle of what they share, as the squared sine of
/// the angle at which both count alike: nearest points of such edges jump from end to end.
const NEARLY_PARALLEL: f64 = 1e-5;

/// Places in an interval of length 1 around 0, and their weights, by which polynomials of degree 5 are integrated.
const GAUSS: [(f64, f64); 3] =
    [(-0.387_298_334_6, 5.0 / 18.0), (0.0, 8.0 / 18.0), (0.387_298_334_6, 5.0 / 18.0)];

/// Three numbers of a node or of a pair, and one more.
pub(super) type Row = [f32; 4];

pub(super) fn place(row: &Row) -> Vec3 {
    Vec3::new(row[0], row[1], row[2])
}

/// An edge between two nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Edge<R> {
    pub start: V3<R>,
    pub end: V3<R>,
}

/// How two edges a and b lie to each other.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen<R> {
    /// The direction from the nearest point of b to that of a: a unit vector, or zero where they cross.
    pub normal: V3<R>,
    /// The distance of the nearest points (m).
    pub distance: R,
    /// Where they touch on a and on b, or their nearest points (0…1).
    pub at: [R; 2],
    /// Along how much of them they touch (m).
    pub length: R,
    /// How deep they are within reach of each other, along the normal, summed along that length (m²).
    pub overlap: R,
}

impl<R: Real> Edge<R> {
    #[inline(always)]
    fn point(&self, at: R) -> V3<R> {
        (self.end - self.start).scale_add(at, self.start)
    }
}

#[inline(always)]
fn clamp<R: Real>(x: R, low: R, high: R) -> R {
    x.max(low).min(high)
}

/// The nearest points of two edges, and where they touch if what is within `reach` (m) of each other touches.
///
/// Edges touch along an interval of pairs of points: of edges that run the same way s + u on a and t + u on b, of those
/// that run against each other s + u and t − u, of those across half of each, with s and t the nearest points of the
/// lines that the edges lie on. It ends where either edge does, so that what is near a common node of two edges of a
/// strand is shared by both without a gap or a jump, and finer edges touch along as much.
#[inline(always)]
pub(super) fn see<R: Real>(a: Edge<R>, b: Edge<R>, reach: R) -> Seen<R> {
    let (zero, one, half) = (reach.lit(0.0), reach.lit(1.0), reach.lit(0.5));
    let (d1, d2, r) = (a.end - a.start, b.end - b.start, a.start - b.start);
    let aa = d1.dot(d1).max(reach.lit(POINT));
    let bb = d2.dot(d2).max(reach.lit(POINT));
    let (ab, ar, br) = (d1.dot(d2), d1.dot(r), d2.dot(r));
    // (a a)(b b) sin² θ, of the vector product: the difference of squares cancels.
    let across = d1.cross(d2);
    let det = across.dot(across);
    let share = |over: R, under: R| over / under.max(reach.lit(1e-30));

    // The nearest points are those of the lines where both lie on the edges, else one of them is an end.
    let mut nearest = (r, zero, zero);
    let mut least = reach.lit(f64::from(f32::MAX));
    let mut try_at = inlined(
        #[inline(always)]
        |s: R, t: R| {
            let off = a.point(s) - b.point(t);
            let squared = off.dot(off);
            let is_less = squared.lt(least);
            nearest = (
                V3::select(is_less, off, nearest.0),
                R::select(is_less, s, nearest.1),
                R::select(is_less, t, nearest.2),
            );
            least = squared.min(least);
        },
    );
    try_at(zero, clamp(br / bb, zero, one));
    try_at(one, clamp((br + ab) / bb, zero, one));
    try_at(clamp(-ar / aa, zero, one), zero);
    try_at(clamp((ab - ar) / aa, zero, one), one);
    let inner = clamp(share(ab * br - ar * bb, det), zero, one);
    try_at(inner, clamp(ab.mul_add(inner, br) / bb, zero, one));
    let (off, near_a, near_b) = nearest;
    let distance = least.sqrt();
    let normal = off.scale(one / distance.max(reach.lit(1e-15)));

    // Where they touch, in metres along both.
    let (la, lb) = (aa.sqrt(), bb.sqrt());
    let cosine = ab / (la * lb);
    // What of a lies beside b.
    let (p0, p1) = (-ar / la, (ab - ar) / la);
    let middle = half * (clamp(p0.min(p1), zero, la) + clamp(p0.max(p1), zero, la));
    let firm = aa * bb * reach.lit(NEARLY_PARALLEL);
    let on_a = (firm.mul_add(middle, (ab * br - ar * bb) * la)) / (det + firm);
    let on_b = (on_a * cosine) + br / lb;
    // Beyond this their points are out of reach.
    let off = d1.scale_add(on_a / la, d2.scale_add(-(on_b / lb), r));
    let within = (reach * reach - off.dot(off)).max(zero).sqrt();
    let none = V3::new(zero, zero, zero);
    let (mut overlap, mut length) = (none, zero);
    let (mut deep, mut shift_a, mut shift_b) = (zero, zero, zero);
    let mut add = inlined(
        #[inline(always)]
        |low: R, high: R, share: R, way: R| {
            let spread = reach.lit(2.0) * share.max(reach.lit(1e-12)).sqrt();
            let share = one - share;
            let farthest = within / spread;
            let low = low.max(-on_a).max(-farthest);
            let high = high.min(la - on_a).min(farthest);
            let width = (high - low).max(zero);
            let middle = half * (low + high);
            for (place, weight) in GAUSS {
                let u = width.mul_add(reach.lit(place), middle);
                let s = clamp((on_a + u) / la, zero, one);
                let t = clamp((on_b + u * way) / lb, zero, one);
                let off = a.point(s) - b.point(t);
                let apart = off.dot(off).max(reach.lit(1e-24)).sqrt();
                let weight = reach.lit(weight) * share * width;
                let own = (reach - apart).max(zero) * weight;
                overlap = off.scale_add(own / apart, overlap);
                length = length + R::select(zero.lt(own), weight, zero);
                deep = deep + own;
                shift_a = shift_a + own * s;
                shift_b = shift_b + own * t;
            }
        },
    );
    // For a u the points of edges at an angle θ that run the same way are 2u sin(θ/2) apart.
    add(-on_b, lb - on_b, half * (one - cosine), one);
    add(on_b - lb, on_b, half * (one + cosine), -one);
    let overlap = overlap.dot(normal).max(zero);
    let touches = zero.lt(deep);
    let at = [
        R::select(touches, share(shift_a, deep), near_a),
        R::select(touches, share(shift_b, deep), near_b),
    ];
    Seen { normal, distance, at, length, overlap }
}

/// How far apart two edges certainly are along `normal` (m): below zero where it does not separate them.
#[inline(always)]
pub(super) fn gap<R: Real>(a: Edge<R>, b: Edge<R>, normal: V3<R>) -> R {
    let low = normal.dot(a.start - b.start).min(normal.dot(a.end - b.start));
    let high = normal.dot(b.end - b.start).max(normal.x.lit(0.0));
    low - high
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

    type V = V3<f32>;

    fn edge(start: [f32; 3], end: [f32; 3]) -> Edge<f32> {
        let v = |[x, y, z]: [f32; 3]| V3::new(x, y, z);
        Edge { start: v(start), end: v(end) }
    }

    fn wide(e: Edge<f32>) -> Edge<f64> {
        let wide = |v: V| V3::new(f64::from(v.x), f64::from(v.y), f64::from(v.z));
        Edge { start: wide(e.start), end: wide(e.end) }
    }

    fn random_edge(random: &mut Xoshiro256PlusPlus, size: f32) -> Edge<f32> {
        let mut at = || core::array::from_fn(|_| random.random_range(-size..size));
        edge(at(), at())
    }

    /// The distance, by thirds: that from a point of one edge to the other edge is convex.
    fn brute(a: Edge<f64>, b: Edge<f64>) -> f64 {
        let along = b.end - b.start;
        let from = |s: f64| {
            let p = a.point(s);
            let t = (p - b.start).dot(along) / along.dot(along);
            let off = p - b.point(t.clamp(0.0, 1.0));
            off.dot(off).sqrt()
        };
        let samples = (0..=4096).map(|k| f64::from(k) / 4096.0);
        let nearest = samples.min_by(|s, t| from(*s).total_cmp(&from(*t))).unwrap();
        let (mut low, mut high) = ((nearest - 1e-3).max(0.0), (nearest + 1e-3).min(1.0));
        for _ in 0..60 {
            let (s, t) = ((2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0);
            if from(s) < from(t) { high = t } else { low = s }
        }
        from(low)
    }

    #[test]
    fn distances_are_those_of_all_points_in_f64() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
        let mut worst = 0.0f64;
        for case in 0..2000 {
            let a = random_edge(&mut random, 0.01);
            let mut b = random_edge(&mut random, 0.01);
            if case % 4 == 0 {
                // Nearly parallel ones.
                let tilt = 10f32.powf(random.random_range(-7.0..-1.0));
                let shift = random_edge(&mut random, 0.004).start;
                b.start = a.start + shift;
                b.end = a.end + shift + (b.end.scale(tilt));
            }
            let seen = see(a, b, 1e-3);
            let exact = brute(wide(a), wide(b));
            let off = (f64::from(seen.distance) - exact).abs() / exact.max(1e-4);
            worst = worst.max(off);
            assert!(off < 1e-4, "{case}: {} for {exact}: {a:?} {b:?}", seen.distance);
            let size = seen.normal.dot(seen.normal).sqrt();
            assert!((size - 1.0).abs() < 1e-5, "{size}");
        }
        assert!(worst > 0.0);
    }

    /// Edges of a straight strand along x, of this length, from `from` on, in parts of `l`.
    fn line(from: f32, length: f32, l: f32, y: f32) -> Vec<Edge<f32>> {
        let n = (length / l).round() as usize;
        let x = |i: usize| from + l * i as f32;
        (0..n).map(|i| edge([x(i), y, 0.0], [x(i + 1), y, 0.0])).collect()
    }

    const REACH: f32 = 2e-3;

    /// The overlap of all edges.
    fn total(a: &[Edge<f32>], b: &[Edge<f32>]) -> f32 {
        let mut sum = V3::new(0.0, 0.0, 0.0);
        for a in a {
            for b in b {
                let seen = see(*a, *b, REACH);
                sum = seen.normal.scale_add(seen.overlap, sum);
            }
        }
        sum.dot(sum).sqrt()
    }

    #[test]
    fn parallel_strands_overlap_along_what_they_share_however_they_slide_and_are_cut() {
        let a = line(0.0, 0.06, 0.01, 0.0);
        for k in 0..=40 {
            let shift = -0.02 + 0.001 * k as f32 + 1e-5;
            for l in [0.01, 0.005, 0.02] {
                let shared = total(&a, &line(shift - 0.06, 0.18, l, 1.2e-3));
                let off = (shared / (0.06 * 0.8e-3) - 1.0).abs();
                assert!(off < 1e-3, "shifted by {shift}, edges of {l}: {shared}");
            }
            // The same against the first one's direction.
            let back: Vec<_> = line(shift - 0.06, 0.18, 0.01, 1.2e-3)
                .into_iter()
                .map(|e| Edge { start: e.end, end: e.start })
                .collect();
            assert!((total(&a, &back) / (0.06 * 0.8e-3) - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn crossing_strands_overlap_alike_wherever_nodes_are_and_more_the_less_they_cross() {
        let mut before = f32::MAX;
        for angle in [0.02f32, 0.1, 0.3, 0.8, 1.2, 1.5] {
            let b = |l: f32, shift: f32| -> Vec<Edge<f32>> {
                let at = |x: f32| [x * angle.cos(), x * angle.sin(), 1.2e-3];
                let n = (0.2 / l) as i32;
                let x = |i: i32| l * (i - n / 2) as f32 + shift;
                (0..n).map(|i| edge(at(x(i)), at(x(i + 1)))).collect()
            };
            let expected = total(&line(-0.05, 0.1, 0.0005, 0.0), &b(0.0005, 0.0));
            assert!(expected < before, "{angle}: {expected}");
            before = expected;
            let mut last = None;
            for k in 0..100 {
                let shift = 1e-4 * k as f32 + 3e-6;
                let found = total(&line(-0.05 + 0.5 * shift, 0.1, 0.01, 0.0), &b(0.01, shift));
                let off = (found / expected - 1.0).abs();
                assert!(off < 0.05, "{angle}: {found} for {expected}");
                let step = (found - last.unwrap_or(found)).abs();
                assert!(step < 0.05 * expected, "{angle}: a step of {step} in {expected}");
                last = Some(found);
            }
            // By the other's direction, the same.
            let back: Vec<_> =
                b(0.01, 0.0).iter().map(|e| Edge { start: e.end, end: e.start }).collect();
            let (a, forth) = (line(-0.05, 0.1, 0.01, 0.0), b(0.01, 0.0));
            assert!((total(&a, &back) / total(&a, &forth) - 1.0).abs() < 1e-3);
        }
    }

    #[test]
    fn a_gap_is_certain() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(2);
        for _ in 0..500 {
            let [a, b] = [(); 2].map(|()| random_edge(&mut random, 0.01));
            let seen = see(a, b, 1e-3);
            let gap = gap(a, b, seen.normal);
            assert!(gap <= seen.distance * 1.0001, "{gap} {}", seen.distance);
        }
        let (a, b) = (edge([0.0, 1.0, 0.0], [1.0, 1.0, 0.0]), edge([0.0; 3], [0.0, 0.0, 1.0]));
        assert!((gap(a, b, see(a, b, 1e-3).normal) - 1.0).abs() < 1e-6);
    }
}
