//! What will be done for a scene: the effects to simulate, the passes to run, what draws each object.
//!
//! Each effect that is left out carries a bound on how much any displayed pixel (0 to 1) could differ with it; their sum stays below the tolerance. A
//! pass that is not in the plan does not run, and its buffers are not allocated: the cost record shows it.

pub use crate::form::{Form, PlannedObject};
use crate::load::Loaded;
use crate::pass;
use crate::scene::{ComparedTechnique, EffectKind, LightPoint, SwitchedEffect, Technique};
use crate::shadows::ShadowTable;
use splat_core::Object;

/// How much an effect may change a displayed pixel, 0 to 1, if it is left out.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bound {
    /// By nothing.
    Nothing,
    /// By no more than this.
    AtMost(f64),
    /// No bound is known.
    Unknown,
}

impl Bound {
    /// No more than a change, which may be larger than 1; by nothing where that is 0.
    pub fn at_most(change: f64) -> Self {
        if change == 0.0 { Self::Nothing } else { Self::AtMost(change.min(1.0)) }
    }

    /// As a number; `None` where none is known.
    pub const fn number(self) -> Option<f64> {
        match self {
            Self::Nothing => Some(0.0),
            Self::AtMost(change) => Some(change),
            Self::Unknown => None,
        }
    }
}

/// One effect of the scene: simulated or not, and why.
#[derive(Debug, Clone, PartialEq)]
pub struct Effect {
    /// What it is, such as `shadow.sun`.
    pub name: String,
    /// Its kind; `None` of one that a technique tells.
    pub kind: Option<EffectKind>,
    /// The light or object that it is of, `sun`; empty for one of the whole scene.
    pub label: String,
    /// What effects of its kind are, in a few words.
    pub what: &'static str,
    /// Whether it is simulated, or would be if a technique of the scene had it.
    pub called_for: bool,
    /// Why or why not.
    pub reason: String,
    /// Largest change of a displayed pixel if it is left out.
    pub bound: Bound,
    /// Whether it is called for and no technique of the scene has it, so that the picture lacks it.
    pub is_lacking: bool,
    /// Whether nothing in the scene causes an effect of its kind.
    pub is_absent: bool,
}

impl Effect {
    /// An effect that a technique tells of, and that no bound leaves out.
    pub(crate) fn of_technique(name: String, what: &'static str, is_called_for: bool, reason: String) -> Self {
        let bound = if is_called_for { Bound::Unknown } else { Bound::Nothing };
        let label = String::new();
        Self {
            name,
            kind: None,
            label,
            what,
            called_for: is_called_for,
            reason,
            bound,
            is_lacking: false,
            is_absent: false,
        }
    }
}

/// What a technique is known to err by where it draws an object: an estimate, not a bound.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// The technique.
    pub technique: Technique,
    /// What it errs in, such as `scatter`.
    pub what: &'static str,
    /// Name of the object.
    pub of_object: String,
    /// Whether an effect is left out, rather than shown inexactly.
    pub is_left_out: bool,
    /// Change of a displayed pixel (0 to 1) that this makes, about; infinite where it is not known.
    pub displayed_error: f64,
    /// Why, in words.
    pub words: String,
}

/// A setting that a scene states or leaves to the plan by `"auto"`, with the value that the picture has.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct PlannedSetting {
    /// Its key, as a scene has it, such as `render.antialias`.
    pub key: String,
    /// The value that the picture is drawn with, as a scene has it.
    pub value: String,
    /// Whether the scene states a value.
    pub is_stated: bool,
    /// Why it has this value.
    pub reason: String,
}

impl PlannedSetting {
    /// A setting of which the scene states the value, or else the plan takes it for this reason.
    pub(crate) fn new(key: impl Into<String>, value: impl ToString, is_stated: bool, reason: &str) -> Self {
        let reason = if is_stated { STATED } else { reason };
        Self { key: key.into(), value: value.to_string(), is_stated, reason: reason.to_owned() }
    }
}

/// Why a setting has the value that a scene states.
const STATED: &str = "the scene states it";

/// One pass that will run.
#[derive(Debug, Clone, PartialEq)]
pub struct PlannedPass {
    /// Name, the same as in the cost record.
    pub name: String,
    /// What it is for.
    pub reason: String,
}

