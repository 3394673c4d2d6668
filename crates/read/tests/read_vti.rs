//! VTK image data in XML: which array is read, where it lies, and what is wrong in a file.
#![cfg(feature = "vti")]

use crate::read_samples::load;
use crate::read_samples::volumes::{values, vti};
use read::{Fault, Loaded, Notes, ReadParams, bytes};
use splat_core::Grid;
use splat_core::glam::DVec3;

fn read(content: &[u8]) -> (Grid, Notes) {
    match bytes("a.vti", content, &ReadParams::default(), None).unwrap_or_else(|e| panic!("{e}")) {
        (Loaded::Grid(grid), notes) => (grid, notes),
        other => panic!("not a grid: {other:?}"),
    }
}

/// The file in text with pieces in the place of others.
fn with(pieces: &[(&str, &str)]) -> Vec<u8> {
    let mut text = String::from_utf8(vti("ascii", false)).unwrap();
    for (from, to) in pieces {
        assert!(text.contains(from), "{from}");
        text = text.replace(from, to);
    }
    text.into_bytes()
}

#[track_caller]
fn refused(content: &[u8], expected: &str) {
    let error = load("a.vti", content).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().contains(expected), "{error}");
}

#[test]
fn the_active_array_is_read_else_the_first_and_others_are_named() {
    let (grid, notes) = read(&vti("raw", true));
    assert_eq!((grid.values, notes.unused), (values(), vec!["mask".to_owned()]));
    let (grid, notes) = read(&with(&[(" Scalars=\"density\"", "")]));
    assert_eq!((grid.values, notes.unused), (vec![7.0; 12], vec!["density".to_owned()]));
    let (grid, notes) = read(&with(&[("Scalars=\"density\"", "Scalars=\"other\"")]));
    assert_eq!(grid.values, [7.0; 12]);
    assert_eq!(notes.remarks[0], "there is no array 'other', which Scalars names: another is read");
    let said = "the array mask is drawn; `array` of a scene or --color-by chooses another: density";
    assert_eq!(notes.remarks[1..], [said]);
    let more =
        "</PointData>\n<CellData><DataArray type=\"Int8\" Name=\"c\" format=\"ascii\">1 2</DataArray></CellData>";
    let (_, notes) = read(&with(&[("</PointData>", more)]));
    assert_eq!(notes.unused, ["mask", "CellData.c"]);
}

#[test]
fn values_of_cells_lie_at_their_middles_and_are_said_to() {
    let content = with(&[("PointData", "CellData"), ("0 2 0 1 0 1", "5 8 -1 1 2 4")]);
    let (grid, notes) = read(&content);
    assert_eq!((grid.dims, &grid.values), ([3, 2, 2], &values()));
    assert_eq!(notes.remarks[1..], ["values of cells (density): they lie at the middles"]);
    // Indices 5.5, −0.5 and 2.5 of steps (0, 3, 0), (−2, 0, 0) and (0, 0, 4).
    assert_eq!(grid.origin, DVec3::new(10.0 + 1.0, 20.0 + 16.5, -30.0 + 10.0));
    // An image of one slice has cells in its plane.
    let (flat, _) = read(&with(&[("PointData", "CellData"), ("0 2 0 1 0 1", "0 6 0 2 1 1")]));
    assert_eq!((flat.dims, flat.origin.z), ([6, 2, 1], -30.0 + 4.0));
}

#[test]
fn an_extent_that_does_not_begin_at_zero_moves_the_origin() {
    let (grid, _) = read(&with(&[("0 2 0 1 0 1", "1 3 2 3 -1 0")]));
    assert_eq!(grid.origin, DVec3::new(10.0 - 4.0, 20.0 + 3.0, -30.0 - 4.0));
}

