//! The limit for the memory of matrix factors.

/// The limit set by the user, or else the available memory, in bytes.
pub(crate) fn limit(set: Option<usize>) -> usize {
    set.unwrap_or_else(available)
}

/// The memory in bytes that is available without swapping, from `/proc/meminfo` on Linux; `usize::MAX` if that cannot
/// be read.
fn available() -> usize {
    std::fs::read_to_string("/proc/meminfo").ok().as_deref().and_then(stated).unwrap_or(usize::MAX)
}

/// Parses the line `MemAvailable:  123 kB`; returns bytes.
fn stated(text: &str) -> Option<usize> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: usize = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}
