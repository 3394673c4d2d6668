//! The objects of a scene one after the other: read, counted, and converted.

use super::context::Context;
use super::input::{Input, input};
use super::object::{self, Prepared};
use super::object_context::{BYTES_PER_SPLAT, ObjectContext};
use super::own::Own;
use crate::cost::{self, Count};
use crate::form::PlannedObject;
use crate::scene::{Scene, SceneObject};
use crate::statistics::ObjectStatistics;
use crate::{Error, SplatCount, stage};
use splat_core::{Cloud, Exceeded};

/// The splats of objects.
pub(super) struct Converting {
    pub(super) clouds: Vec<Cloud>,
    /// Which objects of the scene have the splats of the preview before, as few as are drawn.
    pub(super) is_known: Vec<bool>,
}

/// What loading reads.
#[derive(Clone, Copy)]
pub(super) struct Loading<'a> {
    pub(super) scene: &'a Scene,
    pub(super) context: Context<'a>,
}

impl<'a> Loading<'a> {
    pub(super) fn visible(&self) -> impl Iterator<Item = (usize, &'a SceneObject)> + use<'a> {
        self.scene.objects.iter().enumerate().filter(|(_, object)| object.visible)
    }

    pub(super) fn context(&self, id: usize, used: u64, made: u64) -> ObjectContext<'a> {
        let Self { scene, context: Context { files, options, progress } } = *self;
        ObjectContext { scene, options, files, progress, id, used, made }
    }

    /// An error of an object with the file that its data is from.
    pub(super) fn named(&self, object: &SceneObject, error: Error) -> Error {
        error.in_object(&self.scene.file, object.source.path())
    }

