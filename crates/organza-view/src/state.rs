//! A person's changes to a scene, and the scene that follows from them.

mod history;

pub(crate) use history::History;

use crate::event::{Cut, Event, Knot, Switch, settings};
use crate::lights::{Aim, Direction, LightChange};
use crate::picture::Size;
use crate::viewpoint::Viewpoint;
use organza::scene::{self, LoadOptions, Override, Scene, printable, shown};
use organza::{Error, Files, InMemory, RenderOptions};
use splat_core::glam::DVec3;
use splat_core::{Clip, LightShape, MemoryAccount, Projection};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

/// A scene that is to be viewed.
pub struct Opening {
    /// The title of the page: the names of the opened files.
    pub title: String,
    /// Data files by the names that the person gave them: a scene that is made of them names them from its folder.
    pub inputs: Vec<GivenFile>,
    /// Whether its data is removed with the session: a scene that is saved then names it without a folder.
    pub is_fleeting: bool,
    /// The scene's file, which gives the format and the folder that paths are relative to; it need not be there.
    pub file: PathBuf,
    /// Its text.
    pub text: Vec<u8>,
    /// The options that it is loaded with, among them the changes from the command line.
    pub load: LoadOptions,
    /// The limits of a render.
    pub options: RenderOptions,
    /// Files that were read before.
    pub files: Files,
}

/// A data file, and what the person calls it.
#[derive(Debug, Clone)]
pub struct GivenFile {
    /// Where it is.
    pub path: PathBuf,
    /// Its name in messages.
    pub name: String,
}

impl Opening {
    /// A scene from its text alone.
    pub fn of_text(file: impl Into<PathBuf>, text: impl Into<Vec<u8>>, options: RenderOptions) -> Self {
        let memory = MemoryAccount::new(options.max_memory);
        let load = LoadOptions { memory, in_memory: InMemory::default(), ..LoadOptions::default() };
        let file = file.into();
        let title = printable(file.file_name().unwrap_or(file.as_os_str()).as_ref());
        let text = text.into();
        Self { title, inputs: Vec::new(), is_fleeting: false, file, text, load, options, files: Files::default() }
    }
}

/// A scene's text and the options that it is read with.
#[derive(Debug)]
pub(crate) struct Source {
    pub(crate) file: PathBuf,
    pub(crate) text: Vec<u8>,
    pub(crate) load: LoadOptions,
}

impl Source {
    /// Whether the text is JSON, which has no comments.
    pub(crate) fn is_json(&self) -> bool {
        self.file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("json"))
    }

    /// For each light of the scene, which key says where it shines to: a scene has one of the two for a spot.
    fn aims(&self, scene: &Scene) -> Vec<Aim> {
        let aim = |(rank, light): (usize, &scene::SceneLight)| {
            if !matches!(light.light.shape, LightShape::Spot { .. }) {
                return Aim::Direction;
            }
            let stated = Override::parse(&format!("light.{rank}.direction=[0, -1, 0]"));
            let changes = stated.map(|change| [self.load.overrides.clone(), vec![change]].concat());
            let is_direction = changes.map_err(Error::from).and_then(|changes| self.scene(changes)).is_ok();
            if is_direction { Aim::Direction } else { Aim::Target }
        };
        scene.lights.iter().enumerate().map(aim).collect()
    }

    /// All changes: those of the command line, then those of the view.
    pub(crate) fn overrides(&self, state: &State, scene: &Scene) -> Result<Vec<Override>, Error> {
        Ok([self.load.overrides.clone(), state.overrides(scene, |scene| self.aims(scene))?].concat())
    }

    /// The scene with these changes.
    pub(crate) fn scene(&self, overrides: Vec<Override>) -> Result<Scene, Error> {
        let load = LoadOptions { overrides, ..self.load.clone() };
        Ok(scene::parse(&self.file, &self.text, &load)?)
    }

    /// What files tell of the scene: its text, and in TOML the changes as comments.
    pub(crate) fn told(&self, overrides: &[Override]) -> String {
        let mut text = String::from_utf8_lossy(&self.text).into_owned();
        if !self.is_json() {
            for change in Override::in_order(overrides) {
                // Writing to a String cannot fail.
                let _ = write!(text, "\n# {}", change.flag());
            }
        }
        text
    }
}

/// What is changed of an object.
#[derive(Debug, Clone, PartialEq, Default)]
struct ObjectChange {
    visible: Option<bool>,
    opacity: Option<f64>,
    color: Option<[f64; 3]>,
    color_by: Option<ColorBy>,
    knots: Option<Vec<Knot>>,
    technique: Option<String>,
}

/// A column that an object is coloured by, and the map.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct ColorBy {
    pub(crate) column: String,
    pub(crate) map: Option<String>,
}

