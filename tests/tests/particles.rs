//! The technique `particles` through the whole command: the picture of `points` but for noise that its standard error states.

use organza_tests::{Picture, draw, draw_in, largest_difference, organza, parallel_view, sum_of_effects};

const SIZE: u32 = 48;

/// A ball of fog and a translucent plane that cuts it, before a wall, with a light whose shadows fall on all three.
fn scene(order: [usize; 3]) -> String {
    let objects = [
        "[[object]]\nname = 'fog'\nmaterial = 'fog'\n\
         medium_ball = { center = [0, 0.1, 0], radius = 0.6, extinction = 2.0, spacing = 0.025 }\n",
        "[[object]]\nname = 'plane'\nmaterial = 'glass'\n\
         rectangle = { center = [0, 0, 0], u = [0.8, 0, 0.6], v = [0, 0.8, 0], spacing = 0.03 }\n",
        "[[object]]\nname = 'wall'\n\
         rectangle = { center = [0, 0, -1], u = [1.5, 0, 0], v = [0, 0.6, 0], spacing = 0.04 }\n",
    ];
    parallel_view(2.0, SIZE)
        + "[ambient]\ncolor = [0.1, 0.1, 0.1]\n[background]\ncolor = [0.1, 0.2, 0.4]\n\
           [material.fog]\nshading = 'phase'\n[material.glass]\ncolor = [0.9, 0.4, 0.2]\nopacity = 0.4\n\
           [[light]]\nkind = 'directional'\ndirection = [0.5, -1, -1]\nirradiance = [2, 2, 2]\n"
        + &order.map(|i| objects[i]).concat()
}

fn particles(scene: &str, levels: u32, seed: u32, layers: &str) -> Picture {
    let levels = format!("render.particles.repeat_level={levels}");
    let seed = seed.to_string();
    draw(scene, &["--technique", "particles", "--set", &levels, "--seed", &seed, "--layers", layers])
}

fn luminance(picture: &Picture) -> Vec<f64> {
    let [r, g, b] = ["R", "G", "B"].map(|c| picture.channel(c));
    (0..r.len()).map(|k| 0.2126 * r[k] + 0.7152 * g[k] + 0.0722 * b[k]).collect()
}

/// Pixels with noise around which the exact picture hardly changes: splats blur the borders of what particles draw sharp.
fn smooth_and_noisy(exact: &[f64], error: &[f64]) -> Vec<usize> {
    let n = SIZE as usize;
    let calm = |k: &usize| {
        let around = [(0, 1), (2, 1), (1, 0), (1, 2), (0, 0), (2, 2), (0, 2), (2, 0)];
        let x = k % n;
        let y = k / n;
        let inside = x > 0 && y > 0 && x + 1 < n && y + 1 < n;
        let mean = || around.iter().map(|(i, j)| exact[(y + j - 1) * n + x + i - 1]).sum::<f64>() / 8.0;
        inside && (mean() - exact[*k]).abs() < CALM
    };
    (0..exact.len()).filter(|&k| error[k] > 3e-4).filter(calm).collect()
}

/// What blurring over one pixel may change where there is no border.
const CALM: f64 = 0.002;

#[test]
fn particles_differ_from_points_by_their_standard_error() {
    let text = scene([0, 1, 2]);
    let exact = luminance(&draw(&text, &["--technique", "points", "--set", "render.points.exact=true"]));
    let picture = particles(&text, 400, 1, "std_error");
    let found = luminance(&picture);
    let error = picture.channel("std_error.A");
    let noisy = smooth_and_noisy(&exact, &error);
    assert!(noisy.len() > 300, "{} pixels with particles", noisy.len());
    // What points composite by splat centres, particles mix by depth, so pixels at the cut may differ by more than noise.
    let z = |k: &usize| (found[*k] - exact[*k]) / error[*k];
    let mean_square = noisy.iter().map(|k| z(k).powi(2)).sum::<f64>() / noisy.len() as f64;
    let mean = noisy.iter().map(|&k| found[k] - exact[k]).sum::<f64>() / noisy.len() as f64;
    println!("mean z² {mean_square:.3}, mean difference {mean:.6}");
    assert!(mean_square < 2.0, "mean z² {mean_square}");
    assert!(mean.abs() < 2e-3, "mean difference {mean}");
    // Where no particle came in 1600 sets, there is hardly anything to see.
    let quiet = (0..found.len()).filter(|&k| error[k] == 0.0).map(|k| (found[k] - exact[k]).abs());
    assert!(quiet.fold(0.0, f64::max) < 3e-3);
    // Half of the light would be noticed.
    let planted = noisy.iter().map(|&k| ((0.9 * found[k] - exact[k]) / error[k]).powi(2)).sum::<f64>();
    assert!(planted / noisy.len() as f64 > 2.0);
}

