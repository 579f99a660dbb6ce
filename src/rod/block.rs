//! A block: [`LANES`] strands of equal node count, side by side, through one substep.
//!
//! Layout: an array of nodes and an array of edges, each an array of lanes (AoSoA), so that a
//! constraint reads whole vectors and a strand's sequence runs down the array. A block of sixteen
//! nodes is about 43 kB, of which the iterations of a substep take turns on 18: they stay in the first
//! cache. The arrays are plain old data and may be handed to a compute shader as they are.
//!
//! Strands keep their own vectors, so that game code reads and writes them, and are gathered into lanes
//! and scattered back in each substep. At ten thousand strands of sixteen nodes that takes about as long
//! as three of five iterations: four strands by four numbers are turned at a time (`turn`), and their
//! memory is asked for (`prefetch`) while the block before is solved. Number by number and without
//! asking ahead it took longer than all five.

use super::{
    algebra::{Quaternion, V3},
    direct,
    lanes::LANES,
    obstacle::Obstacle,
    sweep::Shares,
    turn::{put_numbers, put_vectors, take_quaternions, take_vectors},
};
use crate::strand::{Burden, HeldNodes, Strand};
use fearless_simd::{Simd, f32x16, prelude::*};
use glam::{Quat, Vec3};

/// One number of each lane.
pub type Lane = [f32; LANES];

/// One node of every strand in the block.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct NodeLanes<C = Lane> {
    /// Position (m).
    pub p: [C; 3],
    /// Position at the start of the substep (m); for held nodes, where they come from.
    pub from: [C; 3],
    /// Velocity (m/s).
    pub v: [C; 3],
    /// Inverse mass, relative to a whole node's: 1, at the tip 2, held 0.
    pub w: C,
    /// Mass, relative to a whole node's. Direct method only.
    pub mass: C,
    /// Normal of the obstacle that the node rests on, or zero; written by the contact passes.
    pub rests_on: [C; 3],
}

/// One edge of every strand in the block, with the joint at its start.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct EdgeLanes<C = Lane> {
    /// Orientation, x y z w.
    pub q: [C; 4],
    /// Rest length (m).
    pub l: C,
    /// Rest shape Ω0 of the joint, a full quaternion.
    pub rest: [C; 4],
    /// Stiffness of the joint: per iteration, k′ of equation 12, for sweeps; B EI over its cell
    /// (N m, of hair of which a whole node weighs 1 kg) for the direct method.
    pub k: C,
    /// Orientation at the start of the substep. Sweeps only.
    pub from: [C; 4],
    /// Angular velocity (rad/s), in the frame of the positions. Sweeps only.
    pub omega: [C; 3],
    /// Inverse rotational mass w_q (1/m²). Sweeps only.
    pub wq: C,
    /// Stiffness against stretching EA/l (N/m, as `k`). Direct method only.
    pub axial: C,
    /// Tension that the last substep left (N, as `k`). Direct method only.
    pub tension: C,
}

/// A row of a tridiagonal system over a strand's edges, eliminated from the root on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Row {
    pub(crate) direction: [Lane; 3],
    pub(crate) upper: Lane,
    pub(crate) rhs: Lane,
}

/// [`LANES`] strands of equal node count. See the [module](self).
#[derive(Clone, Debug, Default)]
pub struct BlockLanes {
    /// Nodes, root first.
    pub nodes: Vec<NodeLanes>,
    /// Edges, root first.
    pub edges: Vec<EdgeLanes>,
    /// The scalp's frame q_{−1} of each strand.
    pub root: [Lane; 4],
    /// Zero for lanes whose state is finite, else not a number; written by [`step`](super::step::step).
    pub finite: Lane,
    /// 1 for lanes with a node that rests on an obstacle, else 0; written by the contact passes.
    pub(crate) touched: Lane,
    /// Whether any node moves so fast against an obstacle that it might pass through.
    pub(super) sweeps: bool,
    pub(crate) scratch: Vec<Row>,
    pub(super) shares: Vec<Shares>,
    pub(super) rows: Vec<direct::Row<Lane>>,
}

impl BlockLanes {
    /// A block for strands of `nodes` nodes, reusing what is allocated.
    pub fn resize(&mut self, nodes: usize) {
        self.nodes.resize(nodes, NodeLanes::default());
        self.edges.resize(nodes - 1, EdgeLanes::default());
        self.scratch.resize(nodes - 1, Row::default());
        self.shares.resize(nodes - 1, Shares::default());
        self.rows.resize(nodes - 1, direct::Row::default());
    }

