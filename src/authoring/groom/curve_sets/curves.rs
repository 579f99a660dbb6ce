//! Curves as the nodes of strands.

use bevy::math::{DVec3, DVec4};
use core::ops::Range;

/// The highest order of a NURBS curve that is read as such; higher ones are lowered.
const MOST_ORDER: usize = 16;
/// That of a cubic curve.
pub const CUBIC: usize = 4;

/// An array of numbers, of whatever type a file has.
pub trait Numbers: Copy {
    fn len(self) -> usize;

    /// One of them; NaN beyond the last.
    fn get(self, i: usize) -> f64;
}

/// How the points of a set become nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// The curve passes through its points: linear and Catmull-Rom.
    Joined,
    /// Anchors with two handles between them: anchors, and two nodes between them on the curve.
    Bezier,
    /// B-spline and NURBS: as many nodes as points, from end to end.
    Spline,
}

impl Kind {
    /// How many nodes a curve of as many points has; never more than those.
    pub fn nodes(self, points: usize) -> usize {
        match self {
            Self::Joined | Self::Spline => points,
            Self::Bezier => points.checked_sub(1).map_or(0, |handles| 3 * (handles / 3) + 1),
        }
    }

    /// How many anchors it has.
    pub fn anchors(self, points: usize) -> usize {
        match self {
            Self::Joined | Self::Spline => points,
            Self::Bezier => self.nodes(points).div_ceil(3),
        }
    }
}

/// One curve of a set.
#[derive(Clone, Copy, Debug)]
pub struct Curve {
    pub index: usize,
    /// How many points it has, and the first among those of the set.
    pub count: usize,
    pub first_point: usize,
    /// The same of its anchors.
    pub anchors: usize,
    pub first_anchor: usize,
    pub nodes: usize,
}

impl Curve {
    pub fn points(&self) -> Range<usize> {
        self.first_point..self.first_point + self.count
    }
}

/// The curves of a set.
#[derive(Clone, Debug)]
pub struct Curves {
    pub kind: Kind,
    /// Points of each.
    counts: Vec<usize>,
}

impl Curves {
    /// Curves of as many points each, `points` together.
    ///
    /// # Errors
    /// The sum, if it is another one or a count is negative.
    pub fn of(kind: Kind, counts: impl Numbers, points: usize) -> Result<Self, f64> {
        let each = || (0..counts.len()).map(|i| counts.get(i));
        let sum: f64 = each().sum();
        if sum != points as f64 || each().any(|count| count < 0.0) {
            return Err(sum);
        }
        Ok(Self { kind, counts: each().map(|count| count as usize).collect() })
    }

    pub fn len(&self) -> usize {
        self.counts.len()
    }

    pub fn iter(&self) -> impl Iterator<Item = Curve> {
        let (mut first_point, mut first_anchor) = (0, 0);
        self.counts.iter().enumerate().map(move |(index, &count)| {
            let (anchors, nodes) = (self.kind.anchors(count), self.kind.nodes(count));
            let curve = Curve { index, count, first_point, anchors, first_anchor, nodes };
            first_point += count;
            first_anchor += anchors;
            curve
        })
    }
}

/// A node of a Bezier curve: anchors are every third.
pub fn bezier(points: &[DVec3], node: usize) -> DVec3 {
    let segment = (node / 3).min((points.len().max(4) - 4) / 3);
    let Some(&[a, b, c, d]) = points.get(3 * segment..).and_then(|rest| rest.first_chunk()) else {
        return points.get(node).copied().unwrap_or(DVec3::NAN);
    };
    match node - 3 * segment {
        0 => a,
        3 => d,
        third => {
            let t = third as f64 / 3.0;
            let s = 1.0 - t;
            a * (s * s * s) + b * (3.0 * s * s * t) + c * (3.0 * s * t * t) + d * (t * t * t)
        }
    }
}

/// An order that a curve of as many points can have.
pub fn order_of(wanted: usize, points: usize) -> usize {
    wanted.clamp(2, MOST_ORDER).min(points.max(1))
}

