//! A thread with a large stack.

use crate::RuntimeError;

/// The stack size for computations with third derivatives, 64 MiB: in 16 coordinates a number that carries them takes
/// 300 kB, so that the stack holds some two hundred of them.
const STACK_SIZE: usize = 1 << 26;

/// Runs a closure on a thread with a large stack, whatever the stack of the caller.
pub(super) fn on_large_stack<R: Send>(
    work: impl FnOnce() -> Result<R, RuntimeError> + Send,
) -> Result<R, RuntimeError> {
    // There are no threads.
    if cfg!(target_family = "wasm") {
        return work();
    }
    std::thread::scope(|scope| {
        let worker = std::thread::Builder::new().stack_size(STACK_SIZE).spawn_scoped(scope, work)?;
        worker.join().unwrap_or_else(|panicked| std::panic::resume_unwind(panicked))
    })
}
