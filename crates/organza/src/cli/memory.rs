//! How much memory may be taken when nobody says.

use std::fs;

/// Where the system does not say how much there is.
const FALLBACK: u64 = 8 << 30;

/// Three quarters of the machine's memory, or of the control group's limit where that is lower.
pub(super) fn default_limit() -> u64 {
    let machine = fs::read_to_string("/proc/meminfo").ok().and_then(|text| total_of(&text));
    let group = fs::read_to_string("/sys/fs/cgroup/memory.max").ok().and_then(|text| text.trim().parse().ok());
    let total = machine.into_iter().chain(group).min();
    total.map_or(FALLBACK, |bytes: u64| bytes / 4 * 3)
}

/// `MemTotal` in bytes.
fn total_of(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find(|l| l.starts_with("MemTotal:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok()?.checked_mul(1024)
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_total_is_found() {
        assert_eq!(super::total_of("MemTotal:   2048 kB\nMemFree: 1 kB\n"), Some(2 << 20));
        assert_eq!(super::total_of("MemFree: 1 kB\n"), None);
    }
}
