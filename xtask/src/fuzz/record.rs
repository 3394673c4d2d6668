//! What a run of the fuzzer says, kept in `fuzz/runs.csv`, and shown as a table in docs/robustness.md.

use crate::repo::Repo;
use std::fmt;

const RUNS: &str = "fuzz/runs.csv";
const PAGE: &str = "docs/robustness.md";
const HEAD: &str = "target,seconds,executions,edges,found";

/// Between these the page holds the table.
const TABLE: [&str; 2] =
    ["<!-- Made by `cargo xtask fuzz --record` from fuzz/runs.csv. -->\n", "<!-- End of the table. -->\n"];

/// One target, run once.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Run {
    target: String,
    /// How long inputs were tried.
    seconds: u64,
    /// How many inputs were tried.
    executions: u64,
    /// How many edges of the program's flow they took.
    edges: u64,
    /// Files that hold inputs that do harm.
    pub(super) found: Vec<String>,
}

impl Run {
    /// What libFuzzer says of it, and how long it took.
    pub(super) fn from_output(target: &str, said: &str, seconds: u64) -> Result<Self, String> {
        let wrong = |what: &str| format!("{target}: libFuzzer did not say {what}\n{said}");
        let executions =
            said.lines().find_map(|l| l.strip_prefix("stat::number_of_executed_units:")?.trim().parse().ok());
        // `#4096 pulse  cov: 1234 ft: …`
        let edges = said.lines().rev().find_map(|l| l.split_once(" cov: ")?.1.split(' ').next()?.parse().ok());
        let found = said.lines().filter_map(|l| Some(l.split_once("Test unit written to ")?.1.to_owned())).collect();
        Ok(Self {
            target: target.to_owned(),
            seconds,
            executions: executions.ok_or_else(|| wrong("how many inputs it tried"))?,
            edges: edges.ok_or_else(|| wrong("what they reach"))?,
            found,
        })
    }
}

impl fmt::Display for Run {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { target, seconds, executions, edges, found } = self;
        write!(f, "{target}: {executions} inputs in {seconds} s, {edges} edges, {} found", found.len())
    }
}

/// Puts runs into the file in the place of older ones of the same targets, and the table into the page.
pub(super) fn write(repo: &Repo, runs: &[Run]) -> Result<(), String> {
    let row = |r: &Run| {
        [r.target.clone(), [r.seconds, r.executions, r.edges, r.found.len() as u64].map(|n| n.to_string()).join(",")]
            .join(",")
    };
    // As they are by now: another run may have ended in between.
    let now = |path: &str| std::fs::read_to_string(repo.root.join(path)).map_err(|e| format!("{path}: {e}"));
    let is_new = |old: &&str| !runs.iter().any(|run| old.split(',').next() == Some(run.target.as_str()));
    let before = now(RUNS)?;
    let old = before.lines().skip(1).filter(is_new).map(str::to_owned);
    let mut rows: Vec<String> = old.chain(runs.iter().map(row)).collect();
    rows.sort_unstable();
    let text = format!("{HEAD}\n{}\n", rows.join("\n"));
    let page = page(&now(PAGE)?, &text)?;
    for (path, content) in [(RUNS, &text), (PAGE, &page)] {
        std::fs::write(repo.root.join(path), content).map_err(|e| format!("{path}: {e}"))?;
    }
    Ok(())
}

/// The page with the table of these runs.
fn page(page: &str, runs: &str) -> Result<String, String> {
    let parts = page.split_once(TABLE[0]).and_then(|(before, rest)| Some((before, rest.split_once(TABLE[1])?.1)));
    let (before, after) = parts.ok_or_else(|| format!("{PAGE} has no place for the table"))?;
    let rows: Vec<Vec<&str>> = runs.lines().skip(1).map(|row| row.split(',').collect()).collect();
    let sum = |i: usize| rows.iter().map(|row| row[i].parse::<u64>().unwrap_or(0)).sum::<u64>();
    let mut table =
        "| target | seconds | inputs tried | edges reached | found |\n|---|---:|---:|---:|---:|\n".to_owned();
    rows.iter().for_each(|row| table.push_str(&format!("| `{}` | {} |\n", row[0], row[1..].join(" | "))));
    table.push_str(&format!("| all | {} | {} | | {} |\n", sum(1), sum(2), sum(4)));
    Ok([before, TABLE[0], &table, TABLE[1], after].concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_fuzzer_says_is_understood() {
        let end = "#2 INITED cov: 10 ft: 11 corp: 1/2b\n#512\tpulse  cov: 345 ft: 400 corp: 9/1kb\nDone 700 runs in 61 second(s)\n\
            stat::number_of_executed_units: 700\n";
        let run = Run { target: "a".into(), seconds: 61, executions: 700, edges: 345, found: vec![] };
        assert_eq!(Run::from_output("a", end, 61), Ok(run.clone()));
        let crash = "#512\tNEW    cov: 345 ft: 400\nstat::number_of_executed_units: 9\nartifact_prefix='x'; Test unit written to x/crash-1\n";
        let found = vec!["x/crash-1".to_owned()];
        assert_eq!(Run::from_output("a", crash, 7), Ok(Run { seconds: 7, executions: 9, found, ..run }));
        assert!(Run::from_output("a", "error: no such target", 0).is_err());
    }

    #[test]
    fn the_page_shows_what_was_run() {
        let repo = Repo::open().expect("the repository is readable");
        let shown = repo.text(PAGE).expect("there is a page");
        assert_eq!(
            page(shown, repo.text(RUNS).expect("there are runs")).as_deref(),
            Ok(shown),
            "run `cargo xtask fuzz --record`"
        );
    }
}
