//! One path: from the eye through media and surfaces, gathering light at every vertex.
//!
//! At a vertex one light (chosen evenly) and, if it is an image, the environment are sampled; rays that meet an area
//! light or the environment on their own count too, weighted by the balance heuristic (Veach 1997). Lights without
//! extent inside a medium would give 1/d² infinite variance at vertices; their single scattering is estimated along each
//! segment instead, at a distance chosen by the angle that it subtends at the light (equiangular sampling, Kulla and
//! Fajardo 2012). Russian roulette by the largest throughput.
//!
//! Straight crossings of translucent surfaces keep the ray, its vertex and its density. Reflection and refraction at a
//! dielectric are no scattering events; beyond one, lights count in full, since shadow rays end there.

mod direct;
pub(crate) mod estimate;
pub(crate) mod random;

use crate::liberty::Liberty;
use crate::lights::LightSource;
use crate::media::medium::Event;
use crate::media::phase::{henyey_greenstein, sample_henyey_greenstein};
use crate::media::tracking::{Collision, Volume};
use crate::path::random::Stream;
use crate::ray::Ray;
use crate::scene::Scene;
use crate::surfaces::dielectric::{Dielectric, fresnel_reflectance, reflect, refract};
use crate::surfaces::surface::{Response, SurfaceKind};
use crate::surfaces::visibility::{Filter, Hit, Visibility};
use glam::DVec3;

/// Which light paths count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PathRules {
    /// Most scattering events of a path: 0 shows emission and what lies behind, 1 is single scattering; `None` leaves the
    /// end to Russian roulette.
    pub max_bounces: Option<u32>,
    /// Whether eye rays see area lights.
    pub lights_visible: bool,
    /// Whether emission of media and surfaces lights others; if not, only the eye sees it.
    pub emission_illuminates: bool,
    /// Whether the environment lights what scatters; if not, only the eye sees it, straight or by reflection and refraction at
    /// dielectrics.
    pub environment_illuminates: bool,
    /// Whether a path is either scattered by media or reflected once by a surface that the eye sees, and never both.
    pub reflects_apart: bool,
}

impl Default for PathRules {
    fn default() -> Self {
        Self {
            max_bounces: None,
            lights_visible: true,
            emission_illuminates: true,
            environment_illuminates: true,
            reflects_apart: false,
        }
    }
}

/// Interface and scattering events after which roulette ends even a path that loses nothing.
const PATIENCE: u32 = 256;
const PATIENT_SURVIVAL: f64 = 0.99;

/// A prepared scene.
pub(crate) struct Tracer<'a> {
    scene: &'a Scene<'a>,
    pub(crate) visibility: Visibility,
    pub(crate) volume: Volume<'a>,
    /// Media that cast shadows, where some do not.
    casters: Option<Volume<'a>>,
    /// Lights sampled at vertices, and those sampled along segments.
    at_vertices: Vec<Lamp>,
    along_segments: Vec<Lamp>,
    areas: Vec<LightSource>,
    rules: PathRules,
    /// Some shadow is not that of nature: only shadow rays know it, so rays that meet a light on their own do not count.
    free: bool,
}

/// A light, and whether anything dims it.
#[derive(Clone, Copy)]
struct Lamp {
    source: LightSource,
    /// Its place among the lights.
    rank: usize,
    shadowed: bool,
}

/// A path under way.
struct Path {
    ray: Ray,
    /// Distance already travelled along the ray.
    t: f64,
    filter: Filter,
    throughput: [f64; 3],
    /// Density of the ray's direction, 1/sr; `None` from the eye and behind dielectrics.
    density: Option<f64>,
    bounces: u32,
    /// Whether nothing scatters it any more.
    is_over: bool,
    events: u32,
    radiance: [f64; 3],
}

impl Path {
    fn add(&mut self, light: [f64; 3], factor: f64) {
        (0..3).for_each(|c| self.radiance[c] += self.throughput[c] * light[c] * factor);
    }

    fn scale(&mut self, by: [f64; 3]) {
        (0..3).for_each(|c| self.throughput[c] *= by[c]);
    }

    /// Goes on from `origin`, which may lie on triangle `skip`.
    fn turn(&mut self, origin: DVec3, direction: DVec3, skip: u32) {
        self.ray = Ray { origin, direction };
        self.t = 0.0;
        self.filter = Filter { skip, ..Filter::START };
    }

