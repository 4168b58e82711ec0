//! A global allocator that counts, for each thread by itself: tests that run beside each other in one binary do not disturb each
//! other. The program `scale` has an allocator of its own, since it counts over all threads.

use std::alloc::{GlobalAlloc, Layout, System};
use std::cell::Cell;

thread_local! {
    /// Counters of this thread, so that the threads of the test runner do not count: the number of allocations, the
    /// bytes held, and their maximum.
    static COUNT: Cell<usize> = const { Cell::new(0) };
    static HELD: Cell<isize> = const { Cell::new(0) };
    static PEAK: Cell<isize> = const { Cell::new(0) };
}

struct Counting;

fn hold(bytes: isize) {
    let _ = HELD.try_with(|held| {
        held.set(held.get() + bytes);
        let _ = PEAK.try_with(|peak| peak.set(peak.get().max(held.get())));
    });
}

#[allow(unsafe_code)] // An allocator requires unsafe code.
// SAFETY: every call is forwarded to the system allocator, and the counters do not touch what it returns.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        let _ = COUNT.try_with(|count| count.set(count.get() + 1));
        hold(layout.size() as isize);
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        hold(-(layout.size() as isize));
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The number of allocations by an action on this thread.
pub fn allocations(action: impl FnOnce()) -> usize {
    let before = COUNT.with(Cell::get);
    action();
    COUNT.with(Cell::get) - before
}

/// The bytes that this thread holds.
pub fn held() -> isize {
    HELD.with(Cell::get)
}

/// The largest number of bytes that this thread held during an action, beyond those held before.
pub fn peak(action: impl FnOnce()) -> isize {
    let before = held();
    PEAK.with(|peak| peak.set(before));
    action();
    PEAK.with(Cell::get) - before
}
