//! Tests of lists and sums, against all pairs one by one.

use super::{
    geometry::{Edge, see},
    kick::{Contact, Moving, Past, acts, kick, parts},
    state::*,
};
use crate::base::lanes::V3;
use glam::Vec3;
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

const CONTACT: Contact<f32> = Contact {
    reach: 2e-3,
    core: 7e-4,
    strength: 20.0,
    friction: 0.2,
    cohesion: 0.2,
    dt: 1.0 / 180.0,
};

type Strand = Vec<PairNode>;

fn add_all(pairs: &mut Pairs, strands: &[Strand]) {
    pairs.clear();
    for strand in strands {
        let places: Vec<Vec3> = strand.iter().map(|node| node.place).collect();
        pairs.add(&places, 1, strand.iter().copied());
    }
}

/// Strands that wander through a small room.
fn tangle(random: &mut Xoshiro256PlusPlus, count: usize, nodes: usize, speed: f32) -> Vec<Strand> {
    let vector = |random: &mut Xoshiro256PlusPlus, size: f32| {
        Vec3::from_array(core::array::from_fn(|_| random.random_range(-size..size)))
    };
    let strand = |random: &mut Xoshiro256PlusPlus| {
        let (mut place, mut way) = (vector(random, 0.012), vector(random, 0.006));
        let node = |k: usize, random: &mut Xoshiro256PlusPlus| {
            place += way;
            way += vector(random, 0.002);
            let velocity = vector(random, speed);
            PairNode { place, velocity, mass: if k == 0 { 0.0 } else { 0.006 } }
        };
        let mut node = node;
        (0..nodes).map(|k| node(k, random)).collect()
    };
    (0..count).map(|_| strand(random)).collect()
}

fn v3(v: Vec3) -> V3<f64> {
    V3::new(v.x.into(), v.y.into(), v.z.into())
}

/// What all pairs do to each node, in f64, NaN where f32 hardly knows the direction from edge to edge. `pasts` has that
/// of each pair that has one.
fn brute(
    strands: &[Strand],
    pasts: &mut std::collections::BTreeMap<[usize; 2], [f64; 5]>,
) -> Vec<[f64; 3]> {
    let nodes: Vec<PairNode> = strands.concat();
    let w: Vec<f64> =
        nodes.iter().map(|n| if n.mass > 0.0 { 1.0 / f64::from(n.mass) } else { 0.0 }).collect();
    let mut edges = Vec::new();
    let mut start = 0;
    for (s, strand) in strands.iter().enumerate() {
        edges.extend((0..strand.len() - 1).map(|k| (s, start + k)));
        start += strand.len();
    }
    let contact = CONTACT.splat(0.0f64);
    let mut acting = Vec::new();
    for (k, (s, a)) in edges.iter().enumerate() {
        for (other, b) in &edges[k + 1..] {
            let all = [*a, a + 1, *b, b + 1];
            let place = |n: usize| v3(nodes[n].place);
            let edge = |n: usize| Edge { start: place(n), end: place(n + 1) };
            let seen = see(edge(*a), edge(*b), 2e-3);
            let velocities = all.map(|n| v3(nodes[n].velocity));
            let known = pasts.entry([*a, *b]).or_insert([
                0.0,
                0.0,
                0.0,
                0.0,
                f64::from(u8::from(seen.distance >= contact.core)),
            ]);
            if seen.distance >= f64::from(FIRM_AGAIN) * contact.core {
                known[4] = 1.0;
            }
            let acts = acts(&seen, velocities, known[4], &contact);
            if s != other && acts > 0.0 {
                acting.push((all, seen, velocities, acts));
            }
        }
    }
    let mut acted = std::collections::BTreeSet::new();
    let mut counts = vec![0.0; nodes.len()];
    for (all, .., acts) in &acting {
        all.iter().for_each(|n| counts[*n] += acts);
    }
    let mut kicks = vec![[0.0; 3]; nodes.len()];
    for (all, seen, velocities, _) in acting {
        let [x, y, z, bearing, firm] = pasts[&[all[0], all[2]]];
        let mut past = Past { slip: V3::new(x, y, z), bearing, firm };
        let moving = Moving {
            velocities,
            w: all.map(|n| w[n]),
            counts: all.map(|n| f64::max(counts[n], 1.0)),
        };
        let push = kick(&seen, &moving, &mut past, &contact);
        pasts.insert([all[0], all[2]], [past.slip.x, past.slip.y, past.slip.z, past.bearing, firm]);
        acted.insert([all[0], all[2]]);
        for (k, part) in parts(seen.at).into_iter().enumerate() {
            let by = part * w[all[k]] * if k < 2 { 1.0 } else { -1.0 };
            let by = if seen.distance < 5e-5 { f64::NAN } else { by };
            let kick = &mut kicks[all[k]];
            *kick = [kick[0] + push.x * by, kick[1] + push.y * by, kick[2] + push.z * by];
        }
    }
    for (_, past) in pasts.iter_mut().filter(|(pair, _)| !acted.contains(*pair)) {
        past[..4].fill(0.0);
    }
    kicks
}

