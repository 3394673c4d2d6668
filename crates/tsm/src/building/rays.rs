//! Sampling side by side: a footprint on the rays of many cells.
//!
//! w(s), s = |p − (p·r)r|²/R² for a medium at p and a ray of direction r; in front of the light all of it counts, around
//! the light the share that lies ahead.
//!
//! The rays of a footprint's cells stand in one row, those of a cell next to each other. Each block of [`LANES`] is taken
//! in loops without branches; then each cell sums its own, in their order. Discs are sampled ray by ray.

use crate::building::caster::Caster;
use crate::building::lanes::{LANES, Lane};
use crate::building::sampling::{ahead, sample_disc};
use crate::mapping::{Mapping, Ray};
use glam::{Vec2, Vec3};
use splat_core::{SplatKind, glam};

/// The sampling of one footprint, in the form that [`pulp`] compiles once per instruction set; returns the area of the
/// footprint that the rays find.
pub(crate) struct Rays<'a, M: Mapping> {
    pub(crate) mapping: &'a M,
    pub(crate) caster: &'a Caster,
    /// Rays along a side of a cell.
    pub(crate) samples: u32,
    /// Whether only what lies ahead of the light counts.
    pub(crate) near: bool,
    /// Cell, column and row.
    pub(crate) window: &'a [[u32; 3]],
    /// Receives cell, weight, and distance of the entry, where the footprint is met.
    pub(crate) cells: &'a mut Vec<(u32, f32, f32)>,
}

/// Most rays along a side of a cell.
pub(crate) const MOST_SAMPLES: u32 = 32;

/// Place of a ray along the side of a cell that has so many: one, or an even number. These lie in pairs, each as two points of Gauss's
/// rule: where the table is creased along edges of cells, rays at even distances would miss a share of a footprint that goes as the
/// square of these.
#[inline(always)]
pub(crate) fn place(ray: u32, rays: u32) -> f32 {
    const FROM_MIDDLE: f32 = 0.577_350_26;
    let ray_of_pair = if ray.is_multiple_of(2) { -FROM_MIDDLE } else { FROM_MIDDLE };
    if rays == 1 { 0.5 } else { ((ray / 2 * 2 + 1) as f32 + ray_of_pair) / rays as f32 }
}

/// Rays by component: base, then direction.
type RayLanes = [Lane; 6];

#[inline(always)]
fn put(rays: &mut RayLanes, l: usize, ray: &Ray) {
    let [base, direction] = [ray.base, ray.direction].map(|v| v.to_array());
    (0..3).for_each(|k| (rays[k][l], rays[k + 3][l]) = (base[k], direction[k]));
}

#[inline(always)]
fn get(rays: &RayLanes, l: usize) -> Ray {
    let vector = |first: usize| Vec3::from_array([0, 1, 2].map(|k| rays[first + k][l]));
    Ray { base: vector(0), direction: vector(3) }
}

/// What each ray finds.
struct Found {
    density: Lane,
    /// Profile of the kernel, times the density.
    weight: Lane,
    area: Lane,
    distance: Lane,
}

impl<M: Mapping> pulp::NullaryFnOnce for Rays<'_, M> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        if self.caster.kind == SplatKind::Medium { self.sample_medium() } else { self.sample_disc() }
    }
}

