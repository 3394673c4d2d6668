//! Opaque surfaces first: nearest depth per pixel, then all fragments within ε-z of it, weights normalised.
//!
//! A disc hides what lies behind it within [`CORE`] of its radius, which leaves no hole between neighbours on a surface
//! and keeps open borders sharp; its colour is blended over the whole radius: c = Σwc/Σw.

use super::bins::{Bins, TILE, bin};
use super::lanes::Lanes;
use super::tile::{AREA, BATCH, for_each_row, for_each_run};
use super::{Projected, ProjectedSplat, RasterCounts};
use crate::Progress;
use pulp::Simd;
use rayon::prelude::*;

/// s = ρ²/R² within which a disc is solid: ρ = 0.45 R, or 1.08 spacings at the default footprint.
const CORE: f32 = 0.45 * 0.45;

/// ε-z as a share of the radius: fragments this close behind the nearest belong to the same surface.
const EPSILON_Z: f32 = 0.5;

/// The opaque surfaces of an image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OpaqueImage {
    /// View depth per pixel, +∞ where there is no opaque surface; empty for a scene without one.
    pub depth: Vec<f32>,
    /// Channel planes, Σwc/Σw; zero where there is no surface.
    pub channels: Vec<Vec<f32>>,
    /// Object id of the nearest fragment, `u32::MAX` where there is none; empty when not asked for.
    pub object: Vec<u32>,
}

/// Planes of `AREA` numbers each.
struct OpaqueTile {
    x: usize,
    y: usize,
    /// Nearest depth, +∞ where there is none; at last the blended depth.
    depth: Vec<f32>,
    weight: Vec<f32>,
    /// Σ weight·(depth − nearest): relative, so that far surfaces keep their digits.
    depth_sum: Vec<f32>,
    channels: Vec<f32>,
    object: Vec<u32>,
    fragments: u64,
}

/// Resolves the opaque splats `ids`; `values` holds `channels` numbers a splat, by id. Object ids are kept
/// when `objects` asks for them. After `progress.cancel()` the remaining tiles stay empty.
pub fn resolve_opaque(
    projected: &Projected,
    ids: &[u32],
    values: &[f32],
    channels: usize,
    objects: bool,
    progress: &Progress,
) -> (OpaqueImage, RasterCounts) {
    if ids.is_empty() {
        return (OpaqueImage::default(), RasterCounts::default());
    }
    let bins = bin(projected, ids);
    let tiles: Vec<OpaqueTile> = (0..bins.tiles())
        .into_par_iter()
        .filter(|&t| !bins.is_empty(t) && !progress.is_cancelled())
        .map(|t| {
            let mut tile = OpaqueTile::new(&bins, t, channels, objects);
            pulp::Arch::new().dispatch(ResolveTile { tile: &mut tile, bins: &bins, t, projected, values });
            tile
        })
        .collect();
    let n = projected.size.iter().map(|s| *s as usize).product();
    let mut image = OpaqueImage {
        depth: vec![f32::INFINITY; n],
        channels: vec![vec![0.0; n]; channels],
        object: if objects { vec![u32::MAX; n] } else { Vec::new() },
    };
    for tile in &tiles {
        for_each_row(projected.size, tile.x, tile.y, |from, to| {
            image.depth[to.clone()].copy_from_slice(&tile.depth[from.clone()]);
            for (plane, tile) in image.channels.iter_mut().zip(tile.channels.chunks_exact(AREA)) {
                plane[to.clone()].copy_from_slice(&tile[from.clone()]);
            }
            if objects {
                image.object[to].copy_from_slice(&tile.object[from]);
            }
        });
    }
    let counts = RasterCounts {
        splats: ids.iter().filter(|i| projected.is_visible(**i as usize)).count() as u64,
        tile_entries: bins.entries(),
        fragments: tiles.iter().map(|t| t.fragments).sum(),
        bytes: bins.bytes() + (n * 4 * (channels + 2)) as u64,
    };
    (image, counts)
}

/// One tile's work, in the form that [`pulp`] compiles once per instruction set.
struct ResolveTile<'a> {
    tile: &'a mut OpaqueTile,
    bins: &'a Bins,
    t: usize,
    projected: &'a Projected,
    values: &'a [f32],
}