    /// Russian roulette; false when the path ends.
    fn survives(&mut self, rng: &mut Stream) -> bool {
        self.events += 1;
        let largest = self.throughput.iter().fold(0.0, |m: f64, w| m.max(w.abs()));
        let limit = if self.events > PATIENCE { PATIENT_SURVIVAL } else { 1.0 };
        let chance = largest.min(limit);
        if chance >= 1.0 {
            return true;
        }
        if rng.unit() >= chance {
            return false;
        }
        self.scale([1.0 / chance; 3]);
        true
    }
}

/// What scatters light at a vertex, and the share of shadow that it receives.
struct Vertex {
    scatter: Scatter,
    shadow_coefficient: f64,
}

/// A place that reflects light about a normal, a surface's or a medium's.
struct Mirror<'a> {
    point: DVec3,
    response: Response,
    liberty: &'a Liberty,
    /// The triangle that it lies on.
    on: Option<u32>,
}

enum Scatter {
    Medium { travel: DVec3, asymmetry: f64 },
    Surface(Response),
}

impl Vertex {
    /// Share of the light from unit direction `to_light` per unit irradiance on a facing plane, and the density of
    /// sampling that direction.
    fn toward(&self, to_light: DVec3) -> ([f64; 3], f64) {
        match &self.scatter {
            Scatter::Medium { travel, asymmetry } => {
                let p = henyey_greenstein(*travel, to_light, *asymmetry);
                ([p; 3], p)
            }
            Scatter::Surface(response) => response.toward(to_light),
        }
    }
}

impl<'a> Tracer<'a> {
    pub(crate) fn new(scene: &'a Scene<'a>, rules: PathRules) -> Result<Self, splat_core::Error> {
        scene.validate()?;
        check_gains(scene, rules)?;
        let meshes: Vec<_> = scene.surfaces.iter().map(|s| s.mesh).collect();
        let volume = Volume::new(scene.media.clone());
        let casting: Vec<_> = scene.media.iter().filter(|m| m.liberty.casts_shadow).copied().collect();
        let casters = (casting.len() < scene.media.len()).then(|| Volume::new(casting));
        let lit = |l: &LightSource| l.intensity(DVec3::ZERO).iter().any(|i| *i > 0.0) || l.pole().is_some();
        let lamp = |(i, source): (usize, &LightSource)| Lamp {
            source: *source,
            rank: i,
            shadowed: !scene.unshadowed.get(i).copied().unwrap_or(false),
        };
        let lamps = scene.lights.iter().enumerate().filter(|(_, l)| lit(l)).map(lamp);
        let lights: Vec<Lamp> = lamps.collect();
        let inside = |l: &Lamp| match (l.source.pole(), volume.bounds()) {
            (Some(p), Some(b)) => b.contains(p),
            _ => false,
        };
        let (along_segments, at_vertices) = lights.iter().partition(|l| inside(l));
        Ok(Self {
            scene,
            visibility: Visibility::new(&meshes)?,
            volume,
            casters,
            at_vertices,
            along_segments,
            areas: lights.into_iter().map(|l| l.source).filter(LightSource::is_area).collect(),
            rules,
            free: scene.frees_shadows(),
        })
    }

    /// Lookups so far that exceeded their majorant.
    pub(crate) fn violations(&self) -> u64 {
        self.volume.violations() + self.casters.as_ref().map_or(0, Volume::violations)
    }

    /// Radiance that arrives along a ray backwards, one sample, and the path's scattering events.
    pub(crate) fn radiance(&self, ray: Ray, rng: &mut Stream) -> ([f64; 3], u32) {
        let mut path = Path {
            ray,
            t: 0.0,
            filter: Filter::START,
            throughput: [1.0; 3],
            density: None,
            bounces: 0,
            is_over: false,
            events: 0,
            radiance: [0.0; 3],
        };
        while self.segment(&mut path, rng) {}
        (path.radiance, path.bounces)
    }

    fn may_scatter(&self, path: &Path) -> bool {
        !path.is_over && self.rules.max_bounces.is_none_or(|most| path.bounces < most)
    }

    /// Follows the path to its next event; false when it ends.
    fn segment(&self, path: &mut Path, rng: &mut Stream) -> bool {
        let hit = self.visibility.next(&path.ray, path.filter, f64::INFINITY);
        let end = hit.map_or(f64::INFINITY, |h| h.t);
        if !self.along_segments.is_empty() && self.may_scatter(path) {
            self.gather_along(path, end, rng);
        }
        loop {
            let (area, stop) = self.next_area(path, end);
            if let Some(c) = self.volume.collide(&path.ray, path.t, stop, &mut path.throughput, rng) {
                return self.scatter_in_medium(path, &c, rng);
            }
            path.t = stop;
            match area {
                Some(light) => self.meet_light(path, light),
                None => break,
            }
        }
        match hit {
            Some(hit) => self.meet_surface(path, &hit, rng),
            None => {
                self.escape(path);
                false
            }
        }
    }

