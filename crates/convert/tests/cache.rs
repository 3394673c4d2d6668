//! A folder of results changes no result, whatever lies in it, and stays within its limit.
#![cfg(feature = "cache")]

use convert::{Cache, Orientation, SurfelParams, raw_to_surfels};
use splat_core::glam::{DVec3, Vec3};
use splat_core::{Cloud, RawPoints, rng};
use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Arc;

fn hills(n: u64) -> RawPoints {
    let point = |i: u64| {
        let x = 9.0 * rng::unit_f32(1, 0, i, 0);
        let z = 9.0 * rng::unit_f32(1, 0, i, 1);
        Vec3::new(x, x.sin() * z.cos(), z)
    };
    RawPoints { position: (0..n).map(point).collect(), ..RawPoints::default() }
}

/// The cloud, and what the cache says.
fn converted(points: &RawPoints, params: &SurfelParams, folder: &Path, max_bytes: u64) -> (Cloud, String) {
    let cache = Arc::new(Cache::new(folder, max_bytes));
    let mut params = params.clone();
    params.splat.cache = Some(cache.clone());
    let cloud = raw_to_surfels(points, &params, None).unwrap().0;
    (cloud, cache.said().join("\n"))
}

fn files(folder: &Path) -> Vec<PathBuf> {
    fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect()
}

#[test]
fn what_was_kept_is_read_and_gives_the_same_bits() {
    let folder = tempfile::tempdir().unwrap();
    let inner = folder.path().join("made/by/it");
    let points = hills(1000);
    for orientation in [Orientation::Propagate, Orientation::Viewpoint(DVec3::Y), Orientation::Auto(DVec3::Y)] {
        let mut params = SurfelParams { orientation, ..SurfelParams::default() };
        let plain = raw_to_surfels(&points, &params, None).unwrap().0;
        let (first, said) = converted(&points, &params, &inner, 1 << 20);
        assert!(said.contains("are kept in"), "{said}");
        let (second, said) = converted(&points, &params, &inner, 1 << 20);
        assert!(said.starts_with("normals and areas of object 'object' were read from"), "{said}");
        assert!(first == plain && second == plain);
        // Colour, opacity and the order of the points ask nothing new of neighbours.
        (params.splat.color, params.opacity) = ([0.5; 3], 0.25);
        let reversed = RawPoints { position: points.position.iter().rev().copied().collect(), ..RawPoints::default() };
        assert!(converted(&reversed, &params, &inner, 1 << 20).1.contains("were read from"));
    }
    // Other points, and another number of neighbours.
    let more = SurfelParams { neighbours: 11, ..SurfelParams::default() };
    assert!(!converted(&points, &more, &inner, 1 << 20).1.contains("were read from"));
    assert!(!converted(&hills(999), &SurfelParams::default(), &inner, 1 << 20).1.contains("were read from"));
}

#[test]
fn damaged_and_foreign_files_are_made_anew() {
    let folder = tempfile::tempdir().unwrap();
    let points = hills(200);
    let params = SurfelParams::default();
    let (plain, _) = converted(&points, &params, folder.path(), 1 << 20);
    let file = files(folder.path()).pop().unwrap();
    let good = fs::read(&file).unwrap();
    let flipped = |at: usize| {
        let mut bytes = good.clone();
        bytes[at] ^= 4;
        bytes
    };
    let cut = |n: usize| good[..n].to_vec();
    for bad in [flipped(3), flipped(20), flipped(50), flipped(81), cut(0), cut(79), cut(80), cut(good.len() - 32)] {
        fs::write(&file, bad).unwrap();
        let (cloud, said) = converted(&points, &params, folder.path(), 1 << 20);
        assert!(cloud == plain && said.contains("is damaged; normals and areas"), "{said}");
        assert_eq!(fs::read(&file).unwrap(), good);
    }
    fs::remove_file(&file).unwrap();
    fs::create_dir(&file).unwrap();
    let (cloud, said) = converted(&points, &params, folder.path(), 1 << 20);
    assert!(cloud == plain && said.contains("are found anew") && said.contains("cannot be kept here"), "{said}");
}

#[test]
fn what_no_points_have_is_made_anew_whatever_its_hash() {
    use sha2::{Digest, Sha256};
    let folder = tempfile::tempdir().unwrap();
    let points = hills(200);
    let params = SurfelParams::default();
    let (plain, _) = converted(&points, &params, folder.path(), 1 << 20);
    let file = files(folder.path()).pop().unwrap();
    let good = fs::read(&file).unwrap();
    // Behind mark, key and hash the first place: a normal, what its neighbours lie on, an area, a spacing, two more lengths.
    let changes = [(0, 9.0f32.to_bits()), (8, f32::NAN.to_bits()), (12, 3), (20, 0xfff0_0000), (28, 0x7ff0_0000)];
    for (at, word) in changes.into_iter().chain([(32, f32::INFINITY.to_bits()), (44, (-1.0f32).to_bits())]) {
        let mut made_up = good.clone();
        made_up[80 + at..84 + at].copy_from_slice(&word.to_le_bytes());
        let hash = Sha256::digest(&made_up[80..]);
        made_up[48..80].copy_from_slice(&hash);
        fs::write(&file, made_up).unwrap();
        let (cloud, said) = converted(&points, &params, folder.path(), 1 << 20);
        assert!(cloud == plain && said.contains("holds what no points have; normals and areas"), "{at}: {said}");
        assert_eq!(fs::read(&file).unwrap(), good);
    }
}

#[test]
fn a_folder_that_is_none_is_said_and_stops_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("file");
    fs::write(&file, "mine").unwrap();
    let points = hills(50);
    let params = SurfelParams::default();
    let (cloud, said) = converted(&points, &params, &file, 1 << 20);
    assert!(said.contains("cannot be kept here"), "{said}");
    assert!(cloud == raw_to_surfels(&points, &params, None).unwrap().0);
    assert_eq!(fs::read_to_string(&file).unwrap(), "mine");
}

#[test]
fn what_was_not_used_for_longest_goes_first_and_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let foreign = folder.path().join("notes.txt");
    fs::write(&foreign, vec![b'x'; 11_000]).unwrap();
    let params = SurfelParams::default();
    let old = std::time::SystemTime::UNIX_EPOCH;
    // Each takes 80 + 100·48 bytes: two fit.
    let limit = 10_500;
    for n in [100, 101] {
        converted(&hills(n), &params, folder.path(), limit);
    }
    for file in files(folder.path()) {
        fs::File::options().append(true).open(file).unwrap().set_modified(old).unwrap();
    }
    assert!(converted(&hills(100), &params, folder.path(), limit).1.contains("were read from"));
    converted(&hills(102), &params, folder.path(), limit);
    assert!(foreign.exists() && files(folder.path()).len() == 3);
    assert!(converted(&hills(100), &params, folder.path(), limit).1.contains("were read from"));
    assert!(!converted(&hills(101), &params, folder.path(), limit).1.contains("were read from"));
    let (_, said) = converted(&hills(400), &params, folder.path(), limit);
    assert!(said.ends_with("are more than a cache of 10500 bytes keeps"), "{said}");
    assert!(files(folder.path()).len() == 3);
}
