//! A block: [`LANES`] strands of equal node count, side by side, through one substep.
//!
//! Layout: an array of nodes and an array of edges, each an array of lanes (AoSoA), so that a
//! constraint reads whole vectors and a strand's sequence runs down the array. A block of sixteen nodes is
//! about 77 kB, of which a pass of the direct solver goes through 34 to 56 and an iteration of the
//! sweeps through 18. The arrays are plain old data and may be handed to a compute shader as they are.
//!
//! Strands keep their own vectors, so that game code reads and writes them; [`solve`](crate::simulation::solve)
//! gathers them into lanes and scatters them back in each substep.

use super::{
    balls::ObstacleBalls,
    constraint::Shares,
    direct::row::DirectRow,
    obstacle::{CloseObstacles, NearObstacles, Obstacle},
};
use crate::base::lanes::{LANES, Lane, V3, load, load3, store3};
use fearless_simd::{Simd, f32x16};
use glam::Vec3;

/// One node of every strand in the block.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct NodeLanes<C = Lane> {
    /// Position (m).
    pub p: [C; 3],
    /// Position at the start of the substep (m).
    pub from: [C; 3],
    /// Velocity (m/s).
    pub v: [C; 3],
    /// Inverse mass, relative to a whole node's: 1, at the tip 2, held 0.
    pub w: C,
    /// Mass, relative to a whole node's. Direct method only.
    pub mass: C,
    /// Acceleration by air and gravity in this substep (m/s²), which `v` contains in full. Direct method only.
    pub push: [C; 3],
    /// What else has changed `v` in this substep, as contact with other hair (m/s). Direct method only.
    pub kick: [C; 3],
    /// Normal of the obstacle that the node rests on, or zero; written by the contact passes.
    pub rests_on: [C; 3],
    /// Where friction pulls it to (m): its start, moved with the surface of that obstacle, or where it slides any place
    /// on the way back. Direct method only.
    pub anchor: [C; 3],
    /// What holds it there, as a displacement of a free node in the substep (m): the support's force and friction.
    /// Written by the Newton steps of the direct method, and for springs by the contact passes.
    pub reaction: [C; 3],
    /// 1 where friction holds it there, else 0. Direct method only.
    pub sticks: C,
    /// Else the friction that it slides against, as a displacement of a free node in the substep (m). Direct
    /// method only.
    pub drag: C,
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
    /// How much of the stretch of that tension the length limiter has taken off (m). Direct method only.
    pub taken: C,
    /// 1 where its orientation is held, else 0. Direct method only.
    pub clamped: C,
    /// The share of its resistance to twist against bending that the joint at its start lacks: 0 in dry hair. Direct
    /// method only.
    pub twist_loss: C,
}

/// A row of a tridiagonal system over a strand's edges, eliminated from the root on.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct TridiagonalRow {
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
    /// The share of gravity that acts on each node; empty where gravity acts in full. Buoyancy
    /// reduces it. For springs only.
    pub(crate) gravity: Vec<Lane>,
    /// The scalp's frame q_{−1} of each strand.
    pub root: [Lane; 4],
    /// Zero for lanes whose state is finite, else NaN; written by [`step`](super::step::step).
    pub finite: Lane,
    /// 1 for lanes with a node that rests on an obstacle, else 0; written by the contact passes.
    pub(crate) touched: Lane,
    /// Whether any node moves so fast against an obstacle that it might pass through.
    pub(super) has_fast_nodes: bool,
    /// Which obstacles each node may touch in this substep, in any lane.
    pub(crate) near_obstacles: Vec<NearObstacles>,
    /// Of these the ones that a node touches first, if any.
    pub(super) close_obstacles: Vec<CloseObstacles>,
    pub(super) obstacle_balls: Vec<ObstacleBalls>,
    /// Of a strand whose root lies in an obstacle, the length from the root on that may be inside: it is too short
    /// to get out (m). Written by `choose_near`, for the direct method only.
    pub(crate) escape_length: Lane,
    /// 1 for strands that begin the substep in an obstacle that their length does not let them out of, else 0: they
    /// stay as deep. Written for the direct method only.
    pub(crate) trapped: Lane,
    /// The scalp's frame at the start of the substep, in the frame of the positions. Direct method only.
    pub root_from: [Lane; 4],
    pub(super) theta: Lane,
    /// Damping of each strand as a share of the block's. Direct method only.
    pub(crate) damping: Lane,
    /// Largest twist that counts in the Hessian, as a moment over EI (1/m). Direct method only.
    pub(super) max_twist: Lane,
    /// 1 for lanes that may take more than one Newton step, else 0.
    pub(super) twice: Lane,
    /// 1 for those that take the present one, else 0.
    pub(super) again: Lane,
    /// 1 for lanes in which a node has been found to stick, slide, rest or leave that did not, else 0.
    pub(super) changed: Lane,
    pub(super) root_between: [Lane; 4],
    pub(crate) scratch: Vec<TridiagonalRow>,
    pub(super) shares: Vec<Shares>,
    pub(super) rows: Vec<DirectRow<Lane>>,
}

