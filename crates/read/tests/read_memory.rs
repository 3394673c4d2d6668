//! Memory that reading takes: one account for a file and all that it names, asked before anything is allocated; and work that a small file
//! could ask for.
#![cfg(all(feature = "off", feature = "gltf"))]

use crate::read_samples::{glb, image, square};
use image::ImageFormat;
use read::{Fault, Loaded, Notes, ReadError, ReadParams, bytes, file};
use splat_core::MemoryAccount;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

/// Columns and rows of an image whose texels take 4 MiB.
const SIDE: u32 = 1024;
const TEXELS: u64 = 4 * SIDE as u64 * SIDE as u64;

fn within(bytes: u64) -> ReadParams {
    ReadParams { memory: MemoryAccount::new(bytes), ..ReadParams::default() }
}

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(folder.join("sub")).unwrap();
    folder
}

#[track_caller]
fn limit(read: Result<(Loaded, Notes), ReadError>) -> ReadError {
    let error = read.unwrap_err();
    assert_eq!((error.fault, error.fault.exit_code()), (Fault::Limit, 5), "{error}");
    error
}

/// A square for each of so many materials, each with a texture of its own, which shows image `image_of` of as many buffer views.
fn textured(count: usize, views: usize, image_of: impl Fn(usize) -> usize) -> Vec<u8> {
    let picture = image(SIDE, ImageFormat::Png);
    let binary = [square(&[]), picture.repeat(views)].concat();
    let list = |n: usize, item: &dyn Fn(usize) -> String| (0..n).map(item).collect::<Vec<_>>().join(",");
    let primitive = |k: usize| {
        format!(r#"{{"attributes":{{"POSITION":0,"NORMAL":1,"TEXCOORD_0":2}},"indices":3,"material":{k},"mode":5}}"#)
    };
    // One place of each image is shown: no triangle is divided for it.
    let shown = r#""extensions":{"KHR_texture_transform":{"scale":[0,0]}}"#;
    let material = |k: usize| format!(r#"{{"pbrMetallicRoughness":{{"baseColorTexture":{{"index":{k},{shown}}}}}}}"#);
    let view = |k: usize| {
        let at = 152 + k * picture.len();
        format!(r#"{{"buffer":0,"byteOffset":{at},"byteLength":{}}}"#, picture.len())
    };
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[0]}}],"nodes":[{{"mesh":0}}],"meshes":[{{"primitives":[{}]}}],
"materials":[{}],"textures":[{}],"images":[{}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}},{{"bufferView":1,"componentType":5126,"count":4,"type":"VEC3"}},
{{"bufferView":2,"componentType":5126,"count":4,"type":"VEC2"}},{{"bufferView":3,"componentType":5123,"count":4,"type":"SCALAR"}}],
"bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":48}},{{"buffer":0,"byteOffset":96,"byteLength":32}},
{{"buffer":0,"byteOffset":144,"byteLength":8}},{}],"buffers":[{{"byteLength":{}}}]}}"#,
        list(count, &primitive),
        list(count, &material),
        list(count, &|k| format!(r#"{{"source":{k}}}"#)),
        list(count, &|k| format!(r#"{{"bufferView":{}}}"#, 4 + image_of(k))),
        list(views, &view),
        binary.len()
    );
    glb(&json, &binary)
}

#[test]
fn an_image_of_gltf_is_decoded_once_whatever_shows_it() {
    // A hundred textures, of images that are one view: 400 MiB if each were decoded anew.
    let content = textured(100, 1, |_| 0);
    let params = within(24 << 20);
    assert!(bytes("a.glb", &content, &params, None).is_ok());
    assert!(params.memory.peak() > 2 * TEXELS - 1_000_000, "{}", params.memory.peak());
    assert_eq!(params.memory.used(), 0);
}

#[test]
fn images_of_gltf_draw_on_one_account() {
    // Eight images that are not one, each below the limit.
    let content = textured(8, 8, |k| k);
    let error = limit(bytes("a.glb", &content, &within(24 << 20), None));
    assert!(error.found.contains("image "), "{error}");
    assert!(bytes("a.glb", &content, &within(64 << 20), None).is_ok());
}

#[test]
fn an_image_of_obj_is_decoded_once_however_it_is_named() {
    let folder = folder("memory-textures");
    std::fs::write(folder.join("t.png"), image(SIDE, ImageFormat::Png)).unwrap();
    let names = |k: usize| format!("{}t.png", "./".repeat(k + 1));
    let (mut mtl, mut obj) = (String::new(), "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 0\n".to_owned());
    for k in 0..100 {
        writeln!(mtl, "newmtl m{k}\nmap_Kd {}", names(k)).unwrap();
        writeln!(obj, "usemtl m{k}\nf 1/1 2/1 3/1").unwrap();
    }
    std::fs::write(folder.join("a.mtl"), mtl).unwrap();
    std::fs::write(folder.join("a.obj"), obj).unwrap();
    let params = within(24 << 20);
    let read = file(&folder.join("a.obj"), &params, None);
    assert!(read.is_ok(), "{read:?}");
    assert_eq!(params.memory.used(), 0);
}

#[test]
fn a_library_of_materials_is_read_once_and_counts() {
    let folder = folder("memory-library");
    let mtl: String = (0..20_000).map(|i| format!("newmtl m{i}\nKd .5 .5 .5\n")).collect();
    std::fs::write(folder.join("a.mtl"), &mtl).unwrap();
    let spelled = ["a.mtl", "./a.mtl"];
    let lines: String = (0..2000).map(|k| format!("mtllib {}\n", spelled[k % 2])).collect();
    std::fs::write(folder.join("a.obj"), format!("{lines}v 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl m7\nf 1 2 3\n")).unwrap();
    let params = within(16 << 20);
    let (loaded, _) = file(&folder.join("a.obj"), &params, None).unwrap();
    let Loaded::Mesh(mesh) = loaded else { panic!("a mesh") };
    assert_eq!(mesh.color, [[0.5; 3]; 3]);
    assert!(params.memory.peak() > 20_000 * 300, "{}", params.memory.peak());
    limit(file(&folder.join("a.obj"), &within(2 << 20), None));
}

#[test]
fn nodes_that_repeat_a_mesh_are_refused_before_the_first_is_read() {
    let nodes = 3000;
    let count = 20_000;
    let corners: Vec<u8> = (0..count * 3).flat_map(|k: u32| ((k * 7919 % 1000) as f32).to_le_bytes()).collect();
    let list = |item: &dyn Fn(usize) -> String| (0..nodes).map(item).collect::<Vec<_>>().join(",");
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":[{}]}}],"nodes":[{}],"meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}}}}]}}],
"accessors":[{{"bufferView":0,"componentType":5126,"count":{count},"type":"VEC3"}}],"bufferViews":[{{"buffer":0,"byteLength":{}}}],
"buffers":[{{"byteLength":{}}}]}}"#,
        list(&|k| k.to_string()),
        list(&|_| r#"{"mesh":0}"#.to_owned()),
        corners.len(),
        corners.len()
    );
    let params = within(1 << 30);
    let error = limit(bytes("a.glb", &glb(&json, &corners), &params, None));
    assert!(error.found.contains("the vertices"), "{error}");
    assert!(params.memory.peak() < 32 << 20, "{}", params.memory.peak());
}

