//! Free memory.

/// Memory (bytes) that a program may take now without swapping; `None` if the system does not say.
///
/// On Linux this is the smallest of three numbers: the available memory of the machine, the memory that the control group
/// of the process leaves below its limit, and the address space that the process may still take (`ulimit -v`).
pub fn free() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    let number = |name: &str| std::fs::read_to_string(format!("/sys/fs/cgroup/{name}")).ok()?.trim().parse::<u64>().ok();
    let group = number("memory.max").zip(number("memory.current")).map(|(most, used)| most.saturating_sub(used));
    Some([group, address_space()].into_iter().flatten().fold(kibibytes * 1024, u64::min))
}

/// Address space (bytes) that the process may still take; `None` without a limit.
fn address_space() -> Option<u64> {
    let limits = std::fs::read_to_string("/proc/self/limits").ok()?;
    let most = limits.lines().find_map(|line| line.strip_prefix("Max address space"))?.split_whitespace().next()?.parse::<u64>().ok()?;
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let taken = status.lines().find_map(|line| line.strip_prefix("VmSize:"))?.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()?;
    Some(most.saturating_sub(taken * 1024))
}
