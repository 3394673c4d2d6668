//! A person's actions in a view, as data: the page sends them, files record them, tests play them.

use organza::Error;
use organza::scene::{Override, short, shown};
use organza_judge::accuracy::RUNGS_ASIDE;
use serde::{Deserialize, Serialize};

/// Largest number of a drag, in heights of the picture, and of steps of a wheel: more is no hand's.
const MOST: f64 = 1000.0;

/// Coordinates of the world lie between this and its negative.
const FARTHEST: f64 = 1e18;

/// The largest coordinate of a direction is this at least.
const SHORTEST: f64 = 1e-6;

/// Most stops by which a light is made brighter or darker: more is black, or burnt out.
const MOST_STOPS: f64 = 32.0;

/// An action of a person. In JSON an object whose key `do` names it, such as `{"do": "orbit", "right": 0.1, "up": 0}`.
///
/// ```
/// use organza_view::Event;
/// let event: Event = serde_json::from_str(r#"{"do": "zoom", "steps": 2}"#).unwrap();
/// assert_eq!(event, Event::Zoom { steps: 2.0 });
/// assert!(serde_json::from_str::<Event>(r#"{"do": "zoom", "steps": 2, "more": 1}"#).is_err());
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "do", rename_all = "snake_case", deny_unknown_fields)]
pub enum Event {
    /// Turns the scene under the pointer: a drag, in heights of the picture. One height is half a turn.
    Orbit {
        /// To the right.
        right: f64,
        /// Upwards.
        up: f64,
    },
    /// Moves the scene with the pointer: a drag, in heights of the picture.
    Pan {
        /// To the right.
        right: f64,
        /// Upwards.
        up: f64,
    },
    /// Comes nearer by steps of a wheel, or goes away where they are negative.
    Zoom {
        /// Ten steps are about a factor of 3.
        steps: f64,
    },
    /// Looks from a place that is named.
    LookFrom {
        /// Degrees about the pole of the view, from +Z towards +X where the pole is +Y.
        azimuth: f64,
        /// Degrees above the horizon, −90 to 90.
        elevation: f64,
        /// World units between the eye and the centre; `None` keeps it.
        #[serde(default)]
        distance: Option<f64>,
        /// World position in the middle of the picture; `None` keeps it.
        #[serde(default)]
        centre: Option<[f64; 3]>,
    },
    /// Goes back to the scene's own camera.
    Reset {},
    /// Takes the last step back: the viewpoint stays where it is.
    Undo {},
    /// Does again what was taken back.
    Redo {},
    /// Takes all changes back but those of the viewpoint and of the size.
    Restore {},
    /// The hand lets go: what follows is another step, though it changes the same, and the whole picture need not wait for it.
    Done {},
    /// Shows or hides an object.
    Show {
        /// Name of the object.
        object: String,
        /// Whether it is drawn.
        visible: bool,
    },
    /// Sets the opacity of a surface.
    Opacity {
        /// Name of the object.
        object: String,
        /// Opacity of one crossing, 0 to 1; `None` for what the scene says.
        opacity: Option<f64>,
    },
    /// Switches an effect of the plan.
    Effect {
        /// As `organza explain` lists it, such as `shadow.sun`.
        name: String,
        /// Whether it is simulated.
        switch: Switch,
    },
    /// Makes a light brighter or darker than the scene has it.
    LightIntensity {
        /// Label of the light: its name, or its place in the scene's list.
        light: String,
        /// Stops; 0 is what the scene says.
        stops: f64,
    },
    /// Sets from where a light comes: parallel light, or one that stands in a place, which then goes around the centre of the first view.
    LightDirection {
        /// Label of the light.
        light: String,
        /// Degrees about +Y, from +Z towards +X.
        azimuth: f64,
        /// Degrees above the horizon, −90 to 90.
        elevation: f64,
    },
    /// Sets whether a light casts shadows.
    LightShadow {
        /// Label of the light.
        light: String,
        /// Whether it does.
        shadow: bool,
    },
    /// Sets the transfer function of a volume.
    Transfer {
        /// Name of the object.
        object: String,
        /// Its control points by rising value, [`MOST_KNOTS`] at most; `None` for what the scene says.
        knots: Option<Vec<Knot>>,
    },
    /// Sets the colour of an object.
    Color {
        /// Name of the object.
        object: String,
        /// Linear colour, each channel ≥ 0; `None` for what the scene says.
        color: Option<[f64; 3]>,
    },
    /// Colours points or a mesh by a column of its file.
    ColorBy {
        /// Name of the object.
        object: String,
        /// Name of the column; `None` for what the scene says.
        column: Option<String>,
        /// Name of the map, such as `viridis`; `None` for the one that suits the column.
        map: Option<String>,
    },
    /// Draws an object by a technique of its own.
    ObjectTechnique {
        /// Name of the object.
        object: String,
        /// As scenes name it, such as `particles`; `None` for what the scene says.
        technique: Option<String>,
    },
    /// Cuts objects open: all cuts of the view, in the place of those before.
    Cuts {
        /// The planes, [`MOST_CUTS`] at most. Cuts of the scene itself stay.
        cuts: Vec<Cut>,
    },
    /// Shows a layer of the picture in the place of the beauty.
    Layer {
        /// As scenes name it, such as `depth.median`; `None` for the beauty.
        layer: Option<String>,
    },
    /// Draws the scene by another technique, also objects that name one of their own.
    Technique {
        /// As scenes name it, such as `sheets`; `None` for what the scene says.
        technique: Option<String>,
    },
    /// Trades accuracy for time.
    Accuracy {
        /// Position of the slider, from fastest to most exact; 0 is what the scene states.
        step: i32,
        /// The settings that it stands for, each as `--set` takes it, such as `render.antialias=4`; settings of the render alone.
        set: Vec<String>,
    },
    /// Sets the exposure of the displayed picture.
    Exposure {
        /// Stops.
        stops: f64,
    },
    /// Sets the size of the picture.
    Size {
        /// Pixels.
        width: u32,
        /// Pixels.
        height: u32,
    },
}

