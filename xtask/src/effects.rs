//! `cargo xtask effects`: what each effect of every scene changes, measured, into docs/effects.csv and docs/effects.md.

use crate::repo::{Outcome, Repo};
use std::process::Command;

const WORDS: [&str; 6] = ["run", "--release", "--package", "organza-judge", "--example", "effects"];

/// Draws all scenes with each of their effects and without it, which takes minutes.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    match Command::new(program).args(WORDS).current_dir(&repo.root).status() {
        Ok(status) if status.success() => Ok("effects: docs/effects.csv and docs/effects.md are written".to_owned()),
        Ok(status) => Err(format!("`cargo {}`: {status}", WORDS.join(" "))),
        Err(error) => Err(format!("cargo did not start: {error}")),
    }
}
