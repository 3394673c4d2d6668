//! Rectilinear and structured grids of VTK, polyhedra and curved cells, legacy and in XML.

use std::fmt::Display;

/// Coordinates of the rectilinear grid.
pub(crate) const COORDINATES: [&[f64]; 3] = [&[0.0, 1.0, 3.0, 4.0], &[0.0, 0.5, 1.0], &[2.0, 4.0]];

/// The field of all grids.
pub(crate) fn linear([x, y, z]: [f64; 3]) -> f64 {
    1.0 + x + 2.0 * y - 0.5 * z
}

/// Points of the rectilinear grid, x fastest.
pub(crate) fn rectilinear_points() -> Vec<[f64; 3]> {
    let [x, y, z] = COORDINATES;
    z.iter().flat_map(|z| y.iter().flat_map(move |y| x.iter().map(move |x| [*x, *y, *z]))).collect()
}

pub(crate) fn words<T: Display>(values: impl IntoIterator<Item = T>) -> String {
    values.into_iter().map(|v| format!("{v} ")).collect()
}

/// A `DataArray` in text.
pub(crate) fn array(kind: &str, name: &str, components: usize, text: &str) -> String {
    format!(
        "<DataArray type=\"{kind}\" Name=\"{name}\" NumberOfComponents=\"{components}\" format=\"ascii\">\n{text}\n</DataArray>\n"
    )
}

pub(crate) fn vtk_file(kind: &str, content: &str) -> String {
    format!("<VTKFile type=\"{kind}\" version=\"1.0\" byte_order=\"LittleEndian\">\n{content}</VTKFile>")
}

/// A rectilinear grid in XML with values of its points.
pub(crate) fn vtr_of(values: &[f64]) -> String {
    let axes: String = COORDINATES.iter().map(|axis| array("Float64", "c", 1, &words(*axis))).collect();
    let content = format!(
        "<RectilinearGrid WholeExtent=\"0 3 0 2 0 1\">\n<Piece Extent=\"0 3 0 2 0 1\">\n<PointData>\n{}</PointData>\n\
         <Coordinates>\n{axes}</Coordinates>\n</Piece>\n</RectilinearGrid>\n",
        array("Float32", "p", 1, &words(values))
    );
    vtk_file("RectilinearGrid", &content)
}

pub(crate) fn vtr() -> Vec<u8> {
    vtr_of(&rectilinear_points().into_iter().map(linear).collect::<Vec<_>>()).into_bytes()
}

fn head(binary: bool, dataset: &str) -> String {
    let encoding = if binary { "BINARY" } else { "ASCII" };
    format!("# vtk DataFile Version 3.0\na test\n{encoding}\nDATASET {dataset}\n")
}

fn floats(binary: bool, numbers: &[f64]) -> Vec<u8> {
    if binary {
        return [numbers.iter().flat_map(|v| (*v as f32).to_be_bytes()).collect(), vec![b'\n']].concat();
    }
    (words(numbers) + "\n").into_bytes()
}

/// The rectilinear grid as a legacy file.
pub(crate) fn vtk_rectilinear(binary: bool) -> Vec<u8> {
    let mut out = (head(binary, "RECTILINEAR_GRID") + "DIMENSIONS 4 3 2\n").into_bytes();
    for (name, axis) in ["X", "Y", "Z"].iter().zip(COORDINATES) {
        out.extend(format!("{name}_COORDINATES {} float\n", axis.len()).into_bytes());
        out.extend(floats(binary, axis));
    }
    let values: Vec<f64> = rectilinear_points().into_iter().map(linear).collect();
    out.extend(b"POINT_DATA 24\nSCALARS p float 1\nLOOKUP_TABLE default\n");
    out.extend(floats(binary, &values));
    // A line end that could be cut off is none of its data.
    out.pop();
    out
}

/// Points of a structured grid of 3 x 4 x 2, each row of which is bent along x by `bend` of the square of its number.
pub(crate) fn structured_points(bend: f64) -> Vec<[f64; 3]> {
    let point = |n: usize| {
        let [i, j, k] = [n % 3, n / 3 % 4, n / 12].map(|n| n as f64);
        [i + bend * j * j, j + 0.25 * i, 2.0 * k]
    };
    (0..24).map(point).collect()
}

/// A structured grid in XML with the linear field on its points and another on its cells.
pub(crate) fn vts(bend: f64) -> Vec<u8> {
    let points = structured_points(bend);
    let content = format!(
        "<StructuredGrid WholeExtent=\"0 2 0 3 0 1\">\n<Piece Extent=\"0 2 0 3 0 1\">\n<PointData>\n{}</PointData>\n\
         <CellData>\n{}</CellData>\n<Points>\n{}</Points>\n</Piece>\n</StructuredGrid>\n",
        array("Float32", "p", 1, &words(points.iter().copied().map(linear))),
        array("Float32", "c", 1, "0 1 2 3 4 5"),
        array("Float64", "Points", 3, &words(points.concat())),
    );
    vtk_file("StructuredGrid", &content).into_bytes()
}

