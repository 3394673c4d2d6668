//! Opaque surfaces first: nearest depth per pixel, then all fragments within ε-z of it on either side, weights normalised.
//!
//! Which splats the first of these steps leaves to the second is known before anything is shaded: [`NearestSurfaces`] has both, and what lies hidden needs
//! no light.
//!
//! A disc hides what lies behind it within [`Footprint::CORE`] of its radius, which leaves no hole between neighbours on a surface,
//! and without the image's filter, which would make every silhouette wider. Its colour is blended over the whole radius,
//! filter and all: c = Σwc/Σw. One whose footprint is an image hides where that is solid, see [`crate::FootprintImage`].

use super::RasterCounts;
use super::bins::{Bins, TILE, bin};
use super::kernel::Kernel;
use super::lanes::{Broadcast, Lanes, MAX_LANES};
use super::projected::{Projected, ProjectedDepth, ProjectedSplat, SpecialDisc};
use super::source::Source;
use super::special;
use super::tile::{AREA, BATCH, Run, Runs, for_each_span, tile_of};
use crate::{Error, Footprint, Progress};
use pulp::Simd;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

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
                [kernel.profile(simd, (simd.lanes(1.0) - s).max(simd.lanes(0.0))), run.depth(simd, &self.depth)]
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

/// The nearest surface in one tile. Planes of `AREA` numbers each.
struct NearestTile {
    x: usize,
    y: usize,
    /// Nearest depth, +∞ where there is none.
    depth: Vec<f32>,
    object: Vec<u32>,
    /// Ids of the discs that some pixel shows, in list order.
    seen: Vec<u32>,
    fragments: u64,
}

/// What is blended at the nearest surface of one tile. Planes of `AREA` numbers each.
struct BlendedTile {
    weight: Vec<f32>,
    /// Σ weight·(depth − nearest): relative, so that far surfaces keep their digits; at last the blended depth.
    depth: Vec<f32>,
    channels: Vec<f32>,
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

/// Resolves opaque splats. Two ticks a tile.
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
    let OpaqueInput { projected, ids, values, channels, objects } = *input;
    NearestSurfaces::find(projected, ids, objects, progress)?.resolve(values, channels, progress)
}

/// The nearest opaque surfaces of an image, found before anything is shaded.
///
/// ```
/// use splat_core::raster::{Detail, NearestSurfaces, Params, ProjectInput, project};
/// use splat_core::{Camera, Cloud, FootprintStack, Material, Projection, Splat, SplatKind};
/// use splat_core::glam::{DVec3, Vec3};
///
/// // Two discs, one behind the other.
/// let mut cloud = Cloud::new(DVec3::ZERO);
/// let disc = Splat { kind: SplatKind::Opaque, normal: Vec3::Z, radius: 0.5, cross_section: 0.7, ..Splat::default() };
/// cloud.push(&disc);
/// cloud.push(&Splat { position: [0.0, 0.0, -1.0].into(), radius: 0.2, ..disc });
/// let view = Projection::Orthographic { height: 2.0 };
/// let camera = Camera::look_at(DVec3::Z, DVec3::ZERO, DVec3::Y, view, [64, 64]).unwrap();
/// let footprints = FootprintStack::default();
/// let materials = [Material::default()];
/// let params = Params::default();
/// let input = ProjectInput { cloud: &cloud, camera: &camera, footprints: &footprints, materials: &materials, params: &params, detail: Detail::ALL };
/// let projected = project(&input);
/// let nearest = NearestSurfaces::find(&projected, &[0, 1], false, None).unwrap();
/// assert!(nearest.shows(0) && !nearest.shows(1));
/// // The values of what is hidden are never read.
/// let (image, _) = nearest.resolve(&[0.25, f32::NAN], 1, None).unwrap();
/// assert_eq!(image.channels[0][64 * 32 + 32], 0.25);
/// ```
pub struct NearestSurfaces<'a> {
    projected: &'a Projected,
    /// Whether there is no disc at all.
    is_empty: bool,
    /// Of the tiles that a disc reaches.
    tiles: Vec<NearestTile>,
    /// A bit for each splat that some pixel shows.
    seen: Vec<u64>,
    objects: bool,
    counts: RasterCounts,
}

