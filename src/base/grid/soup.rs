//! Triangle soups: nearest triangle and generalized winding number.

use glam::Vec3;

/// Triangles in a tree of boxes.
pub(crate) struct TriangleSoup {
    triangles: Vec<[Vec3; 3]>,
    /// The caller's index of each triangle.
    numbers: Vec<u32>,
    nodes: Vec<Node>,
}

struct Node {
    low: Vec3,
    high: Vec3,
    /// Of a leaf its first triangle, else its second child; the first child is the next node.
    first: u32,
    /// Number of triangles of a leaf, else 0.
    count: u32,
    /// The sum of the triangles' area vectors, and their area-weighted centre.
    area: Vec3,
    middle: Vec3,
    /// Around the middle.
    radius: f32,
}

const LEAF: usize = 4;
/// Beyond this many radii a node's triangles are approximated as one.
const FAR: f32 = 2.0;

impl TriangleSoup {
    /// A tree of finite triangles.
    pub(crate) fn new(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> Self {
        let mut all: Vec<([Vec3; 3], u32)> = triangles.into_iter().zip(0..).collect();
        let mut nodes = Vec::with_capacity(all.len());
        if !all.is_empty() {
            build(&mut all, 0, &mut nodes);
        }
        let (triangles, numbers) = all.into_iter().unzip();
        Self { triangles, numbers, nodes }
    }

    /// The index of the triangle nearest to a point, and its squared distance; `known` where none
    /// is nearer.
    pub(crate) fn nearer_than(&self, p: Vec3, known: (u32, f32)) -> (u32, f32) {
        let mut best = known;
        let mut todo = [0u32; 64];
        let mut count = usize::from(!self.nodes.is_empty());
        while count > 0 {
            count -= 1;
            let at = todo[count];
            let node = &self.nodes[at as usize];
            if node.squared(p) >= best.1 {
                continue;
            }
            if node.count > 0 {
                for k in node.first..node.first + node.count {
                    let apart = nearest_on(p, &self.triangles[k as usize]).distance_squared(p);
                    if apart < best.1 {
                        best = (self.numbers[k as usize], apart);
                    }
                }
                continue;
            }
            let (a, b) = (at + 1, node.first);
            let nearer = self.nodes[a as usize].squared(p) <= self.nodes[b as usize].squared(p);
            // The nearer child last, so that it is visited first.
            todo[count] = if nearer { b } else { a };
            todo[count + 1] = if nearer { a } else { b };
            count += 2;
        }
        best
    }

    /// The generalized winding number of a point: 1 inside a closed surface with outward normals, 0
    /// outside, between them in a hole (Jacobson, Kavan, Sorkine-Hornung 2013); far triangles are
    /// approximated together (Barill et al. 2018).
    pub(crate) fn winding(&self, p: Vec3) -> f32 {
        let mut sum = 0.0;
        let mut todo = [0u32; 64];
        let mut count = usize::from(!self.nodes.is_empty());
        while count > 0 {
            count -= 1;
            let at = todo[count];
            let node = &self.nodes[at as usize];
            let offset = node.middle - p;
            let squared = offset.length_squared();
            if squared > (FAR * node.radius).powi(2) {
                sum += node.area.dot(offset) / (squared * squared.sqrt());
            } else if node.count > 0 {
                let own = node.first as usize..(node.first + node.count) as usize;
                sum += self.triangles[own].iter().map(|t| solid_angle(p, t)).sum::<f32>();
            } else {
                (todo[count], todo[count + 1]) = (at + 1, node.first);
                count += 2;
            }
        }
        sum / (4.0 * core::f32::consts::PI)
    }
}

impl Node {
    fn squared(&self, p: Vec3) -> f32 {
        (self.low - p).max(p - self.high).max(Vec3::ZERO).length_squared()
    }
}

fn build(all: &mut [([Vec3; 3], u32)], first: u32, nodes: &mut Vec<Node>) {
    let (mut low, mut high) = (Vec3::INFINITY, Vec3::NEG_INFINITY);
    let (mut area, mut middle, mut size) = (Vec3::ZERO, Vec3::ZERO, 0.0);
    for ([a, b, c], _) in all.iter() {
        (low, high) = (low.min(a.min(*b).min(*c)), high.max(a.max(*b).max(*c)));
        let own = 0.5 * (b - a).cross(c - a);
        area += own;
        middle += own.length() * (a + b + c) / 3.0;
        size += own.length();
    }
    let middle = if size > 0.0 { middle / size } else { 0.5 * (low + high) };
    let radius = (high - middle).max(middle - low).length();
    let at = nodes.len();
    let count = if all.len() <= LEAF { all.len() as u32 } else { 0 };
    nodes.push(Node { low, high, first, count, area, middle, radius });
    if count > 0 {
        return;
    }
    let size = high - low;
    let axis = (0..3).fold(0, |most, k| if size[k] > size[most] { k } else { most });
    let half = all.len() / 2;
    let along = |t: &([Vec3; 3], u32)| t.0[0][axis] + t.0[1][axis] + t.0[2][axis];
    all.select_nth_unstable_by(half, |a, b| along(a).total_cmp(&along(b)).then(a.1.cmp(&b.1)));
    let (before, after) = all.split_at_mut(half);
    build(before, first, nodes);
    nodes[at].first = nodes.len() as u32;
    build(after, first + half as u32, nodes);
}

/// The solid angle of a triangle (Van Oosterom, Strackee 1983).
fn solid_angle(p: Vec3, triangle: &[Vec3; 3]) -> f32 {
    let [a, b, c] = triangle.map(|corner| corner - p);
    let (x, y, z) = (a.length(), b.length(), c.length());
    let below = x * y * z + a.dot(b) * z + b.dot(c) * x + c.dot(a) * y;
    2.0 * a.dot(b.cross(c)).atan2(below)
}

/// The point of a triangle that is nearest to another (Ericson 2005, 5.1.5).
pub(crate) fn nearest_on(p: Vec3, &[a, b, c]: &[Vec3; 3]) -> Vec3 {
    let (ab, ac, ap) = (b - a, c - a, p - a);
    let (d1, d2) = (ab.dot(ap), ac.dot(ap));
    if d1 <= 0.0 && d2 <= 0.0 {
        return a;
    }
    let bp = p - b;
    let (d3, d4) = (ab.dot(bp), ac.dot(bp));
    if d3 >= 0.0 && d4 <= d3 {
        return b;
    }
    let vc = d1 * d4 - d3 * d2;
    if vc <= 0.0 && d1 >= 0.0 && d3 <= 0.0 {
        return a + ab * (d1 / (d1 - d3));
    }
    let cp = p - c;
    let (d5, d6) = (ab.dot(cp), ac.dot(cp));
    if d6 >= 0.0 && d5 <= d6 {
        return c;
    }
    let vb = d5 * d2 - d1 * d6;
    if vb <= 0.0 && d2 >= 0.0 && d6 <= 0.0 {
        return a + ac * (d2 / (d2 - d6));
    }
    let va = d3 * d6 - d5 * d4;
    if va <= 0.0 && d4 >= d3 && d5 >= d6 {
        return b + (c - b) * ((d4 - d3) / ((d4 - d3) + (d5 - d6)));
    }
    let whole = va + vb + vc;
    let inside = a + ab * (vb / whole) + ac * (vc / whole);
    if inside.is_finite() { inside } else { a }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn point(size: f32) -> impl Strategy<Value = Vec3> {
        [-size..size, -size..size, -size..size].prop_map(Vec3::from)
    }

    /// An octahedron, each face parted into four, so often.
    fn ball(rounds: usize) -> Vec<[Vec3; 3]> {
        let mut all = Vec::new();
        for (x, y, z) in (0..8).map(|k| (k & 1 != 0, k & 2 != 0, k & 4 != 0)) {
            let offset = |positive: bool, axis: Vec3| if positive { axis } else { -axis };
            let (a, b, c) = (offset(x, Vec3::X), offset(y, Vec3::Y), offset(z, Vec3::Z));
            all.push(if a.cross(b).dot(c) > 0.0 { [a, b, c] } else { [b, a, c] });
        }
        for _ in 0..rounds {
            let parted = |&[a, b, c]: &[Vec3; 3]| {
                let [d, e, f] = [a + b, b + c, c + a].map(Vec3::normalize);
                [[a, d, f], [d, b, e], [f, e, c], [d, e, f]]
            };
            all = all.iter().flat_map(parted).collect();
        }
        all
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]

        #[test]
        fn the_nearest_is_the_nearest_of_all(
            triangles in proptest::collection::vec([point(1.0), point(1.0), point(1.0)], 1..80),
            p in point(2.0),
        ) {
            let soup = TriangleSoup::new(triangles.iter().copied());
            let (found, squared) = soup.nearer_than(p, (u32::MAX, f32::INFINITY));
            let apart = |t: &[Vec3; 3]| nearest_on(p, t).distance_squared(p);
            let least = triangles.iter().map(apart).fold(f32::INFINITY, f32::min);
            prop_assert_eq!(squared, least);
            prop_assert_eq!(apart(&triangles[found as usize]), least);
            // No corner and no point within is nearer.
            for t in &triangles {
                for q in [t[0], t[1], t[2], (t[0] + t[1] + t[2]) / 3.0, 0.5 * (t[0] + t[1])] {
                    prop_assert!(q.distance_squared(p) >= apart(t) - 1e-6);
                }
            }
        }

        #[test]
        fn a_closed_surface_goes_around_what_is_inside_once(offset in point(1.0), far in 0.0f32..2.0) {
            let soup = TriangleSoup::new(ball(4));
            let far = if (0.98..1.02).contains(&far) { 0.98 } else { far };
            let p = offset.normalize_or(Vec3::X) * far;
            let expected = if far < 1.0 { 1.0 } else { 0.0 };
            prop_assert!((soup.winding(p) - expected).abs() < 0.05, "{} at {far}", soup.winding(p));
        }
    }

