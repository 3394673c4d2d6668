//! `cargo xtask papers`: the ledger of what the papers claim and what became of it.
//!
//! `docs/papers/*.toml` hold one row per numbered equation and per quantitative claim; `docs/papers.md` is made from
//! them. A row names code and tests, and a name that no longer exists is an error; so is a verdict that no test and no benchmark
//! stands for, and a test of what is not built. Times are named, and taken from what benchmarks wrote: one by hand is an error, and a benchmark that never ran. Hard cases need a test that bears their id.

mod hard_cases;
mod ledger;
mod names;
mod page;
mod times;

use crate::repo::{Outcome, Repo};
use ledger::{Ledger, Verdict};
use times::Times;
pub(crate) use times::refresh;

const PAGE: &str = "docs/papers.md";
const FOLDER: &str = "docs/papers/";

/// Writes the page.
pub(crate) fn write(repo: &Repo) -> Outcome {
    let ledgers = read(repo)?;
    let page = page::page(&ledgers);
    std::fs::write(repo.root.join(PAGE), page).map_err(|e| format!("{PAGE}: {e}"))?;
    let missing = names::missing(repo, &ledgers);
    Ok([vec![summary(&ledgers)], missing].concat().join("\n"))
}

/// Fails where the page is stale, or where a row names what does not exist.
pub(crate) fn check(repo: &Repo) -> Outcome {
    let ledgers = read(repo)?;
    let mut wrong = names::missing(repo, &ledgers);
    wrong.extend(hard_cases::untested(repo));
    // A checkout may turn line ends.
    if repo.text(PAGE).unwrap_or_default().replace("\r\n", "\n") != page::page(&ledgers) {
        wrong.push(format!("{PAGE} is stale: run `cargo xtask papers`"));
    }
    if wrong.is_empty() { Ok(summary(&ledgers)) } else { Err(wrong.join("\n")) }
}

fn read(repo: &Repo) -> Result<Vec<Ledger>, String> {
    let sources = repo.texts().filter(|(path, _)| path.starts_with(FOLDER) && path.ends_with(".toml"));
    let with_times = |(path, text): (&str, &str)| {
        let mut ledger = Ledger::parse(path, text)?;
        let times = Times::for_ledger(repo, path)?;
        for row in &mut ledger.rows {
            if let Some(why) = times::by_hand(row) {
                return Err(format!("{path}: {}: {why}", row.id));
            }
            let fill = |text: &str| times.fill(text).map_err(|why| format!("{path}: {}: {why}", row.id));
            (row.ours, row.reason) = (fill(&row.ours)?, fill(&row.reason)?);
        }
        Ok(ledger)
    };
    sources.map(with_times).collect()
}

fn summary(ledgers: &[Ledger]) -> String {
    let rows = || ledgers.iter().flat_map(|l| &l.rows);
    let count = |verdict| format!("{} {}", rows().filter(|r| r.verdict == verdict).count(), verdict.words());
    format!("papers: {} rows: {}", rows().count(), Verdict::ALL.map(count).join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DATA: &str = "[paper]\ntitle = \"T\"\nauthors = \"A\"\nyear = \"2007\"\nnote = \"N\"\n[[row]]\nid = \"Eq. 1\"\n\
        claim = \"c\"\ncode = \"src/a.rs::f\"\ntest = \"f_holds\"\nours = \"1\"\nverdict = \"holds\"\nreason = \"r\"\n";

    fn repo(page: &str, code: &str) -> Repo {
        Repo::in_memory(&[("docs/papers/t.toml", DATA), (PAGE, page), ("src/a.rs", code)])
    }

    #[test]
    fn a_fresh_page_passes_and_a_stale_one_fails() {
        let ledger = Ledger::parse("t", DATA).expect("well formed");
        let page = page::page(&[ledger]);
        let code = "fn f() {}\nfn f_holds() {}\n";
        assert_eq!(
            check(&repo(&page, code)),
            Ok("papers: 1 rows: 1 holds, 0 differs, 0 not built, 0 not reproducible, 0 not measured".to_owned())
        );
        assert!(check(&repo(&page.replace("\n", "\r\n"), code)).is_ok());
        let stale = check(&repo(&format!("{page}more\n"), code)).expect_err("stale");
        assert_eq!(stale, "docs/papers.md is stale: run `cargo xtask papers`");
    }

    #[test]
    fn times_come_from_the_file_beside_the_ledger() {
        let csv = ("docs/papers/t-times.csv", "what,low_ms,mean_ms,high_ms,elements\n\"sort/1\",1,2,3,\n");
        let data = DATA.replace("ours = \"1\"", "ours = \"{sort/1}\"");
        let ours =
            |files: &[(&str, &str)]| read(&Repo::in_memory(files)).map(|ledgers| ledgers[0].rows[0].ours.clone());
        let ledger = ("docs/papers/t.toml", data.as_str());
        assert_eq!(ours(&[ledger, csv]), Ok("2.00 ms".to_owned()));
        let why = "docs/papers/t.toml: Eq. 1: no benchmark {sort/1} in its -times.csv";
        assert_eq!(ours(&[ledger]), Err(why.to_owned()));
        let by_hand = DATA.replace("ours = \"1\"", "ours = \"sorted, in 2 ms; often\"");
        let why = "docs/papers/t.toml: Eq. 1: has a time that stands in no -times.csv";
        assert_eq!(ours(&[("docs/papers/t.toml", &by_hand)]), Err(why.to_owned()));
        let never_ran = DATA.replace("src/a.rs::f", "benches/benches/a.rs");
        let why = "docs/papers/t.toml: Eq. 1: names a benchmark, and no time that it left";
        assert_eq!(ours(&[("docs/papers/t.toml", &never_ran)]), Err(why.to_owned()));
    }

    #[test]
    fn a_vanished_name_fails() {
        let page = page::page(&[Ledger::parse("t", DATA).expect("well formed")]);
        let why = check(&repo(&page, "fn g() {}\n")).expect_err("neither f nor its test exists");
        assert_eq!(why, "Eq. 1: src/a.rs has no f\nEq. 1: no source has the test f_holds");
    }
}
