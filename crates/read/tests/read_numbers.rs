//! Which forms of numbers every reader of text takes, and which it refuses with line and column.
#![cfg(all(feature = "ply", feature = "obj"))]

use crate::read_samples::load;
use read::{Loaded, Place};

/// The file around one number, and where the number stands.
type File = (&'static str, fn(&str, &str) -> String, u64, u64);

const FILES: [File; 6] = [
    ("a.ply", |n, end| format!("{PLY}0 0 {n}{end}"), 8, 5),
    ("a.xyz", |n, end| format!("1 1 1\n0 0 {n}{end}"), 2, 5),
    ("a.csv", |n, end| format!("x,y,z\n0,0,{n}{end}"), 2, 5),
    ("a.obj", |n, end| format!("# points\nv 0 0 {n}{end}"), 2, 7),
    ("a.stl", |n, _| format!("solid\nfacet normal 0 0 1\nouter loop\nvertex 0 0 {n}\n{FACET}"), 4, 12),
    ("a.nrrd", |n, end| format!("{NRRD}{n}{end}"), 7, 1),
];

const PLY: &str =
    "ply\nformat ascii 1.0\nelement vertex 1\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
const FACET: &str = "vertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid\n";
const NRRD: &str = "NRRD0004\ntype: float\ndimension: 3\nsizes: 1 1 1\nencoding: text\n\n";

fn number(loaded: &Loaded) -> f64 {
    match loaded {
        Loaded::Points(p) => p.exact_position(p.len() - 1).z,
        Loaded::Mesh(m) => m.origin.z + f64::from(m.position[0].z),
        Loaded::Grid(g) => f64::from(g.values[0]),
        _ => panic!("unknown kind"),
    }
}

#[test]
fn every_reader_takes_the_same_numbers() {
    let taken = [
        ("3", 3.0),
        ("+3", 3.0),
        ("-3", -3.0),
        ("-0", 0.0),
        ("007", 7.0),
        ("2.5", 2.5),
        ("+.5", 0.5),
        ("-.5", -0.5),
        ("5.", 5.0),
        ("1e2", 100.0),
        ("1.5E+1", 15.0),
        ("+25e-1", 2.5),
        ("1e-400", 0.0),
    ];
    for (name, file, ..) in FILES {
        for (word, value) in taken {
            let loaded = load(name, file(word, "\n").as_bytes()).unwrap_or_else(|e| panic!("{word}: {e}"));
            assert_eq!(number(&loaded), value, "{name}: {word}");
        }
    }
}

#[test]
fn every_reader_refuses_the_same_words_with_their_place() {
    let refused = [
        "-",
        "+",
        ".",
        "+.",
        "e5",
        ".e5",
        "1e",
        "1e+",
        "1.5e-",
        "++3",
        "+-3",
        "--3",
        "3-",
        "1..5",
        "1.2.3",
        "0x10",
        "1_000",
        "1d5",
        "1f",
        "#3",
        "nan",
        "-nan",
        "inf",
        "+Infinity",
        "1e999",
        "three",
        "\u{0663}",
        "1\u{a0}",
    ];
    for (name, file, line, column) in FILES {
        for word in refused {
            // A comment, a statement of another kind: not a number there, but no word of one either.
            if word == "#3" && matches!(name, "a.xyz" | "a.csv" | "a.obj") {
                continue;
            }
            // Voxels may be gaps, and a volume of nothing else is refused as a whole.
            if word.ends_with("nan") && matches!(name, "a.nrrd" | "a.mha" | "a.vti" | "a.vtk") {
                assert!(load(name, file(word, "\n").as_bytes()).unwrap_err().found.starts_with("NaN in all"), "{name}");
                continue;
            }
            let error = load(name, file(word, "\n").as_bytes()).unwrap_err();
            assert_eq!(error.place, Place::Line { line, column }, "{name}: {word}: {error}");
        }
    }
}

/// A file may end without a line end, but not in the middle of a number.
#[test]
fn a_last_number_that_is_cut_is_refused() {
    for (name, file, line, column) in FILES.into_iter().filter(|f| f.0 != "a.stl") {
        assert_eq!(number(&load(name, file("12", "").as_bytes()).unwrap()), 12.0, "{name}");
        assert_eq!(number(&load(name, file("1.5", "").as_bytes()).unwrap()), 1.5, "{name}");
        for word in ["1.", "-", "1e", "1.5e-", "+"] {
            let error = load(name, file(word, "").as_bytes()).unwrap_err();
            assert_eq!(error.place, Place::Line { line, column }, "{name}: {word}: {error}");
        }
        assert_eq!(number(&load(name, file("1.", "\n").as_bytes()).unwrap()), 1.0, "{name}");
        // A blank ends a number as well.
        assert_eq!(number(&load(name, file("1.", " ").as_bytes()).unwrap()), 1.0, "{name}");
    }
}
