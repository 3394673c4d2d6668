//! The real command: exit codes, refusals before work, closed pipes, odd names, interrupts.

use organza_tests::{Place, SMALL_SCENE, organza};
use serde_json::Value;
use std::fs;
use std::process::{Command, Output, Stdio};

const FOG: &str = r#"[[object]]
name = "fog"
medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = 0.25 }
"#;

fn scene() -> String {
    format!("{SMALL_SCENE}{FOG}")
}

fn place() -> Place {
    Place::new(&scene())
}

fn json_of(out: &Output) -> Value {
    serde_json::from_slice(&out.stdout).unwrap()
}

#[test]
fn exit_0_render_writes_all_outputs_and_nothing_else() {
    let place = place();
    let out = place.expect(0, &["render", "s.toml", "-o", "a.exr", "-o", "b.png", "--cost", "c.json", "--json"], "");
    assert_eq!(place.made(), ["a.exr", "b.png", "c.json"]);
    let document = json_of(&out);
    assert_eq!(document["outputs"][0]["path"], "a.exr");
    assert_eq!(document["outputs"][1]["bytes"], fs::metadata(place.path("b.png")).unwrap().len());
    assert_eq!(document["size"], serde_json::json!([24, 16]));
    let cost: Value = serde_json::from_slice(&fs::read(place.path("c.json")).unwrap()).unwrap();
    assert_eq!(cost, document["cost"]);
    assert!(cost.as_array().is_some_and(|stages| !stages.is_empty()));
}

#[test]
fn options_and_sets_both_hold_and_contradictions_are_refused() {
    let place = place();
    let size = |arguments: &[&str]| {
        let out = place.expect(0, &[&["render", "s.toml", "-o", "a.png", "--force", "--json"], arguments].concat(), "");
        json_of(&out)["size"].clone()
    };
    let camera = "camera={ position = [0, 0, 5], target = [0, 0, 0], size = [8, 6] }";
    let placed = "camera={ position = [0, 0, 5], target = [0, 0, 0] }";
    assert_eq!(size(&["--set", camera]), serde_json::json!([8, 6]));
    assert_eq!(size(&["--size", "20x10", "--set", placed]), serde_json::json!([20, 10]));
    assert_eq!(size(&["--size", "8x6", "--set", camera]), serde_json::json!([8, 6]));
    for (options, key) in [
        (&["--size", "20x10", "--set", camera][..], "camera.size"),
        (&["--technique", "surfels", "--set", "render={ technique = 'points' }"], "render.technique"),
        (&["--background", "white", "--set", "background.color=[0, 0, 1]"], "background"),
        (&["--budget", "500", "--set", "render.budget_ms=400"], "render.budget_ms"),
        (&["--effect", "object.fog=off", "--set", "render.effects={ 'object.fog' = 'on' }"], "object.fog"),
    ] {
        let said = format!("{key}` has two values\nhint: leave one of both out");
        place.expect(2, &[&["render", "s.toml", "-o", "b.png"], options].concat(), &said);
    }
    // A scene that is made of a file keeps the size, too.
    place.write("a.xyz", "0 0 0\n1 0 0\n0 1 0\n0 0 1\n");
    let made = ["render", "a.xyz", "-o", "c.png", "--json", "--size", "20x10", "--set", placed];
    assert_eq!(json_of(&place.expect(0, &made, ""))["size"], serde_json::json!([20, 10]));
}

#[test]
fn exit_0_the_default_output_is_the_scenes_name() {
    let place = place();
    place.expect(0, &["render", "s.toml"], "");
    assert_eq!(place.made(), ["s.png"]);
    // What PNG does not hold is asked for.
    place.expect(0, &["render", "s.toml", "--layers", "depth"], "");
    assert_eq!(place.made(), ["s.exr", "s.png"]);
}

#[test]
fn exit_0_a_background_is_the_colour_that_is_named_and_a_jpeg_is_near() {
    let place = place();
    let clear = ["render", "s.toml", "--set", "object.0.visible=false", "--background"];
    for (name, expected) in [("white", [255; 3]), ("#336699", [0x33, 0x66, 0x99]), ("#fa0", [0xff, 0xaa, 0])] {
        place.expect(0, &[&clear[..], &[name, "-o", "b.png", "-o", "b.jpg", "--force"]].concat(), "");
        let [exact, near] = ["b.png", "b.jpg"].map(|file| image::open(place.path(file)).unwrap().to_rgb8());
        assert!(exact.pixels().all(|pixel| pixel.0 == expected), "{name}: {:?}", exact.get_pixel(0, 0));
        assert!(near.as_raw().iter().zip(exact.as_raw()).all(|(a, b)| a.abs_diff(*b) <= 3), "{name}");
    }
}