fn difference(kick: Vec3, expected: [f64; 3]) -> f64 {
    let off = v3(kick) - V3::new(expected[0], expected[1], expected[2]);
    off.dot(off).sqrt()
}

#[test]
fn pairs_do_what_all_edges_do_one_by_one_in_f64() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(5);
    for (count, nodes, speed) in [(40, 8, 0.3), (90, 5, 0.05), (33, 12, 0.8)] {
        let mut strands = tangle(&mut random, count, nodes, speed);
        let (mut pairs, mut pasts) = (Pairs::default(), Default::default());
        for step in 0..12 {
            add_all(&mut pairs, &strands);
            pairs.find(CONTACT);
            let expected = brute(&strands, &mut pasts);
            let size = |k: &[f64; 3]| k.iter().map(|x| x * x).sum::<f64>().sqrt();
            let largest = expected.iter().map(size).fold(0.0, f64::max);
            assert!(expected.iter().filter(|k| k[0].is_nan()).count() < expected.len() / 4);
            assert!(pairs.counts()[1] > 20, "{:?}", pairs.counts());
            let worst = pairs.kicks.iter().zip(&expected).map(|(k, e)| difference(*k, *e));
            let worst = worst.fold(0.0, f64::max);
            assert!(worst < 1e-3 * largest, "step {step}: {worst} of {largest} m/s");
            for strand in &mut strands {
                for node in strand {
                    node.place += 0.2 * node.velocity * CONTACT.dt;
                }
            }
        }
    }
}

#[test]
fn impulses_keep_momentum() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(6);
    let mut strands = tangle(&mut random, 60, 8, 0.5);
    strands.iter_mut().for_each(|strand| strand[0].mass = 0.003);
    let mut pairs = Pairs::default();
    add_all(&mut pairs, &strands);
    pairs.find(CONTACT);
    let nodes = strands.concat();
    let (mut sum, mut size) = (V3::new(0.0, 0.0, 0.0), 0.0);
    for (kick, node) in pairs.kicks.iter().zip(&nodes) {
        let impulse = v3(*kick).scale(node.mass.into());
        sum = sum + impulse;
        size += impulse.dot(impulse).sqrt();
    }
    assert!(size > 0.0 && sum.dot(sum).sqrt() < 1e-6 * size, "{sum:?} of {size}");
}

#[test]
fn what_a_strand_in_a_bed_feels_does_not_depend_on_its_segments() {
    // Seven strands side by side, and one that lies in the middle of the bed, in a slight angle.
    let strand = |n: usize, tilt: f32, y: f32, z: f32| -> Strand {
        let l = 0.12 / n as f32;
        let node = |k: usize| PairNode {
            place: Vec3::new(l * k as f32 - 0.06, y + tilt * (l * k as f32 - 0.06), z),
            mass: if k == 0 || k == n { 0.5 * l } else { l },
            ..PairNode::default()
        };
        (0..=n).map(node).collect()
    };
    for tilt in [0.0, 0.03, 0.3, 1.0] {
        let force = |n: usize| {
            let mut strands: Vec<Strand> =
                (-12..=12).map(|k| strand(n, 0.0, 1.7e-3 * k as f32, 0.0)).collect();
            strands.push(strand(n, tilt, 4e-4, 1.2e-3));
            let mut pairs = Pairs::default();
            add_all(&mut pairs, &strands);
            // So short a step that nothing gives way.
            pairs.find(Contact { dt: 1e-5, ..CONTACT });
            let last = strands.last().unwrap();
            let kicks = &pairs.kicks[25 * (n + 1)..];
            kicks.iter().zip(last).map(|(kick, node)| *kick * node.mass / 1e-5).sum::<Vec3>().z
        };
        let expected = force(12);
        assert!(expected > 0.1, "{expected}");
        for n in [6, 24, 48] {
            let off = force(n) / expected - 1.0;
            assert!(off.abs() < 0.05, "tilted by {tilt}, {n} segments: {off}");
        }
    }
}

#[test]
fn what_is_not_finite_stays_with_its_strand() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(7);
    let whole = tangle(&mut random, 40, 6, 0.3);
    for wrong in [f32::NAN, f32::INFINITY, 1e30] {
        for what in 0..3 {
            let mut strands = whole.clone();
            match what {
                0 => strands[3][2].place.y = wrong,
                1 => strands[3][2].velocity.y = wrong,
                _ => strands[3][2].mass = wrong,
            }
            let mut pairs = Pairs::default();
            for _ in 0..3 {
                add_all(&mut pairs, &strands);
                pairs.find(CONTACT);
                let others = pairs.kicks.iter().enumerate().filter(|(k, _)| k / 6 != 3);
                let mut all = 0.0;
                for (_, kick) in others {
                    assert!(kick.is_finite(), "{wrong} in {what}");
                    all += kick.length();
                }
                assert!(all > 0.0);
            }
        }
    }
}