/// Objects that particles sample from their own data, each before a light whose shadow falls on all.
const OWN: [(&str, &str, &str); 13] = [
    ("lattice lines", "a", "isosurface = { volume = 'hill.nrrd', level = 0.4 }\nspacing = 0.02"),
    (
        "lattice lines",
        "a",
        "isosurface = { volume = 'hill.nrrd', level = 0.4, interpolation = 'catmull-rom' }\nspacing = 0.02",
    ),
    ("lines", "a", "level_set = { points = 'ball.xyz' }\nspacing = 0.02"),
    (
        "triangles",
        "d",
        "slice = { volume = 'hill.nrrd', center = [0, 0, 0], normal = [1, 1, 3] }\nspacing = 0.02\n\
         transfer = [{ value = 0, color = [1, 0, 0] }, { value = 0.5, color = [0, 1, 0] }, { value = 1, color = [0, 0, 1] }]",
    ),
    (
        "lines",
        "a",
        "implicit = { expression = 'x^2 + y^2 + z^2 - 0.36', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.02 }\n\
         clip = [{ normal = [0, 1, 1], point = [0, 0, 0.1] }, { box = [[-0.4, -1, -1], [0.4, 1, 1]] }]",
    ),
    (
        "lines",
        "a",
        "implicit = { expression = 'max(x^2 + y^2 + z^2 - 0.36, -(x + z))', \
         box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.01 }",
    ),
    (
        "lines",
        "a",
        "implicit = { expression = 'x^2 + y^2 + z^2 - 0.36', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.02 }",
    ),
    ("triangles", "a", "rectangle = { center = [0, 0, 0], u = [0.7, 0, 0.4], v = [0, 0.7, 0], spacing = 0.02 }"),
    ("triangles", "b", "mesh = 'tetrahedron.obj'\nspacing = 0.02"),
    (
        "cells",
        "c",
        "volume = 'hill.nrrd'\ntransfer = [{ value = 0, color = [1, 0.2, 0.1], extinction = 0 }, \
                   { value = 1, color = [0.2, 0.9, 0.3], extinction = 4 }]",
    ),
    (
        "field",
        "c",
        "density = { expression = 'max(0, 1 - 2*(x^2 + y^2 + z^2))', box = [[-0.8, -0.8, -0.8], [0.8, 0.8, 0.8]], \
                   spacing = 0.025, extinction = 4 }",
    ),
    (
        "cells",
        "c",
        "cloud = { ellipsoids = [{ center = [0, 0, 0], radii = [0.7, 0.5, 0.5] }], spacing = 0.03, extinction = 3 }",
    ),
    ("field", "c", "medium_box = { min = [-0.5, -0.5, -0.3], max = [0.5, 0.5, 0.3], extinction = 2, spacing = 0.025 }"),
];

