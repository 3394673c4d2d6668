//! Ray marching of media with error control: transmittance, emission and single scattering along a ray.
//!
//! L = ∫T(t)·σ(t)·[S + Σ_lights ω·p·I·T_light/d²] dt + T·L_background, T = e^−∫σ; with [`crate::Facets`] a surface's response
//! stands for ω·p. A ray is cut where a density is not smooth (boxes, balls, lattice planes, values of control points, roots of fields). Between cuts of piecewise cubic densities the two-point Gauss
//! rule gives the optical depth exactly; other densities, and the light, are integrated adaptively
//! ([`MarchParams`]). Near a light without extent t = t_c + D·tan θ (D the distance of the ray) turns dt/d² into dθ/D, so
//! the integrand stays smooth (equiangular substitution). A ray through the light itself has no finite value: its error
//! is infinite.

use crate::lights::LightSource;
use crate::media::medium::Medium;
use crate::media::quadrature::{Integral, MarchParams, integrate};
use crate::ray::Ray;
use crate::scene::Scene;
use rayon::prelude::*;
use splat_core::{Camera, Error, Progress};

/// Radiance and transmittance of one ray.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct MarchedRay {
    /// Emitted and once scattered radiance, W·m⁻²·sr⁻¹; nothing from behind the media.
    pub radiance: Integral,
    /// Transmittance of the ray.
    pub transmittance: Integral,
}

/// An image by ray marching, through the centres of the pixels, row by row from the top left.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct MarchedImage {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Radiance with the background.
    pub radiance: Vec<[f64; 3]>,
    /// Error of the radiance.
    pub error: Vec<[f64; 3]>,
    /// Transmittance to the background.
    pub transmittance: Vec<[f64; 3]>,
}

