use super::{kernel, kernel::NewtonStage, row::DirectRow, width::Single, *};
use crate::{
    base::lanes::{Lane, put3, put4, simd_levels, take3, take4},
    solver::rod::{
        block::{EdgeLanes, NodeLanes},
        frame::parallel_transport,
        obstacle::Solid,
    },
};
use glam::{DQuat, DVec3, Quat, Vec3};

mod any_hair;
mod closed_forms;
mod golden;
mod torsion;

const DT: f32 = 1.0 / 360.0;
const GRAVITY: f32 = -9.8;

fn params() -> DirectParams {
    DirectParams { dt: DT, damping: 0.003, torsion: 0.46, limiter_steps: 6, clearance: 0.0 }
}

/// A strand of `edges` edges in each lane, as `place` says, at rest there.
fn strands(edges: usize, place: impl Fn(usize, usize) -> Vec3) -> BlockLanes {
    let mut block = BlockLanes::default();
    block.resize(edges + 1);
    for lane in 0..LANES {
        let points: Vec<Vec3> = (0..=edges).map(|i| place(lane, i)).collect();
        let frames = parallel_transport(&points, None);
        for (node, point) in block.nodes.iter_mut().zip(&points) {
            put3(&mut node.p, lane, *point);
        }
        for (i, (edge, frame)) in block.edges.iter_mut().zip(&frames).enumerate() {
            put4(&mut edge.q, lane, *frame);
            edge.l[lane] = points[i].distance(points[i + 1]);
            let before = if i == 0 { frames[0] } else { frames[i - 1] };
            put4(&mut edge.rest, lane, before.conjugate() * *frame);
        }
        put4(&mut block.root, lane, frames[0]);
    }
    block
}

/// One substep, including the preparation that the tick does.
fn substep(block: &mut BlockLanes, bending_length: f32, obstacles: &[Obstacle]) {
    prepare(block, bending_length);
    step(Level::new(), block, &params(), obstacles);
}

fn prepare(block: &mut BlockLanes, bending_length: f32) {
    prepare_for(block, bending_length, &params());
}

fn prepare_for(block: &mut BlockLanes, bending_length: f32, params: &DirectParams) {
    for (i, node) in block.nodes.iter_mut().enumerate() {
        node.w = [if i == 0 { 0.0 } else { 1.0 }; LANES];
        node.push[1] = [GRAVITY; LANES];
        node.v[1] = node.v[1].map(|v| v + GRAVITY * params.dt);
    }
    block.nodes[0].from = block.nodes[0].p;
    block.root_from = block.root;
    block.edges.iter_mut().for_each(|edge| edge.k = [1.0; LANES]);
    weigh(Level::new(), block, bending_length, params.dt);
}

fn wavy(lane: usize, i: usize) -> Vec3 {
    let (s, phase) = (i as f32 * 0.012, lane as f32 * 0.4);
    Vec3::new(s, 0.01 * (60.0 * s + phase).sin(), 0.01 * (60.0 * s + 2.0 * phase).cos())
}

fn bits(block: &BlockLanes, lane: usize) -> Vec<[u32; 3]> {
    block.nodes.iter().map(|n| take3(&n.p, lane).to_array().map(f32::to_bits)).collect()
}

