//! Fields are drawn whole: both signs, all labels, what lies around gaps, and the array that a file has; what was decided is said.

use organza_tests::{Place, picture_of};
use std::fmt::Write;

/// Values of a lattice of so many voxels by their places, 0 to 1 along each axis.
fn nrrd(kind: &str, sizes: [usize; 3], value: impl Fn([f64; 3]) -> f64) -> String {
    let [x, y, z] = sizes;
    let mut text = format!("NRRD0004\ntype: {kind}\ndimension: 3\nsizes: {x} {y} {z}\nencoding: ascii\n\n");
    for i in 0..x * y * z {
        let at = [i % x, i / x % y, i / (x * y)];
        writeln!(text, "{}", value(std::array::from_fn(|a| (at[a] as f64 + 0.5) / sizes[a] as f64))).unwrap();
    }
    text
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
}

/// What a command says, notes and warnings.
fn said(place: &Place, arguments: &[&str]) -> String {
    String::from_utf8_lossy(&place.expect(0, arguments, "").stderr).into_owned()
}

/// Opacities of a small picture, seen along −z, and what was said.
fn seen(place: &Place, file: &str, more: &[&str]) -> (Vec<f64>, String) {
    let view = [
        "render",
        file,
        "-o",
        "a.exr",
        "--force",
        "--size",
        "24x24",
        "--azimuth",
        "0",
        "--elevation",
        "0",
        "--up",
        "y",
    ];
    let said = said(place, &[&view[..], more].concat());
    (picture_of(&place.path("a.exr")).opacity(), said)
}

/// The most opaque pixel of the left and of the right half of a picture of 24 columns.
fn halves(alpha: &[f64]) -> [f64; 2] {
    let half = |right: bool| {
        alpha.iter().enumerate().filter(|(i, _)| (i % 24 >= 12) == right).map(|(_, a)| *a).fold(0.0, f64::max)
    };
    [half(false), half(true)]
}

#[test]
fn a_field_of_both_signs_shows_both() {
    let place = Place::new("");
    let ball = |p, x| (1.0 - distance(p, [x, 0.5, 0.5]) / 0.2).max(0.0);
    place.write("both.nrrd", nrrd("float", [16; 3], |p| ball(p, 0.75) - ball(p, 0.25)));
    let alpha = seen(&place, "both.nrrd", &[]).0;
    let [left, right] = halves(&alpha);
    let between = alpha[12 * 24 + 12];
    // One ball alone would stand in the middle of the picture.
    assert!(between < 0.1, "{between}");
    assert!(left > 0.3 && (left - right).abs() < 0.02, "{left} {right}");
}

#[test]
fn voxels_without_a_value_draw_nothing_and_are_counted() {
    let place = Place::new("");
    let ball = |p| if distance(p, [0.5; 3]) < 0.3 { 1.0 + p[0] } else { f64::NAN };
    place.write("gaps.nrrd", nrrd("float", [16; 3], ball));
    for technique in ["sheets", "points", "particles"] {
        let (alpha, said) = seen(&place, "gaps.nrrd", &["--technique", technique, "--repeat-level", "4"]);
        assert!(said.contains("of 4096 voxels are NaN: they draw nothing"), "{said}");
        // A ball of its diameter, and nothing in the corners of its box.
        let count = alpha.iter().filter(|a| **a > 0.05).count();
        assert!(alpha.iter().all(|a| a.is_finite()) && alpha[12 * 24 + 12] > 0.3, "{technique}");
        assert!((150..480).contains(&count), "{technique}: {count}");
    }
    // A scene whose transfer function is nowhere clear.
    place.write(
        "s.toml",
        "version = 1\n[camera]\nposition = [7.5, 7.5, 60]\ntarget = [7.5, 7.5, 7.5]\nfov_y = 20\nsize = [24, 24]\n[[object]]\nname = 'v'\n\
         volume = 'gaps.nrrd'\ntransfer = [{ value = 0, color = [1, 1, 1], extinction = 1 }]\n[ambient]\ncolor = [1, 1, 1]\n",
    );
    for technique in ["sheets", "points", "particles", "reference"] {
        place.expect(0, &["render", "s.toml", "--technique", technique, "-o", "b.exr", "--force"], "");
        let alpha = picture_of(&place.path("b.exr")).opacity();
        assert!(
            alpha[12 * 24 + 12] > 0.9 && alpha[4 * 24 + 4] < 0.05,
            "{technique}: {} {}",
            alpha[12 * 24 + 12],
            alpha[4 * 24 + 4]
        );
    }
}

