//! OBJ with MTL: colours of materials, their textures, and files that are not opened.
#![cfg(all(feature = "off", feature = "gltf"))]

use crate::read_samples::{image, load};
use read::{Fault, Loaded, Notes, ReadParams, file};
use splat_core::Mesh;
use splat_core::glam::Vec3;
use std::path::{Path, PathBuf};

const OBJ: &str = "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n\
    usemtl red one\nf 1/1 2/2 3/3\nusemtl green\nf 1/1 3/3 4/4\n";
const MTL: &str = "# two materials\nnewmtl red one\nKd 1 0 0\nNs 10\nnewmtl green\n  Kd 0 0.5 0\nd 0.5\n";

fn folder(name: &str) -> PathBuf {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(name);
    std::fs::create_dir_all(folder.join("sub")).unwrap();
    folder
}

fn read(folder: &Path, obj: &str) -> (Mesh, Notes) {
    std::fs::write(folder.join("a.obj"), obj).unwrap();
    match file(&folder.join("a.obj"), &ReadParams::default(), None).unwrap() {
        (Loaded::Mesh(mesh), notes) => (mesh, notes),
        other => panic!("{other:?}"),
    }
}

/// Colours of the corners of each triangle.
fn colors(mesh: &Mesh) -> Vec<[[f32; 3]; 3]> {
    mesh.triangles.iter().map(|t| t.map(|v| mesh.color[v as usize])).collect()
}

#[test]
fn faces_have_the_diffuse_colours_of_their_materials() {
    let folder = folder("mtl-colours");
    std::fs::write(folder.join("a.mtl"), MTL).unwrap();
    let (mesh, notes) = read(&folder, OBJ);
    assert_eq!(colors(&mesh), [[[1.0, 0.0, 0.0]; 3], [[0.0, 0.5, 0.0]; 3]]);
    // Two vertices are split where the materials meet, and shaded as one.
    assert_eq!((mesh.position.len(), mesh.normal), (6, vec![Vec3::Z; 6]));
    assert_eq!(notes.unused, ["Ns", "vt"]);
    assert!(notes.remarks.is_empty(), "{:?}", notes.remarks);
    let opacities = mesh.triangles.iter().map(|t| t.map(|v| mesh.opacity[v as usize]));
    assert_eq!(opacities.collect::<Vec<_>>(), [[1.0; 3], [0.5; 3]]);
    std::fs::write(folder.join("a.mtl"), MTL.replace("d 0.5", "d 2\nTr 0.25")).unwrap();
    let (mesh, notes) = read(&folder, OBJ);
    assert_eq!(mesh.opacity.iter().copied().fold(1.0, f32::min), 0.75);
    assert_eq!(notes.remarks, ["a material states no number from 0 to 1 as its `d`, which is left out"]);
    std::fs::write(folder.join("a.mtl"), MTL).unwrap();
    // What is clear is not there, and counts for no bounds.
    std::fs::write(folder.join("a.mtl"), MTL.replace("d 0.5", "d 0")).unwrap();
    let far = OBJ.replace("v 0 1 0", "v 0 90 0");
    let (mesh, _) = read(&folder, &far);
    assert_eq!((mesh.triangles.len(), colors(&mesh)), (1, vec![[[1.0, 0.0, 0.0]; 3]]));
    assert_eq!(mesh.position, [Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Y]);
    std::fs::write(folder.join("a.mtl"), MTL).unwrap();
    // In a folder below, by another system's separator, of several files; the later of two materials counts.
    std::fs::write(folder.join("sub/b.mtl"), "newmtl green\nKd 0.25\n").unwrap();
    let (mesh, _) = read(&folder, &OBJ.replace("mtllib a.mtl", "mtllib a.mtl sub\\b.mtl"));
    assert_eq!(colors(&mesh)[1], [[0.25; 3]; 3]);
    // Faces of no material are white; without any, there are no colours.
    let (mesh, notes) = read(&folder, &OBJ.replace("usemtl green", "usemtl blue"));
    assert_eq!((colors(&mesh)[1], notes.unused.contains(&"usemtl".to_owned())), ([[1.0; 3]; 3], true));
    let (mesh, _) = read(&folder, &OBJ.replace("usemtl", "g"));
    assert_eq!((mesh.color.len(), mesh.position.len()), (0, 4));
    // Colours of vertices are kept before those of materials.
    let colored = OBJ.replace("v 0 0 0", "v 0 0 0 0 0 1").replace("v 1 0 0", "v 1 0 0 0 0 1");
    let colored = colored.replace("v 1 1 0", "v 1 1 0 0 0 1").replace("v 0 1 0", "v 0 1 0 0 0 1");
    let (mesh, notes) = read(&folder, &colored);
    assert_eq!(
        (colors(&mesh)[0], notes.unused),
        ([[0.0, 0.0, 1.0]; 3], ["Ns", "vt", "Kd", "d"].map(str::to_owned).to_vec())
    );
}

