//! What acts on a hair in one substep, as the kernel reads it.

use super::{
    followers::FollowRecord,
    residence::Unsupported,
    sweeps::{self, SweepRecord, UnusedSpins},
};
use crate::{
    keratin::bond::Cuticle,
    simulation::{
        lod::follow::Frame,
        sleep::model::{turn, within},
    },
    solver::rod::{
        obstacle::{Obstacle, Solid},
        shape::{Placed, Shape},
    },
};
use bevy::{
    ecs::{component::Component, entity::EntityHashMap},
    math::{Affine3A, Isometry3d, Quat, Vec3},
};
use core::ops::Range;

/// Kinematic targets of substeps that are uploaded together, at most: 64 MB.
pub(super) const MAX_TARGETS: usize = 1 << 21;

/// The maximum number of obstacles in a record.
pub const MAX_OBSTACLES: usize = 128;

// `bearer_of` in `strand.wgsl` has eight bits.
const _: () = assert!(MAX_OBSTACLES <= 256);

/// The maximum number of blowers in a record.
pub const MAX_BLOWERS: usize = 4;

/// Treatments of some joints that a record holds at most.
pub const MOST_TREATMENTS: usize = 8;

/// Words of a record. Uniform buffers are bound at multiples of 256 bytes.
pub(super) const WORDS: usize = (HEADER + 32 * MAX_OBSTACLES).next_multiple_of(64);

/// Words before the obstacles, and before the treatments.
const HEADER: usize = BEFORE_TREATMENTS + COUNTS + 12 * MOST_TREATMENTS;
const BEFORE_TREATMENTS: usize = 40 + 20 * MAX_BLOWERS;

/// Words of counts, of how followers move, of sleep and of the projections.
const COUNTS: usize = 28 + sweeps::WORDS;

/// A blower in the hair's frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct BlowerRecord {
    /// Its nozzle (m).
    pub nozzle: Vec3,
    /// Unit direction of its wind.
    pub aim: Vec3,
    /// α of equation 17 (m/s²).
    pub strength: f32,
    /// Rate per velocity of equation 19 (s/m).
    pub drying: f32,
    /// How it moves, and turns (m/s, rad/s).
    pub velocity: Vec3,
    /// Its angular velocity (rad/s).
    pub spin: Vec3,
    /// Where it has that velocity (m).
    pub center: Vec3,
    /// How far from it its air keeps its speed (m in the hair's measure).
    pub core: f32,
}

/// The substeps of a hair, in their order. Component of a [`Hair`](crate::Hair); filled by the tick, emptied
/// by whoever runs them.
#[derive(Component, Clone, Debug, Default)]
#[component(clone_behavior = Ignore)]
pub struct GpuJournal {
    /// The substeps.
    pub records: Vec<SubstepRecord>,
    /// Which nodes the last of them held.
    pub(super) held: HeldIndices,
    /// How the hair's frame has moved in this tick, and for how long followers have followed (s).
    pub(super) frame: Frame,
    pub(super) followed: f32,
    /// Sleep of the hair.
    pub(super) rest: Rest,
    /// What has become of the angular velocities that the direct method does not have.
    pub(super) unused_spins: UnusedSpins,
}

/// Whether a hair sleeps, as far as that is known.
#[derive(Clone, Debug, Default)]
pub(super) struct Rest {
    /// Whether it does: then no substep is written down.
    pub(super) is_asleep: bool,
    /// Whether something disturbs it in this tick.
    pub(super) wakes: bool,
    /// How many ticks it was given, and up to which of them something disturbed it.
    pub(super) ticks: u32,
    pub(super) disturbed: u32,
    /// Whether a substep of this tick has been written down.
    pub(super) has_begun: bool,
    /// The kinematic targets when they last moved.
    pub(super) targets: Vec<KinematicTarget>,
}

impl Rest {
    /// Something disturbs it.
    pub(super) fn wake(&mut self) {
        (self.is_asleep, self.wakes) = (false, true);
    }

    /// Whether the targets have moved since this last was so.
    pub(super) fn note_targets(
        &mut self,
        targets: &[KinematicTarget],
        distance: f32,
        angle: f32,
    ) -> bool {
        let alike = |a: &KinematicTarget, b: &KinematicTarget| {
            let apart = a.place.unwrap_or_default().distance(b.place.unwrap_or_default());
            (a.strand, a.node, a.place.is_some()) == (b.strand, b.node, b.place.is_some())
                && within(apart, distance)
                && within(turn(a.frame, b.frame), angle)
        };
        let same = targets.len() == self.targets.len()
            && targets.iter().zip(&self.targets).all(|(a, b)| alike(a, b));
        if !same {
            targets.clone_into(&mut self.targets);
        }
        !same
    }

