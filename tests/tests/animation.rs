//! Frames of a scene whose values have keys.

use organza_tests::{Place, SMALL_SCENE, draw};
use serde_json::Value;
use std::fs;

const OBJECTS: &str = r#"[[object]]
name = "fog"
medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = 0.25 }
[[object]]
name = "ball"
medium_ball = { center = [0, 0, 0], radius = 0.5, extinction = 3, spacing = 0.125 }
"#;

const TRACKS: &str = r#"[animation]
frames = 9
[[animation.track]]
set = "camera.position"
keys = [{ frame = 0, value = [0, 0, 4] }, { frame = 8, value = [2, -1, 4] }]
[[animation.track]]
set = "object.ball.transform.translate"
interpolation = "smooth"
keys = [{ frame = 2, value = [0, 0, 0] }, { frame = 4, value = [0.5, 0, 0] }, { frame = 8, value = [0.5, 1, 0] }]
[[animation.track]]
set = "object.fog.visible"
keys = [{ frame = 0, value = true }, { frame = 5, value = false }]
"#;

fn still() -> String {
    format!("{SMALL_SCENE}{OBJECTS}")
}

fn moving() -> String {
    format!("{}{TRACKS}", still())
}

#[track_caller]
fn refused(scene: &str, arguments: &[&str], code: i32, stderr: &str) {
    let place = Place::new(scene);
    place.expect(code, &[&["render", "s.toml"], arguments].concat(), stderr);
    assert!(place.made().is_empty());
}

#[test]
fn a_frame_is_the_scene_with_its_values() {
    for (frame, sets) in [
        ("0", &[][..]),
        ("4", &["camera.position=[1, -0.5, 4]", "object.ball.transform.translate=[0.5, 0, 0]"]),
        // Half way between keys 4 and 8: ½(v₀ + v₁) + ⅛·4·(m₀ − m₁), slopes m₀ = (0.5, 1, 0)/6 and m₁ = (0, 0.25, 0).
        (
            "6",
            &[
                "camera.position=[1.5, -0.75, 4]",
                "object.ball.transform.translate=[0.5416666666666666, 0.4583333333333333, 0]",
                "object.fog.visible=false",
            ],
        ),
    ] {
        let place = Place::new(&moving());
        let frames = format!("--frames={frame}");
        place.expect(0, &["render", "s.toml", "-o", "a.png", "-o", "b.png", &frames], "");
        let drawn = place.pixels(&format!("a.000{frame}.png"));
        assert!(drawn == place.pixels(&format!("b.000{frame}.png")));
        place.write("s.toml", still());
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        place.expect(0, &[&["render", "s.toml", "-o", "still.png"], &sets[..]].concat(), "");
        assert!(drawn == place.pixels("still.png"), "frame {frame}");
    }
    // Without --frames the scene is drawn as it is written.
    assert_eq!(draw(&moving(), &[]), draw(&still(), &[]));
}

#[test]
fn frames_are_numbered_files_and_one_document() {
    let place = Place::new(&moving());
    let out = place.run(&["render", "s.toml", "-o", "p.exr", "--cost", "c.json", "--frames=3-5", "--json"]);
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    let frames = document["frames"].as_array().unwrap();
    assert_eq!(frames.iter().map(|f| f["frame"].as_u64().unwrap()).collect::<Vec<_>>(), [3, 4, 5]);
    for (i, frame) in (3..=5).zip(frames) {
        assert_eq!(frame["outputs"][0]["path"], format!("p.{i:04}.exr"));
        assert!(place.path(&format!("p.{i:04}.exr")).exists());
        let cost: Value = serde_json::from_slice(&place.bytes(&format!("c.{i:04}.json"))).unwrap();
        assert_eq!(cost, frame["cost"]);
    }
    assert_ne!(frames[0]["scene_sha256"], frames[1]["scene_sha256"]);
    // One file in the way stops all of them before any work.
    fs::remove_file(place.path("p.0003.exr")).unwrap();
    place.expect(4, &["render", "s.toml", "-o", "p.exr", "--frames"], "p.0004.exr: this file exists already");
    assert!(!place.path("p.0000.exr").exists());
}

