//! Cells and surfaces of VTK, legacy and in XML.
//!
//! The cells are a hexahedron from (0, 0, 0) to (2, 1, 1), a pyramid on its side x = 2 with its tip at (3, 0.5, 0.5), and the triangle of
//! three of their points. The field of the points is 1 + x + 2 y, that of the cells 3, 4.25 and 0.

use super::volumes::Vti;

pub(crate) const POINTS: [[f32; 3]; 9] = [
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
const CORNERS: [&[i32]; 3] = [&[0, 1, 2, 3, 4, 5, 6, 7], &[1, 2, 6, 5, 8], &[0, 1, 2]];
const KINDS: [i32; 3] = [12, 14, 5];
const OF_CELLS: [f32; 3] = [3.0, 4.25, 0.0];

pub(crate) fn field([x, y, _]: [f32; 3]) -> f32 {
    1.0 + x + 2.0 * y
}

/// Numbers of a legacy file.
fn numbers<const N: usize, T: Copy + ToString>(binary: bool, values: &[T], bytes: fn(T) -> [u8; N]) -> Vec<u8> {
    if binary {
        return [values.iter().flat_map(|v| bytes(*v)).collect(), vec![b'\n']].concat();
    }
    (values.iter().map(T::to_string).collect::<Vec<_>>().join(" ") + "\n").into_bytes()
}

fn floats(binary: bool, values: &[f32]) -> Vec<u8> {
    numbers(binary, values, f32::to_be_bytes)
}

fn ints(binary: bool, values: &[i32]) -> Vec<u8> {
    numbers(binary, values, i32::to_be_bytes)
}

fn longs(binary: bool, values: &[i64]) -> Vec<u8> {
    numbers(binary, values, i64::to_be_bytes)
}

/// Cells as a legacy file tells of them: by their ends, or with counts.
fn lists(name: &str, cells: &[&[i32]], by_ends: bool, binary: bool) -> Vec<u8> {
    let corners = cells.concat();
    if by_ends {
        let ends = cells.iter().scan(0, |end, cell| {
            *end += cell.len() as i64;
            Some(*end)
        });
        let ends: Vec<i64> = [0].into_iter().chain(ends).collect();
        let head = format!("{name} {} {}\nOFFSETS vtktypeint64\n", ends.len(), corners.len());
        let corners: Vec<i64> = corners.iter().map(|c| i64::from(*c)).collect();
        let between = b"CONNECTIVITY vtktypeint64\n";
        return [head.as_bytes(), &longs(binary, &ends), between, &longs(binary, &corners)].concat();
    }
    let counted: Vec<i32> = cells.iter().flat_map(|cell| [&[cell.len() as i32][..], cell].concat()).collect();
    let head = format!("{name} {} {}\n", cells.len(), counted.len());
    [head.as_bytes(), &ints(binary, &counted)].concat()
}

fn head(dataset: &str, binary: bool, points: &[[f32; 3]]) -> Vec<u8> {
    let encoding = if binary { "BINARY" } else { "ASCII" };
    let text =
        format!("# vtk DataFile Version 5.1\na test\n{encoding}\nDATASET {dataset}\nPOINTS {} float\n", points.len());
    [text.into_bytes(), floats(binary, &points.concat())].concat()
}

/// The cells as a legacy file with the field of the points.
pub(crate) fn vtk_cells(binary: bool, by_ends: bool) -> Vec<u8> {
    let values: Vec<f32> = POINTS.iter().map(|p| field(*p)).collect();
    [
        head("UNSTRUCTURED_GRID", binary, &POINTS),
        lists("CELLS", &CORNERS, by_ends, binary),
        b"CELL_TYPES 3\n".to_vec(),
        ints(binary, &KINDS),
        b"POINT_DATA 9\nSCALARS density float 1\nLOOKUP_TABLE default\n".to_vec(),
        floats(binary, &values),
    ]
    .concat()
}

/// A square, the other way around as a strip one step above it, and a line, as a legacy file, with normals.
pub(crate) fn vtk_surface(binary: bool, by_ends: bool) -> Vec<u8> {
    let corners = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let points: Vec<[f32; 3]> = [0.0, 1.0].iter().flat_map(|z| corners.map(|[x, y]| [x, y, *z])).collect();
    let normals: Vec<f32> = [[0.0, 0.0, 2.0]; 8].concat();
    [
        head("POLYDATA", binary, &points),
        lists("LINES", &[&[0, 4]], by_ends, binary),
        lists("POLYGONS", &[&[0, 1, 2, 3]], by_ends, binary),
        lists("TRIANGLE_STRIPS", &[&[4, 5, 7, 6]], by_ends, binary),
        b"POINT_DATA 8\nNORMALS up float\n".to_vec(),
        floats(binary, &normals),
    ]
    .concat()
}

/// A part of the cells: ranks of its points, its cells by ranks among these, and ranks of the cells.
type Part = (&'static [usize], &'static [&'static [i32]], &'static [usize]);

/// All of them.
const WHOLE: Part = (&[0, 1, 2, 3, 4, 5, 6, 7, 8], &CORNERS, &[0, 1, 2]);
/// The hexahedron, nothing, and what is beside it.
const PARTS: [Part; 3] = [
    (&[0, 1, 2, 3, 4, 5, 6, 7], &[CORNERS[0]], &[0]),
    (&[], &[], &[]),
    (&[0, 1, 2, 5, 6, 8], &[&[1, 2, 4, 3, 5], &[0, 1, 2]], &[1, 2]),
];

/// The cells in XML: `ascii` or `binary`, with the field of the cells behind that of the points.
pub(crate) fn vtu(encoding: &'static str, compressed: bool) -> Vec<u8> {
    in_pieces(encoding, compressed, &[WHOLE])
}

/// The same in pieces, of which one is empty.
pub(crate) fn vtu_pieces(encoding: &'static str, compressed: bool) -> Vec<u8> {
    in_pieces(encoding, compressed, &PARTS)
}

fn in_pieces(encoding: &'static str, compressed: bool, parts: &[Part]) -> Vec<u8> {
    let vti = Vti { encoding, big: false, wide: false, compressed };
    let array = |kind: &str, name: &str, more: &str, text: String, bytes: Vec<u8>| {
        let data = if encoding == "ascii" || bytes.is_empty() { text } else { vti.base64(&bytes) };
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" {more}format=\"{encoding}\">\n{data}\n</DataArray>\n")
    };
    let text = |values: &[String]| values.join(" ");
    let floats = |name: &str, more: &str, values: &[f32]| {
        let words: Vec<String> = values.iter().map(f32::to_string).collect();
        array("Float32", name, more, text(&words), values.iter().flat_map(|v| v.to_le_bytes()).collect())
    };
    let ints = |name: &str, values: &[i32]| {
        let words: Vec<String> = values.iter().map(i32::to_string).collect();
        array("Int32", name, "", text(&words), values.iter().flat_map(|v| v.to_le_bytes()).collect())
    };
    let piece = |(points, corners, cells): &Part| {
        let points: Vec<[f32; 3]> = points.iter().map(|rank| POINTS[*rank]).collect();
        let values: Vec<f32> = points.iter().map(|p| field(*p)).collect();
        let ends: Vec<i32> = (1..=corners.len()).map(|n| corners[..n].concat().len() as i32).collect();
        format!(
            "<Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n<PointData Scalars=\"density\">\n{}</PointData>\n\
             <CellData>\n{}</CellData>\n<Points>\n{}</Points>\n<Cells>\n{}{}{}</Cells>\n</Piece>\n",
            points.len(),
            cells.len(),
            floats("density", "", &values),
            floats("of_cells", "", &cells.iter().map(|rank| OF_CELLS[*rank]).collect::<Vec<_>>()),
            floats("Points", "NumberOfComponents=\"3\" ", &points.concat()),
            ints("connectivity", &corners.concat()),
            ints("offsets", &ends),
            ints("types", &cells.iter().map(|rank| KINDS[*rank]).collect::<Vec<_>>()),
        )
    };
    let compressor = if compressed { " compressor=\"vtkZLibDataCompressor\"" } else { "" };
    format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"LittleEndian\"{compressor}>\n<UnstructuredGrid>\n\
         {}</UnstructuredGrid>\n</VTKFile>",
        parts.iter().map(piece).collect::<String>()
    )
    .into_bytes()
}

