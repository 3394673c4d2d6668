//! Translucent splats in order, tile by tile.
//!
//! Front to back: A ← A + τ, weight = e^(−A_before) − e^(−A_after), C ← C + weight·c. The weights telescope, so
//! Σ weights = 1 − T however many splats there are, and T = e^(−Στ) from one sum. Back to front is the twin:
//! C ← C·e^(−τ) + (1 − e^(−τ))·c.
//!
//! A medium that straddles an opaque surface counts with the share of its kernel in front of it: no
//! seam where a cloud meets the ground.

use super::bins::{Bins, TILE, bin};
use super::lanes::{Lanes, MAX_LANES, exp_neg};
use super::tile::{AREA, BATCH, Run, STRIDE, for_each_row, for_each_run};
use super::{OpaqueImage, Params, Projected, ProjectedSplat, RasterCounts};
use crate::{Accumulator, Direction, Material, Progress, SplatKind};
use pulp::Simd;
use rayon::prelude::*;

/// The state of one tile while splats are folded into it. Planes are `AREA` numbers each.
struct Tile {
    /// First pixel.
    x: usize,
    y: usize,
    /// 1/|d|² of each pixel's ray, 1 for parallel rays.
    ray_factor: Vec<f32>,
    /// Depth of the opaque surface, +∞ without; empty when no pixel has one.
    opaque_depth: Vec<f32>,
    /// One plane or three.
    optical_depth: Vec<f32>,
    transmittance: Vec<f32>,
    channels: Vec<f32>,
    moments: Option<Moments>,
    object: Vec<u32>,
    fragments: u64,
}

/// Depth moments of a tile.
struct Moments {
    first: Vec<f32>,
    median: Vec<f32>,
    mean: Vec<f32>,
    m2: Vec<f32>,
}

/// Folds the splats `order`, ids in compositing order, into `accumulator`.
///
/// `values` holds as many numbers a splat as the accumulator has channels, by id. `materials` gives the
/// extinction per channel; with one plane of optical depth, which is for materials that absorb all channels alike, the
/// first channel's counts. Front to back can continue an
/// accumulator that holds nearer splats; back to front can continue one that holds farther ones. First and median depth
/// are defined front to back only. After `progress.cancel()` the remaining tiles are left as they are.
///
/// # Panics
/// If sizes of the image, the accumulator and `values` disagree.
pub fn fold(
    projected: &Projected,
    order: &[u32],
    values: &[f32],
    materials: &[Material],
    opaque: &OpaqueImage,
    direction: Direction,
    params: &Params,
    accumulator: &mut Accumulator,
    progress: &Progress,
) -> RasterCounts {
    assert_eq!(projected.size, accumulator.size, "invariant: one image size");
    assert_eq!(values.len(), projected.splats.len() * accumulator.channels.len(), "invariant: values for each splat");
    let bins = bin(projected, order);
    let finished: Vec<Tile> = (0..bins.tiles())
        .into_par_iter()
        .filter(|&t| !bins.is_empty(t) && !progress.is_cancelled())
        .map(|t| {
            let mut tile = Tile::load(accumulator, projected, opaque, &bins, t);
            let tile_ref = &mut tile;
            pulp::Arch::new().dispatch(FoldTile {
                tile: tile_ref,
                bins: &bins,
                t,
                projected,
                values,
                materials,
                direction,
                params,
            });
            tile
        })
        .collect();
    let mut counts = RasterCounts {
        splats: order.iter().filter(|i| projected.is_visible(**i as usize)).count() as u64,
        tile_entries: bins.entries(),
        bytes: bins.bytes() + std::mem::size_of_val(projected.splats.as_slice()) as u64,
        ..RasterCounts::default()
    };
    for tile in finished {
        counts.fragments += tile.fragments;
        tile.store(accumulator);
    }
    counts
}

/// One tile's work, in the form that [`pulp`] compiles once per instruction set.
struct FoldTile<'a> {
    tile: &'a mut Tile,
    bins: &'a Bins,
    t: usize,
    projected: &'a Projected,
    values: &'a [f32],
    materials: &'a [Material],
    direction: Direction,
    params: &'a Params,
}

impl pulp::WithSimd for FoldTile<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        match (self.direction, self.tile.optical_depth.len() / AREA) {
            (Direction::FrontToBack, 1) => self.fold::<S, true, 1>(simd),
            (Direction::FrontToBack, _) => self.fold::<S, true, 3>(simd),
            (Direction::BackToFront, 1) => self.fold::<S, false, 1>(simd),
            (Direction::BackToFront, _) => self.fold::<S, false, 3>(simd),
        }
    }
}

