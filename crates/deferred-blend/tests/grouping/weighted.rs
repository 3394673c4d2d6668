//! Weighted graph colouring.

use super::{ball, flat, least, mixed, one_place};
use deferred_blend::Error;
use deferred_blend::grouping::{
    GraphParams, Groups, OverlapGraph, WeightedParams, hash_grouping, minimum_coloring, weighted_coloring,
    weighted_cost,
};
use splat_core::{Cloud, rng};

fn graph(cloud: &Cloud) -> OverlapGraph {
    OverlapGraph::build(cloud, &GraphParams::default(), None).expect("a valid cloud")
}

fn with(groups: u32) -> WeightedParams {
    WeightedParams { groups, ..WeightedParams::default() }
}

#[test]
fn cost_and_overlap_are_far_below_those_of_random_groups_and_of_hashing() {
    for cloud in [ball(), mixed(2000)] {
        let graph = graph(&cloud);
        let groups = weighted_coloring(&graph, &with(4), None).expect("in range");
        let random = (0..cloud.len() as u64).map(|i| (rng::bits(1, 2, i, 3) % 4) as u8).collect();
        let random = Groups::new(4, random).expect("below the count");
        let hashed =
            hash_grouping(&cloud, &deferred_blend::grouping::HashParams { groups: 4, ..Default::default() }, None);
        let cost = |groups: &Groups| weighted_cost(&graph, groups, 0.5).expect("in range");
        let hashed = hashed.expect("in range");
        assert!(cost(&groups) < 0.5 * cost(&random), "{} {}", cost(&groups), cost(&random));
        let overlaps = [&groups, &random, &hashed].map(|groups| graph.mean_overlap(groups));
        assert!(overlaps[0] < 0.4 * overlaps[1], "{overlaps:?}");
        assert!(overlaps[0] < overlaps[2], "{overlaps:?}");
    }
}

#[test]
fn with_as_many_groups_as_colors_suffice_nothing_overlaps() {
    let graph = graph(&ball());
    let enough = minimum_coloring(&graph, 256, None).expect("in range").groups.count() + 4;
    let groups = weighted_coloring(&graph, &with(enough), None).expect("in range");
    assert_eq!(graph.overlaps(&groups).len(), 0);
    assert_eq!(weighted_cost(&graph, &groups, 0.5), Ok(0.0));
}

#[test]
fn the_optimization_lowers_the_overlap() {
    let graph = graph(&ball());
    let overlap = |rounds| {
        let groups = weighted_coloring(&graph, &WeightedParams { rounds, ..with(4) }, None).expect("in range");
        graph.mean_overlap(&groups)
    };
    assert!(overlap(8) < 0.99 * overlap(0), "{} {}", overlap(8), overlap(0));
}

/// Every weight of Eq. 7 is 0 in a plane; areas alone part the discs.
#[test]
fn coplanar_discs_are_parted_by_areas() {
    let graph = graph(&flat());
    let groups = weighted_coloring(&graph, &with(8), None).expect("in range");
    assert_eq!(weighted_cost(&graph, &groups, 0.5), Ok(0.0), "normals are equal");
    assert!(graph.mean_overlap(&groups) < 0.08, "{}", graph.mean_overlap(&groups));
}

#[test]
fn db9_discs_at_one_place_fill_all_groups_alike() {
    let graph = graph(&one_place(1000));
    let groups = weighted_coloring(&graph, &with(8), None).expect("in range");
    for group in 0..8 {
        assert_eq!(groups.by_disc().iter().filter(|&&found| found == group).count(), 125);
    }
}

#[test]
fn nothing_and_a_single_disc_are_grouped() {
    for cloud in least() {
        let groups = weighted_coloring(&graph(&cloud), &with(8), None).expect("in range");
        assert_eq!((groups.count(), groups.by_disc()), (8, vec![0; cloud.len()].as_slice()));
    }
}

#[test]
fn parameters_are_checked() {
    let graph = graph(&flat());
    for params in [
        with(0),
        with(257),
        WeightedParams { gap: 0.0, ..with(8) },
        WeightedParams { gap: f32::NAN, ..with(8) },
        WeightedParams { threshold: -1.0, ..with(8) },
        WeightedParams { threshold: f32::NAN, ..with(8) },
    ] {
        assert!(matches!(weighted_coloring(&graph, &params, None), Err(Error::Parameter { .. })), "{params:?}");
    }
    let groups = weighted_coloring(&graph, &with(8), None).expect("in range");
    assert!(matches!(weighted_cost(&graph, &groups, f32::INFINITY), Err(Error::Parameter { .. })));
}
