//! `cargo xtask fuzz`: every target of `fuzz/` for a while, by cargo-fuzz on a nightly toolchain.
//!
//! Seeds are the small files of `read`'s suite of damage, the scenes of the repository and `fuzz/seeds/`; what libFuzzer finds
//! beside them stays in `fuzz/corpus/`, and inputs that do harm in `fuzz/artifacts/`. With `--record` what was run goes into
//! `fuzz/runs.csv`, of which the table of docs/robustness.md is made.

mod record;

use crate::repo::{Outcome, Repo};
use record::Run;
use std::process::{Command, Output};
use std::time::Instant;

/// Where the targets lie.
const TARGETS: &str = "fuzz/fuzz_targets/";

/// Most memory of the whole process and of one allocation, MiB, and the longest time of one input, s. Readers are allowed 64 MiB for
/// a file and as much for what is made of it; the rest is the sanitizer's.
const LIMITS: [&str; 4] = ["-rss_limit_mb=2048", "-malloc_limit_mb=256", "-timeout=20", "-report_slow_units=20"];

/// What is asked for.
#[derive(Debug, PartialEq)]
struct Plan {
    /// For each target.
    seconds: u64,
    is_recorded: bool,
    /// All, if there are none.
    targets: Vec<String>,
}

impl Plan {
    /// The words behind the command; `None` for what is none of them.
    fn parse(words: &[&str]) -> Option<Self> {
        let mut plan = Self { seconds: 60, is_recorded: false, targets: Vec::new() };
        let mut words = words.iter();
        while let Some(word) = words.next() {
            match *word {
                "--seconds" => plan.seconds = words.next()?.parse().ok().filter(|n| *n > 0)?,
                "--record" => plan.is_recorded = true,
                option if option.starts_with('-') => return None,
                target => plan.targets.push(target.to_owned()),
            }
        }
        Some(plan)
    }

    /// The targets that are asked for, of those that there are.
    fn chosen<'a>(&self, repo: &'a Repo) -> Result<Vec<&'a str>, String> {
        let names = repo.rust().filter_map(|(path, _)| path.strip_prefix(TARGETS)?.strip_suffix(".rs"));
        let targets: Vec<&str> = names.collect();
        if let Some(unknown) = self.targets.iter().find(|asked| !targets.contains(&asked.as_str())) {
            return Err(format!("no such target: {unknown}; there are {}", targets.join(", ")));
        }
        Ok(targets
            .into_iter()
            .filter(|name| self.targets.is_empty() || self.targets.iter().any(|t| t == name))
            .collect())
    }
}

/// Runs the targets one after the other; says that it was skipped where a tool is missing.
pub(crate) fn run(repo: &Repo, words: &[&str]) -> Outcome {
    let plan = Plan::parse(words).ok_or("usage: cargo xtask fuzz [--seconds N] [--record] [TARGET…]")?;
    let targets = plan.chosen(repo)?;
    if let Some(missing) = missing(repo) {
        return Ok(format!("fuzz: SKIPPED, missing: {missing}"));
    }
    write_seeds(repo)?;
    let mut runs = Vec::new();
    let mut said = Vec::new();
    for target in targets {
        println!("==> {target}, {} s", plan.seconds);
        let run = fuzz(repo, target, plan.seconds)?;
        println!("<== {run}");
        said.extend(run.found.iter().map(|input| format!("{target}: see {input}")));
        runs.push(run);
        // Each as soon as it is there: all of them take hours.
        if plan.is_recorded {
            record::write(repo, &runs)?;
        }
    }
    if said.is_empty() { Ok(format!("fuzz: {} targets, nothing found", runs.len())) } else { Err(said.join("\n")) }
}

/// Cargo of the nightly toolchain, whatever toolchain runs this program.
fn nightly(repo: &Repo, words: &[&str]) -> Result<Output, String> {
    let mut command = Command::new("rustup");
    command.args(["run", "nightly", "cargo"]).args(words).current_dir(&repo.root);
    // Those of the toolchain that runs this program.
    for name in ["CARGO", "RUSTC", "RUSTUP_TOOLCHAIN", "RUSTFLAGS"] {
        command.env_remove(name);
    }
    command.output().map_err(|e| format!("rustup: {e}"))
}

/// What has to be installed, and how.
fn missing(repo: &Repo) -> Option<String> {
    let works = |words: &[&str]| nightly(repo, words).is_ok_and(|out| out.status.success());
    if !works(&["--version"]) {
        return Some(
            "a nightly toolchain; install with `rustup toolchain install nightly --profile minimal`".to_owned(),
        );
    }
    let install = "cargo-fuzz; install with `cargo install cargo-fuzz --locked` (a C++ compiler is needed too)";
    (!works(&["fuzz", "--version"])).then(|| install.to_owned())
}

