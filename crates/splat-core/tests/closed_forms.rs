//! What small functions say, in closed form: orders, bounds, counts of bytes, costs, lights at their limits.

use glam::{DVec3, Vec3};
use splat_core::{
    Clip, Cloud, CostRecord, DAabb, DepthProfile, Error, FootprintImage, Gaussians, Incidence, Light, LightShape,
    ScalarField, SliceOrder, Splat, StageCost,
};
use std::f64::consts::FRAC_PI_2;

#[test]
fn canonical_order_goes_octant_by_octant_and_along_x_first() {
    let mut cloud = Cloud::new(DVec3::ZERO);
    for i in (0..64u32).rev() {
        let position = Vec3::from_array([i % 4, i / 4 % 4, i / 16].map(|n| n as f32));
        cloud.push(&Splat { position, ..Splat::default() });
    }
    cloud.canonicalize();
    // Two bits an axis: those of 1 of x, y and z, then those of 2.
    for (rank, found) in cloud.position.iter().enumerate() {
        let axis = |k: usize| (rank >> k & 1) + 2 * (rank >> (k + 3) & 1);
        assert_eq!(*found, Vec3::from_array([0, 1, 2].map(|k| axis(k) as f32)), "{rank}");
    }
}

#[test]
fn a_box_is_its_half_spaces_wherever_it_lies() {
    let min = DVec3::new(1.0, 2.0, 3.0);
    let max = DVec3::new(1.5, 4.0, 3.25);
    let bounds = DAabb::new(min, max);
    for i in 0..343u32 {
        let p = min - 0.25 + DVec3::from_array([i % 7, i / 7 % 7, i / 49].map(f64::from)) * 0.25;
        let inside = (0..3).all(|k| min[k] <= p[k] && p[k] <= max[k]);
        assert_eq!(bounds.contains(p), inside, "{p}");
        let of_all = Clip::Box(bounds).half_spaces().all(|(normal, offset)| normal.dot(p) <= offset);
        assert_eq!(of_all, inside, "{p}");
    }
}

#[test]
fn stages_of_one_name_add_up_and_the_others_stay() {
    let stage = |name: &str, n: u64| StageCost {
        name: name.to_owned(),
        seconds: 0.5 * n as f64,
        items_in: n,
        items_out: 10 * n,
        fragments: 100 * n,
        bytes: 1000 * n,
        passes: 1,
    };
    let mut cost = CostRecord { stages: vec![stage("a", 1), stage("b", 3), stage("a", 2)] };
    cost.join("a");
    let sum = StageCost { bytes: 2000, passes: 2, ..stage("a", 3) };
    assert_eq!(cost.stages, [stage("b", 3), sum]);
}

#[test]
fn bytes_are_those_of_their_numbers() {
    // Three vectors, an opacity, and a colour of three numbers for each spherical harmonic: 1, 4, 9, 16.
    for degree in 0..=3u8 {
        let harmonics = (u64::from(degree) + 1).pow(2);
        assert_eq!(Gaussians::bytes_each(degree), 36 + 4 + 12 * harmonics);
    }
    let order = SliceOrder {
        input_from_sorted: vec![2, 0, 1],
        slice_starts: vec![0, 1, 3],
        slice_indices: vec![4, 9],
        ..SliceOrder::default()
    };
    assert_eq!((order.bytes(), order.non_empty_slices()), (4 * 3 + 4 * 3 + 8 * 2, 2));
    assert_eq!(FootprintImage::new([3, 2], &[1.0; 6]).unwrap().size(), [3, 2]);
}

#[test]
fn a_cone_that_ends_at_once_lights_its_edge_and_none_is_a_half_space() {
    let spot = |inner: f64, outer: f64| Light {
        shape: LightShape::Spot { position: DVec3::ZERO, direction: DVec3::Z, inner, outer },
        intensity: [1.0; 3],
    };
    let sharp = spot(0.0, 0.0);
    assert_eq!(sharp.irradiance(DVec3::Z * 2.0, 0.0), Incidence { to_light: -DVec3::Z, irradiance: [0.25; 3] });
    assert_eq!(sharp.irradiance(DVec3::new(0.1, 0.0, 2.0), 0.0).irradiance, [0.0; 3]);
    assert!(spot(0.1, FRAC_PI_2 - 1e-9).validate(0).is_ok());
    assert!(matches!(spot(0.1, FRAC_PI_2).validate(0), Err(Error::Invalid { attribute: "cone", .. })));
}

#[test]
fn a_profile_without_matter_has_no_depths_and_one_behind_another_keeps_its_own() {
    let nothing = DepthProfile::of_depths(1.0, 2.0, 3.0, 0.5, 0.0);
    assert_eq!(nothing.depths(0.0, None), [f32::INFINITY; 4]);
    // A thin veil, and behind it what has its light uniformly from 4 to 6: mean 5, σ = 1/√3, a median that is not reached by either alone.
    let mut veil = DepthProfile::of_depths(1.0, f32::INFINITY, 1.0, 0.0, 0.5);
    let behind = DepthProfile::of_depths(4.5, f32::INFINITY, 5.0, 1.0 / 3f32.sqrt(), 0.5);
    veil.append(&behind, 0.5, 0.5);
    let [first, median, mean, _] = veil.depths(1.0, None);
    let before = 1.0 - (-0.5f32).exp();
    let share = (-0.5f32).exp() * before / (before + (-0.5f32).exp() * before);
    assert!(first == 1.0 && (mean - (1.0 + 4.0 * share)).abs() < 1e-5, "{first} {mean}");
    // Linear from the first depth, of an optical depth of 0.0039, to the last: ln 2 − 0.5 of 0.5.
    let level = (std::f32::consts::LN_2 - 0.5 - 0.003_929) / (0.5 - 0.003_929);
    assert!((median - (4.5 + 0.5 * level)).abs() < 1e-3, "{median}");
    // Before its first depth it begins where a box of its deviation does, here at 4.
    let mut thin = DepthProfile::of_depths(f32::INFINITY, f32::INFINITY, 1.0, 0.0, 0.002);
    thin.append(&behind, 0.002, 0.5);
    let [first, ..] = thin.depths(0.502, None);
    let level = (0.003_929_3 - 0.002) / 0.003_929_3;
    assert!((first - (4.0 + 0.5 * level)).abs() < 1e-3, "{first}");
}

#[test]
fn a_field_without_a_border_is_defined_everywhere() {
    struct Plane;
    impl ScalarField for Plane {
        fn value(&self, p: DVec3) -> f64 {
            p.z
        }
        fn gradient(&self, _: DVec3) -> DVec3 {
            DVec3::Z
        }
        fn bound(&self, p: DVec3, radius: f64) -> Option<(f64, f64)> {
            Some((p.z - radius, p.z + radius))
        }
    }
    assert!(Plane.in_domain(DVec3::ONE) && Plane.may_be_in_domain(DVec3::ONE, 0.5));
}