    #[test]
    fn far_triangles_together_go_around_as_each_of_them_does() {
        // Away from the origin, and open, so that it is not a whole number anywhere.
        let lift =
            |t: &[Vec3; 3]| t.map(|v| v * Vec3::new(0.5, 1.0, 2.0) + Vec3::new(3.0, -2.0, 5.0));
        let cap: Vec<[Vec3; 3]> = ball(4).iter().map(lift).filter(|t| t[0].y > -1.8).collect();
        let soup = TriangleSoup::new(cap.iter().copied());
        for (i, far) in [0.5, 1.5, 3.0, 6.0, 20.0].into_iter().enumerate() {
            let offset = Vec3::new(0.3, [1.0, -1.0][i % 2], 0.4 * i as f32).normalize();
            let p = Vec3::new(3.0, -2.0, 5.0) + offset * far;
            let each = cap.iter().map(|t| solid_angle(p, t)).sum::<f32>();
            let each = each / (4.0 * core::f32::consts::PI);
            let apart = (soup.winding(p) - each).abs();
            // From two radii away, what a dipole leaves out is up to (1/2)² of a part's share.
            assert!(apart < 0.2 * each.abs(), "{} and {each} at {far}", soup.winding(p));
        }
    }

    #[test]
    fn no_triangles_are_nowhere() {
        let none = TriangleSoup::new([]);
        assert_eq!(none.nearer_than(Vec3::ZERO, (7, 1.0)), (7, 1.0));
        assert_eq!(none.winding(Vec3::ZERO), 0.0);
        let point = TriangleSoup::new([[Vec3::X; 3]; 9]);
        assert_eq!(point.nearer_than(Vec3::ZERO, (u32::MAX, f32::INFINITY)).1, 1.0);
    }
}
