//! Every ray with every disc, in f64: the slow form that tests compare with. The reference shares the gap rule's
//! formula with [`blend`](crate::blend()), but neither code nor projection.

mod opaque;

pub use opaque::{Seen, opaque};

use crate::disc::axes;
use crate::{DiscInput, Params};
use rayon::prelude::*;
use splat_core::optics::{self, SurfaceOpacity};
use splat_core::shade::ChannelLayout;
use splat_core::{Camera, Footprint, glam::DVec3};
use std::ops::Range;

/// Pixels along a side of the squares whose discs are looked for together.
const SIDE: u32 = 8;

/// A layer of a pixel.
#[derive(Debug, Clone, PartialEq)]
pub struct Layer {
    /// View depth: the discs' average by weight.
    pub depth: f64,
    /// Opacity by channel.
    pub opacity: [f64; 3],
    /// Σwαv/Σw of each value: values times opacity.
    pub values: Vec<f64>,
}

/// Where a ray meets a disc.
#[derive(Debug, Clone, Copy)]
struct Hit {
    depth: f64,
    id: usize,
    weight: f64,
    distance_sq: f64,
    /// n·d, d with a z of 1: above 0 where the disc faces away.
    facing: f64,
    radius: f64,
}

/// The layers of the pixel at (x, y), near to far. `planes` is 1 or 3, `channels` the number of values a splat in `values`, which are by
/// place in the cloud.
pub fn layers(
    input: &DiscInput<'_>,
    params: &Params,
    pixel: [u32; 2],
    values: &[f32],
    sizes: [usize; 2],
) -> Vec<Layer> {
    let [x, y] = pixel;
    let [planes, channels] = sizes;
    let (origin, direction) = world_ray(input.camera, f64::from(x) + 0.5, f64::from(y) + 0.5);
    let hits = hits(input, params, origin, direction);
    let core = f64::from(Footprint::CORE / params.disc_scale).powi(2);
    let mut layers = Vec::new();
    let mut begin = 0;
    for end in 1..=hits.len() {
        let same_object = |a: &Hit, b: &Hit| input.cloud.object[a.id] == input.cloud.object[b.id];
        let joined = |a: &Hit, b: &Hit| same_object(a, b) && joins(a, b, f64::from(params.gap));
        if end < hits.len() && joined(&hits[end - 1], &hits[end]) {
            continue;
        }
        if hits[begin..end].iter().any(|h| h.distance_sq < core) {
            layers.push(blend(&hits[begin..end], input, direction.length(), values, [planes, channels]));
        }
        begin = end;
    }
    layers.sort_by(|a: &Layer, b| a.depth.total_cmp(&b.depth));
    layers
}

/// The values and the transmittance of each pixel, in rows, from the layers nearer than its entry in `opaque`; see [`composite`].
/// `opaque` may be empty. `sizes` are those of [`layers`].
///
/// A square of pixels asks the discs whose balls its rays may meet.
pub fn picture(
    input: &DiscInput<'_>,
    params: &Params,
    values: &[f32],
    sizes: [usize; 2],
    opaque: &[f32],
) -> Vec<Composited> {
    let [width, height] = input.camera.size;
    let columns = width.div_ceil(SIDE);
    let mut squares: Vec<Vec<u32>> = vec![Vec::new(); (columns * height.div_ceil(SIDE)) as usize];
    for &id in input.ids {
        let [x, y] = squares_of(input, id, params);
        y.for_each(|y| x.clone().for_each(|x| squares[(y * columns + x) as usize].push(id)));
    }
    let pixel = |k: u32| {
        let x = k % width;
        let y = k / width;
        let ids = &squares[(y / SIDE * columns + x / SIDE) as usize];
        let limit = opaque.get(k as usize).map_or(f64::INFINITY, |depth| f64::from(*depth));
        let mut layers = layers(&DiscInput { ids, ..*input }, params, [x, y], values, sizes);
        layers.retain(|layer| layer.depth < limit);
        composite(&layers, sizes[0], sizes[1])
    };
    (0..width * height).into_par_iter().map(pixel).collect()
}

/// Columns and rows of squares in which the ball around a disc may lie.
fn squares_of(input: &DiscInput<'_>, id: u32, params: &Params) -> [Range<u32>; 2] {
    let DiscInput { cloud, camera, .. } = input;
    let i = id as usize;
    let reach = axes(cloud, i, f64::from(params.disc_scale)).iter().map(|a| a.length()).fold(0.0, f64::max);
    let center = camera.view_from_world(cloud.origin + cloud.position[i].as_dvec3());
    let crosses = !camera.is_orthographic() && center.z <= reach;
    let range = |middle: f64, size: u32| {
        if crosses {
            return 0..size.div_ceil(SIDE);
        }
        let depths = if camera.is_orthographic() { [1.0; 2] } else { [center.z - reach, center.z + reach] };
        let places = depths.into_iter().flat_map(|z| [(middle - reach) / z, (middle + reach) / z]);
        let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), v| (l.min(v), h.max(v)));
        let pixel = |v: f64| (0.5 * f64::from(size) + camera.focal_px() * v).clamp(0.0, f64::from(size));
        pixel(low) as u32 / SIDE..(pixel(high).ceil() as u32).div_ceil(SIDE)
    };
    [range(center.x, camera.size[0]), range(-center.y, camera.size[1])]
}

