//! The translucent splats of a picture wholly on a device, where it composites and there is nothing that only the processor
//! does. Where no opaque splat asks for light, shadow maps are made there and stay there.

use super::{Drawing, record, shadow_error};
use crate::Error;
use crate::device::{Helper, Translucent};
use crate::plan::pass;
use splat_core::raster::{Accumulation, OpaqueImage};
use splat_core::shade::{ChannelLayout, LitBy, gpu::suits};
use splat_core::{Accumulator, Camera, CostRecord, Layers, Receiver, SplatKind, Transmittance};
use tsm::ShadowMap;
use tsm::gpu::Casting;

/// Stands for a map that lies on the device alone: its light is looked up there.
struct OnDevice;

impl Transmittance for OnDevice {
    fn transmittance(&self, _: &Receiver) -> [f32; 3] {
        [1.0; 3]
    }
}

impl Drawing<'_> {
    /// The picture, its shadow maps on the device too, or `None` for maps first.
    pub(super) fn staying(&self, camera: &Camera, cost: &mut CostRecord) -> Result<Option<Layers>, Error> {
        let Some(helper) = self.chaining() else { return Ok(None) };
        let has_opaque = self.loaded.cloud.kind.contains(&SplatKind::Opaque);
        if has_opaque || self.loaded.cloud.is_empty() || !self.plan.shadow_maps.contains(&true) {
            return Ok(None);
        }
        let on_device = self.plan.shadow_maps.iter().map(|wanted| wanted.then_some(&OnDevice as &dyn Transmittance));
        let lights: Vec<LitBy<'_>> =
            self.with_light(on_device).map(|(light, shadow)| LitBy { light, shadow }).collect();
        // The passes one by one say why, if it does not suit.
        if suits(&self.shading(&lights, camera)).is_err() {
            return Ok(None);
        }
        if !helper.keeps_shadows() {
            return Ok(None);
        }
        let mut stages = CostRecord::default();
        let Some(castings) = self.castings(helper, &mut stages)? else { return Ok(None) };
        let ids = self.ids(|kind| kind != SplatKind::Opaque);
        let layers = self.chain(helper, (&lights, &castings), &ids, &OpaqueImage::default(), camera, &mut stages)?;
        if layers.is_some() {
            cost.stages.extend(stages.stages);
        }
        Ok(layers)
    }

    /// What throws the shadow of each light that has one, or `None` where a device does not make it.
    fn castings(&self, helper: &Helper, cost: &mut CostRecord) -> Result<Option<Vec<Casting>>, Error> {
        let (params, l) = (self.shadow_params(), self.loaded);
        let mut castings = Vec::new();
        for (i, (light, wanted)) in l.lights.iter().zip(&self.plan.shadow_maps).enumerate() {
            if !wanted || light.intensity == [0.0; 3] {
                continue;
            }
            self.tick()?;
            let made = cost.measure(pass::SHADOW_MAP, |stage| {
                stage.items_in = l.cloud.len() as u64;
                let casting = Casting::new(&l.cloud, &l.materials, &l.objects, light, &params, self.progress);
                stage.items_out = casting.as_ref().map_or(0, |casting| casting.casters() + casting.given());
                casting
            });
            match made {
                Ok(casting) => castings.push(casting),
                Err(tsm::Error::Processor { why }) => {
                    helper.leave(why);
                    return Ok(None);
                }
                Err(e) => return Err(shadow_error(i, &e)),
            }
        }
        Ok(Some(castings))
    }

    /// The picture, or `None` for the passes one by one.
    pub(super) fn chained(
        &self,
        maps: &[Option<ShadowMap>],
        camera: &Camera,
        cost: &mut CostRecord,
    ) -> Result<Option<Layers>, Error> {
        let Some(helper) = self.chaining() else { return Ok(None) };
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
        let mut stages = CostRecord::default();
        let opaque = self.solid(maps, camera, &mut stages)?;
        self.tick()?;
        let layers = self.chain(helper, (&lights, &[]), &ids, &opaque, camera, &mut stages)?;
        if layers.is_some() {
            cost.stages.extend(stages.stages);
        }
        Ok(layers)
    }

    /// The device, where it draws translucent splats from their attributes to the picture.
    fn chaining(&self) -> Option<&Helper> {
        self.helper.filter(|_| self.device_composites && self.by_device())
    }

    /// These splats by the device, lit by lights whose shadows it is given, or makes of castings.
    fn chain(
        &self,
        helper: &Helper,
        (lights, castings): (&[LitBy<'_>], &[Casting]),
        ids: &[u32],
        opaque: &OpaqueImage,
        camera: &Camera,
        cost: &mut CostRecord,
    ) -> Result<Option<Layers>, Error> {
        let input = self.shading(lights, camera);
        let layout = ChannelLayout::new(&self.layers);
        let mut accumulator =
            Accumulator::new(camera.size, self.plan.optical_depth_planes, layout.count(), false, false);
        let (sort, raster) = (self.sort_params(), self.raster_params());
        let splats = Translucent {
            input: &input,
            ids,
            footprints: &self.loaded.footprints,
            layout,
            sort: &sort,
            raster: &raster,
            opaque,
            castings,
            progress: self.progress,
        };
        let done = cost.measure(pass::SPLAT, |stage| {
            let Some(counts) = helper.chain(&splats, &mut accumulator)? else { return Ok::<_, Error>(false) };
            record(stage, &counts.raster);
            stage.items_in = ids.len() as u64;
            Ok(true)
        })?;
        if !done {
            return Ok(None);
        }
        self.tick()?;
        self.finish(&accumulator, opaque, cost).map(Some)
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
