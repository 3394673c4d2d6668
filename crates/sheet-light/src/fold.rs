//! From volumes and a view to sheets, and their fold over a range of depths.

use crate::aligned::{Slant, plane_step};
use crate::classify::{Base, Classifier};
use crate::counts::SheetCounts;
use crate::error::cancelled;
use crate::gradient_volume::GradientVolume;
use crate::kept::Kept;
use crate::lattice::Lattice;
use crate::light::Lamp;
use crate::near_eye;
use crate::neighbours::Receivers;
use crate::panes::Panes;
use crate::params::{Aligned, Classify, Lighting};
use crate::preclassified::Preclassified;
use crate::rays::LatticeRays;
use crate::ring::{Ring, Splatter, Taper};
use crate::sections::SectionTable;
use crate::segments::Segments;
use crate::shadows::Shadows;
use crate::sheets::Sheets;
use crate::slabs::{Kernels, Slabs};
use crate::tile::{self, AREA, FoldTile, Scratch, TILE};
use crate::viewed::{PixelFootprint, Viewed, corners, spacing_along, view_steps};
use crate::visible::Voxels;
use crate::within::Within;
use crate::{Error, Params, SheetInput, Splats, Volume};
use rayon::prelude::*;
use splat_core::raster::bins::Bins;
use splat_core::raster::kernel::Kernel;
use splat_core::raster::pulp;
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Footprint, Progress};
use std::ops::Range;

/// One volume, ready to be splatted.
pub(crate) struct Prepared<'a> {
    pub(crate) volume: Volume<'a>,
    /// Its own slabs.
    pub(crate) slabs: Slabs,
    /// How many of all volumes' slabs one of them is wide.
    pub(crate) stride: u32,
    pub(crate) lattice: Lattice<'a>,
    pub(crate) viewed: Viewed,
    pub(crate) sections: SectionTable,
    kernel: Kernel,
    taper: Taper,
    /// Whether sums are rounded to half precision.
    half: bool,
    pub(crate) classify: Classify,
    pub(crate) classifier: Classifier,
    pub(crate) rays: LatticeRays,
    pub(crate) voxels: Voxels,
    pub(crate) shadows: Option<Shadows>,
    /// Of one whose spacing is optically thick.
    pub(crate) within: Option<Within>,
    /// Where normals come from that.
    pub(crate) gradients: Option<GradientVolume>,
    /// Its slabs that lack kernels, because these lie behind the eye.
    pub(crate) lacking: Option<Range<u32>>,
    pub(crate) segments: Segments,
    /// What values are taken relative to.
    pub(crate) base: Base,
    /// The footprint of all voxels, where rays are parallel.
    footprint: Option<PixelFootprint>,
}

/// The sheets of some volumes in one view, ready to be folded.
pub struct Sheeted<'a> {
    pub(crate) input: SheetInput<'a>,
    pub(crate) params: Params,
    pub(crate) slabs: Slabs,
    pub(crate) slant: Slant,
    pub(crate) volumes: Vec<Prepared<'a>>,
    pub(crate) lamps: Vec<Lamp<'a>>,
    /// Lists of splats by square of the image.
    pub(crate) bins: Option<Bins>,
    /// Translucent polygons.
    pub(crate) panes: Option<Panes<'a>>,
    pub(crate) tiles: [usize; 2],
}

