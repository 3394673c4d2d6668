//! STL, OBJ, XYZ and NRRD: what they become, and bad inputs by their number in the list of required behaviours.
#![cfg(all(feature = "obj", feature = "ply"))]

use crate::read_samples::{gzip, load};
use read::{Fault, Loaded, ReadParams, bytes, file};
use splat_core::glam::{DMat3, DVec3, Vec3};
use splat_core::{Grid, MemoryAccount, Mesh, RawPoints};
use std::path::{Path, PathBuf};

const CORNERS: [[f32; 3]; 6] =
    [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [5.0, 0.0, 1.0], [6.0, 0.0, 1.0], [5.0, 2.0, 1.0]];

fn stl_binary(begin: &[u8]) -> Vec<u8> {
    let mut out = begin.to_vec();
    out.resize(80, b' ');
    out.extend(2u32.to_le_bytes());
    for facet in CORNERS.as_chunks::<3>().0 {
        out.extend([0; 12]);
        facet.iter().flatten().for_each(|c| out.extend(c.to_le_bytes()));
        out.extend([7, 7]);
    }
    out
}

fn stl_text() -> String {
    let mut text = "solid two facets\n".to_owned();
    for facet in CORNERS.as_chunks::<3>().0 {
        text += "  facet normal 0 0 1\n    outer loop\n";
        facet.iter().for_each(|c| text += &format!("      vertex {} {:e} {}\n", c[0], c[1], c[2]));
        text += "    endloop\n  endfacet\n";
    }
    text + "endsolid"
}

const OBJ: &str = "# a quad and a triangle\nmtllib ../../etc/passwd\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nvt 0 0\n\
    vn 0 0 2\ng group\nusemtl C:\\secret\nf 1//1 2//1 3//1 4//1\nf -4/1/-1 -2/1/-1 -1/1/1\n";

const NRRD: &str = "NRRD0004\n# comment\ntype: uint16\ndimension: 3\nsizes: 2 3 1\nkey:=value\nkinds: domain domain domain\n\
    space directions: (2,0,0) (0,-1,0) (0,0,3)\nspace origin: (1,2,3)\nencoding: raw\nendian: big\n\n";

fn voxels() -> Vec<u8> {
    (0..6u16).flat_map(|v| (v * 300).to_be_bytes()).collect()
}

fn nrrd(header: &str, data: &[u8]) -> Vec<u8> {
    [header.as_bytes(), data].concat()
}

fn mesh(name: &str, content: &[u8]) -> Mesh {
    match load(name, content).unwrap() {
        Loaded::Mesh(mesh) => mesh,
        other => panic!("{other:?}"),
    }
}

fn points(name: &str, content: &str) -> RawPoints {
    match load(name, content.as_bytes()).unwrap() {
        Loaded::Points(points) => points,
        other => panic!("{other:?}"),
    }
}

