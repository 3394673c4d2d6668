//! Which crate may know which: no stage knows another stage, and everything meets in `organza`.

use crate::repo::Repo;
use crate::toml_lines::{lines, string};

/// For each crate of the workspace, the crates of the workspace that it may depend on, tests and benches included.
const MAY_KNOW: [(&str, &[&str]); 27] = [
    ("splat-core", &["splat-shaders"]),
    ("read", &["splat-core"]),
    ("field", &["splat-core"]),
    ("convert", &["splat-core", "read", "field"]),
    ("tsm", &["splat-core", "splat-shaders"]),
    ("hbsort", &["splat-core", "splat-shaders"]),
    ("pbsr", &["splat-core", "splat-shaders"]),
    ("sheet-light", &["splat-core"]),
    ("deferred-blend", &["splat-core"]),
    ("reference", &["splat-core"]),
    ("splat-shaders", &[]),
    ("gpu-ash", &["splat-shaders"]),
    ("gpu-wgpu", &["splat-shaders"]),
    ("organza-scene", &["splat-core", "read", "field", "convert"]),
    ("organza-output", &["splat-core", "organza-scene"]),
    ("organza-device", &["splat-core", "tsm", "hbsort", "pbsr", "splat-shaders", "gpu-ash", "gpu-wgpu"]),
    (
        "organza",
        &[
            "splat-core",
            "read",
            "field",
            "convert",
            "tsm",
            "hbsort",
            "pbsr",
            "sheet-light",
            "deferred-blend",
            "reference",
            "organza-scene",
            "organza-output",
            "organza-device",
        ],
    ),
    (
        "organza-judge",
        &["splat-core", "read", "field", "convert", "tsm", "hbsort", "deferred-blend", "reference", "organza"],
    ),
    ("organza-survey", &["splat-core", "read", "convert", "organza"]),
    ("organza-view", &["splat-core", "organza", "organza-judge", "organza-survey"]),
    ("organza-cli", &["splat-core", "read", "convert", "organza", "organza-judge", "organza-survey", "organza-view"]),
    (
        "organza-python",
        &["splat-core", "read", "convert", "organza", "organza-judge", "organza-survey", "organza-view"],
    ),
    (
        "organza-tests",
        &[
            "splat-core",
            "read",
            "field",
            "convert",
            "tsm",
            "hbsort",
            "pbsr",
            "reference",
            "organza",
            "organza-judge",
            "organza-survey",
            "organza-view",
        ],
    ),
    (
        "organza-benches",
        &[
            "splat-core",
            "read",
            "field",
            "convert",
            "tsm",
            "hbsort",
            "pbsr",
            "sheet-light",
            "deferred-blend",
            "reference",
            "splat-shaders",
            "gpu-ash",
            "gpu-wgpu",
            "organza",
        ],
    ),
    ("gpu-conformance", &["splat-core", "tsm", "hbsort", "pbsr", "splat-shaders", "gpu-ash", "gpu-wgpu", "organza"]),
    ("organza-fuzz", &["splat-core", "read", "field", "convert", "organza-scene", "organza"]),
    ("xtask", &[]),
];

/// Crates that only those above the stages may use: file formats of scenes and of reports, and the command line, stop there.
const ONLY_ABOVE_STAGES: [&str; 4] = ["serde", "serde_json", "toml", "clap"];

/// A reader of a format that is JSON parses it as such; its types stay inside.
const PARSES: [(&str, &str); 2] = [("read", "serde"), ("read", "serde_json")];

/// Dependencies point from the top of the design's figure downwards.
pub(crate) fn direction(repo: &Repo) -> Vec<String> {
    let manifests = repo.texts().filter(|(path, _)| path.ends_with("/Cargo.toml"));
    manifests.flat_map(|(path, text)| manifest(path, text)).collect()
}

