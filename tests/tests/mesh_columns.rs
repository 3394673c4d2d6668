//! Meshes in the colours of arrays of their vertices and faces, through the whole command.

use organza_tests::{Place, draw_in, organza, parallel_view, window};
use std::fmt::Write as _;
use std::path::Path;

/// A square of half-side 0.75 across z in two halves of two triangles each: `heat` of vertices is x, `load` of faces 1 on the left and 3 on the right.
fn ply() -> String {
    let mut text =
        "ply\nformat ascii 1.0\nelement vertex 6\nproperty double x\nproperty double y\nproperty double z\n".to_owned();
    text += "property double heat\nelement face 2\nproperty list uchar int vertex_indices\nproperty float load\nend_header\n";
    for x in [-0.75, 0.0, 0.75] {
        writeln!(text, "{x} -0.75 0 {x}\n{x} 0.75 0 {x}").unwrap();
    }
    text + "4 0 2 3 1 1\n4 2 4 5 3 3\n"
}

/// The same as a legacy VTK file, with a vector `U` of points, (x, y, 0) · 4, and a pair `q` of cells.
fn vtk() -> String {
    let mut text = "# vtk DataFile Version 3.0\nsquare\nASCII\nDATASET POLYDATA\nPOINTS 6 double\n".to_owned();
    let places = [-0.75, 0.0, 0.75].into_iter().flat_map(|x| [[x, -0.75], [x, 0.75]]);
    places.clone().for_each(|[x, y]| writeln!(text, "{x} {y} 0").unwrap());
    text += "POLYGONS 2 10\n4 0 2 3 1\n4 2 4 5 3\nPOINT_DATA 6\nSCALARS heat double 1\nLOOKUP_TABLE default\n";
    places.clone().for_each(|[x, _]| writeln!(text, "{x}").unwrap());
    text += "VECTORS U double\n";
    places.for_each(|[x, y]| writeln!(text, "{} {} 0", 4.0 * x, 4.0 * y).unwrap());
    text + "CELL_DATA 2\nFIELD FieldData 2\nload 1 2 double\n1 3\nq 2 2 double\n1 0 0 3\n"
}

/// The same as a VTP file.
fn vtp() -> String {
    let places = || [-0.75, 0.0, 0.75].into_iter().flat_map(|x| [[x, -0.75], [x, 0.75]]);
    let list = |numbers: Vec<f64>| numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
    let array = |name: &str, kind: &str, numbers: u32, values: Vec<f64>| {
        format!(
            "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{numbers}\" format=\"ascii\">{}</DataArray>",
            list(values)
        )
    };
    let points = array("Points", "Float64", 3, places().flat_map(|[x, y]| [x, y, 0.0]).collect());
    let heat = array("heat", "Float64", 1, places().map(|[x, _]| x).collect());
    let vector = array("U", "Float64", 3, places().flat_map(|[x, y]| [4.0 * x, 4.0 * y, 0.0]).collect());
    let cells =
        [array("load", "Float64", 1, vec![1.0, 3.0]), array("q", "Float64", 2, vec![1.0, 0.0, 0.0, 3.0])].concat();
    let polygons = [
        array("connectivity", "Int32", 1, vec![0.0, 2.0, 3.0, 1.0, 2.0, 4.0, 5.0, 3.0]),
        array("offsets", "Int32", 1, vec![4.0, 8.0]),
    ];
    format!(
        "<VTKFile type=\"PolyData\" version=\"0.1\" byte_order=\"LittleEndian\"><PolyData><Piece NumberOfPoints=\"6\" NumberOfPolys=\"2\"><Points>{points}</Points>\
         <Polys>{}</Polys><PointData>{heat}{vector}</PointData><CellData>{cells}</CellData></Piece></PolyData></VTKFile>",
        polygons.concat()
    )
}

