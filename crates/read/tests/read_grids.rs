//! Rectilinear and structured grids of VTK, polyhedra, quadratic cells and those of higher order.
#![cfg(all(feature = "vti", feature = "vtk"))]

use crate::read_samples::grids::{
    BOX, QUADRATIC, array, linear, rectilinear_points, stream, structured_points, vtk_file, vtk_polyhedra,
    vtk_rectilinear, vtk_structured, vtr, vtr_of, vts, vtu_of, vtu_polyhedra, vtu_quadratic, words,
};
use crate::read_samples::load;
use read::{Fault, Fix, Loaded, Notes, ReadParams, bytes};
use splat_core::glam::DVec3;
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

fn mesh(name: &str, content: &[u8]) -> Mesh {
    match read(name, content).0 {
        Loaded::Mesh(mesh) => mesh,
        other => panic!("not a mesh: {other:?}"),
    }
}

fn place(grid: &Grid, n: usize) -> DVec3 {
    let [nx, ny, _] = grid.dims;
    grid.position(n % nx, n / nx % ny, n / nx / ny)
}

fn mass(grid: &Grid) -> f64 {
    grid.values.iter().map(|v| f64::from(*v)).sum::<f64>() * grid.cell_volume()
}

#[track_caller]
fn refused(name: &str, content: &str, expected: &str) {
    let error = load(name, content.as_bytes()).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().contains(expected), "{error}");
}

/// Between points a field that is linear is met exactly, whatever the steps.
#[test]
fn a_rectilinear_grid_becomes_one_of_its_least_steps() {
    for (name, content) in [("a.vtr", vtr()), ("a.vtk", vtk_rectilinear(false)), ("a.vtk", vtk_rectilinear(true))] {
        let (found, notes) = grid(name, &content);
        assert_eq!((found.dims, found.origin), ([5, 3, 2], DVec3::new(0.0, 0.0, 2.0)), "{name}");
        for (n, value) in found.values.iter().enumerate() {
            let expected = linear(place(&found, n).to_array());
            assert!((f64::from(*value) - expected).abs() < 1e-6, "{name}: {value} for {expected}");
        }
        let said = "steps from 1 to 2 along x: interpolated linearly as 5 x 3 x 2 voxels of even steps; at the points of the file the \
            values differ by at most 0.00 % of their range";
        assert_eq!(notes.remarks, [said], "{name}");
        assert!(notes.unused.is_empty(), "{:?}", notes.unused);
    }
}

/// Points that no even step meets lose what lies between its neighbours: here a peak of 1 at x = 1 between steps of 2/3.
#[test]
fn what_uneven_steps_lose_is_measured() {
    let peak: Vec<f64> = rectilinear_points().iter().map(|[x, ..]| if *x == 1.0 { 1.0 } else { 0.0 }).collect();
    // Coordinates 0, 1, 3.5 and 4: the least step is 0.5, which meets them all.
    let fine = vtr_of(&peak).replace("0 1 3 4 \n", "0 1 3.5 4\n\n");
    assert!(grid("a.vtr", fine.as_bytes()).1.remarks[0].contains("at most 0.00 %"));
    // Of 0, 1, 2.5 and 4 the step is 1: at 2.5 it is halfway between 0.75 and 0 — of a peak there.
    let late: Vec<f64> = rectilinear_points().iter().map(|[x, ..]| if *x == 3.0 { 1.0 } else { 0.0 }).collect();
    let coarse = vtr_of(&late).replace("0 1 3 4 \n", "0 1 2.5 4\n\n");
    let (found, notes) = grid("a.vtr", coarse.as_bytes());
    // At 2 and 3 the tent over 2.5 is 1 − 0.5/1.5.
    assert!((found.values[2] - 2.0 / 3.0).abs() < 1e-6 && (found.values[3] - 2.0 / 3.0).abs() < 1e-6);
    assert!(notes.warnings[0].contains("at most 33.33 % of their range"), "{notes:?}");
}

