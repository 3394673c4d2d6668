//! Isosurfaces as meshes: closed, oriented, accurate, the same for any number of threads.

use field::{Inside, isosurface_to_mesh};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Grid, Mesh, rng};
use std::collections::HashMap;
use std::f64::consts::PI;

fn sampled(dims: [usize; 3], f: impl Fn(DVec3) -> f64) -> Grid {
    let at =
        |n: usize| DVec3::from_array([n % dims[0], n / dims[0] % dims[1], n / dims[0] / dims[1]].map(|i| i as f64));
    let values = (0..dims[0] * dims[1] * dims[2]).map(|n| f(at(n)) as f32).collect();
    Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, dims, values }
}

/// Random values inside, 0 on the faces of the lattice.
fn noise(dims: [usize; 3], seed: u64, value: impl Fn(f64) -> f64) -> Grid {
    let last = DVec3::from_array(dims.map(|n| (n - 1) as f64));
    let at = |u: DVec3| (u.z as usize * dims[1] + u.y as usize) * dims[0] + u.x as usize;
    sampled(dims, |u| {
        let inner = u.min_element() > 0.0 && (last - u).min_element() > 0.0;
        if inner { value(rng::unit(seed, 0, at(u) as u64, 0)) } else { 0.0 }
    })
}

/// Panics unless every directed edge occurs once and its opposite once.
fn assert_closed(mesh: &Mesh) {
    let mut edges: HashMap<(u32, u32), u32> = HashMap::new();
    for t in &mesh.triangles {
        assert!(t[0] != t[1] && t[1] != t[2] && t[2] != t[0]);
        (0..3).for_each(|e| *edges.entry((t[e], t[(e + 1) % 3])).or_insert(0) += 1);
    }
    for ((a, b), n) in &edges {
        assert!(*n == 1 && edges.get(&(*b, *a)) == Some(&1), "edge {a} {b}: {n} times");
    }
    let mut used = vec![false; mesh.position.len()];
    mesh.triangles.iter().flatten().for_each(|v| used[*v as usize] = true);
    assert!(used.iter().all(|u| *u), "a vertex without triangles");
}

fn area_and_volume(mesh: &Mesh) -> (f64, f64) {
    mesh.triangles.iter().fold((0.0, 0.0), |(area, volume), t| {
        let [a, b, c] = t.map(|v| mesh.position[v as usize].as_dvec3());
        (area + 0.5 * (b - a).cross(c - a).length(), volume + a.dot(b.cross(c)) / 6.0)
    })
}

#[test]
fn noise_with_every_case_is_closed_and_oriented() {
    for (dims, seed) in [([40, 33, 21], 1), ([70, 9, 8], 2), ([3, 3, 3], 3), ([130, 4, 5], 4)] {
        let grid = noise(dims, seed, |u| u);
        let mesh = isosurface_to_mesh(&grid, 0.5, Inside::Above).unwrap();
        mesh.validate().unwrap();
        assert_closed(&mesh);
        let other = isosurface_to_mesh(&grid, 0.5, Inside::Below).unwrap();
        assert_eq!(mesh.position, other.position);
        assert!(mesh.normal.iter().zip(&other.normal).all(|(a, b)| *a == -*b && a.is_normalized()));
        assert!(area_and_volume(&mesh).1 > 0.0 && area_and_volume(&other).1 < 0.0);
    }
}

#[test]
fn all_256_cells_give_what_their_corners_say() {
    for case in 0..256usize {
        let corner = |u: DVec3| case >> (u.x as usize + 2 * u.y as usize + 4 * u.z as usize) & 1;
        let inner = |u: DVec3| u.cmpge(DVec3::ONE).all() && u.cmple(DVec3::splat(2.0)).all();
        let grid = sampled([4; 3], |u| if inner(u) { corner(u - 1.0) as f64 } else { 0.0 });
        let mesh = isosurface_to_mesh(&grid, 0.25, Inside::Above).unwrap();
        assert_closed(&mesh);
        let crossed: usize = (0..64)
            .flat_map(|n| (0..3).map(move |a| (n, a)))
            .filter(|(n, a)| {
                let step = [1, 4, 16][*a];
                n / step % 4 < 3 && (grid.values[*n] > 0.0) != (grid.values[n + step] > 0.0)
            })
            .count();
        assert_eq!(mesh.position.len(), crossed, "case {case}");
        assert!((area_and_volume(&mesh).1 > 0.0) == (case > 0));
    }
}

#[test]
fn a_ball_has_area_and_volume_up_to_h_squared() {
    let errors: Vec<[f64; 2]> = [17usize, 33, 65]
        .iter()
        .map(|n| {
            let h = 2.4 / (*n - 1) as f64;
            let mut grid = sampled([*n; 3], |u| (u * h - 1.2).length_squared());
            grid.axes *= h;
            grid.origin = DVec3::splat(-1.2);
            let mesh = isosurface_to_mesh(&grid, 1.0, Inside::Below).unwrap();
            assert_closed(&mesh);
            assert_eq!(mesh.position.len() - mesh.triangles.len() / 2, 2, "Euler");
            for (p, normal) in mesh.position.iter().zip(&mesh.normal) {
                let p = p.as_dvec3() + mesh.origin;
                assert!((p.length() - 1.0).abs() < 0.3 * h * h && normal.as_dvec3().dot(p.normalize()) > 1.0 - h * h);
            }
            let (area, volume) = area_and_volume(&mesh);
            [1.0 - area / (4.0 * PI), 1.0 - volume / (4.0 / 3.0 * PI)]
        })
        .collect();
    println!("{errors:?}");
    for e in 0..2 {
        let ratios = [errors[0][e] / errors[1][e], errors[1][e] / errors[2][e]];
        assert!(ratios.iter().all(|r| *r > 3.4 && *r < 4.6) && errors[2][e].abs() < 2e-3, "{ratios:?} {errors:?}");
    }
}

