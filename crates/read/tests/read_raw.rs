//! Raw voxels by the name of their file.

use crate::read_samples::{gzip, load};
use read::{Fault, Loaded};

fn values(name: &str, content: &[u8]) -> Vec<f32> {
    match load(name, content).unwrap_or_else(|e| panic!("{e}")) {
        Loaded::Grid(grid) => grid.values,
        other => panic!("not a grid: {other:?}"),
    }
}

#[track_caller]
fn refused(name: &str, content: &[u8], expected: &str) {
    let error = load(name, content).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().contains(expected), "{error}");
}

#[test]
fn the_name_states_sizes_and_type() {
    assert_eq!(values("v_2x1x1_uint8.raw", &[1, 255]), [1.0, 255.0]);
    assert_eq!(values("v_2x1x1_int8.raw", &[1, 255]), [1.0, -1.0]);
    assert_eq!(values("v_2x1x1_uint16.raw", &[1, 2, 0, 128]), [513.0, 32768.0]);
    assert_eq!(values("v_2x1x1_int16.raw", &[1, 2, 0, 128]), [513.0, -32768.0]);
    assert_eq!(values("v_1x1x1_uint32.raw", &[0, 0, 0, 128]), [2147483648.0]);
    assert_eq!(values("v_1x1x1_int32.raw", &[0, 0, 0, 128]), [-2147483648.0]);
    assert_eq!(values("v_1x1x1_float32.raw", &1.5f32.to_le_bytes()), [1.5]);
    assert_eq!(values("v_1x1x1_float64.raw", &(-2.5f64).to_le_bytes()), [-2.5]);
    // Anywhere between underscores.
    for name in ["1x2x1_uint8.raw", "a_b_1x2x1_uint8_c.RAW", "a_3x3_1x2x1_uint8.old.raw"] {
        assert_eq!(values(name, &[1, 2]), [1.0, 2.0], "{name}");
    }
}

/// No byte of nothing but voxels is a mark of another format, nor of gzip.
#[test]
fn the_name_comes_before_the_content() {
    for mark in [&b"ply"[..], b"#?x", b"\x1f\x8b\x08", b"\xef\xbb\xbf"] {
        let expected: Vec<f32> = mark.iter().map(|b| f32::from(*b)).collect();
        assert_eq!(values("v_3x1x1_uint8.raw", mark), expected);
        assert_eq!(values("v_3x1x1_uint8.raw.gz", &gzip(mark)), expected);
    }
}

#[test]
fn a_name_without_sizes_is_told_which_name_or_header_to_write() {
    for name in ["a.raw", "a_2x1_uint8.raw", "a_2x1x1_int64.raw", "a_2x1x1.raw", "a_0x1x1_uint8.raw", "_.raw"] {
        refused(name, &[1, 2], "expected sizes and a type in the file's name, such as ");
        refused(name, &[1, 2], "_256x256x128_uint8.raw (or int8 … float64), found none, and 2 bytes");
        refused(name, &[1, 2], "write a text file NAME.nhdr beside it with the lines NRRD0004; type: uint8;");
    }
}

#[test]
fn the_length_is_exactly_that_of_the_name() {
    let expected = "expected 24 bytes of voxels (2 x 3 x 2 x 2 bytes), found";
    refused("a_2x3x2_int16.raw", &[0; 23], &format!("{expected} 23"));
    refused("a_2x3x2_int16.raw", &[0; 25], &format!("{expected} 25"));
    refused("a_2x3x2_int16.raw", &[], &format!("{expected} 0"));
    refused("a_2x3x2_int16.raw.gz", &gzip(&[0; 23]), &format!("{expected} 23"));
    refused("a_2x3x2_int16.raw.gz", &gzip(&[0; 25]), &format!("{expected} more than 24"));
    refused("a_30000x30000x30000_float64.raw", &[0; 8], "expected 216000000000000 bytes of voxels");
    refused("a_4294967296x4294967296x4294967296_uint8.raw", &[0; 8], "expected at most 2^45 voxels");
    refused("a_1x1x1_float32.raw", &f32::INFINITY.to_le_bytes(), "expected values that fit 32-bit floats");
}
