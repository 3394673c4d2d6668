//! What half precision does to sums of many thin splats.

use glam::DVec3;
use splat_core::raster::{Accumulation, Detail, FoldInput, OpaqueImage, Params, ProjectInput, fold, project};
use splat_core::{Accumulator, Camera, Cloud, Direction, FootprintStack, Material, Projection, Splat};

/// Optical depth and first channel after `count` splats of cross-section `k` over one pixel.
fn stack(k: f32, count: usize, accumulation: Accumulation) -> (f32, f32) {
    let mut cloud = Cloud::new(DVec3::ZERO);
    cloud.push(&Splat { radius: 1.0, cross_section: k, ..Splat::default() });
    let view = Projection::Orthographic { height: 1.0 };
    let camera = Camera::look_at(DVec3::Z * 4.0, DVec3::ZERO, DVec3::Y, view, [1, 1]).unwrap();
    let materials = [Material::default()];
    let params = Params { accumulation, ..Params::default() };
    let projected = project(&ProjectInput {
        cloud: &cloud,
        camera: &camera,
        footprints: &FootprintStack::default(),
        materials: &materials,
        params: &params,
        detail: Detail::ALL,
    });
    let mut acc = Accumulator::new([1, 1], 1, 3, false, false);
    let input = FoldInput {
        projected: &projected,
        order: &vec![0; count],
        values: &[1.0; 3],
        materials: &materials,
        opaque: &OpaqueImage::default(),
        direction: Direction::FrontToBack,
        params: &params,
    };
    fold(&input, &mut acc, None).unwrap();
    (acc.optical_depth[0][0], acc.channels[0][0])
}

#[test]
fn half_precision_stalls_where_single_precision_goes_on() {
    let k = 4e-4 / stack(1.0, 1, Accumulation::F32).0;
    let (depth, color) = stack(k, 10_000, Accumulation::F32);
    assert!((depth - 4.0).abs() < 1e-3 && (color - (1.0 - (-4.0f32).exp())).abs() < 1e-4, "{depth} {color}");
    // From 1 on, 4·10⁻⁴ is less than half of 2⁻¹⁰: the sum stands still, and so does the transmittance.
    let (depth, color) = stack(k, 10_000, Accumulation::F16);
    assert_eq!(depth, 1.0);
    assert!(color < 0.65, "{color}");
}
