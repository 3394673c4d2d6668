//! What a picture would fail to show is said, with what to change. Of the scenes that come with Organza nothing is: `every_scene`.

use organza::scene::{LoadOptions, parse};
use organza::{Progress, RenderOptions};
use std::path::Path;

/// A ball of fog and a wall, seen from +z; `light` and `render` end the scene.
fn scene(camera: &str, light: &str, wall: &str) -> String {
    format!(
        "version = 1\n[camera]\nposition = [0, 0, 4]\nsize = [16, 12]\n{camera}\n\
         [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
         medium_ball = {{ center = [0, 0, 0], radius = 0.5, spacing = 0.1, extinction = 3 }}\n\
         [[object]]\nname = 'wall'\n{wall}\n\
         rectangle = {{ center = [0, 0, -1], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }}\n\
         [material.fog]\nmedium = {{ albedo = 0.9 }}\n{light}"
    )
}

const AHEAD: &str = "target = [0, 0, 0]";
const AMBIENT: &str = "[ambient]\ncolor = [0.2, 0.2, 0.2]\n";
const LAMP: &str = "[[light]]\nkind = 'point'\nposition = [1, 2, 3]\nintensity = [9, 9, 9]\n";

fn warnings(text: &str) -> Vec<String> {
    ["points", "particles", "sheets"]
        .map(|technique| {
            let set = format!("render.technique='{technique}'");
            let overrides = vec![organza::scene::Override::parse(&set).unwrap()];
            let options = LoadOptions { overrides, ..LoadOptions::default() };
            let scene = parse(Path::new("s.toml"), text.as_bytes(), &options).unwrap();
            organza::render(&scene, &RenderOptions::default(), &Progress::new()).unwrap().warnings
        })
        .into_iter()
        .reduce(|points, particles| {
            // Bounds and brightness differ a little.
            assert_eq!(points.len(), particles.len(), "{points:?} {particles:?}");
            points
        })
        .unwrap()
}

#[track_caller]
fn one(text: &str, expected: &str) {
    let found = warnings(text);
    assert!(found.len() == 1 && found[0].contains(expected), "expected: {expected}\nfound: {found:?}");
}

#[test]
fn a_good_scene_has_none() {
    assert_eq!(warnings(&scene(AHEAD, LAMP, "")), Vec::<String>::new());
}

#[test]
fn a_scene_without_light_is_told() {
    let words = "the scene has no light: add a [[light]]";
    one(&scene(AHEAD, "", ""), words);
    one(&scene(AHEAD, &LAMP.replace("9, 9, 9", "0, 0, 0"), ""), words);
    assert_eq!(warnings(&scene(AHEAD, "[ambient]\ncolor = [0.2, 0.2, 0.2]\n", "")), Vec::<String>::new());
    assert_eq!(warnings(&scene(AHEAD, "[material.x]\nemission = [1, 0, 0]\n", "material = 'x'")), Vec::<String>::new());
    assert_eq!(warnings(&scene(AHEAD, "[material.x]\nshading = 'unlit'\n", "material = 'x'")), Vec::<String>::new());
    // Matter that only absorbs needs none.
    let dark = scene(AHEAD, "[background]\ncolor = [0.5, 0.5, 0.5]\n", "visible = false")
        .replace("albedo = 0.9", "albedo = 0");
    assert_eq!(warnings(&dark), Vec::<String>::new());
}

#[test]
fn a_flat_light_that_is_turned_away_is_told() {
    let rect = |u: &str, v: &str| {
        format!(
            "[[light]]\nkind = 'rect'\nposition = [0, 1, 2]\nu = [{u}]\nv = [{v}]\nintensity = [9, 9, 9]\n{AMBIENT}"
        )
    };
    // u × v is −z, towards the objects.
    assert_eq!(warnings(&scene(AHEAD, &rect("0, 1, 0", "1, 0, 0"), "")), Vec::<String>::new());
    let words = "the flat light at [0.0, 1.0, 2.0] shines along [0.0, 0.0, 1.0], away from all objects";
    one(&scene(AHEAD, &rect("1, 0, 0", "0, 1, 0"), ""), words);
}

#[test]
fn an_object_outside_the_view_is_named_with_its_bounds_and_the_camera() {
    let moved = |to: &str| scene(AHEAD, LAMP, &format!("transform = {{ translate = [{to}] }}"));
    let words = "object 'wall' lies outside the view, from [";
    one(&moved("50, 0, 0"), words);
    one(&moved("0, 0, 50"), words);
    one(&moved("50, 0, 0"), "the camera at [0.0, 0.0, 4.0] looks along [0.0, 0.0, -1.0]");
    // A corner in the picture is enough.
    assert_eq!(warnings(&moved("2.2, 0, 0")), Vec::<String>::new());
    // The body of a lamp may stand where its light is.
    let lamp = LAMP.to_owned()
        + "[[object]]\nname = 'lamp'\n\
        medium_ball = { center = [1, 2, 3], radius = 0.1, spacing = 0.03, extinction = 1 }\n";
    assert_eq!(warnings(&scene(AHEAD, &lamp, "")), Vec::<String>::new());
    // Things come into view in an animation.
    let animated = moved("50, 0, 0") + "[animation]\nframes = 2\n";
    assert_eq!(warnings(&animated), Vec::<String>::new());
}

