//! Every truncation and single-bit flips of a small file of each format: an error or something valid, never a panic, an abort or
//! a huge allocation.
//!
//! The work runs in a process of its own whose address space is limited, so an allocation far beyond the file fails it.
#![cfg(all(
    feature = "ply",
    feature = "obj",
    feature = "off",
    feature = "gltf",
    feature = "sog",
    feature = "nifti",
    feature = "vti",
    feature = "vtk",
    feature = "las",
    feature = "e57",
    feature = "exr",
    feature = "png",
    unix
))]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod every_sample;
mod read_samples;

use every_sample::{bodies, samples, text_samples, textured};
use read::{Fault, Loaded, ReadParams, bytes};
use read_samples::dicom::Dicom;
use read_samples::{e57, gzip, las, load, square_gltf};
use splat_core::MemoryAccount;
use std::process::Command;

const LIMITED: &str = "READ_TEST_LIMITED";
/// Address space of the limited process, KiB: its threads' stacks and heaps, and nothing near the 16 GB that one bit of
/// a LAZ file can ask for.
const ADDRESS_SPACE_KIB: u64 = 3 << 20;

/// Every how manieth bit is flipped: one in ten, and each where `ORGANZA_DEEP` is set, as `cargo xtask deep` does.
fn stride() -> usize {
    if std::env::var_os("ORGANZA_DEEP").is_some() { 1 } else { 10 }
}

/// Runs test `name` again with limited memory; true in the process that has to do the work.
fn limited(name: &str) -> bool {
    if std::env::var_os(LIMITED).is_some() {
        let refused = Vec::<u8>::new().try_reserve_exact(16 << 30).is_err();
        assert!(refused, "16 GB must be out of reach, or this test cannot fail");
        return true;
    }
    let output = Command::new("sh")
        .args(["-c", "ulimit -v $0; exec \"$@\""])
        .arg(ADDRESS_SPACE_KIB.to_string())
        .arg(std::env::current_exe().unwrap())
        .args(["--exact", name, "--nocapture", "--test-threads=1"])
        .env(LIMITED, "1")
        .env("RUST_BACKTRACE", "0")
        .env("RAYON_NUM_THREADS", "2")
        .output()
        .unwrap();
    let text = String::from_utf8_lossy(&output.stdout);
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{}\n{text}\n{}", output.status, &errors[errors.len().saturating_sub(4000)..]);
    assert!(text.contains("1 passed"), "{text}");
    false
}

fn valid(loaded: &Loaded) {
    match loaded {
        Loaded::Mesh(mesh) => mesh.validate().unwrap(),
        Loaded::Points(points) => points.validate().unwrap(),
        // A voxel that is no number is a gap.
        Loaded::Grid(grid) if grid.values.iter().any(|v| v.is_nan()) => {
            let mut filled = splat_core::Grid::clone(grid);
            filled.values.iter_mut().filter(|v| v.is_nan()).for_each(|v| *v = 0.0);
            filled.validate().unwrap();
        }
        Loaded::Grid(grid) => grid.validate().unwrap(),
        Loaded::Image(image) => image.validate().unwrap(),
        _ => panic!("unknown kind"),
    }
}

#[test]
fn ba05_every_truncation_is_refused() {
    if !limited("ba05_every_truncation_is_refused") {
        return;
    }
    let textured = textured().into_iter().map(|(name, content, _)| (name, content));
    let more = bodies().into_iter().filter(|(name, _)| name.ends_with(".vtu")).chain([("text.gltf", square_gltf())]);
    for (name, content) in samples().into_iter().chain(textured).chain(more) {
        let whole = load(name, &content).unwrap();
        for length in 0..content.len() {
            match load(name, &content[..length]) {
                Err(error) => assert!(error.to_string().starts_with(name), "{error}"),
                // A text file may end without its last line end.
                Ok(loaded) => {
                    assert_eq!((name, length), ("ascii.ply", content.len() - 1), "{name} cut at {length}");
                    assert_eq!(loaded, whole);
                }
            }
        }
    }
}

#[test]
fn every_flipped_bit_gives_an_error_or_a_valid_object() {
    if !limited("every_flipped_bit_gives_an_error_or_a_valid_object") {
        return;
    }
    // Whether the decoder of LAZ panics is not ours to choose; that the panic stays inside is.
    std::panic::set_hook(Box::new(|info| {
        assert!(read::panic_is_input_error(), "{info}");
    }));
    let mut accepted = Vec::new();
    for (name, content) in samples().into_iter().chain(text_samples()) {
        let ok = flip_each_bit(name, &content, 0..content.len(), &ReadParams::default());
        accepted.push(format!("{name}: {ok} of {} accepted", content.len() * 8 / stride()));
    }
    println!("{}", accepted.join("\n"));
}

