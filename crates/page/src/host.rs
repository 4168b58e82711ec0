//! What the host provides: a clock, a place for rows, and one for the messages of faults.

#[cfg(target_family = "wasm")]
mod imports {
    #[link(wasm_import_module = "env")]
    unsafe extern "C" {
        pub fn now() -> f64;
        pub fn rows(address: *const f64, count: usize);
        pub fn fault(address: *const u8, length: usize);
    }
}

/// The time in milliseconds.
pub fn now() -> f64 {
    #[cfg(target_family = "wasm")]
    // SAFETY: it takes nothing.
    return unsafe { imports::now() };
    #[cfg(not(target_family = "wasm"))]
    return std::time::SystemTime::UNIX_EPOCH.elapsed().map_or(0.0, |since| since.as_secs_f64() * 1e3);
}

/// Passes numbers on, which follow those that were passed on before.
pub fn rows(numbers: &[f64]) {
    #[cfg(target_family = "wasm")]
    // SAFETY: the host copies them before it returns.
    unsafe {
        imports::rows(numbers.as_ptr(), numbers.len())
    };
    #[cfg(not(target_family = "wasm"))]
    let _ = numbers;
}

/// Passes the message of a fault on.
pub fn fault(message: &str) {
    #[cfg(target_family = "wasm")]
    // SAFETY: the host copies it before it returns.
    unsafe {
        imports::fault(message.as_ptr(), message.len())
    };
    #[cfg(not(target_family = "wasm"))]
    eprintln!("{message}");
}
