//! Contact between strands as mathematics: equation 18 of \[B\] over the uniform grid.

use crate::grid::UniformGrid;
use bevy::{math::Vec3, reflect::Reflect};

/// Equation 18: the acceleration of a node at `p` away from the foot `f` of its perpendicular on
/// another strand's edge, α (2r − |p−f|)/(2r) along p − f, within 2r.
#[inline]
pub fn penalty(p: Vec3, foot: Vec3, radius: f32, strength: f32) -> Vec3 {
    let off = p - foot;
    let reach = 2.0 * radius;
    let distance = off.length();
    // Two nodes in one place have no direction to part in.
    if distance >= reach || distance < 1e-9 {
        return Vec3::ZERO;
    }
    off * (strength * (reach - distance) / (reach * distance))
}

/// The foot of the perpendicular from `p` on the edge `a b`, clamped to it, or `None` where another
/// edge of the strand counts it: a foot on a node that two edges share belongs to the second one.
#[inline]
pub fn foot(p: Vec3, a: Vec3, b: Vec3, is_last: bool) -> Option<Vec3> {
    let edge = b - a;
    let t = (p - a).dot(edge) / edge.length_squared().max(1e-20);
    if t >= 1.0 {
        return is_last.then_some(b);
    }
    Some(a + edge * t.max(0.0))
}

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
    starts: Vec<u32>,
    /// Index of the edge's start node, and whether it is the strand's last edge.
    edges: Vec<(u32, bool)>,
}

impl Neighbours {
    /// Brings the list up to date for nodes at `points`, strands given by `runs`. Returns whether it
    /// had to be built.
    pub fn update(&mut self, points: &[Vec3], runs: &[Run], radius: f32) -> bool {
        let reach = 2.0 * radius;
        let margin = 2.0 * reach;
        let limit = (0.5 * margin) * (0.5 * margin);
        let current = self.reach == reach
            && self.built_at.len() == points.len()
            && self.runs == runs
            // A non-finite node compares as not near and forces a new list, which leaves it out.
            && points.iter().zip(&self.built_at).all(|(p, q)| p.distance_squared(*q) < limit);
        if current {
            return false;
        }
        self.reach = reach;
        self.built_at.clear();
        self.built_at.extend_from_slice(points);
        self.runs.clear();
        self.runs.extend_from_slice(runs);
        self.build(points, reach + margin);
        true
    }

    fn build(&mut self, points: &[Vec3], within: f32) {
        // Edges are put in by samples at most one spacing apart, so that whatever is within reach of
        // an edge is within reach + spacing/2 of a sample: one cell.
        let cell = 2.0 * within;
        let samples = self.runs.iter().flat_map(|run| {
            (run.start..(run.start + run.len).saturating_sub(1)).flat_map(move |i| {
                let (a, b) = (points[i as usize], points[i as usize + 1]);
                // An edge torn to absurd length is sampled coarsely rather than for ever.
                let n = (a.distance(b) / cell).ceil().clamp(1.0, 64.0) as u32;
                (0..n).map(move |s| (a.lerp(b, (s as f32 + 0.5) / n as f32), i))
            })
        });
        self.grid.build(cell, samples);
        self.starts.clear();
        self.edges.clear();
        self.starts.push(0);
        for run in &self.runs {
            let (start, end) = (run.start, run.start + run.len);
            for i in start..end {
                let p = points[i as usize];
                let first = self.edges.len();
                let found = &mut self.edges;
                // The root is held; pushing it would do nothing.
                if i > start {
                    self.grid.for_each_near(p, |j| {
                        if !(start..end).contains(&j) {
                            found.push((j, false));
                        }
                    });
                    found[first..].sort_unstable();
                    let mut kept = first;
                    for k in first..found.len() {
                        let j = found[k].0;
                        let repeated = kept > first && found[kept - 1].0 == j;
                        let (a, b) = (points[j as usize], points[j as usize + 1]);
                        if !repeated && near_edge(p, a, b, within) {
                            found[kept].0 = j;
                            kept += 1;
                        }
                    }
                    found.truncate(kept);
                }
                self.starts.push(self.edges.len() as u32);
            }
        }
        self.mark_last_edges();
    }

    fn mark_last_edges(&mut self) {
        let mut last = vec![false; self.built_at.len()];
        for run in self.runs.iter().filter(|r| r.len >= 2) {
            last[(run.start + run.len - 2) as usize] = true;
        }
        for (edge, is_last) in &mut self.edges {
            *is_last = last[*edge as usize];
        }
    }

    /// Equation 18 summed over all edges near node `i`, in a fixed order (m/s²).
    pub fn acceleration(&self, i: usize, points: &[Vec3], radius: f32, strength: f32) -> Vec3 {
        let p = points[i];
        self.edges[self.starts[i] as usize..self.starts[i + 1] as usize]
            .iter()
            .filter_map(|&(j, is_last)| {
                let f = foot(p, points[j as usize], points[j as usize + 1], is_last)?;
                Some(penalty(p, f, radius, strength))
            })
            .sum()
    }

    /// How many pairs of node and edge are kept.
    pub fn pairs(&self) -> usize {
        self.edges.len()
    }
}

fn near_edge(p: Vec3, a: Vec3, b: Vec3, within: f32) -> bool {
    let edge = b - a;
    let t = ((p - a).dot(edge) / edge.length_squared().max(1e-20)).clamp(0.0, 1.0);
    p.distance_squared(a + edge * t) < within * within
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
        assert_eq!(foot(p, a, b, false), None);
        assert_eq!(foot(p, b, c, true), Some(b));
        assert_eq!(foot(Vec3::new(1.0, 2.0, 0.0), b, c, true), Some(c));
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
                if let Some(f) = foot(points[i], points[j], points[j + 1], j + 2 == e) {
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
                *p += Vec3::new(0.0, sign * drift * 2.0 * radius, 0.0);
            }
            prop_assert!(!list.update(&points, &runs, radius));
            for i in 0..points.len() {
                let (a, b) =
                    (list.acceleration(i, &points, radius, 20.0), brute(&points, &runs, i, radius));
                prop_assert!(a.distance(b) < 1e-3, "node {}: {} against {}", i, a, b);
            }
        }
    }
}
