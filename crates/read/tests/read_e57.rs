//! Scans of ASTM E57: what is kept of their points, and what is wrong in a file.
#![cfg(feature = "e57")]

use crate::read_samples::e57::{e57, summed};
use crate::read_samples::{gzip, load};
use read::{Fault, Loaded, Notes, ReadParams, bytes, up_axis};
use splat_core::glam::DVec3;
use splat_core::{RawPoints, UpAxis};

fn read(name: &str, content: &[u8], columns: &[&str]) -> (RawPoints, Notes) {
    let columns = columns.iter().map(|c| (*c).to_owned()).collect();
    match bytes(name, content, &ReadParams { columns, ..ReadParams::default() }, None).unwrap_or_else(|e| panic!("{e}"))
    {
        (Loaded::Points(points), notes) => (points, notes),
        other => panic!("not points: {other:?}"),
    }
}

#[test]
fn points_of_all_scans_lie_where_their_poses_move_them() {
    let (points, notes) = read("a.e57", &e57(), &[]);
    let first = [0.0, 1.0, 3.0].map(|i| DVec3::new(10.0 - (1.0 + i), 20.0 + 0.5 * i, 30.0 - 2.0 * i));
    let second = [DVec3::new(0.0, 2.0, 0.0), DVec3::new(0.0, 0.0, -3.0)];
    let places: Vec<DVec3> = (0..points.len()).map(|i| points.exact_position(i)).collect();
    let expected = [&first[..], &second].concat();
    assert_eq!(places.len(), expected.len());
    for (found, expected) in places.iter().zip(expected) {
        assert!(found.distance(expected) < 1e-5, "{found} for {expected}");
    }
    assert_eq!(points.dropped, 1);
    assert_eq!(points.value, [0.0, 1000.0, 3000.0, 0.0, 0.0]);
    let green = |share: f64| splat_core::srgb::decoded(share) as f32;
    assert_eq!(points.color[..3], [0.0, 0.2, 0.6].map(|share| [1.0, green(share), 0.0]));
    assert_eq!(points.color[3..], [[0.5; 3]; 2]);
    let remarks = [
        "2 scans, each moved to its pose",
        "1 point without a place: left out",
        "2 points without a colour: grey",
        "2 points without an intensity: it is 0",
    ];
    assert_eq!(notes.remarks, remarks);
    assert_eq!(notes.unused, ["1 picture (images2D)", "rowIndex"]);
    assert_eq!(read("a.e57.gz", &gzip(&e57()), &[]).0, points);
}

#[test]
fn further_fields_are_columns_and_scans_are_told_apart() {
    let (points, notes) = read("a.e57", &e57(), &["scan", "rowIndex", "colorGreen"]);
    let column = |name: &str| points.column(name, DVec3::Z).unwrap();
    assert_eq!(column("scan"), [0.0, 0.0, 0.0, 1.0, 1.0]);
    assert_eq!(column("rowIndex")[..3], [7.0; 3]);
    assert!(column("rowIndex")[3..].iter().all(|v| v.is_nan()));
    assert_eq!(column("colorGreen")[..3], [0.0, 51.0, 153.0]);
    assert_eq!(notes.unused, ["1 picture (images2D)"]);
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("up.e57");
    std::fs::write(&path, e57()).unwrap();
    assert_eq!(up_axis(&path), UpAxis::Z);
}

/// The sample with something else of the same length in its description.
fn with(from: &str, to: &str) -> Vec<u8> {
    let mut content = e57();
    assert_eq!(from.len(), to.len(), "{from}");
    let at = content.windows(from.len()).position(|w| w == from.as_bytes()).unwrap_or_else(|| panic!("{from}"));
    content[at..at + to.len()].copy_from_slice(to.as_bytes());
    summed(content)
}

#[track_caller]
fn refused(content: &[u8], expected: &str) {
    let error = load("a.e57", content).unwrap_err();
    assert!(matches!(error.fault, Fault::Input | Fault::Limit), "{error}");
    assert!(error.to_string().contains(expected), "{error}");
}

#[test]
fn what_is_wrong_in_a_description_is_named() {
    for (from, to, expected) in [
        ("recordCount=\"4\"", "recordCount=\"9\"", "expected 9 points of the scan, 160 more bits of cartesianX"),
        ("recordCount=\"4\"", "recordCount=\"x\"", "expected a number as recordCount, found 'x'"),
        ("recordCount", "recordsount", "expected an attribute recordCount, found 'none'"),
        ("fileOffset=\"48\"", "fileOffset=\"49\"", "expected the section of the points of a scan"),
        ("precision=\"single\"", "precision=\"triple\"", "expected precision single or double, found 'triple'"),
        (
            "maximum=\"1000\"",
            "maximum=\"-100\"",
            "expected cartesianY to have a maximum above its minimum, found '-100'",
        ),
        ("cartesianZ", "cartesianz", "expected fields cartesianX to Z, or sphericalRange"),
        (
            "<colorRed type=\"Integer\"",
            "<colorRed type=\"Boolean\"",
            "expected colorRed to be Float, Integer or ScaledInteger",
        ),
        ("scale=\"0.01\"", "scale=\"inf \"", "expected a finite scale, found 'inf'"),
        ("e57Root", "e58Root", "expected XML as the description"),
        ("<z type=\"Float\">0.7", "<z type=\"Float\">9.7", "expected a rotation as a quaternion of length 1"),
        ("<x type=\"Float\">10", "<x type=\"Float\">1x", "expected a finite number, found '1x'"),
    ] {
        refused(&with(from, to), expected);
    }
}

#[test]
fn what_is_wrong_in_pages_and_packets_is_named() {
    let sample = e57();
    let mut flipped = sample.clone();
    flipped[100] ^= 1;
    refused(&flipped, "a.e57@0: expected a page with the sum at its end, found another sum");
    refused(&sample[..sample.len() - 1024], "bytes, as the header says");
    let set = |at: usize, bytes: &[u8]| {
        let mut content = sample.clone();
        content[at..at + bytes.len()].copy_from_slice(bytes);
        summed(content)
    };
    refused(&set(8, &[2]), "a.e57@8: expected version 1.0 of E57, found 2.0");
    refused(&set(40, &[1]), "a.e57@40: expected pages of 64 to 1048576 bytes that fill the file, found 1025");
    refused(&set(24, &[0xff; 8]), "a.e57@24: expected a place in a page of the file, found 18446744073709551615");
    refused(&set(32, &[0xff; 8]), "a.e57@32: expected a description of at most ");
    // The section of the first scan begins behind the header, and its first packet behind that.
    refused(&set(48, &[0]), "a.e57@48: expected the section of the points of a scan");
    refused(&set(56, &[0xff; 8]), "a.e57@48: expected a section within the file");
    refused(&set(80, &[7]), "a.e57@80: expected a packet of kind 0, 1 or 2, found 7");
    refused(&set(82, &[1, 0]), "a.e57@80: expected a packet within its section, found one of 2 bytes");
    refused(&set(84, &[8, 0]), "a.e57@80: expected a packet of 9 fields, found 8");
    refused(&set(86, &[0xff, 0xff]), "a.e57@80: expected field 0 within its packet, found a longer one");
}