/// Steps that grow by a twelfth each, far too many of the least for a volume: a voxel has the mean around it, and a linear field stays as it is.
#[test]
fn steps_out_of_all_proportion_become_means() {
    let along: Vec<f64> = (0..240).scan(0.0, |x, k| Some(std::mem::replace(x, *x + 1.08f64.powi(k)))).collect();
    let last = along[239];
    let file = |value: &dyn Fn(usize) -> f64| {
        let axes = [words(&along), "0 1 ".to_owned(), "0 1 ".to_owned()];
        let axes: String = axes.iter().map(|axis| array("Float64", "c", 1, axis)).collect();
        let values = (0..4).flat_map(|_| (0..240).map(value));
        let content = format!(
            "<RectilinearGrid WholeExtent=\"0 239 0 1 0 1\">\n<Piece Extent=\"0 239 0 1 0 1\">\n<PointData>\n{}</PointData>\n\
             <Coordinates>\n{axes}</Coordinates>\n</Piece>\n</RectilinearGrid>\n",
            array("Float64", "p", 1, &words(values))
        );
        vtk_file("RectilinearGrid", &content)
    };
    let (found, notes) = grid("a.vtr", file(&|k| along[k] / last).as_bytes());
    let n = found.dims[0];
    assert!(notes.warnings.is_empty() && n < 5_000_000, "{n} {notes:?}");
    assert!(
        found.values[..n].iter().enumerate().all(|(i, v)| (f64::from(*v) - i as f64 / (n - 1) as f64).abs() < 1e-5)
    );
    // Every second point is 1: all of that is lost where steps are small, its mean is not.
    let (found, notes) = grid("a.vtr", file(&|k| (k % 2) as f64).as_bytes());
    assert!(notes.warnings.len() == 1 && notes.warnings[0].contains("% of their range"), "{notes:?}");
    assert!((found.values[1] - 0.5).abs() < 0.1, "{}", found.values[1]);
}

#[test]
fn even_steps_are_taken_as_they_are_and_values_of_cells_lie_at_their_middles() {
    let text = String::from_utf8(vtr()).unwrap();
    let (even, notes) = grid("a.vtr", text.replace("0 1 3 4 \n", "9 8 7 6\n").as_bytes());
    assert_eq!((even.dims, even.axes.x_axis, even.origin.x), ([4, 3, 2], DVec3::new(-1.0, 0.0, 0.0), 9.0));
    let values: Vec<f32> = rectilinear_points().into_iter().map(|p| linear(p) as f32).collect();
    assert_eq!((even.values, notes.remarks), (values, Vec::new()));
    let (before, rest) = text.split_once("<PointData>").unwrap();
    let after = rest.split_once("</PointData>").unwrap().1;
    let of_cells = array("Float32", "c", 1, "1 2 3 4 5 6");
    let (found, notes) = grid("a.vtr", format!("{before}<CellData>{of_cells}</CellData>{after}").as_bytes());
    // Middles 0.5, 2 and 3.5 are even; along z there is one cell.
    assert_eq!((found.dims, found.origin), ([3, 2, 1], DVec3::new(0.5, 0.25, 3.0)));
    assert_eq!((found.values, found.axes.x_axis.x), (vec![1.0, 2.0, 3.0, 4.0, 5.0, 6.0], 1.5));
    assert!(notes.remarks.contains(&"values of cells (c): they lie at the middles".to_owned()), "{:?}", notes.remarks);
}

/// Gaps stay as large as the cells around them.
#[test]
fn a_gap_of_a_rectilinear_grid_does_not_spread_to_what_is_measured() {
    let values: Vec<f64> =
        rectilinear_points().iter().map(|p| if p[0] == 3.0 { f64::NAN } else { linear(*p) }).collect();
    let (found, notes) = grid("a.vtr", vtr_of(&values).as_bytes());
    let gaps: Vec<bool> = found.values[..5].iter().map(|v| v.is_nan()).collect();
    assert_eq!(gaps, [false, false, true, true, false]);
    assert!(notes.remarks[0].contains("at most 0.00 %"), "{:?}", notes.remarks);
}

