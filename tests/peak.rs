//! How much memory a command takes at its peak.

use std::process::{Command, Output, Stdio};
use std::time::Duration;

/// Peaks of a process, bytes.
#[derive(Debug, Clone, Copy, Default)]
pub struct Peak {
    /// Of its resident memory.
    pub resident: u64,
    /// Of its address space.
    pub address_space: u64,
}

/// Runs a command to its end and looks at it all the time.
pub fn run_measured(command: &mut Command) -> (Output, Peak) {
    let child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    let path = format!("/proc/{}/status", child.id());
    let watcher = std::thread::spawn(move || {
        let mut peak = Peak::default();
        // The system keeps the peaks; one that has ended has none any more.
        while let Some(now) = std::fs::read_to_string(&path).ok().and_then(|status| peaks(&status)) {
            peak = now;
            std::thread::sleep(Duration::from_millis(1));
        }
        peak
    });
    let output = child.wait_with_output().unwrap();
    (output, watcher.join().unwrap())
}

fn peaks(status: &str) -> Option<Peak> {
    let bytes = |name: &str| -> Option<u64> {
        let line = status.lines().find_map(|line| line.strip_prefix(name))?;
        Some(1024 * line.split_whitespace().next()?.parse::<u64>().ok()?)
    };
    Some(Peak { resident: bytes("VmHWM:")?, address_space: bytes("VmPeak:")? })
}
