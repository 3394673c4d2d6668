//! A finished picture: the bytes that the page shows, and the facts about it.

use crate::depths::PicturePlace;
use crate::desk::Request;
use crate::event::Switch;
use crate::layer_image::{self, Radiance};
use crate::wording;
use organza::cost::Prediction;
use organza::output::{self, Format, Metadata, Params, displayed};
use organza::plan::{Effect, Plan};
use organza::scene::{ColorScale, EffectKind, ScaleNumbers, Scene, SwitchedEffect};
use organza::{Error, Layers, Render, pass};
use serde::{Deserialize, Serialize};
use splat_core::LayerData;
use std::time::Duration;

/// Width and height of a picture, pixels.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Size {
    /// Pixels.
    pub width: u32,
    /// Pixels.
    pub height: u32,
}

impl Size {
    /// That of a scene.
    pub(crate) fn of_scene(scene: &Scene) -> Self {
        let [width, height] = scene.camera.size;
        Self { width, height }
    }

    /// A size with one pixel in the place of `divisor` times `divisor`.
    #[must_use]
    pub(crate) fn divided(self, divisor: u32) -> Self {
        Self { width: self.width.div_ceil(divisor), height: self.height.div_ceil(divisor) }
    }
}

/// The level of detail that a picture is drawn with.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Fewer pixels and splats, for as long as the whole picture takes.
    Coarse,
    /// The picture of `organza render`.
    Whole,
}

/// The facts about a picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts {
    /// Pictures of a session are counted from 1.
    pub number: u64,
    /// The state that it shows; a session's states are counted from 1.
    pub generation: u64,
    /// The level of detail that it is drawn with.
    pub level: Level,
    /// Its size in pixels, smaller than the page's if it is coarse.
    pub size: Size,
    /// Time of drawing, milliseconds by the clock.
    pub ms: f64,
    /// Share of the splats that are drawn, 1 where it is whole.
    pub splat_share: f64,
    /// Name of the technique, or of several.
    pub technique: String,
    /// Sets of particles that were averaged, where it is an average.
    pub sets: Option<u32>,
    /// Warnings about the input, one sentence each.
    pub warnings: Vec<String>,
    /// Data of the files that the picture does not show, one sentence each.
    pub notes: Vec<String>,
    /// The effects of the plan that something in the scene causes.
    pub effects: Vec<EffectRow>,
    /// The passes that were predicted or that ran, in the order of their running.
    pub passes: Vec<PassRow>,
    /// Legends of the objects' colours.
    pub legends: Vec<Legend>,
}

/// A pass of a render with its time.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct PassRow {
    /// Its name, such as `tsm build`.
    pub name: String,
    /// Predicted time by the clock, milliseconds; `None` for one that was not.
    pub predicted_ms: Option<f64>,
    /// Measured time, milliseconds; `None` for one that did not run, as what it makes was kept.
    pub measured_ms: Option<f64>,
}

impl PassRow {
    fn of_render(render: &Render) -> Vec<Self> {
        let threads = rayon::current_num_threads();
        let predicted = render.predicted.passes();
        let mut rows: Vec<Self> = Vec::new();
        let stages = render.cost.stages.iter().map(|stage| (stage.name.as_str(), None, Some(1e3 * stage.seconds)));
        let counted =
            predicted.map(|pass| (pass.pass, Some(1e3 * pass.seconds(&render.predicted.rates, threads)), None));
        for (name, predicted_ms, measured_ms) in counted.chain(stages) {
            let sum = |a: Option<f64>, b: Option<f64>| a.map_or(b, |a| Some(a + b.unwrap_or(0.0)));
            match rows.iter_mut().find(|row| row.name == name) {
                Some(row) => {
                    row.predicted_ms = sum(row.predicted_ms, predicted_ms);
                    row.measured_ms = sum(row.measured_ms, measured_ms);
                }
                None => rows.push(Self { name: name.to_owned(), predicted_ms, measured_ms }),
            }
        }
        rows
    }
}

/// The legend of an object's colours.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Legend {
    /// The object, and the column that gives it its colours.
    pub title: String,
    /// Whether colours between two marks are those between theirs; else each mark stands alone.
    pub is_even: bool,
    /// Numbers, rising, with their colours.
    pub marks: Vec<Mark>,
}