#[test]
fn exit_0_explain_info_schema_print_documents() {
    let place = place();
    let explained = json_of(&place.expect(0, &["explain", "s.toml", "--json"], ""));
    assert!(explained["plan"]["effects"].as_array().is_some_and(|e| !e.is_empty()));
    let info = json_of(&place.expect(0, &["info", "s.toml", "--json"], ""));
    assert_eq!(info["objects"][0]["name"], "fog");
    for shell in ["bash", "zsh", "fish"] {
        let script = place.expect(0, &["completions", shell], "");
        let script = String::from_utf8_lossy(&script.stdout).into_owned();
        assert!(script.contains("organza") && script.contains("color-by"), "{shell}: {script}");
    }
    let schema = json_of(&place.expect(0, &["schema"], ""));
    assert_eq!(schema["title"], "Organza scene");
    assert_eq!(schema["$defs"]["Light"]["oneOf"].as_array().map(Vec::len), Some(6));
    place.expect(0, &["--help"], "");
    assert!(place.made().is_empty());
}

#[test]
fn exit_2_is_for_the_command_line() {
    let place = place();
    for (arguments, stderr) in [
        (vec!["rendr"], "unrecognized subcommand"),
        (vec!["render", "s.toml", "-o", "a.bmp"], "expected a name that ends in .exr, .png, .jpg or .webp"),
        (vec!["render", "s.toml", "-o", "a.gif"], "a film has frames, and one picture is asked for"),
        (
            vec!["render", "s.toml", "-o", "a.mp4", "-o", "a.png", "--turntable", "2", "--transparent"],
            "a film has no opacity",
        ),
        (vec!["render", "s.toml", "--fps", "30"], "--fps is for films, and no output is one"),
        (vec!["render", "s.toml", "--material", "wax"], "--material is for data files, and a scene is given"),
        (vec!["render", "s.toml", "-o", "a.jpg", "--transparent"], "--transparent is for PNG, EXR and WebP files"),
        (vec!["render", "s.toml", "-o", "a.jpg", "--layers", "depth"], "--layers is for EXR files"),
        (vec!["render", "s.toml", "--background", "mauve"], "expected #rrggbb or one of black, white"),
        (vec!["render", "s.toml", "--background", "#12345g"], "expected #rrggbb or one of black, white"),
        (vec!["render", "s.toml", "-o", "a.exr", "-o", "a.exr"], "named twice"),
        (vec!["render", "s.toml", "--set", "render.sed=1"], "--set render.sed=1: unknown key `sed`"),
        (vec!["render", "s.toml", "--size", "0x9"], "--size 0x9: `size`: expected 1 to 65536 pixels a side, found 0"),
        (vec!["render", "s.toml", "--size", "-1x9"], "unexpected argument"),
        (vec!["render", "s.toml", "--size=-1x9"], "expected a whole number"),
        (vec!["render", "s.toml", "--size", "2147483648x9"], "65536"),
        (vec!["render", "s.toml", "--size", "1000000x1000000"], "65536"),
        (vec!["render", "s.toml", "--size", "9"], "expected WIDTHxHEIGHT"),
        (vec!["render", "s.toml", "--threads", "10000"], "10000 is not in 0..=1024"),
        (vec!["render", "s.toml", "--threads", "-1"], "unexpected argument"),
        (vec!["render", "s.toml", "--seed", "1.5"], "invalid value"),
        (vec!["render", "s.toml", "--tolerance", "nan"], "expected a finite number"),
        (vec!["render", "s.toml", "--tolerance", "-1"], "--tolerance -1: `tolerance`: expected a number above 0"),
        (vec!["render", "s.toml", "--exposure", "1e9"], "`exposure`: expected a number from -60 to 60"),
        (vec!["render", "s.toml", "--layers", "depth,norml"], "there is no layer `norml`"),
        (
            vec!["render", "s.toml", "--layers", "refraction"],
            "the layer `refraction` is of light that surfaces mirror and bend, and none does",
        ),
        (vec!["render", "s.toml", "--layers", "effects,reflection"], "the layer `reflection` is of light"),
        (
            vec!["render", "s.toml", "-o", "a.png", "--layers", "depth"],
            "--layers is for EXR files, and no output is one",
        ),
        (vec!["render", "s.toml", "-o", "a.png", "--half"], "--half is for EXR files, and no output is one"),
        (vec!["render", "s.toml", "--cache-size", "1G"], "--cache <DIR>"),
        (vec!["render", "s.toml", "--merge-duplicates"], "--merge-duplicates is for `points`"),
        (vec!["convert", "s.toml", "-o", "a.ply", "--layers", "depth"], "--layers is for pictures"),
        (vec!["orders", "s.toml", "--technique", "points"], "--technique changes nothing that `organza orders` does"),
        (vec!["accuracy", "s.toml", "--layers", "depth"], "--layers changes nothing that `organza accuracy` does"),
        (
            vec![
                "render",
                "s.toml",
                "--set",
                "light.0={kind='directional', direction=[0, -1, 0], irradiance=[1, 1, 1]}",
                "--set",
                "render.shadow.mapping=polar",
            ],
            "directions around a place are for lights that have one, and light `0` is directional",
        ),
        (vec!["render", "s.toml", "--set", "camera.fov_y=1e99"], "expected degrees between 0 and 180, found 1e99"),
        (vec!["render", "s.toml", "--technique", "splats"], "found \"splats\""),
        (vec!["render", "s.toml", "--max-memory", "0"], "expected a number of bytes above 0"),
    ] {
        place.expect(2, &arguments, stderr);
    }
    assert!(place.made().is_empty());
}

