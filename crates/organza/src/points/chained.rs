//! The translucent splats of a picture wholly on a device, where it composites and there is nothing that only the processor
//! does.

use super::{Drawing, record};
use crate::Error;
use crate::device::Translucent;
use crate::plan::pass;
use splat_core::raster::Accumulation;
use splat_core::shade::{ChannelLayout, LitBy, gpu::suits};
use splat_core::{Accumulator, Camera, CostRecord, Layers, SplatKind};
use tsm::ShadowMap;

impl Drawing<'_> {
    /// The picture, or `None` for the passes one by one.
    pub(super) fn chained(
        &self,
        maps: &[Option<ShadowMap>],
        camera: &Camera,
        cost: &mut CostRecord,
    ) -> Result<Option<Layers>, Error> {
        let Some(helper) = self.helper.filter(|_| self.device_composites && self.by_device()) else { return Ok(None) };
        let ids = self.ids(|kind| kind != SplatKind::Opaque);
        if ids.is_empty() {
            return Ok(None);
        }
        let lights: Vec<LitBy<'_>> = self.shining(maps).map(|(light, shadow)| LitBy { light, shadow }).collect();
        if let Err(why) = suits(&self.shading(&lights, camera)) {
            helper.leave(why);
            return Ok(None);
        }
        self.tick()?;
        let looked_up = self.look_ups(maps, ids.iter().copied());
        let lights = self.lit_by(maps, &looked_up);
        let input = self.shading(&lights, camera);
        let mut solid = CostRecord::default();
        let opaque = self.solid(maps, camera, &mut solid)?;
        self.tick()?;
        let layout = ChannelLayout::new(&self.layers);
        let mut accumulator =
            Accumulator::new(camera.size, self.plan.optical_depth_planes, layout.count(), false, false);
        let (sort, raster) = (self.sort_params(), self.raster_params());
        let splats = Translucent {
            input: &input,
            ids: &ids,
            footprints: &self.loaded.footprints,
            layout,
            sort: &sort,
            raster: &raster,
            opaque: &opaque,
            progress: self.progress,
        };
        let mut stages = CostRecord::default();
        let done = stages.measure(pass::SPLAT, |stage| {
            let Some(counts) = helper.chain(&splats, &mut accumulator)? else { return Ok::<_, Error>(false) };
            record(stage, &counts.raster);
            stage.items_in = ids.len() as u64;
            Ok(true)
        })?;
        if !done {
            return Ok(None);
        }
        cost.stages.extend(solid.stages);
        cost.stages.extend(stages.stages);
        self.tick()?;
        self.finish(&accumulator, &opaque, cost).map(Some)
    }

    /// Whether there is nothing about the picture that only the processor does; what there is it says where it does it.
    fn by_device(&self) -> bool {
        let points = &self.settings.points;
        points.exact
            && points.first_slices.is_none()
            && !self.layers.depth
            && !self.layers.object
            && points.accumulation == Accumulation::F32
    }
}
