//! A finished picture: its layers as arrays, its files, and what is known of how it was drawn.

use crate::arrays;
use crate::errors::{raised, refused};
use crate::legends::{Legend, named};
use crate::wording;
use convert::ColorScale;
use numpy::{PyArray1, PyArray2, PyArray3, PyArrayMethods};
use organza::output::{self, Format, LegendPlace, Metadata, Params, Target};
use organza::scene::{Goal, LAYER_NAMES, Scene};
use organza::{Error, GivenUp, Render, WithinGoal};
use organza_judge::documents;
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use serde_json::{Value, json};
use splat_core::{LayerData, Layers};
use std::path::PathBuf;

/// A picture that was drawn.
#[pyclass(frozen, module = "organza._organza")]
pub(crate) struct Picture {
    layers: Layers,
    metadata: Metadata,
    /// Camera, plan, costs, predictions, warnings and notes, as JSON.
    facts: String,
    has_background: bool,
    /// Scales of the colours.
    scales: Vec<ColorScale>,
}

impl Picture {
    /// A picture that was drawn with the scene's own settings.
    pub(crate) fn new(scene: &Scene, text: &str, render: Render) -> Self {
        Self::with_goal(scene, text.to_owned(), render, Value::Null)
    }

    /// A picture that keeps to a goal. Its text has the settings that were taken, so that it draws the same picture.
    pub(crate) fn within(scene: &Scene, text: &str, within: WithinGoal) -> Self {
        let mut goal = documents::within_goal_json(&within);
        let Goal { budget_ms, max_rmse, max_flip } = scene.render.goal;
        goal["budget_ms"] = json!(budget_ms);
        goal["max_rmse"] = json!(max_rmse);
        goal["max_flip"] = json!(max_flip);
        Self::with_goal(scene, with_taken(text, &within.given_up), within.render, goal)
    }

    fn with_goal(scene: &Scene, text: String, render: Render, goal: Value) -> Self {
        let metadata = Metadata {
            scene_sha256: scene.sha256.clone(),
            scene: text,
            technique: render.plan.technique.clone(),
            left_out: render.plan.left_out_text(),
            seed: scene.render.seed,
            backend: render.backend.clone(),
            sets: render.sets.map(|sets| sets.averaged),
            exposure: scene.render.exposure,
        };
        let facts = json!({
            "camera": documents::camera_json(scene, render.found.as_ref()),
            "plan": documents::plan_json(&render.plan),
            "cost": documents::cost_json(&render.cost),
            "predicted": documents::predicted_json(&render.predicted),
            "goal": goal,
            "warnings": render.warnings,
            "notes": render.notes,
        });
        let facts = wording::document(facts);
        let has_background = scene.background != [0.0; 3] || scene.environment.is_some();
        let scales = render.scales.into_iter().map(named).collect();
        Self { metadata, facts: facts.to_string(), has_background, layers: render.layers, scales }
    }

    /// A picture without its background is made from a layer that is kept if it is asked for.
    fn check_transparent(&self, transparent: bool) -> PyResult<()> {
        if transparent && self.layers.rgb("background").is_none() {
            let found = "one that was drawn without; draw it with `transparent=True`";
            return Err(refused("transparent", "a picture that keeps what lies behind it", found));
        }
        Ok(())
    }

    /// How files store it; `legend` is the place of legends, `"over"` or `"beside"`, and `None` leaves them out.
    fn params(&self, transparent: bool, deep: bool, half: bool, legend: Option<&str>) -> PyResult<Params> {
        let legend_place = match legend {
            None | Some("over") => LegendPlace::Over,
            Some("beside") => LegendPlace::Beside,
            Some(other) => {
                return Err(refused("legend", "True, False, 'over' or 'beside'", &format!("'{other}'")));
            }
        };
        let legend = if legend.is_some() { self.scales.clone() } else { Vec::new() };
        Ok(Params { half, deep, transparent, has_background: self.has_background, legend, legend_place })
    }
}

