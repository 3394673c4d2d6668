//! Cells of VTK become volumes, its surfaces meshes, legacy and in XML.
#![cfg(all(feature = "vti", feature = "vtk"))]

use crate::read_samples::cells::{vtk_cells, vtk_surface, vtp, vtp_pieces, vtu, vtu_pieces};
use crate::read_samples::{gzip, load};
use read::{Fault, Loaded, Notes, ReadParams, bytes};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Grid, MemoryAccount, Mesh};

fn read(name: &str, content: &[u8]) -> (Loaded, Notes) {
    bytes(name, content, &ReadParams::default(), None).unwrap_or_else(|e| panic!("{e}"))
}

fn grid(name: &str, content: &[u8]) -> (Grid, Notes) {
    match read(name, content) {
        (Loaded::Grid(grid), notes) => (grid, notes),
        other => panic!("not a grid: {other:?}"),
    }
}

fn mesh(name: &str, content: &[u8]) -> (Mesh, Notes) {
    match read(name, content) {
        (Loaded::Mesh(mesh), notes) => (mesh, notes),
        other => panic!("not a mesh: {other:?}"),
    }
}

fn mass(grid: &Grid) -> f64 {
    grid.values.iter().map(|v| f64::from(*v)).sum::<f64>() * grid.cell_volume()
}

/// Place of voxel n.
fn place(grid: &Grid, n: usize) -> DVec3 {
    let [nx, ny, _] = grid.dims;
    grid.origin + grid.axes * DVec3::new((n % nx) as f64, (n / nx % ny) as f64, (n / nx / ny) as f64)
}

#[test]
fn a_linear_field_of_points_is_linear_inside_and_keeps_its_integral() {
    let (grid, notes) = grid("a.vtk", &vtk_cells(false, false));
    let low = grid.origin + grid.axes * DVec3::splat(-0.5);
    let high = low + grid.axes * DVec3::from_array(grid.dims.map(|n| n as f64));
    assert!(low.abs().max_element() < 1e-12 && high.distance(DVec3::new(3.0, 1.0, 1.0)) < 1e-12);
    let mut inside = 0;
    for (n, v) in grid.values.iter().enumerate() {
        let p = place(&grid, n);
        // A voxel is the mean of what lies in it: at the border of the pyramid a part of it is outside.
        if p.x < 2.0 {
            assert!((f64::from(*v) - (1.0 + p.x + 2.0 * p.y)).abs() < 1e-5, "{v} at {p}");
            inside += 1;
        } else if (p.y - 0.5).abs().max((p.z - 0.5).abs()) > 0.5 * (3.0 - p.x) + 0.02 {
            assert_eq!(*v, 0.0, "{p}");
        }
    }
    assert!(inside > 100_000, "{inside}");
    // ∫ over the hexahedron, and a third times the field at the pyramid's centre of mass.
    let expected = 6.0 + 4.25 / 3.0;
    assert!((mass(&grid) / expected - 1.0).abs() < 1e-3, "{} for {expected}", mass(&grid));
    let [nx, ny, nz] = grid.dims;
    let sampled = format!("2 cells, sampled as {nx} x {ny} x {nz} voxels; outside them the value is 0");
    assert_eq!(notes.remarks, ["the field is density, of the points".to_owned(), sampled]);
    assert_eq!((notes.unused, notes.value_outside), (vec!["1 cell without a volume".to_owned()], Some(0.0)));
}

#[test]
fn cells_that_are_flat_are_counted_and_only_cells_have_a_value_outside() {
    let text = "# vtk DataFile Version 3.0\nflat\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 5 float\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n1 1 0\n\
                CELLS 3 15\n4 0 1 2 3\n4 0 1 2 4\n4 1 4 2 0\nCELL_TYPES 3\n10\n10\n10\nCELL_DATA 3\nSCALARS a float\nLOOKUP_TABLE default\n-2 1 1\n";
    let (_, notes) = grid("a.vtk", text.as_bytes());
    let flat = "2 cells of no volume, whose points lie in a plane: nothing is drawn of that";
    assert!(notes.remarks.iter().any(|remark| remark == flat), "{:?}", notes.remarks);
    assert_eq!(notes.value_outside, Some(-2.0));
    let image = crate::read_samples::volumes::vti("ascii", false);
    assert_eq!(grid("a.vti", &image).1.value_outside, None);
}

