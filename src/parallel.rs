//! Work over many strands, on Bevy's compute task pool, with the same result on any thread count.

#[cfg(feature = "parallel")]
use bevy::tasks::ComputeTaskPool;

/// Fewer strands than this are not worth a task.
const GRAIN: usize = 32;

/// Calls `work` with every item. Items are independent, so the order cannot matter.
pub(crate) fn for_each<T: Send>(strands: &mut [T], work: impl Fn(&mut T) + Send + Sync) {
    for_each_init(strands, GRAIN, || (), |(), strand| work(strand));
}

/// Calls `work` with every block of about sixteen strands and scratch space that `init` makes once
/// a task.
pub(crate) fn for_each_block<T: Send, S>(
    blocks: &mut [T],
    init: impl Fn() -> S + Send + Sync,
    work: impl Fn(&mut S, &mut T) + Send + Sync,
) {
    for_each_init(blocks, GRAIN / 16, init, work);
}

fn for_each_init<T: Send, S>(
    items: &mut [T],
    grain: usize,
    init: impl Fn() -> S + Send + Sync,
    work: impl Fn(&mut S, &mut T) + Send + Sync,
) {
    let serial = |items: &mut [T]| {
        let mut scratch = init();
        items.iter_mut().for_each(|item| work(&mut scratch, item));
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