#[test]
fn planes_have_exact_normals_on_sheared_and_mirrored_lattices() {
    let slope = DVec3::new(0.3, -0.7, 0.5);
    for mirror in [1.0, -1.0] {
        let axes = DMat3::from_cols(
            DVec3::new(0.5 * mirror, 0.25, 0.0),
            DVec3::new(-0.25, 1.0, 0.5),
            DVec3::new(0.1, 0.0, 0.75),
        );
        let origin = DVec3::new(1e7, -1e7, 3e7);
        let mut grid = sampled([9, 8, 7], |u| (axes * u).dot(slope));
        (grid.axes, grid.origin) = (axes, origin);
        let mesh = isosurface_to_mesh(&grid, 0.4, Inside::Below).unwrap();
        assert!(mesh.triangles.len() > 40);
        for (p, n) in mesh.position.iter().zip(&mesh.normal) {
            let local = p.as_dvec3() + (mesh.origin - origin);
            assert!((local.dot(slope) - 0.4).abs() < 1e-5 && n.as_dvec3().dot(slope.normalize()) > 1.0 - 1e-6);
        }
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| mesh.position[v as usize].as_dvec3());
            assert!((b - a).cross(c - a).dot(slope) > -1e-9, "a triangle faces inwards");
        }
    }
}

#[test]
fn threads_change_nothing() {
    let grid = noise([50, 40, 60], 7, |u| u);
    let build = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| isosurface_to_mesh(&grid, 0.6, Inside::Above).unwrap())
    };
    let one = build(1);
    assert!([2, 3, 16].iter().all(|t| build(*t) == one));
}

#[test]
fn scaling_by_two_scales_exactly() {
    let grid = noise([12, 11, 10], 8, |u| u);
    let mut large = grid.clone();
    (large.axes, large.origin) = (grid.axes * 1024.0, grid.origin * 1024.0);
    large.values.iter_mut().for_each(|v| *v *= 8.0);
    let a = isosurface_to_mesh(&grid, 0.5, Inside::Above).unwrap();
    let b = isosurface_to_mesh(&large, 4.0, Inside::Above).unwrap();
    assert!(a.position.iter().zip(&b.position).all(|(p, q)| *p * 1024.0 == *q));
    assert!(a.normal == b.normal && a.triangles == b.triangles);
}

/// Values 0, 1 and 2 with the isovalue 1: vertices coincide with lattice points, triangles without area remain, and the
/// mesh stays closed.
#[test]
fn values_equal_to_the_isovalue_keep_the_mesh_closed() {
    let grid = noise([14, 13, 12], 9, |u| (3.0 * u).floor());
    assert!(grid.values.iter().filter(|v| **v == 1.0).count() > 300);
    for inside in [Inside::Above, Inside::Below] {
        let mesh = isosurface_to_mesh(&grid, 1.0, inside).unwrap();
        assert_closed(&mesh);
        assert!(mesh.position.iter().all(|p| p.is_finite()) && mesh.normal.iter().all(|n| n.is_normalized()));
    }
    // A flat step meets the isovalue on a whole layer: no triangle is lost or doubled.
    let flat = isosurface_to_mesh(&sampled([6, 6, 6], |u| u.z), 3.0, Inside::Below).unwrap();
    assert_eq!((flat.position.len(), flat.triangles.len()), (36, 50));
    assert!((area_and_volume(&flat).0 - 25.0).abs() < 1e-6);
}

#[test]
fn isovalues_between_two_f32_values_are_exact() {
    let next = 1.0f32.next_up();
    let grid = sampled([2, 2, 2], |u| if u.z > 0.0 { f64::from(next) } else { 1.0 });
    let between = 0.5 * (1.0 + f64::from(next));
    assert_eq!(isosurface_to_mesh(&grid, between, Inside::Below).unwrap().triangles.len(), 2);
    assert_eq!(isosurface_to_mesh(&grid, 1.0, Inside::Below).unwrap().triangles.len(), 0);
}

#[test]
fn empty_thin_and_broken_volumes() {
    let constant = |dims: [usize; 3]| sampled(dims, |_| 1.0);
    for (grid, isovalue) in [
        (constant([5, 4, 3]), 2.0),
        (constant([5, 4, 3]), 1e300),
        (constant([5, 4, 3]), -1e300),
        (sampled([9, 9, 1], |u| u.x), 3.5),
        (sampled([1, 1, 1], |u| u.x), 0.0),
    ] {
        let mesh = isosurface_to_mesh(&grid, isovalue, Inside::Above).unwrap();
        assert!(mesh.position.is_empty() && mesh.triangles.is_empty() && mesh.origin.is_finite());
    }
    let mut broken = constant([70, 4, 3]);
    broken.values[69] = f32::NAN;
    let error = isosurface_to_mesh(&broken, 0.5, Inside::Above).unwrap_err().to_string();
    assert!(error.contains("voxel 69"), "{error}");
    assert!(isosurface_to_mesh(&constant([3; 3]), f64::NAN, Inside::Above).is_err());
    assert!(isosurface_to_mesh(&Grid { dims: [2; 3], ..constant([3; 3]) }, 0.5, Inside::Above).is_err());
    assert!(isosurface_to_mesh(&Grid { axes: DMat3::ZERO, ..constant([3; 3]) }, 0.5, Inside::Above).is_err());
    assert!(
        isosurface_to_mesh(&Grid { dims: [0; 3], values: Vec::new(), ..constant([3; 3]) }, 0.5, Inside::Above).is_err()
    );
}
