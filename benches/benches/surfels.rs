//! A translucent dragon of 0.44 M discs at 1024² (Zhang and Pajarola 2007, Fig. 17): discs met by rays, layers by gaps, depth peeling,
//! Algorithms 1 and 2, and the same dragon of glass in a white world. Opaque dragons of 0.14 to 2 M discs in 1+1 and 2+1 passes (Table 4).
#![allow(missing_docs, clippy::expect_used, reason = "a benchmark")]

use convert::{Density, MeshParams, SplatParams, mesh_to_points};
use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use deferred_blend::grouping::{
    Collisions, GraphParams, Groups, HashParams, OverlapGraph, Relaxation, hash_grouping, minimum_coloring,
};
use deferred_blend::{
    Bending, BlendCounts, BlendInput, DiscInput, Discs, Floors, Glass, Layering, Opaque, OpaqueInput, Params, Passes,
    Shown, Surfaces, blend, resolve_opaque,
};
use organza_benches::processor_ms;
use read::{Loaded, ReadParams};
use splat_core::glam::DVec3;
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Camera, Cloud, FootprintStack, LayerSet, Material, Projection};

/// Of the dragon in Fig. 17.
const DISCS: u64 = 437_645;
const SIZE: [u32; 2] = [1024, 1024];
/// Numbers of points in Table 4, and that of Fig. 17.
const TABLE_4: [u64; 5] = [137_000, 303_000, DISCS, 1_100_000, 2_000_000];

fn dragon(discs: u64, opacity: f64) -> Cloud {
    let file = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/stanford-dragon/dragon_res3.ply.gz");
    let (loaded, _) = read::file(file.as_ref(), &ReadParams::default(), None).expect("the dragon");
    let Loaded::Mesh(mesh) = loaded else { panic!("a mesh") };
    let splat = SplatParams { keep_clear: true, ..SplatParams::default() };
    let params = MeshParams { density: Density::Splats(discs), opacity, splat };
    let (mut cloud, _) = mesh_to_points(&mesh, &params, None).expect("discs of the dragon");
    cloud.canonicalize();
    cloud
}

fn view() -> Camera {
    let eye = DVec3::new(0.05, 0.16, 0.36);
    let target = DVec3::new(0.0, 0.12, 0.0);
    Camera::look_at(eye, target, DVec3::Y, Projection::Perspective { fov_y: 0.6 }, SIZE).expect("a view")
}

/// Discs of a view, near ones first.
struct Scene {
    cloud: Cloud,
    camera: Camera,
    ids: Vec<u32>,
    values: Vec<f32>,
    footprints: FootprintStack,
    materials: Vec<Material>,
}

impl Scene {
    fn new(discs: u64, opacity: f64, index: f32) -> Self {
        let cloud = dragon(discs, opacity);
        let camera = view();
        let params = hbsort::Params { direction: splat_core::Direction::FrontToBack, ..hbsort::Params::default() };
        let order = hbsort::slice_cloud(&cloud, None, &camera, &params, &mut hbsort::Scratch::default());
        let ids = order.expect("an order").input_from_sorted;
        let values = cloud.normal.iter().flat_map(|n| (*n * 0.5 + 0.5).to_array()).collect();
        let materials = vec![Material { index: Some([index; 3]), ..Material::default() }];
        Self { cloud, camera, ids, values, footprints: FootprintStack::default(), materials }
    }

    fn input(&self) -> DiscInput<'_> {
        let Self { cloud, camera, ids, footprints, materials, .. } = self;
        DiscInput { cloud, ids, camera, footprints, materials }
    }

    fn blend(&self, discs: &Discs, layering: Layering<'_>, glass: Option<Glass<'_>>) -> BlendCounts {
        let mut picture = Accumulator::new(SIZE, 1, 3, false, false);
        let range = 0.0..f32::INFINITY;
        let shown = Shown::Discs(&self.values);
        let input = BlendInput { discs, shown, opaque: &[], range, layering, glass };
        let params = Params { transmittance_cutoff: 1.0 / 1024.0, ..Params::default() };
        blend(&input, &params, &mut picture, None).expect("nobody cancels").counts
    }

    /// Groups of the discs as large as they are drawn.
    fn groups(&self, factor: f32) -> Groups {
        let relaxation = Relaxation { factor, ..Relaxation::default() };
        let params = GraphParams { disc_scale: Params::default().disc_scale, relaxation, ..GraphParams::default() };
        let graph = OverlapGraph::build(&self.cloud, &params, None).expect("a graph");
        minimum_coloring(&graph, 256, None).expect("in range").groups
    }

    fn resolve(&self, discs: &Discs, passes: Passes<'_>) -> Opaque {
        let shown = Shown::Discs(&self.values);
        let max_bytes = 1 << 32;
        let input = OpaqueInput { discs, shown, channels: 3, objects: false, passes, max_bytes };
        resolve_opaque(&input, &Params::default(), None).expect("nobody cancels")
    }
}

