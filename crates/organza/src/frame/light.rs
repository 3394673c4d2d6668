//! Light of a frame: shadow maps, and what reaches splats through them.

use super::Frame;
use crate::device;
use crate::pass;
use crate::plan::Plan;
use crate::scene::{LightPoint, Technique, light_points};
use crate::shadows::{EYE, ShadowTable, casting, eye, eye_params, shadow_error, thick_objects};
use crate::{CostRecord, Error, cost as predicted, stage};
use splat_core::shade::{LitBy, ShadeInput};
use splat_core::{Arrived, Object, Remembered, Transmittance};
use tsm::{Deposits, ShadowMap};

/// The intensity of a light that gives none.
const DARK: [f32; 3] = [0.0; 3];

/// The shadow maps of a frame, for each point of a light. They serve other frames of the same splats, whatever the camera.
pub(crate) struct Maps {
    /// Of all casters.
    pub(super) of_all: Vec<Option<ShadowMap>>,
    /// Of [`Plan::others`].
    of_others: Vec<Option<ShadowMap>>,
    /// What arrived through each of `of_all` at the splats that are drawn.
    arrived: Vec<Arrived>,
    made_as: MadeAs,
}

/// The choices by which maps of the same splats were made.
#[derive(PartialEq)]
struct MadeAs {
    /// For each table its size and the transmittance at which its lists stop.
    tables: Vec<Option<(tsm::Prediction, f32)>>,
    /// [`Plan::casters`].
    casters: Vec<Vec<bool>>,
    /// [`Plan::by`] and [`Plan::is_own`], which decide of which splats light is remembered.
    by: Vec<Technique>,
    is_own: Vec<bool>,
}

impl Maps {
    /// Whether they are those of another plan for the same splats.
    pub(crate) fn serve(&self, plan: &Plan) -> bool {
        self.made_as == Self::made_as(plan)
    }

    /// Whether they have a shadow wherever another plan for the same splats has one, finer or coarser: good enough for a preview.
    pub(crate) fn stand_for(&self, plan: &Plan) -> bool {
        let other = Self::made_as(plan);
        let is_there = |made: &MadeAs| made.tables.iter().map(Option::is_some).collect::<Vec<_>>();
        is_there(&self.made_as) == is_there(&other)
            && self.made_as.casters == other.casters
            && self.made_as.by == other.by
            && self.made_as.is_own == other.is_own
    }

    /// The limit that the cells of each map ended at.
    pub(crate) fn limits(&self) -> impl Iterator<Item = tsm::Limit> {
        self.of_all.iter().chain(&self.of_others).flatten().map(|map| map.prediction().limit)
    }

    fn made_as(plan: &Plan) -> MadeAs {
        let tables = plan.shadow_tables.iter().chain(&plan.other_tables);
        let tables = tables.map(|table| table.map(|table| (table.predicted, table.tolerance))).collect();
        MadeAs { tables, casters: plan.casters.clone(), by: plan.by.clone(), is_own: plan.is_own.clone() }
    }
}

/// Maps that were built, and the bytes that are left for others.
struct Done {
    maps: usize,
    left: u64,
}

impl<'a> Frame<'a> {
    /// The points of all lights, by which techniques light what they draw. Those of lights that the plan leaves out have no intensity.
    pub(crate) fn light_points(&self) -> &[LightPoint] {
        self.light_points.get_or_init(|| {
            let mut points = light_points(&self.loaded.lights);
            for point in points.iter_mut().filter(|point| !self.plan.lights[point.light_index]) {
                point.light.intensity = [0.0; 3];
            }
            points
        })
    }

    /// One shadow map for each point of a light that the plan gives one, `None` for the others. What building them took is added to `cost`.
    ///
    /// # Errors
    /// [`Error::Cancelled`]; [`Error::Limit`] where a map needs more bytes than the plan leaves for it.
    pub fn maps(&self, cost: &mut CostRecord) -> Result<&[Option<ShadowMap>], Error> {
        Ok(&self.all_maps(cost)?.of_all)
    }

    /// The same of the casters that no light is carried through, or of those beside opaque triangles ([`Plan::others`]); empty where there are no
    /// such maps.
    pub(crate) fn maps_of_others(&self, cost: &mut CostRecord) -> Result<&[Option<ShadowMap>], Error> {
        Ok(&self.all_maps(cost)?.of_others)
    }

    fn all_maps(&self, cost: &mut CostRecord) -> Result<&Maps, Error> {
        if let Some(maps) = self.maps.get() {
            return Ok(maps);
        }
        let plan = self.plan;
        let others = plan.others(self.loaded).unwrap_or_default();
        let mut done = Done { maps: 0, left: plan.shadow_bytes };
        let casting = |point: usize| self.casting(point);
        let of_all = self.shadow_maps(&plan.shadow_tables, &casting, &mut done, cost)?;
        let of_others = self.shadow_maps(&plan.other_tables, &|_| others.clone(), &mut done, cost)?;
        let remembered = if self.remembers { self.drawn().len() } else { 0 };
        let arrived = of_all.iter().map(|map| Arrived::new(map.as_ref().map_or(0, |_| remembered))).collect();
        Ok(self.maps.get_or_init(|| Maps { of_all, of_others, arrived, made_as: Maps::made_as(plan) }))
    }

