//! MetaImage: its space, its types, its data files, and what is wrong in it.

use crate::read_samples::load;
use crate::read_samples::volumes::{metaimage, metaimage_header, raw, values, zlib};
use read::{Fault, Loaded, Notes, ReadError, ReadParams, bytes, file};
use splat_core::Grid;
use splat_core::glam::DVec3;
use std::path::{Path, PathBuf};

fn read(content: &[u8]) -> (Grid, Notes) {
    match bytes("a.mha", content, &ReadParams::default(), None).unwrap_or_else(|e| panic!("{e}")) {
        (Loaded::Grid(grid), notes) => (grid, notes),
        other => panic!("not a grid: {other:?}"),
    }
}

/// The file with a piece of its header in the place of another.
fn with(from: &str, to: &str) -> Vec<u8> {
    let header = metaimage_header("");
    assert!(header.contains(from), "{from}");
    [header.replacen(from, to, 1).into_bytes(), raw(false)].concat()
}

#[track_caller]
fn refused(content: &[u8], beginning: &str) {
    let error = load("a.mha", content).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().starts_with(beginning), "{error}");
}

/// The name of a type, and the bytes of a value.
type Kind = (&'static str, fn(f64) -> Vec<u8>);

#[test]
fn every_type_gives_the_same_values() {
    let types: [Kind; 11] = [
        ("MET_CHAR", |v| (v as i8).to_le_bytes().to_vec()),
        ("MET_UCHAR", |v| (v as u8).to_le_bytes().to_vec()),
        ("MET_SHORT", |v| (v as i16).to_le_bytes().to_vec()),
        ("MET_USHORT", |v| (v as u16).to_le_bytes().to_vec()),
        ("MET_INT", |v| (v as i32).to_le_bytes().to_vec()),
        ("MET_UINT", |v| (v as u32).to_le_bytes().to_vec()),
        ("MET_LONG", |v| (v as i32).to_le_bytes().to_vec()),
        ("MET_LONG_LONG", |v| (v as i64).to_le_bytes().to_vec()),
        ("MET_ULONG_LONG", |v| (v as u64).to_le_bytes().to_vec()),
        ("MET_FLOAT", |v| (v as f32).to_le_bytes().to_vec()),
        ("MET_DOUBLE", |v| v.to_le_bytes().to_vec()),
    ];
    let expected: Vec<f32> = (0..12).map(|v| v as f32).collect();
    for (name, encode) in types {
        let header = metaimage_header("").replace("MET_FLOAT", name);
        let data: Vec<u8> = (0..12).flat_map(|v| encode(f64::from(v))).collect();
        assert_eq!(read(&[header.into_bytes(), data].concat()).0.values, expected, "{name}");
    }
}

#[test]
fn its_space_is_turned_and_said_to_be() {
    let (grid, notes) = read(&metaimage("raw", false));
    assert_eq!(grid.position(1, 1, 1), DVec3::new(10.0 - 2.0, 20.0 + 3.0, -30.0 + 4.0));
    assert_eq!(notes.remarks, ["space: left-posterior-superior, converted to right-anterior-superior"]);
    assert!(notes.unused.is_empty(), "{:?}", notes.unused);
    // Rotation and Origin are older names; without spacing there is a size of elements, or 1.
    for (from, to) in [("TransformMatrix", "Rotation"), ("Offset", "Origin"), ("ElementSpacing", "ElementSize")] {
        assert_eq!(read(&with(from, to)).0, grid, "{to}");
    }
    let (unit, notes) = read(&with("ElementSpacing = 3 2 4", "DistanceUnits = um"));
    assert_eq!(unit.position(1, 1, 1), DVec3::new(10.0 - 1.0, 20.0 + 1.0, -30.0 + 1.0));
    assert_eq!(notes.unused, ["DistanceUnits"]);
}

#[test]
fn a_picture_is_not_called_damaged() {
    let error = load("a.mha", &with("NDims = 3", "NDims = 2")).unwrap_err();
    assert!(error.hint.starts_with("it is a picture, not a volume"), "{error}");
}

#[test]
fn what_is_wrong_in_a_header_is_named_with_its_line() {
    for (from, to, beginning) in [
        ("= Image", "= Tube", "a.mha:1: expected ObjectType = Image"),
        ("NDims = 3", "NDims = 2", "a.mha:2: expected NDims = 3, or 4 for a series of volumes, found '2'"),
        ("= 3 2 2", "= 3 2", "a.mha:3: expected 3 sizes above 0, found '3 2'"),
        ("= 3 2 2", "= 3 2 0", "a.mha:3: expected 3 sizes above 0"),
        ("= 3 2 2", "= 3 2 -2", "a.mha:3: expected 3 sizes above 0"),
        ("= 3 2 2", "= 3 2 18446744073709551616", "a.mha:3: expected 3 sizes above 0"),
        ("= 3 2 2", "= 4294967296 4294967296 2", "a.mha:3: expected at most 2^45 voxels"),
        ("= 3 2 2", "= 3 2 3", "a.mha@227: expected 72 bytes of voxels (3 x 2 x 3 x 4 bytes), found 48"),
        ("MET_FLOAT", "MET_STRING", "a.mha:4: expected an ElementType of real numbers"),
        ("= 3 2 4", "= 3 2 0", "a.mha:5: expected three independent finite steps"),
        ("= 3 2 4", "= 3 2 nan", "a.mha:5: expected 3 finite numbers, found '3 2 nan'"),
        ("= 3 2 4", "= 3 2 1e300", "a.mha:5: expected steps of which none is more than 1000 times another"),
        ("-10 -20", "-10 inf", "a.mha:6: expected 3 finite numbers"),
        ("1 0 0 0 0 1", "1 0 0 0 0 0", "a.mha:5: expected three independent finite steps"),
        ("Center", "Orientation = 1 0 0 0 1 0 0 0 1\nCenter", "a.mha:8: expected each field once"),
        ("Center", "BinaryData = perhaps\nCenter", "a.mha:8: expected True or False"),
        ("Center", "HeaderSize = -2\nCenter", "a.mha:8: expected a whole number from -1"),
        ("Center", "HeaderSize = 49\nCenter", "a.mha: expected a number of bytes before the voxels"),
        ("Center", "no field\nCenter", "a.mha:8: expected a line Field = value, found 'no field'"),
        ("NDims = 3\n", "", "a.mha:10: expected a field NDims, found none in the header"),
        ("= LOCAL", "= LIST", "a.mha:10: expected one data file in the header's folder, found 'LIST'"),
        ("= LOCAL", "= a%03d.raw", "a.mha:10: expected one data file in the header's folder"),
        ("= LOCAL", "= ../a.raw", "a.mha:10: expected the data: a file in the same folder or below"),
        ("= LOCAL", "= a.raw", "a.mha:10: expected the data: all of it in one file, as it was read from memory"),
    ] {
        refused(&with(from, to), beginning);
    }
    let many: String = (0..400_000).map(|i| format!("f{i} = 0\n")).collect();
    refused(metaimage_header(&many).as_bytes(), "a.mha:4097: expected at most 4096 fields, found 'f4087'");
    refused(metaimage_header("").replace("ElementDataFile", "Element").as_bytes(), "a.mha:11: expected a field Elem");
    let mut infinite = metaimage("raw", false);
    let at = infinite.len() - 40;
    infinite[at..at + 4].copy_from_slice(&f32::INFINITY.to_le_bytes());
    refused(&infinite, &format!("a.mha@{at}: expected values that fit 32-bit floats, found inf at voxel 2"));
}

#[test]
fn a_size_that_lies_takes_no_memory() {
    let content = with("= 3 2 2", "= 30000 30000 30000");
    refused(
        &content,
        "a.mha@239: expected 108000000000000 bytes of voxels (30000 x 30000 x 30000 x 4 bytes), found 48",
    );
    let packed = [metaimage_header("CompressedData = True\n").replace("= 3 2 2", "= 3000 3000 3000"), String::new()];
    let error = load("a.mha", &[packed.concat().into_bytes(), zlib(&raw(false))].concat()).unwrap_err();
    assert_eq!(error.fault, Fault::Limit, "{error}");
}

#[test]
fn compressed_data_is_one_whole_stream() {
    let packed = metaimage("zlib", false);
    // Its last bytes are a sum that the voxels do not need.
    let cut = load("a.mha", &packed[..packed.len() - 2]).unwrap_err().to_string();
    assert!(cut.contains("expected a complete zlib stream and nothing after it"), "{cut}");
    let longer = load("a.mha", &[&packed[..], b"x"].concat()).unwrap_err().to_string();
    assert!(longer.contains("expected a complete zlib stream and nothing after it"), "{longer}");
}

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(path.join("below")).unwrap();
    path
}

