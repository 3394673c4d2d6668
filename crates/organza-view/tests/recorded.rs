//! Sessions by recorded events: what is drawn is what `organza::render` draws of the same scene.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use organza::output::{Format, Metadata, Params, displayed_bytes, encode};
use organza::scene::{LoadOptions, Scene, parse};
use organza::{Progress, RenderOptions, render};
use organza_view::{Event, EventFile, Knot, Level, Opened, Opening, PicturePlace, Recording, Session, Switch};
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

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
        left_out: render.plan.left_out_text(),
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
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("events.json");
    session.record(Recording::begin(&path, false).unwrap());
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
    assert_eq!(EventFile::read(&path).unwrap().events(), []);
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
        std::thread::sleep(Duration::from_millis(2));
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
    std::thread::sleep(Duration::from_millis(100));
    let start = Instant::now();
    session.close();
    assert!(start.elapsed().as_secs_f64() < 1.0);
    assert!(session.whole_picture().is_err());
}

#[test]
fn nothing_is_drawn_of_a_picture_that_is_refused() {
    let options = RenderOptions { max_memory: 1 << 30, ..RenderOptions::default() };
    let session = Session::open(Opening::of_text("scene.toml", HEAD, options), &Progress::new()).unwrap();
    let before = session.whole_picture().unwrap();
    session.apply(&[Event::Size { width: 8192, height: 8192 }]).unwrap();
    let failure = session.whole_picture().unwrap_err();
    assert!(Arc::ptr_eq(&session.picture().unwrap(), &before));
    // A page has no command line.
    assert!(failure.hint.starts_with("choose a smaller size"), "{failure:?}");
    let bad = Event::Size { width: 0, height: 4 };
    session.apply(&[Event::Size { width: 48, height: 36 }]).unwrap();
    session.apply(&[bad]).unwrap_err();
    assert_shows_its_scene(&session, "as before");
}

#[test]
fn coarse_pictures_have_fewer_splats_and_the_depths_of_the_scene() {
    let text = format!("{}[render]\ntechnique = \"sheets\"\n", HEAD.replace("size = [48, 36]", "size = [400, 300]"));
    let session = session(&text);
    let first = loop {
        if let Some(picture) = session.picture() {
            break picture;
        }
        std::thread::yield_now();
    };
    let facts = &first.facts;
    assert_eq!((facts.level, facts.technique.as_str()), (Level::Coarse, "points"));
    assert!(facts.splat_share < 1.0 && facts.size.width < 400, "{facts:?}");
    let whole = session.whole_picture().unwrap();
    assert_eq!((whole.facts.splat_share, whole.facts.technique.as_str()), (1.0, "sheets"));
}

#[test]
fn a_double_click_centres_on_what_is_seen() {
    let from_the_front = HEAD.replace("position = [1, 1, 4]", "position = [0, 0, 4]");
    let session = session(&from_the_front.replace(FOG, PANE));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("events.json");
    session.record(Recording::begin(&path, false).unwrap());
    for name in ["fog", "ball"] {
        session.apply(&[Event::Show { object: name.into(), visible: false }]).unwrap();
    }
    let before = session.shown().viewpoint;
    // The wall at z = -1.5 fills the middle, and a point of it right of there.
    for place in [PicturePlace { right: 0.5, down: 0.5 }, PicturePlace { right: 0.7, down: 0.4 }] {
        assert!(session.centre_on(place).unwrap());
        let centre = session.shown().viewpoint.centre;
        assert!((centre[2] + 1.5).abs() < 0.05, "{centre:?}");
    }
    let after = session.shown().viewpoint;
    assert!((after.distance / before.distance - 1.0).abs() < 1e-12 && after.centre[0] > 0.2 && after.centre[1] > 0.05);
    // Beside the wall there is nothing.
    session.apply(&[Event::Zoom { steps: -12.0 }]).unwrap();
    assert!(!session.centre_on(PicturePlace { right: 0.01, down: 0.01 }).unwrap());
    // What is recorded needs no picture.
    let events = EventFile::read(&path).unwrap().events().to_vec();
    assert_eq!(events.iter().filter(|event| matches!(event, Event::LookFrom { centre: Some(_), .. })).count(), 2);
}

