//! Fields that surfaces show, through the whole command.

use organza_tests::{draw_in, organza, parallel_view, window};
use std::path::Path;

/// Values x + 0.5 on three points along each axis, from −1 to 1, and what else the header says.
fn ramp(folder: &Path, name: &str, more: &str) {
    let values: String = (0..27).map(|i| format!("{}\n", f64::from(i % 3) - 0.5)).collect();
    let text = format!(
        "NRRD0004\ntype: float\ndimension: 3\n{more}sizes: 3 3 3\nspace directions: (1,0,0) (0,1,0) (0,0,1)\n\
         space origin: (-1,-1,-1)\nencoding: ascii\n\n{values}"
    );
    std::fs::write(folder.join(name), text).unwrap();
}

const LOOK: &str =
    "transfer = [{ value = 0, color = [1, 0, 0], opacity = 0 }, { value = 1, color = [0, 0, 1], opacity = 1 }]\n";

fn scene(source: &str, more: &str) -> String {
    parallel_view(1.0, 32)
        + "[material.film]\nshading = 'unlit'\nopacity = 0.8\n[[object]]\nname = 'film'\nmaterial = 'film'\n\
           field = { volume = 'ramp.nrrd' }\n"
        + source
        + LOOK
        + more
}

const FILM: &str = "rectangle = { center = [0, 0, 0], u = [0.75, 0, 0], v = [0, 0.75, 0], spacing = 0.015 }\n";

#[test]
fn a_ramp_upon_a_film_is_its_colour_and_its_opacity_by_every_technique() {
    let folder = tempfile::tempdir().unwrap();
    ramp(folder.path(), "ramp.nrrd", "");
    let half = ["sheets", "--set", "render.sheets.slicing='half_vector'"];
    let many = ["particles", "--set", "render.particles.repeat_level=100"];
    for technique in [&["points"][..], &many, &["sheets"], &half, &["surfels"], &["reference"]] {
        let light = "[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [1, 1, 1]\n";
        let arguments = [&["--technique"], technique].concat();
        let picture = draw_in(folder.path(), &scene(FILM, light), &arguments);
        let [alpha, red, blue] = ["A", "R", "B"].map(|name| picture.channel(name));
        for column in 1..31 {
            let mean = |channel: &[f64]| window(channel, 32, column..column + 1, 2..30).iter().sum::<f64>() / 28.0;
            let value = (f64::from(column) + 0.5) / 32.0;
            let opacity = 0.8 * value;
            let expected = [opacity, opacity * (1.0 - value), opacity * value];
            let found = [&alpha, &red, &blue].map(|channel| mean(channel));
            // Particles: 28 pixels of 4 samples and 100 sets, five deviations.
            let bound = if technique[0] == "particles" { 0.025 } else { 0.004 };
            let off = (0..3).map(|k| (found[k] - expected[k]).abs()).fold(0.0, f64::max);
            assert!(off < bound, "{technique:?}, column {column}: {found:?} {expected:?}");
        }
    }
}

#[test]
fn what_a_field_does_not_reach_is_warned_of_or_refused() {
    let folder = tempfile::tempdir().unwrap();
    ramp(folder.path(), "ramp.nrrd", "");
    ramp(folder.path(), "body.nrrd", "space: right-anterior-superior\n");
    let render = |source: &str, more: &str| {
        std::fs::write(folder.path().join("s.toml"), scene(source, more)).unwrap();
        let command = ["render", "s.toml", "-o", "a.exr", "--force", "--size", "8x8"];
        let out = organza().args(command).current_dir(&folder).output().unwrap();
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned())
    };
    let wide = FILM.replace("u = [0.75, 0, 0]", "u = [3, 0, 0]").replace("0.015", "0.05");
    let (code, said) = render(&wide, "");
    let expected = "object 'film': 50.0 % of its surface lies where the field is not known, and looks as without it";
    assert!(code == Some(0) && said.contains(expected), "{said}");
    let (code, said) = render(&FILM.replace("center = [0, 0, 0]", "center = [0, 0, 4]"), "");
    assert!(code == Some(3) && said.contains("ramp.nrrd") && said.contains("known from [-1, -1, -1] to"), "{said}");
    let missing = |name: &str| scene(FILM, "").replace("ramp.nrrd", name);
    for (name, code) in [("none.nrrd", 4), ("s.toml", 3)] {
        std::fs::write(folder.path().join("t.toml"), missing(name)).unwrap();
        let out = organza().args(["render", "t.toml", "-o", "b.exr"]).current_dir(&folder).output().unwrap();
        let said = String::from_utf8_lossy(&out.stderr);
        assert!(out.status.code() == Some(code) && said.contains(name), "{said}");
        assert!(!folder.path().join("b.exr").exists());
    }
    // A mesh's axes and a scanner's: the scene says which counts.
    std::fs::write(folder.path().join("a.obj"), "v -0.5 -0.5 0\nv 0.5 -0.5 0\nv 0 0.5 0\nf 1 2 3\n").unwrap();
    let body = |more: &str| missing("body.nrrd").replace(FILM, "mesh = 'a.obj'\n") + more;
    for (more, code) in [("", 3), ("[object.transform]\nup = 'z'\n", 0)] {
        std::fs::write(folder.path().join("t.toml"), body(more)).unwrap();
        let out = organza().args(["info", "t.toml", "--json"]).current_dir(&folder).output().unwrap();
        assert_eq!(out.status.code(), Some(code), "{}", String::from_utf8_lossy(&out.stderr));
        if code == 0 {
            let told: serde_json::Value = serde_json::from_slice(&out.stdout).unwrap();
            assert!(told["objects"][0]["path"].as_str().unwrap().ends_with("body.nrrd"), "{told}");
        } else {
            assert!(String::from_utf8_lossy(&out.stderr).contains("several axes that point up"));
        }
    }
}
