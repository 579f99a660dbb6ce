//! Strands and hair as entities.
//!
//! A [`Hair`] is the wearer's hair as one thing. Its strands are entities of their own, tied to it
//! by [`StrandOf`] (despawning the hair despawns them). A strand holds arrays of nodes, because
//! a rod is solved in sequence.
//!
//! All of a strand's state is in its hair's own frame: the space of the `Hair` entity's children.
//! When that frame moves, [`frame`] applies the motion to the nodes as inertia, spread over the
//! substeps; drawing places the nodes with the pose that is drawn, so roots never lag. Lengths are
//! in the hair's units: a scaled character's hair behaves as if unscaled.

mod cut;
pub mod frame;
mod held;
mod on_gpu;
mod owner;
mod owner_systems;
mod per_hair;
mod rank;
mod record;
mod repair;
mod required;
mod strand_sleep;
mod systems;
mod teleport;

pub use cut::{CutStrand, FollowerCuts};
pub(crate) use cut::{SHORTEST_END, StrandPlace};
pub(crate) use frame::Carried;
pub use frame::{HairInertia, Pose, TickPose};
pub(crate) use held::Held;
pub(crate) use held::drawn_out;
pub use held::{HeldNodes, HeldNodesState};
pub use on_gpu::OnGpu;
#[cfg(feature = "gpu")]
pub(crate) use on_gpu::{AskForStrands, ReturnToCpu, StrandsArrived};
pub(crate) use on_gpu::{MissedOnGpu, return_to_cpu};
pub(crate) use owner::PlayedHair;
#[cfg(any(feature = "groom", feature = "gpu"))]
pub(crate) use owner::RecordedHair;
pub use owner::{MotionOwner, Settling};
#[cfg(feature = "gpu")]
pub(crate) use owner_systems::HairOnGpu;
#[cfg(feature = "save")]
pub(crate) use owner_systems::is_on_gpu;
pub(crate) use owner_systems::{FollowsHere, HairHere, Here, SimulatedHere};
pub(crate) use per_hair::PerHair;
pub(crate) use rank::StrandRank;
pub(crate) use required::keep_required;
pub(crate) use strand_sleep::KinematicStrand;
pub use strand_sleep::{SleepCounts, SleepPose, StrandSleep};
#[cfg(any(feature = "render", feature = "groom"))]
pub(crate) use systems::DrawnFrames;
pub use systems::StrandPlugin;
pub(crate) use systems::{carried_along, lacks_strands};
pub use teleport::ShiftWorld;

use crate::{
    base::{
        fault::{FaultKind, HairFault},
        parallel::prefetch,
        schedule::MergedSubsteps,
        setting::Ranged,
    },
    solver::rod::frame::{darboux, full, parallel_transport},
};
use bevy::prelude::*;

/// The wearer's hair as one thing. Put it on any entity with a transform, such as a head bone; spawn
/// strands with [`StrandOf`] pointing here. Settings ([`HairStiffness`](crate::HairStiffness),
/// [`HairSolver`](crate::HairSolver), [`AirDrag`](crate::AirDrag), [`BondInfluence`](crate::BondInfluence),
/// [`Cuticle`](crate::Cuticle), [`StrandContact`](crate::StrandContact)) may be added as components, here or on who wears
/// it ([`WornBy`](crate::WornBy)).
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq)]
#[reflect(Component, Default, Clone, PartialEq)]
#[require(Transform, TickPose, MergedSubsteps, MotionOwner, Regroomed)]
pub struct Hair;

/// Counts as changed where strands of a hair have come, gone or been enabled, or where game code has written
/// to one: noted once a tick, before anything is derived from the strands. The only detector of that; of
/// strands on the GPU it knows when they come and go, not when they are written to.
#[derive(Component, Clone, Copy, Debug, Default)]
pub(crate) struct Regroomed {
    /// Whether strands have come or gone since the tick before; if not, they were written to or enabled.
    pub(crate) members: bool,
    /// How many there were in the last tick: of a copy, those of its original.
    pub(super) strands: usize,
}

