//! Promises beside the order: same bits on any number of threads, memory, subsets, culling, errors, scaling.

use crate::common::{camera, depths, outdoor, slices_of};
use hbsort::{Direction, Error, Method, Params, Scratch, Thickness, cost, reference, slice_cloud, slice_depths};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Camera, Cloud, Projection, Splat};

fn world(thickness: f64, exact: bool) -> Params {
    Params { thickness: Thickness::World(thickness), exact, ..Params::default() }
}

#[test]
fn x1_any_number_of_threads_gives_the_same_bits() {
    let cloud = outdoor(200_000, DVec3::ZERO);
    let camera = camera(DVec3::ZERO);
    for params in [Params::default(), Params { exact: true, ..Params::default() }, world(1e-7, false)] {
        let orders: Vec<_> = [1, 2, 3, 7]
            .into_iter()
            .map(|threads| {
                let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
                pool.install(|| slice_cloud(&cloud, None, &camera, &params, &mut Scratch::new()).unwrap())
            })
            .collect();
        assert!(orders[0].non_empty_slices() > 1000);
        assert!(orders.windows(2).all(|w| w[0] == w[1]));
    }
}

#[test]
fn the_cloud_and_its_depths_give_the_same_order() {
    let cloud = outdoor(100_000, DVec3::ZERO);
    let camera = camera(DVec3::ZERO);
    let view = camera.view_from_offset(cloud.origin);
    let mut scratch = Scratch::new();
    for params in [world(0.004, false), world(0.004, true), world(1e-7, false)] {
        let order = slice_cloud(&cloud, None, &camera, &params, &mut scratch).unwrap();
        let mut kept = order.input_from_sorted.clone();
        kept.sort_unstable();
        let depth: Vec<f32> = kept.iter().map(|&i| view.depth(cloud.position[i as usize])).collect();
        let from_depths = slice_depths(&depth, &params, &mut scratch).unwrap();
        let named: Vec<u32> = from_depths.input_from_sorted.iter().map(|&k| kept[k as usize]).collect();
        assert_eq!(named, order.input_from_sorted);
        assert_eq!(from_depths.slice_starts, order.slice_starts);
        assert_eq!(from_depths.slice_indices, order.slice_indices);
        assert_eq!((from_depths.near, from_depths.far), (order.near, order.far));
    }
}

#[test]
fn a_subset_is_sorted_as_a_cloud_of_its_own() {
    let cloud = outdoor(100_000, DVec3::ZERO);
    let camera = camera(DVec3::ZERO);
    let ids: Vec<u32> = (0..100_000).filter(|i| i % 7 < 3).collect();
    let mut scratch = Scratch::new();
    for exact in [false, true] {
        let params = Params { exact, ..Params::default() };
        let subset = slice_cloud(&cloud, Some(&ids), &camera, &params, &mut scratch).unwrap();
        let gathered = slice_cloud(&cloud.gather(&ids), None, &camera, &params, &mut scratch).unwrap();
        let named: Vec<u32> = gathered.input_from_sorted.iter().map(|&k| ids[k as usize]).collect();
        assert_eq!(subset.input_from_sorted, named);
        assert_eq!((subset.slice_starts, subset.culled), (gathered.slice_starts, gathered.culled));
    }
}

