//! Which strands are solved side by side: those of one hair with equal node count, as they lie in their
//! tables.
//!
//! Tables are cut into parts, and each thread gathers its own parts' strands and solves what fills a
//! block. What is left over, few where strands are alike, is put together in a second round, so that
//! lanes are full however uneven the strands are.

use super::lanes::LANES;
use crate::{
    parallel::{Columns, for_each_block_ahead, for_each_part_of},
    strand::PerHair,
};
use bevy::prelude::*;

/// About how many nodes are worth a thread of their own: it takes tens of microseconds to wake up.
const NODES: usize = 4096;

/// Calls `solve` with every block of strands of about so many `nodes`, and what holds for their hair.
/// `item` makes an item of a row that is to be solved, and `key` tells its hair and how many nodes it
/// has; strands of hairs without `params_of` are left out; `ahead` asks for the memory of an item that
/// comes next. What `solve` has to tell comes in the same order on any number of threads.
pub(crate) fn for_each_batch<C: Columns, P, B: Default, T: Send, O: Send>(
    tables: impl Iterator<Item = C>,
    nodes: usize,
    params_of: impl Fn(Entity) -> Option<P> + Send + Sync,
    item: impl Fn(<C::Part as Iterator>::Item) -> Option<T> + Send + Sync,
    key: impl Fn(&T) -> (Entity, usize) + Send + Sync,
    ahead: impl Fn(&T) + Send + Sync,
    solve: impl Fn(&mut B, &mut [T], &P) -> Vec<O> + Send + Sync,
) -> Vec<O> {
    let ahead = |strands: &[T]| strands.iter().for_each(&ahead);
    let hair = |strand: &T| key(strand).0;
    let solve = |lanes: &mut B, params: &mut PerHair<P>, block: &mut [T]| {
        let hair = hair(&block[0]);
        let index = params.index(hair, || params_of(hair));
        index.map_or_else(Vec::new, |index| solve(lanes, block, &params.values[index]))
    };
    let least = (NODES / nodes.max(1)).next_multiple_of(LANES).clamp(2 * LANES, 16 * LANES);
    let room = || (B::default(), PerHair::default(), Vec::new());
    let parts = for_each_part_of(least, tables, room, |(lanes, params, strands), rows| {
        strands.extend(rows.filter_map(&item).filter(|strand| {
            let hair = hair(strand);
            params.index(hair, || params_of(hair)).is_some()
        }));
        let mut told = Vec::new();
        let left = full_blocks(strands, &key, ahead, |block| {
            told.append(&mut solve(lanes, params, block));
        });
        strands.clear();
        (left, told)
    });
    let (left, mut told): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
    let mut left: Vec<T> = left.into_iter().flatten().collect();
    left.sort_by_key(&key);
    let blocks = left.chunk_by_mut(|a, b| key(a) == key(b));
    let blocks = blocks.flat_map(|alike| alike.chunks_mut(LANES));
    let mut blocks: Vec<_> = blocks.map(|block| (block, Vec::new())).collect();
    for_each_block_ahead(
        &mut blocks,
        || (B::default(), PerHair::default()),
        |(strands, _)| ahead(strands),
        |(lanes, params), (strands, told)| *told = solve(lanes, params, strands),
    );
    told.extend(blocks.into_iter().map(|(_, told)| told));
    told.into_iter().flatten().collect()
}

/// Calls `work` with blocks of alike strands as long as they are full, and returns what is left over;
/// `ahead` is called with the strands that come next. Lanes do not see each other, so how strands are
/// grouped changes no bit of the result.
fn full_blocks<T, K: Ord>(
    strands: &mut Vec<T>,
    key: impl Fn(&T) -> K,
    ahead: impl Fn(&[T]),
    mut work: impl FnMut(&mut [T]),
) -> Vec<T> {
    if !strands.is_sorted_by_key(&key) {
        strands.sort_by_key(&key);
    }
    let (mut first, mut left) = (0, Vec::new());
    ahead(&strands[..LANES.min(strands.len())]);
    while first < strands.len() {
        let alike = &strands[first..];
        let alike = alike.partition_point(|strand| key(strand) == key(&alike[0]));
        let rest = alike % LANES;
        for block in (first..first + alike - rest).step_by(LANES) {
            let next = block + LANES;
            ahead(&strands[next..strands.len().min(next + LANES)]);
            work(&mut strands[block..next]);
        }
        first += alike - rest;
        left.extend(strands.drain(first..first + rest));
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Component)]
    struct Length(usize);

    #[derive(Component, Default)]
    struct Met {
        times: u32,
        beside: usize,
    }

    #[derive(Component)]
    struct Aside;

    #[test]
    fn every_strand_is_in_one_block_of_its_like_and_blocks_are_full() {
        for lengths in [1, 3, 16, 40] {
            let mut world = World::new();
            // In two tables, in an order that jumps about.
            for i in 0..1500usize {
                let mut strand = world.spawn((Length(i * 7 % lengths), Met::default()));
                if i % 3 == 0 {
                    strand.insert(Aside);
                }
            }
            let mut strands = world.query::<(Entity, &Length, &mut Met)>();
            let mut strands = strands.query_mut(&mut world);
            let [hair, bald] = [1, 2].map(|i| Entity::from_raw_u32(i).unwrap());
            let told = for_each_batch(
                strands.contiguous_iter_mut().unwrap(),
                100,
                |of| (of == hair).then_some(7),
                |(_, length, met)| {
                    let of = if length.0 == 2 { bald } else { hair };
                    Some((of, length.0, met))
                },
                |item| (item.0, item.1),
                |_| {},
                |(), items, params| {
                    assert!(items.len() <= LANES && *params == 7);
                    assert!(items.iter().all(|item| (item.0, item.1) == (hair, items[0].1)));
                    let beside = items.len();
                    for (.., met) in items {
                        (met.times, met.beside) = (met.times + 1, beside);
                    }
                    vec![beside]
                },
            );
            let solved = strands.iter().filter(|(_, length, _)| length.0 != 2).count();
            assert_eq!(told.iter().sum::<usize>(), solved);
            assert!(told.len() <= 1500 / LANES + lengths, "{} for {lengths}", told.len());
            for (_, length, met) in &strands {
                assert_eq!(met.times, u32::from(length.0 != 2));
                assert!(met.times == 0 || told.contains(&met.beside), "{}", length.0);
            }
        }
    }
}