impl<'a> NearestSurfaces<'a> {
    /// Those of opaque splats, by their ids; whose they are, if `objects` are kept. One tick a tile.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    ///
    /// # Panics
    /// If `projected` lacks depths, or objects that are asked for.
    pub fn find(
        projected: &'a Projected,
        ids: &[u32],
        objects: bool,
        progress: Option<&Progress>,
    ) -> Result<Self, Error> {
        let quiet = Progress::new();
        let progress = progress.unwrap_or(&quiet);
        let is_deep = ids.is_empty() || projected.depths.len() == projected.splats.len();
        assert!(is_deep, "invariant: opaque splats have depths");
        let is_named = ids.is_empty() || !objects || projected.objects.len() == projected.splats.len();
        assert!(is_named, "invariant: objects when asked for");
        let bins = bin(projected, ids);
        progress.add_total(bins.tiles() as u64);
        let seen: Vec<AtomicU64> =
            (0..projected.splats.len().div_ceil(u64::BITS as usize)).map(|_| AtomicU64::new(0)).collect();
        let tiles: Vec<NearestTile> = (0..bins.tiles())
            .into_par_iter()
            .filter(|&t| progress.tick(1).is_ok() && !bins.is_empty(t))
            .map(|t| {
                let mut tile = NearestTile::new(&bins, t, objects);
                pulp::Arch::new().dispatch(FindTile { tile: &mut tile, bins: &bins, t, projected });
                for id in &tile.seen {
                    seen[*id as usize / u64::BITS as usize].fetch_or(1 << (id % u64::BITS), Ordering::Relaxed);
                }
                tile
            })
            .collect();
        progress.tick(0)?;
        let counts = RasterCounts {
            splats: bins.splats(),
            tile_entries: bins.entries(),
            fragments: tiles.iter().map(|tile| tile.fragments).sum(),
            bytes: bins.bytes(),
        };
        let seen = seen.into_iter().map(AtomicU64::into_inner).collect();
        Ok(Self { projected, is_empty: ids.is_empty(), tiles, seen, objects, counts })
    }

    /// Whether some pixel shows opaque splat `i`.
    pub fn shows(&self, i: usize) -> bool {
        self.seen[i / u64::BITS as usize] >> (i % u64::BITS as usize) & 1 == 1
    }

    /// Number of splats that some pixel shows.
    pub fn shown(&self) -> u64 {
        self.seen.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// The surfaces with the values of their splats: as many numbers a splat as there are `channels`, by id, of which those of splats that no pixel
    /// [shows](Self::shows) are not read. An empty image where nothing is opaque. One tick a tile.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    pub fn resolve(
        self,
        values: &[f32],
        channels: u32,
        progress: Option<&Progress>,
    ) -> Result<(OpaqueImage, RasterCounts), Error> {
        let Self { projected, tiles, is_empty, objects, counts, .. } = self;
        if is_empty {
            return Ok((OpaqueImage::default(), counts));
        }
        let quiet = Progress::new();
        let progress = progress.unwrap_or(&quiet);
        let channels = channels as usize;
        progress.add_total(tiles.len() as u64);
        let blended: Vec<BlendedTile> = tiles
            .par_iter()
            .filter(|_| progress.tick(1).is_ok())
            .map(|nearest| {
                let mut tile = BlendedTile::new(channels);
                pulp::Arch::new().dispatch(BlendTile { tile: &mut tile, nearest, projected, values });
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
        for (nearest, tile) in tiles.iter().zip(&blended) {
            for_each_span(projected.size, nearest.x, nearest.y, |from, to| {
                image.depth[to.clone()].copy_from_slice(&tile.depth[from.clone()]);
                for (plane, tile) in image.channels.iter_mut().zip(tile.channels.chunks_exact(AREA)) {
                    plane[to.clone()].copy_from_slice(&tile[from.clone()]);
                }
                if objects {
                    image.object[to].copy_from_slice(&nearest.object[from]);
                }
            });
        }
        let counts = RasterCounts {
            fragments: counts.fragments + blended.iter().map(|tile| tile.fragments).sum::<u64>(),
            bytes: counts.bytes + (n * 4 * (channels + 2)) as u64,
            ..counts
        };
        Ok((image, counts))
    }
}

/// How far the opaque surfaces of an image reach, tile by tile: what lies behind all of them in every tile that it covers is seen nowhere, and
/// [`fold`](super::fold) does not read its values.
pub struct Cover {
    /// The farthest of the depths of a tile, +∞ where a pixel of it is free.
    farthest: Vec<f32>,
    columns: usize,
}

impl Cover {
    /// Of an image of `size` pixels; nothing is hidden where `opaque` is empty.
    pub fn new(opaque: &OpaqueImage, size: [u32; 2]) -> Self {
        let [columns, rows] = size.map(|s| (s as usize).div_ceil(TILE));
        let farthest = (0..columns * rows).into_par_iter().map(|t| {
            let corner = [t % columns * TILE, t / columns * TILE];
            tile_of(&opaque.depth, size, corner, f32::INFINITY).into_iter().reduce(f32::max).unwrap_or(f32::INFINITY)
        });
        Self { farthest: farthest.collect(), columns }
    }

    /// Whether translucent splat `i` lies behind all surfaces in every tile.
    pub fn hides(&self, projected: &Projected, i: usize) -> bool {
        let source = Source::new(projected, i as u32);
        let [first, last] = projected.coverage[i].tiles(|| source.splat.bounds(projected.size));
        (first[1]..=last[1]).all(|row| {
            let tiles = &self.farthest[row * self.columns..][first[0]..=last[0]];
            tiles.iter().all(|farthest| source.is_behind(*farthest))
        })
    }
}

/// The first step in one tile, in the form that [`pulp`] compiles once per instruction set.
struct FindTile<'a> {
    tile: &'a mut NearestTile,
    bins: &'a Bins,
    t: usize,
    projected: &'a Projected,
}

impl pulp::WithSimd for FindTile<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tile, bins, t, projected } = self;
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
                if tile.shows(simd, projected, disc) {
                    tile.seen.push(j);
                }
            }
        }
    }
}

