//! Columns of points that are asked for by name: what each format has of them, and what is refused.
#![cfg(all(feature = "ply", feature = "las"))]

use crate::read_samples::{las, ply_ascii};
use read::{Loaded, NamedColumn, Notes, ReadParams, bytes};
use splat_core::glam::DVec3;
use splat_core::{MemoryAccount, RawPoints};

fn asking(columns: &[&str]) -> ReadParams {
    ReadParams { columns: columns.iter().map(|c| (*c).to_owned()).collect(), ..ReadParams::default() }
}

fn read(name: &str, content: &[u8], columns: &[&str]) -> (RawPoints, Notes) {
    match bytes(name, content, &asking(columns), None).unwrap_or_else(|e| panic!("{e}")) {
        (Loaded::Points(points), notes) => (points, notes),
        other => panic!("not points: {other:?}"),
    }
}

fn column(points: &RawPoints, name: &str) -> Vec<f64> {
    points.column(name, DVec3::Z).unwrap()
}

fn refused(name: &str, content: &[u8], columns: &[&str]) -> String {
    bytes(name, content, &asking(columns), None).unwrap_err().to_string()
}

const CSV: &[u8] = b"x,y,z,intensity,heat,label\n0,0,1,5,20.5,tree\n1,0,2,6,nan,wall\n2,0,4,7,-3e2,tree\n";

#[test]
fn empty_cells_and_decimal_commas_are_told_with_their_place() {
    for (content, expected) in [
        ("x,y,z,t\n1,2,3,4\n1,2,,5\n", "a.csv:3:5: expected a number in each column, found an empty cell, the 3. of 4"),
        ("x,y,z,t\n1,2,3,\n", "a.csv:2:7: expected a number in each column, found an empty cell, the 4. of 4"),
        ("x;y;z\n1;;3\n", "a.csv:2:3: expected a number in each column, found an empty cell, the 2. of 3"),
        ("x;y;z\n1,5;2,5;3\n", "a.csv:2:1: expected numbers with a decimal point, found '1,5', whose comma"),
        ("1;2,5;3,1\n", "a.csv:1:3: expected numbers with a decimal point, found '2,5', whose comma"),
        ("1,5 2,5 3,1\n", "a.csv:1:1: expected numbers with a decimal point, found '1,5', whose comma"),
    ] {
        let error = bytes("a.csv", content.as_bytes(), &ReadParams::default(), None).unwrap_err().to_string();
        assert!(error.starts_with(expected), "{content}: {error}");
    }
    // Other mixtures of separators are columns as before.
    for content in ["1,2,3;255,0,0\n", "1, 2, 3\n", "1,2,3,\n", "1;2;3\n", "1 2 3\n"] {
        assert!(bytes("a.csv", content.as_bytes(), &ReadParams::default(), None).is_ok(), "{content}");
    }
}

#[test]
fn columns_of_text_are_kept_by_name_and_no_longer_unused() {
    let (points, notes) = read("a.csv", CSV, &["heat", "intensity"]);
    let heat = column(&points, "heat");
    assert!(heat[0] == 20.5 && heat[1].is_nan() && heat[2] == -300.0);
    assert_eq!(column(&points, "height"), [1.0, 2.0, 4.0]);
    assert_eq!(column(&points, "value"), [5.0, 6.0, 7.0]);
    assert_eq!(notes.unused, ["label"]);
    let named = |name: &str| NamedColumn { name: name.to_owned(), range: None, association: None };
    assert_eq!(read("a.csv", CSV, &[]).1.columns, ["heat", "label"].map(named));
}

#[test]
fn a_column_that_is_not_there_is_refused_with_those_that_are() {
    let error = refused("a.csv", CSV, &["heat", "hue"]);
    assert!(error.contains("expected a column among intensity, x, y, z, height, heat, label, found `hue`"), "{error}");
    let error = refused("a.csv", CSV, &["label"]);
    assert!(error.starts_with("a.csv:2:14: expected a number, found 'tree'"), "{error}");
    let error = refused("a.laz", &las(1, 9, true), &["gps_time"]);
    assert!(error.contains("return_number, number_of_returns, scan_angle"), "{error}");
    // It steers no terminal.
    assert!(refused("a.csv", CSV, &["a\u{1b}[2J"]).contains("a\\u{1b}[2J"));
}

#[test]
fn ranges_of_all_columns_are_found_without_keeping_them() {
    let params = ReadParams { ranges: true, ..ReadParams::default() };
    let (loaded, notes) = bytes("a.csv", CSV, &params, None).unwrap();
    let Loaded::Points(points) = loaded else { panic!("not points") };
    assert!(points.columns.is_empty());
    let ranges: Vec<_> = notes.columns.iter().map(|c| (c.name.as_str(), c.range)).collect();
    assert_eq!(ranges, [("heat", Some([-300.0, 20.5])), ("label", None)]);
}

