//! `cargo xtask papers`: the ledger of what the papers claim and what became of it.
//!
//! `docs/papers/*.toml` hold one row per numbered equation and per quantitative claim; `docs/papers.md` is made from
//! them. A row names code and tests, and a name that no longer exists is an error.

mod ledger;
mod names;
mod page;

use crate::repo::{Outcome, Repo};
use ledger::{Ledger, Verdict};

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
    // A checkout may turn line ends.
    if repo.text(PAGE).unwrap_or_default().replace("\r\n", "\n") != page::page(&ledgers) {
        wrong.push(format!("{PAGE} is stale: run `cargo xtask papers`"));
    }
    if wrong.is_empty() { Ok(summary(&ledgers)) } else { Err(wrong.join("\n")) }
}

fn read(repo: &Repo) -> Result<Vec<Ledger>, String> {
    let sources = repo.texts().filter(|(path, _)| path.starts_with(FOLDER) && path.ends_with(".toml"));
    sources.map(|(path, text)| Ledger::parse(path, text)).collect()
}

fn summary(ledgers: &[Ledger]) -> String {
    let rows = || ledgers.iter().flat_map(|l| &l.rows);
    let of = |verdict| format!("{} {}", rows().filter(|r| r.verdict == verdict).count(), verdict.words());
    format!("papers: {} rows: {}", rows().count(), Verdict::ALL.map(of).join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    const DATA: &str = "[paper]\ntitle = \"T\"\nauthors = \"A\"\nyear = \"2007\"\nnote = \"N\"\n[[row]]\nid = \"Eq. 1\"\n\
        claim = \"c\"\ncode = \"src/a.rs::f\"\ntest = \"f_holds\"\nours = \"1\"\nverdict = \"holds\"\nreason = \"r\"\n";

    fn repo(page: &str, code: &str) -> Repo {
        Repo::of(&[("docs/papers/t.toml", DATA), (PAGE, page), ("src/a.rs", code)])
    }

    #[test]
    fn a_fresh_page_passes_and_a_stale_one_fails() {
        let ledger = Ledger::parse("t", DATA).expect("well formed");
        let page = page::page(&[ledger]);
        let code = "fn f() {}\nfn f_holds() {}\n";
        assert_eq!(
            check(&repo(&page, code)),
            Ok("papers: 1 rows: 1 holds, 0 differs, 0 not reproducible, 0 not measured".to_owned())
        );
        assert!(check(&repo(&page.replace("\n", "\r\n"), code)).is_ok());
        let stale = check(&repo(&format!("{page}more\n"), code)).expect_err("stale");
        assert_eq!(stale, "docs/papers.md is stale: run `cargo xtask papers`");
    }

    #[test]
    fn a_vanished_name_fails() {
        let page = page::page(&[Ledger::parse("t", DATA).expect("well formed")]);
        let why = check(&repo(&page, "fn g() {}\n")).expect_err("neither f nor its test exists");
        assert_eq!(why, "Eq. 1: src/a.rs has no f\nEq. 1: no source has the test f_holds");
    }
}