#[test]
fn what_is_wrong_in_a_file_is_named() {
    for (from, to, expected) in [
        ("\"ImageData\"", "\"PolyData\"", "expected an element PolyData, found 'none'"),
        ("LittleEndian", "MiddleEndian", "expected byte_order LittleEndian or BigEndian"),
        ("UInt32", "UInt16", "expected header_type UInt32 or UInt64"),
        (
            "header_type",
            "compressor=\"vtkLZ4DataCompressor\" header_type",
            "the compressor vtkZLibDataCompressor, found 'vtkLZ4DataCompressor'",
        ),
        ("header_type", "compressor=\"vtkLZMADataCompressor\" header_type", "found 'vtkLZMADataCompressor'"),
        ("WholeExtent=\"0 2", "WholeExtent=\"0 -1", "expected six rising indices in WholeExtent"),
        ("WholeExtent=\"0 2", "WholeExtent=\"0 1", "expected a Piece within the WholeExtent, found '0 2 0 1 0 1'"),
        ("0 2 0 1 0 1", "0 2 0 1 0 2", "expected 18 voxels, found 12"),
        ("0 2 0 1 0 1", "0 2 0 1 0 0", "expected the end of the voxels, found '2'"),
        ("0 2 0 1 0 1", "-2147483648 2147483647 0 2147483647 0 1", "expected at most 2^45 voxels"),
        ("0 2 0 1 0 1", "0 29999 0 29999 0 29999", "expected 27000000000000 voxels, found 12"),
        ("Spacing=\"3", "Spacing=\"0", "expected three independent finite steps"),
        ("Spacing=\"3", "Spacing=\"nan", "expected 3 finite numbers of Spacing"),
        ("Origin=\"10", "Origin=\"1e999", "expected 3 finite numbers of Origin"),
        ("Direction=\"0 -1", "Direction=\"0 0", "expected three independent finite steps"),
        ("<Piece", "<Piece Extent=\"\"/><Piece", "expected one Piece, found '2'"),
        ("PointData", "NoData", "expected a DataArray in PointData or CellData"),
        ("Float32", "String", "expected a DataArray of a type from Int8 to Float64, found 'String'"),
        (
            "format=\"ascii\"",
            "format=\"appended\" offset=\"0\"",
            "expected an element AppendedData at the end of the file",
        ),
        ("format=\"ascii\"", "format=\"octal\"", "expected format ascii, binary or appended"),
        ("-1 -0.5", "-1 inf", "expected a finite decimal number, found 'inf'"),
        ("-1 -0.5", "-1 1e39", "expected a value that fits a 32-bit float"),
        ("<?xml version=\"1.0\"?>", "<!DOCTYPE a [<!ENTITY b \"c\">]>", "expected XML"),
    ] {
        refused(&with(&[(from, to)]), expected);
    }
}

/// Sizes before an array are held against the lattice and the file before memory is taken.
#[test]
fn sizes_that_lie_take_no_memory() {
    let replaced = |content: Vec<u8>, from: &[u8], to: &[u8]| {
        let at = content.windows(from.len()).rposition(|w| w == from).unwrap();
        [&content[..at], to, &content[at + from.len()..]].concat()
    };
    let plain = replaced(vti("raw", false), &48u32.to_le_bytes(), &u32::MAX.to_le_bytes());
    refused(&plain, "expected 48 bytes of values, found 4294967295");
    let sizes = |blocks: u32, size: u32, last: u32| [blocks, size, last].map(u32::to_le_bytes).concat();
    for (blocks, size, last, expected) in [
        (u32::MAX, 20, 8, "expected 17179869192 bytes of an array"),
        (3, u32::MAX, 8, "expected 48 bytes of values, found 3 blocks of 4294967295 bytes, the last of 8"),
        (3, 20, u32::MAX, "expected 48 bytes of values"),
        (0, 20, 8, "expected 48 bytes of values, found 0 blocks"),
        (3, 16, 0, "expected block 0 to be one zlib stream of 16 bytes"),
    ] {
        refused(&replaced(vti("raw", true), &sizes(3, 20, 8), &sizes(blocks, size, last)), expected);
    }
}

#[test]
fn hostile_xml_is_refused_without_a_deep_stack_or_much_memory() {
    let deep = format!("<VTKFile>{}", "<a>".repeat(1 << 20));
    refused(deep.as_bytes(), "expected XML");
    let many = format!("<VTKFile>{}</VTKFile>", "<a/>".repeat(200_000));
    refused(many.as_bytes(), "expected XML");
    // The parser takes hours for these: it holds each against all others.
    let spaces: String = (0..9000).map(|i| format!("<a xmlns:n{i}=\"{i}\">")).collect();
    refused(format!("<VTKFile>{spaces}").as_bytes(), "expected at most 64 declarations of namespaces, found more");
    let attributes: String = (0..1 << 20).map(|i| format!(" n{i}=\"{i}\"")).collect();
    refused(format!("<VTKFile{attributes}>").as_bytes(), "expected at most 64 attributes of an element, found more");
    // Neither counts where it is no markup.
    let sample = String::from_utf8(vti("ascii", false)).unwrap();
    let noise = "a=b xmlns:c=d ".repeat(99);
    let noisy = sample.replace("<PointData", &format!("<!-- {noise} --><PointData note=\"{noise}\""));
    assert_eq!(load("a.vti", noisy.as_bytes()).unwrap(), load("a.vti", sample.as_bytes()).unwrap());
}
