//! Files of VTK that name others: pieces, blocks and times.
#![cfg(all(feature = "vti", feature = "vtk"))]

use crate::read_samples::cells::{vtp, vtp_pieces, vtu, vtu_pieces};
use crate::read_samples::grids::{array, linear, vtk_file, vts, vtu_of, words};
use crate::read_samples::{gzip, load};
use read::{Fault, Loaded, Notes, ReadError, ReadParams, file};
use splat_core::{Grid, MemoryAccount};
use std::fs;
use std::path::{Path, PathBuf};

/// A folder for the files of one test.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join("lists").join(name);
        fs::create_dir_all(folder.join("below")).unwrap();
        Self(folder)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::write(self.0.join(name), content).unwrap();
    }

    fn read_with(&self, name: &str, params: &ReadParams) -> Result<(Loaded, Notes), ReadError> {
        file(&self.0.join(name), params, None)
    }

    fn read(&self, name: &str) -> (Loaded, Notes) {
        self.read_with(name, &ReadParams::default()).unwrap_or_else(|e| panic!("{e}"))
    }

    fn grid(&self, name: &str) -> (Grid, Notes) {
        match self.read(name) {
            (Loaded::Grid(grid), notes) => (grid, notes),
            other => panic!("not a grid: {other:?}"),
        }
    }

    #[track_caller]
    fn refused(&self, name: &str, expected: &str) {
        let error = self.read_with(name, &ReadParams::default()).unwrap_err();
        assert!(error.to_string().contains(expected), "{error}");
    }
}

/// A list of pieces of a dataset; `more` are attributes of the dataset.
fn pieces(kind: &str, more: &str, files: &[&str]) -> String {
    let pieces: String = files.iter().map(|name| format!("<Piece Source=\"{name}\"/>\n")).collect();
    vtk_file(kind, &format!("<{kind} GhostLevel=\"0\" {more}>\n<PPointData/>\n{pieces}</{kind}>\n"))
}

/// A dataset of blocks, of which all but the first are nested.
fn blocks(files: &[&str]) -> String {
    let block = |name: &&str| format!("<DataSet index=\"0\" file=\"{name}\"/>\n");
    let nested: String = files[1..].iter().map(block).collect();
    let content = format!(
        "<vtkMultiBlockDataSet>\n{}<Block index=\"1\">{nested}</Block>\n</vtkMultiBlockDataSet>\n",
        block(&files[0])
    );
    vtk_file("vtkMultiBlockDataSet", &content)
}

/// The pieces of a file of several as files of one each.
fn split(content: &[u8]) -> Vec<String> {
    let text = String::from_utf8(content.to_vec()).unwrap();
    let (head, rest) = text.split_once("<Piece").unwrap();
    let (pieces, tail) = rest.rsplit_once("</Piece>").unwrap();
    pieces
        .split("</Piece>")
        .map(|piece| {
            let piece = piece.trim_start().strip_prefix("<Piece").unwrap_or(piece);
            format!("{head}<Piece{piece}</Piece>{tail}")
        })
        .collect()
}

#[test]
fn pieces_in_files_are_what_they_are_in_one() {
    let folder = Folder::new("pieces");
    let of_cells = split(&vtu_pieces("ascii", false));
    assert_eq!(of_cells.len(), 3);
    of_cells.iter().enumerate().for_each(|(i, piece)| folder.write(&format!("below/a_{i}.vtu"), piece));
    let names = ["below/a_0.vtu", "below/a_1.vtu", "below/a_2.vtu"];
    folder.write("a.pvtu", pieces("PUnstructuredGrid", "", &names));
    let (found, notes) = folder.grid("a.pvtu");
    let Loaded::Grid(expected) = load("a.vtu", &vtu_pieces("ascii", false)).unwrap() else { panic!("no volume") };
    assert_eq!(found, expected);
    assert_eq!(notes.unused, ["CellData.of_cells", "1 cell without a volume"]);
    assert_eq!(notes.format, "VtkXml");
    // One of them inside gzip, and names as addresses.
    folder.write("below/a 0.vtu.gz", gzip(of_cells[0].as_bytes()));
    folder.write("b.pvtu", pieces("PUnstructuredGrid", "", &["below/a%200.vtu.gz", names[1], names[2]]));
    assert_eq!(folder.grid("b.pvtu").0, expected);
    // A list of one file is that file.
    folder.write("whole.vtu", vtu("binary", true));
    folder.write("one.pvtu", pieces("PUnstructuredGrid", "", &["whole.vtu"]));
    assert_eq!(folder.grid("one.pvtu").0, folder.grid("whole.vtu").0);
    let of_faces = split(&vtp_pieces());
    of_faces.iter().enumerate().for_each(|(i, piece)| folder.write(&format!("s_{i}.vtp"), piece));
    folder.write("s.pvtp", pieces("PPolyData", "", &["s_0.vtp", "s_1.vtp"]));
    folder.write("s.vtp", vtp_pieces());
    let (Loaded::Mesh(found), Loaded::Mesh(expected)) = (folder.read("s.pvtp").0, folder.read("s.vtp").0) else {
        panic!()
    };
    assert_eq!((found.triangles, found.color, found.position), (expected.triangles, expected.color, expected.position));
    folder.write("g.vts", vts(0.1));
    folder.write("g.pvts", pieces("PStructuredGrid", "WholeExtent=\"0 2 0 3 0 1\"", &["g.vts"]));
    assert_eq!(folder.grid("g.pvts").0, folder.grid("g.vts").0);
}

