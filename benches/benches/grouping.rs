//! Groups of the discs of a dragon (Zhang and Pajarola 2007, Tables 1 to 3): overlap graph, both colourings, the hash table, and
//! petgraph's DSATUR on the same graph.
//!
//! The dragon is that of the assets, split to 1.1 million discs, or another mesh named by `ORGANZA_DRAGON`. Radii are such that the
//! mean degree is 8.8, as Table 1 has it. With `ORGANZA_EDGES` the edges are written to that file for
//! `benches/peers/graph_coloring.py`, pairs of 32-bit numbers.
#![allow(missing_docs, reason = "a benchmark")]

use convert::read::{self, Loaded, ReadParams};
use convert::{Density, MeshParams, mesh_to_points};
use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use deferred_blend::grouping::{
    Collisions, GraphParams, HashParams, OverlapGraph, Relaxation, WeightedParams, hash_grouping, minimum_coloring,
    weighted_coloring,
};
use organza_benches::processor_ms;
use petgraph::graph::UnGraph;
use splat_core::Cloud;
use std::path::PathBuf;

/// Of the dragon in Table 1.
const DISCS: u64 = 1_100_000;
const MEAN_DEGREE: f64 = 8.8;

fn dragon() -> Cloud {
    let of_assets = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/stanford-dragon/dragon_res3.ply.gz");
    let file = std::env::var_os("ORGANZA_DRAGON").map_or_else(|| PathBuf::from(of_assets), PathBuf::from);
    let (loaded, _) = read::file(&file, &ReadParams::default(), None).expect("the dragon");
    let Loaded::Mesh(mesh) = loaded else { panic!("a mesh") };
    let params = MeshParams { density: Density::Splats(DISCS), ..MeshParams::default() };
    let (mut cloud, _) = mesh_to_points(&mesh, &params, None).expect("discs of the dragon");
    cloud.canonicalize();
    cloud
}

fn build(cloud: &Cloud, disc_scale: f32, factor: f32) -> OverlapGraph {
    let relaxation = Relaxation { factor, ..Relaxation::default() };
    let params = GraphParams { disc_scale, relaxation, ..GraphParams::default() };
    OverlapGraph::build(cloud, &params, None).expect("invariant: a valid cloud")
}

fn mean_degree(graph: &OverlapGraph) -> f64 {
    2.0 * graph.edges() as f64 / graph.nodes() as f64
}

/// The share of the cut-off radius that gives the mean degree of Table 1.
fn disc_scale(cloud: &Cloud) -> f32 {
    let (mut low, mut high) = (0.0f32, 1.0f32);
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if mean_degree(&build(cloud, middle, 1.0)) < MEAN_DEGREE { low = middle } else { high = middle }
    }
    high
}

fn grouping(criterion: &mut Criterion) {
    let cloud = dragon();
    let scale = disc_scale(&cloud);
    let graph = build(&cloud, scale, 1.0);
    println!("{} discs, {} edges, {} bytes", graph.nodes(), graph.edges(), graph.bytes());
    table_1(&cloud, scale, &graph);
    let mut group = criterion.benchmark_group("groups of a dragon");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    let mut bench = |name: &str, work: &dyn Fn()| {
        group.bench_function(name, |b| b.iter(work));
        let before = processor_ms();
        work();
        println!("{name}: {:.0} ms of processor time", processor_ms() - before);
    };
    bench("overlap graph", &|| drop(build(&cloud, scale, 1.0)));
    bench("MGC", &|| drop(minimum_coloring(&graph, 256, None)));
    bench("WGC, K = 8", &|| drop(weighted_coloring(&graph, &WeightedParams::default(), None)));
    let weighted = weighted_coloring(&graph, &WeightedParams::default(), None).expect("invariant: in range");
    println!("WGC: mean overlap {:.3}", graph.mean_overlap(&weighted));
    let eye = cloud.origin + cloud.position[0].as_dvec3();
    let bounds = cloud.bounds();
    let distance = 0.35 * f64::from((bounds.max - bounds.min).length());
    for collisions in [Collisions::Keep, Collisions::Resolve, Collisions::ResolveNear { eye, distance }] {
        let params = HashParams { disc_scale: scale, collisions, ..HashParams::default() };
        bench(&format!("hash, {collisions:?}"), &|| drop(hash_grouping(&cloud, &params, None)));
        let groups = hash_grouping(&cloud, &params, None).expect("invariant: a valid cloud");
        println!("{collisions:?}: mean overlap {:.3}", graph.mean_overlap(&groups));
    }
    let peer = peer(&graph);
    bench("petgraph DSATUR", &|| drop(petgraph::algo::dsatur_coloring(&peer)));
    group.finish();
}

fn table_1(cloud: &Cloud, scale: f32, whole: &OverlapGraph) {
    for factor in [1.0, 0.8, 0.6, 0.4] {
        let graph = build(cloud, scale, factor);
        let groups = minimum_coloring(&graph, 256, None).expect("invariant: in range").groups;
        let (most, mean, overlap) = (graph.max_degree(), mean_degree(&graph), whole.mean_overlap(&groups));
        println!("c = {factor}: K = {}, degrees {most} and {mean:.1}, mean overlap {overlap:.3}", groups.count());
    }
}

fn peer(graph: &OverlapGraph) -> UnGraph<(), ()> {
    let later = |node: usize| graph.neighbors(node).iter().filter(move |&&n| n as usize > node);
    let edges: Vec<(u32, u32)> =
        (0..graph.nodes()).flat_map(|node| later(node).map(move |&n| (node as u32, n))).collect();
    if let Some(file) = std::env::var_os("ORGANZA_EDGES") {
        let bytes: Vec<u8> = edges.iter().flat_map(|&(a, b)| [a, b]).flat_map(u32::to_le_bytes).collect();
        std::fs::write(file, bytes).expect("a file for the edges");
    }
    UnGraph::from_edges(edges)
}

criterion_group!(benches, grouping);
criterion_main!(benches);
