//! `cargo xtask quick`: what a change is most likely to break, in minutes.
//!
//! Format, rules and clippy of everything, and the tests of the crates that differ from main, in the working tree too. Tests of
//! the whole command and of devices are `cargo xtask ci`'s, unless they changed themselves.

use crate::ci::{DEEP, FEATURES, Step, Work, clippy, follow, split};
use crate::repo::{Outcome, Repo};
use crate::{papers, tidy};
use std::collections::BTreeSet;
use std::process::Command;

/// What a change is held against, the first that there is.
const MAINS: [&str; 2] = ["origin/main", "main"];

pub(crate) fn run(repo: &Repo) -> Outcome {
    follow(&steps(&packages(repo, &changed(repo)?)), repo)
}

fn steps(packages: &BTreeSet<String>) -> Vec<Step> {
    let cargo = |line: String| Work::Cargo(vec![split(&line)], &[]);
    let mut steps = vec![
        Step { name: "fmt", work: cargo("fmt --all --check".to_owned()) },
        Step { name: "tidy", work: Work::Task(tidy::run) },
        Step { name: "papers", work: Work::Task(papers::check) },
        Step { name: "clippy", work: cargo(clippy()) },
    ];
    if !packages.is_empty() {
        let mut line = "test".to_owned();
        packages.iter().for_each(|name| line.push_str(&format!(" --package {name}")));
        let of_them = |feature: &&str| feature.split('/').next().is_some_and(|name| packages.contains(name));
        let features: Vec<&str> = FEATURES.split(',').filter(of_them).collect();
        if !features.is_empty() {
            line.push_str(&format!(" --features {}", features.join(",")));
        }
        line.push_str(&format!(" -- --skip {DEEP}"));
        steps.push(Step { name: "tests", work: cargo(line) });
    }
    steps
}

/// Paths that differ from main.
fn changed(repo: &Repo) -> Result<Vec<String>, String> {
    let git = |words: &[&str]| {
        let ran = Command::new("git").args(words).current_dir(&repo.root).output();
        let out = ran.map_err(|e| format!("git: {e}"))?;
        let said = if out.status.success() { out.stdout } else { out.stderr };
        let said = String::from_utf8_lossy(&said).trim().to_owned();
        if out.status.success() { Ok(said) } else { Err(format!("git {}: {said}", words.join(" "))) }
    };
    let base = MAINS.iter().find_map(|main| git(&["merge-base", "HEAD", main]).ok());
    let base = base.ok_or_else(|| format!("no branch {} to compare with", MAINS.join(" or ")))?;
    let differing =
        git(&["diff", "--name-only", &base])? + "\n" + &git(&["ls-files", "--others", "--exclude-standard"])?;
    Ok(differing.lines().filter(|path| !path.is_empty()).map(str::to_owned).collect())
}

/// The packages that files belong to: each to the one in the deepest folder above it.
fn packages(repo: &Repo, paths: &[String]) -> BTreeSet<String> {
    let named = |(path, _): (&str, &str)| {
        let folder = path.strip_suffix("/Cargo.toml")?;
        Some((format!("{folder}/"), repo.package(folder)?))
    };
    // What is a workspace of its own has no tests here.
    let manifests =
        repo.texts().filter(|(path, text)| path.ends_with("Cargo.toml") && !text.contains("\n[workspace]\n"));
    let folders: Vec<(String, String)> = manifests.filter_map(named).collect();
    let owner = |path: &String| {
        let above = folders.iter().filter(|(folder, _)| path.starts_with(folder.as_str()));
        above.max_by_key(|(folder, _)| folder.len()).map(|(_, name)| name.clone())
    };
    paths.iter().filter_map(owner).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_tests_of_what_changed_are_run() {
        let manifest = |name: &str| format!("[package]\nname = \"{name}\"\n[[test]]\nname = \"other\"\n");
        let [tsm, tests, gpu] = ["organza-tsm", "organza-tests", "gpu-conformance"].map(manifest);
        let fuzz = manifest("fuzz") + "[workspace]\n[dependencies]\n";
        let files = [("crates/tsm/Cargo.toml", &tsm), ("tests/Cargo.toml", &tests), ("tests/gpu/Cargo.toml", &gpu)];
        let files = [&files[..], &[("fuzz/Cargo.toml", &fuzz)]].concat();
        let files: Vec<(&str, &str)> = files.iter().map(|(path, text)| (*path, text.as_str())).collect();
        let repo = Repo::in_memory(&files);
        let paths =
            ["crates/tsm/src/reading/lookup.rs", "tests/gpu/lib.rs", "fuzz/src/lib.rs", "README.md"].map(str::to_owned);
        let found = packages(&repo, &paths);
        assert_eq!(found.iter().collect::<Vec<_>>(), ["gpu-conformance", "organza-tsm"]);
        let Work::Cargo(runs, _) = &steps(&found).pop().expect("steps").work else { panic!("tests are run by cargo") };
        assert_eq!(
            runs[0].join(" "),
            "test --package gpu-conformance --package organza-tsm --features organza-tsm/gpu -- --skip deep::"
        );
        assert_eq!(steps(&BTreeSet::new()).last().map(|step| step.name), Some("clippy"));
    }
}