/// Indices of the first and the last point along each axis.
type Extent = [[i64; 2]; 3];

fn words_of(extent: Extent) -> String {
    words(extent.concat()).trim().to_owned()
}

/// A piece of an image with the linear field of its indices on its points, and on its cells that of their first points.
fn image(extent: Extent, spacing: &str) -> String {
    let values = |[x, y, z]: Extent| -> String {
        let row = |j: i64, k: i64| (x[0]..=x[1]).map(move |i| linear([i, j, k].map(|n| n as f64)));
        words((z[0]..=z[1]).flat_map(|k| (y[0]..=y[1]).flat_map(move |j| row(j, k))))
    };
    let cells = extent.map(|[low, high]| [low, (high - 1).max(low)]);
    let words = words_of(extent);
    let content = format!(
        "<ImageData WholeExtent=\"{words}\" Origin=\"1 2 3\" Spacing=\"{spacing}\">\n<Piece Extent=\"{words}\">\n<PointData>\n{}\
         </PointData>\n<CellData>\n{}</CellData>\n</Piece>\n</ImageData>\n",
        array("Float64", "p", 1, &values(extent)),
        array("Float64", "c", 1, &values(cells)),
    );
    vtk_file("ImageData", &content)
}

#[test]
fn pieces_of_an_image_are_put_together_at_their_places() {
    let folder = Folder::new("images");
    let whole = [[0, 4], [-1, 2], [2, 5]];
    folder.write("whole.vti", image(whole, "1 2 0.5"));
    // They share a layer of points, and overlap by two.
    folder.write("a_0.vti", image([[0, 4], [-1, 1], [2, 5]], "1 2 0.5"));
    folder.write("a_1.vti", image([[0, 2], [0, 2], [2, 5]], "1 2 0.5"));
    folder.write("a_2.vti", image([[2, 4], [1, 2], [2, 5]], "1 2 0.5"));
    let extent = format!("WholeExtent=\"{}\"", words_of(whole));
    folder.write("a.pvti", pieces("PImageData", &extent, &["a_0.vti", "a_1.vti", "a_2.vti"]));
    let chosen = |name: &str, array: &str| {
        let params = ReadParams { array: Some(array.to_owned()), ..ReadParams::default() };
        folder.read_with(name, &params).unwrap_or_else(|e| panic!("{e}")).0
    };
    for array in ["p", "c"] {
        assert_eq!(chosen("a.pvti", array), chosen("whole.vti", array), "{array}");
    }
    // A hole, a part that is not what the list says, and two values at one place.
    folder.write("gap.pvti", pieces("PImageData", &extent, &["a_0.vti", "a_2.vti"]));
    folder.refused(
        "gap.pvti",
        "expected pieces that have all points of the extent 0 4 -1 2 2 5, found none with those of the extent 0 1 2 2 2 5",
    );
    let of_two = pieces("PImageData", &extent, &["a_0.vti", "a_1.vti", "a_2.vti"]);
    let stated = of_two.replace("<Piece Source=\"a_1.vti\"", "<Piece Extent=\"0 3 0 2 2 5\" Source=\"a_1.vti\"");
    folder.write("stated.pvti", stated);
    folder.refused(
        "stated.pvti",
        "'a_1.vti' of the list: the Extent 0 3 0 2 2 5, as the list has it, found '0 2 0 2 2 5'",
    );
    let part = image([[0, 2], [0, 2], [2, 5]], "1 2 0.5");
    let at_zero = linear([0.0, 0.0, 2.0]);
    assert!(part.contains("\n0 1 2 2 "));
    folder.write("a_3.vti", part.replacen("\n0 1 2 2 ", "\n77 1 2 2 ", 1));
    folder.write("values.pvti", pieces("PImageData", &extent, &["a_0.vti", "a_3.vti", "a_2.vti"]));
    folder.refused(
        "values.pvti",
        &format!("'a_3.vti' of the list: the value at 0 0 2 of p to be {at_zero}, as another piece has it, found 77"),
    );
    folder.write("type.vti", part.replace("Float64\" Name=\"p\"", "Float32\" Name=\"p\""));
    folder.write("type.pvti", pieces("PImageData", &extent, &["a_0.vti", "type.vti", "a_2.vti"]));
    folder.refused(
        "type.pvti",
        "'type.vti' of the list: 1 numbers of Float64 a tuple, as the array has in another piece",
    );
    folder.write("other.vti", image([[2, 4], [1, 2], [2, 5]], "1 2 0.25"));
    folder.write("other.pvti", pieces("PImageData", &extent, &["a_0.vti", "a_1.vti", "other.vti"]));
    folder.refused(
        "other.pvti",
        "the file 'other.vti' of the list: the Origin, Spacing and Direction of the other pieces",
    );
    folder.write("far.vti", image([[2_000_000, 2_000_001], [0, 1], [0, 1]], "1 2 0.5"));
    let listed = |stated: &str| pieces("PImageData", &format!("{extent} {stated}"), &["a_0.vti", "a_1.vti", "a_2.vti"]);
    folder.write("listed.pvti", listed("Origin=\"1 2 3\" Spacing=\"1 2 0.5\" Direction=\"1 0 0 0 1 0 0 0 1\""));
    assert_eq!(chosen("listed.pvti", "p"), chosen("whole.vti", "p"));
    for (stated, said) in [
        (
            "Spacing=\"1 2 0.25\"",
            "expected pieces of the Spacing that the list states, 1 2 0.25, found 1 2 0.5 in 'a_0.vti'",
        ),
        ("Origin=\"0 2 3\"", "expected pieces of the Origin that the list states, 0 2 3, found 1 2 3 in 'a_0.vti'"),
        ("Direction=\"0 1 0 1 0 0 0 0 1\"", "expected pieces of the Direction that the list states"),
    ] {
        folder.write("listed.pvti", listed(stated));
        folder.refused("listed.pvti", said);
    }
    folder.write("far.pvti", pieces("PImageData", &extent, &["a_0.vti", "far.vti"]));
    folder.refused(
        "far.pvti",
        "expected pieces within the extent 0 4 -1 2 2 5, found 'far.vti' with 2000000 2000001 0 1 0 1",
    );
    let whole_extent = "WholeExtent=\"0 2000001 -1 2 2 5\"";
    folder.write("long.pvti", pieces("PImageData", whole_extent, &["a_0.vti", "a_1.vti", "a_2.vti"]));
    folder.refused("long.pvti", "found none with those of the extent 5 2000001 -1 2 2 5");
    folder.write("named.vti", image([[0, 4], [-1, 2], [2, 5]], "1 2 0.5").replace("Name=\"p\"", "Name=\"q\""));
    folder.write("named.pvti", pieces("PImageData", &extent, &["a_0.vti", "named.vti"]));
    folder
        .refused("named.pvti", "the file 'named.vti' of the list: an array 'p' in PointData, which another Piece has");
}