/// Optical depth of media along a ray between two distances; `t1` may be infinite.
pub fn optical_depth(media: &[Medium<'_>], ray: &Ray, t0: f64, t1: f64, params: &MarchParams) -> Integral {
    Line::new(media, *ray, t0, t1, params).total()
}

/// Radiance and transmittance of media lit by points, spots and parallel light; `t1` may be infinite.
///
/// # Errors
/// [`Error::Invalid`] for an area light, whose shadows are soft, and for a medium with a [`crate::Liberty`]: ask the path
/// tracer.
pub fn march(
    media: &[Medium<'_>],
    lights: &[LightSource],
    ray: &Ray,
    range: [f64; 2],
    params: &MarchParams,
) -> Result<MarchedRay, Error> {
    let [t0, t1] = range;
    if let Some(i) = lights.iter().position(LightSource::is_area) {
        return Err(Error::invalid("light", i, "shape", lights[i], "a point, spot or parallel light"));
    }
    media.iter().enumerate().try_for_each(|(i, m)| m.liberty.refuse("medium", i))?;
    // Inner integrals are ten times more exact, so that the outer one sees a smooth function.
    let inner = MarchParams { relative_tolerance: params.relative_tolerance * 0.1, ..*params };
    let line = Line::new(media, *ray, t0, t1, &inner);
    let depth = line.total();
    let transmittance = Integral {
        value: depth.value.map(|d| (-d).exp()),
        error: std::array::from_fn(|c| (-depth.value[c]).exp() * depth.error[c]),
        evaluations: depth.evaluations,
    };
    let mut radiance = Integral::default();
    if media.iter().any(Medium::emits) {
        radiance.add(&integrate(|t| line.emitted(t), &line.cuts, params));
    }
    for light in lights {
        radiance.add(&line.lit_by(light, params));
    }
    let slack = inner.relative_tolerance;
    (0..3).for_each(|c| radiance.error[c] += slack * radiance.value[c].abs());
    Ok(MarchedRay { radiance, transmittance })
}

/// Marches a ray through the centre of every pixel. The environment and the background are seen behind the media; they
/// light nothing. Rows of pixels are reported to `progress`, and work stops where that is cancelled.
///
/// # Errors
/// As [`Scene::validate`] and [`march`]; [`Error::Invalid`] for a scene with surfaces; [`Error::Cancelled`].
pub fn march_image(
    scene: &Scene<'_>,
    camera: &Camera,
    params: &MarchParams,
    progress: Option<&Progress>,
) -> Result<MarchedImage, Error> {
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    scene.validate()?;
    scene.refuse_liberties()?;
    if !scene.surfaces.is_empty() {
        return Err(Error::invalid("surface", 0, "technique", "ray marching", "media alone; ask the path tracer"));
    }
    let [width, height] = camera.size;
    progress.add_total(u64::from(height));
    let rows: Result<Vec<Vec<MarchedPixel>>, Error> = (0..height)
        .into_par_iter()
        .map(|y| {
            progress.tick(1)?;
            (0..width).map(|x| pixel(scene, camera, params, x, y)).collect()
        })
        .collect();
    let mut image = MarchedImage { size: camera.size, ..MarchedImage::default() };
    for p in rows?.into_iter().flatten() {
        image.radiance.push(p.radiance);
        image.error.push(p.error);
        image.transmittance.push(p.transmittance);
    }
    Ok(image)
}

struct MarchedPixel {
    radiance: [f64; 3],
    error: [f64; 3],
    transmittance: [f64; 3],
}

fn pixel(scene: &Scene<'_>, camera: &Camera, params: &MarchParams, x: u32, y: u32) -> Result<MarchedPixel, Error> {
    let ray = Ray::of_pixel(camera, f64::from(x) + 0.5, f64::from(y) + 0.5);
    let marched = march(&scene.media, &scene.lights, &ray, [0.0, f64::INFINITY], params)?;
    let behind = scene.background.unwrap_or_else(|| scene.environment.radiance(ray.direction));
    let light = marched.radiance;
    let through = marched.transmittance;
    Ok(MarchedPixel {
        radiance: std::array::from_fn(|c| light.value[c] + through.value[c] * behind[c]),
        error: std::array::from_fn(|c| light.error[c] + through.error[c] * behind[c]),
        transmittance: through.value,
    })
}

/// A ray cut where its densities are not smooth, with the optical depth up to each cut.
struct Line<'a> {
    media: &'a [Medium<'a>],
    ray: Ray,
    params: MarchParams,
    cuts: Vec<f64>,
    depth: Vec<Integral>,
    cubic: bool,
}

