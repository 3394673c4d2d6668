//! Checks of the effects that a scene switches on or off.

use crate::at::At;
use crate::render::raw::RawSwitch;
use crate::text::de::suggest;
use crate::{
    EffectKind, Error, HangsOn, RenderSettings, SceneLight, SceneMaterial, SceneObject, Source, SwitchedEffect,
    Technique, shown,
};
use std::collections::BTreeMap;

/// What effects can be of.
pub(crate) struct Causes<'a> {
    pub(crate) lights: &'a [SceneLight],
    pub(crate) objects: &'a [SceneObject],
    pub(crate) materials: &'a [SceneMaterial],
    pub(crate) render: &'a RenderSettings,
}

/// Checks `[render.effects]`.
pub(crate) fn check_effects(
    at: &At<'_>,
    raw: &BTreeMap<String, RawSwitch>,
    causes: &Causes<'_>,
) -> Result<Vec<SwitchedEffect>, Error> {
    let mut switched = Vec::new();
    for (name, switch) in raw {
        let Some((kind, label)) = causes.find(name) else {
            let message = format!("there is no effect `{}` that can be switched", shown(name));
            let names = causes.names();
            let names: Vec<&str> = names.iter().map(String::as_str).collect();
            return Err(at.key(name).error(message, suggest(name, &names)));
        };
        if let Some(why) = kind.fixed_because() {
            return Err(at.key(name).error(format!("`{}` cannot be switched", shown(name)), why));
        }
        let is_on = match switch {
            RawSwitch::Auto => continue,
            RawSwitch::On => true,
            RawSwitch::Off => false,
        };
        if let Some(Contrary { found, hint }) = is_on.then(|| causes.contrary(kind, label)).flatten() {
            return Err(at.key(name).error(format!("`{}` is on, and {found}", shown(name)), hint));
        }
        switched.push(SwitchedEffect { kind, label: label.to_owned(), is_on });
    }
    Ok(switched)
}

/// Why an effect cannot be on, and what to do.
struct Contrary {
    found: &'static str,
    hint: &'static str,
}

impl Contrary {
    fn new(found: &'static str, hint: &'static str) -> Option<Self> {
        Some(Self { found, hint })
    }
}

impl<'a> Causes<'a> {
    /// What the effects of a kind are of, by name; one empty name for the scene.
    fn labels(&self, kind: EffectKind) -> Vec<&'a str> {
        match kind.hangs_on() {
            HangsOn::Light => self.lights.iter().map(|light| light.label.as_str()).collect(),
            HangsOn::Object => self.objects.iter().map(|object| object.name.as_str()).collect(),
            HangsOn::Scene => vec![""],
        }
    }

    /// The effect of a name.
    fn find(&self, name: &str) -> Option<(EffectKind, &'a str)> {
        let word = name.split('.').next().unwrap_or(name);
        let kind = EffectKind::ALL.into_iter().find(|kind| kind.word() == word)?;
        let label = self.labels(kind).into_iter().find(|label| kind.name(label) == name)?;
        Some((kind, label))
    }

    /// Names of all effects that can be switched.
    fn names(&self) -> Vec<String> {
        let switchable = EffectKind::ALL.into_iter().filter(|kind| kind.fixed_because().is_none());
        let of_kind = |kind: EffectKind| self.labels(kind).into_iter().map(move |label| kind.name(label));
        switchable.flat_map(of_kind).collect()
    }

    /// What the scene has that an effect cannot be on beside; `None` where it can.
    fn contrary(&self, kind: EffectKind, label: &str) -> Option<Contrary> {
        if kind == EffectKind::Scatter {
            let hint = "set technique = \"sheets\" with [render.sheets] slicing = \"half_vector\" and scattering = \
                        \"forward_and_back\"";
            let again = self.render.sheets.scattering().is_some();
            let technique = |object: &SceneObject| object.technique.unwrap_or(self.render.technique);
            let is_open = |object: &SceneObject| object.visible && technique(object) == Technique::Auto;
            let may_be = self.render.sheets.scattering_again().is_some() && self.objects.iter().any(is_open);
            return if again || may_be { None } else { Contrary::new("nothing scatters light more than once", hint) };
        }
        let light = self.lights.iter().find(|light| light.label == label);
        if kind == EffectKind::Shadow && light.is_some_and(|light| !light.shadow) {
            return Contrary::new("the light has shadow = false", "leave one of the two out");
        }
        if kind == EffectKind::Soft && light.is_some_and(|light| !light.light.shape.is_extended()) {
            return Contrary::new("the light has no size", "give it the kind sphere, disk or rect");
        }
        let object = self.objects.iter().find(|object| object.name == label)?;
        match kind.hangs_on() {
            HangsOn::Object if !object.visible => {
                Contrary::new("the object has visible = false", "leave one of the two out")
            }
            HangsOn::Object => self.contrary_of(kind, object),
            HangsOn::Light | HangsOn::Scene => None,
        }
    }

    /// The same of an effect of a visible object.
    fn contrary_of(&self, kind: EffectKind, object: &SceneObject) -> Option<Contrary> {
        let is_caused = object.material_ids().any(|id| kind.is_of(&self.materials[id].material));
        let technique = object.technique.unwrap_or(self.render.technique);
        let bends = matches!(technique, Technique::Auto | Technique::Surfels);
        let is_inside = matches!(kind, EffectKind::Bending | EffectKind::Dispersion | EffectKind::Absorption);
        if is_inside && !bends {
            return Contrary::new("the object's technique draws nothing of that", "use technique = \"surfels\"");
        }
        match kind {
            EffectKind::Gradients if !(object.source.has_gradients() && is_caused) => Contrary::new(
                "no volume of it is shaded by its gradients",
                "give a volume a material with shading = \"phong\"",
            ),
            EffectKind::Bending if !is_caused => {
                Contrary::new("no material of the object has an index other than 1", "give its material an `ior`")
            }
            EffectKind::Dispersion if !is_caused => Contrary::new(
                "no material of the object has an index that differs by channel",
                "give its material a `cauchy` whose `b` is above 0",
            ),
            EffectKind::Absorption if !is_caused => Contrary::new(
                "no material of the object absorbs inside",
                "give its material an `absorption_inside` above 0",
            ),
            EffectKind::Color if !is_caused => Contrary::new(
                "all materials of the object absorb red, green and blue alike",
                "give its material an `extinction_rgb` of unequal numbers",
            ),
            _ => None,
        }
    }
}

impl Source {
    /// Whether it is a volume, whose gradients may shade it.
    pub fn has_gradients(&self) -> bool {
        matches!(self, Self::Volume(_) | Self::Density(_) | Self::Cloud(_))
    }
}
