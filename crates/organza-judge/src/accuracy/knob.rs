//! The approximations of a technique: its knobs, their steps from coarse to fine, and their ends.

pub(super) mod particles;
pub(super) mod points;
pub(super) mod sheets;
pub(super) mod surfels;
pub(super) mod tables;

use organza::scene::Scene;

/// A picture to draw: a scene, with the settings that scene files cannot state.
#[derive(Debug, Clone, PartialEq)]
pub struct Request {
    /// The scene with its settings.
    pub scene: Scene,
    /// The picture is drawn so many times larger and averaged down: samples beyond `render.antialias`.
    pub oversample: u32,
    /// Splats are packed and unpacked before they are drawn: as they are once a file has kept them.
    pub packed: bool,
}

/// A position of a knob.
#[derive(Debug, Clone, PartialEq)]
pub struct Step {
    /// Value as the report shows it.
    pub label: String,
    /// A quantity that goes to 0 as the knob becomes finer, such as a thickness; `None` for a choice.
    pub size: Option<f64>,
    /// The argument of [`Knob::set`].
    pub value: f64,
}

/// The order of convergence that theory predicts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Theory {
    /// Lowest order that is no surprise.
    pub low: f64,
    /// Highest order that is no surprise.
    pub high: f64,
    /// Why, in one sentence.
    pub why: &'static str,
}

/// An approximation that can be made finer.
#[derive(Debug, Clone)]
pub struct Knob {
    /// Name in reports.
    pub name: &'static str,
    /// The meaning of [`Step::size`], with its unit.
    pub size_meaning: &'static str,
    /// Turns the knob.
    pub set: fn(&mut Request, f64),
    /// Positions from coarse to fine.
    pub steps: Vec<Step>,
    /// The finest position, which is the reference of the others, then its substitutes if it takes more memory than there
    /// is. Empty for a choice.
    pub ends: Vec<Step>,
    /// Whether nothing is left of the approximation at its end.
    pub end_is_exact: bool,
    /// The order that theory expects, if theory states one.
    pub theory: Option<Theory>,
    /// [`Step::size`] of the setting that the scene states; `None` for a choice, and where it is not known.
    pub scene_size: Option<f64>,
    /// Whether the knob takes part in settings that turn all knobs together.
    pub joint: bool,
}

/// A knob that is not turned, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Skipped {
    /// The knob's name.
    pub knob: &'static str,
    /// Why it cannot matter, or does not exist.
    pub reason: String,
}

/// The knobs of a technique in one scene.
#[derive(Debug, Clone)]
pub struct Sweep {
    /// Name of the technique.
    pub technique: &'static str,
    /// The scene as it stands.
    pub base: Request,
    /// The name of the base in reports.
    pub base_label: String,
    /// Knobs that may matter.
    pub knobs: Vec<Knob>,
    /// Knobs that cannot.
    pub skipped: Vec<Skipped>,
    /// Settings that turn all joint knobs together, from coarse to fine.
    pub joint_levels: usize,
}

impl Sweep {
    /// The base with one knob turned.
    pub fn turned(&self, knob: &Knob, step: &Step) -> Request {
        let mut request = self.base.clone();
        (knob.set)(&mut request, step.value);
        request
    }
}
