//! Draws one scene with every ordering, and compares each picture with the exact order of every pixel.
//!
//! Splats are lit once. Translucent splats are then composited in each order, without a cutoff. The reference sorts the fragments of
//! every pixel by their depth, in f64. Opaque surfaces enter as in any render. So the order is all that differs. The technique
//! `particles` stands beside them: it orders nothing; here its particles are sampled from the same splats, and its pictures of several
//! seeds are judged by the same truth. So do sheets of several thicknesses, each with how much it pops as the view turns. The layer
//! separations of `surfels` stand beside them too; their reference is another one, see [`Comparison::layers`].

mod layers;
mod report;
mod sheets;
mod sorter;

pub use report::{OrdersReport, write};

use crate::accuracy::{SEEDS, Sampled};
use hbsort::Thickness;
use organza::scene::{LayerChoice, ParticlesSettings, Scene, Technique};
use organza::{
    Context, CostRecord, Error, Files, Frame, Loaded, Planned, Progress, RenderOptions, Shaded, draw_loaded, load,
    plan_loaded,
};
use reference::metrics::{Disorder, Image, Linear, Rays};
use reference::statistics::Spread;
use reference::{Input, Order};
use sorter::{Ordering, Sorter};
use splat_core::{Camera, Direction, Layers, SliceOrder};
use std::time::Instant;

/// The amount of work that a comparison may take.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Options {
    /// A smaller picture, fewer repeats, sets, sheets and frames.
    pub quick: bool,
}

impl Options {
    /// Longest side of the picture, pixels, unless the user has requested a size.
    pub fn longest_side(&self) -> u32 {
        if self.quick { 120 } else { 240 }
    }

    /// Timed repeats of each ordering.
    fn repeats(&self) -> usize {
        if self.quick { 2 } else { 5 }
    }

    /// Sets of particles that are averaged.
    fn sets(&self) -> u32 {
        if self.quick { 8 } else { 32 }
    }

    /// Thicknesses of sheets, voxels.
    fn voxels(&self) -> &'static [u32] {
        if self.quick { &[1, 8] } else { &[1, 2, 4, 8] }
    }

    /// Steps in a turn that looks for what pops.
    fn steps(&self) -> i32 {
        if self.quick { 2 } else { 6 }
    }
}

/// Stages.
const LOAD: &str = "first look";
const ORDERS: &str = "orders";
const TRUTH: &str = "exact truth";
const SHEETS: &str = "sheets";
const SETS_OF_PARTICLES: &str = "particles";
const LAYERS: &str = "layers";

/// About as many rays are looked at for wrong pairs.
const RAYS: f64 = 20_000.0;

/// Slices so many times thicker than the scene's own.
const THICKER: [f64; 4] = [1.0, 8.0, 64.0, 512.0];

/// The picture of one ordering, with its errors, its time and its memory.
#[derive(Debug, Clone, PartialEq)]
pub struct Ordered {
    /// Name of the ordering.
    pub name: String,
    /// Slice thickness, world units, for those that have one.
    pub thickness: Option<f64>,
    /// The picture.
    pub image: Image<Linear>,
    /// Wrong pairs and backtracks, lengths in world units; `None` where nothing is ordered.
    pub disorder: Option<Disorder>,
    /// Seconds that putting the splats in order took.
    pub seconds: Option<Spread>,
    /// Bytes of the order and of what making it took.
    pub bytes: u64,
    /// Bias and noise over the seeds of a random technique, with the truth as limit.
    pub sampled: Option<Sampled>,
    /// Whether it averages the discs of a layer, and is judged by [`Comparison::layers`].
    pub of_layers: bool,
    /// Popping: the largest step of a pixel between frames 0.1° apart, over that of fragments in exact order. Of sheets and of the order of centres;
    /// `None` of others, and where nothing changes.
    pub pop: Option<f64>,
}

impl Ordered {
    /// A picture of which nothing else is known.
    fn new(name: String, image: Image<Linear>) -> Self {
        let thickness = None;
        let disorder = None;
        let seconds = None;
        let sampled = None;
        let pop = None;
        Self { name, thickness, image, disorder, seconds, bytes: 0, sampled, of_layers: false, pop }
    }
}

/// Pictures by every ordering, and the truth.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// The outcomes of the orderings.
    pub orderings: Vec<Ordered>,
    /// Fragments sorted per pixel, in f64.
    pub truth: Image<Linear>,
    /// Seconds that the truth took.
    pub truth_seconds: f64,
    /// Translucent splats that were ordered.
    pub splats: u64,
    /// Why `particles`, which need no order, cannot show the scene; `None` where they do.
    pub without_particles: Option<String>,
    /// The discs of each layer averaged, and all layers composited, in f64; or the reason why the scene has no
    /// layers.
    pub layers: Result<Image<Linear>, String>,
    /// The stage that was interrupted, behind which nothing was compared; `None` where all was.
    pub interrupted: Option<&'static str>,
}