#[test]
fn options_of_particles_are_warned_of_where_none_are_drawn() {
    let place = place();
    for (option, words) in [
        (&["--seed", "7"][..], "warning: --seed changes nothing: no object is drawn by the technique `particles`"),
        (&["--drop-invalid"], "warning: --drop-invalid changes nothing: no object is made of points"),
        (
            &["--set", "render.surfels.gap=0.5"],
            "note: render.surfels.gap has no part in this picture: nothing is drawn by the technique `surfels`",
        ),
    ] {
        place.expect(0, &[&["explain", "s.toml"], option].concat(), words);
        place.expect(0, &[&["render", "s.toml", "-o", "s.png", "--force"], option].concat(), words);
    }
    let contrary = ["render", "s.toml", "-o", "contrary.png", "--effect", "light.0=on", "--effect", "light.0=off"];
    place.expect(2, &contrary, "--effect light.0=on and --effect light.0=off: one of them can hold");
    let words = "warning: --repeat-level changes nothing: no object is drawn by the technique `particles`";
    place.expect(0, &["render", "s.toml", "-o", "a.exr", "--repeat-level", "4"], words);
    place.expect(0, &["explain", "s.toml", "--repeat-level", "4"], words);
    let particles = ["render", "s.toml", "-o", "b.exr", "--technique", "particles", "--repeat-level", "4"];
    assert!(!String::from_utf8_lossy(&place.expect(0, &particles, "").stderr).contains("changes nothing"));
}

#[test]
fn a_camera_that_has_nothing_to_see_names_the_object_whose_points_are_left_out() {
    let place = Place::new(
        "version = 1\ncamera = { auto = true, size = [8, 8] }\n[ambient]\ncolor = [1, 1, 1]\n\
         [[object]]\nname = 'cloud'\npoints = 'p.csv'\nkeep = { heat = [7, 9] }\n",
    );
    place.write("p.csv", "x,y,z,heat\n0,0,0,1\n1,0,0,2\n0,1,0,3\n");
    place.expect(
        3,
        &["render", "s.toml"],
        "placed by itself: object 'cloud' is left without points\nhint: widen its `keep`",
    );
}

#[test]
fn a_printed_command_can_be_copied_whatever_the_name_of_its_file() {
    let place = Place::new("");
    place.write("a b.xyz", "0 0 0\n1 0 0\n0 1 0\n");
    let out = place.expect(0, &["init", "a b.xyz", "-o", "it's new.toml"], "");
    let text = String::from_utf8_lossy(&out.stdout).into_owned();
    assert!(text.ends_with("draw it: organza render 'it'\\''s new.toml' -o picture.png\n"), "{text}");
}

