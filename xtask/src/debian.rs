//! Packages of Debian and Ubuntu that some steps need: installed where that needs no question, named where it does.

use crate::repo::Outcome;
use std::path::{Path, PathBuf};
use std::process::Command;

/// The folders that hold programs.
pub(crate) fn folders() -> Vec<PathBuf> {
    std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default()).collect()
}

/// The file of a program.
pub(crate) fn on_path(folders: &[PathBuf], program: &str) -> Option<PathBuf> {
    folders.iter().map(|folder| folder.join(program)).find(|file| file.is_file())
}

/// Installs packages as root with apt, for parts that are missing. Says whether it did.
pub(crate) fn install(folders: &[PathBuf], packages: &[&str], missing: &str) -> bool {
    let root = Command::new("id").arg("-u").output().is_ok_and(|o| o.stdout.trim_ascii() == b"0");
    let Some(apt) = on_path(folders, "apt-get").filter(|_| root) else { return false };
    println!("missing: {missing}\n$ {}", command(packages));
    let run = |apt: &Path, words: &[&str], packages: &[&str]| {
        let ran = Command::new(apt).args(words).args(packages).env("DEBIAN_FRONTEND", "noninteractive").status();
        let is_done = ran.is_ok_and(|status| status.success());
        if !is_done {
            eprintln!("apt-get {} failed", words[0]);
        }
        is_done
    };
    run(&apt, &["update", "-qq"], &[]) && run(&apt, &["install", "-qq", "-y", "--no-install-recommends"], packages)
}

fn command(packages: &[&str]) -> String {
    format!("apt-get update && apt-get install -y --no-install-recommends {}", packages.join(" "))
}

/// Without the parts nothing is tested: said by name, and no success where everything must be.
pub(crate) fn without(what: &str, packages: &[&str], missing: &str) -> Outcome {
    refuse_or_skip(what, packages, missing, std::env::var("CI").as_deref() == Ok("true"))
}

fn refuse_or_skip(what: &str, packages: &[&str], missing: &str, ci: bool) -> Outcome {
    let said = format!("missing: {missing}; install with `{}`", command(packages));
    if ci { Err(said) } else { Ok(format!("{what}: SKIPPED, {said}")) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn skipping_is_said_and_no_success_where_everything_must_be() {
        let said = refuse_or_skip("vulkan", &["mesa"], "lavapipe", false).unwrap();
        let expected = "vulkan: SKIPPED, missing: lavapipe; install with `apt-get update";
        assert!(said.starts_with(expected) && said.contains("mesa"), "{said}");
        assert!(refuse_or_skip("vulkan", &["mesa"], "lavapipe", true).is_err());
    }
}