/// The text of a scene with the settings that were taken in the place of its goal: in JSON as keys, in TOML as comments with the options of the command.
fn with_taken(text: &str, given_up: &[GivenUp]) -> String {
    let Ok(mut document) = serde_json::from_str::<Value>(text) else {
        let taken = given_up.iter().map(|setting| format!("{}={}", setting.key, setting.taken));
        let no_goal = Goal::KEYS.iter().map(|key| format!("render.{key}=none"));
        return taken.chain(no_goal).fold(text.to_owned(), |text, change| text + "\n# --set " + &change);
    };
    if let Some(render) = document.get_mut("render").and_then(Value::as_object_mut) {
        Goal::KEYS.iter().for_each(|key| drop(render.remove(*key)));
    }
    for GivenUp { key, taken, .. } in given_up {
        let value = serde_json::from_str(taken).unwrap_or_else(|_| json!(taken));
        let place = key.split('.').fold(&mut document, |table, part| &mut table[part]);
        *place = value;
    }
    document.to_string()
}

#[pymethods]
impl Picture {
    /// A picture of layers by name, each (height, width, 3) or (height, width), with the facts, the metadata and the legends of another.
    #[staticmethod]
    fn of_parts(layers: &Bound<'_, PyDict>, facts: String, metadata: &str, legends: Vec<Legend>) -> PyResult<Self> {
        let broken = |error: &dyn std::fmt::Display| refused("the picture", "its metadata as JSON", &error.to_string());
        let metadata: Value = serde_json::from_str(metadata).map_err(|error| broken(&error))?;
        let mut made = Layers::default();
        for (name, array) in layers {
            let name: String = name.extract()?;
            let Some(known) = LAYER_NAMES.iter().find(|known| **known == name) else {
                return Err(refused("the layer", &format!("one of {}", LAYER_NAMES.join(", ")), &format!("'{name}'")));
            };
            let sides = arrays::shape(&name, &array)?;
            let (&[height, width] | &[height, width, 3]) = sides.as_slice() else {
                return Err(refused(
                    &name,
                    "the shape (height, width) or (height, width, 3)",
                    &arrays::shape_text(&sides),
                ));
            };
            let side = |side: usize| u32::try_from(side).map_err(|_| refused(&name, "fewer pixels a side", "too many"));
            let size = [side(width)?, side(height)?];
            if !made.images.is_empty() && made.size != size {
                return Err(refused(
                    &name,
                    &format!("the size {:?} of the other layers", made.size),
                    &format!("{size:?}"),
                ));
            }
            made.size = size;
            let data = match (sides.len(), *known) {
                (3, _) => LayerData::Rgb(arrays::column(&name, &array, |value| value as f32)?.as_chunks().0.to_vec()),
                (_, "object") => LayerData::Id(arrays::column(&name, &array, |value| value as u32)?),
                _ => LayerData::Scalar(arrays::column(&name, &array, |value| value as f32)?),
            };
            made.insert(known, data);
        }
        for (name, is_there) in [("beauty", made.rgb("beauty").is_some()), ("alpha", made.scalar("alpha").is_some())] {
            if !is_there {
                return Err(refused("the layers", &format!("a layer '{name}'"), "none"));
            }
        }
        let text = |key: &str| metadata[key].as_str().unwrap_or_default().to_owned();
        let sets = metadata["sets"].as_u64().and_then(|sets| u32::try_from(sets).ok());
        Ok(Self {
            layers: made,
            metadata: Metadata {
                scene_sha256: text("scene_sha256"),
                scene: text("scene"),
                technique: text("technique"),
                seed: metadata["seed"].as_u64().unwrap_or_default(),
                backend: text("backend"),
                sets,
                exposure: metadata["exposure"].as_f64().unwrap_or_default(),
                left_out: text("left_out"),
            },
            facts,
            has_background: metadata["has_background"].as_bool().unwrap_or_default(),
            scales: legends.into_iter().map(Legend::scale).collect::<PyResult<_>>()?,
        })
    }

    /// The texts of its files beside the layers, a document in JSON.
    #[getter]
    fn metadata(&self) -> String {
        let Metadata { scene_sha256, scene, technique, seed, backend, sets, exposure, left_out } = &self.metadata;
        json!({
            "scene_sha256": scene_sha256, "scene": scene, "technique": technique, "seed": seed, "backend": backend,
            "sets": sets, "exposure": exposure, "left_out": left_out, "has_background": self.has_background,
        })
        .to_string()
    }

    /// Width and height, pixels.
    #[getter]
    fn size(&self) -> (u32, u32) {
        let [width, height] = self.layers.size;
        (width, height)
    }