#[test]
fn a_fill_value_is_told_taken_as_nothing_and_written_by_init() {
    let place = Place::new("");
    // A ball whose values rise along x and y, in nothing.
    let value = |p: [f64; 3]| 1.0 + p[0] + 0.1 * p[1];
    let ball = |nothing: f64| move |p: [f64; 3]| if distance(p, [0.5; 3]) < 0.3 { value(p) } else { nothing };
    place.write("gaps.nrrd", nrrd("float", [16; 3], ball(f64::NAN)));
    let expected = seen(&place, "gaps.nrrd", &[]).0;
    for fill in ["-9999", "1e20", "9.96921e36", "-3.4028235e38"] {
        place.write("fill.nrrd", nrrd("float", [16; 3], ball(fill.parse().unwrap())));
        let (alpha, told) = seen(&place, "fill.nrrd", &[]);
        assert!(alpha == expected, "{fill}");
        assert!(
            told.contains("of 4096 voxels have the value of `nodata`") && told.contains("they draw nothing"),
            "{told}"
        );
        place.expect(0, &["init", "fill.nrrd", "-o", "s.toml", "--force"], "");
        let text = String::from_utf8(place.bytes("s.toml")).unwrap();
        let line = text.lines().find(|line| line.starts_with("nodata = ")).unwrap().to_owned();
        // A scene without the key is warned of it.
        place.write("without.toml", text.replace(&line, ""));
        let told = said(&place, &["render", "without.toml", "--size", "8x8", "-o", "b.exr", "--force"]);
        let key = line.split(' ').take(3).collect::<Vec<_>>().join(" ");
        assert!(
            told.contains("warning: fill.nrrd: ") && told.contains(&format!("it looks like a fill value; {key} in")),
            "{told}"
        );
    }
    let told =
        said(&place, &["render", "s.toml", "--set", "object.fill.nodata=7", "--size", "8x8", "-o", "b.exr", "--force"]);
    assert!(told.contains("no voxel has the value of `nodata`, 7"), "{told}");
}

#[test]
fn a_hot_voxel_is_told_and_takes_no_digits_of_the_others() {
    let place = Place::new("");
    let field = |hot: f64| {
        let value = move |p: [f64; 3]| {
            if p.iter().all(|c| *c < 0.04) { hot } else { (-8.0 * distance(p, [0.5; 3]).powi(2)).exp() }
        };
        nrrd("float", [32; 3], value)
    };
    place.write("hot.nrrd", field(0.0));
    place.expect(0, &["init", "hot.nrrd", "-o", "s.toml", "--size", "48x48", "--force"], "");
    let draw = |output: &str| said(&place, &["render", "s.toml", "-o", output, "--technique", "sheets"]);
    draw("plain.exr");
    place.write("hot.nrrd", field(1e6));
    let told = draw("hot.exr");
    assert!(told.contains("1 of 32768 voxels lies far from all others, with 1000000"), "{told}");
    let [plain, hot] = ["plain.exr", "hot.exr"].map(|name| picture_of(&place.path(name)).opacity());
    // Its own corner is seen at the lower left; at the upper right noise in the rim was up to 0.23.
    let differences = (2..20).flat_map(|y| (26..46).map(move |x| y * 48 + x)).map(|i| (plain[i] - hot[i]).abs());
    let most = differences.fold(0.0, f64::max);
    assert!(most < 1e-3 && plain[24 * 48 + 24] > 0.1, "{most}");
}

