//! Firm cores stay apart: what the solver's step would bring nearer to each other than that is moved, both sides by
//! their inverse masses.
//!
//! The nearest points of two edges at the start of a substep give a direction that separates them. It keeps for the
//! substep: edges that are separate along it at the end have not passed each other. The gap that is asked for is never
//! more than what there was by a twentieth of what lacks, so that strands that begin in each other part softly.

use super::{
    geometry::{Edge, gap, see},
    kick::BEARING,
    state::{Close, Pairs, PartPairs, Row, Scratch, mean, nodes_of, overlaps, place},
};
use crate::{
    base::lanes::V3,
    solver::rod::tridiagonal::{Elimination, back},
};
use glam::Vec3;

/// Rounds of moving cores apart and restoring lengths in a substep, at most: strands that meet at 5 m/s take twenty,
/// and most none.
const ROUNDS: u32 = 24;

/// Sweeps over all pairs before lengths are restored.
const SWEEPS: usize = 4;

/// Newton steps on the lengths of a strand that has been moved.
const LENGTHS: usize = 2;

/// The share of what a gap lacks that a substep asks for.
const RECOVERY: f32 = 0.05;

/// The share of the cores' distance by which they may overlap.
const TOLERANCE: f32 = 1e-3;

/// The share of the cores' distance above which what is left of an overlap shows that it cannot be undone.
const YIELDS: f32 = 0.05;

impl Pairs {
    /// Moves nodes at the `ends` of the step, each with its inverse mass (0 stays), until cores are apart. `lengths` has
    /// for each node that of the edge that starts there. What leaves another strand may enter a solid: `push_out` gives
    /// the place of a node for where it is. Returns which strands were moved.
    pub fn keep_apart(
        &mut self,
        ends: &mut [Row],
        lengths: &[f32],
        (core, dt): (f32, f32),
        push_out: impl Fn(usize, Vec3) -> Vec3,
    ) -> &[bool] {
        let Self { places, strands, parts, scratch, .. } = self;
        let Scratch { moved, close, violated, counts, touched } = scratch;
        touched.clear();
        touched.resize(strands.len(), false);
        if ends.len() + 2 != places.len() || lengths.len() != ends.len() {
            return touched;
        }
        let drift = mean(ends) - mean(&places[..ends.len()]);
        moved.clear();
        moved.extend(
            ends.iter().zip(&*places).map(|(to, from)| (place(to) - place(from) - drift).length()),
        );
        close.clear();
        for (number, part) in parts.iter().enumerate() {
            part.find_close(number, places, moved, core, close);
        }
        counts.clear();
        counts.resize(ends.len(), 0.0);
        for _ in 0..ROUNDS {
            let mut any = false;
            for _ in 0..SWEEPS {
                violated.clear();
                for (k, pair) in close.iter().enumerate() {
                    if let Some((nodes, off)) = pair.violation(ends, TOLERANCE * core) {
                        violated.push((nodes, off, k));
                        nodes.iter().for_each(|node| counts[*node] += 1.0);
                    }
                }
                if violated.is_empty() {
                    break;
                }
                any = true;
                for ([i, j], off, k) in &*violated {
                    let Close { part, number, normal, .. } = close[*k];
                    let (wi, wj) = (ends[*i][3], ends[*j][3]);
                    let apart = off / (wi * counts[*i] + wj * counts[*j]);
                    for (node, by) in [(*i, apart * wi), (*j, -apart * wj)] {
                        let w = ends[node][3];
                        ends[node] = (place(&ends[node]) + normal * by).extend(w).to_array();
                        if by != 0.0 {
                            touched[strands.partition_point(|s| s.end as usize <= node)] = true;
                        }
                    }
                    parts[part].pasts[number][3] += BEARING as f32 * apart / dt;
                }
                for (nodes, ..) in &*violated {
                    nodes.iter().for_each(|node| counts[*node] = 0.0);
                }
            }
            if !any {
                break;
            }
            for (strand, _) in strands.iter().zip(&*touched).filter(|(_, touched)| **touched) {
                let own = strand.start as usize..strand.end as usize;
                let places = &mut ends[own.clone()];
                let nodes = own.clone().zip(places.iter_mut());
                for (node, row) in nodes.filter(|(_, row)| row[3] > 0.0) {
                    let out = push_out(node, place(row));
                    *row = out.extend(row[3]).to_array();
                }
                for _ in 0..LENGTHS {
                    limit_lengths(places, &lengths[own.clone()]);
                }
            }
        }
        if !violated.is_empty() {
            for pair in &*close {
                if pair.violation(ends, YIELDS * core).is_some() {
                    let bearing = &mut parts[pair.part].pasts[pair.number][3];
                    *bearing = -bearing.abs();
                }
            }
        }
        touched
    }
}

