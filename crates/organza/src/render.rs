//! Renders a scene to images: prepare, draw.

pub(crate) mod budget;
pub(crate) mod draw;
pub(crate) mod sequence;

use crate::choose::settle;
use crate::choose::{row, techniques};
use crate::cost::Prediction;
use crate::device::Helper;
use crate::frame::{Frame, KeptGroups, Leaves};
use crate::load::files::Files;
use crate::load::{Everything, Loaded};
use crate::plan::Plan;
use crate::predict::prediction;
use crate::prepare::ranges::ranges;
use crate::prepare::{
    Explanation, Planned, Prepared, Purpose, is_brighter, load_measured, plan_alone, prepare, same_splats, settled,
    splats_serve, turned,
};
use crate::scene::{FoundCamera, Scene, SceneObject, Technique};
use crate::technique::{Checkpoint, Fold, Kept, Session, Sets};
use crate::{Context, CostRecord, Error, Layers, Progress, RenderOptions, warnings};
use convert::ColorScale;
use draw::draw;
use splat_core::{Arrived, DAabb};
use std::path::PathBuf;

/// A finished render.
#[derive(Debug, Clone, PartialEq)]
pub struct Render {
    /// The requested images, beauty and alpha always.
    pub layers: Layers,
    /// The cost of each pass.
    pub cost: CostRecord,
    /// The plan that was carried out, with its reasons.
    pub plan: Plan,
    /// Counted work and its time, from before the drawing.
    pub predicted: Prediction,
    /// Sets that were averaged; `None` when the picture is not an average.
    pub sets: Option<Sets>,
    /// Warnings about the input, one sentence each.
    pub warnings: Vec<String>,
    /// Data of the files that the picture does not show, and conversions of the data, one sentence each.
    pub notes: Vec<String>,
    /// Scales of the objects' colours: of a column of points, or of the values of a volume.
    pub scales: Vec<ColorScale>,
    /// The camera that was placed for it, where the scene leaves that to the data.
    pub found: Option<FoundCamera>,
    /// The backend that drew it: `cpu`, or the interface and the device that helped.
    pub backend: String,
}

/// A frame that is planned and not drawn.
pub struct Foreseen<'f> {
    /// The frame that techniques would read.
    pub frame: &'f Frame<'f>,
    /// Its data.
    pub loaded: &'f Loaded,
    /// The plan, with its reasons.
    pub plan: &'f Plan,
    /// Counted work and its time.
    pub predicted: &'f Prediction,
}

/// Renders a scene. The technique `particles` has a picture at any time. A render that is cancelled after two sets
/// returns the picture of the finished sets, which [`Render::sets`] counts.
///
/// # Errors
/// [`Error::Input`] and [`Error::Io`] for data, [`Error::Limit`] before more memory is taken than allowed,
/// [`Error::Cancelled`] after `progress.cancel()`.
pub fn render(scene: &Scene, options: &RenderOptions, progress: &Progress) -> Result<Render, Error> {
    render_from(scene, options, progress, Files::default())
}

/// [`render`] from files of which some were read before.
///
/// # Errors
/// As [`render`].
pub fn render_from(scene: &Scene, options: &RenderOptions, progress: &Progress, files: Files) -> Result<Render, Error> {
    render_keeping(scene, None, options, progress, &mut Left { files, is_still: true, ..Left::default() })
}

/// What the frames of an animation leave for the next.
#[derive(Default)]
pub(crate) struct Left {
    pub(crate) files: Files,
    pub(crate) sets: Kept,
    groups: KeptGroups,
    made: Option<Made>,
    /// The technique of each object in the last frame, by rank.
    by: Vec<Technique>,
    /// Whether no other frame comes.
    is_still: bool,
    /// Whether frames are previews, which have no map of the eye.
    pub(crate) is_preview: bool,
}

/// What was made of the last frame's scene.
struct Made {
    scene: Scene,
    loaded: Loaded,
    planned: Planned,
    leaves: Leaves,
    uncut: Option<Uncut>,
}

/// The scene that the splats of a preview were made for, whose objects are neither hidden nor cut, and all of its splats.
struct Uncut {
    scene: Scene,
    everything: Everything,
}

/// What one frame can take over from the frame before it.
#[derive(Default)]
struct Served {
    made: Option<(Loaded, Option<Planned>)>,
    leaves: Leaves,
    uncut: Option<Uncut>,
}

impl Left {
    /// A frame that will be drawn.
    pub(crate) fn add(&mut self, frame: &Scene) {
        if techniques(frame).into_iter().any(|technique| row(technique).is_random) {
            self.sets.add(frame);
        }
    }

