//! Deposits: how much absorbance one translucent splat leaves in every cell it covers.
//!
//! A_c = K·g·f_c/(Ω_c·d²), Σ f_c = 1, so that Σ A_c·Ω_c·d² = K·g whatever the size of the cells
//!
//! | symbol | |
//! |---|---|
//! | K | cross-section of the splat |
//! | g | 1 for media, \|cos θ\| for a disc with one opacity at every angle, 1 for a thin slab |
//! | f_c | fraction of the footprint in cell c |
//! | Ω_c, d | solid angle of the cell, distance of the splat; for parallel light d = 1 and Ω is an area |
//!
//! Two ways to the fractions: a footprint of less than about two cells is integrated over each cell exactly, as a
//! product of cumulative biweights with the footprint's variances in table coordinates; a larger one is sampled at the
//! cells' rays. The paper (Gunjee 2007, section 4.1) adds the full absorbance to every covered cell instead, so that
//! its shadows darken with the size of the table; `AbsorbanceModel::Paper` does that.
//!
//! Nearer to the light than three radii, a splat is swept over the whole table with its optical depth along each
//! half-ray; within one radius only the part of the kernel ahead of the light counts.

use crate::caster::Caster;
use crate::mapping::{Mapping, Ray};
use crate::reference::erf;
use crate::shares::{BIWEIGHT, LONGEST, Shares};
use crate::table::{Entries, Knot};
use glam::{Vec2, Vec3};
use splat_core::optics::SurfaceOpacity;
use splat_core::{SplatKind, glam};

/// Casters larger than this share of their distance are swept over the whole table.
pub(crate) const NEAR: f32 = 0.35;
/// Least half width of a footprint, cells.
const LEAST_HALF: f32 = 1e-4;
/// Footprints that lean by fewer cells than this over their height count as upright.
const UPRIGHT: f32 = 0.02;
/// A uniform row of height 1 has a variance of 1/12; in squared half widths of a biweight that is 7/12.
const ROW_WIDTH: f32 = 7.0 / 12.0;
/// Most rays along a side of a cell.
const FINEST: u32 = 16;
/// Footprints that span fewer cells than this from centre to rim are not sampled for lying across a crease.
const CREASE: f32 = 1.4;
/// Cells that a sampled footprint spans at least, from its centre to its rim.
const SAMPLES: f32 = 2.0;

/// Distance along `ray` to the plane through `p` with normal `n`; `None` where the ray never meets it.
#[inline]
pub(crate) fn plane_distance(p: Vec3, n: Vec3, ray: &Ray) -> Option<f32> {
    let t = (p - ray.base).dot(n) / ray.direction.dot(n);
    (t > 0.0 && t.is_finite()).then_some(t)
}

/// Buffers of one worker, reused from splat to splat.
#[derive(Debug, Default)]
pub(crate) struct Scratch {
    sampled: Vec<(u32, f32, f32)>,
}

/// What a table holds while it is filled: where opaque discs end every list, and the entries so far.
pub(crate) struct Deposit<'a, M: Mapping, const C: usize> {
    pub(crate) mapping: &'a M,
    /// Distance of the nearest opaque disc of each cell; empty without any.
    pub(crate) opaque: &'a [f32],
    pub(crate) media: Entries<C>,
    pub(crate) surfaces: Entries<C>,
    pub(crate) scratch: Scratch,
}

