//! Raw points with an opacity each, through the whole command.

use organza_tests::{draw_in, organza, parallel_view, window};
use std::fmt::Write as _;
use std::path::Path;

/// Points of a plane 0.05 apart with a column of this name: one number left of the middle, one right of it.
fn plane(name: &str, left: f64, right: f64) -> String {
    let mut text = format!("x y z {name}\n");
    for (i, j) in (-30..30).flat_map(|i| (-30..30).map(move |j| (i, j))) {
        let opacity = if i < 0 { left } else { right };
        writeln!(text, "{} {} 0 {opacity}", 0.05 * (f64::from(i) + 0.5), 0.05 * (f64::from(j) + 0.5)).unwrap();
    }
    text
}

fn scene(more: &str) -> String {
    format!("{}[[object]]\nname = 'plane'\npoints = 'plane.xyz'\n{more}", parallel_view(2.0, 48))
}

/// Transmittance of the plane in the pixels of its left and right half, but for those near the middle and the border of the picture.
fn seen(folder: &Path, more: &str, arguments: &[&str]) -> [Vec<f64>; 2] {
    let alpha = draw_in(folder, &scene(more), arguments).opacity();
    [4..18, 30..44].map(|columns| window(&alpha, 48, columns, 4..44).iter().map(|a| 1.0 - a).collect())
}

/// Largest difference from a number.
fn off(seen: &[f64], expected: f64) -> f64 {
    seen.iter().map(|t| (t - expected).abs()).fold(0.0, f64::max)
}

#[test]
fn two_halves_of_a_plane_let_through_what_their_points_do() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["opacity", "alpha"] {
        std::fs::write(folder.path().join("plane.xyz"), plane(name, 0.25, 0.75)).unwrap();
        for technique in ["points", "surfels", "reference", "sheets"] {
            let [left, right] = seen(folder.path(), "", &["--technique", technique]);
            println!("{technique}: {:.1e}, {:.1e}", off(&left, 0.75), off(&right, 0.25));
            assert!(off(&left, 0.75) < 1e-3 && off(&right, 0.25) < 1e-3, "{technique}");
        }
    }
    // The object's opacity is a factor of theirs.
    for technique in ["points", "surfels"] {
        let [left, right] = seen(folder.path(), "opacity = 0.4\n", &["--technique", technique]);
        assert!(off(&left, 0.9) < 1e-3 && off(&right, 0.7) < 1e-3, "{technique}");
    }
    let sets = ["--technique", "particles", "--set", "render.particles.repeat_level=64"];
    let halves = seen(folder.path(), "", &sets);
    for (half, exact) in halves.iter().zip([0.75f64, 0.25]) {
        // Independent pixels, of which each is the mean of 64 sets: five deviations.
        let n = (64 * half.len()) as f64;
        let apart = half.iter().sum::<f64>() / half.len() as f64 - exact;
        assert!(apart.abs() < 5.0 * (exact * (1.0 - exact) / n).sqrt() + 1e-3, "particles: {apart}");
    }
}

#[test]
fn points_of_opacity_one_end_rays_beside_those_that_do_not() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("plane.xyz"), plane("opacity", 1.0, 0.5)).unwrap();
    let half = ["--technique", "sheets", "--set", "render.sheets.slicing='half_vector'"];
    std::fs::write(
        folder.path().join("s.toml"),
        scene("[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [1, 1, 1]\n"),
    )
    .unwrap();
    for arguments in [&half[..2], &half] {
        let command = [&["render", "s.toml", "-o", "a.exr", "--force"], arguments].concat();
        let out = organza().args(command).current_dir(&folder).output().unwrap();
        let said = String::from_utf8(out.stderr).unwrap();
        let expected =
            "object 'plane' has opaque points beside translucent ones, which neither cast nor receive shadows";
        assert_eq!(said.contains(expected), arguments.len() > 2, "{said}");
    }
    for technique in ["points", "surfels", "particles", "reference", "sheets"] {
        let [left, right] = seen(folder.path(), "", &["--technique", technique]);
        let middle = right.iter().sum::<f64>() / right.len() as f64;
        assert!(off(&left, 0.0) == 0.0, "{technique}: {:e}", off(&left, 0.0));
        assert!((middle - 0.5).abs() < if technique == "particles" { 0.1 } else { 1e-3 }, "{technique}: {middle}");
    }
}

#[test]
fn what_does_not_use_opacities_says_so_and_what_is_none_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    let run = |source: &str| {
        let scene =
            format!("{}[ambient]\ncolor = [1, 1, 1]\n[[object]]\nname = 'it'\n{source}\n", parallel_view(2.0, 8));
        std::fs::write(folder.path().join("s.toml"), scene).unwrap();
        let arguments = ["render", "s.toml", "-o", "a.exr", "--force"];
        let out = organza().args(arguments).current_dir(&folder).output().unwrap();
        (out.status.code(), String::from_utf8(out.stderr).unwrap())
    };
    let mut ball = "x,y,z,nx,ny,nz,opacity\n".to_owned();
    for (i, j) in (1..12).flat_map(|i| (0..24).map(move |j| (i, j))) {
        let theta = std::f64::consts::PI * f64::from(i) / 12.0;
        let phi = std::f64::consts::PI * f64::from(j) / 12.0;
        let [x, y, z] = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()];
        writeln!(ball, "{x},{y},{z},{x},{y},{z},0.5").unwrap();
    }
    std::fs::write(folder.path().join("ball.csv"), ball).unwrap();
    let (code, said) = run("level_set = { points = 'ball.csv', tolerance = 0.01 }");
    assert_eq!(code, Some(0), "{said}");
    assert!(said.contains("ball.csv: `level_set` does not use opacities"), "{said}");
    let (code, said) = run("points = 'ball.csv'");
    assert_eq!((code, said.as_str()), (Some(0), ""), "it is used");
    std::fs::write(folder.path().join("plane.xyz"), plane("alpha", 0.5, 127.0)).unwrap();
    let (code, said) = run("points = 'plane.xyz'");
    assert_eq!(code, Some(3), "{said}");
    assert!(said.contains("plane.xyz:1802:16: expected an opacity from 0 to 1, found '127'"), "{said}");
}
