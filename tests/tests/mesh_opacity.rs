//! Meshes whose vertices, materials or textures have opacities, through the whole command.

use organza_tests::{draw_in, largest_difference, organza, parallel_view, window};
use std::fmt::Write as _;
use std::path::Path;

/// A square of half-side 0.75 about the origin of the plane at `z`, in strips: at each of these places along x all vertices have one opacity.
fn square(middle: [f64; 2], strips: &[(f64, f64)]) -> String {
    let [x, z] = middle;
    let mut text = format!("ply\nformat ascii 1.0\nelement vertex {}\n", 2 * strips.len());
    text += "property double x\nproperty double y\nproperty double z\nproperty float alpha\n";
    writeln!(text, "element face {}\nproperty list uchar int vertex_indices\nend_header", strips.len() - 1).unwrap();
    for (at, alpha) in strips {
        writeln!(text, "{} -0.75 {z} {alpha}\n{} 0.75 {z} {alpha}", x + at, x + at).unwrap();
    }
    for i in 1..strips.len() {
        let first = 2 * i;
        writeln!(text, "4 {} {first} {} {}", first - 2, first + 1, first - 1).unwrap();
    }
    text
}

/// Opacity 0.5 + 0.6·x.
const RAMP: [(f64, f64); 2] = [(-0.75, 0.05), (0.75, 0.95)];

const COLOR: [f64; 3] = [0.9, 0.3, 0.1];
const BACKGROUND: [f64; 3] = [0.2, 0.5, 0.7];
const LIGHT: &str = "[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [1, 1, 1]\n";

/// The square before a uniform background, in its own colour without light.
fn scene(more: &str) -> String {
    parallel_view(1.0, 32)
        + LIGHT
        + &format!("[background]\ncolor = {BACKGROUND:?}\n[material.film]\nshading = 'unlit'\ncolor = {COLOR:?}\n")
        + "[[object]]\nname = 'film'\nmesh = 'film.ply'\nmaterial = 'film'\nspacing = 0.015\n"
        + more
}

/// How a scene is drawn, and the greatest error of the mean of a column.
type Trial = (&'static [&'static str], f64);

/// Every technique. Points and surfels err by the ripple of their discs; particles by 28 pixels of 4 samples and 100 sets, five deviations.
const TRIALS: [Trial; 6] = [
    (&["points"], 1e-3),
    (&["reference"], 1e-3),
    (&["surfels"], 2e-3),
    (&["sheets"], 1e-5),
    (&["sheets", "--set", "render.sheets.slicing='half_vector'"], 1e-5),
    (&["particles", "--set", "render.particles.repeat_level=100"], 0.025),
];

/// The largest error of the mean of a column in any channel, where a column of the picture has this opacity.
fn error(folder: &Path, more: &str, technique: &[&str], opacity: impl Fn(f64) -> f64) -> f64 {
    let picture = draw_in(folder, &scene(more), &[&["--technique"], technique].concat());
    let channels = ["R", "G", "B"].map(|name| picture.channel(name));
    let mut worst = 0.0f64;
    for column in 1..31 {
        let alpha = opacity((f64::from(column) + 0.5) / 32.0 - 0.5);
        for (k, channel) in channels.iter().enumerate() {
            let found = window(channel, 32, column..column + 1, 2..30).iter().sum::<f64>() / 28.0;
            worst = worst.max((found - (alpha * COLOR[k] + (1.0 - alpha) * BACKGROUND[k])).abs());
        }
    }
    worst
}

#[test]
fn a_ramp_of_opacity_is_what_its_vertices_say_by_every_technique() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("film.ply"), square([0.0, 0.0], &RAMP)).unwrap();
    let ramp = |x: f64| 0.5 + 0.6 * x;
    for (technique, bound) in TRIALS {
        let whole = error(folder.path(), "", technique, ramp);
        let thin = error(folder.path(), "opacity = 0.4\n", technique, |x| 0.4 * ramp(x));
        println!("{technique:?}: {whole:.1e}, of 0.4 {thin:.1e}");
        assert!(whole < bound && thin < bound, "{technique:?}: {whole:e} {thin:e}");
    }
}