#[test]
fn every_way_to_write_the_cells_gives_the_same_volume() {
    let (expected, _) = grid("a.vtk", &vtk_cells(false, false));
    for (name, content) in [
        ("a.vtk", vtk_cells(true, false)),
        ("a.vtk", vtk_cells(false, true)),
        ("a.vtk", vtk_cells(true, true)),
        ("a.vtu", vtu("ascii", false)),
        ("a.vtu", vtu("binary", false)),
        ("a.vtu", vtu("binary", true)),
        ("a.vtu.gz", gzip(&vtu("binary", true))),
        ("a.vtu", vtu_pieces("ascii", false)),
        ("a.vtu", vtu_pieces("binary", false)),
        ("a.vtu", vtu_pieces("binary", true)),
    ] {
        assert!(grid(name, &content).0 == expected, "{name}");
    }
    for content in [vtu("ascii", false), vtu_pieces("ascii", false)] {
        assert_eq!(grid("a.vtu", &content).1.unused, ["CellData.of_cells", "1 cell without a volume"]);
    }
}

#[test]
fn values_of_cells_fill_them_and_without_values_they_are_full_of_one() {
    let text = String::from_utf8(vtu("ascii", false)).unwrap();
    let (before, rest) = text.split_once("<PointData").unwrap();
    let without = format!("{before}{}", rest.split_once("</PointData>").unwrap().1);
    let (of_cells, _) = grid("a.vtu", without.as_bytes());
    let expected = 6.0 + 4.25 / 3.0;
    assert!((mass(&of_cells) / expected - 1.0).abs() < 1e-3, "{}", mass(&of_cells));
    assert_eq!(of_cells.values.iter().copied().fold(0.0, f32::max), 4.25);
    let (before, rest) = without.split_once("<CellData").unwrap();
    let (full, notes) = grid("a.vtu", format!("{before}{}", rest.split_once("</CellData>").unwrap().1).as_bytes());
    assert!((mass(&full) / (2.0 + 1.0 / 3.0) - 1.0).abs() < 1e-3, "{}", mass(&full));
    assert!(notes.remarks.contains(&"cells without a field of numbers: they are full of 1".to_owned()));
}

/// Below 0 there is nothing that 0 could stand for.
#[test]
fn outside_lies_the_least_value_where_some_are_negative() {
    let text = String::from_utf8(vtk_cells(false, false)).unwrap();
    let (grid, notes) = grid("a.vtk", text.replace("\n1 3 5 3 1 3 5 3 5\n", "\n-7 3 5 3 1 3 5 3 5\n").as_bytes());
    assert_eq!(grid.values.iter().copied().fold(0.0, f32::min), -7.0);
    assert!(notes.remarks[1].ends_with("outside them the value is -7"), "{:?}", notes.remarks);
}

#[test]
fn surfaces_are_meshes_with_normals_and_colours() {
    for (binary, by_ends) in [(false, false), (true, false), (false, true), (true, true)] {
        let (mesh, notes) = mesh("a.vtk", &vtk_surface(binary, by_ends));
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 7], [7, 5, 6]]);
        assert_eq!(mesh.normal, [Vec3::Z; 8]);
        assert_eq!(notes.unused, ["1 line"]);
    }
    let (mesh, notes) = mesh("a.vtp", &vtp());
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(mesh.color, [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [0.0; 3]]);
    assert!(notes.unused.is_empty() && notes.columns.iter().any(|c| c.name == "heat"), "{notes:?}");
    // Flat cells of an unstructured grid are a surface too.
    let cells = String::from_utf8(vtk_cells(false, false)).unwrap();
    let flat = cells.replace("12 14 5", "2 2 5");
    assert_eq!(super::read_cells::mesh("a.vtk", flat.as_bytes()).0.triangles, [[0, 1, 2]]);
}

