//! The droplets around one hair, as its strands find them: by place, in the grid's order.

use super::adhesion::WIDTH;
use crate::grid::{Runs, UniformGrid};
use bevy::prelude::*;

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

/// Balls around droplets, found by a point in them.
#[derive(Clone, Debug, Default)]
struct Places {
    grid: UniformGrid,
    widest: f32,
}

impl Places {
    /// Sorts balls, each a centre, a radius and the droplet's number.
    fn sort(&mut self, balls: impl Iterator<Item = (Vec3, f32, u32)> + Clone) {
        self.widest = balls.clone().map(|(_, radius, _)| radius).fold(1e-4, f32::max);
        self.grid.build_sparse(2.002 * self.widest, balls.map(|(center, _, drop)| (center, drop)));
    }
}

/// What a node wants to know of the droplets that pull, each a column, in the grid's order, so that
/// lanes read them in a row. Filled up with droplets that are nowhere.
#[derive(Clone, Debug, Default)]
pub(super) struct Columns {
    pub center: [Vec<f32>; 3],
    /// Squared distance from which on it does nothing.
    pub reach: Vec<f32>,
    /// Squared distance up to which a strand touches it.
    pub touch: Vec<f32>,
    pub r_min: Vec<f32>,
    pub r_max: Vec<f32>,
    pub strength: Vec<f32>,
    /// Which droplet it is.
    pub drop: Vec<u32>,
    /// The index of the strand that it rides.
    pub rides: Vec<u32>,
}

impl Columns {
    fn fill(&mut self, order: impl Iterator<Item = u32>, drops: &[SeenDrop], skin: f32) {
        self.clear();
        for k in order {
            let drop = &drops[k as usize];
            let touch = drop.touch(skin);
            let reach = drop.r_max.max(touch);
            let rides = drop.ride.map_or(u32::MAX, Entity::index_u32);
            self.push(drop.at, [reach * reach, touch * touch], drop, k, rides);
        }
        let nowhere = SeenDrop {
            at: Vec3::NAN,
            before: Vec3::NAN,
            velocity: Vec3::ZERO,
            radius: 0.0,
            r_min: 0.0,
            r_max: 1.0,
            strength: 0.0,
            mass: 0.0,
            company: 1.0,
            ride: None,
        };
        (0..WIDTH).for_each(|_| self.push(Vec3::NAN, [0.0; 2], &nowhere, 0, u32::MAX));
    }

    fn clear(&mut self) {
        let Self { center: [x, y, z], reach, touch, r_min, r_max, strength, drop, rides } = self;
        [x, y, z, reach, touch, r_min, r_max, strength].into_iter().for_each(Vec::clear);
        drop.clear();
        rides.clear();
    }

    fn push(&mut self, at: Vec3, [reach, touch]: [f32; 2], seen: &SeenDrop, k: u32, rides: u32) {
        self.center.iter_mut().zip(at.to_array()).for_each(|(column, c)| column.push(c));
        self.reach.push(reach);
        self.touch.push(touch);
        self.r_min.push(seen.r_min);
        self.r_max.push(seen.r_max);
        self.strength.push(seen.strength);
        self.drop.push(k);
        self.rides.push(rides);
    }
}

/// The droplets around a hair, found by place.
#[derive(Clone, Debug, Default)]
pub(super) struct Field {
    pub drops: Vec<SeenDrop>,
    /// Riding droplets as far as they reach.
    riding: Places,
    pub columns: Columns,
    /// Who is ridden by which droplet, sorted.
    riders: Vec<(Entity, u32)>,
    /// Falling droplets, as far as the middle of an edge may be that they hit.
    falling: Places,
    /// These in the grid's order: centre and squared radius, and which droplet it is.
    balls: Vec<(Vec4, u32)>,
}

impl Field {
    /// Sorts the droplets for strands whose longest edge is `longest` (m), of locks of radius `skin`.
    pub fn sort(&mut self, longest: f32, skin: f32) {
        let Self { drops, riding, columns, riders, falling, balls } = self;
        let numbered = || (0..).zip(&*drops);
        riders.clear();
        riders.extend(numbered().filter_map(|(k, drop)| Some((drop.ride?, k))));
        riders.sort_unstable();
        let reaches = numbered().filter(|(_, drop)| drop.ride.is_some());
        riding.sort(reaches.map(|(k, drop)| (drop.at, drop.r_max.max(drop.touch(skin)), k)));
        columns.fill(riding.grid.order(), drops, skin);
        let hits_within = |drop: &SeenDrop| {
            let way = drop.at.distance(drop.before).min(0.2);
            0.5 * longest + skin + drop.radius + way
        };
        let falls = numbered().filter(|(_, drop)| drop.ride.is_none());
        falling.sort(falls.map(|(k, drop)| (drop.at, hits_within(drop), k)));
        balls.clear();
        balls.extend(falling.grid.order().map(|k| {
            let drop = &drops[k as usize];
            (drop.at.extend(hits_within(drop).powi(2)), k)
        }));
    }

    /// The droplets that ride a strand.
    pub fn on(&self, strand: Entity) -> impl Iterator<Item = (u32, &SeenDrop)> {
        let first = self.riders.partition_point(|(ridden, _)| *ridden < strand);
        let theirs = self.riders[first..].iter().take_while(move |(ridden, _)| *ridden == strand);
        theirs.map(|&(_, k)| (k, &self.drops[k as usize]))
    }

    /// Where in the columns all droplets are whose reach a point is in.
    #[inline]
    pub fn pulling(&self, p: Vec3) -> Runs {
        self.riding.grid.runs_near(p, self.riding.widest)
    }

    /// All droplets that may hit an edge around a point.
    pub fn falling(&self, p: Vec3) -> impl Iterator<Item = (u32, &SeenDrop)> {
        let runs = self.falling.grid.runs_near(p, self.falling.widest);
        runs.each()
            .flat_map(|run| &self.balls[run])
            .filter(move |(ball, _)| ball.xyz().distance_squared(p) < ball.w)
            .map(|&(_, k)| (k, &self.drops[k as usize]))
    }
}