impl<M: Mapping> Rays<'_, M> {
    fn sample_disc(self) -> f64 {
        let mut norm = 0.0;
        for &[cell, ..] in self.window {
            let (weight, area, distance) = sample_disc(self.mapping, self.caster, cell, self.samples);
            if weight > 0.0 {
                norm += f64::from(area);
                self.cells.push((cell, weight, distance));
            }
        }
        norm
    }

    #[inline(always)]
    fn sample_medium(self) -> f64 {
        let mut norm = 0.0;
        let per_cell = (self.samples * self.samples) as usize;
        let total = self.window.len() * per_cell;
        let mut window = self.window.iter();
        let mut places = [0.0; MOST_SAMPLES as usize];
        (0..self.samples).for_each(|k| places[k as usize] = place(k, self.samples));
        // Density, weight, area and weighted distance of the cell that is being summed, and how many rays it has so far.
        let mut sums = [0.0f32; 4];
        let mut count = 0;
        for begin in (0..total).step_by(LANES) {
            let rays = if self.samples == 1 {
                self.rays_of_centres(begin)
            } else {
                self.rays_within(&places, begin / per_cell, begin % per_cell)
            };
            let found = self.look(&rays);
            for l in 0..LANES.min(total - begin) {
                let weight = found.weight[l];
                let next = [found.density[l], weight, found.area[l], weight * found.distance[l]];
                (0..4).for_each(|k| sums[k] += next[k]);
                count += 1;
                if count < per_cell {
                    continue;
                }
                count = 0;
                let [density, weight, area, distance] = std::mem::take(&mut sums);
                if let Some(&[cell, column, row]) = window.next().filter(|_| weight > 0.0) {
                    norm += f64::from(area / (density * self.mapping.inverse_measure(column, row)));
                    let is_one = per_cell == 1 || !self.near;
                    self.cells.push((
                        cell,
                        weight / density,
                        if is_one { found.distance[l] } else { distance / weight },
                    ));
                }
            }
        }
        norm
    }

    /// One ray through the centre of each cell.
    #[inline(always)]
    fn rays_of_centres(&self, begin: usize) -> RayLanes {
        let mut rays = [[0.0; LANES]; 6];
        for (l, [_, column, row]) in self.window[begin..].iter().enumerate().take(LANES) {
            put(&mut rays, l, &self.mapping.ray_of(*column, *row));
        }
        rays
    }

    /// Rays on a lattice within each cell, from a ray of a cell of the window on.
    #[inline(always)]
    fn rays_within(&self, places: &[f32; MOST_SAMPLES as usize], mut cell: usize, ray: usize) -> RayLanes {
        let samples = self.samples as usize;
        let mut i = ray % samples;
        let mut j = ray / samples;
        let mut corner = [[0.0; LANES]; 2];
        let mut step = [[0.0; LANES]; 2];
        for l in 0..LANES {
            let [_, column, row] = self.window[cell.min(self.window.len() - 1)];
            (corner[0][l], corner[1][l]) = (column as f32, row as f32);
            (step[0][l], step[1][l]) = (places[i], places[j]);
            i += 1;
            (i, j) = if i == samples { (0, j + 1) } else { (i, j) };
            (j, cell) = if j == samples { (0, cell + 1) } else { (j, cell) };
        }
        let mut rays = [[0.0; LANES]; 6];
        for l in 0..LANES {
            let step = Vec2::new(step[0][l], step[1][l]);
            put(&mut rays, l, &self.mapping.ray(Vec2::new(corner[0][l], corner[1][l]) + step));
        }
        rays
    }

    #[inline(always)]
    fn look(&self, rays: &RayLanes) -> Found {
        let caster = self.caster;
        let parallel = self.mapping.is_parallel();
        let nought = [0.0; LANES];
        let mut s = nought;
        let mut along = nought;
        let mut found = Found { density: nought, weight: nought, area: nought, distance: [caster.distance; LANES] };
        for l in 0..LANES {
            let ray = get(rays, l);
            let p = caster.position - ray.base;
            along[l] = p.dot(ray.direction);
            s[l] = (p - ray.direction * along[l]).length_squared() * caster.inverse_radius_sq;
            found.density[l] = if self.samples == 1 { 1.0 } else { self.mapping.density(&ray) };
            let is_met = (s[l] < 1.0) & (self.near | (along[l] > 0.0));
            let weight = found.density[l] * caster.kernel.profile(s[l]);
            found.weight[l] = if is_met { weight } else { 0.0 };
            let jacobian = if parallel | self.near { 1.0 } else { along[l] * caster.distance };
            found.area[l] = found.weight[l] * jacobian;
        }
        if self.near {
            for l in (0..LANES).filter(|&l| s[l] < 1.0) {
                let (share, distance) = ahead(caster, along[l], s[l]).unwrap_or((0.0, 0.0));
                found.weight[l] *= share;
                found.distance[l] = distance;
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::building::caster::Casters;
    use crate::building::sampling::Sampled;
    use crate::frame::Frame;
    use crate::mapping::Octahedral;
    use crate::{Params, Scene};
    use splat_core::glam::DVec3;
    use splat_core::{Cloud, Splat};

    /// What a ball holds ahead of the light along one ray, and its mean distance, summed in 400 steps along the chord.
    fn along_ray(caster: &Caster, ray: &Ray) -> [f64; 2] {
        let [centre, direction] = [caster.position, ray.direction].map(Vec3::as_dvec3);
        let [radius, sigma] = [1.0, caster.kernel.cutoff].map(|part| f64::from(caster.radius / part));
        let along = centre.dot(direction);
        let s = (centre - direction * along).length_squared() / (radius * radius);
        if s >= 1.0 {
            return [0.0; 2];
        }
        let half = radius * (1.0 - s).sqrt();
        let mut whole = 0.0;
        let mut held = 0.0;
        let mut moment = 0.0;
        for k in 0..400 {
            let t = along + half * ((k as f64 + 0.5) / 200.0 - 1.0);
            let density = libm::exp(-0.5 * ((t - along) / sigma).powi(2));
            whole += density;
            if t > 0.0 {
                held += density;
                moment += density * t;
            }
        }
        let weight = f64::from(caster.kernel.profile(s as f32)) / whole;
        [weight * held, weight * moment]
    }

    #[test]
    fn a_cell_meets_a_ball_about_the_light_at_the_mean_distance_of_its_rays() {
        let mut cloud = Cloud::new(DVec3::ZERO);
        let position = Vec3::new(0.1, -0.2, 0.15);
        cloud.push(&Splat { position, radius: 0.5, cross_section: 0.1, kind: SplatKind::Medium, ..Splat::default() });
        let params = Params::default();
        let frame = Frame::new(DVec3::ZERO, [DVec3::X, DVec3::Y, DVec3::Z], 1.0);
        let caster = Casters::new(&Scene::from(&cloud), &params).get(0, &frame, false);
        // Cells so wide that they take 6 and 4 rays a side.
        for n in [4, 8] {
            let mapping = Octahedral::new(n);
            let mut sampled = Sampled::default();
            sampled.sweep(&mapping, &caster);
            assert_eq!(sampled.cells.len(), (n * n) as usize);
            for &(cell, weight, distance) in &sampled.cells {
                let corner = Vec2::new((cell % n) as f32, (cell / n) as f32);
                let mut density = 0.0;
                let mut held = 0.0;
                let mut moment = 0.0;
                for k in 0..64 * 64 {
                    let ray = mapping.ray(corner + (Vec2::new((k % 64) as f32, (k / 64) as f32) + 0.5) / 64.0);
                    let here = f64::from(mapping.density(&ray));
                    let [h, m] = along_ray(&caster, &ray);
                    (density, held, moment) = (density + here, held + here * h, moment + here * m);
                }
                let off = |found: f32, truth: f64| (f64::from(found) / truth - 1.0).abs();
                let errors = [off(weight, held / density), off(distance, moment / held)];
                assert!(errors.iter().all(|e| *e < 3e-3), "cell {cell} of {n}²: {errors:?}");
            }
        }
    }
}