#[test]
fn pieces_are_one_dataset_with_the_columns_of_all() {
    let (mesh, notes) = mesh("a.vtp", &vtp_pieces());
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]]);
    assert_eq!((mesh.normal, mesh.color.len()), (vec![Vec3::Z; 8], 8));
    assert_eq!(mesh.color[..4], mesh.color[4..]);
    assert!(mesh.position.iter().enumerate().all(|(i, p)| mesh.origin.z + f64::from(p.z) == f64::from(i >= 4)));
    assert!(notes.unused.is_empty() && notes.columns.iter().any(|c| c.name == "heat"), "{notes:?}");
    let text = String::from_utf8(vtp_pieces()).unwrap().replace("NumberOfPolys=\"1\"", "NumberOfPolys=\"0\"");
    let (Loaded::Points(points), _) = read("a.vtp", text.as_bytes()) else { panic!("points") };
    assert_eq!((points.len(), points.normal.len(), points.color.len()), (8, 8, 8));
    // Values of cells follow the pieces too.
    let text = String::from_utf8(vtu_pieces("ascii", false)).unwrap();
    let of_cells = text.replace("PointData", "Other");
    assert!((mass(&grid("a.vtu", of_cells.as_bytes()).0) / (6.0 + 4.25 / 3.0) - 1.0).abs() < 1e-3);
}

/// Lines alone are tubes with the columns of their points and their own; beside faces they are counted.
#[test]
fn lines_alone_are_tubes() {
    let legacy = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 0 0 1 0 3 1\n\
        LINES 2 6\n2 0 1\n2 2 3\nCELL_DATA 2\nSCALARS rank float 1\nLOOKUP_TABLE default\n7 8\n\
        POINT_DATA 4\nSCALARS heat float 1\nLOOKUP_TABLE default\n1 2 3 4\n";
    let params = ReadParams { columns: vec!["heat".to_owned(), "rank".to_owned()], ..ReadParams::default() };
    let (Loaded::Mesh(found), notes) = bytes("a.vtk", legacy.as_bytes(), &params, None).unwrap() else {
        panic!("mesh")
    };
    found.validate().unwrap();
    assert_eq!((found.position.len(), found.triangles.len()), (4 * 6, 2 * (12 + 8)));
    let column = |name: &str| found.columns.iter().find(|c| c.name == name).unwrap().values.clone();
    assert_eq!(column("heat")[5..7], [1.0, 2.0]);
    assert_eq!(column("rank")[19..21], [7.0, 8.0]);
    // The diagonal of 1, 3 and 1 is √11.
    let radius = 11f32.sqrt() / 500.0;
    let away = found.position[0] + found.origin.as_vec3();
    assert!((away.length() / radius - 1.0).abs() < 1e-3, "{away}");
    assert!(notes.remarks[0].starts_with("2 lines drawn as tubes whose radius is a 500th"), "{:?}", notes.remarks);
    assert!(notes.unused.is_empty(), "{:?}", notes.unused);
    let obj = "v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 1 1 0 0 0 1\nl 1 2/7 -1\n";
    let (found, notes) = mesh("a.obj", obj.as_bytes());
    assert_eq!((found.position.len(), found.color[17], found.color[0]), (18, [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]));
    assert!(notes.remarks[0].starts_with("1 line drawn as tubes"), "{:?}", notes.remarks);
    let (_, notes) = mesh("a.obj", format!("{obj}f 1 2 3\n").as_bytes());
    assert_eq!(notes.unused, ["1 line"]);
    refused("a.obj", "v 0 0 0\nl 1 2\n", "a.obj:2:5: expected an index from 1 to 1");
    // Without any length there are points.
    let (Loaded::Points(points), notes) = read("a.obj", b"v 0 0 0\nv 0 0 0\nl 1 2\n") else { panic!("points") };
    assert_eq!((points.len(), notes.unused), (2, vec!["1 line".to_owned()]));
}