/// A control point of a transfer function.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Knot {
    /// Value of the volume.
    pub value: f64,
    /// Linear colour, each channel ≥ 0.
    pub color: [f64; 3],
    /// Extinction, 1/world unit, ≥ 0.
    pub extinction: f64,
}

/// A plane beyond which objects are cut away.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Cut {
    /// Name of the object; `None` for every object.
    pub object: Option<String>,
    /// Direction to the side that is cut away, in the world; any length but 0.
    pub normal: [f64; 3],
    /// World position on the plane.
    pub point: [f64; 3],
}

/// Most planes of a view.
pub const MOST_CUTS: usize = 32;

/// Most control points of a transfer function that is drawn by hand.
pub const MOST_KNOTS: usize = 256;

/// Whether an effect is simulated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Switch {
    /// The plan decides, by its bound.
    Auto,
    /// It is simulated.
    On,
    /// It is left out.
    Off,
}

impl Switch {
    /// Its name in scene files.
    pub const fn word(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::On => "on",
            Self::Off => "off",
        }
    }
}

impl Event {
    /// Refuses numbers that no hand makes. Limits of scene keys are checked by the scene, not here.
    ///
    /// # Errors
    /// [`Error::Input`] that names the event and its key.
    pub fn check(&self) -> Result<(), Error> {
        match self {
            Self::Orbit { right, up } => within("orbit", "right", *right, MOST).and(within("orbit", "up", *up, MOST)),
            Self::Pan { right, up } => within("pan", "right", *right, MOST).and(within("pan", "up", *up, MOST)),
            Self::Zoom { steps } => within("zoom", "steps", *steps, MOST),
            Self::LookFrom { azimuth, elevation, distance, centre } => {
                within("look_from", "azimuth", *azimuth, 360.0)?;
                within("look_from", "elevation", *elevation, 90.0)?;
                if let Some(distance) = distance.filter(|distance| !(1e-18..=1e18).contains(distance)) {
                    return Err(bad("look_from", "distance", "a length between 1e-18 and 1e18", distance));
                }
                for number in centre.iter().flatten() {
                    within("look_from", "centre", *number, FARTHEST)?;
                }
                Ok(())
            }
            Self::Exposure { stops } if !stops.is_finite() => Err(bad("exposure", "stops", "a finite number", *stops)),
            Self::Opacity { opacity: Some(opacity), .. } if !(0.0..=1.0).contains(opacity) => {
                Err(bad("opacity", "opacity", "0 to 1", *opacity))
            }
            Self::LightIntensity { stops, .. } => within("light_intensity", "stops", *stops, MOST_STOPS),
            Self::LightDirection { azimuth, elevation, .. } => {
                within("light_direction", "azimuth", *azimuth, 360.0)?;
                within("light_direction", "elevation", *elevation, 90.0)
            }
            Self::Transfer { knots: Some(knots), .. } => check_knots(knots),
            Self::Color { color: Some(color), .. } => {
                let wrong = color.iter().find(|channel| !(0.0..=MOST).contains(*channel));
                wrong.map_or(Ok(()), |channel| Err(bad("color", "color", &format!("0 to {MOST}"), *channel)))
            }
            Self::Cuts { cuts } => check_cuts(cuts),
            Self::Accuracy { step, set } => {
                within("accuracy", "step", f64::from(*step), f64::from(RUNGS_ASIDE))?;
                settings(set).map(|_| ())
            }
            Self::Transfer { knots: None, .. } | Self::Color { color: None, .. } => Ok(()),
            Self::LightShadow { .. } | Self::Layer { .. } => Ok(()),
            Self::Technique { .. } | Self::ColorBy { .. } | Self::ObjectTechnique { .. } => Ok(()),
            Self::Undo {} | Self::Redo {} | Self::Restore {} | Self::Done {} => Ok(()),
            Self::Reset {} | Self::Show { .. } | Self::Opacity { .. } | Self::Effect { .. } => Ok(()),
            Self::Exposure { .. } | Self::Size { .. } => Ok(()),
        }
    }