fn native(object: &str, head: &str) -> String {
    parallel_view(2.0, SIZE)
        + "[ambient]\ncolor = [0.1, 0.1, 0.1]\n[background]\ncolor = [0.1, 0.2, 0.4]\n\
           [material.a]\ncolor = [0.9, 0.4, 0.2]\nopacity = 0.6\nspecular = 0.2\n\
           [material.b]\nopacity = 0.5\nsurface_opacity = 'thin_slab'\n[material.c]\nshading = 'phase'\n[material.d]\nshading = 'unlit'\nopacity = 0.7\n\
           [[light]]\nkind = 'directional'\ndirection = [0.5, -1, -1]\nirradiance = [2, 2, 2]\n"
        + head
        + "[[object]]\nname = 'it'\ntransform = { scale = 1.1, rotate = [10, 20, 5], translate = [0.05, -0.04, 0.1] }\n"
        + object
        + "\n"
}

/// A tetrahedron, a smooth hill of values, and points of a ball with normals.
fn data() -> tempfile::TempDir {
    let folder = tempfile::tempdir().unwrap();
    // Each face has corners of its own, so that its normal is that of its plane.
    let corners = ["0.6 0.6 0.6", "-0.6 -0.6 0.6", "-0.6 0.6 -0.6", "0.6 -0.6 -0.6"];
    let faces = [[0, 1, 2], [0, 3, 1], [0, 2, 3], [1, 3, 2]];
    let mut mesh: String = faces.iter().flatten().map(|c: &usize| format!("v {}\n", corners[*c])).collect();
    (0..4).for_each(|f| mesh += &format!("f {} {} {}\n", 3 * f + 1, 3 * f + 2, 3 * f + 3));
    std::fs::write(folder.path().join("tetrahedron.obj"), mesh).unwrap();
    let turn = |i: i32| {
        let y = 1.0 - 2.0 * (f64::from(i) + 0.5) / 3000.0;
        let a = f64::from(i) * 2.399_963;
        let n = [a.cos() * (1.0 - y * y).sqrt(), y, a.sin() * (1.0 - y * y).sqrt()];
        format!("{} {} {} {} {} {}\n", 0.6 * n[0], 0.6 * n[1], 0.6 * n[2], n[0], n[1], n[2])
    };
    let ball = "x y z nx ny nz\n".to_owned() + &(0..3000).map(turn).collect::<String>();
    std::fs::write(folder.path().join("ball.xyz"), ball).unwrap();
    const N: i32 = 41;
    let mut bytes = format!(
        "NRRD0004\ntype: float\ndimension: 3\nsizes: {N} {N} {N}\nendian: little\nencoding: raw\n\
         space dimension: 3\nspace directions: (0.04,0,0) (0,0.04,0) (0,0,0.04)\nspace origin: (-0.8,-0.8,-0.8)\n\n"
    )
    .into_bytes();
    for i in 0..N * N * N {
        let at = |k: i32| f64::from(k) * 0.04 - 0.8;
        let r2 = at(i % N).powi(2) + at(i / N % N).powi(2) + at(i / (N * N)).powi(2);
        bytes.extend(((1.0 - 2.0 * r2).max(0.0) as f32).to_le_bytes());
    }
    std::fs::write(folder.path().join("hill.nrrd"), bytes).unwrap();
    folder
}

/// Luminance and its standard error, of so many sets by a sampler.
fn sampled(folder: &std::path::Path, object: &str, sets: u32, by: &str) -> [Vec<f64>; 2] {
    let text = native(object, "") + &format!("[render.particles]\nrepeat_level = {sets}\n{by}\n");
    let picture = draw_in(folder, &text, &["--technique", "particles", "--layers", "std_error"]);
    [luminance(&picture), picture.channel("std_error.A")]
}

/// Pixels in which both have noise, the mean of the squares of their differences in standard errors, and the mean difference.
fn apart([a, of_a]: &[Vec<f64>; 2], [b, of_b]: &[Vec<f64>; 2]) -> [f64; 3] {
    let noisy: Vec<usize> = (0..a.len()).filter(|&k| of_a[k] > 0.0 && of_b[k] > 0.0).collect();
    let n = noisy.len() as f64;
    let square = noisy.iter().map(|&k| (a[k] - b[k]).powi(2) / (of_a[k].powi(2) + of_b[k].powi(2))).sum::<f64>() / n;
    let mean = noisy.iter().map(|&k| a[k] - b[k]).sum::<f64>() / n;
    println!("{n} pixels, mean z² {square:.3}, mean difference {mean:.6}");
    [n, square, mean]
}

