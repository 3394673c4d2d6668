//! Volumes, views and pictures for the tests.

use sheet_light::{Error, GatherKernel, Lighting, Params, Reconstruction, SheetCounts, SheetInput, Volume, prepare};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::raster::{self, Detail, ProjectInput, Projected, project};
use splat_core::shade::{ChannelLayout, LitBy};
use splat_core::{
    Accumulator, BccGrid, Camera, Cloud, FootprintStack, Gaussians, Grid, LayerSet, Material, Packing, Projection,
    Shading, Similarity, SplatKind, TransferFunction, TransferPoint, rng,
};
use std::sync::Arc;

/// A lattice around the origin, its values by place in world space.
pub(crate) fn grid(dims: [usize; 3], axes: DMat3, value: impl Fn(DVec3) -> f64) -> Grid {
    let middle = DVec3::from_array(dims.map(|n| 0.5 * (n as f64 - 1.0)));
    let origin = -(axes * middle);
    let mut grid = Grid { origin, axes, dims, values: Vec::new() };
    for (k, j, i) in (0..dims[2]).flat_map(|k| (0..dims[1]).flat_map(move |j| (0..dims[0]).map(move |i| (k, j, i)))) {
        grid.values.push(value(grid.position(i, j, k)) as f32);
    }
    grid
}

/// A body-centred lattice that fills a cube around the origin.
pub(crate) fn body_centred(dims: [usize; 3], side: f64, value: impl Fn(DVec3) -> f64) -> BccGrid {
    let axes = DMat3::from_diagonal(DVec3::from_array(dims.map(|n| side / n as f64)));
    let origin = DVec3::splat(-0.5 * side) - axes * Packing::BodyCentred.lowest();
    let [nx, ny, _] = dims;
    let mut bcc = BccGrid { planes: Grid { origin, axes, dims, values: Vec::new() } };
    for n in 0..dims.iter().product() {
        bcc.planes.values.push(value(bcc.position(n % nx, n / nx % ny, n / (nx * ny))) as f32);
    }
    bcc
}

/// Cubic cells of side `spacing`.
pub(crate) fn cubic(spacing: f64) -> DMat3 {
    DMat3::from_diagonal(DVec3::splat(spacing))
}

/// A value between 0 and 1 for each place, without any order.
pub(crate) fn noise(p: DVec3) -> f64 {
    let bits = [p.x, p.y, p.z].map(|v| (v * 1024.0).round() as i64 as u64 & 0xffff);
    rng::unit(3, 0, bits[0] | bits[1] << 16 | bits[2] << 32, 0)
}

/// A volume of noise moved by `shift` and scaled by `scale`, its optical depths kept.
pub(crate) fn moved_noise(dims: [usize; 3], shift: f64, scale: f64) -> (Grid, TransferFunction) {
    let mut grid = grid(dims, cubic(0.5), noise);
    grid.origin = grid.origin * scale + DVec3::splat(shift);
    grid.axes *= scale;
    let points = [(0.3f32, 0.0f32), (0.5, 0.4), (0.9, 2.5)];
    let point = |(value, extinction)| TransferPoint { value, color: [value; 3], extinction: extinction / scale as f32 };
    (grid, TransferFunction::new(points.into_iter().map(point).collect()).unwrap())
}

/// View depths between which a pixel's ray is inside the box of these sides around the origin.
pub(crate) fn in_box(camera: &Camera, sides: DVec3, at: usize) -> [f64; 2] {
    let [x, y] = [at % camera.size[0] as usize, at / camera.size[0] as usize].map(|v| v as f64 + 0.5);
    let (from, along) = camera.view_ray(x, y);
    let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
    let from = camera.position + world(from);
    let along = world(along);
    let mut near = 0.0f64;
    let mut far = f64::INFINITY;
    for a in (0..3).filter(|a| along[*a] != 0.0) {
        let [one, other] = [-0.5, 0.5].map(|face| (face * sides[a] - from[a]) / along[a]);
        (near, far) = (near.max(one.min(other)), far.min(one.max(other)));
    }
    [near, far]
}

/// Control points (value, extinction), green turning to red.
pub(crate) fn transfer(points: &[(f32, f32)]) -> TransferFunction {
    let count = points.len() as f32;
    let point = |(i, &(value, extinction)): (usize, &(f32, f32))| {
        let t = (i as f32 + 0.5) / count;
        TransferPoint { value, color: [t, 1.0 - t, 0.5], extinction }
    };
    TransferFunction::new(points.iter().enumerate().map(point).collect()).unwrap()
}

/// The same extinction for all values, white.
pub(crate) fn constant(extinction: f32) -> TransferFunction {
    TransferFunction::new(vec![TransferPoint { value: 0.0, color: [1.0; 3], extinction }]).unwrap()
}

pub(crate) fn unlit() -> Material {
    Material { shading: Shading::Unlit, ..Material::default() }
}