#[test]
fn pieces_of_a_rectilinear_grid_are_put_together_and_made_even() {
    let folder = Folder::new("rectilinear");
    let along = [0.0, 1.0, 3.0, 4.0];
    let part = |first: usize, last: usize| {
        let coordinates = [words(&along[first..=last]), "0 1 ".to_owned(), "0 1 ".to_owned()];
        let axes: String = coordinates.iter().map(|axis| array("Float64", "c", 1, axis)).collect();
        let points = (0..4)
            .flat_map(|n| along[first..=last].iter().map(move |x| linear([*x, f64::from(n % 2), f64::from(n / 2)])));
        let extent = format!("{first} {last} 0 1 0 1");
        let content = format!(
            "<RectilinearGrid WholeExtent=\"{extent}\">\n<Piece Extent=\"{extent}\">\n<PointData>\n{}</PointData>\n<Coordinates>\n{axes}\
             </Coordinates>\n</Piece>\n</RectilinearGrid>\n",
            array("Float64", "p", 1, &words(points))
        );
        vtk_file("RectilinearGrid", &content)
    };
    folder.write("whole.vtr", part(0, 3));
    folder.write("a_0.vtr", part(0, 1));
    folder.write("a_1.vtr", part(1, 3));
    folder.write("a.pvtr", pieces("PRectilinearGrid", "WholeExtent=\"0 3 0 1 0 1\"", &["a_0.vtr", "a_1.vtr"]));
    let (found, notes) = folder.grid("a.pvtr");
    assert_eq!(found, folder.grid("whole.vtr").0);
    assert_eq!(found.dims, [5, 2, 2]);
    assert!(notes.unused.is_empty(), "{:?}", notes.unused);
    folder.write("a_2.vtr", part(3, 3));
    folder.write("b.pvtr", pieces("PRectilinearGrid", "WholeExtent=\"0 3 0 1 0 1\"", &["a_0.vtr", "a_2.vtr"]));
    folder.refused("b.pvtr", "found none with those of the extent 2 2 0 1 0 1");
    folder.write("a_3.vtr", part(1, 3).replace("1 3 4 ", "1.25 3 4 "));
    folder.write("c.pvtr", pieces("PRectilinearGrid", "WholeExtent=\"0 3 0 1 0 1\"", &["a_0.vtr", "a_3.vtr"]));
    folder.refused(
        "c.pvtr",
        "'a_3.vtr' of the list: the coordinate 1 along x to be 1, as another piece has it, found 1.25",
    );
}

