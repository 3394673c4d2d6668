//! Lids against closed forms: volumes by the divergence theorem, areas of sections, closed edges.

use super::*;
use splat_core::DAabb;
use std::f64::consts::{PI, TAU};

fn above(normal: DVec3, offset: f64) -> Clip {
    Clip::HalfSpace { normal, offset }
}

fn cut_open(mesh: &Mesh, clips: &[Clip]) -> (Mesh, LidReport) {
    let cut = lidded_mesh(mesh.clone().into(), clips);
    (Arc::unwrap_or_clone(cut.mesh), cut.report)
}

/// A torus about the axis z, of radii 2 and 0.5.
fn torus(at: DVec3) -> Mesh {
    let n = 96;
    let m = 48;
    let place = |vertex: usize| {
        let around = TAU * (vertex / m) as f64 / n as f64;
        let across = TAU * (vertex % m) as f64 / m as f64;
        let r = 2.0 + 0.5 * libm::cos(across);
        DVec3::new(r * libm::cos(around), r * libm::sin(around), 0.5 * libm::sin(across)).as_vec3()
    };
    let v = |i: usize, k: usize| (i % n * m + k % m) as u32;
    let squares = (0..n).flat_map(|i| (0..m).map(move |k| (i, k)));
    let triangles =
        squares.flat_map(|(i, k)| [[v(i, k), v(i + 1, k), v(i + 1, k + 1)], [v(i, k), v(i + 1, k + 1), v(i, k + 1)]]);
    Mesh { origin: at, position: (0..n * m).map(place).collect(), triangles: triangles.collect(), ..Mesh::default() }
}

/// A cube, its faces outwards.
fn cube(low: Vec3, side: f32) -> Mesh {
    let position =
        (0..8).map(|i| low + side * Vec3::new((i & 1) as f32, (i >> 1 & 1) as f32, (i >> 2) as f32)).collect();
    let faces = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
    let triangles = faces.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
    Mesh { position, triangles, ..Mesh::default() }
}

/// Several meshes as one.
fn joined(meshes: &[Mesh]) -> Mesh {
    let mut whole = Mesh::default();
    for mesh in meshes {
        let first = whole.position.len() as u32;
        whole.position.extend(&mesh.position);
        whole.triangles.extend(mesh.triangles.iter().map(|t| t.map(|v| first + v)));
    }
    whole
}

/// The volume by the divergence theorem, and whether each edge, by the bits of its places, is run through as often each way.
fn volume_and_closed(mesh: &Mesh) -> (f64, bool) {
    let at = |v: u32| mesh.position[v as usize].as_dvec3();
    let middle = mesh.position.first().map_or(DVec3::ZERO, |p| p.as_dvec3());
    let volume = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|v| at(v) - middle);
        a.dot(b.cross(c)) / 6.0
    };
    let bits = |v: u32| (mesh.position[v as usize] + Vec3::ZERO).to_array().map(f32::to_bits);
    let mut edges = BTreeMap::new();
    for t in &mesh.triangles {
        for k in 0..3 {
            let a = bits(t[k]);
            let b = bits(t[(k + 1) % 3]);
            *edges.entry(if a < b { (a, b) } else { (b, a) }).or_insert(0i64) += if a < b { 1 } else { -1 };
        }
    }
    // An edge without a length runs nowhere.
    (mesh.triangles.iter().map(volume).sum(), edges.iter().all(|((a, b), times)| a == b || *times == 0))
}

