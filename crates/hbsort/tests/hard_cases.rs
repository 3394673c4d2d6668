//! BS1 to BS9: the inputs that break a naive bucket sort.

use crate::common::{camera, depths, outdoor, slices_of};
use hbsort::{
    Direction, Error, Method, Params, Scratch, Thickness, ThicknessRule, reference, slice_cloud, slice_depths,
};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Splat, rng};

const DIRECTIONS: [Direction; 2] = [Direction::FrontToBack, Direction::BackToFront];

fn params(thickness: f64, direction: Direction, exact: bool) -> Params {
    Params { thickness: Thickness::World(thickness), direction, exact, ..Params::default() }
}

/// Sorts and compares with the reference, slice by slice and id by id.
fn agrees(depth: &[f32], params: &Params, scratch: &mut Scratch) -> Method {
    let order = slice_depths(depth, params, scratch).unwrap();
    let method = scratch.info().method;
    let by_depth = Params { exact: method == Method::DepthBits, ..*params };
    let (indices, expected): (Vec<u64>, Vec<Vec<u32>>) =
        reference::slices(depth, order.thickness, &by_depth).into_iter().unzip();
    assert_eq!(slices_of(&order), expected, "{params:?}");
    assert_eq!(order.slice_indices, indices, "{params:?}");
    scratch.recycle(order);
    method
}

#[test]
fn bs01_papers_two_levels_disagree_where_one_index_does_not() {
    let near = 0.01;
    let far = 10.0;
    for (thickness, share, inversion) in [(0.001, 0.02, 5.0), (0.0033, 0.5, 30.0)] {
        let depth: Vec<f32> = (0..50_000).map(|i| (near + (far - near) * rng::unit(1, 2, i, 3)) as f32).collect();
        let exact: Vec<f64> = depth.iter().map(|&d| f64::from(d)).collect();
        let paper = reference::paper_buckets(&exact, near, far, thickness);
        // The danger is real: the paper's indices leave their range, and the order is wrong by many slices.
        assert!(paper.out_of_range as f64 > share * 50_000.0, "{}", paper.out_of_range);
        assert!(reference::greatest_inversion(&exact, &paper.order) > inversion * thickness);

        let mut scratch = Scratch::new();
        let order = slice_depths(&depth, &params(thickness, Direction::FrontToBack, false), &mut scratch).unwrap();
        assert_eq!(u64::from(scratch.info().buckets), paper.buckets);
        assert!(reference::greatest_inversion(&exact, &order.input_from_sorted) <= thickness);
    }
}

/// Where the slices are a square, both of the paper's levels are ten wide, and its buckets are slices.
#[test]
fn bs01_papers_two_levels_agree_where_slices_are_a_square() {
    let depth: Vec<f64> = (0..1000).map(|i| (37 * i % 100) as f64 + 0.25 + 0.0005 * f64::from(i)).collect();
    let paper = reference::paper_buckets(&depth, 0.0, 100.0, 1.0);
    let mut expected: Vec<u32> = (0..1000).collect();
    expected.sort_by_key(|i| (depth[*i as usize] as u32, *i));
    assert_eq!(paper, reference::PaperBuckets { buckets: 10, out_of_range: 0, order: expected });
}

#[test]
fn bs01_the_papers_example_has_9990_slices_in_twice_100_buckets() {
    // From 0.01 to 10 by 0.001; the number below 10 that an f32 holds, so that rounding up does not find one slice more.
    let depth = [0.01f32, 5.0, 10f32.next_down()];
    let mut scratch = Scratch::new();
    // Fewer splats than slices would be sorted by the bits of their depths.
    let crowd: Vec<f32> = depths(100_000, 0.02, 9.9).into_iter().chain(depth).collect();
    let order = slice_depths(&crowd, &params(0.001, Direction::FrontToBack, false), &mut scratch).unwrap();
    assert_eq!((order.slices, scratch.info().method, scratch.info().buckets), (9990, Method::TwoLevels, 100));
}

#[test]
fn bs01_a_thousand_random_thicknesses_stay_within_one_slice() {
    let depth = depths(3000, 0.01, 10.0);
    let exact: Vec<f64> = depth.iter().map(|&d| f64::from(d)).collect();
    let mut scratch = Scratch::new();
    for i in 0..1000 {
        let thickness = 10f64.powf(-3.5 + 5.0 * rng::unit(5, 0, i, 0));
        let order = slice_depths(&depth, &params(thickness, Direction::FrontToBack, false), &mut scratch).unwrap();
        assert_eq!(order.input_from_sorted.len(), 3000);
        assert!(reference::greatest_inversion(&exact, &order.input_from_sorted) <= thickness);
        scratch.recycle(order);
    }
}

