//! One strand among droplets: pulled by them (\[W\] equation 2), touched by them, landed on.

use super::{Wetting, model, moisture::node_lengths};
use crate::grid::UniformGrid;
use bevy::prelude::*;

/// A droplet as the strands of one hair see it, in the hair's frame.
#[derive(Clone, Copy, Debug)]
pub(super) struct SeenDrop {
    pub at: Vec3,
    /// Where it was a substep ago, for drops that fall.
    pub before: Vec3,
    pub radius: f32,
    pub r_min: f32,
    pub r_max: f32,
    pub strength: f32,
    pub ride: Option<Entity>,
}

/// Balls, found by a point inside them.
#[derive(Clone, Debug, Default)]
struct Balls {
    /// Each ball in all cells that it reaches: a point finds all of them in its own cell.
    grid: UniformGrid,
    given: Vec<(Vec4, u32)>,
    /// In the grid's order, centres and squared radii.
    sorted: Vec<Vec4>,
}

impl Balls {
    fn clear(&mut self) {
        self.given.clear();
    }

    fn push(&mut self, item: u32, center: Vec3, radius: f32) {
        self.given.push((center.extend(radius), item));
    }

    fn sort(&mut self) {
        let widest = self.given.iter().map(|(ball, _)| ball.w).fold(1e-4, f32::max);
        self.grid.begin(widest);
        for (i, (ball, _)) in (0..).zip(&self.given) {
            self.grid.put_ball(ball.xyz(), ball.w, i);
        }
        self.grid.sort();
        // Most balls in a cell do not hold a point of it: what tells lies in a row.
        self.sorted.clear();
        self.sorted.extend(self.grid.order().map(|i| {
            let (ball, _) = self.given[i as usize];
            ball.xyz().extend(ball.w * ball.w)
        }));
    }

    /// Calls `found` with every ball that holds `p`, the way from there to its centre and the
    /// square of that.
    #[inline]
    fn for_each_at(&self, p: Vec3, mut found: impl FnMut(u32, Vec3, f32)) {
        let (cell, slots) = self.grid.slots_at(p);
        for slot in slots {
            let ball = self.sorted[slot];
            let offset = ball.xyz() - p;
            let squared = offset.length_squared();
            if squared < ball.w
                && let Some(i) = self.grid.holds(slot, cell)
            {
                found(self.given[i as usize].1, offset, squared);
            }
        }
    }
}

/// The droplets around a hair, found by place.
#[derive(Clone, Debug, Default)]
pub(super) struct Field {
    pub drops: Vec<SeenDrop>,
    /// Riding droplets as far as they reach.
    riding: Balls,
    /// Who is ridden by which droplet, sorted.
    riders: Vec<(Entity, u32)>,
    /// Falling droplets, as far as the middle of an edge may be that they hit.
    falling: Balls,
}

impl Field {
    /// The droplets that ride a strand.
    fn on(&self, strand: Entity) -> impl Iterator<Item = (u32, &SeenDrop)> {
        let first = self.riders.partition_point(|(ridden, _)| *ridden < strand);
        let theirs = self.riders[first..].iter().take_while(move |(ridden, _)| *ridden == strand);
        theirs.map(|&(_, k)| (k, &self.drops[k as usize]))
    }

    /// Sorts the droplets for strands whose longest edge is `longest` (m), of locks of radius `skin`.
    pub fn sort(&mut self, longest: f32, skin: f32) {
        self.riding.clear();
        self.riders.clear();
        self.falling.clear();
        for (i, drop) in (0..).zip(&self.drops) {
            match drop.ride {
                Some(strand) => {
                    self.riders.push((strand, i));
                    self.riding.push(i, drop.at, drop.r_max.max(drop.touch(skin)));
                }
                None => {
                    let way = drop.at.distance(drop.before).min(0.2);
                    self.falling.push(i, drop.at, 0.5 * longest + skin + drop.radius + way);
                }
            }
        }
        self.riders.sort_unstable();
        self.riding.sort();
        self.falling.sort();
    }
}

impl SeenDrop {
    /// How near a strand of locks of radius `skin` touches it: its core keeps strands away at r_min.
    fn touch(&self, skin: f32) -> f32 {
        self.radius.max(self.r_min) + skin
    }
}

/// What strands did to droplets, in the order of strands and nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct Encounters {
    pub pulls: Vec<Pull>,
    pub touches: Vec<Touch>,
    pub landings: Vec<Landing>,
    /// A droplet for each strand that is at it.
    pub company: Vec<u32>,
}

impl Encounters {
    pub fn clear(&mut self) {
        self.pulls.clear();
        self.touches.clear();
        self.landings.clear();
        self.company.clear();
    }
}