#[test]
fn no_label_is_thinner_than_another() {
    let place = Place::new("");
    // Four bars along z with the labels 1, 2, 3 and 40.
    let label = |p: [f64; 3]| {
        let inside = |c: f64| (0.2..0.8).contains(&(2.0 * c).fract());
        let rank = usize::from(p[0] > 0.5) + 2 * usize::from(p[1] > 0.5);
        if inside(p[0]) && inside(p[1]) { [1.0, 2.0, 3.0, 40.0][rank] } else { 0.0 }
    };
    place.write("labels.nrrd", nrrd("short", [20, 20, 8], label));
    let (alpha, told) = seen(&place, "labels.nrrd", &[]);
    assert!(told.contains("whole numbers that look like 4 labels: each region has its surface"), "{told}");
    let quarter = |alpha: &[f64], right: bool, low: bool| {
        let here = |i: usize| (i % 24 >= 12) == right && (i / 24 >= 12) == low;
        alpha.iter().enumerate().filter(|(i, _)| here(*i)).map(|(_, a)| *a).fold(0.0, f64::max)
    };
    let quarters =
        |alpha: &[f64]| [[false, false], [true, false], [false, true], [true, true]].map(|[r, l]| quarter(alpha, r, l));
    let expected = quarters(&alpha);
    for technique in ["points", "surfels", "sheets", "particles", "reference"] {
        let (of_technique, _) = seen(&place, "labels.nrrd", &["--technique", technique]);
        assert!(quarters(&of_technique).iter().all(|a| *a > 0.8), "{technique}: {:?}", quarters(&of_technique));
    }
    // One bar alone would stand in the middle of the picture.
    assert!(expected.iter().all(|a| *a > 0.8) && alpha[12 * 24 + 12] < 0.1, "{expected:?} {}", alpha[12 * 24 + 12]);
}

const FOAM: &str = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\n\
    POINT_DATA 8\nFIELD a 3\nU 3 8 float\n0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0\np 1 8 float\n0.5 1 2 3 4 5 6 7\n\
    T 1 8 float\n7 6 5 4 3 2 1 0.5\n";

#[test]
fn an_array_of_a_vtk_file_is_drawn_said_and_can_be_chosen() {
    let place = Place::new("");
    place.write("foam.vtk", FOAM);
    let (first, told) = seen(&place, "foam.vtk", &[]);
    assert!(told.contains("the array p is drawn; `array` of a scene or --color-by chooses another: T"), "{told}");
    let (other, _) = seen(&place, "foam.vtk", &["--color-by", "T"]);
    assert!(first != other);
    place.expect(0, &["init", "foam.vtk", "--color-by", "T", "-o", "t.toml"], "");
    assert!(String::from_utf8(place.bytes("t.toml")).unwrap().contains("\narray = \"T\"\n"));
    place.expect(
        3,
        &["render", "foam.vtk", "--color-by", "q", "-o", "q.png"],
        "expected an array among p, T, U:magnitude, found 'q'",
    );
    place.expect(3, &["render", "t.toml", "--set", "object.foam.array='U:w'", "-o", "q.png"], "found 'U:w'");
}

/// Balls at these places along x, in a grid whose steps are twice as long in the middle.
fn steps(balls: &[f64]) -> String {
    let along: Vec<f64> = (0..16).map(|i| [0.0, 0.05][usize::from(i > 7)] + 0.05 * f64::from(i)).collect();
    let mut values = String::new();
    for k in &along {
        for j in &along {
            for i in &along {
                let ball = |x: &f64| (1.0 - distance([*i, *j, *k], [*x, 0.4, 0.4]) / 0.15).max(0.0);
                write!(values, "{} ", balls.iter().map(ball).sum::<f64>()).unwrap();
            }
        }
    }
    let numbers = along.iter().map(|c| format!("{c} ")).collect::<String>();
    let array = |name: &str, text: &str| {
        format!("<DataArray type=\"Float32\" Name=\"{name}\" format=\"ascii\">{text}</DataArray>")
    };
    format!(
        "<VTKFile type=\"RectilinearGrid\" byte_order=\"LittleEndian\"><RectilinearGrid WholeExtent=\"0 15 0 15 0 15\">\
         <Piece Extent=\"0 15 0 15 0 15\"><PointData>{}</PointData><Coordinates>{}{}{}</Coordinates></Piece></RectilinearGrid></VTKFile>",
        array("p", &values),
        array("x", &numbers),
        array("y", &numbers),
        array("z", &numbers)
    )
}