/// A tiny step beside a long axis would make steps out of all proportion, and tiny steps along two more voxels than anybody can hold.
#[test]
fn a_step_that_is_tiny_makes_no_more_voxels_than_can_be_held() {
    let dims = |content: &str| {
        let (loaded, notes) = bytes_with(content, &ReadParams::default());
        let said = notes.remarks.iter().chain(&notes.warnings).next();
        assert!(said.is_some_and(|said| said.contains("even steps, coarser than the least step")), "{notes:?}");
        assert!(loaded.values.iter().all(|v| v.is_finite()));
        loaded.dims
    };
    let tiny = String::from_utf8(vtr()).unwrap().replace("0 1 3 4 \n", "0 1e-9 3 4\n");
    // A thousandth of the 2 along z.
    assert_eq!(dims(&tiny), [2000, 3, 2]);
    let [x, y, z] = dims(&tiny.replace("0 0.5 1 \n", "0 1e-9 1\n").replace("2 4 \n", "2 2.002\n"));
    assert!(x * y * z <= 1 << 24 && 4 * x * y * z > 3 << 24, "{x} {y} {z}");
    // What is made of them is held against the limit.
    let params = ReadParams { memory: MemoryAccount::new(32 << 10), ..ReadParams::default() };
    let error = bytes("a.vtr", tiny.as_bytes(), &params, None).unwrap_err();
    assert_eq!(error.fault, Fault::Limit, "{error}");
}

fn bytes_with(content: &str, params: &ReadParams) -> (Grid, Notes) {
    match bytes("a.vtr", content.as_bytes(), params, None).unwrap_or_else(|e| panic!("{e}")) {
        (Loaded::Grid(grid), notes) => (grid, notes),
        other => panic!("not a grid: {other:?}"),
    }
}

#[test]
fn what_is_wrong_in_a_rectilinear_grid_is_named() {
    let text = String::from_utf8(vtr()).unwrap();
    for (from, to, expected) in [
        (
            "0 1 3 4",
            "0 1 1 4",
            "expected coordinates along x that rise or fall throughout, found 1 at point 1 and 1 at the next",
        ),
        ("0 1 3 4 \n", "0 1 3\n", "expected 4 numbers, found '3'"),
        ("0 1 3 4 \n", "0 1 3 nan\n", "rise or fall throughout"),
        ("0 1 3 4 \n", "0 1 3 1e400\n", "expected a finite decimal number"),
        ("Coordinates", "Places", "expected an element Coordinates, found 'none'"),
        ("Extent=\"0 3 0 2 0 1\"", "Extent=\"0 3 0 2 0 2\"", "expected 3 numbers, found '2'"),
        ("Extent=\"0 3 0 2 0 1\"", "Extent=\"0 2147483647 0 2 0 1\"", "expected 2147483648 numbers, found '4'"),
        ("<Piece Extent=\"0 3", "<Piece Extent=\"0 2", "expected 3 numbers, found '4'"),
        ("<Piece Extent=\"0 3", "<Piece Extent=\"0 4", "expected a Piece within the WholeExtent, found '0 4 0 2 0 1'"),
        ("PointData", "Nothing", "expected a DataArray in PointData or CellData"),
    ] {
        assert!(text.contains(from), "{from}");
        refused("a.vtr", &text.replace(from, to), expected);
    }
    let legacy = String::from_utf8(vtk_rectilinear(false)).unwrap();
    for (from, to, expected) in [
        ("DIMENSIONS 4 3 2", "DIMENSIONS 5 3 2", "a.vtk:6: expected 5 coordinates, as DIMENSIONS says, found 4"),
        ("DIMENSIONS 4 3 2\n", "", "expected DIMENSIONS, found the end of the file"),
        ("Y_COORDINATES 3", "X_COORDINATES 3", "expected X_COORDINATES once"),
        ("X_COORDINATES 4", "X_COORDINATES 1152921504606846976", "expected at most"),
        ("POINT_DATA 24", "POINT_DATA 23", "expected SCALARS, FIELD or another keyword"),
        ("SCALARS p float 1\nLOOKUP_TABLE default", "NORMALS p float", "expected"),
    ] {
        assert!(legacy.contains(from), "{from}");
        refused("a.vtk", &legacy.replacen(from, to, 1), expected);
    }
}