/// A picture of black and white, a bit a pixel, white in its middle.
fn mask([width, height]: [u32; 2]) -> Vec<u8> {
    let row = |y: u32| {
        let bit = |x: u32| u8::from(2 * x > width && 2 * y > height);
        let byte = |k: u32| (0..8).fold(0, |byte, i| byte << 1 | bit(8 * k + i));
        [0].into_iter().chain((0..width.div_ceil(8)).map(byte)).collect::<Vec<u8>>()
    };
    let mut packed = flate2::write::ZlibEncoder::new(Vec::new(), flate2::Compression::best());
    (0..height).for_each(|y| std::io::Write::write_all(&mut packed, &row(y)).unwrap());
    let mut out = b"\x89PNG\r\n\x1a\n".to_vec();
    let header = [&width.to_be_bytes()[..], &height.to_be_bytes(), &[1, 0, 0, 0, 0]].concat();
    for (name, data) in [(b"IHDR", header), (b"IDAT", packed.finish().unwrap()), (b"IEND", Vec::new())] {
        let mut sum = flate2::Crc::new();
        sum.update(&[&name[..], &data].concat());
        out.extend([&(data.len() as u32).to_be_bytes()[..], name, &data, &sum.sum().to_be_bytes()].concat());
    }
    out
}

#[test]
fn masks_of_black_and_white_are_images_and_no_bombs() {
    for size in [[1920, 1080], [2048, 1600]] {
        let content = mask(size);
        assert!(12 * u64::from(size[0] * size[1]) > 1000 * content.len() as u64, "{} bytes", content.len());
        let (loaded, _) = bytes("a.png", &content, &ReadParams::default(), None).unwrap();
        let Loaded::Image(read) = loaded else { panic!("an image") };
        assert_eq!((read.size, read.pixels[0], read.pixels.last()), (size, [0.0; 3], Some(&[1.0; 3])));
    }
    // A header that announces what the rest cannot hold.
    let mut lie = mask([64, 64]);
    lie[16..24].copy_from_slice(&[0, 0, 0xff, 0xff, 0, 0, 0xff, 0xff]);
    let mut sum = flate2::Crc::new();
    sum.update(&lie[12..29]);
    lie[29..33].copy_from_slice(&sum.sum().to_be_bytes());
    limit(bytes("a.png", &lie, &within(u64::MAX), None));
}

