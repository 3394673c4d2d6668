//! Series of volumes and volumes of colours: which frame is read, and what becomes of several numbers a voxel.
#![cfg(all(feature = "nifti", feature = "vti", feature = "vtk"))]

use crate::read_samples::volumes::{metaimage_header, raw, vti, vtk};
use crate::read_samples::{NIFTI_U8, gzip, nifti, ply_ascii};
use read::{Loaded, Notes, ReadError, ReadParams, bytes};
use splat_core::Grid;

fn read(name: &str, content: &[u8], frame: u64) -> Result<(Grid, Notes), ReadError> {
    match bytes(name, content, &ReadParams { frame, ..ReadParams::default() }, None)? {
        (Loaded::Grid(grid), notes) => Ok((grid, notes)),
        other => panic!("not a grid: {other:?}"),
    }
}

fn remarks(notes: &Notes) -> Vec<&str> {
    notes.remarks.iter().map(String::as_str).filter(|r| !r.starts_with("space: ")).collect()
}

/// Three frames of 2 x 1 x 1 voxels: 0 1, 10 11, 20 21; side by side where they are `mingled`.
fn frames(mingled: bool) -> Vec<u8> {
    if mingled { vec![0, 10, 20, 1, 11, 21] } else { vec![0, 1, 10, 11, 20, 21] }
}

/// A NIfTI file of these sizes, with a type and without scaling.
fn nifti_of(dims: [i16; 8], (code, bits): (i16, i16), data: &[u8]) -> Vec<u8> {
    let mut content = nifti(NIFTI_U8, false);
    content.truncate(352);
    dims.iter().enumerate().for_each(|(i, d)| content[40 + 2 * i..42 + 2 * i].copy_from_slice(&d.to_le_bytes()));
    content[70..72].copy_from_slice(&code.to_le_bytes());
    content[72..74].copy_from_slice(&bits.to_le_bytes());
    content[112..116].fill(0);
    [content, data.to_vec()].concat()
}

fn nrrd_of(fields: &str, data: &[u8]) -> Vec<u8> {
    [format!("NRRD0004\ntype: uchar\ndimension: 4\n{fields}\nencoding: raw\n\n").as_bytes(), data].concat()
}

fn metaimage_of(sizes: &str, data: &[u8]) -> Vec<u8> {
    let header = metaimage_header("")
        .replace("NDims = 3", "NDims = 4")
        .replace("3 2 2", sizes)
        .replace("MET_FLOAT", "MET_UCHAR")
        .replace("3 2 4", "3 2 4 1")
        .replace("-10 -20 -30", "-10 -20 -30 5")
        .replace("0 -1 0 1 0 0 0 0 1", "0 -1 0 0 1 0 0 0 0 0 1 0 0 0 0 1");
    [header.replace("CenterOfRotation = 0 0 0\n", "").into_bytes(), data.to_vec()].concat()
}

/// The fields of a series by ITK, whose fourth dimension is one of space too.
const ITK: &str = "space dimension: 4\nsizes: 2 1 1 3\nkinds: domain domain domain domain\n\
    space directions: (1,0,0,0) (0,1,0,0) (0,0,1,0) (0,0,0,2)\nspace origin: (1,2,3,4)";

/// The same series in every format that can hold one.
fn series() -> Vec<(&'static str, Vec<u8>)> {
    let directions = "(1,0,0) (0,1,0) (0,0,1)";
    vec![
        ("a.nii", nifti_of([4, 2, 1, 1, 3, 1, 1, 1], (2, 8), &frames(false))),
        ("b.nii", gzip(&nifti_of([5, 2, 1, 1, 3, 1, 1, 1], (2, 8), &frames(false)))),
        ("last.nrrd", nrrd_of("sizes: 2 1 1 3\nkinds: domain domain domain time", &frames(false))),
        ("none.nrrd", nrrd_of(&format!("sizes: 2 1 1 3\nspace directions: {directions} none"), &frames(false))),
        ("itk.nrrd", nrrd_of(ITK, &frames(false))),
        ("first.nrrd", nrrd_of("sizes: 3 2 1 1\nkinds: list domain domain domain", &frames(true))),
        ("first.nrrd", nrrd_of(&format!("sizes: 3 2 1 1\nspace directions: none {directions}"), &frames(true))),
        ("a.mha", metaimage_of("2 1 1 3", &frames(false))),
    ]
}