#[test]
fn a_light_is_changed_as_the_scene_would_have_it() {
    let session = session(HEAD);
    let dark = session.whole_picture().unwrap();
    let light = || "sun".to_owned();
    session.apply(&[Event::LightIntensity { light: light(), stops: 1.0 }]).unwrap();
    assert_shows_its_scene(&session, "brighter");
    assert_eq!(saved(&session).lights[0].light.intensity, [40.0; 3]);
    let row = session.shown().lights[0].clone();
    assert_eq!((row.kind, row.stops, row.shadow), ("point", 1.0, true));
    session
        .apply(&[
            Event::LightDirection { light: light(), azimuth: 90.0, elevation: 0.0 },
            Event::LightShadow { light: light(), shadow: false },
        ])
        .unwrap();
    assert_shows_its_scene(&session, "from the right");
    let found = session.shown().lights[0].direction.unwrap();
    assert!((found.azimuth - 90.0).abs() < 1e-9 && found.elevation.abs() < 1e-9);
    assert!(pixels(&session.whole_picture().unwrap().png) != pixels(&dark.png));
}

/// A volume whose value is its height, 0 to 7.
fn write_volume(folder: &Path) {
    let head = b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 8 8 8\nencoding: raw\nspacings: 0.25 0.25 0.25\n\n";
    let voxels = (0..512u32).map(|i| (i / 64) as u8);
    std::fs::write(folder.join("ramp.nrrd"), head.iter().copied().chain(voxels).collect::<Vec<u8>>()).unwrap();
}

const VOLUME: &str = r#"version = 1
[camera]
position = [1, 1, 8]
target = [1, 1, 1]
size = [32, 24]
[ambient]
color = [1, 1, 1]
[[object]]
name = "ramp"
volume = "ramp.nrrd" # heights
transfer = [
  { value = 0, color = [1, 1, 1], extinction = 0 },
  { value = 7, color = [1, 0.5, 0.25], extinction = 2 }, # the top
]
"#;

/// Waits until something holds, for a minute at most.
fn wait_for(what: &str, mut holds: impl FnMut() -> bool) {
    let end = Instant::now() + Duration::from_secs(60);
    while !holds() {
        assert!(Instant::now() < end, "{what} does not come");
        std::thread::sleep(Duration::from_millis(10));
    }
}

#[test]
fn a_curve_is_drawn_over_the_values_and_saved() {
    let folder = tempfile::tempdir().unwrap();
    write_volume(folder.path());
    let file = folder.path().join("scene.toml");
    let session = Session::open(Opening::of_text(&file, VOLUME, RenderOptions::default()), &Progress::new()).unwrap();
    let before = session.whole_picture().unwrap();
    let curve = || session.shown().objects[0].curve.clone().unwrap();
    assert_eq!(curve().knots[1], Knot { value: 7.0, color: [1.0, 0.5, 0.25], extinction: 2.0 });
    wait_for("the histogram", || curve().values.is_some());
    let values = curve().values.unwrap();
    assert_eq!((values.low, values.high, values.heights.len()), (0.0, 7.0, 128));
    // 64 voxels of each value.
    assert_eq!(values.heights.iter().filter(|height| **height == 1.0).count(), 8);
    let knots = vec![
        Knot { value: 3.5, color: [0.1, 0.2, 0.3], extinction: 0.0 },
        Knot { value: 4.25, color: [0.1, 0.2, 0.3], extinction: 12.5 },
    ];
    session.apply(&[Event::Transfer { object: "ramp".into(), knots: Some(knots.clone()) }]).unwrap();
    assert_eq!(curve().knots, knots);
    let after = session.whole_picture().unwrap();
    assert!(pixels(&after.png) != pixels(&before.png));
    // The saved scene is this one, wherever it lies.
    let text = session.scene_text().unwrap();
    assert!(text.contains("# heights"), "{text}");
    let away = tempfile::tempdir().unwrap();
    let elsewhere = away.path().join("a/b/c.toml");
    std::fs::create_dir_all(elsewhere.parent().unwrap()).unwrap();
    let scene = parse(&elsewhere, text.as_bytes(), &LoadOptions::default()).unwrap();
    assert!(pixels(&after.png) == drawn_alone(&scene));
    let falling = vec![knots[1], knots[0]];
    let refused = session.apply(&[Event::Transfer { object: "ramp".into(), knots: Some(falling) }]).unwrap_err();
    assert!(refused.to_string().contains("value"), "{refused}");
    session.apply(&[Event::Transfer { object: "ramp".into(), knots: None }]).unwrap();
    assert!(pixels(&session.whole_picture().unwrap().png) == pixels(&before.png));
}

