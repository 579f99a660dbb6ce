//! Memory layout of strands on the GPU.
//!
//! Strands of equal node count form blocks of [`GROUP_SIZE`]; within a block the same vector of neighbouring
//! strands lies side by side, so that neighbouring threads read neighbouring words. Part `m` of `M` vectors
//! of node `i` is at `((first + i) · M + m) · GROUP_SIZE + lane`, counted in vectors of four numbers.

use super::fingerprint::Fingerprint;
use crate::{
    base::parallel::{Nanos, for_each},
    hair::strand::{Strand, StrandHistory},
    keratin::bond::{Bonds, model::JointBonds},
    simulation::lod::follow::{GUIDES, GuideOffsets},
};
use bevy::math::{Quat, Vec3};

/// Strands per block.
pub const GROUP_SIZE: usize = 32;

/// Vectors per node in each buffer.
pub(super) const POSE: usize = 2;
pub(super) const MOTION: usize = 2;
pub(super) const REST: usize = 2;
pub(super) const BONDS: usize = 4;
pub(super) const SCRATCH: usize = 9;
pub(super) const STILL: usize = 2;

/// Bytes per node in all buffers of a hair that may sleep together; 16 more where edges have angular velocities.
pub const BYTES_PER_NODE: usize = 16 * (2 * POSE + MOTION + REST + BONDS + SCRATCH + STILL);

/// The slots of one strand.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Place {
    first: u32,
    lane: u32,
    nodes: u32,
}

/// The slots of a hair's strands.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Layout {
    /// Of each block first node slot, nodes of a strand, strands, number of its first strand.
    blocks: Vec<[u32; 4]>,
    places: Vec<Place>,
    /// Strands in the order of their numbers on the GPU.
    order: Vec<u32>,
    slots: u32,
    /// How many blocks and node slots the simulated strands have; followers come after them.
    simulated: (usize, usize),
    /// Whether edges have angular velocities.
    has_spins: bool,
}

impl Layout {
    /// For strands with these node counts.
    pub fn of(nodes: &[usize]) -> Self {
        Self::with_followers(nodes, |_| false)
    }

    /// The same, of which some are followers.
    pub fn with_followers(nodes: &[usize], is_follower: impl Fn(usize) -> bool) -> Self {
        let mut order: Vec<u32> = (0..nodes.len() as u32).collect();
        let count = |strand: &u32| (is_follower(*strand as usize), nodes[*strand as usize]);
        order.sort_by_key(count);
        let mut layout = Self { places: vec![Place::default(); nodes.len()], ..Self::default() };
        let mut number = 0;
        for alike in order.chunk_by(|a, b| count(a) == count(b)) {
            let (is_follower, nodes) = count(&alike[0]);
            let nodes = nodes as u32;
            for block in alike.chunks(GROUP_SIZE) {
                let first = layout.slots;
                layout.blocks.push([first, nodes, block.len() as u32, number]);
                for (lane, strand) in block.iter().enumerate() {
                    layout.places[*strand as usize] = Place { first, lane: lane as u32, nodes };
                }
                layout.slots += nodes;
                number += block.len() as u32;
            }
            if !is_follower {
                layout.simulated = (layout.blocks.len(), layout.slots as usize);
            }
        }
        layout.order = order;
        layout
    }

    /// With angular velocities of the edges, or without.
    pub fn with_spins(self, has_spins: bool) -> Self {
        Self { has_spins, ..self }
    }

    /// Whether edges have angular velocities: strands that the paper's projections solve.
    pub fn has_spins(&self) -> bool {
        self.has_spins
    }

    /// How many vectors the buffer of the motion has.
    pub(super) fn motion_vectors(&self) -> usize {
        self.vectors(if self.has_spins { MOTION + 1 } else { MOTION })
    }

    /// How many vectors pose, motion and bonds have.
    pub(super) fn state(&self) -> [usize; 3] {
        [self.vectors(POSE), self.motion_vectors(), self.vectors(BONDS)]
    }

    /// Where the angular velocity of a strand's edge lies in the buffer of the motion: behind what all strands
    /// have.
    fn spin_index(&self, strand: usize, edge: usize) -> usize {
        self.vectors(MOTION) + self.index(strand, edge, 0, 1)
    }