impl BlockLanes {
    /// Resizes to strands of `nodes` nodes, reusing allocations.
    pub fn resize(&mut self, nodes: usize) {
        self.damping = [1.0; LANES];
        self.nodes.resize(nodes, NodeLanes::default());
        self.edges.resize(nodes - 1, EdgeLanes::default());
        self.scratch.resize(nodes - 1, TridiagonalRow::default());
        self.shares.resize(nodes - 1, Shares::default());
        self.rows.resize(nodes - 1, DirectRow::default());
        self.near_obstacles.resize(nodes, NearObstacles::ALL);
        self.close_obstacles.resize(nodes, CloseObstacles::UNKNOWN);
    }

    /// Any node may touch any obstacle that one of the block may touch in a step of `dt`.
    pub(crate) fn choose_obstacles(&mut self, obstacles: &[Obstacle], dt: f32, clearance: f32) {
        let mut near = NearObstacles::NONE;
        self.obstacles_near(obstacles, dt, clearance).for_each(|(index, _)| near.add(index));
        if near == NearObstacles::NONE {
            self.release();
        }
        self.near_obstacles.fill(near);
        self.close_obstacles.fill(CloseObstacles::UNKNOWN);
    }

    /// Nothing rests on anything: the block may have held other strands before, which did.
    pub(super) fn release(&mut self) {
        self.nodes.iter_mut().for_each(NodeLanes::release);
        self.near_obstacles.fill(NearObstacles::NONE);
    }

    /// Whether any node may touch anything.
    pub(super) fn is_near_obstacles(&self) -> bool {
        self.near_obstacles.iter().any(|near| *near != NearObstacles::NONE)
    }

    /// The obstacles that any lane may touch in a step of `dt`, and their places among all.
    fn obstacles_near<'a>(
        &self,
        obstacles: &'a [Obstacle],
        dt: f32,
        clearance: f32,
    ) -> impl Iterator<Item = (usize, &'a Obstacle)> {
        let (low, high) = if obstacles.is_empty() { Default::default() } else { self.bounds(dt) };
        // Nodes may move beyond their prediction, by at most an edge length in a substep.
        let longest = self.edges.iter().flat_map(|e| e.l).fold(0.0, f32::max);
        let margin = clearance + longest;
        obstacles.iter().enumerate().filter(move |(_, o)| o.may_touch(low, high, margin))
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

/// Scales `gives`, gravity's effect in air, to that on node `node`.
#[inline(always)]
pub(crate) fn pulled<S: Simd>(
    simd: S,
    shares: &[Lane],
    node: usize,
    gives: V3<f32x16<S>>,
) -> V3<f32x16<S>> {
    shares.get(node).map_or(gives, |share| gives.scale(load(simd, share)))
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

    /// It rests on nothing.
    pub(crate) fn release(&mut self) {
        self.rests_on = Default::default();
        (self.reaction, self.sticks, self.drag) = Default::default();
    }

    #[inline(always)]
    pub(crate) fn set_position<S: Simd>(&mut self, p: V3<f32x16<S>>) {
        store3(&mut self.p, p);
    }
}
