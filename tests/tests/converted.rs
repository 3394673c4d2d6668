//! `organza convert`: the splats of a scene in a file are drawn to the same picture, bit for bit, and what is no such file is refused.

use organza_tests::{Place, organza, picture_of};
use serde_json::Value;
use std::fmt::Write as _;
use std::fs;

const HEAD: &str = "version = 1\n[camera]\nposition = [0.4, 0.9, 5]\ntarget = [0, 0, 0]\nsize = [40, 30]\n[background]\ncolor = [0.1, 0.2, 0.3]\n\
    [ambient]\ncolor = [0.1, 0.1, 0.1]\n[render]\nlayers = ['effects', 'depth', 'normal', 'shadow']\n\
    [[light]]\nkind = 'point'\nposition = [2, 4, 3]\nintensity = [30, 28, 25]\n\
    [material.glass]\nopacity = 0.4\nspecular = 0.3\n[material.mist]\nmedium = { extinction = 2, asymmetry = 0.3 }\n";

/// Objects of every kind of splats: name, source with what decides its splats, and how it looks.
const OBJECTS: [[&str; 3]; 5] = [
    [
        "scan",
        "points = 'scan.csv'\ndiscs = 'elliptical'\ntransform = { rotate = [10, 20, 30], scale = 0.9 }\n",
        "material = 'glass'\n",
    ],
    ["floor", "rectangle = { center = [0, -1, 0], u = [2, 0, 0], v = [0, 0, -2], spacing = 0.12 }\n", ""],
    [
        "ball",
        "implicit = { expression = 'x^2 + y^2 + z^2 - 0.5', box = [[-1, -1, -1], [1, 1, 1]], resolution = 24 }\n",
        "material = 'glass'\n",
    ],
    [
        "mist",
        "density = { expression = '1 - x^2 - y^2', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.2, extinction = 0.5 }\n",
        "material = 'mist'\n",
    ],
    [
        "grains",
        "points = 'scan.csv'\nas = 'medium'\nextinction = 3\ncolor_by = { column = 'heat' }\ntransform = { translate = [0.5, 0.8, 0] }\n",
        "material = 'mist'\n",
    ],
];

/// Points with an opacity, a heat and a shadow coefficient each.
fn scan() -> String {
    let mut text = "x,y,z,opacity,heat,shadow_coefficient\n".to_owned();
    for n in 0..300u32 {
        let i = n % 20;
        let j = n / 20;
        let x = f64::from(i) * 0.05 - 0.5;
        let y = f64::from(j) * 0.15 - 1.0;
        let z = 0.2 * (3.0 * x).sin();
        writeln!(text, "{x:.3},{y:.3},{z:.4},{},{},{}", if n % 7 == 0 { 1.0 } else { 0.6 }, n, f64::from(n % 4) / 4.0)
            .unwrap();
    }
    text
}

fn objects(source: impl Fn(usize) -> String) -> String {
    let object =
        |(i, [name, _, look]): (usize, &[&str; 3])| format!("[[object]]\nname = '{name}'\n{}{look}", source(i));
    OBJECTS.iter().enumerate().map(object).collect()
}

/// A place with the scene, and one of the splats that are made of it.
fn place() -> Place {
    let place = Place::new(&format!("{HEAD}{}", objects(|i| OBJECTS[i][1].to_owned())));
    place.write("scan.csv", scan());
    let part = |i: usize| format!("points = 'splats.ply'\nkeep = {{ object = [{i}, {i}] }}\n");
    place.write("splats.toml", format!("{HEAD}{}", objects(part)));
    place
}

#[test]
fn the_splats_of_a_scene_in_a_file_are_drawn_to_the_same_bits() {
    let place = place();
    let out = place.expect(0, &["convert", "s.toml", "-o", "splats.ply", "--json"], "");
    let document: Value = serde_json::from_slice(&out.stdout).unwrap();
    assert_eq!(document["bytes"], fs::metadata(place.path("splats.ply")).unwrap().len());
    let named: Vec<(&str, u64)> = document["objects"]
        .as_array()
        .unwrap()
        .iter()
        .map(|o| (o["name"].as_str().unwrap(), o["splats"].as_u64().unwrap()))
        .collect();
    assert_eq!((named[0], named[4].0), (("scan", 300), "grains"));
    assert!(named.iter().all(|(_, n)| *n > 200) && document["splats"] == named.iter().map(|(_, n)| n).sum::<u64>());
    place.expect(0, &["convert", "s.toml", "-o", "packed.ply", "--packed"], "");
    let ratio = fs::metadata(place.path("packed.ply")).unwrap().len() as f64 / document["bytes"].as_f64().unwrap();
    assert!(ratio < 0.5, "{ratio}");
    place.write(
        "packed.toml",
        fs::read_to_string(place.path("splats.toml")).unwrap().replace("splats.ply", "packed.ply"),
    );
    let drawn = |scene: &str, image: &str| {
        place.expect(0, &["render", scene, "-o", image], "");
        let picture = picture_of(&place.path(image));
        ["R", "G", "B"].map(|c| picture.channel(c)).concat()
    };
    let given = drawn("s.toml", "given.exr");
    let packed = drawn("packed.toml", "packed.exr");
    let square = given.iter().zip(&packed).map(|(a, b)| (a - b).powi(2)).sum::<f64>() / given.len() as f64;
    println!("{ratio:.3} of the bytes, {:.5} of radiance", square.sqrt());
    assert!(square.sqrt() < 4e-3 && given != packed, "{square}");
    for technique in ["points", "reference"] {
        for (scene, image) in [("s.toml", "a.exr"), ("splats.toml", "b.exr")] {
            place.expect(0, &["render", scene, "-o", image, "--force", "--technique", technique], "");
        }
        let [a, b] = ["a.exr", "b.exr"].map(|image| picture_of(&place.path(image)));
        assert!(a == b, "{technique}");
        assert!(a.channel("direct.R").iter().any(|v| *v > 0.0) && a.channel("scatter1.R").iter().any(|v| *v > 0.0));
    }
    // Surfaces alone by the technique for them; and written once more the file is the same.
    let hidden = ["--set", "object.mist.visible=false", "--set", "object.grains.visible=false"];
    place.expect(0, &[&["convert", "s.toml", "-o", "surfaces.ply"], &hidden[..]].concat(), "");
    let of_surfaces = fs::read_to_string(place.path("splats.toml")).unwrap().replace("splats.ply", "surfaces.ply");
    place.write("surfaces.toml", of_surfaces);
    for (scene, image) in [("s.toml", "a.exr"), ("surfaces.toml", "b.exr")] {
        let render = [&["render", scene, "-o", image, "--force", "--technique", "surfels"], &hidden[..]].concat();
        place.expect(0, &render, "");
    }
    assert!(picture_of(&place.path("a.exr")) == picture_of(&place.path("b.exr")), "surfels");
    place.expect(0, &["convert", "splats.toml", "-o", "again.ply"], "");
    assert!(place.bytes("again.ply") == place.bytes("splats.ply"));
}

