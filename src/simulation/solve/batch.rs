//! Which strands are solved side by side: those of one hair with equal node count, in the order of their
//! tables.
//!
//! Tables are split into parts, and each thread gathers the strands of its parts and solves full blocks.
//! The remainders are combined in a second round, so that lanes are full however node counts vary.

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
    hair::strand::PerHair,
};
use bevy::prelude::*;

/// Estimated time per node (ns).
const NODE: usize = 60;

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

fn key<T>(item: &Member<'_, T>) -> (Entity, usize) {
    (item.hair, item.strand.nodes())
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
    let solve =
        |lanes: &mut T::Lanes, params: &mut PerHair<T::Params>, block: &mut [Member<'a, T>]| {
            let hair = block[0].hair;
            let index = params.index(hair, || params_of(hair));
            index.map_or_else(Vec::new, |index| solve(lanes, block, &params.values[index]))
        };
    let each = nodes * NODE;
    let scratch = || (lanes.borrow(), PerHair::default(), Vec::new());
    let parts = for_each_part(Nanos(each), tables, scratch, |(lanes, params, strands), rows| {
        strands.extend(rows.filter_map(&item).filter(|strand: &Member<'a, T>| {
            let hair = strand.hair;
            params.index(hair, || params_of(hair)).is_some()
        }));
        let mut faults = Vec::new();
        let left = full_blocks(strands, |block| faults.append(&mut solve(lanes, params, block)));
        strands.clear();
        (left, faults)
    });
    let (left, mut faults): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
    let mut left: Vec<Member<'a, T>> = left.into_iter().flatten().collect();
    left.sort_by_key(key);
    let blocks = left.chunk_by_mut(|a, b| key(a) == key(b));
    let blocks = blocks.flat_map(|alike| alike.chunks_mut(LANES));
    let mut blocks: Vec<_> = blocks.map(|block| (block, Vec::new())).collect();
    for_each_block_ahead(
        &mut blocks,
        Nanos(LANES * each),
        || (lanes.borrow(), PerHair::default()),
        |(strands, _)| strands.iter().for_each(T::prefetch),
        |(lanes, params), (strands, faults)| *faults = solve(lanes, params, strands),
    );
    faults.extend(blocks.into_iter().map(|(_, faults)| faults));
    faults.into_iter().flatten().collect()
}

/// Calls `work` with full blocks of strands of equal node count, and returns the remainder. Which strands
/// share a block depends on the rows of a part alone, not on threads.
fn full_blocks<'a, T: Batched>(
    strands: &mut Vec<Member<'a, T>>,
    mut work: impl FnMut(&mut [Member<'a, T>]),
) -> Vec<Member<'a, T>> {
    if !strands.is_sorted_by_key(key) {
        strands.sort_by_key(key);
    }
    let (mut first, mut left) = (0, Vec::new());
    strands[..LANES.min(strands.len())].iter().for_each(T::prefetch);
    while first < strands.len() {
        let alike = &strands[first..];
        let alike = alike.partition_point(|strand| key(strand) == key(&alike[0]));
        let rest = alike % LANES;
        for block in (first..first + alike - rest).step_by(LANES) {
            let next = block + LANES;
            strands[next..strands.len().min(next + LANES)].iter().for_each(T::prefetch);
            work(&mut strands[block..next]);
        }
        first += alike - rest;
        left.extend(strands.drain(first..first + rest));
    }
    left
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
        /// Leaves in the velocity of node 1 how many strands were in the block and how often.
        fn step(
            block: &mut BlockLanes,
            _: &[Source<'_>; LANES],
            items: &[Member<'_, Self>],
            params: &u32,
            _: Attempt,
        ) {
            assert!(items.len() <= LANES && *params == 7);
            assert!(items.iter().all(|item| key(item) == key(&items[0])));
            for lane in 0..items.len() {
                let [beside, times, _] = &mut block.nodes[1].v;
                (beside[lane], times[lane]) = (items.len() as f32, times[lane] + 1.0);
            }
        }
    }

    #[test]
    fn every_strand_is_in_one_block_of_equal_node_count_and_blocks_are_full() {
        for lengths in [1, 3, 16, 40] {
            let mut world = World::new();
            let [hair, bald] = [1, 2].map(|i| Entity::from_raw_u32(i).unwrap());
            // In two tables, in an order that jumps about.
            for i in 0..1500 {
                let length = i * 7 % lengths;
                let nodes: Vec<Vec3> = (0..length + 2).map(|k| Vec3::Y * k as f32).collect();
                let of = Of(if length == 2 { bald } else { hair });
                let strand = Strand::from_polyline(&nodes).unwrap();
                let mut strand = world.spawn((strand, of, AddedMass::default()));
                if i % 3 == 0 {
                    strand.insert(OtherTable);
                }
            }
            let mut strands = world.query::<(&Of, &mut Strand, &AddedMass)>();
            let mut strands = strands.query_mut(&mut world);
            let faults = for_each_batch(
                tables(&mut strands),
                100,
                &Scratch::default(),
                |of| (of == hair).then_some(7),
                |(of, strand, added)| {
                    let (entity, hair) = (of.0, of.0);
                    Some(Member { entity, hair, strand, added, held: None, own: NoColumns })
                },
            );
            assert!(faults.is_empty());
            let mut blocks = 0.0;
            for (of, strand, _) in &strands {
                let Vec3 { x: beside, y: times, .. } = strand.velocities()[1];
                assert_eq!(times, if of.0 == hair { 1.0 } else { 0.0 });
                blocks += if of.0 == hair { 1.0 / beside } else { 0.0 };
            }
            assert!(blocks.round() as usize <= 1500 / LANES + lengths, "{blocks} for {lengths}");
        }
    }
}
