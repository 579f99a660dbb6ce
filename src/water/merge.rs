//! `Interaction`: droplets that touch merge.

use super::{Droplet, DropletRules, model::ball_radius};
use bevy::{platform::collections::HashMap, prelude::*};

/// Failed candidates after which a drop stops searching in a tick. Only drops whose merged volume
/// would be too large can be that dense.
const MAX_FAILED: usize = 64;

/// Smaller drops count as empty and are despawned elsewhere (m³).
const MIN_VOLUME: f64 = *Droplet::VOLUME.valid.start() as f64;

/// Largest volume of a merged drop (m³).
const MAX_VOLUME: f64 = *Droplet::VOLUME.valid.end() as f64;

/// Largest cell coordinate; all drops beyond it share a cell.
const FAR: Vec3 = Vec3::splat(1e9);

/// At the end of a tick, when all are where they are then: droplets that touch merge at the position of the
/// larger one.
pub(super) fn merge_droplets(
    mut commands: Commands,
    rules: Res<DropletRules>,
    mut droplets: Query<(Entity, &mut Droplet)>,
    mut merging: Local<Merging>,
) {
    if droplets.iter().len() < 2 {
        return;
    }
    let mut drops: Vec<(Entity, Mut<'_, Droplet>)> = droplets.iter_mut().collect();
    drops.sort_by_cached_key(|(_, drop)| drop.order());
    if !rules.merging && drops.iter().all(|(_, drop)| !drop.drip) {
        return;
    }
    let places = drops.iter().map(|(_, d)| (d.position, d.volume));
    for [into, from] in merging.pairs(places, |i| rules.merging || drops[i].1.drip) {
        if let Ok([(_, into), (entity, from)]) = drops.get_disjoint_mut([*into, *from]) {
            into.bypass_change_detection().merge(from.bypass_change_detection());
            commands.entity(*entity).despawn();
        }
    }
}

/// Finds the drops that touch, from the largest down: every drop searches only larger or equal drops
/// that have not been merged, in cells of their size. So the cost depends on the drops that remain,
/// however many are in one place.
#[derive(Default)]
pub(super) struct Merging {
    /// Position, radius, and volume including merged drops.
    drops: Vec<(Vec3, f32, f64)>,
    order: Vec<usize>,
    /// The largest radius of each level, a power of two whatever drops there are; in a level are drops of more than
    /// half of it.
    levels: Vec<f32>,
    /// The last drop inserted into a cell of a level.
    cells: HashMap<(usize, IVec3), usize>,
    /// For each drop the previous one in its cell; itself for the first one.
    before: Vec<usize>,
    pairs: Vec<[usize; 2]>,
    /// Number of candidates tested.
    tested: usize,
}

impl Merging {
    /// Pairs of a drop and a smaller one that merges into it, of drops with position and volume
    /// (m³). Only those that `may_merge` are absorbed by others.
    pub fn pairs(
        &mut self,
        drops: impl Iterator<Item = (Vec3, f64)>,
        may_merge: impl Fn(usize) -> bool,
    ) -> &[[usize; 2]] {
        self.drops.clear();
        self.drops.extend(drops.map(|(place, volume)| (place, ball_radius(volume), volume)));
        let Self { drops, order, levels, cells, before, pairs, tested } = self;
        *tested = 0;
        levels.clear();
        cells.clear();
        pairs.clear();
        before.clear();
        before.extend(0..drops.len());
        order.clear();
        let counts = |i: &usize| drops[*i].2 >= MIN_VOLUME && drops[*i].0.is_finite();
        order.extend((0..drops.len()).filter(counts));
        // Equal ones in the order that they were given in.
        order.sort_unstable_by(|a, b| drops[*b].2.total_cmp(&drops[*a].2).then(a.cmp(b)));
        for &i in &*order {
            let (place, radius, volume) = drops[i];
            let levels_to_search = if may_merge(i) { &levels[..] } else { &[] };
            let larger = levels_to_search.iter().enumerate().find_map(|(level, &largest)| {
                let reach = radius + largest;
                let [low, high] = [-reach, reach].map(|by| cell(place + by, largest));
                let mut failed = 0;
                for z in low.z..=high.z {
                    for y in low.y..=high.y {
                        for x in low.x..=high.x {
                            let mut next = cells.get(&(level, IVec3::new(x, y, z))).copied();
                            while let Some(other) = next.filter(|_| failed < MAX_FAILED) {
                                *tested += 1;
                                let (center, size, holds) = drops[other];
                                let near = radius + size;
                                let touches = center.distance_squared(place) < near * near;
                                if touches && holds + volume <= MAX_VOLUME {
                                    return Some(other);
                                }
                                failed += 1;
                                next = Some(before[other]).filter(|b| *b != other);
                            }
                        }
                    }
                }
                None
            });
            if let Some(larger) = larger {
                drops[larger].2 += volume;
                pairs.push([larger, i]);
                continue;
            }
            if levels.last().is_none_or(|largest| radius <= 0.5 * largest) {
                levels.push(power_above(radius));
            }
            let level = levels.len() - 1;
            if let Some(last) = cells.insert((level, cell(place, levels[level])), i) {
                before[i] = last;
            }
        }
        pairs
    }
}

/// The smallest power of two that is not below a radius (m).
fn power_above(radius: f32) -> f32 {
    let power = f32::from_bits(radius.to_bits() & 0x7f80_0000);
    if power < radius { 2.0 * power } else { power }
}

/// The cell of a position in a level with drops of up to this radius (m): two drops that touch
/// are at most one cell apart along each axis.
fn cell(place: Vec3, largest: f32) -> IVec3 {
    (place / (4.0 * largest)).clamp(-FAR, FAR).floor().as_ivec3()
}

impl Droplet {
    /// Absorbs another drop, with its momentum.
    fn merge(&mut self, other: &mut Droplet) {
        let volume = self.volume + other.volume;
        let share = (other.volume / volume) as f32;
        if self.ride.is_none() {
            self.position = self.position.lerp(other.position, share);
        }
        self.velocity = self.velocity.lerp(other.velocity, share);
        (self.volume, self.counted.0) = (volume, self.counted.0 + other.counted.0);
        (other.volume, other.counted.0) = (0.0, 0.0);
        self.r_min = self.r_min.max(other.r_min).max(ball_radius(volume));
        self.r_max = self.r_max.max(other.r_max).max(1.5 * self.r_min);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use rand::{RngExt, SeedableRng, rngs::Xoshiro256PlusPlus};

    /// Drops of 0.5 to 2 mm strewn over a cube with sides of `size` (m).
    fn strewn(count: usize, size: f32) -> Vec<(Vec3, f64)> {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(3);
        let mut share = || random.random_range(0.0..1.0f32);
        let mut drop = || {
            let radius = 0.5e-3 + 1.5e-3 * share();
            (size * Vec3::new(share(), share(), share()), super::super::model::ball_volume(radius))
        };
        (0..count).map(|_| drop()).collect()
    }

    fn tested(drops: &[(Vec3, f64)]) -> (usize, usize) {
        let mut merging = Merging::default();
        let merged = merging.pairs(drops.iter().copied(), |_| true).len();
        (merging.tested, merged)
    }

    #[test]
    fn sixteen_thousand_drops_in_one_place_cost_no_more_than_spread_out() {
        const COUNT: usize = 16_000;
        let (spread, few) = tested(&strewn(COUNT, 0.2));
        let (in_one_place, merged) = tested(&strewn(COUNT, 0.0));
        println!("{spread} looked at ({few} merged), {in_one_place} in one place");
        assert!(few > 100 && merged == COUNT - 1);
        assert!(in_one_place <= 10 * spread && in_one_place <= 2 * COUNT);
        // Drops that are too large together stay, and are not all looked at by all.
        let full: Vec<_> = strewn(COUNT, 0.0).iter().map(|(at, _)| (*at, 0.9e-3)).collect();
        let (failed, none) = tested(&full);
        assert!(none == 0 && failed <= MAX_FAILED * COUNT, "{failed}");
        // One as large as a melon does not have all others look at each other.
        let mut among = strewn(COUNT, 0.2);
        among.push((Vec3::splat(0.1), 0.9e-3));
        assert!(tested(&among).0 < 2 * (spread + COUNT));
    }

    #[test]
    fn no_drop_grows_beyond_the_bound() {
        assert_eq!(tested(&[(Vec3::ZERO, 0.6e-3), (Vec3::ZERO, 0.6e-3)]).1, 0);
        let mut merging = Merging::default();
        let three = [(Vec3::ZERO, 0.3e-3), (Vec3::X * 0.01, 0.5e-3), (Vec3::ZERO, 0.3e-3)];
        assert_eq!(merging.pairs(three.into_iter(), |_| true), [[1, 0]]);
        // Among drops that stay whole only drips go.
        let drops = [(Vec3::ZERO, 1e-9), (Vec3::ZERO, 2e-9), (Vec3::ZERO, 3e-9)];
        assert_eq!(merging.pairs(drops.into_iter(), |i| i == 0), [[1, 0]]);
        assert!(merging.pairs(drops.into_iter(), |_| false).is_empty());
    }

    #[test]
    fn drops_that_merge_share_one_velocity() {
        let ball = |x: f32, volume| Droplet::new(Vec3::X * x, volume).unwrap();
        let mut a = ball(0.0, 3e-9).with_velocity(Vec3::X).unwrap();
        let mut b = ball(1e-3, 1e-9).with_velocity(Vec3::X * -3.0 + Vec3::Y * 4.0).unwrap();
        a.merge(&mut b);
        assert!(a.velocity.distance(Vec3::Y) < 1e-6, "momentum is kept: {}", a.velocity);
        assert!((a.volume - 4e-9).abs() < 1e-20 && b.volume == 0.0);
        assert!(a.position.distance(Vec3::X * 0.25e-3) < 1e-9);
    }

    proptest! {
        #[test]
        fn every_drop_that_is_left_touches_no_other(
            raw in proptest::collection::vec(
                (0.0f32..1.0, 0.0f32..1.0, 0.0f32..1.0, 1e-4f32..0.1), 1..60
            ),
            size in 0.1f32..1.0,
        ) {
            let drops: Vec<(Vec3, f64)> = raw
                .iter()
                .map(|&(x, y, z, r)| (size * Vec3::new(x, y, z), super::super::model::ball_volume(0.5 * r)))
                .collect();
            let mut merging = Merging::default();
            let pairs = merging.pairs(drops.iter().copied(), |_| true).to_vec();
            let gone: Vec<usize> = pairs.iter().map(|p| p[1]).collect();
            let touch = |i: usize, j: usize| {
                let near = ball_radius(drops[i].1) + ball_radius(drops[j].1);
                drops[i].0.distance(drops[j].0) < near - 1e-6
            };
            for [into, from] in &pairs {
                prop_assert!(drops[*into].1 >= drops[*from].1);
                prop_assert!(!gone.contains(into), "what takes a drop in stays");
            }
            let left: Vec<usize> = (0..drops.len()).filter(|i| !gone.contains(i)).collect();
            for (k, &i) in left.iter().enumerate() {
                for &j in &left[..k] {
                    let full = merging.drops[i].2 + drops[j].1 > MAX_VOLUME
                        || merging.drops[j].2 + drops[i].1 > MAX_VOLUME;
                    prop_assert!(!touch(i, j) || full, "{} and {}", i, j);
                }
            }
        }
    }
}
