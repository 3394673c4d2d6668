//! Raw points as a medium through the whole command: the depth of a slab, its shadow, blur that keeps mass, invariances, what is said
//! and what is refused.

use organza_tests::{Picture, draw_in, largest_difference, mean_and_ripple, organza, parallel_view, window};
use splat_core::rng;
use std::fmt::Write as _;
use std::path::Path;

/// Half the width of the slab, and half its depth.
const SLAB: [f64; 2] = [1.4, 0.25];

/// Points of a slab 0.1 apart, times `scale`, each with these further numbers, the last first where `reversed`.
fn slab(head: &str, further: &str, scale: f64, reversed: bool) -> String {
    let mut lines = Vec::new();
    for (i, j, k) in (0..28).flat_map(|i| (0..28).flat_map(move |j| (0..5).map(move |k| (i, j, k)))) {
        let at = |n: i32, half: f64| ((f64::from(n) + 0.5) * 0.1 - half) * scale;
        lines.push(format!("{:?} {:?} {:?} {further}", at(i, SLAB[0]), at(j, SLAB[0]), at(k, SLAB[1])));
    }
    if reversed {
        lines.reverse();
    }
    format!("x y z {head}\n{}\n", lines.join("\n"))
}

fn write(folder: &Path, text: &str) {
    std::fs::write(folder.join("slab.xyz"), text).unwrap();
}

fn scene(keys: &str) -> String {
    format!("{}[[object]]\nname = 'slab'\npoints = 'slab.xyz'\nas = 'medium'\n{keys}\n", parallel_view(2.0, 48))
}

fn alpha(picture: &Picture) -> Vec<f64> {
    window(&picture.opacity(), 48, 12..36, 12..36)
}

#[test]
fn a_slab_of_points_has_the_transmittance_of_its_optical_depth() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &slab("", "", 1.0, false));
    for tau in [0.05f64, 1.0, 4.0] {
        let text = scene(&format!("extinction = {:?}", 2.0 * tau));
        for technique in ["points", "reference", "sheets"] {
            let (mean, ripple) = mean_and_ripple(&alpha(&draw_in(folder.path(), &text, &["--technique", technique])));
            let off = (1.0 - mean - (-tau).exp()).abs();
            // Cells of points are found within 0.2 %.
            assert!(
                off < 2e-3 * tau * (-tau).exp() + 1e-5 && ripple < 2e-3,
                "{technique}, τ {tau}: {off:e}, {ripple:e}"
            );
        }
    }
    let noisy = ["--technique", "particles", "--set", "render.particles.repeat_level=200"];
    let (mean, _) = mean_and_ripple(&alpha(&draw_in(folder.path(), &scene("extinction = 2"), &noisy)));
    // The mean of 576 pixels of 200 sets, five deviations of which are 0.007 if all particles are as large as a pixel.
    assert!((1.0 - mean - (-1f64).exp()).abs() < 0.01, "{mean}");
}

#[test]
fn its_shadow_on_a_wall_is_the_transmittance_of_the_way_of_light() {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path(), &slab("", "", 1.0, false));
    let wall = "transform = { translate = [0, 0, 3] }\nextinction = 2\n[render]\nlayers = ['shadow']\n\
        [[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [1, 1, 1]\n\
        [[object]]\nname = 'wall'\nrectangle = { center = [0, 0, -1], u = [1.5, 0, 0], v = [0, 1.5, 0], spacing = 0.06 }\n";
    // The camera looks past the slab, which lies behind it.
    let text = scene(wall).replace("position = [0, 0, 5]", "position = [0, 0, 2]");
    let shadow = window(&draw_in(folder.path(), &text, &[]).channel("shadow.A"), 48, 12..36, 12..36);
    let (mean, ripple) = mean_and_ripple(&shadow);
    assert!((mean - (-1f64).exp()).abs() < 1.5e-3 && ripple < 0.01, "{mean}, {ripple:e}");
}