/// A piece of a structured grid with points at their indices, moved along x, and their linear field.
fn bent(extent: Extent, shift: f64) -> String {
    let [x, y, z] = extent;
    let row =
        |j: i64, k: i64| (x[0]..=x[1]).map(move |i| [i as f64 + 0.1 * (j * j) as f64 + shift, j as f64, k as f64]);
    let points: Vec<[f64; 3]> =
        (z[0]..=z[1]).flat_map(|k| (y[0]..=y[1]).flat_map(move |j| row(j, k).collect::<Vec<_>>())).collect();
    let extent = words_of(extent);
    let content = format!(
        "<StructuredGrid WholeExtent=\"{extent}\">\n<Piece Extent=\"{extent}\">\n<PointData>\n{}</PointData>\n<Points>\n{}</Points>\n\
         </Piece>\n</StructuredGrid>\n",
        array("Float64", "p", 1, &words(points.iter().map(|p| linear(*p)))),
        array("Float64", "Points", 3, &words(points.concat()))
    );
    vtk_file("StructuredGrid", &content)
}

#[test]
fn pieces_of_a_structured_grid_have_to_meet_and_fill_the_whole() {
    let folder = Folder::new("structured");
    let whole = "WholeExtent=\"0 4 0 2 0 1\"";
    folder.write("whole.vts", bent([[0, 4], [0, 2], [0, 1]], 0.0));
    folder.write("a_0.vts", bent([[0, 2], [0, 2], [0, 1]], 0.0));
    for (name, content, expected) in [
        ("a_1.vts", bent([[2, 4], [0, 2], [0, 1]], 0.0), None),
        (
            "a_2.vts",
            bent([[2, 4], [0, 2], [0, 1]], 0.5),
            Some("point 2 0 0 at [2, 0, 0], where 'a_0.vts' has it, found [2.5, 0, 0] in 'a_2.vts'"),
        ),
        (
            "a_3.vts",
            bent([[1, 4], [0, 2], [0, 1]], 0.0),
            Some("found 'a_0.vts' with the extent 0 2 0 2 0 1 and 'a_3.vts' with 1 4 0 2 0 1"),
        ),
        (
            "a_4.vts",
            bent([[3, 4], [0, 2], [0, 1]], 0.0),
            Some("all cells of the extent 0 4 0 2 0 1, found none with those of the extent 2 2 0 1 0 0"),
        ),
        ("a_5.vts", bent([[2, 3], [0, 2], [0, 1]], 0.0), Some("found none with those of the extent 3 3 0 1 0 0")),
    ] {
        folder.write(name, content);
        folder.write("a.pvts", pieces("PStructuredGrid", whole, &["a_0.vts", name]));
        match expected {
            Some(expected) => folder.refused("a.pvts", expected),
            None => assert_eq!(folder.grid("a.pvts").0, folder.grid("whole.vts").0),
        }
    }
}

