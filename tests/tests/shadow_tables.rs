//! Cells of shadow maps are spent on what the picture shows; what they cost, and what they are too coarse for, is told.

use organza::scene::{LoadOptions, Override, parse};
use organza::{Explanation, Progress, RenderOptions};
use organza_tests::{Picture, Place, draw};
use std::path::Path;

/// A ball on a floor in two lights, and a ball of fog at `fog`, spaced so that it is optically thick.
fn scene(fog: &str, more: &str) -> String {
    format!(
        "version = 1\n[camera]\nposition = [0, 1.5, 6]\ntarget = [0, 0.5, 0]\nfov_y = 35\nsize = [80, 60]\n\
         [ambient]\ncolor = [0.05, 0.05, 0.05]\n\
         [[light]]\nkind = 'point'\nposition = [2, 4, 3]\nintensity = [30, 30, 30]\n\
         [[light]]\nkind = 'directional'\ndirection = [-1, -1, -0.5]\nirradiance = [1, 1, 1]\n\
         [[object]]\nname = 'floor'\nrectangle = {{ center = [0, 0, 0], u = [3, 0, 0], v = [0, 0, -3], spacing = 0.06 }}\n\
         [[object]]\nname = 'ball'\n\
         implicit = {{ expression = '(x+0.9)^2 + (y-0.6)^2 + z^2 - 0.36', box = [[-1.6, -0.1, -0.7], [-0.2, 1.3, 0.7]], resolution = 32 }}\n\
         [[object]]\nname = 'fog'\nmaterial = 'fog'\ntechnique = 'points'\n\
         medium_ball = {{ center = {fog}, radius = 0.6, extinction = 3, spacing = 0.1 }}\n\
         [material.fog]\nmedium = {{ albedo = 0.95 }}\n{more}"
    )
}

/// One that changes nothing.
const ANIMATION: &str = "[animation]\nframes = 2\n[[animation.track]]\nset = 'camera.fov_y'\n\
                         keys = [{ frame = 0, value = 35 }, { frame = 1, value = 35 }]\n";
const HIDDEN: &[&str] = &["--set", "object.fog.visible=false"];

#[test]
fn what_neither_is_seen_nor_shadows_what_is_seen_changes_no_shadow() {
    // Far away; behind the camera; under the floor.
    for fog in ["[500, 1, 0]", "[0, 1, 60]", "[1, -9, 0]"] {
        let text = scene(fog, "");
        let most = difference(&draw(&text, &[]), &draw(&text, HIDDEN));
        // Splats lie about another origin.
        assert!(most < 1e-4, "fog at {fog}: {most}");
    }
    // Tables of an animation are of all casters, whatever is in view.
    let [moving, still] = [ANIMATION, ""].map(|more| draw(&scene("[500, 1, 0]", more), &[]));
    assert!(difference(&moving, &still) > 0.02);
}

/// The greatest difference of a channel of the picture.
fn difference(picture: &Picture, other: &Picture) -> f64 {
    let of_channel = |name: &str| {
        let values = picture.channel(name).into_iter().zip(other.channel(name));
        values.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    ["R", "G", "B"].into_iter().map(of_channel).fold(0.0, f64::max)
}

#[test]
fn what_is_not_seen_shadows_what_is_seen() {
    // Before the lamp, and in the way of the parallel light, both above the view.
    for fog in ["[1.2, 3.2, 1.8]", "[2.6, 3.4, 1.3]"] {
        let text = scene(fog, "");
        let lit = draw(&text, &[]);
        assert!(difference(&lit, &draw(&text, HIDDEN)) > 0.02, "fog at {fog}");
        // All cast there.
        assert!(lit == draw(&scene(fog, ANIMATION), &[]), "fog at {fog}");
    }
}

#[test]
fn frames_of_a_turntable_are_those_drawn_alone() {
    // The ball of fog comes into view on the way around.
    let place = Place::new(&scene("[0, 0.6, 40]", ""));
    place.expect(0, &["render", "s.toml", "-o", "all.png", "--turntable", "4"], "");
    for frame in 0..4 {
        let frames = format!("--frames={frame}");
        place.expect(0, &["render", "s.toml", "-o", "one.png", "--turntable", "4", &frames], "");
        let [all, one] = ["all", "one"].map(|name| place.pixels(&format!("{name}.000{frame}.png")));
        assert!(all == one, "frame {frame}");
    }
}

fn explain(text: &str, set: &str) -> Explanation {
    let options = LoadOptions { overrides: vec![Override::parse(set).unwrap()], ..LoadOptions::default() };
    let scene = parse(Path::new("s.toml"), text.as_bytes(), &options).unwrap();
    organza::explain(&scene, &RenderOptions::default(), &Progress::new()).unwrap()
}

#[test]
fn cells_are_those_of_lights_and_not_of_the_eye() {
    let text = scene("[1, 0.8, 0]", "");
    let [few, many] = ["8", "512"].map(|cells| explain(&text, &format!("render.shadow={{cells={cells}}}")));
    let [few, many] = [few, many].map(|explained| explained.plan.eye_table.unwrap().predicted);
    assert_eq!(few, many);
}

#[test]
fn cells_that_cost_many_times_the_automatic_ones_are_told() {
    // The lamp is in the fog: each splat near it lies in a large part of all cells.
    let text = scene("[2, 4, 3]", "");
    let told = |set: &str| explain(&text, set).warnings.into_iter().find(|w| w.contains("million entries"));
    let warning = told("render.shadow={cells=768}").unwrap();
    assert!(warning.contains("times those of cells = \"auto\""), "{warning}");
    assert_eq!(told("render.shadow={cells=64}"), None);
    assert_eq!(told("render.shadow={cells='auto'}"), None);
}

/// What is told of the cells when the scene is drawn with so many, of its light or of all.
fn told(set: &str) -> Option<String> {
    let overrides = vec![Override::parse(set).unwrap()];
    let options = LoadOptions { overrides, ..LoadOptions::default() };
    let scene = parse(Path::new("s.toml"), scene("[1, 0.8, 0]", "").as_bytes(), &options).unwrap();
    let render = organza::render(&scene, &RenderOptions::default(), &Progress::new()).unwrap();
    render.warnings.into_iter().find(|w| w.contains("shadows are coarse"))
}

#[test]
fn cells_that_are_seen_are_told_with_what_would_do() {
    let warning = told("render.shadow.cells=24").unwrap();
    let better: u32 = warning.split("shadow_cells = ").nth(1).unwrap().split(' ').next().unwrap().parse().unwrap();
    assert!(better > 24 && warning.contains("most by light 0"), "{warning}");
    assert_eq!(told(&format!("light.0.shadow_cells={better}")), None, "{warning}");
    // A light goes before all lights.
    assert!(told("light.0.shadow_cells=24").unwrap().contains("most by light 0, whose map has 24 cells"));
}
