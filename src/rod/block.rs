//! A block: [`LANES`] strands of equal node count, side by side, through one substep.
//!
//! Layout: an array of nodes and an array of edges, each an array of lanes (AoSoA), so that a
//! constraint reads whole vectors and a strand's sequence runs down the array. A block of sixteen
//! nodes is about 22 kB: every iteration of a substep stays in the first cache. The arrays are
//! plain old data and may be handed to a compute shader as they are.
//!
//! Strands keep their own vectors, so that game code reads and writes them, and are gathered into lanes
//! and scattered back in each substep. With ten thousand strands that takes as long as solving: it is
//! the memory that takes the time. Turning four strands at a time in registers, with and without
//! copying them first, was no faster (10.5 to 11.6 against 9.7 to 10.4 ns per segment and iteration at
//! 10,000 strands), and reading four strands in step much slower (16 ns).
//!
//! Order within a substep (\[B\] §2 with model notes): predict positions and orientations, project
//! stretch–shear, bend–twist and contacts `iterations` times from root to tip, limit lengths, a
//! last contact pass, then velocities from the change.

use super::{
    algebra::{Quaternion, V3},
    constraint::{
        BendShares, EdgeWeights, StretchProjection, StretchShares, bend_twist, stretch_shear,
    },
    lanes::{LANES, Real},
    limiter::limit_lengths,
    obstacle::{Obstacle, hold_back, push_out},
    stiffness::Stiffness,
    turn::{put_numbers, put_vectors, take_quaternions, take_vectors},
};
use crate::strand::{Burden, HeldNodes, Strand};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};
use glam::{Quat, Vec3};

/// Passes that a limiter step takes for strands that touch something.
const PASSES_IN_TOUCH: u32 = 3;

/// How many iterations run down a strand one behind the other, at most.
const ABREAST: usize = 8;

/// One number of each lane.
pub type Lane = [f32; LANES];

/// One node of every strand in the block.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct NodeLanes {
    /// Position (m).
    pub p: [Lane; 3],
    /// Position at the start of the substep (m); for held nodes, where they come from.
    pub from: [Lane; 3],
    /// Velocity (m/s).
    pub v: [Lane; 3],
    /// Inverse mass, relative to a whole node's: 1, at the tip 2, held 0.
    pub w: Lane,
    /// Normal of the obstacle that the node rests on, or zero; written by the contact passes.
    pub rests_on: [Lane; 3],
}

/// One edge of every strand in the block, with the joint at its start.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct EdgeLanes {
    /// Orientation, x y z w.
    pub q: [Lane; 4],
    /// Orientation at the start of the substep.
    pub from: [Lane; 4],
    /// Angular velocity (rad/s), in the frame of the positions.
    pub omega: [Lane; 3],
    /// Rest length (m).
    pub l: Lane,
    /// Inverse rotational mass w_q (1/m²).
    pub wq: Lane,
    /// Rest shape Ω0 of the joint, a full quaternion.
    pub rest: [Lane; 4],
    /// Stiffness per iteration k′ of the joint (equation 12).
    pub k: Lane,
}

/// What the iterations of a substep need of an edge's weights and of its joint's stiffness.
#[derive(Clone, Copy, Debug, Default)]
struct Shares {
    inverse_length: Lane,
    along: Lane,
    across: Lane,
    start: Lane,
    end: Lane,
    turn: Lane,
    first: Lane,
    second: Lane,
}

impl Shares {
    #[inline(always)]
    fn stretch<S: Simd>(&self, simd: S) -> StretchShares<f32x16<S>> {
        StretchShares {
            inverse_length: load(simd, &self.inverse_length),
            along: load(simd, &self.along),
            across: load(simd, &self.across),
            start: load(simd, &self.start),
            end: load(simd, &self.end),
            turn: load(simd, &self.turn),
        }
    }

