//! Shadow maps of the outdoor scene at the paper's three sizes, beside `rdst` sorting as many (cell, distance) keys as
//! the map deposits; the same number of points on one ray; and the paper's kinds of models alone, a dragon and a cloud.

use convert::{CloudShape, SplatParams, VolumeParams, procedural_cloud, volume_to_points};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use rayon::prelude::*;
use rdst::RadixSort;
use splat_core::glam::{DVec3, Vec3};
use splat_core::{
    Cloud, Light, LightShape, Limits, Receiver, SplatKind, TOGETHER, TransferFunction, TransferPoint, Transmittance,
    rng,
};
use std::hint::black_box;
use tsm::{Params, Scene, ShadowMap};

/// Points of Gunjee 2007, Table 1.
const SIZES: [usize; 3] = [437_645, 624_614, 1_841_320];

fn lights(cloud: &Cloud) -> [(&'static str, Light); 3] {
    let bounds = cloud.bounds();
    let middle = cloud.origin + bounds.center().as_dvec3();
    let above = middle + DVec3::Y * f64::from(bounds.diagonal());
    let direction = DVec3::new(0.3, -1.0, 0.2).normalize();
    let light = |shape| Light { shape, intensity: [1.0; 3] };
    [
        ("above", light(LightShape::Point { position: above })),
        ("inside", light(LightShape::Point { position: middle })),
        ("sun", light(LightShape::Directional { direction })),
    ]
}

fn build(cloud: &Cloud, light: &Light) -> ShadowMap {
    ShadowMap::build(&Scene::from(cloud), light, &Params::default(), None).expect("invariant: the default table fits")
}

fn on_one_ray(cloud: &Cloud) -> Cloud {
    let mut ray = cloud.clone();
    let n = ray.len() as f32;
    for i in 0..ray.len() {
        ray.position[i] = Vec3::new(0.3, 1.0, 0.2) * (1.0 + i as f32 / n);
    }
    ray
}

fn keys(entries: u64, cells: u64) -> Vec<u64> {
    let key =
        |i: u64| (rng::bits(3, 0, i / 4, 0) % cells) << 32 | u64::from((1.0 + rng::unit_f32(3, 1, i, 0)).to_bits());
    (0..entries).map(key).collect()
}

/// Processor time of all threads, milliseconds, least of several runs on what `prepare` makes: on a busy machine it
/// tells more than the time on the clock.
fn processor_ms<T>(prepare: impl Fn() -> T, run: impl Fn(T)) -> f64 {
    let once = |_| {
        let input = prepare();
        let before = organza_benches::processor_ms();
        run(input);
        organza_benches::processor_ms() - before
    };
    (0..8).map(once).fold(f64::INFINITY, f64::min)
}

fn benches(c: &mut Criterion) {
    for points in SIZES {
        let (cloud, _) = organza_benches::outdoor_cloud(points);
        let mut group = c.benchmark_group(format!("tsm/{points}"));
        group.sample_size(10);
        for (name, light) in lights(&cloud) {
            group.throughput(Throughput::Elements(cloud.len() as u64));
            let map = build(&cloud, &light);
            let counts = map.counts();
            let per_splat = counts.entries as f64 / counts.translucent.max(1) as f64;
            let per_entry = counts.bytes as f64 / counts.entries.max(1) as f64;
            println!("{name}: {counts:?}, {per_splat:.2} entries a translucent splat, {per_entry:.1} bytes an entry");
            group.bench_function(BenchmarkId::new("build", name), |b| b.iter(|| build(&cloud, &light)));
            let unsorted = keys(counts.entries, counts.cells);
            let build_ms = processor_ms(|| (), |()| drop(black_box(build(&cloud, &light))));
            let rdst_ms = processor_ms(|| unsorted.clone(), |mut k| k.radix_sort_unstable());
            let ratio = build_ms / rdst_ms;
            println!("{name}: processor time: build {build_ms:.1} ms, rdst {rdst_ms:.1} ms, ratio {ratio:.2}");
            group.bench_function(BenchmarkId::new("rdst", name), |b| {
                b.iter_batched_ref(|| unsorted.clone(), |k| k.radix_sort_unstable(), criterion::BatchSize::LargeInput);
            });
            for (of, kinds) in [
                ("all", &[SplatKind::Medium, SplatKind::Surface, SplatKind::Opaque][..]),
                ("media", &[SplatKind::Medium]),
                ("translucent surfaces", &[SplatKind::Surface]),
                ("opaque surfaces", &[SplatKind::Opaque]),
            ] {
                let ids: Vec<usize> = (0..cloud.len()).filter(|i| kinds.contains(&cloud.kind[*i])).collect();
                group.throughput(Throughput::Elements(ids.len() as u64));
                let id = BenchmarkId::new(format!("look up {of}"), name);
                group.bench_function(id, |b| b.iter(|| black_box(look_up(&map, &cloud, &ids))));
                let id = BenchmarkId::new(format!("look up {of} together, all threads"), name);
                group.bench_function(id, |b| b.iter(|| black_box(look_up_together(&map, &cloud, &ids))));
            }
        }
        group.throughput(Throughput::Elements(cloud.len() as u64));
        let ray = on_one_ray(&cloud);
        let light = lights(&cloud)[2].1;
        group.bench_function("build/one ray", |b| b.iter(|| build(&ray, &light)));
        group.finish();
    }
}

/// One by one, by one thread.
fn look_up(map: &ShadowMap, cloud: &Cloud, ids: &[usize]) -> f32 {
    ids.iter().map(|i| map.transmittance(&Receiver::of_splat(cloud, *i))[0]).sum()
}

fn look_up_together(map: &ShadowMap, cloud: &Cloud, ids: &[usize]) -> f32 {
    let sum = |ids: &[usize]| -> f32 {
        let light = map.at_splats(ids, &|i| Receiver::of_splat(cloud, i));
        light[..ids.len()].iter().map(|[red, ..]| red).sum()
    };
    ids.par_chunks(TOGETHER).with_min_len(256).map(sum).sum()
}

/// A dragon of as many discs as the paper's has points, opaque and translucent, and a cloud, a medium.
fn alone(c: &mut Criterion) {
    let dragon = organza_benches::dragon(SIZES[0] as u64);
    let mut translucent = dragon.clone();
    translucent.kind.fill(SplatKind::Surface);
    let grid = procedural_cloud(&CloudShape::default(), 0.03, &SplatParams::default(), None).expect("a cloud");
    let point = |value: f32| TransferPoint { value, color: [1.0; 3], extinction: value };
    let transfer = TransferFunction::new(vec![point(0.0), point(12.0)]).expect("values rise");
    let (cloud, _) = volume_to_points(&grid, &transfer, &VolumeParams::default(), None).expect("splats of it");
    let mut group = c.benchmark_group("tsm/alone");
    group.sample_size(10);
    for (name, cloud) in [("opaque dragon", &dragon), ("translucent dragon", &translucent), ("cloud", &cloud)] {
        println!("{name}: {} splats", cloud.len());
        let (_, sun) = lights(cloud)[2];
        group.throughput(Throughput::Elements(cloud.len() as u64));
        group.bench_function(name, |b| b.iter(|| build(cloud, &sun)));
    }
    group.finish();
}

/// Growth: light from inside and the sun, 1 to 16 million splats.
fn growth(c: &mut Criterion) {
    for millions in [1, 2, 4, 8, 16] {
        let (cloud, _) = organza_benches::outdoor_cloud(millions << 20);
        let mut group = c.benchmark_group(format!("tsm/growth/{millions} M"));
        group.sample_size(10).throughput(Throughput::Elements(cloud.len() as u64));
        for (name, light) in lights(&cloud).into_iter().skip(1) {
            let params = Params { limits: Limits::bytes(8 << 30), ..Params::default() };
            let build =
                || ShadowMap::build(&Scene::from(&cloud), &light, &params, None).expect("invariant: 8 GiB are enough");
            let counts = build().counts();
            let per_entry = counts.bytes as f64 / counts.entries.max(1) as f64;
            println!("{name}: {counts:?}, {per_entry:.1} bytes an entry");
            group.bench_function(name, |b| b.iter(build));
        }
        group.finish();
    }
}

criterion_group!(tsm_benches, benches, alone, growth);
criterion_main!(tsm_benches);
