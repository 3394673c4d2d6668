//! Raw points by their columns, and what is cut away of every source, through the whole command.

use organza_tests::{draw_in, mean_and_ripple, organza, parallel_view, window};
use std::fmt::Write as _;
use std::path::Path;

/// The map `grey` in linear light: its two colours.
const GREY: [f64; 2] = [0.014_443_844, 0.904_661_3];

/// Points of a plane 0.05 apart; `heat` is ten times x, classes are 2 below and 6 above the middle.
fn plane(folder: &Path) {
    let mut text = "x y z heat classification\n".to_owned();
    for (i, j) in (-30..30).flat_map(|i| (-30..30).map(move |j| (i, j))) {
        let [x, y] = [i, j].map(|i| 0.05 * (f64::from(i) + 0.5));
        let heat = 0.5 * (f64::from(i) + 0.5);
        writeln!(text, "{x} {y} 0 {heat} {}", if j < 0 { 2 } else { 6 }).unwrap();
    }
    std::fs::write(folder.join("plane.xyz"), text).unwrap();
}

fn scene(keys: &str) -> String {
    format!("{}[[object]]\nname = 'plane'\npoints = 'plane.xyz'\n{keys}", parallel_view(2.0, 48))
}

/// Exit code and what is said of a render.
fn said(folder: &Path, keys: &str) -> (Option<i32>, String) {
    std::fs::write(folder.join("s.toml"), scene(keys)).unwrap();
    let out = organza().args(["render", "s.toml", "-o", "a.exr", "--force"]).current_dir(folder).output().unwrap();
    (out.status.code(), String::from_utf8(out.stderr).unwrap())
}

#[test]
fn a_ramp_of_a_column_has_the_map_s_colours_across_the_picture() {
    let folder = tempfile::tempdir().unwrap();
    plane(folder.path());
    let keys = "color_by = { column = 'heat', map = 'grey', range = [-8, 8] }\nunlit = true\n";
    for technique in ["points", "surfels"] {
        let red = draw_in(folder.path(), &scene(keys), &["--technique", technique]).channel("R");
        for column in 0..48u32 {
            let heat = 10.0 * (2.0 * (f64::from(column) + 0.5) / 48.0 - 1.0);
            // At the ends of the range a disc reaches over the bend.
            if (heat.abs() - 8.0).abs() < 1.5 {
                continue;
            }
            let expected = GREY[0] + (GREY[1] - GREY[0]) * ((heat + 8.0) / 16.0).clamp(0.0, 1.0);
            let (mean, ripple) = mean_and_ripple(&window(&red, 48, column..column + 1, 4..44));
            assert!(
                (mean - expected).abs() < 0.02 && ripple < 0.02,
                "{technique}, {heat}: {mean}, expected {expected}"
            );
        }
    }
}

#[test]
fn what_is_kept_is_drawn_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    plane(folder.path());
    for (keys, [left_below, right_below, left_above, right_above]) in [
        ("keep = { classification = [6] }\n", [0.0, 0.0, 1.0, 1.0]),
        ("keep = { heat = [0, 100] }\n", [0.0, 1.0, 0.0, 1.0]),
        ("keep = { class = [2, 9], heat = [-100, 0] }\n", [1.0, 0.0, 0.0, 0.0]),
        ("clip = [{ normal = [-1, 0, 0], point = [0, 0, 0] }]\n", [0.0, 1.0, 0.0, 1.0]),
        ("clip = [{ box = [[-9, -9, -1], [0, 0, 1]] }]\n", [1.0, 0.0, 0.0, 0.0]),
    ] {
        let alpha = draw_in(folder.path(), &scene(keys), &[]).opacity();
        for (expected, x, y) in [(left_below, 0, 1), (right_below, 1, 1), (left_above, 0, 0), (right_above, 1, 0)] {
            let part = |half: u32| 24 * half + 4..24 * half + 20;
            assert!(
                window(&alpha, 48, part(x), part(y)).iter().all(|a| (a - expected).abs() < 1e-6),
                "{keys}, {x} {y}"
            );
        }
    }
    let (code, text) = said(folder.path(), "keep = { heat = [500, 600] }\ncolor_by = { column = 'class' }\n");
    assert_eq!(code, Some(0), "{text}");
    assert!(text.contains("plane.xyz: nothing is left of 3600 points by `keep.heat`"), "{text}");
    assert!(text.contains("object 'plane' has no splats"), "{text}");
}

#[test]
fn a_column_that_a_file_has_not_is_refused_with_those_that_it_has() {
    let folder = tempfile::tempdir().unwrap();
    plane(folder.path());
    for keys in ["color_by = { column = 'hue' }\n", "keep = { hue = [0, 1] }\n"] {
        let (code, text) = said(folder.path(), keys);
        assert_eq!(code, Some(3), "{text}");
        let expected = "plane.xyz: expected a column among x, y, z, height, heat, classification, found `hue`";
        assert!(text.contains(expected), "{text}");
    }
    let (_, text) = said(folder.path(), "color_by = { column = 'heat' }\n");
    assert!(text.contains("points have the colours of `heat` by the map viridis from -14.75 to 14.75"), "{text}");
    assert!(!text.contains("not used: heat"), "{text}");
}

