//! What particles take is known before they are made: memory stays below what is allowed, and data that no sampler takes is
//! refused by name.

use organza_tests::{Place, SMALL_SCENE};

fn scene(object: &str) -> String {
    format!("{SMALL_SCENE}\n[[object]]\nname = \"dense fog\"\n{object}\n")
}

#[cfg(target_os = "linux")]
mod resident {
    use super::{Place, scene};
    use organza_tests::organza;
    use std::process::Stdio;
    use std::time::Duration;

    fn dense(extinction: &str) -> String {
        scene(&format!(
            "medium_box = {{ min = [-1, -1, -1], max = [1, 1, 1], extinction = {extinction}, spacing = 0.25 }}"
        ))
    }

    const PARTICLES: [&str; 6] = ["render", "s.toml", "--technique", "particles", "--max-memory", "128M"];

    /// Exit code, errors and the most bytes that were resident.
    fn run(place: &Place, arguments: &[&str]) -> (Option<i32>, String, u64) {
        let mut command = organza();
        command.args(arguments).current_dir(place.folder()).stdout(Stdio::null()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let status = format!("/proc/{}/status", child.id());
        let mut most = 0;
        while child.try_wait().unwrap().is_none() {
            // The highest mark so far: it does not matter when it is read.
            let text = std::fs::read_to_string(&status).unwrap_or_default();
            let kilobytes = text.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB"));
            most = kilobytes.map_or(most, |k| 1024 * k.trim().parse::<u64>().unwrap());
            std::thread::sleep(Duration::from_millis(1));
        }
        let out = child.wait_with_output().unwrap();
        (out.status.code(), String::from_utf8_lossy(&out.stderr).into_owned(), most)
    }

    /// The least limit with which a scene is drawn: each refusal says how much is needed.
    fn least_limit(place: &Place, scene: &str) -> (u64, u64) {
        let mut limit: u64 = 1 << 20;
        for _ in 0..20 {
            let allowed = limit.to_string();
            let draw = ["render", scene, "--force", "-o", "a.exr", "--technique", "particles", "--repeat-level", "16"];
            let (code, stderr, most) = run(place, &[&draw[..], &["--max-memory", &allowed]].concat());
            if code == Some(0) {
                return (limit, most);
            }
            assert_eq!(code, Some(5), "{stderr}");
            let needed = stderr.split_once(" needs ").and_then(|(_, rest)| rest.split_once(" bytes"));
            // Too many splats are counted, not in bytes.
            let needed: u64 = needed.and_then(|(n, _)| n.parse().ok()).unwrap_or(2 * limit);
            // A set may take a quarter.
            let of_set = stderr.contains("one set of particles");
            limit = if of_set { 4 * needed } else { needed + needed / 200 };
        }
        panic!("{scene} needs more and more");
    }

    /// Draws a scene of the repository with the least limit that is accepted.
    fn least_limit_holds(name: &str) {
        let scene = format!("{}/../scenes/{name}.toml", env!("CARGO_MANIFEST_DIR"));
        let (limit, most) = least_limit(&Place::new(""), &scene);
        assert!(most <= limit, "{name}: {most} bytes were resident, {limit} allowed");
        assert!(limit < 2 * most, "{name}: {limit} bytes are asked for, {most} were resident");
    }

    #[test]
    fn the_least_limit_that_is_accepted_holds() {
        least_limit_holds("figure5");
    }

    /// What takes long and rarely fails where the others hold.
    mod deep {
        #[test]
        fn the_least_limit_for_a_slice_and_a_mesh_holds() {
            super::least_limit_holds("figure6");
        }
    }

    #[test]
    fn more_particles_than_fit_are_refused_before_anything_is_made_of_them() {
        for extinction in ["1e5", "1e6", "1e9", "1e18"] {
            let (code, stderr, most) = run(&Place::new(&dense(extinction)), &PARTICLES);
            assert_eq!(code, Some(5), "{extinction}: {stderr}");
            for part in ["'dense fog'", "needs", "the limit is", "extinction"] {
                assert!(stderr.contains(part), "{extinction}: no {part} in {stderr}");
            }
            assert!(most < 128 << 20, "{extinction}: {most} bytes");
        }
        let lattice =
            "cloud = { ellipsoids = [{ center = [0, 0, 0], radii = [1, 1, 1] }], spacing = 0.1, extinction = 1e12 }";
        let (code, stderr, most) = run(&Place::new(&scene(lattice)), &PARTICLES);
        assert_eq!(code, Some(5), "{stderr}");
        assert!(stderr.contains("'dense fog'") && most < 128 << 20, "{most}: {stderr}");
    }
}

#[test]
fn sizes_beyond_what_numbers_hold_are_bad_input() {
    let place = Place::new(&scene("points = \"far.xyz\""));
    place.write("far.xyz", "0 0 0\n2e19 0 0\n");
    for technique in ["points", "particles"] {
        let out = place.expect(3, &["render", "s.toml", "--technique", technique], "object 'dense fog', ");
        let text = String::from_utf8_lossy(&out.stderr).into_owned();
        assert!(text.contains("far.xyz") && text.contains("cross_section is inf"), "{text}");
    }
}
