//! `organza render --budget`, `--max-rmse` and `--max-flip`: what keeps to a goal is what the settings that were taken draw without one. No time is
//! asserted.

use organza_tests::{Place, parallel_view, picture_of};
use serde_json::Value;

/// The document of a picture that keeps to a goal, under `budget`.
fn kept(place: &Place, scene: &str, options: &[&str]) -> Value {
    let out = place.expect(0, &[&["render", scene, "-o", "k.exr", "--force", "--json"], options].concat(), "");
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    document["budget"].clone()
}

/// The bits of a picture.
fn bits(place: &Place, name: &str) -> String {
    format!("{:?}", picture_of(&place.path(name)).sha256(1.0))
}

/// Draws a scene with the options that a document names for the same picture, and returns its bits.
fn again(place: &Place, scene: &str, budget: &Value) -> String {
    let options = budget["same_again"].as_array().unwrap().iter().map(|option| option.as_str().unwrap());
    let mut arguments = vec!["render", scene, "-o", "again.exr", "--force"];
    options.for_each(|option| arguments.extend(option.split_whitespace()));
    place.expect(0, &arguments, "");
    bits(place, "again.exr")
}

/// Root mean square of the differences of two pictures as they are displayed.
fn displayed_rmse(place: &Place, picture: &str, other: &str) -> f64 {
    let read = |name: &str| {
        let picture = picture_of(&place.path(name));
        let radiance = ["R", "G", "B"].into_iter().flat_map(|channel| picture.channel(channel));
        radiance.map(encoded).collect::<Vec<f64>>()
    };
    let first = read(picture);
    let second = read(other);
    let sum: f64 = first.iter().zip(&second).map(|(a, b)| (a - b) * (a - b)).sum();
    (sum / first.len() as f64).sqrt()
}

/// sRGB of a radiance.
fn encoded(radiance: f64) -> f64 {
    let x = radiance.clamp(0.0, 1.0);
    if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 }
}

#[test]
fn the_cheapest_settings_within_an_error_are_those_of_the_ladder_and_draw_the_same_again() {
    let place = Place::new(&scene());
    place.expect(0, &["render", "s.toml", "-o", "plain.exr"], "");
    for options in [["--max-rmse", "0.02"], ["--max-flip", "0.05"], ["--max-rmse", "1"], ["--max-rmse", "1e-9"]] {
        let limit: f64 = options[1].parse().unwrap();
        let budget = kept(&place, "s.toml", &options);
        let of_limit = if options[0] == "--max-rmse" { "rmse" } else { "flip" };
        let taken = budget[format!("expected_{of_limit}")].as_f64().unwrap();
        assert!(taken <= limit, "{options:?}: {budget}");
        // Nothing that is less exact keeps to it.
        let ladder = budget["ladder"].as_array().unwrap();
        let rank = ladder.iter().position(|rung| rung[of_limit].as_f64() == Some(taken)).unwrap();
        assert!(ladder[rank + 1..].iter().all(|rung| rung[of_limit].as_f64().unwrap() > limit), "{budget}");
        assert_eq!(bits(&place, "k.exr"), again(&place, "s.toml", &budget), "{budget}");
        if limit == 1e-9 {
            assert_eq!(bits(&place, "k.exr"), bits(&place, "plain.exr"));
        } else if of_limit == "rmse" {
            let rmse = displayed_rmse(&place, "k.exr", "plain.exr");
            let estimated = budget["expected_rmse"].as_f64().unwrap();
            assert!(rmse > 0.4 * estimated && rmse < 2.5 * estimated, "{options:?}: {rmse}, estimated {estimated}");
        }
    }
}

#[test]
fn what_takes_least_within_an_error_is_the_same_by_any_number_of_threads() {
    let place = Place::new(
        &scene().replace("technique = 'points'", "technique = 'particles'\nparticles = { repeat_level = 12 }"),
    );
    let one = kept(&place, "s.toml", &["--max-rmse", "0.05", "--threads", "1"]);
    let bits_of_one = bits(&place, "k.exr");
    let three = kept(&place, "s.toml", &["--max-rmse", "0.05", "--threads", "3"]);
    assert_eq!([&one["given_up"], &one["expected_rmse"]], [&three["given_up"], &three["expected_rmse"]]);
    assert_eq!(bits_of_one, bits(&place, "k.exr"));
    assert_eq!(bits_of_one, again(&place, "s.toml", &one));
    assert!(!one["given_up"].as_array().unwrap().is_empty(), "{one}");
}