#[test]
fn a_layer_is_shown_in_the_place_of_the_beauty_and_files_keep_the_beauty() {
    let session = session(HEAD);
    let beauty = session.whole_picture().unwrap();
    let mut shown = vec![pixels(&beauty.png)];
    for layer in ["normal", "depth.median", "shadow", "object", "direct", "background"] {
        session.apply(&[Event::Layer { layer: Some(layer.into()) }]).unwrap();
        let picture = session.whole_picture().unwrap();
        shown.push(pixels(&picture.png));
        assert_eq!(session.shown().layer.as_deref(), Some(layer));
        assert!(pixels(&session.file(Format::Png).unwrap().unwrap()) == shown[0], "{layer}");
    }
    for (rank, one) in shown.iter().enumerate() {
        assert!(shown[..rank].iter().all(|other| other != one), "picture {rank} is another one");
    }
    let refused = session.apply(&[Event::Layer { layer: Some("none".into()) }]).unwrap_err();
    assert!(refused.to_string().contains("none"), "{refused}");
    session.apply(&[Event::Layer { layer: None }]).unwrap();
    assert!(pixels(&session.whole_picture().unwrap().png) == shown[0]);
}

#[test]
fn accuracy_is_predicted_and_measured_and_is_that_of_the_scene() {
    let session = session(&format!("{HEAD}[render]\ntechnique = \"points\"\nantialias = 2\n"));
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("events.json");
    session.record(Recording::begin(&path, false).unwrap());
    let first_picture = session.whole_picture().unwrap();
    assert_eq!(session.shown().accuracy, None, "nobody has asked");
    session.ask_for_accuracy();
    let rungs = || session.shown().accuracy.map_or_else(Vec::new, |accuracy| accuracy.rungs);
    let rung = |step: i32| rungs().into_iter().find(|rung| rung.step == step);
    let wait_for_measured =
        |step| wait_for("a measured position", || rung(step).is_some_and(|rung| rung.rmse.is_some()));
    wait_for_measured(0);
    assert_eq!(session.shown().generation, 1, "nothing is drawn anew for it");
    let first = rungs();
    // Two positions of samples are finer: the first of three would be the scene's own.
    assert_eq!(first.iter().map(|rung| rung.step).collect::<Vec<_>>(), [-3, -2, -1, 0, 2, 3]);
    let predicted: Vec<f64> = first.iter().map(|rung| rung.predicted_ms.unwrap()).collect();
    assert!(predicted.windows(2).all(|pair| pair[0] < pair[1]), "{predicted:?}");
    let stated = rung(0).unwrap();
    assert!(stated.set.is_empty() && stated.is_reference && stated.rmse == Some(0.0) && stated.measured_ms > Some(0.0));
    assert!(first.iter().filter(|rung| rung.measured_ms.is_some()).count() == 1);
    let choose = |step| {
        let rung = rung(step).unwrap();
        assert!(rung.lines.contains("[render"), "{}", rung.lines);
        session.apply(&[Event::Accuracy { step, set: rung.set }]).unwrap();
        assert_shows_its_scene(&session, &format!("position {step}"));
        assert_eq!(session.shown().accuracy.unwrap().step, step);
    };
    choose(-3);
    wait_for_measured(-3);
    let fastest = rung(-3).unwrap();
    assert!(fastest.rmse > Some(1e-3) && fastest.flip > Some(1e-3) && !fastest.is_reference, "{fastest:?}");
    // What is more exact is what all are compared with.
    choose(3);
    wait_for_measured(3);
    let most_exact = rung(3).unwrap();
    assert!(most_exact.is_reference && most_exact.rmse == Some(0.0));
    let of_own = rung(0).unwrap();
    assert!(!of_own.is_reference && of_own.rmse > Some(0.0) && of_own.rmse < rung(-3).unwrap().rmse, "{of_own:?}");
    // From elsewhere nothing is measured yet; the positions are the same.
    session.apply(&[Event::Orbit { right: 0.1, up: 0.0 }]).unwrap();
    session.whole_picture().unwrap();
    wait_for("the picture from there", || {
        rung(3).is_some_and(|rung| rung.is_reference && rung.rmse == Some(0.0))
            && rung(0).is_some_and(|rung| rung.rmse.is_none())
    });
    assert_eq!(rung(-3).unwrap().set, fastest.set);
    // The scene's own accuracy has its own bits again.
    session.apply(&[Event::Reset {}, Event::Accuracy { step: 0, set: Vec::new() }]).unwrap();
    assert!(pixels(&session.whole_picture().unwrap().png) == pixels(&first_picture.png));
    let events = EventFile::read(&path).unwrap().events().to_vec();
    assert_eq!(events.iter().filter(|event| matches!(event, Event::Accuracy { .. })).count(), 3);
}