    #[inline(always)]
    fn bend<S: Simd>(&self, simd: S) -> BendShares<f32x16<S>> {
        BendShares { first: load(simd, &self.first), second: load(simd, &self.second) }
    }
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
    /// Zero for lanes whose state is finite, else not a number; written by [`step`].
    pub finite: Lane,
    /// 1 for lanes with a node that rests on an obstacle, else 0; written by the contact passes.
    pub(crate) touched: Lane,
    /// Whether any node moves so fast against an obstacle that it might pass through.
    sweeps: bool,
    pub(crate) scratch: Vec<Row>,
    shares: Vec<Shares>,
}

/// What a substep does to a block.
#[derive(Clone, Copy, Debug)]
pub struct StepParams {
    /// Substep (s).
    pub dt: f32,
    /// Iterations of the projection.
    pub iterations: u32,
    /// How stretch–shear is projected.
    pub projection: StretchProjection,
    /// Newton steps of the length limiter; 0 turns it off.
    pub limiter_steps: u32,
    /// Damping of neighbouring edges' relative angular velocity (1/s).
    pub internal_damping: f32,
    /// Distance that nodes keep from obstacles (m).
    pub skin: f32,
}

impl BlockLanes {
    /// A block for strands of `nodes` nodes, reusing what is allocated.
    pub fn resize(&mut self, nodes: usize) {
        self.nodes.resize(nodes, NodeLanes::default());
        self.edges.resize(nodes - 1, EdgeLanes::default());
        self.scratch.resize(nodes - 1, Row::default());
        self.shares.resize(nodes - 1, Shares::default());
    }

    /// Puts strands' nodes and lengths into the lanes; held nodes with where they are to be and the
    /// velocity that takes them there. [`weigh`] has to follow: until then `w` is how many dry nodes
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

/// Sorts strands so that those of one hair with equal node count, the `key`, stand together, and
/// divides them into blocks. Lanes do not see each other, so how strands are grouped changes no bit
/// of the result.
pub(crate) fn blocks_of<T>(strands: &mut [T], key: impl Fn(&T) -> (usize, usize)) -> Vec<&mut [T]> {
    if !strands.is_sorted_by_key(&key) {
        strands.sort_by_key(&key);
    }
    strands
        .chunk_by_mut(|a, b| key(a) == key(b))
        .flat_map(|alike| alike.chunks_mut(LANES))
        .collect()
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

/// Takes the block through one substep, on the instruction set that the machine has.
pub fn step(level: Level, block: &mut BlockLanes, params: &StepParams, obstacles: &[Obstacle]) {
    dispatch!(level, simd => step_simd(simd, block, params, obstacles));
}

#[inline(always)]
fn step_simd<S: Simd>(simd: S, b: &mut BlockLanes, params: &StepParams, obstacles: &[Obstacle]) {
    predict_nodes(simd, b, params.dt, params.skin, obstacles);
    predict_edges(simd, b, params.dt);
    // The projection is chosen outside the loops, so that each has straight code inside.
    match params.projection {
        StretchProjection::Split => project::<S, 0>(simd, b, params, obstacles),
        StretchProjection::Coupled => project::<S, 1>(simd, b, params, obstacles),
        StretchProjection::Printed => project::<S, 2>(simd, b, params, obstacles),
    }
    for _ in 0..params.limiter_steps {
        limit_lengths(simd, b, false);
        contacts(simd, b, params.skin, obstacles);
        // Pressed on something, hair has to fold: the more it has, the better the next pass can.
        for _ in 1..PASSES_IN_TOUCH {
            if b.touched != [0.0; LANES] {
                limit_lengths(simd, b, true);
                contacts(simd, b, params.skin, obstacles);
            }
        }
    }
    velocities(simd, b, params);
}

/// Makes inverse masses of the masses that were gathered, which are in those of dry nodes, and, given
/// the strands' stiffness, inverse rotational masses of the edges.
pub(crate) fn weigh(level: Level, block: &mut BlockLanes, stiffness: Option<&Stiffness>) {
    dispatch!(level, simd => weigh_simd(simd, block, stiffness));
}

#[inline(always)]
fn weigh_simd<S: Simd>(simd: S, b: &mut BlockLanes, stiffness: Option<&Stiffness>) {
    let (zero, two) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 2.0));
    let mut sum = zero;
    for e in &b.edges {
        sum += load(simd, &e.l);
    }
    let mean = sum / f32x16::splat(simd, b.edges.len() as f32);
    let mut before = zero;
    for (i, n) in b.nodes.iter_mut().enumerate() {
        let mut after = zero;
        if let Some(e) = b.edges.get_mut(i) {
            after = load(simd, &e.l);
            if let Some(stiffness) = stiffness {
                stiffness.rotational_weight(after, mean).store_array(&mut e.wq);
            }
        }
        // Half a cell on either side, so the tip carries half a mass.
        let mass = load(simd, &n.w);
        let held = Real::lt(mass, f32x16::splat(simd, 1e-12));
        let w = two * mean / ((before + after) * mass);
        Real::select(held, zero, w).store_array(&mut n.w);
        before = after;
    }
}