/// The root of the mean squared difference of two pictures, and the share of pixels that differ by more than 1/255.
fn compare(a: &Opaque, b: &Opaque) -> (f64, f64) {
    let apart = |k: usize| (0..3).map(move |c| a.image.channels[c][k] - b.image.channels[c][k]).map(f32::abs);
    let seen: Vec<f64> =
        (0..a.disc.len()).filter(|&k| a.disc[k] != u32::MAX).map(|k| f64::from(apart(k).fold(0.0, f32::max))).collect();
    let mean = |number: &dyn Fn(f64) -> f64| seen.iter().map(|d| number(*d)).sum::<f64>() / seen.len() as f64;
    (mean(&|d| d * d).sqrt(), mean(&|d| f64::from(u8::from(d > 1.0 / 255.0))))
}

fn opaque(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("an opaque dragon");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    for count in TABLE_4 {
        let mut scene = Scene::new(count, 1.0, 1.0);
        scene.ids.sort_unstable();
        let discs = Discs::project(&scene.input(), &Params::default());
        let [most, few] = [0.8, 0.4].map(|factor| scene.groups(factor));
        let resolved = scene.resolve(&discs, Passes::TwoPlusOne);
        for (name, passes) in [
            ("2+1".into(), Passes::TwoPlusOne),
            (format!("1+1, K = {}", most.count()), Passes::OnePlusOne { groups: &most, voronoi: false }),
            (format!("1+1, K = {}, Eq. 14", few.count()), Passes::OnePlusOne { groups: &few, voronoi: true }),
        ] {
            let name = format!("{count}, {name}");
            group.bench_function(&name, |b| b.iter(|| scene.resolve(&discs, passes)));
            let before = processor_ms();
            let picture = scene.resolve(&discs, passes);
            let time = processor_ms() - before;
            let (error, share) = compare(&resolved, &picture);
            println!("{name}: {time:.0} ms of processor time, RMSE {error:.1e}, {:.2} % over 1/255", 100.0 * share);
        }
    }
}

fn surfels(criterion: &mut Criterion) {
    let scene = Scene::new(DISCS, 0.3, 1.0);
    let discs = Discs::project(&scene.input(), &Params::default());
    let counts = scene.blend(&discs, Layering::Gaps, None);
    println!(
        "{} discs, {} fragments, {} layers, {} bytes",
        counts.discs, counts.fragments, counts.layers, counts.bytes
    );
    let params = HashParams { groups: 8, collisions: Collisions::Resolve, ..HashParams::default() };
    let groups = hash_grouping(&scene.cloud, &params, None).expect("groups");
    let floors = Floors { groups: &groups, steps: 256 };
    let mut group = criterion.benchmark_group("a translucent dragon");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    let mut bench = |name: &str, work: &dyn Fn()| {
        group.bench_function(name, |b| b.iter(work));
        let before = processor_ms();
        work();
        println!("{name}: {:.0} ms of processor time", processor_ms() - before);
    };
    bench("discs", &|| drop(Discs::project(&scene.input(), &Params::default())));
    for (name, layering) in [
        ("gaps", Layering::Gaps),
        ("8 layers", Layering::Peeled(8)),
        ("3 layers", Layering::Peeled(3)),
        ("Algorithm 1", Layering::Algorithm1(floors)),
        ("Algorithm 2", Layering::Algorithm2(floors)),
    ] {
        bench(name, &|| _ = scene.blend(&discs, layering, None));
    }
    let clear = Scene::new(DISCS, 0.0, 1.5);
    let discs = Discs::project(&clear.input(), &Params::default());
    let layout = ChannelLayout::new(&LayerSet::default());
    bench("hierarchy of glass", &|| drop(Surfaces::new(&clear.input(), &clear.values, layout)));
    let surfaces = Surfaces::new(&clear.input(), &clear.values, layout);
    let sky = |_, _| [1.0; 3];
    let glass = Glass { bending: Bending::Traced, sky: &sky, surfaces: &surfaces, straight: false, unit: 1.0 };
    bench("glass", &|| _ = clear.blend(&discs, Layering::Gaps, Some(glass)));
}

criterion_group!(benches, surfels, opaque);
criterion_main!(benches);