fn manifest(path: &str, text: &str) -> Vec<String> {
    let lines = lines(text);
    let named = lines.iter().find(|l| l.table == "package" && l.key == "name");
    let Some(package) = named.and_then(|l| string(l.value).ok()) else {
        return vec![format!("{path}: expected a package name")];
    };
    let name = plain(&package);
    let Some((_, may_know)) = MAY_KNOW.iter().find(|(package, _)| *package == name) else {
        return vec![format!("{path}: crate {name} has no row in the table of xtask/src/tidy/dependencies.rs")];
    };
    let mut found = Vec::new();
    for line in &lines {
        let Some(on) = dependency(line.table, line.key, line.value) else { continue };
        let on = plain(on);
        // A crate's own tests may ask for one of its features.
        let of_workspace = on != name && MAY_KNOW.iter().any(|(member, _)| *member == on);
        // The house itself, and who may know it, stand above the stages.
        let above = name.starts_with("organza") || may_know.contains(&"organza");
        if (of_workspace && !may_know.contains(&on))
            || (ONLY_ABOVE_STAGES.contains(&on) && !above && !PARSES.contains(&(name, on)))
        {
            found.push(format!("{path}:{}: {name} may not depend on {on}", line.number));
        }
    }
    found
}

/// What the table calls a package: packages of stages are published as `organza-tsm` and so on, their libraries are `tsm`.
fn plain(package: &str) -> &str {
    let short = package.strip_prefix("organza-").filter(|short| MAY_KNOW.iter().any(|(member, _)| member == short));
    short.unwrap_or(package)
}

/// The package that a line of a manifest depends on.
fn dependency<'a>(table: &'a str, key: &'a str, value: &'a str) -> Option<&'a str> {
    let (before, own_table) = table.rsplit_once("dependencies")?;
    if !(before.is_empty() || before.ends_with(['.', '-'])) {
        return None;
    }
    if let Some(name) = own_table.strip_prefix('.') {
        return Some(if key == "package" { value.trim_matches('"') } else { name });
    }
    let renamed = value.split_once("package").and_then(|(_, rest)| rest.split('"').nth(1));
    Some(renamed.unwrap_or(key.split('.').next().unwrap_or(key)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn found(name: &str, dependencies: &str) -> Vec<String> {
        let text = format!("[package]\nname = \"{name}\"\n{dependencies}");
        direction(&Repo::in_memory(&[("crates/c/Cargo.toml", &text)]))
    }

    #[test]
    fn stages_know_only_the_nouns() {
        assert!(found("tsm", "[dependencies]\nsplat-core.workspace = true\nglam.workspace = true\n").is_empty());
        let wrong = found("tsm", "[dependencies]\nhbsort.workspace = true\n");
        assert_eq!(wrong, ["crates/c/Cargo.toml:4: tsm may not depend on hbsort"]);
        let itself = "[dev-dependencies]\norganza-tsm = { path = \".\", features = [\"reference\"] }\n";
        assert!(found("organza-tsm", itself).is_empty());
    }

    #[test]
    fn every_way_to_write_a_dependency_is_seen() {
        for text in [
            "[dev-dependencies]\norganza = { workspace = true }\n",
            "[build-dependencies.organza]\npath = \"x\"\n",
            "[target.'cfg(unix)'.dependencies]\norganza.workspace = true\n",
            "[dependencies]\nother = { package = \"organza\", path = \"x\" }\n",
            "[dependencies.other]\npackage = \"organza\"\n",
            "[dependencies]\norganza-tsm = { path = \"x\" }\n",
        ] {
            assert_eq!(found("organza-hbsort", text).len(), 1, "{text}");
        }
    }

    #[test]
    fn nobody_depends_on_what_stands_above() {
        for (name, on) in
            [("splat-core", "tsm"), ("reference", "tsm"), ("organza", "organza-judge"), ("xtask", "splat-core")]
        {
            assert_eq!(found(name, &format!("[dependencies]\n{on}.workspace = true\n")).len(), 1, "{name} on {on}");
        }
        assert!(found("organza-tests", "[dev-dependencies]\norganza.workspace = true\n").is_empty());
    }

    #[test]
    fn scene_formats_stop_at_the_orchestrator() {
        assert_eq!(found("tsm", "[dependencies]\nserde.workspace = true\n").len(), 1);
        assert!(found("read", "[dependencies]\nserde.workspace = true\n").is_empty());
        assert_eq!(found("read", "[dependencies]\ntoml.workspace = true\n").len(), 1);
        assert!(found("organza-scene", "[dependencies]\nserde.workspace = true\n").is_empty());
    }

    #[test]
    fn a_new_crate_needs_a_row() {
        assert_eq!(found("novel", "").len(), 1);
    }
}
