//! Files that were written: channels, values, metadata, and that they appear whole or not at all.
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use exr::prelude::*;
use organza::output::{Metadata, check_target, write, write_atomically};
use organza::scene::LayerChoice;
use splat_core::{LayerData, Layers};
use std::fs;
use std::path::Path;

fn layers() -> Layers {
    let mut layers = Layers { size: [3, 2], ..Layers::default() };
    let rgb = |scale: f32| LayerData::Rgb((0..6).map(|i| [i as f32 * scale, 0.5, 1.0]).collect());
    layers.insert("beauty", rgb(0.25));
    layers.insert("alpha", LayerData::Scalar(vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.0]));
    layers.insert("direct", rgb(0.125));
    layers.insert("shadow", LayerData::Scalar(vec![0.5; 6]));
    layers.insert("normal", LayerData::Rgb(vec![[0.0, 0.0, 1.0]; 6]));
    for depth in ["depth.first", "depth.median", "depth.mean", "depth.sigma"] {
        layers.insert(depth, LayerData::Scalar(vec![f32::INFINITY, 1.0, 2.0, 3.0, 4.0, 5.0]));
    }
    layers.insert("object", LayerData::Id(vec![u32::MAX, 0, 1, 2, 3, 16_777_217]));
    layers
}

fn metadata() -> Metadata {
    Metadata {
        scene_sha256: "ab".repeat(32),
        technique: "points".into(),
        seed: u64::MAX,
        backend: "cpu".into(),
        sets: Some(12),
        exposure: 1.0,
    }
}

fn read_exr(path: &Path) -> FlatImage {
    read()
        .no_deep_data()
        .largest_resolution_level()
        .all_channels()
        .all_layers()
        .all_attributes()
        .from_file(path)
        .unwrap()
}

fn samples<'a>(image: &'a FlatImage, name: &str) -> &'a FlatSamples {
    &image.layer_data[0].channel_data.list.iter().find(|c| c.name.eq(name)).unwrap().sample_data
}

#[test]
fn an_exr_file_has_every_layer_once_and_exactly() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let report = write(&layers(), &metadata(), &path, false).unwrap();
    assert_eq!((report.clamped, report.not_a_number), (0, 0));
    assert_eq!(report.bytes, fs::metadata(&path).unwrap().len());
    let image = read_exr(&path);
    assert_eq!(image.layer_data.len(), 1);
    let names: Vec<String> = image.layer_data[0].channel_data.list.iter().map(|c| c.name.to_string()).collect();
    assert_eq!(
        names.join(" "),
        "A B G N.X N.Y N.Z R Z depth.first.Z depth.mean.Z depth.median.Z depth.sigma.Z direct.B direct.G direct.R \
         object.id shadow.A"
    );
    assert_eq!(*samples(&image, "R"), FlatSamples::F32(vec![0.0, 0.25, 0.5, 0.75, 1.0, 1.25]));
    assert_eq!(*samples(&image, "direct.R"), FlatSamples::F32(vec![0.0, 0.125, 0.25, 0.375, 0.5, 0.625]));
    assert_eq!(*samples(&image, "Z"), FlatSamples::F32(vec![f32::INFINITY, 1.0, 2.0, 3.0, 4.0, 5.0]));
    assert_eq!(*samples(&image, "object.id"), FlatSamples::U32(vec![u32::MAX, 0, 1, 2, 3, 16_777_217]));
}

#[test]
fn an_exr_file_says_how_it_was_made() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    write(&layers(), &metadata(), &path, false).unwrap();
    let image = read_exr(&path);
    let attribute = |name: &str| match image.layer_data[0].attributes.other.get(&Text::from(name)) {
        Some(AttributeValue::Text(text)) => text.to_string(),
        other => panic!("{name}: {other:?}"),
    };
    assert_eq!(attribute("organza:version"), env!("CARGO_PKG_VERSION"));
    assert_eq!(attribute("organza:scene_sha256"), "ab".repeat(32));
    assert_eq!(attribute("organza:technique"), "points");
    assert_eq!(attribute("organza:seed"), u64::MAX.to_string());
    assert_eq!(attribute("organza:backend"), "cpu");
    assert_eq!(attribute("organza:sets"), "12");
}

#[test]
fn ou3_half_is_for_colours_alone_and_clamps() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    let mut layers = layers();
    layers.insert("beauty", LayerData::Rgb(vec![[65_520.0, -1e9, 1e-8]; 6]));
    let report = write(&layers, &metadata(), &path, true).unwrap();
    assert_eq!(report.clamped, 12);
    let image = read_exr(&path);
    let half = |x: f32| f16::from_f32(x);
    assert_eq!(*samples(&image, "R"), FlatSamples::F16(vec![half(65_504.0); 6]));
    assert_eq!(*samples(&image, "G"), FlatSamples::F16(vec![half(-65_504.0); 6]));
    assert!(matches!(samples(&image, "depth.first.Z"), FlatSamples::F32(_)));
    assert!(matches!(samples(&image, "N.X"), FlatSamples::F32(_)));
}

