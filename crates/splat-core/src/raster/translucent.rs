//! Translucent splats in order, tile by tile.
//!
//! Front to back: weight = T·(1 − e^−τ), T ← T − weight, A ← A + τ, C ← C + weight·c. The weights sum to 1 − T up to
//! rounding however many splats there are, and 1 − e^−τ comes from a series, so tiny τ keep their digits. A = Στ is what
//! leaves the tile; a fold that goes on begins with T = e^−A. Back to front is the twin: C ← C + (1 − e^−τ)·(c − C).
//!
//! A block of pixels that let nothing more through is finished, so most splats of a thick medium are passed over. [`Reached`] finds the others before
//! they are shaded: it folds optical depths alone, by the same steps, so it finishes every block at the same splat.
//!
//! A medium that straddles an opaque surface counts with the share of its kernel in front of it, as it does at the eye plane: no
//! seam where a cloud meets the ground. A disc that reaches through the eye plane counts where its plane lies before the eye.

use super::bins::{Bins, bin};
use super::lanes::{Broadcast, Lanes, MAX_LANES, SMALL, exp_neg};
use super::projected::{Projected, ProjectedDepth, ProjectedSplat};
use super::source::{Place, Source, TileRays};
use super::tile::{BATCH, BLOCKS, Conic, Line, PIXELS, Run, Runs, for_each_span, tile_of};
use super::{Accumulation, OpaqueImage, Params, RasterCounts};
use crate::compositing::depth_profile::DepthFragment;
use crate::shade::ChannelLayout;
use crate::{Accumulator, DepthProfile, Direction, Error, Material, Progress, SplatKind};
use pulp::Simd;
use rayon::prelude::*;
use std::sync::atomic::{AtomicU64, Ordering};

/// The state of one tile while splats are folded into it.
struct Tile {
    /// First pixel.
    x: usize,
    y: usize,
    size: [u32; 2],
    /// For each block the lines of its planes: optical depths, transmittances, channels.
    lines: Vec<Line>,
    /// Planes of optical depth, 1 or 3, and as many of transmittance.
    planes: usize,
    channels: usize,
    rays: TileRays,
    /// Empty when not asked for, as is the next.
    depth: Vec<DepthProfile>,
    object: Vec<u32>,
    fragments: u64,
    /// A bit for each block that is finished.
    done: u64,
    /// Ids of the splats that were composited, in list order; `None` when not asked for.
    reached: Option<Vec<u32>>,
}

/// One bit for each block of a tile.
const _: () = assert!(BLOCKS == u64::BITS as usize, "a bit for each block");

/// Whether block `k` is one of some.
#[inline(always)]
fn is_in(blocks: u64, k: usize) -> bool {
    blocks >> k & 1 == 1
}

/// What is folded.
#[derive(Debug, Clone, Copy)]
pub struct FoldInput<'a> {
    /// Footprints by id.
    pub projected: &'a Projected,
    /// Ids in compositing order.
    pub order: &'a [u32],
    /// As many numbers a splat as the accumulator has channels, by id.
    pub values: &'a [f32],
    /// Extinction per channel, by id; with one plane of optical depth, which is for materials that absorb all channels alike, that
    /// of the first channel.
    pub materials: &'a [Material],
    /// What hides splats; empty where nothing does.
    pub opaque: &'a OpaqueImage,
    /// Which end comes first.
    pub direction: Direction,
    /// The cut-off and the precision of sums, which on a device must be single.
    pub params: &'a Params,
}

