//! What readers say is true and names a way out; what files of other programs have beside their data does not stop them from being read.
#![cfg(all(feature = "gltf", feature = "vti", feature = "vtk", feature = "las"))]

use crate::read_samples::{las, load, pcd, stl};
use read::{Fault, Loaded, Notes, ReadError, ReadParams, bytes, file};
use splat_core::{Grid, RawPoints};
use std::path::PathBuf;

fn read(name: &str, content: &[u8]) -> (Loaded, Notes) {
    bytes(name, content, &ReadParams::default(), None).unwrap_or_else(|e| panic!("{e}"))
}

fn grid(name: &str, content: &[u8]) -> (Grid, Notes) {
    match read(name, content) {
        (Loaded::Grid(grid), notes) => (grid, notes),
        other => panic!("no volume: {other:?}"),
    }
}

fn points(name: &str, content: &[u8]) -> (RawPoints, Notes) {
    match read(name, content) {
        (Loaded::Points(points), notes) => (points, notes),
        other => panic!("no points: {other:?}"),
    }
}

fn error(name: &str, content: &[u8]) -> ReadError {
    load(name, content).unwrap_err()
}

/// PCL fills what it writes up to whole pages of memory.
#[test]
fn zeros_behind_the_points_of_a_pcd_are_padding_and_other_bytes_are_none() {
    for data in ["binary", "binary_compressed"] {
        let exact = pcd(data);
        let padded = [&exact[..], &[0; 4000]].concat();
        assert_eq!(load("a.pcd", &padded).unwrap(), load("a.pcd", &exact).unwrap(), "{data}");
        let longer = error("a.pcd", &[&exact[..], &[0, 7]].concat());
        assert!(longer.hint.contains("holds") && !longer.hint.contains("truncated"), "{data}: {longer}");
        let shorter = error("a.pcd", &exact[..exact.len() - 1]);
        assert!(shorter.hint.contains("truncated"), "{data}: {shorter}");
    }
    let more =
        [pcd("ascii"), pcd("ascii").split(|b| *b == b'\n').next_back().unwrap().to_vec(), b"1 2 3\n".to_vec()].concat();
    assert!(!error("a.pcd", &more).hint.contains("truncated"));
}

#[test]
fn what_is_longer_than_announced_is_not_called_truncated() {
    let volume = |bytes: usize| {
        let header = b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 2 2 2\nencoding: raw\n\n";
        [&header[..], &vec![1; bytes]].concat()
    };
    assert!(load("a.nrrd", &volume(8)).is_ok());
    let las = las(0, 4, false);
    for (name, longer, shorter) in [
        ("a.nrrd", volume(9), volume(7)),
        ("a_2x2x2_uint8.raw", vec![1; 9], vec![1; 7]),
        ("a.stl", [stl(true), vec![1; 80]].concat(), stl(true)[..100].to_vec()),
        ("a.las", [las.clone(), vec![0; 80]].concat(), las[..las.len() - 1].to_vec()),
        ("a.xyz", b"1\n0 0 0\n1 1 1\n".to_vec(), b"3\n0 0 0\n1 1 1\n".to_vec()),
    ] {
        let longer = error(name, &longer);
        let shorter = error(name, &shorter);
        assert!(!longer.hint.contains("truncated") && longer.hint.contains("than"), "{longer}");
        assert!(shorter.hint.contains("truncated"), "{shorter}");
    }
}

#[test]
fn another_version_of_las_is_named_and_not_called_damaged() {
    let mut content = las(6, 4, false);
    content[25] = 5;
    let refused = error("a.las", &content);
    assert_eq!((refused.expected.as_str(), refused.found.as_str()), ("LAS version 1.0 to 1.4", "1.5"));
    assert!(refused.hint.contains("LAS 1.4") && !refused.hint.contains("truncated"), "{refused}");
}