    /// Its name in files.
    pub(crate) fn word(&self) -> String {
        let document = serde_json::to_value(self).unwrap_or_default();
        document["do"].as_str().unwrap_or_default().to_owned()
    }

    /// What it changes: the kind of the event with the object, the light or the effect that it names. Events with one subject may be one step.
    pub(crate) fn subject(&self) -> String {
        let document = serde_json::to_value(self).unwrap_or_default();
        let name = |key: &str| document[key].as_str().unwrap_or_default();
        ["do", "object", "light", "name"].map(name).join("\n")
    }

    /// Whether it changes where the eye is, and nothing else.
    pub const fn is_of_viewpoint(&self) -> bool {
        matches!(
            self,
            Self::Orbit { .. } | Self::Pan { .. } | Self::Zoom { .. } | Self::LookFrom { .. } | Self::Reset {}
        )
    }
}

fn check_knots(knots: &[Knot]) -> Result<(), Error> {
    if !(1..=MOST_KNOTS).contains(&knots.len()) {
        let found = knots.len();
        let message = format!("`knots`: expected 1 to {MOST_KNOTS} control points, found {found}");
        return Err(Error::input("event `transfer`", message, ""));
    }
    for knot in knots {
        let numbers = [knot.value, knot.extinction].into_iter().chain(knot.color);
        if let Some(number) = numbers.into_iter().find(|number| !number.is_finite()) {
            return Err(bad("transfer", "knots", "finite numbers", number));
        }
    }
    Ok(())
}

fn check_cuts(cuts: &[Cut]) -> Result<(), Error> {
    if cuts.len() > MOST_CUTS {
        let message = format!("`cuts`: expected at most {MOST_CUTS} planes, found {}", cuts.len());
        return Err(Error::input("event `cuts`", message, ""));
    }
    for Cut { normal, point, .. } in cuts {
        for number in normal {
            within("cuts", "normal", *number, MOST)?;
        }
        if normal.iter().all(|number| number.abs() < SHORTEST) {
            return Err(bad("cuts", "normal", &format!("a direction, not shorter than {SHORTEST}"), normal[0]));
        }
        for number in point {
            within("cuts", "point", *number, FARTHEST)?;
        }
    }
    Ok(())
}

