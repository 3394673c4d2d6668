//! One head in one world, whichever way its file points: NRRD and NIfTI.

use crate::read_samples::{NIFTI_F32, load, nifti};
use convert::{VolumeParams, volume_to_points};
use read::{Loaded, ReadParams, bytes};
use splat_core::glam::{DMat3, DVec3};
use splat_core::{Grid, TransferFunction, TransferPoint};

fn grid(name: &str, content: &[u8]) -> Grid {
    match load(name, content).unwrap() {
        Loaded::Grid(grid) => grid,
        other => panic!("not a grid: {other:?}"),
    }
}

/// The volume of [`nifti`] as NRRD in a space whose x and y axes point with these signs.
fn nrrd(space: &str, x: f64, y: f64) -> Vec<u8> {
    let header = format!(
        "NRRD0004\ntype: float\ndimension: 3\n{space}\nsizes: 3 2 2\nspace directions: (0,{},0) ({},0,0) (0,0,4)\n\
         space origin: ({},{},-30)\nendian: little\nencoding: raw\n\n",
        3.0 * y,
        -2.0 * x,
        10.0 * x,
        20.0 * y
    );
    let values = (0..12).flat_map(|v| (v as f32 * 0.5 - 1.0).to_le_bytes());
    header.bytes().chain(values).collect()
}

#[test]
fn one_head_lies_in_one_place_whichever_space_its_file_has() {
    let expected = grid("a.nii", &nifti(NIFTI_F32, false));
    let cloud = |grid: &Grid| {
        let point = |value, extinction| TransferPoint { value, color: [0.5, value.abs() / 5.0, 1.0], extinction };
        let transfer = TransferFunction::new(vec![point(-1.0, 0.0), point(4.5, 2.0)]).unwrap();
        volume_to_points(grid, &transfer, &VolumeParams { normals: true, ..VolumeParams::default() }, None).unwrap().0
    };
    for (space, x, y) in [
        ("space: right-anterior-superior", 1.0, 1.0),
        ("space: RAS", 1.0, 1.0),
        ("space: left-posterior-superior", -1.0, -1.0),
        ("space: LPS", -1.0, -1.0),
        ("space: left-anterior-superior", -1.0, 1.0),
        ("space: las", -1.0, 1.0),
        ("space: scanner-xyz", 1.0, 1.0),
        ("space: 3D-right-handed", 1.0, 1.0),
        ("space dimension: 3", 1.0, 1.0),
    ] {
        let found = grid("a.nrrd", &nrrd(space, x, y));
        assert_eq!(found, expected, "{space}");
        assert_eq!(cloud(&found), cloud(&expected), "{space}");
    }
}

#[test]
fn what_was_converted_is_said() {
    let remarks =
        |space: &str, x, y| bytes("a.nrrd", &nrrd(space, x, y), &ReadParams::default(), None).unwrap().1.remarks;
    let said = "space: left-posterior-superior, converted to right-anterior-superior";
    assert_eq!(remarks("space: LPS", -1.0, -1.0), [said]);
    assert!(remarks("space: RAS", 1.0, 1.0).is_empty());
    assert!(remarks("space dimension: 3", 1.0, 1.0).is_empty());
    let error = load("a.nrrd", &nrrd("space: left-superior", 1.0, 1.0)).unwrap_err().to_string();
    assert!(error.starts_with("a.nrrd:4: expected a space of three dimensions"), "{error}");
}

/// Spacings do not say how the lattice lies in the space.
#[test]
fn spacings_alone_stay_as_they_are() {
    let text = "NRRD0004\ntype: uchar\ndimension: 3\nspace: LPS\nsizes: 1 1 1\nspacings: 1 2 3\nencoding: raw\n\nx";
    let found = grid("a.nrrd", text.as_bytes());
    assert_eq!((found.origin, found.axes), (DVec3::ZERO, DMat3::from_diagonal(DVec3::new(1.0, 2.0, 3.0))));
}

/// One axis of 10^10 beside others of 1 had every voxel split into a million.
#[test]
fn steps_out_of_all_proportion_are_refused() {
    let mut content = nifti(NIFTI_F32, false);
    content[254..256].copy_from_slice(&0i16.to_le_bytes());
    content[88..92].copy_from_slice(&1e10f32.to_le_bytes());
    let error = load("a.nii", &content).unwrap_err().to_string();
    assert!(error.starts_with("a.nii@252: expected steps of which none is more than 1000 times another"), "{error}");
    assert!(error.contains("found steps of 2, 3 and 10000000000"), "{error}");
    let text = "NRRD0004\ntype: uchar\ndimension: 3\nsizes: 1 1 1\nspacings: 1 1001 1\nencoding: raw\n\nx";
    let error = load("a.nrrd", text.as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with("a.nrrd:5: expected steps of which none"), "{error}");
    grid("a.nrrd", text.replace("1001", "1000").as_bytes());
    // However small or large all of them are.
    grid("a.nrrd", text.replace("1 1001 1", "1e-15 1e-15 2e-15").as_bytes());
}
