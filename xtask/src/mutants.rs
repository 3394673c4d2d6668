//! `cargo xtask mutants`: faults planted in the stages one at a time, by cargo-mutants; a test must fail of each.
//!
//! A fixed sample, every n-th of all faults that it knows in these crates from one of the first n on, and the tests of the crate that a fault
//! lies in, without those of its documentation. Each fault is a build, so this is no part of `cargo xtask ci`.

use crate::repo::{Outcome, Repo};
use std::fs;
use std::path::Path;
use std::process::Command;

/// What faults are planted in, with the features whose tests are wanted.
const CRATES: [(&str, &str); 5] = [
    ("organza-tsm", "gpu"),
    ("organza-hbsort", "gpu"),
    ("organza-pbsr", "gpu"),
    ("organza-splat-core", "gpu"),
    ("organza-reference", ""),
];

/// Which faults are planted, unless asked otherwise: the first of each hundred.
const SHARD: Shard = Shard { from: 0, every: 100 };
/// Share of the faults that may survive.
const MOST_SURVIVORS: f64 = 0.1;

const USAGE: &str = "usage: cargo xtask mutants [--shard K/N] [CRATE…]; K is less than N";

/// Every n-th fault, from one of the first n on: two of the same n share none.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Shard {
    from: usize,
    every: usize,
}

impl Shard {
    fn parse(word: &str) -> Option<Self> {
        let (from, every) = word.split_once('/')?;
        let shard = Self { from: from.parse().ok()?, every: every.parse().ok()? };
        (shard.from < shard.every).then_some(shard)
    }
}

/// What is asked for.
#[derive(Debug, PartialEq)]
struct Plan<'a> {
    shard: Shard,
    /// Packages with their features.
    crates: Vec<(&'a str, &'a str)>,
}

impl<'a> Plan<'a> {
    /// The words behind the command; `None` for what is none of them.
    fn parse(words: &[&'a str]) -> Option<Self> {
        let mut plan = Self { shard: SHARD, crates: Vec::new() };
        let mut words = words.iter();
        while let Some(word) = words.next() {
            match *word {
                "--shard" => plan.shard = Shard::parse(words.next()?)?,
                name => plan.crates.push(*CRATES.iter().find(|(package, _)| *package == name)?),
            }
        }
        if plan.crates.is_empty() {
            plan.crates = CRATES.to_vec();
        }
        Some(plan)
    }
}

/// Plants the faults; says that it was skipped where cargo-mutants is not installed.
pub(crate) fn run(repo: &Repo, words: &[&str]) -> Outcome {
    let plan = Plan::parse(words).ok_or(USAGE)?;
    if !mutants(repo, &["--version"]).is_ok_and(|status| status.success()) {
        let install = "install with `cargo install cargo-mutants --locked`";
        return Ok(format!("mutants: SKIPPED, missing: cargo-mutants; {install}"));
    }
    let mut total = Found::default();
    let shard = format!("{}/{}", plan.shard.from, plan.shard.every);
    for (package, features) in plan.crates {
        let to = format!("target/mutants/{package}");
        fs::create_dir_all(repo.root.join(&to)).map_err(|e| format!("{to}: {e}"))?;
        let what = ["--package", package, "--features", features, "--shard", &shard, "--sharding", "round-robin"];
        let how = ["--no-shuffle", "--output", &to, "--", "--lib", "--tests"];
        let status = mutants(repo, &[&what[..], &how].concat())?;
        // 2 and 3: some survived, some ran for too long.
        if !matches!(status.code(), Some(0 | 2 | 3)) {
            return Err(format!("{package}: cargo mutants: {status}"));
        }
        let found = Found::read(&repo.root.join(&to).join("mutants.out"))?;
        println!("<== {package}: {}", found.text());
        total.caught += found.caught;
        total.survived.extend(found.survived);
    }
    let said = std::iter::once(format!("mutants: {}", total.text())).chain(total.survived.iter().cloned());
    let said = said.collect::<Vec<_>>().join("\n");
    if total.share() <= MOST_SURVIVORS { Ok(said) } else { Err(said) }
}

fn mutants(repo: &Repo, words: &[&str]) -> Result<std::process::ExitStatus, String> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let mut command = Command::new(cargo);
    command.arg("mutants").args(words).current_dir(&repo.root);
    command.status().map_err(|e| format!("cargo mutants did not start: {e}"))
}

/// What became of the faults that compile.
#[derive(Debug, Default, PartialEq)]
struct Found {
    /// A test failed, or did not end.
    caught: usize,
    /// Each with its place.
    survived: Vec<String>,
}

impl Found {
    /// What cargo-mutants wrote into a folder.
    fn read(folder: &Path) -> Result<Self, String> {
        let lines = |name: &str| {
            let text = fs::read_to_string(folder.join(name)).map_err(|e| format!("{}: {e}", folder.display()))?;
            Ok::<_, String>(text.lines().map(str::to_owned).collect::<Vec<_>>())
        };
        Ok(Self { caught: lines("caught.txt")?.len() + lines("timeout.txt")?.len(), survived: lines("missed.txt")? })
    }

    /// Share that survived.
    fn share(&self) -> f64 {
        self.survived.len() as f64 / (self.caught + self.survived.len()).max(1) as f64
    }

    fn text(&self) -> String {
        let survived = self.survived.len();
        let planted = self.caught + survived;
        format!("{survived} of {planted} planted faults survived ({:.0} %)", 100.0 * self.share())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn words_are_understood_or_refused() {
        assert_eq!(Plan::parse(&[]), Some(Plan { shard: SHARD, crates: CRATES.to_vec() }));
        let one = Plan { shard: Shard { from: 3, every: 7 }, crates: vec![CRATES[1]] };
        assert_eq!(Plan::parse(&["--shard", "3/7", "organza-hbsort"]), Some(one));
        for wrong in
            [&["--shard"][..], &["--shard", "0"], &["--shard", "7/7"], &["--shard", "-1/7"], &["hbsort"], &["--all"]]
        {
            assert_eq!(Plan::parse(wrong), None, "{wrong:?}");
        }
    }

    #[test]
    fn what_was_written_is_counted() {
        let folder = std::env::temp_dir().join(format!("xtask-mutants-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("a folder");
        let written = [("caught.txt", "a\nb\n"), ("timeout.txt", "c\n"), ("missed.txt", "d\n")];
        written.iter().for_each(|(name, text)| fs::write(folder.join(name), text).expect("a file"));
        let found = Found::read(&folder).expect("files");
        fs::remove_dir_all(&folder).expect("a folder");
        assert_eq!(found, Found { caught: 3, survived: vec!["d".to_owned()] });
        assert_eq!(found.text(), "1 of 4 planted faults survived (25 %)");
        assert_eq!(Found::default().share(), 0.0);
    }
}
