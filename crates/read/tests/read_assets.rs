//! The real inputs that come with the repository.
#![cfg(all(feature = "ply", feature = "nifti", feature = "las"))]

use read::{Loaded, ReadParams, file};
use splat_core::glam::DVec3;
use splat_core::{Aabb, Mesh};
use std::path::{Path, PathBuf};

fn path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../assets").join(name)
}

fn load(name: &str) -> Loaded {
    file(&path(name), &ReadParams::default(), None).map(|read| read.0).unwrap_or_else(|e| panic!("{e}"))
}

fn mesh(name: &str) -> Mesh {
    match load(name) {
        Loaded::Mesh(mesh) => mesh,
        _ => panic!("{name} is no mesh"),
    }
}

/// Vertices and triangles as another reader finds them.
fn by_other_reader(name: &str) -> (Vec<[f32; 3]>, Vec<[u32; 3]>) {
    use ply_rs_bw::{parser::Parser, ply::DefaultElement, ply::Property};
    let source = std::fs::File::open(path(name)).unwrap();
    let mut source = flate2::read::GzDecoder::new(source);
    let ply = Parser::<DefaultElement>::new().read_ply(&mut source).unwrap();
    let number = |e: &DefaultElement, k: &str| match e[k] {
        Property::Float(v) => v,
        ref other => panic!("{other:?}"),
    };
    let corner = |e: &DefaultElement| match &e["vertex_indices"] {
        Property::ListInt(v) => [v[0] as u32, v[1] as u32, v[2] as u32],
        other => panic!("{other:?}"),
    };
    let vertices = ply.payload["vertex"].iter().map(|e| [number(e, "x"), number(e, "y"), number(e, "z")]).collect();
    (vertices, ply.payload["face"].iter().map(corner).collect())
}

#[test]
fn meshes_agree_with_another_reader() {
    let files = [
        ("stanford-bunny/bunny.ply.gz", 50_000, 99_785),
        ("stanford-dragon/dragon_res3.ply.gz", 22_998, 47_794),
        ("stanford-dragon/dragon_res4.ply.gz", 5_205, 11_102),
    ];
    for (name, vertices, faces) in files {
        let mesh = mesh(name);
        assert_eq!((mesh.position.len(), mesh.triangles.len()), (vertices, faces), "{name}");
        mesh.validate().unwrap();
        assert_eq!(mesh.origin, DVec3::ZERO);
        let (position, triangles) = by_other_reader(name);
        assert_eq!(mesh.position.iter().map(|p| p.to_array()).collect::<Vec<_>>(), position, "{name}");
        assert_eq!(mesh.triangles, triangles, "{name}");
    }
}

#[test]
fn mni152_has_its_size_and_its_brain_in_the_middle() {
    let Loaded::Grid(grid) = load("mni152/mni152_t1.nii.gz") else { panic!("not a grid") };
    grid.validate().unwrap();
    assert_eq!(grid.dims, [197, 233, 189]);
    assert!((grid.cell_volume() - 1.0).abs() < 1e-9);
    assert_eq!(grid.position(0, 0, 0), DVec3::new(-98.0, -134.0, -72.0));
    assert_eq!(grid.at_clamped(0, 0, 0), 0.0);
    // The origin of the template's coordinates lies inside the brain.
    assert!(grid.at_clamped(98, 134, 72) > 0.0);
}

#[test]
fn autzen_has_its_points_their_colours_and_exact_integers() {
    let Loaded::Points(points) = load("autzen/autzen_trim.laz") else { panic!("not points") };
    points.validate().unwrap();
    assert_eq!((points.len(), points.color.len(), points.value.len()), (110_000, 110_000, 110_000));
    let lattice = points.lattice.as_ref().unwrap();
    assert_eq!(lattice.scale, DVec3::splat(0.01));
    let bounds = Aabb::of_points(&points.position);
    let extent = bounds.max - bounds.min;
    for (found, expected) in extent.to_array().into_iter().zip([1177.0, 563.0, 114.0]) {
        assert!((found - expected).abs() < 1.0, "{extent}");
    }
    assert!(points.value.iter().all(|v| (0.0..=254.0).contains(v)));
    assert!(points.classification.iter().all(|c| [1, 2].contains(c)));
    let mean = points.color.iter().map(|c| f64::from(c[1])).sum::<f64>() / 110_000.0;
    assert!((0.02..0.9).contains(&mean), "mean green {mean}");
    assert!((points.exact_position(0) - (points.origin + points.position[0].as_dvec3())).length() < 1e-3);
}