/// Draws a scene by every ordering. `scene.render` counts but for what concerns order, cut-offs and layers.
///
/// # Errors
/// As [`organza::render`]; [`Error::Input`] for a scene without translucent splats; [`Error::Cancelled`] before the truth is known: a
/// comparison that is interrupted after that has what was drawn.
pub fn compare(
    scene: &Scene,
    effort: &Options,
    options: &RenderOptions,
    progress: &Progress,
) -> Result<Comparison, Error> {
    let scene = by_slices_alone(scene);
    progress.plan([(LOAD, 2.0), (ORDERS, 8.0), (TRUTH, 8.0), (SHEETS, 8.0), (SETS_OF_PARTICLES, 8.0), (LAYERS, 8.0)]);
    progress.begin(LOAD);
    progress.enter();
    let loaded = load(&scene, Context { files: &Files::default(), options, progress })?;
    let plan = plan_loaded(&scene, &loaded, options)?;
    let frame = Frame::new(&scene, &loaded, &plan, progress).with_hidden();
    let mut cost = CostRecord::default();
    let shaded = frame.shaded(&mut cost)?;
    let sorter = Sorter {
        loaded: &loaded,
        camera: frame.camera,
        translucent: frame.translucent(Technique::Points).to_vec(),
        margin_px: frame.filter_reach_px(),
        repeats: effort.repeats(),
    };
    let auto = sorter.slices(Thickness::Auto, false)?;
    if auto.input_from_sorted.is_empty() {
        let message = "expected translucent splats in view, found none: there is nothing to order";
        return Err(Error::input("scene", message, ""));
    }
    let auto = auto.thickness;
    let rays = rays(&exact_input(&loaded, &frame.camera, shaded, frame.raster_params().resampling_sigma_px));
    let world = libm::exp2(f64::from(loaded.exponent));
    let sliced = THICKER.map(|f| Ordering::Slices(f * auto));
    let planned =
        [&[Ordering::Exact][..], &sliced, &[Ordering::Centre, Ordering::Distance, Ordering::Unsorted]].concat();
    progress.leave();
    let mut draw = |ordering: Ordering| {
        progress.begin(&ordering.name(auto));
        let (order, seconds, bytes) = sorter.timed(ordering)?;
        progress.enter();
        let mut accumulator = frame.accumulator();
        frame.composite(&order, &mut accumulator, &mut cost)?;
        let layers = frame.finish(&accumulator, None, &mut cost)?;
        progress.leave();
        let mut disorder = rays.disorder(&ranks(&order, loaded.cloud.len()));
        disorder.worst_backtrack *= world;
        progress.tick(0).map_err(|_| Error::Cancelled)?;
        let name = ordering.name(auto);
        let thickness = ordering.thickness().map(|t| t * world);
        let image = image(&layers)?;
        let disorder = Some(disorder);
        Ok::<_, Error>(Ordered { thickness, disorder, seconds, bytes, ..Ordered::new(name, image) })
    };
    let stages = planned.iter().map(|ordering| (ordering.name(auto), 1.0));
    let drawn = progress.within(ORDERS, stages, || planned.iter().map(|o| draw(*o)).collect::<Result<Vec<_>, _>>());
    let orderings = drawn?;
    progress.begin(TRUTH);
    let start = Instant::now();
    let truth = by_technique(Technique::Reference, &scene, &loaded, options, progress)?;
    let truth_seconds = start.elapsed().as_secs_f64();
    let splats = sorter.translucent.len() as u64;
    let mut comparison = Comparison {
        orderings,
        truth,
        truth_seconds,
        splats,
        without_particles: None,
        layers: Err("interrupted".into()),
        interrupted: None,
    };
    let mut reached = SHEETS;
    let mut finish = |comparison: &mut Comparison| {
        progress.begin(SHEETS);
        let splats = sheets::Splats::new(&scene, &loaded, &plan, &sorter.translucent);
        sheets::ways(&splats, &frame, &Ordering::Centre.name(auto), effort, &mut comparison.orderings, progress)?;
        reached = SETS_OF_PARTICLES;
        progress.begin(SETS_OF_PARTICLES);
        let unordered = particles(&scene, &loaded, &comparison.truth, effort, options, progress)?;
        comparison.without_particles = unordered.as_ref().err().cloned();
        comparison.orderings.extend(unordered);
        reached = LAYERS;
        progress.begin(LAYERS);
        comparison.layers = layers::ways(&scene, &loaded, &mut comparison.orderings, options, progress)?;
        Ok(())
    };
    match finish(&mut comparison) {
        Err(Error::Cancelled) => comparison.interrupted = Some(reached),
        finished => finished?,
    }
    Ok(comparison)
}