/// v is already that of the forces; p* = p + v dt.
#[inline(always)]
pub(crate) fn predict_nodes<S: Simd>(
    simd: S,
    b: &mut BlockLanes,
    dt: f32,
    skin: f32,
    obstacles: &[Obstacle],
) {
    let dt = f32x16::splat(simd, dt);
    let zero = f32x16::splat(simd, 0.0);
    b.sweeps = false;
    for n in &mut b.nodes {
        let w = load(simd, &n.w);
        let held = Real::lt(w, f32x16::splat(simd, 1e-12));
        let p = load3(simd, &n.p);
        // Nodes that begin inside an obstacle are set on its surface before the step, so that
        // getting them out gives them no velocity. What comes at them gives them some.
        let mut from = p;
        for o in obstacles {
            let start = o.taken_along(from);
            if let Some((out, _)) = push_out(o, start, start, zero, skin, true) {
                from = V3::select(held, from, from + (out - start));
            }
        }
        let v = load3(simd, &n.v);
        // Held nodes carry where they come from in `from` and where they are to be in `p`.
        let came_from = V3::select(held, load3(simd, &n.from), from);
        store3(&mut n.from, came_from);
        let mut to = v.scale_add(dt, from);
        for o in obstacles {
            if let Some((before, _)) = hold_back(o, o.taken_along(from), to, skin) {
                (to, b.sweeps) = (before, true);
            }
        }
        store3(&mut n.p, V3::select(held, p, to));
    }
}

/// Orientations from angular velocity likewise: without, a strand is overdamped and never settles.
#[inline(always)]
fn predict_edges<S: Simd>(simd: S, b: &mut BlockLanes, dt: f32) {
    let half = f32x16::splat(simd, 0.5 * dt);
    for e in &mut b.edges {
        let q = load4(simd, &e.q);
        let turn = q.after_vector(load3(simd, &e.omega));
        store4(&mut e.from, q);
        store4(&mut e.q, q.add_scaled(turn, half).normalize());
    }
}

/// How stretch–shear is projected, by the number that the sweeps are compiled for.
const PROJECTIONS: [StretchProjection; 3] =
    [StretchProjection::Split, StretchProjection::Coupled, StretchProjection::Printed];

/// All iterations. [`ABREAST`] of them run down the strand one behind the other: what each does, and
/// so every bit, is the same as if it began when the one before had ended, but a processor finds work
/// while it waits for the results of one.
#[inline(always)]
fn project<S: Simd, const P: usize>(
    simd: S,
    b: &mut BlockLanes,
    params: &StepParams,
    obstacles: &[Obstacle],
) {
    share::<S, P>(simd, b);
    let mut left = params.iterations as usize;
    while left > 0 {
        let abreast = left.div_ceil(left.div_ceil(ABREAST));
        sweeps::<S, P>(simd, b, abreast, params.skin, obstacles);
        left -= abreast;
    }
    b.touched = [0.0; LANES];
    if !obstacles.is_empty() {
        let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
        let mut touched = zero;
        for n in &b.nodes {
            let normal = n.support(simd);
            touched = Real::select(Real::lt(zero, normal.dot(normal)), one, touched);
        }
        touched.store_array(&mut b.touched);
    }
}

