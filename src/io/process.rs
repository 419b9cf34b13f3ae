//! How much memory this process has used, as Linux tells it.

use std::fs;

/// Forgets the peak so far; what is held now stays in the next one. Does nothing on systems that
/// do not tell.
pub fn forget_peak_memory() {
    // 5 resets the peak resident set (proc(5)). Where that is not allowed, the peak only grows.
    let _ = fs::write("/proc/self/clear_refs", "5");
}

/// The largest resident set since, in bytes; `None` where the system does not tell.
pub fn peak_memory() -> Option<u64> {
    let status = fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes << 10)
}
