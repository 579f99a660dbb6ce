//! Contact between strands as mathematics: equation 18 of \[B\] over the uniform grid.

use crate::grid::UniformGrid;
use bevy::reflect::Reflect;
use glam::{IVec3, Vec3};

/// Equation 18: the acceleration of a node at `p` away from the foot `f` of its perpendicular on
/// another strand's edge, α (2r − |p−f|)/(2r) along p − f, within 2r.
#[inline]
pub fn penalty(p: Vec3, foot: Vec3, radius: f32, strength: f32) -> Vec3 {
    let off = p - foot;
    let reach = 2.0 * radius;
    let squared = off.length_squared();
    // Two nodes in one place have no direction to part in.
    if squared >= reach * reach || squared < 1e-18 {
        return Vec3::ZERO;
    }
    let distance = squared.sqrt();
    off * (strength * (reach - distance) / (reach * distance))
}

/// An edge of a strand with what is needed to drop perpendiculars on it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Edge {
    start: Vec3,
    along: Vec3,
    inverse_squared: f32,
    is_last: bool,
}

impl Edge {
    /// The edge from `a` to `b`; `is_last` for the one at the tip.
    #[inline]
    pub fn new(a: Vec3, b: Vec3, is_last: bool) -> Self {
        let along = b - a;
        let inverse_squared = 1.0 / along.length_squared().max(1e-20);
        Self { start: a, along, inverse_squared, is_last }
    }

    /// The foot of the perpendicular from `p`, clamped to the edge, or `None` where another edge of
    /// the strand counts it: a foot on a node that two edges share belongs to the second one.
    #[inline]
    pub fn foot(&self, p: Vec3) -> Option<Vec3> {
        let t = (p - self.start).dot(self.along) * self.inverse_squared;
        if t >= 1.0 {
            return self.is_last.then_some(self.start + self.along);
        }
        Some(self.start + self.along * t.max(0.0))
    }

    fn distance_squared(&self, p: Vec3) -> f32 {
        let t = ((p - self.start).dot(self.along) * self.inverse_squared).clamp(0.0, 1.0);
        p.distance_squared(self.start + self.along * t)
    }
}

/// Margin of the list, in units of the reach 2r. More means longer lists, built less often.
const MARGIN: f32 = 1.6;

/// One strand as contacts see it: a range of nodes in a flat array.
#[derive(Clone, Copy, Debug, Default, PartialEq, Reflect)]
pub struct Run {
    /// Index of the root.
    pub start: u32,
    /// How many nodes.
    pub len: u32,
}

/// Which edges are near which nodes: found through the grid, kept while nothing has moved far.
///
/// The list holds every pair within 2r plus a margin. It stays complete until some node has moved by
/// half the margin, and is built anew then, so hair at rest looks nobody up.
#[derive(Clone, Debug, Default)]
pub struct Neighbours {
    grid: UniformGrid,
    built_at: Vec<Vec3>,
    runs: Vec<Run>,
    reach: f32,
    /// The edge that starts at each node, as it is now; tips have one without length.
    edges: Vec<Edge>,
    starts: Vec<u32>,
    /// The near edges of each node, nearest first: how far beyond the reach each was when the list
    /// was built (m), and its start node.
    near: Vec<(f32, u32)>,
    /// The farthest that a node has moved since (m).
    moved: f32,
}

impl Neighbours {
    /// Brings the list up to date for nodes at `points`, strands given by `runs`. Returns whether it
    /// had to be built.
    pub fn update(&mut self, points: &[Vec3], runs: &[Run], radius: f32) -> bool {
        let reach = 2.0 * radius;
        let margin = MARGIN * reach;
        self.edges.clear();
        self.edges.reserve(points.len());
        for run in runs {
            let nodes = &points[run.start as usize..(run.start + run.len) as usize];
            let last = nodes.len().saturating_sub(2);
            self.edges.extend(
                (0..nodes.len()).map(|i| {
                    Edge::new(nodes[i], *nodes.get(i + 1).unwrap_or(&nodes[i]), i == last)
                }),
            );
        }
        let same = self.reach == reach && self.built_at.len() == points.len() && self.runs == runs;
        if same {
            // A non-finite node moves the maximum to no number, which is not less than the limit.
            let squared = points.iter().zip(&self.built_at).map(|(p, q)| p.distance_squared(*q));
            self.moved =
                squared.fold(0.0, |a: f32, b| if b <= a || a.is_nan() { a } else { b }).sqrt();
            if self.moved < 0.5 * margin {
                return false;
            }
        }
        self.moved = 0.0;
        self.reach = reach;
        self.built_at.clear();
        self.built_at.extend_from_slice(points);
        self.runs.clear();
        self.runs.extend_from_slice(runs);
        self.build(points, reach + margin);
        true
    }

