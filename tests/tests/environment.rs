//! Environments: seen behind everything by every technique as a colour is, where they lie, and by the path tracer alike.

use glam::DVec3;
use organza_tests::{Picture, draw_in, hdr, largest_difference, organza};
use splat_core::{Camera, Environment, Projection, RadianceImage};
use std::path::Path;

const TECHNIQUES: [&str; 5] = ["points", "particles", "sheets", "surfels", "reference"];

/// A translucent pane and an opaque wall, which leave some of the background free.
const OBJECTS: &str = r#"
[[light]]
kind = "point"
position = [2, 4, 3]
intensity = [20, 20, 20]
[[object]]
name = "pane"
rectangle = { center = [0.2, 0, 0.3], u = [0.7, 0, 0.2], v = [0, 0.6, 0], spacing = 0.1 }
opacity = 0.4
[[object]]
name = "wall"
rectangle = { center = [-0.6, 0, -1], u = [0.5, 0, 0], v = [0, 0.5, 0], spacing = 0.1 }
opacity = 1
"#;

fn scene(background: &str, more: &str) -> String {
    format!(
        "version = 1\n[camera]\nposition = [0.3, 0.2, 4]\ntarget = [0, 0, 0]\nsize = [24, 18]\n\
         [background]\n{background}\n{more}"
    )
}

fn drawn(folder: &Path, background: &str, more: &str, arguments: &[&str]) -> Picture {
    draw_in(folder, &scene(background, more), &[&["--force"], arguments].concat())
}

#[test]
fn db15_a_constant_map_is_that_colour_bit_for_bit_in_every_technique() {
    let folder = tempfile::tempdir().unwrap();
    // 0.5, 0.25 and 1.25.
    std::fs::write(folder.path().join("constant.hdr"), hdr([16, 8], |_, _| [64, 32, 160, 129])).unwrap();
    for technique in TECHNIQUES {
        let arguments =
            ["--technique", technique, "--layers", "effects,object", "--set", "render.particles.repeat_level=20"];
        let by = |background: &str| drawn(folder.path(), background, OBJECTS, &arguments);
        let color = by("color = [0.5, 0.25, 1.25]");
        let map = by("environment = 'constant.hdr'\nrotate = 77");
        assert_eq!(map, color, "{technique}");
        assert!(map.opacity().contains(&0.0) && map.channel("background.B").contains(&1.25), "{technique}");
    }
    let error = ["--technique", "particles", "--layers", "std_error", "--set", "render.particles.target_error=0.05"];
    let by = |background: &str| drawn(folder.path(), background, OBJECTS, &error);
    assert_eq!(by("environment = 'constant.hdr'"), by("color = [0.5, 0.25, 1.25]"));
}

#[test]
fn ou10_lights_alone_and_objects_without_a_point_leave_the_background_as_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let empty =
        "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\nend_header\n";
    std::fs::write(folder.path().join("empty.ply"), empty).unwrap();
    let lamp = "[[light]]\nkind = 'point'\nposition = [2, 4, 3]\nintensity = [20, 20, 20]\n";
    let points = format!("{lamp}[[object]]\nname = 'nothing'\npoints = 'empty.ply'\n");
    for technique in TECHNIQUES {
        for objects in ["", lamp, &points] {
            let picture = drawn(folder.path(), "color = [0.5, 0.25, 1.25]", objects, &["--technique", technique]);
            for (channel, expected) in [("R", 0.5), ("G", 0.25), ("B", 1.25), ("opacity.A", 0.0)] {
                assert_eq!(picture.channel(channel), vec![expected; 24 * 18], "{technique}: {channel}, {objects}");
            }
        }
    }
}

/// An image with a colour for every direction, and its file.
fn varied(folder: &Path) -> RadianceImage {
    let size = [32, 16];
    let pixel = |x: u32, y: u32| [7 * x as u8 + 20, 15 * y as u8, if x.is_multiple_of(5) { 250 } else { 90 }, 129];
    std::fs::write(folder.join("varied.hdr"), hdr(size, pixel)).unwrap();
    let radiance =
        |k: u32| pixel(k % size[0], k / size[0])[..3].iter().map(|m| f32::from(*m) / 128.0).collect::<Vec<_>>();
    let pixels = (0..size[0] * size[1]).map(|k| radiance(k).try_into().unwrap()).collect();
    RadianceImage { size, pixels }
}

#[test]
fn each_pixel_sees_its_own_direction_with_its_footprint() {
    let folder = tempfile::tempdir().unwrap();
    let image = varied(folder.path());
    let keys = "environment = 'varied.hdr'\nrotate = 40\nscale = 1.5";
    let picture = drawn(folder.path(), keys, "", &["--set", "render.antialias=1"]);
    let sky = Environment::new(&image, 40.0 / 360.0, 1.5).unwrap();
    let projection = Projection::Perspective { fov_y: 35f64.to_radians() };
    let camera = Camera::look_at(DVec3::new(0.3, 0.2, 4.0), DVec3::ZERO, DVec3::Y, projection, [24, 18]).unwrap();
    for (c, channel) in ["R", "G", "B"].into_iter().enumerate() {
        let seen = |k: u32| {
            let (direction, solid_angle) = camera.direction(f64::from(k % 24) + 0.5, f64::from(k / 24) + 0.5);
            f64::from(sky.radiance(direction, solid_angle)[c])
        };
        let exact: Vec<f64> = (0..24 * 18).map(seen).collect();
        let off = largest_difference(&picture.channel(channel), &exact);
        assert!(off < 1e-6, "{channel}: {off:e}");
    }
    assert!(picture.opacity().iter().all(|a| *a == 0.0));
}

