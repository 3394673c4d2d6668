//! Volumes and a view, ready to be folded.

use super::light::Lamp;
use super::panes::Panes;
use super::segments::Segments;
use super::slant::Slant;
use super::view_slabs::stride;
use super::viewed::{PixelFootprint, Viewed, lacking};
use super::within::Within;
use crate::image_aligned::tile::ring::{Splatter, Taper};
use crate::shared::classifier::{Base, Classifier};
use crate::shared::gathered::gradient::KernelGradients;
use crate::shared::gathered::{Gathered, RIM};
use crate::shared::gradient_volume::GradientVolume;
use crate::shared::input::SheetInput;
use crate::shared::lattice::Lattice;
use crate::shared::lattice::neighbours::Receivers;
use crate::shared::lattice::rays::LatticeRays;
use crate::shared::params::{Classify, Reconstruction};
use crate::shared::preintegrated::Preintegrated;
use crate::shared::sections::SectionTable;
use crate::shared::shadows::Shadows;
use crate::shared::slabs::Slabs;
use crate::shared::value_range::ValueRange;
use crate::shared::voxels::{Voxels, without_extinction};
use crate::{Params, Volume};
use splat_core::Footprint;
use splat_core::raster::bins::Bins;
use splat_core::raster::kernel::Kernel;
use std::ops::Range;

/// One volume, ready for its sheets.
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
    /// Where all values that a ray meets in a slab are classified.
    pub(crate) preintegrated: Option<Preintegrated>,
    pub(crate) rays: LatticeRays,
    pub(crate) voxels: Voxels,
    pub(crate) shadows: Option<Shadows<'a>>,
    /// What its sheets read, where they read the lattice instead of being written by its voxels.
    pub(crate) gathered: Option<Gathered<'a>>,
    /// Of one whose spacing is optically thick.
    pub(crate) within: Option<Within<'a>>,
    /// Whether normals come from neighbouring sheets.
    pub(crate) compares: bool,
    /// Where normals come from that.
    pub(crate) gradients: Option<GradientVolume>,
    /// Where they come from the field that sheets read.
    pub(crate) kernel_gradients: Option<KernelGradients>,
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

impl<'a> Prepared<'a> {
    pub(crate) fn new(
        volume: Volume<'a>,
        input: &SheetInput<'_>,
        params: &Params,
        slabs: &Slabs,
        slant: Slant,
        tiles: [usize; 2],
    ) -> Self {
        let grid = volume.grid;
        let camera = input.camera;
        let stride = stride(&volume, input, params, slabs.width);
        let slabs = &slabs.wider(stride);
        let without_rim = Viewed::new(&volume, camera, slabs, params, slant);
        let transfer = &volume.seen();
        let base = Base::new(ValueRange::of_values(&grid.values), transfer);
        let compares = params.compares_sheets(&volume);
        let (lattice, viewed, voxels, segments, gathered, slabs_beside_eye);
        match params.reconstruction {
            Reconstruction::Splat => {
                slabs_beside_eye = lacking(&volume, camera, slabs, without_rim.reach);
                // Sheets beside the volume, too, tell how values go on at its faces.
                let further = compares || params.classify == Classify::Preintegrated;
                let reach = without_rim.lattice_reach(camera, slabs, further);
                lattice = Lattice::new(grid, volume.packing, reach);
                viewed = without_rim.with_rim(lattice.rim);
                let near = viewed.near(camera, slabs, &params.kernel, compares, slabs_beside_eye.is_some());
                voxels = Voxels::needed(&lattice, &without_extinction(transfer), &near);
                segments = Segments::new(&viewed, slabs, &voxels, lattice.dims, tiles);
                gathered = None;
            }
            Reconstruction::Gather(kernel) => {
                let apart = if params.classify == Classify::Preintegrated { 2.0 } else { 1.0 };
                let near = kernel.near(without_rim.steps_to_neighbours(camera, slabs, apart, compares));
                let found;
                (found, voxels) = Gathered::new(&volume, kernel, transfer, base, &near);
                lattice = Lattice::new(grid, volume.packing, RIM);
                viewed = without_rim.with_rim(lattice.rim);
                segments = Segments::default();
                gathered = Some(found);
                // The lattice goes on behind the eye.
                slabs_beside_eye = None;
            }
        }
        let cutoff = params.kernel.extent / params.kernel.sigma;
        let footprint = Footprint { cutoff: cutoff as f32 };
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
            preintegrated: (params.classify == Classify::Preintegrated)
                .then(|| Preintegrated::new(transfer, volume.extinction_scale, base)),
            rays: LatticeRays::new(&volume, camera, slabs.origin),
            footprint: camera.is_orthographic().then(|| viewed.footprint(camera.focal_px())),
            viewed,
            voxels,
            shadows: None,
            gathered,
            within: None,
            compares,
            gradients: None,
            kernel_gradients: None,
            lacking: slabs_beside_eye,
            segments,
            base,
        }
    }

    /// Whether values beside a slab are told from its neighbours alone, because further sheets may lack kernels, which lie behind the eye.
    #[inline(always)]
    pub(crate) fn is_lacking(&self, slab: u32) -> bool {
        self.lacking.as_ref().is_some_and(|lacking| slab < lacking.end + 2)
    }

    /// Slabs to each side of one that values in it are told from.
    #[inline(always)]
    pub(crate) fn beside(&self) -> u32 {
        if self.preintegrated.is_some() { 2 } else { 1 }
    }

    pub(crate) fn receivers(&self) -> Receivers<'_> {
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