#[test]
fn a_cut_cube_has_the_volume_of_its_part_and_a_lid_of_its_section() {
    let cube = cube(Vec3::ZERO, 1.0);
    assert!((volume_and_closed(&cube).0 - 1.0).abs() < 1e-12 && volume_and_closed(&cube).1);
    for (normal, offset, expected, section) in [
        (DVec3::Y, 0.25, 0.25, 1.0),
        (-DVec3::Z, -0.75, 0.25, 1.0),
        // Through four edges, through two of the cube's edges, off a corner, and through three corners.
        (DVec3::new(1.0, 1.0, 0.0), 0.5, 0.125, 0.5 * 2f64.sqrt()),
        (DVec3::new(1.0, -1.0, 0.0), 0.0, 0.5, 2f64.sqrt()),
        (DVec3::ONE, 0.5, 0.125 / 6.0, 0.125 * 3f64.sqrt()),
        (DVec3::ONE, 1.0, 1.0 / 6.0, 0.5 * 3f64.sqrt()),
        // The regular hexagon through six middles of edges.
        (DVec3::ONE, 1.5, 0.5, 0.75 * 3f64.sqrt()),
    ] {
        let (part, report) = cut_open(&cube, &[above(normal, offset)]);
        let (volume, is_closed) = volume_and_closed(&part);
        assert!((volume - expected).abs() < 1e-6 && is_closed, "{normal} {offset}: {volume} {is_closed}");
        let unit = normal.normalize().as_vec3();
        let is_lid = |t: &&[u32; 3]| t.iter().all(|v| part.normal[*v as usize] == unit);
        let lid = Mesh { triangles: part.triangles.iter().filter(is_lid).copied().collect(), ..part.clone() };
        assert!((lid.area() - section).abs() < 1e-6, "{normal} {offset}: {}", lid.area());
        assert_eq!((lid.triangles.len() as u64, report.open), (report.triangles, 0));
        assert!(part.validate().is_ok());
    }
}

#[test]
fn planes_of_faces_leave_all_or_nothing() {
    let unit = cube(Vec3::ZERO, 1.0);
    let (all, report) = cut_open(&unit, &[above(DVec3::Y, 1.0)]);
    assert_eq!((all.triangles.len(), report), (12, LidReport::default()));
    let (none, report) = cut_open(&unit, &[above(DVec3::Y, 0.0)]);
    assert_eq!((none.triangles.len(), report), (0, LidReport::default()));
    // A step: half of the plane is a face of the body.
    let step = joined(&[unit, cube(Vec3::X, 2.0)]);
    let (part, report) = cut_open(&step, &[above(DVec3::Y, 1.0)]);
    let (volume, is_closed) = volume_and_closed(&part);
    assert!((volume - 5.0).abs() < 1e-6 && is_closed && report.open == 0, "{volume} {is_closed} {report:?}");
}

#[test]
fn both_sides_of_a_plane_make_the_whole_and_a_box_beside_a_body_nothing() {
    let torus = torus(DVec3::ZERO);
    let normal = DVec3::new(0.48, 0.6, 0.64);
    let whole = volume_and_closed(&torus).0;
    assert!((whole / (2.0 * PI * PI * 2.0 * 0.25) - 1.0).abs() < 5e-3, "{whole}");
    for height in [-0.7, 0.0, 0.31] {
        let sides = [(normal, height), (-normal, -height)].map(|(n, h)| cut_open(&torus, &[above(n, h)]).0);
        let [(a, a_closed), (b, b_closed)] = sides.each_ref().map(volume_and_closed);
        assert!((a + b - whole).abs() < 1e-5 * whole && a_closed && b_closed, "{height}: {a} + {b} for {whole}");
    }
    let hole = Clip::Box(DAabb::new(DVec3::splat(-0.5), DVec3::splat(0.5)));
    let (none, report) = cut_open(&torus, &[hole]);
    assert_eq!((none.triangles.len(), report.open), (0, 0));
}

#[test]
fn the_volume_of_a_cap_is_that_of_its_height() {
    let n = 128;
    let mut position = vec![Vec3::Z, -Vec3::Z];
    let mut triangles = Vec::new();
    let v = |i: usize, k: usize| (2 + (i - 1) * n + k % n) as u32;
    for i in 1..n {
        let theta = PI * i as f64 / n as f64;
        position.extend((0..n).map(|k| {
            let phi = TAU * k as f64 / n as f64;
            DVec3::new(libm::sin(theta) * libm::cos(phi), libm::sin(theta) * libm::sin(phi), libm::cos(theta)).as_vec3()
        }));
    }
    for k in 0..n {
        triangles.extend([[0, v(1, k), v(1, k + 1)], [1, v(n - 1, k + 1), v(n - 1, k)]]);
        let side = |i: usize| [[v(i, k), v(i + 1, k), v(i + 1, k + 1)], [v(i, k), v(i + 1, k + 1), v(i, k + 1)]];
        triangles.extend((1..n - 1).flat_map(side));
    }
    let ball = Mesh { position, triangles, ..Mesh::default() };
    for (normal, height) in [(DVec3::Z, 0.4), (DVec3::new(0.36, 0.48, 0.8), 1.3), (-DVec3::X, 1.0)] {
        let (cap, report) = cut_open(&ball, &[above(normal, height - 1.0)]);
        let (volume, is_closed) = volume_and_closed(&cap);
        let expected = PI * height * height * (3.0 - height) / 3.0;
        assert!((volume / expected - 1.0).abs() < 3e-3 && is_closed, "{normal} {height}: {volume} for {expected}");
        assert!(report.triangles > 100 && report.open == 0);
    }
}

