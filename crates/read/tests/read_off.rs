//! OFF: what it becomes, and what is wrong with it in words.

use crate::read_samples::{gzip, load, off};
use read::{Fault, Fix, Loaded, ReadParams, bytes};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{MemoryAccount, Mesh, RawPoints};

fn mesh(content: &str) -> Mesh {
    match load("a.off", content.as_bytes()).unwrap() {
        Loaded::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn points(content: &str) -> RawPoints {
    match load("a.off", content.as_bytes()).unwrap() {
        Loaded::Points(points) => points,
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn refused(content: &str, beginning: &str) {
    let error = load("a.off", content.as_bytes()).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().starts_with(beginning), "{error}");
    assert!(error.to_string().contains("\nhint: "), "{error}");
}

const SQUARE: &str = "OFF\n# a square\n4 1 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n4 0 1 2 3\n";

#[test]
fn faces_are_polygons_in_every_spelling_of_the_file() {
    let glued = SQUARE.replace("OFF\n# a square\n", "OFF");
    let joined = SQUARE.replace("OFF\n# a square\n", "OFF ");
    let edgeless = SQUARE.replace("4 1 0\n", "4 1\n\n  # comment\n");
    for content in
        [SQUARE.to_owned(), glued, joined, edgeless, SQUARE.replace('\n', "\r\n"), format!("\u{feff}{SQUARE}")]
    {
        let mesh = mesh(&content);
        assert_eq!(mesh.position, [Vec3::ZERO, Vec3::X, Vec3::new(1.0, 1.0, 0.0), Vec3::Y]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert!(mesh.normal.is_empty() && mesh.color.is_empty());
    }
    let Loaded::Mesh(packed) = load("a.off.gz", &gzip(SQUARE.as_bytes())).unwrap() else { panic!("no mesh") };
    assert_eq!(packed, mesh(SQUARE));
    // A concave face, from its second corner on.
    let arrow = mesh("OFF\n4 1 0\n4 0 0\n-2 3 0\n1 0 0\n-2 -3 0\n4 0 1 2 3\n");
    assert!(arrow.triangles.iter().all(|t| t.contains(&0) && t.contains(&2)), "{:?}", arrow.triangles);
}

#[test]
fn the_first_word_says_what_a_vertex_has() {
    let faces = "3 0 1 2\n";
    let normals = mesh(&format!("NOFF\n3 1 0\n0 0 0 0 0 2\n1 0 0 0 0 1e-200\n0 1 0 0 0 1e200\n{faces}"));
    assert_eq!(normals.normal, [Vec3::Z; 3]);
    let whole = mesh(&format!("COFF\n3 1 0\n0 0 0 255 0 0\n1 0 0 0 128 0 9\n0 1 0 0 0 1\n{faces}"));
    assert_eq!(whole.color[0], [1.0, 0.0, 0.0]);
    assert!((whole.color[1][1] - 0.215_860_5).abs() < 1e-6);
    let linear = mesh(&format!("COFF\n3 1 0\n0 0 0 1 0.5 0\n1 0 0 0 0 0\n0 1 0 0 0 1\n{faces}"));
    assert_eq!(linear.color, [[1.0, 0.5, 0.0], [0.0; 3], [0.0, 0.0, 1.0]]);
    let both = points("STCNOFF\n1 0 0\n1 2 3 0 0 1 0 1 0 0.5 0.5\n");
    assert_eq!(
        (both.exact_position(0), both.normal[0], both.color[0]),
        (DVec3::new(1.0, 2.0, 3.0), Vec3::Z, [0.0, 1.0, 0.0])
    );
    let unused = bytes("a.off", &off(), &ReadParams::default(), None).unwrap().1.unused;
    assert_eq!(unused, ["face colours"]);
    assert_eq!(whole.opacity, [1.0, 9.0 / 255.0, 1.0]);
    let shares = mesh(&format!("COFF\n3 1 0\n0 0 0 255 0 0 0.5\n1 0 0 0 128 0 1\n0 1 0 0 0 1 0\n{faces}"));
    assert_eq!(shares.opacity, [0.5, 1.0, 0.0]);
}

#[test]
fn faults_are_told_with_their_places() {
    refused("", "a.off@0: expected 'OFF', found an empty file");
    refused("4OFF\n", "a.off:1:1: expected 'OFF', 'COFF', 'NOFF' or 'CNOFF', found '4OFF'");
    refused("OFF BINARY\n", "a.off:1:5: expected OFF as text, found 'BINARY'");
    refused("OFF\n", "a.off:2: expected numbers of vertices, faces and edges, found the end of the file");
    refused("OFF\n9999999999 0 0\n", "a.off:2:1: expected at most ");
    refused("OFF\n0 18446744073709551616 0\n", "a.off:2:3: expected at most ");
    refused("OFF\n1 -1 0\n0 0 0\n", "a.off:2:3: expected at most ");
    refused(&SQUARE.replace("1 1 0\n", "1 1 0 9\n"), "a.off:6: expected a vertex of 3 numbers, found 4 on the line");
    refused(&SQUARE.replace("1 1 0\n", "1 nan 0\n"), "a.off:6:3: expected a finite decimal number, found 'nan'");
    refused(&SQUARE.replace("4 0 1 2 3", "4 0 1 2 4"), "a.off:8:9: expected a vertex from 0 to 3, found '4'");
    refused(&SQUARE.replace("4 0 1 2 3", "4 0 1 2 -1"), "a.off:8:9: expected a vertex from 0 to 3, found '-1'");
    refused(&SQUARE.replace("4 0 1 2 3", "5 0 1 2 3"), "a.off:8: expected a number of corners, and as many vertices");
    refused(
        &SQUARE.replace("4 0 1 2 3", "2 0 1 2 3"),
        "a.off:8: expected a number of corners, as many vertices, and a",
    );
    refused(&SQUARE.replace("4 0 1 2 3\n", ""), "a.off:8: expected face 0 of 1, found the end of the file");
    refused(&format!("{SQUARE}3 0 1 2\n"), "a.off:9:1: expected the end of the file after the last face, found '3'");
    refused("COFF\n1 0 0\n0 0 0 256 0 0\n", "a.off:3:7: expected a colour from 0 to 255, found '256'");
    refused("COFF\n1 0 0\n0 0 0 2 0.5 0\n", "a.off:3:7: expected a colour from 0 to 1, as others have a point");
    refused("OFF\n2 0 0\n1 2 3\n1 2 1e308\n", "a.off: expected coordinates that fit 32-bit floats once");
    let limits = ReadParams { memory: MemoryAccount::new(60), ..ReadParams::default() };
    assert_eq!(bytes("a.off", SQUARE.as_bytes(), &limits, None).unwrap_err().fault, Fault::Limit);
}

#[test]
fn faces_of_fewer_than_three_corners_are_left_out() {
    let content = SQUARE.replace("4 1 0", "4 2 0") + "2 0 1\n";
    let (loaded, notes) = bytes("a.off", content.as_bytes(), &ReadParams::default(), None).unwrap();
    assert!(matches!(loaded, Loaded::Mesh(mesh) if mesh.triangles.len() == 2));
    assert_eq!((notes.mended[0].fix, notes.mended[0].face), (Fix::TooFewCorners, Some(1)));
    let strict = ReadParams { strict: true, ..ReadParams::default() };
    assert!(bytes("a.off", content.as_bytes(), &strict, None).is_err());
}
