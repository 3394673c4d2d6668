//! One lattice by every format of volumes: the same grid to the last bit.
#![cfg(all(feature = "nifti", feature = "vti", feature = "vtk"))]

use crate::read_samples::volumes::{Vti, metaimage, nrrd, raw, values, vtk};
use crate::read_samples::{NIFTI_F32, gzip, load, nifti};
use read::Loaded;
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};

fn grid(name: &str, content: &[u8]) -> Grid {
    match load(name, content).unwrap_or_else(|e| panic!("{e}")) {
        Loaded::Grid(grid) => grid,
        other => panic!("not a grid: {other:?}"),
    }
}

#[track_caller]
fn same(name: &str, found: &Grid, expected: &Grid) {
    let bits = |grid: &Grid| grid.values.iter().map(|v| v.to_bits()).collect::<Vec<_>>();
    assert_eq!(bits(found), bits(expected), "{name}");
    assert_eq!((found.dims, found.origin, found.axes), (expected.dims, expected.origin, expected.axes), "{name}");
    found.validate().unwrap();
}

#[test]
fn one_turned_lattice_is_the_same_grid_in_every_format() {
    let axes = DMat3::from_cols(DVec3::new(0.0, 3.0, 0.0), DVec3::new(-2.0, 0.0, 0.0), DVec3::new(0.0, 0.0, 4.0));
    let expected = Grid { origin: DVec3::new(10.0, 20.0, -30.0), axes, dims: [3, 2, 2], values: values() };
    let mut files = Vec::new();
    for big in [false, true] {
        files.push((format!("big {big}.nii"), nifti(NIFTI_F32, big)));
        for encoding in ["raw", "gzip", "text"] {
            files.push((format!("{encoding} big {big}.nrrd"), nrrd(encoding, big)));
        }
        for encoding in ["raw", "zlib", "gzip", "text"] {
            files.push((format!("{encoding} big {big}.mha"), metaimage(encoding, big)));
        }
        for encoding in ["ascii", "binary", "raw", "base64"] {
            for (wide, compressed) in [(false, false), (true, false), (false, true), (true, true)] {
                let file = Vti { encoding, big, wide, compressed };
                files.push((format!("{file:?}.vti"), file.file()));
            }
        }
    }
    for (name, content) in files {
        same(&name, &grid(&name, &content), &expected);
        let name = format!("{name}.gz");
        same(&name, &grid(&name, &gzip(&content)), &expected);
        // The content tells the format.
        same("a file", &grid("a.file", &content), &expected);
    }
}

#[test]
fn one_straight_lattice_is_the_same_grid_in_every_format() {
    let axes = DMat3::from_diagonal(DVec3::new(3.0, 2.0, 4.0));
    let expected = Grid { origin: DVec3::new(10.0, 20.0, -30.0), axes, dims: [3, 2, 2], values: values() };
    for binary in [false, true] {
        same("vtk", &grid("a.vtk", &vtk(binary)), &expected);
        same("vtk", &grid("a.gz", &gzip(&vtk(binary))), &expected);
    }
    let straight = Grid { origin: DVec3::ZERO, axes: DMat3::IDENTITY, ..expected };
    same("raw", &grid("a_3x2x2_float32.raw", &raw(false)), &straight);
    same("raw", &grid("a_3x2x2_float32.raw.gz", &gzip(&raw(false))), &straight);
}
