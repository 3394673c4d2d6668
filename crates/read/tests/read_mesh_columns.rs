//! Numbers of vertices and faces that colours may be taken from, and colours of facets.
#![cfg(all(feature = "ply", feature = "vtk"))]

use read::{Loaded, Notes, ReadError, ReadParams, bytes};
use splat_core::{Association, Mesh};

/// Two triangles and a pentagon that is not convex, with numbers of vertices and faces.
const PLY: &str = "ply\nformat ascii 1.0\nelement vertex 6\nproperty float x\nproperty float y\nproperty float z\nproperty float quality\n\
    property uchar alpha\nelement face 3\nproperty int part\nproperty list uchar int vertex_indices\nproperty float quality\nend_header\n\
    0 0 0 1 255\n2 0 0 2 0\n2 2 0 3 51\n1 0.5 0 4 255\n0 2 0 5 255\n1 5 0 6 255\n\
    7 3 0 1 3 9\n8 5 0 1 2 3 4 9\n9 3 4 2 5 9\n";

fn read(name: &str, content: &str, columns: &[&str]) -> Result<(Mesh, Notes), ReadError> {
    let columns = columns.iter().map(|name| (*name).to_owned()).collect();
    let params = ReadParams { columns, ranges: true, ..ReadParams::default() };
    let (Loaded::Mesh(mesh), notes) = bytes(name, content.as_bytes(), &params, None)? else { panic!("no mesh") };
    mesh.validate().unwrap();
    Ok((mesh, notes))
}

#[test]
fn numbers_of_faces_go_to_their_triangles_however_these_are_divided() {
    let (mesh, notes) = read("a.ply", PLY, &["part", "quality"]).unwrap();
    let [quality, part] = &mesh.columns[..] else { panic!("{:?}", mesh.columns) };
    assert_eq!((quality.association, part.association), (Association::Vertex, Association::Triangle));
    assert_eq!(quality.values, [1.0, 2.0, 3.0, 4.0, 5.0, 6.0]);
    assert_eq!(mesh.triangles.len(), 5);
    for (t, part) in mesh.triangles.iter().zip(&part.values) {
        let is_first = t.iter().all(|v| [0, 1, 3].contains(v)) && *part == 7.0;
        let is_last = t.iter().all(|v| [4, 2, 5].contains(v)) && *part == 9.0;
        assert!(is_first || is_last || *part == 8.0, "{t:?} {part}");
    }
    assert_eq!(part.values.iter().filter(|part| **part == 8.0).count(), 3);
    assert_eq!(mesh.opacity, [1.0, 0.0, 0.2, 1.0, 1.0, 1.0]);
    // Where vertices have a number of the name, faces cannot be asked for it.
    assert_eq!(notes.unused, ["face.quality"]);
    let told: Vec<_> = notes.columns.iter().map(|c| (c.name.as_str(), c.range)).collect();
    assert_eq!(told, [("quality", Some([1.0, 6.0])), ("part", Some([7.0, 9.0]))]);
    let error = read("a.ply", PLY, &["heat"]).unwrap_err().to_string();
    assert!(error.contains("expected a column among x, y, z, height, quality, part, found `heat`"), "{error}");
    assert!(read("a.ply", PLY, &["height"]).unwrap().0.columns.is_empty());
}

#[test]
fn strips_have_no_numbers_of_faces() {
    let strips = "element tristrips 1\nproperty list int int vertex_indices\n";
    let with = |before: bool| {
        let head = PLY.replace("end_header\n", "");
        let (vertices, faces) = PLY
            .split_once("end_header\n")
            .unwrap()
            .1
            .split_at(PLY.find("7 3 0").unwrap() - PLY.find("0 0 0 1 255").unwrap());
        let first = head.find("element face").unwrap();
        let end = head.find("0 0 0 1 255").unwrap();
        let (of_vertices, of_faces) = (&head[..first], &head[first..end]);
        if before {
            format!("{of_vertices}{strips}{of_faces}end_header\n{vertices}4 0 1 3 4\n{faces}")
        } else {
            format!("{of_vertices}{of_faces}{strips}end_header\n{vertices}{faces}4 0 1 3 4\n")
        }
    };
    for before in [true, false] {
        let (mesh, _) = read("a.ply", &with(before), &["part"]).unwrap();
        let gaps: Vec<bool> = mesh.columns[0].values.iter().map(|part| part.is_nan()).collect();
        let strips = [true, true];
        let faces = [false; 5];
        let expected = if before { [&strips[..], &faces[..]] } else { [&faces[..], &strips[..]] };
        assert_eq!(gaps, expected.concat());
    }
}

