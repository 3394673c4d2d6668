//! The table of techniques: what each states before anything is converted, and how it begins. Nothing else in this crate knows their names.
//!
//! A technique folds translucent objects into an accumulator, front to back: all at once, or range by range of depths, in turns
//! with other techniques. A result that has no order, such as an average of random sets, fills a separate segment, which
//! [`Accumulator::append`] puts behind the accumulated one. Opaque surfaces, light and shadows are the frame's.
//!
//! Every technique fills the effects that shading gives; layers that one alone fills [`Technique::own_layers`] names, so that a scene
//! is refused, at its line, where it asks another for them.

mod estimates;
pub(crate) mod particles;
pub(crate) mod points;
pub(crate) mod reference;
pub(crate) mod sheets;
pub(crate) mod surfels;

pub(crate) use crate::cost::OwnWork;
use crate::cost::{Count, Item, Prediction, Translucent, samples};
use crate::form::{DRAWN, Form};
use crate::frame::matter::{CarriesLight, Matter};
use crate::frame::{Frame, OpaqueEngines};
use crate::load::Loaded;
use crate::pass;
use crate::plan::{Estimate, Plan, PlannedSetting};
use crate::scene::{LightPoint, RenderSettings, Scene, Technique};
use crate::stage;
use crate::statistics::{MediumFacts, ObjectStatistics, SourceFacts};
use crate::{CostRecord, Error, Layers, Progress, RenderOptions};
pub(crate) use estimates::{Asked, estimates};
pub(crate) use particles::{Checkpoint, Kept};
use splat_core::raster::{GlassImage, OpaqueImage};
use splat_core::{Accumulator, Camera};
use std::ops::Range;

/// The form in which a technique takes an object, and why.
type FormOf = fn(&ObjectStatistics) -> (Form, &'static str);

/// What a technique states.
pub(crate) fn row(technique: Technique) -> &'static Row {
    let known = TABLE.iter().find(|row| row.technique == technique);
    known.expect("invariant: every technique of a settled scene has a row")
}

impl<'a> Frame<'a> {
    /// A frame by the processor, with nothing made yet. `plan` is that of [`plan_loaded`](crate::plan_loaded) for the same scene.
    pub fn new(scene: &'a Scene, loaded: &'a Loaded, plan: &'a Plan, progress: &'a Progress) -> Self {
        let engines = OpaqueEngines { discs: surfels::opaque, polygons: sheets::opaque_polygons };
        Self::with_engines(scene, loaded, plan, progress, engines)
    }
}

