//! The Stanford dragon as discs that overlap as much as those of a paper's model.

use convert::{Density, MeshParams, mesh_to_points};
use deferred_blend::grouping::{GraphParams, OverlapGraph, Relaxation};
use read::{Loaded, ReadParams};
use splat_core::Cloud;
use std::path::PathBuf;

/// The dragon of the assets, or another mesh named by `ORGANZA_DRAGON`, split to about so many discs.
pub fn dragon(discs: u64) -> Cloud {
    let of_assets = concat!(env!("CARGO_MANIFEST_DIR"), "/../assets/stanford-dragon/dragon_res3.ply.gz");
    let file = std::env::var_os("ORGANZA_DRAGON").map_or_else(|| PathBuf::from(of_assets), PathBuf::from);
    let (loaded, _) = read::file(&file, &ReadParams::default(), None).expect("the dragon");
    let Loaded::Mesh(mesh) = loaded else { panic!("a mesh") };
    let params = MeshParams { density: Density::Splats(discs), ..MeshParams::default() };
    let (mut cloud, _) = mesh_to_points(&mesh, &params, None).expect("discs of the dragon");
    cloud.canonicalize();
    cloud
}

/// The overlap graph of discs with a share of their cut-off radius, c = `factor`.
pub fn overlap_graph(cloud: &Cloud, disc_scale: f32, factor: f32) -> OverlapGraph {
    let relaxation = Relaxation { factor, ..Relaxation::default() };
    let params = GraphParams { disc_scale, relaxation, ..GraphParams::default() };
    OverlapGraph::build(cloud, &params, None).expect("invariant: a valid cloud")
}

/// Mean number of neighbours.
pub fn mean_degree(graph: &OverlapGraph) -> f64 {
    2.0 * graph.edges() as f64 / graph.nodes() as f64
}

/// The share of the cut-off radius that gives a mean degree at c = 1.
pub fn disc_scale(cloud: &Cloud, degree: f64) -> f32 {
    let mut low = 0.0f32;
    let mut high = 1.0f32;
    for _ in 0..12 {
        let middle = 0.5 * (low + high);
        if mean_degree(&overlap_graph(cloud, middle, 1.0)) < degree { low = middle } else { high = middle }
    }
    high
}