#[test]
fn one_piece_alone_says_that_it_is_one_and_names_its_list() {
    let folder = Folder::new("alone");
    let whole = "WholeExtent=\"0 4 0 1 0 1\"";
    let part = |extent: Extent| image(extent, "1 1 1").replace(&format!("WholeExtent=\"{}\"", words_of(extent)), whole);
    folder.write("p_0.vti", part([[0, 2], [0, 1], [0, 1]]));
    folder.write("p_1.vti", part([[2, 4], [0, 1], [0, 1]]));
    let (found, notes) = folder.grid("p_1.vti");
    assert_eq!((found.dims, found.origin.x), ([3, 2, 2], 3.0));
    let said = "this file has the piece 2 4 0 1 0 1 of a dataset of 0 4 0 1 0 1, and only that is drawn";
    assert!(notes.warnings[0].starts_with(said), "{:?}", notes.warnings);
    folder.write("p.pvti", pieces("PImageData", whole, &["p_0.vti", "p_1.vti"]));
    let (_, notes) = folder.grid("p_1.vti");
    let said = "this file is one piece of the dataset whose list is 'p.pvti', which draws all of it";
    assert!(notes.remarks.iter().any(|r| r == said), "{:?}", notes.remarks);
    let (_, notes) = folder.grid("p.pvti");
    assert!(notes.warnings.is_empty() && !notes.remarks.iter().any(|r| r.contains("one piece")), "{notes:?}");
    folder.write("p_2.vti", part([[2, 5], [0, 1], [0, 1]]));
    folder.refused("p_2.vti", "expected a Piece within the WholeExtent, found '2 5 0 1 0 1'");
    fs::remove_file(folder.0.join("p_0.vti")).unwrap();
    folder.refused("p.pvti", "a file of the list 'p_0.vti': a file, found no such file");
}

