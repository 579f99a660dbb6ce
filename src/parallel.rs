//! Work over many strands, on Bevy's compute task pool, with the same result on any thread count.

#[cfg(feature = "parallel")]
use bevy::tasks::ComputeTaskPool;

/// Fewer strands than this are not worth a task.
const GRAIN: usize = 32;

/// How many strands ahead of the present one memory is asked for: far enough for it to come, near
/// enough for it not to be pushed out again.
const AHEAD: usize = 6;

/// Calls `work` with every item. Items are independent, so the order cannot matter.
pub(crate) fn for_each<T: Send>(strands: &mut [T], work: impl Fn(&mut T) + Send + Sync) {
    for_each_ahead(strands, |_| {}, work);
}

/// The same, with `ahead` called for every item some time before `work`, to ask for its memory.
pub(crate) fn for_each_ahead<T: Send>(
    strands: &mut [T],
    ahead: impl Fn(&T) + Send + Sync,
    work: impl Fn(&mut T) + Send + Sync,
) {
    let sizes = Sizes { grain: GRAIN, ahead: AHEAD };
    for_each_init(strands, sizes, || (), ahead, |(), strand| work(strand));
}

/// Calls `work` with every block of about sixteen strands and scratch space that `init` makes once
/// a task.
pub(crate) fn for_each_block<T: Send, S>(
    blocks: &mut [T],
    init: impl Fn() -> S + Send + Sync,
    work: impl Fn(&mut S, &mut T) + Send + Sync,
) {
    for_each_block_ahead(blocks, init, |_| {}, work);
}

/// The same, with `ahead` called for every block one block before `work`, to ask for its memory.
pub(crate) fn for_each_block_ahead<T: Send, S>(
    blocks: &mut [T],
    init: impl Fn() -> S + Send + Sync,
    ahead: impl Fn(&T) + Send + Sync,
    work: impl Fn(&mut S, &mut T) + Send + Sync,
) {
    let sizes = Sizes { grain: GRAIN / 16, ahead: 1 };
    for_each_init(blocks, sizes, init, ahead, work);
}

struct Sizes {
    grain: usize,
    ahead: usize,
}

fn for_each_init<T: Send, S>(
    items: &mut [T],
    Sizes { grain, ahead: distance }: Sizes,
    init: impl Fn() -> S + Send + Sync,
    ahead: impl Fn(&T) + Send + Sync,
    work: impl Fn(&mut S, &mut T) + Send + Sync,
) {
    let serial = |items: &mut [T]| {
        let mut scratch = init();
        items.iter().take(distance).for_each(&ahead);
        let mut rest = items;
        while let Some((item, after)) = rest.split_first_mut() {
            if let Some(later) = after.get(distance - 1) {
                ahead(later);
            }
            work(&mut scratch, item);
            rest = after;
        }
    };
    // The thread that waits for the scope works too, so one pool thread makes two workers.
    #[cfg(feature = "parallel")]
    if let Some(pool) = ComputeTaskPool::try_get() {
        let workers = pool.thread_num() + 1;
        if workers > 1 && items.len() >= 2 * grain {
            let chunk = items.len().div_ceil(workers * 2).max(grain);
            pool.scope(|scope| {
                for chunk in items.chunks_mut(chunk) {
                    scope.spawn(async { serial(chunk) });
                }
            });
            return;
        }
    }
    #[cfg(not(feature = "parallel"))]
    let _ = grain;
    serial(items);
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
            for_each_ahead(
                &mut items,
                |item| assert!(!item.swap(true, Ordering::Relaxed), "asked for twice"),
                |item| assert!(*item.get_mut(), "not asked for"),
            );
        }
    }
}
