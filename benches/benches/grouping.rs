//! Groups of the discs of a dragon (Zhang and Pajarola 2007, Table 3): overlap graph, both colourings, the hash table, and
//! petgraph's DSATUR on the same graph.
//!
//! The dragon is that of the assets, or another mesh named by `ORGANZA_DRAGON`, split to 1.1 million discs, and in the place of the other
//! models of Table 3 to as many as these have. Radii are such that mean degrees are those of Table 1; what the groups are worth, the example
//! `grouping_tables` tells. With `ORGANZA_EDGES` the edges are written to that file for
//! `benches/peers/graph_coloring.py`, pairs of 32-bit numbers.
#![allow(missing_docs, reason = "a benchmark")]

use criterion::{Criterion, SamplingMode, criterion_group, criterion_main};
use deferred_blend::grouping::{
    Collisions, HashParams, OverlapGraph, WeightedParams, hash_grouping, minimum_coloring, weighted_coloring,
};
use organza_benches::{disc_scale, dragon, overlap_graph, processor_ms};
use petgraph::graph::UnGraph;

/// Numbers of points and mean degrees of the models of Table 3: dragon, female, balljoint.
const TABLE_3: [(u64, f64); 3] = [(1_100_000, 8.8), (303_000, 18.9), (137_000, 18.6)];

fn grouping(criterion: &mut Criterion) {
    let [(discs, degree), ..] = TABLE_3;
    let cloud = dragon(discs);
    let scale = disc_scale(&cloud, degree);
    let graph = overlap_graph(&cloud, scale, 1.0);
    println!("{} discs, {} edges, {} bytes", graph.nodes(), graph.edges(), graph.bytes());
    let mut group = criterion.benchmark_group("groups of a dragon");
    group.sample_size(10).sampling_mode(SamplingMode::Flat);
    let mut bench = |name: &str, work: &dyn Fn()| {
        group.bench_function(name, |b| b.iter(work));
        let before = processor_ms();
        work();
        println!("{name}: {:.0} ms of processor time", processor_ms() - before);
    };
    bench("overlap graph", &|| drop(overlap_graph(&cloud, scale, 1.0)));
    bench("MGC", &|| drop(minimum_coloring(&graph, 256, None)));
    bench("WGC, K = 8", &|| drop(weighted_coloring(&graph, &WeightedParams::default(), None)));
    let peer = peer(&graph);
    bench("petgraph DSATUR", &|| drop(petgraph::algo::dsatur_coloring(&peer)));
    for (discs, degree) in TABLE_3 {
        table_3(discs, degree, &mut bench);
    }
    group.finish();
}

/// Hashing in its three cases.
fn table_3(discs: u64, degree: f64, bench: &mut impl FnMut(&str, &dyn Fn())) {
    let cloud = dragon(discs);
    let scale = disc_scale(&cloud, degree);
    let eye = cloud.origin + cloud.position[0].as_dvec3();
    let bounds = cloud.bounds();
    let distance = 0.35 * f64::from((bounds.max - bounds.min).length());
    for collisions in [Collisions::Keep, Collisions::Resolve, Collisions::ResolveNear { eye, distance }] {
        let params = HashParams { disc_scale: scale, collisions, ..HashParams::default() };
        // Without the numbers of what is near.
        let name = format!("{collisions:?}");
        let name = name.split(' ').next().unwrap_or(&name);
        bench(&format!("hash of {discs}, {name}"), &|| drop(hash_grouping(&cloud, &params, None)));
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