fn grid(content: &[u8]) -> Grid {
    match load("a.nrrd", content).unwrap() {
        Loaded::Grid(grid) => grid,
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn refused(name: &str, content: impl AsRef<[u8]>, beginning: &str) {
    let error = load(name, content.as_ref()).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().starts_with(beginning), "{error}");
    assert!(error.to_string().contains("\nhint: "), "{error}");
}

/// Every shorter file is refused or, where only a line end or the name after the last word is missing, is the same.
fn every_truncation(name: &str, content: &[u8], most_same: usize) {
    let whole = load(name, content).unwrap();
    let same = (0..content.len()).filter(|n| match load(name, &content[..*n]) {
        Ok(loaded) => {
            assert_eq!(loaded, whole, "{name} cut to {n} bytes");
            true
        }
        Err(error) => {
            assert_eq!(error.fault, Fault::Input, "{error}");
            false
        }
    });
    assert!(same.count() <= most_same);
}

#[test]
fn ba13_stl_is_binary_or_text_by_its_size() {
    let expected: Vec<Vec3> = CORNERS.iter().map(|c| (*c).into()).collect();
    let text = stl_text().into_bytes();
    for content in [stl_binary(b"a header"), stl_binary(b"solid that is binary"), text.clone(), gzip(&text)] {
        let mesh = mesh("a.stl", &content);
        assert_eq!(mesh.position, expected);
        assert_eq!(mesh.triangles, [[0, 1, 2], [3, 4, 5]]);
        assert!(mesh.normal.is_empty());
    }
    // Without an extension too, and with several solids, capitals, blank lines and other line ends.
    let two = format!("{}\n\n{}\n", stl_text().to_uppercase(), stl_text().replace('\n', "\r\n"));
    assert_eq!(mesh("unnamed", two.as_bytes()).triangles.len(), 4);
    let mut long = stl_binary(b"a");
    long.extend([0; 50]);
    refused("a.stl", long, "a.stl@80: expected 84 + 50 x 2 = 184 bytes of a binary STL, or a text");
    let mut count = stl_binary(b"a");
    count[80..84].copy_from_slice(&u32::MAX.to_le_bytes());
    refused("a.stl", count, "a.stl@80: expected 84 + 50 x 4294967295 = 214748364834 bytes");
    refused("a.stl", b"", "a.stl@80: expected a binary STL of at least 84 bytes");
    let mut nan = stl_binary(b"a");
    nan[84 + 50 + 12 + 12..][..4].copy_from_slice(&f32::NAN.to_le_bytes());
    refused("a.stl", nan, "a.stl@158: expected finite coordinates, found [NaN, 0, 1] in facet 1");
    let bad = |from: &str, to: &str| stl_text().replacen(from, to, 1);
    refused("a.stl", bad("vertex 1 0e0 0", "vertex 1 0e0"), "a.stl:5: expected 'vertex X Y Z', found 'vertex 1 0e0'");
    refused(
        "a.stl",
        bad("vertex 1 0e0 0", "vertex 1 1,5 0"),
        "a.stl:5:16: expected a finite decimal number, found '1,5'",
    );
    refused("a.stl", bad("vertex 1 0e0 0", "vertex 1 nan 0"), "a.stl:5:16: expected a finite decimal number");
    refused("a.stl", bad("normal 0 0 1", "normal up up up"), "a.stl:2: expected 'facet normal X Y Z', found 'facet");
    for none in ["nan -nan(ind) 1.#IND", "-nan nan(snan) -1.#QNAN", "inf -inf 0"] {
        assert_eq!(mesh("a.stl", bad("normal 0 0 1", &format!("normal {none}")).as_bytes()).position, expected);
    }
    refused("a.stl", bad("    endloop\n", ""), "a.stl:7: expected 'endloop', found 'endfacet'");
    refused("a.stl", bad("endsolid", "solid"), "a.stl:16: expected 'facet normal X Y Z' or 'endsolid'");
    let limits = ReadParams { memory: MemoryAccount::new(stl_text().len() as u64 + 239), ..ReadParams::default() };
    assert_eq!(bytes("a.stl", &stl_binary(b"a"), &limits, None).unwrap_err().fault, Fault::Limit);
    assert_eq!(bytes("a.stl", stl_text().as_bytes(), &limits, None).unwrap_err().fault, Fault::Limit);
}

#[test]
fn ba05_every_truncation_of_the_other_formats_is_refused_or_the_same() {
    every_truncation("a.stl", &stl_binary(b"a header"), 0);
    every_truncation("a.stl", &stl_binary(b"solid header"), 0);
    every_truncation("a.stl", format!("{} two facets\n", stl_text()).as_bytes(), 12);
    every_truncation("a.stl.gz", &gzip(stl_text().as_bytes()), 0);
    every_truncation("a.nrrd", &nrrd(NRRD, &voxels()), 0);
    let packed = NRRD.replace("raw", "gzip");
    every_truncation("a.nrrd", &nrrd(&packed, &gzip(&voxels())), 0);
    every_truncation("a.pts", b"3\n1 2 3\n4 5 6\n7 8 9\n", 1);
    // Lists without a count: what is cut at a line end is a shorter list; anything else is refused.
    for (name, content) in [("a.obj", OBJ), ("a.csv", "x,y,z,intensity\n1,2,3,4.5\n4,5,6,7.5\n")] {
        for n in 0..content.len() {
            if let Ok(Loaded::Mesh(mesh)) = load(name, &content.as_bytes()[..n]) {
                mesh.validate().unwrap();
            }
        }
    }
}

#[test]
fn obj_faces_share_corners_with_the_same_normal() {
    for content in [OBJ.to_owned(), OBJ.replace('\n', "\r\n"), OBJ.replace('\n', "\r"), format!("\u{feff}{OBJ}")] {
        let mesh = mesh("a.obj", content.as_bytes());
        assert_eq!(mesh.position, [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.5]].map(Vec3::from));
        assert_eq!(mesh.normal, [Vec3::Z; 4]);
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3], [0, 2, 3]]);
    }
    let plain = "v 0 0 0 1 0 0\nv 1 0 0 0 1 0\nv 0 1 0 0 0 1\nf 1 2 3\n";
    let loaded = mesh("a.obj", plain.as_bytes());
    assert_eq!((loaded.normal.len(), loaded.color[1]), (0, [0.0, 1.0, 0.0]));
    // A concave face, from its second corner on.
    let arrow = "v 4 0 0\nv -2 3 0\nv 1 0 0\nv -2 -3 0\nf 1 2 3 4\n";
    let loaded = mesh("a.obj", arrow.as_bytes());
    assert!(loaded.triangles.iter().all(|t| t.contains(&0) && t.contains(&2)), "{:?}", loaded.triangles);
    assert_eq!(points("a.obj", "v 1 2 3\nv 4 5 6\n").position, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
    refused("a.obj", "", "a.obj@0: expected vertices or points, found an empty file");
}

