//! The step of any hair: lanes against f64, and turned as a whole.

use super::*;
use proptest::{prelude::*, test_runner::RngSeed};

/// What an edge and the node at its end begin with.
#[derive(Clone, Debug)]
struct Piece {
    bend: [f32; 3],
    length: f32,
    rest: [f32; 3],
    velocity: [f32; 3],
    tension: f32,
    water: f32,
    support: Option<[f32; 3]>,
}

fn vector(most: f32) -> impl Strategy<Value = [f32; 3]> {
    [-most..most, -most..most, -most..most]
}

fn piece() -> impl Strategy<Value = Piece> {
    let (bend, rest, velocity) = (vector(0.5), vector(0.3), vector(0.5));
    let support = prop::option::weighted(0.2, vector(1.0));
    (bend, 2e-3..2e-2f32, rest, velocity, 0.0..20.0f32, 0.0..2.0f32, support).prop_map(
        |(bend, length, rest, velocity, tension, water, support)| Piece {
            bend,
            length,
            rest,
            velocity,
            tension,
            water,
            support,
        },
    )
}

#[derive(Clone, Debug)]
struct Shape {
    pieces: Vec<Piece>,
    /// Its decimal logarithm.
    bending_length: f32,
    damping: f64,
    dt: f32,
    theta: f32,
    root_turn: [f32; 3],
    held: Option<usize>,
}

fn shape() -> impl Strategy<Value = Shape> {
    let pieces = prop::collection::vec(piece(), 1..24);
    let dt = prop::sample::select(vec![1.0 / 360.0, 1.0 / 180.0, 1.0 / 60.0]);
    let theta = prop::sample::select(vec![THETA, 1.0]);
    let held = prop::option::weighted(0.2, 0..24usize);
    (pieces, -3.0..-0.5f32, 0.0..0.02f64, dt, theta, vector(0.02), held).prop_map(
        |(pieces, bending_length, damping, dt, theta, root_turn, held)| Shape {
            pieces,
            bending_length,
            damping,
            dt,
            theta,
            root_turn,
            held,
        },
    )
}

impl Shape {
    /// In each lane the same hair, curled and moving to another degree; every other takes two steps.
    fn strands(&self) -> Strands<Lane> {
        let degree = |lane: usize| (lane + 1) as f32 / LANES as f32;
        let mut block = strands(self.pieces.len(), |lane, i| {
            let (mut turn, mut p) = (Quat::IDENTITY, Vec3::ZERO);
            for piece in &self.pieces[..i] {
                turn = Quat::from_scaled_axis(Vec3::from(piece.bend) * degree(lane)) * turn;
                p += turn * Vec3::X * piece.length;
            }
            p
        });
        for lane in 0..LANES {
            let turn = Quat::from_scaled_axis(Vec3::from(self.root_turn) * degree(lane));
            let root = take4(&block.root, lane);
            put4(&mut block.root_from, lane, root);
            put4(&mut block.root, lane, (turn * root).normalize());
            for (i, piece) in self.pieces.iter().enumerate() {
                let edge = &mut block.edges[i];
                let rest = take4(&edge.rest, lane) * Quat::from_scaled_axis(piece.rest.into());
                put4(&mut edge.rest, lane, rest.normalize());
                edge.tension[lane] = piece.tension * degree(lane);
                let node = &mut block.nodes[i + 1];
                put3(&mut node.v, lane, Vec3::from(piece.velocity) * degree(lane));
                let support = piece.support.unwrap_or_default();
                put3(&mut node.rests_on, lane, Vec3::from(support).normalize_or_zero());
                node.w[lane] = 1.0 + piece.water;
                // Gravity, and winds and impulses of some kind.
                let [bend, rest] = [piece.bend, piece.rest].map(Vec3::from);
                put3(&mut node.push, lane, Vec3::NEG_Y * 9.8 + 5.0 * bend);
                put3(&mut node.kick, lane, 0.05 * rest * degree(lane));
            }
            block.twice[lane] = (lane % 2) as f32;
        }
        block.edges.iter_mut().for_each(|edge| edge.k = [1.0; LANES]);
        let held = self.held.map_or(0, |node| node.min(self.pieces.len()));
        for node in [0, held] {
            let node = &mut block.nodes[node];
            (node.w, node.from) = ([0.0; LANES], node.p);
            // Held nodes that move have the velocity that takes them there.
            for axis in 0..3 {
                for lane in 0..LANES {
                    node.p[axis][lane] += self.dt * node.v[axis][lane];
                }
            }
        }
        weigh(Level::new(), &mut block, 10f32.powf(self.bending_length), self.dt);
        Strands::of(&block, self.theta, self.dt)
    }

    fn step(&self) -> Step {
        Step { dt: self.dt, damping: self.damping, torsion: 0.46 }
    }
}

proptest! {
    // Hair of any shape amplifies rounding by any factor: the cases are always the same.
    #![proptest_config(ProptestConfig { rng_seed: RngSeed::Fixed(5), ..Default::default() })]

    #[test]
    fn lanes_agree_with_strands_of_f64_alone_whatever_the_hair(shape in shape()) {
        let (start, step) = (shape.strands(), shape.step());
        for twice in [false, true] {
            let (mut whole, mut halves) = (start.clone(), start.clone());
            prop_assert_eq!(whole.solve_lanes(twice, false, &step), [0.0; LANES]);
            prop_assert_eq!(halves.solve_lanes(twice, true, &step), [0.0; LANES]);
            let bits = |s: &Strands<Lane>| -> Vec<[u32; LANES]> {
                s.bits().into_iter().map(|lane| lane.map(f32::to_bits)).collect()
            };
            prop_assert_eq!(bits(&whole), bits(&halves), "half as wide");
            for lane in [0, 5, 10, 15] {
                let (w, mut alone) = (Single::<f64>::default(), start.alone(lane));
                let sum = if twice {
                    alone.solve::<_, true>(w, &step)
                } else {
                    alone.solve::<_, false>(w, &step)
                };
                prop_assert_eq!(sum, 0.0);
                let (off, turned) = alone.apart(&whole.alone(lane));
                let moved = alone.moved();
                prop_assert!(off < 3e-7 + 4e-2 * moved, "lane {lane}: {off} m of {moved}");
                prop_assert!(turned < 6e-2, "lane {lane}: frames {turned} rad apart");
            }
        }
    }

    #[test]
    fn hair_that_is_turned_as_a_whole_moves_the_same(
        shape in shape(),
        turn in vector(2.0),
    ) {
        let (start, step) = (shape.strands().alone(3), shape.step());
        let turn = DQuat::from_scaled_axis(Vec3::from(turn).as_dvec3());
        for twice in [false, true] {
            let w = Single::<f64>::default();
            let (mut here, mut there) = (start.clone(), start.turned(turn));
            for strand in [&mut here, &mut there] {
                if twice { strand.solve::<_, true>(w, &step) } else { strand.solve::<_, false>(w, &step) };
            }
            let (off, turned) = here.turned(turn).apart(&there);
            prop_assert!(off < 2e-6 && turned < 1e-4, "{off} m and {turned} rad apart");
        }
    }
}
