//! Calls of the package: a first scene of data, a scene drawn.

use crate::data::Data;
use crate::errors::{InputError, raised, refused};
use crate::picture::Picture;
use crate::running::run;
use crate::wording::{self, MADE, placed};
use convert::ColorMap;
use organza::scene::{self, Goal, LoadOptions, Override, Scene, UpAxis, parse};
use organza::{Context, Error, Files, InMemory, Progress, RenderOptions};
use organza_survey::{DataFile, Preset, Wish};
use pyo3::prelude::*;
use serde_json::Value;
use splat_core::MemoryAccount;
use std::collections::HashMap;
use std::path::{Path, PathBuf};

/// The file that the text of a first scene is written for: it lies in the working folder, and is never there.
const FIRST: &str = "scene.toml";

/// How a call goes about its work; every field may be `None`.
#[derive(FromPyObject)]
pub(crate) struct How<'py> {
    #[pyo3(item)]
    pub(crate) threads: Option<usize>,
    #[pyo3(item)]
    pub(crate) max_memory: Option<u64>,
    #[pyo3(item)]
    pub(crate) progress: Option<Bound<'py, PyAny>>,
    #[pyo3(item)]
    drop_invalid: bool,
    #[pyo3(item)]
    strict: bool,
}

impl How<'_> {
    pub(crate) fn options(&self) -> RenderOptions {
        let defaults = RenderOptions::default();
        RenderOptions {
            max_memory: self.max_memory.unwrap_or(defaults.max_memory),
            drop_invalid: self.drop_invalid,
            strict: self.strict,
            ..defaults
        }
    }
}

/// A scene as a call has it: its document in TOML, or in JSON where the name of its file ends so, and the data that it names.
#[derive(FromPyObject)]
pub(crate) struct Given {
    #[pyo3(item)]
    pub(crate) text: String,
    #[pyo3(item)]
    pub(crate) file: PathBuf,
    #[pyo3(item)]
    data: HashMap<String, Py<Data>>,
    /// Width and height, where the scene's are not meant.
    #[pyo3(item)]
    pub(crate) size: Option<[u32; 2]>,
    /// Whether the layer of a picture without its background is kept.
    #[pyo3(item)]
    transparent: bool,
    /// Effects that are switched, such as `shadow.sun=off`.
    #[pyo3(item)]
    effects: Vec<String>,
    /// Changes of its keys, such as `render.seed=3`.
    #[pyo3(item)]
    changes: Vec<String>,
    /// The frame of an animation or a turntable.
    #[pyo3(item)]
    frame: Option<u32>,
    /// Frames of a turntable.
    #[pyo3(item)]
    turntable: Option<u32>,
}

impl Given {
    /// The data that it names, which threads without the interpreter can have.
    pub(crate) fn take_memory(&mut self) -> PyResult<InMemory> {
        let mut in_memory = InMemory::default();
        for (name, data) in self.data.drain() {
            in_memory.insert(&name, data.get().data.clone()).map_err(|error| raised(&error.into()))?;
        }
        Ok(in_memory)
    }

    /// How its document is read.
    pub(crate) fn load(&self, in_memory: InMemory, options: &RenderOptions) -> Result<LoadOptions, Error> {
        let mut overrides = self.changes.iter().map(|change| Override::parse(change)).collect::<Result<Vec<_>, _>>()?;
        for effect in &self.effects {
            overrides.push(Override::of_effect(effect)?);
        }
        if let Some([width, height]) = self.size {
            overrides.push(Override::parse(&format!("camera.size=[{width}, {height}]"))?);
        }
        Ok(LoadOptions {
            allow_path: true,
            memory: MemoryAccount::new(options.max_memory),
            in_memory,
            overrides,
            frame: self.frame,
            turntable: self.turntable,
            ..LoadOptions::default()
        })
    }

    pub(crate) fn scene(&self, in_memory: InMemory, options: &RenderOptions) -> Result<Scene, Error> {
        self.switched(in_memory, options, &[])
    }

    /// The scene with further effects switched, each `NAME=on` or `NAME=off`.
    pub(crate) fn switched(
        &self,
        in_memory: InMemory,
        options: &RenderOptions,
        effects: &[String],
    ) -> Result<Scene, Error> {
        let mut load = self.load(in_memory, options)?;
        for effect in effects {
            load.overrides.push(Override::of_effect(effect)?);
        }
        let parsed = parse(&self.file, self.text.as_bytes(), &load).map_err(Error::from);
        let mut scene = parsed.map_err(|error| placed(error, &self.text))?;
        if self.transparent && !scene.render.layers.add("background") {
            return Err(Error::Internal("there is no layer of the background".into()));
        }
        Ok(scene)
    }
}