#[test]
fn bs02_far_and_its_neighbours_come_last() {
    let mut scratch = Scratch::new();
    for i in 0..2000 {
        let far = 10f32.powf(6.0 * rng::unit_f32(6, 0, i, 0) - 2.0);
        let thickness = f64::from(far) / (1.0 + 3000.0 * rng::unit(6, 1, i, 0));
        let depth = [far, far.next_down(), far * 0.5, 0.0, far.next_down().next_down()];
        for direction in DIRECTIONS {
            for exact in [false, true] {
                agrees(&depth, &params(thickness, direction, exact), &mut scratch);
            }
        }
    }
}

#[test]
fn bs03_all_at_one_depth_is_one_slice_in_the_order_of_ids() {
    let mut scratch = Scratch::new();
    for (n, depth) in [(1000, 5.0f32), (200_000, 1e-30), (70_000, -3.0), (500, 0.0)] {
        for exact in [false, true] {
            let order =
                slice_depths(&vec![depth; n], &params(0.1, Direction::BackToFront, exact), &mut scratch).unwrap();
            assert_eq!(order.input_from_sorted, (0..n as u32).collect::<Vec<_>>());
            assert_eq!((order.slices, order.slice_starts), (1, vec![0, n as u32]));
            assert_eq!((order.near, order.far), (depth, depth));
        }
    }
}

#[test]
fn bs04_more_slices_than_buckets_can_hold_are_sorted_by_depth_bits() {
    let depth: Vec<f32> = (0..150_000).map(|i| 10f32.powf(12.0 * rng::unit_f32(7, 0, i, 0) - 5.0)).collect();
    let mut scratch = Scratch::new();
    for direction in DIRECTIONS {
        assert_eq!(agrees(&depth, &params(1e-5, direction, false), &mut scratch), Method::DepthBits);
        // Even where the slice index itself saturates.
        assert_eq!(agrees(&depth, &params(1e-300, direction, false), &mut scratch), Method::DepthBits);
    }
    let order = slice_depths(&depth, &params(1e-5, Direction::FrontToBack, false), &mut scratch).unwrap();
    assert!(order.slices > 900_000_000_000);
}

#[test]
fn bs04_every_method_agrees_with_the_full_sort() {
    let mut scratch = Scratch::new();
    for n in [2, 100, 5000, 65_536, 65_537, 200_001] {
        let depth = depths(n, 0.5, 90.0);
        for direction in DIRECTIONS {
            for (thickness, exact) in [(1000.0, false), (2.0, false), (0.01, false), (2.0, true), (1e-3, true)] {
                agrees(&depth, &params(thickness, direction, exact), &mut scratch);
            }
            let few = Params { max_slices: 10, ..params(0.5, direction, false) };
            assert_eq!(agrees(&depth, &few, &mut scratch), Method::DepthBits);
        }
    }
}

#[test]
fn bs04_crowded_depths_need_no_more_memory() {
    // Half of all splats in a few ulps, a quarter at one depth, the rest over 30 orders of magnitude: crowds in one
    // range of keys, which no leaf holds.
    let depth: Vec<f32> = (0..300_000u64)
        .map(|i| match i % 4 {
            0 | 1 => f32::from_bits(1.0f32.to_bits() + (rng::bits(8, 0, i, 0) % 60_000) as u32),
            2 => 1.5,
            _ => 10f32.powf(30.0 * rng::unit_f32(8, 1, i, 0) - 15.0),
        })
        .collect();
    let mut scratch = Scratch::new();
    for direction in DIRECTIONS {
        assert_eq!(agrees(&depth, &params(1e-3, direction, true), &mut scratch), Method::DepthBits);
        // A crowd in one first-level bucket is ordered in parallel by depth bits, unless it is soon done anyway.
        let slices = params(1e10, direction, false);
        assert_eq!(agrees(&depth, &slices, &mut scratch), Method::DepthBits);
        assert_eq!(agrees(&depth[..200_000], &slices, &mut scratch), Method::TwoLevels);
    }
}

#[test]
fn bs04_crowds_of_few_keys_have_slices_too() {
    // Four crowds that no leaf holds among neighbouring keys, and as many splats on the keys around.
    let depth: Vec<f32> = (0..600_000u64)
        .map(|i| {
            let key = if i % 2 == 0 { 1000 + i / 2 % 4 } else { rng::bits(8, 2, i, 0) % 3000 };
            f32::from_bits(1.0f32.to_bits() + key as u32)
        })
        .collect();
    let mut scratch = Scratch::new();
    for (direction, keys) in DIRECTIONS.into_iter().zip([2.0, 700.0]) {
        let thickness = keys * f64::from(f32::EPSILON);
        assert_eq!(agrees(&depth, &params(thickness, direction, true), &mut scratch), Method::DepthBits);
    }
}

