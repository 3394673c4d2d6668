//! Bad inputs by their number in the list of required behaviours: refused with place, expectation and finding.
#![cfg(all(feature = "ply", feature = "nifti", feature = "las"))]

use crate::read_samples::{NIFTI_F32, NIFTI_U8, gzip, las, load, nifti, ply_ascii, ply_binary};
use read::{Fault, Place, ReadError, ReadParams, bytes, file};
use splat_core::MemoryAccount;
use splat_core::text::escaped_path;
use std::path::{Path, PathBuf};

fn refused(name: &str, content: &[u8]) -> ReadError {
    match load(name, content) {
        Err(error) => error,
        Ok(loaded) => panic!("{name} was accepted: {loaded:?}"),
    }
}

/// Refused as bad input, with a message that begins so.
#[track_caller]
fn refused_with(name: &str, content: &[u8], beginning: &str) {
    let error = refused(name, content);
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().starts_with(beginning), "{error}");
    assert!(error.to_string().contains("\nhint: "), "{error}");
}

fn folder(name: &str) -> PathBuf {
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(&path).unwrap();
    path
}

fn opened(path: &Path) -> ReadError {
    file(path, &ReadParams::default(), None).unwrap_err()
}

#[test]
fn ba01_missing_files_directories_pipes_and_devices_are_the_file_systems_fault() {
    let folder = folder("ba01");
    let pipe = folder.join("pipe.ply");
    let _ = std::fs::remove_file(&pipe);
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    for (path, found) in [
        (folder.join("missing.ply"), "no such file"),
        (folder.clone(), "a directory"),
        (pipe, "a pipe, socket or device"),
        (PathBuf::from("/dev/zero"), "a pipe, socket or device"),
    ] {
        let error = opened(&path);
        assert_eq!((error.fault, error.fault.exit_code()), (Fault::FileSystem, 4), "{error}");
        assert!(error.found.contains(found), "{error}");
        assert_eq!(error.file, path.to_str().unwrap());
    }
}

#[test]
fn ba02_empty_one_byte_and_header_only() {
    refused_with("a.ply", b"", "a.ply@0: expected 'ply' at byte 0, found an empty file");
    refused_with("a.ply", b"p", "a.ply@0: expected 'ply' at byte 0, found 'p'");
    refused_with("a.nii", b"", "a.nii@0: expected a header of 348 bytes, found 0 bytes");
    refused_with("a.laz", b"L", "a.laz@0: expected 'LASF'");
    refused_with(
        "a.dat",
        b"1 2 3",
        "a.dat@0: expected a file of a format that is read, found a text of a format that neither its name nor its beginning tells",
    );
    let text = ply_ascii();
    let header = text.split_inclusive("end_header\n").next().unwrap();
    refused_with("a.ply", header.as_bytes(), "a.ply:4: expected at most");
    refused_with("a.ply", b"ply\nformat ascii 1.0\n", "a.ply:3: expected end_header, found the end of the file");
}

#[test]
fn ba03_counts_that_no_file_can_hold() {
    for (count, expected) in [
        ("4294967296", "at most "),
        ("18446744073709551615", "at most "),
        ("-1", "a whole number of elements"),
        ("1e309", "a whole number of elements"),
        ("18446744073709551616", "a whole number of elements"),
    ] {
        for text in [ply_ascii(), String::from_utf8_lossy(&ply_binary(false)).into_owned()] {
            let text = text.replace("vertex 4", &format!("vertex {count}"));
            refused_with("a.ply", text.as_bytes(), &format!("a.ply:4: expected {expected}"));
            let text = text.replace(&format!("vertex {count}"), "vertex 4");
            let text = text.replace("face 2", &format!("face {count}"));
            assert_eq!(refused("a.ply", text.as_bytes()).fault, Fault::Input);
        }
    }
    let elements = "ply\nformat ascii 1.0\nelement nothing 18446744073709551615\nelement vertex 0\nproperty float x\n\
        property float y\nproperty float z\nend_header\n";
    load("a.ply", elements.as_bytes()).unwrap();
}

#[test]
fn ba04_a_list_longer_than_the_file() {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 0\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uint int vertex_indices\nend_header\n";
    let content = [header.as_bytes(), &[0xff; 4]].concat();
    let beginning = format!("a.ply@{}: expected a list of at most 0 entries", header.len());
    refused_with("a.ply", &content, &beginning);
    let negative = header.replace("list uint", "list int");
    refused_with("a.ply", &[negative.as_bytes(), &[0xff; 4]].concat(), "a.ply@");
}

#[test]
fn ba06_face_indices_outside_the_vertices() {
    for index in ["4", "-1", "4294967295"] {
        let text = ply_ascii().replace("1 3 0 2 3", &format!("1 3 0 2 {index}"));
        let error = refused("a.ply", text.as_bytes());
        assert_eq!(error.fault, Fault::Input);
        let line = text.lines().count() as u64;
        assert_eq!(error.place, Place::Line { line, column: 9 }, "{error}");
    }
    let text = ply_ascii().replace("1 3 0 2 3", "1 3 0 2 4");
    let error = refused("a.ply", text.as_bytes());
    assert!(error.expected.contains("a vertex of face 1 from 0 to 3"), "{error}");
    // Corners of a face that is left out are looked at too.
    let text = ply_ascii().replace("1 3 0 2 3", "1 2 0 4");
    assert!(refused("a.ply", text.as_bytes()).expected.contains("a vertex of face 1 from 0 to 3"));
}