impl<'a> Line<'a> {
    fn new(media: &'a [Medium<'a>], ray: Ray, t0: f64, t1: f64, params: &MarchParams) -> Self {
        let mut cuts = Vec::new();
        media.iter().for_each(|m| m.density.breaks(&ray, t0, t1, &mut cuts));
        cuts.retain(|t| t.is_finite() && *t >= t0 && *t <= t1);
        cuts.sort_by(f64::total_cmp);
        cuts.dedup();
        let cubic = media.iter().all(|m| m.density.is_piecewise_cubic());
        let mut line = Self { media, ray, params: *params, cuts, depth: Vec::new(), cubic };
        let mut sum = Integral::default();
        line.depth.push(sum);
        for i in 1..line.cuts.len() {
            sum.add(&line.piece(line.cuts[i - 1], line.cuts[i]));
            line.depth.push(sum);
        }
        line
    }

    fn total(&self) -> Integral {
        self.depth.last().copied().unwrap_or_default()
    }

    /// Extinction per channel at a distance.
    fn extinction(&self, t: f64) -> [f64; 3] {
        let p = self.ray.at(t);
        let mut sum = [0.0; 3];
        for medium in self.media {
            let density = medium.density.value(p);
            (0..3).for_each(|c| sum[c] += medium.extinction[c] * density);
        }
        sum
    }

    /// Optical depth of a stretch without cuts.
    fn piece(&self, a: f64, b: f64) -> Integral {
        if !self.cubic {
            return integrate(|t| self.extinction(t), &[a, b], &self.params);
        }
        // ±1/√3 of the half length: exact for cubics.
        let middle = a + 0.5 * (b - a);
        let half = 0.5 * (b - a);
        let p = self.extinction(middle - half / 3f64.sqrt());
        let q = self.extinction(middle + half / 3f64.sqrt());
        let value: [f64; 3] = std::array::from_fn(|c| (p[c] + q[c]) * half);
        Integral { value, error: value.map(|v| 4.0 * f64::EPSILON * v), evaluations: 2 }
    }

    fn transmittance(&self, t: f64) -> [f64; 3] {
        let i = self.cuts.partition_point(|c| *c <= t);
        if i == 0 {
            return [1.0; 3];
        }
        let before = self.depth[i - 1].value;
        let rest = if i < self.cuts.len() { self.piece(self.cuts[i - 1], t).value } else { [0.0; 3] };
        std::array::from_fn(|c| (-(before[c] + rest[c])).exp())
    }

    fn emitted(&self, t: f64) -> [f64; 3] {
        let p = self.ray.at(t);
        let left = self.transmittance(t);
        let mut sum = [0.0; 3];
        for medium in self.media {
            let density = medium.density.value(p);
            if density <= 0.0 {
                continue;
            }
            let emitted = medium.emitted(p);
            (0..3).for_each(|c| sum[c] += left[c] * density * medium.extinction[c] * emitted[c]);
        }
        sum
    }

    /// Light scattered or reflected towards the eye at a distance, per unit of 1/d² for a light with a pole.
    fn scattered(&self, light: &LightSource, t: f64) -> [f64; 3] {
        let p = self.ray.at(t);
        let density_at = |m: &Medium<'_>| m.density.value(p);
        if self.media.iter().all(|m| density_at(m) <= 0.0) {
            return [0.0; 3];
        }
        let (to_light, distance) = match (light, light.pole()) {
            (_, Some(pole)) => ((pole - p).normalize_or_zero(), (pole - p).length()),
            (LightSource::Directional { direction, .. }, _) => (-*direction, f64::INFINITY),
            _ => return [0.0; 3],
        };
        let shadow = Ray { origin: p, direction: to_light };
        let depth = optical_depth(self.media, &shadow, 0.0, distance, &self.params).value;
        let left = self.transmittance(t);
        let intensity = light.intensity(p);
        let mut sum = [0.0; 3];
        for medium in self.media {
            let density = density_at(medium);
            if density > 0.0 {
                let share = medium.toward(p, to_light, -self.ray.direction);
                (0..3).for_each(|c| sum[c] += medium.extinction[c] * density * share[c]);
            }
        }
        std::array::from_fn(|c| sum[c] * left[c] * intensity[c] * (-depth[c]).exp())
    }

    fn lit_by(&self, light: &LightSource, params: &MarchParams) -> Integral {
        let Some(pole) = light.pole() else {
            return integrate(|t| self.scattered(light, t), &self.cuts, params);
        };
        let middle = (pole - self.ray.origin).dot(self.ray.direction);
        let apart = (pole - self.ray.at(middle)).length();
        if apart == 0.0 {
            return self.through_pole(light, middle);
        }
        let angles: Vec<f64> = self.cuts.iter().map(|t| (t - middle).atan2(apart)).collect();
        let f = |angle: f64| self.scattered(light, middle + apart * angle.tan()).map(|v| v / apart);
        integrate(f, &angles, params)
    }

    /// A ray through the light: finite only when no matter is near it.
    fn through_pole(&self, light: &LightSource, pole: f64) -> Integral {
        let in_matter =
            self.cuts.windows(2).any(|w| w[0] <= pole && pole <= w[1] && self.piece(w[0], w[1]).value != [0.0; 3]);
        if in_matter {
            return Integral { value: [0.0; 3], error: [f64::INFINITY; 3], evaluations: 0 };
        }
        let f = |t: f64| self.scattered(light, t).map(|v| v / ((t - pole) * (t - pole)));
        integrate(f, &self.cuts, &self.params)
    }
}