/// Makes an entity a strand of a [`Hair`].
#[derive(Component, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Component, Clone, PartialEq)]
#[relationship(relationship_target = Strands)]
pub struct StrandOf(pub Entity);

/// The strands of a [`Hair`], in the order they were spawned. Kept by Bevy.
#[derive(Component, Reflect, Clone, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone)]
#[relationship_target(relationship = StrandOf, linked_spawn)]
pub struct Strands(Vec<Entity>);

/// Why a polyline cannot be a strand.
#[derive(thiserror::Error, Reflect, Clone, Copy, Debug, PartialEq, Eq)]
#[reflect(Clone, PartialEq)]
pub enum StrandError {
    /// Fewer than two nodes.
    #[error("a strand has {found} nodes, expected 2 or more: give root and tip at least")]
    TooFewNodes {
        /// How many there were.
        found: usize,
    },
    /// A node that is not finite.
    #[error("node {node} of the strand is not finite: remove it or repair the source")]
    NonFinite {
        /// Its index from the root.
        node: usize,
    },
    /// Two neighbouring nodes (nearly) at the same place.
    #[error(
        "segment {segment} of the strand has no length, expected more than {MIN_SEGMENT} m: \
         merge nodes {segment} and {}", segment + 1
    )]
    ZeroLength {
        /// Index of the segment from the root.
        segment: usize,
    },
    /// Two neighbouring nodes too far apart for single precision.
    #[error(
        "segment {segment} of the strand is longer than {MAX_SEGMENT} m: strands are in metres, \
         scale the source"
    )]
    TooLong {
        /// Index of the segment from the root.
        segment: usize,
    },
}

/// The shortest segment that a strand may have (m).
pub const MIN_SEGMENT: f32 = 1e-6;

/// The longest one (m): squares of longer ones overflow f32.
pub const MAX_SEGMENT: f32 = 1e9;

/// Finite steps after a reset until a fault is reported again (about a second): what breaks a strand in
/// every tick is reported once.
const FAULT_COOLDOWN: u16 = 360;

/// A strand's nodes and edges, in its hair's frame, root first.
///
/// Made by [`Strand::from_polyline`]. Game code may read everything and write positions and velocities;
/// the number of nodes is fixed.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Component, Default, Clone)]
#[require(StrandHistory, AddedMass, StrandSleep, SleepPose, StrandRank)]
pub struct Strand {
    positions: Vec<Vec3>,
    velocities: Vec<Vec3>,
    /// Velocities before the forces of this substep, and what air and gravity have added to each (m/s). Empty outside
    /// a substep.
    #[reflect(ignore)]
    unforced: Vec<Vec3>,
    #[reflect(ignore)]
    blown: Vec<Vec3>,
    orientations: Vec<Quat>,
    angular_velocities: Vec<Vec3>,
    rest_lengths: Vec<f32>,
    tensions: Vec<f32>,
    root_frame: Quat,
    root_before: Option<(Vec3, Quat)>,
    /// Finite steps left until a reset is reported again.
    fault_cooldown: u16,
}

/// Positions of a strand's nodes at the end of the previous tick, in the hair's frame: drawing
/// interpolates from these to the present ones by the overstep of the fixed clock.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Default, Clone)]
pub struct StrandHistory {
    /// Positions (m), root first; empty until the first tick.
    pub positions: Vec<Vec3>,
    /// Position at which the root is drawn, if it differs from that of the ticks: on a skinned
    /// mesh, its position on the drawn mesh (m). The whole strand is drawn with the same offset.
    pub root: Option<Vec3>,
}

impl StrandHistory {
    /// Stores the present positions as history: the strand is drawn where it is, without motion.
    pub(crate) fn remember(&mut self, strand: &Strand) {
        self.positions.clone_from(&strand.positions);
    }