/// What a technique states.
pub(crate) struct Row {
    /// As scenes name it.
    pub(crate) technique: Technique,
    /// Whether `auto` may give it an object: it draws the object, and all that it is known to err by has an estimate.
    pub(crate) is_offered: fn(&Asked<'_>) -> bool,
    /// What it errs by where it draws an object, beside what other fields of the row tell.
    pub(crate) estimates: fn(&Asked<'_>) -> Vec<Estimate>,
    /// Counted work on a medium that it draws from its own data, before that is converted, with a camera whose pixels are samples.
    pub(crate) foresees: fn(&Asked<'_>, &Camera) -> OwnWork,
    /// Bytes that it takes at most for such media, about, beside what all techniques take.
    pub(crate) foresees_bytes: fn(&Scene, &RenderSettings, &[MediumFacts]) -> u64,
    /// What becomes of translucent things, in words.
    pub(crate) how: &'static str,
    /// What it does where extinction differs by channel, in words; `None` where that goes without saying.
    pub(crate) by_channel: Option<&'static str>,
    /// The form in which it takes an object, and why; `None` for splats, whatever an object is.
    pub(crate) form: Option<FormOf>,
    /// Whether what it takes of objects is the same by the settings of one render and of another.
    pub(crate) makes_alike: fn(&RenderSettings, &RenderSettings) -> bool,
    /// Whether triangles stay what they are.
    pub(crate) polygons: bool,
    /// Optical depth of a spacing up to which a box or a ball of a medium that it draws from its own data shows no dark frames along its edges; `None`
    /// for any.
    pub(crate) thickest_body: Option<f32>,
    /// What it makes of splats, in words.
    pub(crate) of_splats: &'static str,
    /// Whether it mirrors and bends light where surfaces bound matter, and that absorbs; or what to do so that this is shown.
    pub(crate) bends: fn(&Scene) -> Result<(), &'static str>,
    /// Whether light falls on bumps; or what to do so that it does.
    pub(crate) bumps: fn(&Scene) -> Result<(), &'static str>,
    /// Whether it draws translucent splats as they are: they get footprints and radiance.
    pub(crate) draws_splats: bool,
    /// Whether 3D Gaussians are seen as such.
    pub(crate) gaussians: bool,
    /// Whether rays meet the opaque discs of its objects exactly; else the frame draws these as splats.
    pub(crate) meets_discs: bool,
    /// Whether splats whose every pixel lies behind opaque ones count for nothing in it, so that they need no radiance.
    pub(crate) skips_hidden: bool,
    /// Whether translucent splats behind finished pixels get no light either, where it draws a picture alone.
    pub(crate) skips_behind_finished: bool,
    /// The pass that [`Fold::prepare`] and [`Fold::check`] run, before all others, where something is its own.
    pub(crate) prepares: Option<&'static str>,
    /// Counted work of that pass.
    pub(crate) counts_preparing: fn(&Scene, &Loaded) -> Vec<Count>,
    /// Its passes; the last one comes behind opaque surfaces, those before it come before footprints.
    pub(crate) steps: &'static [Step],
    /// Whether a device may draw what it draws.
    pub(crate) by_device: bool,
    /// Whether its picture is an average of random sets, which a checkpoint can keep.
    pub(crate) is_random: bool,
    /// Bytes that it takes beside what all techniques take.
    pub(crate) bytes: fn(&Matter<'_>, &[LightPoint], colored_extinction: bool, &RenderOptions) -> u64,
    /// How it carries light through what it draws by itself, where settings ask for that; `None` where shadow maps have all light.
    pub(crate) carries: fn(&RenderSettings) -> Option<CarriesLight>,
    /// How a scene asks it for light that media scatter again and again; `None` where it has none.
    pub(crate) scatters_by: Option<&'static str>,
    /// Settings with each of which it carries light through media, if it draws alone all that is translucent; none where it cannot, which facts of the media
    /// tell, or a scene states otherwise. `auto` may take one of them with the technique.
    pub(crate) alone: fn(&Scene, &SourceFacts) -> Vec<RenderSettings>,
    /// Settings of its own that have a part in a planned picture and that a scene may leave to the plan.
    pub(crate) settings: fn(&Scene, &Loaded, &Plan) -> Vec<PlannedSetting>,
    /// Adds effects and passes of its own to the plan of a scene that it draws, and takes out what it does not need.
    pub(crate) plans: fn(&Scene, &Loaded, &mut Plan),
    /// What repeats its last pass, in words; empty where nothing does.
    pub(crate) repeats: fn(&Scene) -> String,
    /// Counted work of grouping so many splats, where it draws some in groups.
    pub(crate) counts_groups: fn(&Scene, f64) -> Vec<Count>,
    /// Begins a frame.
    pub(crate) begin: for<'a> fn(&'a Frame<'a>) -> Box<dyn Fold + 'a>,
}

/// One pass of a technique.
pub(crate) struct Step {
    /// Its name in plans and cost records.
    pub(crate) pass: &'static str,
    /// Its name for those who wait.
    pub(crate) stage: &'static str,
    /// Its counted work.
    pub(crate) counts: fn(&Scene, &Translucent) -> Vec<Count>,
}

/// A technique at work on a frame.
pub(crate) trait Fold {
    /// Makes what it draws its own objects from, once, before anything is drawn.
    fn prepare(&mut self, _: &mut Session<'_>, _: &mut CostRecord) -> Result<(), Error> {
        Ok(())
    }

    /// Refuses what its fold would refuse, without drawing.
    fn check(&mut self, _: &RenderOptions, _: &mut CostRecord) -> Result<(), Error> {
        Ok(())
    }

    /// Counted work on objects that are drawn from their own data, in these ranges of depth.
    fn own_work(&self, _: &[Range<f32>]) -> OwnWork {
        OwnWork::default()
    }

    /// Folds what is its own at view depths in `range`, behind all that the accumulator holds.
    fn fold(
        &mut self,
        range: Range<f32>,
        into: &mut Accumulator,
        session: &mut Session<'_>,
        cost: &mut CostRecord,
    ) -> Result<(), Error>;

    /// Light that it has mirrored and bent, once it has folded all depths.
    fn glass(&mut self) -> Option<GlassImage> {
        None
    }

    /// Adds the layers that it alone can make to a finished picture, which it drew by itself.
    fn finish(&mut self, _: &mut Finished<'_>) {}
}

/// All depths.
pub(crate) const EVERYWHERE: Range<f32> = f32::NEG_INFINITY..f32::INFINITY;

/// What a render leaves for the next, takes from the last, and tells.
pub(crate) struct Session<'s> {
    pub(crate) options: &'s RenderOptions,
    /// Where sums of random sets are kept on disk.
    pub(crate) checkpoint: Option<&'s mut Checkpoint>,
    /// Sets that serve all frames of an animation.
    pub(crate) kept: Option<&'s mut Kept>,
    pub(crate) warnings: &'s mut Vec<String>,
    /// Sets that were averaged, where some were.
    pub(crate) sets: Option<Sets>,
    /// What was predicted of the drawing.
    pub(crate) predicted: Prediction,
    /// Whether a long drawing is announced: one of many for a comparison is not.
    pub(crate) announces: bool,
}

/// Sets of particles in a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Sets {
    /// Sets that were averaged.
    pub averaged: u32,
    /// Number of requested sets.
    pub asked: u32,
    /// Whether it was cancelled before there were enough.
    pub interrupted: bool,
}

/// A finished picture.
pub(crate) struct Finished<'f> {
    pub(crate) layers: Layers,
    pub(crate) opaque: Option<&'f OpaqueImage>,
}

/// Every technique, the preferred first; each states where it differs from `points`.
pub(crate) static TABLE: [Row; 5] = [
    POINTS,
    Row {
        technique: Technique::Particles,
        is_offered: |_| false,
        estimates: |asked| estimates::of_sets(Technique::Particles, asked),
        how: "become particles",
        by_channel: Some("a particle hides each channel by chance"),
        form: Some(particles::form),
        makes_alike: |a, b| {
            a.particles.surface_sampler == b.particles.surface_sampler
                && a.particles.volume_sampler == b.particles.volume_sampler
        },
        of_splats: "particles are sampled from them",
        draws_splats: false,
        gaussians: false,
        prepares: Some(pass::SAMPLERS),
        counts_preparing: particles::counts_preparing,
        skips_behind_finished: false,
        steps: &[Step { pass: pass::PARTICLES, stage: stage::PARTICLES, counts: particles::counts }],
        is_random: true,
        settings: |_, _, _| Vec::new(),
        repeats: |scene| format!("{} sets", scene.render.particles.repeat_level),
        bytes: |matter, _, colored, options| particles::bytes(matter.scene, colored, options),
        begin: particles::begin,
        ..POINTS
    },
    Row {
        technique: Technique::Sheets,
        is_offered: |asked| estimates::suits_triangles(Technique::Sheets, asked),
        estimates: |asked| estimates::of_slabs(Technique::Sheets, asked),
        foresees: sheets::foresees,
        foresees_bytes: sheets::foresees_bytes,
        how: "are composited in slabs, volumes classified after reconstruction",
        // Slabs, and not splats, end at what is opaque.
        skips_hidden: false,
        form: Some(sheets::form),
        makes_alike: |a, b| a.sheets.slicing == b.sheets.slicing,
        thickest_body: Some(4.0),
        polygons: true,
        by_device: false,
        skips_behind_finished: false,
        steps: &[Step { pass: pass::SHEETS, stage: stage::SHEETS, counts: sheets::counts }],
        bytes: sheets::bytes,
        carries: sheets::carries,
        scatters_by: Some(
            "technique = \"sheets\" with [render.sheets] slicing = \"half_vector\" and scattering = \"forward_and_back\"",
        ),
        settings: sheets::settings,
        plans: sheets::plans,
        alone: sheets::alone,
        begin: sheets::begin,
        ..POINTS
    },
    Row {
        technique: Technique::Surfels,
        is_offered: surfels::is_offered,
        estimates: |asked| estimates::of_one_order(Technique::Surfels, asked),
        how: "are discs, which are averaged in each layer of a surface, and layers are composited in order",
        bends: |_| Ok(()),
        bumps: surfels::bumps,
        gaussians: false,
        meets_discs: true,
        settings: |_, _, _| Vec::new(),
        skips_hidden: false,
        by_device: false,
        skips_behind_finished: false,
        steps: &[SORT, Step { pass: pass::SURFELS, stage: stage::SURFELS, counts: surfels::counts }],
        bytes: surfels::bytes,
        plans: surfels::plans,
        counts_groups: surfels::group_counts,
        begin: surfels::begin,
        ..POINTS
    },
    Row {
        technique: Technique::Reference,
        is_offered: |_| false,
        estimates: |asked| estimates::of_discs(Technique::Reference, asked),
        how: "are sorted pixel by pixel, exactly, which is slow",
        // Its depths are rounded otherwise than those of the opaque ones.
        skips_hidden: false,
        by_device: false,
        skips_behind_finished: false,
        steps: &[Step {
            pass: pass::REFERENCE,
            stage: stage::REFERENCE,
            counts: |_, all| vec![Count::new(Item::ExactFragment, all.fragments)],
        }],
        bytes: |matter, _, _, _| reference::bytes(matter.scene),
        settings: |_, _, _| Vec::new(),
        begin: reference::begin,
        ..POINTS
    },
];

const SORT: Step =
    Step { pass: pass::SORT, stage: stage::SORT, counts: |_, all| vec![Count::new(Item::SortedSplat, all.splats)] };

const FOLD: Step = Step { pass: pass::SPLAT, stage: stage::COMPOSITE, counts: composited };

/// Splats whose fragments are composited, range by range.
fn composited(scene: &Scene, translucent: &Translucent) -> Vec<Count> {
    vec![
        Count::new(Item::BlendedFragment, translucent.fragments),
        Count::new(Item::BlendedSplat, translucent.splats),
        Count::new(Item::RangeSample, samples(scene) * translucent.ranges),
    ]
}

const POINTS: Row = Row {
    technique: Technique::Points,
    is_offered: |_| true,
    estimates: |asked| estimates::of_discs(Technique::Points, asked),
    foresees: |_, _| OwnWork::default(),
    foresees_bytes: |_, _, _| 0,
    how: "are composited in order",
    by_channel: None,
    form: None,
    makes_alike: |_, _| true,
    polygons: false,
    thickest_body: None,
    of_splats: DRAWN,
    bends: |_| Err("use `surfels`"),
    bumps: |_| Err("use `surfels`"),
    draws_splats: true,
    gaussians: true,
    meets_discs: false,
    skips_hidden: true,
    skips_behind_finished: true,
    prepares: None,
    counts_preparing: |_, _| Vec::new(),
    steps: &[SORT, FOLD],
    by_device: true,
    is_random: false,
    bytes: |_, _, _, _| 0,
    carries: |_| None,
    scatters_by: None,
    alone: |_, _| Vec::new(),
    settings: points::settings,
    plans: |_, _, _| {},
    repeats: |_| String::new(),
    counts_groups: |_, _| Vec::new(),
    begin: points::begin,
};