/// Folds splats, in compositing order, into `accumulator`. Front to back can continue an accumulator that holds nearer splats;
/// back to front can continue one that holds farther ones, but not one with depths, which are made front to back. One tick a
/// tile.
///
/// # Errors
/// [`Error::Cancelled`]: the tiles that were done are in the accumulator, which is of no use as a picture; the others are as they
/// were.
///
/// # Panics
/// If sizes of the image, the accumulator and `values` disagree, or `projected` lacks depths or objects that an opaque
/// image, depths or an object plane call for; for depths back to front.
pub fn fold(
    input: &FoldInput<'_>,
    accumulator: &mut Accumulator,
    progress: Option<&Progress>,
) -> Result<RasterCounts, Error> {
    let FoldInput { projected, order, values, opaque, direction, .. } = *input;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    assert_eq!(projected.size, accumulator.size, "invariant: one image size");
    assert_eq!(values.len(), projected.splats.len() * accumulator.channels.len(), "invariant: values for each splat");
    let needs_object = !accumulator.object.is_empty();
    let needs_depth = needs_object || !(opaque.depth.is_empty() && accumulator.depth.is_empty());
    assert!(
        direction == Direction::FrontToBack || accumulator.depth.is_empty(),
        "invariant: depths are made front to back"
    );
    assert!(
        !needs_depth || projected.depths.len() == projected.splats.len(),
        "invariant: depths where they are needed"
    );
    assert!(
        !needs_object || projected.objects.len() == projected.splats.len(),
        "invariant: objects for an object plane"
    );
    let bins = bin(projected, order);
    progress.add_total(bins.tiles() as u64);
    let finished: Vec<Tile> = (0..bins.tiles())
        .into_par_iter()
        .filter(|&t| progress.tick(1).is_ok() && !bins.is_empty(t))
        .map(|t| {
            let mut tile = Tile::load(accumulator, projected, opaque, &bins, t);
            pulp::Arch::new().dispatch(FoldTile { tile: &mut tile, bins: &bins, t, input });
            tile
        })
        .collect();
    let mut counts = RasterCounts {
        splats: bins.splats(),
        tile_entries: bins.entries(),
        bytes: bins.bytes() + projected.bytes(),
        ..RasterCounts::default()
    };
    for tile in finished {
        counts.fragments += tile.fragments;
        counts.bytes += size_of_val(&*tile.lines) as u64;
        tile.store(accumulator);
    }
    progress.tick(0)?;
    Ok(counts)
}

/// The splats that [`fold`] composites into an empty accumulator, found before they are shaded: the values of all others are never read.
///
/// ```
/// use splat_core::raster::{Detail, FoldInput, OpaqueImage, Params, ProjectInput, Reached, project};
/// use splat_core::{Camera, Cloud, Direction, FootprintStack, Material, Projection, Splat};
/// use splat_core::glam::{DVec3, Vec3};
///
/// // 100 wide splats of one optical depth each, one behind the other.
/// let mut cloud = Cloud::new(DVec3::ZERO);
/// for k in 0..100 {
///     let position = Vec3::new(0.0, 0.0, -(k as f32));
///     cloud.push(&Splat { position, radius: 20.0, cross_section: 250.0, ..Splat::default() });
/// }
/// let view = Projection::Orthographic { height: 2.0 };
/// let camera = Camera::look_at(DVec3::Z * 40.0, DVec3::ZERO, DVec3::Y, view, [64, 64]).unwrap();
/// let footprints = FootprintStack::default();
/// let materials = [Material::default()];
/// let params = Params::default();
/// let input = ProjectInput { cloud: &cloud, camera: &camera, footprints: &footprints, materials: &materials, params: &params, detail: Detail::ALL };
/// let projected = project(&input);
/// let order: Vec<u32> = (0..100).collect();
/// let opaque = OpaqueImage::default();
/// let input = FoldInput { projected: &projected, order: &order, values: &[], materials: &materials, opaque: &opaque, direction: Direction::FrontToBack, params: &params };
/// let reached = Reached::find(&input, 1, None).unwrap();
/// // A transmittance of 1/1024 finishes a pixel, as soon as the batch of 64 splats is over.
/// assert!(reached.has(0) && !reached.has(64));
/// ```
pub struct Reached {
    /// A bit for each splat.
    bits: Vec<u64>,
    counts: RasterCounts,
}