#[test]
fn exit_3_is_for_the_scene_and_its_data() {
    let place = place();
    fs::write(place.path("bad.toml"), scene().replace("target", "taget")).unwrap();
    let out = place.expect(
        3,
        &["render", "bad.toml", "--json"],
        "error: bad.toml:4:1: unknown key `taget`\nhint: did you mean `target`?",
    );
    assert_eq!(json_of(&out)["error"]["exit_code"], 3);
    fs::write(place.path("empty.ply"), "").unwrap();
    let mesh = scene().replace(
        "medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = 0.25 }",
        "mesh = \"empty.ply\"",
    );
    fs::write(place.path("mesh.toml"), mesh).unwrap();
    place.expect(3, &["render", "mesh.toml"], "empty.ply");
    assert_eq!(place.made(), ["bad.toml", "empty.ply", "mesh.toml"]);
}

#[test]
fn exit_4_bi1_bi31_refused_outputs_are_refused_before_any_work() {
    let place = place();
    place.expect(4, &["render", "missing.toml"], "missing.toml: cannot read the scene");
    fs::create_dir(place.path("folder.exr")).unwrap();
    fs::write(place.path("old.exr"), "old").unwrap();
    // The memory limit would be the next error: a refusal that names the output came before the work.
    for (output, force, stderr) in [
        ("old.exr", false, "old.exr: this file exists already"),
        ("folder.exr", true, "folder.exr: this is a folder"),
        ("nowhere/a.exr", true, "nowhere/a.exr: cannot write here"),
    ] {
        let mut arguments = vec!["render", "s.toml", "--max-memory", "1", "-o", output];
        arguments.extend(force.then_some("--force"));
        place.expect(4, &arguments, stderr);
    }
    place.expect(4, &["render", "s.toml", "-o", "a.exr", "--cost", "old.exr"], "old.exr: this file exists already");
    assert_eq!(fs::read(place.path("old.exr")).unwrap(), b"old");
    place.expect(0, &["render", "s.toml", "-o", "old.exr", "--force"], "");
    assert_ne!(fs::read(place.path("old.exr")).unwrap(), b"old");
    assert_eq!(place.made(), ["folder.exr", "old.exr"]);
}

#[cfg(unix)]
#[test]
fn bi31_an_output_that_is_an_input_is_refused_even_with_force() {
    let place = place();
    std::os::unix::fs::symlink("s.toml", place.path("link.png")).unwrap();
    place.expect(4, &["render", "s.toml", "-o", "link.png", "--force"], "this output is also an input");
    assert_eq!(fs::read_to_string(place.path("s.toml")).unwrap(), scene());
}

#[cfg(unix)]
#[test]
fn outputs_that_are_links_to_devices_or_one_file_twice_are_refused_before_any_work() {
    let place = place();
    let link = |to: &str, name: &str| std::os::unix::fs::symlink(to, place.path(name)).unwrap();
    Command::new("mkfifo").arg(place.path("pipe")).status().unwrap();
    link("pipe", "x.png");
    link("nothing", "y.png");
    link(".", "here");
    // The memory limit would be the next error.
    let refused = |more: &[&str], stderr: &str| {
        place.expect(4, &[&["render", "s.toml", "--max-memory", "100K", "--force"], more].concat(), stderr);
    };
    refused(&["-o", "x.png"], "x.png: this is a device, a pipe or a socket");
    refused(&["-o", "y.png"], "y.png: this link points to nothing");
    refused(&["--cost", "/dev/null"], "/dev/null: this is a device, a pipe or a socket");
    refused(&["--cost", "-"], "-: standard output is not a file");
    refused(&["-o", "a.png", "-o", "./a.png"], "./a.png: this output is named twice");
    refused(&["-o", "a.png", "--cost", "here/a.png"], "here/a.png: this output is named twice");
    refused(&["--cost", "c", "--checkpoint", "./c"], "./c: this output is named twice");
    refused(&["-o", "a.png", "--cost", "here/s.toml"], "here/s.toml: this output is also an input");
    for command in ["accuracy", "orders"] {
        link("pipe", &format!("{command}.json"));
        let message = format!("{command}.json: this is a device, a pipe or a socket");
        place.expect(4, &[command, "s.toml", "--max-memory", "100K", "--force"], &message);
    }
    assert_eq!(place.made(), ["accuracy.json", "here", "orders.json", "pipe", "x.png", "y.png"]);
}

#[cfg(target_os = "linux")]
#[test]
fn bi31_a_folder_that_cannot_be_written_is_refused() {
    // /proc takes no files, from root either.
    place().expect(4, &["render", "s.toml", "--max-memory", "100K", "-o", "/proc/a.exr"], "cannot write here");
}

