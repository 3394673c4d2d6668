//! Grouping.

#[path = "grouping/extended.rs"]
mod extended;
#[path = "grouping/graph.rs"]
mod graph;
#[path = "grouping/hash.rs"]
mod hash;
#[path = "grouping/invariance.rs"]
mod invariance;
#[path = "grouping/minimum.rs"]
mod minimum;
#[path = "grouping/recipe.rs"]
mod recipe;
#[path = "grouping/weighted.rs"]
mod weighted;

use crate::scenes::{disc, plane, soup, sphere};
use deferred_blend::Error;
use deferred_blend::grouping::extended::{DuplicateParams, duplicates};
use deferred_blend::grouping::{
    GraphParams, Groups, OverlapGraph, WeightedParams, minimum_coloring, weighted_coloring,
};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Progress, Splat};

/// Discs on a ball, regular, of few curved neighbours each.
pub(crate) fn ball() -> Cloud {
    let mut cloud = Cloud::new(DVec3::new(1.0e7, -3.0, 0.25));
    sphere(&mut cloud, Vec3::new(0.5, 0.0, 0.0), 1.0, 3000, 0.5);
    cloud.radius.iter_mut().for_each(|radius| *radius *= 0.4);
    cloud
}

/// A flat cloud: every weight of Eq. 7 is 0.
pub(crate) fn flat() -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    plane(&mut cloud, Vec3::ZERO, Vec3::Z, 20, &disc(Vec3::ZERO, Vec3::Z, 0.05, 0.5));
    cloud.radius.iter_mut().for_each(|radius| *radius *= 0.4);
    cloud
}

/// Many discs at one place.
pub(crate) fn one_place(count: usize) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    (0..count).for_each(|_| cloud.push(&disc(Vec3::ONE, Vec3::Z, 0.1, 0.5)));
    cloud
}

/// Ellipses and circles of mixed sizes, the largest forty times the smallest.
pub(crate) fn mixed(count: u64) -> Cloud {
    let mut cloud = soup(count, 1.0);
    for i in (0..cloud.len()).filter(|i| i % 7 != 0) {
        let smaller = if i % 3 == 0 { 0.05 } else { 0.3 };
        cloud.radius[i] *= smaller;
        if let Some(tangent) = cloud.tangent.get_mut(i) {
            *tangent *= smaller;
        }
    }
    cloud
}

/// A cloud of nothing and one of a single disc.
pub(crate) fn least() -> [Cloud; 2] {
    let mut single = Cloud::new(DVec3::ZERO);
    single.push(&disc(Vec3::ZERO, Vec3::Z, 0.1, 0.5));
    [Cloud::new(DVec3::ZERO), single]
}

/// A piece of a medium is no disc.
pub(crate) fn medium() -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(&Splat::default());
    cloud
}

#[test]
fn groups_told_from_outside_are_checked() {
    let groups = Groups::new(2, vec![0, 1, 1]).expect("below the count");
    assert_eq!((groups.count(), groups.by_disc()), (2, [0, 1, 1].as_slice()));
    assert!(matches!(Groups::new(0, vec![]), Err(Error::Parameter { .. })));
    assert!(matches!(Groups::new(257, vec![]), Err(Error::Parameter { .. })));
    assert!(matches!(Groups::new(2, vec![0, 2]), Err(Error::Parameter { .. })));
}

#[test]
fn whoever_cancels_gets_no_groups() {
    let graph = OverlapGraph::build(&ball(), &GraphParams::default(), None).expect("a valid cloud");
    let groups = minimum_coloring(&graph, 256, None).expect("in range").groups;
    let progress = Progress::new();
    let weighted = WeightedParams::default();
    let added = DuplicateParams::default();
    progress.cancel();
    let progress = Some(&progress);
    assert_eq!(minimum_coloring(&graph, 256, progress).err(), Some(Error::Cancelled));
    assert_eq!(weighted_coloring(&graph, &weighted, progress).err(), Some(Error::Cancelled));
    assert_eq!(duplicates(&graph, &groups, &added, progress).err(), Some(Error::Cancelled));
}
