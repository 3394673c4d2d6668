//! Pictures of data files without a scene, the scenes that are written of them, and cameras that are placed by themselves.

use organza_tests::{Place, SMALL_SCENE, picture_of};
use serde_json::Value;
use std::fmt::Write;

/// A folder with a mesh, points, and a volume: a ball each, in three units and places.
fn data() -> Place {
    let place = Place::new("");
    place.write("mesh.obj", ball_mesh(1.0, 0.0));
    place.write("far.obj", ball_mesh(1.0, 1e7));
    place.write("scan.xyz", ball_points(40.0, ""));
    place.write("colored.xyz", ball_points(40.0, " 200 120 40"));
    place.write("head.nrrd", ball_volume(|distance| (200.0 - 25.0 * distance).max(0.0)));
    place
}

/// Rings of a ball about a place on the x axis.
fn ball_mesh(radius: f64, x: f64) -> String {
    let rings = 8;
    let around = 12;
    let mut text = String::new();
    for i in 0..=rings {
        for k in 0..around {
            let theta = std::f64::consts::PI * f64::from(i) / 8.0;
            let phi = std::f64::consts::TAU * f64::from(k) / 12.0;
            let p = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()].map(|c| radius * c);
            writeln!(text, "v {:.6} {:.6} {:.6}", x + p[0], p[1], p[2]).unwrap();
        }
    }
    for (i, k) in (0..rings).flat_map(|i| (0..around).map(move |k| (i, k))) {
        let v = |i: i32, k: i32| i * around + k % around + 1;
        writeln!(text, "f {} {} {}", v(i, k), v(i + 1, k + 1), v(i + 1, k)).unwrap();
        writeln!(text, "f {} {} {}", v(i, k), v(i, k + 1), v(i + 1, k + 1)).unwrap();
    }
    text
}

fn ball_points(radius: f64, color: &str) -> String {
    let mut text = String::from(if color.is_empty() { "x y z\n" } else { "x y z red green blue\n" });
    for i in 0..300 {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / 300.0;
        let angle = 2.399_963_229_728_653 * f64::from(i);
        let r = (1.0 - y * y).sqrt();
        writeln!(text, "{} {} {}{color}", radius * r * angle.cos(), radius * y, radius * r * angle.sin()).unwrap();
    }
    text
}

/// 16³ values by their distance from the middle.
fn ball_volume(value: impl Fn(f64) -> f64) -> String {
    let mut text = String::from(
        "NRRD0004\ntype: float\ndimension: 3\nsizes: 16 16 16\n\
         space directions: (0.1,0,0) (0,0.1,0) (0,0,0.1)\nspace origin: (0,0,0)\nencoding: ascii\n\n",
    );
    for i in 0..16 * 16 * 16 {
        let distance = [i % 16, i / 16 % 16, i / 256].map(|c| (f64::from(c) - 7.5).powi(2)).iter().sum::<f64>().sqrt();
        writeln!(text, "{}", value(distance)).unwrap();
    }
    text
}

const SIZE: [&str; 2] = ["--size", "60x40"];

#[test]
fn the_scene_that_init_writes_gives_the_bytes_that_render_gives_of_the_file() {
    let place = data();
    for (name, files, options) in [
        ("mesh", &["mesh.obj"][..], &[][..]),
        ("far", &["far.obj"], &["--ground"]),
        ("scan", &["scan.xyz"], &["--azimuth", "-70", "--elevation", "85"]),
        ("head", &["head.nrrd"], &["--preset", "inferno", "--fit", "0.6"]),
        ("all", &["mesh.obj", "mesh.obj", "colored.xyz", "head.nrrd"], &[]),
    ] {
        let scene = format!("{name}.toml");
        place.expect(0, &[&["init"], files, &SIZE, options, &["-o", &scene]].concat(), "");
        let outputs = |kind: &str| [format!("{name}-{kind}.exr"), format!("{name}-{kind}.png")];
        let [from_scene, from_file] = [outputs("scene"), outputs("file")];
        place.expect(0, &["render", &scene, "-o", &from_scene[0], "-o", &from_scene[1]], "");
        let of_file = [&["render"], files, &SIZE, options, &["-o", &from_file[0], "-o", &from_file[1]]].concat();
        place.expect(0, &of_file, "");
        for (a, b) in from_scene.iter().zip(&from_file) {
            assert!(place.bytes(a) == place.bytes(b), "{a} and {b}");
        }
    }
}