#[test]
fn a_volume_is_the_same_cell_by_cell_and_by_metropolis_chains_cut_or_whole() {
    let folder = data();
    let object = "material = 'c'\nvolume = 'hill.nrrd'\ntransfer = [{ value = 0, color = [1, 0.2, 0.1], extinction = 0 }, \
                  { value = 1, color = [0.2, 0.9, 0.3], extinction = 4 }]\n";
    let clip = "clip = [{ normal = [0, 1, 1], point = [0, 0, 0.1] }]\n";
    for (object, more) in [(object.to_owned(), true), (format!("{object}{clip}"), false)] {
        let by = |by: &str| sampled(folder.path(), &object, 48, &format!("volume_sampler = {by}"));
        let cells = by("'cells'");
        let chains = by("'metropolis'");
        let [n, square, mean] = apart(&cells, &chains);
        assert!(n > 300.0 && (0.8..1.2).contains(&square) && mean.abs() < 2e-3, "{n} {square} {mean}");
        // One step from particle to particle takes places twice, and starts of chains are more of it: that is seen.
        if more {
            let [_, square, mean] = apart(&chains, &by("'metropolis'\nmetropolis_stride = 1"));
            assert!(square > 2.0 && mean.abs() > 4e-3, "{square} {mean}");
        }
    }
}

#[test]
fn a_trilinear_isosurface_is_the_same_by_lines_along_its_lattice_and_by_random_ones() {
    let folder = data();
    let object = "material = 'a'\nisosurface = { volume = 'hill.nrrd', level = 0.4 }\nspacing = 0.02\n";
    let by = |by: &str| sampled(folder.path(), object, 144, &format!("surface_sampler = '{by}'"));
    let [n, square, mean] = apart(&by("auto"), &by("lines"));
    assert!(n > 300.0 && (0.8..1.2).contains(&square) && mean.abs() < 2e-3, "{n} {square} {mean}");
    // What is clipped has an end that no lattice knows.
    let clipped = native(&format!("{object}clip = [{{ normal = [0, 1, 1], point = [0, 0, 0.1] }}]\n"), "");
    std::fs::write(folder.path().join("s.toml"), clipped).unwrap();
    let mut command = organza();
    command.args(["explain", "s.toml", "--json", "--technique", "particles"]).current_dir(&folder);
    let plan: serde_json::Value = serde_json::from_slice(&command.output().unwrap().stdout).unwrap();
    assert_eq!(plan["plan"]["samplers"][0]["source"], "lines");
}

#[test]
fn a_trilinear_isosurface_by_marching_cubes_is_the_surface_that_lines_meet() {
    let folder = data();
    let object = "material = 'a'\nisosurface = { volume = 'hill.nrrd', level = 0.4 }\n";
    let by = |by: &str, more: &str| {
        sampled(folder.path(), &format!("{object}{more}"), 24, &format!("surface_sampler = '{by}'"))
    };
    let cubes = by("triangles", "");
    let lines = by("auto", "");
    // Of so few sets the error is itself uncertain: random lines say by how much.
    let [_, expected, _] = apart(&by("lines", ""), &lines);
    let [n, square, mean] = apart(&cubes, &lines);
    assert!(n > 300.0 && (0.85..1.15).contains(&(square / expected)) && mean.abs() < 2e-3, "{n} {square} {mean}");
    // Another level is told apart; with a spacing of its own the surface has another mesh.
    let other = sampled(folder.path(), &object.replace("0.4", "0.45"), 24, "surface_sampler = 'triangles'");
    assert!(apart(&other, &lines)[1] > 2.0);
    assert!(by("triangles", "spacing = 0.0401\n")[0] != cubes[0]);
}

