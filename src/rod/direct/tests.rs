use super::{kernel, kernel::Stage, row::Row, width::Single, *};
use crate::{
    lanes::{Lane, put3, put4, take3},
    rod::{
        block::{EdgeLanes, NodeLanes},
        frame::parallel_transport,
        obstacle::Solid,
    },
};
use glam::Quat;

const DT: f32 = 1.0 / 360.0;

fn params() -> DirectParams {
    DirectParams { dt: DT, gravity: Vec3::NEG_Y * 9.8, damping: 0.003, limiter_steps: 6, skin: 0.0 }
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

/// One substep, with what the tick gathers before it.
fn substep(block: &mut BlockLanes, bending_length: f32, obstacles: &[Obstacle]) {
    let params = params();
    for (i, node) in block.nodes.iter_mut().enumerate() {
        node.w = [if i == 0 { 0.0 } else { 1.0 }; LANES];
        node.v[1] = node.v[1].map(|v| v + params.gravity.y * params.dt);
    }
    block.nodes[0].from = block.nodes[0].p;
    block.root_from = block.root;
    block.edges.iter_mut().for_each(|edge| edge.k = [1.0; LANES]);
    weigh(Level::new(), block, bending_length, DT);
    step(Level::new(), block, &params, obstacles);
}

fn wavy(lane: usize, i: usize) -> Vec3 {
    let (s, phase) = (i as f32 * 0.012, lane as f32 * 0.4);
    Vec3::new(s, 0.01 * (60.0 * s + phase).sin(), 0.01 * (60.0 * s + 2.0 * phase).cos())
}

fn bits(block: &BlockLanes, lane: usize) -> Vec<[u32; 3]> {
    block.nodes.iter().map(|n| take3(&n.p, lane).to_array().map(f32::to_bits)).collect()
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

#[test]
fn lanes_agree_with_a_strand_of_f64_alone() {
    let mut block = strands(14, wavy);
    substep(&mut block, 0.08, &[]);
    // From there on, without limiter, in both.
    let (lane, w) = (3, Single::<f64>::default());
    let wide = |cell: &Lane| f64::from(cell[lane]);
    let mut nodes: Vec<NodeLanes<f64>> = (block.nodes.iter())
        .map(|n| NodeLanes {
            p: n.p.each_ref().map(wide),
            from: n.p.each_ref().map(wide),
            v: n.v.each_ref().map(wide),
            w: wide(&n.w),
            mass: wide(&n.mass),
            ..Default::default()
        })
        .collect();
    let mut edges: Vec<EdgeLanes<f64>> = (block.edges.iter())
        .map(|e| EdgeLanes {
            q: e.q.each_ref().map(wide),
            rest: e.rest.each_ref().map(wide),
            l: wide(&e.l),
            k: wide(&e.k),
            axial: wide(&e.axial),
            tension: wide(&e.tension),
            ..Default::default()
        })
        .collect();
    let (theta, dt) = (f64::from(THETA), f64::from(DT));
    for node in &mut nodes[1..] {
        for axis in 0..3 {
            node.p[axis] += theta * dt * node.v[axis];
        }
    }
    let stage = Stage {
        theta,
        ahead: theta * dt,
        beyond: 1.0 / theta,
        root_turn: w.zero3(),
        gravity: V3::new(0.0, -9.8, 0.0),
        damping: 0.003 - (2.0 * theta - 1.0) * dt,
        second: false,
        again: 1.0,
        twice: 0.0,
    };
    let mut rows = vec![Row::default(); edges.len()];
    let root = block.root.each_ref().map(wide);
    kernel::down::<_, false>(w, &nodes, &mut edges, &mut rows, &root, &stage);
    kernel::up::<_, false>(w, &mut nodes, &mut edges, &rows, &stage);
    let sum = kernel::finish(w, &mut nodes, &mut edges, &mut rows, &root, DT, &stage);
    kernel::untwist(w, &mut edges, &rows);
    assert_eq!(sum, 0.0);

    let before = block.nodes.clone();
    let gravity = params();
    block.nodes.iter_mut().for_each(|n| n.v[1] = n.v[1].map(|v| v + gravity.gravity.y * DT));
    step(Level::new(), &mut block, &DirectParams { limiter_steps: 0, ..gravity }, &[]);
    for (i, (node, alone)) in block.nodes.iter().zip(&nodes).enumerate() {
        let alone = Vec3::from_array(alone.p.map(|x| x as f32));
        let moved = take3(&before[i].p, lane).distance(alone);
        let off = take3(&node.p, lane).distance(alone);
        assert!(off < 3e-7 + 1e-3 * moved, "node {i}: {off} of {moved}");
    }
    for (i, (edge, alone)) in block.edges.iter().zip(&edges).enumerate() {
        let q = crate::lanes::take4(&edge.q, lane);
        let alone = Quat::from_array(alone.q.map(|x| x as f32));
        assert!(q.angle_between(alone) < 3e-3, "edge {i}: {}", q.angle_between(alone));
    }
}

#[test]
fn half_blocks_do_to_the_bit_what_whole_blocks_do() {
    let start = strands(9, wavy);
    let mut whole = start.clone();
    substep(&mut whole, 0.1, &[]);
    let mut halves = whole.clone();
    dispatch!(Level::new(), simd => {
        let w = Whole(simd);
        let stage = stage(w, &whole, &params());
        let BlockLanes { nodes, edges, rows, root, .. } = &mut whole;
        kernel::down::<_, true>(w, nodes, edges, rows, root, &stage);
        kernel::up::<_, true>(w, nodes, edges, rows, &stage);
        kernel::finish(w, nodes, edges, rows, root, DT, &stage);
    });
    dispatch!(Level::new(), simd => {
        for index in 0..2 {
            let w = Half { simd, index };
            let stage = stage(w, &halves, &params());
            let BlockLanes { nodes, edges, rows, root, .. } = &mut halves;
            kernel::down::<_, true>(w, nodes, edges, rows, root, &stage);
            kernel::up::<_, true>(w, nodes, edges, rows, &stage);
            kernel::finish(w, nodes, edges, rows, root, DT, &stage);
        }
    });
    for lane in 0..LANES {
        assert_ne!(bits(&whole, lane), bits(&start, lane));
        assert_eq!(bits(&whole, lane), bits(&halves, lane), "lane {lane}");
    }
}

#[test]
fn what_a_strand_does_does_not_depend_on_those_beside_it() {
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