#[test]
fn a_file_of_splats_is_described_and_drawn_as_any_other() {
    let place = place();
    place.expect(0, &["convert", "s.toml", "-o", "splats.ply"], "");
    let told = place.expect(0, &["info", "splats.ply", "--json"], "");
    let document: Value = serde_json::from_slice(&told.stdout).unwrap();
    let remarks = document["remarks"].to_string();
    assert!(remarks.contains("its points are splats: ") && remarks.contains("of translucent surfaces"), "{remarks}");
    assert_eq!(document["columns"]["object"], serde_json::json!([0.0, 4.0]));
    place.expect(0, &["render", "splats.ply", "-o", "a.png", "--size", "40x30"], "");
    place.expect(0, &["init", "splats.ply", "-o", "first.toml"], "");
    assert!(fs::read_to_string(place.path("first.toml")).unwrap().contains("splats; "));
    // Data files without a scene are converted too.
    place.expect(0, &["convert", "scan.csv", "-o", "scan.ply"], "");
    place.expect(0, &["render", "scan.ply", "-o", "b.png", "--size", "40x30"], "");
}

#[test]
fn what_cannot_be_converted_is_refused_and_leaves_nothing() {
    let place = place();
    place.expect(2, &["convert", "s.toml", "-o", "splats.obj"], "expected a name that ends in .ply");
    place.expect(2, &["convert", "s.toml", "-o", "splats.ply", "--technique", "sheets"], "--technique is for pictures");
    place.expect(4, &["convert", "nothing.csv", "-o", "splats.ply"], "");
    place.expect(4, &["convert", "s.toml", "-o", "scan.csv/splats.ply"], "cannot write here");
    place.expect(5, &["convert", "s.toml", "-o", "splats.ply", "--max-memory", "100K"], "");
    assert_eq!(place.made(), ["scan.csv", "splats.toml"]);
    let out = place.expect(0, &["convert", "s.toml", "-o", "splats.ply"], "");
    assert!(String::from_utf8_lossy(&out.stdout).ends_with("draw it: organza render splats.ply -o picture.png\n"));
    let whole = place.bytes("splats.ply");
    place.expect(4, &["convert", "s.toml", "-o", "splats.ply"], "exists already");
    place.expect(4, &["convert", "splats.toml", "-o", "splats.ply", "--force"], "this output is also an input");
    assert!(place.bytes("splats.ply") == whole);
    // What a technique cannot take of the file is refused by name.
    place.write("surfels.toml", format!("{HEAD}[[object]]\nname = 'all'\npoints = 'splats.ply'\n"));
    let by = |technique| ["render", "surfels.toml", "-o", "a.exr", "--technique", technique];
    place.expect(3, &by("surfels"), "all: splats of a medium, and its technique draws surfaces alone");
    place.expect(3, &by("particles"), "object 'all': splat");
    let bytes = |from: &str, to: &str| {
        let at = whole.windows(from.len()).position(|w| w == from.as_bytes()).unwrap();
        place.write("splats.ply", [&whole[..at], to.as_bytes(), &whole[at + from.len()..]].concat());
    };
    bytes("organza splats 1", "organza splats 9");
    place.expect(3, &by("points"), "splats.ply:3: expected splats of version 1, found '9'");
    bytes("property float cross_section\n", "");
    place.expect(3, &by("points"), "expected a property 'cross_section' of 'vertex', found none");
    place.write("splats.ply", &whole[..whole.len() / 2]);
    place.expect(3, &by("points"), "splats.ply:");
    // Colours of a photograph hold their light.
    place.write("photo.csv", "x,y,z,red,green,blue\n0,0,0,255,0,0\n1,0,0,0,255,0\n0,1,0,0,0,255\n");
    place.expect(
        0,
        &["convert", "photo.csv", "-o", "photo.ply"],
        "'photo' is shown without light: draw its splats with `unlit = true`",
    );
}

#[test]
fn an_object_of_gaussians_is_named() {
    let place = place();
    let gaussian: Vec<u8> = [0f32, 0.0, 0.0, 0.1, 0.1, 0.1]
        .into_iter()
        .flat_map(f32::to_le_bytes)
        .chain([200, 100, 50, 128, 255, 128, 128, 128])
        .collect();
    place.write("one.splat", gaussian);
    place.expect(3, &["convert", "one.splat", "-o", "one.ply"], "object 'one': it is 3D Gaussians");
    assert!(organza().arg("convert").output().unwrap().status.code() == Some(2));
}