#[test]
fn every_flipped_bit_of_a_texture_gives_an_error_or_a_valid_object() {
    if !limited("every_flipped_bit_of_a_texture_gives_an_error_or_a_valid_object") {
        return;
    }
    // A flipped size may make an image of noise, for which surfaces are divided as far as there is room.
    for (name, content, image) in textured() {
        let start = content.windows(image.len()).position(|w| w == image).unwrap();
        flip_each_bit(name, &content, start..start + image.len(), &few_bytes());
    }
}

/// With room for little.
fn few_bytes() -> ReadParams {
    ReadParams { memory: MemoryAccount::new(1 << 20), ..ReadParams::default() }
}

/// Flips each bit of a part of a file; gives how often something valid was read.
fn flip_each_bit(name: &str, content: &[u8], part: std::ops::Range<usize>, params: &ReadParams) -> usize {
    let mut damaged = content.to_vec();
    let mut accepted = 0;
    for bit in (part.start * 8..part.end * 8).step_by(stride()) {
        damaged[bit / 8] ^= 1 << (bit % 8);
        if let Ok((loaded, _)) = bytes(name, &damaged, params, None) {
            valid(&loaded);
            accepted += 1;
        }
        damaged[bit / 8] = content[bit / 8];
    }
    accepted
}

/// All but the voxels, for which there is no room: there would be a quarter of a million each time.
#[test]
fn every_flipped_bit_of_bodies_gives_an_error_or_a_valid_object() {
    if !limited("every_flipped_bit_of_bodies_gives_an_error_or_a_valid_object") {
        return;
    }
    for (name, content) in bodies() {
        let error = bytes(name, &content, &few_bytes(), None).unwrap_err().to_string();
        assert!(error.contains("for the voxels"), "{error}");
        flip_each_bit(name, &content, 0..content.len(), &few_bytes());
    }
}

#[test]
fn every_flipped_bit_of_levels_of_detail_gives_an_error_or_a_valid_object() {
    if !limited("every_flipped_bit_of_levels_of_detail_gives_an_error_or_a_valid_object") {
        return;
    }
    std::panic::set_hook(Box::new(|info| {
        assert!(read::panic_is_input_error(), "{info}");
    }));
    let content = read_samples::copc::copc(&[5, 20]);
    let params = ReadParams { most_points: Some(10), ..ReadParams::default() };
    // The record of COPC behind the header, and the hierarchy at the end: the rest is LAZ.
    for part in [375..375 + 54 + 160, content.len() - 3 * 32..content.len()] {
        flip_each_bit("levels.laz", &content, part, &params);
    }
}

/// The sums of its pages would tell all damage of a scan: here they are right again.
#[test]
fn every_flipped_bit_of_scans_with_right_sums_gives_an_error_or_a_valid_object() {
    if !limited("every_flipped_bit_of_scans_with_right_sums_gives_an_error_or_a_valid_object") {
        return;
    }
    let content = e57::e57();
    let mut damaged = content.clone();
    let mut accepted = 0;
    for bit in 0..content.len() * 8 {
        let page = bit / 8 / 1024 * 1024..bit / 8 / 1024 * 1024 + 1024;
        damaged[bit / 8] ^= 1 << (bit % 8);
        e57::sum(&mut damaged[page.clone()]);
        if let Ok(loaded) = load("scans.e57", &damaged) {
            valid(&loaded);
            accepted += 1;
        }
        damaged[page.clone()].copy_from_slice(&content[page]);
    }
    println!("{accepted} of {} accepted", content.len() * 8);
}

/// Damage beyond one bit: a byte of every place set to each of some values, in the formats with the most trust in them.
#[test]
fn every_byte_set_to_extremes_gives_an_error_or_a_valid_object() {
    if !limited("every_byte_set_to_extremes_gives_an_error_or_a_valid_object") {
        return;
    }
    for (name, content) in samples().into_iter().chain(text_samples()) {
        let mut damaged = content.clone();
        for at in (0..content.len()).step_by(stride()) {
            for value in [0x00, 0x7f, 0x80, 0xff] {
                damaged[at] = value;
                if let Ok(loaded) = load(name, &damaged) {
                    valid(&loaded);
                }
                let end = (at + 4).min(content.len());
                damaged[at..end].fill(value);
                if let Ok(loaded) = load(name, &damaged) {
                    valid(&loaded);
                }
                damaged[at..end].copy_from_slice(&content[at..end]);
            }
        }
    }
}

