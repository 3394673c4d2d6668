//! PLY of every encoding gives the same mesh; points without faces become raw points.
#![cfg(feature = "ply")]

use crate::read_samples::{VERTICES, gzip, load, ply_ascii, ply_binary};
use read::{Loaded, ReadParams, bytes};
use splat_core::Mesh;
use splat_core::glam::{DVec3, Vec3};

fn mesh(name: &str, content: &[u8]) -> Mesh {
    match load(name, content).unwrap() {
        Loaded::Mesh(mesh) => mesh,
        other => panic!("not a mesh: {other:?}"),
    }
}

#[test]
fn ascii_mesh_has_fans_unit_normals_and_linear_colours() {
    let mesh = mesh("a.ply", ply_ascii().as_bytes());
    assert_eq!(mesh.origin, DVec3::ZERO);
    assert_eq!(mesh.position, VERTICES.map(Vec3::from_array));
    assert_eq!(mesh.normal, [Vec3::Z; 4]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 3]]);
    // 10/255 lies below the knee of the sRGB curve, 128/255 above: 10/255/12.92 and ((128/255 + 0.055)/1.055)^2.4.
    assert!((mesh.color[1][0] - 0.003_035_27).abs() < 1e-8, "{:?}", mesh.color[1]);
    assert!((mesh.color[1][2] - 0.215_860_5).abs() < 1e-6, "{:?}", mesh.color[1]);
    assert_eq!((mesh.color[0][0], mesh.color[0][1]), (0.0, 1.0));
    mesh.validate().unwrap();
}

#[test]
fn ba10_both_byte_orders_and_gzip_give_the_same_mesh() {
    let expected = mesh("a.ply", ply_ascii().as_bytes());
    for content in [ply_binary(false), ply_binary(true), gzip(&ply_binary(true)), gzip(ply_ascii().as_bytes())] {
        assert_eq!(mesh("b.ply.gz", &content), expected);
    }
}

#[test]
fn ba08_line_ends_byte_order_mark_tabs_and_blank_lines() {
    let expected = mesh("a.ply", ply_ascii().as_bytes());
    let text = ply_ascii();
    let mixed: String =
        text.split('\n').enumerate().map(|(i, l)| format!("{l}{}", ["\n", "\r\n", "\r"][i % 3])).collect();
    let variants = [
        text.replace('\n', "\r\n"),
        text.replace('\n', "\r"),
        mixed,
        format!("\u{feff}{text}"),
        text.trim_end().to_owned(),
        text.replace(" 255 ", "\t 255 \t"),
        text.replace("end_header\n", "end_header\n\n\n") + "\n\n",
    ];
    for (i, variant) in variants.iter().enumerate() {
        assert_eq!(mesh("a.ply", variant.as_bytes()), expected, "variant {i}");
    }
    let binary = ply_binary(false);
    let split = binary.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(binary[..split].to_vec()).unwrap().replace('\n', "\r\n");
    assert_eq!(mesh("a.ply", &[header.as_bytes(), &binary[split..]].concat()), expected, "CR LF before binary");
}

#[test]
fn ba08_a_line_of_10_mb_is_refused_at_1_mib() {
    let text = format!(
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\n1 2 {}3\n",
        " ".repeat(10 << 20)
    );
    let error = load("long.ply", text.as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with("long.ply:8: expected a line of at most 1 MiB"), "{error}");
}

const POINTS: &str = "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n\
    property float red\nproperty float green\nproperty float blue\nproperty float nx\nproperty float ny\nproperty float nz\n\
    property float intensity\nend_header\n\
    5000000.25 1 -1 0.5 0.25 1 0 0 0 7\n5000001.5 2 -2 0 0 0 0 1e-30 0 8\n5000002.75 3 -3 1 1 1 3 4 0 9.5\n";

#[test]
fn points_far_from_zero_keep_millimetres_and_floats_stay_linear() {
    let Loaded::Points(points) = load("p.ply", POINTS.as_bytes()).unwrap() else { panic!("not points") };
    assert_eq!(points.exact_position(2), DVec3::new(5_000_002.75, 3.0, -3.0));
    assert_eq!(points.position[0], Vec3::new(-1.25, -1.0, 1.0));
    assert_eq!(points.color[0], [0.5, 0.25, 1.0]);
    assert_eq!(points.normal, [Vec3::ZERO, Vec3::Y, Vec3::new(0.6, 0.8, 0.0)]);
    assert_eq!(points.value, [7.0, 8.0, 9.5]);
    points.validate().unwrap();
}

#[test]
fn ba18_points_that_are_no_numbers_are_named_or_dropped_and_counted() {
    let text = POINTS.replace("5000001.5 2", "nan inf");
    let error = load("p.ply", text.as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with("p.ply:16:1: expected a finite number, found 'nan'"), "{error}");
    let limits = ReadParams { drop_invalid: true, ..ReadParams::default() };
    let Loaded::Points(points) = bytes("p.ply", text.as_bytes(), &limits, None).unwrap().0 else {
        panic!("not points")
    };
    assert_eq!((points.len(), points.dropped, points.value.as_slice()), (2, 1, &[7.0, 9.5][..]));
    assert_eq!(points.exact_position(1).x, 5_000_002.75);
}

#[test]
fn ba20_no_points_and_no_faces_are_accepted() {
    let text = "ply\nformat ascii 1.0\nelement vertex 0\nproperty float x\nproperty float y\nproperty float z\n\
        element face 0\nproperty list uchar int vertex_indices\nend_header\n";
    let Loaded::Points(points) = load("p.ply", text.as_bytes()).unwrap() else { panic!("not points") };
    assert!(points.is_empty());
}

#[test]
fn ba21_a_zero_normal_in_a_mesh_leaves_all_normals_to_be_computed() {
    let text = ply_ascii().replacen("0 0 2 255", "0 0 0 255", 1);
    assert!(mesh("a.ply", text.as_bytes()).normal.is_empty());
}

#[test]
fn faces_may_stand_before_vertices_and_have_any_index_type() {
    let text = "ply\nformat ascii 1.0\nelement face 1\nproperty list int uchar vertex_index\nelement vertex 3\n\
        property float z\nproperty float x\nproperty float y\nend_header\n3 2 1 0\n0 1 2\n3 4 5\n6 7 8";
    let mesh = mesh("a.ply", text.as_bytes());
    assert_eq!(mesh.triangles, [[2, 1, 0]]);
    assert_eq!(mesh.position[1], Vec3::new(4.0, 5.0, 3.0));
}