/// Draws a scene. With `is_within_goal` settings give way to the time or the error that its `render` table states; else that is ignored with a warning, as
/// pictures that belong together need the same settings.
#[pyfunction]
#[pyo3(signature = (given, how, is_within_goal=false))]
pub(crate) fn render(py: Python<'_>, mut given: Given, how: How<'_>, is_within_goal: bool) -> PyResult<Picture> {
    let options = how.options();
    let in_memory = given.take_memory()?;
    let work = move |progress: &Progress| {
        let scene = given.scene(in_memory, &options)?;
        let goal = scene.render.goal;
        let in_words = |error| placed(error, &given.text);
        if is_within_goal && goal.is_any() {
            let within = organza::render_within(&scene, &goal, &options, progress, Files::default());
            return Ok(Picture::within(&scene, &given.text, within.map_err(in_words)?));
        }
        let mut picture = organza::render(&scene, &options, progress).map_err(in_words)?;
        if goal.is_any() {
            let sentence = "`render` states a time or an error to keep to, which one picture of `organza.render` does, and these do not";
            picture.warnings.push(sentence.to_owned());
        }
        Ok(Picture::new(&scene, &given.text, picture))
    };
    run(py, how.threads, how.progress.as_ref(), work)
}

/// The keys of a time or an error to keep to that a scene states, such as `render.budget_ms`.
#[pyfunction]
pub(crate) fn goal_keys(py: Python<'_>, mut given: Given, how: How<'_>) -> PyResult<Vec<String>> {
    let options = how.options();
    let in_memory = given.take_memory()?;
    let work = move |_: &Progress| {
        let Goal { budget_ms, max_rmse, max_flip } = given.scene(in_memory, &options)?.render.goal;
        let is_stated = [budget_ms.is_some(), max_rmse.is_some(), max_flip.is_some()];
        let stated = Goal::KEYS.into_iter().zip(is_stated).filter(|(_, is_stated)| *is_stated);
        Ok(stated.map(|(key, _)| format!("render.{key}")).collect())
    };
    run(py, how.threads, None, work)
}

/// The lights of a first scene for what a scene without lights shows, a document in JSON.
#[pyfunction]
pub(crate) fn lights_of(py: Python<'_>, mut given: Given, how: How<'_>) -> PyResult<String> {
    let options = how.options();
    let in_memory = given.take_memory()?;
    let is_turned = given.turntable.is_some();
    let work = move |progress: &Progress| {
        let scene = given.scene(in_memory, &options)?;
        let context = Context { files: &Files::default(), options: &options, progress };
        let lights = organza_survey::lights_of(&scene, is_turned, context);
        json_of_toml(&lights.map_err(|error| placed(error, &given.text))?)
    };
    run(py, how.threads, None, work)
}

/// The ground below what a scene shows, and the camera that sees it, a document in JSON.
#[pyfunction]
pub(crate) fn ground_of(py: Python<'_>, mut given: Given, how: How<'_>) -> PyResult<String> {
    let options = how.options();
    let in_memory = given.take_memory()?;
    let work = move |progress: &Progress| {
        let scene = given.scene(in_memory, &options)?;
        let context = Context { files: &Files::default(), options: &options, progress };
        let ground = organza_survey::ground_of(&scene, context);
        json_of_toml(&ground.map_err(|error| placed(error, &given.text))?)
    };
    run(py, how.threads, None, work)
}

/// What a first scene is made of: a file, or a name, data of that name, and the axis that points up in it.
#[derive(FromPyObject)]
pub(crate) enum Shown {
    #[pyo3(transparent)]
    File(PathBuf),
    InMemory(String, Py<Data>, Option<String>),
}

/// What a user may say of a first scene; every field may be `None`.
#[derive(FromPyObject)]
pub(crate) struct Wished {
    #[pyo3(item)]
    size: Option<[u32; 2]>,
    #[pyo3(item)]
    preset: Option<String>,
    #[pyo3(item)]
    color_by: Option<String>,
    #[pyo3(item)]
    up: Option<String>,
    #[pyo3(item)]
    ground: bool,
    #[pyo3(item)]
    azimuth: Option<f64>,
    #[pyo3(item)]
    elevation: Option<f64>,
    #[pyo3(item)]
    fit: Option<f64>,
    #[pyo3(item)]
    turntable: Option<u32>,
}

impl Wished {
    fn wish(&self) -> PyResult<Wish> {
        let up = self.up.as_deref().map(axis).transpose()?;
        let defaults = Wish::default();
        Ok(Wish {
            azimuth: self.azimuth,
            elevation: self.elevation,
            fill: self.fit.unwrap_or(defaults.fill),
            turntable: self.turntable,
            size: self.size.unwrap_or(defaults.size),
            preset: self.preset.as_deref().map(Preset::named).transpose().map_err(|error| raised(&error))?,
            color_by: self.color_by.clone(),
            up,
            ground: self.ground,
            ..defaults
        })
    }
}