#[test]
fn each_frame_of_a_series_is_read_and_said_to_be_one() {
    for (name, content) in series() {
        for frame in 0..3u64 {
            let (grid, notes) = read(name, &content, frame).unwrap_or_else(|e| panic!("{e}"));
            let first = 10.0 * frame as f32;
            assert_eq!((grid.dims, grid.values), ([2, 1, 1], vec![first, first + 1.0]), "{name}");
            assert_eq!(remarks(&notes), [format!("frame {frame} of 3; `frame` chooses another")], "{name}");
        }
        let error = read(name, &content, 3).unwrap_err().to_string();
        assert!(
            error.contains("expected a `frame` from 0 to 2, as the file has 3 volumes, found `frame` 3"),
            "{error}"
        );
    }
}

/// Frames that are not read have to be there all the same.
#[test]
fn every_truncation_of_a_series_is_refused() {
    for (name, content) in series() {
        for frame in [0, 2] {
            for length in 0..content.len() {
                assert!(read(name, &content[..length], frame).is_err(), "{name} cut at {length}");
            }
            let longer = [&content[..], &[0]].concat();
            assert!(name == "b.nii" || read(name, &longer, frame).is_err(), "{name}");
        }
    }
}

#[test]
fn what_has_no_series_has_frame_0_alone() {
    for (name, content) in [
        ("a.nii", nifti(NIFTI_U8, false)),
        ("a.vti", vti("raw", true)),
        ("a.vtk", vtk(true)),
        ("a_3x2x2_float32.raw", raw(false)),
        ("a.mha", [metaimage_header("").into_bytes(), raw(false)].concat()),
    ] {
        assert!(!remarks(&read(name, &content, 0).unwrap().1).iter().any(|remark| remark.contains("frame")));
        let error = read(name, &content, 1).unwrap_err().to_string();
        assert!(error.contains("expected `frame` 0, as the file has one volume, found `frame` 1"), "{error}");
    }
    let error = read("a.ply", ply_ascii().as_bytes(), 1).unwrap_err().to_string();
    assert!(error.starts_with("a.ply: expected a series of volumes"), "{error}");
}

#[test]
fn a_series_whose_axes_are_not_told_apart_is_refused() {
    for (fields, expected) in [
        ("sizes: 2 1 1 3", "expected dimension: 3, or 4 with the first axis or the last not one of space"),
        ("sizes: 2 1 1 3\nkinds: domain domain domain domain", "expected dimension: 3, or 4 with"),
        ("sizes: 2 1 3 1\nkinds: domain domain list domain", "expected dimension: 3, or 4 with"),
        (
            "sizes: 2 1 1 3\nkinds: domain domain domain RGB-color",
            "expected components of a voxel along the first axis",
        ),
        ("sizes: 2 1 3\nkinds: domain domain list", "expected four sizes above 0"),
        ("sizes: 2 1 1 9223372036854775808\nkinds: space space space time", "expected at most 2^45 voxels"),
    ] {
        let error = read("a.nrrd", &nrrd_of(fields, &frames(false)), 0).unwrap_err().to_string();
        assert!(error.contains(expected), "{error}");
    }
    let wide = "sizes: 8388609 1 1 1\nspace directions: none (1,0,0) (0,1,0) (0,0,1)";
    let error = read("a.nrrd", &nrrd_of(wide, &frames(false)), 0).unwrap_err().to_string();
    assert!(error.contains("expected at most 8388608 bytes a voxel, found 8388609"), "{error}");
    let turned = String::from_utf8(metaimage_of("2 1 1 3", b"")).unwrap().replace("0 -1 0 0 1", "0 -1 0 1 1");
    let error = read("a.mha", &[turned.as_bytes(), &frames(false)].concat(), 0).unwrap_err().to_string();
    assert!(error.contains("expected axes of space that do not lead along the series"), "{error}");
    let five = nifti_of([5, 2, 1, 1, 1, 3, 1, 1], (2, 8), &frames(false));
    let error = read("a.nii", &five, 0).unwrap_err().to_string();
    assert!(error.starts_with("a.nii@40: expected 3D volumes of one value a voxel"), "{error}");
}

