//! Many independent tasks on all cores.

use indicatif::ProgressBar;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// The results of the tasks with the indices 0 to `count - 1`, in the order of the indices.
pub fn parallel<T: Send>(bar: &ProgressBar, count: usize, task: impl Fn(usize) -> T + Sync) -> Vec<T> {
    bar.set_position(0);
    bar.set_length(count as u64);
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(count));
    let workers = std::thread::available_parallelism().map_or(1, usize::from);
    std::thread::scope(|scope| {
        for _ in 0..workers.min(count) {
            scope.spawn(|| {
                loop {
                    let i = next.fetch_add(1, Ordering::Relaxed);
                    if i >= count {
                        break;
                    }
                    let result = task(i);
                    done.lock().unwrap_or_else(PoisonError::into_inner).push((i, result));
                    bar.inc(1);
                }
            });
        }
    });
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_by_key(|(i, _)| *i);
    done.into_iter().map(|(_, result)| result).collect()
}
