//! Which strands are solved side by side: those of one hair with equal node count, in the order of their
//! [ranks](crate::hair::strand::StrandRank).
//!
//! A strand's bits depend on those beside it: passes over a block end when all of it is done. So blocks depend on
//! the hair alone: not on tables and their rows, in which a marker component or another hair's end moves strands about.

use super::{
    batched::{Attempt, Batched, Member},
    gather::{gather_nodes, in_lanes, scatter},
};
use crate::{
    base::{
        fault::HairFault,
        lanes::LANES,
        parallel::{Columns, Nanos, Scratch, for_each_block_ahead, for_each_part},
    },
    hair::strand::{PerHair, StrandRank},
};
use bevy::prelude::*;

/// Estimated time per node (ns) of a solve, and per strand of finding it.
const NODE: usize = 60;
const FIND: Nanos = Nanos(50);

/// One block of strands of equal node count through one substep. Returns faults of strands that were put back and
/// not reported before.
fn solve<T: Batched>(
    lanes: &mut T::Lanes,
    items: &mut [Member<'_, T>],
    params: &T::Params,
) -> Vec<HairFault> {
    let failed = attempt(lanes, items, params, Attempt::First);
    let mut faults = Vec::new();
    for lane in (0..items.len()).filter(|lane| failed & (1 << lane) != 0) {
        let one = &mut items[lane..=lane];
        let may_repeat = T::may_repeat(params) && one[0].strand.is_finite();
        if may_repeat && attempt(lanes, one, params, Attempt::Second) == 0 {
            continue;
        }
        let item = &mut items[lane];
        let fault = item.strand.put_back(item.own.remembered(params));
        faults.extend(fault.map(|fault| fault.of(item.entity)));
    }
    faults
}

/// Returns a bit for each strand that came out non-finite and is as it was.
fn attempt<T: Batched>(
    lanes: &mut T::Lanes,
    items: &mut [Member<'_, T>],
    params: &T::Params,
    attempt: Attempt,
) -> u32 {
    let sources = in_lanes(items, Member::source);
    let block = T::block(lanes);
    block.resize(sources[0].strand.nodes());
    gather_nodes(block, &sources, T::dt(params));
    T::step(lanes, &sources, items, params, attempt);
    scatter(T::block(lanes), items, params)
}

/// What strands are sorted by: those with equal node count follow each other.
fn key<T>(item: &Member<'_, T>) -> (Entity, StrandRank) {
    (item.hair, item.rank)
}

/// Whether two strands may share a block.
fn alike<T>(a: &Member<'_, T>, b: &Member<'_, T>) -> bool {
    a.hair == b.hair && a.strand.nodes() == b.strand.nodes()
}

/// Solves all strands, of about `nodes` nodes each (for the cost estimate). `item` makes a work
/// item of a row; strands of hairs without `params_of` are skipped. Faults are in the same order on
/// any number of threads.
pub(super) fn for_each_batch<'a, C: Columns, T: Batched>(
    tables: impl Iterator<Item = C>,
    nodes: usize,
    lanes: &Scratch<T::Lanes>,
    params_of: impl Fn(Entity) -> Option<T::Params> + Send + Sync,
    item: impl Fn(<C::Part as Iterator>::Item) -> Option<Member<'a, T>> + Send + Sync,
) -> Vec<HairFault> {
    let is_known = |params: &mut PerHair<T::Params>, strand: &Member<'a, T>| {
        let hair = strand.hair;
        params.index(hair, || params_of(hair)).is_some()
    };
    let parts = for_each_part(FIND, tables, PerHair::default, |params, rows| {
        let strands = rows.filter_map(&item).filter(|strand| is_known(params, strand));
        strands.collect::<Vec<Member<'a, T>>>()
    });
    let mut parts = in_order(parts);
    let blocks = parts.iter_mut().flat_map(|part| part.chunk_by_mut(alike));
    let blocks = blocks.flat_map(|alike| alike.chunks_mut(LANES));
    let mut blocks: Vec<_> = blocks.map(|block| (block, Vec::new())).collect();
    for_each_block_ahead(
        &mut blocks,
        Nanos(LANES * nodes * NODE),
        || (lanes.borrow(), PerHair::default()),
        |(strands, _)| strands.iter().for_each(T::prefetch),
        |(lanes, params), (strands, faults)| {
            let hair = strands[0].hair;
            if let Some(index) = params.index(hair, || params_of(hair)) {
                *faults = solve(&mut **lanes, strands, &params.values[index]);
            }
        },
    );
    blocks.into_iter().flat_map(|(_, faults)| faults).collect()
}