#[test]
fn a_brownian_motion_that_counts_too_much_area_says_so() {
    let said = |expression: &str| {
        let folder = tempfile::tempdir().unwrap();
        let surface =
            format!("implicit = {{ expression = '{expression}', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.05 }}");
        let text = native(&format!("material = 'a'\n{surface}\n"), "shadow = false\n")
            + "[render.particles]\nsurface_sampler = 'brownian'\nrepeat_level = 2\n";
        std::fs::write(folder.path().join("s.toml"), text).unwrap();
        let mut command = organza();
        command.args(["render", "s.toml", "-o", "s.png", "--technique", "particles"]).current_dir(&folder);
        String::from_utf8(command.output().unwrap().stderr).unwrap()
    };
    assert!(!said("x^2 + y^2 + z^2 - 0.36").contains("too dense"));
    // Cut by the box into a lattice of bands with borders.
    let caps = said("x^2 + y^2 + z^2 - 1.6");
    assert!(caps.contains("% of area, and is that much too dense"), "{caps}");
}

#[test]
fn x7_what_is_sampled_from_its_data_becomes_splats_only_for_a_shadow() {
    let folder = data();
    let passes = |text: &str| -> (Vec<String>, serde_json::Value) {
        std::fs::write(folder.path().join("s.toml"), text).unwrap();
        let run = |arguments: &[&str]| {
            let mut command = organza();
            command.args(arguments).args(["--technique", "particles"]).current_dir(&folder);
            let out = command.output().unwrap();
            assert!(out.status.success(), "{}", String::from_utf8_lossy(&out.stderr));
            out.stdout
        };
        let set = "render.particles.repeat_level=2";
        run(&["render", "s.toml", "-o", "s.exr", "--force", "--cost", "cost.json", "--set", set]);
        let cost = std::fs::read(folder.path().join("cost.json")).unwrap();
        let cost: serde_json::Value = serde_json::from_slice(&cost).unwrap();
        let names = cost.as_array().unwrap().iter().map(|s| s["name"].as_str().unwrap().to_owned()).collect();
        (names, serde_json::from_slice(&run(&["explain", "s.toml", "--json"])).unwrap())
    };
    for (sampler, material, object) in OWN {
        // What is done does not depend on how finely.
        let coarse = object.replace("spacing = 0.02", "spacing = 0.06").replace("spacing = 0.01", "spacing = 0.06");
        let object = format!("material = '{material}'\n{coarse}");
        let text = native(&object, "shadow = false\n");
        let (names, plan) = passes(&text);
        let made = |plan: &serde_json::Value| plan["plan"]["samplers"][0]["becomes_splats"].is_string();
        assert_eq!(plan["plan"]["samplers"][0]["source"], sampler, "{object}");
        assert!(!names.contains(&"convert".to_owned()) && !made(&plan), "{names:?} {object}");
        let (names, plan) = passes(&native(&object, ""));
        // What is unlit receives no shadow.
        let shaded = material != "d";
        assert!(names.contains(&"convert".to_owned()) == shaded && made(&plan) == shaded, "{names:?} {object}");
        let (names, _) = passes(&native(&format!("casts_shadow = false\n{object}"), ""));
        assert!(!names.contains(&"convert".to_owned()), "{names:?} {object}");
    }
}