/// Writes the small files of `read` beside what was found before.
fn write_seeds(repo: &Repo) -> Result<(), String> {
    let program = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let words = ["run", "--quiet", "--package", "organza-read", "--example", "samples", "--", "fuzz/corpus"];
    match Command::new(program).args(words).current_dir(&repo.root).status() {
        Ok(status) if status.success() => Ok(()),
        Ok(status) => Err(format!("`cargo {}`: {status}", words.join(" "))),
        Err(e) => Err(format!("cargo did not start: {e}")),
    }
}

/// The folder of seeds that belong to the repository, if the target has one.
fn seeds(repo: &Repo, target: &str) -> Option<String> {
    let folder = if target == "scene" { "scenes".to_owned() } else { format!("fuzz/seeds/{target}") };
    let within = format!("{folder}/");
    repo.files.iter().any(|file| file.path.starts_with(&within)).then_some(folder)
}

/// Runs one target. It ends early at an input that does harm.
fn fuzz(repo: &Repo, target: &str, seconds: u64) -> Result<Run, String> {
    let corpus = format!("fuzz/corpus/{target}");
    std::fs::create_dir_all(repo.root.join(&corpus)).map_err(|e| format!("{corpus}: {e}"))?;
    let built = nightly(repo, &["fuzz", "build", target])?;
    if !built.status.success() {
        return Err(format!("{target} does not build\n{}", String::from_utf8_lossy(&built.stderr)));
    }
    let time = format!("-max_total_time={seconds}");
    let seeds = seeds(repo, target);
    let folders = [&corpus].into_iter().chain(&seeds).map(String::as_str);
    let mut words = vec!["fuzz", "run", target];
    words.extend(folders.chain(["--", &time, "-print_final_stats=1"]).chain(LIMITS));
    let start = Instant::now();
    let out = nightly(repo, &words)?;
    let text = String::from_utf8_lossy(&out.stderr);
    let run = Run::from_output(target, &text, start.elapsed().as_secs())?;
    if out.status.success() != run.found.is_empty() {
        return Err(format!("{target} ended with {}\n{text}", out.status));
    }
    Ok(run)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_a_plan_or_nothing() {
        let plan = |seconds, is_recorded, targets: &[&str]| {
            Some(Plan { seconds, is_recorded, targets: targets.iter().map(|t| (*t).to_owned()).collect() })
        };
        assert_eq!(Plan::parse(&[]), plan(60, false, &[]));
        assert_eq!(Plan::parse(&["ply", "--seconds", "9", "las", "--record"]), plan(9, true, &["ply", "las"]));
        for wrong in [&["--seconds"][..], &["--seconds", "0"], &["--seconds", "x"], &["--fast"]] {
            assert_eq!(Plan::parse(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn targets_are_the_files_in_their_folder() {
        let repo = Repo::in_memory(&[
            ("fuzz/fuzz_targets/las.rs", ""),
            ("fuzz/fuzz_targets/ply.rs", ""),
            ("fuzz/src/lib.rs", ""),
        ]);
        let chosen = |words: &[&str]| Plan::parse(words).expect("a plan").chosen(&repo);
        assert_eq!(chosen(&[]), Ok(vec!["las", "ply"]));
        assert_eq!(chosen(&["ply"]), Ok(vec!["ply"]));
        assert_eq!(chosen(&["obj"]), Err("no such target: obj; there are las, ply".to_owned()));
    }

    #[test]
    fn seeds_lie_in_the_folder_of_their_target() {
        let repo = Repo::in_memory(&[("fuzz/seeds/image/a", ""), ("scenes/a.toml", "")]);
        assert_eq!(seeds(&repo, "image").as_deref(), Some("fuzz/seeds/image"));
        assert_eq!(seeds(&repo, "scene").as_deref(), Some("scenes"));
        assert_eq!(seeds(&repo, "ply"), None);
    }

    #[test]
    fn every_reader_of_a_file_has_a_target() {
        let repo = Repo::open().expect("the repository is readable");
        let targets = Plan::parse(&[]).expect("a plan").chosen(&repo).expect("targets");
        let formats = repo.text("crates/read/src/format.rs").expect("there is a list of formats");
        let list = formats.split_once("enum Format {").and_then(|(_, rest)| rest.split_once('}')).expect("the list").0;
        let formats: Vec<String> = list.split(',').map(|name| name.trim().to_lowercase()).collect();
        let formats: Vec<&str> = formats.iter().map(String::as_str).filter(|name| !name.is_empty()).collect();
        assert!(formats.len() > 15, "{formats:?}");
        // Files of VTK in XML are told by the ending that images among them have.
        let targets_needed = formats.iter().map(|format| if *format == "vtkxml" { "vti" } else { *format });
        let without: Vec<_> = targets_needed.filter(|target| !targets.contains(target)).collect();
        assert!(without.is_empty(), "{without:?}");
        let manifest = repo.text("fuzz/Cargo.toml").expect("there is a crate of targets");
        for target in targets {
            assert!(manifest.contains(&format!("path = \"fuzz_targets/{target}.rs\"")), "{target}");
        }
    }
}