#[test]
fn textures_of_materials_are_drawn_upright() {
    let folder = folder("mtl-textures");
    std::fs::write(
        folder.join("a.mtl"),
        "newmtl red one\nKd 1 1 0.5\nmap_Kd sub/my colours.png\nnewmtl green\nKd 0 1 0\n",
    )
    .unwrap();
    std::fs::write(folder.join("sub/my colours.png"), image(4, image::ImageFormat::Png)).unwrap();
    let (mesh, notes) = read(&folder, OBJ);
    assert!(notes.unused.is_empty() && notes.remarks.len() == 1, "{notes:?}");
    assert!(mesh.triangles.len() > 8 && (mesh.area() - 1.0).abs() < 1e-6);
    let color_near = |x: f32, y: f32| {
        let distance = |v: &u32| mesh.position[*v as usize].distance(Vec3::new(x, y, 0.0));
        let used = mesh.triangles.iter().flatten();
        mesh.color[*used.min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap() as usize]
    };
    // The image's lower half is blue, its upper right green; the factor halves blue.
    assert_eq!((color_near(0.8, 0.1), color_near(0.9, 0.85)), ([0.0, 0.0, 0.5], [0.0, 1.0, 0.0]));
    // Without texture coordinates the face has the factor alone.
    let (mesh, _) = read(&folder, &OBJ.replace("f 1/1 2/2 3/3", "f 1 2 3"));
    assert_eq!(colors(&mesh)[0], [[1.0, 1.0, 0.5]; 3]);
    let bad = OBJ.replace("vt 1 1", "vt 1 nan");
    std::fs::write(folder.join("a.obj"), bad).unwrap();
    let error = file(&folder.join("a.obj"), &ReadParams::default(), None).unwrap_err();
    assert!(error.expected.contains("texture coordinates that are finite"), "{error}");
    std::fs::write(folder.join("sub/my colours.png"), b"no image").unwrap();
    std::fs::write(folder.join("a.obj"), OBJ).unwrap();
    let error = file(&folder.join("a.obj"), &ReadParams::default(), None).unwrap_err();
    assert!(error.expected.contains("a whole PNG or JPEG image as texture 'sub/my colours.png'"), "{error}");
}

#[test]
fn ba12_material_files_are_opened_only_in_the_folder_or_below() {
    let folder = folder("ba12");
    std::fs::write(folder.join("../outside.mtl"), MTL).unwrap();
    let pipe = folder.join("pipe.mtl");
    let _ = std::fs::remove_file(&pipe);
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let _ = std::fs::remove_file(folder.join("link.mtl"));
    std::os::unix::fs::symlink("../outside.mtl", folder.join("link.mtl")).unwrap();
    let absolute = folder.join("a.mtl");
    for library in [
        "../outside.mtl",
        "/etc/passwd",
        "https://example.org/a.mtl",
        "pipe.mtl",
        "missing.mtl",
        "link.mtl",
        "C:\\a\\missing.mtl",
        "sub",
        absolute.to_str().unwrap(),
    ] {
        // Opening the pipe would wait for ever.
        let (mesh, notes) = read(&folder, &OBJ.replace("a.mtl", library));
        assert!(mesh.color.is_empty() && mesh.position.len() == 4, "{library}");
        assert_eq!(notes.remarks.len(), 1, "{library}: {notes:?}");
        assert!(notes.remarks[0].starts_with("the material file") && notes.remarks[0].ends_with("it is left out"));
        assert_eq!(notes.unused, ["usemtl", "vt"], "{library}");
    }
    let Loaded::Mesh(mesh) = load("a.obj", OBJ.as_bytes()).unwrap() else { panic!("no mesh") };
    assert!(mesh.color.is_empty());
}

#[test]
fn faults_of_a_material_file_are_told_with_both_places() {
    let folder = folder("mtl-faults");
    for (from, to, expected) in [
        ("Kd 1 0 0", "Kd 1 0 x", "in 'a.mtl':3:8: a finite decimal number"),
        ("Kd 1 0 0", "Kd 1 0 1.5", "in 'a.mtl':3:8: a colour from 0 to 1"),
        ("Kd 1 0 0", "Kd 1 0", "in 'a.mtl':3:1: Kd R G B"),
    ] {
        std::fs::write(folder.join("a.mtl"), MTL.replace(from, to)).unwrap();
        std::fs::write(folder.join("a.obj"), OBJ).unwrap();
        let error = file(&folder.join("a.obj"), &ReadParams::default(), None).unwrap_err();
        assert_eq!((error.fault, error.expected.as_str()), (Fault::Input, expected), "{error}");
        assert!(error.to_string().contains("a.obj:1: "), "{error}");
    }
}