#[test]
fn arrays_of_vtk_have_components_and_names_that_are_taken_are_told_apart() {
    let vtk = "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\n\
        LINES 1 3\n2 0 1\nPOLYGONS 1 5\n4 0 1 2 3\nCELL_DATA 2\nSCALARS p double 1\nLOOKUP_TABLE default\n5 6\n\
        POINT_DATA 4\nSCALARS p double 1\nLOOKUP_TABLE default\n1 2 3 4\nTENSORS T double\n0 0 0 0 0 0 0 0 1\n0 0 0 0 0 0 0 0 2\n\
        0 0 0 0 0 0 0 0 3\n0 0 0 0 0 0 0 0 nan\n";
    let (mesh, notes) = read("a.vtk", vtk, &["p", "face:p", "T:8"]).unwrap();
    let values = |name: &str| &mesh.columns.iter().find(|c| c.name == name).unwrap().values;
    assert_eq!(*values("p"), [1.0, 2.0, 3.0, 4.0]);
    // The line is a cell, too.
    assert_eq!(*values("face:p"), [6.0, 6.0]);
    assert!(values("T:8")[..3] == [1.0, 2.0, 3.0] && values("T:8")[3].is_nan());
    let tensor = notes.columns.iter().find(|c| c.name == "T:magnitude").unwrap();
    assert_eq!((tensor.range, tensor.association), (Some([1.0, 3.0]), Some(Association::Vertex)));
    assert_eq!(notes.unused, ["1 line"]);
}

/// Its length is meant, in volumes as in meshes, and that is said; arrays of cells that have the name of one of points are told by what they belong to.
#[test]
fn a_vector_by_its_name_alone_is_its_length_and_arrays_of_one_name_are_both_there() {
    let of_points = "POINT_DATA 4\nVECTORS U double\n3 4 0 0 0 1 0 0 2 0 0 3\nCELL_DATA 1\nVECTORS U double\n0 6 8\n";
    let vtk = "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n0 0 0 1 0 0 1 1 0 0 1 0\nPOLYGONS 1 5\n4 0 1 2 3\n";
    let (mesh, notes) = read("a.vtk", &format!("{vtk}{of_points}"), &["U", "face:U"]).unwrap();
    let values = |name: &str| &mesh.columns.iter().find(|c| c.name == name).unwrap().values;
    assert_eq!(*values("U"), [5.0, 1.0, 2.0, 3.0]);
    assert_eq!(*values("face:U"), [10.0, 10.0]);
    let said = "U is a vector: its length is drawn, U:magnitude; U:x, U:y … or U:0 … choose one number";
    assert!(notes.remarks.iter().any(|r| r == said), "{:?}", notes.remarks);
    let volume = "# vtk DataFile Version 3.0\na\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 2 2\nORIGIN 0 0 0\nSPACING 1 1 1\n\
        POINT_DATA 12\nVECTORS U double\n3 4 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 0 1\n\
        SCALARS p double 1\nLOOKUP_TABLE default\n1 2 3 4 5 6 7 8 9 10 11 12\nCELL_DATA 2\nSCALARS p double 1\nLOOKUP_TABLE default\n70 80\n";
    let drawn = |array: Option<&str>| {
        let params = ReadParams { array: array.map(str::to_owned), ..ReadParams::default() };
        let (loaded, notes) = bytes("a.vtk", volume.as_bytes(), &params, None).unwrap();
        let Loaded::Grid(grid) = loaded else { panic!("no volume") };
        (grid.values, notes.remarks.join("; "))
    };
    let (values, told) = drawn(Some("U"));
    assert!(values[0] == 5.0 && told.contains(said), "{told}");
    assert_eq!(drawn(Some("cell:p")).0, [70.0, 80.0]);
    assert_eq!(drawn(Some("p")).0, drawn(Some("point:p")).0);
    let (values, told) = drawn(None);
    assert!(
        values.len() == 12
            && told.contains(
                "the array p is drawn; `array` of a scene or --color-by chooses another: cell:p, U:magnitude"
            ),
        "{told}"
    );
}

/// A binary STL of two facets with these attribute bytes.
fn stl(header: &[u8], attributes: [u16; 2]) -> Vec<u8> {
    let mut content = header.to_vec();
    content.resize(80, 0);
    content.extend(2u32.to_le_bytes());
    for (k, attribute) in attributes.into_iter().enumerate() {
        let corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]].map(|[x, y]| [x, y, k as f32]);
        content.extend([[0.0f32; 3]].iter().chain(&corners).flatten().flat_map(|c| c.to_le_bytes()));
        content.extend(attribute.to_le_bytes());
    }
    content
}

