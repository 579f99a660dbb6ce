//! The droplets around one hair in a spatial index, in the grid's order.

use crate::base::grid::{BallGrid, FoundBalls};
use bevy::prelude::*;
use fearless_simd::Level;

/// A droplet in the frame of one hair.
#[derive(Clone, Copy, Debug)]
pub(super) struct LocalDrop {
    pub at: Vec3,
    /// Where it was a substep ago, for drops that fall.
    pub before: Vec3,
    pub velocity: Vec3,
    pub radius: f32,
    pub r_min: f32,
    pub r_max: f32,
    pub strength: f32,
    /// kg.
    pub mass: f32,
    /// Number of strands that touched it a substep ago.
    pub touch_count: f32,
    pub ride: Option<Entity>,
}

impl LocalDrop {
    /// Distance at which a lock of radius `clearance` touches it: its core repels strands within r_min.
    pub fn touch(&self, clearance: f32) -> f32 {
        self.radius.max(self.r_min) + clearance
    }
}

/// A droplet on a strand, which pulls, with the factors of \[W\] equation 2 that are the same for all
/// nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Puller {
    pub center: Vec3,
    /// Squared distance beyond which it has no effect.
    pub reach: f32,
    /// Squared distance up to which a strand touches it.
    pub touch: f32,
    /// r_max².
    pub pulls_within: f32,
    /// 2 / (r_max − r_min).
    pub steep: f32,
    /// (r_max + r_min) / (r_max − r_min).
    pub middle: f32,
    pub strength: f32,
    /// Which droplet it is.
    pub drop: u32,
    /// The index of the strand that it rides.
    pub rides: u32,
}

/// A droplet that falls.
#[derive(Clone, Copy, Debug)]
pub(super) struct Falling {
    /// Where it was a substep ago.
    pub from: Vec3,
    /// Its displacement since.
    pub displacement: Vec3,
    /// Distance from its path within which it hits an edge (m).
    pub near: f32,
    /// Which droplet it is.
    pub drop: u32,
}

/// The droplets around a hair, indexed by position.
#[derive(Clone, Debug, Default)]
pub(super) struct Field {
    pub drops: Vec<LocalDrop>,
    /// Droplets that ride, by number.
    pub pullers: Vec<Puller>,
    riding: BallGrid,
    /// Droplets that fall, by number.
    pub fallers: Vec<Falling>,
    falling: BallGrid,
    /// Pairs of strand and droplet on it, sorted.
    riders: Vec<(Entity, u32)>,
}

impl Field {
    /// Sorts the droplets for strands of locks of radius `clearance` (m).
    pub fn sort(&mut self, clearance: f32) {
        let Self { drops, pullers, riding, fallers, falling, riders } = self;
        let numbered = || (0..).zip(&*drops);
        riders.clear();
        riders.extend(numbered().filter_map(|(k, drop)| Some((drop.ride?, k))));
        riders.sort_unstable();
        pullers.clear();
        pullers.extend(numbered().filter_map(|(drop, local)| {
            let touch = local.touch(clearance);
            let reach = local.r_max.max(touch);
            let width = local.r_max - local.r_min;
            Some(Puller {
                center: local.at,
                reach: reach * reach,
                touch: touch * touch,
                pulls_within: local.r_max * local.r_max,
                steep: 2.0 / width,
                middle: (local.r_max + local.r_min) / width,
                strength: local.strength,
                drop,
                rides: local.ride?.index_u32(),
            })
        }));
        riding.build(pullers.iter().map(|p| (p.center, p.reach.sqrt())));
        fallers.clear();
        fallers.extend(numbered().filter(|(_, local)| local.ride.is_none()).map(
            |(drop, local)| {
                // A droplet that was moved from outside did not travel its whole displacement.
                let displacement = (local.at - local.before).clamp_length_max(0.2);
                Falling {
                    from: local.at - displacement,
                    displacement,
                    near: local.radius + clearance,
                    drop,
                }
            },
        ));
        falling.build(
            fallers
                .iter()
                .map(|f| (f.from + 0.5 * f.displacement, f.near + 0.5 * f.displacement.length())),
        );
    }

    /// The droplets on a strand.
    pub fn on(&self, strand: Entity) -> impl Iterator<Item = (u32, &LocalDrop)> {
        let first = self.riders.partition_point(|(ridden, _)| *ridden < strand);
        let theirs = self.riders[first..].iter().take_while(move |(ridden, _)| *ridden == strand);
        theirs.map(|&(_, k)| (k, &self.drops[k as usize]))
    }

    /// The [`pullers`](Self::pullers) that reach a box.
    pub fn pulling(&self, level: Level, low: Vec3, high: Vec3, found: &mut FoundBalls) {
        self.riding.reaching(level, low, high, found);
    }

    /// The [`fallers`](Self::fallers) that may have hit something in a box.
    pub fn falling(&self, level: Level, low: Vec3, high: Vec3, found: &mut FoundBalls) {
        self.falling.reaching(level, low, high, found);
    }
}