#[test]
fn numbers_of_coefficients_beyond_counting_are_other_columns() {
    let header = "ply\nformat ascii 1.0\nelement vertex 1\n";
    let names = "x y z f_dc_0 f_dc_1 f_dc_2 f_rest_18446744073709551615 opacity scale_0 scale_1 scale_2 rot_0 rot_1 rot_2 rot_3";
    let properties: String = names.split(' ').map(|name| format!("property float {name}\n")).collect();
    let content = format!("{header}{properties}end_header\n0 0 0 0 0 0 0 0 0 0 0 1 0 0 0\n");
    let (loaded, notes) = bytes("a.ply", content.as_bytes(), &ReadParams::default(), None).unwrap();
    assert!(matches!(loaded, Loaded::Points(points) if points.gaussians.degree == 0));
    assert_eq!(notes.unused, ["f_rest_18446744073709551615"]);
}

/// An unstructured grid of so many hexahedra of the same eight points.
fn overlapping(cells: usize) -> String {
    let array = |name: &str, kind: &str, more: &str, numbers: String| {
        format!("<DataArray type=\"{kind}\" Name=\"{name}\" {more}format=\"ascii\">{numbers}</DataArray>\n")
    };
    let points = array(
        "Points",
        "Float32",
        "NumberOfComponents=\"3\" ",
        "0 0 0 1 0 0 1 1 0 0 1 0 0 0 1 1 0 1 1 .9 1 0 1 .8".into(),
    );
    let corners = array("connectivity", "Int32", "", "0 1 2 3 4 5 6 7 ".repeat(cells));
    let ends: String = (1..=cells).map(|k| format!("{} ", 8 * k)).collect();
    let types = array("types", "UInt8", "", "12 ".repeat(cells));
    format!(
        "<VTKFile type=\"UnstructuredGrid\" version=\"0.1\" byte_order=\"LittleEndian\"><UnstructuredGrid>\
         <Piece NumberOfPoints=\"8\" NumberOfCells=\"{cells}\"><Points>{points}</Points><Cells>{corners}{}{types}</Cells></Piece>\
         </UnstructuredGrid></VTKFile>",
        array("offsets", "Int32", "", ends)
    )
}

#[test]
fn cells_that_lie_on_each_other_a_thousandfold_are_refused() {
    assert!(bytes("a.vtu", overlapping(4).as_bytes(), &ReadParams::default(), None).is_ok());
    for cells in [1000, 20_000] {
        let error = limit(bytes("a.vtu", overlapping(cells).as_bytes(), &ReadParams::default(), None));
        assert!(error.found.starts_with(&format!("{cells} cells whose volumes are ")), "{error}");
    }
}

#[test]
fn cells_in_a_row_of_millions_are_refused_by_their_size() {
    let content = "# vtk DataFile Version 5.1\na test\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 9 float\n\
        0 0 0 2 0 0 2 1 0 0 1 0 0 0 1 2 0 1 2 1 1 0 1 1 3 4294967296 0.5\nCELLS 2 15\n8 0 1 2 3 4 5 6 7\n5 1 2 6 5 8\n\
        CELL_TYPES 2\n12 14\n";
    let params = within(128 << 20);
    let error = bytes("a.vtk", content.as_bytes(), &params, None).unwrap_err();
    assert!(error.to_string().contains("steps of which none is more than 1000 times another"), "{error}");
    assert!(params.memory.peak() < 1 << 20, "{}", params.memory.peak());
}

/// Corners of a face, of which all but some lie on a line, or next to it.
#[test]
fn faces_of_many_corners_on_a_line_take_no_time_that_grows_with_their_square() {
    let n = 30_000;
    let apexes: [(&str, f64); 4] = [("0 1e-30", 0.0), ("0 1e-12", 1e-12), ("7.5 -3", 3.0), ("29998 100", 100.0)];
    for (apex, height) in apexes {
        let corners: String = (0..n - 1).map(|i| format!("v {i} 0 0\n")).collect();
        let face: String = (1..=n).map(|i| format!(" {i}")).collect();
        let content = format!("{corners}v {apex} 0\nf{face}\n");
        let (loaded, _) = bytes("a.obj", content.as_bytes(), &ReadParams::default(), None).unwrap();
        let Loaded::Mesh(mesh) = loaded else { panic!("a mesh") };
        let expected = 0.5 * f64::from(n - 2) * height;
        assert!((mesh.area() - expected).abs() <= 1e-6 * expected + 1e-20, "{apex}: {} for {expected}", mesh.area());
    }
}
