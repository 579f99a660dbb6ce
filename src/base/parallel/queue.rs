//! A queue of work chunks shared by several threads.

use bevy::platform::time::Instant;
use core::{
    hint::spin_loop,
    sync::atomic::{AtomicUsize, Ordering},
    time::Duration,
};
use std::sync::{Mutex, PoisonError};

/// How long the caller spins for the last chunks before it blocks. Blocking and being woken takes
/// tens of microseconds, as long as a chunk.
const MAX_SPIN: Duration = Duration::from_micros(200);

/// Work chunks, each taken by the next free thread.
pub(super) struct Queue<I> {
    chunks: Mutex<I>,
    /// How many threads are working.
    busy: AtomicUsize,
}

impl<I: Iterator> Queue<I> {
    pub(super) fn new(chunks: I) -> Self {
        Self { chunks: Mutex::new(chunks), busy: AtomicUsize::new(0) }
    }

    /// Calls `work` with one chunk after the other until none is left.
    pub(super) fn empty(&self, mut work: impl FnMut(I::Item)) {
        self.busy.fetch_add(1, Ordering::Relaxed);
        loop {
            let chunk = self.chunks.lock().unwrap_or_else(PoisonError::into_inner).next();
            let Some(chunk) = chunk else { break };
            work(chunk);
        }
        self.busy.fetch_sub(1, Ordering::Release);
    }

    /// Spins for a while until other threads have finished their last chunks. Only saves time: the
    /// caller still has to join the tasks.
    pub(super) fn wait(&self) {
        let start = Instant::now();
        while self.busy.load(Ordering::Acquire) > 0 && start.elapsed() < MAX_SPIN {
            spin_loop();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_piece_is_taken_exactly_once() {
        let mut items = vec![0u32; 10_000];
        let queue = Queue::new(items.chunks_mut(7));
        std::thread::scope(|scope| {
            let take = || queue.empty(|chunk| chunk.iter_mut().for_each(|item| *item += 1));
            (0..4).for_each(|_| drop(scope.spawn(take)));
            take();
            queue.wait();
        });
        assert!(items.iter().all(|item| *item == 1));
    }

    #[test]
    fn waiting_ends() {
        let queue = Queue::new([1, 2].into_iter());
        let start = Instant::now();
        // As if another thread had a long chunk.
        queue.empty(|_| queue.wait());
        assert!(start.elapsed() >= 2 * MAX_SPIN && queue.busy.load(Ordering::Relaxed) == 0);
    }
}
