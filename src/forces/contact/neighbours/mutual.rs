//! Tests of mutual contact: it keeps momentum, is the gradient of an energy, and has no steps.

use super::{
    super::model::{Edge, penalty},
    tests::printed,
    *,
};
use glam::Quat;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

const RADIUS: f32 = 0.05;

/// Nodes of each strand.
const NODES: usize = 4;

fn contact() -> Penalty {
    Penalty { mutual: true, ..printed(RADIUS) }
}

fn pushes(strands: &[Vec<Vec3>], contact: Penalty) -> Vec<Vec3> {
    let mut list = Neighbours::default();
    strands.iter().for_each(|nodes| list.add(nodes, 1));
    list.find_pushes(contact, Lookup::Now);
    list.pushes().collect()
}

/// A node and an edge of another strand that touch.
struct Pair {
    /// The node, and the edge's start node.
    nodes: [usize; 2],
    /// From the edge to the node.
    off: Vec3,
    at: f32,
    part: f32,
}

fn pairs(strands: &[Vec<Vec3>], reach: f32) -> Vec<Pair> {
    let mut all = Vec::new();
    for (own, nodes) in strands.iter().enumerate() {
        for (i, p) in nodes.iter().enumerate().skip(1) {
            for (s, other) in strands.iter().enumerate().filter(|(s, _)| *s != own) {
                for j in 0..NODES - 1 {
                    let edge = Edge::new(other[j], other[j + 1], j + 2 == NODES);
                    let (foot, at, part) = edge.nearest(*p, reach, j == 0);
                    if p.distance(foot) < reach {
                        let nodes = [own * NODES + i, s * NODES + j];
                        all.push(Pair { nodes, off: *p - foot, at, part });
                    }
                }
            }
        }
    }
    all
}

/// What `find_pushes` does, from all pairs, without a limit.
fn brute(strands: &[Vec<Vec3>], contact: Penalty) -> Vec<Vec3> {
    let mut found = vec![Vec3::ZERO; strands.len() * NODES];
    for Pair { nodes: [node, edge], off, at, part } in pairs(strands, contact.reach) {
        let push = 0.5 * part * penalty(off.length(), contact.reach, contact.strength) * off;
        found[node] += push;
        found[edge] -= push * (1.0 - at);
        found[edge + 1] -= push * at;
    }
    found
}

/// The energy of equation 18 for each node and each edge of another strand, by halves (m²/s²).
fn energy(strands: &[Vec<Vec3>], contact: Penalty) -> f32 {
    let of_pair = |pair: Pair| pair.part * (contact.reach - pair.off.length()).powi(2);
    let sum: f32 = pairs(strands, contact.reach).into_iter().map(of_pair).sum();
    0.25 * contact.strength / contact.reach * sum
}

/// Strands that cross above each other: a node of every other one lies near the middle of an edge of the next.
fn crossing(random: &mut Xoshiro256PlusPlus, strands: usize) -> Vec<Vec<Vec3>> {
    let strand = |k: usize| {
        let [a, b, c] = core::array::from_fn(|_| random.random_range(0.0..1.0f32));
        let turned = Quat::from_rotation_z(0.9 * k as f32 + 0.3 * a);
        let height = 0.03 * k as f32 + 0.02 * b;
        let shift = if k.is_multiple_of(2) { 0.26 - 0.02 * c } else { 0.05 * c };
        let along = |i: usize| Vec3::new(0.6 * i as f32 - 0.9 + shift, 0.02 * c, height);
        (0..NODES).map(|i| turned * along(i)).collect()
    };
    (0..strands).map(strand).collect()
}

