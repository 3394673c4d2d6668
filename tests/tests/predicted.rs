//! Long renders are announced before they begin, by counted work: no clock is asked.

use organza::cost::{Item, Prediction, Rates};
use organza::scene::{LoadOptions, parse};
use organza::{Progress, RenderOptions};
use organza_tests::Place;
use std::fs;
use std::path::Path;

/// A medium of extinction 1000, a view of half a unit of its four.
const THICK: &str = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [64, 48]\northographic = 0.5\n\
    [[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n\
    [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
    medium_box = { min = [-2, -0.25, -0.25], max = [2, 0.25, 0.25], extinction = 1000, spacing = 0.1 }\n\
    [material.fog]\nmedium = { albedo = 0.9 }\n[render]\ntechnique = 'particles'\n";

/// Two media at the same depths, by two techniques that take turns.
const MIXED: &str = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [640, 480]\n\
    [[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n\
    [[object]]\nname = 'fog'\nmaterial = 'fog'\ntechnique = 'particles'\n\
    medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 3, spacing = 0.1 }\n\
    [[object]]\nname = 'mist'\nmaterial = 'fog'\ntechnique = 'points'\n\
    medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1, spacing = 0.1 }\n\
    [material.fog]\nmedium = { albedo = 0.9 }\n[render]\ndepth_ranges = 32\n";

/// A lamp inside of fog, with the cells of its shadow table.
const LAMP: &str = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [320, 240]\n\
    [[light]]\nkind = 'point'\nposition = [0, 0, 0]\nintensity = [9, 9, 9]\n\
    [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
    medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1, spacing = 0.08 }\n\
    [material.fog]\nmedium = { albedo = 0.9 }\n[render.shadow]\ncells = 1024\n";

/// The prediction of a scene, with 100 ns for every item, so that it is the same whatever the built-in figures are.
fn predicted(text: &str) -> Prediction {
    let scene = parse(Path::new("s.toml"), text.as_bytes(), &LoadOptions::default()).unwrap();
    let rates = Rates::measured(|_| 100.0, "figures of a test".to_owned());
    let options = RenderOptions { rates, ..RenderOptions::default() };
    organza::explain(&scene, &options, &Progress::new()).unwrap().predicted
}

/// The number of items of a kind in all passes.
fn number(predicted: &Prediction, item: Item) -> f64 {
    predicted.passes().flat_map(|pass| &pass.counts).filter(|count| count.item == item).map(|count| count.number).sum()
}

#[test]
fn particles_of_a_thick_medium_are_announced_with_a_technique_that_is_faster() {
    let predicted = predicted(THICK);
    // One cubic unit of extinction 1000 in particles of a sample's area, (1/192)², in each of 100 sets.
    let particles = 1000.0 * 192.0 * 192.0 * 100.0;
    let counted = number(&predicted, Item::Particle);
    assert!((counted / particles - 1.0).abs() < 0.2, "{counted:e} of {particles:e}");
    let said = predicted.announcement(1).unwrap();
    assert!(said.contains("of it the pass `particles` with") && said.contains("particles of 100 sets"), "{said}");
    assert!(said.contains("`render.technique = \"points\"` takes about"), "{said}");
}

#[test]
fn ranges_of_depth_are_announced_with_their_number() {
    let predicted = predicted(MIXED);
    let said = predicted.announcement(1).unwrap();
    assert!(said.contains("of 100 sets in 32 ranges of depth"), "{said}");
    assert!(said.contains("`render.depth_ranges = 1` takes about"), "{said}");
    let one = self::predicted(&MIXED.replace("depth_ranges = 32", "depth_ranges = 1"));
    for item in [Item::Particle, Item::SetSample] {
        let times = number(&predicted, item) / number(&one, item);
        assert!((times / 32.0 - 1.0).abs() < 0.1, "{}: {times} times", item.name());
    }
}

/// A pane over a ground in the light of two lamps, of which one is too dim to be seen.
const EFFECTS: &str = "version = 1\n[camera]\nposition = [0, 1, 4]\ntarget = [0, 0, 0]\nsize = [32, 24]\n\
    [[light]]\nname = 'sun'\nkind = 'directional'\ndirection = [0.2, -1, -0.3]\nirradiance = [3, 3, 3]\n\
    [[light]]\nname = 'spark'\nkind = 'point'\nposition = [0, 2, 0]\nintensity = [1e-9, 1e-9, 1e-9]\n\
    [[object]]\nname = 'ground'\nrectangle = { center = [0, -0.6, 0], u = [2, 0, 0], v = [0, 0, -2], spacing = 0.05 }\n\
    [[object]]\nname = 'pane'\nopacity = 0.5\n\
    rectangle = { center = [0, 0.2, 0.5], u = [0.4, 0, 0], v = [0, 0, -0.4], spacing = 0.05 }\n\
    [render]\ntechnique = 'points'\n";

#[test]
fn work_of_an_effect_is_what_runs_for_it_alone() {
    let scene = parse(Path::new("s.toml"), EFFECTS.as_bytes(), &LoadOptions::default()).unwrap();
    let explained = organza::explain(&scene, &RenderOptions::default(), &Progress::new()).unwrap();
    let predicted = &explained.predicted;
    let work = |name: &str| predicted.effects.iter().find(|work| work.effect == name);
    let shadow = work("shadow.sun").unwrap();
    let tables = explained.plan.shadow_tables.iter().flatten();
    assert_eq!(shadow.bytes, tables.map(|table| table.predicted.map_bytes).sum::<u64>());
    let of_pass = |pass: &str| {
        let passes = predicted.passes().filter(|planned| planned.pass == pass);
        passes.map(|pass| pass.seconds(&predicted.rates, 1)).sum::<f64>()
    };
    let seconds = |name: &str| work(name).unwrap().seconds(&predicted.rates, 1);
    assert!(seconds("shadow.sun") >= of_pass("tsm build") && seconds("light.sun") > seconds("shadow.sun"));
    // The objects share all that goes by splats; samples of the picture are nobody's.
    let shared: f64 =
        ["tsm build", "hbsort", "project", "shade", "opaque", "splat", "convert"].map(of_pass).iter().sum();
    let objects = seconds("object.ground") + seconds("object.pane");
    assert!((objects / shared - 1.0).abs() < 0.05, "{objects} of {shared}");
    // What is left out takes nothing, and what is part of other passes has no work of its own.
    assert!(["light.spark", "shadow.spark", "translucency", "interreflection"].iter().all(|name| work(name).is_none()));
}

#[test]
fn cells_of_a_shadow_table_are_announced_with_the_automatic_ones() {
    let predicted = predicted(LAMP);
    let said = predicted.announcement(1).unwrap();
    assert!(said.contains("of it the pass `tsm build` with"), "{said}");
    assert!(said.contains("of a shadow table; `render.shadow.cells = \"auto\"` takes about"), "{said}");
    let automatic = self::predicted(&LAMP.replace("cells = 1024", "cells = 'auto'"));
    let entries = |predicted: &Prediction| {
        [Item::ShadowEntry, Item::ShadowRay].into_iter().map(|item| number(predicted, item)).sum::<f64>()
    };
    let times = entries(&predicted) / entries(&automatic);
    assert!(times > 4.0, "{times} times");
    assert_eq!(automatic.announcement(1), None);
}

/// A ball of cells in slabs across half vectors, which the picture shows whole.
const SWEPT: &str = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [48, 36]\n\
    [[light]]\nkind = 'directional'\ndirection = [0, -1, -0.5]\nirradiance = [1, 1, 1]\n\
    [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
    medium_ball = { center = [0, 0, 0], radius = 1, extinction = 2, spacing = 0.1 }\n\
    [material.fog]\nmedium = { albedo = 0.9 }\n\
    [render]\nantialias = 1\ntechnique = 'sheets'\nsheets = { slicing = 'half_vector', reconstruction = 'splat' }\n";

#[test]
fn rows_of_sweeps_are_as_many_as_slabs_take() {
    let rows = number(&predicted(SWEPT), Item::SweptRow);
    let scene = parse(Path::new("s.toml"), SWEPT.as_bytes(), &LoadOptions::default()).unwrap();
    let render = organza::render(&scene, &RenderOptions::default(), &Progress::new()).unwrap();
    let taken: u64 = render.cost.stages.iter().filter(|s| s.name == "sheets").map(|s| s.fragments).sum();
    // Vectors have 4, 8 or 16 numbers; a row of these few samples is one of 16, or as many as it needs.
    let least = taken as f64 / 16.0;
    let most = taken as f64 / 4.0;
    assert!(rows > 0.5 * least && rows < 2.0 * most, "{rows} rows, {taken} footprint numbers");
    // Two lights are two sweeps, and slabs across the view have none.
    let second = "[[light]]\nkind = 'directional'\ndirection = [1, -1, -0.5]\nirradiance = [1, 1, 1]\n";
    let two = number(&predicted(&SWEPT.replace("[[object]]", &format!("{second}[[object]]"))), Item::SweptRow);
    assert!((two / rows - 2.0).abs() < 1e-9, "{two} of {rows}");
    assert_eq!(number(&predicted(&SWEPT.replace("'half_vector'", "'view'")), Item::SweptRow), 0.0);
    // Pixels that read the lattice add no rows.
    assert_eq!(number(&predicted(&SWEPT.replace("'splat'", "'gather'")), Item::SweptRow), 0.0);
}

#[test]
fn light_is_predicted_for_what_is_lit() {
    let wall = "[[object]]\nname = 'wall'\ntechnique = 'TECHNIQUE'\n\
                rectangle = { center = [0, 0, -2], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.05 }\n[material.fog]";
    let bare = LAMP.replace("[render.shadow]\ncells = 1024\n", "[render]\ntechnique = 'points'\n");
    let with = |technique: &str| predicted(&bare.replace("[material.fog]", &wall.replace("TECHNIQUE", technique)));
    let without = predicted(&bare);
    let shaded = |predicted: &Prediction| number(predicted, Item::ShadedSplat);
    let opaque = number(&with("points"), Item::OpaqueSplat);
    // Some opaque splats hide others, and `reference` reads the light of all.
    let by_points = shaded(&with("points")) - shaded(&without);
    let by_reference = shaded(&with("reference")) - shaded(&without);
    assert!(by_points > 0.2 * opaque && by_points < 0.8 * opaque, "{by_points} of {opaque}");
    assert!(by_reference > 0.9 * opaque, "{by_reference} of {opaque}");
}

/// The sentence is there before the drawing, which is stopped as soon as it has come.
#[test]
fn a_long_render_is_announced_before_it_is_drawn() {
    let scene = parse(Path::new("s.toml"), MIXED.as_bytes(), &LoadOptions::default()).unwrap();
    let rates = Rates::measured(|_| 1e5, "figures of a test".to_owned());
    let options = RenderOptions { rates, ..RenderOptions::default() };
    let progress = Progress::new();
    let said = std::thread::scope(|scope| {
        let drawing = scope.spawn(|| organza::render(&scene, &options, &progress).map(|_| ()));
        let mut said = Vec::new();
        while said.is_empty() && !drawing.is_finished() {
            said = progress.take_announced();
            std::thread::yield_now();
        }
        progress.cancel();
        // Two sets are a picture: the render may end well all the same.
        let _ = drawing.join().unwrap();
        said
    });
    assert!(said.len() == 1 && said[0].starts_with("drawing takes about"), "{said:?}");
}

#[test]
fn a_damaged_file_of_a_machine_is_refused_before_the_scene_is_read() {
    let place = Place::new("this is no scene");
    fs::write(place.path("m.json"), "{\n  \"organza_machine\": 1,\n  \"machine\"").unwrap();
    for command in ["explain", "render"] {
        let words = "m.json, line 3, column 11: expected JSON that `organza calibrate` wrote, found ";
        let out = place.expect(3, &[command, "s.toml", "--machine", "m.json"], words);
        assert!(String::from_utf8_lossy(&out.stderr).contains("hint: measure this machine with `organza calibrate"));
    }
}