#[test]
fn points_without_cells_are_a_cloud() {
    let text = String::from_utf8(vtp()).unwrap().replace("NumberOfPolys=\"1\"", "NumberOfPolys=\"0\"");
    let (Loaded::Points(points), _) = read("a.vtp", text.as_bytes()) else { panic!("points") };
    assert_eq!((points.len(), points.color.len()), (4, 4));
}

#[track_caller]
fn refused(name: &str, content: &str, expected: &str) {
    let error = load(name, content.as_bytes()).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().contains(expected), "{error}");
}

#[test]
fn what_is_wrong_in_legacy_cells_is_named() {
    let text = String::from_utf8(vtk_cells(false, false)).unwrap();
    for (from, to, expected) in [
        (
            "8 0 1 2 3 4 5 6 7",
            "8 0 1 2 3 4 5 6 9",
            "a.vtk:7: expected points of cell 0 among the 9 that there are, counted from 0, found 9",
        ),
        ("8 0 1 2 3 4 5 6 7", "8 0 1 2 3 4 5 6 -1", "expected points of cell 0 among the 9 that there are"),
        ("8 0 1 2 3 4 5 6 7", "8 0 1 2 3 4 5 6 .5", "expected points of cell 0 among the 9 that there are"),
        (
            "8 0 1 2",
            "99 0 1 2",
            "a.vtk:7: expected a number of points of cell 0, at most 18, and as many points, found 99",
        ),
        ("CELLS 3", "CELLS 4", "a.vtk:7: expected 4 cells, found 3"),
        ("CELLS 3 19", "CELLS 3 18446744073709551615", "a.vtk:7: expected at most "),
        ("CELL_TYPES 3", "CELL_TYPES 2", "expected SCALARS, FIELD or another keyword"),
        ("12 14 5", "12 14", "a.vtk:9: expected 3 numbers, found 2"),
        ("12 14 5", "24 14 5", "a.vtk:7: expected 10 points of cell 0, a quadratic tetrahedron, found 8"),
        (
            "12 14 5",
            "12 14 41",
            "a.vtk:7: expected cells of a kind that is read, found a convex point set (type 41) at cell 2",
        ),
        ("12 14 5", "12 14 256", "a.vtk:9: expected types of cells from 0 to 254, found 256 at cell 2"),
        ("12 14 5", "12 10 5", "a.vtk:7: expected 4 points of cell 1, a tetrahedron, found 5"),
        ("CELL_TYPES 3\n12 14 5\n", "", "expected CELL_TYPES, found the end of the file"),
        ("POINTS 9", "POINTS 8", "a.vtk:6: expected SCALARS, FIELD or another keyword"),
        ("POINT_DATA 9", "CELL_DATA 9", "expected 3 values, one for each of the cells, found 9"),
        ("POINTS 9 float\n", "POINTS 0 float\n\nPOINTS 9 float\n", "expected POINTS once"),
        ("1 3 5 3 1", "inf 3 5 3 1", "expected a finite decimal number, found 'inf'"),
    ] {
        assert!(text.contains(from), "{from}");
        refused("a.vtk", &text.replacen(from, to, 1), expected);
    }
    let by_ends = String::from_utf8(vtk_cells(false, true)).unwrap();
    for (from, to, expected) in [
        ("0 8 13 16", "1 8 13 16", "a.vtk:8: expected OFFSETS from 0, found 1"),
        ("0 8 13 16", "0 13 8 16", "expected cell 1 to end at 13 to 16 of the points of cells, found 8"),
        ("0 8 13 16", "0 8 13 15", "expected 16 points in the cells, as many as there are, found 15"),
        ("CONNECTIVITY", "OFFSETS", "a.vtk:10: expected CONNECTIVITY, found 'OFFSETS vtktypeint64'"),
    ] {
        assert!(by_ends.contains(from), "{from}");
        refused("a.vtk", &by_ends.replacen(from, to, 1), expected);
    }
    let places = text.lines().nth(5).unwrap();
    let flat = text.replacen(places, &"0 ".repeat(27), 1);
    refused("a.vtk", &flat, "expected cells that enclose a volume, found cells that are flat");
}