/// Red, green, blue and alpha of a voxel of a grey, and of one of a colour.
const GREY: [u8; 4] = [77, 77, 77, 9];
const COLOR: [u8; 4] = [255, 100, 50, 0];

fn colors(numbers: usize) -> Vec<u8> {
    [&GREY[..numbers], &COLOR[..numbers]].concat()
}

#[test]
fn colours_become_their_luma_and_are_said_to() {
    let luma = (0.2126 * 255.0 + 0.7152 * 100.0 + 0.0722 * 50.0) as f32;
    let ascii = |numbers| colors(numbers).iter().map(|n| format!("{n} ")).collect::<String>();
    let with_channels = |n: usize, data: Vec<u8>| {
        let header = metaimage_header(&format!("ElementNumberOfChannels = {n}\n")).replace("3 2 2", "2 1 1");
        [header.replace("MET_FLOAT", "MET_UCHAR_ARRAY").into_bytes(), data].concat()
    };
    let image = |n: usize| {
        format!(
            "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\"><ImageData WholeExtent=\"0 1 0 0 0 0\"><Piece \
             Extent=\"0 1 0 0 0 0\"><PointData><DataArray type=\"UInt8\" Name=\"rgb\" NumberOfComponents=\"{n}\" \
             format=\"ascii\">{}</DataArray></PointData></Piece></ImageData></VTKFile>",
            ascii(n)
        )
    };
    let legacy = |n: usize| {
        format!(
            "# vtk DataFile Version 3.0\n\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nPOINT_DATA 2\n\
             SCALARS rgb unsigned_char {n}\nLOOKUP_TABLE default\n{}\n",
            ascii(n)
        )
    };
    for n in [3, 4] {
        let kinds = if n == 3 { "RGB-color" } else { "RGBA-color" };
        let field = |kind: &str| format!("sizes: {n} 2 1 1\nkinds: {kind} domain domain domain");
        let kind_and_bits = if n == 3 { (128, 24) } else { (2304, 32) };
        for (name, content) in [
            ("a.nii", nifti_of([3, 2, 1, 1, 1, 1, 1, 1], kind_and_bits, &colors(n))),
            ("a.nrrd", nrrd_of(&field(kinds), &colors(n))),
            ("vector.nrrd", nrrd_of(&field("vector"), &colors(n))),
            ("a.mha", with_channels(n, colors(n))),
            ("a.vti", image(n).into_bytes()),
            ("a.vtk", legacy(n).into_bytes()),
        ] {
            let (grid, notes) = read(name, &content, 0).unwrap_or_else(|e| panic!("{e}"));
            assert_eq!(grid.values, [77.0, luma], "{name}");
            let said = "colours: read is their luma, 0.2126 R + 0.7152 G + 0.0722 B of the numbers as they are stored";
            let alpha = if n == 3 { "" } else { "; alpha is not used" };
            assert_eq!(remarks(&notes), [format!("{said}{alpha}")], "{name}");
        }
    }
}

#[test]
fn vectors_are_refused_by_what_they_are() {
    let floats: Vec<u8> = (0..3).flat_map(|v| (v as f32).to_le_bytes()).collect();
    let vector = "NRRD0004\ntype: float\ndimension: 4\nsizes: 3 1 1 1\nkinds: vector space space space\nendian: little\n\
        encoding: raw\n\n";
    let channels = metaimage_header("ElementNumberOfChannels = 3\n").replace("3 2 2", "1 1 1");
    for (name, content) in
        [("a.nrrd", [vector.as_bytes(), &floats].concat()), ("a.mha", [channels.as_bytes(), &floats].concat())]
    {
        let error = read(name, &content, 0).unwrap_err().to_string();
        assert!(error.contains("expected one number a voxel, or a colour: three or four unsigned integers"), "{error}");
        assert!(error.contains("found 3 numbers of 4 bytes a voxel"), "{error}");
    }
    let two = nrrd_of("sizes: 2 1 1 1\nkinds: 2-vector space space space", &[1, 2]);
    let error = read("a.nrrd", &two, 0).unwrap_err().to_string();
    assert!(error.contains("found 2 numbers of 1 bytes a voxel"), "{error}");
}
