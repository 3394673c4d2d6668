//! Slices along an axis: the reference's, the view's where the axis is the view's, and what is refused.

use crate::common::{camera, outdoor, slices_of};
use hbsort::{Direction, Error, Params, Scratch, SliceAxis, Thickness, reference, slice_along, slice_cloud};
use splat_core::Cloud;
use splat_core::glam::{DVec3, Vec3};

const FAR: DVec3 = DVec3::new(1.0e7, -3.0e6, 2.0e7);

fn half_vector() -> SliceAxis {
    SliceAxis { origin: FAR + DVec3::new(1.0, 2.0, -3.0), direction: DVec3::new(0.3, -0.8, 0.5).normalize() }
}

/// Distances in f64 from the places as they are.
fn distances(cloud: &Cloud, axis: &SliceAxis) -> Vec<f64> {
    let relative = cloud.origin - axis.origin;
    cloud.position.iter().map(|p| (relative + p.as_dvec3()).dot(axis.direction)).collect()
}

#[test]
fn slices_across_a_half_vector_are_those_of_the_reference() {
    let cloud = outdoor(60_000, FAR);
    let axis = half_vector();
    let mut scratch = Scratch::new();
    let exact_distances = distances(&cloud, &axis);
    for direction in [Direction::FrontToBack, Direction::BackToFront] {
        for (thickness, exact) in [(0.05, false), (0.05, true), (1e-6, true), (1e3, false)] {
            let params = Params { direction, exact, thickness: Thickness::World(thickness), ..Params::default() };
            let order = slice_along(&cloud, None, &axis, &params, &mut scratch).unwrap();
            assert_eq!((order.input_from_sorted.len(), order.culled), (cloud.len(), 0));
            // The one rounding to f32 apart, every centre lies in the range of depth of its slice.
            let rounding = f64::from(order.far.abs().max(order.near.abs())) * f64::from(f32::EPSILON);
            for k in 0..order.non_empty_slices() {
                let [low, high] = order.depth_range(k);
                assert!(low <= high);
                let inside = |i: &u32| (low - rounding..=high + rounding).contains(&exact_distances[*i as usize]);
                assert!(order.slice(k).iter().all(inside), "slice {k} from {low} to {high}, {params:?}");
            }
            let rounded: Vec<f32> = exact_distances.iter().map(|d| *d as f32).collect();
            let (indices, slices): (Vec<u64>, Vec<Vec<u32>>) =
                reference::slices(&rounded, thickness, &params).into_iter().unzip();
            assert!(slices_of(&order) == slices && order.slice_indices == indices, "{params:?}");
        }
    }
}

#[test]
fn an_axis_along_the_view_gives_the_slices_of_the_view() {
    let mut cloud = outdoor(20_000, DVec3::ZERO);
    // In eighths, so that depths have no rounding and both give the same bits.
    cloud.position.iter_mut().for_each(|p| *p = (*p * 8.0).round() / 8.0);
    let eye = DVec3::new(0.0, 4.0, 64.0);
    let view = splat_core::Projection::Orthographic { height: 1000.0 };
    let camera = splat_core::Camera::look_at(eye, eye - DVec3::Z, DVec3::Y, view, [64, 64]).unwrap();
    let axis = SliceAxis { origin: eye, direction: -DVec3::Z };
    let mut scratch = Scratch::new();
    for exact in [false, true] {
        let params = Params { exact, ..Params::default() };
        let by_view = slice_cloud(&cloud, None, &camera, &params, &mut scratch).unwrap();
        assert!(by_view.non_empty_slices() > 100 && by_view.culled == 0);
        assert_eq!(slice_along(&cloud, None, &axis, &params, &mut scratch).unwrap(), by_view);
        let ids: Vec<u32> = (0..20_000).filter(|i| i % 7 < 3).collect();
        let by_view = slice_cloud(&cloud, Some(&ids), &camera, &params, &mut scratch).unwrap();
        assert_eq!(slice_along(&cloud, Some(&ids), &axis, &params, &mut scratch).unwrap(), by_view);
    }
}

#[test]
fn a_slice_is_found_by_its_depth_range_whatever_the_order() {
    let cloud = outdoor(50_000, DVec3::ZERO);
    let camera = camera(DVec3::ZERO);
    let mut scratch = Scratch::new();
    let view = camera.view_from_offset(cloud.origin);
    for direction in [Direction::FrontToBack, Direction::BackToFront] {
        for (thickness, exact) in [(0.02, false), (0.02, true), (1e-7, false)] {
            let params = Params { direction, exact, thickness: Thickness::World(thickness), ..Params::default() };
            let order = slice_cloud(&cloud, None, &camera, &params, &mut scratch).unwrap();
            assert_eq!(order.slice_indices.len(), order.non_empty_slices());
            let ascending = order.slice_indices.windows(2).all(|w| w[0] < w[1]);
            let descending = order.slice_indices.windows(2).all(|w| w[0] > w[1]);
            assert!(if direction == Direction::FrontToBack { ascending } else { descending });
            for k in 0..order.non_empty_slices() {
                let [low, high] = order.depth_range(k);
                let rounding = 1e-12 * f64::from(order.far);
                let depth = |i: &u32| f64::from(view.depth(cloud.position[*i as usize]));
                let inside = |i: &u32| (low - rounding..=high + rounding).contains(&depth(i));
                assert!(order.slice(k).iter().all(inside), "slice {k} from {low} to {high}, {params:?}");
            }
        }
    }
}

#[test]
fn what_is_no_axis_is_refused_and_what_is_no_number_left_out() {
    let mut cloud = outdoor(1000, FAR);
    let params = Params::default();
    let mut scratch = Scratch::new();
    for direction in [DVec3::ZERO, DVec3::X * 1.001, DVec3::NAN, DVec3::INFINITY] {
        let axis = SliceAxis { direction, ..half_vector() };
        assert!(matches!(slice_along(&cloud, None, &axis, &params, &mut scratch), Err(Error::Axis { .. })));
    }
    let axis = SliceAxis { origin: DVec3::NAN, ..half_vector() };
    assert!(matches!(slice_along(&cloud, None, &axis, &params, &mut scratch), Err(Error::Axis { .. })));
    cloud.position[3] = Vec3::new(0.0, f32::NAN, 0.0);
    cloud.position[500] = Vec3::INFINITY;
    let order = slice_along(&cloud, None, &half_vector(), &params, &mut scratch).unwrap();
    assert_eq!((order.culled, order.input_from_sorted.len()), (2, 998));
    assert!(!order.input_from_sorted.contains(&3) && !order.input_from_sorted.contains(&500));
}