#[test]
fn facets_have_their_colours_in_both_forms() {
    let read = |header: &[u8], attributes: [u16; 2]| {
        let read = bytes("a.stl", &stl(header, attributes), &ReadParams::default(), None).unwrap();
        let (Loaded::Mesh(mesh), notes) = read else { panic!("no mesh") };
        (mesh, notes)
    };
    // Red is highest, and bit 15 says that there is a colour.
    let (mesh, notes) = read(b"VisCAM", [1 << 15 | 31 << 10, 31]);
    assert_eq!(mesh.color, [[[1.0, 0.0, 0.0]; 3], [[1.0; 3]; 3]].concat());
    assert_eq!(notes.remarks, ["1 of 2 facets state no colour: they are white"]);
    // Red is lowest, and bit 15 says that the colour is the body's, whose opacity is half.
    let (mesh, notes) = read(b"COLOR=\xff\x00\x00\x80", [31 << 10, 1 << 15]);
    assert_eq!(mesh.color, [[[0.0, 0.0, 1.0]; 3], [[1.0, 0.0, 0.0]; 3]].concat());
    assert_eq!((mesh.opacity, notes.remarks.len()), (vec![128.0 / 255.0; 6], 0));
    let (mesh, notes) = read(b"", [31, 0]);
    assert!(mesh.color.is_empty() && mesh.opacity.is_empty());
    assert_eq!(notes.remarks, ["its facets have attribute bytes that are no colours, and are not used"]);
    assert!(read(b"", [0; 2]).1.remarks.is_empty());
}

/// A PLY file of a square whose texture, four texels of red, green, blue and half clear white, lies beside it.
#[cfg(feature = "png")]
fn textured(name: &str, of_corners: bool) -> (Mesh, Notes) {
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&folder).unwrap();
    let texels = [[255, 0, 0, 255], [0, 255, 0, 255], [0, 0, 255, 255], [255, 255, 255, 51]];
    let image = image::RgbaImage::from_fn(2, 2, |x, y| image::Rgba(texels[(2 * y + x) as usize]));
    image.save(folder.join("it is.png")).unwrap();
    let [of_vertex, of_face] = if of_corners {
        ["", "property list uchar float texcoord\n"]
    } else {
        ["property float s\nproperty float t\n", ""]
    };
    let mut text = format!(
        "ply\nformat ascii 1.0\ncomment TextureFile it is.png\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n{of_vertex}\
         element face 1\nproperty list uchar int vertex_indices\n{of_face}end_header\n"
    );
    let corners = [[0, 0], [1, 0], [1, 1], [0, 1]];
    for [x, y] in corners {
        text += &if of_corners { format!("{x} {y} 0\n") } else { format!("{x} {y} 0 {x} {y}\n") };
    }
    text += "4 0 1 2 3";
    if of_corners {
        text += " 8 0 0 1 0 1 1 0 1";
    }
    std::fs::write(folder.join("a.ply"), text + "\n").unwrap();
    let (Loaded::Mesh(mesh), notes) = read::file(&folder.join("a.ply"), &ReadParams::default(), None).unwrap() else {
        panic!("no mesh")
    };
    mesh.validate().unwrap();
    (mesh, notes)
}

#[cfg(feature = "png")]
#[test]
fn textures_of_ply_are_shown_by_places_of_corners_and_of_vertices() {
    for (name, of_corners) in [("ply-wedges", true), ("ply-places", false)] {
        let (mesh, notes) = textured(name, of_corners);
        assert!(notes.unused.is_empty() && mesh.columns.is_empty(), "{notes:?}");
        assert!((mesh.area() - 1.0).abs() < 1e-6);
        // Rows are counted from the top: blue is below red.
        let at = |x: f32, y: f32| {
            let p = splat_core::glam::Vec3::new(x, y, 0.0);
            let v = (0..mesh.position.len()).min_by(|a, b| {
                let distance = |v: &usize| (mesh.origin.as_vec3() + mesh.position[*v]).distance(p);
                distance(a).total_cmp(&distance(b))
            });
            let v = v.unwrap();
            (mesh.color[v], mesh.opacity[v])
        };
        assert_eq!(at(0.0, 1.0), ([1.0, 0.0, 0.0], 1.0));
        assert_eq!(at(1.0, 1.0), ([0.0, 1.0, 0.0], 1.0));
        assert_eq!(at(0.0, 0.0), ([0.0, 0.0, 1.0], 1.0));
        assert_eq!(at(1.0, 0.0), ([1.0; 3], 0.2));
    }
    let file = "ply\nformat ascii 1.0\ncomment TextureFile ../a.png\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        element face 1\nproperty list uchar int vertex_indices\nend_header\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let (mesh, notes) = read("a.ply", file, &[]).unwrap();
    assert!(mesh.color.is_empty() && notes.remarks.len() == 1, "{notes:?}");
    assert!(
        notes.remarks[0].starts_with("texture '../a.png': expected a file in the same folder or below, found "),
        "{notes:?}"
    );
}
