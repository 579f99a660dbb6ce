//! One strand among droplets: pulled by them (\[W\] equation 2), touched by them, landed on.

use super::{
    Wetting,
    field::{Columns, Field},
    model,
    moisture::node_lengths,
};
use crate::rod::{algebra::V3, lanes::Real};
use bevy::prelude::*;
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*, u32x16};

/// How many droplets meet a node side by side.
pub(super) const WIDTH: usize = 16;

const NUMBERS: [u32; WIDTH] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// A node whose squared distance from a droplet's centre (m²) is not more is pulled nowhere.
const SAME_PLACE: f32 = 1e-18;

/// What strands did to droplets, in the order of strands and nodes.
#[derive(Clone, Debug, Default)]
pub(super) struct Encounters {
    /// What each droplet got (kg m/s, in the hair's frame).
    pub impulses: Vec<Vec4>,
    pub touches: Vec<Touch>,
    pub landings: Vec<Landing>,
    /// A droplet for each strand that is at it.
    pub company: Vec<u32>,
    pulls: Vec<Pulls>,
}

impl Encounters {
    pub fn clear(&mut self, drops: usize) {
        self.impulses.clear();
        self.impulses.resize(drops, Vec4::ZERO);
        self.touches.clear();
        self.landings.clear();
        self.company.clear();
    }
}

/// Droplets that pull at a node, side by side, from a place of the field's columns on.
#[derive(Clone, Copy, Debug)]
struct Pulls {
    first: usize,
    /// Which of the lanes do.
    lanes: u64,
    /// The node's change of velocity by each (m/s), if it bears nothing.
    change: [[f32; WIDTH]; 3],
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

/// A node, and the droplets that lanes hold against it: `count` from `first` on.
#[derive(Clone, Copy)]
struct Lanes {
    first: usize,
    count: usize,
    p: Vec3,
    /// The index of its strand.
    own: u32,
    is_root: bool,
}

/// What droplets do to a node.
#[derive(Clone, Copy, Default)]
struct Felt {
    change: Vec3,
    steepness: f32,
    /// Lanes that it touches.
    touches: u64,
}

/// The numbers of the bits that are set.
fn bits(mut mask: u64) -> impl Iterator<Item = usize> {
    core::iter::from_fn(move || {
        let lowest = (mask != 0).then(|| mask.trailing_zeros() as usize);
        mask &= mask.wrapping_sub(1);
        lowest
    })
}

/// The steepest field of force, in units of 1/dt², that a substep follows without overshooting. A
/// node among more droplets than make it (about thirteen of 3/15 mm at 30 m/s² and 1/360 s) is
/// pulled as by so many.
const STEEPEST: f32 = 1.0;

impl Met<'_> {
    /// Pulls the strand's nodes, and adds up what the droplets get from it.
    pub fn meet(&mut self, level: Level, field: &Field, out: &mut Encounters) {
        if field.drops.is_empty() {
            return;
        }
        dispatch!(level, simd => self.feel(simd, field, out));
        // Who carries a droplet is heavy.
        if !self.load.is_empty() {
            self.drink_from_riders(field, out);
        }
        self.catch(field, self.by.wetting.lock_radius(), out);
    }

    /// \[W\] equation 2 on every node, and what it touches.
    #[inline(always)]
    fn feel<S: Simd>(&mut self, simd: S, field: &Field, out: &mut Encounters) {
        let mass = self.by.wetting.dry_mass();
        let first_company = out.company.len();
        for (i, length) in node_lengths(self.lengths).enumerate() {
            let p = self.positions[i];
            let load = self.load.get(i).copied().unwrap_or(0.0);
            let (mut change, mut steepness) = (Vec3::ZERO, 0.0);
            out.pulls.clear();
            for run in field.pulling(p).each() {
                for first in run.clone().step_by(WIDTH) {
                    let own = self.strand.index_u32();
                    let lanes = Lanes { first, count: run.end - first, p, own, is_root: i == 0 };
                    let felt = self.pulled_by(simd, lanes, &field.columns, &mut out.pulls);
                    change += felt.change;
                    steepness += felt.steepness;
                    for slot in bits(felt.touches).map(|lane| first + lane) {
                        let drop = field.columns.drop[slot];
                        self.touch((i, load, length), drop, field, first_company, out);
                    }
                }
            }
            let share = (STEEPEST * (1.0 + load) / steepness).min(1.0);
            let impulse = -share * mass * length;
            for Pulls { first, lanes, change: [x, y, z] } in &out.pulls {
                for lane in bits(*lanes) {
                    let drop = field.columns.drop[first + lane] as usize;
                    out.impulses[drop] += Vec4::new(x[lane], y[lane], z[lane], 0.0) * impulse;
                }
            }
            self.velocities[i] += change * (share / (1.0 + load));
        }
    }