#[test]
fn a_disc_has_the_diameter_that_is_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let lone = "x y z nx ny nz\n0 0 0 0 0 1\n0.7 0.7 -3 0 0 1\n";
    std::fs::write(folder.path().join("plane.xyz"), lone).unwrap();
    for (keys, diameter) in [("point_size = { world = 0.5 }\n", 0.5), ("point_size = { pixels = 12 }\n", 0.5)] {
        let alpha = draw_in(folder.path(), &scene(keys), &[]).opacity();
        let pixel = 2.0 / 48.0;
        let covered = alpha.iter().sum::<f64>() * pixel * pixel;
        let expected = 2.0 * std::f64::consts::PI * (0.5 * diameter) * (0.5 * diameter);
        assert!((covered / expected - 1.0).abs() < 0.1, "{keys}: {covered}, expected {expected}");
    }
}

/// Voxels of one value from −0.8 to 0.8, cut at z = 0.2: half of the light is left by 1 of the way, whoever draws it.
#[test]
fn a_volume_that_is_cut_has_the_optical_depth_of_what_is_left() {
    let folder = tempfile::tempdir().unwrap();
    let mut text = String::from(
        "NRRD0004\ntype: float\ndimension: 3\nsizes: 16 16 16\n\
         space directions: (0.1,0,0) (0,0.1,0) (0,0,0.1)\nspace origin: (-0.75,-0.75,-0.75)\nencoding: ascii\n\n",
    );
    (0..16 * 16 * 16).for_each(|_| text += "1\n");
    std::fs::write(folder.path().join("block.nrrd"), text).unwrap();
    let scene = |clip: &str| {
        format!(
            "{}[[object]]\nname = 'block'\nvolume = 'block.nrrd'\n{clip}\
             transfer = [{{ value = 0, color = [1, 1, 1], extinction = 0.693147 }}]\n",
            parallel_view(2.0, 24)
        )
    };
    for (clip, depth) in [
        ("clip = [{ normal = [0, 0, 1], point = [0, 0, 0.2] }]\n", 1.0),
        (
            "clip = [{ normal = [0, 0, 1], point = [0, 0, 0.23] }, { normal = [0, 0, -1], point = [0, 0, -0.27] }]\n",
            0.5,
        ),
        ("clip = [{ box = [[-9, -9, -0.33], [9, 9, 0.2]] }]\n", 0.53),
    ] {
        for technique in ["points", "sheets", "reference"] {
            let alpha = draw_in(folder.path(), &scene(clip), &["--technique", technique]).opacity();
            let (mean, _) = mean_and_ripple(&window(&alpha, 24, 7..17, 7..17));
            let found = -(1.0 - mean).log2();
            assert!((found - depth).abs() < 0.01, "{technique}, {clip}: {found}");
        }
        let sets = ["--technique", "particles", "--set", "render.particles.repeat_level=100"];
        let alpha = draw_in(folder.path(), &scene(clip), &sets).opacity();
        let inner = window(&alpha, 24, 7..17, 7..17);
        let transmitted = 1.0 - mean_and_ripple(&inner).0;
        // Four samples a pixel, 100 sets: five deviations.
        let sigma = (0.25 / (100.0 * inner.len() as f64)).sqrt();
        assert!((transmitted - 0.5f64.powf(depth)).abs() < 5.0 * sigma, "{clip}: {transmitted}");
    }
}

#[test]
fn surfaces_end_where_they_are_cut() {
    let folder = tempfile::tempdir().unwrap();
    let square = "v -2 -2 0\nv 2 -2 0\nv 2 2 0\nv -2 2 0\nf 1 2 3 4\n";
    std::fs::write(folder.path().join("square.obj"), square).unwrap();
    for source in [
        "mesh = 'square.obj'\nspacing = 0.05",
        "rectangle = { center = [0, 0, 0], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.05 }",
    ] {
        for technique in ["points", "surfels"] {
            let clip = "clip = [{ normal = [1, 0, 0], point = [0.25, 0, 0] }, { box = [[-9, -0.5, -1], [9, 9, 1]] }]";
            let scene = format!("{}[[object]]\nname = 'it'\n{source}\n{clip}\n", parallel_view(2.0, 48));
            let alpha = draw_in(folder.path(), &scene, &["--technique", technique]).opacity();
            let area = alpha.iter().sum::<f64>() * (2.0f64 / 48.0).powi(2);
            assert!((area - 1.25 * 1.5).abs() < 0.03 * area, "{technique}, {source}: {area}");
        }
    }
}
