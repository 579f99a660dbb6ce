//! Firm cores stay apart: what the solver's step would bring nearer to each other than that is moved, both sides by
//! their inverse masses.
//!
//! The nearest points of two edges at the start of a substep give a direction that separates them. It keeps for the
//! substep: edges that are separate along it at the end have not passed each other. The gap that is asked for is never
//! more than what there was by a twentieth of what lacks, so that strands that begin in each other part softly.

use super::{
    geometry::{Edge, Row, gap, place, see},
    kick::{BEARING, Contact},
    state::{Close, Kept, Memory, Near, Pairs, PartPairs, Scratch, measure, nodes_of, overlaps},
};
use crate::{
    base::lanes::{V3, dispatch, simd_level},
    solver::rod::tridiagonal::{Elimination, back},
};
use glam::Vec3;

/// Rounds of moving cores apart and restoring lengths in a substep, at most: strands that meet at 5 m/s take twenty, and
/// most none. With 24 of them 95 of 1,500 pass at 8 m/s, with 48 none.
const ROUNDS: u32 = 48;

/// So many rounds that have not left less than this share of the worst overlap show that it cannot be undone: single
/// rounds on the way to the end may leave more than they found.
const STALLED: u32 = 6;
const GETS_ON: f32 = 0.8;

/// Sweeps over all pairs before lengths are restored.
const SWEEPS: usize = 4;

/// Newton steps on the lengths of a strand that has been moved.
const LENGTHS: usize = 2;

/// The share of what a gap lacks that a substep asks for.
const RECOVERY: f32 = 0.05;

/// The share of the cores' distance by which they may overlap.
const TOLERANCE: f32 = 1e-3;

/// The share of the cores' distance that a substep may leave of an overlap: the next one goes on, so that what bears a
/// load rests where a round undoes what the load does in a substep.
const LEFT: f32 = 0.1;

impl Pairs {
    /// Moves nodes at the `ends` of the step, each with its inverse mass (0 stays), until cores are apart. `lengths` has
    /// for each node that of the edge that starts there. What leaves another strand may enter a solid: `push_out` gives
    /// the place of a node for where it is. Returns which strands were moved.
    pub fn keep_apart(
        &mut self,
        ends: &mut [Row],
        lengths: &[f32],
        contact: &Contact<f32>,
        push_out: impl Fn(usize, Vec3) -> Vec3,
    ) -> &[bool] {
        let Self { places, strands, lists, moved, parts, scratch, .. } = self;
        let Scratch { close, violated, counts, touched } = scratch;
        touched.clear();
        touched.resize(strands.len(), false);
        if ends.len() + 2 != places.len() || lengths.len() != ends.len() {
            return touched;
        }
        let Contact { core, dt, .. } = *contact;
        // Forces of the substep may have moved nodes elsewhere than their velocities before it.
        let way = |node: usize| place(&ends[node]) - place(&places[node]);
        lists.look_up(parts, places, strands, contact, way);
        let way = |node: usize| place(&places[node]) - place(&lists.places[node]);
        measure(&mut moved[0], ends.len(), way);
        measure(&mut moved[1], ends.len(), |node| place(&ends[node]) - place(&lists.places[node]));
        let level = simd_level();
        close.clear();
        for (number, part) in parts.iter_mut().enumerate() {
            dispatch!(level, simd => part.sift(simd, moved, [core, core]));
            part.find_close(number, places, core, close);
        }
        counts.clear();
        counts.resize(ends.len(), 0.0);
        let (mut is_apart, mut is_stalled) = (false, false);
        // The least that rounds have left, and after which.
        let (mut least, mut after) = (f32::INFINITY, 0);
        for round in 0..ROUNDS {
            for sweep in 0..SWEEPS {
                violated.clear();
                let mut worst = 0.0f32;
                for (k, pair) in close.iter().enumerate() {
                    if let Some((nodes, off)) = pair.violation(ends, TOLERANCE * core) {
                        violated.push((nodes, off, k));
                        nodes.iter().for_each(|node| counts[*node] += 1.0);
                        worst = worst.max(off);
                    }
                }
                let enough = if round == 0 { TOLERANCE } else { LEFT };
                is_apart = sweep == 0 && worst <= enough * core;
                if sweep == 0 && worst < GETS_ON * least {
                    (least, after) = (worst, round);
                }
                is_stalled = sweep == 0 && round - after >= STALLED;
                if is_apart || is_stalled || violated.is_empty() {
                    break;
                }
                for ([i, j], off, k) in &*violated {
                    let normal = close[*k].normal;
                    let (wi, wj) = (ends[*i][3], ends[*j][3]);
                    let apart = off / (wi * counts[*i] + wj * counts[*j]);
                    for (node, by) in [(*i, apart * wi), (*j, -apart * wj)] {
                        let w = ends[node][3];
                        ends[node] = (place(&ends[node]) + normal * by).extend(w).to_array();
                        if by != 0.0 {
                            touched[strands.partition_point(|s| s.end as usize <= node)] = true;
                        }
                    }
                    close[*k].borne += BEARING as f32 * apart / dt;
                }
                for (nodes, ..) in &*violated {
                    nodes.iter().for_each(|node| counts[*node] = 0.0);
                }
            }
            if is_apart || is_stalled {
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
        if !is_apart {
            for pair in &mut *close {
                pair.gives_way = pair.violation(ends, LEFT * core).is_some();
            }
        }
        for own in close.chunk_by(|a, b| a.part == b.part) {
            parts[own[0].part].remember(own);
        }
        touched
    }
}

impl PartPairs {
    /// Adds those of the pairs that may be near whose cores are kept apart.
    fn find_close(&self, part: usize, places: &[Row], core: f32, close: &mut Vec<Close>) {
        let mut memory = Memory(&self.kept);
        for Near { number, edges } in &self.near {
            if memory.of(*number).is_some_and(|past| overlaps(&past)) {
                continue;
            }
            let [a0, a1, b0, b1] = nodes_of(*edges);
            let node = |n: usize| V3::new(places[n][0], places[n][1], places[n][2]);
            let edge = |from: usize, to: usize| Edge { start: node(from), end: node(to) };
            let (first, second) = (edge(a0, a1), edge(b0, b1));
            let normal = see(first, second, core).normal;
            let now = gap(first, second, normal);
            if now > 0.0 {
                let least = core.min(now + RECOVERY * (core - now).max(0.0));
                let normal = Vec3::new(normal.x, normal.y, normal.z);
                let (number, edges) = (*number, *edges);
                let (borne, gives_way) = (0.0, false);
                close.push(Close { part, number, edges, normal, least, borne, gives_way });
            }
        }
    }

    /// Keeps what pairs have borne, and which have given way.
    fn remember(&mut self, close: &[Close]) {
        let changes = || close.iter().filter(|pair| pair.borne != 0.0 || pair.gives_way);
        if changes().next().is_none() {
            return;
        }
        core::mem::swap(&mut self.kept, &mut self.before.2);
        self.kept.clear();
        let mut others = self.before.2.iter().peekable();
        for Close { number, borne, gives_way, .. } in changes() {
            let before = |kept: &&Kept| kept.number < *number;
            self.kept.extend(core::iter::from_fn(|| others.next_if(before)));
            let own = others.next_if(|kept| kept.number == *number);
            let mut past = own.map_or([0.0; 4], |kept| kept.past);
            past[3] += borne;
            if *gives_way {
                past[3] = -past[3].abs();
            }
            self.kept.push(Kept { number: *number, past });
        }
        self.kept.extend(others);
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
