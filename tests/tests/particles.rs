//! The technique `particles` through the whole command: the picture of `points` but for noise that its standard error states.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use organza_tests::{Picture, draw, organza, parallel_view};

const SIZE: u32 = 48;

/// A ball of fog and a translucent plane that cuts it, before a wall, with a light whose shadows fall on all three.
fn scene(order: [usize; 3]) -> String {
    let objects = [
        "[[object]]\nname = 'fog'\nmaterial = 'fog'\n\
         medium_ball = { center = [0, 0.1, 0], radius = 0.6, extinction = 2.0, spacing = 0.05 }\n",
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
    let (levels, seed) = (format!("render.particles.repeat_level={levels}"), seed.to_string());
    draw(scene, &["--technique", "particles", "--set", &levels, "--seed", &seed, "--layers", layers])
}

fn luminance(picture: &Picture) -> Vec<f64> {
    let [r, g, b] = ["R", "G", "B"].map(|c| picture.channel(c));
    (0..r.len()).map(|k| 0.2126 * r[k] + 0.7152 * g[k] + 0.0722 * b[k]).collect()
}

#[test]
fn particles_differ_from_points_by_their_standard_error() {
    let text = scene([0, 1, 2]);
    let exact = luminance(&draw(&text, &["--set", "render.points.exact=true"]));
    let picture = particles(&text, 400, 1, "std_error");
    let (found, error) = (luminance(&picture), picture.channel("std_error.A"));
    let noisy: Vec<usize> = (0..found.len()).filter(|&k| error[k] > 1e-6).collect();
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
        let effects = ["background", "ambient", "emission", "direct"].map(|e| picture.channel(&format!("{e}.{c}")));
        for (k, beauty) in picture.channel(c).iter().enumerate() {
            let sum: f64 = effects.iter().map(|e| e[k]).sum();
            assert!((sum - beauty).abs() < 1e-5, "pixel {k}, {c}: {sum} and {beauty}");
        }
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
    let (ea, eb) = (a.channel("std_error.A"), b.channel("std_error.A"));
    let (la, lb) = (luminance(&a), luminance(&b));
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
    refused(&text, &["--layers", "depth"], "has no layer `depth.first`");
    refused(&text, &["--set", "render.particles.repeat_level=0"], "repeat_level");
    let coloured = text.replace("shading = 'phase'", "shading = 'phase'\nextinction_rgb = [1, 2, 3]");
    refused(&coloured, &[], "particles hide all colours alike");
}

#[test]
fn bs09_an_empty_scene_is_the_background_and_opaque_things_have_no_noise() {
    let empty = parallel_view(2.0, 8) + "[background]\ncolor = [0.25, 0.5, 1.5]\n";
    let picture = particles(&empty, 4, 1, "std_error");
    for (channel, value) in [("R", 0.25), ("G", 0.5), ("B", 1.5), ("A", 0.0), ("std_error.A", 0.0)] {
        assert!(picture.channel(channel).iter().all(|v| *v == value), "{channel}");
    }
    let wall = scene([2, 2, 2]).replacen("'wall'", "'a'", 1).replacen("'wall'", "'b'", 1);
    let (solid, points) = (draw(&wall, &["--technique", "particles"]), draw(&wall, &[]));
    // Nobody asked for the error.
    assert_eq!(solid.names(), ["A", "B", "G", "R"]);
    assert_eq!(solid, points);
}