    /// Puts strands' nodes and lengths into the lanes; held nodes with where they are to be and the
    /// velocity that takes them there. [`weigh`](super::step::weigh) has to follow: until then `w` is how many dry nodes
    /// a node weighs.
    pub(crate) fn gather_nodes(&mut self, from: &[Source<'_>; LANES], dt: f32) {
        for (quarter, four) in from.as_chunks::<4>().0.iter().enumerate() {
            let strands = four.map(|source| source.strand);
            let positions = strands.map(Strand::positions);
            put_vectors(&mut self.nodes, quarter, positions, |n| &mut n.p);
            put_vectors(&mut self.nodes, quarter, strands.map(Strand::velocities), |n| &mut n.v);
            put_numbers(&mut self.edges, quarter, strands.map(Strand::rest_lengths), |e| &mut e.l);
        }
        for node in &mut self.nodes {
            node.w = [1.0; LANES];
        }
        for (lane, Source { strand, burden, held }) in from.iter().enumerate() {
            for (node, load) in self.nodes.iter_mut().zip(&burden.mass) {
                node.w[lane] += load;
            }
            let hold = |node: &mut NodeLanes, from: Vec3, to: Vec3| {
                put3(&mut node.from, lane, from);
                put3(&mut node.p, lane, to);
                put3(&mut node.v, lane, (to - from) / dt);
                node.w[lane] = 0.0;
            };
            let positions = strand.positions();
            hold(&mut self.nodes[0], positions[0], positions[0]);
            let targets = held.iter().flat_map(|held| &held.targets);
            for ((node, from), target) in self.nodes.iter_mut().zip(positions).zip(targets) {
                if let Some(target) = target {
                    hold(node, *from, *target);
                }
            }
        }
    }

    /// Puts what became of the lanes back into the strands of `items`, and calls `lost` with those
    /// whose state is not finite any more.
    pub(crate) fn scatter<T>(
        &self,
        items: &mut [T],
        strand: impl Fn(&mut T) -> &mut Strand,
        mut lost: impl FnMut(&mut T),
    ) {
        for (quarter, four) in items.chunks_mut(4).enumerate() {
            let lanes = 4 * quarter..4 * quarter + four.len();
            match four {
                [a, b, c, d] if self.finite[lanes.clone()] == [0.0; 4] => {
                    self.scatter_four(quarter, [strand(a), strand(b), strand(c), strand(d)]);
                }
                four => {
                    for (lane, item) in lanes.zip(four) {
                        if self.finite[lane] == 0.0 {
                            self.scatter_one(lane, strand(item));
                        } else {
                            lost(item);
                        }
                    }
                }
            }
        }
    }

    fn scatter_four(&self, quarter: usize, strands: [&mut Strand; 4]) {
        let [a, b, c, d] = strands.map(|strand| {
            strand.stepped_well();
            strand.parts_mut()
        });
        take_vectors(&self.nodes, quarter, [a.0, b.0, c.0, d.0], |n| &n.p);
        take_vectors(&self.nodes, quarter, [a.1, b.1, c.1, d.1], |n| &n.v);
        take_quaternions(&self.edges, quarter, [a.2, b.2, c.2, d.2], |e| &e.q);
        take_vectors(&self.edges, quarter, [a.3, b.3, c.3, d.3], |e| &e.omega);
    }

    fn scatter_one(&self, lane: usize, strand: &mut Strand) {
        strand.stepped_well();
        let (positions, velocities, orientations, angular) = strand.parts_mut();
        for ((node, p), v) in self.nodes.iter().zip(positions).zip(velocities) {
            (*p, *v) = (take3(&node.p, lane), take3(&node.v, lane));
        }
        for ((edge, q), omega) in self.edges.iter().zip(orientations).zip(angular) {
            (*q, *omega) = (take4(&edge.q, lane), take3(&edge.omega, lane));
        }
    }

    /// The obstacles that any lane may touch in a step of `dt`.
    pub(crate) fn near(&self, obstacles: &[Obstacle], dt: f32, skin: f32) -> Vec<Obstacle> {
        if obstacles.is_empty() {
            return Vec::new();
        }
        let (low, high) = self.bounds(dt);
        // Nodes may be pulled beyond their prediction, never by more than an edge in a substep.
        let margin = skin + self.edges.iter().map(|e| e.l[0]).fold(0.0, f32::max);
        obstacles.iter().filter(|o| o.may_touch(low, high, margin)).copied().collect()
    }

    /// The box that holds every node of every lane, before and after prediction with `dt`.
    pub fn bounds(&self, dt: f32) -> (Vec3, Vec3) {
        let mut low = [[f32::INFINITY; LANES]; 3];
        let mut high = [[f32::NEG_INFINITY; LANES]; 3];
        for n in &self.nodes {
            for axis in 0..3 {
                let (p, v) = (&n.p[axis], &n.v[axis]);
                let (l, h) = (&mut low[axis], &mut high[axis]);
                for lane in 0..LANES {
                    let to = p[lane] + v[lane] * dt;
                    l[lane] = l[lane].min(p[lane]).min(to);
                    h[lane] = h[lane].max(p[lane]).max(to);
                }
            }
        }
        let over_lanes = |a: [Lane; 3], f: fn(f32, f32) -> f32| {
            Vec3::from(a.map(|lanes| lanes.into_iter().reduce(f).unwrap_or(f32::NAN)))
        };
        (over_lanes(low, f32::min), over_lanes(high, f32::max))
    }
}

/// What a lane is filled from.
#[derive(Clone, Copy)]
pub(crate) struct Source<'a> {
    pub(crate) strand: &'a Strand,
    pub(crate) burden: &'a Burden,
    pub(crate) held: Option<&'a HeldNodes>,
}