#[test]
fn opaque_parts_end_rays_beside_those_that_do_not() {
    let folder = tempfile::tempdir().unwrap();
    // Opaque up to −0.1, half of that from 0.1 on, nothing of it beyond 0.3.
    let strips = [(-0.75, 1.0), (-0.1, 1.0), (0.1, 0.5), (0.25, 0.5), (0.3, 0.0), (0.75, 0.0)];
    std::fs::write(folder.path().join("film.ply"), square([0.0, 0.0], &strips)).unwrap();
    for (technique, bound) in TRIALS {
        let picture = draw_in(folder.path(), &scene(""), &[&["--technique"], technique].concat());
        let red = picture.channel("R");
        let mean = |columns: std::ops::Range<u32>| {
            let seen = window(&red, 32, columns, 2..30);
            seen.iter().sum::<f64>() / seen.len() as f64
        };
        let expected = [COLOR[0], 0.5 * (COLOR[0] + BACKGROUND[0]), BACKGROUND[0]];
        let found = [mean(1..11), mean(20..23), mean(27..31)];
        let off = (0..3).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f64::max);
        println!("{technique:?}: {off:.1e}");
        assert!(off < bound.max(1e-3), "{technique:?}: {found:?} {expected:?}");
    }
}

#[test]
fn a_mesh_that_is_opaque_everywhere_keeps_its_bits() {
    let folder = tempfile::tempdir().unwrap();
    let opaque = square([0.0, 0.0], &[(-0.4, 1.0), (0.4, 1.0)]);
    // Lines of vertices begin with a place.
    let bare_line = |line: &str| {
        if line.starts_with(['0', '-']) { line.strip_suffix(" 1").unwrap().to_owned() } else { line.to_owned() }
    };
    let bare: Vec<String> = opaque.lines().filter(|line| *line != "property float alpha").map(bare_line).collect();
    let bare = bare.join("\n") + "\n";
    assert_eq!(bare.lines().nth(9), Some("-0.4 -0.75 0"), "{bare}");
    for (technique, _) in TRIALS {
        let draw = |film: &str| {
            std::fs::write(folder.path().join("film.ply"), film).unwrap();
            draw_in(folder.path(), &scene(""), &[&["--technique"], technique].concat())
        };
        assert_eq!(draw(&opaque), draw(&bare), "{technique:?}");
    }
}

/// What comes through a mesh falls upon a wall: light goes as the opacities say.
#[test]
fn shadows_follow_the_opacity_by_every_technique() {
    let folder = tempfile::tempdir().unwrap();
    // Light goes two to the left while it goes one down; the square lies beside the view.
    std::fs::write(folder.path().join("film.ply"), square([2.0, 1.0], &RAMP)).unwrap();
    let text = |film: &str| {
        parallel_view(1.0, 32)
            + "[[light]]\nkind = 'directional'\ndirection = [-2, 0, -1]\nirradiance = [3, 3, 3]\n\
               [material.wall]\nshading = 'phong'\ndiffuse = 1\n\
               [[object]]\nname = 'wall'\nmaterial = 'wall'\n\
               rectangle = { center = [0, 0, 0], u = [0.75, 0, 0], v = [0, 0.75, 0], spacing = 0.015 }\n"
            + film
    };
    let film = "[[object]]\nname = 'film'\nmesh = 'film.ply'\nspacing = 0.015\n";
    for technique in ["points", "reference", "surfels", "sheets", "particles"] {
        let draw = |film: &str| draw_in(folder.path(), &text(film), &["--technique", technique]).channel("G");
        let [lit, shaded] = [draw(""), draw(film)];
        let mut worst = 0.0f64;
        for column in 3..29 {
            let mean = |values: &[f64]| window(values, 32, column..column + 1, 4..28).iter().sum::<f64>() / 24.0;
            let opacity = 0.5 + 0.6 * ((f64::from(column) + 0.5) / 32.0 - 0.5);
            worst = worst.max((mean(&shaded) / mean(&lit) - (1.0 - opacity)).abs());
        }
        println!("{technique}: {worst:.1e}");
        assert!(worst < 0.01, "{technique}: {worst:e}");
    }
}