#[test]
fn blocks_are_drawn_as_one_and_may_lack_an_array() {
    let folder = Folder::new("blocks");
    let corner = |x: f64| [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0], [x, 0.0, 1.0]];
    let cell = |x: f64| vtu_of(&corner(x), &[&[0, 1, 2, 3]], &[10], "");
    folder.write("below/0.vtu", cell(0.0));
    folder.write("below/1.vtu", cell(1.0).replace("Name=\"p\"", "Name=\"q\""));
    folder.write("below/2.vti", image([[2, 3], [0, 1], [0, 1]], "1 1 1").replace("Origin=\"1 2 3\"", ""));
    folder.write("a.vtm", blocks(&["below/0.vtu", "below/1.vtu", "below/2.vti"]));
    let (found, notes) = folder.grid("a.vtm");
    let high = found.origin + found.axes * splat_core::glam::DVec3::from_array(found.dims.map(|n| n as f64 - 0.5));
    assert!((high - splat_core::glam::DVec3::new(3.0, 1.0, 1.0)).length() < 1e-9, "{high}");
    // The second one has no p: it is a gap.
    let value = |x: f64| {
        let [nx, ny, _] = found.dims;
        let place = |n: usize| found.position(n % nx, n / nx % ny, n / nx / ny);
        let target = splat_core::glam::DVec3::new(x, 0.2, 0.2);
        let order = |a: &usize, b: &usize| place(*a).distance(target).total_cmp(&place(*b).distance(target));
        let nearest = (0..found.values.len()).min_by(order).unwrap();
        (found.values[nearest], linear(place(nearest).to_array()) as f32)
    };
    assert!((value(0.2).0 - value(0.2).1).abs() < 1e-4 && (value(2.5).0 - value(2.5).1).abs() < 1e-4);
    assert!(value(1.2).0.is_nan());
    let said = "3 blocks drawn as one; where one lacks the array that is drawn it draws nothing";
    assert!(notes.remarks.iter().any(|r| r == said), "{:?}", notes.remarks);
    // Surfaces of which one has no colours have none.
    folder.write("s.vtp", vtp());
    folder.write(
        "t.vtp",
        String::from_utf8(vtp())
            .unwrap()
            .replace("Name=\"paint\" NumberOfComponents=\"3\"", "Name=\"x\"")
            .replace("255 0 0 0 255 0 0 0 255 0 0 0", "1 2 3 4"),
    );
    folder.write("s.vtm", blocks(&["s.vtp", "t.vtp"]));
    let Loaded::Mesh(mesh) = folder.read("s.vtm").0 else { panic!("no mesh") };
    assert_eq!((mesh.triangles.len(), mesh.color.len()), (4, 0));
    folder.write(
        "same.vtpc",
        blocks(&["s.vtp", "s.vtp"]).replace("vtkMultiBlockDataSet", "vtkPartitionedDataSetCollection"),
    );
    let Loaded::Mesh(mesh) = folder.read("same.vtpc").0 else { panic!("no mesh") };
    assert_eq!(mesh.color.len(), 8);
    // The field is that of bodies, whatever surfaces come before them.
    folder.write("mixed.vtm", blocks(&["s.vtp", "below/0.vtu"]));
    let (mixed, notes) = folder.grid("mixed.vtm");
    assert!(mixed.values.iter().copied().fold(0.0, f32::max) > 1.9, "{notes:?}");
    assert!(notes.remarks.contains(&"the field is p, of the points".to_owned()), "{notes:?}");
    assert!(notes.unused.contains(&"1 cell without a volume".to_owned()), "{notes:?}");
    // An image of a few bytes does not stand for millions of points.
    let huge = image([[0, 1], [0, 1], [0, 1]], "1 1 1").replace("\"0 1 0 1 0 1\"", "\"0 499 0 499 0 499\"");
    folder.write("huge.vti", huge);
    folder.write("huge.vtm", blocks(&["huge.vti", "s.vtp"]));
    let error = folder.read_with("huge.vtm", &ReadParams::default()).unwrap_err();
    assert_eq!(error.fault, Fault::Limit, "{error}");
    assert!(error.to_string().contains("for each byte of a file of VTK, found 125000000 from"), "{error}");
    folder.write("same.vtm", blocks(&["s.vtp", "s.vtp"]));
    let Loaded::Mesh(mesh) = folder.read("same.vtm").0 else { panic!("no mesh") };
    assert_eq!(mesh.color.len(), 8);
}

#[test]
fn a_time_of_a_series_is_chosen_by_frame() {
    let folder = Folder::new("times");
    let tetrahedron = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let at = |value: &str| {
        let text = vtu_of(&tetrahedron, &[&[0, 1, 2, 3]], &[10], "");
        text.replace(&words(tetrahedron.map(linear)), value)
    };
    folder.write("t0.vtu", at("5 5 5 5 "));
    folder.write("t1.vtu", at("7 7 7 7 "));
    folder.write("p1.pvtu", pieces("PUnstructuredGrid", "", &["t1.vtu"]));
    let times = |first: &str| {
        let content = format!(
            "<Collection>\n<DataSet timestep=\"0.5\" part=\"0\" file=\"p1.pvtu\"/>\n<DataSet timestep=\"{first}\" file=\"t0.vtu\"/>\n\
             </Collection>\n"
        );
        vtk_file("Collection", &content)
    };
    folder.write("a.pvd", times("0.25"));
    let frame = |frame: u64| folder.read_with("a.pvd", &ReadParams { frame, ..ReadParams::default() });
    let most = |loaded: &Loaded| match loaded {
        Loaded::Grid(grid) => grid.values.iter().copied().fold(0.0, f32::max),
        other => panic!("no volume: {other:?}"),
    };
    let (first, notes) = frame(0).unwrap();
    assert_eq!(most(&first), 5.0);
    let said = "time 0.25, 0 of 2 counted from 0; `frame` chooses another";
    assert!(notes.remarks.iter().any(|r| r == said), "{:?}", notes.remarks);
    assert_eq!(most(&frame(1).unwrap().0), 7.0);
    let beyond = frame(2).unwrap_err().to_string();
    assert!(beyond.contains("expected a `frame` from 0 to 1, as the file has 2 volumes, found `frame` 2"), "{beyond}");
    // Of surfaces no frame can be chosen.
    folder.write("t0.vtu", vtp());
    let (Loaded::Mesh(_), notes) = folder.read("a.pvd") else { panic!("no mesh") };
    let said = "time 0.25, 0 of 2 counted from 0; of another draw its file";
    assert!(notes.remarks.iter().any(|r| r == said), "{:?}", notes.remarks);
    let error = folder.read_with("p1.pvtu", &ReadParams { frame: 1, ..ReadParams::default() }).unwrap_err();
    assert!(error.to_string().contains("expected `frame` 0, as the file has one volume"), "{error}");
    folder.write("b.pvd", times("soon"));
    folder.refused("b.pvd", "expected a finite number as timestep, found 'soon'");
}