#[test]
fn a_torus_has_two_lids_or_a_ring() {
    let torus = torus(DVec3::ZERO);
    let area = |mesh: &Mesh, normal: Vec3| {
        let is_lid = |t: &&[u32; 3]| t.iter().all(|v| mesh.normal[*v as usize] == normal);
        Mesh { triangles: mesh.triangles.iter().filter(is_lid).copied().collect(), ..mesh.clone() }.area()
    };
    let (half, _) = cut_open(&torus, &[above(DVec3::X, 0.0)]);
    assert!((area(&half, Vec3::X) / (2.0 * PI * 0.25) - 1.0).abs() < 5e-3, "{}", area(&half, Vec3::X));
    let (below, _) = cut_open(&torus, &[above(DVec3::Z, 0.0)]);
    let ring = PI * (2.5f64.powi(2) - 1.5f64.powi(2));
    assert!((area(&below, Vec3::Z) / ring - 1.0).abs() < 5e-3, "{}", area(&below, Vec3::Z));
    assert!(volume_and_closed(&half).1 && volume_and_closed(&below).1);
}

#[test]
fn a_shift_a_power_of_two_and_triangles_that_share_nothing_change_no_bit_of_a_place() {
    let normal = DVec3::new(0.0, 0.8, 0.6);
    let at = DVec3::new(0.0, 1e7, -1e7);
    let clip = |at: DVec3, scale: f64| above(normal, normal.dot(at) + 0.125 * scale);
    let (near, _) = cut_open(&torus(DVec3::ZERO), &[clip(DVec3::ZERO, 1.0)]);
    let (far, _) = cut_open(&torus(at), &[clip(at, 1.0)]);
    // The offset of the plane is rounded there, to 1e-9.
    assert!(near.position.iter().zip(&far.position).all(|(a, b)| a.distance(*b) < 1e-6));
    assert_eq!(near.triangles.len(), far.triangles.len());
    assert!(volume_and_closed(&far).1);
    let mut large = torus(DVec3::ZERO);
    large.position.iter_mut().for_each(|p| *p *= 1024.0);
    let (large, _) = cut_open(&large, &[clip(DVec3::ZERO, 1024.0)]);
    assert_eq!(large.position, near.position.iter().map(|p| *p * 1024.0).collect::<Vec<_>>());
    assert_eq!(large.triangles, near.triangles);
    let torus = torus(DVec3::ZERO);
    let apart = Mesh {
        position: torus.triangles.iter().flatten().map(|v| torus.position[*v as usize]).collect(),
        triangles: (0..torus.triangles.len() as u32).map(|t| [3 * t, 3 * t + 1, 3 * t + 2]).collect(),
        ..Mesh::default()
    };
    let (apart, report) = cut_open(&apart, &[clip(DVec3::ZERO, 1.0)]);
    assert!(volume_and_closed(&apart).1 && report.open == 0);
    assert_eq!(volume_and_closed(&apart).0, volume_and_closed(&near).0);
}

