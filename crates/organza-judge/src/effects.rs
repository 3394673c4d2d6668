//! The change that each effect of a scene makes to the picture, and its time: the scene is drawn with the effect and
//! without it.
//!
//! ```text
//! scene as planned ─► picture ◄── compared ──► picture with one effect switched the other way
//!                        ▲
//!                        └────── compared ──► picture with everything that was left out
//! ```
//!
//! The plan of a scene leaves out what it has proved to be invisible, by bounds. This module measures the changes that
//! the plan bounded.

use organza::plan::{Effect, Plan};
use organza::scene::{EffectKind, Scene};
use organza::{Context, Error, Files, Progress, RenderOptions, pass};
use reference::metrics::{Display, Image};

/// A picture is drawn again until so many seconds have gone, at most [`REPEATS`] times; the fastest counts, as other programs only slow it down.
const LONG_ENOUGH: f64 = 0.5;
/// Exit codes of what a user can put right.
const USAGE: u8 = 2;
const INPUT: u8 = 3;
/// Most times that a picture is drawn.
const REPEATS: usize = 3;

/// A picture with one effect switched against the plan, compared with the planned picture.
#[derive(Debug, Clone, PartialEq)]
pub struct EffectChange {
    /// Its name.
    pub name: String,
    /// Largest difference of a displayed channel between the pictures with it and without it, 0 to 1.
    pub largest: f64,
    /// Share of pixels whose displayed channels differ by more than the tolerance of the scene, 0 to 1.
    pub beyond_tolerance: f64,
    /// Seconds of drawing with it, loading and conversion left out.
    pub seconds_with: f64,
    /// Seconds of drawing without it.
    pub seconds_without: f64,
}

/// Every effect that can be switched, measured.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Measured {
    /// Seconds of drawing as planned, loading and conversion left out.
    pub seconds: f64,
    /// Effects that could be switched, in the plan's order.
    pub changes: Vec<EffectChange>,
    /// Effects that could not be switched, with the reason.
    pub fixed: Vec<FixedEffect>,
    /// Largest difference of a displayed channel between the picture as planned and the one with everything that it leaves out; `None` where it
    /// leaves nothing out that could be switched on.
    pub left_out_together: Option<f64>,
    /// The splats that got light; `None` where no technique draws splats that were lit before.
    pub lit: Option<LitSplats>,
    /// Names of the passes that drew the picture as planned.
    pub passes: Vec<String>,
}

/// By how much a displayed value may differ beyond a bound: splats of a scene without an object are rounded about another origin.
const ROUNDING: f64 = 1e-5;

impl Measured {
    /// Contradictions between the pictures and their plan, a sentence each: an effect that changes a pixel by more than its bound, effects that
    /// were left out and change one by more than all of their bounds together, a pass that the plan does not have.
    ///
    /// A plan that was proved has none.
    pub fn contradictions(&self, plan: &Plan) -> Vec<String> {
        let percent = |share: f64| format!("{:.2} %", 100.0 * share);
        let effect = |name: &str| plan.effects.iter().find(|effect| effect.name == name);
        let mut found = Vec::new();
        for change in &self.changes {
            let bound = effect(&change.name).and_then(|effect| effect.bound.number());
            if let Some(bound) = bound.filter(|bound| change.largest > bound + ROUNDING) {
                let changes = percent(change.largest);
                let bound = percent(bound);
                found.push(format!("`{}` changes a pixel by {changes}, beyond its bound of {bound}", change.name));
            }
        }
        // An effect that no scene can switch is in neither picture.
        let is_switched = |effect: &&Effect| effect.kind.is_none_or(|kind| kind.fixed_because().is_none());
        let left_out = plan.effects.iter().filter(|effect| !is_simulated(effect) && !effect.is_absent);
        let left_out = left_out.filter(is_switched);
        let sum: Option<f64> = left_out.map(|effect| effect.bound.number()).sum();
        if let (Some(change), Some(sum)) = (self.left_out_together, sum)
            && change > sum + ROUNDING
        {
            let changes = percent(change);
            let bounds = percent(sum);
            found.push(format!("all that is left out changes a pixel by {changes}, beyond bounds of {bounds}"));
        }
        let is_planned = |name: &&String| plan.passes.iter().any(|pass| pass.name == **name);
        let unasked = self.passes.iter().filter(|name| !is_planned(name));
        found.extend(unasked.map(|name| format!("the pass `{name}` runs, which the plan does not have")));
        found
    }
}