impl PartPairs {
    /// Adds the pairs whose cores may touch, for all that nodes have moved.
    fn find_close(
        &self,
        part: usize,
        places: &[Row],
        moved: &[f32],
        core: f32,
        close: &mut Vec<Close>,
    ) {
        let edges = (self.first..).zip(self.starts.windows(2));
        let firsts = edges.flat_map(|(edge, w)| (w[0]..w[1]).map(move |_| edge));
        let pairs = firsts.zip(&self.seconds).zip(&self.distances).enumerate();
        for (number, ((a, b), distance)) in pairs {
            let [a0, a1, b0, b1] = nodes_of([a, *b]);
            let way = f32::max(moved[a0], moved[a1]) + f32::max(moved[b0], moved[b1]);
            // None is near one that is not a number.
            let is_near = *distance <= core + way;
            if !is_near || overlaps(&self.pasts[number]) {
                continue;
            }
            let node = |n: usize| V3::new(places[n][0], places[n][1], places[n][2]);
            let edge = |from: usize, to: usize| Edge { start: node(from), end: node(to) };
            let (first, second) = (edge(a0, a1), edge(b0, b1));
            let normal = see(first, second, core).normal;
            let now = gap(first, second, normal);
            if now > 0.0 {
                let least = core.min(now + RECOVERY * (core - now).max(0.0));
                let normal = Vec3::new(normal.x, normal.y, normal.z);
                close.push(Close { part, number, edges: [a, *b], normal, least });
            }
        }
    }
}

impl Close {
    /// The nodes that lie farthest beyond each other, and by how much (m), where that is above `tolerance` and one of
    /// them can be moved.
    fn violation(&self, ends: &[Row], tolerance: f32) -> Option<([usize; 2], f32)> {
        let [a0, a1, b0, b1] = nodes_of(self.edges);
        let along = |node: usize| self.normal.dot(place(&ends[node]));
        let (low, i) = if along(a1) < along(a0) { (along(a1), a1) } else { (along(a0), a0) };
        let (high, j) = if along(b1) > along(b0) { (along(b1), b1) } else { (along(b0), b0) };
        let off = self.least - (low - high);
        (off > tolerance && ends[i][3] + ends[j][3] > 0.0).then_some(([i, j], off))
    }
}

/// A Newton step on the lengths of a strand's edges: J W Jᵀ λ = C.
fn limit_lengths(places: &mut [Row], lengths: &[f32]) {
    let span = |places: &[Row], i: usize| {
        let along = place(&places[i + 1]) - place(&places[i]);
        let length = along.length().max(1e-10);
        (along / length, length)
    };
    let edges = places.len().saturating_sub(1);
    let mut rows = Elimination::new(0.0);
    let mut kept = Vec::with_capacity(edges);
    let mut before = Vec3::ZERO;
    for i in 0..edges {
        let (direction, length) = span(places, i);
        let (w0, w1) = (places[i][3], places[i + 1][3]);
        let coupling = -w0 * before.dot(direction);
        let upper = rows.row(coupling, w0 + w1, length - lengths[i], 1e-6);
        kept.push((direction, upper, rows.rhs));
        before = direction;
    }
    let (mut lambda, mut upper) = (0.0, 0.0);
    for i in (0..edges).rev() {
        let (direction, own, rhs) = kept[i];
        lambda = back(rhs, upper, lambda);
        upper = own;
        for (node, sign) in [(i, 1.0), (i + 1, -1.0)] {
            let row = &mut places[node];
            let moved = place(row) + direction * (sign * lambda * row[3]);
            *row = moved.extend(row[3]).to_array();
        }
    }
}

#[cfg(test)]
mod tests;
