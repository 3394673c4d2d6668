//! Progress is told by stages that share the predicted work: it never goes back, and is whole at the end, not before.

use organza::scene::{LoadOptions, parse};
use organza::{Progress, RenderOptions};
use std::path::Path;
use std::sync::{Arc, Mutex};

const FOG_AND_WALL: &str = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [96, 72]\n\
    [[light]]\nkind = 'point'\nposition = [1, 2, 3]\nintensity = [9, 9, 9]\n\
    [[light]]\nkind = 'point'\nposition = [-1, 2, 3]\nintensity = [9, 9, 9]\n\
    [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
    medium_ball = { center = [0, 0, 0], radius = 1, spacing = 0.08, extinction = 3 }\n\
    [[object]]\nname = 'wall'\nrectangle = { center = [0, 0, -1], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.05 }\n\
    [material.fog]\nmedium = { albedo = 0.9 }\n";

const GLASS: &str = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [64, 48]\n\
    [ambient]\ncolor = [0.5, 0.5, 0.5]\n[[object]]\nname = 'glass'\nopacity = 0.4\n\
    implicit = { expression = 'x^2 + y^2 + z^2 - 1', box = [[-1.1, -1.1, -1.1], [1.1, 1.1, 1.1]], resolution = 48 }\n";

/// Every stage with the fraction that is done when it begins.
fn stages(text: &str, technique: &str) -> Vec<(String, f64)> {
    let set = format!("render.technique='{technique}'");
    let overrides = vec![organza::scene::Override::parse(&set).unwrap()];
    let options = LoadOptions { overrides, ..LoadOptions::default() };
    let scene = parse(Path::new("s.toml"), text.as_bytes(), &options).unwrap();
    let told = Arc::new(Mutex::new(Vec::new()));
    let list = Arc::clone(&told);
    let progress = Progress::watched(move |name, fraction| list.lock().unwrap().push((name.to_owned(), fraction)));
    organza::render(&scene, &RenderOptions::default(), &progress).unwrap();
    assert_eq!(progress.report().1, 1.0);
    told.lock().unwrap().clone()
}

#[test]
fn it_rises_by_stages_and_is_whole_at_the_end_alone() {
    for text in [FOG_AND_WALL, GLASS] {
        for technique in ["points", "particles", "sheets"] {
            let stages = stages(text, technique);
            assert!(stages.windows(2).all(|s| s[0].1 <= s[1].1), "{stages:?}");
            let (last, before) = stages.split_last().unwrap();
            assert_eq!((last.0.as_str(), last.1), ("finishing", 1.0), "{stages:?}");
            assert!(before.iter().all(|s| s.1 < 1.0), "{stages:?}");
            let drawn = if technique == "points" { "compositing" } else { technique };
            let begin = before.iter().find(|s| s.0 == drawn).unwrap().1;
            let end = before.last().unwrap().1;
            assert!(begin < 0.98 && end > begin, "{technique}: {stages:?}");
        }
    }
}

#[test]
fn objects_and_shadow_maps_are_stages_of_their_own() {
    let names: Vec<String> = stages(FOG_AND_WALL, "points").into_iter().map(|s| s.0).collect();
    let expected = [
        "reading",
        "converting fog",
        "converting wall",
        "shadow map 1 of 2",
        "shadow map 2 of 2",
        "sorting",
        "projecting",
        "map of the eye",
        "opaque surfaces",
        "shading",
        "compositing",
        "finishing",
        "finishing",
    ];
    assert_eq!(names, expected);
}

/// Grouping may take longer than all else: it is no part of the conversion before it.
#[test]
fn grouping_is_a_stage_of_its_own() {
    let grouped = format!("{GLASS}[render.surfels]\nlayers = 'algorithm1'\ngroups = 4\ncoverage = 'enlarged'\n");
    let names: Vec<String> =
        stages(&grouped.replace("resolution = 48", "resolution = 12"), "surfels").into_iter().map(|s| s.0).collect();
    let [converted, grouped] = ["converting glass", "grouping discs"].map(|name| names.iter().position(|n| n == name));
    assert!(converted.is_some() && grouped == converted.map(|at| at + 1), "{names:?}");
}