    /// Names of its layers.
    #[getter]
    fn layers(&self) -> Vec<&'static str> {
        self.layers.images.keys().copied().collect()
    }

    /// A layer as an array of its own: (height, width, 3) or (height, width).
    fn layer<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyAny>> {
        let Some(layer) = self.layers.images.get(name) else {
            let known = self.layers().join(", ");
            return Err(refused("the layer", &format!("one of {known}"), &format!("'{name}'")));
        };
        let [width, height] = self.layers.size.map(|side| side as usize);
        Ok(match layer {
            LayerData::Rgb(pixels) => {
                let numbers: Bound<'py, PyArray1<f32>> = PyArray1::from_slice(py, pixels.as_flattened());
                let shaped: Bound<'py, PyArray3<f32>> = numbers.reshape([height, width, 3])?;
                shaped.into_any()
            }
            LayerData::Scalar(values) => {
                let shaped: Bound<'py, PyArray2<f32>> = PyArray1::from_slice(py, values).reshape([height, width])?;
                shaped.into_any()
            }
            LayerData::Id(ids) => {
                let shaped: Bound<'py, PyArray2<u32>> = PyArray1::from_slice(py, ids).reshape([height, width])?;
                shaped.into_any()
            }
        })
    }

    /// What is known of how it was drawn, a document in JSON.
    #[getter]
    fn facts(&self) -> &str {
        &self.facts
    }

    /// Its legends, which [`Self::of_parts`] takes in another process.
    #[getter]
    fn legends(&self) -> Vec<Legend> {
        self.scales.iter().map(Legend::new).collect()
    }

    /// What is displayed, bytes of sRGB: (height, width, 3), or 4 channels where it is transparent.
    #[pyo3(signature = (transparent=false))]
    fn srgb8<'py>(&self, py: Python<'py>, transparent: bool) -> PyResult<Bound<'py, PyArray3<u8>>> {
        self.check_transparent(transparent)?;
        let params = self.params(transparent, false, false, None)?;
        let bytes = py.detach(|| output::displayed_bytes(&self.layers, &self.metadata, &params));
        let bytes = bytes.map_err(|error| raised(&Error::Output(error)))?;
        let [width, height] = self.layers.size.map(|side| side as usize);
        PyArray1::from_vec(py, bytes).reshape([height, width, if transparent { 4 } else { 3 }])
    }

    /// The bytes of a PNG file of it.
    #[pyo3(signature = (transparent=false, deep=false, legend=None))]
    fn png<'py>(
        &self,
        py: Python<'py>,
        transparent: bool,
        deep: bool,
        legend: Option<&str>,
    ) -> PyResult<Bound<'py, PyBytes>> {
        self.check_transparent(transparent)?;
        let params = self.params(transparent, deep, false, legend)?;
        let encoded = py.detach(|| output::encode(&self.layers, &self.metadata, Format::Png, &params));
        let (bytes, _) = encoded.map_err(|error| raised(&Error::Output(error)))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Writes it, as a PNG or OpenEXR file by the name.
    #[pyo3(signature = (path, transparent=false, deep=false, half=false, legend=None, force=false))]
    #[expect(clippy::too_many_arguments, reason = "they are keywords of the call from Python")]
    fn save(
        &self,
        py: Python<'_>,
        path: PathBuf,
        transparent: bool,
        deep: bool,
        half: bool,
        legend: Option<&str>,
        force: bool,
    ) -> PyResult<Vec<String>> {
        self.check_transparent(transparent)?;
        let params = self.params(transparent, deep, half, legend)?;
        let written = py.detach(|| {
            Format::of_path(&path)?;
            let target = Target::new(&path, force)?;
            output::write(&self.layers, &self.metadata, &target, &params)
        });
        let report = written.map_err(|error| raised(&Error::Output(error)))?;
        let counts = [
            (report.clamped, "values were cut to the format's largest"),
            (
                report.too_bright,
                "translucent pixels lose light, as they are brighter than a straight colour can be: write an .exr",
            ),
            (report.without_room, "legends have no room: draw a larger picture"),
            (report.boxes, "letters of legends are boxes: Latin ones and some Greek ones have a form"),
        ];
        let told = counts.into_iter().filter(|(count, _)| *count > 0);
        let mut said: Vec<String> = told.map(|(count, what)| format!("{}: {count} {what}", path.display())).collect();
        if legend.is_some() && params.legend.is_empty() {
            said.push("there is no legend: nothing that is drawn has a number that its colour stands for".to_owned());
        }
        Ok(said)
    }
}