/// Even knots that make a curve begin and end at its outermost points.
pub fn clamped_knots(points: usize, order: usize, knots: &mut Vec<f64>) {
    let last = points - order + 1;
    knots.clear();
    knots.extend((0..points + order).map(|i| (i + 1).saturating_sub(order).min(last) as f64));
}

/// Even knots of a curve that ends before its outermost points.
pub fn even_knots(points: usize, order: usize, knots: &mut Vec<f64>) {
    knots.clear();
    knots.extend((0..points + order).map(|i| i as f64));
}

/// Whether these can be knots of a curve.
pub fn are_knots(knots: &[f64], points: usize, order: usize) -> bool {
    let ascend = knots.windows(2).all(|pair| pair[0] <= pair[1] && pair[1].is_finite());
    knots.len() == points + order && ascend && knots[order - 1] < knots[points]
}

/// A node of a B-spline or NURBS curve by de Boor's recurrence: its points have weights as fourth coordinate
/// and are multiplied by them; nodes are as many as points, even in the parameter. L. Piegl and W. Tiller,
/// The NURBS Book, 1997, 2nd edition.
pub fn spline(points: &[DVec4], order: usize, knots: &[f64], node: usize) -> DVec3 {
    let count = points.len();
    let (low, high) = (knots[order - 1], knots[count]);
    let t = low + (high - low) * node as f64 / (count.max(2) - 1) as f64;
    let inner = &knots[order..count];
    let first = inner.partition_point(|knot| *knot <= t && *knot < high);
    let mut near = [DVec4::ZERO; MOST_ORDER];
    near[..order].copy_from_slice(&points[first..first + order]);
    for round in 1..order {
        for i in (round..order).rev() {
            let (from, to) = (knots[first + i], knots[first + i + order - round]);
            let share = if to > from { (t - from) / (to - from) } else { 0.0 };
            near[i] = near[i - 1].lerp(near[i], share);
        }
    }
    let sum = near[order - 1];
    sum.truncate() / sum.w
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn splines_begin_and_end_at_their_points_and_keep_lines_straight() {
        for count in 1..12 {
            let points: Vec<DVec4> =
                (0..count).map(|i| DVec3::new(0.0, i as f64, 1.0).extend(1.0)).collect();
            for wanted in 0..20 {
                let order = order_of(wanted, count);
                let mut knots = Vec::new();
                clamped_knots(count, order, &mut knots);
                assert!(count == 1 || are_knots(&knots, count, order));
                if count == 1 {
                    continue;
                }
                let nodes: Vec<DVec3> =
                    (0..count).map(|k| spline(&points, order, &knots, k)).collect();
                assert_eq!((nodes[0].y, nodes[count - 1].y), (0.0, (count - 1) as f64));
                assert!(nodes.windows(2).all(|pair| pair[1].y > pair[0].y));
                assert!(nodes.iter().all(|p| p.x == 0.0 && (p.z - 1.0).abs() < 1e-12));
            }
        }
    }

    #[test]
    fn a_quarter_of_a_circle_is_round() {
        let weight = 0.5f64.sqrt();
        let points = [(1.0, 0.0, 1.0), (1.0, 1.0, weight), (0.0, 1.0, 1.0)];
        let points = points.map(|(x, y, w)| DVec4::new(x * w, y * w, 0.0, w));
        let knots = [0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
        for node in 0..3 {
            assert!((spline(&points, 3, &knots, node).length() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn a_clamped_cubic_of_four_points_is_their_bezier_curve() {
        let points = [DVec3::ZERO, DVec3::Y, DVec3::ONE, DVec3::X * 3.0];
        let mut knots = Vec::new();
        clamped_knots(4, CUBIC, &mut knots);
        let weighted = points.map(|p| p.extend(1.0));
        for node in 0..4 {
            let apart = bezier(&points, node).distance(spline(&weighted, CUBIC, &knots, node));
            assert!(apart < 1e-12);
        }
        assert_eq!((bezier(&points, 0), bezier(&points, 3)), (points[0], points[3]));
        assert_eq!([0, 1, 3, 4, 7, 9].map(|n| Kind::Bezier.nodes(n)), [0, 1, 1, 4, 7, 7]);
        assert_eq!([1, 4, 7].map(|n| Kind::Bezier.anchors(n)), [1, 2, 3]);
    }
}