#[test]
fn a_radius_of_the_file_blurs_the_picture_and_keeps_the_sum_of_its_optical_depths() {
    let folder = tempfile::tempdir().unwrap();
    let depths = |name: &str, head: &str, further: &str, keys: &str| {
        std::fs::write(folder.path().join("slab.xyz"), slab(head, further, 0.3, false)).unwrap();
        let picture = draw_in(folder.path(), &scene(&format!("extinction = 0.5\n{keys}")), &[]);
        let depths: Vec<f64> = picture.opacity().iter().map(|a| -(1.0 - a).ln()).collect();
        assert!(depths.iter().all(|d| d.is_finite()), "{name}");
        depths
    };
    let plain = depths("plain", "", "", "");
    let sum = |depths: &[f64]| depths.iter().sum::<f64>();
    for (name, head, further, keys) in [
        ("radius", "radius", "0.4", ""),
        ("smoothing length", "smoothing_length", "0.2", ""),
        ("fewer points", "", "", "spacing = 0.1"),
    ] {
        let other = depths(name, head, further, keys);
        assert!((sum(&other) / sum(&plain) - 1.0).abs() < 3e-3, "{name}: {} and {}", sum(&other), sum(&plain));
        assert!(largest_difference(&other, &plain) > 1e-3, "{name}: nothing is blurred");
    }
    // A smoothing length is half of a radius.
    assert_eq!(depths("a", "radius", "0.4", ""), depths("b", "smoothing_length", "0.2", ""));
}

#[test]
fn neither_the_order_of_points_nor_threads_nor_a_power_of_two_changes_a_bit() {
    let folder = tempfile::tempdir().unwrap();
    let keys = "extinction = 2\ntransform = { rotate = [10, 20, 0] }";
    let run = |text: &str, scene: &str, arguments: &[&str]| {
        write(folder.path(), text);
        draw_in(folder.path(), scene, arguments)
    };
    let plain = run(&slab("", "", 1.0, false), &scene(keys), &["--threads", "1"]);
    let once = plain.sha256(1.0);
    for threads in ["2", "7"] {
        let found = run(&slab("", "", 1.0, true), &scene(keys), &["--threads", threads]);
        assert_eq!(found.sha256(1.0), once, "reversed, {threads} threads");
    }
    let large = scene("extinction = 0.5\ntransform = { rotate = [10, 20, 0], scale = 4 }")
        .replace("[0, 0, 5]", "[0, 0, 20]")
        .replace("orthographic = 2.0", "orthographic = 8.0");
    assert_eq!(run(&slab("", "", 1.0, false), &large, &[]).sha256(4.0), once, "four times as large");
    let far = "extinction = 2\ntransform = { rotate = [10, 20, 0], translate = [0, 0, 0] }";
    let shifted = scene(far)
        .replace("[0, 0, 5]", "[1e7, 1e7, 10000005]")
        .replace("[0, 0, 0]\northographic", "[1e7, 1e7, 1e7]\northographic")
        .replace("translate = [0, 0, 0]", "translate = [1e7, 1e7, 1e7]");
    let found = run(&slab("", "", 1.0, false), &shifted, &[]);
    let largest = largest_difference(&found.opacity(), &plain.opacity());
    assert!(largest < 1e-4, "far away: {largest:e}");
}

#[test]
fn colours_columns_and_clips_do_what_they_do_for_surfaces() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = slab("red green blue heat", "255 0 0 7", 1.0, false);
    let line = text.lines().nth(1).unwrap().to_owned();
    text = text.replace(&line, &line.replace("255 0 0 7", "255 0 0 8"));
    write(folder.path(), &text);
    let light = "[ambient]\ncolor = [1, 1, 1]\n";
    let rgb = |keys: &str| {
        let picture = draw_in(
            folder.path(),
            &scene(&format!("extinction = 20\n{keys}")).replace("[[object]]", &format!("{light}[[object]]")),
            &[],
        );
        ["R", "G", "B"].map(|c| picture.channel(c)[24 * 48 + 24])
    };
    let [red, green, blue] = rgb("");
    assert!(red > 0.1 && green == 0.0 && blue == 0.0, "{red} {green} {blue}");
    let [red, green, _] = rgb("color = [0, 1, 0]");
    assert!(red == 0.0 && green > 0.1);
    let unlit = rgb("unlit = true");
    assert!((unlit[0] - 1.0).abs() < 1e-3 && unlit[1] == 0.0, "{unlit:?}");
    let [red, green, _] = rgb("color_by = { column = 'heat', map = 'grey', range = [0, 14] }\nunlit = true");
    assert!((red - green).abs() < 1e-6 && red > 0.1, "{red} {green}");
    assert_eq!(rgb("keep = { heat = [8, 9] }"), [0.0; 3]);
    assert_eq!(rgb("clip = [{ normal = [1, 0, 0], point = [-0.5, 0, 0] }]"), [0.0; 3]);
}