#[test]
fn ba07_headers_that_make_no_sense() {
    let with = |from: &str, to: &str| ply_ascii().replacen(from, to, 1);
    let cases = [
        (with("float x", "float X"), "a.ply:4: expected a property 'x' of 'vertex'"),
        (with("float z", "float x"), "a.ply:9: expected each property name once"),
        (with("float x", "floot x"), "a.ply:6: expected char, uchar"),
        (with("float x", "list uchar float x"), "a.ply:6: expected one number for each coordinate, found a list"),
        (with("list uchar int", "list float int"), "a.ply:20: expected list with an integer count type"),
        (with("list uchar int", "list uchar float"), "a.ply:20: expected a list of integers"),
        (with("element camera", "element vertex"), "a.ply:16: expected each element name once"),
        (with("ascii 1.0", "ascii 2.0"), "a.ply:2: expected version 1.0"),
        (with("format ascii 1.0\n", ""), "a.ply:20: expected a format line"),
        (with("comment", "property float q\ncomment"), "a.ply:3: expected an element before its properties"),
        (with("vertex_indices", "corners"), "a.ply:18: expected a list 'vertex_indices'"),
    ];
    for (text, beginning) in cases {
        refused_with("a.ply", text.as_bytes(), beginning);
    }
}

#[test]
fn ba09_numbers_that_are_none() {
    for (word, expected) in
        [("nan", "a finite"), ("inf", "a finite"), ("1e999", "a finite"), ("0x10", "a decimal"), ("1,5", "a decimal")]
    {
        let text = ply_ascii().replace("20 1 2", &format!("20 {word} 2"));
        refused_with("a.ply", text.as_bytes(), &format!("a.ply:24:4: expected {expected} number, found '{word}'"));
    }
    refused_with("a.ply", (ply_ascii() + "7\n").as_bytes(), "a.ply:29:1: expected the end of the file");
    let text = ply_ascii().replace("0 2 255 128 -7", "0 2 255 128 -7 9");
    refused_with("a.ply", text.as_bytes(), "a.ply:22:28: expected the end of the line, found '9'");
}

#[test]
fn ba17_las_headers_that_contradict_themselves() {
    let at = |format: u8, byte: usize, bytes: &[u8]| {
        let mut content = las(format, 5, false);
        content[byte..byte + bytes.len()].copy_from_slice(bytes);
        content
    };
    refused_with("a.las", &at(7, 107, &4u32.to_le_bytes()), "a.las@107: expected one number of points");
    refused_with("a.las", &at(3, 107, &6u32.to_le_bytes()), "a.las@227: expected 6 points of 34 bytes, found 5");
    refused_with("a.las", &at(3, 107, &4u32.to_le_bytes()), "a.las@107: expected 4 points");
    refused_with("a.las", &at(3, 107, &u32::MAX.to_le_bytes()), "a.las@227: expected 4294967295 points");
    refused_with("a.las", &at(7, 247, &u64::MAX.to_le_bytes()), "a.las@");
    refused_with("a.las", &at(3, 96, &u32::MAX.to_le_bytes()), "a.las@94: expected points after the header");
    refused_with("a.las", &at(3, 105, &3u16.to_le_bytes()), "a.las@105: expected records of at least 34 bytes");
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e308] {
        refused_with("a.las", &at(3, 131, &scale.to_le_bytes()), "a.las@131: expected scales > 0");
    }
}

#[test]
fn ba18_one_nan_vertex_or_infinite_voxel_is_named() {
    let mut content = ply_binary(false);
    let body = content.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
    content[body + 1..body + 5].copy_from_slice(&f32::NAN.to_le_bytes());
    refused_with("a.ply", &content, &format!("a.ply@{}: expected a finite number, found NaN", body + 1));
    let mut content = nifti(NIFTI_F32, false);
    content[352 + 8..352 + 12].copy_from_slice(&f32::INFINITY.to_le_bytes());
    refused_with("a.nii", &content, "a.nii@360: expected values that fit 32-bit floats, found inf at voxel 2");
}

#[test]
fn ba19_coordinates_beyond_f32() {
    let text = ply_ascii().replace("property float x", "property double x").replace("20 1 2", "20 1e308 2");
    refused_with("a.ply", text.as_bytes(), "a.ply:4: expected coordinates that fit 32-bit floats");
}

