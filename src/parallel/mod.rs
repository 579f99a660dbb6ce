//! Work over many strands, on Bevy's compute task pool, with the same result on any thread count.

mod columns;
mod prefetch;
#[cfg(feature = "parallel")]
mod queue;

use bevy::{
    ecs::query::{ArchetypeFilter, ContiguousQueryData, QueryContiguousIter},
    prelude::*,
};
pub(crate) use columns::Columns;
pub(crate) use prefetch::prefetch;

#[cfg(feature = "parallel")]
use {bevy::tasks::ComputeTaskPool, queue::Queue};

/// The least work of a task, on one thread: to wake a thread for less takes longer than to do it.
pub(crate) const TASK: Nanos = Nanos(50_000);

/// How many tasks of that size have to be there before threads are woken: to wake one and to be woken by
/// it at the end takes about two of them.
#[cfg(feature = "parallel")]
const WORTH_WAKING: usize = 4;

/// About how long one item takes (ns). Decides whether threads are asked for help, never what comes out.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "parallel"), allow(dead_code, reason = "there is one thread"))]
pub(crate) struct Nanos(pub(crate) usize);

/// Rows of parts come in multiples of this, so that blocks of lanes fill up.
const GRAIN: usize = 16;

/// The most parts that a table is cut into, unless they would be larger than [`MOST_ROWS`].
const MOST_PARTS: usize = 32;

/// The most rows of a part.
const MOST_ROWS: usize = 512;

/// How many strands ahead of the present one memory is asked for: far enough for it to come, near
/// enough for it not to be pushed out again.
pub(crate) const AHEAD: usize = 6;

/// Calls `work` with every item. Items are independent, so the order cannot matter.
pub(crate) fn for_each<T: Send>(items: &mut [T], each: Nanos, work: impl Fn(&mut T) + Send + Sync) {
    for_each_init(items, each, || (), |_| {}, |(), item| work(item));
}

/// Calls `work` with every block of about sixteen strands and scratch space that `init` makes once
/// a thread.
pub(crate) fn for_each_block<T: Send, S>(
    blocks: &mut [T],
    each: Nanos,
    init: impl Fn() -> S + Send + Sync,
    work: impl Fn(&mut S, &mut T) + Send + Sync,
) {
    for_each_init(blocks, each, init, |_| {}, work);
}

/// The same, with `ahead` called for every block one block before `work`, to ask for its memory.
pub(crate) fn for_each_block_ahead<T: Send, S>(
    blocks: &mut [T],
    each: Nanos,
    init: impl Fn() -> S + Send + Sync,
    ahead: impl Fn(&T) + Send + Sync,
    work: impl Fn(&mut S, &mut T) + Send + Sync,
) {
    for_each_init(blocks, each, init, ahead, work);
}

/// The tables that a query finds its entities in.
pub(crate) fn tables<'a, 's, D: ContiguousQueryData, F: ArchetypeFilter>(
    query: &'a mut Query<'_, 's, D, F>,
) -> QueryContiguousIter<'a, 's, D, F> {
    query.contiguous_iter_mut().expect("components of strands lie in tables")
}

/// Goes through the rows of tables in parts: `work` gets some rows at a time, and scratch space that
/// `init` makes once a thread. A row takes about `each`. Says what it made of each part, in the order of
/// the rows. What the parts are does not depend on the number of threads.
pub(crate) fn for_each_part<C: Columns, S, O: Send>(
    each: Nanos,
    tables: impl Iterator<Item = C>,
    init: impl Fn() -> S + Send + Sync,
    work: impl Fn(&mut S, C::Part) -> O + Send + Sync,
) -> Vec<O> {
    let parts = tables.flat_map(|table| {
        let rows = part_rows(table.rows(), each);
        table.parts(rows)
    });
    let mut parts: Vec<_> = parts.map(|part| (Some(part), None)).collect();
    for_each_init(
        &mut parts,
        // Parts are cut to be worth a task each.
        TASK,
        init,
        |_| {},
        |scratch, (part, made)| {
            *made = part.take().map(|part| work(scratch, part));
        },
    );
    parts.into_iter().filter_map(|(_, made)| made).collect()
}

/// How many of a table's `rows` are one part: worth a task, about equal, and no more than what stays in
/// the cache.
fn part_rows(rows: usize, each: Nanos) -> usize {
    let worth = TASK.0.div_ceil(each.0.max(1));
    let most = rows.div_ceil(MOST_PARTS).max(worth).min(MOST_ROWS);
    let parts = (rows / most).max(rows.div_ceil(MOST_ROWS)).max(1);
    rows.div_ceil(parts).next_multiple_of(GRAIN).max(GRAIN)
}