/// Voxels that are NaN, in bytes and in texts.
#[test]
fn voxels_without_a_value_are_read_and_counted() {
    let head = |kind: &str, encoding: &str| {
        format!("NRRD0004\ntype: {kind}\ndimension: 3\nsizes: 2 2 1\nendian: little\nencoding: {encoding}\n\n")
    };
    let raw: Vec<u8> = [1.0f32, f32::NAN, 3.0, f32::NAN].iter().flat_map(|v| v.to_le_bytes()).collect();
    let vtk = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 2 1\nORIGIN 0 0 0\n\
               SPACING 1 1 1\nPOINT_DATA 4\nSCALARS s float 1\nLOOKUP_TABLE default\n1 nan 3 nan\n";
    let vti = "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\"><ImageData WholeExtent=\"0 1 0 1 0 0\" Spacing=\"1 1 1\">\
               <Piece Extent=\"0 1 0 1 0 0\"><PointData><DataArray type=\"Float32\" Name=\"s\" format=\"ascii\">1 nan 3 NaN\
               </DataArray></PointData></Piece></ImageData></VTKFile>";
    for (name, content) in [
        ("a.nrrd", [head("float", "raw").as_bytes(), &raw].concat()),
        ("a.nrrd", (head("float", "ascii") + "1 nan 3 nan\n").into_bytes()),
        ("a.vtk", vtk.into()),
        ("a.vti", vti.into()),
    ] {
        let (grid, notes) = grid(name, &content);
        assert_eq!(grid.values.iter().map(|v| v.is_nan()).collect::<Vec<_>>(), [false, true, false, true], "{name}");
        assert!(notes.remarks[0].starts_with("2 of 4 voxels are NaN: they draw nothing"), "{:?}", notes.remarks);
    }
    let infinite: Vec<u8> = [1.0f32, f32::INFINITY, 3.0, 4.0].iter().flat_map(|v| v.to_le_bytes()).collect();
    let refused = error("a.nrrd", &[head("float", "raw").as_bytes(), &infinite].concat());
    assert!(refused.to_string().contains("found inf at voxel 1"), "{refused}");
    let nothing = error("a.nrrd", (head("float", "ascii") + "nan nan nan nan\n").as_bytes());
    assert!(nothing.to_string().contains("expected a voxel with a value, found NaN in all of them"), "{nothing}");
}

const FOAM: &str = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nORIGIN 0 0 0\nSPACING 1 1 1\n\
    POINT_DATA 2\nFIELD a 3\nU 3 2 float\n1 0 0 1 0 0\np 1 2 float\n5 6\nT 1 2 float\n7 8\n";
const CELL: &str = "<VTKFile type=\"UnstructuredGrid\" byte_order=\"LittleEndian\"><UnstructuredGrid>\
    <Piece NumberOfPoints=\"4\" NumberOfCells=\"1\"><PointData>\
    <DataArray type=\"Float32\" Name=\"U\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 1 1 2 2 2 3 3 3</DataArray>\
    <DataArray type=\"Float32\" Name=\"p\" format=\"ascii\">5 5 5 5</DataArray></PointData>\
    <CellData><DataArray type=\"Float32\" Name=\"T\" format=\"ascii\">7</DataArray></CellData>\
    <Points><DataArray type=\"Float32\" NumberOfComponents=\"3\" format=\"ascii\">0 0 0 1 0 0 0 1 0 0 0 1</DataArray></Points>\
    <Cells><DataArray type=\"Int32\" Name=\"connectivity\" format=\"ascii\">0 1 2 3</DataArray>\
    <DataArray type=\"Int32\" Name=\"offsets\" format=\"ascii\">4</DataArray>\
    <DataArray type=\"UInt8\" Name=\"types\" format=\"ascii\">10</DataArray></Cells></Piece></UnstructuredGrid></VTKFile>";