fn opened(folder: &Path, header: &str) -> Result<Grid, ReadError> {
    std::fs::write(folder.join("a.mhd"), header).unwrap();
    match file(&folder.join("a.mhd"), &ReadParams::default(), None)?.0 {
        Loaded::Grid(grid) => Ok(grid),
        other => panic!("not a grid: {other:?}"),
    }
}

#[test]
fn the_voxels_may_lie_in_a_file_of_their_own() {
    let folder = folder("metaimage");
    std::fs::write(folder.join("a.raw"), raw(true)).unwrap();
    std::fs::write(folder.join("a.zraw"), zlib(&raw(false))).unwrap();
    std::fs::write(folder.join("below/a.raw"), [b"a header", &raw(false)[..]].concat()).unwrap();
    for (more, name) in [
        ("ElementByteOrderMSB = True\n", "a.raw"),
        ("CompressedData = True\nCompressedDataSize = 40\n", "a.zraw"),
        ("HeaderSize = 8\n", "below/a.raw"),
        ("HeaderSize = -1\n", "./below/a.raw"),
    ] {
        let header = metaimage_header(more).replace("LOCAL", name);
        assert_eq!(opened(&folder, &header).unwrap().values, values(), "{name}");
        // Also where the line does not end.
        assert_eq!(opened(&folder, header.trim_end()).unwrap().values, values(), "{name}");
    }
    let error = |more: &str, name: &str| {
        opened(&folder, &metaimage_header(more).replace("LOCAL", name)).unwrap_err().to_string()
    };
    let short = error("", "below/a.raw");
    let expected = "a.mhd@0: expected the data file 'below/a.raw': 48 bytes of voxels (3 x 2 x 2 x 4 bytes), found 56";
    assert!(short.contains(expected), "{short}");
    let missing = error("", "none.raw");
    assert!(missing.contains("expected the data file 'none.raw': a file, found no such file"), "{missing}");
    assert!(error("", "a.mhd").contains("expected a data file that is not the header itself"));
}