#[test]
fn wrong_frames_and_tracks_are_refused_with_their_place() {
    let with = |from: &str, to: &str| moving().replace(from, to);
    refused(&still(), &["--frames"], 2, "s.toml has no animation\nhint: add the table [animation]");
    refused(&moving(), &["--frames=0-9"], 2, "the frames of this scene are 0 to 8");
    refused(&moving(), &["--frames=5-4"], 2, "expected FIRST-LAST");
    refused(&with("frames = 9", "frames = 0"), &[], 3, "s.toml:19:10: `frames`: expected a whole number from 1");
    refused(
        &with("object.fog.visible", "object.fgo.visible"),
        &["--frames"],
        3,
        "s.toml:28:7: `set`: expected an index",
    );
    refused(&with("object.fog.visible", "object.fog.visibel"), &["--frames"], 3, "unknown key `visibel`");
    refused(&with("object.fog.visible", "version"), &[], 3, "expected a value of the scene, found `version`");
    refused(&with("object.fog.visible", "a..b"), &[], 3, "`set`: expected 1 to 64 keys with dots between them");
    refused(&with("value = [2, -1, 4]", "value = [2, -1]"), &["--frames"], 3, "s.toml:22:");
    refused(&with("value = [2, -1, 4]", "value = \"x\""), &["--frames"], 3, "found the text \"x\"");
    refused(&with("frame = 4", "frame = 2"), &[], 3, "`frame`: expected a frame after 2, found 2");
    refused(&with("frame = 4", "frme = 4"), &[], 3, "unknown key `frme`");
    // A frame in the middle whose value is out of range, before anything is drawn.
    let far = with("set = \"object.fog.visible\"", "set = \"object.fog.spacing\"");
    refused(&far.replace("value = true", "value = 0.25").replace("value = false", "value = -1"), &["--frames"], 3, "");
}

const SAMPLED: &str = r#"[[object]]
name = "ball"
implicit = { expression = "x^2 + y^2 + z^2 - 0.25", box = [[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], spacing = 0.05 }
opacity = 0.5
[[object]]
name = "fog"
medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = 0.25 }
[render]
technique = "particles"
antialias = 1
shadow = { cells = 64 }
particles = { repeat_level = 2000 }
[animation]
frames = 4
[[animation.track]]
set = "object.fog.visible"
keys = [{ frame = 0, value = true }, { frame = 1, value = false }, { frame = 2, value = true }]
[[animation.track]]
set = "object.ball.transform.translate"
keys = [{ frame = 2, value = [0, 0, 0] }, { frame = 3, value = [0.25, 0, -0.5] }]
"#;

/// Particles sampled for a frame, if any were.
fn sampled(frame: &Value) -> Option<u64> {
    let stages = frame["cost"].as_array().unwrap();
    stages.iter().find(|s| s["name"] == "sample").map(|s| s["items_out"].as_u64().unwrap())
}

#[test]
fn what_moves_or_hides_is_not_sampled_again() {
    let place = Place::new(&format!("{SMALL_SCENE}{SAMPLED}"));
    let out = place.expect(0, &["render", "s.toml", "-o", "p.png", "--frames", "--json"], "");
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    let frames = document["frames"].as_array().unwrap();
    assert!(sampled(&frames[0]).is_some_and(|n| n > 1000), "{}", frames[0]["cost"]);
    assert!(frames[1..].iter().all(|f| sampled(f).is_none()), "{document:#}");
    let drawn = |frame: u32| place.pixels(&format!("p.{frame:04}.png"));
    assert!(drawn(0) == drawn(2));
    assert!(drawn(0) != drawn(1) && drawn(2) != drawn(3));
    // The ball is nearest before it moves: these frames are as fine as a still picture, and the same.
    place.expect(0, &["render", "s.toml", "-o", "still.png"], "");
    assert!(drawn(0) == place.pixels("still.png"));
    // Without room every frame samples as it draws.
    let little = ["render", "s.toml", "-o", "little.png", "--frames", "--json", "--max-memory", "20M"];
    let out = place.expect(0, &little, "");
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert!(document["frames"].as_array().unwrap().iter().all(|f| sampled(f).is_none()));
    assert!(place.pixels("little.0003.png") == drawn(3));
}