/// The files of the square, by their names.
fn write_files(folder: &Path) -> [&'static str; 3] {
    let files = [("square.ply", ply()), ("square.vtk", vtk()), ("square.vtp", vtp())];
    files.each_ref().map(|(name, text)| {
        std::fs::write(folder.join(name), text).unwrap();
        *name
    })
}

/// The square in the colours of a column: red is the number over `most`, green a half, and opacity, where it is asked for, the same as red.
fn scene(file: &str, column: &str, most: f64, opacity: bool) -> String {
    let [none, all] = if opacity { [", opacity = 0", ", opacity = 1"] } else { [""; 2] };
    parallel_view(1.0, 32)
        + "[[light]]\nkind = 'directional'\ndirection = [0, 0, -1]\nirradiance = [1, 1, 1]\n[background]\ncolor = [0, 0, 1]\n"
        + &format!(
            "[material.film]\nshading = 'unlit'\n[[object]]\nname = 'film'\nmesh = '{file}'\nmaterial = 'film'\nspacing = 0.015\n\
             color_by = {{ column = '{column}' }}\n\
             transfer = [{{ value = 0, color = [0, 0.5, 0]{none} }}, {{ value = {most:?}, color = [1, 0.5, 0]{all} }}]\n"
        )
}

/// Every technique with the greatest error of a column's mean, see `mesh_opacity.rs`.
const TRIALS: [(&[&str], f64); 6] = [
    (&["points"], 2e-3),
    (&["reference"], 2e-3),
    (&["surfels"], 2e-3),
    (&["sheets"], 1e-5),
    (&["sheets", "--set", "render.sheets.slicing='half_vector'"], 1e-5),
    (&["particles", "--set", "render.particles.repeat_level=100"], 0.025),
];

/// The largest error of the mean of a column of the picture, where a column shows this number and opacity.
fn error(folder: &Path, text: &str, technique: &[&str], skip: &[u32], look: impl Fn(f64) -> [f64; 2]) -> f64 {
    let picture = draw_in(folder, text, &[&["--technique"], technique].concat());
    let [red, blue] = ["R", "B"].map(|name| picture.channel(name));
    let mut worst = 0.0f64;
    for column in (1..31).filter(|column| !skip.contains(column)) {
        let [number, opacity] = look((f64::from(column) + 0.5) / 32.0 - 0.5);
        let mean = |channel: &[f64]| window(channel, 32, column..column + 1, 2..30).iter().sum::<f64>() / 28.0;
        worst = worst.max((mean(&red) - opacity * number).abs()).max((mean(&blue) - (1.0 - opacity)).abs());
    }
    worst
}

#[test]
fn vertices_and_faces_have_the_colours_of_their_numbers_by_every_technique() {
    let folder = tempfile::tempdir().unwrap();
    for file in write_files(folder.path()) {
        // One file by every technique, the others by one each.
        let trials = if file == "square.ply" { &TRIALS[..] } else { &TRIALS[3..4] };
        for (technique, bound) in trials {
            // Below 0 there is the first colour.
            let ramp = error(folder.path(), &scene(file, "heat", 0.8, false), technique, &[15, 16], |x| {
                [x.max(0.0) / 0.8, 1.0]
            });
            let clear =
                error(folder.path(), &scene(file, "heat", 0.8, true), technique, &[15, 16], |x| [x.max(0.0) / 0.8; 2]);
            let halves = error(folder.path(), &scene(file, "load", 4.0, false), technique, &[15, 16], |x| {
                [if x < 0.0 { 0.25 } else { 0.75 }, 1.0]
            });
            println!("{file} {technique:?}: {ramp:.1e}, with opacities {clear:.1e}, by faces {halves:.1e}");
            // Colour and opacity rise together: the mean of their product over a column is that in its middle and a twelfth of (1/32/0.8)², 1.3e-4.
            assert!(
                ramp < *bound && clear < bound.max(1.3e-4) && halves < *bound,
                "{file} {technique:?}: {ramp:e} {clear:e} {halves:e}"
            );
        }
    }
}

