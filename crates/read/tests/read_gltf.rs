//! glTF and GLB: what becomes of nodes, primitives, colours and textures, and what is wrong with a file in words.

use crate::read_samples::{glb, gzip, image, load, square, square_glb, square_gltf, square_json};
use image::ImageFormat;
use read::{Fault, Loaded, Notes, ReadParams, bytes, file};
use splat_core::Mesh;
use splat_core::glam::Vec3;
use std::path::{Path, PathBuf};

fn read(name: &str, content: &[u8]) -> (Mesh, Notes) {
    match bytes(name, content, &ReadParams::default(), None).unwrap() {
        (Loaded::Mesh(mesh), notes) => (mesh, notes),
        other => panic!("{other:?}"),
    }
}

#[track_caller]
fn refused(content: &[u8], beginning: &str) {
    let error = load("a.glb", content).unwrap_err();
    assert_eq!(error.fault, Fault::Input, "{error}");
    assert!(error.to_string().starts_with(beginning), "{error}");
    assert!(error.to_string().contains("\nhint: "), "{error}");
}

/// The square with a piece of its description replaced.
fn with(from: &str, to: &str) -> Vec<u8> {
    let image = image(4, ImageFormat::Png);
    let json = square_json("", image.len());
    assert!(json.contains(from), "{from}");
    glb(&json.replacen(from, to, 1), &square(&image))
}

