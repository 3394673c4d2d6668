//! From a scene to images: load, plan, draw.

use crate::device::{DeviceChoice, Helper};
use crate::load::files::Files;
use crate::load::{Loaded, SplatCount, light_statistics, load_measured};
use crate::memory::{self, Memory};
use crate::particles::{self, Checkpoint, Kept, average_bytes};
use crate::plan::{Plan, pass, plan};
use crate::points::{self, Drawing, shadow_error};
use crate::scene::{Scene, Technique};
use crate::statistics::Statistics;
use crate::{CostRecord, Error, Layers, Progress, doubts, shadows, work};
use convert::read::ReadLimits;
use splat_core::{LayerData, Material};
use std::path::PathBuf;

/// What a render may take and how it treats doubtful input.
#[derive(Debug, Clone)]
pub struct RenderOptions {
    /// Bytes that all buffers together may take.
    pub max_memory: u64,
    /// Leave out records with values that are not finite instead of refusing the file.
    pub drop_invalid: bool,
    /// Refuse files with a fault that could be mended, see [`convert::read::Fix`].
    pub strict: bool,
    /// Make one point of points at the same place, for every object.
    pub merge_duplicates: bool,
    /// File of the sums of the technique `particles`: read before, if it is there, and written every few seconds, at the
    /// end and at an interrupt. A render that is stopped at any moment goes on from it and ends in the same bits.
    pub checkpoint: Option<PathBuf>,
    /// The device on which the passes run that can; `None`: the processor alone.
    pub device: Option<DeviceChoice>,
    /// Whether the device composites the splats too: beauty then differs from the processor's by rounding, up to 10⁻⁵ of
    /// the brightest splat.
    pub device_composites: bool,
}

impl Default for RenderOptions {
    fn default() -> Self {
        Self {
            max_memory: 8 << 30,
            drop_invalid: false,
            strict: false,
            merge_duplicates: false,
            checkpoint: None,
            device: None,
            device_composites: false,
        }
    }
}

impl RenderOptions {
    /// What files may ask for.
    pub(crate) fn read_limits(&self) -> ReadLimits {
        ReadLimits { max_bytes: self.max_memory, drop_invalid: self.drop_invalid, strict: self.strict }
    }
}

/// A finished render.
#[derive(Debug, Clone, PartialEq)]
pub struct Render {
    /// The images that were asked for, beauty and alpha always.
    pub layers: Layers,
    /// What each pass cost.
    pub cost: CostRecord,
    /// What was done and why.
    pub plan: Plan,
    /// Sets that were averaged; `None` when the picture is not an average.
    pub sets: Option<Sets>,
    /// What a user should know of the input, one sentence each.
    pub warnings: Vec<String>,
    /// What files hold that the picture does not show, and what was made of them, one sentence each.
    pub notes: Vec<String>,
    /// What drew it: `cpu`, or the interface and the device that helped.
    pub backend: String,
}

/// Sets of particles in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sets {
    /// Sets that were averaged.
    pub averaged: u32,
    /// Most sets that were asked for.
    pub asked: u32,
    /// Whether it was cancelled before there were enough.
    pub interrupted: bool,
}

/// What a render would do, without doing it.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// Effects and passes with their reasons.
    pub plan: Plan,
    /// What loading cost.
    pub cost: CostRecord,
    /// Bytes that rendering will take at its peak, see [`Explanation::plan`] for the passes that take them. Shadow maps are
    /// predicted from the sizes of their casters as a light sees them; together they are held to what is allowed when they are
    /// built.
    pub memory: u64,
    /// Splats of every visible object, as predicted from its input and as made.
    pub splats: Vec<SplatCount>,
    /// What a user should know of the input.
    pub warnings: Vec<String>,
    /// What files hold that a picture does not show, and what was made of them.
    pub notes: Vec<String>,
}

/// Renders a scene. The technique `particles` has a picture at any time: cancelled after two sets, it is that of the sets
/// so far, and [`Render::sets`] says so.
///
/// # Errors
/// [`Error::Input`] and [`Error::Io`] for data, [`Error::Limit`] before more memory is taken than allowed,
/// [`Error::Cancelled`] after `progress.cancel()`, [`Error::Gpu`] when there is no device as asked for.
pub fn render(scene: &Scene, options: &RenderOptions, progress: &Progress) -> Result<Render, Error> {
    render_keeping(scene, options, progress, None)
}