/// Most settings that a position of accuracy stands for.
const MOST_SETTINGS: usize = 64;

/// Tables of a scene whose keys trade accuracy for time.
const TABLES: [&str; 6] = ["render", "shadow", "points", "particles", "sheets", "surfels"];

/// The settings of an event as changes of a scene.
///
/// # Errors
/// [`Error::Input`] for what is no setting of the render: an event can neither read files nor change what is seen.
pub(crate) fn settings(set: &[String]) -> Result<Vec<Override>, Error> {
    let bad = |message: String| Error::input("event `accuracy`", message, "");
    if set.len() > MOST_SETTINGS {
        return Err(bad(format!("`set`: expected at most {MOST_SETTINGS} settings, found {}", set.len())));
    }
    let setting = |text: &String| {
        let change = Override::parse(text)?;
        let is_of_render = match change.path() {
            [first, _] => first == "render",
            [first, table, _] if first == "render" => TABLES[1..].contains(&table.as_str()),
            [first, _, key] => first == "object" && key == "lattice",
            _ => false,
        };
        let is_other = ["exposure", "layers", "technique"].iter().any(|key| change.path()[1..] == [(*key).to_owned()]);
        let is_table = change.toml().is_some_and(|value| value.contains(['{', '[']));
        let expected = "expected a setting of the render that trades accuracy for time";
        let is_setting = is_of_render && !is_other && !is_table;
        is_setting.then_some(change).ok_or_else(|| bad(format!("`set`: {expected}, found `{}`", shown(text))))
    };
    set.iter().map(setting).collect()
}

fn within(event: &str, key: &str, number: f64, most: f64) -> Result<(), Error> {
    let is_within = number.abs() <= most;
    is_within.then_some(()).ok_or_else(|| bad(event, key, &format!("-{most} to {most}"), number))
}

