//! Sessions by recorded events: what is drawn is what `organza::render` draws of the same scene.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use organza::output::{Format, Metadata, Params, displayed_bytes, encode};
use organza::scene::{LoadOptions, Scene, parse};
use organza::{Progress, RenderOptions, render};
use organza_view::{Event, Level, Opening, Session, Switch};
use std::sync::Arc;

const HEAD: &str = r#"version = 1
[camera]
position = [1, 1, 4]
target = [0, 0, 0]
size = [48, 36]
[background]
color = [0.25, 0.5, 1.0]
[[light]]
name = "sun"
kind = "point"
position = [2, 4, 1]
intensity = [20, 20, 20]
[[object]]
name = "fog"
medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.5, spacing = 0.2 }
[[object]]
name = "ball"
implicit = { expression = "x^2 + y^2 + z^2 - 0.25", box = [[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], resolution = 16 }
opacity = 0.7
[[object]]
name = "wall"
rectangle = { center = [0, 0, -1.5], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.1 }
"#;

/// The source of the fog, and one of a surface.
const FOG: &str = "medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.5, spacing = 0.2 }";
const PANE: &str = "rectangle = { center = [0, 0, 0.8], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }\nopacity = 0.3";

fn opening(text: &str) -> Opening {
    Opening::of_text("scene.toml", text, RenderOptions::default())
}

fn session(text: &str) -> Session {
    Session::open(opening(text), &Progress::new()).unwrap()
}

/// The scene that a session shows, by the text that it saves.
fn saved(session: &Session) -> Scene {
    parse("scene.toml".as_ref(), session.scene_text().unwrap().as_bytes(), &LoadOptions::default()).unwrap()
}

/// The pixels of a PNG file.
fn pixels(png: &[u8]) -> Vec<u8> {
    let mut reader = png::Decoder::new(std::io::Cursor::new(png)).read_info().unwrap();
    let mut bytes = vec![0; reader.output_buffer_size().unwrap()];
    reader.next_frame(&mut bytes).unwrap();
    bytes
}

/// The displayed pixels of a scene, drawn by itself.
fn drawn_alone(scene: &Scene) -> Vec<u8> {
    let render = render(scene, &RenderOptions::default(), &Progress::new()).unwrap();
    let metadata = Metadata { exposure: scene.render.exposure, ..Metadata::default() };
    displayed_bytes(&render.layers, &metadata, &Params::default()).unwrap()
}

fn assert_shows_its_scene(session: &Session, what: &str) {
    let picture = session.whole_picture().unwrap();
    assert_eq!(picture.facts.level, Level::Whole, "{what}");
    assert!(pixels(&picture.png) == drawn_alone(&saved(session)), "{what}: other pixels than those of the scene alone");
}

#[test]
fn every_whole_picture_has_the_bits_of_its_scene() {
    let size = |width, height| Event::Size { width, height };
    let steps: [(&str, Vec<Event>); 8] = [
        ("as it is", vec![]),
        ("turned", vec![Event::Orbit { right: 0.2, up: -0.1 }]),
        ("turned on", vec![Event::Orbit { right: 0.1, up: 0.3 }, Event::Zoom { steps: 1.5 }]),
        ("larger", vec![size(61, 40)]),
        ("moved", vec![Event::Pan { right: 0.1, up: 0.05 }]),
        ("hidden", vec![Event::Show { object: "fog".into(), visible: false }]),
        ("thin", vec![Event::Opacity { object: "ball".into(), opacity: Some(0.3) }, Event::Exposure { stops: 1.0 }]),
        ("back", vec![Event::Show { object: "fog".into(), visible: true }, Event::Reset {}]),
    ];
    for technique in ["points", "particles", "sheets", "surfels", "auto"] {
        // Surfels draw no medium.
        let head = if technique == "surfels" { HEAD.replace(FOG, PANE) } else { HEAD.to_owned() };
        let sets = "[render.particles]\nrepeat_level = 4\n";
        let text = format!("{head}[render]\ntechnique = \"{technique}\"\nantialias = 1\n{sets}");
        let session = session(&text);
        // What `auto` chooses here carries light through slabs, anew for each view.
        let count = if technique == "auto" { 3 } else { steps.len() };
        for (what, events) in &steps[..count] {
            session.apply(events).unwrap();
            assert_shows_its_scene(&session, &format!("{technique}, {what}"));
        }
    }
}

#[test]
fn a_camera_that_is_found_is_turned_from_where_it_was_found() {
    let text = HEAD.replace("position = [1, 1, 4]\ntarget = [0, 0, 0]\n", "auto = true\nazimuth = 40\n");
    let session = session(&text);
    assert_shows_its_scene(&session, "found");
    let before = session.shown().viewpoint;
    assert!((before.azimuth - 40.0).abs() < 1e-9);
    session.apply(&[Event::Orbit { right: -0.25, up: 0.0 }]).unwrap();
    assert_shows_its_scene(&session, "turned");
    let after = session.shown().viewpoint;
    assert!((after.azimuth - 85.0).abs() < 1e-9 && (after.distance / before.distance - 1.0).abs() < 1e-12);
}

#[test]
fn files_are_those_of_the_command() {
    let session = session(HEAD);
    session.whole_picture().unwrap();
    let scene = parse("scene.toml".as_ref(), HEAD.as_bytes(), &LoadOptions::default()).unwrap();
    let render = render(&scene, &RenderOptions::default(), &Progress::new()).unwrap();
    let metadata = Metadata {
        scene_sha256: scene.sha256.clone(),
        scene: HEAD.to_owned(),
        technique: render.plan.technique.clone(),
        seed: scene.render.seed,
        backend: "cpu".into(),
        sets: None,
        exposure: scene.render.exposure,
    };
    let params = Params { has_background: true, ..Params::default() };
    for format in [Format::Png, Format::Exr] {
        let (bytes, _) = encode(&render.layers, &metadata, format, &params).unwrap();
        assert!(session.file(format).unwrap().unwrap() == bytes, "{format:?}");
    }
}

#[test]
fn an_effect_that_is_switched_returns_to_the_same_bits() {
    let session = session(HEAD);
    let before = session.whole_picture().unwrap();
    let row = |picture: &organza_view::Picture| {
        picture.facts.effects.iter().find(|effect| effect.name == "shadow.sun").cloned().unwrap()
    };
    assert!(row(&before).called_for && row(&before).switch == Switch::Auto && !row(&before).reason.is_empty());
    let switch = |switch| Event::Effect { name: "shadow.sun".into(), switch };
    session.apply(&[switch(Switch::Off)]).unwrap();
    let without = session.whole_picture().unwrap();
    assert!(!row(&without).called_for && row(&without).switch == Switch::Off);
    assert!(pixels(&without.png) != pixels(&before.png));
    session.apply(&[switch(Switch::Auto)]).unwrap();
    assert!(pixels(&session.whole_picture().unwrap().png) == pixels(&before.png));
}

#[test]
fn events_that_a_scene_refuses_change_nothing() {
    let session = session(HEAD);
    let before = session.whole_picture().unwrap();
    let orbit = Event::Orbit { right: 0.2, up: 0.0 };
    for bad in [
        Event::Show { object: "nobody".into(), visible: true },
        Event::Opacity { object: "fog".into(), opacity: Some(0.5) },
        Event::Effect { name: "translucency".into(), switch: Switch::Off },
        Event::Size { width: 0, height: 1 },
        Event::Exposure { stops: 1e9 },
        Event::Zoom { steps: f64::NAN },
    ] {
        let error = session.apply(&[orbit.clone(), bad.clone()]).unwrap_err();
        assert!(!error.to_string().is_empty(), "{bad:?}");
    }
    assert_eq!(session.shown().generation, 1);
    assert_eq!(session.recorded(), []);
    assert!(Arc::ptr_eq(&session.whole_picture().unwrap(), &before));
}

#[test]
fn a_picture_that_cannot_be_drawn_says_why_and_the_next_one_is_drawn() {
    let session = session(HEAD);
    session.whole_picture().unwrap();
    session.apply(&[Event::Size { width: 65_536, height: 65_536 }]).unwrap();
    let failure = session.whole_picture().unwrap_err();
    assert!(failure.message.contains("the image") && failure.generation == 2, "{failure:?}");
    assert_eq!(session.shown().failure, Some(failure));
    session.apply(&[Event::Size { width: 20, height: 20 }]).unwrap();
    assert_shows_its_scene(&session, "small again");
    assert_eq!(session.shown().failure, None);
}

#[test]
fn a_drag_ends_in_the_picture_of_its_last_event_and_stops_the_others() {
    let sets = "[render]\ntechnique = \"particles\"\n[render.particles]\nrepeat_level = 300\n";
    let session = session(&format!("{HEAD}{sets}"));
    // Whole pictures of 300 sets take long: of 40 requests hardly any is drawn but the last.
    for _ in 0..40 {
        session.apply(&[Event::Orbit { right: 0.01, up: 0.0 }]).unwrap();
        std::thread::sleep(std::time::Duration::from_millis(2));
    }
    let picture = session.whole_picture().unwrap();
    assert_eq!((picture.facts.generation, picture.facts.sets), (41, Some(300)));
    // A coarse and a whole picture of each state would be 82.
    assert!(picture.facts.number < 60, "{}", picture.facts.number);
    assert!(pixels(&picture.png) == drawn_alone(&saved(&session)));
}

#[test]
fn a_coarse_picture_says_that_it_is_one() {
    let text = HEAD.replace("size = [48, 36]", "size = [400, 300]");
    let session = session(&text);
    let first = loop {
        if let Some(picture) = session.picture() {
            break picture;
        }
        std::thread::yield_now();
    };
    assert_eq!((first.facts.level, first.facts.size.width), (Level::Coarse, 100));
    assert_eq!(pixels(&first.png).len(), 3 * 100 * 75);
    let whole = session.whole_picture().unwrap();
    assert_eq!((whole.facts.level, whole.facts.size.width, whole.facts.number), (Level::Whole, 400, 2));
}

#[test]
fn a_closed_session_leaves_no_thread_and_waits_for_none() {
    let sets = "[render]\ntechnique = \"particles\"\n[render.particles]\nrepeat_level = 100000\n";
    let session = session(&format!("{HEAD}{sets}"));
    std::thread::sleep(std::time::Duration::from_millis(100));
    let start = std::time::Instant::now();
    session.close();
    assert!(start.elapsed().as_secs_f64() < 1.0);
    assert!(session.whole_picture().is_err());
}
