//! Scenes of many inputs stay within `--max-memory` together: they draw on one account before anything is allocated.
#![cfg(target_os = "linux")]

use crate::memory::PROGRAM;
use organza_tests::{Place, SMALL_SCENE, organza, run_measured};
use std::fmt::Write as _;
use std::io::Write as _;

const MIB: u64 = 1 << 20;

/// A volume of so many voxels a side, packed a thousandfold: 4 bytes a voxel once it is read.
fn volume(side: usize, rank: u8) -> Vec<u8> {
    let mut packed = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    let head = format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: {side} {side} {side}\nencoding: raw\n\n");
    packed.write_all(head.as_bytes()).unwrap();
    packed.write_all(&vec![rank; side * side * side]).unwrap();
    packed.finish().unwrap()
}

/// A grey picture of so many pixels a side.
fn picture(side: u32, shade: u8) -> Vec<u8> {
    let mut out = std::io::Cursor::new(Vec::new());
    let image = image::GrayImage::from_fn(side, side, |x, y| image::Luma([if x + y < 9 { 255 } else { shade }]));
    image.write_to(&mut out, image::ImageFormat::Png).unwrap();
    out.into_inner()
}

/// How many there are of what.
#[derive(Debug, Clone, Copy, Default)]
struct Inputs {
    volumes: usize,
    /// Voxels of a volume along each side.
    side: usize,
    slides: usize,
    bumps: usize,
    textures: usize,
    points: usize,
}

/// A scene of them and their files.
fn place(inputs: Inputs) -> Place {
    let mut text = SMALL_SCENE.replace("position = [0, 0, 4]", "position = [0, 0, 400]");
    let place = Place::new("");
    for k in 0..inputs.volumes {
        place.write(&format!("v{k}.nrrd.gz"), volume(inputs.side, k as u8 + 1));
        let transfer = "transfer = [{ value = 0, color = [1, 1, 1], extinction = 0.1 }]";
        writeln!(text, "[[object]]\nname = \"v{k}\"\nvolume = \"v{k}.nrrd.gz\"\n{transfer}").unwrap();
    }
    for k in 0..inputs.slides {
        place.write(&format!("slide{k}.png"), picture(1024, k as u8));
        let spot =
            "[[light]]\nkind = \"spot\"\nposition = [0, 5, 0]\ntarget = [0, 0, 0]\nouter = 40\nintensity = [9, 9, 9]";
        writeln!(text, "{spot}\ntexture = \"slide{k}.png\"").unwrap();
    }
    for k in 0..inputs.bumps {
        place.write(&format!("bump{k}.png"), picture(1024, k as u8));
        writeln!(text, "[material.m{k}]\nbump = {{ image = \"bump{k}.png\", height = 0.1, size = 1 }}").unwrap();
    }
    let (mut mtl, mut obj) = (String::new(), "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n".to_owned());
    for k in 0..inputs.textures {
        place.write(&format!("t{k}.png"), picture(1024, k as u8));
        writeln!(mtl, "newmtl m{k}\nmap_Kd t{k}.png").unwrap();
        writeln!(obj, "usemtl m{k}\nf 1/1 2/1 3/1").unwrap();
    }
    place.write("a.mtl", mtl);
    place.write("a.obj", obj);
    if inputs.textures > 0 {
        text += "[[object]]\nname = \"painted\"\nmesh = \"a.obj\"\nspacing = 0.25\n";
    }
    for k in 0..inputs.points {
        let line = |i: usize| format!("{} {} {k}\n", i % 300, i / 300);
        place.write(&format!("p{k}.xyz"), (0..90_000).map(line).collect::<String>());
        writeln!(text, "[[object]]\nname = \"p{k}\"\npoints = \"p{k}.xyz\"").unwrap();
    }
    place.write("s.toml", text);
    place
}