#[test]
fn exit_5_bi26_limits_are_checked_before_the_work() {
    let place = place();
    place.expect(5, &["render", "s.toml", "--max-memory", "10K"], "the limit is 10240");
    place.expect(5, &["render", "s.toml", "--max-memory", "1G", "--size", "65536x65536"], "the limit is 1073741824");
    // 2 x 2 samples a pixel.
    place.expect(5, &["render", "s.toml", "--size", "40000x1"], "needs 80000 samples, the limit is 65535");
    assert!(place.made().is_empty());
}

#[test]
fn exit_6_is_for_the_gpu() {
    let place = place();
    place.expect(2, &["render", "s.toml", "--device-composites"], "--device-composites is for a GPU");
    for backend in ["ash", "wgpu", "auto"] {
        let missing = ["render", "s.toml", "--backend", backend, "--device", "no such device"];
        place.expect(6, &missing, &format!("error: --backend {backend}: "));
        let elsewhere = format!("--backend {backend} is for `organza render`");
        place.expect(2, &["explain", "s.toml", "--backend", backend], &elsewhere);
    }
    place.expect(2, &["render", "s.toml", "--device", "x"], "--device names a GPU, and the processor was asked for");
    assert!(place.made().is_empty());
}

#[test]
fn exit_6_a_passport_of_no_such_device() {
    place().expect(6, &["passport", "--device", "no such device"], "--device no such device: there is no such device");
}

#[test]
fn exit_0_any_gpu_there_is_or_none_gives_the_processor_s_picture() {
    let place = place();
    let points = ["render", "s.toml", "--technique", "points"];
    place.expect(0, &[&points[..], &["-o", "cpu.png"]].concat(), "");
    let out = place.expect(0, &[&points[..], &["--backend", "auto", "-o", "auto.png", "--json"]].concat(), "");
    let bytes = |name: &str| fs::read(place.path(name)).unwrap();
    assert_eq!(bytes("cpu.png"), bytes("auto.png"));
    // Nobody is left in doubt who drew.
    let document = json_of(&out);
    let alone = document["backend"] == "cpu";
    assert_eq!(alone, String::from_utf8_lossy(&out.stderr).contains("warning: no GPU helps"));
    assert_eq!(alone, document["warnings"][0].as_str().is_some_and(|w| w.ends_with("the processor draws alone")));
}

#[cfg(unix)]
#[test]
fn exit_130_an_interrupted_render_leaves_nothing() {
    let place = place();
    let fog = scene().replace("spacing = 0.25", "spacing = 0.02");
    fs::write(place.path("s.toml"), fog).unwrap();
    let arguments = ["render", "s.toml", "--size", "1000x1000", "-o", "a.exr"];
    // Earlier than its handler an interrupt kills; later than the render it comes too late. Somewhere between it is 130.
    for wait in [100, 200, 50, 400, 25, 800, 1600] {
        let mut command = organza();
        command.args(arguments).current_dir(place.folder()).stdout(Stdio::null()).stderr(Stdio::null());
        let mut child = command.spawn().unwrap();
        std::thread::sleep(std::time::Duration::from_millis(wait));
        // The first interrupt stops the work at its next tick, the second at once.
        while child.try_wait().unwrap().is_none() {
            Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
            std::thread::sleep(std::time::Duration::from_millis(1000));
        }
        if child.wait().unwrap().code() == Some(130) {
            assert!(place.made().is_empty(), "{:?}", place.made());
            return;
        }
        let _ = fs::remove_file(place.path("a.exr"));
    }
    panic!("no interrupt fell into the render");
}