/// Points of even steps are a lattice, however it is sheared; bent rows are cells.
#[test]
fn a_structured_grid_is_a_lattice_where_it_is_straight_and_cells_where_it_is_bent() {
    for (name, content) in
        [("a.vts", vts(0.0)), ("a.vtk", vtk_structured(false, 0.0)), ("a.vtk", vtk_structured(true, 0.0))]
    {
        let (found, notes) = grid(name, &content);
        assert_eq!((found.dims, found.axes.x_axis), ([3, 4, 2], DVec3::new(1.0, 0.25, 0.0)), "{name}");
        let values: Vec<f32> = structured_points(0.0).into_iter().map(|p| linear(p) as f32).collect();
        assert_eq!(found.values, values);
        assert!(notes.remarks.contains(&"the field is p, of the points".to_owned()), "{:?}", notes.remarks);
    }
    let mut bent = Vec::new();
    for (name, content) in
        [("a.vts", vts(0.1)), ("a.vtk", vtk_structured(false, 0.1)), ("a.vtk", vtk_structured(true, 0.1))]
    {
        let (found, notes) = grid(name, &content);
        assert!(notes.remarks.iter().any(|r| r.starts_with("6 cells, sampled as")), "{:?}", notes.remarks);
        bent.push(mass(&found));
    }
    // In a row of cells x and y are linear in the indices, with the determinant 1 − s/4 for a slope s of the bend.
    let row = |r: f64| {
        let slope = 0.1 * (2.0 * r + 1.0);
        let middle = [1.0 + 0.05 * (r * r + (r + 1.0) * (r + 1.0)), r + 0.75, 1.0];
        4.0 * (1.0 - 0.25 * slope) * linear(middle)
    };
    let expected = row(0.0) + row(1.0) + row(2.0);
    assert!(bent.iter().all(|mass| (mass / expected - 1.0).abs() < 3e-3), "{bent:?} for {expected}");
    // Values of cells.
    let params = ReadParams { array: Some("c".to_owned()), ..ReadParams::default() };
    let Loaded::Grid(found) = bytes("a.vts", &vts(0.0), &params, None).unwrap().0 else { panic!("no volume") };
    assert_eq!((found.dims, found.values), ([2, 3, 1], vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0]));
}

#[test]
fn a_structured_grid_of_one_layer_is_a_surface() {
    let text = String::from_utf8(vts(0.1)).unwrap();
    let points = structured_points(0.1);
    let flat = text
        .replace("0 2 0 3 0 1", "0 2 0 3 5 5")
        .replace(&words(points.concat()), &words(points[..12].concat()))
        .replace(&words(points.iter().copied().map(linear)), &words(points[..12].iter().copied().map(linear)));
    let found = mesh("a.vts", flat.as_bytes());
    assert_eq!((found.position.len(), found.triangles.len()), (12, 12));
}