/// A triangle, and vertices that belong to none: 3.6 MB in memory, a few splats.
fn large_file() -> String {
    let loose = 300_000;
    let header = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face 1\nproperty list uchar int vertex_indices\nend_header\n",
        loose + 3
    );
    format!("{header}-1 -1 0\n1 -1 0\n0 1 0\n{}3 0 1 2\n", "0 0 0\n".repeat(loose))
}

#[test]
fn files_are_read_once_while_they_fit() {
    use organza::{Progress, RenderOptions, Sequence, render, scene};
    let place = Place::new("");
    let files = ["t.ply", "u.ply", "v.ply", "w.ply"];
    let write = || files.iter().for_each(|file| place.write(file, large_file()));
    let remove = || files.iter().for_each(|file| fs::remove_file(place.path(file)).unwrap());
    write();
    let object = |file| format!("[[object]]\nname = \"{file}\"\nmesh = \"{file}\"\nspacing = 0.05\n");
    let text = [still(), files.map(object).concat(), TRACKS.to_owned()].concat();
    let frame = |k| {
        // What `auto` chooses would fit into plenty of memory alone.
        let overrides = vec![scene::Override::parse("render.technique='points'").unwrap()];
        let options = scene::LoadOptions { frame: Some(k), overrides, ..Default::default() };
        scene::parse(&place.path("s.toml"), text.as_bytes(), &options).unwrap()
    };
    let scenes = [frame(0), frame(6)];
    let progress = Progress::new();
    let plenty = RenderOptions::default();
    let alone = scenes.each_ref().map(|s| render(s, &plenty, &progress).unwrap().layers);

    let mut sequence = Sequence::new(&scenes);
    assert_eq!(sequence.render(&scenes[0], &plenty, &progress).unwrap().layers, alone[0]);
    remove();
    assert_eq!(sequence.render(&scenes[1], &plenty, &progress).unwrap().layers, alone[1]);

    // A quarter of this is less than the files take.
    write();
    let short = RenderOptions { max_memory: 50 << 20, ..plenty };
    let mut sequence = Sequence::new(&scenes);
    assert_eq!(sequence.render(&scenes[0], &short, &progress).unwrap().layers, alone[0]);
    remove();
    let refused = sequence.render(&scenes[1], &short, &progress).unwrap_err();
    assert!(refused.to_string().contains("t.ply"), "{refused}");
}

/// The names of the passes that make splats and their shadows, as far as they ran.
fn made_anew(drawn: &organza::Render) -> Vec<&str> {
    let names = drawn.cost.stages.iter().map(|stage| stage.name.as_str());
    names.filter(|name| ["read", "convert", "tsm build"].contains(name)).collect()
}