#[test]
fn what_is_wrong_in_a_list_is_named() {
    let folder = Folder::new("wrong");
    let missing = |name: &str| pieces("PUnstructuredGrid", "", &[name]);
    for (name, content, expected) in [
        ("a.pvtu", missing("none.vtu"), "expected a file of the list 'none.vtu': a file, found no such file"),
        (
            "b.pvtu",
            missing("../lists.vtu"),
            "a file of the list: a file in the same folder or below, found '../lists.vtu'",
        ),
        ("c.pvtu", missing("http://x/a.vtu"), "a file of the list: a file in the same folder or below"),
        ("d.pvtu", missing("d.pvtu"), "lists of lists at most 4 deep, found a deeper one"),
        (
            "e.pvtu",
            vtk_file("PUnstructuredGrid", "<PUnstructuredGrid/>"),
            "expected a list that names files, found 'none'",
        ),
        ("f.pvtu", missing("f.txt"), "the file 'f.txt' of the list: XML"),
        ("g.pvtu", missing("g.vtu"), "the file 'g.vtu' of the list: 27 numbers, found '"),
        ("h.vtm", blocks(&["whole.vtu", "h.vtt"]), "the file 'h.vtt' of the list: a VTKFile of type ImageData"),
    ] {
        folder.write("f.txt", "no elements");
        folder.write("whole.vtu", vtu("ascii", false));
        folder.write("g.vtu", String::from_utf8(vtu("ascii", false)).unwrap().replacen("0 0 0 2", "0 0 2", 1));
        folder.write("h.vtt", vtk_file("Table", "<Table/>"));
        folder.write(name, content);
        folder.refused(name, expected);
    }
    let in_memory = load("a.pvtu", missing("a.vtu").as_bytes()).unwrap_err().to_string();
    assert!(in_memory.contains("all of it in one file, as it was read from memory"), "{in_memory}");
    // A file that is named a thousand times is in memory as often, which the limit knows.
    folder.write("large.vtu", [&vtu("ascii", false)[..], &[b' '; 1 << 16]].concat());
    folder.write("many.pvtu", pieces("PUnstructuredGrid", "", &["large.vtu"; 1000]));
    let params = ReadParams { memory: MemoryAccount::new(1 << 23), ..ReadParams::default() };
    let error = folder.read_with("many.pvtu", &params).unwrap_err();
    assert_eq!(error.fault, Fault::Limit, "{error}");
}

/// A list is cut anywhere, or its bits are turned: an error or something valid, never a panic.
#[test]
fn a_damaged_list_is_an_error_or_valid() {
    let folder = Folder::new("damage");
    folder.write("a.vti", image([[0, 2], [0, 1], [0, 1]], "1 1 1"));
    folder.write("b.vti", image([[2, 3], [0, 1], [0, 1]], "1 1 1"));
    for whole in [pieces("PImageData", "", &["a.vti", "b.vti"]), blocks(&["a.vti", "b.vti"])] {
        for length in 0..whole.len() {
            folder.write("cut.pvti", &whole[..length]);
            assert!(folder.read_with("cut.pvti", &ReadParams::default()).is_err(), "{length}");
        }
        for bit in (0..whole.len() * 8).step_by(11) {
            let mut turned = whole.clone().into_bytes();
            turned[bit / 8] ^= 1 << (bit % 8);
            folder.write("turned.pvti", turned);
            if let Ok((Loaded::Grid(grid), _)) = folder.read_with("turned.pvti", &ReadParams::default()) {
                assert_eq!(grid.values.len(), grid.dims.iter().product::<usize>());
            }
        }
    }
}