#[test]
fn what_is_wrong_in_one_of_several_pieces_is_named() {
    let last = |text: &str, from: &str, to: &str| {
        let at = text.rfind(from).unwrap_or_else(|| panic!("{from}"));
        format!("{}{to}{}", &text[..at], &text[at + from.len()..])
    };
    let cells = String::from_utf8(vtu_pieces("ascii", false)).unwrap();
    for (from, to, expected) in [
        (
            "Name=\"density\"",
            "Name=\"weight\"",
            "expected an array 'density' in PointData, which another Piece has, found 'none'",
        ),
        (
            "\"Float32\" Name=\"density\"",
            "\"Float64\" Name=\"density\"",
            "expected 1 component of type Float32, as the array has in another Piece, found '1 of Float64'",
        ),
        ("1 2 4 3 5 0 1 2", "1 2 4 3 6 0 1 2", "expected points of cell 0 among the 6 that there are"),
        ("14 5", "14 42", "expected an array face_connectivity, found 'none'"),
        ("NumberOfPoints=\"6\"", "NumberOfPoints=\"5\"", "expected 15 numbers, found '18'"),
    ] {
        refused("a.vtu", &last(&cells, from, to), expected);
    }
    let none = cells.replace("<Piece", "<Part").replace("</Piece", "</Part");
    refused("a.vtu", &none, "expected a Piece, found 'none'");
    let surface = String::from_utf8(vtp_pieces()).unwrap();
    let missing = "which another Piece has, found 'none'";
    refused("a.vtp", &last(&surface, "Name=\"up\"", "Name=\"down\""), &format!("array 'up' in PointData, {missing}"));
    refused("a.vtp", &last(&surface, "Name=\"paint\"", "Name=\"hue\""), &format!("'paint' in PointData, {missing}"));
    // What all pieces hold together counts, though each is small: they may all be the same bytes.
    let (before, rest) = surface.split_once("<Piece").unwrap();
    let (piece, after) = rest.rsplit_once("</Piece>").unwrap();
    let many = format!("{before}{}{after}", format!("<Piece{piece}</Piece>").repeat(20));
    let within = |bytes: u64| ReadParams { memory: MemoryAccount::new(bytes), ..ReadParams::default() };
    let ample = within(1 << 20);
    assert!(bytes("a.vtp", &vtp_pieces(), &ample, None).is_ok());
    let limits = within(ample.memory.peak() + many.len() as u64);
    assert!(bytes("a.vtp", &vtp_pieces(), &limits, None).is_ok());
    let error = bytes("a.vtp", many.as_bytes(), &limits, None).unwrap_err();
    assert!(error.to_string().contains("bytes of memory for all that is read"), "{error}");
}