impl pulp::WithSimd for ResolveTile<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tile, bins, t, projected, values } = self;
        let channels = tile.channels.len() / AREA;
        let mut records = [ProjectedSplat::default(); BATCH];
        let batches = || bins.tile(t).flat_map(|list| list.chunks(BATCH));
        for batch in batches() {
            batch.iter().zip(&mut records).for_each(|(&j, record)| *record = projected.splats[j as usize]);
            records[..batch.len()].iter().for_each(|splat| tile.nearest(simd, splat));
        }
        if !tile.object.is_empty() {
            bins.tile(t).flatten().for_each(|&j| tile.name_nearest(simd, &projected.splats[j as usize]));
        }
        for batch in batches() {
            batch.iter().zip(&mut records).for_each(|(&j, record)| *record = projected.splats[j as usize]);
            for (splat, &j) in records.iter().zip(batch) {
                tile.blend(simd, splat, &values[j as usize * channels..][..channels]);
            }
        }
        tile.normalize();
    }
}

impl OpaqueTile {
    fn new(bins: &Bins, t: usize, channels: usize, objects: bool) -> Self {
        Self {
            x: (t % bins.columns) * TILE,
            y: (t / bins.columns) * TILE,
            depth: vec![f32::INFINITY; AREA],
            weight: vec![0.0; AREA],
            depth_sum: vec![0.0; AREA],
            channels: vec![0.0; AREA * channels],
            object: vec![u32::MAX; if objects { AREA } else { 0 }],
            fragments: 0,
        }
    }

    /// Step 1: the nearest depth.
    #[inline(always)]
    fn nearest<S: Simd>(&mut self, simd: S, splat: &ProjectedSplat) {
        for_each_run::<S>(splat, [self.x, self.y], |run| {
            let far = Lanes::splat(simd, f32::INFINITY);
            let solid = run.depth(simd).where_less_or(run.distance_sq(simd), Lanes::splat(simd, CORE), far);
            Lanes::load(simd, &self.depth[run.k..]).min(solid).store(&mut self.depth[run.k..]);
            self.fragments += Lanes::<S>::COUNT as u64;
        });
    }

    /// Whose the nearest depth is; of several at the same depth the first.
    #[inline(always)]
    fn name_nearest<S: Simd>(&mut self, simd: S, splat: &ProjectedSplat) {
        for_each_run::<S>(splat, [self.x, self.y], |run| {
            let (mut s, mut depth) = ([0.0; super::lanes::MAX_LANES], [0.0; super::lanes::MAX_LANES]);
            run.distance_sq(simd).store(&mut s);
            run.depth(simd).store(&mut depth);
            for i in 0..Lanes::<S>::COUNT {
                let k = run.k + i;
                if s[i] < CORE && depth[i] == self.depth[k] && self.object[k] == u32::MAX {
                    self.object[k] = splat.object;
                }
            }
        });
    }

    /// Step 2: weights of all fragments within ε-z of the nearest.
    #[inline(always)]
    fn blend<S: Simd>(&mut self, simd: S, splat: &ProjectedSplat, values: &[f32]) {
        for_each_run::<S>(splat, [self.x, self.y], |run| {
            let of = |v: f32| Lanes::splat(simd, v);
            let nearest = Lanes::load(simd, &self.depth[run.k..]);
            // Behind by how much; where there is no surface −∞, and nothing counts.
            let behind = run.depth(simd) - nearest;
            let s = run.distance_sq(simd);
            let near = run.amount(simd, s).where_less(behind, of(EPSILON_Z * splat.depth_extent));
            let weight = near.where_less(nearest, of(f32::INFINITY));
            let add = |plane: &mut [f32], v: Lanes<S>| (Lanes::load(simd, plane) + v).store(plane);
            add(&mut self.weight[run.k..], weight);
            let finite = behind.where_less(nearest, of(f32::INFINITY));
            add(&mut self.depth_sum[run.k..], weight * finite);
            for (c, value) in values.iter().enumerate() {
                add(&mut self.channels[c * AREA + run.k..], weight * of(*value));
            }
            self.fragments += Lanes::<S>::COUNT as u64;
        });
    }

    /// Σwc/Σw and Σwz/Σw.
    fn normalize(&mut self) {
        for k in 0..AREA {
            if self.weight[k] > 0.0 {
                self.depth[k] += self.depth_sum[k] / self.weight[k];
                self.channels.iter_mut().skip(k).step_by(AREA).for_each(|v| *v /= self.weight[k]);
            } else {
                self.depth[k] = f32::INFINITY;
            }
        }
    }
}