#[test]
fn keys_of_a_goal_do_what_options_do_and_options_win() {
    let by_keys = scene() + "max_rmse = 0.02\nbudget_ms = 86400000\n";
    let place = Place::new(&by_keys);
    place.write("plain.toml", scene());
    let budget = kept(&place, "s.toml", &[]);
    assert_eq!([&budget["max_rmse"], &budget["seconds"]], [&Value::from(0.02), &Value::from(86400.0)]);
    // With all the time there is nothing gives way.
    assert_eq!(budget["given_up"], Value::Array(Vec::new()));
    let off = kept(&place, "s.toml", &["--set", "render.budget_ms=none"]);
    let by_key = bits(&place, "k.exr");
    assert_eq!(again(&place, "s.toml", &off), by_key, "{off}");
    let option = kept(&place, "plain.toml", &["--max-rmse", "0.02"]);
    assert_eq!([&option["given_up"], &option["expected_rmse"]], [&off["given_up"], &off["expected_rmse"]]);
    assert_eq!(bits(&place, "k.exr"), by_key);
    // The file that was made tells how it is drawn again, without the goal.
    let has = |picture: &str, part: &str| {
        let bytes = place.bytes(picture);
        bytes.windows(part.len()).any(|window| window == part.as_bytes())
    };
    assert!(has("k.exr", "# --set render.antialias=") || has("k.exr", "# --set render.splat_share="));
    assert!(!has("k.exr", "--max-rmse"));
    place.expect(0, &["render", "s.toml", "-o", "o.exr", "--set", "render.budget_ms=none"], "");
    assert!(has("o.exr", "# --set render.max_rmse=none"));
    let render = ["render", "s.toml", "-o", "k.exr", "--force"];
    let said = "--max-rmse 0.5 is taken, the scene has render.max_rmse = 0.02";
    place.expect(0, &[&render[..], &["--max-rmse", "0.5"]].concat(), said);
    let checkpoint = ["--checkpoint", "c", "--technique", "particles", "--repeat-level", "2"];
    place.expect(
        0,
        &[&render[..], &checkpoint].concat(),
        "render.max_rmse has no part in a picture with a --checkpoint",
    );
    place.expect(0, &["render", "s.toml", "-o", "t.exr", "--turntable", "2"], "render.budget_ms has no part in frames");
    place.expect(0, &["explain", "s.toml"], "render.max_rmse has no part in `organza explain`");
    place.expect(0, &["convert", "s.toml", "-o", "p.ply"], "render.max_rmse has no part in a file of points");
    place.expect(
        0,
        &["orders", "s.toml", "-o", "d", "--size", "8x8"],
        "render.max_rmse has no part in `organza orders`",
    );
}

#[test]
fn a_time_and_an_error_that_nothing_keeps_to_are_refused_with_the_nearest() {
    let place = Place::new(&scene());
    let both = ["render", "s.toml", "-o", "b.png", "--budget", "1", "--max-rmse", "1e-6"];
    place.expect(5, &both, "with the fewest samples and splats that the errors allow, needs ");
    place.expect(5, &both, "hint: use --budget ");
    assert!(place.made().is_empty());
}

#[test]
fn goals_that_are_no_numbers_in_range_are_refused_with_what_is_expected() {
    let place = Place::new(&scene());
    let render = ["render", "s.toml", "-o", "b.png"];
    for value in ["0", "-5", "nan", "1e99", "inf", "1.5", "86400001"] {
        let options = ["--budget", value];
        place.expect(
            2,
            &[&render[..], &options].concat(),
            "expected a whole number of milliseconds from 1 to 86400000",
        );
    }
    for option in ["--max-rmse", "--max-flip"] {
        for value in ["0", "-1", "nan", "inf", "1.5"] {
            place.expect(2, &[&render[..], &[option, value]].concat(), "expected a number above 0, at most 1");
        }
    }
    for (key, expected) in [
        ("budget_ms=0", "expected a whole number of milliseconds from 1 to 86400000 or \"none\", found 0"),
        ("budget_ms=2.5", "found 2.5"),
        ("max_rmse=-0.1", "expected a number above 0, at most 1, or \"none\", found -0.1"),
        ("max_flip=1.5", "found 1.5"),
        ("max_flip='all'", "expected a number or \"none\""),
    ] {
        let change = format!("render.{key}");
        place.expect(2, &[&render[..], &["--set", &change]].concat(), expected);
    }
    assert!(place.made().is_empty());
}