/// The splats of a picture that got light. The others are seen nowhere: opaque ones or finished pixels hide them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct LitSplats {
    /// The number of splats that got light.
    pub lit: u64,
    /// The number of splats in view.
    pub in_view: u64,
}

/// An effect that was not switched.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct FixedEffect {
    /// Its name.
    pub name: String,
    /// Why not.
    pub reason: String,
}

/// An effect and whether it is on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Switch {
    /// Its name, as plans have it.
    pub name: String,
    /// Whether it is simulated.
    pub is_on: bool,
}

/// Draws a scene as planned and with each of its effects switched the other way; `switched` returns the scene with the given effects
/// switched.
///
/// An effect counts as fixed if `switched` refuses it with an error of input or usage.
///
/// # Errors
/// Those of drawing the scene, and of `switched` but for the above.
pub fn measure(
    plan: &Plan,
    scene: &Scene,
    switched: &dyn Fn(&[Switch]) -> Result<Scene, Error>,
    options: &RenderOptions,
    progress: &Progress,
) -> Result<Measured, Error> {
    let pictures = Pictures { options, progress };
    let (settled, _) = organza::settled(scene, Context { files: &Files::default(), options, progress })?;
    let switched = |switches: &[Switch]| switched(switches).map(|other| by_techniques_of(&settled, other));
    let count = plan.effects.len() + 2;
    progress.plan((0..count).map(|rank| (stage(plan, rank), 1.0)));
    progress.begin(&stage(plan, 0));
    let planned = pictures.draw(scene)?;
    let mut measured =
        Measured { seconds: planned.seconds, lit: planned.lit, passes: planned.passes.clone(), ..Measured::default() };
    let mut left_out = Vec::new();
    for (rank, effect) in plan.effects.iter().enumerate() {
        progress.begin(&stage(plan, rank + 1));
        let switch = Switch { name: effect.name.clone(), is_on: !is_simulated(effect) };
        if switch.is_on && switch.name == EffectKind::Scatter.word() {
            let reason = "another technique draws it, which differs in more than that".to_owned();
            measured.fixed.push(FixedEffect { name: switch.name, reason });
            continue;
        }
        match switched(std::slice::from_ref(&switch)) {
            Ok(other) => {
                let drawn = pictures.draw(&other)?;
                measured.changes.push(planned.beside(&drawn, &switch, scene.render.tolerance));
                left_out.extend(switch.is_on.then_some(switch));
            }
            Err(error) => {
                let reason = why_not(error)?;
                measured.fixed.push(FixedEffect { name: switch.name, reason });
            }
        }
    }
    progress.begin(&stage(plan, count - 1));
    if !left_out.is_empty() {
        let whole = pictures.draw(&switched(&left_out)?)?;
        measured.left_out_together = Some(largest_difference(&planned.image, &whole.image));
    }
    Ok(measured)
}

/// The scene drawn by the techniques of another one that differs in effects alone: a technique that is chosen anew errs otherwise.
fn by_techniques_of(settled: &Scene, mut scene: Scene) -> Scene {
    let scattering = EffectKind::Scatter;
    let is_of_scattering = scene.render.effects.iter().any(|effect| effect.kind == scattering);
    if !is_of_scattering {
        scene.render.sheets = settled.render.sheets;
    }
    scene.render.technique = settled.render.technique;
    for (object, settled) in scene.objects.iter_mut().zip(&settled.objects) {
        object.technique = settled.technique;
    }
    scene
}

