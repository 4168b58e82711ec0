//! The limit for the memory of matrix factors.

/// The limit set by the user, or else the available memory, in bytes.
pub(crate) fn memory_limit(set: Option<usize>) -> usize {
    set.unwrap_or_else(available_memory)
}

/// The memory in bytes that is available without swapping, from `/proc/meminfo` on Linux; `usize::MAX` if that cannot
/// be read.
fn available_memory() -> usize {
    std::fs::read_to_string("/proc/meminfo").ok().as_deref().and_then(mem_available).unwrap_or(usize::MAX)
}

/// Parses the line `MemAvailable:  123 kB`; returns bytes.
fn mem_available(text: &str) -> Option<usize> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: usize = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    // The kernel writes kB for 1024 bytes.
    kibibytes.checked_mul(1024)
}
