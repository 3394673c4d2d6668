//! `cargo xtask deny`: licences and sources of all dependencies, by cargo-deny and `deny.toml`.

use crate::repo::{Outcome, Repo};
use std::process::Command;

/// What can be checked without a network. Known holes (`cargo deny check advisories`) need a database that is fetched.
const CHECKS: [&str; 3] = ["licenses", "bans", "sources"];

/// Runs cargo-deny; says that it was skipped where it is not installed.
pub(crate) fn run(repo: &Repo) -> Outcome {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let deny = |words: &[&str]| Command::new(&cargo).arg("deny").args(words).current_dir(&repo.root).output();
    if !deny(&["--version"]).is_ok_and(|out| out.status.success()) {
        return Ok("deny: SKIPPED, missing: cargo-deny; install with `cargo install cargo-deny --locked`".to_owned());
    }
    let words = [&["--offline", "check", "--hide-inclusion-graph"][..], &CHECKS].concat();
    let out = deny(&words).map_err(|e| format!("cargo deny did not start: {e}"))?;
    if out.status.success() {
        Ok(format!("deny: {}", String::from_utf8_lossy(&out.stdout).trim()))
    } else {
        Err(format!("deny found\n{}", String::from_utf8_lossy(&out.stderr)))
    }
}
