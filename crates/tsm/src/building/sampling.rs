//! Sampling: a footprint on the rays of cells, exact for the ray's direction.
//!
//! Samples footprints of several cells, and footprints that the table's derivatives at their centre do not describe.
//! Nearer to the light than three radii, a splat is swept over the whole table with its optical depth along each
//! half-ray; within one radius only the part of the kernel ahead of the light counts.

use crate::building::caster::Caster;
use crate::building::rays::{MOST_SAMPLES, Rays, place};
use crate::mapping::{Mapping, Ray};
use glam::{Vec2, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::{SplatKind, glam};

/// Casters larger than this share of their distance are swept over the whole table.
pub(crate) const NEAR: f32 = 0.35;
/// Rays that a well sampled footprint has from its centre to its rim.
const RESOLVED: f32 = 2.0;
/// By how much of itself the sum over a resolved footprint may differ from its true area before it counts as torn.
const TORN: f64 = 1e-3;

/// A footprint on the rays of cells.
#[derive(Debug, Default)]
pub(crate) struct Sampled {
    /// Cells to be sampled, by cell, column and row.
    window: Vec<[u32; 3]>,
    /// Cell, weight, and distance of the entry.
    pub(crate) cells: Vec<(u32, f32, f32)>,
    /// Absorbance per weight.
    pub(crate) scale: f32,
}

impl Sampled {
    /// Samples `samples`² rays of each cell within about `half` of `at`.
    pub(crate) fn fill<M: Mapping>(&mut self, mapping: &M, caster: &Caster, at: Vec2, half: Vec2, samples: u32) {
        self.open_window(mapping, at, half);
        self.cells.clear();
        let work = Rays { mapping, caster, samples, near: false, window: &self.window, cells: &mut self.cells };
        let norm = pulp::Arch::new().dispatch(work);
        // Normalising by the samples keeps K to the last digit. Where they resolve the footprint and yet do not add up
        // (it is clipped by the table, or torn by a corner of a folded one), its true area keeps the optical depth of
        // each ray instead.
        let exact = f64::from(footprint_area(caster));
        let unresolved = f64::from(RESOLVED / (half.min_element() * samples as f32)).max(1.0);
        // Rays about a pole or a corner do not add up either, but miss nothing.
        let pole = f64::from((1.5 / mapping.clearance(at, half)).max(1.0));
        let slack = TORN * (unresolved * pole).powi(16);
        let norm = norm.max((1.0 - slack).max(1e-3) * exact).min((1.0 + slack) * exact);
        self.scale = (f64::from(caster.cross_section) / norm) as f32;
    }

    /// Finds the cells within about `half` of `at`.
    fn open_window<M: Mapping>(&mut self, mapping: &M, at: Vec2, half: Vec2) {
        let [columns, rows] = mapping.size().map(|n| n as i32);
        // Across a fold columns and rows may change places.
        let reach = if mapping.is_folded() { Vec2::splat(half.max_element()) } else { half } * 1.2 + 0.5;
        let span = |centre: f32, reach: f32, n: i32| {
            if 2.0 * reach >= n as f32 { 0..n } else { (centre - reach).floor() as i32..(centre + reach).ceil() as i32 }
        };
        let us = span(at.x, reach.x, columns);
        let vs = span(at.y, reach.y, rows);
        self.window.clear();
        for row in vs.clone() {
            for column in us.clone() {
                let Some(cell) = mapping.wrap(column, row) else { continue };
                let u = cell % columns as u32;
                let v = cell / columns as u32;
                // Beside some corners of a folded table, what lies beyond an edge lies within reach on this side too.
                let direct = (0..columns).contains(&column) && (0..rows).contains(&row);
                if direct || !(us.contains(&(u as i32)) && vs.contains(&(v as i32))) {
                    self.window.push([cell, u, v]);
                }
            }
        }
    }

    /// Samples every cell along half-rays, for a caster near or around the light.
    pub(crate) fn sweep<M: Mapping>(&mut self, mapping: &M, caster: &Caster) {
        let [columns, rows] = mapping.size();
        let side = (mapping.measure((rows / 2) * columns + columns / 2).max(0.0) as f32).sqrt();
        let samples = (RESOLVED * side / NEAR).ceil().clamp(1.0, MOST_SAMPLES as f32) as u32;
        // Several go in pairs, see [`place`].
        let samples = if samples == 1 { 1 } else { samples.next_multiple_of(2) };
        self.window.clear();
        self.window.extend((0..columns * rows).map(|cell| [cell, cell % columns, cell / columns]));
        self.cells.clear();
        let window = &self.window;
        let work = Rays { mapping, caster, samples, near: true, window, cells: &mut self.cells };
        pulp::Arch::new().dispatch(work);
        self.scale = caster.cross_section / footprint_area(caster);
    }
}

/// Mean weight of a disc in a cell, the area of it that the cell covers, and the distance of the entry.
pub(crate) fn sample_disc<M: Mapping>(mapping: &M, caster: &Caster, cell: u32, samples: u32) -> (f32, f32, f32) {
    let parallel = mapping.is_parallel();
    let [columns, _] = mapping.size();
    let inverse_measure = mapping.inverse_measure(cell % columns, cell / columns);
    if samples == 1 {
        let Some(s) = meet_disc(caster, &mapping.cell_ray(cell), parallel) else { return (0.0, 0.0, 0.0) };
        return (s.weight * s.gain, s.weight * s.jacobian / inverse_measure, s.distance);
    }
    let corner = Vec2::new((cell % columns) as f32, (cell / columns) as f32);
    let mut weight = 0.0;
    let mut area = 0.0;
    let mut distance = 0.0;
    let mut total = 0.0;
    for k in 0..samples * samples {
        let step = Vec2::new(place(k % samples, samples), place(k / samples, samples));
        let ray = mapping.ray(corner + step);
        let density = mapping.density(&ray);
        total += density;
        let Some(s) = meet_disc(caster, &ray, parallel) else { continue };
        weight += density * s.weight * s.gain;
        area += density * s.weight * s.jacobian;
        distance += density * s.weight * s.gain * s.distance;
    }
    if weight <= 0.0 {
        return (0.0, 0.0, 0.0);
    }
    (weight / total, area / (total * inverse_measure), distance / weight)
}

/// ∫ profile dA over the footprint's plane or disc.
fn footprint_area(caster: &Caster) -> f32 {
    let radii = if caster.kind == SplatKind::Medium {
        caster.radius * caster.radius
    } else {
        caster.axes[0].length() * caster.axes[1].length()
    };
    radii / caster.kernel.norm
}

/// A disc on one ray.
struct Sample {
    weight: f32,
    /// Area of the footprint per measure of the table.
    jacobian: f32,
    gain: f32,
    distance: f32,
}

/// Share of the kernel's chord that lies ahead of the light, and its mean distance; the kernel along the chord is a
/// Gaussian cut where the kernel ends.
pub(crate) fn ahead(caster: &Caster, along: f32, s: f32) -> Option<(f32, f32)> {
    let half = caster.radius * (1.0 - s).sqrt();
    if along >= half {
        return Some((1.0, along));
    }
    if along <= -half {
        return None;
    }
    let sigma = f64::from(caster.radius / caster.kernel.cutoff);
    let [t, end] = [along, half].map(|x| f64::from(x) / sigma);
    let part = |t: f64| 0.5 * erf(t * std::f64::consts::FRAC_1_SQRT_2);
    let density = |t: f64| libm::exp(-0.5 * t * t) / (2.0 * std::f64::consts::PI).sqrt();
    let before = part(t) + part(end);
    let whole = 2.0 * part(end);
    let mean = sigma * (t + (density(t) - density(end)) / before.max(1e-6));
    Some(((before / whole) as f32, mean.max(sigma / 1024.0) as f32))
}

#[inline]
fn meet_disc(caster: &Caster, ray: &Ray, parallel: bool) -> Option<Sample> {
    let cosine = ray.direction.dot(caster.normal);
    let t = (caster.position - ray.base).dot(caster.normal) / cosine;
    if !(t > 0.0 && t.is_finite()) {
        return None;
    }
    let s = disc_coordinate(caster.axes, ray.base + ray.direction * t - caster.position);
    if s >= 1.0 {
        return None;
    }
    let cosine = cosine.abs();
    let stretch = 1.0 / cosine;
    let jacobian = if parallel { stretch } else { t * t * stretch };
    let gain = if caster.extinction.opacity == SurfaceOpacity::PerCrossing {
        1.0
    } else {
        caster.extinction.opacity.optical_depth_factor(cosine)
    };
    Some(Sample { weight: caster.kernel.profile(s), jacobian, gain, distance: t })
}

/// Squared distance of a point of the disc's plane from its centre, in semi-axes.
#[inline(always)]
pub(crate) fn disc_coordinate(axes: [Vec3; 2], hit: Vec3) -> f32 {
    let [a, b] = axes;
    (hit.dot(a) / a.length_squared()).powi(2) + (hit.dot(b) / b.length_squared()).powi(2)
}

/// The error function; its absolute error is below 1.5e-7 (Abramowitz and Stegun 7.1.26).
pub(crate) fn erf(x: f64) -> f64 {
    const A: [f64; 5] = [0.254_829_592, -0.284_496_736, 1.421_413_741, -1.453_152_027, 1.061_405_429];
    let t = 1.0 / (1.0 + 0.327_591_1 * x.abs());
    let sum = A.iter().rev().fold(0.0, |s, a| (s + a) * t);
    (1.0 - sum * libm::exp(-x * x)).copysign(x)
}