#[test]
fn memory_is_what_cost_predicts_and_eight_bytes_a_splat_beside_buckets() {
    let depth = depths(3_000_000, 0.5, 90.0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().unwrap();
    pool.install(|| {
        for (params, bytes_a_splat) in [(world(0.01, false), 4), (world(0.01, true), 8)] {
            let mut scratch = Scratch::new();
            let order = slice_depths(&depth, &params, &mut scratch).unwrap();
            let info = *scratch.info();
            assert_eq!(info.buckets as usize, cost::buckets(info.method, depth.len(), order.slices));
            let predicted = cost::scratch_bytes(info.method, depth.len(), info.buckets as usize, 2);
            assert_eq!((info.bytes, scratch.bytes()), (predicted, predicted));
            let buckets = cost::bucket_bytes(info.method, depth.len(), info.buckets as usize, 2);
            assert_eq!(predicted - buckets, bytes_a_splat * depth.len() as u64);
            assert!(buckets < depth.len() as u64 / 2, "{buckets}");
        }
    });
}

#[test]
fn a_recycled_order_is_filled_again_without_allocation() {
    let depth = depths(100_000, 0.5, 90.0);
    let mut scratch = Scratch::new();
    for exact in [false, true] {
        let first = slice_depths(&depth, &world(0.01, exact), &mut scratch).unwrap();
        let expected = first.clone();
        let buffers = (first.input_from_sorted.as_ptr(), first.slice_starts.as_ptr());
        let bytes = scratch.bytes();
        scratch.recycle(first);
        let second = slice_depths(&depth, &world(0.01, exact), &mut scratch).unwrap();
        assert_eq!((second.input_from_sorted.as_ptr(), second.slice_starts.as_ptr()), buffers);
        assert_eq!(scratch.bytes(), bytes);
        assert_eq!(second, expected);
    }
}

#[test]
fn orthographic_views_and_margins_cull_as_the_reference_does() {
    let cloud = outdoor(30_000, DVec3::ZERO);
    let view = Projection::Orthographic { height: 12.0 };
    let eye = DVec3::new(3.0, 9.0, 4.0);
    let camera = Camera::look_at(eye, DVec3::new(0.0, 0.0, -15.0), DVec3::Y, view, [300, 200]).unwrap();
    let mut scratch = Scratch::new();
    let mut kept = slice_cloud(&cloud, None, &camera, &Params::default(), &mut scratch).unwrap().input_from_sorted;
    kept.sort_unstable();
    let inside = |camera: &Camera| {
        (0..30_000u32).filter(|&i| reference::margin_inside(&cloud, i as usize, camera) > 0.0).collect::<Vec<_>>()
    };
    assert_eq!(kept, inside(&camera));
    assert!(kept.len() > 1000 && kept.len() < 29_000);

    // A margin of 50 pixels is the view of an image that is 100 pixels larger.
    let params = Params { margin_px: 50.0, ..Params::default() };
    let mut wide = slice_cloud(&cloud, None, &camera, &params, &mut scratch).unwrap().input_from_sorted;
    wide.sort_unstable();
    let wider = Camera { projection: Projection::Orthographic { height: 18.0 }, size: [400, 300], ..camera };
    assert_eq!(wide, inside(&wider));
    assert!(wide.len() > kept.len());
}

#[test]
fn a_splat_that_reaches_into_the_view_is_kept() {
    let view = Projection::Perspective { fov_y: std::f64::consts::FRAC_PI_2 };
    let camera = Camera::look_at(DVec3::ZERO, DVec3::NEG_Z, DVec3::Y, view, [100, 100]).unwrap();
    let kept = |position: Vec3, radius: f32, tangent: Vec3| {
        let mut cloud = Cloud::new(DVec3::ZERO);
        cloud.push(&Splat { position, radius, tangent, ..Splat::default() });
        slice_cloud(&cloud, None, &camera, &Params::default(), &mut Scratch::new()).unwrap().culled == 0
    };
    // The plane x = z at 45° is √½ away from (11, 0, 10).
    assert!(kept(Vec3::new(11.0, 0.0, -10.0), 0.708, Vec3::ZERO));
    assert!(!kept(Vec3::new(11.0, 0.0, -10.0), 0.706, Vec3::ZERO));
    // The longer semi-axis of an elliptical disc counts.
    assert!(kept(Vec3::new(11.0, 0.0, -10.0), 0.1, Vec3::new(0.708, 0.0, 0.0)));
    assert!(!kept(Vec3::new(11.0, 0.0, -10.0), 0.1, Vec3::new(0.706, 0.0, 0.0)));
    // The eye plane.
    assert!(kept(Vec3::new(0.0, 0.0, 0.5), 0.51, Vec3::ZERO));
    assert!(!kept(Vec3::new(0.0, 0.0, 0.5), 0.49, Vec3::ZERO));
}

#[test]
fn x3_scaling_by_a_power_of_two_changes_no_bit_of_the_order() {
    let cloud = outdoor(50_000, DVec3::ZERO);
    let eye = camera(DVec3::ZERO);
    let mut scratch = Scratch::new();
    for exact in [false, true] {
        let params = Params { exact, ..Params::default() };
        let plain = slice_cloud(&cloud, None, &eye, &params, &mut scratch).unwrap();
        for scale in [2f32.powi(-40), 2f32.powi(-10), 2f32.powi(10), 2f32.powi(40)] {
            let mut scaled = cloud.clone();
            scaled.position.iter_mut().for_each(|p| *p *= scale);
            scaled.radius.iter_mut().for_each(|r| *r *= scale);
            let scaled_eye = Camera { position: eye.position * f64::from(scale), ..eye };
            let order = slice_cloud(&scaled, None, &scaled_eye, &params, &mut scratch).unwrap();
            assert_eq!(order.input_from_sorted, plain.input_from_sorted);
            assert_eq!(order.slice_starts, plain.slice_starts);
            assert_eq!(order.slice_indices, plain.slice_indices);
            assert_eq!((order.near, order.thickness), (plain.near * scale, plain.thickness * f64::from(scale)));
        }
    }
}

#[test]
fn impossible_parameters_and_subsets_are_refused() {
    let mut scratch = Scratch::new();
    for thickness in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-310] {
        let refused = slice_depths(&[1.0, 2.0], &world(thickness, false), &mut scratch);
        assert!(matches!(refused, Err(Error::Thickness { .. })), "{thickness}");
    }
    assert_eq!(slice_depths(&[1.0], &Params::default(), &mut scratch), Err(Error::NoRadii));
    let cloud = outdoor(100, DVec3::ZERO);
    for (ids, at) in [(&[3u32, 3][..], 1), (&[5, 4], 1), (&[0, 1, 100], 2)] {
        let refused = slice_cloud(&cloud, Some(ids), &camera(DVec3::ZERO), &Params::default(), &mut scratch);
        assert!(matches!(refused, Err(Error::Ids { index, len: 100, .. }) if index == at));
    }
}

#[test]
fn slices_never_make_more_buckets_than_splats_pay_for() {
    // Beyond, the depth bits take over.
    let depth = depths(1000, 0.0, 1.0);
    let mut scratch = Scratch::new();
    let order = slice_depths(&depth, &world(1e-6, false), &mut scratch).unwrap();
    assert_eq!((order.slices, scratch.info().method), (1_000_000, Method::DepthBits));
    assert_eq!(slices_of(&order).len(), order.non_empty_slices());
    assert_eq!(order.direction, Direction::BackToFront);
}
