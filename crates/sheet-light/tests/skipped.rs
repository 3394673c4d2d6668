//! Voxels that are left out are those that cannot matter: with all of them the picture is the same.

use crate::common::{
    apart, bcc_volume, body_centred, cubic, draw, exact, grid, input, noise, parallel, perspective, transfer, volume,
};
use crate::twin::Slope;
use sheet_light::{KernelShape, Params, Volume};
use splat_core::glam::{DMat3, DVec3};
use splat_core::shade::LitBy;
use splat_core::{Camera, Light, LightShape, Material, TransferFunction};

/// Control points that show what is above 0.6, each decade otherwise; below it nothing, or so little that no one sees it though it counts as shown.
fn above(nothing: f32) -> TransferFunction {
    transfer(&[(0.6, nothing), (10.0, 3.0), (1e3, 0.5), (1e5, 3.0), (1e7, 0.5)])
}

/// Voxels that are far below what is shown, and so much alike that those which continue them beyond the faces are, too.
fn deep(p: DVec3) -> f64 {
    -100.0 - 4.0 * noise(p)
}

/// So high that a voxel shows to the rim of its kernel.
const HIGH: f32 = 1e8;

/// Makes some voxels high, none of them near another or a face. Which the last is.
fn with_high(values: &mut [f32], dims: [usize; 3]) -> [usize; 3] {
    let all = [[3, 4, 6], [5, 3, 3], [4, 6, 4], [6, 5, 5]].map(|at| [0, 1, 2].map(|a| at[a] * dims[a] / 10));
    all.iter().for_each(|[i, j, k]| values[(k * dims[1] + j) * dims[0] + i] = HIGH);
    all[3]
}

/// Askew to all axes: with parallel rays, with rays that are nearly so, and with `high` so near to a corner of the picture that its kernel ends there and
/// rays are slanted most. Each with or without normals.
fn views(high: DVec3) -> [(Camera, bool); 3] {
    let from = [3.0, 2.0, 8.0];
    let fov = 40.0;
    let size = [64, 56];
    let wide = perspective(from, fov, size);
    let half = (high - wide.position).length() * (0.5 * fov).to_radians().tan();
    let target = high - (wide.axes[0] * half * 64.0 / 56.0 + wide.axes[1] * half) * 0.73;
    let corner = Camera::look_at(wide.position, target, DVec3::Y, wide.projection, size).unwrap();
    [(parallel(from, 5.0, size), true), (perspective(from.map(|v| 8.0 * v), 4.5, size), false), (corner, true)]
}

/// A few high voxels in a deep field: what shows are their kernels to the rim, where values are those of voxels as far away on the other side. One that
/// is left out wrongly is missed there, by the value, or by the gradient, or where a shadow is interpolated.
fn is_drawn_as_with_all(volume: Volume<'_>, high: DVec3, kernel: KernelShape) {
    let few = above(0.0);
    let all = above(1e-9);
    // Thin slabs: what a neighbourhood has beyond two kernels is a small part of a step.
    let params = Params { slab_width: Some(0.02), kernel, ..exact() };
    let shape = LightShape::Directional { direction: DVec3::new(-1.0, -2.0, -1.5).normalize() };
    let lights = [LitBy { slide: None, light: Light { shape, intensity: [2.0, 1.5, 1.0] }, shadow: Some(&Slope as _) }];
    for (camera, normals) in views(high) {
        let with = |transfer| {
            let volumes = [Volume { transfer, normals, ..volume }];
            draw(&input(&volumes, &camera, &lights), &params).unwrap()
        };
        let (found, needed) = with(&few);
        let (expected, whole) = with(&all);
        let what = format!("{:?}, {kernel:?}, normals {normals}, {:?}", volume.packing, camera.projection);
        let counts = format!("{} of {} voxels", needed.visible, whole.visible);
        assert!(needed.visible * 3 < whole.visible, "{what}: {counts}");
        assert!(expected.channels[0].iter().filter(|c| **c > 0.01).count() > 30, "{what}");
        assert!(apart(&found, &expected) < 1e-6, "{what}, {counts}: {:e}", apart(&found, &expected));
    }
}

#[test]
fn cubic_unequal_and_sheared_steps_are_drawn_as_with_all_voxels() {
    let tf = above(0.0);
    let material = Material::default();
    let sheared = DMat3::from_cols(DVec3::new(0.4, 0.05, 0.0), DVec3::new(0.2, 0.4, -0.1), DVec3::new(-0.1, 0.1, -0.5));
    for axes in [cubic(0.4), DMat3::from_diagonal(DVec3::new(0.5, 0.4, 0.3)), sheared] {
        let mut grid = grid([22, 20, 24], axes, deep);
        let [i, j, k] = with_high(&mut grid.values, grid.dims);
        is_drawn_as_with_all(volume(&grid, &tf, &material), grid.position(i, j, k), KernelShape::default());
    }
}

#[test]
fn body_centred_steps_are_drawn_as_with_all_voxels() {
    let tf = above(0.0);
    let material = Material::default();
    let mut bcc = body_centred([16, 16, 32], 8.0, deep);
    let [i, j, k] = with_high(&mut bcc.planes.values, bcc.planes.dims);
    is_drawn_as_with_all(bcc_volume(&bcc, &tf, &material), bcc.position(i, j, k), KernelShape::default());
}

/// Shadows are interpolated between the corners of a cell, which lie beyond such kernels.
#[test]
fn narrow_kernels_are_drawn_as_with_all_voxels() {
    let tf = above(0.0);
    let material = Material::default();
    let mut grid = grid([22, 20, 24], cubic(0.4), deep);
    let [i, j, k] = with_high(&mut grid.values, grid.dims);
    for extent in [1.2, 0.6] {
        let kernel = KernelShape { extent, sigma: 0.5 };
        is_drawn_as_with_all(volume(&grid, &tf, &material), grid.position(i, j, k), kernel);
    }
}