/// Rows and columns beside which nothing is seen, as shares of the picture.
fn reach(picture: &organza_tests::Picture) -> [f64; 2] {
    let alpha = picture.opacity();
    let width = picture.size[0] as usize;
    let height = picture.size[1] as usize;
    let seen = |i: &usize| alpha[*i] > 0.05;
    let from_middle = |at: usize, n: usize| ((at as f64 + 0.5) / n as f64 - 0.5).abs() * 2.0;
    (0..alpha.len()).filter(seen).fold([0.0; 2], |most: [f64; 2], i| {
        [most[0].max(from_middle(i % width, width)), most[1].max(from_middle(i / width, height))]
    })
}

#[test]
fn every_kind_of_data_is_seen_whole_large_in_the_middle_and_neither_black_nor_white() {
    let place = data();
    for file in ["mesh.obj", "far.obj", "scan.xyz", "colored.xyz", "head.nrrd"] {
        let out =
            place.expect(0, &[&["render", file, "-o", "a.exr", "-o", "a.png", "--force"], &SIZE[..]].concat(), "");
        assert!(!String::from_utf8_lossy(&out.stderr).contains("the picture is"), "{file}");
        let picture = picture_of(&place.path("a.exr"));
        let [x, y] = reach(&picture);
        let most = x.max(y);
        assert!((0.7..0.99).contains(&most), "{file}: {x} {y}");
        let green = picture.channel("G");
        let alpha = picture.opacity();
        let solid: Vec<f64> = green.iter().zip(&alpha).filter(|(_, a)| **a > 0.9).map(|(g, _)| *g).collect();
        assert!(solid.len() > 100, "{file}: {} solid pixels", solid.len());
        let mean = solid.iter().sum::<f64>() / solid.len() as f64;
        assert!((0.08..0.8).contains(&mean), "{file}: mean {mean}");
    }
}