/// The same as a legacy file.
pub(crate) fn vtk_structured(binary: bool, bend: f64) -> Vec<u8> {
    let points = structured_points(bend);
    let values: Vec<f64> = points.iter().copied().map(linear).collect();
    let mut out = [
        (head(binary, "STRUCTURED_GRID") + "DIMENSIONS 3 4 2\nPOINTS 24 float\n").into_bytes(),
        floats(binary, &points.concat()),
        b"POINT_DATA 24\nSCALARS p float 1\nLOOKUP_TABLE default\n".to_vec(),
        floats(binary, &values),
    ]
    .concat();
    // As above.
    out.pop();
    out
}

/// Corners of a box from 0 to (2, 1, 1), and the tip of a pyramid on its side x = 2.
pub(crate) const BOX: [[f64; 3]; 9] = [
    [0.0, 0.0, 0.0],
    [2.0, 0.0, 0.0],
    [2.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [2.0, 0.0, 1.0],
    [2.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
    [3.0, 0.5, 0.5],
];

/// Faces of the box.
pub(crate) const FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// One piece of cells in XML with the linear field on its points; `more` are further arrays of the cells.
pub(crate) fn vtu_of(points: &[[f64; 3]], cells: &[&[usize]], kinds: &[u8], more: &str) -> String {
    let ends = cells.iter().scan(0, |end, cell| {
        *end += cell.len();
        Some(*end)
    });
    let content = format!(
        "<UnstructuredGrid>\n<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<PointData>\n{}</PointData>\n<Points>\n{}\
         </Points>\n<Cells>\n{}{}{}{more}</Cells>\n</Piece>\n</UnstructuredGrid>\n",
        points.len(),
        cells.len(),
        array("Float64", "p", 1, &words(points.iter().copied().map(linear))),
        array("Float64", "Points", 3, &words(points.concat())),
        array("Int64", "connectivity", 1, &words(cells.concat())),
        array("Int64", "offsets", 1, &words(ends)),
        array("UInt8", "types", 1, &words(kinds)),
    );
    vtk_file("UnstructuredGrid", &content)
}

/// The cells of [`vtu_polyhedra`].
const POLYHEDRA: [&[usize]; 2] = [&[0, 1, 2, 3, 4, 5, 6, 7], &[1, 2, 6, 5, 8]];

/// The numbers that tell of the faces of the box.
pub(crate) fn stream() -> Vec<usize> {
    let faces = FACES.iter().flat_map(|face| [&[4], &face[..]].concat());
    [6].into_iter().chain(faces).collect()
}

/// The box as a polyhedron beside a pyramid, its faces as VTK writes them as from version 9.4 or before.
pub(crate) fn vtu_polyhedra(newer: bool) -> Vec<u8> {
    let faces = if newer {
        [
            array("Int64", "face_connectivity", 1, &words(FACES.concat())),
            array("Int64", "face_offsets", 1, "4 8 12 16 20 24"),
            array("Int64", "polyhedron_to_faces", 1, "0 1 2 3 4 5"),
            array("Int64", "polyhedron_offsets", 1, "6 6"),
        ]
        .concat()
    } else {
        let ends = format!("{} -1", stream().len());
        array("Int64", "faces", 1, &words(stream())) + &array("Int64", "faceoffsets", 1, &ends)
    };
    vtu_of(&BOX, &POLYHEDRA, &[42, 14], &faces).into_bytes()
}

/// The same as a legacy file, whose cells are counted or told by their ends.
pub(crate) fn vtk_polyhedra(by_ends: bool) -> Vec<u8> {
    let faces = stream();
    let pyramid = words(POLYHEDRA[1]);
    let cells = if by_ends {
        let (end, last) = (faces.len(), faces.len() + 5);
        format!(
            "CELLS 3 {last}\nOFFSETS vtktypeint64\n0 {end} {last}\nCONNECTIVITY vtktypeint64\n{}{pyramid}\n",
            words(&faces)
        )
    } else {
        format!("CELLS 2 {}\n{} {}\n5 {pyramid}\n", faces.len() + 7, faces.len(), words(&faces))
    };
    let points = words(BOX.concat());
    let values = words(BOX.map(linear));
    let head = head(false, "UNSTRUCTURED_GRID");
    format!("{head}POINTS 9 double\n{points}\n{cells}CELL_TYPES 2\n42 14\nPOINT_DATA 9\nSCALARS p double 1\n{values}\n")
        .into_bytes()
}

/// A quadratic tetrahedron with the corners 0, (2, 0, 0), (0, 2, 0) and (0, 0, 2).
pub(crate) const QUADRATIC: [[f64; 3]; 10] = [
    [0.0, 0.0, 0.0],
    [2.0, 0.0, 0.0],
    [0.0, 2.0, 0.0],
    [0.0, 0.0, 2.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 1.0],
    [0.0, 1.0, 1.0],
];

/// It as a file.
pub(crate) fn vtu_quadratic() -> Vec<u8> {
    vtu_of(&QUADRATIC, &[&[0, 1, 2, 3, 4, 5, 6, 7, 8, 9]], &[24], "").into_bytes()
}