impl FoldTile<'_> {
    #[inline(always)]
    fn fold<S: Simd, const FRONT: bool, const PLANES: usize>(self, simd: S) {
        let channels = self.tile.channels.len() / AREA;
        let mut records = [ProjectedSplat::default(); BATCH];
        let mut values = vec![0.0; BATCH * channels];
        for list in self.bins.tile(self.t) {
            for batch in list.chunks(BATCH) {
                for ((&j, record), value) in batch.iter().zip(&mut records).zip(values.chunks_exact_mut(channels)) {
                    *record = self.projected.splats[j as usize];
                    value.copy_from_slice(&self.values[j as usize * channels..][..channels]);
                }
                for (splat, value) in records[..batch.len()].iter().zip(values.chunks_exact(channels)) {
                    let extinction = self.materials[splat.material as usize].extinction_rgb;
                    self.tile.splat::<S, FRONT, PLANES>(simd, splat, value, extinction);
                }
                if FRONT && self.tile.is_done(self.params.transmittance_cutoff) {
                    return;
                }
            }
        }
    }
}

impl Tile {
    fn load(acc: &Accumulator, projected: &Projected, opaque: &OpaqueImage, bins: &Bins, t: usize) -> Self {
        let (x, y) = ((t % bins.columns) * TILE, (t / bins.columns) * TILE);
        let copy = |planes: &[&[f32]], fill: f32| {
            let mut out = vec![fill; planes.len() * AREA];
            for (plane, out) in planes.iter().zip(out.chunks_exact_mut(AREA)) {
                for_each_row(acc.size, x, y, |tile, image| out[tile].copy_from_slice(&plane[image]));
            }
            out
        };
        let slices =
            |planes: &'_ [Vec<f32>]| -> Vec<f32> { copy(&planes.iter().map(Vec::as_slice).collect::<Vec<_>>(), 0.0) };
        let optical_depth = slices(&acc.optical_depth);
        let mut opaque_depth = Vec::new();
        if !opaque.depth.is_empty() {
            opaque_depth = copy(&[&opaque.depth], f32::INFINITY);
            if opaque_depth.iter().all(|d| *d == f32::INFINITY) {
                opaque_depth.clear();
            }
        }
        let mut object = Vec::new();
        if !acc.object.is_empty() {
            object.resize(AREA, u32::MAX);
            for_each_row(acc.size, x, y, |tile, image| object[tile].copy_from_slice(&acc.object[image]));
        }
        Self {
            x,
            y,
            ray_factor: ray_factors(projected, x, y),
            opaque_depth,
            transmittance: optical_depth.iter().map(|a| exp_neg(*a)).collect(),
            optical_depth,
            channels: slices(&acc.channels),
            moments: (!acc.depth_first.is_empty()).then(|| Moments {
                first: copy(&[&acc.depth_first], f32::INFINITY),
                median: copy(&[&acc.depth_median], f32::INFINITY),
                mean: copy(&[&acc.depth_mean], 0.0),
                m2: copy(&[&acc.depth_m2], 0.0),
            }),
            object,
            fragments: 0,
        }
    }

    fn store(self, acc: &mut Accumulator) {
        let size = acc.size;
        let put = |from: &[f32], to: &mut [f32]| {
            for_each_row(size, self.x, self.y, |tile, image| to[image].copy_from_slice(&from[tile]));
        };
        self.optical_depth.chunks_exact(AREA).zip(&mut acc.optical_depth).for_each(|(from, to)| put(from, to));
        self.channels.chunks_exact(AREA).zip(&mut acc.channels).for_each(|(from, to)| put(from, to));
        if let Some(m) = &self.moments {
            put(&m.first, &mut acc.depth_first);
            put(&m.median, &mut acc.depth_median);
            put(&m.mean, &mut acc.depth_mean);
            put(&m.m2, &mut acc.depth_m2);
        }
        if !self.object.is_empty() {
            for_each_row(size, self.x, self.y, |tile, image| acc.object[image].copy_from_slice(&self.object[tile]));
        }
    }

    fn is_done(&self, cutoff: f32) -> bool {
        // Padding may keep T = 1, so only the pixels of the tile are looked at.
        self.transmittance.chunks_exact(STRIDE).all(|row| row[..TILE].iter().all(|t| *t < cutoff))
    }

    #[inline(always)]
    fn splat<S: Simd, const FRONT: bool, const PLANES: usize>(
        &mut self,
        simd: S,
        splat: &ProjectedSplat,
        value: &[f32],
        extinction: [f32; 3],
    ) {
        let origin = [self.x, self.y];
        for_each_run::<S>(splat, origin, |run| {
            let tau = self.optical_depth_lanes(simd, &run);
            self.composite::<S, FRONT, PLANES>(simd, &run, value, extinction, tau);
            self.fragments += Lanes::<S>::COUNT as u64;
        });
    }