/// Fog in a light, enough of it that a millisecond is too short.
fn scene() -> String {
    parallel_view(2.0, 64)
        + "[[light]]\nkind = 'directional'\ndirection = [0, -1, -1]\nirradiance = [1, 1, 1]\n\
           [[object]]\nname = 'fog'\nmaterial = 'fog'\n\
           medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.7, spacing = 0.05 }\n\
           [material.fog]\nmedium = { albedo = 0.5 }\n[render]\ntechnique = 'points'\nantialias = 4\n"
}

#[test]
fn a_budget_draws_what_the_settings_draw_that_it_names() {
    let place = Place::new(&scene());
    let render = |budget: u64| {
        place.run(&["render", "s.toml", "-o", "b.exr", "--force", "--json", "--budget", &budget.to_string()])
    };
    // The shortest that is accepted of those that double, so that something had to give way on most machines.
    let out = (0..24).map(|double| render(1 << double)).find(|out| out.status.success()).expect("some time is enough");
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    let budget = &document["budget"];
    let given_up = budget["given_up"].as_array().unwrap();
    let changes: Vec<String> = given_up
        .iter()
        .map(|setting| format!("{}={}", setting["key"].as_str().unwrap(), setting["taken"].as_str().unwrap()))
        .collect();
    let mut again = vec!["render", "s.toml", "-o", "again.exr"];
    changes.iter().for_each(|change| again.extend(["--set", change]));
    place.expect(0, &again, "");
    let channels = |name: &str| picture_of(&place.path(name)).sha256(1.0);
    assert_eq!(channels("b.exr"), channels("again.exr"), "{budget}");
    // With all the time there is nothing gives way.
    let document: Value = serde_json::from_slice(&render(86_400_000).stdout).unwrap();
    assert_eq!(document["budget"]["given_up"], Value::Array(Vec::new()), "{document}");
    place.expect(0, &["render", "s.toml", "-o", "plain.exr"], "");
    assert_eq!(channels("b.exr"), channels("plain.exr"));
}

#[test]
fn a_picture_of_a_json_scene_keeps_its_text_as_it_is() {
    let text = "{\"version\": 1, \"camera\": {\"position\": [0, 0, 4], \"target\": [0, 0, 0], \"size\": [64, 64]},\n\
        \"object\": [{\"name\": \"fog\", \"medium_box\": {\"min\": [-1, -1, -1], \"max\": [1, 1, 1], \"extinction\": 1, \"spacing\": 0.05}}],\n\
        \"render\": {\"technique\": \"points\", \"antialias\": 8}}\n";
    let place = Place::new("");
    place.write("s.json", text);
    let render =
        |budget: u64| place.run(&["render", "s.json", "-o", "b.exr", "--force", "--budget", &budget.to_string()]);
    assert!((0..24).map(|double| render(1 << double)).any(|out| out.status.success()));
    let bytes = place.bytes("b.exr");
    let has = |part: &[u8]| bytes.windows(part.len()).any(|window| window == part);
    assert!(has(text.trim_end().as_bytes()) && !has(b"# --set"));
}

#[test]
fn a_time_that_nothing_fits_is_refused_with_one_that_does() {
    let place = Place::new(&scene());
    place.expect(5, &["render", "s.toml", "-o", "b.png", "--budget", "1"], "hint: use --budget ");
    for other in [["--turntable", "3"], ["--checkpoint", "c"], ["--backend", "auto"]] {
        place.expect(2, &[&["render", "s.toml", "-o", "b.png", "--budget", "1000"], &other[..]].concat(), other[0]);
    }
    assert!(place.made().is_empty());
}
