//! `--max-memory` and what `explain` says bound what is resident, and a system that gives less is answered with exit code 5.
#![cfg(target_os = "linux")]

use organza_tests::{Peak, Place, SMALL_SCENE, organza, run_measured};
use std::path::Path;
use std::process::{Command, Output};

/// Resident bytes of the program itself, its threads and what an allocator keeps of freed memory.
pub(crate) const PROGRAM: u64 = 64 << 20;

const FOG: &str = r#"[[object]]
name = "fog"
medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = SPACING }
"#;

fn fog(spacing: f64) -> String {
    format!("{SMALL_SCENE}{}", FOG.replace("SPACING", &format!("{spacing:?}")))
}

fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = organza();
    command.current_dir(folder).args(arguments).args(["--threads", "2"]);
    command
}

/// Bytes that `explain` says.
#[track_caller]
fn explained(folder: &Path, scene: &str, more: &[&str]) -> u64 {
    let out = command(folder, &[&["explain", scene, "--json"], more].concat()).output().unwrap();
    assert!(out.status.success(), "{scene}: {}", String::from_utf8_lossy(&out.stderr));
    let document: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    document["memory_bytes"].as_u64().unwrap()
}

/// A render that may take so much.
fn render_within(folder: &Path, scene: &str, bytes: u64, more: &[&str]) -> (Output, Peak) {
    let bytes = bytes.to_string();
    let picture = tempfile::tempdir().unwrap();
    let picture = picture.path().join("p.exr");
    let arguments = ["render", scene, "-o", picture.to_str().unwrap(), "--max-memory", &bytes];
    run_measured(&mut command(folder, &[&arguments, more].concat()))
}

#[track_caller]
fn stays_within(folder: &Path, scene: &str, more: &[&str]) {
    let bytes = explained(folder, scene, more);
    let (out, peak) = render_within(folder, scene, bytes, more);
    assert!(out.status.success(), "{scene} within {bytes}: {}", String::from_utf8_lossy(&out.stderr));
    let resident = peak.resident;
    println!("{scene}: explained {bytes}, resident {resident}");
    assert!(resident <= bytes + PROGRAM, "{scene}: explained {bytes} bytes, {resident} were resident");
}

#[test]
fn shadow_maps_of_many_lights_are_counted_together() {
    let light = |k: i32| format!("[[light]]\nkind = \"point\"\nposition = [{k}, 4, 1]\nintensity = [1, 1, 1]\n");
    let lights =
        |n: i32| (0..n).map(light).collect::<String>() + "[render]\ntechnique = \"points\"\nshadow = { cells = 128 }\n";
    let place = Place::new(&format!("{}{}", fog(0.25), lights(1)));
    place.write("many.toml", format!("{}{}", fog(0.25), lights(31)));
    let few = explained(place.folder(), "s.toml", &[]);
    let many = explained(place.folder(), "many.toml", &[]);
    assert!(many > few + 100_000_000, "{few}, {many}");
    stays_within(place.folder(), "many.toml", &[]);
    // Each would fit; together they do not, and that is known before any is built.
    let (out, peak) = render_within(place.folder(), "many.toml", (few + many) / 2, &[]);
    assert_eq!(out.status.code(), Some(5));
    assert!(peak.resident < PROGRAM, "{} resident", peak.resident);
}

