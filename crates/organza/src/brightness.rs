//! How bright each light can be on anything: a bound of the radiance that comes of it, before anything is lit.

use crate::load::Loaded;
use crate::scene::light_points;
use glam::{DVec3, Vec3};
use rayon::prelude::*;
use splat_core::shade::LitBy;
use splat_core::{DAabb, Shading, SplatKind};

/// Standard deviation of a splat over its radius, at least: so near its light comes.
const LEAST_DEVIATION: f64 = 0.25;
/// Splats that one thread looks at.
const CHUNK: usize = 1 << 14;

/// An object that receives light.
#[derive(Clone, Copy)]
struct Receiver {
    /// Where it may lie, in the world.
    bounds: DAabb,
    /// It receives 1/(d² + spread²) of a lamp.
    spread: f64,
    /// The most radiance that it sends of an irradiance of 1, 1/sr.
    response: f64,
}

impl Receiver {
    const NOTHING: Self = Self { bounds: DAabb::EMPTY, spread: f64::INFINITY, response: 0.0 };

    fn join(&mut self, other: &Self) {
        self.bounds = self.bounds.union(other.bounds);
        self.spread = self.spread.min(other.spread);
        self.response = self.response.max(other.response);
    }
}

/// The most radiance that comes of each light of a loaded scene in any channel, W·m⁻²·sr⁻¹, scattered or reflected once: the irradiance at the
/// nearest place of what receives it, all points of the light together, times the peak of its material. Infinite where a lamp may lie on a point
/// without extent.
pub(crate) fn of_lights(loaded: &Loaded) -> Vec<f64> {
    let as_they_are = loaded.own.iter().map(|data| Receiver {
        bounds: data.world_box(),
        spread: 0.0,
        response: loaded.materials[data.material].brightest(f64::from(data.brightest_color()), true),
    });
    let receivers: Vec<Receiver> = splats(loaded).into_iter().chain(as_they_are).filter(|r| r.response > 0.0).collect();
    let points = light_points(&loaded.lights);
    let mut brightest: Vec<f64> = vec![0.0; loaded.lights.len()];
    for receiver in &receivers {
        let mut received = vec![0.0; loaded.lights.len()];
        for point in &points {
            let lit = LitBy { light: point.light, slide: loaded.images.slides[point.of].as_ref(), shadow: None };
            received[point.of] += lit.brightest_in(&receiver.bounds, receiver.spread);
        }
        for (brightest, received) in brightest.iter_mut().zip(received) {
            *brightest = brightest.max(received * receiver.response);
        }
    }
    brightest
}

/// The splats of each object.
fn splats(loaded: &Loaded) -> Vec<Receiver> {
    let cloud = &loaded.cloud;
    let nothing = || vec![Receiver::NOTHING; loaded.objects.len()];
    let chunk = |chunk: usize| {
        let mut receivers = nothing();
        for i in chunk * CHUNK..cloud.len().min((chunk + 1) * CHUNK) {
            receivers[cloud.object[i] as usize].join(&splat(loaded, i));
        }
        receivers
    };
    // Least and greatest numbers are the same in any order.
    (0..cloud.len().div_ceil(CHUNK)).into_par_iter().map(chunk).reduce(nothing, |mut joined, receivers| {
        joined.iter_mut().zip(&receivers).for_each(|(a, b)| a.join(b));
        joined
    })
}

fn splat(loaded: &Loaded, i: usize) -> Receiver {
    let cloud = &loaded.cloud;
    let position = cloud.origin + cloud.position[i].as_dvec3();
    let radius = f64::from(cloud.radius[i]);
    let material = &loaded.materials[cloud.material[i] as usize];
    let has_normal = cloud.kind[i] != SplatKind::Medium || cloud.shading_normal_of(i) != Vec3::ZERO;
    // Colours of Gaussians depend on where they are seen from.
    let is_known = cloud.gaussians.is_empty();
    let color = if is_known { cloud.color[i].into_iter().fold(0.0, f32::max) } else { f32::MAX };
    Receiver {
        bounds: DAabb::around(position, DVec3::splat(radius)),
        spread: LEAST_DEVIATION * radius,
        response: if material.shading == Shading::Unlit {
            0.0
        } else {
            material.brightest(f64::from(color), has_normal)
        },
    }
}
