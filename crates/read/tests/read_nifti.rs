//! NIfTI volumes: every voxel type, both byte orders, the three affine methods, scaling.
#![cfg(feature = "nifti")]

use crate::read_samples::{Dtype, NIFTI_F32, NIFTI_U8, gzip, load, nifti};
use read::Loaded;
use splat_core::Grid;
use splat_core::glam::{DMat3, DVec3};

fn grid(content: &[u8]) -> Grid {
    match load("v.nii", content).unwrap() {
        Loaded::Grid(grid) => grid,
        other => panic!("not a grid: {other:?}"),
    }
}

#[test]
fn every_scalar_type_and_byte_order_gives_the_same_scaled_values() {
    let types: [Dtype; 10] = [
        NIFTI_U8,
        NIFTI_F32,
        (4, 16, |v| (v as i16).to_le_bytes().to_vec()),
        (8, 32, |v| (v as i32).to_le_bytes().to_vec()),
        (64, 64, |v| v.to_le_bytes().to_vec()),
        (256, 8, |v| (v as i8).to_le_bytes().to_vec()),
        (512, 16, |v| (v as u16).to_le_bytes().to_vec()),
        (768, 32, |v| (v as u32).to_le_bytes().to_vec()),
        (1024, 64, |v| (v as i64).to_le_bytes().to_vec()),
        (1280, 64, |v| (v as u64).to_le_bytes().to_vec()),
    ];
    let expected: Vec<f32> = (0..12).map(|v| v as f32 * 0.5 - 1.0).collect();
    for dtype in types {
        for big in [false, true] {
            let g = grid(&nifti(dtype, big));
            assert_eq!((g.dims, &g.values), ([3, 2, 2], &expected), "type {} big {big}", dtype.0);
            g.validate().unwrap();
        }
    }
    assert_eq!(grid(&gzip(&nifti(NIFTI_U8, false))).values, expected);
}

#[test]
fn sform_then_qform_then_voxel_size() {
    let mut content = nifti(NIFTI_U8, false);
    let g = grid(&content);
    // Rows (0, −2, 0, 10), (3, 0, 0, 20), (0, 0, 4, −30).
    assert_eq!(g.position(1, 1, 1), DVec3::new(10.0 - 2.0, 20.0 + 3.0, -30.0 + 4.0));

    // A quarter turn around z with pixdim (2, 3, 4), mirrored third axis, offset (1, 2, 3).
    content[254..256].copy_from_slice(&0i16.to_le_bytes());
    content[252..254].copy_from_slice(&1i16.to_le_bytes());
    content[76..80].copy_from_slice(&(-1f32).to_le_bytes());
    content[264..268].copy_from_slice(&std::f32::consts::FRAC_1_SQRT_2.to_le_bytes());
    for (i, v) in [1f32, 2.0, 3.0].iter().enumerate() {
        content[268 + 4 * i..272 + 4 * i].copy_from_slice(&v.to_le_bytes());
    }
    let g = grid(&content);
    let expected = DVec3::new(1.0 - 3.0, 2.0 + 2.0, 3.0 - 4.0);
    assert!(g.position(1, 1, 1).distance(expected) < 1e-6, "{}", g.position(1, 1, 1));

    content[252..254].copy_from_slice(&0i16.to_le_bytes());
    let g = grid(&content);
    assert_eq!((g.origin, g.axes), (DVec3::ZERO, DMat3::from_diagonal(DVec3::new(2.0, 3.0, 4.0))));
}

#[test]
fn slope_zero_or_nan_means_no_scaling() {
    for slope in [0f32, f32::NAN] {
        let mut content = nifti(NIFTI_U8, false);
        content[112..116].copy_from_slice(&slope.to_le_bytes());
        assert_eq!(grid(&content).values[11], 11.0);
    }
}

#[test]
fn a_fourth_dimension_of_one_is_accepted_and_of_two_is_held_against_the_file() {
    let mut content = nifti(NIFTI_U8, false);
    content[40..42].copy_from_slice(&4i16.to_le_bytes());
    assert_eq!(grid(&content).dims, [3, 2, 2]);
    content[44..46].copy_from_slice(&1i16.to_le_bytes());
    content[48..50].copy_from_slice(&2i16.to_le_bytes());
    assert_eq!((grid(&content).dims, grid(&content).values.len()), ([3, 1, 2], 6));
    content[48..50].copy_from_slice(&3i16.to_le_bytes());
    let error = load("v.nii", &content).unwrap_err().to_string();
    assert!(
        error.starts_with("v.nii@352: expected 18 bytes of voxels (3 x 1 x 2 x 3 frames x 1 bytes), found 12"),
        "{error}"
    );
}

