//! `organza orders`: every ordering against the truth of each pixel.

use organza::{Progress, RenderOptions, scene};
use organza_judge::orders::{Options, OrdersReport, compare};
use organza_tests::organza;
use serde_json::Value;
use std::fs;
use std::sync::OnceLock;

/// Two media of different colour inside each other, above an opaque ground.
const SCENE: &str = r#"version = 1
[camera]
position = [0.3, 0.5, 4]
target = [0, 0, 0]
size = [32, 24]
[background]
color = [0.25, 0.5, 1.0]
[ambient]
color = [1, 1, 1]
[[light]]
kind = "directional"
direction = [-0.5, -0.3, -0.8]
irradiance = [1, 1, 1]
shadow = false
[material.red]
color = [1, 0.1, 0.1]
[material.blue]
color = [0.1, 0.1, 1]
[[object]]
name = "outer"
medium_ball = { center = [0, 0.2, 0], radius = 0.9, extinction = 2, spacing = 0.1 }
material = "red"
[[object]]
name = "inner"
medium_ball = { center = [0.3, 0.2, 0.1], radius = 0.5, extinction = 4, spacing = 0.07 }
material = "blue"
[[object]]
name = "ground"
rectangle = { center = [0, -0.3, 0], u = [1.5, 0, 0], v = [0, 0, -1.5], spacing = 0.1 }
"#;

fn row<'a>(document: &'a Value, name: &str) -> &'a Value {
    document["orderings"].as_array().unwrap().iter().find(|o| o["ordering"] == name).unwrap()
}

/// Sheets of eight voxels mix more than those of one. Where another axis becomes the nearest sheets across axes pop; those across the view turn
/// with it.
fn sheets_pop(report: &Value) {
    let value = |across: &str, voxels: u32, key: &str| {
        let name = format!("sheets across {across}, {voxels} voxel{}", if voxels == 1 { "" } else { "s" });
        row(report, &name)[key].as_f64().unwrap()
    };
    for across in ["the view", "an axis", "the half vector"] {
        let values = |key: &str| [1, 2, 4, 8].map(|voxels| value(across, voxels, key));
        println!("{across}: pops {:.2?}, RMSE {:.4?}", values("pop_score"), values("rmse"));
        assert!(
            values("rmse")[0] < values("rmse")[3] && values("slice_thickness")[3] == 8.0 * values("slice_thickness")[0]
        );
    }
    // All sheets change at once.
    for voxels in [1, 2, 4, 8] {
        assert!(value("an axis", voxels, "pop_score") > 2.0 * value("the view", voxels, "pop_score"));
    }
    let by_centre = row(report, "comparison sort by view depth")["pop_score"].as_f64().unwrap();
    println!("by centre: pops {by_centre:.2}");
    // Fragments and centres of media are in nearly the same order.
    assert!(by_centre < value("the view", 1, "pop_score") && row(report, "unsorted")["pop_score"].is_null());
}

#[test]
fn a_scene_without_translucent_splats_has_no_order() {
    let opaque = SCENE.replace("[[object]]\nname = \"inner\"", "[[object]]\nvisible = false\nname = \"inner\"");
    let opaque = opaque.replace("[[object]]\nname = \"outer\"", "[[object]]\nvisible = false\nname = \"outer\"");
    // Translucent splats that are out of view are as good as none.
    let elsewhere = SCENE.replace("target = [0, 0, 0]", "target = [0, 0, 8]");
    for text in [opaque, elsewhere] {
        let scene = scene::parse("s.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
        let error = compare(&scene, &Options::default(), &RenderOptions::default(), &Progress::new()).unwrap_err();
        assert_eq!(error.exit_code(), 3, "{error}");
    }
}

#[test]
fn a_comparison_that_is_interrupted_keeps_what_it_has() {
    static PROGRESS: OnceLock<Progress> = OnceLock::new();
    let stop = |stage: &str, _| {
        if stage.starts_with("sheets: turn") {
            PROGRESS.get().unwrap().cancel();
        }
    };
    let progress = PROGRESS.get_or_init(|| Progress::watched(stop));
    let text = SCENE.replace("[32, 24]", "[16, 12]");
    let scene = scene::parse("s.toml".as_ref(), text.as_bytes(), &Default::default()).unwrap();
    let quick = Options { quick: true };
    let comparison = compare(&scene, &quick, &RenderOptions::default(), progress).unwrap();
    assert_eq!(comparison.interrupted, Some("sheets"));
    let report = OrdersReport::new(&scene, comparison).unwrap();
    let document: Value = serde_json::from_str(&report.json()).unwrap();
    assert_eq!(document["interrupted"], "sheets");
    assert!(row(&document, "slices, exact inside")["rmse"].as_f64().unwrap() < 1e-2);
    let sheets = row(&document, "sheets across the view, 8 voxels");
    assert!(sheets["rmse"].is_number() && sheets["pop_score"].is_null());
    assert!(report.text().ends_with("interrupted at sheets: nothing stands here of what comes after\n"));
    assert!(report.csv().lines().skip(1).all(|line| line.starts_with("\"s.toml\",16,12,")));
}

#[test]
fn a_quick_comparison_has_every_ordering() {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("s.toml"), SCENE.replace("[32, 24]", "[16, 12]")).unwrap();
    let arguments = ["orders", "s.toml", "--quick", "--out", "o", "--json"];
    let out = organza().args(arguments).current_dir(&folder).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    let report = &document["report"];
    assert!(report["interrupted"].is_null());
    for name in
        ["slices, exact inside", "unsorted", "sheets across an axis, 8 voxels", "particles, 8 sets: none needed"]
    {
        assert!(row(report, name)["rmse"].is_number(), "{name}");
    }
    assert!(row(report, "sheets across the view, 1 voxel")["pop_score"].is_number());
}

