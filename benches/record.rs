//! Times of the tables that are printed without criterion, where criterion leaves its own.

use std::path::{Path, PathBuf};

/// Leaves what runs over so many elements took, milliseconds, as the benchmark `name`: `cargo xtask papers --times` takes it from there.
/// The least and the greatest stand in the place of criterion's interval.
pub fn record(name: &str, ms: &[f64], elements: u64) {
    let home = std::env::var_os("CRITERION_HOME").map(PathBuf::from);
    let home = home.unwrap_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../target/criterion"));
    let folder = home.join(name.replace('/', "_")).join("new");
    std::fs::create_dir_all(&folder).expect("a folder of times");
    let nanoseconds = |of: fn(f64, f64) -> f64, from: f64| 1e6 * ms.iter().copied().fold(from, of);
    let least = nanoseconds(f64::min, f64::INFINITY);
    let greatest = nanoseconds(f64::max, 0.0);
    let mean = nanoseconds(|a, b| a + b, 0.0) / ms.len() as f64;
    let estimates = format!(
        "{{\"mean\":{{\"confidence_interval\":{{\"lower_bound\":{least},\"upper_bound\":{greatest}}},\"point_estimate\":{mean}}}}}"
    );
    let benchmark = format!("{{\"full_id\":\"{name}\",\"throughput\":{{\"Elements\":{elements}}}}}");
    for (file, text) in [("benchmark.json", benchmark), ("estimates.json", estimates)] {
        std::fs::write(folder.join(file), text).expect("a file of times");
    }
}
