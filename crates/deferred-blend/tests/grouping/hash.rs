//! Groups by a hash table.

use super::{ball, flat, least, medium, one_place};
use crate::scenes::disc;
use deferred_blend::Error;
use deferred_blend::grouping::{
    Collisions, GraphParams, Groups, HashParams, OverlapGraph, covering_factor, hash_grouping,
};
use splat_core::Cloud;
use splat_core::glam::{DVec3, Vec3};

fn grouped(cloud: &Cloud, groups: u32, collisions: Collisions) -> Groups {
    let params = HashParams { groups, collisions, ..HashParams::default() };
    hash_grouping(cloud, &params, None).expect("a valid cloud")
}

/// One disc of radius 1 in the middle of each cell of Eq. 9, with negative places too.
fn lattice(half: i32) -> Cloud {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for y in -half..half {
        for x in -half..half {
            let mut splat = disc(Vec3::new(x as f32 + 0.5, y as f32 + 0.5, 0.0), Vec3::Z, 1.0, 0.5);
            splat.radius = 1.0;
            cloud.push(&splat);
        }
    }
    cloud
}

#[test]
fn eight_groups_have_the_table_of_figure_9() {
    let cloud = lattice(8);
    let groups = grouped(&cloud, 8, Collisions::Keep);
    let rows = [[0u8, 3, 6, 1, 4, 7, 2, 5], [1, 4, 7, 2, 5, 0, 3, 6]];
    for (i, position) in cloud.position.iter().enumerate() {
        let [x, y] = [position.x, position.y].map(|v| (v.floor() as i32).rem_euclid(8));
        let row = rows.get(y as usize);
        assert!(row.is_none_or(|row| row[x as usize] == groups.by_disc()[i]), "{position}");
        assert_eq!(i32::from(groups.by_disc()[i]), (3 * x + y) % 8);
    }
}

#[test]
fn discs_of_one_group_lie_apart_unless_they_share_a_cell() {
    // Cells of a group are √8 or more apart and so are these discs, which overlap nearer than 2.
    let cloud = lattice(8);
    let graph = OverlapGraph::build(&cloud, &GraphParams::default(), None).expect("a valid cloud");
    for collisions in [Collisions::Keep, Collisions::Resolve] {
        assert_eq!(graph.overlaps(&grouped(&cloud, 8, collisions)).len(), 0);
    }
}

#[test]
fn collisions_that_are_resolved_leave_less_overlap_and_only_near_ones_are() {
    let cloud = ball();
    let graph = OverlapGraph::build(&cloud, &GraphParams::default(), None).expect("a valid cloud");
    let overlap = |collisions| graph.mean_overlap(&grouped(&cloud, 8, collisions));
    let near = |distance| Collisions::ResolveNear { eye: cloud.origin + DVec3::new(1.5, 0.0, 0.0), distance };
    let keep = overlap(Collisions::Keep);
    let resolve = overlap(Collisions::Resolve);
    assert!(keep <= 1.24 && resolve <= 0.19 && overlap(near(1.0)) <= 1.03, "Table 2: {keep} {resolve}");
    assert!(overlap(near(1.0)) > resolve && overlap(near(1.0)) < keep);
    assert_eq!(grouped(&cloud, 8, near(0.0)), grouped(&cloud, 8, Collisions::Keep));
    assert_eq!(grouped(&cloud, 8, near(10.0)), grouped(&cloud, 8, Collisions::Resolve));
}

#[test]
fn db11_groups_of_a_plane_are_of_one_size_for_any_number() {
    for (groups, collisions) in
        [2, 3, 7, 8, 16].map(|k| (k, Collisions::Keep)).into_iter().chain([(8, Collisions::Resolve)])
    {
        let assigned = grouped(&flat(), groups, collisions);
        let counts: Vec<usize> =
            (0..groups as u8).map(|group| assigned.by_disc().iter().filter(|&&g| g == group).count()).collect();
        let least = counts.iter().min();
        let most = counts.iter().max();
        assert!(least.zip(most).is_some_and(|(least, most)| *most <= 2 * least), "{groups}: {counts:?}");
    }
}

#[test]
fn db11_places_of_more_radii_than_a_number_can_count_are_grouped() {
    let mut cloud = lattice(4);
    cloud.radius.iter_mut().for_each(|radius| *radius = 1e-30);
    for collisions in [Collisions::Keep, Collisions::Resolve] {
        assert_eq!(grouped(&cloud, 5, collisions).by_disc().len(), 64);
    }
}

#[test]
fn db9_discs_at_one_place_spread_over_all_groups() {
    let groups = grouped(&one_place(4000), 8, Collisions::Resolve);
    for group in 0..8 {
        assert_eq!(groups.by_disc().iter().filter(|&&found| found == group).count(), 500);
    }
}

/// Discs at the border of those that are looked at together do not know the others: that leaves little.
#[test]
fn collisions_among_more_discs_than_are_looked_at_together_are_resolved() {
    let mut cloud = lattice(80);
    cloud.position.iter_mut().for_each(|position| *position *= 0.8);
    let graph = OverlapGraph::build(&cloud, &GraphParams::default(), None).expect("a valid cloud");
    let overlap = |collisions| graph.mean_overlap(&grouped(&cloud, 16, collisions));
    let keep = overlap(Collisions::Keep);
    let resolve = overlap(Collisions::Resolve);
    assert!(resolve < 0.1 && keep > 2.0 * resolve, "{keep} {resolve}");
}

#[test]
fn discs_of_eight_groups_cover_a_plane_with_the_radius_of_figure_10() {
    assert!((covering_factor(8).expect("in range") - 50f64.sqrt() / 4.0).abs() < 1e-15);
    // One group: a disc in each cell of a square lattice.
    assert!((covering_factor(1).expect("in range") - 0.5f64.sqrt()).abs() < 1e-15);
    for groups in 1..=256 {
        // The circle of an equilateral triangle is the least that there is for cells of this area.
        let factor = covering_factor(groups).expect("in range");
        let least = (2.0 * f64::from(groups) / 27f64.sqrt()).sqrt();
        assert!(factor >= least * (1.0 - 1e-12) && factor < 1.4 * least, "{groups}: {factor} over {least}");
    }
}

#[test]
fn nothing_and_a_single_disc_are_grouped() {
    for cloud in least() {
        assert_eq!(grouped(&cloud, 8, Collisions::Resolve).by_disc().len(), cloud.len());
    }
}

#[test]
fn parameters_and_clouds_are_checked() {
    let near =
        |eye, distance| HashParams { collisions: Collisions::ResolveNear { eye, distance }, ..HashParams::default() };
    for params in [
        HashParams { groups: 0, ..HashParams::default() },
        HashParams { groups: 257, ..HashParams::default() },
        HashParams { disc_scale: 0.0, ..HashParams::default() },
        near(DVec3::NAN, 1.0),
        near(DVec3::ZERO, -1.0),
        near(DVec3::ZERO, f64::NAN),
    ] {
        assert!(matches!(hash_grouping(&flat(), &params, None), Err(Error::Parameter { .. })), "{params:?}");
    }
    assert!(matches!(hash_grouping(&medium(), &HashParams::default(), None), Err(Error::Cloud(_))));
    assert!(matches!(covering_factor(0), Err(Error::Parameter { .. })));
}
