//! Work in shards, by several threads, handed on in order.

use std::ops::ControlFlow;
use std::sync::{Condvar, Mutex, MutexGuard, PoisonError};

/// The shards that may be done, or under way, before one of them that is not: what a slow one holds up.
pub(crate) const WINDOW_OF_A_THREAD: usize = 8;

/// What the threads share.
struct Window<R> {
    /// The next shard to be taken.
    next: usize,
    /// The shards that were handed on.
    handed_on: usize,
    /// Those that are done and were not handed on, with their numbers: a few.
    done: Vec<(usize, R)>,
    /// No more are wanted, or a thread has panicked.
    over: bool,
}

struct Shared<R> {
    window: Mutex<Window<R>>,
    changed: Condvar,
}

impl<R> Window<R> {
    /// Whether a shard may be taken, of so many.
    fn has_work(&self, count: usize, most: usize) -> bool {
        self.next < count && self.next - self.handed_on < most
    }

    fn take(&mut self) -> usize {
        self.next += 1;
        self.next - 1
    }

    /// The result of a shard, where it is done.
    fn result(&mut self, shard: usize) -> Option<R> {
        let place = self.done.iter().position(|(number, _)| *number == shard)?;
        Some(self.done.swap_remove(place).1)
    }

    fn is_done(&self, shard: usize) -> bool {
        self.done.iter().any(|(number, _)| *number == shard)
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

/// Ends the work of all when it is dropped: also when a closure of the user panics, so that no thread waits for ever.
struct AtTheEnd<'s, R>(&'s Shared<R>, bool);

impl<R> Drop for AtTheEnd<'_, R> {
    fn drop(&mut self) {
        if self.1 || std::thread::panicking() {
            self.0.change(|window| window.over = true);
        }
    }
}

/// Does so many shards by so many threads, the caller's among them, and hands each result on, in the order of the shards, on the
/// thread of the caller, until that breaks. At most [`WINDOW_OF_A_THREAD`] results a thread are kept at a time.
///
/// The caller computes too: with a thread that only waits to hand on, the others would make room for it after each shard.
pub(crate) fn in_order<R: Send>(
    threads: usize,
    count: usize,
    work: impl Fn(usize) -> R + Sync,
    mut hand_on: impl FnMut(R) -> ControlFlow<()>,
) {
    let window = Window { next: 0, handed_on: 0, done: Vec::new(), over: false };
    let shared = Shared { window: Mutex::new(window), changed: Condvar::new() };
    let threads = threads.min(count);
    let most = WINDOW_OF_A_THREAD * threads;
    std::thread::scope(|scope| {
        for _ in 1..threads {
            scope.spawn(|| {
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
            let mut window = shared.wait_while(|w| !w.over && !w.is_done(shard) && !w.has_work(count, most));
            if window.over {
                return;
            }
            if let Some(result) = window.result(shard) {
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