#[test]
fn forces_are_distinguished_from_impulses_and_from_what_is_too_fast() {
    let mut block = strands(2, |_, i| Vec3::X * (0.01 * i as f32));
    let most = MAX_PUSH * DT;
    let before = Vec3::new(0.3, -0.2, 0.1);
    let cases = [(0.2, 0.1), (0.99, 0.0), (1.01, 0.5), (0.5, 1.01), (0.0, 3.0)];
    for (lane, (blown, other)) in cases.into_iter().enumerate() {
        for (i, node) in block.nodes.iter_mut().enumerate() {
            node.w[lane] = if i == 0 { 0.0 } else { 1.0 };
            put3(&mut node.kick, lane, before);
            put3(&mut node.push, lane, Vec3::Y * (blown * most));
            put3(&mut node.v, lane, before + Vec3::Y * (blown * most) + Vec3::Z * (other * most));
        }
    }
    let velocities: Vec<_> = block.nodes.iter().map(|n| n.v).collect();
    split_forces(Level::new(), &mut block, DT);
    for (lane, (blown, other)) in cases.into_iter().enumerate() {
        for (i, node) in block.nodes.iter().enumerate() {
            let counts = |share: f32| if i > 0 && share <= 1.0 { share * most } else { 0.0 };
            let [push, kick] = [take3(&node.push, lane), take3(&node.kick, lane)];
            assert!(push.distance(Vec3::Y * (counts(blown) / DT)) < 1e-3, "{lane} {i}: {push}");
            assert!(kick.distance(Vec3::Z * counts(other)) < 1e-5, "{lane} {i}: {kick}");
        }
    }
    assert_eq!(block.nodes.iter().map(|n| n.v).collect::<Vec<_>>(), velocities);
}

#[test]
fn small_sag_is_that_of_a_beam() {
    for edges in [8, 32] {
        let mut block = strands(edges, |_, i| Vec3::X * (0.1 * i as f32 / edges as f32));
        for _ in 0..1500 {
            substep(&mut block, 0.3, &[]);
            block.nodes.iter_mut().for_each(|n| n.v = n.v.map(|v| v.map(|v| 0.97 * v)));
        }
        // δ = L⁴ / (8 L_g³)
        let theory = 0.1_f32.powi(4) / (8.0 * 0.3_f32.powi(3));
        let sag = -take3(&block.nodes[edges].p, 5).y;
        assert!((sag / theory - 1.0).abs() < 0.02, "{edges}: {sag}, theory {theory}");
    }
}

/// Whether registers hold fewer than eight numbers.
#[inline(always)]
fn is_narrow<S: Simd>(_: S) -> bool {
    <S::f32s as SimdBase<S>>::LEN < 8
}

/// What the kernel is given: a block's strands, or one alone in f64.
#[derive(Clone)]
struct Strands<C> {
    nodes: Vec<NodeLanes<C>>,
    edges: Vec<EdgeLanes<C>>,
    root: [C; 4],
    root_from: [C; 4],
    root_between: [C; 4],
    theta: C,
    max_twist: C,
    twice: C,
}

#[derive(Clone, Copy)]
struct Step {
    dt: f32,
    damping: f64,
    torsion: f32,
}

impl<C: Copy + Default> Strands<C> {
    /// A substep but for contacts and lengths: with `TWICE` as where something touches or whips.
    /// Returns zero where all is finite. Inlined, so that it is compiled for the instruction set of its caller.
    #[inline(always)]
    fn solve<W: Width<Cell = C>, const TWICE: bool>(&mut self, w: W, step: &Step) -> W::Real {
        let dt = f64::from(step.dt);
        let theta = w.get(&self.theta);
        let own = (theta + theta - w.lit(1.0)) * w.lit(dt);
        let (from, to) = (w.get4(&self.root_from), w.get4(&self.root_between));
        let turn = to.product(from.conjugate());
        let minus = w.lit(-2.0);
        let two = <_ as Real>::select(turn.w.lt(w.lit(0.0)), minus, w.lit(2.0));
        let mut stage = NewtonStage {
            theta,
            ahead: theta * w.lit(dt),
            beyond: w.lit(1.0) / theta,
            root_turn: turn.v.scale(two),
            max_twist: w.get(&self.max_twist),
            damping: (w.lit(step.damping) - own).max(w.lit(0.0)),
            torsion: Torsion::new(theta, step.torsion),
            second: false,
            again: w.lit(1.0),
            twice: w.get(&self.twice),
        };
        let finish = stage;
        let mut rows = vec![DirectRow::default(); self.edges.len()];
        let Self { nodes, edges, root, root_between, .. } = self;
        if TWICE {
            let on_the_way = w.lit(0.0).lt(stage.twice);
            stage.beyond = <_ as Real>::select(on_the_way, w.lit(1.0), stage.beyond);
        }
        kernel::down::<_, TWICE>(w, nodes, edges, &mut rows, root_between, &stage);
        kernel::up::<_, TWICE>(w, nodes, edges, &rows, &stage);
        if TWICE {
            let again = stage.twice;
            stage = NewtonStage { second: true, again, ..finish };
            kernel::down::<_, TWICE>(w, nodes, edges, &mut rows, root_between, &stage);
            kernel::up::<_, TWICE>(w, nodes, edges, &rows, &stage);
        }
        let sum = kernel::finish(w, nodes, edges, &mut rows, root, step.dt, &finish);
        kernel::untwist(w, edges, &rows);
        sum
    }
}

