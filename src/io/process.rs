//! The memory that this process has used, and the memory of the machine, as Linux states them.

use std::fs;

/// Forgets the peak so far; what is held now stays in the next one. Does nothing on systems that
/// do not tell.
pub fn forget_peak_memory() {
    // 5 resets the peak resident set (proc(5)). Where that is not allowed, the peak only grows.
    let _ = fs::write("/proc/self/clear_refs", "5");
}

/// The largest resident set since, in bytes; `None` where the system does not tell.
pub fn peak_memory() -> Option<u64> {
    in_bytes("/proc/self/status", "VmHWM:")
}

/// A number of kB that a file gives under a name, in bytes.
fn in_bytes(file: &str, name: &str) -> Option<u64> {
    let text = fs::read_to_string(file).ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix(name))?;
    let kilobytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kilobytes << 10)
}

/// Memory that is free or would be made free, in bytes; `None` where the system does not tell.
/// Within a container that has a limit, what is left of that.
pub fn available_memory() -> Option<u64> {
    let free = in_bytes("/proc/meminfo", "MemAvailable:")?;
    let text = |file: &str| fs::read_to_string(format!("/sys/fs/cgroup/{file}")).ok();
    let number = |file: &str| text(file)?.trim().parse::<u64>().ok();
    let limit = || {
        // What is read from files counts as taken, and is given away where memory is short.
        let stat = text("memory.stat")?;
        let of = |name: &str| {
            stat.lines().find_map(|line| line.strip_prefix(name)?.trim().parse::<u64>().ok())
        };
        let files: u64 = ["active_file ", "inactive_file "].into_iter().filter_map(of).sum();
        let taken = number("memory.current")?.saturating_sub(files);
        Some(number("memory.max")?.saturating_sub(taken))
    };
    Some(free.min(limit().unwrap_or(u64::MAX)))
}
