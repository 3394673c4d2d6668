//! Lights that shine through a picture: where it falls, by every technique and by the path tracer, how much light that is, and what is
//! refused.

use organza_tests::{Picture, draw_in, hdr, organza, parallel_view, window};
use std::f64::consts::PI;
use std::path::Path;

const TECHNIQUES: [&str; 5] = ["points", "particles", "sheets", "surfels", "reference"];
/// Pixels of the pictures along a side, which show 2.4 world units.
const SIZE: u32 = 48;

/// A picture of 64 by 64 texels: four by four squares, of which those that begin at the top left are dark.
fn checker(folder: &Path) {
    let square = |x: u32, y: u32| if is_bright([x / 16, y / 16]) { [128, 64, 32, 129] } else { [0; 4] };
    std::fs::write(folder.join("checker.hdr"), hdr([64, 64], square)).unwrap();
}

fn is_bright([column, row]: [u32; 2]) -> bool {
    (column + row) % 2 == 1
}

fn white(folder: &Path) {
    std::fs::write(folder.join("white.hdr"), hdr([8, 4], |_, _| [128, 128, 128, 129])).unwrap();
}

fn spot(more: &str) -> String {
    format!(
        "[[light]]\nkind = 'spot'\nposition = [0, 0, 2]\ndirection = [0, 0, -1]\ninner = 40\nouter = 45\n\
         intensity = [3, 3, 3]\n{more}\n"
    )
}

fn sun(more: &str) -> String {
    format!("[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [1, 1, 1]\n{more}\n")
}

fn wall(opacity: f64) -> String {
    format!(
        "[[object]]\nname = 'wall'\nrectangle = {{ center = [0, 0, 0], u = [1.2, 0, 0], v = [0, 1.2, 0], spacing = 0.04 }}\n\
         opacity = {opacity:?}\n"
    )
}

fn drawn(folder: &Path, scene: &str, arguments: &[&str]) -> Picture {
    draw_in(folder, &(parallel_view(2.4, SIZE) + scene), arguments)
}

/// The pixels of a square of the picture, which four by four of them fill, without those at its border.
fn inside(values: &[f64], [column, row]: [u32; 2]) -> Vec<f64> {
    let side = SIZE / 4;
    let margin = 4;
    let along = |k: u32| k * side + margin..(k + 1) * side - margin;
    window(values, SIZE, along(column), along(row))
}

/// The squares of the picture, by column and row.
fn squares() -> impl Iterator<Item = [u32; 2]> {
    (0..16).map(|k| [k % 4, k / 4])
}

#[test]
fn a_checker_falls_where_projection_puts_it_in_every_technique() {
    let folder = tempfile::tempdir().unwrap();
    checker(folder.path());
    // At a distance of 2 the picture is as wide as the view.
    let angle = 2.0 * (0.6f64).atan().to_degrees();
    let scene = spot(&format!("texture = 'checker.hdr'\ntexture_angle = {angle:?}")) + &wall(0.6);
    for technique in TECHNIQUES {
        let arguments = ["--technique", technique, "--set", "render.particles.repeat_level=400"];
        let picture = drawn(folder.path(), &scene, &arguments);
        for (c, (channel, share)) in [("R", 1.0), ("G", 0.5), ("B", 0.25)].into_iter().enumerate() {
            let seen = picture.channel(channel);
            for square in squares() {
                let pixels = inside(&seen, square);
                let mean = pixels.iter().sum::<f64>() / pixels.len() as f64;
                if !is_bright(square) {
                    assert!(pixels.iter().all(|v| *v == 0.0), "{technique}, {square:?}: {pixels:?}");
                    continue;
                }
                let expected = share * mean_of_square(square);
                // Of particles the mean of 16 pixels and 400 sets of opacity .6 has a deviation below .0103.
                let tolerance = if technique == "particles" { 0.04 } else { 0.01 };
                assert!(
                    (mean / expected - 1.0).abs() < tolerance,
                    "{technique}, {square:?}, {c}: {mean}, expected {expected}"
                );
            }
        }
    }
}

/// What the red light of the spot, at a distance of 2, gives a square of the wall of opacity .6: ρ/π·I·cos θ/d² times the cone's share.
fn mean_of_square([column, row]: [u32; 2]) -> f64 {
    let pixel = |k: u32, at: u32| -1.2 + 2.4 * (f64::from(k * SIZE / 4 + at) + 0.5) / f64::from(SIZE);
    let mut sum = 0.0;
    let mut count = 0.0;
    for (x, y) in (4..8).flat_map(|x| (4..8).map(move |y| (x, y))) {
        let x = pixel(column, x);
        let y = pixel(row, y);
        let d = (x * x + y * y + 4.0).sqrt();
        let cosine = 2.0 / d;
        let [low, high] = [45.0f64, 40.0].map(|angle| angle.to_radians().cos());
        let t = ((cosine - low) / (high - low)).clamp(0.0, 1.0);
        sum += 0.6 / PI * 3.0 * cosine / (d * d) * t * t * (3.0 - 2.0 * t);
        count += 1.0;
    }
    sum / count
}

