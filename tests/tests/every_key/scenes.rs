//! A small scene for every source, with its data.

use organza::scene::{LoadOptions, Override, Scene, load};
use organza_tests::hdr;
use std::fmt::Write;
use std::path::Path;

/// Width and height of the pictures, pixels.
pub(crate) const SIZE: [u32; 2] = [24, 18];

/// A source: its name in the tables, its kind, and its keys.
pub(crate) struct SourceCase {
    pub(crate) name: &'static str,
    pub(crate) is_medium: bool,
    keys: &'static str,
}

const fn case(name: &'static str, is_medium: bool, keys: &'static str) -> SourceCase {
    SourceCase { name, is_medium, keys }
}

const TRANSFER: &str = "transfer = [{ value = 0, color = [1, 0.5, 0.2], extinction = 0.5 }, \
                        { value = 1, color = [0.2, 0.6, 1], extinction = 4 }]";

/// All sources; data with and without colours where it can have some.
pub(crate) const SOURCES: [SourceCase; 15] = [
    case("mesh", false, "mesh = 'colored.ply'"),
    case("plain mesh", false, "mesh = 'plain.ply'"),
    case("points", false, "points = 'colored.xyz'"),
    case("plain points", false, "points = 'plain.xyz'"),
    case("volume", true, "volume = 'grid.nrrd'"),
    case(
        "implicit",
        false,
        "implicit = { expression = 'x^2 + y^2 + 2*z^2 - 0.3 + 0.2*x', box = [[-0.9, -0.9, -0.9], [0.9, 0.9, 0.9]], resolution = 12 }",
    ),
    case("isosurface", false, "isosurface = { volume = 'grid.nrrd', level = 0.85 }"),
    case("level_set", false, "level_set = { points = 'ball.xyz' }\nspacing = 0.2"),
    case(
        "union",
        false,
        "union = [{ isosurface = { volume = 'grid.nrrd', level = 0.85 } }, \
          { implicit = { expression = '(x - 0.3)^2 + y^2 + z^2 - 0.1', box = [[-0.1, -0.4, -0.4], [0.7, 0.4, 0.4]], spacing = 0.1 } }]",
    ),
    case(
        "slice",
        false,
        "slice = { volume = 'grid.nrrd', center = [0, 0, 0], normal = [0.2, 0.3, 1] }\n\
          transfer = [{ value = 0, color = [1, 0.5, 0.2] }, { value = 1, color = [0.2, 0.6, 1] }]",
    ),
    case(
        "density",
        true,
        "density = { expression = '1.2 + x - y - 2*z', box = [[-0.6, -0.6, -0.6], [0.6, 0.6, 0.6]], resolution = 10 }",
    ),
    case("cloud", true, "cloud = { ellipsoids = [{ center = [0, 0, 0], radii = [0.7, 0.5, 0.6] }], spacing = 0.12 }"),
    case("rectangle", false, "rectangle = { center = [0, 0, 0], u = [0.6, 0, 0.2], v = [0, 0.5, 0.1], spacing = 0.1 }"),
    case("medium_box", true, "medium_box = { min = [-0.5, -0.4, -0.5], max = [0.5, 0.6, 0.5], spacing = 0.12 }"),
    case("medium_ball", true, "medium_ball = { center = [0, 0.1, 0], radius = 0.6, spacing = 0.12 }"),
];

/// The scenes' data in a folder that is gone in the end.
pub(crate) struct Folder(tempfile::TempDir);