#[test]
fn pairs_of_strands_that_meet_fast_are_found_before_they_meet() {
    for speed in [0.1f32, 0.5, 2.0, 5.0] {
        let strand = |along: Vec3, z: f32, v: f32| -> Strand {
            let node = |k: i32| PairNode {
                place: along * (0.01 * (k - 8) as f32) + Vec3::Z * z,
                velocity: Vec3::Z * v,
                mass: 0.01,
            };
            (0..16).map(node).collect()
        };
        let apart = 0.02f32;
        let mut strands =
            vec![strand(Vec3::X, 0.0, 0.5 * speed), strand(Vec3::Y, apart, -0.5 * speed)];
        let mut pairs = Pairs::default();
        let mut met = false;
        while !met {
            add_all(&mut pairs, &strands);
            pairs.find(CONTACT);
            let height = |s: &Strand| s.iter().map(|n| n.place.z).sum::<f32>() / 16.0;
            let left = height(&strands[1]) - height(&strands[0]);
            let meets = left - speed * CONTACT.dt < CONTACT.core;
            assert!(!meets || pairs.counts()[1] > 0, "{speed} m/s: unseen {left} m away");
            met = meets;
            for node in strands.iter_mut().flatten() {
                node.place += node.velocity * CONTACT.dt;
            }
        }
        let down = pairs.kicks[24].z;
        assert!(down > 0.0, "{speed} m/s: {down}");
    }
}

#[test]
fn no_pair_is_left_out_where_some_strands_move_fast_and_others_rest() {
    let mut random = Xoshiro256PlusPlus::seed_from_u64(9);
    let mut strands = tangle(&mut random, 400, 8, 1.0);
    for (k, strand) in strands.iter_mut().enumerate() {
        // Many at rest in a wide room, and a few fast ones in a corner of it.
        let fast = k < 12;
        let at = Vec3::X * if fast { -0.5 } else { 0.002 * k as f32 };
        for node in strand {
            node.place += at;
            node.velocity *= if fast { 2.0 } else { 0.0 };
        }
    }
    let mut pairs = Pairs::default();
    add_all(&mut pairs, &strands);
    pairs.find(CONTACT);
    let margins = pairs.lists.regions.of(0).iter().map(|cell| pairs.lists.margins[*cell as usize]);
    let wide = margins.fold(0.0, f32::max);
    let half_box = pairs.lists.half_box;
    assert!(wide > half_box, "{wide} m is no more than a box of {half_box}");
    let (mut listed, mut far) = (0, 0);
    let nodes: Vec<PairNode> = strands.concat();
    let edge = |n: usize| Edge { start: v3(nodes[n].place), end: v3(nodes[n + 1].place) };
    let part = &pairs.parts[0];
    for a in (0..96usize).filter(|a| a % 8 != 7) {
        let own = part.starts[a] as usize..part.starts[a + 1] as usize;
        for b in (a / 8 * 8 + 8..96).filter(|b| b % 8 != 7) {
            let distance = see(edge(a), edge(b), 2e-3).distance;
            let is_listed = part.seconds[own.clone()].contains(&(b as u32));
            listed += usize::from(is_listed);
            far += usize::from(is_listed && distance > 0.012);
            let within = f64::from(CONTACT.reach + wide);
            assert!(is_listed || distance > 0.999 * within, "{a} and {b}, {distance} m apart");
        }
    }
    assert!(listed > 500 && far > 50, "{listed} {far}");
}

#[test]
fn an_edge_has_no_more_pairs_than_it_may_and_the_nearest() {
    // Two thousand strands in one place: each edge has all edges of those after it.
    let strand = |k: i32| -> Strand {
        let z = 5e-7 * k as f32;
        let node = |i: i32| PairNode {
            place: Vec3::new(0.01 * i as f32, 0.0, z),
            mass: if i == 0 { 0.0 } else { 0.01 },
            ..PairNode::default()
        };
        (0..2).map(node).collect()
    };
    let mut pairs = Pairs::default();
    for (count, crowded) in [(900, false), (2000, true)] {
        add_all(&mut pairs, &(0..count).map(strand).collect::<Vec<_>>());
        pairs.find(CONTACT);
        assert_eq!(pairs.is_crowded(), crowded, "{count}");
        let first = &pairs.parts[0];
        let own = &first.seconds[..first.starts[1] as usize];
        assert_eq!(own.len(), (count as usize - 1).min(1024));
        // Edge k starts at node 2k.
        assert!(own.iter().zip(1..).all(|(second, k)| *second == 2 * k));
        assert!(pairs.kicks.iter().all(|kick| kick.is_finite()));
    }
}