/// What stays the same in all iterations.
#[inline(always)]
fn share<S: Simd, const P: usize>(simd: S, b: &mut BlockLanes) {
    let mut w_before = f32x16::splat(simd, 0.0);
    let mut w1 = load(simd, &b.nodes[0].w);
    for ((e, node), shares) in b.edges.iter().zip(&b.nodes[1..]).zip(&mut b.shares) {
        let (wq, l, w2) = (load(simd, &e.wq), load(simd, &e.l), load(simd, &node.w));
        let s = StretchShares::new(PROJECTIONS[P], EdgeWeights { w1, w2, wq, l });
        let bend = BendShares::new(w_before, wq, load(simd, &e.k));
        s.inverse_length.store_array(&mut shares.inverse_length);
        s.along.store_array(&mut shares.along);
        s.across.store_array(&mut shares.across);
        s.start.store_array(&mut shares.start);
        s.end.store_array(&mut shares.end);
        s.turn.store_array(&mut shares.turn);
        bend.first.store_array(&mut shares.first);
        bend.second.store_array(&mut shares.second);
        (w_before, w1) = (wq, w2);
    }
}

/// What a sweep carries in registers from one edge to the next.
#[derive(Clone, Copy)]
struct Carried<S: Simd> {
    /// The edge before, which has yet to turn for the joint that follows.
    before: Quaternion<f32x16<S>>,
    /// The node between them.
    p1: V3<f32x16<S>>,
}

/// `abreast` Gauss–Seidel sweeps from root to tip: at each edge its bend–twist joint, then its
/// stretch–shear, then the edge's start node against obstacles, which nothing else in this sweep
/// moves. A sweep may follow two edges behind another: all that it reads there is as that leaves it.
#[inline(always)]
fn sweeps<S: Simd, const P: usize>(
    simd: S,
    b: &mut BlockLanes,
    abreast: usize,
    skin: f32,
    obstacles: &[Obstacle],
) {
    let edges = b.edges.len();
    let root = load4(simd, &b.root);
    let p1 = b.nodes[0].position(simd);
    let mut carried = [Carried { before: root, p1 }; ABREAST];
    for step in 0..edges + 2 * (abreast - 1) {
        for (k, carried) in carried.iter_mut().take(abreast).enumerate() {
            let i = step.wrapping_sub(2 * k);
            if i >= edges {
                continue;
            }
            if i == 0 {
                carried.p1 = b.nodes[0].position(simd);
            }
            pass_edge::<S, P>(simd, b, i, carried);
            touch(simd, &mut b.nodes[i], b.sweeps, skin, obstacles);
            if i + 1 == edges {
                store4(&mut b.edges[i].q, carried.before);
                store3(&mut b.nodes[i + 1].p, carried.p1);
                touch(simd, &mut b.nodes[i + 1], b.sweeps, skin, obstacles);
            }
        }
    }
}

/// One edge of a sweep.
#[inline(always)]
fn pass_edge<S: Simd, const P: usize>(
    simd: S,
    b: &mut BlockLanes,
    i: usize,
    carried: &mut Carried<S>,
) {
    let one = f32x16::splat(simd, 1.0);
    let Carried { before, p1 } = *carried;
    let (e, shares) = (&b.edges[i], &b.shares[i]);
    let q = load4(simd, &e.q);
    let (d_before, d_q) = bend_twist(before, q, load4(simd, &e.rest), shares.bend(simd));
    let q = q.add_scaled(d_q, one).renormalize();
    let p2 = b.nodes[i + 1].position(simd);
    let c = stretch_shear(PROJECTIONS[P], p1, p2, q, shares.stretch(simd));
    if i > 0 {
        let turned = before.add_scaled(d_before, one).renormalize();
        store4(&mut b.edges[i - 1].q, turned);
    }
    store3(&mut b.nodes[i].p, p1 + c.p1);
    *carried = Carried { before: q.add_scaled(c.q, one).renormalize(), p1: p2 + c.p2 };
}