/// Explains the scene within a limit; gives the exit code and the words.
#[track_caller]
fn explain(place: &Place, limit: u64) -> (i32, String) {
    let arguments = ["explain", "s.toml", "--max-memory", &limit.to_string(), "--threads", "1"];
    let (out, peak) = run_measured(organza().current_dir(place.folder()).args(arguments));
    let text = String::from_utf8_lossy(&out.stderr).into_owned();
    let code = out.status.code().unwrap_or_else(|| panic!("no exit code: {text}"));
    assert!(peak.resident <= limit + PROGRAM, "{} were resident of {limit}, exit code {code}: {text}", peak.resident);
    (code, text)
}

#[test]
fn inputs_of_every_kind_draw_on_one_account() {
    // Each alone is far below the limit of 48 MiB.
    for inputs in [
        Inputs { volumes: 12, side: 128, ..Inputs::default() },
        Inputs { slides: 12, ..Inputs::default() },
        Inputs { bumps: 20, ..Inputs::default() },
        Inputs { textures: 30, ..Inputs::default() },
        Inputs { volumes: 3, side: 128, slides: 2, bumps: 2, textures: 3, points: 2 },
    ] {
        let place = place(inputs);
        let (code, text) = explain(&place, 48 * MIB);
        assert_eq!(code, 5, "{inputs:?}: {text}");
        assert!(text.contains("--max-memory"), "{inputs:?}: {text}");
    }
    let (code, text) =
        explain(&place(Inputs { volumes: 1, side: 32, slides: 1, bumps: 1, textures: 1, points: 1 }), 2048 * MIB);
    assert_eq!(code, 0, "{text}");
}

#[test]
fn scenes_of_many_inputs_stay_within_any_limit() {
    // What `explain` says is enough, and less is refused with words or enough too.
    let place = place(Inputs { volumes: 2, side: 48, slides: 1, bumps: 1, textures: 2, points: 1 });
    let out = place.run(&["explain", "s.toml", "--json", "--threads", "1"]);
    let document: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
    let said = document["memory_bytes"].as_u64().unwrap();
    assert_eq!(explain(&place, said).0, 0, "{said}");
    for share in [3, 17, 50, 90] {
        let (code, text) = explain(&place, said / 100 * share);
        assert!(code == 0 || code == 5 && text.contains("--max-memory"), "{share} % of {said}: {code}, {text}");
    }
}

#[test]
fn an_image_that_many_lights_shine_through_is_counted_for_each() {
    let mut text = SMALL_SCENE.to_owned();
    for k in 0..12 {
        let spot = "[[light]]\nkind = \"spot\"\ntarget = [0, 0, 0]\nouter = 40\nintensity = [9, 9, 9]";
        writeln!(text, "{spot}\nposition = [{k}, 5, 0]\ntexture = \"slide.png\"").unwrap();
    }
    let place = Place::new(&text);
    place.write("slide.png", picture(1024, 7));
    assert_eq!(explain(&place, 64 * MIB).0, 5);
}

#[test]
fn the_text_of_a_scene_counts() {
    let place = Place::new(&format!("{SMALL_SCENE}# {}\n", "1".repeat(4 << 20)));
    assert_eq!(explain(&place, 8 * MIB).0, 5);
    assert_eq!(explain(&place, 1024 * MIB).0, 0);
}

#[test]
fn checkpoints_draw_on_the_account_and_pipes_in_their_place_are_refused() {
    let fog = "[[object]]\nname = \"fog\"\nmedium_box = { min = [-1, -1, -1], max = [1, 1, 1], extinction = 1.5, spacing = 0.5 }\n";
    let place = Place::new(&format!("{SMALL_SCENE}{fog}[render]\ntechnique = \"particles\"\nantialias = 1\n"));
    let large = std::fs::File::create(place.path("sums")).unwrap();
    large.set_len(1 << 30).unwrap();
    let arguments = ["render", "s.toml", "-o", "a.exr", "--force", "--checkpoint", "sums", "--max-memory", "200M"];
    let (out, peak) = run_measured(organza().current_dir(place.folder()).args(arguments));
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(5), "{text}");
    assert!(peak.resident < PROGRAM && text.contains("the checkpoint sums"), "{}: {text}", peak.resident);
}
