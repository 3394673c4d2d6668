//! `cargo xtask ci`: all that must hold before a merge, in one order, stopping at the first failure.
//!
//! Steps that take a second come first. Tests come last, so that the output ends with the test runner's own lines.
//! Every step builds with the profile `dev`, so that one step's artifacts serve the next.

use crate::browser::{self, PAGE};
use crate::repo::{Outcome, Repo};
use crate::toml_lines::lines;
use crate::vulkan::TESTS;
use crate::{deny, fuzz, papers, python, shaders, tidy, vulkan};
use std::process::Command;
use std::time::{Duration, Instant};

/// What a step does.
pub(crate) enum Work {
    /// Runs cargo once per list of words, with these environment variables.
    Cargo(Vec<Vec<String>>, &'static [(&'static str, &'static str)]),
    /// Runs a task of this program.
    Task(fn(&Repo) -> Outcome),
}

pub(crate) struct Step {
    pub(crate) name: &'static str,
    pub(crate) work: Work,
}

/// The features that are off by default. Tests on a device and without one have all of them, and the whole workspace: cargo
/// compiles a crate anew for every other choice.
pub(crate) const FEATURES: &str = "organza-hbsort/gpu,organza-pbsr/gpu,organza-splat-core/gpu,organza-tsm/gpu";

/// The feature that asks for a Vulkan driver.
pub(crate) const DRIVER: &str = "gpu-conformance/driver";

/// In the names of tests that take long and rarely fail where the others hold: those of modules named `deep`.
pub(crate) const DEEP: &str = "deep::";

/// Jobs that need more than the pinned toolchain: named, so that nobody believes that they ran.
const SKIPPED: [&str; 1] =
    ["skipped: miri (needs a nightly toolchain; the only unsafe code, in gpu-ash, calls Vulkan, which miri cannot)"];

/// Everything.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let said = follow(&steps(), repo)?;
    Ok(format!("{said}\n{}", SKIPPED.join("\n")))
}

/// Runs every step; the summary names each with its duration.
pub(crate) fn follow(steps: &[Step], repo: &Repo) -> Outcome {
    let mut summary = String::new();
    let begun = Instant::now();
    for (at, step) in steps.iter().enumerate() {
        println!("\n==> {}/{} {}", at + 1, steps.len(), step.name);
        let step_begun = Instant::now();
        let outcome = perform(&step.work, repo);
        let word = if outcome.is_ok() { "ok" } else { "FAILED" };
        let line = format!("{:<8} {word:<6} {:>9}", step.name, seconds(step_begun.elapsed()));
        println!("<== {line}");
        summary.push_str(&format!("\n  {line}"));
        if let Err(why) = outcome {
            return Err(format!("step {} failed: {why}\n{summary}", step.name));
        }
    }
    let total = seconds(begun.elapsed());
    Ok(format!("{summary}\nall {} steps hold, {total}", steps.len()))
}

fn seconds(t: Duration) -> String {
    format!("{:.1} s", t.as_secs_f64())
}

fn perform(work: &Work, repo: &Repo) -> Result<(), String> {
    match work {
        Work::Cargo(runs, environment) => runs.iter().try_for_each(|words| cargo(words, environment, repo)),
        Work::Task(task) => task(repo).map(|said| println!("{said}")),
    }
}

