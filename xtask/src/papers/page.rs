//! `docs/papers.md`: one table per paper.

use super::ledger::{Ledger, Row, Verdict};
use std::fmt::Write as _;

/// The whole page.
pub(crate) fn page(ledgers: &[Ledger]) -> String {
    let mut out = String::from(
        "<!-- Made by `cargo xtask papers` from docs/papers/*.toml. Edit those. -->\n\
         # The papers, claim by claim\n\n\
         Every numbered equation and every claim with a number in it, of each paper that Organza is made from: where it\n\
         stands in the code, which test holds it, what we measure, and the verdict. *Holds*: as the paper says, within the\n\
         test's tolerance. *Differs*: implemented in another way, or found to be otherwise; the reason says why.\n\
         *Not built*: nothing of the kind exists here, so that nothing could be compared. *Not reproducible*: it depends on\n\
         hardware or data that nobody else has. *Not measured*: still open.\n",
    );
    for ledger in ledgers {
        let _ = write!(out, "\n## {} ({}): {}\n\n{}\n\n", ledger.authors, ledger.year, ledger.title, ledger.note);
        let count = |v: Verdict| format!("{} {}", ledger.rows.iter().filter(|r| r.verdict == v).count(), v.words());
        let _ = writeln!(out, "{} rows: {}.\n", ledger.rows.len(), Verdict::ALL.map(count).join(", "));
        out.push_str(
            "| where | claim | code | test | our number | verdict | reason |\n|---|---|---|---|---|---|---|\n",
        );
        ledger.rows.iter().for_each(|row| out.push_str(&line(row)));
    }
    out
}

fn line(row: &Row) -> String {
    let names = |list: &[String]| match list {
        [] => "—".to_owned(),
        _ => list.iter().map(|n| format!("`{n}`")).collect::<Vec<_>>().join(", "),
    };
    let cells =
        [&row.id, &row.claim, &names(&row.code), &names(&row.tests), &row.ours, row.verdict.words(), &row.reason]
            .map(|cell: &str| cell.replace('|', "\\|"));
    format!("| {} |\n", cells.join(" | "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_one_line_with_seven_cells() {
        let text = "[paper]\ntitle = \"T\"\nauthors = \"A\"\nyear = \"2007\"\nnote = \"N\"\n[[row]]\nid = \"Eq. 1\"\n\
            claim = \"a | b\"\ncode = \"x.rs::f, y.rs\"\ntest = \"—\"\nours = \"2\"\nverdict = \"holds\"\nreason = \"r\"\n";
        let page = page(&[Ledger::parse("p", text).expect("well formed")]);
        assert!(page.ends_with("| Eq. 1 | a \\| b | `x.rs::f`, `y.rs` | — | 2 | holds | r |\n"), "{page}");
        assert!(page.contains("## A (2007): T\n\nN\n\n1 rows: 1 holds, 0 differs"), "{page}");
    }
}
