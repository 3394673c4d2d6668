//! Every truncation and every single-bit flip of a small file of each format: an error or something valid, never a
//! panic, an abort or a huge allocation.
//!
//! The work runs in a process of its own whose address space is limited, so an allocation far beyond the file fails it.
#![cfg(all(feature = "ply", feature = "nifti", feature = "las", unix))]
#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

mod read_samples;

use convert::read::Loaded;
use read_samples::{NIFTI_F32, gzip, las, load, nifti, ply_ascii, ply_binary};
use std::process::Command;

const LIMITED: &str = "CONVERT_TEST_LIMITED";
/// Address space of the limited process, KiB: its threads' stacks and heaps, and nothing near the 16 GB that one bit of
/// a LAZ file can ask for.
const ADDRESS_SPACE_KIB: u64 = 3 << 20;

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
        Loaded::Grid(grid) => grid.validate().unwrap(),
        _ => panic!("unknown kind"),
    }
}

fn samples() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("ascii.ply", ply_ascii().into_bytes()),
        ("little.ply", ply_binary(false)),
        ("big.ply", ply_binary(true)),
        ("packed.ply.gz", gzip(&ply_binary(false))),
        ("u.nii", nifti(NIFTI_F32, false)),
        ("b.nii", nifti(NIFTI_F32, true)),
        ("p.nii.gz", gzip(&nifti(NIFTI_F32, false))),
        ("f3.las", las(3, 20, false)),
        ("f7.las", las(7, 20, false)),
        ("f3.laz", las(3, 20, true)),
        ("f7.laz", las(7, 20, true)),
    ]
}

#[test]
fn ba05_every_truncation_is_refused() {
    if !limited("ba05_every_truncation_is_refused") {
        return;
    }
    for (name, content) in samples() {
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
        assert!(convert::read::panic_is_input_error(), "{info}");
    }));
    let mut accepted = Vec::new();
    for (name, content) in samples() {
        let mut damaged = content.clone();
        let mut ok = 0;
        for bit in 0..content.len() * 8 {
            damaged[bit / 8] ^= 1 << (bit % 8);
            if let Ok(loaded) = load(name, &damaged) {
                valid(&loaded);
                ok += 1;
            }
            damaged[bit / 8] = content[bit / 8];
        }
        accepted.push(format!("{name}: {ok} of {} accepted", content.len() * 8));
    }
    println!("{}", accepted.join("\n"));
}

/// Damage beyond one bit: a byte of every place set to each of some values, in the formats with the most trust in them.
#[test]
fn every_byte_set_to_extremes_gives_an_error_or_a_valid_object() {
    if !limited("every_byte_set_to_extremes_gives_an_error_or_a_valid_object") {
        return;
    }
    for (name, content) in samples() {
        let mut damaged = content.clone();
        for at in 0..content.len() {
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
