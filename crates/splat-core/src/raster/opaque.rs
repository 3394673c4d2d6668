//! Opaque surfaces first: the nearest depth of a pixel, then all fragments within ε-z of it, weights normalised:
//! c = Σwc/Σw.
//!
//! A disc covers a pixel by area·w, w the density of its footprint, so that discs which tile a surface add up to 1 on it and
//! to ½ on its border, in the world as on the image, whatever their size beside a pixel. A surface is solid where they add
//! up to half, and where a disc's own area is; else the pixel shows what lies behind: the fragments up to there are left out
//! and the next depth is looked for. So silhouettes and open borders lie where they are, neither wider by the image's filter
//! nor by the overlap of the discs.
//!
//! Candidates for the nearest depth are discs within [`CORE`], which reach over every gap between neighbours.

use super::RasterCounts;
use super::bins::{Bins, TILE, bin};
use super::kernel::Kernel;
use super::lanes::{Lanes, MAX_LANES};
use super::projected::{NearDisc, Projected, ProjectedDepth, ProjectedSplat};
use super::tile::{AREA, BATCH, BLOCKS, PIXELS, Run, Runs, for_each_span};
use crate::Progress;
use pulp::Simd;
use rayon::prelude::*;

/// s = ρ²/R² within which a disc may be the nearest: ρ = 0.45 R, or 1.08 spacings at the default footprint.
const CORE: f32 = 0.45 * 0.45;

/// Coverage from which on a surface is solid: a half, less what keeps a single row of discs in one piece (0.4987 on it).
const SOLID: f32 = 0.48;

/// How many surfaces too thin to be solid a pixel looks through; each is taken four times as deep as the one before, for beside
/// a silhouette the filter of a pixel reaches over many small discs, one behind the other.
pub(super) const MOST_LAYERS: usize = 8;

/// Weight of a disc that faces away beside one that faces the viewer. Behind the silhouette of a closed surface discs face
/// away and stick out by R sin θ; lit on the side that they turn to the viewer, which is the inside, they would draw a dark
/// rim. Where nothing of the same surface faces the viewer this weight cancels: a back is seen as it is. A power of two,
/// which changes no bit of the quotient. The two sides do not add up to a coverage: at a silhouette each has its half.
const FACING_AWAY: f32 = 1.0 / 256.0;

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

/// One opaque splat.
#[derive(Clone, Copy, Default)]
struct Disc {
    splat: ProjectedSplat,
    depth: ProjectedDepth,
    /// If it reaches through the eye plane.
    near: Option<NearDisc>,
}

impl Disc {
    /// s and view depth of a run of pixels.
    #[inline(always)]
    fn at<S: Simd>(&self, simd: S, run: Run<S>, perspective: bool) -> [Lanes<S>; 2] {
        match &self.near {
            None => [run.distance_sq(simd, &self.splat), run.depth(simd, &self.depth)],
            Some(near) => run.meet(simd, &self.splat, near, perspective),
        }
    }
}

/// One surface of each pixel, planes of `AREA` numbers.
struct Layer {
    /// Nearest depth, +∞ where there is none; at last the blended depth.
    depth: Vec<f32>,
    weight: Vec<f32>,
    /// Σ weight·(depth − nearest): relative, so that far surfaces keep their digits.
    depth_sum: Vec<f32>,
    channels: Vec<f32>,
}

impl Layer {
    fn new(channels: usize) -> Self {
        let nought = || vec![0.0; AREA];
        Self {
            depth: vec![f32::INFINITY; AREA],
            weight: nought(),
            depth_sum: nought(),
            channels: vec![0.0; AREA * channels],
        }
    }

    /// Takes pixel `k` of another.
    fn take(&mut self, k: usize, other: &Self) {
        (self.depth[k], self.weight[k], self.depth_sum[k]) = (other.depth[k], other.weight[k], other.depth_sum[k]);
        let channels = self.channels.iter_mut().zip(&other.channels);
        channels.skip(k).step_by(AREA).for_each(|(to, from)| *to = *from);
    }

    fn clear(&mut self, k: usize) {
        (self.depth[k], self.weight[k], self.depth_sum[k]) = (f32::INFINITY, 0.0, 0.0);
        self.channels.iter_mut().skip(k).step_by(AREA).for_each(|v| *v = 0.0);
    }
}