#[test]
fn ba11_obj_indices_are_checked() {
    let face = |f: &str| format!("v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf {f}\n");
    for (f, beginning) in [
        ("0 1 2", "a.obj:5:3: expected an index from 1 to 3, or from -3 to -1: there are 3 vertices so far, found '0'"),
        ("1 2 -4", "a.obj:5:7: expected an index from 1 to 3"),
        ("1 2 4", "a.obj:5:7: expected an index from 1 to 3"),
        ("1//1 2//2 3//1", "a.obj:5:8: expected an index from 1 to 1, or from -1 to -1: there are 1 normals"),
        ("1 2 99999999999999999999", "a.obj:5:7: expected an index"),
        ("1 2 -9223372036854775808", "a.obj:5:7: expected an index"),
        ("1 2 x", "a.obj:5:7: expected an index"),
        ("1 2 3/1/1/1", "a.obj:5:7: expected v, v/vt, v//vn or v/vt/vn"),
    ] {
        refused("a.obj", face(f), beginning);
    }
    refused("a.obj", "f 1 2 3\nv 0 0 0\n", "a.obj:1:3: expected an index from 1 to 0");
    refused("a.obj", "v 0 0\n", "a.obj:1:1: expected v X Y Z, or v X Y Z R G B, found 2 numbers");
    refused("a.obj", "v 0 0 1e999\n", "a.obj:1:7: expected a finite decimal number, found '1e999'");
    refused("a.obj", "v 0 0 0 2 0 0\n", "a.obj:1:9: expected a colour from 0 to 1, found '2'");
    refused("a.obj", "hello\n", "a.obj:1:1: expected a statement of OBJ such as v, vn or f, found 'hello'");
    refused("a.obj", "v 0 0 \\\n0\n", "a.obj:1: expected vertices and faces on one line");
    // A face of a million corners, all of them there: a fan of triangles without area, within the limit.
    let many = format!("v 0 0 0\nf{}\n", " 1".repeat(500_000));
    assert_eq!(mesh("a.obj", many.as_bytes()).triangles.len(), 499_998);
    let limits = ReadParams { memory: MemoryAccount::new(2 << 20), ..ReadParams::default() };
    assert_eq!(bytes("a.obj", many.as_bytes(), &limits, None).unwrap_err().fault, Fault::Limit);
    let long = format!("v 0 0 0\nf{}\n", " 1".repeat(600_000));
    refused("a.obj", long, "a.obj:2: expected a line of at most 1 MiB");
}