    /// A box around all that the last frame made of each object, cut away or not, world units; empty for an object without anything.
    pub(crate) fn object_bounds(&self) -> Vec<DAabb> {
        let Some(Made { loaded, uncut, .. }) = &self.made else { return Vec::new() };
        loaded.object_bounds(uncut.as_ref().map(|uncut| &uncut.everything))
    }

    /// Share of the allowed memory that files may take, and light that is remembered.
    const SHARE: u64 = 4;

    /// Bytes of the light that arrives at splats, where the next frame is to find it: not where they are more than its share, or than is
    /// left beside `other`.
    fn remembers(&self, loaded: &Loaded, plan: &Plan, max_memory: u64, other: u64) -> Option<u64> {
        let bytes = Arrived::bytes_of(loaded.cloud.len()).saturating_mul(plan.tables().count() as u64);
        let fits = bytes <= (max_memory / Self::SHARE).min(max_memory.saturating_sub(other));
        (!self.is_still && fits).then_some(bytes)
    }

    /// Takes what was made of another frame, as far as it serves this one.
    fn take_made(&mut self, scene: &Scene, max_memory: u64) -> Served {
        // What serves no longer makes room.
        match self.made.take() {
            Some(Made { scene: before, loaded, planned, leaves, uncut }) if turned(&before, scene) => {
                Served { made: Some((loaded, Some(planned))), leaves, uncut }
            }
            Some(Made { scene: before, loaded, uncut, leaves, .. }) if splats_serve(&before, scene, &loaded) => {
                let leaves = if is_brighter(&before, scene) { leaves.of_lights() } else { Leaves::default() };
                Served { made: Some((loaded, None)), uncut, leaves }
            }
            Some(made) if self.is_preview && made.loaded.cloud.bytes() <= max_memory / Self::SHARE => {
                preview_of_part(made, scene).unwrap_or_default()
            }
            _ => Served::default(),
        }
    }

    const fn purpose(&self) -> Purpose {
        if self.is_preview { Purpose::Preview } else { Purpose::Picture }
    }

    /// Lets files go that take more than their share, or than is left beside `other` bytes, or that no frame needs; sets may take what
    /// is then left.
    fn fit(&mut self, max_memory: u64, other: u64) {
        if self.is_still || self.files.bytes() > (max_memory / Self::SHARE).min(max_memory.saturating_sub(other)) {
            self.files = self.files.emptied();
        }
        self.sets.allow(max_memory, other + self.files.bytes());
    }
}

/// Splats of a frame of which another hides or cuts objects, or shows them again, or has fewer splats: those whose middles it shows. Cuts are as rough as
/// splats, and have no lids.
fn preview_of_part(made: Made, scene: &Scene) -> Option<Served> {
    let Made { scene: before, mut loaded, uncut, .. } = made;
    let Some(Uncut { scene: whole, everything }) = uncut else { return part_of(before, loaded, scene) };
    loaded.take_back(Some(everything));
    part_of(whole, loaded, scene)
}

/// The part of a loaded scene that another shows.
fn part_of(whole: Scene, mut loaded: Loaded, scene: &Scene) -> Option<Served> {
    let share = scene.render.splat_share / whole.render.splat_share;
    if share > 1.0 {
        return None;
    }
    let everything = loaded.keep_shown(&whole, scene, share)?;
    let mut part = whole.clone();
    part.render.splat_share = scene.render.splat_share;
    for (object, shown) in part.objects.iter_mut().zip(&scene.objects) {
        object.visible = shown.visible;
        object.clip.clone_from(&shown.clip);
    }
    splats_serve(&part, scene, &loaded).then(|| Served {
        made: Some((loaded, None)),
        uncut: Some(Uncut { scene: whole, everything }),
        leaves: Leaves::default(),
    })
}

/// The part that a preview shows of a scene that is loaded for it; nothing where that takes too much memory.
///
/// # Errors
/// As [`crate::render`].
fn load_part(whole: &Scene, scene: &Scene, context: Context<'_>, cost: &mut CostRecord) -> Result<Served, Error> {
    match load_measured(whole, context, cost) {
        Ok(loaded) => Ok(part_of(whole.clone(), loaded, scene).unwrap_or_default()),
        Err(Error::Limit(_)) => Ok(Served::default()),
        Err(error) => Err(error),
    }
}