/// Planes of `AREA` numbers each.
struct OpaqueTile {
    x: usize,
    y: usize,
    perspective: bool,
    /// Blocks in which pixels still look for a surface.
    open: [bool; BLOCKS],
    /// The surface that is being looked at.
    layer: Layer,
    /// Of those that are too thin, the one of most weight.
    best: Layer,
    /// Up to where surfaces are too thin; +∞ where a solid one is found.
    thin: Vec<f32>,
    /// The farthest of the fragments that were blended.
    last: Vec<f32>,
    /// Coverage so far by discs that face the viewer, and by others.
    front: Vec<f32>,
    back: Vec<f32>,
    object: Vec<u32>,
    fragments: u64,
}

/// Resolves the opaque splats `ids`; `values` holds `channels` numbers a splat, by id. Object ids are kept
/// when `objects` asks for them. After `progress.cancel()` the remaining tiles stay empty.
///
/// # Panics
/// If `projected` lacks depths, or objects that are asked for.
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
    assert_eq!(projected.depths.len(), projected.splats.len(), "invariant: opaque splats have depths");
    assert!(!objects || projected.objects.len() == projected.splats.len(), "invariant: objects when asked for");
    let bins = bin(projected, ids);
    progress.add_total(bins.tiles() as u64);
    let tiles: Vec<OpaqueTile> = (0..bins.tiles())
        .into_par_iter()
        .filter(|&t| progress.tick(1).is_ok() && !bins.is_empty(t))
        .map(|t| {
            let mut tile = OpaqueTile::new(&bins, t, channels, objects, projected.perspective.is_some());
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
        for_each_span(projected.size, tile.x, tile.y, |from, to| {
            image.depth[to.clone()].copy_from_slice(&tile.layer.depth[from.clone()]);
            for (plane, tile) in image.channels.iter_mut().zip(tile.layer.channels.chunks_exact(AREA)) {
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
        let (channels, size) = (tile.layer.channels.len() / AREA, projected.size);
        let mut records = [Disc::default(); BATCH];
        let batches = || bins.tile(t).flat_map(|list| list.chunks(BATCH));
        let gather = |batch: &[u32], records: &mut [Disc]| {
            for (&j, record) in batch.iter().zip(records) {
                let (splat, depth) = (projected.splats[j as usize], projected.depths[j as usize]);
                *record = Disc { splat, depth, near: projected.near_disc(&splat, j).copied() };
            }
        };
        for layer in 0..MOST_LAYERS {
            let epsilon_z = EPSILON_Z * (1 << (2 * layer)) as f32;
            for batch in batches() {
                gather(batch, &mut records);
                records[..batch.len()].iter().for_each(|disc| tile.nearest(simd, size, disc));
            }
            for batch in batches() {
                gather(batch, &mut records);
                for (disc, &j) in records.iter().zip(batch) {
                    let kernel = &projected.kernels[disc.splat.footprint as usize];
                    tile.blend(simd, size, disc, (kernel, epsilon_z), &values[j as usize * channels..][..channels]);
                }
            }
            if !tile.look_behind() {
                break;
            }
        }
        if !tile.object.is_empty() {
            for batch in batches() {
                gather(batch, &mut records);
                for (disc, &j) in records.iter().zip(batch) {
                    tile.name_nearest(simd, size, disc, projected.objects[j as usize]);
                }
            }
        }
        tile.normalize();
    }
}

impl OpaqueTile {
    fn new(bins: &Bins, t: usize, channels: usize, objects: bool, perspective: bool) -> Self {
        Self {
            perspective,
            open: [true; BLOCKS],
            x: (t % bins.columns) * TILE,
            y: (t / bins.columns) * TILE,
            layer: Layer::new(channels),
            best: Layer::new(channels),
            thin: vec![f32::NEG_INFINITY; AREA],
            last: vec![f32::NEG_INFINITY; AREA],
            front: vec![0.0; AREA],
            back: vec![0.0; AREA],
            object: vec![u32::MAX; if objects { AREA } else { 0 }],
            fragments: 0,
        }
    }

    /// Step 1: the nearest depth behind what is too thin.
    #[inline(always)]
    fn nearest<S: Simd>(&mut self, simd: S, size: [u32; 2], disc: &Disc) {
        let runs = Runs::new(simd, &disc.splat, size, [self.x, self.y]);
        self.fragments += runs.pixels();
        for run in runs {
            if !self.open[run.block] {
                continue;
            }
            let far = Lanes::splat(simd, f32::INFINITY);
            let core = Lanes::splat(simd, CORE);
            let [s, depth] = disc.at(simd, run, self.perspective);
            let thin = Lanes::load(simd, &self.thin[run.pixel()..]);
            let behind = depth.where_less_or(thin, depth, far).where_less_or(s, core, far);
            let nearest = &mut self.layer.depth[run.pixel()..];
            Lanes::load(simd, nearest).min(behind).store(nearest);
        }
    }

    /// Whose the nearest depth is; of several at the same depth the first.
    #[inline(always)]
    fn name_nearest<S: Simd>(&mut self, simd: S, size: [u32; 2], disc: &Disc, object: u32) {
        for run in Runs::new(simd, &disc.splat, size, [self.x, self.y]) {
            let (mut s, mut z) = ([0.0; MAX_LANES], [0.0; MAX_LANES]);
            let [distance_sq, depth] = disc.at(simd, run, self.perspective);
            distance_sq.store(&mut s);
            depth.store(&mut z);
            for i in 0..Lanes::<S>::COUNT {
                let k = run.pixel() + i;
                if s[i] < CORE && z[i] == self.layer.depth[k] && self.object[k] == u32::MAX {
                    self.object[k] = object;
                }
            }
        }
    }

    /// Step 2: weights of all fragments within ε-z of the nearest.
    #[inline(always)]
    fn blend<S: Simd>(
        &mut self,
        simd: S,
        size: [u32; 2],
        disc: &Disc,
        (kernel, epsilon_z): (&Kernel, f32),
        values: &[f32],
    ) {
        let of = |v: f32| Lanes::splat(simd, v);
        let runs = Runs::new(simd, &disc.splat, size, [self.x, self.y]);
        self.fragments += runs.pixels();
        let (nought, amount) = (of(0.0), disc.splat.peak.abs());
        let is_front = disc.splat.peak > 0.0;
        let share = if is_front { 1.0 } else { FACING_AWAY };
        let own = of(amount * kernel.own);
        let reach = of(epsilon_z * disc.depth.extent);
        for run in runs {
            if !self.open[run.block] {
                continue;
            }
            let k = run.pixel();
            let (nearest, thin) = (Lanes::load(simd, &self.layer.depth[k..]), Lanes::load(simd, &self.thin[k..]));
            let [s, depth] = disc.at(simd, run, self.perspective);
            let behind = depth - nearest;
            let covered = of(amount) * kernel.profile(simd, (of(1.0) - s).max(nought));
            let within = |v: Lanes<S>| {
                // No surface is infinitely far: there the distance is, and nothing counts. Nor where a solid one was found.
                v.where_less(behind.abs(), reach).where_less(thin, depth)
            };
            let covered = within(covered);
            let add = |plane: &mut [f32], v: Lanes<S>| (Lanes::load(simd, plane) + v).store(plane);
            let weight = covered * of(share);
            add(&mut self.layer.weight[k..], weight);
            let certain = within(of(1.0).where_less(s, own));
            add(if is_front { &mut self.front[k..] } else { &mut self.back[k..] }, covered + certain);
            let last = depth.where_less_or(nought, covered, of(f32::NEG_INFINITY));
            Lanes::load(simd, &self.last[k..]).max(last).store(&mut self.last[k..]);
            add(&mut self.layer.depth_sum[k..], within(behind) * weight);
            for (c, value) in values.iter().enumerate() {
                add(&mut self.layer.channels[c * AREA + k..], weight * of(*value));
            }
        }
    }

    /// Closes the pixels that are covered, with the surface of most weight, and readies the others for what lies behind;
    /// whether there are any of those.
    fn look_behind(&mut self) -> bool {
        self.open = [false; BLOCKS];
        for k in 0..AREA {
            if self.layer.depth[k] == f32::INFINITY || self.thin[k] == f32::INFINITY {
                continue;
            }
            let is_best = self.layer.weight[k] >= self.best.weight[k];
            if self.front[k].max(self.back[k]) >= SOLID {
                self.thin[k] = f32::INFINITY;
                if !is_best {
                    self.layer.take(k, &self.best);
                }
                continue;
            }
            self.open[k / PIXELS] = true;
            self.thin[k] = self.last[k].max(self.layer.depth[k]);
            if is_best {
                self.best.take(k, &self.layer);
            }
            self.layer.clear(k);
        }
        self.open.contains(&true)
    }

    /// Σwc/Σw and Σwz/Σw.
    fn normalize(&mut self) {
        for k in 0..AREA {
            if self.layer.weight[k] > 0.0 {
                self.layer.depth[k] += self.layer.depth_sum[k] / self.layer.weight[k];
                self.layer.channels.iter_mut().skip(k).step_by(AREA).for_each(|v| *v /= self.layer.weight[k]);
            } else {
                self.layer.depth[k] = f32::INFINITY;
            }
        }
    }
}
