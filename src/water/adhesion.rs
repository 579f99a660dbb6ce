//! Droplets on a block of strands: adhesion (\[W\] equation 2), touching and landing.

use super::{
    HairWetting,
    field::{Falling, Field, Puller},
    model,
    strand_block::{NodeSlice, StrandBlock, StrandLane},
};
use crate::base::grid::FoundBalls;
use crate::base::lanes::{
    LANES, Lane, Real, V3, dispatch, inlined, lanes_in, load, load3, splat3, store3,
};
use bevy::prelude::*;
use fearless_simd::{Level, Simd, f32x16, mask32x16, prelude::*, u32x16};

/// Squared distance (m²) from a droplet's centre up to which there is no direction of pull.
const SAME_PLACE: f32 = 1e-18;

/// How much of an edge is nearer to an end than its middle, and a little more: edges may be stretched.
const MIDDLE: f32 = 0.51;

/// Largest upward acceleration by droplets, as a share of gravity.
const LIFT: f32 = 0.2;

/// Effects of strands on droplets, in the order of blocks.
#[derive(Clone, Debug, Default)]
pub(super) struct DropletContacts {
    /// The effect on each droplet.
    pub sums: Vec<DropletSum>,
    pub touches: Vec<Touch>,
    pub landings: Vec<Landing>,
    /// Water of removed nodes (m³).
    pub removed: f64,
    scratch: ContactScratch,
}

/// The effect of some strands on a droplet.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct DropletSum {
    /// Impulse on it (kg m/s, in the hair's frame).
    pub impulse: Vec3,
    /// Number of strands that touch it.
    pub touch_count: u32,
    /// Volume that they would absorb (m³).
    pub wanted: f64,
}

#[derive(Clone, Debug, Default)]
struct ContactScratch {
    strand_block: StrandBlock,
    near: FoundBalls,
    hits: Vec<Hit>,
    /// Mask of the lanes that touch each puller, and the pullers that are touched.
    at: Vec<u64>,
    touched: Vec<u32>,
}

impl DropletContacts {
    /// Resets for `drops` droplets.
    pub fn clear(&mut self, drops: usize) {
        self.sums.clear();
        self.sums.resize(drops, DropletSum::default());
        self.touches.clear();
        self.landings.clear();
        self.removed = 0.0;
    }
}

/// A droplet among the nodes of a row.
#[derive(Clone, Copy, Debug)]
struct Hit {
    puller: u32,
    /// Lanes that touch it.
    touches: u64,
    /// The nodes' change of velocity (m/s) without added mass.
    change: [Lane; 3],
}

/// A node that absorbs water from a droplet.
#[derive(Clone, Copy, Debug)]
pub(super) struct Touch {
    pub drop: u32,
    /// The strand's index in its work chunk.
    pub strand: u32,
    pub node: u32,
    /// The volume that it would absorb (m³).
    pub wants: f64,
}

/// A falling droplet that hit a strand.
#[derive(Clone, Copy, Debug)]
pub(super) struct Landing {
    pub drop: u32,
    pub strand: Entity,
    /// In segments from the root.
    pub at: f32,
    /// When in the substep, 0…1.
    pub when: f32,
}

/// Parameters of all strands of a hair in a substep.
#[derive(Clone, Copy)]
pub(super) struct ContactParams<'a> {
    pub wetting: &'a HairWetting,
    pub field: &'a Field,
    pub dt: f32,
    /// Largest force gradient (1/s²) that is resolved without overshooting: that of about thirteen droplets of
    /// 3/15 mm at a node at 30 m/s², where it is 1/dt² of 1/360 s. A larger pull is scaled down.
    pub steepest: f32,
    /// Share of a node's free film capacity that a droplet fills in this substep.
    pub uptake: f32,
    /// Film capacity of a node (m³).
    pub film_capacity: f64,
    /// Gravity in the hair's frame (m/s²); limits how much droplets lift hair.
    pub gravity: Vec3,
}