/// A droplet pulled at a strand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Pull {
    pub drop: u32,
    /// What the droplet gets for it (kg m/s, in the hair's frame).
    pub impulse: Vec3,
}

/// A node that drinks from a droplet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    pub drop: u32,
    pub strand: Entity,
    pub node: usize,
    /// What it would take (m³).
    pub wants: f64,
}

/// A falling droplet that met a strand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Landing {
    pub drop: u32,
    pub strand: Entity,
    /// In segments from the root.
    pub at: f32,
    /// When in the substep, 0…1.
    pub when: f32,
}

/// What holds for all strands of a hair in a substep.
#[derive(Clone, Copy)]
pub(super) struct MetBy<'a> {
    pub wetting: &'a Wetting,
    pub dt: f32,
    /// Share of the free room on a node that a droplet fills in this substep.
    pub uptake: f32,
    /// The most film that a node holds (m³).
    pub most_film: f64,
}

impl MetBy<'_> {
    /// What node `i` under a `film` (m³) would drink from a droplet that touches it (m³).
    fn wants(&self, film: &[f64], i: usize) -> f64 {
        let room = self.most_film - film.get(i).copied().unwrap_or(0.0);
        room.max(0.0) * f64::from(self.uptake)
    }
}

/// A strand among droplets.
pub(super) struct Met<'a> {
    pub strand: Entity,
    pub positions: &'a [Vec3],
    pub velocities: &'a mut [Vec3],
    pub lengths: &'a [f32],
    /// Added mass of each node over its dry mass; empty for none.
    pub load: &'a [f32],
    /// The film that lies on each node (m³); empty for none.
    pub film: &'a [f64],
    pub by: &'a MetBy<'a>,
}

/// The steepest field of force, in units of 1/dt², that a substep follows without overshooting. A
/// node among more droplets than make it (about thirteen of 3/15 mm at 30 m/s² and 1/360 s) is
/// pulled as by so many.
const STEEPEST: f32 = 1.0;