    /// Reads every object and counts its splats, so that a scene that does not fit is refused before anything is
    /// converted.
    pub(super) fn prepare(
        &self,
        looks: &dyn Fn(&SceneObject) -> bool,
        beside: &[Count],
    ) -> Result<Vec<Prepared<'a>>, Error> {
        let work = cost::before_reading(self.scene, beside);
        self.context.progress.plan(self.context.options.rates.stages(&work));
        self.context.progress.begin(stage::READ);
        self.context.progress.add_total(self.visible().count() as u64);
        let prepare_object = |(id, object): (usize, &'a SceneObject)| {
            self.context.progress.tick(1).map_err(|_| Error::Cancelled)?;
            if let Some(reading) = cost::reading(object) {
                self.context.progress.begin(&reading);
            }
            let prepared = object::prepare(object, &self.context(id, 0, 0), looks(object));
            let mut prepared = prepared.map_err(|e| self.named(object, e))?;
            let what = format!("object '{}'", crate::shown(&object.name));
            let held = self.context.files.memory(self.context.options).take(&what, prepared.input.bytes()[1]);
            prepared.held = Some(held.map_err(Error::Limit)?);
            Ok(prepared)
        };
        self.visible().map(prepare_object).collect()
    }

    /// Reads every visible object.
    pub(super) fn inputs(&self) -> Result<Vec<Input<'a>>, Error> {
        let read_input = |(id, object): (usize, &'a SceneObject)| {
            self.context.progress.tick(0).map_err(|_| Error::Cancelled)?;
            input(object, &self.context(id, 0, 0)).map_err(|e| self.named(object, e))
        };
        self.visible().map(read_input).collect()
    }

    pub(super) fn statistics(&self, prepared: &[Prepared<'_>]) -> Vec<ObjectStatistics> {
        let object_statistics =
            |((id, object), p): ((usize, &SceneObject), &Prepared<'_>)| p.statistics(object, &self.context(id, 0, 0));
        self.visible().zip(prepared).map(object_statistics).collect()
    }

    /// The share of each object's splats that is drawn, by its rank: those of a volume of fewer voxels stand for more already.
    pub(super) fn shares(&self, prepared: &[Prepared<'_>]) -> Vec<f64> {
        let share = self.scene.render.splat_share;
        let mut shares = vec![share; self.scene.objects.len()];
        for ((id, _), object) in self.visible().zip(prepared) {
            if let Input::Volume(shown, ..) = &object.input {
                shares[id] = (share * shown.stands_for).min(1.0);
            }
        }
        shares
    }

    /// Splats to be made; refuses those that do not fit.
    pub(super) fn counts(
        &self,
        prepared: &[Prepared<'_>],
        planned: &[PlannedObject],
    ) -> Result<Vec<SplatCount>, Error> {
        let mut splats: Vec<SplatCount> = Vec::new();
        let left = self.context.files.memory(self.context.options).left();
        let mut needed = 0;
        for ((object, p), plan) in self.visible().map(|v| v.1).zip(prepared).zip(planned) {
            let mut count = SplatCount::predicted(&object.name, &p.prediction, p.input.conversion());
            if plan.splats.is_none() {
                (count.predicted, count.exact) = (0, true);
            }
            // Estimates count half, so that nothing is refused that would fit.
            needed += if count.exact { count.predicted } else { count.predicted / 2 };
            splats.push(count);
            check_total(self.scene, left, needed, &splats)?;
        }
        Ok(splats)
    }

    /// The objects that are drawn from their own data.
    pub(super) fn natives(
        &self,
        prepared: &mut [Prepared<'_>],
        planned: &[PlannedObject],
        warnings: &mut Vec<String>,
    ) -> Result<Vec<Own>, Error> {
        let mut natives = Vec::new();
        for (((id, _), p), plan) in self.visible().zip(prepared).zip(planned) {
            if !plan.form.is_own() {
                continue;
            }
            let native = Own::new(p, plan, &self.context(id, 0, 0));
            let native = native.map_err(|e| self.named(&self.scene.objects[id], e))?;
            if native.is_none() {
                let name = crate::shown(&self.scene.objects[id].name);
                warnings.push(format!("object '{name}' shows nothing: nothing of it was found"));
            }
            natives.extend(native);
        }
        Ok(natives)
    }

    /// The clouds of all objects that become splats.
    pub(super) fn clouds(
        &self,
        prepared: Vec<Prepared<'_>>,
        planned: &[PlannedObject],
        natives: &[Own],
        splats: &mut [SplatCount],
        warnings: &mut Vec<String>,
    ) -> Result<Converting, Error> {
        let before = self.context.files.take_converted();
        let mut is_known = vec![false; self.scene.objects.len()];
        let mut clouds: Vec<Cloud> = Vec::new();
        let mut used: u64 = natives.iter().map(Own::bytes).sum();
        let mut made = 0;
        // Both are in the order of the scene.
        let mut natives = natives.iter().peekable();
        for ((((id, object), p), plan), count) in self.visible().zip(prepared).zip(planned).zip(splats) {
            let native = natives.next_if(|o| o.object == id);
            if plan.splats.is_none() {
                continue;
            }
            let known = before.as_ref().and_then(|before| before.cloud(self.scene, id, plan));
            is_known[id] = known.is_some();
            let cloud = known.map_or_else(
                || {
                    self.context.progress.begin(&cost::converting(&object.name));
                    let cloud = object::convert(&p, native, &self.context(id, used, made), warnings);
                    cloud.map_err(|e| self.named(object, e))
                },
                Ok,
            )?;
            if cloud.is_empty() {
                warnings.push(format!("object '{}' has no splats", crate::shown(&object.name)));
            }
            count.made = cloud.len() as u64;
            (used, made) = (used + cloud.bytes(), made + count.made);
            clouds.push(cloud);
        }
        Ok(Converting { clouds, is_known })
    }
}

/// Refuses a scene whose objects together make too many splats, `needed`, for the memory that is left beside the inputs, or for the scene's
/// own limit.
fn check_total(scene: &Scene, left: u64, needed: u64, splats: &[SplatCount]) -> Result<(), Error> {
    let fits = left / BYTES_PER_SPLAT;
    let limit = scene.render.max_points.map_or(fits, |asked| asked.min(fits));
    let most = splats.iter().max_by_key(|s| s.predicted);
    let named = most.map(|s| format!(", most of them '{}' with {}", crate::shown(&s.object), s.predicted));
    let what = format!("the scene (before conversion{})", named.unwrap_or_default());
    let hint = "use a larger spacing, or a larger --max-memory or render.max_points";
    Exceeded::check(what, needed, limit, "splats", hint).map_err(Error::Limit)
}