/// A position between fast and exact, and the settings that it stands for.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Accuracy {
    /// 0 is what the scene states.
    pub(crate) step: i32,
    pub(crate) set: Vec<Override>,
}

impl Accuracy {
    /// The settings as `--set` takes them.
    pub(crate) fn texts(&self) -> Vec<String> {
        self.set.iter().map(|change| change.flag().trim_start_matches("--set ").to_owned()).collect()
    }
}

/// What a person has changed of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct State {
    viewpoint: Option<Viewpoint>,
    size: Option<Size>,
    exposure: Option<f64>,
    /// By rank in the scene.
    objects: BTreeMap<usize, ObjectChange>,
    /// By rank in the scene.
    lights: BTreeMap<usize, LightChange>,
    /// The layer in the place of the beauty.
    layer: Option<String>,
    effects: BTreeMap<String, Switch>,
    cuts: Vec<Cut>,
    technique: Option<String>,
    accuracy: Accuracy,
}

impl State {
    /// The position between fast and exact.
    pub(crate) const fn accuracy(&self) -> &Accuracy {
        &self.accuracy
    }

    /// The planes that cut objects open, beside those of the scene.
    pub(crate) fn cuts(&self) -> &[Cut] {
        &self.cuts
    }

    /// The column that an object was chosen to be coloured by.
    pub(crate) fn color_by_of(&self, object: usize) -> Option<&ColorBy> {
        self.objects.get(&object)?.color_by.as_ref()
    }

    /// The technique that was chosen for an object.
    pub(crate) fn technique_of(&self, object: usize) -> Option<&str> {
        self.objects.get(&object)?.technique.as_deref()
    }

    /// Whether a colour was chosen for an object.
    pub(crate) fn is_recolored(&self, object: usize) -> bool {
        self.objects.get(&object).is_some_and(|change| change.color.is_some())
    }

    /// The technique that was chosen.
    pub(crate) fn technique(&self) -> Option<&str> {
        self.technique.as_deref()
    }

    /// The same with the accuracy that the scene states.
    pub(crate) fn at_stated_accuracy(&self) -> Self {
        Self { accuracy: Accuracy::default(), ..self.clone() }
    }

    /// The viewpoint, where a person has moved it.
    pub(crate) fn viewpoint(&self) -> Option<&Viewpoint> {
        self.viewpoint.as_ref()
    }

    /// The same seen from another viewpoint.
    #[cfg(test)]
    pub(crate) fn seen_from(self, viewpoint: Option<Viewpoint>) -> Self {
        Self { viewpoint, ..self }
    }

    /// Takes the changes of another state; the viewpoint stays.
    pub(crate) fn become_like(&mut self, other: Self) {
        *self = Self { viewpoint: self.viewpoint, ..other };
    }

    /// The layer in the place of the beauty.
    pub(crate) fn layer(&self) -> Option<&str> {
        self.layer.as_deref()
    }

    /// The same changes of a scene that was edited: those of objects and lights go by their names.
    pub(crate) fn of_another_scene(&self, before: &Scene, after: &Scene) -> Self {
        let object = |(rank, change): (&usize, &ObjectChange)| {
            let name = &before.objects.get(*rank)?.name;
            Some((after.objects.iter().position(|object| object.name == *name)?, change.clone()))
        };
        let light = |(rank, change): (&usize, &LightChange)| {
            let label = &before.lights.get(*rank)?.label;
            Some((after.lights.iter().position(|light| light.label == *label)?, *change))
        };
        let is_there = |name: &String| after.objects.iter().any(|object| object.name == *name);
        Self {
            cuts: self.cuts.iter().filter(|cut| cut.object.as_ref().is_none_or(is_there)).cloned().collect(),
            objects: self.objects.iter().filter_map(object).collect(),
            lights: self.lights.iter().filter_map(light).collect(),
            ..self.clone()
        }
    }

    /// Stops by which a light is brighter than the scene has it.
    pub(crate) fn stops_of(&self, light: usize) -> f64 {
        self.lights.get(&light).and_then(|change| change.stops).unwrap_or(0.0)
    }

    /// Who decides of an effect.
    pub(crate) fn switch_of(&self, effect: &str) -> Option<Switch> {
        self.effects.get(effect).copied()
    }

