//! Free flight and transmittance in media whose extinction may differ per channel, without bias.
//!
//! Grey media: delta tracking, and ratio tracking for transmittance. Otherwise spectral tracking (Kutz, Habel, Li, Novák
//! 2017): with one majorant σ̄ for all channels a tentative collision is real with probability P ∝ Σ|w_c|σ_c, null with
//! 1 − P ∝ Σ|w_c||σ̄ − σ_c|, and the throughput becomes w_c·σ_c/(σ̄P) or w_c·(σ̄ − σ_c)/(σ̄(1 − P)). The weights keep the
//! mean right for every channel; choosing by the path's own weights keeps them near one. A density above its promised
//! majorant makes σ̄ − σ negative, which the weights carry too: more noise, no bias; it is counted.

use crate::media::majorant::MajorantGrid;
use crate::media::medium::Medium;
use crate::path::random::Stream;
use crate::ray::Ray;
use glam::DVec3;
use splat_core::DAabb;
use std::sync::atomic::{AtomicU64, Ordering::Relaxed};

/// Below this transmittance a ratio-tracked ray goes on with probability ¼.
const ROULETTE: f64 = 0.1;

/// A collision with a medium.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Collision {
    pub(crate) point: DVec3,
    pub(crate) medium: usize,
}

/// Media with their majorants.
pub(crate) struct Volume<'a> {
    media: Vec<Medium<'a>>,
    grid: Option<MajorantGrid>,
    /// Every medium attenuates all channels alike.
    grey: bool,
    violations: AtomicU64,
}

impl<'a> Volume<'a> {
    pub(crate) fn new(media: Vec<Medium<'a>>) -> Self {
        let grey = media.iter().all(|m| m.extinction[0] == m.extinction[1] && m.extinction[1] == m.extinction[2]);
        Self { grid: MajorantGrid::new(&media), media, grey, violations: AtomicU64::new(0) }
    }

    /// Bounds of everything that can collide.
    pub(crate) fn bounds(&self) -> Option<&DAabb> {
        self.grid.as_ref().map(MajorantGrid::bounds)
    }

    /// Lookups so far that exceeded their majorant.
    pub(crate) fn violations(&self) -> u64 {
        self.violations.load(Relaxed)
    }

    /// Extinction at `p` from the media of a cell.
    #[inline(always)]
    fn grey_extinction(&self, grid: &MajorantGrid, cell: usize, p: DVec3) -> f64 {
        if let [medium] = self.media.as_slice() {
            return medium.extinction[0] * medium.density.value(p);
        }
        grid.members(cell).iter().map(|m| &self.media[*m as usize]).map(|m| m.extinction[0] * m.density.value(p)).sum()
    }

    fn count_violation(&self, sigma: f64, majorant: f64) {
        if sigma > majorant * (1.0 + 1e-9) {
            self.violations.fetch_add(1, Relaxed);
        }
    }

    /// The first collision between `t0` and `t1`; `weight` becomes the throughput up to it, or through the segment.
    pub(crate) fn collide(
        &self,
        ray: &Ray,
        t0: f64,
        t1: f64,
        weight: &mut [f64; 3],
        rng: &mut Stream,
    ) -> Option<Collision> {
        let grid = self.grid.as_ref()?;
        let mut found = None;
        if self.grey {
            grid.walk(ray, t0, t1, rng, |t, cell, majorant, rng| {
                let point = ray.at(t);
                let sigma = self.grey_extinction(grid, cell, point);
                if sigma > majorant {
                    self.count_violation(sigma, majorant);
                    // |σ̄ − σ| + σ > σ̄: the general rule of the weights.
                    let sum = 2.0 * sigma - majorant;
                    let real = rng.unit() * sum < sigma;
                    let factor = if real { sum / majorant } else { -sum / majorant };
                    weight.iter_mut().for_each(|w| *w *= factor);
                    if !real {
                        return false;
                    }
                } else if rng.unit() * majorant >= sigma {
                    return false;
                }
                found = Some(Collision { point, medium: self.grey_medium(grid, cell, point, sigma, rng) });
                true
            });
        } else {
            grid.walk(ray, t0, t1, rng, |t, cell, majorant, rng| {
                let point = ray.at(t);
                let medium = self.spectral_event(grid.members(cell), majorant, point, weight, rng);
                found = medium.map(|medium| Collision { point, medium });
                found.is_some()
            });
        }
        found
    }