/// The second step in one tile.
struct BlendTile<'a> {
    tile: &'a mut BlendedTile,
    nearest: &'a NearestTile,
    projected: &'a Projected,
    values: &'a [f32],
}

impl pulp::WithSimd for BlendTile<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { tile, nearest, projected, values } = self;
        let channels = tile.channels.len() / AREA;
        let mut records = [Disc::default(); BATCH];
        for batch in nearest.seen.chunks(BATCH) {
            gather(projected, batch, &mut records);
            for (disc, &j) in records.iter().zip(batch) {
                tile.blend(simd, nearest, projected, disc, &values[j as usize * channels..][..channels]);
            }
        }
        tile.normalize(nearest);
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

impl NearestTile {
    fn new(bins: &Bins, t: usize, objects: bool) -> Self {
        let [x, y] = bins.corner(t);
        Self {
            x,
            y,
            depth: vec![f32::INFINITY; AREA],
            object: vec![u32::MAX; if objects { AREA } else { 0 }],
            seen: Vec::new(),
            fragments: 0,
        }
    }

    /// The nearest depth.
    #[inline(always)]
    fn nearest<S: Simd>(&mut self, simd: S, projected: &Projected, disc: &Disc<'_>) {
        let runs = Runs::new(simd, &disc.splat, projected.size, [self.x, self.y]);
        self.fragments += runs.pixels();
        for run in runs {
            let far = simd.lanes(f32::INFINITY);
            let core = simd.lanes(CORE);
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

    /// Whether a fragment of a disc may have a weight, see [`BlendedTile::blend`].
    #[inline(always)]
    fn shows<S: Simd>(&mut self, simd: S, projected: &Projected, disc: &Disc<'_>) -> bool {
        if disc.special.is_some() {
            return true;
        }
        for run in Runs::new(simd, &disc.splat, projected.size, [self.x, self.y]) {
            self.fragments += Lanes::<S>::COUNT as u64;
            let behind = run.depth(simd, &disc.depth) - Lanes::load(simd, &self.depth[run.pixel()..]);
            let inside = simd.lanes(1.0) - run.distance_sq(simd, &disc.splat);
            let near = inside.where_less(behind.abs(), simd.lanes(EPSILON_Z * disc.depth.extent));
            if simd.lanes(0.0).any_less(near) {
                return true;
            }
        }
        false
    }
}

impl BlendedTile {
    fn new(channels: usize) -> Self {
        Self { weight: vec![0.0; AREA], depth: vec![0.0; AREA], channels: vec![0.0; AREA * channels], fragments: 0 }
    }

    /// Weights of all fragments within ε-z of the nearest.
    #[inline(always)]
    fn blend<S: Simd>(
        &mut self,
        simd: S,
        surface: &NearestTile,
        projected: &Projected,
        disc: &Disc<'_>,
        values: &[f32],
    ) {
        let runs = Runs::new(simd, &disc.splat, projected.size, [surface.x, surface.y]);
        self.fragments += runs.pixels();
        for run in runs {
            let k = run.pixel();
            let nearest = Lanes::load(simd, &surface.depth[k..]);
            // Behind by how much; where there is no surface −∞, and nothing counts. Before it lie the rims of nearer surfaces.
            let [profile, depth] = disc.profile(simd, run, projected.kernel(&disc.splat), projected);
            let behind = depth - nearest;
            let amount = simd.lanes(disc.splat.peak) * profile;
            let near = amount.where_less(behind.abs(), simd.lanes(EPSILON_Z * disc.depth.extent));
            let weight = near.where_less(nearest, simd.lanes(f32::INFINITY));
            let add = |plane: &mut [f32], v: Lanes<S>| (Lanes::load(simd, plane) + v).store(plane);
            add(&mut self.weight[k..], weight);
            let finite = behind.where_less(nearest, simd.lanes(f32::INFINITY));
            add(&mut self.depth[k..], weight * finite);
            for (c, value) in values.iter().enumerate() {
                add(&mut self.channels[c * AREA + k..], weight * simd.lanes(*value));
            }
        }
    }

    /// Σwc/Σw and Σwz/Σw.
    fn normalize(&mut self, surface: &NearestTile) {
        for k in 0..AREA {
            if self.weight[k] > 0.0 {
                self.depth[k] = surface.depth[k] + self.depth[k] / self.weight[k];
                self.channels.iter_mut().skip(k).step_by(AREA).for_each(|v| *v /= self.weight[k]);
            } else {
                self.depth[k] = f32::INFINITY;
            }
        }
    }
}