#[test]
fn mutual_contact_keeps_momentum_and_is_the_gradient_of_an_energy() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(1);
    let (mut checked, contact) = (0, contact());
    for case in 0..200 {
        let strands = crossing(&mut random, 2 + case % 4);
        let found = pushes(&strands, contact);
        let largest = found.iter().map(|push| push.length()).fold(0.0, f32::max);
        let sum: Vec3 = found.iter().sum();
        assert!(sum.length() <= 1e-5 * largest.max(1.0) * found.len() as f32, "{sum}");
        for (k, (found, expected)) in found.iter().zip(brute(&strands, contact)).enumerate() {
            assert!(found.distance(expected) < 1e-3, "{case}, {k}: {found}, not {expected}");
        }
        let pairs = pairs(&strands, contact.reach);
        for (k, push) in found.iter().enumerate().filter(|(_, push)| **push != Vec3::ZERO) {
            // Where a part changes, so does the energy; the push leaves that out.
            let is_of = |pair: &Pair| pair.nodes[0] == k || k.wrapping_sub(pair.nodes[1]) < 2;
            if pairs.iter().any(|pair| is_of(pair) && pair.part.fract() != 0.0) {
                continue;
            }
            for (axis, push) in Vec3::AXES.into_iter().zip(push.to_array()) {
                let [ahead, back] = [5e-4, -5e-4].map(|by| {
                    let mut moved = strands.clone();
                    moved[k / NODES][k % NODES] += axis * by;
                    energy(&moved, contact)
                });
                let slope = (back - ahead) / 1e-3;
                checked += 1;
                let off = (push - slope).abs();
                assert!(off < 0.05 * largest + 0.05, "{case}, {k}: {push}, not {slope}");
            }
        }
    }
    assert!(checked > 100, "only {checked} slopes");
}

#[test]
fn a_node_that_slides_along_a_bent_strand_feels_no_step() {
    let bent = |bend: f32| {
        vec![Vec3::ZERO, Vec3::X * 0.4, Vec3::new(0.8, bend, 0.0), Vec3::new(1.2, bend, 0.0)]
    };
    // The node slides past the bend, from the first edge to the second; its strand lies across.
    let seen = |bend: f32, along: f32, contact: Penalty| {
        let p = Vec3::new(along, 0.0, 0.6 * RADIUS);
        let own = (0..NODES).map(|i| p + Vec3::new(0.0, 0.1, 0.4) * (i as f32 - 1.0)).collect();
        pushes(&[own, bent(bend)], contact)[1]
    };
    for bend in [0.0, 0.2, -0.3] {
        let steps = |contact: Penalty| {
            let places = (0..2000).map(|i| seen(bend, 0.3 + 1e-4 * i as f32, contact));
            let pushes: Vec<Vec3> = places.collect();
            assert!(pushes.iter().any(|push| push.length() > 2.0));
            pushes.windows(2).map(|w| w[0].distance(w[1])).fold(0.0, f32::max)
        };
        let (mutual, one_sided) = (steps(contact()), steps(printed(RADIUS)));
        assert!(mutual < 0.25, "bent by {bend}: a step of {mutual} m/s²");
        assert!(one_sided > 5.0, "bent by {bend}: {one_sided} m/s²");
    }
}

#[test]
fn crowded_strands_are_not_thrown_past_each_other_in_a_step() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(2);
    for dt in [1e-3, 1.0 / 30.0, 0.1] {
        let contact = Penalty { dt, ..contact() };
        let near = |random: &mut Xoshiro256PlusPlus| random.random_range(-0.3..0.3) * RADIUS;
        let strands: Vec<Vec<Vec3>> = (0..12)
            .map(|_| {
                let aside = Vec3::new(near(&mut random), near(&mut random), near(&mut random));
                (0..NODES).map(|i| aside + Vec3::X * (0.2 * i as f32)).collect()
            })
            .collect();
        let found = pushes(&strands, contact);
        let sum: Vec3 = found.iter().sum();
        assert!(sum.length() < 1e-3, "{sum}");
        let farthest = found.iter().map(|push| push.length() * dt * dt).fold(0.0, f32::max);
        assert!(farthest <= STEEPEST * contact.reach, "{farthest} m in a step of {dt} s");
        let unlimited = brute(&strands, contact);
        assert_eq!(dt < 0.01, found[1].distance(unlimited[1]) < 1e-3, "{dt}");
    }
}

#[test]
fn printed_contact_makes_momentum() {
    let strands = crossing(&mut Xoshiro256PlusPlus::seed_from_u64(3), 2);
    let sum: Vec3 = pushes(&strands, printed(RADIUS)).iter().sum();
    assert!(sum.length() > 0.1, "{sum}");
}