    /// How many strands there are.
    pub fn strands(&self) -> usize {
        self.places.len()
    }

    /// How many blocks, and workgroups, there are.
    pub fn blocks(&self) -> &[[u32; 4]] {
        &self.blocks
    }

    /// How many nodes a strand has.
    pub fn nodes(&self, strand: usize) -> usize {
        self.places[strand].nodes as usize
    }

    /// The strand that has this number on the GPU.
    pub fn strand_of(&self, number: u32) -> Option<usize> {
        self.order.get(number as usize).map(|strand| *strand as usize)
    }

    /// How many vectors a buffer of `parts` vectors a node has.
    pub fn vectors(&self, parts: usize) -> usize {
        self.slots as usize * parts * GROUP_SIZE
    }

    /// How many of the first blocks are simulated; the others are followers.
    pub(super) fn simulated_blocks(&self) -> usize {
        self.simulated.0
    }

    /// The number of the first node slot of followers.
    pub(super) fn first_follower_slot(&self) -> usize {
        self.simulated.1
    }

    /// How many vectors a buffer of `parts` vectors a follower's node has.
    pub(super) fn follower_vectors(&self, parts: usize) -> usize {
        (self.slots as usize - self.simulated.1) * parts * GROUP_SIZE
    }

    /// Whether a strand is a follower.
    pub(super) fn is_follower(&self, strand: usize) -> bool {
        self.places[strand].first as usize >= self.simulated.1
    }

    /// The number of a strand's node among all nodes on the GPU.
    pub(super) fn slot(&self, strand: usize, node: usize) -> u32 {
        self.index(strand, node, 0, 1) as u32
    }

    /// Where part `part` of `parts` of a strand's node lies.
    pub fn index(&self, strand: usize, node: usize, part: usize, parts: usize) -> usize {
        let Place { first, lane, .. } = self.places[strand];
        ((first as usize + node) * parts + part) * GROUP_SIZE + lane as usize
    }
}

/// What a strand follows.
#[derive(Clone, Copy, Debug)]
pub struct FollowerView<'a> {
    /// How.
    pub offsets: &'a GuideOffsets,
    /// The indices of its guides among the hair's strands.
    pub guides: [u32; GUIDES],
}

/// A strand as it is handed over.
#[derive(Clone, Copy, Debug)]
pub struct StrandView<'a> {
    /// Places of the nodes (m), root first.
    pub positions: &'a [Vec3],
    /// Velocities of the nodes (m/s).
    pub velocities: &'a [Vec3],
    /// Frames of the edges.
    pub orientations: &'a [Quat],
    /// The scalp's frame.
    pub root_frame: Quat,
    /// Rest lengths of the edges (m).
    pub lengths: &'a [f32],
    /// Tensions that the last substep left (N, for hair of which a whole node weighs 1 kg).
    pub tensions: &'a [f32],
    /// Angular velocities of the edges (rad/s); of strands that the paper's projections solve.
    pub spins: Option<&'a [Vec3]>,
    /// Bonds of the joints.
    pub joints: &'a [JointBonds],
    /// Where the nodes were when the last tick began (m); where they are, if there are not as many.
    pub before: &'a [Vec3],
    /// What it follows, where it is not simulated.
    pub follows: Option<FollowerView<'a>>,
}

impl<'a> StrandView<'a> {
    /// A strand of the tick.
    pub fn of(strand: &'a Strand, bonds: &'a Bonds, history: &'a StrandHistory) -> Self {
        Self {
            positions: strand.positions(),
            velocities: strand.velocities(),
            orientations: strand.orientations(),
            root_frame: strand.root_frame(),
            lengths: strand.rest_lengths(),
            tensions: strand.tensions(),
            spins: None,
            joints: &bonds.joints,
            before: &history.positions,
            follows: None,
        }
    }
}

/// A strand as it is read back.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct StrandState {
    /// Places of the nodes (m), root first.
    pub positions: Vec<Vec3>,
    /// Velocities of the nodes (m/s).
    pub velocities: Vec<Vec3>,
    /// Frames of the edges.
    pub orientations: Vec<Quat>,
    /// The scalp's frame.
    pub root_frame: Quat,
    /// Tensions of the edges.
    pub tensions: Vec<f32>,
    /// Angular velocities of the edges (rad/s); none of strands that have none.
    pub spins: Vec<Vec3>,
    /// Bonds of the joints.
    pub joints: Vec<JointBonds>,
    /// Places of the nodes when the tick began (m).
    pub before: Vec<Vec3>,
}

