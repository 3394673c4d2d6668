//! Files with one fault among much that is right: the rest is read, what was mended is counted, strict readers refuse.
#![cfg(all(feature = "ply", feature = "obj"))]

use read::Fault;
use read::{Fix, Loaded, ReadParams, bytes};
use splat_core::glam::Vec3;
use splat_core::{Mesh, Progress};

/// The mesh, and the lines that say what was mended; a strict reader refuses with an error that begins so.
#[track_caller]
fn mended(name: &str, content: impl AsRef<[u8]>, refusal: &str) -> (Mesh, Vec<(Fix, String)>) {
    let content = content.as_ref();
    let strict = ReadParams { strict: true, ..ReadParams::default() };
    let error = bytes(name, content, &strict, None).unwrap_err();
    assert_eq!(error.fault, Fault::Input);
    assert!(error.to_string().starts_with(refusal) && error.to_string().contains("\nhint: "), "{error}");
    let read = bytes(name, content, &ReadParams::default(), None).unwrap();
    let (Loaded::Mesh(mesh), notes) = read else { panic!("no mesh") };
    mesh.validate().unwrap();
    (mesh, notes.mended.iter().map(|m| (m.fix, m.to_string())).collect())
}

/// A mesh that also a strict reader takes, with nothing to say.
#[track_caller]
fn whole(name: &str, content: impl AsRef<[u8]>) -> Mesh {
    let strict = ReadParams { strict: true, ..ReadParams::default() };
    let (loaded, notes) = bytes(name, content.as_ref(), &strict, None).unwrap();
    assert!(notes.mended.is_empty(), "{:?}", notes.mended);
    let Loaded::Mesh(mesh) = loaded else { panic!("no mesh") };
    mesh
}

fn area(mesh: &Mesh, triangles: &[[u32; 3]]) -> f32 {
    let at = |v: u32| mesh.position[v as usize];
    triangles.iter().map(|t| 0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).length()).sum()
}

/// A PLY file of these vertices and faces.
fn ply(vertices: &[[f64; 2]], faces: &[&[usize]]) -> String {
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         element face {}\nproperty list int int vertex_indices\nend_header\n",
        vertices.len(),
        faces.len()
    );
    vertices.iter().for_each(|[x, y]| text += &format!("{x} {y} 0\n"));
    for face in faces {
        let ids: Vec<String> = face.iter().map(usize::to_string).collect();
        text += &format!("{} {}\n", face.len(), ids.join(" "));
    }
    text
}

/// Unequal halves: a bow tie of equal ones has no normal.
const BOW_TIE: [[f64; 2]; 4] = [[0.0, 0.0], [2.0, 2.0], [2.0, 0.0], [0.0, 1.0]];

#[test]
fn one_crossing_quadrangle_is_its_two_triangles_and_the_rest_is_there() {
    let (mesh, said) = mended(
        "a.ply",
        ply(&BOW_TIE, &[&[0, 1, 2], &[0, 1, 2, 3], &[2, 1, 0]]),
        "a.ply:7: expected faces whose edges do not cross, found face 1 of 4 corners that crosses itself",
    );
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 1, 2], [0, 2, 3], [2, 1, 0]]);
    let line = "a.ply:7: 1 face of four corners crosses itself and is drawn as two triangles (face 1)";
    assert_eq!(said, [(Fix::CrossingQuad, line.to_owned())]);
    let obj = "v 0 0 0\nv 2 2 0\nv 2 0 0\nv 0 1 0\n\nf 1 2 3 4\nf 1 2 3\nf 1 2 3 4\n";
    let (mesh, said) =
        mended("a.obj", obj, "a.obj:6: expected faces whose edges do not cross, found face 1 of 4 corners");
    assert_eq!(mesh.triangles.len(), 5);
    let line =
        "a.obj:6: 2 faces of four corners cross themselves and are drawn as two triangles each (the first is face 1)";
    assert_eq!(said[0].1, line);
}

#[test]
fn a_larger_crossing_face_fills_what_its_edges_go_around() {
    let turn = |i: usize| std::f64::consts::TAU * i as f64 / 5.0;
    let pentagram: Vec<[f64; 2]> = (0..5).map(|i| turn(2 * i)).map(|a| [a.cos(), a.sin()]).collect();
    let refusal = "a.ply:7: expected faces whose edges do not cross, found face 0 of 5 corners";
    let (mesh, said) = mended("a.ply", ply(&pentagram, &[&[0, 1, 2, 3, 4]]), refusal);
    assert_eq!(said[0].0, Fix::CrossingPolygon);
    assert!(!mesh.triangles.is_empty() && area(&mesh, &mesh.triangles) <= 2.378, "{:?}", mesh.triangles);
    // A long strip with a small loop at its end: the strip is whole.
    let loop_end = [[0.0, 0.0], [8.0, 0.0], [8.0, 1.0], [0.0, 1.0], [-0.5, 0.25], [-0.5, 0.75]];
    let refusal = "a.ply:7: expected faces whose edges do not cross, found face 0 of 6 corners";
    let (mesh, said) = mended("a.ply", ply(&loop_end, &[&[0, 1, 2, 3, 4, 5]]), refusal);
    assert_eq!(said[0].0, Fix::CrossingPolygon);
    let found = area(&mesh, &mesh.triangles);
    assert!((7.9..8.6).contains(&found), "{found}");
}