impl Reached {
    /// Finds them; `input.values` are not read, and `planes` are the accumulator's planes of optical depth, 1 or 3. One tick a tile.
    ///
    /// # Errors
    /// [`Error::Cancelled`].
    ///
    /// # Panics
    /// If `projected` lacks depths that an opaque image calls for; back to front, where all splats are composited.
    pub fn find(input: &FoldInput<'_>, planes: usize, progress: Option<&Progress>) -> Result<Self, Error> {
        let FoldInput { projected, order, opaque, direction, .. } = *input;
        assert_eq!(direction, Direction::FrontToBack, "invariant: pixels are finished front to back");
        let is_deep = opaque.depth.is_empty() || projected.depths.len() == projected.splats.len();
        assert!(is_deep, "invariant: depths where they are needed");
        let quiet = Progress::new();
        let progress = progress.unwrap_or(&quiet);
        let empty = Accumulator::new(projected.size, planes, 0, false, false);
        let bins = bin(projected, order);
        progress.add_total(bins.tiles() as u64);
        let words = projected.splats.len().div_ceil(u64::BITS as usize);
        let bits: Vec<AtomicU64> = (0..words).map(|_| AtomicU64::new(0)).collect();
        let tiles = (0..bins.tiles()).into_par_iter().filter(|&t| progress.tick(1).is_ok() && !bins.is_empty(t));
        let fragments = tiles.map(|t| {
            let mut tile = Tile { reached: Some(Vec::new()), ..Tile::load(&empty, projected, opaque, &bins, t) };
            pulp::Arch::new().dispatch(FoldTile { tile: &mut tile, bins: &bins, t, input });
            for id in tile.reached.iter().flatten() {
                bits[*id as usize / u64::BITS as usize].fetch_or(1 << (id % u64::BITS), Ordering::Relaxed);
            }
            tile.fragments
        });
        let counts = RasterCounts {
            fragments: fragments.sum(),
            splats: bins.splats(),
            tile_entries: bins.entries(),
            bytes: bins.bytes(),
        };
        progress.tick(0)?;
        Ok(Self { bits: bits.into_iter().map(AtomicU64::into_inner).collect(), counts })
    }

    /// Whether splat `i` is composited.
    pub fn has(&self, i: usize) -> bool {
        self.bits[i / u64::BITS as usize] >> (i % u64::BITS as usize) & 1 == 1
    }

    /// The number of splats that are composited.
    pub fn count(&self) -> u64 {
        self.bits.iter().map(|word| u64::from(word.count_ones())).sum()
    }

    /// The work of finding them.
    pub fn counts(&self) -> RasterCounts {
        self.counts
    }
}

/// One tile's work, in the form that [`pulp`] compiles once per instruction set.
struct FoldTile<'a> {
    tile: &'a mut Tile,
    bins: &'a Bins,
    t: usize,
    input: &'a FoldInput<'a>,
}

impl pulp::WithSimd for FoldTile<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let half = self.input.params.accumulation == Accumulation::F16;
        match (self.input.direction, half, self.tile.planes, self.tile.channels) {
            (Direction::FrontToBack, false, 1, 3) => self.fold::<S, true, false, 1, 3>(simd),
            (Direction::FrontToBack, false, 1, _) => self.fold::<S, true, false, 1, 0>(simd),
            (Direction::FrontToBack, false, ..) => self.fold::<S, true, false, 3, 0>(simd),
            (Direction::BackToFront, false, 1, _) => self.fold::<S, false, false, 1, 0>(simd),
            (Direction::BackToFront, false, ..) => self.fold::<S, false, false, 3, 0>(simd),
            (Direction::FrontToBack, true, 1, _) => self.fold::<S, true, true, 1, 0>(simd),
            (Direction::FrontToBack, true, ..) => self.fold::<S, true, true, 3, 0>(simd),
            (Direction::BackToFront, true, 1, _) => self.fold::<S, false, true, 1, 0>(simd),
            (Direction::BackToFront, true, ..) => self.fold::<S, false, true, 3, 0>(simd),
        }
    }
}