#[test]
fn less_memory_than_a_scene_needs_is_exit_5_and_never_an_abort() {
    let place = Place::new(&fog(0.1));
    let by_points = (vec!["--technique", "points"], vec![50, 75, 90]);
    let by_particles = (vec!["--technique", "particles", "--repeat-level", "2"], vec![75]);
    for (more, percents) in [by_points, by_particles] {
        let arguments = [&["render", "s.toml", "--force", "--size", "1600x1000", "--threads", "1"], &more[..]].concat();
        let (out, peak) = run_measured(organza().current_dir(place.folder()).args(&arguments));
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        for percent in percents {
            let kib = peak.address_space / 100 * percent / 1024;
            let mut shell = Command::new("sh");
            shell.current_dir(place.folder()).arg("-c").arg(format!("ulimit -v {kib}; exec \"$0\" \"$@\""));
            let out = shell.arg(organza().get_program()).args(&arguments).output().unwrap();
            let text = String::from_utf8_lossy(&out.stderr);
            assert_eq!(out.status.code(), Some(5), "{percent} % of {}, {more:?}: {text}", peak.address_space);
            assert!(text.contains("the limit is"), "{text}");
        }
    }
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn however_little_memory_the_system_gives_the_end_is_exit_5() {
        let place = Place::new(&fog(0.05));
        let arguments = ["render", "s.toml", "--force", "--size", "320x200", "--threads", "2"];
        let (out, peak) = run_measured(organza().current_dir(place.folder()).args(arguments));
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
        // Below this much the program itself does not start.
        let least = 96 << 20;
        for part in 0..24 {
            let kib = (least + (peak.address_space - least) / 24 * part) / 1024;
            let mut shell = Command::new("sh");
            shell.current_dir(place.folder()).arg("-c").arg(format!("ulimit -v {kib}; exec \"$0\" \"$@\""));
            let out = shell.arg(organza().get_program()).args(arguments).output().unwrap();
            let text = String::from_utf8_lossy(&out.stderr);
            let code = out.status.code();
            assert!(code == Some(5) || code == Some(0), "{kib} KiB of {}: {code:?} {text}", peak.address_space);
        }
    }

    #[test]
    fn frames_fit_in_what_the_first_is_explained_to_take() {
        // Its lamps stand above the border of the cloud, under which more entries are deposited than predicted.
        let lamp = "[[light]]\nkind = \"point\"\nposition = [2.0, 3, 0.0]\nintensity = [3, 3, 3]\n\
                    [[light]]\nkind = \"point\"\nposition = [1.081, 3, 1.683]\nintensity = [3, 3, 3]\n";
        let track = "[animation]\nframes = 40\n[[animation.track]]\nset = \"object.fog.transform.translate\"\n\
                     keys = [{ frame = 0, value = [0, 0, 0] }, { frame = 39, value = [1, 0, 0] }]\n";
        let place = Place::new(&format!("{}{lamp}{track}", fog(0.06)));
        let limit = explained(place.folder(), "s.toml", &[]);
        let (out, _) = render_within(place.folder(), "s.toml", limit, &["--frames=0-11"]);
        assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
    }

    #[test]
    fn frames_that_wait_take_little_memory() {
        let place = Place::new(&fog(0.25));
        let track = "[[animation.track]]\nset = \"object.fog.transform.translate\"\n\
                     keys = [{ frame = 0, value = [0, 0, 0] }, { frame = 9999, value = [1, 0, 0] }]\n";
        place.write("s.toml", format!("{}[animation]\nframes = 10000\n{track}", fog(0.25)));
        for technique in ["points", "particles", "sheets"] {
            let peak = |last: usize| {
                // All frames are checked before the first is drawn; the last one is refused.
                let name = format!("p.{last:04}.png");
                place.write(&name, "old");
                let frames = format!("--frames=0-{last}");
                // Of more threads each has memory of its own, by chance.
                let arguments =
                    ["render", "s.toml", "-o", "p.png", "--technique", technique, &frames, "--threads", "1"];
                let (out, peak) = run_measured(organza().current_dir(place.folder()).args(arguments));
                assert_eq!(out.status.code(), Some(4), "{}", String::from_utf8_lossy(&out.stderr));
                std::fs::remove_file(place.path(&name)).unwrap();
                peak.resident
            };
            let few = peak(100);
            let many = peak(9900);
            let each = many.saturating_sub(few) / 9800;
            println!("{technique}: {each} bytes a frame");
            assert!(each < 1024, "{technique}: {each} bytes a frame");
        }
    }

    #[test]
    fn large_pictures_stay_within_what_explain_says() {
        let place = Place::new(&fog(0.1));
        stays_within(place.folder(), "s.toml", &["--size", "1200x800"]);
        stays_within(
            place.folder(),
            "s.toml",
            &["--size", "900x600", "--layers", "effects,normal,shadow,depth,object"],
        );
        let opaque = fog(0.1)
            + "[[object]]\nname = \"board\"\nrectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.05 }\n";
        place.write("opaque.toml", opaque);
        stays_within(place.folder(), "opaque.toml", &["--size", "1200x800"]);
    }

    #[test]
    fn many_splats_stay_within_what_explain_says() {
        let place = Place::new(&fog(0.02));
        stays_within(place.folder(), "s.toml", &[]);
        // Each reaches many tiles.
        place.write("wide.toml", fog(0.05));
        stays_within(place.folder(), "wide.toml", &["--size", "1800x1200"]);
    }
}
