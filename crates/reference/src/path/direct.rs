//! Light that reaches a vertex or a segment straight from a light: next-event estimation, with the scene's liberties.

use super::{Lamp, Path, Tracer, Vertex};
use crate::lights::LightSample;
use crate::path::random::Stream;
use crate::ray::Ray;
use crate::surfaces::visibility::Filter;
use glam::DVec3;

/// Light on its way to a vertex.
struct Arrival<'a> {
    sample: LightSample,
    /// Where it comes from; `None` is the environment.
    lamp: Option<&'a Lamp>,
    /// Probability that this light was chosen among all.
    chosen: f64,
}

impl Tracer<'_> {
    /// Light that one of some lights sends to a vertex.
    pub(super) fn gather(&self, path: &mut Path, vertex: &Vertex, lights: &[Lamp], skip: u32, rng: &mut Stream) {
        let n = lights.len();
        if n == 0 {
            return;
        }
        let pick = if n == 1 { 0 } else { ((rng.unit() * n as f64) as usize).min(n - 1) };
        let lamp = &lights[pick];
        let u = if lamp.source.is_area() { rng.pair() } else { [0.5; 2] };
        if let Some(mut sample) = lamp.source.sample(path.ray.origin, u) {
            let passing = self.scene.passing(lamp.rank, path.ray.origin);
            (0..3).for_each(|c| sample.value[c] *= passing[c]);
            let arrival = Arrival { sample, lamp: Some(lamp), chosen: 1.0 / n as f64 };
            self.add_sample(path, vertex, &arrival, skip, rng);
        }
    }

    /// Light that a bright environment sends to a vertex.
    pub(super) fn gather_environment(&self, path: &mut Path, vertex: &Vertex, skip: u32, rng: &mut Stream) {
        let environment = &self.scene.environment;
        if !self.rules.environment_illuminates || !environment.is_sampled() {
            return;
        }
        if let Some((direction, radiance, density)) = environment.sample(rng.pair()) {
            let value = radiance.map(|l| l / density);
            let sample = LightSample { direction, distance: f64::INFINITY, value, density };
            self.add_sample(path, vertex, &Arrival { sample, lamp: None, chosen: 1.0 }, skip, rng);
        }
    }

    /// Adds a sample of a light, or of the environment.
    fn add_sample(&self, path: &mut Path, vertex: &Vertex, arrival: &Arrival<'_>, skip: u32, rng: &mut Stream) {
        let Arrival { sample: s, lamp, chosen } = arrival;
        let (share, density) = vertex.toward(s.direction);
        if share.iter().all(|v| *v == 0.0) {
            return;
        }
        let ray = Ray { origin: path.ray.origin, direction: s.direction };
        let arrives = match lamp {
            Some(lamp) if !lamp.shadowed || vertex.shadow_coefficient == 0.0 => [1.0; 3],
            Some(_) => {
                let through = self.through(&ray, s.distance, skip, true, rng);
                through.map(|t| 1.0 - vertex.shadow_coefficient * (1.0 - t))
            }
            None => self.transmittance(&ray, s.distance, skip, rng),
        };
        let balance = if s.density > 0.0 && !(self.free && lamp.is_some()) {
            s.density * chosen / (s.density * chosen + density)
        } else {
            1.0
        };
        path.add(std::array::from_fn(|c| share[c] * s.value[c] * arrives[c]), balance / chosen);
    }

    /// Light of lights inside media that is scattered or reflected by them once, along the part of the segment that media fill.
    pub(super) fn gather_along(&self, path: &mut Path, end: f64, rng: &mut Stream) {
        let Some((t0, t1)) = self.volume.bounds().and_then(|b| path.ray.clip(b, path.t, end)) else { return };
        let n = self.along_segments.len();
        let lamp = &self.along_segments[((rng.unit() * n as f64) as usize).min(n - 1)];
        let Some(pole) = lamp.source.pole() else { return };
        let middle = (pole - path.ray.origin).dot(path.ray.direction);
        let apart = (pole - path.ray.at(middle)).length();
        let a = (t0 - middle).atan2(apart);
        let b = (t1 - middle).atan2(apart);
        let t = middle + apart * (a + (b - a) * rng.unit()).tan();
        let point = path.ray.at(t);
        let may_reflect = !self.rules.reflects_apart || path.bounces == 0;
        let (scattered, dimmed) = self.scattering(point, pole, path.ray.direction, may_reflect);
        if !(t0..=t1).contains(&t) || scattered.iter().all(|s| *s == 0.0) {
            return;
        }
        let seen = self.volume.transmittance(&path.ray, path.t, t, rng);
        let to_light = pole - point;
        let distance = to_light.length();
        let shadow = Ray { origin: point, direction: to_light / distance };
        let arrives = if lamp.shadowed { self.through(&shadow, distance, u32::MAX, true, rng) } else { [1.0; 3] };
        let intensity = lamp.source.intensity(point);
        let passing = self.scene.passing(lamp.rank, point);
        // 1/density · 1/d²: the squares cancel but for rounding, apart² + (t − middle)² = d².
        let factor = n as f64 * (b - a) / apart;
        let lit = |c: usize| scattered[c] - dimmed[c] * (1.0 - arrives[c]);
        path.add(std::array::from_fn(|c| lit(c) * intensity[c] * passing[c] * seen[c]), factor);
    }

    /// Σ over media of extinction · share of the light that is scattered or reflected, per channel; all, and the share that shadows dim.
    fn scattering(&self, p: DVec3, pole: DVec3, travel: DVec3, may_reflect: bool) -> ([f64; 3], [f64; 3]) {
        let mut sum = [0.0; 3];
        let mut dimmed = [0.0; 3];
        let to_light = (pole - p).normalize_or_zero();
        for medium in &self.scene.media {
            let density = medium.density.value(p);
            if density > 0.0 && (may_reflect || !medium.reflects(p)) {
                let share = medium.toward(p, to_light, -travel);
                let factor = density * medium.liberty.gain;
                for c in 0..3 {
                    let scattered = factor * medium.extinction[c] * share[c];
                    sum[c] += scattered;
                    dimmed[c] += medium.liberty.shadow_coefficient * scattered;
                }
            }
        }
        (sum, dimmed)
    }

    /// An unbiased estimate of the transmittance of a straight line; dielectrics block it.
    pub(crate) fn transmittance(&self, ray: &Ray, distance: f64, skip: u32, rng: &mut Stream) -> [f64; 3] {
        self.through(ray, distance, skip, false, rng)
    }

    /// [`Tracer::transmittance`], of everything or of what casts shadows.
    fn through(&self, ray: &Ray, distance: f64, skip: u32, shadow: bool, rng: &mut Stream) -> [f64; 3] {
        let mut left = [1.0; 3];
        let mut filter = Filter { skip, ..Filter::START };
        while let Some(hit) = self.visibility.next(ray, filter, distance) {
            let material = &self.scene.surfaces[hit.mesh as usize].material;
            filter.after = (hit.t, hit.id);
            if shadow && !material.liberty.casts_shadow {
                continue;
            }
            let opacity = material.opacity(self.visibility.normal(hit.id).dot(ray.direction));
            (0..3).for_each(|c| left[c] *= 1.0 - opacity[c]);
            if left == [0.0; 3] {
                return left;
            }
        }
        let volume = self.casters.as_ref().filter(|_| shadow).unwrap_or(&self.volume);
        let media = volume.transmittance(ray, 0.0, distance, rng);
        std::array::from_fn(|c| left[c] * media[c])
    }
}