impl<M: Mapping, const C: usize> Deposit<'_, M, C> {
    /// Adds one translucent caster (or any, in the paper's model).
    pub(crate) fn add(&mut self, caster: &Caster) {
        let parallel = self.mapping.is_parallel();
        if !parallel && caster.radius > NEAR * caster.distance {
            self.sweep(caster);
            return;
        }
        let Some(place) = self.mapping.locate(caster.position) else { return };
        let spread = Spread::new(caster, self.mapping.gradients(caster.position));
        let half = spread.half_extents();
        let size = Vec2::from(self.mapping.size().map(|n| n as f32));
        let least = half.min_element();
        let creased = least > CREASE && self.mapping.is_creased(place.at, half);
        let long = half.max_element() > 0.5 * LONGEST as f32 - 1.0;
        if least >= SAMPLES || creased || long || (2.0 * half).cmpge(size).any() {
            self.sample(caster, place.at, half, (SAMPLES / least).ceil().clamp(1.0, FINEST as f32) as u32);
        } else {
            let gauss = BIWEIGHT / caster.kernel.cutoff;
            self.overlap(caster, place.at, spread.scaled(gauss * gauss), place.distance);
        }
    }

    /// Exact overlap of a small footprint with each cell: row by row, and within a row by columns about the centre of
    /// the part of the footprint in that row, which follows its slant.
    fn overlap(&mut self, caster: &Caster, at: Vec2, spread: Spread, distance: f32) {
        let half_v = spread.vv.sqrt().max(LEAST_HALF);
        let vs = Shares::new(at.y, half_v);
        let area = if self.mapping.is_parallel() { 1.0 } else { distance * distance };
        let total = caster.cross_section * angle_gain(caster, self.mapping.is_parallel()) / area;
        let mut slant = spread.uv / (half_v * half_v);
        if slant.abs() * half_v < UPRIGHT {
            slant = 0.0;
        }
        // What is left of the width within a row: off the slant, and along it over the row's height.
        let height = (2.0 * half_v).min(1.0);
        let half_u = (spread.uu - slant * spread.uv).max(0.0) + slant * slant * height * height * ROW_WIDTH;
        let half_u = half_u.sqrt().max(LEAST_HALF);
        let mut us = Shares::new(at.x, half_u);
        for j in 0..vs.count {
            if slant != 0.0 {
                us = Shares::new(at.x + slant * (vs.centre(j) - at.y), half_u);
            }
            for i in 0..us.count {
                if let Some(cell) = self.mapping.wrap(us.first + i as i32, vs.first + j as i32) {
                    let share = total * us.share(i) * vs.share(j) * self.mapping.inverse_measure(cell);
                    self.push(caster, cell, share, caster.distance);
                }
            }
        }
    }

    /// Samples a footprint at the rays of cells (`samples`² rays a cell) within `half` of its centre.
    fn sample(&mut self, caster: &Caster, at: Vec2, half: Vec2, samples: u32) {
        let [columns, rows] = self.mapping.size().map(|n| n as i32);
        // Across a fold columns and rows may change places.
        let reach = if self.mapping.is_folded() { Vec2::splat(half.max_element()) } else { half } * 1.2 + 0.5;
        let span = |centre: f32, reach: f32, n: i32| {
            if 2.0 * reach >= n as f32 { 0..n } else { (centre - reach).floor() as i32..(centre + reach).ceil() as i32 }
        };
        let (us, vs) = (span(at.x, reach.x, columns), span(at.y, reach.y, rows));
        let mut sampled = std::mem::take(&mut self.scratch.sampled);
        sampled.clear();
        let mut norm = 0.0f64;
        let mut clipped = false;
        for row in vs.clone() {
            for column in us.clone() {
                let Some(cell) = self.mapping.wrap(column, row) else {
                    clipped = true;
                    continue;
                };
                // Beside some corners of a folded table, what lies beyond an edge lies within reach on this side too.
                let direct = (0..columns).contains(&column) && (0..rows).contains(&row);
                if !direct && us.contains(&(cell as i32 % columns)) && vs.contains(&(cell as i32 / columns)) {
                    continue;
                }
                let (weight, area, distance) = self.sample_cell(caster, cell, samples, false);
                if weight > 0.0 {
                    norm += f64::from(area);
                    sampled.push((cell, weight, distance));
                }
            }
        }
        // Normalising by the samples keeps K to the last digit. Where they resolve the footprint and yet do not add up
        // (it is clipped by the table, or lies across a corner of a folded one), its true area keeps the optical depth
        // of each ray instead.
        let exact = f64::from(footprint_area(caster));
        let resolved = half.min_element() * samples as f32 >= 0.99 * SAMPLES;
        let torn = self.mapping.is_folded() && (norm / exact - 1.0).abs() > 5e-3;
        if norm <= 0.0 || resolved && (clipped || torn) {
            norm = exact;
        }
        let scale = (f64::from(caster.cross_section) / norm) as f32;
        for &(cell, weight, distance) in &sampled {
            self.push(caster, cell, scale * weight, distance);
        }
        self.scratch.sampled = sampled;
    }

    /// A caster near or around the light: every cell, along half-rays.
    fn sweep(&mut self, caster: &Caster) {
        let [columns, rows] = self.mapping.size();
        let side = (self.mapping.measure((rows / 2) * columns + columns / 2).max(0.0) as f32).sqrt();
        let samples = (SAMPLES * side / NEAR).ceil().clamp(1.0, 32.0) as u32;
        let scale = caster.cross_section / footprint_area(caster);
        for cell in 0..columns * rows {
            let (weight, _, distance) = self.sample_cell(caster, cell, samples, true);
            if weight > 0.0 {
                self.push(caster, cell, scale * weight, distance);
            }
        }
    }

    /// Mean weight of a cell, the area of the footprint that it covers, and the distance of the entry.
    fn sample_cell(&self, caster: &Caster, cell: u32, samples: u32, near: bool) -> (f32, f32, f32) {
        let parallel = self.mapping.is_parallel();
        if samples == 1 {
            let Some(s) = sample(caster, &self.mapping.cell_ray(cell), parallel, near) else { return (0.0, 0.0, 0.0) };
            return (s.weight * s.gain, s.weight * s.jacobian / self.mapping.inverse_measure(cell), s.distance);
        }
        let [columns, _] = self.mapping.size();
        let corner = Vec2::new((cell % columns) as f32, (cell / columns) as f32);
        let (mut weight, mut area, mut distance, mut total) = (0.0, 0.0, 0.0, 0.0);
        for k in 0..samples * samples {
            let step = Vec2::new((k % samples) as f32 + 0.5, (k / samples) as f32 + 0.5);
            let ray = self.mapping.ray(corner + step / samples as f32);
            let density = self.mapping.density(&ray);
            total += density;
            let Some(s) = sample(caster, &ray, parallel, near) else { continue };
            weight += density * s.weight * s.gain;
            area += density * s.weight * s.jacobian;
            distance += density * s.weight * s.gain * s.distance;
        }
        if weight <= 0.0 {
            return (0.0, 0.0, 0.0);
        }
        (weight / total, area / (total * self.mapping.inverse_measure(cell)), distance / weight)
    }

    #[inline]
    fn push(&mut self, caster: &Caster, cell: u32, absorbance: f32, distance: f32) {
        let mut distance = distance;
        let mut absorbance = absorbance;
        if let Some(paper) = caster.paper_absorbance {
            absorbance = paper;
            distance = caster.distance;
        } else if caster.kind != SplatKind::Medium {
            let ray = self.mapping.cell_ray(cell);
            distance = plane_distance(caster.position, caster.normal, &ray).unwrap_or(caster.distance);
            if !self.mapping.is_parallel() {
                // Where the plane comes far nearer than the splat, it is no longer that splat's.
                distance = distance.max(0.5 * caster.distance);
            }
        }
        if self.opaque.get(cell as usize).is_some_and(|d| *d < distance) {
            return;
        }
        let list = if caster.kind == SplatKind::Medium && caster.paper_absorbance.is_none() {
            &mut self.media
        } else {
            &mut self.surfaces
        };
        list.cell.push(cell);
        list.knot.push(Knot {
            distance: distance.max(f32::MIN_POSITIVE),
            total: std::array::from_fn(|c| absorbance * caster.extinction.rgb[c]),
        });
    }
}