#[test]
fn what_is_wrong_in_a_structured_grid_is_named() {
    let text = String::from_utf8(vts(0.1)).unwrap();
    let whole = "0 2 0 3 0 1";
    refused("a.vts", &text.replace(whole, "0 2 0 3 0 2"), "expected 108 numbers, found '72'");
    refused("a.vts", &text.replace(whole, "0 2147483646 0 2147483646 0 1"), "expected at most 4294967295 points");
    refused("a.vts", &text.replace("<Points>", "<P>").replace("</Points>", "</P>"), "expected an element Points");
    let legacy = String::from_utf8(vtk_structured(false, 0.1)).unwrap();
    let expected = "expected as many points as the sizes 3 x 4 x 3 have, found 24";
    refused("a.vtk", &legacy.replace("3 4 2", "3 4 3"), expected);
    refused("a.vtk", &legacy.replace("3 4 2", "4294967296 4294967296 4294967296"), "4294967296 have, found 24");
    refused("a.vtk", &legacy.replace("DIMENSIONS 3 4 2\n", ""), "expected DIMENSIONS");
}

#[test]
fn a_polyhedron_is_the_body_that_its_faces_enclose() {
    let hexahedron = vtu_of(&BOX, &[&[0, 1, 2, 3, 4, 5, 6, 7], &[1, 2, 6, 5, 8]], &[12, 14], "");
    let (expected, _) = grid("a.vtu", hexahedron.as_bytes());
    for (name, content) in [
        ("a.vtu", vtu_polyhedra(false)),
        ("a.vtu", vtu_polyhedra(true)),
        ("a.vtk", vtk_polyhedra(false)),
        ("a.vtk", vtk_polyhedra(true)),
    ] {
        let (found, notes) = grid(name, &content);
        assert_eq!((found.dims, found.origin), (expected.dims, expected.origin), "{name}");
        let most = found.values.iter().zip(&expected.values).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(most < 1e-5, "{name}: {most}");
        assert!(notes.unused.is_empty(), "{name}: {:?}", notes.unused);
    }
}

#[test]
fn what_is_wrong_in_polyhedra_is_named() {
    let older = String::from_utf8(vtu_polyhedra(false)).unwrap();
    let faces = words(stream());
    for (from, to, expected) in [
        (
            faces.as_str(),
            faces.replacen("6 4", "7 4", 1).as_str(),
            "expected as many faces of cell 0, a polyhedron, found fewer",
        ),
        (
            &faces,
            &faces.replacen("6 4", "5 4", 1),
            "expected no number behind the faces of cell 0, a polyhedron, found 5 more",
        ),
        (&faces, &faces.replacen("6 4 0", "6 4 9", 1), "expected points of cell 0 among the 9 that there are"),
        (&faces, &faces.replacen("6 4 0", "6 400 0", 1), "expected a number of points of a face"),
        (&faces, &faces.replacen("6 4 0", "1152921504606846976 4 0", 1), "expected a number of faces of cell 0"),
        ("31 -1", "30 -1", "expected 30 numbers, found '31'"),
        ("31 -1", "1152921504606846976 -1", "expected"),
        ("Name=\"faces\"", "Name=\"others\"", "expected an array face_connectivity, found 'none'"),
    ] {
        assert!(older.contains(from), "{from}");
        refused("a.vtu", &older.replacen(from, to, 1), expected);
    }
    let newer = String::from_utf8(vtu_polyhedra(true)).unwrap();
    for (from, to, expected) in [
        ("0 1 2 3 4 5\n", "0 1 2 3 4 6\n", "expected 7 numbers, found '6'"),
        ("0 1 2 3 4 5\n", "0 0 0 0 0 0\n", "expected 1 number, found '6'"),
        ("6 6\n", "7 7\n", "expected 7 numbers, found '6'"),
        ("4 8 12 16 20 24\n", "8 4 12 16 20 24\n", "expected face 1 to end behind the one before it, found '4'"),
    ] {
        assert!(newer.contains(from), "{from}");
        refused("a.vtu", &newer.replacen(from, to, 1), expected);
    }
    // As many faces as a cell has are told of again and again.
    let again = newer.replace("0 1 2 3 4 5\n", &format!("{}\n", words([5; 200]))).replace("6 6\n", "200 200\n");
    refused("a.vtu", &again, "expected faces of two polyhedra at most");
    let legacy = String::from_utf8(vtk_polyhedra(true)).unwrap();
    refused("a.vtk", &legacy.replacen("6 4 0 3 2 1", "6 4 0 3 2 9", 1), "expected points of cell 0 among the 9");
}

