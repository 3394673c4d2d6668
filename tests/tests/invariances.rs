//! Invariances through the whole command: threads, shuffled input, scale by powers of two, shift by 10⁷, linearity.

use organza_tests::{draw, draw_in, largest_difference, sum_of_effects};
use std::fmt::Write;

/// A scene with everything that the points technique does, all lengths times `scale`, moved by `shift`. Positions are
/// multiples of 1/16, so that a shift by 10⁷ is exact in f64.
fn scene(scale: f64, shift: f64, reversed: bool) -> String {
    let p =
        |x: f64, y: f64, z: f64| format!("[{:?}, {:?}, {:?}]", x * scale + shift, y * scale + shift, z * scale + shift);
    let v = |x: f64, y: f64, z: f64| format!("[{:?}, {:?}, {:?}]", x * scale, y * scale, z * scale);
    let l = |length: f64| format!("{:?}", length * scale);
    let k = |extinction: f64| format!("{:?}", extinction / scale);
    let intensity = |i: f64| format!("[{:?}, {:?}, {:?}]", i * scale * scale, i * scale * scale, i * scale * scale);
    let mut text = format!(
        "version = 1\n[camera]\nposition = {}\ntarget = {}\nfov_y = 35\nsize = [80, 60]\n[render]\nantialias = 2\n\
         layers = ['effects', 'depth', 'shadow']\ntechnique = 'points'\npoints = {{ exact = true }}\n[background]\ncolor = [0.1, 0.2, 0.3]\n\
         [material.tinted]\ncolor = [0.9, 0.4, 0.2]\nopacity = 0.4\nextinction_rgb = [0.5, 1, 1]\n\
         [material.solid]\ncolor = [0.6, 0.7, 0.8]\nspecular = 0.3\n",
        p(0.5, 1.0, 4.0),
        p(0.0, 0.0, 0.0),
    );
    let mut parts = [
        format!("[[light]]\nkind = 'point'\nposition = {}\nintensity = {}\n", p(1.0, 3.0, 2.0), intensity(20.0)),
        format!("[[light]]\nkind = 'point'\nposition = {}\nintensity = {}\n", p(0.5, 0.25, 0.1875), intensity(0.5)),
        format!(
            "[[object]]\nname = 'fog'\nmedium_ball = {{ center = {}, radius = {}, extinction = {}, spacing = {} }}\n",
            p(0.375, 0.3125, 0.125),
            l(0.5),
            k(3.0),
            l(0.07)
        ),
        format!(
            "[[object]]\nname = 'sheet'\nmaterial = 'tinted'\n\
             rectangle = {{ center = {}, u = {}, v = {}, spacing = {} }}\n",
            p(-0.375, 0.1875, 0.0),
            v(0.5, 0.0, 0.4),
            v(0.0, 0.6, 0.1),
            l(0.06)
        ),
        format!(
            "[[object]]\nname = 'ground'\nmaterial = 'solid'\n\
             rectangle = {{ center = {}, u = {}, v = {}, spacing = {} }}\n",
            p(0.0, -0.5, 0.0),
            v(0.0, 0.0, 2.0),
            v(2.0, 0.0, 0.0),
            l(0.08)
        ),
    ];
    if reversed {
        parts.reverse();
    }
    parts.iter().for_each(|part| text.write_str(part).unwrap());
    text
}

#[test]
fn x1_one_sha_for_any_number_of_threads() {
    let run = |threads: &str| draw(&scene(1.0, 0.0, false), &["--threads", threads]).sha256(1.0);
    let one = run("1");
    for threads in ["2", "3", "7"] {
        assert_eq!(run(threads), one, "{threads} threads");
    }
    // The comparison can fail.
    assert_ne!(draw(&scene(1.0, 0.0, false), &["--set", "camera.fov_y=36"]).sha256(1.0), one);
}

#[test]
fn x4_the_order_of_lights_and_objects_does_not_matter() {
    let forward = draw(&scene(1.0, 0.0, false), &[]).sha256(1.0);
    let backward = draw(&scene(1.0, 0.0, true), &[]).sha256(1.0);
    assert_eq!(forward, backward);
}