/// Where all arrays are vectors the length of the first one is drawn, and each of its numbers can be chosen.
#[test]
fn vectors_alone_are_drawn_by_their_length() {
    let legacy = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET STRUCTURED_POINTS\nDIMENSIONS 2 1 1\nORIGIN 0 0 0\n\
        SPACING 1 1 1\nPOINT_DATA 2\nVECTORS U float\n3 0 -4 0 12 5\n";
    let image = "<VTKFile type=\"ImageData\" byte_order=\"LittleEndian\"><ImageData WholeExtent=\"0 1 0 0 0 0\">\
        <Piece Extent=\"0 1 0 0 0 0\"><PointData><DataArray type=\"Float32\" Name=\"U\" NumberOfComponents=\"3\" \
        format=\"ascii\">3 0 -4 0 12 5</DataArray></PointData></Piece></ImageData></VTKFile>";
    for (name, content) in [("a.vtk", legacy), ("a.vti", image)] {
        let (found, notes) = grid(name, content.as_bytes());
        assert_eq!(found.values, [5.0, 13.0], "{name}");
        let said = "U:magnitude is drawn, the length of the vectors; --color-by U:0 chooses one number";
        assert!(notes.remarks.iter().any(|r| r == said), "{:?}", notes.remarks);
        for (array, values) in [("U", [5.0, 13.0]), ("U:x", [3.0, 0.0]), ("U:2", [-4.0, 5.0])] {
            let params = ReadParams { array: Some(array.to_owned()), ..ReadParams::default() };
            let Loaded::Grid(part) = bytes(name, content.as_bytes(), &params, None).unwrap().0 else {
                panic!("no volume")
            };
            assert_eq!(part.values, values, "{name} {array}");
        }
    }
}

#[test]
fn an_array_of_vectors_does_not_hide_the_numbers_behind_it() {
    let most = |grid: &Grid| grid.values.iter().copied().fold(0.0, f32::max);
    for (name, content) in [("a.vtk", FOAM), ("a.vtu", CELL)] {
        let (found, notes) = grid(name, content.as_bytes());
        assert!([5.0, 6.0].contains(&most(&found)), "{name}: {}", most(&found));
        let said = "the array p is drawn; `array` of a scene or --color-by chooses another: T, U:magnitude";
        assert!(notes.remarks.iter().any(|r| r == said), "{:?}", notes.remarks);
        let asked = |array: &str| {
            let params = ReadParams { array: Some(array.to_owned()), ..ReadParams::default() };
            bytes(name, content.as_bytes(), &params, None).map(|read| read.0)
        };
        let Loaded::Grid(other) = asked("T").unwrap() else { panic!("no volume") };
        assert!([7.0, 8.0].contains(&most(&other)), "{name}: {}", most(&other));
        let refused = asked("q").unwrap_err();
        assert!(refused.to_string().contains("expected an array among p, T, U:magnitude, found 'q'"), "{refused}");
        let refused = asked("U:w").unwrap_err();
        assert!(refused.to_string().contains("found 'U:w'"), "{refused}");
        assert_eq!(asked("U").unwrap(), asked("U:magnitude").unwrap(), "{name}");
        assert_eq!(asked("U:y").unwrap(), asked("U:1").unwrap(), "{name}");
    }
    let params = ReadParams { array: Some("T".to_owned()), ..ReadParams::default() };
    let refused = bytes("a.xyz", b"0 0 0\n", &params, None).unwrap_err();
    assert!(refused.to_string().contains("expected a volume of VTK"), "{refused}");
}