#[test]
fn files_that_no_picture_can_be_made_of_are_refused_with_a_reason() {
    let place = data();
    place.write("empty.xyz", "x y z\n");
    place.write("nothing.ply", "");
    place.write("other.dat", "what is this");
    place.write("nan.xyz", "0 0 0\n1 0 nan\n0 1 0\n");
    place.write("old.png", "old");
    place.write("old.toml", "version = 1\n");
    std::fs::create_dir(place.path("folder")).unwrap();
    for (code, arguments, stderr) in [
        (4, &["render", "missing.ply", "-o", "a.png"][..], "missing.ply: cannot read: no such file"),
        (
            4,
            &["render", "folder", "-o", "a.png"],
            "folder: cannot read: expected a file, or a folder of slices, found an empty",
        ),
        (
            3,
            &["render", "other.dat", "-o", "a.png"],
            "other.dat@0: expected a file of a format that is read, found a text of a format that neither",
        ),
        (3, &["render", "nothing.ply", "-o", "a.png"], "nothing.ply@0: expected"),
        (3, &["render", "empty.xyz", "-o", "a.png"], "empty.xyz"),
        (3, &["render", "nan.xyz", "-o", "a.png"], "nan.xyz:"),
        (4, &["render", "mesh.obj", "-o", "old.png"], "old.png: this file exists already"),
        (
            4,
            &["init", "mesh.obj", "-o", "old.toml"],
            "old.toml: this file exists already\nhint: replace it with --force",
        ),
        (4, &["init", "mesh.obj", "-o", "nowhere/s.toml"], "nowhere/s.toml: cannot write here"),
        (2, &["init", "mesh.obj", "-o", "s.json"], "s.json: expected a name that ends in .toml"),
        (2, &["init", "old.toml"], "old.toml is a scene already"),
        (2, &["render", "s.toml", "mesh.obj"], "s.toml is a scene, and 2 files are given"),
        (2, &["render", "s.toml", "--ground"], "--ground is for data files, and a scene is given"),
        (
            2,
            &["render", "mesh.obj", "--preset", "bone"],
            "--preset bone: there is no such preset\nhint: there are ct-bone",
        ),
        (4, &["render", "mesh.obj", "--preset", "bone.json"], "bone.json: cannot read the preset"),
        (2, &["render", "mesh.obj", "--fit", "0"], "--fit 0: expected a number above 0, at most 1"),
        (2, &["render", "mesh.obj", "--fit", "1e99"], "--fit 1e99: expected a number above 0, at most 1"),
        (2, &["render", "mesh.obj", "--preset", "ct-bone"], "--preset is for volumes"),
        (2, &["render", "scan.xyz", "--preset", "turbo"], "--preset is for volumes"),
        (2, &["render", "mesh.obj", "--size", "0x9"], "--size 0x9: `size`: expected 1 to 65536 pixels a side, found 0"),
        (2, &["render", "mesh.obj", "--turntable", "0"], "0 is not in 1..=100000"),
    ] {
        place.expect(code, arguments, stderr);
    }
    assert_eq!(place.bytes("old.png"), b"old");
    assert_eq!(place.bytes("old.toml"), b"version = 1\n");
    assert!(!place.path("a.png").exists());
    place.expect(0, &["render", "nan.xyz", "-o", "a.png", "--drop-invalid", "--size", "8x6"], "");
}

#[test]
fn data_without_extent_is_drawn_all_the_same() {
    let place = data();
    place.write("one.xyz", "3 4 5\n");
    place.write("same.xyz", "3 4 5\n".repeat(9));
    place.write("line.xyz", "0 0 0\n1 0 0\n2 0 0\n3 0 0\n");
    place.write("plane.obj", "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3 4\n");
    place.write("flat.nrrd", ball_volume(|_| 7.0));
    for file in ["one.xyz", "same.xyz", "line.xyz", "plane.obj", "flat.nrrd"] {
        place.expect(0, &["render", file, "-o", "a.exr", "--force", "--size", "30x20"], "");
        let seen = picture_of(&place.path("a.exr")).opacity().iter().filter(|a| **a > 0.3).count();
        assert!((10..600).contains(&seen), "{file}: {seen} pixels");
    }
}

const MESH: &str = "[[object]]\nname = \"ball\"\nmesh = \"mesh.obj\"\n";

fn auto(camera: &str) -> String {
    let light = &SMALL_SCENE[SMALL_SCENE.find("[background]").unwrap()..];
    format!("version = 1\n{camera}\n{light}{MESH}")
}

#[test]
fn a_camera_of_a_scene_places_itself_and_says_where() {
    let place = data();
    place.write("s.toml", auto("camera = \"auto\""));
    place.write("table.toml", auto("[camera]\nauto = true\nfit = 0.9"));
    let text = format!(
        "{:#}",
        serde_json::json!({
            "version": 1, "camera": "auto", "background": { "color": [0.25, 0.5, 1.0] },
            "light": [{ "kind": "point", "position": [2, 4, 1], "intensity": [20, 20, 20] }],
            "object": [{ "name": "ball", "mesh": "mesh.obj" }],
        })
    );
    place.write("s.json", text);
    let out = |scene: &str, output: &str| {
        let out = place.expect(0, &["render", scene, "--size", "60x40", "--json", "-o", output], "");
        serde_json::from_slice::<Value>(&out.stdout).unwrap()
    };
    let document = out("s.toml", "a.png");
    out("table.toml", "b.png");
    out("s.json", "c.png");
    assert!(place.pixels("a.png") == place.pixels("b.png"));
    assert!(place.pixels("a.png") == place.pixels("c.png"));
    assert_eq!(document["camera"]["auto"], true);
    let explained = place.expect(0, &["explain", "s.toml", "--size", "60x40", "--json"], "");
    let explained: Value = serde_json::from_slice(&explained.stdout).unwrap();
    assert_eq!(explained["camera"], document["camera"]);
    // The numbers that were found give the picture.
    let [position, target] = ["position", "target"].map(|key| document["camera"][key].to_string());
    place.write("s.toml", auto(&format!("[camera]\nposition = {position}\ntarget = {target}\nsize = [60, 40]")));
    place.expect(0, &["render", "s.toml", "-o", "d.png"], "");
    assert!(place.pixels("a.png") == place.pixels("d.png"));
}

