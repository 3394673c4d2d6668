//! Materials by name, and materials by tints and half-lengths.

use organza::scene::{LoadOptions, Recipe, Scene, parse};
use organza_tests::{Place, SMALL_SCENE};
use splat_core::Shading;
use std::path::Path;

const SURFACE: &str = "[[object]]\nname = 'pane'\n\
    rectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }\nmaterial = 'm'\n";
const MEDIUM: &str = "[[object]]\nname = 'ball'\n\
    medium_ball = { center = [0, 0, 0], radius = 0.6, spacing = 0.2 }\nmaterial = 'm'\n";

/// The scene of a material and of objects that have it, or the error and its hint.
fn scene(material: &str, objects: &[&str]) -> Result<Scene, String> {
    let text = format!("{SMALL_SCENE}[material.m]\n{material}\n{}", objects.concat());
    let parsed = parse(Path::new("s.toml"), text.as_bytes(), &LoadOptions::default());
    parsed.map_err(organza::Error::from).map_err(|error| format!("{error} ({})", error.hint()))
}

#[test]
fn every_preset_is_a_valid_material_in_each_of_its_forms_at_any_length() {
    for recipe in Recipe::list() {
        for metre in ["1e-12", "1", "1e12"] {
            let material = format!("preset = '{}'\nmetre = {metre}", recipe.name);
            for (object, fits) in [(SURFACE, recipe.is_of_surfaces()), (MEDIUM, recipe.is_of_media())] {
                match scene(&material, &[object]) {
                    Ok(_) => assert!(fits, "{}", recipe.name),
                    Err(error) => assert!(!fits && error.contains("alone have"), "{}: {error}", recipe.name),
                }
            }
        }
    }
}

#[test]
fn a_surface_and_a_medium_of_one_preset_have_each_its_own_keys() {
    let scene = scene("preset = 'milk'\nmetre = 0.001", &[SURFACE, MEDIUM]).unwrap();
    let [surface, medium] = [0, 1].map(|rank| &scene.materials[scene.objects[rank].material]);
    assert_eq!([&*surface.name, &*medium.name], ["m", "m"]);
    assert_eq!([surface.material.shading, medium.material.shading], [Shading::Phong, Shading::Phase]);
    assert_eq!(surface.color, [0.91, 0.88, 0.76]);
    assert!((medium.extinction.unwrap() - 3.784e6).abs() < 1.0);
    // The order of ids is that of names, and a medium's form comes last.
    assert_eq!(scene.materials.len(), 3);
}

#[test]
fn keys_beside_a_preset_take_the_place_of_its_own() {
    let scene = scene("preset = 'wax'\ncolor = [0.1, 0.2, 0.3]\nshininess = 3\n", &[SURFACE]).unwrap();
    let found = &scene.materials[scene.objects[0].material];
    assert_eq!((found.color, found.material.shininess, found.material.specular), ([0.1, 0.2, 0.3], 3.0, 0.08));
    let half = scene_material("preset = 'water'\nhalf_length = [1, 2, 4]");
    assert!((half.material.absorption_inside[2] - 0.25 * std::f32::consts::LN_2).abs() < 1e-6);
    assert_eq!(half.material.index, Some([1.333; 3]));
}

fn scene_material(material: &str) -> organza::scene::SceneMaterial {
    let scene = scene(material, &[SURFACE]).unwrap();
    scene.materials[scene.objects[0].material].clone()
}

#[test]
fn a_tint_is_a_colour_an_opacity_and_an_extinction_in_one_key() {
    let tinted = scene_material("tint = [0.8, 0.4, 0.2]");
    assert!((tinted.opacity - 0.8).abs() < 1e-9);
    let passes = tinted.material.extinction_rgb.map(|ratio| (1.0 - tinted.opacity).powf(f64::from(ratio)));
    assert!(passes.iter().zip([0.8, 0.4, 0.2]).all(|(found, stated)| (found - stated).abs() < 1e-6), "{passes:?}");
}

#[test]
fn half_lengths_of_a_medium_leave_half_of_the_light() {
    let scene = scene("medium = { half_length = [0.5, 1, 2] }", &[MEDIUM]).unwrap();
    let found = &scene.materials[scene.objects[0].material];
    assert!((found.extinction.unwrap() - 2.0 * std::f64::consts::LN_2).abs() < 1e-12);
    assert_eq!(found.material.extinction_rgb, [1.0, 0.5, 0.25]);
}

#[test]
fn what_cannot_be_is_refused_with_its_place_and_what_would_do() {
    let cases = [
        ("preset = 'wacks'", SURFACE, "`preset`: expected one of glass,"),
        ("preset = 'milkk'", SURFACE, "did you mean `milk`?"),
        ("metre = 2", SURFACE, "`metre` gives the lengths of a `preset`, and none is named"),
        ("preset = 'milk'\nmetre = 0", SURFACE, "`metre`: expected a number from"),
        ("preset = 'smoke'", SURFACE, "material `m` is `smoke`, which media alone have, and this is a surface"),
        ("preset = 'clay'", MEDIUM, "material `m` is `clay`, which surfaces alone have, and this is a medium"),
        ("tint = [0.5, 0, 1]", SURFACE, "`tint`: expected a number from 0.001 to 1, found 0"),
        ("tint = [0.5, 1, 1]\nextinction_rgb = [1, 1, 1]", SURFACE, "expected one of `tint` and `extinction_rgb`"),
        ("half_length = [1, 1, 0]", SURFACE, "`half_length`: expected a number above 0"),
        ("half_length = [1, 1, 1]\nabsorption_inside = [1, 1, 1]", SURFACE, "found both"),
        ("medium = { half_length = [1, 1, 1], extinction = 1 }", MEDIUM, "expected one of `medium.half_length` and"),
    ];
    for (material, object, words) in cases {
        let error = scene(material, &[object]).map(drop).unwrap_err();
        assert!(error.contains(words), "{material}: {error}");
    }
    // A name that is no table, but a preset.
    let error = scene("", &[&SURFACE.replace("'m'", "'wax'")]).map(drop).unwrap_err();
    assert!(error.contains("add a table [material.wax] with preset = \"wax\""), "{error}");
}

#[test]
fn data_files_have_a_material_by_name() {
    let place = Place::new(SMALL_SCENE);
    place.write("corner.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 2 3\nf 1 4 2\nf 1 3 4\nf 2 4 3\n");
    let text = String::from_utf8(place.expect(0, &["init", "corner.obj", "--material", "water"], "").stdout).unwrap();
    assert!(text.contains("[material.water]\npreset = \"water\"") && text.contains("\nmetre = 0.866 "), "{text}");
    place.expect(0, &["render", "corner.obj", "--material", "wax", "--size", "24x16", "-o", "wax.png"], "");
    place.expect(2, &["render", "corner.obj", "--material", "waxx"], "did you mean `wax`?");
    place.expect(2, &["render", "corner.obj", "--material", "smoke"], "corner.obj is a surface");
    let points: String = (0..64).map(|i| format!("{} {} {}\n", i % 4, i / 4 % 4, i / 16)).collect();
    place.write("cube.xyz", points);
    let text = String::from_utf8(place.expect(0, &["init", "cube.xyz", "--material", "smoke"], "").stdout).unwrap();
    assert!(text.contains("as = \"medium\""), "{text}");
    place.expect(0, &["render", "cube.xyz", "--material", "smoke", "--size", "24x16", "-o", "smoke.png"], "");
}
