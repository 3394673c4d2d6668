//! Minimum graph colouring.

use super::graph::edges;
use super::{ball, flat, least, mixed, one_place};
use deferred_blend::Error;
use deferred_blend::grouping::{GraphParams, OverlapGraph, Relaxation, minimum_coloring};
use splat_core::Cloud;

fn graph(cloud: &Cloud, factor: f32) -> OverlapGraph {
    let relaxation = Relaxation { factor, ..Relaxation::default() };
    OverlapGraph::build(cloud, &GraphParams { relaxation, ..GraphParams::default() }, None).expect("a valid cloud")
}

#[test]
fn no_edge_lies_within_a_group() {
    for cloud in [mixed(800), ball(), flat()] {
        let mut fewer = u32::MAX;
        for factor in [1.0, 0.8, 0.6, 0.4] {
            let graph = graph(&cloud, factor);
            let coloring = minimum_coloring(&graph, 256, None).expect("in range");
            let groups = &coloring.groups;
            assert!(edges(&graph).iter().all(|&[i, j]| groups.by_disc()[i] != groups.by_disc()[j]));
            assert_eq!((coloring.overlaps, graph.overlaps(groups).len()), (0, 0));
            assert_eq!(graph.mean_overlap(groups), 0.0);
            assert!(groups.count() as usize <= graph.max_degree() + 1);
            assert!(groups.count() <= fewer, "Table 1: fewer groups by a smaller factor");
            fewer = groups.count();
        }
    }
}

/// The rule itself, word by word: by falling degree the least colour that no neighbour has.
#[test]
fn colors_are_those_of_largest_first() {
    let graph = graph(&mixed(800), 1.0);
    let groups = minimum_coloring(&graph, 256, None).expect("in range").groups;
    let mut order: Vec<usize> = (0..graph.nodes()).collect();
    order.sort_by_key(|&node| std::cmp::Reverse(graph.degree(node)));
    let mut colors = vec![None; graph.nodes()];
    for node in order {
        let taken: Vec<u8> = graph.neighbors(node).iter().filter_map(|&n| colors[n as usize]).collect();
        colors[node] = (0..=255).find(|color| !taken.contains(color));
        assert_eq!(colors[node], Some(groups.by_disc()[graph.place(node)]));
    }
}

#[test]
fn a_capped_number_of_groups_is_kept_and_what_is_left_is_told() {
    for most in [1, 2, 5] {
        let graph = graph(&ball(), 1.0);
        let coloring = minimum_coloring(&graph, most, None).expect("in range");
        let left = graph.overlaps(&coloring.groups).len() as u64;
        assert_eq!((coloring.groups.count(), coloring.overlaps), (most, left));
        assert!(left > 0);
    }
}

#[test]
fn db9_ten_thousand_discs_at_one_place_take_as_many_groups_as_there_may_be() {
    let graph = graph(&one_place(10_000), 1.0);
    let coloring = minimum_coloring(&graph, 256, None).expect("in range");
    assert_eq!(coloring.groups.count(), 256);
    // 10,000 = 16·40 + 240·39.
    assert_eq!(coloring.overlaps, 16 * (40 * 39 / 2) + 240 * (39 * 38 / 2));
}

#[test]
fn nothing_and_a_single_disc_are_one_group() {
    for cloud in least() {
        let coloring = minimum_coloring(&graph(&cloud, 1.0), 256, None).expect("in range");
        assert_eq!((coloring.groups.count(), coloring.groups.by_disc().len()), (1, cloud.len()));
    }
}

#[test]
fn the_number_of_groups_is_checked() {
    let graph = graph(&flat(), 1.0);
    for most in [0, 257] {
        assert!(matches!(minimum_coloring(&graph, most, None), Err(Error::Parameter { .. })));
    }
}