    fn between(&self, strand: &Strand, node: usize, overstep: f32) -> Vec3 {
        let now = strand.positions[node];
        match self.positions.get(node) {
            Some(before) if before.is_finite() && self.positions.len() == strand.nodes() => {
                before.lerp(now, overstep)
            }
            _ => now,
        }
    }

    /// Position at which a node is drawn, in the hair's frame: interpolated between the previous
    /// tick and the present by the overstep of the fixed clock (0…1).
    #[inline]
    pub fn drawn(&self, strand: &Strand, node: usize, overstep: f32) -> Vec3 {
        let place = self.between(strand, node, overstep);
        match self.root {
            None => place,
            Some(root) => place + (root - self.between(strand, 0, overstep)),
        }
    }
}

/// What the strands of a hair are made of. Component of a [`Hair`]; where absent,
/// [`HairDefault<StrandModel>`](crate::HairDefault) holds.
#[derive(Component, Reflect, Clone, Copy, Debug, Default, PartialEq, Eq)]
#[reflect(Component, Default, Clone, PartialEq)]
pub enum StrandModel {
    /// Cosserat rods with side-chain bonds, \[B\].
    #[default]
    Rod,
    /// Masses and [`Springs`](crate::solver::mass_spring::Springs), \[W\] equation 1: cheaper, straight at rest,
    /// without bonds.
    MassSpring,
}

impl Ranged for StrandModel {}

/// What makes a strand heavier and softer than in its dry state, such as water. Written by the
/// tick; empty on dry hair.
#[derive(Component, Reflect, Clone, Debug, Default)]
#[reflect(Default, Clone)]
pub struct AddedMass {
    /// Added mass of each node, over its dry mass. Inverse masses, wind and contacts depend on it.
    #[reflect(ignore)]
    pub mass: Vec<f32>,
    /// Share of its stiffness that each joint has lost, beyond open bonds.
    #[reflect(ignore)]
    pub softening: Vec<f32>,
    /// Whether hydrogen bonds follow the strand's water: then wind dries that water, not the bonds.
    pub moves_bonds: bool,
    /// Effects of surrounding water on each node; empty out of the water.
    #[reflect(ignore)]
    pub(crate) in_water: Vec<InWater>,
}

/// Effects of surrounding water on a node in a substep.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub(crate) struct InWater {
    /// The share of the node that is under water.
    pub(crate) share: f32,
    /// Its inertia relative to that out of the water: with added mass of the water, and with drag,
    /// whose implicit step acts like a heavier node.
    pub(crate) inertia: f32,
    /// Its weight less buoyancy over that inertia: the share of gravity that acts on it.
    pub(crate) gravity: f32,
    /// The share of its velocity relative to the water that is left after drag.
    pub(crate) retained: f32,
}

impl Default for InWater {
    fn default() -> Self {
        Self { share: 0.0, inertia: 1.0, gravity: 1.0, retained: 1.0 }
    }
}

impl Strand {
    /// A strand at rest along `points`, root first, in its hair's frame. Lengths and the angle at
    /// which it leaves the scalp are taken from them.
    ///
    /// ```
    /// # use bevy_keratin::prelude::*; use bevy::prelude::*;
    /// let straight = Strand::from_polyline(&[Vec3::ZERO, Vec3::Y * 0.03, Vec3::Y * 0.06]).unwrap();
    /// assert_eq!(straight.edges(), 2);
    /// assert!(Strand::from_polyline(&[Vec3::ZERO]).is_err());
    /// ```
    ///
    /// # Errors
    /// With fewer than two points, a point that is not finite, or a segment outside
    /// [`MIN_SEGMENT`]…[`MAX_SEGMENT`].
    pub fn from_polyline(points: &[Vec3]) -> Result<Self, StrandError> {
        if points.len() < 2 {
            return Err(StrandError::TooFewNodes { found: points.len() });
        }
        if let Some(node) = points.iter().position(|p| !p.is_finite()) {
            return Err(StrandError::NonFinite { node });
        }
        let rest_lengths: Vec<f32> = points.windows(2).map(|p| p[0].distance(p[1])).collect();
        if let Some(segment) = rest_lengths.iter().position(|l| *l < MIN_SEGMENT) {
            return Err(StrandError::ZeroLength { segment });
        }
        if let Some(segment) = rest_lengths.iter().position(|l| *l > MAX_SEGMENT) {
            return Err(StrandError::TooLong { segment });
        }
        let orientations = parallel_transport(points, None);
        Ok(Self {
            velocities: vec![Vec3::ZERO; points.len()],
            unforced: Vec::new(),
            blown: Vec::new(),
            angular_velocities: vec![Vec3::ZERO; orientations.len()],
            positions: points.to_vec(),
            root_frame: orientations[0],
            tensions: vec![0.0; orientations.len()],
            orientations,
            rest_lengths,
            root_before: None,
            fault_cooldown: 0,
        })
    }

