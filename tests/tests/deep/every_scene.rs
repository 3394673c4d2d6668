//! What must hold of every scene that comes with Organza. Each is read and drawn once for all of it: that is what takes time.

use organza_tests::{largest_difference, organza, picture_of, run_measured, sum_of_effects};
use serde_json::Value;
use std::path::{Path, PathBuf};

/// What every scene is drawn with.
const ARGUMENTS: [&str; 6] = ["--repeat-level", "8", "--layers", "effects", "--threads", "2"];

/// Pixels of every picture.
const PIXELS: f64 = 96.0 * 54.0;

/// A small size in the shape of a scene's own picture, which shows what that shows.
fn size(scene: &Path) -> String {
    let text = std::fs::read_to_string(scene).unwrap();
    let sides =
        text.lines().find_map(|line| line.strip_prefix("size = [")?.strip_suffix(']')?.split_once(", ")).unwrap();
    let [width, height] = [sides.0, sides.1].map(|n| n.parse::<f64>().unwrap());
    let scale = (PIXELS / (width * height)).sqrt();
    format!("{:.0}x{:.0}", width * scale, height * scale)
}

fn scenes() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../scenes");
    let mut scenes: Vec<_> = std::fs::read_dir(folder).unwrap().map(|e| e.unwrap().path()).collect();
    scenes.retain(|p| p.extension().is_some_and(|e| e == "toml"));
    scenes.sort();
    assert!(scenes.len() > 10);
    scenes
}

/// What `explain` says as a document.
fn explained(scene: &Path) -> Value {
    let out =
        organza().arg("explain").arg(scene).args(["--json", "--size", &size(scene)]).args(ARGUMENTS).output().unwrap();
    assert!(out.status.success(), "{}: {}", scene.display(), String::from_utf8_lossy(&out.stderr));
    serde_json::from_slice(&out.stdout).unwrap()
}

#[test]
fn memory_stays_within_what_is_explained_effects_sum_to_beauty_and_nothing_is_doubtful() {
    for scene in scenes() {
        let name = scene.display();
        let explained = explained(&scene);
        let warnings = explained["warnings"].as_array().unwrap().iter().map(|w| w.as_str().unwrap());
        let warnings: Vec<_> =
            warnings.filter(|w| ["light", "camera", "picture"].iter().any(|word| w.contains(word))).collect();
        assert!(warnings.is_empty(), "{name}: {warnings:?}");

        let bytes = explained["memory_bytes"].as_u64().unwrap();
        let folder = tempfile::tempdir().unwrap();
        let image = folder.path().join("out.exr");
        let mut command = organza();
        command.arg("render").arg(&scene).arg("-o").arg(&image).args(["--max-memory", &bytes.to_string()]);
        let (out, peak) = run_measured(command.args(["--size", &size(&scene)]).args(ARGUMENTS));
        assert!(out.status.success(), "{name} within {bytes}: {}", String::from_utf8_lossy(&out.stderr));
        let resident = peak.resident;
        println!("{name}: explained {bytes}, resident {resident}");
        assert!(
            resident <= bytes + crate::memory::PROGRAM,
            "{name}: explained {bytes} bytes, {resident} were resident"
        );

        let picture = picture_of(&image);
        for c in ["R", "G", "B"] {
            let largest = largest_difference(&sum_of_effects(&picture, c), &picture.channel(c));
            assert!(largest < 1e-5, "{name}, {c}: {largest:e}");
        }
    }
}