#[inline(always)]
fn sum<S: Simd>(v: V3<f32x16<S>>) -> Vec3 {
    Vec3::new(v.x.reduce_sum(), v.y.reduce_sum(), v.z.reduce_sum())
}

impl ContactParams<'_> {
    /// Applies droplets to the nodes of up to sixteen strands and sums the reactions on droplets.
    /// `first` is the index of the first strand in its work chunk.
    pub fn contact(
        &self,
        level: Level,
        strand_lanes: &mut [StrandLane<'_>],
        first: usize,
        out: &mut DropletContacts,
    ) {
        if self.field.drops.is_empty() {
            return;
        }
        let mut strand_block = core::mem::take(&mut out.scratch.strand_block);
        strand_block.place(level, strand_lanes);
        let mut is_weighed = false;
        out.scratch.at.resize(self.field.pullers.len(), 0);
        let (low, high) = strand_block.bounds();
        self.field.pulling(level, low, high, &mut out.scratch.near);
        let pulled = if out.scratch.near.balls.is_empty() { 0 } else { strand_block.rows.len() };
        for i in 0..pulled {
            let row = &strand_block.rows[i];
            self.field.pulling(level, row.low, row.high, &mut out.scratch.near);
            if !out.scratch.near.balls.is_empty() {
                if !core::mem::replace(&mut is_weighed, true) {
                    strand_block.weigh(strand_lanes, self.wetting);
                }
                let row = &mut strand_block.rows[i];
                let at = Place { node: i, first, own: &strand_block.strand_index };
                dispatch!(level, simd => self.pull(simd, row, at, strand_lanes, out));
            }
        }
        let DropletContacts { sums, scratch: ContactScratch { at, touched, .. }, .. } = out;
        for puller in touched.drain(..) {
            let lanes = core::mem::take(&mut at[puller as usize]);
            sums[self.field.pullers[puller as usize].drop as usize].touch_count +=
                lanes.count_ones();
        }
        // Strands that carry a droplet have added mass.
        for (k, strand_lane) in strand_lanes.iter().enumerate().filter(|(_, m)| !m.load.is_empty())
        {
            self.absorb_from_riders(strand_lane, first + k, out);
        }
        self.field.falling(level, low, high, &mut out.scratch.near);
        let edges = if out.scratch.near.balls.is_empty() { &[] } else { &strand_block.rows[..] };
        for (i, ends) in edges.windows(2).enumerate() {
            let (low, high) = (ends[0].low.min(ends[1].low), ends[0].high.max(ends[1].high));
            self.field.falling(level, low, high, &mut out.scratch.near);
            for k in 0..out.scratch.near.balls.len() {
                let falling = &self.field.fallers[out.scratch.near.balls[k] as usize];
                let (lanes, when, along) = dispatch!(level, simd => hit_edges(simd, ends, falling));
                for lane in lanes_in(lanes) {
                    let (strand, at) = (strand_lanes[lane].strand, i as f32 + along[lane]);
                    let landing = Landing { drop: falling.drop, strand, at, when: when[lane] };
                    out.landings.push(landing);
                }
            }
        }
        if is_weighed {
            strand_block.scatter(strand_lanes);
        }
        out.scratch.strand_block = strand_block;
    }

    /// \[W\] equation 2 on a row of nodes, and what they touch.
    #[inline(always)]
    fn pull<S: Simd>(
        &self,
        simd: S,
        row: &mut NodeSlice,
        place: Place<'_>,
        strand_lanes: &[StrandLane<'_>],
        out: &mut DropletContacts,
    ) {
        let own = u32x16::load_array_ref(simd, place.own);
        let p = load3(simd, &row.p);
        let mut change = splat3(simd, Vec3::ZERO);
        let mut steepness = f32x16::splat(simd, 0.0);
        out.scratch.hits.clear();
        for k in 0..out.scratch.near.balls.len() {
            let number = out.scratch.near.balls[k];
            let puller = &self.field.pullers[number as usize];
            let Adhesion { touches, pulls, by, steep } = self.adhesion_at(simd, p, own, puller);
            if place.node > 0 {
                change = change + by;
                steepness += steep;
            }
            if touches != 0 {
                let at = &mut out.scratch.at[number as usize];
                if *at == 0 {
                    out.scratch.touched.push(number);
                }
                *at |= touches;
            }
            if touches | pulls != 0 {
                let mut hit = Hit { puller: number, touches, change: [[0.0; LANES]; 3] };
                store3(&mut hit.change, by);
                out.scratch.hits.push(hit);
            }
        }
        let inertia = load(simd, &row.load) + 1.0;
        let most = self.steepest * self.dt * self.dt;
        let share = Real::min(inertia * most / steepness, f32x16::splat(simd, 1.0));
        // A droplet hangs on hair itself and cannot support other hair: the lift is limited.
        let up = splat3(simd, -self.gravity.normalize_or_zero());
        let lift = change.dot(up) * share / inertia;
        let weight = f32x16::splat(simd, LIFT * self.gravity.length() * self.dt);
        let excess = weight / Real::max(lift, weight) - 1.0;
        let excess = Real::select(Real::lt(weight, lift), excess, f32x16::splat(simd, 0.0));
        let limited = inlined(
            #[inline(always)]
            |change: V3<f32x16<S>>| up.scale_add(change.dot(up) * excess, change),
        );
        let mut v = limited(change).scale_add(share / inertia, load3(simd, &row.v));
        let mass = load(simd, &row.mass);
        // Roots are fixed and exert no reaction on droplets.
        let reacting = if place.node > 0 { share * mass } else { f32x16::splat(simd, 0.0) };
        for k in 0..out.scratch.hits.len() {
            let hit = out.scratch.hits[k];
            let puller = &self.field.pullers[hit.puller as usize];
            let mut impulse = -limited(load3(simd, &hit.change)).scale(reacting);
            if hit.touches != 0 {
                let others = mask32x16::from_bitmask(simd, hit.touches)
                    & !own.simd_eq(u32x16::splat(simd, puller.rides));
                if place.node > 0 {
                    let (changed, got) = self.drag(simd, v, mass * inertia, others, puller);
                    (v, impulse) = (changed, impulse + got);
                }
                self.absorb(others.to_bitmask(), puller.drop, &place, strand_lanes, out);
            }
            out.sums[puller.drop as usize].impulse += sum(impulse);
        }
        store3(&mut row.v, v);
    }

    /// The effect of a droplet on sixteen nodes at `p`.
    #[inline(always)]
    fn adhesion_at<S: Simd>(
        &self,
        simd: S,
        p: V3<f32x16<S>>,
        own: u32x16<S>,
        puller: &Puller,
    ) -> Adhesion<S> {
        let zero = f32x16::splat(simd, 0.0);
        let offset = splat3(simd, puller.center) - p;
        let squared = offset.dot(offset);
        let inside = squared.simd_lt(f32x16::splat(simd, puller.reach));
        let touches = squared.simd_lt(f32x16::splat(simd, puller.touch)).to_bitmask();
        // Between a strand and the drop it carries the pull is an internal force.
        let pulls = inside
            & !own.simd_eq(u32x16::splat(simd, puller.rides))
            & squared.simd_lt(f32x16::splat(simd, puller.pulls_within))
            & squared.simd_gt(f32x16::splat(simd, SAME_PLACE));
        let lanes = pulls.to_bitmask();
        if lanes == 0 {
            return Adhesion { touches, pulls: lanes, by: V3::new(zero, zero, zero), steep: zero };
        }
        let distance = Real::sqrt(squared);
        let most = puller.strength * self.wetting.adhesion * self.dt;
        let lit = |value: f32| f32x16::splat(simd, value);
        let pull =
            model::adhesion(distance, lit(puller.steep), lit(puller.middle)) * most / distance;
        Adhesion {
            touches,
            pulls: lanes,
            by: V3::select(pulls, offset.scale(pull), V3::new(zero, zero, zero)),
            steep: Real::select(
                pulls,
                f32x16::splat(simd, most * 2.0 * self.dt * puller.steep),
                zero,
            ),
        }
    }

    /// Viscous drag of the film between nodes and a droplet that touches them, on their relative
    /// velocity: returns the nodes' new velocity and the impulse on the droplet.
    #[inline(always)]
    fn drag<S: Simd>(
        &self,
        simd: S,
        v: V3<f32x16<S>>,
        node: f32x16<S>,
        touching: mask32x16<S>,
        puller: &Puller,
    ) -> (V3<f32x16<S>>, V3<f32x16<S>>) {
        let zero = f32x16::splat(simd, 0.0);
        let drop = &self.field.drops[puller.drop as usize];
        // All strands that touch it together must not overshoot the common velocity.
        let rate = self.wetting.film_drag * self.dt * drop.strength;
        let rate = rate / (1.0 + rate * drop.touch_count);
        let share = f32x16::splat(simd, drop.mass * rate) / (node + drop.mass);
        let share = Real::select(touching, share, zero);
        let change = (splat3(simd, drop.velocity) - v).scale(share);
        (v + change, -change.scale(node))
    }

    /// The volume that each of some lanes would absorb from a droplet.
    fn absorb(
        &self,
        lanes: u64,
        drop: u32,
        place: &Place<'_>,
        strand_lanes: &[StrandLane<'_>],
        out: &mut DropletContacts,
    ) {
        for (lane, strand_lane) in
            lanes_in(lanes).filter_map(|lane| Some((lane, strand_lanes.get(lane)?)))
        {
            self.want(drop, place.first + lane, place.node, strand_lane.film, out);
        }
    }

    /// Records a node with `film` (m³) that touches a droplet and would absorb up to its free capacity.
    fn want(&self, drop: u32, strand: usize, node: usize, film: &[f64], out: &mut DropletContacts) {
        let room = self.film_capacity - film.get(node).copied().unwrap_or(0.0);
        let wants = room * f64::from(self.uptake);
        if wants > 0.0 {
            out.sums[drop as usize].wanted += wants;
            out.touches.push(Touch { drop, strand: strand as u32, node: node as u32, wants });
        }
    }

    /// A droplet between two nodes touches the nearer one of its own strand at any distance.
    fn absorb_from_riders(
        &self,
        strand_lane: &StrandLane<'_>,
        strand: usize,
        out: &mut DropletContacts,
    ) {
        for (drop, seen) in self.field.on(strand_lane.strand) {
            let touch = seen.touch(self.wetting.lock_radius());
            let lengths = strand_lane.lengths;
            for (node, place) in strand_lane.positions.iter().enumerate() {
                let edges = node.saturating_sub(1)..lengths.len().min(node + 1);
                let edges = lengths.get(edges).unwrap_or_default();
                let near = edges.iter().fold(touch, |near, edge| near.max(MIDDLE * edge));
                if place.distance_squared(seen.at) < near * near {
                    self.want(drop, strand, node, strand_lane.film, out);
                }
            }
        }
    }
}

/// The nodes of a row.
#[derive(Clone, Copy)]
struct Place<'a> {
    node: usize,
    /// Index of the first lane's strand in its work chunk.
    first: usize,
    /// The index of each lane's strand.
    own: &'a [u32; LANES],
}

/// The effect of a droplet on nodes side by side.
#[derive(Clone, Copy)]
struct Adhesion<S: Simd> {
    touches: u64,
    pulls: u64,
    by: V3<f32x16<S>>,
    steep: f32x16<S>,
}

/// The edges between two rows that a falling droplet has hit in this substep: the lanes, the time
/// (0…1), and the position along them (0…1).
#[inline(always)]
fn hit_edges<S: Simd>(simd: S, ends: &[NodeSlice], falling: &Falling) -> (u64, Lane, Lane) {
    let start = load3(simd, &ends[0].p);
    let edge = load3(simd, &ends[1].p) - start;
    let (from, displacement) = (splat3(simd, falling.from), splat3(simd, falling.displacement));
    let (when, along) = model::closest(from, displacement, start, edge);
    let apart = displacement.scale_add(when, from) - edge.scale_add(along, start);
    let near = f32x16::splat(simd, falling.near * falling.near);
    let mut places = (apart.dot(apart).simd_lt(near).to_bitmask(), [0.0; LANES], [0.0; LANES]);
    when.store_array(&mut places.1);
    along.store_array(&mut places.2);
    places
}

#[cfg(test)]
mod tests {
    use super::{
        super::{field::LocalDrop, moisture::node_lengths},
        *,
    };

    fn drop(at: Vec3) -> LocalDrop {
        LocalDrop {
            at,
            before: at,
            velocity: Vec3::ZERO,
            radius: 0.003,
            r_min: 0.003,
            r_max: 0.015,
            strength: 1.0,
            mass: 1.1e-4,
            touch_count: 1.0,
            ride: Some(Entity::PLACEHOLDER),
        }
    }

    fn strand_lane<'a>(
        i: u32,
        positions: &'a [Vec3],
        velocities: &'a mut [Vec3],
    ) -> StrandLane<'a> {
        const LENGTHS: [f32; 8] = [0.03; 8];
        let strand = Entity::from_raw_u32(7 + i).unwrap();
        let lengths = &LENGTHS[..positions.len() - 1];
        let is_free = true;
        StrandLane { strand, positions, velocities, is_free, lengths, load: &[], film: &[] }
    }

    fn contact_params<'a>(
        wetting: &'a HairWetting,
        field: &'a Field,
        dt: f32,
    ) -> ContactParams<'a> {
        let steepest = 1.0 / (dt * dt);
        let (uptake, film_capacity, gravity) = (0.0, 0.0, Vec3::ZERO);
        ContactParams { wetting, field, dt, steepest, uptake, film_capacity, gravity }
    }

    #[test]
    fn every_droplet_in_reach_acts_on_every_node_and_no_other() {
        // Five strands beside each other, each shorter than the one before.
        let strands: Vec<Vec<Vec3>> = (0..5)
            .map(|s| {
                (0..9 - s).map(|i| Vec3::new(0.03 * i as f32, 0.004 * s as f32, 0.0)).collect()
            })
            .collect();
        let wetting = HairWetting { film_drag: 0.0, ..default() };
        let mut random = 1u32;
        let mut next = || {
            random = random.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            random as f32 / u32::MAX as f32 - 0.5
        };
        let mut field = Field::default();
        for k in 0..300 {
            let at = Vec3::new(0.12 + next() * 0.3, next() * 0.05, next() * 0.05);
            // Some ride on one of the strands, and do not pull at it.
            let ride = Entity::from_raw_u32(if k % 7 == 0 { 8 } else { 1000 });
            field.drops.push(LocalDrop { ride, ..drop(at) });
        }
        // and one exactly on a node
        field.drops.push(drop(strands[0][3]));
        field.sort(1e-3);
        let mut velocities: Vec<_> = strands.iter().map(|s| vec![Vec3::ZERO; s.len()]).collect();
        let mut out = DropletContacts::default();
        out.clear(field.drops.len());
        let mut strand_lanes: Vec<_> = (0..)
            .zip(strands.iter().zip(&mut velocities))
            .map(|(i, (positions, velocities))| strand_lane(i, positions, velocities))
            .collect();
        contact_params(&wetting, &field, 1.0 / 3600.0).contact(
            Level::new(),
            &mut strand_lanes,
            0,
            &mut out,
        );
        let mut given = Vec3::ZERO;
        for (s, strand_lane) in strand_lanes.iter().enumerate() {
            for (i, p) in strand_lane.positions.iter().enumerate() {
                let others = field.drops.iter().filter(|d| d.ride != Some(strand_lane.strand));
                let expected: Vec3 = others
                    .map(|d| {
                        let (offset, width) = (d.at - *p, d.r_max - d.r_min);
                        let distance = offset.length();
                        if distance < 1e-9 || distance > d.r_max {
                            return Vec3::ZERO;
                        }
                        let middle = (d.r_max + d.r_min) / width;
                        let f = model::adhesion(distance, 2.0 / width, middle);
                        offset / distance * f * (30.0 / 3600.0)
                    })
                    .sum();
                let expected = if i == 0 { Vec3::ZERO } else { expected };
                assert!(strand_lane.velocities[i].distance(expected) < 1e-5, "{s} {i}");
            }
            given += (strand_lane.velocities.iter().zip(node_lengths(strand_lane.lengths)))
                .map(|(v, l)| *v * (l * wetting.dry_mass()))
                .sum::<Vec3>();
        }
        // Impulses on droplets are opposite to those on strands: momentum is conserved.
        let got: Vec3 = out.sums.iter().map(|sum| sum.impulse).sum();
        assert!((given + got).length() < 1e-6 * given.length());
        for (k, d) in field.drops.iter().enumerate() {
            let at = |s: &&Vec<Vec3>| s.iter().any(|p| p.distance(d.at) < 0.004);
            assert_eq!(out.sums[k].touch_count as usize, strands.iter().filter(at).count(), "{k}");
        }
    }

    #[test]
    fn drag_takes_motion_and_keeps_momentum() {
        let positions = [Vec3::ZERO, Vec3::X * 0.03, Vec3::X * 0.06];
        let mut velocities = [Vec3::ZERO, Vec3::Y, Vec3::Z];
        let wetting = HairWetting { adhesion: 0.0, film_drag: 30.0, ..default() };
        let mut field = Field::default();
        field.drops.push(LocalDrop { touch_count: 3.0, ..drop(positions[1]) });
        field.sort(1e-3);
        let mut out = DropletContacts::default();
        out.clear(1);
        let dt = 1.0 / 360.0;
        let mut strand_lanes = [strand_lane(0, &positions, &mut velocities)];
        contact_params(&wetting, &field, dt).contact(Level::new(), &mut strand_lanes, 0, &mut out);
        let node = wetting.dry_mass() * 0.03;
        let share = 1.1e-4 / (1.1e-4 + node) * (30.0 * dt) / (1.0 + 3.0 * 30.0 * dt);
        assert!(velocities[1].distance(Vec3::Y * (1.0 - share)) < 1e-6, "{velocities:?}");
        assert_eq!(velocities[2], Vec3::Z);
        assert!(out.sums[0].impulse.distance(Vec3::Y * (share * node)) < 1e-6 * node);
    }

    #[test]
    fn a_fast_drop_does_not_fall_through_a_strand() {
        let positions = [Vec3::ZERO, Vec3::X * 0.03, Vec3::X * 0.06];
        let mut field = Field::default();
        let before = Vec3::new(0.04, 0.05, 0.0);
        let falling = LocalDrop { before, ride: None, ..drop(Vec3::new(0.04, -0.05, 0.0)) };
        let beside = LocalDrop {
            before: before + Vec3::Z * 0.02,
            at: falling.at + Vec3::Z * 0.02,
            ..falling
        };
        field.drops = vec![falling, beside];
        field.sort(1e-3);
        let mut out = DropletContacts::default();
        out.clear(field.drops.len());
        let mut velocities = [Vec3::ZERO; 3];
        let mut strand_lanes = [strand_lane(0, &positions, &mut velocities)];
        let wetting = HairWetting::default();
        contact_params(&wetting, &field, 1.0 / 360.0).contact(
            Level::new(),
            &mut strand_lanes,
            0,
            &mut out,
        );
        let hits: Vec<_> = out.landings.iter().map(|l| (l.drop, l.at)).collect();
        assert_eq!(hits.len(), 1);
        assert_eq!(hits[0].0, 0);
        assert!((hits[0].1 - 4.0 / 3.0).abs() < 1e-4 && (out.landings[0].when - 0.5).abs() < 1e-4);
    }
}
