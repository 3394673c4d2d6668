//! `cargo xtask ci`: all that must hold before a merge, in one order, stopping at the first failure.
//!
//! Steps that take a second come first. Tests come last, so that the output ends with the test runner's own lines.
//! Every step builds with the profile `dev`, so that one step's artifacts serve the next.

use crate::repo::{Outcome, Repo};
use crate::toml_lines::lines;
use crate::vulkan::TESTS;
use crate::{papers, shaders, tidy, vulkan};
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
pub(crate) const FEATURES: &str = "hbsort/gpu,pbsr/gpu,splat-core/gpu,tsm/gpu";

/// The feature that asks for a Vulkan driver.
pub(crate) const DRIVER: &str = "gpu-conformance/driver";

/// The feature of the end-to-end tests that take long.
const DEEP: &str = "organza-tests/deep";

/// Jobs that need more than the pinned toolchain: named, so that nobody believes that they ran.
const SKIPPED: [&str; 1] =
    ["skipped: miri (needs a nightly toolchain; the only unsafe code, in gpu-ash, calls Vulkan, which miri cannot)"];

/// Everything.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let said = follow(&steps(repo), repo)?;
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
fn cargo(words: &[String], environment: &[(&str, &str)], repo: &Repo) -> Result<(), String> {
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

fn steps(repo: &Repo) -> Vec<Step> {
    let one = |line: &str| Work::Cargo(vec![split(line)], &[]);
    let docs = Work::Cargo(vec![split("doc --workspace --no-deps")], &[("RUSTDOCFLAGS", "-D warnings")]);
    let step = |name, work| Step { name, work };
    vec![
        step("fmt", one("fmt --all --check")),
        step("tidy", Work::Task(tidy::run)),
        step("papers", Work::Task(papers::check)),
        step("clippy", one(&clippy())),
        step("docs", docs),
        step("alone", Work::Cargo(alone(repo, is_picked), &[])),
        step("tests", Work::Task(vulkan::tests)),
        step("vulkan", Work::Task(vulkan::beside_tests)),
    ]
}

/// All targets: examples, tests and benches compile here too.
pub(crate) fn clippy() -> String {
    format!("clippy --workspace --all-targets --features {FEATURES},{DRIVER},{DEEP} -- -D warnings")
}

/// What takes minutes and rarely breaks where [`run`] holds, to be run before a release: kernels compiled anew, where tests hold the
/// hashes of what they were compiled from; the orchestrator's crates each without what the others ask of their dependencies;
/// recordings by every executor under every validation; every scene drawn, and forms that take long.
pub(crate) fn deep(repo: &Repo) -> Outcome {
    // Of the whole workspace, so that what other steps have compiled serves this one.
    let slow = format!("{TESTS} --features {FEATURES},{DRIVER},{DEEP} --test end-to-end -- every_scene:: gyroid");
    let steps = [
        Step { name: "shaders", work: Work::Task(|repo| shaders::run(repo, true)) },
        Step { name: "alone", work: Work::Cargo(alone(repo, |folder| !is_picked(folder)), &[]) },
        Step { name: "vulkan", work: Work::Task(vulkan::run) },
        Step { name: "scenes", work: Work::Cargo(vec![split(&slow)], &[]) },
    ];
    follow(&steps, repo)
}

pub(crate) fn split(line: &str) -> Vec<String> {
    line.split(' ').map(str::to_owned).collect()
}

/// Whether people take a crate by itself: the stages and what they stand on, not the parts of the orchestrator.
fn is_picked(folder: &str) -> bool {
    !folder.starts_with("crates/organza")
}

/// Each of these library crates without its default features, then with each of its features alone.
fn alone(repo: &Repo, which: fn(&str) -> bool) -> Vec<Vec<String>> {
    let mut runs = Vec::new();
    // A command has no library.
    let is_library = |folder: &&str| repo.text(&format!("{folder}/src/main.rs")).is_none();
    for folder in repo.crate_folders().into_iter().filter(|folder| which(folder)).filter(is_library) {
        let name = folder.trim_start_matches("crates/");
        let bare = format!("check --package {name} --lib --no-default-features");
        let manifest = repo.text(&format!("{folder}/Cargo.toml")).unwrap_or_default();
        let features = lines(manifest).into_iter().filter(|l| l.table == "features" && l.key != "default");
        runs.push(split(&bare));
        runs.extend(features.map(|f| split(&format!("{bare} --features {}", f.key))));
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_feature_is_checked_alone() {
        let manifest = "[features]\ndefault = [\"ply\"]\nply = [\"dep:x\"]\nlas = []\n[dependencies]\ny = \"1\"\n";
        let command = [("crates/c/Cargo.toml", ""), ("crates/c/src/main.rs", ""), ("crates/organza-d/Cargo.toml", "")];
        let repo =
            Repo::of(&[&[("crates/a/Cargo.toml", manifest), ("crates/b/Cargo.toml", "")], &command[..]].concat());
        let found = |which| alone(&repo, which).iter().map(|words| words[2..].join(" ")).collect::<Vec<_>>();
        let bare = "--lib --no-default-features";
        let expected = [
            format!("a {bare}"),
            format!("a {bare} --features ply"),
            format!("a {bare} --features las"),
            format!("b {bare}"),
        ];
        assert_eq!(found(is_picked), expected);
        assert_eq!(found(|folder| !is_picked(folder)), [format!("organza-d {bare}")]);
    }

    #[test]
    fn warnings_fail_and_what_is_slow_comes_last() {
        let steps = steps(&Repo::of(&[]));
        let names: Vec<_> = steps.iter().map(|s| s.name).collect();
        assert_eq!(names, ["fmt", "tidy", "papers", "clippy", "docs", "alone", "tests", "vulkan"]);
        let Work::Cargo(_, environment) = &steps[4].work else { panic!("docs are built by cargo") };
        assert_eq!(*environment, [("RUSTDOCFLAGS", "-D warnings")]);
    }

    #[test]
    fn a_step_that_fails_is_named() {
        let failing = Work::Task(|_| Err("why".to_owned()));
        assert_eq!(perform(&failing, &Repo::of(&[])), Err("why".to_owned()));
        let nowhere = Repo { root: "no/such/folder".into(), files: Vec::new() };
        let why = perform(&Work::Cargo(vec![split("check")], &[]), &nowhere).expect_err("no folder to run in");
        assert!(why.starts_with("`cargo check` did not start"), "{why}");
    }
}
