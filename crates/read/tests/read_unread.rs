//! Formats that are not read are named by what they are, with what to do.

use crate::read_samples::load;
use read::Fault;

#[test]
fn formats_that_are_not_read_are_named_with_what_to_do() {
    let tar = [&[b'a'; 257][..], b"ustar\0"].concat();
    for (name, content, found, hint) in [
        ("a.fbx", &b"Kaydara FBX Binary  \0"[..], "FBX", "convert it to glTF"),
        ("a.FBX", b"; FBX 7.3.0 project file", "FBX", "convert it to glTF"),
        ("a.usdz", b"PK\x03\x04....", "USD", "convert it to glTF"),
        ("a.usda", b"#usda 1.0", "USD", "convert it to glTF"),
        ("a.dae", b"<?xml version=\"1.0\"?>", "COLLADA", "convert it to glTF"),
        ("a.3ds", b"MM\x10\0", "3DS", "convert it to glTF"),
        ("a.x3d", b"<?xml", "X3D or VRML", "convert it to glTF"),
        ("a.step", b"ISO-10303-21;", "STEP", "export it as STL, OBJ or glTF"),
        ("a.vdb", b" BDV\0\0\0\0", "OpenVDB", "convert it to NRRD"),
        ("a.ptx", b"4\n4\n", "PTX", "convert it to PLY"),
        ("a.h5", b"\x89HDF\r\n\x1a\n", "HDF5", "convert it to NRRD"),
        ("a.jpg", b"\xff\xd8\xff\xe0", "a JPEG image", "convert the image"),
        ("a.zip", b"PK\x03\x04", "a zip archive", "extract"),
        ("a.tar.gz", &tar, "a tar archive", "extract"),
        ("lod-meta.json", b"{\"lodLevels\": 3}", "a streamed scene of SOG parts", "name the meta.json"),
        (
            "index.json",
            b"{\"origin\": [0, 0, 0], \"vtkClass\": \"vtkImageData\"}",
            "a data set of vtk.js",
            "copy the one of an image",
        ),
        ("a.mtl", b"newmtl a", "OBJ materials", "give the OBJ file"),
        ("scene.toml", b"[camera]", "a scene", "organza render"),
        // The content counts, whatever the name says.
        ("a.obj", b"\xff\xd8\xff", "a JPEG image", "convert the image"),
        ("a", b"PK\x03\x04", "a zip archive", "extract"),
    ] {
        let error = load(name, content).unwrap_err();
        assert_eq!((error.fault, error.fault.exit_code()), (Fault::Input, 3));
        let beginning =
            format!("{name}: expected a file of a format that is read, found {found}, which is not read\nhint: ");
        assert!(error.to_string().starts_with(&beginning), "{error}");
        assert!(error.hint.contains(hint), "{error}");
    }
}

/// A data set of vtk.js is a folder with an index: both have the same message, which does not lead from one to the other.
#[test]
fn a_folder_of_vtk_js_is_named_once() {
    let folder = std::env::temp_dir().join(format!("organza-vtk-js-{}.vti", std::process::id()));
    std::fs::create_dir_all(folder.join("data")).unwrap();
    let index = folder.join("index.json");
    std::fs::write(&index, r#"{"vtkClass": "vtkImageData", "extent": [0, 1, 0, 1, 0, 1]}"#).unwrap();
    let said = |path: &std::path::Path| {
        let error = read::file(path, &read::ReadParams::default(), None).unwrap_err();
        assert_eq!(error.fault, Fault::Input);
        (error.found, error.hint)
    };
    let (found, hint) = said(&folder);
    assert_eq!(found, "a data set of vtk.js, which is not read");
    assert_eq!(said(&index), (found, hint));
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn text_in_utf_16_is_called_so() {
    for (name, big_endian) in [("a.obj", true), ("a.ply", false), ("a.xyz", false), ("a.stl", true)] {
        let bytes = |c: u16| if big_endian { c.to_be_bytes() } else { c.to_le_bytes() };
        let content: Vec<u8> = std::iter::once(0xfeff).chain("# v 0 0 0\n".encode_utf16()).flat_map(bytes).collect();
        let error = load(name, &content).unwrap_err().to_string();
        assert!(error.contains("expected text in UTF-8, found text in UTF-16"), "{error}");
        assert!(error.contains("iconv -f UTF-16"), "{error}");
    }
}
