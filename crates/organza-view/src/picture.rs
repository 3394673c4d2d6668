//! A finished picture: the bytes that the page shows, and what is to be said about it.

use crate::event::Switch;
use organza::output::{self, Format, Metadata, Params};
use organza::plan::{Effect, Plan};
use organza::scene::{EffectKind, Scene, SwitchedEffect};
use organza::{Error, Layers, Render};
use serde::{Deserialize, Serialize};
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

/// How much of a picture is drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Level {
    /// Fewer pixels, for as long as the whole picture takes.
    Coarse,
    /// The picture of `organza render`.
    Whole,
}

/// What is to be said about a picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Facts {
    /// Pictures of a session are counted from 1.
    pub number: u64,
    /// The state that it shows; a session's states are counted from 1.
    pub generation: u64,
    /// How much of it is drawn.
    pub level: Level,
    /// Its own size, smaller than the page's where it is coarse.
    pub size: Size,
    /// Time of drawing, milliseconds by the clock.
    pub ms: f64,
    /// Name of the technique, or of several.
    pub technique: String,
    /// Sets of particles that were averaged, where it is an average.
    pub sets: Option<u32>,
    /// What a person should know of the input, one sentence each.
    pub warnings: Vec<String>,
    /// What files hold that the picture does not show, one sentence each.
    pub notes: Vec<String>,
    /// The effects of the plan that something in the scene causes.
    pub effects: Vec<EffectRow>,
}

/// An effect of the plan, as a row of the page.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct EffectRow {
    /// What it is called, such as `shadow.sun`.
    pub name: String,
    /// What effects of its kind are, in a few words.
    pub what: &'static str,
    /// Whether it is simulated, or would be if a technique of the scene had it.
    pub called_for: bool,
    /// Whether it is called for and the picture lacks it.
    pub lacking: bool,
    /// Why, or why not.
    pub reason: String,
    /// The most that any displayed pixel, 0 to 1, changes without it; `None` where no bound is known.
    pub bound: Option<f64>,
    /// Who decides.
    pub switch: Switch,
    /// Why it cannot be switched; `None` where it can.
    pub fixed: Option<&'static str>,
}

impl EffectRow {
    fn new(effect: &Effect, scene: &Scene) -> Self {
        let word = effect.name.split('.').next().unwrap_or(&effect.name);
        let kind = EffectKind::ALL.into_iter().find(|kind| kind.word() == word);
        let label = effect.name.strip_prefix(word).and_then(|rest| rest.strip_prefix('.')).unwrap_or("");
        let switched = kind.and_then(|kind| SwitchedEffect::find(&scene.render.effects, kind, label));
        Self {
            name: effect.name.clone(),
            what: effect.what,
            called_for: effect.called_for,
            lacking: effect.is_lacking,
            reason: effect.reason.clone(),
            bound: effect.bound.number(),
            switch: switched.map_or(Switch::Auto, |is_on| if is_on { Switch::On } else { Switch::Off }),
            fixed: kind.map_or(Some("no scene can switch it"), EffectKind::fixed_because),
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
    /// What is to be said about it.
    pub facts: Facts,
}

/// A render with all that its files tell.
#[derive(Debug)]
pub(crate) struct Drawn {
    /// The state that it shows.
    pub(crate) generation: u64,
    pub(crate) level: Level,
    pub(crate) time: Duration,
    layers: Layers,
    metadata: Metadata,
    params: Params,
    facts: Facts,
}

impl Drawn {
    /// A render of a scene; `text` is what its files tell of the scene.
    pub(crate) fn new(
        render: Render,
        scene: &Scene,
        text: &str,
        generation: u64,
        level: Level,
        time: Duration,
    ) -> Self {
        let metadata = Metadata {
            scene_sha256: scene.sha256.clone(),
            scene: text.to_owned(),
            technique: render.plan.technique.clone(),
            seed: scene.render.seed,
            backend: render.backend.clone(),
            sets: render.sets.map(|sets| sets.averaged),
            exposure: scene.render.exposure,
        };
        let has_background = scene.background != [0.0; 3] || scene.environment.is_some();
        let params = Params { has_background, ..Params::default() };
        let facts = Facts {
            number: 0,
            generation,
            level,
            size: Size::of_scene(scene),
            ms: 1e3 * time.as_secs_f64(),
            technique: render.plan.technique.clone(),
            sets: metadata.sets,
            effects: EffectRow::of_plan(&render.plan, scene),
            warnings: render.warnings,
            notes: render.notes,
        };
        Self { generation, level, time, layers: render.layers, metadata, params, facts }
    }

    /// The bytes of a file of this format, as `organza render` writes it.
    ///
    /// # Errors
    /// [`Error::Output`] for a picture that the format cannot hold.
    pub(crate) fn file(&self, format: Format) -> Result<Vec<u8>, Error> {
        Ok(output::encode(&self.layers, &self.metadata, format, &self.params)?.0)
    }

    /// The picture of the page, counted as `number`.
    ///
    /// # Errors
    /// As [`Drawn::file`].
    pub(crate) fn picture(&self, number: u64) -> Result<Picture, Error> {
        Ok(Picture { png: self.file(Format::Png)?, facts: Facts { number, ..self.facts.clone() } })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_coarse_picture_has_a_pixel_at_least() {
        let size = Size { width: 961, height: 3 };
        assert_eq!(size.divided(4), Size { width: 241, height: 1 });
        assert_eq!(size.divided(1), size);
    }
}
