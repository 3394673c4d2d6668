//! A whole frame of the outdoor scene, from files to image, and its parts by the cost record.
//!
//! A plain table of minima over [`REPEATS`]: other work on the machine only ever adds time.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use organza::{Progress, RenderOptions, render, scene};
use std::collections::BTreeMap;
use std::path::Path;
use std::time::Instant;

const REPEATS: usize = 7;

fn main() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/outdoor.toml");
    let scene = scene::load(&file, &scene::LoadOptions::default()).expect("scenes/outdoor.toml");
    let mut best: BTreeMap<String, f64> = BTreeMap::new();
    for _ in 0..REPEATS {
        let start = Instant::now();
        let rendered = render(&scene, &RenderOptions::default(), &Progress::new()).expect("the scene renders");
        let total = start.elapsed().as_secs_f64();
        let mut passes: BTreeMap<String, f64> = BTreeMap::from([("total".into(), total)]);
        for stage in &rendered.cost.stages {
            *passes.entry(stage.name.to_string()).or_default() += stage.seconds;
        }
        for (name, seconds) in passes {
            let best = best.entry(name).or_insert(f64::INFINITY);
            *best = best.min(seconds);
        }
    }
    println!("outdoor, 960x540 with 4 samples a pixel");
    best.iter().for_each(|(name, seconds)| println!("{name:>16} {:8.1} ms", seconds * 1e3));
    if let Ok(status) = std::fs::read_to_string("/proc/self/status") {
        status.lines().filter(|l| l.starts_with("VmHWM")).for_each(|l| println!("{l}"));
    }
}