/// What all buffers of a hair hold.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Contents {
    /// Place; frame, at the tip the scalp's.
    pub pose: Vec<[f32; 4]>,
    /// Velocity and tension; place at the tick's start. Behind all these the edges' angular velocities, of strands
    /// that have them.
    pub motion: Vec<[f32; 4]>,
    /// Rest shape; length, share of stiffness, weight in dry nodes, share softened.
    pub rest: Vec<[f32; 4]>,
    /// Remembered shape and rate, kind by kind.
    pub bonds: Vec<[f32; 4]>,
}

/// Estimated time of packing a block (ns).
const PACK: Nanos = Nanos(10_000);

/// The part of [`Contents`] that a block of strands has.
struct Slots<'a> {
    pose: &'a mut [[f32; 4]],
    motion: &'a mut [[f32; 4]],
    spins: &'a mut [[f32; 4]],
    rest: &'a mut [[f32; 4]],
    bonds: &'a mut [[f32; 4]],
    reach: Reach,
}

/// The box around the roots of strands, and the length of the longest (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Reach {
    pub(super) low: Vec3,
    pub(super) high: Vec3,
    pub(super) longest: f32,
}

impl Default for Reach {
    fn default() -> Self {
        Self { low: Vec3::INFINITY, high: Vec3::NEG_INFINITY, longest: 0.0 }
    }
}

impl Reach {
    fn with(&self, other: &Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            longest: self.longest.max(other.longest),
        }
    }
}

impl Slots<'_> {
    /// Puts a strand into its lane.
    fn put(&mut self, lane: usize, view: &StrandView<'_>) {
        let edges = view.lengths.len();
        let before = if view.before.len() > edges { view.before } else { view.positions };
        for (node, before) in before.iter().enumerate().take(edges + 1) {
            let at = |part, parts| (node * parts + part) * GROUP_SIZE + lane;
            let place = view.positions[node];
            let frame = view.orientations.get(node).copied().unwrap_or(view.root_frame);
            let tension = view.tensions.get(node).copied().unwrap_or(0.0);
            self.pose[at(0, POSE)] = place.extend(0.0).to_array();
            self.pose[at(1, POSE)] = frame.to_array();
            self.motion[at(0, MOTION)] = view.velocities[node].extend(tension).to_array();
            self.motion[at(1, MOTION)] = before.extend(0.0).to_array();
            if let Some(to) = self.spins.get_mut(at(0, 1)) {
                let spin = view.spins.and_then(|spins| spins.get(node)).copied();
                *to = spin.unwrap_or_default().extend(0.0).to_array();
            }
            let length = view.lengths.get(node).copied().unwrap_or(0.0);
            let weight = if node == 0 { 0.0 } else { 1.0 };
            self.rest[at(0, REST)] = Quat::IDENTITY.to_array();
            self.rest[at(1, REST)] = [length, 1.0, weight, 0.0];
            let Some(joint) = view.joints.get(node) else { continue };
            for (kind, (shape, rate)) in joint.shapes.iter().zip(joint.rates).enumerate() {
                self.bonds[at(kind, BONDS)] = shape.extend(rate).to_array();
            }
        }
    }
}

impl Contents {
    /// Zeros for all slots.
    pub fn new(layout: &Layout) -> Self {
        let room = |parts| vec![[0.0; 4]; layout.vectors(parts)];
        let motion = vec![[0.0; 4]; layout.motion_vectors()];
        Self { pose: room(POSE), motion, rest: room(REST), bonds: room(BONDS) }
    }

