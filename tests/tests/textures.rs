//! Textures of meshes through the whole command: every technique shows the mean of the texture over a splat.

use image::{Rgba, RgbaImage};
use organza::scene::{LoadOptions, parse};
use organza::{InMemory, Progress, RenderOptions, SourceData};
use organza_tests::{draw_in, parallel_view, window};
use read::{Loaded, ReadParams, TextureImage, TexturePlaces, Textures, textured_in_memory};
use splat_core::srgb::encoded;
use splat_core::{Mesh, Relative};
use std::path::Path;

/// A square of 1.5 with the whole image `a.png`, whose lower left corner is that of the square.
const SQUARE: &str = "mtllib a.mtl\nusemtl a\nv -0.75 -0.75 0\nv 0.75 -0.75 0\nv 0.75 0.75 0\nv -0.75 0.75 0\n\
    vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
const CORNERS: [[f64; 3]; 4] = [[-0.75, -0.75, 0.0], [0.75, -0.75, 0.0], [0.75, 0.75, 0.0], [-0.75, 0.75, 0.0]];
const TRIANGLES: [[u32; 3]; 2] = [[0, 1, 2], [0, 2, 3]];
const PLACES: [[f32; 2]; 4] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];

/// The square in its own colours without light.
fn scene(more: &str) -> String {
    parallel_view(1.0, 32)
        + "[material.film]\nshading = 'unlit'\n[[object]]\nname = 'film'\nmesh = 'a.obj'\nmaterial = 'film'\n"
        + more
}

fn place(square: &str, image: &RgbaImage) -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.obj"), square).unwrap();
    std::fs::write(folder.path().join("a.mtl"), "newmtl a\nmap_Kd a.png\n").unwrap();
    image.save(folder.path().join("a.png")).unwrap();
    folder
}

/// A grey texel of this light.
fn grey(light: f64) -> Rgba<u8> {
    let byte = (255.0 * encoded(light)).round() as u8;
    Rgba([byte, byte, byte, 255])
}

/// A way to draw a scene, and the greatest error of the mean of a column.
type Trial = (&'static [&'static str], f64);

/// Every technique. Eight bits of a texel are right within 0.0045 of light, twice; particles err by chance besides.
const TRIALS: [Trial; 6] = [
    (&["points"], 0.01),
    (&["reference"], 0.01),
    (&["surfels"], 0.01),
    (&["sheets"], 0.01),
    (&["sheets", "--set", "render.sheets.slicing='half_vector'"], 0.01),
    (&["particles", "--set", "render.particles.repeat_level=100"], 0.025),
];

/// Means of the columns of the picture within the square, in red.
fn columns(folder: &Path, more: &str, technique: &[&str]) -> Vec<f64> {
    let picture = draw_in(folder, &scene(more), &[&["--technique"], technique].concat());
    let red = picture.channel("R");
    (1..31).map(|column| window(&red, 32, column..column + 1, 2..30).iter().sum::<f64>() / 28.0).collect()
}

#[test]
fn a_ramp_of_texels_is_shown_by_every_technique() {
    // Means of a ramp over any square are the ramp, up to half a texel from its ends.
    let ramp = RgbaImage::from_fn(96, 4, |x, _| grey((f64::from(x) + 0.5) / 96.0));
    let folder = place(SQUARE, &ramp);
    for (technique, bound) in TRIALS {
        for more in ["", "spacing = 0.015\n"] {
            let found = columns(folder.path(), more, technique);
            let expected = |k: usize| ((k as f64 + 1.5) / 32.0 - 0.5) / 1.5 + 0.5;
            let worst = found.iter().enumerate().map(|(k, red)| (red - expected(k)).abs()).fold(0.0, f64::max);
            println!("{technique:?} {more}: {worst:.1e}");
            assert!(worst < bound, "{technique:?}: {worst:e} {found:?}");
        }
    }
}

#[test]
fn texels_finer_than_splats_are_averaged_by_every_technique() {
    // 512 texels along a square of 48 pixels: single texels would show as patches.
    let board = RgbaImage::from_fn(512, 512, |x, y| grey(f64::from((x + y) % 2)));
    let folder = place(SQUARE, &board);
    for (technique, bound) in TRIALS {
        let found = columns(folder.path(), "spacing = 0.015\n", technique);
        let worst = found.iter().map(|red| (red - 0.5).abs()).fold(0.0, f64::max);
        println!("{technique:?}: {worst:.1e}");
        assert!(worst < bound, "{technique:?}: {worst:e} {found:?}");
    }
}