impl Strands<Lane> {
    /// Of a block that has been weighed, its nodes where they are to start from; what the whole step
    /// does before the first Newton step.
    fn of(block: &BlockLanes, theta: f32, dt: f32) -> Self {
        let BlockLanes { mut nodes, edges, root, root_from, max_twist, twice, .. } = block.clone();
        let mut root_between = root;
        for lane in 0..LANES {
            let (from, to) = (take4(&root_from, lane), take4(&root, lane));
            put4(&mut root_between, lane, from.lerp(to, theta));
            for node in &mut nodes {
                if node.w[lane] > 0.0 {
                    let from = take3(&node.p, lane);
                    put3(&mut node.from, lane, from);
                    let v = take3(&node.v, lane) - take3(&node.kick, lane);
                    put3(&mut node.p, lane, from + theta * dt * v);
                }
            }
        }
        let theta = [theta; LANES];
        Self { nodes, edges, root, root_from, root_between, theta, max_twist, twice }
    }

    fn alone(&self, lane: usize) -> Strands<f64> {
        let wide = |cell: &Lane| f64::from(cell[lane]);
        let node = |n: &NodeLanes| NodeLanes {
            p: n.p.each_ref().map(wide),
            from: n.from.each_ref().map(wide),
            v: n.v.each_ref().map(wide),
            w: wide(&n.w),
            mass: wide(&n.mass),
            push: n.push.each_ref().map(wide),
            kick: n.kick.each_ref().map(wide),
            rests_on: n.rests_on.each_ref().map(wide),
            sticks: wide(&n.sticks),
            drag: wide(&n.drag),
            anchor: n.anchor.each_ref().map(wide),
            reaction: n.reaction.each_ref().map(wide),
        };
        let edge = |e: &EdgeLanes| EdgeLanes {
            q: e.q.each_ref().map(wide),
            rest: e.rest.each_ref().map(wide),
            l: wide(&e.l),
            k: wide(&e.k),
            axial: wide(&e.axial),
            tension: wide(&e.tension),
            ..Default::default()
        };
        Strands {
            nodes: self.nodes.iter().map(node).collect(),
            edges: self.edges.iter().map(edge).collect(),
            root: self.root.each_ref().map(wide),
            root_from: self.root_from.each_ref().map(wide),
            root_between: self.root_between.each_ref().map(wide),
            theta: wide(&self.theta),
            max_twist: wide(&self.max_twist),
            twice: wide(&self.twice),
        }
    }

    /// Solves all lanes, at once or by halves. Whole blocks need registers of eight at least: with fewer the solver never
    /// runs on them, and they would be the largest part of this program.
    fn solve_lanes(&mut self, twice: bool, halves: bool, step: &Step) -> Lane {
        let mut finite = [0.0; LANES];
        match twice {
            true => self.solve_with::<true>(halves, step, &mut finite),
            false => self.solve_with::<false>(halves, step, &mut finite),
        }
        finite
    }

    fn solve_with<const TWICE: bool>(&mut self, halves: bool, step: &Step, finite: &mut Lane) {
        dispatch!(Level::new(), simd => {
            if halves || is_narrow(simd) {
                for index in 0..2 {
                    let w = Half { simd, index };
                    let sum = self.solve::<_, TWICE>(w, step);
                    w.put(sum, finite);
                }
            } else {
                let w = Whole(simd);
                let sum = self.solve::<_, TWICE>(w, step);
                w.put(sum, finite);
            }
        });
    }

