//! Tests of mutual contact: it keeps momentum, and is the gradient of an energy.

use super::{tests::printed, *};
use glam::Quat;
use proptest::prelude::*;

const RADIUS: f32 = 0.05;

fn pushes(strands: &[Vec<Vec3>], contact: Penalty) -> Vec<Vec3> {
    let mut list = Neighbours::default();
    strands.iter().for_each(|nodes| list.add(nodes, 1));
    list.find_pushes(contact, Lookup::Now);
    list.pushes().collect()
}

/// The energy of equation 18 for each node and each edge of another strand, by halves (m²/s²).
fn energy(strands: &[Vec<Vec3>], contact: Penalty) -> f32 {
    let reach = contact.reach;
    let mut sum = 0.0;
    for (own, nodes) in strands.iter().enumerate() {
        for p in &nodes[1..] {
            for (_, other) in strands.iter().enumerate().filter(|(s, _)| *s != own) {
                for j in 0..other.len() - 1 {
                    let edge = super::super::model::Edge::new(
                        other[j],
                        other[j + 1],
                        j + 2 == other.len(),
                    );
                    let Some(foot) = edge.foot(*p) else { continue };
                    let depth = (reach - p.distance(foot)).max(0.0);
                    sum += 0.25 * contact.strength * depth * depth / reach;
                }
            }
        }
    }
    sum
}

/// Strands that cross above each other in the middles of their edges.
fn crossing(raw: &[(f32, f32, f32)]) -> Vec<Vec<Vec3>> {
    let strand = |(k, (a, b, c)): (usize, &(f32, f32, f32))| {
        let turned = Quat::from_rotation_z(0.9 * k as f32 + 0.3 * a);
        let height = 0.03 * k as f32 + 0.02 * b;
        let along = |i: usize| Vec3::new(0.2 * i as f32 - 0.31 - 0.05 * c, 0.02 * c, height);
        (0..4).map(|i| turned * along(i)).collect()
    };
    raw.iter().enumerate().map(strand).collect()
}

proptest! {
    #[test]
    fn mutual_contact_keeps_momentum_and_is_the_gradient_of_an_energy(
        raw in proptest::collection::vec((0f32..1.0, 0f32..1.0, 0f32..1.0), 2..6),
    ) {
        let strands = crossing(&raw);
        let contact = Penalty { mutual: true, ..printed(RADIUS) };
        let found = pushes(&strands, contact);
        let largest = found.iter().map(|push| push.length()).fold(0.0, f32::max);
        let sum: Vec3 = found.iter().sum();
        prop_assert!(sum.length() <= 1e-5 * largest.max(1.0) * found.len() as f32, "{sum}");
        let slope = |s: usize, i: usize, axis: Vec3, step: f32| {
            let [ahead, back] = [step, -step].map(|by| {
                let mut moved = strands.clone();
                moved[s][i] += axis * by;
                energy(&moved, contact)
            });
            -(ahead - back) / (2.0 * step)
        };
        for (k, push) in found.iter().enumerate() {
            for (axis, push) in Vec3::AXES.into_iter().zip(push.to_array()) {
                let [near, far] = [5e-4, 1e-3].map(|step| slope(k / 4, k % 4, axis, step));
                // Where a foot goes over to another edge the energy has a step.
                let is_smooth = (near - far).abs() < 0.02 * largest;
                let off = (push - near).abs();
                prop_assert!(!is_smooth || off < 0.05 * largest + 0.05, "{k}: {push}, not {near}");
            }
        }
    }
}

#[test]
fn printed_contact_makes_momentum() {
    let strands = crossing(&[(0.2, 0.3, 0.4), (0.6, 0.1, 0.9)]);
    let sum: Vec3 = pushes(&strands, printed(RADIUS)).iter().sum();
    assert!(sum.length() > 0.1, "{sum}");
}