/// The volume of [`nifti`] of bytes as NIfTI-2.
fn nifti_2(big: bool) -> Vec<u8> {
    let mut out = vec![0u8; 544];
    let mut put = |at: usize, le: &[u8]| {
        let bytes: Vec<u8> = if big { le.iter().rev().copied().collect() } else { le.to_vec() };
        out[at..at + bytes.len()].copy_from_slice(&bytes);
    };
    put(0, &540i32.to_le_bytes());
    put(12, &2i16.to_le_bytes());
    put(14, &8i16.to_le_bytes());
    [3i64, 3, 2, 2, 1, 1, 1, 1].iter().enumerate().for_each(|(i, n)| put(16 + 8 * i, &n.to_le_bytes()));
    [1.0f64, 2.0, 3.0, 4.0].iter().enumerate().for_each(|(i, s)| put(104 + 8 * i, &s.to_le_bytes()));
    put(168, &544i64.to_le_bytes());
    put(176, &0.5f64.to_le_bytes());
    put(184, &(-1f64).to_le_bytes());
    put(348, &1i32.to_le_bytes());
    let rows = [0.0f64, -2.0, 0.0, 10.0, 3.0, 0.0, 0.0, 20.0, 0.0, 0.0, 4.0, -30.0];
    rows.iter().enumerate().for_each(|(i, v)| put(400 + 8 * i, &v.to_le_bytes()));
    out[4..12].copy_from_slice(b"n+2\0\r\n\x1a\n");
    out.extend(0..12);
    out
}

#[test]
fn nifti_2_holds_the_same_volume() {
    let expected = grid(&nifti(NIFTI_U8, false));
    for big in [false, true] {
        let mut content = nifti_2(big);
        assert_eq!(grid(&content), expected, "big {big}");
        // The rotation, the place and the voxel size where there is no matrix.
        let bytes = |value: f64| if big { value.to_be_bytes() } else { value.to_le_bytes() };
        content[348..352].fill(0);
        assert_eq!(grid(&content).axes, DMat3::from_diagonal(DVec3::new(2.0, 3.0, 4.0)));
        content[344..348].copy_from_slice(&if big { 1i32.to_be_bytes() } else { 1i32.to_le_bytes() });
        for (at, value) in [(104, -1.0), (368, std::f64::consts::FRAC_1_SQRT_2), (376, 1.0), (384, 2.0), (392, 3.0)] {
            content[at..at + 8].copy_from_slice(&bytes(value));
        }
        let turned = DVec3::new(1.0 - 3.0, 2.0 + 2.0, 3.0 - 4.0);
        assert!(grid(&content).position(1, 1, 1).distance(turned) < 1e-6, "{}", grid(&content).position(1, 1, 1));
    }
    assert_eq!(grid(&gzip(&nifti_2(false))), expected);
}

#[test]
fn what_is_wrong_in_nifti_2_is_named() {
    let with = |at: usize, bytes: &[u8]| {
        let mut content = nifti_2(false);
        content[at..at + bytes.len()].copy_from_slice(bytes);
        content
    };
    for (content, expected) in [
        (with(24, &(1i64 << 60).to_le_bytes()), "v.nii@16: expected dimensions from 1 to 2147483647"),
        (with(24, &[[255, 255, 255, 127, 0, 0, 0, 0]; 3].concat()), "v.nii@16: expected at most 2^45 voxels"),
        (with(16, &(-3i64).to_le_bytes()), "v.nii@16: expected a volume of 3 dimensions"),
        (with(12, &4i16.to_le_bytes()), "v.nii@544: expected 24 bytes of voxels (3 x 2 x 2 x 2 bytes), found 12"),
        (with(12, &32i16.to_le_bytes()), "v.nii@12: expected a datatype of real scalars or colours"),
        (with(168, &(1i64 << 60).to_le_bytes()), "v.nii@168: expected an offset of the voxels from 540"),
        (with(168, &100i64.to_le_bytes()), "v.nii@168: expected an offset of the voxels from 540"),
        (with(176, &f64::INFINITY.to_le_bytes()), "v.nii@176: expected a finite slope and intercept"),
        (with(408, &0f64.to_le_bytes()), "v.nii@344: expected three independent finite steps"),
        (with(4, b"ni2"), "v.nii@4: expected 'n+2', header and voxels in one file"),
        (nifti_2(false)[..500].to_vec(), "v.nii@0: expected a header of 540 bytes, found 500 bytes"),
    ] {
        let error = load("v.nii", &content).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{error}");
    }
    let whole = nifti_2(true);
    assert!((0..whole.len()).all(|length| load("v.nii", &whole[..length]).is_err()));
}