#[test]
fn bs04_more_than_half_of_the_splats_are_a_crowd() {
    // A hundred slices in ten buckets, the first of which has a share of all.
    for (share, expected) in [(0.35, Method::TwoLevels), (0.6, Method::DepthBits)] {
        let at = |i: u64| rng::unit_f32(8, 3, i, 0) * if rng::unit_f32(8, 4, i, 0) < share { 9.0 } else { 100.0 };
        let depth: Vec<f32> = (0..300_000).map(at).collect();
        let params = params(1.0, Direction::FrontToBack, false);
        assert_eq!(agrees(&depth, &params, &mut Scratch::new()), expected, "{share}");
    }
}

#[test]
fn bs05_one_tiny_splat_costs_no_slices() {
    let mut cloud = outdoor(20_000, DVec3::ZERO);
    cloud.radius.fill(1e-3);
    let camera = camera(DVec3::ZERO);
    let mut scratch = Scratch::new();
    let without = slice_cloud(&cloud, None, &camera, &Params::default(), &mut scratch).unwrap();
    assert_eq!(scratch.info().rule, ThicknessRule::SmallestRadius);
    assert_eq!(without.thickness, f64::from(1e-3f32));
    cloud.radius[12_345] = 1e-9;
    let with = slice_cloud(&cloud, None, &camera, &Params::default(), &mut scratch).unwrap();
    assert_eq!(scratch.info().rule, ThicknessRule::Percentile);
    assert!(with.slices <= 2 * without.slices, "{} and {}", with.slices, without.slices);
}

#[test]
fn bs06_a_scene_far_from_the_origin_is_sorted_as_one_at_it() {
    let mut scratch = Scratch::new();
    let [here, there] = [DVec3::ZERO, DVec3::splat(1e7)].map(|origin| {
        let cloud = outdoor(30_000, origin);
        slice_cloud(&cloud, None, &camera(origin), &Params::default(), &mut scratch).unwrap()
    });
    // The camera's axes come from another target − position, rounded at 1e7: equal up to slices that touch.
    assert_eq!(here.input_from_sorted.len(), there.input_from_sorted.len());
    assert!((here.near - there.near).abs() < 1e-5 && (here.far - there.far).abs() < 1e-4);
    let places = |order: &[u32]| {
        let mut place = vec![0usize; 30_000];
        order.iter().enumerate().for_each(|(k, &id)| place[id as usize] = k);
        place
    };
    let a = places(&here.input_from_sorted);
    let b = places(&there.input_from_sorted);
    let greatest = a.iter().zip(&b).map(|(a, b)| a.abs_diff(*b)).max().unwrap();
    assert!(greatest < 100, "{greatest} places of 30000");
}

#[test]
fn bs06_the_same_camera_at_ten_million_gives_the_same_bits() {
    // Powers of two, so that position and camera are exact at both places.
    let shift = DVec3::splat((1u64 << 23) as f64);
    let mut scratch = Scratch::new();
    let cloud = outdoor(30_000, DVec3::ZERO);
    let mut moved = cloud.clone();
    moved.origin = shift;
    let eye = camera(DVec3::ZERO);
    let moved_eye = splat_core::Camera { position: eye.position + shift, ..eye };
    let here = slice_cloud(&cloud, None, &eye, &Params::default(), &mut scratch).unwrap();
    let there = slice_cloud(&moved, None, &moved_eye, &Params::default(), &mut scratch).unwrap();
    assert_eq!(here, there);
}

#[test]
fn bs07_every_splat_is_kept_or_culled() {
    let mut cloud = outdoor(40_000, DVec3::ZERO);
    let camera = camera(DVec3::ZERO);
    let mut scratch = Scratch::new();
    // Not valid clouds, but they must not break the sort either.
    for (i, bad) in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, 3e38].into_iter().enumerate() {
        cloud.position[1000 * i] = Vec3::splat(bad);
    }
    let order = slice_cloud(&cloud, None, &camera, &Params::default(), &mut scratch).unwrap();
    assert_eq!(order.input_from_sorted.len() as u64 + order.culled, 40_000);
    let mut seen = order.input_from_sorted.clone();
    seen.sort_unstable();
    let kept: Vec<u32> = (0..40_000).filter(|&i| reference::margin_inside(&cloud, i as usize, &camera) > 0.0).collect();
    // f32 against f64: only splats that touch a plane within rounding may differ, and here none does.
    assert_eq!(seen, kept);
    assert!(order.culled > 5000 && kept.len() > 5000);
    assert!([0, 1000, 2000].iter().all(|i| !seen.contains(i)));
}

