//! Checks of the effects that a scene switches on or off.

use super::check::At;
use super::de::suggest;
use super::raw_render::RawSwitch;
use super::{LightEffect, SceneLight, SwitchedEffect};
use crate::{Error, shown};
use std::collections::BTreeMap;

/// Checks `[render.effects]`.
pub(super) fn check_effects(
    at: &At<'_>,
    raw: &BTreeMap<String, RawSwitch>,
    lights: &[SceneLight],
) -> Result<Vec<SwitchedEffect>, Error> {
    let known: Vec<(String, LightEffect, &SceneLight)> = lights
        .iter()
        .flat_map(|light| LightEffect::ALL.map(|effect| (effect.name(&light.label), effect, light)))
        .collect();
    let mut switched = Vec::new();
    for (name, switch) in raw {
        let Some((_, effect, light)) = known.iter().find(|(known, ..)| known == name) else {
            let names: Vec<&str> = known.iter().map(|(name, ..)| name.as_str()).collect();
            let message = format!("there is no effect `{}` that can be switched", shown(name));
            return Err(at.key(name).error(message, suggest(name, &names)));
        };
        let is_on = match switch {
            RawSwitch::Auto => continue,
            RawSwitch::On => true,
            RawSwitch::Off => false,
        };
        if *effect == LightEffect::Shadow && is_on && !light.shadow {
            let message = format!("`{}` is on, and the light has shadow = false", shown(name));
            return Err(at.key(name).error(message, "leave one of the two out"));
        }
        switched.push(SwitchedEffect { effect: *effect, light: light.label.clone(), is_on });
    }
    Ok(switched)
}