/// What takes long and rarely fails where the others hold: `cargo xtask deep`.
mod deep {
    use super::*;

    #[test]
    fn exact_order_is_the_truth_and_disorder_costs_accuracy() {
        let folder = tempfile::tempdir().unwrap();
        fs::write(folder.path().join("s.toml"), SCENE).unwrap();
        let out = organza().args(["orders", "s.toml", "--out", "o", "--json"]).current_dir(&folder).output().unwrap();
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let document: Value = serde_json::from_slice(&out.stdout).unwrap();
        let report = &document["report"];
        let value = |name: &str, key: &str| row(report, name)[key].as_f64().unwrap();
        let exact = "slices, exact inside";
        // Not 0: depths that are one number in f32 are told apart by the truth.
        assert!(value(exact, "rmse") < 2e-4, "{}", value(exact, "rmse"));
        assert!((value("comparison sort by view depth", "rmse") - value(exact, "rmse")).abs() < 1e-6);
        assert!(value("unsorted", "rmse") > 100.0 * value(exact, "rmse"));
        let thin = "slices, 1 x thickness";
        assert!(value(thin, "rmse") < value("unsorted", "rmse"));
        assert!(value(exact, "wrong_pairs_per_ray") < 0.1 * value(thin, "wrong_pairs_per_ray"));
        assert!(value(thin, "wrong_pairs_per_ray") < value("unsorted", "wrong_pairs_per_ray"));
        // Inside a slice a splat can stand in front of an earlier one by no more than the slice is thick.
        assert!(value(thin, "worst_backtrack") <= 1.001 * value(thin, "slice_thickness"));
        assert!(value("unsorted", "worst_backtrack") > 10.0 * value(thin, "slice_thickness"));
        assert!(value("unsorted", "bytes") < value("comparison sort by view depth", "bytes"));
        // Particles need no order: their expectation is near the truth, and seeds spread around it.
        let particles = report["orderings"].as_array().unwrap().iter().find(|o| !o["sampled"].is_null()).unwrap();
        assert!(particles["wrong_pairs_per_ray"].is_null() && particles["sort_seconds"].is_null());
        assert!(report["without_particles"].is_null());
        let sampled = |key: &str| particles["sampled"][key].as_f64();
        assert_eq!(particles["sampled"]["seeds"], 5);
        let bias = sampled("rms_bias").unwrap_or(0.0);
        println!("standard deviation {:?}, bias {bias}", sampled("standard_deviation"));
        assert!(bias < 0.25 * value("unsorted", "rmse"), "bias {bias}");
        assert!(sampled("standard_deviation").unwrap() > 0.0);
        sheets_pop(report);
        let mut names: Vec<_> =
            fs::read_dir(folder.path().join("o")).unwrap().map(|e| e.unwrap().file_name()).collect();
        names.sort();
        assert_eq!(names, ["orders.csv", "orders.html", "orders.json", "orders.png"]);
        let html = fs::read_to_string(folder.path().join("o/orders.html")).unwrap();
        // A dot for each thickness across the view, an axis and the half vector.
        assert!(html.contains("<h2>Popping</h2>") && html.matches("<circle").count() == 12);
        let png = fs::read(folder.path().join("o/orders.png")).unwrap();
        assert_eq!(png[..8], *b"\x89PNG\r\n\x1a\n");
        let again = organza().args(["orders", "s.toml", "--out", "o"]).current_dir(&folder).output().unwrap();
        assert_eq!(again.status.code(), Some(4));
    }
}