impl Folder {
    pub(crate) fn new() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
        let sky = hdr([8, 4], |x, y| [20 * x as u8 + 9, 60, 40 * y as u8, 128]);
        std::fs::write(folder.path().join("sky.hdr"), sky).unwrap();
        let bright = hdr([4, 4], |x, y| [90, 50 * x as u8, 60 * y as u8, 129]);
        std::fs::write(folder.path().join("bright.hdr"), bright).unwrap();
        let images = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/footprints");
        std::fs::create_dir(folder.path().join("leaves")).unwrap();
        std::fs::copy(images.join("leaf.png"), folder.path().join("leaf.png")).unwrap();
        std::fs::copy(images.join("maple.png"), folder.path().join("leaves/maple.png")).unwrap();
        write("colored.ply", &ply(true, 0.7));
        write("plain.ply", &ply(false, 0.7));
        write("other.ply", &ply(true, 0.4));
        write("colored.xyz", &sheet(true, 0.08));
        write("plain.xyz", &sheet(false, 0.08));
        write("other.xyz", &sheet(true, 0.05));
        write("hot.xyz", &hot());
        write("ball.xyz", &ball(0.6));
        write("larger.xyz", &ball(0.75));
        write("grid.nrrd", &nrrd("", 1.0));
        write("other.nrrd", &nrrd("", 0.6));
        write("labels.nrrd", &labels());
        write("labels.toml", "1 = { color = '#ff2000' }\n2 = { color = '#20ff00' }\n");
        write("arrays.vtk", &arrays());
        write("series.nrrd", &series());
        write("body.nrrd", &nrrd("space: right-anterior-superior\n", 1.0));
        Self(folder)
    }

    /// A wall, a blocker between it and the light, and `it` before the wall.
    pub(crate) fn scene(
        &self,
        source: &str,
        overrides: &[String],
        frame: Option<u32>,
    ) -> Result<Scene, organza::Error> {
        let case = super::SOURCES.iter().find(|s| s.name == source).unwrap();
        let material = if case.is_medium {
            "medium = { extinction = 3.0, albedo = 0.8, asymmetry = 0.2 }"
        } else {
            "opacity = 0.5"
        };
        let transfer = if case.name == "volume" { TRANSFER } else { "" };
        let text = format!(
            "version = 1\n[camera]\nposition = [0.3, 0.4, 4]\ntarget = [0, 0, 0]\nsize = [{}, {}]\n\
             [background]\ncolor = [0.1, 0.2, 0.3]\n[ambient]\ncolor = [0.06, 0.05, 0.04]\n\
             [[light]]\nkind = 'point'\nposition = [1, 1.5, 3]\nintensity = [20, 18, 16]\n\
             [material.m]\n{material}\n[material.other]\nopacity = 0.8\n\
             medium = {{ extinction = 1, albedo = 0.3 }}\n\
             [[object]]\nname = 'wall'\n\
             rectangle = {{ center = [0, 0, -1.2], u = [2, 0, 0], v = [0, 2, 0], spacing = 0.2 }}\n\
             [[object]]\nname = 'blocker'\nrectangle = {{ center = [0.67, 0.64, 1.5], u = [0.15, -0.1, 0], \
             v = [0.1, 0.15, -0.108], spacing = 0.05 }}\n\
             [[object]]\nname = 'it'\nmaterial = 'm'\n{}\n{transfer}\n\
             [render]\nparticles = {{ repeat_level = 4 }}\n",
            SIZE[0], SIZE[1], case.keys
        );
        let path = self.0.path().join("scene.toml");
        std::fs::write(&path, text).unwrap();
        let overrides = overrides.iter().map(|o| Override::parse(o)).collect::<Result<_, _>>()?;
        Ok(load(&path, &LoadOptions { overrides, frame, ..LoadOptions::default() })?)
    }

    /// The displayed picture.
    pub(crate) fn png(&self, render: &organza::Render, exposure: f64) -> String {
        let metadata = organza::output::Metadata { exposure, ..Default::default() };
        let path = self.0.path().join("picture.png");
        let target = organza::output::Target::new(&path, false).unwrap();
        organza::output::write(&render.layers, &metadata, &target, &organza::output::Params::default()).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        std::fs::remove_file(&path).unwrap();
        format!("{bytes:?}")
    }
}

/// A picture as text in which every bit counts.
pub(crate) fn bits(picture: &[[f32; 3]]) -> String {
    let mut text = String::new();
    picture.iter().flatten().for_each(|v| write!(text, "{:x} ", v.to_bits()).unwrap());
    text
}

/// A lopsided octahedron.
fn ply(colored: bool, size: f64) -> String {
    let mut text =
        String::from("ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\n");
    if colored {
        text += "property uchar red\nproperty uchar green\nproperty uchar blue\n";
    }
    text += "element face 8\nproperty list uchar int vertex_indices\nend_header\n";
    let at = [[1.0, 0.0, 0.0], [-0.7, 0.1, 0.0], [0.0, 1.0, 0.1], [0.0, -0.8, 0.0], [0.0, 0.0, 0.9], [0.1, 0.0, -0.6]];
    for (i, p) in at.iter().enumerate() {
        write!(text, "{} {} {}", p[0] * size, p[1] * size, p[2] * size).unwrap();
        text += &if colored { format!(" {} {} {}\n", 40 * i + 40, 200 - 30 * i, 120) } else { "\n".to_owned() };
    }
    for (x, y, z) in (0..8).map(|k| (k & 1, 2 + (k >> 1 & 1), 4 + (k >> 2 & 1))) {
        let even = (x + y + z) % 2 == 0;
        text += &if even { format!("3 {x} {y} {z}\n") } else { format!("3 {y} {x} {z}\n") };
    }
    text
}

