//! Groups in one go, joined, and found again.

use super::{ball, mixed, one_place};
use deferred_blend::Error;
use deferred_blend::grouping::{Collisions, Coverage, Groups, KeptGroups, Membership, Method, Recipe};
use splat_core::Cloud;
use splat_core::glam::{DQuat, DVec3};

const RECIPE: Recipe =
    Recipe { method: Method::Weighted, groups: 4, coverage: Coverage::Partial, disc_scale: 1.0, gap: 0.5 };

const METHODS: [Method; 4] = [
    Method::Weighted,
    Method::Minimum { factor: 1.0 },
    Method::Minimum { factor: 0.9 },
    Method::Hash(Collisions::Resolve),
];

fn members(cloud: &Cloud, recipe: Recipe) -> Membership {
    recipe.group(cloud, None).expect("a cloud")
}

#[test]
fn coverage_adds_members_or_reach_and_changes_no_group() {
    let cloud = ball();
    for method in METHODS {
        let plain = members(&cloud, Recipe { method, ..RECIPE });
        let further = |m: &Membership| (0..cloud.len()).map(|i| m.groups().further(i).len()).sum::<usize>();
        let reach = |m: &Membership| (0..cloud.len()).map(|i| m.reach(i)).fold(0.0, f32::max);
        assert_eq!((plain.discs(), further(&plain), reach(&plain)), (cloud.len(), 0, 1.0), "{method:?}");
        for coverage in [Coverage::Duplicates, Coverage::Enlarged, Coverage::Bound] {
            let covers = members(&cloud, Recipe { method, coverage, ..RECIPE });
            assert_eq!(covers.groups().by_disc(), plain.groups().by_disc(), "{method:?} {coverage:?}");
            let adds = coverage == Coverage::Duplicates;
            assert_eq!((further(&covers) > cloud.len() / 10, reach(&covers) > 1.1), (adds, !adds), "{coverage:?}");
            for i in 0..cloud.len() {
                let groups = covers.groups();
                let members: Vec<u32> = (0..groups.count()).filter(|g| groups.has(i, *g)).collect();
                assert_eq!(members.len(), 1 + groups.further(i).len(), "no group twice");
            }
        }
    }
}

#[test]
fn an_object_that_moved_has_its_groups_again() {
    let cloud = mixed(3000);
    let recipe = Recipe { coverage: Coverage::Duplicates, ..RECIPE };
    let grouped = members(&cloud, recipe);
    let places: Vec<DVec3> = cloud.position.iter().map(|p| p.as_dvec3()).collect();
    let radius = f64::from(cloud.radius.iter().copied().fold(f32::INFINITY, f32::min));
    let kept = KeptGroups::new(&places, radius, grouped.clone());
    assert_eq!(kept.for_discs(&places, radius), Some(grouped.clone()));
    // Elsewhere, rounded there, back again, in another order.
    let turn = DQuat::from_rotation_y(0.7) * DQuat::from_rotation_x(0.2);
    let moved = |p: &DVec3| turn.inverse() * ((turn * *p + DVec3::splat(9.0)).as_vec3().as_dvec3() - DVec3::splat(9.0));
    let order: Vec<usize> = (0..cloud.len()).map(|i| i * 1001 % cloud.len()).collect();
    let again: Vec<DVec3> = order.iter().map(|&i| moved(&places[i])).collect();
    let found = kept.for_discs(&again, radius).expect("the same discs");
    for (k, &i) in order.iter().enumerate() {
        assert_eq!(found.groups().by_disc()[k], grouped.groups().by_disc()[i]);
        assert_eq!(found.groups().further(k), grouped.groups().further(i));
    }
    // Other discs are not the same.
    let mut other = places.clone();
    other[17] += DVec3::X * 0.1 * radius;
    assert_eq!(kept.for_discs(&other, radius), None);
    assert_eq!(kept.for_discs(&places[1..], radius), None);
    assert_eq!(kept.for_discs(&places, 1.1 * radius), None);
}

#[test]
fn discs_at_one_place_keep_their_groups_between_them() {
    let cloud = one_place(500);
    let grouped = members(&cloud, Recipe { method: Method::Hash(Collisions::Resolve), ..RECIPE });
    let places = vec![DVec3::ONE; 500];
    let found = KeptGroups::new(&places, 0.24, grouped.clone()).for_discs(&places, 0.24).expect("the same discs");
    let count = |m: &Membership, g: u8| m.groups().by_disc().iter().filter(|group| **group == g).count();
    (0..4).for_each(|g| assert_eq!(count(&found, g), count(&grouped, g)));
}

#[test]
fn an_object_of_fewer_groups_is_in_every_image() {
    let part = |groups: u32, discs: usize| {
        let by_disc = (0..discs).map(|i| (i % groups as usize) as u8).collect();
        Membership::from(Groups::new(groups, by_disc).expect("below the count"))
    };
    let joined = Membership::join(10, &[(&[0, 1, 2, 3], part(2, 4)), (&[4, 5, 6, 7, 8], part(5, 5))]);
    assert_eq!(joined.groups().count(), 5);
    let images = |place: usize| (0..5).filter(|g| joined.groups().has(place, *g)).collect::<Vec<_>>();
    assert_eq!((images(0), images(1), images(6)), (vec![0, 2, 4], vec![1, 3], vec![2]));
    assert_eq!(images(9), [0], "the others are in group 0");
}

#[test]
fn what_overlaps_too_much_is_refused_and_hashing_takes_it() {
    let cloud = one_place(6000);
    let recipe = Recipe { coverage: Coverage::Bound, ..RECIPE };
    assert!(matches!(recipe.group(&cloud, None), Err(Error::Limit(_))));
    let kept = Recipe { method: Method::Hash(Collisions::Keep), ..recipe };
    assert_eq!(members(&cloud, kept).discs(), 6000);
    assert!(matches!(Recipe { groups: 0, ..kept }.group(&cloud, None), Err(Error::Parameter { .. })));
    assert!(kept.bytes(6000) < recipe.bytes(6000));
}
