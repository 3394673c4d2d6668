//! Slow and obvious: one set on one image in f64, particle by particle; and opacities in closed form.

use crate::project::bins::{thinning, thinning_key};
use crate::project::pixel_area_view;
use crate::{KeptSets, Particles, Sampler, Scene, opacity};
use splat_core::glam::DVec3;

/// The nearest particle of a pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Nearest {
    /// View depth.
    pub depth: f64,
    /// Index of the object.
    pub object: usize,
    /// Colour of the particle.
    pub color: [f32; 3],
}

/// The nearest particle of each pixel in set `set`, rows from the top left; of equal depths the first.
pub fn nearest(scene: &Scene<'_>, set: u64) -> Vec<Option<Nearest>> {
    let [w, h] = scene.camera.size.map(|s| s as usize);
    let mut image: Vec<Option<Nearest>> = vec![None; w * h];
    let mut scratch = Particles::default();
    for (o, object) in scene.objects.iter().enumerate() {
        let s = object.sampler.cross_section() * object.transform.scale.powi(2);
        let kept = KeptSets::new(object.sampler, set, 1);
        for run in 0..kept.chunks() {
            let key = thinning_key(o as u32, set, run);
            let particles = kept.chunk(set, run, &mut scratch);
            for i in 0..particles.len() {
                let world = object.transform.apply(object.sampler.origin() + particles.position[i].as_dvec3());
                let view = scene.camera.view_from_world(world);
                let mut cosine = 1.0;
                let normal = object.transform.rotate(particles.normal[i].get().as_dvec3());
                if particles.normal[i].is_per_crossing() && normal != DVec3::ZERO {
                    let ray = if scene.camera.is_orthographic() {
                        scene.camera.axes[2]
                    } else {
                        world - scene.camera.position
                    };
                    cosine = (normal.dot(ray) / ray.length()).abs();
                }
                let k = s * cosine / pixel_area_view(scene.camera, view);
                if view.z <= 0.0 || (k < 1.0 && f64::from(thinning(key, i as u64)) >= k) {
                    continue;
                }
                let scale = scene.camera.focal_px() / if scene.camera.is_orthographic() { 1.0 } else { view.z };
                let at = [0.5 * w as f64 + view.x * scale, 0.5 * h as f64 - view.y * scale];
                let color = particles.color[i].get().map(|c| c * object.look.color_unit);
                // Of a wider particle each pixel asks with its own area.
                let side = |pixel: [f64; 2]| {
                    let (_, ray) = scene.camera.view_ray(pixel[0], pixel[1]);
                    if k <= 1.0 { 1.0 } else { (s * cosine / pixel_area_view(scene.camera, ray * view.z)).sqrt() }
                };
                for pixel in pixels(at, side, [w, h]) {
                    let hidden = scene.occluder.is_some_and(|c| f64::from(c.depth[pixel]) <= view.z);
                    if !hidden && image[pixel].is_none_or(|n| view.z < n.depth) {
                        image[pixel] = Some(Nearest { depth: view.z, object: o, color });
                    }
                }
            }
        }
    }
    image
}

/// Pixels around whose centres a square of this side holds `at`.
fn pixels(at: [f64; 2], side: impl Fn([f64; 2]) -> f64, size: [usize; 2]) -> Vec<usize> {
    let centre = |i: usize| [(i % size[0]) as f64 + 0.5, (i / size[0]) as f64 + 0.5];
    let holds = |i: &usize| {
        let centre = centre(*i);
        let half = 0.5 * side(centre);
        (0..2).all(|a| centre[a] > at[a] - half && centre[a] <= at[a] + half)
    };
    (0..size[0] * size[1]).filter(holds).collect()
}

/// Opacity of layers of these opacities, one behind the other: 1 − Π(1 − α).
pub fn layers(alphas: &[f64]) -> f64 {
    1.0 - alphas.iter().map(|a| 1.0 - a).product::<f64>()
}

/// Tanaka 2012, Eq. 1, as printed for a facing surface: 1 − (1 − s/S)^n.
pub fn equation_1(s: f64, area: f64, n: u32) -> f64 {
    1.0 - (1.0 - opacity::hit_probability(s, area, 1.0)).powf(f64::from(n))
}