    /// Which of the overlapping media collided, in proportion to their extinctions.
    #[inline(always)]
    fn grey_medium(&self, grid: &MajorantGrid, cell: usize, p: DVec3, sigma: f64, rng: &mut Stream) -> usize {
        let members = grid.members(cell);
        if members.len() == 1 {
            return members[0] as usize;
        }
        let mut left = rng.unit() * sigma;
        let mut chosen = members[0] as usize;
        for &m in members {
            let extinction = self.media[m as usize].extinction[0] * self.media[m as usize].density.value(p);
            if extinction > 0.0 {
                chosen = m as usize;
            }
            left -= extinction;
            if left < 0.0 {
                break;
            }
        }
        chosen
    }

    /// One tentative collision with weights in a cell of these media: the medium, or `None` for a null collision.
    fn spectral_event(
        &self,
        members: &[u32],
        majorant: f64,
        p: DVec3,
        weight: &mut [f64; 3],
        rng: &mut Stream,
    ) -> Option<usize> {
        let mut sum = [0.0; 3];
        let mut total = 0.0;
        let mut chosen = 0;
        let mut of_chosen = [0.0; 3];
        let mut share_of_chosen = 0.0;
        for &m in members {
            let medium = &self.media[m as usize];
            let density = medium.density.value(p);
            let extinction = medium.extinction.map(|e| e * density);
            let share: f64 = (0..3).map(|c| weight[c].abs() * extinction[c]).sum();
            (0..3).for_each(|c| sum[c] += extinction[c]);
            total += share;
            if share > 0.0 && (share == total || rng.unit() * total < share) {
                (chosen, of_chosen, share_of_chosen) = (m as usize, extinction, share);
            }
        }
        self.count_violation(sum.iter().fold(0.0, |a: f64, s| a.max(*s)), majorant);
        let null: f64 = (0..3).map(|c| weight[c].abs() * (majorant - sum[c]).abs()).sum();
        if total + null <= 0.0 {
            return None;
        }
        let real = rng.unit() * (total + null) < total;
        let factor = |c: usize| {
            let (sigma, probability) = if real { (of_chosen[c], share_of_chosen) } else { (majorant - sum[c], null) };
            sigma / majorant * ((total + null) / probability)
        };
        (0..3).for_each(|c| weight[c] *= factor(c));
        real.then_some(chosen)
    }

    /// An unbiased estimate of the transmittance between `t0` and `t1` per channel, by ratio tracking.
    pub(crate) fn transmittance(&self, ray: &Ray, t0: f64, t1: f64, rng: &mut Stream) -> [f64; 3] {
        let Some(grid) = self.grid.as_ref() else { return [1.0; 3] };
        if self.grey {
            let mut left = 1.0;
            grid.walk(ray, t0, t1, rng, |t, cell, majorant, rng| {
                let sigma = self.grey_extinction(grid, cell, ray.at(t));
                self.count_violation(sigma, majorant);
                left *= 1.0 - sigma / majorant;
                roulette(std::slice::from_mut(&mut left), rng)
            });
            return [left; 3];
        }
        let mut left = [1.0; 3];
        grid.walk(ray, t0, t1, rng, |t, cell, majorant, rng| {
            let p = ray.at(t);
            let mut sum = [0.0; 3];
            for &m in grid.members(cell) {
                let medium = &self.media[m as usize];
                let density = medium.density.value(p);
                (0..3).for_each(|c| sum[c] += medium.extinction[c] * density);
            }
            self.count_violation(sum.iter().fold(0.0, |a: f64, s| a.max(*s)), majorant);
            (0..3).for_each(|c| left[c] *= 1.0 - sum[c] / majorant);
            roulette(&mut left, rng)
        });
        left
    }
}

/// Ends a faint ray, or makes it four times as bright; true when it ended.
#[inline(always)]
fn roulette(left: &mut [f64], rng: &mut Stream) -> bool {
    let largest = left.iter().fold(0.0, |m: f64, l| m.max(l.abs()));
    if largest >= ROULETTE {
        return false;
    }
    if largest > 0.0 && rng.unit() < 0.25 {
        left.iter_mut().for_each(|l| *l *= 4.0);
        return false;
    }
    left.fill(0.0);
    true
}