/// The axis of a name.
fn axis(name: &str) -> PyResult<UpAxis> {
    match name {
        "y" => Ok(UpAxis::Y),
        "z" => Ok(UpAxis::Z),
        "-y" => Ok(UpAxis::MinusY),
        other => Err(refused("up", "'y', 'z' or '-y'", &format!("'{other}'"))),
    }
}

/// A first scene of files and data: its document in JSON, decisions that a user may want otherwise, and its text, with paths from this folder.
#[pyfunction]
pub(crate) fn first_scene(
    py: Python<'_>,
    shown: Vec<Shown>,
    wished: Wished,
    how: How<'_>,
) -> PyResult<(String, Vec<String>, String)> {
    let options = how.options();
    let wish = wished.wish()?;
    let mut in_memory = InMemory::default();
    let mut sources = Vec::new();
    for shown in shown {
        sources.push(match shown {
            Shown::File(path) => Source::File(path),
            Shown::InMemory(name, data, up) => {
                let data = &data.get().data;
                let up = up.as_deref().map(axis).transpose()?;
                in_memory.insert(&name, data.clone()).map_err(|error| raised(&error.into()))?;
                let file = DataFile::in_memory(&name, data.clone(), up, &wish);
                Source::InMemory(file.map_err(|error| raised(&error))?)
            }
        });
    }
    let work = move |progress: &Progress| {
        let files = Files::default();
        let context = Context { files: &files, options: &options, progress };
        let read = |source: Source| match source {
            Source::File(path) => DataFile::read(&path, &wish, context),
            Source::InMemory(data) => Ok(data),
        };
        let data = sources.into_iter().map(read).collect::<Result<Vec<_>, Error>>()?;
        let first = Path::new(FIRST);
        let written = organza_survey::first_scene(&data, first, &wish, &in_memory, context);
        let written = written.map_err(|error| wording::of_first_scene(error, first))?;
        let remarks = written.remarks.iter().map(|remark| wording::sentence(remark)).collect();
        Ok((json_of_toml(&written.text)?, remarks, written.text))
    };
    run(py, how.threads, None, work)
}

/// A file to be read, or data that is there.
enum Source {
    File(PathBuf),
    InMemory(DataFile),
}

/// Refuses a document in JSON that is no scene with the data that it names.
#[pyfunction]
pub(crate) fn check(py: Python<'_>, document: &str, data: HashMap<String, Py<Data>>) -> PyResult<()> {
    let mut in_memory = InMemory::default();
    for (name, data) in data {
        in_memory.insert(&name, data.bind(py).get().data.clone()).map_err(|error| raised(&error.into()))?;
    }
    let load = LoadOptions { allow_path: true, in_memory, ..LoadOptions::default() };
    let parsed = parse(Path::new(MADE), document.as_bytes(), &load).map_err(Error::from);
    parsed.map(|_| ()).map_err(|error| raised(&placed(error, document)))
}

/// Refuses a document in JSON that has keys which no scene has, or values of other types.
#[pyfunction]
pub(crate) fn check_keys(document: &str) -> PyResult<()> {
    let checked = scene::check_keys(Path::new(MADE), document).map_err(Error::from);
    checked.map_err(|error| raised(&placed(error, document)))
}

/// The schema of scenes, a document in JSON.
#[pyfunction]
pub(crate) fn schema() -> String {
    scene::schema()
}

/// A sentence of the renderer in the words of Python.
#[pyfunction]
pub(crate) fn in_words(sentence: &str) -> String {
    wording::sentence(sentence)
}

/// Linear colours of a map at places from 0 to 1.
#[pyfunction]
pub(crate) fn map_colors(name: &str, places: Vec<f64>) -> PyResult<Vec<[f32; 3]>> {
    let Some(map) = ColorMap::named(name) else {
        let known: Vec<&str> = ColorMap::names().collect();
        let found = format!("'{name}'; a colormap of matplotlib does, too");
        return Err(refused("colormap", &format!("one of {}", known.join(", ")), &found));
    };
    Ok(places.into_iter().map(|place| map.at(place)).collect())
}

/// A document in JSON as TOML.
#[pyfunction]
pub(crate) fn toml_text(document: &str) -> PyResult<String> {
    let wrong = |error: &dyn std::fmt::Display| InputError::new_err(format!("the scene: {error}"));
    let value: Value = serde_json::from_str(document).map_err(|error| wrong(&error))?;
    toml::to_string_pretty(&value).map_err(|error| wrong(&error))
}

/// A document in TOML as JSON.
fn json_of_toml(text: &str) -> Result<String, Error> {
    let value: Value = toml::from_str(text).map_err(|error| Error::Internal(error.to_string()))?;
    Ok(value.to_string())
}