#[test]
fn db15_whole_turns_give_the_same_bits_and_the_seam_is_not_seen() {
    let folder = tempfile::tempdir().unwrap();
    varied(folder.path());
    let by =
        |rotate: f64| drawn(folder.path(), &format!("environment = 'varied.hdr'\nrotate = {rotate:?}"), OBJECTS, &[]);
    assert_eq!(by(360.0), by(0.0));
    assert_eq!(by(-11.25), by(348.75));
    assert_ne!(by(11.25), by(0.0));
}

#[test]
fn the_path_tracer_sees_the_same_environment_and_it_lights_nothing() {
    let folder = tempfile::tempdir().unwrap();
    // A smooth map, for the path tracer takes texels as they are.
    let smooth = |x: u32, y: u32| {
        let wave = (std::f64::consts::TAU * f64::from(x) / 256.0).cos();
        [(128.0 + 90.0 * wave) as u8, (255.0 * f64::from(y) / 128.0) as u8, 100, 129]
    };
    std::fs::write(folder.path().join("smooth.hdr"), hdr([256, 128], smooth)).unwrap();
    let text = scene("environment = 'smooth.hdr'\nrotate = 100\nscale = 1.25", OBJECTS);
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let scene = organza::scene::load(&folder.path().join("scene.toml"), &Default::default()).unwrap();
    let options = organza::RenderOptions::default();
    let progress = organza::Progress::new();
    let layers = organza::render(&scene, &options, &progress).unwrap().layers;
    let orders = organza_judge::truth::Orders::shown_by(&scene);
    let truth = organza_judge::truth::truth(&scene, &options, orders, 400, &progress).unwrap().unwrap();
    let mean = |pixels: &mut dyn Iterator<Item = [f64; 3]>| pixels.flatten().sum::<f64>() / (24.0 * 18.0 * 3.0);
    let beauty = layers.rgb("beauty").unwrap();
    let seen = mean(&mut beauty.iter().map(|p| p.map(f64::from)));
    let traced = mean(&mut truth.image.pixels().iter().copied());
    assert!((seen / traced - 1.0).abs() < 0.02, "{seen} {traced}");
    // Away from the objects, whose borders splats widen a little, both see the sky.
    let alpha = layers.scalar("alpha").unwrap();
    let around = |k: usize| {
        (0..9)
            .map(move |n| (k % 24 + n % 3, k / 24 + n / 3))
            .filter(|(x, y)| (1..25).contains(x) && (1..19).contains(y))
    };
    let free: Vec<usize> =
        (0..24 * 18).filter(|k| around(*k).all(|(x, y)| alpha[(y - 1) * 24 + x - 1] == 0.0)).collect();
    assert!(free.len() > 100);
    for k in free {
        for c in 0..3 {
            let a = f64::from(beauty[k][c]);
            let b = truth.image.pixels()[k][c];
            assert!((a - b).abs() < 0.02, "pixel {k}: {a} {b}");
        }
    }
}

#[test]
fn bi36_environments_that_are_none_are_refused_by_the_command() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, bytes: &[u8]| std::fs::write(folder.path().join(name), bytes).unwrap();
    let good = hdr([8, 4], |x, _| [x as u8 + 9, 1, 1, 128]);
    write("truncated.hdr", &good[..good.len() - 3]);
    write("longer.hdr", &[&good[..], b"x"].concat());
    write("mesh.hdr", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n0 0 0\n");
    write("infinite.hdr", &hdr([8, 4], |_, _| [255; 4]));
    let run = |keys: &str| {
        write("scene.toml", scene(keys, "").as_bytes());
        let out = organza().args(["render", "scene.toml", "-o", "out.exr"]).current_dir(&folder).output().unwrap();
        assert!(!folder.path().join("out.exr").exists());
        (out.status.code().unwrap(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    for (keys, code, words) in [
        ("environment = 'none.hdr'", 4, "none.hdr"),
        ("environment = 'truncated.hdr'", 3, "truncated.hdr@"),
        ("environment = 'longer.hdr'", 3, "expected the end of the file after 4 scanlines, found 1 bytes more"),
        ("environment = 'mesh.hdr'", 3, "mesh.hdr: expected an image of radiance"),
        ("environment = 'infinite.hdr'\nscale = 3", 3, "infinite.hdr: environment 0: scale is 3.0"),
    ] {
        let (found, text) = run(keys);
        assert_eq!(found, code, "{text}");
        assert!(text.contains(words), "{keys}: {text}");
    }
    write("good.hdr", &good);
    write("scene.toml", (scene("color = [0, 0, 0]", "") + "[[object]]\nname = 'a'\nmesh = 'good.hdr'\n").as_bytes());
    let out = organza().args(["render", "scene.toml", "-o", "out.exr"]).current_dir(&folder).output().unwrap();
    assert!(String::from_utf8_lossy(&out.stderr).contains("good.hdr: expected a mesh with faces"));
    let out = organza().args(["info", "good.hdr"]).current_dir(&folder).output().unwrap();
    assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
}