#[test]
fn objects_outside_the_view_are_not_all_named() {
    let mut text = scene(AHEAD, LAMP, "");
    for i in 0..9 {
        text += &format!(
            "[[object]]\nname = 'far {i}'\nrectangle = {{ center = [{}, 0, -1], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.5 }}\n",
            40 + i
        );
    }
    let found = warnings(&text);
    assert_eq!(found.len(), 5, "{found:?}");
    assert_eq!(found[4], "5 other objects lie outside the view as well");
}

#[test]
fn a_camera_that_sees_nothing_is_told_where_to_look() {
    let found = "the camera sees nothing: all objects lie from [";
    one(&scene("target = [0, 0, 9]", LAMP, ""), found);
    one(
        &scene("target = [0, 9, 4]\north = 1", LAMP, "").replace("orth = 1", "orthographic = 2"),
        "set camera.target to [",
    );
}

#[test]
fn a_picture_of_one_colour_is_told_with_an_exposure() {
    let faint = LAMP.replace("9, 9, 9", "0.0001, 0.0001, 0.0001");
    let found = warnings(&scene(AHEAD, &faint, ""));
    assert!(
        found.len() == 1 && found[0].starts_with("the picture is all black: its brightest radiance is"),
        "{found:?}"
    );
    let stops: f64 = found[0].rsplit(' ').next().unwrap().parse().unwrap();
    assert_eq!(
        warnings(&(scene(AHEAD, &faint, "") + &format!("[render]\nexposure = {stops}\n"))),
        Vec::<String>::new()
    );
    let behind = LAMP.replace("[1, 2, 3]", "[0, 0, -3]").replace("[[light]]", "[[light]]\nshadow = true");
    one(
        &scene(AHEAD, &behind, "").replace("name = 'fog'\n", "name = 'fog'\nvisible = false\n"),
        "no light comes from what the camera sees",
    );
    let bright = LAMP.replace("9, 9, 9", "1e9, 1e9, 1e9") + "[background]\ncolor = [9, 9, 9]\n";
    one(&scene(AHEAD, &bright, ""), "the picture is all white: its darkest radiance is");
}

#[test]
fn objects_that_are_smaller_than_a_pixel_are_told_with_what_to_do() {
    // A head in metres beside a stadium.
    let far = "target = [0, 0, 0]\nfov_y = 35";
    let small = scene(far, LAMP, "").replace("radius = 0.5, spacing = 0.1", "radius = 0.005, spacing = 0.001");
    one(&small, "object 'fog' is 0.1");
    one(&small, "cannot be seen: it is 0.02");
    one(&small, "and 'wall' 3.1; scale it by about 1");
    // Alone there is no other to stand beside.
    let alone = small.replace("[[object]]\nname = 'wall'", "[[object]]\nname = 'wall'\nvisible = false");
    let found = warnings(&alone);
    assert!(found.iter().any(|w| w.contains("move the camera nearer, or set camera = \"auto\"")), "{found:?}");
}

#[test]
fn a_lens_too_wide_for_the_resampling_filter_is_told() {
    let told = |more: &str| {
        let text =
            format!("{}[render]\ntechnique = 'points'\n{more}", scene("target = [0, 0, 0]\nfov_y = 170", LAMP, ""));
        let scene = parse(Path::new("s.toml"), text.as_bytes(), &LoadOptions::default()).unwrap();
        let found = organza::render(&scene, &RenderOptions::default(), &Progress::new()).unwrap().warnings;
        found.iter().any(|w| w.contains("through a lens of 17") && w.contains("resampling_filter = false"))
    };
    assert!(told(""));
    assert!(!told("points = { resampling_filter = false }"));
}

#[test]
fn a_picture_of_one_colour_is_told() {
    let text =
        scene(AHEAD, "[background]\ncolor = [0.2, 0.3, 0.4]\n[material.x]\nshading = 'unlit'\n", "material = 'x'");
    let even = text.replace("spacing = 0.1 }\n", "spacing = 0.1 }\ncolor = [0.2, 0.3, 0.4]\n");
    let even = even.replace("[[object]]\nname = 'fog'", "[[object]]\nname = 'fog'\nvisible = false");
    one(&even, "the picture is all of one colour");
}
