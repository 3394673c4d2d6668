//! Lights, pictures and rays for tests of half-vector sheets.

use crate::common::BEAUTY;
use sheet_light::half::{HalfCounts, HalfInput, HalfParams, fold};
use sheet_light::{Error, Params, SheetInput, Volume};
use splat_core::glam::DVec3;
use splat_core::shade::LitBy;
use splat_core::{Accumulator, Camera, Grid, Light, LightShape, Material, Shading};

/// Scatters all light alike in all directions, once.
pub(crate) fn scattering() -> Material {
    Material { shading: Shading::Phase, ambient: 0.0, ..Material::default() }
}

pub(crate) fn lit(shape: LightShape) -> LitBy<'static> {
    LitBy { slide: None, light: Light { shape, intensity: [1.0; 3] }, shadow: None }
}

/// Light that comes from a direction.
pub(crate) fn sun(from: [f64; 3]) -> LitBy<'static> {
    lit(LightShape::Directional { direction: -DVec3::from_array(from).normalize() })
}

pub(crate) fn lamp(at: [f64; 3]) -> LitBy<'static> {
    lit(LightShape::Point { position: DVec3::from_array(at) })
}

/// No pixel is done before its end.
pub(crate) fn exact(slab_width: Option<f64>) -> HalfParams {
    HalfParams {
        sheets: Params { transmittance_cutoff: 0.0, slab_width, ..Params::default() },
        ..HalfParams::default()
    }
}

/// Splatted, and gathered linearly and by the paper's kernel.
pub(crate) fn half_forms(params: &HalfParams) -> [HalfParams; 3] {
    crate::common::forms(&params.sheets).map(|sheets| HalfParams { sheets, ..*params })
}

pub(crate) fn input<'a>(volumes: &'a [Volume<'a>], camera: &'a Camera, lights: &'a [LitBy<'a>]) -> HalfInput<'a> {
    let volumes = volumes.to_vec();
    let lights = lights.to_vec();
    let sheets = SheetInput { volumes, splats: None, camera, lights, shadow_origin: DVec3::ZERO, ambient: [0.0; 3] };
    HalfInput { sheets, splats: None, polygons: &[], extended: Vec::new(), mapped: Vec::new(), opaque: &[] }
}

/// Beauty, depths, objects and one plane of optical depth.
pub(crate) fn draw(input: &HalfInput<'_>, params: &HalfParams) -> Result<(Accumulator, HalfCounts), Error> {
    let mut out = Accumulator::new(input.sheets.camera.size, 1, 3, true, true);
    let drawn = fold(input, params, &BEAUTY, &mut out, None)?;
    Ok((out, drawn.counts))
}

/// A ray's part in the cells of a lattice, as places in world space; `None` for less than a thousandth of a step.
pub(crate) fn inside(grid: &Grid, from: DVec3, along: DVec3) -> Option<[f64; 2]> {
    let inverse = grid.axes.inverse();
    let start = inverse * (from - grid.origin);
    let step = inverse * along;
    let mut near = f64::NEG_INFINITY;
    let mut far = f64::INFINITY;
    for a in 0..3 {
        let low = -0.5 - start[a];
        let high = grid.dims[a] as f64 - 0.5 - start[a];
        if step[a].abs() < 1e-14 {
            if low > 1e-9 || high < -1e-9 {
                return None;
            }
            continue;
        }
        let one = low / step[a];
        let other = high / step[a];
        (near, far) = (near.max(one.min(other)), far.min(one.max(other)));
    }
    (far - near > 1e-3 * grid.axes.x_axis.length()).then_some([near, far])
}

/// A pixel's ray in world space, of unit direction.
pub(crate) fn ray(camera: &Camera, x: usize, y: usize) -> (DVec3, DVec3) {
    let (from, along) = camera.view_ray(x as f64 + 0.5, y as f64 + 0.5);
    let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
    (camera.position + world(from), world(along).normalize())
}

/// What a constant medium shows of light that it scatters once, per 1/4π: ∫σ·e^(−σt)·E(t)·e^(−σl(t)) dt, by Simpson's rule, l the way
/// of the light in the medium; and the optical depth of the ray. `spread` is that of a kernel that receives light.
pub(crate) fn single_scattering(
    grid: &Grid,
    sigma: f64,
    (light, spread): (&Light, f64),
    (from, along): (DVec3, DVec3),
) -> [f64; 2] {
    let Some([near, far]) = inside(grid, from, along) else { return [0.0; 2] };
    let near = near.max(0.0);
    let n = 1000;
    let at = |t: f64| {
        let place = from + along * t;
        let irradiance = light.irradiance(place, spread).irradiance;
        let to_light = light.irradiance(place, 0.0).to_light;
        let way = inside(grid, place, to_light).map_or(0.0, |[_, leave]| leave.max(0.0));
        sigma * (-sigma * (t - near) - sigma * way).exp() * f64::from(irradiance[0])
    };
    let step = (far - near) / f64::from(n);
    let weight = |i: i32| if i == 0 || i == n { 1.0 } else { f64::from(2 + 2 * (i % 2)) };
    let sum: f64 = (0..=n).map(|i| weight(i) * at(near + step * f64::from(i))).sum();
    [sum * step / 3.0, sigma * (far - near)]
}