/// Layers of a pixel, composited.
#[derive(Debug, Clone, PartialEq)]
pub struct Composited {
    /// By channel.
    pub values: Vec<f64>,
    /// By plane of extinction, 0 to 1.
    pub transmittance: Vec<f64>,
}

/// Composites layers in order.
pub fn composite(layers: &[Layer], planes: usize, channels: usize) -> Composited {
    let mut values = vec![0.0; channels];
    let mut transmittance = vec![1.0; planes];
    for layer in layers {
        for (c, sum) in values.iter_mut().enumerate() {
            *sum += transmittance[ChannelLayout::plane_of(c, channels, planes)] * layer.values[c];
        }
        transmittance.iter_mut().zip(layer.opacity).for_each(|(t, opacity)| *t *= 1.0 - opacity);
    }
    Composited { values, transmittance }
}

/// From the eye, or a place of the eye's plane, along the view: the part along the camera's axis is 1.
fn world_ray(camera: &Camera, x: f64, y: f64) -> (DVec3, DVec3) {
    let (from, along) = camera.view_ray(x, y);
    let world = |v: DVec3| camera.axes[0] * v.x + camera.axes[1] * v.y + camera.axes[2] * v.z;
    (camera.position + world(from), world(along))
}

fn hits(input: &DiscInput<'_>, params: &Params, origin: DVec3, direction: DVec3) -> Vec<Hit> {
    let cloud = input.cloud;
    let origin = origin - cloud.origin;
    let mut hits: Vec<Hit> = Vec::new();
    for &id in input.ids {
        let i = id as usize;
        let center = cloud.position[i].as_dvec3();
        let normal = cloud.normal_of(i).as_dvec3();
        let depth = normal.dot(center - origin) / normal.dot(direction);
        let at = origin + direction * depth - center;
        let axes = axes(cloud, i, f64::from(params.disc_scale));
        let distance_sq: f64 = axes.iter().map(|a| (at.dot(*a) / a.length_squared()).powi(2)).sum();
        let profile = input.footprints.layers()[cloud.footprint[i] as usize];
        if depth > 0.0 && distance_sq < 1.0 {
            hits.push(Hit {
                depth,
                id: i,
                weight: profile.profile(distance_sq),
                distance_sq,
                facing: normal.dot(direction),
                radius: (axes[0].length() * axes[1].length()).sqrt(),
            });
        }
    }
    let object = |hit: &Hit| cloud.object[hit.id];
    hits.sort_by(|a, b| object(a).cmp(&object(b)).then(a.depth.total_cmp(&b.depth)).then(a.id.cmp(&b.id)));
    hits
}

fn joins(near: &Hit, far: &Hit, gap: f64) -> bool {
    let facing = (0.5 * (near.facing.abs() + far.facing.abs())).max(0.25);
    (far.depth - near.depth) * facing < gap * 0.5 * (near.radius + far.radius)
}

fn blend(hits: &[Hit], input: &DiscInput<'_>, ray: f64, values: &[f32], sizes: [usize; 2]) -> Layer {
    let [planes, channels] = sizes;
    let cloud = input.cloud;
    let weights: f64 = hits.iter().map(|h| h.weight).sum();
    let mut layer = Layer { depth: 0.0, opacity: [0.0; 3], values: vec![0.0; channels] };
    for hit in hits {
        let share = hit.weight / weights;
        layer.depth += share * hit.depth;
        let material = &input.materials[cloud.material[hit.id] as usize];
        let spacing =
            input.footprints.layers()[cloud.footprint[hit.id] as usize].spacing_for_radius(cloud.radius[hit.id]);
        let slab = match material.surface_opacity {
            SurfaceOpacity::PerCrossing => 1.0,
            SurfaceOpacity::ThinSlab => 1.0 / (hit.facing.abs() / ray).max(1e-3),
        };
        let tau = f64::from(cloud.crossing_depth_of(hit.id, spacing)) * slab;
        let opacity: [f64; 3] =
            std::array::from_fn(|p| share * optics::opacity(tau * f64::from(material.extinction_rgb[p])));
        layer.opacity.iter_mut().zip(opacity).take(planes).for_each(|(sum, share)| *sum += share);
        for (c, sum) in layer.values.iter_mut().enumerate() {
            let plane = ChannelLayout::plane_of(c, channels, planes);
            *sum += opacity[plane] * f64::from(values[hit.id * channels + c]);
        }
    }
    layer
}