/// A polyhedron with these faces, full of 1.
fn polyhedron(points: &[[f64; 3]], faces: &[Vec<usize>]) -> String {
    let stream: Vec<usize> =
        [faces.len()].into_iter().chain(faces.iter().flat_map(|face| [&[face.len()], &face[..]].concat())).collect();
    let arrays =
        array("Int64", "faces", 1, &words(&stream)) + &array("Int64", "faceoffsets", 1, &stream.len().to_string());
    let corners: Vec<usize> = (0..points.len()).collect();
    let values = words(points.iter().copied().map(linear));
    vtu_of(points, &[&corners], &[42], &arrays).replacen(&values, &words(vec![1; points.len()]), 1)
}

/// Prisms and double pyramids over a polygon, from −1 to 1; tips of pyramids lie over (1.3, 0).
fn over(floor: &[[f64; 2]], is_prism: bool) -> (Vec<[f64; 3]>, Vec<Vec<usize>>) {
    let n = floor.len();
    let layer = |z: f64| floor.iter().map(move |[x, y]| [*x, *y, z]);
    let next = |i: usize| (i + 1) % n;
    if is_prism {
        let sides = (0..n).map(|i| vec![i, next(i), n + next(i), n + i]);
        (
            layer(-1.0).chain(layer(1.0)).collect(),
            [(0..n).rev().collect(), (n..2 * n).collect()].into_iter().chain(sides).collect(),
        )
    } else {
        let tips = [[1.3, 0.0, 1.0], [1.3, 0.0, -1.0]];
        let sides = (0..n).flat_map(|i| [vec![i, next(i), n], vec![next(i), i, n + 1]]);
        (layer(0.0).chain(tips).collect(), sides.collect())
    }
}

/// What is drawn of a polyhedron is what its faces enclose, or that it is not is counted.
#[test]
fn polyhedra_are_filled_as_their_faces_enclose_them_or_counted() {
    let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 2.0], [0.0, 2.0]];
    let (points, mut faces) = over(&square, true);
    let (found, notes) = grid("a.vtu", polyhedron(&points, &faces).as_bytes());
    assert!((mass(&found) - 8.0).abs() < 1e-3 && notes.mended.is_empty(), "{}", mass(&found));
    // Faces need not be wound alike.
    faces[2].reverse();
    let (found, notes) = grid("a.vtu", polyhedron(&points, &faces).as_bytes());
    assert!((mass(&found) - 8.0).abs() < 1e-3 && notes.mended.is_empty(), "{notes:?}");
    faces.pop();
    let open = polyhedron(&points, &faces);
    let (_, notes) = grid("a.vtu", open.as_bytes());
    assert_eq!(
        notes.mended.iter().map(|m| (m.fix, m.count, m.face)).collect::<Vec<_>>(),
        [(Fix::OpenPolyhedron, 1, Some(0))]
    );
    let said = notes.mended[0].to_string();
    assert!(said.contains("1 polyhedron has faces that do not close") && said.ends_with("(cell 0)"), "{said}");
    let strict = ReadParams { strict: true, ..ReadParams::default() };
    let error = bytes("a.vtu", open.as_bytes(), &strict, None).unwrap_err().to_string();
    assert!(error.contains("expected faces that close around the inside of cell 0, a polyhedron"), "{error}");
    // An arrow head, whose corners have their mean behind its notch: from there its wings hide each other.
    let arrow = [[4.0, 0.0], [0.0, 2.0], [-0.3, 1.9], [1.0, 0.0], [-0.3, -1.9], [0.0, -2.0]];
    let twice_area: f64 = (0..6).map(|i| [arrow[i], arrow[(i + 1) % 6]]).map(|[a, b]| a[0] * b[1] - a[1] * b[0]).sum();
    let (points, faces) = over(&arrow, false);
    let (found, notes) = grid("a.vtu", polyhedron(&points, &faces).as_bytes());
    let expected = twice_area / 3.0;
    assert!(notes.mended.is_empty(), "{notes:?}");
    assert!((mass(&found) / expected - 1.0).abs() < 1e-2, "{} for {expected}", mass(&found));
    // No point sees all of a hook.
    let hook = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0], [3.0, 3.0], [3.0, 1.0], [0.0, 1.0]];
    let (points, faces) = over(&hook, true);
    let (_, notes) = grid("a.vtu", polyhedron(&points, &faces).as_bytes());
    assert_eq!(notes.mended.iter().map(|m| (m.fix, m.count)).collect::<Vec<_>>(), [(Fix::HiddenFaces, 1)]);
}

