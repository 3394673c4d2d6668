//! Files that were written: channels, values, metadata, and that they appear whole or not at all.

use exr::prelude::*;
use organza::output::{self, Metadata, Target, Targets, WriteReport};
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
        scene: "version = 1\n".into(),
        left_out: String::new(),
        technique: "points".into(),
        seed: u64::MAX,
        backend: "cpu".into(),
        sets: Some(12),
        exposure: 1.0,
    }
}

fn write(
    layers: &Layers,
    metadata: &Metadata,
    path: &Path,
    half: bool,
) -> std::result::Result<WriteReport, organza::Error> {
    Ok(output::write(
        layers,
        metadata,
        &Target::new(path, true)?,
        &output::Params { half, ..output::Params::default() },
    )?)
}

/// Writes to a place, whatever is there.
fn replace(path: &Path, bytes: &[u8]) -> std::result::Result<(), organza::Error> {
    Ok(Target::new(path, true)?.write(bytes)?)
}

/// The exit code of the command where this goes wrong.
fn code(error: impl Into<organza::Error>) -> u8 {
    error.into().exit_code()
}

fn names(folder: &Path) -> Vec<String> {
    let name = |e: std::io::Result<fs::DirEntry>| e.unwrap().file_name().to_string_lossy().into_owned();
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(name).collect();
    names.sort();
    names
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
    let check = |path: &Path, force: bool, inputs: &[std::path::PathBuf]| {
        let mut targets = Targets::default();
        targets.add_inputs(inputs);
        targets.add(path, force).map_err(code)
    };
    check(&path, false, &[]).unwrap();
    assert!(names(folder.path()).is_empty());
    fs::write(&path, "old").unwrap();
    assert_eq!(check(&path, false, &[]), Err(4));
    check(&path, true, &[]).unwrap();
    assert_eq!(check(&path, true, std::slice::from_ref(&path)), Err(4));
    assert_eq!(check(folder.path(), true, &[]), Err(4));
    assert_eq!(check(&folder.path().join("no/a.exr"), true, &[]), Err(4));
    assert_eq!(check("-".as_ref(), true, &[]), Err(4));
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(names(folder.path()), ["a.exr"]);
}

#[test]
fn nothing_is_there_while_frames_are_checked() {
    // Not even kill -9 then leaves anything.
    let folder = tempfile::tempdir().unwrap();
    let mut targets = Targets::default();
    for name in ["f.0000.exr", "f.0001.exr", "f.0001.png", "F.0002.exr", "ö.0001.exr", "ö.0002.exr"] {
        targets.add(&folder.path().join(name), false).unwrap();
        assert!(names(folder.path()).is_empty(), "{name}");
    }
    for twice in ["f.0001.exr", "ö.0002.exr"] {
        assert_eq!(targets.add(&folder.path().join(twice), false).map_err(code), Err(4), "{twice}");
    }
    // A name that no file system takes is refused beside others of its kind, and alone.
    let long = "n".repeat(300);
    assert_eq!(targets.add(&folder.path().join(&long), false).map_err(code), Err(4));
    assert_eq!(targets.add(&folder.path().join(long + "7"), false).map_err(code), Err(4));
    assert!(names(folder.path()).is_empty());
}

#[test]
fn one_file_in_two_spellings_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    fs::create_dir(folder.path().join("b")).unwrap();
    for other in ["./a.exr", "b/../a.exr", "b/.././/a.exr"] {
        let mut targets = Targets::default();
        targets.add(&folder.path().join("a.exr"), false).unwrap();
        let error = targets.add(&folder.path().join(other), false).unwrap_err();
        assert!(error.to_string().contains("named twice"), "{other}: {error}");
        assert_eq!(code(error), 4);
        targets.add(&folder.path().join("b/a.exr"), false).unwrap();
    }
    // Nothing of the checks is left.
    assert_eq!(names(folder.path()), ["b"]);
    assert!(names(&folder.path().join("b")).is_empty());
}

#[cfg(unix)]
#[test]
fn one_file_by_links_and_hard_links_is_refused() {
    use std::os::unix::fs::symlink;
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    fs::write(path("old.exr"), "old").unwrap();
    fs::hard_link(path("old.exr"), path("hard.exr")).unwrap();
    symlink("old.exr", path("soft.exr")).unwrap();
    symlink(".", path("here")).unwrap();
    for [one, other] in [
        ["old.exr", "hard.exr"],
        ["hard.exr", "soft.exr"],
        ["soft.exr", "here/old.exr"],
        ["new.exr", "here/new.exr"],
        ["here/here/new.exr", "new.exr"],
    ] {
        let mut targets = Targets::default();
        targets.add(&path(one), true).unwrap();
        let error = targets.add(&path(other), true).unwrap_err();
        assert!(error.to_string().contains("named twice"), "{one} {other}: {error}");
        assert_eq!(code(error), 4);
        // As an input it is refused too.
        let mut targets = Targets::default();
        targets.add_inputs(&[path(one)]);
        assert_eq!(targets.add(&path(other), true).is_err(), path(one).exists(), "{one} {other}");
    }
}

#[cfg(unix)]
#[test]
fn a_link_goes_on_pointing_where_it_does() {
    let folder = tempfile::tempdir().unwrap();
    let elsewhere = tempfile::tempdir().unwrap();
    let real = elsewhere.path().join("real.exr");
    let link = folder.path().join("link.exr");
    fs::write(&real, "old").unwrap();
    std::os::unix::fs::symlink(&real, &link).unwrap();
    replace(&link, b"new").unwrap();
    assert_eq!(fs::read(&real).unwrap(), b"new");
    assert!(fs::symlink_metadata(&link).unwrap().is_symlink());
    assert_eq!(code(Target::new(&link, false).unwrap_err()), 4);
}