/// Finds the voxels that may be seen and lists them by tile.
///
/// # Errors
/// [`Error::Parameter`], [`Error::Volume`], [`Error::Limit`] before much is taken, or [`Error::Cancelled`].
pub fn prepare<'a>(input: SheetInput<'a>, params: &Params, progress: Option<&Progress>) -> Result<Sheeted<'a>, Error> {
    params.check_any_mode()?;
    input.check()?;
    let slant = Slant::new(&input, params)?;
    let slabs = slabs_of(&input, params, slant)?;
    let tiles = tile::tiles(input.camera);
    let mut needed = memory(&input, params, &slabs, tiles);
    check(needed, params)?;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    progress.add_total(input.volumes.len() as u64);
    let mut volumes = Vec::with_capacity(input.volumes.len());
    for volume in &input.volumes {
        let mut prepared = Prepared::new(*volume, &input, params, (&slabs, slant), tiles);
        let count = prepared.voxels.count();
        needed += Shadows::bytes(count, &input.lights);
        if params.lighting == Lighting::Joint {
            needed += Within::bytes(&prepared.receivers(), count, &input.lights);
        }
        needed += GradientVolume::bytes(count, volume, params);
        check(needed, params)?;
        prepared.gradients = GradientVolume::new(&prepared.receivers(), &prepared.lattice, params);
        prepared.shadows = Shadows::new(&prepared.receivers(), &input.lights, input.shadow_origin, progress)?;
        if params.lighting == Lighting::Joint {
            prepared.within = Within::new(&prepared.receivers(), &input.lights, input.shadow_origin, progress)?;
        }
        volumes.push(prepared);
        progress.tick(1).map_err(cancelled)?;
    }
    let bins = input.splats.as_ref().map(Splats::bin);
    let lamps = Lamp::all(&input, slabs.origin);
    Ok(Sheeted { input, params: *params, slabs, slant, volumes, lamps, bins, panes: None, tiles })
}

/// Slabs between the nearest corner of a volume, or the nearest splat, before the eye and the farthest, as narrow as the finest
/// volume needs them.
pub(crate) fn slabs_of(input: &SheetInput<'_>, params: &Params, slant: Slant) -> Result<Slabs, Error> {
    let mut near = f64::INFINITY;
    let mut far = 0.0f64;
    let mut spacing = f64::INFINITY;
    for volume in &input.volumes {
        spacing = spacing.min(spacing_of(volume, input, params));
        for corner in corners(volume, input.camera) {
            // Slabs along a lattice may lie behind the eye in some pixels alone.
            let z = if slant.is_any() { slant.sheared(corner).z } else { corner.z.max(0.0) };
            (near, far) = (near.min(z), far.max(z));
        }
    }
    if let Some(splats) = &input.splats {
        let [nearest, farthest] = splats.reach();
        (near, far) = (near.min(nearest.max(0.0)), far.max(farthest));
        if spacing == f64::INFINITY {
            spacing = splats.slab_width;
        }
    }
    if !near.is_finite() {
        return Slabs::new(0.0, 0.0, 1.0, 1.0);
    }
    let width = params.slab_width.unwrap_or(spacing);
    let kernels = |v: &Volume<'_>| Kernels { reach: reach(v, input, params), stride: stride(v, input, params, width) };
    let slabs = Slabs::for_kernels(near, far, width, &input.volumes.iter().map(kernels).collect::<Vec<_>>())?;
    params.check_slabs(slabs.count)?;
    Ok(slabs)
}

/// Steps of a volume along the view.
fn spacing_of(volume: &Volume<'_>, input: &SheetInput<'_>, params: &Params) -> f64 {
    match params.aligned {
        Aligned::View => spacing_along(&view_steps(volume, input.camera)),
        Aligned::Axis => plane_step(volume, input.camera),
    }
}

/// Radius of a volume's kernels along the view.
fn reach(volume: &Volume<'_>, input: &SheetInput<'_>, params: &Params) -> f64 {
    let extent = if params.aligned == Aligned::View { params.kernel.extent } else { 0.5 };
    spacing_of(volume, input, params) * extent
}

/// How many slabs of this width one of the volume's own has: as many as its spacing along the view has, where that chooses the width.
pub(crate) fn stride(volume: &Volume<'_>, input: &SheetInput<'_>, params: &Params, width: f64) -> u32 {
    /// Steps that are equal but for rounding are.
    const EQUAL: f64 = 1.0 + 1e-6;
    /// Most slabs in one.
    const MOST: f64 = 65536.0;
    let slabs = spacing_of(volume, input, params) / width * EQUAL;
    if params.slab_width.is_some() { 1 } else { slabs.clamp(1.0, MOST) as u32 }
}

