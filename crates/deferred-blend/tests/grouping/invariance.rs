//! Nothing depends on the order of the cloud, the number of threads, the cloud's origin or a power of two of its scale.

use super::graph::edges;
use super::{ball, flat, mixed};
use deferred_blend::grouping::extended::{DuplicateParams, EnlargeParams, Enlarged, duplicates, enlarged_radii};
use deferred_blend::grouping::{
    Collisions, GraphParams, HashParams, OverlapGraph, WeightedParams, hash_grouping, minimum_coloring,
    weighted_coloring,
};
use splat_core::glam::DVec3;
use splat_core::{Cloud, rng};

/// All that grouping makes of a cloud.
#[derive(Debug, PartialEq)]
struct Everything {
    edges: Vec<[usize; 2]>,
    /// By method, the group of each disc.
    groups: [Vec<u8>; 5],
    added: Vec<Vec<u32>>,
    enlarged: Vec<Enlarged>,
}

/// `unit` is the length that a unit of the cloud is now.
fn everything(cloud: &Cloud, unit: f64) -> Everything {
    let graph = OverlapGraph::build(cloud, &GraphParams::default(), None).expect("a valid cloud");
    let minimum = minimum_coloring(&graph, 256, None).expect("in range").groups;
    let weighted = |groups| {
        let params = WeightedParams { groups, ..WeightedParams::default() };
        weighted_coloring(&graph, &params, None).expect("in range")
    };
    let four = weighted(4);
    let near = Collisions::ResolveNear { eye: cloud.origin, distance: unit };
    let hashed = |collisions| {
        let params = HashParams { collisions, ..HashParams::default() };
        hash_grouping(cloud, &params, None).expect("a valid cloud").by_disc().to_vec()
    };
    Everything {
        edges: edges(&graph),
        added: duplicates(&graph, &four, &DuplicateParams::default(), None).expect("in range"),
        enlarged: enlarged_radii(cloud, &four, &EnlargeParams::default(), None).expect("in range"),
        groups: [
            minimum.by_disc().to_vec(),
            four.by_disc().to_vec(),
            hashed(Collisions::Keep),
            hashed(Collisions::Resolve),
            hashed(near),
        ],
    }
}

fn clouds() -> [Cloud; 3] {
    [mixed(1500), ball(), flat()]
}

#[test]
fn perm_any_order_of_the_cloud_gives_each_disc_its_group() {
    for cloud in clouds() {
        let mut order: Vec<u32> = (0..cloud.len() as u32).collect();
        order.sort_by_key(|&i| rng::bits(3, 1, u64::from(i), 0));
        let whole = everything(&cloud, 1.0);
        let shuffled = everything(&cloud.gather(&order), 1.0);
        for (whole, shuffled) in whole.groups.iter().zip(&shuffled.groups) {
            let of_places: Vec<u8> = order.iter().map(|&i| whole[i as usize]).collect();
            assert_eq!(of_places, *shuffled);
        }
        assert_eq!(whole.enlarged, shuffled.enlarged);
        for (whole, shuffled) in whole.added.iter().zip(&shuffled.added) {
            let mut places: Vec<u32> = shuffled.iter().map(|&i| order[i as usize]).collect();
            places.sort_unstable();
            assert_eq!(*whole, places);
        }
    }
}

#[test]
fn threads_any_number_gives_the_same_groups() {
    for cloud in clouds() {
        let by = |threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            pool.install(|| everything(&cloud, 1.0))
        };
        let one = by(1);
        assert!([2, 3, 7].into_iter().all(|threads| by(threads) == one));
    }
}

#[test]
fn shift_ten_thousand_kilometres_away_nothing_changes() {
    for mut cloud in clouds() {
        let here = everything(&cloud, 1.0);
        cloud.origin += DVec3::new(1e7, -1e7, 1e7);
        assert_eq!(here, everything(&cloud, 1.0));
    }
}

#[test]
fn scale2_powers_of_two_change_nothing() {
    for cloud in clouds() {
        let whole = everything(&cloud, 1.0);
        for power in [-40, -10, 10, 40] {
            let factor = 2f32.powi(power);
            let mut scaled = cloud.clone();
            scaled.origin *= f64::from(factor);
            scaled.position.iter_mut().for_each(|position| *position *= factor);
            scaled.radius.iter_mut().for_each(|radius| *radius *= factor);
            scaled.tangent.iter_mut().for_each(|tangent| *tangent *= factor);
            assert_eq!(whole, everything(&scaled, f64::from(factor)), "2^{power}");
        }
    }
}
