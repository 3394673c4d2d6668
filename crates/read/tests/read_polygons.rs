//! Faces of more than three corners: concave ones, collinear corners, holes by bridges, far away, scaled, crossing.
#![cfg(feature = "ply")]

use read::{Loaded, ReadParams};
use splat_core::Mesh;
use splat_core::glam::{DQuat, DVec3};

const L_SHAPE: &[[f64; 2]] = &[[0.0, 0.0], [3.0, 0.0], [3.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]];
/// Its first corner is the reflex one, so a fan around it happens to be right; around the others it is not.
const ARROW: &[[f64; 2]] = &[[1.0, 0.0], [-2.0, -3.0], [4.0, 0.0], [-2.0, 3.0]];
const STAR: &[[f64; 2]] = &[
    [0.0, 4.0],
    [-1.0, 1.5],
    [-4.0, 1.25],
    [-1.75, -0.5],
    [-2.5, -3.5],
    [0.0, -1.75],
    [2.5, -3.5],
    [1.75, -0.5],
    [4.0, 1.25],
    [1.0, 1.5],
];
/// A square with the middles of its sides.
const COLLINEAR: &[[f64; 2]] =
    &[[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [2.0, 1.0], [2.0, 2.0], [1.0, 2.0], [0.0, 2.0], [0.0, 1.0]];
/// A square with a square hole, joined by an edge that is run through twice.
const KEYHOLE: &[[f64; 2]] = &[
    [0.0, 0.0],
    [4.0, 0.0],
    [4.0, 4.0],
    [0.0, 4.0],
    [0.0, 0.0],
    [1.0, 1.0],
    [1.0, 3.0],
    [3.0, 3.0],
    [3.0, 1.0],
    [1.0, 1.0],
];

fn area(corners: &[[f64; 2]]) -> f64 {
    let n = corners.len();
    (0..n).map(|i| (corners[i], corners[(i + 1) % n])).map(|(a, b)| 0.5 * (a[0] * b[1] - a[1] * b[0])).sum()
}

/// A PLY file of one polygon, between two triangles that stay as they are.
fn ply(corners: &[DVec3]) -> String {
    let n = corners.len();
    let mut text = format!(
        "ply\nformat ascii 1.0\nelement vertex {}\nproperty double x\nproperty double y\nproperty double z\n\
         element face 3\nproperty list int int vertex_indices\nend_header\n",
        n + 3
    );
    let base = corners[0];
    for p in corners.iter().copied().chain([base, base + DVec3::X, base + DVec3::Y]) {
        text += &format!("{:e} {:e} {:e}\n", p.x, p.y, p.z);
    }
    let last = format!("3 {} {} {}\n", n, n + 1, n + 2);
    let ids: Vec<String> = (0..n).map(|i| i.to_string()).collect();
    text + &last + &format!("{n} {}\n", ids.join(" ")) + &last
}

fn read(text: &str) -> Result<Mesh, String> {
    match read::bytes("p.ply", text.as_bytes(), &ReadParams::default(), None).map_err(|e| e.to_string())?.0 {
        Loaded::Mesh(mesh) => Ok(mesh),
        _ => Err("no mesh".into()),
    }
}

/// The polygon's triangles cover it once: signed areas sum to its area, none is negative.
fn covered(corners: &[DVec3], normal: DVec3, expected: f64) -> Vec<[u32; 3]> {
    let mesh = read(&ply(corners)).unwrap();
    let n = corners.len() as u32;
    let first = mesh.triangles[0];
    let last = mesh.triangles[mesh.triangles.len() - 1];
    assert_eq!((first, last), ([n, n + 1, n + 2], [n, n + 1, n + 2]));
    let triangles = mesh.triangles[1..mesh.triangles.len() - 1].to_vec();
    let at = |i: u32| corners[i as usize];
    let areas = triangles.iter().map(|t| 0.5 * (at(t[1]) - at(t[0])).cross(at(t[2]) - at(t[0])).dot(normal));
    assert!(areas.clone().all(|a| a > 0.0), "{triangles:?} {:?}", areas.collect::<Vec<_>>());
    let sum: f64 = areas.sum();
    assert!((sum / expected - 1.0).abs() < 1e-6, "{sum} {expected}");
    assert!(triangles.len() <= corners.len() - 2);
    triangles
}

fn flat(corners: &[[f64; 2]], place: impl Fn(DVec3) -> DVec3) -> Vec<DVec3> {
    corners.iter().map(|c| place(DVec3::new(c[0], c[1], 0.0))).collect()
}

#[test]
fn concave_polygons_are_covered_once_in_any_plane_and_from_any_corner() {
    for shape in [L_SHAPE, ARROW, STAR, COLLINEAR, KEYHOLE] {
        for turn in
            [DQuat::IDENTITY, DQuat::from_rotation_x(1.0), DQuat::from_euler(Default::default(), 2.0, 0.7, -1.0)]
        {
            for first in 0..shape.len() {
                // The keyhole begins anywhere too: its bridge is closed by the last edge.
                let mut rotated = shape.to_vec();
                rotated.rotate_left(first);
                covered(&flat(&rotated, |p| turn * p), turn * DVec3::Z, area(shape));
                let mut backwards = rotated.clone();
                backwards.reverse();
                covered(&flat(&backwards, |p| turn * p), turn * DVec3::NEG_Z, area(shape));
            }
        }
    }
}

#[test]
fn convex_polygons_stay_fans() {
    let triangles = covered(&flat(&[[0.0, 0.0], [2.0, 0.0], [3.0, 1.0], [1.0, 2.0]], |p| p), DVec3::Z, 3.5);
    assert_eq!(triangles, [[0, 1, 2], [0, 2, 3]]);
}

#[test]
fn far_away_and_at_any_scale_the_triangles_are_the_same() {
    for shape in [L_SHAPE, STAR, COLLINEAR, KEYHOLE] {
        let here = covered(&flat(shape, |p| p), DVec3::Z, area(shape));
        let far = DVec3::new(1e7, -1e7, 1e7);
        assert_eq!(covered(&flat(shape, |p| p + far), DVec3::Z, area(shape)), here);
        for exponent in [-40, 40] {
            let scale = f64::from(exponent).exp2();
            let text = ply(&flat(shape, |p| p * scale));
            let mesh = read(&text).unwrap();
            assert_eq!(mesh.triangles[1..mesh.triangles.len() - 1], here);
        }
    }
}

#[test]
fn polygons_without_area_become_triangles_without_area() {
    for shape in [vec![[1.0, 2.0]; 5], vec![[0.0, 0.0], [1.0, 1.0], [2.0, 2.0], [3.0, 3.0]]] {
        let mesh = read(&ply(&flat(&shape, |p| p))).unwrap();
        assert_eq!(mesh.triangles.len(), shape.len());
    }
    // A spike out of a square and back: the square remains.
    let spike = [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [5.0, 1.0], [2.0, 1.0], [2.0, 2.0], [0.0, 2.0]];
    covered(&flat(&spike, |p| p), DVec3::Z, 4.0);
}

/// Corners of polygons that were quadratic: a comb whose teeth are far longer than they are apart, and one whose edges run
/// askew to the triangles that its corners alone would have. With the area of each.
fn long_polygons(n: usize) -> [(Vec<[f64; 2]>, f64); 2] {
    let teeth = n / 2;
    let step = 1.0 / teeth as f64;
    let top = (0..teeth).map(|i| [i as f64 * step, if i % 2 == 1 { 1.0 } else { 0.125 }]);
    let base = (0..teeth).rev().map(|i| [i as f64 * step, 0.0]);
    let comb: Vec<[f64; 2]> = top.chain(base).collect();
    let teeth = n / 2 - 1;
    let tooth = |i: usize| [[0.0, i as f64], [1.0e3, (i + teeth / 2) as f64]];
    let rim = [[-1.0, teeth as f64], [-1.0, 0.0]];
    let zigzag: Vec<[f64; 2]> = (0..teeth).flat_map(tooth).chain(rim).collect();
    [comb, zigzag].map(|p| (p.clone(), area(&p).abs()))
}

/// Ends within the patience of whoever runs it, as its work is near-linear: corner by corner it took minutes.
#[test]
fn a_face_of_twenty_thousand_corners_is_covered_once() {
    for (corners, expected) in long_polygons(20_000) {
        let text = ply(&flat(&corners, |p| p));
        let Loaded::Mesh(mesh) = read::bytes("p.ply", text.as_bytes(), &ReadParams::default(), None).unwrap().0 else {
            panic!()
        };
        let at = |i: u32| mesh.position[i as usize].as_dvec3().truncate();
        let face = &mesh.triangles[1..mesh.triangles.len() - 1];
        assert_eq!(face.len(), corners.len() - 2);
        let sum: f64 =
            face.iter().map(|t| 0.5 * (at(t[1]) - at(t[0])).perp_dot(at(t[2]) - at(t[0]))).map(f64::abs).sum();
        assert!((sum / expected - 1.0).abs() < 1e-4, "{sum} {expected}");
    }
}
