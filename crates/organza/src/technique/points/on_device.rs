//! The splats of a picture wholly by a device, where it composites and there is nothing that only the processor does. Builds
//! shadow maps on the device, if it can, and keeps them there.

use super::{Points, sort_params};
use crate::Error;
use crate::device::{Helper, keeps_shadows};
use crate::frame::Chained;
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
    /// All of it, from attributes to the picture; whether that was done. Where it was not, one line says why.
    pub(super) fn by_device(&self, into: &mut Accumulator, cost: &mut CostRecord) -> Result<bool, Error> {
        let frame = self.frame;
        let Some(helper) = frame.helper.filter(|_| frame.device_composites) else { return Ok(false) };
        if let Some(why) = self.why_not() {
            helper.leave(why);
            return Ok(false);
        }
        if frame.loaded.cloud.is_empty() {
            return Ok(false);
        }
        let mut stages = CostRecord::default();
        if let Some(castings) = self.castings(helper, &mut stages)?
            && self.chained(helper, (&self.lit_on_device(), &castings), stages, into, cost)?
        {
            return Ok(true);
        }
        let maps = frame.maps(cost)?;
        if !frame.suits(helper, maps) {
            return Ok(false);
        }
        frame.tick()?;
        self.chained(helper, (&frame.lit_by(maps), &[]), CostRecord::default(), into, cost)
    }

    /// What about the picture only the processor does.
    fn why_not(&self) -> Option<&'static str> {
        let points = &self.frame.settings.points;
        // Depths are made from splats in order, not from slices.
        if !(points.exact || self.frame.layers.depth) {
            Some("slices without order inside (render.points.exact = false) are made and composited by the processor")
        } else if self.frame.plan.eye_table.is_some() {
            Some("media whose spacing is optically thick are lit by the processor")
        } else if points.first_slices.is_some() {
            Some("the first slices alone (render.points.first_slices) are composited by the processor")
        } else if points.accumulation != Accumulation::F32 {
            Some("splats are composited in half precision by the processor")
        } else if !self.frame.draws_all_solid() {
            Some(
                "opaque discs of `surfels`, polygons of `sheets`, and what lies before them, are drawn by the processor",
            )
        } else {
            None
        }
    }

    /// The lights that have an intensity, those with a shadow map lit through what the device makes.
    fn lit_on_device(&self) -> Vec<LitBy<'_>> {
        let tables = self.frame.plan.shadow_tables.iter();
        let shadows = tables.map(|table| table.is_some().then_some(&OnDevice as &dyn Transmittance));
        self.frame.with_light(shadows).map(|(lit, shadow)| LitBy { shadow, ..lit }).collect()
    }

    /// What throws the shadow of each light that has one, or `None` where no light has, and where a device does not make all of them.
    fn castings(&self, helper: &Helper<'_>, cost: &mut CostRecord) -> Result<Option<Vec<Casting>>, Error> {
        let frame = self.frame;
        let loaded = frame.loaded;
        if !frame.plan.shadow_maps.contains(&true) {
            return Ok(None);
        }
        // In the light of finished maps it is said why, if shading does not suit.
        if suits(&frame.shading(&self.lit_on_device())).is_err() || !keeps_shadows(helper) {
            return Ok(None);
        }
        let mut castings = Vec::new();
        for (rank, (point, table)) in frame.light_points().iter().zip(&frame.plan.shadow_tables).enumerate() {
            let light = &point.light;
            let Some(table) = table.filter(|_| light.intensity != [0.0; 3]) else { continue };
            let params = table.params(frame.settings, loaded, frame.plan.shadow_bytes);
            frame.tick()?;
            let made = cost.measure(pass::SHADOW_MAP, |stage| {
                stage.items_in = loaded.cloud.len() as u64;
                let objects = frame.casting(rank);
                let casting = Casting::new(
                    &tsm::Scene { cloud: &loaded.cloud, materials: &loaded.materials, objects: &objects },
                    light,
                    &params,
                    Some(frame.progress),
                );
                stage.items_out = casting.as_ref().map_or(0, |casting| casting.casters() + casting.given());
                casting
            });
            match made {
                Ok(casting) => castings.push(casting),
                Err(tsm::Error::Processor { why }) => {
                    helper.leave(why);
                    return Ok(None);
                }
                Err(e) => return Err(shadow_error(&point.name(), &e)),
            }
        }
        Ok(Some(castings))
    }

    /// All splats; of the stages before, and of these, the cost counts where the device did it.
    fn chained(
        &self,
        helper: &Helper<'_>,
        lit: (&[LitBy<'_>], &[Casting]),
        mut stages: CostRecord,
        into: &mut Accumulator,
        cost: &mut CostRecord,
    ) -> Result<bool, Error> {
        let frame = self.frame;
        let ids = frame.translucent(Technique::Points);
        let solid = frame.solid_ids();
        let sort = sort_params(frame);
        let (lights, castings) = lit;
        let chained = Chained { lights, castings, ids, solid, sort: &sort };
        let done = stages.measure(pass::SPLAT, |stage| frame.chain(helper, &chained, into, stage))?;
        let Some(opaque) = done else { return Ok(false) };
        cost.stages.extend(stages.stages);
        frame.set_opaque(opaque);
        frame.tick()?;
        Ok(true)
    }
}