    /// Takes an event in; `first` is the viewpoint of the scene's own camera. Numbers that a scene refuses are for [`Source::scene`] to find.
    ///
    /// # Errors
    /// [`Error::Input`] for numbers that no hand makes, and for objects that the scene does not have.
    pub(crate) fn apply(&mut self, event: &Event, scene: &Scene, first: &Viewpoint) -> Result<(), Error> {
        event.check()?;
        let viewpoint = self.viewpoint.unwrap_or(*first);
        match event {
            Event::Orbit { right, up } => self.viewpoint = Some(viewpoint.orbited(*right, *up)),
            Event::Pan { right, up } => self.viewpoint = Some(viewpoint.panned(*right, *up)),
            Event::Zoom { steps } => self.viewpoint = Some(viewpoint.zoomed(*steps)),
            Event::LookFrom { azimuth, elevation, distance, centre } => {
                let turned = viewpoint.looking_from(azimuth.to_radians(), elevation.to_radians());
                let distance = distance.unwrap_or(viewpoint.distance);
                let centre = centre.map_or(viewpoint.centre, Into::into);
                self.viewpoint = Some(Viewpoint { distance, centre, ..turned });
            }
            Event::Reset {} => self.viewpoint = None,
            Event::Restore {} => *self = Self { viewpoint: self.viewpoint, size: self.size, ..Self::default() },
            // Steps are those of the history.
            Event::Undo {} | Event::Redo {} | Event::Done {} => {}
            Event::Show { object, visible } => {
                self.change(scene, object)?.visible = Some(*visible);
                // An object that was switched off as an effect is shown by this.
                self.effects.remove(&format!("object.{object}"));
            }
            Event::Opacity { object, opacity } => self.change(scene, object)?.opacity = *opacity,
            Event::Effect { name, switch } => {
                self.effects.insert(name.clone(), *switch);
            }
            Event::LightIntensity { light, stops } => self.change_light(scene, light)?.stops = Some(*stops),
            Event::LightDirection { light, azimuth, elevation } => {
                let direction = Direction { azimuth: *azimuth, elevation: *elevation };
                self.change_light(scene, light)?.direction = Some(direction);
            }
            Event::LightShadow { light, shadow } => self.change_light(scene, light)?.shadow = Some(*shadow),
            Event::Transfer { object, knots } => {
                let is_volume =
                    |o: &scene::SceneObject| o.name == *object && matches!(o.source, scene::Source::Volume(_));
                if knots.is_some() && !scene.objects.iter().any(is_volume) {
                    let message = format!("expected the name of a volume, found `{}`", shown(object));
                    return Err(Error::input("event `transfer`", message, "volumes alone have a curve here"));
                }
                self.change(scene, object)?.knots.clone_from(knots);
            }
            Event::Color { object, color } => {
                let change = self.change(scene, object)?;
                change.color = *color;
                // A scene has one of the two.
                change.color_by = change.color_by.take().filter(|_| color.is_none());
            }
            Event::ColorBy { object, column, map } => {
                let color_by = column.clone().map(|column| ColorBy { column, map: map.clone() });
                let change = self.change(scene, object)?;
                change.color = change.color.filter(|_| color_by.is_none());
                change.color_by = color_by;
            }
            Event::ObjectTechnique { object, technique } => {
                self.change(scene, object)?.technique.clone_from(technique);
                // Another technique has other settings.
                self.accuracy = Accuracy::default();
            }
            Event::Cuts { cuts } => {
                cuts.iter()
                    .filter_map(|cut| cut.object.as_ref())
                    .try_for_each(|name| rank_of(scene, name).map(|_| ()))?;
                self.cuts.clone_from(cuts);
                // A camera that the data place would follow what is left.
                if scene.fit.is_some() {
                    self.viewpoint.get_or_insert(*first);
                }
            }
            Event::Layer { layer } => self.layer.clone_from(layer),
            Event::Technique { technique } => {
                self.technique.clone_from(technique);
                // Another technique has other settings.
                self.accuracy = Accuracy::default();
            }
            Event::Accuracy { step, set } => self.accuracy = Accuracy { step: *step, set: settings(set)? },
            Event::Exposure { stops } => self.exposure = Some(*stops),
            Event::Size { width, height } => self.size = Some(Size { width: *width, height: *height }),
        }
        Ok(())
    }

    fn change(&mut self, scene: &Scene, name: &str) -> Result<&mut ObjectChange, Error> {
        Ok(self.objects.entry(rank_of(scene, name)?).or_default())
    }

    fn change_light(&mut self, scene: &Scene, label: &str) -> Result<&mut LightChange, Error> {
        let rank = scene.lights.iter().position(|light| light.label == label);
        let rank = rank.ok_or_else(|| {
            let labels: Vec<String> = scene.lights.iter().map(|light| format!("`{}`", shown(&light.label))).collect();
            let hint = if labels.is_empty() {
                "the scene has none".into()
            } else {
                format!("the scene has {}", labels.join(", "))
            };
            Error::input("event", format!("expected the name of a light, found `{}`", shown(label)), hint)
        })?;
        Ok(self.lights.entry(rank).or_default())
    }

