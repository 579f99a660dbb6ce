//! The droplets around one hair, as its strands find them: by place, in the grid's order.

use crate::grid::{BallGrid, Found};
use bevy::prelude::*;
use fearless_simd::Level;

/// A droplet as the strands of one hair see it, in the hair's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenDrop {
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
    /// How many strands were at it a substep ago.
    pub company: f32,
    pub ride: Option<Entity>,
}

impl SeenDrop {
    /// How near a strand of locks of radius `skin` touches it: its core keeps strands away at r_min.
    pub fn touch(&self, skin: f32) -> f32 {
        self.radius.max(self.r_min) + skin
    }
}

/// A droplet that rides on a strand and pulls, with what of \[W\] equation 2 is the same for all
/// nodes.
#[derive(Clone, Copy, Debug)]
pub(super) struct Puller {
    pub center: Vec3,
    /// Squared distance from which on it does nothing.
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
    /// What it has gone since.
    pub way: Vec3,
    /// How near to its way an edge is that it hits (m).
    pub near: f32,
    /// Which droplet it is.
    pub drop: u32,
}

/// The droplets around a hair, found by place.
#[derive(Clone, Debug, Default)]
pub(super) struct Field {
    pub drops: Vec<SeenDrop>,
    /// Droplets that ride, by number.
    pub pullers: Vec<Puller>,
    riding: BallGrid,
    /// Droplets that fall, by number.
    pub fallers: Vec<Falling>,
    falling: BallGrid,
    /// Who is ridden by which droplet, sorted.
    riders: Vec<(Entity, u32)>,
}

impl Field {
    /// Sorts the droplets for strands of locks of radius `skin` (m).
    pub fn sort(&mut self, skin: f32) {
        let Self { drops, pullers, riding, fallers, falling, riders } = self;
        let numbered = || (0..).zip(&*drops);
        riders.clear();
        riders.extend(numbered().filter_map(|(k, drop)| Some((drop.ride?, k))));
        riders.sort_unstable();
        pullers.clear();
        pullers.extend(numbered().filter_map(|(drop, seen)| {
            let touch = seen.touch(skin);
            let reach = seen.r_max.max(touch);
            let width = seen.r_max - seen.r_min;
            Some(Puller {
                center: seen.at,
                reach: reach * reach,
                touch: touch * touch,
                pulls_within: seen.r_max * seen.r_max,
                steep: 2.0 / width,
                middle: (seen.r_max + seen.r_min) / width,
                strength: seen.strength,
                drop,
                rides: seen.ride?.index_u32(),
            })
        }));
        riding.build(pullers.iter().map(|p| (p.center, p.reach.sqrt())));
        fallers.clear();
        fallers.extend(numbered().filter(|(_, seen)| seen.ride.is_none()).map(|(drop, seen)| {
            // What was set elsewhere has not been on all of the way.
            let way = (seen.at - seen.before).clamp_length_max(0.2);
            Falling { from: seen.at - way, way, near: seen.radius + skin, drop }
        }));
        falling
            .build(fallers.iter().map(|f| (f.from + 0.5 * f.way, f.near + 0.5 * f.way.length())));
    }

    /// The droplets that ride a strand.
    pub fn on(&self, strand: Entity) -> impl Iterator<Item = (u32, &SeenDrop)> {
        let first = self.riders.partition_point(|(ridden, _)| *ridden < strand);
        let theirs = self.riders[first..].iter().take_while(move |(ridden, _)| *ridden == strand);
        theirs.map(|&(_, k)| (k, &self.drops[k as usize]))
    }

    /// The [`pullers`](Self::pullers) whose reach a box is in.
    pub fn pulling(&self, level: Level, low: Vec3, high: Vec3, found: &mut Found) {
        self.riding.reaching(level, low, high, found);
    }

    /// The [`fallers`](Self::fallers) that may have hit something in a box.
    pub fn falling(&self, level: Level, low: Vec3, high: Vec3, found: &mut Found) {
        self.falling.reaching(level, low, high, found);
    }
}