#[test]
fn x4_the_order_of_a_files_triangles_does_not_matter() {
    // A tent of four triangles over a square, its corners and faces in two orders.
    let corners = ["-1 0 -1", "1 0 -1", "1 0 1", "-1 0 1", "0 0.7 0.1"];
    let file = |order: [usize; 5], faces: [usize; 4]| {
        let vertices = order.map(|corner| format!("v {}\n", corners[corner])).concat();
        let number = |corner: usize| 1 + order.iter().position(|c| *c == corner).unwrap();
        let face = |side: usize| format!("f {} {} {}\n", number(side), number((side + 1) % 4), number(4));
        vertices + &faces.map(face).concat()
    };
    for technique in ["points", "particles", "sheets", "surfels"] {
        let scene = format!(
            "version = 1\n[camera]\nposition = [0.3, 2, 3]\ntarget = [0, 0, 0]\nsize = [40, 30]\n\
             [[light]]\nkind = 'point'\nposition = [1, 3, 2]\nintensity = [9, 9, 9]\n\
             [[object]]\nname = 'tent'\nmesh = 'tent.obj'\nspacing = 0.1\nopacity = 0.5\n\
             [render]\ntechnique = '{technique}'\nantialias = 1\n"
        );
        let bits = |order, faces| {
            let folder = tempfile::tempdir().unwrap();
            std::fs::write(folder.path().join("tent.obj"), file(order, faces)).unwrap();
            draw_in(folder.path(), &scene, &[]).sha256(1.0)
        };
        let listed = bits([0, 1, 2, 3, 4], [0, 1, 2, 3]);
        assert_eq!(bits([4, 2, 0, 3, 1], [2, 0, 3, 1]), listed, "{technique}");
    }
}

#[test]
fn x3_scaling_by_a_power_of_two_gives_the_same_bits() {
    let plain = draw(&scene(1.0, 0.0, false), &[]).sha256(1.0);
    for k in [-40, -10, 10, 40] {
        let scale = f64::from(k).exp2();
        assert_eq!(draw(&scene(scale, 0.0, false), &[]).sha256(scale), plain, "k {k}");
    }
}

#[test]
fn x2_shifting_by_ten_million_changes_nothing_visible() {
    let near = draw(&scene(1.0, 0.0, false), &[]);
    let far = draw(&scene(1.0, 1e7, false), &[]);
    for name in ["R", "G", "B", "A"] {
        let largest = largest_difference(&near.channel(name), &far.channel(name));
        assert!(largest < 1e-4, "{name}: {largest:e}");
    }
}

#[test]
fn x8_light_is_additive_and_layers_sum_to_beauty() {
    let text = scene(1.0, 0.0, false);
    let picture = draw(&text, &[]);
    // Drawn as one colour, which nobody summed.
    let plain = draw(&text.replace("layers = ['effects', 'depth', 'shadow']\n", ""), &[]);
    for c in ["R", "G", "B"] {
        let largest = largest_difference(&sum_of_effects(&picture, c), &plain.channel(c));
        assert!(largest < 1e-5, "channel {c}: {largest:e}");
    }
    let objects = text.find("[[object]]").unwrap();
    let lamps: Vec<&str> = text[..objects].split("[[light]]").collect();
    let [first, second] = [1, 2].map(|k| draw(&format!("{}[[light]]{}{}", lamps[0], lamps[k], &text[objects..]), &[]));
    for effect in ["direct.G", "scatter1.G"] {
        let both: Vec<f64> = first.channel(effect).iter().zip(second.channel(effect)).map(|(a, b)| a + b).collect();
        let brightest = both.iter().copied().fold(0.0, f64::max);
        let largest = largest_difference(&both, &picture.channel(effect));
        assert!(largest <= 1e-6 * brightest, "{effect} of two lights: {largest:e} of {brightest}");
    }
    let brighter = text.replace("20.0, 20.0, 20.0", "40.0, 40.0, 40.0").replace("0.5, 0.5, 0.5", "1.0, 1.0, 1.0");
    let twice: Vec<f64> = picture.channel("direct.G").iter().map(|v| 2.0 * v).collect();
    let brightest = twice.iter().copied().fold(0.0, f64::max);
    let largest = largest_difference(&twice, &draw(&brighter, &[]).channel("direct.G"));
    assert!(largest <= 1e-6 * brightest, "twice the light: {largest:e} of {brightest}");
}

/// A pixel of eight by eight samples is their mean, by points; the picture of eight by eight pixels has the same samples.
#[test]
fn ou1_one_pixel_is_the_mean_of_a_fine_picture() {
    let picture =
        |keys: &str| draw(&scene(1.0, 0.0, false).replace("size = [80, 60]\n[render]\nantialias = 2", keys), &[]);
    let [one, fine] = ["size = [1, 1]\n[render]\nantialias = 8", "size = [8, 8]\n[render]\nantialias = 1"].map(picture);
    for name in ["R", "G", "B", "A"] {
        let one = one.channel(name);
        let fine = fine.channel(name);
        let mean = fine.iter().sum::<f64>() / 64.0;
        assert!(one.len() == 1 && mean > 0.01 && (one[0] / mean - 1.0).abs() < 0.01, "{name}: {one:?}, not {mean}");
    }
}