    /// The changes as those of the command line: `organza render SCENE` with them draws the same picture.
    fn overrides(&self, scene: &Scene, aims: impl Fn(&Scene) -> Vec<Aim>) -> Result<Vec<Override>, Error> {
        let size = self.size.unwrap_or(Size::of_scene(scene));
        let mut changes = Vec::new();
        if let Some(viewpoint) = &self.viewpoint {
            changes.push(Override::parse(&camera(viewpoint, size))?);
        } else if self.size.is_some() {
            changes.push(Override::parse(&format!("camera.size=[{}, {}]", size.width, size.height))?);
        }
        for (rank, change) in &self.objects {
            let key = key_of(scene, *rank);
            if let Some(visible) = change.visible {
                changes.push(Override::parse(&format!("object.{key}.visible={visible}"))?);
            }
            if let Some(opacity) = change.opacity {
                changes.push(Override::parse(&format!("object.{key}.opacity={opacity:?}"))?);
            }
            let stated = scene.objects.get(*rank);
            if change.color.is_some() && stated.is_some_and(|object| object.points.color_by.is_some()) {
                changes.push(Override::parse(&format!("object.{key}.color_by="))?);
            }
            if change.color_by.is_some() && stated.is_some_and(|object| object.color.is_some()) {
                changes.push(Override::parse(&format!("object.{key}.color="))?);
            }
            if let Some(color) = &change.color {
                changes.push(Override::parse(&format!("object.{key}.color={color:?}"))?);
            }
            if let Some(ColorBy { column, map }) = &change.color_by {
                let text = |name: &String| toml_edit::Value::from(name.as_str()).to_string();
                let map = map.as_ref().map_or_else(String::new, |map| format!(", map = {}", text(map)));
                changes.push(Override::parse(&format!("object.{key}.color_by={{ column = {}{map} }}", text(column)))?);
            }
            if let Some(knots) = &change.knots {
                changes.push(Override::parse(&format!("object.{key}.transfer={}", transfer(knots)))?);
            }
        }
        for (rank, object) in scene.objects.iter().enumerate() {
            let is_of = |cut: &&Cut| cut.object.as_ref().is_none_or(|name| *name == object.name);
            let cuts: Vec<&Cut> = self.cuts.iter().filter(is_of).collect();
            if !cuts.is_empty() {
                let key = key_of(scene, rank);
                changes.push(Override::parse(&format!("object.{key}.clip={}", clip(object, &cuts)))?);
            }
        }
        let is_turned = self.lights.values().any(|change| change.direction.is_some());
        let aims = if is_turned { aims(scene) } else { Vec::new() };
        for (rank, change) in &self.lights {
            let aim = aims.get(*rank).copied().unwrap_or(Aim::Direction);
            let Some(light) = scene.lights.get(*rank) else { continue };
            for (key, value) in change.keys(light, scene.target, aim) {
                changes.push(Override::parse(&format!("light.{rank}.{key}={value}"))?);
            }
        }
        if let Some(layer) = &self.layer {
            let mut layers: Vec<String> = scene.render.layers.names().map(|name| format!("{name:?}")).collect();
            layers.push(format!("{layer:?}"));
            changes.push(Override::parse(&format!("render.layers=[{}]", layers.join(", ")))?);
        }
        if let Some(exposure) = self.exposure {
            changes.push(Override::parse(&format!("render.exposure={exposure:?}"))?);
        }
        for (name, switch) in &self.effects {
            changes.push(Override::of_effect(&format!("{name}={}", switch.word()))?);
        }
        if let Some(technique) = &self.technique {
            changes.push(Override::parse(&format!("render.technique={technique:?}"))?);
        }
        for (rank, object) in scene.objects.iter().enumerate() {
            let of_object = self.objects.get(&rank).and_then(|change| change.technique.as_ref());
            // An object that names a technique in the scene would keep it.
            let of_picture = self.technique.as_ref().filter(|_| object.technique.is_some());
            if let Some(technique) = of_object.or(of_picture) {
                let key = key_of(scene, rank);
                changes.push(Override::parse(&format!("object.{key}.technique={technique:?}"))?);
            }
        }
        changes.extend(self.accuracy.set.iter().cloned());
        Ok(changes)
    }
}

/// The rank of the object of this name.
fn rank_of(scene: &Scene, name: &str) -> Result<usize, Error> {
    let rank = scene.objects.iter().position(|object| object.name == name);
    rank.ok_or_else(|| {
        let names: Vec<String> = scene.objects.iter().map(|object| format!("`{}`", shown(&object.name))).collect();
        let hint = format!("the scene has {}", names.join(", "));
        Error::input("event", format!("expected the name of an object, found `{}`", shown(name)), hint)
    })
}