/// Squared extents of a footprint in table coordinates, from its centre to where the kernel ends: along columns, rows,
/// and their product.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Spread {
    uu: f32,
    vv: f32,
    uv: f32,
}

impl Spread {
    #[inline]
    pub(crate) fn new(caster: &Caster, [gu, gv]: [Vec3; 2]) -> Self {
        if caster.kind == SplatKind::Medium {
            let square = Self { uu: gu.length_squared(), vv: gv.length_squared(), uv: gu.dot(gv) };
            return square.scaled(caster.radius * caster.radius);
        }
        let u = caster.axes.map(|a| gu.dot(a));
        let v = caster.axes.map(|a| gv.dot(a));
        Self { uu: u[0] * u[0] + u[1] * u[1], vv: v[0] * v[0] + v[1] * v[1], uv: u[0] * v[0] + u[1] * v[1] }
    }

    #[inline]
    fn scaled(self, square: f32) -> Self {
        Self { uu: self.uu * square, vv: self.vv * square, uv: self.uv * square }
    }

    #[inline]
    pub(crate) fn half_extents(self) -> Vec2 {
        Vec2::new(self.uu.sqrt(), self.vv.sqrt())
    }
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

/// g: the area that the light sees per area of the disc, times the growth of opacity at that angle.
#[inline]
fn angle_gain(caster: &Caster, parallel: bool) -> f32 {
    if caster.kind == SplatKind::Medium {
        return 1.0;
    }
    // Parallel light travels along the frame's z.
    let cosine = if parallel {
        caster.normal.z.abs()
    } else {
        (caster.position.dot(caster.normal) / caster.position.length()).abs()
    };
    cosine * caster.extinction.opacity.optical_depth_factor(cosine)
}

struct Sample {
    weight: f32,
    /// Area of the footprint per measure of the table.
    jacobian: f32,
    gain: f32,
    distance: f32,
}

#[inline]
fn sample(caster: &Caster, ray: &Ray, parallel: bool, near: bool) -> Option<Sample> {
    if caster.kind == SplatKind::Medium {
        sample_medium(caster, ray, parallel, near)
    } else {
        sample_disc(caster, ray, parallel)
    }
}

#[inline]
fn sample_medium(caster: &Caster, ray: &Ray, parallel: bool, near: bool) -> Option<Sample> {
    let p = caster.position - ray.base;
    let along = p.dot(ray.direction);
    let s = (p - ray.direction * along).length_squared() * caster.inverse_radius_sq;
    if s >= 1.0 || (!near && along <= 0.0) {
        return None;
    }
    let weight = caster.kernel.profile(s);
    if near {
        let (share, distance) = ahead(caster, along, s)?;
        return Some(Sample { weight: weight * share, jacobian: 1.0, gain: 1.0, distance });
    }
    let jacobian = if parallel { 1.0 } else { along * caster.distance };
    Some(Sample { weight, jacobian, gain: 1.0, distance: caster.distance })
}

/// Share of the kernel's chord that lies ahead of the light, and its mean distance; the kernel along the chord is a
/// Gaussian cut where the kernel ends.
fn ahead(caster: &Caster, along: f32, s: f32) -> Option<(f32, f32)> {
    let half = caster.radius * (1.0 - s).sqrt();
    if along >= half {
        return Some((1.0, along));
    }
    if along <= -half {
        return None;
    }
    let sigma = f64::from(caster.radius / caster.kernel.cutoff);
    let t = f64::from(along) / sigma;
    let scale = std::f64::consts::FRAC_1_SQRT_2;
    let share = 0.5 * (1.0 + erf(t * scale) / erf(f64::from(half) / sigma * scale));
    let below = (0.5 * (1.0 + erf(t * scale))).max(1e-6);
    let density = (-0.5 * t * t).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let mean = sigma * (t + density / below);
    Some((share as f32, mean.max(sigma / 1024.0) as f32))
}

#[inline]
fn sample_disc(caster: &Caster, ray: &Ray, parallel: bool) -> Option<Sample> {
    let cosine = ray.direction.dot(caster.normal);
    let t = (caster.position - ray.base).dot(caster.normal) / cosine;
    if !(t > 0.0 && t.is_finite()) {
        return None;
    }
    let s = disc_coordinate(caster, ray.base + ray.direction * t - caster.position);
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
#[inline]
pub(crate) fn disc_coordinate(caster: &Caster, hit: Vec3) -> f32 {
    let [a, b] = caster.axes;
    (hit.dot(a) / a.length_squared()).powi(2) + (hit.dot(b) / b.length_squared()).powi(2)
}