#[test]
fn a_series_of_files_is_drawn_by_its_times() {
    let place = Place::new("");
    place.write("one.vtr", steps(&[0.4]));
    place.write("two.vtr", steps(&[0.15, 0.65]));
    place.write(
        "a.pvd",
        "<VTKFile type=\"Collection\"><Collection><DataSet timestep=\"2\" file=\"two.vtr\"/>\
         <DataSet timestep=\"1\" file=\"one.vtr\"/></Collection></VTKFile>",
    );
    let (alpha, told) = seen(&place, "a.pvd", &[]);
    // One ball stands in the middle of the picture, and two beside it.
    let middle = |alpha: &[f64]| alpha[12 * 24 + 12];
    assert!(middle(&alpha) > 0.3, "{}", middle(&alpha));
    assert!(told.contains("time 1, 0 of 2 counted from 0; `frame` chooses another"), "{told}");
    assert!(told.contains("voxels of even steps; at the points of the file the values differ by at most"), "{told}");
    place.write(
        "s.toml",
        "version = 1\n[camera]\nauto = true\nazimuth = 0\nelevation = 0\nsize = [24, 24]\n[ambient]\ncolor = [1, 1, 1]\n[[object]]\n\
         name = 'a'\nvolume = 'a.pvd'\nframe = 1\nunit_length = 0.05\ntransfer = [{ value = 0, color = [1, 1, 1], opacity = 0 }, \
         { value = 1, color = [1, 1, 1], opacity = 0.9 }]\n",
    );
    said(&place, &["render", "s.toml", "-o", "b.exr"]);
    let alpha = picture_of(&place.path("b.exr")).opacity();
    let [left, right] = halves(&alpha);
    assert!(middle(&alpha) < 0.1 && left > 0.3 && (left - right).abs() < 0.02, "{} {left} {right}", middle(&alpha));
    let beyond = ["render", "s.toml", "-o", "c.exr", "--set", "object.a.frame=2"];
    place.expect(3, &beyond, "expected a `frame` from 0 to 1, as the file has 2 volumes");
    let info = String::from_utf8(place.expect(0, &["info", "a.pvd"], "").stdout).unwrap();
    assert!(info.contains("volume, read as VtkXml"), "{info}");
}

/// What is scaled is as dense as it was.
#[test]
fn the_opacity_of_a_volume_follows_its_scale() {
    let place = Place::new("");
    place.write("box.nrrd", nrrd("float", [8; 3], |_| 1.0));
    let alpha = |scale: f64| {
        place.write(
            "s.toml",
            format!(
                "version = 1\n[camera]\nposition = [0, 0, {}]\ntarget = [0, 0, 0]\nsize = [9, 9]\nfov_y = 20\n[ambient]\ncolor = [1, 1, 1]\n\
                 [[object]]\nname = 'box'\nvolume = 'box.nrrd'\nunit_length = 8\n\
                 transfer = [{{ value = 0, color = [1, 1, 1], opacity = 0.5 }}]\n\
                 transform = {{ scale = {scale}, translate = [{t}, {t}, {t}] }}\n",
                60.0 * scale,
                t = -3.5 * scale
            ),
        );
        place.expect(0, &["render", "s.toml", "--technique", "sheets", "-o", "a.exr", "--force"], "");
        picture_of(&place.path("a.exr")).opacity()[4 * 9 + 4]
    };
    for scale in [1.0, 0.01, 30.0] {
        // Half of the light over its eight steps.
        assert!((alpha(scale) - 0.5).abs() < 0.01, "{scale}: {}", alpha(scale));
    }
}

