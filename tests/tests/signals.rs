//! Signals: what was ignored stays ignored, nothing is left behind, and a file that may not grow further is an error with a message.
#![cfg(target_os = "linux")]

use organza_tests::{Place, SMALL_SCENE, organza};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

const FOG: &str = "[[object]]\nname = \"fog\"\nmedium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.5, spacing = 0.25 }\n";

/// The command behind a line of the shell, such as `trap "" HUP`.
fn behind(line: &str, place: &Place, arguments: &[&str]) -> Command {
    let mut shell = Command::new("sh");
    shell.current_dir(place.folder()).arg("-c").arg(format!("{line}; exec \"$0\" \"$@\""));
    shell.arg(organza().get_program()).args(arguments).stdout(Stdio::piped()).stderr(Stdio::piped());
    shell
}

fn send(signal: &str, child: &Child) {
    Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
}

/// Waits until a file of a name that begins so is there, or the command has ended.
fn wait_for(place: &Place, beginning: &str, child: &mut Child) {
    let is_there = || place.made().iter().any(|name| name.starts_with(beginning));
    while !is_there() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(1));
    }
}

fn told(out: &Output) -> String {
    String::from_utf8_lossy(&out.stderr).into_owned()
}

#[test]
fn signals_that_were_ignored_stay_ignored() {
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}[render]\ntechnique = \"particles\"\nantialias = 1\n"));
    let arguments = ["render", "s.toml", "-o", "a.exr", "--size", "48x32", "--repeat-level", "400"];
    let mut child = behind("trap '' HUP INT TERM", &place, &arguments).spawn().unwrap();
    for _ in 0..4 {
        // Before it listens they change nothing, and while it draws they must not.
        std::thread::sleep(Duration::from_millis(60));
        ["-HUP", "-INT", "-TERM"].iter().for_each(|signal| send(signal, &child));
    }
    wait_for(&place, "a.exr", &mut child);
    let out = child.wait_with_output().unwrap();
    assert_eq!(out.status.code(), Some(0), "{}", told(&out));
}

#[test]
fn frames_that_are_checked_leave_nothing_behind() {
    let track = "[animation]\nframes = 2000\n[[animation.track]]\nset = \"object.fog.transform.translate\"\n\
                 keys = [{ frame = 0, value = [0, 0, 0] }, { frame = 1999, value = [1, 0, 0] }]\n";
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}{track}"));
    for signal in ["-TERM", "-INT"] {
        let mut child =
            behind("true", &place, &["render", "s.toml", "-o", "p.png", "--frames", "--force"]).spawn().unwrap();
        wait_for(&place, ".organza-", &mut child);
        send(signal, &child);
        let out = child.wait_with_output().unwrap();
        assert_eq!(out.status.code(), Some(130), "{signal}: {}", told(&out));
        let left: Vec<String> = place.made().into_iter().filter(|name| name.starts_with('.')).collect();
        assert!(left.is_empty(), "{signal}: {left:?}");
    }
}

#[test]
fn a_file_that_may_not_grow_further_is_an_error_with_a_message() {
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}"));
    let out = behind("ulimit -f 1", &place, &["render", "s.toml", "-o", "a.exr", "--size", "96x64"]).output().unwrap();
    assert_eq!(out.status.code(), Some(4), "{}", told(&out));
    assert!(told(&out).contains("a.exr: cannot write: File too large"), "{}", told(&out));
    assert!(place.made().is_empty());
}

#[test]
fn pipes_in_the_place_of_files_are_told_and_nobody_waits_for_them() {
    let points = "[[object]]\nname = \"p\"\npoints = \"p.xyz\"\n[render]\ntechnique = \"particles\"\nantialias = 1\n";
    let place = Place::new(&format!("{SMALL_SCENE}{points}"));
    Command::new("mkfifo").arg(place.path("p.xyz")).status().unwrap();
    let arguments = ["render", "s.toml", "-o", "a.exr", "--checkpoint", "sums"];
    let mut command = Command::new("timeout");
    let out =
        command.arg("20").arg(organza().get_program()).args(arguments).current_dir(place.folder()).output().unwrap();
    assert_eq!(out.status.code(), Some(4), "{}", told(&out));
    assert!(told(&out).contains("p.xyz: cannot read: not a regular file"), "{}", told(&out));
}

#[test]
fn frames_keep_nothing_but_documents_which_count() {
    let track = "[animation]\nframes = 3\n[[animation.track]]\nset = \"object.fog.transform.translate\"\n\
                 keys = [{ frame = 0, value = [0, 0, 0] }, { frame = 2, value = [1, 0, 0] }]\n";
    let place = Place::new(&format!("{SMALL_SCENE}{FOG}{track}"));
    let out = place.expect(0, &["render", "s.toml", "-o", "p.png", "--frames", "--json"], "");
    let document: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    let frames = document["frames"].as_array().unwrap();
    assert_eq!(frames.iter().map(|f| f["frame"].as_u64().unwrap()).collect::<Vec<_>>(), [0, 1, 2]);
    // As one document it is written as before.
    assert_eq!(String::from_utf8(out.stdout).unwrap(), format!("{document:#}\n"));
    let out = place.expect(0, &["render", "s.toml", "-o", "p.png", "--frames", "--force"], "");
    let text = String::from_utf8(out.stdout).unwrap();
    let at = |frame: &str| text.find(frame).unwrap();
    assert!(at("frame 0\n") < at("frame 1\n") && at("frame 1\n") < at("frame 2\n"), "{text}");
}