#[test]
fn ba21_ba22_normals_and_colours_out_of_range() {
    refused_with("a.ply", ply_ascii().replace("0 0 2 255", "0 nan 2 255").as_bytes(), "a.ply:22:");
    for word in ["300", "-1"] {
        let text = ply_ascii().replacen("2 255 128", &format!("2 {word} 128"), 1);
        refused_with("a.ply", text.as_bytes(), "a.ply:22:");
        assert!(refused("a.ply", text.as_bytes()).expected.contains("from 0 to 255"));
    }
    let text = ply_ascii().replace("uchar green", "float green").replacen("2 255 128", "2 1.0001 128", 1);
    assert!(refused("a.ply", text.as_bytes()).expected.contains("a colour from 0 to 1"));
}

#[test]
fn ba14_voxels_that_do_not_fill_the_file_exactly() {
    let good = nifti(NIFTI_U8, false);
    refused_with("a.nii", &good[..363], "a.nii@352: expected 12 bytes of voxels (3 x 2 x 2 x 1 bytes), found 11");
    refused_with(
        "a.nii",
        &[&good[..], &[0]].concat(),
        "a.nii@352: expected 12 bytes of voxels (3 x 2 x 2 x 1 bytes), found 13",
    );
    let mut dims = good.clone();
    for d in 1..=3 {
        dims[40 + 2 * d..42 + 2 * d].copy_from_slice(&32767i16.to_le_bytes());
    }
    refused_with("a.nii", &dims, "a.nii@352: expected 35181150961663 bytes of voxels");
    for d in [0i16, -1] {
        let mut dims = good.clone();
        dims[42..44].copy_from_slice(&d.to_le_bytes());
        refused_with("a.nii", &dims, "a.nii@40: expected dimensions from 1 to 32767");
    }
    for (offset, _) in [(f32::NAN, 0), (-1.0, 0), (1e30, 0), (352.5, 0), (365.0, 0)] {
        let mut content = good.clone();
        content[108..112].copy_from_slice(&offset.to_le_bytes());
        refused_with("a.nii", &content, "a.nii@108: expected an offset of the voxels");
    }
}

#[test]
fn ba15_gzip_bombs_stop_at_the_ratio_and_at_the_limit() {
    let bomb = gzip(&vec![b' '; 40 << 20]);
    let error = refused("a.xyz.gz", &bomb);
    assert_eq!((error.fault, error.fault.exit_code()), (Fault::Limit, 5), "{error}");
    let limits = ReadParams { memory: MemoryAccount::new(1 << 20), ..ReadParams::default() };
    let error = bytes("a.xyz.gz", &gzip(&vec![b' '; 2 << 20]), &limits, None).unwrap_err();
    assert_eq!(error.fault, Fault::Limit, "{error}");
    // A volume's header comes first: what it does not announce is not unpacked.
    refused_with("a.nii.gz", &bomb, "a.nii.gz@0: expected a header size of 348");
    let volume = nifti(NIFTI_U8, false);
    assert_eq!(
        bytes("a.nii", &volume, &ReadParams { memory: MemoryAccount::new(47), ..limits.clone() }, None)
            .unwrap_err()
            .fault,
        Fault::Limit
    );
    assert!(bytes("a.nii", &volume, &ReadParams { memory: MemoryAccount::new(48), ..limits.clone() }, None).is_ok());
    let cloud = las(3, 100, true);
    let error = bytes("a.laz", &cloud, &ReadParams { memory: MemoryAccount::new(3_000), ..limits }, None).unwrap_err();
    assert_eq!(error.fault, Fault::Limit, "{error}");
}

#[test]
fn ba34_names_with_newlines_escapes_and_bytes_are_shown_escaped() {
    let folder = folder("ba34");
    let path = folder.join("a\nb\u{1b}[31m\u{202e}.ply");
    std::fs::write(&path, "ply\n\u{1b}]0;title\u{7}").unwrap();
    let message = opened(&path).to_string();
    assert!(message.contains("a\\nb\\u{1b}[31m\\u{202e}.ply"), "{message}");
    assert_eq!(message.chars().filter(|c| c.is_control()).count(), 1, "only the line end before the hint: {message}");
    #[cfg(unix)]
    {
        use std::os::unix::ffi::OsStrExt;
        let path = folder.join(std::ffi::OsStr::from_bytes(b"x\xff.ply"));
        std::fs::write(&path, ply_ascii()).unwrap();
        file(&path, &ReadParams::default(), None).unwrap();
        assert!(escaped_path(&path).ends_with("x\\xff.ply"));
    }
    let long = opened(&folder.join("n".repeat(4096)));
    assert_eq!(long.fault, Fault::FileSystem);
}

#[test]
fn ba35_a_file_that_is_longer_or_shorter_than_announced_is_noticed() {
    // A file of the kernel announces 0 bytes and has some: the same as one that grows after it was measured.
    let error = opened(Path::new("/proc/self/status"));
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.found.contains("changed while it was read"), "{error}");
}

#[test]
fn a_limit_on_the_file_is_checked_before_it_is_read() {
    let folder = folder("limit");
    let path = folder.join("sparse.ply");
    std::fs::File::create(&path).unwrap().set_len(1 << 40).unwrap();
    let error = opened(&path);
    assert_eq!(error.fault, Fault::Limit, "{error}");
    std::fs::remove_file(&path).unwrap();
}