#[test]
fn a_picture_that_is_kept_is_compared_with_what_follows() {
    let session = session(HEAD);
    assert!(session.comparison().unwrap().is_none());
    let first = session.whole_picture().unwrap();
    assert!(session.keep());
    assert!(Arc::ptr_eq(&session.kept_picture().unwrap(), &first));
    let same = session.comparison().unwrap().unwrap();
    assert_eq!((same.rmse, same.flip, same.gain), (Some(0.0), Some(0.0), Some(1.0)));
    // By another technique.
    session.apply(&[Event::Technique { technique: Some("points".into()) }]).unwrap();
    assert_shows_its_scene(&session, "by points");
    assert_eq!(session.whole_picture().unwrap().facts.technique, "points");
    session.apply(&[Event::Exposure { stops: 1.0 }]).unwrap();
    let brighter = session.whole_picture().unwrap();
    let found = session.comparison().unwrap().unwrap();
    let sum = |png: &[u8]| pixels(png).iter().map(|byte| f64::from(*byte) / 255.0).sum::<f64>();
    // A mean difference is no larger than the root of the mean square.
    let mean = (sum(&brighter.png) - sum(&first.png)) / (3.0 * 48.0 * 36.0);
    assert!(found.rmse.unwrap() >= mean && mean > 0.05 && found.flip > Some(0.01), "{found:?}");
    assert_eq!(pixels(&found.png).len(), 3 * 48 * 36);
    assert!(Arc::ptr_eq(&session.comparison().unwrap().unwrap(), &found), "it is compared once");
    // Another size is not compared, and a layer is as it is shown.
    session.apply(&[Event::Size { width: 20, height: 20 }]).unwrap();
    session.whole_picture().unwrap();
    assert_eq!(session.comparison().unwrap().unwrap().rmse, None);
    session.let_go();
    assert!(session.comparison().unwrap().is_none() && session.kept_picture().is_none());
    assert!(session.apply(&[Event::Technique { technique: Some("magic".into()) }]).is_err());
}