/// A number of a legend.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Mark {
    /// The number.
    pub number: f64,
    /// sRGB as it is displayed.
    pub color: [u8; 3],
    /// Its meaning, such as `ground`.
    pub meaning: Option<String>,
}

/// Marks of a colour map: colours between them are even to the eye.
const MARKS: u32 = 16;

/// Most whole numbers of a legend.
const MOST_NUMBERS: usize = 24;

impl Legend {
    fn new(scale: &ColorScale) -> Self {
        let mark = |number: f64| Mark {
            number,
            color: scale.color(number).map(displayed),
            meaning: scale.meaning(number).map(str::to_owned),
        };
        let title = scale.column.as_ref().map_or_else(|| scale.object.clone(), |by| format!("{}: {by}", scale.object));
        match &scale.numbers {
            ScaleNumbers::Range([low, high]) => {
                let number = |i: u32| low + (high - low) * f64::from(i) / f64::from(MARKS);
                Self { title, is_even: true, marks: (0..=MARKS).map(number).map(mark).collect() }
            }
            ScaleNumbers::Each(numbers) => {
                Self { title, is_even: false, marks: numbers.iter().take(MOST_NUMBERS).copied().map(mark).collect() }
            }
        }
    }
}

/// An effect of the plan, as a row of the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectRow {
    /// Its name, such as `shadow.sun`.
    pub name: String,
    /// A description of its kind, in a few words.
    pub what: &'static str,
    /// Whether it is simulated, or would be if a technique of the scene had it.
    pub called_for: bool,
    /// Whether it is called for and the picture lacks it.
    pub lacking: bool,
    /// Why, or why not.
    pub reason: String,
    /// The most that any displayed pixel, 0 to 1, changes without it; `None` where no bound is known.
    pub bound: Option<f64>,
    /// The authority that decides it: the plan, or the person.
    pub switch: Switch,
    /// Why it cannot be switched; `None` where it can.
    pub fixed: Option<&'static str>,
    /// Predicted milliseconds of its passes, by the clock; `None` for an effect without a separate pass.
    pub predicted_ms: Option<f64>,
    /// Measured milliseconds of its passes; `None` also where what they make was kept.
    pub measured_ms: Option<f64>,
    /// Effects that share the measured time evenly, as their passes are measured together; 1 for an effect that is measured alone.
    pub sharing: usize,
}

/// The passes that run for effects of a kind alone; those of one kind share them.
const fn passes_of(kind: EffectKind) -> &'static [&'static str] {
    match kind {
        EffectKind::Shadow => &[pass::SHADOW_MAP],
        EffectKind::Translucency => &[pass::SORT, pass::SPLAT],
        EffectKind::Opaque => &[pass::OPAQUE],
        _ => &[],
    }
}

impl EffectRow {
    fn new(effect: &Effect, scene: &Scene) -> Self {
        let kind = effect.kind;
        let switched = kind.and_then(|kind| SwitchedEffect::find(&scene.render.effects, kind, &effect.label));
        Self {
            name: effect.name.clone(),
            what: effect.what,
            called_for: effect.called_for,
            lacking: effect.is_lacking,
            reason: effect.reason.clone(),
            bound: effect.bound.number(),
            switch: switched.map_or(Switch::Auto, |is_on| if is_on { Switch::On } else { Switch::Off }),
            fixed: kind.map_or(Some("no scene can switch it"), EffectKind::fixed_because),
            predicted_ms: None,
            measured_ms: None,
            sharing: 1,
        }
    }

    /// What kind of effect it is.
    fn kind(&self) -> Option<EffectKind> {
        let word = self.name.split('.').next()?;
        EffectKind::ALL.into_iter().find(|kind| kind.word() == word)
    }