/// One splat as the fold reads it.
struct Splat<'a> {
    source: Source<'a>,
    object: u32,
    extinction: [f32; 3],
    /// Whether every τ of it is small.
    thin: bool,
    value: &'a [f32],
}

impl FoldTile<'_> {
    /// `CHANNELS` is their number, or 0 when it is only known at run time.
    #[inline(always)]
    fn fold<S: Simd, const FRONT: bool, const HALF: bool, const PLANES: usize, const CHANNELS: usize>(self, simd: S) {
        let channels = if CHANNELS > 0 { CHANNELS } else { self.tile.channels };
        let FoldInput { projected, values: of_splats, materials, params, .. } = *self.input;
        let deep = self.tile.needs_depth();
        let names = !self.tile.object.is_empty();
        let mut records = [ProjectedSplat::default(); BATCH];
        let mut depths = [ProjectedDepth::default(); BATCH];
        let mut values = vec![0.0; BATCH * channels];
        let mut conic = Conic::new();
        for list in self.bins.tile(self.t) {
            for batch in list.chunks(BATCH) {
                for (k, (&j, record)) in batch.iter().zip(&mut records).enumerate() {
                    *record = projected.splats[j as usize];
                    let value = &of_splats[j as usize * channels..][..channels];
                    values[k * channels..][..channels].copy_from_slice(value);
                }
                if deep {
                    batch.iter().zip(&mut depths).for_each(|(&j, depth)| *depth = projected.depths[j as usize]);
                }
                for (k, &j) in batch.iter().enumerate() {
                    let splat = &records[k];
                    let material = &materials[splat.material as usize];
                    let mut source = Source {
                        splat,
                        special: projected.special_disc(splat, j),
                        depth: depths[k],
                        kernel: &projected.kernels[splat.footprint as usize],
                        is_met: true,
                    };
                    match self.tile.rays.place(&source) {
                        Place::Behind => continue,
                        place => source.is_met = place == Place::Among,
                    }
                    let splat = Splat {
                        source,
                        object: if names { projected.object(j as usize) } else { u32::MAX },
                        extinction: material.extinction_rgb,
                        // A slab across the eye plane is met at many angles, the profile of an image is above 1, and the peak of a
                        // Gaussian is no optical depth.
                        thin: splat.peak * material.greatest_extinction() <= SMALL
                            && !splat.is_special()
                            && !splat.is_gaussian(),
                        value: &values[k * channels..][..channels],
                    };
                    let is_composited = self.tile.splat::<S, FRONT, HALF, PLANES, CHANNELS>(simd, &splat, &mut conic);
                    if let Some(reached) = self.tile.reached.as_mut().filter(|_| is_composited) {
                        reached.push(j);
                    }
                }
                if FRONT && self.tile.finish_blocks(params.transmittance_cutoff) {
                    return;
                }
            }
        }
    }
}

impl Tile {
    fn load(acc: &Accumulator, projected: &Projected, opaque: &OpaqueImage, bins: &Bins, t: usize) -> Self {
        let [x, y] = bins.corner(t);
        let depth = tile_of(&acc.depth, acc.size, [x, y], DepthProfile::default());
        let object = tile_of(&acc.object, acc.size, [x, y], u32::MAX);
        let planes = acc.optical_depth.len();
        let channels = acc.channels.len();
        let mut tile = Self {
            x,
            y,
            size: acc.size,
            lines: vec![Line([0.0; PIXELS]); BLOCKS * (2 * planes + channels)],
            planes,
            channels,
            rays: TileRays::new(projected, &opaque.depth, [x, y]),
            depth,
            object,
            fragments: 0,
            done: 0,
            reached: None,
        };
        tile.load_lines(acc);
        tile
    }