/// An object as a path of keys names it: by its name where that is a plain word, else by its rank.
fn key_of(scene: &Scene, rank: usize) -> String {
    let name = scene.objects.get(rank).map_or("", |object| object.name.as_str());
    let is_plain = |c: char| c.is_alphanumeric() || "_-".contains(c);
    let is_word = !name.is_empty() && name.chars().all(is_plain) && name.parse::<usize>().is_err();
    if is_word { name.to_owned() } else { rank.to_string() }
}

/// Regions that an object is kept in: its own, and one for each cut, in the coordinates of its source.
fn clip(object: &scene::SceneObject, cuts: &[&Cut]) -> String {
    let half_space =
        |normal: DVec3, point: DVec3| format!("{{ normal = {:?}, point = {:?} }}", normal.to_array(), point.to_array());
    let of_scene = object.clip.iter().map(|clip| match clip {
        Clip::HalfSpace { normal, offset } => half_space(*normal, *normal * (offset / normal.length_squared())),
        Clip::Box(bounds) => format!("{{ box = [{:?}, {:?}] }}", bounds.min.to_array(), bounds.max.to_array()),
    });
    let transform = &object.transform;
    let back = transform.rotation.inverse();
    let of_view = cuts.iter().map(|cut| {
        let point = back * (DVec3::from(cut.point) - transform.translation) / transform.scale;
        half_space(back * DVec3::from(cut.normal), point)
    });
    format!("[{}]", of_scene.chain(of_view).collect::<Vec<_>>().join(", "))
}

/// Control points as a scene has them.
fn transfer(knots: &[Knot]) -> String {
    let knot = |knot: &Knot| {
        let Knot { value, color: [red, green, blue], extinction } = knot;
        format!("{{ value = {value:?}, color = [{red:?}, {green:?}, {blue:?}], extinction = {extinction:?} }}")
    };
    format!("[{}]", knots.iter().map(knot).collect::<Vec<_>>().join(", "))
}

/// The camera of a viewpoint as a change of the scene.
fn camera(viewpoint: &Viewpoint, size: Size) -> String {
    let vector = |v: splat_core::glam::DVec3| format!("[{:?}, {:?}, {:?}]", v.x, v.y, v.z);
    let projection = match viewpoint.projection {
        Projection::Perspective { fov_y } => format!("fov_y = {:?}", degrees(fov_y)),
        Projection::Orthographic { height } => format!("orthographic = {height:?}"),
    };
    format!(
        "camera={{ position = {}, target = {}, up = {}, {projection}, size = [{}, {}] }}",
        vector(viewpoint.eye()),
        vector(viewpoint.centre),
        vector(viewpoint.up()),
        size.width,
        size.height
    )
}