/// Writes a square of 1.5 as a glTF file with its buffer, whose material and colours of corners are these.
fn write_gltf(folder: &Path, name: &str, material: &str, color: Option<[f32; 4]>) {
    let corners = [[-0.75f32, -0.75, 0.0], [0.75, -0.75, 0.0], [0.75, 0.75, 0.0], [-0.75, 0.75, 0.0]];
    let mut bytes: Vec<u8> = corners.as_flattened().iter().flat_map(|c| c.to_le_bytes()).collect();
    bytes.extend([[0.0f32, 0.0, 1.0]; 4].as_flattened().iter().flat_map(|c| c.to_le_bytes()));
    bytes.extend([0u16, 1, 2, 0, 2, 3].iter().flat_map(|i| i.to_le_bytes()));
    bytes.extend([color.unwrap_or_default(); 4].as_flattened().iter().flat_map(|c| c.to_le_bytes()));
    let tint = color.map_or("", |_| r#","COLOR_0":3"#);
    let used = if material.is_empty() { "" } else { r#","material":0"# };
    let text = format!(
        r#"{{"asset":{{"version":"2.0"}},"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"materials":[{material}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0,"NORMAL":1{tint}}},"indices":2{used}}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},
        {{"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"}},{{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}},
        {{"bufferView":3,"componentType":5126,"count":4,"type":"VEC4"}}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":48}},
        {{"buffer":0,"byteOffset":96,"byteLength":12}},{{"buffer":0,"byteOffset":108,"byteLength":64}}],
        "buffers":[{{"byteLength":{},"uri":"{name}.bin"}}]}}"#,
        bytes.len()
    );
    std::fs::write(folder.join(format!("{name}.bin")), bytes).unwrap();
    std::fs::write(folder.join(name), text).unwrap();
}

#[test]
fn the_opacity_of_a_material_is_drawn_whatever_the_format() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    let seen = |name: &str| {
        let picture = draw_in(folder.path(), &scene("").replace("film.ply", name), &["--technique", "sheets"]);
        picture.opacity()
    };
    write("film.ply", &square([0.0, 0.0], &[(-0.75, 0.25), (0.75, 0.25)]));
    let alpha = seen("film.ply");
    assert!(alpha.iter().all(|alpha| (alpha - 0.25).abs() < 1e-6), "{alpha:?}");
    let material =
        |mode: &str| format!(r#"{{"alphaMode":"{mode}","pbrMetallicRoughness":{{"baseColorFactor":[1,0,0,0.25]}}}}"#);
    let gltf = |name: &str, material: &str, color| write_gltf(folder.path(), name, material, color);
    gltf("blend.gltf", &material("BLEND"), None);
    gltf("opaque.gltf", &material("OPAQUE"), None);
    gltf("mask.gltf", &material("MASK"), None);
    gltf("both.gltf", &material("BLEND").replace("0.25", "0.5"), Some([1.0, 1.0, 1.0, 0.5]));
    gltf("tint.gltf", "", Some([1.0, 0.0, 0.0, 0.25]));
    for (name, expected) in
        [("blend.gltf", 0.25), ("opaque.gltf", 1.0), ("mask.gltf", 0.0), ("both.gltf", 0.25), ("tint.gltf", 0.25)]
    {
        let off = largest_difference(&seen(name), &vec![expected; alpha.len()]);
        assert!(off < 1e-6, "{name}: {off:e}");
    }
    write(
        "film.obj",
        "mtllib film.mtl\nusemtl film\nv -0.75 -0.75 0\nv 0.75 -0.75 0\nv 0.75 0.75 0\nv -0.75 0.75 0\nf 1 2 3 4\n",
    );
    for (opacity, expected) in [("d 0.25", 0.25), ("Tr 0.75", 0.25), ("Tr 0.1\nd 0.25", 0.25), ("d 0.25\nTr 0.1", 0.25)]
    {
        write("film.mtl", &format!("newmtl film\nKd 1 0 0\n{opacity}\n"));
        let off = largest_difference(&seen("film.obj"), &vec![expected; alpha.len()]);
        assert!(off < 1e-6, "{opacity}: {off:e}");
    }
}

#[test]
fn what_has_no_meaning_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let info = |name: &str| {
        let out = organza().args(["info", name]).current_dir(&folder).output().unwrap();
        let told = [out.stdout, out.stderr].concat();
        assert_eq!(out.status.code(), Some(0), "{}", String::from_utf8_lossy(&told));
        String::from_utf8(told).unwrap()
    };
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("clear.ply", &square([0.0, 0.0], &[(-0.75, 0.0), (0.75, 0.0)]));
    let clear = info("clear.ply");
    let expected = "its opacities are 0 everywhere, which would leave nothing to see: they are not used";
    assert!(clear.contains(expected), "{clear}");
    write("ramp.ply", &square([0.0, 0.0], &RAMP));
    let ramp = info("ramp.ply");
    assert!(ramp.contains("opacity") && !ramp.contains("not used"), "{ramp}");
    let material = r#"{"alphaMode":"BLEND","pbrMetallicRoughness":{"baseColorFactor":[1,1,1,0.5]}}"#;
    write_gltf(folder.path(), "a.gltf", material, None);
    let blend = info("a.gltf");
    assert!(blend.contains("the backs of its faces are drawn too"), "{blend}");
}