/// Without its texture.
fn plain() -> Vec<u8> {
    with(r#","baseColorTexture":{"index":0}"#, "")
}

#[test]
fn nodes_move_turn_and_scale_what_is_below_them() {
    let (mesh, _) = read("a.glb", &plain());
    // Twice as large, turned by a quarter, then moved.
    let expected = [[10.0, 0.0, 0.0], [10.0, 2.0, 0.0], [8.0, 0.0, 0.0], [8.0, 2.0, 0.0]].map(Vec3::from);
    let found: Vec<Vec3> = mesh.position.iter().map(|p| (mesh.origin + p.as_dvec3()).as_vec3()).collect();
    assert!(found.iter().zip(expected).all(|(f, e)| f.distance(e) < 1e-6), "{found:?}");
    assert_eq!(mesh.normal, [Vec3::Z; 4]);
    assert_eq!(mesh.triangles, [[0, 1, 2], [2, 1, 3]]);
    assert_eq!(mesh.color, [[1.0, 0.5, 1.0]; 4]);
    // Mirrored, it faces the same way; far away, it keeps its size.
    let (mirrored, _) = read("a.glb", &with(r#""scale":[2,2,2]"#, r#""scale":[2,2,-2]"#));
    let facing = |m: &Mesh| {
        let [a, b, c] = m.triangles[0].map(|v| m.position[v as usize]);
        (b - a).cross(c - a).dot(m.normal[0])
    };
    assert!(facing(&mesh) > 0.0 && facing(&mirrored) > 0.0 && mirrored.normal[0].z < 0.0);
    let (far, _) = read("a.glb", &with("[10,0,0]", "[10000000,0,0]"));
    assert!((far.bounds().max - far.bounds().min - mesh.bounds().max + mesh.bounds().min).length() < 1e-6);
    // Only the default scene is shown.
    let (empty, notes) =
        read("a.glb", &with(r#""scene":0,"scenes":["#, r#""scene":1,"scenes":[{"nodes":[0]},{"nodes":[]}, "#));
    assert_eq!((empty.triangles.len(), notes.remarks), (0, vec!["the default scene has no mesh".to_owned()]));
}

#[test]
fn strips_fans_and_lists_with_and_without_indices() {
    let triangles = |from: &str, to: &str| {
        let content = with(from, to);
        let json = String::from_utf8_lossy(&content).into_owned();
        assert!(json.contains(to));
        read("a.glb", &content).0
    };
    let area = |m: &Mesh| m.area();
    let strip = read("a.glb", &plain()).0;
    assert!((area(&strip) - 4.0).abs() < 1e-5);
    let fan = triangles(r#""mode":5"#, r#""mode":6"#);
    let list = triangles(r#""mode":5"#, r#""mode":4"#);
    let unindexed = triangles(r#""indices":4,"#, "");
    assert!((area(&fan) - 4.0).abs() < 1e-5, "0 1 2, 0 2 3 overlap on this square");
    assert!((area(&list) - 2.0).abs() < 1e-5);
    assert!((area(&unindexed) - 4.0).abs() < 1e-5);
    refused(&with(r#""mode":5"#, r#""mode":9"#), "a.glb: expected a mode from 0 to 6, found 9");
    // Lines alone are tubes, points alone are points.
    assert!(triangles(r#""mode":5"#, r#""mode":3"#).triangles.len() > 2);
    let Loaded::Points(points) = load("a.glb", &with(r#""mode":5"#, r#""mode":0"#)).unwrap() else {
        panic!("no points")
    };
    assert_eq!((points.len(), points.normal.len(), points.color.len()), (4, 4, 4));
}

#[test]
fn without_normals_every_triangle_is_flat() {
    let image = image(4, ImageFormat::Png);
    let json =
        square_json("", image.len()).replace(r#""NORMAL":1,"#, "").replace(r#","baseColorTexture":{"index":0}"#, "");
    let (mesh, _) = read("a.glb", &glb(&json, &square(&image)));
    assert_eq!(mesh.position.len(), 3 * mesh.triangles.len());
    assert!(mesh.normal.iter().all(|n| n.distance(Vec3::Z) < 1e-6));
}

#[test]
fn textures_become_colours_of_vertices_down_to_their_texels() {
    let packed = gzip(&square_glb(ImageFormat::Png));
    let (mesh, notes) = read("a.glb", &square_glb(ImageFormat::Png));
    for (name, content) in [("a.gltf", square_gltf()), ("a.glb.gz", packed), ("unnamed", square_glb(ImageFormat::Png))]
    {
        assert_eq!(read(name, &content), (mesh.clone(), notes.clone()), "{name}");
    }
    assert_eq!(notes.unused, ["metallicFactor"]);
    assert!(notes.remarks[0].starts_with("textures became colours of vertices: 2 triangles were divided into "));
    assert!((mesh.area() - 4.0).abs() < 1e-5);
    mesh.validate().unwrap();
    // The image's left half is red, its right half half green by the factor, its lower half blue. Turned, its right is up.
    let expected = |p: Vec3| {
        let u = p.y / 2.0;
        let v = 1.0 - (10.0 - p.x) / 2.0;
        if v >= 0.5 {
            [0.0, 0.0, 1.0]
        } else if u < 0.5 {
            [1.0, 0.0, 0.0]
        } else {
            [0.0, 0.5, 0.0]
        }
    };
    let at = |v: u32| (mesh.origin + mesh.position[v as usize].as_dvec3()).as_vec3();
    for t in &mesh.triangles {
        let [a, b, c] = t.map(at);
        // Edges are at most a texel long, where colours meet.
        let texels = [a.distance(b), b.distance(c), c.distance(a)].into_iter().fold(0.0, f32::max) * 2.0;
        let alike = t.iter().all(|v| mesh.color[*v as usize] == mesh.color[t[0] as usize]);
        assert!(alike || texels <= 1.0 + 1e-5, "{texels}");
        let middle = (a + b + c) / 3.0;
        let near_border = (middle.y - 1.0).abs() < 0.6 || (middle.x - 9.0).abs() < 0.6;
        assert!(near_border || mesh.color[t[0] as usize] == expected(middle), "{middle}");
    }
}

#[test]
fn an_alpha_mask_cuts_out_what_is_not_there_and_blending_is_the_opacity() {
    let mut pixels = image::RgbaImage::from_pixel(4, 4, image::Rgba([255, 255, 255, 255]));
    (0..4).for_each(|y| (0..2).for_each(|x| pixels.put_pixel(x, y, image::Rgba([255, 255, 255, 0]))));
    let mut png = std::io::Cursor::new(Vec::new());
    pixels.write_to(&mut png, ImageFormat::Png).unwrap();
    let png = png.into_inner();
    let json = |mode: &str| {
        square_json("", png.len()).replace(r#""materials":[{"#, &format!(r#""materials":[{{"alphaMode":"{mode}","#))
    };
    let area = |mode: &str| read("a.glb", &glb(&json(mode), &square(&png))).0.area();
    assert!((area("OPAQUE") - 4.0).abs() < 1e-5);
    // Half of the square, within half a texel of its four.
    assert!((area("MASK") - 2.0).abs() <= 0.5, "{}", area("MASK"));
    let (mesh, notes) = read("a.glb", &glb(&json("BLEND"), &square(&png)));
    // What is clear everywhere is left out, to about a texel of four.
    assert!((mesh.area() - 2.0).abs() <= 1.0, "{}", mesh.area());
    assert!(notes.remarks.iter().any(|r| r.starts_with("doubleSided is not set")), "{:?}", notes.remarks);
    assert_eq!(mesh.opacity.len(), mesh.position.len());
    for t in &mesh.triangles {
        for (p, opacity) in t.map(|v| (mesh.position[v as usize], mesh.opacity[v as usize])) {
            // Turned, the image's right is up; texels are squares of one opacity.
            let height = mesh.origin.y as f32 + p.y - 1.0;
            assert!(height.abs() < 0.01 || opacity == f32::from(u8::from(height > 0.0)), "{p}: {opacity}");
        }
    }
}

#[test]
fn a_texture_transform_and_integer_coordinates_are_applied() {
    // Twice the scale: the image repeats, so that a quarter of it shows the whole.
    let transformed = with(
        r#""baseColorTexture":{"index":0}"#,
        r#""baseColorTexture":{"index":0,"extensions":{"KHR_texture_transform":{"scale":[0.25,0.25],"offset":[0,0]}}}"#,
    );
    let (mesh, _) = read("a.glb", &transformed);
    assert!(mesh.color.iter().all(|c| *c == [1.0, 0.0, 0.0]), "the upper left quarter is red");
    // Places as bytes, as KHR_mesh_quantization has them.
    let image = image(4, ImageFormat::Png);
    let json = square_json("", image.len())
        .replacen(
            r#""componentType":5126,"count":4,"type":"VEC3""#,
            r#""componentType":5121,"count":4,"type":"VEC3""#,
            1,
        )
        .replacen(r#"{"buffer":0,"byteLength":48}"#, r#"{"buffer":0,"byteLength":48,"byteStride":4}"#, 1)
        .replacen(r#""asset""#, r#""extensionsRequired":["KHR_mesh_quantization"],"asset""#, 1);
    let mut binary = square(&image);
    binary[..16].copy_from_slice(&[0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9, 1, 1, 0, 9]);
    assert!((read("a.glb", &glb(&json, &binary)).0.area() - 4.0).abs() < 1e-5);
}

#[test]
fn sparse_entries_take_the_place_of_others() {
    // The fourth corner moves out along its diagonal: by the normals' bytes, of which the first is (0, 0, 1).
    let sparse = with(
        r#"{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"}"#,
        r#"{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","sparse":{"count":1,
            "indices":{"bufferView":4,"byteOffset":6,"componentType":5123},"values":{"bufferView":1}}}"#,
    );
    let (mesh, _) = read("a.glb", &sparse);
    assert!((mesh.bounds().max.z - 2.0).abs() < 1e-6);
}

#[test]
fn what_a_file_requires_and_what_is_damaged_is_told() {
    let required = |name: &str| with(r#""asset""#, &format!(r#""extensionsRequired":["{name}"],"asset""#));
    for name in ["KHR_draco_mesh_compression", "EXT_meshopt_compression", "VENDOR_thing"] {
        let beginning = format!("a.glb: expected glTF 2.0 without extensions that are not read, found {name}, which");
        refused(&required(name), &beginning);
    }
    assert!(load("a.glb", &required("KHR_materials_transmission")).is_ok());
    refused(&with(r#""version":"2.0""#, r#""version":"1.0""#), "a.glb: expected an asset of version 2, found 1.0");
    refused(
        &with(r#""children":[1]"#, r#""children":[1,0]"#),
        "a.glb: expected nodes that have one parent each, found",
    );
    refused(&with(r#""children":[1]"#, r#""children":[7]"#), "a.glb: expected a node below 2, found 7");
    refused(&with(r#""mesh":0"#, r#""mesh":3"#), "a.glb: expected a mesh below 1, found 3");
    refused(&with(r#""POSITION":0,"#, ""), "a.glb: expected POSITION of a primitive, found none");
    refused(
        &with(r#""POSITION":0"#, r#""POSITION":2"#),
        "a.glb: expected 3 floats or small integers an entry of POSITION",
    );
    refused(&with(r#""count":4"#, r#""count":5"#), "a.glb: expected accessor 0 within the 48 bytes of buffer view 0");
    let huge = with(r#""count":4"#, r#""count":18446744073709551615"#);
    refused(&huge, "a.glb: expected accessor 0 within the 48 bytes of buffer view 0, found 18446744073709551615 of 12");
    let zeros = with(r#""bufferView":0,"componentType":5126,"count":4"#, r#""componentType":5126,"count":1000000000"#);
    refused(&zeros, "a.glb: expected a buffer view of accessor 0, found none");
    refused(&with(r#""byteLength":48"#, r#""byteLength":48000"#), "a.glb: expected buffer view 0 within the");
    let (flat, notes) = read("a.glb", &with(r#""TEXCOORD_0":2,"#, ""));
    assert_eq!((flat.color, notes.remarks.len()), (vec![[1.0, 0.5, 1.0]; 4], 1));
    refused(&with(r#"[1,0.5,1,1]"#, r#"[1,2,1,1]"#), "a.glb: expected a baseColorFactor from 0 to 1 of material 0");
    refused(&with(r#""scale":[2,2,2]"#, r#""scale":[1e300,1e300,2]"#), "a.glb: expected ");
    refused(&with(r#""scenes""#, "scenes"), "a.glb@");
    let mut indices = square_glb(ImageFormat::Png);
    let at = indices.windows(8).position(|w| w == [0, 0, 1, 0, 2, 0, 3, 0]).unwrap();
    indices[at + 6] = 4;
    refused(&indices, "a.glb: expected a vertex below 4, found 4");
    let text = String::from_utf8(square_gltf()).unwrap();
    let error = load("a.gltf", text.replace(r#""mesh":0"#, r#""mesh":"x""#).as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with("a.gltf:2:"), "{error}");
    let error = load("a.gltf", text.replace(";base64,", ";base63,").as_bytes()).unwrap_err().to_string();
    assert!(error.starts_with("a.gltf: expected base64 in the uri of buffer 0"), "{error}");
    let splats = r#""mode":5,"extensions":{"KHR_gaussian_splatting":{}}"#;
    refused(
        &with(r#""mode":5"#, splats),
        "a.glb: expected 3D Gaussians in a primitive of points (mode 0), found mode 5",
    );
}

#[test]
fn files_that_it_names_lie_in_its_folder_or_below() {
    let folder: PathBuf = Path::new(env!("CARGO_TARGET_TMPDIR")).join("gltf-beside");
    std::fs::create_dir_all(folder.join("my data")).unwrap();
    let png = image(4, ImageFormat::Png);
    std::fs::write(folder.join("my data/square.bin"), square(&png)).unwrap();
    std::fs::write(folder.join("../gltf-outside.bin"), square(&png)).unwrap();
    std::fs::write(folder.join("colours.png"), &png).unwrap();
    let opened = |buffer: &str, image: &str| {
        let json = square_json(&format!(r#","uri":"{buffer}""#), png.len());
        let json = json.replace(r#""bufferView":5,"mimeType":"image/png""#, image);
        std::fs::write(folder.join("a.gltf"), json).unwrap();
        file(&folder.join("a.gltf"), &ReadParams::default(), None)
    };
    let expected = read("a.glb", &square_glb(ImageFormat::Png));
    let (Loaded::Mesh(found), notes) = opened("my%20data/square.bin", r#""uri":"colours.png""#).unwrap() else {
        panic!("no mesh")
    };
    assert_eq!((found, notes), expected);
    let (_, notes) = opened("my data/square.bin", r#""uri":"missing.png""#).unwrap();
    assert!(notes.remarks[0].ends_with("the texture is left out"), "{:?}", notes.remarks);
    for outside in ["../gltf-outside.bin", "%2e%2e/gltf-outside.bin", "/etc/passwd", "https://example.org/a.bin"] {
        let error = opened(outside, r#""uri":"colours.png""#).unwrap_err();
        assert!(error.expected.starts_with("buffer 0: a file in the same folder or below"), "{error}");
    }
    assert_eq!(opened("missing.bin", r#""uri":"colours.png""#).unwrap_err().fault, Fault::FileSystem);
}

/// Floats as a buffer, and a description of one node that shows a mesh of these accessors.
fn of_floats(floats: &[f32], node: &str, primitive: &str, accessors: &str) -> Vec<u8> {
    let binary: Vec<u8> = floats.iter().flat_map(|float| float.to_le_bytes()).collect();
    let json = format!(
        "{{\"asset\":{{\"version\":\"2.0\"}},\"scenes\":[{{\"nodes\":[0]}}],\"nodes\":[{{\"mesh\":0{node}}}],\
         \"meshes\":[{{\"primitives\":[{primitive}]}}],\"buffers\":[{{\"byteLength\":{}}}],\
         \"bufferViews\":[{{\"buffer\":0,\"byteLength\":{}}}],\"accessors\":[{accessors}]}}",
        binary.len(),
        binary.len()
    );
    glb(&json, &binary)
}

fn accessor(offset: usize, count: usize, shape: &str) -> String {
    format!(
        "{{\"bufferView\":0,\"byteOffset\":{offset},\"componentType\":5126,\"count\":{count},\"type\":\"{shape}\"}}"
    )
}

#[test]
fn copies_of_a_mesh_lie_where_its_node_says() {
    let triangle = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    // Moved; moved, twice as large and turned by a half about z.
    let moved = [5.0, 0.0, 0.0, 0.0, 7.0, 0.0];
    let turned = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    let scaled = [1.0, 1.0, 1.0, 2.0, 2.0, 2.0];
    let floats = [&triangle[..], &moved, &turned, &scaled].concat();
    let accessors = |count: usize| {
        [accessor(0, 3, "VEC3"), accessor(36, 2, "VEC3"), accessor(60, 2, "VEC4"), accessor(92, count, "VEC3")]
            .join(",")
    };
    let node = ",\"extensions\":{\"EXT_mesh_gpu_instancing\":{\"attributes\":{\"TRANSLATION\":1,\"ROTATION\":2,\"SCALE\":3,\"_TONE\":3}}}";
    let primitive = "{\"attributes\":{\"POSITION\":0}}";
    let (mesh, notes) = read("a.glb", &of_floats(&floats, node, primitive, &accessors(2)));
    let found: Vec<Vec3> = mesh.position.iter().map(|p| (mesh.origin + p.as_dvec3()).as_vec3()).collect();
    let expected =
        [[5.0, 0.0, 0.0], [6.0, 0.0, 0.0], [5.0, 1.0, 0.0], [0.0, 7.0, 0.0], [-2.0, 7.0, 0.0], [0.0, 5.0, 0.0]];
    assert!(found.iter().zip(expected.map(Vec3::from)).all(|(f, e)| f.distance(e) < 1e-6), "{found:?}");
    assert_eq!((found.len(), notes.unused), (6, vec!["_TONE of copies".to_owned()]));
    let unlike = of_floats(&floats, node, primitive, &accessors(1));
    refused(&unlike, "a.glb: expected 2 entries of each attribute of copies, found 1");
}

#[test]
fn lines_alone_become_tubes_and_beside_faces_are_named() {
    let square = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 1.0, 0.0];
    let lines = |mode: u32| {
        let primitive = format!("{{\"mode\":{mode},\"attributes\":{{\"POSITION\":0}}}}");
        read("a.glb", &of_floats(&square, "", &primitive, &accessor(0, 4, "VEC3")))
    };
    // Rings of six vertices: at both ends of two lines, along a strip, and once more at the end of a loop.
    for (mode, rings, said) in [(1, 4, "2 lines"), (2, 5, "1 line"), (3, 4, "1 line")] {
        let (mesh, notes) = lines(mode);
        assert_eq!(mesh.position.len(), 6 * rings, "{mode}");
        assert!(notes.remarks[0].starts_with(&format!("{said} drawn as tubes")), "{:?}", notes.remarks);
    }
    let both = "{\"mode\":3,\"attributes\":{\"POSITION\":0}},{\"mode\":5,\"attributes\":{\"POSITION\":0}}";
    let (mesh, notes) = read("a.glb", &of_floats(&square, "", both, &accessor(0, 4, "VEC3")));
    assert_eq!((mesh.triangles.len(), notes.unused), (2, vec!["lines".to_owned()]));
}
