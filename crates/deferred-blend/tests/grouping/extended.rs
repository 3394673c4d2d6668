//! Groups that cover the surface each by itself.

use super::{ball, flat, least};
use deferred_blend::Error;
use deferred_blend::grouping::extended::{DuplicateParams, EnlargeParams, duplicates, enlarged_radii};
use deferred_blend::grouping::{GraphParams, Groups, OverlapGraph, WeightedParams, covering_factor, weighted_coloring};
use splat_core::Cloud;

fn four(cloud: &Cloud) -> (OverlapGraph, Groups) {
    let graph = OverlapGraph::build(cloud, &GraphParams::default(), None).expect("a valid cloud");
    let groups = weighted_coloring(&graph, &WeightedParams { groups: 4, ..WeightedParams::default() }, None);
    (graph, groups.expect("in range"))
}

#[test]
fn every_disc_that_a_group_leaves_open_joins_it() {
    let cloud = ball();
    let (graph, groups) = four(&cloud);
    let params = DuplicateParams::default();
    let added = duplicates(&graph, &groups, &params, None).expect("in range");
    assert_eq!(added.len(), 4);
    for (group, places) in (0u8..).zip(&added) {
        assert!(places.iter().all(|&place| groups.by_disc()[place as usize] != group));
        assert!(places.is_sorted_by(|a, b| a < b));
    }
    let count: usize = added.iter().map(Vec::len).sum();
    assert!(count > 0 && count < 2 * cloud.len(), "{count}");
    let none = DuplicateParams { most_clipped: 0.0, ..params };
    let fewer: usize = duplicates(&graph, &groups, &none, None).expect("in range").iter().map(Vec::len).sum();
    assert!(fewer < count, "{fewer} of {count}");
}

/// Two discs that do not touch and are of two groups join each the other's.
#[test]
fn discs_that_overlap_nothing_join_every_group() {
    let cloud = ball().gather(&[0, 2999]);
    let graph = OverlapGraph::build(&cloud, &GraphParams::default(), None).expect("a valid cloud");
    let groups = Groups::new(2, vec![0, 1]).expect("below the count");
    let added = duplicates(&graph, &groups, &DuplicateParams { most_clipped: 0.0, ..DuplicateParams::default() }, None);
    assert_eq!(added, Ok(vec![vec![1], vec![0]]));
}

#[test]
fn db12_enlarged_radii_end_and_cover() {
    for cloud in [ball(), flat()] {
        let (_, groups) = four(&cloud);
        let enlarged = enlarged_radii(&cloud, &groups, &EnlargeParams::default(), None).expect("in range");
        assert_eq!(enlarged.len(), 4);
        let most = covering_factor(8).expect("in range");
        for of_group in enlarged {
            assert!(of_group.factor > 1.0 && of_group.factor <= most, "{of_group:?}");
            assert!(of_group.covered > 0.9, "{of_group:?}");
        }
    }
}

/// Figure 16: more groups have less overlap within each, and each covers less, so that its radii have to grow more.
#[test]
fn groups_of_eight_overlap_less_and_cover_less_than_groups_of_four() {
    let cloud = ball();
    let graph = OverlapGraph::build(&cloud, &GraphParams::default(), None).expect("a valid cloud");
    let [four, eight] = [4, 8].map(|count| {
        let params = WeightedParams { groups: count, ..WeightedParams::default() };
        let groups = weighted_coloring(&graph, &params, None).expect("in range");
        let enlarged = enlarged_radii(&cloud, &groups, &EnlargeParams::default(), None).expect("in range");
        let factor = enlarged.iter().map(|of_group| of_group.factor).sum::<f64>() / enlarged.len() as f64;
        (graph.mean_overlap(&groups), factor)
    });
    println!("mean overlap and factor of the radii: {four:?} of four, {eight:?} of eight");
    assert!(eight.0 < 0.5 * four.0 && eight.1 > 1.1 * four.1, "{four:?} {eight:?}");
}

/// All discs in one group cover what all discs cover, with the radii that they have.
#[test]
fn one_group_of_all_keeps_its_radii() {
    let cloud = ball();
    let groups = Groups::new(1, vec![0; cloud.len()]).expect("below the count");
    let enlarged = enlarged_radii(&cloud, &groups, &EnlargeParams::default(), None).expect("in range");
    assert_eq!(enlarged.len(), 1);
    assert!((enlarged[0].factor - 1.0).abs() < 1e-12 && (enlarged[0].covered - 1.0).abs() < 1e-12, "{enlarged:?}");
}

#[test]
fn empty_groups_and_clouds_are_taken() {
    for cloud in least() {
        let groups = Groups::new(2, vec![1; cloud.len()]).expect("below the count");
        let enlarged = enlarged_radii(&cloud, &groups, &EnlargeParams::default(), None).expect("in range");
        assert_eq!((enlarged[0].factor, enlarged[0].covered), (1.0, 0.0));
        let graph = OverlapGraph::build(&cloud, &GraphParams::default(), None).expect("a valid cloud");
        let added = duplicates(&graph, &groups, &DuplicateParams::default(), None).expect("in range");
        assert_eq!(added.iter().map(Vec::len).sum::<usize>(), cloud.len());
    }
}

#[test]
fn parameters_are_checked() {
    let cloud = flat();
    let (graph, groups) = four(&cloud);
    for params in [
        DuplicateParams { gap: 0.0, ..DuplicateParams::default() },
        DuplicateParams { most_clipped: 1.0, ..DuplicateParams::default() },
        DuplicateParams { most_clipped: f32::NAN, ..DuplicateParams::default() },
    ] {
        assert!(matches!(duplicates(&graph, &groups, &params, None), Err(Error::Parameter { .. })), "{params:?}");
    }
    let bad = EnlargeParams { gap: f32::NAN, ..EnlargeParams::default() };
    assert!(matches!(enlarged_radii(&cloud, &groups, &bad, None), Err(Error::Parameter { .. })));
    let other = Groups::new(4, vec![0; 3]).expect("below the count");
    let found = enlarged_radii(&cloud, &other, &EnlargeParams::default(), None);
    assert!(matches!(found, Err(Error::Parameter { .. })));
}
