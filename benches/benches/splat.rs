//! Project, bin and composite translucent splats, and nothing else: sorted ids and shaded values are ready.
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use organza_benches::{TABLE_1, outdoor, outdoor_cloud};
use splat_core::raster::{OpaqueImage, Params, fold, project};
use splat_core::{Accumulator, Direction, Progress, SplatKind};
use std::hint::black_box;

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("splat 600x500");
    group.sample_size(10);
    for n in TABLE_1 {
        let (mut cloud, mut camera) = outdoor_cloud(n);
        // All translucent, as in the table's middle row.
        cloud.kind.iter_mut().filter(|k| **k == SplatKind::Opaque).for_each(|k| *k = SplatKind::Surface);
        camera.size = [600, 500];
        let scene = outdoor();
        let params = hbsort::Params { direction: Direction::FrontToBack, ..hbsort::Params::default() };
        let order = hbsort::slice_cloud(&cloud, None, &camera, &params, &mut hbsort::Scratch::default())
            .expect("finite splats sort");
        let ids = order.input_from_sorted;
        let values = vec![0.5; 3 * cloud.len()];
        let raster = Params::default();
        group.throughput(Throughput::Elements(ids.len() as u64));
        group.bench_function(BenchmarkId::new("project", n), |b| {
            b.iter(|| black_box(project(&cloud, &camera, &scene.footprints, &scene.materials, &raster)));
        });
        let projected = project(&cloud, &camera, &scene.footprints, &scene.materials, &raster);
        group.bench_function(BenchmarkId::new("fold", n), |b| {
            b.iter(|| {
                let mut acc = Accumulator::new(camera.size, 1, 3, false, false);
                let opaque = OpaqueImage::default();
                fold(
                    &projected,
                    &ids,
                    &values,
                    &scene.materials,
                    &opaque,
                    Direction::FrontToBack,
                    &raster,
                    &mut acc,
                    &Progress::new(),
                );
                black_box(acc)
            });
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
