//! Legends of what colours stand for, and lids of meshes that are cut open, through the whole command.

use organza_tests::{Place, draw_in, parallel_view, window};
use std::fmt::Write as _;

/// Points of a plane whose `heat` grows from 0 to 100, and whose classes are 2 and 6.
fn plane() -> Place {
    let mut text = "x y z heat classification\n".to_owned();
    for (i, j) in (0..40).flat_map(|i| (0..40).map(move |j| (i, j))) {
        let [x, y] = [i, j].map(|k| 0.05 * (f64::from(k) - 19.5));
        writeln!(text, "{x} {y} 0 {} {}", f64::from(i) * 100.0 / 39.0, if j < 20 { 2 } else { 6 }).unwrap();
    }
    let place = Place::new("");
    place.write("plane.xyz", text);
    let ball = (0..4096).map(|i| {
        let square = [i % 16, i / 16 % 16, i / 256].map(|c| (f64::from(c) - 7.5).powi(2)).iter().sum::<f64>();
        format!("{}\n", (200.0 - 25.0 * square.sqrt()).max(0.0))
    });
    let head = "NRRD0004\ntype: float\ndimension: 3\nsizes: 16 16 16\nencoding: ascii\n\n".to_owned();
    place.write("ball.nrrd", head + &ball.collect::<String>());
    place
}

/// The columns in which two pictures differ, and how many pixels.
fn differing(place: &Place, a: &str, b: &str) -> (Vec<u32>, usize) {
    let [a, b] = [a, b].map(|name| place.pixels(name).to_rgba16());
    assert_eq!(a.dimensions(), b.dimensions());
    let pixels: Vec<u32> =
        a.enumerate_pixels().zip(b.pixels()).filter(|((_, _, a), b)| a != b).map(|((x, ..), _)| x).collect();
    let mut columns = pixels.clone();
    columns.sort_unstable();
    columns.dedup();
    (columns, pixels.len())
}

#[test]
fn a_legend_stands_at_the_right_border_of_a_png_alone_and_changes_nothing_else() {
    let place = plane();
    for (file, options) in [
        ("plane.xyz", &["--color-by", "heat"][..]),
        ("plane.xyz", &["--color-by", "classification", "--transparent", "--deep"]),
        ("ball.nrrd", &["--preset", "inferno"]),
    ] {
        let render = |name: &str, more: &[&str]| {
            let [exr, png] = [format!("{name}.exr"), format!("{name}.png")];
            let base = ["render", file, "--size", "240x135", "--force", "-o", &exr, "-o", &png];
            place.expect(0, &[&base, options, more].concat(), "");
        };
        render("without", &[]);
        render("with", &["--legend"]);
        let (columns, pixels) = differing(&place, "without.png", "with.png");
        assert!(columns[0] > 160 && pixels > 500, "{file} {options:?}: {pixels} pixels from {}", columns[0]);
        assert!(place.bytes("without.exr") == place.bytes("with.exr"), "{file}");
    }
}

/// What `explain` says of a column is what its legend shows: the first and the last hundredth are cut off.
#[test]
fn a_legend_has_the_colours_of_the_map_from_end_to_end() {
    let place = plane();
    let render = ["render", "plane.xyz", "--color-by", "heat", "--preset", "turbo", "--size", "480x270"];
    place.expect(0, &[&render[..], &["-o", "a.png", "--legend"]].concat(), "by the map turbo from");
    let picture = place.pixels("a.png").to_rgb8();
    for share in [0.02, 0.25, 0.5, 0.75, 0.98] {
        let expected = convert::ColorMap::TURBO.at(share).map(organza::output::displayed);
        let is_near = |x: u32, y: u32| picture.get_pixel(x, y).0.iter().zip(expected).all(|(a, b)| a.abs_diff(b) < 12);
        assert!((340..480).any(|x| (0..270).any(|y| is_near(x, y))), "{share}: {expected:?}");
    }
}