#[test]
fn what_is_wrong_in_cells_of_xml_is_named() {
    let text = String::from_utf8(vtu("ascii", false)).unwrap();
    for (from, to, expected) in [
        ("8 13 16", "8 13 17", "expected 17 numbers, found '16'"),
        ("8 13 16", "8 13", "expected 3 numbers, found '2'"),
        ("8 13 16", "8 7 16", "expected cell 1 to end at 8 to 16 of the points of cells, found 7"),
        ("NumberOfPoints=\"9\"", "NumberOfPoints=\"-9\"", "expected a whole number as NumberOfPoints, found '-9'"),
        (
            "NumberOfPoints=\"9\"",
            "NumberOfPoints=\"18446744073709551615\"",
            "expected a number of values within the file",
        ),
        ("NumberOfPoints=\"9\"", "NumberOfPoints=\"6148914691236517\"", "expected a number of values within the file"),
        ("NumberOfPoints=\"9\"", "NumberOfPoints=\"614891469\"", "expected 1844674407 numbers, found '27'"),
        ("Name=\"types\"", "Name=\"kinds\"", "expected an array types, found 'none'"),
        ("NumberOfComponents=\"3\"", "NumberOfComponents=\"2\"", "expected 3 components of points, found '2'"),
        ("12 14 5", "12 51 5", "found a parametric cell (type 51) at cell 1"),
        (
            "type=\"UnstructuredGrid\"",
            "type=\"HyperTreeGrid\"",
            "expected a VTKFile of type ImageData, RectilinearGrid, StructuredGrid, UnstructuredGrid or PolyData",
        ),
    ] {
        assert!(text.contains(from), "{from}");
        refused("a.vtu", &text.replacen(from, to, 1), expected);
    }
}

/// Two hexahedra side by side with these arrays behind them.
fn two_hexahedra(arrays: &str) -> String {
    format!(
        "# vtk DataFile Version 3.0\ntwo\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 12 float\n\
         0 0 0 1 0 0 2 0 0 0 1 0 1 1 0 2 1 0\n0 0 1 1 0 1 2 0 1 0 1 1 1 1 1 2 1 1\n\
         CELLS 2 18\n8 0 1 4 3 6 7 10 9\n8 1 2 5 4 7 8 11 10\nCELL_TYPES 2\n12 12\n{arrays}"
    )
}

/// The surface around the cells, with the column that the file shows.
fn surface(name: &str, content: &[u8]) -> (Mesh, Notes) {
    let with = |columns: Vec<String>| {
        let params = ReadParams { surfaces: true, columns, ..ReadParams::default() };
        match bytes(name, content, &params, None).unwrap_or_else(|e| panic!("{e}")) {
            (Loaded::Mesh(mesh), notes) => (mesh, notes),
            other => panic!("not a mesh: {other:?}"),
        }
    };
    with(with(Vec::new()).1.shown_column.into_iter().collect())
}

#[test]
fn the_surface_of_cells_is_their_outer_faces_with_the_numbers_that_they_have() {
    let of_cells = two_hexahedra("CELL_DATA 2\nSCALARS attribute float 1\nLOOKUP_TABLE default\n1 2\n");
    let (mesh, notes) = surface("a.vtk", of_cells.as_bytes());
    assert_eq!((mesh.triangles.len(), mesh.position.len()), (2 * 10, 12));
    assert_eq!(notes.shown_column.as_deref(), Some("attribute"));
    // No mean of two cells anywhere.
    let values = &mesh.columns[0].values;
    assert_eq!(values.iter().filter(|value| **value == 1.0).count(), 10);
    assert_eq!(values.iter().filter(|value| **value == 2.0).count(), 10);
    let said = "2 cells drawn as the 10 faces around them; `volume` in the place of `mesh` draws what is inside";
    assert_eq!(notes.remarks, [said]);
    // Cells that are inside out are no fault.
    let inside_out = of_cells
        .replace("8 0 1 4 3 6 7 10 9", "8 6 7 10 9 0 1 4 3")
        .replace("8 1 2 5 4 7 8 11 10", "8 7 8 11 10 1 2 5 4");
    let (turned, notes) = surface("a.vtk", inside_out.as_bytes());
    let volume = |mesh: &Mesh| {
        let corner = |v: u32| mesh.position[v as usize];
        mesh.triangles.iter().map(|[a, b, c]| corner(*a).dot(corner(*b).cross(corner(*c))) / 6.0).sum::<f32>()
    };
    assert!((volume(&turned) - 2.0).abs() < 1e-5 && notes.mended.is_empty(), "{:?}", notes.mended);
    let of_points = two_hexahedra("POINT_DATA 12\nSCALARS x float 1\nLOOKUP_TABLE default\n0 1 2 0 1 2 0 1 2 0 1 2\n");
    let (mesh, _) = surface("a.vtk", of_points.as_bytes());
    let places = mesh.position.iter().map(|p| mesh.origin.x + f64::from(p.x));
    assert!(places.zip(&mesh.columns[0].values).all(|(x, value)| x == *value));
    // Every way to write cells gives the same surface; what is inside a cell of more points is no vertex.
    let (expected, _) = surface("a.vtu", &vtu("ascii", false));
    for content in [vtu("binary", true), vtu_pieces("ascii", false)] {
        let (found, _) = surface("a.vtu", &content);
        assert_eq!((found.triangles.len(), found.bounds()), (expected.triangles.len(), expected.bounds()));
    }
}

