//! The scanned bunny: its splats cover it once.

use convert::{Density, MeshParams, mesh_to_points, reference};
use read::{Loaded, ReadParams};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, Footprint, Mesh, optics, rng};
use std::collections::HashMap;
use std::path::Path;

fn bunny() -> Mesh {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets/stanford-bunny/bunny.ply.gz");
    match read::file(&path, &ReadParams::default(), None).unwrap().0 {
        Loaded::Mesh(mesh) => mesh,
        other => panic!("not a mesh: {other:?}"),
    }
}

/// Points spread evenly over the area, with the normals of their triangles.
fn on_the_surface(mesh: &Mesh, count: u64) -> Vec<(DVec3, DVec3)> {
    let corner = |t: &[u32; 3]| t.map(|v| mesh.position[v as usize].as_dvec3());
    let cross = |v: [DVec3; 3]| (v[1] - v[0]).cross(v[2] - v[0]);
    let mut sum = 0.0;
    let until: Vec<f64> = mesh
        .triangles
        .iter()
        .map(|t| {
            sum += cross(corner(t)).length();
            sum
        })
        .collect();
    let point = |i: u64| {
        let u = |k| rng::unit(17, 0, i, k);
        let v = corner(&mesh.triangles[until.partition_point(|s| *s < u(0) * sum).min(until.len() - 1)]);
        let a = 1.0 - u(1).sqrt();
        let b = u(2) * u(1).sqrt();
        (v[0] * a + v[1] * b + v[2] * (1.0 - a - b), cross(v).normalize())
    };
    (0..count).map(point).collect()
}

/// Weight of the layer at each point, by a table of cells as wide as a kernel.
fn weights(cloud: &Cloud, tau: f64, points: &[(DVec3, DVec3)]) -> Vec<f64> {
    let width = 2.0 * cloud.radius[0];
    let cell = |p: Vec3| (p / width).floor().as_ivec3();
    let mut table: HashMap<_, Vec<u32>> = HashMap::new();
    (0..cloud.len()).for_each(|i| table.entry(cell(cloud.position[i])).or_default().push(i as u32));
    let weight = |&(p, n): &(DVec3, DVec3)| {
        let c = cell(p.as_vec3());
        let near: Vec<u32> = (0..27)
            .filter_map(|k| table.get(&(c + splat_core::glam::IVec3::new(k % 3 - 1, k / 3 % 3 - 1, k / 9 - 1))))
            .flatten()
            .copied()
            .collect();
        reference::layer_depth(&cloud.gather(&near), Footprint::default(), p, n) / tau
    };
    points.iter().map(weight).collect()
}

/// Mean weight and the 5 % and 95 % quantiles at about this many splats.
fn coverage(mesh: &Mesh, splats: u64) -> (f64, f64, f64) {
    let params = MeshParams { density: Density::Splats(splats), opacity: 0.5, ..MeshParams::default() };
    let (cloud, report) = mesh_to_points(mesh, &params, None).unwrap();
    cloud.validate().unwrap();
    let tau = optics::optical_depth(0.5);
    let sum: f64 = cloud.cross_section.iter().map(|k| f64::from(*k)).sum();
    assert!((sum / (tau * report.area) - 1.0).abs() < 1e-6);
    let mut weights = weights(&cloud, tau, &on_the_surface(mesh, 4000));
    weights.sort_by(f64::total_cmp);
    (weights.iter().sum::<f64>() / 4000.0, weights[200], weights[3800])
}

/// Discs lie in tangent planes, so on a curved surface a ray meets its neighbours' planes a little further out: the
/// mean weight is 1 − O(R²κ²), which falls with the square of the spacing.
#[test]
fn the_bunny_is_covered_once_by_its_splats() {
    let mesh = bunny();
    let coarse = coverage(&mesh, 300_000);
    let fine = coverage(&mesh, 1_200_000);
    println!("coarse {coarse:?} fine {fine:?}");
    assert!((coarse.0 - 1.0).abs() < 5e-3 && (fine.0 - 1.0).abs() < 1e-3);
    assert!((coarse.0 - 1.0).abs() > 2.5 * (fine.0 - 1.0).abs());
    for (_, low, high) in [coarse, fine] {
        assert!(low > 0.96 && high < 1.04, "{low} {high}");
    }
}