#[test]
fn pb08_doubtful_surfaces_are_reported_and_end() {
    let folder = tempfile::tempdir().unwrap();
    let run = |expression: &str, technique: &str| {
        let text = native(
            &format!(
                "material = 'a'\nimplicit = {{ expression = '{expression}', box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.05 }}"
            ),
            "shadow = false\n",
        );
        std::fs::write(folder.path().join("s.toml"), text).unwrap();
        let mut command = organza();
        let set = ["--set", "render.particles.repeat_level=4"];
        command.args(["render", "s.toml", "-o", "s.exr", "--force", "--technique", technique]).args(set);
        let out = command.current_dir(&folder).output().unwrap();
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    for technique in ["points", "particles"] {
        // Not a number beyond a plane.
        let (code, message) = run("sqrt(x) - 0.5", technique);
        assert!(code == Some(3) && message.contains("object 'it'") && message.contains("NaN"), "{code:?} {message}");
        // Nowhere zero.
        let (code, message) = run("x^2 + 1", technique);
        assert!(code == Some(0) && message.contains("object 'it' has no "), "{code:?} {message}");
        // A cone: no normal at its tip.
        let (code, message) = run("x^2 + y^2 - z^2", technique);
        assert!(code == Some(0) && !message.contains("warning"), "{code:?} {message}");
    }
    // A double root is found by lines; splats know only what changes sign.
    let (code, message) = run("(x^2 + y^2 + z^2 - 0.5)^2", "particles");
    assert!(code == Some(0) && !message.contains("no particles"), "{code:?} {message}");
    let (code, message) = run("(x^2 + y^2 + z^2 - 0.5)^2", "points");
    assert!(code == Some(0) && message.contains("object 'it' has no splats"), "{code:?} {message}");
}

#[test]
fn pb06_the_error_falls_with_the_root_of_the_repeat_level() {
    let text = scene([0, 1, 2]);
    let rms = |levels| {
        let error = particles(&text, levels, 3, "std_error").channel("std_error.A");
        (error.iter().map(|e| e * e).sum::<f64>() / error.len() as f64).sqrt()
    };
    let slope = (rms(512) / rms(32)).log2() / 4.0;
    assert!((slope + 0.5).abs() < 0.03, "slope {slope}");
}

#[test]
fn target_error_stops_when_it_is_reached() {
    let text = scene([0, 1, 2]);
    let rms = |target: &str| {
        let set = format!("render.particles.target_error={target}");
        let arguments = ["--technique", "particles", "--set", "render.particles.repeat_level=4096", "--set", &set];
        let picture = draw(&text, &[&arguments[..], &["--layers", "std_error"]].concat());
        let error = picture.channel("std_error.A");
        (error.iter().map(|e| e * e).sum::<f64>() / error.len() as f64).sqrt()
    };
    let found = rms("0.01");
    assert!(found <= 0.01 && found > 0.006, "{found}");
}

#[test]
fn effects_of_particles_sum_to_beauty() {
    let picture = particles(&scene([0, 1, 2]), 16, 1, "effects");
    for c in ["R", "G", "B"] {
        let largest = largest_difference(&sum_of_effects(&picture, c), &picture.channel(c));
        assert!(largest < 1e-5, "{c}: {largest:e}");
    }
}

#[test]
fn x1_particles_have_one_sha_for_any_threads_and_another_for_another_seed() {
    let text = scene([0, 1, 2]);
    let sha = |threads: &str, seed: &str| {
        draw(&text, &["--technique", "particles", "--threads", threads, "--seed", seed]).sha256(1.0)
    };
    let one = sha("1", "5");
    assert!(["2", "3", "7"].iter().all(|t| sha(t, "5") == one));
    assert_ne!(sha("2", "6"), one);
}

#[test]
fn swapped_objects_change_nothing_beyond_noise() {
    let [a, b] = [[0, 1, 2], [2, 1, 0]].map(|order| particles(&scene(order), 400, 1, "std_error"));
    let ea = a.channel("std_error.A");
    let eb = b.channel("std_error.A");
    let la = luminance(&a);
    let lb = luminance(&b);
    let noisy: Vec<usize> = (0..la.len()).filter(|&k| ea[k] > 1e-6).collect();
    let square = |&k: &usize| (la[k] - lb[k]).powi(2) / (ea[k] * ea[k] + eb[k] * eb[k]);
    let mean = noisy.iter().map(square).sum::<f64>() / noisy.len() as f64;
    assert!(mean < 1.3, "mean z² {mean}");
}

#[test]
fn what_particles_cannot_do_is_said() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |scene: &str, arguments: &[&str], expected: &str| {
        std::fs::write(folder.path().join("s.toml"), scene).unwrap();
        let mut command = organza();
        command.args(["render", "s.toml", "--technique", "particles"]).args(arguments).current_dir(&folder);
        let out = command.output().unwrap();
        let message = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(!out.status.success() && message.contains(expected), "{message}");
    };
    let text = scene([0, 1, 2]);
    refused(&text, &["--set", "render.particles.repeat_level=0"], "repeat_level");
}