    /// The device reports that it slept in this tick.
    pub(super) fn slept_in(&mut self, tick: u32) -> bool {
        let falls = !self.is_asleep && self.disturbed < tick && tick <= self.ticks;
        self.is_asleep |= falls;
        falls
    }
}

impl GpuJournal {
    /// The device reports that the hair slept in this tick.
    pub(super) fn slept_in(&mut self, tick: u32) -> bool {
        let falls = self.rest.slept_in(tick);
        if falls {
            self.unused_spins.rest();
        }
        falls
    }

    /// Whether more than so many substeps wait, or more targets than are uploaded together.
    pub(super) fn is_long(&self, most: usize) -> bool {
        self.records.len() > most
            || self.records.iter().map(|record| record.targets.len()).sum::<usize>() > MAX_TARGETS
    }
}

/// Which nodes of a hair were held in a substep, so that the next one frees those that no longer are.
#[derive(Clone, Debug, Default)]
pub(super) struct HeldIndices {
    /// Strand and node, in their order.
    pub(super) nodes: Vec<(u32, u32)>,
    /// The indices of strands, once they are needed.
    pub(super) of: EntityHashMap<u32>,
}

/// A treatment of some joints of every strand.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct TreatmentRecord {
    /// As [`SubstepRecord::change`].
    pub change: [f32; 4],
    /// As [`SubstepRecord::share`].
    pub share: [f32; 4],
    /// The joints, from the root.
    pub joints: Range<u32>,
}

/// A node that something else moves: the root of a strand on a mesh, or a held node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct KinematicTarget {
    /// Index of its strand.
    pub strand: u32,
    /// The node; 0 is the root.
    pub node: u32,
    /// Where it is at the end of the substep (m); `None` from which on it is free again.
    pub place: Option<Vec3>,
    /// The scalp's frame at the end of the substep; of roots alone.
    pub frame: Quat,
}

/// What acts on a hair in one substep.
#[derive(Clone, Debug, Default)]
pub struct SubstepRecord {
    /// Length (s).
    pub dt: f32,
    /// Gravity in the hair's frame (m/s²).
    pub gravity: Vec3,
    /// How points at rest in the world move in the hair's frame during the substep; `None` if the
    /// frame rests.
    pub frame_motion: Option<Isometry3d>,
    /// The global wind in the hair's frame (m/s).
    pub wind: Vec3,
    /// What of it only puts a headwind into metres a second: no jet displaces it (m/s).
    pub headwind: Vec3,
    /// Share of its velocity relative to the air that hair keeps.
    pub retained: f32,
    /// Influences f_j of the bonds.
    pub influence: [f32; 4],
    /// Requested Δb of every joint, by kind.
    pub change: [f32; 4],
    /// The share of its rate that is subtracted as well: a treatment that moves rates toward b by a
    /// share s requests a change of s b and a share of s.
    pub share: [f32; 4],
    /// The same of some joints, [`MOST_TREATMENTS`] at most.
    pub treatments: Vec<TreatmentRecord>,
    /// Gravity-bending length (m).
    pub bending_length: f32,
    /// Kelvin–Voigt time (s).
    pub damping: f32,
    /// G J/(E I); the paper's projections have 1.
    pub torsion: f32,
    /// Distance that nodes keep from obstacles (m).
    pub skin: f32,
    /// Newton steps of the length limiter, at most.
    pub limiter_steps: u32,
    /// The paper's projections; `None` of hair that the direct method solves.
    pub sweeps: Option<SweepRecord>,
    /// Wear of the cuticle.
    pub cuticle: Cuticle,
    /// Blowers, [`MAX_BLOWERS`] at most.
    pub blowers: Vec<BlowerRecord>,
    /// Obstacles in the hair's frame, [`MAX_OBSTACLES`] at most.
    pub obstacles: Vec<Obstacle>,
    /// Whether it is the tick's first, which records the nodes' positions.
    pub notes_before: bool,
    /// Whether velocities are zeroed first: the hair has come back to the world.
    pub rests: bool,
    /// Whether rest shapes are computed from the bonds first.
    pub shapes: bool,
    /// Nodes that have a target in this substep, and those that no longer have. All roots or none.
    pub targets: Vec<KinematicTarget>,
    /// How followers move; in the tick's last substep.
    pub follows: Option<FollowRecord>,
    /// Whether the hair may sleep; `None` of hair that never does.
    pub sleep: Option<SleepRecord>,
}

/// Sleep of a hair as a whole in a tick. Rust twin: [`SleepSettings`](crate::SleepSettings), of all its strands.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SleepRecord {
    /// The tick, of those that the hair was given: from 1 on.
    pub tick: u32,
    /// Whether something disturbs it, so that it does not sleep in this tick.
    pub wakes: bool,
    /// Whether this is the tick's last substep.
    pub ends: bool,
    /// How far a node may move (m) and an edge may turn (rad), and for how long (s).
    pub distance: f32,
    pub angle: f32,
    pub seconds: f32,
    /// Length of the tick (s).
    pub dt: f32,
}

