//! Work in shards on several threads, with results in order.

use std::ops::ControlFlow;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::Builder;

/// The number of shards per thread that may be completed or in progress while an earlier shard is not completed: it
/// bounds the memory, and is large enough that no thread waits for a shard that takes several times longer.
pub(crate) const MAX_SHARDS_PER_THREAD: usize = 8;

/// The stack size of a thread, 8 MiB: that of a main thread, so that a run that is possible there is possible here. Numbers
/// that carry derivatives in many coordinates are large.
const STACK_SIZE: usize = 1 << 23;

/// The state that the threads share.
struct Window<R> {
    /// The next shard to be computed.
    next: usize,
    /// The number of shards that have been handed on.
    handed_on: usize,
    /// The results that are completed and have not been handed on, with their shards: a few, in any order.
    done: Vec<(usize, R)>,
    /// Whether no more results are requested, or a thread has panicked.
    over: bool,
}

struct Shared<R> {
    window: Mutex<Window<R>>,
    changed: Condvar,
}

impl<R> Window<R> {
    /// Whether another of `count` shards may be computed now.
    fn has_work(&self, count: usize, most: usize) -> bool {
        self.next < count && self.next - self.handed_on < most
    }

    fn take(&mut self) -> usize {
        self.next += 1;
        self.next - 1
    }
}

impl<R> Shared<R> {
    fn lock(&self) -> MutexGuard<'_, Window<R>> {
        self.window.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn change(&self, change: impl FnOnce(&mut Window<R>)) {
        change(&mut self.lock());
        self.changed.notify_all();
    }

    fn wait_while(&self, condition: impl Fn(&Window<R>) -> bool) -> MutexGuard<'_, Window<R>> {
        let condition = |window: &mut Window<R>| condition(window);
        self.changed.wait_while(self.lock(), condition).unwrap_or_else(PoisonError::into_inner)
    }
}

/// Ends the work of all threads when it is dropped, also if a closure of the user panics, so that no thread waits
/// forever.
struct AtTheEnd<'s, R>(&'s Shared<R>, bool);

impl<R> Drop for AtTheEnd<'_, R> {
    fn drop(&mut self) {
        if self.1 || std::thread::panicking() {
            self.0.change(|window| window.over = true);
        }
    }
}

/// Computes a number of shards on several threads, the calling thread among them, and hands on each result in the order
/// of the shards, on the calling thread, until `hand_on` breaks. At most [`MAX_SHARDS_PER_THREAD`] results per thread
/// are kept at a time.
///
/// The calling thread computes too: a thread that only waits to hand on results would displace the others after each
/// shard.
pub(crate) fn in_order<R: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> R + Sync,
    mut hand_on: impl FnMut(R) -> ControlFlow<()>,
) {
    let window = Window { next: 0, handed_on: 0, done: Vec::new(), over: false };
    let shared = Shared { window: Mutex::new(window), changed: Condvar::new() };
    let threads = threads.min(count);
    let most = MAX_SHARDS_PER_THREAD * threads;
    std::thread::scope(|scope| {
        for _ in 1..threads {
            // If a thread cannot be started, the others do its work.
            let _ = Builder::new().stack_size(STACK_SIZE).spawn_scoped(scope, || {
                let _guard = AtTheEnd(&shared, false);
                loop {
                    let mut window = shared.wait_while(|w| !w.over && w.next < count && !w.has_work(count, most));
                    if window.over || window.next >= count {
                        return;
                    }
                    let shard = window.take();
                    drop(window);
                    let result = work(shard);
                    shared.change(|window| window.done.push((shard, result)));
                }
            });
        }
        let _guard = AtTheEnd(&shared, true);
        let mut shard = 0;
        while shard < count {
            let mut window = shared
                .wait_while(|w| !w.over && !w.done.iter().any(|(done, _)| *done == shard) && !w.has_work(count, most));
            if window.over {
                return;
            }
            if let Some(place) = window.done.iter().position(|(done, _)| *done == shard) {
                let (_, result) = window.done.swap_remove(place);
                drop(window);
                if hand_on(result).is_break() {
                    return;
                }
                shard += 1;
                shared.change(|window| window.handed_on = shard);
            } else {
                let own = window.take();
                drop(window);
                let result = work(own);
                shared.lock().done.push((own, result));
            }
        }
    });
}