#[test]
fn formats_of_other_programs_name_their_way_out() {
    for (name, content, found, hint) in [
        ("a.b3dm", &b"b3dm\x01\0\0\0"[..], "a batched tile of 3D Tiles", "b3dmToGlb"),
        ("a.pnts", b"pnts\x01\0\0\0", "a point tile of 3D Tiles", "PLY, LAS or LAZ"),
        (
            "tileset.json",
            b"{\"asset\": {\"version\": \"1.0\"}, \"geometricError\": 500}",
            "a tileset of 3D Tiles",
            "b3dmToGlb",
        ),
        ("a.ctm", b"OCTM\x05\0\0\0", "OpenCTM", "MeshLab"),
        ("a.msh", b"$MeshFormat\n4.1 0 8\n", "Gmsh", "meshio"),
        ("a.case", b"FORMAT\ntype: ensight gold\n", "EnSight", "ParaView"),
        ("a.geo", b"EnSight", "an EnSight or Houdini geometry", "ParaView"),
        ("a.dem", b"x", "a digital elevation model", "gdal_translate"),
        ("a.slc", b"11111", "a VolVis volume", "NRRD"),
        ("a.czi", b"ZISRAWFILE", "a stack of a microscope", "TIFF"),
    ] {
        let refused = error(name, content);
        assert_eq!(refused.found, format!("{found}, which is not read"));
        assert!(refused.hint.contains(hint), "{refused}");
    }
    // Of what nobody knows no bytes are shown.
    let unknown = error("a.zzz", b"\x01\x02secret\xff");
    assert!(!unknown.to_string().contains("secret") && !unknown.to_string().contains("\\x"), "{unknown}");
}

#[test]
fn folders_are_named_by_what_they_hold_and_missing_files_by_their_name() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("true-words");
    let within = |name: &str, file: &str, content: &[u8]| {
        std::fs::create_dir_all(folder.join(name)).unwrap();
        std::fs::write(folder.join(name).join(file), content).unwrap();
        folder.join(name)
    };
    let refused = |path: PathBuf| file(&path, &ReadParams::default(), None).unwrap_err();
    let slices = refused(within("ct", "IM0001", &[&[0; 128][..], b"DICM"].concat()));
    assert!(slices.expected.contains("slices of DICOM") && slices.hint.contains("dcm2niix"), "{slices}");
    let chunks = refused(within("a.zarr", ".zgroup", b"{}"));
    assert!(chunks.found.contains("Zarr") && chunks.hint.contains("NRRD"), "{chunks}");
    let images = refused(within("stack", "z000.jpg", b"\xff\xd8\xff"));
    assert!(images.found.contains("images") && images.hint.contains("Fiji"), "{images}");
    let other = refused(within("other", "a.txt", b"0 0 0"));
    assert_eq!((other.fault, other.found.as_str()), (Fault::FileSystem, "a directory"));
    let missing = refused(folder.join("none.ply"));
    assert!(missing.is_missing_file() && missing.found == "no such file", "{missing}");
}

#[test]
fn hints_name_options_that_there_are() {
    let gaussian = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n\
                    property float f_dc_0\nproperty float f_dc_1\nproperty float f_dc_2\nproperty float opacity\n\
                    property float scale_0\nproperty float scale_1\nproperty float scale_2\nproperty float rot_0\n\
                    property float rot_1\nproperty float rot_2\nproperty float rot_3\nend_header\n";
    for (name, content) in [
        ("a.ply", format!("{gaussian}nan 0 0 0 0 0 1 -3 -3 -3 1 0 0 0\n")),
        ("a.ply", "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nend_header\nnan 0 0\n".into()),
        ("a.xyz", "0 0 nan\n".into()),
        ("a.pcd", "VERSION .7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nWIDTH 1\nHEIGHT 1\nPOINTS 1\nDATA ascii\n1 2 inf\n".into()),
    ] {
        let refused = error(name, content.as_bytes());
        assert!(refused.hint.contains("--drop-invalid"), "{name}: {refused}");
    }
    // Corners of a mesh cannot be left out.
    let mesh = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\nelement face 1\n\
                property list uchar int vertex_indices\nend_header\nnan 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    assert!(!error("a.ply", mesh.as_bytes()).hint.contains("--drop-invalid"));
    // Gaussians without colours.
    let colored = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty float opacity\n\
                   property float scale_0\nproperty float rot_0\nproperty uchar value\nend_header\n0 0 0 3 -3 1 255\n";
    assert!(
        error("a.ply", colored.as_bytes())
            .to_string()
            .contains("Gaussians with their colours as f_dc_0 to f_dc_2, or as red")
    );
    let required = |name: &str| {
        let json = format!("{{\"asset\":{{\"version\":\"2.0\"}},\"extensionsRequired\":[\"{name}\"]}}");
        load("a.gltf", json.as_bytes())
    };
    for (name, hint) in [
        ("KHR_draco_mesh_compression", "Compression switched off"),
        ("EXT_meshopt_compression", "gltfpack without -c"),
        ("KHR_gaussian_splatting_of_tomorrow", "SPZ"),
    ] {
        assert!(required(name).unwrap_err().hint.contains(hint), "{name}");
    }
    assert!(
        ["KHR_texture_basisu", "EXT_texture_webp", "KHR_gaussian_splatting"].iter().all(|name| required(name).is_ok())
    );
}

