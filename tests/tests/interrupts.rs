//! Renders by particles that stop in the middle: checkpoints, the picture at an interrupt, and the same bits at the end.

use organza_tests::{Place, SMALL_SCENE, organza};
use std::fs;
use std::process::{Child, Command, Stdio};
use std::time::Duration;

const OBJECTS: &str = r#"[[object]]
name = "fog"
medium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.5, spacing = 0.25 }
[[object]]
name = "sheet"
mesh = "sheet.ply"
material = "thin"
[material.thin]
opacity = 0.5
color = [0.9, 0.4, 0.1]
[render]
technique = "particles"
antialias = 1
layers = ["std_error", "shadow"]
"#;

const SHEET: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
                     element face 1\nproperty list uchar int vertex_indices\nend_header\n-1 -1 0.2\n1 -1 0\n0 1 0.4\n\
                     3 0 1 2\n";

fn place() -> Place {
    let place = Place::new(&format!("{SMALL_SCENE}{OBJECTS}").replace("[24, 16]", "[96, 64]"));
    place.write("sheet.ply", SHEET);
    place
}

/// `organza render` of the scene with more arguments.
fn render<'a>(arguments: &[&'a str]) -> Vec<&'a str> {
    [&["render", "s.toml", "--force"], arguments].concat()
}

fn spawn(place: &Place, arguments: &[&str]) -> Child {
    let mut command = organza();
    command.args(render(arguments)).current_dir(place.folder());
    command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap()
}

/// Waits until the file is there, or the command has ended.
fn wait_for(place: &Place, name: &str, child: &mut Child) {
    while !place.path(name).exists() && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(20));
    }
}

#[test]
fn a_checkpoint_goes_on_to_more_sets_in_the_same_bits() {
    let place = place();
    place.expect(0, &render(&["-o", "whole.exr", "--repeat-level", "60"]), "");
    place.expect(0, &render(&["-o", "part.exr", "--repeat-level", "17", "--checkpoint", "sums"]), "");
    // Neither the path of the scene nor the displayed picture belongs to the sums.
    place.expect(0, &render(&["-o", "part.exr", "--repeat-level", "60", "--checkpoint", "sums", "--threads", "3"]), "");
    let without_hash = |bytes: Vec<u8>| {
        let at = bytes.windows(20).position(|w| w == b"organza:scene_sha256").unwrap();
        [&bytes[..at], &bytes[at + 100..]].concat()
    };
    assert_eq!(without_hash(place.bytes("whole.exr")), without_hash(place.bytes("part.exr")));
    // More sets than are asked for are not thrown away.
    let json = place.run(&render(&["-o", "part.exr", "--repeat-level", "20", "--checkpoint", "sums", "--json"]));
    let document: serde_json::Value = serde_json::from_slice(&json.stdout).unwrap();
    assert_eq!(document["sets"], serde_json::json!({ "averaged": 60, "asked": 20, "interrupted": false }));
}

#[test]
fn a_killed_render_resumes_to_the_same_bits() {
    let place = place();
    let arguments = ["-o", "a.exr", "--repeat-level", "600", "--checkpoint", "sums"];
    place.expect(0, &render(&arguments), "");
    let whole = place.bytes("a.exr");
    fs::remove_file(place.path("sums")).unwrap();
    for more in [0, 150] {
        let mut child = spawn(&place, &arguments);
        wait_for(&place, "sums", &mut child);
        std::thread::sleep(Duration::from_millis(more));
        child.kill().unwrap();
        child.wait().unwrap();
    }
    place.expect(0, &render(&arguments), "");
    assert_eq!(place.bytes("a.exr"), whole);
}

#[cfg(unix)]
#[test]
fn an_interrupt_leaves_the_picture_so_far_and_a_checkpoint() {
    let place = place();
    let many = ["-o", "a.exr", "--repeat-level", "1000000", "--checkpoint", "sums", "--json"];
    let mut child = spawn(&place, &many);
    wait_for(&place, "sums", &mut child);
    // Twice at once, as by a program that passes on what the terminal has sent already.
    let number = child.id().to_string();
    Command::new("sh").args(["-c", &format!("kill -INT {number}; kill -INT {number}")]).status().unwrap();
    let out = child.wait_with_output().unwrap();
    assert_eq!(out.status.code(), Some(130));
    let document: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(document["sets"]["interrupted"], true);
    let averaged = document["sets"]["averaged"].as_u64().unwrap();
    assert!((2..1_000_000).contains(&averaged));
    assert!(String::from_utf8_lossy(&out.stderr).contains(&format!("average of {averaged} of 1000000 sets")));
    // It is the picture of so many sets.
    let level = averaged.to_string();
    place.expect(0, &render(&["-o", "b.exr", "--repeat-level", &level, "--checkpoint", "sums"]), "");
    let pixels = |name: &str| {
        let image = exr::prelude::read_first_rgba_layer_from_file(
            place.path(name),
            |size, _| vec![[0.0f32; 4]; size.area()],
            |pixels: &mut Vec<[f32; 4]>, at, rgba: (f32, f32, f32, f32)| {
                pixels[at.y() * 96 + at.x()] = [rgba.0, rgba.1, rgba.2, rgba.3];
            },
        );
        image.unwrap().layer_data.channel_data.pixels
    };
    assert_eq!(pixels("a.exr"), pixels("b.exr"));
}