/// A field that is linear stays so, and the middles of edges count: a field of their own is seen.
#[test]
fn quadratic_cells_have_the_values_of_the_middles_of_their_edges() {
    let (found, notes) = grid("a.vtu", &vtu_quadratic());
    let volume = 8.0 / 6.0;
    let expected = volume * linear([0.5, 0.5, 0.5]);
    assert!((mass(&found) / expected - 1.0).abs() < 5e-3, "{} for {expected}", mass(&found));
    assert!(notes.unused.is_empty() && !notes.remarks.iter().any(|r| r.contains("corners")), "{notes:?}");
    // Of x² by its nodes the middle of the cell is 1/4, the value of the square itself; of its corners alone it would be 1.
    let squares = words(QUADRATIC.map(|[x, ..]| x * x));
    let text = String::from_utf8(vtu_quadratic()).unwrap();
    let text = text.replace(&words(QUADRATIC.map(linear)), &squares);
    let (found, _) = grid("a.vtu", text.as_bytes());
    let near = |p: [f64; 3]| {
        let p = DVec3::from_array(p);
        let closest = (0..found.values.len())
            .min_by(|a, b| place(&found, *a).distance(p).total_cmp(&place(&found, *b).distance(p)));
        f64::from(found.values[closest.unwrap()])
    };
    assert!((near([0.5, 0.5, 0.5]) - 0.25).abs() < 0.03, "{}", near([0.5, 0.5, 0.5]));
    // A Lagrange tetrahedron of second order has its points where the quadratic one has them; of third order corners are drawn.
    let lagrange = text.replace("24 \n</DataArray>", "71 \n</DataArray>");
    assert_ne!(lagrange, text);
    assert_eq!(grid("a.vtu", lagrange.as_bytes()).0, found);
    let cubic = vtu_of(&QUADRATIC, &[&[0, 1, 2, 3, 4, 4, 5, 5, 6, 6, 7, 7, 8, 8, 9, 9, 4, 5, 6, 7]], &[71], "");
    let (by_corners, notes) = grid("a.vtu", cubic.as_bytes());
    assert!((mass(&by_corners) / expected - 1.0).abs() < 5e-3, "{}", mass(&by_corners));
    let said = "1 curved cell drawn by the corners alone: points of higher order are not used";
    assert!(notes.remarks.iter().any(|r| r == said), "{:?}", notes.remarks);
}