#[test]
fn edges_of_the_picture_lie_where_light_takes_them() {
    let folder = tempfile::tempdir().unwrap();
    checker(folder.path());
    // Slanted parallel light, its picture centred on a point before the wall: x' = x + z there.
    let light = "[[light]]\nkind = 'directional'\ndirection = [1, 0, -1]\nirradiance = [1, 1, 1]\n\
                 texture = 'checker.hdr'\ntexture_width = 1.6\ntexture_center = [-0.5, 0, 0.5]\n";
    let picture = drawn(folder.path(), &(light.to_owned() + &wall(1.0)), &[]);
    let seen = picture.channel("R");
    // Across the light the wall is foreshortened by √½: squares are .4·√2 wide on it, .4 high; the third row from the top is 0 to -.4.
    let row: Vec<f64> = window(&seen, SIZE, 0..SIZE, 27..28);
    let lit = 0.5f64.sqrt() / PI;
    let crossings: Vec<f64> = (1..row.len())
        .filter(|k| (row[k - 1] < 0.5 * lit) != (row[*k] < 0.5 * lit))
        .map(|k| {
            let share = (0.5 * lit - row[k - 1]) / (row[k] - row[k - 1]);
            -1.2 + 2.4 * (k as f64 - 0.5 + share) / f64::from(SIZE)
        })
        .collect();
    // The picture spans -1.13 to 1.13: dark, bright, dark, bright and the frame.
    let square = 0.4 * 2f64.sqrt();
    let expected = [-square, 0.0, square, 2.0 * square];
    assert_eq!(crossings.len(), expected.len(), "{crossings:?}");
    for (found, expected) in crossings.iter().zip(expected) {
        // Half a spacing of the wall's splats, which are lit at their centres.
        assert!((found - expected).abs() < 0.02, "{crossings:?}, expected {expected}");
    }
}

#[test]
fn a_white_picture_is_none_bit_for_bit() {
    let folder = tempfile::tempdir().unwrap();
    white(folder.path());
    let fog = "[[object]]\nname = 'fog'\nmedium_box = { min = [-0.8, -0.5, 0.2], max = [0.7, 0.6, 0.9], extinction = 1.5, spacing = 0.15 }\n";
    for technique in TECHNIQUES.iter().filter(|t| **t != "surfels") {
        for slicing in ["view", "half_vector"] {
            if slicing == "half_vector" && *technique != "sheets" {
                continue;
            }
            let slicing = format!("render.sheets.slicing='{slicing}'");
            let arguments = [
                "--technique",
                technique,
                "--layers",
                "effects",
                "--set",
                &slicing,
                "--set",
                "render.particles.repeat_level=4",
            ];
            let by = |spot_keys: &str, sun_keys: &str| {
                drawn(folder.path(), &(spot(spot_keys) + &sun(sun_keys) + &wall(0.5) + fog), &arguments)
            };
            let through = by("texture = 'white.hdr'", "texture = 'white.hdr'\ntexture_width = 9");
            assert_eq!(through, by("", ""), "{technique}, {slicing}");
        }
    }
}

#[test]
fn a_picture_lets_through_what_its_mean_is_of_white() {
    let folder = tempfile::tempdir().unwrap();
    // The border is dark: none of it falls beside the wall.
    let texel = |x: u32, y: u32| {
        let is_inside = (1..23).contains(&x) && (1..23).contains(&y);
        let noise = (x * 37 + y * 101 + x * y * 13) % 128;
        if is_inside { [noise as u8, 64, (127 - noise) as u8, 129] } else { [0; 4] }
    };
    std::fs::write(folder.path().join("noise.hdr"), hdr([24, 24], texel)).unwrap();
    let texels = || (0..24 * 24).map(|k| texel(k % 24, k / 24));
    for technique in ["points", "sheets", "reference"] {
        let sum = |picture: &str, channel: &str| {
            let keys = format!("texture = '{picture}'\ntexture_width = 2");
            let picture = drawn(folder.path(), &(sun(&keys) + &wall(0.5)), &["--technique", technique]);
            picture.channel(channel).iter().sum::<f64>()
        };
        for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
            let mean = texels().map(|t| f64::from(t[c]) / 128.0).sum::<f64>() / (24.0 * 24.0);
            // A picture 2 wide is 40 pixels wide; without it the wall shows ½/π of the light.
            let expected = mean * 40.0 * 40.0 * 0.5 / PI;
            let found = sum("noise.hdr", channel);
            assert!((found / expected - 1.0).abs() < 0.005, "{technique}, {channel}: {found}, expected {expected}");
        }
    }
}