#[test]
fn which_axis_points_up_is_said_where_nothing_says_it() {
    let place = Place::new("");
    place.write(
        "ground.xyz",
        (0..400).map(|i| format!("{} {} {}\n", i % 20, i / 20, f64::from(i % 7) * 0.1)).collect::<String>(),
    );
    place.write("cone.obj", "v -1 -1 3\nv 1 -1 3\nv 0 1 3\nv 0 0 6\nf 1 2 4\nf 2 3 4\nf 3 1 4\nf 3 2 1\n");
    let told = |file: &str, more: &[&str]| {
        said(&place, &[&["render", file, "-o", "a.png", "--force", "--size", "8x6"][..], more].concat())
    };
    let lying = told("ground.xyz", &[]);
    assert!(
        lying.contains(
            "ground.xyz: nothing in it says which axis points up, so z does, along which it stands: --up y turns it"
        ),
        "{lying}"
    );
    let standing = told("cone.obj", &[]);
    assert!(
        standing.contains("cone.obj: nothing in it says which axis points up, so y does: --up z turns it"),
        "{standing}"
    );
    assert!(!told("cone.obj", &["--up", "z"]).contains("points up"));
    place.write(
        "s.toml",
        "version = 1\ncamera = \"auto\"\n[ambient]\ncolor = [1, 1, 1]\n[[object]]\nname = 'cone'\nmesh = 'cone.obj'\n",
    );
    let explained = place.expect(0, &["explain", "s.toml"], "");
    let text = String::from_utf8_lossy(&explained.stdout).into_owned();
    assert!(text.contains("cone: y points up, as the file states no axis: transform = { up = \"z\" }"), "{text}");
    assert!(text.contains("of memory") && !text.contains("e0"), "{text}");
}

#[test]
fn points_in_degrees_beside_heights_in_metres_are_seen_and_said() {
    let place = Place::new("");
    let mut text = String::new();
    for i in 0..900 {
        let x = f64::from(i % 30) * 1e-5;
        let y = f64::from(i / 30) * 1e-5;
        writeln!(text, "{:.8} {:.8} {:.3}", -71.05 + x, 42.36 + y, 2.0 + 2.0 * (9e4 * x).sin()).unwrap();
    }
    place.write("degrees.xyz", text);
    let told = said(&place, &["render", "degrees.xyz", "-o", "a.exr", "--size", "24x24"]);
    assert!(told.contains("x and y look like degrees beside heights in metres"), "{told}");
    assert!(!told.contains("the picture is"), "{told}");
    let alpha = picture_of(&place.path("a.exr")).opacity();
    let count = alpha.iter().filter(|a| **a > 0.5).count();
    assert!(count > 100, "{count}");
    // A pole in metres, as high as it is thin.
    let pole: String = (0..200)
        .map(|i| format!("{} {} {}\n", 3.0 + f64::from(i % 3) * 0.5, 4.0 + f64::from(i % 2) * 0.5, f64::from(i)))
        .collect();
    place.write("pole.xyz", pole);
    assert!(!said(&place, &["render", "pole.xyz", "-o", "b.png", "--size", "8x6"]).contains("degrees"));
}

#[test]
fn colours_of_points_without_light_are_no_scene_without_light() {
    let place = Place::new("");
    place.write(
        "p.xyz",
        "x y z red green blue\n0 0 0 200 100 50\n1 0 0 200 100 50\n0 1 0 200 100 50\n1 1 0 200 100 50\n",
    );
    let scene = "version = 1\ncamera = \"auto\"\n[[object]]\nname = 'p'\npoints = 'p.xyz'\n";
    place.write("s.toml", scene);
    let told = |scene: &str| said(&place, &["render", scene, "-o", "a.png", "--force", "--set", "camera.size=[8, 6]"]);
    assert!(!told("s.toml").contains("the scene has no light"), "{}", told("s.toml"));
    place.write("lit.toml", format!("{scene}unlit = false\n"));
    assert!(told("lit.toml").contains("the scene has no light"));
    place.write("t.json", "{\"asset\": {\"version\": \"1.0\"}, \"geometricError\": 500, \"root\": {}}");
    place.expect(3, &["render", "t.json", "-o", "t.png"], "a tileset of 3D Tiles, which is not read");
    place.write("color.toml", format!("{scene}color = [1, 0, 0]\ncolor_by = {{ column = \"z\" }}\n"));
    place.expect(3, &["render", "color.toml", "-o", "c.png"], "remove the key `color` of the object");
}
