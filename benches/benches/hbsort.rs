//! Slicing beside the fastest sorts: Gunjee 2007, Table 1 sizes and 10 M splats, in one run.
//!
//! `cloud` culls, projects and slices; `depths` slices ready depths; `exact` orders inside slices too. The peers sort
//! ready (depth, id) pairs, which is less work than `cloud` does.

use criterion::{BatchSize, Criterion, SamplingMode, Throughput, criterion_group, criterion_main};
use hbsort::{Params, Scratch, SliceOrder, Thickness, slice_cloud, slice_depths};
use rayon::prelude::*;
use rdst::{RadixKey, RadixSort as _};
use splat_core::{Camera, Cloud};
use voracious_radix_sort::{RadixSort as _, Radixable};

/// The three models of Table 1, and ten million.
const SIZES: [usize; 4] = [440_000, 620_000, 1_840_000, 10_000_000];

/// What every peer sorts.
#[derive(Debug, Clone, Copy, PartialEq, PartialOrd)]
struct Entry {
    depth: f32,
    id: u32,
}

impl Radixable<f32> for Entry {
    type Key = f32;

    fn key(&self) -> f32 {
        self.depth
    }
}

impl RadixKey for Entry {
    const LEVELS: usize = 4;

    fn get_level(&self, level: usize) -> u8 {
        self.depth.get_level(level)
    }
}

fn slicing(criterion: &mut Criterion) {
    for points in SIZES {
        let (cloud, camera) = organza_benches::outdoor_cloud(points);
        let mut group = criterion.benchmark_group(format!("slices of {points} splats"));
        group.throughput(Throughput::Elements(points as u64)).sample_size(20).sampling_mode(SamplingMode::Flat);
        ours(&mut group, &cloud, &camera);
        peers(&mut group, &entries(&cloud, &camera));
        group.finish();
    }
}

type Group<'a> = criterion::BenchmarkGroup<'a, criterion::measurement::WallTime>;

fn entries(cloud: &Cloud, camera: &Camera) -> Vec<Entry> {
    let view = camera.view_from_offset(cloud.origin);
    (0u32..).zip(&cloud.position).map(|(id, p)| Entry { depth: view.depth(*p), id }).collect()
}

fn ours(group: &mut Group<'_>, cloud: &Cloud, camera: &Camera) {
    let depth: Vec<f32> = entries(cloud, camera).iter().map(|e| e.depth).collect();
    let params = Params::default();
    let mut scratch = Scratch::new();
    // The first sort makes the buffers and finds the thickness that ready depths cannot know.
    let thickness = slice_cloud(cloud, None, camera, &params, &mut scratch).map(|order| order.thickness);
    let thickness = thickness.expect("invariant: a valid cloud is sliced");
    let ready = Params { thickness: Thickness::World(thickness), ..params };
    let mut bench = |name: &str, sort: &dyn Fn(&mut Scratch) -> Result<SliceOrder, hbsort::Error>| {
        group.bench_function(name, |b| {
            b.iter(|| {
                let order = sort(&mut scratch).expect("invariant: a valid cloud is sliced");
                scratch.recycle(order);
            });
        });
        let bytes = scratch.bytes() as f64 / cloud.len() as f64;
        println!("{name}: {:?}, {bytes:.2} bytes a splat", scratch.info());
    };
    bench("hbsort cloud", &|s| slice_cloud(cloud, None, camera, &params, s));
    bench("hbsort cloud exact", &|s| slice_cloud(cloud, None, camera, &Params { exact: true, ..params }, s));
    bench("hbsort depths", &|s| slice_depths(&depth, &ready, s));
    bench("hbsort depths exact", &|s| slice_depths(&depth, &Params { exact: true, ..ready }, s));
}

fn peers(group: &mut Group<'_>, entries: &[Entry]) {
    let threads = rayon::current_num_threads();
    let mut bench = |name: &str, sort: &dyn Fn(&mut Vec<Entry>)| {
        group.bench_function(name, |b| {
            b.iter_batched_ref(|| entries.to_vec(), |v| sort(v), BatchSize::LargeInput);
        });
    };
    bench("radsort", &|v| radsort::sort_by_key(v, |e| e.depth));
    bench("rdst", &|v| v.radix_sort_unstable());
    bench("voracious_mt_sort", &|v| v.voracious_mt_sort(threads));
    // Depths as ordered integers: comparing floats would be slower.
    bench("rayon par_sort_unstable_by_key", &|v| v.par_sort_unstable_by_key(|e| ordered(e.depth)));
}

/// Integer with the order of the depth.
fn ordered(depth: f32) -> u32 {
    let bits = depth.to_bits();
    bits ^ ((bits as i32 >> 31) as u32 | 0x8000_0000)
}

criterion_group!(benches, slicing);
criterion_main!(benches);