#[test]
fn bs07_depths_that_are_no_numbers_are_refused() {
    let mut scratch = Scratch::new();
    for bad in [f32::NAN, -f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
        for index in [0, 17, 99_999] {
            let mut depth = vec![1.0; 100_000];
            depth[index] = bad;
            let refused = slice_depths(&depth, &params(0.1, Direction::FrontToBack, false), &mut scratch);
            assert!(matches!(refused, Err(Error::Depth { index: at, .. }) if at == index));
        }
    }
}

#[test]
fn bs08_ties_stand_in_the_order_of_their_ids() {
    // 50 depths only, −0 and +0 among them.
    let depth: Vec<f32> = (0..90_000)
        .map(|i| (rng::bits(9, 0, i, 0) % 50) as f32 - 25.0)
        .map(|d| if d == 0.0 && d.to_bits() == 0 { -0.0 } else { d })
        .enumerate()
        .map(|(i, d)| if d == 0.0 && i % 2 == 0 { 0.0 } else { d })
        .collect();
    let mut scratch = Scratch::new();
    for direction in DIRECTIONS {
        for exact in [false, true] {
            let order = slice_depths(&depth, &params(0.25, direction, exact), &mut scratch).unwrap();
            assert_eq!(order.non_empty_slices(), 50);
            for k in 0..50 {
                assert!(order.slice(k).windows(2).all(|w| w[0] < w[1]));
            }
            agrees(&depth, &params(0.25, direction, exact), &mut scratch);
        }
    }
}

#[test]
fn bs08_shuffled_input_gives_the_same_order_of_splats() {
    let cloud = outdoor(20_000, DVec3::ZERO);
    let mut order: Vec<u32> = (0..20_000).collect();
    order.sort_by_key(|&i| rng::bits(3, 3, u64::from(i), 0));
    let mut shuffled = cloud.gather(&order);
    assert_ne!(shuffled, cloud);
    shuffled.canonicalize();
    let camera = camera(DVec3::ZERO);
    let mut scratch = Scratch::new();
    let a = slice_cloud(&cloud, None, &camera, &Params::default(), &mut scratch).unwrap();
    let b = slice_cloud(&shuffled, None, &camera, &Params::default(), &mut scratch).unwrap();
    assert_eq!(a, b);
}

#[test]
fn bs09_nothing_in_nothing_out() {
    let camera = camera(DVec3::ZERO);
    let mut scratch = Scratch::new();
    let empty = slice_cloud(&Cloud::new(DVec3::ZERO), None, &camera, &Params::default(), &mut scratch).unwrap();
    assert_eq!((empty.non_empty_slices(), empty.slices, empty.culled), (0, 0, 0));
    let empty = slice_depths(&[], &params(0.1, Direction::FrontToBack, true), &mut scratch).unwrap();
    assert_eq!(empty.non_empty_slices(), 0);

    let mut behind = Cloud::new(DVec3::ZERO);
    for i in 0..10 {
        let position = Vec3::new(0.0, 0.0, 20.0 + i as f32);
        behind.push(&Splat { position, radius: 0.1, ..Splat::default() });
    }
    let order = slice_cloud(&behind, None, &camera, &Params::default(), &mut scratch).unwrap();
    assert_eq!((order.non_empty_slices(), order.input_from_sorted.len(), order.culled), (0, 0, 10));
    assert_eq!(scratch.info().method, Method::None);

    let order = slice_depths(&[4.0], &params(0.1, Direction::BackToFront, false), &mut scratch).unwrap();
    assert_eq!((slices_of(&order), order.near, order.far, order.slices), (vec![vec![0]], 4.0, 4.0, 1));
    // What the scratch holds from another sort is told all the same.
    let held = scratch.info().bytes;
    slice_cloud(&behind, None, &camera, &Params::default(), &mut scratch).unwrap();
    assert_eq!((scratch.info().items_in, scratch.info().bytes), (10, held));
    assert!(held > 0);
    let none = slice_cloud(&behind, Some(&[]), &camera, &Params::default(), &mut scratch).unwrap();
    assert_eq!((none.non_empty_slices(), none.culled), (0, 0));
}