/// The techniques that no device draws, where one was asked for.
fn left_to_processor(plan: &Plan) -> Option<String> {
    let left: Vec<&str> = plan.techniques.iter().filter(|t| !row(**t).by_device).map(|t| t.name()).collect();
    (!left.is_empty()).then(|| {
        format!(
            "what the technique {} draws is drawn by the processor: a device draws that of `points` and `particles` alone; \
             --technique chooses one",
            left.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(" or ")
        )
    })
}

/// Objects that the plan draws by another technique than in the frame before: their look may change there.
fn drawn_anew(scene: &Scene, before: &[Technique], by: &[Technique]) -> Vec<String> {
    let changed =
        scene.objects.iter().zip(before).zip(by).filter(|((object, before), by)| object.visible && before != by);
    let sentence = |((object, before), by): ((&SceneObject, &Technique), &Technique)| {
        let name = crate::shown(&object.name);
        format!(
            "object '{name}' is drawn by the technique `{}` in this picture and by `{}` in the one before, so its look may change: choose one \
             technique for it",
            by.name(),
            before.name()
        )
    };
    changed.filter(|((object, _), _)| object.is_chosen).map(sentence).collect()
}

/// [`render`] with what there is already. A preview of a part of a scene is made of the splats of the `whole`.
pub(crate) fn render_keeping(
    scene: &Scene,
    whole: Option<&Scene>,
    options: &RenderOptions,
    progress: &Progress,
    left: &mut Left,
) -> Result<Render, Error> {
    let (scene, found) = settled(scene, Context { files: &left.files, options, progress })?;
    let scene = &*scene;
    let open = |path: &PathBuf| {
        if !matches!(techniques(scene)[..], [only] if row(only).is_random) {
            let message = "only the technique `particles` is drawn in sets that a checkpoint can keep";
            return Err(Error::usage(message, "use --technique particles, or no --checkpoint"));
        }
        let kept = (!left.is_still).then_some(&left.sets);
        let memory = left.files.memory(options);
        Checkpoint::open(path, scene, options, kept, &memory)
    };
    let mut checkpoint = options.checkpoint.as_ref().map(open).transpose()?;
    let helper = options.device.as_deref().map(Helper::new);
    let mut served = left.take_made(scene, options.max_memory);
    let mut loading = CostRecord::default();
    if let Some(whole) = whole.filter(|whole| served.made.is_none() && whole.objects != scene.objects) {
        served = load_part(whole, scene, Context { files: &left.files, options, progress }, &mut loading)?;
    }
    let Served { made, mut leaves, uncut } = served;
    let stated = scene;
    let Prepared { scene, loaded, planned, explanation } =
        prepare(stated, Context { files: &left.files, options, progress }, made, left.purpose())?;
    let scene = &*scene;
    let plan = &planned.plan;
    let bytes = planned.memory.total();
    let remembers = left.remembers(&loaded, plan, options.max_memory, bytes);
    left.fit(options.max_memory, bytes + remembers.unwrap_or(0));
    let Explanation { plan: shown, mut cost, mut warnings, notes, .. } = explanation;
    cost.stages.splice(0..0, loading.stages);
    // Do not warn of an empty picture if loading has already warned of the reason.
    let is_empty = loaded.cloud.is_empty() && loaded.own.is_empty();
    let has_reason = is_empty || warnings.len() > loaded.warnings.len();
    warnings.extend(settle::said(scene, &plan.estimates).warnings);
    warnings.extend(drawn_anew(scene, &left.by, &plan.by));
    left.by.clone_from(&plan.by);
    let device = helper.as_ref().map(|helper| (helper, options.device_composites));
    leaves.maps = leaves.maps.filter(|maps| maps.serve(plan) || left.is_preview && maps.stand_for(plan));
    let frame = Frame::new(scene, &loaded, plan, progress).helped_by(device).following(leaves, remembers.is_some());
    frame.groups.replace(std::mem::take(&mut left.groups));
    let kept = (!left.is_still).then_some(&mut left.sets);
    let checkpoint = checkpoint.as_mut();
    let mut session = Session {
        options,
        checkpoint,
        kept,
        warnings: &mut warnings,
        sets: None,
        predicted: Prediction::default(),
        announces: true,
    };
    // What was taken out of a scene may be in the next.
    let is_whole = planned.plan.left_out.is_empty();
    let drawn = draw(&frame, &mut session, &mut cost);
    left.groups = frame.groups.take();
    let layers = match drawn {
        Ok(layers) => layers,
        Err(error) => {
            // What was made before a stop serves the next frame, which begins with it.
            let leaves = frame.leaves();
            left.made =
                (!left.is_still && is_whole).then(|| Made { scene: stated.clone(), loaded, planned, leaves, uncut });
            return Err(error);
        }
    };
    let Session { sets, predicted, .. } = session;
    let is_judged = !has_reason && scene.frames.is_none();
    let most_of_a_table = plan.tables().map(|table| table.max_bytes).max().unwrap_or(0);
    let coarse = is_judged.then(|| frame.coarse()).flatten();
    let coarse = coarse.and_then(|coarse| warnings::of_cells(coarse, most_of_a_table));
    let leaves = frame.leaves();
    let backend = helper.as_ref().map_or_else(|| "cpu".to_owned(), |helper| helper.name());
    if !has_reason {
        warnings.extend(warnings::of_picture(scene, &layers));
    }
    warnings.extend(warnings::of_shadows(&leaves.shadow_limits(plan)));
    warnings.extend(warnings::of_costly(plan.tables()));
    warnings.extend(coarse);
    warnings.extend(warnings::of_scattering(plan));
    warnings.extend(helper.as_ref().and_then(|_| left_to_processor(plan)));
    warnings.extend(helper.map(|helper| helper.said()).unwrap_or_default());
    let scales = loaded.scales.clone();
    left.made = (!left.is_still && is_whole).then(|| Made { scene: stated.clone(), loaded, planned, leaves, uncut });
    Ok(Render { layers, cost, plan: shown, predicted, sets, warnings, notes, scales, found, backend })
}

