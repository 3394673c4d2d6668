//! `cargo xtask effects`: what each effect of every scene changes, where families of scenes cross their thresholds, what `auto` takes, how budgets are kept, and
//! predicted beside measured times, into docs/effects.csv, docs/effect-families.csv, docs/choices.csv, docs/budgets.csv, docs/predictions.csv and
//! docs/effects.md.

use crate::ci::{DRIVER, FEATURES};
use crate::repo::{Outcome, Repo};
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

/// What tests are built with, so that nothing is built anew.
const WORKSPACE: [&str; 3] = ["--workspace", "--exclude", "organza-benches"];
/// The example, where cargo leaves it.
const EXAMPLE: &str = "debug/examples/effects";
/// Tests that draw families of scenes.
const FAMILIES: &str = "x7_";
const TABLE: &str = "docs/effect-families.csv";
const HEAD: &str = "effect,grows,settings,first_visible,last_left_out,largest_change_left_out_in_tolerances,median_bound_over_change\n";

/// Draws families and all scenes, which takes an hour.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let seed = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    println!("families of seed {seed}");
    families(repo, &seed.to_string())?;
    cargo(repo, &words("build", &["--example", "effects"]), &[])?;
    let target = std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| repo.root.join("target"), PathBuf::from);
    status(Command::new(target.join(EXAMPLE)).current_dir(&repo.root), EXAMPLE)?;
    Ok("effects: docs/effects.csv, docs/effect-families.csv, docs/choices.csv, docs/budgets.csv, docs/predictions.csv and docs/effects.md are written"
        .to_owned())
}

/// Draws families of this seed by the tests, which add a row each to the table.
fn families(repo: &Repo, seed: &str) -> Result<(), String> {
    let table = repo.root.join(TABLE);
    let write = |text: &str| std::fs::write(&table, text).map_err(|error| format!("{TABLE}: {error}"));
    write(HEAD)?;
    let path = table.display().to_string();
    let words = words("test", &["--test", "end-to-end", "--", FAMILIES]);
    cargo(repo, &words, &[("ORGANZA_FAMILIES", &path), ("ORGANZA_SEED", seed)])?;
    write(&sorted(&table)?)
}

/// The table with its rows in order: tests run side by side.
fn sorted(table: &Path) -> Result<String, String> {
    let text = std::fs::read_to_string(table).map_err(|error| format!("{TABLE}: {error}"))?;
    let mut rows: Vec<&str> = text.lines().skip(1).collect();
    rows.sort_unstable();
    Ok(rows.iter().fold(HEAD.to_owned(), |text, row| text + row + "\n"))
}

/// Words for cargo about the whole workspace.
fn words(work: &str, more: &[&str]) -> Vec<String> {
    let features = ["--features".to_owned(), format!("{FEATURES},{DRIVER}")];
    let workspace = std::iter::once(work).chain(WORKSPACE).map(str::to_owned);
    workspace.chain(features).chain(more.iter().map(|word| (*word).to_owned())).collect()
}

fn cargo(repo: &Repo, words: &[String], environment: &[(&str, &str)]) -> Result<(), String> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(words).envs(environment.iter().copied()).current_dir(&repo.root);
    status(&mut command, &format!("cargo {}", words.join(" ")))
}

fn status(command: &mut Command, line: &str) -> Result<(), String> {
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`{line}`: {status}")),
        Err(error) => Err(format!("`{line}` did not start: {error}")),
    }
}
