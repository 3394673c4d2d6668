//! PCD: the same points from text, bytes and compressed bytes, and what is wrong with a file in words.

use crate::read_samples::{gzip, load, pcd, pcd_header};
use read::{Fault, Loaded, Notes, ReadParams, bytes};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{MemoryAccount, RawPoints};

fn read(content: &[u8]) -> (RawPoints, Notes) {
    match bytes("a.pcd", content, &ReadParams::default(), None).unwrap() {
        (Loaded::Points(points), notes) => (points, notes),
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn refused(content: &[u8], beginning: &str) {
    let error = load("a.pcd", content).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().starts_with(beginning), "{error}");
    assert!(error.to_string().contains("\nhint: "), "{error}");
}

#[test]
fn text_bytes_and_compressed_bytes_are_the_same_points() {
    let (expected, notes) = read(&pcd("ascii"));
    assert_eq!(expected.position[1], Vec3::new(1.0, 0.5, -2.0));
    assert_eq!((expected.len(), expected.dropped), (4, 0));
    assert_eq!(expected.normal, [Vec3::Z; 4]);
    assert_eq!(expected.color[0], [1.0, 0.0, 0.0]);
    assert!((expected.color[1][1] - 0.215_860_5).abs() < 1e-6);
    assert_eq!((expected.value.as_slice(), expected.opacity[1]), ([0.0, 3.0, 6.0, 9.0].as_slice(), 0.2));
    assert_eq!(notes.unused, ["ring", "histogram"]);
    for data in ["binary", "binary_compressed"] {
        assert_eq!(read(&pcd(data)), (expected.clone(), notes.clone()), "{data}");
        assert_eq!(load("a.pcd.gz", &gzip(&pcd(data))).unwrap(), Loaded::Points(expected.clone()), "{data}");
        // Without its extension too.
        assert_eq!(load("unnamed", &pcd(data)).unwrap(), Loaded::Points(expected.clone()), "{data}");
    }
}

fn text(fields: &str, sizes: &str, types: &str, points: &str) -> Vec<u8> {
    let n = points.lines().count();
    format!(
        "VERSION .7\nFIELDS {fields}\nSIZE {sizes}\nTYPE {types}\nWIDTH {n}\nHEIGHT 1\nPOINTS {n}\nDATA ascii\n{points}"
    )
    .into_bytes()
}

#[test]
fn colours_are_packed_as_a_float_or_a_number() {
    let packed = 0x00ff_8000u32;
    let float = format!("{:e}", f32::from_bits(packed));
    for (kind, word) in
        [("F", float.as_str()), ("F", &packed.to_string()), ("U", &packed.to_string()), ("I", "16744448")]
    {
        let (points, notes) = read(&text("x y z rgb", "4 4 4 4", &format!("F F F {kind}"), &format!("0 0 0 {word}\n")));
        assert_eq!((points.color[0][0], points.color[0][2]), (1.0, 0.0), "{kind} {word}");
        assert!(notes.unused.is_empty());
    }
    let alpha =
        |alpha: u32| read(&text("x y z rgba", "4 4 4 4", "F F F U", &format!("0 0 0 {}\n", alpha << 24))).1.unused;
    assert!(alpha(255).is_empty() && alpha(0).is_empty());
    assert_eq!(alpha(9), ["alpha of rgba"]);
}

#[test]
fn points_without_a_place_are_left_out_and_said() {
    let (points, notes) = read(&text(
        "x y z normal_x normal_y normal_z",
        "4 4 4 4 4 4",
        "F F F F F F",
        "nan nan nan nan nan nan\n1 2 3 nan nan nan\n4 5 6 0 3 4\n",
    ));
    assert_eq!((points.len(), points.dropped), (2, 1));
    assert_eq!(points.normal, [Vec3::ZERO, Vec3::new(0.0, 0.6, 0.8)]);
    assert_eq!(notes.remarks, ["1 point has no place (nan) and is left out"]);
    let infinite = text("x y z", "4 4 4", "F F F", "1 2 inf\n0 0 0\n");
    refused(&infinite, "a.pcd:9:5: expected a finite number, found 'inf'");
    let params = ReadParams { drop_invalid: true, ..ReadParams::default() };
    let Loaded::Points(points) = bytes("a.pcd", &infinite, &params, None).unwrap().0 else { panic!("no points") };
    assert_eq!((points.len(), points.dropped), (1, 1));
}

#[test]
fn far_points_in_doubles_keep_their_distances() {
    let (points, _) = read(&text("x y z", "8 8 8", "F F F", "5000000.125 1 2\n5000001.25 1 2\n"));
    assert_eq!(points.exact_position(1) - points.exact_position(0), DVec3::new(1.125, 0.0, 0.0));
}

#[test]
fn headers_that_lie_are_refused_before_anything_is_allocated() {
    let with = |from: &str, to: &str, data: &str| {
        let header = pcd_header(data);
        let content = pcd(data);
        [header.replacen(from, to, 1).as_bytes(), &content[header.len()..]].concat()
    };
    for data in ["binary", "binary_compressed"] {
        for count in ["4294967296", "18446744073709551615"] {
            let content = with("WIDTH 4", &format!("WIDTH {count}"), data);
            let content = String::from_utf8_lossy(&content).replacen("POINTS 4", &format!("POINTS {count}"), 1);
            assert_eq!(load("a.pcd", content.as_bytes()).unwrap_err().fault, Fault::Input, "{data} {count}");
        }
        refused(&with("POINTS 4", "POINTS 5", data), "a.pcd:9:8: expected 4 points, WIDTH x HEIGHT, found '5'");
        refused(&with("WIDTH 4\nHEIGHT 1\nPOINTS 4", "WIDTH 3\nHEIGHT 1\nPOINTS 3", data), "a.pcd@");
    }
    refused(
        &with("WIDTH 4\nHEIGHT 1\nPOINTS 4", "WIDTH 5\nHEIGHT 1\nPOINTS 5", "ascii"),
        "a.pcd:9:8: expected 5 points, as announced, found 4 points",
    );
    refused(
        &with("DATA ascii", "DATA packed", "ascii"),
        "a.pcd:10:6: expected DATA ascii, binary or binary_compressed",
    );
    refused(&with("FIELDS x y z", "FIELDS x y y", "ascii"), "a.pcd:3:12: expected each field once, found 'y'");
    refused(
        &with("FIELDS x y z", "FIELDS x y w", "ascii"),
        "a.pcd:3:1: expected a field 'z' of one number, found none",
    );
    refused(&with("SIZE 4", "SIZE 3", "ascii"), "a.pcd:4:6: expected a size of type F in bytes, found '3'");
    refused(&with("TYPE F", "TYPE X", "ascii"), "a.pcd:5:6: expected a type I, U or F, found 'X'");
    refused(&with("COUNT 1", "COUNT 0", "ascii"), "a.pcd:6:7: expected 1 to 65536 numbers of a field, found '0'");
    refused(&with("COUNT 1 ", "COUNT ", "ascii"), "a.pcd:6:1: expected 11 values, one a field, found 10");
    refused(&with("POINTS", "POINTZ", "ascii"), "a.pcd:9:1: expected a keyword of PCD such as FIELDS");
    refused(b"# .PCD v0.7\nVERSION 0.7\n", "a.pcd:3: expected a line DATA, found the end of the file");
    refused(&text("x y z", "4 4 4", "F F F", "1 2\n"), "a.pcd:9: expected 3 numbers, found 2 on the line");
    refused(&text("x y z", "4 4 4", "F F F", "1 2,5 3\n"), "a.pcd:9:3: expected a decimal number, found '2,5'");
    refused(&text("x y z", "4 4 1", "F F U", "1 2 256\n"), "a.pcd:9:5: expected an integer from 0 to 255, found '256'");
    let many = text("x y z opacity", "4 4 4 4", "F F F F", "1 2 3 1.5\n");
    refused(&many, "a.pcd:9:7: expected an opacity from 0 to 1, found '1.5'");
    let limits = ReadParams { memory: MemoryAccount::new(100), ..ReadParams::default() };
    for data in ["ascii", "binary", "binary_compressed"] {
        assert_eq!(bytes("a.pcd", &pcd(data), &limits, None).unwrap_err().fault, Fault::Limit, "{data}");
    }
    // 64 KiB of packed bytes that announce 4 GiB.
    let header =
        pcd_header("binary_compressed").replace("WIDTH 4", "WIDTH 80000000").replace("POINTS 4", "POINTS 80000000");
    let lengths = [65_536u32, (80_000_000u64 * 43) as u32].map(u32::to_le_bytes).concat();
    let content = [header.as_bytes(), &lengths, &[0; 65_536]].concat();
    refused(&content, "a.pcd@");
}
