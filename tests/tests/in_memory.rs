//! Data that a program hands over draws the picture of the file that holds the same.

use organza::scene::{LoadOptions, parse};
use organza::{InMemory, Progress, RenderOptions, SourceData};
use read::{Loaded, ReadParams};
use splat_core::Layers;
use std::path::Path;

const VIEW: &str = "version = 1\n[camera]\nauto = true\nsize = [40, 32]\n\
                    [[light]]\nkind = 'directional'\ndirection = [-0.5, -1, -0.4]\nirradiance = [3, 3, 3]\n";

/// An asset, and the name that the scene gives it in memory.
struct Handed {
    name: &'static str,
    asset: &'static str,
    /// Columns of points that a reader keeps.
    columns: &'static [&'static str],
    /// Whether an image says how much of each place something covers.
    is_coverage: bool,
}

impl Handed {
    fn new(name: &'static str, asset: &'static str) -> Self {
        Self { name, asset, columns: &[], is_coverage: false }
    }

    fn read(&self) -> SourceData {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets").join(self.asset);
        let columns = self.columns.iter().map(|column| (*column).to_owned()).collect();
        let params = ReadParams { columns, is_coverage: self.is_coverage, ..ReadParams::default() };
        match read::file(&path, &params, None).unwrap().0 {
            Loaded::Mesh(mesh) => SourceData::Mesh(mesh.into()),
            Loaded::Points(points) => SourceData::Points(points.into()),
            Loaded::Grid(grid) => SourceData::Grid(grid.into()),
            Loaded::Image(image) => SourceData::Image(image.into()),
            _ => unreachable!("every kind is known"),
        }
    }
}

fn drawn(text: &str, in_memory: InMemory) -> Layers {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../assets/s.toml");
    let load = LoadOptions { allow_path: true, in_memory, ..LoadOptions::default() };
    let scene = parse(&file, text.as_bytes(), &load).unwrap();
    organza::render(&scene, &RenderOptions::default(), &Progress::new()).unwrap().layers
}

/// Draws a scene whose sources are handed over, and the one that names their files.
#[track_caller]
fn draws_the_same(text: &str, handed: &[Handed]) {
    let mut of_files = text.to_owned();
    let mut in_memory = InMemory::default();
    for data in handed {
        of_files = of_files.replace(&format!("memory:{}", data.name), data.asset);
        in_memory.insert(data.name, data.read()).unwrap();
    }
    assert!(!of_files.contains("memory:"), "{of_files}");
    let file = drawn(&of_files, InMemory::default());
    let memory = drawn(text, in_memory);
    assert_eq!(file, memory);
    assert!(memory.scalar("alpha").unwrap().iter().any(|alpha| *alpha > 0.1), "it shows nothing");
}

#[test]
fn a_mesh_in_memory_is_that_of_its_file() {
    let object = "[[object]]\nname = 'dart'\nmesh = 'memory:dart'\nopacity = 0.5\n";
    for technique in ["points", "particles", "sheets", "surfels"] {
        let text = format!("{VIEW}{object}[render]\ntechnique = '{technique}'\n");
        draws_the_same(&text, &[Handed::new("dart", "meshes/dart.off")]);
    }
}

#[test]
fn points_in_memory_have_their_columns() {
    let color_by = "color_by = { column = 'band', map = 'magma' }";
    let text = format!(
        "{VIEW}[[object]]\nname = 'lines'\npoints = 'memory:of lines'\n{color_by}\n[render]\ntechnique = 'points'\n"
    );
    let columns = &["band"];
    draws_the_same(&text, &[Handed { columns, ..Handed::new("of lines", "points/lines.csv") }]);
}

#[test]
fn volumes_and_their_isosurfaces_may_lie_in_memory() {
    let transfer = "transfer = [{ value = 0, color = [1, 1, 1], extinction = 0 }, { value = 1, color = [1, 0.5, 0.2], extinction = 3 }]";
    let volume = format!("[[object]]\nname = 'cell'\nvolume = 'memory:cell'\n{transfer}\n");
    let surface = "[[object]]\nname = 'level'\nisosurface = { volume = 'memory:cell', level = 0.1 }\nopacity = 0.3\n";
    for technique in ["points", "sheets"] {
        let text = format!("{VIEW}{volume}{surface}[render]\ntechnique = '{technique}'\n");
        draws_the_same(&text, &[Handed::new("cell", "trilinear-cell/cell.nrrd")]);
    }
}

#[test]
fn environments_and_footprints_may_lie_in_memory() {
    let view = VIEW.replace("[[light]]", "[background]\nenvironment = 'memory:sky'\n[[light]]");
    let text = format!(
        "footprints = [{{ image = 'memory:leaf' }}]\n{view}[[object]]\nname = 'hedge'\npoints = 'memory:hedge'\nfootprint = 0\n\
         [render]\ntechnique = 'points'\n"
    )
    .replace("version = 1\n", "");
    let text = format!("version = 1\n{text}");
    let leaf = Handed { is_coverage: true, ..Handed::new("leaf", "footprints/leaf.png") };
    let hedge = Handed::new("hedge", "points/hedge.csv");
    draws_the_same(&text, &[Handed::new("sky", "environment/sky.hdr"), leaf, hedge]);
}

#[test]
fn what_is_not_in_memory_is_refused_by_name() {
    let text = format!("{VIEW}[[object]]\nname = 'a'\nmesh = 'memory:dart'\n");
    let refused = |in_memory: InMemory| {
        let load = LoadOptions { in_memory, ..LoadOptions::default() };
        parse(Path::new("s.toml"), text.as_bytes(), &load).unwrap_err().to_string()
    };
    assert!(refused(InMemory::default()).contains("no data in memory is called `dart`"));
    let mut in_memory = InMemory::default();
    in_memory.insert("arrow", Handed::new("arrow", "meshes/dart.off").read()).unwrap();
    let said = refused(in_memory);
    assert!(said.contains("s.toml:11:8: no data in memory"), "{said}");
    // A kind that the source does not take.
    let mut in_memory = InMemory::default();
    in_memory.insert("dart", Handed::new("dart", "points/lines.csv").read()).unwrap();
    let load = LoadOptions { in_memory, ..LoadOptions::default() };
    let scene = parse(Path::new("s.toml"), text.as_bytes(), &load).unwrap();
    let error = organza::render(&scene, &RenderOptions::default(), &Progress::new()).unwrap_err();
    assert!(error.to_string().contains("memory:dart") && error.to_string().contains("a mesh with faces"), "{error}");
}