#[test]
fn fog_that_half_vectors_light_shows_the_picture_inside() {
    let folder = tempfile::tempdir().unwrap();
    checker(folder.path());
    let fog = "[[object]]\nname = 'fog'\nmedium_box = { min = [-2, -2, -0.5], max = [2, 2, 0.5], extinction = 1, spacing = 0.1 }\n\
               [render.sheets]\ntransmittance_cutoff = 0\n";
    let scene = sun("texture = 'checker.hdr'\ntexture_width = 2.4") + fog;
    let arguments = ["--technique", "sheets", "--set", "render.sheets.slicing='half_vector'"];
    let seen = drawn(folder.path(), &scene, &arguments).channel("R");
    // What comes in is scattered and goes out: ∫ e^(−2t)/4π dt.
    let bright = 0.25 / PI * 0.5 * -(-2.0f64).exp_m1();
    for square in squares() {
        let expected = if is_bright(square) { bright } else { 0.0 };
        let pixels = inside(&seen, square);
        assert!(
            pixels.iter().all(|v| (v - expected).abs() < 1e-3 * bright),
            "{square:?}: {pixels:?}, expected {expected}"
        );
    }
}

#[test]
fn the_path_tracer_has_the_same_light() {
    let folder = tempfile::tempdir().unwrap();
    checker(folder.path());
    let fog = "[[object]]\nname = 'fog'\nmedium_box = { min = [-1, -1, 0.1], max = [1, 1, 0.7], extinction = 0.8, spacing = 0.1 }\n";
    let spot = spot("texture = 'checker.hdr'\ntexture_up = [1, 1, 0]\ntexture_angle = 70");
    // Splats of a sixth of a pixel: what is left of their blur at the edges of squares is little.
    let points = "[render]\ntechnique = 'points'\n";
    let text = parallel_view(2.0, 16) + points + &spot + fog + &wall(1.0).replace("0.04", "0.02");
    let path = folder.path().join("scene.toml");
    std::fs::write(&path, text).unwrap();
    let scene = organza::scene::load(&path, &Default::default()).unwrap();
    let options = organza::RenderOptions::default();
    let progress = organza::Progress::new();
    let layers = organza::render(&scene, &options, &progress).unwrap().layers;
    let orders = organza_judge::truth::Orders::shown_by(&scene);
    let truth = organza_judge::truth::truth(&scene, &options, orders, 600, &progress).unwrap().unwrap();
    let beauty = layers.rgb("beauty").unwrap();
    let mean = truth.image.pixels().iter().map(|p| p[0]).sum::<f64>() / 256.0;
    let squares: f64 = beauty.iter().zip(truth.image.pixels()).map(|(a, b)| (f64::from(a[0]) - b[0]).powi(2)).sum();
    let rmse = (squares / 256.0).sqrt();
    // The limit of techniques against truth: some pixels lie on edges, which splats blur.
    assert!(rmse < 0.1 * mean, "{rmse}, mean {mean}");
}

#[test]
fn pictures_that_are_none_or_lie_nowhere_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    checker(folder.path());
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    write("mesh.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n");
    write("broken.png", b"\x89PNG\r\n\x1a\nnothing");
    let run = |light: &str, more: &[&str]| {
        write("scene.toml", (parallel_view(2.0, 8) + light + &wall(1.0)).as_bytes());
        let command = [&["render", "scene.toml", "-o", "out.exr"][..], more].concat();
        let out = organza().args(command).current_dir(&folder).output().unwrap();
        assert!(!folder.path().join("out.exr").exists(), "{light}");
        (out.status.code().unwrap(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let point = "[[light]]\nkind = 'point'\nposition = [0, 0, 2]\nintensity = [1, 1, 1]\ntexture = 'checker.hdr'\n";
    for (light, code, words) in [
        (spot("texture = 'none.png'"), 4, "none.png"),
        (spot("texture = '../../../outside.png'"), 3, "lies outside the scene's root folder"),
        (spot("texture = 'mesh.ply'"), 3, "mesh.ply: expected an image of radiance"),
        (spot("texture = 'broken.png'"), 3, "broken.png: expected a complete PNG image"),
        (
            spot("texture = 'checker.hdr'\ntexture_angle = 180"),
            3,
            "`texture_angle`: expected degrees between 0 and 180",
        ),
        (spot("texture = 'checker.hdr'\ntexture_angle = nan"), 3, "expected a finite number, found nan"),
        (
            spot("texture = 'checker.hdr'\ntexture_up = [0, 0, 3]"),
            3,
            "`texture_up`: expected a direction that is not along the light",
        ),
        (spot("texture_up = [0, 1, 0]"), 3, "`texture_up` belongs to a `texture`"),
        (sun("texture = 'checker.hdr'"), 3, "expected a key `texture_width`"),
        (sun("texture = 'checker.hdr'\ntexture_width = 0"), 3, "`texture_width`"),
        (sun("texture_center = [0, 0, 0]"), 3, "`texture_center` belongs to a `texture`"),
        (point.to_owned(), 3, "texture"),
    ] {
        let (found, text) = run(&light, &[]);
        assert_eq!(found, code, "{light}: {text}");
        assert!(text.contains(words), "{light}: {text}");
    }
    // It takes 12 MB itself, and with what is made of it 28.
    write("large.hdr", &hdr([1024, 1024], |_, _| [128; 4]));
    let (code, text) = run(&spot("texture = 'large.hdr'"), &["--max-memory", "20M"]);
    assert!(code == 5 && text.contains("large.hdr as the texture of a light"), "{text}");
}