#[test]
fn vectors_have_a_magnitude_and_components() {
    let folder = tempfile::tempdir().unwrap();
    for file in &write_files(folder.path())[1..] {
        let sheets = ["sheets"];
        let off = error(folder.path(), &scene(file, "U:x", 4.0, false), &sheets, &[15, 16], |x| [x.max(0.0), 1.0]);
        assert!(off < 1e-5, "{file}: {off:e}");
        let off = error(folder.path(), &scene(file, "q:magnitude", 4.0, false), &sheets, &[15, 16], |x| {
            [if x < 0.0 { 0.25 } else { 0.75 }, 1.0]
        });
        assert!(off < 1e-5, "{file}: {off:e}");
    }
}

#[test]
fn info_lists_arrays_and_an_unknown_one_is_refused_with_their_names() {
    let folder = tempfile::tempdir().unwrap();
    let run = |arguments: &[&str]| {
        let out = organza().args(arguments).current_dir(&folder).output().unwrap();
        let told = String::from_utf8([out.stdout, out.stderr].concat()).unwrap();
        (out.status.code(), told)
    };
    for file in write_files(folder.path()) {
        let (code, told) = run(&["info", file]);
        assert_eq!(code, Some(0), "{told}");
        for column in ["heat of the vertices: -0.75 to 0.75", "load of the faces: 1 to 3"] {
            assert!(told.contains(column) && !told.contains("not used"), "{file}: {told}");
        }
        let is_vtk = file != "square.ply";
        assert_eq!(told.contains("U:y of the vertices: -3 to 3"), is_vtk, "{told}");
        assert_eq!(told.contains("q:magnitude of the faces: 1 to 3"), is_vtk, "{told}");
        let (code, told) = run(&["info", file, "--json"]);
        let json: serde_json::Value = serde_json::from_str(&told).unwrap();
        assert_eq!((code, json["columns_of"]["load"].as_str()), (Some(0), Some("faces")), "{told}");
        assert_eq!(json["columns"]["load"], serde_json::json!([1.0, 3.0]));
        let (code, told) = run(&["render", file, "--color-by", "wind", "-o", "a.exr", "--size", "8x8"]);
        assert_eq!(code, Some(3), "{told}");
        let names = if is_vtk {
            "x, y, z, height, heat, U:magnitude, U:x, U:y, U:z, load"
        } else {
            "x, y, z, height, heat, load"
        };
        assert!(told.contains(&format!("expected a column among {names}")) && told.contains("found `wind`"), "{told}");
        for column in ["load", "heat", "height"] {
            let arguments = [
                "render",
                file,
                "--color-by",
                column,
                "--preset",
                "turbo",
                "--legend",
                "-o",
                "a.png",
                "--size",
                "160x120",
                "--force",
            ];
            let (code, told) = run(&arguments);
            assert_eq!(code, Some(0), "{told}");
            assert!(told.contains(&format!("have the colours of `{column}` by the map turbo from ")), "{told}");
        }
    }
}

#[test]
fn columns_of_meshes_are_refused_where_they_are_none() {
    let place = Place::new(&scene("square.ply", "wind", 1.0, false));
    place.write("square.ply", ply());
    place.expect(
        3,
        &["render", "s.toml"],
        "square.ply: expected a column among x, y, z, height, heat, load, found `wind`",
    );
    place.expect(
        2,
        &["render", "s.toml", "--set", "object.film.color=[1, 1, 1]"],
        "`color` and `color_by` exclude each other",
    );
    let text = scene("square.ply", "heat", 1.0, false);
    let place = Place::new(
        &text
            .replace(
                "mesh = 'square.ply'",
                "rectangle = { center = [0, 0, 0], u = [1, 0, 0], v = [0, 1, 0], spacing = 0.1 }",
            )
            .replace("spacing = 0.015\n", ""),
    );
    place.expect(3, &["render", "s.toml"], "`color_by` belongs to `points` and to a `mesh`");
}
