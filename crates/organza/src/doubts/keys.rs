//! Keys of techniques that draw nothing of a picture.

use crate::choose::technique_of;
use crate::scene::{Scene, Technique, TechniqueKey};

/// One sentence for each technique that draws nothing and has settings in the scene.
pub(crate) fn without_part(scene: &Scene) -> Vec<String> {
    let draws = |technique: Technique| {
        scene.objects.iter().any(|object| object.visible && technique_of(object, scene) == technique)
    };
    let sentence = |keys: &[TechniqueKey]| {
        let first = keys.first().filter(|key| !draws(key.technique))?;
        let names: Vec<&str> = keys.iter().map(|key| key.key.as_str()).collect();
        let have = if names.len() == 1 { "has" } else { "have" };
        let names = names.join(", ");
        let technique = first.technique.name();
        Some(format!("{names} {have} no part in this picture: nothing is drawn by the technique `{technique}`"))
    };
    scene.technique_keys.chunk_by(|a, b| a.technique == b.technique).filter_map(sentence).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::{LoadOptions, parse};

    #[test]
    fn keys_of_techniques_that_draw_nothing_are_named_with_their_defaults_too() {
        let said = |render: &str| {
            let text = format!(
                "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [64, 48]\n\
                 [[object]]\nname = 'fog'\nmedium_box = {{ min = [-1, -1, -1], max = [1, 1, 1], extinction = 1, spacing = 0.1 }}\n\
                 [render]\n{render}\n"
            );
            let scene = parse("s.toml".as_ref(), text.as_bytes(), &LoadOptions::default()).unwrap();
            without_part(&scene)
        };
        let keys = "sheets = { kernel_extent = 2, slab_width = 0.1 }\nparticles = { repeat_level = 100 }\n";
        let points = said(&format!("technique = 'points'\n{keys}"));
        assert_eq!(points.len(), 2, "{points:?}");
        assert_eq!(
            points[0],
            "render.sheets.kernel_extent, render.sheets.slab_width have no part in this picture: nothing is drawn by the technique `sheets`"
        );
        assert!(points[1].starts_with("render.particles.repeat_level has no part"), "{points:?}");
        assert!(said(&format!("technique = 'sheets'\n{keys}")).iter().all(|sentence| sentence.contains("particles")));
        assert!(said("technique = 'points'\nantialias = 2\n").is_empty());
    }
}