    /// Up to [`WIDTH`] droplets side by side.
    #[inline(always)]
    fn pulled_by<S: Simd>(
        &self,
        simd: S,
        Lanes { first, count, p, own, is_root }: Lanes,
        columns: &Columns,
        pulls: &mut Vec<Pulls>,
    ) -> Felt {
        let lit = |value: f32| f32x16::splat(simd, value);
        let column = |column: &Vec<f32>| f32x16::from_slice(simd, &column[first..first + WIDTH]);
        let offset = V3::new(
            column(&columns.center[0]) - lit(p.x),
            column(&columns.center[1]) - lit(p.y),
            column(&columns.center[2]) - lit(p.z),
        );
        let squared = offset.dot(offset);
        // What comes behind the run belongs to other cells.
        let here = u32x16::load_array_ref(simd, &NUMBERS).simd_lt(count.min(WIDTH) as u32);
        let inside = here & Real::lt(squared, column(&columns.reach));
        if inside.to_bitmask() == 0 {
            return Felt::default();
        }
        let touches = (inside & Real::lt(squared, column(&columns.touch))).to_bitmask();
        // Between a strand and the drop on it the pull is an inner force. Roots do not move.
        let rides = u32x16::from_slice(simd, &columns.rides[first..first + WIDTH]);
        let (r_min, r_max) = (column(&columns.r_min), column(&columns.r_max));
        let pulls_here = inside
            & !rides.simd_eq(own)
            & Real::lt(squared, r_max * r_max)
            & Real::lt(lit(SAME_PLACE), squared);
        let lanes = pulls_here.to_bitmask();
        if is_root || lanes == 0 {
            return Felt { touches, ..default() };
        }
        let distance = Real::sqrt(squared);
        let most = column(&columns.strength) * lit(self.by.wetting.adhesion * self.by.dt);
        let width = r_max - r_min;
        let x = (distance + distance - r_min - r_max) / width;
        let pull = (lit(1.0) - x * x) * most / distance;
        let zero = lit(0.0);
        let change = V3::select(pulls_here, offset.scale(pull), V3::new(zero, zero, zero));
        let steepness = most * lit(4.0 * self.by.dt) / width;
        let mut stored = Pulls { first, lanes, change: [[0.0; WIDTH]; 3] };
        change.x.store_array(&mut stored.change[0]);
        change.y.store_array(&mut stored.change[1]);
        change.z.store_array(&mut stored.change[2]);
        pulls.push(stored);
        Felt {
            change: Vec3::new(change.x.reduce_sum(), change.y.reduce_sum(), change.z.reduce_sum()),
            steepness: Real::select(pulls_here, steepness, zero).reduce_sum(),
            touches,
        }
    }

    /// A droplet that node `i` touches: it drinks from it, and the water between them takes their
    /// motion against each other.
    fn touch(
        &mut self,
        (i, load, length): (usize, f32, f32),
        drop: u32,
        field: &Field,
        first_company: usize,
        out: &mut Encounters,
    ) {
        let MetBy { wetting, dt, .. } = *self.by;
        let seen = &field.drops[drop as usize];
        if !out.company[first_company..].contains(&drop) {
            out.company.push(drop);
        }
        if seen.ride == Some(self.strand) {
            return;
        }
        let wants = self.by.wants(self.film, i);
        if wants > 0.0 {
            out.touches.push(Touch { drop, strand: self.strand, node: i, wants });
        }
        if i > 0 {
            let node = wetting.dry_mass() * length * (1.0 + load);
            // All that are at it together must not throw it beyond their common motion.
            let rate = wetting.film_drag * dt * seen.strength;
            let share = seen.mass / (seen.mass + node) * rate / (1.0 + rate * seen.company);
            let change = (seen.velocity - self.velocities[i]) * share;
            self.velocities[i] += change;
            out.impulses[drop as usize] -= (change * node).extend(0.0);
        }
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
            for (drop, seen) in field.falling(pair[0] + 0.5 * edge) {
                let (when, along) =
                    model::closest(seen.before, seen.at - seen.before, pair[0], edge);
                let met = seen.before.lerp(seen.at, when).distance_squared(pair[0] + edge * along);
                let near = seen.radius + skin;
                if met < near * near {
                    let at = i as f32 + along;
                    out.landings.push(Landing { drop, strand: self.strand, at, when });
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::{super::field::SeenDrop, *};

    fn drop(at: Vec3) -> SeenDrop {
        SeenDrop {
            at,
            before: at,
            velocity: Vec3::ZERO,
            radius: 0.003,
            r_min: 0.003,
            r_max: 0.015,
            strength: 1.0,
            mass: 1.1e-4,
            company: 1.0,
            ride: Some(Entity::PLACEHOLDER),
        }
    }

    #[test]
    fn every_node_feels_every_droplet_in_reach_and_no_other() {
        let strand = Entity::from_raw_u32(7).unwrap();
        let positions: Vec<Vec3> = (0..9).map(|i| Vec3::X * (0.03 * i as f32)).collect();
        let lengths = vec![0.03; 8];
        let wetting = Wetting { film_drag: 0.0, ..default() };
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
        out.clear(field.drops.len());
        let mut met = Met {
            strand,
            positions: &positions,
            velocities: &mut velocities,
            lengths: &lengths,
            load: &[],
            film: &[],
            by: &MetBy { wetting: &wetting, dt: 1.0 / 3600.0, uptake: 0.0, most_film: 0.0 },
        };
        met.meet(Level::new(), &field, &mut out);
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
        let got: Vec3 = out.impulses.iter().map(|p| p.xyz()).sum();
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
        out.clear(field.drops.len());
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
        met.meet(Level::new(), &field, &mut out);
        let hits: Vec<_> = out.landings.iter().map(|l| (l.drop, l.at)).collect();
        assert_eq!(hits.len(), 1);
        assert_eq!(hits[0].0, 0);
        assert!((hits[0].1 - 4.0 / 3.0).abs() < 1e-4 && (out.landings[0].when - 0.5).abs() < 1e-4);
    }
}