    /// Optical depths, transmittances and channels. T stays 0 outside the image, where nothing shall keep a tile busy.
    fn load_lines(&mut self, acc: &Accumulator) {
        let planes = self.planes;
        let stride = 2 * planes + self.channels;
        for (p, plane) in acc.optical_depth.iter().chain(&acc.channels).enumerate() {
            let line = if p < planes { p } else { p + planes };
            for_each_span(self.size, self.x, self.y, |tile, image| {
                let block = tile.start / PIXELS * stride;
                for (k, v) in (tile.start % PIXELS..).zip(&plane[image]) {
                    self.lines[block + line].0[k] = *v;
                    if p < planes {
                        self.lines[block + planes + p].0[k] = exp_neg(*v);
                    }
                }
            });
        }
    }

    fn store(self, acc: &mut Accumulator) {
        let size = acc.size;
        let planes = self.planes;
        let stride = 2 * planes + self.channels;
        for (p, plane) in acc.optical_depth.iter_mut().chain(&mut acc.channels).enumerate() {
            let line = if p < planes { p } else { p + planes };
            for_each_span(size, self.x, self.y, |tile, image| {
                let from = &self.lines[tile.start / PIXELS * stride + line].0[tile.start % PIXELS..];
                plane[image.clone()].copy_from_slice(&from[..image.len()]);
            });
        }
        if !self.depth.is_empty() {
            for_each_span(size, self.x, self.y, |tile, image| acc.depth[image].copy_from_slice(&self.depth[tile]));
        }
        if !self.object.is_empty() {
            for_each_span(size, self.x, self.y, |tile, image| acc.object[image].copy_from_slice(&self.object[tile]));
        }
    }

    /// Whether splats need a depth, or an object, which are read from memory of their own.
    fn needs_depth(&self) -> bool {
        !(self.rays.are_free() && self.depth.is_empty() && self.object.is_empty())
    }

    /// Marks the blocks of which all transmittances are below the cut-off. Returns whether all blocks are done.
    fn finish_blocks(&mut self, cutoff: f32) -> bool {
        let stride = 2 * self.planes + self.channels;
        let before = self.done;
        for (k, lines) in self.lines.chunks_exact(stride).enumerate().filter(|(k, _)| !is_in(before, *k)) {
            let is_done = lines[self.planes..2 * self.planes].iter().all(|t| t.0.iter().all(|t| *t < cutoff));
            self.done |= u64::from(is_done) << k;
        }
        self.done == u64::MAX
    }

    /// Composites a splat into the blocks that are not finished. Returns whether there are any.
    #[inline(always)]
    fn splat<S: Simd, const FRONT: bool, const HALF: bool, const PLANES: usize, const CHANNELS: usize>(
        &mut self,
        simd: S,
        splat: &Splat<'_>,
        conic: &mut Conic,
    ) -> bool {
        let mut is_composited = false;
        let runs = Runs::new(simd, splat.source.splat, self.size, [self.x, self.y]);
        self.fragments += runs.pixels();
        let done = if FRONT { self.done } else { 0 };
        // A loop of its own for what most splats are.
        if splat.thin && splat.source.is_plain() {
            conic.fill(simd, splat.source.splat, &runs);
            for run in runs {
                if !is_in(done, run.block) {
                    is_composited = true;
                    let s = run.distance_sq_by(simd, splat.source.splat, conic);
                    let tau = splat.source.of_kernel(simd, s, run, &self.rays);
                    self.composite::<S, FRONT, HALF, true, PLANES, CHANNELS>(simd, splat, run, tau);
                }
            }
            return is_composited;
        }
        for run in runs {
            if !is_in(done, run.block) {
                is_composited = true;
                let tau = splat.source.optical_depth(simd, run, &self.rays);
                self.composite::<S, FRONT, HALF, false, PLANES, CHANNELS>(simd, splat, run, tau);
            }
        }
        is_composited
    }