/// The area of a face with the middles of its edges in its plane is that of its corners; a middle out of the plane is met.
#[test]
fn curved_faces_go_through_the_middles_of_their_edges() {
    let square: [[f64; 3]; 9] = [
        [0.0, 0.0, 0.0],
        [2.0, 0.0, 0.0],
        [2.0, 2.0, 0.0],
        [0.0, 2.0, 0.0],
        [1.0, 0.0, 0.0],
        [2.0, 1.0, 0.0],
        [1.0, 2.0, 0.0],
        [0.0, 1.0, 0.0],
        [1.0, 1.0, 1.0],
    ];
    let triangle: [[f64; 3]; 6] =
        [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]];
    let ranks: Vec<usize> = (0..9).collect();
    let area = |mesh: &Mesh| {
        let corner = |i: u32| mesh.position[i as usize];
        let area = |t: &[u32; 3]| 0.5 * (corner(t[1]) - corner(t[0])).cross(corner(t[2]) - corner(t[0])).length();
        mesh.triangles.iter().map(|t| f64::from(area(t))).sum::<f64>()
    };
    // A pyramid of height 1 over the square has four sides of √2 each.
    for (kind, points, triangles, expected) in [
        (22, &triangle[..], 4, 2.0),
        (23, &square[..8], 6, 4.0),
        (28, &square[..], 8, 4.0 * 2f64.sqrt()),
        (69, &triangle[..], 4, 2.0),
        (70, &square[..], 8, 4.0 * 2f64.sqrt()),
        (36, &square[..8], 6, 4.0),
    ] {
        let found = mesh("a.vtu", vtu_of(points, &[&ranks[..points.len()]], &[kind], "").as_bytes());
        assert_eq!(found.triangles.len(), triangles, "{kind}");
        assert!((area(&found) - expected).abs() < 1e-6, "{kind}: {}", area(&found));
    }
    let wrong = vtu_of(&square, &[&ranks[..7]], &[23], "");
    refused("a.vtu", &wrong, "expected 8 points of cell 0, a quadratic quad, found 7");
    refused(
        "a.vtu",
        &vtu_of(&square, &[&ranks[..3]], &[70], ""),
        "expected 4 or more points of cell 0, a Lagrange quad",
    );
}

#[test]
fn cells_that_are_marked_as_copies_or_hidden_are_left_out() {
    let whole = vtu_of(&BOX, &[&[0, 1, 2, 3, 4, 5, 6, 7], &[1, 2, 6, 5, 8]], &[12, 14], "");
    let marks = format!("</PointData><CellData>{}</CellData>", array("UInt8", "vtkGhostType", 1, "0 1"));
    let (found, notes) = grid("a.vtu", whole.replace("</PointData>", &marks).as_bytes());
    assert!((mass(&found) - 2.0 * linear([1.0, 0.5, 0.5])).abs() < 1e-3, "{}", mass(&found));
    assert!(notes.unused.is_empty(), "{:?}", notes.unused);
    let said = "1 cell that the file marks as copies or as hidden are left out";
    assert!(notes.remarks.iter().any(|r| r == said), "{:?}", notes.remarks);
    refused("a.vtu", &vtu_of(&BOX, &[&[0]], &[255], ""), "expected types of cells from 0 to 254");
}

/// No cell with a number is a volume without any value, not a panic.
#[test]
fn cells_whose_values_are_all_missing_are_gaps() {
    let text = String::from_utf8(vtu_quadratic()).unwrap();
    let gaps = text.replace(&words(QUADRATIC.map(linear)), &words([f64::NAN; 10]));
    let (found, notes) = grid("a.vtu", gaps.as_bytes());
    assert!(found.values.iter().any(|v| v.is_nan()) && found.values.contains(&0.0));
    assert!(notes.remarks.iter().any(|r| r.contains("are NaN: they draw nothing")), "{:?}", notes.remarks);
}

#[test]
fn other_datasets_are_named_with_a_way_out() {
    let error = load("a.vtt", vtk_file("Table", "<Table/>").as_bytes()).unwrap_err();
    assert!(error.found.contains("'Table'") && error.hint.contains("ParaView"), "{error}");
    let legacy = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET FIELD\n";
    assert!(load("a.vtk", legacy.as_bytes()).unwrap_err().hint.contains("ParaView"));
}