    /// Adds the times of the passes that run for effects alone, in equal parts to those of a kind that are simulated.
    fn add_times(rows: &mut [Self], passes: &[PassRow]) {
        for kind in EffectKind::ALL {
            let is_simulated = |row: &&mut Self| row.called_for && !row.lacking && row.kind() == Some(kind);
            let mut simulated: Vec<&mut Self> = rows.iter_mut().filter(is_simulated).collect();
            let sharing = simulated.len();
            let of_kind = || passes.iter().filter(|pass| passes_of(kind).contains(&pass.name.as_str()));
            let sum = |time: fn(&PassRow) -> Option<f64>| of_kind().filter_map(time).reduce(|a, b| a + b);
            let predicted = sum(|pass| pass.predicted_ms);
            let measured = sum(|pass| pass.measured_ms);
            for row in &mut simulated {
                row.predicted_ms = predicted.map(|ms| ms / sharing as f64);
                row.measured_ms = measured.map(|ms| ms / sharing as f64);
                row.sharing = sharing;
            }
        }
    }

    /// Takes in the predicted times of what runs for an effect alone.
    fn add_predicted(rows: &mut [Self], predicted: &Prediction) {
        let threads = rayon::current_num_threads();
        for work in &predicted.effects {
            if let Some(row) = rows.iter_mut().find(|row| row.name == work.effect) {
                row.predicted_ms = Some(1e3 * work.seconds(&predicted.rates, threads));
            }
        }
    }

    /// The effects of a plan that something in the scene causes, and those that are switched.
    fn of_plan(plan: &Plan, scene: &Scene) -> Vec<Self> {
        let rows = plan.effects.iter().map(|effect| (Self::new(effect, scene), effect.is_absent));
        rows.filter(|(row, is_absent)| !is_absent || row.switch != Switch::Auto).map(|(row, _)| row).collect()
    }
}

/// A picture as a page shows it.
#[derive(Debug, Clone, PartialEq)]
pub struct Picture {
    /// A PNG file, the one that `organza render` writes where the picture is whole.
    pub png: Vec<u8>,
    /// The facts about it.
    pub facts: Facts,
}

/// A render with all that its files tell.
#[derive(Debug)]
pub(crate) struct Drawn {
    /// The state that it shows.
    pub(crate) generation: u64,
    pub(crate) level: Level,
    layers: Layers,
    metadata: Metadata,
    params: Params,
    facts: Facts,
    /// The layer that the page shows in the place of the beauty.
    layer: Option<String>,
}

impl Drawn {
    /// A render of a scene that was asked for.
    pub(crate) fn new(render: Render, scene: &Scene, request: &Request, level: Level, time: Duration) -> Self {
        let metadata = Metadata {
            scene_sha256: scene.sha256.clone(),
            scene: request.told.clone(),
            technique: render.plan.technique.clone(),
            left_out: render.plan.left_out_text(),
            seed: scene.render.seed,
            backend: render.backend.clone(),
            sets: render.sets.map(|sets| sets.averaged),
            exposure: scene.render.exposure,
        };
        let has_background = scene.background != [0.0; 3] || scene.environment.is_some();
        let params = Params { has_background, ..Params::default() };
        let passes = PassRow::of_render(&render);
        let mut effects = EffectRow::of_plan(&render.plan, scene);
        EffectRow::add_times(&mut effects, &passes);
        EffectRow::add_predicted(&mut effects, &render.predicted);
        let facts = Facts {
            number: 0,
            generation: request.generation,
            level,
            splat_share: scene.render.splat_share,
            size: Size::of_scene(scene),
            ms: 1e3 * time.as_secs_f64(),
            technique: render.plan.technique.clone(),
            sets: metadata.sets,
            effects,
            passes,
            legends: render.scales.iter().map(Legend::new).collect(),
            warnings: render.warnings.iter().map(|warning| wording::sentence(warning)).collect(),
            notes: render.notes,
        };
        Self {
            generation: request.generation,
            level,
            layers: render.layers,
            metadata,
            params,
            facts,
            layer: request.layer.clone(),
        }
    }

    /// The effects of its plan.
    pub(crate) fn effects(&self) -> &[EffectRow] {
        &self.facts.effects
    }

    /// The bytes of a file of this format, as `organza render` writes it.
    ///
    /// # Errors
    /// [`Error::Output`] for a picture that the format cannot hold.
    pub(crate) fn file(&self, format: Format) -> Result<Vec<u8>, Error> {
        Ok(output::encode(&self.layers, &self.metadata, format, &self.params)?.0)
    }