#[cfg(unix)]
#[test]
fn what_is_no_regular_file_is_never_replaced() {
    use std::os::unix::fs::{FileTypeExt, symlink};
    let folder = tempfile::tempdir().unwrap();
    let path = |name: &str| folder.path().join(name);
    // A pipe stands for the null device, which a fault would take from the machine.
    let made = std::process::Command::new("mkfifo").arg(path("pipe")).status().unwrap();
    assert!(made.success());
    symlink("pipe", path("x.png")).unwrap();
    symlink("nothing", path("y.png")).unwrap();
    symlink("z.png", path("z.png")).unwrap();
    let _socket = std::os::unix::net::UnixListener::bind(path("socket")).unwrap();
    for name in ["pipe", "x.png", "y.png", "z.png", "socket"] {
        for force in [false, true] {
            assert_eq!(code(Target::new(&path(name), force).unwrap_err()), 4, "{name} {force}");
        }
    }
    assert_eq!(code(Target::new("/dev/null".as_ref(), true).unwrap_err()), 4);
    // One that comes in the middle is not replaced either.
    let target = Target::new(&path("late.png"), true).unwrap();
    symlink("pipe", path("late.png")).unwrap();
    assert_eq!(code(target.write(b"new").unwrap_err()), 4);
    assert!(fs::metadata(path("pipe")).unwrap().file_type().is_fifo());
    assert_eq!(names(folder.path()), ["late.png", "pipe", "socket", "x.png", "y.png", "z.png"]);
}

#[test]
fn what_appears_in_the_middle_is_replaced_by_force_alone() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    for (force, left) in [(false, "other"), (true, "mine")] {
        let target = Target::new(&path, force).unwrap();
        fs::write(&path, "other").unwrap();
        assert_eq!(target.write(b"mine").map_err(code), if force { Ok(()) } else { Err(4) });
        assert_eq!(fs::read(&path).unwrap(), left.as_bytes());
        assert_eq!(names(folder.path()), ["a.exr"]);
        fs::remove_file(&path).unwrap();
    }
}

#[test]
fn bi32_each_step_that_fails_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("a.exr");
    // No temporary file can be made: its folder is gone.
    let gone = folder.path().join("gone");
    fs::create_dir(&gone).unwrap();
    let target = Target::new(&gone.join("a.exr"), false).unwrap();
    fs::remove_dir(&gone).unwrap();
    assert_eq!(code(target.write(b"new").unwrap_err()), 4);
    // The name cannot be given: a folder has it by now.
    let target = Target::new(&path, true).unwrap();
    fs::create_dir(&path).unwrap();
    assert_eq!(code(target.write(b"new").unwrap_err()), 4);
    assert_eq!(names(folder.path()), ["a.exr"]);
    fs::remove_dir(&path).unwrap();
    // What others have left does not block anyone, whatever the number of their process, and stays theirs.
    let theirs = format!(".a.exr.tmp-{}", std::process::id());
    fs::write(folder.path().join(&theirs), "theirs").unwrap();
    replace(&path, b"new").unwrap();
    assert_eq!(fs::read(&path).unwrap(), b"new");
    assert_eq!(names(folder.path()), [&theirs, "a.exr"]);
}

#[cfg(unix)]
#[test]
fn outputs_have_the_permissions_that_others_have() {
    use std::os::unix::fs::PermissionsExt;
    let folder = tempfile::tempdir().unwrap();
    let [path, plain] = ["a.exr", "plain"].map(|name| folder.path().join(name));
    let mode = |path: &Path| fs::metadata(path).unwrap().permissions().mode() & 0o777;
    fs::write(&plain, "").unwrap();
    replace(&path, b"new").unwrap();
    assert_eq!(mode(&path), mode(&plain));
    fs::set_permissions(&path, fs::Permissions::from_mode(0o640)).unwrap();
    replace(&path, b"newer").unwrap();
    assert_eq!(mode(&path), 0o640);
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
    let error = replace(&path, &vec![7; 1 << 20]).unwrap_err();
    assert_eq!((error.exit_code(), error.hint()), (4, "free some space"));
    assert_eq!(fs::read(&path).unwrap(), b"old");
    assert_eq!(fs::read_dir(disk.0.path()).unwrap().count(), 1);
}

#[cfg(unix)]
#[test]
fn bi32_a_file_that_may_not_grow_so_far_leaves_the_old_one() {
    let place = organza_tests::Place::new(organza_tests::SMALL_SCENE);
    place.write("a.exr", "old");
    let program = organza_tests::organza();
    // Files of at most one block; without the signal the system answers with an error in the middle of writing.
    let mut shell = std::process::Command::new("sh");
    shell.args(["-c", "trap '' XFSZ; ulimit -f 1; exec \"$0\" render s.toml --size 96x96 -o a.exr --force"]);
    let out = shell.arg(program.get_program()).current_dir(place.folder()).output().unwrap();
    let text = String::from_utf8_lossy(&out.stderr);
    assert_eq!(out.status.code(), Some(4), "{text}");
    assert!(text.contains("a.exr: cannot write"), "{text}");
    assert_eq!((place.bytes("a.exr"), place.made()), (b"old".to_vec(), vec!["a.exr".to_owned()]));
}