    /// How many nodes there are, root and tip included.
    pub fn nodes(&self) -> usize {
        self.positions.len()
    }

    /// How many edges, and joints, there are: one fewer than nodes.
    pub fn edges(&self) -> usize {
        self.rest_lengths.len()
    }

    /// Node positions (m), root first.
    pub fn positions(&self) -> &[Vec3] {
        &self.positions
    }

    /// Node positions (m) to edit. Moving the first moves the root.
    pub fn positions_mut(&mut self) -> &mut [Vec3] {
        &mut self.positions
    }

    /// Node velocities (m/s) in the world, along the axes of the hair's frame.
    pub fn velocities(&self) -> &[Vec3] {
        &self.velocities
    }

    /// Node velocities (m/s) to edit.
    pub fn velocities_mut(&mut self) -> &mut [Vec3] {
        &mut self.velocities
    }

    /// Edge orientations; R(q) e3 is the tangent.
    pub fn orientations(&self) -> &[Quat] {
        &self.orientations
    }

    /// Edge angular velocities (rad/s).
    pub fn angular_velocities(&self) -> &[Vec3] {
        &self.angular_velocities
    }

    /// Rest lengths of the edges (m).
    pub fn rest_lengths(&self) -> &[f32] {
        &self.rest_lengths
    }

    /// The scalp's frame q_{−1} at the root.
    pub fn root_frame(&self) -> Quat {
        self.root_frame
    }

    /// Length along the strand at rest (m).
    pub fn length(&self) -> f32 {
        self.rest_lengths.iter().sum()
    }

    /// Ω of joint `i`, between edges i−1 and i (joint 0: the scalp and edge 0), as a full quaternion
    /// with real part ≥ 0. For an untwisted joint |Im Ω| = sin(θ/2), θ the turning angle.
    #[inline]
    pub fn darboux(&self, i: usize) -> Quat {
        // Of fewer orientations than edges, as an inspector may write them, those that are missing turn no joint.
        let edge = |i: usize| self.orientations.get(i).copied().unwrap_or(Quat::IDENTITY);
        let before = if i == 0 { self.root_frame } else { edge(i - 1) };
        darboux(before, edge(i))
    }

    /// The largest |length/rest − 1| over the segments.
    pub fn peak_strain(&self) -> f32 {
        (self.positions.windows(2).zip(&self.rest_lengths))
            .map(|(p, l)| (p[0].distance(p[1]) / l - 1.0).abs())
            .fold(0.0, f32::max)
    }

    /// Whether every number of the state is finite.
    pub fn is_finite(&self) -> bool {
        self.is_pose_finite()
            && self.velocities.iter().all(|v| v.is_finite())
            && self.angular_velocities.iter().all(|v| v.is_finite())
    }

    fn is_pose_finite(&self) -> bool {
        self.positions.iter().all(|p| p.is_finite())
            && self.orientations.iter().all(|q| q.is_finite() && q.length_squared() > 0.25)
    }