/// The scene by points without cut-offs and layers, front to back, in the order of slices.
fn by_slices_alone(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    scene.render.technique = Technique::Points;
    // All of it is put in order, also what the scene has drawn otherwise.
    scene.objects.iter_mut().for_each(|o| o.technique = None);
    let points = &mut scene.render.points;
    (points.transmittance_cutoff, points.first_slices) = (0.0, None);
    (points.exact, points.direction) = (false, Direction::FrontToBack);
    scene.render.layers = LayerChoice::default();
    scene
}

fn exact_input<'a>(loaded: &'a Loaded, camera: &'a Camera, shaded: &'a Shaded, sigma_px: f32) -> Input<'a> {
    Input {
        cloud: &loaded.cloud,
        camera,
        footprints: &loaded.footprints,
        materials: &loaded.materials,
        values: &shaded.values,
        channels: shaded.channels,
        resampling_sigma_px: sigma_px,
        order: Order::Fragment,
    }
}

/// Rays that are looked at, of all pixels.
fn rays(input: &Input<'_>) -> Rays {
    let pixels = f64::from(input.camera.size[0]) * f64::from(input.camera.size[1]);
    Rays::new(input, (pixels / RAYS).sqrt().ceil() as usize)
}

/// The picture of a loaded scene by one technique.
fn by_technique(
    technique: Technique,
    scene: &Scene,
    loaded: &Loaded,
    options: &RenderOptions,
    progress: &Progress,
) -> Result<Image<Linear>, Error> {
    let mut scene = scene.clone();
    scene.render.technique = technique;
    let plan = plan_loaded(&scene, loaded, options)?;
    progress.enter();
    let layers =
        draw_loaded(&Planned { scene: &scene, loaded, plan: &plan, options }, progress, &mut CostRecord::default())?;
    progress.leave();
    image(&layers)
}

/// Particles of the same splats, which are drawn by depth in any order, with several seeds; or why they cannot show the
/// scene.
fn particles(
    scene: &Scene,
    loaded: &Loaded,
    truth: &Image<Linear>,
    effort: &Options,
    options: &RenderOptions,
    progress: &Progress,
) -> Result<Result<Ordered, String>, Error> {
    let mut scene = scene.clone();
    scene.render.technique = Technique::Particles;
    scene.render.particles =
        ParticlesSettings { repeat_level: effort.sets(), target_error: None, ..scene.render.particles };
    let plan = match plan_loaded(&scene, loaded, options) {
        Err(e @ (Error::Input { .. } | Error::Limit(_) | Error::TooLarge { .. })) => return Ok(Err(e.to_string())),
        planned => planned?,
    };
    let mut images = Vec::new();
    let seed = |k: usize| format!("seed {k} of {SEEDS}");
    progress.enter();
    progress.plan((1..=SEEDS).map(|k| (seed(k), 1.0)));
    for k in 1..=SEEDS {
        progress.begin(&seed(k));
        progress.enter();
        images.push(image(&draw_loaded(
            &Planned { scene: &scene, loaded, plan: &plan, options },
            progress,
            &mut CostRecord::default(),
        )?)?);
        scene.render.seed = scene.render.seed.wrapping_add(1);
        progress.leave();
    }
    progress.leave();
    let sampled = Sampled::new(&images, truth, 0.0, None)?;
    let name = format!("particles, {} sets: none needed", effort.sets());
    Ok(Ok(Ordered { sampled, ..Ordered::new(name, images.swap_remove(0)) }))
}

fn image(layers: &Layers) -> Result<Image<Linear>, Error> {
    let beauty = layers.rgb("beauty").ok_or_else(|| Error::Internal("a render has no beauty layer".into()))?;
    Image::from_layer(layers.size, beauty).map_err(|e| Error::Internal(e.to_string()))
}

/// Splat → place, `u32::MAX` for those that are left out.
fn ranks(order: &SliceOrder, splats: usize) -> Vec<u32> {
    let mut rank = vec![u32::MAX; splats];
    for (place, id) in (0u32..).zip(&order.input_from_sorted) {
        rank[*id as usize] = place;
    }
    rank
}
