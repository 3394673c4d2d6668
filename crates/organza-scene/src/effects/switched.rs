//! Effects of objects and lights that a scene switches: what is off is taken out of objects, their materials and lights, as if the scene had never said it.

use crate::{EffectKind, HangsOn, SceneLight, SceneMaterial, SceneObject, SwitchedEffect};

/// Takes the causes of effects that are off out of objects and materials. An object whose effect is switched has its material alone: one that
/// others have too is copied, behind all others. Returns whether there is room for the copies: splats keep the number of their material in 16 bits.
pub(crate) fn switch(
    switched: &[SwitchedEffect],
    objects: &mut [SceneObject],
    materials: &mut Vec<SceneMaterial>,
) -> bool {
    for effect in switched.iter().filter(|effect| effect.kind.hangs_on() == HangsOn::Object) {
        let Some(rank) = objects.iter().position(|object| object.name == effect.label) else { continue };
        if effect.kind == EffectKind::Object {
            objects[rank].visible &= effect.is_on;
            continue;
        }
        let used: Vec<usize> = objects[rank].material_ids().collect();
        for id in used {
            if !effect.kind.is_of(&materials[id].material) {
                continue;
            }
            let has_it = |object: &SceneObject| object.material_ids().any(|other| other == id);
            let others = objects.iter().enumerate().filter(|(k, _)| *k != rank);
            let is_shared = others.map(|(_, object)| object).any(has_it);
            let alone = if is_shared { copy(id, &mut objects[rank], materials) } else { id };
            if !effect.is_on {
                materials[alone].material = effect.kind.taken_from(&materials[alone].material);
            }
        }
    }
    materials.len() <= usize::from(u16::MAX)
}

/// Takes the size of lights whose softness is off.
pub(crate) fn switch_lights(switched: &[SwitchedEffect], lights: &mut [SceneLight]) {
    for light in lights {
        if SwitchedEffect::find(switched, EffectKind::Soft, &light.label) == Some(false) {
            light.light = light.light.without_size();
            light.samples = 1;
        }
    }
}

/// Gives an object a copy of a material, and returns its place.
fn copy(id: usize, object: &mut SceneObject, materials: &mut Vec<SceneMaterial>) -> usize {
    let copied = materials.len();
    materials.push(materials[id].clone());
    let has_it = object.materials.iter_mut().chain([&mut object.material]).filter(|has| **has == id);
    has_it.for_each(|has| *has = copied);
    copied
}