#[test]
fn what_lies_below_the_pointer_is_told() {
    let folder = tempfile::tempdir().unwrap();
    write_volume(folder.path());
    let file = folder.path().join("scene.toml");
    let dense =
        VOLUME.replace("extinction = 0 }", "extinction = 90 }").replace("extinction = 2 }", "extinction = 90 }");
    let session = Session::open(Opening::of_text(&file, dense, RenderOptions::default()), &Progress::new()).unwrap();
    let picture = session.whole_picture().unwrap();
    let middle = PicturePlace { right: 0.5, down: 0.5 };
    wait_for("what lies below", || session.below(middle).is_some_and(|below| !below.values.is_empty()));
    let below = session.below(middle).unwrap();
    // The middle of the picture is the point (1, 1, 1): the front of the ramp, whose value is its height, 7 at z = 1.75.
    let [x, y, z] = below.position.unwrap();
    assert!((x - 1.0).abs() < 0.2 && (y - 1.0).abs() < 0.2 && (1.4..2.1).contains(&z), "{below:?}");
    assert!((below.depth.unwrap() - (8.0 - z)).abs() < 1e-3, "{below:?}");
    assert_eq!((below.object.as_deref(), below.layer.as_str(), below.numbers.len()), (Some("ramp"), "beauty", 3));
    assert_eq!(below.values[0].name, "value");
    assert!((below.values[0].value - (z / 0.25).min(7.0)).abs() < 1e-6, "{below:?}");
    let nothing = session.below(PicturePlace { right: 0.0, down: 0.0 }).unwrap();
    assert_eq!((nothing.position, nothing.object), (None, None));
    assert!(picture.facts.level == Level::Whole);
}

#[test]
fn recorded_events_that_name_nothing_of_the_scene_are_left_out() {
    let renamed = r#"{"do": "light_shadow", "light": "moon", "shadow": false}"#;
    let Opened { session, left_out } = played(&format!("[\n{renamed},\n{BRIGHTER}]")).unwrap();
    let said = "events.json:2: event 1 (`light_shadow`): expected the name of a light, found `moon`";
    assert!(left_out.len() == 1 && left_out[0].ends_with(said), "{left_out:?}");
    assert_eq!(session.shown().exposure, 1.0);
}

const BRIGHTER: &str = r#"{"do": "exposure", "stops": 1}"#;

/// A session that begins with a file of events.
fn played(events: &str) -> Result<Opened, organza::Error> {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("events.json");
    std::fs::write(&path, events).unwrap();
    Session::open_playing(opening(HEAD), &EventFile::read(&path)?, &Progress::new())
}

#[test]
fn a_recorded_event_that_is_refused_is_named_with_its_place() {
    let refused = |event: &str, after: &str, said: &str| {
        let error = played(&format!("[{BRIGHTER},\n{BRIGHTER}, {event}{after}]")).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains(&format!("events.json:2: event 3 {said}")) && !error.contains("--set"), "{error}");
    };
    // By the event alone, by the scene, and by the scene before others that it takes.
    refused(r#"{"do": "zoom", "steps": 1e9}"#, "", "(`zoom`): `steps`: expected");
    let technique = r#"{"do": "technique", "technique": "magic"}"#;
    refused(technique, "", "(`technique`): render.technique: ");
    let many = format!(",\n{BRIGHTER}").repeat(20);
    refused(technique, &many, "(`technique`): render.technique: ");
}

#[test]
fn a_recorded_column_that_the_file_lacks_is_refused_with_those_that_it_has() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("cloud.csv"), "x,y,z,heat\n0,0,0,1\n1,0,0,2\n0,1,0,3\n").unwrap();
    let scene =
        "version = 1\n[camera]\nauto = true\nsize = [16, 12]\n[[object]]\nname = \"cloud\"\npoints = \"cloud.csv\"\n";
    let path = folder.path().join("events.json");
    for (visible, column, is_there) in [(true, "heat", true), (true, "cold", false), (false, "cold", false)] {
        let events = format!(
            "[{{\"do\": \"show\", \"object\": \"cloud\", \"visible\": {visible}}}, {{\"do\": \"color_by\", \"object\": \"cloud\", \"column\": \"{column}\", \"map\": null}}]"
        );
        std::fs::write(&path, events).unwrap();
        let opening = Opening::of_text(folder.path().join("scene.toml"), scene, RenderOptions::default());
        let opened = Session::open_playing(opening, &EventFile::read(&path).unwrap(), &Progress::new());
        let error = opened.map(|_| ()).map_err(|error| error.to_string());
        let is_named = |error: &String| {
            error.contains("events.json:1: event 2 (`color_by`)") && error.contains("`cold`") && error.contains("heat")
        };
        assert!(if is_there { error.is_ok() } else { error.as_ref().is_err_and(is_named) }, "{column}: {error:?}");
    }
}

