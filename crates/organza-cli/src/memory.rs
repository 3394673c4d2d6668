//! How much memory may be taken when nobody says.

use std::fs;
use std::path::{Component, Path, PathBuf};

/// Where the system does not say how much there is.
const FALLBACK: u64 = 8 << 30;

/// Three quarters of what the system lets this process have.
pub(super) fn default_limit() -> u64 {
    least_limit(Path::new("/")).map_or(FALLBACK, |bytes| bytes / 4 * 3)
}

/// The least of the machine's memory, the limits of the control groups that this process is in, and its own limits, as the
/// files below `root` tell them.
fn least_limit(root: &Path) -> Option<u64> {
    let text = |path: &str| fs::read_to_string(root.join(path)).unwrap_or_default();
    let machine = total_of(&text("proc/meminfo"));
    let groups = text("proc/self/cgroup");
    let groups = groups.lines().flat_map(limit_files).filter_map(|file| {
        // One without a limit says `max`, or a number beyond any memory.
        fs::read_to_string(root.join(file)).ok()?.trim().parse().ok()
    });
    let limits = text("proc/self/limits");
    let limits = limits.lines().filter_map(soft_limit);
    machine.into_iter().chain(groups).chain(limits).min()
}

/// `MemTotal` in bytes.
fn total_of(meminfo: &str) -> Option<u64> {
    let line = meminfo.lines().find(|l| l.starts_with("MemTotal:"))?;
    line.split_whitespace().nth(1)?.parse::<u64>().ok()?.checked_mul(1024)
}

/// Where the limits of a control group and of all above it stand, by a line `hierarchy:controllers:path` of version 1, or
/// of version 2, where it names no controllers. In a container the path may be one of the machine outside: then only the
/// last file is there, that of the container.
fn limit_files(line: &str) -> Vec<PathBuf> {
    let mut parts = line.splitn(3, ':').skip(1);
    let (Some(controllers), Some(path)) = (parts.next(), parts.next()) else { return Vec::new() };
    let (folder, name) = if controllers.is_empty() {
        (Path::new("sys/fs/cgroup"), "memory.max")
    } else if controllers.split(',').any(|c| c == "memory") {
        (Path::new("sys/fs/cgroup/memory"), "memory.limit_in_bytes")
    } else {
        return Vec::new();
    };
    let inside = |group: &&Path| group.components().all(|c| matches!(c, Component::Normal(_)));
    let groups = Path::new(path.trim_start_matches('/')).ancestors().filter(inside);
    groups.map(|group| folder.join(group).join(name)).collect()
}

/// The limit of a line on address space or data, as `ulimit -v` and `ulimit -d` set them, in bytes.
fn soft_limit(line: &str) -> Option<u64> {
    let values = line.strip_prefix("Max address space").or_else(|| line.strip_prefix("Max data size"))?;
    values.split_whitespace().next()?.parse().ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A system of these files.
    fn limit_of(files: &[(&str, &str)]) -> Option<u64> {
        let root = tempfile::tempdir().unwrap();
        for (path, text) in files {
            let path = root.path().join(path);
            fs::create_dir_all(path.parent().unwrap()).unwrap();
            fs::write(path, text).unwrap();
        }
        least_limit(root.path())
    }

    const MACHINE: (&str, &str) = ("proc/meminfo", "MemTotal:   2048 kB\nMemFree: 1 kB\n");

    #[test]
    fn the_machine_s_memory_is_the_limit_where_there_is_no_other() {
        assert_eq!(limit_of(&[MACHINE]), Some(2 << 20));
        assert_eq!(limit_of(&[("proc/meminfo", "MemFree: 1 kB\n")]), None);
        let unlimited = [
            MACHINE,
            ("proc/self/cgroup", "0::/a\n"),
            ("sys/fs/cgroup/a/memory.max", "max\n"),
            ("proc/self/limits", "Max address space         unlimited            unlimited            bytes     \n"),
        ];
        assert_eq!(limit_of(&unlimited), Some(2 << 20));
    }

    #[test]
    fn the_least_limit_of_nested_groups_counts() {
        for (least, limits) in
            [(1000, ["1000", "3000", "max"]), (2000, ["max", "2000", "3000"]), (9, ["99", "max", "9"])]
        {
            let files = [
                MACHINE,
                ("proc/self/cgroup", "0::/user.slice/job\n"),
                ("sys/fs/cgroup/user.slice/job/memory.max", limits[0]),
                ("sys/fs/cgroup/user.slice/memory.max", limits[1]),
                ("sys/fs/cgroup/memory.max", limits[2]),
            ];
            assert_eq!(limit_of(&files), Some(least));
        }
        // A container that sees its path outside, and one that sees a path above its own.
        for path in ["0::/docker/0123\n", "0::/../../other\n"] {
            let files = [MACHINE, ("proc/self/cgroup", path), ("sys/fs/cgroup/memory.max", "5000\n")];
            assert_eq!(limit_of(&files), Some(5000), "{path}");
        }
    }

    #[test]
    fn groups_of_version_1_count() {
        let files = [
            MACHINE,
            ("proc/self/cgroup", "12:cpu,cpuacct:/x\n4:memory:/docker/job\n1:name=systemd:/y\n"),
            ("sys/fs/cgroup/memory/docker/job/memory.limit_in_bytes", "9223372036854771712\n"),
            ("sys/fs/cgroup/memory/docker/memory.limit_in_bytes", "7000\n"),
            ("sys/fs/cgroup/memory/x/memory.limit_in_bytes", "1\n"),
        ];
        assert_eq!(limit_of(&files), Some(7000));
    }

    #[test]
    fn the_process_s_own_limits_count() {
        let line =
            |name: &str| format!("Limit  Soft Limit  Hard Limit  Units\n{name:<26}1024000   unlimited   bytes\n");
        for (name, limit) in
            [("Max address space", 1_024_000), ("Max data size", 1_024_000), ("Max file size", 2 << 20)]
        {
            assert_eq!(limit_of(&[MACHINE, ("proc/self/limits", &line(name))]), Some(limit), "{name}");
        }
    }
}
