//! `organza render --budget`: what is drawn within a time is what the settings that were taken draw without one. No time is asserted.

use organza_tests::{Place, parallel_view, picture_of};
use serde_json::Value;

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
    place.expect(2, &["render", "s.toml", "-o", "b.png", "--budget", "0"], "--budget");
    assert!(place.made().is_empty());
}
