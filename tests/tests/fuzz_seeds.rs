//! Seeds of fuzzing are what their target reads: one that is refused at its first word leads the fuzzer nowhere.

use field::ExpressionField;
use organza::scene::{LoadOptions, parse};
use organza::{Progress, RenderOptions, render};
use read::{Loaded, ReadParams, bytes, file};
use std::fs;
use std::path::Path;

/// The seeds of a target, by their paths.
fn seeds(target: &str) -> Vec<(String, Vec<u8>)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../fuzz/seeds").join(target);
    let paths = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path());
    let seeds: Vec<(String, Vec<u8>)> = paths.map(|p| (p.display().to_string(), fs::read(p).unwrap())).collect();
    assert!(!seeds.is_empty(), "{target}");
    seeds
}

/// The bytes before and behind the first zero byte.
fn cut(data: &[u8]) -> (&[u8], &[u8]) {
    let end = data.iter().position(|byte| *byte == 0).unwrap();
    (&data[..end], &data[end + 1..])
}

#[test]
fn seeds_of_formulas_and_transfer_functions_parse() {
    for (path, seed) in seeds("expression") {
        let parsed = ExpressionField::parse(std::str::from_utf8(&seed).unwrap());
        assert!(parsed.is_ok(), "{path}: {parsed:?}");
    }
    let before = b"version = 1\ncamera = \"auto\"\n[[object]]\nname = \"a\"\nvolume = \"a.nrrd\"\ntransfer = ";
    for (path, seed) in seeds("transfer") {
        let parsed = parse("scene.toml".as_ref(), &[before, &seed[..]].concat(), &LoadOptions::default());
        assert!(parsed.is_ok(), "{path}: {}", parsed.unwrap_err());
    }
}

#[test]
fn seeds_of_slices_are_a_volume() {
    for (path, seed) in seeds("dicom") {
        let folder = tempfile::tempdir().unwrap();
        let (first, second) = seed.split_at(seed.len() / 2);
        fs::write(folder.path().join("a.dcm"), first).unwrap();
        fs::write(folder.path().join("b.dcm"), second).unwrap();
        let (loaded, _) = file(&folder.path().join("a.dcm"), &ReadParams::default(), None).unwrap();
        assert!(matches!(loaded, Loaded::Grid(grid) if grid.dims[2] == 2), "{path}");
    }
}

#[test]
fn seeds_of_files_with_others_beside_them_are_read_whole() {
    let targets = [
        ("obj_beside", "a.obj"),
        ("gltf_beside", "a.gltf"),
        ("metaimage_beside", "a.mhd"),
        ("nrrd_beside", "a.nhdr"),
        ("vti_beside", "a.vtm"),
        ("sog_beside", "meta.json"),
    ];
    for (target, name) in targets {
        for (path, seed) in seeds(target) {
            let folder = tempfile::tempdir().unwrap();
            let (first, mut rest) = cut(&seed);
            if target == "obj_beside" {
                let (materials, image) = cut(rest);
                fs::write(folder.path().join("c"), image).unwrap();
                rest = materials;
            }
            fs::write(folder.path().join("b"), rest).unwrap();
            fs::write(folder.path().join(name), first).unwrap();
            let (loaded, notes) = file(&folder.path().join(name), &ReadParams::default(), None).unwrap();
            let is_painted = |mesh: &splat_core::Mesh| mesh.color.windows(2).any(|colors| colors[0] != colors[1]);
            let is_whole = match &loaded {
                Loaded::Mesh(mesh) => is_painted(mesh),
                Loaded::Grid(grid) => grid.values.len() == 12,
                Loaded::Points(points) => points.gaussians.len() == 4,
                _ => false,
            };
            assert!(is_whole, "{path}: {loaded:?}, {notes:?}");
        }
    }
    for (path, seed) in seeds("image") {
        assert!(matches!(bytes("a", &seed, &ReadParams::default(), None), Ok((Loaded::Image(_), _))), "{path}");
    }
}

#[test]
fn seeds_of_scenes_with_data_are_drawn() {
    for (path, seed) in seeds("scene_data") {
        let folder = tempfile::tempdir().unwrap();
        let (text, data) = cut(&seed);
        fs::write(folder.path().join("b"), data).unwrap();
        let parsed = parse(&folder.path().join("scene.toml"), text, &LoadOptions::default());
        let mut scene = parsed.unwrap_or_else(|e| panic!("{path}: {e}"));
        scene.camera.size = [8, 8];
        let drawn = render(&scene, &RenderOptions::default(), &Progress::new());
        let layers = drawn.unwrap_or_else(|e| panic!("{path}: {e}")).layers;
        assert!(layers.scalar("alpha").unwrap().iter().any(|alpha| *alpha > 0.1), "{path}");
    }
}