/// Seeded numbers (SplitMix64).
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) % n.max(1) as u64) as usize
    }
}

/// One to three injuries: bytes set, runs set or filled, swapped, cut out, doubled, the end cut off.
fn injured(content: &[u8], random: &mut Random) -> Vec<u8> {
    let mut out = content.to_vec();
    for _ in 0..=random.below(3) {
        let at = random.below(out.len());
        let end = (at + 1 + random.below(24)).min(out.len());
        match random.below(8) {
            0 => out[at] = random.below(256) as u8,
            1 => out[at..end].iter_mut().for_each(|b| *b = random.below(256) as u8),
            2 => out[at..end].fill([0x00, 0xff, 0x7f, 0x80, b'9', b' '][random.below(6)]),
            3 => {
                let other = random.below(out.len());
                out.swap(at, other);
            }
            4 => {
                let length = (end - at).min(out.len() / 2);
                let other = random.below(out.len() - length);
                let at = at.min(out.len() - length);
                let a = out[at..at + length].to_vec();
                let b = out[other..other + length].to_vec();
                out[at..at + length].copy_from_slice(&b);
                out[other..other + length].copy_from_slice(&a);
            }
            5 => drop(out.drain(at..end)),
            6 => {
                let run = out[at..end].to_vec();
                out.splice(at..at, run);
            }
            _ => out.truncate(at.max(1)),
        }
        if out.is_empty() {
            break;
        }
    }
    out
}

/// Also the stack is bounded: the tasks that decode have 2 MiB of it.
#[test]
fn thousands_of_injured_files_give_an_error_or_a_valid_object() {
    if !limited("thousands_of_injured_files_give_an_error_or_a_valid_object") {
        return;
    }
    std::panic::set_hook(Box::new(|info| {
        assert!(read::panic_is_input_error(), "{info}");
    }));
    let clouds =
        [("f1.laz", 1, 4000), ("f3.laz", 3, 4000), ("f6.laz", 6, 8000), ("f7.laz", 7, 8000), ("f8.laz", 8, 8000)];
    let clouds = clouds.map(|(name, format, times)| (name, las(format, 400, true), times / stride().min(4)));
    let small = samples().into_iter().chain(text_samples()).map(|(name, content)| (name, content, 2000 / stride()));
    for (name, content, times) in small.chain(clouds) {
        let mut random = Random(content.len() as u64);
        for _ in 0..times {
            if let Ok(loaded) = load(name, &injured(&content, &mut random)) {
                valid(&loaded);
            }
        }
    }
}

/// The file of the outdoor scene, with 50,000 points in a chunk.
#[test]
fn an_injured_survey_gives_an_error_or_a_valid_object() {
    if !limited("an_injured_survey_gives_an_error_or_a_valid_object") {
        return;
    }
    std::panic::set_hook(Box::new(|info| {
        assert!(read::panic_is_input_error(), "{info}");
    }));
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../assets/autzen/autzen_trim.laz");
    let content = std::fs::read(path).unwrap();
    let mut random = Random(1);
    for _ in 0..40 {
        if let Ok(loaded) = load("survey.laz", &injured(&content, &mut random)) {
            valid(&loaded);
        }
    }
}

/// Most memory that this process had, bytes.
fn peak() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|l| l.starts_with("VmHWM:")).unwrap();
    1024 * line.split_ascii_whitespace().nth(1).unwrap().parse::<u64>().unwrap()
}

/// 512 MiB of zeros in gzip.
fn zeros() -> Vec<u8> {
    let mut encoder = flate2::write::GzEncoder::new(Vec::new(), flate2::Compression::fast());
    let block = vec![0; 1 << 20];
    (0..512).for_each(|_| std::io::Write::write_all(&mut encoder, &block).unwrap());
    encoder.finish().unwrap()
}