/// What will be done for a scene.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Plan {
    /// Name of the technique, or of several.
    pub technique: String,
    /// The techniques that draw, in the order of their table.
    pub techniques: Vec<Technique>,
    /// All effects that were considered.
    pub effects: Vec<Effect>,
    /// What the techniques that draw err by, and those that `auto` may take in their place, by object.
    pub estimates: Vec<Estimate>,
    /// The techniques that were compared for objects whose technique the scene leaves open; empty where one alone came into question.
    pub compared: Vec<ComparedTechnique>,
    /// Effects of objects that are left out by their bounds: the picture is that of a scene without their causes.
    pub left_out: Vec<SwitchedEffect>,
    /// Settings that have a part in the picture and that a scene may leave to the plan.
    pub settings: Vec<PlannedSetting>,
    /// Passes in the order of running.
    pub passes: Vec<PlannedPass>,
    /// Planes of optical depth, or depth buffers of particles: 1 when all materials absorb red, green and blue alike, else 3.
    pub optical_depth_planes: usize,
    /// For each light, by its place in [`Loaded::lights`](crate::Loaded::lights): whether it shines.
    pub lights: Vec<bool>,
    /// For each of these lights: whether its points get shadow maps.
    pub shadow_maps: Vec<bool>,
    /// For each point of each light, in the order of the frame's points: the table of its shadow map, if it gets one. Chosen by
    /// a look at the splats, when all else is planned.
    pub shadow_tables: Vec<Option<ShadowTable>>,
    /// Whether light is bent, or absorbed inside of what surfaces bound: rays may see what lies out of view.
    pub bends: bool,
    /// Whether light is scattered more than once.
    pub scatters_again: bool,
    /// Lights that are scattered once all the same, because a technique cannot carry the light of some of their points.
    pub scattered_once: usize,
    /// For each point of each light: whether a technique carries its light through what it draws by itself.
    pub carried: Vec<bool>,
    /// For each point whose light is carried: the table of its map of all other casters, if there are any. Where no technique carries light and opaque triangles
    /// cast shadows: for each point, the table of its map of the casters beside these. Else empty.
    pub other_tables: Vec<Option<ShadowTable>>,
    /// The table of the eye's map, which tells the light within media whose spacing is optically thick, if there are any.
    pub eye_table: Option<ShadowTable>,
    /// For each object, by its rank: whether the picture may show it. All in an animation, and where rays are bent or light is carried.
    pub shown: Vec<bool>,
    /// For each point of each light, for each object: whether it may shadow one that is shown, so that the point's map is of it.
    pub casters: Vec<Vec<bool>>,
    /// Bytes that all shadow maps together may take.
    pub shadow_bytes: u64,
    /// What draws each visible object, and from what.
    pub objects: Vec<PlannedObject>,
    /// The technique of each object, by its rank in the scene, visible or not.
    pub by: Vec<Technique>,
    /// For each object, by its rank: whether it is drawn from its own data.
    pub is_own: Vec<bool>,
    /// For each object, by its rank: whether rays meet its opaque discs exactly.
    pub exact: Vec<bool>,
    /// For each object, by its rank: whether its translucent splats are drawn as they are, with the radiance that the frame gives them.
    pub draws: Vec<bool>,
    /// Whether no technique asks for the radiance of splats that opaque ones hide.
    pub skips_hidden: bool,
    /// Whether translucent splats get no light either that lie behind finished pixels in thick media.
    pub skips_behind_finished: bool,
}

impl Effect {
    /// Adds the names of objects whose shadows fall on nothing that is seen to the reason of a shadow.
    pub(crate) fn note_idle_casters(&mut self, objects: &[String]) {
        const NAMED: usize = 3;
        if objects.is_empty() {
            return;
        }
        let names: Vec<String> = objects.iter().take(NAMED).map(|name| format!("'{name}'")).collect();
        let others = objects.len().saturating_sub(NAMED);
        let more = if others > 0 { format!(" and {others} more") } else { String::new() };
        self.reason +=
            &format!("; left out of its maps: {}{more}, whose shadows fall on nothing that is seen", names.join(", "));
    }
}

impl Plan {
    /// Whether the picture shows light that was out of the view before.
    pub(crate) fn leaves_view(&self) -> bool {
        self.bends || self.scatters_again || self.carried.contains(&true)
    }

    /// The effects that the picture lacks, each with what a displayed pixel could change by it at most, as files of the picture name them; empty where it
    /// lacks none. Those that would change nothing are not named.
    pub fn left_out_text(&self) -> String {
        let is_lacked = |effect: &&Effect| {
            let is_off = !effect.called_for && !effect.is_absent && effect.bound != Bound::Nothing;
            effect.is_lacking || is_off
        };
        let one = |effect: &Effect| {
            let bound = effect.bound.number();
            let most = bound.map_or("no bound is known".to_owned(), |share| format!("at most {:.2e}", share));
            format!("{} ({most})", effect.name)
        };
        let lacked: Vec<String> = self.effects.iter().filter(is_lacked).map(one).collect();
        lacked.join(", ")
    }

    /// Whether an estimate is of the technique that draws its object.
    pub fn is_drawn_as(&self, estimate: &Estimate) -> bool {
        let is_its =
            |planned: &PlannedObject| planned.object == estimate.of_object && planned.technique == estimate.technique;
        self.objects.iter().any(is_its)
    }

