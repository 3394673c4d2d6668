//! Legacy VTK files of structured points: which array is read, and what is wrong in a file.
#![cfg(feature = "vtk")]

use crate::read_samples::load;
use crate::read_samples::volumes::{raw, values, vtk};
use read::{Fault, Loaded, Notes, ReadParams, bytes};
use splat_core::Grid;
use splat_core::glam::DVec3;

fn read(content: &[u8]) -> (Grid, Notes) {
    match bytes("a.vtk", content, &ReadParams::default(), None).unwrap_or_else(|e| panic!("{e}")) {
        (Loaded::Grid(grid), notes) => (grid, notes),
        other => panic!("not a grid: {other:?}"),
    }
}

fn with(from: &str, to: &str) -> Vec<u8> {
    let text = String::from_utf8(vtk(false)).unwrap();
    assert!(text.contains(from), "{from}");
    text.replacen(from, to, 1).into_bytes()
}

#[track_caller]
fn refused(content: &[u8], expected: &str) {
    let error = load("a.vtk", content).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().contains(expected), "{error}");
}

#[test]
fn scalars_come_before_fields_and_points_before_cells() {
    let (grid, notes) = read(&vtk(true));
    assert_eq!((grid.values, notes.unused), (values(), vec!["mask".to_owned()]));
    let normals = format!("NORMALS n float\n{}", "1 0 ".repeat(12));
    let (grid, notes) = read(&with("SCALARS density float 1\nLOOKUP_TABLE default\n", &normals));
    assert_eq!((grid.values, notes.unused), (vec![7.0; 12], vec!["n".to_owned()]));
}

/// Old files leave out the table, new ones have blocks that say nothing of the values.
#[test]
fn the_dialects_of_several_versions_are_read() {
    let expected = read(&vtk(false)).0;
    for (from, to) in [
        ("LOOKUP_TABLE default\n", ""),
        ("float 1\n", "float\n"),
        ("SPACING", "ASPECT_RATIO"),
        ("POINT_DATA", "METADATA\nINFORMATION 1\nNAME a LOCATION b\nDATA 1\n\nPOINT_DATA"),
        (
            "POINT_DATA",
            "FIELD FieldData 2\nTime 1 1 double\n0.5\nMETADATA\nCOMPONENT_NAMES\na\n\nN 2 1 int\n1 2\nPOINT_DATA",
        ),
        (
            "SCALARS",
            "LOOKUP_TABLE colours 2\n0 0 0 1 1 1 1 1\nVECTORS v double\n1 2 3 4 5 6 7 8 9 10 11 12 13 14 15 16 17 18 \
          19 20 21 22 23 24 25 26 27 28 29 30 31 32 33 34 35 36\nSCALARS",
        ),
        ("\n", "\r\n"),
    ] {
        assert_eq!(read(&with(from, to)).0, expected, "{to}");
    }
}

/// VTK writes bytes so: in a text as shares of 255.
#[test]
fn scalars_of_bytes_are_whole_numbers_in_text_too() {
    let head = |encoding: &str, numbers: usize| {
        format!(
            "# vtk DataFile Version 5.1\nbytes\n{encoding}\nDATASET STRUCTURED_POINTS\nDIMENSIONS 3 1 1\n\
             POINT_DATA 3\nCOLOR_SCALARS bytes {numbers}\n"
        )
    };
    let binary = [head("BINARY", 1).as_bytes(), &[0, 77, 254]].concat();
    assert_eq!(read(&binary).0.values, [0.0, 77.0, 254.0]);
    assert_eq!(read((head("ASCII", 1) + "0 0.301961 0.996078\n").as_bytes()).0.values, [0.0, 77.0, 254.0]);
    let colors = [head("BINARY", 3).as_bytes(), &[0, 0, 0, 77, 77, 77, 255, 255, 255]].concat();
    assert_eq!(read(&colors).0.values, [0.0, 77.0, 255.0]);
}

