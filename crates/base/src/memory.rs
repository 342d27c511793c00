//! Free memory.

/// Memory (bytes) that a program may take now without swapping; `None` if the system does not say.
///
/// On Linux this is the smaller of two numbers: the available memory of the machine, and the memory that the control
/// group of the process leaves below its limit.
pub fn free() -> Option<u64> {
    let text = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = text.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    let number = |name: &str| std::fs::read_to_string(format!("/sys/fs/cgroup/{name}")).ok()?.trim().parse::<u64>().ok();
    let group = number("memory.max").zip(number("memory.current")).map(|(most, used)| most.saturating_sub(used));
    Some(group.map_or(kibibytes * 1024, |left| left.min(kibibytes * 1024)))
}
