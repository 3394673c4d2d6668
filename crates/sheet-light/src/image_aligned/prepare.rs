//! From volumes and a view to sheets that can be folded.

use super::light::Lamp;
use super::panes::Panes;
use super::prepared::{Prepared, Sheeted};
use super::slant::Slant;
use super::view_slabs::{reach, slabs_of, stride};
use super::viewed::lacking;
use super::within::Within;
use crate::half_vector::lamps::Lamps;
use crate::half_vector::polygons::panes::PanesInTheOpen;
use crate::half_vector::polygons::surfaces::{EyePanes, Polygons};
use crate::image_aligned::tile::kept::Kept;
use crate::image_aligned::tile::preclassified::Preclassified;
use crate::image_aligned::tile::ring::Ring;
use crate::image_aligned::tile::sheets::Sheets;
use crate::image_aligned::tile::size::{AREA, TILE, tiles};
use crate::shared::error::cancelled;
use crate::shared::gathered::gradient::KernelGradients;
use crate::shared::gradient_volume::GradientVolume;
use crate::shared::input::{SheetInput, Splats};
use crate::shared::lattice::Lattice;
use crate::shared::params::{Aligned, Classify, GatherKernel, Lighting, Reconstruction};
use crate::shared::shadows::Shadows;
use crate::shared::slabs::Slabs;
use crate::shared::voxels::Voxels;
use crate::{Error, Params};
use splat_core::shade::ChannelLayout;
use splat_core::{Packing, Progress};

/// Finds the voxels that may be seen and lists them by tile.
///
/// # Errors
/// [`Error::Parameter`], [`Error::Volume`], [`Error::Limit`] before much is taken, or [`Error::Cancelled`].
pub fn prepare<'a>(input: SheetInput<'a>, params: &Params, progress: Option<&Progress>) -> Result<Sheeted<'a>, Error> {
    params.check_any_mode()?;
    input.check()?;
    let slant = Slant::new(&input, params)?;
    let slabs = slabs_of(&input, params, slant)?;
    let tiles = tiles(input.camera);
    let mut needed = memory(&input, params, &slabs, tiles);
    check(needed, params)?;
    let quiet = Progress::new();
    let progress = progress.unwrap_or(&quiet);
    progress.add_total(input.volumes.len() as u64);
    let mut volumes = Vec::with_capacity(input.volumes.len());
    for volume in &input.volumes {
        if params.reconstruction != Reconstruction::Splat && volume.packing != Packing::Cartesian {
            return Err(Error::parameter("reconstruction", "gathered of a body-centred lattice", "splatted"));
        }
        let mut prepared = Prepared::new(*volume, &input, params, &slabs, slant, tiles);
        let count = prepared.voxels.count();
        needed += Shadows::bytes(count, &input.lights);
        if params.lighting == Lighting::Joint {
            needed += Within::bytes(&prepared.receivers(), count, &input.lights);
        }
        needed += GradientVolume::bytes(count, volume, params);
        check(needed, params)?;
        if params.differentiates(volume) {
            prepared.kernel_gradients = Some(KernelGradients::new(&prepared.rays.rows()));
        }
        prepared.gradients = GradientVolume::new(&prepared.receivers(), &prepared.lattice, params);
        prepared.shadows = Shadows::new(&prepared.receivers(), &input.lights, input.shadow_origin);
        if params.lighting == Lighting::Joint {
            prepared.within = Within::new(volume, &prepared.receivers(), &input.lights, input.shadow_origin);
        }
        volumes.push(prepared);
        progress.tick(1).map_err(cancelled)?;
    }
    let bins = input.splats.as_ref().map(Splats::bin);
    let lamps = Lamp::list(&input, slabs.origin);
    Ok(Sheeted { input, params: *params, slabs, slant, volumes, lamps, bins, panes: None, tiles })
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
        let touched = crate::shared::sections::touched(reach(volume, input, params) / width);
        let lines = u64::from(Ring::lines_for(touched));
        let is_near = lacking(volume, input.camera, &slabs.wider(stride), reach(volume, input, params)).is_some();
        let sums = sums + u64::from(is_near);
        // Lists: four bytes for eight voxels, in two or three tiles each. Records: two of sixteen bytes a voxel of a tile.
        let voxels = dims.iter().map(|n| *n as u64).product::<u64>();
        if let Reconstruction::Gather(kernel) = params.reconstruction {
            // A filtered lattice is made of one that is filtered across alone.
            let copies = if kernel == GatherKernel::Gaussian { 8 } else { 0 };
            needed += Voxels::bytes(dims) + copies * voxels + threads * (Sheets::bytes() + Kept::bytes(stride));
            continue;
        }
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

impl<'a> Sheeted<'a> {
    /// With translucent polygons, lit as the volumes are; opaque ones are left out, for they belong to what hides things: `opaque` has view depths of
    /// that at each pixel, or nothing. One tick a band of rows.
    ///
    /// # Errors
    /// [`Error::Polygons`], [`Error::Parameter`] along a lattice, [`Error::Limit`] where lists of them take too much, or [`Error::Cancelled`].
    pub fn with_polygons(
        mut self,
        polygons: &[Polygons<'a>],
        opaque: &[f32],
        layout: &ChannelLayout,
        progress: Option<&Progress>,
    ) -> Result<Self, Error> {
        polygons.iter().enumerate().try_for_each(|(index, polygons)| polygons.check(index))?;
        let panes: Vec<Polygons<'a>> = polygons.iter().filter(|p| !p.is_opaque()).copied().collect();
        if panes.is_empty() {
            return Ok(self);
        }
        if self.params.aligned == Aligned::Axis {
            let expected = "slabs across the view, or one volume and nothing beside it";
            return Err(Error::parameter("aligned", "along a lattice beside polygons", expected));
        }
        let quiet = Progress::new();
        let input = &self.input;
        let most = self.params.limits.max_bytes.saturating_sub(self.bytes());
        let polygons_seen = EyePanes::new(panes, input.camera, opaque, most, layout, progress.unwrap_or(&quiet))?;
        let ambient = input.ambient;
        let camera = input.camera;
        let shadow_origin = input.shadow_origin;
        let lamps = Lamps { carried: None, mapped: &input.lights, ambient, camera, shadow_origin, light_alone: false };
        let mut shown = PanesInTheOpen::new(&polygons_seen, layout);
        shown.shade(None, &lamps);
        let values = shown.into_values();
        self.panes = Some(Panes {
            polygons: polygons_seen,
            camera,
            values,
            channels: layout.count(),
            origin: self.slabs.origin,
        });
        Ok(self)
    }
}