    /// What the page shows in the place of the beauty, with how it is displayed.
    fn shown(&self) -> Option<(Layers, Metadata)> {
        let (layers, radiance) = self.layer.as_deref().and_then(|layer| layer_image::shown(&self.layers, layer))?;
        let exposure = if radiance == Radiance::Exposed { self.metadata.exposure } else { 0.0 };
        Some((layers, Metadata { exposure, ..self.metadata.clone() }))
    }

    /// The picture of the page in bytes, as [`Drawn::displayed`] has the beauty.
    ///
    /// # Errors
    /// As [`Drawn::file`].
    pub(crate) fn displayed_as_shown(&self) -> Result<Vec<u8>, Error> {
        match self.shown() {
            None => self.displayed(),
            Some((layers, metadata)) => Ok(output::displayed_bytes(&layers, &metadata, &Params::default())?),
        }
    }

    /// Name and numbers of the layer that the page shows, at a place of the picture.
    pub(crate) fn number_at(&self, place: PicturePlace) -> Option<(String, Vec<f64>)> {
        let name = self.layer.clone().unwrap_or_else(|| "beauty".to_owned());
        let pixel = place.pixel(self.layers.size[0], self.layers.size[1]);
        let numbers = match self.layers.images.get(name.as_str())? {
            LayerData::Rgb(pixels) => pixels.get(pixel)?.iter().map(|channel| f64::from(*channel)).collect(),
            LayerData::Scalar(numbers) => vec![f64::from(*numbers.get(pixel)?)],
            LayerData::Id(ids) => vec![f64::from(*ids.get(pixel)?)],
        };
        Some((name, numbers))
    }

    /// The beauty as it is displayed: red, green and blue of each pixel, row by row from the top left.
    ///
    /// # Errors
    /// As [`Drawn::file`].
    pub(crate) fn displayed(&self) -> Result<Vec<u8>, Error> {
        Ok(output::displayed_bytes(&self.layers, &self.metadata, &self.params)?)
    }

    /// Its size.
    pub(crate) const fn size(&self) -> Size {
        self.facts.size
    }

    /// Time of its passes but reading and conversion, milliseconds.
    pub(crate) fn drawing_ms(&self) -> f64 {
        let is_drawing = |row: &&PassRow| ![pass::READ, pass::CONVERT].contains(&row.name.as_str());
        self.facts.passes.iter().filter(is_drawing).filter_map(|row| row.measured_ms).sum()
    }

    /// The picture of the page, counted as `number`.
    ///
    /// # Errors
    /// As [`Drawn::file`].
    pub(crate) fn picture(&self, number: u64) -> Result<Picture, Error> {
        let png = match self.shown() {
            None => self.file(Format::Png)?,
            Some((layers, metadata)) => output::encode(&layers, &metadata, Format::Png, &Params::default())?.0,
        };
        Ok(Picture { png, facts: Facts { number, ..self.facts.clone() } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn effects_of_a_kind_share_the_time_of_their_pass() {
        let row = |name: &str, called_for| EffectRow {
            name: name.into(),
            what: "",
            called_for,
            lacking: false,
            reason: String::new(),
            bound: None,
            switch: Switch::Auto,
            fixed: None,
            predicted_ms: None,
            measured_ms: None,
            sharing: 1,
        };
        let mut rows = [row("shadow.a", true), row("shadow.b", false), row("shadow.c", true), row("light.a", true)];
        let pass = |name: &str, predicted_ms, measured_ms| PassRow { name: name.into(), predicted_ms, measured_ms };
        let passes = [pass(pass::SHADOW_MAP, Some(30.0), Some(8.0)), pass(pass::SHADE, Some(4.0), Some(4.0))];
        EffectRow::add_times(&mut rows, &passes);
        let times: Vec<_> = rows.iter().map(|row| row.predicted_ms.zip(row.measured_ms)).collect();
        assert_eq!(times, [Some((15.0, 4.0)), None, Some((15.0, 4.0)), None]);
        assert_eq!(rows.map(|row| row.sharing), [2, 1, 2, 1]);
    }

    #[test]
    fn a_coarse_picture_has_a_pixel_at_least() {
        let size = Size { width: 961, height: 3 };
        assert_eq!(size.divided(4), Size { width: 241, height: 1 });
        assert_eq!(size.divided(1), size);
    }
}