    fn bits(&self) -> Vec<Lane> {
        let nodes = self.nodes.iter().flat_map(|n| n.p.into_iter().chain(n.v));
        nodes.chain(self.edges.iter().flat_map(|e| e.q.into_iter().chain([e.tension]))).collect()
    }
}

impl Strands<f64> {
    /// The same strand, turned as a whole.
    fn turned(&self, turn: DQuat) -> Self {
        let vector = |v: [f64; 3]| (turn * DVec3::from_array(v)).to_array();
        let frame = |q: [f64; 4]| (turn * DQuat::from_array(q)).to_array();
        let mut turned = self.clone();
        for n in &mut turned.nodes {
            let NodeLanes { p, from, v, push, kick, rests_on, anchor, reaction, .. } = n;
            [p, from, v, push, kick, rests_on, anchor, reaction]
                .into_iter()
                .for_each(|v3| *v3 = vector(*v3));
        }
        turned.edges.iter_mut().for_each(|e| e.q = frame(e.q));
        let Self { root, root_from, root_between, .. } = &mut turned;
        [root, root_from, root_between].into_iter().for_each(|q| *q = frame(*q));
        turned
    }

    /// How far the nodes of two are apart at most (m), and their edges' frames (rad).
    fn apart(&self, other: &Self) -> (f64, f64) {
        let nodes = self.nodes.iter().zip(&other.nodes);
        let nodes = nodes.map(|(a, b)| DVec3::from(a.p).distance(b.p.into()));
        let edges = self.edges.iter().zip(&other.edges);
        let edges = edges.map(|(a, b)| {
            let [a, b] = [a.q, b.q].map(|q| DQuat::from_array(q).normalize());
            a.angle_between(b)
        });
        (nodes.fold(0.0, f64::max), edges.fold(0.0, f64::max))
    }

    /// How far nodes have come at most (m).
    fn moved(&self) -> f64 {
        let ways = self.nodes.iter().map(|n| DVec3::from(n.p).distance(n.from.into()));
        ways.fold(0.0, f64::max)
    }
}

#[test]
fn a_strand_does_not_depend_on_the_other_lanes() {
    let floor = Solid::HalfSpace { normal: Vec3::Y, point: Vec3::NEG_Y * 0.012 };
    let floor = [Obstacle { solid: floor, motion: None, friction: 0.4 }];
    let high = |lane: usize, i: usize| wavy(lane, i) + Vec3::Y * 0.01 * (lane % 3) as f32;
    let mut mixed = strands(12, high);
    for _ in 0..60 {
        substep(&mut mixed, 0.1, &floor);
    }
    for lane in [0, 1, 2, 7] {
        let mut alike = strands(12, |_, i| high(lane, i));
        for _ in 0..60 {
            substep(&mut alike, 0.1, &floor);
        }
        assert_eq!(bits(&mixed, lane), bits(&alike, 9), "lane {lane}");
    }
}

/// Of more twist than a strand can hold the Hessian is indefinite; fine strands that touch something got
/// infinite pivots from it.
#[test]
fn fine_strands_full_of_twist_stay_finite() {
    let floor = Solid::HalfSpace { normal: Vec3::Y, point: Vec3::NEG_Y * 0.003 };
    let floor = [Obstacle { solid: floor, motion: None, friction: 0.4 }];
    for bent in [0.1, 1.5] {
        let turn = |lane: usize, i: usize| {
            let phase = (37 * lane + 11 * i) as f32;
            let axis = Vec3::new(phase.sin(), (1.7 * phase).sin(), (2.3 * phase).sin());
            Quat::from_scaled_axis(bent * axis)
        };
        let mut block = strands(119, |lane, i| {
            let mut way = Vec3::X;
            (0..i).fold(Vec3::ZERO, |place, k| {
                way = turn(lane, k) * way;
                place + way * 5e-4
            })
        });
        for (i, edge) in block.edges.iter_mut().enumerate() {
            (0..LANES).for_each(|lane| put4(&mut edge.rest, lane, turn(lane, i + 5)));
        }
        let mut fastest = 0.0_f32;
        for _ in 0..40 {
            substep(&mut block, 0.13, &floor);
            assert_eq!(block.finite, [0.0; LANES], "bent by {bent}");
            let speeds = block.nodes.iter().flat_map(|n| n.v).flatten().map(f32::abs);
            fastest = speeds.fold(fastest, f32::max);
        }
        assert!(fastest < 30.0, "bent by {bent}: {fastest} m/s");
    }
}