#[test]
fn a_made_up_checkpoint_of_another_image_is_refused() {
    let place = place();
    let small = ["-o", "a.exr", "--repeat-level", "2", "--checkpoint", "sums"];
    place.expect(0, &render(&small), "");
    let mut bytes = place.bytes("sums");
    // The width of the image, behind the tag; its tiles are as many as before.
    bytes[40] += 1;
    let end = bytes.len() - 4;
    let mut sum = flate2::Crc::new();
    sum.update(&bytes[..end]);
    bytes[end..].copy_from_slice(&sum.sum().to_le_bytes());
    place.write("sums", &bytes);
    place.expect(3, &render(&small), "of an image of another size or other channels");
    assert_eq!(place.bytes("sums"), bytes, "a file that is refused is not touched");
}

#[test]
fn a_checkpoint_of_something_else_is_refused() {
    let place = place();
    let small = ["-o", "a.exr", "--repeat-level", "2", "--checkpoint", "sums"];
    place.expect(0, &render(&small), "");
    let kept = place.bytes("sums");
    let with = |more: &[&'static str]| render(&[&small[..], more].concat());
    place.expect(3, &with(&["--seed", "7"]), "sums: ");
    place.expect(3, &with(&["--size", "8x8"]), "of another scene or other parameters");
    place.expect(3, &with(&["--set", "object.fog.visible=false"]), "hint: name another --checkpoint");
    place.write("sheet.ply", SHEET.replace("0.4", "0.5"));
    place.expect(3, &render(&small), "of another scene or other parameters");
    place.write("sheet.ply", SHEET);
    place.expect(0, &render(&small), "");
    for (bytes, why) in [(&kept[..kept.len() - 9], "damaged"), (b"hello", "not a checkpoint"), (b"", "cut short")] {
        place.write("sums", bytes);
        place.expect(3, &render(&small), why);
        assert_eq!(place.bytes("sums"), bytes, "a file that is refused is not touched");
    }
    let points = ["--technique", "points", "--layers", "shadow", "--checkpoint", "c"];
    place.expect(2, &render(&points), "only the technique `particles`");
    place.expect(2, &render(&["-o", "a.exr", "--checkpoint", "a.exr"]), "named twice");
    place.expect(4, &render(&["-o", "a.exr", "--checkpoint", "s.toml"]), "also an input");
    place.expect(2, &render(&["-o", "a.exr", "--repeat-level", "1"]), "--repeat-level 1: ");
}

#[cfg(unix)]
#[test]
fn an_interrupt_where_nothing_asks_for_it_ends_within_two_seconds() {
    // A surface that is everywhere is looked for in a hundred million cells before the first tick.
    let ball = "[[object]]\nname = \"ball\"\nopacity = 0.5\nimplicit = { expression = \"sin(60*x)*sin(60*y)*sin(60*z)\", \
                box = [[-2, -2, -2], [2, 2, 2]], spacing = 0.006 }\n[render]\ntechnique = \"particles\"\n\
                particles = { surface_sampler = \"triangles\" }\n";
    let place = Place::new(&format!("{SMALL_SCENE}{ball}"));
    let mut child = spawn(&place, &["-o", "a.exr", "--max-memory", "100G"]);
    std::thread::sleep(Duration::from_millis(800));
    assert!(child.try_wait().unwrap().is_none(), "{child:?} has ended by itself");
    let start = std::time::Instant::now();
    Command::new("kill").args(["-INT", &child.id().to_string()]).status().unwrap();
    let out = child.wait_with_output().unwrap();
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(130), "{text}");
    assert!(text.contains("interrupted"), "{text}");
    assert!(start.elapsed() < Duration::from_millis(2500), "{:?}", start.elapsed());
    assert!(place.made().is_empty());
}
