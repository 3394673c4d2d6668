//! Splats of a frame on a device, from their attributes to the picture, where it composites.

use super::Frame;
use super::splats::record;
use crate::Error;
use crate::device::{self, Helper, Splats};
use crate::pass;
use splat_core::raster::{self, Accumulation, OpaqueImage};
use splat_core::shade::MAX_SHADED_CHANNELS;
use splat_core::shade::{LitBy, gpu::suits};
use splat_core::{Accumulator, CostRecord, Direction, StageCost};
use tsm::ShadowMap;
use tsm::gpu::Casting;

/// Splats that are composited by one recording.
#[derive(Clone, Copy)]
pub(crate) struct Chained<'a> {
    pub(crate) lights: &'a [LitBy<'a>],
    /// The shadow maps that the device makes, if it makes them.
    pub(crate) castings: &'a [Casting],
    /// Translucent splats.
    pub(crate) ids: &'a [u32],
    /// Opaque ones.
    pub(crate) solid: &'a [u32],
    pub(crate) sort: &'a hbsort::Params,
}

impl Frame<'_> {
    /// The opaque splats by a device, or `None` for the processor.
    pub(super) fn solid_by_device(&self, ids: &[u32], cost: &mut CostRecord) -> Result<Option<OpaqueImage>, Error> {
        let maps = self.maps(cost)?;
        let Some(helper) = self.helper.filter(|_| self.device_composites) else { return Ok(None) };
        if self.layout().count() > MAX_SHADED_CHANNELS {
            helper.leave("its kernels have no channel of light that is scattered more than once");
            return Ok(None);
        }
        if !self.suits(helper, maps) {
            return Ok(None);
        }
        let lights = self.lit_by(maps);
        let mut nothing = Accumulator::new(self.camera.size, 1, self.layout().count(), false, self.layers.object);
        let mut stages = CostRecord::default();
        let params = hbsort::Params { exact: true, ..hbsort::Params::default() };
        let image = stages.measure(pass::OPAQUE, |stage| {
            let chained = Chained { lights: &lights, castings: &[], ids: &[], solid: ids, sort: &params };
            self.chain(helper, &chained, &mut nothing, stage)
        })?;
        if image.is_some() {
            cost.stages.extend(stages.stages);
        }
        Ok(image)
    }

    /// Whether a device shades splats in this light; if not it says why.
    pub(crate) fn suits(&self, helper: &Helper<'_>, maps: &[Option<ShadowMap>]) -> bool {
        suits(&self.shading(&self.lit_by(maps))).map_err(|why| helper.leave(why)).is_ok()
    }

    /// Translucent splats and opaque ones by the device, lit by lights whose shadows it is given, or makes of castings. Gives the opaque ones.
    pub(crate) fn chain(
        &self,
        helper: &Helper<'_>,
        chained: &Chained<'_>,
        accumulator: &mut Accumulator,
        stage: &mut StageCost,
    ) -> Result<Option<OpaqueImage>, Error> {
        let Chained { lights, castings, ids, solid, sort } = *chained;
        let input = self.shading(lights);
        // What asks for half precision is composited elsewhere.
        let raster = raster::Params { accumulation: Accumulation::F32, ..self.raster_params() };
        let mut sort = *sort;
        if self.layers.depth {
            // Depths are made front to back. The picture is the same.
            sort.direction = Direction::FrontToBack;
        }
        let splats = Splats {
            input: &input,
            ids,
            solid,
            footprints: &self.loaded.footprints,
            layout: self.layout(),
            sort: &sort,
            raster: &raster,
            opaque: &OpaqueImage::default(),
            castings,
            progress: self.progress,
        };
        let Some(done) = device::chain(helper, &splats, accumulator).map_err(|_| Error::Cancelled)? else {
            return Ok(None);
        };
        record(stage, &done.raster);
        stage.items_in = (ids.len() + solid.len()) as u64;
        Ok(Some(done.opaque.unwrap_or_default()))
    }
}