#[test]
fn properties_of_ply_are_kept_whether_they_come_before_or_behind_what_is_known() {
    let header = |format: &str| {
        format!(
            "ply\nformat {format} 1.0\nelement vertex 2\nproperty double time\nproperty float x\nproperty float y\n\
             property float z\nproperty uchar red\nproperty uchar green\nproperty uchar blue\nproperty short label\nend_header\n"
        )
    };
    let rows = [(1.5e9 + 0.25f64, [0.0f32, 1.0, 2.0], -7i16), (1.5e9 + 0.5, [3.0, 4.0, 5.0], 300)];
    let mut text = header("ascii").into_bytes();
    let mut little = header("binary_little_endian").into_bytes();
    for (time, p, label) in rows {
        text.extend(format!("{time} {} {} {} 255 0 51 {label}\n", p[0], p[1], p[2]).bytes());
        little.extend(time.to_le_bytes());
        p.iter().for_each(|c| little.extend(c.to_le_bytes()));
        little.extend([255, 0, 51]);
        little.extend(label.to_le_bytes());
    }
    for content in [text, little] {
        let (points, notes) = read("a.ply", &content, &["time", "label", "red"]);
        assert_eq!(column(&points, "time"), [1.5e9 + 0.25, 1.5e9 + 0.5]);
        assert_eq!(column(&points, "label"), [-7.0, 300.0]);
        assert_eq!(column(&points, "red"), [255.0; 2]);
        assert!(points.color.len() == 2 && notes.unused.is_empty(), "{:?}", notes.unused);
        assert_eq!(read("a.ply", &content, &[]).1.unused, ["time", "label"]);
    }
    let refused = bytes("a.ply", ply_ascii().as_bytes(), &asking(&["nothing"]), None).unwrap_err();
    assert_eq!(refused.expected, "a column among x, y, z, height, skipped_too, flags");
}

#[test]
fn fields_of_pcd_are_kept() {
    let text =
        b"VERSION 0.7\nFIELDS x y z ring range\nSIZE 4 4 4 2 8\nTYPE F F F U F\nCOUNT 1 1 1 1 1\nWIDTH 2\nHEIGHT 1\n\
                 POINTS 2\nDATA ascii\n0 0 0 3 1.5\n1 0 0 65535 nan\n";
    let (points, notes) = read("a.pcd", text, &["ring", "range"]);
    assert_eq!(column(&points, "ring"), [3.0, 65535.0]);
    let range = column(&points, "range");
    assert!(range[0] == 1.5 && range[1].is_nan() && notes.unused.is_empty());
}

#[test]
fn fields_of_las_are_the_same_packed_or_not() {
    for format in [0, 1, 2, 3, 6, 7, 8] {
        let asked = ["return", "number_of_returns", "scan_angle", "user_data", "point_source_id"];
        let [plain, packed] = [false, true].map(|compressed| read("a.las", &las(format, 40, compressed), &asked));
        assert_eq!(plain.0.columns, packed.0.columns, "format {format}");
        assert_eq!(plain.0.columns.len(), 5);
        assert!(!packed.1.unused.contains(&"scan_angle".to_owned()), "{:?}", packed.1.unused);
    }
    let (points, _) = read("a.laz", &las(8, 40, true), &["nir", "red"]);
    assert_eq!(column(&points, "nir"), (0..40).map(f64::from).collect::<Vec<_>>());
    assert_eq!(column(&points, "red"), (0..40).map(f64::from).collect::<Vec<_>>());
    let (points, _) = read("a.las", &las(1, 4, false), &["gps_time"]);
    assert_eq!(column(&points, "gps_time"), [1e9, 3.0, 2.0, 3.01]);
}

/// One short integer with a scale, an offset and a number for none, behind each record.
#[test]
fn extra_bytes_of_las_become_numbers_with_their_scale_and_gaps() {
    let plain = las(0, 3, false);
    let points = u32::from_le_bytes(plain[96..100].try_into().unwrap()) as usize;
    let mut described = vec![0; 54 + 192];
    described[2..11].copy_from_slice(b"LASF_Spec");
    (described[18], described[20]) = (4, 192);
    let d = &mut described[54..];
    (d[2], d[3]) = (4, 1 | 8 | 16);
    d[4..13].copy_from_slice(b"amplitude");
    d[40..48].copy_from_slice(&(-1i64).to_le_bytes());
    d[112..120].copy_from_slice(&0.5f64.to_le_bytes());
    d[136..144].copy_from_slice(&100f64.to_le_bytes());
    let mut content = plain[..points].to_vec();
    content[96..100].copy_from_slice(&((points + described.len()) as u32).to_le_bytes());
    content[100..104].copy_from_slice(&1u32.to_le_bytes());
    content[105..107].copy_from_slice(&22u16.to_le_bytes());
    content.extend(described);
    for (record, number) in plain[points..].chunks_exact(20).zip([-200i16, -1, 40]) {
        content.extend(record);
        content.extend(number.to_le_bytes());
    }
    let (points, notes) = read("a.las", &content, &["amplitude"]);
    let found = column(&points, "amplitude");
    assert!(found[0] == 0.0 && found[1].is_nan() && found[2] == 120.0, "{found:?}");
    assert!(!notes.unused.contains(&"amplitude".to_owned()));
}

#[test]
fn the_memory_of_columns_counts() {
    let limits = ReadParams { memory: MemoryAccount::new(CSV.len() as u64 + 3 * (68 + 4)), ..asking(&[]) };
    assert!(bytes("a.csv", CSV, &limits, None).is_ok());
    let more = ReadParams { columns: vec!["heat".into()], ..limits };
    assert!(bytes("a.csv", CSV, &more, None).unwrap_err().to_string().contains("the points"));
}