/// Whether the picture as planned shows it.
fn is_simulated(effect: &Effect) -> bool {
    effect.called_for && !effect.is_lacking
}

/// The stages of progress: the picture as planned, one for each effect, and the one with all that was left out.
fn stage(plan: &Plan, rank: usize) -> String {
    match rank.checked_sub(1) {
        None => "as planned".to_owned(),
        Some(effect) => plan
            .effects
            .get(effect)
            .map_or_else(|| "with all that was left out".to_owned(), |effect| format!("{} the other way", effect.name)),
    }
}

/// The reason of a refusal; other errors go on.
fn why_not(error: Error) -> Result<String, Error> {
    if matches!(error.exit_code(), USAGE | INPUT) { Ok(error.to_string()) } else { Err(error) }
}

/// Draws pictures with a clock, as `organza render` does.
struct Pictures<'a> {
    options: &'a RenderOptions,
    progress: &'a Progress,
}

/// A displayed picture and its time.
struct Drawn {
    image: Image<Display>,
    seconds: f64,
    lit: Option<LitSplats>,
    passes: Vec<String>,
}

impl Pictures<'_> {
    fn draw(&self, scene: &Scene) -> Result<Drawn, Error> {
        let mut drawn = self.draw_once(scene)?;
        let mut spent = drawn.seconds;
        for _ in 1..REPEATS {
            if spent >= LONG_ENOUGH {
                break;
            }
            let again = self.draw_once(scene)?;
            spent += again.seconds;
            drawn.seconds = drawn.seconds.min(again.seconds);
        }
        Ok(drawn)
    }

    fn draw_once(&self, scene: &Scene) -> Result<Drawn, Error> {
        self.progress.enter();
        let render = organza::render(scene, self.options, self.progress)?;
        self.progress.leave();
        let beauty =
            render.layers.rgb("beauty").ok_or_else(|| Error::Internal("a render has no beauty layer".into()))?;
        let image = Image::from_layer(render.layers.size, beauty).map_err(|e| Error::Internal(e.to_string()))?;
        let is_drawing = |name: &str| name != pass::READ && name != pass::CONVERT;
        let drawing = render.cost.stages.iter().filter(|stage| is_drawing(&stage.name));
        let seconds = drawing.map(|stage| stage.seconds).sum();
        let stages = |pass: &'static str| render.cost.stages.iter().filter(move |stage| stage.name == pass);
        let lit = stages(pass::SHADE).map(|stage| stage.items_in).reduce(|sum, items| sum + items);
        let in_view = stages(pass::PROJECT).map(|stage| stage.items_out).reduce(|sum, items| sum + items);
        let lit = lit.zip(in_view).map(|(lit, in_view)| LitSplats { lit, in_view });
        let passes = render.cost.stages.iter().map(|stage| stage.name.clone()).collect();
        Ok(Drawn { image: image.display(scene.render.exposure), seconds, lit, passes })
    }
}

impl Drawn {
    /// The picture as planned beside the one with an effect switched.
    fn beside(&self, other: &Self, switch: &Switch, tolerance: f64) -> EffectChange {
        let pixels = self.image.pixels();
        let beyond = pixels.iter().zip(other.image.pixels()).filter(|(a, b)| difference(a, b) > tolerance).count();
        let (with, without) = if switch.is_on { (other, self) } else { (self, other) };
        EffectChange {
            name: switch.name.clone(),
            largest: largest_difference(&self.image, &other.image),
            beyond_tolerance: beyond as f64 / pixels.len().max(1) as f64,
            seconds_with: with.seconds,
            seconds_without: without.seconds,
        }
    }
}

fn largest_difference(image: &Image<Display>, other: &Image<Display>) -> f64 {
    image.pixels().iter().zip(other.pixels()).map(|(a, b)| difference(a, b)).fold(0.0, f64::max)
}

/// Largest difference of a channel of two pixels.
fn difference(pixel: &[f64; 3], other: &[f64; 3]) -> f64 {
    pixel.iter().zip(other).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}