#[test]
fn a_camera_that_moves_alone_sees_what_was_made_for_the_frame_before() {
    use organza::{Progress, RenderOptions, Sequence, render, scene};
    const MATTER: &str = r#"[[object]]
name = "pane"
rectangle = { center = [0, 0, -0.7], u = [1.5, 0, 0], v = [0, 1.5, 0], spacing = 0.15 }
opacity = 0.6
[[object]]
name = "wall"
rectangle = { center = [0, 0, -1.5], u = [3, 0, 0], v = [0, 3, 0], spacing = 0.2 }
[[light]]
kind = "point"
position = [1, 3, 3]
intensity = [30, 10, 20]
[[light]]
kind = "directional"
direction = [0.2, -1, -1]
irradiance = [1, 2, 1]
"#;
    // The camera turns in frames 1 and 3, the pane in frame 2.
    const TRACKS: &str = r#"[animation]
frames = 4
[[animation.track]]
set = "camera.position"
keys = [{ frame = 0, value = [0, 0, 4] }, { frame = 1, value = [2, 1, 3] }, { frame = 2, value = [2, 1, 3] }, { frame = 3, value = [-1, 0, 4] }]
[[animation.track]]
set = "object.pane.transform.translate"
keys = [{ frame = 1, value = [0, 0, 0] }, { frame = 2, value = [0.3, 0, 0] }]
"#;
    let options = RenderOptions::default();
    let progress = Progress::new();
    for settings in [
        "[render]\ntechnique = 'points'\n",
        "[render]\ntechnique = 'points'\nshadow = { cells = 9 }\n",
        "[render]\ntechnique = 'surfels'\n",
        "[render]\ntechnique = 'sheets'\n",
        "[render]\ntechnique = 'particles'\nparticles = { repeat_level = 4 }\n",
    ] {
        let objects = if settings.contains("surfels") { "" } else { OBJECTS };
        let text = [SMALL_SCENE, objects, MATTER, TRACKS, settings].concat();
        let frame = |k| {
            let options = scene::LoadOptions { frame: Some(k), ..Default::default() };
            scene::parse("s.toml".as_ref(), text.as_bytes(), &options).unwrap_or_else(|e| panic!("{settings}: {e}"))
        };
        let scenes = [0, 1, 2, 3].map(frame);
        let mut sequence = Sequence::new(&scenes);
        let drawn = scenes.each_ref().map(|s| sequence.render(s, &options, &progress).unwrap());
        for (k, (drawn, scene)) in drawn.iter().zip(&scenes).enumerate() {
            let alone = render(scene, &options, &progress).unwrap();
            // Sets of particles are as fine as any frame needs them.
            assert!(settings.contains("particles") || drawn.layers == alone.layers, "{settings}: frame {k}");
            assert_eq!(drawn.plan, alone.plan, "{settings}: frame {k}");
        }
        let [first, turned, moved, again] = drawn.each_ref().map(made_anew);
        assert!(first.len() > 2 && first == moved, "{settings}: {first:?} {moved:?}");
        assert!(turned.is_empty() && again.is_empty(), "{settings}: {turned:?} {again:?}");
        assert_ne!(drawn[0].layers, drawn[1].layers, "{settings}");
    }
}

#[test]
fn what_a_camera_decides_is_made_for_each() {
    use organza::{Progress, RenderOptions, Sequence, render, scene};
    let place = Place::new("");
    place.write("p.xyz", (0..200).map(|i| format!("{} {} 0\n", i % 20, i / 20)).collect::<String>());
    let text = format!(
        "{SMALL_SCENE}[[object]]\nname = 'p'\npoints = 'p.xyz'\npoint_size = {{ pixels = 3 }}\ntransform = {{ scale = 0.1 }}\n\
         [animation]\nframes = 2\n[[animation.track]]\nset = 'camera.position'\n\
         keys = [{{ frame = 0, value = [1, 1, 3] }}, {{ frame = 1, value = [1, 1, 9] }}]\n"
    );
    let frame = |k| {
        let options = scene::LoadOptions { frame: Some(k), ..Default::default() };
        scene::parse(&place.path("s.toml"), text.as_bytes(), &options).unwrap()
    };
    let scenes = [frame(0), frame(1)];
    let options = RenderOptions::default();
    let progress = Progress::new();
    let mut sequence = Sequence::new(&scenes);
    let drawn = scenes.each_ref().map(|s| sequence.render(s, &options, &progress).unwrap());
    assert!(made_anew(&drawn[1]).contains(&"convert"));
    assert_eq!(drawn[1].layers, render(&scenes[1], &options, &progress).unwrap().layers);
}
