//! `cargo xtask python`: the Python package in an environment of its own, built, installed and tested.

use crate::ci::{DRIVER, FEATURES};
use crate::repo::{Outcome, Repo};
use std::path::Path;
use std::process::Command;

const PACKAGE: &str = "crates/organza-python";
/// What is made lies beside what cargo makes.
const ENVIRONMENT: &str = "target/python";
/// What builds the package and tests it; the libraries whose data sets it takes are its extra `test`.
const TOOLS: [&str; 2] = ["maturin>=1.9,<2", "mypy"];

/// Makes the environment, builds and installs the package, and runs its tests; the wheel stays in `target/wheels`.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let environment = repo.root.join(ENVIRONMENT);
    let python = environment.join("bin/python");
    if !python.is_file() {
        call(repo, Path::new("python3"), &["-m", "venv", ENVIRONMENT])?;
    }
    call(repo, &python, &[&["-m", "pip", "install", "--quiet", "--upgrade"][..], &TOOLS].concat())?;
    let manifest = format!("{PACKAGE}/Cargo.toml");
    let wheels = "target/wheels";
    let build = ["-m", "maturin", "build", "--release", "--manifest-path", &manifest, "--out", wheels];
    call(repo, &python, &build)?;
    let install =
        ["-m", "pip", "install", "--quiet", "--find-links", wheels, "--force-reinstall", "--no-deps", "organza"];
    call(repo, &python, &install)?;
    // What the package and its tests need beside it.
    call(repo, &python, &["-m", "pip", "install", "--quiet", "--find-links", wheels, "organza[test]"])?;
    call(repo, &python, &["-m", "mypy", "--strict", &format!("{PACKAGE}/python/organza")])?;
    call(repo, &python, &["-m", "mypy.stubtest", "organza._organza"])?;
    // Tests compare pictures and documents with those of the command, which they find in `target`: built as the tests of the workspace have it, so
    // that cargo compiles nothing a second time. Its profile is `dev`, that of the package `release`; pictures have the same bits.
    let features = format!("{FEATURES},{DRIVER}");
    let of_tests =
        ["build", "--quiet", "--workspace", "--exclude", "organza-benches", "--tests", "--features", &features];
    call(repo, Path::new("cargo"), &of_tests)?;
    call(repo, &python, &["-m", "pytest", "-q", &format!("{PACKAGE}/tests")])?;
    Ok(format!("python: the package is tested; its wheel lies in {wheels}"))
}

/// Runs a program in the repository's folder; what it writes goes to the terminal.
fn call(repo: &Repo, program: &Path, words: &[&str]) -> Result<(), String> {
    let line = format!("{} {}", program.display(), words.join(" "));
    println!("$ {line}");
    match Command::new(program).args(words).current_dir(&repo.root).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{line}`: {status}")),
        Err(error) => {
            Err(format!("`{line}` did not start: {error}; install Python 3.10 or later with its module venv"))
        }
    }
}
