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
use core::ops::{Deref, DerefMut};
pub(crate) use prefetch::prefetch;
use std::sync::{Mutex, PoisonError};

#[cfg(feature = "parallel")]
use {bevy::tasks::ComputeTaskPool, queue::Queue};

/// The minimum work of a task: waking a thread takes longer than doing less.
pub(crate) const TASK: Nanos = Nanos(50_000);

/// The minimum work, in such tasks, for which other threads are woken: waking one and being woken
/// by it at the end takes about as long as two tasks.
#[cfg(feature = "parallel")]
const MIN_TASKS: usize = 4;

/// Estimated time of one item (ns). Decides whether other threads are used, never the result.
#[derive(Clone, Copy, Debug)]
#[cfg_attr(not(feature = "parallel"), allow(dead_code, reason = "there is one thread"))]
pub(crate) struct Nanos(pub(crate) usize);

/// Parts have a multiple of this many rows, so that blocks of lanes fill up.
const GRAIN: usize = 16;

/// The maximum number of parts of a table, unless they would be larger than [`MAX_ROWS`].
const MAX_PARTS: usize = 32;

/// The maximum number of rows of a part.
const MAX_ROWS: usize = 512;

/// How many strands ahead memory is prefetched: far enough to arrive in time, near enough not to be
/// evicted again.
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

/// The same, with `ahead` called for every block one block before `work`, to prefetch it.
pub(crate) fn for_each_block_ahead<T: Send, S>(
    blocks: &mut [T],
    each: Nanos,
    init: impl Fn() -> S + Send + Sync,
    ahead: impl Fn(&T) + Send + Sync,
    work: impl Fn(&mut S, &mut T) + Send + Sync,
) {
    for_each_init(blocks, each, init, ahead, work);
}

/// The tables that a query matches.
pub(crate) fn tables<'a, 's, D: ContiguousQueryData, F: ArchetypeFilter>(
    query: &'a mut Query<'_, 's, D, F>,
) -> QueryContiguousIter<'a, 's, D, F> {
    query.contiguous_iter_mut().expect("components of strands lie in tables")
}

/// Processes the rows of tables in parts: `work` gets the rows of a part, and scratch space that
/// `init` makes once per thread. A row takes about `each`. Returns the result of each part, in the
/// order of the rows. Parts do not depend on the number of threads.
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
        // Each part is large enough for a task.
        TASK,
        init,
        |_| {},
        |scratch, (part, made)| {
            *made = part.take().map(|part| work(scratch, part));
        },
    );
    parts.into_iter().filter_map(|(_, made)| made).collect()
}

/// Rows per part of a table with `rows`: enough work for a task, about equal, and small enough for the
/// cache.
fn part_rows(rows: usize, each: Nanos) -> usize {
    let worth = TASK.0.div_ceil(each.0.max(1));
    let most = rows.div_ceil(MAX_PARTS).max(worth).min(MAX_ROWS);
    let parts = (rows / most).max(rows.div_ceil(MAX_ROWS)).max(1);
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
        let is_worth_it = items.len().saturating_mul(each.0) >= MIN_TASKS * TASK.0;
        if workers > 1 && items.len() > 1 && is_worth_it {
            // More chunks than threads, because some take longer than others.
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

/// Calls `work` with one item after the other, and `ahead` with the one `distance` later, to prefetch
/// it.
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

/// Scratch space of threads, kept from one call to the next: allocated anew it would take megabytes of pages
/// that the operating system has to map and clear.
#[derive(Debug, Default)]
pub(crate) struct Scratch<T>(Mutex<Vec<T>>);

impl<T: Default> Scratch<T> {
    /// One that is not borrowed, with its contents as they were left.
    pub(crate) fn borrow(&self) -> Borrowed<'_, T> {
        let mut free = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        Borrowed { one: free.pop().unwrap_or_default(), owner: self }
    }
}

/// Scratch space of one thread, given back when dropped.
pub(crate) struct Borrowed<'a, T: Default> {
    one: T,
    owner: &'a Scratch<T>,
}

impl<T: Default> Deref for Borrowed<'_, T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.one
    }
}

impl<T: Default> DerefMut for Borrowed<'_, T> {
    fn deref_mut(&mut self) -> &mut T {
        &mut self.one
    }
}

impl<T: Default> Drop for Borrowed<'_, T> {
    fn drop(&mut self) {
        let mut free = self.owner.0.lock().unwrap_or_else(PoisonError::into_inner);
        free.push(core::mem::take(&mut self.one));
    }
}

/// Reuses the allocation of a vector for items of another lifetime. Data gathered for a substep
/// takes up to megabytes: if it were allocated anew each time, the operating system would map and
/// clear its pages each time.
pub(crate) fn emptied<A, B>(mut items: Vec<A>) -> Vec<B> {
    items.clear();
    // `collect` reuses the allocation in place.
    items.into_iter().filter_map(|_| None).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_large_enough_for_a_task_and_about_equal() {
        // Too little work for two threads is one part.
        assert!(part_rows(294, Nanos(200)) >= 294 && part_rows(9, Nanos(10_000)) >= 9);
        assert!(part_rows(0, Nanos(200)) > 0, "parts of nothing");
        for (rows, nanos) in
            [(294, 2_400), (1_000, 500), (10_000, 1_600), (100_000, 20), (7_000, 0)]
        {
            let part = part_rows(rows, Nanos(nanos));
            let parts = rows.div_ceil(part);
            let last = rows - (parts - 1) * part;
            assert!(part <= MAX_ROWS + GRAIN, "{rows} rows of {nanos} ns: {part}");
            assert!(part == MAX_ROWS || part * nanos + GRAIN * nanos >= TASK.0, "{rows}: {part}");
            assert!(parts < 3 || last + parts * GRAIN > part, "{rows}: {parts} of {part}, {last}");
        }
    }

    #[test]
    fn a_vector_keeps_its_allocation_for_other_items() {
        let mut items: Vec<&u64> = Vec::with_capacity(1000);
        let number = 7;
        items.push(&number);
        let others: Vec<&f64> = emptied(items);
        assert!(others.is_empty() && others.capacity() == 1000, "{}", others.capacity());
    }

    #[test]
    fn scratch_space_is_kept_and_never_shared() {
        let scratch = Scratch::<Vec<u8>>::default();
        let (mut a, b) = (scratch.borrow(), scratch.borrow());
        a.reserve(1000);
        drop((b, a));
        assert!(scratch.borrow().capacity() >= 1000);
        let [a, b] = [scratch.borrow(), scratch.borrow()];
        assert!((a.capacity() >= 1000) != (b.capacity() >= 1000));
    }

    #[test]
    fn every_item_is_prefetched_once_and_before_its_turn() {
        use core::sync::atomic::{AtomicBool, Ordering};
        for count in [0, 1, 5, 6, 7, 500] {
            let mut items: Vec<_> = (0..count).map(|_| AtomicBool::new(false)).collect();
            in_turn(
                &mut items,
                AHEAD,
                |item| assert!(!item.swap(true, Ordering::Relaxed), "prefetched twice"),
                |item| assert!(*item.get_mut(), "not prefetched"),
            );
        }
    }
}