#[test]
fn a_camera_that_places_itself_refuses_what_it_cannot_use() {
    let place = data();
    for (camera, stderr) in [
        ("camera = \"atuo\"", "expected a table"),
        ("[camera]\nauto = true\nposition = [0, 0, 1]", "`position` is not for a camera with `auto`"),
        ("[camera]\nauto = true\northographic = 3", "`orthographic`: the height"),
        ("[camera]\nauto = true\nfit = 1.5", "`fit`: expected a number above 0, at most 1, found 1.5"),
        ("[camera]\nauto = true\nelevation = 91", "`elevation`: expected a number from -90 to 90"),
        (
            "[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nsize = [8, 8]\nazimuth = 3",
            "`azimuth` belongs to a camera with `auto",
        ),
        ("[camera]\nfov_y = 30", "expected a key `position` here, found none\nhint: or say `auto = true`"),
    ] {
        place.write("s.toml", auto(camera));
        let out = place.run(&["render", "s.toml"]);
        let said = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(out.status.code() == Some(3) && said.contains(stderr), "{camera}: {said}");
    }
    place.write("s.toml", auto("camera = \"auto\"").replace(MESH, ""));
    place.expect(3, &["render", "s.toml"], "there is nothing to see for a camera that is placed by itself");
}

#[test]
fn a_turntable_is_numbered_frames_around_what_is_seen() {
    let place = data();
    place.write("s.toml", auto("[camera]\nposition = [0, 1, 5]\ntarget = [0, 0, 0]\nsize = [24, 16]"));
    place.expect(0, &["render", "s.toml", "-o", "t.png", "--turntable", "4"], "");
    place.expect(0, &["render", "s.toml", "-o", "still.png"], "");
    assert!(place.pixels("t.0000.png") == place.pixels("still.png"));
    place.expect(0, &["render", "s.toml", "-o", "quarter.png", "--set", "camera.position=[5, 1, 0]"], "");
    assert!(place.pixels("t.0001.png") == place.pixels("quarter.png"));
    place.expect(0, &["render", "mesh.obj", "-o", "f.exr", "--turntable", "3", "--frames=1-2", "--size", "24x16"], "");
    assert!(!place.path("f.0000.exr").exists() && place.path("f.0002.exr").exists());
    let moving = format!("{}[animation]\nframes = 2\n", auto("camera = \"auto\""));
    place.write("s.toml", moving);
    place.expect(2, &["render", "s.toml", "--turntable", "3"], "--turntable: s.toml has an animation of its own");
}

