//! Passes that a scene does not call for do not run: the cost record has no entry, and the picture does not change.

use organza_tests::{draw, largest_difference, organza, parallel_view};
use serde_json::Value;

/// A wall, a slab of fog and a light; `%` is where a test adds keys to an object or the light.
fn scene(wall: &str, fog: &str, light: &str) -> String {
    parallel_view(2.0, 32)
        + &format!(
            "[material.wall]\ncolor = [0.5, 0.6, 0.7]\n[material.fog]\nshading = 'phase'\n\
             [[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n{light}\n\
             [[object]]\nname = 'wall'\nmaterial = 'wall'\n{wall}\n\
             rectangle = {{ center = [0, 0, -1], u = [1.5, 0, 0], v = [0, 1.5, 0], spacing = 0.05 }}\n\
             [[object]]\nname = 'fog'\nmaterial = 'fog'\ntechnique = 'points'\n{fog}\n\
             medium_box = {{ min = [-3, -3, 0], max = [3, 3, 0.3], extinction = 2.0, spacing = 0.1 }}\n"
        )
}

/// The passes that ran, from `--cost`.
fn cost(scene: &str) -> Vec<Value> {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("s.toml"), scene).unwrap();
    let mut command = organza();
    command.args(["render", "s.toml", "-o", "s.exr", "--cost", "cost.json"]).current_dir(&folder);
    let out = command.output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let cost: Value = serde_json::from_slice(&std::fs::read(folder.path().join("cost.json")).unwrap()).unwrap();
    cost.as_array().unwrap().clone()
}

/// Their names.
fn passes(scene: &str) -> Vec<String> {
    cost(scene).iter().map(|stage| stage["name"].as_str().unwrap().to_owned()).collect()
}

fn ran(scene: &str, pass: &str) -> bool {
    passes(scene).iter().any(|p| p == pass)
}

#[test]
fn x7_a_shadow_map_needs_a_caster_a_receiver_and_a_light() {
    assert!(ran(&scene("", "", ""), "tsm build"));
    let none = "casts_shadow = false";
    assert!(!ran(&scene(none, none, ""), "tsm build"));
    let deaf = "shadow_coefficient = 0";
    assert!(!ran(&scene(deaf, deaf, ""), "tsm build"));
    assert!(!ran(&scene("", "", "shadow = false"), "tsm build"));
    assert!(!ran(&scene("", "", "").replace("irradiance = [1, 1, 1]", "irradiance = [0, 0, 0]"), "tsm build"));
}

#[test]
fn x7_sorting_is_for_translucent_and_opaque_resolution_for_opaque_splats() {
    let whole = passes(&scene("", "", ""));
    assert!(whole.contains(&"hbsort".into()) && whole.contains(&"splat".into()) && whole.contains(&"opaque".into()));
    let solid = passes(&scene("", "visible = false", ""));
    assert!(!solid.contains(&"hbsort".into()) && !solid.contains(&"splat".into()));
    assert!(!ran(&scene("visible = false", "", ""), "opaque"));
}

#[test]
fn x7_what_opaque_splats_hide_is_not_shaded() {
    // A wall before all of the view, and what lies behind it alone.
    let screen = "[[object]]\nname = 'screen'\nrectangle = { center = [0, 0, 1], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.05 }\n";
    let shaded = |text: &str| {
        let stages = cost(text);
        stages.iter().find(|stage| stage["name"] == "shade").map_or(0, |stage| stage["items_in"].as_u64().unwrap())
    };
    let alone = scene("visible = false", "visible = false", "shadow = false") + screen;
    let before = scene("", "", "shadow = false") + screen;
    assert_eq!(shaded(&alone), shaded(&before));
    // Places are rounded otherwise where more objects are.
    let change = largest_difference(&draw(&alone, &[]).channel("G"), &draw(&before, &[]).channel("G"));
    assert!(change < 1e-6, "{change}");
    // A technique that reads them all.
    let whole = before.replace("technique = 'points'", "technique = 'reference'");
    assert!(shaded(&whole) > shaded(&before));
}

#[test]
fn x7_what_lies_deep_in_a_thick_medium_is_not_shaded() {
    let shaded = |text: &str| {
        let stages = cost(text);
        stages.iter().find(|stage| stage["name"] == "shade").map_or(0, |stage| stage["items_in"].as_u64().unwrap())
    };
    // Spacings of an optical depth of 2, ten of them one behind the other: of the fourth less than a thousandth is left.
    let thick = |fog: &str| {
        scene("visible = false", fog, "")
            .replace("extinction = 2.0", "extinction = 20.0")
            .replace("max = [3, 3, 0.3]", "max = [3, 3, 1.0]")
    };
    let all = shaded(&thick("").replace("extinction = 20.0", "extinction = 0.2"));
    let reached = shaded(&thick(""));
    assert!(reached > 0 && 2 * reached < all, "{reached} of {all}");
    // Nothing is cut off, so all is reached.
    assert_eq!(shaded(&(thick("") + "[render.points]\ntransmittance_cutoff = 0\n")), all);
}

#[test]
fn x7_what_was_skipped_changes_no_pixel_by_more_than_the_tolerance() {
    // A fog so thin that its shadow is left out at the default tolerance, and simulated at a tighter one.
    let thin = scene("casts_shadow = false", "", "").replace("extinction = 2.0", "extinction = 0.000005");
    let tight = thin.clone() + "[render]\ntolerance = 1e-12\n";
    assert!(!ran(&thin, "tsm build") && ran(&tight, "tsm build"));
    let without = draw(&thin, &[]);
    let with = draw(&tight, &[]);
    for channel in ["R", "G", "B"] {
        let change = largest_difference(&without.channel(channel), &with.channel(channel));
        assert!(change > 0.0 && change < 1.0 / 255.0, "{channel}: {change:e}");
    }
}

#[test]
fn x7_layers_that_nobody_asked_for_are_not_in_the_file() {
    let names = |arguments: &[&str]| draw(&scene("", "", ""), arguments).names();
    assert_eq!(names(&[]), ["A", "B", "G", "R"]);
    assert!(names(&["--layers", "depth,shadow"]).contains(&"depth.median.Z".to_owned()));
}

#[test]
fn bs09_an_empty_scene_is_the_background_exactly() {
    let text = parallel_view(2.0, 8) + "[background]\ncolor = [0.25, 0.5, 1.5]\n";
    let picture = draw(&text, &[]);
    for (channel, value) in [("R", 0.25), ("G", 0.5), ("B", 1.5), ("opacity.A", 0.0)] {
        assert!(picture.channel(channel).iter().all(|v| *v == value), "{channel}");
    }
}

#[test]
fn x7_explain_names_the_passes_that_render_runs() {
    let folder = tempfile::tempdir().unwrap();
    for text in [scene("", "", ""), scene("visible = false", "", ""), scene("", "visible = false", "shadow = false")] {
        std::fs::write(folder.path().join("s.toml"), &text).unwrap();
        let out = organza().args(["explain", "s.toml", "--json"]).current_dir(&folder).output().unwrap();
        let document: Value = serde_json::from_slice(&out.stdout).unwrap();
        let planned = document["plan"]["passes"].as_array().unwrap();
        let planned: Vec<&str> = planned.iter().map(|p| p["name"].as_str().unwrap()).collect();
        assert_eq!(planned, passes(&text));
    }
}
