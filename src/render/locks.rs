//! Locks: which strands converge, in three nested sizes.

use super::{
    drawn_strand::{DrawnStrand, GuideRoot, LockOffset, direction},
    followers::HairFollowers,
};
use crate::base::grid::KdTree;
use bevy::{platform::collections::HashMap, prelude::*};
use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

/// Minimum distance of the centres, as a share of the spacing; the mean distance is then about the
/// spacing.
const CLOSEST: f32 = 0.8;
/// By how much the convergence of locks varies, a share.
const LOOSER: f32 = 0.3;
/// Share of flyaways that are broken off.
const BROKEN: f32 = 0.2;
/// Width of flyaways, a share.
const FINE: f32 = 0.7;
/// Share of strands out of phase with their lock's curl.
const LEAPS: f32 = 0.05;

/// Assigns every follower its locks and their shared variations, and turns some into flyaways.
pub(super) fn draw_together(
    followers: &mut [DrawnStrand],
    guides: &[GuideRoot],
    settings: &HairFollowers,
) {
    let roots = Roots::of(followers, guides);
    let levels = settings.lock_spacing.to_array().map(|spacing| roots.middles(spacing));
    for i in 0..followers.len() {
        let small = roots.nearest(&levels[2], i);
        let middle = roots.nearest(&levels[1], small);
        let large = roots.nearest(&levels[0], middle);
        let mut locks = [LockOffset::default(); 3];
        for (lock, to) in locks.iter_mut().zip([large, middle, small]) {
            *lock = roots.offset(followers, guides, i, to);
        }
        let random_unit = |of: usize| random_unit(roots.seeds[of] ^ 0x51ed_270b);
        let strand = &mut followers[i];
        strand.locks = locks;
        let shorter = 1.0 - settings.lock_length_variation * random_unit(large);
        strand.length *= shorter;
        strand.size *= shorter;
        let own = &mut Xoshiro256PlusPlus::seed_from_u64(u64::from(strand.seed) << 8);
        let leap = if own.random::<f32>() < LEAPS { own.random::<f32>() } else { 0.0 };
        let phase = strand.phase + settings.lock_phase * (random_unit(middle) + leap);
        strand.phase = phase.min(0.5 * strand.length.min(1.0));
        // Outward: the component of the root direction perpendicular to the reach.
        let GuideRoot { normal, reach, .. } = guides[strand.guides[0] as usize];
        let outward = normal.reject_from_normalized(reach.normalize_or_zero()).normalize_or_zero();
        // No strand strays into the skin.
        strand.stray -= 2.0 * outward * strand.stray.dot(outward).min(0.0);
        if own.random::<f32>() < settings.flyaways {
            stand_off(strand, outward, settings.flyaway_reach, own);
        }
    }
}

/// Makes a flyaway of a strand.
fn stand_off(strand: &mut DrawnStrand, outward: Vec3, most: f32, random: &mut Xoshiro256PlusPlus) {
    strand.locks[1..].fill(LockOffset::default());
    strand.width *= FINE;
    if random.random::<f32>() < BROKEN {
        let left = 0.1 + 0.2 * random.random::<f32>();
        strand.length *= left;
        strand.size *= left;
        strand.phase *= left;
    }
    // Limited, so that the strand hardly gets longer.
    let far = (most * (0.2 + 0.8 * random.random::<f32>())).min(0.25 * strand.size);
    strand.stray = (outward + 0.8 * direction(random)).normalize_or_zero() * far;
}

/// The roots of followers.
struct Roots {
    places: Vec<Vec3>,
    /// Their directions at the scalp: locks do not reach across a parting.
    leave: Vec<Vec3>,
    seeds: Vec<u32>,
}

impl Roots {
    fn of(followers: &[DrawnStrand], guides: &[GuideRoot]) -> Self {
        let leave = |strand: &DrawnStrand| guides[strand.guides[0] as usize].normal;
        Self {
            places: followers.iter().map(|strand| strand.place(guides)).collect(),
            leave: followers.iter().map(leave).collect(),
            seeds: followers.iter().map(|strand| strand.seed).collect(),
        }
    }

    fn same_side(&self, a: usize, b: usize) -> bool {
        self.leave[a].dot(self.leave[b]) > 0.0
    }