    #[inline(always)]
    fn composite<
        S: Simd,
        const FRONT: bool,
        const HALF: bool,
        const THIN: bool,
        const PLANES: usize,
        const CHANNELS: usize,
    >(
        &mut self,
        simd: S,
        splat: &Splat<'_>,
        run: Run<S>,
        tau: Lanes<S>,
    ) {
        let channels = if CHANNELS > 0 { CHANNELS } else { self.channels };
        let stride = 2 * PLANES + channels;
        let lines = &mut self.lines[run.block * stride..][..stride];
        let mut weight = [simd.lanes(0.0); PLANES];
        let mut nearer = weight[0];
        for p in 0..PLANES {
            let step = tau * simd.lanes(splat.extinction[p]);
            let plane = &mut lines[p].0[run.lane..];
            let before = Lanes::load(simd, plane);
            if p == PLANES / 2 {
                nearer = before;
            }
            let sum = rounded::<S, HALF>(before + step);
            sum.store(plane);
            let opacity = if THIN || splat.thin { step.opacity_of_small() } else { step.opacity() };
            let plane = &mut lines[PLANES + p].0[run.lane..];
            let before = Lanes::load(simd, plane);
            let after = if HALF { sum.exp_neg() } else { opacity.negate_mul_add(before, before) };
            after.store(plane);
            weight[p] = match (FRONT, HALF) {
                (false, _) => opacity,
                (true, false) => before * opacity,
                (true, true) => before - after,
            };
        }
        for c in 0..channels {
            let p = ChannelLayout::plane_of(c, channels, PLANES);
            let value = simd.lanes(splat.value[c]);
            let sum = &mut lines[2 * PLANES + c].0[run.lane..];
            let before = Lanes::load(simd, sum);
            let added = if FRONT { value } else { value - before };
            rounded::<S, HALF>(weight[p].mul_add(added, before)).store(sum);
        }
        if !self.depth.is_empty() || !self.object.is_empty() {
            self.extras::<S, FRONT, PLANES>(simd, splat, run, nearer);
        }
    }

    /// Depths and object ids, lane by lane; `nearer` is the optical depth before this splat.
    #[inline(always)]
    fn extras<S: Simd, const FRONT: bool, const PLANES: usize>(
        &mut self,
        simd: S,
        splat: &Splat<'_>,
        run: Run<S>,
        nearer: Lanes<S>,
    ) {
        let mut before = [0.0; MAX_LANES];
        let mut z = [0.0; MAX_LANES];
        nearer.store(&mut before);
        let source = &splat.source;
        source.view_depth(simd, run, &self.rays).store(&mut z);
        let line = run.block * (2 * PLANES + self.channels) + PLANES / 2;
        let thickness = source.thickness();
        let mut narrow = [1.0; MAX_LANES];
        if source.splat.kind == SplatKind::Medium && !source.splat.is_gaussian() && !self.depth.is_empty() {
            let s = run.distance_sq(simd, source.splat) * self.rays.factors(simd, run);
            let [constant, slope] = source.kernel.narrowing;
            let [constant, slope] = [simd.lanes(constant), simd.lanes(slope)];
            slope.mul_add(s, constant).store(&mut narrow);
        }
        for i in 0..Lanes::<S>::COUNT {
            let k = run.pixel() + i;
            let after = self.lines[line].0[run.lane + i];
            if after <= before[i] {
                continue;
            }
            if let Some(depth) = self.depth.get_mut(k) {
                depth.add(&DepthFragment { depth: z[i], thickness, narrow: narrow[i], before: before[i], after });
            }
            if let Some(object) = self.object.get_mut(k).filter(|o| !FRONT || **o == u32::MAX) {
                *object = splat.object;
            }
        }
    }
}

/// A running sum in the precision that was asked for.
#[inline(always)]
fn rounded<S: Simd, const HALF: bool>(sum: Lanes<S>) -> Lanes<S> {
    if HALF { sum.to_half() } else { sum }
}