impl Met<'_> {
    /// Pulls the strand's nodes, and writes down what the droplets get from it.
    pub fn meet(&mut self, field: &Field, out: &mut Encounters) {
        if field.drops.is_empty() {
            return;
        }
        let MetBy { wetting, dt, .. } = *self.by;
        let (mass, skin) = (wetting.dry_mass(), wetting.lock_radius());
        let first_company = out.company.len();
        for (i, length) in node_lengths(self.lengths).enumerate() {
            let p = self.positions[i];
            let load = self.load.get(i).copied().unwrap_or(0.0);
            let wants = self.by.wants(self.film, i);
            let (mut change, mut steepness) = (Vec3::ZERO, 0.0);
            let first_pull = out.pulls.len();
            field.riding.for_each_at(p, |k, offset, squared| {
                let drop = &field.drops[k as usize];
                let touch = drop.touch(skin);
                let rides_here = drop.ride == Some(self.strand);
                if squared < touch * touch {
                    if !rides_here && wants > 0.0 {
                        out.touches.push(Touch { drop: k, strand: self.strand, node: i, wants });
                    }
                    if !out.company[first_company..].contains(&k) {
                        out.company.push(k);
                    }
                }
                // Between a strand and the drop on it the pull is an inner force. Roots do not move.
                if rides_here || i == 0 {
                    return;
                }
                let f = model::pull(offset, drop.r_min, drop.r_max);
                if f != Vec3::ZERO {
                    let most = wetting.adhesion * drop.strength * dt;
                    change += f * most;
                    steepness += most * dt * 4.0 / (drop.r_max - drop.r_min);
                    out.pulls.push(Pull { drop: k, impulse: -f * (most * mass * length) });
                }
            });
            let share = (STEEPEST * (1.0 + load) / steepness).min(1.0);
            out.pulls[first_pull..].iter_mut().for_each(|pull| pull.impulse *= share);
            self.velocities[i] += change * (share / (1.0 + load));
        }
        // Who carries a droplet is heavy.
        if !self.load.is_empty() {
            self.drink_from_riders(field, out);
        }
        self.catch(field, skin, out);
    }

    /// Between two nodes a droplet touches the nearer one of its strand, however far off that is.
    fn drink_from_riders(&self, field: &Field, out: &mut Encounters) {
        for (drop, seen) in field.on(self.strand) {
            let touch = seen.touch(self.by.wetting.lock_radius());
            for (node, length) in node_lengths(self.lengths).enumerate() {
                let near = touch.max(0.5 * length);
                let wants = self.by.wants(self.film, node);
                if self.positions[node].distance_squared(seen.at) < near * near && wants > 0.0 {
                    out.touches.push(Touch { drop, strand: self.strand, node, wants });
                }
            }
        }
    }

    /// Whether falling droplets hit an edge on their way of this substep.
    fn catch(&self, field: &Field, skin: f32, out: &mut Encounters) {
        for (i, pair) in self.positions.windows(2).enumerate() {
            let edge = pair[1] - pair[0];
            field.falling.for_each_at(pair[0] + 0.5 * edge, |k, _, _| {
                let drop = &field.drops[k as usize];
                let (when, along) =
                    model::closest(drop.before, drop.at - drop.before, pair[0], edge);
                let met = drop.before.lerp(drop.at, when).distance_squared(pair[0] + edge * along);
                let near = drop.radius + skin;
                if met < near * near {
                    let at = i as f32 + along;
                    out.landings.push(Landing { drop: k, strand: self.strand, at, when });
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn drop(at: Vec3) -> SeenDrop {
        SeenDrop {
            at,
            before: at,
            radius: 0.003,
            r_min: 0.003,
            r_max: 0.015,
            strength: 1.0,
            ride: Some(Entity::PLACEHOLDER),
        }
    }

    #[test]
    fn every_node_feels_every_droplet_in_reach_and_no_other() {
        let strand = Entity::from_raw_u32(7).unwrap();
        let positions: Vec<Vec3> = (0..9).map(|i| Vec3::X * (0.03 * i as f32)).collect();
        let lengths = vec![0.03; 8];
        let wetting = Wetting::default();
        let mut random = 1u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            random as f32 / u32::MAX as f32 - 0.5
        };
        let mut field = Field::default();
        for _ in 0..300 {
            let at = Vec3::new(0.12 + next() * 0.3, next() * 0.05, next() * 0.05);
            field.drops.push(drop(at));
        }
        // and one exactly on a node
        field.drops.push(drop(positions[3]));
        field.sort(0.03, 1e-3);
        let mut velocities = vec![Vec3::ZERO; 9];
        let mut out = Encounters::default();
        let mut met = Met {
            strand,
            positions: &positions,
            velocities: &mut velocities,
            lengths: &lengths,
            load: &[],
            film: &[],
            by: &MetBy { wetting: &wetting, dt: 1.0 / 3600.0, uptake: 0.0, most_film: 0.0 },
        };
        met.meet(&field, &mut out);
        for (i, p) in positions.iter().enumerate() {
            let expected: Vec3 = (field.drops.iter())
                .map(|d| model::pull(d.at - *p, d.r_min, d.r_max) * (30.0 / 3600.0))
                .sum();
            let expected = if i == 0 { Vec3::ZERO } else { expected };
            assert!(velocities[i].distance(expected) < 1e-5, "{i}");
        }
        // What droplets get is what the strand gave: momentum in, momentum out.
        let given: Vec3 = (velocities.iter().zip(node_lengths(&lengths)))
            .map(|(v, l)| *v * (l * wetting.dry_mass()))
            .sum();
        let got: Vec3 = out.pulls.iter().map(|p| p.impulse).sum();
        assert!((given + got).length() < 1e-6 * given.length());
    }

    #[test]
    fn a_fast_drop_does_not_fall_through_a_strand() {
        let strand = Entity::from_raw_u32(7).unwrap();
        let positions = [Vec3::ZERO, Vec3::X * 0.03, Vec3::X * 0.06];
        let mut field = Field::default();
        let before = Vec3::new(0.04, 0.05, 0.0);
        let falling = SeenDrop { before, ride: None, ..drop(Vec3::new(0.04, -0.05, 0.0)) };
        let beside = SeenDrop {
            before: before + Vec3::Z * 0.02,
            at: falling.at + Vec3::Z * 0.02,
            ..falling
        };
        field.drops = vec![falling, beside];
        field.sort(0.03, 1e-3);
        let mut out = Encounters::default();
        let mut met = Met {
            strand,
            positions: &positions,
            velocities: &mut [Vec3::ZERO; 3],
            lengths: &[0.03; 2],
            load: &[],
            film: &[],
            by: &MetBy {
                wetting: &Wetting::default(),
                dt: 1.0 / 360.0,
                uptake: 0.0,
                most_film: 0.0,
            },
        };
        met.meet(&field, &mut out);
        let hits: Vec<_> = out.landings.iter().map(|l| (l.drop, l.at)).collect();
        assert_eq!(hits.len(), 1);
        assert_eq!(hits[0].0, 0);
        assert!((hits[0].1 - 4.0 / 3.0).abs() < 1e-4 && (out.landings[0].when - 0.5).abs() < 1e-4);
    }
}