#[test]
fn numbers_that_tell_points_apart_are_shown_last_and_active_attributes_first() {
    let field = |name: &str, numbers: &str| format!("{name} {numbers} 2 float\n{}\n", "1 2 ".repeat(3).trim());
    let of = |arrays: &[(&str, &str)], attributes: &str| {
        let fields: String = arrays.iter().map(|(name, numbers)| field(name, numbers)).collect();
        let fields = fields.replace("1 2 1 2 1 2", "1 2");
        let head = if arrays.is_empty() { String::new() } else { format!("FIELD f {}\n{fields}", arrays.len()) };
        surface("a.vtk", two_hexahedra(&format!("CELL_DATA 2\n{attributes}{head}")).as_bytes()).1.shown_column
    };
    let one = "1";
    assert_eq!(of(&[("vtkOriginalCellIds", one), ("DENSITY", one)], "").as_deref(), Some("DENSITY"));
    assert_eq!(of(&[("GLOBAL_IDS_CELLS", one), ("ObjectId", one), ("PORO", one)], "").as_deref(), Some("PORO"));
    assert_eq!(of(&[("cell_ids", one)], "").as_deref(), Some("cell_ids"));
    let scalars = "SCALARS heat float 1\nLOOKUP_TABLE default\n1 2\n";
    assert_eq!(of(&[("PORO", one)], scalars).as_deref(), Some("heat"));
    let ids = "SCALARS vtkOriginalCellIds float 1\nLOOKUP_TABLE default\n1 2\n";
    assert_eq!(of(&[("PORO", one)], ids).as_deref(), Some("PORO"));
    // In XML the active vectors count before arrays that nothing names.
    let xml = |attributes: &str| {
        let text = String::from_utf8(vtu("ascii", false)).unwrap();
        let (before, rest) = text.split_once("<CellData").unwrap();
        let (_, after) = rest.split_once("</CellData>").unwrap();
        let arrays = "<DataArray type=\"Float32\" Name=\"p\" format=\"ascii\">1 2 3</DataArray>\
                      <DataArray type=\"Float32\" Name=\"U\" NumberOfComponents=\"3\" format=\"ascii\">1 0 0 2 0 0 3 0 0</DataArray>";
        let without_points = before.split_once("<PointData").map_or(before, |(before, _)| before);
        let text = format!("{without_points}<CellData {attributes}>{arrays}</CellData>{after}");
        surface("a.vtu", text.as_bytes()).1.shown_column
    };
    assert_eq!(xml("").as_deref(), Some("p"));
    assert_eq!(xml("Vectors=\"U\"").as_deref(), Some("U:magnitude"));
    // A surface shows what its file calls active, and nothing else unasked.
    let (_, notes) = mesh("a.vtp", &vtp());
    assert_eq!(notes.shown_column, None);
}