/// A bent sheet of 16 by 16 points, one of them twice.
fn sheet(colored: bool, step: f64) -> String {
    let mut text = String::from(if colored { "x y z red green blue\n" } else { "x y z\n" });
    let point = |i: i32| {
        let x = f64::from(i % 16 - 8) * step;
        let y = f64::from(i / 16 - 8) * step;
        let color = if colored { format!(" {} {} {}", 100 + i / 2, 200 - i / 2, 90) } else { String::new() };
        format!("{:.6} {:.6} {:.6}{color}\n", x + 0.01 * step, y + 0.01 * step, 0.01 + 0.05 * (3.0 * x).sin().abs())
    };
    (0..256).chain([0]).for_each(|i| text += &point(i));
    text
}

/// The sheet with a column of its own.
fn hot() -> String {
    let sheet = sheet(false, 0.08);
    let lines = sheet.lines().enumerate();
    lines.map(|(i, line)| if i == 0 { format!("{line} heat\n") } else { format!("{line} {i}\n") }).collect()
}

/// Points with normals on a flattened ball.
fn ball(radius: f64) -> String {
    let mut text = String::from("x y z nx ny nz\n");
    for i in 0..400 {
        let y = 1.0 - (2.0 * f64::from(i) + 1.0) / 400.0;
        let angle = 2.399_963_229_728_653 * f64::from(i);
        let r = (1.0 - y * y).sqrt();
        let x = r * angle.cos();
        let z = r * angle.sin();
        let nx = x;
        let ny = y / 0.7;
        let nz = z;
        let n = (nx * nx + ny * ny + nz * nz).sqrt();
        writeln!(text, "{} {} {} {} {} {}", radius * x, radius * 0.7 * y, radius * z, nx / n, ny / n, nz / n).unwrap();
    }
    text
}

/// Two arrays of 3³ values on cells of 0.4.
fn arrays() -> String {
    let values =
        |power: i32| (0..27).map(|i| (f64::from(i) / 26.0).powi(power).to_string()).collect::<Vec<_>>().join(" ");
    format!(
        "# vtk DataFile Version 3.0\narrays\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 3 3\nORIGIN -0.4 -0.4 -0.4\n\
         SPACING 0.4 0.4 0.4\nPOINT_DATA 27\nFIELD all 2\nfirst 1 27 float\n{}\nother 1 27 float\n{}\n",
        values(1),
        values(3)
    )
}

/// A lopsided blob of 6³ values from 0 to 1 on cells of 0.2.
fn nrrd(space: &str, most: f64) -> String {
    let text = format!(
        "NRRD0004\ntype: float\ndimension: 3\n{space}sizes: 6 6 6\nspace directions: (0.2,0,0) (0,0.2,0) (0,0,0.2)\n\
         space origin: (-0.5,-0.5,-0.5)\nencoding: ascii\n\n"
    );
    text + &blob(most)
}

/// Two labels side by side, in nothing, on cells of 0.2.
fn labels() -> String {
    let inside = |n: i32| (1..5).contains(&n);
    let label = |k: i32| match [k % 6, k / 6 % 6, k / 36] {
        [x, y, z] if inside(x) && inside(y) && inside(z) => 1 + i32::from(x > 2),
        _ => 0,
    };
    let header = nrrd("", 1.0).split_once("\n\n").unwrap().0.replace("float", "uchar");
    header + "\n\n" + &(0..216).map(|k| format!("{}\n", label(k))).collect::<String>()
}

/// The blob and a fainter one as a series.
fn series() -> String {
    let header = nrrd("kinds: domain domain domain time\n", 1.0).split_once("\n\n").unwrap().0.to_owned();
    let header = header.replace("dimension: 3", "dimension: 4").replace("6 6 6", "6 6 6 2");
    header.replace("(0,0,0.2)", "(0,0,0.2) none") + "\n\n" + &blob(1.0) + &blob(0.9)
}

/// The values of the blob, a line each.
fn blob(most: f64) -> String {
    let mut text = String::new();
    for k in 0..216 {
        let at = |n: i32| 0.2 * f64::from(n) - 0.5;
        let x = at(k % 6);
        let y = at(k / 6 % 6);
        let z = at(k / 36);
        writeln!(
            text,
            "{}",
            most * (1.0 - 1.2 * (x * x + 1.5 * y * y + 0.6 * z * z) + 0.4 * y + 0.1 * z).clamp(0.01, 1.0)
        )
        .unwrap();
    }
    text
}

/// The guide to scene files.
pub(crate) fn guide() -> String {
    std::fs::read_to_string(Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/scene.md")).unwrap()
}