#[test]
fn a_legend_of_nothing_is_refused_before_any_work_and_one_without_room_is_told() {
    let place = plane();
    let refused = "--legend: no colours of this picture stand for numbers";
    place.write("mesh.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
    place.expect(2, &["render", "mesh.obj", "--legend", "-o", "a.png"], refused);
    place.expect(
        2,
        &["render", "plane.xyz", "--color-by", "heat", "--legend", "-o", "a.exr"],
        "--legend is for PNG, JPEG and WebP files",
    );
    let hidden = format!(
        "{}[[object]]\nname = 'plane'\npoints = 'plane.xyz'\nvisible = false\ncolor_by = {{ column = 'heat' }}\n",
        parallel_view(2.0, 48)
    );
    place.write("hidden.toml", hidden.as_bytes());
    place.expect(2, &["render", "hidden.toml", "--legend", "-o", "a.png"], refused);
    assert!(!place.path("a.png").exists());
    let shown = hidden.replace("visible = false", "keep = { heat = [500, 600] }");
    place.write("empty.toml", shown.as_bytes());
    place.expect(0, &["render", "empty.toml", "--legend", "-o", "b.png"], "there is no legend: nothing that is drawn");
    let small = ["render", "plane.xyz", "--color-by", "heat", "--legend", "--size", "32x20", "-o", "c.png"];
    place.expect(0, &small, "c.png: there is no room for a legend; use a larger --size");
}

/// A cube from −0.5 to 0.5 in text, of whose faces some are left out.
fn cube(faces: &[[usize; 4]]) -> String {
    let mut text = String::new();
    for i in 0..8 {
        let [x, y, z] = [i & 1, i >> 1 & 1, i >> 2].map(|bit| f64::from(bit) - 0.5);
        writeln!(text, "v {x} {y} {z}").unwrap();
    }
    for [a, b, c, d] in faces {
        writeln!(text, "f {} {} {} {}", a + 1, b + 1, c + 1, d + 1).unwrap();
    }
    text
}

const FACES: [[usize; 4]; 6] = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3]];

#[test]
fn a_cut_cube_is_closed_where_it_is_cut_and_an_open_one_is_told() {
    let place = Place::new("");
    place.write("cube.obj", cube(&FACES));
    // The plane z = 0.2 crosses the face that is left out.
    place.write("open.obj", cube(&FACES[1..]));
    let scene = |file: &str| {
        format!(
            "{}[[object]]\nname = 'cube'\nmesh = '{file}'\nspacing = 0.02\nclip = [{{ normal = [0, 0, 1], point = [0, 0, 0.2] }}]\n\
             [ambient]\ncolor = [1, 1, 1]\n",
            parallel_view(2.0, 64)
        )
    };
    let depth = |file: &str| {
        let picture = draw_in(place.folder(), &scene(file), &["--layers", "depth"]);
        window(&picture.channel("depth.first.Z"), 64, 20..44, 20..44)
    };
    let lid = depth("cube.obj");
    let floor = depth("open.obj");
    let [nearest, farthest] = [lid[0], floor[0]];
    assert!(lid.iter().all(|z| (z - nearest).abs() < 1e-4), "{lid:?}");
    // The lid is 0.7 before the face that is seen through the open cube.
    assert!(
        floor.iter().all(|z| (z - farthest).abs() < 1e-4) && (farthest - nearest - 0.7).abs() < 1e-4,
        "{farthest} {nearest}"
    );
    place.write("open.toml", scene("open.obj"));
    let said = "open.obj: `clip` leaves 1 outline of it without a lid: the mesh is open there";
    place.expect(0, &["render", "open.toml", "-o", "a.png"], said);
    place.write("closed.toml", scene("cube.obj"));
    let out = place.expect(0, &["render", "closed.toml", "-o", "b.png"], "");
    assert!(!String::from_utf8_lossy(&out.stderr).contains("lid"));
}