/// A square in XML, red, green, blue and black, with the empty elements that VTK writes.
pub(crate) fn vtp() -> Vec<u8> {
    let empty = "<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">\n</DataArray>\n\
        <DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">\n</DataArray>\n";
    format!(
        "<VTKFile type=\"PolyData\" version=\"1.0\" byte_order=\"LittleEndian\">\n<PolyData>\n\
         <Piece NumberOfPoints=\"4\" NumberOfVerts=\"0\" NumberOfLines=\"0\" NumberOfStrips=\"0\" NumberOfPolys=\"1\">\n\
         <PointData Scalars=\"paint\">\n<DataArray type=\"UInt8\" Name=\"paint\" NumberOfComponents=\"3\" format=\"ascii\">\n\
         255 0 0 0 255 0 0 0 255 0 0 0\n</DataArray>\n<DataArray type=\"Float32\" Name=\"heat\" format=\"ascii\">\n1 2 3 4\n\
         </DataArray>\n</PointData>\n<CellData>\n</CellData>\n<Points>\n\
         <DataArray type=\"Float64\" Name=\"Points\" NumberOfComponents=\"3\" format=\"ascii\">\n\
         0 0 0 1 0 0 1 1 0 0 1 0\n</DataArray>\n</Points>\n<Verts>\n{empty}</Verts>\n<Lines>\n{empty}</Lines>\n\
         <Strips>\n{empty}</Strips>\n<Polys>\n<DataArray type=\"Int64\" Name=\"connectivity\" format=\"ascii\">\n0 1 2 3\n\
         </DataArray>\n<DataArray type=\"Int64\" Name=\"offsets\" format=\"ascii\">\n4\n</DataArray>\n</Polys>\n\
         </Piece>\n</PolyData>\n</VTKFile>"
    )
    .into_bytes()
}

/// The square of [`vtp`] twice, as two pieces, each with normals; the second one is a step above.
pub(crate) fn vtp_pieces() -> Vec<u8> {
    let text = String::from_utf8(vtp()).expect("a text");
    let (before, rest) = text.split_once("<Piece").expect("a piece");
    let (piece, after) = rest.split_once("</Piece>").expect("an end of it");
    let normals = "<PointData Normals=\"up\" Scalars=\"paint\">\n<DataArray type=\"Float32\" Name=\"up\" \
        NumberOfComponents=\"3\" format=\"ascii\">\n0 0 1 0 0 1 0 0 1 0 0 1\n</DataArray>";
    let piece = format!("<Piece{}</Piece>", piece.replace("<PointData Scalars=\"paint\">", normals));
    let above = piece.replace("0 0 0 1 0 0 1 1 0 0 1 0", "0 0 1 1 0 1 1 1 1 0 1 1");
    format!("{before}{piece}\n{above}{after}").into_bytes()
}