fn for_each_init<T: Send, S>(
    items: &mut [T],
    each: Nanos,
    init: impl Fn() -> S + Send + Sync,
    ahead: impl Fn(&T) + Send + Sync,
    work: impl Fn(&mut S, &mut T) + Send + Sync,
) {
    // The calling thread works too, so one pool thread makes two workers.
    #[cfg(feature = "parallel")]
    if let Some(pool) = ComputeTaskPool::try_get() {
        let workers = pool.thread_num() + 1;
        let least = TASK.0.div_ceil(each.0.max(1));
        if workers > 1 && items.len() >= WORTH_WAKING * least {
            // More than threads, because some are longer than others.
            let chunk = items.len().div_ceil(workers * 8).max(least);
            let chunks = items.len().div_ceil(chunk);
            let queue = Queue::new(items.chunks_mut(chunk));
            let work = || {
                let mut scratch = init();
                queue.empty(|chunk| in_turn(chunk, 1, &ahead, |item| work(&mut scratch, item)));
            };
            pool.scope(|scope| {
                for _ in 0..pool.thread_num().min(chunks - 1) {
                    scope.spawn(async { work() });
                }
                work();
                queue.wait();
            });
            return;
        }
    }
    #[cfg(not(feature = "parallel"))]
    let _ = each;
    let mut scratch = init();
    in_turn(items, 1, &ahead, |item| work(&mut scratch, item));
}

/// Calls `work` with one item after the other, and `ahead` with the one that is `distance` later, to
/// ask for its memory.
pub(crate) fn in_turn<T>(
    items: &mut [T],
    distance: usize,
    ahead: impl Fn(&T),
    mut work: impl FnMut(&mut T),
) {
    items.iter().take(distance).for_each(&ahead);
    let mut rest = items;
    while let Some((item, after)) = rest.split_first_mut() {
        if let Some(later) = after.get(distance - 1) {
            ahead(later);
        }
        work(item);
        rest = after;
    }
}

/// The room of a vector whose items are not needed any more, for items that borrow something else. What
/// is gathered for a substep takes up to megabytes: asked for and given back each time, the system would
/// make and clear their pages each time.
pub(crate) fn emptied<A, B>(mut items: Vec<A>) -> Vec<B> {
    items.clear();
    // Collected in place, so that no memory changes hands.
    items.into_iter().filter_map(|_| None).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_worth_a_task_and_about_equal() {
        // Too little for two threads is one part, whatever it is made of.
        assert!(part_rows(294, Nanos(200)) >= 294 && part_rows(9, Nanos(10_000)) >= 9);
        assert!(part_rows(0, Nanos(200)) > 0, "parts of nothing");
        for (rows, nanos) in
            [(294, 2_400), (1_000, 500), (10_000, 1_600), (100_000, 20), (7_000, 0)]
        {
            let part = part_rows(rows, Nanos(nanos));
            let parts = rows.div_ceil(part);
            let last = rows - (parts - 1) * part;
            assert!(part <= MOST_ROWS + GRAIN, "{rows} rows of {nanos} ns: {part}");
            assert!(part == MOST_ROWS || part * nanos + GRAIN * nanos >= TASK.0, "{rows}: {part}");
            assert!(parts < 3 || last + parts * GRAIN > part, "{rows}: {parts} of {part}, {last}");
        }
    }

    #[test]
    fn a_vector_keeps_its_room_for_other_items() {
        let mut items: Vec<&u64> = Vec::with_capacity(1000);
        let number = 7;
        items.push(&number);
        let others: Vec<&f64> = emptied(items);
        assert!(others.is_empty() && others.capacity() == 1000, "{}", others.capacity());
    }

    #[test]
    fn memory_of_every_item_is_asked_for_once_and_before_its_turn() {
        use core::sync::atomic::{AtomicBool, Ordering};
        for count in [0, 1, 5, 6, 7, 500] {
            let mut items: Vec<_> = (0..count).map(|_| AtomicBool::new(false)).collect();
            in_turn(
                &mut items,
                AHEAD,
                |item| assert!(!item.swap(true, Ordering::Relaxed), "asked for twice"),
                |item| assert!(*item.get_mut(), "not asked for"),
            );
        }
    }
}
