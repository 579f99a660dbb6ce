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

/// The droplets around a hair, found by place.
#[derive(Clone, Debug, Default)]
pub(super) struct Field {
    pub drops: Vec<SeenDrop>,
    /// Each droplet in all cells that it pulls in: a node finds all of them in its own cell.
    pulling: UniformGrid,
    /// Each falling droplet in all cells where the middle of an edge may be that it hits.
    falling: UniformGrid,
    any_fall: bool,
}

impl Field {
    /// Sorts the droplets for strands whose longest edge is `longest` (m), of locks of radius `skin`.
    pub fn sort(&mut self, longest: f32, skin: f32) {
        let widest = self.drops.iter().map(|d| d.r_max).fold(1e-4, f32::max);
        self.pulling.begin(2.0 * widest);
        let mut fastest = 0.0_f32;
        self.any_fall = false;
        for (i, drop) in (0..).zip(&self.drops) {
            put_box(&mut self.pulling, drop.at, drop.r_max, i);
            if drop.ride.is_none() {
                self.any_fall = true;
                fastest = fastest.max(drop.at.distance(drop.before) + drop.radius);
            }
        }
        self.pulling.sort();
        if !self.any_fall {
            return;
        }
        let reach = 0.5 * longest + skin + fastest.min(0.2);
        self.falling.begin(2.0 * reach);
        for (i, drop) in (0..).zip(&self.drops) {
            if drop.ride.is_none() {
                put_box(&mut self.falling, drop.at, reach, i);
            }
        }
        self.falling.sort();
    }
}

/// Puts an item into every cell that the ball around `at` may reach.
fn put_box(grid: &mut UniformGrid, at: Vec3, reach: f32, item: u32) {
    if !at.is_finite() {
        return;
    }
    let (low, high) = (grid.cell_of(at - reach), grid.cell_of(at + reach));
    for z in low.z..=high.z {
        for y in low.y..=high.y {
            for x in low.x..=high.x {
                grid.put(IVec3::new(x, y, z), item);
            }
        }
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
    pub node: u32,
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
pub(super) struct MetBy<'a> {
    pub wetting: &'a Wetting,
    pub dt: f32,
    /// Share of the free room on a node that a droplet fills in this substep.
    pub uptake: f32,
    /// The most film that a node holds (m³).
    pub most_film: f64,
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
        let MetBy { wetting, dt, uptake, most_film } = *self.by;
        let (mass, skin) = (wetting.dry_mass(), wetting.lock_radius());
        let first_company = out.company.len();
        for (i, length) in node_lengths(self.lengths).enumerate() {
            let p = self.positions[i];
            let load = self.load.get(i).copied().unwrap_or(0.0);
            let room = (most_film - self.film.get(i).copied().unwrap_or(0.0)).max(0.0);
            let (mut change, mut steepness) = (Vec3::ZERO, 0.0);
            let first_pull = out.pulls.len();
            field.pulling.for_each_at(p, |k| {
                let drop = &field.drops[k as usize];
                let offset = drop.at - p;
                let squared = offset.length_squared();
                // Its core keeps strands away at r_min, so that is where they touch it.
                let touch = drop.radius.max(drop.r_min) + skin;
                let rides_here = drop.ride == Some(self.strand);
                if uptake > 0.0 && drop.ride.is_some() {
                    let near = if rides_here { touch.max(0.5 * length) } else { touch };
                    if squared < near * near && room > 0.0 {
                        let wants = room * f64::from(uptake);
                        let node = i as u32;
                        out.touches.push(Touch { drop: k, strand: self.strand, node, wants });
                    }
                }
                if squared < touch * touch && !out.company[first_company..].contains(&k) {
                    out.company.push(k);
                }
                // Between a strand and the drop on it the pull is an inner force. Roots do not move.
                // A drop in the air touches nothing that it could pull at.
                if rides_here || i == 0 || drop.ride.is_none() {
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
        if field.any_fall {
            self.catch(field, skin, out);
        }
    }

    /// Whether falling droplets hit an edge on their way of this substep.
    fn catch(&self, field: &Field, skin: f32, out: &mut Encounters) {
        for (i, pair) in self.positions.windows(2).enumerate() {
            let edge = pair[1] - pair[0];
            field.falling.for_each_at(pair[0] + 0.5 * edge, |k| {
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