/// One of each lane; lanes that no item uses repeat the first.
pub(crate) fn in_lanes<'a, T, U>(items: &'a [T], of: impl Fn(&'a T) -> U) -> [U; LANES] {
    core::array::from_fn(|lane| of(items.get(lane).unwrap_or(&items[0])))
}

/// Writes a vector into one lane.
#[inline(always)]
pub fn put3(a: &mut [Lane; 3], lane: usize, v: Vec3) {
    a[0][lane] = v.x;
    a[1][lane] = v.y;
    a[2][lane] = v.z;
}

/// Writes a quaternion into one lane.
#[inline(always)]
pub fn put4(a: &mut [Lane; 4], lane: usize, q: Quat) {
    a[0][lane] = q.x;
    a[1][lane] = q.y;
    a[2][lane] = q.z;
    a[3][lane] = q.w;
}

/// Reads a vector from one lane.
#[inline(always)]
pub fn take3(a: &[Lane; 3], lane: usize) -> Vec3 {
    Vec3::new(a[0][lane], a[1][lane], a[2][lane])
}

/// Reads a quaternion from one lane.
#[inline(always)]
pub fn take4(a: &[Lane; 4], lane: usize) -> Quat {
    Quat::from_xyzw(a[0][lane], a[1][lane], a[2][lane], a[3][lane])
}

#[inline(always)]
pub(crate) fn load<S: Simd>(simd: S, a: &Lane) -> f32x16<S> {
    f32x16::load_array_ref(simd, a)
}

#[inline(always)]
pub(crate) fn load3<S: Simd>(simd: S, a: &[Lane; 3]) -> V3<f32x16<S>> {
    V3::new(load(simd, &a[0]), load(simd, &a[1]), load(simd, &a[2]))
}

#[inline(always)]
pub(crate) fn store3<S: Simd>(a: &mut [Lane; 3], v: V3<f32x16<S>>) {
    v.x.store_array(&mut a[0]);
    v.y.store_array(&mut a[1]);
    v.z.store_array(&mut a[2]);
}

#[inline(always)]
pub(crate) fn load4<S: Simd>(simd: S, a: &[Lane; 4]) -> Quaternion<f32x16<S>> {
    let v = V3::new(load(simd, &a[0]), load(simd, &a[1]), load(simd, &a[2]));
    Quaternion::new(v, load(simd, &a[3]))
}

#[inline(always)]
pub(crate) fn store4<S: Simd>(a: &mut [Lane; 4], q: Quaternion<f32x16<S>>) {
    q.v.x.store_array(&mut a[0]);
    q.v.y.store_array(&mut a[1]);
    q.v.z.store_array(&mut a[2]);
    q.w.store_array(&mut a[3]);
}

impl NodeLanes {
    #[inline(always)]
    pub(crate) fn position<S: Simd>(&self, simd: S) -> V3<f32x16<S>> {
        load3(simd, &self.p)
    }

    #[inline(always)]
    pub(super) fn support<S: Simd>(&self, simd: S) -> V3<f32x16<S>> {
        load3(simd, &self.rests_on)
    }

    #[inline(always)]
    pub(super) fn set_support<S: Simd>(&mut self, normal: V3<f32x16<S>>) {
        store3(&mut self.rests_on, normal);
    }

    #[inline(always)]
    pub(crate) fn set_position<S: Simd>(&mut self, p: V3<f32x16<S>>) {
        store3(&mut self.p, p);
    }
}