    /// The objects, of which those cast shadows that the picture could show of a point of a light.
    pub(crate) fn casting(&self, point: usize) -> Vec<Object> {
        casting(&self.loaded.objects, &self.plan.casters[point])
    }

    /// Shadows of the points of all lights by which splats are shaded that are drawn.
    pub(super) fn shadows_of_drawn(&self, cost: &mut CostRecord) -> Result<Vec<Option<Remembered<'_>>>, Error> {
        let Maps { of_all, arrived, .. } = self.all_maps(cost)?;
        Ok(of_all.iter().zip(arrived).map(|(map, arrived)| Some(arrived.through(map.as_ref()?))).collect())
    }

    fn shadow_maps(
        &self,
        tables: &[Option<ShadowTable>],
        casting: &dyn Fn(usize) -> Vec<Object>,
        done: &mut Done,
        cost: &mut CostRecord,
    ) -> Result<Vec<Option<ShadowMap>>, Error> {
        let mut maps = Vec::new();
        let count = self.plan.shadow_maps_built();
        for (rank, (point, table)) in self.light_points().iter().zip(tables).enumerate() {
            self.tick()?;
            let Some(table) = table else {
                maps.push(None);
                continue;
            };
            done.maps += 1;
            self.progress.begin(&predicted::shadow_map(done.maps, count, table.predicted.entries));
            let params = table.params(self.settings, self.loaded, done.left);
            let map = cost.measure(pass::SHADOW_MAP, |stage| {
                let l = self.loaded;
                let objects = casting(rank);
                let deposits = Deposits::new(
                    &tsm::Scene { cloud: &l.cloud, materials: &l.materials, objects: &objects },
                    &point.light,
                    &params,
                    Some(self.progress),
                )
                .map_err(|e| shadow_error(&point.name(), &e))?;
                let helped = self.helper.and_then(|helper| device::shadow_map(helper, &deposits));
                let map = helped.unwrap_or_else(|| deposits.into_map());
                stage.items_in = l.cloud.len() as u64;
                stage.items_out = map.counts().kept;
                stage.bytes = map.counts().bytes;
                Ok::<_, Error>(map)
            })?;
            done.left = done.left.saturating_sub(map.counts().bytes);
            maps.push(Some(map));
        }
        Ok(maps)
    }

    /// The map of the eye, where the plan has one.
    pub(super) fn eye_map(&self, cost: &mut CostRecord) -> Result<Option<ShadowMap>, Error> {
        let Some(table) = &self.plan.eye_table else { return Ok(None) };
        let l = self.loaded;
        self.progress.begin(stage::EYE_MAP);
        self.tick()?;
        let params = eye_params(l, table.tolerance, table.max_bytes);
        let objects = thick_objects(l, &self.plan.shown);
        cost.measure(pass::EYE_MAP, |stage| {
            let cloud = self.drawn();
            let scene = tsm::Scene { cloud, materials: &l.materials, objects: &objects };
            let map = ShadowMap::build(&scene, &eye(&self.camera), &params, Some(self.progress));
            let map = map.map_err(|e| shadow_error(EYE, &e))?;
            stage.items_in = cloud.len() as u64;
            stage.items_out = map.counts().kept;
            stage.bytes = map.counts().bytes;
            Ok(Some(map))
        })
    }

    /// The points of lights that have an intensity, with their shadows.
    pub(crate) fn lit_by<'b>(&'b self, shadows: &'b [Option<impl Transmittance>]) -> Vec<LitBy<'b>> {
        let shadows = shadows.iter().map(|shadow| shadow.as_ref().map(|shadow| shadow as &dyn Transmittance));
        self.with_light(shadows).map(|(lit, shadow)| LitBy { shadow, ..lit }).collect()
    }

    /// What shading the drawn splats reads.
    pub(crate) fn shading<'b>(&'b self, lights: &'b [LitBy<'b>]) -> ShadeInput<'b> {
        let l = self.loaded;
        let materials = &l.materials[..];
        let objects = &l.objects[..];
        let ambient = self.scene.ambient;
        let camera = &self.camera;
        ShadeInput { cloud: self.drawn(), materials, objects, lights, ambient, camera }
    }

    /// The points of lights that have an intensity, with their shadow maps beside them.
    pub(crate) fn shining<'b>(
        &'b self,
        maps: &'b [Option<ShadowMap>],
    ) -> impl Iterator<Item = (LitBy<'b>, Option<&'b ShadowMap>)> {
        self.with_light(maps.iter().map(Option::as_ref))
    }

    /// Points of lights that have an intensity.
    pub(crate) fn with_intensity(&self) -> impl Iterator<Item = &LightPoint> {
        self.light_points().iter().filter(|point| point.light.intensity != DARK)
    }

    /// Points of lights that have an intensity, without shadows, each with what is there for it.
    pub(crate) fn with_light<T>(&self, of_each: impl Iterator<Item = T>) -> impl Iterator<Item = (LitBy<'_>, T)> {
        let lit_points = self.light_points().iter().zip(of_each).filter(|(point, _)| point.light.intensity != DARK);
        lit_points.map(|(point, value)| (self.lit(point), value))
    }

    /// A point of a light behind its slide, without shadows.
    pub(crate) fn lit(&self, point: &LightPoint) -> LitBy<'_> {
        LitBy { light: point.light, slide: self.loaded.images.slides[point.light_index].as_ref(), shadow: None }
    }
}