#[test]
fn an_even_texture_is_the_colour_of_its_texels() {
    let folder = place(SQUARE, &RgbaImage::from_pixel(13, 7, Rgba([255, 255, 255, 255])));
    for (technique, _) in TRIALS {
        let found = columns(folder.path(), "", technique);
        let worst = found.iter().map(|red| (red - 1.0).abs()).fold(0.0, f64::max);
        assert!(worst < 1e-4, "{technique:?}: {worst:e}");
    }
}

#[test]
fn a_repeated_texture_has_no_seam_where_its_copies_meet() {
    // Three copies along the square of sixteen pixels each, from dark to bright. The first lies within the image, where nothing repeats.
    let wave = RgbaImage::from_fn(64, 1, |x, _| grey(f64::from(x) / 63.0));
    let repeated = SQUARE.replace("vt 1 0", "vt 3 0").replace("vt 1 1", "vt 3 1");
    let folder = place(&repeated, &wave);
    for (technique, bound) in TRIALS {
        let found = columns(folder.path(), "spacing = 0.06\n", technique);
        // Around the first edge of two copies as around the second; triangles that are divided find an edge within a 32nd of the colours beside it.
        let apart = |k: &usize| (found[*k] - found[k + 16]).abs();
        let most = |columns: std::ops::Range<usize>| columns.map(|k| apart(&k)).fold(0.0, f64::max);
        assert!(most(0..6).max(most(8..14)) < 2.0 * bound, "{technique:?}: {found:?}");
        assert!(most(6..8) < bound.max(1.0 / 32.0), "{technique:?}: {found:?}");
    }
}

#[test]
fn threads_change_no_bit_of_a_textured_picture() {
    let image = RgbaImage::from_fn(40, 30, |x, y| Rgba([(7 * x) as u8, (11 * y) as u8, (x * y) as u8, 255]));
    let folder = place(SQUARE, &image);
    for technique in ["points", "surfels", "sheets", "particles"] {
        let draw =
            |threads: &str| draw_in(folder.path(), &scene(""), &["--technique", technique, "--threads", threads]);
        assert_eq!(draw("1"), draw("4"), "{technique}");
    }
}

#[test]
fn a_texture_that_a_program_hands_over_draws_the_picture_of_its_file() {
    let image =
        RgbaImage::from_fn(16, 8, |x, y| Rgba([(15 * x) as u8, (30 * y) as u8, 77, if x < 5 { 60 } else { 255 }]));
    let folder = place(SQUARE, &image);
    let corners = CORNERS.map(splat_core::glam::DVec3::from_array);
    let Relative { origin, offsets } = Relative::from_positions(&corners, Vec::new()).unwrap();
    let mesh = Mesh { origin, position: offsets, triangles: TRIANGLES.to_vec(), ..Mesh::default() };
    let params = ReadParams { textures: Textures::Kept, ..ReadParams::default() };
    let texture = TextureImage::File(folder.path().join("a.png"));
    let places = TexturePlaces::Vertices(PLACES.to_vec());
    let Loaded::Painted(mesh, painting) = textured_in_memory("film", mesh, &places, texture, &params).unwrap().0 else {
        panic!("the texture is not kept")
    };
    let mut in_memory = InMemory::default();
    in_memory.insert("film", SourceData::Painted(mesh.into(), painting.into())).unwrap();
    for technique in ["points", "surfels", "sheets", "particles"] {
        let of_file = format!("{}[render]\ntechnique = '{technique}'\n", scene(""));
        let draw = |text: &str, in_memory: InMemory| {
            let load = LoadOptions { allow_path: true, in_memory, ..LoadOptions::default() };
            let scene = parse(&folder.path().join("s.toml"), text.as_bytes(), &load).unwrap();
            organza::render(&scene, &RenderOptions::default(), &Progress::new()).unwrap().layers
        };
        let handed = draw(&of_file.replace("a.obj", "memory:film"), in_memory.clone());
        assert_eq!(draw(&of_file, InMemory::default()), handed, "{technique}");
    }
}
