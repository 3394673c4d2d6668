//! Opaque discs, every ray with every disc.

use super::{Hit, hits, world_ray};
use crate::disc::axes;
use crate::{DiscInput, Params, Passes};
use splat_core::{Footprint, glam::DVec3};

/// A pixel's view of opaque discs.
#[derive(Debug, Clone, PartialEq)]
pub struct Seen {
    /// View depth: the average by weight.
    pub depth: f64,
    /// Averages by weight.
    pub values: Vec<f64>,
    /// Place in the cloud of the nearest disc.
    pub disc: usize,
}

/// The discs that nothing hides at an image position, pixels, averaged; `None` where there are none. The middle of the first pixel is
/// (½, ½). `channels` is the number of values a splat in `values`, which are by place in the cloud.
pub fn opaque(
    input: &DiscInput<'_>,
    params: &Params,
    passes: Passes<'_>,
    place: [f64; 2],
    values: &[f32],
    channels: usize,
) -> Option<Seen> {
    let [x, y] = place;
    let (origin, direction) = world_ray(input.camera, x, y);
    let mut hits = hits(input, params, origin, direction);
    hits.sort_by_key(|hit| hit.id);
    let epsilon =
        |hit: &Hit| (f64::from(params.gap) * hit.radius / hit.facing.abs().max(0.25)).max(hit.depth * 2f64.powi(-20));
    let core = f64::from(Footprint::CORE / params.disc_scale).powi(2);
    let hiding = || hits.iter().filter(|hit| hit.distance_sq < core);
    let limit = hiding().map(|hit| hit.depth + epsilon(hit)).fold(f64::INFINITY, f64::min);
    let nearest = *hiding().min_by(|a, b| a.depth.total_cmp(&b.depth))?;
    if let Passes::OnePlusOne { groups, voronoi } = passes {
        let floor = voronoi.then(|| floor(input, params));
        let key = |hit: &Hit| match floor {
            Some([near, step]) => [((hit.depth - near) / step).floor(), hit.distance_sq],
            None => [hit.depth, 0.0],
        };
        let mut kept: Vec<Hit> = Vec::new();
        for hit in &hits {
            match kept.iter_mut().find(|other| groups.by_disc()[other.id] == groups.by_disc()[hit.id]) {
                Some(other) if key(hit) < key(other) => *other = *hit,
                Some(_) => {}
                None => kept.push(*hit),
            }
        }
        hits = kept;
    }
    hits.retain(|hit| hit.depth < limit && nearest.depth < hit.depth + epsilon(hit));
    if hits.is_empty() {
        hits.push(nearest);
    }
    let seen = |hit: &Hit| input.cloud.shading_normal_of(hit.id).as_dvec3() * hit.facing;
    let front = seen(&nearest);
    let weight =
        |hit: &Hit| hit.weight.max(2f64.powi(-60)) * if seen(hit).dot(front) < 0.0 { 1.0 / 256.0 } else { 1.0 };
    let weights: f64 = hits.iter().map(weight).sum();
    let mean = |term: &dyn Fn(&Hit) -> f64| hits.iter().map(|hit| weight(hit) * term(hit)).sum::<f64>() / weights;
    let value = |c: usize| mean(&|hit| f64::from(values[hit.id * channels + c]));
    Some(Seen { depth: mean(&|hit| hit.depth), values: (0..channels).map(value).collect(), disc: nearest.id })
}

/// Where the steps of Eq. 10 begin, and how long one is.
fn floor(input: &DiscInput<'_>, params: &Params) -> [f64; 2] {
    let camera = input.camera;
    let mut near = f64::INFINITY;
    let mut far = 0.0;
    let mut radii = 0.0;
    for &id in input.ids {
        let axes = axes(input.cloud, id as usize, f64::from(params.disc_scale));
        let along = |v: DVec3| v.dot(camera.axes[2]);
        let depth = along(input.cloud.position[id as usize].as_dvec3() + (input.cloud.origin - camera.position));
        let reach = along(axes[0]).hypot(along(axes[1]));
        if depth + reach > 0.0 {
            (near, far) = (f64::min(near, (depth - reach).max(0.0)), f64::max(far, depth + reach));
        }
        radii += (axes[0].length() * axes[1].length()).sqrt();
    }
    let steps = ((far - near) / (f64::from(params.gap) * radii / input.ids.len() as f64)).ceil();
    [near, (far - near) / steps.clamp(1.0, f64::from(1 << 20))]
}