#[test]
fn an_open_outline_has_no_lid_and_is_counted_and_a_closed_one_beside_it_has_one() {
    let mut open = cube(Vec3::ZERO, 1.0);
    // The plane x = 0.5 crosses the face that is gone.
    open.triangles.drain(..2);
    let (part, report) = cut_open(&open, &[above(DVec3::X, 0.5)]);
    assert_eq!((report.triangles, report.open), (0, 1));
    assert!(report.said().eq(["`clip` leaves 1 outline of it without a lid: the mesh is open there"]));
    let both = joined(&[open.clone(), cube(Vec3::Y * 3.0, 1.0)]);
    let (_, report) = cut_open(&both, &[above(DVec3::X, 0.5)]);
    // Eight corners: those of the square, and one on the diagonal of each face.
    assert_eq!((report.triangles, report.open), (6, 1));
    // Where it is whole it is closed.
    let (cut, report) = cut_open(&open, &[above(DVec3::Z, 0.5)]);
    assert_eq!((report.triangles > 0, report.open), (true, 0));
    assert!(part.triangles.len() < open.triangles.len() + 8 && !cut.triangles.is_empty());
}

#[test]
fn a_pinhole_of_a_scan_is_bridged_and_told() {
    let whole = torus(DVec3::ZERO);
    let mut scan = whole.clone();
    // The first triangle lies at x = 2.5, from y = 0 upwards.
    scan.triangles.remove(0);
    let clip = above(DVec3::new(0.0, 1.0, 0.1), 0.02);
    let [(closed, _), (bridged, report)] = [&whole, &scan].map(|mesh| cut_open(mesh, &[clip]));
    assert_eq!((report.open, report.bridged), (0, 1));
    assert!(report.said().eq(["lids of `clip` bridge 1 small gap of the mesh"]));
    let [all, part] = [closed, bridged].map(|mesh| volume_and_closed(&mesh).0);
    assert!((part / all - 1.0).abs() < 1e-3, "{part} for {all}");
}

#[test]
fn a_cavity_is_a_hole_and_where_bodies_overlap_the_lid_is_there_once() {
    let section = |mesh: &Mesh| {
        let (part, report) = cut_open(mesh, &[above(DVec3::Y, 0.4)]);
        let is_lid = |t: &&[u32; 3]| t.iter().all(|v| part.normal[*v as usize] == Vec3::Y);
        let lid = Mesh { triangles: part.triangles.iter().filter(is_lid).copied().collect(), ..part.clone() };
        assert_eq!(report.open, 0);
        lid.area()
    };
    let mut wall = cube(Vec3::splat(0.25), 0.5);
    let shell = |wall: &Mesh| section(&joined(&[cube(Vec3::ZERO, 1.0), wall.clone()]));
    // Wound like the body around it, it is a body within a body.
    assert!((shell(&wall) - 1.0).abs() < 1e-6, "{}", shell(&wall));
    wall.triangles.iter_mut().for_each(|t| t.swap(1, 2));
    assert!((shell(&wall) - 0.75).abs() < 1e-6, "{}", shell(&wall));
    let overlap = joined(&[cube(Vec3::ZERO, 1.0), cube(Vec3::new(0.5, 0.1, 0.5), 1.0)]);
    assert!((section(&overlap) - 1.75).abs() < 1e-6, "{}", section(&overlap));
    // Triangles that disagree on the outside: what an odd number of outlines surrounds.
    let mut torn = joined(&[cube(Vec3::ZERO, 1.0), cube(Vec3::new(0.25, 0.25, 0.25), 0.5)]);
    torn.triangles[8].swap(1, 2);
    torn.triangles[9].swap(1, 2);
    assert!((section(&torn) - 0.75).abs() < 1e-6, "{}", section(&torn));
}

#[test]
fn lids_have_the_colours_of_their_rims_and_a_second_cut_goes_through_them() {
    let mut cube = cube(Vec3::ZERO, 1.0);
    cube.color = cube.position.iter().map(|p| p.to_array()).collect();
    let clips = [above(DVec3::Y, 0.5), above(DVec3::ONE, 1.0), Clip::Box(DAabb::new(DVec3::splat(0.1), DVec3::ONE))];
    let (part, report) = cut_open(&cube, &clips);
    for (p, color) in part.position.iter().zip(&part.color) {
        assert!(p.distance(Vec3::from_array(*color)) < 1e-6, "{p} {color:?}");
    }
    // The corner of a cube of a side of 0.7, less what lies above 0.4 of it.
    let (volume, is_closed) = volume_and_closed(&part);
    let expected = (0.7f64.powi(3) - 0.3f64.powi(3)) / 6.0;
    assert!((volume - expected).abs() < 1e-6 && is_closed, "{volume} for {expected}: {report:?}");
}