    /// Whether an edge is a thousand times as long as at rest: no step recovers from that.
    fn is_torn(&self) -> bool {
        let mut edges = self.positions.windows(2).zip(&self.rest_lengths);
        !edges.all(|(p, rest)| p[0].distance_squared(p[1]) < (1e3 * rest).powi(2))
    }

    /// Sets every velocity to zero.
    pub fn rest(&mut self) {
        self.velocities.fill(Vec3::ZERO);
        self.blown.clear();
        self.angular_velocities.fill(Vec3::ZERO);
        self.tensions.fill(0.0);
    }

    /// Adds a rigid motion: a velocity (m/s) at the origin, and a spin (rad/s). One beyond all numbers is left out.
    pub(crate) fn add_motion(&mut self, velocity: Vec3, spin: Vec3) {
        for (v, p) in self.velocities.iter_mut().zip(&self.positions) {
            let moved = *v + (velocity + spin.cross(*p));
            *v = if moved.is_finite() { moved } else { *v };
        }
        for v in &mut self.angular_velocities {
            let turned = *v + spin;
            *v = if turned.is_finite() { turned } else { *v };
        }
    }

    /// Sets the strand to the shape given by a Darboux vector per joint, at rest, from its root on.
    /// Joints not given are straight.
    pub fn pose(&mut self, shape: impl IntoIterator<Item = Vec3>) {
        if !self.root_frame.is_finite() {
            self.root_frame = Quat::IDENTITY;
        }
        let mut shape = shape.into_iter();
        let mut p = self.positions.first().copied().filter(|p| p.is_finite()).unwrap_or_default();
        let mut q = self.root_frame;
        for i in 0..self.edges() {
            q = (q * full(shape.next().unwrap_or_default())).normalize();
            self.positions[i] = p;
            self.orientations[i] = q;
            p += q * Vec3::Z * self.rest_lengths[i];
        }
        if let Some(tip) = self.positions.last_mut() {
            *tip = p;
        }
        self.rest();
    }

    /// Puts each node at a place (m) with a velocity (m/s); edges turn the shortest way.
    #[cfg(feature = "groom")]
    pub(crate) fn put_nodes(&mut self, node: impl Fn(usize) -> (Vec3, Vec3)) {
        self.rest();
        self.root_before = None;
        for (i, (place, velocity)) in
            self.positions.iter_mut().zip(&mut self.velocities).enumerate()
        {
            (*place, *velocity) = node(i);
        }
        for (ends, q) in self.positions.windows(2).zip(&mut self.orientations) {
            if let Some(along) = (ends[1] - ends[0]).try_normalize() {
                *q = (Quat::from_rotation_arc((*q * Vec3::Z).normalize(), along) * *q).normalize();
            }
        }
    }

    /// Moves the root, with the scalp's frame.
    pub(crate) fn put_root(&mut self, place: Vec3, frame: Quat) {
        if let Some(root) = self.positions.first_mut()
            && place.is_finite()
            && frame.is_finite()
        {
            self.root_before.get_or_insert((*root, self.root_frame));
            *root = place;
            self.root_frame = frame.normalize();
        }
    }

    /// The root is where it is, and has not moved; the scalp's frame is this one.
    #[cfg(feature = "gpu")]
    pub(crate) fn settle_root(&mut self, frame: Quat) {
        self.root_before = None;
        if frame.is_finite() {
            self.root_frame = frame;
        }
    }

    /// Replaces its state by another with as many nodes, at rest.
    #[cfg(any(feature = "save", feature = "groom"))]
    pub(crate) fn replace(
        &mut self,
        positions: Vec<Vec3>,
        orientations: Vec<Quat>,
        rest_lengths: Vec<f32>,
        root_frame: Quat,
    ) {
        *self = Self {
            velocities: vec![Vec3::ZERO; positions.len()],
            unforced: Vec::new(),
            blown: Vec::new(),
            angular_velocities: vec![Vec3::ZERO; orientations.len()],
            tensions: vec![0.0; orientations.len()],
            positions,
            orientations,
            rest_lengths,
            root_frame,
            root_before: None,
            fault_cooldown: 0,
        };
    }