    fn next_area(&self, path: &Path, end: f64) -> (Option<&LightSource>, f64) {
        let mut nearest = (None, end);
        for light in &self.areas {
            if let Some(t) = light.hit(&path.ray, path.t)
                && t < nearest.1
            {
                nearest = (Some(light), t);
            }
        }
        nearest
    }

    /// The path crosses the shining side of an area light.
    fn meet_light(&self, path: &mut Path, light: &LightSource) {
        let factor = match path.density {
            None if path.events == 0 && !self.rules.lights_visible => 0.0,
            None => 1.0,
            Some(_) if self.free => 0.0,
            Some(density) => {
                let other = light.density(path.ray.origin, path.ray.direction, path.t) / self.at_vertices.len() as f64;
                density / (density + other)
            }
        };
        path.add(light.intensity(path.ray.origin), factor);
    }

    fn escape(&self, path: &mut Path) {
        let environment = &self.scene.environment;
        if path.bounces > 0 && !self.rules.environment_illuminates {
            return;
        }
        match (path.density, self.scene.background) {
            (None, Some(background)) if path.events == 0 => path.add(background, 1.0),
            (Some(density), _) if environment.is_sampled() => {
                let other = environment.density(path.ray.direction);
                path.add(environment.radiance(path.ray.direction), density / (density + other));
            }
            _ => path.add(environment.radiance(path.ray.direction), 1.0),
        }
    }

    fn scatter_in_medium(&self, path: &mut Path, c: &Collision, rng: &mut Stream) -> bool {
        let medium = &self.scene.media[c.medium];
        if path.bounces == 0 || self.rules.emission_illuminates {
            path.add(medium.emitted(c.point), 1.0);
        }
        let travel = path.ray.direction;
        let (albedo, asymmetry) = match medium.event(c.point, -travel) {
            Event::Reflected(response) => {
                return self.reflect(
                    path,
                    Mirror { point: c.point, response, liberty: &medium.liberty, on: None },
                    rng,
                );
            }
            Event::Scattered { albedo, asymmetry } => (albedo, asymmetry),
        };
        if !self.may_scatter(path) {
            return false;
        }
        path.bounces += 1;
        path.scale(albedo.map(|a| a * medium.liberty.gain));
        if !path.survives(rng) {
            return false;
        }
        let scatter = Scatter::Medium { travel, asymmetry };
        let vertex = Vertex { scatter, shadow_coefficient: medium.liberty.shadow_coefficient };
        path.turn(c.point, travel, u32::MAX);
        self.gather(path, &vertex, &self.at_vertices, u32::MAX, rng);
        self.gather_environment(path, &vertex, u32::MAX, rng);
        let direction = sample_henyey_greenstein(travel, asymmetry, rng.pair());
        path.turn(c.point, direction, u32::MAX);
        path.density = Some(henyey_greenstein(travel, direction, asymmetry));
        true
    }

    fn meet_surface(&self, path: &mut Path, hit: &Hit, rng: &mut Stream) -> bool {
        let surface = &self.scene.surfaces[hit.mesh as usize];
        let travel = path.ray.direction;
        let geometric = self.visibility.normal(hit.id);
        if let SurfaceKind::Dielectric(glass) = &surface.material.kind {
            return interface(path, hit, glass, surface.normal(hit.triangle, hit.uv, geometric), geometric, rng);
        }
        let opacity = surface.material.opacity(geometric.dot(travel));
        if !meets(path, opacity, rng) {
            path.t = hit.t;
            path.filter.after = (hit.t, hit.id);
            return path.throughput.iter().any(|w| *w != 0.0);
        }
        let color = surface.color(hit.triangle, hit.uv);
        if path.bounces == 0 || self.rules.emission_illuminates {
            path.add(surface.material.emitted(color), 1.0);
        }
        let response = surface.material.response(color, surface.normal(hit.triangle, hit.uv, geometric), -travel);
        let point = path.ray.at(hit.t);
        self.reflect(path, Mirror { point, response, liberty: &surface.material.liberty, on: Some(hit.id) }, rng)
    }