    /// Of these strands.
    pub fn of(layout: &Layout, strands: &[StrandView<'_>]) -> Self {
        Self::with_reach(layout, strands).0
    }

    /// The same, and how far they reach: in one go, since each look at all strands takes a millisecond.
    pub(super) fn with_reach(layout: &Layout, strands: &[StrandView<'_>]) -> (Self, Reach) {
        let mut contents = Self::new(layout);
        let Self { pose, motion, rest, bonds } = &mut contents;
        let (motion, spins) = motion.split_at_mut(layout.vectors(MOTION));
        let mut parts = [&mut pose[..], motion, spins, &mut rest[..], &mut bonds[..]];
        let each = [POSE, MOTION, usize::from(layout.has_spins), REST, BONDS];
        let mut blocks: Vec<_> = (layout.blocks.iter())
            .map(|[_, nodes, count, number]| {
                let sizes = each.map(|each| *nodes as usize * each * GROUP_SIZE);
                let mut own = parts.iter_mut().zip(sizes).map(|(part, size)| {
                    let (own, others) = core::mem::take(part).split_at_mut(size);
                    *part = others;
                    own
                });
                let mut next = || own.next().unwrap_or_default();
                let own = Slots {
                    pose: next(),
                    motion: next(),
                    spins: next(),
                    rest: next(),
                    bonds: next(),
                    reach: Reach::default(),
                };
                (own, &layout.order[*number as usize..][..*count as usize])
            })
            .collect();
        for_each(&mut blocks, PACK, |(slots, numbers)| {
            for (lane, strand) in numbers.iter().enumerate() {
                let view = &strands[*strand as usize];
                slots.put(lane, view);
                let (root, length) = (view.positions[0], view.lengths.iter().sum());
                slots.reach = slots.reach.with(&Reach { low: root, high: root, longest: length });
            }
        });
        let reach = blocks.iter().fold(Reach::default(), |all, (own, _)| all.with(&own.reach));
        (contents, reach)
    }

    /// A strand's fingerprints.
    pub(super) fn fingerprint(&self, layout: &Layout, strand: usize) -> Fingerprint {
        let vectors = |from: &'_ [[f32; 4]], parts| {
            let of = move |node| layout.index(strand, node, 0, parts);
            let all: Vec<Vec3> =
                (0..layout.nodes(strand)).map(|node| Vec3::from_slice(&from[of(node)])).collect();
            all
        };
        let (places, speeds) = (vectors(&self.pose, POSE), vectors(&self.motion, MOTION));
        Fingerprint::of(places.iter().copied(), speeds.iter().copied())
    }

    /// What a copy of pose, motion and bonds, one after the other, holds.
    pub(super) fn of_bytes(layout: &Layout, bytes: &[u8]) -> Self {
        let mut rest = bytes;
        let mut part = |count| {
            let mut vectors = vec![[0.0; 4]; count];
            let (own, others) = rest.split_at((16 * vectors.len()).min(rest.len()));
            bytemuck::cast_slice_mut::<[f32; 4], u8>(&mut vectors)[..own.len()]
                .copy_from_slice(own);
            rest = others;
            vectors
        };
        let [pose, motion, bonds] = layout.state().map(&mut part);
        Self { pose, motion, rest: Vec::new(), bonds }
    }

    /// Bytes of such a copy.
    pub(super) fn bytes(layout: &Layout) -> u64 {
        16 * layout.state().iter().sum::<usize>() as u64
    }

    /// Reads a strand from its slots.
    pub fn get(&self, layout: &Layout, strand: usize) -> StrandState {
        let nodes = layout.nodes(strand);
        let mut state = StrandState::default();
        let vector = |v: [f32; 4]| Vec3::new(v[0], v[1], v[2]);
        for node in 0..nodes {
            let at = |part, parts| layout.index(strand, node, part, parts);
            let frame = Quat::from_array(self.pose[at(1, POSE)]);
            let moving = self.motion[at(0, MOTION)];
            state.positions.push(vector(self.pose[at(0, POSE)]));
            state.velocities.push(vector(moving));
            state.before.push(vector(self.motion[at(1, MOTION)]));
            if node + 1 == nodes {
                state.root_frame = frame;
                continue;
            }
            state.orientations.push(frame);
            state.tensions.push(moving[3]);
            if layout.has_spins {
                state.spins.push(vector(self.motion[layout.spin_index(strand, node)]));
            }
            let kinds: [[f32; 4]; 4] = core::array::from_fn(|kind| self.bonds[at(kind, BONDS)]);
            state.joints.push(JointBonds { shapes: kinds.map(vector), rates: kinds.map(|k| k[3]) });
        }
        state
    }
}
