//! The splats of a picture wholly on a device, where it composites and there is nothing that only the processor does. Where the
//! device can, shadow maps are made there and stay there.

use super::{Points, sort_params};
use crate::Error;
use crate::device::Helper;
use crate::pass;
use crate::scene::Technique;
use crate::shadows::shadow_error;
use splat_core::raster::Accumulation;
use splat_core::shade::{LitBy, gpu::suits};
use splat_core::{Accumulator, CostRecord, Receiver, Transmittance};
use tsm::gpu::Casting;

/// Stands for a map that lies on the device alone: its light is looked up there.
struct OnDevice;

impl Transmittance for OnDevice {
    fn transmittance(&self, _: &Receiver) -> [f32; 3] {
        [1.0; 3]
    }
}

impl Points<'_> {
    /// All of it, its shadow maps on the device too; whether that was done.
    pub(super) fn staying(&self, into: &mut Accumulator, cost: &mut CostRecord) -> Result<bool, Error> {
        let frame = self.frame;
        let Some(helper) = self.chaining() else { return Ok(false) };
        if frame.loaded.cloud.is_empty() || !frame.plan.shadow_maps.contains(&true) {
            return Ok(false);
        }
        let tables = &frame.plan.shadow_tables;
        let on_device = tables.iter().map(|table| table.is_some().then_some(&OnDevice as &dyn Transmittance));
        let lights: Vec<LitBy<'_>> =
            frame.with_light(on_device).map(|(light, shadow)| LitBy { light, shadow }).collect();
        // The passes one by one say why, if it does not suit.
        if suits(&frame.shading(&lights)).is_err() || !helper.keeps_shadows() {
            return Ok(false);
        }
        let mut stages = CostRecord::default();
        let Some(castings) = self.castings(helper, &mut stages)? else { return Ok(false) };
        self.all_of(helper, (&lights, &castings), stages, into, cost)
    }

    /// What throws the shadow of each light that has one, or `None` where a device does not make it.
    fn castings(&self, helper: &Helper, cost: &mut CostRecord) -> Result<Option<Vec<Casting>>, Error> {
        let (frame, l) = (self.frame, self.frame.loaded);
        let mut castings = Vec::new();
        for (point, table) in frame.light_points().iter().zip(&frame.plan.shadow_tables) {
            let light = &point.light;
            let Some(table) = table.filter(|_| light.intensity != [0.0; 3]) else { continue };
            let params = table.params(frame.settings, l, frame.plan.shadow_bytes);
            frame.tick()?;
            let made = cost.measure(pass::SHADOW_MAP, |stage| {
                stage.items_in = l.cloud.len() as u64;
                let casting = Casting::new(&l.cloud, &l.materials, &l.objects, light, &params, frame.progress);
                stage.items_out = casting.as_ref().map_or(0, |casting| casting.casters() + casting.given());
                casting
            });
            match made {
                Ok(casting) => castings.push(casting),
                Err(tsm::Error::Processor { why }) => {
                    helper.leave(why);
                    return Ok(None);
                }
                Err(e) => return Err(shadow_error(point, &e)),
            }
        }
        Ok(Some(castings))
    }

    /// All of it in the light of the frame's maps; whether that was done.
    pub(super) fn chained(&self, into: &mut Accumulator, cost: &mut CostRecord) -> Result<bool, Error> {
        let frame = self.frame;
        let maps = frame.maps(cost)?;
        let Some(helper) = self.chaining() else { return Ok(false) };
        if frame.loaded.cloud.is_empty() || !frame.suits(helper, maps) {
            return Ok(false);
        }
        frame.tick()?;
        let looked_up = frame.look_ups(maps, 0..frame.drawn().len() as u32);
        let lights = frame.lit_by(maps, &looked_up);
        self.all_of(helper, (&lights, &[]), CostRecord::default(), into, cost)
    }

    /// The device, where it draws splats from their attributes to the picture.
    fn chaining(&self) -> Option<&Helper> {
        self.frame.helper.filter(|_| self.frame.device_composites && self.by_device())
    }

    /// All splats; of the stages before, and of these, the cost counts where the device did it.
    fn all_of(
        &self,
        helper: &Helper,
        lit: (&[LitBy<'_>], &[Casting]),
        mut stages: CostRecord,
        into: &mut Accumulator,
        cost: &mut CostRecord,
    ) -> Result<bool, Error> {
        let frame = self.frame;
        let (ids, solid) = (frame.translucent(frame.drawn(), Technique::Points), frame.solid_ids());
        let sort = sort_params(frame);
        let done = stages.measure(pass::SPLAT, |stage| frame.chain(helper, lit, [&ids, &solid], &sort, into, stage))?;
        let Some(opaque) = done else { return Ok(false) };
        cost.stages.extend(stages.stages);
        frame.set_opaque(opaque);
        frame.tick()?;
        Ok(true)
    }

    /// Whether there is nothing about the picture that only the processor does; what there is it says where it does it.
    fn by_device(&self) -> bool {
        let points = &self.frame.settings.points;
        // Depths are made from splats in order, not from slices.
        (points.exact || self.frame.layers.depth)
            && points.first_slices.is_none()
            && points.accumulation == Accumulation::F32
    }
}