/// Bytes of lists, records and sheets, counted before any is taken.
fn memory(input: &SheetInput<'_>, params: &Params, slabs: &Slabs, tiles: [usize; 2]) -> u64 {
    let threads = rayon::current_num_threads() as u64;
    let mut needed = threads * 4 * 4 * (TILE * TILE) as u64;
    let sums = if params.classify == Classify::Before { 1 + Preclassified::times() } else { 1 };
    for volume in &input.volumes {
        let dims = Lattice::new(volume.grid, volume.packing, [usize::MAX; 3]).dims;
        let stride = stride(volume, input, params, slabs.width);
        let width = slabs.width * f64::from(stride);
        let touched = crate::sections::touched(reach(volume, input, params) / width);
        let lines = u64::from(Ring::lines_for(touched));
        let is_near =
            near_eye::lacking(volume, input.camera, &slabs.wider(stride), reach(volume, input, params)).is_some();
        let sums = sums + u64::from(is_near);
        // Lists: four bytes for eight voxels, in two or three tiles each. Records: two of sixteen bytes a voxel of a tile.
        let voxels = dims.iter().map(|n| *n as u64).product::<u64>();
        let of_a_tile = voxels.div_ceil((tiles[0] * tiles[1]) as u64) * 4;
        needed += Voxels::bytes(dims)
            + 2 * voxels
            + threads * (sums * (lines * 64 * AREA as u64 + Sheets::bytes()) + 32 * of_a_tile);
        needed += threads * Kept::bytes(stride);
    }
    needed
}

fn check(needed: u64, params: &Params) -> Result<(), Error> {
    let limit = params.limits.max_bytes;
    let hint = || "use fewer voxels or a smaller picture".to_owned();
    if needed > limit { Err(Error::limit("sheets", needed, limit, "bytes", hint())) } else { Ok(()) }
}

impl<'a> Prepared<'a> {
    fn new(
        volume: Volume<'a>,
        input: &SheetInput<'_>,
        params: &Params,
        (slabs, slant): (&Slabs, Slant),
        tiles: [usize; 2],
    ) -> Self {
        let grid = volume.grid;
        let camera = input.camera;
        let stride = stride(&volume, input, params, slabs.width);
        let slabs = &slabs.wider(stride);
        let viewed = Viewed::new(&volume, camera, slabs, params, slant);
        let lacking = near_eye::lacking(&volume, camera, slabs, viewed.reach);
        let reach = viewed.lattice_reach(camera, slabs, params.compares_sheets(&volume));
        let lattice = Lattice::new(grid, volume.packing, reach);
        let viewed = viewed.with_rim(lattice.rim);
        let transfer = &volume.seen();
        let near = viewed.near(camera, slabs, &params.kernel, [params.compares_sheets(&volume), lacking.is_some()]);
        let voxels = Voxels::needed(&lattice, transfer, &near);
        let segments = Segments::new(&viewed, slabs, &voxels, lattice.dims, tiles);
        let cutoff = params.kernel.extent / params.kernel.sigma;
        let footprint = Footprint { cutoff: cutoff as f32 };
        let base = Base::new(extremes(&grid.values).into(), transfer);
        Self {
            volume,
            slabs: *slabs,
            stride,
            lattice,
            sections: SectionTable::new(viewed.reach / slabs.width, &footprint),
            taper: Taper::new(0.5 * cutoff * cutoff),
            kernel: Kernel::new(&footprint),
            half: params.is_half(),
            classify: params.classify,
            classifier: Classifier::new(transfer, volume.extinction_scale, base),
            rays: LatticeRays::new(&volume, camera, slabs.origin),
            footprint: camera.is_orthographic().then(|| viewed.footprint(camera.focal_px())),
            viewed,
            voxels,
            shadows: None,
            within: None,
            gradients: None,
            lacking,
            segments,
            base,
        }
    }

    fn receivers(&self) -> Receivers<'_> {
        Receivers {
            volume: &self.volume,
            voxels: &self.voxels,
            rim: self.lattice.rim,
            radius: self.viewed.reach as f32,
            rows: self.rays.rows(),
        }
    }

    pub(crate) fn splatter(&self) -> Splatter<'_> {
        Splatter {
            viewed: &self.viewed,
            kernel: &self.kernel,
            taper: self.taper,
            sections: &self.sections,
            half: self.half,
            footprint: self.footprint,
        }
    }

    /// Half the bounds of a footprint at `scale`, pixels.
    #[inline(always)]
    pub(crate) fn half(&self, scale: f64) -> [f32; 2] {
        self.footprint.unwrap_or_else(|| self.viewed.footprint(scale)).half
    }
}