/// A plank along x, seen from its end in frame 0 and from its side in frame 1.
#[test]
fn nothing_is_cut_off_in_any_frame_of_a_turntable_of_a_file_and_init_writes_its_scene() {
    let place = Place::new("");
    place.write("plank.obj", "v -9 -1 -1\nv 9 -1 -1\nv 9 1 1\nv -9 1 1\nf 1 2 3\nf 1 3 4\n");
    let turn = ["--turntable", "4", "--azimuth", "90"];
    place.expect(0, &[&["render", "plank.obj", "-o", "t.exr"], &turn[..], &SIZE].concat(), "");
    let most = (0..4).flat_map(|frame| reach(&picture_of(&place.path(&format!("t.000{frame}.exr")))));
    let most = most.fold(0.0, f64::max);
    assert!((0.7..0.99).contains(&most), "{most}");
    place.expect(0, &[&["init", "plank.obj", "-o", "plank.toml"], &turn[..], &SIZE].concat(), "");
    place.expect(0, &["render", "plank.toml", "-o", "plank.exr", "--turntable", "4"], "");
    assert!(place.bytes("plank.0001.exr") == place.bytes("t.0001.exr"));
}

#[test]
fn the_discs_of_a_few_points_are_seen_whole() {
    let place = Place::new("");
    let fraction = |x: f64| x - x.floor();
    let few = |n: i32| {
        let point =
            |i: i32| format!("{} {} 0\n", fraction(f64::from(i) * 0.754_877), fraction(f64::from(i) * 0.569_84));
        place.write("few.xyz", (0..n).map(point).collect::<String>());
    };
    let seen = |what: &str| {
        place.expect(0, &[&["render", what, "-o", "few.exr", "--force"][..], &SIZE].concat(), "");
        let most = reach(&picture_of(&place.path("few.exr"))).into_iter().fold(0.0, f64::max);
        assert!((0.6..0.99).contains(&most), "{what}: {most}");
        most
    };
    for n in [2, 3, 6, 30] {
        few(n);
        seen("few.xyz");
    }
    few(6);
    for (name, keys) in [
        ("translucent", "opacity = 0.4"),
        ("medium", "as = \"medium\"\nextinction = 3.0"),
        ("sized", "point_size = { world = 0.7 }"),
    ] {
        let scene = |keys: &str| {
            let file = format!("{name}.toml");
            place.write(&file, auto("camera = \"auto\"").replace("mesh = \"mesh.obj\"", keys));
            seen(&file)
        };
        let unscaled = scene(&format!("points = \"few.xyz\"\n{keys}"));
        // In another unit of length, a size in the world with it, what is seen is as wide.
        let keys = keys.replace("0.7", "0.91");
        let unit = "transform = { scale = 1.3, translate = [5, -7, 1e6] }";
        let scaled = scene(&format!("points = \"few.xyz\"\n{unit}\n{}", keys.replace("3.0", "2.307_692_3")));
        assert!((unscaled - scaled).abs() < 0.03, "{name}: {unscaled} {scaled}");
    }
}

#[test]
fn what_stands_on_the_plane_of_its_other_axes_points_up_along_the_third() {
    let place = Place::new("");
    let text = |file: &str| String::from_utf8(place.expect(0, &["info", file], "").stdout).unwrap();
    place.write("cone.obj", "v -1 -1 0\nv 1 -1 0\nv 0 1 0\nv 0 0 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 3 2 1\n");
    assert!(text("cone.obj").contains("it stands along z, so a first scene has z point up"));
    place.expect(0, &["init", "cone.obj", "-o", "cone.toml"], "");
    assert!(String::from_utf8(place.bytes("cone.toml")).unwrap().contains("transform = { up = \"z\" }"));
    place.expect(0, &["init", "cone.obj", "--up", "y", "-o", "lying.toml"], "");
    assert!(String::from_utf8(place.bytes("lying.toml")).unwrap().contains("transform = { up = \"y\" }"));
    // Beside another file that does not stand there, whose coordinates may be the same.
    place.write("beside.obj", "v 1 -1 1\nv 3 -1 1\nv 2 1 1\nf 1 2 3\n");
    place.expect(0, &["init", "cone.obj", "beside.obj", "-o", "both.toml"], "");
    assert!(!String::from_utf8(place.bytes("both.toml")).unwrap().contains("up = "));
    place.write("hanging.obj", "v -1 -1 1\nv 1 -1 1\nv 0 1 1\nv 0 0 3\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 3 2 1\n");
    assert!(text("hanging.obj").contains("y, as nothing in the file says another; --up of render and init turns it\n"));
}

