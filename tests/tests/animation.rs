//! Frames of a scene whose values have keys.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use organza_tests::{draw, organza};
use serde_json::Value;
use std::fs;
use std::path::Path;
use std::process::Output;

const STILL: &str = r#"version = 1
[camera]
position = [0, 0, 4]
target = [0, 0, 0]
size = [24, 16]
[[light]]
kind = "point"
position = [2, 4, 1]
intensity = [20, 20, 20]
[[object]]
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

fn run(folder: &Path, scene: &str, arguments: &[&str]) -> Output {
    fs::write(folder.join("s.toml"), scene).unwrap();
    organza().args(["render", "s.toml"]).args(arguments).current_dir(folder).output().unwrap()
}

#[track_caller]
fn refused(scene: &str, arguments: &[&str], code: i32, stderr: &str) {
    let folder = tempfile::tempdir().unwrap();
    let out = run(folder.path(), scene, arguments);
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(code), "{text}");
    assert!(text.contains(stderr), "expected: {stderr}\nfound:    {text}");
    assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is written");
}

#[test]
fn a_frame_is_the_scene_with_its_values() {
    let scene = format!("{STILL}{TRACKS}");
    let pixels = |frame: &str, sets: &[&str]| {
        let folder = tempfile::tempdir().unwrap();
        let out = run(folder.path(), &scene, &["-o", "a.png", "-o", "b.png", &format!("--frames={frame}")]);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        let name = |stem: &str| folder.path().join(format!("{stem}.{:04}.png", frame.parse::<u32>().unwrap()));
        let drawn = fs::read(name("a")).unwrap();
        assert_eq!(drawn, fs::read(name("b")).unwrap());
        let sets: Vec<&str> = sets.iter().flat_map(|s| ["--set", s]).collect();
        let out = run(folder.path(), STILL, &[&["-o", "still.png"], &sets[..]].concat());
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        (drawn, fs::read(folder.path().join("still.png")).unwrap())
    };
    for (frame, sets) in [
        ("0", &[][..]),
        ("4", &["camera.position=[1, -0.5, 4]", "object.ball.transform.translate=[0.5, 0, 0]"]),
        // Half way between keys 4 and 8 the cubic with slopes 0.5/6, 0.25/6 before and 0, 0.25 after: ½(v₀ + v₁) + ⅛·4·(m₀ − m₁).
        (
            "6",
            &[
                "camera.position=[1.5, -0.75, 4]",
                "object.ball.transform.translate=[0.5416666666666666, 0.4583333333333333, 0]",
                "object.fog.visible=false",
            ],
        ),
    ] {
        let (drawn, still) = pixels(frame, sets);
        assert_eq!(drawn, still, "frame {frame}");
    }
    // Without --frames the scene is drawn as it is written.
    assert_eq!(draw(&scene, &[]), draw(STILL, &[]));
}

#[test]
fn frames_are_numbered_files_and_one_document() {
    let folder = tempfile::tempdir().unwrap();
    let scene = format!("{STILL}{TRACKS}");
    let out = run(folder.path(), &scene, &["-o", "p.exr", "--cost", "c.json", "--frames=3-5", "--json"]);
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    let frames = document["frames"].as_array().unwrap();
    assert_eq!(frames.iter().map(|f| f["frame"].as_u64().unwrap()).collect::<Vec<_>>(), [3, 4, 5]);
    for (i, frame) in (3..=5).zip(frames) {
        assert_eq!(frame["outputs"][0]["path"], format!("p.{i:04}.exr"));
        assert!(folder.path().join(format!("p.{i:04}.exr")).exists());
        let cost: Value =
            serde_json::from_slice(&fs::read(folder.path().join(format!("c.{i:04}.json"))).unwrap()).unwrap();
        assert_eq!(cost, frame["cost"]);
    }
    assert_ne!(frames[0]["scene_sha256"], frames[1]["scene_sha256"]);
    // One file in the way stops all of them before any work.
    fs::remove_file(folder.path().join("p.0003.exr")).unwrap();
    let out = run(folder.path(), &scene, &["-o", "p.exr", "--frames"]);
    assert_eq!(out.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&out.stderr).contains("p.0004.exr: this file exists already"));
    assert!(!folder.path().join("p.0000.exr").exists());
}

#[test]
fn wrong_frames_and_tracks_are_refused_with_their_place() {
    let with = |from: &str, to: &str| format!("{STILL}{TRACKS}").replace(from, to);
    refused(STILL, &["--frames"], 2, "s.toml has no animation\nhint: add the table [animation]");
    refused(&with("", ""), &["--frames=0-9"], 2, "the frames of this scene are 0 to 8");
    refused(&with("", ""), &["--frames=5-4"], 2, "expected FIRST-LAST");
    refused(&with("frames = 9", "frames = 0"), &[], 3, "s.toml:17:10: `frames`: expected a whole number from 1");
    refused(
        &with("object.fog.visible", "object.fgo.visible"),
        &["--frames"],
        3,
        "s.toml:26:7: `set`: expected an index",
    );
    refused(&with("object.fog.visible", "object.fog.visibel"), &["--frames"], 3, "unknown key `visibel`");
    refused(&with("object.fog.visible", "version"), &[], 3, "expected a value of the scene, found `version`");
    refused(&with("object.fog.visible", "a..b"), &[], 3, "`set`: expected 1 to 64 keys with dots between them");
    refused(&with("value = [2, -1, 4]", "value = [2, -1]"), &["--frames"], 3, "s.toml:20:");
    refused(&with("value = [2, -1, 4]", "value = \"x\""), &["--frames"], 3, "found the text \"x\"");
    refused(&with("frame = 4", "frame = 2"), &[], 3, "`frame`: expected a frame after 2, found 2");
    refused(&with("frame = 4", "frme = 4"), &[], 3, "unknown key `frme`");
    // A frame in the middle whose value is out of range, before anything is drawn.
    let far = with("set = \"object.fog.visible\"", "set = \"object.fog.spacing\"");
    refused(&far.replace("value = true", "value = 0.25").replace("value = false", "value = -1"), &["--frames"], 3, "");
}
