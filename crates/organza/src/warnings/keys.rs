//! Keys of techniques that draw nothing of a picture, or nothing that the keys are for.

use crate::choose::technique_of;
use crate::plan::Plan;
use crate::scene::{Scene, SceneLight, Technique, TechniqueKey, light_points};

/// Keys of `sheets` that say how a medium on a lattice is reconstructed.
const OF_LATTICES: [&str; 8] = [
    "render.sheets.aligned",
    "render.sheets.classify",
    "render.sheets.gradients",
    "render.sheets.kernel",
    "render.sheets.kernel_extent",
    "render.sheets.kernel_sections",
    "render.sheets.kernel_sigma",
    "render.sheets.reconstruction",
];

/// One sentence for each technique that draws nothing and has settings in the scene, or draws no medium on a lattice and has settings for such.
pub(crate) fn without_part(scene: &Scene) -> Vec<String> {
    let drawn_by = |technique: Technique| {
        let visible = scene.objects.iter().filter(|object| object.visible);
        visible.filter(move |object| technique_of(object, scene) == technique)
    };
    let sentence = |keys: &[TechniqueKey]| {
        let technique = keys.first()?.technique;
        let has_lattice =
            || drawn_by(technique).any(|object| object.source.is_medium() && !object.source.is_of_points());
        let is_for_lattices = |key: &&TechniqueKey| OF_LATTICES.contains(&key.key.as_str());
        let (unused, what): (Vec<&TechniqueKey>, &str) = match drawn_by(technique).next() {
            None => (keys.iter().collect(), "nothing"),
            Some(_) if has_lattice() => return None,
            Some(_) => (keys.iter().filter(is_for_lattices).collect(), "no medium on a lattice"),
        };
        let names: Vec<&str> = unused.iter().map(|key| key.key.as_str()).collect();
        let have = match names[..] {
            [] => return None,
            [_] => "has",
            _ => "have",
        };
        let names = names.join(", ");
        let technique = technique.name();
        Some(format!("{names} {have} no part in this picture: {what} is drawn by the technique `{technique}`"))
    };
    scene.technique_keys.chunk_by(|a, b| a.technique == b.technique).filter_map(sentence).collect()
}

/// One sentence for each light that states cells of a shadow map which nothing in the picture asks for.
pub(crate) fn idle_cells(lights: &[SceneLight], plan: &Plan) -> Vec<String> {
    let points = light_points(lights);
    let has_map = |rank: usize| {
        let maps = plan.shadow_tables.iter().zip(&points);
        maps.filter(|(table, _)| table.is_some()).any(|(_, point)| point.light_index == rank)
    };
    let idle = lights.iter().enumerate().filter(|(rank, light)| light.shadow_cells.is_some() && !has_map(*rank));
    idle.map(|(_, light)| {
        let label = &light.label;
        format!("light.{label}.shadow_cells has no part in this picture: no shadow map is made of this light")
    })
    .collect()
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

    #[test]
    fn keys_of_lattices_are_named_where_slabs_hold_none() {
        let text = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [64, 48]\n\
                    [[object]]\nname = 'pane'\nopacity = 0.5\nrectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }\n\
                    [render]\ntechnique = 'sheets'\nsheets = { kernel = 'linear', slab_width = 0.1 }\n";
        let scene = parse("s.toml".as_ref(), text.as_bytes(), &LoadOptions::default()).unwrap();
        let expected = "render.sheets.kernel has no part in this picture: no medium on a lattice is drawn by the technique `sheets`";
        assert_eq!(without_part(&scene), [expected]);
    }
}
