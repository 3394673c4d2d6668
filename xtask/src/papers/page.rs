//! `docs/papers.md`: one table per paper.

use super::ledger::{Ledger, Row, Verdict};
use std::fmt::Write as _;

/// The folder of pictures, as rows name it.
const PICTURES: &str = "docs/images/";

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
    let ours = with_links(&row.ours);
    let reason = with_links(&row.reason);
    let cells = [&row.id, &row.claim, &names(&row.code), &names(&row.tests), &ours, row.verdict.words(), &reason]
        .map(|cell: &str| cell.replace('|', "\\|"));
    format!("| {} |\n", cells.join(" | "))
}

/// A cell with a link for each picture that it names. The page lies in `docs`, so links begin at `images`.
fn with_links(cell: &str) -> String {
    let mut linked = String::new();
    let mut rest = cell;
    while let Some(at) = rest.find(PICTURES) {
        let after = &rest[at + PICTURES.len()..];
        let is_in_name = |c: char| c.is_ascii_alphanumeric() || matches!(c, '-' | '_' | '.');
        let end = after.find(|c: char| !is_in_name(c)).unwrap_or(after.len());
        // A name may end a sentence.
        let name = after[..end].trim_end_matches('.');
        let _ = write!(linked, "{}[{name}](images/{name})", &rest[..at]);
        rest = &after[name.len()..];
    }
    linked.push_str(rest);
    linked
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

    #[test]
    fn a_picture_becomes_a_link() {
        assert_eq!(with_links("left of docs/images/a-b.png."), "left of [a-b.png](images/a-b.png).");
        assert_eq!(with_links("no picture"), "no picture");
    }
}