/// Takes nodes out of obstacles, with friction, and notes what touches.
#[inline(always)]
pub(crate) fn contacts<S: Simd>(simd: S, b: &mut BlockLanes, skin: f32, obstacles: &[Obstacle]) {
    b.touched = [0.0; LANES];
    if obstacles.is_empty() {
        return;
    }
    let mut touched = f32x16::splat(simd, 0.0);
    for n in &mut b.nodes {
        touched = Real::max(touched, touch(simd, n, b.sweeps, skin, obstacles));
    }
    touched.store_array(&mut b.touched);
}

/// Takes one node out of obstacles, with friction, and notes what it rests on. Returns 1 where it
/// rests on any.
#[inline(always)]
fn touch<S: Simd>(
    simd: S,
    n: &mut NodeLanes,
    sweeps: bool,
    skin: f32,
    obstacles: &[Obstacle],
) -> f32x16<S> {
    let (zero, one) = (f32x16::splat(simd, 0.0), f32x16::splat(simd, 1.0));
    let mut touched = zero;
    if obstacles.is_empty() {
        return touched;
    }
    let held = Real::lt(load(simd, &n.w), f32x16::splat(simd, 1e-12));
    let from = load3(simd, &n.from);
    let (mut p, mut rests_on) = (load3(simd, &n.p), V3::new(zero, zero, zero));
    for o in obstacles {
        // What would take a node through has to be stopped in every pass: the shortest way out
        // may be the wrong one.
        if sweeps && let Some((before, normal)) = hold_back(o, o.taken_along(from), p, skin) {
            p = V3::select(held, p, before);
            let stopped = Real::lt(zero, normal.dot(normal));
            rests_on = V3::select(stopped, normal, rests_on);
            touched = Real::select(stopped, one, touched);
        }
        let friction = f32x16::splat(simd, o.friction);
        if let Some((out, normal)) = push_out(o, p, from, friction, skin, false) {
            p = V3::select(held, p, out);
            let pushed = Real::lt(zero, normal.dot(normal));
            rests_on = V3::select(pushed, normal, rests_on);
            touched = Real::select(pushed, one, touched);
        }
    }
    store3(&mut n.p, p);
    store3(&mut n.rests_on, rests_on);
    touched
}

/// Velocities from the change of the step, the joints' damping, and the check that all is finite.
#[inline(always)]
fn velocities<S: Simd>(simd: S, b: &mut BlockLanes, params: &StepParams) {
    let rate = f32x16::splat(simd, 1.0 / params.dt);
    let zero = f32x16::splat(simd, 0.0);
    let mut sum = zero;
    for n in &mut b.nodes {
        let v = (load3(simd, &n.p) - load3(simd, &n.from)).scale(rate);
        store3(&mut n.v, v);
        sum += v.dot(v);
    }
    let double = rate + rate;
    for e in &mut b.edges {
        let q = load4(simd, &e.q).normalize();
        store4(&mut e.q, q);
        let change = q.product(load4(simd, &e.from).conjugate());
        let sign = Real::select(Real::lt(change.w, zero), -double, double);
        let omega = change.v.scale(sign);
        store3(&mut e.omega, omega);
        sum += omega.dot(omega);
    }
    if params.internal_damping > 0.0 {
        let exchange = 0.5 * (1.0 - bevy::math::ops::exp(-params.internal_damping * params.dt));
        let exchange = f32x16::splat(simd, exchange);
        for i in 1..b.edges.len() {
            let (a, c) = (load3(simd, &b.edges[i - 1].omega), load3(simd, &b.edges[i].omega));
            let d = (c - a).scale(exchange);
            store3(&mut b.edges[i - 1].omega, a + d);
            store3(&mut b.edges[i].omega, c - d);
        }
    }
    (sum * zero).store_array(&mut b.finite);
}
