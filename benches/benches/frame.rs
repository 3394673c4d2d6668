//! A whole frame of the outdoor scene, files already loaded: shadow maps, order, shading, compositing.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use criterion::{Criterion, Throughput, criterion_group, criterion_main};
use organza::{Progress, RenderOptions, render, scene};
use std::hint::black_box;
use std::path::Path;

fn bench(c: &mut Criterion) {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes/outdoor.toml");
    let scene = scene::load(&file, &scene::LoadOptions::default()).expect("scenes/outdoor.toml");
    let splats = organza_benches::outdoor().cloud.len() as u64;
    let mut group = c.benchmark_group("frame 960x540, 4 samples a pixel");
    group.sample_size(10);
    group.throughput(Throughput::Elements(splats));
    group.bench_function("outdoor, from files", |b| {
        b.iter(|| black_box(render(&scene, &RenderOptions::default(), &Progress::new()).expect("the scene renders")));
    });
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