/// 114 KB took up to 17 GB: neither packing counted the other, and all was unpacked before it was counted.
#[cfg(target_os = "linux")]
#[test]
fn ba15_gzip_inside_gzip_is_unpacked_no_further_than_its_header_says() {
    if !limited("ba15_gzip_inside_gzip_is_unpacked_no_further_than_its_header_says") {
        return;
    }
    let zeros = zeros();
    let file = |sizes: &str| {
        let header = format!("NRRD0004\ntype: uchar\ndimension: 3\nsizes: {sizes}\nencoding: gzip\n\n").into_bytes();
        gzip(&[header, zeros.clone()].concat())
    };
    let few = file("3 2 2");
    let many = file("1024 1024 512");
    let before = peak();
    let error = load("a.nrrd.gz", &few).unwrap_err().to_string();
    assert!(error.contains("expected 12 bytes of voxels (3 x 2 x 2 x 1 bytes), found more than 12"), "{error}");
    let error = load("a.nrrd.gz", &many).unwrap_err();
    assert_eq!(error.fault.exit_code(), 5, "{error}");
    let taken = peak() - before;
    let stored = few.len().max(many.len());
    assert!(taken < 64 << 20, "{taken} bytes for a file of {stored}");
    println!("{taken} bytes for a file of {stored}");
}

/// Of 200 MB of voxels there was a second copy while they were converted.
#[cfg(target_os = "linux")]
#[test]
fn a_volume_is_in_memory_once() {
    if !limited("a_volume_is_in_memory_once") {
        return;
    }
    let path = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("large.nrrd");
    let header = "NRRD0004\ntype: float\ndimension: 3\nsizes: 500 500 200\nendian: little\nencoding: raw\n\n";
    let mut file = std::fs::File::create(&path).unwrap();
    std::io::Write::write_all(&mut file, header.as_bytes()).unwrap();
    file.set_len(header.len() as u64 + 200_000_000).unwrap();
    let before = peak();
    let loaded = read::file(&path, &read::ReadParams::default(), None).unwrap().0;
    std::fs::remove_file(&path).unwrap();
    valid(&loaded);
    let ratio = (peak() - before) as f64 / 200e6;
    println!("{ratio:.2} of the voxels");
    assert!(ratio < 1.3, "{ratio:.2} of the voxels");
}

#[test]
fn memory_is_asked_for_before_it_is_taken_and_comes_back() {
    let files =
        samples().into_iter().chain(text_samples()).chain(textured().into_iter().map(|(name, of, _)| (name, of)));
    for (name, content) in files.chain(bodies()) {
        let within = |bytes: u64| ReadParams { memory: MemoryAccount::new(bytes), ..ReadParams::default() };
        let ample = within(1 << 30);
        let (loaded, _) = bytes(name, &content, &ample, None).unwrap_or_else(|e| panic!("{name}: {e}"));
        let peak = ample.memory.peak();
        let held = loaded.bytes();
        assert!(peak >= held && ample.memory.used() == 0, "{name}: {peak} bytes at a time for {held}");
        // As much is enough, and less than what is given is not.
        assert_eq!(bytes(name, &content, &within(peak), None).unwrap().0, loaded, "{name} within {peak}");
        let error = bytes(name, &content, &within(held - 1), None).unwrap_err();
        assert_eq!(error.fault, Fault::Limit, "{name} within {}: {error}", held - 1);
    }
}

/// One of two slices of a series is cut, has a bit flipped, and bytes set to extremes.
#[test]
fn every_damage_of_a_slice_of_dicom_gives_an_error_or_a_valid_object() {
    if !limited("every_damage_of_a_slice_of_dicom_gives_an_error_or_a_valid_object") {
        return;
    }
    let folder = std::path::Path::new(env!("CARGO_TARGET_TMPDIR")).join("damaged-dicom");
    std::fs::create_dir_all(&folder).unwrap();
    for syntax in [".1", "", ".5"] {
        let [whole, content] = [0, 1].map(|rank| Dicom { syntax, ..Dicom::at(rank) }.bytes());
        std::fs::write(folder.join("a"), whole).unwrap();
        let damaged = |content: &[u8]| {
            std::fs::write(folder.join("b"), content).unwrap();
            let loaded = read::file(&folder, &read::ReadParams::default(), None).map(|read| read.0);
            loaded.as_ref().is_ok_and(|loaded| {
                valid(loaded);
                true
            })
        };
        assert!(damaged(&content));
        for length in 0..content.len() {
            assert!(!damaged(&content[..length]), "{syntax} cut at {length}");
        }
        let mut changed = content.clone();
        for at in (0..content.len()).step_by(stride().min(3)) {
            changed[at] ^= 1 << (at % 8);
            damaged(&changed);
            for value in [0x00, 0x7f, 0x80, 0xff] {
                for width in [1, 4] {
                    let end = (at + width).min(content.len());
                    changed[at..end].fill(value);
                    damaged(&changed);
                    changed[at..end].copy_from_slice(&content[at..end]);
                }
            }
        }
    }
    std::fs::remove_dir_all(&folder).unwrap();
}