/// Loads and plans a frame, and keeps what was made for drawing it.
pub(crate) fn prepare_keeping(
    scene: &Scene,
    options: &RenderOptions,
    progress: &Progress,
    left: &mut Left,
) -> Result<(), Error> {
    let (scene, _) = settled(scene, Context { files: &left.files, options, progress })?;
    let Served { made, leaves, uncut } = left.take_made(&scene, options.max_memory);
    let Prepared { loaded, planned, .. } =
        prepare(&scene, Context { files: &left.files, options, progress }, made, left.purpose())?;
    let is_whole = planned.plan.left_out.is_empty();
    left.made = is_whole.then(|| Made { scene: scene.into_owned(), loaded, planned, leaves, uncut });
    Ok(())
}

/// Plans a frame from the splats of the frame that was drawn last, and shows the plan with its predicted work; `None` where splats would be made anew. What
/// was made stays for the next frame.
pub(crate) fn plan_keeping<T>(
    scene: &Scene,
    options: &RenderOptions,
    progress: &Progress,
    left: &mut Left,
    look: impl FnOnce(&Foreseen<'_>) -> Result<T, Error>,
) -> Result<Option<T>, Error> {
    let Some(Made { scene: before, loaded, .. }) = &mut left.made else { return Ok(None) };
    let share = scene.render.splat_share / before.render.splat_share;
    let mut of_all = scene.clone();
    of_all.render.splat_share = before.render.splat_share;
    // Other settings are another text.
    of_all.sha256.clone_from(&before.sha256);
    if share > 1.0 || before.camera != scene.camera || !same_splats(before, &of_all) {
        return Ok(None);
    }
    let everything = loaded.keep_share(share);
    loaded.retarget(scene);
    let found = plan_alone(scene, loaded, options).and_then(|planned| {
        let frame = Frame::new(scene, loaded, &planned.plan, progress);
        let predicted = foreseen(&frame, options)?;
        look(&Foreseen { frame: &frame, loaded, plan: &planned.plan, predicted: &predicted })
    });
    loaded.take_back(everything);
    loaded.retarget(before);
    found.map(Some)
}

/// The predicted work of a frame before it is drawn.
fn foreseen(frame: &Frame<'_>, options: &RenderOptions) -> Result<Prediction, Error> {
    let begin = |technique: &Technique| (row(*technique).begin)(frame);
    let mut folds: Vec<Box<dyn Fold + '_>> = frame.plan.techniques.iter().map(begin).collect();
    folds.iter_mut().try_for_each(|fold| fold.check(options, &mut CostRecord::default()))?;
    Ok(prediction(frame, &folds, &ranges(frame), options))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_no_device_draws_is_told_by_name() {
        let said = |techniques: &[Technique]| {
            left_to_processor(&Plan { techniques: techniques.to_vec(), ..Plan::default() }).unwrap_or_default()
        };
        assert_eq!(said(&[Technique::Points, Technique::Particles]), "");
        assert!(said(&[Technique::Points, Technique::Sheets]).starts_with("what the technique `sheets` draws"));
        assert!(said(&[Technique::Surfels, Technique::Reference]).contains("`surfels` or `reference`"));
    }
}
