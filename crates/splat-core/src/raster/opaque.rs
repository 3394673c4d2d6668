//! Opaque surfaces first: nearest depth per pixel, then all fragments within ε-z of it on either side, weights normalised.
//!
//! A disc hides what lies behind it within [`Footprint::CORE`] of its radius, which leaves no hole between neighbours on a surface,
//! and without the image's filter, which would make every silhouette wider. Its colour is blended over the whole radius,
//! filter and all: c = Σwc/Σw. One whose footprint is an image hides where that is solid, see [`crate::FootprintImage`].

use super::RasterCounts;
use super::bins::{Bins, bin};
use super::kernel::Kernel;
use super::lanes::{Lanes, MAX_LANES};
use super::projected::{Projected, ProjectedDepth, ProjectedSplat, SpecialDisc};
use super::special;
use super::tile::{AREA, BATCH, Run, Runs, for_each_span};
use crate::{Error, Footprint, Progress};
use pulp::Simd;
use rayon::prelude::*;

/// s = ρ²/R² within which a disc is solid.
const CORE: f32 = Footprint::CORE * Footprint::CORE;

/// ε-z as a share of the radius: fragments this close to the nearest belong to the same surface.
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

impl OpaqueImage {
    /// The nearer one of two images of the same pixels and channels; this one where they are equally near.
    ///
    /// # Panics
    /// If both have surfaces, but not the same pixels and channels.
    #[must_use]
    pub fn joined(mut self, other: Self) -> Self {
        if self.depth.is_empty() {
            return other;
        }
        for k in 0..other.depth.len() {
            if other.depth[k] < self.depth[k] {
                self.depth[k] = other.depth[k];
                self.channels.iter_mut().zip(&other.channels).for_each(|(to, from)| to[k] = from[k]);
                if let (Some(to), Some(from)) = (self.object.get_mut(k), other.object.get(k)) {
                    *to = *from;
                }
            }
        }
        self
    }
}

/// One opaque splat.
#[derive(Clone, Copy, Default)]
struct Disc<'a> {
    splat: ProjectedSplat,
    depth: ProjectedDepth,
    /// If its conic does not tell everything.
    special: Option<&'a SpecialDisc>,
}

impl Disc<'_> {
    /// Where a run of pixels meets what is solid of a disc that has the conic of its core, as s below [`CORE`]; and view depths.
    #[inline(always)]
    fn core<S: Simd>(&self, simd: S, run: Run<S>, projected: &Projected) -> [Lanes<S>; 2] {
        match self.special {
            None => [run.distance_sq(simd, &self.splat), run.depth(simd, &self.depth)],
            Some(disc) => {
                special::solid(simd, run, &self.splat, disc, projected.kernel(&self.splat), projected.is_perspective())
            }
        }
    }

    /// Profile and view depth of a run of pixels.
    #[inline(always)]
    fn profile<S: Simd>(&self, simd: S, run: Run<S>, kernel: &Kernel, projected: &Projected) -> [Lanes<S>; 2] {
        match self.special {
            None => {
                let s = run.distance_sq(simd, &self.splat);
                let lanes = |v: f32| Lanes::splat(simd, v);
                [kernel.profile(simd, (lanes(1.0) - s).max(lanes(0.0))), run.depth(simd, &self.depth)]
            }
            Some(disc) => special::profile(
                simd,
                run,
                &self.splat,
                disc,
                projected.kernel(&self.splat),
                projected.is_perspective(),
            ),
        }
    }
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

/// What [`resolve_opaque`] resolves.
#[derive(Debug, Clone, Copy)]
pub struct OpaqueInput<'a> {
    /// Footprints by id, with their depths.
    pub projected: &'a Projected,
    /// Ids of opaque splats.
    pub ids: &'a [u32],
    /// As many numbers a splat as there are channels, by id.
    pub values: &'a [f32],
    /// Number of channels.
    pub channels: u32,
    /// Whether objects are kept.
    pub objects: bool,
}