/// An angle in degrees that has the same bits when it is read again, with few digits where some have them.
fn degrees(radians: f64) -> f64 {
    let exact = radians.to_degrees();
    let few = (exact * 1e6).round() / 1e6;
    if few.to_radians() == radians { few } else { exact }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SCENE: &str = r#"version = 1
        [camera]
        position = [0, 1, 4]
        target = [0, 0, 0]
        fov_y = 35
        size = [64, 48]
        [[light]]
        name = "sun"
        kind = "directional"
        direction = [0, -1, 0]
        irradiance = [1, 1, 1]
        [[object]]
        name = "pane"
        rectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }
        [[object]]
        name = "a.b = c"
        rectangle = { center = [0, 0, 1], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }
        [[object]]
        name = "fog"
        medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = 0.1 }
    "#;

    fn source() -> Source {
        let Opening { file, text, load, .. } = Opening::of_text("a.toml", SCENE, RenderOptions::default());
        Source { file, text, load }
    }

    /// The scene after these events.
    fn after(events: &[Event]) -> Result<Scene, Error> {
        let source = source();
        let scene = source.scene(Vec::new()).unwrap();
        let first = Viewpoint::of_scene(&scene);
        let mut state = State::default();
        events.iter().try_for_each(|event| state.apply(event, &scene, &first))?;
        source.scene(source.overrides(&state, &scene)?)
    }

    fn show(object: &str, visible: bool) -> Event {
        Event::Show { object: object.into(), visible }
    }

    #[test]
    fn events_change_what_they_name_and_nothing_else() {
        let events = [
            show("a.b = c", false),
            Event::Opacity { object: "pane".into(), opacity: Some(0.25) },
            Event::Effect { name: "shadow.sun".into(), switch: Switch::Off },
            Event::Exposure { stops: 1.5 },
            Event::Size { width: 32, height: 24 },
        ];
        let scene = after(&events).unwrap();
        let before = after(&[]).unwrap();
        assert_eq!(scene.objects.iter().map(|o| o.visible).collect::<Vec<_>>(), [true, false, true]);
        assert_eq!(scene.objects[0].opacity, Some(0.25));
        assert_eq!((scene.render.exposure, scene.camera.size), (1.5, [32, 24]));
        assert_eq!(scene.render.effects.len(), 1);
        assert_eq!(scene.camera.position, before.camera.position);
        let reset = after(&[Event::Orbit { right: 1.0, up: 0.1 }, Event::Reset {}]).unwrap();
        assert_eq!(reset, before);
    }

    #[test]
    fn a_viewpoint_stays_when_other_things_change() {
        let orbit = Event::Orbit { right: 0.5, up: 0.0 };
        let scene = after(&[orbit.clone(), Event::Size { width: 10, height: 10 }, show("fog", false)]).unwrap();
        // Half a height is a quarter of a turn: from +Z to −X.
        assert!((scene.camera.position - splat_core::glam::DVec3::new(-4.0, 1.0, 0.0)).length() < 1e-12);
        assert_eq!(scene.camera.size, [10, 10]);
        assert_eq!(scene.camera.projection, after(&[]).unwrap().camera.projection);
    }

    #[test]
    fn a_light_is_brighter_comes_from_elsewhere_and_casts_no_shadow() {
        let light = || "sun".to_owned();
        let scene = after(&[
            Event::LightIntensity { light: light(), stops: 1.0 },
            Event::LightDirection { light: light(), azimuth: 90.0, elevation: 0.0 },
            Event::LightShadow { light: light(), shadow: false },
        ])
        .unwrap();
        let found = &scene.lights[0];
        assert_eq!((found.light.intensity, found.shadow), ([2.0; 3], false));
        let splat_core::LightShape::Directional { direction } = found.light.shape else { panic!("{found:?}") };
        assert!((direction - splat_core::glam::DVec3::NEG_X).length() < 1e-12, "{direction}");
        let again = after(&[
            Event::LightIntensity { light: light(), stops: 1.0 },
            Event::LightIntensity { light: light(), stops: 0.0 },
        ]);
        assert_eq!(again.unwrap(), after(&[]).unwrap());
    }

    #[test]
    fn a_shadow_with_cells_of_its_own_is_switched_off_and_on() {
        let text = SCENE.replace("name = \"sun\"", "name = \"sun\"\nshadow_cells = 128");
        let Opening { file, text, load, .. } = Opening::of_text("a.toml", text, RenderOptions::default());
        let source = Source { file, text, load };
        let scene = source.scene(Vec::new()).unwrap();
        let mut state = State::default();
        let first = Viewpoint::of_scene(&scene);
        for (shadow, cells) in [(false, None), (true, Some(128))] {
            state.apply(&Event::LightShadow { light: "sun".into(), shadow }, &scene, &first).unwrap();
            let changed = source.scene(source.overrides(&state, &scene).unwrap()).unwrap();
            assert_eq!((changed.lights[0].shadow, changed.lights[0].shadow_cells), (shadow, cells));
        }
    }

    #[test]
    fn a_layer_is_kept_beside_those_of_the_scene() {
        let scene = after(&[Event::Layer { layer: Some("normal".into()) }]).unwrap();
        assert_eq!(scene.render.layers.names().collect::<Vec<_>>(), ["normal"]);
        let back = [Event::Layer { layer: Some("normal".into()) }, Event::Layer { layer: None }];
        assert_eq!(after(&back).unwrap(), after(&[]).unwrap());
    }

    #[test]
    fn settings_of_accuracy_are_the_scene_s_and_are_taken_back() {
        let accuracy =
            |step, set: &[&str]| Event::Accuracy { step, set: set.iter().map(|s| (*s).to_owned()).collect() };
        let fast = accuracy(-3, &["render.antialias=1", "render.splat_share=0.25", "render.shadow.cells=64"]);
        let scene = after(std::slice::from_ref(&fast)).unwrap();
        let render = &scene.render;
        assert_eq!((render.antialias, render.splat_share, render.shadow.cells), (1, 0.25, Some(64)));
        assert_eq!(after(&[fast, accuracy(0, &[])]).unwrap(), after(&[]).unwrap());
        // What the scene refuses is refused.
        assert!(after(&[accuracy(1, &["render.antialias=99"])]).is_err());
    }

    #[test]
    fn a_cut_is_where_it_is_in_the_world_and_cuts_of_the_scene_stay() {
        let text = SCENE.replace(
            "name = \"fog\"",
            "name = \"fog\"\ntransform = { scale = 2, rotate = [0, 0, 90], translate = [1, 2, 3] }\n\
             clip = [{ normal = [0, 0, 2], point = [0, 0, 0.25] }, { box = [[-1, -1, -0.5], [1, 0.75, 1]] }]",
        );
        let Opening { file, text, load, .. } = Opening::of_text("a.toml", text, RenderOptions::default());
        let source = Source { file, text, load };
        let scene = source.scene(Vec::new()).unwrap();
        let cut = |object: Option<&str>, point: [f64; 3]| Cut {
            object: object.map(str::to_owned),
            normal: [1.0, 2.0, 0.0],
            point,
        };
        let changed = |cuts: Vec<Cut>| {
            let mut state = State::default();
            state.apply(&Event::Cuts { cuts }, &scene, &Viewpoint::of_scene(&scene)).unwrap();
            source.scene(source.overrides(&state, &scene).unwrap()).unwrap()
        };
        let both = changed(vec![cut(None, [0.5, 2.0, 9.0]), cut(Some("fog"), [2.0, 2.0, 2.0])]);
        assert_eq!(both.objects.iter().map(|object| object.clip.len()).collect::<Vec<_>>(), [1, 1, 4]);
        let fog = &both.objects[2];
        assert_eq!(fog.clip[1], scene.objects[2].clip[1]);
        for k in 0..1000 {
            let number = |seed: u64| 2.0 * splat_core::rng::unit(seed, 0, k, 0) - 1.0;
            let place = DVec3::new(number(1), number(2), number(3));
            let world = fog.transform.apply(place);
            let is_kept = |point: DVec3| DVec3::new(1.0, 2.0, 0.0).dot(world - point) <= 0.0;
            assert_eq!(fog.clip[2].keeps(place), is_kept(DVec3::new(0.5, 2.0, 9.0)), "{place}");
            assert_eq!(fog.clip[3].keeps(place), is_kept(DVec3::splat(2.0)), "{place}");
            assert_eq!(fog.clip[0].keeps(place), place.z <= 0.25, "{place}");
        }
        assert_eq!(changed(Vec::new()), scene);
    }

    #[test]
    fn a_camera_that_the_data_place_does_not_follow_a_cut() {
        let text = SCENE.replace("position = [0, 1, 4]\n        target = [0, 0, 0]\n        fov_y = 35", "auto = true");
        let Opening { file, text, load, .. } = Opening::of_text("a.toml", text, RenderOptions::default());
        let scene = Source { file, text, load }.scene(Vec::new()).unwrap();
        assert!(scene.fit.is_some());
        let first = Viewpoint::of_scene(&after(&[]).unwrap());
        let mut state = State::default();
        state.apply(&Event::Exposure { stops: 1.0 }, &scene, &first).unwrap();
        assert_eq!(state.viewpoint(), None);
        state.apply(&Event::Cuts { cuts: Vec::new() }, &scene, &first).unwrap();
        assert_eq!(state.viewpoint(), Some(&first));
    }

    #[test]
    fn an_object_has_the_colour_that_was_chosen() {
        let color = |color| Event::Color { object: "pane".into(), color };
        assert_eq!(after(&[color(Some([0.25, 0.5, 1.0]))]).unwrap().objects[0].color, Some([0.25, 0.5, 1.0]));
        assert_eq!(after(&[color(Some([0.25, 0.5, 1.0])), color(None)]).unwrap(), after(&[]).unwrap());
    }

    #[test]
    fn an_object_has_a_colour_or_a_column_whichever_came_last() {
        let text = "version = 1\ncamera = \"auto\"\n\
            [[object]]\nname = \"a\"\nmesh = \"a.ply\"\ncolor = [1, 0, 0]\n\
            [[object]]\nname = \"b\"\nmesh = \"a.ply\"\ncolor_by = { column = \"height\" }\n";
        let Opening { file, text, load, .. } = Opening::of_text("a.toml", text, RenderOptions::default());
        let source = Source { file, text, load };
        let scene = source.scene(Vec::new()).unwrap();
        let changed = |events: &[Event]| {
            let mut state = State::default();
            let first = Viewpoint::of_scene(&after(&[]).unwrap());
            events.iter().for_each(|event| state.apply(event, &scene, &first).unwrap());
            source.scene(source.overrides(&state, &scene).unwrap()).unwrap()
        };
        let color = |object: &str, color| Event::Color { object: object.into(), color };
        let column = |object: &str, column: Option<&str>| Event::ColorBy {
            object: object.into(),
            column: column.map(str::to_owned),
            map: Some("turbo".into()),
        };
        let columns = |scene: &Scene| {
            let name = |object: &scene::SceneObject| Some(object.points.color_by.as_ref()?.column.clone());
            scene.objects.iter().map(name).collect::<Vec<_>>()
        };
        let by_column = changed(&[column("a", Some("U \"1\":x")), color("b", Some([0.0, 1.0, 0.5]))]);
        assert_eq!(columns(&by_column), [Some("U \"1\":x".to_owned()), None]);
        assert_eq!((by_column.objects[0].color, by_column.objects[1].color), (None, Some([0.0, 1.0, 0.5])));
        let last = changed(&[column("a", Some("x")), color("a", Some([0.5; 3]))]);
        assert_eq!((columns(&last)[0].clone(), last.objects[0].color), (None, Some([0.5; 3])));
        let last = changed(&[color("b", Some([0.5; 3])), column("b", Some("x"))]);
        assert_eq!((columns(&last)[1].clone(), last.objects[1].color), (Some("x".to_owned()), None));
        assert_eq!(changed(&[column("a", Some("x")), column("a", None)]), scene);
    }

    #[test]
    fn a_technique_of_one_object_stands_before_that_of_all() {
        let of_all = Event::Technique { technique: Some("points".into()) };
        let fog_by = |technique: Option<&str>| Event::ObjectTechnique {
            object: "fog".into(),
            technique: technique.map(str::to_owned),
        };
        let scene = after(&[fog_by(Some("sheets")), of_all.clone()]).unwrap();
        assert_eq!(scene.render.technique, scene::Technique::Points);
        assert_eq!(scene.objects[2].technique, Some(scene::Technique::Sheets));
        assert_eq!(after(&[fog_by(Some("sheets")), fog_by(None)]).unwrap(), after(&[]).unwrap());
        assert!(after(&[fog_by(Some("paint"))]).is_err());
    }

    #[test]
    fn a_technique_is_that_of_every_object() {
        let text = SCENE.replace(
            "spacing = 0.1 }\n        [[object]]\n        name = \"fog\"",
            "spacing = 0.1 }\n        technique = \"surfels\"\n        [[object]]\n        name = \"fog\"",
        );
        let Opening { file, text, load, .. } = Opening::of_text("a.toml", text, RenderOptions::default());
        let source = Source { file, text, load };
        let scene = source.scene(Vec::new()).unwrap();
        assert_eq!(scene.objects[1].technique, Some(scene::Technique::Surfels));
        let mut state = State::default();
        let event = Event::Technique { technique: Some("points".into()) };
        state.apply(&event, &scene, &Viewpoint::of_scene(&scene)).unwrap();
        let changed = source.scene(source.overrides(&state, &scene).unwrap()).unwrap();
        assert_eq!(changed.render.technique, scene::Technique::Points);
        assert_eq!(changed.objects[1].technique, Some(scene::Technique::Points));
        assert!(changed.objects[0].technique.is_none());
    }

    #[test]
    fn an_effect_is_left_to_the_plan_again() {
        let switch = |switch| Event::Effect { name: "shadow.sun".into(), switch };
        assert_eq!(after(&[switch(Switch::On), switch(Switch::Auto)]).unwrap().render.effects, []);
    }

    #[test]
    fn an_object_is_shown_that_was_switched_off_as_an_effect() {
        let off = Event::Effect { name: "object.fog".into(), switch: Switch::Off };
        assert!(!after(std::slice::from_ref(&off)).unwrap().objects[2].visible);
        let shown = after(&[off, show("fog", true)]).unwrap();
        assert!(shown.objects[2].visible && shown.render.effects.is_empty());
    }

    #[test]
    fn what_a_scene_does_not_have_is_refused() {
        for event in [
            show("nobody", true),
            Event::Opacity { object: "fog".into(), opacity: Some(0.5) },
            Event::Effect { name: "shadow.moon".into(), switch: Switch::Off },
            Event::Effect { name: "translucency".into(), switch: Switch::Off },
            Event::Effect { name: String::new(), switch: Switch::Off },
            Event::LightShadow { light: "moon".into(), shadow: false },
            Event::Transfer {
                object: "pane".into(),
                knots: Some(vec![Knot { value: 0.0, color: [1.0; 3], extinction: 1.0 }]),
            },
            Event::Color { object: "nobody".into(), color: None },
            Event::Cuts { cuts: vec![Cut { object: Some("nobody".into()), normal: [0.0, 1.0, 0.0], point: [0.0; 3] }] },
            Event::Layer { layer: Some("no\"thing".into()) },
            Event::Size { width: 0, height: 4 },
            Event::Orbit { right: f64::NAN, up: 0.0 },
        ] {
            assert!(after(std::slice::from_ref(&event)).is_err(), "{event:?}");
        }
    }
}