/// The strands in the order of their keys, in parts between which no block is cut. Mostly rows are in this order and
/// parts of full blocks: then nothing is moved.
fn in_order<'a, T>(mut parts: Vec<Vec<Member<'a, T>>>) -> Vec<Vec<Member<'a, T>>> {
    parts.retain(|part| !part.is_empty());
    let ends_with_block = |part: &[Member<'a, T>]| {
        let last = part.iter().rev().take_while(|strand| alike(strand, &part[part.len() - 1]));
        last.count().is_multiple_of(LANES)
    };
    let is_next = |(part, next): (&Vec<Member<'a, T>>, &Vec<Member<'a, T>>)| {
        let (last, first) = (&part[part.len() - 1], &next[0]);
        key(last) <= key(first) && (!alike(last, first) || ends_with_block(part))
    };
    let are_sorted = parts.iter().all(|part| part.is_sorted_by_key(key));
    if are_sorted && parts.iter().zip(parts.iter().skip(1)).all(is_next) {
        return parts;
    }
    let mut all: Vec<_> = parts.into_iter().flatten().collect();
    if !all.is_sorted_by_key(key) {
        all.sort_by_cached_key(key);
    }
    vec![all]
}

#[cfg(test)]
mod tests {
    use super::{super::batched::Source, *};
    use crate::{
        base::parallel::tables,
        hair::strand::{AddedMass, Strand},
        solver::rod::block::BlockLanes,
    };

    #[derive(Component)]
    struct Of(Entity);

    #[derive(Component)]
    struct OtherTable;

    struct NoColumns;

    impl Batched for NoColumns {
        type Params = u32;
        type Lanes = BlockLanes;

        fn dt(_: &u32) -> f32 {
            1.0
        }
        fn block(lanes: &mut BlockLanes) -> &mut BlockLanes {
            lanes
        }
        /// Leaves in the velocity of node 1 how many strands were in the block, how often, and the first one's rank.
        fn step(
            block: &mut BlockLanes,
            _: &[Source<'_>; LANES],
            items: &[Member<'_, Self>],
            params: &u32,
            _: Attempt,
        ) {
            assert!(items.len() <= LANES && *params == 7);
            assert!(items.iter().all(|item| alike(item, &items[0])));
            for lane in 0..items.len() {
                let [beside, times, first] = &mut block.nodes[1].v;
                (beside[lane], times[lane]) = (items.len() as f32, times[lane] + 1.0);
                first[lane] = items[0].rank.0 as f32;
            }
        }
    }

    /// Solves 1500 strands of so many `lengths` in an order that jumps about; `moved` ones are in another table. What
    /// the steps left, by the strands' ranks: hair has them up to the last hundred, which are of a bald one.
    fn left(lengths: usize, moved: impl Fn(usize) -> bool) -> Vec<Vec3> {
        let mut world = World::new();
        let [hair, bald] = [1, 2].map(|i| Entity::from_raw_u32(i).unwrap());
        for i in (0..1500).map(|i| i * 7 % 1500) {
            let points: Vec<Vec3> =
                (0..i * lengths / 1500 + 2).map(|k| Vec3::Y * k as f32).collect();
            let of = Of(if i >= 1400 { bald } else { hair });
            let strand = Strand::from_polyline(&points).unwrap();
            let rank = StrandRank(i as u32);
            let mut strand = world.spawn((strand, of, AddedMass::default(), rank));
            if moved(i) {
                strand.insert(OtherTable);
            }
        }
        let mut strands = world.query::<(&Of, &mut Strand, &AddedMass, &StrandRank)>();
        let mut strands = strands.query_mut(&mut world);
        let faults = for_each_batch(
            tables(&mut strands),
            100,
            &Scratch::default(),
            |of| (of == hair).then_some(7),
            |(of, strand, added, rank)| {
                let (entity, hair, rank) = (of.0, of.0, *rank);
                Some(Member { entity, hair, rank, strand, added, held: None, own: NoColumns })
            },
        );
        assert!(faults.is_empty());
        let mut found = vec![Vec3::ZERO; 1500];
        for (_, strand, _, rank) in &strands {
            found[rank.0 as usize] = strand.velocities()[1];
        }
        found
    }

    #[test]
    fn every_strand_is_in_one_full_block_whatever_table_it_lies_in() {
        for lengths in [1, 3, 16, 40] {
            let found = left(lengths, |_| false);
            let (hair, bald) = found.split_at(1400);
            assert!(hair.iter().all(|of| of.y == 1.0) && bald.iter().all(|of| of.y == 0.0));
            let blocks = hair.iter().map(|of| 1.0 / of.x).sum::<f32>().round() as usize;
            assert!(blocks <= 1400 / LANES + lengths, "{blocks} for {lengths}");
            assert_eq!(found, left(lengths, |i| i % 3 == 0));
            assert_eq!(found, left(lengths, |i| i == 700));
        }
    }
}