#[test]
fn spots_and_discs_are_turned_with_the_side_that_they_shine_to() {
    let spot = "kind = \"spot\"\nposition = [0, 3, 4]\nouter = 30\nintensity = [20, 20, 20]\n";
    let disc = "kind = \"disk\"\nposition = [0, 3, 4]\nnormal = [0, -3, -4]\nradius = 0.5\nintensity = [20, 20, 20]\n";
    let rect =
        "kind = \"rect\"\nposition = [0, 3, 4]\nu = [-0.5, 0, 0]\nv = [0, 0.4, -0.3]\nintensity = [20, 20, 20]\n";
    let point = "kind = \"point\"\nposition = [2, 4, 1]\nintensity = [20, 20, 20]\n";
    for light in [
        format!("{spot}target = [0, 0, 0]\n"),
        format!("{spot}direction = [0, -3, -4]\n"),
        disc.to_owned(),
        rect.to_owned(),
    ] {
        let session = session(&HEAD.replace(point, &light));
        let name = "sun".to_owned();
        session.apply(&[Event::LightDirection { light: name, azimuth: 90.0, elevation: 0.0 }]).unwrap();
        let shape = saved(&session).lights[0].light.shape;
        use splat_core::LightShape;
        let (place, to) = match shape {
            LightShape::Spot { position, direction, .. } => (position, direction),
            LightShape::Disk { center, normal, .. } => (center, normal),
            LightShape::Rect { center, u, v } => (center, u.cross(v).normalize()),
            other => panic!("{other:?}"),
        };
        // It stands as far away, to the right, and shines to the middle as before.
        assert!((place - splat_core::glam::DVec3::X * 5.0).length() < 1e-9, "{light}: {place}");
        assert!((to + splat_core::glam::DVec3::X).length() < 1e-9, "{light}: {to}");
        let row = session.shown().lights[0].direction.unwrap();
        assert!((row.azimuth - 90.0).abs() < 1e-9 && row.elevation.abs() < 1e-9);
    }
}

#[test]
fn files_that_change_are_read_again_and_broken_ones_are_told() {
    let folder = tempfile::tempdir().unwrap();
    write_volume(folder.path());
    let file = folder.path().join("scene.toml");
    std::fs::write(&file, VOLUME).unwrap();
    let session = Session::open(Opening::of_text(&file, VOLUME, RenderOptions::default()), &Progress::new()).unwrap();
    session.apply(&[Event::Exposure { stops: 1.0 }]).unwrap();
    let before = session.whole_picture().unwrap();
    // Another scene, with the changes of the view.
    std::fs::write(&file, VOLUME.replace("extinction = 2", "extinction = 20")).unwrap();
    session.reload();
    let denser = session.whole_picture().unwrap();
    assert!(pixels(&denser.png) != pixels(&before.png));
    assert_eq!(session.shown().exposure, 1.0);
    assert_shows_its_scene_at(&session, &file);
    // A broken one: its place is told, and the picture stays.
    std::fs::write(&file, VOLUME.replace("[ambient]", "[ambience]")).unwrap();
    session.reload();
    let failure = session.shown().failure.unwrap();
    assert!(failure.message.contains("scene.toml:6"), "{failure:?}");
    assert!(Arc::ptr_eq(&session.picture().unwrap(), &denser));
    // Broken data, too.
    std::fs::write(&file, VOLUME).unwrap();
    std::fs::write(folder.path().join("ramp.nrrd"), b"NRRD0004\n").unwrap();
    session.reload();
    let failure = session.whole_picture().unwrap_err();
    assert!(failure.message.contains("ramp.nrrd"), "{failure:?}");
    write_volume(folder.path());
    session.reload();
    assert!(pixels(&session.whole_picture().unwrap().png) == pixels(&before.png));
    assert_eq!(session.shown().failure, None);
}

fn assert_shows_its_scene_at(session: &Session, file: &Path) {
    let text = session.scene_text().unwrap();
    let scene = parse(file, text.as_bytes(), &LoadOptions::default()).unwrap();
    assert!(pixels(&session.whole_picture().unwrap().png) == drawn_alone(&scene));
}
