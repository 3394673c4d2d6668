//! What a person has changed of a scene, and the scene that follows.

use crate::event::{Event, Switch};
use crate::picture::Size;
use crate::viewpoint::Viewpoint;
use organza::scene::{self, LoadOptions, Override, Scene, printable, shown};
use organza::{Error, Files, InMemory, RenderOptions};
use splat_core::{MemoryAccount, Projection};
use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::PathBuf;

/// A scene that is to be viewed.
pub struct Opening {
    /// What the page is called: the names of the files that were asked for.
    pub title: String,
    /// The scene's file, which gives the format and the folder that paths are relative to; it need not be there.
    pub file: PathBuf,
    /// Its text.
    pub text: Vec<u8>,
    /// How it is loaded, with the changes from the command line.
    pub load: LoadOptions,
    /// What a render may take.
    pub options: RenderOptions,
    /// Files that were read before.
    pub files: Files,
}

impl Opening {
    /// A scene from its text alone.
    pub fn of_text(file: impl Into<PathBuf>, text: impl Into<Vec<u8>>, options: RenderOptions) -> Self {
        let memory = MemoryAccount::new(options.max_memory);
        let load = LoadOptions { memory, in_memory: InMemory::default(), ..LoadOptions::default() };
        let file = file.into();
        let title = printable(file.file_name().unwrap_or(file.as_os_str()).as_ref());
        Self { title, file, text: text.into(), load, options, files: Files::default() }
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

    /// All changes: those of the command line, then those of the view.
    pub(crate) fn overrides(&self, state: &State, scene: &Scene) -> Result<Vec<Override>, Error> {
        Ok([self.load.overrides.clone(), state.overrides(scene)?].concat())
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
            for change in overrides {
                // Writing to a String cannot fail.
                let _ = write!(text, "\n# {}", change.flag());
            }
        }
        text
    }
}

/// What is changed of an object.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
struct ObjectChange {
    visible: Option<bool>,
    opacity: Option<f64>,
}

/// What a person has changed of a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct State {
    viewpoint: Option<Viewpoint>,
    size: Option<Size>,
    exposure: Option<f64>,
    /// By rank in the scene.
    objects: BTreeMap<usize, ObjectChange>,
    effects: BTreeMap<String, Switch>,
}

impl State {
    /// The viewpoint, where a person has moved it.
    pub(crate) fn viewpoint(&self) -> Option<&Viewpoint> {
        self.viewpoint.as_ref()
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
            Event::Show { object, visible } => {
                self.change(scene, object)?.visible = Some(*visible);
                // An object that was switched off as an effect is shown by this.
                self.effects.remove(&format!("object.{object}"));
            }
            Event::Opacity { object, opacity } => self.change(scene, object)?.opacity = *opacity,
            Event::Effect { name, switch } => {
                self.effects.insert(name.clone(), *switch);
            }
            Event::Exposure { stops } => self.exposure = Some(*stops),
            Event::Size { width, height } => self.size = Some(Size { width: *width, height: *height }),
        }
        Ok(())
    }

    fn change(&mut self, scene: &Scene, name: &str) -> Result<&mut ObjectChange, Error> {
        let rank = scene.objects.iter().position(|object| object.name == name);
        let rank = rank.ok_or_else(|| {
            let names: Vec<String> = scene.objects.iter().map(|object| format!("`{}`", shown(&object.name))).collect();
            let hint = format!("the scene has {}", names.join(", "));
            Error::input("event", format!("expected the name of an object, found `{}`", shown(name)), hint)
        })?;
        Ok(self.objects.entry(rank).or_default())
    }

    /// The changes as those of the command line: `organza render SCENE` with them draws the same picture.
    fn overrides(&self, scene: &Scene) -> Result<Vec<Override>, Error> {
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
        }
        if let Some(exposure) = self.exposure {
            changes.push(Override::parse(&format!("render.exposure={exposure:?}"))?);
        }
        for (name, switch) in &self.effects {
            changes.push(Override::of_effect(&format!("{name}={}", switch.word()))?);
        }
        Ok(changes)
    }
}

/// An object as a path of keys names it: by its name where that is a plain word, else by its rank.
fn key_of(scene: &Scene, rank: usize) -> String {
    let name = scene.objects.get(rank).map_or("", |object| object.name.as_str());
    let is_plain = |c: char| c.is_alphanumeric() || "_-".contains(c);
    let is_word = !name.is_empty() && name.chars().all(is_plain) && name.parse::<usize>().is_err();
    if is_word { name.to_owned() } else { rank.to_string() }
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
            Event::Size { width: 0, height: 4 },
            Event::Orbit { right: f64::NAN, up: 0.0 },
        ] {
            assert!(after(std::slice::from_ref(&event)).is_err(), "{event:?}");
        }
    }
}