/// Resolves opaque splats. One tick a tile.
///
/// # Errors
/// [`Error::Cancelled`].
///
/// # Panics
/// If `projected` lacks depths, or objects that are asked for.
pub fn resolve_opaque(
    input: &OpaqueInput<'_>,
    progress: Option<&Progress>,
) -> Result<(OpaqueImage, RasterCounts), Error> {
    let OpaqueInput { projected, ids, values, objects, .. } = *input;
    let channels = input.channels as usize;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    if ids.is_empty() {
        return Ok((OpaqueImage::default(), RasterCounts::default()));
    }
    assert_eq!(projected.depths.len(), projected.splats.len(), "invariant: opaque splats have depths");
    assert!(!objects || projected.objects.len() == projected.splats.len(), "invariant: objects when asked for");
    let bins = bin(projected, ids);
    progress.add_total(bins.tiles() as u64);
    let tiles: Vec<OpaqueTile> = (0..bins.tiles())
        .into_par_iter()
        .filter(|&t| progress.tick(1).is_ok() && !bins.is_empty(t))
        .map(|t| {
            let mut tile = OpaqueTile::new(&bins, t, channels, objects);
            pulp::Arch::new().dispatch(ResolveTile { tile: &mut tile, bins: &bins, t, projected, values });
            tile
        })
        .collect();
    progress.tick(0)?;
    let n = projected.size.iter().map(|s| *s as usize).product();
    let mut image = OpaqueImage {
        depth: vec![f32::INFINITY; n],
        channels: vec![vec![0.0; n]; channels],
        object: if objects { vec![u32::MAX; n] } else { Vec::new() },
    };
    for tile in &tiles {
        for_each_span(projected.size, tile.x, tile.y, |from, to| {
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
        splats: bins.splats(),
        tile_entries: bins.entries(),
        fragments: tiles.iter().map(|t| t.fragments).sum(),
        bytes: bins.bytes() + (n * 4 * (channels + 2)) as u64,
    };
    Ok((image, counts))
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
        let mut records = [Disc::default(); BATCH];
        let batches = || bins.tile(t).flat_map(|list| list.chunks(BATCH));
        for batch in batches() {
            gather(projected, batch, &mut records);
            records.iter_mut().for_each(|disc| disc.splat.conic = disc.depth.core);
            records[..batch.len()].iter().for_each(|disc| tile.nearest(simd, projected, disc));
        }
        if !tile.object.is_empty() {
            for batch in batches() {
                gather(projected, batch, &mut records);
                records.iter_mut().for_each(|disc| disc.splat.conic = disc.depth.core);
                for (disc, &j) in records.iter().zip(batch) {
                    tile.name_nearest(simd, projected, disc, projected.objects[j as usize]);
                }
            }
        }
        for batch in batches() {
            gather(projected, batch, &mut records);
            for (disc, &j) in records.iter().zip(batch) {
                tile.blend(simd, projected, disc, &values[j as usize * channels..][..channels]);
            }
        }
        tile.normalize();
    }
}

/// Copies what is known of some discs.
#[inline(always)]
fn gather<'a>(projected: &'a Projected, batch: &[u32], records: &mut [Disc<'a>]) {
    for (&j, record) in batch.iter().zip(records) {
        let splat = projected.splats[j as usize];
        let depth = projected.depths[j as usize];
        *record = Disc { splat, depth, special: projected.special_disc(&splat, j) };
    }
}

impl OpaqueTile {
    fn new(bins: &Bins, t: usize, channels: usize, objects: bool) -> Self {
        let [x, y] = bins.corner(t);
        Self {
            x,
            y,
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
    fn nearest<S: Simd>(&mut self, simd: S, projected: &Projected, disc: &Disc<'_>) {
        let runs = Runs::new(simd, &disc.splat, projected.size, [self.x, self.y]);
        self.fragments += runs.pixels();
        for run in runs {
            let far = Lanes::splat(simd, f32::INFINITY);
            let core = Lanes::splat(simd, CORE);
            let [s, depth] = disc.core(simd, run, projected);
            let solid = depth.where_less_or(s, core, far);
            let nearest = &mut self.depth[run.pixel()..];
            Lanes::load(simd, nearest).min(solid).store(nearest);
        }
    }

    /// Whose the nearest depth is; of several at the same depth the first.
    #[inline(always)]
    fn name_nearest<S: Simd>(&mut self, simd: S, projected: &Projected, disc: &Disc<'_>, object: u32) {
        for run in Runs::new(simd, &disc.splat, projected.size, [self.x, self.y]) {
            let mut s = [0.0; MAX_LANES];
            let mut z = [0.0; MAX_LANES];
            let [distance_sq, depth] = disc.core(simd, run, projected);
            distance_sq.store(&mut s);
            depth.store(&mut z);
            for i in 0..Lanes::<S>::COUNT {
                let k = run.pixel() + i;
                if s[i] < CORE && z[i] == self.depth[k] && self.object[k] == u32::MAX {
                    self.object[k] = object;
                }
            }
        }
    }

    /// Step 2: weights of all fragments within ε-z of the nearest.
    #[inline(always)]
    fn blend<S: Simd>(&mut self, simd: S, projected: &Projected, disc: &Disc<'_>, values: &[f32]) {
        let lanes = |v: f32| Lanes::splat(simd, v);
        let runs = Runs::new(simd, &disc.splat, projected.size, [self.x, self.y]);
        self.fragments += runs.pixels();
        for run in runs {
            let k = run.pixel();
            let nearest = Lanes::load(simd, &self.depth[k..]);
            // Behind by how much; where there is no surface −∞, and nothing counts. Before it lie the rims of nearer surfaces.
            let [profile, depth] = disc.profile(simd, run, projected.kernel(&disc.splat), projected);
            let behind = depth - nearest;
            let amount = lanes(disc.splat.peak) * profile;
            let near = amount.where_less(behind.abs(), lanes(EPSILON_Z * disc.depth.extent));
            let weight = near.where_less(nearest, lanes(f32::INFINITY));
            let add = |plane: &mut [f32], v: Lanes<S>| (Lanes::load(simd, plane) + v).store(plane);
            add(&mut self.weight[k..], weight);
            let finite = behind.where_less(nearest, lanes(f32::INFINITY));
            add(&mut self.depth_sum[k..], weight * finite);
            for (c, value) in values.iter().enumerate() {
                add(&mut self.channels[c * AREA + k..], weight * lanes(*value));
            }
        }
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