#[test]
fn data_outside_the_root_folder_needs_the_line_that_the_error_offers_and_init_writes() {
    let place = data();
    for folder in ["a/b", "data"] {
        std::fs::create_dir_all(place.path(folder)).unwrap();
    }
    std::fs::copy(place.path("mesh.obj"), place.path("data/mesh.obj")).unwrap();
    let scene = auto("camera = \"auto\"").replace("mesh.obj", "../../data/mesh.obj");
    place.write("a/b/s.toml", &scene);
    let arguments = ["render", "a/b/s.toml", "--size", "8x6", "-o", "a.png", "--force"];
    place.expect(
        3,
        &arguments,
        "hint: allow it with the line root = \"../../data\" before the first table of the scene",
    );
    place.write("a/b/s.toml", scene.replace("version = 1", "version = 1\nroot = \"../../data\""));
    place.expect(0, &arguments, "");
    // A stranger's scene grants itself nothing.
    let sandbox = [&arguments[..], &["--sandbox"]].concat();
    place.expect(3, &sandbox, "a/b/s.toml:2:8: `root`: ");
    place.expect(3, &["info", "a/b/s.toml", "--sandbox"], "lies outside the root folder");
    place.write(
        "a/b/s.toml",
        scene.replace("version = 1", "version = 1\nroot = \"../c\"").replace("../../data", "../c"),
    );
    std::fs::create_dir(place.path("a/c")).unwrap();
    std::fs::copy(place.path("mesh.obj"), place.path("a/c/mesh.obj")).unwrap();
    place.expect(0, &sandbox, "");
    place.write("a/b/s.toml", scene.replace("version = 1", "version = 1\nroot = \"../../nowhere\""));
    place.expect(3, &arguments, "`root`: expected a folder, found \"../../nowhere\"");
    place.expect(0, &["init", "data/mesh.obj", "-o", "a/b/first.toml", "--size", "8x6"], "");
    let text = String::from_utf8(place.bytes("a/b/first.toml")).unwrap();
    assert!(text.contains("root = \"../../data\"") && text.contains("mesh = \"../../data/mesh.obj\""), "{text}");
    place.expect(0, &["render", "a/b/first.toml", "-o", "a.png", "--force"], "");
}

#[test]
fn info_says_what_a_file_holds_for_people_and_for_programs() {
    let place = data();
    let text = |file: &str| String::from_utf8(place.expect(0, &["info", file], "").stdout).unwrap();
    let mesh = text("mesh.obj");
    assert!(mesh.contains("mesh, read as Obj") && mesh.contains("triangles 192"), "{mesh}");
    // The poles are rings of triangles without area.
    assert!(mesh.contains("24 triangles without area"), "{mesh}");
    let head = text("head.nrrd");
    assert!(head.contains("0.1 × 0.1 × 0.1") && head.lines().filter(|l| l.contains('#')).count() > 8, "{head}");
    assert!(text("far.obj").contains("times its size from the origin"));
    let points = place.expect(0, &["info", "scan.xyz", "--json"], "");
    let points: Value = serde_json::from_slice(&points.stdout).unwrap();
    // Points of a Fibonacci lattice on a ball of radius 40 lie about √(4π/300)·40 apart.
    let spacing = points["spacing"].as_f64().unwrap();
    assert!((5.0..10.0).contains(&spacing), "{spacing}");
    assert_eq!((&points["duplicate_points"], &points["format"]), (&Value::from(0), &Value::from("Xyz")));
}