    /// From here to [`end_air`](Self::end_air) velocities are changed by air and gravity.
    pub(crate) fn begin_air(&mut self) {
        self.unforced.clone_from(&self.velocities);
    }

    pub(crate) fn end_air(&mut self) {
        let now = self.velocities.iter().zip(&self.unforced);
        self.blown.clear();
        self.blown.extend(now.map(|(now, before)| *now - *before));
    }

    /// Velocities before the forces of this substep, and what air and gravity have added to each (m/s); `None` where
    /// neither acts.
    pub(crate) fn forced(&self) -> Option<(&[Vec3], &[Vec3])> {
        let nodes = self.velocities.len();
        let is_known = self.unforced.len() == nodes && self.blown.len() == nodes;
        is_known.then_some((&self.unforced, &self.blown))
    }

    /// Prefetches positions, velocities and orientations.
    pub(crate) fn prefetch(&self) {
        prefetch(&self.positions);
        prefetch(&self.velocities);
        prefetch(&self.orientations);
    }

    /// Tension that the last substep of the direct solver left in each edge, for hair of which a whole
    /// node weighs 1 kg (N).
    pub(crate) fn tensions(&self) -> &[f32] {
        &self.tensions
    }

    pub(crate) fn tensions_mut(&mut self) -> &mut [f32] {
        &mut self.tensions
    }

    /// The root's position at the end of the last substep, in the hair's frame, and the scalp's
    /// frame.
    pub(crate) fn root_before(&self) -> (Vec3, Quat) {
        self.root_before.unwrap_or((self.positions[0], self.root_frame))
    }

    pub(crate) fn parts(&self) -> (&[Vec3], &[Vec3], &[Quat], &[Vec3]) {
        (&self.positions, &self.velocities, &self.orientations, &self.angular_velocities)
    }

    pub(crate) fn motion_parts(&mut self) -> (&[Vec3], &mut [Vec3], &[f32]) {
        (&self.positions, &mut self.velocities, &self.rest_lengths)
    }

    pub(crate) fn parts_mut(&mut self) -> (&mut [Vec3], &mut [Vec3], &mut [Quat], &mut [Vec3]) {
        (
            &mut self.positions,
            &mut self.velocities,
            &mut self.orientations,
            &mut self.angular_velocities,
        )
    }

    /// After a step with a non-finite result: back to the previous state, at rest, or if that is not
    /// finite, torn, or where the last step failed, to the pose its bonds remember. Returns the fault,
    /// unless one was reported shortly before.
    pub(crate) fn put_back(&mut self, bonds: impl IntoIterator<Item = Vec3>) -> Option<HairFault> {
        // Not to a pose from which the last step failed as well.
        let failed_again = self.fault_cooldown == FAULT_COOLDOWN;
        let how = if self.is_pose_finite() && !self.is_torn() && !failed_again {
            self.rest();
            HairFault::new(
                FaultKind::PutBack,
                "the strand became non-finite and was put back to its last finite state, at rest: \
                 check forces, and roots and colliders that jump",
            )
        } else {
            self.pose(bonds.into_iter().map(|o| if o.is_finite() { o } else { Vec3::ZERO }));
            HairFault::new(
                FaultKind::Rebuilt,
                "no step from the strand's state succeeded; its rest pose was rebuilt from root and bonds: \
                 check forces, and roots and colliders that jump",
            )
        };
        let again = core::mem::replace(&mut self.fault_cooldown, FAULT_COOLDOWN) > 0;
        (!again).then_some(how)
    }