#[test]
fn x8_two_scenes_apart_add_up() {
    let head = "version = 1\n[camera]\nposition = [0, 0, 4]\ntarget = [0, 0, 0]\nfov_y = 35\nsize = [48, 24]\n[render]\n\
                points = { exact = true }\n[material.red]\nshading = 'unlit'\ncolor = [0.9, 0.2, 0.1]\n\
                [material.blue]\nshading = 'unlit'\ncolor = [0.1, 0.3, 2.0]\n";
    let ball = |material: &str, x: f64| {
        format!(
            "[[object]]\nname = '{material}'\nmaterial = '{material}'\n\
             medium_ball = {{ center = [{x:?}, 0, 0], radius = 0.5, extinction = 2.0, spacing = 0.125 }}\n"
        )
    };
    let [red, blue] = [ball("red", -1.0), ball("blue", 1.0)];
    let [one, other, both] =
        [&red, &blue, &format!("{red}{blue}")].map(|objects| draw(&format!("{head}{objects}"), &[]));
    for name in ["R", "G", "B"] {
        let sum: Vec<f64> = one.channel(name).iter().zip(other.channel(name)).map(|(a, b)| a + b).collect();
        let largest = largest_difference(&sum, &both.channel(name));
        let brightest = sum.iter().copied().fold(0.0, f64::max);
        assert!(brightest > 0.01 && largest <= 1e-6 * brightest, "{name}: {largest:e} of {brightest}");
    }
}

/// The scene, lit by a sun in place of the second lamp.
fn sunny(scale: f64, technique: &str) -> String {
    let text = scene(scale, 0.0, false);
    let begin = text.find("[[light]]").unwrap() + 1;
    let lamp = begin + text[begin..].find("[[light]]").unwrap();
    let end = lamp + text[lamp..].find("[[object]]").unwrap();
    let sun = "[[light]]\nkind = 'directional'\ndirection = [0.2, -1, -0.3]\nirradiance = [2, 2, 2]\n";
    let text = format!("{}{sun}{}", &text[..lamp], &text[end..]);
    text.replace("technique = 'points'\npoints = { exact = true }", technique)
}

#[test]
fn x3_any_unit_of_length_gives_the_same_picture() {
    // Particles lie at places that are rounded to f32, and light is taken where they lie.
    let techniques = [
        ("technique = 'points'\npoints = { exact = true }", 1.5e-5),
        ("technique = 'particles'\nparticles = { repeat_level = 20 }", 1e-4),
    ];
    for (technique, bound) in techniques {
        let plain = draw(&sunny(1.0, technique), &[]);
        for scale in [1.3, 0.7, 0.01] {
            let other = draw(&sunny(scale, technique), &[]);
            for name in ["R", "G", "B", "A"] {
                let largest = largest_difference(&plain.channel(name), &other.channel(name));
                assert!(largest < bound, "{technique}, lengths times {scale}, {name}: {largest:e}");
            }
        }
    }
}

/// The scene after a quarter turn, camera and all: every place and direction is turned.
fn turned(text: &str, turn: fn([f64; 3]) -> [f64; 3]) -> String {
    let text = text.replace("target = [", "up = [0.0, 1.0, 0.0]\ntarget = [");
    let mut parts = text.split('[');
    let mut out = parts.next().unwrap().to_owned();
    for part in parts {
        let key = out.rsplit(['\n', '{', ',']).next().unwrap().trim().trim_end_matches(" =").to_owned();
        if !["position", "target", "up", "center", "u", "v"].contains(&key.as_str()) {
            write!(out, "[{part}").unwrap();
            continue;
        }
        let (numbers, rest) = part.split_once(']').unwrap();
        let vector: Vec<f64> = numbers.split(',').map(|n| n.trim().parse().unwrap()).collect();
        let [x, y, z] = turn(vector.try_into().unwrap());
        write!(out, "[{x:?}, {y:?}, {z:?}]{rest}").unwrap();
    }
    out
}

/// Tables of shadow maps have directions of their own: along the edges of shadows other cells are met.
#[test]
fn x3_a_quarter_turn_changes_next_to_nothing() {
    let text = scene(1.0, 0.0, false);
    let plain = draw(&turned(&text, |v| v), &[]);
    let turns: [fn([f64; 3]) -> [f64; 3]; 3] = [|[x, y, z]| [x, -z, y], |[x, y, z]| [z, y, -x], |[x, y, z]| [-y, x, z]];
    for (turn, axis) in turns.into_iter().zip(["x", "y", "z"]) {
        let other = draw(&turned(&text, turn), &[]);
        let off = |name| {
            let pairs = plain.channel(name).into_iter().zip(other.channel(name)).map(|(a, b)| (a - b).abs());
            pairs.collect::<Vec<_>>()
        };
        let [r, g, b] = ["R", "G", "B"].map(off);
        let seen = (0..r.len()).filter(|k| r[*k].max(g[*k]).max(b[*k]) > 1.0 / 255.0).count();
        let share = seen as f64 / r.len() as f64;
        println!("{axis}: {share:.4}");
        assert!(share < 0.005, "a quarter turn about {axis} changes {:.2} % of the pixels", 100.0 * share);
    }
}
