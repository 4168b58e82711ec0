//! How much memory factors may take.

/// The limit that the user set, or else what is available.
pub(crate) fn limit(set: Option<usize>) -> usize {
    set.unwrap_or_else(available)
}

/// The memory in bytes that can be had without swapping, as Linux states it in `/proc/meminfo`; without a bound where that cannot be read.
fn available() -> usize {
    std::fs::read_to_string("/proc/meminfo").ok().as_deref().and_then(stated).unwrap_or(usize::MAX)
}

/// The line `MemAvailable:  123 kB`.
fn stated(text: &str) -> Option<usize> {
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kilobytes: usize = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kilobytes.checked_mul(1024)
}