pub(crate) fn volume<'a>(grid: &'a Grid, transfer: &'a TransferFunction, material: &'a Material) -> Volume<'a> {
    Volume {
        grid,
        packing: Packing::Cartesian,
        transform: Similarity::default(),
        transfer,
        extinction_scale: 1.0,
        material,
        normals: false,
        object: 0,
        clip: &[],
        shadow_coefficient: 1.0,
        casts_shadow: true,
    }
}

pub(crate) fn bcc_volume<'a>(bcc: &'a BccGrid, transfer: &'a TransferFunction, material: &'a Material) -> Volume<'a> {
    Volume { packing: Packing::BodyCentred, ..volume(&bcc.planes, transfer, material) }
}

pub(crate) fn perspective(from: [f64; 3], fov_deg: f64, size: [u32; 2]) -> Camera {
    let projection = Projection::Perspective { fov_y: fov_deg.to_radians() };
    Camera::look_at(DVec3::from_array(from), DVec3::ZERO, DVec3::Y, projection, size).unwrap()
}

pub(crate) fn parallel(from: [f64; 3], height: f64, size: [u32; 2]) -> Camera {
    let projection = Projection::Orthographic { height };
    Camera::look_at(DVec3::from_array(from), DVec3::ZERO, DVec3::Y, projection, size).unwrap()
}

pub(crate) fn input<'a>(volumes: &'a [Volume<'a>], camera: &'a Camera, lights: &'a [LitBy<'a>]) -> SheetInput<'a> {
    let volumes = volumes.to_vec();
    let lights = lights.to_vec();
    SheetInput { volumes, splats: None, camera, lights, shadow_origin: DVec3::ZERO, ambient: [0.1; 3] }
}

pub(crate) const BEAUTY: ChannelLayout =
    ChannelLayout::new(&LayerSet { effects: false, shadow: false, normal: false, depth: false, object: false });

/// No pixel is done before its end.
pub(crate) fn exact() -> Params {
    Params { transmittance_cutoff: 0.0, ..Params::default() }
}

/// Parameters with sheets that are splatted, and with sheets that are gathered by each kernel.
pub(crate) fn forms(params: &Params) -> [Params; 3] {
    let gathered = [GatherKernel::Linear, GatherKernel::Gaussian].map(Reconstruction::Gather);
    let [linear, gaussian] = gathered.map(|reconstruction| Params { reconstruction, ..*params });
    [*params, linear, gaussian]
}

/// The same with light as the twin takes it.
pub(crate) fn lit_in_middles() -> Params {
    Params { lighting: Lighting::Middle, ..exact() }
}

/// Beauty and one plane of optical depth.
pub(crate) fn draw(input: &SheetInput<'_>, params: &Params) -> Result<(Accumulator, SheetCounts), Error> {
    let mut out = Accumulator::new(input.camera.size, 1, 3, true, true);
    let counts =
        prepare(input.clone(), params, None)?.fold(f32::NEG_INFINITY..f32::INFINITY, &[], &BEAUTY, &mut out, None)?;
    Ok((out, counts))
}

/// Greatest difference of two planes.
pub(crate) fn largest(a: &[f32], b: &[f32]) -> f32 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

/// Greatest difference of two pictures' colours and transmittances.
pub(crate) fn apart(a: &Accumulator, b: &Accumulator) -> f32 {
    let through = |a: &Accumulator| a.optical_depth[0].iter().map(|t| (-t).exp()).collect::<Vec<f32>>();
    let planes = a.channels.iter().zip(&b.channels).map(|(a, b)| largest(a, b));
    planes.fold(largest(&through(a), &through(b)), f32::max)
}

/// Makes every fifth splat a Gaussian, three times as long as wide, of its colour.
pub(crate) fn with_gaussians(mut cloud: Cloud) -> Cloud {
    let mut all = Gaussians::default();
    cloud.gaussian = vec![Gaussians::NONE; cloud.len()];
    for i in (1..cloud.len()).step_by(5) {
        let along = |k: u64| (rng::unit(9, k, i as u64, 0) - 0.5) as f32;
        let axis = Vec3::new(along(0), along(1), along(2)).normalize();
        let (other, last) = axis.any_orthonormal_pair();
        (cloud.gaussian[i], cloud.kind[i]) = (all.len() as u32, SplatKind::Medium);
        all.axes.push([axis * 0.18, other * 0.06, last * 0.06]);
        all.opacity.push(0.7);
        all.harmonics.push(Gaussians::constant(cloud.color[i]));
    }
    cloud.gaussians = Arc::new(all);
    cloud
}

/// All that is known of splats in a camera's image, by default footprints.
pub(crate) fn projected(cloud: &Cloud, camera: &Camera, materials: &[Material]) -> Projected {
    let footprints = &FootprintStack::default();
    let params = &raster::Params::default();
    project(&ProjectInput { cloud, camera, footprints, materials, params, detail: Detail::ALL })
}
