//! Figures 3 to 6 of Tanaka 2012 with data of our own as the paper draws them, once: 1024x1024 pixels, an image a set, surfaces with
//! α = 0.1, and 500 sets (100 of Figure 6).
//!
//! A plain table of processor time of all threads, which other work on the machine adds little to. `-- NAME` draws one.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use organza::scene::{LoadOptions, Override};
use organza::{Progress, RenderOptions, render, scene};
use organza_benches::{processor_ms, record};
use std::path::Path;

fn main() {
    let only = std::env::args().skip(1).find(|a| !a.starts_with("--"));
    println!("{:>10} {:>12} {:>12} {:>16}", "figure", "particles", "seconds", "particles/s");
    for (name, levels) in [("3a", 500), ("3b", 500), ("4a", 500), ("4b", 500), ("5", 500), ("6", 100)] {
        if only.as_ref().is_some_and(|only| only != name) {
            continue;
        }
        let levels = format!("render.particles.repeat_level={levels}");
        let sets = ["camera.size=[1024, 1024]", "render.antialias=1", "material.film.opacity=0.1", &levels];
        let overrides = sets.iter().map(|set| Override::parse(set).expect("an override")).collect();
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join(format!("../scenes/figure{name}.toml"));
        let scene = scene::load(&file, &LoadOptions { overrides, ..LoadOptions::default() }).expect("a scene");
        let before = processor_ms();
        let drawn = render(&scene, &RenderOptions::default(), &Progress::new()).expect("the scene renders");
        let ms = processor_ms() - before;
        let of_sets = drawn.cost.stages.iter().filter(|stage| stage.name == organza::pass::PARTICLES);
        let particles: u64 = of_sets.map(|stage| stage.items_out).sum();
        println!("{name:>10} {particles:>12} {:>12.1} {:>16.0}", 1e-3 * ms, 1e3 * particles as f64 / ms);
        record(&format!("figures/{name}"), &[ms], particles);
    }
}
