//! The splats of a picture wholly on a device, where it composites and there is nothing that only the processor does. Where the
//! device can, shadow maps are made there and stay there.

use super::{Drawing, record, shadow_error};
use crate::Error;
use crate::device::{Helper, Splats};
use crate::plan::pass;
use splat_core::raster::{self, Accumulation, OpaqueImage};
use splat_core::shade::{ChannelLayout, LitBy, gpu::suits};
use splat_core::{Accumulator, Camera, CostRecord, Direction, Layers, Receiver, SplatKind, StageCost, Transmittance};
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
        if self.loaded.cloud.is_empty() || !self.plan.shadow_maps.contains(&true) {
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
        self.all_of(helper, (&lights, &castings), camera, stages, cost)
    }

    /// What throws the shadow of each light that has one, or `None` where a device does not make it.
    fn castings(&self, helper: &Helper, cost: &mut CostRecord) -> Result<Option<Vec<Casting>>, Error> {
        let l = self.loaded;
        let mut castings = Vec::new();
        for (i, (light, table)) in l.lights.iter().zip(&self.plan.shadow_tables).enumerate() {
            let Some(table) = table.filter(|_| light.intensity != [0.0; 3]) else { continue };
            let params = table.params(self.settings, l, self.plan.shadow_bytes);
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
        if self.loaded.cloud.is_empty() || !self.suits(helper, maps, camera) {
            return Ok(None);
        }
        self.tick()?;
        let looked_up = self.look_ups(maps, 0..self.loaded.cloud.len() as u32);
        let lights = self.lit_by(maps, &looked_up);
        self.all_of(helper, (&lights, &[]), camera, CostRecord::default(), cost)
    }

    /// The opaque splats `ids`, or `None` for the passes one by one.
    pub(super) fn solid_by_device(
        &self,
        maps: &[Option<ShadowMap>],
        ids: &[u32],
        camera: &Camera,
        cost: &mut CostRecord,
    ) -> Result<Option<OpaqueImage>, Error> {
        let Some(helper) = self.helper.filter(|_| self.device_composites) else { return Ok(None) };
        if !self.suits(helper, maps, camera) {
            return Ok(None);
        }
        let looked_up = self.look_ups(maps, ids.iter().copied());
        let lights = self.lit_by(maps, &looked_up);
        let (channels, objects) = (ChannelLayout::new(&self.layers).count(), self.layers.object);
        let mut nothing = Accumulator::new(camera.size, 1, channels, false, objects);
        let mut stages = CostRecord::default();
        let image = stages.measure(pass::OPAQUE, |stage| {
            self.chain(helper, (&lights, &[]), [&[], ids], camera, &mut nothing, stage)
        })?;
        if image.is_some() {
            cost.stages.extend(stages.stages);
        }
        Ok(image)
    }

    /// Whether a device shades splats in this light; if not it says why.
    fn suits(&self, helper: &Helper, maps: &[Option<ShadowMap>], camera: &Camera) -> bool {
        let by = |map| -> Option<&dyn Transmittance> { Some(map? as &ShadowMap) };
        let lights: Vec<LitBy<'_>> = self.shining(maps).map(|(light, map)| LitBy { light, shadow: by(map) }).collect();
        suits(&self.shading(&lights, camera)).map_err(|why| helper.leave(why)).is_ok()
    }

    /// The device, where it draws splats from their attributes to the picture.
    fn chaining(&self) -> Option<&Helper> {
        self.helper.filter(|_| self.device_composites && self.by_device())
    }

    /// The picture of all splats; of the stages before, and of these, the cost counts where the device did it.
    fn all_of(
        &self,
        helper: &Helper,
        lit: (&[LitBy<'_>], &[Casting]),
        camera: &Camera,
        mut stages: CostRecord,
        cost: &mut CostRecord,
    ) -> Result<Option<Layers>, Error> {
        let (planes, set) = (self.plan.optical_depth_planes, &self.layers);
        let channels = ChannelLayout::new(set).count();
        let mut accumulator = Accumulator::new(camera.size, planes, channels, set.depth, set.object);
        let [ids, solid] = [false, true].map(|opaque| self.ids(|kind| (kind == SplatKind::Opaque) == opaque));
        let done = stages
            .measure(pass::SPLAT, |stage| self.chain(helper, lit, [&ids, &solid], camera, &mut accumulator, stage))?;
        let Some(opaque) = done else { return Ok(None) };
        cost.stages.extend(stages.stages);
        self.tick()?;
        self.finish(&accumulator, &opaque, cost).map(Some)
    }

    /// Translucent splats and opaque ones by the device, lit by lights whose shadows it is given, or makes of castings. Gives
    /// the opaque ones.
    fn chain(
        &self,
        helper: &Helper,
        (lights, castings): (&[LitBy<'_>], &[Casting]),
        [ids, solid]: [&[u32]; 2],
        camera: &Camera,
        accumulator: &mut Accumulator,
        stage: &mut StageCost,
    ) -> Result<Option<OpaqueImage>, Error> {
        let input = self.shading(lights, camera);
        // What asks for half precision is composited elsewhere.
        let raster = raster::Params { accumulation: Accumulation::F32, ..self.raster_params() };
        let mut sort = self.sort_params();
        if self.layers.depth {
            // Depths are made front to back. The picture is the same.
            sort.direction = Direction::FrontToBack;
        }
        let splats = Splats {
            input: &input,
            ids,
            solid,
            footprints: &self.loaded.footprints,
            layout: ChannelLayout::new(&self.layers),
            sort: &sort,
            raster: &raster,
            opaque: &OpaqueImage::default(),
            castings,
            progress: self.progress,
        };
        let Some(done) = helper.chain(&splats, accumulator)? else { return Ok(None) };
        record(stage, &done.raster);
        stage.items_in = (ids.len() + solid.len()) as u64;
        Ok(Some(done.opaque.unwrap_or_default()))
    }

    /// Whether there is nothing about the picture that only the processor does; what there is it says where it does it.
    fn by_device(&self) -> bool {
        let points = &self.settings.points;
        // Depths are made from splats in order, not from slices.
        (points.exact || self.layers.depth) && points.first_slices.is_none() && points.accumulation == Accumulation::F32
    }
}