    /// τ of a run of pixels.
    #[inline(always)]
    fn optical_depth_lanes<S: Simd>(&self, simd: S, run: &Run<'_>) -> Lanes<S> {
        let of = |v: f32| Lanes::splat(simd, v);
        let splat = run.splat;
        let medium = splat.kind == SplatKind::Medium;
        let mut s = run.distance_sq(simd);
        if medium {
            s = s * Lanes::load(simd, &self.ray_factor[run.k..]);
        }
        let mut tau = run.amount(simd, s);
        if !self.opaque_depth.is_empty() {
            let opaque = Lanes::load(simd, &self.opaque_depth[run.k..]);
            tau = if medium {
                tau * ((opaque - of(splat.depth)) * of(1.0 / splat.depth_extent)).share_in_front()
            } else {
                tau.where_less(run.depth(simd), opaque)
            };
        }
        tau
    }

    #[inline(always)]
    fn composite<S: Simd, const FRONT: bool, const PLANES: usize>(
        &mut self,
        simd: S,
        run: &Run<'_>,
        value: &[f32],
        extinction: [f32; 3],
        tau: Lanes<S>,
    ) {
        let zero = Lanes::splat(simd, 0.0);
        let (mut weight, mut keep) = ([zero; PLANES], [zero; PLANES]);
        for p in 0..PLANES {
            let at = p * AREA + run.k;
            let step = tau * Lanes::splat(simd, extinction[p]);
            let sum = Lanes::load(simd, &self.optical_depth[at..]) + step;
            sum.store(&mut self.optical_depth[at..]);
            let after = sum.exp_neg();
            if FRONT {
                weight[p] = Lanes::load(simd, &self.transmittance[at..]) - after;
            } else {
                keep[p] = step.exp_neg();
                weight[p] = Lanes::splat(simd, 1.0) - keep[p];
            }
            after.store(&mut self.transmittance[at..]);
        }
        let channels = value.len();
        for (c, v) in value.iter().enumerate() {
            // Channels come in threes, red, green, blue; a lone last one takes the green weight.
            let p = if PLANES == 3 && channels - c > channels % 3 { c % 3 } else { PLANES / 2 };
            let at = c * AREA + run.k;
            let mut sum = Lanes::load(simd, &self.channels[at..]);
            if !FRONT {
                sum = sum * keep[p];
            }
            (sum + weight[p] * Lanes::splat(simd, *v)).store(&mut self.channels[at..]);
        }
        if self.moments.is_some() || !self.object.is_empty() {
            let p = PLANES / 2;
            self.extras::<S, FRONT>(run, weight[p], keep[p], run.depth(simd), p * AREA + run.k);
        }
    }

    /// Depth moments and object ids, lane by lane.
    #[inline(always)]
    fn extras<S: Simd, const FRONT: bool>(
        &mut self,
        run: &Run<'_>,
        weight: Lanes<S>,
        keep: Lanes<S>,
        depth: Lanes<S>,
        at: usize,
    ) {
        let (mut w, mut keeps, mut z) = ([0.0; MAX_LANES], [0.0; MAX_LANES], [0.0; MAX_LANES]);
        weight.store(&mut w);
        keep.store(&mut keeps);
        depth.store(&mut z);
        for i in (0..Lanes::<S>::COUNT).filter(|i| w[*i] > 0.0) {
            let k = run.k + i;
            if let Some(moments) = &mut self.moments {
                if !FRONT {
                    moments.m2[k] *= keeps[i];
                }
                moments.add(k, self.transmittance[at + i], w[i], z[i]);
            }
            if let Some(object) = self.object.get_mut(k).filter(|o| !FRONT || **o == u32::MAX) {
                *object = run.splat.object;
            }
        }
    }
}

impl Moments {
    /// Adds a fragment of absorbed share `weight` at `depth`, after which transmittance is `after`.
    #[inline(always)]
    fn add(&mut self, k: usize, after: f32, weight: f32, depth: f32) {
        if self.first[k] == f32::INFINITY && 1.0 - after >= 1.0 / 255.0 {
            self.first[k] = depth;
        }
        if self.median[k] == f32::INFINITY && after <= 0.5 {
            self.median[k] = depth;
        }
        let delta = depth - self.mean[k];
        self.mean[k] += delta * (weight / (1.0 - after)).min(1.0);
        self.m2[k] += weight * delta * (depth - self.mean[k]);
    }
}

/// 1/|d|² for the pixels of the tile, padding included.
fn ray_factors(projected: &Projected, x: usize, y: usize) -> Vec<f32> {
    let Some(focal) = projected.perspective else { return vec![1.0; AREA] };
    let half = projected.size.map(|s| s as f32 * 0.5);
    let mut out = Vec::with_capacity(AREA);
    for row in 0..TILE {
        let v = ((y + row) as f32 + 0.5 - half[1]) / focal;
        for column in 0..STRIDE {
            let u = ((x + column) as f32 + 0.5 - half[0]) / focal;
            out.push(1.0 / (1.0 + u * u + v * v));
        }
    }
    out
}