/// What the frames of an animation leave for the next.
#[derive(Default)]
pub(crate) struct Left {
    pub(crate) files: Files,
    pub(crate) sets: Kept,
}

impl Left {
    /// Share of the allowed memory that files may take.
    const FILES: u64 = 4;

    /// Lets files go that take more than their share, or than is left beside `other` bytes; sets may take what is then left.
    fn fit(&mut self, max_memory: u64, other: u64) {
        if self.files.bytes() > (max_memory / Self::FILES).min(max_memory.saturating_sub(other)) {
            self.files = Files::default();
        }
        self.sets.allow(max_memory, other + self.files.bytes());
    }
}

/// [`render`] with what other frames of the scene have left.
pub(crate) fn render_keeping(
    scene: &Scene,
    options: &RenderOptions,
    progress: &Progress,
    mut left: Option<&mut Left>,
) -> Result<Render, Error> {
    let open = |path: &PathBuf| Checkpoint::open(path, scene, options, left.as_ref().map(|left| &left.sets));
    let mut checkpoint = options.checkpoint.as_ref().map(open).transpose()?;
    let helper = options.device.as_ref().map(Helper::open).transpose()?;
    let (loaded, explanation, memory) = match &left {
        Some(left) => prepare(scene, options, progress, &left.files)?,
        None => prepare(scene, options, progress, &Files::default())?,
    };
    let Explanation { plan, mut cost, mut warnings, notes, .. } = explanation;
    // A reason that is told already is enough.
    let is_empty = loaded.cloud.is_empty() && loaded.own.is_empty();
    let doubtful = is_empty || warnings.len() > loaded.warnings.len();
    if let Some(left) = left.as_deref_mut() {
        left.fit(options.max_memory, memory.total());
    }
    let kept = left.map(|left| &mut left.sets);
    let drawing = Drawing { helper: helper.as_ref(), ..drawing(scene, &loaded, &plan, options, progress) };
    let (layers, sets) = draw(scene, &drawing, options, checkpoint.as_mut(), kept, &mut cost, &mut warnings)?;
    let backend = helper.as_ref().map_or_else(|| "cpu".to_owned(), Helper::name);
    if !doubtful {
        warnings.extend(doubts::of_picture(scene, &layers));
    }
    warnings.extend(doubts::of_shadows(&plan.shadow_tables));
    warnings.extend(helper.map(Helper::said).unwrap_or_default());
    Ok(Render { layers, cost, plan, sets, warnings, notes, backend })
}

/// Runs the planned passes on a loaded scene to their end, by the processor alone, and keeps the layers that it asks for.
pub(crate) fn draw_loaded(
    scene: &Scene,
    loaded: &Loaded,
    plan: &Plan,
    options: &RenderOptions,
    progress: &Progress,
    cost: &mut CostRecord,
) -> Result<Layers, Error> {
    let drawing = drawing(scene, loaded, plan, options, progress);
    match draw(scene, &drawing, options, None, None, cost, &mut Vec::new())? {
        (_, Some(Sets { interrupted: true, .. })) => Err(Error::Cancelled),
        (layers, _) => Ok(layers),
    }
}

fn draw(
    scene: &Scene,
    drawing: &Drawing<'_>,
    options: &RenderOptions,
    checkpoint: Option<&mut Checkpoint>,
    kept: Option<&mut Kept>,
    cost: &mut CostRecord,
    warnings: &mut Vec<String>,
) -> Result<(Layers, Option<Sets>), Error> {
    drawing.progress.plan(work::of_passes(drawing, scene));
    let (mut layers, sets) = match scene.render.technique {
        Technique::Auto | Technique::Points => (points::draw(drawing, cost)?, None),
        Technique::Particles => particles::draw(drawing, scene, options, checkpoint, kept, cost, warnings)?,
    };
    restore_depths(&mut layers, drawing.loaded.exponent);
    scene.render.layers.keep(&mut layers);
    drawing.progress.finish();
    Ok((layers, sets))
}

/// What drawing a loaded scene reads.
pub(crate) fn drawing<'a>(
    scene: &'a Scene,
    loaded: &'a Loaded,
    plan: &'a Plan,
    options: &RenderOptions,
    progress: &'a Progress,
) -> Drawing<'a> {
    Drawing {
        loaded,
        settings: &scene.render,
        background: scene.background,
        ambient: scene.ambient,
        layers: scene.render.layers.set(),
        plan,
        helper: None,
        device_composites: options.device_composites,
        progress,
    }
}