#[test]
fn points_as_text_with_and_without_names() {
    let p = points("a.xyz", "# made by hand\n1 2 3\n4\t5  6\n");
    assert_eq!(p.position, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
    let p = points("a.csv", "Z;\"Intensity\";X;extra;Y;Red;Green;Blue\n3;0.5;1;9;2;255;0;0\n6;1.5;4;9;5;0;128;0\n");
    assert_eq!(p.position, [Vec3::new(1.0, 2.0, 3.0), Vec3::new(4.0, 5.0, 6.0)]);
    assert_eq!((p.value, p.color[0]), (vec![0.5, 1.5], [1.0, 0.0, 0.0]));
    assert!((p.color[1][1] - 0.215_860_5).abs() < 1e-6);
    assert_eq!(points("a.xyz", "0 0 0 0 0.6 0.8\n1 0 0 0 0 2\n").normal, [Vec3::new(0.0, 0.6, 0.8), Vec3::Z]);
    assert_eq!(points("a.txt", "0 0 0 7\n").value, [7.0]);
    assert_eq!(points("a.xyz", "0 0 0 255 255 255\n").color, [[1.0; 3]]);
    let p = points("a.pts", "2\n0 0 0 -900 0 0 255\n1 1 1 5 0 0 0\n");
    assert_eq!((p.value, p.color[0]), (vec![-900.0, 5.0], [0.0, 0.0, 1.0]));
    let far = points("a.xyz", "1e7 1e7 1e7\n10000001 1e7 1e7\n");
    assert!((far.exact_position(1) - DVec3::new(10_000_001.0, 1e7, 1e7)).length() < 1e-6);
    assert!(points("a.csv", "x,y,z\n").is_empty());
    refused("a.xyz", "1 2 3\n4 5\n", "a.xyz:2: expected 3 columns, found 2");
    refused("a.xyz", "1 2 3\n4 nan 6\n", "a.xyz:2:3: expected a finite decimal number, found 'nan'");
    refused("a.csv", "x,y,intensity\n1,2,3\n", "a.csv:1: expected columns x, y and z; 'z' is missing");
    refused("a.csv", "x,y,z,X\n1,2,3,4\n", "a.csv:1: expected one column 'x', found several");
    refused("a.xyz", "1 2 3 4 5\n", "a.xyz:1: expected 3, 4, 6 or 7 columns");
    let hint = |content: &str| load("a.xyz", content.as_bytes()).unwrap_err().hint;
    assert!(hint(&"1 ".repeat(256)).starts_with("a grid of heights has to become points"));
    assert!(hint("2\nwater\nO 0 0 0\nH 0 0 1\n").starts_with("of an XMol file of atoms"));
    // Other names of the coordinates count where no column has the usual one.
    let of_survey = points("a.csv", "name,x_utm,y_utm,altitude\na,1,2,3\n");
    assert_eq!(of_survey.position[0].as_dvec3() + of_survey.origin, DVec3::new(1.0, 2.0, 3.0));
    let both = points("a.csv", "x,y,z,altitude\n1,2,3,9\n");
    assert_eq!(both.position[0].as_dvec3() + both.origin, DVec3::new(1.0, 2.0, 3.0));
    refused("a.xyz", "0 0 0 255 255 255\n0 0 0 256 0 0\n", "a.xyz:2:7: expected a colour from 0 to 255, found '256'");
    refused("a.pts", "3\n1 2 3\n4 5 6\n", "a.pts:1: expected 3 points, as announced, found 2 points");
    refused("a.xyz", "hello\n1 2 3\n", "a.xyz:1:1: expected x, y and z, names of columns, or a number of points");
    refused("a.xyz", "1 2 3\n4 5 1e308\n", "a.xyz: expected coordinates that fit 32-bit floats");
    let limits = ReadParams { drop_invalid: true, ..ReadParams::default() };
    let Loaded::Points(p) = bytes("a.xyz", b"1 2 3\n4 nan 6\n7 8 inf\n1 1 1\n", &limits, None).unwrap().0 else {
        panic!()
    };
    assert_eq!((p.len(), p.dropped), (2, 2));
    assert!(bytes("a.xyz", b"1 2 3\n4 x 6\n", &limits, None).is_err());
}

#[test]
fn nrrd_volumes_of_all_encodings_and_types() {
    let expected = [0.0, 300.0, 600.0, 900.0, 1200.0, 1500.0];
    let packed = NRRD.replace("raw", "gz");
    let text = NRRD.replace("raw", "ascii").replace("uint16", "double");
    for content in [
        nrrd(NRRD, &voxels()),
        nrrd(&packed, &gzip(&voxels())),
        nrrd(&text, b"0 300 600\n900,1.2e3\t1500"),
        nrrd(&NRRD.replace("\n\n", "\nline skip: 2\nbyte skip: 3\n\n"), &[b"a\nb\nxyz", voxels().as_slice()].concat()),
        nrrd(&NRRD.replace("\n\n", "\nbyteskip: -1\n\n"), &[b"anything", voxels().as_slice()].concat()),
        gzip(&nrrd(NRRD, &voxels())),
    ] {
        let grid = grid(&content);
        assert_eq!((grid.dims, grid.values.as_slice()), ([2, 3, 1], expected.as_slice()));
        assert_eq!(
            (grid.origin, grid.axes),
            (DVec3::new(1.0, 2.0, 3.0), DMat3::from_diagonal(DVec3::new(2.0, -1.0, 3.0)))
        );
    }
    let plain =
        "NRRD0001\ntype: float\ndimension: 3\nsizes: 1 2 1\nspacings: 0.5 nan 2\nendian: little\nencoding: raw\n\n";
    let data: Vec<u8> = [1.5f32, -2.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let found = grid(&nrrd(plain, &data));
    assert_eq!((found.values, found.axes.diagonal()), (vec![1.5, -2.0], DVec3::new(0.5, 1.0, 2.0)));
    for (kind, data) in [
        ("signed char", vec![255, 1]),
        ("short", [-1i16, 1].iter().flat_map(|v| v.to_le_bytes()).collect()),
        ("int32_t", [-1i32, 1].iter().flat_map(|v| v.to_le_bytes()).collect()),
        ("long long", [-1i64, 1].iter().flat_map(|v| v.to_le_bytes()).collect()),
        ("double", [-1f64, 1.0].iter().flat_map(|v| v.to_le_bytes()).collect()),
    ] {
        assert_eq!(grid(&nrrd(&plain.replace("float", kind), &data)).values, [-1.0, 1.0], "{kind}");
    }
}

#[test]
fn ba14_nrrd_sizes_are_checked_against_the_data() {
    let bad = |from: &str, to: &str| nrrd(&NRRD.replace(from, to), &voxels());
    refused("a.nrrd", bad("2 3 1", "2 3 2"), "a.nrrd@189: expected 24 bytes of voxels (2 x 3 x 2 x 2 bytes), found 12");
    refused("a.nrrd", bad("uint16", "float"), "a.nrrd@188: expected 24 bytes of voxels");
    for sizes in ["2 0 3", "2 -3 1", "2 3", "2 3 1 1", "2 3 x", ""] {
        refused("a.nrrd", bad("2 3 1", sizes), "a.nrrd:5: expected three sizes above 0");
    }
    let huge = "4294967296 4294967296 4294967296";
    refused("a.nrrd", bad("2 3 1", huge), "a.nrrd:5: expected at most 2^45 voxels, found [4294967296,");
    let large = load("a.nrrd", &bad("2 3 1", "100000 100000 100")).unwrap_err();
    assert_eq!(large.fault, Fault::Limit, "{large}");
    refused("a.nrrd", bad("dimension: 3", "dimension: 5"), "a.nrrd:4: expected dimension: 3 or 4, found 5");
    refused("a.nrrd", bad("uint16", "block"), "a.nrrd:3: expected a type of real scalars");
    refused("a.nrrd", bad("encoding: raw", "encoding: bzip2"), "a.nrrd:10: expected encoding raw, gzip or text");
    refused("a.nrrd", bad("endian: big\n", ""), "a.nrrd:12: expected a field 'endian', found none");
    refused("a.nrrd", bad("sizes: 2 3 1\n", ""), "a.nrrd:12: expected a field 'sizes', found none");
    refused("a.nrrd", bad("key:=value", "sizes: 2 3 1"), "a.nrrd:6: expected each field once");
    refused("a.nrrd", bad("(0,-1,0)", "(2,0,0)"), "a.nrrd:8: expected three independent finite steps");
    refused("a.nrrd", bad("(0,-1,0)", "none"), "a.nrrd:8: expected three vectors");
    refused("a.nrrd", bad("(1,2,3)", "(1,2,nan)"), "a.nrrd:9: expected an origin such as (0,0,0)");
    refused("a.nrrd", bad("NRRD0004", "NRRD0009"), "a.nrrd@0: expected 'NRRD0001' to 'NRRD0005'");
    let text = NRRD.replace("raw", "text");
    refused("a.nrrd", nrrd(&text, b"1 2 3 4 5"), "a.nrrd: expected 6 voxels, found 5");
    let infinite: Vec<u8> = (0..6).flat_map(|i| if i == 4 { f32::INFINITY } else { 1.0 }.to_be_bytes()).collect();
    refused("a.nrrd", nrrd(&NRRD.replace("uint16", "float"), &infinite), "a.nrrd@204: expected values that fit");
}

#[test]
fn ba15_a_bomb_inside_an_nrrd_stops_at_the_cap() {
    let header = NRRD.replace("raw", "gzip").replace("uint16", "uchar").replace("2 3 1", "1024 1024 1024");
    let bomb = gzip(&vec![0; 64 << 20]);
    let error = load("a.nrrd", &nrrd(&header, &bomb)).unwrap_err();
    assert_eq!((error.fault, error.fault.exit_code()), (Fault::Limit, 5), "{error}");
    // More than the header announces is noticed at the first byte, not unpacked.
    let more = nrrd(&NRRD.replace("raw", "gzip"), &gzip(&vec![0; 2 << 20]));
    refused("a.nrrd", more, "a.nrrd@0: expected 12 bytes of voxels (2 x 3 x 1 x 2 bytes), found more than 12");
}

#[test]
fn ba16_detached_data_lies_in_the_headers_folder() {
    let folder: PathBuf = Path::new(env!("CARGO_TARGET_TMPDIR")).join("ba16");
    std::fs::create_dir_all(folder.join("sub")).unwrap();
    std::fs::write(folder.join("../ba16.raw"), voxels()).unwrap();
    std::fs::write(folder.join("data.raw"), voxels()).unwrap();
    std::fs::write(folder.join("sub/data.raw.gz"), gzip(&voxels())).unwrap();
    let _ = std::fs::remove_file(folder.join("link.raw"));
    std::os::unix::fs::symlink("../ba16.raw", folder.join("link.raw")).unwrap();
    let header = |name: &str, encoding: &str| {
        let text = NRRD.replace("encoding: raw", &format!("encoding: {encoding}\ndata file: {name}"));
        let path = folder.join("a.nhdr");
        std::fs::write(&path, text.trim_end()).unwrap();
        file(&path, &ReadParams::default(), None)
    };
    for (name, encoding) in [("data.raw", "raw"), ("./data.raw", "raw"), ("sub/data.raw.gz", "gzip")] {
        let Ok((Loaded::Grid(grid), _)) = header(name, encoding) else { panic!("{name}") };
        assert_eq!(grid.values[5], 1500.0);
    }
    let absolute = folder.join("data.raw");
    for (name, expected) in [
        ("../ba16.raw", "the data: a file in the same folder or below"),
        (absolute.to_str().unwrap(), "the data: a file in the same folder or below"),
        ("sub/../data.raw", "the data: a file in the same folder or below"),
        ("link.raw", "the data: a file in the same folder or below, links followed"),
        ("a.nhdr", "a data file that is not the header itself"),
        ("https://example.org/data.raw", "the data: a file in the same folder or below"),
        ("slice%03d.raw 1 9 1", "one data file in the header's folder"),
        ("LIST", "one data file in the header's folder"),
    ] {
        let error = header(name, "raw").unwrap_err();
        assert_eq!((error.fault, error.expected.as_str()), (Fault::Input, expected), "{name}: {error}");
        assert!(error.to_string().contains("a.nhdr:11: "), "{error}");
    }
    assert_eq!(header("missing.raw", "raw").unwrap_err().fault, Fault::FileSystem);
    assert_eq!(header("sub", "raw").unwrap_err().fault, Fault::FileSystem);
    let in_memory = NRRD.replace("encoding", "data file: data.raw\nencoding");
    refused("a.nhdr", in_memory, "a.nhdr:10: expected the data: all of it in one file");
}
