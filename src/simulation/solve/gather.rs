//! Gathers strands' arrays into lanes and scatters them back.
//!
//! Blocks of four strands by four numbers are transposed at a time, and memory is prefetched while
//! the previous block is solved. At ten thousand strands of sixteen nodes that takes about as long
//! as three of five iterations; number by number and without prefetching it took longer than all
//! five.

use super::batched::{Batched, Kept, Member, Source};
use crate::{
    base::lanes::{
        LANES, put_numbers, put_vectors, put3, simd_level, take_numbers, take_quaternions,
        take_vectors, take3, take4,
    },
    hair::strand::Strand,
    solver::rod::{
        block::{BlockLanes, NodeLanes},
        limiter::strained,
    },
};
use bevy::prelude::*;

/// A value for each lane; unused lanes repeat the first.
pub(super) fn in_lanes<'a, T, U>(items: &'a [T], of: impl Fn(&'a T) -> U) -> [U; LANES] {
    core::array::from_fn(|lane| of(items.get(lane).unwrap_or(&items[0])))
}

/// Writes strands' nodes and lengths into the lanes; held nodes with their target and the velocity
/// toward it. [`weigh`](crate::solver::rod::step::weigh) has to follow: until then `w` is a node's mass in dry
/// nodes.
pub(super) fn gather_nodes(block: &mut BlockLanes, from: &[Source<'_>; LANES], dt: f32) {
    for (group, four) in from.as_chunks::<4>().0.iter().enumerate() {
        let strands = four.map(|source| source.strand);
        put_vectors(&mut block.nodes, group, strands.map(Strand::positions), |n| &mut n.p);
        put_vectors(&mut block.nodes, group, strands.map(Strand::velocities), |n| &mut n.v);
        put_numbers(&mut block.edges, group, strands.map(Strand::rest_lengths), |e| &mut e.l);
    }
    for node in &mut block.nodes {
        node.w = [1.0; LANES];
    }
    (block.escape_length, block.trapped) = ([0.0; LANES], [0.0; LANES]);
    block.gravity.clear();
    if from.iter().any(|source| !source.added.in_water.is_empty()) {
        block.gravity.resize(block.nodes.len(), [1.0; LANES]);
    }
    for (lane, Source { strand, added, held }) in from.iter().enumerate() {
        for (node, load) in block.nodes.iter_mut().zip(&added.mass) {
            node.w[lane] += load;
        }
        let in_water = block.nodes.iter_mut().zip(&mut block.gravity).zip(&added.in_water);
        for ((node, gravity), water) in in_water {
            node.w[lane] *= water.inertia;
            gravity[lane] = water.gravity;
        }
        let hold = |node: &mut NodeLanes, from: Vec3, to: Vec3| {
            put3(&mut node.from, lane, from);
            put3(&mut node.p, lane, to);
            put3(&mut node.v, lane, (to - from) / dt);
            node.w[lane] = 0.0;
        };
        let positions = strand.positions();
        hold(&mut block.nodes[0], positions[0], positions[0]);
        for (node, target) in held.iter().flat_map(|held| held.places(strand)) {
            hold(&mut block.nodes[node], positions[node], target);
        }
    }
}

/// Writes the lanes back into the strands of `items`. Those whose new state is not finite are left as they
/// are; returns a bit for each of them.
pub(super) fn scatter<T: Batched>(
    block: &BlockLanes,
    items: &mut [Member<'_, T>],
    params: &T::Params,
) -> u32 {
    let mut failed = 0;
    let kept = T::kept(params);
    let most_free = T::most_free_strain(params);
    let strained = most_free.map_or(0, |most| strained(simd_level(), block, most));
    for (group, four) in items.chunks_mut(4).enumerate() {
        let lanes = 4 * group..4 * group + four.len();
        let any_held = four.iter().any(|item| item.held.is_some());
        match &mut *four {
            [a, b, c, d] if block.finite[lanes.clone()] == [0.0; 4] && !any_held => {
                scatter_four(block, group, [a, b, c, d].map(|item| &mut *item.strand), kept);
            }
            four => {
                for (lane, item) in lanes.clone().zip(four.iter_mut()) {
                    if gives_way(block, lane, item, params) {
                        continue;
                    }
                    if block.finite[lane] == 0.0 {
                        scatter_one(block, lane, item.strand, kept);
                    } else {
                        failed |= 1 << lane;
                    }
                }
            }
        }
        let is_strained = |lane: usize| strained & !failed & 1 << lane != 0;
        if let Some(most) = most_free.filter(|_| lanes.clone().any(is_strained)) {
            let frame_delta = T::frame_delta(params).unwrap_or_default();
            // Those that have given way have kept their lengths.
            for (_, item) in lanes.zip(four).filter(|(lane, _)| is_strained(*lane)) {
                item.strand.come_to_length(most, frame_delta, T::dt(params));
            }
        }
    }
    failed
}

/// Whether a strand with held nodes does not take the substep, and stays where it was.
fn gives_way<T: Batched>(
    block: &BlockLanes,
    lane: usize,
    item: &mut Member<'_, T>,
    params: &T::Params,
) -> bool {
    let most_strain = T::most_strain(params);
    let Some(held) = &mut item.held else { return false };
    if block.finite[lane] != 0.0 && (held.is_let_go() || !item.strand.is_finite()) {
        return false;
    }
    let place = |node: usize| take3(&block.nodes[node].p, lane);
    let Err(last) = held.accepts(item.strand, most_strain, place) else { return false };
    let frame_delta = T::frame_delta(params).unwrap_or_default();
    item.strand.give_way(last, most_strain, frame_delta, T::dt(params));
    true
}

fn scatter_four(block: &BlockLanes, group: usize, strands: [&mut Strand; 4], kept: Kept) {
    let [a, b, c, d] = strands;
    for strand in [&mut *a, &mut *b, &mut *c, &mut *d] {
        strand.step_succeeded();
    }
    if kept == Kept::Tensions {
        let tensions = [a.tensions_mut(), b.tensions_mut(), c.tensions_mut(), d.tensions_mut()];
        take_numbers(&block.edges, group, tensions, |e| &e.tension);
    }
    let [a, b, c, d] = [a.parts_mut(), b.parts_mut(), c.parts_mut(), d.parts_mut()];
    take_vectors(&block.nodes, group, [a.0, b.0, c.0, d.0], |n| &n.p);
    take_vectors(&block.nodes, group, [a.1, b.1, c.1, d.1], |n| &n.v);
    take_quaternions(&block.edges, group, [a.2, b.2, c.2, d.2], |e| &e.q);
    if kept == Kept::AngularVelocities {
        take_vectors(&block.edges, group, [a.3, b.3, c.3, d.3], |e| &e.omega);
    }
}

fn scatter_one(block: &BlockLanes, lane: usize, strand: &mut Strand, kept: Kept) {
    strand.step_succeeded();
    if kept == Kept::Tensions {
        for (edge, tension) in block.edges.iter().zip(strand.tensions_mut()) {
            *tension = edge.tension[lane];
        }
    }
    let (positions, velocities, orientations, angular) = strand.parts_mut();
    for ((node, p), v) in block.nodes.iter().zip(positions).zip(velocities) {
        (*p, *v) = (take3(&node.p, lane), take3(&node.v, lane));
    }
    for (edge, q) in block.edges.iter().zip(orientations) {
        *q = take4(&edge.q, lane);
    }
    if kept == Kept::AngularVelocities {
        for (edge, omega) in block.edges.iter().zip(angular) {
            *omega = take3(&edge.omega, lane);
        }
    }
}