#[test]
fn a_png_file_is_exposed_clamped_and_srgb() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.png");
    write(&layers(), &metadata(), &path, false).unwrap();
    let bytes = fs::read(&path).unwrap();
    assert_eq!(bytes[..8], *b"\x89PNG\r\n\x1a\n");
    // Width 3, height 2, 8 bits, RGB.
    assert_eq!(bytes[16..26], [0, 0, 0, 3, 0, 0, 0, 2, 8, 2]);
}

#[test]
fn only_the_layers_that_were_asked_for_are_kept() {
    let mut choice = LayerChoice::default();
    assert!(choice.add("depth") && choice.add("direct") && !choice.add("dirct"));
    let mut kept = layers();
    choice.keep(&mut kept);
    let names: Vec<&str> = kept.images.keys().copied().collect();
    assert_eq!(names, ["alpha", "beauty", "depth.first", "depth.mean", "depth.median", "depth.sigma", "direct"]);
    assert!(choice.set().depth && choice.set().effects && !choice.set().normal);
}

#[test]
fn ou1_pictures_of_one_pixel_and_one_row_are_written() {
    let folder = tempfile::tempdir().unwrap();
    for size in [[1u32, 1], [1, 999], [999, 1]] {
        let n = (size[0] * size[1]) as usize;
        let mut layers = Layers { size, ..Layers::default() };
        layers.insert("beauty", LayerData::Rgb(vec![[0.5; 3]; n]));
        layers.insert("alpha", LayerData::Scalar(vec![1.0; n]));
        for name in ["a.exr", "a.png"] {
            write(&layers, &metadata(), &folder.path().join(name), false).unwrap();
        }
        let image = read_exr(&folder.path().join("a.exr"));
        assert_eq!(image.layer_data[0].size, Vec2(size[0] as usize, size[1] as usize));
    }
}

#[test]
fn targets_are_checked_without_touching_them() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    check_target(&path, false, &[]).unwrap();
    assert_eq!(fs::read_dir(&folder).unwrap().count(), 0);
    fs::write(&path, "old").unwrap();
    assert_eq!(check_target(&path, false, &[]).unwrap_err().exit_code(), 4);
    check_target(&path, true, &[]).unwrap();
    assert_eq!(check_target(&path, true, std::slice::from_ref(&path)).unwrap_err().exit_code(), 4);
    assert_eq!(check_target(folder.path(), true, &[]).unwrap_err().exit_code(), 4);
    assert_eq!(check_target(&folder.path().join("no/a.exr"), true, &[]).unwrap_err().exit_code(), 4);
    assert_eq!(fs::read(&path).unwrap(), b"old");
}

#[cfg(unix)]
#[test]
fn a_link_goes_on_pointing_where_it_does() {
    let folder = tempfile::tempdir().unwrap();
    let (real, link) = (folder.path().join("real.exr"), folder.path().join("link.exr"));
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink("real.exr", &link).unwrap();
    write_atomically(&link, b"new").unwrap();
    assert_eq!(fs::read(&real).unwrap(), b"new");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
}

/// A small file system of its own; `None` where this process may not mount one.
#[cfg(target_os = "linux")]
struct SmallDisk(tempfile::TempDir);

#[cfg(target_os = "linux")]
impl SmallDisk {
    fn mount() -> Option<Self> {
        let folder = tempfile::tempdir().unwrap();
        let mut mount = std::process::Command::new("mount");
        mount.args(["-t", "tmpfs", "-o", "size=64k", "tmpfs"]).arg(folder.path()).stderr(std::process::Stdio::null());
        mount.status().is_ok_and(|s| s.success()).then_some(Self(folder))
    }
}

#[cfg(target_os = "linux")]
impl Drop for SmallDisk {
    fn drop(&mut self) {
        let _ = std::process::Command::new("umount").arg(self.0.path()).status();
    }
}

#[cfg(target_os = "linux")]
#[test]
fn bi32_a_full_disk_leaves_the_old_file_and_no_other() {
    // Writing to /dev/full fails like a full disk for everyone; the file system of its own needs a right to mount.
    let full = fs::write("/dev/full", b"x").unwrap_err();
    assert_eq!(full.kind(), std::io::ErrorKind::StorageFull);
    let Some(disk) = SmallDisk::mount() else { return };
    let path = disk.0.path().join("a.exr");
    fs::write(&path, b"old").unwrap();
    let error = write_atomically(&path, &vec![7; 1 << 20]).unwrap_err();
    assert_eq!((error.exit_code(), error.hint()), (4, "free some space"));
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(fs::read_dir(disk.0.path()).unwrap().count(), 1);
}