    /// The centre strands of locks: a subset that is about a spacing apart.
    fn middles(&self, spacing: f32) -> KdTree {
        let least = CLOSEST * spacing;
        let mut cells = HashMap::<IVec3, Vec<usize>>::new();
        let mut found = Vec::new();
        for (i, place) in self.places.iter().enumerate().filter(|(_, place)| place.is_finite()) {
            let cell = (place / least).floor().as_ivec3();
            let around = (0..27).map(|k| cell + IVec3::new(k % 3, k / 3 % 3, k / 9) - 1);
            let mut near = around.filter_map(|cell| cells.get(&cell)).flatten();
            if near.any(|j| place.distance(self.places[*j]) < least && self.same_side(i, *j)) {
                continue;
            }
            cells.entry(cell).or_default().push(i);
            found.push((*place, i as u32));
        }
        KdTree::new(found)
    }

    /// The nearest centre; the strand itself where there is none.
    fn nearest(&self, middles: &KdTree, i: usize) -> usize {
        let accepts = |j: u32, _| self.same_side(i, j as usize);
        let mut near = middles.nearest_of::<1, _>(self.places[i], accepts);
        near.next().map_or(i, |(j, _)| j as usize)
    }

    /// The offset from strand `i` to centre `to`.
    fn offset(
        &self,
        followers: &[DrawnStrand],
        guides: &[GuideRoot],
        i: usize,
        to: usize,
    ) -> LockOffset {
        if i == to {
            return default();
        }
        let (own, middle) = (&followers[i], &followers[to]);
        let strength = 1.0 - LOOSER * random_unit(self.seeds[to]);
        let apart = self.places[to] - self.places[i];
        let near = own.guides.iter().zip(own.weights).filter(|(_, w)| *w > 0.0);
        let along = near.fold(Vec3::ZERO, |sum, (g, w)| sum + guides[*g as usize].reach * w);
        let across = apart.reject_from_normalized(along.normalize_or_zero());
        if !across.is_finite() {
            return default();
        }
        // Weights of guides that this strand does not have are distributed to its own.
        let mut weights = own.guides.map(|guide| {
            let shares = middle.guides.iter().zip(middle.weights);
            shares.filter(|(g, _)| **g == guide).map(|(_, w)| w).sum::<f32>()
        });
        // Guides that are not used repeat the first.
        for (weight, guide) in weights.iter_mut().zip(own.guides).skip(1) {
            if guide == own.guides[0] {
                *weight = 0.0;
            }
        }
        let known: f32 = weights.iter().sum();
        for (weight, own) in weights.iter_mut().zip(own.weights) {
            *weight = strength * (*weight - known * own);
        }
        LockOffset { root: across * strength, weights }
    }
}

/// A number in 0…1 from a seed: the hash of `strands.wgsl`.
pub(super) fn random_unit(seed: u32) -> f32 {
    let state = seed.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (((word >> 22) ^ word) >> 8) as f32 / 16_777_216.0
}

#[cfg(test)]
mod tests {
    use super::super::curve::{Guide, strand_point};
    use super::*;

    /// Guides on a square field that all hang down, 2 cm apart, and followers at random between them.
    fn field() -> (Vec<GuideRoot>, Vec<DrawnStrand>) {
        let guide = |i: i32| GuideRoot {
            place: Vec3::new((i % 6) as f32, 0.0, (i / 6) as f32) * 0.02,
            normal: Vec3::X,
            length: 0.2,
            reach: Vec3::new(0.05, -0.19, 0.0),
        };
        let guides: Vec<_> = (0..36).map(guide).collect();
        let settings = HairFollowers {
            flyaways: 0.0,
            stray: 0.0,
            clump: 0.0,
            length_variation: 0.0,
            lock_length_variation: 0.0,
            phase_variation: 0.0,
            ..HairFollowers::new(3000)
        };
        let drawn = super::super::scatter::scatter(&guides, None, &settings);
        (guides, drawn[36..].to_vec())
    }