/// Loads a scene and plans its render.
///
/// # Errors
/// As [`render`].
pub fn explain(scene: &Scene, options: &RenderOptions, progress: &Progress) -> Result<Explanation, Error> {
    let (_, mut explanation, _) = prepare(scene, options, progress, &Files::default())?;
    explanation.warnings.extend(doubts::of_shadows(&explanation.plan.shadow_tables));
    progress.finish();
    Ok(explanation)
}

fn prepare(
    scene: &Scene,
    options: &RenderOptions,
    progress: &Progress,
    files: &Files,
) -> Result<(Loaded, Explanation, Memory), Error> {
    let mut cost = CostRecord::default();
    memory::check("the image", memory::image_bytes(scene), options.max_memory)?;
    check_samples(scene)?;
    let loaded = load_measured(scene, options, progress, files, &mut cost)?;
    let (plan, memory) = plan_loaded(scene, &loaded, options)?;
    let (splats, notes) = (loaded.splats.clone(), loaded.notes.clone());
    let mut warnings = loaded.warnings.clone();
    warnings.extend(doubts::of_scene(scene, &loaded));
    let inputs = cost.stages.iter().filter(|s| s.name == pass::READ).map(|s| s.bytes).sum();
    let most = memory.total().max(memory::loading_bytes(&loaded, inputs));
    Ok((loaded, Explanation { plan, cost, memory: most, splats, warnings, notes }, memory))
}

/// The plan of a loaded scene, and the bytes that it takes.
pub(crate) fn plan_loaded(scene: &Scene, loaded: &Loaded, options: &RenderOptions) -> Result<(Plan, Memory), Error> {
    check_samples(scene)?;
    let mut statistics = Statistics::of_cloud(&loaded.cloud, &loaded.materials, &loaded.objects, &loaded.footprints);
    statistics.lights = light_statistics(&loaded.lights, &loaded.casts);
    statistics.normals_needed = loaded.normals;
    statistics.layers = scene.render.layers.names().map(str::to_owned).collect();
    statistics.tolerance = scene.render.tolerance;
    statistics.particles = scene.render.technique == Technique::Particles;
    if statistics.particles {
        let made: Vec<u64> = loaded.splats.iter().map(|s| s.made).collect();
        statistics = statistics.with_objects(loaded.statistics.clone(), &made);
        let materials = loaded.own.iter().map(|o| &loaded.materials[scene.objects[o.object].material]);
        let unequal = |m: &Material| m.extinction_rgb.iter().any(|e| *e != m.extinction_rgb[0]);
        statistics.colored_extinction |= materials.into_iter().any(unequal);
    }
    let mut plan = plan(&statistics);
    let mut average = 0;
    if plan.passes.iter().any(|p| p.name == pass::PARTICLES) {
        let size = scene.camera.size.map(|s| u64::from(s) * u64::from(scene.render.antialias));
        average = average_bytes(size, &scene.render.layers.set(), statistics.colored_extinction, options);
    }
    let memory = Memory::new(scene, loaded, average);
    memory::check("rendering", memory.total(), options.max_memory)?;
    // Shadow maps share what is left.
    let left = options.max_memory - memory.total();
    let tables = shadows::tables(&scene.render, loaded, &plan.shadow_maps, left);
    plan.set_shadow_tables(tables.map_err(|(light, error)| shadow_error(light, &error))?, left);
    let memory = memory.with_maps(shadows::bytes(plan.shadow_tables.iter().flatten()));
    memory::check("rendering", memory.total(), options.max_memory)?;
    Ok((plan, memory))
}

/// Footprints keep their pixel rectangles in 16 bits.
fn check_samples(scene: &Scene) -> Result<(), Error> {
    let longest = scene.camera.size[0].max(scene.camera.size[1]);
    let (needed, limit) = (u64::from(longest) * u64::from(scene.render.antialias), u64::from(u16::MAX));
    if needed <= limit {
        return Ok(());
    }
    Err(Error::Limit {
        what: "the longer side of the image".into(),
        needed,
        limit,
        unit: "samples",
        hint: "use a smaller camera.size or render.antialias".into(),
    })
}

/// Depths back into the scene's unit.
fn restore_depths(layers: &mut Layers, exponent: i32) {
    let scale = libm::exp2(f64::from(exponent)) as f32;
    for (name, data) in &mut layers.images {
        if let (true, LayerData::Scalar(depth)) = (name.starts_with("depth."), data) {
            depth.iter_mut().for_each(|d| *d *= scale);
        }
    }
}
