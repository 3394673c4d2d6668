//! `--cache`: the second run reads what the first found out, and no run draws another picture for it.

use organza_tests::{organza, parallel_view};
use std::fs;
use std::path::Path;

/// Draws the hills, and gives the picture and what was said.
fn drawn(folder: &Path, cache: &[&str]) -> (Vec<u8>, String) {
    let arguments = ["render", "s.toml", "-o", "s.png", "--force"];
    let out = organza().current_dir(folder).args(arguments).args(cache).output().unwrap();
    let said = String::from_utf8_lossy(&out.stderr).into_owned();
    assert!(out.status.success(), "{said}");
    (fs::read(folder.join("s.png")).unwrap(), said)
}

#[test]
fn a_cache_is_read_the_second_time_and_changes_no_picture_whatever_is_in_it() {
    let place = tempfile::tempdir().unwrap();
    let folder = place.path();
    let point = |i: u32| {
        let x = f64::from(i % 60) / 15.0 - 2.0;
        let y = f64::from(i / 60) / 15.0 - 2.0;
        format!("{x} {y} {}\n", 0.2 * (3.0 * x).sin() * y.cos())
    };
    fs::write(folder.join("hills.xyz"), (0..3600).map(point).collect::<String>()).unwrap();
    let light = "[[light]]\nkind = 'directional'\ndirection = [0.3, -0.5, -1]\nirradiance = [3, 3, 3]\n";
    let scene = format!("{}[[object]]\nname = 'hills'\npoints = 'hills.xyz'\n{light}", parallel_view(2.0, 32));
    fs::write(folder.join("s.toml"), scene).unwrap();
    let (plain, said) = drawn(folder, &[]);
    assert!(!said.contains("note:"), "{said}");
    let with = ["--cache", "kept"];
    let (first, said) = drawn(folder, &with);
    assert!(said.contains("note: normals and areas of object 'hills' are kept in kept"), "{said}");
    let (second, said) = drawn(folder, &with);
    assert!(said.contains("note: normals and areas of object 'hills' were read from kept"), "{said}");
    let file = fs::read_dir(folder.join("kept")).unwrap().next().unwrap().unwrap().path();
    let mut bytes = fs::read(&file).unwrap();
    bytes[200] ^= 1;
    fs::write(&file, bytes).unwrap();
    let (damaged, said) = drawn(folder, &with);
    assert!(said.contains("is damaged; normals and areas of object 'hills' are found anew"), "{said}");
    #[cfg(unix)]
    {
        // Nobody waits for a pipe under its name.
        fs::remove_file(&file).unwrap();
        std::process::Command::new("mkfifo").arg(&file).status().unwrap();
        let (piped, said) = drawn(folder, &with);
        assert!(said.contains("is no regular file; normals and areas of object 'hills' are found anew"), "{said}");
        assert_eq!(piped, plain);
    }
    let mesh = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    fs::write(folder.join("mesh.obj"), mesh).unwrap();
    let mut command = organza();
    let out = command.current_dir(folder).args(["render", "mesh.obj", "-o", "m.png", "--size", "8x8"]).args(with);
    let said = String::from_utf8_lossy(&out.output().unwrap().stderr).into_owned();
    assert!(said.contains("note: the cache is not used: it keeps normals and areas of raw points alone"), "{said}");
    assert!([first, second, damaged].iter().all(|picture| *picture == plain));
}