    /// 64 cells of pairs hold about as many each, which neither a constant, a ramp nor a hash whose neighbours are
    /// alike would do: χ² of 63 degrees of freedom is below 110 with a probability of 0.9998.
    #[test]
    fn the_hash_is_uniform_and_neighbours_are_independent() {
        let mut cells = [0u32; 64];
        for i in 0..6400 {
            let [a, b] = [i, i + 1].map(|i| (8.0 * random_unit(i)).floor() as usize);
            cells[8 * a + b] += 1;
        }
        let squared: f32 = cells.iter().map(|n| (*n as f32 - 100.0).powi(2) / 100.0).sum();
        assert!(squared < 110.0, "{squared}");
    }

    /// Mean distance of each tip to the nearest others, drawn with these strengths.
    fn crowding(guides: &[GuideRoot], drawn: &[DrawnStrand], locks: Vec3) -> f32 {
        let nodes: Vec<[Vec3; 2]> = guides.iter().map(|g| [g.place, g.place + g.reach]).collect();
        let settings = HairFollowers { clump: 0.0, frizz: 0.0, locks, ..default() };
        let of = |i: u32| Guide { nodes: &nodes[i as usize], ..default() };
        let tip = |strand: &DrawnStrand| strand_point(strand, of, 1.0, &settings, &[]).position;
        let tips: Vec<Vec3> = drawn.iter().map(tip).collect();
        let tree = KdTree::new(tips.iter().copied().zip(0u32..));
        let near = |p: &Vec3| tree.nearest::<8>(*p).map(|(_, square)| square.sqrt()).sum::<f32>();
        tips.iter().map(near).sum::<f32>() / tips.len() as f32 / 7.0
    }

    #[test]
    fn every_level_draws_tips_together_more() {
        let (guides, drawn) = field();
        let open = crowding(&guides, &drawn, Vec3::ZERO);
        let mut before = open;
        for locks in [Vec3::new(0.0, 0.0, 0.6), Vec3::new(0.0, 0.6, 0.6), Vec3::splat(0.6)] {
            let now = crowding(&guides, &drawn, locks);
            println!("{locks}: {now} m for {open} m");
            assert!(now < 0.9 * before, "{now} after {before}");
            before = now;
        }
    }

    #[test]
    fn locks_keep_the_length_of_strands() {
        let (guides, drawn) = field();
        let nodes: Vec<[Vec3; 2]> = guides.iter().map(|g| [g.place, g.place + g.reach]).collect();
        let of = |i: u32| Guide { nodes: &nodes[i as usize], ..default() };
        let settings = HairFollowers { clump: 0.0, locks: Vec3::splat(0.6), ..default() };
        let mut worst = 0.0f32;
        for strand in &drawn {
            let at = |k: u32| strand_point(strand, of, k as f32 / 24.0, &settings, &[]).position;
            let length: f32 = (0..24).map(|k| at(k).distance(at(k + 1))).sum();
            worst = worst.max((length / (strand.size * (1.0 - strand.phase)) - 1.0).abs());
        }
        println!("largest change of length {worst}");
        assert!(worst < 0.05, "{worst}");
    }

    #[test]
    fn locks_do_not_reach_across_a_parting() {
        let side = |x: f32| GuideRoot {
            place: Vec3::X * 0.005 * x,
            normal: Vec3::X * x,
            length: 0.2,
            reach: Vec3::new(0.1 * x, -0.1, 0.0),
        };
        let guides = [side(-1.0), side(1.0)];
        let strand = |i: u32| DrawnStrand {
            guides: [i % 2; 3],
            weights: [1.0, 0.0, 0.0],
            length: 1.0,
            seed: i,
            ..default()
        };
        let mut drawn: Vec<_> = (0..40).map(strand).collect();
        draw_together(&mut drawn, &guides, &HairFollowers::default());
        for strand in &drawn {
            assert!(strand.locks.iter().all(|lock| lock.root == Vec3::ZERO), "{strand:?}");
        }
    }

    #[test]
    fn broken_strands_do_not_disturb() {
        let nan = GuideRoot { place: Vec3::NAN, normal: Vec3::NAN, ..default() };
        let strand = DrawnStrand { weights: [1.0, 0.0, 0.0], length: 1.0, ..default() };
        let mut drawn = [strand; 4];
        let all = HairFollowers { flyaways: 1.0, ..default() };
        draw_together(&mut drawn, &[nan], &all);
        assert!(drawn.iter().all(|strand| strand.stray.is_finite()), "{drawn:?}");
        draw_together(&mut [], &[], &all);
    }
}
