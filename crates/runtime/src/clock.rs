//! The time since a call of the monitor.

use std::time::Duration;
#[cfg(not(target_family = "wasm"))]
use std::time::Instant;

/// A clock that runs since it was made.
pub(crate) struct Clock(#[cfg(not(target_family = "wasm"))] Instant);

impl Clock {
    pub fn new() -> Self {
        Clock(
            #[cfg(not(target_family = "wasm"))]
            Instant::now(),
        )
    }

    /// The time since it was made. In WebAssembly, where there is none, it is long, so that a monitor is polled often.
    pub fn elapsed(&self) -> Duration {
        #[cfg(not(target_family = "wasm"))]
        return self.0.elapsed();
        #[cfg(target_family = "wasm")]
        return Duration::MAX;
    }
}