#[test]
fn what_a_file_states_and_nobody_draws_is_said() {
    let folder = PathBuf::from(env!("CARGO_TARGET_TMPDIR")).join("true-words-obj");
    std::fs::create_dir_all(&folder).unwrap();
    std::fs::write(folder.join("m.mtl"), "newmtl only\nKd 0.9 0.1 0.1\n").unwrap();
    let said = |use_it: &str| {
        let text = format!("mtllib m.mtl\n{use_it}v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
        std::fs::write(folder.join("m.obj"), text).unwrap();
        file(&folder.join("m.obj"), &ReadParams::default(), None).unwrap().1.remarks
    };
    assert_eq!(said(""), ["its material file is not used: no face names one of its materials by `usemtl`"]);
    assert_eq!(said("usemtl only\n"), [""; 0]);
    let mut colored = stl(true);
    assert!(read("a.stl", &colored).1.remarks.is_empty());
    colored[84 + 48] = 0x1f;
    assert!(read("a.stl", &colored).1.remarks[0].contains("colours"));
    // Deviations that are written as they are, where logarithms are read, and logarithms of deviations as large as the scene.
    let gaussians = |scale: f64| {
        let names = "f_dc_0 f_dc_1 f_dc_2 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
        let properties: String =
            ["x", "y", "z"].into_iter().chain(names.split(' ')).map(|n| format!("property float {n}\n")).collect();
        let record = |i: usize| format!("{} {} {} 0 0 0 1 {scale} {scale} {scale} 1 0 0 0\n", i % 5, i / 5 % 5, i / 25);
        let records: String = (0..125).map(record).collect();
        format!("ply\nformat ascii 1.0\nelement vertex 125\n{properties}end_header\n{records}")
    };
    let (linear, notes) = points("a.ply", gaussians(0.1).as_bytes());
    assert!(notes.remarks[0].contains("they are taken as the deviations themselves"), "{notes:?}");
    assert!(linear.gaussians.axes.as_flattened().iter().all(|axis| (axis.length() - 0.1).abs() < 1e-6));
    let (large, notes) = points("a.ply", gaussians(-0.1).as_bytes());
    assert!(notes.remarks[0].starts_with("its Gaussians are as large as the scene"), "{notes:?}");
    assert!((large.gaussians.axes[0][0].length() - (-0.1f32).exp()).abs() < 1e-6);
    assert!(points("a.ply", gaussians(-2.3).as_bytes()).1.remarks.is_empty());
}

#[test]
fn intensities_are_called_so() {
    for (name, content) in [
        ("a.las", las(0, 4, false)),
        ("a.xyz", b"x y z intensity\n0 0 0 5\n".to_vec()),
        ("a.ply", b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\nproperty float scalar_Intensity\nend_header\n0 0 0 5\n".to_vec()),
        ("a.pcd", pcd("ascii")),
    ] {
        let (points, _) = points(name, &content);
        assert_eq!(points.value_name(), "intensity", "{name}");
        assert!(points.column_names().any(|column| column == "intensity"), "{name}");
        let up = splat_core::glam::DVec3::Y;
        assert_eq!(points.column("value", up), points.column("intensity", up), "{name}");
        assert_eq!(points.not_asked_for(&["value".into()]).find(|n| *n == "intensity"), None, "{name}");
    }
    assert_eq!(points("a.xyz", b"x y z temperature value\n0 0 0 5 6\n").0.value_name(), "value");
}