/// The word of the report that holds the last tick in which the hair slept.
pub(super) const SLEPT: usize = 11;

/// The words of the report that hold whether a strand was not still at the end of a tick, of three ticks in
/// turn; and how many words it has with them.
pub(super) const RESTLESS: usize = 16;
pub(super) const REPORT_WORDS: usize = RESTLESS + 4;

impl SleepRecord {
    fn write(&self, words: &mut Words<'_>) {
        words.numbers([self.distance, self.angle, self.seconds, self.dt]);
        words.word(self.tick);
        // Of this tick, of the one before and of the next.
        for later in [0, 2, 1] {
            words.word(RESTLESS as u32 + (self.tick % 3 + later) % 3);
        }
    }
}

/// Bits beside the slot of a kinematic target: it is the root; it is let go.
pub(super) const ROOT: u32 = 1 << 30;
pub(super) const FREE: u32 = 1 << 31;

// Flags of a record.
pub(super) const FRAME_MOVES: u32 = 1;
pub(super) const SHAPES: u32 = 2;
pub(super) const REMEMBERS: u32 = 4;
pub(super) const NOTES_BEFORE: u32 = 8;
pub(super) const RESTS: u32 = 16;
pub(super) const ROOT_TARGETS: u32 = 32;
pub(super) const HOLDS: u32 = 64;
pub(super) const FOLLOWS: u32 = 128;
pub(super) const WAKES: u32 = 256;
pub(super) const SWEEPS: u32 = 512;

// Kinds of obstacles.
pub(super) const HALF_SPACE: u32 = 0;
pub(super) const CAPSULE: u32 = 1;
pub(super) const CYLINDER: u32 = 2;
pub(super) const ELLIPSOID: u32 = 3;

impl SubstepRecord {
    /// Appends the record's words.
    pub fn write(&self, out: &mut Vec<u32>) {
        self.write_of(
            out,
            &Indices { targets: 0..self.targets.len() as u32, ..Indices::default() },
        );
    }

    /// The same for these strands.
    pub(super) fn write_of(&self, out: &mut Vec<u32>, indices: &Indices) {
        let start = out.len();
        let mut words = Words(out);
        let blowers = &self.blowers[..self.blowers.len().min(MAX_BLOWERS)];
        let obstacles = self.obstacles.iter().filter(|obstacle| is_supported(&obstacle.solid));
        let obstacles: Vec<_> = obstacles.take(MAX_OBSTACLES).collect();
        let remembers = blowers.iter().any(|b| b.drying != 0.0)
            || self.change.iter().chain(&self.share).any(|c| *c != 0.0)
            || !self.treatments.is_empty();
        let flags = [
            (self.frame_motion.is_some(), FRAME_MOVES),
            (self.shapes, SHAPES),
            (remembers, REMEMBERS),
            (self.notes_before, NOTES_BEFORE),
            (self.rests, RESTS),
            (self.targets.iter().any(|target| target.node == 0), ROOT_TARGETS),
            (self.targets.iter().any(|target| target.node > 0 && target.place.is_some()), HOLDS),
            (self.follows.is_some(), FOLLOWS),
            (self.sleep.is_none_or(|sleep| sleep.wakes), WAKES),
            (indices.has_spins, SWEEPS),
        ];
        let flags = flags.iter().filter(|(on, _)| *on).map(|(_, bit)| bit).sum();
        let frame_motion = self.frame_motion.unwrap_or_default();
        words.vector(self.gravity, self.dt.to_bits());
        words.numbers(frame_motion.rotation.to_array());
        words.vector(frame_motion.translation.into(), flags);
        words.vector(self.wind, self.retained.to_bits());
        words.vector(self.headwind, 0);
        words.numbers(self.influence);
        words.numbers(self.change);
        words.numbers(self.share);
        words.numbers([self.bending_length, self.damping, self.skin]);
        words.word(self.limiter_steps);
        words.numbers([self.cuticle.damage, self.cuticle.softening]);
        words.word(blowers.len() as u32);
        words.word(obstacles.len() as u32);
        for blower in blowers {
            words.vector(blower.nozzle, blower.strength.to_bits());
            words.vector(blower.aim, blower.drying.to_bits());
            words.vector(blower.velocity, blower.core.to_bits());
            words.vector(blower.spin, 0);
            words.vector(blower.center, 0);
        }
        words.0.resize(start + BEFORE_TREATMENTS, 0);
        let treatments = &self.treatments[..self.treatments.len().min(MOST_TREATMENTS)];
        words.word(treatments.len() as u32);
        for range in [&indices.targets, &indices.root_targets] {
            words.word(range.start);
            words.word(range.end - range.start);
        }
        words.word(indices.first_follower_block);
        words.word(indices.first_follower_slot);
        words.numbers([self.torsion]);
        words.numbers(self.follows.unwrap_or_default().words());
        self.sleep.unwrap_or_default().write(&mut words);
        let sweeps = SweepRecord::words(self.sweeps.as_ref(), self.dt, self.bending_length);
        sweeps.into_iter().for_each(|word| words.word(word));
        for treatment in treatments {
            words.numbers(treatment.change);
            words.numbers(treatment.share);
            words.word(treatment.joints.start);
            words.word(treatment.joints.end);
            words.numbers([0.0; 2]);
        }
        words.0.resize(start + HEADER, 0);
        for obstacle in obstacles {
            words.obstacle(obstacle);
        }
        out.resize(start + WORDS, 0);
    }
}