#[test]
fn bs09_an_empty_scene_is_the_background_and_opaque_things_have_no_noise() {
    let empty = parallel_view(2.0, 8) + "[background]\ncolor = [0.25, 0.5, 1.5]\n";
    let picture = particles(&empty, 4, 1, "std_error");
    for (channel, value) in [("R", 0.25), ("G", 0.5), ("B", 1.5), ("opacity.A", 0.0), ("std_error.A", 0.0)] {
        assert!(picture.channel(channel).iter().all(|v| *v == value), "{channel}");
    }
    let wall = scene([2, 2, 2]).replacen("'wall'", "'a'", 1).replacen("'wall'", "'b'", 1);
    let solid = draw(&wall, &["--technique", "particles"]);
    let points = draw(&wall, &[]);
    // Nobody asked for the error.
    assert_eq!(solid.names(), ["A", "B", "G", "R", "opacity.A"]);
    assert_eq!(solid, points);
}

/// What takes long and rarely fails where the others hold.
mod deep {
    use super::*;

    #[test]
    fn particles_from_the_data_differ_from_points_by_noise() {
        let folder = data();
        let mut worst = Vec::new();
        for (sampler, material, object) in OWN {
            let (n, square, mean) =
                against_points(folder.path(), &native(&format!("material = '{material}'\n{object}"), ""));
            println!("{sampler}: {n} pixels, mean z² {square:.2}, mean difference {mean:.5}; {object}");
            worst.push((square, mean.abs()));
        }
        assert!(worst.iter().all(|(square, mean)| *square < 2.0 && *mean < 4e-3), "{worst:?}");
    }

    #[test]
    fn every_sampler_of_an_implicit_surface_differs_from_points_by_noise() {
        let object = "material = 'a'\nimplicit = { expression = 'x^2 + y^2 + z^2 - 0.36', \
                      box = [[-1, -1, -1], [1, 1, 1]], spacing = 0.02 }\n";
        // Lines are what it is sampled by above.
        let mut found = Vec::new();
        for by in ["triangles", "brownian"] {
            let folder = tempfile::tempdir().unwrap();
            let text = native(object, "") + &format!("[render.particles]\nsurface_sampler = '{by}'\n");
            let (n, square, mean) = against_points(folder.path(), &text);
            println!("{by}: {n} pixels, mean z² {square:.2}, mean difference {mean:.5}");
            assert!(square < 2.0 && mean.abs() < 4e-3, "{by}: {square} {mean}");
            found.push(mean.to_bits());
        }
        assert_ne!(found[0], found[1], "each has particles of its own");
    }

    /// Number of calm pixels with noise, the mean of z² over them, and the mean difference.
    fn against_points(folder: &std::path::Path, text: &str) -> (usize, f64, f64) {
        let by_points = ["--technique", "points", "--set", "render.points.exact=true"];
        let exact = luminance(&draw_in(folder, text, &by_points));
        let arguments =
            ["--technique", "particles", "--set", "render.particles.repeat_level=144", "--layers", "std_error"];
        let picture = draw_in(folder, text, &arguments);
        let found = luminance(&picture);
        let error = picture.channel("std_error.A");
        let noisy = smooth_and_noisy(&exact, &error);
        assert!(noisy.len() > 80, "{} pixels with particles", noisy.len());
        let mean_square = noisy.iter().map(|&k| ((found[k] - exact[k]) / error[k]).powi(2)).sum::<f64>();
        let mean = noisy.iter().map(|&k| found[k] - exact[k]).sum::<f64>();
        (noisy.len(), mean_square / noisy.len() as f64, mean / noisy.len() as f64)
    }
}