#[test]
fn hair_on_the_floor_lies_still_and_holds_its_length() {
    let floor = Solid::HalfSpace { normal: Vec3::Y, point: Vec3::NEG_Y * 0.15 };
    let floor = [Obstacle { solid: floor, motion: None, friction: 0.5 }];
    for edges in [16, 48] {
        let mut block = strands(edges, |_, i| Vec3::X * (0.3 * i as f32 / edges as f32));
        let mut peak = 0.0_f32;
        for _ in 0..1080 {
            substep(&mut block, 0.13, &floor);
            block.nodes.iter_mut().for_each(|n| n.v = n.v.map(|v| v.map(|v| 0.99 * v)));
            for (i, edge) in block.edges.iter().enumerate() {
                let [a, b] = [i, i + 1].map(|i| take3(&block.nodes[i].p, 0));
                peak = peak.max((a.distance(b) / edge.l[0] - 1.0).abs());
                assert!(b.y > -0.15 - 1e-6, "{b}");
            }
        }
        let fastest = block.nodes.iter().map(|n| take3(&n.v, 0).length()).fold(0.0, f32::max);
        assert!(peak < 2e-3 && fastest < 2e-3, "{edges}: strain {peak}, speed {fastest}");
    }
}

/// AVX2 and AVX-512 agree bit for bit; SSE2 rounds a product before it is added, which they do not. A node that lands
/// then may do so a substep earlier or later, so velocities differ most.
#[test]
fn instruction_sets_agree() {
    let wall = Solid::HalfSpace { normal: Vec3::X, point: Vec3::X * -0.01 };
    let ball = Solid::Capsule { a: Vec3::ZERO, b: Vec3::Z * 0.02, radius: 0.012 };
    let obstacles = [wall, ball].map(|solid| Obstacle { solid, motion: None, friction: 0.3 });
    let runs = simd_levels().map(|(name, level)| {
        let mut block = strands(9, |lane, i| {
            let turn = 0.2 * lane as f32 + 0.1 * i as f32;
            Vec3::new(0.01 * i as f32, 0.01 + 0.004 * turn.sin(), 0.004 * turn.cos())
        });
        for _ in 0..40 {
            prepare(&mut block, 0.02);
            step(level, &mut block, &params(), &obstacles);
        }
        (name, block)
    });
    let runs: Vec<_> = runs.collect();
    let (best, first) = &runs[0];
    let numbers = |block: &BlockLanes| -> [Vec<f32>; 3] {
        let p = block.nodes.iter().flat_map(|n| n.p).flatten().collect();
        let v = block.nodes.iter().flat_map(|n| n.v).flatten().collect();
        [p, v, block.edges.iter().flat_map(|e| e.q).flatten().collect()]
    };
    let first = numbers(first);
    for (name, block) in &runs[1..] {
        let most: Vec<f32> = (first.iter().zip(numbers(block)))
            .map(|(a, b)| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max))
            .collect();
        println!("{name} is up to {most:?} (m, m/s, frame) from {best}");
        let allowed = if *name == "sse2" { [5e-4, 5e-2, 1e-2] } else { [0.0; 3] };
        assert!(most.iter().zip(allowed).all(|(most, allowed)| *most <= allowed), "{name}");
    }
}