/// Why no record can hold these: hair that they are near to is simulated on the CPU.
pub(super) fn unsupported(solids: &[Obstacle]) -> Option<Unsupported> {
    let is_supported = solids.iter().all(|obstacle| is_supported(&obstacle.solid));
    let is_too_long = solids.len() > MAX_OBSTACLES;
    (is_too_long.then_some(Unsupported::Colliders))
        .or((!is_supported).then_some(Unsupported::ColliderShape))
}

fn is_supported(solid: &Solid) -> bool {
    !matches!(solid, Solid::Placed(placed) if !matches!(placed.shape, Shape::Ellipsoid { .. }))
}

/// Where the kernels find what belongs to a record.
#[derive(Clone, Debug, Default)]
pub(super) struct Indices {
    /// The targets of simulated strands' nodes, and of followers' roots.
    pub(super) targets: Range<u32>,
    pub(super) root_targets: Range<u32>,
    pub(super) first_follower_block: u32,
    pub(super) first_follower_slot: u32,
    /// Whether the strands have angular velocities, which the paper's projections need.
    pub(super) has_spins: bool,
}

struct Words<'a>(&'a mut Vec<u32>);

impl Words<'_> {
    fn word(&mut self, word: u32) {
        self.0.push(word);
    }

    fn numbers<const N: usize>(&mut self, numbers: [f32; N]) {
        self.0.extend(numbers.map(f32::to_bits));
    }

    fn vector(&mut self, v: Vec3, last: u32) {
        self.numbers(v.to_array());
        self.word(last);
    }

    fn obstacle(&mut self, Obstacle { solid, motion, friction }: &Obstacle) {
        let ellipsoid = match solid {
            Solid::Placed(placed @ Placed { shape: Shape::Ellipsoid { radii }, .. }) => {
                Some((placed.axes, *radii * placed.scale))
            }
            _ => None,
        };
        let (kind, a, b, radius, half_height) = match *solid {
            Solid::Placed(ref placed) => {
                let (axes, half) = ellipsoid.unwrap_or_default();
                (ELLIPSOID, placed.center, axes.x_axis, half.x, half.y)
            }
            Solid::HalfSpace { normal, point } => (HALF_SPACE, normal, point, 0.0, 0.0),
            Solid::Capsule { a, b, radius } => (CAPSULE, a, b - a, radius, 0.0),
            Solid::Cylinder { center, axis, radius, half_height } => {
                (CYLINDER, center, axis, radius, half_height)
            }
        };
        let (axis, thickness) = match kind {
            HALF_SPACE => (Vec3::ZERO, 0.0),
            CAPSULE => (b.normalize_or_zero(), radius),
            _ => (b, radius.min(half_height)),
        };
        let across = b.try_normalize().map_or(Vec3::Y, |u| u.any_orthonormal_vector());
        let inverse = 1.0 / b.length_squared().max(1e-20);
        let (across, axis, inverse, thickness) = match ellipsoid {
            Some((axes, half)) => (axes.y_axis, axes.z_axis, half.z, half.min_element()),
            None => (across, axis, inverse, thickness),
        };
        let moved = motion.unwrap_or(Affine3A::IDENTITY);
        let rows = moved.matrix3.transpose();
        let row = |axis: Vec3, offset: f32| axis.extend(offset).to_array();
        self.vector(a, kind);
        self.vector(b, radius.to_bits());
        self.vector(across, half_height.to_bits());
        self.vector(axis, friction.to_bits());
        self.numbers(row(rows.x_axis.into(), moved.translation.x));
        self.numbers(row(rows.y_axis.into(), moved.translation.y));
        self.numbers(row(rows.z_axis.into(), moved.translation.z));
        self.numbers([inverse, thickness]);
        self.word(motion.is_some().into());
        self.word(0);
    }
}