fn bad(event: &str, key: &str, expected: &str, found: f64) -> Error {
    Error::input(format!("event `{event}`"), format!("`{key}`: expected {expected}, found {}", short(found)), "")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_event_is_read_as_it_is_written() {
        let events = [
            Event::Orbit { right: 0.1, up: -0.25 },
            Event::Pan { right: -1e-3, up: 2.0 },
            Event::Zoom { steps: -1.5 },
            Event::LookFrom { azimuth: 30.0, elevation: -90.0, distance: None, centre: Some([1.0, 2.0, 3.0]) },
            Event::Reset {},
            Event::Undo {},
            Event::Redo {},
            Event::Restore {},
            Event::Done {},
            Event::Show { object: "a \"b\"".into(), visible: false },
            Event::Opacity { object: "c".into(), opacity: None },
            Event::Effect { name: "shadow.sun".into(), switch: Switch::Off },
            Event::LightIntensity { light: "sun".into(), stops: -0.5 },
            Event::LightDirection { light: "0".into(), azimuth: 120.0, elevation: 45.0 },
            Event::LightShadow { light: "0".into(), shadow: false },
            Event::Transfer { object: "head".into(), knots: None },
            Event::Transfer {
                object: "head".into(),
                knots: Some(vec![Knot { value: 30.5, color: [0.1, 0.2, 0.3], extinction: 2.0 }]),
            },
            Event::Color { object: "c".into(), color: Some([0.25, 0.5, 1.0]) },
            Event::Color { object: "c".into(), color: None },
            Event::Cuts { cuts: vec![Cut { object: None, normal: [0.0, 1.0, 0.0], point: [0.5, 2.5, -1.0] }] },
            Event::Cuts { cuts: Vec::new() },
            Event::ColorBy { object: "c".into(), column: Some("U:x".into()), map: None },
            Event::ObjectTechnique { object: "c".into(), technique: Some("sheets".into()) },
            Event::Layer { layer: Some("normal".into()) },
            Event::Accuracy { step: -2, set: vec!["render.antialias=1".into(), "render.points.exact=false".into()] },
            Event::Technique { technique: Some("sheets".into()) },
            Event::Exposure { stops: -2.0 },
            Event::Size { width: 640, height: 360 },
        ];
        for event in events {
            event.check().unwrap();
            let text = serde_json::to_string(&event).unwrap();
            assert_eq!(serde_json::from_str::<Event>(&text).unwrap(), event, "{text}");
        }
    }

    fn cut(normal: [f64; 3], point: [f64; 3]) -> Cut {
        Cut { object: None, normal, point }
    }

    #[test]
    fn events_that_no_page_sends_are_refused() {
        for text in [
            r#"{"do": "fly"}"#,
            r#"{"do": "reset", "more": 1}"#,
            r#"{"do": "orbit", "right": 1}"#,
            r#"{"do": "orbit", "right": "1", "up": 0}"#,
            r#"{"do": "effect", "name": "shadow.a", "switch": "maybe"}"#,
            r#"{"do": "size", "width": -1, "height": 2}"#,
            r#"{"do": "cuts", "cuts": [{"object": null, "normal": [0, 1], "point": [0, 0, 0]}]}"#,
            r#"{"do": "cuts", "cuts": [{"object": null, "normal": [0, 1, 0]}]}"#,
            r#"{"do": "color", "object": "a", "color": [1, 1]}"#,
            r#"{"right": 1, "up": 0}"#,
            "[]",
        ] {
            assert!(serde_json::from_str::<Event>(text).is_err(), "{text}");
        }
        for event in [
            Event::Orbit { right: f64::NAN, up: 0.0 },
            Event::Pan { right: 0.0, up: 1e9 },
            Event::Zoom { steps: f64::INFINITY },
            Event::LookFrom { azimuth: 0.0, elevation: 91.0, distance: None, centre: None },
            Event::LookFrom { azimuth: 0.0, elevation: 0.0, distance: Some(0.0), centre: None },
            Event::LookFrom { azimuth: 0.0, elevation: 0.0, distance: None, centre: Some([f64::NAN, 0.0, 0.0]) },
            Event::Exposure { stops: f64::NAN },
            Event::Opacity { object: "a".into(), opacity: Some(1.5) },
            Event::LightIntensity { light: "a".into(), stops: 33.0 },
            Event::LightDirection { light: "a".into(), azimuth: 0.0, elevation: -91.0 },
            Event::Transfer { object: "a".into(), knots: Some(Vec::new()) },
            Event::Color { object: "a".into(), color: Some([0.0, -1.0, 0.0]) },
            Event::Color { object: "a".into(), color: Some([0.0, f64::NAN, 0.0]) },
            Event::Cuts { cuts: vec![cut([0.0; 3], [0.0; 3])] },
            Event::Cuts { cuts: vec![cut([0.0, f64::NAN, 1.0], [0.0; 3])] },
            Event::Cuts { cuts: vec![cut([0.0, 1.0, 0.0], [0.0, 1e19, 0.0])] },
            Event::Cuts { cuts: vec![cut([0.0, 1.0, 0.0], [0.0; 3]); MOST_CUTS + 1] },
            Event::Accuracy { step: 4, set: Vec::new() },
            Event::Accuracy { step: 1, set: vec!["object.a.mesh=b.ply".into()] },
            Event::Accuracy { step: 1, set: vec!["render.effects.shadow=off".into()] },
            Event::Accuracy { step: 1, set: vec!["render={ antialias = 4 }".into()] },
            Event::Accuracy { step: 1, set: vec!["render.exposure=3".into()] },
            Event::Accuracy { step: 1, set: vec!["render.antialias=4".into(); MOST_SETTINGS + 1] },
            Event::Transfer {
                object: "a".into(),
                knots: Some(vec![Knot { value: f64::NAN, color: [0.0; 3], extinction: 0.0 }]),
            },
            Event::Transfer {
                object: "a".into(),
                knots: Some(vec![Knot { value: 0.0, color: [0.0; 3], extinction: 0.0 }; MOST_KNOTS + 1]),
            },
        ] {
            let error = event.check().unwrap_err();
            assert!(error.to_string().contains("expected"), "{event:?}: {error}");
        }
    }
}