    pub(crate) fn step_succeeded(&mut self) {
        self.blown.clear();
        self.fault_cooldown = self.fault_cooldown.saturating_sub(1);
        self.root_before = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn motion_beyond_all_numbers_is_left_out() {
        let mut strand = Strand::from_polyline(&[Vec3::ZERO, Vec3::X, Vec3::X * 2.0]).unwrap();
        strand.add_motion(Vec3::Y, Vec3::Z);
        let before = (strand.velocities.clone(), strand.angular_velocities.clone());
        assert_eq!(before, (vec![Vec3::Y, Vec3::Y * 2.0, Vec3::Y * 3.0], vec![Vec3::Z; 2]));
        strand.add_motion(Vec3::NAN, Vec3::splat(f32::INFINITY));
        assert_eq!((strand.velocities, strand.angular_velocities), before);
    }

    #[test]
    fn bad_polylines_are_refused_with_a_reason() {
        let refuse = |points: &[Vec3]| Strand::from_polyline(points).unwrap_err();
        assert_eq!(refuse(&[]), StrandError::TooFewNodes { found: 0 });
        assert_eq!(refuse(&[Vec3::ZERO, Vec3::NAN]), StrandError::NonFinite { node: 1 });
        let zero = refuse(&[Vec3::ZERO, Vec3::X, Vec3::X]);
        assert_eq!(zero, StrandError::ZeroLength { segment: 1 });
        assert!(zero.to_string().ends_with("merge nodes 1 and 2"), "{zero}");
        assert!(matches!(
            refuse(&[Vec3::splat(-3e38), Vec3::splat(3e38)]),
            StrandError::TooLong { segment: 0 }
        ));
    }

    #[test]
    fn an_edge_of_a_thousand_times_its_length_is_torn() {
        let points: Vec<Vec3> = (0..4).map(|i| Vec3::X * (0.01 * i as f32)).collect();
        let mut strand = Strand::from_polyline(&points).unwrap();
        for (end, torn) in [(0.02 + 9.9, false), (0.02 + 10.1, true), (-1e30, true)] {
            strand.positions[3].x = end;
            assert_eq!(strand.is_torn(), torn, "its last edge ends at {end} m");
        }
    }

    #[test]
    fn every_number_that_is_not_finite_is_seen() {
        let points: Vec<Vec3> = (0..4).map(|i| Vec3::X * (0.01 * i as f32)).collect();
        let whole = Strand::from_polyline(&points).unwrap();
        assert!(whole.is_finite());
        for (i, k, bad) in
            (0..12).flat_map(|c| [f32::NAN, f32::INFINITY].map(|bad| (c / 3, c % 3, bad)))
        {
            let mut spoilt = vec![whole.clone(), whole.clone()];
            spoilt[0].positions[i][k] = bad;
            spoilt[1].velocities[i][k] = bad;
            if i < whole.edges() {
                spoilt.extend([whole.clone(), whole.clone(), whole.clone()]);
                spoilt[2].angular_velocities[i][k] = bad;
                spoilt[3].orientations[i] = Quat::from_vec4(Vec4::W.with_x(bad));
                spoilt[4].orientations[i] = Quat::from_array([0.0; 4]);
            }
            for (what, strand) in spoilt.iter().enumerate() {
                assert!(!strand.is_finite(), "{bad} in list {what}, element {i}, component {k}");
            }
        }
    }

    #[test]
    fn posing_a_strand_in_its_own_shape_changes_nothing() {
        let points: Vec<Vec3> = (0..10)
            .map(|i| i as f32)
            .map(|t| Vec3::new((t * 0.5).cos(), t * 0.3, (t * 0.5).sin()) * 0.05)
            .collect();
        let mut strand = Strand::from_polyline(&points).unwrap();
        let shape: Vec<Vec3> = (0..strand.edges()).map(|i| strand.darboux(i).xyz()).collect();
        strand.pose(shape);
        for (a, b) in strand.positions().iter().zip(&points) {
            assert!(a.distance(*b) < 1e-6);
        }
        assert!(strand.peak_strain() < 1e-5);
    }
}