#[test]
fn faces_of_two_corners_are_left_out_and_repeated_corners_are_no_fault() {
    let square = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0]];
    let faces: &[&[usize]] = &[&[0, 1], &[0, 1, 2, 3], &[3], &[], &[0, 1, 1, 2, 2, 2, 3], &[0, 0, 1]];
    let (mesh, said) =
        mended("a.ply", ply(&square, faces), "a.ply:14:1: expected 3 or more corners of face 0, found 2");
    let line = "a.ply:14:1: 3 faces of fewer than three corners are left out (the first is face 0)";
    assert_eq!(said, [(Fix::TooFewCorners, line.to_owned())]);
    assert_eq!(area(&mesh, &mesh.triangles), 4.0);
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2\nf 1 2 3\nf\n";
    let (mesh, said) = mended("a.obj", obj, "a.obj:4:1: expected 3 or more corners of face 1, found 2");
    assert_eq!(mesh.triangles, [[0, 1, 2]]);
    assert_eq!(said[0].1, "a.obj:4:1: 2 faces of fewer than three corners are left out (the first is face 1)");
}

/// Strips of a strip of squares: every other triangle turns around, −1 begins anew, corners twice join strips.
#[test]
fn triangle_strips_are_faces_of_one_orientation() {
    let vertices: Vec<[f64; 2]> = (0..8).map(|i| [f64::from(i / 2), f64::from(i % 2)]).collect();
    let file = |kind: &str, strip: &str| {
        let text = ply(&vertices, &[]).replace("element face 0", "element tristrips 1");
        text.replace("int int vertex", &format!("int {kind} vertex")) + strip
    };
    let up = |mesh: &Mesh| {
        let at = |v: u32| mesh.position[v as usize];
        mesh.triangles.iter().all(|t| (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])) == Vec3::Z)
    };
    for (kind, strip, count) in [
        ("int", "8 1 0 3 2 5 4 7 6\n", 6),
        ("int", "9 1 0 3 2 -1 5 4 7 6\n", 4),
        ("int", "10 -1 1 0 3 2 -1 5 4 7 -1\n", 3),
        ("uint", "9 1 0 3 2 4294967295 5 4 7 6\n", 4),
        ("uchar", "10 1 0 3 2 2 5 5 4 7 6\n", 4),
    ] {
        let mesh = whole("a.ply", file(kind, strip));
        assert_eq!((mesh.triangles.len(), up(&mesh)), (count, true), "{strip} {:?}", mesh.triangles);
    }
    let bad = bytes("a.ply", file("int", "4 1 0 3 8\n").as_bytes(), &ReadParams::default(), None).unwrap_err();
    assert!(bad.to_string().starts_with("a.ply:18:9: expected a vertex of strip 0 from 0 to 7, found '8'"), "{bad}");
    // Beside faces.
    let both = ply(&vertices, &[&[0, 2, 1]])
        .replace("end_header", "element tristrips 1\nproperty list int int vertex_indices\nend_header");
    assert_eq!(whole("a.ply", both + "4 1 0 3 2\n").triangles, [[0, 2, 1], [1, 0, 3], [3, 0, 2]]);
}

#[test]
fn normals_that_an_obj_names_and_has_not_are_computed() {
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    let refusal =
        "a.obj:4:3: expected an index from 1 to 0, or from -0 to -1: there are 0 normals so far, found '1//1'";
    let (mesh, said) = mended("a.obj", format!("{corners}f 1//1 2//1 3//1\n"), refusal);
    assert_eq!((mesh.triangles.as_slice(), mesh.normal.len()), (&[[0, 1, 2]][..], 0));
    let line = "a.obj:4:3: 3 corners name normals, of which the file has none: normals are computed";
    assert_eq!(said, [(Fix::MissingNormals, line.to_owned())]);
    // Normals that come too late, or are no numbers, are errors.
    for face in ["f 1//1 2//1 3//1\nvn 0 0 1\n", "f 1//x 2//1 3//1\n", "f 1//0 2//1 3//1\n"] {
        let error = bytes("a.obj", format!("{corners}{face}").as_bytes(), &ReadParams::default(), None).unwrap_err();
        assert!(error.to_string().starts_with("a.obj:4:3: expected an index"), "{error}");
    }
}

#[test]
fn a_binary_stl_that_begins_like_a_text_and_has_some_bytes_more_is_binary() {
    let mut file = b"solid made by some program".to_vec();
    file.resize(80, b' ');
    file.extend(1u32.to_le_bytes());
    file.extend([0; 12]);
    [0.0f32, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0].iter().for_each(|c| file.extend(c.to_le_bytes()));
    file.extend([0; 2]);
    assert_eq!(whole("a.stl", &file).triangles.len(), 1);
    file.extend(b"\r\n");
    let (mesh, said) = mended("a.stl", &file, "a.stl@80: expected 84 + 50 x 1 = 134 bytes of a binary STL, or a text");
    assert_eq!(mesh.position, [Vec3::ZERO, Vec3::X, Vec3::Y]);
    let line = "a.stl@134: 2 bytes after the last facet are read over";
    assert_eq!(said, [(Fix::TrailingBytes, line.to_owned())]);
    file.truncate(130);
    let error = bytes("a.stl", &file, &ReadParams::default(), None).unwrap_err();
    assert!(error.to_string().starts_with("a.stl@80: expected 84 + 50 x 1"), "{error}");
}

#[test]
fn a_reader_that_is_asked_to_stop_stops() {
    let progress = Progress::new();
    progress.cancel();
    for (name, content) in [("a.ply", ply(&BOW_TIE, &[&[0, 1, 2, 3]])), ("a.obj", "v 0 0 0\n".repeat(9))] {
        let error = bytes(name, content.as_bytes(), &ReadParams::default(), Some(&progress)).unwrap_err();
        assert_eq!((error.fault, error.fault.exit_code()), (Fault::Cancelled, 130));
    }
}