#[test]
fn values_of_cells_lie_at_their_middles() {
    let content = String::from_utf8(vtk(false)).unwrap();
    let content = content.replace("3 2 2", "4 3 3").replace("POINT_DATA", "CELL_DATA");
    let (grid, notes) = read(content.as_bytes());
    assert_eq!((grid.dims, grid.origin), ([3, 2, 2], DVec3::new(11.5, 21.0, -28.0)));
    assert_eq!(notes.remarks[1..], ["values of cells (density): they lie at the middles"]);
}

#[test]
fn what_is_wrong_in_a_file_is_named() {
    for (from, to, expected) in [
        (
            "STRUCTURED_POINTS",
            "UNSTRUCTURED_GRID",
            "a.vtk:5: expected SCALARS, FIELD or another keyword of this dataset",
        ),
        ("STRUCTURED_POINTS", "RECTILINEAR_GRID", "expected X_COORDINATES, found the end of the file"),
        ("STRUCTURED_POINTS", "STRUCTURED_GRID", "expected POINTS, found the end of the file"),
        (
            "STRUCTURED_POINTS",
            "FIELD",
            "a.vtk:4: expected DATASET STRUCTURED_POINTS, RECTILINEAR_GRID, STRUCTURED_GRID, UNSTRUCTURED_GRID or POLYDATA",
        ),
        ("ASCII", "OCTAL", "a.vtk:3: expected ASCII or BINARY"),
        ("3 2 2", "3 2", "a.vtk:5: expected DIMENSIONS and three sizes above 0"),
        ("3 2 2", "3 2 0", "a.vtk:5: expected DIMENSIONS and three sizes above 0"),
        ("3 2 2", "3 2 3", "a.vtk:9: expected 18 values for 3 x 2 x 3, found 12"),
        ("3 2 2", "4294967296 4294967296 4294967296", "a.vtk:5: expected at most 2^45 voxels"),
        ("DIMENSIONS 3 2 2\n", "", "expected DIMENSIONS, found the end of the file"),
        ("ORIGIN 10", "ORIGIN nan", "a.vtk:6:8: expected a finite decimal number"),
        ("SPACING 3", "SPACING 0", "a.vtk:7: expected three independent finite steps"),
        ("SPACING 3 2 4", "SPACING 3 2", "a.vtk:7: expected three numbers"),
        ("SPACING 3", "SPACING 3000000", "a.vtk:7: expected steps of which none is more than 1000 times another"),
        ("POINT_DATA 12", "POINT_DATA 13", "a.vtk:9: expected 13 numbers, found 12"),
        ("POINT_DATA 12", "POINT_DATA 18446744073709551615", "a.vtk:9: expected at most "),
        ("POINT_DATA 12", "POINT_DATA 99", "a.vtk:9: expected 99 numbers, found 12"),
        ("density float", "density bit", "a.vtk:9: expected a type of numbers, from unsigned_char to double"),
        ("density float 1", "density float 3", "a.vtk:9: expected 36 numbers, found 12"),
        ("-0.5", "inf", "a.vtk:11:4: expected a finite decimal number, found 'inf'"),
        ("FIELD", "CELLS", "expected SCALARS, FIELD or another keyword of this dataset, found 'CELLS more 1'"),
    ] {
        refused(&with(from, to), expected);
    }
    let many = with("FIELD more 1\n", &format!("FIELD more 400000\n{}", "a 0 0 int\n".repeat(400_000)));
    refused(&many, "a.vtk:4108: expected at most 4096 arrays");
    refused(b"# vtk DataFile Version 3.0\n", "expected ASCII or BINARY, found the end of the file");
    let scalars = vtk(true);
    let at = scalars.windows(48).position(|w| w == raw(true)).unwrap();
    let mut infinite = scalars.clone();
    infinite[at + 4..at + 8].copy_from_slice(&f32::INFINITY.to_be_bytes());
    refused(&infinite, &format!("a.vtk@{}: expected values that fit 32-bit floats, found inf at voxel 1", at + 4));
    refused(&scalars[..at + 47], "expected at most 47 bytes of data, found 12 times 1 numbers of 4 bytes");
}