/// Output goes straight to the terminal: nothing is swallowed, and a failure is the last thing shown.
pub(crate) fn cargo(words: &[String], environment: &[(&str, &str)], repo: &Repo) -> Result<(), String> {
    let line = format!("cargo {}", words.join(" "));
    println!("$ {line}");
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(words).envs(environment.iter().copied()).current_dir(&repo.root);
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{line}`: {status}")),
        Err(e) => Err(format!("`{line}` did not start: {e}")),
    }
}

fn steps() -> Vec<Step> {
    let cargo = |line: &str| Work::Cargo(vec![split(line)], &[]);
    // With features and examples, as clippy has them: dependencies that it has checked are not checked again.
    let docs = format!("doc --workspace --no-deps --lib --examples --bin xtask --features {FEATURES},{DRIVER}");
    let docs = Work::Cargo(vec![split(&docs)], &[("RUSTDOCFLAGS", "-D warnings")]);
    let step = |name, work| Step { name, work };
    vec![
        step("fmt", cargo("fmt --all --check")),
        step("tidy", Work::Task(tidy::run)),
        step("papers", Work::Task(papers::check)),
        step("deny", Work::Task(deny::run)),
        step("clippy", cargo(&clippy())),
        step("docs", docs),
        step("modules", Work::Task(vulkan::modules)),
        step("tests", Work::Task(vulkan::tests)),
    ]
}

/// All targets: examples, tests and benches compile here too.
pub(crate) fn clippy() -> String {
    format!("clippy --workspace --all-targets --features {FEATURES},{DRIVER} -- -D warnings")
}

/// Every package as it would be published, unpacked and built by itself.
const PACKAGES: &str = "publish --workspace --dry-run --allow-dirty";

/// What takes minutes and rarely breaks where [`run`] holds, to be run before a release: kernels
/// compiled anew, where tests hold the hashes of what they were compiled from; the page in a browser; each crate by itself, with none of its features
/// and with each of them; recordings by every executor under every validation; every scene drawn, forms
/// that take long, every bit of small files flipped, every package built by itself, and a minute of each target of fuzzing.
pub(crate) fn deep(repo: &Repo) -> Outcome {
    // Of the whole workspace, so that what other steps have compiled serves this one.
    let slow = format!("{TESTS} --features {FEATURES},{DRIVER} --test tests --test end-to-end -- {DEEP} --skip {PAGE}");
    let damage = format!("{TESTS} --features {FEATURES},{DRIVER} --test bad_inputs_damage");
    let strict = |words: Vec<String>| [words, split("-- -D warnings")].concat();
    let alone = bare(repo).into_iter().map(|check| check.1).chain(with_one_feature(repo)).map(strict).collect();
    let steps = [
        Step { name: "shaders", work: Work::Task(|repo| shaders::run(repo, true)) },
        Step { name: "alone", work: Work::Cargo(alone, &[]) },
        Step { name: "vulkan", work: Work::Task(vulkan::run) },
        Step { name: "deep tests", work: Work::Cargo(vec![split(&slow)], &[]) },
        Step { name: "browser", work: Work::Task(browser::run) },
        Step { name: "damage", work: Work::Cargo(vec![split(&damage)], &[("ORGANZA_DEEP", "1")]) },
        Step { name: "packages", work: Work::Cargo(vec![split(PACKAGES)], &[]) },
        Step { name: "python", work: Work::Task(python::run) },
        Step { name: "fuzz", work: Work::Task(|repo| fuzz::run(repo, &[])) },
    ];
    follow(&steps, repo)
}

pub(crate) fn split(line: &str) -> Vec<String> {
    line.split(' ').map(str::to_owned).collect()
}

/// Library crates, each without its default features: its folder and the check of it.
fn bare(repo: &Repo) -> Vec<(&str, Vec<String>)> {
    // A command has no library, and the Python package is a workspace of its own.
    let is_library = |folder: &&str| {
        let manifest = repo.text(&format!("{folder}/Cargo.toml")).unwrap_or_default();
        repo.text(&format!("{folder}/src/main.rs")).is_none() && !manifest.contains("\n[workspace]\n")
    };
    let check = |folder| Some(format!("clippy --package {} --lib --no-default-features", repo.package(folder)?));
    let libraries = repo.crate_folders().into_iter().filter(is_library);
    libraries.filter_map(|folder| Some((folder, split(&check(folder)?)))).collect()
}

/// The same with each of its features alone.
fn with_one_feature(repo: &Repo) -> Vec<Vec<String>> {
    let mut runs = Vec::new();
    for (folder, bare) in bare(repo) {
        let manifest = repo.text(&format!("{folder}/Cargo.toml")).unwrap_or_default();
        let features = lines(manifest).into_iter().filter(|l| l.table == "features" && l.key != "default");
        runs.extend(features.map(|f| [bare.clone(), split(&format!("--features {}", f.key))].concat()));
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_feature_is_checked_alone() {
        let [a, b, c, d] = ["organza-a", "b", "c", "organza-d"].map(|name| format!("[package]\nname = \"{name}\"\n"));
        let a = a + "[features]\ndefault = [\"ply\"]\nply = [\"dep:x\"]\nlas = []\n[dependencies]\ny = \"1\"\n";
        let repo = Repo::in_memory(&[
            ("crates/a/Cargo.toml", &a),
            ("crates/b/Cargo.toml", &b),
            ("crates/c/Cargo.toml", &c),
            ("crates/c/src/main.rs", ""),
            ("crates/organza-d/Cargo.toml", &d),
        ]);
        let words = |checks: Vec<Vec<String>>| checks.iter().map(|words| words[2..].join(" ")).collect::<Vec<_>>();
        let line = "--lib --no-default-features";
        let bare: Vec<_> = bare(&repo).into_iter().map(|check| check.1).collect();
        assert_eq!(words(bare), [format!("organza-a {line}"), format!("b {line}"), format!("organza-d {line}")]);
        let features = ["ply", "las"].map(|feature| format!("organza-a {line} --features {feature}"));
        assert_eq!(words(with_one_feature(&repo)), features);
    }

    #[test]
    fn warnings_fail_and_what_is_slow_comes_last() {
        let steps = steps();
        let names: Vec<_> = steps.iter().map(|s| s.name).collect();
        assert_eq!(names, ["fmt", "tidy", "papers", "deny", "clippy", "docs", "modules", "tests"]);
        let docs = steps.iter().find(|s| s.name == "docs").map(|s| &s.work);
        let Some(Work::Cargo(_, environment)) = docs else { panic!("docs are built by cargo") };
        assert_eq!(*environment, [("RUSTDOCFLAGS", "-D warnings")]);
    }

    #[test]
    fn a_step_that_fails_is_named() {
        let failing = Work::Task(|_| Err("why".to_owned()));
        assert_eq!(perform(&failing, &Repo::in_memory(&[])), Err("why".to_owned()));
        let nowhere = Repo { root: "no/such/folder".into(), files: Vec::new() };
        let why = perform(&Work::Cargo(vec![split("check")], &[]), &nowhere).expect_err("no folder to run in");
        assert!(why.starts_with("`cargo check` did not start"), "{why}");
    }
}