#[cfg(unix)]
#[test]
fn bi33_a_closed_pipe_is_no_panic() {
    let place = place();
    for arguments in [vec!["schema"], vec!["--help"], vec!["info", "s.toml"], vec!["explain", "s.toml", "--json"]] {
        let mut child = organza()
            .args(&arguments)
            .current_dir(place.folder())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let out = child.wait_with_output().unwrap();
        assert_eq!(out.status.code(), Some(0), "{arguments:?}");
        let said = String::from_utf8_lossy(&out.stderr);
        assert!(said.lines().all(|line| line.starts_with("note: ")), "{arguments:?}: {said}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn bi34_odd_names_work_and_are_escaped() {
    use std::os::unix::ffi::OsStrExt;
    let place = place();
    let scene = place.folder().join(std::ffi::OsStr::from_bytes(b"s\xff\n\x1b[2J.toml"));
    let picture = place.folder().join(std::ffi::OsStr::from_bytes(b"p\xfe.exr"));
    fs::copy(place.path("s.toml"), &scene).unwrap();
    let render =
        || organza().arg("render").arg(&scene).arg("-o").arg(&picture).current_dir(place.folder()).output().unwrap();
    assert_eq!(render().status.code(), Some(0));
    assert!(picture.is_file());
    let second = render();
    assert_eq!(second.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&second.stderr).contains("p\\xfe.exr: this file exists already"));
    fs::write(&scene, "version = 2").unwrap();
    fs::remove_file(&picture).unwrap();
    let text = render().stderr;
    assert!(
        String::from_utf8_lossy(&text).contains("s\\xff\\n\\u{1b}[2J.toml:1:"),
        "{}",
        String::from_utf8_lossy(&text)
    );
    // A path too long for the system is an error of the file system.
    let long = format!("{}.exr", "n".repeat(4096));
    place.expect(4, &["render", "s.toml", "-o", &long], "cannot write here");
}

#[test]
fn bi30_threads_0_takes_all_cores_and_the_bytes_do_not_depend_on_it() {
    let place = place();
    for threads in ["0", "1", "3"] {
        place.expect(0, &["render", "s.toml", "--threads", threads, "-o", &format!("{threads}.exr")], "");
    }
    let bytes = |name: &str| fs::read(place.path(name)).unwrap();
    assert_eq!(bytes("0.exr"), bytes("1.exr"));
    assert_eq!(bytes("1.exr"), bytes("3.exr"));
}

/// The longest run of one character.
fn longest_run(text: &str) -> usize {
    let mut longest = 0;
    let mut run = 0;
    let mut last = '\0';
    for c in text.chars() {
        run = if c == last { run + 1 } else { 1 };
        (longest, last) = (longest.max(run), c);
    }
    longest
}

/// Runs and asserts that an error repeats 200 characters at most of what it was given.
fn expect_no_flood(place: &Place, arguments: &[&str], what: &str) {
    let out = place.run(arguments);
    let code = out.status.code();
    let said = [&out.stderr, &out.stdout].map(|bytes| String::from_utf8_lossy(bytes).into_owned());
    assert!(matches!(code, Some(2..=6)), "{what}: {code:?} {}", &said[0][..said[0].len().min(500)]);
    for text in said {
        let run = longest_run(&text);
        assert!(run <= 200, "{what}: repeats {run} characters");
        assert!(text.len() < 4000, "{what}: {} bytes", text.len());
        assert!(!text.contains('\u{1b}'), "{what}: steers the terminal");
    }
}

#[test]
fn messages_repeat_200_characters_at_most_of_a_scene() {
    let place = place();
    let long = format!("\u{1b}[2J{}", "q".repeat(1 << 20)).replace('\u{1b}', "\\u001b");
    let word = "q".repeat(1 << 20);
    let digits = "7".repeat(1 << 20);
    let fog = "medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 0.5, spacing = 0.25 }";
    let object = |source: String| scene().replace(fog, &source);
    let ball = "box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.2 }";
    for (what, text) in [
        ("a key", format!("{word} = 1\n{}", scene())),
        ("a key in quotes", format!("\"{long}\" = 1\n{}", scene())),
        ("a key twice", format!("{word} = 1\n{word} = 1\n{}", scene())),
        ("a name", scene().replace("\"fog\"", &format!("\"{long}\""))),
        ("a name twice", format!("{0}{0}", FOG.replace("fog", &"q".repeat(250))) + SMALL_SCENE),
        ("a source", object(format!("\"{long}\" = 1"))),
        ("a material", object(format!("{fog}\nmaterial = \"{long}\""))),
        ("a path", object(format!("mesh = \"{long}\""))),
        ("a path outside", object(format!("mesh = \"/{long}\""))),
        ("an address", object(format!("mesh = \"http://{long}\""))),
        ("an expression", object(format!("implicit = {{ expression = \"{long}\", {ball}"))),
        ("a word in an expression", object(format!("implicit = {{ expression = \"{}\", {ball}", "q".repeat(4000)))),
        (
            "a number in an expression",
            object(format!("implicit = {{ expression = \"x+.{}.7\", {ball}", "7".repeat(3000))),
        ),
        ("a value", format!("{}[render]\nseed = \"{long}\"\n", scene())),
        ("a choice", format!("{}[render]\ntechnique = \"{long}\"\n", scene())),
        ("a layer", format!("{}[render]\nlayers = [\"{long}\"]\n", scene())),
        ("a whole number", format!("{}[render]\nseed = {digits}\n", scene())),
        ("a number", format!("{}[render]\ntolerance = {digits}.5e{digits}\n", scene())),
        ("no TOML", format!("{}[render]\ntolerance = {word}\n", scene())),
        ("a track", format!("{}[animation]\nframes = 1\n[[animation.track]]\nset = \"{long}\"\n", scene())),
    ] {
        place.write("flood.toml", text);
        expect_no_flood(&place, &["render", "flood.toml", "--frames", "--json"], what);
        expect_no_flood(&place, &["explain", "flood.toml"], what);
    }
    for (what, text) in [
        ("a key in JSON", format!("{{\"{long}\": 1}}")),
        ("a key twice in JSON", format!("{{\"{long}\": 1, \"{long}\": 1}}")),
        ("a number in JSON", format!("{{\"version\": {digits}}}")),
        ("a word in JSON", format!("{{\"version\": {word}}}")),
    ] {
        place.write("flood.json", text);
        expect_no_flood(&place, &["render", "flood.json", "--json"], what);
    }
}

#[test]
fn messages_repeat_200_characters_at_most_of_the_command_line() {
    let place = place();
    // Linux passes arguments of up to 128 KiB.
    let long = format!("\u{1b}[2J{}", "q".repeat(100_000));
    let with = |option: &str, value: String| vec!["render".into(), "s.toml".into(), option.into(), value];
    for arguments in [
        vec![long.clone()],
        vec![format!("--{long}")],
        vec!["render".into(), long.clone()],
        vec!["info".into(), long.clone()],
        with("--set", long.clone()),
        with("--set", format!("{long}=1")),
        with("--set", format!("render.{long}=1")),
        with("--set", format!("object.{long}.visible=true")),
        with("--set", format!("render.seed={long}")),
        with("--set", format!("render.seed=\"{}\"", "q".repeat(100_000))),
        with("--set", format!("render.seed={}", "7".repeat(100_000))),
        with("--technique", long.clone()),
        with("--layers", format!("depth,{long}")),
        with("--size", long.clone()),
        with("--threads", long.clone()),
        with("--max-memory", long.clone()),
        with("--backend", long.clone()),
        with("--tolerance", format!("0.{}x", "7".repeat(100_000))),
        with("-o", long.clone()),
        with("-o", format!("{long}.exr")),
        with("--cost", long.clone()),
        with("--checkpoint", long.clone()),
        vec!["render".into(), "s.toml".into(), format!("--size={long}")],
        vec!["render".into(), "s.toml".into(), "--backend".into(), "wgpu".into(), "--device".into(), long.clone()],
        vec!["passport".into(), "--device".into(), long.clone()],
        vec!["accuracy".into(), "s.toml".into(), "--out".into(), long.clone()],
    ] {
        let what: Vec<String> = arguments.iter().map(|a| a.chars().take(30).collect()).collect();
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        expect_no_flood(&place, &arguments, &what.join(" "));
    }
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn passport_names_every_device_and_conforms_or_is_exit_6() {
        let place = place();
        let devices = json_of(&place.expect(0, &["devices", "--json"], ""));
        let out = place.run(&["passport", "--json"]);
        let passports = json_of(&out)["passports"].as_array().unwrap().clone();
        let names = |list: &[Value]| list.iter().map(|d| [d["backend"].clone(), d["name"].clone()]).collect::<Vec<_>>();
        assert_eq!(names(&passports), names(devices["devices"].as_array().unwrap()));
        let valid = passports.iter().all(|p| p["valid"] == true);
        assert_eq!(out.status.code(), Some(if valid { 0 } else { 6 }));
        for passport in &passports {
            let recordings = passport["recordings"].as_array().unwrap();
            let names: Vec<_> = recordings.iter().map(|r| r["recording"].as_str().unwrap()).collect();
            let shadows = ["shadow lists", "shadow"];
            let splats = ["project", "shade", "composite", "opaque", "chain"];
            let particles = ["particles", "made particles", "lit particles"];
            let stages = [&["order"][..], &shadows, &splats, &particles].concat();
            assert_eq!(names, stages);
        }
    }
}

#[test]
fn exit_0_a_webp_file_has_the_bytes_of_the_png_and_its_opacity() {
    let place = place();
    for transparent in [&[][..], &["--transparent"]] {
        place.expect(0, &[&["render", "s.toml", "-o", "b.png", "-o", "b.webp", "--force"], transparent].concat(), "");
        let [exact, found] = ["b.png", "b.webp"].map(|file| image::open(place.path(file)).unwrap());
        assert_eq!(exact.to_rgba8(), found.to_rgba8());
        assert_eq!(exact.color().has_alpha(), !transparent.is_empty());
    }
}

#[test]
fn exit_0_manual_pages_name_the_options() {
    let place = place();
    let text =
        |arguments: &[&str]| String::from_utf8(place.expect(0, &[&["man"], arguments].concat(), "").stdout).unwrap();
    assert!(text(&[]).contains("organza"));
    assert!(text(&["render"]).contains("max\\-rmse"));
    place.expect(2, &["man", "rendr"], "man: there is no command rendr");
}

#[test]
fn exit_0_quiet_says_nothing_and_verbose_names_stages() {
    let place = place();
    let out = place.expect(0, &["render", "s.toml", "-o", "a.png", "-q"], "");
    assert!(out.stdout.is_empty() && out.stderr.is_empty(), "{out:?}");
    let out = place.expect(0, &["-v", "render", "s.toml", "-o", "b.png"], "");
    assert!(String::from_utf8_lossy(&out.stderr).contains(" s, "), "{out:?}");
    place.expect(2, &["render", "s.toml", "-q", "-v"], "cannot be used with");
}

#[test]
fn a_set_without_a_value_takes_away_what_is_there() {
    let place = place();
    place.expect(0, &["render", "s.toml", "-o", "a.png", "--set", "object.fog="], "");
    place.expect(0, &["render", "s.toml", "-o", "b.png", "--set", "object.fog.visible=false"], "");
    let [gone, hidden] = ["a.png", "b.png"].map(|file| image::open(place.path(file)).unwrap().to_rgb8());
    assert_eq!(gone, hidden);
    place.expect(2, &["render", "s.toml", "--set", "object.fog.nam="], "there is no `nam` to take away");
    place.expect(3, &["render", "s.toml", "--set", "camera.size="], "expected a key `size` here, found none");
}

/// A program of the name `ffmpeg` in a folder that is the whole search path.
#[cfg(unix)]
fn with_ffmpeg(place: &Place, script: Option<&str>, arguments: &[&str]) -> Output {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    if let Some(script) = script {
        let program = folder.path().join("ffmpeg");
        fs::write(&program, format!("#!/bin/sh\nPATH=/usr/bin:/bin\n[ \"$1\" = -version ] && exit 0\n{script}\n"))
            .unwrap();
        fs::set_permissions(&program, fs::Permissions::from_mode(0o755)).unwrap();
    }
    let run = organza().args(arguments).current_dir(place.path(".")).env("PATH", folder.path()).output();
    run.unwrap()
}

#[cfg(unix)]
#[test]
fn a_film_gets_the_pixels_of_all_frames_and_appears_whole_or_not_at_all() {
    let place = place();
    let film = ["render", "s.toml", "-o", "a.mp4", "--turntable", "3"];
    // The last argument is the file; what comes through the pipe is kept.
    let keeps = "for file; do :; done; cat > \"$file\"";
    let out = with_ffmpeg(&place, Some(keeps), &film);
    assert!(out.status.success(), "{out:?}");
    assert!(String::from_utf8_lossy(&out.stdout).contains("wrote a.mp4 (3 frames, 3456 bytes)"), "{out:?}");
    place.expect(0, &["render", "s.toml", "-o", "p.png", "--turntable", "3"], "");
    let frames =
        [0, 1, 2].map(|frame| image::open(place.path(&format!("p.000{frame}.png"))).unwrap().to_rgb8().into_raw());
    assert_eq!(fs::read(place.path("a.mp4")).unwrap(), frames.concat());
    assert_eq!(place.made(), ["a.mp4", "p.0000.png", "p.0001.png", "p.0002.png"]);
    let failing = ["render", "s.toml", "-o", "b.mp4", "--turntable", "3"];
    let cases = [
        (Some("echo no such codec >&2; exit 1"), "b.mp4: ffmpeg failed: no such codec"),
        (Some("cat > /dev/null; echo disk full >&2; exit 1"), "b.mp4: ffmpeg failed: disk full"),
        (None, "b.mp4: a film is written by the program ffmpeg, which is not on the PATH"),
    ];
    for (script, words) in cases {
        let out = with_ffmpeg(&place, script, &failing);
        assert_eq!(out.status.code(), Some(2), "{out:?}");
        assert!(String::from_utf8_lossy(&out.stderr).contains(words), "{out:?}");
        assert!(!place.path("b.mp4").exists());
    }
}
