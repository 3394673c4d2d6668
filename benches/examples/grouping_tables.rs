//! Tables 1 and 2 of Zhang and Pajarola 2007, and how many discs are added to cover a surface (section 6.3): all that needs no clock.
//!
//! The dragon of the assets, or another mesh named by `ORGANZA_DRAGON`, stands for all models, split to as many discs as each has, with radii of
//! the same mean degree at c = 1.
//!
//! `cargo run --release -p organza-benches --example grouping_tables -- docs/papers/zhang-pajarola-2007-groups.csv`
#![allow(clippy::expect_used, reason = "an example")]

use deferred_blend::Params;
use deferred_blend::grouping::{
    Collisions, Coverage, Groups, HashParams, Method, OverlapGraph, Recipe, WeightedParams, hash_grouping,
    minimum_coloring, weighted_coloring,
};
use organza_benches::{disc_scale, dragon, mean_degree, overlap_graph};
use splat_core::Cloud;

/// Table 1: points and mean degrees.
const MODELS: [(&str, u64, f64); 4] = [
    ("balljoint", 137_000, 18.6),
    ("female", 303_000, 18.9),
    ("dragon", 1_100_000, 8.8),
    ("David's head", 2_000_000, 17.2),
];
const FACTORS: [f32; 4] = [1.0, 0.8, 0.6, 0.4];
/// Of Table 2.
const GROUPS: u32 = 8;

fn colored(graph: &OverlapGraph) -> Groups {
    minimum_coloring(graph, 256, None).expect("invariant: in range").groups
}

fn table_2(cloud: &Cloud, scale: f32, graph_of_all: &OverlapGraph, add: &mut impl FnMut(String)) {
    let overlap = |groups: &Groups| graph_of_all.mean_overlap(groups);
    let params = WeightedParams { groups: GROUPS, ..WeightedParams::default() };
    let weighted = weighted_coloring(graph_of_all, &params, None).expect("invariant: in range");
    add(format!("2,dragon,WGC,{GROUPS},,,{:.3}", overlap(&weighted)));
    // The largest c in steps of 0.02 at which as many groups are enough.
    let mut steps = (1..=50).map(|k| 1.0 - 0.02 * k as f32).map(|c| (c, colored(&overlap_graph(cloud, scale, c))));
    let (c, few) = steps.find(|(_, groups)| groups.count() <= GROUPS).expect("discs that do not overlap are one group");
    add(format!("2,dragon,MGC at c = {c:.2},{},,,{:.3}", few.count(), overlap(&few)));
    let bounds = cloud.bounds();
    let eye = cloud.origin + cloud.position[0].as_dvec3();
    let distance = 0.35 * f64::from((bounds.max - bounds.min).length());
    for (name, collisions) in [
        ("hash without", Collisions::Keep),
        ("hash with", Collisions::Resolve),
        ("hash near", Collisions::ResolveNear { eye, distance }),
    ] {
        let params = HashParams { groups: GROUPS, disc_scale: scale, collisions };
        let groups = hash_grouping(cloud, &params, None).expect("invariant: a valid cloud");
        add(format!("2,dragon,{name},{GROUPS},,,{:.3}", overlap(&groups)));
    }
    for groups in [4, 8] {
        let method = Method::Weighted;
        let coverage = Coverage::Duplicates;
        let gap = Params::default().gap;
        let members = Recipe { method, groups, coverage, disc_scale: scale, gap }.group(cloud, None).expect("groups");
        let added: usize = (0..cloud.len()).map(|place| members.groups().further(place).len()).sum();
        add(format!("section 6.3,dragon,share of discs added,{groups},,,{:.3}", added as f64 / cloud.len() as f64));
    }
}

fn main() {
    let to = std::env::args().nth(1).expect("a file to write");
    let mut rows = vec!["table,model,grouping,groups,greatest_degree,mean_degree,mean_overlap_or_share".to_owned()];
    let mut add = |row: String| {
        println!("{row}");
        rows.push(row);
    };
    for (name, discs, degree) in MODELS {
        let cloud = dragon(discs);
        let scale = disc_scale(&cloud, degree);
        let graph_of_all = overlap_graph(&cloud, scale, 1.0);
        for c in FACTORS {
            let graph = overlap_graph(&cloud, scale, c);
            let groups = colored(&graph);
            let count = groups.count();
            let most = graph.max_degree();
            let mean = mean_degree(&graph);
            // A sum of nothing is −0.
            let overlap = graph_of_all.mean_overlap(&groups).abs();
            add(format!("1,{name},MGC at c = {c},{count},{most},{mean:.1},{overlap:.3}"));
        }
        if name == "dragon" {
            table_2(&cloud, scale, &graph_of_all, &mut add);
        }
    }
    std::fs::write(to, rows.join("\n") + "\n").expect("a place for the table");
}
