//! The fold of prepared sheets over a range of depths.

use super::counts::SheetCounts;
use super::panes::Panes;
use super::prepared::Sheeted;
use crate::Error;
use crate::image_aligned::tile::fold_tile::{FoldTile, Scratch};
use crate::shared::error::cancelled;
use crate::shared::gathered::Gathered;
use rayon::prelude::*;
use splat_core::raster::bins::Bins;
use splat_core::raster::pulp;
use splat_core::shade::ChannelLayout;
use splat_core::{Accumulator, Progress};
use std::ops::Range;

impl Sheeted<'_> {
    /// Slabs, and their width in world units.
    pub fn slabs(&self) -> (u32, f64) {
        (self.slabs.count, self.slabs.width)
    }

    /// Bytes of what was prepared.
    pub fn bytes(&self) -> u64 {
        let volumes: u64 = self
            .volumes
            .iter()
            .map(|v| v.segments.bytes() + v.voxels.held() + v.gathered.as_ref().map_or(0, Gathered::bytes))
            .sum();
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
        self.fold_by(pulp::Arch::new(), range, opaque, layout, into, progress)
    }

    /// The same by an instruction set.
    fn fold_by(
        &self,
        instructions: pulp::Arch,
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
            let work = FoldTile { sheeted: self, layout, into: held, range: range.clone(), opaque, t, scratch };
            Some(instructions.dispatch(work))
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::shared::params::{GatherKernel, Reconstruction};
    use crate::{Params, SheetInput, Volume, prepare};
    use splat_core::glam::{DMat3, DVec3};
    use splat_core::shade::LitBy;
    use splat_core::{
        Camera, Grid, LayerSet, Light, LightShape, Material, Packing, Projection, Shading, Similarity,
        TransferFunction, TransferPoint, rng,
    };

    #[test]
    fn gathered_sheets_have_the_same_bits_by_every_instruction_set() {
        let dims = [30, 27, 25];
        let values = (0..dims.iter().product()).map(|i: usize| rng::unit_f32(3, 0, i as u64, 0)).collect();
        let axes = DMat3::from_diagonal(DVec3::new(0.2, 0.25, 0.22));
        let grid = Grid { origin: DVec3::splat(-3.0), axes, dims, values };
        let point = |value, extinction| TransferPoint { value, color: [0.2, value, 1.0 - value], extinction };
        let points = vec![point(0.3, 0.0), point(0.5, 0.4), point(0.9, 3.0)];
        let transfer = TransferFunction::new(points).unwrap();
        let view = Projection::Perspective { fov_y: 0.6 };
        let camera = Camera::look_at(DVec3::new(3.0, 5.0, 9.0), DVec3::ZERO, DVec3::Y, view, [70, 60]).unwrap();
        let light =
            Light { shape: LightShape::Directional { direction: DVec3::new(0.6, -0.8, 0.0) }, intensity: [3.0; 3] };
        let layout = ChannelLayout::new(&LayerSet::default());
        for shading in [Shading::Unlit, Shading::Phong] {
            for kernel in [GatherKernel::Linear, GatherKernel::Gaussian] {
                let material = Material { shading, ..Material::default() };
                let volume = Volume {
                    grid: &grid,
                    packing: Packing::Cartesian,
                    transform: Similarity::default(),
                    transfer: &transfer,
                    extinction_scale: 1.0,
                    material: &material,
                    normals: shading == Shading::Phong,
                    object: 0,
                    clip: &[],
                    shadow_coefficient: 1.0,
                    casts_shadow: true,
                };
                let input = SheetInput {
                    volumes: vec![volume],
                    splats: None,
                    camera: &camera,
                    lights: vec![LitBy { slide: None, light, shadow: None }],
                    shadow_origin: DVec3::ZERO,
                    ambient: [0.1; 3],
                };
                let params = Params {
                    reconstruction: Reconstruction::Gather(kernel),
                    transmittance_cutoff: Params::PAPERS_CUTOFF,
                    ..Params::default()
                };
                let sheeted = prepare(input, &params, None).unwrap();
                let draw = |instructions| {
                    let mut out = Accumulator::new(camera.size, 1, 3, false, false);
                    let everywhere = f32::NEG_INFINITY..f32::INFINITY;
                    sheeted.fold_by(instructions, everywhere, &[], &layout, &mut out, None).unwrap();
                    out.channels.iter().flatten().map(|value| value.to_bits()).collect::<Vec<_>>()
                };
                let [scalar, widest] = [pulp::Arch::Scalar, pulp::Arch::new()].map(draw);
                assert!(scalar.iter().filter(|bits| **bits != 0).count() > 3000);
                assert!(scalar == widest, "{shading:?}, {kernel:?}");
            }
        }
    }
}
