//! `cargo xtask effects`: what each effect of every scene changes, where families of scenes cross their thresholds, and predicted beside measured times:
//! measured, into docs/effects.csv, docs/effect-families.csv, docs/predictions.csv and docs/effects.md.

use crate::ci::{DRIVER, FEATURES};
use crate::repo::{Outcome, Repo};
use std::path::Path;
use std::process::Command;
use std::time::{SystemTime, UNIX_EPOCH};

const EXAMPLE: [&str; 6] = ["run", "--release", "--package", "organza-judge", "--example", "effects"];
/// Tests that draw families of scenes.
const FAMILIES: &str = "x7_";
const TABLE: &str = "docs/effect-families.csv";
const HEAD: &str = "effect,grows,settings,first_visible,last_left_out,largest_change_left_out_in_tolerances,median_bound_over_change\n";

/// Draws families and all scenes, which takes an hour.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let time = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |time| time.as_secs());
    println!("families of seed {time}");
    families(repo, &time.to_string())?;
    cargo(repo, &EXAMPLE.map(str::to_owned), &[])?;
    Ok("effects: docs/effects.csv, docs/effect-families.csv, docs/predictions.csv and docs/effects.md are written"
        .to_owned())
}

/// Draws families of this seed by the tests, which add a row each to the table.
fn families(repo: &Repo, seed: &str) -> Result<(), String> {
    let table = repo.root.join(TABLE);
    let write = |text: &str| std::fs::write(&table, text).map_err(|error| format!("{TABLE}: {error}"));
    write(HEAD)?;
    let features = format!("{FEATURES},{DRIVER}");
    let words =
        ["test", "--workspace", "--exclude", "organza-benches", "--features", &features, "--test", "end_to_end"];
    let words: Vec<String> = words.iter().chain(&["--", FAMILIES]).map(|word| (*word).to_owned()).collect();
    let path = table.display().to_string();
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

fn cargo(repo: &Repo, words: &[String], environment: &[(&str, &str)]) -> Result<(), String> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(program);
    command.args(words).envs(environment.iter().copied()).current_dir(&repo.root);
    match command.status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`cargo {}`: {status}", words.join(" "))),
        Err(error) => Err(format!("cargo did not start: {error}")),
    }
}