/// A legacy file of three hexahedra in a row along x, with these arrays.
fn cells(arrays: &str) -> String {
    let mut text =
        String::from("# vtk DataFile Version 3.0\na bar\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 16 float\n");
    for i in 0..16 {
        writeln!(text, "{} {} {}", i % 4, i / 4 % 2, i / 8).unwrap();
    }
    text += "CELLS 3 27\n8 0 1 5 4 8 9 13 12\n8 1 2 6 5 9 10 14 13\n8 2 3 7 6 10 11 15 14\nCELL_TYPES 3\n12\n12\n12\n";
    text + arrays
}

#[test]
fn cells_are_a_body_whose_whole_surface_shows_its_values() {
    let place = data();
    let of_cells =
        |values: &str| cells(&format!("CELL_DATA 3\nSCALARS attribute int 1\nLOOKUP_TABLE default\n{values}\n"));
    place.write("labels.vtk", of_cells("0 1 2"));
    place.write("same.vtk", of_cells("3 3 3"));
    let of_points = "POINT_DATA 16\nSCALARS moved float 1\nLOOKUP_TABLE default\n0 0 .5 1 0 0 .5 1 0 0 .5 1 0 0 .5 1\n";
    place.write("bar.vtk", cells(of_points));
    // From the front the bar is three times as wide as high, and opaque from end to end, also where values are 0.
    for file in ["labels.vtk", "same.vtk", "bar.vtk"] {
        let front = ["--azimuth", "0", "--elevation", "0", "-o", "a.exr", "--force"];
        place.expect(0, &[&["render", file], &SIZE[..], &front].concat(), "");
        let alpha = picture_of(&place.path("a.exr")).opacity();
        let middle = &alpha[20 * 60..21 * 60];
        let seen: Vec<f64> = middle.iter().copied().filter(|alpha| *alpha > 0.0).collect();
        assert!(seen.len() > 45 && seen[1..seen.len() - 1].iter().all(|alpha| *alpha > 0.99), "{file}: {middle:?}");
    }
    let init = |options: &[&str]| {
        let out = place.expect(0, &[&["init"], options, &["-o", "a.toml", "--force"]].concat(), "");
        let text = String::from_utf8(place.bytes("a.toml")).unwrap();
        (text, String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let (text, said) = init(&["labels.vtk"]);
    assert!(text.contains("mesh = \"labels.vtk\"") && text.contains("color_by = { column = \"attribute\" }"), "{text}");
    assert!(said.contains("its 3 whole numbers are taken for amounts") && said.contains("--preset labels"), "{said}");
    let (text, _) = init(&["labels.vtk", "--preset", "labels"]);
    assert!(text.contains("color_by = { column = \"attribute\", map = \"distinct\" }"), "{text}");
    let (text, said) = init(&["same.vtk"]);
    assert!(!text.contains("color_by") && said.contains("`attribute` is 3 throughout"), "{text}{said}");
    let (text, _) = init(&["bar.vtk", "--preset", "turbo"]);
    assert!(text.contains("color_by = { column = \"moved\", map = \"turbo\" }"), "{text}");
    let (text, _) = init(&["bar.vtk", "--preset", "mri"]);
    assert!(text.contains("volume = \"bar.vtk\""), "{text}");
    place.expect(2, &["init", "bar.vtk", "--preset", "labels"], "`moved` has other numbers");
}

#[test]
fn what_a_depth_camera_saw_is_turned_upright() {
    let place = data();
    let mut text = String::from("x y z\n");
    for i in 0..400 {
        writeln!(
            text,
            "{} {} {}",
            f64::from(i % 20) / 10.0 - 1.0,
            f64::from(i / 20) / 10.0 - 1.0,
            // A wall that leads away from the camera: what is flat lies on the ground more often.
            1.5 + 0.1 * f64::from(i % 20)
        )
        .unwrap();
    }
    place.write("frame.xyz", text);
    let out =
        place.expect(0, &["init", "frame.xyz", "-o", "frame.toml"], "-y does, as its points lie before a depth camera");
    let text = String::from_utf8(place.bytes("frame.toml")).unwrap();
    assert!(text.contains("transform = { up = \"-y\" }"), "{text}{out:?}");
}