    fn build(&mut self, points: &[Vec3], within: f32) {
        // Each edge is put, in pieces, into every cell that has a point within reach of it, so that a
        // node finds all its edges in the one cell it is in.
        let half_piece = 0.5 * within;
        let reach = Vec3::splat(within + half_piece);
        self.grid.begin(2.0 * (within + half_piece));
        for run in &self.runs {
            for i in run.start..(run.start + run.len).saturating_sub(1) {
                let (a, b) = (points[i as usize], points[i as usize + 1]);
                if !(a.is_finite() && b.is_finite()) {
                    continue;
                }
                // An edge torn to absurd length is sampled coarsely rather than for ever.
                let n = (a.distance(b) / (2.0 * half_piece)).ceil().clamp(1.0, 64.0) as u32;
                // Boxes of cells along a line move one way on each axis: a cell that was put in
                // before is in the box before.
                let (mut low_before, mut high_before) = (IVec3::MAX, IVec3::MIN);
                for piece in 0..n {
                    let middle = a.lerp(b, (piece as f32 + 0.5) / n as f32);
                    let low = self.grid.cell_of(middle - reach);
                    let high = self.grid.cell_of(middle + reach);
                    for z in low.z..=high.z {
                        for y in low.y..=high.y {
                            for x in low.x..=high.x {
                                let cell = IVec3::new(x, y, z);
                                let inside = cell.cmpge(low_before) & cell.cmple(high_before);
                                if !inside.all() {
                                    self.grid.put(cell, i);
                                }
                            }
                        }
                    }
                    (low_before, high_before) = (low, high);
                }
            }
        }
        self.grid.sort();
        self.starts.clear();
        self.near.clear();
        self.starts.push(0);
        let within = within * within;
        for run in &self.runs {
            let (start, end) = (run.start, run.start + run.len);
            for i in start..end {
                let first = self.near.len();
                // The root is held; pushing it would do nothing.
                if i > start {
                    let p = points[i as usize];
                    self.grid.for_each_at(p, |j| {
                        if (start..end).contains(&j) {
                            return;
                        }
                        let squared = self.edges[j as usize].distance_squared(p);
                        if squared < within {
                            self.near.push((squared.sqrt() - self.reach, j));
                        }
                    });
                    let found = &mut self.near[first..];
                    found.sort_unstable_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
                }
                self.starts.push(self.near.len() as u32);
            }
        }
    }

    /// Equation 18 summed over all edges near node `i`, in a fixed order (m/s²).
    pub fn acceleration(&self, i: usize, p: Vec3, radius: f32, strength: f32) -> Vec3 {
        // Neither the node nor an edge has moved by more, so what was farther cannot touch yet.
        let may_touch = 2.0 * self.moved;
        self.near[self.starts[i] as usize..self.starts[i + 1] as usize]
            .iter()
            .take_while(|(slack, _)| *slack <= may_touch)
            .filter_map(|&(_, j)| {
                Some(penalty(p, self.edges[j as usize].foot(p)?, radius, strength))
            })
            .sum()
    }

    /// How many pairs of node and edge are kept.
    pub fn pairs(&self) -> usize {
        self.near.len()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    #[test]
    fn penalty_is_strongest_in_touch_and_gone_at_two_radii() {
        let a = |d: f32| penalty(Vec3::X * d, Vec3::ZERO, 1e-3, 20.0).x;
        assert!((a(1e-3) - 10.0).abs() < 1e-4);
        assert!((a(1e-6) - 20.0).abs() < 0.02);
        assert_eq!(a(2e-3), 0.0);
        assert_eq!(a(0.0), 0.0);
    }

    #[test]
    fn a_foot_on_a_shared_node_counts_once_and_tips_count() {
        let (a, b, c) = (Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y);
        let p = Vec3::new(1.2, -0.2, 0.0);
        assert_eq!(Edge::new(a, b, false).foot(p), None);
        assert_eq!(Edge::new(b, c, true).foot(p), Some(b));
        assert_eq!(Edge::new(b, c, true).foot(Vec3::new(1.0, 2.0, 0.0)), Some(c));
    }

    fn brute(points: &[Vec3], runs: &[Run], i: usize, radius: f32) -> Vec3 {
        let mut sum = Vec3::ZERO;
        for run in runs {
            let (s, e) = (run.start as usize, (run.start + run.len) as usize);
            if (s..e).contains(&i) {
                if i == s {
                    return Vec3::ZERO;
                }
                continue;
            }
            for j in s..e - 1 {
                let edge = Edge::new(points[j], points[j + 1], j + 2 == e);
                if let Some(f) = edge.foot(points[i]) {
                    sum += penalty(points[i], f, radius, 20.0);
                }
            }
        }
        sum
    }

    proptest! {
        #[test]
        fn the_list_finds_what_all_pairs_find_even_after_small_moves(
            raw in proptest::collection::vec((0f32..1.0, 0f32..1.0, 0f32..1.0), 8..120),
            radius in 0.002f32..0.1,
            nodes in 2u32..8,
            drift in -0.9f32..0.9,
        ) {
            let mut points: Vec<Vec3> =
                raw.iter().map(|&(x, y, z)| Vec3::new(x, y, z)).collect();
            points.truncate(points.len() / nodes as usize * nodes as usize);
            let runs: Vec<Run> = (0..points.len() as u32 / nodes)
                .map(|s| Run { start: s * nodes, len: nodes })
                .collect();
            let mut list = Neighbours::default();
            prop_assert!(list.update(&points, &runs, radius));
            // less than half the margin: the old list must still be complete
            for (k, p) in points.iter_mut().enumerate() {
                let sign = if k % 2 == 0 { 1.0 } else { -1.0 };
                *p += Vec3::new(0.0, sign * drift * radius, 0.0);
            }
            prop_assert!(!list.update(&points, &runs, radius));
            for i in 0..points.len() {
                let (a, b) =
                    (list.acceleration(i, points[i], radius, 20.0), brute(&points, &runs, i, radius));
                prop_assert!(a.distance(b) < 1e-3, "node {}: {} against {}", i, a, b);
            }
        }
    }
}
