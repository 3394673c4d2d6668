//! Levels of translucency of mixed data in one picture, as Figure 12 of Gunjee 2007 has them.

use organza_tests::{draw_in, parallel_view, window};
use std::fmt::Write as _;
use std::path::Path;

/// Opacities of the columns, from left to right.
const OPACITIES: [f64; 3] = [0.2, 0.5, 0.8];
/// Colours of the rows from top to bottom: a mesh, an implicit surface, raw points, a volume.
const COLORS: [[f64; 3]; 4] = [[0.85, 0.5, 0.3], [0.15, 0.35, 0.65], [0.75, 0.75, 0.5], [0.9, 0.4, 0.6]];
/// Thickness of the volume.
const THICKNESS: f64 = 0.5;

/// A square of 0.9 as a mesh, as points 0.03 apart, and a block of it as a volume of constant value, each about the origin.
fn write_data(folder: &Path) {
    let mesh = "v -0.45 -0.45 0\nv 0.45 -0.45 0\nv 0.45 0.45 0\nv -0.45 0.45 0\nf 1 2 3 4\n";
    std::fs::write(folder.join("square.obj"), mesh).unwrap();
    let mut points = String::from("x y z nx ny nz\n");
    for (i, j) in (0..30).flat_map(|i| (0..30).map(move |j| (i, j))) {
        let at = |k: i32| 0.03 * (f64::from(k) - 14.5);
        writeln!(points, "{} {} 0 0 0 1", at(i), at(j)).unwrap();
    }
    std::fs::write(folder.join("square.xyz"), points).unwrap();
    let volume = format!(
        "NRRD0004\ntype: float\ndimension: 3\nsizes: 18 18 10\nspace dimension: 3\nspace directions: (0.05,0,0) (0,0.05,0) (0,0,0.05)\n\
         space origin: (-0.425,-0.425,-0.225)\nencoding: ascii\n\n{}",
        "1 ".repeat(18 * 18 * 10)
    );
    std::fs::write(folder.join("block.nrrd"), volume).unwrap();
}

/// Four rows of three objects a unit apart: kinds of data from top to bottom, opacities from left to right.
fn scene() -> String {
    let mut text = parallel_view(4.0, 64) + "[material.plain]\nshading = 'unlit'\n";
    for (row, color) in COLORS.iter().enumerate() {
        for (column, opacity) in OPACITIES.iter().enumerate() {
            let x = column as f64 - 1.0;
            let y = 1.5 - row as f64;
            let place = format!("transform = {{ translate = [{x:?}, {y:?}, 0] }}\n");
            let source = match row {
                0 => format!("mesh = 'square.obj'\nspacing = 0.03\nopacity = {opacity}\n{place}"),
                1 => format!(
                    "implicit = {{ expression = 'z', box = [[{:?}, {:?}, -0.2], [{:?}, {:?}, 0.2]], spacing = 0.03 }}\nopacity = {opacity}\n",
                    x - 0.45,
                    y - 0.45,
                    x + 0.45,
                    y + 0.45
                ),
                2 => format!("points = 'square.xyz'\nopacity = {opacity}\n{place}"),
                _ => {
                    let extinction = -(1.0 - opacity).ln() / THICKNESS;
                    format!(
                        "volume = 'block.nrrd'\ntransfer = [{{ value = 0, color = {color:?}, extinction = {extinction:?} }}]\n{place}"
                    )
                }
            };
            let own_color = if row < 3 { format!("color = {color:?}\n") } else { String::new() };
            writeln!(text, "[[object]]\nname = '{row} {column}'\nmaterial = 'plain'\n{source}{own_color}").unwrap();
        }
    }
    text
}

#[test]
fn three_levels_of_translucency_of_four_kinds_of_data_have_their_opacities_and_colours() {
    let folder = tempfile::tempdir().unwrap();
    write_data(folder.path());
    let particles = ["--technique", "particles", "--set", "render.particles.repeat_level=400"];
    for (arguments, tolerance) in [
        (&["--technique", "points"][..], 2e-3),
        (&["--technique", "sheets"], 2e-3),
        (&["--technique", "reference"], 2e-3),
        // 36 pixels of 400 sets: five standard errors of at most 1/2 each are 0.021.
        (&particles, 0.021),
    ] {
        let picture = draw_in(folder.path(), &scene(), arguments);
        let channels = ["A", "R", "G", "B"].map(|name| picture.channel(name));
        for (row, column) in (0..4).flat_map(|row| (0..3).map(move |column| (row, column))) {
            // 16 pixels a unit; the middle 6 of each object.
            let x = 16 * column + 13;
            let y = 16 * row + 5;
            let means = channels.each_ref().map(|channel| {
                let seen = window(channel, 64, x..x + 6, y..y + 6);
                seen.iter().sum::<f64>() / seen.len() as f64
            });
            let opacity = OPACITIES[column as usize];
            let [red, green, blue] = COLORS[row as usize];
            for (found, expected) in means.into_iter().zip([1.0, red, green, blue].map(|c| c * opacity)) {
                let what = format!("{arguments:?}, row {row}, column {column}: {means:?}");
                assert!((found - expected).abs() < tolerance, "{what}, expected {expected}");
            }
        }
    }
}