/// Exit code and what is said.
fn said(folder: &Path, text: &str, arguments: &[&str]) -> (Option<i32>, String) {
    std::fs::write(folder.join("s.toml"), text).unwrap();
    let command = [&["render", "s.toml", "-o", "a.exr", "--force"], arguments].concat();
    let out = organza().args(command).current_dir(folder).output().unwrap();
    (out.status.code(), String::from_utf8(out.stderr).unwrap())
}

#[test]
fn what_is_not_used_is_named_and_what_cannot_be_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let plain = scene("extinction = 2");
    write(folder.path(), &slab("opacity radius smoothing_length", "0.5 0.3 0.2", 1.0, false));
    let (code, text) = said(folder.path(), &plain, &[]);
    assert_eq!(code, Some(0), "{text}");
    for expected in ["a medium does not use `opacity`", "a medium does not use `smoothing_length` beside `radius`"] {
        assert!(text.contains(expected), "{text}");
    }
    assert!(!text.contains("not used"), "{text}");
    let (code, text) = said(folder.path(), &plain.replace("as = 'medium'\nextinction = 2", ""), &[]);
    assert!(code == Some(0) && text.contains("not used: smoothing_length"), "{text}");
    write(folder.path(), &slab("radius", "-0.5", 1.0, false));
    let (code, text) = said(folder.path(), &plain, &[]);
    assert!(code == Some(3) && text.contains("slab.xyz:2:") && text.contains("a finite length above 0"), "{text}");
    let (code, text) = said(folder.path(), &plain, &["--technique", "surfels"]);
    assert!(code == Some(3) && text.contains("is a medium, and the technique `surfels`"), "{text}");
    // A lone point among many: its matter is cut down, and that is said.
    write(folder.path(), &(slab("", "", 1.0, false) + "900 0 0\n"));
    let (code, text) = said(folder.path(), &plain, &[]);
    assert!(code == Some(0) && text.contains("1 of 3921 points lie so far"), "{text}");
}

#[test]
fn a_puff_of_random_points_looks_alike_by_every_technique() {
    let folder = tempfile::tempdir().unwrap();
    let unit = |i: u64, a: u64| f64::from(rng::unit_f32(5, 0, i, a));
    let mut text = "x y z smoothing_length\n".to_owned();
    for i in 0..600 {
        let at = [0, 1, 2].map(|a| 0.6 * (unit(i, 3 * a) + unit(i, 3 * a + 1) + unit(i, 3 * a + 2) - 1.5));
        writeln!(text, "{} {} {} 0.15", at[0], at[1], at[2]).unwrap();
    }
    write(folder.path(), &text);
    let lit = "extinction = 4\n[[light]]\nkind = 'directional'\ndirection = [-1, -1, -1]\nirradiance = [3, 3, 3]\n";
    let drawn = |technique: &str| {
        let level = ["--set", "render.particles.repeat_level=100"];
        let arguments =
            [&["--technique", technique][..], &level[..if technique == "particles" { 2 } else { 0 }]].concat();
        draw_in(folder.path(), &scene(lit), &arguments)
    };
    let exact = drawn("reference");
    // Light is taken at the centres of splats, and where a particle lies.
    for (technique, mean_off, channels) in [("points", 2e-3, &["R", "A"][..]), ("particles", 2e-2, &["A"])] {
        let picture = drawn(technique);
        for channel in channels {
            let a = picture.channel(channel);
            let b = exact.channel(channel);
            let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
            assert!((mean(&a) / mean(&b) - 1.0).abs() < mean_off, "{technique} {channel}: {} {}", mean(&a), mean(&b));
        }
    }
}