/// Least and greatest value.
pub(crate) fn extremes(values: &[f32]) -> (f32, f32) {
    let none = (f32::INFINITY, f32::NEG_INFINITY);
    let join = |a: (f32, f32), b: (f32, f32)| (a.0.min(b.0), a.1.max(b.1));
    let of = |chunk: &[f32]| {
        // Side by side, so that vectors are compared.
        let mut least = [none.0; 16];
        let mut greatest = [none.1; 16];
        for values in chunk.chunks(16) {
            for ((least, greatest), v) in least.iter_mut().zip(&mut greatest).zip(values) {
                *least = if *v < *least { *v } else { *least };
                *greatest = if *v > *greatest { *v } else { *greatest };
            }
        }
        least.into_iter().zip(greatest).fold(none, join)
    };
    values.par_chunks(1 << 16).map(of).reduce(|| none, join)
}

impl Sheeted<'_> {
    /// Slabs, and their width in world units.
    pub fn slabs(&self) -> (u32, f64) {
        (self.slabs.count, self.slabs.width)
    }

    /// Bytes of what was prepared.
    pub fn bytes(&self) -> u64 {
        let volumes: u64 = self.volumes.iter().map(|v| v.segments.bytes() + v.voxels.held()).sum();
        volumes + self.bins.as_ref().map_or(0, Bins::bytes) + self.panes.as_ref().map_or(0, Panes::bytes)
    }

    /// Folds what lies at view depths in `range`, front to back, behind all that `into` holds. Ranges that meet share nothing and
    /// lose nothing, wherever in a slab they do. `opaque` has the view depth of what hides the volumes at each pixel, +∞ for
    /// nothing; or it is empty. One tick a tile.
    ///
    /// # Errors
    /// [`Error::Cancelled`]: the accumulator is of no use as a picture.
    ///
    /// # Panics
    /// If the sizes of the camera's image, `into` and `opaque` disagree, or `into` has other channels than `layout`.
    pub fn fold(
        &self,
        range: Range<f32>,
        opaque: &[f32],
        layout: &ChannelLayout,
        into: &mut Accumulator,
        progress: Option<&Progress>,
    ) -> Result<SheetCounts, Error> {
        assert_eq!(self.input.camera.size, into.size, "invariant: one image size");
        assert_eq!(layout.count(), into.channels.len(), "invariant: one set of channels");
        let pixels = into.size[0] as usize * into.size[1] as usize;
        assert!(opaque.is_empty() || opaque.len() == pixels, "invariant: an opaque depth for each pixel");
        let quiet = Progress::new();
        let progress = progress.unwrap_or(&quiet);
        let range = f64::from(range.start).max(f64::MIN)..f64::from(range.end).min(f64::MAX);
        let tiles = self.tiles[0] * self.tiles[1];
        progress.add_total(tiles as u64);
        let held: &Accumulator = into;
        let fold = |scratch: &mut Scratch, t: usize| {
            progress.tick(1).ok()?;
            let work = FoldTile { of: self, layout, into: held, range: range.clone(), opaque, t, scratch };
            Some(pulp::Arch::new().dispatch(work))
        };
        let done: Vec<_> = (0..tiles).into_par_iter().map_init(|| Scratch::new(&self.volumes), fold).collect();
        progress.tick(0).map_err(cancelled)?;
        let mut counts = self.counts();
        for (picture, of_tile) in done.into_iter().flatten() {
            counts = counts.add(of_tile);
            if let Some(picture) = picture {
                picture.store(into);
            }
        }
        Ok(counts)
    }

    /// What is known before anything is folded.
    fn counts(&self) -> SheetCounts {
        SheetCounts {
            voxels: self.volumes.iter().map(|v| v.volume.grid.values.len() as u64).sum(),
            visible: self.volumes.iter().map(|v| v.voxels.count()).sum(),
            slabs: u64::from(self.slabs.count),
            bytes: self.bytes(),
            ..SheetCounts::default()
        }
    }
}