    /// What draws each object; nothing where one technique draws all of them as splats.
    pub fn chosen(&self) -> &[PlannedObject] {
        let is_plain = self.techniques.len() == 1 && self.objects.iter().all(PlannedObject::is_drawn_as_splats);
        if is_plain { &[] } else { &self.objects }
    }

    /// All tables of shadow maps.
    pub fn tables(&self) -> impl Iterator<Item = &ShadowTable> + Clone {
        self.shadow_tables.iter().chain(&self.other_tables).flatten().chain(&self.eye_table)
    }

    /// The objects of which second maps are made: where light is carried, those that it is not carried through; else those beside opaque triangles,
    /// which shadow each other by z-buffers of their own. `None` where all that receives light asks the same maps.
    pub(crate) fn others(&self, loaded: &Loaded) -> Option<Vec<Object>> {
        match &self.carried[..] {
            [] => loaded.beside_polygons(),
            // A technique that carries light asks the maps of all casters where it does not.
            points => points.contains(&true).then(|| loaded.opaque_objects()),
        }
    }

    /// The limit that the cells of each table end at.
    pub(crate) fn shadow_limits(&self) -> Vec<tsm::Limit> {
        self.tables().map(|table| table.predicted.limit).collect()
    }

    /// How many shadow maps of lights there are.
    pub(crate) fn shadow_maps_built(&self) -> usize {
        self.shadow_tables.iter().chain(&self.other_tables).flatten().count()
    }

    /// Takes the tables in that were chosen, one for each point of a light, then those of [`Plan::other_tables`], and the bytes that their maps may
    /// take together.
    pub(crate) fn set_shadow_tables(&mut self, points: &[LightPoint], tables: Vec<Option<ShadowTable>>, bytes: u64) {
        let mut tables = tables;
        let others = tables.split_off(points.len().min(tables.len()));
        let beside = if self.carried.is_empty() { ", beside opaque triangles" } else { ", of what is opaque" };
        let passes = |tables: &[Option<ShadowTable>], beside: &str| -> Vec<PlannedPass> {
            let one = |(table, point): (&Option<ShadowTable>, &LightPoint)| {
                let reason = table.as_ref()?.describe(&(point.name() + beside));
                Some(PlannedPass { name: pass::SHADOW_MAP.into(), reason })
            };
            tables.iter().zip(points).filter_map(one).collect()
        };
        let made = [passes(&tables, ""), passes(&others, beside)].concat();
        if let Some(at) = self.passes.iter().position(|p| p.name == pass::SHADOW_MAP) {
            self.passes.retain(|p| p.name != pass::SHADOW_MAP);
            self.passes.splice(at..at, made);
        }
        (self.shadow_tables, self.other_tables, self.shadow_bytes) = (tables, others, bytes);
    }

    /// Takes in the table of the eye's map, which is built when splats are to be shaded.
    pub(crate) fn set_eye_table(&mut self, table: Option<ShadowTable>) {
        const DEEP: &str = "; of those behind one another in thick media, where many are, up to the last that is seen";
        self.passes.retain(|p| p.name != pass::EYE_MAP);
        for shading in self.passes.iter_mut().filter(|p| p.name == pass::SHADE) {
            let reason = shading.reason.trim_end_matches(DEEP).to_owned();
            shading.reason = if table.is_some() && self.skips_behind_finished { reason + DEEP } else { reason };
        }
        if let Some(table) = &table {
            let reason = table.describe("light and view are integrated together in each cell of thick media");
            let at = self.passes.iter().position(|p| p.name == pass::SHADE).unwrap_or(self.passes.len());
            self.passes.insert(at, PlannedPass { name: pass::EYE_MAP.into(), reason });
        }
        self.eye_table = table;
    }

    /// The bytes that its shadow maps may take together, where their tables are the same within them.
    pub(crate) fn allow_shadows(&mut self, bytes: u64) {
        let tables = self.shadow_tables.iter_mut().chain(&mut self.other_tables).flatten();
        tables.for_each(|table| table.max_bytes = bytes);
        self.shadow_bytes = bytes;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_names_what_it_lacks_with_bounds() {
        let effect = |name: &str, called_for: bool, bound: Bound, is_lacking: bool| Effect {
            name: name.into(),
            kind: None,
            label: String::new(),
            what: "",
            called_for,
            reason: String::new(),
            bound,
            is_lacking,
            is_absent: false,
        };
        let effects = vec![
            effect("light.key", true, Bound::AtMost(1.0), false),
            effect("light.fill", false, Bound::AtMost(0.00125), false),
            effect("object.lamp", false, Bound::Nothing, false),
            effect("scatter", true, Bound::Unknown, true),
        ];
        let plan = Plan { effects, ..Plan::default() };
        assert_eq!(plan.left_out_text(), "light.fill (at most 1.25e-3), scatter (no bound is known)");
        assert_eq!(Plan::default().left_out_text(), "");
    }
}