    /// Light that is reflected about a normal; false when the path ends.
    fn reflect(&self, path: &mut Path, mirror: Mirror<'_>, rng: &mut Stream) -> bool {
        if !self.may_scatter(path) || self.rules.reflects_apart && path.bounces > 0 {
            return false;
        }
        path.bounces += 1;
        path.is_over = self.rules.reflects_apart;
        let Mirror { point, response, liberty, on } = mirror;
        let skip = on.unwrap_or(u32::MAX);
        path.turn(point, path.ray.direction, skip);
        path.scale([liberty.gain; 3]);
        let vertex = Vertex { scatter: Scatter::Surface(response), shadow_coefficient: liberty.shadow_coefficient };
        self.gather(path, &vertex, &self.at_vertices, skip, rng);
        // Inside a medium these were gathered along the segment.
        if on.is_some() {
            self.gather(path, &vertex, &self.along_segments, skip, rng);
        }
        self.gather_environment(path, &vertex, skip, rng);
        let Some((direction, weight, density)) = response.sample(rng) else { return false };
        path.turn(point, direction, skip);
        path.density = Some(density);
        path.scale(weight);
        path.survives(rng)
    }
}

/// What makes light must not go on for ever.
fn check_gains(scene: &Scene<'_>, rules: PathRules) -> Result<(), splat_core::Error> {
    let media = scene.media.iter().map(|m| ("medium", m.liberty.gain)).enumerate();
    let surfaces = scene.surfaces.iter().map(|s| ("surface", s.material.liberty.gain)).enumerate();
    match media.chain(surfaces).find(|(_, (_, gain))| *gain > 1.0) {
        Some((i, (element, gain))) if rules.max_bounces.is_none() => {
            Err(splat_core::Error::invalid(element, i, "gain", gain, "at most 1, or a number of bounces"))
        }
        _ => Ok(()),
    }
}

/// Whether a path meets a translucent surface or goes straight on, with weights that suit channels of other opacity.
fn meets(path: &mut Path, opacity: [f64; 3], rng: &mut Stream) -> bool {
    let w = path.throughput.map(f64::abs);
    let stop: f64 = (0..3).map(|c| w[c] * opacity[c]).sum();
    let pass: f64 = (0..3).map(|c| w[c] * (1.0 - opacity[c])).sum();
    if pass <= 0.0 {
        return true;
    }
    let met = rng.unit() * (stop + pass) < stop;
    let chance = if met { stop } else { pass } / (stop + pass);
    path.scale(opacity.map(|a| if met { a } else { 1.0 - a } / chance));
    met
}

/// Reflection or refraction at a dielectric; false when the path ends.
fn interface(
    path: &mut Path,
    hit: &Hit,
    glass: &Dielectric,
    shading: DVec3,
    geometric: DVec3,
    rng: &mut Stream,
) -> bool {
    let travel = path.ray.direction;
    let leaving = geometric.dot(travel) > 0.0;
    if leaving {
        path.scale(glass.absorption.map(|a| (-a * hit.t).exp()));
    }
    let alive: [usize; 3] = std::array::from_fn(|c| usize::from(path.throughput[c] != 0.0));
    let count = alive.iter().sum::<usize>();
    let mut channel = alive.iter().position(|a| *a == 1).unwrap_or(0);
    if count > 1 && !glass.is_achromatic() {
        // Channels part here: one goes on for all.
        let pick = ((rng.unit() * count as f64) as usize).min(count - 1);
        channel = (0..3).filter(|c| alive[*c] == 1).nth(pick).unwrap_or(channel);
        path.throughput = std::array::from_fn(|c| if c == channel { path.throughput[c] * count as f64 } else { 0.0 });
    }
    let eta = if leaving { 1.0 / glass.eta[channel] } else { glass.eta[channel] };
    let toward = |n: DVec3| if n.dot(travel) > 0.0 { -n } else { n };
    let face = toward(geometric);
    let mut normal = toward(shading);
    if normal.dot(face) <= 0.0 {
        normal = face;
    }
    let mirrored = rng.unit() < fresnel_reflectance(-normal.dot(travel), eta);
    let turned = |n: DVec3| if mirrored { Some(reflect(travel, n)) } else { refract(travel, n, eta) };
    // An interpolated normal may turn the ray to the wrong side of the triangle.
    let right_side = |d: &DVec3| (d.dot(face) > 0.0) == mirrored;
    let direction = turned(normal).filter(right_side).or_else(|| turned(face).filter(right_side));
    let Some(direction) = direction else { return false };
    path.turn(path.ray.at(hit.t), direction, hit.id);
    path.density = None;
    path.survives(rng)
}
