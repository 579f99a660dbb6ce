//! A scalar version of the projection: the same mathematics on one strand at a time, in the layout
//! that suits it best, without gather and scatter.

use bevy::math::{Quat, Vec3};
use bevy_keratin::{
    StretchProjection, Sweeps,
    base::lanes::{Quaternion, V3},
    prelude::*,
    solver::rod::constraint::{BendShares, EdgeWeights, StretchShares, bend_twist, stretch_shear},
};

#[derive(Clone)]
struct Node {
    p: V3<f32>,
    v: V3<f32>,
    w: f32,
}

#[derive(Clone)]
struct Edge {
    q: Quaternion<f32>,
    omega: V3<f32>,
    l: f32,
    wq: f32,
    rest: Quaternion<f32>,
    k: f32,
}

/// A strand with all that its projection reads.
#[derive(Clone)]
pub struct Twin {
    nodes: Vec<Node>,
    edges: Vec<Edge>,
    root: Quaternion<f32>,
    from: Vec<V3<f32>>,
    turned_from: Vec<Quaternion<f32>>,
    /// Values that all iterations of a substep share.
    shares: Vec<(StretchShares<f32>, BendShares<f32>)>,
}

fn v3(v: Vec3) -> V3<f32> {
    V3::new(v.x, v.y, v.z)
}

fn quaternion(q: Quat) -> Quaternion<f32> {
    Quaternion::new(v3(q.xyz()), q.w)
}

impl Twin {
    pub fn of(strand: &Strand) -> Self {
        let sweeps = Sweeps::default();
        let last = strand.nodes() - 1;
        let weight = |i: usize| if i == 0 { 0.0 } else { 1.0 + f32::from(u8::from(i == last)) };
        let still = V3::new(0.0, 0.0, 0.0);
        let nodes = strand.positions().iter().enumerate();
        let nodes = nodes.map(|(i, p)| Node { p: v3(*p), v: still, w: weight(i) }).collect();
        let edges = strand.rest_lengths().iter().enumerate().map(|(i, l)| Edge {
            q: quaternion(strand.orientations()[i]),
            omega: still,
            l: *l,
            wq: sweeps.rotational_weight(0.13, *l, *l),
            rest: quaternion(strand.darboux(i)),
            k: 0.01,
        });
        Self {
            nodes,
            edges: edges.collect(),
            root: quaternion(strand.root_frame()),
            from: vec![still; last + 1],
            turned_from: vec![quaternion(Quat::IDENTITY); last],
            shares: Vec::with_capacity(last),
        }
    }

    /// One substep: prediction, `iterations` sweeps, velocities.
    pub fn step(&mut self, dt: f32, iterations: u32) {
        for (node, from) in self.nodes.iter_mut().zip(&mut self.from) {
            *from = node.p;
            node.p = node.v.scale_add(dt, node.p);
        }
        for (edge, from) in self.edges.iter_mut().zip(&mut self.turned_from) {
            *from = edge.q;
            let turn = edge.q.after_vector(edge.omega);
            edge.q = edge.q.add_scaled(turn, 0.5 * dt).normalize();
        }
        self.weigh();
        for _ in 0..iterations {
            self.sweep();
        }
        let rate = 1.0 / dt;
        for (node, from) in self.nodes.iter_mut().zip(&self.from) {
            node.v = (node.p - *from).scale(rate);
        }
        for (edge, from) in self.edges.iter_mut().zip(&self.turned_from) {
            edge.q = edge.q.normalize();
            let change = edge.q.product(from.conjugate());
            let sign = if change.w < 0.0 { -2.0 } else { 2.0 };
            edge.omega = change.v.scale(sign * rate);
        }
    }

    fn weigh(&mut self) {
        self.shares.clear();
        let mut w_before = 0.0;
        for (e, nodes) in self.edges.iter().zip(self.nodes.windows(2)) {
            let weights = EdgeWeights { w1: nodes[0].w, w2: nodes[1].w, wq: e.wq, l: e.l };
            let stretch = StretchShares::new(StretchProjection::Split, weights);
            self.shares.push((stretch, BendShares::new(w_before, e.wq, e.k)));
            w_before = e.wq;
        }
    }

    fn sweep(&mut self) {
        let mut before = self.root;
        for i in 0..self.edges.len() {
            let (mut q, rest) = (self.edges[i].q, self.edges[i].rest);
            let (stretch, bend) = self.shares[i];
            let (d_before, d_q) = bend_twist(before, q, rest, bend);
            q = q.add_scaled(d_q, 1.0).renormalize();
            if i > 0 {
                self.edges[i - 1].q = before.add_scaled(d_before, 1.0).renormalize();
            }
            let (p1, p2) = (self.nodes[i].p, self.nodes[i + 1].p);
            let c = stretch_shear(StretchProjection::Split, p1, p2, q, stretch);
            self.nodes[i].p = p1 + c.p1;
            self.nodes[i + 1].p = p2 + c.p2;
            q = q.add_scaled(c.q, 1.0).renormalize();
            self.edges[i].q = q;
            before = q;
        }
    }
}
